//! Location of a guard's zero by a slack variable `s`. The inequality `G >= 0` is written as the equality `G
//! = s^2/2`, so that `s` falls to zero together with the guard. `s` becomes the independent variable:
//!
//! ```text
//! dt/ds = s/G'      dy/ds = F s/G'      from s = sqrt(2 G) to s = 0
//! ```
//!
//! `F` is the right-hand side and `G'` the rate of the guard along the flow (Hénon's method, Physica D 5,
//! 1982, applied to `sqrt(2 G)`). Both slopes stay finite where the guard falls to a double zero. Past the
//! zero, `G` is negative and has no real `s`; the equality `G = -s^2/2` then leads back to the zero.

use super::{HybridPhase, WorkCounters};

/// A time, s, and the state at that time.
#[derive(Debug, Clone, Copy)]
pub(super) struct StatePoint<const N: usize> {
    pub t: f64,
    pub y: [f64; N],
}

/// Number of steps of the first descent, which is the integration in `s` down to `s = 0`. A descent
/// determines only the time of the zero. The state then follows from a step of the integration method, and
/// further descents remove the remaining value of the guard.
const FIRST_STEPS: u32 = 4;
/// Maximum number of further descents (integrations in `s` to zero); two or three are usual. Close to a
/// double zero, up to a sixth of the time to the zero may remain after a descent.
const MOST_DESCENTS: usize = 40;
/// If a descent covers less than this fraction of the time from the start to the zero, the state that it
/// gives is accurate enough for any integration method.
const SHORT: f64 = 1e-3;
/// Upper limit of the error of the time after a short descent, as a fraction of the time that the descent
/// covers. The zero is reached once this error is below the rounding error of the time.
const MOST_REMAINDER: f64 = 1e-4;
/// Half width of the central difference for the rate of the guard, as a fraction of the step. The relative
/// error of the rate, about 1e-10, shifts the end of a descent; the next descent removes this shift.
const PROBE: f64 = 1e-5;
/// Smallest allowed rate at which the guard falls at the start of a descent, relative to its mean rate down
/// to the zero; near a maximum of the guard the slopes in `s` have a pole. The relative rate is 1 for a
/// linear fall and 2 for the fall to a double zero.
const LEAST_FALL: f64 = 0.5;
/// Maximum number of times that the start of a descent is moved half of the way to the zero; after that, the
/// guard counts as only grazing zero.
pub(super) const MOST_HALVINGS: usize = 30;

/// One guard of a phase, near its zero inside a step.
pub(super) struct SlackVariable<'a, const N: usize, const G: usize, P: HybridPhase<N, G>> {
    phase: &'a P,
    guard: usize,
    probe_s: f64,
    work: &'a mut WorkCounters,
}

impl<'a, const N: usize, const G: usize, P: HybridPhase<N, G>> SlackVariable<'a, N, G, P> {
    /// The guard with index `guard`; `step_s` is the length, s, of the step in which the guard falls.
    pub(super) fn new(phase: &'a P, guard: usize, step_s: f64, work: &'a mut WorkCounters) -> Self {
        Self { phase, guard, probe_s: PROBE * step_s, work }
    }

    /// Adds to the work counters the right-hand sides that a step of the integration method has evaluated.
    pub(super) fn count_evaluations(&mut self, evaluations: u64) {
        self.work.rhs_evaluations += evaluations;
    }

    /// Value of the guard at a given time and state.
    pub(super) fn guard_value(&mut self, at: &StatePoint<N>) -> f64 {
        self.work.guard_evaluations += 1;
        self.phase.guards(at.t, &at.y)[self.guard]
    }

    /// Rate of change of the guard along the solution, in the unit of the guard per second, by a central
    /// difference.
    fn guard_rate(&mut self, at: &StatePoint<N>, flow: &[f64; N]) -> f64 {
        let probe = (at.t + self.probe_s) - at.t; // the change of time after rounding
        let mut along = |share: f64| {
            let y = std::array::from_fn(|i| at.y[i] + share * flow[i]);
            self.guard_value(&StatePoint { t: at.t + share, y })
        };
        (along(probe) - along(-probe)) / (2.0 * probe)
    }

    /// Whether a descent may start at `at`, a time `ahead_s` before the zero: the guard must fall there at
    /// `LEAST_FALL` times its mean rate or faster.
    pub(super) fn can_descend(&mut self, at: &StatePoint<N>, ahead_s: f64) -> bool {
        let value = self.guard_value(at);
        let flow = self.derivative(at);
        value > 0.0 && -self.guard_rate(at, &flow) * ahead_s >= LEAST_FALL * value
    }

    /// Point where the guard is zero, found from a point `from` where the guard falls. `advance` returns the
    /// state at a given time after one step of the integration method from `from`; each such step evaluates
    /// `cost` right-hand sides. `None` if the guard turns before it reaches zero.
    pub(super) fn land_on_zero(
        &mut self,
        from: &StatePoint<N>,
        cost: u64,
        advance: impl Fn(f64) -> [f64; N],
    ) -> Option<StatePoint<N>> {
        let mut at = self.descend_to_zero(from, FIRST_STEPS)?;
        let mut moved = f64::INFINITY;
        for _ in 0..MOST_DESCENTS {
            if moved > SHORT * (at.t - from.t) {
                self.count_evaluations(cost);
                at.y = advance(at.t);
            }
            let next = self.descend_to_zero(&at, 1)?;
            moved = (next.t - at.t).abs();
            at = next;
            if MOST_REMAINDER * moved <= f64::EPSILON * at.t.abs() {
                return (at.t > from.t).then_some(at);
            }
        }
        None
    }

    /// Integrates in `s` down to zero in equal steps of the classical Runge-Kutta method.
    fn descend_to_zero(&mut self, from: &StatePoint<N>, steps: u32) -> Option<StatePoint<N>> {
        let value = self.guard_value(from);
        let (side, start) = (value.signum(), (2.0 * value.abs()).sqrt());
        let mut at = *from;
        if start == 0.0 {
            return Some(at);
        }
        for step in 0..steps {
            let s = |done: f64| side * start * (1.0 - (f64::from(step) + done) / f64::from(steps));
            let h = -start / f64::from(steps);
            let k1 = self.slope_by_slack(&at, s(0.0))?;
            let k2 = self.slope_by_slack(&shift_point(&at, 0.5 * h, &k1), s(0.5))?;
            let k3 = self.slope_by_slack(&shift_point(&at, 0.5 * h, &k2), s(0.5))?;
            let k4 = self.slope_by_slack(&shift_point(&at, h, &k3), s(1.0))?;
            let mean = |i: fn(&StatePoint<N>, usize) -> f64, j: usize| {
                (i(&k1, j) + 2.0 * (i(&k2, j) + i(&k3, j)) + i(&k4, j)) / 6.0
            };
            let y = std::array::from_fn(|i| mean(|k, i| k.y[i], i));
            let slope = StatePoint { t: mean(|k, _| k.t, 0), y };
            at = shift_point(&at, h, &slope);
        }
        Some(at)
    }

    /// The slopes `(dt/ds, dy/ds)`; `side_s` is `s` with the sign of the guard. `None` if the guard does not
    /// fall.
    fn slope_by_slack(&mut self, at: &StatePoint<N>, side_s: f64) -> Option<StatePoint<N>> {
        let flow = self.derivative(at);
        let rate = self.guard_rate(at, &flow);
        (rate < 0.0).then(|| StatePoint { t: side_s / rate, y: flow.map(|f| f * (side_s / rate)) })
    }

    fn derivative(&mut self, at: &StatePoint<N>) -> [f64; N] {
        self.work.rhs_evaluations += 1;
        self.phase.derivative(at.t, &at.y)
    }
}

fn shift_point<const N: usize>(at: &StatePoint<N>, h: f64, slope: &StatePoint<N>) -> StatePoint<N> {
    StatePoint { t: at.t + h * slope.t, y: std::array::from_fn(|i| at.y[i] + h * slope.y[i]) }
}
