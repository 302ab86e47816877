use super::*;
use crate::checkpoint::{format_header_line, format_record_line, read_checkpoint};
use crate::fit::trace::{CameraUnknown, TraceUnknown};

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
        cuts: step / 2,
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

pub(in crate::fit) fn header() -> TraceHeader {
    let unknowns = [
        TraceUnknown {
            kind: crate::fit::trace::UnknownKind::Parameter { name: "friction.a".to_owned(), unit: None },
            range: [-3.0, 0.0],
            prior: None,
            start: -1.0,
        },
        TraceUnknown {
            kind: crate::fit::trace::UnknownKind::Camera { film: 0, what: CameraUnknown::Tilt },
            range: [-5.0, 5.0],
            prior: Some([0.0, 0.5]),
            start: 0.0,
        },
    ];
    let recordings = vec!["film".to_owned()];
    let unknowns =
        unknowns.iter().map(|unknown| HeaderCoordinate::from_unknown(unknown, &recordings)).collect();
    let segment_s = [0.004, 0.008].map(ExactNumber).into();
    TraceHeader::new::<IterateRecord>(
        "f",
        "0.1.0",
        TraceHeaderBody { seed: 3, recordings, segment_s, unknowns },
    )
}

fn steps(start: usize, count: usize) -> Vec<IterateRecord> {
    (0..count).map(|step| IterateRecord { start, step, iterate: iterate(step) }).collect()
}

fn text(steps: &[IterateRecord]) -> String {
    let lines = steps.iter().enumerate().map(|(at, step)| format_record_line(step, at));
    format_header_line(&header()) + &lines.collect::<String>()
}

fn journal(steps: &[IterateRecord]) -> TraceCheckpoint {
    read_checkpoint("j", text(steps)).unwrap().unwrap()
}

#[test]
fn every_bit_comes_back() {
    let steps = steps(0, 6);
    assert_eq!(journal(&steps).records, steps);
    let bits = |step: &IterateRecord| step.iterate.segments[0].start.map(f64::to_bits);
    assert_eq!(bits(&journal(&steps).records[5]), bits(&steps[5]));
}

#[test]
fn what_cannot_be_of_this_fit_is_refused() {
    let whole = text(&steps(0, 2));
    let sealed = |from: &str, to: &str| {
        let unsealed = |line: &str| line.split(",\"sha256\"").next().unwrap_or_default().to_owned() + "}";
        let lines = whole
            .lines()
            .map(|line| crate::checkpoint::append_checksum(&unsealed(line).replace(from, to)) + "\n");
        read_checkpoint::<IterateRecord>("j", lines.collect::<String>()).unwrap_err().to_string()
    };
    assert!(whole.contains("\"stage\":0,"), "{whole}");
    for (from, to, words) in [
        ("\"stage\":0,", "\"stage\":2,", "j:2: `stage`: found 2, expected below 2"),
        ("\"recording\":0,", "\"recording\":1,", "of recording 1, expected rising frames of 1 recordings"),
        ("\"point\":[", "\"point\":[\"1.0\",", "`point`: found 3 numbers, expected 2"),
    ] {
        let refused = sealed(from, to);
        assert!(refused.contains(words), "{refused}");
    }
}

#[test]
fn an_iterate_that_is_computed_otherwise_is_refused_with_its_first_difference() {
    let stored = journal(&steps(0, 4));
    let mut again = stored.records[3].clone();
    assert_eq!(stored.check_recomputed("j", 3, &again), Ok(()));
    again.iterate.point[1] += 1e-16 + f64::EPSILON;
    let refused = stored.check_recomputed("j", 3, &again).unwrap_err().to_string();
    assert!(refused.contains("coordinate 1 of ") && refused.contains("j:5"), "{refused}");
}
