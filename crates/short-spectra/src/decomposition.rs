//! One model for every record: a trend, oscillations with decay, onset and drift, harmonics, smooth steps and
//! relaxations, frames left out at a price, and autoregressive noise. One criterion, the posterior
//! probability, chooses among all of them (Djurić 1996, *IEEE Trans. Signal Process.* 44).

mod atom;
mod candidates;
mod problem;
mod reading;
mod search;
#[cfg(test)]
mod tests;

use crate::component::Component;
use crate::decimation;
use crate::error::{SpectrumError, check_record};
use crate::noise::raise_order;
use crate::record::SampledRecord;
use crate::settings::{ROUNDING, SpectrumSettings};
use crate::transform::RealTransform;
use crate::trend::Trend;
use atom::Atom;
use portable_math as math;
use problem::{Explanation, NoisyRecord, Parts};
use search::{PartSearch, Rival};

/// Most oscillations that are looked for, and frames for each: an oscillation has up to six parameters.
const MOST_OSCILLATIONS: usize = 12;
const FRAMES_PER_OSCILLATION: usize = 16;
/// Highest order of the noise.
const MOST_ORDER: usize = 8;

/// A record taken apart.
pub(crate) struct Decomposition {
    problem: NoisyRecord,
    explanation: Explanation,
    rivals: Vec<Rival>,
    /// Size, m, of one unit of the scaled values.
    scale_m: f64,
}

/// What to look for in a record.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DecompositionSettings {
    pub trend: Trend,
    /// Whether the trend may become richer, with smooth steps and jumps.
    pub trend_grows: bool,
    /// Most oscillations.
    pub most_oscillations: usize,
}

/// The components of a record with their verdicts, the largest first: trend, oscillations, steps and noise
/// are chosen together by their posterior probability. `settings.detrend`, if given, is the only trend;
/// without it the trend starts as a cubic and may grow.
///
/// # Errors
/// [`SpectrumError`] if the record, the frame rate or the band allows no spectrum.
pub fn decompose_record(
    record: &SampledRecord,
    settings: &SpectrumSettings,
) -> Result<Vec<Component>, SpectrumError> {
    let samples;
    let mut kept = *record;
    if let Some(stride) = decimation::find_stride(record.samples) {
        samples = decimation::decimate(record.samples, stride);
        kept = SampledRecord {
            samples: &samples,
            frame_rate_hz: record.frame_rate_hz / stride.1 as f64,
            exposure_s: record.exposure_s,
        };
    }
    let (_, trend) = check_record(kept.samples, kept.frame_rate_hz, settings)?;
    let frames = kept.samples.iter().flatten().count();
    let search = DecompositionSettings::new(frames, trend, settings.detrend.is_none());
    let found = Decomposition::from_record(&kept, search);
    let mut components = found.map_or_else(Vec::new, |parts| parts.components(&kept, settings));
    let (low_hz, high_hz) = settings.band_hz.unwrap_or((0.0, kept.frame_rate_hz / 2.0));
    components.retain(|c| (low_hz..=high_hz).contains(&c.frequency_hz));
    components.truncate(settings.max_components);
    Ok(components)
}

impl DecompositionSettings {
    /// Settings for a record with values in `frames` frames.
    pub(crate) fn new(frames: usize, trend: Trend, trend_grows: bool) -> Self {
        let most_oscillations = MOST_OSCILLATIONS.min(frames / FRAMES_PER_OSCILLATION);
        Self { trend, trend_grows, most_oscillations }
    }
}

impl Decomposition {
    /// Takes a record apart; `None` if too few frames have a value or all are equal.
    pub(crate) fn from_record(record: &SampledRecord, settings: DecompositionSettings) -> Option<Self> {
        let samples = record.samples;
        let used: Vec<usize> = (0..samples.len()).filter(|i| samples[*i].is_some()).collect();
        let values: Vec<f64> = samples.iter().flatten().copied().collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let scale_m =
            (values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / values.len() as f64).sqrt();
        if scale_m.is_nan() || scale_m <= 1e-12 * mean.abs() || used.len() < settings.trend.column_count() + 4
        {
            return None;
        }
        let values = values.iter().map(|x| (x - mean) / scale_m).collect();
        let largest = samples.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
        let mut white = NoisyRecord::new(samples.len(), used, values);
        white.least_variance = math::powi(ROUNDING * largest / scale_m, 2).max(1e-300);
        let (search, explanation) = select_explanation(white, &settings);
        let rivals = search.rivals;
        let mut found = Self { problem: search.problem, explanation, rivals, scale_m };
        found.add_rivals();
        Some(found)
    }
}

/// The most probable explanation among those with and without a jump, in white and in coloured noise.
fn select_explanation(white: NoisyRecord, settings: &DecompositionSettings) -> (PartSearch, Explanation) {
    /// Number of oscillations of a first look in white noise.
    const FIRST_LOOK: usize = 4;
    /// Lead in the criterion, nats, with which an explanation ends the search for others.
    const CLEAR_LEAD: f64 = 20.0;
    let start = Parts { trend: settings.trend, atoms: Vec::new() };
    let new_search = |problem: NoisyRecord, most: usize| PartSearch::new(problem, settings.trend_grows, most);
    let mut best: Option<(PartSearch, Explanation)> = None;
    let take = |best: &mut Option<(PartSearch, Explanation)>, search: PartSearch, found: Explanation| {
        if best.as_ref().is_none_or(|(_, best)| found.criterion < best.criterion) {
            *best = Some((search, found));
        }
    };
    let bound =
        |best: &Option<(PartSearch, Explanation)>| best.as_ref().map_or(f64::INFINITY, |b| b.1.criterion);
    let jump = settings.trend_grows.then(|| find_jump(&white, &start)).flatten();
    let plain = with_noise_of(&white, &start);
    let noise_criterion = plain.fit_parts(&start, 0).criterion;
    let mut search = new_search(white, FIRST_LOOK.min(settings.most_oscillations));
    search.bound = noise_criterion;
    let first = search.find_parts(start);
    search.bound = f64::INFINITY;
    let slow: Vec<Atom> = first.parts.atoms.iter().filter(|a| a.oscillation().is_none()).cloned().collect();
    let slow = Parts { trend: first.parts.trend, atoms: slow };
    let (background, alone) =
        (with_background(&search.problem, &slow), with_noise_of(&search.problem, &slow));
    let noise_alone = alone.fit_parts(&slow, 2);
    let coloured = background.order > 0 || noise_alone.criterion < first.criterion;
    if coloured {
        let mut search = new_search(background, settings.most_oscillations);
        let found = search.find_parts(slow.clone());
        let (search, found) = search_in_left_noise((search, found), settings);
        take(&mut best, search, found);
        let mut search = new_search(alone, settings.most_oscillations);
        search.bound = bound(&best);
        let found = search.find_parts(noise_alone.parts);
        take(&mut best, search, found);
    }
    if let Some((problem, parts)) = jump {
        let mut search = new_search(problem, settings.most_oscillations);
        search.bound = bound(&best);
        let with_jump = search.find_parts(parts);
        let leads = with_jump.criterion < first.criterion - CLEAR_LEAD;
        let (search, with_jump) = search_in_left_noise((search, with_jump), settings);
        take(&mut best, search, with_jump);
        if leads || coloured {
            return best.expect("an explanation was taken");
        }
    }
    search.most_oscillations = settings.most_oscillations;
    search.bound = bound(&best);
    let found = search.find_parts(first.parts);
    let (search, found) = search_in_left_noise((search, found), settings);
    take(&mut best, search, found);
    best.expect("an explanation was taken")
}

/// The search again in the noise that its explanation leaves, as long as that is more probable.
fn search_in_left_noise(
    mut best: (PartSearch, Explanation),
    settings: &DecompositionSettings,
) -> (PartSearch, Explanation) {
    const MOST_ROUNDS: usize = 3;
    for _ in 0..MOST_ROUNDS {
        let coloured = with_noise_of(&best.0.problem, &best.1.parts);
        if coloured.order == 0 && best.0.problem.order == 0 {
            break;
        }
        let mut again = PartSearch::new(coloured, settings.trend_grows, settings.most_oscillations);
        let better = again.find_parts(best.1.parts.clone());
        if better.criterion >= best.1.criterion - 0.1 {
            break;
        }
        best = (again, better);
    }
    best
}

/// The problem with the noise below the lines of what parts leave: a running median of the power density,
/// which lines do not change, gives the autocorrelation.
fn with_background(problem: &NoisyRecord, parts: &Parts) -> NoisyRecord {
    /// Half width of the running median, bins: four times that of a line.
    const HALF_WIDTH: usize = 8;
    let white = problem.clone().with_noise(&[]);
    let left = white.fit_parts(parts, 4);
    let frames = white.at.frames;
    let mut values = vec![0.0; frames];
    for (i, r) in white.used.iter().zip(&left.residual) {
        let hann = 0.5 - 0.5 * math::cos(std::f64::consts::TAU * (*i as f64 + 0.5) / frames as f64);
        values[*i] = hann * r;
    }
    let padded = frames.next_power_of_two();
    let density = RealTransform::new(padded).squared_magnitudes(values.into_iter());
    let bins = HALF_WIDTH * padded.div_ceil(frames);
    let smooth: Vec<f64> = (0..density.len())
        .map(|k| {
            let mut near = density[k.saturating_sub(bins)..(k + bins + 1).min(density.len())].to_vec();
            near.sort_by(f64::total_cmp);
            near[near.len() / 2]
        })
        .collect();
    let correlation = |lag: usize| -> f64 {
        let turn = std::f64::consts::TAU * lag as f64 / padded as f64;
        smooth.iter().enumerate().map(|(k, s)| s * math::cos(turn * k as f64)).sum()
    };
    let correlations: Vec<f64> = (0..=MOST_ORDER).map(correlation).collect();
    let n = white.len() as f64;
    let mut coefficients: Vec<f64> = Vec::new();
    let (mut variance, mut best) = (1.0, (0.0, Vec::new()));
    for order in 1..=most_order(white.len()) {
        let predicted: f64 =
            coefficients.iter().zip((1..order).rev()).map(|(a, lag)| a * correlations[lag]).sum();
        let kappa = (correlations[order] - predicted) / (variance * correlations[0]);
        if kappa.is_nan() || kappa.abs() >= 1.0 {
            break;
        }
        coefficients = raise_order(&coefficients, kappa);
        variance *= 1.0 - kappa * kappa;
        let criterion = 0.5 * n * math::ln(variance) + 0.5 * order as f64 * math::ln(n);
        if criterion < best.0 - MEDIAN_SCATTER {
            best = (criterion, coefficients.clone());
        }
    }
    white.with_noise(&best.1)
}

/// Gain of the criterion, nats, that the scatter of a running median pretends.
const MEDIAN_SCATTER: f64 = 4.0;

/// The problem with the noise that parts leave.
fn with_noise_of(problem: &NoisyRecord, parts: &Parts) -> NoisyRecord {
    let white = problem.clone().with_noise(&[]);
    let left = white.fit_parts(parts, 4);
    let coefficients = estimate_coefficients(&white.used, &left.residual);
    white.with_noise(&coefficients)
}

/// Highest order of the noise of so many frames.
fn most_order(frames: usize) -> usize {
    const FRAMES_PER_COEFFICIENT: usize = 25;
    MOST_ORDER.min(frames / FRAMES_PER_COEFFICIENT)
}

/// Autoregressive coefficients of a residual with gaps (Burg's method over the stretches without a gap); the
/// order has the lowest Bayesian information criterion.
fn estimate_coefficients(used: &[usize], residual: &[f64]) -> Vec<f64> {
    let n = residual.len() as f64;
    let mut stretches: Vec<(Vec<f64>, Vec<f64>)> = Vec::new();
    let mut first = 0;
    for k in 1..=used.len() {
        if k == used.len() || used[k] != used[k - 1] + 1 {
            stretches.push((residual[first..k].to_vec(), residual[first..k].to_vec()));
            first = k;
        }
    }
    let mut coefficients: Vec<f64> = Vec::new();
    let (mut variance, mut best) = (1.0, (0.0, Vec::new()));
    for order in 1..=most_order(used.len()) {
        let (mut product, mut energy, mut pairs) = (0.0, 0.0, 0);
        for (forward, backward) in &stretches {
            for i in order..forward.len() {
                product += forward[i] * backward[i - 1];
                energy += forward[i] * forward[i] + backward[i - 1] * backward[i - 1];
                pairs += 1;
            }
        }
        if pairs < 4 * order || energy <= 0.0 {
            break;
        }
        let kappa: f64 = 2.0 * product / energy;
        for (forward, backward) in &mut stretches {
            for i in (order..forward.len()).rev() {
                let (f, b) = (forward[i], backward[i - 1]);
                forward[i] = f - kappa * b;
                backward[i] = b - kappa * f;
            }
        }
        coefficients = raise_order(&coefficients, kappa);
        variance *= 1.0 - kappa * kappa;
        let criterion = 0.5 * n * math::ln(variance) + 0.5 * order as f64 * math::ln(n);
        if criterion < best.0 {
            best = (criterion, coefficients.clone());
        }
    }
    best.1
}

/// The interval that is best left out between two trends, with the parts that describe the jump; `None` if
/// leaving nothing out is as probable.
fn find_jump(problem: &NoisyRecord, start: &Parts) -> Option<(NoisyRecord, Parts)> {
    const WIDTHS: [usize; 9] = [1, 2, 6, 15, 30, 60, 100, 150, 250];
    /// Fall of the criterion, nats, from which a jump is tried.
    const WORTHWHILE: f64 = 8.0;
    let n = problem.len();
    let frames = problem.at.frames;
    let base = problem.fit_parts(start, 0).criterion;
    // the steepest rise over a sixtieth of the record
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
    let usable = |from: usize, to: usize| from >= 4 && from < to && to + 4 <= frames;
    let around = |width: &usize| {
        (middle.saturating_sub(width / 2).max(4), (middle + width.div_ceil(2)).min(frames - 4))
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
