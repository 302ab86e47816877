//! How near the example of a section comes to the committed blades. No section of a real blade is published,
//! so that this compares two examples, and nothing is tuned: the ratios are what they are.

use wiperlab::model::section::{BladeEstimate, BladeSection};
use wiperlab::simulate::scene::Scene;
use wiperlab::text::round_to_digits;

const EXAMPLE: &str = include_str!("../../data/sections/example.toml");
const ACTUAL: &str = include_str!("../../data/scenes/actual-blade.toml");
const LIGHT: &str = include_str!("../../data/scenes/light-blade.toml");

/// The example with the lengths of a scene's links, for a piece whose neck has the mass of the scene's.
fn of_the_size_of(scene: &Scene) -> BladeEstimate {
    let number = |key: &str| scene.value(key).unwrap();
    let estimate = |piece_m: f64| {
        let text = EXAMPLE
            .replace("length_m = 0.04", &format!("length_m = {piece_m}"))
            .replace("height_m = 0.004\n", &format!("height_m = {}\n", number("blade.neck_length_m")))
            .replace("height_m = 0.0035\n", &format!("height_m = {}\n", number("blade.lip_length_m")));
        BladeEstimate::from_section(&BladeSection::parse("example.toml", &text).unwrap())
    };
    let metre = estimate(1.0).value("neck_mass_kg").unwrap();
    estimate(number("blade.neck_mass_kg") / metre)
}

/// Numbers of the table over those of a scene, with two digits.
fn ratios(text: &str) -> [f64; 10] {
    let scene = Scene::parse("scene.toml", text).unwrap();
    let estimate = of_the_size_of(&scene);
    COMPARED.map(|key| {
        let ratio = estimate.value(key).unwrap() / scene.value(&format!("blade.{key}")).unwrap();
        round_to_digits(ratio, 2)
    })
}

const COMPARED: [&str; 10] = [
    "neck_mass_kg",
    "lip_mass_kg",
    "neck_centre_m",
    "lip_centre_m",
    "neck_inertia_kg_m2",
    "lip_inertia_kg_m2",
    "neck_stiffness_n_m_per_rad",
    "lip_stiffness_n_m_per_rad",
    "neck_damping_ratio",
    "preload_force_n",
];

#[test]
fn the_example_over_the_actual_blade() {
    assert_eq!(ratios(ACTUAL), [1.0, 0.3, 0.83, 1.2, 1.3, 0.55, 0.25, 17.0, 8.1, 1.3]);
}

#[test]
fn the_example_over_the_light_blade() {
    assert_eq!(ratios(LIGHT), [1.0, 1.2, 0.83, 1.2, 1.2, 1.9, 0.042, 1.8, 2.2, 0.57]);
}
