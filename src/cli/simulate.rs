//! `wiperlab simulate`.

use super::files::{SIMULATION_SUMMARY, StreamedTable};
use super::load::{print_warnings, read_scene};
use super::method::MethodArgs;
use super::prelude::*;
use super::run_observer::ProgressObserver;
use super::sensitivities::{self, SensitivityRequest};
use crate::figures::motion;
use crate::recording::files::{HEADER, push_trace_row};
use crate::simulate::outputs::{
    EVENTS_HEADER, EnergyAudit, SampleObserver, SimulationSummary, push_event_row, push_state_row,
    recorded_points_m, sample_times, state_header,
};
use crate::simulate::scene::Scene;
use crate::simulate::scene::contact::OutputTable;
use crate::simulate::{
    ModelSample, Observer, RunMotion, RunStatus, SolutionSegment, SolverOptions, Transition, run_scene_with,
};
use std::time::Instant;

#[derive(Debug, Args)]
pub(crate) struct SimulateArgs {
    /// Scene to run (scene.toml)
    pub scene: PathBuf,
    /// Folder for trace.csv, state.csv, events.csv and summary.json
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    #[command(flatten)]
    pub overwrite: Overwrite,
    #[command(flatten)]
    pub method: MethodArgs,
    /// Parameters with respect to which sensitivities.csv and event_sensitivities.csv contain derivatives,
    /// such as friction.a,start.neck_angle_rad,drive.scale
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub sensitivities: Vec<String>,
    #[command(flatten)]
    pub figures: FigureArgs,
}

impl SimulateArgs {
    pub(crate) fn run(&self, global: &GlobalArgs) -> Outcome {
        let scene = read_scene(&self.scene)?;
        let effort = self.method.integration_effort(&scene)?;
        let sensitivities = SensitivityRequest::parse(&scene, &self.sensitivities, &effort)?;
        let writer = global.write_policy(OutputCommand::Simulate, self.overwrite);
        let watch = ProgressObserver::new([scene.start_s, scene.run.stop_s], "simulate", global.quiet);
        let names = output_names(&scene, sensitivities.is_some());
        let place = OutputFolder::check(&self.out, &writer, &names)?;
        self.figures.check_folder(&[FIGURE], self.overwrite)?;
        print_warnings(&self.scene, &scene.find_implausible(), global);
        let summary = run_to_files(&scene, effort, sensitivities.as_ref(), &place, watch)?;
        if !global.quiet {
            print_summary(&summary, &self.out);
        }
        // the figure needs a run of its own, since the tables keep only one row in memory
        let drawn = || vec![(FIGURE, motion::draw_figure(scene.title(), &RunMotion::simulate(&scene)))];
        self.figures.write_figures(self.overwrite, global.quiet, drawn)?;
        Ok(CommandOutcome::done_if(summary.status == RunStatus::Completed))
    }
}

const FIGURE: &str = "motion";

/// The tables of a run, with their file names.
const TABLES: [(OutputTable, &str); 3] = [
    (OutputTable::Trace, "trace.csv"),
    (OutputTable::State, "state.csv"),
    (OutputTable::Events, "events.csv"),
];

/// Names of the files that the scene requests.
fn output_names(scene: &Scene, sensitivities: bool) -> Vec<&'static str> {
    let asked = TABLES.into_iter().filter(|(output, _)| scene.run.outputs.contains(output));
    let derivatives = sensitivities::SENSITIVITY_FILES.into_iter().filter(|_| sensitivities);
    asked.map(|(_, name)| name).chain(derivatives).chain([SIMULATION_SUMMARY]).collect()
}

/// Runs the scene, and writes every row as soon as it is known.
fn run_to_files(
    scene: &Scene,
    effort: SolverOptions,
    sensitivities: Option<&SensitivityRequest>,
    place: &OutputFolder,
    mut watch: ProgressObserver,
) -> Outcome<SimulationSummary> {
    let table = |output: OutputTable, name, header: &str, least_rows| {
        let new = || Ok(StreamedTable::new(place.create_file(name)?, header, least_rows));
        scene.run.outputs.contains(&output).then(new).transpose()
    };
    // a trace with only one row would have no frame rate
    let mut trace = table(OutputTable::Trace, "trace.csv", HEADER, 2)?;
    let mut state = table(OutputTable::State, "state.csv", state_header(scene), 1)?;
    let mut events = table(OutputTable::Events, "events.csv", EVENTS_HEADER, 1)?;
    let wanted = trace.is_some() || state.is_some();
    let sampler = SampleObserver::new(sample_times(scene).take_while(|_| wanted), |sample: &ModelSample| {
        let points_m = recorded_points_m(&scene.linkage, sample).map(Some);
        trace.iter_mut().for_each(|table| table.add_row(|row| push_trace_row(row, sample.time_s, points_m)));
        state.iter_mut().for_each(|table| table.add_row(|row| push_state_row(row, &scene.linkage, sample)));
    });
    let mut audit = EnergyAudit::default();
    let late = "the run did not stop in time, and nothing of it is written";
    let stops = interrupt::register_stoppable(|| late.to_owned());
    let clock = Instant::now();
    let mut observers = ((sampler, EventTableWriter(events.as_mut())), (&mut audit, &mut watch));
    let run = run_scene_with(scene, effort, &mut observers);
    let elapsed = clock.elapsed();
    if run.status == RunStatus::Interrupted {
        let (at_s, stop_s) = (run.stopped_at_s, scene.run.stop_s);
        stops.announce_stop(&format!("the run has reached {at_s} s of {stop_s} s; what it has is written"));
    }

    let mut tables: Vec<StreamedTable> = [trace, state, events].into_iter().flatten().collect();
    let wall_s = tables.iter().fold(elapsed, |left, table| left.saturating_sub(table.spent)).as_secs_f64();
    let summary = SimulationSummary::new(scene, &run, &audit, wall_s, &effort);
    let bytes = serde_json::to_vec_pretty(&summary).map_err(Failure::internal)?;
    if let Some(sensitivities) = sensitivities.filter(|_| run.status != RunStatus::Interrupted) {
        tables.extend(sensitivities.run_to_tables(scene, effort, place, sample_times(scene))?);
    }
    place.commit(tables.into_iter().map(|table| table.file).collect(), &[(SIMULATION_SUMMARY, bytes)])?;
    Ok(summary)
}

/// Writes transitions to their table.
struct EventTableWriter<'a>(Option<&'a mut StreamedTable>);

impl Observer for EventTableWriter<'_> {
    fn observe_segment(&mut self, _: &SolutionSegment<'_>) {}
    fn observe_transition(&mut self, transition: &Transition) {
        self.0.iter_mut().for_each(|table| table.add_row(|row| push_event_row(row, transition)));
    }
}

fn print_summary(summary: &SimulationSummary, out: &Path) {
    print_line!("{}: {}", summary.status.name(), summary.status_meaning);
    let SimulationSummary { stopped_at_s, transitions, rhs_evaluations, steps, rejected_steps, .. } = summary;
    let wall_ms = 1e3 * summary.wall_s;
    print_line!(
        "stopped at {stopped_at_s} s after {transitions} transitions, {rhs_evaluations} right-hand sides, {steps} steps ({rejected_steps} rejected), {wall_ms:.1} ms"
    );
    let (energy, drift_m) = (summary.energy_residual_relative, summary.max_constraint_drift_m);
    print_line!("energy residual {energy:.1e}, drift in stick {drift_m:.1e} m");
    print_line!("model parts: {}", summary.model_parts.join(", "));
    print_line!("written to {}", out.display());
}
