//! Profile likelihood: the lowest cost along each parameter, minimised over the other parameters.
//!
//! From the best point one walker goes up and another goes down along each parameter. At every place a walker
//! minimises the cost over the other parameters, first by the linear model and then by damped Gauss-Newton
//! steps corrected by Broyden's rule. A walker ends when the cost has risen by more than the threshold or
//! when it reaches a bound (Venzon and Moolgavkar, Appl. Stat. 37 (1988) 87; Raue et al., Bioinformatics 25
//! (2009) 1923). All walkers step together: their evaluations run in parallel, in an order that does not
//! depend on the number of threads.
//!
//! The cost of features is rough, and values on the far side of a ridge of the cost may fit equally well. A
//! walker therefore also tries the best known point near each place. When it finds a crossing of the
//! threshold, it probes the cost beyond the crossing. If another search has evaluated a point farther out
//! within the threshold, the walker continues from there.

use super::bounds::clamp_unit;
use super::evaluation::{Evaluation, EvaluationStage};
use super::journal::StopReason;
use super::ledger::Ledger;
use super::linear_model::{self, FeatureSlopes, SingularDirections};
use super::linear_model::{broyden_update, damped_step, difference_points, step_in_box};
use super::objective::Objective;
use nalgebra::DMatrix;
use portable_math as math;

/// Dampings of the inner steps: the first has almost no effect, the second makes the steps short.
const DAMPINGS: [f64; 2] = [1.0, 3e2];
/// Maximum number of inner steps at one place. A few suffice, because the linear model starts them near the
/// minimum.
const INNER_STEPS: usize = 3;
/// Decrease of the cost in one inner step below which the inner minimisation ends: a fiftieth of the
/// threshold.
const FOLLOWED_GAIN: f64 = 0.08;
/// Maximum number of places that a walker visits. With a poor linear model a walker needs about eight places,
/// plus one for each probe beyond a crossing.
const MAX_PLACES: usize = 20;
/// The probes beyond a crossing are at these multiples of the distance from the best point to the crossing.
/// The walk ends only if the cost exceeds the threshold at the probes too, so a ridge as wide as a quarter of
/// the interval does not end it.
const PROBE_FACTORS: [f64; 2] = [1.25, 1.6];
/// A known point is tried at a place if its coordinate along the walk differs from the place by at most this
/// distance in the unit box.
const NEAR_COORDINATE: f64 = 0.01;
/// Maximum number of times that walkers continue from a point beyond their crossings.
const MAX_RESUMPTIONS: usize = 3;
/// Length of the first step, as a fraction of the distance at which the linear model crosses the threshold.
const FIRST_STEP_SHARE: f64 = 0.6;
/// Smallest and largest allowed length of the first step in the unit box.
const FIRST_STEP_RANGE: (f64, f64) = (0.003, 0.25);
/// A step aims at a place where the square root of the rise in cost is this factor times the square root of
/// the threshold, so that the crossing is between the two places.
const OVERSHOOT: f64 = 1.1;
/// A bracket of the crossing is narrow enough if the square root of the rise in cost at its outer end is at
/// most this factor times the square root of the threshold.
const NARROW_BRACKET: f64 = 1.35;
/// A point counts as at a bound if its distance from the bound, in the unit box, is below this value, which
/// is the resolution of a search.
pub(crate) const AT_BOUND: f64 = 1e-3;
/// Largest allowed ratio of the length of a step to the length of the previous step.
const MAX_STEP_GROWTH: f64 = 3.0;

/// The profile of one parameter.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ProfileLikelihood {
    /// Coordinates in the unit interval, in ascending order, each with the lowest cost over the other
    /// parameters; the best point is included.
    pub points: Vec<(f64, f64)>,
    /// Coordinate below the best point at which the cost crosses the threshold; `None` if there is no
    /// crossing, or if another parameter is at its bound at the crossing.
    pub lower: Option<f64>,
    pub upper: Option<f64>,
}

/// Profiles of all parameters, starting from `best`; `jacobian` is the Jacobian at `best`. An interval ends
/// where the cost is `rise` above the cost of `best`.
///
/// # Errors
/// [`StopReason`] when the evaluations are used up or the fit must stop.
pub(crate) fn profile_parameters(
    ledger: &mut Ledger,
    best: &Evaluation,
    jacobian: &DMatrix<f64>,
    rise: f64,
) -> Result<Vec<ProfileLikelihood>, StopReason> {
    let directions = SingularDirections::from_jacobian(jacobian);
    let start = ProfilePoint::new(ledger.objective(), best);
    let sides = (0..best.unit.len()).flat_map(|axis| [-1.0, 1.0].map(|sign| (axis, sign)));
    let walker = |(axis, sign)| ProfileWalker::new(&start, jacobian, &directions, axis, sign, rise);
    let mut walkers: Vec<ProfileWalker> = sides.map(walker).collect();
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

/// Lets each walker continue from the farthest known point whose cost is within the threshold, if this point
/// lies beyond the walker's crossing. Returns whether any walker continues.
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
        let slopes = FeatureSlopes::from_differences(objective.targets(), from, &around);
        let jacobian = linear_model::jacobian(objective, from, &slopes);
        walker.resume_from(ProfilePoint::new(objective, from), jacobian);
    }
    Ok(farther.iter().any(Option::is_some))
}

/// Moves every active walker to its next place.
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
            let known = proposed.iter().filter_map(|point| ledger.find_evaluation(point));
            walker.keep_best(known.map(|found| ProfilePoint::new(ledger.objective(), found)));
        }
    }
    walkers.iter_mut().for_each(ProfileWalker::finish_place);
    Ok(())
}

fn join_walkers(best: &Evaluation, below: &ProfileWalker, above: &ProfileWalker) -> ProfileLikelihood {
    let centre = (best.unit.get(below.axis).copied().unwrap_or(0.5), best.cost);
    let mut points: Vec<(f64, f64)> =
        below.places.iter().chain(&above.places).copied().chain([centre]).collect();
    math::sort_by_number(&mut points, |a| a.0);
    let crossing = |walker: &ProfileWalker| walker.end.flatten();
    ProfileLikelihood { points, lower: crossing(below), upper: crossing(above) }
}

/// An evaluation with its residuals.
#[derive(Debug, Clone)]
struct ProfilePoint {
    evaluation: Evaluation,
    residuals: Vec<Option<f64>>,
}

impl ProfilePoint {
    fn new(objective: &Objective, evaluation: &Evaluation) -> Self {
        let residuals = linear_model::residuals(objective, evaluation);
        Self { evaluation: evaluation.clone(), residuals }
    }
}

/// Walks along one parameter in one direction.
struct ProfileWalker {
    axis: usize,
    sign: f64,
    /// Square root of the rise in cost at which the interval ends.
    most_root: f64,
    start: (f64, f64),
    start_unit: Vec<f64>,
    /// Last place at which the cost is within the threshold; the next step starts from it.
    base: ProfilePoint,
    /// Linear model of the residuals.
    model: DMatrix<f64>,
    /// Coordinate of the current place along the walk; the field `here` is the best point found at this
    /// place.
    at: f64,
    here: Option<ProfilePoint>,
    /// Best known point near the current place; its coordinate along the walk is replaced by the coordinate
    /// of the place.
    near: Option<Vec<f64>>,
    /// Whether the inner minimisation at the current place has ended.
    followed: bool,
    next_step: f64,
    /// Coordinate of the nearest place where the cost exceeds the threshold, and the square root of the rise
    /// in cost at this place.
    outside: Option<(f64, f64)>,
    /// Coordinate of the crossing that was found, and number of probes already made beyond it.
    crossing: Option<(f64, usize)>,
    /// Whether another parameter is at its bound at the crossing. If so, the interval is limited by the
    /// bounds, not by the features.
    pinned: bool,
    places: Vec<(f64, f64)>,
    /// Number of further places that the walker may visit.
    left: usize,
    /// `None` until the walk has ended; then the coordinate of the crossing, or `Some(None)` if there is no
    /// crossing.
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
        let determined = directions.determines(axis);
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
            next_step: if determined {
                first_step(directions, axis, rise.sqrt())
            } else {
                FIRST_STEP_RANGE.1
            },
            outside: None,
            crossing: None,
            pinned: false,
            places: Vec::new(),
            left: MAX_PLACES,
            end: None,
        }
    }

    /// Moves the walker to the next place; ends the walk at the end of the range.
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

    /// Points to evaluate next; empty if the minimisation at the current place has ended.
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

    /// Best known point near the current place; its coordinate along the walk is replaced by the coordinate
    /// of the place.
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

    /// Farthest evaluated point whose cost is within the threshold, if the point lies beyond the crossing.
    fn farthest_within_threshold(&self, ledger: &Ledger) -> Option<Evaluation> {
        let crossing = self.end.flatten()?;
        let limit = self.start.1 + math::powi(self.most_root, 2);
        let along = |e: &Evaluation| e.unit.get(self.axis).map_or(0.0, |u| self.sign * (u - crossing));
        let within = ledger.run_evaluations().iter().filter(|e| e.failure.is_none() && e.cost <= limit);
        let farthest = within.max_by(|a, b| along(a).total_cmp(&along(b)))?;
        (along(farthest) > FIRST_STEP_RANGE.0 / 2.0).then(|| farthest.clone())
    }

    /// Continues the walk from a point whose cost is within the threshold.
    fn resume_from(&mut self, base: ProfilePoint, model: DMatrix<f64>) {
        self.next_step = first_step(&SingularDirections::from_jacobian(&model), self.axis, self.most_root);
        (self.base, self.model) = (base, model);
        (self.end, self.outside, self.crossing, self.pinned) = (None, None, None, false);
        self.left = MAX_PLACES;
    }

    /// Starting points at a place: the base point with the other parameters unchanged, the base point with
    /// the other parameters moved by the linear model, and the best known point nearby.
    fn first_points(&self) -> Vec<Vec<f64>> {
        let change = self.at - self.base_coordinate();
        let kept = self.move_onto_coordinate(&self.base.evaluation.unit);
        let residuals = self.base.residuals.iter().enumerate();
        let expected: Vec<Option<f64>> =
            residuals.map(|(row, r)| r.map(|r| r + self.model[(row, self.axis)] * change)).collect();
        let step = damped_step(&self.model, &expected, DAMPINGS[0], Some(self.axis));
        let followed = step.map(|d| step_in_box(&kept, &d));
        [Some(kept), followed, self.near.clone()].into_iter().flatten().collect()
    }

    /// Keeps the best point found at the current place.
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

    /// Records the current place with its cost and chooses the next place.
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

    /// Moves the walker to the next probe beyond a crossing, or ends the walk at the crossing if the cost
    /// exceeds the threshold at all probes.
    fn probe_behind_crossing(&mut self, crossing: f64, looked: usize) {
        let Some(factor) = PROBE_FACTORS.get(looked) else {
            self.end = Some(Some(crossing));
            return;
        };
        self.crossing = Some((crossing, looked + 1));
        self.next_step = (self.start.0 + factor * (crossing - self.start.0) - self.base_coordinate()).abs();
    }

    /// Whether any parameter except the one along which the walker moves is at a bound at `unit` but is not
    /// at a bound at the best point.
    fn pins_another_parameter(&self, unit: &[f64]) -> bool {
        let bound = |u: &f64| !(AT_BOUND..=1.0 - AT_BOUND).contains(u);
        let mut pairs = unit.iter().zip(&self.start_unit).enumerate();
        pairs.any(|(at, (u, start))| at != self.axis && bound(u) && !bound(start))
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

    /// Interpolates the crossing between the base, where the cost is within the threshold, and `place`, where
    /// it is above the threshold. If the bracket is too wide, chooses the next place between them instead.
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

/// Length of the first step along a coordinate: a fraction of the distance at which the linear model crosses
/// the threshold.
fn first_step(directions: &SingularDirections, axis: usize, root: f64) -> f64 {
    let (least, most) = FIRST_STEP_RANGE;
    (FIRST_STEP_SHARE * directions.coordinate_sd(axis).0 * root).clamp(least, most)
}

#[cfg(test)]
mod tests;
