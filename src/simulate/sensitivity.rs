//! Derivatives of a run by parameters, starting state and drive: exact but for the tolerance, along the same
//! steps as the run itself and through its transitions.
//!
//! Between transitions the derivatives obey the linear equations of [`crate::model::tangent`] along the
//! series of each step, and are found by collocation ([`crate::ode::collocation`]); one factoring a step
//! serves all directions. Where a guard
//! `G` falls, the time of the transition changes by `d tau = -dG / G'` and the derivative of the state jumps
//! (saltation; Leine and Nijmeijer, "Dynamics and Bifurcations of Non-Smooth Mechanical Systems", chapter 7),
//!
//! ```text
//! d y+ = R_y (d y- + f- d tau) + R_p - f+ d tau
//! ```
//!
//! with `f` the right-hand sides before and after and `R` the map of an impact, the identity elsewhere. Where
//! a guard only grazes zero the derivative is infinite: from there on there is none.

mod propagation;
mod saltation;
mod seeds;
mod source;
mod stretch;
mod tangent_blocks;
mod tangent_segment;

use super::event_loop::EventLoop;
use super::scene::Scene;
use super::{IntegrationMethod, RunResult, SolverOptions, Transition, build_system};
use propagation::{TangentPropagator, TangentWorkspace};
pub use seeds::{TangentDirection, TangentSeeds};
use std::ops::ControlFlow;
pub use tangent_segment::{Channel, ChannelWeights, TangentSegment};

/// Sees a run and its derivatives as they are accepted.
pub trait TangentObserver {
    /// A piece of the solution, in order of time.
    fn observe_segment(&mut self, piece: &TangentSegment<'_>);
    /// A change of mode, between the pieces it separates; `d_time_s` are the derivatives of its time, s over
    /// the unit of each direction, `None` where they do not exist.
    fn observe_transition(&mut self, _transition: &Transition, _d_time_s: Option<&[f64]>) {}
    /// Asked after every piece: `Break` ends the run as [`RunStatus::Interrupted`].
    fn control_flow(&self) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// Runs scenes with derivatives; keeps its room from run to run.
#[derive(Debug, Default)]
pub struct TangentRunner {
    room: TangentWorkspace,
    accuracy: Option<f64>,
}

impl TangentRunner {
    /// A runner whose derivatives within a step are good to `relative` of what they swing by, for a search
    /// that needs no more; at the ends of steps they are far better. Without this they are good to the
    /// tolerance of the run, which stays what it is.
    #[must_use]
    pub fn with_accuracy(relative: f64) -> Self {
        Self { room: TangentWorkspace::default(), accuracy: Some(relative) }
    }

    /// Runs a scene with its derivatives. It is integrated by Taylor series, whatever the effort's method is:
    /// solution and transitions are to the bit those of [`run_with`](super::run_with).
    ///
    /// `seeds` are those of a scene with the same parameters and drive; start and stop may differ.
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

/// Runs a scene with its derivatives, once: see [`TangentRunner::run_scene`].
pub fn run_with_tangents(
    scene: &Scene,
    effort: SolverOptions,
    seeds: &TangentSeeds,
    observer: &mut impl TangentObserver,
) -> RunResult {
    TangentRunner::default().run_scene(scene, effort, seeds, observer)
}

// Central differences of functions that are cheap and smooth.

/// Steps of the six-point central difference with their weights (Fornberg, Math. Comp. 51, 1988, table 1):
/// order 6.
pub(super) const SIX_POINTS: [(f64, f64); 6] = [
    (-3.0, -1.0 / 60.0),
    (-2.0, 9.0 / 60.0),
    (-1.0, -45.0 / 60.0),
    (1.0, 45.0 / 60.0),
    (2.0, -9.0 / 60.0),
    (3.0, 1.0 / 60.0),
];

/// Step relative to the scale on which a function changes: its sixth power, the truncation, is below
/// rounding, and rounding over it leaves 1e-13.
pub(super) const DIFFERENCE_STEP: f64 = 1e-3;

/// Derivative of `f` at 0 along its argument; `None` where `f` has no value.
pub(super) fn central_difference<const N: usize>(
    step: f64,
    mut f: impl FnMut(f64) -> Option<[f64; N]>,
) -> Option<[f64; N]> {
    let mut sum = [0.0; N];
    for (point, weight) in SIX_POINTS {
        let value = f(point * step)?;
        sum.iter_mut().zip(value).for_each(|(sum, value)| *sum += weight / step * value);
    }
    Some(sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Derivatives of the tip's place and of its rate at the ends of all pieces.
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
            TangentRunner { room, accuracy: Some(1e-5) }.run_scene(
                &scene,
                SolverOptions::new(1e-8),
                &seeds,
                &mut ends,
            );
            ends.0
        };
        let fresh = run(TangentWorkspace::default());
        assert!(fresh.len() > 1000 && fresh.iter().all(|bits| f64::from_bits(*bits).is_finite()));
        assert!(run(TangentWorkspace::of_no_numbers(seeds.blocks.len())) == fresh);
    }
}
