//! Measured properties of a recording: frames, rate, gaps, exposure, and the noise and step of each column.

use crate::recording::noise::{noise_floor, quantisation_step};
use crate::recording::{Recording, Traces};
use portable_math as math;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use short_spectra::sampling::{alias_hz, exposure_gain, half_power_hz};

/// Minimum number of cycles in the recording from which a frequency can be found.
pub(super) const FEWEST_CYCLES: f64 = 3.0;
/// Fraction of the Nyquist frequency up to which a component is well separated from its alias.
pub(super) const NYQUIST_SHARE: f64 = 0.8;
/// Maximum number of positions of a column, evenly spaced in time, from which ranges, medians and value
/// spacings are computed; a stroke is smooth over a thousandth of its duration.
pub(super) const MOST_POSITIONS: usize = 20_000;

/// Measured properties of a recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Quality {
    /// Number of frames of the grid, including missing ones.
    pub frames: usize,
    /// Time from the first to the last frame, s.
    pub duration_s: f64,
    /// Recording rate, 1/s.
    pub frame_rate_hz: f64,
    /// Half the recording rate, or half the rate of the tracked frames if only every n-th frame was tracked.
    /// A faster oscillation appears at a wrong, lower frequency.
    pub nyquist_hz: f64,
    /// Number of frames in which tip and head do not both have an x, so that there is no deflection.
    pub missing_deflection_frames: usize,
    /// Number of runs of consecutive frames without a deflection.
    pub gaps: usize,
    /// Length of the longest of these runs, frames.
    pub longest_gap_frames: usize,
    /// Start of the longest of these runs, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub longest_gap_at_s: Option<f64>,
    /// Frequency at which the exposure passes half the power, Hz, if the exposure is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exposure_half_power_hz: Option<f64>,
    /// Fraction of an amplitude at the Nyquist frequency that the exposure passes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exposure_passes_at_nyquist: Option<f64>,
    /// Position of the lip tip along the sweep.
    pub tip_x: ChannelQuality,
    /// Height of the lip tip.
    pub tip_y: ChannelQuality,
    /// Position of the head along the sweep.
    pub head_x: ChannelQuality,
    /// Height of the head.
    pub head_y: ChannelQuality,
}

/// Measured properties of one column.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChannelQuality {
    /// Number of frames without a value.
    pub missing_frames: usize,
    /// Standard deviation of the noise, m, from the scatter from frame to frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_m: Option<f64>,
    /// Quantisation step of the values, m; absent where they have none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_m: Option<f64>,
}

/// Data of the camera other than its rate; empty for a trace without a `recording.toml`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Optics {
    /// Exposure of a frame, s.
    pub exposure_s: Option<f64>,
    /// Length that a pixel shows, m.
    pub metres_per_pixel: Option<f64>,
}

/// Measures `recording`; `exposure_s` is the exposure of a frame, s, if known.
#[must_use]
pub fn measure_quality(recording: &Recording, exposure_s: Option<f64>) -> Quality {
    let recording = &*recording.resample_to_grid();
    let (grid, traces) = (recording.grid(), recording.traces());
    let both = traces.tip_x_m.iter().zip(&traces.head_x_m);
    let gaps = FrameGaps::count_gaps(both.map(|(tip, head)| tip.is_some() && head.is_some()));
    let nyquist_hz = grid.frame_rate_hz / (2 * gaps.stride.max(1)) as f64;
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
        exposure_passes_at_nyquist: exposure_s.map(|exposure| exposure_gain(nyquist_hz, exposure)),
        tip_x: measure_channel(&traces.tip_x_m),
        tip_y: measure_channel(&traces.tip_y_m),
        head_x: measure_channel(&traces.head_x_m),
        head_y: measure_channel(&traces.head_y_m),
    }
}

fn measure_channel(samples: &[Option<f64>]) -> ChannelQuality {
    let missing_frames = samples.iter().filter(|v| v.is_none()).count();
    ChannelQuality { missing_frames, noise_m: noise_floor(samples), step_m: quantisation_step(samples) }
}

impl ChannelQuality {
    /// The step, m, if it is larger than the noise: rounding is then the larger part of the errors.
    pub(super) fn coarse_step_m(&self) -> Option<f64> {
        self.step_m.filter(|step_m| self.noise_m.is_some_and(|noise_m| noise_m < *step_m))
    }
}

impl Quality {
    /// Lowest and highest frequency that the recording shows well, Hz: three cycles in its duration, and 0.8
    /// of the Nyquist frequency. If the lowest exceeds the highest, the recording is too short for a
    /// spectrum.
    pub(crate) fn band_hz(&self) -> (f64, f64) {
        (FEWEST_CYCLES / self.duration_s, NYQUIST_SHARE * self.nyquist_hz)
    }

    /// Exposure of a frame, s, if known.
    pub(super) fn exposure_s(&self) -> Option<f64> {
        self.exposure_half_power_hz.map(half_power_hz)
    }

    /// The single columns with their names.
    pub(super) fn channels(&self) -> [(&'static str, &ChannelQuality); 4] {
        [("tip-x", &self.tip_x), ("tip-y", &self.tip_y), ("head-x", &self.head_x), ("head-y", &self.head_y)]
    }

    /// Standard deviation of the noise of the deflection, m, from the noise of tip and head. The noise of
    /// each point counts as at least the rounding error of its positions, `step / sqrt(12)`.
    pub(super) fn deflection_floor_m(&self) -> Option<f64> {
        let variance = |c: &ChannelQuality| {
            Some(math::powi(c.noise_m?, 2).max(math::powi(c.step_m.unwrap_or(0.0), 2) / 12.0))
        };
        Some((variance(&self.tip_x)? + variance(&self.head_x)?).sqrt())
    }
}

/// A column with its name and its quality.
#[derive(Clone, Copy)]
pub(super) struct MeasuredColumn<'a> {
    pub name: &'static str,
    pub samples: &'a [Option<f64>],
    pub quality: &'a ChannelQuality,
}

pub(super) fn measured_columns<'a>(traces: &'a Traces, measured: &'a Quality) -> [MeasuredColumn<'a>; 4] {
    let mut columns = traces.columns().map(|(_, samples)| samples);
    measured.channels().map(|(name, quality)| {
        let samples = columns.next().unwrap_or_default();
        MeasuredColumn { name, samples, quality }
    })
}

/// Smallest fraction of an amplitude passed by the exposure at which the amplitude counts as shown in full: a
/// scale is rarely known to better than a tenth.
const NEARLY_ALL: f64 = 0.9;

/// Visibility of a component in a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Visibility {
    /// Frequency and amplitude can be measured.
    Shown,
    /// The frequency can be measured; the exposure makes the amplitude smaller.
    Attenuated,
    /// The frequency is above 0.8 of the Nyquist frequency, close to its own alias.
    NearNyquist,
    /// The frequency is above the Nyquist frequency: the component appears at a wrong, lower frequency.
    Aliased,
    /// The recording contains fewer than three cycles.
    TooFewCycles,
}

/// How a recording shows a spectral component.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ComponentVisibility {
    /// Frequency of the component, Hz.
    pub frequency_hz: f64,
    /// Visibility of the component.
    pub verdict: Visibility,
    /// Frequency at which the component appears, Hz; equal to `frequency_hz` unless the component is aliased.
    pub appears_at_hz: f64,
    /// Number of cycles of the component in the whole recording.
    pub cycles: f64,
    /// Fraction of the component's amplitude that the exposure passes; `None` if the exposure is unknown.
    pub exposure_passes: Option<f64>,
}

impl Quality {
    /// Visibility of a component of `frequency_hz`, a positive number, in the recording.
    #[must_use]
    pub fn component_visibility(&self, frequency_hz: f64) -> ComponentVisibility {
        let cycles = frequency_hz * self.duration_s;
        let exposure_passes = self.exposure_s().map(|exposure| exposure_gain(frequency_hz, exposure));
        let verdict = if frequency_hz > self.nyquist_hz {
            Visibility::Aliased
        } else if cycles < FEWEST_CYCLES {
            Visibility::TooFewCycles
        } else if frequency_hz > NYQUIST_SHARE * self.nyquist_hz {
            Visibility::NearNyquist
        } else if exposure_passes.is_some_and(|part| part < NEARLY_ALL) {
            Visibility::Attenuated
        } else {
            Visibility::Shown
        };
        let appears_at_hz = alias_hz(frequency_hz, self.frame_rate_hz);
        ComponentVisibility { frequency_hz, verdict, appears_at_hz, cycles, exposure_passes }
    }
}

impl ComponentVisibility {
    /// The verdict in words, with its numbers.
    pub(crate) fn describe(&self) -> String {
        let what = match self.verdict {
            Visibility::Shown => "shown".to_owned(),
            Visibility::Attenuated => "attenuated".to_owned(),
            Visibility::NearNyquist => "close to the Nyquist frequency and to its own alias".to_owned(),
            Visibility::Aliased => format!("aliased to {:.1} Hz", self.appears_at_hz),
            Visibility::TooFewCycles => format!("too few cycles for a frequency ({FEWEST_CYCLES} needed)"),
        };
        let of_amplitude = |part| format!("{:.1} % of the amplitude", 100.0 * part);
        let exposure = self.exposure_passes.map_or_else(|| "exposure unknown".to_owned(), of_amplitude);
        format!("{what}: {:.1} cycles, {exposure}", self.cycles)
    }
}

// Missing frames of a column.

/// Numbers and lengths of the runs of consecutive missing frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct FrameGaps {
    pub missing: usize,
    pub runs: usize,
    /// Length of the longest run, frames.
    pub longest: usize,
    pub longest_from: usize,
    /// Greatest common divisor of the distances between present frames: n if every n-th frame was tracked, 0
    /// if fewer than two frames are present.
    pub stride: usize,
}

impl FrameGaps {
    pub(crate) fn count_gaps(present: impl Iterator<Item = bool>) -> Self {
        let (mut gaps, mut run, mut last) = (Self::default(), 0, None);
        for (frame, present) in present.enumerate() {
            if present {
                gaps.stride = match last {
                    // (1 has no other divisor)
                    Some(_) if gaps.stride == 1 => 1,
                    Some(last) => greatest_common_divisor(gaps.stride, frame - last),
                    None => 0,
                };
                last = Some(frame);
            }
            run = if present { 0 } else { run + 1 };
            gaps.missing += usize::from(!present);
            gaps.runs += usize::from(run == 1);
            if run > gaps.longest {
                (gaps.longest, gaps.longest_from) = (run, frame + 1 - run);
            }
        }
        gaps
    }
}

fn greatest_common_divisor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stride_is_what_all_distances_between_frames_present_share() {
        let stride =
            |present: &[usize]| FrameGaps::count_gaps((0..100).map(|frame| present.contains(&frame))).stride;
        assert_eq!([stride(&[]), stride(&[3]), stride(&[3, 4, 90])], [0, 0, 1]);
        assert_eq!([stride(&[1, 38, 75]), stride(&[0, 6, 15, 99]), stride(&[2, 4, 8])], [37, 3, 2]);
    }

    #[test]
    fn gaps_at_both_ends_and_the_first_of_equal_ones_count() {
        let present = [false, true, false, false, true, true, false, false];
        assert_eq!(
            FrameGaps::count_gaps(present.into_iter()),
            FrameGaps { missing: 5, runs: 3, longest: 2, longest_from: 2, stride: 1 }
        );
        assert_eq!(
            FrameGaps::count_gaps([true; 3].into_iter()),
            FrameGaps { stride: 1, ..FrameGaps::default() }
        );
    }
}
