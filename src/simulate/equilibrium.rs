//! Steady slip: the static equilibrium of a blade whose head moves at constant speed.

use crate::model::shoulder::ShoulderContact;
use crate::model::{HeadMotion, LinkDirections, Linkage, Pose};
use nalgebra::{Matrix2, Vector2};
use portable_math as math;

/// Angles of neck and lip, rad, or moments on them, N m.
type Pair = Vector2<f64>;

/// Number of steps in which friction rises from zero to its value, so that each Newton iteration starts near
/// its solution.
const LOAD_STEPS: u32 = 64;
const MOST_ITERATIONS: u32 = 50;
/// The iteration has converged if the residual moment is below this multiple of the sum of the stiffnesses of
/// neck and lip, times one radian.
const RESIDUAL: f64 = 1e-14;

/// Pose of static equilibrium (all accelerations zero) while the tip slides at the head's speed, m/s, with
/// the friction at this speed. `None` if the head is at rest, if no such pose with both links above level
/// exists, or if the glass would have to pull the tip.
#[must_use]
pub fn steady_slip_pose(linkage: &Linkage, speed_m_per_s: f64) -> Option<Pose> {
    if speed_m_per_s == 0.0 {
        return None;
    }
    let head = HeadMotion { position_m: 0.0, velocity_m_per_s: speed_m_per_s, acceleration_m_per_s2: 0.0 };
    let direction = speed_m_per_s.signum();
    let mu = direction * linkage.friction.dynamic_coefficient(speed_m_per_s.abs(), direction);
    let pose = StaticPose::UPRIGHT.change_friction(linkage, mu)?.pose();
    let (d, lean) = (LinkDirections::from_pose(&pose), shoulder_contact(linkage, pose.theta));
    let is_pressed = linkage.friction_response(&pose, &d, &head, lean).n_free > 0.0;
    (is_pressed && is_upright(&pose)).then_some(pose)
}

/// Whether both links are above level.
pub(crate) fn is_upright(pose: &Pose) -> bool {
    [pose.theta, pose.phi].iter().all(|angle| angle.abs() < std::f64::consts::FRAC_PI_2)
}

/// A static equilibrium and its coefficient of friction. Small steps of friction lead from it to others.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StaticPose {
    /// Coefficient of friction, with the sign of the tip's velocity.
    mu: f64,
    angles: Pair,
}

impl StaticPose {
    /// The upright blade, which is in equilibrium without friction.
    pub(crate) const UPRIGHT: Self = Self { mu: 0.0, angles: Vector2::new(0.0, 0.0) };

    /// The equilibrium that the blade reaches when the friction changes slowly to another coefficient, which
    /// has the sign of the tip's velocity. `None` if the equilibrium is lost on the way.
    pub(crate) fn change_friction(&self, linkage: &Linkage, mu: f64) -> Option<Self> {
        let largest = mu.abs().max(self.mu.abs()).max(f64::MIN_POSITIVE);
        let steps = (f64::from(LOAD_STEPS) * ((mu - self.mu).abs() / largest)).ceil().max(1.0);
        let angles = (1..=steps as u32).try_fold(self.angles, |angles, step| {
            solve_for_load(linkage, self.mu + (mu - self.mu) * f64::from(step) / steps, angles)
        })?;
        Some(Self { mu, angles })
    }

    /// The first equilibrium with both links above level that Newton's iteration finds from a grid of start
    /// angles, the smallest first. A blade that snaps over while friction grows can have such an equilibrium
    /// beyond the snap.
    pub(crate) fn search_grid(linkage: &Linkage, mu: f64) -> Option<Self> {
        /// Start angles of each link, rad, against the direction of slip.
        const GRID: [f64; 6] = [0.0, 0.15, 0.3, 0.5, 0.8, 1.2];
        let starts = GRID.into_iter().flat_map(|lip| GRID.map(|neck| Vector2::new(neck, lip)));
        let mut found = starts.filter_map(|start| solve_for_load(linkage, mu, -mu.signum() * start));
        let angles = found.find(|angles| is_upright(&pose_at_rest(angles)))?;
        Some(Self { mu, angles })
    }

    /// The equilibrium for the same friction with the neck on the given side of the shoulder; `None` if there
    /// is none.
    pub(crate) fn lean_on_side(&self, linkage: &Linkage, side: ShoulderContact) -> Option<Self> {
        let found = solve_newton(linkage, self.mu, self.angles, side)?;
        (shoulder_contact(linkage, found[0]) == side).then_some(Self { angles: found, ..*self })
    }

    /// The pose, at rest relative to the head.
    pub(crate) fn pose(&self) -> Pose {
        pose_at_rest(&self.angles)
    }
}

/// Largest coefficient of friction that is tried; it is reached from 0 in [`FRICTIONS`] equal steps.
const MOST_FRICTION: f64 = 1.5;
const FRICTIONS: u32 = 300;

/// Equilibria in slow slip, in order of deflection. Each is a pair: the coefficient of friction, with the
/// sign of the tip's velocity, and the deflection `tip_x - head_x`, m.
///
/// In each direction, the list ends where no equilibrium exists or where a larger coefficient no longer
/// increases the deflection.
pub(crate) fn static_deflections(linkage: &Linkage) -> Vec<(f64, f64)> {
    let one_way = |sign: f64| {
        let mut angles = Vector2::zeros();
        let mut found: Vec<(f64, f64)> = Vec::new();
        for step in 0..=FRICTIONS {
            let mu = sign * MOST_FRICTION * f64::from(step) / f64::from(FRICTIONS);
            let Some(next) = solve_for_load(linkage, mu, angles) else { break };
            angles = next;
            let d = LinkDirections::from_pose(&pose_at_rest(&angles));
            let deflection_m = linkage.l1_m * d.sin_theta + linkage.l2_m * d.sin_phi;
            if found.last().is_some_and(|(_, before_m)| deflection_m.abs() <= before_m.abs()) {
                break;
            }
            found.push((mu, deflection_m));
        }
        found
    };
    let mut all = one_way(1.0);
    all.extend(one_way(-1.0).into_iter().skip(1));
    math::sort_by_number(&mut all, |a| a.1);
    all
}

fn pose_at_rest(angles: &Pair) -> Pose {
    Pose { theta: angles[0], phi: angles[1], theta_rate: 0.0, phi_rate: 0.0 }
}

/// Side of the shoulder on which the neck leans at an angle, rad.
pub(crate) fn shoulder_contact(linkage: &Linkage, theta: f64) -> ShoulderContact {
    linkage.shoulder.map_or(ShoulderContact::Off, |s| s.contact_at(theta))
}

/// The equilibrium for one coefficient of friction. Each iteration keeps the side of the shoulder fixed,
/// because Newton's steps could otherwise cycle across the kink at the corner of the shoulder.
pub(super) fn solve_for_load(linkage: &Linkage, mu: f64, angles: Pair) -> Option<Pair> {
    if let Some(slider) = linkage.slider() {
        let deflection_m = -mu * slider.normal_force_n / slider.spring.stiffness;
        return deflection_m.is_finite().then(|| {
            let pose = Pose::of_slider(deflection_m, 0.0);
            Vector2::new(pose.theta, pose.phi)
        });
    }
    let here = shoulder_contact(linkage, angles[0]);
    let sides = [here, ShoulderContact::Off, ShoulderContact::Forward, ShoulderContact::Backward];
    let count = if linkage.shoulder.is_some() { sides.len() } else { 1 };
    sides.into_iter().take(count).find_map(|side| {
        solve_newton(linkage, mu, angles, side).filter(|found| shoulder_contact(linkage, found[0]) == side)
    })
}

fn solve_newton(linkage: &Linkage, mu: f64, mut angles: Pair, side: ShoulderContact) -> Option<Pair> {
    let scale = linkage.neck.stiffness + linkage.lip.stiffness;
    for _ in 0..MOST_ITERATIONS {
        let residual = residual_moments(linkage, mu, &angles, side);
        if !residual.iter().all(|r| r.is_finite()) {
            return None;
        }
        if residual.amax() <= RESIDUAL * scale {
            return Some(angles);
        }
        let step = moment_jacobian(linkage, mu, &angles, side).lu().solve(&residual)?;
        if step.amax() <= 4.0 * f64::EPSILON {
            return Some(angles);
        }
        angles -= step;
    }
    None
}

/// Residual moments of springs, normal force and friction on neck and lip at rest, N m: equations (1) and (2)
/// of [`crate::model`] without rates.
pub(super) fn residual_moments(linkage: &Linkage, mu: f64, angles: &Pair, side: ShoulderContact) -> Pair {
    let pose = pose_at_rest(angles);
    let d = LinkDirections::from_pose(&pose);
    let normal = linkage.head.stiffness * (linkage.preload_displacement_m - linkage.head_drop_m(&d));
    let friction = -mu * normal;
    let lip = linkage.lip.stiffness * (pose.phi - pose.theta);
    let shoulder = linkage
        .shoulder
        .filter(|_| side != ShoulderContact::Off)
        .map_or(0.0, |s| s.moment(pose.theta, 0.0, side.angle_sign()));
    Vector2::new(
        linkage.neck.stiffness * pose.theta + shoulder
            - lip
            - linkage.l1_m * (normal * d.sin_theta + friction * d.cos_theta),
        lip - linkage.l2_m * (normal * d.sin_phi + friction * d.cos_phi),
    )
}

fn moment_jacobian(linkage: &Linkage, mu: f64, angles: &Pair, side: ShoulderContact) -> Matrix2<f64> {
    /// Step of the central difference, rad: the cube root of machine precision.
    const STEP: f64 = 6e-6;
    let column = |i: usize| {
        let (mut ahead, mut behind) = (*angles, *angles);
        ahead[i] += STEP;
        behind[i] -= STEP;
        (residual_moments(linkage, mu, &ahead, side) - residual_moments(linkage, mu, &behind, side))
            / (2.0 * STEP)
    };
    Matrix2::from_columns(&[column(0), column(1)])
}

/// Angles of neck and lip of a blade at rest, with whatever friction force equilibrium requires, for which
/// the tip is at the distance `lean` from the head along the sweep. They are used if the drop is not tracked.
pub(crate) fn equilibrium_angles(linkage: &Linkage, lean: f64) -> Option<[f64; 2]> {
    if linkage.is_slider() {
        let Pose { theta, phi, .. } = Pose::of_slider(lean, 0.0);
        return Some([theta, phi]);
    }
    /// Largest neck angle, rad, that is tried.
    const LARGEST_RAD: f64 = 0.7;
    /// Number of neck angles that are tried.
    const POINTS: usize = 140;
    let side = 1f64.copysign(lean);
    let phi_of = |theta: f64| {
        let sine = (lean - linkage.l1_m * math::sin(theta)) / linkage.l2_m;
        (sine.abs() < 0.98).then(|| math::asin(sine))
    };
    let moment = |theta: f64| Some(neck_moment(linkage, theta, phi_of(theta)?));
    let grid = |k: usize| side * LARGEST_RAD * k as f64 / POINTS as f64;
    let bracket = (0..POINTS).find(
        |&k| matches!((moment(grid(k)), moment(grid(k + 1))), (Some(a), Some(b)) if (a > 0.0) != (b > 0.0)),
    )?;
    let (mut low, mut high) = (grid(bracket), grid(bracket + 1));
    let positive = moment(low)? > 0.0;
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if (moment(middle)? > 0.0) == positive {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some([low, phi_of(low)?])
}

/// Unbalanced moment on the neck of a blade at rest, if the friction at the tip balances the lip.
fn neck_moment(linkage: &Linkage, theta: f64, phi: f64) -> f64 {
    let (l1, l2) = (linkage.l1_m, linkage.l2_m);
    let drop = l1 * (1.0 - math::cos(theta)) + l2 * (1.0 - math::cos(phi));
    let normal = linkage.head.stiffness * (linkage.preload_displacement_m - drop);
    let lip = linkage.lip.stiffness * (phi - theta);
    let friction = (lip - normal * l2 * math::sin(phi)) / (l2 * math::cos(phi));
    let shoulder = linkage.shoulder.map_or(0.0, |s| match s.contact_at(theta).angle_sign() {
        0.0 => 0.0,
        sign => s.moment(theta, 0.0, sign),
    });
    linkage.neck.stiffness * theta + shoulder
        - lip
        - normal * l1 * math::sin(theta)
        - friction * l1 * math::cos(theta)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::scene::Scene;

    /// A blade in steady slip is at rest relative to its head, so its lean gives its pose without the law of
    /// friction.
    #[test]
    fn the_lean_of_a_steady_slip_gives_its_pose() {
        let scenes = [
            include_str!("../../data/scenes/actual-blade.toml"),
            include_str!("../../data/scenes/another-blade.toml"),
        ];
        for text in scenes {
            let linkage = Scene::parse("scene.toml", text).unwrap().linkage;
            for speed in [-0.4, -0.1, 0.05, 0.2, 0.5] {
                let pose = steady_slip_pose(&linkage, speed).unwrap();
                let lean = linkage.l1_m * math::sin(pose.theta) + linkage.l2_m * math::sin(pose.phi);
                let [theta, phi] = equilibrium_angles(&linkage, lean).unwrap();
                let error = (theta - pose.theta).abs().max((phi - pose.phi).abs());
                assert!(error < 1e-9, "{speed} m/s: {theta} {phi}, expected {pose:?}");
            }
        }
    }

    /// These values make Newton's steps cycle across the shoulder's corner.
    #[test]
    fn an_equilibrium_next_to_the_shoulders_corner_is_found() {
        let scene =
            Scene::parse("actual-blade.toml", include_str!("../../data/scenes/actual-blade.toml")).unwrap();
        let scene = scene
            .with_parameter("friction.c", 0.30985)
            .and_then(|s| s.with_parameter("blade.neck_stiffness_n_m_per_rad", 0.0019698))
            .unwrap();
        let speed = scene.drive.motion_at(scene.start_s).velocity_m_per_s;
        let pose = steady_slip_pose(&scene.linkage, speed).expect("an equilibrium");
        let mu = scene.linkage.friction.dynamic_coefficient(speed, 1.0);
        let left = residual_moments(
            &scene.linkage,
            mu,
            &Vector2::new(pose.theta, pose.phi),
            shoulder_contact(&scene.linkage, pose.theta),
        )
        .amax();
        assert!(left < 1e-12 * scene.linkage.neck.stiffness, "{left:e} N m left");
    }
}
