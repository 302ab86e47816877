//! Oscillations that last only for a short time, estimated from pieces of a long record.

use crate::analysis::SpectralAnalysis;
use crate::periodogram::{Periodogram, upper_median};
use crate::record::SampledRecord;
use crate::settings::ROUNDING;
use crate::trend::Trend;
use crate::{Component, ComponentReason, ComponentVerdict, SpectrumSettings};
use portable_math as math;
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::ops::Range;

/// A length of pieces, in frames, and the choice of the pieces of this length that are analysed.
struct SegmentScale {
    length: usize,
    /// Maximum number of pieces that are analysed.
    most: usize,
    /// Whether the first piece is always analysed: a window that is zero at its ends hides an oscillation
    /// that ends soon after the start of the record.
    first: bool,
}

/// The lengths of the pieces that are analysed. An oscillation shows best in pieces that are as long as it
/// lasts. The longest pieces take most of the computing time.
const SCALES: [SegmentScale; 3] = [
    SegmentScale { length: 4096, most: 2, first: false },
    SegmentScale { length: 1024, most: 4, first: true },
    SegmentScale { length: 256, most: 4, first: true },
];
/// Distance in frequency, in resolutions of a piece, within which two components count as the same component.
const SAME_WITHIN_RESOLUTIONS: f64 = 2.0;
/// Distance in frequency, in standard deviations of the difference, within which two components count as the
/// same component.
const SAME_WITHIN_DEVIATIONS: f64 = 3.0;
/// Decay, nepers, after which an oscillation is over: a twentieth of its amplitude is left.
const NEPERS_UNTIL_OVER: f64 = 3.0;
/// Decay, nepers, above which an oscillation ends soon and is not a steady line of varying amplitude.
const NEPERS_OF_DECAY: f64 = 1.0;

/// A component that was estimated from a piece.
#[derive(Debug)]
pub(super) struct Transient {
    pub component: Component,
    /// First frame of the piece that was analysed.
    first: usize,
    resolution_hz: f64,
    /// Decay, in nepers, of the component up to the end of the piece.
    nepers: f64,
}

impl Transient {
    /// Whether another component has the same frequency within the accuracy of both, or within the frequency
    /// range of one of them.
    pub(super) fn matches_component(&self, other: &Component) -> bool {
        let c = &self.component;
        let sd_hz = math::hypot(c.frequency_sd_hz, other.frequency_sd_hz);
        let within_hz = (SAME_WITHIN_RESOLUTIONS * self.resolution_hz).max(SAME_WITHIN_DEVIATIONS * sd_hz);
        let holds = |a: &Component, b: &Component| {
            a.range_hz.is_some_and(|range| (range.low_hz..=range.high_hz).contains(&b.frequency_hz))
        };
        (c.frequency_hz - other.frequency_hz).abs() < within_hz || holds(c, other) || holds(other, c)
    }

    /// Whether `other`, a component of the whole record that changes over it, may be this component. Over the
    /// whole record a decaying oscillation shows as a line whose width grows with the decay.
    pub(super) fn explains_component(&self, other: &Component) -> bool {
        let c = &self.component;
        let width_hz = c.damping_ratio.map_or(0.0, |ratio| 2.0 * ratio * c.frequency_hz);
        self.matches_component(other) || (c.frequency_hz - other.frequency_hz).abs() < width_hz
    }

    /// Adds a doubt to a component that does not decay within the piece: outside the piece, the component
    /// may have another frequency.
    fn with_persistence_doubt(mut self) -> Self {
        if self.nepers < NEPERS_OF_DECAY {
            let words = "it goes on outside the part of the window in which it was read, and may drift or \
                         change there";
            let reasons = &mut self.component.reasons;
            reasons.push(ComponentReason { verdict: ComponentVerdict::Ambiguous, words: words.to_owned() });
            reasons.sort_by_key(|reason| reason.verdict);
            self.component.verdict = reasons[0].verdict;
        }
        self
    }

    /// Whether the piece describes the component better than the whole record does, because the component
    /// changes over the record.
    pub(super) fn is_more_specific(&self) -> bool {
        self.nepers > NEPERS_OF_DECAY || self.component.range_hz.is_some()
    }
}

/// All components that last only for a short time, each once.
pub(super) fn find_transients(record: &SampledRecord, settings: &SpectrumSettings) -> Vec<Transient> {
    let (low_hz, high_hz) = settings.band_hz.unwrap_or((0.0, record.frame_rate_hz / 2.0));
    let band = (low_hz / record.frame_rate_hz, (high_hz / record.frame_rate_hz).min(0.5));
    let of_scale = |scale: &SegmentScale| {
        let pieces = cut_segments(record.samples, scale.length, band);
        let chosen = select_unusual(&pieces, scale.most);
        let is_read = |k: usize| chosen.contains(&k) || (scale.first && k == 0);
        let numbered = pieces.into_iter().enumerate();
        numbered.filter(|(k, _)| is_read(*k)).map(|(_, piece)| piece).collect::<Vec<_>>()
    };
    let pieces: Vec<UnusualPiece> = SCALES.iter().flat_map(of_scale).collect();
    let read = |piece: &UnusualPiece| {
        let samples = &record.samples[piece.frames.clone()];
        read_piece(&SampledRecord { samples, ..*record }, settings, piece)
    };
    let mut found: Vec<Transient> = pieces.par_iter().flat_map_iter(read).collect();
    math::sort_by_number(&mut found, |a| a.component.frequency_sd_hz);
    let mut once: Vec<Transient> = Vec::new();
    for brief in found {
        // two components of one piece are distinct
        let known = |known: &Transient| {
            (known.first, known.resolution_hz) != (brief.first, brief.resolution_hz)
                && (known.matches_component(&brief.component) || brief.matches_component(&known.component))
        };
        if !once.iter().any(known) {
            once.push(brief);
        }
    }
    once
}

/// The components of a piece that do not last for the whole record: those whose power exceeds the normal
/// power at their frequency, and those that end within the piece.
fn read_piece(record: &SampledRecord, settings: &SpectrumSettings, piece: &UnusualPiece) -> Vec<Transient> {
    let rate_hz = record.frame_rate_hz;
    let passes = |brief: &Transient| {
        let c = &brief.component;
        let (low_hz, high_hz) =
            c.range_hz.map_or((c.frequency_hz, c.frequency_hz), |range| (range.low_hz, range.high_hz));
        brief.nepers > NEPERS_UNTIL_OVER || piece.exceeds_normal_power(low_hz / rate_hz, high_hz / rate_hz)
    };
    let found = SpectralAnalysis::from_record(record, settings).ok().into_iter();
    let found = found.flat_map(|analysis| list_transients(analysis, piece.frames.start, rate_hz));
    found.filter(passes).map(Transient::with_persistence_doubt).collect()
}

/// The components that `analysis` lists for a piece of the record. `start` is the index, in the record, of
/// the first frame of the piece.
fn list_transients(
    analysis: SpectralAnalysis,
    start: usize,
    rate_hz: f64,
) -> impl Iterator<Item = Transient> {
    let first = start + analysis.skipped_frames;
    let lasts_s = analysis.residual_m.len() as f64 / rate_hz;
    let resolution_hz = analysis.spectrum.resolution_hz;
    analysis.spectrum.components.into_iter().map(move |c| {
        let nepers = decay_nepers(&c, lasts_s);
        let begins_s = first as f64 / rate_hz + c.begins_s.unwrap_or(0.0);
        let component = Component { begins_s: (begins_s > 0.0).then_some(begins_s), ..c };
        Transient { component, first, resolution_hz, nepers }
    })
}

/// Nepers by which a component decays from its start to the end of a record; 0 if the decay is not
/// significant.
fn decay_nepers(c: &Component, lasts_s: f64) -> f64 {
    let decay =
        c.damping_ratio.zip(c.damping_ratio_sd).filter(|(ratio, sd)| *ratio > SAME_WITHIN_DEVIATIONS * sd);
    decay.map_or(0.0, |(ratio, _)| {
        TAU * c.frequency_hz * ratio / (1.0 - ratio * ratio).sqrt() * (lasts_s - c.begins_s.unwrap_or(0.0))
    })
}

// Pieces whose spectrum exceeds the normal spectrum of the record. The pieces overlap by half. In each bin
// the normal power follows from the lower quartile of the powers of all pieces, which for noise is `-ln(3/4)`
// times the mean power. Steady lines and noise of any colour are therefore normal, even if most of the pieces
// contain a step.

/// Allowed probability that noise alone exceeds the level of any piece anywhere in a record.
const FALSE_ALARM: f64 = 0.01;
/// Reciprocal of the quantile of the powers of the pieces from which the normal power in a bin follows: 4
/// selects the lower quartile.
const NORMAL_POWER_QUANTILE: usize = 4;
/// Ratio of the lower quartile of the power of noise to its mean, `-ln(3/4)`. The normal power is the
/// quartile over the pieces, divided by this ratio.
const QUARTER_OF_NOISE: f64 = 0.287_682_072_451_780_9;
/// Half width, bins, of the neighbourhood whose median is a lower limit of the normal power in a bin. The
/// limit is needed because the quartile of a few pieces is inaccurate.
const NEIGHBOURHOOD: usize = 8;
/// Smallest number of cycles in a piece at which the power is compared with the normal power: at fewer
/// cycles, a step, not an oscillation, would exceed it.
const FEWEST_CYCLES: usize = 8;
/// Half width of the main lobe of a Hann window, bins.
const LOBE: usize = 2;
/// Trend that is removed from each piece.
const CUBIC: Trend = Trend::Polynomial(4);

/// A piece of a record, and the comparison of its spectrum with those of the other pieces.
pub(super) struct UnusualPiece {
    pub frames: Range<usize>,
    /// Ratio of the power to the normal power in each bin.
    excess: Vec<f64>,
    /// Excess that noise alone exceeds anywhere in a record only with the probability [`FALSE_ALARM`].
    level: f64,
}

impl UnusualPiece {
    /// Whether the power between two frequencies, cycles per frame, exceeds the normal power.
    pub(super) fn exceeds_normal_power(&self, low: f64, high: f64) -> bool {
        let bin = |cycles: f64| (cycles * self.frames.len() as f64).round() as usize;
        let around = bin(low).saturating_sub(LOBE)..(bin(high) + LOBE + 1).min(self.excess.len());
        self.excess.get(around).is_some_and(|excess| excess.iter().any(|e| *e > self.level))
    }
}

/// The pieces of a length that have values in at least half their frames; `band` is in cycles per frame.
pub(super) fn cut_segments(samples: &[Option<f64>], length: usize, band: (f64, f64)) -> Vec<UnusualPiece> {
    let last = samples.len() - length;
    let starts: Vec<usize> = (0..last).step_by(length / 2).chain([last]).collect();
    let piece = |start: &usize| {
        let (frames, piece) = (*start..start + length, &samples[*start..start + length]);
        let enough = 2 * piece.iter().flatten().count() >= length;
        enough.then(|| UnusualPiece { frames, excess: segment_power_spectrum(piece), level: 0.0 })
    };
    let mut pieces: Vec<UnusualPiece> = starts.par_iter().filter_map(piece).collect();
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

/// Indices of up to `most` pieces with the largest excess. For each piece, only those bins count in which no
/// piece chosen before exceeds the normal power.
pub(super) fn select_unusual(pieces: &[UnusualPiece], most: usize) -> Vec<usize> {
    let mut chosen = Vec::new();
    let mut open = vec![true; pieces.first().map_or(0, |piece| piece.excess.len())];
    while chosen.len() < most {
        let largest = |piece: &UnusualPiece| {
            let bins = piece.excess.iter().zip(&open).filter(|(_, open)| **open);
            bins.fold(0.0, |most: f64, (excess, _)| most.max(*excess))
        };
        let sizes: Vec<f64> = pieces.par_iter().map(largest).collect();
        let best = (0..pieces.len()).max_by(|a, b| sizes[*a].total_cmp(&sizes[*b]).then(b.cmp(a)));
        let Some(best) = best.filter(|best| sizes[*best] > pieces[*best].level) else { break };
        chosen.push(best);
        let UnusualPiece { excess, level, .. } = &pieces[best];
        for k in (0..open.len()).filter(|k| excess[*k] > *level) {
            let end = (k + LOBE + 1).min(open.len());
            open[k.saturating_sub(LOBE)..end].fill(false);
        }
    }
    chosen
}

/// Power in each bin, given as the variance of white noise of the same power.
fn segment_power_spectrum(samples: &[Option<f64>]) -> Vec<f64> {
    let periodogram = Periodogram::new(samples, samples.len());
    let amplitude_m = periodogram.amplitudes(&CUBIC.residual(samples));
    amplitude_m.into_iter().map(|a| math::powi(periodogram.noise_sd_m(a), 2)).collect()
}

/// Normal power in each bin, which is the power of the noise and steady lines of the record.
fn normal_power_spectrum(pieces: &[UnusualPiece], bins: usize) -> Vec<f64> {
    let of_bin = |bin: usize| {
        let mut powers: Vec<f64> = pieces.iter().map(|piece| piece.excess[bin]).collect();
        let place = powers.len() / NORMAL_POWER_QUANTILE;
        if powers.is_empty() {
            0.0
        } else {
            *powers.select_nth_unstable_by(place, f64::total_cmp).1 / QUARTER_OF_NOISE
        }
    };
    let own: Vec<f64> = (0..bins).into_par_iter().map(of_bin).collect();
    let around = |bin: usize| {
        upper_median(own[bin.saturating_sub(NEIGHBOURHOOD)..(bin + NEIGHBOURHOOD + 1).min(bins)].to_vec())
    };
    (0..bins).map(|bin| own[bin].max(around(bin).unwrap_or(0.0))).collect()
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
            select_unusual(&pieces, 4).len()
        };
        assert!((0..40).map(alarms).sum::<usize>() <= 1);
    }

    #[test]
    fn what_is_there_for_a_short_time_is_found_where_it_is() {
        let pieces = cut_segments(&record(1, 1.0), LENGTH, (0.0, 0.5));
        assert_eq!(pieces.len(), FRAMES.div_ceil(LENGTH / 2) - 1);
        assert_eq!(pieces.last().unwrap().frames, FRAMES - LENGTH..FRAMES);
        let [k] = select_unusual(&pieces, 4)[..] else { panic!("{:?}", select_unusual(&pieces, 4)) };
        let piece = &pieces[k];
        assert!(piece.frames.start < 7100 && piece.frames.end > 7100, "{:?}", piece.frames);
        assert!(piece.exceeds_normal_power(0.23, 0.23) && piece.exceeds_normal_power(0.2, 0.25));
        assert!(!piece.exceeds_normal_power(0.1, 0.1) && !piece.exceeds_normal_power(0.3, 0.4));
        assert!(
            select_unusual(&cut_segments(&record(1, 1.0), LENGTH, (0.3, 0.5)), 4).is_empty(),
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
