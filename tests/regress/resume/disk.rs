//! What a disk may do to a journal: fail at any write, and lose or zero its last blocks when the power fails.

use super::{Ended, JOB, Ringing, attempt, line_ends, resumed, whole};
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};
use wiperlab::checkpoint;
use wiperlab::checkpoint::{CheckpointRecord, CheckpointSink, Shard, format_header_line};
use wiperlab::fit::checkpoint::FitCheckpoint;
use wiperlab::fit::journal::FitProgress;
use wiperlab::fit::{FitContext, FitError, fit_features, job::Job};
use wiperlab::simulate::scene::Scene;
use wiperlab::sweep::{self, PointCollection, PointOutcome, Study, SweepError, journal as points};

/// Keeps so many appends, and of the next one a part.
struct Failing {
    text: String,
    left: usize,
    failed: bool,
}

impl Failing {
    fn after(left: usize) -> Self {
        Self { text: String::new(), left, failed: false }
    }
}

impl CheckpointSink for Failing {
    fn append(&mut self, lines: &str) -> Result<(), String> {
        assert!(!self.failed, "something is written after a failure");
        let fails = self.left == 0;
        self.left = self.left.saturating_sub(1);
        self.text += if fails { &lines[..lines.len() * 2 / 3] } else { lines };
        self.failed = fails;
        if fails { Err("input/output error".to_owned()) } else { Ok(()) }
    }
}

#[test]
fn a_fit_whose_journal_fails_at_any_write_ends_with_a_reason_and_goes_on() {
    let uncut = whole(JOB);
    let job = Job::parse_with_names("job.toml", JOB, &["stiffness", "friction"]).unwrap();
    let mut failures = 0;
    loop {
        let (mut disk, mut reported) = (Failing::after(failures), 0);
        let mut watch = |progress: &FitProgress| {
            reported = progress.evaluations;
            ControlFlow::Continue(())
        };
        let context = FitContext { fingerprint: "f", version: "1", ..FitContext::default() };
        let ended = fit_features(&job, &[None], &Ringing::default(), &context, &mut disk, &mut watch);
        if !disk.failed {
            assert_eq!(disk.text, uncut.journal);
            break;
        }
        let expected = FitError::JournalWrite { problem: "input/output error".to_owned() };
        assert_eq!(ended, Err(expected), "write {failures}");
        let kept: Option<FitCheckpoint> = checkpoint::read_checkpoint("j", &disk.text).unwrap();
        let kept = kept.map_or(0, |journal| journal.records.len());
        // the gate holds its lines back until it has passed the job, and reports them before
        assert!(
            failures == 0 || kept >= reported,
            "write {failures}: {reported} reported, {kept} on the disk"
        );
        let again = resumed(JOB, &disk.text);
        assert_eq!(
            (again.result, again.journal),
            (uncut.result.clone(), uncut.journal.clone()),
            "{failures}"
        );
        failures += 1;
    }
    assert!(failures > 20, "{failures}");
}

fn study() -> (Study, Scene) {
    let text = "format = 1\ntitle = \"\"\nscene = \"x\"\n[camera]\nframe_rate_hz = 2e3\nexposure_s = 0.0\n\
                [[axis]]\nname = \"drive.amplitude_m\"\nvalues = [0.0138, 0.03]\n\
                [[axis]]\nname = \"blade.preload_force_n\"\nfrom = 0.05\nto = 0.25\npoints = 12\n\
                [[map]]\nname = \"stick fraction\"\nkind = \"stick-fraction\"\n\
                [[map]]\nname = \"loss\"\nkind = \"contact-loss\"\n";
    let scene = include_str!("../../../data/scenes/light-blade.toml")
        .replace("stop_s = 1.02", "stop_s = 0.7")
        .replace("relative_tolerance = 1e-8", "relative_tolerance = 1e-5");
    (Study::parse("study.toml", text).unwrap(), Scene::parse("scene.toml", &scene).unwrap())
}

/// The study from what a journal holds: its outcomes, how many points were reported, and what is appended.
fn run_study(text: &str, sink: &mut Failing) -> (Result<Vec<PointOutcome>, SweepError>, usize) {
    let (study, scene) = study();
    let mut collected =
        PointCollection::new(points::study_header(&study, "f"), tempfile::tempfile().unwrap());
    let mut collect = |name: &str, text: &str| collected.add_journal(name, text.as_bytes()).unwrap();
    collect("before", text);
    let known: Option<points::SweepJournal> = checkpoint::read_checkpoint("j", text).unwrap();
    let known: Vec<usize> = known.iter().flat_map(|known| &known.records).map(|point| point.index).collect();
    let reported = AtomicUsize::new(0);
    let done = || {
        reported.fetch_add(1, Ordering::Relaxed);
    };
    let due = |index: usize| !known.contains(&index);
    let ran =
        sweep::run_sweep(&study, &scene, Shard::WHOLE, &due, sink, &done, &|| ControlFlow::Continue(()));
    collect("now", &(format_header_line(&points::study_header(&study, "f")) + &sink.text));
    let outcomes = ran.map(|()| {
        let mut outcomes = Vec::new();
        collected.for_each_point(|_, outcome| outcomes.push(outcome)).unwrap();
        outcomes
    });
    (outcomes, reported.into_inner())
}

#[test]
fn a_study_whose_journal_fails_at_any_write_ends_with_a_reason_and_goes_on() {
    let header = format_header_line(&points::study_header(&study().0, "f"));
    let expected = run_study("", &mut Failing::after(usize::MAX)).0.unwrap();
    let mut failures = 0;
    loop {
        let mut disk = Failing::after(failures);
        let (ended, reported) = run_study("", &mut disk);
        if !disk.failed {
            assert_eq!(ended.unwrap(), expected);
            break;
        }
        assert_eq!(ended, Err(SweepError::JournalWrite { problem: "input/output error".to_owned() }));
        let text = header.clone() + &disk.text;
        let kept: points::SweepJournal = checkpoint::read_checkpoint("j", &text).unwrap().unwrap();
        assert!(kept.records.len() >= reported);
        assert_eq!(run_study(&text, &mut Failing::after(usize::MAX)).0.unwrap(), expected);
        failures += 1;
    }
    // (points that end together are written at once, so how many writes there are depends on the machine)
    assert!(failures > 0);
}

/// What a power failure may leave of a journal: any first part of it, and the whole up to any line with its
/// last bytes as zeros.
fn left_by_a_power_failure(text: &str) -> Vec<Vec<u8>> {
    let bytes = text.as_bytes();
    let mut left: Vec<Vec<u8>> = (0..bytes.len()).map(|length| bytes[..length].to_vec()).collect();
    for end in line_ends(text) {
        for block in [512, 4096] {
            let mut zeroed = bytes[..end].to_vec();
            let from = end.saturating_sub(block);
            zeroed[from..].fill(0);
            left.push(zeroed);
        }
    }
    left
}

/// What is read of it is the first part of what was written.
fn holds_nothing_else<R: CheckpointRecord>(left: &[u8], written: &[R]) {
    let Some(journal) = checkpoint::read_checkpoint::<R>("j", left).unwrap() else { return };
    assert_eq!(journal.records, written[..journal.records.len()]);
    let complete = left.iter().filter(|byte| **byte == b'\n').count();
    assert!(journal.records.len() + 1 >= complete, "a complete line was dropped");
}

#[test]
fn what_a_power_failure_leaves_of_a_fit_is_read_as_far_as_it_is_whole_and_goes_on() {
    let job = JOB
        .replace("= 60", "= 10")
        .replace("= 90", "= 6")
        .replace("starts = 3", "starts = 1")
        .replace("bootstrap = 4", "bootstrap = 0\nprofile = false");
    let Ended { result, journal, .. } = whole(&job);
    let written = super::read(&journal).records;
    let left = left_by_a_power_failure(&journal);
    for (at, left) in left.iter().enumerate() {
        holds_nothing_else(left, &written);
        if at % 61 == 0 {
            let text = String::from_utf8(left.clone()).unwrap();
            let again = attempt(&job, &text, None, "1").unwrap();
            assert_eq!((&again.result, &again.journal), (&result, &journal), "state {at}");
        }
    }
}

#[test]
fn what_a_power_failure_leaves_of_a_study_is_read_as_far_as_it_is_whole_and_goes_on() {
    let mut disk = Failing::after(usize::MAX);
    let expected = run_study("", &mut disk).0.unwrap();
    let text = format_header_line(&points::study_header(&study().0, "f")) + &disk.text;
    let written: points::SweepJournal = checkpoint::read_checkpoint("j", &text).unwrap().unwrap();
    for (at, left) in left_by_a_power_failure(&text).iter().enumerate() {
        holds_nothing_else(left, &written.records);
        if at % 211 == 0 {
            let again = run_study(&String::from_utf8_lossy(left), &mut Failing::after(usize::MAX)).0;
            assert_eq!(again.as_ref(), Ok(&expected), "state {at}");
        }
    }
}
