//! Integration by Taylor series, whose coefficients are computed by recurrence, from low to high order.
//!
//! The step length follows from the last coefficients (Jorba and Zou 2005, *Experimental Mathematics* 14,
//! section 3.2), so no step is rejected and no step size is carried over from one phase to the next. The
//! polynomials of the guards are as accurate as those of the states. No zero of these polynomials is missed,
//! and the state at an event needs no further step.

use super::polynomial::{GuardFall, MOST_ORDER, TERMS, TaylorSeries, first_fall};
use super::{
    AcceptedStep, DenseOutput, HybridPhase, ObserverReply, PhaseEnd, PhaseEndCause, PhaseStart, WorkCounters,
};
use portable_math as math;

/// A phase whose Taylor coefficients can be computed by recurrence.
pub trait TaylorPhase<const N: usize, const G: usize>: HybridPhase<N, G> {
    /// Working data of the recurrences; all steps of a phase use the same tape.
    type Tape: Default;

    /// Writes the coefficients of states and guards about `(t, y)` up to `out.order`. Coefficient `k` is the
    /// `k`-th time derivative divided by `k!`, for the states along the solution of
    /// [`HybridPhase::derivative`] and for [`HybridPhase::guards`] along the same solution.
    fn expand_series(&self, t: f64, y: &[f64; N], tape: &mut Self::Tape, out: &mut TaylorExpansion<N, G>);
}

/// Taylor polynomials of states and guards about the start of a step.
#[derive(Debug, Clone)]
pub struct TaylorExpansion<const N: usize, const G: usize> {
    /// Start of the step, s.
    pub t: f64,
    /// Highest power of the series that is used.
    pub order: usize,
    /// Coefficients of the states, one row per power.
    pub states: [[f64; N]; TERMS],
    /// Coefficients of the guards, one row per power; the first is infinity for a guard that does not apply.
    pub guards: [[f64; G]; TERMS],
    /// Absolute values of the last two Taylor coefficients of further quantities that are functions of the
    /// states, divided by the scale of these quantities; the coefficient of higher order is second. They
    /// limit the step length, too.
    pub followers: [f64; 2],
    /// Series of the exponent `x >= 0`, if the equations contain a term in `exp(-x)` that may vary much over
    /// a step.
    pub exponent: Option<TaylorSeries>,
}

impl<const N: usize, const G: usize> Default for TaylorExpansion<N, G> {
    fn default() -> Self {
        let (states, guards) = ([[0.0; N]; TERMS], [[0.0; G]; TERMS]);
        Self { t: 0.0, order: 0, states, guards, followers: [0.0; 2], exponent: None }
    }
}

impl<const N: usize, const G: usize> TaylorExpansion<N, G> {
    /// States at a time `x` after the start of the step, by Horner's rule.
    #[inline]
    fn states_after(&self, x: f64) -> [f64; N] {
        let mut sum = [0.0; N];
        for row in self.states[..=self.order].iter().rev() {
            for i in 0..N {
                sum[i] = sum[i] * x + row[i];
            }
        }
        sum
    }

    /// Longest step over which the last two terms of the series of every state stay within the tolerance. The
    /// error is of the next order and therefore smaller.
    #[inline]
    fn step_length(&self, scale: &[f64; N], relative: f64) -> f64 {
        let largest = |k: usize, follower: f64| {
            let ratio = |i: usize| self.states[k][i].abs() / scale[i].max(self.states[0][i].abs());
            (0..N).map(ratio).fold(follower, |a: f64, b| if b > a || b.is_nan() { b } else { a })
        };
        let length = |k: usize, follower: f64| math::powf(relative / largest(k, follower), 1.0 / k as f64);
        let before = length(self.order - 1, self.followers[0]);
        let last = length(self.order, self.followers[1]);
        if last < before { last } else { before }
    }

    /// Step length, at most `h`, over which the terms of the exponential's series decrease. An exponential
    /// that is too small to show in the last coefficients, but grows by many powers of ten within the step,
    /// would otherwise be missed: the terms of `exp(x)` increase up to the order `x`.
    #[inline]
    fn limit_by_exponential(&self, h: f64) -> f64 {
        /// Largest allowed change of the exponent over the step, as a fraction of the order: at the end of
        /// the series each term is then at most this fraction of the term before it.
        const SHARE: f64 = 0.25;
        /// Value of `x` above which `exp(-x)` is below rounding errors.
        const NEGLIGIBLE: f64 = 40.0;
        /// Largest number of Newton steps; from any step length about ten are enough.
        const MOST_STEPS: usize = 40;
        let Some(exponent) = &self.exponent else { return h };
        let most = (SHARE * self.order as f64).max(exponent[0] - NEGLIGIBLE);
        let varies = |h: f64| h * exponent[1..=self.order].iter().rev().fold(0.0, |sum, c| sum * h + c.abs());
        let (mut h, mut change) = (h, varies(h));
        if change <= most {
            return h;
        }
        // the change grows at least in proportion to the step length, so this step is short enough
        let proportional = |h: f64, change: f64| h * most / change;
        if varies(proportional(h, change)) >= 0.5 * most {
            return proportional(h, change);
        }
        // the logarithm of the change is convex in that of the step length, so Newton's iteration does not
        // pass the solution
        for _ in 0..MOST_STEPS {
            if change <= 2.0 * most {
                break;
            }
            if change.is_finite() {
                let terms = exponent[1..=self.order].iter().enumerate().rev();
                let slope = h * terms.fold(0.0, |sum, (k, c)| sum * h + (k + 1) as f64 * c.abs()) / change;
                h *= math::powf(most / change, 1.0 / slope);
            } else {
                h *= 1e-3;
            }
            change = varies(h);
        }
        if change > most { proportional(h, change) } else { h }
    }

    /// Index of the guard that falls first within `h`, and the time from the start of the step to its zero;
    /// of two guards that fall at the same time, the one with the lower index.
    #[inline]
    fn find_event(&self, zero_order: &[u8; G], h: f64) -> Result<Option<(usize, f64)>, UndefinedGuard> {
        let mut rest = [0.0; G];
        let mut power = 1.0;
        for row in &self.guards[1..=self.order] {
            power *= h;
            for g in 0..G {
                rest[g] += (row[g] * power).abs();
            }
        }
        let mut first: Option<(usize, f64)> = None;
        for g in 0..G {
            // a guard whose first term exceeds the sum of all others (or is infinite) has no root
            if self.guards[0][g] > rest[g] && zero_order[g] == 0 {
                continue;
            }
            let series: TaylorSeries = std::array::from_fn(|k| self.guards[k][g]);
            match first_fall(&series, self.order, usize::from(zero_order[g]), h) {
                GuardFall::Undefined => return Err(UndefinedGuard),
                GuardFall::At(x) if first.is_none_or(|(_, before)| x < before) => first = Some((g, x)),
                _ => {}
            }
        }
        Ok(first)
    }
}

/// Memory for the expansion of steps, reused for all phases with the same equations.
#[derive(Debug, Clone, Default)]
pub struct TaylorWorkspace<T, const N: usize, const G: usize> {
    /// Data of the recurrences in the last step.
    pub tape: T,
    expansion: TaylorExpansion<N, G>,
}

/// Error: a guard is NaN somewhere in the step.
struct UndefinedGuard;

impl<const N: usize, const G: usize> DenseOutput<N> for TaylorExpansion<N, G> {
    fn state_at(&self, t: f64) -> [f64; N] {
        self.states_after(t - self.t)
    }
}

/// Order of the series for a tolerance. The order of least work is `1 - ln(relative)/2` if the terms decrease
/// geometrically (Jorba and Zou 2005, section 3.1). A few orders more are used, because the coefficients of
/// oscillations decrease faster. The optimum is flat: for an oscillation, 2 to 6 additional orders take the
/// same time.
pub(crate) fn order_for_tolerance(relative: f64) -> usize {
    const MORE: f64 = 3.0;
    /// Smallest allowed order; a lower order would derive the step length from too few coefficients.
    const LEAST_ORDER: usize = 6;
    ((1.0 + MORE - 0.5 * math::ln(relative)).ceil() as usize).clamp(LEAST_ORDER, MOST_ORDER)
}

/// Fraction of the tolerance that a single step may use. The errors of thousands of steps add up, and an
/// unstable motion amplifies them: after hundreds of events, the error of the worst event is 10 to 50 times
/// the error of a step. With this fraction, the error of the worst event is about the tolerance.
const STEP_SHARE: f64 = 0.02;

/// A step is lengthened by up to this factor to end at the stop time, so that no tiny step remains.
const STRETCH: f64 = 1.01;

/// Integrates `phase` from `start` until `stop` or until a guard falls to zero, with the tolerance `relative`
/// as in [`integrate`](super::integrate). `observe` is called with every step and the tape of its
/// recurrences. The coefficients of all states at one order count as one right-hand side.
pub fn integrate_taylor<const N: usize, const G: usize, P: TaylorPhase<N, G>, A: ObserverReply>(
    phase: &P,
    start: PhaseStart<N, G>,
    stop: f64,
    relative: f64,
    room: &mut TaylorWorkspace<P::Tape, N, G>,
    work: &mut WorkCounters,
    mut observe: impl FnMut(&AcceptedStep<'_, N>, &P::Tape) -> A,
) -> PhaseEnd<N> {
    let TaylorWorkspace { tape, expansion } = room;
    let relative = STEP_SHARE * relative;
    expansion.order = order_for_tolerance(relative);
    let scale = phase.scale();
    let PhaseStart { mut t, mut y, mut zero_order, .. } = start;
    let mut last = 0.0;
    loop {
        let end = |t: f64, y: [f64; N], cause: PhaseEndCause| PhaseEnd { t, y, cause, first_step: last };
        if t >= stop {
            return end(t, y, PhaseEndCause::Stop);
        }
        if work.is_spent() {
            return end(t, y, PhaseEndCause::StepTooSmall);
        }
        expansion.t = t;
        phase.expand_series(t, &y, tape, expansion);
        work.rhs_evaluations += expansion.order as u64;
        let (remaining, wanted) = (stop - t, expansion.step_length(&scale, relative));
        let limit = if wanted * STRETCH >= remaining { remaining } else { wanted };
        let h = expansion.limit_by_exponential(limit);
        // (a NaN step counts as too short, too)
        let resolved = wanted > 4.0 * f64::EPSILON * t.abs();
        let advances = resolved && t + h > t;
        let event = if advances { expansion.find_event(&zero_order, h) } else { Err(UndefinedGuard) };
        let Ok(event) = event else { return end(t, y, PhaseEndCause::StepTooSmall) };
        let event = event.map(|(guard, x)| (guard, correct_root(phase, expansion, guard, x, h, work)));
        work.steps += 1;
        last = h;
        let t_end = event.map_or(if h == remaining { stop } else { t + h }, |(_, x)| t + x);
        let y_end = expansion.states_after(event.map_or(h, |(_, x)| x));
        let step = AcceptedStep { start: t, end: t_end, y_end: &y_end, solution: expansion };
        let asked = observe(&step, tape).control_flow().is_break();
        let interrupted = asked.then_some(PhaseEndCause::Interrupted);
        if let Some(cause) = interrupted.or(event.map(|(guard, _)| PhaseEndCause::Guard(guard))) {
            return PhaseEnd { t: t_end, y: y_end, cause, first_step: last };
        }
        (t, y, zero_order) = (t_end, y_end, [0; G]);
    }
}

/// Corrects the root of a guard's series to the root of the guard itself, which is evaluated on the
/// polynomials of the states. The correction is needed for a guard that contains a force: the force follows
/// from second derivatives, so its series ends one order before those of the states.
fn correct_root<const N: usize, const G: usize, P: TaylorPhase<N, G>>(
    phase: &P,
    expansion: &TaylorExpansion<N, G>,
    guard: usize,
    x: f64,
    h: f64,
    work: &mut WorkCounters,
) -> f64 {
    /// Largest allowed correction of the time of an event, as a fraction of the step. A larger correction is
    /// dropped, because the guard then only grazes zero.
    const GRAZING: f64 = 1e-2;
    if x <= 0.0 {
        return x;
    }
    let terms = expansion.guards[1..=expansion.order].iter().enumerate().rev();
    let slope = terms.fold(0.0, |sum, (k, row)| sum * x + (k + 1) as f64 * row[guard]);
    let value = phase.guards(expansion.t + x, &expansion.states_after(x))[guard];
    work.guard_evaluations += 1;
    let moved = x - value / slope;
    if (moved - x).abs() <= GRAZING * h && moved > 0.0 && moved <= h { moved } else { x }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// x'' = -x with the guard `x - level`: from x = 1 at rest, x falls to `level` at the time acos(level).
    pub(crate) struct Oscillator {
        pub level: f64,
    }

    impl HybridPhase<2, 1> for Oscillator {
        fn derivative(&self, _: f64, y: &[f64; 2]) -> [f64; 2] {
            [y[1], -y[0]]
        }
        fn guards(&self, _: f64, y: &[f64; 2]) -> [f64; 1] {
            [y[0] - self.level]
        }
        fn scale(&self) -> [f64; 2] {
            [1.0, 1.0]
        }
    }

    impl TaylorPhase<2, 1> for Oscillator {
        type Tape = ();
        fn expand_series(&self, _: f64, y: &[f64; 2], (): &mut (), out: &mut TaylorExpansion<2, 1>) {
            let (mut x, mut v) = (*y).into();
            for k in 0..=out.order {
                out.states[k] = [x, v];
                out.guards[k][0] = x - if k == 0 { self.level } else { 0.0 };
                (x, v) = (v / (k + 1) as f64, -x / (k + 1) as f64);
            }
        }
    }

    fn run(level: f64, relative: f64, stop: f64) -> (PhaseEnd<2>, WorkCounters) {
        let mut work = WorkCounters::default();
        let start = PhaseStart { t: 0.0, y: [1.0, 0.0], zero_order: [0], step: None };
        (
            integrate_taylor(
                &Oscillator { level },
                start,
                stop,
                relative,
                &mut TaylorWorkspace::default(),
                &mut work,
                |_, ()| (),
            ),
            work,
        )
    }

    #[test]
    fn the_event_time_tracks_the_tolerance() {
        for exponent in 4..=13 {
            let relative = 10f64.powi(-exponent);
            let (end, _) = run(0.25, relative, 10.0);
            assert_eq!(end.cause, PhaseEndCause::Guard(0));
            let error = (end.t - 0.25f64.acos()).abs();
            assert!(error < 10.0 * relative, "tolerance {relative:e}: error {error:e}");
        }
    }

    #[test]
    fn a_dip_inside_one_step_is_found_and_a_near_miss_is_not() {
        let (end, _) = run(-1.0 + 1e-6, 1e-10, 10.0);
        assert_eq!(end.cause, PhaseEndCause::Guard(0));
        assert!((end.t - (-1.0f64 + 1e-6).acos()).abs() < 1e-7, "{}", end.t);
        let (end, _) = run(-1.0 - 1e-6, 1e-10, 10.0);
        assert_eq!((end.cause, end.t), (PhaseEndCause::Stop, 10.0));
    }

    /// The error after a fixed time falls as `h^p`, with `p` the order of the series.
    #[test]
    fn the_global_error_is_of_the_order_of_the_series() {
        for order in [8, 10] {
            let error = |steps: u32| {
                let (mut y, h) = ([0.7f64.sin(), 0.7f64.cos()], 8.0 / f64::from(steps));
                for _ in 0..steps {
                    let mut expansion = TaylorExpansion { order, ..TaylorExpansion::default() };
                    Oscillator { level: -2.0 }.expand_series(0.0, &y, &mut (), &mut expansion);
                    y = expansion.states_after(h);
                }
                (y[0] - 8.7f64.sin()).hypot(y[1] - 8.7f64.cos())
            };
            let found = (error(8) / error(16)).log2();
            assert!((found - order as f64).abs() < 0.2, "order {order}: {found}");
        }
    }

    #[test]
    fn steps_are_contiguous_and_the_last_one_ends_at_the_stop() {
        let (mut last, mut count) = (0.0, 0);
        let start = PhaseStart { t: 0.0, y: [1.0, 0.0], zero_order: [0], step: None };
        let mut work = WorkCounters::default();
        let end = integrate_taylor(
            &Oscillator { level: -2.0 },
            start,
            3.0,
            1e-6,
            &mut TaylorWorkspace::default(),
            &mut work,
            |step, ()| {
                assert_eq!(step.start, last);
                last = step.end;
                count += 1;
            },
        );
        assert_eq!((end.t, last, work.steps), (3.0, 3.0, count));
    }

    /// The solution of y' = y^2 from y = 1 is `1/(1 - t)`, which diverges at t = 1; its coefficients are all
    /// 1.
    #[test]
    fn a_state_that_blows_up_ends_with_a_reason() {
        struct TaylorBlowup;
        impl HybridPhase<1, 1> for TaylorBlowup {
            fn derivative(&self, _: f64, y: &[f64; 1]) -> [f64; 1] {
                [y[0] * y[0]]
            }
            fn guards(&self, _: f64, _: &[f64; 1]) -> [f64; 1] {
                [f64::INFINITY]
            }
            fn scale(&self) -> [f64; 1] {
                [1.0]
            }
        }
        impl TaylorPhase<1, 1> for TaylorBlowup {
            type Tape = ();
            fn expand_series(&self, _: f64, y: &[f64; 1], (): &mut (), out: &mut TaylorExpansion<1, 1>) {
                for k in 0..=out.order {
                    out.states[k][0] = y[0].powi(k as i32 + 1);
                }
                out.guards[0][0] = f64::INFINITY;
            }
        }
        let start = PhaseStart { t: 0.0, y: [1.0], zero_order: [0], step: None };
        let end = integrate_taylor(
            &TaylorBlowup,
            start,
            2.0,
            1e-8,
            &mut TaylorWorkspace::default(),
            &mut WorkCounters::default(),
            |_, ()| (),
        );
        assert_eq!(end.cause, PhaseEndCause::StepTooSmall);
        assert!((end.t - 1.0).abs() < 1e-6, "found {}", end.t);
    }
}
