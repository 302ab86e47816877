//! What a recording can show: its rates, gaps and noise, measured on the traces themselves, and what looks
//! wrong with it.
//!
//! [`quality`] measures, [`findings`] judges (each finding with a severity, a number and advice), [`verdict`]
//! puts both into lines for reading, and [`Quality::shows`] answers for a single frequency.

mod checks;
mod finding;
mod measure;
mod motion;
mod outliers;
mod prefilter;
mod showing;
mod summary;

pub use checks::is_playback_rate;
pub use finding::{Finding, Severity};
pub use measure::{noise_floor, quantisation_step};
pub use outliers::outlier_frames;
pub use prefilter::cutoff_hz;
pub use showing::{PUBLISHED_COMPONENTS_HZ, PUBLISHED_TITLE, Showing, Visibility};
pub use summary::{Grade, grade, table, verdict};

use crate::camera::{exposure_passes, half_power_hz};
use crate::recording::channel::Instants;
use crate::recording::files::CameraEntry;
use crate::recording::{Recording, Traces};
use measure::Gaps;
use serde::{Deserialize, Serialize};

/// Cycles of a component that must fit into the recording before its frequency means much.
const CYCLES: f64 = 3.0;
/// Share of the Nyquist frequency up to which a component is well clear of its own alias.
const CLEAR_OF_NYQUIST: f64 = 0.8;

/// A recording as measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Quality {
    /// Frames of the grid, missing ones included.
    pub frames: usize,
    /// From the first to the last frame, s.
    pub duration_s: f64,
    /// Recording rate, 1/s.
    pub frame_rate_hz: f64,
    /// Half the recording rate: what is faster appears at a wrong, lower frequency.
    pub nyquist_hz: f64,
    /// Frames in which tip and head do not both have an x, so that there is no deflection.
    pub missing_deflection_frames: usize,
    /// Runs of such frames between or beside others.
    pub gaps: usize,
    /// Length of the longest of them, frames.
    pub longest_gap_frames: usize,
    /// Where it starts, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub longest_gap_at_s: Option<f64>,
    /// Frequency of which the exposure passes half the power, where the exposure is known, Hz.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exposure_half_power_hz: Option<f64>,
    /// Part of an amplitude at the Nyquist frequency that the exposure passes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exposure_passes_at_nyquist: Option<f64>,
    /// Lip tip along the sweep.
    pub tip_x: ChannelQuality,
    /// Lip tip upwards.
    pub tip_y: ChannelQuality,
    /// Head along the sweep.
    pub head_x: ChannelQuality,
    /// Head upwards.
    pub head_y: ChannelQuality,
}

/// One column as measured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChannelQuality {
    /// Frames without a value.
    pub missing_frames: usize,
    /// Standard deviation of the noise, m: see [`noise_floor`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_m: Option<f64>,
    /// Step in which the values are written, m, where they are.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_m: Option<f64>,
}

/// What is known of the camera beyond its rate; nothing where a trace lies there alone.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Optics {
    /// Exposure of a frame, s.
    pub exposure_s: Option<f64>,
    /// Length that a pixel shows, m.
    pub metres_per_pixel: Option<f64>,
}

impl From<&CameraEntry> for Optics {
    fn from(camera: &CameraEntry) -> Self {
        Self { exposure_s: camera.exposure_s, metres_per_pixel: camera.metres_per_pixel }
    }
}

/// Measures `recording`; `exposure_s` is the exposure of a frame, s, where known.
#[must_use]
pub fn quality(recording: &Recording, exposure_s: Option<f64>) -> Quality {
    let (grid, traces) = (recording.grid(), recording.traces());
    let nyquist_hz = grid.frame_rate_hz / 2.0;
    let gaps = Gaps::of(
        traces.tip_x_m.iter().zip(&traces.head_x_m).map(|(tip, head)| tip.is_some() && head.is_some()),
    );
    Quality {
        frames: grid.frames,
        duration_s: grid.duration_s(),
        frame_rate_hz: grid.frame_rate_hz,
        nyquist_hz,
        missing_deflection_frames: gaps.missing,
        gaps: gaps.runs,
        longest_gap_frames: gaps.longest,
        longest_gap_at_s: (gaps.longest > 0).then(|| grid.time_s(gaps.longest_from)),
        exposure_half_power_hz: exposure_s.map(half_power_hz),
        exposure_passes_at_nyquist: exposure_s.map(|exposure| exposure_passes(nyquist_hz, exposure)),
        tip_x: channel(&traces.tip_x_m),
        tip_y: channel(&traces.tip_y_m),
        head_x: channel(&traces.head_x_m),
        head_y: channel(&traces.head_y_m),
    }
}

fn channel(samples: &[Option<f64>]) -> ChannelQuality {
    let missing_frames = samples.iter().filter(|v| v.is_none()).count();
    ChannelQuality { missing_frames, noise_m: noise_floor(samples), step_m: quantisation_step(samples) }
}

impl Quality {
    /// Lowest and highest frequency that the recording shows well, Hz: three cycles in it, and 0.8 of the
    /// Nyquist frequency. Where the first is not below the second, it is too short for a spectrum.
    #[must_use]
    pub fn band_hz(&self) -> (f64, f64) {
        (CYCLES / self.duration_s, CLEAR_OF_NYQUIST * self.nyquist_hz)
    }

    /// The single columns with their names.
    fn channels(&self) -> [(&'static str, &ChannelQuality); 4] {
        [("tip-x", &self.tip_x), ("tip-y", &self.tip_y), ("head-x", &self.head_x), ("head-y", &self.head_y)]
    }

    /// Noise of tip and head together, m, at least what rounding to their steps adds.
    fn deflection_floor_m(&self) -> Option<f64> {
        let variance =
            |c: &ChannelQuality| Some(c.noise_m?.powi(2).max(c.step_m.unwrap_or(0.0).powi(2) / 12.0));
        Some((variance(&self.tip_x)? + variance(&self.head_x)?).sqrt())
    }
}

/// A column with its name and what was measured on it.
#[derive(Clone, Copy)]
struct Measured<'a> {
    name: &'static str,
    samples: &'a [Option<f64>],
    quality: &'a ChannelQuality,
}

fn columns<'a>(traces: &'a Traces, measured: &'a Quality) -> [Measured<'a>; 4] {
    let samples = [&traces.tip_x_m, &traces.tip_y_m, &traces.head_x_m, &traces.head_y_m];
    let mut samples = samples.into_iter();
    measured.channels().map(|(name, quality)| Measured {
        name,
        samples: samples.next().map_or(&[], Vec::as_slice),
        quality,
    })
}

/// Everything that is worth saying of a recording, the gravest first: what its traces show, and what only its
/// export could show (`import`).
///
/// `measured` is the [`quality`] of the same recording, `instants` what [`Instants::find`] finds in it.
#[must_use]
pub fn findings(
    recording: &Recording,
    measured: &Quality,
    optics: &Optics,
    instants: &Instants,
    import: &[Finding],
) -> Vec<Finding> {
    let columns = columns(recording.traces(), measured);
    let mut found = import.to_vec();
    found.extend(checks::of_the_grid(measured));
    found.extend(checks::of_the_exposure(measured));
    found.extend(motion::of_both_points(recording, measured));
    found.extend(motion::of_the_turns(instants));
    for column in &columns {
        found.extend(checks::of_a_column(column, recording.grid(), optics));
        found.extend(outliers::finding(column, recording.grid(), optics));
        found.extend(prefilter::finding(column, measured.frame_rate_hz));
    }
    found.extend(checks::of_the_confidence(recording.traces()));
    // stable: the order above within a severity
    found.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
    found
}
