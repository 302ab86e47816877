//! Blades at the ends of what a scene may say: the list of transitions is the same for both methods and every
//! tolerance, the energy is balanced, the tip does not creep.

use super::scenes::{committed, upright_light_blade};
use super::{MORE, cases, ran};
use wiperlab::model::Pose;
use wiperlab::simulate::scene::{Scene, StartKind};
use wiperlab::simulate::{IntegrationMethod, RunStatus, TransitionCause};

fn with(mut scene: Scene, values: &[(&str, f64)]) -> Scene {
    for (name, value) in values {
        scene = scene.with_parameter(name, *value).unwrap();
    }
    scene
}

/// The light blade with parameters set, 0.6 s from upright.
fn light(values: &[(&str, f64)]) -> Scene {
    let mut scene = with(upright_light_blade(), values);
    scene.run.stop_s = 0.6;
    scene
}

/// The actual blade with its shoulder, 0.3 s around the reversal.
fn actual(values: &[(&str, f64)]) -> Scene {
    let mut scene = with(committed("actual-blade"), values);
    scene.run.stop_s = scene.start_s + 0.3;
    scene
}

/// What a parameter of the light blade is multiplied by.
fn times(name: &str, factor: f64) -> f64 {
    factor * upright_light_blade().value(name).unwrap()
}

/// Loosest tolerances of the Taylor series and of Runge-Kutta at which the list must be complete.
type From = [f64; 2];

/// Runs a scene by both methods; from the given tolerances on the list is that of the reference and its times
/// differ by at most `MORE` tolerances. Energy and stick are held to theirs at every tolerance.
fn assert_one_list(name: &str, scene: &Scene, from: From, status: RunStatus) {
    let reference = ran(scene, IntegrationMethod::Taylor, 1e-12);
    assert_eq!(reference.run.status, status, "{name}: {:?}", reference.run);
    for (method, relative) in cases() {
        let what = format!("{name}, {method:?} at {relative:e}");
        let seen = ran(scene, method, relative);
        let shift = seen.shift_s(&reference) / relative;
        seen.assert_sound(&what, relative);
        if relative <= from[usize::from(method != IntegrationMethod::Taylor)] {
            seen.assert_same_list(&what, &reference);
            assert!(shift <= MORE, "{what}: times are off by {shift} tolerances");
        }
    }
}

const ALL: From = [1e-4, 1e-4];
/// Runge-Kutta interpolates its guards through nine samples of a step; at 1e-4 that is not always enough.
const ALL_BUT_LOOSEST: From = [1e-4, 1e-6];

#[test]
fn ordinary_blades() {
    assert_one_list("light blade", &light(&[]), ALL, RunStatus::Completed);
    assert_one_list("actual blade", &actual(&[]), ALL_BUT_LOOSEST, RunStatus::Completed);
}

#[test]
fn friction_without_a_falling_part() {
    let scene = light(&[("friction.a", 0.0)]);
    assert_one_list("pure Coulomb", &scene, ALL, RunStatus::Completed);
    assert_eq!(
        ran(&scene, IntegrationMethod::Taylor, 1e-8).transitions.len(),
        2,
        "it turns once: stick, then slip back"
    );
}

/// Without friction the tip never sticks.
#[test]
fn no_friction() {
    let scene = light(&[("friction.a", 0.0), ("friction.c", 0.0)]);
    assert_one_list("frictionless", &scene, ALL, RunStatus::Completed);
    let seen = ran(&scene, IntegrationMethod::Taylor, 1e-8);
    assert!(
        seen.ends.iter().all(|s| s.friction_n == 0.0)
            && seen.transitions.iter().all(|t| t.cause == TransitionCause::DirectReversal),
        "{:?}",
        seen.transitions
    );
}

#[test]
fn very_steep_friction() {
    assert_one_list(
        "B = 200 s/m",
        &light(&[("friction.b_s_per_m", 200.0)]),
        ALL_BUT_LOOSEST,
        RunStatus::Completed,
    );
    // friction that grows by tens of powers of ten within the time in which nothing else changes: a tip that
    // stops in it draws Runge-Kutta's errors out at 1e-6, to 150 tolerances where the lists are equal
    assert_one_list(
        "B = 1000 s/m",
        &light(&[("friction.b_s_per_m", 1000.0)]),
        [1e-4, 1e-8],
        RunStatus::Completed,
    );
    assert_one_list(
        "B = 5000 s/m",
        &light(&[("friction.b_s_per_m", 5000.0)]),
        [1e-4, 1e-8],
        RunStatus::Completed,
    );
}

#[test]
fn no_damping() {
    let none = ["blade.head_damping_ratio", "blade.neck_damping_ratio", "blade.lip_damping_ratio"]
        .map(|name| (name, 0.0));
    assert_one_list("undamped", &light(&none), ALL_BUT_LOOSEST, RunStatus::Completed);
}

#[test]
fn a_stiff_lip_and_a_soft_one() {
    let lip = "blade.lip_stiffness_n_m_per_rad";
    assert_one_list(
        "lip 1000 times as stiff",
        &light(&[(lip, times(lip, 1e3))]),
        ALL_BUT_LOOSEST,
        RunStatus::ContactLost,
    );
    assert_one_list("lip a tenth as stiff", &light(&[(lip, times(lip, 0.1))]), ALL, RunStatus::Completed);
}

/// On a damped shoulder the motion is not sensitive. On an undamped one the neck rebounds, and an error
/// grows: from 1e-8 on both methods find the same list, and Runge-Kutta's errors are drawn out a thousandfold
/// more than on other blades.
#[test]
fn a_shoulder_a_thousand_times_as_stiff_as_the_neck() {
    let stiff = ("shoulder.stiffness_ratio", 1e3);
    assert_one_list(
        "damped stiff shoulder",
        &actual(&[stiff, ("shoulder.damping_ratio", 0.1)]),
        ALL_BUT_LOOSEST,
        RunStatus::Completed,
    );
    let sensitive = actual(&[stiff]);
    assert_one_list("stiff shoulder", &sensitive, [1e-8, 0.0], RunStatus::Completed);
    let reference = ran(&sensitive, IntegrationMethod::Taylor, 1e-12);
    for relative in [1e-8, 1e-10, 1e-12] {
        let seen = ran(&sensitive, IntegrationMethod::RungeKutta, relative);
        seen.assert_same_list(&format!("stiff shoulder, RungeKutta at {relative:e}"), &reference);
        assert!(
            relative > 1e-9 || seen.shift_s(&reference) < 1e4 * relative,
            "{:e} s at {relative:e}",
            seen.shift_s(&reference)
        );
    }
}

/// Lip and head of a million times less and more than usual against each other. The lip of a few nanograms
/// passes the Painlevé singularity (indicator and force without friction vanish together) within 3e-6, which
/// a tolerance of 1e-4 does not tell from a jam.
#[test]
fn mass_ratios_of_a_million() {
    assert_one_list("no head mass", &light(&[("blade.head_mass_kg", 0.0)]), ALL, RunStatus::Completed);
    let [mass, inertia] =
        ["blade.lip_mass_kg", "blade.lip_inertia_kg_m2"].map(|name| (name, times(name, 1e-6)));
    assert_one_list("lip of a millionth", &light(&[mass, inertia]), [1e-6, 1e-6], RunStatus::Diverged);
}

/// A head of a million lips on the same spring hardly moves, and the motion is sensitive: with the preload
/// changed by 2e-10 of itself both methods tell another list at 1e-12. What stays is held to: energy, stick,
/// status.
#[test]
fn a_head_of_a_million_lips_makes_the_motion_sensitive() {
    let head = times("blade.lip_mass_kg", 1e6);
    let spring = ("blade.head_stiffness_n_per_m", times("blade.head_stiffness_n_per_m", 1.0));
    let scene = light(&[("blade.head_mass_kg", head), spring]);
    assert_one_list("head of a million lips", &scene, [0.0; 2], RunStatus::Completed);
    let moved =
        with(scene.clone(), &[("blade.preload_force_n", times("blade.preload_force_n", 1.0 + 2e-10))]);
    for method in super::METHODS {
        let [a, b] = [&scene, &moved].map(|scene| ran(scene, method, 1e-12));
        assert!(
            a.transitions.len() != b.transitions.len() && a.shift_s(&b) > 1e6 * 2e-10,
            "{method:?}: {} and {} transitions",
            a.transitions.len(),
            b.transitions.len()
        );
    }
}

/// From 0.07 rad short of level.
#[test]
fn links_tilted_almost_level() {
    let ends = [
        (1.5, 0.2, RunStatus::Jammed),
        (0.2, -1.5, RunStatus::Diverged),
        (1.5, -1.5, RunStatus::Diverged),
        (-1.5, -1.5, RunStatus::ContactLost),
    ];
    for (theta, phi, status) in ends {
        let mut scene = light(&[("blade.preload_force_n", 3.0)]);
        scene.start = StartKind::State(Pose { theta, phi, theta_rate: 0.0, phi_rate: 0.0 });
        scene.run.stop_s = 0.1;
        assert_one_list(&format!("neck at {theta}, lip at {phi} rad"), &scene, ALL_BUT_LOOSEST, status);
    }
}
