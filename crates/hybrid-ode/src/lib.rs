//! Integrates a smooth phase of a hybrid system up to the first zero of its guards, by three methods: Taylor
//! series ([`taylor`]), Runge-Kutta of order 8 with dense output ([`integrate`]) and steps of fixed length
//! ([`fixed_step`]). [`collocation`] solves linear equations along a solution.
//!
//! A *phase* is a smooth right-hand side with *guards*, functions that stay positive while the phase lasts.
//! Integration ends at the stop time or where the first guard falls to zero. A guard may start at zero, for
//! example if a body has just been released. [`PhaseStart::zero_order`] then states the order of that zero,
//! so that it is not reported as an event and does not hide the next zero.
//!
//! # A ball that falls and bounces
//!
//! The guard is the height. From 1 m the ball lands after `sqrt(2/g)`. Each later flight, with the starting
//! speed `v`, starts at a simple zero of the guard and lasts `2 v/g`.
//!
//! ```
//! use hybrid_ode::{HybridPhase, PhaseEndCause, PhaseStart, WorkCounters, integrate};
//!
//! const G: f64 = 9.81;
//!
//! struct Flight;
//! impl HybridPhase<2, 1> for Flight {
//!     fn derivative(&self, _: f64, y: &[f64; 2]) -> [f64; 2] {
//!         [y[1], -G]
//!     }
//!     fn guards(&self, _: f64, y: &[f64; 2]) -> [f64; 1] {
//!         [y[0]]
//!     }
//!     fn scale(&self) -> [f64; 2] {
//!         [1.0, 1.0]
//!     }
//! }
//!
//! let mut work = WorkCounters::default();
//! let start = PhaseStart { t: 0.0, y: [1.0, 0.0], zero_order: [0], step: None };
//! let landing = integrate(&Flight, start, 10.0, 1e-10, &mut work, |_| {});
//! assert_eq!(landing.cause, PhaseEndCause::Guard(0));
//! assert!((landing.t - (2.0 / G).sqrt()).abs() < 1e-9);
//!
//! let speed = -0.8 * landing.y[1];
//! let start = PhaseStart { t: landing.t, y: [0.0, speed], zero_order: [1], step: None };
//! let second = integrate(&Flight, start, 10.0, 1e-10, &mut work, |_| {});
//! assert!((second.t - landing.t - 2.0 * speed / G).abs() < 1e-9);
//! ```

#![cfg_attr(not(test), warn(clippy::disallowed_methods))] // tests may call them

pub mod collocation;
mod dop853;
pub mod fixed_step;
pub mod polynomial;
pub mod roots;
mod runge_kutta;
mod slack_variable;
pub mod taylor;

pub use runge_kutta::{EventLocator, integrate, integrate_with_locator};

use std::ops::ControlFlow;

/// A smooth phase of a hybrid system with `N` states and `G` guards.
pub trait HybridPhase<const N: usize, const G: usize> {
    /// Right-hand side `dy/dt`.
    fn derivative(&self, t: f64, y: &[f64; N]) -> [f64; N];
    /// The guards, which are positive while the phase lasts; infinity for a guard that does not apply.
    fn guards(&self, t: f64, y: &[f64; N]) -> [f64; G];
    /// Magnitude of each state below which its error tolerance is absolute instead of relative.
    fn scale(&self) -> [f64; N];
}

/// Initial time, state and guards of a phase.
#[derive(Debug, Clone, Copy)]
pub struct PhaseStart<const N: usize, const G: usize> {
    /// Time, s.
    pub t: f64,
    /// State.
    pub y: [f64; N],
    /// Order of each guard's zero at the start: 0 if the guard is positive there, 1 for a simple zero, 2 for
    /// a double zero.
    pub zero_order: [u8; G],
    /// First step to try, s; with `None` it is estimated.
    pub step: Option<f64>,
}

/// Cause of the end of a phase.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PhaseEndCause {
    /// The guard with this index fell to zero.
    Guard(usize),
    /// The stop time was reached.
    Stop,
    /// The observer of the steps ended the phase.
    Interrupted,
    /// No step is short enough for the tolerance, the state is not finite, or the work limit is reached.
    StepTooSmall,
}

/// Final time and state of a phase.
#[derive(Debug, Clone, Copy)]
pub struct PhaseEnd<const N: usize> {
    /// Time, s.
    pub t: f64,
    /// State.
    pub y: [f64; N],
    /// Cause of the end.
    pub cause: PhaseEndCause,
    /// Suggested first step, s, for a next phase with similar equations.
    pub first_step: f64,
}

/// Work counters, cumulative over phases.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct WorkCounters {
    /// Evaluations of the right-hand side. Evaluations of the dense output for the guards do not count.
    pub rhs_evaluations: u64,
    /// Evaluations of the guards.
    pub guard_evaluations: u64,
    /// Accepted steps.
    pub steps: u64,
    /// Rejected steps.
    pub rejected_steps: u64,
    /// Maximum number of evaluations of the right-hand side; the phase ends when it is exceeded. `None` for
    /// no limit.
    pub most_rhs_evaluations: Option<u64>,
}

impl WorkCounters {
    /// Whether more right-hand sides have been evaluated than the limit allows.
    #[inline]
    pub fn is_spent(&self) -> bool {
        self.most_rhs_evaluations.is_some_and(|most| self.rhs_evaluations > most)
    }
}

/// An accepted step: the solution on `[start, end]`.
pub struct AcceptedStep<'a, const N: usize> {
    /// Start of the step, s.
    pub start: f64,
    /// End of the step, s; if an event occurs inside the step, the time of the event.
    pub end: f64,
    /// State at `end`.
    pub y_end: &'a [f64; N],
    /// The solution inside the step.
    pub solution: &'a dyn DenseOutput<N>,
}

/// Reply of a step observer: `()`, or a [`ControlFlow`] that may end the integration.
pub trait ObserverReply {
    /// `Break` ends the phase with [`PhaseEndCause::Interrupted`].
    fn control_flow(self) -> ControlFlow<()>;
}

impl ObserverReply for () {
    fn control_flow(self) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

impl ObserverReply for ControlFlow<()> {
    fn control_flow(self) -> Self {
        self
    }
}

/// The solution between the ends of a step.
pub trait DenseOutput<const N: usize> {
    /// State at time `t`, s, within the step.
    fn state_at(&self, t: f64) -> [f64; N];
}
