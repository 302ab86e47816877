//! Impacts with friction against Routh's method by hand, Newton's law without friction, the closed form of
//! slip under friction that falls with speed, a plain step-by-step integration, and the Painlevé rod.

use hybrid_ode::WorkCounters;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use wiperlab::model::friction::FrictionLaw;
use wiperlab::model::shoulder::ShoulderContact;
use wiperlab::model::{HeadMotion, LinkDirections, Linkage, Pose, Spring};
use wiperlab::simulate::impact::{
    ContactSurface, ImpactOrigin, ImpactOutcome, InverseMass, TipVelocity, solve_impact,
};

const RELATIVE: f64 = 1e-12;
/// Errors of closed forms, in units of the tolerance and of the sizes that go in.
const AGREEMENT: f64 = 20.0 * RELATIVE;

fn coulomb(mu: f64, restitution: f64) -> ContactSurface {
    ContactSurface { friction: FrictionLaw::exponential(0.0, 0.0, mu), restitution }
}

fn hit(mass: InverseMass, surface: &ContactSurface, normal: f64, tangential: f64) -> ImpactOutcome {
    let origin = if normal < 0.0 { ImpactOrigin::Collision } else { ImpactOrigin::Jam };
    solve_impact(
        &mass,
        surface,
        TipVelocity { normal, tangential },
        origin,
        RELATIVE,
        &mut WorkCounters::default(),
    )
    .unwrap()
}

fn assert_outcome(found: &ImpactOutcome, normal: f64, tangential: f64, impulse: f64) {
    let expected = [normal, tangential, impulse];
    for (found, expected) in
        [found.velocity.normal, found.velocity.tangential, found.impulse_n_s[0]].into_iter().zip(expected)
    {
        assert!(
            (found - expected).abs() <= AGREEMENT * expected.abs().max(1.0),
            "found {found}, expected {expected}"
        );
    }
}

#[test]
fn without_friction_the_normal_velocity_is_newtons() {
    let mass = InverseMass { nn: 2.0, nt: -1.2, tt: 3.0 };
    for restitution in [0.0, 0.3, 1.0] {
        let impulse = (1.0 + restitution) * 0.7 / 2.0;
        let found = hit(mass, &coulomb(0.0, restitution), -0.7, 0.4);
        assert_outcome(&found, 0.7 * restitution, 0.4 - 1.2 * impulse, impulse);
        assert!(found.impulse_n_s[1].abs() < AGREEMENT);
        assert!((found.lost_j - 0.5 * 0.7 * 0.7 / 2.0 * (1.0 - restitution * restitution)).abs() < AGREEMENT);
    }
}

/// `W = (2, 0, 3)`, `mu = 1/2`, `v = (-1, 10)`: the tip slides throughout, `dv_n/dp = 2`, `dv_t/dp = -3/2`.
#[test]
fn sliding_throughout() {
    let mass = InverseMass { nn: 2.0, nt: 0.0, tt: 3.0 };
    assert_outcome(&hit(mass, &coulomb(0.5, 0.0), -1.0, 10.0), 0.0, 9.25, 0.5);
    assert_outcome(&hit(mass, &coulomb(0.5, 0.6), -1.0, 10.0), 0.6, 8.8, 0.8);
    assert_outcome(&hit(mass, &coulomb(0.5, 0.6), -1.0, -10.0), 0.6, -8.8, 0.8);
}

/// The same blow ever more glancing: the tip slides on as if nothing were, and what changes is as exact as
/// before.
#[test]
fn glancing_blows() {
    let mass = InverseMass { nn: 2.0, nt: 0.5, tt: 3.0 };
    for normal in [1e-3, 1e-6, 1e-9, 1e-13] {
        let found = hit(mass, &coulomb(0.5, 0.6), -normal, 1.0);
        let impulse = 1.6 * normal / 1.75;
        assert!(
            (found.impulse_n_s[0] - impulse).abs() < AGREEMENT * impulse,
            "{normal:e}: {} instead of {impulse}",
            found.impulse_n_s[0]
        );
        assert!((found.velocity.normal - 0.6 * normal).abs() < AGREEMENT * normal);
        assert!((found.velocity.tangential - (1.0 - impulse)).abs() < 1e-15);
    }
}

/// `W = (2, 1, 3)`, `mu = 1/2`: slip at `dv/dp = (3/2, -1/2)`, then stick at `dv_n/dp = 5/3`.
#[test]
fn sliding_then_stick() {
    let mass = InverseMass { nn: 2.0, nt: 1.0, tt: 3.0 };
    // at rest at p = 0.4 with v_n = -0.4, compressed at p = 0.4 + 0.24; work taken 0.28 + 0.048
    assert_outcome(&hit(mass, &coulomb(0.5, 0.0), -1.0, 0.2), 0.0, 0.0, 0.64);
    let back = (2.0 * 5.0 / 3.0 * 0.25 * 0.328f64).sqrt();
    assert_outcome(&hit(mass, &coulomb(0.5, 0.5), -1.0, 0.2), back, 0.0, 0.64 + 0.6 * back);
    // compressed at p = 2/3 while sliding, at rest in restitution at p = 0.8 with v_n = 0.2
    let back = (0.04 + 2.0 * 5.0 / 3.0 * (1.0 / 3.0 - 0.2 * (0.8 - 2.0 / 3.0) / 2.0f64)).sqrt();
    assert_outcome(&hit(mass, &coulomb(0.5, 1.0), -1.0, 0.4), back, 0.0, 0.8 + 0.6 * (back - 0.2));
    // in units a million times smaller nothing changes but the sizes
    let small = hit(mass, &coulomb(0.5, 0.0), -1e-6, 0.2e-6);
    assert!((small.impulse_n_s[0] - 0.64e-6).abs() < 1e-6 * AGREEMENT && small.velocity.tangential == 0.0);
}

/// `W = (2, -1.2, 2)`, `mu = 0.3`: too little friction to stick, so slip turns round: `dv/dp = (2.36, -1.8)`,
/// then `(1.64, -0.6)`.
#[test]
fn slip_that_turns_round() {
    let mass = InverseMass { nn: 2.0, nt: -1.2, tt: 2.0 };
    let at_rest = 1.0 - 2.36 * 0.3 / 1.8; // what is left to compress when the tip is at rest, at p = 0.3/1.8
    let compressed = at_rest / 1.64;
    assert_outcome(&hit(mass, &coulomb(0.3, 0.0), -1.0, 0.3), 0.0, -0.6 * compressed, 0.3 / 1.8 + compressed);
    let taken = 0.5 * (1.0 + at_rest) * 0.3 / 1.8 + 0.5 * at_rest * compressed;
    let back = (2.0 * 1.64 * 0.25 * taken).sqrt();
    let impulse = compressed + back / 1.64;
    assert_outcome(&hit(mass, &coulomb(0.3, 0.5), -1.0, 0.3), back, -0.6 * impulse, 0.3 / 1.8 + impulse);
    // from rest the tip slips at once
    assert_outcome(&hit(mass, &coulomb(0.3, 0.0), -1.0, 0.0), 0.0, -0.6 / 1.64, 1.0 / 1.64);
}

/// `W = (1, 2, 5)`, `mu = 1`: the paradox. Slip compresses at `dv/dp = (-1, -3)` to rest at p = 1; stick
/// restores at 1/5.
#[test]
fn a_jam_compresses_by_itself() {
    let mass = InverseMass { nn: 1.0, nt: 2.0, tt: 5.0 };
    let plastic = hit(mass, &coulomb(1.0, 0.0), 0.0, 3.0);
    assert_outcome(&plastic, 0.0, 0.0, 6.0);
    assert!(
        (plastic.lost_j - 4.5).abs() < AGREEMENT,
        "the whole energy of the tangential motion, v_t^2 nn / 2 det W"
    );
    let back = (2.0 * 0.2 * 0.25 * 3.0f64).sqrt(); // work taken: 1/2 + 5/2
    assert_outcome(&hit(mass, &coulomb(1.0, 0.5), 0.0, 3.0), back, 0.0, 6.0 + 5.0 * back);
    // on the border of the paradox nothing compresses and friction alone stops the tip
    let border = InverseMass { nn: 1.0, nt: 1.0, tt: 2.0 };
    assert_outcome(&hit(border, &coulomb(1.0, 0.0), 0.0, 3.0), 0.0, 0.0, 3.0);
    // a landing on the way into the paradox goes the same way: -1 - 1 at rest, then 5 to rest
    assert_outcome(&hit(mass, &coulomb(1.0, 0.0), -1.0, 3.0), 0.0, 0.0, 1.0 + 2.0 * 5.0);
}

/// Slip of speed `s` under `mu = a exp(-b s) + c`: `exp(b s)` obeys a linear equation in `p`. Compression
/// ends where `v_n + W_nn p + W_nt P_t` vanishes, `P_t` being what has changed `v_t`.
#[test]
fn friction_that_falls_with_speed_follows_its_closed_form_and_the_tolerance() {
    let mass = InverseMass { nn: 3.0, nt: 0.8, tt: 4.0 };
    let friction = FrictionLaw::exponential(0.4, 2.0, 0.2);
    let (normal, tangential) = (-0.9, 2.0);
    let (linear, constant) = (mass.nt - mass.tt * friction.c, mass.tt * friction.a);
    let speed = |p: f64| {
        let (b, start) = (friction.b_s_per_m, (friction.b_s_per_m * tangential).exp());
        let z = if linear == 0.0 {
            start - b * constant * p
        } else {
            constant / linear + (start - constant / linear) * (b * linear * p).exp()
        };
        z.ln() / b
    };
    let normal_at = |p: f64| normal + mass.nn * p + mass.nt * (speed(p) - tangential - mass.nt * p) / mass.tt;
    let (mut low, mut high) = (0.0, 1.0);
    assert!(normal_at(high) > 0.0);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if normal_at(middle) < 0.0 { low = middle } else { high = middle }
    }
    for relative in [1e-4, 1e-6, 1e-8, 1e-10, 1e-12] {
        let before = TipVelocity { normal, tangential };
        let surface = ContactSurface { friction, restitution: 0.0 };
        let found = solve_impact(
            &mass,
            &surface,
            before,
            ImpactOrigin::Collision,
            relative,
            &mut WorkCounters::default(),
        )
        .unwrap();
        assert_eq!(found.velocity.normal, 0.0);
        assert!(
            (found.impulse_n_s[0] - low).abs() < 20.0 * relative,
            "{} instead of {low}",
            found.impulse_n_s[0]
        );
        assert!(
            (found.velocity.tangential - speed(low)).abs() < 20.0 * relative * tangential,
            "{relative:e}"
        );
    }
}

/// The impact in small steps of the impulse, nothing but the law: slip, rest, and work counted as it comes.
fn step_by_step(mass: InverseMass, surface: &ContactSurface, before: TipVelocity) -> [f64; 3] {
    let TipVelocity { mut normal, mut tangential } = before;
    let h = 1e-5 * normal.abs().max(tangential.abs()) / mass.nn;
    let (mut impulse, mut taken, mut given) = (0.0, 0.0, 0.0);
    let mut compressing = true;
    loop {
        let holds = mass.nt.abs() <= surface.friction.static_coefficient(1.0) * mass.tt;
        let towards = if tangential == 0.0 { mass.nt } else { tangential };
        let share = if tangential == 0.0 && holds {
            -mass.nt / mass.tt
        } else {
            -towards.signum() * surface.friction.dynamic_coefficient(tangential.abs(), towards)
        };
        let (dn, dt) = (mass.nn + mass.nt * share, mass.nt + mass.tt * share);
        let stops = tangential != 0.0 && (tangential + h * dt) * tangential <= 0.0;
        let step = if stops { -tangential / dt } else { h };
        let work = step * (normal + 0.5 * step * dn);
        if normal + 0.5 * step * dn < 0.0 {
            taken -= work
        } else {
            given += work
        }
        normal += step * dn;
        tangential = if stops || (tangential == 0.0 && holds) { 0.0 } else { tangential + step * dt };
        impulse += step;
        compressing = compressing && normal < 0.0;
        if !compressing && normal >= 0.0 && given >= surface.restitution * surface.restitution * taken {
            return [normal, tangential, impulse * mass.nn];
        }
    }
}

#[test]
fn impacts_agree_with_small_steps_and_never_gain_energy() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
    let (mut stuck, mut turned, mut slid, mut compressing_slip) = (0, 0, 0, 0);
    for i in 0..200 {
        let mut between = |low: f64, high: f64| rng.random_range(low..high);
        let (nn, tt) = (between(0.5, 4.0), between(0.5, 4.0));
        let nt = between(-0.95, 0.95) * (nn * tt).sqrt();
        let friction = FrictionLaw::exponential(between(0.0, 1.0), between(0.0, 8.0), between(0.0, 1.0));
        let before = TipVelocity { normal: -between(0.05, 1.0), tangential: between(-2.0, 2.0) };
        let (mass, surface) =
            (InverseMass { nn, nt, tt }, ContactSurface { friction, restitution: [0.0, 0.4, 0.9][i % 3] });
        let found = solve_impact(
            &mass,
            &surface,
            before,
            ImpactOrigin::Collision,
            1e-9,
            &mut WorkCounters::default(),
        )
        .unwrap();
        let reference = step_by_step(mass, &surface, before);
        for (found, expected) in [found.velocity.normal, found.velocity.tangential, found.impulse_n_s[0] * nn]
            .into_iter()
            .zip(reference)
        {
            assert!(
                (found - expected).abs() < 1e-3 * (1.0 + reference[2]),
                "case {i}: {found} instead of {expected}: {mass:?} {surface:?} {before:?}"
            );
        }
        assert!(found.lost_j >= 0.0 && found.velocity.normal >= 0.0, "case {i}: {found:?}");
        stuck += usize::from(found.velocity.tangential == 0.0);
        turned += usize::from(found.velocity.tangential * before.tangential < 0.0);
        slid += usize::from(found.velocity.tangential * before.tangential > 0.0);
        compressing_slip +=
            usize::from(nn - before.tangential.signum() * friction.static_coefficient(1.0) * nt < 0.0);
    }
    assert!(
        stuck > 10 && turned > 4 && slid > 10 && compressing_slip > 5,
        "{stuck} {turned} {slid} {compressing_slip}"
    );
}

/// A rod alone: head and neck without mass, the neck upright and free to turn, so that the rod's upper end
/// moves at will.
fn free_rod(mass_kg: f64, length_m: f64, mu: f64) -> Linkage {
    let (l1, centre) = (1.7, 0.5 * length_m);
    let none = Spring { stiffness: 0.0, damping: 0.0 };
    Linkage {
        mass_kg,
        l1_m: l1,
        l2_m: length_m,
        m_a: mass_kg * l1,
        m_b: mass_kg * centre,
        m_c: mass_kg * l1 * centre,
        m_theta: mass_kg * l1 * l1,
        m_phi: mass_kg * length_m * length_m / 3.0,
        head: none,
        neck: none,
        lip: none,
        preload_displacement_m: 0.0,
        friction: FrictionLaw::exponential(0.0, 0.0, mu),
        shoulder: None,
    }
}

/// Painlevé's rod: `W_nn = (1 + 3 cos^2 alpha)/m`, `W_nt = 3 sin alpha cos alpha/m` at the angle `alpha` from
/// the surface; the paradox is first met at `mu = 4/3`, `tan alpha = 2` (63.4349 degrees).
#[test]
fn the_painleve_rod_jams_first_at_four_thirds() {
    let indicator = |mu: f64, alpha: f64| {
        let rod = free_rod(0.3, 0.8, mu);
        let pose =
            Pose { theta: 0.0, phi: std::f64::consts::FRAC_PI_2 - alpha, theta_rate: 0.0, phi_rate: 0.0 };
        let d = LinkDirections::from_pose(&pose);
        let [up, along] = rod.impulse_responses(&d);
        let (sin, cos) = alpha.sin_cos();
        let expected = [(1.0 + 3.0 * cos * cos) / 0.3, 3.0 * sin * cos / 0.3, (1.0 + 3.0 * sin * sin) / 0.3];
        for (found, expected) in
            [up.normal_per_kg, up.tangential_per_kg, along.tangential_per_kg].into_iter().zip(expected)
        {
            assert!((found.abs() - expected).abs() < 1e-12 * expected.max(1.0), "{found} {expected}");
        }
        assert!((up.tangential_per_kg - along.normal_per_kg).abs() < 1e-12);
        let head = HeadMotion { position_m: 0.0, velocity_m_per_s: 0.0, acceleration_m_per_s2: 0.0 };
        let leading = -up.tangential_per_kg.signum()
            * rod.friction_response(&pose, &d, &head, ShoulderContact::Off).nu.signum();
        assert_eq!(leading, 1.0, "nu = -W_nt/W_nn");
        1.0 - mu * up.tangential_per_kg.abs() / up.normal_per_kg
    };
    let critical = 2f64.atan();
    assert!((critical.to_degrees() - 63.4349).abs() < 1e-4);
    assert!(indicator(4.0 / 3.0, critical).abs() < 1e-12);
    for degrees in 1..90 {
        assert!(indicator(4.0 / 3.0, f64::from(degrees).to_radians()) > 0.0, "{degrees} degrees");
        assert!(indicator(4.0 / 3.0 - 1e-9, f64::from(degrees).to_radians()) > 0.0);
    }
    assert!(indicator(4.0 / 3.0 + 1e-9, critical) < 0.0);
}
