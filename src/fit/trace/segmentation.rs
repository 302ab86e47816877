//! Boundaries of segments, and the states of the blade there, estimated from the recording.

use super::camera_observation::CameraObservation;
use super::segment_simulation::LinkState;
use super::unknowns::CameraParameters;
use crate::model::Linkage;
use crate::model::modes::body_frequencies;
use crate::recording::channel::median_in_place;
use crate::simulate::equilibrium::equilibrium_angles;
use crate::simulate::scene::Scene;
use crate::text::format_trimmed;
use nalgebra::{DMatrix, DVector};
use portable_math as math;

/// Smallest angle between neck and lip, rad, at which the two coordinates of the tip determine both angles.
/// In a nearly straight blade they do not.
const MIN_BEND_RAD: f64 = 0.15;
/// A blade counts as straight if it is bent in less than this fraction of the frames in which the tip slides.
const LEAST_BENT: f64 = 0.5;
/// A segment of a straight blade starts only where the lean is at least this fraction of its usual size. The
/// lean is smaller while the blade flips over.
const LEAST_LEAN: f64 = 0.5;
/// Smallest speed of the tip over the glass that counts as sliding, as a fraction of the greatest head speed.
/// While the tip sticks, the state has only three degrees of freedom.
const MIN_SPEED: f64 = 0.1;
/// A speed of the tip over the glass counts as sliding only if it exceeds this number of its standard
/// deviations.
const SPEED_DEVIATIONS: f64 = 5.0;
/// Half width of the window of frames to which rates are fitted, as a fraction of the first segment length: a
/// third of a stick-slip cycle.
const HALF_WIDTH: f64 = 0.0875;

/// First segment length, s, of a blade whose lip alone has the natural frequency `USUAL_LIP_HZ`: a few
/// stick-slip cycles.
const USUAL_SEGMENT_S: f64 = 0.004;
/// Natural frequency, Hz, of the lip alone of a blade of the usual size.
const USUAL_LIP_HZ: f64 = 608.0;

/// Length of the shortest segments of a blade, s: [`USUAL_SEGMENT_S`] times a power of 4 that follows from
/// the natural frequency of the lip alone. A power of 4, so that a small error of this frequency hardly ever
/// changes the length.
pub(crate) fn first_segment_s(linkage: &Linkage) -> f64 {
    let lip_hz = body_frequencies(linkage).lip_hz;
    let quarters = math::ln(USUAL_LIP_HZ / lip_hz) / math::ln(4.0);
    let steps = if quarters.is_finite() { quarters.round().clamp(-6.0, 6.0) } else { 0.0 };
    USUAL_SEGMENT_S * math::powi(4.0, steps as i32)
}

/// A frame at which a segment may begin, with the state of the blade there.
#[derive(Debug, Clone, Copy)]
pub(super) struct SegmentBoundary {
    pub frame: usize,
    pub state: LinkState,
}

/// Number of frames in `length_s`, at least 4.
pub(super) fn nominal_frames(film: &CameraObservation, length_s: f64) -> usize {
    ((length_s * film.rate_hz).round() as usize).max(4)
}

/// Boundaries of segments at distances of about `length_s`. Of the frames in which the tip slides and the
/// blade is bent (or, if it is nearly straight, leans enough), the frame nearest to the nominal position is
/// chosen. (The frame with the fastest tip would often be a frame with large noise.)
pub(super) fn segment_boundaries(
    scene: &Scene,
    film: &CameraObservation,
    view: &CameraParameters,
    length_s: f64,
) -> Vec<SegmentBoundary> {
    let [from, to] = film.settings.frames;
    let step = nominal_frames(film, length_s);
    // rates from one-sided windows are inaccurate
    let inner = half_width_frames(film)..film.times_s.len().saturating_sub(half_width_frames(film));
    let least_lean_m = usual_lean_of_straight_blade(scene, film, view).map(|usual| LEAST_LEAN * usual);
    let least_speed = least_sliding_speed(film);
    let usable = |frame: usize| -> Option<SegmentBoundary> {
        inner.contains(&frame).then_some(())?;
        let seen = recorded_motion(scene, film, view, frame)?;
        (seen.speed_m_per_s.abs() > least_speed).then_some(())?;
        let state = match least_lean_m {
            Some(least) => seen.lean[0].abs().ge(&least).then(|| seen.state_at_rest(scene))??,
            None => seen.bent_state(scene)?,
        };
        Some(SegmentBoundary { frame, state })
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

/// Describes in which frames of a recording a segment can start, with the limits.
pub(crate) fn describe_start_limits(film: &CameraObservation) -> String {
    let mm = |speed: f64| format_trimmed(1e3 * speed, 3);
    format!(
        "no segment was started: the tip must move over the glass faster than {} mm/s, the larger of a tenth of the \
         greatest head speed ({} mm/s) and {SPEED_DEVIATIONS} standard deviations of a measured tip speed ({} mm/s)",
        mm(least_sliding_speed(film)),
        mm(film.head_speed_m_per_s),
        mm(speed_sd(film))
    )
}

/// Smallest speed of the tip over the glass, m/s, that counts as sliding.
fn least_sliding_speed(film: &CameraObservation) -> f64 {
    (MIN_SPEED * film.head_speed_m_per_s).max(SPEED_DEVIATIONS * speed_sd(film))
}

/// Standard deviation, m/s, of the tip's speed from the noise of the frames to which it is fitted.
fn speed_sd(film: &CameraObservation) -> f64 {
    let half = half_width_frames(film) as f64;
    let squares = half * (half + 1.0) * (2.0 * half + 1.0) / 3.0;
    film.settings.noise[0].sd() * film.rate_hz / squares.sqrt()
}

/// Median size of the lean, m, while the tip slides, for a blade that is nearly straight; `None` for a blade
/// that bends, or if the drop is not tracked.
fn usual_lean_of_straight_blade(
    scene: &Scene,
    film: &CameraObservation,
    view: &CameraParameters,
) -> Option<f64> {
    /// Maximum number of frames that are used.
    const FRAMES: usize = 400;
    let [from, to] = film.settings.frames;
    let apart = (to - from).div_ceil(FRAMES).max(1);
    let frames = (from..to).step_by(apart);
    let least_speed = least_sliding_speed(film);
    let seen = frames.filter_map(|frame| recorded_motion(scene, film, view, frame));
    let sliding: Vec<RecordedMotion> =
        seen.filter(|seen| seen.drop.is_some() && seen.speed_m_per_s.abs() > least_speed).collect();
    let bent = sliding.iter().filter(|seen| seen.bent_state(scene).is_some()).count();
    if sliding.is_empty() || bent as f64 >= LEAST_BENT * sliding.len() as f64 {
        return None;
    }
    median_in_place(&mut sliding.iter().map(|seen| seen.lean[0].abs()).collect::<Vec<_>>())
}

/// Motion of the blade when the shutter opens for a frame, from parabolas fitted to the neighbouring frames.
struct RecordedMotion {
    /// Distance of the tip from the head along the sweep, m, and its rate, m/s.
    lean: [f64; 2],
    /// Drop of the head, m, and its rate, m/s; `None` if it is not tracked.
    drop: Option<[f64; 2]>,
    /// Speed of the tip over the glass, m/s.
    speed_m_per_s: f64,
}

impl RecordedMotion {
    /// State of a bent blade, from lean and drop; without a drop, from [`Self::state_at_rest`]. `None` if the
    /// blade is nearly straight, or if no angles give this lean and drop.
    fn bent_state(&self, scene: &Scene) -> Option<LinkState> {
        let state = match self.drop {
            None => self.state_at_rest(scene)?,
            Some([drop, drop_rate]) => {
                let [theta, phi] = link_angles(&scene.linkage, self.lean[0], drop)?;
                let [theta_rate, phi_rate] =
                    link_rates(&scene.linkage, [theta, phi], self.lean[1], drop_rate);
                LinkState::new(theta, phi, theta_rate, phi_rate)
            }
        };
        ((state[1] - state[0]).abs() > MIN_BEND_RAD).then_some(state)
    }

    /// State of a blade that passes through its equilibrium poses: its angles are those at rest with the same
    /// lean.
    fn state_at_rest(&self, scene: &Scene) -> Option<LinkState> {
        /// Relative change of the lean in the finite difference that gives the derivative of the static pose
        /// with respect to the lean.
        const NEXT: f64 = 0.02;
        let [lean, lean_rate] = self.lean;
        let [theta, phi] = equilibrium_angles(&scene.linkage, lean)?;
        let [theta_next, phi_next] = equilibrium_angles(&scene.linkage, lean * (1.0 + NEXT))?;
        let per_length = lean_rate / (NEXT * lean);
        Some(LinkState::new(theta, phi, (theta_next - theta) * per_length, (phi_next - phi) * per_length))
    }
}

fn recorded_motion(
    scene: &Scene,
    film: &CameraObservation,
    view: &CameraParameters,
    frame: usize,
) -> Option<RecordedMotion> {
    let start_s = film.times_s[frame] - film.lead_s();
    let head = scene.drive.motion_at(start_s - view.clock_s);
    let (scale, upright_m) = (1.0 + view.scale, scene.linkage.l1_m + scene.linkage.l2_m);
    let (lean, lean_rate) = fit_parabola(film, frame, |k| {
        let head = film.head_m[k] * if film.own_head { 1.0 } else { scale };
        let bent = film.own_head.then(|| view.curvature_per_m * upright_m * (film.head_m[k] - film.centre_m));
        let offset = view.offsets_m(film.after_middle_s(k))[0] + bent.unwrap_or(0.0);
        Some((film.tip_x_m[k]? - head - offset) / scale)
    })?;
    let fall = fit_parabola(film, frame, |k| {
        let along = film.head_m[k] - film.centre_m;
        let level = film.drop_m[k]? + view.tilt_rad * along + 0.5 * view.curvature_per_m * along * along;
        Some((level - view.offsets_m(film.after_middle_s(k))[1]) / scale)
    });
    film.tip_x_m[frame].or(film.drop_m[frame])?;
    Some(RecordedMotion {
        lean: [lean + fall.map_or(0.0, |(drop, _)| view.tilt_rad * drop), lean_rate],
        drop: fall.map(|(drop, rate)| [drop, rate]),
        speed_m_per_s: lean_rate + head.velocity_m_per_s,
    })
}

/// Half width, in frames, of the window in which rates are fitted.
fn half_width_frames(film: &CameraObservation) -> usize {
    ((HALF_WIDTH * film.first_segment_s * film.rate_hz).round() as usize).max(1)
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
