//! Rows to frames: the frame column where there is one, else the time column on the grid that fits it.

use super::error::{CellProblem, ImportError, Place};
use super::options::TimeColumn;
use super::{Export, Stamp};
use crate::recording::clock::{self, FrameFit, MAX_FRAMES, OFF_GRID_LIMIT_FRAMES};

/// Largest difference between the rate that the times imply and the declared one: cameras hold theirs to parts in ten
/// thousand, and wrong rates are wrong by far more.
const RATE_AGREEMENT: f64 = 0.01;
/// Largest step between tracked frames that is suggested where the rates are an integer apart.
const LARGEST_STEP: f64 = 10.0;
/// Largest frame number: beyond it a double no longer counts one by one, and no camera counts so far.
const LARGEST_FRAME: f64 = 1e12;

/// Decimal places to which programs round times, s.
const QUANTA_S: [f64; 6] = [1.0, 0.1, 1e-2, 1e-3, 1e-4, 1e-5];

/// What the user declared about time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Declared {
    pub rate_hz: f64,
    pub time: TimeColumn,
    pub step: usize,
}

/// Rows of one export with their frames.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Placed {
    /// Frame of every row: the file's own numbers, or counted from its first row.
    pub frames: Vec<i64>,
    /// Whether they are the file's own numbers.
    pub numbered: bool,
    /// Time of the first row in the recording's own time, s.
    pub start_s: f64,
    /// Rate that the time column implies, rows a second.
    pub implied_hz: Option<f64>,
}

/// Gives every row its frame.
pub(super) fn place(export: &Export, declared: Declared) -> Result<Placed, ImportError> {
    match export.stamps.as_slice() {
        [] => return Err(ImportError::HeaderOnly { file: export.file.clone(), line: 1 }),
        [only] => return Err(ImportError::OneRow { file: export.file.clone(), line: only.line }),
        _ => {}
    }
    if export.stamps.iter().any(|stamp| stamp.frame.is_some()) { by_number(export, declared) } else { by_time(export, declared) }
}

/// Frames between the first rows of two exports; a refusal when it is no whole number.
pub(super) fn offset(first: (&Export, &Placed), other: (&Export, &Placed), rate_hz: f64) -> Result<i64, ImportError> {
    let refuse = |found: String, expected: String| ImportError::Grids { file: other.0.file.clone(), found, expected, other: first.0.file.clone() };
    match (first.1.numbered, other.1.numbered) {
        (true, true) => Ok(0),
        (false, false) => {
            let apart = (other.1.start_s - first.1.start_s) * rate_hz;
            if (apart - apart.round()).abs() > OFF_GRID_LIMIT_FRAMES || apart.abs() > MAX_FRAMES {
                return Err(refuse(format!("a first row {apart:.3} frames after the other's"), format!("a whole number of frames (at most {MAX_FRAMES})")));
            }
            Ok(apart.round() as i64)
        }
        (numbered, _) => {
            let word = |numbered| if numbered { "rows with frame numbers" } else { "rows with times only" };
            Err(refuse(word(!numbered).to_owned(), word(numbered).to_owned()))
        }
    }
}

/// The file counts its frames; its times only serve to check the rate and to place the start.
fn by_number(export: &Export, declared: Declared) -> Result<Placed, ImportError> {
    let mut frames: Vec<i64> = vec![];
    for stamp in &export.stamps {
        let Some(number) = stamp.frame else { return Err(cell(export, stamp, CellProblem::NoTime, String::new())) };
        if number.fract().abs() > 0.0 || number.abs() > LARGEST_FRAME {
            return Err(cell(export, stamp, CellProblem::NotAFrame, readable(number)));
        }
        refuse_disorder(export, stamp, frames.last().map(|&last| last as f64), number)?;
        frames.push(number as i64);
    }
    let (first, last) = (&export.stamps[0], &export.stamps[export.stamps.len() - 1]);
    let count = (frames[frames.len() - 1] - frames[0]) as f64;
    let implied_hz = first.time_s.zip(last.time_s).map(|(from, to)| count / (to - from)).filter(|rate| rate.is_finite() && *rate > 0.0);
    if declared.time == TimeColumn::Real
        && let Some(implied) = implied_hz
    {
        agree(export, implied, declared.rate_hz, None)?;
    }
    let counted_s = frames[0] as f64 / declared.rate_hz;
    let start_s = if declared.time == TimeColumn::Real { first.time_s.unwrap_or(counted_s) } else { counted_s };
    Ok(Placed { frames, numbered: true, start_s, implied_hz })
}

fn by_time(export: &Export, declared: Declared) -> Result<Placed, ImportError> {
    let times = times(export)?;
    let row_s = declared.step as f64 / declared.rate_hz;
    let fit = match declared.time {
        TimeColumn::Real => by_real_time(export, &times, row_s, declared)?,
        TimeColumn::Playback => by_spacing(export, &times)?,
    };
    let start_s = match declared.time {
        TimeColumn::Real => times[0],
        TimeColumn::Playback => (times[0] / fit.frame_s).round() * row_s,
    };
    let frames = fit.frames.iter().map(|&row| (row * declared.step) as i64).collect();
    Ok(Placed { frames, numbered: false, start_s, implied_hz: Some(1.0 / fit.frame_s) })
}

/// The declared grid first: it explains times that are rounded too coarsely to show their own.
fn by_real_time(export: &Export, times: &[f64], row_s: f64, declared: Declared) -> Result<FrameFit, ImportError> {
    let agrees = |fit: &FrameFit| (fit.frame_s / row_s - 1.0).abs() <= RATE_AGREEMENT;
    if let Some(fit) = clock::number_frames(times, row_s).filter(|fit| fit.holds() && agrees(fit) && fit.smallest_step() == 1) {
        return Ok(fit);
    }
    refuse_coarse(export, times, row_s, declared)?;
    let fit = by_spacing(export, times)?;
    if !agrees(&fit) {
        let step = (fit.frame_s / row_s).round();
        let plausible = declared.step == 1 && (2.0..=LARGEST_STEP).contains(&step) && (fit.frame_s / row_s / step - 1.0).abs() <= RATE_AGREEMENT;
        agree(export, 1.0 / fit.frame_s, 1.0 / row_s, plausible.then_some(step as usize))?;
    }
    Ok(fit)
}

/// Times that follow the declared rate, but are rounded so coarsely that they show another one, or none.
fn refuse_coarse(export: &Export, times: &[f64], row_s: f64, declared: Declared) -> Result<(), ImportError> {
    let limit_s = 2.0 * OFF_GRID_LIMIT_FRAMES * row_s; // rounding moves a time by half a quantum
    let multiples = |quantum: &f64| times.iter().all(|t| (t / quantum - (t / quantum).round()).abs() <= 1e-6);
    let Some(quantum_s) = QUANTA_S.into_iter().find(multiples).filter(|quantum| *quantum > limit_s) else { return Ok(()) };
    let steps = times.windows(2).map(|w| w[1] - w[0]);
    let (least, most) = steps.fold((f64::INFINITY, 0.0_f64), |(least, most), step| (least.min(step), most.max(step)));
    let span_s = times[times.len() - 1] - times[0];
    let mean_agrees = ((times.len() - 1) as f64 * row_s / span_s - 1.0).abs() <= RATE_AGREEMENT + quantum_s / span_s;
    // even steps are a grid of their own: another rate, not rounding
    if most - least > quantum_s / 2.0 && mean_agrees {
        return Err(ImportError::CoarseTimes { file: export.file.clone(), quantum_s, declared_hz: declared.rate_hz, limit_s });
    }
    Ok(())
}

/// The grid that the times themselves show.
fn by_spacing(export: &Export, times: &[f64]) -> Result<FrameFit, ImportError> {
    let fit = clock::median_step_s(times).and_then(|seed_s| clock::number_frames(times, seed_s));
    let found = |row: usize| readable(times[row]);
    match fit {
        Some(fit) if fit.holds() => Ok(fit),
        Some(fit) => Err(cell(export, &export.stamps[fit.worst_row], CellProblem::OffGrid, found(fit.worst_row))),
        None => {
            let jump = |row: usize| times[row] - times[row - 1];
            let row = (1..times.len()).max_by(|&a, &b| jump(a).total_cmp(&jump(b))).unwrap_or(0);
            Err(cell(export, &export.stamps[row], CellProblem::OffGrid, found(row)))
        }
    }
}

/// A number for a message: as written where that is short.
fn readable(value: f64) -> String {
    if value == 0.0 || (1e-9..1e15).contains(&value.abs()) { value.to_string() } else { format!("{value:e}") }
}

fn times(export: &Export) -> Result<Vec<f64>, ImportError> {
    let mut times: Vec<f64> = vec![];
    for stamp in &export.stamps {
        let Some(time) = stamp.time_s else { return Err(cell(export, stamp, CellProblem::NoTime, String::new())) };
        refuse_disorder(export, stamp, times.last().copied(), time)?;
        times.push(time);
    }
    Ok(times)
}

fn refuse_disorder(export: &Export, stamp: &Stamp, last: Option<f64>, next: f64) -> Result<(), ImportError> {
    match last {
        Some(last) if next == last => Err(cell(export, stamp, CellProblem::Duplicate, readable(next))),
        Some(last) if next < last => Err(cell(export, stamp, CellProblem::Backwards, readable(next))),
        _ => Ok(()),
    }
}

fn agree(export: &Export, implied_hz: f64, declared_hz: f64, step: Option<usize>) -> Result<(), ImportError> {
    if (implied_hz / declared_hz - 1.0).abs() <= RATE_AGREEMENT {
        return Ok(());
    }
    Err(ImportError::Rate { file: export.file.clone(), implied_hz, declared_hz, step })
}

fn cell(export: &Export, stamp: &Stamp, problem: CellProblem, found: String) -> ImportError {
    let (expected, advice) = match problem {
        CellProblem::NotANumber | CellProblem::NoTime => ("a number in every row", "complete or remove the row; a gap needs no row"),
        CellProblem::NotAFrame => ("a whole number", "name the column that counts frames, or use the time column"),
        CellProblem::Duplicate => (
            "a value after that of the row above",
            "remove the repeated row; if the times are rounded more coarsely than the frames, use a frame column (--columns frame=...)",
        ),
        CellProblem::Backwards => {
            ("a value after that of the row above", "sort the rows; if a spreadsheet has taken numbers for dates, go back to the tracking program's own export")
        }
        CellProblem::OffGrid => (
            "a time on the frame grid of the other rows, within 0.3 of a frame",
            "correct or remove the row; files with a variable frame rate need a frame column (--columns frame=...)",
        ),
    };
    ImportError::Cell {
        place: Place { file: export.file.clone(), line: stamp.line, column: stamp.column },
        problem,
        name: if stamp.frame.is_some() { "frame" } else { "time" }.to_owned(),
        found: found.into(),
        expected,
        advice,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn export(times: &[f64]) -> Export {
        let stamps = times.iter().enumerate().map(|(row, &t)| Stamp { line: row + 2, column: 1, frame: None, time_s: Some(t) });
        Export { file: "a.csv".to_owned(), stem: "a".to_owned(), stamps: stamps.collect(), tracks: vec![], notes: vec![], texts: vec![] }
    }

    fn declared(rate_hz: f64) -> Declared {
        Declared { rate_hz, time: TimeColumn::Real, step: 1 }
    }

    #[test]
    fn coarsely_rounded_times_fall_on_the_declared_grid() {
        let times: Vec<f64> = (0..400).map(|i| (f64::from(i) / 400.0 * 1000.0).round() / 1000.0).collect();
        assert_eq!(place(&export(&times), declared(400.0)).unwrap().frames, (0..400).collect::<Vec<i64>>());
    }

    #[test]
    fn times_too_coarse_for_the_rate_are_not_taken_for_another_rate() {
        let rounded = |rate: f64| -> Vec<f64> { (0..400).map(|i| (f64::from(i) / rate * 1000.0).round() / 1000.0).collect() };
        for rate in [700.0, 800.0, 950.0] {
            let message = place(&export(&rounded(rate)), declared(rate)).unwrap_err().to_string();
            assert!(message.contains("rounded to 0.001 s, too coarsely") && message.contains("--columns frame=..."), "{rate}: {message}");
        }
        // evenly spaced times are another rate, with gaps or without
        let gaps: Vec<f64> = rounded(1000.0).into_iter().enumerate().filter(|(i, _)| i % 50 != 7).map(|(_, t)| t).collect();
        for times in [rounded(1000.0), gaps] {
            assert!(matches!(place(&export(&times), declared(800.0)), Err(ImportError::Rate { .. })));
        }
    }

    #[test]
    fn a_single_row_is_no_recording() {
        let message = place(&export(&[0.0]), declared(1000.0)).unwrap_err().to_string();
        assert!(message.starts_with("a.csv:2:1: found a single row of numbers"), "{message}");
    }

    #[test]
    fn playback_times_are_refused_with_both_rates_and_taken_when_declared() {
        let times: Vec<f64> = (0..50).map(|i| 1.0 + f64::from(i) / 25.0).collect();
        let message = place(&export(&times), declared(10_000.0)).unwrap_err().to_string();
        assert!(message.contains("imply 25.000000 frames/s, but --frame-rate-hz says 10000 (a factor of 400.0000)"), "{message}");
        let placed = place(&export(&times), Declared { time: TimeColumn::Playback, ..declared(10_000.0) }).unwrap();
        assert_eq!((placed.start_s, placed.frames[49]), (0.0025, 49));
    }

    #[test]
    fn every_second_frame_needs_its_step() {
        let times: Vec<f64> = (0..50).map(|i| f64::from(i) / 500.0).collect();
        let message = place(&export(&times), declared(1000.0)).unwrap_err().to_string();
        assert!(message.contains("add --frame-step 2"), "{message}");
        assert_eq!(place(&export(&times), Declared { step: 2, ..declared(1000.0) }).unwrap().frames[..3], [0, 2, 4]);
    }

    #[test]
    fn a_jump_beyond_any_recording_is_refused_at_its_row() {
        let message = place(&export(&[0.0, 0.001, 0.002, 43_513.0]), declared(1000.0)).unwrap_err().to_string();
        assert!(message.starts_with("a.csv:5:1: column time: found `43513`, expected a time on the frame grid"), "{message}");
    }
}
