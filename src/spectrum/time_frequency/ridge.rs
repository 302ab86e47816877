//! The ridge: a path through the columns, each of its points refined on the frames of its segment.

use super::chirp::{CURVED, Fitted, LINEAR, Segment, Shape};
use super::columns::Bins;
use super::noise::{Noise, Rest, median, smoothed};
use super::path::Field;
use super::segment::Layout;
use super::{Range, Spectrogram, range};
use crate::spectrum::{ROUNDING, window};

/// Chance that noise alone puts one point on a ridge.
const FALSE_ALARM: f64 = 0.01;
/// Independent trials in each resolution of each segment: the maxima of overlapping columns, fitted, are more than their independent values.
const TRIALS: f64 = 10.0;
/// Points in a row that make a part of a ridge; fewer span less than half a segment more than one of them.
const FEWEST_POINTS: usize = 3;
/// Farthest a fit moves from the path, resolutions: half way down the lobe of a Hann window.
const FARTHEST: f64 = 1.0;
/// Deviation of a frequency that noise does not explain, resolutions: what other components leak into a fit.
const LEAKS: f64 = 0.002;
/// Length of the fit at an end of the record, segments: the change of the rate takes a longer stretch than the rate.
const END_SEGMENTS: f64 = 1.75;
/// What a changing rate adds to the fitted frequency with the sine weights, over its change from one segment to the next: `<x^4>/<x^2>/24`.
const BEND: f64 = 0.4154 / 24.0;
/// Deviations of the frequency from which on the rate of a point may change too.
const MATTERS: f64 = 0.5;
/// Farthest that the fit at an end may lie from the ridge in the middle of its outermost segment, resolutions.
const AGREES: f64 = 0.25;

/// A point of a ridge: the middle of a segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RidgePoint {
    /// Time from the first frame of the record, s.
    pub time_s: f64,
    /// Frequency at that time, Hz.
    pub frequency_hz: f64,
    /// Its standard deviation, Hz: from the noise beside the component, or from what the fit leaves of it if that is more, and a five-hundredth of the resolution for what other components
    /// leak into the fit.
    pub frequency_sd_hz: f64,
    /// Change of the frequency, Hz/s.
    pub rate_hz_per_s: f64,
    /// Amplitude at that time, m.
    pub amplitude_m: f64,
    /// Amplitude over that of noise in a bin of the column, `20 log10`, dB.
    pub snr_db: f64,
}

/// A frequency carried to an end of the record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RidgeEnd {
    /// Time from the first frame of the record, s.
    pub time_s: f64,
    /// Frequency at that time, Hz.
    pub frequency_hz: f64,
    /// Its standard deviation, Hz.
    pub frequency_sd_hz: f64,
}

/// Course of a component over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Ridge {
    /// The points, in order of time. A point is where the fitted amplitude exceeds the noise beside it by more than noise alone reaches once in
    /// a hundred records and does not fall to nothing within the segment, three segments in a row or more; elsewhere the ridge is interrupted.
    pub points: Vec<RidgePoint>,
    /// The frequency at the first frame, if the ridge reaches the first segment and carries that far.
    pub start: Option<RidgeEnd>,
    /// The frequency at the last frame, if the ridge reaches the last segment and carries that far.
    pub end: Option<RidgeEnd>,
    /// Length of a segment, s.
    pub segment_s: f64,
    /// Distance of the points where the ridge is not interrupted, s.
    pub hop_s: f64,
}

impl Ridge {
    /// The parts of the ridge between its interruptions.
    pub fn parts(&self) -> impl Iterator<Item = &[RidgePoint]> {
        self.points.chunk_by(|a, b| b.time_s - a.time_s < 1.5 * self.hop_s)
    }

    /// Least and greatest frequency, the two ends of the record included. A point counts only if a neighbour's frequency, carried over by its
    /// rate, agrees with it within a quarter of a resolution or four deviations, so that a single bad point sets neither; `None` where no
    /// point is so confirmed.
    #[must_use]
    pub fn range_hz(&self) -> Option<Range> {
        range::of(self)
    }

    /// Whether the frequency changes: the scatter of points half a segment apart about their mean is larger than their deviations explain
    /// but once in a thousand records.
    #[must_use]
    pub fn drifts(&self) -> bool {
        range::drifts(self)
    }
}

/// A fitted column.
#[derive(Clone, Copy)]
struct Fit {
    shape: Shape,
    /// Deviation of the frequency for a noise of deviation 1 in each frame, cycles in the segment.
    unit_sd: f64,
    /// What the fit leaves in a frame beside the component and where it was, m.
    rest: Rest,
}

impl Fit {
    fn of<const N: usize>(fitted: &Fitted<N>, rest: Rest) -> Self {
        Self { shape: fitted.shape, unit_sd: fitted.cycles_variance(0.0).sqrt(), rest }
    }

    /// Noise that the deviations of the fit follow from, m.
    fn noise_m(&self) -> f64 {
        self.rest.beside_m.max(self.rest.under_m)
    }
}

/// What the fits share.
struct Tracker<'a> {
    samples: &'a [Option<f64>],
    layout: Layout,
    frame_rate_hz: f64,
    resolution_hz: f64,
    band_hz: (f64, f64),
    /// Noise below is rounding, m.
    least_m: f64,
}

pub(super) fn follow(spectrogram: &Spectrogram, samples: &[Option<f64>], band_hz: (f64, f64)) -> Ridge {
    let largest = samples.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
    let tracker = Tracker {
        samples,
        layout: spectrogram.layout,
        frame_rate_hz: spectrogram.frame_rate_hz,
        resolution_hz: spectrogram.resolution_hz,
        band_hz,
        least_m: (ROUNDING * largest).max(f64::MIN_POSITIVE),
    };
    let fits = tracker.bent(&tracker.fits(&tracker.starts(spectrogram)));
    let points: Vec<Option<RidgePoint>> = fits.iter().enumerate().map(|(c, fit)| fit.as_ref().and_then(|fit| tracker.point(c, fit))).collect();
    let points = without_short_runs(points);
    let last = tracker.layout.columns - 1;
    let kept = |c: usize| points[c].and(fits[c].as_ref());
    Ridge {
        start: kept(0).and_then(|fit| tracker.end(0, fit)),
        end: kept(last).and_then(|fit| tracker.end(last, fit)),
        points: points.into_iter().flatten().collect(),
        segment_s: spectrogram.segment_s,
        hop_s: spectrogram.hop_s,
    }
}

/// Takes out points in runs that are too short for a course.
fn without_short_runs(mut points: Vec<Option<RidgePoint>>) -> Vec<Option<RidgePoint>> {
    let fewest = FEWEST_POINTS.min(points.len());
    for run in points.chunk_by_mut(|a, b| a.is_some() == b.is_some()).filter(|run| run.len() < fewest) {
        run.fill(None);
    }
    points
}

impl Tracker<'_> {
    /// Where the path through the columns has each fit start; `None` where there is no spectrum.
    fn starts(&self, spectrogram: &Spectrogram) -> Vec<Option<Shape>> {
        let bins = Bins::of(&self.layout);
        let band = bins.within(self.band_hz, self.frame_rate_hz);
        let level = |column: &Vec<f64>| {
            let inside = column.get(band.clone()).unwrap_or_default();
            let middle = median(inside.to_vec()).unwrap_or(0.0).max(self.least_m);
            inside.iter().map(|a| a / middle).collect::<Vec<f64>>()
        };
        let levels: Vec<_> = spectrogram.amplitude_m.iter().map(|column| column.as_ref().map(level)).collect();
        let segment = self.layout.frames as f64;
        let bins_per_resolution = bins.padded as f64 / segment;
        let quarters = 4.0 * self.layout.hop as f64 / segment;
        let path = Field { levels: &levels, bins: band.clone().count(), bins_per_resolution, quarters }.best();
        let cycles = |c: usize| (band.start() + path[c]) as f64 / bins_per_resolution;
        let start = |c: usize| {
            let (before, after) = self.around(c);
            let apart = self.segments_apart(before, after);
            Shape::start(cycles(c), if apart > 0.0 { (cycles(after) - cycles(before)) / apart } else { 0.0 })
        };
        (0..path.len()).map(|c| levels[c].as_ref().map(|_| start(c))).collect()
    }

    /// The columns half a segment before and after one, as far as there are any.
    fn around(&self, column: usize) -> (usize, usize) {
        let near = (self.layout.frames / (2 * self.layout.hop)).max(1);
        (column.saturating_sub(near), (column + near).min(self.layout.columns - 1))
    }

    fn segments_apart(&self, before: usize, after: usize) -> f64 {
        (after - before) as f64 * self.layout.hop as f64 / self.layout.frames as f64
    }

    fn segment(&self, column: usize) -> Option<&[Option<f64>]> {
        self.samples.get(self.layout.first(column)..self.layout.first(column) + self.layout.frames)
    }

    fn noise(&self) -> Noise {
        Noise::of(self.layout.frames, (self.band_hz.0 / self.resolution_hz, self.band_hz.1 / self.resolution_hz))
    }

    fn fits(&self, starts: &[Option<Shape>]) -> Vec<Option<Fit>> {
        let (weights, noise) = (weights(self.layout.frames), self.noise());
        let fit = |(c, start): (usize, &Option<Shape>)| {
            let samples = self.segment(c)?;
            let fitted = Segment { samples, weights: &weights }.fit::<LINEAR>((*start)?)?;
            Some(Fit::of(&fitted, noise.rest(samples, &fitted.shape)))
        };
        let fits: Vec<Option<Fit>> = starts.iter().enumerate().map(fit).collect();
        let noise_m = smoothed(&fits.iter().map(|fit| fit.map(|fit| fit.rest.beside_m)).collect::<Vec<_>>());
        let is_near = |fit: &Fit, start: &Option<Shape>| start.is_some_and(|start| (fit.shape.cycles(0.0) - start.cycles(0.0)).abs() < FARTHEST);
        let near = fits.into_iter().zip(starts).map(|(fit, start)| fit.filter(|fit| is_near(fit, start)));
        let with_noise = |fit: Fit, noise_m: f64| Fit { rest: Rest { beside_m: noise_m.max(self.least_m), ..fit.rest }, ..fit };
        near.zip(noise_m).map(|(fit, noise_m)| fit.map(|fit| with_noise(fit, noise_m))).collect()
    }

    /// The fits with a rate that changes where the rates half a segment before and after say that it moves the frequency.
    fn bent(&self, fits: &[Option<Fit>]) -> Vec<Option<Fit>> {
        let (weights, noise) = (weights(self.layout.frames), self.noise());
        let bent = |c: usize| {
            let fit = fits[c]?;
            let (before, after) = self.around(c);
            let (Some(earlier), Some(later)) = (&fits[before], &fits[after]) else { return Some(fit) };
            let bend = (later.shape.change() - earlier.shape.change()) / self.segments_apart(before, after).max(f64::MIN_POSITIVE);
            if (BEND * bend).abs() <= MATTERS * fit.unit_sd * fit.rest.beside_m {
                return Some(fit);
            }
            let samples = self.segment(c)?;
            let found = Segment { samples, weights: &weights }.fit::<CURVED>(fit.shape.bent(bend));
            let near = found.filter(|found| (found.shape.cycles(0.0) - fit.shape.cycles(0.0)).abs() < FARTHEST);
            let with_rest = |found: &Fitted<CURVED>| Rest { under_m: noise.rest(samples, &found.shape).under_m, ..fit.rest };
            Some(near.map_or(fit, |found| Fit::of(&found, with_rest(&found))))
        };
        (0..fits.len()).map(bent).collect()
    }

    /// Amplitude over that of noise which noise alone reaches anywhere in band and record with the chance [`FALSE_ALARM`].
    fn detection(&self) -> f64 {
        let resolutions = (self.band_hz.1 - self.band_hz.0) / self.resolution_hz;
        let segments = self.samples.len() as f64 / self.layout.frames as f64;
        ((TRIALS * resolutions * segments).max(1.0) / FALSE_ALARM).ln().sqrt()
    }

    fn point(&self, column: usize, fit: &Fit) -> Option<RidgePoint> {
        let window = window::Sums::of(&window::hann(self.segment(column)?));
        let in_bin_m = 2.0 * fit.rest.beside_m * window.second.sqrt() / window.first;
        let level = fit.shape.amplitude() / in_bin_m;
        let frequency_hz = fit.shape.cycles(0.0) * self.resolution_hz;
        let inside = frequency_hz >= self.band_hz.0 && frequency_hz <= self.band_hz.1;
        (inside && !fit.shape.vanishes() && level >= self.detection()).then(|| RidgePoint {
            time_s: self.layout.centre(column) / self.frame_rate_hz,
            frequency_hz,
            frequency_sd_hz: (fit.unit_sd * fit.noise_m() * self.resolution_hz).hypot(LEAKS * self.resolution_hz),
            rate_hz_per_s: fit.shape.change() * self.resolution_hz * self.resolution_hz,
            amplitude_m: fit.shape.amplitude(),
            snr_db: 20.0 * level.log10(),
        })
    }

    /// The frequency at the end of the record that a column is next to, by a fit of its own to a longer stretch, whose rate may change: half
    /// a segment farther out, the deviation of a straight course would be smaller, and wrong.
    fn end(&self, column: usize, fit: &Fit) -> Option<RidgeEnd> {
        let frames = ((END_SEGMENTS * self.layout.frames as f64) as usize).min(self.samples.len());
        let at_start = column == 0;
        let first = if at_start { 0 } else { self.samples.len() - frames };
        let longer = frames as f64 / self.layout.frames as f64;
        let away = (first as f64 + (frames as f64 - 1.0) / 2.0 - self.layout.centre(column)) / self.layout.frames as f64; // segments
        let middle = fit.shape.cycles(0.0);
        let start = Shape::start((middle + away * fit.shape.change()) * longer, fit.shape.change() * longer * longer);
        let found = Segment { samples: self.samples.get(first..first + frames)?, weights: &weights(frames) }.fit::<CURVED>(start)?;
        let agrees = (found.shape.cycles(-2.0 * away / longer) / longer - middle).abs() < AGREES;
        let x = (1.0 - 1.0 / frames as f64) * if at_start { -1.0 } else { 1.0 };
        let resolution_hz = self.frame_rate_hz / frames as f64;
        agrees.then(|| RidgeEnd {
            time_s: if at_start { 0.0 } else { (self.samples.len() - 1) as f64 / self.frame_rate_hz },
            frequency_hz: found.shape.cycles(x) * resolution_hz,
            frequency_sd_hz: (found.cycles_variance(x).sqrt() * fit.noise_m() * resolution_hz).hypot(LEAKS * self.resolution_hz),
        })
    }
}

/// Weights of a fit: a sine, the root of a Hann window. It keeps components five resolutions away below a hundredth and costs less of the
/// frames' information than the Hann window does.
fn weights(frames: usize) -> Vec<f64> {
    window::hann(&vec![Some(0.0); frames]).into_iter().map(f64::sqrt).collect()
}
