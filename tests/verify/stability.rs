//! Stability of steady sliding: eigenvalues against simulated runs.

use crate::blade::{Parts, STROKE};
use crate::scenes::committed;
use crate::sliding_growth::{simulated_end, simulated_growth};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;
use wiperlab::model::parameter_spread::ParameterSpread;
use wiperlab::simulate::scene::Scene;
use wiperlab::stability::chatter::ChatterNumber;
use wiperlab::stability::journal::EvaluationLog;
use wiperlab::stability::speed_intervals::{SlidingState, unstable_range};
use wiperlab::stability::steady_sliding::SlideFinder;
use wiperlab::stability::study::{StabilityStudy, StudyRange};

/// Perturbations of 1e-6 grow in simulated runs at the rate of the leading eigenvalue.
#[test]
fn perturbations_of_steady_sliding_grow_at_the_rate_of_the_leading_eigenvalue() {
    let mut compared = 0;
    for name in ["actual-blade", "light-blade", "published-simulation"] {
        let scene = committed(name);
        for speed in [0.05, 0.2, 0.5] {
            let Some(simulated) = simulated_growth(&scene, speed) else { continue };
            let mode = SlideFinder::new(&scene.linkage, 1.0).find_slide(speed).unwrap().leading_mode();
            let scale = 1e-6 * std::f64::consts::TAU * mode.frequency_hz;
            let growth = mode.growth_per_s;
            assert!((simulated - growth).abs() < scale, "{name}, {speed} m/s: {simulated}, {growth} 1/s");
            compared += 1;
        }
    }
    assert_eq!(compared, 9);
}

/// For random blades, simulated perturbations stop growing at the computed end of the instability.
#[test]
fn steady_sliding_becomes_stable_where_simulated_perturbations_decay() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
    let mut compared = 0;
    for _ in 0..20 {
        let scene = Parts::random(&mut rng).scene(STROKE);
        let intervals = SlideFinder::new(&scene.linkage, 1.0).find_intervals([0.0, 2.0], 60);
        let Some([_, end]) = unstable_range(&intervals).filter(|range| range[1] < 2.0) else { continue };
        let found = simulated_end(&scene, [0.97 * end, 1.03 * end]);
        let Some(found) = found else { continue };
        assert!((found / end - 1.0).abs() < 2e-3, "{found} m/s in runs, {end} m/s by eigenvalues");
        compared += 1;
    }
    assert!(compared >= 8, "{compared}");
}

/// Steady sliding of the damped light blade is stable at all speeds if friction does not fall with speed.
#[test]
fn a_damped_blade_with_constant_friction_is_stable_at_all_speeds() {
    let scene = committed("light-blade").with_parameter("friction.a", 0.0).unwrap();
    let intervals = SlideFinder::new(&scene.linkage, 1.0).find_intervals([0.0, 2.0], 100);
    assert_eq!(intervals.len(), 1);
    assert_eq!((intervals[0].state, intervals[0].speeds_m_per_s), (SlidingState::Stable, [0.0, 2.0]));
    assert_eq!(unstable_range(&intervals), None);
}

/// The intervals of a belt's numbers are those of their closed forms: the end is `ln(N a b / d) / b`, and the
/// slope of friction is `-a b exp(-b V)`. With correlated parameters the effects partly cancel. If the
/// intervals are wide enough, the sentences say what is undecided.
#[test]
fn intervals_of_a_fit_are_propagated_to_end_and_slope() {
    let (d, normal, a, b) = (0.669, 2.4525, 0.2, 10.0);
    let text = format!(
        "format = 1\ntitle = \"belt\"\n[slider]\nmass_kg = 3.0799\nstiffness_n_per_m = 1191.0\n\
         damping_n_s_per_m = {d}\nnormal_force_n = {normal}\n[friction]\na = {a}\nb_s_per_m = {b}\nc = 0.15\n\
         [drive]\nspeed_m_per_s = 0.1\n[run]\nstop_s = 1.0\nsample_rate_hz = 100.0\n"
    );
    let scene = Scene::parse("belt.toml", &text).unwrap();
    let range = StudyRange { speeds_m_per_s: [0.0, 1.0], preloads_n: None, points: 50 };
    let study = StabilityStudy::from_scene(&scene, range, &mut EvaluationLog::without_journal()).unwrap();
    let spread = |share: f64, correlation: Option<f64>| ParameterSpread {
        names: vec!["friction.a".to_owned(), "slider.damping_n_s_per_m".to_owned()],
        estimates: vec![a, d],
        halves_95: vec![Some(share * a), Some(share * d)],
        correlations: vec![vec![Some(1.0), correlation], vec![correlation, Some(1.0)]],
    };
    let summarise = |spread: &ParameterSpread| {
        study.summarise_chatter(&scene, Some(spread), &mut EvaluationLog::without_journal()).unwrap()
    };
    for correlation in [-0.5_f64, 0.0, 0.9] {
        let found = summarise(&spread(0.01, Some(correlation)));
        let end = found.numbers[&ChatterNumber::End].half_95.unwrap();
        let expected = 0.01 / b * (2.0 - 2.0 * correlation).sqrt();
        assert!((end / expected - 1.0).abs() < 1e-4, "{end}, expected {expected}");
        let slope = found.numbers[&ChatterNumber::FrictionSlope];
        let expected = -a * b * (-b * found.speed_m_per_s.unwrap()).exp();
        assert!((slope.value / expected - 1.0).abs() < 1e-6, "{slope:?}, expected {expected}");
        assert!((slope.half_95.unwrap() / (0.01 * expected.abs()) - 1.0).abs() < 1e-4, "{slope:?}");
        assert!(found.sentences.iter().all(|sentence| !sentence.contains("undecided")), "{found:?}");
    }
    let unknown = summarise(&spread(0.01, None));
    assert_eq!(unknown.numbers[&ChatterNumber::End].half_95, None);
    assert!(unknown.numbers[&ChatterNumber::FrictionSlope].half_95.is_some());
    let wide = summarise(&spread(1.5, Some(0.0)));
    assert!(wide.sentences[1].contains("whether friction falls with speed there is undecided"), "{wide:?}");
}

/// A mass on a belt: small vibrations grow at `(N a b exp(-b V) - d) / (2 m)`. They end at the speed
/// `V = ln(N a b / d) / b`, and stiffness does not move this end.
#[test]
fn a_slider_grows_and_ends_as_a_mass_on_a_belt() {
    const TEXT: &str = "format = 1\ntitle = \"belt\"\n[slider]\nmass_kg = 3.0799\nstiffness_n_per_m = 1191.0\n\
                        damping_n_s_per_m = 0.669\nnormal_force_n = 2.4525\n[friction]\na = 0.2\nb_s_per_m = 10.0\n\
                        c = 0.15\n[drive]\nspeed_m_per_s = 0.1\n[run]\nstop_s = 1.0\nsample_rate_hz = 100.0\n";
    let (m, k, d, normal, a, b) = (3.0799, 1191.0, 0.669, 2.4525, 0.2, 10.0);
    let scene = Scene::parse("belt.toml", TEXT).unwrap();
    for speed in [0.0_f64, 0.05, 0.19, 0.3, 1.0] {
        let slide = SlideFinder::new(&scene.linkage, 1.0).find_slide(speed).unwrap();
        let modes = &slide.modes;
        let growth = (normal * a * b * (-b * speed).exp() - d) / (2.0 * m);
        let omega = (k / m - growth * growth).sqrt();
        assert_eq!(modes.len(), 1, "{modes:?}");
        assert!((modes[0].growth_per_s - growth).abs() < 1e-12 * omega, "{modes:?}, {growth} 1/s");
        assert!((modes[0].frequency_hz * TAU - omega).abs() < 1e-12 * omega, "{modes:?}, {omega} rad/s");
        assert_eq!(slide.normal_n, normal);
    }
    let range = StudyRange { speeds_m_per_s: [0.0, 1.0], preloads_n: None, points: 50 };
    let study = StabilityStudy::from_scene(&scene, range, &mut EvaluationLog::without_journal()).unwrap();
    let [onset, end] = study.unstable_range().unwrap();
    let expected = (normal * a * b / d).ln() / b;
    assert_eq!(onset, 0.0);
    assert!((end / expected - 1.0).abs() < 1e-7, "{end} m/s, expected {expected} m/s");
    // the derivatives by the logarithms of the parameters, per step of 1 %
    for (name, derivative) in [
        ("slider.damping_n_s_per_m", -1.0 / b),
        ("slider.normal_force_n", 1.0 / b),
        ("friction.a", 1.0 / b),
        ("friction.b_s_per_m", 1.0 / b - expected),
    ] {
        let change = study.changes.iter().find(|change| change.parameter.name == name).unwrap();
        let moved = change.end_m_per_s.unwrap();
        assert!((moved - 0.01 * derivative).abs() < 1e-4 * 0.01 * derivative.abs(), "{name}: {moved} m/s");
        assert_eq!(change.onset_m_per_s, None);
    }
    assert!(study.changes.iter().all(|change| change.parameter.name != "slider.stiffness_n_per_m"));
}
