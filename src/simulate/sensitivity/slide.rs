//! How the equilibrium of steady slip moves with the parameters.

use super::difference::{SHARE, derivative};
use super::seeds::BlockSeed;
use crate::blade::shoulder::Lean;
use crate::blade::tangent::{LANES, Row};
use crate::blade::{Linkage, Pose};
use crate::simulate::equilibrium::moments;
use crate::simulate::phases::System;
use nalgebra::{Matrix2, Vector2};

/// Derivatives of both angles of steady slip: `J d q + dR = 0` for the moments `R(q, p)`; `None` where the
/// equilibrium turns back.
///
/// `d_speed` are the derivatives of the head's velocity, m/s.
pub(super) fn steady_slide(
    system: &System,
    seed: &BlockSeed,
    lean: Lean,
    pose: &Pose,
    speed: f64,
    d_speed: Row,
) -> Option<[Row; 2]> {
    let linkage = &system.linkage;
    let angles = Vector2::new(pose.theta, pose.phi);
    let mu = |linkage: &Linkage, speed: f64| speed.signum() * linkage.friction.dynamic(speed.abs());
    let column = |direction: Vector2<f64>| {
        let at = |x: f64| Some(moments(linkage, mu(linkage, speed), &(angles + x * direction), lean).into());
        derivative(SHARE, at).map(|column: [f64; 2]| Vector2::from(column))
    };
    let jacobian = Matrix2::from_columns(&[column(Vector2::x())?, column(Vector2::y())?]).lu();
    let mut moved = [Row::ZERO; 2];
    for lane in 0..LANES {
        let at = |x: f64| {
            let linkage = seed.linkage.as_ref().map_or(*linkage, |own| own.along(linkage, lane, x));
            Some(moments(&linkage, mu(&linkage, speed + x * d_speed[lane]), &angles, lean).into())
        };
        let step = SHARE / seed.relative[lane].max((d_speed[lane] / speed).abs());
        if step.is_finite() {
            let by_direction: [f64; 2] = derivative(step, at)?;
            let solution = jacobian.solve(&-Vector2::from(by_direction))?;
            (moved[0][lane], moved[1][lane]) = (solution[0], solution[1]);
        }
    }
    Some(moved)
}
