//! Runs the stick-slip model event by event: integrates a step, locates an event, decides the next mode of
//! contact, and accepts it.
//!
//! Each mode of contact is a smooth phase ([`phases`]), which is integrated until one of its guards falls to
//! zero. The next mode is a pure function of the forces ([`mode`]). Observers receive every accepted piece of
//! the solution; nothing else is stored or computed.

pub mod accuracy;
pub mod bench_checks;
pub mod drive;
pub mod equilibrium;
mod event_loop;
pub mod fixed_step_scheme;
pub mod flight;
pub mod impact;
pub mod mode;
pub(crate) mod motion;
pub mod outputs;
pub mod phases;
pub mod predicted_error;
pub mod scene;
pub mod sensitivity;
mod solution_segment;
pub mod twin;

use crate::model::Pose;
use crate::model::flight::FlightState;
use crate::model::modes::time_scales_rad_per_s;
use event_loop::{EventLoop, ObserverWatcher};
use fixed_step_scheme::FixedStepScheme;
use hybrid_ode::WorkCounters;
use impact::TipVelocity;
use mode::TipMode;
pub use motion::RunMotion;
use phases::DrivenBlade;
use scene::{MOST_EVALUATIONS, Scene, StartKind};
use serde::Serialize;
pub use solution_segment::{BladePoints, ModelSample, SegmentPath, SolutionSegment};
use std::ops::ControlFlow;

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum RunStatus {
    /// The stop time was reached.
    #[default]
    Completed,
    /// The normal force reached zero.
    ContactLost,
    /// The Painlevé condition failed: no admissible normal force exists.
    Jammed,
    /// More than one mode was consistent with the forces.
    Indeterminate,
    /// Transitions accumulated at one instant.
    Chattering,
    /// The state left the range of the model, or no step met the tolerance.
    Diverged,
    /// The limit on evaluations of the right-hand side was reached.
    WorkLimit,
    /// An observer ended the run.
    Interrupted,
}

impl RunStatus {
    /// Name of the status in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Completed => "completed",
            Self::ContactLost => "contact-lost",
            Self::Jammed => "jammed",
            Self::Indeterminate => "indeterminate",
            Self::Chattering => "chattering",
            Self::Diverged => "diverged",
            Self::WorkLimit => "work-limit",
            Self::Interrupted => "interrupted",
        }
    }

    /// Meaning of the status as part of a sentence.
    pub(crate) fn meaning(self) -> &'static str {
        match self {
            Self::Completed => "the stop time was reached",
            Self::ContactLost => "the normal force reached zero: the tip lifts off the glass",
            Self::Jammed => "the Painlevé condition failed: no normal force is admissible and the tip jams",
            Self::Indeterminate => "more than one mode of contact is consistent with the forces",
            Self::Chattering => "transitions accumulate in no time",
            Self::Diverged => {
                "a link swung past level, a number left the finite range, or no step met the tolerance"
            }
            Self::WorkLimit => "the right-hand sides allowed for one run were used up",
            Self::Interrupted => "it was asked to stop",
        }
    }
}

/// A change of the mode of contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transition {
    /// Time of the change, s.
    pub time_s: f64,
    /// Mode before the change.
    pub from: TipMode,
    /// Mode after the change.
    pub to: TipMode,
    /// Event that causes the change.
    pub cause: TransitionCause,
}

/// An impact of the tip on the glass: velocities jump at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Impact {
    /// Time of the impact, s.
    pub time_s: f64,
    /// Velocity of the tip before the impact.
    pub before: TipVelocity,
    /// Velocity of the tip after the impact.
    pub after: TipVelocity,
    /// Normal and tangential impulse on the tip, N s.
    pub impulse_n_s: [f64; 2],
    /// Energy lost in the contact, J; not negative except for rounding errors.
    pub lost_j: f64,
    /// Energy supplied by the impulse with which the drive keeps the head at its prescribed velocity, J.
    pub driven_j: f64,
}

/// Receives the solution as it is accepted.
pub trait Observer {
    /// Receives a piece of the solution, in order of time.
    fn observe_segment(&mut self, piece: &SolutionSegment<'_>);
    /// Receives a change of the mode of contact, between the two pieces that it separates.
    fn observe_transition(&mut self, _transition: &Transition) {}
    /// Receives an impact, before the transition that it causes.
    fn observe_impact(&mut self, _impact: &Impact) {}
    /// Called after every piece; `Break` ends the run as [`RunStatus::Interrupted`].
    fn control_flow(&self) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

impl Observer for () {
    fn observe_segment(&mut self, _: &SolutionSegment<'_>) {}
}

/// Accuracy, work limit and method of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolverOptions {
    /// Relative error allowed in a Runge-Kutta step. A Taylor step is allowed only a fraction of this error,
    /// so that the errors of transition times, in s, are about as large as the tolerance. Fixed steps ignore
    /// it.
    pub relative_tolerance: f64,
    /// Number of evaluations of the right-hand side after which the run ends ([`RunStatus::WorkLimit`]).
    pub most_evaluations: u64,
    /// Method of integration.
    pub method: IntegrationMethod,
}

/// Method of integration and of locating transitions.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum IntegrationMethod {
    /// Taylor series whose order depends on the tolerance; transitions are roots of the guards' series.
    #[default]
    Taylor,
    /// Runge-Kutta of order 8(5,3) with error control; transitions are bracketed on the dense output.
    RungeKutta,
    /// Runge-Kutta of order 8(5,3); transitions are located by the slack variable method.
    Slack,
    /// The paper's scheme with fixed steps; the tolerance does not apply.
    FixedStep(FixedStepScheme),
}

impl IntegrationMethod {
    /// Name of the method on the command line and in files.
    pub(crate) fn name(&self) -> &'static str {
        match self {
            Self::Taylor => "taylor",
            Self::RungeKutta => "runge-kutta",
            Self::Slack => "slack",
            Self::FixedStep(_) => "fixed-step",
        }
    }

    /// Length of a fixed step, s; `None` for a method with error control.
    pub(crate) fn step_s(&self) -> Option<f64> {
        if let Self::FixedStep(scheme) = self { Some(scheme.step_s) } else { None }
    }
}

impl SolverOptions {
    /// Options with the given relative tolerance, the default method and the default work limit
    /// ([`MOST_EVALUATIONS`]).
    #[must_use]
    pub fn new(relative_tolerance: f64) -> Self {
        Self { relative_tolerance, most_evaluations: MOST_EVALUATIONS, method: IntegrationMethod::default() }
    }

    /// Options with the tolerance and work limit of a scene and the default method.
    #[must_use]
    pub fn from_scene(scene: &Scene) -> Self {
        let most_evaluations = scene.run.most_evaluations.unwrap_or(MOST_EVALUATIONS);
        Self { most_evaluations, ..Self::new(scene.run.relative_tolerance) }
    }
}

/// Summary of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunResult {
    /// Status of the run at its end.
    pub status: RunStatus,
    /// Time at which the run ended, s.
    pub stopped_at_s: f64,
    /// Number of changes of the mode of contact.
    pub transitions: u64,
    /// Counts of steps and evaluations.
    pub work: WorkCounters,
}

/// Runs a scene from its start to its stop time with the scene's own tolerance and work limit.
pub fn run_scene(scene: &Scene, observer: &mut impl Observer) -> RunResult {
    run_scene_with(scene, SolverOptions::from_scene(scene), observer)
}

#[cfg(test)]
thread_local! {
    /// Number of runs in this thread.
    pub(crate) static RUNS: std::cell::Cell<usize> = const { std::cell::Cell::new(0) };
}

/// Runs a scene with the given solver options instead of its own.
pub fn run_scene_with(scene: &Scene, effort: SolverOptions, observer: &mut impl Observer) -> RunResult {
    #[cfg(test)]
    RUNS.set(RUNS.get() + 1);
    let system = build_system(scene);
    let mut watch = ObserverWatcher(observer);
    EventLoop::new(&system, scene, effort, &mut watch).run()
}

/// The driven blade of a scene, with scales of angle and angular rate; for values below these scales, the
/// tolerance is absolute instead of relative.
#[must_use]
pub fn build_system(scene: &Scene) -> DrivenBlade {
    /// The angles of a wiper blade in use are 0.1 to 1 rad.
    const ANGLE_SCALE: f64 = 0.1;
    let (linkage, (slowest, _)) = (scene.linkage, time_scales_rad_per_s(&scene.linkage));
    let angle_scale =
        linkage.slider().map_or(ANGLE_SCALE, |slider| Pose::of_slider(slider.deflection_scale_m(), 0.0).phi);
    DrivenBlade { linkage, drive: scene.drive.clone(), angle_scale, rate_scale: angle_scale * slowest }
}

/// The pose in which a scene starts; `None` for a start in steady slip that does not exist.
pub(crate) fn initial_pose(scene: &Scene) -> Option<Pose> {
    let head_speed = || scene.drive.motion_at(scene.start_s).velocity_m_per_s;
    match scene.start {
        StartKind::Upright => Some(Pose { theta: 0.0, phi: 0.0, theta_rate: 0.0, phi_rate: 0.0 }),
        StartKind::State(pose) | StartKind::Airborne(FlightState { pose, .. }) => Some(pose),
        StartKind::Slider { deflection_m, tip_velocity_m_per_s } => {
            Some(Pose::of_slider(deflection_m, tip_velocity_m_per_s - head_speed()))
        }
        StartKind::SteadySlide => equilibrium::steady_slip_pose(&scene.linkage, head_speed()),
    }
}

/// Cause of a change of the mode of contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TransitionCause {
    /// The tip comes to rest and sticks.
    TipStops,
    /// The force that holds the tip reaches the static limit.
    FrictionLimit,
    /// The tip's velocity changes sign, and static friction cannot hold the tip.
    DirectReversal,
    /// The friction force that holds the tip jumps when the neck meets or leaves the shoulder, because of the
    /// shoulder's damping.
    ShoulderCorner,
    /// The normal force reaches zero.
    LiftOff,
    /// The tip strikes the glass after flight; for a rebound, the modes before and after are both flight.
    Landing,
    /// The tip jams (Painlevé paradox), which is resolved as an impact without collision.
    JamImpact,
}

impl TransitionCause {
    /// Name of the cause in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::TipStops => "tip-stops",
            Self::FrictionLimit => "friction-limit",
            Self::DirectReversal => "direct-reversal",
            Self::ShoulderCorner => "shoulder-corner",
            Self::LiftOff => "lift-off",
            Self::Landing => "landing",
            Self::JamImpact => "jam-impact",
        }
    }
}
