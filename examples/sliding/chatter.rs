//! End and start of chatter in runs whose head becomes faster or slower in small steps.

use std::f64::consts::TAU;
use wiperlab::model::Pose;
use wiperlab::simulate::drive::Drive;
use wiperlab::simulate::mode::TipMode;
use wiperlab::simulate::scene::{Scene, StartKind};
use wiperlab::simulate::{Observer, RunStatus, SolutionSegment, SolverOptions, run_scene_with};
use wiperlab::stability::cycle_branch::CycleBranch;
use wiperlab::stability::steady_sliding::SlideFinder;

/// Periods of the cycle at each speed.
const PERIODS: f64 = 30.0;

/// The last pose of a run, the time of its last stick, s, and the range of the distance between tip and head
/// in its last third, m.
struct LastStick {
    pose: Option<Pose>,
    stick_s: f64,
    late_s: f64,
    range_m: [f64; 2],
}

impl Observer for LastStick {
    fn observe_segment(&mut self, piece: &SolutionSegment<'_>) {
        const PARTS: u32 = 8;
        self.pose = Some(piece.pose_at(piece.end_s));
        if piece.mode == TipMode::Stick {
            self.stick_s = piece.end_s;
        }
        for part in (0..=PARTS).filter(|_| piece.start_s > self.late_s) {
            let t = piece.start_s + (piece.end_s - piece.start_s) * f64::from(part) / f64::from(PARTS);
            let sample = piece.sample_at(t);
            let deflection_m = sample.tip_x_m - sample.head_x_m;
            self.range_m = [self.range_m[0].min(deflection_m), self.range_m[1].max(deflection_m)];
        }
    }
}

/// The end of a run at constant speed.
struct HeldSpeed {
    pose: Pose,
    /// Whether the tip sticks in the last third of the run.
    sticks: bool,
    /// Half the range of the distance between tip and head in this third, m.
    amplitude_m: f64,
}

impl HeldSpeed {
    /// Runs a blade at a speed, m/s, from a pose. `None` if the run stops early.
    fn from_pose(scene: &Scene, pose: Pose, speed: f64, length_s: f64) -> Option<Self> {
        let mut scene = scene.clone();
        scene.drive = Drive::Uniform { speed_m_per_s: speed };
        (scene.start_s, scene.run.stop_s, scene.start) = (0.0, length_s, StartKind::State(pose));
        let (late_s, range_m) = (length_s * 2.0 / 3.0, [f64::INFINITY, f64::NEG_INFINITY]);
        let mut last = LastStick { pose: None, stick_s: 0.0, late_s, range_m };
        let result = run_scene_with(&scene, SolverOptions::new(1e-9), &mut last);
        let pose = last.pose.filter(|_| result.status == RunStatus::Completed)?;
        let amplitude_m = 0.5 * (last.range_m[1] - last.range_m[0]);
        Some(Self { pose, sticks: last.stick_s > late_s, amplitude_m })
    }
}

/// The speed, m/s, at which a blade no longer chatters if its head becomes faster by the fraction `rise`
/// every thirty periods. The sweep begins with the cycle of the branch at nine tenths of its end. Chatter
/// without stick has ended if less than a quarter of the amplitude is left.
fn sweep_end(scene: &Scene, branch: &CycleBranch, rise: f64) -> Option<f64> {
    let start = branch.find_cycle(scene, 0.9 * branch.end_m_per_s)?;
    let least_m = if branch.sticks_below_end() { f64::INFINITY } else { 0.25 * start.amplitude_m };
    let (mut pose, mut speed) = (start.pose, start.speed_m_per_s);
    while speed < 1.5 * branch.end_m_per_s {
        let next = HeldSpeed::from_pose(scene, pose, speed, PERIODS * start.period_s)?;
        if !next.sticks && next.amplitude_m < least_m {
            return Some(speed);
        }
        (pose, speed) = (next.pose, speed * (1.0 + rise));
    }
    None
}

/// The end of chatter, m/s, extrapolated linearly to a head that becomes faster infinitely slowly. `None` if
/// a run stops early or the blade still chatters far above the end of the branch.
pub fn simulated_chatter_end(scene: &Scene, branch: &CycleBranch) -> Option<f64> {
    const RISE: f64 = 2e-3;
    let [fast, slow] = [sweep_end(scene, branch, 2.0 * RISE)?, sweep_end(scene, branch, RISE)?];
    Some(2.0 * slow - fast)
}

/// The speed, m/s, at which a blade that slides steadily begins to vibrate if its head becomes slower by the
/// fraction `fall` every thirty periods. The sweep begins above the end of the instability.
fn sweep_start(scene: &Scene, end: f64, fall: f64) -> Option<f64> {
    /// Amplitude of the velocity of a vibration, as a fraction of the speed of the head. At 1 the tip stops.
    const LEAST: f64 = 0.05;
    let mut finder = SlideFinder::new(&scene.linkage, 1.0);
    let (mut speed, mut pose) = (1.02 * end, finder.find_slide(1.02 * end).ok()?.pose);
    let period_s = 1.0 / finder.find_slide(end).ok()?.leading_mode().frequency_hz;
    while speed > 0.1 * end {
        let next = HeldSpeed::from_pose(scene, pose, speed, PERIODS * period_s)?;
        if next.sticks || TAU * next.amplitude_m > LEAST * speed * period_s {
            return Some(speed);
        }
        (pose, speed) = (next.pose, speed * (1.0 - fall));
    }
    None
}

/// The start of chatter, m/s, extrapolated to a head that becomes slower infinitely slowly. Growth rises
/// linearly below the end of the instability, so the start lags by the square root of the rate. `None` if a
/// run stops early or the blade never vibrates.
#[allow(dead_code)] // the tests compare the end alone
pub fn simulated_chatter_start(scene: &Scene, end: f64) -> Option<f64> {
    const FALL: f64 = 5e-4;
    let [fast, slow] = [sweep_start(scene, end, 4.0 * FALL)?, sweep_start(scene, end, FALL)?];
    Some(2.0 * slow - fast)
}
