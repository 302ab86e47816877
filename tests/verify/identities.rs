//! What must hold of every run whatever the blade: symmetries, balances, linear limits, steady slip, and
//! insensitivity to the tolerance.

use crate::scenes::{both, committed, seen, upright_light_blade};
use hybrid_ode::HybridPhase;
use nalgebra::{Complex, Matrix4, Vector4};
use std::f64::consts::TAU;
use wiperlab::model::friction::FrictionLaw;
use wiperlab::model::modes::{TipConstraint, natural_modes};
use wiperlab::model::shoulder::ShoulderContact;
use wiperlab::model::{LinkDirections, Linkage, Pose, Spring};
use wiperlab::simulate::equilibrium::steady_slip_pose;
use wiperlab::simulate::mode::TipMode;
use wiperlab::simulate::outputs::SampleObserver;
use wiperlab::simulate::phases::{DrivenBlade, SlipPhase, StickPhase};
use wiperlab::simulate::scene::{Drive, Scene, StartKind};
use wiperlab::simulate::{
    RunStatus, SolverOptions, Transition, TransitionCause, build_system, run_scene_with,
};

fn mirrored(mode: TipMode) -> TipMode {
    match mode {
        TipMode::SlipForward => TipMode::SlipBackward,
        TipMode::SlipBackward => TipMode::SlipForward,
        other => other,
    }
}

/// The same transitions in number and kind, each within `most_s` of its counterpart.
fn assert_same(what: &str, a: &[Transition], b: &[Transition], most_s: f64) {
    assert_eq!(a.len(), b.len(), "{what}: number of transitions");
    for (i, (x, y)) in a.iter().zip(b).enumerate() {
        assert_eq!(
            (x.from, x.to, x.cause),
            (y.from, y.to, y.cause),
            "{what}: transition {i} at {} s",
            x.time_s
        );
        assert!(
            (x.time_s - y.time_s).abs() <= most_s,
            "{what}: transition {i} at {} and {} s",
            x.time_s,
            y.time_s
        );
    }
}

#[test]
fn the_mirrored_drive_gives_the_mirrored_motion() {
    for scene in both() {
        let original = seen(&scene, 1e-8);
        let Drive::Cosine { amplitude_m, frequency_hz, delay_s } = scene.drive else {
            panic!("a cosine drive")
        };
        let mut mirror = scene.clone();
        mirror.drive = Drive::Cosine { amplitude_m: -amplitude_m, frequency_hz, delay_s };
        let mut image = seen(&mirror, 1e-8);
        for t in &mut image.transitions {
            (t.from, t.to) = (mirrored(t.from), mirrored(t.to));
        }
        assert!(!original.transitions.is_empty());
        assert_same(scene.title(), &original.transitions, &image.transitions, 1e-12);
        let (last, last_image) = (original.samples.last().unwrap(), image.samples.last().unwrap());
        assert!(
            (last.pose.theta + last_image.pose.theta).abs() < 1e-10
                && (last.tip_x_m + last_image.tip_x_m).abs() < 1e-12
        );
        assert!(
            (last.normal_n - last_image.normal_n).abs() < 1e-8
                && (last.friction_n + last_image.friction_n).abs() < 1e-8
        );
    }
}

/// Every mass, inertia, stiffness and damping times a factor; the preload displacement stays, so the preload
/// force scales too.
fn scaled(blade: &Linkage, factor: f64) -> Linkage {
    let spring = |s: Spring| Spring { stiffness: factor * s.stiffness, damping: factor * s.damping };
    let mut shoulder = blade.shoulder;
    if let Some(s) = &mut shoulder {
        s.stiffness_n_m_per_rad *= factor;
        s.damping_n_m_s_per_rad *= factor;
    }
    Linkage {
        mass_kg: factor * blade.mass_kg,
        m_a: factor * blade.m_a,
        m_b: factor * blade.m_b,
        m_c: factor * blade.m_c,
        m_theta: factor * blade.m_theta,
        m_phi: factor * blade.m_phi,
        head: spring(blade.head),
        neck: spring(blade.neck),
        lip: spring(blade.lip),
        shoulder,
        ..*blade
    }
}

#[test]
fn a_heavier_and_equally_stiffer_blade_moves_alike() {
    for scene in both() {
        let original = seen(&scene, 1e-8);
        let mut other = scene.clone();
        other.linkage = scaled(&scene.linkage, 4.0); // a power of two: not even rounding differs
        let image = seen(&other, 1e-8);
        assert_same(scene.title(), &original.transitions, &image.transitions, 0.0);
        let (last, last_image) = (original.samples.last().unwrap(), image.samples.last().unwrap());
        assert_eq!(last.pose, last_image.pose);
        assert_eq!(4.0 * last.normal_n, last_image.normal_n);
        assert_eq!(4.0 * last.energy_j, last_image.energy_j);
    }
}

#[test]
fn energy_is_balanced() {
    for scene in both() {
        for relative in [1e-6, 1e-8, 1e-10] {
            let residual = seen(&scene, relative).audit.energy_residual_relative();
            assert!(residual < 100.0 * relative, "{} at {relative:e}: {residual:e}", scene.title());
        }
    }
}

/// How far the error of a run may move a transition, s per unit of the tolerance. That times err in
/// proportion to the tolerance is what is tested, over four decades; the factor gathers thousands of steps
/// and what friction that falls with speed makes of them, and is an upper bound of what these two scenes show
/// (7 to 32), not a derived number.
const MOST_SHIFT_S: f64 = 100.0;

#[test]
fn transitions_do_not_depend_on_the_tolerance() {
    for scene in both() {
        let fine = seen(&scene, 1e-12);
        assert_eq!(fine.run.status, RunStatus::Completed);
        for relative in [1e-6, 1e-7, 1e-8, 1e-9, 1e-10] {
            let coarse = seen(&scene, relative);
            assert_eq!(coarse.run.status, RunStatus::Completed);
            assert_eq!(coarse.run.transitions, coarse.transitions.len() as u64);
            assert_same(
                &format!("{} at {relative:e}", scene.title()),
                &coarse.transitions,
                &fine.transitions,
                MOST_SHIFT_S * relative,
            );
        }
    }
}

#[test]
fn stick_holds_the_tip_and_its_friction_does_no_work() {
    for scene in both() {
        let seen = seen(&scene, 1e-8);
        assert!(seen.audit.max_constraint_drift_m < 1e-15, "{:e}", seen.audit.max_constraint_drift_m);
        let blade = &scene.linkage;
        let mut stuck = 0;
        for sample in seen.samples.iter().filter(|s| s.mode == TipMode::Stick) {
            stuck += 1;
            assert_eq!(sample.tip_velocity_m_per_s, 0.0);
            let velocity = blade.tip_velocity_m_per_s(
                &sample.pose,
                &LinkDirections::from_pose(&sample.pose),
                &scene.drive.motion_at(sample.time_s),
            );
            assert!(
                (sample.friction_n * velocity).abs() < 1e-15,
                "{} W at {} s",
                sample.friction_n * velocity,
                sample.time_s
            );
            assert!(
                sample.friction_n.abs()
                    <= blade.friction.static_coefficient(1.0) * sample.normal_n * (1.0 + 1e-9),
                "at {} s",
                sample.time_s
            );
        }
        // a phase of stick has at least one piece, and every piece is sampled at both ends
        let phases = seen.transitions.iter().filter(|t| t.to == TipMode::Stick).count();
        assert!(phases > 0 && stuck >= 2 * phases, "{stuck} samples in {phases} phases of stick");
    }
}

/// The light blade without friction, pressed on lightly, its head at rest.
fn frictionless() -> Scene {
    let mut scene = upright_light_blade().with_parameter("blade.preload_force_n", 0.02).unwrap();
    scene.linkage.friction = FrictionLaw::exponential(0.0, 0.0, 0.0);
    scene.drive = Drive::Uniform { speed_m_per_s: 0.0 };
    scene.run.stop_s = 0.05;
    scene
}

/// Without friction the tip never sticks: it turns back twice a period.
#[test]
fn without_friction_and_damping_the_tip_turns_at_the_natural_frequencies() {
    let mut scene = frictionless();
    for spring in [&mut scene.linkage.head, &mut scene.linkage.neck, &mut scene.linkage.lip] {
        spring.damping = 0.0;
    }
    for mode in natural_modes(&scene.linkage, TipConstraint::Free, false) {
        let frequency = mode.frequency_hz.unwrap();
        // an amplitude whose square, the size of what linearising leaves out, is below the tolerance
        scene.start = StartKind::State(Pose {
            theta: 2e-6,
            phi: 2e-6 * mode.lip_over_neck,
            theta_rate: 0.0,
            phi_rate: 0.0,
        });
        let seen = seen(&scene, 1e-12);
        assert_eq!(seen.run.status, RunStatus::Completed);
        let times: Vec<f64> = seen.transitions.iter().map(|t| t.time_s).collect();
        assert!(seen.transitions.iter().all(|t| t.cause == TransitionCause::DirectReversal));
        let expected = (2.0 * frequency * 0.05).floor() as usize;
        assert_eq!(times.len(), expected, "{frequency} Hz");
        for (i, t) in times.iter().enumerate() {
            assert!(
                (t * 2.0 * frequency - (i + 1) as f64).abs() < 1e-4,
                "{frequency} Hz: reversal {i} at {t} s"
            );
        }
    }
}

/// Jacobian of a right-hand side by central differences; `steps` are the sizes on which each state is smooth.
fn jacobian<const N: usize>(
    f: impl Fn(&[f64; N]) -> [f64; N],
    y: &[f64; N],
    steps: [f64; N],
) -> [[f64; N]; N] {
    let mut rows = [[0.0; N]; N];
    for j in 0..N {
        let moved = |by: f64| {
            let mut moved = *y;
            moved[j] += by;
            f(&moved)
        };
        let (ahead, behind) = (moved(steps[j]), moved(-steps[j]));
        for i in 0..N {
            rows[i][j] = (ahead[i] - behind[i]) / (2.0 * steps[j]);
        }
    }
    rows
}

fn oscillating(a: &Matrix4<f64>) -> Vec<Complex<f64>> {
    let mut pairs: Vec<Complex<f64>> =
        a.complex_eigenvalues().iter().copied().filter(|e| e.im > 0.0).collect();
    pairs.sort_by(|x, y| x.im.total_cmp(&y.im));
    pairs
}

fn matrix(rows: [[f64; 4]; 4]) -> Matrix4<f64> {
    Matrix4::from_fn(|i, j| rows[i][j])
}

#[test]
fn damped_modes_are_those_of_the_linearised_phases() {
    let mut actual = committed("actual-blade").with_parameter("blade.preload_force_n", 0.02).unwrap(); // with its own it would buckle upright
    actual.drive = Drive::Uniform { speed_m_per_s: 0.0 };
    for scene in [frictionless(), actual] {
        let mut blade = scene.linkage;
        blade.friction = FrictionLaw::exponential(0.0, 0.0, 0.0);
        let system = DrivenBlade { linkage: blade, ..build_system(&scene) };
        let slip = SlipPhase { system: &system, direction: 1.0, lean: ShoulderContact::Off, piece: 0 };
        let found =
            oscillating(&matrix(jacobian(|y| slip.derivative(0.0, y), &[0.0; 4], [1e-6, 1e-6, 1e-2, 1e-2])));
        let expected = natural_modes(&blade, TipConstraint::Free, false);
        assert_eq!((found.len(), expected.len()), (2, 2));
        for (e, mode) in found.iter().zip(expected) {
            assert!(
                (e.im / TAU / mode.damped_frequency_hz.unwrap() - 1.0).abs() < 1e-7,
                "{e} against {mode:?}"
            );
            assert!(
                (-e.re / e.norm() / mode.damping_ratio.unwrap() - 1.0).abs() < 1e-6,
                "{e} against {mode:?}"
            );
        }
        let upright = Pose { theta: 0.0, phi: 0.0, theta_rate: 0.0, phi_rate: 0.0 };
        let stick = StickPhase::from_pose(&system, 0.0, &upright, ShoulderContact::Off);
        let [[zero, one], [stiffness, damping]] =
            jacobian(|y| stick.derivative(0.0, y), &[0.0; 2], [1e-6, 1e-2]);
        assert!(zero == 0.0 && (one - 1.0).abs() < 1e-12);
        let held = natural_modes(&blade, TipConstraint::Held, false)[0];
        assert!(((-stiffness).sqrt() / TAU / held.frequency_hz.unwrap() - 1.0).abs() < 1e-7);
        assert!((-damping / 2.0 / (-stiffness).sqrt() / held.damping_ratio.unwrap() - 1.0).abs() < 1e-6);
    }
}

/// Eigenvector of an eigenvalue by inverse iteration.
fn eigenvector(a: &Matrix4<f64>, eigenvalue: Complex<f64>) -> Vector4<Complex<f64>> {
    let shift = eigenvalue * (1.0 + 1e-9);
    let shifted = a.map(|x| Complex::new(x, 0.0)) - Matrix4::identity() * shift;
    let mut v = Vector4::from_element(Complex::new(1.0, 0.3));
    for _ in 0..4 {
        v = shifted.lu().solve(&v).unwrap();
        v /= Complex::new(v.norm(), 0.0);
    }
    v
}

/// A head dragged at constant speed: a small deviation from steady slip grows and turns as the eigenvalues of
/// the linearised phase say.
#[test]
fn a_deviation_from_steady_slip_grows_at_the_rate_of_its_eigenvalue() {
    const SAMPLES: usize = 400;
    let mut growing = 0;
    for (friction_b, speed) in [(7.95, 0.06), (2.0, 0.3)] {
        let mut scene = upright_light_blade().with_parameter("friction.b_s_per_m", friction_b).unwrap();
        scene.drive = Drive::Uniform { speed_m_per_s: speed };
        let pose = steady_slip_pose(&scene.linkage, speed).unwrap();
        let rest = [pose.theta, pose.phi, 0.0, 0.0];
        let whole = build_system(&scene);
        let slip = SlipPhase { system: &whole, direction: 1.0, lean: ShoulderContact::Off, piece: 0 };
        assert!(slip.derivative(0.0, &rest).iter().all(|d| d.abs() < 1e-6), "steady slip is an equilibrium");
        let a = matrix(jacobian(|y| slip.derivative(0.0, y), &rest, [1e-6, 1e-6, 1e-2, 1e-2]));
        let fastest = oscillating(&a).iter().map(|e| e.re).fold(1.0, f64::max);
        for eigenvalue in oscillating(&a) {
            // the left eigenvector takes the amplitude of this mode alone out of a deviation
            let (left, right) = (eigenvector(&a.transpose(), eigenvalue), eigenvector(&a, eigenvalue));
            let deviation: [f64; 4] = std::array::from_fn(|i| 1e-7 * (right[i] / right[0]).re);
            // up to four periods, or until a mode has grown a hundredfold
            scene.run.stop_s = (4.0 * TAU / eigenvalue.im).min(100f64.ln() / fastest);
            let [theta, phi, theta_rate, phi_rate] = deviation;
            scene.start =
                StartKind::State(Pose { theta: rest[0] + theta, phi: rest[1] + phi, theta_rate, phi_rate });
            let mut amplitudes = Vec::new();
            let times = (0..=SAMPLES).map(|i| scene.run.stop_s * i as f64 / SAMPLES as f64);
            let mut sampler = SampleObserver::new(times, |s| {
                let y = [s.pose.theta, s.pose.phi, s.pose.theta_rate, s.pose.phi_rate];
                amplitudes.push((0..4).map(|i| left[i] * (y[i] - rest[i])).sum::<Complex<f64>>());
            });
            let run = run_scene_with(&scene, SolverOptions::new(1e-12), &mut sampler);
            assert_eq!((run.status, run.transitions), (RunStatus::Completed, 0));
            let (first, last) = (amplitudes[0], amplitudes[SAMPLES]);
            let turned: f64 = amplitudes.windows(2).map(|w| (w[1] / w[0]).arg()).sum();
            let rate = (last.norm() / first.norm()).ln() / scene.run.stop_s;
            assert!(
                (rate - eigenvalue.re).abs() < 0.01 * eigenvalue.re.abs(),
                "{eigenvalue}: grew at {rate}"
            );
            assert!(
                (turned / scene.run.stop_s / eigenvalue.im - 1.0).abs() < 1e-4,
                "{eigenvalue}: turned by {turned}"
            );
            growing += usize::from(eigenvalue.re > 0.0);
        }
    }
    assert!(growing > 0, "one of the cases is unstable, so growth is tried as well as decay");
}
