//! Detects whether a trace was low-pass filtered before its export: the spectrum of its noise then falls
//! towards the Nyquist frequency.
//!
//! The power of short segments is averaged in bands of a third of an octave. Low-pass filtered noise has a
//! plateau of three bands with nearly equal power, which scatters over the segments as noise does. Above the
//! plateau, the power falls more steeply than that of a random walk and stays low up to the Nyquist
//! frequency. The power of white noise does not fall. Motion without noise has no plateau, or a plateau with
//! a different scatter. A trace whose step is coarser than its noise is not judged.

use super::finding::{Check, QualityFinding, Severity};
use super::measurement::MeasuredColumn;
use super::smoothing::find_smoothing;
use portable_math as math;
use std::f64::consts::TAU;

/// Number of frames of a segment. A segment resolves a plateau that ends at a sixth of the Nyquist frequency,
/// and 32 half-overlapping segments fit into 2,112 frames.
pub(super) const SEGMENT: usize = 128;
/// Maximum number of missing frames of a segment, which are bridged by straight lines: 5 % of missing frames
/// change the power of a band by less than 0.5 dB.
const MOST_BRIDGED: usize = 6;
/// Minimum number of segments: the median power of a band is then known to 20 %, enough to exclude a random
/// walk.
const FEWEST_SEGMENTS: usize = 32;
/// Maximum number of segments, spread over the recording: they determine the median power to 7 %.
const MOST_SEGMENTS: usize = 256;
/// Edges of the frequency bands, in bins of the transform: a band is about a third of an octave and at least
/// two bins wide. The frequencies of motion and trend are below the first edge.
const EDGES: [usize; 12] = [3, 5, 7, 10, 13, 16, 20, 25, 32, 40, 50, 64];
/// Number of frequency bands of a plateau.
const PLATEAU: usize = 3;
/// Largest allowed ratio of the powers of two bands of a plateau: 3 dB. Across three bands, the power of a
/// random walk, 1/f^2, falls by 4 dB or more.
const FLAT: f64 = 2.0;
/// In a filtered trace, the power is low in all bands above this multiple of the cut-off frequency.
const ABOVE: f64 = 1.6;
/// Largest allowed power of a filtered trace in the bands above [`ABOVE`] times the cut-off frequency, as a
/// fraction of the power of the plateau: -8 dB. A moving average over three frames just satisfies this limit.
const FALLEN: f64 = 0.16;
/// The power of a filtered trace falls by at least this factor, 10 dB, over the steepest octave. A random
/// walk falls by only 6 dB per octave, a filter of second order by 12 dB.
const STEEP: f64 = 10.0;
/// Allowed range of the ratio of the median to the lower quartile of the powers that the segments have in a
/// bin, if the trace is noise. The expected ratio is ln 2/ln(4/3) = 2.41; with 32 segments, the ratio is
/// within this range.
const NOISE_SCATTER: std::ops::RangeInclusive<f64> = 1.6..=3.8;
/// Smallest power of a plateau, as a fraction of the square of the largest position; a lower power is
/// rounding error.
const ROUNDING: f64 = 1e-26;

/// Cut-off frequency of the low-pass filter that a trace went through, Hz; `None` if the trace shows no
/// filter.
fn cutoff_hz(spectrum: &SegmentSpectrum, samples: &[Option<f64>], frame_rate_hz: f64) -> Option<f64> {
    let bands = spectrum.median_band_powers()?;
    let largest = samples.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
    let ends_at = |start: usize| {
        let plateau = &bands[start..start + PLATEAU];
        let level = plateau.iter().map(|band| band.power).sum::<f64>() / PLATEAU as f64;
        let end = (start + PLATEAU..bands.len()).find(|&band| bands[band].power < level / 2.0)?;
        let filtered =
            level > ROUNDING * largest * largest && is_plateau(plateau) && falls_steeply(&bands, end, level);
        filtered.then(|| EDGES[end] as f64 / SEGMENT as f64 * frame_rate_hz)
    };
    (0..=bands.len() - PLATEAU).find_map(ends_at)
}

/// First band that starts at or above `bin`, or the last band.
fn first_band_from(bin: f64) -> usize {
    EDGES.iter().position(|&edge| edge as f64 >= bin).unwrap_or(EDGES.len()).min(EDGES.len() - 2)
}

/// Whether the power falls steeply and stays low. `end` is the first band whose power is below half the
/// plateau's level; the fall may start one band earlier.
fn falls_steeply(bands: &[PrefilterBand], end: usize, level: f64) -> bool {
    let stays =
        bands[first_band_from(ABOVE * EDGES[end] as f64)..].iter().all(|band| band.power <= FALLEN * level);
    let steep =
        |band: usize| bands[band].power >= STEEP * bands[first_band_from(2.0 * EDGES[band] as f64)].power;
    stays && (end - 1..bands.len()).any(steep)
}

fn is_plateau(bands: &[PrefilterBand]) -> bool {
    let powers = || bands.iter().map(|band| band.power);
    let (low, high) = (powers().fold(f64::INFINITY, f64::min), powers().fold(0.0, f64::max));
    low > 0.0 && high <= FLAT * low && bands.iter().all(|band| NOISE_SCATTER.contains(&band.scatter))
}

/// Power of a frequency band between two bins, from all segments.
struct PrefilterBand {
    /// Median power per bin over the segments; kinks, outliers and chatter in fewer than half of the segments
    /// do not change it.
    power: f64,
    /// Ratio of the median to the lower quartile of the power over the segments.
    scatter: f64,
}

/// Number of frequency bins of a segment, from zero up to the Nyquist frequency.
pub(super) const BINS: usize = SEGMENT / 2;

/// Power of a frequency bin over the segments.
#[derive(Clone, Copy)]
pub(super) struct BinPower {
    pub lower_quartile: f64,
    pub median: f64,
}

/// Powers of the segments of a trace.
pub(super) struct SegmentSpectrum {
    pub segments: usize,
    /// One entry for each of [`BINS`]; empty without segments.
    pub bins: Vec<BinPower>,
}

impl SegmentSpectrum {
    /// Computes the powers of segments spread over the recording, half overlapping, each minus its trend and
    /// multiplied by a Hann window.
    pub(super) fn from_samples(samples: &[Option<f64>]) -> Self {
        let starts: Vec<usize> =
            (0..samples.len().saturating_sub(SEGMENT - 1)).step_by(SEGMENT / 2).collect();
        let (every, hann) = (starts.len() / MOST_SEGMENTS + 1, hann_window());
        let segment = |&start: &usize| windowed_segment(&samples[start..start + SEGMENT], &hann);
        let twice_cosines = std::array::from_fn(|bin| 2.0 * math::cos(TAU * bin as f64 / SEGMENT as f64));
        let power = |values: Vec<f64>| goertzel_powers(&values, &twice_cosines);
        let powers: Vec<[f64; BINS]> = starts.iter().step_by(every).filter_map(segment).map(power).collect();
        let of_bin = |bin: usize| {
            let mut sorted: Vec<f64> = powers.iter().map(|powers| powers[bin]).collect();
            sorted.sort_unstable_by(f64::total_cmp);
            let median = *sorted.get(sorted.len() / 2)?;
            Some(BinPower { lower_quartile: sorted[sorted.len() / 4], median })
        };
        Self { segments: powers.len(), bins: (0..BINS).filter_map(of_bin).collect() }
    }

    fn median_band_powers(&self) -> Option<Vec<PrefilterBand>> {
        if self.segments < FEWEST_SEGMENTS {
            return None;
        }
        let band = |edges: &[usize]| {
            let bins = &self.bins[edges[0]..edges[1]];
            let quartile: f64 = bins.iter().map(|bin| bin.lower_quartile).sum();
            let median: f64 = bins.iter().map(|bin| bin.median).sum();
            PrefilterBand { power: median / bins.len() as f64, scatter: median / quartile }
        };
        Some(EDGES.windows(2).map(band).collect())
    }
}

fn hann_window() -> [f64; SEGMENT] {
    std::array::from_fn(|i| 0.5 - 0.5 * math::cos(TAU * (i as f64 + 0.5) / SEGMENT as f64))
}

/// A segment minus its least-squares parabola, with a Hann window; `None` if too many frames are missing.
fn windowed_segment(samples: &[Option<f64>], hann: &[f64; SEGMENT]) -> Option<Vec<f64>> {
    let mut values = interpolate_gaps(samples)?;
    let centre = (SEGMENT - 1) as f64 / 2.0;
    let place = |i: usize| (i as f64 - centre) / centre;
    let mean_square = (0..SEGMENT).map(|i| math::powi(place(i), 2)).sum::<f64>() / SEGMENT as f64;
    // (these shapes are orthogonal over a segment, so each can be removed on its own)
    let shapes: [&dyn Fn(usize) -> f64; 3] = [&|_| 1.0, &place, &|i| math::powi(place(i), 2) - mean_square];
    for shape in shapes {
        let (mut along, mut square) = (0.0, 0.0);
        for (i, x) in values.iter().enumerate() {
            along += x * shape(i);
            square += math::powi(shape(i), 2);
        }
        values.iter_mut().enumerate().for_each(|(i, x)| *x -= along / square * shape(i));
    }
    values.iter_mut().zip(hann).for_each(|(x, weight)| *x *= weight);
    Some(values)
}

fn interpolate_gaps(samples: &[Option<f64>]) -> Option<Vec<f64>> {
    let missing = samples.iter().filter(|x| x.is_none()).count();
    if missing > MOST_BRIDGED || samples.first()?.is_none() || samples.last()?.is_none() {
        return None;
    }
    let mut values = Vec::with_capacity(samples.len());
    for x in samples.iter().enumerate().filter_map(|(i, x)| Some((i, (*x)?))) {
        let (from, start) = (values.len(), values.last().copied().unwrap_or(x.1));
        let slope = (x.1 - start) / (x.0 - from + 1) as f64;
        values.extend((1..=x.0 - from).map(|k| start + slope * k as f64));
        values.push(x.1);
    }
    Some(values)
}

/// Powers of a segment at all bins (Goertzel's recurrence); `twice_cosines` has `2 cos(2 pi k/n)` of every
/// bin.
fn goertzel_powers(values: &[f64], twice_cosines: &[f64; BINS]) -> [f64; BINS] {
    let (mut last, mut before) = ([0.0; BINS], [0.0; BINS]);
    // (the bins are independent of each other, so the processor computes several at once)
    for x in values {
        for bin in 0..BINS {
            let next = x + twice_cosines[bin] * last[bin] - before[bin];
            before[bin] = std::mem::replace(&mut last[bin], next);
        }
    }
    std::array::from_fn(|bin| {
        let (last, before) = (last[bin], before[bin]);
        last * last + before * before - twice_cosines[bin] * last * before
    })
}

/// Finding that a column was low-pass filtered before its export.
pub(super) fn check_prefilter(column: &MeasuredColumn, frame_rate_hz: f64) -> Option<QualityFinding> {
    if column.quality.coarse_step_m().is_some() {
        return None;
    }
    let spectrum = SegmentSpectrum::from_samples(column.samples);
    let (cut_hz, words) = match find_smoothing(&spectrum) {
        Some(filter) => (filter.cutoff * frame_rate_hz, filter.describe()),
        None => {
            let cut_hz = cutoff_hz(&spectrum, column.samples, frame_rate_hz)?;
            let words = "so the trace was low-passed before it was exported";
            (cut_hz, format!("the noise ends at about {cut_hz:.0} Hz, {words}"))
        }
    };
    let advice = "faster components are too small or gone: export the raw positions, without the tracker's \
        filter or smoothing";
    let kind = (Check::PreFiltered, Severity::Caution);
    Some(QualityFinding::advise(kind, (cut_hz, "Hz"), words, advice).on_channel(column.name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_bridged_by_straight_lines() {
        let samples = [Some(1.0), None, Some(3.0), Some(5.0), None, None, None, Some(1.0)];
        assert_eq!(interpolate_gaps(&samples), Some(vec![1.0, 2.0, 3.0, 5.0, 4.0, 3.0, 2.0, 1.0]));
        assert_eq!(
            (interpolate_gaps(&[None, Some(1.0)]), interpolate_gaps(&[Some(1.0), None])),
            (None, None)
        );
    }

    #[test]
    fn the_power_of_a_cosine_is_at_its_bin() {
        let cosine: Vec<f64> = (0..SEGMENT).map(|i| (TAU * 9.0 * i as f64 / SEGMENT as f64).cos()).collect();
        let half = SEGMENT as f64 / 2.0;
        let cosines = std::array::from_fn(|bin| 2.0 * (TAU * bin as f64 / SEGMENT as f64).cos());
        let powers = goertzel_powers(&cosine, &cosines);
        assert!((powers[9] - half * half).abs() < 1e-8 && powers[10] < 1e-8);
    }

    #[test]
    fn a_segment_is_freed_of_its_parabola() {
        let parabola: Vec<Option<f64>> =
            (0..SEGMENT).map(|i| Some(3.0 + 0.2 * i as f64 - 0.01 * (i * i) as f64)).collect();
        assert!(windowed_segment(&parabola, &hann_window()).unwrap().iter().all(|x| x.abs() < 1e-10));
    }
}
