//! A run ends where a link reaches level, beyond which its hinge would be below the glass: blades so reduced
//! that the instant is known.

use crate::scenes::{both, seen, upright_light_blade};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_8};
use wiperlab::model::friction::FrictionLaw;
use wiperlab::model::{Linkage, Pose, Spring};
use wiperlab::simulate::mode::TipMode;
use wiperlab::simulate::scene::{Drive, Scene, StartKind};
use wiperlab::simulate::{RunStatus, run_scene};

/// Force with which the head presses, N, whatever its height: its spring is very long and very soft.
const PRESS_N: f64 = 0.3;
const SOFT_N_PER_M: f64 = 1e-12;
/// Stiffness of neck and lip, N m/rad: nothing against `PRESS_N` times their lengths, but not zero, so that
/// there are time scales.
const SLACK_N_M_PER_RAD: f64 = 1e-16;

/// Neck and lip have inertia but no mass, so that they move independently of each other and of the head.
fn reduced(friction: f64) -> Scene {
    let mut scene = upright_light_blade();
    let spring = |stiffness: f64| Spring { stiffness, damping: 0.0 };
    scene.linkage = Linkage {
        mass_kg: 0.0,
        m_a: 0.0,
        m_b: 0.0,
        m_c: 0.0,
        head: spring(SOFT_N_PER_M),
        neck: spring(SLACK_N_M_PER_RAD),
        lip: spring(SLACK_N_M_PER_RAD),
        preload_displacement_m: PRESS_N / SOFT_N_PER_M,
        friction: FrictionLaw::exponential(0.0, 0.0, friction),
        ..scene.linkage
    };
    scene
}

const AT_REST: Pose = Pose { theta: 0.0, phi: 0.0, theta_rate: 0.0, phi_rate: 0.0 };

/// Without friction one link, the other upright, moves by `q'' = w^2 sin q`, `w^2 = N l / inertia`. With the
/// rate `2 w sin(q/2)` it moves on the separatrix, `tan(q/4) = tan(q0/4) exp(w t)`. (The head runs so fast
/// that the tip does not turn.)
#[test]
fn slip_ends_where_a_link_is_level() {
    const FROM: f64 = 0.5;
    for (neck, side) in [(true, 1.0), (true, -1.0), (false, 1.0), (false, -1.0)] {
        let mut scene = reduced(0.0);
        scene.drive = Drive::Uniform { speed_m_per_s: 20.0 * side };
        let blade = &scene.linkage;
        let squared =
            if neck { PRESS_N * blade.l1_m / blade.m_theta } else { PRESS_N * blade.l2_m / blade.m_phi };
        let w = squared.sqrt();
        let (angle, rate) = (side * FROM, side * 2.0 * w * (0.5 * FROM).sin());
        scene.start = StartKind::State(if neck {
            Pose { theta: angle, theta_rate: rate, ..AT_REST }
        } else {
            Pose { phi: angle, phi_rate: rate, ..AT_REST }
        });
        let exact = (FRAC_PI_8.tan() / (0.25 * FROM).tan()).ln() / w;
        for relative in [1e-6, 1e-8, 1e-10] {
            let seen = seen(&scene, relative);
            let what = format!("neck {neck}, side {side} at {relative:e}: {:?}", seen.run);
            assert_eq!((seen.run.status, seen.run.transitions), (RunStatus::Diverged, 0), "{what}");
            assert!(
                (seen.run.stopped_at_s - exact).abs() * w < 20.0 * relative + 1e-9,
                "{what}, expected {exact}"
            );
            let angle = |p: &Pose| side * if neck { p.theta } else { p.phi };
            let (last, before) = seen.samples.split_last().unwrap();
            assert!((angle(&last.pose) - FRAC_PI_2).abs() < 1e-12, "{what}: {:?}", last.pose);
            assert!(before.iter().all(|s| angle(&s.pose) < FRAC_PI_2), "{what}");
        }
    }
}

/// With the tip held, an immovable neck and a moving head the lip follows by geometry alone: `l2 sin phi = l2
/// sin phi0 - v(t)`. It counts as level where its cosine is a thousandth, because its rate has no limit
/// there.
#[test]
fn stick_ends_where_the_link_that_follows_is_all_but_level() {
    for side in [1.0, -1.0] {
        let mut scene = reduced(1e9);
        scene.linkage.m_theta = 1e12;
        scene.linkage.neck.stiffness = 1e18;
        let Drive::Cosine { amplitude_m, frequency_hz, delay_s } = scene.drive else {
            panic!("a cosine drive")
        };
        scene.drive = Drive::Cosine { amplitude_m: side * amplitude_m, frequency_hz, delay_s };
        scene.start = StartKind::State(Pose { phi: side * 0.1, ..AT_REST });
        let way = scene.linkage.l2_m * (0.1f64.sin() + (1.0f64 - 1e-6).sqrt());
        let exact = (1.0 - way / amplitude_m).acos() / (std::f64::consts::TAU * frequency_hz);
        let seen = seen(&scene, 1e-8);
        assert_eq!((seen.run.status, seen.run.transitions), (RunStatus::Diverged, 0), "{:?}", seen.run);
        assert!(
            (seen.run.stopped_at_s - exact).abs() < 1e-12,
            "{} instead of {exact} s",
            seen.run.stopped_at_s
        );
        let last = seen.samples.last().unwrap();
        assert!(
            last.mode == TipMode::Stick
                && (last.pose.phi.cos() - 1e-3).abs() < 1e-9
                && side * last.pose.phi < 0.0,
            "{:?}",
            last.pose
        );
        assert!(seen.audit.max_constraint_drift_m < 1e-15);
    }
}

/// With the tip and the head held, the neck falls to level and the lip, ten times as long, follows. The work
/// of the pressing force is the neck's kinetic energy there, because the lip rests at that instant.
#[test]
fn stick_ends_where_the_free_link_is_level() {
    for side in [1.0, -1.0] {
        let mut scene = reduced(1e9);
        scene.drive = Drive::Uniform { speed_m_per_s: 0.0 };
        scene.linkage.l2_m = 10.0 * scene.linkage.l1_m;
        scene.start = StartKind::State(Pose { theta: side * 0.3, ..AT_REST });
        let (l1, l2) = (scene.linkage.l1_m, scene.linkage.l2_m);
        let seen = seen(&scene, 1e-10);
        assert_eq!((seen.run.status, seen.run.transitions), (RunStatus::Diverged, 0), "{:?}", seen.run);
        let last = seen.samples.last().unwrap();
        assert!(
            last.mode == TipMode::Stick && (side * last.pose.theta - FRAC_PI_2).abs() < 1e-12,
            "{:?}",
            last.pose
        );
        let sin_phi = (0.3f64.sin() - 1.0) * l1 / l2;
        assert!((side * last.pose.phi - sin_phi.asin()).abs() < 1e-12);
        let drop = l1 * 0.3f64.cos() + l2 * (1.0 - (1.0 - sin_phi * sin_phi).sqrt());
        let exact = (2.0 * PRESS_N * drop / scene.linkage.m_theta).sqrt();
        assert!(
            (side * last.pose.theta_rate / exact - 1.0).abs() < 1e-8,
            "{} instead of {exact} rad/s",
            last.pose.theta_rate
        );
    }
}

#[test]
fn a_start_with_a_link_past_level_ends_at_once() {
    for mut scene in both() {
        for pose in [
            Pose { theta: 1.6, ..AT_REST },
            Pose { phi: -1.6, ..AT_REST },
            Pose { theta: 3.0, phi: 3.0, theta_rate: 1.0, phi_rate: 1.0 },
        ] {
            scene.start = StartKind::State(pose);
            let run = run_scene(&scene, &mut ());
            assert_eq!(
                (run.status, run.stopped_at_s, run.transitions),
                (RunStatus::Diverged, scene.start_s, 0),
                "{pose:?}"
            );
        }
    }
}
