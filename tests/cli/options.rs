//! Options that take a number, with numbers that they cannot take.

use std::process::Command;

const EXPORT: &str = "data/actual-blade-twin/synthetic-tracker-export.txt";

/// Every option that takes a number, with a command that needs nothing else to come to it.
const OPTIONS: [(&[&str], &[&str]); 5] = [
    (
        &["import", EXPORT, "--out", "none"],
        &["--frame-rate-hz", "--scale", "--frame-step", "--exposure-s", "--min-likelihood", "--threads"],
    ),
    (&["fit", "fits/published-simulation/job.toml"], &["--max-evaluations"]),
    (&["demo", "--out", "none"], &["--max-evaluations"]),
    (
        &["spectrum", "data/actual-blade-twin", "--out", "none"],
        &["--max-components", "--exposure-s", "--fastest-hz", "--band", "--window"],
    ),
    (
        &["simulate", "data/scenes/light-blade.toml", "--out", "none"],
        &["--relative-tolerance", "--step", "--gain"],
    ),
];

#[test]
fn a_negative_number_is_refused_for_what_it_is() {
    for (command, options) in OPTIONS {
        for option in options {
            let args: Vec<&str> = command.iter().copied().chain([*option, "-5"]).collect();
            let out = Command::new(env!("CARGO_BIN_EXE_wiperlab"))
                .args(&args)
                .current_dir(env!("CARGO_MANIFEST_DIR"))
                .output()
                .unwrap();
            let stderr = String::from_utf8_lossy(&out.stderr);
            assert!(out.status.code() == Some(2) && out.stdout.is_empty(), "{args:?}: {stderr}");
            let honest =
                ["unexpected argument", "invalid digit", "-- -5"].iter().all(|w| !stderr.contains(w));
            assert!(
                honest && stderr.contains(option) && stderr.contains("-5") && stderr.contains("expected"),
                "{args:?}: {stderr}"
            );
        }
    }
}
