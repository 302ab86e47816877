//! What observers see: pieces of the solution, and the model at an instant.

mod path;

use super::flight::{FlightPhase, flight_state_from};
use super::mode::TipMode;
use super::paper::StabilisedStickPhase;
use super::phases::{self, DrivenBlade, SlipPhase, StickPhase, TaylorMotion, pose_from_states};
use crate::blade::shoulder::ShoulderContact;
use crate::blade::{HeadMotion, LinkDirections, Pose};
use crate::ode;
pub use path::SegmentPath;

/// A piece of the solution in one mode, as observers see it.
pub struct SolutionSegment<'a> {
    /// Start of the piece, s.
    pub start_s: f64,
    /// End of the piece, s.
    pub end_s: f64,
    /// Mode of contact.
    pub mode: TipMode,
    /// Taylor coefficients of the motion about the start, where it was computed by them.
    pub(super) motion: Option<&'a TaylorMotion>,
    pub(super) solution: SegmentSolution<'a>,
}

pub(super) enum SegmentSolution<'a> {
    Slip(&'a SlipPhase<'a>, &'a ode::AcceptedStep<'a, 4>),
    Stick(&'a StickPhase<'a>, &'a ode::AcceptedStep<'a, 2>),
    Flight(&'a FlightPhase<'a>, &'a ode::AcceptedStep<'a, 6>),
    Held(&'a StabilisedStickPhase<'a>, &'a ode::AcceptedStep<'a, 4>),
}

/// The model at one instant.
#[derive(Debug, Clone, Copy)]
pub struct ModelSample {
    /// Time, s.
    pub time_s: f64,
    /// Mode of contact.
    pub mode: TipMode,
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
pub struct BladePoints {
    /// Position of the head along the sweep, `v`, m.
    pub head_x_m: f64,
    /// Drop of the head, `u`, m.
    pub head_drop_m: f64,
    /// Position of the tip along the sweep, `v3`, m.
    pub tip_x_m: f64,
    /// Height of the tip above the glass, m; zero in contact.
    pub tip_height_m: f64,
}

impl BladePoints {
    pub(super) const fn to_array(self) -> [f64; 4] {
        [self.head_x_m, self.head_drop_m, self.tip_x_m, self.tip_height_m]
    }

    pub(super) const fn from_array([head_x_m, head_drop_m, tip_x_m, tip_height_m]: [f64; 4]) -> Self {
        Self { head_x_m, head_drop_m, tip_x_m, tip_height_m }
    }
}

impl SolutionSegment<'_> {
    /// Where the blade is at any time within the piece, and the integral of it: by the polynomials of the
    /// step where the motion was computed by them.
    #[must_use]
    pub fn path(&self) -> SegmentPath<'_> {
        SegmentPath::new(self)
    }

    /// Angles and rates at a time within the piece: what [`Self::sample_at`] says, to the bit.
    #[must_use]
    pub fn pose_at(&self, t: f64) -> Pose {
        match &self.solution {
            SegmentSolution::Slip(_, step) => pose_from_states(&state_in_step(step, t)),
            SegmentSolution::Held(_, step) => pose_from_states(&state_in_step(step, t)),
            SegmentSolution::Stick(stick, step) => {
                stick.full_pose(&stick.system.drive.motion_at(t), &state_in_step(step, t)).0
            }
            SegmentSolution::Flight(_, step) => flight_state_from(&state_in_step(step, t)).pose,
        }
    }

    /// Where the blade is at a time within the piece: what [`Self::sample_at`] says, to the bit, without forces
    /// and energies.
    #[must_use]
    pub fn points_at(&self, t: f64) -> BladePoints {
        let on_glass = |system: &DrivenBlade, d: &LinkDirections, head: &HeadMotion| BladePoints {
            head_x_m: head.position_m,
            head_drop_m: system.linkage.head_drop_m(d),
            tip_x_m: system.linkage.tip_position_m(d, head),
            tip_height_m: 0.0,
        };
        match &self.solution {
            SegmentSolution::Slip(slip, step) => on_glass(
                slip.system,
                &LinkDirections::from_pose(&pose_from_states(&state_in_step(step, t))),
                &slip.system.drive.motion_at(t),
            ),
            SegmentSolution::Held(held, step) => on_glass(
                held.system,
                &LinkDirections::from_pose(&pose_from_states(&state_in_step(step, t))),
                &held.system.drive.motion_at(t),
            ),
            SegmentSolution::Stick(stick, step) => {
                let head = stick.system.drive.motion_at(t);
                let (_, directions) = stick.full_pose(&head, &state_in_step(step, t));
                on_glass(stick.system, &directions, &head)
            }
            SegmentSolution::Flight(flight, step) => {
                let (linkage, state) = (&flight.system.linkage, flight_state_from(&state_in_step(step, t)));
                let (d, head) = (LinkDirections::from_pose(&state.pose), flight.system.drive.motion_at(t));
                let head_drop_m = linkage.drop_in_flight(&state, &d).0;
                BladePoints {
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
    pub fn sample_at(&self, t: f64) -> ModelSample {
        match &self.solution {
            SegmentSolution::Slip(slip, step) => {
                let y = state_in_step(step, t);
                let pose = pose_from_states(&y);
                let at = slip.system.contact_instant(t, &pose, slip.lean);
                let (speed, forces) = slip.slip_forces(&pose, &at);
                self.assemble_sample(
                    t,
                    slip.system,
                    slip.lean,
                    pose,
                    &at,
                    &forces,
                    slip.direction * speed,
                    0.0,
                )
            }
            SegmentSolution::Stick(stick, step) => {
                let y = state_in_step(step, t);
                let (pose, at) = stick.contact_instant(t, &y);
                let forces = stick.holding_forces(&at);
                let drift = stick.system.linkage.tip_position_m(&LinkDirections::from_pose(&pose), &at.head)
                    - stick.place_m;
                self.assemble_sample(t, stick.system, stick.lean, pose, &at, &forces, 0.0, drift)
            }
            SegmentSolution::Flight(flight, step) => sample_in_flight(t, flight, &state_in_step(step, t)),
            SegmentSolution::Held(held, step) => {
                let y = state_in_step(step, t);
                let pose = pose_from_states(&y);
                let at = held.system.contact_instant(t, &pose, held.lean);
                let forces = held.stabilised_forces(&pose, &at);
                let linkage = &held.system.linkage;
                let drift = linkage.tip_position_m(&at.directions, &at.head) - held.place_m;
                let velocity = linkage.tip_velocity_m_per_s(&pose, &at.directions, &at.head);
                self.assemble_sample(t, held.system, held.lean, pose, &at, &forces, velocity, drift)
            }
        }
    }

    #[allow(clippy::too_many_arguments)] // one private place gathers what both modes computed
    fn assemble_sample(
        &self,
        t: f64,
        system: &DrivenBlade,
        lean: ShoulderContact,
        pose: Pose,
        at: &phases::ContactInstant,
        forces: &phases::TipForces,
        tip_velocity_m_per_s: f64,
        drift: f64,
    ) -> ModelSample {
        let (linkage, d) = (&system.linkage, &at.directions);
        ModelSample {
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
fn state_in_step<const N: usize>(step: &ode::AcceptedStep<'_, N>, t: f64) -> [f64; N] {
    if t == step.end { *step.y_end } else { step.solution.state_at(t) }
}

/// The model off the glass, where no force acts on the tip.
fn sample_in_flight(t: f64, flight: &FlightPhase<'_>, y: &[f64; 6]) -> ModelSample {
    let (linkage, state) = (&flight.system.linkage, flight_state_from(y));
    let (d, head) = (LinkDirections::from_pose(&state.pose), flight.system.drive.motion_at(t));
    let drop = linkage.drop_in_flight(&state, &d);
    let accelerations = linkage.flight_accelerations(&state, &d, &head, flight.lean).links;
    ModelSample {
        time_s: t,
        mode: TipMode::Flight,
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
