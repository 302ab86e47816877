//! Oscillations that may be pieces of another one.

use super::{MUCH_LARGER, OscillationReading};
use crate::time_frequency::FrequencyRange;
use portable_math as math;
use std::f64::consts::TAU;

impl OscillationReading {
    /// Amplitude at the onset, m.
    pub(super) fn amplitude_m(&self) -> f64 {
        math::hypot(self.amplitudes_m[0][0], self.amplitudes_m[0][1])
    }

    /// The doubt that this oscillation is a piece of another one. First case: a much larger one nearby is
    /// united from several, or a stronger one has a polynomial amplitude, which is only an approximation.
    /// Second case: this one drifts, and its range overlaps one that comes from a ridge. `followed` are the
    /// ranges that come from ridges, cycles per record.
    pub(super) fn describe_larger(&self, readings: &[Self], followed: &[FrequencyRange]) -> Option<String> {
        /// Distance, resolutions, from a changing oscillation within which a piece of it may lie.
        const REACH: f64 = 8.0;
        let changes = |other: &Self| {
            let is_united = other.pieces > 1 && other.amplitude_m() > MUCH_LARGER * self.amplitude_m();
            let is_modulated = !other.atom.envelope.is_empty() && other.energy > self.energy;
            (is_united || is_modulated) && (other.cycles - self.cycles).abs() < REACH
        };
        let crosses = |own: &FrequencyRange, other: &FrequencyRange| {
            own.low_hz < other.high_hz && other.low_hz < own.high_hz
        };
        if readings.iter().any(changes) {
            return Some("a larger oscillation nearby changes: it may be a piece of that one".to_owned());
        }
        let own = self.range.filter(|_| !self.has_ridge)?;
        followed.iter().any(|other| crosses(&own, other)).then(|| {
            "it crosses an oscillation followed along a ridge: it may be a piece of that one".to_owned()
        })
    }

    /// One oscillation in place of a group whose first oscillation has most of the energy. The standard
    /// deviations include the spread within the group.
    pub(super) fn unite(group: &[Self]) -> Self {
        let energy: f64 = group.iter().map(|r| r.energy).sum();
        let mean = |of: &dyn Fn(&Self) -> f64| group.iter().map(|r| r.energy * of(r)).sum::<f64>() / energy;
        let cycles = mean(&|r| r.cycles);
        let spread = mean(&|r| math::powi(r.cycles - cycles, 2)).sqrt();
        let strongest = &group[0];
        // the phases of the pieces differ, so their mean squares add up
        let amplitude_m = group.iter().fold(0.0, |sum, r| math::hypot(sum, r.amplitude_m()));
        let larger = amplitude_m / strongest.amplitude_m();
        Self {
            cycles,
            cycles_sd: math::hypot(strongest.cycles_sd, spread),
            own_cycles_sd: math::hypot(strongest.own_cycles_sd, spread),
            nepers_sd: math::hypot(strongest.nepers_sd, TAU * spread),
            amplitudes_m: strongest.amplitudes_m.iter().map(|[a, b]| [a * larger, b * larger]).collect(),
            amplitude_sd_m: math::hypot(strongest.amplitude_sd_m, amplitude_m - strongest.amplitude_m()),
            energy,
            pieces: group.len(),
            snr_db: 10.0 * math::log10((energy / 4.0).max(1e-9)),
            ..strongest.clone()
        }
    }
}
