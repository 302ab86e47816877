//! Boundaries of segments, and the states of the blade there, estimated from the recording.

use super::camera_observation::CameraObservation;
use super::segment_simulation::LinkState;
use super::unknowns::CameraParameters;
use crate::model::Linkage;
use crate::simulate::scene::Scene;
use nalgebra::{DMatrix, DVector};
use portable_math as math;

/// Smallest angle between neck and lip, rad, at which the two coordinates of the tip determine both angles.
/// In a nearly straight blade they do not.
const MIN_BEND_RAD: f64 = 0.15;
/// Smallest speed of the tip over the glass that counts as sliding, m/s. While the tip sticks, the state has
/// only three degrees of freedom.
const MIN_SPEED_M_PER_S: f64 = 0.05;
/// Half width, s, of the window of frames to which rates are fitted: a third of a stick-slip cycle.
const HALF_WIDTH_S: f64 = 3.5e-4;

/// A frame at which a segment may begin, with the state of the blade there.
#[derive(Debug, Clone, Copy)]
pub(super) struct SegmentBoundary {
    pub frame: usize,
    pub state: LinkState,
}

/// Boundaries of segments at distances of about `length_s`. Of the frames in which the tip slides and the
/// blade is bent, the frame nearest to the nominal position is chosen. (The frame with the fastest tip would
/// often be a frame with large noise.)
pub(super) fn segment_boundaries(
    scene: &Scene,
    film: &CameraObservation,
    view: &CameraParameters,
    length_s: f64,
) -> Vec<SegmentBoundary> {
    let [from, to] = film.settings.frames;
    let step = ((length_s * film.rate_hz).round() as usize).max(4);
    // rates from one-sided windows are inaccurate
    let inner = half_width_frames(film)..film.times_s.len().saturating_sub(half_width_frames(film));
    let usable = |frame: usize| -> Option<SegmentBoundary> {
        inner.contains(&frame).then_some(())?;
        let (state, speed) = recorded_state(scene, film, view, frame)?;
        let bent = (state[1] - state[0]).abs() > MIN_BEND_RAD && speed.abs() > MIN_SPEED_M_PER_S;
        bent.then_some(SegmentBoundary { frame, state })
    };
    let mut found: Vec<SegmentBoundary> = Vec::new();
    let mut place = from;
    while place + step / 2 < to {
        let width = (step / 3).max(3);
        let [low, high] = match found.last() {
            None => [place, place + width],
            Some(last) => [place.saturating_sub(width / 2).max(last.frame + step / 2), place + width / 2],
        };
        let nearest =
            (low..=high.min(to - 1)).filter_map(usable).min_by_key(|boundary| boundary.frame.abs_diff(place));
        match nearest {
            Some(boundary) => {
                place = boundary.frame + step;
                found.push(boundary);
            }
            None => place += (step / 3).max(1),
        }
    }
    found
}

/// State of the blade, and speed of the tip over the glass, m/s, at the instant when the shutter opens for a
/// frame. Both are computed from parabolas fitted to the neighbouring frames.
fn recorded_state(
    scene: &Scene,
    film: &CameraObservation,
    view: &CameraParameters,
    frame: usize,
) -> Option<(LinkState, f64)> {
    let linkage = &scene.linkage;
    let start_s = film.times_s[frame] - film.lead_s();
    let head = scene.drive.motion_at(start_s - view.clock_s);
    let scale = 1.0 + view.scale;
    let (lean, lean_rate) = fit_parabola(film, frame, |k| {
        let head = film.head_m[k] * if film.own_head { 1.0 } else { scale };
        Some((film.tip_x_m[k]? - head - view.offsets_m(film.after_middle_s(k))[0]) / scale)
    })?;
    let fall = fit_parabola(film, frame, |k| {
        let along = film.head_m[k] - film.centre_m;
        Some((film.drop_m[k]? + view.tilt_rad * along - view.offsets_m(film.after_middle_s(k))[1]) / scale)
    });
    film.tip_x_m[frame].or(film.drop_m[frame])?;
    let speed = lean_rate + head.velocity_m_per_s;
    let state = match fall {
        Some((drop, drop_rate)) => {
            let lean = lean + view.tilt_rad * drop;
            let [theta, phi] = link_angles(linkage, lean, drop)?;
            let [theta_rate, phi_rate] = link_rates(linkage, [theta, phi], lean_rate, drop_rate);
            LinkState::new(theta, phi, theta_rate, phi_rate)
        }
        None => {
            /// Relative change of the lean in the finite difference that gives the derivative of the static
            /// pose with respect to the lean.
            const NEXT: f64 = 0.02;
            let [theta, phi] = equilibrium_angles(linkage, lean)?;
            let [theta_next, phi_next] = equilibrium_angles(linkage, lean * (1.0 + NEXT))?;
            let per_length = lean_rate / (NEXT * lean);
            LinkState::new(theta, phi, (theta_next - theta) * per_length, (phi_next - phi) * per_length)
        }
    };
    Some((state, speed))
}

/// Half width, in frames, of the window in which rates are fitted.
fn half_width_frames(film: &CameraObservation) -> usize {
    ((HALF_WIDTH_S * film.rate_hz).round() as usize).max(1)
}

/// Value and slope (per second) of a parabola, or of a line, that is fitted to the frames around `frame`.
/// Both are taken at the instant when the shutter opens for `frame`.
fn fit_parabola(
    film: &CameraObservation,
    frame: usize,
    of: impl Fn(usize) -> Option<f64>,
) -> Option<(f64, f64)> {
    let half = half_width_frames(film);
    let start_s = film.times_s[frame] - film.lead_s();
    let near = frame.saturating_sub(half)..=(frame + half).min(film.times_s.len() - 1);
    let points: Vec<[f64; 2]> =
        near.filter_map(|k| Some([(film.times_s[k] - start_s) * film.rate_hz, of(k)?])).collect();
    let terms = if points.len() > 3 || (half == 1 && points.len() == 3) { 3 } else { 2 };
    if points.len() < terms {
        return None;
    }
    let powers = DMatrix::from_fn(points.len(), terms, |row, power| math::powi(points[row][0], power as i32));
    let values = DVector::from_fn(points.len(), |row, _| points[row][1]);
    let found = powers.svd(true, true).solve(&values, 1e-12).ok()?;
    Some((found[0], found[1] * film.rate_hz))
}

/// Angles of neck and lip, with the lip trailing, for which the tip is at the distance `lean` from the head
/// along the sweep and the head has dropped by `drop`; `None` if the tip is out of reach.
fn link_angles(linkage: &Linkage, lean: f64, drop: f64) -> Option<[f64; 2]> {
    /// Largest accepted value of the cosine of an angle. It exceeds 1 because noise may make a straight blade
    /// appear too long.
    const REACH: f64 = 1.02;
    let (l1, l2) = (linkage.l1_m, linkage.l2_m);
    let height = l1 + l2 - drop;
    let cosine = (lean * lean + height * height - l1 * l1 - l2 * l2) / (2.0 * l1 * l2);
    if cosine.abs() > REACH {
        return None;
    }
    let bend = math::acos(cosine.clamp(-1.0, 1.0)).copysign(lean);
    let theta = math::atan2(lean, height) - math::atan2(l2 * math::sin(bend), l1 + l2 * math::cos(bend));
    Some([theta, theta + bend])
}

/// Angular velocities of neck and lip from the rates of lean and drop.
fn link_rates(linkage: &Linkage, [theta, phi]: [f64; 2], lean_rate: f64, drop_rate: f64) -> [f64; 2] {
    let (l1, l2) = (linkage.l1_m, linkage.l2_m);
    let determinant = l1 * l2 * math::sin(phi - theta);
    [
        l2 * (math::sin(phi) * lean_rate - math::cos(phi) * drop_rate) / determinant,
        l1 * (math::cos(theta) * drop_rate - math::sin(theta) * lean_rate) / determinant,
    ]
}

/// Angles of neck and lip of a blade at rest, with whatever friction force equilibrium requires, for which
/// the tip is at the distance `lean` from the head along the sweep. They are used if the drop is not tracked.
fn equilibrium_angles(linkage: &Linkage, lean: f64) -> Option<[f64; 2]> {
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
