//! Follows the advice in refusals and findings: an import with the suggested options gives the same rows or
//! is refused again.

use crate::exports::{Exporter, Motion, exporters};
use wiperlab::import::source::{Import, ImportSource};
use wiperlab::import::{ColumnMap, CoordinateScale, ImportOptions, TimeColumn, import};

/// A suggestion: the words by which it is found in a message, and the change of the options that it requires.
type Suggestion = (&'static str, fn(&mut ImportOptions, &str));

/// The suggestions in errors and findings that a user can follow without knowing anything else.
const SUGGESTIONS: [Suggestion; 11] = [
    ("add --time playback", |options, _| options.time = Some(TimeColumn::Playback)),
    ("add --time ms", |options, _| options.time = Some(TimeColumn::Milliseconds)),
    ("add --time frames", |options, _| options.time = Some(TimeColumn::Frames)),
    ("say --time frames", |options, _| options.time = Some(TimeColumn::Frames)),
    ("say --time real", |options, _| options.time = Some(TimeColumn::Real)),
    ("add --frame-step ", |options, rest| options.frame_step = leading_number(rest)),
    ("--columns frame=row", |options, _| {
        let kept = options.columns.iter().flat_map(|map| &map.0);
        let kept: Vec<String> = kept
            .filter(|(key, _)| !["frame", "time", "time-ms"].contains(key))
            .map(|(key, column)| format!("{key}={column}"))
            .collect();
        if !kept.is_empty() {
            options.columns = Some(ColumnMap::parse(&format!("frame=row,{}", kept.join(","))).unwrap());
        }
    }),
    ("--scale: found", |options, _| options.scale = None),
    ("leave --columns out", |options, _| options.columns = None),
    ("leave --format out", |options, _| options.format = None),
    ("add --format generic", |options, _| options.format = Some("generic".to_owned())),
];

fn leading_number(text: &str) -> Option<usize> {
    text.split(|c: char| !c.is_ascii_digit()).next()?.parse().ok()
}

/// A motion that has gaps and in which no position occurs twice.
fn motion() -> Motion {
    let place = |row: usize, point: f64| Some(100.0 * point + row as f64 * 1.5 + (row as f64 * 0.7).sin());
    let frames = (0..48_usize).map(|row| {
        let lost = (17..20).contains(&row);
        let tip = [place(row, 1.0).filter(|_| !lost), place(row, 2.0).filter(|_| !lost)];
        [tip[0], tip[1], place(row, 3.0), place(row, 4.0)]
            .map(|value| value.map(|v| (v * 1000.0).round() / 1000.0))
    });
    Motion { rate_hz: 500.0, frames: frames.collect() }
}

/// Whether the tip positions of an import are those of the motion in the same order. The frame numbers may
/// differ from those of the motion by an offset and a constant factor.
fn has_rows_of(found: &Import, motion: &Motion) -> bool {
    let numbered = |column: &[Option<f64>]| -> Vec<(usize, f64)> {
        column.iter().enumerate().filter_map(|(frame, x)| Some((frame, (*x)?))).collect()
    };
    let read = numbered(&found.recording.traces().tip_x_m);
    let made = numbered(&motion.frames.iter().map(|frame| frame[0]).collect::<Vec<_>>());
    let step = (read[1].0 - read[0].0).max(1);
    read.len() == made.len()
        && read.iter().zip(&made).all(|(read, made)| {
            read.1 == made.1
                && read.0 - numbered(&found.recording.traces().tip_x_m)[0].0
                    == step * (made.0 - made_first(motion))
        })
}

fn made_first(motion: &Motion) -> usize {
    motion.frames.iter().position(|frame| frame[0].is_some()).unwrap()
}

/// A mistake of a user: its description, and the change of the options that it causes.
type Mistake = (&'static str, fn(&mut ImportOptions, &Motion));

/// Ways in which a user gets the options wrong.
fn mistakes() -> Vec<Mistake> {
    fn rate(options: &mut ImportOptions, motion: &Motion, factor: f64) {
        options.frame_rate_hz = Some(motion.rate_hz * factor);
    }
    vec![
        ("nothing", |_, _| {}),
        ("twice the rate", |options, motion| rate(options, motion, 2.0)),
        ("half the rate", |options, motion| rate(options, motion, 0.5)),
        ("25 times the rate", |options, motion| rate(options, motion, 25.0)),
        ("a thousandth of the rate", |options, motion| rate(options, motion, 1e-3)),
        ("a thousand times the rate", |options, motion| rate(options, motion, 1e3)),
        ("half a percent off", |options, motion| rate(options, motion, 1.005)),
        ("no rate", |options, _| options.frame_rate_hz = None),
        ("millimetres", |options, _| options.scale = Some(CoordinateScale::Unit(1e-3))),
        ("another format", |options, _| options.format = Some("kinovea".to_owned())),
        ("milliseconds", |options, _| options.time = Some(TimeColumn::Milliseconds)),
    ]
}

/// Imports `source`, follows each suggestion in the resulting message, and repeats this at most `depth`
/// times. `followed` counts the followed suggestions. The error describes rows that differ from the motion.
fn follow(
    exporter: &Exporter,
    motion: &Motion,
    source: &ImportSource,
    options: &ImportOptions,
    (depth, followed): (usize, &mut usize),
) -> Result<(), String> {
    let (text, found) = match import(std::slice::from_ref(source), options) {
        Ok(found) => (found.report.warnings().collect::<Vec<_>>().join("; "), Some(found)),
        Err(error) => (error.to_string(), None),
    };
    if let Some(found) = found
        .filter(|found| options.scale != Some(CoordinateScale::Unit(1e-3)) && !has_rows_of(found, motion))
    {
        return Err(format!(
            "{} {}: other rows with {options:?}: {:?}",
            exporter.format,
            exporter.variant,
            found.recording.traces().tip_x_m
        ));
    }
    for (words, apply) in SUGGESTIONS.iter().filter(|_| depth > 0) {
        if let Some((_, rest)) = text.split_once(words) {
            let mut next = options.clone();
            apply(&mut next, rest);
            *followed += 1;
            follow(exporter, motion, source, &next, (depth - 1, followed))?;
        }
    }
    Ok(())
}

#[test]
fn following_the_advice_shifts_and_loses_no_row() {
    let motion = motion();
    let (mut followed, mut wrong) = (0, vec![]);
    for exporter in exporters() {
        let source = exporter.source(&motion);
        for (mistake, make) in mistakes() {
            let mut options = exporter.options(&motion);
            make(&mut options, &motion);
            if let Err(error) = follow(&exporter, &motion, &source, &options, (2, &mut followed)) {
                wrong.push(format!("{mistake}: {error}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(followed > 60, "{followed}");
}
