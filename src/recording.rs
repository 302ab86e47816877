//! Recordings: where the lip tip and the head were in every frame, in SI units, on the frame grid.
//!
//! x runs along the sweep, y upwards (`tip_x = v3`, `head_x = v`, `head_y = -u`). A frame in which a point
//! was not tracked holds `None`; nothing is interpolated and no frame is closed up.

use serde::Serialize;

pub mod alignment;
pub mod channel;
pub mod clock;
pub mod files;
pub mod film;
pub(crate) mod interpolate;
pub mod level;
pub mod motion_traces;
pub mod noise_model;
pub mod quality;

/// Uniform instants of the frames: frame `i` was taken at `start_s + i / frame_rate_hz`.
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
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.frames.saturating_sub(1) as f64 / self.frame_rate_hz
    }
}

/// Positions of both points in every frame, m; all columns have the length of the grid.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Traces {
    /// Lip tip along the sweep, `v3`, m.
    pub tip_x_m: Vec<Option<f64>>,
    /// Lip tip upwards, m.
    pub tip_y_m: Vec<Option<f64>>,
    /// Head along the sweep, `v`, m.
    pub head_x_m: Vec<Option<f64>>,
    /// Head upwards, `-u`, m.
    pub head_y_m: Vec<Option<f64>>,
    /// The tracker's confidence in the tip, 0 to 1, where the source has one.
    pub tip_confidence: Option<Vec<Option<f64>>>,
    /// The tracker's confidence in the head, 0 to 1, where the source has one.
    pub head_confidence: Option<Vec<Option<f64>>>,
}

/// Why traces do not make a recording.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RecordingError {
    /// The frame rate or the start is not a usable number.
    #[error("{quantity}: found {found}, expected a finite number{}; give the rate at which the camera \
        recorded, not the playback rate", if *.quantity == "frame_rate_hz" { " above 0" } else { "" })]
    Grid {
        /// Which of them.
        quantity: &'static str,
        /// Its value.
        found: f64,
    },
    /// Too few frames to be a recording.
    #[error("found {found} frames, expected at least 2")]
    TooShort {
        /// Number of frames.
        found: usize,
    },
    /// A column is not as long as the grid.
    #[error("column {column}: found {found} cells, expected {expected}, one a frame")]
    Length {
        /// Name of the column.
        column: &'static str,
        /// Its length.
        found: usize,
        /// Number of frames.
        expected: usize,
    },
    /// A position is infinite or not a number; a missing one is `None`.
    #[error("column {column}, frame {frame}: found {found}, expected a finite number or an empty cell")]
    NotFinite {
        /// Name of the column.
        column: &'static str,
        /// 0-based frame.
        frame: usize,
        /// The value.
        found: f64,
    },
    /// A position is beyond [`LARGEST_M`].
    #[error(
        "column {column}, frame {frame}: found {found:e}, expected at most {LARGEST_M:e} from the origin; \
         correct the value, or the scale of the import"
    )]
    TooFar {
        /// Name of the column.
        column: &'static str,
        /// 0-based frame.
        frame: usize,
        /// The value, m.
        found: f64,
    },
}

/// Largest distance from the origin, m: no wiper's recording reaches a thousandth of it, and squares of it
/// are far from overflow.
pub const LARGEST_M: f64 = 1e6;

/// Traces on their frame grid, with a name for messages; its invariants (equal lengths, finite values) hold
/// by construction.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    name: String,
    grid: FrameGrid,
    traces: Traces,
    synthetic: bool,
}

impl Recording {
    /// Checks the invariants and builds the recording; `synthetic` marks one that no camera took.
    ///
    /// # Errors
    /// [`RecordingError`] naming the column and the frame at fault.
    pub fn new(
        name: impl Into<String>,
        grid: FrameGrid,
        traces: Traces,
        synthetic: bool,
    ) -> Result<Self, RecordingError> {
        if !(grid.frame_rate_hz.is_finite() && grid.frame_rate_hz > 0.0) {
            return Err(RecordingError::Grid { quantity: "frame_rate_hz", found: grid.frame_rate_hz });
        }
        if !grid.start_s.is_finite() {
            return Err(RecordingError::Grid { quantity: "start_s", found: grid.start_s });
        }
        if grid.frames < 2 {
            return Err(RecordingError::TooShort { found: grid.frames });
        }
        for (column, values) in traces.columns() {
            check_column(column, values, grid.frames)?;
        }
        Ok(Self { name: name.into(), grid, traces, synthetic })
    }

    /// The name used in messages and figures, usually that of its folder.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The frame grid.
    #[must_use]
    pub fn grid(&self) -> FrameGrid {
        self.grid
    }

    /// The traces.
    #[must_use]
    pub fn traces(&self) -> &Traces {
        &self.traces
    }

    /// Whether no camera took it: a simulation or a twin.
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
}

fn check_column(column: &'static str, values: &[Option<f64>], expected: usize) -> Result<(), RecordingError> {
    if values.len() != expected {
        return Err(RecordingError::Length { column, found: values.len(), expected });
    }
    let unusable = |v: &f64| v.is_nan() || v.abs() > LARGEST_M;
    match values.iter().enumerate().find_map(|(frame, v)| v.filter(unusable).map(|found| (frame, found))) {
        Some((frame, found)) if found.is_finite() => Err(RecordingError::TooFar { column, frame, found }),
        Some((frame, found)) => Err(RecordingError::NotFinite { column, frame, found }),
        None => Ok(()),
    }
}
