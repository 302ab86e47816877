//! Hostile inputs: time and peak memory of the built program on each, in a table.
//!
//! `cargo test --test hostile -- --nocapture` prints it. Memory that a system counts for a program includes
//! what its parent had, so this is a program of its own that never holds an input.
#![cfg(target_os = "linux")]

mod inputs;

use assert_cmd::cargo::cargo_bin;
use inputs::{Input, inputs};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;
use wait4::Wait4;

/// Most memory: a multiple of the file, and what the program itself takes, bytes.
const MEMORY: (u64, u64) = (4, 50_000_000);
/// Longest time, a profile without the last optimisations and a busy machine included.
const TIME: Duration = Duration::from_secs(10);
const FEWEST: usize = 50;

#[test]
fn no_input_takes_time_or_memory_out_of_proportion() {
    let folder = TempDir::new().unwrap();
    let inputs = inputs(folder.path());
    assert!(inputs.len() >= FEWEST, "{}", inputs.len());
    println!("{:<58} {:>4} {:>8} {:>9} {:>9}", "input", "code", "s", "file, MB", "peak, MB");
    let wrong: Vec<String> = inputs.iter().filter_map(|input| wrong(input, folder.path())).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Runs the program on an input and prints its row; what is wrong with it, if anything.
fn wrong(input: &Input, folder: &Path) -> Option<String> {
    let clock = Instant::now();
    let mut command = Command::new(cargo_bin!("wiperlab"));
    command.args(&input.arguments).current_dir(folder).stdin(Stdio::null());
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let used = child.wait4().unwrap();
    let (took, code, peak) = (clock.elapsed(), used.status.code(), used.rusage.maxrss);
    let file =
        input.file.as_ref().map_or(0, |file| std::fs::metadata(folder.join(file)).map_or(0, |m| m.len()));
    println!(
        "{:<58} {:>4} {:>8.2} {:>9.1} {:>9.1}",
        input.name,
        code.map_or("-".to_owned(), |code| code.to_string()),
        took.as_secs_f64(),
        file as f64 / 1e6,
        peak as f64 / 1e6
    );
    let largest = MEMORY.0 * file.min(1_000_000_000) + MEMORY.1;
    let is_right = code.is_some_and(|code| input.codes.contains(&code)) && took < TIME && peak <= largest;
    (!is_right).then(|| format!("{}: code {code:?}, {took:?}, {peak} bytes of at most {largest}", input.name))
}
