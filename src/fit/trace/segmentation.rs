//! Boundaries of segments, and the states of the blade there, estimated from the recording.

use super::camera_observation::CameraObservation;
use super::model::TraceRecording;
use super::segment_simulation::LinkState;
use super::unknowns::CameraParameters;
use crate::model::Linkage;
use crate::model::modes::body_frequencies;
use crate::recording::channel::median_or_zero;
use crate::simulate::equilibrium::equilibrium_angles;
use crate::simulate::scene::Scene;
use crate::text::format_trimmed;
use nalgebra::{DMatrix, DVector};
use portable_math as math;

/// A segment starts only where the lean is at least this fraction of its usual size. The lean is smaller
/// while the blade flips over, and the blade is then far from its poses at rest.
const LEAST_LEAN: f64 = 0.5;
/// Smallest speed of the tip over the glass that counts as sliding, as a fraction of its usual speed. While
/// the tip sticks, the state has only three degrees of freedom.
const MIN_SPEED: f64 = 0.125;
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

/// Number of further halvings of the segments of a slider. A slider has no motion that is faster than its
/// cycle. Shorter segments depend less on what the model lacks, and there are more of them, so that
/// their scatter is better known.
const SLIDER_HALVINGS: f64 = 3.0;

/// Length of the shortest segments of a blade or slider, s: [`USUAL_SEGMENT_S`] times a power of 2 that
/// follows from the natural frequency of the lip alone, or of the slider. A power of 2, so that a small error
/// of this frequency hardly ever changes the length.
pub(crate) fn first_segment_s(linkage: &Linkage) -> f64 {
    let lip_hz = body_frequencies(linkage).lip_hz;
    let halves = math::ln(USUAL_LIP_HZ / lip_hz) / math::ln(2.0);
    let steps = if halves.is_finite() { halves.round().clamp(-12.0, 12.0) } else { 0.0 };
    let steps = if linkage.is_slider() { steps - SLIDER_HALVINGS } else { steps };
    USUAL_SEGMENT_S * math::powi(2.0, steps as i32)
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
/// blade leans enough, the frame nearest to the nominal position is chosen. (The frame with the fastest tip
/// would often be a frame with large noise.) The state there is that of a blade that passes through its poses
/// at rest, because lean and drop alone do not determine the state of a nearly straight blade.
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
    let least_lean_m = LEAST_LEAN * usual_lean_m(scene, film, view);
    let least_speed = least_sliding_speed(film);
    let usable = |frame: usize| -> Option<SegmentBoundary> {
        inner.contains(&frame).then_some(())?;
        let seen = recorded_motion(scene, film, view, frame)?;
        let starts = seen.speed_m_per_s.abs() > least_speed && seen.lean[0].abs() >= least_lean_m;
        let state = starts.then(|| seen.state_at_rest(scene))??;
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

/// Says why no segment of a recording was started: the limits of speed and lean, and the measured values.
pub(crate) fn describe_start_limits(shoot: &TraceRecording, view: &CameraParameters) -> String {
    let film = &shoot.observation;
    let milli = |metres: f64| format_trimmed(1e3 * metres, 3);
    let lean_m = usual_lean_m(&shoot.scene, film, view);
    format!(
        "no segment was started: the tip must move over the glass faster than {} mm/s, the larger of an eighth of \
         its usual speed ({} mm/s) and {SPEED_DEVIATIONS} standard deviations of a measured tip speed ({} mm/s), where the \
         blade leans by {} mm at least, half of its usual lean ({} mm), and can rest with this lean",
        milli(least_sliding_speed(film)),
        milli(usual_tip_speed(film)),
        milli(speed_sd(film)),
        milli(LEAST_LEAN * lean_m),
        milli(lean_m),
    )
}

/// Smallest speed of the tip over the glass, m/s, that counts as sliding.
pub(super) fn least_sliding_speed(film: &CameraObservation) -> f64 {
    (MIN_SPEED * usual_tip_speed(film)).max(SPEED_DEVIATIONS * speed_sd(film))
}

/// Speed of the tip over the glass, m/s, averaged over the distance that the tip covers while it slides; 0 if
/// it never does. Times of rest do not count, however long they are.
fn usual_tip_speed(film: &CameraObservation) -> f64 {
    let ([from, to], width) = (film.settings.frames, 2 * half_width_frames(film));
    let per_s = film.rate_hz / width as f64;
    let least = SPEED_DEVIATIONS * std::f64::consts::SQRT_2 * film.settings.noise[0].sd() * per_s;
    let speed = |k: usize| Some((film.tip_x_m[k]? - film.tip_x_m[k - width]?).abs() * per_s);
    let sliding = (from + width..to).filter_map(speed).filter(|speed| *speed > least);
    let (sum, squares) = sliding.fold((0.0, 0.0), |(sum, squares), v| (sum + v, squares + v * v));
    if sum > 0.0 { squares / sum } else { 0.0 }
}

/// Standard deviation, m/s, of the tip's speed from the noise of the frames to which it is fitted.
fn speed_sd(film: &CameraObservation) -> f64 {
    let half = half_width_frames(film) as f64;
    let squares = half * (half + 1.0) * (2.0 * half + 1.0) / 3.0;
    film.settings.noise[0].sd() * film.rate_hz / squares.sqrt()
}

/// Median size of the lean, m, while the tip slides; 0 if it never does.
fn usual_lean_m(scene: &Scene, film: &CameraObservation, view: &CameraParameters) -> f64 {
    /// Maximum number of frames that are used.
    const FRAMES: usize = 2000;
    let [from, to] = film.settings.frames;
    let apart = (to - from).div_ceil(FRAMES).max(1);
    let least_speed = least_sliding_speed(film);
    let seen = (from..to).step_by(apart).filter_map(|frame| recorded_motion(scene, film, view, frame));
    let sliding = seen.filter(|seen| seen.speed_m_per_s.abs() > least_speed);
    median_or_zero(sliding.map(|seen| seen.lean[0].abs()))
}

/// Motion of the blade when the shutter opens for a frame, from parabolas fitted to the neighbouring frames.
struct RecordedMotion {
    /// Distance of the tip from the head along the sweep, m, and its rate, m/s.
    lean: [f64; 2],
    /// Speed of the tip over the glass, m/s.
    speed_m_per_s: f64,
}

impl RecordedMotion {
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
    let scale = 1.0 + view.scale;
    let upright_m = scene.linkage.upright_height_m() + view.head_above_m;
    let along_m = |k: usize| film.head_m[k] - film.centre_m;
    // a head above sloping glass appears farther down the slope than the glass under it
    let slope =
        |k: usize| if film.own_head { view.tilt_rad + view.curvature_per_m * along_m(k) } else { 0.0 };
    let (lean, lean_rate) = fit_parabola(film, frame, |k| {
        let head = film.head_m[k] * if film.own_head { 1.0 } else { scale };
        let offset = view.offsets_m(film.after_middle_s(k))[0];
        Some((film.tip_x_m[k]? - head - offset) / scale - slope(k) * upright_m)
    })?;
    let fall = fit_parabola(film, frame, |k| {
        let along = along_m(k);
        let level = film.drop_m[k]? + view.tilt_rad * along + 0.5 * view.curvature_per_m * along * along;
        Some((level - view.offsets_m(film.after_middle_s(k))[1]) / scale)
    });
    film.tip_x_m[frame].or(film.drop_m[frame])?;
    Some(RecordedMotion {
        lean: [lean + fall.map_or(0.0, |(drop, _)| slope(frame) * drop), lean_rate],
        speed_m_per_s: lean_rate + head.velocity_m_per_s,
    })
}

/// Half width, in frames, of the window in which rates are fitted.
pub(super) fn half_width_frames(film: &CameraObservation) -> usize {
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
