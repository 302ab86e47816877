//! Checks of the frame grid, the exposure and the single columns.

use super::finding::{Check, QualityFinding, Severity};
use super::measurement::{ChannelQuality, FEWEST_CYCLES, FrameGaps, MeasuredColumn, Optics, Quality};
use crate::recording::clock::is_playback_rate;
use crate::recording::{FrameGrid, Recording};
use short_spectra::sampling::exposure_gain;

/// Fraction of missing frames above which the finding on gaps is a caution. Least-squares spectra with the
/// true frame times stay accurate up to 40 % of missing frames, but weak components are lost much earlier.
const MANY_MISSING: f64 = 0.2;
/// Largest fraction of the recording that a single gap may cover without a caution: a longer gap may hide the
/// whole stick phase of a stroke.
const LONG_GAP: f64 = 0.05;
/// Smallest fraction of an amplitude that the exposure passes at the highest usable frequency without a
/// caution. A loss of a tenth exceeds the uncertainty of the scale.
const EXPOSURE_PASSES: f64 = 0.9;
/// Largest relative difference between a step and a pixel at which the step counts as a whole pixel: scales
/// are given to three digits.
const PIXEL_NEARNESS: f64 = 0.01;

/// Finding on a recording whose tracks were interpolated from true frame times to a grid.
pub(super) fn check_clock(recording: &Recording) -> Option<QualityFinding> {
    let value = (recording.departure_frames?, "frames");
    let advice = "trust amplitudes up to half of the Nyquist frequency; above it the interpolation makes them too small";
    let kind = (Check::UnevenClock, Severity::Caution);
    Some(QualityFinding::advise(kind, value, recording.describe_resampling()?, advice))
}

/// Findings on frames, rate, length, frequency band, and the frames without a deflection.
pub(super) fn check_grid(measured: &Quality) -> Vec<QualityFinding> {
    let Quality { frames, frame_rate_hz: rate_hz, duration_s, .. } = measured;
    let (count, (low_hz, high_hz)) = (*frames as f64, measured.band_hz());
    let found = format!("{frames} frames at {rate_hz} frames/s, {duration_s:.6} s");
    let grid = QualityFinding::advise((Check::FrameGrid, Severity::Note), (count, "frames"), found, "");
    let band = if low_hz >= high_hz {
        let found =
            format!("{frames} frames hold fewer than {FEWEST_CYCLES} cycles of anything they can show");
        let advice = "track more frames of the video";
        QualityFinding::advise((Check::TooShort, Severity::Serious), (count, "frames"), found, advice)
    } else {
        let found = format!("shows oscillations from {low_hz:.3} Hz to {high_hz:.0} Hz");
        QualityFinding::advise((Check::Bandwidth, Severity::Note), (high_hz, "Hz"), found, "")
    };
    let playback = is_playback_rate(*rate_hz).then(|| {
        let found = format!("{rate_hz} frames/s is a rate of playback or of an ordinary camera");
        let advice = "check that it is the recording rate, or every frequency is too low by their ratio";
        QualityFinding::advise((Check::PlaybackRate, Severity::Serious), (*rate_hz, "Hz"), found, advice)
    });
    [grid, band].into_iter().chain(playback).chain(check_deflection_gaps(measured)).collect()
}

fn check_deflection_gaps(measured: &Quality) -> Option<QualityFinding> {
    let (missing, frames) = (measured.missing_deflection_frames, measured.frames);
    if missing == frames {
        let found = "in no frame are tip and head both tracked along the sweep";
        let (kind, value) = ((Check::Gaps, Severity::Serious), (missing as f64, "frames"));
        return Some(QualityFinding::advise(kind, value, found, "the single channels may still serve"));
    }
    let (runs, longest) = (measured.gaps, measured.longest_gap_frames);
    let gaps = FrameGaps { missing, runs, longest, ..FrameGaps::default() };
    Some(gaps_finding(&gaps, frames, measured.longest_gap_at_s?, "no deflection in"))
}

/// Finding on the number and the runs of missing frames; a caution if there are many or if the longest run is
/// long.
fn gaps_finding(gaps: &FrameGaps, frames: usize, longest_at_s: f64, what: &str) -> QualityFinding {
    let share = gaps.missing as f64 / frames as f64;
    let FrameGaps { missing, runs, longest, .. } = gaps;
    let words = format!(
        "{what} {missing} frames ({:.1} %) in {runs} gaps, the longest {longest} frames from \
         {longest_at_s:.6} s",
        100.0 * share
    );
    let (severity, advice) = if share > MANY_MISSING {
        let advice = "weak components are lost; track the lost frames again if the points are visible there";
        (Severity::Caution, advice)
    } else if *longest as f64 > LONG_GAP * frames as f64 {
        (Severity::Caution, "choose windows outside the longest gap, or track its frames again")
    } else {
        (Severity::Note, "")
    };
    QualityFinding::advise((Check::Gaps, severity), (*missing as f64, "frames"), words, advice)
}

/// Findings on missing frames, noise and step of one column; for a column that was never tracked, only that
/// it is absent.
pub(super) fn check_track_column(
    column: &MeasuredColumn,
    grid: FrameGrid,
    optics: &Optics,
) -> Vec<QualityFinding> {
    let missing = column.quality.missing_frames;
    if missing == grid.frames {
        let (kind, value) = ((Check::Absent, Severity::Note), (missing as f64, "frames"));
        return vec![QualityFinding::advise(kind, value, "not in the recording", "").on_channel(column.name)];
    }
    let gaps = (missing > 0).then(|| {
        let gaps = FrameGaps::count_gaps(column.samples.iter().map(Option::is_some));
        gaps_finding(&gaps, grid.frames, grid.time_s(gaps.longest_from), "not tracked in")
    });
    let noise = column.quality.noise_m.map(|noise| {
        let pixels =
            optics.metres_per_pixel.map_or(String::new(), |pixel| format!(" ({:.3} pixels)", noise / pixel));
        let found = format!("noise of {:.3} um{pixels}, standard deviation", noise * 1e6);
        QualityFinding::advise((Check::Noise, Severity::Note), (noise, "m"), found, "")
    });
    let found = [gaps, noise, check_position_step(column.quality, optics)].into_iter().flatten();
    found.map(|finding| finding.on_channel(column.name)).collect()
}

/// Findings on channels that are written in steps coarser than their noise.
pub(crate) fn check_position_steps(measured: &Quality, optics: &Optics) -> Vec<QualityFinding> {
    let check = |(name, quality)| Some(check_position_step(quality, optics)?.on_channel(name));
    measured.channels().into_iter().filter_map(check).collect()
}

/// Finding on positions that are written in steps larger than their noise: the step, not the tracking, then
/// limits the accuracy.
fn check_position_step(channel: &ChannelQuality, optics: &Optics) -> Option<QualityFinding> {
    let step_m = channel.coarse_step_m()?;
    let whole = optics.metres_per_pixel.filter(|pixel| (step_m / pixel - 1.0).abs() < PIXEL_NEARNESS);
    let kind = if whole.is_some() { " (whole pixels)" } else { "" };
    let words = format!("written in steps of {:.3} um{kind}, coarser than the noise", step_m * 1e6);
    let advice = "export more digits, or track with sub-pixel accuracy";
    Some(QualityFinding::advise((Check::PositionStep, Severity::Caution), (step_m, "m"), words, advice))
}

/// Finding on the fraction of an amplitude that the exposure passes at the highest usable frequency.
pub(super) fn check_exposure(measured: &Quality) -> QualityFinding {
    let (_, high_hz) = measured.band_hz();
    let Some(exposure_s) = measured.exposure_s() else {
        let advice = "give it at import (--exposure-s) so that amplitudes can be corrected for it";
        let kind = (Check::Exposure, Severity::Note);
        return QualityFinding::advise(kind, (0.0, "s"), "the exposure is not known", advice);
    };
    let passes = exposure_gain(high_hz, exposure_s);
    let words = format!("the exposure passes {:.0} % of an amplitude at {high_hz:.0} Hz", 100.0 * passes);
    let (severity, advice) = if passes < EXPOSURE_PASSES {
        (Severity::Caution, "amplitudes of fast components are too small; expose shorter")
    } else {
        (Severity::Note, "")
    };
    QualityFinding::advise((Check::Exposure, severity), (passes, ""), words, advice)
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
