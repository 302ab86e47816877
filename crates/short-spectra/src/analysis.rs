//! The complete analysis of a record: its parts, their standard deviations, and the reliability of each
//! frequency.

mod component_estimates;
mod long_record;

use super::error::check_record;
use super::frequency_drift::{self, DriftCourse};
use super::model_selection::{FRAMES_PER_COLUMN, ModelFit, ModelSelector};
use super::multitaper::{Multitaper, TAPERS};
use super::periodogram::Periodogram;
use super::settings::ROUNDING;
use super::time_frequency::Ridge;
use super::{Detrend, MIN_SAMPLES, Spectrum, SpectrumError, SpectrumSettings, decimation, step_detection};
use crate::record::SampledRecord;
use component_estimates::FitReading;
use portable_math as math;
use std::f64::consts::TAU;
use std::ops::Range;

/// Length, in frames, of the longest record that is fitted: three seconds at 5,000 frames/s, which take about
/// one second. The computing time grows faster than the length; longer records are analysed by their windowed
/// periodogram.
pub const LONGEST_DECOMPOSED: usize = 1 << 14;

/// A record decomposed into trend, components and residual.
#[derive(Debug, Clone, PartialEq)]
pub struct SpectralAnalysis {
    /// Amplitude spectrum of the record without the removed parts, with the components.
    pub spectrum: Spectrum,
    /// Number of frames left out at the start of the record, because they contain a step that no model
    /// describes. All fields below refer to the remaining frames.
    pub skipped_frames: usize,
    /// Distance, in frames, between frames that may have a value: 1, or more if for example only every second
    /// frame has a value.
    pub stride: usize,
    /// Trend and relaxations that were removed before the components were estimated.
    pub removed: RemovedTrend,
    /// Sum of trend and relaxations in every frame, m.
    pub removed_m: Vec<f64>,
    /// Amplitude, m, that the removed parts would have in each bin of the spectrum.
    pub leakage_m: Vec<f64>,
    /// The sum of the components in every frame, m; zero for a long record.
    pub model_m: Vec<f64>,
    /// Residual in each frame, m.
    pub residual_m: Vec<Option<f64>>,
    /// The oscillations among the components, except a drifting one; empty for a long record.
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

/// A fitted oscillation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Oscillation {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Decay of the amplitude, 1/s; zero for a steady oscillation.
    pub decay_per_s: f64,
    /// Amplitude at the start of the oscillation, m.
    pub amplitude_m: f64,
    /// Phase of the cosine at the start of the record, rad.
    pub phase_rad: f64,
    /// Start of the oscillation, s from the record's first frame; 0 if it is present from that frame on.
    pub begins_s: f64,
}

impl Oscillation {
    /// Displacement, m, at the time `time_s` after the first frame of the record.
    #[must_use]
    pub fn displacement_m(&self, time_s: f64) -> f64 {
        self.envelope_m(time_s) * math::cos(TAU * self.frequency_hz * time_s + self.phase_rad)
    }

    /// Amplitude, m, at the time `time_s` after the first frame of the record.
    pub fn envelope_m(&self, time_s: f64) -> f64 {
        if time_s < self.begins_s {
            return 0.0;
        }
        self.amplitude_m * math::exp(-self.decay_per_s * (time_s - self.begins_s))
    }
}

/// Parts that were removed before the components were estimated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RemovedTrend {
    /// The trend.
    pub detrend: Detrend,
    /// Number of exponential relaxations removed with the trend.
    pub relaxations: usize,
}

impl std::fmt::Display for RemovedTrend {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match (self.detrend, self.relaxations) {
            (Detrend::None, 0) => f.write_str("nothing"),
            (detrend, 0) => write!(f, "{detrend}"),
            (detrend, 1) => write!(f, "{detrend} and a relaxation"),
            (detrend, count) => write!(f, "{detrend} and {count} relaxations"),
        }
    }
}

/// Largest allowed number of columns of a smooth trend. With more, a trend bends as fast as a component, so
/// the frames after a step are tried instead.
const MAX_SMOOTH_TREND_COLUMNS: usize = 20;

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
        if record.samples.len() > LONGEST_DECOMPOSED {
            let (_, trend) = check_record(record.samples, record.frame_rate_hz, settings)?;
            return long_record::analyse_long_record(record, settings, trend);
        }
        let whole = Self::decompose(record, settings)?;
        if whole.leaves_only_noise && !whole.trend_competes || settings.detrend.is_some() {
            return Ok(whole.analysis.with_densities(record.frame_rate_hz));
        }
        let starts = step_detection::starts_after_step(record.samples).into_iter();
        let behind =
            starts.filter_map(|start| Self::read_part(record, settings, start..record.samples.len()));
        let mut plain = None;
        for part in behind {
            if part.leaves_only_noise {
                return Ok(part.analysis.with_densities(record.frame_rate_hz));
            }
            plain.get_or_insert(part.analysis);
        }
        // a low-order trend after a step is better than a high-order trend through the step
        let best = plain.filter(|_| whole.trend_competes).unwrap_or(whole.analysis);
        Ok(best.with_densities(record.frame_rate_hz))
    }

    /// Analyses each stretch between the steps of a piece. The result for a stretch is that of the first
    /// range of frames whose fit leaves only noise, or else of the first range whose trend has no waves as
    /// fast as a component. Fitting a trend through a step would take many times as long as fitting the
    /// oscillation that the step starts.
    fn analyse_between_steps(record: &SampledRecord, settings: &SpectrumSettings) -> Vec<Self> {
        let of_stretch = |tries: &Vec<Range<usize>>| {
            let mut parts =
                tries.iter().filter_map(|frames| Self::read_part(record, settings, frames.clone()));
            let first = parts.next()?;
            let best = if first.leaves_only_noise {
                first
            } else {
                parts.find(|part| part.leaves_only_noise).unwrap_or(first)
            };
            Some(best.analysis.with_densities(record.frame_rate_hz))
        };
        step_detection::stretches_between_steps(record.samples).iter().filter_map(of_stretch).collect()
    }

    /// Analyses some frames of a record; `None` if that fails or if their trend has waves as fast as a
    /// component.
    fn read_part(
        record: &SampledRecord,
        settings: &SpectrumSettings,
        frames: Range<usize>,
    ) -> Option<Attempt> {
        let skipped_frames = frames.start;
        let part =
            Self::decompose(&SampledRecord { samples: &record.samples[frames], ..*record }, settings).ok()?;
        let analysis = Self { skipped_frames, ..part.analysis };
        (!part.trend_competes).then_some(Attempt { analysis, ..part })
    }
    fn decompose(record: &SampledRecord, settings: &SpectrumSettings) -> Result<Attempt, SpectrumError> {
        let (padded, trend) = check_record(record.samples, record.frame_rate_hz, settings)?;
        let periodogram = Periodogram::new(record.samples, padded);
        let largest = record.samples.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
        let least_m = (ROUNDING * largest).max(f64::MIN_POSITIVE);
        let mut search =
            ModelSelector::new(record.samples, record.frame_rate_hz, &periodogram, trend, least_m);
        search.trend_grows = settings.detrend.is_none();
        let least = MIN_SAMPLES.max(FRAMES_PER_COLUMN * trend.column_count());
        let too_few = || SpectrumError::TooFew { found: record.samples.iter().flatten().count(), least };
        let mut fit = search.select_model(trend).ok_or_else(too_few)?;
        let mut course = frequency_drift::find_drift_course(&search, &fit, settings.band_hz);
        search.noise_is_coloured = true;
        let drift = course.as_ref().and_then(|course| Some((course.drift_region()?, course.range?)));
        let smooth = |fit: &ModelFit| fit.model.trend().column_count() <= MAX_SMOOTH_TREND_COLUMNS;
        if let Some((drifting, range)) = drift {
            if let Some(pair) = search.split_into_pair(&fit, &range) {
                // two oscillations that beat look like one with a drifting frequency
                course = course.map(|course| DriftCourse { range: None, ..course });
                fit = search.run_second_pass(pair).ok_or_else(too_few)?;
            } else {
                search.drift_region = Some(drifting);
                fit = search.select_without_drift(&fit).ok_or_else(too_few)?;
            }
        } else if !search.trend_grows || smooth(&fit) {
            // if no trend describes a step, a second pass would split the motion into pieces
            fit = search.run_second_pass(fit).ok_or_else(too_few)?;
        }
        let exhausted = search.trend_grows && fit.model.trend().next_richer().is_none();
        let trend_competes = search.trend_grows && (!smooth(&fit) || search.trend_competes(&fit));
        let leaves_only_noise = !exhausted
            && !search.contains_step(&fit)
            && (search.drift_region.is_some() || search.leaves_only_noise(&fit));
        let fitted = FitReading::new(&search, fit).ok_or_else(too_few)?;
        let analysis = fitted.to_analysis(record, settings, course);
        Ok(Attempt { leaves_only_noise, trend_competes, analysis })
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

/// An analysis, whether its residual is only noise, and whether its trend has waves as fast as a component. A
/// trend with such waves and a component may cancel each other even where the record is flat.
struct Attempt {
    leaves_only_noise: bool,
    trend_competes: bool,
    analysis: SpectralAnalysis,
}

#[cfg(test)]
mod tests {
    use super::*;

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
        for k in 0..12 {
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
