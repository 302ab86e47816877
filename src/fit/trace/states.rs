//! The starting state of a segment, fitted with everything else held.

use super::iterate::SegmentState;
use super::shot::{Point, STATE_STEPS, State};
use nalgebra::{DMatrix, DVector, Matrix4};
use rayon::prelude::*;

/// How a segment that does not fit is tried again.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Rescue {
    /// Not at all.
    Never,
    /// From the state that the recording shows and from where the segment before ends, where chi2 exceeds
    /// this many times the number of data.
    Beyond(f64),
    /// Also along the two weakest directions, where chi2 exceeds what noise explains.
    Thorough,
}

/// Share of the segments that may have a wrong state.
const FEW: f64 = 0.4;

/// A starting state with the residuals from there and their derivatives.
struct Tried {
    state: State,
    residuals: DVector<f64>,
    jacobian: DMatrix<f64>,
}

impl Tried {
    fn at(point: &Point<'_>, frames: [usize; 2], state: State) -> Option<Self> {
        let (residuals, jacobian) = point.by_state(frames, &state)?;
        Some(Self { state, residuals, jacobian })
    }

    fn cost(&self) -> f64 {
        self.residuals.norm_squared()
    }
}

/// Levenberg-Marquardt on the four numbers of a segment's start, at most `most` steps.
pub(super) fn refine(point: &Point<'_>, segment: &mut SegmentState, most: usize) {
    /// Gain of chi2 below which a state is fitted, absolute and per datum.
    const GAIN: f64 = 1e-3;
    let frames = [segment.first, segment.last];
    let Some(mut at) = Tried::at(point, frames, segment.state()) else {
        segment.chi2 = f64::INFINITY;
        return;
    };
    let mut damping = 1e-3;
    for _ in 0..most {
        let Some(next) = step(point, frames, &at, &mut damping) else { break };
        let gain = at.cost() - next.cost();
        at = next;
        if gain < GAIN * at.cost().min(at.residuals.len() as f64) {
            break;
        }
    }
    segment.set_state(&at.state);
    (segment.chi2, segment.data) = (at.cost(), at.residuals.len());
}

/// A step that lowers the cost, its damping tried upwards.
fn step(point: &Point<'_>, frames: [usize; 2], at: &Tried, damping: &mut f64) -> Option<Tried> {
    const TRIALS: usize = 6;
    let normal = at.jacobian.transpose() * &at.jacobian;
    let slope = at.jacobian.transpose() * &at.residuals;
    for _ in 0..TRIALS {
        let mut damped = normal.clone();
        for i in 0..4 {
            damped[(i, i)] += (*damping + 1e-12) * normal[(i, i)].max(1e-30);
        }
        let moved = damped.cholesky().map(|c| c.solve(&slope));
        let tried = moved
            .and_then(|step| Tried::at(point, frames, State::from_fn(|i, _| at.state[i] - step[i])))
            .filter(|tried| tried.cost() < at.cost());
        if tried.is_some() {
            *damping = (*damping * 0.2).max(1e-7);
            return tried;
        }
        *damping *= 8.0;
    }
    None
}

/// Segments whose states have followed a step of the unknowns: those that fit worse than before are refined.
pub(super) fn follow(points: &[Point<'_>], segments: &mut [SegmentState], most: usize) {
    /// Rise of chi2 from which a state is refined, in its standard deviations.
    const RISE_SD: f64 = 0.05;
    segments.par_iter_mut().for_each(|segment| {
        let point = &points[segment.film];
        let found = point.residuals([segment.first, segment.last], &segment.state());
        let chi2 = found.map_or(f64::INFINITY, |residuals| residuals.norm_squared());
        let allowed = segment.chi2 + RISE_SD * (2.0 * segment.data as f64).sqrt();
        segment.chi2 = chi2;
        if chi2 > allowed {
            refine(point, segment, most);
        }
    });
}

/// Fits the states of all segments; those that do not fit are tried from elsewhere.
pub(super) fn settle(points: &[Point<'_>], segments: &mut [SegmentState], most: usize, rescue: Rescue) {
    if most > 0 {
        segments.par_iter_mut().for_each(|segment| refine(&points[segment.film], segment, most));
    }
    rescued(points, segments, most, rescue);
}

/// Tries segments that do not fit from elsewhere.
pub(super) fn rescued(points: &[Point<'_>], segments: &mut [SegmentState], most: usize, rescue: Rescue) {
    if rescue == Rescue::Never {
        return;
    }
    let enough = |segment: &SegmentState| {
        let data = segment.data.max(1) as f64;
        match rescue {
            Rescue::Beyond(times) => times * data,
            _ => data - 4.0 + 2.0 * (2.0 * data).sqrt(),
        }
    };
    let bad = segments.iter().filter(|segment| segment.chi2 >= enough(segment)).count();
    // (where many do not fit it is the unknowns, and not their states)
    let few = rescue == Rescue::Thorough || bad as f64 <= FEW * segments.len() as f64;
    if bad == 0 || !few {
        return;
    }
    let follows = continued(points, segments);
    segments.par_iter_mut().zip(follows).for_each(|(segment, follows)| {
        let (point, enough) = (&points[segment.film], enough(segment));
        if segment.chi2 < enough {
            return;
        }
        for state in elsewhere(point, segment, follows, rescue) {
            let mut tried = segment.clone();
            tried.set_state(&state);
            refine(point, &mut tried, most.max(6));
            if tried.chi2 < segment.chi2 {
                *segment = tried;
            }
            if segment.chi2 < enough {
                return;
            }
        }
    });
}

/// State in which the segment before each ends.
fn continued(points: &[Point<'_>], segments: &[SegmentState]) -> Vec<Option<State>> {
    let ends: Vec<Option<State>> = segments
        .par_iter()
        .map(|s| s.chi2.is_finite().then(|| points[s.film].end([s.first, s.last], &s.state()))?)
        .collect();
    let from = |k: usize| {
        let before = k.checked_sub(1)?;
        let joined = segments[before].film == segments[k].film && segments[before].last == segments[k].first;
        ends[before].filter(|_| joined)
    };
    (0..segments.len()).map(from).collect()
}

/// Tries every segment from where the one before ends: the motion is one, and a state in another valley of a
/// segment's chi2 is found by that.
pub(super) fn join(points: &[Point<'_>], segments: &mut [SegmentState], most: usize) {
    let follows = continued(points, segments);
    segments.par_iter_mut().zip(follows).for_each(|(segment, follows)| {
        let Some(state) = follows else { return };
        let mut tried = segment.clone();
        tried.set_state(&state);
        refine(&points[segment.film], &mut tried, most);
        if tried.chi2 < segment.chi2 {
            *segment = tried;
        }
    });
}

fn elsewhere(
    point: &Point<'_>,
    segment: &SegmentState,
    follows: Option<State>,
    rescue: Rescue,
) -> Vec<State> {
    /// Rates by which the first guess may be off, rad/s.
    const RATES: [[f64; 2]; 4] = [[60.0, 0.0], [-60.0, 0.0], [0.0, 120.0], [0.0, -120.0]];
    let seen = segment.seen();
    let mut states = vec![seen];
    if rescue == Rescue::Thorough {
        states.extend(along_weakest(point, segment).unwrap_or_default());
    }
    states.extend(follows);
    states.extend(RATES.map(|[neck, lip]| seen + State::new(0.0, 0.0, neck, lip)));
    states
}

/// States 3, 10 and 30 standard deviations along the two directions that the segment determines least.
fn along_weakest(point: &Point<'_>, segment: &SegmentState) -> Option<Vec<State>> {
    let (frames, state) = ([segment.first, segment.last], segment.state());
    let (_, jacobian) = point.by_state(frames, &state)?;
    let scaled = Matrix4::from_fn(|a, b| {
        jacobian.column(a).dot(&jacobian.column(b)) * STATE_STEPS[a] * STATE_STEPS[b]
    });
    let eigen = scaled.symmetric_eigen();
    let mut order = [0, 1, 2, 3];
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    let mut states = Vec::new();
    for &i in &order[..2] {
        let sd = 1.0 / eigen.eigenvalues[i].max(1e-9).sqrt();
        let direction = State::from_fn(|k, _| eigen.eigenvectors[(k, i)] * STATE_STEPS[k]);
        states.extend([3.0, -3.0, 10.0, -10.0, 30.0, -30.0].map(|times| state + direction * (times * sd)));
    }
    Some(states)
}
