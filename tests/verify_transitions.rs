//! How runs end and change mode: lift-off, jamming and direct reversals happen where the forces say so.

#[path = "common/blade.rs"]
mod blade;
#[path = "common/scenes.rs"]
mod scenes;

use blade::{Parts, STROKE};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use scenes::{committed, seen};
use wiperlab::blade::Pose;
use wiperlab::simulate::mode::Mode;
use wiperlab::simulate::scene::{Scene, StartKind};
use wiperlab::simulate::{Effort, Observer, Piece, Status, run_with};

#[test]
fn contact_is_lost_where_the_normal_force_vanishes() {
    let scene = committed("light-blade").with("blade.preload_force_n", 0.03).unwrap();
    let [coarse, fine] = [1e-8, 1e-10].map(|relative| seen(&scene, relative));
    for run in [&coarse, &fine] {
        assert_eq!((run.run.status, run.transitions.len()), (Status::ContactLost, 5));
        let (last, before) = run.samples.split_last().unwrap();
        assert_eq!(last.time_s, run.run.stopped_at_s);
        assert!(last.normal_n.abs() < 1e-9, "{} N", last.normal_n);
        assert!(before.iter().all(|s| s.normal_n > 0.0), "the glass never pulls before");
    }
    assert!((coarse.run.stopped_at_s - fine.run.stopped_at_s).abs() < 1e-8);
}

/// A heavy head on a rough glass, the tip ahead of it and running on: where the paradox lies in wait.
fn heavy_head_leading_tip(rng: &mut Xoshiro256PlusPlus) -> Scene {
    let mut scene = committed("light-blade").with("blade.head_mass_kg", 0.5).unwrap().with("friction.c", 0.6).unwrap();
    let mut between = |low: f64, high: f64| rng.random_range(low..high);
    let pose = Pose { theta: between(0.1, 1.0), phi: between(0.1, 1.0), theta_rate: between(-50.0, 300.0), phi_rate: between(-50.0, 300.0) };
    scene.start = StartKind::State(pose);
    scene.run.stop_s = 0.02;
    scene
}

#[test]
fn the_tip_jams_where_the_painleve_indicator_vanishes() {
    const LEVEL: f64 = std::f64::consts::FRAC_PI_2;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
    let mut jams = 0;
    for i in 0..400 {
        let scene = heavy_head_leading_tip(&mut rng);
        let run = seen(&scene, 1e-8);
        let Some(last) = run.samples.last() else {
            assert_ne!(run.run.status, Status::Completed, "state {i} is refused at the start");
            continue;
        };
        assert_ne!(run.run.status, Status::Chattering, "state {i}");
        let level = last.pose.theta.abs().max(last.pose.phi.abs()) > LEVEL - 1e-3;
        assert!(run.run.status != Status::Diverged || level, "state {i}: {last:?}");
        if run.run.status == Status::Jammed && last.mode != Mode::Stick {
            jams += 1;
            assert_eq!(last.mode, Mode::SlipForward, "state {i}: the tip leads the head");
            assert!(last.pose.theta > 0.0 && last.pose.phi > 0.0 && last.tip_velocity_m_per_s > 0.0, "state {i}: {last:?}");
            assert!(last.indicator.abs() < 1e-4, "state {i}: {}", last.indicator);
            let fine = seen(&scene, 1e-10);
            assert_eq!(fine.run.status, Status::Jammed);
            assert!((fine.run.stopped_at_s - run.run.stopped_at_s).abs() < 1e-7, "state {i}");
        }
    }
    assert_eq!(jams, 14);
}

#[test]
fn a_fast_tip_on_slippery_glass_turns_without_stopping() {
    let mut scene = committed("light-blade").with("friction.a", 0.01).unwrap().with("friction.c", 0.02).unwrap();
    scene.start = StartKind::State(Pose { theta: 0.1, phi: 0.3, theta_rate: 0.0, phi_rate: 0.0 });
    scene.run.stop_s = 0.01;
    let seen = seen(&scene, 1e-9);
    assert_eq!(seen.run.status, Status::Completed);
    let reversals: Vec<_> = seen.transitions.iter().filter(|t| t.cause == "direct-reversal").collect();
    assert_eq!(reversals.len(), 5, "{:?}", seen.transitions);
    for reversal in reversals {
        assert_eq!(reversal.from.direction(), -reversal.to.direction());
        let [before, after] =
            [Mode::SlipForward, Mode::SlipBackward].map(|mode| seen.samples.iter().find(|s| s.time_s == reversal.time_s && s.mode == mode).unwrap());
        let limit = scene.linkage.friction.at_rest();
        for sample in [before, after] {
            assert!(
                (sample.friction_n + sample.mode.direction() * limit * sample.normal_n).abs() < 1e-6 * sample.normal_n,
                "full friction at {} s",
                sample.time_s
            );
            assert!(sample.tip_velocity_m_per_s.abs() < 1e-9);
        }
    }
}

/// Random blades that are watched.
const BLADES: usize = 8;

/// Looks inside every piece for what should have ended it: a tip that slides the wrong way, a glass that pulls, a stick beyond its limit.
struct Watch {
    /// Tip speed that is no more than the error of the solution, m/s.
    slack_m_per_s: f64,
    static_limit: f64,
    looks: usize,
    missed: Vec<String>,
}

impl Observer for Watch {
    fn piece(&mut self, piece: &Piece<'_>) {
        /// Looks a piece: a dip that is shorter than this share of a step is found by luck only.
        const LOOKS: usize = 200;
        for i in 1..LOOKS {
            let sample = piece.sample(piece.start_s + (piece.end_s - piece.start_s) * i as f64 / LOOKS as f64);
            self.looks += 1;
            let backwards = sample.mode.direction() * sample.tip_velocity_m_per_s < -self.slack_m_per_s;
            let pulls = sample.normal_n < 0.0 && sample.indicator > 1e-3;
            let held_too_hard = sample.mode == Mode::Stick && sample.friction_n.abs() > self.static_limit * sample.normal_n * (1.0 + 1e-4);
            if backwards || pulls || held_too_hard {
                self.missed.push(format!("{sample:?}"));
            }
        }
    }
}

#[test]
fn no_transition_is_missed_inside_a_piece() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let random: Vec<Scene> = (0..BLADES).map(|_| Parts::random(&mut rng).scene(STROKE)).collect();
    for scene in [committed("light-blade"), committed("actual-blade")].iter().chain(&random) {
        for relative in [1e-4, 1e-6, 1e-8] {
            let static_limit = scene.linkage.friction.at_rest();
            let mut watch = Watch { slack_m_per_s: 10.0 * relative, static_limit, looks: 0, missed: Vec::new() };
            run_with(scene, Effort::new(relative), &mut watch);
            assert!(watch.looks > 0);
            assert!(watch.missed.is_empty(), "{} misses at {relative:e}, the first: {}", watch.missed.len(), watch.missed[0]);
        }
    }
}
