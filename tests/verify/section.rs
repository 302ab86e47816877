//! From a section to a blade: closed forms of rods, plates and beams, limits, additivity and scaling.

use wiperlab::model::section::{BladeEstimate, BladeSection, LinkSection, RubberHinge, plate_modulus_pa};
use wiperlab::simulate::bench_checks::BenchChecks;
use wiperlab::simulate::scene::Scene;

const EXAMPLE: &str = include_str!("../../data/sections/example.toml");
/// Rounding of a few products.
const ROUNDING: f64 = 1e-13;

fn link(height_m: f64, top_thickness_m: f64, bottom_thickness_m: f64) -> LinkSection {
    LinkSection { height_m, top_thickness_m, bottom_thickness_m, hinge: None }
}

fn example() -> BladeEstimate {
    BladeEstimate::from_section(&BladeSection::parse("example.toml", EXAMPLE).unwrap())
}

/// The example with other numbers.
fn changed(changes: &[(&str, f64)]) -> BladeEstimate {
    let text = EXAMPLE.lines().map(|line| {
        let key = line.split_once(" = ").map_or("", |(key, _)| key);
        let (_, number) = line.split_once(" = ").unwrap_or_default();
        let factor = changes.iter().find(|(name, _)| *name == key).map_or(1.0, |(_, factor)| *factor);
        match number.parse::<f64>() {
            Ok(number) if factor != 1.0 => format!("{key} = {:e}\n", factor * number),
            _ => format!("{line}\n"),
        }
    });
    BladeEstimate::from_section(&BladeSection::parse("example.toml", &text.collect::<String>()).unwrap())
}

#[track_caller]
fn near(found: f64, expected: f64, relative: f64) {
    assert!((found / expected - 1.0).abs() < relative, "{found} {expected}");
}

#[test]
fn a_rectangle_is_a_plate() {
    let (h, t) = (0.0037, 0.0012);
    let plate = link(h, t, t);
    near(plate.area_m2(), h * t, ROUNDING);
    near(plate.centre_m(), h / 2.0, ROUNDING);
    near(plate.polar_moment_m4(), h * t * (h * h + t * t) / 12.0, ROUNDING);
}

#[test]
fn a_thin_one_is_a_rod_and_a_sharp_one_a_triangle() {
    let (h, t) = (0.004, 4e-8);
    let rod = link(h, t, t);
    near(rod.polar_moment_m4(), rod.area_m2() * h * h / 12.0, 2e-10); // t^2/h^2 is 1e-10
    let edge = link(h, t, 0.0);
    near(edge.centre_m(), h / 3.0, ROUNDING);
    near(edge.polar_moment_m4(), edge.area_m2() * h * h / 18.0, 2e-10);
    let upside_down = link(h, 0.0, t);
    near(upside_down.centre_m(), 2.0 * h / 3.0, ROUNDING);
}

/// Mass and first moment of two parts are those of the whole, and by the parallel axes the inertia too.
#[test]
fn a_trapezoid_is_the_sum_of_its_parts() {
    let (h, t1, t2, cut) = (0.004, 0.003, 0.001, 0.3);
    let between = t1 + (t2 - t1) * cut;
    let (whole, upper, lower) =
        (link(h, t1, t2), link(cut * h, t1, between), link((1.0 - cut) * h, between, t2));
    near(upper.area_m2() + lower.area_m2(), whole.area_m2(), ROUNDING);
    let below = cut * h + lower.centre_m();
    let centre = (upper.area_m2() * upper.centre_m() + lower.area_m2() * below) / whole.area_m2();
    near(centre, whole.centre_m(), ROUNDING);
    let moved = |part: &LinkSection, at: f64| part.polar_moment_m4() + part.area_m2() * (at - centre).powi(2);
    near(moved(&upper, upper.centre_m()) + moved(&lower, below), whole.polar_moment_m4(), ROUNDING);
}

#[test]
fn a_hinge_is_a_beam_under_a_moment() {
    let (modulus, t, l) = (plate_modulus_pa(6e6), 4e-4, 1e-3);
    near(modulus, 8e6, ROUNDING); // 4/3 of Young's modulus: rubber keeps its volume
    let hinge = |thickness_m, height_m| RubberHinge { thickness_m, height_m }.stiffness_n_per_rad(modulus);
    near(hinge(t, l), modulus * t.powi(3) / 12.0 / l, ROUNDING); // E' I/L
    near(hinge(t, l / 2.0) / 2.0, hinge(t, l), ROUNDING); // two halves in series
    near(hinge(2.0 * t, l), 8.0 * hinge(t, l), ROUNDING);
}

#[test]
fn a_link_without_hinge_is_a_cantilever() {
    let (modulus, h, t) = (8e6, 0.0035, 8e-4_f64);
    let second_moment = t.powi(3) / 12.0;
    near(link(h, t, t).stiffness_n_per_rad(modulus), 3.0 * modulus * second_moment / h, ROUNDING);
    // int_0^h s^2/t^3 ds with t = t2 + c s is [ln t + 2 t2/t - t2^2/(2 t^2)]/c^3
    for ratio in [0.05, 0.3, 0.7] {
        let (t2, c) = (ratio * t, (1.0 - ratio) * t / h);
        let antiderivative = |t: f64| t.ln() + 2.0 * t2 / t - t2 * t2 / (2.0 * t * t);
        let integral = (antiderivative(t) - antiderivative(t2)) / c.powi(3);
        near(link(h, t, t2).stiffness_n_per_rad(modulus), modulus * h * h / (12.0 * integral), 1e-12);
    }
}

/// Lengths by a factor: masses by its cube, inertias by its fifth power, stiffnesses (force times length) by
/// its cube, and so frequencies of links by its inverse.
#[test]
fn dimensions_scale_as_they_must() {
    let factor = 1.5_f64;
    let lengths = [
        "length_m",
        "height_m",
        "top_thickness_m",
        "bottom_thickness_m",
        "hinge_thickness_m",
        "hinge_height_m",
    ];
    let (one, large) = (example(), changed(&lengths.map(|key| (key, factor))));
    let powers =
        [("neck_mass_kg", 3), ("lip_centre_m", 1), ("neck_inertia_kg_m2", 5), ("lip_inertia_kg_m2", 5)];
    let stiffnesses = [("neck_stiffness_n_m_per_rad", 3), ("lip_stiffness_n_m_per_rad", 3)];
    for (key, power) in powers.into_iter().chain(stiffnesses) {
        near(large.value(key).unwrap() / one.value(key).unwrap(), factor.powi(power), ROUNDING);
    }
    let frequency =
        |estimate: &BladeEstimate| scene(estimate).value("blade.lip_natural_frequency_hz").unwrap();
    near(frequency(&large) * factor, frequency(&one), 2e-3); // the table has four digits
}

#[test]
fn twice_the_piece_has_twice_the_mass_stiffness_and_force() {
    let (one, two) = (example(), changed(&[("length_m", 2.0)]));
    for quantity in &one.blade {
        let same = quantity.key.ends_with("_m") || quantity.key.ends_with("_ratio");
        let factor = if same && !quantity.key.ends_with("per_m") { 1.0 } else { 2.0 };
        near(two.value(quantity.key).unwrap(), factor * quantity.value, ROUNDING);
    }
}

/// Each input alone, by the difference that its deviation makes.
#[test]
fn the_uncertainty_is_that_of_the_inputs() {
    let of =
        |key: &str| example().blade.iter().find(|quantity| quantity.key == key).unwrap().relative_uncertainty;
    let (thickness, height, piece) = (5e-5 / 4e-4, 5e-5 / 1e-3, 5e-4 / 0.04_f64);
    let cube = 3.0 * thickness + thickness * thickness * thickness;
    let inverse = height / (1.0 - height * height);
    let hinge = [cube, inverse, piece, 0.3].iter().map(|d| d * d).sum::<f64>().sqrt();
    near(of("neck_stiffness_n_m_per_rad"), hinge, 1e-12);
    near(of("preload_force_n"), piece.hypot(0.1), 1e-12);
    near(of("lip_damping_ratio"), 0.3, 1e-12);
}

/// The table in a scene.
fn scene(estimate: &BladeEstimate) -> Scene {
    let rest = "[friction]\na = 0.1\nb_s_per_m = 5.0\nc = 0.3\n[drive]\namplitude_m = 0.045\nfrequency_hz = 0.75\n[run]\nstop_s = 1.0\nsample_rate_hz = 1000.0\n";
    let text = format!("format = 1\ntitle = \"from a section\"\n{}{rest}", estimate.to_toml());
    Scene::parse("scene.toml", &text).unwrap()
}

#[test]
fn the_table_is_that_of_a_scene_and_believable() {
    let estimate = example();
    let scene = scene(&estimate);
    for quantity in &estimate.blade {
        near(scene.value(&format!("blade.{}", quantity.key)).unwrap(), quantity.value, 5e-4);
    }
    assert_eq!(scene.find_implausible(), []);
    // a rigid plate on the spring of a cantilever swings at sqrt(3 k/m)/h, were it no thicker than a rod
    let lip = |key: &str| estimate.value(key).unwrap();
    let rod = (3.0 * lip("lip_stiffness_n_m_per_rad") / lip("lip_mass_kg")).sqrt() / lip("lip_length_m");
    let found = std::f64::consts::TAU * scene.value("blade.lip_natural_frequency_hz").unwrap();
    near(found, rod, 0.1); // it tapers: its centre lies higher
    assert!(found > rod);
}

/// Statics of the two links: under a force along the glass in air, and in steady slip.
#[test]
fn deflections_balance_the_moments() {
    for name in ["actual-blade", "light-blade", "published-experiment", "published-simulation"] {
        let scene = crate::scenes::committed(name);
        let (blade, force) = (&scene.linkage, 0.013);
        let (l1, l2, k1, k2) = (blade.l1_m, blade.l2_m, blade.neck.stiffness, blade.lip.stiffness);
        let checks = BenchChecks::from_scene(&scene, force, None);
        near(checks.tip_displacement_m, force * ((l1 + l2).powi(2) / k1 + l2 * l2 / k2), 1e-12);
        near(checks.lip_displacement_m, force * l2 * l2 / k2, 1e-12);
        near(checks.weight_n, 9.80665 * checks.mass_kg, ROUNDING);
        let slide = checks.slide.unwrap();
        let (theta, phi) = (-slide.neck_angle_rad, -slide.lip_angle_rad); // the links trail
        near(slide.deflection_m, -(l1 * theta.sin() + l2 * phi.sin()), ROUNDING);
        // (1) to (3) at rest, with f = -mu N; the shoulder adds to the neck
        let normal = blade.head.stiffness * (blade.preload_displacement_m - slide.head_drop_m);
        let friction = -blade.friction.dynamic_coefficient(slide.speed_m_per_s, 1.0) * normal;
        let neck = k1 * theta
            + blade.shoulder.map_or(0.0, |shoulder| {
                shoulder.stiffness_n_m_per_rad
                    * theta.signum()
                    * (theta.abs() - shoulder.contact_angle_rad).max(0.0)
            });
        let lip = k2 * (phi - theta);
        near(neck - lip, l1 * (normal * theta.sin() + friction * theta.cos()), 1e-9);
        near(lip, l2 * (normal * phi.sin() + friction * phi.cos()), 1e-9);
    }
}
