//! What a recording can show: its rates, gaps and noise, measured on the traces themselves.

mod finding;

pub use finding::{Finding, Severity};

use crate::recording::{FrameGrid, Recording};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Median absolute deviation of a normal distribution in units of its standard deviation.
const MAD_OF_NORMAL: f64 = 0.674_489_750_196_081_7;
/// Variance of a third difference of white noise of unit variance: 1 + 9 + 9 + 1 (squares of the binomial weights).
const THIRD_DIFFERENCE_VARIANCE: f64 = 20.0;
/// Fewest third differences for a noise estimate; the median of fewer says little.
const FEWEST_DIFFERENCES: usize = 8;
/// Remainder of two differences, relative to the largest position, that is rounding of decimals and no step.
const ROUNDING: f64 = 1e-10;
/// Most steps that a difference may span: beyond it a whole multiple is a coincidence of many digits.
const MOST_STEPS: f64 = 20_000.0;
/// Frequency, in units of 1/exposure, at which `sinc` has fallen to half power.
const SINC_HALF_POWER: f64 = 0.442_946_47;

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

/// Measures `recording`; `exposure_s` is the exposure of a frame, s, where known.
#[must_use]
pub fn quality(recording: &Recording, exposure_s: Option<f64>) -> Quality {
    let (grid, traces) = (recording.grid(), recording.traces());
    let nyquist_hz = grid.frame_rate_hz / 2.0;
    let together: Vec<bool> = traces.tip_x_m.iter().zip(&traces.head_x_m).map(|(tip, head)| tip.is_some() && head.is_some()).collect();
    let gaps = gaps(&together);
    let longest = gaps.iter().copied().reduce(|a, b| if b.1 > a.1 { b } else { a });
    Quality {
        frames: grid.frames,
        duration_s: grid.duration_s(),
        frame_rate_hz: grid.frame_rate_hz,
        nyquist_hz,
        missing_deflection_frames: together.iter().filter(|&&present| !present).count(),
        gaps: gaps.len(),
        longest_gap_frames: longest.map_or(0, |gap| gap.1),
        longest_gap_at_s: longest.map(|gap| grid.time_s(gap.0)),
        exposure_half_power_hz: exposure_s.map(|exposure| SINC_HALF_POWER / exposure),
        exposure_passes_at_nyquist: exposure_s.map(|exposure| exposure_passes(nyquist_hz, exposure)),
        tip_x: channel(&traces.tip_x_m),
        tip_y: channel(&traces.tip_y_m),
        head_x: channel(&traces.head_x_m),
        head_y: channel(&traces.head_y_m),
    }
}

/// Part of an amplitude at `frequency_hz` that an exposure of `exposure_s` passes: `|sin(pi f T)/(pi f T)|`, the mean of the
/// motion over the open shutter.
#[must_use]
pub fn exposure_passes(frequency_hz: f64, exposure_s: f64) -> f64 {
    let half_turns = PI * frequency_hz * exposure_s;
    if half_turns == 0.0 { 1.0 } else { (half_turns.sin() / half_turns).abs() }
}

/// Standard deviation of white noise on the samples, in their unit: the median absolute third difference of four
/// neighbouring present frames over `0.6745 sqrt(20)`. A third difference removes any motion up to a parabola; what
/// moves faster remains in it, so this is an upper estimate where the signal oscillates within a few frames, and it sees
/// no error that is slow.
#[must_use]
pub fn noise_floor(samples: &[Option<f64>]) -> Option<f64> {
    let third = |w: &[Option<f64>]| match *w {
        [Some(a), Some(b), Some(c), Some(d)] => Some((d - 3.0 * c + 3.0 * b - a).abs()),
        _ => None,
    };
    let mut differences: Vec<f64> = samples.windows(4).filter_map(third).collect();
    if differences.len() < FEWEST_DIFFERENCES {
        return None;
    }
    differences.sort_by(f64::total_cmp);
    let median = differences.get(differences.len() / 2)?;
    Some(median / (MAD_OF_NORMAL * THIRD_DIFFERENCE_VARIANCE.sqrt()))
}

/// The step of which every difference between neighbouring frames is a whole multiple (their greatest common divisor), in
/// the samples' unit; `None` where there is no such step.
#[must_use]
pub fn quantisation_step(samples: &[Option<f64>]) -> Option<f64> {
    let rounding = ROUNDING * samples.iter().flatten().fold(0.0_f64, |most, v| most.max(v.abs()));
    let neighbours = samples.windows(2).filter_map(|w| Some((w[1]? - w[0]?).abs()));
    let moves: Vec<f64> = neighbours.filter(|&d| d > rounding).collect();
    let smallest_step = moves.iter().copied().fold(0.0, f64::max) / MOST_STEPS;
    if moves.len() < FEWEST_DIFFERENCES {
        return None;
    }
    let mut step = *moves.first()?;
    for &distance in &moves {
        step = common_divisor(distance, step, rounding);
        if step < smallest_step {
            return None;
        }
    }
    Some(step)
}

/// Euclid's algorithm, in which a remainder within `rounding` of zero is zero.
fn common_divisor(mut larger: f64, mut smaller: f64, rounding: f64) -> f64 {
    while smaller > rounding {
        let remainder = (larger - (larger / smaller).round() * smaller).abs();
        (larger, smaller) = (smaller, remainder);
    }
    larger
}

fn channel(samples: &[Option<f64>]) -> ChannelQuality {
    let missing_frames = samples.iter().filter(|v| v.is_none()).count();
    ChannelQuality { missing_frames, noise_m: noise_floor(samples), step_m: quantisation_step(samples) }
}

/// First frame and length of every run of absent frames.
fn gaps(present: &[bool]) -> Vec<(usize, usize)> {
    let mut found: Vec<(usize, usize)> = vec![];
    for (frame, _) in present.iter().enumerate().filter(|(_, present)| !**present) {
        match found.last_mut() {
            Some((start, length)) if *start + *length == frame => *length += 1,
            _ => found.push((frame, 1)),
        }
    }
    found
}

/// Cycles of a component that must fit into the recording before its frequency means much.
const CYCLES: f64 = 3.0;
/// Share of the Nyquist frequency up to which a component is well clear of its own alias.
const CLEAR_OF_NYQUIST: f64 = 0.8;
/// Share of missing frames above which a spectrum deserves a second look; least-squares spectra on true frame times stay
/// accurate to 40 %, but everything weak is lost much earlier.
const MANY_MISSING: f64 = 0.2;
/// Times the noise that an oscillation must reach to be seen frame by frame.
const VISIBLE: f64 = 3.0;
/// Share of an amplitude that the exposure should pass at the highest frequency of interest.
const EXPOSURE_LOSS: f64 = 0.5;

impl Quality {
    /// The verdict, one statement a line: first what the recording can show, then what stands in the way.
    #[must_use]
    pub fn verdict(&self) -> Vec<String> {
        if self.missing_deflection_frames == self.frames {
            return vec![
                "not usable for deflection: in no frame are tip and head both tracked along the sweep; the single channels may still serve".to_owned(),
            ];
        }
        let concerns = self.concerns();
        let (low_hz, high_hz) = (CYCLES / self.duration_s, CLEAR_OF_NYQUIST * self.nyquist_hz);
        if low_hz >= high_hz {
            return vec![format!(
                "too short for a spectrum: {} frames at {} frames/s hold fewer than {CYCLES} cycles of anything they can show",
                self.frames, self.frame_rate_hz
            )];
        }
        let grade = if concerns.is_empty() { "good" } else { "usable with care" };
        let mut lines = vec![format!(
            "{grade}: shows oscillations from about {low_hz:.3} Hz ({CYCLES} cycles in the recording) to {high_hz:.0} Hz ({CLEAR_OF_NYQUIST} of the Nyquist frequency)"
        )];
        if let Some(floor) = self.deflection_floor_m() {
            lines.push(format!(
                "a deflection above about {:.3} um stands out from the noise in single frames ({VISIBLE} standard deviations)",
                VISIBLE * floor * 1e6
            ));
        }
        lines.extend(concerns);
        lines
    }

    fn concerns(&self) -> Vec<String> {
        let mut concerns = vec![];
        let share = self.missing_deflection_frames as f64 / self.frames as f64;
        if share > MANY_MISSING {
            concerns.push(format!(
                "{:.0} % of the frames have no deflection: weak components are lost; track the lost frames again if they can be seen",
                100.0 * share
            ));
        }
        if self.low_rate() {
            concerns.push(
                "the rate is that of playback or of an ordinary camera: check that it is the recording rate, or every frequency is too low by their ratio"
                    .to_owned(),
            );
        }
        if let Some(passes) = self.exposure_passes_at_nyquist.filter(|&p| p < EXPOSURE_LOSS) {
            concerns.push(format!(
                "the exposure passes only {:.0} % of an amplitude at the Nyquist frequency: amplitudes of fast components are too small",
                100.0 * passes
            ));
        }
        if let (Some(step), Some(noise)) = (self.tip_x.step_m, self.tip_x.noise_m)
            && noise < step
        {
            concerns.push(format!(
                "the tip is written in steps of {:.3} um, coarser than its noise: export more digits, or track with sub-pixel accuracy",
                step * 1e6
            ));
        }
        concerns
    }

    fn low_rate(&self) -> bool {
        is_playback_rate(self.frame_rate_hz)
    }

    /// Noise of tip and head together, at least what rounding to their steps adds.
    fn deflection_floor_m(&self) -> Option<f64> {
        let variance = |c: &ChannelQuality| Some(c.noise_m?.powi(2).max(c.step_m.unwrap_or(0.0).powi(2) / 12.0));
        Some((variance(&self.tip_x)? + variance(&self.head_x)?).sqrt())
    }
}

/// Rates at which video is played back, 1/s (film, PAL, NTSC and their doubles).
const PLAYBACK_RATES_HZ: [f64; 8] = [24_000.0 / 1001.0, 24.0, 25.0, 30_000.0 / 1001.0, 30.0, 50.0, 60_000.0 / 1001.0, 60.0];
/// How near a rate must be to one of them: far enough to catch rounded times, near enough to tell 29.97 from 30.
const PLAYBACK_NEARNESS: f64 = 1e-3;

/// Whether `rate_hz` is a rate of playback, which is what a wrong time column usually holds.
#[must_use]
pub fn is_playback_rate(rate_hz: f64) -> bool {
    PLAYBACK_RATES_HZ.iter().any(|playback| (rate_hz / playback - 1.0).abs() <= PLAYBACK_NEARNESS)
}

/// The measurements as a table for reading, display units, one fact a line.
#[must_use]
pub fn table(quality: &Quality, start_s: f64) -> String {
    let grid = FrameGrid { start_s, frame_rate_hz: quality.frame_rate_hz, frames: quality.frames };
    let share = 100.0 * quality.missing_deflection_frames as f64 / quality.frames as f64;
    let mut lines = vec![
        format!("frames            {} ({} s to {} s)", quality.frames, start_s, grid.time_s(quality.frames.saturating_sub(1))),
        format!("duration          {:.6} s", quality.duration_s),
        format!("recording rate    {} frames/s (Nyquist {} Hz)", quality.frame_rate_hz, quality.nyquist_hz),
        format!("no deflection     {} frames ({share:.1} %) in {} gaps", quality.missing_deflection_frames, quality.gaps),
    ];
    if let Some(at_s) = quality.longest_gap_at_s {
        lines.push(format!("longest gap       {} frames from {at_s:.6} s", quality.longest_gap_frames));
    }
    if let (Some(half_hz), Some(passes)) = (quality.exposure_half_power_hz, quality.exposure_passes_at_nyquist) {
        lines.push(format!("exposure          passes half the power at {half_hz:.0} Hz, {:.0} % of an amplitude at the Nyquist frequency", 100.0 * passes));
    }
    lines.push(format!("{:<10}{:>10}{:>14}{:>14}", "channel", "missing", "noise (um)", "step (um)"));
    let micro = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |v| format!("{:.4}", v * 1e6));
    let channels = [("tip-x", &quality.tip_x), ("tip-y", &quality.tip_y), ("head-x", &quality.head_x), ("head-y", &quality.head_y)];
    lines.extend(channels.map(|(name, c)| format!("{name:<10}{:>10}{:>14}{:>14}", c.missing_frames, micro(c.noise_m), micro(c.step_m))));
    lines.push("noise: median third difference as white noise, an upper estimate where the motion is fast".to_owned());
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::Traces;

    /// Third differences of (0, 1, 1, 0) repeated have the size 0, 2 or 4 in turn, so their median is known.
    #[test]
    fn the_noise_floor_is_the_median_third_difference_over_its_factor() {
        let samples: Vec<Option<f64>> = (0..40).map(|i| Some(f64::from(i % 2))).collect();
        let expected = 4.0 / (MAD_OF_NORMAL * 20.0_f64.sqrt());
        assert!((noise_floor(&samples).unwrap() - expected).abs() < 1e-12);
    }

    #[test]
    fn a_parabola_has_no_noise_and_a_short_trace_no_estimate() {
        let parabola: Vec<Option<f64>> = (0..40).map(|i| Some(f64::from(i * i))).collect();
        assert_eq!(noise_floor(&parabola), Some(0.0));
        assert_eq!(noise_floor(&parabola[..10]), None);
    }

    #[test]
    fn a_step_is_found_where_there_is_one() {
        let moves = [3, 5, 2, 9, 4, 4, 7, 1, 12, 6, 3, 5];
        let pixels: Vec<Option<f64>> = moves.iter().map(|&i| Some(f64::from(i) * 21.5e-6)).collect();
        assert!((quantisation_step(&pixels).unwrap() - 21.5e-6).abs() < 1e-12);
        let smooth: Vec<Option<f64>> = (0..40).map(|i| Some(f64::from(i).sin())).collect();
        assert_eq!(quantisation_step(&smooth), None);
    }

    #[test]
    fn gaps_are_counted_on_the_deflection() {
        let frames = 12;
        let mut tip = vec![Some(0.0); frames];
        let mut head = tip.clone();
        (tip[2], tip[3], head[4], head[9]) = (None, None, None, None);
        let traces = Traces { tip_x_m: tip, tip_y_m: vec![None; frames], head_x_m: head, head_y_m: vec![None; frames], ..Traces::default() };
        let grid = FrameGrid { start_s: 1.0, frame_rate_hz: 100.0, frames };
        let measured = quality(&Recording::new("made", grid, traces, true).unwrap(), Some(0.005));
        assert_eq!((measured.missing_deflection_frames, measured.gaps, measured.longest_gap_frames), (4, 2, 3));
        assert_eq!(measured.longest_gap_at_s, Some(1.02));
        assert_eq!(measured.tip_y.missing_frames, 12);
        assert!((measured.exposure_passes_at_nyquist.unwrap() - 0.900_316).abs() < 1e-6);
        assert!(measured.verdict()[0].starts_with("usable with care"), "{:?}", measured.verdict());
    }

    #[test]
    fn the_half_power_frequency_passes_half_the_power() {
        assert!((exposure_passes(SINC_HALF_POWER, 1.0).powi(2) - 0.5).abs() < 1e-6);
    }

    #[test]
    fn rates_of_playback_are_known() {
        assert!(is_playback_rate(29.97) && is_playback_rate(60.0) && !is_playback_rate(240.0) && !is_playback_rate(29.0));
    }
}
