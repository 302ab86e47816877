//! The points of a ridge: fits to the segments, and to the ends of the record, from the path through the
//! columns.

use super::chirp::{CURVED, Fitted, LINEAR, Segment, Shape};
use super::columns::Bins;
use super::noise::{Noise, Rest, median, smoothed};
use super::path::Field;
use super::ridge::{RidgeEnd, RidgePoint};
use super::segment::Layout;
use super::spectrogram::Spectrogram;
use crate::math;
use crate::spectrum::limits::ROUNDING;
use crate::spectrum::window;

/// Chance that noise alone puts one point on a ridge.
const FALSE_ALARM: f64 = 0.01;
/// Independent trials in each resolution of each segment: the maxima of overlapping columns, fitted, are more
/// than their independent values.
const TRIALS: f64 = 10.0;
/// Farthest a fit moves from the path, resolutions: half way down the lobe of a Hann window.
const FARTHEST: f64 = 1.0;
/// Deviation of a frequency that noise does not explain, resolutions: what other components leak into a fit.
const LEAKS: f64 = 0.002;
/// The same at the end of a fit whose rate may change, resolutions of that fit.
const END_LEAKS: f64 = 0.01;
/// Lengths of the fits at an end of the record, segments: the change of the rate takes a longer stretch than
/// the rate.
const END_SEGMENTS: [f64; 6] = [1.75, 1.3, 1.0, 0.75, 0.55, 0.4];
/// Fewest cycles in a fit there that is shorter than a segment: others leak into short ones.
const END_CYCLES: f64 = 8.0;
/// Deviations of their difference from which a shorter fit contradicts a longer one.
const CONTRADICTS: f64 = 3.5;
/// What a changing rate adds to the fitted frequency with the sine weights, over its change from one segment
/// to the next: `<x^4>/<x^2>/24`.
const BEND: f64 = 0.4154 / 24.0;
/// Deviations of the frequency from which on the rate of a point may change too.
const MATTERS: f64 = 0.5;
/// Farthest that the fit at an end may lie from the ridge in the middle of its outermost segment,
/// resolutions.
const AGREES: f64 = 0.25;

/// A fitted column.
#[derive(Clone, Copy)]
pub(super) struct Fit {
    shape: Shape,
    /// Deviation of the frequency for a noise of deviation 1 in each frame, cycles in the segment.
    unit_sd: f64,
    /// What the fit leaves in a frame next to the component and where it was, m.
    rest: Rest,
}

impl Fit {
    fn of<const N: usize>(fitted: &Fitted<N>, rest: Rest) -> Self {
        Self { shape: fitted.shape, unit_sd: fitted.cycles_variance(0.0).sqrt(), rest }
    }

    /// Noise that the deviations of the fit follow from, m.
    fn noise_m(&self) -> f64 {
        self.rest.around_m.max(self.rest.under_m)
    }
}

/// What the fits share.
pub(super) struct Tracker<'a> {
    samples: &'a [Option<f64>],
    layout: Layout,
    frame_rate_hz: f64,
    resolution_hz: f64,
    band_hz: (f64, f64),
    /// Noise below is rounding, m.
    least_m: f64,
}

impl<'a> Tracker<'a> {
    pub(super) fn of(spectrogram: &Spectrogram, samples: &'a [Option<f64>], band_hz: (f64, f64)) -> Self {
        let largest = samples.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
        Self {
            samples,
            layout: spectrogram.layout,
            frame_rate_hz: spectrogram.frame_rate_hz,
            resolution_hz: spectrogram.resolution_hz,
            band_hz,
            least_m: (ROUNDING * largest).max(f64::MIN_POSITIVE),
        }
    }

    /// Where the path through the columns has each fit start; `None` where there is no spectrum.
    pub(super) fn starts(&self, spectrogram: &Spectrogram) -> Vec<Option<Shape>> {
        let bins = Bins::of(&self.layout);
        let band = bins.within(self.band_hz, self.frame_rate_hz);
        let level = |column: &Vec<f64>| {
            let inside = column.get(band.clone()).unwrap_or_default();
            let middle = median(inside.to_vec()).unwrap_or(0.0).max(self.least_m);
            inside.iter().map(|a| a / middle).collect::<Vec<f64>>()
        };
        let levels: Vec<_> =
            spectrogram.amplitude_m.iter().map(|column| column.as_ref().map(level)).collect();
        let segment = self.layout.frames as f64;
        let bins_per_resolution = bins.padded as f64 / segment;
        let quarters = 4.0 * self.layout.hop as f64 / segment;
        let path =
            Field { levels: &levels, bins: band.clone().count(), bins_per_resolution, quarters }.best();
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
        Noise::of(
            self.layout.frames,
            (self.band_hz.0 / self.resolution_hz, self.band_hz.1 / self.resolution_hz),
        )
    }

    pub(super) fn fits(&self, starts: &[Option<Shape>]) -> Vec<Option<Fit>> {
        let (weights, noise) = (weights(self.layout.frames), self.noise());
        let fit = |(c, start): (usize, &Option<Shape>)| {
            let samples = self.segment(c)?;
            let fitted = Segment { samples, weights: &weights }.fit::<LINEAR>((*start)?)?;
            Some(Fit::of(&fitted, noise.rest(samples, &fitted.shape)))
        };
        let fits: Vec<Option<Fit>> = starts.iter().enumerate().map(fit).collect();
        let noise_m = smoothed(&fits.iter().map(|fit| fit.map(|fit| fit.rest.around_m)).collect::<Vec<_>>());
        let is_near = |fit: &Fit, start: &Option<Shape>| {
            start.is_some_and(|start| (fit.shape.cycles(0.0) - start.cycles(0.0)).abs() < FARTHEST)
        };
        let near = fits.into_iter().zip(starts).map(|(fit, start)| fit.filter(|fit| is_near(fit, start)));
        let with_noise = |fit: Fit, noise_m: f64| Fit {
            rest: Rest { around_m: noise_m.max(self.least_m), ..fit.rest },
            ..fit
        };
        near.zip(noise_m).map(|(fit, noise_m)| fit.map(|fit| with_noise(fit, noise_m))).collect()
    }

    /// The fits, with one from where the next column's would have been a segment's hop earlier, or the last
    /// one's later, where the path led to none: the spectrum of a fast chirp is flat on top.
    pub(super) fn repaired(&self, fits: &[Option<Fit>]) -> Vec<Option<Fit>> {
        let (weights, noise) = (weights(self.layout.frames), self.noise());
        let from = |c: usize, near: usize, segments: f64| {
            let (samples, neighbour) = (self.segment(c)?, (*fits.get(near)?)?);
            let cycles = neighbour.shape.cycles(0.0) + segments * neighbour.shape.change();
            let found = Segment { samples, weights: &weights }
                .fit::<LINEAR>(Shape::start(cycles, neighbour.shape.change()))?;
            let under_m = noise.rest(samples, &found.shape).under_m;
            ((found.shape.cycles(0.0) - cycles).abs() < FARTHEST)
                .then(|| Fit::of(&found, Rest { under_m, ..neighbour.rest }))
        };
        let hop = self.segments_apart(0, 1);
        let mend =
            |c: usize| fits[c].or_else(|| from(c, c + 1, -hop)).or_else(|| from(c, c.checked_sub(1)?, hop));
        (0..fits.len()).map(mend).collect()
    }

    /// The fits with a rate that changes where the rates half a segment before and after say that it moves
    /// the frequency.
    pub(super) fn bent(&self, fits: &[Option<Fit>]) -> Vec<Option<Fit>> {
        let (weights, noise) = (weights(self.layout.frames), self.noise());
        let bent = |c: usize| {
            let fit = fits[c]?;
            let (before, after) = self.around(c);
            let (Some(earlier), Some(later)) = (&fits[before], &fits[after]) else { return Some(fit) };
            let bend = (later.shape.change() - earlier.shape.change())
                / self.segments_apart(before, after).max(f64::MIN_POSITIVE);
            if (BEND * bend).abs() <= MATTERS * fit.unit_sd * fit.rest.around_m {
                return Some(fit);
            }
            let samples = self.segment(c)?;
            let found = Segment { samples, weights: &weights }.fit::<CURVED>(fit.shape.bent(bend));
            let near =
                found.filter(|found| (found.shape.cycles(0.0) - fit.shape.cycles(0.0)).abs() < FARTHEST);
            let with_rest = |found: &Fitted<CURVED>| Rest {
                under_m: noise.rest(samples, &found.shape).under_m,
                ..fit.rest
            };
            Some(near.map_or(fit, |found| Fit::of(&found, with_rest(&found))))
        };
        (0..fits.len()).map(bent).collect()
    }

    /// Amplitude over that of noise which noise alone reaches anywhere in band and record with the chance
    /// [`FALSE_ALARM`].
    fn detection(&self) -> f64 {
        let resolutions = (self.band_hz.1 - self.band_hz.0) / self.resolution_hz;
        let segments = self.samples.len() as f64 / self.layout.frames as f64;
        math::ln((TRIALS * resolutions * segments).max(1.0) / FALSE_ALARM).sqrt()
    }

    pub(super) fn point(&self, column: usize, fit: &Fit) -> Option<RidgePoint> {
        let window = window::Sums::of(&window::hann(self.segment(column)?));
        let in_bin_m = 2.0 * fit.rest.around_m * window.second.sqrt() / window.first;
        let level = fit.shape.amplitude() / in_bin_m;
        let frequency_hz = fit.shape.cycles(0.0) * self.resolution_hz;
        let inside = frequency_hz >= self.band_hz.0 && frequency_hz <= self.band_hz.1;
        (inside && !fit.shape.vanishes() && level >= self.detection()).then(|| RidgePoint {
            time_s: self.layout.centre(column) / self.frame_rate_hz,
            frequency_hz,
            frequency_sd_hz: math::hypot(
                fit.unit_sd * fit.noise_m() * self.resolution_hz,
                LEAKS * self.resolution_hz,
            ),
            rate_hz_per_s: fit.shape.change() * self.resolution_hz * self.resolution_hz,
            amplitude_m: fit.shape.amplitude(),
            phase_rad: fit.shape.phase(),
            snr_db: 20.0 * math::log10(level),
            left: fit.rest.under_m / fit.rest.around_m / level,
        })
    }

    /// The frequency at the end of the record that a column is next to, by fits of their own whose rate may
    /// change: half a segment farther out, the deviation of a straight course would be smaller, and wrong. A
    /// long stretch knows it best, as far as the course is smooth there: the longest is taken with which all
    /// shorter ones agree. The shortest, which others leak into most, only confirms.
    pub(super) fn end(&self, column: usize, fit: &Fit) -> Option<RidgeEnd> {
        let ends: Vec<RidgeEnd> =
            END_SEGMENTS.into_iter().filter_map(|segments| self.carried(column, fit, segments)).collect();
        // the noise of the longer one is a part of that of the shorter one
        let agree = |longer: &RidgeEnd, shorter: &RidgeEnd| {
            let variance = math::powi(shorter.frequency_sd_hz, 2) - math::powi(longer.frequency_sd_hz, 2);
            (longer.frequency_hz - shorter.frequency_hz).abs() <= CONTRADICTS * variance.max(0.0).sqrt()
        };
        let confirmed = ends
            .iter()
            .enumerate()
            .find(|(k, end)| k + 1 < ends.len() && ends[k + 1..].iter().all(|shorter| agree(end, shorter)));
        confirmed.map(|(_, end)| end).or(ends.first()).copied()
    }

    fn carried(&self, column: usize, fit: &Fit, segments: f64) -> Option<RidgeEnd> {
        let frames = ((segments * self.layout.frames as f64) as usize).min(self.samples.len());
        let at_start = column == 0;
        let first = if at_start { 0 } else { self.samples.len() - frames };
        let longer = frames as f64 / self.layout.frames as f64;
        let away = (first as f64 + (frames as f64 - 1.0) / 2.0 - self.layout.centre(column))
            / self.layout.frames as f64; // segments
        let middle = fit.shape.cycles(0.0);
        let led = (middle + away * fit.shape.change()) * longer;
        if segments < 1.0 && led < END_CYCLES {
            return None;
        }
        let start = Shape::start(led, fit.shape.change() * longer * longer);
        let samples = self.samples.get(first..first + frames)?;
        let found = Segment { samples, weights: &weights(frames) }.fit::<CURVED>(start)?;
        let agrees = if longer < 1.0 {
            (found.shape.cycles(0.0) - led).abs() < FARTHEST
        } else {
            (found.shape.cycles(-2.0 * away / longer) / longer - middle).abs() < AGREES
        };
        let x = (1.0 - 1.0 / frames as f64) * if at_start { -1.0 } else { 1.0 };
        let resolution_hz = self.frame_rate_hz / frames as f64;
        let band = (self.band_hz.0 / resolution_hz, self.band_hz.1 / resolution_hz);
        let under_m = Noise::of(frames, band).rest(samples, &found.shape).under_m;
        let noise_m = fit.noise_m().max(under_m);
        (agrees && !found.shape.vanishes()).then(|| RidgeEnd {
            time_s: if at_start { 0.0 } else { (self.samples.len() - 1) as f64 / self.frame_rate_hz },
            frequency_hz: found.shape.cycles(x) * resolution_hz,
            frequency_sd_hz: math::hypot(
                found.cycles_variance(x).sqrt() * noise_m * resolution_hz,
                END_LEAKS * resolution_hz,
            ),
        })
    }
}

/// Weights of a fit: a sine, the root of a Hann window. It keeps components five resolutions away below a
/// hundredth and costs less of the frames' information than the Hann window does.
fn weights(frames: usize) -> Vec<f64> {
    window::hann(&vec![Some(0.0); frames]).into_iter().map(f64::sqrt).collect()
}
