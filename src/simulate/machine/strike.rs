//! What a strike of the tip on the glass makes of the blade.

use crate::blade::flight::FlightState;
use crate::blade::{LinkDirections, Linkage, Pose};
use crate::ode::WorkCounters;
use crate::simulate::impact::{
    ContactSurface, ImpactOrigin, ImpactOutcome, InverseMass, TipVelocity, solve_impact,
};

/// How the tip strikes the glass.
#[derive(Debug, Clone, Copy)]
pub struct TipStrike {
    /// Pose before.
    pub pose: Pose,
    /// Velocity of the tip before.
    pub before: TipVelocity,
    /// What begins it.
    pub origin: ImpactOrigin,
    /// The restitution that counts.
    pub restitution: f64,
}

impl TipStrike {
    /// State and impact behind it; `None` where the integration meets numbers that are not finite.
    pub fn solve_on_blade(
        &self,
        linkage: &Linkage,
        relative: f64,
        work: &mut WorkCounters,
    ) -> Option<(FlightState, ImpactOutcome)> {
        let Self { pose, before, origin, restitution } = *self;
        let [normal, along] = linkage.impulse_responses(&LinkDirections::from_pose(&pose));
        let mass = InverseMass {
            nn: normal.normal_per_kg,
            nt: normal.tangential_per_kg,
            tt: along.tangential_per_kg,
        };
        let surface = ContactSurface { friction: linkage.friction, restitution };
        let outcome = solve_impact(&mass, &surface, before, origin, relative, work)?;
        let [p_n, p_t] = outcome.impulse_n_s;
        let changed = |rate: f64, link: usize| rate + p_n * normal.rates[link] + p_t * along.rates[link];
        let pose =
            Pose { theta_rate: changed(pose.theta_rate, 0), phi_rate: changed(pose.phi_rate, 1), ..pose };
        Some((FlightState { pose, gap_m: 0.0, gap_rate_m_per_s: outcome.velocity.normal }, outcome))
    }
}
