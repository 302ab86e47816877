//! Where a long record holds something for a short time only: the pieces of it whose spectrum exceeds what is
//! normal for the record.
//!
//! The pieces overlap by half. In each bin a quarter of them is below `-ln(3/4)` times the mean power of
//! noise, whatever the rest holds, so steady lines and noise of any colour are normal, and up to half of the
//! pieces may hold a flip.

use crate::math;
use crate::spectrum::limits::ROUNDING;
use crate::spectrum::periodogram::Periodogram;
use crate::spectrum::trend::Trend;
use rayon::prelude::*;
use std::ops::Range;

/// Chance that noise alone exceeds what is normal anywhere in a record.
const FALSE_ALARM: f64 = 0.01;
/// Place of the normal power among the pieces' powers in order, and what noise has there over its mean.
const QUARTER: usize = 4;
const QUARTER_OF_NOISE: f64 = 0.287_682_072_451_780_9;
/// Half width of the neighbourhood whose noise a bin has at least, bins: a quarter of a few pieces is not
/// well known.
const NEIGHBOURHOOD: usize = 8;
/// Cycles in a piece below which a flip, not an oscillation, exceeds what is normal.
const SLOW: usize = 8;
/// Half width of the main lobe of a Hann window, bins.
pub(super) const LOBE: usize = 2;
/// Removed from each piece.
const CUBIC: Trend = Trend::Polynomial(4);

/// A piece of a record, and how its spectrum compares with the other pieces'.
pub(super) struct Piece {
    pub frames: Range<usize>,
    /// Power over what is normal in each bin, and the level from which it is not.
    excess: Vec<f64>,
    level: f64,
}

impl Piece {
    /// Whether more than the normal is between two frequencies, in cycles a frame.
    pub(super) fn exceeds(&self, low: f64, high: f64) -> bool {
        let bin = |cycles: f64| (cycles * self.frames.len() as f64).round() as usize;
        let around = bin(low).saturating_sub(LOBE)..(bin(high) + LOBE + 1).min(self.excess.len());
        self.excess.get(around).is_some_and(|excess| excess.iter().any(|e| *e > self.level))
    }
}

/// The first piece, whose start a window that starts at zero hides, and those that exceed the normal most: at
/// most so many, each in bins in which none before it does. `band` is in cycles a frame.
pub(super) fn most_unlike(
    samples: &[Option<f64>],
    length: usize,
    most: usize,
    band: (f64, f64),
) -> Vec<Piece> {
    let mut pieces = of(samples, length);
    let bin = |cycles: f64| (cycles * length as f64) as usize;
    let mut open: Vec<bool> =
        (0..=length / 2).map(|k| (SLOW.max(bin(band.0))..=bin(band.1)).contains(&k)).collect();
    let trials = pieces.len() as f64 * open.iter().filter(|open| **open).count() as f64;
    let level = math::ln(trials.max(1.0) / FALSE_ALARM);
    pieces.iter_mut().for_each(|piece| piece.level = level);
    let mut chosen = Vec::new();
    while chosen.len() < most {
        let largest = |piece: &Piece| {
            piece
                .excess
                .iter()
                .zip(&open)
                .filter(|(_, open)| **open)
                .fold(0.0, |most: f64, (e, _)| most.max(*e))
        };
        let sizes: Vec<f64> = pieces.par_iter().map(largest).collect();
        let best = (0..pieces.len()).max_by(|a, b| sizes[*a].total_cmp(&sizes[*b]).then(b.cmp(a)));
        let Some(best) = best.filter(|best| sizes[*best] > level) else { break };
        chosen.push(best);
        for k in (0..open.len()).filter(|k| pieces[best].excess[*k] > level) {
            open[k.saturating_sub(LOBE)..(k + LOBE + 1).min(length / 2 + 1)].fill(false);
        }
    }
    let is_chosen = |k: usize| k == 0 || chosen.contains(&k);
    pieces.into_iter().enumerate().filter(|(k, _)| is_chosen(*k)).map(|(_, piece)| piece).collect()
}

/// Every piece of which half the frames are there.
fn of(samples: &[Option<f64>], length: usize) -> Vec<Piece> {
    let last = samples.len() - length;
    let starts: Vec<usize> = (0..last).step_by(length / 2).chain([last]).collect();
    let largest = samples.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
    let least = math::powi(ROUNDING * largest, 2).max(f64::MIN_POSITIVE);
    let piece = |start: &usize| {
        let frames = *start..start + length;
        let piece = &samples[frames.clone()];
        let present = piece.iter().flatten().count();
        (2 * present >= length).then(|| Piece { frames, excess: powers(piece), level: 0.0 })
    };
    let mut pieces: Vec<Piece> = starts.par_iter().filter_map(piece).collect();
    let normal = normal(&pieces, length / 2 + 1);
    for piece in &mut pieces {
        piece.excess.iter_mut().zip(&normal).for_each(|(power, normal)| *power /= normal.max(least));
    }
    pieces
}

/// Power in each bin, as the variance of white noise with as much.
fn powers(samples: &[Option<f64>]) -> Vec<f64> {
    let periodogram = Periodogram::of(samples, samples.len());
    let amplitude_m = periodogram.amplitudes(&CUBIC.residual(samples));
    amplitude_m.into_iter().map(|a| math::powi(periodogram.deviation(a), 2)).collect()
}

/// The power of the record's noise and steady lines in each bin.
fn normal(pieces: &[Piece], bins: usize) -> Vec<f64> {
    let at = |values: &mut [f64], place: usize| *values.select_nth_unstable_by(place, f64::total_cmp).1;
    let of_bin = |bin: usize| {
        let mut powers: Vec<f64> = pieces.iter().map(|piece| piece.excess[bin]).collect();
        let place = powers.len() / QUARTER;
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
