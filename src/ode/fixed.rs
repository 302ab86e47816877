//! The classical Runge-Kutta method of order 4 in steps of fixed length: no error control, guards evaluated
//! where a step ends. Two roots within one step are not seen. It serves comparisons.

use super::slack::{Point, Slack};
use super::{Answer, Cause, End, Phase, Solution, Start, Step, Work};

/// Where a phase ends whose guard has fallen below zero within a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Locate {
    /// At the step's end: order 1 in the step, for any order of the method.
    StepEnd,
    /// At the guard's zero, to which a slack variable leads: order 4.
    #[default]
    Slack,
}

/// Length of the steps and how events are located.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Steps {
    /// Length of a step, s.
    pub step_s: f64,
    /// Where a phase ends.
    pub locate: Locate,
}

/// Integrates `phase` from `start` until `stop` or a guard in steps of fixed length (the last one is cut),
/// telling `observe` of every step. The order of a zero at the start is not needed: only a guard that has
/// fallen over a step ends the phase.
pub fn integrate<const N: usize, const G: usize, P: Phase<N, G>, A: Answer>(
    phase: &P,
    start: Start<N, G>,
    stop: f64,
    steps: &Steps,
    work: &mut Work,
    mut observe: impl FnMut(&Step<'_, N>) -> A,
) -> End<N> {
    let mut run = Stepping {
        phase,
        steps,
        t: start.t,
        y: start.y,
        flow: phase.derivative(start.t, &start.y),
        guards: phase.guards(start.t, &start.y),
        work,
    };
    run.work.rhs_evaluations += 1;
    run.work.guard_evaluations += 1;
    let mut count = 0.0;
    while run.t < stop {
        count += 1.0;
        let due = start.t + count * steps.step_s; // (a sum of steps would gather rounding)
        let due = if stop - due > SLIVER * steps.step_s { due } else { stop };
        let Some(ahead) = run.step(due) else { return run.end(Cause::StepTooSmall) };
        let event = run.event(&ahead);
        let cause = event.map(|(guard, _)| Cause::Guard(guard));
        let end = match event {
            Some((_, at)) if at.t < ahead.at.t => run.reached(at),
            _ => ahead,
        };
        let arc = Hermite { start: run.here(), start_flow: run.flow, end: end.at, end_flow: end.flow };
        let step = Step { start: run.t, end: end.at.t, y_end: &end.at.y, solution: &arc };
        let answer = observe(&step).flow();
        run.accept(end);
        if answer.is_break() {
            return run.end(Cause::Asked);
        }
        if let Some(cause) = cause {
            return run.end(cause);
        }
    }
    run.end(Cause::Stop)
}

/// A last step shorter than this share of a step is taken together with the one before.
const SLIVER: f64 = 1e-6;
/// Halvings of a step in search of a place from which a guard falls steadily; 2^-50 of a step is below the
/// rounding of time.
const MOST_HALVINGS: usize = 50;

/// Right-hand sides of [`short_step`] beyond the first.
pub(super) const SHORT_STEP_EVALUATIONS: u64 = 3;

/// One classical Runge-Kutta step, from `k1`, the derivative at its start.
pub(super) fn short_step<const N: usize>(
    f: impl Fn(f64, &[f64; N]) -> [f64; N],
    t: f64,
    y: &[f64; N],
    k1: &[f64; N],
    h: f64,
) -> (f64, [f64; N]) {
    let along = |k: &[f64; N], share: f64| -> [f64; N] { std::array::from_fn(|i| y[i] + share * h * k[i]) };
    let k2 = f(t + 0.5 * h, &along(k1, 0.5));
    let k3 = f(t + 0.5 * h, &along(&k2, 0.5));
    let k4 = f(t + h, &along(&k3, 1.0));
    (t + h, std::array::from_fn(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i])))
}

/// Where a step leads.
struct Ahead<const N: usize, const G: usize> {
    at: Point<N>,
    flow: [f64; N],
    guards: [f64; G],
}

struct Stepping<'a, const N: usize, const G: usize, P: Phase<N, G>> {
    phase: &'a P,
    steps: &'a Steps,
    t: f64,
    y: [f64; N],
    flow: [f64; N],
    guards: [f64; G],
    work: &'a mut Work,
}

impl<const N: usize, const G: usize, P: Phase<N, G>> Stepping<'_, N, G, P> {
    fn here(&self) -> Point<N> {
        Point { t: self.t, y: self.y }
    }

    fn end(&self, cause: Cause) -> End<N> {
        End { t: self.t, y: self.y, cause, first_step: self.steps.step_s }
    }

    /// The state a step later; `None` when the time does not move or a number is lost.
    fn step(&mut self, to: f64) -> Option<Ahead<N, G>> {
        if to.partial_cmp(&self.t) != Some(std::cmp::Ordering::Greater) {
            return None;
        }
        let y = self.state(&self.here(), to);
        let ahead = self.reached(Point { t: to, y });
        let finite =
            ahead.flow.iter().chain(&y).all(|x| x.is_finite()) && !ahead.guards.iter().any(|g| g.is_nan());
        finite.then_some(ahead)
    }

    /// The solution at `to`, one step from a point.
    fn state(&mut self, from: &Point<N>, to: f64) -> [f64; N] {
        let f = |t: f64, y: &[f64; N]| self.phase.derivative(t, y);
        let own = from.t == self.t;
        self.work.rhs_evaluations += SHORT_STEP_EVALUATIONS + u64::from(!own);
        let flow = if own { self.flow } else { f(from.t, &from.y) };
        short_step(f, from.t, &from.y, &flow, to - from.t).1
    }

    fn reached(&mut self, at: Point<N>) -> Ahead<N, G> {
        self.work.rhs_evaluations += 1;
        self.work.guard_evaluations += 1;
        Ahead { flow: self.phase.derivative(at.t, &at.y), guards: self.phase.guards(at.t, &at.y), at }
    }

    fn accept(&mut self, ahead: Ahead<N, G>) {
        self.work.steps += 1;
        (self.t, self.y, self.flow, self.guards) = (ahead.at.t, ahead.at.y, ahead.flow, ahead.guards);
    }

    /// The guard that ends the phase within a step, with the point where it does.
    fn event(&mut self, ahead: &Ahead<N, G>) -> Option<(usize, Point<N>)> {
        // (a guard that starts below zero, by what its location left, and rises has not fallen)
        let (before, after) = (self.guards, ahead.guards);
        let fallen = |g: &usize| after[*g] <= 0.0 && (before[*g] > 0.0 || after[*g] <= before[*g]);
        let share = |g: usize| before[g].max(0.0) / (before[g].max(0.0) - after[g]).max(f64::MIN_POSITIVE);
        let first = (0..G).filter(fallen).min_by(|a, b| share(*a).total_cmp(&share(*b)))?;
        if self.steps.locate == Locate::StepEnd {
            return Some((first, ahead.at));
        }
        self.work.rejected_steps += 1;
        (0..G)
            .filter(fallen)
            .map(|guard| (guard, self.zero(guard, ahead)))
            .min_by(|a, b| a.1.t.total_cmp(&b.1.t))
    }

    /// Where a guard that is positive at the start of the step and not at its end falls to zero.
    fn zero(&mut self, guard: usize, ahead: &Ahead<N, G>) -> Point<N> {
        let (mut low, mut high) = (self.here(), ahead.at);
        for _ in 0..MOST_HALVINGS {
            if self.slack(guard, |slack| slack.falls(&low, high.t - low.t))
                && let Some(found) = self.land(guard, &low).filter(|found| found.t <= high.t)
            {
                return found;
            }
            let t = 0.5 * (low.t + high.t);
            if t <= low.t || t >= high.t {
                break;
            }
            let middle = Point { t, y: self.state(&self.here(), t) };
            if self.slack(guard, |slack| slack.value(&middle)) > 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        high
    }

    fn land(&mut self, guard: usize, from: &Point<N>) -> Option<Point<N>> {
        let (phase, own) = (self.phase, (from.t == self.t).then_some(self.flow));
        let f = |t: f64, y: &[f64; N]| phase.derivative(t, y);
        self.work.rhs_evaluations += u64::from(own.is_none());
        let flow = own.unwrap_or_else(|| f(from.t, &from.y));
        self.slack(guard, |slack| {
            slack.land(from, SHORT_STEP_EVALUATIONS, |t| short_step(f, from.t, &from.y, &flow, t - from.t).1)
        })
    }

    fn slack<T>(&mut self, guard: usize, ask: impl FnOnce(&mut Slack<'_, N, G, P>) -> T) -> T {
        ask(&mut Slack::new(self.phase, guard, self.steps.step_s, self.work))
    }
}

/// The cubic that meets states and slopes at both ends of a step: of order 3.
struct Hermite<const N: usize> {
    start: Point<N>,
    start_flow: [f64; N],
    end: Point<N>,
    end_flow: [f64; N],
}

impl<const N: usize> Solution<N> for Hermite<N> {
    fn at(&self, t: f64) -> [f64; N] {
        let h = self.end.t - self.start.t;
        let x = (t - self.start.t) / h;
        let rest = 1.0 - x;
        std::array::from_fn(|i| {
            let (from, to) = (self.start.y[i], self.end.y[i]);
            let bend = (1.0 - 2.0 * x) * (to - from) - h * (rest * self.start_flow[i] - x * self.end_flow[i]);
            rest * from + x * to - x * rest * bend
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `y = t^3 - 2 t` is its own interpolant.
    #[test]
    fn the_interpolant_is_exact_for_a_cubic() {
        let (y, slope) = (|t: f64| t * t * t - 2.0 * t, |t: f64| 3.0 * t * t - 2.0);
        let arc = Hermite {
            start: Point { t: 0.5, y: [y(0.5)] },
            start_flow: [slope(0.5)],
            end: Point { t: 2.0, y: [y(2.0)] },
            end_flow: [slope(2.0)],
        };
        for t in [0.5, 0.8, 1.3, 2.0] {
            assert!((arc.at(t)[0] - y(t)).abs() < 1e-14, "{t}");
        }
    }
}
