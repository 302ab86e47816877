//! Whether fits to traces find known values again: synthetic recordings of different blades, each fitted
//! without knowing its values.
//!
//! `cargo run --release --example recovery` makes the whole study, an hour of two cores; `-- DIR` keeps every
//! fit in `DIR/recovery.csv` as it ends, goes on from there, and writes the table `DIR/recovery.md`;
//! `-- DIR blades,tip` makes these cases alone; `-- DIR blades 3` of three blades each. Every recording is
//! synthetic: no camera took any of them.

mod camera;
mod case;
mod table;
mod truth;

use case::{Case, cases};
use std::collections::HashSet;
use std::io::Write;
use table::{Line, table};
use truth::{Blade, EXPOSURE_S, Filming, blade};
use wiperlab::fit::job::Job;
use wiperlab::fit::result::FitResult;
use wiperlab::fit::trace::{TraceSearchSettings, search_trace};
use wiperlab::fit::{MeasuredRecording, Problem};
use wiperlab::recording::Recording;
use wiperlab::simulate::scene::Scene;

const SCENE: &str = include_str!("../../data/scenes/actual-blade.toml");
/// Parameters, and the features that every blade shows.
const JOB: &str = include_str!("job.toml");

fn main() {
    let argument = |at| std::env::args().nth(at);
    let folder = argument(1);
    if let Some(folder) = &folder {
        std::fs::create_dir_all(folder).expect("a folder that can be made");
    }
    let wanted: Option<HashSet<String>> = argument(2).map(|s| s.split(',').map(str::to_owned).collect());
    let most: u64 = argument(3).and_then(|n| n.parse().ok()).unwrap_or(u64::MAX);
    let scene = Scene::parse("actual-blade.toml", SCENE).expect("the bundled scene");
    let chosen = Job::parse("job.toml", JOB).expect("the job of the study");
    let kept = folder.as_ref().map(|folder| format!("{folder}/recovery.csv"));
    let old = kept.as_ref().and_then(|path| std::fs::read_to_string(path).ok()).unwrap_or_default();
    let mut lines = Line::read(&old);
    for case in cases() {
        if wanted.as_ref().is_some_and(|wanted| !wanted.contains(case.name)) {
            continue;
        }
        for number in 0..case.blades.min(most) {
            let blade = blade(&scene, &chosen, number);
            for run in 0..case.draws * case.seeds * case.corners.max(1) {
                if lines.iter().any(|line| line.is(case.name, number, run)) {
                    continue;
                }
                let found = one(&case, &scene, &chosen, &blade, number, run);
                for line in &found {
                    println!("{line}");
                }
                if let Some(path) = &kept {
                    keep(path, &found);
                }
                lines.extend(found);
            }
        }
    }
    let text = table(&cases(), &lines);
    println!("\n{text}");
    if let Some(folder) = folder {
        std::fs::write(format!("{folder}/recovery.md"), text).expect("a folder that can be written");
    }
}

/// Adds what a fit found to the file.
fn keep(path: &str, found: &[Line]) {
    let mut file = std::fs::OpenOptions::new().create(true).append(true).open(path).expect("a file to write");
    let is_empty = file.metadata().is_ok_and(|data| data.len() == 0);
    let text: String = found.iter().map(Line::csv).collect();
    let head = if is_empty { Line::HEAD } else { "" };
    file.write_all(format!("{head}{text}").as_bytes()).expect("a file that can be written");
}

/// One fit of a case: a line a parameter.
fn one(case: &Case, scene: &Scene, chosen: &Job, blade: &Blade, number: u64, run: u64) -> Vec<Line> {
    let draw = if case.draws > 1 { run } else { 0 };
    let filming = Filming { draw, ..case.filming };
    let filmed = case.filmed(scene);
    let recording = blade.film(&filmed, chosen, number, filming).expect("a blade that runs");
    let recording = if case.spoilt { camera::spoilt(&recording, 77 + number) } else { recording };
    let seed = if case.seeds > 1 { run + 1 } else { 1 };
    let problem = problem(case, scene, seed, recording);
    let corner = (case.corners > 0).then_some(run);
    let found = match corner {
        Some(corner) => from_corner(&problem, corner),
        None => of(&problem.fit().expect("a job that fits the recording")),
    };
    let line = |((parameter, found), truth): ((String, Found), &f64)| Line {
        case: case.name.to_owned(),
        blade: number,
        run,
        parameter,
        truth: *truth,
        estimate: found.estimate,
        ends: found.ends,
        verdict: found.verdict,
        explained: found.explained,
    };
    chosen.parameter_names().into_iter().zip(found).zip(&blade.truth).map(line).collect()
}

fn problem(case: &Case, scene: &Scene, seed: u64, recording: Recording) -> Problem {
    let parameters = &JOB[..JOB.find("[[component]]").expect("a job with components")];
    let head = parameters.replace("seed = 1", &format!("seed = {seed}\n{}", case.job));
    let job = Job::parse("job.toml", &format!("{head}\n[[trace]]\n{}\n", case.trace)).expect("a job");
    let measured = MeasuredRecording { recording, exposure_s: Some(EXPOSURE_S) };
    Problem::new(job, vec![scene.clone()], vec![measured]).expect("a job that goes with the scene")
}

/// What a fit says of a parameter.
struct Found {
    estimate: f64,
    ends: [Option<f64>; 2],
    verdict: String,
    explained: bool,
}

fn of(result: &FitResult) -> Vec<Found> {
    let explained = result.misfit.as_ref().is_some_and(|misfit| misfit.explained);
    let names = Job::parse("job.toml", JOB).expect("the job of the study").parameter_names();
    let found = |name: String| {
        let parameter = &result.parameters[&name];
        Found {
            estimate: parameter.estimate,
            ends: [parameter.lower_95, parameter.upper_95],
            verdict: parameter.verdict.name().to_owned(),
            explained,
        }
    };
    names.into_iter().map(found).collect()
}

/// The end of a search whose first start is a corner of the bounds, a twentieth of their width inside.
fn from_corner(problem: &Problem, corner: u64) -> Vec<Found> {
    /// Which parameters begin at the upper end: bit by bit, one number a corner.
    const CORNERS: [u64; 5] = [0b00000, 0b11111, 0b01010, 0b10101, 0b00111];
    const INSIDE: f64 = 0.05;
    let mut model = problem.trace_model().expect("a trace").expect("a head that is tracked");
    let parameters = model.unknowns.0.iter_mut().filter(|unknown| unknown.prior.is_none());
    for (bit, unknown) in parameters.enumerate() {
        let [low, high] = unknown.range;
        let is_upper = CORNERS[corner as usize % CORNERS.len()] >> bit & 1 == 1;
        unknown.start = low + (high - low) * if is_upper { 1.0 - INSIDE } else { INSIDE };
    }
    let settings = TraceSearchSettings { segment_s: problem.segment_s().to_vec(), twins: 0 };
    let found = search_trace(&model, &settings, 1 + corner, &mut ());
    let known = found.assessment.expect("a search that ends");
    let identified = known.doubts.is_empty();
    let found = |estimate: &wiperlab::fit::trace::UnknownEstimate| Found {
        estimate: estimate.value,
        ends: estimate.widest_95().map(Some),
        verdict: if identified { "identified" } else { "not-identified" }.to_owned(),
        explained: true,
    };
    known.estimates.iter().take(5).map(found).collect()
}
