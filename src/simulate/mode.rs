//! Modes of contact, and the next mode of a tip at rest on the glass, which is a pure function of the forces.

use crate::model::FrictionResponse;
use crate::model::friction::FrictionLaw;
use serde::Serialize;

/// Mode of contact of the tip.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum TipMode {
    /// The tip is held at its position.
    #[serde(rename = "stick")]
    Stick,
    /// The tip slides towards +v.
    #[serde(rename = "slip+")]
    SlipForward,
    /// The tip slides towards -v.
    #[serde(rename = "slip-")]
    SlipBackward,
    /// The tip is off the glass.
    #[serde(rename = "flight")]
    Flight,
}

impl TipMode {
    /// Name of the mode in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Stick => "stick",
            Self::SlipForward => "slip+",
            Self::SlipBackward => "slip-",
            Self::Flight => "flight",
        }
    }

    /// Sign of the tip's velocity in this mode.
    #[must_use]
    pub fn direction(self) -> f64 {
        match self {
            Self::SlipForward => 1.0,
            Self::SlipBackward => -1.0,
            Self::Stick | Self::Flight => 0.0,
        }
    }

    /// The mode of slip in a direction.
    pub(crate) fn slip_towards(direction: f64) -> Self {
        if direction < 0.0 { Self::SlipBackward } else { Self::SlipForward }
    }
}

/// Next mode of a tip at rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RestDecision {
    /// The tip takes the only consistent mode.
    Becomes(TipMode),
    /// More than one mode is consistent with the forces.
    Indeterminate,
    /// No mode is consistent: the tip jams.
    Jammed,
}

/// Friction force that holds a tip at rest, N.
#[must_use]
pub fn holding_force(contact: &FrictionResponse) -> f64 {
    -contact.a_free / contact.kappa
}

/// Decides the next mode of a tip at rest.
///
/// Let `mu` be the larger of the static coefficients of both directions. If `mu |nu| < 1`, the mode is stick
/// if the holding force is within the static limit and the glass presses on the tip, lift-off if the glass
/// would have to pull, otherwise slip against the holding force. If not (the Painlevé region), the
/// consistency of every mode is tested.
///
/// If the holding force is between the limit of slip at zero speed and a larger static limit, slip is
/// consistent too, but a tip at rest stays until the static limit is passed. So slip with a positive Painlevé
/// indicator does not count as a second mode.
pub(crate) fn decide_mode_at_rest(contact: &FrictionResponse, law: &FrictionLaw) -> RestDecision {
    let force = holding_force(contact);
    let normal = contact.n_free + contact.nu * force;
    let towards = TipMode::slip_towards(-force);
    let sticks = normal > 0.0 && force.abs() <= law.static_coefficient(towards.direction()) * normal;
    let largest = law.static_coefficient(1.0).max(law.static_coefficient(-1.0));
    if (largest * contact.nu).abs() < 1.0 {
        return RestDecision::Becomes(match () {
            () if sticks => TipMode::Stick,
            () if contact.n_free <= 0.0 => TipMode::Flight,
            () => towards,
        });
    }
    let slips = |mode: TipMode| {
        let (direction, mu) = (mode.direction(), law.limit_at_zero(mode.direction()));
        let waits = sticks && law.static_ratio > 1.0 && 1.0 + direction * mu * contact.nu > 0.0;
        (is_slip_consistent(contact, mu, direction) && !waits, mode)
    };
    let consistent = [
        (sticks, TipMode::Stick),
        slips(TipMode::SlipForward),
        slips(TipMode::SlipBackward),
        (contact.n_free < 0.0, TipMode::Flight),
    ];
    let mut modes = consistent.into_iter().filter(|(holds, _)| *holds).map(|(_, mode)| mode);
    match (modes.next(), modes.next()) {
        (Some(mode), None) => RestDecision::Becomes(mode),
        (Some(_), Some(_)) => RestDecision::Indeterminate,
        (None, _) => RestDecision::Jammed,
    }
}

/// Whether slip in a direction gives a normal force that presses and an acceleration in the same direction.
fn is_slip_consistent(contact: &FrictionResponse, mu: f64, direction: f64) -> bool {
    let indicator = 1.0 + direction * mu * contact.nu;
    let normal = contact.n_free / indicator;
    normal > 0.0 && direction * (contact.a_free - contact.kappa * direction * mu * normal) > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn contact(a_free: f64, n_free: f64, nu: f64) -> FrictionResponse {
        FrictionResponse { free: [0.0; 2], per_force: [0.0; 2], a_free, kappa: 2.0, n_free, nu }
    }

    fn coulomb(mu: f64) -> FrictionLaw {
        FrictionLaw::exponential(0.0, 0.0, mu)
    }

    #[test]
    fn the_holding_force_within_the_limit_sticks_and_beyond_it_slips_against_it() {
        // a force of 0.5 N holds the tip, and static friction can give up to 0.6 N
        assert_eq!(
            decide_mode_at_rest(&contact(1.0, 1.0, 0.0), &coulomb(0.6)),
            RestDecision::Becomes(TipMode::Stick)
        );
        assert_eq!(
            decide_mode_at_rest(&contact(1.0, 1.0, 0.0), &coulomb(0.4)),
            RestDecision::Becomes(TipMode::SlipForward)
        );
        assert_eq!(
            decide_mode_at_rest(&contact(-1.0, 1.0, 0.0), &coulomb(0.4)),
            RestDecision::Becomes(TipMode::SlipBackward)
        );
        assert_eq!(
            decide_mode_at_rest(&contact(1.0, -1.0, 0.0), &coulomb(0.4)),
            RestDecision::Becomes(TipMode::Flight)
        );
    }

    #[test]
    fn without_a_consistent_mode_the_tip_jams_and_with_several_it_is_indeterminate() {
        assert_eq!(
            decide_mode_at_rest(&contact(0.1, -1.0, 3.0), &coulomb(1.0)),
            RestDecision::Becomes(TipMode::Flight)
        );
        assert_eq!(
            decide_mode_at_rest(&contact(-1.0, -1.0, 3.0), &coulomb(1.0)),
            RestDecision::Indeterminate
        );
    }

    /// A holding force of 0.5 N lies between the limit of slip, 0.4 N, and the static limit, 0.6 N: the tip
    /// stays. In the Painlevé region too, unless the tip could also lift off.
    #[test]
    fn a_tip_at_rest_stays_until_the_static_limit_is_passed() {
        let law = FrictionLaw { static_ratio: 1.5, ..coulomb(0.4) };
        for nu in [0.0, 1.0, 2.0] {
            // (the normal force in stick is 1 N in all of them)
            let held = contact(1.0, 1.0 + 0.5 * nu, nu);
            assert!(is_slip_consistent(&held, 0.4, 1.0), "{nu}");
            assert_eq!(decide_mode_at_rest(&held, &law), RestDecision::Becomes(TipMode::Stick), "{nu}");
        }
        assert_eq!(decide_mode_at_rest(&contact(-1.0, -0.1, 2.2), &law), RestDecision::Indeterminate);
        let steep = FrictionLaw { backward_ratio: 0.5, ..law };
        let pushed = |a_free| decide_mode_at_rest(&contact(a_free, 1.0, 0.0), &steep);
        assert_eq!(pushed(1.0), RestDecision::Becomes(TipMode::Stick));
        assert_eq!(pushed(-1.0), RestDecision::Becomes(TipMode::SlipBackward));
    }

    proptest! {
        /// Outside the Painlevé region exactly one mode is consistent, and the decision returns it.
        #[test]
        fn one_mode_is_consistent_outside_the_painleve_region(
            a in -5.0..5.0f64,
            n in -5.0..5.0f64,
            nu in -2.0..2.0f64,
            mu in 0.0..1.0f64,
        ) {
            prop_assume!((mu * nu).abs() < 0.999 && a.abs() > 1e-6 && n.abs() > 1e-6);
            let contact = contact(a, n, nu);
            let force = holding_force(&contact);
            let normal = n + nu * force;
            prop_assume!((force.abs() - mu * normal).abs() > 1e-9);
            let holds = [
                (normal > 0.0 && force.abs() <= mu * normal, TipMode::Stick),
                (is_slip_consistent(&contact, mu, 1.0), TipMode::SlipForward),
                (is_slip_consistent(&contact, mu, -1.0), TipMode::SlipBackward),
                (n < 0.0, TipMode::Flight),
            ];
            let modes: Vec<TipMode> = holds.iter().filter(|h| h.0).map(|h| h.1).collect();
            prop_assert_eq!(modes.len(), 1);
            prop_assert_eq!(decide_mode_at_rest(&contact, &coulomb(mu)), RestDecision::Becomes(modes[0]));
        }
    }
}
