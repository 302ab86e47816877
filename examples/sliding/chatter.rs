//! The end of chatter in runs whose head becomes faster in small steps.

use wiperlab::model::Pose;
use wiperlab::simulate::drive::Drive;
use wiperlab::simulate::mode::TipMode;
use wiperlab::simulate::scene::{Scene, StartKind};
use wiperlab::simulate::{Observer, RunStatus, SolutionSegment, SolverOptions, run_scene_with};
use wiperlab::stability::cycle_branch::CycleBranch;

/// Periods of the cycle at each speed.
const PERIODS: f64 = 30.0;

/// The last pose of a run, and the time of its last stick, s.
#[derive(Default)]
struct LastStick {
    pose: Option<Pose>,
    stick_s: f64,
}

impl Observer for LastStick {
    fn observe_segment(&mut self, piece: &SolutionSegment<'_>) {
        self.pose = Some(piece.pose_at(piece.end_s));
        if piece.mode == TipMode::Stick {
            self.stick_s = piece.end_s;
        }
    }
}

/// Runs a blade at a speed, m/s, from a pose; its last pose, and whether it sticks in the last third of the
/// run. `None` if the run stops early.
fn hold_speed(scene: &Scene, pose: Pose, speed: f64, length_s: f64) -> Option<(Pose, bool)> {
    let mut scene = scene.clone();
    scene.drive = Drive::Uniform { speed_m_per_s: speed };
    (scene.start_s, scene.run.stop_s, scene.start) = (0.0, length_s, StartKind::State(pose));
    let mut last = LastStick::default();
    let result = run_scene_with(&scene, SolverOptions::new(1e-9), &mut last);
    let pose = last.pose.filter(|_| result.status == RunStatus::Completed)?;
    Some((pose, last.stick_s > length_s * 2.0 / 3.0))
}

/// The speed, m/s, at which a blade no longer sticks if its head becomes faster by the fraction `rise` every
/// thirty periods. The sweep begins with the cycle of the branch at nine tenths of its end.
fn sweep_end(scene: &Scene, branch: &CycleBranch, rise: f64) -> Option<f64> {
    let start = branch.find_cycle(scene, 0.9 * branch.end_m_per_s)?;
    let (mut pose, mut speed) = (start.pose, start.speed_m_per_s);
    while speed < 1.5 * branch.end_m_per_s {
        let (next, sticks) = hold_speed(scene, pose, speed, PERIODS * start.period_s)?;
        if !sticks {
            return Some(speed);
        }
        (pose, speed) = (next, speed * (1.0 + rise));
    }
    None
}

/// The end of chatter, m/s, extrapolated linearly to a head that becomes faster infinitely slowly. `None` if
/// a run stops early or the blade still sticks far above the end of the branch.
pub fn simulated_chatter_end(scene: &Scene, branch: &CycleBranch) -> Option<f64> {
    const RISE: f64 = 2e-3;
    let [fast, slow] = [sweep_end(scene, branch, 2.0 * RISE)?, sweep_end(scene, branch, RISE)?];
    Some(2.0 * slow - fast)
}
