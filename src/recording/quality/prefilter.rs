//! Whether a trace was low-passed before it was exported: the spectrum of its noise then falls towards the
//! Nyquist frequency.
//!
//! The power of short segments is taken in bands of a third of an octave. A low-passed noise has a plateau,
//! three neighbouring bands of nearly equal power, that scatters from segment to segment as noise does; above
//! it the power falls more steeply than that of a random walk, and stays low up to the Nyquist frequency.
//! White noise does not fall; motion without noise has no plateau, or one that does not scatter so; a trace
//! in steps coarser than its noise is not judged.

use super::finding::{Check, QualityFinding, Severity};
use super::measurement::MeasuredColumn;
use crate::math;
use std::f64::consts::TAU;

/// Frames of a segment: a plateau that reaches a sixth of the Nyquist frequency is seen, and 32 segments fit
/// into 2,112 frames.
const SEGMENT: usize = 128;
/// Most frames of a segment that may be bridged by a straight line; 5 % changes the power in a band by less
/// than 0.5 dB.
const MOST_BRIDGED: usize = 6;
/// Fewest segments: the median power of a band is then known to a fifth, and a random walk is not taken for a
/// filter.
const FEWEST_SEGMENTS: usize = 32;
/// Most segments, spread over the recording: the median is then known to 7 %.
const MOST_SEGMENTS: usize = 256;
/// Bins that bound the bands, about a third of an octave apart and at least two bins wide; motion and its
/// trend are below the first.
const EDGES: [usize; 12] = [3, 5, 7, 10, 13, 16, 20, 25, 32, 40, 50, 64];
/// Bands of a plateau.
const PLATEAU: usize = 3;
/// Ratio of power within a plateau, 3 dB; the power of a random walk, which falls as 1/f^2, differs by 4 dB
/// or more.
const FLAT: f64 = 2.0;
/// Bands that start this many times above the cut-off have to have fallen.
const ABOVE: f64 = 1.6;
/// Share of the plateau's power to which they have to have fallen: 8 dB, which a mean of three frames just
/// does.
const FALLEN: f64 = 0.16;
/// Fall within one octave at its steepest: 10 dB; a random walk falls by 6 dB, a filter of second order by 12
/// dB.
const STEEP: f64 = 10.0;
/// Median over lower quartile of the power of noise in a bin is ln 2/ln(4/3) = 2.41; 32 segments tell it
/// within this range.
const NOISE_SCATTER: std::ops::RangeInclusive<f64> = 1.6..=3.8;
/// Least power of a plateau relative to that of the largest position: below are rounding errors of
/// arithmetic.
const ROUNDING: f64 = 1e-26;

/// Frequency to which a trace holds noise before it was cut off, Hz, if it was; `frame_rate_hz` is its rate.
pub(crate) fn cutoff_hz(samples: &[Option<f64>], frame_rate_hz: f64) -> Option<f64> {
    let bands = median_band_powers(samples)?;
    let largest = samples.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
    let ends_at = |start: usize| {
        let level = mean_level(&bands, start);
        let end = (start + PLATEAU..bands.len()).find(|&band| bands[band].power < level / 2.0)?;
        let filtered = level > ROUNDING * largest * largest
            && is_plateau(&bands[start..start + PLATEAU])
            && falls_steeply(&bands, end, level);
        filtered.then(|| EDGES[end] as f64 / SEGMENT as f64 * frame_rate_hz)
    };
    (0..=bands.len() - PLATEAU).find_map(ends_at)
}

/// First band that starts at or above `bin`; the last where there is none.
fn first_band_from(bin: f64) -> usize {
    EDGES.iter().position(|&edge| edge as f64 >= bin).unwrap_or(EDGES.len()).min(EDGES.len() - 2)
}

/// Whether the power falls steeply about band `end`, the first below half the plateau's level, and far, and
/// stays there.
fn falls_steeply(bands: &[PrefilterBand], end: usize, level: f64) -> bool {
    let stays =
        bands[first_band_from(ABOVE * EDGES[end] as f64)..].iter().all(|band| band.power <= FALLEN * level);
    let steep =
        |band: usize| bands[band].power >= STEEP * bands[first_band_from(2.0 * EDGES[band] as f64)].power;
    stays && (end - 1..bands.len()).any(steep)
}

fn mean_level(bands: &[PrefilterBand], start: usize) -> f64 {
    bands[start..start + PLATEAU].iter().map(|band| band.power).sum::<f64>() / PLATEAU as f64
}

fn is_plateau(bands: &[PrefilterBand]) -> bool {
    let powers = || bands.iter().map(|band| band.power);
    let (low, high) = (powers().fold(f64::INFINITY, f64::min), powers().fold(0.0, f64::max));
    low > 0.0 && high <= FLAT * low && bands.iter().all(|band| NOISE_SCATTER.contains(&band.scatter))
}

/// Power between two bins, over all segments.
struct PrefilterBand {
    /// Median over the segments of the power a bin: kinks, outliers and bursts of chatter in fewer than half
    /// of them do not reach it.
    power: f64,
    /// Median over lower quartile.
    scatter: f64,
}

fn median_band_powers(samples: &[Option<f64>]) -> Option<Vec<PrefilterBand>> {
    let starts: Vec<usize> = (0..samples.len().saturating_sub(SEGMENT - 1)).step_by(SEGMENT / 2).collect();
    let every = starts.len() / MOST_SEGMENTS + 1;
    let segments: Vec<Vec<f64>> = starts
        .iter()
        .step_by(every)
        .filter_map(|&start| windowed_segment(&samples[start..start + SEGMENT]))
        .collect();
    if segments.len() < FEWEST_SEGMENTS {
        return None;
    }
    let band = |edges: &[usize]| {
        let quartiles: Vec<(f64, f64)> = (edges[0]..edges[1])
            .map(|bin| quartile_and_median(segments.iter().map(|s| goertzel_power(s, bin)).collect()))
            .collect();
        let quartile: f64 = quartiles.iter().map(|q| q.0).sum();
        let median: f64 = quartiles.iter().map(|q| q.1).sum();
        PrefilterBand { power: median / quartiles.len() as f64, scatter: median / quartile }
    };
    Some(EDGES.windows(2).map(band).collect())
}

fn quartile_and_median(mut values: Vec<f64>) -> (f64, f64) {
    values.sort_unstable_by(f64::total_cmp);
    (values[values.len() / 4], values[values.len() / 2])
}

/// One segment without its parabola, weighted with a Hann window; `None` where too many frames are missing.
fn windowed_segment(samples: &[Option<f64>]) -> Option<Vec<f64>> {
    let mut values = interpolate_gaps(samples)?;
    let centre = (SEGMENT - 1) as f64 / 2.0;
    let place = |i: usize| (i as f64 - centre) / centre;
    let mean_square = (0..SEGMENT).map(|i| math::powi(place(i), 2)).sum::<f64>() / SEGMENT as f64;
    // (orthogonal on the grid)
    let shapes: [&dyn Fn(usize) -> f64; 3] = [&|_| 1.0, &place, &|i| math::powi(place(i), 2) - mean_square];
    for shape in shapes {
        let (along, square) = values.iter().enumerate().fold((0.0, 0.0), |(along, square), (i, x)| {
            (along + x * shape(i), square + math::powi(shape(i), 2))
        });
        values.iter_mut().enumerate().for_each(|(i, x)| *x -= along / square * shape(i));
    }
    let hann = |i: usize| 0.5 - 0.5 * math::cos(TAU * (i as f64 + 0.5) / SEGMENT as f64);
    values.iter_mut().enumerate().for_each(|(i, x)| *x *= hann(i));
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

/// Power of a segment at a bin, by Goertzel's recurrence.
fn goertzel_power(values: &[f64], bin: usize) -> f64 {
    let twice_cosine = 2.0 * math::cos(TAU * bin as f64 / SEGMENT as f64);
    let (last, before) =
        values.iter().fold((0.0, 0.0), |(last, before), x| (x + twice_cosine * last - before, last));
    last * last + before * before - twice_cosine * last * before
}

/// A cut-off as a finding.
pub(super) fn check_prefilter(column: &MeasuredColumn, frame_rate_hz: f64) -> Option<QualityFinding> {
    let stepped =
        column.quality.step_m.is_some_and(|step| column.quality.noise_m.is_none_or(|noise| noise < step));
    let cut_hz = if stepped { None } else { cutoff_hz(column.samples, frame_rate_hz) }?;
    let words =
        format!("the noise ends at about {cut_hz:.0} Hz, so the trace was low-passed before it was exported");
    let advice = "faster components are too small or gone: export the raw positions, without the tracker's \
        filter or smoothing";
    Some(
        QualityFinding::new(Check::PreFiltered, Severity::Caution, cut_hz, "Hz", words)
            .with_advice(advice)
            .on_channel(column.name),
    )
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
        assert!(
            (goertzel_power(&cosine, 9) - half * half).abs() < 1e-8 && goertzel_power(&cosine, 10) < 1e-8
        );
    }

    #[test]
    fn a_segment_is_freed_of_its_parabola() {
        let parabola: Vec<Option<f64>> =
            (0..SEGMENT).map(|i| Some(3.0 + 0.2 * i as f64 - 0.01 * (i * i) as f64)).collect();
        assert!(windowed_segment(&parabola).unwrap().iter().all(|x| x.abs() < 1e-10));
    }
}
