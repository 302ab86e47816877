//! Impact at a single contact with Coulomb friction, integrated over the normal impulse (Routh's method;
//! Keller, J. Appl. Mech. 53, 1986).
//!
//! An impact takes no time: positions and finite forces do not change, while the impulse on the tip grows.
//! With the inverse contact mass `W` and the normal impulse `p` as the independent variable,
//!
//! ```text
//! dv_n/dp = W_nn + W_nt lambda     dv_t/dp = W_nt + W_tt lambda
//! slip:   lambda = -sigma mu(|v_t|), sigma = sign v_t
//! stick:  lambda = -W_nt / W_tt, if that is at most the static limit in size;
//!         otherwise the tip slips on in the direction of W_nt
//! ```
//!
//! Compression lasts while `v_n < 0`. Restitution lasts until the normal force has given back the fraction
//! `e^2` of the work that compression took (Stronge's energetic coefficient, Impact Mechanics, chapter 3), so
//! that an impact never gains energy.
//!
//! The same integration resolves the Painlevé paradox as an impact without collision: in slip with
//! `W_nn - sigma mu W_nt <= 0`, compression grows by itself from `v_n = 0`. This compression ends: since
//! `sigma W_nt >= W_nn / mu` and `W_nt^2 < W_nn W_tt`, the tip is braked at `sigma dv_t/dp < 0` down to rest.
//! There, `|W_nt| < mu W_tt` lets the tip stick, and restitution follows at the rate
//! `W_nn - W_nt^2 / W_tt > 0`.

use crate::model::flight::FlightState;
use crate::model::friction::FrictionLaw;
use crate::model::{LinkDirections, Linkage, Pose};
use hybrid_ode as ode;
use hybrid_ode::{HybridPhase, PhaseEndCause, PhaseStart, WorkCounters};
use portable_math as math;

/// Inverse contact mass `W` of the tip, 1/kg.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InverseMass {
    /// `W_nn`: normal velocity per normal impulse.
    pub nn: f64,
    /// `W_nt`: normal velocity per tangential impulse, and tangential velocity per normal impulse.
    pub nt: f64,
    /// `W_tt`: tangential velocity per tangential impulse.
    pub tt: f64,
}

/// Restitution and friction of a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactSurface {
    /// Friction law, the same as in slip.
    pub friction: FrictionLaw,
    /// Stronge's energetic coefficient of restitution, 0 to 1.
    pub restitution: f64,
}

/// Velocity of the tip, m/s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TipVelocity {
    /// Component of the velocity away from the glass, m/s.
    pub normal: f64,
    /// Component of the velocity along the sweep, m/s.
    pub tangential: f64,
}

/// Result of an impact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImpactOutcome {
    /// Velocity of the tip after the impact; exactly zero for a tip at rest.
    pub velocity: TipVelocity,
    /// Normal and tangential impulse on the tip, N s.
    pub impulse_n_s: [f64; 2],
    /// Energy lost in the contact, J.
    pub lost_j: f64,
}

/// Cause of an impact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ImpactOrigin {
    /// The tip strikes the glass with the normal velocity `v_n <= 0`.
    Collision,
    /// The tip slides on the glass, `v_n = 0`, and no finite force is admissible.
    Jam,
}

/// Solves an impact from the velocity `before`; `None` if the integration yields numbers that are not finite.
///
/// `relative` is the relative tolerance of the integration.
#[must_use]
pub fn solve_impact(
    mass: &InverseMass,
    surface: &ContactSurface,
    before: TipVelocity,
    origin: ImpactOrigin,
    relative: f64,
    work: &mut WorkCounters,
) -> Option<ImpactOutcome> {
    /// If the ratio of tangential to normal velocity exceeds this value, the tangential velocity sets the
    /// unit of velocity, so that the ratio stays finite.
    const FLATTEST: f64 = 1e12;
    let unit = before.normal.abs().max(before.tangential.abs() / FLATTEST);
    let unit = if origin == ImpactOrigin::Jam { before.tangential.abs() } else { unit };
    if unit == 0.0 || (origin == ImpactOrigin::Collision && before.normal >= 0.0) {
        return Some(ImpactOutcome { velocity: before, impulse_n_s: [0.0; 2], lost_j: 0.0 });
    }
    let ContactSurface { friction, restitution } = *surface;
    let friction = friction.with_speed_unit(unit);
    let (cross, along) = (mass.nt / mass.nn, mass.tt / mass.nn);
    let blow = ScaledImpact { cross, along, friction, restitution, relative };
    let mut state = ImpactState {
        impulse: 0.0,
        normal: before.normal / unit,
        tangential: before.tangential / unit,
        taken: 0.0,
        given: 0.0,
        stage: ImpactStage::Compression,
    };
    if origin == ImpactOrigin::Jam {
        state = blow.integrate_jam(state, work)?;
    }
    let end = blow.integrate_impact(state, work)?;
    let velocity = TipVelocity { normal: unit * end.normal, tangential: unit * end.tangential };
    let normal = end.impulse * unit / mass.nn;
    let tangential = (velocity.tangential - before.tangential - mass.nt * normal) / mass.tt;
    let sums = [before.normal + velocity.normal, before.tangential + velocity.tangential];
    let lost_j = -0.5 * (normal * sums[0] + tangential * sums[1]);
    let all = [velocity.normal, velocity.tangential, normal, tangential, lost_j];
    let outcome = ImpactOutcome { velocity, impulse_n_s: [normal, tangential], lost_j };
    all.iter().all(|x| x.is_finite()).then_some(outcome)
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ImpactStage {
    Compression,
    Restitution,
    Ended,
}

/// State of an impact, with velocities in units of `unit` and impulses in units of `unit / W_nn`.
#[derive(Debug, Clone, Copy)]
struct ImpactState {
    impulse: f64,
    normal: f64,
    tangential: f64,
    /// Work that the normal force has taken up in compression, as a positive number.
    taken: f64,
    /// Work that the normal force has given back in restitution, as a positive number.
    given: f64,
    stage: ImpactStage,
}

/// An impact in dimensionless variables.
struct ScaledImpact {
    /// Ratio `W_nt / W_nn`.
    cross: f64,
    /// Ratio `W_tt / W_nn`.
    along: f64,
    friction: FrictionLaw,
    restitution: f64,
    /// Relative tolerance of the integration.
    relative: f64,
}

impl ScaledImpact {
    /// Integrates an impact to its end.
    fn integrate_impact(&self, mut state: ImpactState, work: &mut WorkCounters) -> Option<ImpactState> {
        /// Maximum number of parts of an impact: the tip slips at most twice, before and after it is at rest,
        /// and each slip has a few stages.
        const MOST_PARTS: usize = 32;
        for _ in 0..MOST_PARTS {
            if state.stage == ImpactStage::Ended {
                return Some(state);
            }
            state = match self.slip_direction(state.tangential) {
                None => self.finish_in_stick(state),
                Some(direction) => self.slip(state, direction, work)?,
            };
        }
        None
    }

    /// Direction of slip; `None` for a tip that sticks.
    fn slip_direction(&self, tangential: f64) -> Option<f64> {
        let leading = if tangential == 0.0 { self.cross } else { tangential };
        let holds = self.cross.abs() <= self.friction.static_coefficient(self.cross) * self.along;
        (tangential != 0.0 || !holds).then(|| leading.signum())
    }

    /// The state after a compression that ends during slip.
    fn end_compression(&self, state: ImpactState) -> ImpactState {
        let restores = self.remaining_work(&state) > 0.0;
        let stage = if restores { ImpactStage::Restitution } else { ImpactStage::Ended };
        ImpactState { normal: 0.0, stage, ..state }
    }

    /// Work that restitution may still give back.
    fn remaining_work(&self, state: &ImpactState) -> f64 {
        self.restitution * self.restitution * state.taken - state.given
    }

    /// The end of an impact in stick, in closed form: the normal velocity is linear in the impulse.
    fn finish_in_stick(&self, state: ImpactState) -> ImpactState {
        let growth = 1.0 - self.cross * self.cross / self.along;
        let mut at_zero = state;
        if state.stage == ImpactStage::Compression {
            at_zero.taken += 0.5 * math::powi(state.normal, 2) / growth;
            at_zero.normal = 0.0;
        }
        let gained = 2.0 * growth * self.remaining_work(&at_zero).max(0.0);
        let normal = (math::powi(at_zero.normal, 2) + gained).sqrt();
        let impulse = state.impulse + (normal - state.normal) / growth;
        ImpactState { impulse, normal, stage: ImpactStage::Ended, ..at_zero }
    }

    /// Integrates slip until the tip is at rest or the stage ends.
    fn slip(&self, state: ImpactState, direction: f64, work: &mut WorkCounters) -> Option<ImpactState> {
        let restores = state.stage == ImpactStage::Restitution;
        let slide = ImpactSlip { blow: self, direction, from: state, open: false };
        let mut zero_order = [0; 3];
        zero_order[RESTS] = u8::from(state.tangential == 0.0);
        zero_order[if restores { REOPENS } else { CLOSES }] = u8::from(state.normal == 0.0);
        let (mut next, cause) = slide.integrate(zero_order, work);
        match cause {
            PhaseEndCause::Guard(RESTS) => next.tangential = 0.0,
            PhaseEndCause::Guard(CLOSES) if restores => next.stage = ImpactStage::Ended,
            PhaseEndCause::Guard(CLOSES) => next = self.end_compression(next),
            PhaseEndCause::Guard(_) => (next.normal, next.stage) = (0.0, ImpactStage::Compression),
            PhaseEndCause::Stop | PhaseEndCause::StepTooSmall | PhaseEndCause::Interrupted => return None,
        }
        Some(next)
    }

    /// Integrates the slip of a jam until the tip is at rest. The end of a stage does not end this
    /// integration, because the normal velocity starts at a zero of unknown order: the order depends on how
    /// the Painlevé indicator vanished.
    fn integrate_jam(&self, state: ImpactState, work: &mut WorkCounters) -> Option<ImpactState> {
        let slide = ImpactSlip { blow: self, direction: state.tangential.signum(), from: state, open: true };
        let (next, cause) = slide.integrate([0; 3], work);
        let (normal, taken) = (next.normal.min(0.0), next.taken.max(0.0));
        let end = ImpactState { tangential: 0.0, normal, taken, ..next };
        (cause == PhaseEndCause::Guard(RESTS)).then_some(end)
    }
}

/// Index of a guard of slip during an impact: the tip comes to rest.
const RESTS: usize = 0;
/// Index of a guard of slip during an impact: the stage (compression or restitution) ends.
const CLOSES: usize = 1;
/// Index of a guard of slip during an impact: the tip approaches the glass again during restitution.
const REOPENS: usize = 2;

/// Slip in one direction as a function of the normal impulse.
///
/// The two states are the change of the tangential speed in the direction of slip, and the work of the normal
/// force. In a glancing impact, the change of speed is far smaller than the speed.
struct ImpactSlip<'a> {
    blow: &'a ScaledImpact,
    direction: f64,
    from: ImpactState,
    /// Whether the slip ends only when the tip is at rest.
    open: bool,
}

impl ImpactSlip<'_> {
    fn tip_speed(&self, growth: f64) -> f64 {
        self.direction * self.from.tangential + growth
    }

    /// Normal velocity that follows from both impulses; if it were integrated as a state, it would drift from
    /// this value.
    fn normal_velocity(&self, impulse: f64, growth: f64) -> f64 {
        let ScaledImpact { cross, along, .. } = *self.blow;
        let grown = impulse - self.from.impulse;
        let tangential = (self.direction * growth - cross * grown) / along;
        self.from.normal + grown + cross * tangential
    }

    fn integrate(&self, zero_order: [u8; 3], work: &mut WorkCounters) -> (ImpactState, PhaseEndCause) {
        /// Impulse at which slip counts as endless, in units of the impulse that stops the tip without
        /// friction.
        const MOST: f64 = 1e15;
        /// First trial step of the impulse, in units of the impulse that stops the tip without friction; slip
        /// usually ends within this step.
        const FIRST: f64 = 1.0;
        let start = PhaseStart { t: self.from.impulse, y: [0.0; 2], zero_order, step: Some(FIRST) };
        let end = ode::integrate(self, start, MOST, self.blow.relative, work, |_| ());
        let done = end.y[1];
        let (taken, given) =
            if self.from.stage == ImpactStage::Compression { (-done, 0.0) } else { (0.0, done) };
        let next = ImpactState {
            impulse: end.t,
            normal: self.normal_velocity(end.t, end.y[0]),
            tangential: self.direction * self.tip_speed(end.y[0]),
            taken: self.from.taken + taken,
            given: self.from.given + given,
            stage: self.from.stage,
        };
        (next, end.cause)
    }
}

impl HybridPhase<2, 3> for ImpactSlip<'_> {
    fn derivative(&self, impulse: f64, y: &[f64; 2]) -> [f64; 2] {
        let ScaledImpact { cross, along, friction, .. } = self.blow;
        [
            self.direction * cross
                - friction.dynamic_coefficient(self.tip_speed(y[0]), self.direction) * along,
            self.normal_velocity(impulse, y[0]),
        ]
    }

    fn guards(&self, impulse: f64, y: &[f64; 2]) -> [f64; 3] {
        let (normal, speed) = (self.normal_velocity(impulse, y[0]), self.tip_speed(y[0]));
        match self.from.stage {
            _ if self.open => [speed, f64::INFINITY, f64::INFINITY],
            ImpactStage::Compression => [speed, -normal, f64::INFINITY],
            ImpactStage::Restitution | ImpactStage::Ended => {
                [speed, self.blow.remaining_work(&self.from) - y[1], normal]
            }
        }
    }

    fn scale(&self) -> [f64; 2] {
        [1.0, 1.0]
    }
}

/// A strike of the tip on the glass.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TipStrike {
    pub pose: Pose,
    /// Velocity of the tip before the strike.
    pub before: TipVelocity,
    pub origin: ImpactOrigin,
    /// Energetic coefficient of restitution.
    pub restitution: f64,
}

impl TipStrike {
    /// State after the impact, and its outcome; `None` if the integration yields numbers that are not finite.
    pub(crate) fn solve_on_blade(
        &self,
        linkage: &Linkage,
        relative: f64,
        work: &mut WorkCounters,
    ) -> Option<(FlightState, ImpactOutcome)> {
        let Self { pose, before, origin, restitution } = *self;
        let [normal, along] = linkage.impulse_responses(&LinkDirections::from_pose(&pose));
        let (nn, nt, tt) = (normal.normal_per_kg, normal.tangential_per_kg, along.tangential_per_kg);
        let mass = InverseMass { nn, nt, tt };
        let surface = ContactSurface { friction: linkage.friction, restitution };
        let outcome = solve_impact(&mass, &surface, before, origin, relative, work)?;
        let [p_n, p_t] = outcome.impulse_n_s;
        let changed = |rate: f64, link: usize| rate + p_n * normal.rates[link] + p_t * along.rates[link];
        let pose =
            Pose { theta_rate: changed(pose.theta_rate, 0), phi_rate: changed(pose.phi_rate, 1), ..pose };
        Some((FlightState { pose, gap_m: 0.0, gap_rate_m_per_s: outcome.velocity.normal }, outcome))
    }
}
