//! Pieces of the solution, and the state of the model at an instant within a piece.

use super::fixed_step_scheme::StabilisedStickPhase;
use super::flight::{FlightPhase, flight_state_from};
use super::mode::TipMode;
use super::phases::{self, DrivenBlade, SlipPhase, StickPhase, TaylorMotion, pose_from_states};
use crate::model::shoulder::ShoulderContact;
use crate::model::{HeadMotion, LinkDirections, Pose};
use hybrid_ode as ode;
use hybrid_ode::polynomial::TERMS;
use portable_math::gauss_legendre;

/// A piece of the solution in one mode of contact.
pub struct SolutionSegment<'a> {
    /// Start of the piece, s.
    pub start_s: f64,
    /// End of the piece, s.
    pub end_s: f64,
    /// Mode of contact.
    pub mode: TipMode,
    /// Taylor coefficients of the motion about the start of the piece; `None` for methods without series.
    pub(super) motion: Option<&'a TaylorMotion>,
    pub(super) solution: SegmentSolution<'a>,
}

pub(super) enum SegmentSolution<'a> {
    Slip(&'a SlipPhase<'a>, &'a ode::AcceptedStep<'a, 4>),
    Stick(&'a StickPhase<'a>, &'a ode::AcceptedStep<'a, 2>),
    Flight(&'a FlightPhase<'a>, &'a ode::AcceptedStep<'a, 6>),
    Held(&'a StabilisedStickPhase<'a>, &'a ode::AcceptedStep<'a, 4>),
}

/// State of the model at one instant.
#[derive(Debug, Clone, Copy)]
pub struct ModelSample {
    /// Time, s.
    pub time_s: f64,
    /// Mode of contact.
    pub mode: TipMode,
    /// Angles and rates of the links.
    pub pose: Pose,
    /// Position of the head along the sweep, `v`, m.
    pub head_x_m: f64,
    /// Drop of the head, `u`, m.
    pub head_drop_m: f64,
    /// Height of the tip above the glass, m; zero in contact.
    pub tip_height_m: f64,
    /// Position of the tip along the sweep, `v3`, m.
    pub tip_x_m: f64,
    /// Velocity of the tip along the sweep, m/s; exactly zero in stick, except with the fixed-step scheme.
    pub tip_velocity_m_per_s: f64,
    /// Normal force on the tip, N.
    pub normal_n: f64,
    /// Friction force on the tip, N.
    pub friction_n: f64,
    /// Painlevé indicator of slip, 1 in stick and in flight.
    pub indicator: f64,
    /// Drift of the tip from the position at which it sticks, m; zero in slip and in flight.
    pub constraint_drift_m: f64,
    /// Kinetic energy of the blade plus the energy of its springs, J.
    pub energy_j: f64,
    /// Power supplied to the blade by the drive, minus the losses in friction and dampers, W.
    pub power_w: f64,
}

/// Positions of head and tip, the points that a camera tracks.
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

impl<'a> SolutionSegment<'a> {
    #[inline]
    pub(super) fn from_step<const N: usize>(
        step: &ode::AcceptedStep<'_, N>,
        mode: TipMode,
        motion: Option<&'a TaylorMotion>,
        solution: SegmentSolution<'a>,
    ) -> Self {
        Self { start_s: step.start, end_s: step.end, mode, motion, solution }
    }

    /// Positions of head and tip over the piece, and their integrals; computed from Taylor polynomials if the
    /// method provides them.
    #[must_use]
    pub fn path(&self) -> SegmentPath<'_> {
        let polynomials = self.motion.and_then(|motion| PathPolynomials::from_segment(self, motion));
        SegmentPath { piece: self, polynomials }
    }

    /// Angles and rates at a time within the piece, bit for bit those of [`Self::sample_at`].
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

    /// Positions of head and tip at a time within the piece, bit for bit those of [`Self::sample_at`],
    /// without the cost of forces and energies.
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
                BladePoints {
                    head_x_m: head.position_m,
                    head_drop_m: linkage.drop_in_flight(&state, &d).0,
                    tip_x_m: linkage.tip_position_m(&d, &head),
                    tip_height_m: state.gap_m,
                }
            }
        }
    }

    /// State of the model at a time within the piece.
    #[must_use]
    pub fn sample_at(&self, t: f64) -> ModelSample {
        match &self.solution {
            SegmentSolution::Slip(slip, step) => {
                let pose = pose_from_states(&state_in_step(step, t));
                let at = slip.system.contact_instant(t, &pose, slip.lean);
                let (speed, forces) = slip.slip_forces(&pose, &at);
                let velocity = slip.direction * speed;
                self.assemble_sample(t, slip.system, slip.lean, pose, &at, &forces, velocity, 0.0)
            }
            SegmentSolution::Stick(stick, step) => {
                let (pose, at) = stick.contact_instant(t, &state_in_step(step, t));
                let (forces, d) = (stick.holding_forces(&at), LinkDirections::from_pose(&pose));
                let drift = stick.system.linkage.tip_position_m(&d, &at.head) - stick.place_m;
                self.assemble_sample(t, stick.system, stick.lean, pose, &at, &forces, 0.0, drift)
            }
            SegmentSolution::Flight(flight, step) => sample_in_flight(t, flight, &state_in_step(step, t)),
            SegmentSolution::Held(held, step) => {
                let pose = pose_from_states(&state_in_step(step, t));
                let at = held.system.contact_instant(t, &pose, held.lean);
                let forces = held.stabilised_forces(&pose, &at);
                let linkage = &held.system.linkage;
                let drift = linkage.tip_position_m(&at.directions, &at.head) - held.place_m;
                let velocity = linkage.tip_velocity_m_per_s(&pose, &at.directions, &at.head);
                self.assemble_sample(t, held.system, held.lean, pose, &at, &forces, velocity, drift)
            }
        }
    }

    #[allow(clippy::too_many_arguments)] // the quantities that all modes of contact compute
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

/// State vector at a time within a step.
fn state_in_step<const N: usize>(step: &ode::AcceptedStep<'_, N>, t: f64) -> [f64; N] {
    if t == step.end { *step.y_end } else { step.solution.state_at(t) }
}

/// State of the model in flight, without forces on the tip.
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

// Positions over a piece, and their integrals.
//
// The Taylor coefficients of a step include the velocities of head and tip and the drop. Positions are
// therefore polynomials of the time `x` since the start of the piece, and their integrals over an open
// shutter are exact:
//
// ```text
// v3(x) = v3(0) + sum v3'_(j-1) x^j / j        int v3 = v3(0) x + sum v3'_(j-1) x^(j+1) / (j (j+1))
// ```
//
// Other methods provide no such coefficients: positions follow from the angles, and an integral follows from
// the positions at five instants.

/// `1 / j`, and 0 for `j = 0`.
const RECIPROCALS: [f64; TERMS + 4] = {
    let mut share = [0.0; TERMS + 4];
    let mut j = 1;
    while j < share.len() {
        share[j] = 1.0 / j as f64;
        j += 1;
    }
    share
};

/// Positions of head and tip over a piece of the solution; one path is used for all times within the piece.
pub struct SegmentPath<'a> {
    piece: &'a SolutionSegment<'a>,
    polynomials: Option<PathPolynomials<'a>>,
}

/// Positions as polynomials of the time since the start of a piece.
struct PathPolynomials<'a> {
    motion: &'a TaylorMotion,
    start: [f64; 4],
    /// Whether the tip sticks.
    sticks: bool,
}

impl SegmentPath<'_> {
    /// Positions of head and tip at a time within the piece.
    #[inline]
    #[must_use]
    pub fn points_at(&self, t: f64) -> BladePoints {
        self.polynomials.as_ref().map_or_else(
            || self.piece.points_at(t),
            |polynomials| BladePoints::from_array(polynomials.values_after(t - self.piece.start_s)),
        )
    }

    /// Integral of the positions between two times within the piece, m s.
    #[inline]
    #[must_use]
    pub fn integrate_points(&self, from_s: f64, to_s: f64) -> BladePoints {
        let start_s = self.piece.start_s;
        BladePoints::from_array(match &self.polynomials {
            Some(polynomials) => polynomials.integrate_values(from_s - start_s, to_s - start_s),
            None => gauss_legendre::nodes_and_weights(from_s, to_s).fold([0.0; 4], |sum, (t, weight)| {
                let values = self.piece.points_at(t).to_array();
                four_values(|i| sum[i] + weight * values[i])
            }),
        })
    }
}

impl<'a> PathPolynomials<'a> {
    /// The polynomials of a piece; `None` for stick of the fixed-step scheme.
    fn from_segment(piece: &SolutionSegment<'a>, motion: &'a TaylorMotion) -> Option<Self> {
        let (system, height, held): (&DrivenBlade, f64, Option<f64>) = match &piece.solution {
            SegmentSolution::Slip(slip, _) => (slip.system, 0.0, None),
            SegmentSolution::Stick(stick, _) => (stick.system, 0.0, Some(stick.place_m)),
            SegmentSolution::Flight(flight, step) => {
                (flight.system, step.solution.state_at(piece.start_s)[2], None)
            }
            SegmentSolution::Held(..) => return None,
        };
        let head = system.drive.motion_at(piece.start_s).position_m;
        let ([neck, lip], linkage) = (motion.sines(0), &system.linkage);
        let tip = held.unwrap_or(head + linkage.l1_m * neck + linkage.l2_m * lip);
        Some(Self { motion, start: [head, motion.drop_m[0], tip, height], sticks: held.is_some() })
    }

    /// Coefficients of `x^j` in the positions, for `j > 0`.
    #[inline(always)]
    fn coefficients_of(&self, j: usize) -> [f64; 4] {
        let TaylorMotion { head_velocity, drop_m, tip_velocity, gap_rate, .. } = self.motion;
        let share = RECIPROCALS[j];
        [share * head_velocity[j - 1], drop_m[j], share * tip_velocity[j - 1], share * gap_rate[j - 1]]
    }

    #[inline]
    fn values_after(&self, x: f64) -> [f64; 4] {
        let mut sum = [0.0; 4];
        for j in (1..=self.motion.order).rev() {
            let row = self.coefficients_of(j);
            sum = four_values(|i| sum[i] * x + row[i]);
        }
        self.add_start(1.0, four_values(|i| sum[i] * x))
    }

    #[inline]
    fn integrate_values(&self, from: f64, to: f64) -> [f64; 4] {
        let (mut low, mut high) = ([0.0; 4], [0.0; 4]);
        for j in (1..=self.motion.order).rev() {
            let (row, share) = (self.coefficients_of(j), RECIPROCALS[j + 1]);
            low = four_values(|i| low[i] * from + share * row[i]);
            high = four_values(|i| high[i] * to + share * row[i]);
        }
        self.add_start(to - from, four_values(|i| high[i] * to * to - low[i] * from * from))
    }

    /// Adds `change`, the change of the positions since the start of the piece, to `weight` times the
    /// positions at the start; a tip in stick does not move.
    #[inline]
    fn add_start(&self, weight: f64, mut change: [f64; 4]) -> [f64; 4] {
        const TIP: usize = 2;
        if self.sticks {
            change[TIP] = 0.0;
        }
        four_values(|i| self.start[i] * weight + change[i])
    }
}

#[inline(always)]
fn four_values(f: impl Fn(usize) -> f64) -> [f64; 4] {
    [f(0), f(1), f(2), f(3)]
}
