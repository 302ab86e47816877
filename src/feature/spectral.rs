//! What a band of a window's spectrum shows: the component of a target, the size of the strongest, the power.

use super::missing::{LEAST_CYCLES, MissingValue};
use super::reader::FeatureReader;
use super::value::{FeatureValue, RunnerUpComponent};
use crate::math;
use crate::recording::channel::{Channel, Window};
use crate::spectrum::{Component, Detrend, SpectrumError, SpectrumSettings, WindowedTransform};
use serde::Serialize;
use std::f64::consts::TAU;

/// Distance `ln(f / target)` that weighs as much as [`ASSIGN_DB`]: the model's own peak for a target is
/// within 10 % of it near the best point.
pub const ASSIGN_WIDTH: f64 = 0.1;
/// Level below the strongest component that weighs as much as [`ASSIGN_WIDTH`], dB: half the amplitude.
pub const ASSIGN_DB: f64 = 6.0;

/// An end of the range over which a drifting component runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum CycleRangeEnd {
    /// The lowest frequency.
    Low,
    /// The highest frequency.
    High,
}

/// Frequency of the component that is assigned to a target.
pub(super) fn read_frequency(
    band: &FeatureBand,
    target: Option<f64>,
    reader: &FeatureReader,
) -> Result<FeatureValue, MissingValue> {
    let (low, high) = band.band_hz;
    let found = reader.band_transform(band)?.components(band.band_hz)?;
    let inside: Vec<&Component> = resolvable_components(&found).collect();
    let (chosen, runner_up) = assign_component(&inside, target).ok_or(MissingValue::NoPeak { low, high })?;
    check_amplitude(chosen, band)?;
    let below = |component: &Component| level_below_strongest_db(&inside, component);
    let runner_up = runner_up.map(|c| RunnerUpComponent { frequency_hz: c.frequency_hz, below_db: below(c) });
    Ok(FeatureValue {
        value: chosen.frequency_hz,
        sd: Some(chosen.frequency_sd_hz),
        below_db: below(chosen),
        runner_up,
    })
}

pub(super) fn read_amplitude(
    band: &FeatureBand,
    reader: &FeatureReader,
) -> Result<FeatureValue, MissingValue> {
    let component = strongest_component(band, reader)?;
    check_amplitude(&component, band)?;
    Ok(FeatureValue::new(component.amplitude_m, Some(component.amplitude_sd_m)))
}

pub(super) fn read_rms(band: &FeatureBand, reader: &FeatureReader) -> Result<FeatureValue, MissingValue> {
    read_band_level(band, 0.0, reader)
}

/// Root mean square of a band and of a floor, so that what lies below the floor is not fitted.
pub(super) fn read_band_level(
    band: &FeatureBand,
    floor_m: f64,
    reader: &FeatureReader,
) -> Result<FeatureValue, MissingValue> {
    let (low, high) = band.band_hz;
    let transformed = reader.band_transform(band)?;
    transformed.check_band(band.band_hz)?;
    Ok(FeatureValue::new(math::hypot(transformed.rms_in_band_m(low, high), floor_m), None))
}

/// The lowest or the highest frequency over which the component of a band runs.
pub(super) fn read_cycle_frequency(
    band: &FeatureBand,
    segment_s: f64,
    end: CycleRangeEnd,
    reader: &FeatureReader,
) -> Result<FeatureValue, MissingValue> {
    let segments = reader.cycle_segments(band, segment_s)?;
    let by_frequency = |a: &&(f64, f64), b: &&(f64, f64)| a.0.total_cmp(&b.0);
    let extreme = match end {
        CycleRangeEnd::Low => segments.frequencies.iter().min_by(by_frequency),
        CycleRangeEnd::High => segments.frequencies.iter().max_by(by_frequency),
    };
    let (low, high) = band.band_hz;
    extreme
        .map(|(frequency_hz, sd_hz)| FeatureValue::new(*frequency_hz, Some(*sd_hz)))
        .ok_or(MissingValue::NoPeak { low, high })
}

/// The strongest component of a band.
pub(super) fn strongest_component(
    band: &FeatureBand,
    reader: &FeatureReader,
) -> Result<Component, MissingValue> {
    let (low, high) = band.band_hz;
    let found = reader.band_transform(band)?.components(band.band_hz)?;
    resolvable_components(&found).next().cloned().ok_or(MissingValue::NoPeak { low, high })
}

fn check_amplitude(component: &Component, band: &FeatureBand) -> Result<(), MissingValue> {
    let (amplitude_m, least_m) = (component.amplitude_m, band.least_amplitude_m);
    if amplitude_m < least_m {
        return Err(MissingValue::TooSmall { amplitude_m, frequency_hz: component.frequency_hz, least_m });
    }
    Ok(())
}

/// Strongest first, as they are listed.
fn resolvable_components(found: &[Component]) -> impl Iterator<Item = &Component> {
    found.iter().filter(|c| c.is_resolvable())
}

fn level_below_strongest_db(inside: &[&Component], component: &Component) -> f64 {
    let strongest_m = inside.first().map_or(component.amplitude_m, |c| c.amplitude_m);
    20.0 * math::log10(strongest_m / component.amplitude_m)
}

/// The best and the second best component for a target: those for which `(ln(f / target) / ASSIGN_WIDTH)^2 +
/// (dB below the strongest / ASSIGN_DB)^2` is least. It is a hysteresis without memory: a weaker peak is
/// taken only where it is much nearer.
fn assign_component<'a>(
    inside: &[&'a Component],
    target: Option<f64>,
) -> Option<(&'a Component, Option<&'a Component>)> {
    let rank = |c: &Component| {
        let off = target.map_or(0.0, |target| math::ln(c.frequency_hz / target) / ASSIGN_WIDTH);
        math::powi(off, 2) + math::powi(level_below_strongest_db(inside, c) / ASSIGN_DB, 2)
    };
    let mut ranked: Vec<(f64, &Component)> = inside.iter().map(|c| (rank(c), *c)).collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    Some((ranked.first()?.1, ranked.get(1).map(|(_, second)| *second)))
}

// A band of the spectrum of a window of a channel.

/// A band of the spectrum of a window of a channel.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FeatureBand {
    /// Which channel.
    pub channel: Channel,
    /// Which frames.
    pub window: Window,
    /// Lower and upper end, Hz.
    pub band_hz: (f64, f64),
    /// What is removed before the transform.
    pub detrend: Detrend,
    /// Least amplitude of the strongest component, m: below it there is none. A trace without noise shows
    /// remains of the trend and of a long dead ring-down, which no camera resolves.
    pub least_amplitude_m: f64,
}

// The range over which a stick-slip cycle runs: it drifts with the speed of the tip, so it is followed in
// short segments.
//
// A segment shows the mean frequency of its own time, weighted by its window, so the range reads narrower
// than the drift by what the cycle drifts in half a segment at either end; model and measurement alike.

/// Least share of the largest segment's amplitude that a segment has to hold: below, the cycle has not
/// started or has died down.
pub(crate) const LEAST_SEGMENT_AMPLITUDE: f64 = 0.2;

/// The component of each segment that shows one and holds.
pub(super) struct CycleSegments {
    /// Frequency and its standard deviation, Hz.
    pub frequencies: Vec<(f64, f64)>,
}

impl CycleSegments {
    /// Of the samples of a band's window, in segments that overlap by half or a little more, so that the
    /// first and the last reach the ends of the window.
    pub(super) fn from_samples(
        band: &FeatureBand,
        segment_s: f64,
        samples: &[Option<f64>],
        frame_rate_hz: f64,
    ) -> Result<Self, MissingValue> {
        let frames = (segment_s * frame_rate_hz).round() as usize;
        let starts = segment_starts(samples.len(), frames).ok_or(MissingValue::Segment {
            segment_s,
            frames,
            window: samples.len(),
        })?;
        let mut found = Vec::new();
        for start in starts {
            let segment = samples.get(start..start + frames).unwrap_or_default();
            found.extend(strongest_in_segment(band, segment, frame_rate_hz)?);
        }
        let largest_m = found.iter().fold(0.0, |most: f64, c| most.max(c.amplitude_m));
        let holds = found.into_iter().filter(|c| c.amplitude_m >= LEAST_SEGMENT_AMPLITUDE * largest_m);
        Ok(Self { frequencies: holds.map(|c| (c.frequency_hz, c.frequency_sd_hz)).collect() })
    }
}

/// The strongest component of a segment; `None` where it shows none, or falls into a gap of the recording.
fn strongest_in_segment(
    band: &FeatureBand,
    segment: &[Option<f64>],
    frame_rate_hz: f64,
) -> Result<Option<Component>, SpectrumError> {
    let settings = SpectrumSettings { detrend: Some(band.detrend), ..SpectrumSettings::default() };
    match WindowedTransform::new(segment, frame_rate_hz, &settings) {
        Err(SpectrumError::TooFew { .. }) => Ok(None),
        transformed => Ok(transformed?.components(band.band_hz)?.into_iter().find(Component::is_resolvable)),
    }
}

/// First frames of the segments of a window; `None` where a segment has too few frames or more than the
/// window.
fn segment_starts(window: usize, frames: usize) -> Option<impl Iterator<Item = usize>> {
    if frames < crate::spectrum::MIN_SAMPLES {
        return None;
    }
    let room = window.checked_sub(frames)?;
    let steps = room.div_ceil(frames / 2);
    Some((0..=steps).map(move |k| (k * room).checked_div(steps).unwrap_or(0)))
}

// Damping of a ring-down by its logarithmic decrement between the halves of a window.
//
// In the second half a decaying sinusoid is what it was in the first, `exp(-d T/2)` times as large and
// turned. So the amplitudes that the same Hann window reads in both halves, at any frequency near its
// own, have exactly that ratio: `d = 2 ln(a1 / a2) / T`, and `zeta = d / sqrt(d^2 + (2 pi f)^2)`. What is
// not exact is the rest: the trend that takes a little of the oscillation with it, a neighbour, the noise.
// It takes two sums over the window besides the spectrum that gives the frequency.

/// Least amplitude left in the second half, in deviations of the noise: at 3 it is known to a third, and
/// noise alone seldom shows it.
pub(crate) const LEAST_FINAL_AMPLITUDE: f64 = 3.0;

/// Damping ratio of the strongest component of a band.
pub(super) fn read_damping_ratio(
    band: &FeatureBand,
    reader: &FeatureReader,
) -> Result<FeatureValue, MissingValue> {
    let component = strongest_component(band, reader)?;
    let transformed = reader.band_transform(band)?;
    let frequency_hz = component.frequency_hz;
    let duration_s = transformed.duration_s();
    let cycles = frequency_hz * duration_s / 2.0;
    if cycles < LEAST_CYCLES {
        return Err(MissingValue::FewCycles { frequency_hz, cycles });
    }
    let [first_m, second_m] = transformed.half_amplitudes_m(frequency_hz);
    // a half has half the frames, so twice the power of noise in a bin: as a deviation of an amplitude just
    // the floor of the whole
    let noise_m = component.amplitude_m / math::powf(10.0, component.snr_db / 20.0);
    if second_m < LEAST_FINAL_AMPLITUDE * noise_m {
        return Err(MissingValue::Faded { frequency_hz, second_m });
    }
    if first_m <= second_m {
        return Err(MissingValue::NoDecay { frequency_hz, first_m, second_m });
    }
    let decay_per_s = 2.0 * math::ln(first_m / second_m) / duration_s;
    let decay_sd_per_s = 2.0 * math::hypot(noise_m / first_m, noise_m / second_m) / duration_s;
    let omega = TAU * frequency_hz;
    Ok(FeatureValue::new(decay_per_s / math::hypot(decay_per_s, omega), Some(decay_sd_per_s / omega)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_overlap_by_half_and_reach_both_ends() {
        let of = |window, frames| segment_starts(window, frames).map(Iterator::collect::<Vec<_>>);
        assert_eq!(of(100, 40), Some(vec![0, 20, 40, 60]));
        assert_eq!(of(110, 40), Some(vec![0, 17, 35, 52, 70]));
        assert_eq!(of(40, 40), Some(vec![0]));
        assert_eq!((of(39, 40), of(100, 7)), (None, None));
    }
}
