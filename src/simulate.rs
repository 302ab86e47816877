//! The stick-slip model run event by event: step, locate, decide, accept.
//!
//! Each mode of contact is a smooth phase ([`phases`]) integrated until one of its guards falls to zero; the
//! decision what follows is a pure function of the forces ([`mode`]). Observers see every accepted piece of
//! the solution, so nothing is stored and what is not asked for is not computed.

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
pub mod scene;
pub mod sensitivity;
mod solution_segment;
pub mod twin;

use crate::model::Pose;
use crate::model::flight::FlightState;
use crate::model::modes::time_scales_rad_per_s;
use crate::ode::WorkCounters;
use event_loop::{ContactRules, EventLoop, ObserverWatcher};
use fixed_step_scheme::FixedStepScheme;
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
    /// Transitions accumulated in no time.
    Chattering,
    /// The state left what the model describes, or no step met the tolerance.
    Diverged,
    /// The right-hand sides allowed were used up.
    WorkLimit,
    /// An observer asked for the end.
    Interrupted,
}

impl RunStatus {
    /// The name used in files.
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

    /// What it means, in a sentence.
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

/// One change of mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transition {
    /// When, s.
    pub time_s: f64,
    /// Mode before.
    pub from: TipMode,
    /// Mode after.
    pub to: TipMode,
    /// Why.
    pub cause: TransitionCause,
}

/// An impact of the tip on the glass: velocities jump in no time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Impact {
    /// When, s.
    pub time_s: f64,
    /// Velocity of the tip before.
    pub before: TipVelocity,
    /// Velocity of the tip after.
    pub after: TipVelocity,
    /// Normal and tangential impulse on the tip, N s.
    pub impulse_n_s: [f64; 2],
    /// Energy that the contact took, J; never negative beyond rounding.
    pub lost_j: f64,
    /// Energy that the drive brought in by its own impulse, which keeps the head at its prescribed velocity,
    /// J.
    pub driven_j: f64,
}

/// Sees the solution as it is accepted.
pub trait Observer {
    /// A piece of the solution, in order of time.
    fn observe_segment(&mut self, piece: &SolutionSegment<'_>);
    /// A change of mode, between the pieces it separates.
    fn observe_transition(&mut self, _transition: &Transition) {}
    /// An impact, before the transition that it causes.
    fn observe_impact(&mut self, _impact: &Impact) {}
    /// Asked after every piece: `Break` ends the run as [`RunStatus::Interrupted`].
    fn control_flow(&self) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

impl Observer for () {
    fn observe_segment(&mut self, _: &SolutionSegment<'_>) {}
}

/// How exact a run is and how much work it may cost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolverOptions {
    /// Tolerance, relative. Runge-Kutta may err by it in a step; Taylor series by a share of it, such that
    /// the times of transitions err by about as many seconds. Nothing to steps of fixed length.
    pub relative_tolerance: f64,
    /// Right-hand sides after which the run gives up ([`RunStatus::WorkLimit`]).
    pub most_evaluations: u64,
    /// How it is integrated.
    pub method: IntegrationMethod,
}

/// How a run is integrated and its transitions are located.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum IntegrationMethod {
    /// Taylor series of the order that the tolerance asks for; transitions are roots of the guards' own
    /// series.
    #[default]
    Taylor,
    /// Runge-Kutta of order 8(5,3) with error control; transitions are bracketed on its dense output.
    RungeKutta,
    /// The same with transitions located by the slack variable method.
    Slack,
    /// The paper's scheme; the tolerance does not apply.
    FixedStep(FixedStepScheme),
}

impl IntegrationMethod {
    /// The name on the command line and in files.
    pub(crate) fn name(&self) -> &'static str {
        match self {
            Self::Taylor => "taylor",
            Self::RungeKutta => "runge-kutta",
            Self::Slack => "slack",
            Self::FixedStep(_) => "fixed-step",
        }
    }

    /// The length of its steps, s, where that is fixed.
    pub(crate) fn step_s(&self) -> Option<f64> {
        match self {
            Self::FixedStep(scheme) => Some(scheme.step_s),
            Self::Taylor | Self::RungeKutta | Self::Slack => None,
        }
    }
}

impl SolverOptions {
    /// A tolerance with a bound on work that no ordinary scene reaches ([`MOST_EVALUATIONS`]).
    #[must_use]
    pub fn new(relative_tolerance: f64) -> Self {
        Self { relative_tolerance, most_evaluations: MOST_EVALUATIONS, method: IntegrationMethod::default() }
    }

    /// What a scene says of both, by the default method.
    #[must_use]
    pub fn from_scene(scene: &Scene) -> Self {
        let most_evaluations = scene.run.most_evaluations.unwrap_or(MOST_EVALUATIONS);
        Self { most_evaluations, ..Self::new(scene.run.relative_tolerance) }
    }
}

/// How a run went.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunResult {
    /// How it ended.
    pub status: RunStatus,
    /// When, s.
    pub stopped_at_s: f64,
    /// Number of changes of mode.
    pub transitions: u64,
    /// What it cost.
    pub work: WorkCounters,
}

/// Runs a scene from its start to its stop time at the scene's own tolerance.
pub fn run_scene(scene: &Scene, observer: &mut impl Observer) -> RunResult {
    run_scene_with(scene, SolverOptions::from_scene(scene), observer)
}

#[cfg(test)]
thread_local! {
    /// Runs of this thread.
    pub(crate) static RUNS: std::cell::Cell<usize> = const { std::cell::Cell::new(0) };
}

/// Runs a scene with another effort than its own.
pub fn run_scene_with(scene: &Scene, effort: SolverOptions, observer: &mut impl Observer) -> RunResult {
    #[cfg(test)]
    RUNS.set(RUNS.get() + 1);
    let system = build_system(scene);
    let mut watch = ObserverWatcher(observer);
    let mut machine =
        EventLoop::new(&system, ContactRules::from_scene(scene), scene.start_s, effort, &mut watch);
    match (scene.start, initial_pose(scene)) {
        (StartKind::Airborne(state), _) => machine.run_from_flight(&state, scene.run.stop_s),
        (_, Some(pose)) => machine.run_from_pose(&pose, scene.run.stop_s),
        (_, None) => machine.finish_run(RunStatus::Diverged),
    }
}

/// The system of a scene, with the magnitudes below which errors count as absolute.
#[must_use]
pub fn build_system(scene: &Scene) -> DrivenBlade {
    /// A tenth of a radian: angles of a wiper blade in use are 0.1 to 1 rad.
    const ANGLE_SCALE: f64 = 0.1;
    let (slowest, _) = time_scales_rad_per_s(&scene.linkage);
    DrivenBlade {
        linkage: scene.linkage,
        drive: scene.drive.clone(),
        angle_scale: ANGLE_SCALE,
        rate_scale: ANGLE_SCALE * slowest,
    }
}

fn initial_pose(scene: &Scene) -> Option<Pose> {
    match scene.start {
        StartKind::Upright => Some(Pose { theta: 0.0, phi: 0.0, theta_rate: 0.0, phi_rate: 0.0 }),
        StartKind::State(pose) | StartKind::Airborne(FlightState { pose, .. }) => Some(pose),
        StartKind::SteadySlide => equilibrium::steady_slip_pose(
            &scene.linkage,
            scene.drive.motion_at(scene.start_s).velocity_m_per_s,
        ),
    }
}

// Why a mode of contact gives way to another.

/// Why contact changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TransitionCause {
    /// The tip comes to rest and sticks.
    TipStops,
    /// The holding force reaches the static limit.
    FrictionLimit,
    /// The tip's velocity changes sign and nothing holds it at rest.
    DirectReversal,
    /// The shoulder's damping makes the holding force jump as the neck meets it.
    ShoulderCorner,
    /// The normal force reaches zero.
    LiftOff,
    /// An impact from flight; a rebound is one from flight to flight.
    Landing,
    /// The impact without collision that resolves the Painlevé paradox.
    JamImpact,
}

impl TransitionCause {
    /// The name used in files.
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
