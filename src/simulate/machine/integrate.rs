//! One phase by the method of a run.

use crate::ode::taylor::{self, TaylorPhase, TaylorWorkspace};
use crate::ode::{
    self, AcceptedStep, EventLocator, PhaseEnd, PhaseEndCause as Ended, PhaseStart, WorkCounters, fixed,
};
use crate::simulate::phases::GUARDS;
use crate::simulate::{IntegrationMethod, SolverOptions};
use std::ops::ControlFlow;

/// Integrates a phase by the method of the run up to where `horizon` leaves a time as it is, never across
/// what it gives for one.
pub(super) fn integrate_phase<const N: usize, P: TaylorPhase<N, GUARDS>>(
    phase: &P,
    mut start: PhaseStart<N, GUARDS>,
    horizon: impl Fn(f64) -> f64,
    effort: &SolverOptions,
    room: &mut TaylorWorkspace<P::Tape, N, GUARDS>,
    work: &mut WorkCounters,
    mut observe: impl FnMut(&AcceptedStep<'_, N>, Option<&P::Tape>) -> ControlFlow<()>,
) -> PhaseEnd<N> {
    let relative = effort.relative_tolerance;
    let mut first_step = None;
    loop {
        let until = horizon(start.t);
        let end = match effort.method {
            IntegrationMethod::Taylor => {
                let observe = |step: &AcceptedStep<'_, N>, tape: &P::Tape| observe(step, Some(tape));
                taylor::integrate_taylor(phase, start, until, relative, room, work, observe)
            }
            IntegrationMethod::RungeKutta => {
                ode::integrate(phase, start, until, relative, work, |step| observe(step, None))
            }
            IntegrationMethod::Slack => {
                let observe = |step: &AcceptedStep<'_, N>| observe(step, None);
                ode::integrate_with_locator(EventLocator::Slack, phase, start, until, relative, work, observe)
            }
            IntegrationMethod::FixedStep(scheme) => {
                let observe = |step: &AcceptedStep<'_, N>| observe(step, None);
                fixed::integrate_fixed(phase, start, until, &scheme.integrator_options(), work, observe)
            }
        };
        let first_step = *first_step.get_or_insert(end.first_step);
        if end.cause != Ended::Stop || horizon(end.t) <= end.t {
            return PhaseEnd { first_step, ..end };
        }
        start = PhaseStart { t: end.t, y: end.y, zero_order: [0; GUARDS], step: Some(end.first_step) };
    }
}
