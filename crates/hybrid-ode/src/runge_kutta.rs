//! Integration by the Dormand-Prince 8(5,3) method with error control, up to the first guard that falls to
//! zero. Roots of the guards are isolated with nine samples of the dense output. The state at a root follows
//! from a step of the method itself, which is of full order.

use super::dop853::{ERROR_EXPONENT, EVALUATIONS_FOR_DENSE, EVALUATIONS_PER_STEP, StepOutput, StepStages};
use super::fixed_step::{RUNGE_KUTTA_4_EVALUATIONS, runge_kutta_4_step};
use super::roots::{self, COARSE_SAMPLES, FINE_SAMPLES};
use super::slack_variable::{MOST_HALVINGS, SlackVariable, StatePoint};
use super::{AcceptedStep, HybridPhase, ObserverReply, PhaseEnd, PhaseEndCause, PhaseStart, WorkCounters};
use portable_math as math;

/// Method that locates the time at which a guard falls to zero. Which guard falls first always follows from
/// the dense output.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum EventLocator {
    /// The root is bracketed on the dense output, the step is repeated up to the root, and Newton's iteration
    /// removes the remaining value of the guard.
    #[default]
    Bracket,
    /// The step is rejected, and the state is integrated in a slack variable that falls to zero with the
    /// guard. If the guard rises before it falls, the integration starts closer to the zero, where the guard
    /// falls.
    Slack,
}

/// Integrates `phase` from `start` until `stop` or until a guard falls to zero; `observe` is called with
/// every accepted step.
///
/// `relative` is the tolerated error of a step, relative to each state or, if that is larger, to its
/// [`HybridPhase::scale`].
pub fn integrate<const N: usize, const G: usize, P: HybridPhase<N, G>, A: ObserverReply>(
    phase: &P,
    start: PhaseStart<N, G>,
    stop: f64,
    relative: f64,
    work: &mut WorkCounters,
    observe: impl FnMut(&AcceptedStep<'_, N>) -> A,
) -> PhaseEnd<N> {
    integrate_with_locator(EventLocator::Bracket, phase, start, stop, relative, work, observe)
}

/// Integrates as [`integrate`] does, but with the given method of event location.
pub fn integrate_with_locator<const N: usize, const G: usize, P: HybridPhase<N, G>, A: ObserverReply>(
    locator: EventLocator,
    phase: &P,
    start: PhaseStart<N, G>,
    stop: f64,
    relative: f64,
    work: &mut WorkCounters,
    mut observe: impl FnMut(&AcceptedStep<'_, N>) -> A,
) -> PhaseEnd<N> {
    let mut run = AdaptiveRun::from_start(phase, start, relative, work);
    run.locator = locator;
    loop {
        if run.t >= stop {
            return run.phase_end(PhaseEndCause::Stop);
        }
        if run.work.is_spent() {
            return run.phase_end(PhaseEndCause::StepTooSmall);
        }
        let Some(mut stages) = run.find_accepted_step(stop) else {
            return run.phase_end(PhaseEndCause::StepTooSmall);
        };
        run.work.rhs_evaluations += EVALUATIONS_FOR_DENSE;
        let dense = stages.dense_output(|t, y| phase.derivative(t, y));
        match run.locate_event(&stages, &dense) {
            EventLocation::Outside => {
                run.work.steps -= 1;
                run.work.rejected_steps += 1;
                run.h = OUT_OF_DOMAIN * stages.h;
            }
            EventLocation::Nowhere => {
                let end = run.accept_step(&stages, stop);
                let step = AcceptedStep { start: stages.t, end, y_end: &stages.y_end, solution: &dense };
                if observe(&step).control_flow().is_break() {
                    return run.phase_end(PhaseEndCause::Interrupted);
                }
            }
            EventLocation::At { guard, t, y } => {
                let step = AcceptedStep { start: run.t, end: t, y_end: &y, solution: &dense };
                let asked = observe(&step).control_flow().is_break();
                let cause = if asked { PhaseEndCause::Interrupted } else { PhaseEndCause::Guard(guard) };
                return PhaseEnd { t, y, ..run.phase_end(cause) };
            }
        }
    }
}

/// Three factors of the step size control: the largest and the smallest allowed ratio of a step size to the
/// previous step size (Hairer's code), and the safety factor that multiplies the predicted step size.
const GROWTH: (f64, f64, f64) = (6.0, 1.0 / 3.0, 0.9);
/// Exponent of the last step's error in the formula for the step size (the beta of Hairer's code, section
/// IV.2).
const STABILISATION: f64 = 0.04;
/// Lower limit of the error in the step size control. Without it, one step with a very small error would make
/// the next step too long.
const NEGLIGIBLE: f64 = 1e-4;
/// Smallest allowed estimate of the first step, in units of the rounding error of the time; error control
/// shortens the step where necessary.
const SHORTEST_START: f64 = 1e3;
/// Factor by which a step is multiplied if it leaves the domain of the right-hand side or of the guards.
const OUT_OF_DOMAIN: f64 = 0.1;
/// A step is lengthened by up to this factor to end at the stop time, so that no tiny step remains.
const STRETCH: f64 = 1.01;
/// Step length, in units of the rounding error of the time, up to which a guard that starts at zero is
/// ignored.
const SLIVER_STEP: f64 = 64.0;
/// Largest allowed absolute value of a guard at its located zero, as a fraction of its largest absolute
/// sample in the step. If the value is larger, the polynomial through the samples has a root where the guard
/// has none, and a shorter step is taken.
const MOST_GUARD_REMAINDER: f64 = 1e-3;
/// Step length, in units of the rounding error of the time, at or below which a shorter step reveals nothing
/// more about a guard: over this length, a guard that starts at a double zero changes by less than the
/// rounding error of the state.
const SHORTEST_TELLING_STEP: f64 = 1e8;

/// First event of a step.
enum EventLocation<const N: usize> {
    /// No guard falls to zero.
    Nowhere,
    /// The first guard to fall to zero, with time and state there.
    At { guard: usize, t: f64, y: [f64; N] },
    /// A guard is NaN: the step leaves the domain of the phase.
    Outside,
}

struct AdaptiveRun<'a, const N: usize, const G: usize, P> {
    phase: &'a P,
    locator: EventLocator,
    work: &'a mut WorkCounters,
    relative: f64,
    t: f64,
    y: [f64; N],
    derivative: [f64; N],
    guards: [f64; G],
    zero_order: [u8; G],
    h: f64,
    first_step: Option<f64>,
    last_error: f64,
}

impl<'a, const N: usize, const G: usize, P: HybridPhase<N, G>> AdaptiveRun<'a, N, G, P> {
    fn from_start(phase: &'a P, start: PhaseStart<N, G>, relative: f64, work: &'a mut WorkCounters) -> Self {
        let derivative = phase.derivative(start.t, &start.y);
        work.rhs_evaluations += 1;
        work.guard_evaluations += 1;
        let guards = phase.guards(start.t, &start.y);
        let mut run = Self {
            phase,
            locator: EventLocator::default(),
            work,
            relative,
            t: start.t,
            y: start.y,
            derivative,
            guards,
            zero_order: start.zero_order,
            h: 0.0,
            first_step: None,
            last_error: NEGLIGIBLE,
        };
        run.h = start.step.unwrap_or_else(|| run.estimate_first_step());
        run
    }

    fn phase_end(&self, cause: PhaseEndCause) -> PhaseEnd<N> {
        PhaseEnd { t: self.t, y: self.y, cause, first_step: self.first_step.unwrap_or(self.h) }
    }

    fn tolerated_error(&self, y: &[f64; N]) -> [f64; N] {
        let scale = self.phase.scale();
        std::array::from_fn(|i| self.relative * scale[i].max(self.y[i].abs()).max(y[i].abs()))
    }

    /// First step to try by Hairer's method (section II.4), from the sizes of the state and its first two
    /// derivatives.
    fn estimate_first_step(&mut self) -> f64 {
        let tolerated = self.tolerated_error(&self.y);
        let norm = |v: &[f64; N]| {
            (v.iter().zip(&tolerated).map(|(v, s)| math::powi(v / s, 2)).sum::<f64>() / N as f64).sqrt()
        };
        let (d0, d1) = (norm(&self.y), norm(&self.derivative));
        // a state that happens to be almost zero says nothing about its time scale, but the step must advance
        // the time
        let shortest = SHORTEST_START * f64::EPSILON * self.t.abs();
        let h0 = if d0 < 1e-5 || d1 < 1e-5 { 1e-6 } else { 0.01 * d0 / d1 }.max(shortest);
        let euler: [f64; N] = std::array::from_fn(|i| self.y[i] + h0 * self.derivative[i]);
        let next = self.phase.derivative(self.t + h0, &euler);
        self.work.rhs_evaluations += 1;
        let d2 = norm(&std::array::from_fn(|i| next[i] - self.derivative[i])) / h0;
        let steepest = d1.max(d2);
        let estimate = || math::powf(0.01 / steepest, ERROR_EXPONENT);
        let h1 = if steepest <= 1e-15 { (h0 * 1e-3).max(1e-6) } else { estimate() };
        (100.0 * h0).min(h1).max(shortest)
    }

    /// Tries steps until the error of one is within the tolerance; `None` if even the shortest possible step
    /// fails.
    fn find_accepted_step(&mut self, stop: f64) -> Option<StepStages<N>> {
        let (most, least, safety) = GROWTH;
        let mut rejected = false;
        loop {
            let remaining = stop - self.t;
            let h = if self.h * STRETCH >= remaining { remaining } else { self.h };
            // (a NaN step counts as too short, too)
            let resolved = self.h > 4.0 * f64::EPSILON * self.t.abs();
            if !resolved || self.t + h <= self.t {
                return None;
            }
            let f = |t: f64, y: &[f64; N]| self.phase.derivative(t, y);
            let stages = StepStages::take_step(f, self.t, &self.y, &self.derivative, h);
            self.work.rhs_evaluations += EVALUATIONS_PER_STEP;
            let error = stages.error_norm(&self.tolerated_error(&stages.y_end));
            if error <= 1.0 {
                // (a step that was cut at the stop time says little about the next step)
                let wanted = safety
                    * math::powf(error.max(NEGLIGIBLE), STABILISATION * 0.2 - ERROR_EXPONENT)
                    * math::powf(self.last_error, STABILISATION);
                let growth = wanted.clamp(least, if rejected { 1.0 } else { most });
                self.h = (h * growth).max(if h < self.h { self.h } else { 0.0 });
                self.last_error = error.max(NEGLIGIBLE);
                self.first_step.get_or_insert(self.h);
                self.work.steps += 1;
                return Some(stages);
            }
            self.work.rejected_steps += 1;
            rejected = true;
            // (if the error is not finite, the stages have left the domain of the right-hand side)
            let shorter = || (safety * math::powf(error, -ERROR_EXPONENT)).max(least);
            self.h = h * if error.is_finite() { shorter() } else { OUT_OF_DOMAIN };
        }
    }

    fn accept_step(&mut self, stages: &StepStages<N>, stop: f64) -> f64 {
        let end = stages.t + stages.h;
        self.t = if (stop - end).abs() <= 4.0 * f64::EPSILON * stop.abs() { stop } else { end };
        self.y = stages.y_end;
        self.derivative = *stages.derivative_at_end();
        if !self.is_sliver(stages) {
            self.zero_order = [0; G];
        }
        self.t
    }

    /// Whether a step is so short that a guard which starts at zero stays zero to within rounding errors.
    fn is_sliver(&self, stages: &StepStages<N>) -> bool {
        stages.h <= SLIVER_STEP * f64::EPSILON * stages.t.abs()
    }

    /// The first guard that falls to zero inside the step.
    fn locate_event(&mut self, stages: &StepStages<N>, dense: &StepOutput<N>) -> EventLocation<N> {
        let (t, h, samples) = (stages.t, stages.h, [[0.0; G]; FINE_SAMPLES]);
        let mut sampled = GuardSamples { phase: self.phase, t, h, dense, samples, count: 0 };
        sampled.samples[0] = self.guards;
        sampled.samples[FINE_SAMPLES - 1] = self.phase.guards(t + h, &stages.y_end);
        let mut suspects = sampled.find_suspects(&self.zero_order);
        if self.is_sliver(stages) {
            (0..G).filter(|&g| self.zero_order[g] > 0).for_each(|g| suspects[g] = false);
        }
        if suspects.iter().any(|&s| s) {
            sampled.sample_at([1, 3, 5]);
        }
        self.work.guard_evaluations += 1 + sampled.count;
        if sampled.samples.iter().flatten().any(|s| s.is_nan()) {
            return EventLocation::Outside; // a search for roots on NaN would not end
        }
        let first = (0..G)
            .filter(|&g| suspects[g])
            .filter_map(|g| sampled.first_root(g, self.zero_order[g]).map(|x| (g, x)))
            .min_by(|a, b| a.1.total_cmp(&b.1));
        let before = std::mem::replace(&mut self.guards, sampled.samples[FINE_SAMPLES - 1]);
        let Some((guard, fraction)) = first else { return EventLocation::Nowhere };
        let by_slack = self.locator == EventLocator::Slack;
        let landed = by_slack.then(|| self.land_by_slack(stages, dense, guard, fraction)).flatten();
        let (t, y) = landed.unwrap_or_else(|| self.refine_event(stages, guard, fraction));
        let left = self.phase.guards(t, &y)[guard].abs();
        self.work.guard_evaluations += 1;
        let largest = sampled.samples.iter().fold(0.0, |most: f64, s| most.max(s[guard].abs()));
        // (an event at the start of the step needs no check)
        if t > stages.t && left > MOST_GUARD_REMAINDER * largest {
            if stages.h <= SHORTEST_TELLING_STEP * f64::EPSILON * t.abs() {
                return EventLocation::Nowhere; // the value of the guard is rounding error
            }
            self.guards = before;
            return EventLocation::Outside;
        }
        EventLocation::At { guard, t, y }
    }

    /// Time and state at the event, by integration in the slack variable. The integration begins at the start
    /// of the step, or closer to the zero if the guard rises before it falls. `None` if the guard turns too
    /// close to its zero.
    fn land_by_slack(
        &mut self,
        stages: &StepStages<N>,
        dense: &StepOutput<N>,
        guard: usize,
        fraction: f64,
    ) -> Option<(f64, [f64; N])> {
        self.work.rejected_steps += u64::from(self.guards[guard] < 0.0);
        let f = |t: f64, y: &[f64; N]| self.phase.derivative(t, y);
        let mut slack = SlackVariable::new(self.phase, guard, stages.h, self.work);
        let (mut after, root) = (0.0, fraction * stages.h);
        for _ in 0..MOST_HALVINGS {
            let at = StatePoint { t: stages.t + after, y: dense.state_at_fraction(after / stages.h) };
            if slack.can_descend(&at, root - after) {
                let (mut from, mut flow) = (StatePoint { t: stages.t, y: stages.y }, self.derivative);
                if after > 0.0 {
                    let lead = StepStages::take_step(f, stages.t, &stages.y, &flow, after);
                    (from, flow) = (StatePoint { t: at.t, y: lead.y_end }, *lead.derivative_at_end());
                    slack.count_evaluations(EVALUATIONS_PER_STEP);
                }
                let advance = |t: f64| StepStages::take_step(f, from.t, &from.y, &flow, t - from.t).y_end;
                if let Some(landed) = slack.land_on_zero(&from, EVALUATIONS_PER_STEP, advance) {
                    return Some((landed.t, landed.y));
                }
            }
            after = 0.5 * (after + root);
        }
        None
    }

    /// Time and state at the event, to the order of the method: the step is repeated up to the root of the
    /// dense output, then Newton's iteration moves the time to the zero of the guard by short steps.
    fn refine_event(&mut self, stages: &StepStages<N>, guard: usize, fraction: f64) -> (f64, [f64; N]) {
        /// Maximum number of corrections; one is usual, because the root of the dense output is accurate to
        /// the order of that output.
        const ROUNDS: usize = 4;
        /// Largest allowed correction of the time of an event, as a fraction of the step. A larger correction
        /// is dropped, because the guard then only grazes zero.
        const GRAZING: f64 = 1e-3;
        /// Span over which the slope of the guard is measured, as a fraction of the step. The relative error
        /// of a correction is about equal to this fraction.
        const PROBE: f64 = 1e-6;
        if fraction * stages.h <= 4.0 * f64::EPSILON * stages.t.abs() {
            return (stages.t, stages.y);
        }
        let f = |t: f64, y: &[f64; N]| self.phase.derivative(t, y);
        let mut t = stages.t + fraction * stages.h;
        let retaken = StepStages::take_step(f, stages.t, &stages.y, &self.derivative, t - stages.t);
        let (mut y, mut slope_here) = (retaken.y_end, *retaken.derivative_at_end());
        self.work.rhs_evaluations += EVALUATIONS_PER_STEP;
        for _ in 0..ROUNDS {
            let probe = stages.h * PROBE;
            let ahead: [f64; N] = std::array::from_fn(|i| y[i] + probe * slope_here[i]);
            let value = self.phase.guards(t, &y)[guard];
            let slope = (self.phase.guards(t + probe, &ahead)[guard] - value) / probe;
            self.work.guard_evaluations += 2;
            let correction = -value / slope;
            let small = correction.abs() <= GRAZING * stages.h;
            if !small || t + correction == t || t + correction <= stages.t {
                break;
            }
            (t, y) = runge_kutta_4_step(f, t, &y, &slope_here, correction);
            self.work.rhs_evaluations += RUNGE_KUTTA_4_EVALUATIONS;
            if PROBE * correction.abs() <= f64::EPSILON * t.abs() {
                break;
            }
            slope_here = f(t, &y);
            self.work.rhs_evaluations += 1;
        }
        (t, y)
    }
}

/// Samples of the guards along a step, first at a few points, then at all points.
struct GuardSamples<'a, const N: usize, const G: usize, P> {
    phase: &'a P,
    t: f64,
    h: f64,
    dense: &'a StepOutput<N>,
    samples: [[f64; G]; FINE_SAMPLES],
    count: u64,
}

impl<const N: usize, const G: usize, P: HybridPhase<N, G>> GuardSamples<'_, N, G, P> {
    fn sample_at<const K: usize>(&mut self, indices: [usize; K]) {
        for index in indices {
            let fraction = index as f64 / (FINE_SAMPLES - 1) as f64;
            self.samples[index] =
                self.phase.guards(self.t + fraction * self.h, &self.dense.state_at_fraction(fraction));
            self.count += 1;
        }
    }

    /// Whether each guard may reach zero within the step. This is so for a guard that starts at zero and for
    /// a guard that the quick test does not exclude.
    fn find_suspects(&mut self, zero_order: &[u8; G]) -> [bool; G] {
        self.sample_at([2, 4, 6, 7]);
        std::array::from_fn(|g| {
            let at = |i: usize| self.samples[i][g];
            let coarse: [f64; COARSE_SAMPLES] = [at(0), at(2), at(4), at(6), at(8)];
            zero_order[g] > 0 || (at(8) < f64::INFINITY && !roots::is_root_free(&coarse, at(7)))
        })
    }

    fn first_root(&self, guard: usize, zero_order: u8) -> Option<f64> {
        let samples: [f64; FINE_SAMPLES] = std::array::from_fn(|i| self.samples[i][guard]);
        match zero_order {
            0 => roots::first_root(&samples),
            order => roots::first_root_after_zero(&samples, i32::from(order)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::taylor::tests::Oscillator;

    fn fall(level: f64, relative: f64) -> (PhaseEnd<2>, WorkCounters) {
        let mut work = WorkCounters::default();
        let start = PhaseStart { t: 0.0, y: [1.0, 0.0], zero_order: [0], step: None };
        (integrate(&Oscillator { level }, start, 10.0, relative, &mut work, |_| ()), work)
    }

    #[test]
    fn the_event_time_tracks_the_tolerance() {
        for exponent in 4..=12 {
            let relative = 10f64.powi(-exponent);
            let (end, _) = fall(0.25, relative);
            assert_eq!(end.cause, PhaseEndCause::Guard(0));
            let error = (end.t - 0.25f64.acos()).abs();
            assert!(error < 20.0 * relative, "tolerance {relative:e}: error {error:e}");
        }
    }

    /// The solution never reaches a level just below -1. It is below a level just above -1 for `2 acos(1 -
    /// 1e-6)` = 2.8e-3 s, well inside one step.
    #[test]
    fn a_dip_inside_one_step_is_found_and_a_near_miss_is_not() {
        let (end, _) = fall(-1.0 + 1e-6, 1e-8);
        assert_eq!(end.cause, PhaseEndCause::Guard(0));
        assert!((end.t - (-1.0f64 + 1e-6).acos()).abs() < 1e-5, "{}", end.t);
        let (end, _) = fall(-1.0 - 1e-6, 1e-8);
        assert_eq!((end.cause, end.t), (PhaseEndCause::Stop, 10.0));
    }

    #[test]
    fn a_guard_armed_at_a_double_zero_falls_a_period_later() {
        let mut work = WorkCounters::default();
        // the guard 1 - x starts at a double zero and touches zero again after one period, 2 pi; the guard 5
        // - t ends the phase before that
        struct Released;
        impl HybridPhase<2, 2> for Released {
            fn derivative(&self, _: f64, y: &[f64; 2]) -> [f64; 2] {
                [y[1], -y[0]]
            }
            fn guards(&self, t: f64, y: &[f64; 2]) -> [f64; 2] {
                [1.0 - y[0], 5.0 - t]
            }
            fn scale(&self) -> [f64; 2] {
                [1.0, 1.0]
            }
        }
        let start = PhaseStart { t: 0.0, y: [1.0, 0.0], zero_order: [2, 0], step: None };
        let end = integrate(&Released, start, 10.0, 1e-10, &mut work, |_| ());
        assert_eq!(end.cause, PhaseEndCause::Guard(1));
        assert!((end.t - 5.0).abs() < 1e-9);
    }

    #[test]
    fn a_state_that_blows_up_ends_with_a_reason() {
        struct Blowup;
        impl HybridPhase<1, 1> for Blowup {
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
        let start = PhaseStart { t: 0.0, y: [1.0], zero_order: [0], step: None };
        let end = integrate(&Blowup, start, 2.0, 1e-8, &mut WorkCounters::default(), |_| ());
        assert_eq!(end.cause, PhaseEndCause::StepTooSmall);
        assert!((end.t - 1.0).abs() < 1e-6, "the solution 1/(1-t) ends at 1, found {}", end.t);
    }

    /// The guard is undefined where y exceeds 1, but the right-hand side is still defined there.
    #[test]
    fn a_guard_that_leaves_its_domain_ends_with_a_reason() {
        struct Level;
        impl HybridPhase<1, 1> for Level {
            fn derivative(&self, _: f64, _: &[f64; 1]) -> [f64; 1] {
                [1.0]
            }
            fn guards(&self, _: f64, y: &[f64; 1]) -> [f64; 1] {
                [1.0 + (1.0 - y[0]).sqrt()]
            }
            fn scale(&self) -> [f64; 1] {
                [1.0]
            }
        }
        let start = PhaseStart { t: 0.0, y: [0.0], zero_order: [0], step: None };
        let end = integrate(&Level, start, 2.0, 1e-8, &mut WorkCounters::default(), |_| ());
        assert_eq!(end.cause, PhaseEndCause::StepTooSmall);
        assert!((end.t - 1.0).abs() < 1e-12, "{}", end.t);
    }

    #[test]
    fn steps_are_contiguous_and_the_last_one_ends_at_the_stop() {
        let (mut last, mut count) = (0.0, 0);
        let start = PhaseStart { t: 0.0, y: [1.0, 0.0], zero_order: [0], step: None };
        let mut work = WorkCounters::default();
        let end = integrate(&Oscillator { level: -2.0 }, start, 3.0, 1e-6, &mut work, |step| {
            assert_eq!(step.start, last);
            last = step.end;
            count += 1;
        });
        assert_eq!((end.t, last, work.steps), (3.0, 3.0, count));
    }
}
