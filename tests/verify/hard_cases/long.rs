//! Long runs and the same run again.

use super::contact::lip_alone;
use super::scenes::{committed, upright_light_blade};
use super::{DRIFT_M, ERRORS, METHODS};
use rayon::prelude::*;
use wiperlab::model::Pose;
use wiperlab::simulate::mode::TipMode;
use wiperlab::simulate::outputs::{SampleObserver, Transitions, push_event_row, push_state_row};
use wiperlab::simulate::scene::{Drive, Scene, StartKind};
use wiperlab::simulate::{
    IntegrationMethod, Observer, RunStatus, SolutionSegment, SolverOptions, Transition, TransitionCause,
    run_scene_with,
};

/// Releases of the tip, and the worst drift of what stick holds.
#[derive(Default)]
struct Releases {
    times: Vec<f64>,
    drift_m: f64,
}

impl Observer for Releases {
    fn observe_segment(&mut self, piece: &SolutionSegment<'_>) {
        if piece.mode == TipMode::Stick {
            self.drift_m = self.drift_m.max(piece.sample_at(piece.end_s).constraint_drift_m.abs());
        }
    }
    fn observe_transition(&mut self, transition: &Transition) {
        if transition.cause == TransitionCause::FrictionLimit {
            self.times.push(transition.time_s);
        }
    }
}

/// One degree of freedom forgets everything in stick: it is let go at one and the same angle, so each cycle
/// is the first again, for as long as the run lasts. (By Taylor series: Runge-Kutta's error control does not
/// see a link that only follows.) The tip is 47 m away by then; the place that holds it is exact to the
/// rounding of that distance.
#[test]
fn a_hundred_thousand_cycles_do_not_drift() {
    let mut scene = lip_alone(0.3);
    (scene.linkage.friction.a, scene.linkage.friction.b_s_per_m) = (0.5, 5.0);
    scene.drive = Drive::Uniform { speed_m_per_s: 0.1 };
    scene.start = StartKind::State(Pose { theta: 0.0, phi: 0.0, theta_rate: 0.0, phi_rate: 0.0 });
    let period = |relative: f64, cycles: usize| {
        let mut scene = scene.clone();
        scene.run.stop_s = (cycles as f64 + 2.5) * 4.737e-3;
        let mut seen = Releases::default();
        let run = run_scene_with(&scene, SolverOptions::new(relative), &mut seen);
        assert_eq!(
            (run.status, seen.times.len() as u64),
            (RunStatus::Completed, run.transitions / 2),
            "at {relative:e}"
        );
        assert!(seen.times.len() > cycles, "{}", seen.times.len());
        let periods: Vec<f64> = seen.times.windows(2).map(|w| w[1] - w[0]).collect();
        let (least, most) =
            periods.iter().fold((f64::MAX, 0.0f64), |(least, most), p| (least.min(*p), most.max(*p)));
        let spread = ERRORS * relative * most + 8.0 * f64::EPSILON * scene.run.stop_s;
        assert!(most - least <= spread, "at {relative:e}: periods from {least} to {most} s");
        assert!(seen.drift_m <= DRIFT_M, "at {relative:e}: {:e} m", seen.drift_m);
        (seen.times[cycles] - seen.times[0]) / cycles as f64
    };
    let exact = period(1e-12, 1000);
    for (relative, cycles) in [(1e-8, 100_000), (1e-5, 1000)] {
        let found = period(relative, cycles);
        assert!(
            (found / exact - 1.0).abs() <= ERRORS * relative,
            "at {relative:e}: {found} instead of {exact} s"
        );
    }
}

/// Samples and events of a run as the files hold them.
fn files(scene: &Scene, method: IntegrationMethod) -> String {
    let (mut text, mut list) = (String::new(), Transitions::default());
    let (from, to) = (scene.start_s, scene.run.stop_s);
    let times = (0..=500).map(|i| from + (to - from) * f64::from(i) / 500.0);
    let run = run_scene_with(
        scene,
        SolverOptions { method, ..SolverOptions::new(1e-8) },
        &mut (SampleObserver::new(times, |s| push_state_row(&mut text, &scene.linkage, s)), &mut list),
    );
    list.0.iter().for_each(|t| push_event_row(&mut text, t));
    format!("{text}{run:?}")
}

#[test]
fn a_run_is_the_same_to_the_bit_again_and_on_any_number_of_threads() {
    let runs: Vec<(Scene, IntegrationMethod)> =
        [committed("light-blade"), committed("actual-blade"), upright_light_blade()]
            .into_iter()
            .flat_map(|scene| METHODS.map(|method| (scene.clone(), method)))
            .collect();
    let alone: Vec<String> = runs.iter().map(|(scene, method)| files(scene, *method)).collect();
    for threads in [1, 2, 4] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let together: Vec<String> =
            pool.install(|| runs.par_iter().map(|(scene, method)| files(scene, *method)).collect());
        assert!(alone == together, "{threads} threads");
    }
}
