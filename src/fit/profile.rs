//! Profile likelihood: along each parameter, the lowest cost that the others can still reach.
//!
//! From the best point a walker goes up and another down each parameter. At every place it lets the others
//! follow, by the linear model first and then by damped Gauss-Newton steps corrected by Broyden's rule, until
//! the cost has risen by more than the threshold or the range ends (Venzon and Moolgavkar, Appl. Stat. 37
//! (1988) 87; Raue et al., Bioinformatics 25 (2009) 1923). All walkers step together, so that their
//! evaluations run in parallel and their order does not depend on the number of threads.
//!
//! A cost of features is rough: behind a ridge of it may lie values that are as good. So a walker starts at
//! each place from the best that the fit already knows near it too, looks on behind the crossing that it has
//! found, and goes on from the farthest point of the whole fit that is within the threshold.

use super::bounds::clamp_unit;
use super::evaluation::Evaluation;
use super::evaluation::EvaluationStage;
use super::ledger::{Ledger, StopReason};
use super::linear_model::SingularDirections;
use super::linear_model::{
    FeatureSlopes, broyden_update, damped_step, difference_points, jacobian as measured, residuals,
    step_in_box,
};
use crate::math;
use nalgebra::DMatrix;

/// Dampings of the inner steps: nearly undamped, and short.
const DAMPINGS: [f64; 2] = [1.0, 3e2];
/// Inner steps at a place: the linear model starts them near the minimum.
const INNER_STEPS: usize = 3;
/// Gain in cost below which the others have followed: a fiftieth of the threshold.
const FOLLOWED_GAIN: f64 = 0.08;
/// Places of a walker, at most: from a poor linear model a walker takes about eight, and each look behind a
/// crossing is one.
const MAX_PLACES: usize = 20;
/// Places behind a crossing, in its distance from the best point, at which the cost has to be above the
/// threshold too: a ridge as wide as a quarter of an interval is stepped over.
const PROBE_FACTORS: [f64; 2] = [1.25, 1.6];
/// A point of the fit this near in the coordinate, in the unit box, starts the others at a place.
const NEAR_COORDINATE: f64 = 0.01;
/// How often walkers go on from a point of the fit that lies behind the crossings that they have found.
const MAX_RESUMPTIONS: usize = 3;
/// First place, as a share of where the linear model crosses the threshold.
const FIRST_STEP_SHARE: f64 = 0.6;
/// Shortest and longest first step in the unit box.
const FIRST_STEP_RANGE: (f64, f64) = (0.003, 0.25);
/// Aim beyond the threshold, in the root of the rise, so that the next place is likely to bracket it.
const OVERSHOOT: f64 = 1.1;
/// A bracket is narrow enough when its outer end costs no more than this many thresholds, in the root.
const NARROW_BRACKET: f64 = 1.35;
/// Nearer than this to a bound, in the unit box, a place lies at it: a search resolves no less.
pub(crate) const AT_BOUND: f64 = 1e-3;
/// A step grows by this factor at most.
const MAX_STEP_GROWTH: f64 = 3.0;

/// The profile of one parameter.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ProfileLikelihood {
    /// Place in the unit interval and lowest cost there, from below to above, the best point included.
    pub points: Vec<(f64, f64)>,
    /// Where the cost crosses the threshold below; `None` where it does not within the range, or only because
    /// another parameter is at its bound there.
    pub lower: Option<f64>,
    pub upper: Option<f64>,
}

/// Profiles of all parameters from `best`, the Jacobian there, and the rise in cost that bounds an interval.
///
/// # Errors
/// [`StopReason`] when the evaluations are used up or may not go on.
pub(crate) fn profile_parameters(
    ledger: &mut Ledger,
    best: &Evaluation,
    jacobian: &DMatrix<f64>,
    rise: f64,
) -> Result<Vec<ProfileLikelihood>, StopReason> {
    let directions = SingularDirections::from_jacobian(jacobian);
    let start = ProfilePoint { residuals: residuals(ledger.objective(), best), evaluation: best.clone() };
    let sides = (0..best.unit.len()).flat_map(|axis| [-1.0, 1.0].map(|sign| (axis, sign)));
    let mut walkers: Vec<ProfileWalker> = sides
        .map(|(axis, sign)| ProfileWalker::new(&start, jacobian, &directions, axis, sign, rise))
        .collect();
    walk_to_ends(ledger, &mut walkers)?;
    for _ in 0..MAX_RESUMPTIONS {
        if !resume_walkers(ledger, &mut walkers)? {
            break;
        }
        walk_to_ends(ledger, &mut walkers)?;
    }
    Ok(walkers.chunks(2).filter_map(|pair| Some(join_walkers(best, pair.first()?, pair.get(1)?))).collect())
}

fn walk_to_ends(ledger: &mut Ledger, walkers: &mut [ProfileWalker]) -> Result<(), StopReason> {
    while walkers.iter().any(|walker| walker.end.is_none()) {
        advance_walkers(ledger, walkers)?;
    }
    Ok(())
}

/// Sends walkers on from the farthest points within the threshold that lie behind their crossings; whether
/// there are any.
fn resume_walkers(ledger: &mut Ledger, walkers: &mut [ProfileWalker]) -> Result<bool, StopReason> {
    let farther: Vec<Option<Evaluation>> =
        walkers.iter().map(|walker| walker.farthest_within_threshold(ledger)).collect();
    let around: Vec<Vec<f64>> =
        farther.iter().flatten().flat_map(|from| difference_points(&from.unit)).collect();
    ledger.evaluate_points(EvaluationStage::Profile, &around)?;
    let objective = ledger.objective();
    for (walker, from) in walkers.iter_mut().zip(&farther) {
        let Some(from) = from else { continue };
        let around: Vec<&Evaluation> =
            difference_points(&from.unit).iter().filter_map(|point| ledger.find_evaluation(point)).collect();
        let model =
            measured(objective, from, &FeatureSlopes::from_differences(objective.targets(), from, &around));
        walker.resume_from(
            ProfilePoint { residuals: residuals(objective, from), evaluation: from.clone() },
            model,
        );
    }
    Ok(farther.iter().any(Option::is_some))
}

/// One place of every walker that still walks.
fn advance_walkers(ledger: &mut Ledger, walkers: &mut [ProfileWalker]) -> Result<(), StopReason> {
    for walker in walkers.iter_mut() {
        walker.advance();
        walker.near = walker.nearest_known_point(ledger);
    }
    for _ in 0..=INNER_STEPS {
        let proposals: Vec<Vec<Vec<f64>>> = walkers.iter().map(|walker| walker.proposed_points()).collect();
        let all: Vec<Vec<f64>> = proposals.iter().flatten().cloned().collect();
        if all.is_empty() {
            break;
        }
        ledger.evaluate_points(EvaluationStage::Profile, &all)?;
        for (walker, proposed) in walkers.iter_mut().zip(&proposals) {
            let objective = ledger.objective();
            let place =
                |e: &Evaluation| ProfilePoint { residuals: residuals(objective, e), evaluation: e.clone() };
            walker.keep_best(proposed.iter().filter_map(|point| ledger.find_evaluation(point).map(place)));
        }
    }
    walkers.iter_mut().for_each(ProfileWalker::finish_place);
    Ok(())
}

fn join_walkers(best: &Evaluation, below: &ProfileWalker, above: &ProfileWalker) -> ProfileLikelihood {
    let centre = (best.unit.get(below.axis).copied().unwrap_or(0.5), best.cost);
    let mut points: Vec<(f64, f64)> =
        below.places.iter().chain(&above.places).copied().chain([centre]).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let crossing = |walker: &ProfileWalker| walker.end.flatten();
    ProfileLikelihood { points, lower: crossing(below), upper: crossing(above) }
}

/// An evaluation with its residuals.
#[derive(Debug, Clone)]
struct ProfilePoint {
    evaluation: Evaluation,
    residuals: Vec<Option<f64>>,
}

/// Walks one way along one parameter.
struct ProfileWalker {
    axis: usize,
    sign: f64,
    /// Root of the rise that bounds the interval.
    most_root: f64,
    start: (f64, f64),
    start_unit: Vec<f64>,
    /// The last place within the threshold; the others start from there.
    base: ProfilePoint,
    /// Linear model of the residuals.
    model: DMatrix<f64>,
    /// Coordinate on which it stands, and the best found there.
    at: f64,
    here: Option<ProfilePoint>,
    /// The best point that the fit knows near that coordinate.
    near: Option<Vec<f64>>,
    followed: bool,
    next_step: f64,
    /// The nearest place beyond the threshold, with the root of its rise.
    outside: Option<(f64, f64)>,
    /// A crossing that was found, and how often it was looked behind.
    crossing: Option<(f64, usize)>,
    /// Whether another parameter lies at its bound there: then the bounds end the interval, and not the
    /// features.
    pinned: bool,
    places: Vec<(f64, f64)>,
    /// Places that it may still go to.
    left: usize,
    /// The crossing; `Some(None)` when the range ended first.
    end: Option<Option<f64>>,
}

impl ProfileWalker {
    fn new(
        start: &ProfilePoint,
        jacobian: &DMatrix<f64>,
        directions: &SingularDirections,
        axis: usize,
        sign: f64,
        rise: f64,
    ) -> Self {
        let at = start.evaluation.unit.get(axis).copied().unwrap_or(0.5);
        let (sd, _) = directions.coordinate_sd(axis);
        let first = if directions.determines(axis) {
            FIRST_STEP_SHARE * sd * rise.sqrt()
        } else {
            FIRST_STEP_RANGE.1
        };
        Self {
            axis,
            sign,
            most_root: rise.sqrt(),
            start: (at, start.evaluation.cost),
            start_unit: start.evaluation.unit.clone(),
            base: start.clone(),
            model: jacobian.clone(),
            at,
            here: None,
            near: None,
            followed: false,
            next_step: first.clamp(FIRST_STEP_RANGE.0, FIRST_STEP_RANGE.1),
            outside: None,
            crossing: None,
            pinned: false,
            places: Vec::new(),
            left: MAX_PLACES,
            end: None,
        }
    }

    /// Goes to the next place, or ends where the range does.
    fn advance(&mut self) {
        if self.end.is_some() {
            return;
        }
        (self.here, self.followed) = (None, false);
        let from = self.base_coordinate();
        self.at = clamp_unit(from + self.sign * self.next_step);
        if self.at == from {
            self.end = Some(None);
        }
    }

    fn base_coordinate(&self) -> f64 {
        self.base.evaluation.unit.get(self.axis).copied().unwrap_or(self.at)
    }

    /// The points that it wants to know, none when it has arrived.
    fn proposed_points(&self) -> Vec<Vec<f64>> {
        if self.end.is_some() || self.followed {
            return Vec::new();
        }
        let Some(here) = &self.here else { return self.first_points() };
        let steps = DAMPINGS
            .iter()
            .filter_map(|damping| damped_step(&self.model, &here.residuals, *damping, Some(self.axis)));
        steps.map(|d| step_in_box(&here.evaluation.unit, &d)).collect()
    }

    /// The best point that the fit knows near the coordinate, moved onto it.
    fn nearest_known_point(&self, ledger: &Ledger) -> Option<Vec<f64>> {
        let near =
            |e: &&Evaluation| e.unit.get(self.axis).is_some_and(|u| (u - self.at).abs() <= NEAR_COORDINATE);
        let known =
            ledger.run_evaluations().iter().filter(|_| self.end.is_none()).filter(|e| e.failure.is_none());
        let best = known.filter(near).min_by(|a, b| a.cost.total_cmp(&b.cost))?;
        Some(self.move_onto_coordinate(&best.unit))
    }

    fn move_onto_coordinate(&self, unit: &[f64]) -> Vec<f64> {
        unit.iter().enumerate().map(|(at, u)| if at == self.axis { self.at } else { *u }).collect()
    }

    /// The farthest point of the fit within the threshold, where it lies behind the crossing.
    fn farthest_within_threshold(&self, ledger: &Ledger) -> Option<Evaluation> {
        let crossing = self.end.flatten()?;
        let limit = self.start.1 + math::powi(self.most_root, 2);
        let along = |e: &Evaluation| e.unit.get(self.axis).map_or(0.0, |u| self.sign * (u - crossing));
        let within = ledger.run_evaluations().iter().filter(|e| e.failure.is_none() && e.cost <= limit);
        let farthest = within.max_by(|a, b| along(a).total_cmp(&along(b)))?;
        (along(farthest) > FIRST_STEP_RANGE.0 / 2.0).then(|| farthest.clone())
    }

    /// Goes on from a place within the threshold.
    fn resume_from(&mut self, base: ProfilePoint, model: DMatrix<f64>) {
        let directions = SingularDirections::from_jacobian(&model);
        let (sd, _) = directions.coordinate_sd(self.axis);
        self.next_step =
            (FIRST_STEP_SHARE * sd * self.most_root).clamp(FIRST_STEP_RANGE.0, FIRST_STEP_RANGE.1);
        (self.base, self.model) = (base, model);
        (self.end, self.outside, self.crossing, self.pinned) = (None, None, None, false);
        self.left = MAX_PLACES;
    }

    /// The others as they were, and as the linear model lets them follow.
    fn first_points(&self) -> Vec<Vec<f64>> {
        let change = self.at - self.base_coordinate();
        let kept = self.move_onto_coordinate(&self.base.evaluation.unit);
        let expected = self
            .base
            .residuals
            .iter()
            .enumerate()
            .map(|(row, r)| r.map(|r| r + self.model[(row, self.axis)] * change));
        let followed = damped_step(&self.model, &expected.collect::<Vec<_>>(), DAMPINGS[0], Some(self.axis))
            .map(|d| step_in_box(&kept, &d));
        [Some(kept), followed, self.near.clone()].into_iter().flatten().collect()
    }

    /// Keeps the best of what was found here.
    fn keep_best(&mut self, found: impl Iterator<Item = ProfilePoint>) {
        let Some(best) = found.min_by(|a, b| a.evaluation.cost.total_cmp(&b.evaluation.cost)) else { return };
        let known = self.here.as_ref().map_or(f64::INFINITY, |here| here.evaluation.cost);
        self.followed = known - best.evaluation.cost <= FOLLOWED_GAIN || best.evaluation.failure.is_some();
        if best.evaluation.cost >= known {
            return;
        }
        let from = self.here.as_ref().unwrap_or(&self.base);
        if best.evaluation.failure.is_none() {
            let taken: Vec<f64> =
                best.evaluation.unit.iter().zip(&from.evaluation.unit).map(|(to, from)| to - from).collect();
            broyden_update(&mut self.model, &from.residuals, &best.residuals, &taken);
        }
        self.here = Some(best);
    }

    /// Notes the place and decides where to go next.
    fn finish_place(&mut self) {
        let (None, Some(here)) = (self.end, self.here.take()) else { return };
        self.places.push((self.at, here.evaluation.cost));
        self.left = self.left.saturating_sub(1);
        let root = self.cost_rise_root(&here);
        if root <= self.most_root {
            self.step_from_inside(here, root);
        } else if let Some((crossing, looked)) = self.crossing {
            self.probe_behind_crossing(crossing, looked);
        } else {
            self.pinned =
                here.evaluation.failure.is_none() && self.pins_another_parameter(&here.evaluation.unit);
            self.step_from_outside(root);
        }
        if self.end.is_none() && self.left == 0 {
            let crossing = self.crossing.map(|(crossing, _)| crossing);
            self.end = Some(crossing.or(self.outside.map(|(place, _)| place)).filter(|_| !self.pinned));
        }
    }

    /// Goes to the next place behind a crossing, or ends there when all of them were above the threshold.
    fn probe_behind_crossing(&mut self, crossing: f64, looked: usize) {
        let Some(factor) = PROBE_FACTORS.get(looked) else {
            self.end = Some(Some(crossing));
            return;
        };
        self.crossing = Some((crossing, looked + 1));
        self.next_step = (self.start.0 + factor * (crossing - self.start.0) - self.base_coordinate()).abs();
    }

    /// Whether a parameter other than the walker's own lies at a bound at which it was not at the best point.
    fn pins_another_parameter(&self, unit: &[f64]) -> bool {
        let bound = |u: &f64| !(AT_BOUND..=1.0 - AT_BOUND).contains(u);
        unit.iter()
            .zip(&self.start_unit)
            .enumerate()
            .any(|(at, (u, start))| at != self.axis && bound(u) && !bound(start))
    }

    fn cost_rise_root(&self, place: &ProfilePoint) -> f64 {
        (place.evaluation.cost - self.start.1).max(0.0).sqrt()
    }

    fn step_from_inside(&mut self, here: ProfilePoint, root: f64) {
        let walked = (self.at - self.base_coordinate()).abs();
        self.base = here;
        if self.crossing.take().is_some() {
            self.outside = None;
        }
        if self.at == 0.0 || self.at == 1.0 {
            self.end = Some(None);
        }
        let slope = root / (self.at - self.start.0).abs();
        let aim = (OVERSHOOT * self.most_root - root) / slope;
        self.next_step = if aim.is_finite() {
            aim.min(MAX_STEP_GROWTH * walked).max(FIRST_STEP_RANGE.0 / 2.0)
        } else {
            MAX_STEP_GROWTH * walked
        };
        if let Some((place, outside)) = self.outside {
            self.refine_bracket(root, place, outside);
        }
    }

    fn step_from_outside(&mut self, root: f64) {
        self.outside = Some((self.at, root));
        let base = self.cost_rise_root(&self.base);
        self.refine_bracket(base, self.at, root);
    }

    /// Between the base (within) and `place` (beyond the threshold): the crossing, or the next place to look
    /// at.
    fn refine_bracket(&mut self, base_root: f64, place: f64, root: f64) {
        let base = self.base_coordinate();
        let share = ((self.most_root - base_root) / (root - base_root)).clamp(0.0, 1.0);
        let width = (place - base).abs();
        if root <= NARROW_BRACKET * self.most_root || width <= FIRST_STEP_RANGE.0 / 2.0 {
            match self.pinned {
                true => self.end = Some(None),
                false => self.probe_behind_crossing(base + share * (place - base), 0),
            }
        } else {
            self.next_step = width * (OVERSHOOT * share).clamp(0.2, 0.8);
        }
    }
}

#[cfg(test)]
mod tests;
