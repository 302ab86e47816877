//! What the README says can be run as it stands.

use crate::project::Project;
use std::path::PathBuf;

const README: &str = include_str!("../../README.md");

/// Lines of the README's shell blocks that start with `start`.
fn commands(start: &str) -> Vec<&'static str> {
    let blocks = README.split("```sh\n").skip(1).filter_map(|rest| rest.split("```").next());
    blocks.flat_map(str::lines).filter(|line| line.starts_with(start)).collect()
}

#[test]
fn the_two_commands_are_those_of_the_check() {
    let check = std::fs::read_to_string(root().join(".ci/run")).unwrap();
    let two = commands("cargo ");
    assert_eq!(two, ["cargo run --release -- demo", "cargo test"]);
    assert!(two.iter().all(|command| check.lines().any(|line| line == *command)));
}

/// Every command of the pipeline, in order, in a copy of the committed data; the fit with a small budget.
#[test]
fn the_pipeline_runs_as_written() {
    let project = Project::copied();
    let pipeline = commands("wiperlab ");
    assert_eq!(pipeline.len(), 11);
    for line in pipeline {
        let mut words = split(line);
        let is_fit = words[1] == "fit";
        if is_fit {
            words.extend(["--max-evaluations".to_owned(), "12".to_owned()]);
        }
        let arguments: Vec<&str> = words.iter().skip(1).map(String::as_str).collect();
        project.run_to(&arguments, &[if is_fit { 3 } else { 0 }]);
    }
    let page = std::fs::read_to_string(project.path("reports/actual-blade-twin/index.html")).unwrap();
    assert!(page.contains("Synthetic data"));
}

#[test]
fn the_files_that_the_readme_links_exist() {
    let links = README.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    let missing: Vec<&str> = links.filter(|link| !root().join(link).exists()).collect();
    assert!(missing.is_empty(), "{missing:?}");
}

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Words of a command; what stands in double quotes is one word.
fn split(line: &str) -> Vec<String> {
    let parts = line.split('"').enumerate();
    let words =
        parts.flat_map(|(i, part)| if i % 2 == 1 { vec![part] } else { part.split_whitespace().collect() });
    words.map(str::to_owned).collect()
}
