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
use crate::simulate::predicted_error::run_with_predicted_errors;
use crate::simulate::scene::Scene;
use crate::simulate::scene::contact::OutputTable;
use crate::simulate::{
    IntegrationMethod, ModelSample, Observer, RunMotion, RunStatus, SolutionSegment, SolverOptions,
    Transition, run_scene_with,
};
use std::fmt::Write as _;
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
    /// Do not predict the errors of the transition times; the run then takes a quarter of the time
    #[arg(long)]
    pub no_predicted_errors: bool,
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
        let is_predicted = !self.no_predicted_errors && effort.method == IntegrationMethod::Taylor;
        let summary = run_to_files(&scene, (effort, is_predicted), sensitivities.as_ref(), &place, watch)?;
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
    (effort, is_predicted): (SolverOptions, bool),
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
    let events_header = format!("{EVENTS_HEADER},predicted_time_error_s");
    let mut events = table(OutputTable::Events, "events.csv", &events_header, 1)?;
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
    let mut observers = (sampler, (&mut audit, &mut watch));
    let mut receive = |transition: &Transition, predicted_s: Option<f64>| {
        events.iter_mut().for_each(|table| {
            table.add_row(|row| {
                push_event_row(row, transition);
                let _ = match predicted_s {
                    Some(error) => writeln!(row, ",{error:.2e}"),
                    None => writeln!(row, ","),
                };
            });
        });
    };
    let (run, predicted) = if is_predicted {
        let predicted = run_with_predicted_errors(scene, effort, &mut observers, receive);
        (predicted.run, Some(predicted))
    } else {
        let mut observers =
            (observers, TransitionReceiver(|transition: &Transition| receive(transition, None)));
        (run_scene_with(scene, effort, &mut observers), None)
    };
    let elapsed = clock.elapsed();
    if run.status == RunStatus::Interrupted {
        let (at_s, stop_s) = (run.stopped_at_s, scene.run.stop_s);
        stops.announce_stop(&format!("the run has reached {at_s} s of {stop_s} s; what it has is written"));
    }

    let mut tables: Vec<StreamedTable> = [trace, state, events].into_iter().flatten().collect();
    let wall_s = tables.iter().fold(elapsed, |left, table| left.saturating_sub(table.spent)).as_secs_f64();
    let mut summary = SimulationSummary::new(scene, &run, &audit, wall_s, &effort);
    if let Some(predicted) = predicted {
        summary.predicted_time_error_s = predicted.largest_error_s;
        summary.undetermined_after_s = Some(predicted.undetermined_after_s);
    }
    let bytes = serde_json::to_vec_pretty(&summary).map_err(Failure::internal)?;
    if let Some(sensitivities) = sensitivities.filter(|_| run.status != RunStatus::Interrupted) {
        tables.extend(sensitivities.run_to_tables(scene, effort, place, sample_times(scene))?);
    }
    place.commit(tables.into_iter().map(|table| table.file).collect(), &[(SIMULATION_SUMMARY, bytes)])?;
    Ok(summary)
}

/// Calls a function with each transition.
struct TransitionReceiver<F>(F);

impl<F: FnMut(&Transition)> Observer for TransitionReceiver<F> {
    fn observe_segment(&mut self, _: &SolutionSegment<'_>) {}
    fn observe_transition(&mut self, transition: &Transition) {
        (self.0)(transition);
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
    let undetermined_after_s = summary.undetermined_after_s.flatten();
    if let Some(error_s) = summary.predicted_time_error_s {
        let until = undetermined_after_s.map_or_else(String::new, |after| format!(" up to {after:.6} s"));
        print_line!("predicted error of the transition times: at most {error_s:.1e} s{until}");
    }
    if let Some(after) = undetermined_after_s {
        print_line!(
            "after {after:.6} s the order of the transitions is not determined at this tolerance; a lower --relative-tolerance may help"
        );
    }
    print_line!("model parts: {}", summary.model_parts.join(", "));
    print_line!("written to {}", out.display());
}
