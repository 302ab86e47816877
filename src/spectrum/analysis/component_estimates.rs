//! What a record's parts say once they are fitted: components with their deviations, and the evidence for and
//! against each.

use super::{Oscillation, RemovedTrend, SampledRecord, SpectralAnalysis};
use crate::math;
use crate::spectrum::classification::{ComponentEvidence, RecordContext, classify_components};
use crate::spectrum::component::DecayingTone;
use crate::spectrum::frequency_drift::{DriftCourse, RidgeMean};
use crate::spectrum::least_squares::{
    FreeParameters, SinusoidCovariance, SinusoidTerm, TermDeviations, Tolerance,
};
use crate::spectrum::model_selection::{Decomposition, ModelSelector, SinusoidModel};
use crate::spectrum::peaks::Peak;
use crate::spectrum::periodogram::Periodogram;
use crate::spectrum::residual_significance::NEIGHBOURHOOD;
use crate::spectrum::trend::Trend;
use crate::spectrum::{Component, Detrend, Estimator, Spectrum, SpectrumSettings};
use std::f64::consts::TAU;

/// Deviations from zero from which a decay is one; below, the amplitude is that of a steady oscillation.
const SIGNIFICANT_DECAY: f64 = 3.0;

/// Waves of a trend that could grow no further, within which a component may be a piece of the flip.
const EXHAUSTED_TREND_WAVES: f64 = 2.0;
/// Cycles below which an oscillation may be a piece of what a trend of more columns than a cubic's describes:
/// a camera that shakes gives such pieces.
const SLOW_CYCLES: f64 = 6.5;
const FEWEST_COLUMNS: usize = 4;
/// Others near an oscillation that make a crowd.
const CROWD_NEIGHBOURS: usize = 2;
/// Resolutions within which two oscillations that are not both steady may be pieces of one: the window hardly
/// tells them apart, and each makes up for what the other is not.
const FRAGMENT_RESOLUTIONS: f64 = 2.0;
/// Resolutions by which a companion that cannot be resolved moves a frequency, for each part of the
/// amplitude that is left: of pairs half a resolution to one apart with equal amplitudes, the worst of fifty
/// was off by 4.6.
const COMPANION_SHIFT: f64 = 2.0;
/// Deviation of a frequency that no oscillation explains, resolutions: anywhere within one of its peak.
const UNEXPLAINED_SD: f64 = 0.577;

/// A record explained, with what its least squares say of the parts.
pub(super) struct FittedDecomposition<'a> {
    selector: &'a ModelSelector<'a>,
    /// With every decay free: damping is read from it.
    free_decay_model: SinusoidModel,
    free_decay_covariance: SinusoidCovariance,
    /// The same with a trend of two columns more, to see what depends on it.
    richer_trend_model: Option<SinusoidModel>,
    /// With decays that are none held at none: frequency and amplitude are read from it.
    decomposition: Decomposition,
    covariance: SinusoidCovariance,
    /// Terms that drift or fade evenly.
    unsteady_terms: Vec<usize>,
}

impl<'a> FittedDecomposition<'a> {
    pub(super) fn new(search: &'a ModelSelector<'a>, explained: Decomposition) -> Option<Self> {
        let free = explained.model.clone();
        let problem = &free.problem;
        let covariance_free = problem.covariance(&free.solution)?;
        let noise_m = search.periodogram.noise_sd_m(explained.peaks.floor_m);
        let steady = |(k, term): (usize, &SinusoidTerm)| {
            let sd = covariance_free.deviations(k, problem.quadrature_amplitudes(&free.solution, k)).nepers
                * noise_m;
            let is_steady =
                term.free == FreeParameters::CyclesAndNepers && term.nepers.abs() < SIGNIFICANT_DECAY * sd;
            if is_steady {
                SinusoidTerm { nepers: 0.0, free: FreeParameters::Cycles, ..*term }
            } else {
                *term
            }
        };
        let terms: Vec<SinusoidTerm> = free.solution.terms.iter().enumerate().map(steady).collect();
        let explained = if terms == free.solution.terms {
            explained
        } else {
            search.decompose(SinusoidModel {
                problem: problem.clone(),
                solution: problem.gauss_newton(&terms, Tolerance::Fine)?,
            })
        };
        let covariance = problem.covariance(&explained.model.solution)?;
        let richer = search.with_richer_trend(&free);
        let unsteady = search.unsteady_terms(&explained);
        Some(Self {
            selector: search,
            free_decay_model: free,
            free_decay_covariance: covariance_free,
            richer_trend_model: richer,
            decomposition: explained,
            covariance,
            unsteady_terms: unsteady,
        })
    }

    pub(super) fn to_analysis(
        &self,
        record: &SampledRecord,
        settings: &SpectrumSettings,
        course: Option<DriftCourse>,
    ) -> SpectralAnalysis {
        let parts = &self.decomposition.model;
        let problem = &parts.problem;
        let oscillations: Vec<usize> =
            (0..parts.solution.terms.len()).filter(|k| parts.solution.terms[*k].cycles > 0.0).collect();
        let courses: Vec<Vec<f64>> =
            oscillations.iter().map(|k| problem.term_values(&parts.solution, *k)).collect();
        let mut model_m = vec![0.0; record.samples.len()];
        courses.iter().for_each(|course| model_m.iter_mut().zip(course).for_each(|(sum, x)| *sum += x));
        let removed_m = self.selector.removed_signal_m(parts);
        let whole = Periodogram::new(
            &vec![Some(0.0); record.samples.len()],
            2 * (self.decomposition.amplitude_m.len() - 1),
        );
        let (amplitude_m, leakage_m) =
            (whole.amplitudes(&self.gapless_signal_m(&model_m)), whole.amplitudes(&removed_m));
        let bin_hz = record.frame_rate_hz / (2 * (amplitude_m.len() - 1)) as f64;
        let (low, high) = settings.band_hz.unwrap_or((0.0, record.frame_rate_hz / 2.0));
        let mut read: Vec<(Component, ComponentEvidence)> = oscillations
            .iter()
            .zip(&courses)
            .map(|(k, course)| self.estimate_component(*k, course, &leakage_m))
            .collect();
        read.extend(course.as_ref().and_then(|course| self.drifting_component(course)));
        read.extend(
            self.selector
                .unexplained_peaks(&self.decomposition)
                .iter()
                .map(|peak| self.component_of_peak(peak)),
        );
        read.sort_by(|a, b| b.0.amplitude_m.total_cmp(&a.0.amplitude_m));
        let (mut components, evidence): (Vec<_>, Vec<_>) = read.into_iter().unzip();
        let circumstances = RecordContext {
            frame_rate_hz: record.frame_rate_hz,
            exposure_s: record.exposure_s,
            resolution_hz: self.selector.resolution_hz(),
            fastest_hz: settings.fastest_hz,
        };
        classify_components(&mut components, &evidence, &circumstances);
        components.retain(|c| (low..=high).contains(&c.frequency_hz));
        components.truncate(settings.max_components);
        let spectrum = Spectrum {
            frequency_hz: (0..amplitude_m.len()).map(|k| k as f64 * bin_hz).collect(),
            noise_floor_m: self.decomposition.peaks.floor_m,
            resolution_hz: self.selector.resolution_hz(),
            noise_bandwidth_hz: self.selector.periodogram.noise_bandwidth_hz(record.frame_rate_hz),
            present: self.selector.periodogram.sums.present as f64 / record.samples.len() as f64,
            components,
            amplitude_m,
        };
        let relaxations = parts.solution.terms.len() - oscillations.len();
        let removed = RemovedTrend {
            detrend: settings.detrend.unwrap_or(detrend_of_trend(parts.trend())),
            relaxations,
        };
        SpectralAnalysis {
            spectrum,
            skipped_frames: 0,
            stride: 1,
            removed,
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

    /// What the spectrum is of, m: the components in every frame, so that gaps do not spread them, the rest
    /// where it is known.
    fn gapless_signal_m(&self, model_m: &[f64]) -> Vec<f64> {
        // the weights of a Hann window add up to half its frames
        let share = self.selector.periodogram.sums.first / (model_m.len() as f64 / 2.0);
        self.decomposition
            .residual_m
            .iter()
            .zip(model_m)
            .map(|(left, m)| m + left.unwrap_or(0.0) / share)
            .collect()
    }

    fn estimate_component(
        &self,
        k: usize,
        course: &[f64],
        leakage_m: &[f64],
    ) -> (Component, ComponentEvidence) {
        let parts = &self.decomposition.model;
        let problem = &parts.problem;
        let (term, free) = (&parts.solution.terms[k], &self.free_decay_model.solution.terms[k]);
        let pair = problem.quadrature_amplitudes(&parts.solution, k);
        let (noise_m, resolution_hz) = (self.noise_sd_near(term.cycles), self.selector.resolution_hz());
        let sd = self.covariance.deviations(k, pair);
        let sd_free = self
            .free_decay_covariance
            .deviations(k, problem.quadrature_amplitudes(&self.free_decay_model.solution, k));
        let shift = self.shift_by_richer_trend(k);
        let stays = term.free == FreeParameters::CyclesAndNepers || term.free == FreeParameters::Cycles;
        let cycles_sd = if stays { sd.cycles * noise_m } else { UNEXPLAINED_SD };
        let amplitude_m = math::hypot(pair[0], pair[1]);
        let (left, level) = if term.is_transient() {
            let left_m = self.selector.residual_in_envelope(&self.decomposition, term);
            (left_m / amplitude_m, self.selector.level_in_envelope(&self.decomposition, term, amplitude_m))
        } else {
            let shown_m = self.selector.windowed_amplitude_m(parts, k);
            let left_m = self.selector.significant_residual_near(&self.decomposition, term);
            (left_m / shown_m, shown_m / self.selector.noise_floor_near(&self.decomposition, term.cycles))
        };
        let piece = self.nearest_fragment(k);
        // resolutions, so cycles
        let companion = math::hypot(
            COMPANION_SHIFT * left,
            piece.as_ref().map_or(0.0, |piece| piece.distance * piece.amplitude_ratio),
        );
        let damping =
            matches!(free.free, FreeParameters::CyclesAndNepers | FreeParameters::Nepers).then(|| {
                damping_ratio_with_sd(
                    free,
                    math::hypot(math::hypot(sd_free.nepers * noise_m, shift.nepers), TAU * companion),
                )
            });
        let exhausted = self.selector.trend_grows
            && self.richer_trend_model.is_none()
            && term.cycles < EXHAUSTED_TREND_WAVES * parts.trend().fastest_waves();
        let evidence = ComponentEvidence {
            trend_exhausted: exhausted,
            trend_shift: shift.cycles / cycles_sd,
            residual_ratio: left,
            unsteady: self.unsteady_terms.contains(&k),
            slow: self.is_slow(k),
            crowded: self.is_crowded(k),
            nearest: self.distance_to_nearest(k),
            fragment_distance: piece.map(|piece| piece.distance),
            keeps_peak: stays,
            ..ComponentEvidence::default()
        };
        let bins_a_cycle = 2.0 * (leakage_m.len() - 1) as f64 / course.len() as f64;
        let frames = course.len() - term.first;
        let nepers = term.nepers * frames as f64 / course.len() as f64;
        let alone = DecayingTone { amplitude_m, nepers, noise_m };
        let component = Component {
            frequency_hz: term.cycles * resolution_hz,
            frequency_sd_hz: math::hypot(math::hypot(cycles_sd, shift.cycles), companion) * resolution_hz,
            begins_s: (term.first > 0).then(|| term.first as f64 / self.selector.frame_rate_hz),
            amplitude_m,
            amplitude_sd_m: math::hypot(
                math::hypot(sd.amplitude * noise_m, shift.amplitude * amplitude_m),
                left * amplitude_m,
            ),
            damping_ratio: damping.map(|d| d.0),
            damping_ratio_sd: damping.map(|d| d.1),
            snr_db: 20.0 * math::log10(level),
            cramer_rao_hz: alone.cramer_rao_bound_hz(frames, self.selector.frame_rate_hz),
            trend_shift_hz: self.richer_trend_model.is_some().then_some(shift.cycles * resolution_hz),
            leakage_m: leakage_m.get((term.cycles * bins_a_cycle).round() as usize).copied(),
            ..Component::from_estimator(Estimator::LeastSquares)
        };
        (component, evidence)
    }

    /// Whether it is as slow as the waves of a trend that had to grow.
    fn is_slow(&self, k: usize) -> bool {
        let parts = &self.decomposition.model;
        let grown = parts.trend().column_count() > FEWEST_COLUMNS;
        self.selector.trend_grows && grown && parts.solution.terms[k].cycles < SLOW_CYCLES
    }

    /// Whether it and two more near it begin inside the record or are over soon.
    fn is_crowded(&self, k: usize) -> bool {
        let terms = &self.decomposition.model.solution.terms;
        let near = |t: &&SinusoidTerm| t.is_transient() && (t.cycles - terms[k].cycles).abs() < NEIGHBOURHOOD;
        terms[k].is_transient() && terms.iter().filter(near).count() > CROWD_NEIGHBOURS
    }

    /// The nearest other oscillation within two resolutions or the width of the broader peak, where one of
    /// the two decays or begins inside the record: two that are steady are a pair.
    fn nearest_fragment(&self, k: usize) -> Option<PossibleFragment> {
        let (parts, terms) = (&self.decomposition.model, &self.decomposition.model.solution.terms);
        let size_m = |k: usize| {
            let [cosine, sine] = parts.problem.quadrature_amplitudes(&parts.solution, k);
            math::hypot(cosine, sine)
        };
        let steady = |term: &SinusoidTerm| term.nepers == 0.0 && term.first == 0;
        // a decaying peak is as wide as it decays
        let width = |j: usize| (terms[j].nepers.max(terms[k].nepers) / TAU).max(FRAGMENT_RESOLUTIONS);
        let piece = |j: usize| PossibleFragment {
            distance: (terms[j].cycles - terms[k].cycles).abs(),
            amplitude_ratio: (size_m(j) / size_m(k)).min(1.0),
        };
        (0..terms.len())
            .filter(|j| *j != k && terms[*j].cycles > 0.0 && !(steady(&terms[*j]) && steady(&terms[k])))
            .filter_map(|j| Some(piece(j)).filter(|piece| piece.distance < width(j)))
            .min_by(|a, b| a.distance.total_cmp(&b.distance))
    }

    /// Distance to the nearest other oscillation, resolutions.
    fn distance_to_nearest(&self, k: usize) -> Option<f64> {
        let terms = &self.decomposition.model.solution.terms;
        let others = terms.iter().enumerate().filter(|(j, t)| *j != k && t.cycles > 0.0);
        others.map(|(_, t)| (t.cycles - terms[k].cycles).abs()).min_by(f64::total_cmp)
    }

    fn fitted_oscillation(&self, k: usize) -> Oscillation {
        let parts = &self.decomposition.model;
        let (term, [cosine_m, sine_m]) =
            (&parts.solution.terms[k], parts.problem.quadrature_amplitudes(&parts.solution, k));
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

    /// The component that a drifting course is.
    fn drifting_component(&self, course: &DriftCourse) -> Option<(Component, ComponentEvidence)> {
        let range = course.range?;
        let mean = RidgeMean::from_ridge(&course.ridge);
        let alone = DecayingTone {
            amplitude_m: mean.amplitude_m,
            nepers: 0.0,
            noise_m: self.noise_sd_near(mean.frequency_hz / self.selector.resolution_hz()),
        };
        let component = Component {
            frequency_hz: mean.frequency_hz,
            frequency_sd_hz: mean.frequency_sd_hz,
            range_hz: Some(range),
            amplitude_m: mean.amplitude_m,
            amplitude_sd_m: mean.amplitude_sd_m,
            snr_db: mean.snr_db,
            cramer_rao_hz: alone
                .cramer_rao_bound_hz(self.selector.samples.len(), self.selector.frame_rate_hz),
            ..Component::from_estimator(Estimator::Ridge)
        };
        let evidence = ComponentEvidence {
            keeps_peak: true,
            followed_share: Some(course.followed_share),
            median_stray: Some(course.median_stray()),
            drift: Some((range.high_hz - range.low_hz) / self.selector.resolution_hz()),
            ..ComponentEvidence::default()
        };
        Some((component, evidence))
    }

    /// A peak that no decaying oscillation explains, as the windowed spectrum has it.
    fn component_of_peak(&self, peak: &Peak) -> (Component, ComponentEvidence) {
        let resolution_hz = self.selector.resolution_hz();
        let noise_m = self.noise_sd_near(self.selector.cycles_of_peak(peak));
        let alone = DecayingTone { amplitude_m: peak.amplitude_m, nepers: 0.0, noise_m };
        let floor_m = self.selector.noise_floor_near(&self.decomposition, self.selector.cycles_of_peak(peak));
        let component = Component {
            frequency_hz: peak.frequency_hz,
            frequency_sd_hz: UNEXPLAINED_SD * resolution_hz,
            amplitude_m: peak.amplitude_m,
            amplitude_sd_m: noise_m / self.selector.periodogram.noise_sd_m(1.0)
                * std::f64::consts::FRAC_1_SQRT_2,
            snr_db: 20.0 * math::log10(peak.amplitude_m / floor_m),
            cramer_rao_hz: alone
                .cramer_rao_bound_hz(self.selector.samples.len(), self.selector.frame_rate_hz),
            ..Component::from_estimator(Estimator::Periodogram)
        };
        (component, ComponentEvidence::default())
    }

    /// What a term moves by with a richer trend: cycles, nepers, and the share of its amplitude half way
    /// through the record.
    fn shift_by_richer_trend(&self, k: usize) -> TermDeviations {
        let Some(richer) = &self.richer_trend_model else {
            return TermDeviations { cycles: 0.0, nepers: 0.0, amplitude: 0.0 };
        };
        let half_way = |parts: &SinusoidModel| {
            let [cosine, sine] = parts.problem.quadrature_amplitudes(&parts.solution, k);
            math::hypot(cosine, sine) * math::exp(-parts.solution.terms[k].nepers / 2.0)
        };
        let (now, then) = (&self.free_decay_model.solution.terms[k], &richer.solution.terms[k]);
        TermDeviations {
            cycles: (then.cycles - now.cycles).abs(),
            nepers: (then.nepers - now.nepers).abs(),
            amplitude: (half_way(richer) / half_way(&self.free_decay_model) - 1.0).abs(),
        }
    }

    /// Standard deviation of white noise that leaves as much as is left around a frequency, m.
    fn noise_sd_near(&self, cycles: f64) -> f64 {
        let Decomposition { model: parts, amplitude_m, .. } = &self.decomposition;
        let bins_a_cycle = 2.0 * (amplitude_m.len() - 1) as f64 / self.selector.samples.len() as f64;
        let most = self.selector.samples.len() as f64 / 2.0;
        let lowest = parts.trend().fastest_waves().min(most / 2.0);
        let low = (cycles - NEIGHBOURHOOD).min(most - 2.0 * NEIGHBOURHOOD).max(lowest);
        let high = (low + 2.0 * NEIGHBOURHOOD).min(most);
        let bin = |cycles: f64| ((cycles * bins_a_cycle) as usize).min(amplitude_m.len() - 1);
        let around = &amplitude_m[bin(low)..=bin(high)];
        let mean_square = around.iter().map(|a| a * a).sum::<f64>() / around.len() as f64;
        // every oscillation inside has taken up to four of the values with it
        let values = 2.0 * (high - low);
        let taken: f64 = parts
            .solution
            .terms
            .iter()
            .filter(|t| t.cycles > low && t.cycles < high)
            .map(|t| 2.0 + t.free.count() as f64)
            .sum();
        let share = (1.0 - taken / values).max(0.25);
        self.selector.periodogram.noise_sd_m((mean_square / share).sqrt())
    }
}

/// Another oscillation that may be a piece of the same.
struct PossibleFragment {
    distance: f64,
    /// Its amplitude over that of this one, at most 1.
    amplitude_ratio: f64,
}

/// Damping ratio `d / sqrt(d^2 + (2 pi n)^2)` of `d` nepers in `n` cycles, and its deviation.
fn damping_ratio_with_sd(term: &SinusoidTerm, nepers_sd: f64) -> (f64, f64) {
    let angle = TAU * term.cycles;
    let size = math::hypot(term.nepers, angle);
    (term.nepers / size, nepers_sd * math::powi(angle / size, 2) / size)
}

/// The detrending that a trend is.
fn detrend_of_trend(trend: Trend) -> Detrend {
    match trend.column_count() {
        0 => Detrend::None,
        1 => Detrend::Mean,
        2 => Detrend::Line,
        4 => Detrend::Cubic,
        columns => Detrend::Polynomial(columns - 1),
    }
}
