//! Effects of sampling on a motion: the exposure of a frame averages the motion, and frequencies above half
//! the frame rate appear below it.

use portable_math as math;
use std::f64::consts::PI;

/// Frequency at which an exposure passes half the power, in units of 1/exposure: the root of `sinc^2 = 1/2`.
const HALF_POWER_CYCLES: f64 = 0.442_946_47;
/// Maximum number of frequencies listed by [`aliased_frequencies_hz`], so that a mistyped rate does not fill
/// the memory.
pub(crate) const MOST_ALIASES: usize = 1000;

/// Gain of an exposure of `exposure_s` at `frequency_hz`, 0 to 1: `|sin(pi f T)/(pi f T)|`, from the mean of
/// the motion while the shutter is open.
#[must_use]
pub fn exposure_gain(frequency_hz: f64, exposure_s: f64) -> f64 {
    let half_turns = PI * frequency_hz * exposure_s;
    if half_turns == 0.0 { 1.0 } else { (math::sin(half_turns) / half_turns).abs() }
}

/// Frequency, Hz, at which an exposure of `exposure_s` passes half the power. The same function converts that
/// frequency back to the exposure.
pub fn half_power_hz(exposure_s: f64) -> f64 {
    HALF_POWER_CYCLES / exposure_s
}

/// Frequency, Hz, at which an oscillation of `frequency_hz` appears at `frame_rate_hz`: it is folded about
/// the multiples of half the rate.
#[must_use]
pub fn alias_hz(frequency_hz: f64, frame_rate_hz: f64) -> f64 {
    if frequency_hz <= frame_rate_hz / 2.0 {
        return frequency_hz;
    }
    let rest = frequency_hz % frame_rate_hz;
    rest.min(frame_rate_hz - rest)
}

/// Every frequency, Hz, above half of `frame_rate_hz` and up to `up_to_hz` that appears at `frequency_hz`.
/// They are `k * rate - f` and `k * rate + f`, ascending, without duplicates, at most 1000. Empty for a
/// frequency outside 0 to half the rate.
pub(crate) fn aliased_frequencies_hz(frequency_hz: f64, frame_rate_hz: f64, up_to_hz: f64) -> Vec<f64> {
    let half_hz = frame_rate_hz / 2.0;
    if !(half_hz.is_finite() && half_hz > 0.0 && (0.0..=half_hz).contains(&frequency_hz)) {
        return vec![];
    }
    let pair = |k: usize| [k as f64 * frame_rate_hz - frequency_hz, k as f64 * frame_rate_hz + frequency_hz];
    let sources = (1..=MOST_ALIASES).flat_map(pair).take_while(|fold| *fold <= up_to_hz);
    let mut folds: Vec<f64> = sources.filter(|fold| *fold > half_hz).collect();
    folds.dedup(); // at 0 and at half the rate two of them coincide
    folds.truncate(MOST_ALIASES);
    folds
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_half_power_frequency_passes_half_the_power() {
        assert!((exposure_gain(half_power_hz(1e-3), 1e-3).powi(2) - 0.5).abs() < 1e-7);
        assert!((half_power_hz(half_power_hz(1e-3)) - 1e-3).abs() < 1e-18);
    }

    #[test]
    fn an_exposure_passes_the_sinc() {
        assert_eq!(exposure_gain(900.0, 0.0), 1.0);
        assert_eq!(exposure_gain(0.0, 1e-3), 1.0);
        assert!((exposure_gain(500.0, 1e-3) - 2.0 / PI).abs() < 1e-15);
        assert!((exposure_gain(900.0, 1e-3) - 0.109_292_4).abs() < 1e-7);
        assert!(exposure_gain(1000.0, 1e-3) < 1e-15, "a whole cycle averages out");
    }

    #[test]
    fn what_is_faster_than_half_the_rate_appears_below_it() {
        assert_eq!(alias_hz(400.0, 1000.0), 400.0);
        assert_eq!(alias_hz(500.0, 1000.0), 500.0);
        assert_eq!(alias_hz(900.0, 1000.0), 100.0);
        assert_eq!(alias_hz(1100.0, 1000.0), 100.0);
        assert_eq!(alias_hz(900.0, 500.0), 100.0);
        assert_eq!(alias_hz(2000.0, 1000.0), 0.0);
    }

    #[test]
    fn everything_that_folds_onto_a_frequency_is_listed() {
        assert_eq!(aliased_frequencies_hz(100.0, 1000.0, 2100.0), [900.0, 1100.0, 1900.0, 2100.0]);
        assert_eq!(aliased_frequencies_hz(100.0, 1000.0, 2099.0), [900.0, 1100.0, 1900.0]);
        assert!(aliased_frequencies_hz(100.0, 1000.0, 899.0).is_empty());
        assert!(
            aliased_frequencies_hz(78.4, 5000.0, 20_000.0)
                .iter()
                .all(|fold| (alias_hz(*fold, 5000.0) - 78.4).abs() < 1e-9)
        );
    }

    #[test]
    fn folds_that_coincide_are_listed_once() {
        assert_eq!(aliased_frequencies_hz(0.0, 1000.0, 3000.0), [1000.0, 2000.0, 3000.0]);
        assert_eq!(aliased_frequencies_hz(500.0, 1000.0, 3000.0), [1500.0, 2500.0]);
    }

    #[test]
    fn nothing_folds_onto_what_cannot_appear() {
        for (frequency_hz, rate_hz) in [
            (501.0, 1000.0),
            (-1.0, 1000.0),
            (f64::NAN, 1000.0),
            (0.0, 0.0),
            (1.0, f64::INFINITY),
            (1.0, f64::NAN),
        ] {
            assert!(
                aliased_frequencies_hz(frequency_hz, rate_hz, 1e4).is_empty(),
                "{frequency_hz} at {rate_hz}"
            );
        }
        assert_eq!(aliased_frequencies_hz(1e-3, 1e-2, f64::INFINITY).len(), MOST_ALIASES);
    }
}
