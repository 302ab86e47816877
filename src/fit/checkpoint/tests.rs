use super::*;
use crate::checkpoint::{
    CheckpointError, CheckpointHeader, StoredRecord, check_recomputed, format_header_line,
    format_record_line, read_checkpoint,
};
use crate::fit::evaluation::{FailureReason, Observation, Observed, RunFailure};
use crate::simulate::RunStatus;

pub(in crate::fit) fn trace_header() -> FitHeader {
    let [unknowns, data] =
        [["friction.a", "film: tilt_rad"].map(str::to_owned).into(), vec!["film".to_owned()]];
    FitHeader { seed: 3, unknowns, data, segment_s: vec![0.004, 0.008] }
}

/// An iterate number `step` of a chain with two stages of three iterates.
pub(in crate::fit) fn iterate(step: usize) -> Iterate {
    let x = 0.1 * step as f64;
    let segment = |first: usize, chi2: f64| SegmentState {
        recording: 0,
        first,
        last: first + 20,
        start: [x.sin(), 1.0 / 3.0, -x, 1e-17],
        shown: [0.1, 0.2, 0.3, 0.4],
        chi2,
        data: 40,
    };
    Iterate {
        stage: step / 3,
        number: step % 3,
        repeats: step / 2,
        rescues: step % 2,
        whole: step % 2 == 1,
        plain: step % 3 == 2,
        settled: step % 3 == 2,
        damping: 1e-3 * 0.2_f64.powi(step as i32),
        point: vec![x.exp().ln() - 1.0, x.sqrt()],
        segments: vec![segment(0, 41.5 + x), segment(20, if step == 0 { f64::INFINITY } else { 90.0 })],
        cost: 1e3 / (1.0 + x),
    }
}

fn header(fingerprint: &str) -> CheckpointHeader<FitHeader> {
    let names = |names: [&str; 2]| names.map(str::to_owned).into();
    let (unknowns, data) = (names(["a", "b"]), names(["low", "high"]));
    let body = FitHeader { seed: 1, unknowns, data, segment_s: Vec::new() };
    CheckpointHeader::new::<FitRecord>(fingerprint, "0.1.0", body)
}

fn read(file: &str, bytes: impl AsRef<[u8]>) -> Result<Option<FitCheckpoint>, CheckpointError> {
    read_checkpoint(file, bytes)
}

fn entry_line(stage: EvaluationStage, outcome: &EvaluationOutcome) -> String {
    format_record_line(&FitRecord::Evaluation { stage, outcome: outcome.clone() })
}

fn outcome(u: f64) -> EvaluationOutcome {
    let features = vec![Observed::from_value(1e23 * u), Observed::Missing("no peak".to_owned())];
    EvaluationOutcome { unit: vec![u, 0.1 + 0.2], values: Vec::new(), features, failure: None }
}

fn text(units: &[f64]) -> String {
    let lines = units.iter().map(|u| entry_line(EvaluationStage::Global, &outcome(*u)));
    format_header_line(&header("f")) + &lines.collect::<String>()
}

#[test]
fn every_bit_survives() {
    let units: Vec<f64> = (0..200).map(|i| (f64::from(i) * 0.618_033_988_749_894_9).fract()).collect();
    let journal = read("j", text(&units)).unwrap().unwrap();
    assert_eq!((journal.records.len(), journal.end.torn), (200, false));
    for (entry, u) in journal.records.iter().zip(&units) {
        assert_eq!(*entry, FitRecord::Evaluation { stage: EvaluationStage::Global, outcome: outcome(*u) });
    }
    let failed = EvaluationOutcome {
        failure: Some(RunFailure::new(FailureReason::Ended(RunStatus::Jammed), "at 0.1 s", 0.3)),
        features: vec![],
        ..outcome(0.5)
    };
    let line = format_header_line(&header("f")) + &entry_line(EvaluationStage::Local, &failed);
    assert_eq!(
        read("j", &line).unwrap().unwrap().records,
        vec![FitRecord::Evaluation { stage: EvaluationStage::Local, outcome: failed }]
    );
}

#[test]
fn a_torn_last_line_is_dropped_and_said() {
    let whole = text(&[0.25, 0.75]);
    let one = text(&[0.25]);
    for cut in one.len() + 1..whole.len() - 1 {
        let journal = read("j", &whole[..cut]).unwrap().unwrap();
        assert_eq!((journal.records.len(), journal.end.torn, journal.end.intact_bytes), (1, true, one.len()));
    }
    assert_eq!(read("j", "").unwrap(), None);
    assert_eq!(read("j", "{\"journal\":\"fit\"").unwrap(), None);
}

/// The journal `text` with `from` replaced by `to` in one line and with a new checksum, as another program
/// may write it.
fn forged(text: &str, from: &str, to: &str) -> String {
    let resealed = |line: &str| {
        let content = line.split_once(",\"sha256\"").unwrap().0;
        crate::checkpoint::append_checksum(&(content.replacen(from, to, 1) + "}")) + "\n"
    };
    let at = text.lines().position(|line| line.contains(from)).unwrap();
    let lines = text.lines().enumerate();
    lines.map(|(i, line)| if i == at { resealed(line) } else { line.to_owned() + "\n" }).collect()
}

#[test]
fn damage_elsewhere_is_refused_with_its_line() {
    let refused = |text: &str| read("j", text).unwrap_err().to_string();
    let good = text(&[0.25, 0.75]);
    let cut = forged(&good, "\"stage\"", "\"stag\"");
    assert!(refused(&cut).starts_with("j:2: no evaluation: unknown field `stag`"), "{}", refused(&cut));
    for (from, to, said) in [
        ("[0.25", "[1.25", "`unit`: found 1.25, expected 0 to 1"),
        ("[0.25", "[null", "no evaluation: invalid type: null"),
        ("\"unit\":[", "\"unit\":[0.5,", "`unit`: found 3, expected 2"),
        ("],\"features\":[", "],\"features\":[{\"value\":1.0},", "`features`: found 3, expected 2"),
    ] {
        let refused = refused(&forged(&good, from, to));
        assert!(refused.starts_with("j:2: ") && refused.contains(said), "{refused}");
    }
    assert!(refused("time_s,tip_x_m\n").starts_with("j:1: no journal header"));
}

#[test]
fn a_changed_digit_is_refused_with_its_line_and_what_to_do() {
    let good = text(&[0.25, 0.75]);
    let digits = good.char_indices().filter(|(_, c)| c.is_ascii_digit());
    for (at, digit) in digits {
        let mut changed = good.clone().into_bytes();
        changed[at] = if digit == '9' { b'0' } else { changed[at] + 1 };
        let line = good[..at].matches('\n').count() + 1;
        let refused = read("j", changed).unwrap_err().to_string();
        assert!(refused.starts_with(&format!("j:{line}: ")), "{at}: {refused}");
        let advice = if line == 1 { "restore it" } else { "restore the file, or remove this line" };
        assert!(refused.contains(advice), "{refused}");
    }
}

#[test]
fn a_line_without_end_counts_when_its_checksum_holds() {
    let whole = text(&[0.25, 0.75]);
    let journal = read("j", whole.trim_end()).unwrap().unwrap();
    assert_eq!((journal.records.len(), journal.end.torn, journal.end.unended), (2, false, true));
    assert_eq!(journal.end.intact_bytes, whole.len() - 1);
    let header = format_header_line(&header("f"));
    let journal = read("j", header.trim_end()).unwrap().unwrap();
    assert_eq!((journal.records.len(), journal.end.unended), (0, true));
}

#[test]
fn what_a_power_cut_leaves_behind_the_last_line_is_dropped() {
    let whole = text(&[0.25, 0.75]);
    for tail in ["\0", "\0\0\0\0\0\0\0", "{\"index\":2\0\0\0\0"] {
        let journal = read("j", whole.clone() + tail).unwrap().unwrap();
        assert_eq!(
            (journal.records.len(), journal.end.torn, journal.end.intact_bytes),
            (2, true, whole.len()),
            "{tail:?}"
        );
    }
    assert_eq!(read("j", "\0\0\0\0").unwrap(), None);
    let half_a_letter = [whole.as_bytes(), &[b'{', 0xc3]].concat();
    assert_eq!(read("j", half_a_letter).unwrap().unwrap().end.intact_bytes, whole.len());
    // zero bytes that are followed by complete lines count as damage
    let refused = read("j", text(&[0.25]) + "\0\0\n" + "{}\n").unwrap_err().to_string();
    assert!(refused.starts_with("j:3: found no checksum"), "{refused}");
}

#[test]
fn line_ends_of_other_systems_and_a_byte_order_mark_are_read() {
    let lines = text(&[0.25, 0.75]).replace('\n', "\r\n");
    let journal = read("j", format!("\u{feff}{lines}")).unwrap().unwrap();
    assert_eq!(journal.records, read("j", text(&[0.25, 0.75])).unwrap().unwrap().records);
    assert_eq!(journal.end.intact_bytes, lines.len() + 3);
    let lines = text(&[0.25, 0.75]).replace('\n', "\r");
    assert_eq!(read("j", lines).unwrap().unwrap().records, journal.records);
}

#[test]
fn a_journal_of_another_fit_is_refused_with_what_differs_and_what_to_do() {
    let expected = header("f");
    let refused = |found: CheckpointHeader<FitHeader>| {
        found.check_matches::<FitRecord>("j", &expected).unwrap_err().to_string()
    };
    assert_eq!(expected.check_matches::<FitRecord>("j", &expected), Ok(()));
    assert!(
        refused(header("g"))
            .starts_with("j: fingerprint g, expected f: the job, a scene or a recording has changed")
    );
    let version =
        refused(CheckpointHeader { version: "0.0.9".to_owned(), fingerprint: "g".to_owned(), ..header("f") });
    assert!(
        version.starts_with("j: written by version 0.0.9 of the program, this is version 0.1.0")
            && version.contains("resume with version 0.0.9")
    );
    let body = |body: FitHeader| CheckpointHeader { body, ..header("f") };
    let other = refused(body(FitHeader { data: vec![], ..expected.body.clone() }));
    assert!(other.starts_with("j:1: the header has other unknowns, features, recordings or segments"));
    let seed = body(FitHeader { seed: 7, ..expected.body.clone() });
    assert_eq!(seed.check_matches::<FitRecord>("j", &expected), Ok(()));
}

#[test]
fn journals_of_other_layouts_and_kinds_are_refused() {
    let refused = |text: &str| read("j", text).unwrap_err().to_string();
    let said = "j: a journal of layout 3, expected layout 4; move it away and run the fit again";
    assert_eq!(refused("{\"journal\":\"fit\",\"layout\":3}\n"), said);
    let unsealed = text(&[]).split_once(",\"sha256\"").unwrap().0.to_owned() + "}\n";
    assert!(refused(&unsealed).starts_with("j:1: found no checksum"));
    let sweep = forged(&text(&[]), "\"fit\"", "\"sweep\"");
    assert_eq!(
        refused(&sweep),
        "j: the journal of a sweep, expected that of a fit; choose the right file or folder"
    );
    assert!(refused("{}\n").starts_with("j:1: no journal header"));
}

#[test]
fn a_point_that_stands_twice_is_refused() {
    let refused = read("j", text(&[0.25, 0.75, 0.25])).unwrap_err().to_string();
    assert!(refused.starts_with("j:4: the evaluation of line 2 a second time;"), "{refused}");
}

#[test]
fn what_is_computed_otherwise_is_refused_with_both_outcomes() {
    let failed = |message: &str| {
        let failure = RunFailure::new(FailureReason::Ended(RunStatus::Jammed), message, 0.5);
        EvaluationOutcome { features: vec![], failure: Some(failure), ..outcome(0.5) }
    };
    let with = |features| EvaluationOutcome { features, ..outcome(0.5) };
    let averaged = Observation { value: 5e22, spread: 0.25, below_db: 0.0 };
    let record = |outcome| FitRecord::Evaluation { stage: EvaluationStage::Local, outcome };
    let step = |iterate| FitRecord::Iterate { chain: 0, step: 4, iterate };
    let mut moved = iterate(4);
    moved.point[1] += f64::EPSILON;
    let pairs = [
        (
            record(with(vec![Observed::from_value(2.0), Observed::from_value(1.0)])),
            record(outcome(0.5)),
            "evaluation.outcome.features[0].value 2.0",
        ),
        (
            record(with(vec![Observed::Value(averaged), Observed::Missing("no peak".to_owned())])),
            record(outcome(0.5)),
            "evaluation.outcome.features[0] {\"spread\":0.25,\"value\":5e+22}",
        ),
        (record(failed("why")), record(outcome(0.5)), "evaluation.outcome {\"failure\":"),
        (record(failed("why")), record(failed("wherefore")), "evaluation.outcome.failure.message \"why\""),
        (step(iterate(4)), step(moved), "iterate.iterate.point[1] 0.632"),
    ];
    for (record, again, found) in pairs {
        let stored = StoredRecord { record, line: 3 };
        assert_eq!(check_recomputed("j", &stored, &stored.record.clone()), Ok(()));
        let refused = check_recomputed("j", &stored, &again).unwrap_err().to_string();
        assert!(refused.starts_with(&format!("j:3: found {found}")), "{refused}");
        assert!(refused.contains(", but computed again the evaluation gives "), "{refused}");
    }
}

#[test]
fn every_bit_of_an_iterate_comes_back_and_what_cannot_be_of_this_fit_is_refused() {
    let records: Vec<FitRecord> =
        (0..6).map(|step| FitRecord::Iterate { chain: 1, step, iterate: iterate(step) }).collect();
    let header = CheckpointHeader::new::<FitRecord>("f", "0.1.0", trace_header());
    let text = format_header_line(&header) + &records.iter().map(format_record_line).collect::<String>();
    assert_eq!(read("j", &text).unwrap().unwrap().records, records);
    for (from, to, words) in [
        ("\"stage\":0,", "\"stage\":2,", "j:2: `stage`: found 2, expected below 2"),
        ("\"recording\":0,", "\"recording\":1,", "of recording 1, expected rising frames of 1 recordings"),
        ("\"point\":[", "\"point\":[1.0,", "`point`: found 3, expected 2"),
    ] {
        let refused = read("j", forged(&text, from, to)).unwrap_err().to_string();
        assert!(refused.contains(words), "{refused}");
    }
}
