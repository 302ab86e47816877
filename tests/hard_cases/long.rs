//! Long runs and the same run again.

use super::scenes::{committed, upright_light_blade};
use super::{METHODS, MOST_EVALUATIONS};
use rayon::prelude::*;
use wiperlab::blade::Pose;
use wiperlab::simulate::mode::Mode;
use wiperlab::simulate::outputs::{Sampler, Transitions, push_event, push_state};
use wiperlab::simulate::scene::{Drive, Scene, StartKind};
use wiperlab::simulate::{Effort, Method, Observer, Piece, Status, Transition, run_with};

/// Releases of the tip, and the worst drift of what stick holds.
#[derive(Default)]
struct Releases {
    times: Vec<f64>,
    drift_m: f64,
}

impl Observer for Releases {
    fn piece(&mut self, piece: &Piece<'_>) {
        if piece.mode == Mode::Stick {
            self.drift_m = self.drift_m.max(piece.sample(piece.end_s).constraint_drift_m.abs());
        }
    }
    fn transition(&mut self, transition: &Transition) {
        if transition.cause == "friction-limit" {
            self.times.push(transition.time_s);
        }
    }
}

#[test]
fn a_hundred_thousand_cycles_do_not_drift() {
    const CYCLES: usize = 100_000;
    let mut scene = super::contact::lip_alone(0.3);
    (scene.linkage.friction.a, scene.linkage.friction.b_s_per_m) = (0.5, 5.0);
    scene.drive = Drive::Uniform { speed_m_per_s: 0.1 };
    scene.start = StartKind::State(Pose { theta: 0.0, phi: 0.0, theta_rate: 0.0, phi_rate: 0.0 });
    scene.run.stop_s = 100.0;
    for (method, relative) in [(Method::Taylor, 1e-8), (Method::RungeKutta, 1e-8)] {
        let mut seen = Releases::default();
        let now = std::time::Instant::now();
        let run = run_with(&scene, Effort { method, ..Effort::new(relative) }, &mut seen);
        let periods: Vec<f64> = seen.times.windows(2).map(|w| w[1] - w[0]).collect();
        println!("{run:?} {} {:?} {:e} {}", seen.times.len(), &periods[..10.min(periods.len())], seen.drift_m, now.elapsed().as_secs_f64());
        println!("{:?}", &periods[periods.len().saturating_sub(5)..]);
    }
    let _ = (CYCLES, MOST_EVALUATIONS, Status::Completed);
}

/// Samples and events of a run as the files hold them.
fn files(scene: &Scene, method: Method) -> String {
    let (mut text, mut list) = (String::new(), Transitions::default());
    let (from, to) = (scene.start_s, scene.run.stop_s);
    let times = (0..=500).map(|i| from + (to - from) * f64::from(i) / 500.0);
    let run = run_with(scene, Effort { method, ..Effort::new(1e-8) }, &mut (Sampler::new(times, |s| push_state(&mut text, s)), &mut list));
    list.0.iter().for_each(|t| push_event(&mut text, t));
    format!("{text}{run:?}")
}

#[test]
fn a_run_is_the_same_to_the_bit_again_and_on_any_number_of_threads() {
    let runs: Vec<(Scene, Method)> = [committed("light-blade"), committed("actual-blade"), upright_light_blade()]
        .into_iter()
        .flat_map(|scene| METHODS.map(|method| (scene.clone(), method)))
        .collect();
    let alone: Vec<String> = runs.iter().map(|(scene, method)| files(scene, *method)).collect();
    for threads in [1, 2, 4] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let together: Vec<String> = pool.install(|| runs.par_iter().map(|(scene, method)| files(scene, *method)).collect());
        assert!(alone == together, "{threads} threads");
    }
}
