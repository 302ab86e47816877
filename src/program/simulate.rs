//! `wiperlab simulate`.

use crate::figures::motion;
use crate::program::failure::{Failure, Outcome};
use crate::program::figures::Figures;
use crate::program::files::{Maker, Overwrite, Place, SIMULATION_SUMMARY, Writer};
use crate::program::global::Global;
use crate::program::interrupt;
use crate::program::load::{read_scene, warn_of};
use crate::program::method::MethodArgs;
use crate::program::sensitivities::{self, Sensitivities};
use crate::program::table::Table;
use crate::program::watch::Watch;
use crate::recording::files::{HEADER, push_trace_row};
use crate::simulate::Motion;
use crate::simulate::outputs::{
    Audit, EVENTS_HEADER, STATE_HEADER, Sampler, Summary, points_m, push_event, push_state, sample_times,
};
use crate::simulate::scene::{Output, Scene};
use crate::simulate::{Effort, Observer, Piece, Sample, Status, Transition, run_with};
use clap::Args;
use std::path::{Path, PathBuf};
use std::time::Instant;

#[derive(Debug, Args)]
pub struct SimulateArgs {
    /// Scene to run (scene.toml)
    pub scene: PathBuf,
    /// Folder for trace.csv, state.csv, events.csv and summary.json
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    #[command(flatten)]
    pub overwrite: Overwrite,
    #[command(flatten)]
    pub method: MethodArgs,
    /// Parameters by which sensitivities.csv and event_sensitivities.csv have derivatives, such as
    /// friction.a,start.neck_angle_rad,drive.scale
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub sensitivities: Vec<String>,
    #[command(flatten)]
    pub figures: Figures,
}

impl SimulateArgs {
    pub fn run(&self, global: &Global) -> Result<Outcome, Failure> {
        let scene = read_scene(&self.scene)?;
        let effort = self.method.effort(&scene)?;
        let sensitivities = Sensitivities::of(&scene, &self.sensitivities, &effort)?;
        let writer = Writer::new(Maker::Simulate, self.overwrite).csv(global.csv_dialect);
        let watch = Watch::of([scene.start_s, scene.run.stop_s], "simulate", global);
        let names = names(&scene, sensitivities.is_some());
        let place = Place::check(&self.out, &writer, &names)?;
        self.figures.check(&[FIGURE], self.overwrite)?;
        warn_of(&self.scene, &scene.findings(), global);
        let summary = simulate(&scene, effort, sensitivities.as_ref(), &place, watch)?;
        if !global.quiet {
            print_summary(&summary, &self.out);
        }
        // (a run more than the tables need: they hold no more than a row of it)
        let drawn = || vec![(FIGURE, motion::figure(scene.title(), &Motion::of(&scene)))];
        self.figures.write(self.overwrite, global, drawn)?;
        Ok(if summary.status == Status::Completed { Outcome::Done } else { Outcome::StoppedEarly })
    }
}

const FIGURE: &str = "motion";

/// The tables of a run, and what each is called.
const TABLES: [(Output, &str); 3] =
    [(Output::Trace, "trace.csv"), (Output::State, "state.csv"), (Output::Events, "events.csv")];

/// Files that the scene asks for.
fn names(scene: &Scene, sensitivities: bool) -> Vec<&'static str> {
    let asked = TABLES.into_iter().filter(|(output, _)| scene.run.outputs.contains(output));
    let derivatives = sensitivities::NAMES.into_iter().filter(|_| sensitivities);
    asked.map(|(_, name)| name).chain(derivatives).chain([SIMULATION_SUMMARY]).collect()
}

/// Runs the scene; every row goes to its file as soon as it is known.
fn simulate(
    scene: &Scene,
    effort: Effort,
    sensitivities: Option<&Sensitivities>,
    place: &Place,
    mut watch: Watch,
) -> Result<Summary, Failure> {
    let table = |output: Output, name, header: &str, least_rows| {
        scene
            .run
            .outputs
            .contains(&output)
            .then(|| Ok(Table::new(place.file(name)?, header, least_rows)))
            .transpose()
    };
    // a trace of one row would have no frame rate
    let mut trace = table(Output::Trace, "trace.csv", HEADER, 2)?;
    let mut state = table(Output::State, "state.csv", STATE_HEADER, 1)?;
    let mut events = table(Output::Events, "events.csv", EVENTS_HEADER, 1)?;
    let wanted = trace.is_some() || state.is_some();
    let sampler = Sampler::new(sample_times(scene).take_while(|_| wanted), |sample: &Sample| {
        let points_m = points_m(&scene.linkage, sample).map(Some);
        trace.iter_mut().for_each(|table| table.add(|row| push_trace_row(row, sample.time_s, points_m)));
        state.iter_mut().for_each(|table| table.add(|row| push_state(row, sample)));
    });
    let mut audit = Audit::default();
    let stops = interrupt::stops(|| "the run did not stop in time, and nothing of it is written".to_owned());
    let clock = Instant::now();
    let mut observers = ((sampler, Events(events.as_mut())), (&mut audit, &mut watch));
    let run = run_with(scene, effort, &mut observers);
    let elapsed = clock.elapsed();
    if run.status == Status::Interrupted {
        let (at_s, stop_s) = (run.stopped_at_s, scene.run.stop_s);
        stops.finishing(&format!("the run has reached {at_s} s of {stop_s} s; what it has is written"));
    }

    let mut tables: Vec<Table> = [trace, state, events].into_iter().flatten().collect();
    let wall_s = tables.iter().fold(elapsed, |left, table| left.saturating_sub(table.spent)).as_secs_f64();
    let summary = Summary::new(scene, &run, &audit, wall_s, &effort);
    let bytes = serde_json::to_vec_pretty(&summary).map_err(Failure::internal)?;
    if let Some(sensitivities) = sensitivities.filter(|_| run.status != Status::Interrupted) {
        tables.extend(sensitivities.tables(scene, effort, place, sample_times(scene))?);
    }
    place.finish(tables.into_iter().map(|table| table.file).collect(), &[(SIMULATION_SUMMARY, bytes)])?;
    Ok(summary)
}

/// Transitions to their table.
struct Events<'a>(Option<&'a mut Table>);

impl Observer for Events<'_> {
    fn piece(&mut self, _: &Piece<'_>) {}
    fn transition(&mut self, transition: &Transition) {
        self.0.iter_mut().for_each(|table| table.add(|row| push_event(row, transition)));
    }
}

fn print_summary(summary: &Summary, out: &Path) {
    print_line!("{}: {}", summary.status.name(), summary.status_meaning);
    print_line!(
        "stopped at {} s after {} transitions, {} right-hand sides, {} steps ({} rejected), {:.1} ms",
        summary.stopped_at_s,
        summary.transitions,
        summary.rhs_evaluations,
        summary.steps,
        summary.rejected_steps,
        1e3 * summary.wall_s
    );
    print_line!(
        "energy residual {:.1e}, drift in stick {:.1e} m",
        summary.energy_residual_relative,
        summary.max_constraint_drift_m
    );
    print_line!("model parts: {}", summary.model_parts.join(", "));
    print_line!("written to {}", out.display());
}
