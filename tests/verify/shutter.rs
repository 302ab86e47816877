//! Places of the blade by the polynomials of the steps, and their means over an open shutter: against the
//! angles, against fine quadrature, and through transitions.

use crate::scenes::committed;
use wiperlab::simulate::mode::TipMode;
use wiperlab::simulate::scene::Scene;
use wiperlab::simulate::twin::{Camera, film_scene};
use wiperlab::simulate::{
    BladePoints, IntegrationMethod, Observer, SolutionSegment, SolverOptions, run_scene_with,
};

/// A blade that slips, sticks and flies, the last with impacts.
fn flying() -> Scene {
    let text = include_str!("../../data/scenes/light-blade.toml")
        .replace("preload_force_n = 0.2813", "preload_force_n = 0.03")
        + "[contact]\nloss = \"fly\"\njam = \"impact\"\n";
    Scene::parse("light.toml", &text).unwrap()
}

fn values(place: &BladePoints) -> [f64; 4] {
    [place.head_x_m, place.head_drop_m, place.tip_x_m, place.tip_height_m]
}

fn apart(a: [f64; 4], b: [f64; 4]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Looks at every piece of both scenes at a tolerance and a method; the modes that were seen.
fn watch(effort: SolverOptions, look: impl FnMut(&SolutionSegment<'_>)) -> Vec<TipMode> {
    struct Look<F>(F, Vec<TipMode>);
    impl<F: FnMut(&SolutionSegment<'_>)> Observer for Look<F> {
        fn observe_segment(&mut self, piece: &SolutionSegment<'_>) {
            (self.0)(piece);
            if !self.1.contains(&piece.mode) {
                self.1.push(piece.mode);
            }
        }
    }
    let mut look = Look(look, Vec::new());
    for scene in [flying(), committed("actual-blade")] {
        run_scene_with(&scene, effort, &mut look);
    }
    look.1
}

fn with(relative: f64, method: IntegrationMethod) -> SolverOptions {
    SolverOptions { method, ..SolverOptions::new(relative) }
}

fn assert_all(modes: &[TipMode]) {
    assert!(
        modes.contains(&TipMode::Stick) && modes.contains(&TipMode::Flight) && modes.len() == 4,
        "{modes:?}"
    );
}

/// Time at a share of a piece, its end to the bit.
fn at(piece: &SolutionSegment<'_>, share: f64) -> f64 {
    if share == 1.0 { piece.end_s } else { piece.start_s + share * (piece.end_s - piece.start_s) }
}

#[test]
fn a_place_and_a_pose_are_the_samples_to_the_bit() {
    let modes = watch(SolverOptions::new(1e-8), |piece| {
        for share in [0.0, 0.3, 1.0] {
            let t = at(piece, share);
            let (sample, place, pose) = (piece.sample_at(t), piece.points_at(t), piece.pose_at(t));
            let expected = [sample.head_x_m, sample.head_drop_m, sample.tip_x_m, sample.tip_height_m];
            assert_eq!(values(&place).map(f64::to_bits), expected.map(f64::to_bits));
            assert_eq!(pose, sample.pose);
        }
    });
    assert_all(&modes);
}

/// Both are truncated at the same order, so they differ by what a step may err, and by rounding alone at
/// the tightest tolerance.
#[test]
fn polynomials_give_the_places_of_the_poses() {
    for (relative, most_m) in [(1e-6, 1e-9), (1e-9, 1e-12), (1e-13, 1e-16)] {
        let mut worst: f64 = 0.0;
        let modes = watch(SolverOptions::new(relative), |piece| {
            let path = piece.path();
            for share in [0.0, 0.21, 0.5, 0.83, 1.0] {
                let t = at(piece, share);
                worst = worst.max(apart(values(&path.points_at(t)), values(&piece.points_at(t))));
            }
        });
        assert_all(&modes);
        assert!(worst < most_m, "tolerance {relative:e}: {worst:e} m");
    }
}

#[test]
fn a_tip_that_sticks_has_one_place() {
    watch(SolverOptions::new(1e-8), |piece| {
        if piece.mode == TipMode::Stick {
            let path = piece.path();
            let [first, last] = [path.points_at(piece.start_s), path.points_at(piece.end_s)];
            assert_eq!(first.tip_x_m.to_bits(), last.tip_x_m.to_bits());
            assert_eq!(first.tip_height_m, 0.0);
        }
    });
}

/// Integral of the places by the two-point rule of Gauss on many parts.
fn quadrature(piece: &SolutionSegment<'_>, from: f64, to: f64) -> [f64; 4] {
    const PARTS: usize = 200;
    let half = 0.5 * (to - from) / PARTS as f64;
    let nodes = (0..PARTS).flat_map(|i| {
        let middle = from + (2 * i + 1) as f64 * half;
        [-1.0, 1.0].map(|side| middle + side * half / 3f64.sqrt())
    });
    nodes
        .map(|t| values(&piece.points_at(t)))
        .fold([0.0; 4], |sum, place| std::array::from_fn(|i| sum[i] + half * place[i]))
}

/// The integral over a part of a piece, as a mean; for both kinds of solutions.
#[test]
fn integrals_are_those_of_fine_quadrature() {
    for method in [IntegrationMethod::Taylor, IntegrationMethod::RungeKutta] {
        let (mut worst, mut number): (f64, usize) = (0.0, 0);
        let modes = watch(with(1e-12, method), |piece| {
            number += 1;
            let [from, to] = [0.13, 0.94].map(|share| at(piece, share));
            if !number.is_multiple_of(17) || to - from < 1e-7 {
                return;
            }
            let (found, exact) =
                (values(&piece.path().integrate_points(from, to)), quadrature(piece, from, to));
            worst = worst.max(apart(found, exact) / (to - from));
        });
        assert_all(&modes);
        assert!(worst < 1e-13, "{method:?}: {worst:e} m");
    }
}

/// Frames of the bundled blade with long exposures, which hold several transitions and steps each.
fn frames(effort: SolverOptions, exposure_s: f64) -> Vec<[f64; 4]> {
    let mut scene = committed("actual-blade");
    scene.run.stop_s = 0.8;
    let camera = Camera { frame_rate_hz: 1000.0, exposure_s };
    let seen = film_scene(&scene, &camera, scene.start_s, scene.run.stop_s, effort).unwrap();
    let t = seen.recording.traces();
    (0..t.tip_x_m.len())
        .map(|i| [t.tip_x_m[i], t.tip_y_m[i], t.head_x_m[i], t.head_y_m[i]].map(Option::unwrap))
        .collect()
}

fn worst(a: &[[f64; 4]], b: &[[f64; 4]]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| apart(*a, *b)).fold(0.0, f64::max)
}

#[test]
fn frames_converge_with_the_tolerance_and_methods_agree() {
    for exposure_s in [0.0, 2e-4, 1e-3] {
        let exact = frames(with(1e-13, IntegrationMethod::Taylor), exposure_s);
        for relative in [1e-6, 1e-8, 1e-10] {
            let error = worst(&frames(with(relative, IntegrationMethod::Taylor), exposure_s), &exact);
            assert!(error < relative, "{exposure_s} s at {relative:e}: {error:e} m");
        }
        let other = worst(&frames(with(1e-13, IntegrationMethod::RungeKutta), exposure_s), &exact);
        assert!(other < 1e-10, "{exposure_s} s: {other:e} m");
    }
}

/// A frame is the mean of frames with shorter exposures that fill its own without a gap.
#[test]
fn a_long_exposure_is_the_mean_of_short_ones() {
    let mut scene = committed("actual-blade");
    scene.run.stop_s = 0.8;
    let tip = |frame_rate_hz: f64, exposure_s: f64, start_s: f64| {
        let camera = Camera { frame_rate_hz, exposure_s };
        let seen = film_scene(&scene, &camera, start_s, 0.8, SolverOptions::new(1e-9)).unwrap();
        seen.recording.traces().tip_x_m.iter().map(|x| x.unwrap()).collect::<Vec<f64>>()
    };
    let start_s = scene.start_s;
    let (long, short) = (tip(1000.0, 1e-3, start_s), tip(5000.0, 2e-4, start_s));
    for i in 1..long.len() - 1 {
        let mean = short[5 * i - 2..=5 * i + 2].iter().sum::<f64>() / 5.0;
        assert!((mean - long[i]).abs() < 1e-14, "frame {i}: {mean} instead of {}", long[i]);
    }
}

/// An exposure that ends where the scene ends sees the half that there is.
#[test]
fn the_shutter_at_the_ends_is_cut_to_the_run() {
    let scene = committed("actual-blade");
    let [start_s, stop_s] = [scene.start_s, scene.start_s + 0.1];
    let head = |frame_rate_hz: f64, exposure_s: f64| {
        let camera = Camera { frame_rate_hz, exposure_s };
        let seen = film_scene(&scene, &camera, start_s, stop_s, SolverOptions::new(1e-10)).unwrap();
        seen.recording.traces().head_x_m.iter().map(|x| x.unwrap()).collect::<Vec<f64>>()
    };
    // the first 5 ms are one frame's half, and a half and two frames of another camera
    let (long, short) = (head(100.0, 1e-2), head(500.0, 2e-3));
    assert_eq!((long.len(), short.len()), (11, 51));
    let expected = (0.5 * short[0] + short[1] + short[2]) / 2.5;
    assert!((long[0] - expected).abs() < 1e-15, "{} instead of {expected}", long[0]);
}
