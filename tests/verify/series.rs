//! The Taylor coefficients of the blade's motion against the right-hand side they must belong to, in every
//! mode of contact.

use crate::blade::{Parts, STROKE};
use hybrid_ode::taylor::{TaylorExpansion, TaylorPhase};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use wiperlab::model::Pose;
use wiperlab::model::flight::FlightState;
use wiperlab::model::friction::{FrictionLaw, FrictionShape, FrictionTable};
use wiperlab::model::shoulder::ShoulderContact;
use wiperlab::simulate::build_system;
use wiperlab::simulate::flight::{FlightPhase, flight_state_vector};
use wiperlab::simulate::phases::{DrivenBlade, GUARDS, JAMS, SlipPhase, StickPhase};

const STATES: usize = 200;
const ORDER: usize = 18;
/// Where the series are compared with what they expand, as shares of their radius of convergence:
/// `share^ORDER` is below rounding.
const AHEAD: [f64; 3] = [0.0, 0.03, 0.1];
/// Relative agreement: rounding in matrices whose condition is set by mass ratios up to 1e4.
const AGREEMENT: f64 = 1e-10;

struct Case {
    system: DrivenBlade,
    pose: Pose,
    lean: ShoulderContact,
    t: f64,
}

/// Random blades in random states that are not near a singularity of the motion.
fn cases() -> impl Iterator<Item = Case> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
    (0..STATES).map(move |_| {
        let scene = Parts::random(&mut rng).scene(STROKE);
        let mut within = |most: f64| most * rng.random_range(-1.0..1.0);
        let pose =
            Pose { theta: within(0.8), phi: within(0.8), theta_rate: within(100.0), phi_rate: within(100.0) };
        let lean = scene.linkage.shoulder.map_or(ShoulderContact::Off, |s| s.contact_at(pose.theta));
        Case { system: build_system(&scene), pose, lean, t: rng.random_range(0.0..1.0) }
    })
}

fn at<const N: usize>(rows: &[[f64; N]], x: f64) -> [f64; N] {
    rows.iter().rev().fold([0.0; N], |sum, row| std::array::from_fn(|i| sum[i] * x + row[i]))
}

/// The polynomials satisfy the differential equation and give the guards, at the start and ahead of it;
/// guards in `without` have no series.
fn assert_expands<const N: usize, P: TaylorPhase<N, GUARDS>>(
    phase: &P,
    t: f64,
    y: &[f64; N],
    without: &[usize],
    what: &str,
) {
    let mut out = TaylorExpansion { t, order: ORDER, ..TaylorExpansion::default() };
    phase.expand_series(t, y, &mut P::Tape::default(), &mut out);
    let (states, guards) = (&out.states[..=ORDER], &out.guards[..=ORDER]);
    let slopes: Vec<[f64; N]> =
        states.iter().enumerate().skip(1).map(|(k, row)| row.map(|c| k as f64 * c)).collect();
    let ratio = |k: usize, i: usize| states[k][i].abs() / phase.scale()[i].max(y[i].abs());
    let radius =
        [ORDER - 1, ORDER].map(|k| (0..N).map(|i| ratio(k, i)).fold(0.0, f64::max).powf(-1.0 / k as f64));
    for x in AHEAD.map(|share| share * radius[0].min(radius[1])) {
        let here = at(states, x);
        let (found, exact) = (at(&slopes, x), phase.derivative(t + x, &here));
        let size = exact.iter().fold(0.0f64, |most, e| most.max(e.abs()));
        for i in 0..N {
            assert!(
                (found[i] - exact[i]).abs() <= AGREEMENT * size,
                "{what}, derivative {i} at {x}: {} instead of {}",
                found[i],
                exact[i]
            );
        }
        let (found, exact) = (at(guards, x), phase.guards(t + x, &here));
        for g in (0..GUARDS).filter(|g| !without.contains(g) && exact[*g] < f64::INFINITY) {
            let size = guards
                .iter()
                .enumerate()
                .map(|(k, row)| (row[g] * x.powi(k as i32)).abs())
                .fold(exact[g].abs(), f64::max);
            assert!(
                (found[g] - exact[g]).abs() <= AGREEMENT * size,
                "{what}, guard {g} at {x}: {} instead of {}",
                found[g],
                exact[g]
            );
        }
    }
}

/// Each law in turn, with the coefficients of an exponential or with points; in every second round with all
/// further terms. No state reaches the last two knots of the table.
fn law(i: usize, exponential: FrictionLaw) -> FrictionLaw {
    let points = [(-20.0, 0.9), (20.0, 0.5), (60.0, 0.4)];
    let law = match i % 5 {
        0 => exponential,
        1 => FrictionLaw { shape: FrictionShape::Stribeck, exponent: 2.0, ..exponential },
        2 => FrictionLaw { shape: FrictionShape::Stribeck, exponent: 1.3, ..exponential },
        3 => FrictionLaw { shape: FrictionShape::Rational, ..exponential },
        _ => {
            let shape = FrictionShape::Table(FrictionTable::from_points(&points).unwrap());
            FrictionLaw { shape, ..FrictionLaw::exponential(1.0, 1.0, 0.0) }
        }
    };
    match i % 10 {
        0..5 => law,
        _ => FrictionLaw { viscous_s_per_m: 0.3, static_ratio: 1.2, backward_ratio: 0.8, ..law },
    }
}

#[test]
fn slip_expands_to_its_own_motion() {
    let mut tested = 0;
    for (i, mut case) in cases().enumerate() {
        let head = case.system.drive.motion_at(case.t);
        let speed = case.system.linkage.tip_velocity_m_per_s(
            &case.pose,
            &wiperlab::model::LinkDirections::from_pose(&case.pose),
            &head,
        );
        case.system.linkage.friction = law(i, case.system.linkage.friction);
        let piece = case.system.linkage.friction.piece_at(speed.abs());
        let slip = SlipPhase { system: &case.system, direction: speed.signum(), lean: case.lean, piece };
        let y = [case.pose.theta, case.pose.phi, case.pose.theta_rate, case.pose.phi_rate];
        // the indicator is constant in the expansion, and near its zero the radius of the series is short; N
        // is taken for its sign alone
        let guards = hybrid_ode::HybridPhase::guards(&slip, case.t, &y);
        if guards[JAMS] < 0.5 {
            continue;
        }
        tested += 1;
        assert_expands(
            &slip,
            case.t,
            &y,
            &[JAMS, wiperlab::simulate::phases::SLIP_CONTACT_LOST],
            &format!("state {i} of slip"),
        );
        let mut out = TaylorExpansion { order: ORDER, ..TaylorExpansion::default() };
        slip.expand_series(
            case.t,
            &y,
            &mut <SlipPhase<'_> as TaylorPhase<4, GUARDS>>::Tape::default(),
            &mut out,
        );
        assert!((out.guards[0][JAMS] - guards[JAMS]).abs() < 1e-10, "indicator of state {i}");
        let normal = guards[wiperlab::simulate::phases::SLIP_CONTACT_LOST] / guards[JAMS];
        let found = out.guards[0][wiperlab::simulate::phases::SLIP_CONTACT_LOST];
        assert!(
            (found - normal).abs() <= 1e-8 * normal.abs().max(1.0),
            "normal force of state {i}: {found} instead of {normal}"
        );
    }
    assert!(tested > STATES / 2, "{tested}");
}

#[test]
fn stick_expands_to_its_own_motion() {
    for (i, case) in cases().enumerate() {
        let stick = StickPhase::from_pose(&case.system, case.t, &case.pose, case.lean);
        let y = stick.free_states(&case.pose);
        assert_expands(&stick, case.t, &y, &[], &format!("state {i} of stick"));
    }
}

#[test]
fn flight_expands_to_its_own_motion() {
    for (i, case) in cases().enumerate() {
        let flight = FlightPhase { system: &case.system, lean: case.lean };
        let state = FlightState {
            pose: case.pose,
            gap_m: 1e-5 * (i % 7) as f64,
            gap_rate_m_per_s: 0.01 * (i % 5) as f64,
        };
        assert_expands(&flight, case.t, &flight_state_vector(&state), &[], &format!("state {i} of flight"));
    }
}
