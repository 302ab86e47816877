//! The parts of a record: a trend, relaxations and (decaying) sinusoids, added one after another until the
//! residual shows no peak.
//!
//! Each round computes the windowed spectrum of the residual. A peak that stands out from the noise is
//! explained by a sinusoid, whose start values come from the matrix pencil. A peak at so low a frequency that
//! a step may have caused it is explained by a sinusoid, two more degrees of the trend or a relaxation
//! `exp(-d t)`, whichever has the lowest Bayesian information criterion. Then everything is fitted again
//! together (`least_squares.rs`).

use super::least_squares::{FreeSet, SineProblem, SineSolution, SineTerm, Tolerance};
use super::peaks::{self, Peak, PeakList};
use super::periodogram::Periodogram;
use super::settings::{MAX_COMPONENTS, MIN_CYCLES};
use super::trend::Trend;
use super::{gap_filling, matrix_pencil};
use portable_math as math;
use std::f64::consts::{PI, TAU};

/// Maximum number of rounds; each adds at least one term.
const MOST_ROUNDS: usize = 12;
/// Maximum number of rounds in which the second pass tries ring-downs and pairs.
const SECOND_PASS_ROUNDS: usize = 5;
/// Number of cycles in the record below which a step causes peaks of its own: a step that takes a tenth of
/// the record has its spectrum there.
pub(super) const STEP_CYCLES: f64 = 8.0;
/// Half width, in resolutions, of the lobe of a Hann window: a residual peak closer to a term belongs to that
/// term.
pub(super) const LOBE: f64 = 2.0;
/// Decays over the record, nepers, with which a relaxation is tried: at the start of the record or, if
/// negative, at its end.
const RELAXATION_NEPERS: [f64; 8] = [5.0, 15.0, 45.0, 135.0, -5.0, -15.0, -45.0, -135.0];
const MOST_RELAXATIONS: usize = 3;
/// Minimum number of frames per unknown of the fit. With fewer frames, the fit would follow the noise.
const FRAMES_PER_UNKNOWN: usize = 4;
/// Number of frames per column that a trend alone needs, for example eight for the four columns of a cubic.
/// This is less than `FRAMES_PER_UNKNOWN`, because noise cannot imitate a trend.
pub(super) const FRAMES_PER_COLUMN: usize = 2;
/// A relaxation must lower the misfit by the square of this number of standard deviations of the noise. Eight
/// decays are tried, and one in 10,000 records of noise reaches this limit.
const RELAXATION_STANDS_OUT: f64 = 4.5;
/// Multiples of the frequency of a drifting oscillation at which peaks belong to that oscillation, because it
/// need not be a sine.
const DRIFT_HARMONICS: [f64; 4] = [1.0, 2.0, 3.0, 4.0];
/// Decays over the record, nepers, that are tried in addition to the decay from the matrix pencil, which may
/// fail if there are gaps.
const START_NEPERS: [f64; 4] = [0.0, 2.0, 6.0, 18.0];

/// A record to decompose.
pub(super) struct ModelSelector<'a> {
    /// Samples, m; `None` for a missing frame.
    pub samples: &'a [Option<f64>],
    pub frame_rate_hz: f64,
    /// Window and transform for records with the same gaps.
    pub periodogram: &'a Periodogram,
    /// Amplitude of rounding errors, m.
    pub rounding_m: f64,
    /// Whether columns may be added to the trend.
    pub trend_grows: bool,
    /// Whether noise is measured around each component, because it need not be white. False during the search
    /// for a drifting oscillation, because one that drifts over an octave looks like noise.
    pub noise_is_coloured: bool,
    /// Frequency range of a drifting oscillation; peaks in this range and in its multiples belong to that
    /// oscillation.
    pub drift_region: Option<DriftRegion>,
    offset: Vec<f64>,
    pub(super) data: Vec<f64>,
    pub(super) weights: Vec<f64>,
}

/// Frequency range of a drifting oscillation.
#[derive(Debug, Clone, Copy)]
pub(super) struct DriftRegion {
    pub low_hz: f64,
    pub high_hz: f64,
    /// Half width, Hz, of the main lobe of a window as long as the segments in which the oscillation was
    /// tracked.
    pub lobe_hz: f64,
}

/// The fitted parts of a record.
#[derive(Debug, Clone)]
pub(super) struct SineModel {
    /// The record and its trend.
    pub problem: SineProblem,
    pub solution: SineSolution,
}

impl SineModel {
    pub(super) fn trend(&self) -> Trend {
        self.problem.trend
    }

    pub(super) fn terms(&self) -> &[SineTerm] {
        &self.solution.terms
    }

    /// Indices of the terms that oscillate; the others are relaxations.
    pub(super) fn oscillations(&self) -> Vec<usize> {
        (0..self.terms().len()).filter(|k| self.terms()[*k].cycles > 0.0).collect()
    }

    /// Indices of the relaxations.
    pub(super) fn relaxations(&self) -> Vec<usize> {
        (0..self.terms().len()).filter(|k| self.terms()[*k].cycles == 0.0).collect()
    }

    /// The terms except those with the indices `out`, followed by the terms `new`.
    pub(super) fn swap_terms(&self, out: &[usize], new: impl IntoIterator<Item = SineTerm>) -> Vec<SineTerm> {
        let kept = (0..self.terms().len()).filter(|k| !out.contains(k)).map(|k| self.terms()[k]);
        kept.chain(new).collect()
    }

    /// Cosine and sine amplitude of a term, m.
    pub(super) fn amplitudes(&self, k: usize) -> [f64; 2] {
        self.problem.amplitude_pair(&self.solution, k)
    }

    /// Amplitude of a term, m.
    pub(super) fn amplitude_m(&self, k: usize) -> f64 {
        let [cosine, sine] = self.amplitudes(k);
        math::hypot(cosine, sine)
    }

    /// A term in every frame, m.
    pub(super) fn term_values(&self, k: usize) -> Vec<f64> {
        self.problem.term_values(&self.solution, k)
    }
}

/// The fitted parts and the residual.
pub(super) struct ModelFit {
    pub model: SineModel,
    /// Residual in each frame, m.
    pub residual_m: Vec<Option<f64>>,
    pub amplitude_m: Vec<f64>,
    /// Peaks and noise floor of the spectrum of the residual.
    pub peaks: PeakList,
}

impl ModelFit {
    /// Residual in each frame, m; zero for a frame without a value.
    pub(super) fn residual_or_zero(&self) -> Vec<f64> {
        self.residual_m.iter().map(|x| x.unwrap_or(0.0)).collect()
    }
}

impl<'a> ModelSelector<'a> {
    pub(super) fn new(
        samples: &'a [Option<f64>],
        frame_rate_hz: f64,
        periodogram: &'a Periodogram,
        trend: Trend,
        rounding_m: f64,
    ) -> Self {
        let offset = trend.fit_values(samples); // large offsets cost digits
        let data = samples.iter().zip(&offset).map(|(x, offset)| x.map_or(0.0, |x| x - offset)).collect();
        let weights = samples.iter().map(|x| f64::from(u8::from(x.is_some()))).collect();
        Self {
            samples,
            frame_rate_hz,
            periodogram,
            rounding_m,
            trend_grows: false,
            noise_is_coloured: false,
            drift_region: None,
            offset,
            data,
            weights,
        }
    }

    /// Whether an oscillation is slower than the fastest wave that the trend can describe.
    pub(super) fn trend_competes(&self, fit: &ModelFit) -> bool {
        let fastest = fit.model.trend().fastest_waves();
        fit.model.terms().iter().any(|term| term.cycles > 0.0 && term.cycles < fastest)
    }

    /// Trend and relaxations in every frame, m.
    pub(super) fn removed_signal_m(&self, parts: &SineModel) -> Vec<f64> {
        let relaxations = parts.relaxations().into_iter().map(|k| parts.term_values(k));
        let slow = std::iter::once(parts.problem.trend_values(&parts.solution)).chain(relaxations);
        slow.fold(self.offset.clone(), |sum, values| sum.iter().zip(values).map(|(a, b)| a + b).collect())
    }

    pub(super) fn problem_with_trend(&self, trend: Trend) -> SineProblem {
        SineProblem::new(&self.data, &self.weights, trend)
    }

    /// Decomposes the record, starting with a trend alone.
    pub(super) fn select_model(&self, trend: Trend) -> Option<ModelFit> {
        self.add_terms(self.fit_model(self.problem_with_trend(trend), &[], Tolerance::Coarse)?, false)
    }

    /// Decomposes the record again without the terms that lie in the range of a drifting oscillation.
    pub(super) fn select_without_drift(&self, fit: &ModelFit) -> Option<ModelFit> {
        let parts = &fit.model;
        let stays =
            |t: &SineTerm| t.cycles == 0.0 || !self.is_in_drift_region(t.cycles * self.resolution_hz());
        let kept: Vec<SineTerm> = parts.terms().iter().copied().filter(stays).collect();
        self.add_terms(self.fit_model(parts.problem.clone(), &kept, Tolerance::Coarse)?, false)
    }

    /// Continues the decomposition with terms that begin late or end soon, and with pairs of lines that were
    /// found as a single line.
    pub(super) fn run_second_pass(&self, fit: ModelFit) -> Option<ModelFit> {
        self.add_terms(fit.model, true)
    }

    fn add_terms(&self, parts: SineModel, closely: bool) -> Option<ModelFit> {
        let mut fit = self.decompose(parts);
        for round in 0..MOST_ROUNDS {
            let mut best = self.improve_model(&fit);
            if closely && round < SECOND_PASS_ROUNDS {
                best = self.refine_candidates(&fit, best);
            }
            let Some(parts) = best else { break };
            fit = self.decompose(parts);
        }
        if closely {
            fit = self.decompose(self.relocate_transients(fit.model));
        }
        self.prune_terms(fit)
    }

    /// The model with another part added; `None` if no peak stands out from the noise or if the frames do not
    /// determine a further part.
    fn improve_model(&self, fit: &ModelFit) -> Option<SineModel> {
        let parts = &fit.model;
        let fresh = fit.peaks.accepted.iter().filter(|p| self.is_new_peak(parts.terms(), p));
        let (mut high, low): (Vec<Peak>, Vec<Peak>) =
            fresh.copied().partition(|p| self.cycles_of_peak(p) >= STEP_CYCLES);
        // a high peak is compared with the noise around it; a low peak may be the residue of a step
        high.retain(|p| !self.noise_is_coloured || self.stands_out_widely(fit, p));
        let room = MAX_COMPONENTS.saturating_sub(parts.oscillations().len());
        let largest = low.first().filter(|l| high.first().is_none_or(|h| l.amplitude_m > h.amplitude_m));
        if let Some(parts) = largest.and_then(|peak| self.explain_low_peak(fit, peak)) {
            return Some(parts);
        }
        if !high.is_empty() && room > 0 {
            let new = self.start_sinusoids(fit, &high).into_iter().take(room);
            let terms = parts.swap_terms(&[], new);
            return self.fit_model(parts.problem.clone(), &terms, Tolerance::Coarse);
        }
        let with = self.trend_grows.then(|| self.with_relaxation(fit)).flatten()?;
        self.fit_if_better(parts, &with)
    }

    /// Frequency of a peak as a number of cycles in the length of the record.
    pub(super) fn cycles_of_peak(&self, peak: &Peak) -> f64 {
        peak.frequency_hz / self.resolution_hz()
    }

    /// Reciprocal of the length of the record, Hz.
    pub(super) fn resolution_hz(&self) -> f64 {
        self.frame_rate_hz / self.samples.len() as f64
    }

    /// Whether a peak lies outside the lobe of every term and is not part of a drifting oscillation.
    pub(super) fn is_new_peak(&self, terms: &[SineTerm], peak: &Peak) -> bool {
        let cycles = self.cycles_of_peak(peak);
        let own = |t: &SineTerm| t.cycles > 0.0 && is_in_lobe(cycles, t);
        cycles + 1.0 < self.samples.len() as f64 / 2.0
            && !terms.iter().any(own)
            && !self.is_in_drift_region(peak.frequency_hz)
    }

    /// Whether a frequency lies in the range of a drifting oscillation or in a multiple of this range.
    pub(super) fn is_in_drift_region(&self, hz: f64) -> bool {
        self.drift_region.is_some_and(|DriftRegion { low_hz, high_hz, lobe_hz }| {
            let near = |multiple: f64| hz > multiple * low_hz - lobe_hz && hz < multiple * high_hz + lobe_hz;
            DRIFT_HARMONICS.into_iter().any(near)
        })
    }

    /// Explains a low peak by a sinusoid, a richer trend or a relaxation, whichever gives the lowest Bayesian
    /// information criterion.
    fn explain_low_peak(&self, fit: &ModelFit, peak: &Peak) -> Option<SineModel> {
        let parts = &fit.model;
        let mut candidates = Vec::new();
        if self.trend_grows {
            let richer = parts.trend().next_richer().map(|richer| self.problem_with_trend(richer));
            candidates.extend(richer.and_then(|p| self.solve_amplitudes(p, parts.terms().to_vec())));
            candidates.extend(self.with_relaxation(fit));
        }
        let resolvable = self.cycles_of_peak(peak) >= MIN_CYCLES.max(parts.trend().fastest_waves() + 1.0);
        if resolvable || candidates.is_empty() {
            let terms = parts.swap_terms(&[], [self.start_sinusoid(fit, peak)]);
            candidates.extend(self.solve_amplitudes(parts.problem.clone(), terms));
        }
        self.fit_if_better(parts, &self.select_best(candidates)?)
    }

    /// The model with the lowest Bayesian information criterion; `None` without models.
    pub(super) fn select_best(&self, models: impl IntoIterator<Item = SineModel>) -> Option<SineModel> {
        let order = |a: &SineModel, b: &SineModel| self.bic_of(a).total_cmp(&self.bic_of(b));
        models.into_iter().min_by(order)
    }

    /// The fitted candidate, if its Bayesian information criterion is lower than that of the model `parts`.
    fn fit_if_better(&self, parts: &SineModel, candidate: &SineModel) -> Option<SineModel> {
        self.fit_model(candidate.problem.clone(), candidate.terms(), Tolerance::Coarse)
            .filter(|fitted| self.bic_of(fitted) < self.bic_of(parts))
    }

    /// The model with the relaxation that lowers the misfit most, if by more than noise. A relaxation found
    /// before may have absorbed a part of the new one, which then appears only when both are fitted again.
    fn with_relaxation(&self, fit: &ModelFit) -> Option<SineModel> {
        let parts = &fit.model;
        let relaxations = parts.relaxations().len();
        if relaxations >= MOST_RELAXATIONS {
            return None;
        }
        let with = |nepers: f64| {
            let more = parts.swap_terms(&[], [SineTerm::from_start(0.0, nepers, FreeSet::Nepers)]);
            self.solve_amplitudes(parts.problem.clone(), more)
        };
        let tried = RELAXATION_NEPERS.into_iter().filter_map(with);
        let best = tried.min_by(|a, b| a.solution.misfit.total_cmp(&b.solution.misfit))?;
        let noise_m = self.periodogram.noise_sd_m(fit.peaks.floor_m);
        let least = parts.solution.misfit - math::powi(RELAXATION_STANDS_OUT * noise_m, 2);
        if best.solution.misfit < least {
            return Some(best);
        }
        let moved = || self.fit_model(best.problem.clone(), best.terms(), Tolerance::Coarse);
        (relaxations > 0).then(moved).flatten().filter(|moved| moved.solution.misfit < least)
    }

    /// A sinusoid for each peak, largest first, except for peaks in the lobe of a larger one: the broad peak
    /// of a fast decay has noise peaks on its flanks.
    fn start_sinusoids(&self, fit: &ModelFit, peaks: &[Peak]) -> Vec<SineTerm> {
        let mut terms: Vec<SineTerm> = Vec::new();
        for peak in peaks {
            if !terms.iter().any(|t| is_in_lobe(self.cycles_of_peak(peak), t)) {
                terms.push(self.start_sinusoid(fit, peak));
            }
        }
        terms
    }

    /// The sinusoid from which the fit of a peak starts.
    fn start_sinusoid(&self, fit: &ModelFit, peak: &Peak) -> SineTerm {
        let cycles = self.cycles_of_peak(peak);
        let filled = gap_filling::fill_short_gaps(&fit.residual_m).into_iter();
        let left: Vec<f64> = filled.map(|x| x.unwrap_or(0.0)).collect();
        let term = |cycles, nepers| SineTerm::from_start(cycles, nepers, FreeSet::Both);
        let pole = matrix_pencil::find_pole(&left, cycles).map(|pole| term(pole.cycles, pole.nepers));
        let tried = START_NEPERS.map(|nepers| term(cycles, nepers));
        let problem = SineProblem::new(&left, &self.weights, Trend::Polynomial(0));
        let misfit =
            |term: &SineTerm| problem.solve_amplitudes(vec![*term]).map_or(f64::INFINITY, |s| s.misfit);
        let usable = pole.into_iter().chain(tried).filter(SineTerm::is_oscillation);
        let starts = usable.map(|term| (misfit(&term), term));
        starts.min_by(|a, b| a.0.total_cmp(&b.0)).map_or(tried[0], |(_, term)| term)
    }

    /// The model with these terms and their best amplitudes, if there are enough frames.
    fn solve_amplitudes(&self, problem: SineProblem, terms: Vec<SineTerm>) -> Option<SineModel> {
        let enough = self.has_frames_for(&problem, &terms);
        let solution = enough.then(|| problem.solve_amplitudes(terms)).flatten()?;
        Some(SineModel { problem, solution })
    }

    /// The fitted model with these terms, if there are enough frames. Frequencies that were fixed before may
    /// change again.
    pub(super) fn fit_model(
        &self,
        problem: SineProblem,
        terms: &[SineTerm],
        care: Tolerance,
    ) -> Option<SineModel> {
        let released = |t: &SineTerm| {
            if t.cycles > 0.0 { SineTerm { free: FreeSet::Both, ..*t } } else { *t }
        };
        let terms: Vec<SineTerm> = terms.iter().map(released).collect();
        let enough = self.has_frames_for(&problem, &terms);
        let solution = enough.then(|| problem.gauss_newton(&terms, care)).flatten()?;
        Some(SineModel { problem, solution })
    }

    /// Whether there are enough frames for the unknowns. A trend alone needs fewer.
    pub(super) fn has_frames_for(&self, problem: &SineProblem, terms: &[SineTerm]) -> bool {
        let each = if terms.is_empty() { FRAMES_PER_COLUMN } else { FRAMES_PER_UNKNOWN };
        self.periodogram.sums.present >= each * problem.unknown_count(terms)
    }

    /// The same terms with a richer trend; `None` if the trend cannot become richer.
    pub(super) fn with_richer_trend(&self, parts: &SineModel) -> Option<SineModel> {
        let problem = self.problem_with_trend(parts.trend().next_richer()?);
        self.fit_model(problem, parts.terms(), Tolerance::Fine)
    }

    /// Bayesian information criterion: `N ln(misfit) + k ln N` for `N` frames with a value and `k` unknowns.
    pub(super) fn bic_of(&self, parts: &SineModel) -> f64 {
        self.bic_with(parts, parts.solution.misfit, 0.0)
    }

    /// The Bayesian information criterion of a model with another misfit, m^2, and with `more` additional
    /// unknowns.
    pub(super) fn bic_with(&self, parts: &SineModel, misfit: f64, more: f64) -> f64 {
        let present = self.periodogram.sums.present as f64;
        let terms = parts.terms();
        let late = terms.iter().filter(|t| t.first > 0).count(); // the first frame is an unknown too
        let unknowns = (parts.problem.unknown_count(terms) + late) as f64 + more;
        present * math::ln(misfit.max(f64::MIN_POSITIVE)) + unknowns * math::ln(present)
    }

    /// Residual of a model, its spectrum and peaks.
    pub(super) fn decompose(&self, model: SineModel) -> ModelFit {
        let values = model.problem.model_values(&model.solution);
        let left = self.samples.iter().zip(self.data.iter().zip(&values));
        let residual_m: Vec<Option<f64>> = left.map(|(x, (data, m))| x.map(|_| data - m)).collect();
        let rest: Vec<f64> = residual_m.iter().map(|x| x.unwrap_or(0.0)).collect();
        let amplitude_m = self.periodogram.amplitudes(&rest);
        let spectrum = self.periodogram.windowed_spectrum(&amplitude_m, self.frame_rate_hz, self.rounding_m);
        let peaks = peaks::find_peaks(&spectrum, (0.0, self.frame_rate_hz / 2.0), 2 * MAX_COMPONENTS);
        ModelFit { model, residual_m, amplitude_m, peaks }
    }

    /// Drops sinusoids that noise alone may have caused, and those that are smaller than the residual near
    /// them.
    fn prune_terms(&self, mut fit: ModelFit) -> Option<ModelFit> {
        for _ in 0..MOST_ROUNDS {
            let kept = self.find_significant_terms(&fit)?;
            let all = kept.iter().all(|kept| *kept);
            let terms = fit.model.terms().iter().zip(kept);
            let kept: Vec<SineTerm> = terms.filter_map(|(term, kept)| kept.then_some(*term)).collect();
            let care = if all { Tolerance::Fine } else { Tolerance::Coarse };
            fit = self.decompose(self.fit_model(fit.model.problem, &kept, care)?);
            if all {
                break;
            }
        }
        Some(fit)
    }

    /// For each term, whether it stands out from the noise, keeps its peak and is larger than the residual
    /// near it.
    fn find_significant_terms(&self, fit: &ModelFit) -> Option<Vec<bool>> {
        let parts = &fit.model;
        let covariance = parts.problem.covariance(&parts.solution)?;
        let white_m = self.periodogram.noise_sd_m(fit.peaks.floor_m);
        let kept = |(k, term): (usize, &SineTerm)| {
            // the noise in a bin has a cosine and a sine part, so its root mean square is sqrt(2) times the
            // standard deviation of an amplitude
            let sd = covariance.deviations(k, parts.amplitudes(k)).amplitude;
            let least = fit.peaks.detection * std::f64::consts::SQRT_2 * sd;
            let amplitude_m = parts.amplitude_m(k);
            let stands_out = || {
                !self.noise_is_coloured
                    || amplitude_m > least * self.noise_sd_for_term(fit, term)
                    || self.exceeds_residual(fit, k)
            };
            let explains = || match term.is_transient() {
                true => self.residual_in_envelope(fit, term) < amplitude_m,
                false => self.largest_peak_near(fit, term) < self.windowed_amplitude_m(parts, k),
            };
            term.cycles == 0.0 || (amplitude_m > least * white_m && explains() && stands_out())
        };
        let terms = parts.terms();
        let stays = |t: &SineTerm| t.cycles == 0.0 || matches!(t.free, FreeSet::Both | FreeSet::Cycles);
        let stay: Vec<bool> = terms.iter().map(stays).collect();
        // a term that left its peak may be at the peak of another term; then both amplitudes are unknown
        let judged = || terms.iter().enumerate().map(kept).collect();
        Some(if stay.iter().all(|stays| *stays) { judged() } else { stay })
    }
}

/// Whether a frequency, cycles in the record, lies in the peak of a term.
pub(super) fn is_in_lobe(cycles: f64, term: &SineTerm) -> bool {
    (cycles - term.cycles).abs() < lobe_half_width(term)
}
/// Half width, in cycles in the record, of the peak of a term. It combines the lobe of the window and the
/// decay of the term.
pub(super) fn lobe_half_width(term: &SineTerm) -> f64 {
    LOBE + term.nepers.abs() / PI
}

impl SineTerm {
    /// Whether the term is an oscillation whose decay is within the bounds and less than `2 pi` nepers per
    /// cycle.
    pub(super) fn is_oscillation(&self) -> bool {
        let (low, high) = self.nepers_bounds();
        self.cycles > 0.0 && self.nepers > low && self.nepers < high && self.nepers < TAU * self.cycles
    }
}
