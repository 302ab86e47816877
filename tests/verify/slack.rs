//! The slack variable method against the exact belts and against bracketing on the dense output: two
//! locators, one list of transitions.

use crate::belt::{BELTS, Riding, Sliding};
use crate::scenes::committed;
use hybrid_ode::{
    EventLocator, HybridPhase, PhaseEnd, PhaseEndCause, PhaseStart, WorkCounters, integrate_with_locator,
};
use wiperlab::simulate::outputs::Transitions;
use wiperlab::simulate::{IntegrationMethod, RunStatus, SolverOptions, Transition, run_scene_with};

/// How far the two locators may be apart in units of the tolerance.
const APART: f64 = 10.0;
/// Error that a located instant may have in units of the tolerance: a phase takes a few steps and each may
/// err by the tolerance.
const ERRORS: f64 = 20.0;
const PERIODS: usize = 50;

fn tolerances() -> impl Iterator<Item = f64> {
    (4..=12).map(|exponent| 10f64.powi(-exponent))
}

/// The phase by the slack variable, checked against bracketing from the same start.
fn both<const N: usize>(
    phase: &impl HybridPhase<N, 1>,
    start: PhaseStart<N, 1>,
    relative: f64,
) -> PhaseEnd<N> {
    let [slack, bracket] = [EventLocator::Slack, EventLocator::Bracket].map(|locator| {
        let end = integrate_with_locator(
            locator,
            phase,
            start,
            start.t + 100.0,
            relative,
            &mut WorkCounters::default(),
            |_| (),
        );
        assert_eq!(end.cause, PhaseEndCause::Guard(0), "{locator:?} at {relative:e}");
        end
    });
    let rounding = 1e-15 * slack.t.abs().max(1.0);
    assert!(
        (slack.t - bracket.t).abs() <= APART * relative + rounding,
        "{} against {} at {relative:e}",
        slack.t,
        bracket.t
    );
    for (s, b) in slack.y.iter().zip(bracket.y) {
        assert!((s - b).abs() <= APART * relative + rounding, "{s} against {b} at {relative:e}");
    }
    let left = phase.guards(slack.t, &slack.y)[0];
    assert!(left.abs() < 1e-13, "{left:e} is left of the guard at {relative:e}");
    slack
}

#[test]
fn both_locators_meet_the_exact_cycles_of_the_belts() {
    for belt in &BELTS {
        for relative in tolerances() {
            let (mut t, mut x) = (0.0, belt.at_rest);
            for cycle in 0..PERIODS {
                let slip = both(&Sliding(belt), belt.release(t, x), relative);
                let stick = both(&Riding(belt), belt.catch(&slip), relative);
                let error = stick.t - t - belt.period;
                // the error in place at the end of slip is drawn out by the belt's speed, as is the slip's
                // error in time
                assert!(
                    error.abs() <= ERRORS * relative / belt.speed + 1e-12,
                    "period {cycle} at {relative:e} is off by {error:e}"
                );
                (t, x) = (stick.t, stick.y[0]);
            }
        }
    }
}

fn transitions(method: IntegrationMethod, relative: f64) -> Vec<Transition> {
    let mut list = Transitions::default();
    let run = run_scene_with(
        &committed("light-blade"),
        SolverOptions { method, ..SolverOptions::new(relative) },
        &mut list,
    );
    assert_eq!(run.status, RunStatus::Completed);
    list.0
}

#[test]
fn both_locators_give_the_light_blade_the_same_transitions() {
    for relative in tolerances() {
        let [bracket, slack] = [IntegrationMethod::RungeKutta, IntegrationMethod::Slack]
            .map(|method| transitions(method, relative));
        assert_eq!(slack.len(), 450, "at {relative:e}");
        assert_eq!(bracket.len(), 450, "at {relative:e}");
        let mut worst = 0.0f64;
        for (b, s) in bracket.iter().zip(&slack) {
            assert_eq!(
                (b.from, b.to, b.cause),
                (s.from, s.to, s.cause),
                "near {} s at {relative:e}",
                b.time_s
            );
            worst = worst.max((b.time_s - s.time_s).abs());
        }
        assert!(worst <= APART * relative, "{worst:e} s at {relative:e}");
    }
}

/// `x = cos t` with the guard `x - level`: falling from a maximum, and dipping below for `2 acos(1 - depth)`
/// within a step.
struct Dip {
    level: f64,
}

impl HybridPhase<2, 1> for Dip {
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

/// Near a double root the time is worth the square root of the guard's error: `cos t + 1 ~ (pi - t)^2 / 2`.
#[test]
fn a_dip_within_a_step_is_located_ever_closer_to_a_double_root() {
    for depth in [1e-2, 1e-4, 1e-6] {
        for relative in [1e-8, 1e-10, 1e-12] {
            let start = PhaseStart { t: 0.0, y: [1.0, 0.0], zero_order: [0], step: None };
            let end = integrate_with_locator(
                EventLocator::Slack,
                &Dip { level: depth - 1.0 },
                start,
                10.0,
                relative,
                &mut WorkCounters::default(),
                |_| (),
            );
            assert_eq!(end.cause, PhaseEndCause::Guard(0));
            let error = (end.t - (depth - 1.0f64).acos()).abs();
            let slope = (2.0 * depth).sqrt();
            assert!(
                error <= ERRORS * relative / slope + 1e-14 / slope,
                "depth {depth:e} at {relative:e}: {error:e}"
            );
        }
    }
}
