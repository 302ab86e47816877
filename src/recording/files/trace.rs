//! `trace.csv`: one row per frame; a cell is empty if the point was not tracked.

use super::FilesError;
use crate::recording::clock::{self, FRAMES_WITHOUT_ROWS, FrameFit};
use crate::recording::{FrameGrid, Recording, Traces};
use crate::text::parse_finite;
use rayon::prelude::*;
use std::fmt::Write;

const NO_ROWS: &str = ": found no rows of numbers, expected the header \
    `time_s,tip_x_m,tip_y_m,head_x_m,head_y_m` and a row a frame; import the recording again";

/// First columns in the header of every `trace.csv`; the confidences may follow.
pub const HEADER: &str = "time_s,tip_x_m,tip_y_m,head_x_m,head_y_m";
/// Header of a recording without heights; every height is then absent, as in an empty cell.
const HEADER_ALONG: &str = "time_s,tip_x_m,head_x_m";
const CONFIDENCES: [&str; 2] = ["tip_confidence", "head_confidence"];
const POSITIONS: usize = 4;
/// Number of rows in a block of text (about half a megabyte); [`BLOCKS`] blocks are written in parallel.
const BLOCK_ROWS: usize = 4096;
const BLOCKS: usize = 8;
/// Usual length of a cell, bytes.
const CELL_BYTES: usize = 16;

/// A rounded frame rate is always accepted if every time is within this distance, in frames, of its frame.
/// Times printed with 16 digits are far closer to their frames.
const SNAP_FRAMES: f64 = 1e-6;

/// The recording as `trace.csv`: times from the grid or the true times, each number with the fewest digits
/// that preserve its value.
#[must_use]
pub fn trace_csv(recording: &Recording) -> String {
    trace_blocks(recording).collect()
}

/// The text of [`trace_csv`] in pieces, so that the whole text of a long recording is never in memory at
/// once.
pub fn trace_blocks(recording: &Recording) -> impl Iterator<Item = String> {
    let columns: Vec<_> = recording.traces().columns().collect();
    let optional = columns.iter().skip(POSITIONS).map(|(name, _)| format!(",{name}"));
    let header = HEADER.to_owned() + &optional.collect::<String>() + "\n";
    let frames = recording.grid().frames;
    let rows = (0..frames).step_by(BLOCK_ROWS * BLOCKS).flat_map(move |start| {
        let block = |index: usize| {
            let mut text = String::with_capacity(BLOCK_ROWS * (columns.len() + 1) * CELL_BYTES);
            for frame in start + index * BLOCK_ROWS..frames.min(start + (index + 1) * BLOCK_ROWS) {
                let cells = columns.iter().map(|(_, column)| column.get(frame).copied().flatten());
                push_trace_row(&mut text, recording.time_s(frame), cells);
            }
            text
        };
        (0..BLOCKS).into_par_iter().map(block).collect::<Vec<String>>()
    });
    std::iter::once(header).chain(rows)
}

/// Adds a row of `trace.csv` to `text`: the time, s, and one cell per column, which is empty if the value is
/// missing.
pub fn push_trace_row(text: &mut String, time_s: f64, cells: impl IntoIterator<Item = Option<f64>>) {
    push_number(text, time_s);
    for cell in cells {
        text.push(',');
        if let Some(value) = cell {
            push_number(text, value);
        }
    }
    text.push('\n');
}

/// Appends the shortest text that parses to the same number; it has an exponent only if plain digits would be
/// long.
fn push_number(text: &mut String, value: f64) {
    if value == 0.0 || (1e-4..1e16).contains(&value.abs()) {
        let mut buffer = zmij::Buffer::new();
        let digits = buffer.format_finite(value); // (in this range: plain digits, always with a point)
        text.push_str(digits.strip_suffix(".0").unwrap_or(digits));
    } else {
        let _ = write!(text, "{value:e}"); // (writing to a String cannot fail)
    }
}

/// Reads `trace.csv` without its description. The frame rate is estimated from the times: it is the rate with
/// the fewest digits that fits the times. Missing rows become missing frames.
///
/// # Errors
/// [`FilesError`] with file, line and column.
pub fn parse_trace_csv(file: &str, text: &str) -> Result<(FrameGrid, Traces), FilesError> {
    TraceTable::parse(file, text)?.place_at_fitted_rate(file)
}

/// The rows of `trace.csv` as written, before frame numbers are assigned.
pub(super) struct TraceTable<'a> {
    text: &'a str,
    confidences: [bool; 2],
    times_s: Vec<f64>,
    columns: Vec<Vec<Option<f64>>>,
}

impl<'a> TraceTable<'a> {
    pub(super) fn parse(file: &str, text: &'a str) -> Result<Self, FilesError> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let header = text.lines().next().unwrap_or_default().trim();
        let confidences = CONFIDENCES.map(|name| header.split(',').any(|found| found == name));
        let expected =
            HEADER.split(',').chain(CONFIDENCES.into_iter().zip(confidences).filter(|c| c.1).map(|c| c.0));
        if text.trim().is_empty() {
            return Err(FilesError::refuse(file, NO_ROWS));
        }
        let along = header == HEADER_ALONG;
        if !along && !expected.eq(header.split(',')) {
            let found: String = header.chars().take(80).collect();
            let problem = format!(
                ":1:1: found the header `{found}`, expected `{HEADER}` and optionally \
                 `,tip_confidence,head_confidence`, or `{HEADER_ALONG}` without heights; any other table is \
                 read by `wiperlab import --columns`"
            );
            return Err(FilesError::refuse(file, problem));
        }
        let names: Vec<&str> = header.split(',').collect();
        let rows = numbered_rows(text).count();
        if rows as f64 > clock::MAX_FRAMES {
            return Err(too_long_error(file));
        }
        let columns = names[1..].iter().map(|_| Vec::with_capacity(rows)).collect();
        let mut table = Self { text, confidences, times_s: Vec::with_capacity(rows), columns };
        for (line, row) in numbered_rows(text) {
            table.add_row(file, line, row, &names)?;
        }
        if along {
            let nothing = vec![None; table.times_s.len()];
            table.columns.insert(1, nothing.clone());
            table.columns.push(nothing);
        }
        if table.times_s.len() < 2 { Err(FilesError::refuse(file, NO_ROWS)) } else { Ok(table) }
    }

    fn add_row(&mut self, file: &str, line: u64, row: &str, names: &[&str]) -> Result<(), FilesError> {
        let commas = row.bytes().filter(|byte| *byte == b',').count();
        let (found, expected) = (commas + 1, names.len());
        if found != expected {
            let problem = format!(
                ":{line}:1: found {found} cells, expected {expected} as in the header; complete the row (a \
                 missing value is an empty cell)"
            );
            return Err(FilesError::refuse(file, problem));
        }
        let mut cells = row.split(',').map(str::trim);
        let refuse = |column: &str, found: &str, expected: &str| {
            let problem = format!(
                ":{line}: column {column}: found `{found}`, expected {expected}; correct the cell or import \
                 the recording again"
            );
            FilesError::refuse(file, problem)
        };
        let first = cells.next().unwrap_or_default();
        let time =
            parse_finite(first).ok_or_else(|| refuse(names[0], first, "a finite number of seconds"))?;
        if self.times_s.last().is_some_and(|&last| time <= last) {
            return Err(refuse(names[0], first, "a time after that of the row above"));
        }
        for ((cell, name), column) in cells.zip(&names[1..]).zip(&mut self.columns) {
            let value = parse_finite(cell);
            if value.is_none() && !cell.is_empty() {
                return Err(refuse(name, cell, "a finite number or an empty cell"));
            }
            column.push(value);
        }
        self.times_s.push(time);
        Ok(())
    }

    /// Whether the times of the rows do not fit any uniform grid.
    pub(super) fn is_uneven(&self) -> bool {
        let seed_s = clock::median_step_s(&self.times_s).unwrap_or_default();
        clock::number_frames(&self.times_s, seed_s).is_some_and(|fit| !fit.is_on_grid())
    }

    /// The times of the rows, s, and their traces.
    pub(super) fn keep_times(self) -> (Vec<f64>, Traces) {
        (self.times_s, Traces::from_columns(self.columns.into_iter(), self.confidences))
    }

    /// The traces on the grid of the rate with the fewest digits that explains the times.
    pub(super) fn place_at_fitted_rate(self, file: &str) -> Result<(FrameGrid, Traces), FilesError> {
        let fit = self.number_rows(file, clock::median_step_s(&self.times_s).unwrap_or_default())?;
        let frame_rate_hz = simplest_frame_rate_hz(&self.times_s, &fit);
        Ok(self.place_on_grid(&fit, frame_rate_hz))
    }

    /// The traces on the grid of a known rate, 1/s.
    pub(super) fn place_at_rate(self, file: &str, rate_hz: f64) -> Result<(FrameGrid, Traces), FilesError> {
        let fit = self.number_rows(file, 1.0 / rate_hz)?;
        let (row, off_frames) = farthest_off_grid(&self.times_s, &fit.frames, rate_hz);
        if off_frames > clock::OFF_GRID_LIMIT_FRAMES {
            return Err(self.off_grid_error(file, row, off_frames, rate_hz));
        }
        Ok(self.place_on_grid(&fit, rate_hz))
    }

    fn number_rows(&self, file: &str, seed_s: f64) -> Result<FrameFit, FilesError> {
        let fit = clock::number_frames(&self.times_s, seed_s).ok_or_else(|| too_long_error(file))?;
        let (rows, frames) = (self.times_s.len(), frame_count(&fit));
        if !fit.is_on_grid() {
            return Err(self.off_grid_error(file, fit.worst_row, fit.worst_frames, 1.0 / fit.frame_s));
        }
        if frames > FRAMES_WITHOUT_ROWS.0 + (1 + FRAMES_WITHOUT_ROWS.1) * rows {
            let problem = format!(
                ": column time_s: the times span {frames} frames, and only {rows} of them have a row; \
                 expected one continuous recording: correct the times, or the rate in recording.toml"
            );
            return Err(FilesError::refuse(file, problem));
        }
        Ok(fit)
    }

    fn off_grid_error(&self, file: &str, row: usize, off_frames: f64, frame_rate_hz: f64) -> FilesError {
        let line = numbered_rows(self.text).nth(row).map_or(1, |(line, _)| line);
        let problem = format!(
            ":{line}: column time_s: found {} s, {off_frames:.2} frames off the grid of {frame_rate_hz} \
             frames/s, expected at most {} frames; check the rate in recording.toml or import the recording again",
            self.times_s[row],
            clock::OFF_GRID_LIMIT_FRAMES
        );
        FilesError::refuse(file, problem)
    }

    fn place_on_grid(self, fit: &FrameFit, frame_rate_hz: f64) -> (FrameGrid, Traces) {
        let frames = frame_count(fit);
        let spread = self.columns.into_iter().map(|column| {
            if column.len() == frames {
                return column; // every frame has its row
            }
            let mut on_grid = vec![None; frames];
            for (value, &frame) in column.into_iter().zip(&fit.frames) {
                on_grid[frame] = value;
            }
            on_grid
        });
        let traces = Traces::from_columns(spread, self.confidences);
        (FrameGrid { start_s: self.times_s[0], frame_rate_hz, frames }, traces)
    }
}

fn too_long_error(file: &str) -> FilesError {
    let problem = format!(
        ": column time_s: the times span more than {} frames; expected one continuous recording: correct the \
         times or import it again",
        clock::MAX_FRAMES
    );
    FilesError::refuse(file, problem)
}

/// The non-empty rows of numbers with their line numbers, counted from 1.
fn numbered_rows(text: &str) -> impl Iterator<Item = (u64, &str)> {
    let lines = (1..).zip(text.lines()).skip(1);
    lines.filter(|(_, line)| !line.trim().is_empty())
}

fn frame_count(fit: &FrameFit) -> usize {
    fit.frames.last().map_or(0, |last| last + 1)
}

/// Row that is furthest from its frame on a grid that starts at the first row, and the distance, frames.
fn farthest_off_grid(times_s: &[f64], frames: &[usize], frame_rate_hz: f64) -> (usize, f64) {
    let off = times_s.iter().zip(frames).map(|(t, &n)| ((t - times_s[0]) * frame_rate_hz - n as f64).abs());
    off.enumerate().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 0.0))
}

/// The frame rate with the fewest digits that fits the times about as well as the fitted rate.
fn simplest_frame_rate_hz(times_s: &[f64], fit: &FrameFit) -> f64 {
    let fitted = 1.0 / fit.frame_s;
    let allowed = SNAP_FRAMES.max(1.5 * farthest_off_grid(times_s, &fit.frames, fitted).1);
    clock::simplest_rate(fitted, |rate| farthest_off_grid(times_s, &fit.frames, rate).1 <= allowed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn recording(
        grid: FrameGrid,
        columns: [Vec<Option<f64>>; 4],
        confidence: Option<Vec<Option<f64>>>,
    ) -> Recording {
        let [tip_x_m, tip_y_m, head_x_m, head_y_m] = columns;
        let traces = Traces {
            tip_x_m,
            tip_y_m,
            head_x_m,
            head_y_m,
            tip_confidence: None,
            head_confidence: confidence,
        };
        Recording::new("made", grid, traces, true).unwrap()
    }

    #[test]
    fn the_file_is_as_the_contract_says() {
        let grid = FrameGrid { start_s: 0.5, frame_rate_hz: 2000.0, frames: 2 };
        let columns = [
            vec![Some(0.1), None],
            vec![Some(-2e-5), Some(0.0)],
            vec![None, None],
            vec![Some(1.0), Some(0.25)],
        ];
        let text = trace_csv(&recording(grid, columns, None));
        assert_eq!(text, "time_s,tip_x_m,tip_y_m,head_x_m,head_y_m\n0.5,0.1,-2e-5,,1\n0.5005,,0,,0.25\n");
    }

    #[test]
    fn an_absent_row_becomes_a_missing_frame() {
        let text = format!("{HEADER}\n0,1,1,1,1\n0.001,2,2,2,2\n0.003,4,4,4,4\n");
        let (grid, traces) = parse_trace_csv("t.csv", &text).unwrap();
        assert_eq!(grid, FrameGrid { start_s: 0.0, frame_rate_hz: 1000.0, frames: 4 });
        assert_eq!(traces.tip_x_m, [Some(1.0), Some(2.0), None, Some(4.0)]);
    }

    #[test]
    fn refusals_name_the_place() {
        let says =
            |rows: &str| parse_trace_csv("t.csv", &format!("{HEADER}\n{rows}")).unwrap_err().to_string();
        assert!(
            says("0,1,1,1,1\n0.1,x,1,1,1\n")
                .starts_with("t.csv:3: column tip_x_m: found `x`, expected a finite number")
        );
        assert!(
            says("0,1,1,1,1\n0,1,1,1,1\n")
                .starts_with("t.csv:3: column time_s: found `0`, expected a time after")
        );
        assert!(says("0,1,1,1,1\n0.1,1\n").starts_with("t.csv:3:1: found 2 cells, expected 5"));
        assert!(says("0,1,1,1,inf\n").contains("column head_y_m: found `inf`"));
        assert!(
            says(
                &(0..20)
                    .map(|i| format!("{},1,1,1,1\n", if i == 9 { 9.45 } else { f64::from(i) }))
                    .collect::<String>()
            )
            .starts_with("t.csv:11: column time_s: found 9.45 s")
        );
        assert!(
            parse_trace_csv("t.csv", "a,b\n1,2\n")
                .unwrap_err()
                .to_string()
                .starts_with("t.csv:1:1: found the header `a,b`")
        );
        assert!(
            TraceTable::parse("t.csv", &format!("{HEADER}\n0,1,1,1,1\n0.1,1,1,1,1\n"))
                .and_then(|table| table.place_at_rate("t.csv", 15.0))
                .unwrap_err()
                .to_string()
                .contains("off the grid")
        );
    }

    /// The standard library writes the shortest digits too, but more slowly.
    fn number_text(value: f64) -> String {
        if value != 0.0 && !(1e-4..1e16).contains(&value.abs()) {
            format!("{value:e}")
        } else {
            value.to_string()
        }
    }

    fn column(frames: usize) -> impl Strategy<Value = Vec<Option<f64>>> {
        proptest::collection::vec(proptest::option::weighted(0.8, -1e3..1e3_f64), frames)
    }

    #[test]
    fn numbers_at_the_ends_of_plain_digits_are_those_of_the_standard_library() {
        let powers = (-20..22).map(|power| format!("1e{power}").parse::<f64>().unwrap());
        for value in
            powers.flat_map(|p| [p, p.next_down(), p.next_up(), 3.0 * p, -p, 0.1 + p]).chain([0.0, -0.0])
        {
            let mut text = String::new();
            push_number(&mut text, value);
            assert_eq!(text, number_text(value));
        }
    }

    proptest! {
        /// (where two numbers of as many digits lie equally close, the standard library may write the other)
        #[test]
        fn a_number_has_as_few_digits_as_that_of_the_standard_library(value in proptest::num::f64::NORMAL) {
            let mut text = String::new();
            for value in [value, value % 1.0, value % 1e6, value % 1e17] {
                text.clear();
                push_number(&mut text, value);
                prop_assert_eq!(text.parse::<f64>().unwrap().to_bits(), value.to_bits());
                prop_assert_eq!(text.len(), number_text(value).len());
            }
        }

        #[test]
        fn writing_and_reading_is_the_identity(
            (columns, confidence) in (2_usize..40).prop_flat_map(|n| {
                ([column(n), column(n), column(n), column(n)], proptest::option::of(column(n)))
            }),
            rate in 1.0..20_000.0_f64,
            start in -5.0..5.0_f64,
        ) {
            let grid = FrameGrid { start_s: start, frame_rate_hz: rate, frames: columns[0].len() };
            let written = recording(grid, columns, confidence);
            let text = trace_csv(&written);
            let table = TraceTable::parse("t.csv", &text).unwrap();
            let (read_grid, read_traces) = table.place_at_rate("t.csv", rate).unwrap();
            prop_assert_eq!(read_grid, grid);
            prop_assert_eq!(&read_traces, written.traces());
        }

        #[test]
        fn a_plain_rate_is_found_from_the_times(rate in 1_u32..20_000, frames in 3_usize..300) {
            let grid = FrameGrid { start_s: 0.0, frame_rate_hz: f64::from(rate), frames };
            let blank = || vec![None; frames];
            let written = recording(grid, [blank(), blank(), blank(), blank()], None);
            prop_assert_eq!(parse_trace_csv("t.csv", &trace_csv(&written)).unwrap().0, grid);
        }
    }
}
