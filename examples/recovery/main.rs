//! Whether fits find known values again: synthetic recordings of different blades, each fitted without
//! knowing its values.
//!
//! `cargo run --release --example recovery` fits 24 twins; `-- 100` fits a hundred; `-- 24 7` with another
//! seed; `-- 24 1 DIR` also writes `recovery.csv` there; `-- 24 1 DIR 20` begins with twin 20. Every
//! recording is synthetic: no camera took any of them.

mod truth;

use std::time::Instant;
use truth::{EXPOSURE_S, SPREAD, Twin, twin};
use wiperlab::fit::information::Z_95;
use wiperlab::fit::job::Job;
use wiperlab::fit::result::{FitResult, ParameterResult};
use wiperlab::fit::uncertainty::Verdict;
use wiperlab::fit::{Measured, Problem};
use wiperlab::simulate::scene::Scene;

const SCENE: &str = include_str!("../../data/scenes/actual-blade.toml");
const JOB: &str = include_str!("job.toml");
const TWINS: u64 = 24;
const SEED: u64 = 1;

fn main() {
    let argument = |at| std::env::args().nth(at);
    let number = |at, default| argument(at).and_then(|n| n.parse().ok()).unwrap_or(default);
    let (twins, seed) = (number(1, TWINS), number(2, SEED));
    let scene = Scene::parse("actual-blade.toml", SCENE).expect("the bundled scene");
    let job = Job::parse("job.toml", JOB).expect("the job of the study");
    println!(
        "{twins} synthetic recordings, seed {seed}; starting states spread by {SPREAD} and unknown to the fit\n"
    );
    let mut lines = Vec::new();
    let mut csv = String::from(
        "twin,frame_rate_hz,missing,parameter,truth,estimate,lower_95,upper_95,verdict,inside\n",
    );
    for number in number(4, 0)..twins {
        let twin = twin(&scene, &job, number, seed);
        let clock = Instant::now();
        let result = fitted(&scene, &job, &twin);
        let wall_s = clock.elapsed().as_secs_f64();
        println!(
            "twin {number}: {} frames/s, {:.1} % lost, {} blades drawn before it ({}); {}, cost {:.2}, {} evaluations in {wall_s:.1} s",
            twin.frame_rate_hz,
            100.0 * twin.dropout_fraction,
            twin.refused.len(),
            counted(&twin.refused),
            result.status.word(),
            result.cost,
            result.evaluations.total,
        );
        println!(
            "  local searches ended at {}",
            result.waterfall.iter().map(|w| format!("{:.1}", w.cost)).collect::<Vec<_>>().join(" ")
        );
        lines.extend(compared(&job, &twin, &result));
        for line in &lines[lines.len() - job.parameters.len()..] {
            csv += &line.csv(number, &twin);
            println!("  {line}");
        }
        let (sum, truth) = (lines.len() - 5, twin.truth[0] + twin.truth[2]);
        let estimate = lines[sum].estimate + lines[sum + 2].estimate;
        lines.push(Line { name: "A + C".to_owned(), truth, estimate, ends: [None, None], verdict: None });
        println!("  {}", lines[lines.len() - 1]);
    }
    summary(&job, &lines);
    if let Some(folder) = argument(3) {
        std::fs::write(std::path::Path::new(&folder).join("recovery.csv"), csv)
            .expect("a folder that can be written");
    }
}

/// A parameter of a twin: what it is and what was found.
struct Line {
    name: String,
    truth: f64,
    estimate: f64,
    ends: [Option<f64>; 2],
    verdict: Option<Verdict>,
}

impl Line {
    fn error(&self) -> f64 {
        self.estimate / self.truth - 1.0
    }

    fn inside(&self) -> bool {
        self.ends[0].is_none_or(|lower| lower <= self.truth)
            && self.ends[1].is_none_or(|upper| self.truth <= upper)
    }

    fn csv(&self, number: u64, twin: &Twin) -> String {
        let [lower, upper] = self.ends.map(|end| end.map_or_else(String::new, |end| end.to_string()));
        let verdict = self.verdict.map_or("", Verdict::word);
        let Self { name, truth, estimate, .. } = self;
        let (rate, missing) = (twin.frame_rate_hz, twin.dropout_fraction);
        format!(
            "{number},{rate},{missing:.4},{name},{truth:e},{estimate:e},{lower},{upper},{verdict},{}\n",
            self.inside()
        )
    }
}

impl std::fmt::Display for Line {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let end = |end: Option<f64>| end.map_or("open".to_owned(), |end| format!("{end:.5}"));
        let Self { name, truth, estimate, .. } = self;
        write!(f, "{name:<36} truth {truth:>9.5}  found {estimate:>9.5} ({:+6.2} %)", 100.0 * self.error())?;
        let Some(verdict) = self.verdict else { return Ok(()) };
        write!(
            f,
            "  {:>9} to {:>9}  {:<14} {}",
            end(self.ends[0]),
            end(self.ends[1]),
            verdict.word(),
            if self.inside() { "" } else { "MISSED" }
        )
    }
}

fn compared(job: &Job, twin: &Twin, result: &FitResult) -> Vec<Line> {
    let line = |(name, truth): (String, &f64)| {
        let ParameterResult { estimate, lower_95, upper_95, verdict, .. } = result.parameters[&name];
        Line { name, truth: *truth, estimate, ends: [lower_95, upper_95], verdict: Some(verdict) }
    };
    job.parameter_names().into_iter().zip(&twin.truth).map(line).collect()
}

/// A fit as the program makes it: camera, noise and lost frames are read from the recording, the start is the
/// scene's.
fn fitted(scene: &Scene, job: &Job, twin: &Twin) -> FitResult {
    let measured = Measured { recording: twin.recording.clone(), exposure_s: Some(EXPOSURE_S) };
    let problem = Problem::new(job.clone(), vec![scene.clone()], vec![measured]);
    problem.expect("a job that goes with the scene").fit().expect("a job that fits the recording")
}

fn counted(reasons: &[String]) -> String {
    let mut counts = std::collections::BTreeMap::new();
    reasons.iter().for_each(|reason| *counts.entry(reason.as_str()).or_insert(0) += 1);
    if counts.is_empty() {
        "none".to_owned()
    } else {
        counts.iter().map(|(reason, n)| format!("{n} {reason}")).collect::<Vec<_>>().join(", ")
    }
}

fn summary(job: &Job, lines: &[Line]) {
    println!(
        "\n| parameter | identified | truth inside | median error | largest error | median half width |"
    );
    println!("|---|---|---|---|---|---|");
    let (mut identified, mut inside) = (0, 0);
    for name in job.parameter_names().iter().map(String::as_str).chain(["A + C"]) {
        let of: Vec<&Line> = lines.iter().filter(|line| line.name == name).collect();
        let known: Vec<&&Line> = of.iter().filter(|line| line.verdict == Some(Verdict::Identified)).collect();
        let held = known.iter().filter(|line| line.inside()).count();
        (identified, inside) = (identified + known.len(), inside + held);
        let errors: Vec<f64> = of.iter().map(|line| 100.0 * line.error().abs()).collect();
        let widths: Vec<f64> =
            known.iter().filter_map(|line| Some(50.0 * (line.ends[1]? / line.ends[0]?).ln())).collect();
        let largest = errors.iter().copied().fold(0.0, f64::max);
        println!(
            "| {name} | {} of {} | {held} | {:.2} % | {largest:.2} % | {:.2} % |",
            known.len(),
            of.len(),
            median(&errors),
            median(&widths)
        );
    }
    let share = 100.0 * inside as f64 / f64::from(u32::try_from(identified.max(1)).unwrap_or(u32::MAX));
    println!(
        "\n{inside} of {identified} identified parameters have their truth inside the 95 % interval ({share:.1} %; {Z_95} deviations of a normal variable)"
    );
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}
