//! The classical Runge-Kutta method of order 4 in steps of fixed length, for comparisons. It has no error
//! control. It evaluates the guards only at the end of each step, so it misses a pair of roots within one
//! step.

use super::slack_variable::{SlackVariable, StatePoint};
use super::{
    AcceptedStep, DenseOutput, HybridPhase, ObserverReply, PhaseEnd, PhaseEndCause, PhaseStart, WorkCounters,
};

/// How the end of a phase is located once a guard is found below zero at the end of a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum FixedStepLocator {
    /// The end of the step: the error of the time is of order 1 in the step length, whatever the order of the
    /// method.
    StepEnd,
    /// The zero of the guard, reached by integration in a slack variable: the error of the time is of order
    /// 4.
    #[default]
    Slack,
}

/// Step length and method of event location.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FixedStepOptions {
    /// Length of a step, s.
    pub step_s: f64,
    /// Method of event location.
    pub locate: FixedStepLocator,
}

/// Integrates `phase` from `start` in steps of fixed length until `stop` or until a guard falls to zero; the
/// last step is shortened. `observe` is called with every step. `zero_order` of `start` is ignored: a guard
/// ends the phase only if it falls during a step.
pub fn integrate_fixed<const N: usize, const G: usize, P: HybridPhase<N, G>, A: ObserverReply>(
    phase: &P,
    start: PhaseStart<N, G>,
    stop: f64,
    steps: &FixedStepOptions,
    work: &mut WorkCounters,
    mut observe: impl FnMut(&AcceptedStep<'_, N>) -> A,
) -> PhaseEnd<N> {
    let mut run = FixedRun {
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
        let due = start.t + count * steps.step_s; // (a sum of steps would accumulate rounding errors)
        let due = if stop - due > SHORTEST_LAST_STEP * steps.step_s { due } else { stop };
        let Some(ahead) = run.take_step(due) else { return run.phase_end(PhaseEndCause::StepTooSmall) };
        let event = run.find_event(&ahead);
        let cause = event.map(|(guard, _)| PhaseEndCause::Guard(guard));
        let end = match event {
            Some((_, at)) if at.t < ahead.at.t => run.evaluate_at(at),
            _ => ahead,
        };
        let at = run.current_point();
        let arc = HermiteOutput { start: at, start_flow: run.flow, end: end.at, end_flow: end.flow };
        let step = AcceptedStep { start: run.t, end: end.at.t, y_end: &end.at.y, solution: &arc };
        let answer = observe(&step).control_flow();
        run.work.steps += 1;
        (run.t, run.y, run.flow, run.guards) = (end.at.t, end.at.y, end.flow, end.guards);
        let interrupted = answer.is_break().then_some(PhaseEndCause::Interrupted);
        if let Some(cause) = interrupted.or(cause) {
            return run.phase_end(cause);
        }
    }
    run.phase_end(PhaseEndCause::Stop)
}

/// If the last step would be shorter than this fraction of a full step, the step before it is lengthened
/// instead.
const SHORTEST_LAST_STEP: f64 = 1e-6;
/// Maximum number of times that a step is halved to find a point from which a guard falls steadily to zero. A
/// step times 2^-50 is below the rounding error of the time.
const MOST_HALVINGS: usize = 50;

/// Number of times that [`runge_kutta_4_step`] evaluates the right-hand side; the derivative at the start is
/// given.
pub(super) const RUNGE_KUTTA_4_EVALUATIONS: u64 = 3;

/// One classical Runge-Kutta step; `k1` is the derivative at its start.
pub(super) fn runge_kutta_4_step<const N: usize>(
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

/// Time, state, derivative and guards at the end of a step.
struct TrialStep<const N: usize, const G: usize> {
    at: StatePoint<N>,
    flow: [f64; N],
    guards: [f64; G],
}

struct FixedRun<'a, const N: usize, const G: usize, P: HybridPhase<N, G>> {
    phase: &'a P,
    steps: &'a FixedStepOptions,
    t: f64,
    y: [f64; N],
    flow: [f64; N],
    guards: [f64; G],
    work: &'a mut WorkCounters,
}

impl<const N: usize, const G: usize, P: HybridPhase<N, G>> FixedRun<'_, N, G, P> {
    fn current_point(&self) -> StatePoint<N> {
        StatePoint { t: self.t, y: self.y }
    }

    fn phase_end(&self, cause: PhaseEndCause) -> PhaseEnd<N> {
        PhaseEnd { t: self.t, y: self.y, cause, first_step: self.steps.step_s }
    }

    /// Takes a step to the time `to` and returns the values at its end; `None` if the time would not advance
    /// or a value is not finite.
    fn take_step(&mut self, to: f64) -> Option<TrialStep<N, G>> {
        if to.partial_cmp(&self.t) != Some(std::cmp::Ordering::Greater) {
            return None;
        }
        let y = self.state_at(&self.current_point(), to);
        let ahead = self.evaluate_at(StatePoint { t: to, y });
        let finite =
            ahead.flow.iter().chain(&y).all(|x| x.is_finite()) && !ahead.guards.iter().any(|g| g.is_nan());
        finite.then_some(ahead)
    }

    /// The state at `to` after one step from the point `from`.
    fn state_at(&mut self, from: &StatePoint<N>, to: f64) -> [f64; N] {
        let f = |t: f64, y: &[f64; N]| self.phase.derivative(t, y);
        let own = from.t == self.t;
        self.work.rhs_evaluations += RUNGE_KUTTA_4_EVALUATIONS + u64::from(!own);
        let flow = if own { self.flow } else { f(from.t, &from.y) };
        runge_kutta_4_step(f, from.t, &from.y, &flow, to - from.t).1
    }

    fn evaluate_at(&mut self, at: StatePoint<N>) -> TrialStep<N, G> {
        self.work.rhs_evaluations += 1;
        self.work.guard_evaluations += 1;
        TrialStep { flow: self.phase.derivative(at.t, &at.y), guards: self.phase.guards(at.t, &at.y), at }
    }

    /// Index of the guard that ends the phase within the step, and the point where it falls to zero.
    fn find_event(&mut self, ahead: &TrialStep<N, G>) -> Option<(usize, StatePoint<N>)> {
        // (a guard may start slightly below zero, because its zero was located with an error; if it then
        // rises, it has not fallen)
        let (before, after) = (self.guards, ahead.guards);
        let fallen = |g: &usize| after[*g] <= 0.0 && (before[*g] > 0.0 || after[*g] <= before[*g]);
        let share = |g: usize| before[g].max(0.0) / (before[g].max(0.0) - after[g]).max(f64::MIN_POSITIVE);
        let first = (0..G).filter(fallen).min_by(|a, b| share(*a).total_cmp(&share(*b)))?;
        if self.steps.locate == FixedStepLocator::StepEnd {
            return Some((first, ahead.at));
        }
        self.work.rejected_steps += 1;
        let zeros = (0..G).filter(fallen).map(|guard| (guard, self.locate_zero(guard, ahead)));
        zeros.min_by(|a, b| a.1.t.total_cmp(&b.1.t))
    }

    /// Point where a guard falls to zero; the guard is positive at the start of the step and zero or negative
    /// at its end.
    fn locate_zero(&mut self, guard: usize, ahead: &TrialStep<N, G>) -> StatePoint<N> {
        let (mut low, mut high) = (self.current_point(), ahead.at);
        for _ in 0..MOST_HALVINGS {
            if self.with_slack(guard, |slack| slack.can_descend(&low, high.t - low.t))
                && let Some(found) = self.land_by_slack(guard, &low).filter(|found| found.t <= high.t)
            {
                return found;
            }
            let t = 0.5 * (low.t + high.t);
            if t <= low.t || t >= high.t {
                break;
            }
            let middle = StatePoint { t, y: self.state_at(&self.current_point(), t) };
            if self.with_slack(guard, |slack| slack.guard_value(&middle)) > 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        high
    }

    fn land_by_slack(&mut self, guard: usize, from: &StatePoint<N>) -> Option<StatePoint<N>> {
        let (phase, own) = (self.phase, (from.t == self.t).then_some(self.flow));
        let f = |t: f64, y: &[f64; N]| phase.derivative(t, y);
        self.work.rhs_evaluations += u64::from(own.is_none());
        let flow = own.unwrap_or_else(|| f(from.t, &from.y));
        let step = |t| runge_kutta_4_step(f, from.t, &from.y, &flow, t - from.t).1;
        self.with_slack(guard, |slack| slack.land_on_zero(from, RUNGE_KUTTA_4_EVALUATIONS, step))
    }

    fn with_slack<T>(&mut self, guard: usize, ask: impl FnOnce(&mut SlackVariable<'_, N, G, P>) -> T) -> T {
        ask(&mut SlackVariable::new(self.phase, guard, self.steps.step_s, self.work))
    }
}

/// Cubic polynomial through the states and derivatives at both ends of a step; its order is 3.
struct HermiteOutput<const N: usize> {
    start: StatePoint<N>,
    start_flow: [f64; N],
    end: StatePoint<N>,
    end_flow: [f64; N],
}

impl<const N: usize> DenseOutput<N> for HermiteOutput<N> {
    fn state_at(&self, t: f64) -> [f64; N] {
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

    /// The interpolant of the cubic `y = t^3 - 2 t` is the cubic itself.
    #[test]
    fn the_interpolant_is_exact_for_a_cubic() {
        let (y, slope) = (|t: f64| t * t * t - 2.0 * t, |t: f64| 3.0 * t * t - 2.0);
        let arc = HermiteOutput {
            start: StatePoint { t: 0.5, y: [y(0.5)] },
            start_flow: [slope(0.5)],
            end: StatePoint { t: 2.0, y: [y(2.0)] },
            end_flow: [slope(2.0)],
        };
        for t in [0.5, 0.8, 1.3, 2.0] {
            assert!((arc.state_at(t)[0] - y(t)).abs() < 1e-14, "{t}");
        }
    }
}
