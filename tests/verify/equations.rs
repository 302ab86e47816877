//! The equations of motion against an independent evaluation of Lagrange's equations, and the paper's
//! equations (1) to (3) as printed.

use crate::lagrangian;

use crate::blade::{Parts, STROKE};
use hybrid_ode::HybridPhase;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use wiperlab::model::shoulder::ShoulderContact;
use wiperlab::model::{FrictionResponse, HeadMotion, LinkDirections, Linkage, Pose};
use wiperlab::simulate::mode::holding_force;
use wiperlab::simulate::phases::{DrivenBlade, SlipPhase, StickPhase};
use wiperlab::simulate::scene::Drive;

const STATES: usize = 400;
/// Both sides solve a small linear system in double precision whose condition is set by mass ratios up to
/// 1e4.
const AGREEMENT: f64 = 1e-10;

/// A random blade in a random state, with a friction force of the size of its preload.
struct Case {
    parts: Parts,
    linkage: Linkage,
    pose: Pose,
    head: HeadMotion,
    lean: ShoulderContact,
    friction_n: f64,
}

impl Case {
    fn random(rng: &mut Xoshiro256PlusPlus) -> Self {
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
        let friction_n = within(parts.k[0] * parts.hd);
        let lean = linkage.shoulder.map_or(ShoulderContact::Off, |s| s.contact_at(pose.theta));
        Self { parts, linkage, pose, head, lean, friction_n }
    }

    fn contact(&self) -> FrictionResponse {
        self.linkage.friction_response(
            &self.pose,
            &LinkDirections::from_pose(&self.pose),
            &self.head,
            self.lean,
        )
    }

    /// The same state for the independent evaluation, the head's drop following from the tip's contact with
    /// the glass.
    fn lagrangian(&self) -> lagrangian::Linkage {
        let [l1, l2] = self.parts.l;
        let Pose { theta, phi, theta_rate, phi_rate } = self.pose;
        let drop = l1 * (1.0 - theta.cos()) + l2 * (1.0 - phi.cos());
        let drop_rate = l1 * theta.sin() * theta_rate + l2 * phi.sin() * phi_rate;
        let rates = [self.head.velocity_m_per_s, drop_rate, theta_rate, phi_rate];
        lagrangian::Linkage::at(
            &self.parts,
            [self.head.position_m, drop, theta, phi],
            rates,
            self.lean.angle_sign(),
        )
    }
}

fn cases() -> impl Iterator<Item = Case> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    (0..STATES).map(move |_| Case::random(&mut rng))
}

/// `found` against `expected`, relative to the largest of the terms that make it up.
fn assert_close(what: &str, index: usize, found: f64, expected: f64, terms: &[f64]) {
    let size = terms.iter().fold(expected.abs(), |size, t| size.max(t.abs()));
    assert!(
        (found - expected).abs() <= AGREEMENT * size,
        "{what}, state {index}: found {found:e}, expected {expected:e}"
    );
}

#[test]
fn accelerations_and_normal_force_follow_from_the_lagrangian() {
    let mut leaning = 0;
    for (i, case) in cases().enumerate() {
        let contact = case.contact();
        let f = case.friction_n;
        let independent = case.lagrangian();
        let answer = independent.answer(case.head.acceleration_m_per_s2, f);
        for link in 0..2 {
            let parts = [contact.free[link], f * contact.per_force[link]];
            assert_close(
                "angular acceleration",
                i,
                parts[0] + parts[1],
                answer.accelerations[2 + link],
                &parts,
            );
        }
        let normal = [contact.n_free, f * contact.nu];
        assert_close("normal force", i, normal[0] + normal[1], answer.normal_n, &normal);
        let tip = [contact.a_free, f * contact.kappa];
        assert_close(
            "tip acceleration",
            i,
            tip[0] + tip[1],
            independent.tip_acceleration(&answer.accelerations),
            &tip,
        );
        assert!(contact.kappa > 0.0);
        leaning += usize::from(case.lean != ShoulderContact::Off);
    }
    assert!(leaning > STATES / 10, "only {leaning} states lean on the shoulder");
}

#[test]
fn energy_is_that_of_the_bodies_and_springs_and_its_rate_is_the_power() {
    for (i, case) in cases().enumerate() {
        let d = LinkDirections::from_pose(&case.pose);
        let independent = case.lagrangian();
        let energy = independent.energy_j();
        assert_close("energy", i, case.linkage.energy_j(&case.pose, &d, &case.head), energy, &[]);
        let answer = independent.answer(case.head.acceleration_m_per_s2, case.friction_n);
        let rate = independent.energy_rate_w(&answer.accelerations);
        let accelerations = [answer.accelerations[2], answer.accelerations[3]];
        let power =
            case.linkage.power_w(&case.pose, &d, &case.head, case.lean, case.friction_n, accelerations);
        let fastest = case.pose.theta_rate.abs().max(case.pose.phi_rate.abs()); // the rate is a sum of terms of this size that cancel
        assert_close("power", i, power, rate, &[energy * fastest]);
    }
}

/// Residuals of equations (1), (2) and (3) as the paper prints them, in SI units (the lip's spring is `m_phi
/// (phi - theta)` there), each relative to its largest term. The shoulder is no part of the paper; its moment
/// joins the neck's spring.
fn printed_residuals(case: &Case, [ddt, ddp]: [f64; 2], normal: f64, f: f64) -> [f64; 3] {
    let Linkage { mass_kg: m, l1_m: l1, l2_m: l2, m_a, m_b, m_c, m_theta, m_phi, .. } = case.linkage;
    let Pose { theta, phi, theta_rate: dt, phi_rate: dp } = case.pose;
    let [k0, k1, k2] = case.parts.k;
    let [c0, c1, c2] = case.parts.c;
    let vdd = case.head.acceleration_m_per_s2;
    let shoulder = case
        .linkage
        .shoulder
        .filter(|_| case.lean != ShoulderContact::Off)
        .map_or(0.0, |s| s.moment(theta, dt, case.lean.angle_sign()));
    let (st, ct, sp, cp) = (theta.sin(), theta.cos(), phi.sin(), phi.cos());
    let (s, c) = ((theta - phi).sin(), (theta - phi).cos());
    let first = [
        (m_theta - m_a * l1 * st * st) * ddt,
        (m_c * c - m_a * l2 * st * sp) * ddp,
        -m_a * l1 * ct * st * dt * dt,
        (m_c * s - m_a * l2 * cp * st) * dp * dp,
        m_a * vdd * ct,
        -normal * l1 * st,
        -f * l1 * ct,
        -k2 * (phi - theta),
        -c2 * (dp - dt),
        k1 * theta,
        c1 * dt,
        shoulder,
    ];
    let second = [
        (m_c * c - m_b * l1 * st * sp) * ddt,
        (m_phi - m_b * l2 * sp * sp) * ddp,
        -(m_c * s + m_b * l1 * ct * sp) * dt * dt,
        -m_b * l2 * cp * sp * dp * dp,
        m_b * vdd * cp,
        -normal * l2 * sp,
        -f * l2 * cp,
        k2 * (phi - theta),
        c2 * (dp - dt),
    ];
    let third = [
        -normal,
        (m_a - m * l1) * st * ddt,
        (m_b - m * l2) * sp * ddp,
        (m_a - m * l1) * ct * dt * dt,
        (m_b - m * l2) * cp * dp * dp,
        -k0 * (l1 * (1.0 - ct) + l2 * (1.0 - cp) - case.parts.hd),
        -c0 * (l1 * st * dt + l2 * sp * dp),
    ];
    let residual = |terms: &[f64]| {
        terms.iter().sum::<f64>().abs() / terms.iter().fold(0.0, |size: f64, t| size.max(t.abs()))
    };
    [residual(&first), residual(&second), residual(&third)]
}

/// The drive passes through the case's head motion at t = 0 only if it is uniform: the phases are tried with
/// the head unaccelerated.
fn uniform(case: &mut Case) -> DrivenBlade {
    case.head = HeadMotion { position_m: 0.0, acceleration_m_per_s2: 0.0, ..case.head };
    let drive = Drive::Uniform { speed_m_per_s: case.head.velocity_m_per_s };
    DrivenBlade { linkage: case.linkage, drive, angle_scale: 0.1, rate_scale: 100.0 }
}

#[test]
fn slip_satisfies_the_equations_as_printed() {
    for (i, mut case) in cases().enumerate() {
        let system = uniform(&mut case);
        let velocity =
            case.linkage.tip_velocity_m_per_s(&case.pose, &LinkDirections::from_pose(&case.pose), &case.head);
        let Pose { theta, phi, theta_rate, phi_rate } = case.pose;
        let slip = SlipPhase { system: &system, direction: velocity.signum(), lean: case.lean, piece: 0 };
        let [_, _, ddt, ddp] = slip.derivative(0.0, &[theta, phi, theta_rate, phi_rate]);
        // equation (4), and the normal force from the accelerations by the Lagrangian's constraint
        let [a, b, c] = case.parts.friction;
        let mu = velocity.signum() * (a * (-b * velocity.abs()).exp() + c);
        let contact = case.contact();
        let normal = contact.n_free / (1.0 + mu * contact.nu);
        for (equation, residual) in
            printed_residuals(&case, [ddt, ddp], normal, -mu * normal).into_iter().enumerate()
        {
            assert!(residual < AGREEMENT, "equation ({}), state {i}: {residual:e}", equation + 1);
        }
        let answer = case.lagrangian().answer(0.0, -mu * normal);
        assert_close("normal force of slip", i, normal, answer.normal_n, &[contact.n_free]);
    }
}

#[test]
fn stick_satisfies_the_equations_as_printed() {
    for (i, mut case) in cases().enumerate() {
        let system = uniform(&mut case);
        // the lip's rate that keeps the tip at rest
        let [l1, l2] = case.parts.l;
        case.pose.phi_rate = -(case.head.velocity_m_per_s
            + l1 * case.pose.theta.cos() * case.pose.theta_rate)
            / (l2 * case.pose.phi.cos());
        let stick = StickPhase::from_pose(&system, 0.0, &case.pose, case.lean);
        let [rate, acceleration] = stick.derivative(0.0, &stick.free_states(&case.pose));
        let contact = case.contact();
        let f = holding_force(&contact);
        let accelerations = [0, 1].map(|link| contact.free[link] + f * contact.per_force[link]);
        let own = usize::from(rate != case.pose.theta_rate);
        assert_close("acceleration in stick", i, acceleration, accelerations[own], &[contact.free[own]]);
        for (equation, residual) in
            printed_residuals(&case, accelerations, contact.n_free + contact.nu * f, f)
                .into_iter()
                .enumerate()
        {
            assert!(residual < AGREEMENT, "equation ({}), state {i}: {residual:e}", equation + 1);
        }
        let independent = case.lagrangian();
        let answer = independent.answer(0.0, f);
        assert_close(
            "tip acceleration in stick",
            i,
            independent.tip_acceleration(&answer.accelerations),
            0.0,
            &[contact.a_free],
        );
    }
}
