use super::*;
use crate::checkpoint::{CheckpointError, format_header_line, format_record_line, read_checkpoint};
use crate::feature::ValueComparison;
use crate::fit::bounds::{Bounds, BoundsSpacing};
use crate::fit::evaluation::FailureReason;
use crate::fit::target_value::TargetValue;
use crate::simulate::RunStatus;

fn header(fingerprint: &str) -> FeatureHeader {
    let bounds =
        [Bounds::new(0.001, 10.0, BoundsSpacing::Log), Bounds::new(-1.0, 2.0, BoundsSpacing::Linear)];
    let parameters = ["a", "b"].iter().zip(bounds).map(|(name, bounds)| HeaderParameter {
        name: (*name).to_owned(),
        unit: "N".to_owned(),
        axis: bounds.unwrap().into(),
    });
    let features = ["low", "high"].map(|name| HeaderFeature {
        name: name.to_owned(),
        unit: "Hz".to_owned(),
        target: target(name),
    });
    let (parameters, features) = (parameters.collect(), features.into());
    FeatureHeader::new::<EvaluationRecord>(
        fingerprint,
        "0.1.0",
        FeatureHeaderBody { seed: 1, parameters, features },
    )
}

fn target(name: &str) -> TargetValue {
    let name = name.to_owned();
    TargetValue {
        name,
        value: 0.1 + 0.2,
        sd: 1e-3,
        scatter: 0.0,
        measure: ValueComparison::Log,
        last: false,
        calibration: None,
    }
}

fn read(file: &str, bytes: impl AsRef<[u8]>) -> Result<Option<FeatureCheckpoint>, CheckpointError> {
    read_checkpoint(file, bytes)
}

fn entry_line(at: usize, stage: EvaluationStage, outcome: &EvaluationOutcome) -> String {
    format_record_line(&EvaluationRecord { stage, outcome: outcome.clone() }, at)
}

fn outcome(u: f64) -> EvaluationOutcome {
    let features = vec![Observed::from_value(1e23 * u), Observed::Missing("no peak".to_owned())];
    let unit = vec![u, 0.1 + 0.2];
    let parameters = header("f").body.parameters;
    let values = parameters.iter().zip(&unit).map(|(p, u)| p.axis.bounds.value_at_unit(*u)).collect();
    EvaluationOutcome { unit, values, features, failure: None }
}

fn text(units: &[f64]) -> String {
    let lines = units.iter().enumerate().map(|(i, u)| entry_line(i, EvaluationStage::Global, &outcome(*u)));
    format_header_line(&header("f")) + &lines.collect::<String>()
}

#[test]
fn every_bit_survives() {
    let units: Vec<f64> = (0..200).map(|i| (f64::from(i) * 0.618_033_988_749_894_9).fract()).collect();
    let journal = read("j", text(&units)).unwrap().unwrap();
    assert_eq!((journal.records.len(), journal.end.torn), (200, false));
    for (entry, u) in journal.records.iter().zip(&units) {
        assert_eq!(entry.outcome, outcome(*u));
    }
    let failed = EvaluationOutcome {
        failure: Some(RunFailure::new(FailureReason::Ended(RunStatus::Jammed), "at 0.1 s", 0.3)),
        features: vec![],
        ..outcome(0.5)
    };
    let line = format_header_line(&header("f")) + &entry_line(0, EvaluationStage::Local, &failed);
    assert_eq!(
        read("j", &line).unwrap().unwrap().records,
        vec![EvaluationRecord { stage: EvaluationStage::Local, outcome: failed }]
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
    let skipped =
        good.lines().enumerate().filter(|(i, _)| *i != 1).map(|(_, l)| format!("{l}\n")).collect::<String>();
    assert!(refused(&skipped).starts_with("j:2: `index`: found 1, expected 0;"), "{}", refused(&skipped));
    for (from, to, said) in [
        ("[\"0.25\"", "[\"1.25\"", "`unit`: found 1.25, expected 0 to 1"),
        ("[\"0.25\"", "[\"inf\"", "expected a finite number"),
        ("\"unit\":[", "\"unit\":[\"0.5\",", "`unit`: found 3 numbers, expected 2"),
        ("\"],\"features\":[", "\"],\"features\":[\"1.0\",", "`features`: found 3, expected 2"),
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
    let refused = |found: FeatureHeader| {
        found.check_matches::<EvaluationRecord>("j", &expected).unwrap_err().to_string()
    };
    assert_eq!(expected.check_matches::<EvaluationRecord>("j", &expected), Ok(()));
    assert!(
        refused(header("g"))
            .starts_with("j: fingerprint g, expected f: the job, a scene or a recording has changed")
    );
    let version =
        refused(FeatureHeader { version: "0.0.9".to_owned(), fingerprint: "g".to_owned(), ..header("f") });
    assert!(
        version.starts_with("j: written by version 0.0.9 of the program, this is version 0.1.0")
            && version.contains("resume with version 0.0.9")
    );
    let body = |body: FeatureHeaderBody| FeatureHeader { body, ..header("f") };
    let mut wider = expected.body.clone();
    wider.parameters[0].axis = Bounds::new(0.001, 20.0, BoundsSpacing::Log).unwrap().into();
    for other in [FeatureHeaderBody { features: vec![], ..expected.body.clone() }, wider] {
        assert!(
            refused(body(other))
                .starts_with("j:1: the header has other parameters, bounds, features or targets")
        );
    }
    let seed = body(FeatureHeaderBody { seed: 7, ..expected.body.clone() });
    assert_eq!(seed.check_matches::<EvaluationRecord>("j", &expected), Ok(()));
}

#[test]
fn journals_of_other_layouts_and_kinds_are_refused() {
    let refused = |text: &str| read("j", text).unwrap_err().to_string();
    let said = "j: a journal of layout 2, expected layout 3; move it away and run the fit again";
    assert_eq!(refused("{\"journal\":\"fit\",\"layout\":2}\n"), said);
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
fn an_evaluation_that_is_computed_otherwise_is_refused_with_both_outcomes() {
    let mut journal = read("j", text(&[0.25, 0.5])).unwrap().unwrap();
    let averaged = |spread, below_db| {
        let shown = Observation { value: 5e22, spread, below_db };
        vec![Observed::Value(shown), Observed::Missing("no peak".to_owned())]
    };
    let failed = |message: &str, progress| {
        let failure = RunFailure::new(FailureReason::Ended(RunStatus::Jammed), message, progress);
        EvaluationOutcome { features: vec![], failure: Some(failure), ..outcome(0.5) }
    };
    let with = |features| EvaluationOutcome { features, ..outcome(0.5) };
    let pairs: [(EvaluationOutcome, EvaluationOutcome, &str, &str); 7] = [
        (
            with(vec![Observed::from_value(2.0), Observed::from_value(1.0)]),
            outcome(0.5),
            "feature 1 2.0",
            "feature 1 5e22",
        ),
        (with(averaged(0.25, 0.0)), outcome(0.5), "feature 1 5e22, spread 0.25", "feature 1 5e22"),
        (
            with(averaged(0.0, 3.0)),
            outcome(0.5),
            "feature 1 5e22, below the strongest by (dB) 3.0",
            "feature 1 5e22",
        ),
        (
            with(vec![Observed::from_value(5e22), Observed::Missing("lost".to_owned())]),
            outcome(0.5),
            "feature 2 missing (lost)",
            "feature 2 missing (no peak)",
        ),
        (failed("why", 0.5), outcome(0.5), "failure jammed (why) after 0.5 of the run", "no failure"),
        (failed("wherefore", 0.5), failed("why", 0.5), "failure jammed (wherefore)", "failure jammed (why)"),
        (failed("why", 0.25), failed("why", 0.5), "failure jammed (why) after 0.25", "failure jammed (why)"),
    ];
    for (stored, again, found, computed) in pairs {
        journal.records[1].outcome = stored;
        let again = EvaluationRecord { stage: EvaluationStage::Local, outcome: again };
        let refused = journal.check_recomputed("j", 1, &again).unwrap_err().to_string();
        let (before, after) = refused.split_once(", but computed again the evaluation gives ").unwrap();
        assert!(before.starts_with(&format!("j:3: found {found}")), "{refused}");
        assert!(after.starts_with(computed) && after.contains("to the last digit"), "{refused}");
    }
    let same = EvaluationRecord { stage: EvaluationStage::Local, outcome: outcome(0.25) };
    assert_eq!(journal.check_recomputed("j", 0, &same), Ok(()), "the purpose of an evaluation may differ");
}
