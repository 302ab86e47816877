//! Events on an oscillator whose solution is known: grazing, pairs inside one step, simultaneous ones, and
//! those at the ends of steps.

use super::{ERRORS, cases};
use hybrid_ode::taylor::{self, TaylorExpansion, TaylorPhase, TaylorWorkspace};
use hybrid_ode::{self as ode, HybridPhase, PhaseEnd, PhaseEndCause, PhaseStart, WorkCounters};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use wiperlab::simulate::IntegrationMethod;

/// `x'' = -x` with guards `offset + slope x`; from `x = 1` at rest the solution is `cos t`.
struct Swing<const G: usize>([[f64; 2]; G]);

impl<const G: usize> HybridPhase<2, G> for Swing<G> {
    fn derivative(&self, _: f64, y: &[f64; 2]) -> [f64; 2] {
        [y[1], -y[0]]
    }
    fn guards(&self, _: f64, y: &[f64; 2]) -> [f64; G] {
        self.0.map(|[offset, slope]| offset + slope * y[0])
    }
    fn scale(&self) -> [f64; 2] {
        [1.0, 1.0]
    }
}

impl<const G: usize> TaylorPhase<2, G> for Swing<G> {
    type Tape = ();
    fn expand_series(&self, _: f64, y: &[f64; 2], (): &mut (), out: &mut TaylorExpansion<2, G>) {
        let [mut x, mut v] = *y;
        for k in 0..=out.order {
            out.states[k] = [x, v];
            out.guards[k] = self.0.map(|[offset, slope]| slope * x + if k == 0 { offset } else { 0.0 });
            (x, v) = (v / (k + 1) as f64, -x / (k + 1) as f64);
        }
    }
}

const TOP: [f64; 2] = [1.0, 0.0];

/// From a state to a guard or the stop time, with the number of steps.
fn go<const G: usize>(
    method: IntegrationMethod,
    relative: f64,
    swing: &Swing<G>,
    (t, y): (f64, [f64; 2]),
    zero_order: [u8; G],
    stop: f64,
) -> (PhaseEnd<2>, u64) {
    let (start, mut work) = (PhaseStart { t, y, zero_order, step: None }, WorkCounters::default());
    let end = match method {
        IntegrationMethod::Taylor => taylor::integrate_taylor(
            swing,
            start,
            stop,
            relative,
            &mut TaylorWorkspace::default(),
            &mut work,
            |_, _| (),
        ),
        _ => ode::integrate(swing, start, stop, relative, &mut work, |_| ()),
    };
    (end, work.steps)
}

/// The guard `x + 1 - depth` dips by `depth` below zero at `t = pi`, or misses it by as much. Near the touch
/// its slope is `sqrt(2 depth)`, by which an error in place is drawn out in time; what is deeper than the
/// error of the solution must be seen, what misses by more must not.
#[test]
fn a_grazing_dip_is_seen_and_a_near_miss_is_not() {
    for (method, relative) in cases() {
        for depth in (1..=12).map(|exponent| 10f64.powi(-exponent)) {
            if depth < 10.0 * ERRORS * relative {
                continue;
            }
            let what = format!("depth {depth:e}, {method:?} at {relative:e}");
            let (dip, _) = go(method, relative, &Swing([[1.0 - depth, 1.0]]), (0.0, TOP), [0], 6.0);
            assert_eq!(dip.cause, PhaseEndCause::Guard(0), "{what}");
            let error = dip.t - (depth - 1.0).acos();
            assert!(
                error.abs() <= (ERRORS * relative + 1e-15) / (2.0 * depth).sqrt(),
                "{what}: off by {error:e}"
            );
            let (miss, _) = go(method, relative, &Swing([[1.0 + depth, 1.0]]), (0.0, TOP), [0], 6.0);
            assert_eq!((miss.cause, miss.t), (PhaseEndCause::Stop, 6.0), "{what}");
        }
    }
}

/// Down through the level and up again within a fraction of a step.
#[test]
fn two_transitions_within_one_step_are_both_found() {
    for (method, relative) in cases() {
        let depth: f64 = (100.0 * ERRORS * relative).clamp(1e-8, 1e-2);
        let (whole, steps) = go(method, relative, &Swing([[2.0, 1.0]]), (0.0, TOP), [0], TAU);
        assert_eq!(whole.cause, PhaseEndCause::Stop);
        let down_at = (depth - 1.0).acos();
        assert!(TAU - 2.0 * down_at < TAU / steps as f64, "both lie within a step");
        let what = format!("{method:?} at {relative:e}");
        let (down, _) = go(method, relative, &Swing([[1.0 - depth, 1.0]]), (0.0, TOP), [0], TAU);
        let (up, _) = go(method, relative, &Swing([[depth - 1.0, -1.0]]), (down.t, down.y), [1], TAU);
        let (rest, _) = go(method, relative, &Swing([[1.0 - depth, 1.0]]), (up.t, up.y), [1], TAU);
        assert_eq!(
            [down.cause, up.cause, rest.cause],
            [PhaseEndCause::Guard(0), PhaseEndCause::Guard(0), PhaseEndCause::Stop],
            "{what}"
        );
        let most = 2.0 * (ERRORS * relative + 1e-15) / (2.0 * depth).sqrt();
        assert!(
            (down.t - down_at).abs() <= most && (up.t - TAU + down_at).abs() <= most,
            "{what}: {} and {}",
            down.t,
            up.t
        );
    }
}

/// Two guards whose zeros lie 1e-9 apart in place come in their order; of two at one instant the first in the
/// list is told, and the other, which starts the next phase at its zero, falls at once: no time passes and
/// none is lost.
#[test]
fn simultaneous_events_come_in_order_and_none_is_lost() {
    for (method, relative) in cases() {
        let what = format!("{method:?} at {relative:e}");
        let close = Swing([[-0.5, 1.0], [-0.5 - 1e-9, 1.0]]);
        let (first, _) = go(method, relative, &close, (0.0, TOP), [0, 0], TAU);
        assert_eq!(first.cause, PhaseEndCause::Guard(1), "{what}");
        let (second, _) = go(method, relative, &Swing([close.0[0]]), (first.t, first.y), [0], TAU);
        assert_eq!(second.cause, PhaseEndCause::Guard(0), "{what}");
        let apart = second.t - first.t;
        assert!((apart - 1e-9 / 0.75f64.sqrt()).abs() <= 1e-12, "{what}: {apart:e} s apart");

        let same = Swing([[-0.5, 1.0], [-1.0, 2.0]]);
        let (one, _) = go(method, relative, &same, (0.0, TOP), [0, 0], TAU);
        assert!((one.t - PI / 3.0).abs() <= ERRORS * relative, "{what}");
        let PhaseEndCause::Guard(told) = one.cause else { panic!("{what}: {:?}", one.cause) };
        let (other, steps) = go(method, relative, &Swing([same.0[1 - told]]), (one.t, one.y), [0], TAU);
        assert_eq!(other.cause, PhaseEndCause::Guard(0), "{what}");
        assert!(
            (other.t - one.t).abs() <= 1e-14 && steps <= 1,
            "{what}: {:e} s later after {steps} steps",
            other.t - one.t
        );
    }
}

/// Zeros of `cos t` up to 20, with the run cut at the given times: 6 zeros, however the cuts lie to them.
fn zeros(method: IntegrationMethod, relative: f64, cuts: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let (mut at, mut side, mut order, mut found) = ((0.0, TOP), 1.0, [0], Vec::new());
    for cut in cuts.into_iter().chain([20.0]) {
        loop {
            let (end, _) = go(method, relative, &Swing([[0.0, side]]), at, order, cut);
            at = (end.t, end.y);
            if end.cause == PhaseEndCause::Stop {
                // a state within rounding of its guard's zero is said to start there
                order = [u8::from(found.last().is_some_and(|last| end.t - last < 1e-13))];
                break;
            }
            assert_eq!(end.cause, PhaseEndCause::Guard(0));
            assert!(
                found.len() < 10,
                "{method:?} at {relative:e} loops at {}: {found:?}, cut {cut:e}, order {order:?}, at {at:?}",
                end.t
            );
            found.push(end.t);
            (side, order) = (-side, [1]);
        }
    }
    found
}

#[test]
fn a_transition_at_the_end_of_a_step_or_at_an_output_time_counts_once() {
    for (method, relative) in cases() {
        let exact: Vec<f64> = (0..6).map(|k| FRAC_PI_2 + f64::from(k) * PI).collect();
        let own = zeros(method, relative, []);
        // (a step of one unit of rounding tells Runge-Kutta nothing about its guard)
        let rounding = if method == IntegrationMethod::Taylor { 1e-15 } else { 0.0 };
        for shift in [0.0, rounding, -rounding, 1e-12, -1e-12, relative, -relative] {
            for nominal in [&exact, &own] {
                let found = zeros(method, relative, nominal.iter().map(|t| t + shift));
                assert_eq!(
                    found.len(),
                    exact.len(),
                    "cut {shift:e} beside the zeros, {method:?} at {relative:e}: {found:?}"
                );
                for (t, e) in found.iter().zip(&exact) {
                    assert!(
                        (t - e).abs() <= ERRORS * relative + 1e-14,
                        "{t} instead of {e}, {method:?} at {relative:e}"
                    );
                }
            }
        }
    }
}

/// A phase that starts at the zero of its guard neither tells it again nor loses the next one; one that
/// starts beyond it ends at once.
#[test]
fn a_transition_at_the_start_counts_once() {
    for (method, relative) in cases() {
        let rising = Swing([[0.0, -1.0]]); // x < 0 after pi/2
        let (end, _) = go(method, relative, &rising, (FRAC_PI_2, [0.0, -1.0]), [1], 20.0);
        assert_eq!(end.cause, PhaseEndCause::Guard(0));
        assert!((end.t - 3.0 * FRAC_PI_2).abs() <= ERRORS * relative, "{}", end.t);
        let falling = Swing([[0.0, 1.0]]);
        let (at_once, _) = go(method, relative, &falling, (FRAC_PI_2, [0.0, -1.0]), [1], 20.0);
        assert_eq!((at_once.cause, at_once.t), (PhaseEndCause::Guard(0), FRAC_PI_2), "no time passes");
        // a double zero, `1 - x` from the top: it opens and closes after a whole turn without a sign change
        // between
        let (turn, _) = go(method, relative, &Swing([[1.0, -1.0]]), (0.0, TOP), [2], 6.0);
        assert_eq!((turn.cause, turn.t), (PhaseEndCause::Stop, 6.0), "{method:?} at {relative:e}");
    }
}
