//! Nothing of a fit is lost: killed, cut or extended, it goes on to the result that it would have had
//! in one run.

mod disk;
mod killed;

use crate::ringing::ringing;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};
use wiperlab::checkpoint;
use wiperlab::checkpoint::CheckpointError;
use wiperlab::fit::checkpoint::FitCheckpoint;
use wiperlab::fit::evaluation::{FailureReason, RunFailure};
use wiperlab::fit::journal::FitProgress;
use wiperlab::fit::model::{Draw, Model};
use wiperlab::fit::result::{FitResult, FitStatus};
use wiperlab::fit::{FitContext, FitError, fit_features, job::Job};
use wiperlab::recording::Recording;

const JOB: &str = r#"format = 1
title = "a tone about a mean"
scene = "s.toml"
seed = 3
[camera]
frame_rate_hz = 1000
exposure_s = 0.0
[[parameter]]
name = "stiffness"
lower = 1000.0
upper = 30000.0
scale = "log"
[[parameter]]
name = "friction"
lower = 0.0
upper = 0.01
scale = "linear"
[[component]]
name = "tone"
channel = "deflection"
window = "0.02..0.18"
band_hz = [20, 300]
target_hz = 80
target_sd_hz = 0.4
[[feature]]
kind = "mean-deflection"
window = "0.02..0.18"
target = 4e-3
target_sd = 1e-4
[search]
global_evaluations = 60
local_evaluations = 90
particles = 10
starts = 3
[intervals]
bootstrap = 4
"#;

/// A deflection that rings about a mean; either follows both parameters, with several basins. It loses
/// contact when stiff.
#[derive(Default)]
struct Ringing {
    calls: AtomicUsize,
}

impl Model for Ringing {
    fn record_condition(&self, values: &[f64], _: usize, draw: Draw) -> Result<Recording, RunFailure> {
        self.calls.fetch_add(1, Ordering::Relaxed);
        let (stiffness, friction) = (values[0], values[1]);
        if stiffness > 25_000.0 {
            return Err(RunFailure::new(
                FailureReason::Ended(wiperlab::simulate::RunStatus::ContactLost),
                "normal force below zero",
                0.5,
            ));
        }
        let noise = if draw.noise == 0 { 0.0 } else { (draw.noise as f64 * 2.4).sin() };
        let frequency_hz = stiffness.sqrt() * (1.0 + 0.2 * (2000.0 * friction).sin()) + 0.4 * noise;
        let mean = friction + 2e-3 * (stiffness / 2000.0).sin() + 1e-4 * noise;
        ringing(200, mean, frequency_hz)
    }
}

/// A fit that ended: its result as written, its whole journal, and how often it ran the model.
#[derive(Debug, Clone, PartialEq)]
struct Ended {
    result: String,
    journal: String,
    calls: usize,
}

impl Ended {
    fn parsed(&self) -> FitResult {
        FitResult::parse("result.json", &self.result).unwrap()
    }

    fn read(&self) -> FitCheckpoint {
        read(&self.journal)
    }
}

fn read(text: &str) -> FitCheckpoint {
    checkpoint::read_checkpoint("journal.jsonl", text).unwrap().unwrap()
}

fn attempt(job: &str, text: &str, most: Option<usize>, version: &str) -> Result<Ended, FitError> {
    let journal: Option<FitCheckpoint> = checkpoint::read_checkpoint("journal.jsonl", text).unwrap();
    let resume = journal.as_ref().map(|journal| ("journal.jsonl", journal));
    let context = FitContext { fingerprint: "f", version, max_evaluations: most, resume };
    let (mut lines, mut watch, model) =
        (String::new(), |_: &FitProgress| ControlFlow::Continue(()), Ringing::default());
    let job = Job::parse_with_names("job.toml", job, &["stiffness", "friction"]).unwrap();
    let result = fit_features(&job, &[None], &model, &context, &mut lines, &mut watch)?.to_json();
    let kept = journal.as_ref().map_or(0, |journal| journal.end.intact_bytes);
    let end = if journal.is_some_and(|journal| journal.end.unended) { "\n" } else { "" };
    Ok(Ended { result, journal: text[..kept].to_owned() + end + &lines, calls: model.calls.into_inner() })
}

/// A fit that goes on from the text of a journal; from an empty one it starts over.
fn resumed(job: &str, text: &str) -> Ended {
    attempt(job, text, None, "1").unwrap()
}

fn whole(job: &str) -> Ended {
    resumed(job, "")
}

fn seeded(seed: u64) -> String {
    JOB.replace("seed = 3", &format!("seed = {seed}"))
}

/// The places behind each line.
fn line_ends(text: &str) -> Vec<usize> {
    text.match_indices('\n').map(|(at, _)| at + 1).collect()
}

#[test]
fn a_fit_cut_anywhere_in_any_stage_is_the_uninterrupted_one_to_the_last_byte() {
    let uncut = whole(JOB);
    for stage in ["gate", "global", "local", "sensitivity", "profile", "bootstrap"] {
        assert!(uncut.journal.contains(&format!("\"stage\":\"{stage}\"")), "{stage} is not tried");
    }
    for (at, end) in line_ends(&uncut.journal).into_iter().enumerate().step_by(5) {
        // behind a line, within it, and within its last bytes
        for cut in [end, end - 20 - at % 30, end - 1] {
            let again = resumed(JOB, &uncut.journal[..cut]);
            assert_eq!((&again.result, &again.journal), (&uncut.result, &uncut.journal), "cut at byte {cut}");
            // twins are made again, everything else is replayed
            let left: Option<FitCheckpoint> =
                checkpoint::read_checkpoint("journal.jsonl", &uncut.journal[..cut]).unwrap();
            assert!(
                left.as_ref().is_none_or(|journal| journal.end.torn == (cut != end && cut != end - 1)),
                "cut at byte {cut}"
            );
            // and some that were replayed are made once more to check them, the best point perhaps too
            let kept = left.map_or(0, |journal| journal.records.len());
            let checked = checkpoint::RECHECKED_RECORDS.min(kept);
            let fewest = uncut.calls - kept + checked;
            assert!((fewest..=fewest + 1).contains(&again.calls), "cut at byte {cut}");
        }
    }
}

#[test]
fn the_number_of_threads_changes_neither_result_nor_journal() {
    let on = |threads| {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| whole(JOB))
    };
    let one = on(1);
    assert!(one == on(2) && one == on(4));
}

#[test]
fn larger_budgets_go_on_from_the_journal_to_the_result_that_they_had_from_the_start() {
    let small = JOB
        .replace("= 60", "= 20")
        .replace("= 90", "= 12")
        .replace("starts = 3", "starts = 1")
        .replace("bootstrap = 4", "bootstrap = 0\nprofile = false");
    let extended = [
        JOB.replace("= 60", "= 200"),
        JOB.replace("= 90", "= 400"),
        JOB.replace("starts = 3", "starts = 6"),
        JOB.replace("bootstrap = 4", "bootstrap = 12"),
        JOB.replace("= 60", "= 150\nstagnation_generations = 40").replace("= 90", "= 300"),
    ];
    let begun = resumed(JOB, &whole(&small).journal);
    assert_eq!(begun.result, whole(JOB).result);
    for job in &extended {
        let (fresh, gone_on) = (whole(job), resumed(job, &begun.journal));
        assert_eq!(gone_on.result, fresh.result, "{job}");
        assert!(
            gone_on.calls < fresh.calls && gone_on.journal.starts_with(&begun.journal),
            "{} of {}",
            gone_on.calls,
            fresh.calls
        );
        assert_ne!(gone_on.result, begun.result, "the larger budget changed nothing, so this shows nothing");
        // a budget that is lowered again finds its own path too
        assert_eq!(resumed(JOB, &gone_on.journal).result, begun.result);
    }
}

#[test]
fn a_larger_allowance_goes_on_from_the_journal() {
    let uncut = whole(JOB);
    let mut text = String::new();
    for most in [1, 10, 26, 60, 61, 120, 180] {
        let (part, fresh) =
            (attempt(JOB, &text, Some(most), "1").unwrap(), attempt(JOB, "", Some(most), "1").unwrap());
        assert_eq!(part.result, fresh.result, "{most} evaluations");
        // the last one is used up by the intervals, when the search has converged
        let status = if most < 180 { FitStatus::BudgetExhausted } else { FitStatus::Converged };
        assert_eq!((part.parsed().status, part.parsed().evaluations.total), (status, most));
        text = part.journal;
    }
    assert_eq!(resumed(JOB, &text).result, uncut.result);
}

#[test]
fn a_journal_of_another_seed_or_version_is_refused() {
    let uncut = whole(JOB);
    let refused = |job: &str, version: &str| attempt(job, &uncut.journal, None, version).unwrap_err();
    assert_eq!(
        refused(&seeded(4), "1"),
        FitError::OtherSeed { file: "journal.jsonl".to_owned(), found: 3, expected: 4 }
    );
    assert!(matches!(refused(JOB, "2"), FitError::Journal(CheckpointError::OtherVersion { .. })));
}

#[test]
fn two_thousand_lines_are_replayed_without_one_evaluation() {
    let job = JOB
        .replace("= 60", "= 1500\nstagnation_generations = 1000")
        .replace("= 90", "= 600")
        .replace("bootstrap = 4", "bootstrap = 0");
    let uncut = whole(&job);
    assert!(uncut.read().records.len() > 1500, "{}", uncut.read().records.len());
    let again = resumed(&job, &uncut.journal);
    assert_eq!((&again.result, &again.journal), (&uncut.result, &uncut.journal));
    let checked = checkpoint::RECHECKED_RECORDS + 1;
    assert!(again.calls <= checked + 1, "the best model alone is looked at once more: {}", again.calls);
}
