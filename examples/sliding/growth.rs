//! Growth of small perturbations of steady sliding in simulated runs.

use nalgebra::Matrix4;
use wiperlab::model::Pose;
use wiperlab::simulate::drive::Drive;
use wiperlab::simulate::scene::{Scene, StartKind};
use wiperlab::simulate::{Observer, RunStatus, SolutionSegment, SolverOptions, run_scene_with};
use wiperlab::stability::steady_sliding::SlideFinder;

/// Size of the perturbations: rad for angles, a fraction of the fastest natural angular frequency for rates.
const PERTURBATION: f64 = 1e-6;
/// Length of the runs, s, times the fastest natural angular frequency of the links.
const RADIANS: f64 = 20.0;
/// Relative tolerance of the runs.
const TOLERANCE: f64 = 1e-13;

#[derive(Default)]
struct LastPose(Option<Pose>);

impl Observer for LastPose {
    fn observe_segment(&mut self, piece: &SolutionSegment<'_>) {
        self.0 = Some(piece.pose_at(piece.end_s));
    }
}

/// Growth, 1/s, of the perturbation of steady sliding that grows fastest, from eight runs that start next to
/// steady sliding. `None` if the blade cannot slide steadily at the speed, m/s, or if a run does not complete
/// or has a transition.
pub fn simulated_growth(scene: &Scene, speed: f64) -> Option<f64> {
    let slide = SlideFinder::new(&scene.linkage, 1.0).find_slide(speed).ok()?;
    let (_, fastest) = wiperlab::model::modes::time_scales_rad_per_s(&scene.linkage);
    let length_s = RADIANS / fastest;
    let scales = [1.0, 1.0, fastest, fastest];
    let states = |pose: &Pose| [pose.theta, pose.phi, pose.theta_rate, pose.phi_rate];
    let run = |index: usize, change: f64| {
        let mut y = states(&slide.pose);
        y[index] += change * scales[index];
        let mut scene = scene.clone();
        scene.drive = Drive::Uniform { speed_m_per_s: speed };
        scene.start_s = 0.0;
        scene.run.stop_s = length_s;
        scene.start = StartKind::State(Pose { theta: y[0], phi: y[1], theta_rate: y[2], phi_rate: y[3] });
        let mut last = LastPose::default();
        let result = run_scene_with(&scene, SolverOptions::new(TOLERANCE), &mut last);
        let is_smooth = result.status == RunStatus::Completed && result.transitions == 0;
        last.0.filter(|_| is_smooth).map(|pose| states(&pose))
    };
    let mut map = Matrix4::zeros();
    for column in 0..4 {
        let [ahead, behind] = [run(column, PERTURBATION)?, run(column, -PERTURBATION)?];
        for row in 0..4 {
            map[(row, column)] = (ahead[row] - behind[row]) / (2.0 * PERTURBATION * scales[row]);
        }
    }
    let sizes = map.complex_eigenvalues().map(|e| e.re.hypot(e.im));
    Some(sizes.max().ln() / length_s)
}

/// The speed, m/s, at which simulated perturbations stop growing, by bisection between a speed at which they
/// grow and one at which they decay. `None` if the growth is missing at a speed on the way.
pub fn simulated_end(scene: &Scene, [mut unstable, mut stable]: [f64; 2]) -> Option<f64> {
    while stable - unstable > 1e-5 * stable {
        let middle = 0.5 * (unstable + stable);
        if simulated_growth(scene, middle)? > 0.0 {
            unstable = middle;
        } else {
            stable = middle;
        }
    }
    Some(0.5 * (unstable + stable))
}
