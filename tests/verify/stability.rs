//! Stability of steady sliding: eigenvalues against simulated runs.

use crate::blade::{Parts, STROKE};
use crate::scenes::committed;
use crate::sliding_growth::{simulated_end, simulated_growth};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use wiperlab::stability::speed_intervals::{SlidingState, unstable_range};
use wiperlab::stability::steady_sliding::SlideFinder;

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
