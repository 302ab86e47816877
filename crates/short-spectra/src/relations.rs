//! Relations of the frequency of a component: to another component as a multiple, a fraction or a sideband,
//! or to the mains frequency as a multiple.
//!
//! A relation counts if the frequencies agree with it within four standard deviations. Many multiples, or
//! large standard deviations, would match every frequency. Multiples are therefore tried only until the
//! probability of a random match exceeds one in twenty.

use super::classification::RecordContext;
use super::component::{Component, ComponentVerdict, Harmonic, MainsMultiple, Sideband, Subharmonic};
use super::settings::MIN_CYCLES;
use crate::sampling::alias_hz;
use portable_math as math;

/// Highest multiple tried: a signal whose edges last a tenth of its period has no higher multiples.
const MOST_MULTIPLE: usize = 20;
/// Highest multiple tried among those above half the frame rate: the exposure passes little of higher
/// multiples.
const MOST_FOLDED: usize = 8;
/// Highest multiple that is tried whatever the probability of a random match is.
const ALWAYS_TRIED_MULTIPLES: usize = 5;
/// Denominators of the fractions tried: the period of a subharmonic in cycles of the stronger component.
/// Longer periods have never been observed.
const SUBHARMONIC_DENOMINATORS: [usize; 2] = [2, 3];
const MOST_FRACTION: usize = 5;
/// Number of sidebands that are tried on each side of a carrier.
const SIDEBANDS: usize = 2;
/// Number of standard deviations within which a relation counts. Of five thousand records with three true
/// relations, all but one then show all three.
const MATCH_DEVIATIONS: f64 = 4.0;
/// Largest allowed deviation of a frequency from a relation, in resolutions; a wider tolerance would match by
/// chance.
const MATCH_RESOLUTIONS: f64 = 0.5;
/// Probability of a random match up to which more multiples are tried.
const CHANCE_MATCHES: f64 = 0.05;
/// Smallest allowed ratio of the amplitudes, smaller to larger, of two mirror-image sidebands if no component
/// has the modulation frequency.
const SIDEBAND_RATIO: f64 = 0.5;
/// Number of standard deviations within which a frequency counts as a multiple of the mains frequency.
const MAINS_DEVIATIONS: f64 = 3.0;
const MAINS_HZ: [usize; 2] = [50, 60];
/// Highest multiple of the mains frequency that is attributed to a lamp. The flicker of a lamp is strongest
/// at the second multiple.
const MOST_MAINS: usize = 12;
/// Accuracy, Hz, with which a frequency must be known to be compared with multiples of the mains frequency:
/// different multiples of 50 and 60 Hz are at least 10 Hz apart.
const MAINS_WITHIN_HZ: f64 = 0.5;

/// Finds the relations between components; `components` are sorted by falling amplitude.
pub(super) fn find_relations(components: &mut [Component], at: &RecordContext) {
    for k in 0..components.len() {
        let (larger, rest) = components.split_at_mut(k);
        let Some(c) = rest.first_mut() else { continue };
        let amplitude_m = c.amplitude_m;
        // no base is itself a multiple: a multiple of a multiple is related to the base of both
        let own = |base: &&Component| {
            base.harmonic_of.is_none()
                && base.subharmonic_of.is_none()
                && base.sideband_of.is_none()
                && base.amplitude_m > amplitude_m
                && base.frequency_hz >= MIN_CYCLES * at.resolution_hz
        };
        let bases = || larger.iter().filter(own);
        if c.harmonic_of.is_none() {
            c.harmonic_of = bases().find_map(|base| find_harmonic(base, c, at));
        }
        if c.harmonic_of.is_none() {
            c.subharmonic_of = bases().find_map(|base| find_subharmonic(base, c, at));
        }
    }
    for k in 0..components.len() {
        let c = &components[k];
        if c.harmonic_of.is_none() && c.subharmonic_of.is_none() {
            components[k].sideband_of = find_sideband(components, k, at);
        }
    }
    components.iter_mut().for_each(|c| c.mains = find_mains_multiple(c));
}

/// The relations of a component, as text.
pub(super) fn describe_relations(c: &Component) -> [(ComponentVerdict, Option<String>); 4] {
    let multiple = |h: &Harmonic| format!("{} times {:.3} Hz", h.multiple, h.frequency_hz);
    let fraction = |s: &Subharmonic| {
        let beats = if s.denominator == 2 { "second" } else { "third" };
        format!(
            "{}/{} of {:.3} Hz: every {beats} beat differs or is missing",
            s.numerator, s.denominator, s.frequency_hz
        )
    };
    let sideband = |s: &Sideband| {
        let apart_hz = c.frequency_hz - s.frequency_hz;
        let side = if apart_hz < 0.0 { "minus" } else { "plus" };
        let order = (apart_hz.abs() / s.modulation_hz).round();
        let times = if order > 1.0 { format!("{order} times ") } else { String::new() };
        format!("{:.3} Hz {side} {times}{:.3} Hz", s.frequency_hz, s.modulation_hz)
    };
    let mains = |m: &MainsMultiple| {
        format!("{} times {} Hz: a lamp on the mains flickers so", m.multiple, m.frequency_hz)
    };
    [
        (ComponentVerdict::Harmonic, c.harmonic_of.as_ref().map(multiple)),
        (ComponentVerdict::Subharmonic, c.subharmonic_of.as_ref().map(fraction)),
        (ComponentVerdict::Sideband, c.sideband_of.as_ref().map(sideband)),
        (ComponentVerdict::Mains, c.mains.as_ref().map(mains)),
    ]
}

/// Tolerance of a relation, Hz; `sd_hz` is the standard deviation of the difference between the frequency
/// found and the frequency expected.
fn tolerance_hz(sd_hz: f64, at: &RecordContext) -> f64 {
    (MATCH_DEVIATIONS * sd_hz).min(MATCH_RESOLUTIONS * at.resolution_hz)
}

/// Whether `c` has `times` the frequency of `base`, directly or as an alias. Adds the probability of a random
/// match to `chance`.
fn is_multiple(base: &Component, c: &Component, times: f64, at: &RecordContext, chance: &mut f64) -> bool {
    let within_hz = tolerance_hz(math::hypot(c.frequency_sd_hz, times * base.frequency_sd_hz), at);
    *chance += 2.0 * within_hz / base.frequency_hz;
    (alias_hz(times * base.frequency_hz, at.frame_rate_hz) - c.frequency_hz).abs() <= within_hz
}

/// The relation of `other` as a multiple of `base`, directly or as an alias; `None` if there is none.
fn find_harmonic(base: &Component, other: &Component, at: &RecordContext) -> Option<Harmonic> {
    let mut chance = 0.0;
    for multiple in 2..=MOST_MULTIPLE {
        let matches = is_multiple(base, other, multiple as f64, at, &mut chance);
        let folds = multiple as f64 * base.frequency_hz > at.frame_rate_hz / 2.0;
        if multiple > ALWAYS_TRIED_MULTIPLES && chance > CHANCE_MATCHES || folds && multiple > MOST_FOLDED {
            return None;
        }
        if matches {
            return Some(Harmonic { frequency_hz: base.frequency_hz, multiple });
        }
    }
    None
}

/// The relation of `other` as a fraction of `base`; `None` if there is none.
fn find_subharmonic(base: &Component, other: &Component, at: &RecordContext) -> Option<Subharmonic> {
    let mut chance = 0.0;
    for denominator in SUBHARMONIC_DENOMINATORS {
        for numerator in (1..=MOST_FRACTION * denominator).filter(|n| n % denominator != 0) {
            let times = numerator as f64 / denominator as f64;
            let matches = is_multiple(base, other, times, at, &mut chance);
            if chance > CHANCE_MATCHES {
                return None;
            }
            if matches {
                return Some(Subharmonic { frequency_hz: base.frequency_hz, numerator, denominator });
            }
        }
    }
    None
}

/// Component `k` as a sideband of a larger component, the carrier. Either its distance from the carrier is
/// the frequency of another component or twice that frequency, or it has a mirror image of similar amplitude
/// on the other side of the carrier.
fn find_sideband(components: &[Component], k: usize, at: &RecordContext) -> Option<Sideband> {
    let c = &components[k];
    let carriers = components.iter().filter(|carrier| carrier.amplitude_m > c.amplitude_m);
    carriers.into_iter().find_map(|carrier| {
        let apart_hz = (c.frequency_hz - carrier.frequency_hz).abs();
        let others =
            || components.iter().filter(|other| !std::ptr::eq(*other, c) && !std::ptr::eq(*other, carrier));
        let sd_hz = math::hypot(c.frequency_sd_hz, carrier.frequency_sd_hz);
        let modulates = |other: &&Component| {
            other.frequency_hz < carrier.frequency_hz / 2.0
                && (1..=SIDEBANDS).any(|order| {
                    let sd_hz = math::hypot(sd_hz, order as f64 * other.frequency_sd_hz);
                    let off_hz = (order as f64 * other.frequency_hz - apart_hz).abs();
                    off_hz <= tolerance_hz(sd_hz, at) && sd_hz < CHANCE_MATCHES * other.frequency_hz
                })
        };
        let mirrors = |other: &&Component| {
            let pair_sd_hz = math::hypot(c.frequency_sd_hz, other.frequency_sd_hz);
            let sd_hz = math::hypot(pair_sd_hz, 2.0 * carrier.frequency_sd_hz);
            let (less, more) = (c.amplitude_m.min(other.amplitude_m), c.amplitude_m.max(other.amplitude_m));
            (c.frequency_hz + other.frequency_hz - 2.0 * carrier.frequency_hz).abs()
                <= tolerance_hz(sd_hz, at)
                && more < carrier.amplitude_m
                && less > SIDEBAND_RATIO * more
                && apart_hz < carrier.frequency_hz / 2.0
        };
        let by = |modulation_hz: f64| Sideband { frequency_hz: carrier.frequency_hz, modulation_hz };
        let modulation = others().find(modulates).map(|other| by(other.frequency_hz));
        modulation.or_else(|| others().find(mirrors).map(|_| by(apart_hz)))
    })
}

/// The multiple of the mains frequency that agrees with the frequency of a steady component, if there is one.
fn find_mains_multiple(c: &Component) -> Option<MainsMultiple> {
    let within_hz = MAINS_DEVIATIONS * c.frequency_sd_hz;
    if within_hz > MAINS_WITHIN_HZ || c.range_hz.is_some() {
        return None;
    }
    let damping = c.damping_ratio.zip(c.damping_ratio_sd);
    let decays = damping.is_some_and(|(ratio, sd)| ratio.abs() > MAINS_DEVIATIONS * sd);
    let meets = |frequency_hz: usize| {
        let multiple = (c.frequency_hz / frequency_hz as f64).round() as usize;
        let off_hz = (c.frequency_hz - (multiple * frequency_hz) as f64).abs();
        ((1..=MOST_MAINS).contains(&multiple) && off_hz <= within_hz)
            .then_some(MainsMultiple { frequency_hz, multiple })
    };
    if decays { None } else { MAINS_HZ.into_iter().find_map(meets) }
}
