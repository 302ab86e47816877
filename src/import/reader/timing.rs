//! Determines the frame number of every row: from the column of frame numbers, or else from the grid of
//! equally spaced frames that fits the times.

use crate::import::error::{ImportError, ImportResult};
use crate::import::reader::rate::{
    RATE_AGREEMENT, UNEVEN_RATE, find_quantum_s, fit_own_grid, is_uneven, rounding_s,
};
use crate::import::reader::track_file::{Clock, Column, Track, TrackFile};
use crate::recording::channel::median_in_place;
use crate::recording::clock::{self, FrameFit, MAX_FRAMES, OFF_GRID_LIMIT_FRAMES};
use portable_math as math;

/// Largest `--frame-step` that an error message suggests. A message suggests this option if the declared rate
/// is a whole multiple of the rate that the times imply.
const LARGEST_STEP: f64 = 10.0;
/// Largest frame number that is accepted; a larger number is damaged.
const LARGEST_FRAME: f64 = 1e12;

/// Maximum number of frames per row, averaged over a recording. If there are more, the cause is a damaged
/// number and not lost frames.
pub(crate) const MOST_SPREAD: i64 = 1000;

/// Timing that the user declares with options.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DeclaredTiming {
    pub rate_hz: f64,
    /// Largest allowed relative difference between `rate_hz` and the rate that the times imply.
    pub tolerance: f64,
    /// Whether the times are those of playback and only count frames.
    pub playback: bool,
    pub step: usize,
}

/// Frame numbers of the rows of a clock.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RowFrames {
    /// Frame number of every row: the number in the file, or the number of frames since the first row.
    pub frames: Vec<i64>,
    /// Whether the frame numbers are those in the file; otherwise they are derived from the times.
    pub numbered: bool,
    /// Time of the first row, s, in real time and not in playback time.
    pub start_s: f64,
    /// Time of every row, s, if the times lie on no grid; the rows then count as consecutive frames.
    pub times: Option<Vec<f64>>,
    /// Rate that the times imply, 1/s: frames per second if the file has frame numbers, otherwise rows per
    /// second.
    pub implied_hz: Option<f64>,
}

/// A clock (frame numbers and times of rows), and the file that contains it.
#[derive(Clone, Copy)]
pub(crate) struct ClockRows<'e> {
    pub export: &'e TrackFile<'e>,
    pub clock: &'e Clock,
}

/// Determines the frame number of every row of a clock.
pub(crate) fn place_rows(rows: ClockRows, declared: DeclaredTiming) -> ImportResult<RowFrames> {
    let (file, clock) = (rows.export.file, rows.clock);
    match clock.len() {
        0 => return Err(ImportError::header_only(file, 1)),
        // (one row is enough if it has a frame number and another clock of the file has more rows: a point
        // may be digitised in one frame only)
        1 if clock.frame.is_none() || rows.export.clocks.iter().all(|clock| clock.len() < 2) => {
            let place = format!("{file}:{}:1", clock.line_number(0));
            let (found, expected) = ("a single row of numbers", "one a frame and at least two");
            let advice = "export again with all data rows selected";
            return Err(ImportError::format(place, found, expected, advice));
        }
        _ => {}
    }
    let placed =
        if clock.frame.is_some() { place_by_number(rows, declared) } else { place_by_time(rows, declared) }?;
    refuse_sparse(rows, &placed)?;
    Ok(placed)
}

/// Refuses rows that are so far apart that a frame number or time must be damaged. As a result, the number of
/// rows also limits the memory for the frames.
fn refuse_sparse(rows: ClockRows, placed: &RowFrames) -> ImportResult<()> {
    let jump = |row: usize| placed.frames[row] - placed.frames[row - 1];
    let span = placed.frames.last().zip(placed.frames.first()).map_or(0, |(last, first)| last - first);
    if span <= MOST_SPREAD * placed.frames.len() as i64 {
        return Ok(());
    }
    let row = (1..placed.frames.len()).max_by_key(|&row| jump(row)).unwrap_or(0);
    let column = rows.clock.frame.as_ref().or(rows.clock.time.as_ref());
    let found = column.and_then(|column| column.get(row));
    Err(cell_error(rows, row, FAR_AWAY, found))
}

/// Refuses two clocks of one file that give different times for frame 0.
pub(crate) fn refuse_clock_mismatch(
    rows: ClockRows,
    placed: [&RowFrames; 2],
    rate_hz: f64,
) -> ImportResult<()> {
    let zero_s = |placed: &RowFrames| {
        let timed = placed.numbered && placed.implied_hz.is_some();
        placed.frames.first().filter(|_| timed).map(|first| placed.start_s - *first as f64 / rate_hz)
    };
    let [Some(first_s), Some(other_s)] = placed.map(zero_s) else { return Ok(()) };
    let rounding_s = find_quantum_s(rows.clock).unwrap_or(0.0);
    // (the rates of the two clocks may differ within the tolerance, and then their times drift apart over
    // many frames)
    let [first, other] = placed.map(|placed| placed.frames.first().copied().unwrap_or(0));
    let drift_s = RATE_AGREEMENT * (other - first).abs() as f64 / rate_hz;
    if (first_s - other_s).abs() <= 0.5 / rate_hz + rounding_s + drift_s {
        return Ok(());
    }
    let found = format!("a clock whose frame 0 is at {} s", format_number(other_s));
    let expected = format!("{} s", format_number(first_s));
    Err(ImportError::grid_mismatch(rows.export.file, &found, &expected, "the other track"))
}

/// Number to add to the frame numbers of `other` so that they mean the same frames as those of `first`. An
/// offset that is not a whole number of frames is refused.
pub(crate) fn frame_offset(
    first: (&TrackFile, &RowFrames),
    other: (&TrackFile, &RowFrames),
    rate_hz: f64,
) -> ImportResult<i64> {
    let refuse = |found: &str, expected: &str| {
        Err(ImportError::grid_mismatch(other.0.file, found, expected, first.0.file))
    };
    match (first.1.numbered, other.1.numbered) {
        (true, true) => Ok(0),
        (false, false) => {
            let apart = (other.1.start_s - first.1.start_s) * rate_hz;
            if (apart - apart.round()).abs() > OFF_GRID_LIMIT_FRAMES || apart.abs() > MAX_FRAMES {
                let found = format!("a first row {apart:.3} frames after the other's");
                return refuse(&found, &format!("a whole number of frames (at most {MAX_FRAMES})"));
            }
            Ok(apart.round() as i64)
        }
        (numbered, _) => {
            let word = |numbered| if numbered { "rows with frame numbers" } else { "rows with times only" };
            refuse(word(!numbered), word(numbered))
        }
    }
}

/// Takes the frame numbers from the file. The times are only used to check the rate and to give the time of
/// the first row.
fn place_by_number(rows: ClockRows, declared: DeclaredTiming) -> ImportResult<RowFrames> {
    /// Number of rows from which the time of the first row is checked.
    const FIRST_ROWS: usize = 15;
    let clock = rows.clock;
    let mut frames: Vec<i64> = Vec::with_capacity(clock.len());
    let numbers = clock.frame.iter().flat_map(|column| column.iter());
    for (row, number) in numbers.enumerate() {
        let Some(number) = number else { return Err(cell_error(rows, row, NO_NUMBER, None)) };
        let too_far = frames.first().is_some_and(|&first| number - first as f64 > MAX_FRAMES);
        if number.fract().abs() > 0.0 || number.abs() > LARGEST_FRAME || too_far {
            return Err(cell_error(rows, row, NOT_A_FRAME, Some(number)));
        }
        refuse_disorder(rows, row, frames.last().map(|&last| last as f64), number)?;
        frames.push(number as i64);
    }
    if !declared.playback {
        refuse_disagreeing_clocks(rows, &frames)?;
    }
    apply_frame_step(&mut frames, declared.step)?;
    let (Some(first), Some(last)) = (frames.first().copied(), frames.last().copied()) else {
        return Err(ImportError::header_only(rows.export.file, 1));
    };
    let time_s = |row: usize| clock.time.as_ref().and_then(|column| column.get(row));
    let span_s = time_s(0).zip(time_s(clock.len() - 1)).map(|(from, to)| to - from);
    let implied_hz =
        span_s.map(|span| (last - first) as f64 / span).filter(|rate| rate.is_finite() && *rate > 0.0);
    if let Some(implied) = implied_hz.filter(|_| !declared.playback) {
        // in a short recording, the rounding of the first and last time changes the implied rate
        let rounding_s = find_quantum_s(clock).unwrap_or(0.0);
        let expected_s = (last - first) as f64 / declared.rate_hz;
        if span_s.is_none_or(|span| (span - expected_s).abs() > rounding_s) {
            check_rate(rows, implied, declared, None)?;
        }
    }
    let counted_s = first as f64 / declared.rate_hz;
    // (a damaged or absent first time must not shift the recording; over many rows, the offsets drift with
    // the error of the rate)
    let offset = |(row, frame): (usize, &i64)| Some(time_s(row)? - (frame - first) as f64 / declared.rate_hz);
    let mut offsets: Vec<f64> = frames.iter().enumerate().take(FIRST_ROWS).filter_map(offset).collect();
    let middle_s = median_in_place(&mut offsets).unwrap_or(counted_s);
    let is_near = |start_s: &f64| (start_s - middle_s).abs() <= 0.5 / declared.rate_hz;
    let start_s = if declared.playback { counted_s } else { time_s(0).filter(is_near).unwrap_or(middle_s) };
    Ok(RowFrames { frames, numbered: true, start_s, times: None, implied_hz })
}

/// Refuses frame numbers and times that disagree: one has a pause or a jump that the other does not have.
/// Times with uneven steps throughout are another matter: they are those of a camera with a variable rate.
fn refuse_disagreeing_clocks(rows: ClockRows, frames: &[i64]) -> ImportResult<()> {
    /// Largest allowed difference between the two clocks from a row to the next, frames.
    const MOST_APART: f64 = 0.5;
    /// Largest fraction of the rows at which uneven times count as those of single pauses.
    const FEW_ROWS: f64 = 0.02;
    /// Longest step, frames, from which the time per frame is taken.
    const LONGEST_STEP: f64 = 8.0;
    let Some(times) = &rows.clock.time else { return Ok(()) };
    let timed: Vec<(usize, f64)> =
        times.iter().take(frames.len()).enumerate().filter_map(|(row, time)| Some((row, time?))).collect();
    // row, and its step in frame numbers and in times
    let steps: Vec<(usize, f64, f64)> = timed
        .windows(2)
        .map(|pair| (pair[1].0, (frames[pair[1].0] - frames[pair[0].0]) as f64, pair[1].1 - pair[0].1))
        .collect();
    let mut per_frame: Vec<f64> = steps.iter().map(|(_, counted, step_s)| step_s / counted).collect();
    let Some(middle) = per_frame.len().checked_sub(1).map(|last| last / 2) else { return Ok(()) };
    let median_s = math::select_number(&mut per_frame, middle);
    let rounding_s = 2.0 * rounding_s(rows.clock);
    let differs = |frame_s: f64, (_, counted, step_s): &(usize, f64, f64)| {
        (step_s - counted * frame_s).abs() > MOST_APART * frame_s + rounding_s
    };
    // (the median of rounded steps is coarse; the mean of those that agree with it is not)
    let agreeing = steps.iter().filter(|step| step.1 <= LONGEST_STEP && !differs(median_s, step));
    let (counted, span_s) = agreeing.fold((0.0, 0.0), |sum, step| (sum.0 + step.1, sum.1 + step.2));
    let frame_s = if counted > 0.0 { span_s / counted } else { median_s };
    let disagreeing: Vec<_> = steps.iter().filter(|step| differs(frame_s, step)).collect();
    let are_few = (disagreeing.len() as f64) < 1.0 + FEW_ROWS * steps.len() as f64;
    match disagreeing.first() {
        Some((row, counted, step_s)) if are_few || !is_uneven(rows.clock) => {
            let place = format!("{}:{}:1", rows.export.file, rows.clock.line_number(*row));
            let found = format!(
                "a step of {counted} in the frame numbers and of {:.2} frames in the times",
                step_s / frame_s
            );
            let expected = "frame numbers and times that agree";
            let advice = "find out which of the two is right, and read only that one (--columns frame=... or \
                          --columns time=..., with the positions)";
            Err(ImportError::format(place, found, expected, advice))
        }
        _ => Ok(()),
    }
}

/// Multiplies frame numbers by `--frame-step`. They must increase by 1 from row to row, which shows that they
/// count only the tracked frames.
fn apply_frame_step(frames: &mut [i64], step: usize) -> ImportResult<()> {
    if step == 1 {
        return Ok(());
    }
    if frames.windows(2).any(|pair| pair[1] - pair[0] != 1) {
        let expected = "1, because the file's own frame numbers do not count row by row: they show which \
            frames were tracked";
        return Err(ImportError::option("--frame-step", step, expected));
    }
    frames.iter_mut().for_each(|frame| *frame *= step as i64);
    Ok(())
}

fn place_by_time(rows: ClockRows, declared: DeclaredTiming) -> ImportResult<RowFrames> {
    check_times(rows, declared)?;
    let times = rows.clock.times();
    let row_s = declared.step as f64 / declared.rate_hz;
    if !declared.playback && is_uneven(rows.clock) {
        return keep_times(rows, times.into_owned(), declared);
    }
    let fit = if declared.playback {
        fit_shown_grid(rows, &times)?
    } else {
        fit_declared_grid(rows, &times, row_s, declared)?
    };
    refuse_stray_first_row(rows, &times, &fit)?;
    let start_s = if declared.playback { (times[0] / fit.frame_s).round() * row_s } else { times[0] };
    let frames = fit.frames.iter().map(|&row| (row * declared.step) as i64).collect();
    Ok(RowFrames { frames, numbered: false, start_s, times: None, implied_hz: Some(1.0 / fit.frame_s) })
}

/// Counts the rows of a clock without a grid as consecutive frames and keeps their times. The declared rate
/// serves only to detect times in a wrong unit.
fn keep_times(rows: ClockRows, times: Vec<f64>, declared: DeclaredTiming) -> ImportResult<RowFrames> {
    let implied_hz = clock::median_step_s(&times).map(|step_s| 1.0 / step_s);
    if let Some(implied_hz) = implied_hz {
        let rate_hz = declared.rate_hz / declared.step as f64;
        check_rate(rows, implied_hz, DeclaredTiming { rate_hz, tolerance: UNEVEN_RATE, ..declared }, None)?;
    }
    let frames = (0..times.len() as i64).collect();
    Ok(RowFrames { frames, numbered: false, start_s: times[0], times: Some(times), implied_hz })
}

/// Fits a frame grid to the times. A grid with the declared rate is tried first, because coarsely rounded
/// times do not show their own rate. If it does not fit, a grid with the rate that the times show is fitted.
fn fit_declared_grid(
    rows: ClockRows,
    times: &[f64],
    row_s: f64,
    declared: DeclaredTiming,
) -> ImportResult<FrameFit> {
    let agrees = |fit: &FrameFit| (fit.frame_s / row_s - 1.0).abs() <= declared.tolerance;
    if let Some(fit) = clock::number_frames(times, row_s)
        .filter(|fit| fit.is_on_grid() && agrees(fit) && fit.smallest_step() == 1)
    {
        return Ok(fit);
    }
    refuse_coarse_times(rows, times, row_s, declared)?;
    let fit = fit_shown_grid(rows, times)?;
    if !agrees(&fit) {
        let step = (fit.frame_s / row_s).round();
        let plausible = declared.step == 1
            && (2.0..=LARGEST_STEP).contains(&step)
            && (fit.frame_s / row_s / step - 1.0).abs() <= RATE_AGREEMENT;
        let of_rows = DeclaredTiming { rate_hz: 1.0 / row_s, ..declared };
        check_rate(rows, 1.0 / fit.frame_s, of_rows, plausible.then_some(step as usize))?;
    }
    Ok(fit)
}

/// Refuses times that agree with the declared rate on average, but are rounded too coarsely to number the
/// frames.
fn refuse_coarse_times(
    rows: ClockRows,
    times: &[f64],
    row_s: f64,
    declared: DeclaredTiming,
) -> ImportResult<()> {
    let limit_s = 2.0 * OFF_GRID_LIMIT_FRAMES * row_s; // (rounding changes a time by half a quantum at most)
    let quantum_s = find_quantum_s(rows.clock).filter(|quantum| *quantum > limit_s);
    let Some(quantum_s) = quantum_s else { return Ok(()) };
    let steps = times.windows(2).map(|w| w[1] - w[0]);
    let (least, most) =
        steps.fold((f64::INFINITY, 0.0_f64), |(least, most), step| (least.min(step), most.max(step)));
    let span_s = times[times.len() - 1] - times[0];
    let mean_agrees =
        ((times.len() - 1) as f64 * row_s / span_s - 1.0).abs() <= RATE_AGREEMENT + quantum_s / span_s;
    // (equal steps from time to time mean that the rate differs, not that the times are rounded)
    if most - least > quantum_s / 2.0 && mean_agrees {
        let problem = format!(
            "the times are rounded to {quantum_s} s, too coarsely to number the frames at {} frames/s; expected \
             less than {limit_s:.3e} s: name a column that counts frames instead (--columns frame=...), or \
             export the times with more digits",
            declared.rate_hz
        );
        return Err(ImportError::unusable(rows.export.file, problem));
    }
    Ok(())
}

/// Fits a frame grid whose rate is taken from the times, not from the user.
fn fit_shown_grid(rows: ClockRows, times: &[f64]) -> ImportResult<FrameFit> {
    let row = match fit_own_grid(rows.clock) {
        Some(fit) if fit.is_on_grid() => return Ok(fit.clone()),
        Some(fit) => fit.worst_row,
        None => {
            let jump = |row: usize| times[row] - times[row - 1];
            (1..times.len()).max_by(|&a, &b| jump(a).total_cmp(&jump(b))).unwrap_or(0)
        }
    };
    Err(off_grid_error(rows, row, times[row]))
}

/// Formats a number for a message; without an exponent, unless it is very large or very small.
fn format_number(value: f64) -> String {
    if value == 0.0 || (1e-9..1e15).contains(&value.abs()) { value.to_string() } else { format!("{value:e}") }
}

/// Refuses a row without a time, and a time that is not after that of the row above.
fn check_times(rows: ClockRows, declared: DeclaredTiming) -> ImportResult<()> {
    let Some(times) = &rows.clock.time else { return Err(cell_error(rows, 0, NO_NUMBER, None)) };
    let mut last = None;
    for (row, time) in times.iter().enumerate() {
        let Some(time) = time else { return Err(cell_error(rows, row, NO_NUMBER, None)) };
        if last == Some(time) && !repeats_row_above(rows, row) && are_rows_frames(rows, declared) {
            return Err(cell_error(rows, row, ROUNDED_TIME, Some(time)));
        }
        refuse_disorder(rows, row, last, time)?;
        last = Some(time);
    }
    Ok(())
}

/// Whether the last digit of the times is larger than a frame, and the number of rows is the number of frames
/// from the first to the last time at the declared rate.
fn are_rows_frames(rows: ClockRows, declared: DeclaredTiming) -> bool {
    let times = rows.clock.times();
    let span_s = times.last().zip(times.first()).map_or(0.0, |(last, first)| last - first);
    let frames = span_s * declared.rate_hz / declared.step as f64;
    let digit = rows.clock.digit * declared.rate_hz / declared.step as f64;
    let rounding = 1.0 + digit;
    !declared.playback && digit > 1.0 && (frames - (times.len() as f64 - 1.0)).abs() <= rounding
}

/// Whether a row has the same positions as the row above it.
fn repeats_row_above(rows: ClockRows, row: usize) -> bool {
    let same = |column: &Column| column.get(row) == column.get(row - 1);
    let of_clock = |track: &&Track| {
        rows.export.clocks.get(track.clock).is_some_and(|clock| std::ptr::eq(clock, rows.clock))
    };
    let mut tracks = rows.export.tracks.iter().filter(of_clock);
    tracks.all(|track| same(&track.x) && track.y.as_ref().is_none_or(same))
}

/// Minimum number of frames between the first and the second row if the first row counts as isolated.
const FRAMES_ALONE: usize = 10;
/// Factor in two tests of the first row. The row is isolated if the gap after it is at least this factor
/// longer than every other gap. It is off the grid if its distance from the grid is more than this factor
/// times the largest distance of the other rows.
const OFF_THE_OTHERS: f64 = 3.0;

/// Refuses a first row that is many frames before the other rows and off their grid. For example, the time of
/// such a row may have another unit.
fn refuse_stray_first_row(rows: ClockRows, times: &[f64], fit: &FrameFit) -> ImportResult<()> {
    let gap = |row: usize| fit.frames[row] - fit.frames[row - 1];
    let alone = times.len() > 3
        && gap(1) >= FRAMES_ALONE
        && (2..times.len()).all(|row| OFF_THE_OTHERS * gap(row) as f64 <= gap(1) as f64);
    if !alone {
        return Ok(());
    }
    let Some(others) = clock::number_frames(&times[1..], fit.frame_s) else { return Ok(()) };
    let ahead = (times[1] - times[0]) / others.frame_s;
    let off = (ahead - ahead.round()).abs();
    let rounding = rows.clock.digit / others.frame_s;
    if off > (OFF_THE_OTHERS * others.worst_frames).max(rounding) + FEW_PARTS {
        return Err(off_grid_error(rows, 0, times[0]));
    }
    Ok(())
}

/// Largest allowed distance of an isolated first row from the grid, in frames, in addition to the other
/// limits. An error of the fitted rate can cause this distance over a long gap.
const FEW_PARTS: f64 = 0.02;

fn refuse_disorder(rows: ClockRows, row: usize, last: Option<f64>, next: f64) -> ImportResult<()> {
    let remedy = match last {
        Some(last) if next < last => BACKWARDS,
        Some(last) if next == last && repeats_row_above(rows, row) => TWICE,
        Some(last) if next == last && rows.clock.frame.is_some() => SAME_FRAME,
        Some(last) if next == last => SAME_TIME,
        _ => return Ok(()),
    };
    Err(cell_error(rows, row, remedy, Some(next)))
}

fn check_rate(
    rows: ClockRows,
    implied_hz: f64,
    declared: DeclaredTiming,
    step: Option<usize>,
) -> ImportResult<()> {
    let declared_hz = declared.rate_hz;
    if (implied_hz / declared_hz - 1.0).abs() <= declared.tolerance {
        return Ok(());
    }
    Err(ImportError::rate_mismatch(rows.export.file, implied_hz, declared_hz, step))
}

/// What is expected in a cell of the clock, and what to do.
type ClockRemedy = (&'static str, &'static str);

const AFTER: &str = "a value after that of the row above";
const NO_NUMBER: ClockRemedy = (
    "a number in every row",
    "complete the row from what the tracking program shows, or export again; a gap needs no row",
);
const NOT_A_FRAME: ClockRemedy = (
    "a whole number, at most 10 million after the first",
    "correct the cell, name the column that counts frames, or use the time column",
);
const FAR_AWAY: ClockRemedy = (
    "a value near that of the row above: as it stands, fewer than one frame in a thousand has a row",
    "correct the number from what the tracking program shows; if the rows are of several recordings, import each by itself",
);
const BACKWARDS: ClockRemedy = (
    AFTER,
    "export again in the order of time; if a spreadsheet has taken numbers for dates or sorted the rows, \
     go back to the tracking program's own export",
);
const TWICE: ClockRemedy = (
    "a value after that of the row above, whose positions are the same: the row is there twice",
    "keep one of the two lines in a copy of the file, or export again from the tracking program",
);
const SAME_FRAME: ClockRemedy =
    (AFTER, "see in the tracking program which of the two rows is right, and export again");
const SAME_TIME: ClockRemedy = (
    AFTER,
    "export again from the tracking program, with more digits if the times are rounded more coarsely than \
     the frames, or name a column that counts frames (--columns frame=...)",
);
const ROUNDED_TIME: ClockRemedy = (
    AFTER,
    "export the times with more digits, or name a column that counts frames; the file has as many rows as \
     frames, so each row is probably one frame (--columns frame=row,...)",
);
const OFF_GRID: ClockRemedy = (
    "a time on the frame grid of the other rows, within 0.3 of a frame",
    "correct the time from what the tracking program shows; files with a variable frame rate need a frame column (--columns \
     frame=...)",
);
const FIRST_OFF_GRID: ClockRemedy = (
    "a time on the frame grid of the other rows: the first row stands alone before them, between two frames",
    "correct its time from what the tracking program shows (its unit may be another), or import a copy of the file without the line",
);

/// Error for a row whose number does not fit the grid of the other rows.
fn off_grid_error(rows: ClockRows, row: usize, time: f64) -> ImportError {
    cell_error(rows, row, if row == 0 { FIRST_OFF_GRID } else { OFF_GRID }, Some(time))
}

fn cell_error(rows: ClockRows, row: usize, remedy: ClockRemedy, found: Option<f64>) -> ImportError {
    let name = if rows.clock.frame.is_some() { "frame" } else { "time" };
    let found = found.map_or_else(String::new, format_number);
    ImportError::cell(rows.export.row_location(rows.clock, row), (name, &found), remedy)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn placed(times: &[f64], declared: DeclaredTiming) -> Result<RowFrames, ImportError> {
        let lines = (0..times.len()).map(|row| row as u32 + 2).collect();
        let clock =
            Clock { lines, time: Some(times.iter().copied().map(Some).collect()), ..Clock::default() };
        let export = TrackFile { file: "a.csv", ..TrackFile::default() };
        place_rows(ClockRows { export: &export, clock: &clock }, declared)
    }

    fn declared(rate_hz: f64) -> DeclaredTiming {
        DeclaredTiming { rate_hz, tolerance: RATE_AGREEMENT, playback: false, step: 1 }
    }

    #[test]
    fn coarsely_rounded_times_fall_on_the_declared_grid() {
        let times: Vec<f64> = (0..400).map(|i| (f64::from(i) / 400.0 * 1000.0).round() / 1000.0).collect();
        assert_eq!(placed(&times, declared(400.0)).unwrap().frames, (0..400).collect::<Vec<i64>>());
    }

    #[test]
    fn times_too_coarse_for_the_rate_are_not_taken_for_another_rate() {
        let rounded = |rate: f64| -> Vec<f64> {
            (0..400).map(|i| (f64::from(i) / rate * 1000.0).round() / 1000.0).collect()
        };
        for rate in [700.0, 800.0, 950.0] {
            let message = placed(&rounded(rate), declared(rate)).unwrap_err().to_string();
            assert!(
                message.contains("rounded to 0.001 s, too coarsely")
                    && message.contains("--columns frame=..."),
                "{rate}: {message}"
            );
        }
        // times with equal steps imply another rate than the declared one, with gaps or without
        let gaps: Vec<f64> =
            rounded(1000.0).into_iter().enumerate().filter(|(i, _)| i % 50 != 7).map(|(_, t)| t).collect();
        for times in [rounded(1000.0), gaps] {
            let message = placed(&times, declared(800.0)).unwrap_err().to_string();
            assert!(message.contains("the times imply 1000.0"), "{message}");
        }
    }

    #[test]
    fn a_single_row_is_no_recording() {
        let message = placed(&[0.0], declared(1000.0)).unwrap_err().to_string();
        assert!(message.starts_with("a.csv:2:1: found a single row of numbers"), "{message}");
    }

    #[test]
    fn playback_times_are_refused_with_both_rates_and_taken_when_declared() {
        let times: Vec<f64> = (0..50).map(|i| 1.0 + f64::from(i) / 25.0).collect();
        let message = placed(&times, declared(10_000.0)).unwrap_err().to_string();
        assert!(
            message
                .contains("imply 25.000000 frames/s, but --frame-rate-hz says 10000 (a factor of 400.0000)"),
            "{message}"
        );
        let placed = placed(&times, DeclaredTiming { playback: true, ..declared(10_000.0) }).unwrap();
        assert_eq!((placed.start_s, placed.frames[49]), (0.0025, 49));
    }

    #[test]
    fn every_second_frame_needs_its_step() {
        let times: Vec<f64> = (0..50).map(|i| f64::from(i) / 500.0).collect();
        let message = placed(&times, declared(1000.0)).unwrap_err().to_string();
        assert!(message.contains("add --frame-step 2"), "{message}");
        assert_eq!(
            placed(&times, DeclaredTiming { step: 2, ..declared(1000.0) }).unwrap().frames[..3],
            [0, 2, 4]
        );
    }

    #[test]
    fn numbers_that_count_tracked_frames_take_the_step_and_others_refuse_it() {
        let numbered = |numbers: &[f64]| {
            let clock = Clock {
                lines: vec![2; numbers.len()],
                frame: Some(numbers.iter().copied().map(Some).collect()),
                ..Clock::default()
            };
            place_rows(
                ClockRows { export: &TrackFile { file: "a.csv", ..TrackFile::default() }, clock: &clock },
                DeclaredTiming { step: 3, ..declared(1000.0) },
            )
        };
        assert_eq!(numbered(&[4.0, 5.0, 6.0]).unwrap().frames, [12, 15, 18]);
        let message = numbered(&[0.0, 3.0, 6.0]).unwrap_err().to_string();
        assert!(message.starts_with("--frame-step: found `3`, expected 1"), "{message}");
    }

    #[test]
    fn rounded_ends_of_a_short_record_are_no_other_rate() {
        let clock = Clock {
            lines: vec![2; 5],
            frame: Some((0..5).map(|i| Some(f64::from(i))).collect()),
            time: Some([0.0, 3e-4, 7e-4, 1e-3, 1.3e-3].into_iter().map(Some).collect()),
            ..Clock::default()
        };
        let export = TrackFile { file: "a.csv", ..TrackFile::default() };
        assert!(place_rows(ClockRows { export: &export, clock: &clock }, declared(3000.0)).is_ok());
        let other = place_rows(ClockRows { export: &export, clock: &clock }, declared(1000.0)).unwrap_err();
        assert!(other.to_string().contains("but --frame-rate-hz says 1000"), "{other}");
    }

    #[test]
    fn a_number_that_leaves_nearly_all_frames_empty_is_refused_at_its_row() {
        let mut times: Vec<f64> = (0..40).map(|i| f64::from(i) / 1000.0).collect();
        times[39] = 90.0;
        let message = placed(&times, declared(1000.0)).unwrap_err().to_string();
        assert!(
            message.starts_with(
                "a.csv:41:1: column time: found `90`, expected a value near that of the row above"
            ),
            "{message}"
        );
        times[39] = 30.0;
        assert_eq!(placed(&times, declared(1000.0)).unwrap().frames[39], 30_000);
    }

    #[test]
    fn a_jump_beyond_any_recording_is_refused_at_its_row() {
        let message = placed(&[0.0, 0.001, 0.002, 43_513.0], declared(1000.0)).unwrap_err().to_string();
        assert!(
            message.starts_with("a.csv:5:1: column time: found `43513`, expected a time on the frame grid"),
            "{message}"
        );
    }
}
