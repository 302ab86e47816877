//! Where a long record holds something for a short time only: the pieces of it whose spectrum exceeds what is
//! normal for the record.
//!
//! The pieces overlap by half. In each bin a quarter of them is below `-ln(3/4)` times the mean power of
//! noise, whatever the rest holds, so steady lines and noise of any colour are normal, and most of the pieces
//! may hold a flip.

use crate::math;
use crate::spectrum::limits::ROUNDING;
use crate::spectrum::periodogram::Periodogram;
use crate::spectrum::trend::Trend;
use rayon::prelude::*;
use std::ops::Range;

/// Chance that noise alone exceeds what is normal anywhere in a record.
const FALSE_ALARM: f64 = 0.01;
/// Place of the normal power among the pieces' powers in order, and what noise has there over its mean.
const NORMAL_POWER_QUANTILE: usize = 4;
const QUARTER_OF_NOISE: f64 = 0.287_682_072_451_780_9;
/// Half width of the neighbourhood whose noise a bin has at least, bins: a quarter of a few pieces is not
/// well known.
const NEIGHBOURHOOD: usize = 8;
/// Cycles in a piece below which a flip, not an oscillation, exceeds what is normal.
const FEWEST_CYCLES: usize = 8;
/// Half width of the main lobe of a Hann window, bins.
const LOBE: usize = 2;
/// Removed from each piece.
const CUBIC: Trend = Trend::Polynomial(4);

/// A piece of a record, and how its spectrum compares with the other pieces'.
pub(super) struct UnusualSegment {
    pub frames: Range<usize>,
    /// Power over what is normal in each bin, and the level from which it is not.
    excess: Vec<f64>,
    level: f64,
}

impl UnusualSegment {
    /// Whether more than the normal is between two frequencies, in cycles a frame.
    pub(super) fn exceeds_normal_power(&self, low: f64, high: f64) -> bool {
        let bin = |cycles: f64| (cycles * self.frames.len() as f64).round() as usize;
        let around = bin(low).saturating_sub(LOBE)..(bin(high) + LOBE + 1).min(self.excess.len());
        self.excess.get(around).is_some_and(|excess| excess.iter().any(|e| *e > self.level))
    }
}

/// The pieces of a length of which half the frames are there; `band` is in cycles a frame.
pub(super) fn cut_segments(samples: &[Option<f64>], length: usize, band: (f64, f64)) -> Vec<UnusualSegment> {
    let last = samples.len() - length;
    let starts: Vec<usize> = (0..last).step_by(length / 2).chain([last]).collect();
    let piece = |start: &usize| {
        let frames = *start..start + length;
        let piece = &samples[frames.clone()];
        let present = piece.iter().flatten().count();
        (2 * present >= length).then(|| UnusualSegment {
            frames,
            excess: segment_power_spectrum(piece),
            level: 0.0,
        })
    };
    let mut pieces: Vec<UnusualSegment> = starts.par_iter().filter_map(piece).collect();
    let largest = samples.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
    let least = math::powi(ROUNDING * largest, 2).max(f64::MIN_POSITIVE);
    let normal = normal_power_spectrum(&pieces, length / 2 + 1);
    let bin = |cycles: f64| (cycles * length as f64) as usize;
    let inside = FEWEST_CYCLES.max(bin(band.0))..bin(band.1) + 1;
    let trials = (pieces.len() * inside.len()).max(1) as f64;
    for piece in &mut pieces {
        piece.level = math::ln(trials / FALSE_ALARM);
        for (k, (power, normal)) in piece.excess.iter_mut().zip(&normal).enumerate() {
            *power = if inside.contains(&k) { *power / normal.max(least) } else { 0.0 };
        }
    }
    pieces
}

/// Those that exceed the normal most, at most so many, each in bins in which none before it does.
pub(super) fn select_most_unusual(pieces: &[UnusualSegment], most: usize) -> Vec<usize> {
    let mut chosen = Vec::new();
    let mut open = vec![true; pieces.first().map_or(0, |piece| piece.excess.len())];
    while chosen.len() < most {
        let largest = |piece: &UnusualSegment| {
            let bins = piece.excess.iter().zip(&open).filter(|(_, open)| **open);
            bins.fold(0.0, |most: f64, (excess, _)| most.max(*excess))
        };
        let sizes: Vec<f64> = pieces.par_iter().map(largest).collect();
        let best = (0..pieces.len()).max_by(|a, b| sizes[*a].total_cmp(&sizes[*b]).then(b.cmp(a)));
        let Some(best) = best.filter(|best| sizes[*best] > pieces[*best].level) else { break };
        chosen.push(best);
        let UnusualSegment { excess, level, .. } = &pieces[best];
        for k in (0..open.len()).filter(|k| excess[*k] > *level) {
            let end = (k + LOBE + 1).min(open.len());
            open[k.saturating_sub(LOBE)..end].fill(false);
        }
    }
    chosen
}

/// Power in each bin, as the variance of white noise with as much.
fn segment_power_spectrum(samples: &[Option<f64>]) -> Vec<f64> {
    let periodogram = Periodogram::new(samples, samples.len());
    let amplitude_m = periodogram.amplitudes(&CUBIC.residual(samples));
    amplitude_m.into_iter().map(|a| math::powi(periodogram.noise_sd_m(a), 2)).collect()
}

/// The power of the record's noise and steady lines in each bin.
fn normal_power_spectrum(pieces: &[UnusualSegment], bins: usize) -> Vec<f64> {
    let at = |values: &mut [f64], place: usize| *values.select_nth_unstable_by(place, f64::total_cmp).1;
    let of_bin = |bin: usize| {
        let mut powers: Vec<f64> = pieces.iter().map(|piece| piece.excess[bin]).collect();
        let place = powers.len() / NORMAL_POWER_QUANTILE;
        if powers.is_empty() { 0.0 } else { at(&mut powers, place) / QUARTER_OF_NOISE }
    };
    let own: Vec<f64> = (0..bins).into_par_iter().map(of_bin).collect();
    let around = |bin: usize| {
        let mut near = own[bin.saturating_sub(NEIGHBOURHOOD)..(bin + NEIGHBOURHOOD + 1).min(bins)].to_vec();
        let middle = near.len() / 2;
        at(&mut near, middle)
    };
    (0..bins).map(|bin| own[bin].max(around(bin))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    const LENGTH: usize = 512;
    const FRAMES: usize = 20_000;

    /// A steady line in noise, and a tone for 200 frames.
    fn record(seed: u64, burst: f64) -> Vec<Option<f64>> {
        let mut seed = seed;
        let mut draw = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let value = |i: usize| {
            let on = if (7000..7200).contains(&i) { burst } else { 0.0 };
            10.0 * (TAU * 0.1 * i as f64).sin() + on * (TAU * 0.23 * i as f64).sin()
        };
        (0..FRAMES).map(|i| Some(value(i) + draw())).collect()
    }

    #[test]
    fn steady_lines_and_noise_exceed_nothing() {
        let alarms = |seed| {
            let pieces = cut_segments(&record(seed, 0.0), LENGTH, (0.0, 0.5));
            select_most_unusual(&pieces, 4).len()
        };
        assert!((0..40).map(alarms).sum::<usize>() <= 1);
    }

    #[test]
    fn what_is_there_for_a_short_time_is_found_where_it_is() {
        let pieces = cut_segments(&record(1, 1.0), LENGTH, (0.0, 0.5));
        assert_eq!(pieces.len(), FRAMES.div_ceil(LENGTH / 2) - 1);
        assert_eq!(pieces.last().unwrap().frames, FRAMES - LENGTH..FRAMES);
        let [k] = select_most_unusual(&pieces, 4)[..] else {
            panic!("{:?}", select_most_unusual(&pieces, 4))
        };
        let piece = &pieces[k];
        assert!(piece.frames.start < 7100 && piece.frames.end > 7100, "{:?}", piece.frames);
        assert!(piece.exceeds_normal_power(0.23, 0.23) && piece.exceeds_normal_power(0.2, 0.25));
        assert!(!piece.exceeds_normal_power(0.1, 0.1) && !piece.exceeds_normal_power(0.3, 0.4));
        assert!(
            select_most_unusual(&cut_segments(&record(1, 1.0), LENGTH, (0.3, 0.5)), 4).is_empty(),
            "outside the band"
        );
    }

    #[test]
    fn missing_frames_are_no_piece() {
        let mut samples = record(2, 1.0);
        samples[6000..9000].fill(None);
        let pieces = cut_segments(&samples, LENGTH, (0.0, 0.5));
        assert!(pieces.iter().all(|p| p.frames.start > 8700 || p.frames.end < 6300));
        assert!(cut_segments(&vec![None; FRAMES], LENGTH, (0.0, 0.5)).is_empty());
    }
}
