//! The paper's scheme in fixed steps: its order with either treatment of transitions, its drift in stick, its
//! counts.

use crate::belt::{BELTS, Belt, Riding, Sliding};
use crate::scenes::committed;
use hybrid_ode::fixed_step::{FixedStepLocator, FixedStepOptions, integrate_fixed};
use hybrid_ode::{PhaseEndCause, WorkCounters};
use wiperlab::simulate::fixed_step_scheme::FixedStepScheme;
use wiperlab::simulate::mode::TipMode;
use wiperlab::simulate::outputs::{EnergyAudit, Transitions};
use wiperlab::simulate::{
    IntegrationMethod, Observer, RunResult, RunStatus, SolutionSegment, SolverOptions, Transition,
    run_scene_with,
};

/// Mean error of the period over some cycles.
fn error(belt: &Belt, cycles: u32, steps: &FixedStepOptions) -> f64 {
    let (mut t, mut x) = (0.0, belt.at_rest);
    let mut sum = 0.0;
    for cycle in 0..cycles {
        let work = &mut WorkCounters::default();
        let slip = integrate_fixed(&Sliding(belt), belt.release(t, x), t + 100.0, steps, work, |_| ());
        assert_eq!(slip.cause, PhaseEndCause::Guard(0), "slip of cycle {cycle} in steps of {}", steps.step_s);
        let stick = integrate_fixed(&Riding(belt), belt.catch(&slip), slip.t + 100.0, steps, work, |_| ());
        assert_eq!(
            stick.cause,
            PhaseEndCause::Guard(0),
            "stick of cycle {cycle} in steps of {}",
            steps.step_s
        );
        sum += (stick.t - t - belt.period).abs();
        (t, x) = (stick.t, stick.y[0]);
    }
    sum / f64::from(cycles)
}

#[test]
fn transitions_at_the_slacks_zero_are_of_order_four() {
    for belt in &BELTS {
        let errors = [0.02, 0.01, 0.005]
            .map(|step_s| error(belt, 20, &FixedStepOptions { step_s, locate: FixedStepLocator::Slack }));
        for pair in errors.windows(2) {
            let order = (pair[0] / pair[1]).log2();
            assert!((order - 4.0).abs() < 0.2, "order {order} from {errors:?}");
        }
    }
}

/// A phase overshoots by the part of a step that is left, so that errors are compared as means over steps of
/// many lengths.
#[test]
fn transitions_at_the_steps_end_are_of_order_one() {
    const LENGTHS: u32 = 32;
    for belt in &BELTS {
        let errors = [1e-2, 1e-3, 1e-4].map(|step_s: f64| {
            let lengths = (0..LENGTHS).map(|i| step_s * (1.0 + f64::from(i) / f64::from(LENGTHS)));
            lengths
                .map(|step_s| error(belt, 2, &FixedStepOptions { step_s, locate: FixedStepLocator::StepEnd }))
                .sum::<f64>()
        });
        for pair in errors.windows(2) {
            let order = (pair[0] / pair[1]).log10();
            assert!((order - 1.0).abs() < 0.2, "order {order} from {errors:?}");
        }
    }
}

/// End of the runs of the light blade, s: it starts at 0.42 s, and the tip turns at 0.55 s.
const STOP_S: f64 = 0.62;

/// Transitions, audit and the largest speed of a tip that starts to stick.
struct Seen {
    run: RunResult,
    list: Vec<Transition>,
    audit: EnergyAudit,
    fastest_caught_m_per_s: f64,
}

#[derive(Default)]
struct Caught {
    slipped: bool,
    fastest_m_per_s: f64,
}

impl Observer for Caught {
    fn observe_segment(&mut self, piece: &SolutionSegment<'_>) {
        let sticks = piece.mode == TipMode::Stick;
        if sticks && self.slipped {
            self.fastest_m_per_s =
                self.fastest_m_per_s.max(piece.sample_at(piece.start_s).tip_velocity_m_per_s.abs());
        }
        self.slipped = !sticks;
    }
}

fn light_blade(method: IntegrationMethod) -> Seen {
    let mut scene = committed("light-blade");
    scene.run.stop_s = STOP_S;
    let (mut list, mut audit, mut caught) =
        (Transitions::default(), EnergyAudit::default(), Caught::default());
    let run = run_scene_with(
        &scene,
        SolverOptions { method, ..SolverOptions::new(1e-12) },
        &mut ((&mut list, &mut audit), &mut caught),
    );
    assert_eq!(run.status, RunStatus::Completed);
    Seen { run, list: list.0, audit, fastest_caught_m_per_s: caught.fastest_m_per_s }
}

fn fixed(step_s: f64, locate: FixedStepLocator, gain_per_s: f64) -> Seen {
    light_blade(IntegrationMethod::FixedStep(FixedStepScheme { step_s, locate, gain_per_s }))
}

fn worst_s(reference: &[Transition], list: &[Transition]) -> f64 {
    assert_eq!(reference.len(), list.len());
    let same = |(a, b): (&Transition, &Transition)| {
        assert_eq!((a.from, a.to, a.cause), (b.from, b.to, b.cause), "near {} s", a.time_s);
        (a.time_s - b.time_s).abs()
    };
    reference.iter().zip(list).map(same).fold(0.0, f64::max)
}

#[test]
fn the_blades_transitions_have_the_order_of_the_scheme() {
    let reference = light_blade(IntegrationMethod::RungeKutta).list;
    assert!(reference.len() > 100);
    for gain in [0.0, 1e4] {
        let [coarse, fine] =
            [2e-5, 1e-5].map(|step| worst_s(&reference, &fixed(step, FixedStepLocator::Slack, gain).list));
        let order = (coarse / fine).log2();
        assert!((order - 4.0).abs() < 0.2, "gain {gain}: order {order} from {coarse:e} to {fine:e} s");
    }
    let [coarse, fine] =
        [1e-5, 1e-6].map(|step| worst_s(&reference, &fixed(step, FixedStepLocator::StepEnd, 0.0).list));
    assert!(((coarse / fine).log10() - 1.0).abs() < 0.2, "{coarse:e} to {fine:e} s");
}

/// `Phi'' + 2 a Phi' + a^2 Phi = 0` from `Phi = 0` at the tip's last speed `v` is `v t exp(-a t)`, at most
/// `v/(e a)`; nothing drifts where the transition leaves no speed, and without gain where it is taken out.
#[test]
fn stick_drifts_as_the_stabilisation_says() {
    const GAIN: f64 = 1e4;
    let stabilised = fixed(1e-5, FixedStepLocator::StepEnd, GAIN);
    let most = stabilised.fastest_caught_m_per_s / (std::f64::consts::E * GAIN);
    let found = stabilised.audit.max_constraint_drift_m;
    assert!(most > 1e-9 && (found / most - 1.0).abs() < 0.01, "{found:e} m instead of {most:e} m");
    // what is left then is the error of the method in the double integration of zero, and the rounding of
    // positions of 0.03 m
    assert!(fixed(1e-5, FixedStepLocator::Slack, 0.0).audit.max_constraint_drift_m < 1e-15);
    assert!(fixed(1e-5, FixedStepLocator::StepEnd, 0.0).audit.max_constraint_drift_m < 1e-15);
    let located = fixed(1e-5, FixedStepLocator::Slack, GAIN);
    assert!(located.audit.max_constraint_drift_m < 1e-12, "{:e} m", located.audit.max_constraint_drift_m);
}

#[test]
fn every_step_is_counted() {
    let seen = fixed(1e-5, FixedStepLocator::StepEnd, 0.0);
    assert_eq!((seen.run.work.steps, seen.run.work.rejected_steps), (20_000, 0), "0.2 s in steps of 10 us");
    // the first stage of a step is the last of the one before, except where a phase starts
    assert_eq!(seen.run.work.rhs_evaluations, 4 * 20_000 + seen.run.transitions + 1);
    let seen = fixed(1e-5, FixedStepLocator::Slack, 0.0);
    assert_eq!(
        seen.run.work.rejected_steps, seen.run.transitions,
        "a step that a transition falls in is taken anew"
    );
    let expected = 20_000 + seen.run.transitions / 2; // each transition leaves part of a step, half of one on the average
    assert!(
        seen.run.work.steps.abs_diff(expected) < seen.run.transitions / 4,
        "{} steps",
        seen.run.work.steps
    );
}
