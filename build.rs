//! Says to the program how it is built, for `wiperlab --version`.

use std::env;
use std::fs;
use std::process::Command;

/// Where `cargo package` notes the commit.
const PACKAGED: &str = ".cargo_vcs_info.json";
/// Names the commit where a release is built from a checkout.
const COMMIT: &str = "WIPERLAB_COMMIT";

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-env-changed={COMMIT}");
    let variable = |name: &str| env::var(name).unwrap_or_else(|_| "unknown".to_owned());
    let compiler = Command::new(variable("RUSTC")).arg("--version").output();
    let compiler = compiler.ok().and_then(|output| String::from_utf8(output.stdout).ok());
    let compiler = compiler.unwrap_or_else(|| "an unknown compiler".to_owned());
    let commit = env::var(COMMIT).ok().or_else(packaged).unwrap_or_else(|| "not recorded".to_owned());
    println!("cargo::rustc-env=WIPERLAB_BUILT_FOR={}", variable("TARGET"));
    println!("cargo::rustc-env=WIPERLAB_BUILT_WITH={}", compiler.trim());
    println!("cargo::rustc-env=WIPERLAB_OPT_LEVEL={}", variable("OPT_LEVEL"));
    println!("cargo::rustc-env=WIPERLAB_BUILT_FROM={}", commit.trim());
}

/// The commit of a package.
fn packaged() -> Option<String> {
    let text = fs::read_to_string(PACKAGED).ok()?;
    println!("cargo::rerun-if-changed={PACKAGED}");
    let after = text.split_once("\"sha1\"")?.1;
    Some(after.split('"').nth(1)?.to_owned())
}
