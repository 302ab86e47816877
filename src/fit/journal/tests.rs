use super::*;
use crate::journal::{JournalError, Merged, header_line, line, merge};
use crate::simulate::Status;

fn header(fingerprint: &str) -> Header {
    let parameters = vec!["a".to_owned(), "b".to_owned()];
    let features = vec!["low".to_owned(), "high".to_owned()];
    Header::of::<Entry>(fingerprint, "0.1.0", Body { seed: 1, parameters, features })
}

fn read(file: &str, bytes: impl AsRef<[u8]>) -> Result<Option<Journal>, JournalError> {
    journal::read(file, bytes)
}

fn entry_line(at: usize, stage: Stage, from: Option<u64>, evaluation: &Evaluation) -> String {
    line(&Entry { stage, from, evaluation: evaluation.clone() }, at)
}

fn evaluation(u: f64) -> Evaluation {
    let features = vec![Observed::of(1e23 * u), Observed::Missing("no peak".to_owned())];
    Evaluation {
        unit: vec![u, 0.1 + 0.2],
        values: vec![5e-324, -u / 3.0],
        cost: u / 7.0,
        global_cost: u / 7.0,
        features,
        failure: None,
    }
}

fn text(units: &[f64]) -> String {
    let lines = units.iter().enumerate().map(|(i, u)| entry_line(i, Stage::Global, None, &evaluation(*u)));
    header_line(&header("f")) + &lines.collect::<String>()
}

#[test]
fn every_bit_survives() {
    let units: Vec<f64> = (0..200).map(|i| (f64::from(i) * 0.618_033_988_749_894_9).fract()).collect();
    let journal = read("j", text(&units)).unwrap().unwrap();
    assert_eq!((journal.records.len(), journal.torn), (200, false));
    for (entry, u) in journal.records.iter().zip(&units) {
        assert_eq!(entry.evaluation, evaluation(*u));
    }
    let failed = Evaluation {
        failure: Some(RunFailure::new(FailureReason::Ended(Status::Jammed), "at 0.1 s", 0.3)),
        features: vec![],
        ..evaluation(0.5)
    };
    let line = header_line(&header("f")) + &entry_line(0, Stage::Local, None, &failed);
    assert_eq!(
        read("j", &line).unwrap().unwrap().records,
        vec![Entry { stage: Stage::Local, from: None, evaluation: failed }]
    );
}

#[test]
fn a_torn_last_line_is_dropped_and_said() {
    let whole = text(&[0.25, 0.75]);
    let one = text(&[0.25]);
    for cut in one.len() + 1..whole.len() {
        let journal = read("j", &whole[..cut]).unwrap().unwrap();
        assert_eq!((journal.records.len(), journal.torn, journal.intact_bytes), (1, true, one.len()));
    }
    assert_eq!(read("j", "").unwrap(), None);
    assert_eq!(read("j", "{\"journal\":\"fit\"").unwrap(), None);
}

#[test]
fn damage_elsewhere_is_refused_with_its_line() {
    let refused = |text: &str| read("j", text).unwrap_err().to_string();
    let good = text(&[0.25, 0.75]);
    let cut = good.replacen("\"stage\"", "\"stag\"", 1);
    assert!(refused(&cut).starts_with("j:2: no evaluation: unknown field `stag`"), "{}", refused(&cut));
    let skipped =
        good.lines().enumerate().filter(|(i, _)| *i != 1).map(|(_, l)| format!("{l}\n")).collect::<String>();
    assert!(refused(&skipped).starts_with("j:2: `index`: found 1, expected 0;"), "{}", refused(&skipped));
    assert!(
        refused(&good.replacen("\"0.25\"", "\"1.25\"", 1)).contains("`unit`: found 1.25, expected 0 to 1")
    );
    assert!(refused(&good.replacen("\"0.25\"", "\"inf\"", 1)).contains("expected a finite number"));
    assert!(refused("time_s,tip_x_m\n").starts_with("j:1: no journal header"));
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
        refused.starts_with("j:3: no evaluation") && refused.contains("delete this line and all after it"),
        "{refused}"
    );
}

#[test]
fn line_ends_of_other_systems_and_a_byte_order_mark_are_read() {
    let lines = text(&[0.25, 0.75]).replace('\n', "\r\n");
    let journal = read("j", format!("\u{feff}{lines}")).unwrap().unwrap();
    assert_eq!(journal.records, read("j", text(&[0.25, 0.75])).unwrap().unwrap().records);
    assert_eq!(journal.intact_bytes, lines.len() + 3);
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
    assert!(
        refused(body(Body { features: vec![], ..expected.body.clone() }))
            .starts_with("j:1: the header names other parameters or features")
    );
    let seed = body(Body { seed: 7, ..expected.body.clone() });
    assert_eq!(of(seed).check_problem("j", &expected), Ok(()));
}

#[test]
fn journals_of_other_layouts_and_kinds_are_refused() {
    let refused = |text: &str| read("j", text).unwrap_err().to_string();
    let old = "{\"journal\":1,\"fingerprint\":\"f\",\"version\":\"0.1.0\",\"seed\":1}\n";
    assert!(refused(old).starts_with("j: a journal of layout 1, this program reads layout 2; resume with"));
    let sweep = text(&[]).replacen("\"fit\"", "\"sweep\"", 1);
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
    merged(journals).records.iter().map(|e| (e.evaluation.unit[0], e.from)).collect()
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
    b.records[1].evaluation.cost = 9.0;
    assert!(merge(&[("a", &a), ("b", &b)]).is_ok(), "a price depends on what else a search met");
    b.records[1].evaluation =
        Evaluation { features: vec![Observed::of(2.0), Observed::of(1.0)], ..evaluation(0.5) };
    let refused = merge(&[("a", &a), ("b", &b)]).unwrap_err().to_string();
    assert!(
        refused.starts_with("b:3: features [Some(2.0), Some(1.0)], but a:3 has features [Some("),
        "{refused}"
    );
    assert!(refused.contains("do not calculate alike to the last digit"), "{refused}");
    let other = Journal { header: header("g"), ..a.clone() };
    assert!(
        matches!(merge(&[("a", &a), ("b", &other)]), Err(JournalError::OtherProblem { file, .. }) if file == "b")
    );
}
