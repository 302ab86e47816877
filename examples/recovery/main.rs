//! Tests whether fits to traces recover known values. The recordings are synthetic: no camera took any of
//! them. They show blades of many sizes and speeds. Half of the blades are simulated by the library, the
//! other half by a separate integration of Lagrange's equations. The camera shares no function with the fit.
//!
//! `cargo run --release --example recovery -- DIR` makes the whole study, which takes hours on two cores. It
//! adds each finished fit to `DIR/recovery.csv`, leaves out the fits that this file already has, and writes
//! the tables of all fits to `DIR/recovery.md`. With the further argument `right` it makes only the blades
//! without a fault, with `faults 6..12` only the six blades 6 to 11 with a fault.

#[path = "../../tests/common/blade.rs"]
#[allow(dead_code)] // only `Parts` is used
mod blade;
mod camera;
mod information;
#[path = "../../tests/common/lagrangian.rs"]
mod lagrangian;
mod linkage_run;
mod table;
mod truth;

use information::{descend_from, find_deviations, read_priors};
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::io::Write;
use std::time::Instant;
use table::{Line, write_table};
use truth::{Blade, Fault, SOUGHT, draw_blade, write_job};
use wiperlab::fit::job::Job;
use wiperlab::fit::law::LawVerdict;
use wiperlab::fit::result::FitResult;
use wiperlab::fit::trace::{Iterate, TraceModel, chi2_per_dof};
use wiperlab::fit::{MeasuredRecording, Problem};
use wiperlab::simulate::scene::Scene;

const SCENE: &str = include_str!("../../data/scenes/actual-blade.toml");
/// Number of blades of a case, `right` or `faults`.
const BLADES: u64 = 60;

fn main() {
    let argument = |at| std::env::args().nth(at);
    let folder = argument(1).expect("a folder, such as data/recovery");
    let wanted = argument(2);
    let range = argument(3).map_or(0..BLADES, |range| {
        let (from, to) = range.split_once("..").expect("a range such as 0..12");
        from.parse().expect("a number")..to.parse().expect("a number")
    });
    std::fs::create_dir_all(&folder).expect("a folder that can be made");
    let kept = format!("{folder}/recovery.csv");
    let old = std::fs::read_to_string(&kept).unwrap_or_default();
    if !old.starts_with(Line::HEAD) {
        std::fs::write(&kept, Line::HEAD).expect("a file that can be written");
    }
    let mut lines = Line::read_all(&old);
    let scene = Scene::parse("actual-blade.toml", SCENE).expect("the bundled scene");
    let prior_sd = default_priors(&scene);
    for case in ["right", "faults"].into_iter().filter(|case| wanted.as_deref().is_none_or(|w| w == *case)) {
        for number in range.clone() {
            if lines.iter().any(|line| (line.case.as_str(), line.blade) == (case, number)) {
                continue;
            }
            let fault = (case == "faults").then(|| Fault::of_number(number));
            let blade = draw_blade(&scene, &prior_sd, number, fault).expect("a blade that runs");
            println!(
                "{case} {number}: size {:.2}, time {:.2}, {} frames/s, curvature {:.3} 1/m, tip {:.1e} m from the library's in the first 50 ms",
                blade.size,
                blade.time,
                blade.filming.frame_rate_hz.round(),
                blade.filming.curvature_per_m,
                blade.apart_m
            );
            let found = fit_blade(&blade, number, fault);
            found.iter().for_each(|line| print!("{}", line.csv()));
            keep_lines(&kept, &found);
            lines.extend(found);
        }
    }
    let text = write_table(&lines);
    println!("\n{text}");
    std::fs::write(format!("{folder}/recovery.md"), text).expect("a folder that can be written");
}

/// Adds the lines of a fit to the file.
fn keep_lines(path: &str, found: &[Line]) {
    let mut file = std::fs::OpenOptions::new().append(true).open(path).expect("a file to write");
    let text: String = found.iter().map(Line::csv).collect();
    file.write_all(text.as_bytes()).expect("a file that can be written");
}

/// Standard deviations that the fit gives the default priors of the constants of a scene.
fn default_priors(scene: &Scene) -> BTreeMap<String, f64> {
    let none = BTreeMap::new();
    let blade = draw_blade(scene, &none, 0, None).expect("a blade that runs");
    read_priors(
        &make_problem(&blade, &blade.believed, 0).trace_model().expect("a trace").expect("a tracked head"),
    )
}

/// The problem of fitting the film of a blade, with the scene `believed` in the job.
fn make_problem(blade: &Blade, believed: &Scene, number: u64) -> Problem {
    let job = Job::parse("job.toml", &write_job(blade, number)).expect("a job");
    let filming = &blade.filming;
    let [steps, open] = filming.steps.map(|steps| steps as f64);
    let exposure_s = Some(open / steps / filming.frame_rate_hz);
    let measured = MeasuredRecording { recording: blade.recording.clone(), exposure_s };
    Problem::new(job, vec![believed.clone()], vec![measured]).expect("a job that goes with the scene")
}

/// Verdict of a fit on the law of its scene, which is the true law.
fn describe_law(result: &FitResult) -> &'static str {
    let Some(law) = &result.law else { return "none" };
    let own = law.candidates.first().map(|own| &own.law);
    match law.verdict {
        LawVerdict::NoneExplains => "none",
        LawVerdict::Undecided => "undecided",
        LawVerdict::Preferred if law.chosen.as_ref() == own => "preferred",
        LawVerdict::Preferred => "lost",
    }
}

/// Fits the film of a blade. Returns one line for each parameter.
fn fit_blade(blade: &Blade, number: u64, fault: Option<Fault>) -> Vec<Line> {
    let problem = make_problem(blade, &blade.believed, number);
    let begun = Instant::now();
    let result = problem.fit();
    let seconds = begun.elapsed().as_secs_f64();
    // a descent from the true values gives a cost to compare with, and the Cramér-Rao standard deviations
    let truth = descend_from(&problem, &blade.filmed);
    const STATE_RAD: f64 = 1e-4;
    let lip_rad_per_s = TAU * blade.believed.value("blade.lip_natural_frequency_hz").unwrap_or(f64::NAN);
    let rate = STATE_RAD * lip_rad_per_s;
    let state_steps = [STATE_RAD, STATE_RAD, rate, rate];
    let deviations = truth.as_ref().and_then(|(model, at)| find_deviations(model, at, state_steps));
    let excess = |(model, at): &(TraceModel, Iterate)| at.cost - chi2_per_dof(model, at).1 as f64;
    let above_truth = |result: &FitResult| {
        let dof = result.misfit.as_ref()?.stages.last()?.dof as f64;
        Some(result.cost - dof - excess(truth.as_ref()?))
    };
    let visible = fault.and_then(|fault| match fault {
        Fault::Constant(name) => {
            // how much lower the cost is with the true value of this constant as the mean of its prior
            let right = blade.believed.with_parameter(name, blade.filmed.value(name)?).ok()?;
            let right = descend_from(&make_problem(blade, &right, number), &blade.filmed)?;
            Some(excess(truth.as_ref()?) - excess(&right))
        }
        Fault::Marker | Fault::Contact => None,
    });
    let line = |(name, ..): (&str, [f64; 2], [f64; 2])| {
        let mut line = Line {
            case: if fault.is_some() { "faults" } else { "right" }.to_owned(),
            blade: number,
            maker: if number.is_multiple_of(2) { "library" } else { "Lagrange" }.to_owned(),
            fault: fault.map_or("none", Fault::name).to_owned(),
            parameter: name.to_owned(),
            truth: blade.filmed.value(name).unwrap_or(f64::NAN),
            seconds,
            bound: deviations.as_ref().and_then(|all| all.get(name).copied()),
            visible,
            ..Line::default()
        };
        let mut reasons = Vec::new();
        match &result {
            Ok(result) => {
                let found = &result.parameters[name];
                line.estimate = found.estimate;
                line.ends = [found.lower_95, found.upper_95];
                line.verdict = found.verdict.name().to_owned();
                line.explained = result.misfit.as_ref().is_some_and(|misfit| misfit.explained);
                line.above_truth = above_truth(result);
                line.law = describe_law(result).to_owned();
                reasons.extend(result.misfit.iter().flat_map(|misfit| &misfit.reasons).chain(&found.reasons));
                line.reasons = reasons.iter().map(|r| r.replace(',', ";")).collect::<Vec<_>>().join(" | ");
            }
            Err(error) => {
                line.verdict = "error".to_owned();
                line.reasons = error.to_string().replace([',', '\n'], ";");
            }
        }
        line
    };
    SOUGHT.into_iter().map(line).collect()
}
