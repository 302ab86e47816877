use super::*;
use crate::feature::Measure;
use crate::fit::scale::{Bounds, Spacing};
use crate::fit::target::Target;
use crate::journal::{JournalError, Merged, header_line, line, merge};
use crate::simulate::Status;

fn header(fingerprint: &str) -> Header {
    let bounds = [Bounds::new(0.001, 10.0, Spacing::Log), Bounds::new(-1.0, 2.0, Spacing::Linear)];
    let parameters = ["a", "b"].iter().zip(bounds).map(|(name, bounds)| Parameter {
        name: (*name).to_owned(),
        unit: "N".to_owned(),
        axis: Some(bounds.unwrap().into()),
    });
    let features = ["low", "high"].map(|name| Aimed {
        name: name.to_owned(),
        unit: "Hz".to_owned(),
        target: Some(target(name)),
    });
    let (parameters, features) = (parameters.collect(), features.into());
    Header::of::<Entry>(fingerprint, "0.1.0", Body { seed: 1, parameters, features })
}

fn target(name: &str) -> Target {
    let name = name.to_owned();
    Target {
        name,
        value: 0.1 + 0.2,
        sd: 1e-3,
        scatter: 0.0,
        measure: Measure::Log,
        last: false,
        calibration: None,
    }
}

fn read(file: &str, bytes: impl AsRef<[u8]>) -> Result<Option<Journal>, JournalError> {
    journal::read(file, bytes)
}

fn entry_line(at: usize, stage: Stage, from: Option<u64>, outcome: &Outcome) -> String {
    line(&Entry { stage, from, outcome: outcome.clone() }, at)
}

fn outcome(u: f64) -> Outcome {
    let features = vec![Observed::of(1e23 * u), Observed::Missing("no peak".to_owned())];
    let unit = vec![u, 0.1 + 0.2];
    let axes = header("f").body.axes().unwrap();
    let values = axes.iter().zip(&unit).map(|(axis, u)| axis.bounds.from_unit(*u)).collect();
    Outcome { unit, values, features, failure: None }
}

fn text(units: &[f64]) -> String {
    let lines = units.iter().enumerate().map(|(i, u)| entry_line(i, Stage::Global, None, &outcome(*u)));
    header_line(&header("f")) + &lines.collect::<String>()
}

#[test]
fn every_bit_survives() {
    let units: Vec<f64> = (0..200).map(|i| (f64::from(i) * 0.618_033_988_749_894_9).fract()).collect();
    let journal = read("j", text(&units)).unwrap().unwrap();
    assert_eq!((journal.records.len(), journal.torn), (200, false));
    for (entry, u) in journal.records.iter().zip(&units) {
        assert_eq!(entry.outcome, outcome(*u));
    }
    let failed = Outcome {
        failure: Some(RunFailure::new(FailureReason::Ended(Status::Jammed), "at 0.1 s", 0.3)),
        features: vec![],
        ..outcome(0.5)
    };
    let line = header_line(&header("f")) + &entry_line(0, Stage::Local, None, &failed);
    assert_eq!(
        read("j", &line).unwrap().unwrap().records,
        vec![Entry { stage: Stage::Local, from: None, outcome: failed }]
    );
}

#[test]
fn a_torn_last_line_is_dropped_and_said() {
    let whole = text(&[0.25, 0.75]);
    let one = text(&[0.25]);
    for cut in one.len() + 1..whole.len() - 1 {
        let journal = read("j", &whole[..cut]).unwrap().unwrap();
        assert_eq!((journal.records.len(), journal.torn, journal.intact_bytes), (1, true, one.len()));
    }
    assert_eq!(read("j", "").unwrap(), None);
    assert_eq!(read("j", "{\"journal\":\"fit\"").unwrap(), None);
}

/// The text with a change in one line, the checksum made anew: what another program may write.
fn forged(text: &str, from: &str, to: &str) -> String {
    let resealed = |line: &str| {
        let content = line.split_once(",\"sha256\"").unwrap().0;
        crate::journal::sealed(&(content.replacen(from, to, 1) + "}")) + "\n"
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
        ("\"],\"features\"", "\"],\"values\":[\"1.0\",\"2.0\"],\"features\"", "they follow from `unit`"),
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
        let advice = if line == 1 { "restore it" } else { "`wiperlab journal drop j" };
        assert!(refused.contains(advice), "{refused}");
    }
}

#[test]
fn a_line_without_end_counts_when_its_checksum_holds() {
    let whole = text(&[0.25, 0.75]);
    let journal = read("j", whole.trim_end()).unwrap().unwrap();
    assert_eq!((journal.records.len(), journal.torn, journal.unended), (2, false, true));
    assert_eq!(journal.intact_bytes, whole.len() - 1);
    let header = header_line(&header("f"));
    let journal = read("j", header.trim_end()).unwrap().unwrap();
    assert_eq!((journal.records.len(), journal.unended), (0, true));
}

#[test]
fn without_lines_the_others_are_numbered_anew() {
    let units = [0.125, 0.25, 0.5, 0.75];
    let bytes = text(&units).into_bytes();
    let without =
        |bytes: &[u8], lines: &[_]| journal::without::<Entry>("j", bytes, lines).map(Option::unwrap);
    assert_eq!(without(&bytes, &[3..=3]).unwrap().text, text(&[0.125, 0.5, 0.75]));
    assert_eq!(without(&bytes, &[2..=2, 4..=5]).unwrap().text, text(&[0.25]));
    assert_eq!(without(&bytes, &[3..=usize::MAX]).unwrap().text, text(&[0.125]));
    // damaged lines go, and one that is damaged too is named
    let damaged = String::from_utf8(bytes.clone())
        .unwrap()
        .replace("\"0.25\"", "\"0.26\"")
        .replace("\"0.75\"", "\"0.7\"");
    let left = without(damaged.as_bytes(), &[3..=3, 5..=5]).unwrap();
    assert_eq!((left.text, left.kept, left.removed), (text(&[0.125, 0.5]), 2, 2));
    let refused = |lines| without(damaged.as_bytes(), &[lines]).unwrap_err().to_string();
    assert!(refused(3..=3).starts_with("j:5: the line has the checksum"), "{}", refused(3..=3));
    for line in [0, 1, 6] {
        assert!(
            refused(line..=line).contains(&format!("lines 2 to 5 and not {line};")),
            "{}",
            refused(line..=line)
        );
    }
}

/// The same journal as the version before wrote it: without checksums, and with copies of what follows.
fn unchecked(units: &[f64]) -> String {
    let of = |unit: &f64| {
        let Outcome { unit, values, features, .. } = outcome(*unit);
        let list =
            |numbers: &[f64]| numbers.iter().map(|n| format!("\"{n:?}\"")).collect::<Vec<_>>().join(",");
        let value = features[0].value().unwrap();
        let (unit, values) = (list(&unit), list(&values));
        format!(
            "\"stage\":\"global\",\"unit\":[{unit}],\"values\":[{values}],\"cost\":\"0.5\",\"features\":[\"{value:?}\",{{\"missing\":\"no peak\"}}]"
        )
    };
    let header = "{\"journal\":\"fit\",\"layout\":2,\"fingerprint\":\"f\",\"version\":\"0.1.0\",\"body\":{\"seed\":1,\"parameters\":[\"a\",\"b\"],\"features\":[\"low\",\"high\"]}}\n";
    let lines = units.iter().enumerate().map(|(i, unit)| format!("{{\"index\":{i},{}}}\n", of(unit)));
    header.to_owned() + &lines.collect::<String>()
}

#[test]
fn a_journal_without_checksums_is_read_and_its_copies_are_compared() {
    let old = read("j", unchecked(&[0.25, 0.75])).unwrap().unwrap();
    let new = read("j", text(&[0.25, 0.75])).unwrap().unwrap();
    assert!(old.is_unchecked() && !new.is_unchecked());
    assert_eq!((&old.records, old.check_problem("j", &header("f"))), (&new.records, Ok(())));
    for (from, to) in
        [("\"unit\":[\"0.75\"", "\"unit\":[\"0.76\""), ("\"values\":[\"0.0", "\"values\":[\"0.1")]
    {
        let edited = read("j", unchecked(&[0.25, 0.75]).replacen(from, to, 1)).unwrap().unwrap();
        let refused = edited.check_problem("j", &header("f")).unwrap_err().to_string();
        assert!(refused.contains("which follows from `unit`") && refused.contains("`a`"), "{refused}");
    }
    let refused = merge(&[("new", &new), ("old", &old)]).unwrap_err().to_string();
    assert!(refused.starts_with("old: a journal of layout 2, whose lines have no checksums"), "{refused}");
}

#[test]
fn what_a_power_cut_leaves_behind_the_last_line_is_dropped() {
    let whole = text(&[0.25, 0.75]);
    for tail in ["\0", "\0\0\0\0\0\0\0", "{\"index\":2\0\0\0\0"] {
        let journal = read("j", whole.clone() + tail).unwrap().unwrap();
        assert_eq!(
            (journal.records.len(), journal.torn, journal.intact_bytes),
            (2, true, whole.len()),
            "{tail:?}"
        );
    }
    assert_eq!(read("j", "\0\0\0\0").unwrap(), None);
    let half_a_letter = [whole.as_bytes(), &[b'{', 0xc3]].concat();
    assert_eq!(read("j", half_a_letter).unwrap().unwrap().intact_bytes, whole.len());
    // zeros that are followed by complete lines are damage
    let refused = read("j", text(&[0.25]) + "\0\0\n" + "{}\n").unwrap_err().to_string();
    assert!(
        refused.starts_with("j:3: found no checksum") && refused.contains("`wiperlab journal drop j 3`"),
        "{refused}"
    );
}

#[test]
fn line_ends_of_other_systems_and_a_byte_order_mark_are_read() {
    let lines = text(&[0.25, 0.75]).replace('\n', "\r\n");
    let journal = read("j", format!("\u{feff}{lines}")).unwrap().unwrap();
    assert_eq!(journal.records, read("j", text(&[0.25, 0.75])).unwrap().unwrap().records);
    assert_eq!(journal.intact_bytes, lines.len() + 3);
    let lines = text(&[0.25, 0.75]).replace('\n', "\r");
    assert_eq!(read("j", lines).unwrap().unwrap().records, journal.records);
}

#[test]
fn a_journal_of_another_fit_is_refused_with_what_differs_and_what_to_do() {
    let expected = header("f");
    let of = |header: Header| Journal { header, ..read("j", text(&[0.25])).unwrap().unwrap() };
    let refused = |found: Header| of(found).check_problem("j", &expected).unwrap_err().to_string();
    assert_eq!(of(expected.clone()).check_problem("j", &expected), Ok(()));
    assert!(
        refused(header("g"))
            .starts_with("j: fingerprint g, expected f: the job, a scene or a recording has changed")
    );
    let version = refused(Header { version: "0.0.9".to_owned(), fingerprint: "g".to_owned(), ..header("f") });
    assert!(
        version.starts_with("j: written by version 0.0.9 of the program, this is version 0.1.0")
            && version.contains("resume with version 0.0.9")
    );
    let body = |body: Body| Header { body, ..header("f") };
    let mut wider = expected.body.clone();
    wider.parameters[0].axis = Some(Bounds::new(0.001, 20.0, Spacing::Log).unwrap().into());
    for other in [Body { features: vec![], ..expected.body.clone() }, wider] {
        assert!(
            refused(body(other))
                .starts_with("j:1: the header has other parameters, bounds, features or targets")
        );
    }
    let seed = body(Body { seed: 7, ..expected.body.clone() });
    assert_eq!(of(seed).check_problem("j", &expected), Ok(()));
}

#[test]
fn journals_of_other_layouts_and_kinds_are_refused() {
    let refused = |text: &str| read("j", text).unwrap_err().to_string();
    let old = "{\"journal\":1,\"fingerprint\":\"f\",\"version\":\"0.1.0\",\"seed\":1}\n";
    assert!(
        refused(old).starts_with("j: a journal of layout 1, this program reads layouts 2 and 3; resume with")
    );
    let sweep = forged(&text(&[]), "\"fit\"", "\"sweep\"");
    assert_eq!(
        refused(&sweep),
        "j: the journal of a sweep, expected that of a fit; choose the right file or folder"
    );
    assert!(refused("{\"sweep_journal\":1}\n").contains("the journal of a sweep"));
    assert!(refused("{}\n").starts_with("j:1: no journal header"));
}

#[test]
fn a_point_that_stands_twice_is_refused() {
    let refused = read("j", text(&[0.25, 0.75, 0.25])).unwrap_err().to_string();
    assert!(refused.starts_with("j:4: the evaluation of line 2 a second time;"), "{refused}");
}

/// A journal of a seed at some points.
fn of_seed(seed: u64, units: &[f64]) -> Journal {
    let mut journal = read("j", text(units)).unwrap().unwrap();
    journal.header.body.seed = seed;
    journal
}

/// Points and marks of a merged journal.
fn marks(journals: &[&Journal]) -> Vec<(f64, Option<u64>)> {
    merged(journals).records.iter().map(|e| (e.outcome.unit[0], e.from)).collect()
}

fn merged(journals: &[&Journal]) -> Journal {
    let named: Vec<(&str, &Journal)> = journals.iter().map(|journal| ("j", *journal)).collect();
    read("merged", merge(&named).unwrap().text).unwrap().unwrap()
}

#[test]
fn merging_keeps_each_point_once_and_marks_those_of_other_seeds() {
    let (a, b, c) = (of_seed(1, &[0.25, 0.5]), of_seed(2, &[0.5, 0.75]), of_seed(1, &[0.5, 0.125]));
    assert_eq!(marks(&[&a, &b, &c]), [(0.25, None), (0.5, None), (0.75, Some(2)), (0.125, None)]);
    assert_eq!(merge(&[("a", &a), ("b", &b), ("c", &c)]).unwrap().new, [2, 1, 1]);
    // seen from the other seed, its own points are its own again, also where they had been merged before
    assert_eq!(
        marks(&[&of_seed(2, &[0.5]), &merged(&[&a, &b])]),
        [(0.5, None), (0.25, Some(1)), (0.75, None)]
    );
}

#[test]
fn merging_with_itself_or_again_changes_nothing() {
    let (a, b, c) = (of_seed(1, &[0.25, 0.5]), of_seed(2, &[0.5, 0.75]), of_seed(3, &[0.125]));
    assert_eq!(merge(&[("a", &a), ("a", &a)]).unwrap().text, text(&[0.25, 0.5]));
    let once = merged(&[&a, &b]);
    assert_eq!(merged(&[&once, &b]).records, once.records);
    assert_eq!(merged(&[&a, &once]).records, once.records);
    assert_eq!(merged(&[&once, &c]).records, merged(&[&a, &b, &c]).records);
    assert_eq!(merge::<Entry>(&[]).unwrap(), Merged::default());
}

#[test]
fn journals_that_disagree_are_refused_with_both_places() {
    let (a, mut b) = (of_seed(1, &[0.25, 0.5]), of_seed(2, &[0.75, 0.5]));
    assert!(merge(&[("a", &a), ("b", &b)]).is_ok());
    b.records[1].stage = Stage::Local;
    assert!(merge(&[("a", &a), ("b", &b)]).is_ok(), "another search may come to a point for another reason");
    let plain = outcome(0.5);
    let averaged = |spread, below_db| {
        let shown = Observation { value: 5e22, spread, below_db };
        vec![Observed::Value(shown), Observed::Missing("no peak".to_owned())]
    };
    let failed = |message: &str, progress| {
        let failure = RunFailure::new(FailureReason::Ended(Status::Jammed), message, progress);
        Outcome { features: vec![], failure: Some(failure), ..outcome(0.5) }
    };
    let with = |features| Outcome { features, ..outcome(0.5) };
    let pairs: [(Outcome, Outcome, &str); 7] = [
        (
            plain.clone(),
            with(vec![Observed::of(2.0), Observed::of(1.0)]),
            "b:3: feature 1 2.0, but a:3 has feature 1 5e22",
        ),
        (
            plain.clone(),
            with(averaged(0.25, 0.0)),
            "b:3: feature 1 5e22, spread 0.25, but a:3 has feature 1 5e22 at",
        ),
        (
            plain.clone(),
            with(averaged(0.0, 3.0)),
            "b:3: feature 1 5e22, below the strongest by (dB) 3.0, but",
        ),
        (
            plain.clone(),
            with(vec![Observed::of(5e22), Observed::Missing("lost".to_owned())]),
            "b:3: feature 2 missing (lost), but a:3 has feature 2 missing (no peak)",
        ),
        (
            plain.clone(),
            failed("why", 0.5),
            "b:3: failure jammed (why) after 0.5 of the run, but a:3 has no failure",
        ),
        (failed("why", 0.5), failed("wherefore", 0.5), "b:3: failure jammed (wherefore)"),
        (failed("why", 0.5), failed("why", 0.25), "b:3: failure jammed (why) after 0.25"),
    ];
    let (mut a, mut refused) = (a, String::new());
    for (here, there, said) in pairs {
        (a.records[1].outcome, b.records[1].outcome) = (here, there);
        refused = merge(&[("a", &a), ("b", &b)]).unwrap_err().to_string();
        assert!(refused.starts_with(said), "{refused}");
    }
    assert!(refused.contains("do not calculate alike to the last digit"), "{refused}");
    let other = Journal { header: header("g"), ..a.clone() };
    assert!(
        matches!(merge(&[("a", &a), ("b", &other)]), Err(JournalError::OtherProblem { file, .. }) if file == "b")
    );
}
