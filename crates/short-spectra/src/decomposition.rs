//! One model for every record: a trend, oscillations with decay, onset and drift or along a ridge, their
//! harmonics, smooth steps and relaxations, frames that are left out at a price, and autoregressive noise.
//! The posterior probability decides which of these parts a record has (Djurić 1996, *IEEE Trans. Signal
//! Process.* 44).

mod atom;
mod candidates;
mod cluster;
mod column_products;
mod course;
mod problem;
mod reading;
mod record_parts;
mod search;
#[cfg(test)]
mod tests;

use crate::noise::{MOST_COEFFICIENTS, raise_order};
use crate::periodogram::upper_median;
use crate::record::SampledRecord;
use crate::settings::{MAX_COMPONENTS, ROUNDING, SpectrumSettings};
use crate::transform::RealTransform;
use crate::trend::Trend;
use atom::{Atom, MOST_ENVELOPE_DEGREE, OscillationAtom};
pub use course::exceeds_noise;
use portable_math as math;
use problem::{Explanation, NoisyRecord, Parts, dot};
pub use record_parts::Oscillation;
pub(crate) use record_parts::RecordParts;
use search::{PartSearch, Rival};

/// Frames per oscillation: an oscillation with decay, onset and linear drift has six parameters, so this
/// allows about three frames per parameter.
const FRAMES_PER_OSCILLATION: usize = 16;

/// The most probable explanation of a record, with the frames and the noise for which it holds. If that has
/// no oscillation, one that explains most of its noise by an oscillation may take its place.
pub(crate) struct Decomposition {
    problem: NoisyRecord,
    explanation: Explanation,
    rivals: Vec<Rival>,
    /// Size, m, of one unit of the scaled values: the standard deviation of the record.
    scale_m: f64,
    /// Mean, m, that is subtracted from the record before it is scaled; 0 without a trend.
    mean_m: f64,
    frame_rate_hz: f64,
}

/// What to look for in a record.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DecompositionSettings {
    pub trend: Trend,
    /// Whether the trend may get more columns, and steps, relaxations and a jump may be added to it.
    pub trend_grows: bool,
    /// Largest number of oscillations.
    pub most_oscillations: usize,
}

impl DecompositionSettings {
    /// Settings for a record with values in `frames` frames. A list that is shorter than usual needs as many
    /// oscillations as the usual one: those that are not listed would disturb the others.
    pub(crate) fn new(frames: usize, trend: Trend, settings: &SpectrumSettings) -> Self {
        let most_oscillations =
            settings.max_components.max(MAX_COMPONENTS).min(frames / FRAMES_PER_OSCILLATION);
        Self { trend, trend_grows: settings.detrend.is_none(), most_oscillations }
    }
}

impl Decomposition {
    /// Finds the most probable explanation of a record; `None` if too few frames have a value or all values
    /// are equal.
    pub(crate) fn from_record(record: &SampledRecord, settings: DecompositionSettings) -> Option<Self> {
        let (white, mean, scale_m) = scale_record(record, settings.trend)?;
        let Contest { problem, best: explanation, rivals, .. } = select_explanation(white, settings);
        let mut found =
            Self { problem, explanation, rivals, scale_m, mean_m: mean, frame_rate_hz: record.frame_rate_hz };
        found.add_rivals();
        Some(found)
    }

    /// Frequency, Hz, of one cycle per record; duration of the record, s; size of a unit of the scaled
    /// values, m.
    fn units(&self) -> (f64, f64, f64) {
        let frames = self.problem.at.frames as f64;
        (self.frame_rate_hz / frames, frames / self.frame_rate_hz, self.scale_m)
    }
}

/// The record in units of its standard deviation, without its mean, in white noise; its mean, m, or 0 without
/// a trend; and its standard deviation, m. `None` if too few frames have a value or all values are equal.
fn scale_record(record: &SampledRecord, trend: Trend) -> Option<(NoisyRecord, f64, f64)> {
    let samples = record.samples;
    let used: Vec<usize> = (0..samples.len()).filter(|i| samples[*i].is_some()).collect();
    let values: Vec<f64> = samples.iter().flatten().copied().collect();
    // without a trend, the mean stays in the record
    let is_centred = trend.column_count() > 0;
    let mean = if is_centred { values.iter().sum::<f64>() / values.len() as f64 } else { 0.0 };
    let scale_m = (values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / values.len() as f64).sqrt();
    if scale_m.is_nan() || scale_m <= 1e-12 * mean.abs() || used.len() < trend.column_count() + 4 {
        return None;
    }
    let values = values.iter().map(|x| (x - mean) / scale_m).collect();
    let largest = samples.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
    let mut white = NoisyRecord::new(samples.len(), used, values);
    white.least_variance = math::powi(ROUNDING * largest / scale_m, 2).max(1e-300);
    Some((white, mean, scale_m))
}

/// Explanations that compete: with and without a jump, in white and in coloured noise.
struct Contest {
    settings: DecompositionSettings,
    /// The frames used and the noise of the most probable explanation.
    problem: NoisyRecord,
    best: Explanation,
    /// Everything that any of the searches tried.
    rivals: Vec<Rival>,
}

impl Contest {
    /// Smallest fall of the criterion, nats, for which a search is repeated in the noise that it leaves.
    const LEAST_FALL: f64 = 0.1;
    /// Largest number of repetitions; it bounds the time.
    const MOST_REPETITIONS: usize = 3;

    /// Searches from `parts` on, then again in the noise that the explanation leaves, as long as this lowers
    /// the criterion. Returns what it finds, also if it is not the best.
    fn search_parts(&mut self, problem: NoisyRecord, parts: Parts) -> (NoisyRecord, Explanation) {
        let DecompositionSettings { trend_grows, most_oscillations, .. } = self.settings;
        let mut search = PartSearch::new(problem, trend_grows, most_oscillations);
        search.bound = self.best.criterion;
        let mut found = search.find_parts(parts);
        for repetition in 0..Self::MOST_REPETITIONS {
            if repetition > 0 && found.criterion > self.best.criterion + MOST_BEHIND {
                break;
            }
            let coloured = with_noise_of(&search.problem, &found.parts);
            if coloured.order == 0 && search.problem.order == 0 {
                break;
            }
            let (coloured, parts) = self.refine_courses(coloured, &found);
            let same = coloured.fit_parts(&parts, FEW_ITERATIONS);
            if same.criterion > found.criterion - Self::LEAST_FALL {
                break;
            }
            let mut again = PartSearch::new(coloured, trend_grows, most_oscillations);
            again.bound = self.best.criterion;
            let next = again.find_parts(same.parts);
            let falls = next.criterion < found.criterion - Self::LEAST_FALL;
            if falls {
                std::mem::swap(&mut search, &mut again);
                found = next;
            }
            self.rivals.extend(again.rivals);
            if !falls {
                break;
            }
        }
        self.rivals.extend(search.rivals);
        if found.criterion < self.best.criterion {
            (self.problem, self.best) = (search.problem.clone(), found.clone());
        }
        (search.problem, found)
    }

    fn keep_rival(&mut self, explanation: &Explanation) {
        self.rivals.push(Rival { atoms: explanation.parts.atoms.clone(), criterion: explanation.criterion });
    }

    /// An explanation in which one oscillation along a ridge takes the place of all oscillations in its range
    /// of frequencies, with its noise, if it is more probable than `found`. It is tried only if `found` has
    /// several oscillations or leaves coloured noise: otherwise a few oscillations describe the record.
    fn follow_course(
        &mut self,
        problem: &NoisyRecord,
        found: &Explanation,
    ) -> Option<(NoisyRecord, Explanation)> {
        let oscillations = found.parts.atoms.iter().filter(|a| a.oscillation().is_some()).count();
        if oscillations < SEVERAL && with_noise_of(problem, &found.parts).order == 0 {
            return None;
        }
        self.accept_course(problem, found, None)
    }

    /// The explanation with an oscillation along a ridge, if it is more probable than `found`. It takes the
    /// place of the course with the index `replaced`, or of all oscillations in its range of frequencies.
    fn accept_course(
        &mut self,
        problem: &NoisyRecord,
        found: &Explanation,
        replaced: Option<usize>,
    ) -> Option<(NoisyRecord, Explanation)> {
        let parts = course::unite_along_ridge(problem, found, replaced)?;
        let problem = with_noise_of(problem, &parts);
        let next = problem.fit_parts(&parts, FEW_ITERATIONS);
        self.keep_rival(&next);
        (next.criterion < found.criterion - Self::LEAST_FALL).then_some((problem, next))
    }

    /// Follows each course anew, because its ridge is clearer without the other parts that are known now.
    fn refine_courses(&mut self, problem: NoisyRecord, found: &Explanation) -> (NoisyRecord, Parts) {
        let (mut problem, mut best) = (problem, found.clone());
        for k in 0..best.parts.atoms.len() {
            if best.parts.atoms.get(k).is_some_and(|atom| atom.course().is_some())
                && let Some((coloured, next)) = self.accept_course(&problem, &best, Some(k))
            {
                (problem, best) = (coloured, next);
            }
        }
        (problem, best.parts)
    }

    /// Searches once more from parts with one oscillation in place of each cluster. The search itself unites
    /// only a few oscillations that are present from the first frame on.
    fn unite_clusters(&mut self) {
        if let Some(parts) = cluster::unite_clusters(&self.problem, &self.best) {
            self.search_parts(self.problem.clone(), parts);
        }
    }

    /// Searches once more from `parts` and one oscillation of changing amplitude and frequency, which takes
    /// the place of coloured noise and of the oscillations within its band. Its fit must explain most of
    /// what `parts` leave. The search does not find it step by step: until its shape is right, a few
    /// coefficients of the noise describe its band better. If the best explanation has no oscillation, this
    /// one becomes the best, although noise alone is more probable: its odds put it in doubt.
    fn add_swelling(&mut self, parts: &Parts) {
        /// Largest fraction of the energy of the residual that the fit may leave. The fit leaves more of most
        /// bands of noise that are five resolutions wide, and less of most bursts.
        const MOST_LEFT: f64 = 0.5;
        /// Latest onset: a later oscillation is too short for a polynomial amplitude.
        const LATEST: f64 = 0.8;
        /// Iterations of the fit, which starts from a constant amplitude.
        const ITERATIONS: usize = 40;
        if self.problem.order == 0 {
            return;
        }
        let white = self.problem.clone().with_noise(&[]);
        let Some(band) = NarrowBand::find_band(&white, parts) else { return };
        let is_other = |atom: &&Atom| !atom.oscillation().is_some_and(|o| band.contains(o));
        let mut atoms: Vec<Atom> = parts.atoms.iter().filter(is_other).cloned().collect();
        let oscillations = atoms.iter().filter(|atom| atom.oscillation().is_some()).count();
        let (envelope, phase) = (vec![0.0; MOST_ENVELOPE_DEGREE], vec![0.0]);
        let start = OscillationAtom { envelope, phase, ..OscillationAtom::steady(band.cycles) };
        let is_usable = Atom::Oscillation(start.clone()).is_usable(white.at.frames);
        if !is_usable || oscillations >= self.settings.most_oscillations {
            return;
        }
        // it begins with the record or where a step is nearly over
        let over = |atom: &Atom| match atom {
            Atom::Step { centre, width, .. } => Some(centre + width).filter(|at| *at > 0.0 && *at < LATEST),
            _ => None,
        };
        let others = white.fix_parts(parts.trend, &atoms);
        let fit_from = |onset: f64| {
            let start = OscillationAtom { onset, ..start.clone() };
            white.fit_atoms(&others, vec![Atom::Oscillation(start)], ITERATIONS)
        };
        let onsets = std::iter::once(0.0).chain(atoms.iter().filter_map(over));
        let Some((fitted, squares)) = onsets.map(fit_from).min_by(|a, b| a.1.total_cmp(&b.1)) else { return };
        let all = white.fix_parts(parts.trend, &parts.atoms);
        let left = white.residual_of(&all);
        if squares > MOST_LEFT * dot(left, left) {
            return;
        }
        atoms.extend(fitted);
        let parts = Parts { trend: parts.trend, atoms };
        let (problem, found) = self.search_parts(with_noise_of(&white, &parts), parts);
        let has =
            |explanation: &Explanation, is_one: fn(&Atom) -> bool| explanation.parts.atoms.iter().any(is_one);
        let is_listed = |atom: &Atom| atom.oscillation().is_some_and(|o| !o.is_single_swing());
        // the verdict of an oscillation along a ridge takes no account of the odds
        let is_course = |atom: &Atom| atom.course().is_some();
        let is_silent = !has(&self.best, is_listed) && !has(&self.best, is_course);
        if is_silent && has(&found, is_listed) && !has(&found, is_course) && found.criterion.is_finite() {
            let noise = self.best.clone();
            self.keep_rival(&noise);
            (self.problem, self.best) = (problem, found);
        }
    }

    /// Looks for an oscillation along a ridge in addition to the parts of the best explanation.
    fn add_course(&mut self) {
        let (problem, best) = (self.problem.clone(), self.best.clone());
        if let Some((problem, next)) = self.follow_course(&problem, &best) {
            self.search_parts(problem, next.parts);
        }
    }
}

/// A search is not completed if the criterion of its explanation is higher than that of another one by more
/// than this, nats: further oscillations do not make up for it.
const MOST_BEHIND: f64 = 20.0;
/// A record with at least this number of oscillations may contain one along a ridge instead.
const SEVERAL: usize = 4;
/// Iterations of a fit of all parts after a change of the noise, which hardly moves them.
const FEW_ITERATIONS: usize = 2;

/// The most probable explanation. A first search in white noise finds the slow parts. The noise that these
/// leave decides whether coloured noise is tried.
fn select_explanation(white: NoisyRecord, settings: DecompositionSettings) -> Contest {
    /// Largest number of oscillations in the first search: the slow parts are known before all oscillations
    /// are.
    const FIRST_LOOK: usize = 4;
    let start = Parts { trend: settings.trend, atoms: Vec::new() };
    let jump = settings.trend_grows.then(|| find_jump(&white, &start)).flatten();
    let first_look = FIRST_LOOK.min(settings.most_oscillations);
    let bound = with_noise_of(&white, &start).fit_parts(&start, 0).criterion;
    let mut search = PartSearch::new(white, settings.trend_grows, first_look);
    search.bound = bound;
    let mut first = search.find_parts(start);
    let white = search.problem;
    let mut contest =
        Contest { settings, problem: white.clone(), best: first.clone(), rivals: search.rivals };
    let mut slow = slow_parts(&first.parts);
    let slow_of_white = slow.clone();
    let mut alone = with_noise_of(&white, &slow);
    let mut noise_alone = alone.fit_parts(&slow, FEW_ITERATIONS);
    if let Some((problem, course)) = contest.follow_course(&white, &first) {
        let least = first.criterion.min(noise_alone.criterion);
        if course.criterion < least - MOST_BEHIND {
            contest.keep_rival(&noise_alone);
            slow = slow_parts(&course.parts);
            alone = with_noise_of(&white, &slow);
            noise_alone = alone.fit_parts(&slow, FEW_ITERATIONS);
            (contest.problem, contest.best) = (problem, course.clone());
            first = course;
        } else {
            contest.search_parts(problem, course.parts);
        }
    }
    let background = with_background(&white, &slow);
    if background.order > 0 || noise_alone.criterion < first.criterion {
        contest.search_parts(background, slow);
        contest.search_parts(alone, noise_alone.parts);
    }
    if let Some((problem, parts)) = jump {
        contest.search_parts(problem, parts);
    }
    if contest.best.criterion > first.criterion - MOST_BEHIND {
        contest.search_parts(white, first.parts);
    }
    contest.add_course();
    contest.unite_clusters();
    let found = contest.best.parts.clone();
    contest.add_swelling(&found);
    if slow_of_white != found {
        contest.add_swelling(&slow_of_white);
    }
    contest
}

/// The parts without their oscillations; those along ridges stay.
fn slow_parts(parts: &Parts) -> Parts {
    let slow = parts.atoms.iter().filter(|a| a.oscillation().is_none());
    Parts { trend: parts.trend, atoms: slow.cloned().collect() }
}

/// The problem in the noise that `parts` leave, without the lines of further oscillations. A running median
/// over frequency removes lines from the power density of the residual. The transform of the smooth density
/// gives the autocorrelation, and Levinson's recursion gives the coefficients.
fn with_background(problem: &NoisyRecord, parts: &Parts) -> NoisyRecord {
    /// Half width of the running median, resolutions: four times the half width of a line under a Hann
    /// window, so that a line changes fewer than half of the values.
    const HALF_WIDTH: usize = 8;
    let white = problem.clone().with_noise(&[]);
    let left = white.fit_parts(parts, 4);
    let frames = white.at.frames;
    let hann = |s: f64| 0.5 - 0.5 * math::cos(std::f64::consts::TAU * s);
    let values = fill_frames(&white, &left.residual, hann);
    let padded = frames.next_power_of_two();
    let density = RealTransform::new(padded).squared_magnitudes(values.into_iter());
    let bins = HALF_WIDTH * padded.div_ceil(frames);
    let smooth: Vec<f64> = (0..density.len())
        .map(|k| {
            let near = &density[k.saturating_sub(bins)..(k + bins + 1).min(density.len())];
            upper_median(near.to_vec()).unwrap_or(0.0)
        })
        .collect();
    let correlation = |lag: usize| -> f64 {
        let turn = std::f64::consts::TAU * lag as f64 / padded as f64;
        smooth.iter().enumerate().map(|(k, s)| s * math::cos(turn * k as f64)).sum()
    };
    let correlations: Vec<f64> = (0..=MOST_COEFFICIENTS).map(correlation).collect();
    let mut variance = 1.0;
    let levinson = |coefficients: &[f64]| {
        let order = coefficients.len() + 1;
        let predicted: f64 =
            coefficients.iter().zip((1..order).rev()).map(|(a, lag)| a * correlations[lag]).sum();
        let kappa = (correlations[order] - predicted) / (variance * correlations[0]);
        variance *= 1.0 - kappa * kappa;
        (kappa.abs() < 1.0).then_some(kappa)
    };
    let coefficients = select_coefficients(white.len(), MEDIAN_SCATTER, levinson);
    white.with_noise(&coefficients)
}

/// A higher order must lower the criterion by more than this, nats: the scatter of a running median alone can
/// cause a smaller fall.
const MEDIAN_SCATTER: f64 = 4.0;

/// A residual times a window, which depends on the position in the record; 0 in a frame that is not used.
fn fill_frames(problem: &NoisyRecord, residual: &[f64], window: impl Fn(f64) -> f64) -> Vec<f64> {
    let mut values = vec![0.0; problem.at.frames];
    for ((i, s), r) in problem.used.iter().zip(&problem.at.places).zip(residual) {
        values[*i] = window(*s) * r;
    }
    values
}

/// A band of frequencies that holds most of what parts leave of a record: narrow-band noise, or an
/// oscillation that no part describes.
struct NarrowBand {
    /// Its middle, cycles per record.
    cycles: f64,
    /// Sum of the squares of what is left in it.
    energy: f64,
}

impl NarrowBand {
    /// Half width, resolutions: enough for the drift of an oscillation that a polynomial describes.
    const HALF_WIDTH: f64 = 8.0;

    /// The band around the largest peak in the spectrum of what `parts` leave of a record in white noise;
    /// `None` if it has less than half of the energy.
    fn find_band(white: &NoisyRecord, parts: &Parts) -> Option<Self> {
        /// Smallest fraction of the energy.
        const LEAST_SHARE: f64 = 0.5;
        let all = white.fix_parts(parts.trend, &parts.atoms);
        let frames = white.at.frames;
        let padded = (2 * frames).next_power_of_two();
        let left = white.residual_of(&all);
        let values = fill_frames(white, left, |_| 1.0);
        let energies = RealTransform::new(padded).squared_magnitudes(values.into_iter());
        let peak = (0..energies.len()).max_by(|a, b| energies[*a].total_cmp(&energies[*b]))?;
        let bins = (Self::HALF_WIDTH * padded as f64 / frames as f64) as usize;
        let near = &energies[peak.saturating_sub(bins)..(peak + bins + 1).min(energies.len())];
        let total: f64 = energies.iter().sum();
        let share = near.iter().sum::<f64>() / total;
        let cycles = peak as f64 * frames as f64 / padded as f64;
        (share >= LEAST_SHARE).then(|| Self { cycles, energy: share * dot(left, left) })
    }

    /// Whether the mean frequency of an oscillation lies in it.
    fn contains(&self, o: &OscillationAtom) -> bool {
        (o.mean_cycles() - self.cycles).abs() <= Self::HALF_WIDTH
    }
}

/// Autoregressive coefficients of the order with the lowest Bayesian information criterion for `frames`
/// frames. `next_kappa` gives the reflection coefficient of the next order from the coefficients of the
/// present one, if there is one. A higher order counts only if it lowers the criterion by more than
/// `least_fall`, nats.
fn select_coefficients(
    frames: usize,
    least_fall: f64,
    mut next_kappa: impl FnMut(&[f64]) -> Option<f64>,
) -> Vec<f64> {
    /// Frames per coefficient: a coefficient from 25 frames has a standard deviation of a fifth.
    const FRAMES_PER_COEFFICIENT: usize = 25;
    let n = frames as f64;
    let mut coefficients: Vec<f64> = Vec::new();
    let (mut variance, mut best) = (1.0, (0.0, Vec::new()));
    for order in 1..=MOST_COEFFICIENTS.min(frames / FRAMES_PER_COEFFICIENT) {
        let Some(kappa) = next_kappa(&coefficients) else { break };
        coefficients = raise_order(&coefficients, kappa);
        variance *= 1.0 - kappa * kappa;
        let criterion = 0.5 * n * math::ln(variance) + 0.5 * order as f64 * math::ln(n);
        if criterion < best.0 - least_fall {
            best = (criterion, coefficients.clone());
        }
    }
    best.1
}

/// The problem in noise with the coefficients estimated from the residual of `parts`.
fn with_noise_of(problem: &NoisyRecord, parts: &Parts) -> NoisyRecord {
    let white = problem.clone().with_noise(&[]);
    let left = white.fit_parts(parts, 4);
    let coefficients = estimate_coefficients(&white.used, &left.residual);
    white.with_noise(&coefficients)
}

/// Autoregressive coefficients of a residual with gaps, by Burg's method over the stretches without a gap.
/// The order is that with the lowest Bayesian information criterion.
fn estimate_coefficients(used: &[usize], residual: &[f64]) -> Vec<f64> {
    let mut stretches: Vec<(Vec<f64>, Vec<f64>)> = Vec::new();
    let mut first = 0;
    for k in 1..=used.len() {
        if k == used.len() || used[k] != used[k - 1] + 1 {
            stretches.push((residual[first..k].to_vec(), residual[first..k].to_vec()));
            first = k;
        }
    }
    select_coefficients(used.len(), 0.0, |coefficients| {
        let order = coefficients.len() + 1;
        let (mut product, mut energy, mut pairs) = (0.0, 0.0, 0);
        for (forward, backward) in &stretches {
            for i in order..forward.len() {
                product += forward[i] * backward[i - 1];
                energy += forward[i] * forward[i] + backward[i - 1] * backward[i - 1];
                pairs += 1;
            }
        }
        if pairs < 4 * order || energy <= 0.0 {
            return None;
        }
        let kappa: f64 = 2.0 * product / energy;
        for (forward, backward) in &mut stretches {
            for i in (order..forward.len()).rev() {
                let (f, b) = (forward[i], backward[i - 1]);
                forward[i] = f - kappa * b;
                backward[i] = b - kappa * f;
            }
        }
        Some(kappa)
    })
}

/// The problem without the frames of a jump, with a trend that starts anew behind them. The interval left out
/// is the one with the lowest criterion; its two ends cost one unit of price each. `None` if this lowers the
/// criterion too little.
fn find_jump(problem: &NoisyRecord, start: &Parts) -> Option<(NoisyRecord, Parts)> {
    /// Lengths, frames, of the intervals from which the search starts: from one frame to a slow jump.
    const WIDTHS: [usize; 9] = [1, 2, 6, 15, 30, 60, 100, 150, 250];
    /// Smallest number of frames on each side: as many as the cubic that begins there has coefficients.
    const SIDE: usize = 4;
    /// Divisor of the number of frames that gives the longest interval left out.
    const MOST_LEFT_OUT: usize = 4;
    /// Smallest fall of the criterion, nats, with which a jump is tried: each jump costs another search.
    const WORTHWHILE: f64 = 8.0;
    let n = problem.len();
    let frames = problem.at.frames;
    let base = problem.fit_parts(start, 0).criterion;
    // the interval lies around the steepest change within a sixtieth of the frames
    let span = (n / 60).max(3);
    if n < 4 * span + 12 {
        return None;
    }
    let steepest = (0..n - span).max_by(|a, b| {
        let rise = |i: usize| (problem.values[i + span] - problem.values[i]).abs();
        rise(*a).total_cmp(&rise(*b))
    })?;
    let middle = problem.used[steepest + span / 2];
    let with_gap = |from: usize, to: usize| {
        let log = problem.log_frames();
        let mut without = problem.without_frames(|i| (from..to).contains(&i), 0.5 * log);
        without.price_left_out += 2.0 * log;
        let at = (from + to) as f64 / 2.0 / frames as f64;
        let parts = Parts { trend: start.trend, atoms: vec![Atom::Break { at }] };
        let criterion = without.fit_parts(&parts, 0).criterion;
        (criterion, without, parts)
    };
    let usable = |from: usize, to: usize| {
        from >= SIDE && from < to && to + SIDE <= frames && to - from <= frames / MOST_LEFT_OUT
    };
    let around = |width: &usize| {
        (middle.saturating_sub(width / 2).max(SIDE), (middle + width.div_ceil(2)).min(frames - SIDE))
    };
    let mut best = WIDTHS
        .iter()
        .map(around)
        .filter(|(from, to)| usable(*from, *to))
        .map(|(from, to)| (with_gap(from, to).0, from, to))
        .min_by(|a, b| a.0.total_cmp(&b.0))?;
    let mut step = (frames / 50).max(1);
    while step >= 1 {
        let (_, from, to) = best;
        let moves = [
            (from.saturating_sub(step), to),
            (from + step, to),
            (from, to.saturating_sub(step)),
            (from, to + step),
        ];
        let tried = moves.into_iter().filter(|(from, to)| usable(*from, *to));
        let next =
            tried.map(|(from, to)| (with_gap(from, to).0, from, to)).min_by(|a, b| a.0.total_cmp(&b.0));
        match next.filter(|next| next.0 < best.0 - 1e-9) {
            Some(next) => best = next,
            None => step = if step > 1 { step / 2 } else { 0 },
        }
    }
    if best.0 > base - WORTHWHILE {
        return None;
    }
    let (_, without, parts) = with_gap(best.1, best.2);
    Some((without, parts))
}
