//! Friction on the tip from a recorded motion: the equations of motion, solved for the friction force.
//!
//! The positions of tip and head and the head drop give the angles of the links, their rates and the
//! acceleration `a` of the tip. The model gives `a = a_free + f kappa` for a friction force `f` (see
//! [`FrictionResponse`]), so that `f = (a - a_free) / kappa`.

use super::condition::ConditionComparison;
use crate::model::shoulder::ShoulderContact;
use crate::model::{HeadMotion, LinkDirections, Linkage, Pose};
use crate::recording::channel::Channel;
use crate::simulate::ModelSample;
use portable_math as math;

#[cfg(doc)]
use crate::model::FrictionResponse;

/// Velocity and deflection of the tip, with the friction on it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TipFriction {
    /// Velocity of the tip along the sweep, m/s.
    pub velocity_m_per_s: f64,
    /// Deflection of the blade, m.
    pub deflection_m: f64,
    /// Friction, N: minus the force of the glass on the tip along the sweep, so that it is positive while the
    /// tip slides in the positive direction.
    pub friction_n: f64,
}

/// Friction in the frames of a part of a recording.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct MeasuredCycle {
    /// One entry for each frame that has all frames of its parabola in the part. `None` if a point of the
    /// parabola is missing or if the links are nearly in line.
    pub states: Vec<Option<TipFriction>>,
    /// Standard deviation of the friction that the noise of the tip causes, N, where it is largest.
    pub sd_n: f64,
}

/// Minimum number of frames per cycle of stick and slip. With fewer, a long parabola smooths the acceleration
/// of the tip away, and in a short one it is lost in the noise.
const FRAMES_PER_CYCLE: f64 = 20.0;
/// Length of the parabola that is fitted around a frame, as a fraction of a cycle; it is rounded to whole
/// frames. It lowers the acceleration of an oscillation with the frequency of the cycle by 2 to 5 %.
const PARABOLA_CYCLES: f64 = 0.2;
/// Smallest allowed absolute sine of the angle between the links. With links nearly in line, errors of tip
/// and drop have too much effect on the pose.
const LEAST_BEND: f64 = 0.05;
/// Number of Newton steps for the pose. They start from the pose of the model, which is close.
const STEPS: usize = 6;

/// Friction in the frames between two instants on the clock of the recording, s. `None` without fitted
/// traces, without a measured ridge, with too few frames per cycle, or if no frame gives a friction.
pub(crate) fn measure_cycle(case: &ConditionComparison, (from_s, to_s): (f64, f64)) -> Option<MeasuredCycle> {
    let (traces, residual) = (case.model.traces.as_ref()?, case.restarted.as_ref()?);
    let (low_hz, high_hz) = case.ridges.measured.as_ref()?.frequency_range_hz()?;
    let (rate_hz, shift_s) = (traces.grid.frame_rate_hz, case.alignment.shift_s);
    let cycle = rate_hz / (0.5 * (low_hz + high_hz));
    if cycle < FRAMES_PER_CYCLE {
        return None;
    }
    let parabola = MovingParabola::new((0.5 * PARABOLA_CYCLES * cycle).round().max(2.0) as usize, rate_hz);
    let states: Vec<&[ModelSample]> =
        case.states.states_between([from_s - shift_s, to_s - shift_s]).collect();
    let frames = residual.time_s.iter().zip(residual.tip_x_m.iter().zip(&residual.head_drop_m));
    let within = frames.filter(|(t, _)| **t >= from_s && **t <= to_s);
    // the recorded motion is computed as that of the model plus the residual, because this needs no inverse
    // of the camera
    let recorded = within.map(|(t, (tip, drop))| {
        let model = states.iter().find_map(|run| interpolate_state(run, t - shift_s))?;
        Some((t - shift_s, model, model.tip_x_m + (*tip)?, model.head_drop_m + (*drop)?))
    });
    let recorded: Vec<Option<(f64, ModelSample, f64, f64)>> = recorded.collect();
    let linkage = &traces.scene.linkage;
    let friction = |window: &[Option<(f64, ModelSample, f64, f64)>]| {
        let known: Vec<&(f64, ModelSample, f64, f64)> =
            window.iter().map(Option::as_ref).collect::<Option<_>>()?;
        let (time_s, model, ..) = known[parabola.half];
        let tip = parabola.fit(known.iter().map(|(.., tip, _)| *tip));
        let drop = parabola.fit(known.iter().map(|(.., drop)| *drop));
        solve_friction(linkage, &traces.scene.drive.motion_at(*time_s), &model.pose, tip, drop)
    };
    let found: Vec<_> = recorded.windows(2 * parabola.half + 1).map(friction).collect();
    let kappa = found.iter().flatten().map(|(_, kappa)| *kappa).reduce(f64::min)?;
    let noise_m = case.noise_m(Channel::TipX)?;
    Some(MeasuredCycle {
        states: found.into_iter().map(|found| found.map(|(state, _)| state)).collect(),
        sd_n: noise_m * parabola.acceleration_gain() / kappa,
    })
}

/// State of a run at an instant on its clock, s: the position of the tip by cubic interpolation of positions
/// and velocities, the head drop by linear interpolation, and all else from the state before. `None` outside
/// the run.
fn interpolate_state(run: &[ModelSample], time_s: f64) -> Option<ModelSample> {
    let next = run.partition_point(|s| s.time_s < time_s);
    let (a, b) = (run.get(next.checked_sub(1)?)?, run.get(next)?);
    let step_s = b.time_s - a.time_s;
    let u = (time_s - a.time_s) / step_s;
    let (va, vb) = (a.tip_velocity_m_per_s * step_s, b.tip_velocity_m_per_s * step_s);
    let way_m = b.tip_x_m - a.tip_x_m;
    let tip_x_m = a.tip_x_m + u * (va + u * (3.0 * way_m - 2.0 * va - vb + u * (va + vb - 2.0 * way_m)));
    let head_drop_m = a.head_drop_m + u * (b.head_drop_m - a.head_drop_m);
    Some(ModelSample { tip_x_m, head_drop_m, ..*a })
}

/// The parabola that is fitted by least squares to a frame and `half` frames on either side of it.
struct MovingParabola {
    half: usize,
    rate_hz: f64,
    /// Number of frames, and sums of the squares and of the fourth powers of the distances of the frames from
    /// the middle frame, in frames.
    sums: [f64; 3],
}

impl MovingParabola {
    fn new(half: usize, rate_hz: f64) -> Self {
        let power = |n: i32| (1..=half).map(|k| 2.0 * math::powi(k as f64, n)).sum::<f64>();
        Self { half, rate_hz, sums: [(2 * half + 1) as f64, power(2), power(4)] }
    }

    /// Value, first derivative, 1/s, and second derivative, 1/s2, in the middle frame, in units of the
    /// values. The iterator gives one value per frame.
    fn fit(&self, values: impl Iterator<Item = f64>) -> [f64; 3] {
        let [n, s2, s4] = self.sums;
        let place = |i: usize| i as f64 - self.half as f64;
        let moments = values.enumerate().fold([0.0; 3], |[a, b, c], (i, x)| {
            let k = place(i);
            [a + x, b + k * x, c + k * k * x]
        });
        let determinant = n * s4 - s2 * s2;
        [
            (s4 * moments[0] - s2 * moments[2]) / determinant,
            moments[1] / s2 * self.rate_hz,
            2.0 * (n * moments[2] - s2 * moments[0]) / determinant * self.rate_hz * self.rate_hz,
        ]
    }

    /// Standard deviation of the second derivative for white noise of unit standard deviation, 1/s2.
    fn acceleration_gain(&self) -> f64 {
        let [n, s2, s4] = self.sums;
        2.0 * (n / (n * s4 - s2 * s2)).sqrt() * self.rate_hz * self.rate_hz
    }
}

/// Friction on the tip, and the acceleration of the tip per newton of friction force, 1/kg. `tip` and `drop`
/// are the position of the tip and the head drop, m, each with its first and second time derivative; `guess`
/// is a pose nearby. `None` for links that are nearly in line, or if the friction is not finite.
fn solve_friction(
    linkage: &Linkage,
    head: &HeadMotion,
    guess: &Pose,
    tip: [f64; 3],
    drop: [f64; 3],
) -> Option<(TipFriction, f64)> {
    let (l1, l2) = (linkage.l1_m, linkage.l2_m);
    let deflection_m = tip[0] - head.position_m;
    let mut pose = *guess;
    let solve = |d: &LinkDirections, along: f64, down: f64| {
        let bend = d.sin_phi * d.cos_theta - d.cos_phi * d.sin_theta;
        (bend.abs() > LEAST_BEND).then(|| {
            [
                (along * d.sin_phi - down * d.cos_phi) / (l1 * bend),
                (down * d.cos_theta - along * d.sin_theta) / (l2 * bend),
            ]
        })
    };
    for _ in 0..STEPS {
        let d = LinkDirections::from_pose(&pose);
        let along = deflection_m - l1 * d.sin_theta - l2 * d.sin_phi;
        let [theta, phi] = solve(&d, along, drop[0] - linkage.head_drop_m(&d))?;
        pose = Pose { theta: pose.theta + theta, phi: pose.phi + phi, ..pose };
    }
    let d = LinkDirections::from_pose(&pose);
    let [theta_rate, phi_rate] = solve(&d, tip[1] - head.velocity_m_per_s, drop[1])?;
    let pose = Pose { theta_rate, phi_rate, ..pose };
    let lean = linkage.shoulder.map_or(ShoulderContact::Off, |shoulder| shoulder.contact_at(pose.theta));
    let response = linkage.friction_response(&pose, &d, head, lean);
    let friction_n = (response.a_free - tip[2]) / response.kappa;
    let found = TipFriction { velocity_m_per_s: tip[1], deflection_m, friction_n };
    Some((found, response.kappa)).filter(|(found, _)| found.friction_n.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::mode::TipMode;
    use crate::simulate::outputs::SampleObserver;
    use crate::simulate::scene::Scene;
    use crate::simulate::{RunMotion, run_scene};

    #[test]
    fn a_parabola_is_fitted_exactly_and_noise_grows_as_said() {
        let parabola = MovingParabola::new(3, 10.0);
        let at = |i: i32| 2.0 + 0.3 * f64::from(i) / 10.0 - 4.0 * f64::from(i * i) / 100.0;
        let [x, v, a] = parabola.fit((-3..=3).map(at));
        assert!((x - 2.0).abs() < 1e-12 && (v - 0.3).abs() < 1e-12 && (a + 8.0).abs() < 1e-10, "{x} {v} {a}");
        // the gain is the root of the sum of the squared responses to a unit value in one frame
        let response = |at: usize| parabola.fit((0..7).map(|i| f64::from(u8::from(i == at))))[2];
        let gain = (0..7).map(|at| response(at) * response(at)).sum::<f64>().sqrt();
        assert!((parabola.acceleration_gain() / gain - 1.0).abs() < 1e-12);
    }

    /// Largest error, N, of the friction of a run from the positions of tip and head at instants `step_s`
    /// apart, away from transitions; and the number of instants in slip and in stick.
    fn largest_error(step_s: f64) -> (f64, [usize; 2]) {
        let scene = Scene::parse("s", include_str!("../../data/scenes/actual-blade.toml")).unwrap();
        let motion = RunMotion::simulate(&scene);
        let is_smooth = |t: &f64| motion.transitions.iter().all(|change| (change.time_s - t).abs() > 2e-4);
        let middles: Vec<f64> =
            (1..2900).map(|i| scene.start_s + 2e-4 * f64::from(i)).filter(is_smooth).collect();
        let times = middles.iter().flat_map(|t| [t - step_s, *t, t + step_s]);
        let mut states = Vec::new();
        run_scene(&scene, &mut SampleObserver::new(times, |state| states.push(*state)));
        let parabola = MovingParabola::new(1, 1.0 / step_s);
        let (mut largest, mut counts) = (0.0_f64, [0; 2]);
        for window in states.chunks_exact(3) {
            let middle = &window[1];
            // the moment of the shoulder has a jump where the neck comes to lean on it
            let lean = |at: usize| scene.linkage.shoulder.map(|s| s.contact_at(window[at].pose.theta));
            if lean(0) != lean(2) {
                continue;
            }
            let tip = parabola.fit(window.iter().map(|s| s.tip_x_m));
            let drop = parabola.fit(window.iter().map(|s| s.head_drop_m));
            let head = scene.drive.motion_at(middle.time_s);
            let guess = Pose { theta: middle.pose.theta + 0.01, phi: middle.pose.phi - 0.01, ..middle.pose };
            let Some((found, _)) = solve_friction(&scene.linkage, &head, &guess, tip, drop) else { continue };
            largest = largest.max((found.friction_n + middle.friction_n).abs());
            counts[usize::from(middle.mode == TipMode::Stick)] += 1;
        }
        (largest, counts)
    }

    /// The positions of tip and head alone give the friction, with an error of the second order in the step.
    #[test]
    fn the_friction_of_a_run_follows_from_its_motion() {
        let [(coarse, _), (fine, counts)] = [2e-5, 1e-5].map(largest_error);
        assert!(fine < 0.005 * 0.05 && (3.0..5.0).contains(&(coarse / fine)), "{coarse} N, {fine} N");
        assert!(counts.iter().all(|count| *count > 200), "{counts:?}");
    }
}
