//! Flight, lift-off, landing and jams: the equations against Lagrange's, bouncing against its closed form,
//! then blades that fly.

use crate::lagrangian;

use crate::blade::{Parts, STROKE};
use crate::scenes::upright_light_blade;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use wiperlab::model::flight::FlightState;
use wiperlab::model::shoulder::ShoulderContact;
use wiperlab::model::{HeadMotion, LinkDirections, Linkage, Pose};
use wiperlab::simulate::mode::TipMode;
use wiperlab::simulate::outputs::{EnergyAudit, Transitions};
use wiperlab::simulate::scene::contact::{ContactLossRule, JamRule};
use wiperlab::simulate::scene::{Drive, Scene, StartKind};
use wiperlab::simulate::{
    Impact, ModelSample, Observer, RunResult, RunStatus, SolutionSegment, SolverOptions, Transition,
    TransitionCause, run_scene_with,
};

const STATES: usize = 400;
/// Both sides solve a small linear system in double precision whose condition is set by mass ratios up to
/// 1e4.
const AGREEMENT: f64 = 1e-10;

/// A random blade off the glass.
struct Case {
    parts: Parts,
    linkage: Linkage,
    state: FlightState,
    head: HeadMotion,
    lean: ShoulderContact,
}

impl Case {
    fn random(rng: &mut Xoshiro256PlusPlus, most_gap: f64) -> Self {
        let parts = Parts::random(rng);
        let linkage = parts.scene(STROKE).linkage;
        let mut within = |most: f64| most * rng.random_range(-1.0..1.0);
        let pose =
            Pose { theta: within(1.2), phi: within(1.2), theta_rate: within(300.0), phi_rate: within(500.0) };
        let head = HeadMotion {
            position_m: within(0.03),
            velocity_m_per_s: within(0.2),
            acceleration_m_per_s2: within(5.0),
        };
        let state =
            FlightState { pose, gap_m: within(most_gap).abs(), gap_rate_m_per_s: within(1e3 * most_gap) };
        let lean = linkage.shoulder.map_or(ShoulderContact::Off, |s| s.contact_at(pose.theta));
        Self { parts, linkage, state, head, lean }
    }

    fn directions(&self) -> LinkDirections {
        LinkDirections::from_pose(&self.state.pose)
    }

    fn lagrangian(&self) -> lagrangian::Linkage {
        let [l1, l2] = self.parts.l;
        let Pose { theta, phi, theta_rate, phi_rate } = self.state.pose;
        let drop = l1 * (1.0 - theta.cos()) + l2 * (1.0 - phi.cos()) - self.state.gap_m;
        let drop_rate =
            l1 * theta.sin() * theta_rate + l2 * phi.sin() * phi_rate - self.state.gap_rate_m_per_s;
        let rates = [self.head.velocity_m_per_s, drop_rate, theta_rate, phi_rate];
        lagrangian::Linkage::at(
            &self.parts,
            [self.head.position_m, drop, theta, phi],
            rates,
            self.lean.angle_sign(),
        )
    }
}

fn cases(most_gap: f64) -> impl Iterator<Item = Case> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(2);
    (0..STATES).map(move |_| Case::random(&mut rng, most_gap))
}

fn assert_close(what: &str, index: usize, found: f64, expected: f64, terms: &[f64]) {
    let size = terms.iter().fold(expected.abs(), |size, t| size.max(t.abs()));
    assert!(
        (found - expected).abs() <= AGREEMENT * size,
        "{what}, state {index}: found {found:e}, expected {expected:e}"
    );
}

#[test]
fn flight_follows_from_the_lagrangian_without_contact() {
    for (i, case) in cases(2e-3).enumerate() {
        let found = case.linkage.flight_accelerations(&case.state, &case.directions(), &case.head, case.lean);
        let independent = case.lagrangian();
        let expected = independent.flight(case.head.acceleration_m_per_s2);
        for link in 0..2 {
            assert_close("angular acceleration", i, found.links[link], expected[2 + link], &[]);
        }
        let terms = [expected[1], case.parts.l[0] * expected[2], case.parts.l[1] * expected[3]];
        assert_close(
            "acceleration of the gap",
            i,
            found.gap_m_per_s2,
            independent.tip_rise_acceleration(&expected),
            &terms,
        );
    }
}

#[test]
fn energy_in_flight_changes_at_the_power() {
    for (i, case) in cases(2e-3).enumerate() {
        let (d, independent) = (case.directions(), case.lagrangian());
        let drop = case.linkage.drop_in_flight(&case.state, &d);
        let energy = independent.energy_j();
        assert_close(
            "energy",
            i,
            case.linkage.energy_with_drop_j(&case.state.pose, &d, &case.head, drop),
            energy,
            &[],
        );
        let links = case.linkage.flight_accelerations(&case.state, &d, &case.head, case.lean).links;
        let power =
            case.linkage.power_with_drop_w(&case.state.pose, &d, &case.head, case.lean, 0.0, links, drop.1);
        let rate = independent.energy_rate_w(&independent.flight(case.head.acceleration_m_per_s2));
        let fastest = case.state.pose.theta_rate.abs().max(case.state.pose.phi_rate.abs());
        assert_close("power", i, power, rate, &[energy * fastest]);
    }
}

#[test]
fn an_impulse_on_the_tip_changes_the_rates_as_the_mass_matrix_says() {
    for (i, case) in cases(0.0).enumerate() {
        let independent = case.lagrangian();
        let responses = case.linkage.impulse_responses(&case.directions());
        for (response, [up, along]) in responses.iter().zip([[1.0, 0.0], [0.0, 1.0]]) {
            let rates = independent.blow(up, along);
            let [x, y] = independent.tip_velocity(rates);
            let size = responses[0].normal_per_kg + responses[1].tangential_per_kg;
            assert_close("neck", i, response.rates[0], rates[1], &[]);
            assert_close("lip", i, response.rates[1], rates[2], &[]);
            assert_close("normal velocity", i, response.normal_per_kg, y, &[size]);
            assert_close("tangential velocity", i, response.tangential_per_kg, x, &[size]);
        }
        // the constrained equations use the same inverse mass: nu = -W_nt/W_nn, kappa = W_tt - W_nt^2/W_nn
        let contact =
            case.linkage.friction_response(&case.state.pose, &case.directions(), &case.head, case.lean);
        let (nn, nt, tt) =
            (responses[0].normal_per_kg, responses[0].tangential_per_kg, responses[1].tangential_per_kg);
        assert_close("nu", i, contact.nu, -nt / nn, &[1.0]);
        assert_close("kappa", i, contact.kappa, tt - nt * nt / nn, &[tt]);
    }
}

/// On the glass, the contact forces added to flight give the constrained motion, and keep the gap closed.
#[test]
fn flight_with_the_contact_forces_is_motion_on_the_glass() {
    for (i, case) in cases(0.0).enumerate() {
        let d = case.directions();
        let contact = case.linkage.friction_response(&case.state.pose, &d, &case.head, case.lean);
        let friction = 0.3 * case.parts.k[0] * case.parts.hd;
        let normal = contact.n_free + contact.nu * friction;
        let flight = case.linkage.flight_accelerations(&case.state, &d, &case.head, case.lean);
        let [up, along] = case.linkage.impulse_responses(&d);
        for link in 0..2 {
            let constrained = contact.free[link] + friction * contact.per_force[link];
            let terms = [flight.links[link], normal * up.rates[link], friction * along.rates[link]];
            assert_close("angular acceleration", i, terms.iter().sum(), constrained, &terms);
        }
        let terms = [flight.gap_m_per_s2, normal * up.normal_per_kg, friction * along.normal_per_kg];
        assert_close("acceleration of the gap", i, terms.iter().sum(), 0.0, &terms);
    }
}

/// A run with what happened in it.
struct Flown {
    run: RunResult,
    audit: EnergyAudit,
    transitions: Vec<Transition>,
    seen: Seen,
}

/// Ends of all pieces, impacts, and the least height of the tip on looks inside.
#[derive(Default)]
struct Seen {
    ends: Vec<ModelSample>,
    impacts: Vec<Impact>,
    lowest_m: f64,
}

impl Observer for Seen {
    fn observe_segment(&mut self, piece: &SolutionSegment<'_>) {
        self.ends.extend([piece.sample_at(piece.start_s), piece.sample_at(piece.end_s)]);
        if piece.mode == TipMode::Flight {
            let looks = (0..=20).map(|i| {
                piece
                    .sample_at(piece.start_s + (piece.end_s - piece.start_s) * f64::from(i) / 20.0)
                    .tip_height_m
            });
            self.lowest_m = looks.fold(self.lowest_m, f64::min);
        }
    }
    fn observe_impact(&mut self, impact: &Impact) {
        self.impacts.push(*impact);
    }
}

fn fly(scene: &Scene, relative: f64) -> Flown {
    let (mut transitions, mut audit, mut seen) =
        (Transitions::default(), EnergyAudit::default(), Seen::default());
    let effort = SolverOptions { most_evaluations: 50_000_000, ..SolverOptions::new(relative) };
    let run = run_scene_with(scene, effort, &mut ((&mut transitions, &mut audit), &mut seen));
    Flown { run, audit, transitions: transitions.0, seen }
}

fn number(flown: &Flown, cause: TransitionCause) -> usize {
    flown.transitions.iter().filter(|t| t.cause == cause).count()
}

/// The upright light blade without damping over a head at rest: a mass on its spring that bounces on the
/// glass.
fn bouncing(restitution: f64) -> Scene {
    let mut scene = upright_light_blade()
        .with_parameter("contact.restitution", restitution)
        .unwrap()
        .with_parameter("blade.preload_force_n", 0.02)
        .unwrap();
    scene.linkage.head.damping = 0.0;
    scene.drive = Drive::Uniform { speed_m_per_s: 0.0 };
    scene.loss = ContactLossRule::Fly;
    let pose = Pose { theta: 0.0, phi: 0.0, theta_rate: 0.0, phi_rate: 0.0 };
    scene.start = StartKind::Airborne(FlightState { pose, gap_m: 1e-3, gap_rate_m_per_s: 0.0 });
    scene
}

/// Times at which the head of [`bouncing`] meets the glass: `gap + h_d` swings at `omega` about zero, and
/// each landing scales its speed.
fn landings(scene: &Scene, restitution: f64, until: f64, closes: impl Fn(f64) -> bool) -> Vec<f64> {
    let blade = &scene.linkage;
    let (omega, hd) = ((blade.head.stiffness / blade.mass_kg).sqrt(), blade.preload_displacement_m);
    let first = (hd / (1e-3 + hd)).acos() / omega;
    let mut speed = omega * ((1e-3 + hd).powi(2) - hd * hd).sqrt();
    let mut times = vec![first];
    loop {
        speed *= restitution;
        let rebound = 2.0 * (speed / (omega * hd)).atan() / omega;
        let last = times[times.len() - 1];
        if closes(2.0 * speed / (omega * omega * hd)) || last + rebound > until {
            return times;
        }
        times.push(last + rebound);
    }
}

#[test]
fn a_bouncing_head_lands_when_its_spring_says() {
    for relative in [1e-6, 1e-8, 1e-10, 1e-12] {
        for restitution in [0.0, 0.3, 0.8, 1.0] {
            let scene = bouncing(restitution);
            let blade = &scene.linkage;
            let (_, fastest) = wiperlab::model::modes::time_scales_rad_per_s(blade);
            let resolution = 1e-5 * std::f64::consts::TAU / fastest;
            let expected =
                landings(&scene, restitution, scene.run.stop_s, |rebound_s| rebound_s < resolution);
            let flown = fly(&scene, relative);
            assert_eq!(flown.run.status, RunStatus::Completed);
            assert_eq!(flown.transitions.len(), expected.len(), "restitution {restitution} at {relative:e}");
            assert_eq!(flown.seen.impacts.len(), expected.len());
            for (i, (transition, time)) in flown.transitions.iter().zip(&expected).enumerate() {
                let last = restitution < 1.0 && i + 1 == expected.len();
                let to = if last { TipMode::Stick } else { TipMode::Flight };
                assert_eq!(
                    (transition.from, transition.to, transition.cause),
                    (TipMode::Flight, to, TransitionCause::Landing)
                );
                assert!(
                    (transition.time_s - time).abs() < 20.0 * relative * time,
                    "landing {i} at {} instead of {time} s",
                    transition.time_s
                );
            }
            assert!(flown.seen.lowest_m >= -relative * 1e-3, "{:e}", flown.seen.lowest_m);
            assert!(
                flown.audit.energy_residual_relative() < 100.0 * relative,
                "{:e}",
                flown.audit.energy_residual_relative()
            );
        }
    }
}

/// Grazing starts: so low, or so slow, that rebounds are over at once. Trains end; with restitution 1 they
/// last until the run or their number ends.
#[test]
fn the_lowest_rebounds_close_instead_of_looping() {
    for restitution in [0.0, 0.5, 0.99, 1.0] {
        for (gap_m, gap_rate_m_per_s) in [(1e-13, 0.0), (0.0, 1e-9), (0.0, 0.0), (1e-9, -1e-12)] {
            let mut scene = bouncing(restitution);
            let StartKind::Airborne(start) = scene.start else { panic!("off the glass") };
            scene.start = StartKind::Airborne(FlightState { gap_m, gap_rate_m_per_s, ..start });
            scene.run.stop_s = 1e-3;
            let flown = fly(&scene, 1e-8);
            assert_eq!(
                flown.run.status,
                RunStatus::Completed,
                "restitution {restitution}, gap {gap_m:e}: {:?}",
                flown.run
            );
            assert!(flown.transitions.len() <= 1001, "{}", flown.transitions.len());
            if gap_m < 1e-12 && (restitution < 1.0 || gap_m == 0.0) {
                assert_eq!(
                    flown.transitions.last().map(|t| (t.to, t.cause)),
                    Some((TipMode::Stick, TransitionCause::Landing)),
                    "restitution {restitution}"
                );
            }
        }
    }
}

/// What must hold of every flight: energy balanced, impacts that take energy and leave admissibly, a tip
/// above the glass, no force off it.
fn assert_sound(what: &str, scene: &Scene, flown: &Flown, relative: f64) {
    let length = scene.linkage.l1_m + scene.linkage.l2_m;
    assert!(
        flown.audit.energy_residual_relative() < 1e3 * relative,
        "{what}: energy {:e}, {:?}",
        flown.audit.energy_residual_relative(),
        flown.run
    );
    assert!(
        flown.seen.lowest_m > -10.0 * relative * length,
        "{what}: tip {:e} m below the glass",
        flown.seen.lowest_m
    );
    for impact in &flown.seen.impacts {
        let size: f64 =
            [(impact.before.normal, 0), (impact.before.tangential, 1), (impact.after.tangential, 1)]
                .map(|(velocity, axis)| (velocity * impact.impulse_n_s[axis]).abs())
                .iter()
                .sum();
        assert!(impact.lost_j >= -1e-9 * size, "{what}: an impact that gains energy: {impact:?}");
        assert!(
            impact.before.normal <= 0.0 && impact.after.normal >= 0.0 && impact.impulse_n_s[0] >= 0.0,
            "{what}: {impact:?}"
        );
        let mu = scene.linkage.friction.static_coefficient(1.0);
        assert!(
            impact.impulse_n_s[1].abs() <= mu * impact.impulse_n_s[0] * (1.0 + 1e-9) + 1e-9 * size,
            "{what}: beyond the cone: {impact:?}"
        );
    }
    for sample in &flown.seen.ends {
        assert!(sample.mode == TipMode::Flight || sample.tip_height_m == 0.0);
        assert!(sample.mode != TipMode::Flight || (sample.normal_n, sample.friction_n) == (0.0, 0.0));
        assert!(
            sample.mode == TipMode::Flight || sample.indicator < 1e-3 || sample.normal_n > -1e-6,
            "{what}: {sample:?}"
        );
    }
    for pair in flown.seen.ends.windows(2).filter(|p| p[0].time_s == p[1].time_s) {
        assert!(
            (pair[0].head_drop_m - pair[1].head_drop_m).abs() < 10.0 * relative * length,
            "{what}: the head jumps: {pair:?}"
        );
    }
}

fn lifting(preload: f64, restitution: f64) -> Scene {
    let mut scene = upright_light_blade()
        .with_parameter("blade.preload_force_n", preload)
        .unwrap()
        .with_parameter("contact.restitution", restitution)
        .unwrap();
    scene.loss = ContactLossRule::Fly;
    scene
}

#[test]
fn a_lightly_pressed_blade_flies_and_lands_and_its_transitions_do_not_depend_on_the_tolerance() {
    // rebounds make the motion sensitive: pressed on least, an error grows a thousandfold from 0.3 s on, so
    // that run is cut there
    for (preload, restitution, stop_s) in [(0.03, 0.0, 0.75), (0.03, 0.5, 0.75), (0.01, 0.3, 0.3)] {
        let mut scene = lifting(preload, restitution);
        scene.run.stop_s = stop_s;
        let fine = fly(&scene, 1e-11);
        assert_eq!(fine.run.status, RunStatus::Completed);
        assert!(number(&fine, TransitionCause::LiftOff) > 0 && number(&fine, TransitionCause::Landing) > 0);
        for relative in [1e-7, 1e-9] {
            let coarse = fly(&scene, relative);
            assert_sound("lifting", &scene, &coarse, relative);
            assert_eq!(
                coarse.transitions.len(),
                fine.transitions.len(),
                "preload {preload}, restitution {restitution} at {relative:e}"
            );
            for (a, b) in coarse.transitions.iter().zip(&fine.transitions) {
                assert_eq!((a.from, a.to, a.cause), (b.from, b.to, b.cause));
                assert!((a.time_s - b.time_s).abs() < 1e3 * relative, "{a:?} against {b:?}");
            }
        }
    }
}

/// A heavy head on a rough glass, the tip ahead of it and running on: where the paradox lies in wait.
pub fn heavy_head_leading_tip(rng: &mut Xoshiro256PlusPlus) -> Scene {
    let mut scene = upright_light_blade()
        .with_parameter("blade.head_mass_kg", 0.5)
        .unwrap()
        .with_parameter("friction.c", 0.6)
        .unwrap();
    let mut between = |low: f64, high: f64| rng.random_range(low..high);
    let pose = Pose {
        theta: between(0.1, 1.0),
        phi: between(0.1, 1.0),
        theta_rate: between(-50.0, 300.0),
        phi_rate: between(-50.0, 300.0),
    };
    scene.start = StartKind::State(pose);
    scene.run.stop_s = 0.02;
    scene.jam = JamRule::Impact;
    scene
}

#[test]
fn a_jam_is_an_impact_that_brings_the_tip_to_rest() {
    const RELATIVE: f64 = 1e-8;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
    let (mut jams, mut ends) = (0, std::collections::BTreeMap::<&str, usize>::new());
    for i in 0..100 {
        let mut scene = heavy_head_leading_tip(&mut rng);
        for loss in [ContactLossRule::Stop, ContactLossRule::Fly] {
            scene.loss = loss;
            let flown = fly(&scene, RELATIVE);
            assert_sound(&format!("state {i}"), &scene, &flown, RELATIVE);
            jams += number(&flown, TransitionCause::JamImpact);
            *ends.entry(flown.run.status.name()).or_default() += 1;
            let jammed = |impact: &&Impact| {
                flown
                    .transitions
                    .iter()
                    .any(|t| t.cause == TransitionCause::JamImpact && t.time_s == impact.time_s)
            };
            for impact in flown.seen.impacts.iter().filter(jammed) {
                assert_eq!(impact.after.tangential, 0.0, "state {i}");
                assert!(impact.lost_j > 0.0, "state {i}");
            }
        }
    }
    assert!(jams > 10 && ends["completed"] > 10 && !ends.contains_key("jammed"), "{jams} jams, {ends:?}");
}

/// Random blades, pressed on lightly so that they fly, over every restitution: no panic, no hang, everything
/// sound.
#[test]
fn random_blades_fly_and_jam_soundly() {
    const BLADES: usize = 8;
    const RELATIVE: f64 = 1e-7;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(21);
    let (mut ends, mut flights, mut jams) = (std::collections::BTreeMap::<&str, usize>::new(), 0, 0);
    for i in 0..BLADES {
        let mut parts = Parts::random(&mut rng);
        parts.hd *= 0.2;
        for restitution in [0.0, 0.3, 0.8] {
            let mut scene = parts.scene(STROKE).with_parameter("contact.restitution", restitution).unwrap();
            (scene.loss, scene.jam) = (ContactLossRule::Fly, JamRule::Impact);
            let flown = fly(&scene, RELATIVE);
            assert_sound(&format!("blade {i}, restitution {restitution}"), &scene, &flown, RELATIVE);
            flights += number(&flown, TransitionCause::LiftOff);
            jams += number(&flown, TransitionCause::JamImpact);
            *ends.entry(flown.run.status.name()).or_default() += 1;
        }
    }
    println!("{ends:?}, {flights} lift-offs, {jams} jams");
    assert!(flights > 0 && ends.contains_key("completed"), "{ends:?}");
}
