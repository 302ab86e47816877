//! The two commands that the README begins with.

use crate::page::commands;

#[test]
fn the_two_commands_are_those_of_the_check() {
    let check = std::fs::read_to_string(crate::tracked::root().join(".ci/run")).unwrap();
    let all = commands(include_str!("../../README.md"));
    let two: Vec<&String> = all.iter().filter(|command| command.starts_with("cargo ")).collect();
    assert_eq!(two, ["cargo run --release -- demo", "cargo test"]);
    assert!(two.iter().all(|command| check.lines().any(|line| line == *command)));
}
