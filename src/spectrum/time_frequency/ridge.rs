//! The ridge: a path through the columns, each of its points refined on the frames of its segment.

use super::chirp::{CURVED, Fitted, LINEAR, Segment, Shape};
use super::columns::Bins;
use super::noise::{Noise, median, smoothed};
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
const END_SEGMENTS: f64 = 1.5;
/// Deviations by which a change of the rate must differ from nothing to be used.
const MATTERS: f64 = 3.0;
/// Farthest that the fit at an end may lie from the ridge in the middle of its outermost segment, resolutions.
const AGREES: f64 = 0.25;

/// A point of a ridge: the middle of a segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RidgePoint {
    /// Time from the first frame of the record, s.
    pub time_s: f64,
    /// Frequency at that time, Hz.
    pub frequency_hz: f64,
    /// Its standard deviation, Hz, from the noise beside the component and, as a hundredth of what segments resolve is the least that can be
    /// trusted among other components, a share of the resolution.
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
    /// a hundred records, in at least three segments in a row; elsewhere the ridge is interrupted.
    pub points: Vec<RidgePoint>,
    /// The frequency at the first frame, if the ridge reaches the first segment.
    pub start: Option<RidgeEnd>,
    /// The frequency at the last frame, if the ridge reaches the last segment.
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
struct Fit {
    fitted: Fitted<LINEAR>,
    /// Noise of a frame, m.
    noise_m: f64,
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
    let fits = tracker.fits(&tracker.starts(spectrogram));
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
    /// Where the path through the columns has each fit start.
    fn starts(&self, spectrogram: &Spectrogram) -> Vec<Shape> {
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
        let near = (self.layout.frames / (2 * self.layout.hop)).max(1);
        let start = |c: usize| {
            let (before, after) = (c.saturating_sub(near), (c + near).min(path.len() - 1));
            let apart = (after - before) as f64 * self.layout.hop as f64 / segment;
            Shape::start(cycles(c), if apart > 0.0 { (cycles(after) - cycles(before)) / apart } else { 0.0 })
        };
        (0..path.len()).map(start).collect()
    }

    fn fits(&self, starts: &[Shape]) -> Vec<Option<Fit>> {
        let weights = weights(self.layout.frames);
        let noise = Noise::of(self.layout.frames, (self.band_hz.0 / self.resolution_hz, self.band_hz.1 / self.resolution_hz));
        let fit = |(c, start): (usize, &Shape)| {
            let samples = self.samples.get(self.layout.first(c)..self.layout.first(c) + self.layout.frames)?;
            let fitted = Segment { samples, weights: &weights }.fit::<LINEAR>(*start)?;
            let noise_m = noise.deviation(samples, &fitted.shape);
            let near = (fitted.shape.cycles(0.0) - start.cycles(0.0)).abs() < FARTHEST;
            Some((near.then_some(fitted), noise_m))
        };
        let fits: Vec<_> = starts.iter().enumerate().map(fit).collect();
        let noise_m = smoothed(&fits.iter().map(|fit| fit.as_ref().map(|fit| fit.1)).collect::<Vec<_>>());
        let with_noise = |(fit, noise_m): (Option<(Option<Fitted<LINEAR>>, f64)>, f64)| Some(Fit { fitted: fit?.0?, noise_m: f64::max(noise_m, self.least_m) });
        fits.into_iter().zip(noise_m).map(with_noise).collect()
    }

    /// Amplitude over that of noise which noise alone reaches anywhere in band and record with the chance [`FALSE_ALARM`].
    fn detection(&self) -> f64 {
        let resolutions = (self.band_hz.1 - self.band_hz.0) / self.resolution_hz;
        let segments = self.samples.len() as f64 / self.layout.frames as f64;
        ((TRIALS * resolutions * segments).max(1.0) / FALSE_ALARM).ln().sqrt()
    }

    fn point(&self, column: usize, fit: &Fit) -> Option<RidgePoint> {
        let first = self.layout.first(column);
        let window = window::Sums::of(&window::hann(self.samples.get(first..first + self.layout.frames)?));
        let in_bin_m = 2.0 * fit.noise_m * window.second.sqrt() / window.first;
        let (shape, level) = (fit.fitted.shape, fit.fitted.shape.amplitude() / in_bin_m);
        let frequency_hz = shape.cycles(0.0) * self.resolution_hz;
        let inside = frequency_hz >= self.band_hz.0 && frequency_hz <= self.band_hz.1;
        (inside && level >= self.detection()).then(|| RidgePoint {
            time_s: self.layout.centre(column) / self.frame_rate_hz,
            frequency_hz,
            frequency_sd_hz: self.deviation_hz(&fit.fitted, 0.0, fit.noise_m, self.resolution_hz),
            rate_hz_per_s: shape.change() * self.resolution_hz * self.resolution_hz,
            amplitude_m: shape.amplitude(),
            snr_db: 20.0 * level.log10(),
        })
    }

    fn deviation_hz<const N: usize>(&self, fitted: &Fitted<N>, x: f64, noise_m: f64, resolution_hz: f64) -> f64 {
        (fitted.cycles_variance(x).sqrt() * noise_m * resolution_hz).hypot(LEAKS * self.resolution_hz)
    }

    /// The frequency at the end of the record that a column is next to, by a fit of its own to a longer stretch, whose rate may change.
    fn end(&self, column: usize, fit: &Fit) -> Option<RidgeEnd> {
        let frames = ((END_SEGMENTS * self.layout.frames as f64) as usize).min(self.samples.len());
        let at_start = column == 0;
        let first = if at_start { 0 } else { self.samples.len() - frames };
        let samples = self.samples.get(first..first + frames)?;
        let (weights, longer) = (weights(frames), frames as f64 / self.layout.frames as f64);
        let segment = Segment { samples, weights: &weights };
        let shape = fit.fitted.shape;
        let away = (first as f64 + (frames as f64 - 1.0) / 2.0 - self.layout.centre(column)) / self.layout.frames as f64; // segments
        let start = Shape::start((shape.cycles(0.0) + away * shape.change()) * longer, shape.change() * longer * longer);
        let resolution_hz = self.frame_rate_hz / frames as f64;
        let x = (1.0 - 1.0 / frames as f64) * if at_start { -1.0 } else { 1.0 };
        let carried = |shape: Shape, sd_hz: f64| {
            let there = shape.cycles(-2.0 * away / longer) * resolution_hz; // in the middle of the column
            let agrees = (there - fit.fitted.shape.cycles(0.0) * self.resolution_hz).abs() < AGREES * self.resolution_hz;
            let time_s = if at_start { 0.0 } else { (self.samples.len() - 1) as f64 / self.frame_rate_hz };
            agrees.then(|| RidgeEnd { time_s, frequency_hz: shape.cycles(x) * resolution_hz, frequency_sd_hz: sd_hz })
        };
        let curved = segment.fit::<CURVED>(start).filter(|fitted| fitted.last_matters(MATTERS, fit.noise_m));
        match curved {
            Some(fitted) => carried(fitted.shape, self.deviation_hz(&fitted, x, fit.noise_m, resolution_hz)),
            None => segment.fit::<LINEAR>(start).and_then(|fitted| carried(fitted.shape, self.deviation_hz(&fitted, x, fit.noise_m, resolution_hz))),
        }
    }
}

/// Weights of a fit: a sine, the root of a Hann window. It keeps components five resolutions away below a hundredth and costs less of the
/// frames' information than the Hann window does.
fn weights(frames: usize) -> Vec<f64> {
    window::hann(&vec![Some(0.0); frames]).into_iter().map(f64::sqrt).collect()
}
