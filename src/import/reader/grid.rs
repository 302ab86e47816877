//! Puts the tracks of tip and head on one grid of frames.

use super::track_file::{Column, convert_numbers};
use crate::import::error::{ImportError, ImportResult};
use crate::import::options::{CoordinateScale, ImportOptions, TimeColumn};
use crate::import::reader::calibration::ImportCalibration;
use crate::import::reader::rate::is_uneven;
use crate::import::reader::timing::{ClockRows, DeclaredTiming, RowFrames};
use crate::import::reader::track_choice::TrackIndex;
use crate::import::reader::track_file::TrackFile;
use crate::import::reader::{findings, timing};
use crate::import::source::ImportReport;
use crate::recording::FrameGrid;
use crate::recording::channel::tracked_span;
use crate::recording::clock::MAX_FRAMES;
use crate::recording::files::YAxis;

/// The frame grid of the recording, and for every clock of the chosen tracks its frame numbers on this grid.
pub(crate) struct ClockGrid {
    pub(crate) grid: FrameGrid,
    /// The true times of the frames, s, if they lie on no grid.
    pub(crate) times: Option<Vec<f64>>,
    used: Vec<PlacedClock>,
}

struct PlacedClock {
    /// Index of the file that contains the clock.
    file: usize,
    /// Index of the clock among the clocks of its file.
    clock: usize,
    placed: RowFrames,
    /// Number that is added to the frame numbers of the clock, so that 0 is the first frame of the grid.
    shift: i64,
}

impl PlacedClock {
    fn first_frame(&self) -> i64 {
        self.placed.frames.first().map_or(0, |frame| frame + self.shift)
    }

    fn last_frame(&self) -> i64 {
        self.placed.frames.last().map_or(0, |frame| frame + self.shift)
    }
}

impl ClockGrid {
    pub(crate) fn align(
        exports: &[TrackFile],
        chosen: &[Option<TrackIndex>; 2],
        calibration: &ImportCalibration,
        options: &ImportOptions,
    ) -> ImportResult<Self> {
        let mut used = place_clocks(exports, chosen, calibration, options)?;
        let Some(earliest) = used.iter().min_by_key(|clock| clock.first_frame()) else {
            return Err(ImportError::no_source());
        };
        let (from, to) =
            (earliest.first_frame(), used.iter().map(PlacedClock::last_frame).max().unwrap_or(0));
        let frames = to - from + 1;
        let rows: usize = used.iter().map(|clock| clock.placed.frames.len()).sum();
        let most = (MAX_FRAMES as i64).min(timing::MOST_SPREAD * rows as i64);
        if frames > most {
            let (file, found) = (exports[earliest.file].file, format!("frames from {from} to {to}"));
            let expected = format!("at most {most} frames for {rows} rows");
            return Err(ImportError::grid_mismatch(file, &found, &expected, "any one recording"));
        }
        let (start_s, frame_rate_hz) = (earliest.placed.start_s, calibration.rate.hz);
        let grid = FrameGrid { start_s, frame_rate_hz, frames: frames as usize };
        used.iter_mut().for_each(|clock| clock.shift -= from);
        let times = shared_times(exports, &used)?;
        Ok(Self { grid, times, used })
    }

    pub(crate) fn report_findings(
        &self,
        exports: &[TrackFile],
        options: &ImportOptions,
        report: &mut ImportReport,
    ) {
        let playback = options.time == Some(TimeColumn::Playback);
        for PlacedClock { file, clock, placed, .. } in &self.used {
            let export = &exports[*file];
            let implied =
                placed.implied_hz.map(|hz| findings::implied_rate_finding(export.file, hz, playback));
            let clock = &export.clocks[*clock];
            let rounded = placed
                .implied_hz
                .filter(|_| !playback)
                .and_then(|hz| findings::rounded_times_finding(export.file, clock, hz));
            let uneven = placed.numbered && !playback && is_uneven(clock);
            let ignored = uneven.then(|| findings::ignored_times_finding(export.file));
            for finding in implied.into_iter().chain(rounded).chain(ignored) {
                // (two clocks of one file often give equal findings; one is enough)
                if !report.findings.contains(&finding) {
                    report.findings.push(finding);
                }
            }
        }
    }
}

/// Determines the frame numbers of every clock that a chosen track uses, and the number to add so that they
/// count like those of the first clock. A clock that both tracks use is returned once.
fn place_clocks(
    exports: &[TrackFile],
    chosen: &[Option<TrackIndex>; 2],
    calibration: &ImportCalibration,
    options: &ImportOptions,
) -> ImportResult<Vec<PlacedClock>> {
    let (rate_hz, tolerance) = (calibration.rate.hz, calibration.tolerance);
    let playback = options.time == Some(TimeColumn::Playback);
    let declared = DeclaredTiming { rate_hz, tolerance, playback, step: options.frame_step.unwrap_or(1) };
    let mut used: Vec<PlacedClock> = vec![];
    for &(file, track) in chosen.iter().flatten() {
        let (export, clock) = (&exports[file], exports[file].tracks[track].clock);
        if used.iter().any(|used| (used.file, used.clock) == (file, clock)) {
            continue;
        }
        let rows = ClockRows { export, clock: &export.clocks[clock] };
        let placed = timing::place_rows(rows, declared)?;
        if let Some(first) = used.iter().find(|used| used.file == file && !playback) {
            timing::refuse_clock_mismatch(rows, [&first.placed, &placed], rate_hz)?;
        }
        let shift = match used.first() {
            Some(first) => {
                timing::frame_offset((&exports[first.file], &first.placed), (export, &placed), rate_hz)?
            }
            None => 0,
        };
        used.push(PlacedClock { file, clock, placed, shift });
    }
    Ok(used)
}

/// The true times of uneven clocks, which must be the same for both points; `None` for clocks on a grid.
fn shared_times(exports: &[TrackFile], used: &[PlacedClock]) -> ImportResult<Option<Vec<f64>>> {
    let [first, others @ ..] = used else { return Ok(None) };
    match others.iter().find(|other| other.placed.times != first.placed.times) {
        Some(other) => {
            let (file, with) = (exports[other.file].file, exports[first.file].file);
            let (found, expected) = ("times with uneven steps", "the same times in every row");
            Err(ImportError::grid_mismatch(file, found, expected, with))
        }
        None => Ok(first.placed.times.clone()),
    }
}

/// Coordinates and confidence of a point for every frame of the grid; `None` where a value is missing.
#[derive(Default)]
pub(crate) struct GridPositions {
    pub(crate) x: Vec<Option<f64>>,
    pub(crate) y: Vec<Option<f64>>,
    pub(crate) confidence: Option<Vec<Option<f64>>>,
}

impl GridPositions {
    /// Moves the columns of a track onto the frame grid. In frames without a row, all values are missing.
    pub(crate) fn from_track(
        exports: &mut [TrackFile],
        clocks: &ClockGrid,
        choice: Option<TrackIndex>,
    ) -> Self {
        let empty = || vec![None; clocks.grid.frames];
        let none = || Self { x: empty(), y: empty(), confidence: None };
        let Some((file, track)) = choice else { return none() };
        let track = &mut exports[file].tracks[track];
        let is_clock = |used: &&PlacedClock| (used.file, used.clock) == (file, track.clock);
        let Some(PlacedClock { placed, shift, .. }) = clocks.used.iter().find(is_clock) else {
            return none();
        };
        let numbered = placed.frames.iter().zip(0..);
        let is_complete = placed.frames.len() == clocks.grid.frames
            && numbered.into_iter().all(|(frame, number)| frame + shift == number);
        let column = |values: Column| {
            if is_complete {
                return values.iter().collect();
            }
            let mut on_grid = empty();
            for (value, frame) in values.iter().zip(&placed.frames) {
                let frame = usize::try_from(frame + shift).ok();
                if let Some(cell) = frame.and_then(|frame| on_grid.get_mut(frame)) {
                    *cell = value;
                }
            }
            on_grid
        };
        let x = column(std::mem::take(&mut track.x));
        Self {
            x,
            y: track.y.take().map_or_else(empty, column),
            confidence: track.confidence.take().map(column),
        }
    }

    /// Removes the positions whose confidence is below `limit`, and reports how many they are.
    pub(crate) fn reject_unlikely(
        &mut self,
        name: &str,
        limit: Option<f64>,
        report: &mut ImportReport,
    ) -> ImportResult<()> {
        let Some(limit) = limit else { return Ok(()) };
        let Some(confidence) = &self.confidence else {
            let expected = format!(
                "a confidence for {name}, which this export has not: leave the option out, or name its column \
                 (--columns ...,tip-confidence=N)"
            );
            return Err(ImportError::option("--min-likelihood", limit, expected));
        };
        let tracked = self.x.iter().flatten().count();
        let mut count = 0;
        for (frame, _) in confidence.iter().enumerate().filter(|(_, c)| c.is_some_and(|c| c < limit)) {
            count += usize::from(self.x[frame].is_some());
            (self.x[frame], self.y[frame]) = (None, None);
        }
        report.findings.push(findings::rejected_finding(name, count, tracked, limit));
        Ok(())
    }

    /// Converts x and y with their scales, and mirrors y if it points down.
    pub(crate) fn convert_to_metres(&mut self, scales: [CoordinateScale; 2], y_axis: YAxis) {
        convert_lengths(&mut self.x, scales[0]);
        convert_lengths(&mut self.y, scales[1]);
        if y_axis == YAxis::Down {
            self.y.iter_mut().flatten().for_each(|y| *y = 0.0 - *y);
        }
    }

    pub(crate) fn tracked_frames(&self) -> Option<(usize, usize)> {
        tracked_span(&self.x)
    }
}

fn convert_lengths(values: &mut [Option<f64>], scale: CoordinateScale) {
    let values = values.iter_mut().flatten();
    match scale {
        CoordinateScale::Unit(metres) => convert_numbers(values, metres),
        CoordinateScale::MetresPerPixel(metres) => values.for_each(|value| *value *= metres),
    }
}
