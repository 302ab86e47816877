//! A trace fit from the first start to the verdicts: chains of iterates from several starts, and what is
//! known at the best end.

use super::assess::{Assessment, assess};
use super::branch::{End, MOST_STARTS};
use super::branches::followed;
use super::descent::{AGREES_SD, Descent, descend};
use super::iterate::{Iterate, Settings, chi2_per_dof};
use super::keep::Keep;
use super::model::TraceModel;
use super::outer::points;
use super::shot::Point;
use crate::blade::modes::{Tip, modes};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Starts that are tried at least, and where frames are too far apart for the fastest mode: there other
/// values may give the same frames.
const FEWEST_STARTS: usize = 2;
const FEWEST_STARTS_SLOW: usize = 4;

/// A start whose first stage costs this many times the least is in another valley and is given up.
const FAR_ABOVE: f64 = 3.0;

/// What a search found.
#[derive(Debug, Clone, PartialEq)]
pub struct Searched {
    /// The starts in order.
    pub descents: Vec<Descent>,
    /// Which of them ends best.
    pub best: usize,
    /// Whether it was asked to stop.
    pub stopped: bool,
    /// What is known at the best end; `None` where no start finished.
    pub assessment: Option<Assessment>,
}

/// Searches from the middle of the ranges, then from seeded places until two starts agree; then assesses the
/// best end.
pub fn search(model: &TraceModel, settings: &Settings, seed: u64, keep: &mut dyn Keep) -> Searched {
    let mut descents: Vec<Descent> = Vec::new();
    let mut stopped = false;
    for start in 0..MOST_STARTS {
        let descent;
        let least = descents.iter().map(Descent::first_cost).fold(f64::INFINITY, f64::min);
        let point = start_point(model, seed, start);
        (descent, stopped) = descend(model, settings, point, start, FAR_ABOVE * least, keep);
        descents.push(descent);
        if stopped || enough(model, &descents) {
            break;
        }
    }
    let best = best_of(&descents);
    let mut found = Searched { descents, best, stopped, assessment: None };
    let at = found.descents.get(best).and_then(Descent::end).filter(|_| !stopped);
    let Some(end) = at.and_then(|at| End::new(model, settings, seed, at)) else { return found };
    let branches = end.branches();
    match followed(&end, &branches, keep) {
        Some(ends) => {
            let branches: Vec<_> = branches.into_iter().zip(ends).collect();
            found.assessment = Some(assess(&end, (&found.descents, best), &branches));
        }
        None => found.stopped = true,
    }
    found
}

/// The middle of every range, or a seeded place for the parameters of wide range.
#[must_use]
pub fn start_point(model: &TraceModel, seed: u64, start: usize) -> Vec<f64> {
    /// Share of a range at either end in which no search starts: the later ones stay nearer to the middle, as
    /// places at the ends of wide bounds often lead nowhere.
    const EDGES: [f64; MOST_STARTS] = [0.1, 0.1, 0.1, 0.3, 0.3, 0.3];
    let edge = EDGES[start.min(MOST_STARTS - 1)];
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed ^ ((start as u64) << 32));
    let place = |unknown: &super::unknown::Unknown| {
        let share = edge + (1.0 - 2.0 * edge) * generator.random::<f64>();
        let [low, high] = unknown.range;
        // (what has a prior starts where that says)
        if start == 0 || unknown.prior.is_some() { unknown.start } else { low + share * (high - low) }
    };
    model.unknowns.0.iter().map(place).collect()
}

/// Whether as many starts as it takes have ended, and two of them at the same place.
fn enough(model: &TraceModel, descents: &[Descent]) -> bool {
    let best = descents[best_of(descents)].end();
    let is_slow = best.is_some_and(|end| too_slow(model, end).is_some());
    let fewest = if is_slow { FEWEST_STARTS_SLOW } else { FEWEST_STARTS };
    descents.len() >= fewest && agreed(model, descents)
}

/// Frames a second, and the fastest mode of the blade, Hz, where that has fewer than two frames a period.
#[must_use]
pub fn too_slow(model: &TraceModel, at: &Iterate) -> Option<[f64; 2]> {
    let one = |point: Point<'_>| {
        let (blade, rate_hz) = (&point.scene.linkage, point.film.rate_hz);
        let fastest = modes(blade, Tip::Free, blade.shoulder.is_some());
        let fastest_hz = fastest.iter().filter_map(|mode| mode.frequency_hz).fold(0.0, f64::max);
        (2.0 * fastest_hz > rate_hz).then_some([rate_hz, fastest_hz])
    };
    points(model, &at.point)?.into_iter().find_map(one)
}

/// The descent of least cost, those without bad segments first.
fn best_of(descents: &[Descent]) -> usize {
    let rank = |descent: &Descent| {
        let end = descent.end();
        let stage = end.map_or(0, |end| end.stage);
        let plain = end.is_some_and(|end| end.plain);
        let cost = end.map_or(f64::INFINITY, |end| end.cost);
        (std::cmp::Reverse(stage), !plain, cost)
    };
    let order = |a: &usize, b: &usize| {
        let [a, b] = [*a, *b].map(|at| rank(&descents[at]));
        (a.0, a.1).cmp(&(b.0, b.1)).then(a.2.total_cmp(&b.2))
    };
    (0..descents.len()).min_by(order).unwrap_or(0)
}

/// Whether another start ends where the best one does.
fn agreed(model: &TraceModel, descents: &[Descent]) -> bool {
    let best = best_of(descents);
    let Some(end) = descents[best].end() else { return false };
    let Some(covariance) = super::outer::covariance(model, end) else { return false };
    let widening = chi2_per_dof(end).0.max(1.0).sqrt();
    let others = descents.iter().enumerate().filter(|(at, _)| *at != best).filter_map(|(_, d)| d.end());
    others.filter(|other| other.plain == end.plain && other.stage == end.stage).any(|other| {
        end.point
            .iter()
            .zip(&other.point)
            .enumerate()
            .all(|(i, (a, b))| (a - b).abs() <= AGREES_SD * widening * covariance.curvature[(i, i)].sqrt())
    })
}
