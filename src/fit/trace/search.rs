//! The search of a trace fit: it iterates from several starting points and assesses the best result.

use super::assessment::{TraceAssessment, assess_end};
use super::iterate::{Iterate, TraceDescent, TraceSearchSettings};
use super::levenberg_marquardt::{first_iterate, next_iterate, start_stage};
use super::lobes::{MAX_LOBES, find_lobes};
use super::model::TraceModel;
use super::normal_equations::recording_models;
use super::prior_conflict::prior_conflicts;
use super::rivals::{has_lost, is_same_minimum};
use super::segment_simulation::RecordingModel;
use super::slider_start::regress_motion;
use super::uncertainty_run::{MAX_STARTS, SearchEnd, describe_iterate, follow_runs};
use super::unknowns::{TraceUnknown, UnknownKind};
use crate::fit::journal::Journal;
use crate::model::modes::{TipConstraint, natural_modes};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::cmp::Reverse;

const MIN_STARTS: usize = 2;
/// Minimum number of starts if the frame rate undersamples the fastest mode, because several sets of
/// parameter values may then fit the frames equally well. A search with free constants gives up after as many
/// starts that explain nothing.
const MIN_STARTS_SLOW: usize = 4;

/// A start is abandoned if its cost after the first stage exceeds this factor times the lowest cost of any
/// earlier start after its first stage. Such a start leads to a different, worse minimum.
const GIVE_UP_FACTOR: f64 = 3.0;

/// Outcome of a trace search.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TraceSearchOutcome {
    /// One descent per start, in the order of the starts; then one per lobe, whose last stage has whole
    /// segments.
    pub descents: Vec<TraceDescent>,
    /// Index of the descent with the best end.
    pub best: usize,
    /// Whether the search ended early because the journal requested a stop.
    pub stopped: bool,
    /// Intervals of the estimates at the best end, and reasons to doubt them; `None` if the search was
    /// stopped, or if the covariance at the best end does not exist.
    pub assessment: Option<TraceAssessment>,
}

/// Searches from the middle of the ranges, then from points given by `seed`, until two searches end in
/// the same minimum. If a segment is much longer than its stage, searches on with whole segments from each
/// lobe. Then assesses the best end point.
pub fn search_trace(
    model: &TraceModel,
    settings: &TraceSearchSettings,
    seed: u64,
    journal: &mut Journal<'_>,
) -> TraceSearchOutcome {
    let mut found = TraceSearchOutcome::default();
    for start in 0..MAX_STARTS {
        let first_costs = found.descents.iter().filter_map(|descent| Some(descent.stages.first()?.cost));
        let limit = GIVE_UP_FACTOR * first_costs.fold(f64::INFINITY, f64::min);
        let first = || first_of_start(model, settings, seed, start);
        let (descent, stopped) = descend(model, settings, start, first, limit, journal);
        found.descents.push(descent);
        if stopped {
            return TraceSearchOutcome { stopped, ..found };
        }
        if has_enough_starts(model, settings, seed, &found.descents) {
            break;
        }
    }
    let starts = found.descents.len();
    // the lobes are sought around the best end of a start
    let best = best_descent(&found.descents);
    found.best = best;
    let Some(rest) = SearchEnd::of_descent(model, settings, seed, &found.descents[best]) else {
        return found;
    };
    let confirmed = has_company(&rest, &found.descents, best);
    // another end that fits nearly as well may fit better with whole segments
    let mut lobes = if rest.at.plain { find_lobes(&rest) } else { Vec::new() };
    if !lobes.is_empty() {
        let rivals = other_ends(&found.descents, best).filter(|other| !has_lost(&rest, other));
        lobes.extend(rivals.map(|rival| rival.point.clone()));
        lobes.truncate(MAX_LOBES);
    }
    let earlier = found.descents[best].stages[..rest.at.stage].to_vec();
    let mut ends = Vec::new();
    for (lobe, point) in lobes.iter().enumerate() {
        let start = MAX_STARTS + lobe;
        let first = || start_stage(model, settings, (rest.at.stage, true), point, &rest.at.segments);
        let (descent, stopped) = descend(model, settings, start, first, f64::INFINITY, journal);
        let stages = earlier.iter().cloned().chain(descent.stages).collect();
        ends.push(TraceDescent { stages, ..descent });
        if stopped {
            found.stopped = true;
            break;
        }
    }
    found.descents.extend(ends);
    let compared = if lobes.is_empty() { 0..starts } else { starts..found.descents.len() };
    found.best = compared.start + best_descent(&found.descents[compared.clone()]);
    if found.stopped {
        return found;
    }
    let Some(end) = SearchEnd::of_descent(model, settings, seed, &found.descents[found.best]) else {
        return found;
    };
    let runs = end.uncertainty_runs();
    let Some(ends) = follow_runs(&end, &runs, journal) else {
        return TraceSearchOutcome { stopped: true, ..found };
    };
    let others: Vec<&Iterate> =
        compared.filter(|at| *at != found.best).filter_map(|at| found.descents[at].last_iterate()).collect();
    let lonely = (!confirmed).then(|| format!("no two of {starts} starts end in the same minimum"));
    let runs: Vec<_> = runs.into_iter().zip(ends).collect();
    found.assessment = Some(assess_end(&end, &others, lonely, &runs));
    found
}

/// First iterate of a start. Every second start from the third on is the best of several points: where two
/// starts do not agree, the cost has several minima, and the right one may lie far from most points.
fn first_of_start(
    model: &TraceModel,
    settings: &TraceSearchSettings,
    seed: u64,
    start: usize,
) -> Option<Iterate> {
    /// Number of points of which the best is taken.
    const SCREENED: usize = 24;
    let first = |point: usize| first_iterate(model, settings, &start_point(model, seed, point));
    if start < MIN_STARTS || start % 2 == 1 {
        return first(start);
    }
    let tried = (0..SCREENED).filter_map(|point| first(start + MAX_STARTS * point));
    tried.min_by(|a, b| a.cost.total_cmp(&b.cost))
}

/// Point at which a start begins, in the coordinates of the unknowns. Start 0 is in the middle of every
/// range, the others are at random points given by `seed`. Camera errors and unknowns with a prior always
/// begin at their own `start`. The first two starts of a slider begin at the values that the equation of
/// motion gives in the two halves of the recordings.
#[must_use]
pub fn start_point(model: &TraceModel, seed: u64, start: usize) -> Vec<f64> {
    /// Fraction of each range, at either end, in which no search starts; one entry per start. Later random
    /// starts are nearer to the middle, because searches that start near the ends of a wide range often fail;
    /// those that are the best of several points need not be.
    const EDGES: [f64; MAX_STARTS] = [0.1, 0.1, 0.1, 0.3, 0.1, 0.3];
    let edge = EDGES[start % MAX_STARTS];
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed ^ ((start as u64) << 32));
    let place = |unknown: &TraceUnknown| {
        let share = edge + (1.0 - 2.0 * edge) * generator.random::<f64>();
        let [low, high] = unknown.range;
        let is_known = unknown.prior.is_some() || matches!(unknown.kind, UnknownKind::Camera { .. });
        if start == 0 || is_known { unknown.start } else { low + share * (high - low) }
    };
    let point: Vec<f64> = model.unknowns.0.iter().map(place).collect();
    let regressed = (start < 2).then(|| regress_motion(model, &point, start)).flatten();
    regressed.unwrap_or(point)
}

/// Whether no further start is needed. This is so if the minimum number of starts is reached, another start
/// ends in the same minimum as the best start, and no constant contradicts its prior there. It is also so if
/// the best end explains nothing, and enough starts explain nothing with segments longer than the first.
fn has_enough_starts(
    model: &TraceModel,
    settings: &TraceSearchSettings,
    seed: u64,
    descents: &[TraceDescent],
) -> bool {
    let best = best_descent(descents);
    let Some(end) = descents[best].last_iterate() else { return false };
    let end_search = || SearchEnd::new(model, settings, seed, end);
    if end.plain && end.is_junk(model) {
        // a least-squares fit
        return descents.len() >= MIN_STARTS
            && end_search().is_some_and(|end| has_company(&end, descents, best));
    }
    // if short segments fit and longer ones do not, the model is wrong, not the start
    let grows = |descent: &&TraceDescent| {
        descent.stages.len() > 1 && descent.last_iterate().is_some_and(|end| end.is_junk(model))
    };
    let has_constants = (0..end.point.len()).any(|i| model.unknowns.is_constant(i));
    let most_junk = if has_constants { MIN_STARTS_SLOW } else { MIN_STARTS };
    if end.is_junk(model) && descents.iter().filter(grows).count() >= most_junk {
        return true;
    }
    let fewest = if undersampled_mode(model, end).is_some() { MIN_STARTS_SLOW } else { MIN_STARTS };
    // constants that contradict their priors may come from a wrong minimum, even if two starts end there
    let is_plausible =
        |end: SearchEnd<'_>| has_company(&end, descents, best) && prior_conflicts(&end).is_empty();
    descents.len() >= fewest && end_search().is_some_and(is_plausible)
}

/// Whether another start ends in the same minimum as the best start.
fn has_company(end: &SearchEnd<'_>, descents: &[TraceDescent], best: usize) -> bool {
    other_ends(descents, best).any(|other| is_same_minimum(end, other))
}

/// Frame rate and frequency of the blade's fastest mode, both in Hz, if there are fewer than two frames per
/// period of this mode; otherwise `None`.
#[must_use]
pub fn undersampled_mode(model: &TraceModel, at: &Iterate) -> Option<[f64; 2]> {
    let one = |point: RecordingModel<'_>| {
        let (blade, rate_hz) = (&point.scene.linkage, point.observation.rate_hz);
        let fastest = natural_modes(blade, TipConstraint::Free, blade.shoulder.is_some());
        let fastest_hz = fastest.iter().filter_map(|mode| mode.frequency_hz).fold(0.0, f64::max);
        (2.0 * fastest_hz > rate_hz).then_some([rate_hz, fastest_hz])
    };
    recording_models(model, &at.point)?.into_iter().find_map(one)
}

/// Index of the best descent. Of the descents that reached the latest stage, those that end with the plain
/// chi2 as cost are preferred; of these, the descent with the lowest cost is the best.
fn best_descent(descents: &[TraceDescent]) -> usize {
    let rank = |descent: &TraceDescent| match descent.last_iterate() {
        // (without a segment, the cost is that of the priors alone)
        Some(end) if !end.segments.is_empty() => (Reverse(end.stage), !end.plain, end.cost),
        _ => (Reverse(0), true, f64::INFINITY),
    };
    let order = |a: &usize, b: &usize| {
        let [a, b] = [*a, *b].map(|at| rank(&descents[at]));
        (a.0, a.1).cmp(&(b.0, b.1)).then(a.2.total_cmp(&b.2))
    };
    (0..descents.len()).min_by(order).unwrap_or(0)
}

/// Last iterates of all descents except the best one.
fn other_ends(descents: &[TraceDescent], best: usize) -> impl Iterator<Item = &Iterate> {
    let others = descents.iter().enumerate().filter(move |(at, _)| *at != best);
    others.filter_map(|(_, descent)| descent.last_iterate())
}

// Search from one start.

/// Computes the iterates of one chain, from `first` to the end of its search. Returns the descent, and a flag
/// that is true if the journal requested a stop.
///
/// The chain is abandoned if its first stage ends with a cost above `limit`.
fn descend(
    model: &TraceModel,
    settings: &TraceSearchSettings,
    chain: usize,
    first: impl Fn() -> Option<Iterate> + Sync,
    limit: f64,
    journal: &mut Journal<'_>,
) -> (TraceDescent, bool) {
    let describe = |chain: usize, at: &Iterate| describe_iterate(chain, at, &settings.segment_s);
    let mut descent = TraceDescent { start: chain, stages: Vec::new(), iterates: 0 };
    loop {
        let last = descent.last_iterate();
        if last.is_some_and(|at| at.settled && at.stage == 0 && at.cost > limit) {
            return (descent, false);
        }
        let compute = |_| match last {
            None => first(),
            Some(before) => next_iterate(model, settings, before),
        };
        match journal.compute_iterates(&[(chain, descent.iterates)], &compute, &describe) {
            Err(_) => return (descent, true),
            Ok(next) if next.is_empty() => return (descent, false),
            Ok(next) => {
                descent.stages.pop_if(|before| before.stage == next[0].stage);
                descent.stages.extend(next);
                descent.iterates += 1;
            }
        }
    }
}
