//! What the program is linked with computes the same bits on every machine.

use std::collections::BTreeSet;

/// Crates that choose code by the processor at run time, or that stand on the functions of the system's
/// library, and the room that does without them.
const NOT_PORTABLE: [(&str, &str); 1] =
    [("matrixmultiply", "products of matrices: nalgebra without its feature std")];

#[test]
fn no_crate_chooses_its_arithmetic_by_the_processor() {
    let linked = linked_with("wiperlab");
    assert!(linked.contains("nalgebra") && linked.len() > 100, "{linked:?}");
    for (name, instead) in NOT_PORTABLE {
        assert!(!linked.contains(name), "{name} ({instead})");
    }
}

/// Names of all packages of Cargo.lock that a package needs. (Arrays in Python compute nothing here.)
fn linked_with(package: &str) -> BTreeSet<String> {
    let lock: toml::Table = include_str!("../../Cargo.lock").parse().unwrap();
    let all = lock["package"].as_array().unwrap();
    let mut found = BTreeSet::from([package.to_owned()]);
    let mut open = vec![package.to_owned()];
    while let Some(name) = open.pop() {
        for of in all.iter().filter(|of| of["name"].as_str() == Some(&name)) {
            let needed = of.get("dependencies").and_then(|all| all.as_array()).into_iter().flatten();
            // (a version follows the name where there are several)
            let needed = needed.filter_map(|needed| needed.as_str()?.split(' ').next());
            open.extend(needed.filter(|needed| found.insert((*needed).to_owned())).map(str::to_owned));
        }
    }
    found
}

#[test]
fn transforms_have_no_variants_for_processors_and_the_turns_of_libm() {
    let asked = "realfft = { version = \"3.5\", default-features = false }";
    assert!(
        include_str!("../../crates/short-spectra/Cargo.toml").contains(asked),
        "its features choose by the processor"
    );
    assert!(
        include_str!("../../crates/short-spectra/src/transform.rs").contains("RealFftPlanner<PortableReal>")
    );
}

#[test]
fn functions_of_matrices_are_those_of_libm_in_one_version() {
    let lock = include_str!("../../Cargo.lock");
    let simba = lock.split("[[package]]").find(|package| package.contains("name = \"simba\"\n")).unwrap();
    assert!(simba.contains("\"libm\""), "nalgebra with its feature libm-force: {simba}");
    assert_eq!(lock.matches("name = \"libm\"\n").count(), 1);
    assert!(
        include_str!("../../Cargo.toml").contains("libm = \"=0.2.16\""),
        "results of another version differ"
    );
}
