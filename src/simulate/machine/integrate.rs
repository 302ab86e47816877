//! One phase by the method of a run.

use crate::ode::taylor::{self, Expand, Room};
use crate::ode::{self, Cause as Ended, End, Locator, Start, Step, Work, fixed};
use crate::simulate::phases::GUARDS;
use crate::simulate::{Effort, Method};
use std::ops::ControlFlow;

/// Integrates a phase by the method of the run up to where `horizon` leaves a time as it is, never across
/// what it gives for one.
pub(super) fn integrate<const N: usize, P: Expand<N, GUARDS>>(
    phase: &P,
    mut start: Start<N, GUARDS>,
    horizon: impl Fn(f64) -> f64,
    effort: &Effort,
    room: &mut Room<P::Tape, N, GUARDS>,
    work: &mut Work,
    mut observe: impl FnMut(&Step<'_, N>, Option<&P::Tape>) -> ControlFlow<()>,
) -> End<N> {
    let relative = effort.relative_tolerance;
    let mut first_step = None;
    loop {
        let until = horizon(start.t);
        let end = match effort.method {
            Method::Taylor => {
                let observe = |step: &Step<'_, N>, tape: &P::Tape| observe(step, Some(tape));
                taylor::integrate(phase, start, until, relative, room, work, observe)
            }
            Method::RungeKutta => {
                ode::integrate(phase, start, until, relative, work, |step| observe(step, None))
            }
            Method::Slack => {
                let observe = |step: &Step<'_, N>| observe(step, None);
                ode::integrate_by(Locator::Slack, phase, start, until, relative, work, observe)
            }
            Method::FixedStep(scheme) => {
                let observe = |step: &Step<'_, N>| observe(step, None);
                fixed::integrate(phase, start, until, &scheme.steps(), work, observe)
            }
        };
        let first_step = *first_step.get_or_insert(end.first_step);
        if end.cause != Ended::Stop || horizon(end.t) <= end.t {
            return End { first_step, ..end };
        }
        start = Start { t: end.t, y: end.y, zero_order: [0; GUARDS], step: Some(end.first_step) };
    }
}
