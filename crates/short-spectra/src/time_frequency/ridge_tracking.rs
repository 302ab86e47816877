//! The points of a ridge: fits to the segments and to the ends of the record. The fits start from the best
//! path through the columns of the spectrogram.

use super::chirp::{
    CURVED_UNKNOWNS, Chirp, ChirpFit, ChirpSegment, LINEAR_UNKNOWNS, ResidualNoise, SegmentNoise,
    median_filter,
};
use super::ridge::{Ridge, RidgeEnd, RidgePoint};
use super::{FINE_PADDING, SegmentBins, SegmentLayout, Spectrogram};
use crate::error::SpectrumError;
use crate::periodogram::{self, upper_median};
use crate::settings::ROUNDING;
use portable_math as math;

/// Allowed probability that noise alone causes any point of a ridge in a record.
const FALSE_ALARM: f64 = 0.01;
/// Number of independent trials per resolution of each segment: overlapping columns have more maxima than
/// independent values.
const TRIALS: f64 = 10.0;
/// Largest allowed distance, in resolutions, of a fitted frequency from the path: half way down the lobe of a
/// Hann window.
const FARTHEST_FROM_PATH: f64 = 1.0;
/// Standard deviation, in resolutions, of a frequency due to leakage of other components into a fit.
const LEAKAGE_SD: f64 = 0.002;
/// Standard deviation, in resolutions of the fit, that leakage causes in the frequency at the end of a fit
/// whose rate may change.
const END_LEAKAGE_SD: f64 = 0.01;
/// Lengths, in segment lengths, of the fits at an end of the record. To estimate the change of the rate takes
/// a longer stretch than to estimate the rate.
const END_SEGMENTS: [f64; 6] = [1.75, 1.3, 1.0, 0.75, 0.55, 0.4];
/// Minimum number of cycles in a fit at an end that is shorter than a segment: other components leak into
/// short fits.
const END_CYCLES: f64 = 8.0;
/// Largest allowed difference between the frequencies of a shorter and a longer fit, in standard deviations
/// of the difference. A larger difference contradicts the longer fit.
const CONTRADICTS: f64 = 3.5;
/// Bias of a fitted frequency due to a changing rate, divided by the change of the rate from one segment to
/// the next: `<x^4>/<x^2>/24` for the sine weights.
const CURVATURE_BIAS: f64 = 0.4154 / 24.0;
/// If a changing rate causes a bias of the frequency larger than this multiple of the standard deviation of
/// the frequency, a point is fitted with a changing rate.
const SIGNIFICANT_CURVATURE: f64 = 0.5;
/// Largest allowed difference, in resolutions, between the frequency of the ridge at the centre of its
/// outermost segment and that of a fit at the end of the record. Applies to fits of at least one segment.
const END_AGREEMENT: f64 = 0.25;

#[derive(Clone, Copy)]
pub(super) struct SegmentFit {
    chirp: Chirp,
    /// Standard deviation, in cycles in the segment, of the frequency for noise of standard deviation 1 in
    /// each frame.
    unit_sd: f64,
    /// Residual per frame, m: at frequencies next to the component, and at the component's own frequency.
    residual: ResidualNoise,
}

impl SegmentFit {
    fn from_chirp<const N: usize>(fitted: &ChirpFit<N>, residual: ResidualNoise) -> Self {
        Self { chirp: fitted.parameters, unit_sd: fitted.cycles_variance(0.0).sqrt(), residual }
    }

    /// Standard deviation, m, of the noise from which the standard deviations of the fitted parameters
    /// follow.
    fn noise_m(&self) -> f64 {
        self.residual.around_m.max(self.residual.under_m)
    }
}

/// A record and the layout of the segments that are fitted.
pub(super) struct RidgeTracker<'a> {
    samples: &'a [Option<f64>],
    layout: SegmentLayout,
    frame_rate_hz: f64,
    resolution_hz: f64,
    band_hz: (f64, f64),
    /// Lower limit of the noise, m; smaller noise is rounding error.
    least_m: f64,
}

impl<'a> RidgeTracker<'a> {
    pub(super) fn new(spectrogram: &Spectrogram, samples: &'a [Option<f64>], band_hz: (f64, f64)) -> Self {
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

    /// Start of the fit of each column, on the path through the columns; `None` for a column without a
    /// spectrum.
    pub(super) fn fit_starts(&self, spectrogram: &Spectrogram) -> Vec<Option<Chirp>> {
        let bins = SegmentBins::new(&self.layout, FINE_PADDING);
        let band = bins.bins_in_band(self.band_hz, self.frame_rate_hz);
        let level = |column: &Vec<f64>| {
            let inside = column.get(band.clone()).unwrap_or_default();
            let middle = upper_median(inside.to_vec()).unwrap_or(0.0).max(self.least_m);
            inside.iter().map(|a| a / middle).collect::<Vec<f64>>()
        };
        let levels: Vec<_> =
            spectrogram.amplitude_m.iter().map(|column| column.as_ref().map(level)).collect();
        let segment = self.layout.frames as f64;
        let bins_per_resolution = bins.padded as f64 / segment;
        let quarters = 4.0 * self.layout.hop as f64 / segment;
        let bin_count = band.clone().count();
        let path = PathLevels { levels: &levels, bins: bin_count, bins_per_resolution, quarters }.best_path();
        let cycles = |c: usize| (band.start() + path[c]) as f64 / bins_per_resolution;
        let start = |c: usize| {
            let (before, after) = self.columns_around(c);
            let apart = self.segments_apart(before, after);
            let change = if apart > 0.0 { (cycles(after) - cycles(before)) / apart } else { 0.0 };
            Chirp::from_cycles(cycles(c), change)
        };
        (0..path.len()).map(|c| levels[c].as_ref().map(|_| start(c))).collect()
    }

    /// The columns half a segment before and after `column`, or the outermost ones.
    fn columns_around(&self, column: usize) -> (usize, usize) {
        let near = (self.layout.frames / (2 * self.layout.hop)).max(1);
        (column.saturating_sub(near), (column + near).min(self.layout.columns - 1))
    }

    fn segments_apart(&self, before: usize, after: usize) -> f64 {
        (after - before) as f64 * self.layout.hop as f64 / self.layout.frames as f64
    }

    fn segment_samples(&self, column: usize) -> Option<&[Option<f64>]> {
        let first = self.layout.first_frame(column);
        self.samples.get(first..first + self.layout.frames)
    }

    fn segment_noise(&self) -> SegmentNoise {
        let band = (self.band_hz.0 / self.resolution_hz, self.band_hz.1 / self.resolution_hz);
        SegmentNoise::new(self.layout.frames, band)
    }

    pub(super) fn fit_segments(&self, starts: &[Option<Chirp>]) -> Vec<Option<SegmentFit>> {
        let (weights, noise) = (sine_weights(self.layout.frames), self.segment_noise());
        let fit = |(c, start): (usize, &Option<Chirp>)| {
            let samples = self.segment_samples(c)?;
            let segment = ChirpSegment { samples, weights: &weights };
            let fitted = segment.fit_chirp::<LINEAR_UNKNOWNS>((*start)?)?;
            Some(SegmentFit::from_chirp(&fitted, noise.measure_residual(samples, &fitted.parameters)))
        };
        let fits: Vec<Option<SegmentFit>> = starts.iter().enumerate().map(fit).collect();
        let around_m: Vec<Option<f64>> = fits.iter().map(|fit| Some((*fit)?.residual.around_m)).collect();
        let usable = |((fit, start), noise_m): ((Option<SegmentFit>, &Option<Chirp>), f64)| {
            let (fit, start) = (fit?, (*start)?);
            let residual = ResidualNoise { around_m: noise_m.max(self.least_m), ..fit.residual };
            is_near(&fit.chirp, start.cycles_at(0.0)).then_some(SegmentFit { residual, ..fit })
        };
        fits.into_iter().zip(starts).zip(median_filter(&around_m)).map(usable).collect()
    }

    /// Adds a fit to a column without a fit. It starts from the fit of a neighbouring column, because the
    /// spectrum of a fast chirp is flat on top and the path may miss it.
    pub(super) fn refit_from_neighbours(&self, fits: &[Option<SegmentFit>]) -> Vec<Option<SegmentFit>> {
        let (weights, noise) = (sine_weights(self.layout.frames), self.segment_noise());
        let from = |c: usize, near: usize, segments: f64| {
            let (samples, neighbour) = (self.segment_samples(c)?, (*fits.get(near)?)?);
            let cycles = neighbour.chirp.cycles_at(0.0) + segments * neighbour.chirp.change();
            let start = Chirp::from_cycles(cycles, neighbour.chirp.change());
            let segment = ChirpSegment { samples, weights: &weights };
            let found = segment.fit_chirp::<LINEAR_UNKNOWNS>(start)?;
            let under_m = noise.measure_residual(samples, &found.parameters).under_m;
            let residual = ResidualNoise { under_m, ..neighbour.residual };
            is_near(&found.parameters, cycles).then(|| SegmentFit::from_chirp(&found, residual))
        };
        let hop = self.segments_apart(0, 1);
        let mend =
            |c: usize| fits[c].or_else(|| from(c, c + 1, -hop)).or_else(|| from(c, c.checked_sub(1)?, hop));
        (0..fits.len()).map(mend).collect()
    }

    /// Repeats the fit of a column with a changing rate if the rates half a segment before and after it show
    /// a significant bias of the frequency.
    pub(super) fn refit_with_curvature(&self, fits: &[Option<SegmentFit>]) -> Vec<Option<SegmentFit>> {
        let (weights, noise) = (sine_weights(self.layout.frames), self.segment_noise());
        let bent = |c: usize| {
            let fit = fits[c]?;
            let (before, after) = self.columns_around(c);
            let (Some(earlier), Some(later)) = (&fits[before], &fits[after]) else { return Some(fit) };
            let bend = (later.chirp.change() - earlier.chirp.change())
                / self.segments_apart(before, after).max(f64::MIN_POSITIVE);
            if (CURVATURE_BIAS * bend).abs() <= SIGNIFICANT_CURVATURE * fit.unit_sd * fit.residual.around_m {
                return Some(fit);
            }
            let samples = self.segment_samples(c)?;
            let segment = ChirpSegment { samples, weights: &weights };
            let found = segment.fit_chirp::<CURVED_UNKNOWNS>(fit.chirp.with_curvature(bend));
            let near = found.filter(|found| is_near(&found.parameters, fit.chirp.cycles_at(0.0)));
            let with_rest = |found: ChirpFit<CURVED_UNKNOWNS>| {
                let under_m = noise.measure_residual(samples, &found.parameters).under_m;
                SegmentFit::from_chirp(&found, ResidualNoise { under_m, ..fit.residual })
            };
            Some(near.map_or(fit, with_rest))
        };
        (0..fits.len()).map(bent).collect()
    }

    /// Ratio of amplitude to noise that noise alone reaches anywhere in the band and the record with the
    /// probability [`FALSE_ALARM`].
    fn detection_threshold(&self) -> f64 {
        let resolutions = (self.band_hz.1 - self.band_hz.0) / self.resolution_hz;
        let segments = self.samples.len() as f64 / self.layout.frames as f64;
        math::ln((TRIALS * resolutions * segments).max(1.0) / FALSE_ALARM).sqrt()
    }

    pub(super) fn ridge_point(&self, column: usize, fit: &SegmentFit) -> Option<RidgePoint> {
        let weights = periodogram::hann_weights(self.segment_samples(column)?);
        let window = periodogram::WindowSums::from_weights(&weights);
        let in_bin_m = 2.0 * fit.residual.around_m * window.second.sqrt() / window.first;
        let level = fit.chirp.amplitude() / in_bin_m;
        let frequency_hz = fit.chirp.cycles_at(0.0) * self.resolution_hz;
        let inside = frequency_hz >= self.band_hz.0 && frequency_hz <= self.band_hz.1;
        let noise_sd_hz = fit.unit_sd * fit.noise_m() * self.resolution_hz;
        (inside && !fit.chirp.vanishes() && level >= self.detection_threshold()).then(|| RidgePoint {
            time_s: self.layout.centre_frame(column) / self.frame_rate_hz,
            frequency_hz,
            frequency_sd_hz: math::hypot(noise_sd_hz, LEAKAGE_SD * self.resolution_hz),
            rate_hz_per_s: fit.chirp.change() * self.resolution_hz * self.resolution_hz,
            amplitude_m: fit.chirp.amplitude(),
            phase_rad: fit.chirp.phase(),
            snr_db: 20.0 * math::log10(level),
            residual_ratio: fit.residual.under_m / fit.residual.around_m / level,
        })
    }

    /// The frequency at the end of the record next to a column, by separate fits with a changing rate.
    /// Extrapolating a constant rate by half a segment would give a smaller standard deviation, but a wrong
    /// frequency. A longer fit is more accurate while the course is smooth, so the longest fit is taken with
    /// which all shorter fits agree. The shortest fit only confirms longer ones, because other components
    /// leak into it most.
    pub(super) fn ridge_end(&self, column: usize, fit: &SegmentFit) -> Option<RidgeEnd> {
        let end = |segments: f64| self.extrapolate_to_end(column, fit, segments);
        let ends: Vec<RidgeEnd> = END_SEGMENTS.into_iter().filter_map(end).collect();
        // variances subtract, because the shorter fit contains the noise of the longer fit
        let agree = |longer: &RidgeEnd, shorter: &RidgeEnd| {
            let variance = math::powi(shorter.frequency_sd_hz, 2) - math::powi(longer.frequency_sd_hz, 2);
            (longer.frequency_hz - shorter.frequency_hz).abs() <= CONTRADICTS * variance.max(0.0).sqrt()
        };
        let confirmed = |k: &usize| ends[k + 1..].iter().all(|shorter| agree(&ends[*k], shorter));
        let longest = (0..ends.len().saturating_sub(1)).find(confirmed);
        longest.map(|k| &ends[k]).or(ends.first()).copied()
    }

    fn extrapolate_to_end(&self, column: usize, fit: &SegmentFit, segments: f64) -> Option<RidgeEnd> {
        let frames = ((segments * self.layout.frames as f64) as usize).min(self.samples.len());
        let at_start = column == 0;
        let first = if at_start { 0 } else { self.samples.len() - frames };
        let longer = frames as f64 / self.layout.frames as f64;
        let away = (first as f64 + (frames as f64 - 1.0) / 2.0 - self.layout.centre_frame(column))
            / self.layout.frames as f64; // segments
        let middle = fit.chirp.cycles_at(0.0);
        let led = (middle + away * fit.chirp.change()) * longer;
        if segments < 1.0 && led < END_CYCLES {
            return None;
        }
        let start = Chirp::from_cycles(led, fit.chirp.change() * longer * longer);
        let samples = self.samples.get(first..first + frames)?;
        let segment = ChirpSegment { samples, weights: &sine_weights(frames) };
        let found = segment.fit_chirp::<CURVED_UNKNOWNS>(start)?;
        let agrees = if longer < 1.0 {
            is_near(&found.parameters, led)
        } else {
            (found.parameters.cycles_at(-2.0 * away / longer) / longer - middle).abs() < END_AGREEMENT
        };
        let x = (1.0 - 1.0 / frames as f64) * if at_start { -1.0 } else { 1.0 };
        let resolution_hz = self.frame_rate_hz / frames as f64;
        let band = (self.band_hz.0 / resolution_hz, self.band_hz.1 / resolution_hz);
        let under_m = SegmentNoise::new(frames, band).measure_residual(samples, &found.parameters).under_m;
        let noise_m = fit.noise_m().max(under_m);
        let noise_sd_hz = found.cycles_variance(x).sqrt() * noise_m * resolution_hz;
        (agrees && !found.parameters.vanishes()).then(|| RidgeEnd {
            time_s: if at_start { 0.0 } else { (self.samples.len() - 1) as f64 / self.frame_rate_hz },
            frequency_hz: found.parameters.cycles_at(x) * resolution_hz,
            frequency_sd_hz: math::hypot(noise_sd_hz, END_LEAKAGE_SD * resolution_hz),
        })
    }
}

/// Whether a fit stays near a frequency, cycles in the segment.
fn is_near(chirp: &Chirp, cycles: f64) -> bool {
    (chirp.cycles_at(0.0) - cycles).abs() < FARTHEST_FROM_PATH
}

/// Weights of a fit: a sine, the root of a Hann window. It suppresses components five resolutions away below
/// a hundredth and loses less of the frames' information than the Hann window.
fn sine_weights(frames: usize) -> Vec<f64> {
    periodogram::hann_weights(&vec![Some(0.0); frames]).into_iter().map(f64::sqrt).collect()
}

// The ridge through the columns of a spectrogram.

/// Minimum number of consecutive points of a ridge; fewer cover hardly more of the record than a single one.
const FEWEST_POINTS: usize = 3;

impl Spectrogram {
    /// Course of the strongest component between two frequencies, Hz; `samples` is the record of this
    /// spectrogram. If no component stands out from the noise, the ridge has no points.
    ///
    /// # Errors
    /// [`SpectrumError::Band`] if the band contains no frequency of the spectrogram.
    pub fn find_ridge(&self, samples: &[Option<f64>], band_hz: (f64, f64)) -> Result<Ridge, SpectrumError> {
        let (low, high) = band_hz;
        let nyquist = self.frame_rate_hz / 2.0;
        if !(low >= 0.0 && low < high && low < nyquist) {
            return Err(SpectrumError::Band { low, high, nyquist });
        }
        Ok(follow_ridge(self, samples, (low, high.min(nyquist))))
    }
}

fn follow_ridge(spectrogram: &Spectrogram, samples: &[Option<f64>], band_hz: (f64, f64)) -> Ridge {
    let tracker = RidgeTracker::new(spectrogram, samples, band_hz);
    let fits = tracker.fit_segments(&tracker.fit_starts(spectrogram));
    let fits = tracker.refit_with_curvature(&tracker.refit_from_neighbours(&fits));
    let point = |(c, fit): (usize, &Option<SegmentFit>)| tracker.ridge_point(c, fit.as_ref()?);
    let points: Vec<Option<RidgePoint>> = fits.iter().enumerate().map(point).collect();
    let points = remove_short_runs(points);
    let end = |c: usize| points[c].and(fits[c].as_ref()).and_then(|fit| tracker.ridge_end(c, fit));
    Ridge {
        start: end(0),
        end: end(points.len() - 1),
        points: points.into_iter().flatten().collect(),
        segment_s: spectrogram.segment_s,
        hop_s: spectrogram.hop_s,
    }
}

/// Removes the points of runs that are too short for a ridge.
fn remove_short_runs(mut points: Vec<Option<RidgePoint>>) -> Vec<Option<RidgePoint>> {
    let fewest = FEWEST_POINTS.min(points.len());
    for run in points.chunk_by_mut(|a, b| a.is_some() == b.is_some()).filter(|run| run.len() < fewest) {
        run.fill(None);
    }
    points
}

// The best path through the columns (Viterbi): it maximises the sum of the levels minus the costs of jumps.

/// Standard deviation, in resolutions, of the change of frequency over a quarter of a segment. A drift of
/// half a resolution in a quarter of a segment moves the frequency by two resolutions within the segment,
/// about the maximum for a segment of the chosen length.
const JUMP_SD: f64 = 0.5;
/// Largest allowed jump of the path over a quarter of a segment, in units of `JUMP_SD`: six resolutions
/// within a segment.
const LONGEST_JUMP: f64 = 3.0;

/// Levels of the bins of the columns, and the distances of bins and columns.
pub(super) struct PathLevels<'a> {
    /// Ratios of amplitude to noise for each column in the band; `None` for a column without a spectrum.
    pub levels: &'a [Option<Vec<f64>>],
    /// Number of bins in the band.
    pub bins: usize,
    /// Number of bins in one resolution.
    pub bins_per_resolution: f64,
    /// Distance of the columns, quarters of a segment.
    pub quarters: f64,
}

impl PathLevels<'_> {
    /// The bin of each column on the best path. A level counts by the logarithm of its power, so that the
    /// path stays with a component that fades. A jump costs half the square of its size in standard
    /// deviations.
    pub(super) fn best_path(&self) -> Vec<usize> {
        let sd = (JUMP_SD * self.quarters * self.bins_per_resolution).max(1.0);
        let reach = ((LONGEST_JUMP * sd) as usize).clamp(1, self.bins);
        let costs: Vec<f64> = (0..=reach).map(|jump| 0.5 * math::powi(jump as f64 / sd, 2)).collect();
        let mut sums = vec![0.0; self.bins];
        let mut from: Vec<Vec<u32>> = Vec::with_capacity(self.levels.len());
        for (column, levels) in self.levels.iter().enumerate() {
            let came =
                if column == 0 { (0..self.bins as u32).collect() } else { advance_column(&mut sums, &costs) };
            from.push(came);
            if let Some(levels) = levels {
                sums.iter_mut().zip(levels).for_each(|(sum, level)| *sum += math::ln(1.0 + level * level));
            }
        }
        let greatest = |best: usize, bin: usize| if sums[bin] > sums[best] { bin } else { best };
        let mut bin = (0..self.bins).fold(0, greatest);
        let mut path: Vec<usize> = Vec::with_capacity(from.len());
        for came in from.iter().rev() {
            path.push(bin);
            bin = came[bin] as usize;
        }
        path.reverse();
        path
    }
}

/// Advances the sums of the path search by one column. Returns for each bin the bin of the previous column
/// from which its sum comes.
fn advance_column(sums: &mut Vec<f64>, costs: &[f64]) -> Vec<u32> {
    let bins = sums.len();
    let reach = costs.len() - 1;
    let came = |bin: usize| {
        let (low, high) = (bin.saturating_sub(reach), (bin + reach).min(bins - 1));
        let mut best = (sums[bin], bin);
        for (from, sum) in (low..=high).zip(&sums[low..=high]) {
            let moved = sum - costs[bin.abs_diff(from)];
            if moved > best.0 {
                best = (moved, from);
            }
        }
        best
    };
    let moved: Vec<(f64, usize)> = (0..bins).map(came).collect();
    *sums = moved.iter().map(|m| m.0).collect();
    moved.iter().map(|m| m.1 as u32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn best(levels: &[Option<Vec<f64>>], bins: usize) -> Vec<usize> {
        PathLevels { levels, bins, bins_per_resolution: 4.0, quarters: 1.0 }.best_path()
    }

    fn peak(at: usize, height: f64) -> Option<Vec<f64>> {
        Some((0..60).map(|k: usize| height * (-(k.abs_diff(at) as f64 / 4.0).powi(2)).exp()).collect())
    }

    #[test]
    fn the_path_follows_a_drift_over_a_column_without_spectrum() {
        let levels: Vec<_> = (0..12).map(|c| if c == 5 { None } else { peak(10 + 3 * c, 20.0) }).collect();
        let path = best(&levels, 60);
        // within half a resolution of the drift
        let on_it = path.iter().enumerate().filter(|(c, bin)| bin.abs_diff(10 + 3 * c) <= 2).count();
        assert_eq!((path.len(), on_it), (12, 12), "{path:?}");
    }

    #[test]
    fn one_column_with_a_larger_maximum_elsewhere_does_not_lead_it_away() {
        let levels: Vec<_> =
            (0..12).map(|c| peak(if c == 6 { 50 } else { 10 }, if c == 6 { 60.0 } else { 20.0 })).collect();
        let path = best(&levels, 60);
        assert!(path.iter().enumerate().all(|(c, bin)| c == 6 || *bin == 10), "{path:?}");
    }
}
