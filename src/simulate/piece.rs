//! What observers see: pieces of the solution, and the model at an instant.

mod path;

use super::flight::{Flight, airborne_of};
use super::mode::Mode;
use super::paper::Held;
use super::phases::{self, Motion, Slip, Stick, System, pose_of};
use crate::blade::shoulder::Lean;
use crate::blade::{Directions, HeadMotion, Pose};
use crate::ode;
pub use path::Path;

/// A piece of the solution in one mode, as observers see it.
pub struct Piece<'a> {
    /// Start of the piece, s.
    pub start_s: f64,
    /// End of the piece, s.
    pub end_s: f64,
    /// Mode of contact.
    pub mode: Mode,
    /// Taylor coefficients of the motion about the start, where it was computed by them.
    pub(super) motion: Option<&'a Motion>,
    pub(super) solution: Solution<'a>,
}

pub(super) enum Solution<'a> {
    Slip(&'a Slip<'a>, &'a ode::Step<'a, 4>),
    Stick(&'a Stick<'a>, &'a ode::Step<'a, 2>),
    Flight(&'a Flight<'a>, &'a ode::Step<'a, 6>),
    Held(&'a Held<'a>, &'a ode::Step<'a, 4>),
}

/// The model at one instant.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    /// Time, s.
    pub time_s: f64,
    /// Mode of contact.
    pub mode: Mode,
    /// Angles and rates.
    pub pose: Pose,
    /// Position of the head along the sweep, `v`, m.
    pub head_x_m: f64,
    /// Drop of the head, `u`, m.
    pub head_drop_m: f64,
    /// Height of the tip above the glass, m; zero in contact.
    pub tip_height_m: f64,
    /// Position of the tip along the sweep, `v3`, m.
    pub tip_x_m: f64,
    /// Velocity of the tip, m/s; exactly zero in stick, except where the fixed-step scheme holds it.
    pub tip_velocity_m_per_s: f64,
    /// Normal force, N.
    pub normal_n: f64,
    /// Friction force, N.
    pub friction_n: f64,
    /// Painlevé indicator of slip, 1 in stick and in flight.
    pub indicator: f64,
    /// How far the tip is from where stick holds it, m; zero in slip and in flight.
    pub constraint_drift_m: f64,
    /// Energy of the blade, J.
    pub energy_j: f64,
    /// Power that flows into it, W.
    pub power_w: f64,
}

/// Where a camera sees the blade.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Position of the head along the sweep, `v`, m.
    pub head_x_m: f64,
    /// Drop of the head, `u`, m.
    pub head_drop_m: f64,
    /// Position of the tip along the sweep, `v3`, m.
    pub tip_x_m: f64,
    /// Height of the tip above the glass, m; zero in contact.
    pub tip_height_m: f64,
}

impl Place {
    pub(super) const fn values(self) -> [f64; 4] {
        [self.head_x_m, self.head_drop_m, self.tip_x_m, self.tip_height_m]
    }

    pub(super) const fn of([head_x_m, head_drop_m, tip_x_m, tip_height_m]: [f64; 4]) -> Self {
        Self { head_x_m, head_drop_m, tip_x_m, tip_height_m }
    }
}

impl Piece<'_> {
    /// Where the blade is at any time within the piece, and the integral of it: by the polynomials of the
    /// step where the motion was computed by them.
    #[must_use]
    pub fn path(&self) -> Path<'_> {
        Path::of(self)
    }

    /// Angles and rates at a time within the piece: what [`Self::sample`] says, to the bit.
    #[must_use]
    pub fn pose(&self, t: f64) -> Pose {
        match &self.solution {
            Solution::Slip(_, step) => pose_of(&state(step, t)),
            Solution::Held(_, step) => pose_of(&state(step, t)),
            Solution::Stick(stick, step) => stick.pose(&stick.system.drive.at(t), &state(step, t)).0,
            Solution::Flight(_, step) => airborne_of(&state(step, t)).pose,
        }
    }

    /// Where the blade is at a time within the piece: what [`Self::sample`] says, to the bit, without forces
    /// and energies.
    #[must_use]
    pub fn place(&self, t: f64) -> Place {
        let on_glass = |system: &System, d: &Directions, head: &HeadMotion| Place {
            head_x_m: head.position_m,
            head_drop_m: system.linkage.head_drop_m(d),
            tip_x_m: system.linkage.tip_position_m(d, head),
            tip_height_m: 0.0,
        };
        match &self.solution {
            Solution::Slip(slip, step) => {
                on_glass(slip.system, &Directions::of(&pose_of(&state(step, t))), &slip.system.drive.at(t))
            }
            Solution::Held(held, step) => {
                on_glass(held.system, &Directions::of(&pose_of(&state(step, t))), &held.system.drive.at(t))
            }
            Solution::Stick(stick, step) => {
                let head = stick.system.drive.at(t);
                let (_, directions) = stick.pose(&head, &state(step, t));
                on_glass(stick.system, &directions, &head)
            }
            Solution::Flight(flight, step) => {
                let (linkage, state) = (&flight.system.linkage, airborne_of(&state(step, t)));
                let (d, head) = (Directions::of(&state.pose), flight.system.drive.at(t));
                let head_drop_m = linkage.drop_in_flight(&state, &d).0;
                Place {
                    head_x_m: head.position_m,
                    head_drop_m,
                    tip_x_m: linkage.tip_position_m(&d, &head),
                    tip_height_m: state.gap_m,
                }
            }
        }
    }

    /// The model at a time within the piece.
    #[must_use]
    pub fn sample(&self, t: f64) -> Sample {
        match &self.solution {
            Solution::Slip(slip, step) => {
                let y = state(step, t);
                let pose = pose_of(&y);
                let at = slip.system.instant(t, &pose, slip.lean);
                let (speed, forces) = slip.forces(&pose, &at);
                self.assemble(t, slip.system, slip.lean, pose, &at, &forces, slip.direction * speed, 0.0)
            }
            Solution::Stick(stick, step) => {
                let y = state(step, t);
                let (pose, at) = stick.instant(t, &y);
                let forces = stick.forces(&at);
                let drift =
                    stick.system.linkage.tip_position_m(&Directions::of(&pose), &at.head) - stick.place_m;
                self.assemble(t, stick.system, stick.lean, pose, &at, &forces, 0.0, drift)
            }
            Solution::Flight(flight, step) => airborne(t, flight, &state(step, t)),
            Solution::Held(held, step) => {
                let y = state(step, t);
                let pose = pose_of(&y);
                let at = held.system.instant(t, &pose, held.lean);
                let forces = held.forces(&pose, &at);
                let linkage = &held.system.linkage;
                let drift = linkage.tip_position_m(&at.directions, &at.head) - held.place_m;
                let velocity = linkage.tip_velocity_m_per_s(&pose, &at.directions, &at.head);
                self.assemble(t, held.system, held.lean, pose, &at, &forces, velocity, drift)
            }
        }
    }

    #[allow(clippy::too_many_arguments)] // one private place gathers what both modes computed
    fn assemble(
        &self,
        t: f64,
        system: &System,
        lean: Lean,
        pose: Pose,
        at: &phases::Instant,
        forces: &phases::Forces,
        tip_velocity_m_per_s: f64,
        drift: f64,
    ) -> Sample {
        let (linkage, d) = (&system.linkage, &at.directions);
        Sample {
            time_s: t,
            mode: self.mode,
            pose,
            head_x_m: at.head.position_m,
            head_drop_m: linkage.head_drop_m(d),
            tip_height_m: 0.0,
            tip_x_m: linkage.tip_position_m(d, &at.head),
            tip_velocity_m_per_s,
            normal_n: forces.normal_n,
            friction_n: forces.friction_n,
            indicator: forces.indicator,
            constraint_drift_m: drift,
            energy_j: linkage.energy_j(&pose, d, &at.head),
            power_w: linkage.power_w(&pose, d, &at.head, lean, forces.friction_n, forces.accelerations),
        }
    }
}

/// The state at a time within a step.
fn state<const N: usize>(step: &ode::Step<'_, N>, t: f64) -> [f64; N] {
    if t == step.end { *step.y_end } else { step.solution.at(t) }
}

/// The model off the glass, where no force acts on the tip.
fn airborne(t: f64, flight: &Flight<'_>, y: &[f64; 6]) -> Sample {
    let (linkage, state) = (&flight.system.linkage, airborne_of(y));
    let (d, head) = (Directions::of(&state.pose), flight.system.drive.at(t));
    let drop = linkage.drop_in_flight(&state, &d);
    let accelerations = linkage.flight(&state, &d, &head, flight.lean).links;
    Sample {
        time_s: t,
        mode: Mode::Flight,
        pose: state.pose,
        head_x_m: head.position_m,
        head_drop_m: drop.0,
        tip_height_m: state.gap_m,
        tip_x_m: linkage.tip_position_m(&d, &head),
        tip_velocity_m_per_s: linkage.tip_velocity_m_per_s(&state.pose, &d, &head),
        normal_n: 0.0,
        friction_n: 0.0,
        indicator: 1.0,
        constraint_drift_m: 0.0,
        energy_j: linkage.energy_with_drop_j(&state.pose, &d, &head, drop),
        power_w: linkage.power_with_drop_w(&state.pose, &d, &head, flight.lean, 0.0, accelerations, drop.1),
    }
}
