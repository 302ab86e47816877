//! `wiperlab simulate`.

use crate::args::Global;
use crate::failure::{Failure, Outcome};
use crate::files;
use crate::method::MethodArgs;
use clap::Args;
use std::path::{Path, PathBuf};
use std::time::Instant;
use wiperlab::recording::files::{HEADER, trace_csv};
use wiperlab::recording::{FrameGrid, Recording, Traces};
use wiperlab::simulate::outputs::{Audit, Sampler, StateTable, Summary, Transitions};
use wiperlab::simulate::scene::{Output, Scene};
use wiperlab::simulate::{Effort, Run, Sample, Status, run_with};

#[derive(Debug, Args)]
pub struct SimulateArgs {
    /// Scene to run (scene.toml)
    pub scene: PathBuf,
    /// Folder for trace.csv, state.csv, events.csv and summary.json
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    #[command(flatten)]
    pub method: MethodArgs,
}

impl SimulateArgs {
    pub fn run(&self, global: &Global) -> Result<Outcome, Failure> {
        let scene = read_scene(&self.scene)?;
        let effort = self.method.effort(&scene)?;
        let (outputs, summary) = simulate(&scene, effort)?;
        files::write_all(&self.out, &outputs)?;
        if !global.quiet {
            print_summary(&summary, &self.out);
        }
        Ok(if summary.status == Status::Completed { Outcome::Done } else { Outcome::StoppedEarly })
    }
}

/// Reads a scene that the user named.
pub fn read_scene(path: &Path) -> Result<Scene, Failure> {
    Scene::parse(&path.display().to_string(), &files::read_text(path)?).map_err(Failure::input)
}

/// Name and bytes of an output.
type NamedFile = (&'static str, Vec<u8>);

/// What the command has computed: files and the summary.
fn simulate(scene: &Scene, effort: Effort) -> Result<(Vec<NamedFile>, Summary), Failure> {
    let wants = |output: Output| scene.run.outputs.contains(&output);
    let rate = scene.run.sample_rate_hz;
    let count = ((scene.run.stop_s - scene.start_s) * rate * (1.0 + 1e-12)).floor() as usize + 1;
    let grid = FrameGrid { start_s: scene.start_s, frame_rate_hz: rate, frames: count };
    let times = (0..count).map(|i| grid.time_s(i).min(scene.run.stop_s));
    let (mut transitions, mut audit) = (Transitions::default(), Audit::default());

    let mut samples = Vec::with_capacity(if wants(Output::Trace) || wants(Output::State) { count } else { 0 });
    let clock = Instant::now();
    let mut sampler = Sampler::new(times.take(samples.capacity()), |sample| samples.push(*sample));
    let run = run_with(scene, effort, &mut ((&mut sampler, &mut transitions), &mut audit));
    let wall_s = clock.elapsed().as_secs_f64();

    let summary = Summary::new(scene, &run, &audit, wall_s, &effort);
    let mut outputs = Vec::new();
    if wants(Output::Trace) {
        outputs.push(("trace.csv", trace(scene, grid, &samples)?.into_bytes()));
    }
    if wants(Output::State) {
        let mut table = StateTable::default();
        samples.iter().for_each(|sample| table.push(sample));
        outputs.push(("state.csv", table.into_text().into_bytes()));
    }
    if wants(Output::Events) {
        outputs.push(("events.csv", transitions.csv().into_bytes()));
    }
    outputs.push(("summary.json", serde_json::to_vec_pretty(&summary).map_err(Failure::internal)?));
    Ok((outputs, summary))
}

/// `trace.csv`; a run that stopped before its second sample has no grid and leaves the header alone.
fn trace(scene: &Scene, grid: FrameGrid, samples: &[Sample]) -> Result<String, Failure> {
    if samples.len() < 2 {
        return Ok(format!("{HEADER}\n"));
    }
    let glass_y_m = -(scene.linkage.l1_m + scene.linkage.l2_m);
    let column = |value: fn(&Sample) -> f64| samples.iter().map(|sample| Some(value(sample))).collect();
    let traces = Traces {
        tip_x_m: column(|s| s.tip_x_m),
        tip_y_m: vec![Some(glass_y_m); samples.len()],
        head_x_m: column(|s| s.head_x_m),
        head_y_m: column(|s| -s.head_drop_m),
        ..Traces::default()
    };
    let recording = Recording::new(scene.title(), FrameGrid { frames: samples.len(), ..grid }, traces, true).map_err(Failure::internal)?;
    Ok(trace_csv(&recording))
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
    print_line!("energy residual {:.1e}, drift in stick {:.1e} m", summary.energy_residual_relative, summary.max_constraint_drift_m);
    print_line!("model parts: {}", summary.model_parts.join(", "));
    print_line!("written to {}", out.display());
}

/// How a run that did not complete is told to the user.
pub fn early_end(run: &Run) -> Option<String> {
    (run.status != Status::Completed).then(|| format!("{} at {} s: {}", run.status.name(), run.stopped_at_s, run.status.meaning()))
}
