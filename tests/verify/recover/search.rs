//! The search on models with known answers; what becomes of a fit that is cut or resumed is in
//! `tests/regress/resume.rs`.

use super::ringing::ringing;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};
use wiperlab::checkpoint;
use wiperlab::checkpoint::{CheckpointError, CheckpointSink};
use wiperlab::feature::ValueComparison;
use wiperlab::fit::bounds::{Bounds, BoundsSpacing};
use wiperlab::fit::checkpoint::{FitCheckpoint, FitHeader};
use wiperlab::fit::evaluation::Observed;
use wiperlab::fit::evaluation::{FailureReason, RunFailure};
use wiperlab::fit::journal::{FitProgress, Journal, StopReason};
use wiperlab::fit::ledger::Ledger;
use wiperlab::fit::model::{Draw, FeaturePredictor, Model};
use wiperlab::fit::objective::Objective;
use wiperlab::fit::result::{FitResult, FitStatus};
use wiperlab::fit::search::{STAGNANT_GENERATIONS, SearchSettings};
use wiperlab::fit::search::{SearchTermination, search_minimum};
use wiperlab::fit::target_value::TargetValue;
use wiperlab::fit::uncertainty::ParameterVerdict;
use wiperlab::fit::{
    FitContext, FitError, fit_features,
    job::{FreeParameter, Job},
    job_warnings,
};
use wiperlab::recording::Recording;

/// A journal in memory; refuses lines after `room`.
struct Memory {
    text: String,
    room: usize,
}

impl Memory {
    fn new() -> Self {
        Self { text: String::new(), room: usize::MAX }
    }
}

impl CheckpointSink for Memory {
    fn append(&mut self, lines: &str) -> Result<(), String> {
        for line in lines.split_inclusive('\n') {
            self.room = self.room.checked_sub(1).ok_or("no space left")?;
            self.text += line;
        }
        Ok(())
    }
}

fn carry_on(_: &FitProgress) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

type Features = Result<Vec<Observed>, RunFailure>;

struct Fake<F>(F);

impl<F: Fn(&[f64]) -> Features + Sync> FeaturePredictor for Fake<F> {
    fn predict_features(&self, values: &[f64]) -> Features {
        (self.0)(values)
    }

    fn simulate_twin(&self, values: &[f64], _: u64) -> Features {
        (self.0)(values)
    }
}

fn values(features: &[f64]) -> Features {
    Ok(features.iter().map(|f| Observed::from_value(*f)).collect())
}

const SETTINGS: SearchSettings = SearchSettings {
    seed: 1,
    global_evaluations: 600,
    local_evaluations: 900,
    particles: 20,
    stagnation_generations: STAGNANT_GENERATIONS,
    starts: 3,
};

/// What a search over parameters from 0.1 to 10 found: how it ended, the best values, cost and failure,
/// evaluations, and failures by reason.
struct Found {
    ended: SearchTermination,
    values: Vec<f64>,
    cost: f64,
    failure: Option<RunFailure>,
    total: usize,
    failures: Vec<(String, usize)>,
}

fn find(
    dimensions: usize,
    targets: &[(f64, f64)],
    limit: usize,
    model: impl Fn(&[f64]) -> Features + Sync,
) -> Found {
    let axes = vec![FreeParameter::from(Bounds::new(0.1, 10.0, BoundsSpacing::Log).unwrap()); dimensions];
    let target = |(i, (value, sd)): (usize, &(f64, f64))| TargetValue {
        name: i.to_string(),
        value: *value,
        sd: *sd,
        scatter: 0.0,
        measure: ValueComparison::Log,
        last: false,
        calibration: None,
    };
    let model = Fake(model);
    let objective = Objective::new(axes, targets.iter().enumerate().map(target).collect(), &model);
    let (mut journal, mut watch) = (Memory::new(), carry_on);
    let journal = Journal::new(&FitContext::default(), FitHeader::default(), &mut journal, &mut watch);
    let mut ledger = Ledger::new(&objective, journal.unwrap());
    let ended = search_minimum(&mut ledger, dimensions, &SETTINGS, limit).termination;
    let best = ledger.best_evaluation().unwrap().clone();
    Found {
        ended,
        values: best.values,
        cost: best.cost,
        failure: best.failure,
        total: ledger.run_evaluations().len(),
        failures: ledger.count_failures().into_iter().map(|(reason, n)| (reason.to_string(), n)).collect(),
    }
}

#[test]
fn a_known_optimum_is_recovered() {
    let found = find(3, &[(0.6, 0.006), (3.0, 0.03), (0.2, 0.002)], usize::MAX, |p| {
        values(&[p[0] * p[1], p[1] * p[2].sqrt(), p[0] * p[2]])
    });
    // p0 p1 = 0.6, p1 sqrt(p2) = 3, p0 p2 = 0.2
    assert_eq!(found.ended, SearchTermination::Converged);
    assert!(
        (found.values[0] * found.values[1] - 0.6).abs() < 1e-4
            && (found.values[0] * found.values[2] - 0.2).abs() < 1e-4,
        "{:?}",
        found.values
    );
    assert!(found.cost < 1e-4 && found.failures.is_empty());
    assert!(found.total <= 1500);
}

#[test]
fn half_a_box_of_nan_is_counted_and_avoided() {
    let nan = AtomicUsize::new(0);
    let found = find(2, &[(1.05, 0.01), (2.0, 0.02)], usize::MAX, |p| {
        if p[0] < 1.0 {
            nan.fetch_add(1, Ordering::Relaxed);
            return values(&[f64::NAN, 1.0]);
        }
        values(&[p[0], p[1]])
    });
    assert_eq!(found.ended, SearchTermination::Converged);
    assert!(
        (found.values[0] - 1.05).abs() < 1e-4 && (found.values[1] - 2.0).abs() < 1e-4,
        "{:?}",
        found.values
    );
    assert!(nan.load(Ordering::Relaxed) > 0);
    assert_eq!(found.failures, [("not-a-number".to_owned(), nan.into_inner())]);
}

#[test]
fn a_model_that_panics_here_and_there_is_survived() {
    let found = find(2, &[(3.0, 0.03), (2.0, 0.02)], usize::MAX, |p| {
        assert!(p[0] > 0.3, "too small: {}", p[0]);
        values(&[p[0], p[1]])
    });
    assert_eq!(found.ended, SearchTermination::Converged);
    assert!((found.values[0] - 3.0).abs() < 1e-4, "{:?}", found.values);
    assert_eq!(found.failures.len(), 1);
    assert!(found.failures[0].0 == "panic" && found.failures[0].1 > 0);
}

#[test]
fn a_model_that_always_fails_ends_within_its_budget() {
    let found = find(2, &[(1.0, 0.1)], usize::MAX, |_| {
        Err(RunFailure::new(FailureReason::Ended(wiperlab::simulate::RunStatus::ContactLost), "at once", 0.0))
    });
    assert!(found.total >= 20 && found.total <= 1500);
    assert_eq!(found.failures, [("contact-lost".to_owned(), found.total)]);
    assert_eq!(
        found.failure.unwrap().reason,
        FailureReason::Ended(wiperlab::simulate::RunStatus::ContactLost)
    );
    assert!(found.cost.is_finite());
}

#[test]
fn failures_lead_towards_where_the_model_runs() {
    // it runs in 0.4 % of the box only; the run gets further the nearer the point
    let found = find(2, &[(9.5, 0.1), (9.5, 0.1)], usize::MAX, |p| {
        let distance = (10.0 / p[0]).ln().max((10.0 / p[1]).ln()) / 100.0_f64.ln();
        if distance > 0.06 {
            Err(RunFailure::new(
                FailureReason::Ended(wiperlab::simulate::RunStatus::Jammed),
                "",
                1.0 - distance,
            ))
        } else {
            values(p)
        }
    });
    assert_eq!(found.failure, None);
    assert!(
        (found.values[0] - 9.5).abs() < 1e-3 && (found.values[1] - 9.5).abs() < 1e-3,
        "{:?}",
        found.values
    );
}

#[test]
fn a_narrow_valley_is_followed_to_its_end() {
    // a hundred times longer than wide, and curved
    let found = find(2, &[(2.0, 2e-3), (3.0, 0.3)], usize::MAX, |p| {
        values(&[p[1] * (0.3 * (p[0].ln()).powi(2)).exp(), p[0]])
    });
    assert!(
        (found.values[0] - 3.0).abs() < 1e-2,
        "{:?} {} {:?} {}",
        found.values,
        found.cost,
        found.ended,
        found.total
    );
    assert!(found.cost < 2e-3 && found.ended == SearchTermination::Converged);
}

#[test]
fn the_limit_is_kept_to_the_evaluation() {
    for limit in [1, 19, 20, 333, 550] {
        let found =
            find(2, &[(1.0, 1e-6), (2.0, 1e-6)], limit, |p| values(&[p[0] * p[1], p[0] / p[1].sqrt()]));
        assert_eq!((found.ended, found.total), (SearchTermination::Stopped(StopReason::Budget), limit));
    }
}

const JOB: &str = r#"format = 1
title = "two tones"
scene = "s.toml"
seed = 3
[camera]
frame_rate_hz = 1000
exposure_s = 0.0
[[parameter]]
name = "blade.stiffness"
lower = 1000.0
upper = 30000.0
scale = "log"
[[parameter]]
name = "friction.a"
lower = 0.0
upper = 0.01
scale = "linear"
[[component]]
name = "low"
channel = "deflection"
window = "0.05..0.45"
band_hz = [20, 200]
target_hz = 80
target_sd_hz = 0.4
[[feature]]
kind = "mean-deflection"
window = "0.05..0.45"
target = 4e-3
target_sd = 1e-4
[search]
global_evaluations = 120
local_evaluations = 600
particles = 12
"#;

/// A blade whose deflection rings at `sqrt(stiffness)` Hz about `a`; it loses contact when stiff.
struct Ringing {
    calls: AtomicUsize,
    contact_lost_above: f64,
}

impl Ringing {
    fn new() -> Self {
        Self { calls: AtomicUsize::new(0), contact_lost_above: 20_000.0 }
    }
}

impl Model for Ringing {
    fn record_condition(&self, values: &[f64], _: usize, draw: Draw) -> Result<Recording, RunFailure> {
        self.calls.fetch_add(1, Ordering::Relaxed);
        if values[0] > self.contact_lost_above {
            return Err(RunFailure::new(
                FailureReason::Ended(wiperlab::simulate::RunStatus::ContactLost),
                "normal force below zero",
                0.5,
            ));
        }
        // a twin's mean and frequency differ by as much as the job's deviations
        let shift = if draw.noise == 0 { 0.0 } else { (draw.noise as f64 * 2.4).sin() * 2.0_f64.sqrt() };
        ringing(500, values[1] + 1e-4 * shift, values[0].sqrt() + 0.4 * shift)
    }
}

fn job(text: &str) -> Job {
    Job::parse_with_names("job.toml", text, &["blade.stiffness", "friction.a"]).unwrap()
}

fn context<'a>(resume: Option<(&'a str, &'a FitCheckpoint)>) -> FitContext<'a> {
    FitContext { fingerprint: "f", version: "0.1.0", max_evaluations: None, resume }
}

fn run(text: &str, model: &dyn Model, context: &FitContext) -> (Result<FitResult, FitError>, String) {
    let mut journal = Memory::new();
    let result = fit_features(&job(text), &[None], model, context, &mut journal, &mut carry_on);
    (result, journal.text)
}

#[test]
fn a_fit_to_published_numbers_finds_both_parameters() {
    let model = Ringing::new();
    let (result, journal) = run(JOB, &model, &context(None));
    let result = result.unwrap();
    assert_eq!(result.status, FitStatus::Converged);
    let (stiffness, a) = (&result.parameters["blade.stiffness"], &result.parameters["friction.a"]);
    assert!(
        (stiffness.estimate - 6400.0).abs() < 20.0 && (a.estimate - 4e-3).abs() < 1e-5,
        "{stiffness:?} {a:?}"
    );
    assert_eq!(
        (stiffness.verdict, a.verdict, result.rank),
        (ParameterVerdict::Identified, ParameterVerdict::Identified, 2)
    );
    // sd ln stiffness = 2 * 0.4/80
    assert!((stiffness.upper_95.unwrap() / stiffness.estimate).ln() / (1.96 * 0.01) - 1.0 < 0.1);
    assert!((result.sensitivities["low"]["blade.stiffness"].unwrap() - 0.5).abs() < 0.02);
    assert!(result.components[0].pass && result.features[0].pass && result.components_pass());
    // twins are made beside the evaluations, and the best model is read once more
    assert_eq!(result.evaluations.total, model.calls.into_inner() - result.twins - 1);
    assert_eq!(journal.lines().count(), result.evaluations.total + 1);
    assert!(result.evaluations.failed[&FailureReason::Ended(wiperlab::simulate::RunStatus::ContactLost)] > 0);
}

#[test]
fn a_fit_can_be_stopped_from_outside() {
    let mut journal = Memory::new();
    let mut seen = 0;
    let mut watch = |progress: &FitProgress| {
        seen = progress.evaluations;
        if progress.evaluations == 30 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let result =
        fit_features(&job(JOB), &[None], &Ringing::new(), &context(None), &mut journal, &mut watch).unwrap();
    let total = result.evaluations.total;
    assert_eq!(
        (result.status, seen, journal.text.lines().count()),
        (FitStatus::Interrupted, total, total + 1)
    );
    // what was computed along with the last one counts
    assert!((30..30 + 2 * rayon::current_num_threads()).contains(&total), "{total}");
}

#[test]
fn a_journal_that_cannot_be_written_ends_the_fit() {
    let mut journal = Memory { text: String::new(), room: 9 };
    let error =
        fit_features(&job(JOB), &[None], &Ringing::new(), &context(None), &mut journal, &mut carry_on)
            .unwrap_err();
    assert_eq!(error, FitError::JournalWrite { problem: "no space left".to_owned() });
    assert_eq!(journal.text.lines().count(), 9);
}

#[test]
fn a_journal_of_another_fit_is_refused() {
    let (_, text) = run(JOB, &Ringing::new(), &FitContext { max_evaluations: Some(3), ..context(None) });
    let journal: FitCheckpoint = checkpoint::read_checkpoint("j", &text).unwrap().unwrap();
    let (refused, appended) =
        run(JOB, &Ringing::new(), &FitContext { fingerprint: "g", ..context(Some(("j", &journal))) });
    assert!(matches!(refused, Err(FitError::Journal(CheckpointError::OtherProblem { .. }))));
    assert_eq!(appended, "");
}

#[test]
fn fewer_features_than_parameters_are_said_before_and_after() {
    let start = JOB.find("[[feature]]").unwrap();
    let text = JOB[..start].to_owned() + &JOB[JOB.find("[search]").unwrap()..];
    let before = job_warnings(&job(&text));
    assert_eq!(before.len(), 1);
    assert!(before[0].starts_with("1 informative feature for 2 parameters: they can fix at most 1 combination of the parameters and leave 1 open"));
    let result = run(&text, &Ringing::new(), &context(None)).0.unwrap();
    assert!(
        result
            .notes
            .iter()
            .any(|n| n.starts_with("1 informative feature for 2 parameters: they fix 1 combination")),
        "{:?}",
        result.notes
    );
    let a = &result.parameters["friction.a"];
    assert_eq!(
        (a.verdict, a.lower_95, a.upper_95, result.rank),
        (ParameterVerdict::NotIdentified, None, None, 1)
    );
    assert_eq!(result.parameters["blade.stiffness"].verdict, ParameterVerdict::Identified);
    assert_eq!(job_warnings(&job(JOB)), Vec::<String>::new());
}

#[test]
fn a_model_that_never_runs_is_refused_and_nothing_is_written() {
    let (refused, journal) = run(JOB, &Ringing { contact_lost_above: 0.0, ..Ringing::new() }, &context(None));
    let words = refused.unwrap_err().to_string();
    assert!(
        words.starts_with("this job cannot be fitted: the model fails at all 5 places")
            && words.contains("contact-lost: normal force below zero"),
        "{words}"
    );
    assert_eq!(journal, "");
}

#[test]
fn features_that_no_parameter_moves_are_refused() {
    // stiffness and mean do not reach a band far above
    let text = JOB
        .replace("lower = 1000.0\nupper = 30000.0", "lower = 6400.0\nupper = 6400.01")
        .replace("lower = 0.0\nupper = 0.01", "lower = 0.004\nupper = 0.00400001");
    let words = run(&text, &Ringing::new(), &context(None)).0.unwrap_err().to_string();
    assert!(words.contains("no parameter moves any feature"), "{words}");
}

#[test]
fn a_model_that_fails_on_most_of_the_box_is_said_and_fitted() {
    let (result, _) =
        run(&JOB.replace("upper = 30000.0", "upper = 6000000.0"), &Ringing::new(), &context(None));
    let result = result.unwrap();
    assert!((result.parameters["blade.stiffness"].estimate - 6400.0).abs() < 20.0, "{:?}", result.parameters);
    assert!(
        result
            .notes
            .iter()
            .any(|n| n.starts_with("the model fails at ") && n.contains("places that were probed")),
        "{:?}",
        result.notes
    );
    assert!(
        result.gate.probes.iter().any(|p| p.failure.is_some())
            && result.gate.probes.iter().any(|p| p.rank == 2)
    );
}

#[test]
fn the_waterfall_lists_every_local_search_and_the_lowest_is_the_result() {
    let result = run(JOB, &Ringing::new(), &context(None)).0.unwrap();
    assert!(!result.waterfall.is_empty());
    assert!(
        result.waterfall.windows(2).all(|w| w[0].cost <= w[1].cost)
            && result.waterfall.iter().all(|w| w.cost <= w.start_cost)
    );
    assert!(result.waterfall[0].cost >= result.cost);
}

#[test]
fn a_recording_held_out_is_predicted_and_not_fitted() {
    let camera = JOB.find("[camera]").unwrap();
    let recordings = "[[recording]]\nname = \"fitted\"\npath = \"r\"\n[[recording]]\nname = \"held\"\npath = \"s\"\nheld_out = true\n";
    let text = JOB[..camera].to_owned() + recordings + &JOB[JOB.find("[[parameter]]").unwrap()..];
    let text = text
        .replace("target_hz = 80\ntarget_sd_hz = 0.4\n", "")
        .replace("target = 4e-3\ntarget_sd = 1e-4\n", "sd_relative = 0.02\n");
    let check = "[[component]]\nname = \"check\"\nchannel = \"deflection\"\nwindow = \"0.05..0.45\"\nband_hz = [20, 200]\nrecording = \"held\"\n[search]";
    let text = text.replace("[search]", check);
    let seen =
        |stiffness| Some(Ringing::new().record_condition(&[stiffness, 2e-3], 0, Draw::default()).unwrap());
    for (held, passes) in [(8100.0, true), (6400.0, false)] {
        let result = fit_features(
            &job(&text),
            &[seen(8100.0), seen(held)],
            &Ringing::new(),
            &context(None),
            &mut Memory::new(),
            &mut carry_on,
        )
        .unwrap();
        assert!((result.components[0].model_hz.unwrap() - 90.0).abs() < 0.1 && result.components.len() == 1);
        assert_eq!(
            result.held_out.iter().map(|h| (h.name.as_str(), h.pass)).collect::<Vec<_>>(),
            [("check", passes)]
        );
    }
}

#[test]
fn targets_are_measured_on_the_recording_by_the_same_code() {
    let camera = JOB.find("[camera]").unwrap();
    let text = JOB[..camera].to_owned()
        + "[[recording]]\npath = \"r\"\n"
        + &JOB[JOB.find("[[parameter]]").unwrap()..];
    let text = text
        .replace("target_hz = 80\ntarget_sd_hz = 0.4\n", "")
        .replace("target = 4e-3\ntarget_sd = 1e-4\n", "sd_relative = 0.02\n");
    let measured = [Some(Ringing::new().record_condition(&[8100.0, 2e-3], 0, Draw::default()).unwrap())];
    let mut journal = Memory::new();
    let result =
        fit_features(&job(&text), &measured, &Ringing::new(), &context(None), &mut journal, &mut carry_on)
            .unwrap();
    let low = &result.components[0];
    assert!((low.target_hz - 90.0).abs() < 0.05 && low.target_sd_hz >= 1e-3 * low.target_hz, "{low:?}");
    assert!(
        (result.parameters["blade.stiffness"].estimate / 8100.0 - 1.0).abs() < 1e-3,
        "{:?}",
        result.parameters
    );
    assert!((result.parameters["friction.a"].estimate / 2e-3 - 1.0).abs() < 1e-2);
    assert!(result.synthetic && result.notes.iter().any(|n| n.contains("synthetic")));
    let none =
        fit_features(&job(&text), &[], &Ringing::new(), &context(None), &mut Memory::new(), &mut carry_on)
            .unwrap_err();
    assert_eq!(none, FitError::Recordings { found: 0, expected: 1 });
    let silent = [Some(Ringing::new().record_condition(&[100.0, 2e-3], 0, Draw::default()).unwrap())];
    let error = fit_features(
        &job(&text),
        &silent,
        &Ringing::new(),
        &context(None),
        &mut Memory::new(),
        &mut carry_on,
    )
    .unwrap_err();
    assert!(
        error.to_string().starts_with("model: `low` cannot be measured: no component between 20 and 200 Hz"),
        "{error}"
    );
}
