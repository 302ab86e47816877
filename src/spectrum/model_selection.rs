//! What a record is made of: a trend, relaxations and (decaying) sinusoids, added one after another until the
//! rest shows no peak.
//!
//! Each round takes the windowed spectrum of what is left. A peak that stands out of the noise is
//! explained by a sinusoid whose start comes from the matrix pencil; one so low that the flip may have made
//! it, by whichever of a sinusoid, two more degrees of the trend or a relaxation `exp(-d t)` has the least
//! Bayesian information criterion. Then everything is fitted again together (`least_squares.rs`).

use super::least_squares::{FreeParameters, SinusoidProblem, SinusoidSolution, SinusoidTerm, Tolerance};
use super::peaks::{self, Peak, PeakList};
use super::periodogram::Periodogram;
use super::settings::{MAX_COMPONENTS, MIN_CYCLES};
use super::trend::Trend;
use super::{gap_filling, matrix_pencil};
use crate::math;
use std::f64::consts::{PI, TAU};

/// Rounds; each adds at least one term.
const MOST_ROUNDS: usize = 12;
/// Rounds of a closer look.
const SECOND_PASS_ROUNDS: usize = 5;
/// Cycles in the record below which a flip makes peaks of its own: a step of a tenth of the record has its
/// spectrum there.
pub(super) const STEP_CYCLES: f64 = 8.0;
/// Half width of the lobe of a Hann window, resolutions: what is left closer to a term is its own doing.
pub(super) const LOBE: f64 = 2.0;
/// Nepers over the record at which a relaxation is tried, at its start or, negative, at its end.
const RELAXATION_NEPERS: [f64; 8] = [5.0, 15.0, 45.0, 135.0, -5.0, -15.0, -45.0, -135.0];
const MOST_RELAXATIONS: usize = 3;
/// Frames for each unknown below which the fit would follow the noise.
const FRAMES_PER_UNKNOWN: usize = 4;
/// The same for a trend alone, which is no oscillation that noise could feign: a cubic takes four frames and
/// as many are left.
pub(super) const FRAMES_PER_COLUMN: usize = 2;
/// Deviations of the noise by which a relaxation must lower what is left: eight places and two ends are
/// tried, and one in 10,000 noises does.
const RELAXATION_STANDS_OUT: f64 = 4.5;
/// Multiples of a drifting cycle whose peaks are its own: it is no sine.
const DRIFT_HARMONICS: [f64; 4] = [1.0, 2.0, 3.0, 4.0];
/// Nepers over the record tried in addition to what the pencil gives: among gaps it may give nothing of use.
const START_NEPERS: [f64; 4] = [0.0, 2.0, 6.0, 18.0];

/// The record to be taken apart.
pub(super) struct ModelSelector<'a> {
    /// Samples, m; `None` where there is none.
    pub samples: &'a [Option<f64>],
    pub frame_rate_hz: f64,
    /// The spectrum of records with these gaps.
    pub periodogram: &'a Periodogram,
    /// Amplitude of rounding, m.
    pub rounding_m: f64,
    /// Whether the trend may grow.
    pub trend_grows: bool,
    /// Whether noise is measured around each component, as it need not be white: a cycle that drifts over an
    /// octave is no noise, so it is sought before.
    pub noise_is_coloured: bool,
    /// Between these frequencies, Hz, and their multiples, peaks are a drifting cycle's.
    pub drift_region: Option<DriftRegion>,
    offset: Vec<f64>,
    pub(super) data: Vec<f64>,
    pub(super) weights: Vec<f64>,
}

/// Where a drifting cycle shows itself.
#[derive(Debug, Clone, Copy)]
pub(super) struct DriftRegion {
    pub low_hz: f64,
    pub high_hz: f64,
    /// Half width of the lobe of the segments in which it was followed, Hz: it keeps no frequency for longer.
    pub lobe_hz: f64,
}

/// A record taken apart.
#[derive(Debug, Clone)]
pub(super) struct SinusoidModel {
    /// The record and its trend.
    pub problem: SinusoidProblem,
    pub solution: SinusoidSolution,
}

impl SinusoidModel {
    pub(super) fn trend(&self) -> Trend {
        self.problem.trend
    }
}

/// The parts and what they leave.
pub(super) struct Decomposition {
    pub model: SinusoidModel,
    /// What is left in each frame, m.
    pub residual_m: Vec<Option<f64>>,
    pub amplitude_m: Vec<f64>,
    /// Its peaks and noise floor.
    pub peaks: PeakList,
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

    /// Whether an oscillation is slower than the fastest wave that the trend can show.
    pub(super) fn trend_competes(&self, explained: &Decomposition) -> bool {
        let fastest = explained.model.trend().fastest_waves();
        explained.model.solution.terms.iter().any(|term| term.cycles > 0.0 && term.cycles < fastest)
    }

    /// What the trend and the relaxations take from every frame, m.
    pub(super) fn removed_signal_m(&self, parts: &SinusoidModel) -> Vec<f64> {
        let problem = &parts.problem;
        let relaxations = (0..parts.solution.terms.len())
            .filter(|k| parts.solution.terms[*k].cycles == 0.0)
            .map(|k| problem.term_values(&parts.solution, k));
        let slow = std::iter::once(problem.trend_values(&parts.solution)).chain(relaxations);
        slow.fold(self.offset.clone(), |sum, values| sum.iter().zip(values).map(|(a, b)| a + b).collect())
    }

    pub(super) fn problem_with_trend(&self, trend: Trend) -> SinusoidProblem {
        SinusoidProblem::new(&self.data, &self.weights, trend)
    }

    /// Takes the record apart, starting with a trend alone.
    pub(super) fn select_model(&self, trend: Trend) -> Option<Decomposition> {
        self.add_terms(self.fit_model(self.problem_with_trend(trend), &[], Tolerance::Coarse)?, false)
    }

    /// Takes the record apart again without the terms of a drifting cycle.
    pub(super) fn select_without_drift(&self, explained: &Decomposition) -> Option<Decomposition> {
        let parts = &explained.model;
        let drifts = |t: &SinusoidTerm| self.is_in_drift_region(t.cycles * self.resolution_hz());
        let kept: Vec<SinusoidTerm> =
            parts.solution.terms.iter().copied().filter(|t| t.cycles == 0.0 || !drifts(t)).collect();
        self.add_terms(self.fit_model(parts.problem.clone(), &kept, Tolerance::Coarse)?, false)
    }

    /// Goes on with what begins late, is over soon, or is two where one was seen.
    pub(super) fn run_second_pass(&self, explained: Decomposition) -> Option<Decomposition> {
        self.add_terms(explained.model, true)
    }

    fn add_terms(&self, parts: SinusoidModel, closely: bool) -> Option<Decomposition> {
        let mut explained = self.decompose(parts);
        for round in 0..MOST_ROUNDS {
            let improved = self.improve_model(&explained);
            let best = if closely && round < SECOND_PASS_ROUNDS {
                self.refine_candidates(&explained, improved)
            } else {
                improved
            };
            let Some(parts) = best else { break };
            explained = self.decompose(parts);
        }
        if closely {
            explained = self.decompose(self.relocate_transients(explained.model));
        }
        self.prune_terms(explained)
    }

    /// The parts once another is added; `None` where nothing stands out or no more can be known.
    fn improve_model(&self, explained: &Decomposition) -> Option<SinusoidModel> {
        let parts = &explained.model;
        let fresh: Vec<Peak> = explained
            .peaks
            .accepted
            .iter()
            .copied()
            .filter(|p| self.is_new_peak(&parts.solution.terms, p))
            .collect();
        let (high, low): (Vec<Peak>, Vec<Peak>) =
            fresh.into_iter().partition(|p| self.cycles_of_peak(p) >= STEP_CYCLES);
        // noise need not be white; what a flip leaves is no noise
        let high: Vec<Peak> = high
            .into_iter()
            .filter(|p| !self.noise_is_coloured || self.stands_out_widely(explained, p))
            .collect();
        let sinusoids = parts.solution.terms.iter().filter(|t| t.cycles > 0.0).count();
        let room = MAX_COMPONENTS.saturating_sub(sinusoids);
        let low_first =
            low.first().is_some_and(|l| high.first().is_none_or(|h| l.amplitude_m > h.amplitude_m));
        if let Some(parts) =
            low.first().filter(|_| low_first).and_then(|peak| self.explain_low_peak(explained, peak))
        {
            return Some(parts);
        }
        if !high.is_empty() && room > 0 {
            let mut terms = parts.solution.terms.clone();
            terms.extend(self.start_sinusoids(explained, &high).into_iter().take(room));
            return self.fit_model(parts.problem.clone(), &terms, Tolerance::Coarse);
        }
        if self.trend_grows {
            self.with_relaxation(explained).and_then(|with| self.fit_if_better(parts, &with))
        } else {
            None
        }
    }

    /// Cycles of a peak in the record.
    pub(super) fn cycles_of_peak(&self, peak: &Peak) -> f64 {
        peak.frequency_hz / self.resolution_hz()
    }

    /// One over the record's length, Hz.
    pub(super) fn resolution_hz(&self) -> f64 {
        self.frame_rate_hz / self.samples.len() as f64
    }

    /// Whether a peak is no term's own and not of a drifting cycle.
    pub(super) fn is_new_peak(&self, terms: &[SinusoidTerm], peak: &Peak) -> bool {
        let cycles = self.cycles_of_peak(peak);
        let own = |t: &SinusoidTerm| t.cycles > 0.0 && (cycles - t.cycles).abs() < lobe_half_width(t);
        cycles + 1.0 < self.samples.len() as f64 / 2.0
            && !terms.iter().any(own)
            && !self.is_in_drift_region(peak.frequency_hz)
    }

    /// Whether a frequency is one of a drifting cycle.
    pub(super) fn is_in_drift_region(&self, hz: f64) -> bool {
        let near = |multiple: f64, d: DriftRegion| {
            hz > multiple * d.low_hz - d.lobe_hz && hz < multiple * d.high_hz + d.lobe_hz
        };
        self.drift_region
            .is_some_and(|drifting| DRIFT_HARMONICS.iter().any(|multiple| near(*multiple, drifting)))
    }

    /// A low peak by a sinusoid, more trend or a relaxation, whichever explains most with least.
    fn explain_low_peak(&self, explained: &Decomposition, peak: &Peak) -> Option<SinusoidModel> {
        let parts = &explained.model;
        let mut candidates = Vec::new();
        if self.trend_grows {
            candidates.extend(parts.trend().next_richer().and_then(|richer| {
                self.solve_amplitudes(self.problem_with_trend(richer), parts.solution.terms.clone())
            }));
            candidates.extend(self.with_relaxation(explained));
        }
        let resolvable = self.cycles_of_peak(peak) >= MIN_CYCLES.max(parts.trend().fastest_waves() + 1.0);
        if resolvable || candidates.is_empty() {
            let mut terms = parts.solution.terms.clone();
            terms.push(self.start_sinusoid(explained, peak));
            candidates.extend(self.solve_amplitudes(parts.problem.clone(), terms));
        }
        let best = candidates
            .into_iter()
            .min_by(|a, b| self.information_criterion(a).total_cmp(&self.information_criterion(b)))?;
        self.fit_if_better(parts, &best)
    }

    /// The candidate once fitted, if it explains more than what there is.
    fn fit_if_better(&self, parts: &SinusoidModel, candidate: &SinusoidModel) -> Option<SinusoidModel> {
        self.fit_model(candidate.problem.clone(), &candidate.solution.terms, Tolerance::Coarse)
            .filter(|fitted| self.information_criterion(fitted) < self.information_criterion(parts))
    }

    /// With the relaxation that lowers the rest most, if it does so by more than noise lets it. One that is
    /// there already has taken on as much of another as it could: both must move before the other shows.
    fn with_relaxation(&self, explained: &Decomposition) -> Option<SinusoidModel> {
        let parts = &explained.model;
        let terms = &parts.solution.terms;
        let relaxations = terms.iter().filter(|t| t.cycles == 0.0).count();
        if relaxations >= MOST_RELAXATIONS {
            return None;
        }
        let with = |nepers: &f64| {
            let mut more = terms.clone();
            more.push(SinusoidTerm::from_start(0.0, *nepers, FreeParameters::Nepers));
            self.solve_amplitudes(parts.problem.clone(), more)
        };
        let best = RELAXATION_NEPERS
            .iter()
            .filter_map(with)
            .min_by(|a, b| a.solution.misfit.total_cmp(&b.solution.misfit))?;
        let noise_m = self.periodogram.noise_sd_m(explained.peaks.floor_m);
        let least = parts.solution.misfit - math::powi(RELAXATION_STANDS_OUT * noise_m, 2);
        if best.solution.misfit < least {
            return Some(best);
        }
        let moved = || self.fit_model(best.problem.clone(), &best.solution.terms, Tolerance::Coarse);
        (relaxations > 0).then(moved).flatten().filter(|moved| moved.solution.misfit < least)
    }

    /// A sinusoid for each peak, largest first, but not for one in the lobe of a larger: a fast decay has the
    /// noise on its flanks for peaks.
    fn start_sinusoids(&self, explained: &Decomposition, peaks: &[Peak]) -> Vec<SinusoidTerm> {
        let mut terms: Vec<SinusoidTerm> = Vec::new();
        for peak in peaks {
            let cycles = self.cycles_of_peak(peak);
            if !terms.iter().any(|t| (cycles - t.cycles).abs() < lobe_half_width(t)) {
                terms.push(self.start_sinusoid(explained, peak));
            }
        }
        terms
    }

    /// Where the fit of a sinusoid starts.
    fn start_sinusoid(&self, explained: &Decomposition, peak: &Peak) -> SinusoidTerm {
        let cycles = self.cycles_of_peak(peak);
        let left: Vec<f64> = gap_filling::fill_short_gaps(&explained.residual_m)
            .into_iter()
            .map(|x| x.unwrap_or(0.0))
            .collect();
        let of_pencil = matrix_pencil::find_pole(&left, cycles)
            .map(|pole| SinusoidTerm::from_start(pole.cycles, pole.nepers, FreeParameters::CyclesAndNepers));
        let tried = START_NEPERS
            .map(|nepers| SinusoidTerm::from_start(cycles, nepers, FreeParameters::CyclesAndNepers));
        let problem = SinusoidProblem::new(&left, &self.weights, Trend::Polynomial(0));
        let misfit =
            |term: &SinusoidTerm| problem.solve_amplitudes(vec![*term]).map_or(f64::INFINITY, |s| s.misfit);
        let starts = of_pencil
            .into_iter()
            .chain(tried)
            .filter(SinusoidTerm::is_oscillation)
            .map(|term| (misfit(&term), term));
        starts.min_by(|a, b| a.0.total_cmp(&b.0)).map_or(tried[0], |(_, term)| term)
    }

    /// Amplitudes for these terms, if there are frames enough.
    fn solve_amplitudes(&self, problem: SinusoidProblem, terms: Vec<SinusoidTerm>) -> Option<SinusoidModel> {
        let solved =
            self.has_frames_for(&problem, &terms).then(|| problem.solve_amplitudes(terms)).flatten()?;
        Some(SinusoidModel { problem, solution: solved })
    }

    /// The terms moved to where they leave least, if there are frames enough; a frequency held before is free
    /// again.
    pub(super) fn fit_model(
        &self,
        problem: SinusoidProblem,
        terms: &[SinusoidTerm],
        care: Tolerance,
    ) -> Option<SinusoidModel> {
        let released = |t: &SinusoidTerm| {
            if t.cycles > 0.0 { SinusoidTerm { free: FreeParameters::CyclesAndNepers, ..*t } } else { *t }
        };
        let terms: Vec<SinusoidTerm> = terms.iter().map(released).collect();
        let solved =
            self.has_frames_for(&problem, &terms).then(|| problem.gauss_newton(&terms, care)).flatten()?;
        Some(SinusoidModel { problem, solution: solved })
    }

    /// Whether there are frames enough: a trend alone needs fewer, and what a short record cannot tell apart
    /// is only ever a component.
    pub(super) fn has_frames_for(&self, problem: &SinusoidProblem, terms: &[SinusoidTerm]) -> bool {
        let each = if terms.is_empty() { FRAMES_PER_COLUMN } else { FRAMES_PER_UNKNOWN };
        self.periodogram.sums.present >= each * problem.unknown_count(terms)
    }

    /// The same terms with a richer trend, if there is one.
    pub(super) fn with_richer_trend(&self, parts: &SinusoidModel) -> Option<SinusoidModel> {
        self.fit_model(
            self.problem_with_trend(parts.trend().next_richer()?),
            &parts.solution.terms,
            Tolerance::Fine,
        )
    }

    /// Bayesian information criterion: `N ln(misfit) + k ln N`.
    pub(super) fn information_criterion(&self, parts: &SinusoidModel) -> f64 {
        self.information_criterion_of(parts, parts.solution.misfit, 0.0)
    }

    /// The same for another misfit, m^2, and more unknowns.
    pub(super) fn information_criterion_of(&self, parts: &SinusoidModel, misfit: f64, more: f64) -> f64 {
        let present = self.periodogram.sums.present as f64;
        let terms = &parts.solution.terms;
        let late = terms.iter().filter(|t| t.first > 0).count(); // a first frame is a number too
        let unknowns = (parts.problem.unknown_count(terms) + late) as f64 + more;
        present * math::ln(misfit.max(f64::MIN_POSITIVE)) + unknowns * math::ln(present)
    }

    /// What parts leave, and its peaks.
    pub(super) fn decompose(&self, parts: SinusoidModel) -> Decomposition {
        let model = parts.problem.model_values(&parts.solution);
        let left: Vec<Option<f64>> = self
            .samples
            .iter()
            .zip(self.data.iter().zip(&model))
            .map(|(x, (data, m))| x.map(|_| data - m))
            .collect();
        let rest: Vec<f64> = left.iter().map(|x| x.unwrap_or(0.0)).collect();
        let amplitude_m = self.periodogram.amplitudes(&rest);
        let spectrum = self.periodogram.windowed_spectrum(&amplitude_m, self.frame_rate_hz, self.rounding_m);
        let found = peaks::find_peaks(&spectrum, (0.0, self.frame_rate_hz / 2.0), 2 * MAX_COMPONENTS);
        Decomposition { model: parts, residual_m: left, amplitude_m, peaks: found }
    }

    /// Without the sinusoids that noise alone may have made, and those that explain less than they leave.
    fn prune_terms(&self, mut explained: Decomposition) -> Option<Decomposition> {
        for _ in 0..MOST_ROUNDS {
            let (problem, terms) = (explained.model.problem.clone(), &explained.model.solution.terms);
            let kept = self.find_significant_terms(&explained)?;
            let all = kept.iter().all(|kept| *kept);
            let kept: Vec<SinusoidTerm> =
                terms.iter().zip(kept).filter_map(|(term, kept)| kept.then_some(*term)).collect();
            explained = self.decompose(self.fit_model(
                problem,
                &kept,
                if all { Tolerance::Fine } else { Tolerance::Coarse },
            )?);
            if all {
                break;
            }
        }
        Some(explained)
    }

    /// Which terms stand out of the noise, keep their place and explain more than they leave.
    fn find_significant_terms(&self, explained: &Decomposition) -> Option<Vec<bool>> {
        let parts = &explained.model;
        let problem = &parts.problem;
        let covariance = problem.covariance(&parts.solution)?;
        let white_m = self.periodogram.noise_sd_m(explained.peaks.floor_m);
        let kept = |(k, term): (usize, &SinusoidTerm)| {
            let pair = problem.quadrature_amplitudes(&parts.solution, k);
            // noise of a bin is both parts of an amplitude, so it is the square root of two larger than the
            // deviation
            let least = explained.peaks.detection
                * std::f64::consts::SQRT_2
                * covariance.deviations(k, pair).amplitude;
            let amplitude_m = math::hypot(pair[0], pair[1]);
            let stands_out = || {
                !self.noise_is_coloured
                    || amplitude_m > least * self.noise_sd_for_term(explained, term)
                    || self.exceeds_slow_residuals(explained, k)
            };
            let explains = || match term.is_transient() {
                true => self.residual_in_envelope(explained, term) < amplitude_m,
                false => self.largest_peak_near(explained, term) < self.windowed_amplitude_m(parts, k),
            };
            term.cycles == 0.0 || (amplitude_m > least * white_m && explains() && stands_out())
        };
        let terms = &parts.solution.terms;
        let stay: Vec<bool> = terms
            .iter()
            .map(|t| {
                t.cycles == 0.0 || matches!(t.free, FreeParameters::CyclesAndNepers | FreeParameters::Cycles)
            })
            .collect();
        // a term that has left its peak may have gone to another's, and neither's amplitude is known while
        // both are there
        let judged = || terms.iter().enumerate().map(kept).collect();
        Some(if stay.iter().all(|stays| *stays) { judged() } else { stay })
    }
}

/// Half width of a term's peak, cycles in the record: that of the window's lobe and of its decay.
pub(super) fn lobe_half_width(term: &SinusoidTerm) -> f64 {
    LOBE + term.nepers.abs() / PI
}

impl SinusoidTerm {
    /// Whether it swings more than once before it is gone.
    pub(super) fn is_oscillation(&self) -> bool {
        let (low, high) = self.nepers_bounds();
        self.cycles > 0.0 && self.nepers > low && self.nepers < high && self.nepers < TAU * self.cycles
    }
}
