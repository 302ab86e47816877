//! Doubts about numbers: none about the committed files, the right one about each usual slip.

use std::fs;
use std::path::Path;
use wiperlab::model::parameters;
use wiperlab::model::plausibility;
use wiperlab::model::plausibility::PlausibilitySubject;
use wiperlab::model::section::BladeSection;
use wiperlab::simulate::scene::Scene;

const BLADE: &str = include_str!("../../data/scenes/actual-blade.toml");
const PAGE: &str = include_str!("../../docs/blade.md");
const SECTION: &str = include_str!("../../data/sections/example.toml");

fn files(folder: &str) -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    fs::read_dir(folder).unwrap().map(|entry| fs::read_to_string(entry.unwrap().path()).unwrap()).collect()
}

#[test]
fn committed_files_raise_no_doubt() {
    let scenes = files("data/scenes");
    assert!(scenes.len() >= 6, "{}", scenes.len());
    for text in scenes {
        assert_eq!(Scene::parse("scene.toml", &text).unwrap().find_implausible(), []);
    }
    for text in files("data/sections") {
        assert_eq!(BladeSection::parse("section.toml", &text).unwrap().find_implausible(), []);
    }
}

/// Key, value in place of the right one, part of the advice.
const SLIPS: [(&str, &str, &str); 16] = [
    ("blade.neck_length_m", "3.822", "millimetres written as metres: then write 0.003822"),
    ("blade.lip_inertia_kg_m2", "7.687e-9", "three powers of ten too many: then write 7.687e-12"),
    ("blade.lip_inertia_kg_m2", "7.687e-3", "g mm2 written as kg m2: then write 7.687e-12"),
    ("blade.head_mass_kg", "0.0", "check the value"),
    ("blade.head_mass_kg", "14.09", "grams written as kilograms: then write 0.01409"),
    ("blade.lip_mass_kg", "0.05253", "grams written as kilograms: then write 5.253e-5"),
    ("blade.lip_centre_m", "6.492e-7", "millimetres turned into metres twice: then write 6.492e-4"),
    ("blade.neck_natural_frequency_hz", "0.195", "kHz written as Hz: then write 195"),
    ("blade.head_natural_frequency_hz", "2000.0", "check the value"),
    ("blade.neck_damping_ratio", "1.23", "percent written as a ratio: then write 0.0123"),
    ("blade.preload_force_n", "126.0", "grams of a scale written as newtons: then write 1.23564"),
    ("shoulder.contact_angle_rad", "1.5", "degrees written as radians: then write 0.0261799"),
    ("friction.c", "3.0", "a decimal point one place too far to the right: then write 0.3"),
    ("friction.a", "1.9", "check the value"),
    ("drive.amplitude_m", "45.3", "millimetres written as metres: then write 0.0453"),
    ("drive.frequency_hz", "47.0", "check the value"),
];

#[test]
fn a_usual_slip_is_named_with_what_to_write() {
    let right = Scene::parse("scene.toml", BLADE).unwrap();
    for (key, value, advice) in SLIPS {
        let found = right.with_parameter(key, value.parse().unwrap()).unwrap().find_implausible();
        let one =
            found.iter().find(|finding| finding.key == key).unwrap_or_else(|| panic!("{key}: {found:?}"));
        assert!(one.advice.contains(advice), "{key}: {one}");
        assert_eq!(found.len(), 1, "{key}: {found:#?}"); // and nothing that only follows from it
    }
}

/// A quantity that is written another way is judged too, under the key of the file.
#[test]
fn a_stiffness_is_judged_by_its_frequency() {
    let right = Scene::parse("scene.toml", BLADE).unwrap();
    let found = right.with_parameter("blade.neck_stiffness_n_m_per_rad", 1.9).unwrap().find_implausible();
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(found[0].key, "blade.neck_stiffness_n_m_per_rad");
    assert!(found[0].found.contains("Hz for natural frequency of the neck"), "{}", found[0]);
    let found = right.with_parameter("blade.preload_displacement_m", 5.0).unwrap().find_implausible();
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(found[0].key, "blade.preload_displacement_m");
    assert_eq!(found[0].advice, "check the value and its unit"); // the slips of the row are those of a force
}

#[test]
fn slips_in_a_section_are_named() {
    let slips = [
        ("length_m = 0.04\n", "length_m = 40.0\n", "length_m", "write 0.04"),
        ("= 1200.0", "= 1.2", "rubber.density_kg_per_m3", "g/cm3 written as kg/m3: then write 1200"),
        ("= 6e6", "= 6", "rubber.youngs_modulus_pa", "MPa written as Pa: then write 6e6"),
        ("= 0.2\n", "= 20.0\n", "rubber.loss_factor", "then write 0.2"),
        ("= 0.0006", "= 0.6", "lip.bottom_thickness_m", "then write 6e-4"),
    ];
    for (right, wrong, key, advice) in slips {
        assert!(SECTION.contains(right), "{right}");
        let section = BladeSection::parse("section.toml", &SECTION.replacen(right, wrong, 1)).unwrap();
        let found = section.find_implausible();
        assert_eq!(found.len(), 1, "{key}: {found:#?}");
        assert_eq!(found[0].key, key);
        assert!(found[0].advice.contains(advice), "{}", found[0]);
    }
}

/// Rows are of keys that exist, their ranges have an order and lie within what is admitted.
#[test]
fn every_row_is_of_a_key_that_files_have() {
    for row in plausibility::SCENE_RANGES {
        let parameter = parameters::find_parameter(row.key).unwrap_or_else(|| panic!("{}", row.key));
        let judged_itself = matches!(row.judged, PlausibilitySubject::Value);
        assert!(!judged_itself || row.unit == parameter.unit, "{}", row.key);
        assert!(!judged_itself || row.range.iter().all(|end| parameter.range.admits(*end)), "{}", row.key);
        assert!(row.range[0] < row.range[1], "{}", row.key);
    }
    for row in plausibility::SECTION_RANGES {
        assert!(PAGE.contains(&format!("`{}`", row.key)), "{}: not in docs/blade.md", row.key);
        assert!(row.range[0] < row.range[1], "{}", row.key);
    }
}
