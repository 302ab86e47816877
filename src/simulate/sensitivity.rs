//! Derivatives of a run with respect to parameters, initial state and drive. Their relative error is about
//! the tolerance of the run. They are computed along the steps of the run and through its transitions.
//!
//! Between transitions, the derivatives obey the linear equations of [`crate::model::tangent`] along the
//! series of each step. These are solved by collocation ([`hybrid_ode::collocation`]); all directions share
//! one factorisation per step. At the zero of a guard `G`, the transition time changes by `d tau = -dG / G'`,
//! and the derivative of the state jumps (saltation; Leine and Nijmeijer, "Dynamics and Bifurcations of
//! Non-Smooth Mechanical Systems", chapter 7),
//!
//! ```text
//! d y+ = R_y (d y- + f- d tau) + R_p - f+ d tau
//! ```
//!
//! with the right-hand sides `f` before and after the transition, and with the map `R` of an impact, which is
//! the identity for other transitions. A guard that only grazes zero makes the derivative infinite; from then
//! on, the derivatives are unknown.

mod local_error;
mod propagation;
mod saltation;
mod seeds;
mod source;
mod stretch;
mod tangent_blocks;
mod tangent_segment;

use super::event_loop::{EventLoop, RunWatcher};
use super::phases::DrivenBlade;
use super::scene::Scene;
use super::{IntegrationMethod, RunResult, SolverOptions, Transition, build_system};
use propagation::{TangentPropagator, TangentWorkspace};
pub use seeds::{TangentDirection, TangentSeeds};
use std::ops::ControlFlow;
pub use tangent_segment::{Channel, ChannelWeights, TangentSegment};

/// Receives a run and its derivatives, piece by piece as they are accepted.
pub trait TangentObserver {
    /// Receives a piece of the solution, in order of time.
    fn observe_segment(&mut self, piece: &TangentSegment<'_>);
    /// Receives a change of the mode of contact, between the two pieces that it separates. `d_time_s`
    /// contains the derivatives of the time of this change, s per unit of each direction; `None` if they do
    /// not exist.
    fn observe_transition(&mut self, _transition: &Transition, _d_time_s: Option<&[f64]>) {}
    /// Receives a minimum of a guard that has not fallen to zero: the values of the guard at the start of the
    /// stretch and at the minimum, and the derivatives of the second. Only a run with errors of steps reports
    /// minima.
    fn observe_minimum(&mut self, _time_s: f64, _values: [f64; 2], _d_value: &[f64]) {}
    /// Called after every piece; `Break` ends the run as `RunStatus::Interrupted`.
    fn control_flow(&self) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// Runs scenes with derivatives; the workspace is kept from run to run.
#[derive(Debug, Default)]
pub struct TangentRunner {
    room: TangentWorkspace,
    accuracy: Option<f64>,
}

impl TangentRunner {
    /// Returns a runner for searches that need no high accuracy. Within a step, its derivatives have the
    /// relative error `relative`; at the ends of a step they are far more accurate. Without this call, the
    /// relative error is the tolerance of the run. `relative` does not change the tolerance of the run.
    #[must_use]
    pub fn with_accuracy(relative: f64) -> Self {
        Self { room: TangentWorkspace::default(), accuracy: Some(relative) }
    }

    /// Runs a scene with its derivatives, always by Taylor series. The solution and its transitions are bit
    /// for bit those of [`run_scene_with`](super::run_scene_with).
    ///
    /// `seeds` must belong to a scene with the same parameters and drive; start and stop may differ.
    pub fn run_scene(
        &mut self,
        scene: &Scene,
        effort: SolverOptions,
        seeds: &TangentSeeds,
        observer: &mut impl TangentObserver,
    ) -> RunResult {
        let system = build_system(scene);
        let effort = SolverOptions { method: IntegrationMethod::Taylor, ..effort };
        let tolerance = effort.relative_tolerance;
        let accuracy = self.accuracy.unwrap_or(tolerance).max(tolerance);
        let mut carrier =
            TangentPropagator::new(observer, &system, seeds, &mut self.room, [tolerance, accuracy]);
        carrier.set_start(scene);
        EventLoop::new(&system, scene, effort, &mut carrier).run()
    }
}

/// Calls `run` with a watcher that carries the errors of the steps of a run of a scene. The observer receives
/// the errors by truncation and by rounding of every transition time, s, computed minus exact.
pub(super) fn run_with_step_errors(
    scene: &Scene,
    system: &DrivenBlade,
    tolerance: f64,
    observer: &mut impl TangentObserver,
    run: impl FnOnce(&mut dyn RunWatcher) -> RunResult,
) -> RunResult {
    /// Relative accuracy of the propagated errors: the first digits are enough.
    const ACCURACY: f64 = 1e-3;
    let (seeds, mut room) = (TangentSeeds::of_step_errors(), TangentWorkspace::default());
    let accuracies = [tolerance, ACCURACY.max(tolerance)];
    let mut carrier = TangentPropagator::new(observer, system, &seeds, &mut room, accuracies);
    carrier.set_start(scene);
    run(&mut carrier)
}

/// Runs one scene with its derivatives; see [`TangentRunner::run_scene`].
pub fn run_with_tangents(
    scene: &Scene,
    effort: SolverOptions,
    seeds: &TangentSeeds,
    observer: &mut impl TangentObserver,
) -> RunResult {
    TangentRunner::default().run_scene(scene, effort, seeds, observer)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bit patterns of the derivatives at the ends of all pieces.
    #[derive(Default)]
    struct Ends(Vec<u64>);

    impl TangentObserver for Ends {
        fn observe_segment(&mut self, piece: &TangentSegment<'_>) {
            let at = piece.weights_at(piece.end_s);
            for channel in [Channel::TipX, Channel::HeadDrop, Channel::NormalForce] {
                let mut row = [0.0; 6];
                piece.channel_derivatives(channel, &at, &mut row);
                self.0.extend(row.map(f64::to_bits));
            }
        }
        fn observe_transition(&mut self, _: &Transition, d_time_s: Option<&[f64]>) {
            self.0.extend(d_time_s.into_iter().flatten().map(|x| x.to_bits()));
        }
    }

    #[test]
    fn nothing_of_an_earlier_run_enters_a_run() {
        let text = include_str!("../../data/scenes/actual-blade.toml");
        let scene = Scene::parse("actual-blade.toml", text).unwrap();
        let directions = [
            TangentDirection::NeckAngle,
            TangentDirection::LipRate,
            TangentDirection::Parameter("friction.c".to_owned()),
            TangentDirection::Parameter("blade.neck_stiffness_n_m_per_rad".to_owned()),
            TangentDirection::DriveScale,
            TangentDirection::DriveDelay,
        ];
        let seeds = TangentSeeds::new(&scene, &directions).unwrap();
        let run = |room: TangentWorkspace| {
            let mut ends = Ends::default();
            let mut runner = TangentRunner { room, accuracy: Some(1e-5) };
            runner.run_scene(&scene, SolverOptions::new(1e-8), &seeds, &mut ends);
            ends.0
        };
        let fresh = run(TangentWorkspace::default());
        assert!(fresh.len() > 1000 && fresh.iter().all(|bits| f64::from_bits(*bits).is_finite()));
        assert!(run(TangentWorkspace::of_no_numbers(seeds.blocks.len())) == fresh);
    }
}
