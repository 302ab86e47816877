//! Three strokes of the light test blade from rest against a list of transitions that an independent program
//! computed in 128-bit arithmetic (`benches/peers/reference/reference.c`, equal to 1e-24 s between two orders
//! and steps).

use crate::scenes::committed;
use wiperlab::simulate::outputs::Transitions;
use wiperlab::simulate::{IntegrationMethod, RunResult, RunStatus, SolverOptions, run_scene_with};

const REFERENCE: &str = include_str!("../../benches/peers/reference/transitions.csv");
/// Transitions of the reference, counted there.
const TRANSITIONS: usize = 2510;

/// Time, s, mode before and after.
fn exact() -> Vec<(f64, &'static str, &'static str)> {
    let rows = REFERENCE.lines().skip(1).map(|line| {
        let mut cells = line.split(',');
        let mut next = || cells.next().expect("a cell");
        (next().parse().expect("a time"), next(), next())
    });
    rows.collect()
}

/// The run and its worst error of a transition time, s; the list must be the reference's, transition by
/// transition.
fn worst_error(method: IntegrationMethod, relative: f64) -> (RunResult, f64) {
    let (exact, mut found) = (exact(), Transitions::default());
    assert_eq!(exact.len(), TRANSITIONS);
    let run = run_scene_with(
        &committed("light-blade-strokes"),
        SolverOptions { method, ..SolverOptions::new(relative) },
        &mut found,
    );
    assert_eq!(
        (run.status, found.0.len()),
        (RunStatus::Completed, TRANSITIONS),
        "{method:?} at {relative:e}"
    );
    let errors = found.0.iter().zip(&exact).enumerate().map(|(i, (found, &(time_s, from, to)))| {
        assert_eq!(
            (found.from.name(), found.to.name()),
            (from, to),
            "transition {i}, {method:?} at {relative:e}"
        );
        (found.time_s - time_s).abs()
    });
    (run, errors.fold(0.0, f64::max))
}

/// Complete at every tolerance, the worst transition off by no more than the tolerance says.
#[test]
fn the_worst_transition_tracks_the_tolerance() {
    for exponent in 4..=12 {
        let relative = 10f64.powi(-exponent);
        let (_, error) = worst_error(IntegrationMethod::Taylor, relative);
        assert!(error <= 2.0 * relative, "off by {error:e} s at {relative:e}");
        // the tolerance is not met by luck or at the price of the next two
        assert!(error >= 1e-3 * relative, "off by {error:e} s only at {relative:e}");
    }
}

/// A second method with its own way to find events; the motion draws its errors out tenfold.
#[test]
fn an_independent_method_finds_the_same_transitions() {
    for (relative, most) in [(1e-4, 1e-2), (1e-8, 1e-6), (1e-11, 1e-9)] {
        let (_, error) = worst_error(IntegrationMethod::RungeKutta, relative);
        assert!(error <= most, "off by {error:e} s at {relative:e}");
    }
}

#[test]
fn a_transition_costs_few_right_hand_sides() {
    let (run, _) = worst_error(IntegrationMethod::Taylor, 1e-8);
    let cost = run.work.rhs_evaluations as f64 / TRANSITIONS as f64;
    assert!(cost <= 70.0, "{cost} a transition");
    assert_eq!(run.work.rejected_steps, 0);
}
