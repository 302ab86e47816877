//! How far a force on the tip moves it: exact for a blade without damping.

use crate::scenes::both;
use std::f64::consts::TAU;
use wiperlab::model::modes::{TipConstraint, natural_modes, tip_compliance};
use wiperlab::model::{Linkage, Spring};

/// A blade without damping.
fn undamped(blade: &Linkage) -> Linkage {
    let without = |spring: Spring| Spring { damping: 0.0, ..spring };
    let mut blade = Linkage { neck: without(blade.neck), lip: without(blade.lip), ..*blade };
    blade.shoulder.iter_mut().for_each(|shoulder| shoulder.damping_n_m_s_per_rad = 0.0);
    blade
}

#[test]
fn it_is_the_sum_over_the_modes() {
    for scene in both() {
        let blade = undamped(&scene.linkage);
        for on_shoulder in [false, true] {
            for frequency_hz in [1.0, 60.0, 300.0, 2500.0] {
                let one = |mode: &wiperlab::model::modes::NaturalMode| {
                    let (r, w) = (mode.lip_over_neck, TAU * frequency_hz);
                    let mass = blade.m_theta + 2.0 * r * blade.m_c + r * r * blade.m_phi;
                    let shown = blade.l1_m + r * blade.l2_m;
                    let natural = TAU * mode.frequency_hz.unwrap();
                    shown * shown / (mass * (natural * natural - w * w))
                };
                let expected: f64 =
                    natural_modes(&blade, TipConstraint::Free, on_shoulder).iter().map(one).sum();
                let found = tip_compliance(&blade, on_shoulder, frequency_hz);
                assert!((found.re / expected - 1.0).abs() < 1e-9, "{frequency_hz}: {} {expected}", found.re);
                assert_eq!(found.im, 0.0);
            }
        }
    }
}

#[test]
fn it_vanishes_where_the_blade_swings_with_its_tip_held() {
    for scene in both() {
        let blade = undamped(&scene.linkage);
        let held = natural_modes(&blade, TipConstraint::Held, false)[0].frequency_hz.unwrap();
        let (at, below) = (tip_compliance(&blade, false, held), tip_compliance(&blade, false, 0.5 * held));
        assert!(at.re.abs() < 1e-9 * below.re.abs(), "{} {}", at.re, below.re);
    }
}
