//! Readings from a band in the spectrum of a window: frequency of the component assigned to a target,
//! amplitude and damping of the strongest component, and root mean square of the band.

use super::missing::{LEAST_CYCLES, MissingValue};
use super::reader::FeatureReader;
use super::value::{FeatureValue, RunnerUpComponent};
use crate::recording::channel::{Channel, Window};
use portable_math as math;
use serde::Serialize;
use short_spectra::{Component, Detrend, SpectrumError, SpectrumSettings, WindowedTransform};
use std::f64::consts::TAU;

/// Scale of the logarithmic distance `ln(f / target)` when a component is assigned to a target: this distance
/// counts as much against a component as being [`ASSIGN_DB`] weaker than the strongest component. Near the
/// best point of a fit, the peak of the model is within 10 % of the target.
pub const ASSIGN_WIDTH: f64 = 0.1;
/// Scale of the level when a component is assigned to a target: being this much weaker than the strongest
/// component, dB, counts as much against a component as a distance of [`ASSIGN_WIDTH`] from the target. At 6
/// dB, the amplitude is half.
pub const ASSIGN_DB: f64 = 6.0;

/// An end of the frequency range of a drifting component.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum CycleRangeEnd {
    /// The lowest frequency.
    Low,
    /// The highest frequency.
    High,
}

/// Frequency of the component that is assigned to a target; without a target, of the strongest component.
pub(super) fn read_frequency(
    band: &FeatureBand,
    target: Option<f64>,
    reader: &FeatureReader,
) -> Result<FeatureValue, MissingValue> {
    let (low, high) = band.band_hz;
    let found = reader.band_transform(band)?.components(band.band_hz)?;
    // as in `found`, the strongest component comes first
    let inside: Vec<&Component> = found.iter().filter(|c| c.is_resolvable()).collect();
    let (chosen, runner_up) = assign_component(&inside, target).ok_or(MissingValue::NoPeak { low, high })?;
    check_amplitude(chosen, band)?;
    let below = |component: &Component| level_below_strongest_db(&inside, component);
    let runner_up = runner_up.map(|c| RunnerUpComponent { frequency_hz: c.frequency_hz, below_db: below(c) });
    let sd_hz = reader.recording.add_clock_sd(chosen.frequency_hz, chosen.frequency_sd_hz);
    let value = FeatureValue::new(chosen.frequency_hz, Some(sd_hz));
    Ok(FeatureValue { below_db: below(chosen), runner_up, ..value })
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

/// Adds the root mean square of a band and a floor in quadrature, so that differences far below the floor
/// have no weight in a fit.
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

/// Lowest or highest of the frequencies that the component of a band has in the segments of a window.
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
    let (frequency_hz, sd_hz) = extreme.ok_or(MissingValue::NoPeak { low, high })?;
    Ok(FeatureValue::new(*frequency_hz, Some(reader.recording.add_clock_sd(*frequency_hz, *sd_hz))))
}

/// The strongest component of a band.
pub(super) fn strongest_component(
    band: &FeatureBand,
    reader: &FeatureReader,
) -> Result<Component, MissingValue> {
    let (low, high) = band.band_hz;
    let found = reader.band_transform(band)?.components(band.band_hz)?;
    found.into_iter().find(Component::is_resolvable).ok_or(MissingValue::NoPeak { low, high })
}

fn check_amplitude(component: &Component, band: &FeatureBand) -> Result<(), MissingValue> {
    let (amplitude_m, least_m) = (component.amplitude_m, band.least_amplitude_m);
    if amplitude_m < least_m {
        return Err(MissingValue::TooSmall { amplitude_m, frequency_hz: component.frequency_hz, least_m });
    }
    Ok(())
}

fn level_below_strongest_db(inside: &[&Component], component: &Component) -> f64 {
    let strongest_m = inside.first().map_or(component.amplitude_m, |c| c.amplitude_m);
    20.0 * math::log10(strongest_m / component.amplitude_m)
}

/// The best and the second-best component for a target: the two components with the smallest `(ln(f / target)
/// / ASSIGN_WIDTH)^2 + (d / ASSIGN_DB)^2`, where `f` is the frequency of a component and `d` its level below
/// the strongest component, dB. A weaker peak is chosen only if it is much nearer to the target.
fn assign_component<'a>(
    inside: &[&'a Component],
    target: Option<f64>,
) -> Option<(&'a Component, Option<&'a Component>)> {
    let rank = |c: &Component| {
        let off = target.map_or(0.0, |target| math::ln(c.frequency_hz / target) / ASSIGN_WIDTH);
        math::powi(off, 2) + math::powi(level_below_strongest_db(inside, c) / ASSIGN_DB, 2)
    };
    let mut ranked: Vec<(f64, &Component)> = inside.iter().map(|c| (rank(c), *c)).collect();
    math::sort_by_number(&mut ranked, |a| a.0);
    Some((ranked.first()?.1, ranked.get(1).map(|(_, second)| *second)))
}

/// A frequency band in the spectrum of a window of a channel.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FeatureBand {
    /// Channel that is transformed.
    pub channel: Channel,
    /// Window of frames.
    pub window: Window,
    /// Lower and upper end of the band, Hz.
    pub band_hz: (f64, f64),
    /// Trend that is removed before the transform.
    pub detrend: Detrend,
    /// Smallest accepted amplitude of the strongest component, m; a band with only weaker components gives no
    /// value. In a trace without noise, remains of the trend and of an earlier ring-down would otherwise
    /// count as components, although no camera resolves them.
    pub least_amplitude_m: f64,
}

// The frequency of a stick-slip cycle drifts with the speed of the tip, so it is measured in short segments.
// The frequency in a segment is the mean over the segment. Each end of the measured range is therefore inside
// the true range, by the drift within half a segment. The shift is the same for model and measurement.

/// Minimum ratio of a component's amplitude in a segment to its largest amplitude in all segments. At a lower
/// ratio, the stick-slip cycle has not started or has decayed.
pub(crate) const LEAST_SEGMENT_AMPLITUDE: f64 = 0.2;

/// The component of a band in every segment in which the amplitude of the component is sufficient.
pub(super) struct CycleSegments {
    /// Frequencies, each with its standard deviation, Hz.
    pub frequencies: Vec<(f64, f64)>,
}

impl CycleSegments {
    /// Measures the component in the samples of a band's window. Segments overlap by at least half. The first
    /// segment begins at the start of the window, and the last ends at its end.
    pub(super) fn from_samples(
        band: &FeatureBand,
        segment_s: f64,
        samples: &[Option<f64>],
        frame_rate_hz: f64,
    ) -> Result<Self, MissingValue> {
        let frames = (segment_s * frame_rate_hz).round() as usize;
        let refused = MissingValue::Segment { segment_s, frames, window: samples.len() };
        let starts = segment_starts(samples.len(), frames).ok_or(refused)?;
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

/// The strongest component of a segment; `None` if there is none or if too few frames are tracked.
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

/// Index of the first frame of each segment of a window, counted from the start of the window; `None` if a
/// segment has too few frames, or more frames than the window.
fn segment_starts(window: usize, frames: usize) -> Option<impl Iterator<Item = usize>> {
    if frames < short_spectra::MIN_SAMPLES {
        return None;
    }
    let room = window.checked_sub(frames)?;
    let steps = room.div_ceil(frames / 2);
    Some((0..=steps).map(move |k| (k * room).checked_div(steps).unwrap_or(0)))
}

// Damping from the logarithmic decrement between the two halves of a window of length T. A decaying sinusoid
// in the second half is `exp(-d T/2)` times that in the first half, with another phase. The amplitudes in the
// two halves have exactly this ratio if both are measured with the same Hann window at the same frequency
// near that of the sinusoid: `d = 2 ln(a1 / a2) / T` and `zeta = d / sqrt(d^2 + (2 pi f)^2)`. Errors come
// from the trend, neighbouring components and noise.

/// Smallest accepted amplitude of a decaying component in the second half of the window, in standard
/// deviations of the noise. At 3 standard deviations, the relative error of the amplitude is a third, and
/// noise without a component seldom reaches that amplitude.
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
    // a half window has twice the noise power in a bin, so that the standard deviation of an amplitude in it
    // equals the noise floor of the whole window
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
