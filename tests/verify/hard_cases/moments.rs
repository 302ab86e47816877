//! Moments of the blade itself that fall together: a transition at an output time, at the stop time, and at
//! the shoulder's corner.

use super::scenes::upright_light_blade;
use super::{METHODS, MORE, Ran, cases, ran};
use wiperlab::model::shoulder::Shoulder;
use wiperlab::simulate::mode::TipMode;
use wiperlab::simulate::outputs::SampleObserver;
use wiperlab::simulate::scene::contact::ContactLossRule;
use wiperlab::simulate::{IntegrationMethod, RunStatus, SolverOptions, run_scene_with};

const RELATIVE: f64 = 1e-8;

/// Every output time gives one sample, in order, also where it is that of a transition, and the tip is at
/// rest there.
#[test]
fn a_sample_at_a_transition_is_reported_once() {
    let mut scene = upright_light_blade();
    scene.run.stop_s = 0.3;
    for method in METHODS {
        let transitions = ran(&scene, method, RELATIVE).transitions;
        assert!(transitions.len() > 20);
        let mut times: Vec<f64> =
            transitions.iter().map(|t| t.time_s).chain((0..=300).map(|i| f64::from(i) * 1e-3)).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        let mut samples = Vec::new();
        run_scene_with(
            &scene,
            SolverOptions { method, ..SolverOptions::new(RELATIVE) },
            &mut SampleObserver::new(times.iter().copied(), |s| samples.push(*s)),
        );
        assert!(samples.iter().map(|s| s.time_s).eq(times), "{method:?}");
        for transition in &transitions {
            let sample = samples.iter().find(|s| s.time_s == transition.time_s).unwrap();
            assert!(sample.tip_velocity_m_per_s.abs() < 1e-12, "{method:?}: {sample:?}");
        }
    }
}

/// A run that stops at a transition tells those before it, that one or not, and nothing else; a microsecond
/// beside it the number is certain.
#[test]
fn a_transition_at_the_stop_time_adds_nothing_else() {
    let mut scene = upright_light_blade();
    scene.run.stop_s = 0.3;
    for method in METHODS {
        let transitions = ran(&scene, method, RELATIVE).transitions;
        for (k, transition) in transitions.iter().enumerate() {
            for (shift, counts) in [(0.0, [k, k + 1]), (-1e-6, [k, k]), (1e-6, [k + 1, k + 1])] {
                scene.run.stop_s = transition.time_s + shift;
                let seen = ran(&scene, method, RELATIVE);
                assert_eq!(
                    (seen.run.status, seen.run.stopped_at_s),
                    (RunStatus::Completed, scene.run.stop_s),
                    "{method:?}"
                );
                assert!(
                    counts.contains(&seen.transitions.len()),
                    "{method:?}: {} transitions up to {:e} s beside number {k}",
                    seen.transitions.len(),
                    shift
                );
            }
        }
    }
}

/// The shoulder lies where the neck is when the tip is first let go: corner and friction limit at one
/// instant, to rounding and a little to either side. The undamped shoulder's moment is continuous there, so
/// their order does not matter and one list is told by all.
#[test]
fn the_shoulders_corner_at_the_instant_of_release() {
    let mut scene = upright_light_blade();
    scene.run.stop_s = 0.3;
    let plain = ran(&scene, IntegrationMethod::Taylor, 1e-12);
    let release = plain.transitions[0];
    let pose =
        plain.ends.iter().find(|s| s.time_s == release.time_s && s.mode == TipMode::Stick).unwrap().pose;
    let angle = pose.theta.abs();
    assert!(
        plain.ends.iter().all(|s| s.time_s >= release.time_s || s.pose.theta.abs() < angle),
        "the neck has not been there before"
    );
    let shouldered = |shift: f64| {
        let mut scene = scene.clone();
        let stiffness_n_m_per_rad = 0.1 * scene.linkage.neck.stiffness;
        scene.linkage.shoulder = Some(Shoulder {
            contact_angle_rad: angle * (1.0 + shift),
            stiffness_n_m_per_rad,
            damping_n_m_s_per_rad: 0.0,
        });
        scene
    };
    let reference = ran(&shouldered(0.0), IntegrationMethod::Taylor, 1e-12);
    let modes = |seen: &Ran| seen.transitions.iter().map(|t| (t.from, t.to)).collect::<Vec<_>>();
    assert!(
        (reference.transitions[0].time_s - release.time_s).abs() < 1e-10
            && reference.transitions[0].to == release.to
    );
    for shift in [0.0, 1e-15, -1e-15, 1e-13, -1e-13] {
        let scene = shouldered(shift);
        for (method, relative) in
            cases().filter(|(method, relative)| *method == IntegrationMethod::Taylor || *relative < 1e-5)
        {
            let what = format!("shifted by {shift:e}, {method:?} at {relative:e}");
            let seen = ran(&scene, method, relative);
            seen.assert_sound(&what, relative);
            // (the first release is told by whichever of the two is told first)
            assert_eq!(
                (seen.run.status, modes(&seen)),
                (reference.run.status, modes(&reference)),
                "{what}: {:?}",
                seen.run
            );
            let moved = seen.shift_s(&reference);
            assert!(moved <= MORE * relative.max(1e-12), "{what}: {moved:e} s");
        }
    }
}

/// A shoulder that touches the upright neck leaves it no room between the corners: crossing one is crossing
/// the other, in a phase of no length. On the glass and off it the run goes on.
#[test]
fn a_shoulder_without_play_makes_phases_of_no_length() {
    for (loss, preload) in [(ContactLossRule::Stop, 0.2813), (ContactLossRule::Fly, 0.03)] {
        let mut scene = upright_light_blade().with_parameter("blade.preload_force_n", preload).unwrap();
        (scene.loss, scene.run.stop_s) = (loss, 0.75);
        let stiffness_n_m_per_rad = scene.linkage.neck.stiffness;
        scene.linkage.shoulder =
            Some(Shoulder { contact_angle_rad: 0.0, stiffness_n_m_per_rad, damping_n_m_s_per_rad: 0.0 });
        // without play the shoulder only doubles the neck's stiffness
        let mut plain = scene.clone();
        (plain.linkage.shoulder, plain.linkage.neck.stiffness) = (None, 2.0 * stiffness_n_m_per_rad);
        let reference = ran(&plain, IntegrationMethod::Taylor, 1e-12);
        assert!(
            loss == ContactLossRule::Fly
                || reference.ends.iter().any(|s| s.pose.theta > 0.0)
                    && reference.ends.iter().any(|s| s.pose.theta < 0.0),
            "the neck swings through"
        );
        for (method, relative) in
            cases().filter(|(method, relative)| *method == IntegrationMethod::Taylor && *relative < 1e-7)
        {
            let what = format!("{loss:?}, {method:?} at {relative:e}");
            let seen = ran(&scene, method, relative);
            seen.assert_sound(&what, relative);
            seen.assert_same_list(&what, &reference);
            assert!(seen.shift_s(&reference) <= 1e3 * relative, "{what}: {:e} s", seen.shift_s(&reference));
        }
    }
}
