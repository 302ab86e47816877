//! What a record is made of: a trend, relaxations and (decaying) sinusoids, added one after another until the
//! rest shows no peak.
//!
//! Each round takes the windowed spectrum of what is left. A peak that stands out of the noise is
//! explained by a sinusoid whose start comes from the matrix pencil; one so low that the flip may have made
//! it, by whichever of a sinusoid, two more degrees of the trend or a relaxation `exp(-d t)` has the least
//! Bayesian information criterion. Then everything is fitted again together (`least_squares.rs`).

use super::least_squares::{Care, Free, Problem, Solved, Term};
use super::limits::{MAX_COMPONENTS, MIN_CYCLES};
use super::peaks::{self, Peak, Peaks};
use super::periodogram::Periodogram;
use super::trend::Trend;
use super::{gaps, matrix_pencil};
use crate::math;
use std::f64::consts::{PI, TAU};

/// Rounds; each adds at least one term.
const MOST_ROUNDS: usize = 12;
/// Rounds of a closer look.
const CLOSE_ROUNDS: usize = 5;
/// Cycles in the record below which a flip makes peaks of its own: a step of a tenth of the record has its
/// spectrum there.
pub(super) const FLIP_CYCLES: f64 = 8.0;
/// Half width of the lobe of a Hann window, resolutions: what is left closer to a term is its own doing.
pub(super) const LOBE: f64 = 2.0;
/// Nepers over the record at which a relaxation is tried, at its start or, negative, at its end.
const RELAXED: [f64; 8] = [5.0, 15.0, 45.0, 135.0, -5.0, -15.0, -45.0, -135.0];
/// Most relaxations.
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
const MULTIPLES: [f64; 4] = [1.0, 2.0, 3.0, 4.0];
/// Nepers over the record tried in addition to what the pencil gives: among gaps it may give nothing of use.
const DECAYS: [f64; 4] = [0.0, 2.0, 6.0, 18.0];

/// The record to be taken apart.
pub(super) struct Search<'a> {
    /// Samples, m; `None` where there is none.
    pub samples: &'a [Option<f64>],
    pub frame_rate_hz: f64,
    /// The spectrum of records with these gaps.
    pub periodogram: &'a Periodogram,
    /// Amplitude of rounding, m.
    pub least_m: f64,
    /// Whether the trend may grow.
    pub grows: bool,
    /// Whether noise is measured around each component, as it need not be white: a cycle that drifts over an
    /// octave is no noise, so it is sought before.
    pub coloured: bool,
    /// Between these frequencies, Hz, and their multiples, peaks are a drifting cycle's.
    pub drifting: Option<Drifting>,
    offset: Vec<f64>,
    pub(super) data: Vec<f64>,
    pub(super) weights: Vec<f64>,
}

/// Where a drifting cycle shows itself.
#[derive(Debug, Clone, Copy)]
pub(super) struct Drifting {
    /// Least frequency, Hz.
    pub low_hz: f64,
    /// Greatest frequency, Hz.
    pub high_hz: f64,
    /// Half width of the lobe of the segments in which it was followed, Hz: it keeps no frequency for longer.
    pub lobe_hz: f64,
}

/// A record taken apart.
#[derive(Debug, Clone)]
pub(super) struct Parts {
    /// The record and its trend.
    pub problem: Problem,
    pub solved: Solved,
}

impl Parts {
    /// The trend.
    pub(super) fn trend(&self) -> Trend {
        self.problem.trend
    }
}

/// The parts and what they leave.
pub(super) struct Explained {
    pub parts: Parts,
    /// What is left in each frame, m.
    pub left: Vec<Option<f64>>,
    /// Its spectrum.
    pub amplitude_m: Vec<f64>,
    /// Its peaks and noise floor.
    pub found: Peaks,
}

impl<'a> Search<'a> {
    pub(super) fn new(
        samples: &'a [Option<f64>],
        frame_rate_hz: f64,
        periodogram: &'a Periodogram,
        trend: Trend,
        least_m: f64,
    ) -> Self {
        let offset = trend.of(samples); // large offsets cost digits
        let data = samples.iter().zip(&offset).map(|(x, offset)| x.map_or(0.0, |x| x - offset)).collect();
        let weights = samples.iter().map(|x| f64::from(u8::from(x.is_some()))).collect();
        Self {
            samples,
            frame_rate_hz,
            periodogram,
            least_m,
            grows: false,
            coloured: false,
            drifting: None,
            offset,
            data,
            weights,
        }
    }

    /// Whether an oscillation is slower than the fastest wave that the trend can show.
    pub(super) fn wrestles(&self, explained: &Explained) -> bool {
        let fastest = explained.parts.trend().waves();
        explained.parts.solved.terms.iter().any(|term| term.cycles > 0.0 && term.cycles < fastest)
    }

    /// What the trend and the relaxations take from every frame, m.
    pub(super) fn removed(&self, parts: &Parts) -> Vec<f64> {
        let problem = &parts.problem;
        let relaxations = (0..parts.solved.terms.len())
            .filter(|k| parts.solved.terms[*k].cycles == 0.0)
            .map(|k| problem.of_term(&parts.solved, k));
        let slow = std::iter::once(problem.of_trend(&parts.solved)).chain(relaxations);
        slow.fold(self.offset.clone(), |sum, values| sum.iter().zip(values).map(|(a, b)| a + b).collect())
    }

    pub(super) fn problem(&self, trend: Trend) -> Problem {
        Problem::new(&self.data, &self.weights, trend)
    }

    /// Takes the record apart, starting with a trend alone.
    pub(super) fn run(&self, trend: Trend) -> Option<Explained> {
        self.go_on(self.fitted(self.problem(trend), &[], Care::Passing)?, false)
    }

    /// Takes the record apart again without the terms of a drifting cycle.
    pub(super) fn run_without_drifting(&self, explained: &Explained) -> Option<Explained> {
        let parts = &explained.parts;
        let drifts = |t: &Term| self.drifts(t.cycles * self.resolution_hz());
        let kept: Vec<Term> =
            parts.solved.terms.iter().copied().filter(|t| t.cycles == 0.0 || !drifts(t)).collect();
        self.go_on(self.fitted(parts.problem.clone(), &kept, Care::Passing)?, false)
    }

    /// Goes on with what begins late, is over soon, or is two where one was seen.
    pub(super) fn more_closely(&self, explained: Explained) -> Option<Explained> {
        self.go_on(explained.parts, true)
    }

    fn go_on(&self, parts: Parts, closely: bool) -> Option<Explained> {
        let mut explained = self.explain(parts);
        for round in 0..MOST_ROUNDS {
            let improved = self.improved(&explained);
            let best = if closely && round < CLOSE_ROUNDS {
                self.looked_at_closely(&explained, improved)
            } else {
                improved
            };
            let Some(parts) = best else { break };
            explained = self.explain(parts);
        }
        if closely {
            explained = self.explain(self.placed_again(explained.parts));
        }
        self.pruned(explained)
    }

    /// The parts once another is added; `None` where nothing stands out or no more can be known.
    fn improved(&self, explained: &Explained) -> Option<Parts> {
        let parts = &explained.parts;
        let fresh: Vec<Peak> = explained
            .found
            .accepted
            .iter()
            .copied()
            .filter(|p| self.is_fresh(&parts.solved.terms, p))
            .collect();
        let (high, low): (Vec<Peak>, Vec<Peak>) =
            fresh.into_iter().partition(|p| self.cycles(p) >= FLIP_CYCLES);
        // noise need not be white; what a flip leaves is no noise
        let high: Vec<Peak> =
            high.into_iter().filter(|p| !self.coloured || self.stands_out_widely(explained, p)).collect();
        let sinusoids = parts.solved.terms.iter().filter(|t| t.cycles > 0.0).count();
        let room = MAX_COMPONENTS.saturating_sub(sinusoids);
        let low_first =
            low.first().is_some_and(|l| high.first().is_none_or(|h| l.amplitude_m > h.amplitude_m));
        if let Some(parts) =
            low.first().filter(|_| low_first).and_then(|peak| self.explain_low(explained, peak))
        {
            return Some(parts);
        }
        if !high.is_empty() && room > 0 {
            let mut terms = parts.solved.terms.clone();
            terms.extend(self.sinusoids(explained, &high).into_iter().take(room));
            return self.fitted(parts.problem.clone(), &terms, Care::Passing);
        }
        if self.grows {
            self.with_relaxation(explained).and_then(|with| self.better(parts, &with))
        } else {
            None
        }
    }

    /// Cycles of a peak in the record.
    pub(super) fn cycles(&self, peak: &Peak) -> f64 {
        peak.frequency_hz / self.resolution_hz()
    }

    /// One over the record's length, Hz.
    pub(super) fn resolution_hz(&self) -> f64 {
        self.frame_rate_hz / self.samples.len() as f64
    }

    /// Whether a peak is no term's own and not of a drifting cycle.
    pub(super) fn is_fresh(&self, terms: &[Term], peak: &Peak) -> bool {
        let cycles = self.cycles(peak);
        let own = |t: &Term| t.cycles > 0.0 && (cycles - t.cycles).abs() < lobe(t);
        cycles + 1.0 < self.samples.len() as f64 / 2.0
            && !terms.iter().any(own)
            && !self.drifts(peak.frequency_hz)
    }

    /// Whether a frequency is one of a drifting cycle.
    pub(super) fn drifts(&self, hz: f64) -> bool {
        let near = |multiple: f64, d: Drifting| {
            hz > multiple * d.low_hz - d.lobe_hz && hz < multiple * d.high_hz + d.lobe_hz
        };
        self.drifting.is_some_and(|drifting| MULTIPLES.iter().any(|multiple| near(*multiple, drifting)))
    }

    /// A low peak by a sinusoid, more trend or a relaxation, whichever explains most with least.
    fn explain_low(&self, explained: &Explained, peak: &Peak) -> Option<Parts> {
        let parts = &explained.parts;
        let mut candidates = Vec::new();
        if self.grows {
            candidates.extend(
                parts
                    .trend()
                    .richer()
                    .and_then(|richer| self.at(self.problem(richer), parts.solved.terms.clone())),
            );
            candidates.extend(self.with_relaxation(explained));
        }
        let resolvable = self.cycles(peak) >= MIN_CYCLES.max(parts.trend().waves() + 1.0);
        if resolvable || candidates.is_empty() {
            let mut terms = parts.solved.terms.clone();
            terms.push(self.sinusoid(explained, peak));
            candidates.extend(self.at(parts.problem.clone(), terms));
        }
        let best = candidates.into_iter().min_by(|a, b| self.criterion(a).total_cmp(&self.criterion(b)))?;
        self.better(parts, &best)
    }

    /// The candidate once fitted, if it explains more than what there is.
    fn better(&self, parts: &Parts, candidate: &Parts) -> Option<Parts> {
        self.fitted(candidate.problem.clone(), &candidate.solved.terms, Care::Passing)
            .filter(|fitted| self.criterion(fitted) < self.criterion(parts))
    }

    /// With the relaxation that lowers the rest most, if it does so by more than noise lets it. One that is
    /// there already has taken on as much of another as it could: both must move before the other shows.
    fn with_relaxation(&self, explained: &Explained) -> Option<Parts> {
        let parts = &explained.parts;
        let terms = &parts.solved.terms;
        let relaxations = terms.iter().filter(|t| t.cycles == 0.0).count();
        if relaxations >= MOST_RELAXATIONS {
            return None;
        }
        let with = |nepers: &f64| {
            let mut more = terms.clone();
            more.push(Term::from_start(0.0, *nepers, Free::Nepers));
            self.at(parts.problem.clone(), more)
        };
        let best =
            RELAXED.iter().filter_map(with).min_by(|a, b| a.solved.misfit.total_cmp(&b.solved.misfit))?;
        let noise_m = self.periodogram.deviation(explained.found.floor_m);
        let least = parts.solved.misfit - math::powi(RELAXATION_STANDS_OUT * noise_m, 2);
        if best.solved.misfit < least {
            return Some(best);
        }
        let moved = || self.fitted(best.problem.clone(), &best.solved.terms, Care::Passing);
        (relaxations > 0).then(moved).flatten().filter(|moved| moved.solved.misfit < least)
    }

    /// A sinusoid for each peak, largest first, but not for one in the lobe of a larger: a fast decay has the
    /// noise on its flanks for peaks.
    fn sinusoids(&self, explained: &Explained, peaks: &[Peak]) -> Vec<Term> {
        let mut terms: Vec<Term> = Vec::new();
        for peak in peaks {
            let cycles = self.cycles(peak);
            if !terms.iter().any(|t| (cycles - t.cycles).abs() < lobe(t)) {
                terms.push(self.sinusoid(explained, peak));
            }
        }
        terms
    }

    /// Where the fit of a sinusoid starts.
    fn sinusoid(&self, explained: &Explained, peak: &Peak) -> Term {
        let cycles = self.cycles(peak);
        let left: Vec<f64> = gaps::bridged(&explained.left).into_iter().map(|x| x.unwrap_or(0.0)).collect();
        let of_pencil = matrix_pencil::pole(&left, cycles)
            .map(|pole| Term::from_start(pole.cycles, pole.nepers, Free::Both));
        let tried = DECAYS.map(|nepers| Term::from_start(cycles, nepers, Free::Both));
        let problem = Problem::new(&left, &self.weights, Trend::Polynomial(0));
        let misfit = |term: &Term| problem.at(vec![*term]).map_or(f64::INFINITY, |s| s.misfit);
        let starts =
            of_pencil.into_iter().chain(tried).filter(Term::is_oscillation).map(|term| (misfit(&term), term));
        starts.min_by(|a, b| a.0.total_cmp(&b.0)).map_or(tried[0], |(_, term)| term)
    }

    /// Amplitudes for these terms, if there are frames enough.
    fn at(&self, problem: Problem, terms: Vec<Term>) -> Option<Parts> {
        let solved = self.has_frames_for(&problem, &terms).then(|| problem.at(terms)).flatten()?;
        Some(Parts { problem, solved })
    }

    /// The terms moved to where they leave least, if there are frames enough; a frequency held before is free
    /// again.
    pub(super) fn fitted(&self, problem: Problem, terms: &[Term], care: Care) -> Option<Parts> {
        let released = |t: &Term| if t.cycles > 0.0 { Term { free: Free::Both, ..*t } } else { *t };
        let terms: Vec<Term> = terms.iter().map(released).collect();
        let solved = self.has_frames_for(&problem, &terms).then(|| problem.solve(&terms, care)).flatten()?;
        Some(Parts { problem, solved })
    }

    /// Whether there are frames enough: a trend alone needs fewer, and what a short record cannot tell apart
    /// is only ever a component.
    pub(super) fn has_frames_for(&self, problem: &Problem, terms: &[Term]) -> bool {
        let each = if terms.is_empty() { FRAMES_PER_COLUMN } else { FRAMES_PER_UNKNOWN };
        self.periodogram.sums.present >= each * problem.unknown_count(terms)
    }

    /// The same terms with a richer trend, if there is one.
    pub(super) fn with_richer_trend(&self, parts: &Parts) -> Option<Parts> {
        self.fitted(self.problem(parts.trend().richer()?), &parts.solved.terms, Care::Final)
    }

    /// Bayesian information criterion: `N ln(misfit) + k ln N`.
    pub(super) fn criterion(&self, parts: &Parts) -> f64 {
        self.criterion_at(parts, parts.solved.misfit, 0.0)
    }

    /// The same for another misfit, m^2, and more unknowns.
    pub(super) fn criterion_at(&self, parts: &Parts, misfit: f64, more: f64) -> f64 {
        let present = self.periodogram.sums.present as f64;
        let terms = &parts.solved.terms;
        let late = terms.iter().filter(|t| t.first > 0).count(); // a first frame is a number too
        let unknowns = (parts.problem.unknown_count(terms) + late) as f64 + more;
        present * math::ln(misfit.max(f64::MIN_POSITIVE)) + unknowns * math::ln(present)
    }

    /// What parts leave, and its peaks.
    pub(super) fn explain(&self, parts: Parts) -> Explained {
        let model = parts.problem.model(&parts.solved);
        let left: Vec<Option<f64>> = self
            .samples
            .iter()
            .zip(self.data.iter().zip(&model))
            .map(|(x, (data, m))| x.map(|_| data - m))
            .collect();
        let rest: Vec<f64> = left.iter().map(|x| x.unwrap_or(0.0)).collect();
        let amplitude_m = self.periodogram.amplitudes(&rest);
        let spectrum = self.periodogram.windowed(&amplitude_m, self.frame_rate_hz, self.least_m);
        let found = peaks::find(&spectrum, (0.0, self.frame_rate_hz / 2.0), 2 * MAX_COMPONENTS);
        Explained { parts, left, amplitude_m, found }
    }

    /// Without the sinusoids that noise alone may have made, and those that explain less than they leave.
    fn pruned(&self, mut explained: Explained) -> Option<Explained> {
        for _ in 0..MOST_ROUNDS {
            let (problem, terms) = (explained.parts.problem.clone(), &explained.parts.solved.terms);
            let kept = self.kept(&explained)?;
            let all = kept.iter().all(|kept| *kept);
            let kept: Vec<Term> =
                terms.iter().zip(kept).filter_map(|(term, kept)| kept.then_some(*term)).collect();
            explained =
                self.explain(self.fitted(problem, &kept, if all { Care::Final } else { Care::Passing })?);
            if all {
                break;
            }
        }
        Some(explained)
    }

    /// Which terms stand out of the noise, keep their place and explain more than they leave.
    fn kept(&self, explained: &Explained) -> Option<Vec<bool>> {
        let parts = &explained.parts;
        let problem = &parts.problem;
        let covariance = problem.covariance(&parts.solved)?;
        let white_m = self.periodogram.deviation(explained.found.floor_m);
        let kept = |(k, term): (usize, &Term)| {
            let pair = problem.pair(&parts.solved, k);
            // noise of a bin is both parts of an amplitude, so it is the square root of two larger than the
            // deviation
            let least = explained.found.detection
                * std::f64::consts::SQRT_2
                * covariance.deviations(k, pair).amplitude;
            let amplitude_m = math::hypot(pair[0], pair[1]);
            let stands_out = || {
                !self.coloured
                    || amplitude_m > least * self.noise_of(explained, term)
                    || self.stands_alone(explained, k)
            };
            let explains = || match term.is_brief() {
                true => self.left_in_envelope(explained, term) < amplitude_m,
                false => self.left_around(explained, term) < self.shown(parts, k),
            };
            term.cycles == 0.0 || (amplitude_m > least * white_m && explains() && stands_out())
        };
        let terms = &parts.solved.terms;
        let stay: Vec<bool> =
            terms.iter().map(|t| t.cycles == 0.0 || matches!(t.free, Free::Both | Free::Cycles)).collect();
        // a term that has left its peak may have gone to another's, and neither's amplitude is known while
        // both are there
        let judged = || terms.iter().enumerate().map(kept).collect();
        Some(if stay.iter().all(|stays| *stays) { judged() } else { stay })
    }
}

/// Half width of a term's peak, cycles in the record: that of the window's lobe and of its decay.
pub(super) fn lobe(term: &Term) -> f64 {
    LOBE + term.nepers.abs() / PI
}

impl Term {
    /// Whether it swings more than once before it is gone.
    pub(super) fn is_oscillation(&self) -> bool {
        let (low, high) = self.bounds();
        self.cycles > 0.0 && self.nepers > low && self.nepers < high && self.nepers < TAU * self.cycles
    }
}
