//! Components with their standard deviations, and the evidence for and against each of them, from the fitted
//! parts of a record.

use super::{Oscillation, RemovedTrend, SpectralAnalysis};
use crate::classification::{Evidence, RecordContext, classify_components};
use crate::component::DecayingTone;
use crate::frequency_drift::{DriftCourse, RidgeMean, median_stray};
use crate::least_squares::{FreeSet, SineCovariance, SineTerm, TermDeviations, Tolerance};
use crate::model_selection::{ModelFit, ModelSelector, SineModel};
use crate::peaks::Peak;
use crate::periodogram::Periodogram;
use crate::record::SampledRecord;
use crate::residual_significance::NEIGHBOURHOOD;
use crate::trend::Trend;
use crate::{Component, Detrend, Estimator, Spectrum, SpectrumSettings};
use portable_math as math;
use std::f64::consts::{FRAC_1_SQRT_2, TAU};

/// Ratio of a decay to its standard deviation from which the decay is significant; a smaller decay is set to
/// zero in the fit.
const SIGNIFICANT_DECAY: f64 = 3.0;

/// An oscillation may be a part of a step if the trend could not grow further and the oscillation has fewer
/// cycles than this multiple of the number of waves of the trend.
const EXHAUSTED_TREND_WAVES: f64 = 2.0;
/// An oscillation of fewer cycles than this may be a part of the motion that the trend describes, such as the
/// shaking of a camera. Applies only if the trend has more than `FEWEST_COLUMNS` columns, the number of
/// columns of a cubic.
const SLOW_CYCLES: f64 = 6.5;
const FEWEST_COLUMNS: usize = 4;
/// A short-lived oscillation counts as crowded if at least this number of other short-lived oscillations are
/// near it.
const CROWD_NEIGHBOURS: usize = 2;
/// Distance in frequency, in resolutions, within which two oscillations that are not both steady may be parts
/// of one oscillation: the window hardly separates them, and their errors cancel.
const FRAGMENT_RESOLUTIONS: f64 = 2.0;
/// An unresolved second oscillation shifts the frequency of the first. This is the standard deviation of the
/// shift, in resolutions, divided by the ratio of the residual to the amplitude. In fifty pairs of equal
/// amplitudes, half a resolution to one resolution apart, the largest quotient was 4.6.
const COMPANION_SHIFT: f64 = 2.0;
/// Standard deviation, in resolutions, of a frequency that no oscillation explains: the frequency is
/// uniformly distributed within one resolution of its peak.
const UNEXPLAINED_SD: f64 = 0.577;

/// A fitted record with the covariances of its terms.
pub(super) struct FitReading<'a> {
    selector: &'a ModelSelector<'a>,
    /// Model with every decay free, from which damping is estimated.
    free_decay_model: SineModel,
    free_decay_covariance: SineCovariance,
    /// The model with every decay free and a trend of two more columns. It shows how much the results depend
    /// on the trend.
    richer_trend_model: Option<SineModel>,
    /// Fit in which every insignificant decay is fixed at zero, from which frequency and amplitude are
    /// estimated.
    decomposition: ModelFit,
    covariance: SineCovariance,
    /// Indices of terms that may be parts of one oscillation whose frequency drifts at a constant rate or
    /// whose amplitude falls linearly.
    unsteady_terms: Vec<usize>,
}

impl<'a> FitReading<'a> {
    pub(super) fn new(selector: &'a ModelSelector<'a>, fit: ModelFit) -> Option<Self> {
        let free_decay_model = fit.model.clone();
        let problem = &free_decay_model.problem;
        let free_decay_covariance = problem.covariance(&free_decay_model.solution)?;
        let noise_m = selector.periodogram.noise_sd_m(fit.peaks.floor_m);
        let steady = |(k, term): (usize, &SineTerm)| {
            let sd = free_decay_covariance.deviations(k, free_decay_model.amplitudes(k)).nepers * noise_m;
            if term.free == FreeSet::Both && term.nepers.abs() < SIGNIFICANT_DECAY * sd {
                SineTerm { nepers: 0.0, free: FreeSet::Cycles, ..*term }
            } else {
                *term
            }
        };
        let terms: Vec<SineTerm> = free_decay_model.terms().iter().enumerate().map(steady).collect();
        let decomposition = if terms == free_decay_model.terms() {
            fit
        } else {
            let solution = problem.gauss_newton(&terms, Tolerance::Fine)?;
            selector.decompose(SineModel { problem: problem.clone(), solution })
        };
        Some(Self {
            selector,
            free_decay_covariance,
            richer_trend_model: selector.with_richer_trend(&free_decay_model),
            covariance: problem.covariance(&decomposition.model.solution)?,
            unsteady_terms: selector.unsteady_terms(&decomposition),
            decomposition,
            free_decay_model,
        })
    }

    pub(super) fn to_analysis(
        &self,
        record: &SampledRecord,
        settings: &SpectrumSettings,
        course: Option<DriftCourse>,
    ) -> SpectralAnalysis {
        let parts = &self.decomposition.model;
        let (frames, frame_rate_hz) = (record.samples.len(), record.frame_rate_hz);
        let oscillations = parts.oscillations();
        let courses: Vec<Vec<f64>> = oscillations.iter().map(|k| parts.term_values(*k)).collect();
        let mut model_m = vec![0.0; frames];
        courses.iter().for_each(|course| model_m.iter_mut().zip(course).for_each(|(sum, x)| *sum += x));
        let removed_m = self.selector.removed_signal_m(parts);
        let padded = 2 * (self.decomposition.amplitude_m.len() - 1);
        let whole = Periodogram::new(&vec![Some(0.0); frames], padded);
        let amplitude_m = whole.amplitudes(&self.gapless_signal_m(&model_m));
        let leakage_m = whole.amplitudes(&removed_m);
        let bin_hz = frame_rate_hz / (2 * (amplitude_m.len() - 1)) as f64;
        let (low, high) = settings.band_hz.unwrap_or((0.0, frame_rate_hz / 2.0));
        let terms = oscillations.iter().zip(&courses);
        let mut read: Vec<(Component, Evidence)> =
            terms.map(|(k, course)| self.estimate_component(*k, course, &leakage_m)).collect();
        read.extend(course.as_ref().and_then(|course| self.drifting_component(course)));
        let unexplained = self.selector.unexplained_peaks(&self.decomposition);
        read.extend(unexplained.iter().map(|peak| self.peak_component(peak)));
        read.sort_by(|a, b| b.0.amplitude_m.total_cmp(&a.0.amplitude_m));
        let (mut components, evidence): (Vec<_>, Vec<_>) = read.into_iter().unzip();
        let context = RecordContext::new(record, self.selector.resolution_hz(), settings);
        classify_components(&mut components, &evidence, &context);
        components.retain(|c| (low..=high).contains(&c.frequency_hz));
        components.truncate(settings.max_components);
        let spectrum = Spectrum {
            frequency_hz: (0..amplitude_m.len()).map(|k| k as f64 * bin_hz).collect(),
            noise_floor_m: self.decomposition.peaks.floor_m,
            resolution_hz: self.selector.resolution_hz(),
            noise_bandwidth_hz: self.selector.periodogram.noise_bandwidth_hz(frame_rate_hz),
            present: self.selector.periodogram.sums.present as f64 / frames as f64,
            components,
            amplitude_m,
        };
        let detrend = settings.detrend.unwrap_or(detrend_of_trend(parts.trend()));
        let relaxations = parts.terms().len() - oscillations.len();
        SpectralAnalysis {
            spectrum,
            skipped_frames: 0,
            stride: 1,
            removed: RemovedTrend { detrend, relaxations },
            removed_m,
            leakage_m,
            model_m,
            residual_m: self.decomposition.residual_m.clone(),
            oscillations: oscillations.iter().map(|k| self.fitted_oscillation(*k)).collect(),
            ridge: course.map(|course| course.ridge),
            multitaper: None,
            noise_floor_m: Vec::new(),
        }
    }

    /// The signal whose spectrum is shown, m: the components in every frame, so that gaps do not spread them,
    /// plus the residual in the frames that have a value.
    fn gapless_signal_m(&self, model_m: &[f64]) -> Vec<f64> {
        // the weights of a Hann window add up to half its frames
        let share = self.selector.periodogram.sums.first / (model_m.len() as f64 / 2.0);
        let left = self.decomposition.residual_m.iter().zip(model_m);
        left.map(|(left, m)| m + left.unwrap_or(0.0) / share).collect()
    }

    fn estimate_component(&self, k: usize, course: &[f64], leakage_m: &[f64]) -> (Component, Evidence) {
        let (selector, fit) = (self.selector, &self.decomposition);
        let (parts, free_model) = (&fit.model, &self.free_decay_model);
        let (term, free) = (&parts.terms()[k], &free_model.terms()[k]);
        let (noise_m, resolution_hz) = (self.noise_sd_near(term.cycles), selector.resolution_hz());
        let sd = self.covariance.deviations(k, parts.amplitudes(k));
        let sd_free = self.free_decay_covariance.deviations(k, free_model.amplitudes(k));
        let shift = self.shift_by_richer_trend(k);
        let keeps_peak = term.free == FreeSet::Both || term.free == FreeSet::Cycles;
        let cycles_sd = if keeps_peak { sd.cycles * noise_m } else { UNEXPLAINED_SD };
        let amplitude_m = parts.amplitude_m(k);
        let (left, level) = if term.is_transient() {
            let left_m = selector.residual_in_envelope(fit, term);
            (left_m / amplitude_m, selector.level_in_envelope(fit, term, amplitude_m))
        } else {
            let shown_m = selector.windowed_amplitude_m(parts, k);
            let left_m = selector.significant_residual(fit, term);
            (left_m / shown_m, shown_m / selector.noise_floor_near(fit, term.cycles))
        };
        let piece = self.nearest_fragment(k);
        let moved = piece.as_ref().map_or(0.0, |piece| piece.distance * piece.amplitude_ratio);
        let companion = math::hypot(COMPANION_SHIFT * left, moved); // resolutions, that is cycles
        let decays = matches!(free.free, FreeSet::Both | FreeSet::Nepers);
        let damping = decays.then(|| {
            let nepers_sd = math::hypot(sd_free.nepers * noise_m, shift.nepers);
            damping_ratio_with_sd(free, math::hypot(nepers_sd, TAU * companion))
        });
        let trend_exhausted = selector.trend_grows
            && self.richer_trend_model.is_none()
            && term.cycles < EXHAUSTED_TREND_WAVES * parts.trend().fastest_waves();
        let evidence = Evidence {
            trend_exhausted,
            trend_shift: shift.cycles / cycles_sd,
            residual_ratio: left,
            unsteady: self.unsteady_terms.contains(&k),
            slow: self.is_slow(k),
            crowded: self.is_crowded(k),
            nearest: self.distance_to_nearest(k),
            fragment_distance: piece.map(|piece| piece.distance),
            keeps_peak,
            ..Evidence::default()
        };
        let bins_a_cycle = 2.0 * (leakage_m.len() - 1) as f64 / course.len() as f64;
        let frames = course.len() - term.first;
        let nepers = term.nepers * frames as f64 / course.len() as f64;
        let alone = DecayingTone { amplitude_m, nepers, noise_m };
        let amplitude_sd_m = math::hypot(sd.amplitude * noise_m, shift.amplitude * amplitude_m);
        let component = Component {
            frequency_hz: term.cycles * resolution_hz,
            frequency_sd_hz: math::hypot(math::hypot(cycles_sd, shift.cycles), companion) * resolution_hz,
            begins_s: (term.first > 0).then(|| term.first as f64 / selector.frame_rate_hz),
            amplitude_m,
            amplitude_sd_m: math::hypot(amplitude_sd_m, left * amplitude_m),
            damping_ratio: damping.map(|d| d.0),
            damping_ratio_sd: damping.map(|d| d.1),
            snr_db: 20.0 * math::log10(level),
            cramer_rao_hz: alone.cramer_rao_bound_hz(frames, selector.frame_rate_hz),
            estimator: Estimator::LeastSquares,
            trend_shift_hz: self.richer_trend_model.is_some().then_some(shift.cycles * resolution_hz),
            leakage_m: leakage_m.get((term.cycles * bins_a_cycle).round() as usize).copied(),
            ..Component::default()
        };
        (component, evidence)
    }

    /// Whether an oscillation is as slow as the waves of a trend to which columns had to be added.
    fn is_slow(&self, k: usize) -> bool {
        let parts = &self.decomposition.model;
        let grown = parts.trend().column_count() > FEWEST_COLUMNS;
        self.selector.trend_grows && grown && parts.terms()[k].cycles < SLOW_CYCLES
    }

    /// Whether an oscillation and at least two others near it begin inside the record or end soon.
    fn is_crowded(&self, k: usize) -> bool {
        let terms = self.decomposition.model.terms();
        let near = |t: &&SineTerm| t.is_transient() && (t.cycles - terms[k].cycles).abs() < NEIGHBOURHOOD;
        terms[k].is_transient() && terms.iter().filter(near).count() > CROWD_NEIGHBOURS
    }

    /// The nearest other oscillation within two resolutions of oscillation `k` or within the width of the
    /// broader peak, if one of the two decays or begins inside the record. Two steady oscillations are a
    /// pair, not parts of one oscillation.
    fn nearest_fragment(&self, k: usize) -> Option<Fragment> {
        let (parts, terms) = (&self.decomposition.model, self.decomposition.model.terms());
        let steady = |term: &SineTerm| term.nepers == 0.0 && term.first == 0;
        // the width of a peak grows with its decay
        let width = |j: usize| (terms[j].nepers.max(terms[k].nepers) / TAU).max(FRAGMENT_RESOLUTIONS);
        let piece = |j: usize| Fragment {
            distance: (terms[j].cycles - terms[k].cycles).abs(),
            amplitude_ratio: (parts.amplitude_m(j) / parts.amplitude_m(k)).min(1.0),
        };
        (0..terms.len())
            .filter(|j| *j != k && terms[*j].cycles > 0.0 && !(steady(&terms[*j]) && steady(&terms[k])))
            .filter_map(|j| Some(piece(j)).filter(|piece| piece.distance < width(j)))
            .min_by(|a, b| a.distance.total_cmp(&b.distance))
    }

    /// Distance in frequency, in resolutions, of oscillation `k` from the nearest other oscillation.
    fn distance_to_nearest(&self, k: usize) -> Option<f64> {
        let terms = self.decomposition.model.terms();
        let others = terms.iter().enumerate().filter(|(j, t)| *j != k && t.cycles > 0.0);
        others.map(|(_, t)| (t.cycles - terms[k].cycles).abs()).min_by(f64::total_cmp)
    }

    fn fitted_oscillation(&self, k: usize) -> Oscillation {
        let parts = &self.decomposition.model;
        let (term, [cosine_m, sine_m]) = (&parts.terms()[k], parts.amplitudes(k));
        let (frames, resolution_hz) = (self.selector.samples.len() as f64, self.selector.resolution_hz());
        // the phase is counted from the middle of the record, the envelope from half a frame before it
        let from_middle = (0.5 - frames / 2.0) / frames;
        Oscillation {
            frequency_hz: term.cycles * resolution_hz,
            decay_per_s: term.nepers * resolution_hz,
            amplitude_m: math::hypot(cosine_m, sine_m) * math::exp(-0.5 * term.nepers / frames),
            phase_rad: math::atan2(-sine_m, cosine_m) + TAU * term.cycles * from_middle,
            begins_s: term.first as f64 / self.selector.frame_rate_hz,
        }
    }

    /// The component of a course with a drifting frequency; `None` for a course without a frequency range.
    fn drifting_component(&self, course: &DriftCourse) -> Option<(Component, Evidence)> {
        let range = course.range?;
        let (mean, selector) = (RidgeMean::from_ridge(&course.ridge), self.selector);
        let noise_m = self.noise_sd_near(mean.frequency_hz / selector.resolution_hz());
        let component = Component {
            frequency_hz: mean.frequency_hz,
            frequency_sd_hz: mean.frequency_sd_hz,
            range_hz: Some(range),
            amplitude_m: mean.amplitude_m,
            amplitude_sd_m: mean.amplitude_sd_m,
            snr_db: mean.snr_db,
            cramer_rao_hz: self.steady_bound_hz(mean.amplitude_m, noise_m),
            estimator: Estimator::Ridge,
            ..Component::default()
        };
        let evidence = Evidence {
            keeps_peak: true,
            followed_share: Some(course.followed_share),
            median_stray: Some(median_stray(&course.ridge)),
            drift: Some((range.high_hz - range.low_hz) / selector.resolution_hz()),
            ..Evidence::default()
        };
        Some((component, evidence))
    }

    /// The component for a peak that no decaying oscillation explains, estimated from the windowed spectrum.
    fn peak_component(&self, peak: &Peak) -> (Component, Evidence) {
        let (selector, cycles) = (self.selector, self.selector.cycles_of_peak(peak));
        let noise_m = self.noise_sd_near(cycles);
        let floor_m = selector.noise_floor_near(&self.decomposition, cycles);
        let component = Component {
            frequency_hz: peak.frequency_hz,
            frequency_sd_hz: UNEXPLAINED_SD * selector.resolution_hz(),
            amplitude_m: peak.amplitude_m,
            amplitude_sd_m: noise_m / selector.periodogram.noise_sd_m(1.0) * FRAC_1_SQRT_2,
            snr_db: 20.0 * math::log10(peak.amplitude_m / floor_m),
            cramer_rao_hz: self.steady_bound_hz(peak.amplitude_m, noise_m),
            estimator: Estimator::Periodogram,
            ..Component::default()
        };
        (component, Evidence::default())
    }

    fn steady_bound_hz(&self, amplitude_m: f64, noise_m: f64) -> f64 {
        let alone = DecayingTone { amplitude_m, nepers: 0.0, noise_m };
        alone.cramer_rao_bound_hz(self.selector.samples.len(), self.selector.frame_rate_hz)
    }

    /// Changes of a term when the trend has more columns: of its cycles, of its nepers, and the relative
    /// change of its amplitude half way through the record.
    fn shift_by_richer_trend(&self, k: usize) -> TermDeviations {
        let Some(richer) = &self.richer_trend_model else {
            return TermDeviations { cycles: 0.0, nepers: 0.0, amplitude: 0.0 };
        };
        let half_way = |parts: &SineModel| parts.amplitude_m(k) * math::exp(-parts.terms()[k].nepers / 2.0);
        let (now, then) = (&self.free_decay_model.terms()[k], &richer.terms()[k]);
        TermDeviations {
            cycles: (then.cycles - now.cycles).abs(),
            nepers: (then.nepers - now.nepers).abs(),
            amplitude: (half_way(richer) / half_way(&self.free_decay_model) - 1.0).abs(),
        }
    }

    /// Standard deviation, m, of white noise whose spectrum around a frequency equals that of the residual.
    fn noise_sd_near(&self, cycles: f64) -> f64 {
        let ModelFit { model: parts, amplitude_m, .. } = &self.decomposition;
        let bins_a_cycle = 2.0 * (amplitude_m.len() - 1) as f64 / self.selector.samples.len() as f64;
        let most = self.selector.samples.len() as f64 / 2.0;
        let lowest = parts.trend().fastest_waves().min(most / 2.0);
        let low = (cycles - NEIGHBOURHOOD).min(most - 2.0 * NEIGHBOURHOOD).max(lowest);
        let high = (low + 2.0 * NEIGHBOURHOOD).min(most);
        let bin = |cycles: f64| ((cycles * bins_a_cycle) as usize).min(amplitude_m.len() - 1);
        let around = &amplitude_m[bin(low)..=bin(high)];
        let mean_square = around.iter().map(|a| a * a).sum::<f64>() / around.len() as f64;
        // every oscillation in this range has reduced the number of free values by up to four
        let values = 2.0 * (high - low);
        let inside = parts.terms().iter().filter(|t| t.cycles > low && t.cycles < high);
        let taken: f64 = inside.map(|t| 2.0 + t.free.count() as f64).sum();
        let share = (1.0 - taken / values).max(0.25);
        self.selector.periodogram.noise_sd_m((mean_square / share).sqrt())
    }
}

/// Another oscillation that may be a part of the same motion.
struct Fragment {
    distance: f64,
    /// Ratio of the amplitude of this other oscillation to that of the oscillation under test; larger ratios
    /// are set to 1.
    amplitude_ratio: f64,
}

/// Damping ratio `d / sqrt(d^2 + (2 pi n)^2)` of `d` nepers in `n` cycles, and its standard deviation.
fn damping_ratio_with_sd(term: &SineTerm, nepers_sd: f64) -> (f64, f64) {
    let angle = TAU * term.cycles;
    let size = math::hypot(term.nepers, angle);
    (term.nepers / size, nepers_sd * math::powi(angle / size, 2) / size)
}

/// The detrending that corresponds to a trend.
fn detrend_of_trend(trend: Trend) -> Detrend {
    match trend.column_count() {
        0 => Detrend::None,
        1 => Detrend::Mean,
        2 => Detrend::Line,
        4 => Detrend::Cubic,
        columns => Detrend::Polynomial(columns - 1),
    }
}
