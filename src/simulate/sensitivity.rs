//! Derivatives of a run by parameters, starting state and drive: exact but for the tolerance, along the same
//! steps as the run itself and through its transitions.
//!
//! Between transitions the derivatives obey the linear equations of [`crate::blade::tangent`] along the
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

mod blocks;
mod carrier;
mod difference;
mod direction;
mod jumps;
mod piece;
mod seeds;
mod slide;
mod source;
mod span;
mod weights;

use super::machine::{Machine, Rules};
use super::scene::{Scene, StartKind};
use super::{Effort, Method, Run, Status, Transition, initial_pose, system};
use carrier::{Carrier, Room};
pub use direction::Direction;
pub use piece::TangentPiece;
pub use seeds::Seeds;
use std::ops::ControlFlow;
pub use weights::{Channel, Weights};

/// Sees a run and its derivatives as they are accepted.
pub trait TangentObserver {
    /// A piece of the solution, in order of time.
    fn piece(&mut self, piece: &TangentPiece<'_>);
    /// A change of mode, between the pieces it separates; `d_time_s` are the derivatives of its time, s over
    /// the unit of each direction, `None` where they do not exist.
    fn transition(&mut self, _transition: &Transition, _d_time_s: Option<&[f64]>) {}
    /// Asked after every piece: `Break` ends the run as [`Status::Interrupted`].
    fn flow(&self) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// Runs scenes with derivatives; keeps its room from run to run.
#[derive(Debug, Default)]
pub struct Runner {
    room: Room,
    accuracy: Option<f64>,
}

impl Runner {
    /// A runner whose derivatives within a step are good to `relative` of what they swing by, for a search
    /// that needs no more; at the ends of steps they are far better. Without this they are good to the
    /// tolerance of the run, which stays what it is.
    #[must_use]
    pub fn with_accuracy(relative: f64) -> Self {
        Self { room: Room::default(), accuracy: Some(relative) }
    }

    /// Runs a scene with its derivatives. It is integrated by Taylor series, whatever the effort's method is:
    /// solution and transitions are to the bit those of [`run_with`](super::run_with).
    ///
    /// `seeds` are those of a scene with the same parameters and drive; start and stop may differ.
    pub fn run(
        &mut self,
        scene: &Scene,
        effort: Effort,
        seeds: &Seeds,
        observer: &mut impl TangentObserver,
    ) -> Run {
        let (system, start_s) = (system(scene), scene.start_s);
        let effort = Effort { method: Method::Taylor, ..effort };
        let tolerance = effort.relative_tolerance;
        let accuracy = self.accuracy.unwrap_or(tolerance).max(tolerance);
        let mut carrier = Carrier::new(observer, &system, seeds, &mut self.room, [tolerance, accuracy]);
        carrier.start(scene);
        let mut machine = Machine::new(&system, Rules::of(scene), start_s, effort, &mut carrier);
        match (scene.start, initial_pose(scene)) {
            (StartKind::Airborne(state), _) => machine.run_airborne(&state, scene.run.stop_s),
            (_, Some(pose)) => machine.run(&pose, scene.run.stop_s),
            (_, None) => machine.ended(Status::Diverged),
        }
    }
}

/// Runs a scene with its derivatives, once: see [`Runner::run`].
pub fn run_with_tangents(
    scene: &Scene,
    effort: Effort,
    seeds: &Seeds,
    observer: &mut impl TangentObserver,
) -> Run {
    Runner::default().run(scene, effort, seeds, observer)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Derivatives of the tip's place and of its rate at the ends of all pieces.
    #[derive(Default)]
    struct Ends(Vec<u64>);

    impl TangentObserver for Ends {
        fn piece(&mut self, piece: &TangentPiece<'_>) {
            let at = piece.at(piece.end_s);
            for channel in [Channel::TipX, Channel::HeadDrop, Channel::NormalForce] {
                let mut row = [0.0; 6];
                piece.derivatives(channel, &at, &mut row);
                self.0.extend(row.map(f64::to_bits));
            }
        }
        fn transition(&mut self, _: &Transition, d_time_s: Option<&[f64]>) {
            self.0.extend(d_time_s.into_iter().flatten().map(|x| x.to_bits()));
        }
    }

    #[test]
    fn nothing_of_an_earlier_run_enters_a_run() {
        let text = include_str!("../../data/scenes/actual-blade.toml");
        let scene = Scene::parse("actual-blade.toml", text).unwrap();
        let directions = [
            Direction::NeckAngle,
            Direction::LipRate,
            Direction::Parameter("friction.c".to_owned()),
            Direction::Parameter("blade.neck_stiffness_n_m_per_rad".to_owned()),
            Direction::DriveScale,
            Direction::DriveDelay,
        ];
        let seeds = Seeds::new(&scene, &directions).unwrap();
        let run = |room: Room| {
            let mut ends = Ends::default();
            Runner { room, accuracy: Some(1e-5) }.run(&scene, Effort::new(1e-8), &seeds, &mut ends);
            ends.0
        };
        let fresh = run(Room::default());
        assert!(fresh.len() > 1000 && fresh.iter().all(|bits| f64::from_bits(*bits).is_finite()));
        assert!(run(Room::of_no_numbers(seeds.blocks.len())) == fresh);
    }
}
