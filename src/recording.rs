//! Recordings: positions of the lip tip and the head in every frame, in SI units, on the frame grid.
//!
//! x runs along the sweep, y points up (`tip_x = v3`, `head_x = v`, `head_y = -u`). A frame in which a point
//! was not tracked holds `None`: nothing is interpolated, and no frame is dropped.

pub mod alignment;
pub mod channel;
pub mod clock;
pub mod cycles;
pub mod files;
mod frame_times;
pub mod motion_traces;
pub mod noise;
pub mod quality;
pub mod video;

use frame_times::FrameTimes;
use portable_math as math;
use serde::Serialize;

/// Uniform grid of frame times: frame `i` was taken at `start_s + i / frame_rate_hz`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FrameGrid {
    /// Time of the first frame, s.
    pub start_s: f64,
    /// Recording rate of the camera, 1/s.
    pub frame_rate_hz: f64,
    /// Number of frames.
    pub frames: usize,
}

impl FrameGrid {
    /// Time of frame `index`, s.
    #[must_use]
    pub fn time_s(&self, index: usize) -> f64 {
        self.start_s + index as f64 / self.frame_rate_hz
    }

    /// Time from the first to the last frame, s.
    pub(crate) fn duration_s(&self) -> f64 {
        self.frames.saturating_sub(1) as f64 / self.frame_rate_hz
    }
}

/// Positions of both points in every frame, m; every column has one entry per frame of the grid.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Traces {
    /// Position of the lip tip along the sweep, `v3`, m.
    pub tip_x_m: Vec<Option<f64>>,
    /// Height of the lip tip, m.
    pub tip_y_m: Vec<Option<f64>>,
    /// Position of the head along the sweep, `v`, m.
    pub head_x_m: Vec<Option<f64>>,
    /// Height of the head, `-u`, m.
    pub head_y_m: Vec<Option<f64>>,
    /// Confidence of the tracker in the tip, 0 to 1, if the source has one.
    pub tip_confidence: Option<Vec<Option<f64>>>,
    /// Confidence of the tracker in the head, 0 to 1, if the source has one.
    pub head_confidence: Option<Vec<Option<f64>>>,
}

/// Why traces do not make a recording, with the column, the frame and the value at fault.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct RecordingError(String);

/// Largest permitted magnitude of a coordinate, m. The positions of a wiper stay below a thousandth of this
/// limit, and the square of the limit is far from overflow.
pub(crate) const LARGEST_M: f64 = 1e6;

/// Traces on their frame grid, with a name for messages. All columns have one entry per frame, and all values
/// are finite.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    name: String,
    grid: FrameGrid,
    /// True times of the frames; `None` if the frames lie on a grid.
    times: Option<FrameTimes>,
    /// Largest distance of the true frame times from a grid at their mean rate, in frames. It is kept when
    /// the tracks are interpolated to this grid; `None` if the frames were taken on a grid.
    departure_frames: Option<f64>,
    frame_rate_sd_hz: Option<f64>,
    traces: Traces,
    synthetic: bool,
}

impl Recording {
    /// Checks the traces and builds the recording; `synthetic` marks a recording that no camera took.
    ///
    /// # Errors
    /// [`RecordingError`] naming the column and the frame at fault.
    pub fn new(
        name: impl Into<String>,
        grid: FrameGrid,
        traces: Traces,
        synthetic: bool,
    ) -> Result<Self, RecordingError> {
        let FrameGrid { start_s, frame_rate_hz, frames } = grid;
        let advice = "give the rate at which the camera recorded, not the playback rate";
        if !(frame_rate_hz.is_finite() && frame_rate_hz > 0.0) {
            let found = format!("frame_rate_hz: found {frame_rate_hz}, expected a finite number above 0");
            return Err(RecordingError(format!("{found}; {advice}")));
        }
        if !start_s.is_finite() {
            let found = format!("start_s: found {start_s}, expected a finite number");
            return Err(RecordingError(format!("{found}; {advice}")));
        }
        if frames < 2 {
            return Err(RecordingError(format!("found {frames} frames, expected at least 2")));
        }
        for (column, values) in traces.columns() {
            check_column(column, values, frames)?;
        }
        let (times, departure_frames, frame_rate_sd_hz) = (None, None, None);
        Ok(Self { name: name.into(), grid, times, departure_frames, frame_rate_sd_hz, traces, synthetic })
    }

    /// The name in messages and figures, usually that of the recording's folder.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The frame grid. If the frames lie on no grid, it has their first time, their mean rate and their
    /// number; [`Self::time_s`] then gives the time of each frame.
    #[must_use]
    pub fn grid(&self) -> FrameGrid {
        self.grid
    }

    /// Time of frame `index`, s. After the last true time, the frames continue at the mean rate.
    #[must_use]
    pub fn time_s(&self, index: usize) -> f64 {
        let Some(times) = self.frame_times_s() else { return self.grid.time_s(index) };
        let after_last = (index + 1).saturating_sub(times.len()) as f64;
        times[index.min(times.len() - 1)] + after_last / self.grid.frame_rate_hz
    }

    /// Index of the first frame at or after a time, s. The index is negative, or above the number of frames,
    /// if the time is at least one frame outside the recording.
    pub(crate) fn frame_at_or_after(&self, time_s: f64) -> f64 {
        let FrameGrid { start_s, frame_rate_hz, frames } = self.grid;
        let on_grid = |from_s: f64| ((time_s - from_s) * frame_rate_hz - ON_FRAME_TOLERANCE).ceil();
        let Some(times) = self.frame_times_s() else { return on_grid(start_s) };
        match times.partition_point(|t| (t - time_s) * frame_rate_hz < -ON_FRAME_TOLERANCE) {
            0 => on_grid(start_s),
            after if after == frames => (frames - 1) as f64 + on_grid(times[frames - 1]),
            inside => inside as f64,
        }
    }

    /// Standard deviation of the frame rate, 1/s; `None` if it is not known and taken as 0.
    #[must_use]
    pub fn frame_rate_sd_hz(&self) -> Option<f64> {
        self.frame_rate_sd_hz
    }

    /// This recording with a standard deviation of its frame rate, 1/s.
    ///
    /// # Errors
    /// [`RecordingError`] unless it is a finite number above 0, or `None`.
    pub fn with_frame_rate_sd(self, frame_rate_sd_hz: Option<f64>) -> Result<Self, RecordingError> {
        let unusable = frame_rate_sd_hz.filter(|sd| !(sd.is_finite() && *sd > 0.0));
        let found = unusable.map(|found| format!("frame_rate_sd_hz: found {found}"));
        let refused = found.map(|found| RecordingError(found + ", expected a finite number above 0"));
        refused.map_or(Ok(Self { frame_rate_sd_hz, ..self }), Err)
    }

    /// This recording with other traces at the same times.
    ///
    /// # Errors
    /// [`RecordingError`] as for [`Self::new`].
    pub fn with_traces(self, traces: Traces) -> Result<Self, RecordingError> {
        let Self { name, grid, traces, .. } = Self::new(self.name, self.grid, traces, self.synthetic)?;
        Ok(Self { name, grid, traces, ..self })
    }

    /// This recording, marked as one that no camera took.
    #[must_use]
    pub(crate) fn mark_synthetic(self) -> Self {
        Self { synthetic: true, ..self }
    }

    /// The traces.
    #[must_use]
    pub fn traces(&self) -> &Traces {
        &self.traces
    }

    /// Whether no camera took the recording: it is a simulation or a twin.
    #[must_use]
    pub fn is_synthetic(&self) -> bool {
        self.synthetic
    }
}

impl Traces {
    /// Every present column with its name in `trace.csv`, in file order.
    pub fn columns(&self) -> impl Iterator<Item = (&'static str, &[Option<f64>])> {
        let always = [
            ("tip_x_m", &self.tip_x_m),
            ("tip_y_m", &self.tip_y_m),
            ("head_x_m", &self.head_x_m),
            ("head_y_m", &self.head_y_m),
        ];
        let optional = [("tip_confidence", &self.tip_confidence), ("head_confidence", &self.head_confidence)];
        let optional = optional.into_iter().filter_map(|(name, column)| column.as_deref().map(|c| (name, c)));
        always.into_iter().map(|(name, column)| (name, column.as_slice())).chain(optional)
    }

    /// Traces from columns in the order of [`Self::columns`]; `confidences` says whether the confidence
    /// columns of the tip and of the head are among them.
    fn from_columns(mut columns: impl Iterator<Item = Vec<Option<f64>>>, confidences: [bool; 2]) -> Self {
        let mut next = || columns.next().unwrap_or_default();
        let (tip_x_m, tip_y_m, head_x_m, head_y_m) = (next(), next(), next(), next());
        let [tip_confidence, head_confidence] = confidences.map(|present| present.then(&mut next));
        Self { tip_x_m, tip_y_m, head_x_m, head_y_m, tip_confidence, head_confidence }
    }
}

fn check_column(column: &str, values: &[Option<f64>], expected: usize) -> Result<(), RecordingError> {
    let cells = values.len();
    if cells != expected {
        let found = format!("column {column}: found {cells} cells, expected {expected}, one a frame");
        return Err(RecordingError(found));
    }
    let unusable = |v: &f64| v.is_nan() || v.abs() > LARGEST_M;
    let first = values.iter().enumerate().find_map(|(frame, v)| Some((frame, v.filter(unusable)?)));
    let Some((frame, found)) = first else { return Ok(()) };
    Err(RecordingError(if found.is_finite() {
        format!(
            "column {column}, frame {frame}: found {found:e}, expected at most {LARGEST_M:e} from the \
             origin; correct the value, or the scale of the import"
        )
    } else {
        format!("column {column}, frame {frame}: found {found}, expected a finite number or an empty cell")
    }))
}

/// Number of frames through which the interpolating polynomial passes. Half way between two frames at 5,000
/// frames/s, interpolation through six frames makes a 900 Hz sine 0.8 % too small; linear interpolation makes
/// it 16 % too small.
pub(crate) const STENCIL: usize = 6;
/// A time counts as the time of a frame if the two differ by less than this number of frames. The rounding
/// errors of times near 1 s at 1e5 frames/s are far smaller.
pub(crate) const ON_FRAME_TOLERANCE: f64 = 1e-6;

impl Recording {
    /// Value of a column of this recording at `time_s`, interpolated by the polynomial through the three
    /// frames before and the three frames after this time. If one of the outer four frames is missing, the
    /// straight line through the two nearest frames is used instead. `None` outside the recording, next to a
    /// missing frame, and in a gap of the times.
    pub(crate) fn interpolate_column(&self, column: &[Option<f64>], time_s: f64) -> Option<f64> {
        if let Some(times) = &self.times {
            return times.interpolate(column, time_s);
        }
        let place = (time_s - self.grid.start_s) * self.grid.frame_rate_hz;
        if let Some(frame) = frame_at(place) {
            return *column.get(frame)?;
        }
        let before = (place >= 0.0).then_some(place.floor() as usize)?;
        let (low, high) = ((*column.get(before)?)?, (*column.get(before + 1)?)?);
        let first = before.checked_sub(STENCIL / 2 - 1);
        let curved = first.and_then(|first| lagrange_through_six(column, first, place));
        Some(curved.unwrap_or(low + (place - before as f64) * (high - low)))
    }
}

/// Index of the frame at `place`, a time in frames after the first frame; `None` between frames. The index
/// may lie past the end of the column.
pub(crate) fn frame_at(place: f64) -> Option<usize> {
    let nearest = place.round();
    (nearest >= 0.0 && (place - nearest).abs() < ON_FRAME_TOLERANCE).then_some(nearest as usize)
}

/// Lagrange polynomial through the six frames from `first` on, evaluated at `place`, a time in frames after
/// the first frame of the column; `None` if a frame is missing.
pub(crate) fn lagrange_through_six(column: &[Option<f64>], first: usize, place: f64) -> Option<f64> {
    const NODES: [f64; STENCIL] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0];
    lagrange_through_nodes(column.get(first..)?, &NODES, place - first as f64)
}

/// Lagrange polynomial through the first six values of `column` at `nodes`, evaluated at `place`; `None` if a
/// value is missing.
fn lagrange_through_nodes(column: &[Option<f64>], nodes: &[f64; STENCIL], place: f64) -> Option<f64> {
    let mut sum = 0.0;
    for (i, value) in column.get(..STENCIL)?.iter().enumerate() {
        let others = || nodes.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, node)| node);
        let weight: f64 = others().map(|node| place - node).product();
        let apart: f64 = others().map(|node| nodes[i] - node).product();
        sum += (*value)? * weight / apart;
    }
    Some(sum)
}

/// Why traces cannot be rotated.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "the {point} has only one of x and y in {frames} frames, the first is frame {first}; expected both or \
     neither, because a rotation mixes them"
)]
pub struct RotationError {
    /// Name of the point, `tip` or `head`.
    pub point: &'static str,
    /// Number of frames with only one coordinate.
    pub frames: usize,
    /// Index of the first such frame.
    pub first: usize,
}

/// Rotates both points clockwise by `angle_rad` about `centre_m` (x and y, m). A line that rises by this
/// angle along x becomes level.
///
/// # Errors
/// [`RotationError`] if a point has only one coordinate in a frame.
pub fn rotate_traces(traces: &Traces, angle_rad: f64, centre_m: [f64; 2]) -> Result<Traces, RotationError> {
    let ((sin, cos), [cx, cy]) = (math::sin_cos(angle_rad), centre_m);
    let turn = |point, x: &[Option<f64>], y: &[Option<f64>]| {
        let mut alone = x.iter().zip(y).enumerate().filter(|(_, (x, y))| x.is_some() != y.is_some());
        if let Some((first, _)) = alone.next() {
            return Err(RotationError { point, frames: 1 + alone.count(), first });
        }
        let places = x.iter().zip(y).map(|(x, y)| {
            let (dx, dy) = (x.as_ref()? - cx, y.as_ref()? - cy);
            Some((cx + cos * dx + sin * dy, cy - sin * dx + cos * dy))
        });
        Ok::<(Vec<_>, Vec<_>), _>(places.map(Option::unzip).unzip())
    };
    let (tip_x_m, tip_y_m) = turn("tip", &traces.tip_x_m, &traces.tip_y_m)?;
    let (head_x_m, head_y_m) = turn("head", &traces.head_x_m, &traces.head_y_m)?;
    Ok(Traces { tip_x_m, tip_y_m, head_x_m, head_y_m, ..traces.clone() })
}

#[cfg(test)]
mod tests {
    use super::{FrameGrid, Traces, *};

    fn recording(start_s: f64, of: impl Fn(f64) -> f64) -> Recording {
        let grid = FrameGrid { start_s, frame_rate_hz: 5000.0, frames: 10 };
        let column = (0..grid.frames).map(|i| Some(of(grid.time_s(i)))).collect();
        let missing = || vec![None; grid.frames];
        let traces = Traces {
            tip_x_m: missing(),
            tip_y_m: missing(),
            head_x_m: column,
            head_y_m: missing(),
            ..Traces::default()
        };
        Recording::new("r", grid, traces, true).unwrap()
    }

    #[test]
    fn a_fast_sine_keeps_its_height_and_a_polynomial_is_exact() {
        let quintic = |t: f64| 1.0 + 3e2 * t - 2e6 * t * t + 4e14 * t.powi(5);
        let at = |recording: &Recording, frames: f64| {
            recording.interpolate_column(&recording.traces().head_x_m, frames / 5000.0).unwrap()
        };
        let curve = recording(0.0, quintic);
        for place in [2.25, 4.5, 6.999] {
            let exact = quintic(place / 5000.0);
            assert!((at(&curve, place) / exact - 1.0).abs() < 1e-13, "{place}");
        }
        // the time is half way between two frames, at the crest of the sine
        let crest = |t: f64| (std::f64::consts::TAU * 900.0 * (t - 4.5 / 5000.0)).cos();
        let sine = recording(0.0, crest);
        assert!((at(&sine, 4.5) - 0.991_64).abs() < 1e-5, "{}", at(&sine, 4.5));
        let mut cut = sine.traces().head_x_m.clone();
        cut[2] = None;
        let straight = sine.interpolate_column(&cut, 4.5 / 5000.0).unwrap();
        assert!((straight - 0.844_33).abs() < 1e-5, "{straight}");
    }

    #[test]
    fn nothing_is_read_beyond_the_frames_or_next_to_a_missing_one() {
        let line = recording(1.0, |t| t);
        let mut column = line.traces().head_x_m.clone();
        column[5] = None;
        let at = |frames: f64| line.interpolate_column(&column, 1.0 + frames / 5000.0);
        assert!(
            (at(2.25).unwrap() - (1.0 + 2.25 / 5000.0)).abs() < 1e-12
                && at(9.0).is_some()
                && at(0.0).is_some()
        );
        assert_eq!([at(-0.3), at(9.2), at(4.5), at(5.0), at(5.5)], [None; 5]);
    }

    #[test]
    fn a_line_that_rises_becomes_level_and_lengths_stay() {
        let (angle_rad, centre_m) = (0.3_f64.to_radians(), [0.04, -0.005]);
        let x: Vec<Option<f64>> = (0..90).map(|i| (i != 7).then_some(1e-3 * f64::from(i))).collect();
        let y = |above: f64| {
            let rise = move |x: f64| centre_m[1] + (x - centre_m[0]) * angle_rad.tan() + above;
            x.iter().map(|x| x.map(rise)).collect::<Vec<_>>()
        };
        let traces = Traces {
            tip_x_m: x.clone(),
            tip_y_m: y(0.0),
            head_x_m: x.clone(),
            head_y_m: y(5e-3),
            ..Traces::default()
        };
        let level = rotate_traces(&traces, angle_rad, centre_m).unwrap();
        assert!(level.tip_y_m.iter().flatten().all(|y| (y - centre_m[1]).abs() < 1e-16));
        assert_eq!((level.tip_x_m[7], level.tip_y_m[7]), (None, None));
        let apart = level.head_x_m[0].unwrap() - level.tip_x_m[0].unwrap();
        assert!((apart - 5e-3 * angle_rad.sin()).abs() < 1e-16, "{apart}");
        let back = rotate_traces(&level, -angle_rad, centre_m).unwrap();
        let same = |a: &[Option<f64>], b: &[Option<f64>]| {
            a.iter().flatten().zip(b.iter().flatten()).all(|(a, b)| (a - b).abs() < 1e-16)
        };
        assert!(same(&back.head_x_m, &traces.head_x_m) && same(&back.head_y_m, &traces.head_y_m));
    }

    #[test]
    fn a_coordinate_alone_is_refused() {
        let traces = Traces {
            tip_x_m: vec![Some(1.0); 3],
            tip_y_m: vec![Some(1.0); 3],
            head_x_m: vec![Some(1.0); 3],
            head_y_m: vec![Some(1.0), None, None],
            ..Traces::default()
        };
        let refused = rotate_traces(&traces, 0.1, [0.0; 2]).unwrap_err();
        assert_eq!(refused, RotationError { point: "head", frames: 2, first: 1 });
    }
}
