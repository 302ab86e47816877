//! The complete analysis of a record: its parts, their standard deviations, and the reliability of each
//! frequency.

mod long_record;

use super::decomposition::{Decomposition, DecompositionSettings, RecordParts};
use super::error::check_record;
use super::frequency_drift::{choose_ridge_band, select_best_ridge};
use super::multitaper::{Multitaper, TAPERS};
use super::peaks::find_peaks;
use super::periodogram::Periodogram;
use super::settings::ROUNDING;
use super::time_frequency::Ridge;
use super::{Component, Detrend, MIN_SAMPLES, Spectrum, SpectrumError, SpectrumSettings, decimation};
pub use crate::decomposition::Oscillation;
use crate::record::SampledRecord;
use portable_math as math;

/// Length, in frames, of the longest record that is fitted: three seconds at 5,000 frames/s, which take about
/// two seconds. The computing time grows faster than the length; longer records are analysed by their
/// windowed periodogram.
pub const LONGEST_DECOMPOSED: usize = 1 << 14;

/// A record decomposed into trend, components and residual.
#[derive(Debug, Clone, PartialEq)]
pub struct SpectralAnalysis {
    /// Amplitude spectrum of the record without the removed parts, with the components.
    pub spectrum: Spectrum,
    /// Number of frames left out at the start of the record. If only every second, third ... frame has a
    /// value, these are the frames before the first value; otherwise 0. All fields below refer to the
    /// remaining frames.
    pub skipped_frames: usize,
    /// Distance, in frames, between frames that may have a value: 1, or more if for example only every second
    /// frame has a value.
    pub stride: usize,
    /// Trend, steps and relaxations.
    pub removed: RemovedTrend,
    /// Sum of trend, steps and relaxations in every frame, m.
    pub removed_m: Vec<f64>,
    /// Amplitude, m, that the removed parts would have in each bin of the spectrum.
    pub leakage_m: Vec<f64>,
    /// Sum of the oscillations in every frame, m; zero for a long record.
    pub model_m: Vec<f64>,
    /// Residual in each frame, m; `None` for a frame without a value and for one that is left out, as an
    /// outlier or within a jump.
    pub residual_m: Vec<Option<f64>>,
    /// The oscillations of the record; empty for a long record.
    pub oscillations: Vec<Oscillation>,
    /// Frequency over time of the strongest component above the slow components, if there is one.
    pub ridge: Option<Ridge>,
    /// Power density of the record without the removed parts; `None` for a long record, or if the gaps allow
    /// no tapers.
    pub multitaper: Option<Multitaper>,
    /// Noise floor, m, in each bin of the spectrum, from the multitaper density of the residual; empty if the
    /// residual has no multitaper density.
    pub noise_floor_m: Vec<f64>,
}

/// Smallest number of frames with a value, per column of the trend, in a record that is analysed.
const FRAMES_PER_COLUMN: usize = 2;

/// Slow parts that were removed before the spectrum was computed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RemovedTrend {
    /// The trend.
    pub detrend: Detrend,
    /// Number of exponential relaxations.
    pub relaxations: usize,
    /// Number of steps, including jumps and swings that end within a cycle.
    pub steps: usize,
}

impl RemovedTrend {
    fn from_parts(parts: &RecordParts, settings: &SpectrumSettings) -> Self {
        let detrend = settings.detrend.unwrap_or(match parts.trend.column_count() {
            0 => Detrend::None,
            1 => Detrend::Mean,
            2 => Detrend::Line,
            4 => Detrend::Cubic,
            columns => Detrend::Polynomial(columns - 1),
        });
        Self { detrend, relaxations: parts.relaxations, steps: parts.steps }
    }
}

impl std::fmt::Display for RemovedTrend {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let count = |count: usize, one: &str| match count {
            0 => None,
            1 => Some(format!("a {one}")),
            more => Some(format!("{more} {one}s")),
        };
        let trend = (self.detrend != Detrend::None).then(|| self.detrend.to_string());
        let parts = [trend, count(self.steps, "step"), count(self.relaxations, "relaxation")];
        let parts: Vec<String> = parts.into_iter().flatten().collect();
        match parts.as_slice() {
            [] => f.write_str("nothing"),
            [one] => f.write_str(one),
            [first @ .., last] => write!(f, "{} and {last}", first.join(", ")),
        }
    }
}

impl SpectralAnalysis {
    /// The record without the removed parts, m.
    pub fn detrended_m(&self) -> Vec<Option<f64>> {
        self.residual_m.iter().zip(&self.model_m).map(|(left, m)| left.map(|left| left + m)).collect()
    }

    /// Analyses a record. If `settings.detrend` is `None`, the trend is chosen from the record. If only every
    /// second, third ... frame has a value, the record is analysed at that lower rate.
    ///
    /// # Errors
    /// [`SpectrumError`] if the record, the frame rate or the band allows no spectrum.
    pub fn from_record(record: &SampledRecord, settings: &SpectrumSettings) -> Result<Self, SpectrumError> {
        let Some(kept) = decimation::find_stride(record.samples) else {
            return Self::analyse_frames(record, settings);
        };
        let samples = decimation::decimate(record.samples, kept);
        let frame_rate_hz = record.frame_rate_hz / kept.1 as f64;
        let analysis =
            Self::analyse_frames(&SampledRecord { samples: &samples, frame_rate_hz, ..*record }, settings)?;
        Ok(analysis.interpolate_to_record(record, kept))
    }

    /// Extends the analysis of the kept frames to the whole record; removed trend and components are
    /// interpolated linearly between kept frames.
    fn interpolate_to_record(self, record: &SampledRecord, (first, stride): (usize, usize)) -> Self {
        let left_out = first + stride * self.skipped_frames;
        let frames = record.samples.len() - left_out;
        let between = |values: &[f64]| {
            let at = |frame: usize| {
                let (kept, part) = (frame / stride, (frame % stride) as f64 / stride as f64);
                let value = |kept: usize| values.get(kept).or(values.last()).copied().unwrap_or_default();
                value(kept) + part * (value(kept + 1) - value(kept))
            };
            (0..frames).map(at).collect()
        };
        let left = |frame: usize| {
            self.residual_m.get(frame / stride).copied().flatten().filter(|_| frame.is_multiple_of(stride))
        };
        let left_m = (0..frames).map(left).collect();
        let (removed_m, model_m) = (between(&self.removed_m), between(&self.model_m));
        Self { skipped_frames: left_out, stride, removed_m, model_m, residual_m: left_m, ..self }
    }

    fn analyse_frames(record: &SampledRecord, settings: &SpectrumSettings) -> Result<Self, SpectrumError> {
        let (padded, trend) = check_record(record.samples, record.frame_rate_hz, settings)?;
        if record.samples.len() > LONGEST_DECOMPOSED {
            return long_record::analyse_long_record(record, settings, trend);
        }
        let found = record.samples.iter().flatten().count();
        let least = MIN_SAMPLES.max(FRAMES_PER_COLUMN * trend.column_count());
        if found < least {
            return Err(SpectrumError::TooFew { found, least });
        }
        let search = DecompositionSettings::new(found, trend, settings);
        let decomposition = Decomposition::from_record(record, search);
        let parts = decomposition
            .as_ref()
            .map_or_else(|| RecordParts::from_trend(record.samples, trend), Decomposition::record_parts);
        let mut components = decomposition.map_or_else(Vec::new, |found| found.components(record, settings));
        let (low_hz, high_hz) = settings.band_hz.unwrap_or((0.0, record.frame_rate_hz / 2.0));
        components.retain(|c| (low_hz..=high_hz).contains(&c.frequency_hz));
        components.truncate(settings.max_components);
        Ok(Self::from_parts(record, settings, padded, parts, components))
    }

    /// The analysis of a record from its parts and components. The spectrum has `padded / 2 + 1` bins.
    fn from_parts(
        record: &SampledRecord,
        settings: &SpectrumSettings,
        padded: usize,
        mut parts: RecordParts,
        mut components: Vec<Component>,
    ) -> Self {
        let (frames, frame_rate_hz) = (record.samples.len(), record.frame_rate_hz);
        let resolution_hz = frame_rate_hz / frames as f64;
        let model_m = std::mem::take(&mut parts.fast_m);
        let residual = |i: usize| {
            let value = record.samples[i].filter(|_| parts.is_used[i]);
            value.map(|x| x - parts.slow_m[i] - model_m[i])
        };
        let residual_m: Vec<Option<f64>> = (0..frames).map(residual).collect();
        // The spectrum shows the components in every frame, so that gaps do not broaden their peaks. The
        // residual is known in some frames only, so it is divided by the share of the Hann weights on these
        // frames. All weights of a Hann window add up to half the number of frames.
        let periodogram = Periodogram::new(&residual_m, padded);
        let share = periodogram.sums.first / (frames as f64 / 2.0);
        let shown = residual_m.iter().zip(&model_m).map(|(left, m)| m + left.unwrap_or(0.0) / share);
        let whole = Periodogram::new(&vec![Some(0.0); frames], padded);
        let amplitude_m = whole.amplitudes(&shown.collect::<Vec<f64>>());
        let leakage_m = whole.amplitudes(&parts.slow_m);
        let left_m =
            periodogram.amplitudes(&residual_m.iter().map(|x| x.unwrap_or(0.0)).collect::<Vec<f64>>());
        let largest = record.samples.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
        let least_m = (ROUNDING * largest).max(f64::MIN_POSITIVE);
        let band_hz = settings.band_hz.unwrap_or((0.0, frame_rate_hz / 2.0));
        let left = periodogram.windowed_spectrum(&left_m, frame_rate_hz, least_m);
        let noise_floor_m = find_peaks(&left, band_hz, 1).floor_m;
        let bin_hz = frame_rate_hz / padded as f64;
        for component in components.iter_mut().filter(|c| c.range_hz.is_none()) {
            component.leakage_m = leakage_m.get((component.frequency_hz / bin_hz).round() as usize).copied();
        }
        let spectrum = Spectrum {
            frequency_hz: (0..amplitude_m.len()).map(|k| k as f64 * bin_hz).collect(),
            noise_floor_m,
            resolution_hz,
            noise_bandwidth_hz: periodogram.noise_bandwidth_hz(frame_rate_hz),
            present: record.samples.iter().flatten().count() as f64 / frames as f64,
            components,
            amplitude_m,
        };
        let analysis = Self {
            spectrum,
            skipped_frames: 0,
            stride: 1,
            removed: RemovedTrend::from_parts(&parts, settings),
            removed_m: parts.slow_m,
            leakage_m,
            model_m,
            residual_m,
            oscillations: parts.oscillations,
            ridge: None,
            multitaper: None,
            noise_floor_m: Vec::new(),
        };
        let ridge = analysis.find_ridge(frame_rate_hz, settings.band_hz);
        Self { ridge, ..analysis }.with_densities(frame_rate_hz)
    }

    /// The record, m, without the removed parts and without the oscillations below `low_hz`.
    fn fast_motion_m(&self, frame_rate_hz: f64, low_hz: f64) -> Vec<Option<f64>> {
        let kept: Vec<&Oscillation> =
            self.oscillations.iter().filter(|o| o.frequency_hz() >= low_hz).collect();
        let at = |(i, left): (usize, &Option<f64>)| {
            let fast = || kept.iter().map(|o| o.displacement_m(i as f64 / frame_rate_hz)).sum::<f64>();
            left.map(|left| left + fast())
        };
        self.residual_m.iter().enumerate().map(at).collect()
    }

    /// Frequency over time of the strongest component above the slow ones.
    fn find_ridge(&self, frame_rate_hz: f64, band_hz: Option<(f64, f64)>) -> Option<Ridge> {
        let frames = self.residual_m.len();
        let size = |o: &Oscillation| {
            let square = |i: usize| math::powi(o.displacement_m(i as f64 / frame_rate_hz), 2);
            (2.0 * (0..frames).map(square).sum::<f64>() / frames as f64).sqrt()
        };
        let strong: Vec<(f64, f64)> = self.oscillations.iter().map(|o| (o.frequency_hz(), size(o))).collect();
        let band = choose_ridge_band(frames, frame_rate_hz, &strong, band_hz)?;
        let record = self.fast_motion_m(frame_rate_hz, band.0);
        select_best_ridge(&record, frame_rate_hz, band).map(|(_, ridge)| ridge)
    }

    /// Adds the power density, the noise floor and, for each component without a drift range, the probability
    /// that noise alone produces a line at least as steady.
    fn with_densities(mut self, frame_rate_hz: f64) -> Self {
        let padded = 2 * (self.spectrum.amplitude_m.len() - 1);
        let density = |samples: &[Option<f64>]| {
            let found = Multitaper::new(samples, frame_rate_hz, padded, TAPERS).ok();
            found.filter(|m| m.frequency_hz.len() == padded / 2 + 1)
        };
        let (multitaper, left) = rayon::join(|| density(&self.detrended_m()), || density(&self.residual_m));
        self.multitaper = multitaper;
        let bandwidth_hz = self.spectrum.noise_bandwidth_hz;
        // a bin of a windowed spectrum holds the noise of its bandwidth; a sine of amplitude A has the mean
        // square A^2 / 2
        let of_density = |density: f64| (2.0 * density * bandwidth_hz).sqrt();
        self.noise_floor_m =
            left.map_or_else(Vec::new, |left| left.noise_density(0.0).into_iter().map(of_density).collect());
        let bin_hz = frame_rate_hz / padded as f64;
        for component in self.spectrum.components.iter_mut().filter(|c| c.range_hz.is_none()) {
            let bin = (component.frequency_hz / bin_hz).round() as usize;
            component.line_probability = self.multitaper.as_ref().and_then(|m| m.line_probability(bin));
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    const RATE_HZ: f64 = 5000.0;

    fn analysed(frames: usize, value: impl Fn(f64) -> f64) -> SpectralAnalysis {
        let mut seed = 7_u64;
        let mut draw = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let noise_m = 2e-7 * 12.0_f64.sqrt();
        let samples: Vec<Option<f64>> =
            (0..frames).map(|i| Some(value(i as f64 / RATE_HZ) + noise_m * draw())).collect();
        SpectralAnalysis::from_record(
            &SampledRecord { samples: &samples, frame_rate_hz: RATE_HZ, exposure_s: None },
            &SpectrumSettings::default(),
        )
        .unwrap()
    }

    #[test]
    fn of_pairs_closer_than_a_resolution_no_clear_frequency_is_off_by_four_deviations() {
        let mut clear = 0;
        for k in 0..12_u32 {
            let (low_hz, apart_hz, phase) =
                (300.0 + 37.3 * f64::from(k), [0.5, 0.7, 0.9][k as usize % 3] / 0.16, f64::from(k));
            let pair = |t: f64| {
                1e-5 * ((TAU * low_hz * t).cos() + 0.5 * (TAU * (low_hz + apart_hz) * t + phase).cos())
            };
            for c in analysed(800, pair)
                .spectrum
                .components
                .iter()
                .filter(|c| c.verdict == crate::ComponentVerdict::Clear && c.range_hz.is_none())
            {
                let off_hz = (c.frequency_hz - low_hz).abs().min((c.frequency_hz - low_hz - apart_hz).abs());
                assert!(off_hz < 4.0 * c.frequency_sd_hz, "{low_hz} Hz and {apart_hz} Hz more: {c:?}");
                clear += 1;
            }
        }
        assert!(clear > 3, "{clear}");
    }

    #[test]
    fn the_shortest_records_have_no_component_and_are_not_refused() {
        for frames in crate::MIN_SAMPLES..16 {
            let analysis = analysed(frames, |t| 1e-3 * (TAU * 600.0 * t).cos());
            assert_eq!(analysis.spectrum.components.len(), 0, "{frames} frames");
        }
    }
}
