//! What a band of a window's spectrum shows: the component of a target, the size of the strongest, the power.

use super::band::FeatureBand;
use super::missing::MissingValue;
use super::reader::FeatureReader;
use super::value::{FeatureValue, RunnerUpComponent};
use crate::math;
use crate::spectrum::Component;
use serde::Serialize;

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
