//! Contact of the blade reduced until its answer is known: Coulomb friction alone, a release without jerk,
//! trains of rebounds, and both sides of the Painlevé paradox.

use super::scenes::upright_light_blade;
use super::{ENERGY, ERRORS, Ran, cases, ran};
use std::f64::consts::TAU;
use wiperlab::model::flight::FlightState;
use wiperlab::model::friction::FrictionLaw;
use wiperlab::model::modes::time_scales_rad_per_s;
use wiperlab::model::shoulder::ShoulderContact;
use wiperlab::model::{LinkDirections, Linkage, Pose, Spring};
use wiperlab::simulate::mode::TipMode;
use wiperlab::simulate::scene::contact::{ContactLossRule, JamRule};
use wiperlab::simulate::scene::{Drive, Scene, StartKind};
use wiperlab::simulate::{IntegrationMethod, ModelSample, RunStatus, TransitionCause};

const AT_REST: Pose = Pose { theta: 0.0, phi: 0.0, theta_rate: 0.0, phi_rate: 0.0 };
/// Force with which the head presses, N, whatever its height: its spring is very long and very soft.
const PRESS_N: f64 = 0.03;
const SOFT_N_PER_M: f64 = 1e-12;

/// A lip with inertia but no mass on an immovable neck: one degree of freedom under a constant normal force
/// and Coulomb friction.
pub fn lip_alone(friction: f64) -> Scene {
    let mut scene = upright_light_blade();
    scene.linkage = Linkage {
        mass_kg: 0.0,
        m_a: 0.0,
        m_b: 0.0,
        m_c: 0.0,
        m_theta: 1e12,
        head: Spring { stiffness: SOFT_N_PER_M, damping: 0.0 },
        neck: Spring { stiffness: 1e18, damping: 0.0 },
        lip: Spring { damping: 0.0, ..scene.linkage.lip },
        preload_displacement_m: PRESS_N / SOFT_N_PER_M,
        friction: FrictionLaw::exponential(0.0, 0.0, friction),
        ..scene.linkage
    };
    scene
}

/// Root of a function between two places where its signs differ.
fn root(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let rising = f(high) > 0.0;
    assert_ne!(rising, f(low) > 0.0, "a bracket");
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if (f(middle) > 0.0) == rising { high = middle } else { low = middle }
    }
    0.5 * (low + high)
}

/// The lip let go at 0.6 rad over a head at rest swings from turn to turn, each where its energy `k2 phi^2/2
/// + N l2 (cos phi + sigma mu sin phi)` is that of the turn before, until the spring can no longer beat
/// static friction: `|k2 phi - N l2 sin phi| <= mu_s N l2 cos phi`.
#[test]
fn coulomb_friction_alone_turns_and_stops_the_tip_at_the_exact_angles() {
    let counts = [(1.0, 1.0), (2.5, 1.0), (1.0, 0.4), (2.5, 0.4)].map(|(static_ratio, backward_ratio)| {
        let law = FrictionLaw::exponential(0.0, 0.0, 0.5);
        assert_turns(FrictionLaw { static_ratio, backward_ratio, ..law })
    });
    assert!(counts[1] < counts[0] && counts[2] > counts[0] && counts[3] < counts[2], "{counts:?}");
}

/// Compares the turns under a law, and returns their number.
fn assert_turns(law: FrictionLaw) -> usize {
    let mut scene = lip_alone(0.0);
    scene.linkage.friction = law;
    scene.drive = Drive::Uniform { speed_m_per_s: 0.0 };
    scene.start = StartKind::State(Pose { phi: 0.6, ..AT_REST });
    scene.run.stop_s = 0.1;
    let (k2, press) = (scene.linkage.lip.stiffness, PRESS_N * scene.linkage.l2_m);
    let mut turns = vec![0.6f64];
    loop {
        let phi = turns[turns.len() - 1];
        let sigma = -phi.signum();
        let mu = law.dynamic_coefficient(0.0, sigma);
        if turns.len() > 1
            && (k2 * phi - press * phi.sin()).abs() <= law.static_ratio * mu * press * phi.cos()
        {
            break;
        }
        let energy = |p: f64| 0.5 * k2 * p * p + press * (p.cos() + sigma * mu * p.sin());
        // away from the turn itself: the other root lies beyond the place where the forces balance
        let bottom = root(|p| k2 * p - press * (p.sin() - sigma * mu * p.cos()), -1.0, 1.0);
        turns.push(root(|p| energy(p) - energy(phi), bottom, -phi.signum() * (phi.abs() + 0.1)));
    }
    // (a tip that is held early has lost little energy, and the errors of Runge-Kutta at 1e-4 are too large
    // for its balance)
    let loose = |method, relative| method != IntegrationMethod::Taylor && relative > 1e-5;
    for (method, relative) in
        cases().filter(|&(method, relative)| law.static_ratio == 1.0 || !loose(method, relative))
    {
        let seen = ran(&scene, method, relative);
        let what = format!("{method:?} at {relative:e}, {law:?}");
        seen.assert_sound(&what, relative);
        assert_eq!(seen.run.status, RunStatus::Completed, "{what}");
        assert_eq!(seen.transitions.len(), turns.len() - 1, "{what}: {:?}", seen.transitions);
        for (i, (transition, exact)) in seen.transitions.iter().zip(&turns[1..]).enumerate() {
            let stops = i + 2 == turns.len();
            assert_eq!(
                transition.cause,
                if stops { TransitionCause::TipStops } else { TransitionCause::DirectReversal },
                "{what}: turn {i}"
            );
            let found = seen.ends.iter().find(|s| s.time_s == transition.time_s).unwrap().pose.phi;
            assert!(
                (found - exact).abs() <= ERRORS * relative,
                "{what}: turn {i} at {found} instead of {exact}"
            );
        }
    }
    turns.len()
}

/// Under a head that moves at the speed `V` the lip alone sticks until the holding force passes the static
/// limit, and slips at the lower friction of its direction until its tip is at rest again. The angle of each
/// release follows from the forces. That of each stop follows from the energy `m phi'^2/2 + k2 phi^2/2 + N l2
/// (cos phi + sigma mu sin phi)`, with `l2 cos phi phi' = -V` at both ends of the slip. In each stick the
/// head moves the way between the two positions of the lip.
#[test]
fn a_lip_alone_sticks_to_the_static_limit_and_slips_to_the_exact_angles() {
    for (speed, backward_ratio, static_ratio) in
        [(0.05, 1.0, 1.001), (0.05, 1.0, 2.0), (0.05, 0.5, 2.0), (-0.05, 0.5, 2.0)]
    {
        let mut scene = lip_alone(0.25);
        (scene.linkage.friction.static_ratio, scene.linkage.friction.backward_ratio) =
            (static_ratio, backward_ratio);
        scene.drive = Drive::Uniform { speed_m_per_s: speed };
        scene.run.stop_s = 0.1;
        let blade = &scene.linkage;
        let sigma = speed.signum();
        let (k2, m, l2, press) = (blade.lip.stiffness, blade.m_phi, blade.l2_m, PRESS_N * blade.l2_m);
        let (mu, limit) = (blade.friction.limit_at_zero(sigma), blade.friction.static_coefficient(sigma));
        let pull = |p: f64, mu: f64| k2 * p - press * (p.sin() - sigma * mu * p.cos());
        let turning = |p: f64| m * p.tan() * (speed / (l2 * p.cos())).powi(2);
        let release = root(|p| pull(p, limit) + turning(p), -1.0, 1.0);
        let kinetic = |p: f64| 0.5 * m * (speed / (l2 * p.cos())).powi(2);
        let energy = |p: f64| kinetic(p) + 0.5 * k2 * p * p + press * (p.cos() + sigma * mu * p.sin());
        let bottom = root(|p| pull(p, mu), -1.0, 1.0);
        let stop = root(|p| energy(p) - energy(release), bottom, sigma * 1.2);
        let stick_s = (l2 * (stop.sin() - release.sin()) / speed).abs();
        // (a tolerance above the width of the cycle does not resolve it)
        for (method, relative) in cases().filter(|(_, relative)| *relative < 1e-2 * (static_ratio - 1.0)) {
            let what = format!("{method:?} at {relative:e}, {:?}", blade.friction);
            let seen = ran(&scene, method, relative);
            seen.assert_sound(&what, relative);
            assert!(seen.transitions.len() > 10, "{what}: {:?}", seen.transitions);
            // (the start moves with the head, so the tip slips first)
            let cycles = &seen.transitions[1..];
            for (i, transition) in cycles.iter().enumerate() {
                let (cause, exact) = match i % 2 {
                    0 => (TransitionCause::FrictionLimit, release),
                    _ => (TransitionCause::TipStops, stop),
                };
                assert_eq!(transition.cause, cause, "{what}: transition {i}");
                let found = seen.ends.iter().find(|s| s.time_s == transition.time_s).unwrap().pose.phi;
                assert!(
                    (found - exact).abs() <= ERRORS * relative,
                    "{what}: {i} at {found} instead of {exact}"
                );
            }
            let sticks =
                cycles[1..].windows(2).filter(|pair| pair[1].cause == TransitionCause::FrictionLimit);
            for pair in sticks {
                let found = pair[1].time_s - pair[0].time_s;
                let allowed = 2.0 * ERRORS * relative * l2 / speed.abs();
                assert!((found - stick_s).abs() <= allowed, "{what}: {found} instead of {stick_s} s");
            }
        }
    }
}

/// The holding force of the lip alone while the tip is held and the head moves: `(m phi'' + k2 phi - N l2 sin
/// phi) / (l2 cos phi)` with `l2 sin phi = -v`.
fn holding_force(scene: &Scene, t: f64) -> f64 {
    let (blade, head) = (&scene.linkage, scene.drive.motion_at(t));
    let (l2, sin) = (blade.l2_m, -head.position_m / blade.l2_m);
    let cos = (1.0 - sin * sin).sqrt();
    let rate = -head.velocity_m_per_s / (l2 * cos);
    let acceleration = (sin * rate * rate - head.acceleration_m_per_s2 / l2) / cos;
    (blade.m_phi * acceleration + blade.lip.stiffness * sin.asin() - PRESS_N * l2 * sin) / (l2 * cos)
}

/// Friction that holds the tip but for a share `depth` of its largest force, at the head's turn: the tip is
/// let go with next to no jerk. What pulls it on is a parabola in time, from `-tau` to `tau` about the turn,
/// so the slip lasts `3 tau` to leading order; with as much more friction nothing moves.
#[test]
fn a_release_with_vanishing_jerk_happens_and_ends_or_does_not_happen() {
    const TURN_S: f64 = 2e-3;
    let drive = |scene: &Scene| Drive::Cosine {
        amplitude_m: 0.15 * scene.linkage.l2_m,
        frequency_hz: 0.5 / TURN_S,
        delay_s: 0.0,
    };
    for depth in [1e-3, 1e-5, 1e-7, 1e-9] {
        let mut scene = lip_alone(1.0);
        scene.drive = drive(&scene);
        scene.run.stop_s = 1.2 * TURN_S;
        let largest = holding_force(&scene, TURN_S).abs();
        for (method, relative) in cases().filter(|(_, relative)| depth >= 10.0 * ERRORS * relative) {
            // the place of the lip follows from the tip's, so nothing limits a Runge-Kutta step but the
            // guards it samples
            if method != IntegrationMethod::Taylor && depth < 1e-7 {
                continue;
            }
            let what = format!("depth {depth:e}, {method:?} at {relative:e}");
            scene.linkage.friction.c = largest * (1.0 + depth) / PRESS_N;
            let held = ran(&scene, method, relative);
            held.assert_sound(&what, relative);
            assert_eq!(
                (held.run.status, held.transitions.len()),
                (RunStatus::Completed, 0),
                "{what}: {:?}",
                held.transitions
            );

            scene.linkage.friction.c = largest * (1.0 - depth) / PRESS_N;
            let limit = scene.linkage.friction.c * PRESS_N;
            let exact = root(|t| holding_force(&scene, t).abs() - limit, 0.5 * TURN_S, TURN_S);
            let let_go = ran(&scene, method, relative);
            let_go.assert_sound(&what, relative);
            let causes: Vec<_> = let_go.transitions.iter().map(|t| (t.to, t.cause)).collect();
            assert_eq!(
                causes,
                [
                    (TipMode::SlipForward, TransitionCause::FrictionLimit),
                    (TipMode::Stick, TransitionCause::TipStops)
                ],
                "{what}"
            );
            let [release, stop] = [0, 1].map(|i: usize| let_go.transitions[i].time_s);
            let tau = TURN_S - exact;
            // the force falls short of its largest value by `depth (t/tau)^2`
            assert!(
                (release - exact).abs() <= (ERRORS * relative / depth).min(1.0) * tau,
                "{what}: {release} instead of {exact} s"
            );
            assert!(
                ((stop - release) / (3.0 * tau) - 1.0).abs()
                    < ERRORS * relative / depth + 10.0 * depth.sqrt(),
                "{what}: slip of {} tau",
                (stop - release) / tau
            );
        }
    }
}

/// The upright blade without damping over a head at rest bounces as a mass on its spring; each landing scales
/// its speed by the restitution, so that infinitely many lie before a finite time. Those are told whose
/// rebound is resolved, and stick follows.
#[test]
fn a_train_of_rebounds_has_its_exact_landings_and_ends_in_stick() {
    /// Share of the shortest period that a rebound must last to be followed.
    const RESOLUTION: f64 = 1e-5;
    const RESTITUTION: f64 = 0.6;
    let mut scene = upright_light_blade()
        .with_parameter("contact.restitution", RESTITUTION)
        .unwrap()
        .with_parameter("blade.preload_force_n", 0.02)
        .unwrap();
    scene.linkage.head.damping = 0.0;
    scene.drive = Drive::Uniform { speed_m_per_s: 0.0 };
    scene.loss = ContactLossRule::Fly;
    scene.start = StartKind::Airborne(FlightState { pose: AT_REST, gap_m: 1e-3, gap_rate_m_per_s: 0.0 });
    let blade = &scene.linkage;
    let (omega, hd) = ((blade.head.stiffness / blade.mass_kg).sqrt(), blade.preload_displacement_m);
    let shortest = TAU / time_scales_rad_per_s(blade).1;
    let mut speed = omega * ((1e-3 + hd).powi(2) - hd * hd).sqrt();
    let mut exact = vec![(hd / (1e-3 + hd)).acos() / omega];
    loop {
        speed *= RESTITUTION;
        if 2.0 * speed / (omega * omega * hd) < RESOLUTION * shortest {
            break;
        }
        exact.push(exact[exact.len() - 1] + 2.0 * (speed / (omega * hd)).atan() / omega);
    }
    assert!(exact.len() > 20);
    for (method, relative) in cases() {
        let what = format!("{method:?} at {relative:e}");
        let seen = ran(&scene, method, relative);
        seen.assert_sound(&what, relative);
        assert_eq!((seen.run.status, seen.transitions.len()), (RunStatus::Completed, exact.len()), "{what}");
        assert_eq!(seen.transitions.last().map(|t| t.to), Some(TipMode::Stick), "{what}");
        for (found, exact) in seen.transitions.iter().zip(&exact) {
            assert!(
                (found.time_s - exact).abs() <= ERRORS * relative * exact,
                "{what}: {} instead of {exact} s",
                found.time_s
            );
        }
    }
}

/// Pressed on by nothing, upright, over a head at rest: the blade does not move, whatever contact does.
#[test]
fn without_preload_the_upright_blade_stays_where_it_is() {
    for loss in [ContactLossRule::Stop, ContactLossRule::Fly] {
        let mut scene = upright_light_blade().with_parameter("blade.preload_force_n", 0.0).unwrap();
        (scene.loss, scene.drive) = (loss, Drive::Uniform { speed_m_per_s: 0.0 });
        for (method, relative) in cases() {
            let what = format!("{loss:?}, {method:?} at {relative:e}");
            let seen = ran(&scene, method, relative);
            let expected = if loss == ContactLossRule::Stop {
                (RunStatus::ContactLost, 0.0)
            } else {
                (RunStatus::Completed, scene.run.stop_s)
            };
            assert_eq!((seen.run.status, seen.run.stopped_at_s), expected, "{what}: {:?}", seen.run);
            seen.assert_sound(&what, relative);
            assert!(seen.ends.iter().all(|s| s.pose == AT_REST && s.tip_height_m == 0.0), "{what}");
        }
    }
}

/// A heavy head whose leading tip slides under Coulomb friction that leaves the Painlevé indicator at a given
/// value: the first of a list of poses in which the tip is pressed on and friction presses it harder.
fn beside_the_paradox(indicator: f64) -> Scene {
    let mut scene = upright_light_blade().with_parameter("blade.head_mass_kg", 0.5).unwrap();
    let head = scene.drive.motion_at(scene.start_s);
    let places = [0.2, 0.4, 0.6, 0.8];
    let poses = places
        .into_iter()
        .flat_map(|theta| places.map(|phi| Pose { theta, phi, theta_rate: 150.0, phi_rate: 50.0 }));
    let mut pressed = poses.filter_map(|pose| {
        let contact = scene.linkage.friction_response(
            &pose,
            &LinkDirections::from_pose(&pose),
            &head,
            ShoulderContact::Off,
        );
        (contact.nu < -1.0 && contact.n_free > 0.0).then_some((pose, contact.nu))
    });
    let (pose, nu) = pressed.next().expect("a pose beside the paradox");
    scene.linkage.friction = FrictionLaw::exponential(0.0, 0.0, (indicator - 1.0) / nu);
    scene.start = StartKind::State(pose);
    scene.run.stop_s = 0.02;
    scene
}

/// Down to an indicator of 1e-3, where the normal force is a thousand times what it were without friction: it
/// brakes the tip, whose rest is found, and the balance of energy shows that nothing is lost on the way.
#[test]
fn next_to_the_paradox_the_tip_slides_on() {
    for indicator in [1e-1, 1e-2, 1e-3] {
        let scene = beside_the_paradox(indicator);
        let reference = ran(&scene, IntegrationMethod::Taylor, 1e-12);
        assert_eq!(reference.run.status, RunStatus::Completed);
        for (method, relative) in cases() {
            let what = format!("indicator {indicator:e}, {method:?} at {relative:e}");
            let seen = ran(&scene, method, relative);
            seen.assert_sound(&what, relative);
            seen.assert_same_list(&what, &reference);
            assert!(
                seen.shift_s(&reference) <= ERRORS * relative,
                "{what}: {:e} s",
                seen.shift_s(&reference)
            );
            let least = seen.audit.min_painleve_indicator.unwrap();
            assert!((least / indicator - 1.0).abs() < 1e-9, "{what}: least indicator {least:e}");
        }
    }
}

/// A thousandth beyond, no normal force is admissible: the run ends where it stands, or an impact without
/// collision stops the tip.
#[test]
fn beyond_the_paradox_the_tip_jams() {
    for indicator in [-1e-3, -1e-9] {
        let mut scene = beside_the_paradox(indicator);
        for (method, relative) in cases() {
            let what = format!("indicator {indicator:e}, {method:?} at {relative:e}");
            (scene.loss, scene.jam) = (ContactLossRule::Stop, JamRule::Stop);
            let stopped: Ran = ran(&scene, method, relative);
            assert_eq!(
                (stopped.run.status, stopped.run.stopped_at_s, stopped.transitions.len()),
                (RunStatus::Jammed, scene.start_s, 0),
                "{what}"
            );
            (scene.loss, scene.jam) = (ContactLossRule::Fly, JamRule::Impact);
            let struck = ran(&scene, method, relative);
            assert_eq!(
                struck.transitions.first().map(|t| (t.time_s, t.cause)),
                Some((scene.start_s, TransitionCause::JamImpact)),
                "{what}"
            );
            assert!(struck.run.status == RunStatus::Completed, "{what}: {:?}", struck.run);
            let energy = struck.audit.energy_residual_relative();
            assert!(energy <= ENERGY * relative, "{what}: energy residual {energy:e}");
        }
    }
}

/// A blade that would lift off without friction, held at the static limit. Friction alone presses the tip on:
/// when it falls at the release, the normal force would be negative, so the tip leaves the glass.
#[test]
fn a_tip_that_only_friction_presses_on_leaves_the_glass_at_its_release() {
    let pose = Pose { theta: -0.9, phi: -0.18, theta_rate: 0.0, phi_rate: 0.0 };
    for (slip, static_ratio) in [(0.1, 4.0), (0.3, 4.0), (0.3, 10.0)] {
        let mut scene = upright_light_blade();
        let law = FrictionLaw::exponential(0.0, 0.0, slip);
        scene.linkage.friction = FrictionLaw { static_ratio, ..law };
        (scene.drive, scene.start) = (Drive::Uniform { speed_m_per_s: 0.0 }, StartKind::State(pose));
        scene.loss = ContactLossRule::Fly;
        scene.run.stop_s = 4e-3;
        for (method, relative) in cases() {
            let what = format!("{slip} times {static_ratio}, {method:?} at {relative:e}");
            let seen = ran(&scene, method, relative);
            seen.assert_sound(&what, relative);
            let leaves =
                seen.transitions.iter().find(|t| (t.from, t.to) == (TipMode::Stick, TipMode::Flight));
            let leaves = leaves.unwrap_or_else(|| panic!("{what}: {:?}", seen.transitions));
            let held = |s: &&ModelSample| s.mode == TipMode::Stick && s.time_s <= leaves.time_s;
            let last = seen.ends.iter().rev().find(held).unwrap();
            let ratio = last.friction_n.abs() / last.normal_n / (slip * static_ratio);
            assert!((ratio - 1.0).abs() < 1e3 * relative, "{what}: {ratio} of the limit");
            let head = scene.drive.motion_at(leaves.time_s);
            let directions = LinkDirections::from_pose(&last.pose);
            let contact =
                scene.linkage.friction_response(&last.pose, &directions, &head, ShoulderContact::Off);
            // in slip the normal force is `n_free` over the Painlevé indicator, which is positive here
            assert!(contact.n_free < 0.0 && contact.nu.abs() * slip < 1.0, "{what}: {contact:?}");
            let flown = seen.ends.iter().filter(|s| s.mode == TipMode::Flight);
            assert!(flown.map(|s| s.tip_height_m).fold(0.0, f64::max) > 0.0, "{what}");
        }
    }
}
