//! How the equilibrium of steady slip moves with the parameters.

use super::difference::{DIFFERENCE_STEP, central_difference};
use super::seeds::BlockSeed;
use crate::blade::shoulder::ShoulderContact;
use crate::blade::tangent::{LANES, LaneVector};
use crate::blade::{Linkage, Pose};
use crate::simulate::equilibrium::residual_moments;
use crate::simulate::phases::DrivenBlade;
use nalgebra::{Matrix2, Vector2};

/// Derivatives of both angles of steady slip: `J d q + dR = 0` for the moments `R(q, p)`; `None` where the
/// equilibrium turns back.
///
/// `d_speed` are the derivatives of the head's velocity, m/s.
pub(super) fn steady_slip_tangent(
    system: &DrivenBlade,
    seed: &BlockSeed,
    lean: ShoulderContact,
    pose: &Pose,
    speed: f64,
    d_speed: LaneVector,
) -> Option<[LaneVector; 2]> {
    let linkage = &system.linkage;
    let angles = Vector2::new(pose.theta, pose.phi);
    let mu =
        |linkage: &Linkage, speed: f64| speed.signum() * linkage.friction.dynamic_coefficient(speed.abs());
    let column = |direction: Vector2<f64>| {
        let at = |x: f64| {
            Some(residual_moments(linkage, mu(linkage, speed), &(angles + x * direction), lean).into())
        };
        central_difference(DIFFERENCE_STEP, at).map(|column: [f64; 2]| Vector2::from(column))
    };
    let jacobian = Matrix2::from_columns(&[column(Vector2::x())?, column(Vector2::y())?]).lu();
    let mut moved = [LaneVector::ZERO; 2];
    for lane in 0..LANES {
        let at = |x: f64| {
            let linkage =
                seed.linkage.as_ref().map_or(*linkage, |own| own.displace_linkage(linkage, lane, x));
            Some(residual_moments(&linkage, mu(&linkage, speed + x * d_speed[lane]), &angles, lean).into())
        };
        let step = DIFFERENCE_STEP / seed.relative[lane].max((d_speed[lane] / speed).abs());
        if step.is_finite() {
            let by_direction: [f64; 2] = central_difference(step, at)?;
            let solution = jacobian.solve(&-Vector2::from(by_direction))?;
            (moved[0][lane], moved[1][lane]) = (solution[0], solution[1]);
        }
    }
    Some(moved)
}
