//! Checks of the frame grid, the exposure, the single columns and the tracker's confidence.

use super::finding::{Check, QualityFinding, Severity};
use super::measurement::{ChannelQuality, FEWEST_CYCLES, MeasuredColumn, Optics, Quality};
use super::noise::FrameGaps;
use crate::camera::exposure_gain;
use crate::recording::{FrameGrid, Traces};

/// Share of missing frames above which a spectrum deserves attention; least-squares spectra on true frame
/// times stay accurate to 40 %, but everything weak is lost much earlier.
const MANY_MISSING: f64 = 0.2;
/// Share of the recording that a single gap may take: a longer one may hold the whole stick phase of a
/// stroke.
const LONG_GAP: f64 = 0.05;
/// Share of an amplitude that the exposure should pass at the highest usable frequency: a loss of a tenth is
/// beyond what a scale is known to.
const EXPOSURE_PASSES: f64 = 0.9;
/// How near a step must be to a whole pixel: scales are given to three digits.
const PIXEL_NEARNESS: f64 = 0.01;
/// Confidence below which a position is doubtful: the default cut-off of DeepLabCut (`pcutoff`).
const LOW_CONFIDENCE: f64 = 0.6;
/// Share of doubtful positions that a spectrum survives: beyond one in a hundred they are more than stray
/// outliers.
const MANY_DOUBTFUL: f64 = 0.01;
/// Share of doubtful positions from which the track is mostly guessed.
const MOST_DOUBTFUL: f64 = 0.5;

/// Rates at which video is played back, 1/s (film, PAL, NTSC and their doubles).
const PLAYBACK_RATES_HZ: [f64; 8] =
    [24_000.0 / 1001.0, 24.0, 25.0, 30_000.0 / 1001.0, 30.0, 50.0, 60_000.0 / 1001.0, 60.0];
/// How near a rate must be to one of them: far enough to catch rounded times, near enough to tell 29.97 from
/// 30.
const PLAYBACK_NEARNESS: f64 = 1e-3;

/// Whether `rate_hz` is a rate of playback, which is what a wrong time column usually holds.
pub(crate) fn is_playback_rate(rate_hz: f64) -> bool {
    PLAYBACK_RATES_HZ.iter().any(|playback| (rate_hz / playback - 1.0).abs() <= PLAYBACK_NEARNESS)
}

/// Frames, rate, length, and the frames without a deflection.
pub(super) fn check_grid(measured: &Quality) -> Vec<QualityFinding> {
    let words = format!(
        "{} frames at {} frames/s, {:.6} s",
        measured.frames, measured.frame_rate_hz, measured.duration_s
    );
    let mut found =
        vec![QualityFinding::new(Check::FrameGrid, Severity::Note, measured.frames as f64, "frames", words)];
    let (low_hz, high_hz) = measured.band_hz();
    if low_hz >= high_hz {
        let words = format!(
            "{} frames hold fewer than {FEWEST_CYCLES} cycles of anything they can show",
            measured.frames
        );
        let advice = "track more frames of the video";
        found.push(
            QualityFinding::new(Check::TooShort, Severity::Serious, measured.frames as f64, "frames", words)
                .with_advice(advice),
        );
    } else {
        let words = format!("shows oscillations from {low_hz:.3} Hz to {high_hz:.0} Hz");
        found.push(QualityFinding::new(Check::Bandwidth, Severity::Note, high_hz, "Hz", words));
    }
    if is_playback_rate(measured.frame_rate_hz) {
        let words =
            format!("{} frames/s is a rate of playback or of an ordinary camera", measured.frame_rate_hz);
        let advice = "check that it is the recording rate, or every frequency is too low by their ratio";
        found.push(
            QualityFinding::new(Check::PlaybackRate, Severity::Serious, measured.frame_rate_hz, "Hz", words)
                .with_advice(advice),
        );
    }
    found.extend(check_deflection_gaps(measured));
    found
}

fn check_deflection_gaps(measured: &Quality) -> Option<QualityFinding> {
    let (missing, frames) = (measured.missing_deflection_frames, measured.frames);
    if missing == frames {
        let words = "in no frame are tip and head both tracked along the sweep".to_owned();
        return Some(
            QualityFinding::new(Check::Gaps, Severity::Serious, missing as f64, "frames", words)
                .with_advice("the single channels may still serve"),
        );
    }
    let gaps = FrameGaps {
        missing,
        runs: measured.gaps,
        longest: measured.longest_gap_frames,
        ..FrameGaps::default()
    };
    Some(gaps_finding(&gaps, frames, measured.longest_gap_at_s?, "no deflection in"))
}

/// How much is missing, in words, graver where it is much.
fn gaps_finding(gaps: &FrameGaps, frames: usize, longest_at_s: f64, what: &str) -> QualityFinding {
    let share = gaps.missing as f64 / frames as f64;
    let FrameGaps { missing, runs, longest, .. } = gaps;
    let words = format!(
        "{what} {missing} frames ({:.1} %) in {runs} gaps, the longest {longest} frames from \
         {longest_at_s:.6} s",
        100.0 * share
    );
    let finding =
        |severity| QualityFinding::new(Check::Gaps, severity, *missing as f64, "frames", words.clone());
    if share > MANY_MISSING {
        finding(Severity::Caution).with_advice(
            "weak components are lost; track the lost frames again if the points are visible there",
        )
    } else if *longest as f64 > LONG_GAP * frames as f64 {
        finding(Severity::Caution)
            .with_advice("choose windows outside the longest gap, or track its frames again")
    } else {
        finding(Severity::Note)
    }
}

/// Missing frames, noise and step of one column; a column that was never tracked is only named.
pub(super) fn check_track_column(
    column: &MeasuredColumn,
    grid: FrameGrid,
    optics: &Optics,
) -> Vec<QualityFinding> {
    let missing = column.quality.missing_frames;
    if missing == grid.frames {
        let words = "not in the recording".to_owned();
        return vec![
            QualityFinding::new(Check::Absent, Severity::Note, missing as f64, "frames", words)
                .on_channel(column.name),
        ];
    }
    let mut found = vec![];
    if missing > 0 {
        let gaps = FrameGaps::count_gaps(column.samples.iter().map(Option::is_some));
        found.push(
            gaps_finding(&gaps, grid.frames, grid.time_s(gaps.longest_from), "not tracked in")
                .on_channel(column.name),
        );
    }
    if let Some(noise) = column.quality.noise_m {
        let pixels = optics
            .metres_per_pixel
            .map_or_else(String::new, |pixel| format!(" ({:.3} pixels)", noise / pixel));
        let words = format!("noise of {:.3} um{pixels}, standard deviation", noise * 1e6);
        found.push(
            QualityFinding::new(Check::Noise, Severity::Note, noise, "m", words).on_channel(column.name),
        );
    }
    found.extend(check_position_step(column.quality, optics).map(|finding| finding.on_channel(column.name)));
    found
}

/// Channels that are written in steps coarser than their noise.
pub(crate) fn check_position_steps(measured: &Quality, optics: &Optics) -> Vec<QualityFinding> {
    let channels = measured.channels().into_iter();
    channels
        .filter_map(|(name, quality)| Some(check_position_step(quality, optics)?.on_channel(name)))
        .collect()
}

/// A step that is coarser than the noise: then the step, not the tracking, limits what can be measured.
fn check_position_step(channel: &ChannelQuality, optics: &Optics) -> Option<QualityFinding> {
    let step_m = channel.step_m.filter(|&step| channel.noise_m.is_some_and(|noise| noise < step))?;
    let whole = optics.metres_per_pixel.filter(|pixel| (step_m / pixel - 1.0).abs() < PIXEL_NEARNESS);
    let kind = if whole.is_some() { " (whole pixels)" } else { "" };
    let words = format!("written in steps of {:.3} um{kind}, coarser than the noise", step_m * 1e6);
    let advice = "export more digits, or track with sub-pixel accuracy";
    Some(QualityFinding::new(Check::PositionStep, Severity::Caution, step_m, "m", words).with_advice(advice))
}

/// What the exposure leaves of an amplitude at the highest usable frequency.
pub(super) fn check_exposure(measured: &Quality) -> Option<QualityFinding> {
    let (_, high_hz) = measured.band_hz();
    let Some(exposure_s) = measured.exposure_s() else {
        let words = "the exposure is not known".to_owned();
        let advice = "give it at import (--exposure-s) so that amplitudes can be corrected for it";
        return Some(
            QualityFinding::new(Check::Exposure, Severity::Note, 0.0, "s", words).with_advice(advice),
        );
    };
    let passes = exposure_gain(high_hz, exposure_s);
    let words = format!("the exposure passes {:.0} % of an amplitude at {high_hz:.0} Hz", 100.0 * passes);
    if passes < EXPOSURE_PASSES {
        let advice = "amplitudes of fast components are too small; expose shorter";
        return Some(
            QualityFinding::new(Check::Exposure, Severity::Caution, passes, "", words).with_advice(advice),
        );
    }
    Some(QualityFinding::new(Check::Exposure, Severity::Note, passes, "", words))
}

/// Positions that the tracker itself doubts.
pub(super) fn check_confidence(traces: &Traces) -> Vec<QualityFinding> {
    let points = [
        ("tip", &traces.tip_confidence, &traces.tip_x_m),
        ("head", &traces.head_confidence, &traces.head_x_m),
    ];
    points
        .into_iter()
        .filter_map(|(name, confidence, x)| {
            Some(low_confidence_finding(confidence.as_deref()?, x)?.on_channel(name))
        })
        .collect()
}

fn low_confidence_finding(confidence: &[Option<f64>], x: &[Option<f64>]) -> Option<QualityFinding> {
    let tracked =
        confidence.iter().zip(x).filter(|(_, x)| x.is_some()).filter_map(|(confidence, _)| *confidence);
    let (low, all) =
        tracked.fold((0_usize, 0_usize), |(low, all), p| (low + usize::from(p < LOW_CONFIDENCE), all + 1));
    if low == 0 {
        return None;
    }
    let share = low as f64 / all as f64;
    let severity = match share {
        share if share > MOST_DOUBTFUL => Severity::Serious,
        share if share > MANY_DOUBTFUL => Severity::Caution,
        _ => Severity::Note,
    };
    let words =
        format!("{low} of {all} positions ({:.1} %) have a confidence below {LOW_CONFIDENCE}", 100.0 * share);
    let advice =
        format!("import again with --min-likelihood {LOW_CONFIDENCE}, so that they count as missing");
    Some(QualityFinding::new(Check::LowConfidence, severity, share, "", words).with_advice(&advice))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_of_playback_are_known() {
        assert!(
            is_playback_rate(29.97)
                && is_playback_rate(60.0)
                && !is_playback_rate(240.0)
                && !is_playback_rate(29.0)
        );
    }
}
