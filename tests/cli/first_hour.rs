//! The first hour of a newcomer, as docs/first-hour.md has it, and with poorer recordings.
//!
//! `cargo test --test cli first_hour -- --include-ignored` makes all of it, some minutes.

use crate::page;
use crate::small_fit::Project;
use serde_json::Value;
use wiperlab::simulate::scene::Scene;

const PAGE: &str = include_str!("../../docs/first-hour.md");
const SCENE: &str = include_str!("../../data/scenes/another-blade.toml");
const TWIN: &str = include_str!("../../data/twins/another-blade.toml");

/// The numbers that the reader replaces.
fn edits() -> Vec<String> {
    let blocks = page::blocks(PAGE).into_iter().filter(|block| block.language == "toml");
    blocks.flat_map(|block| block.text.lines().map(str::to_owned).collect::<Vec<_>>()).collect()
}

fn project() -> Project {
    let project = Project::of("twin");
    project.write("data/scenes/another-blade.toml", SCENE);
    project.write("data/twins/another-blade.toml", TWIN);
    project
}

/// Replaces numbers in a file; each must stand there once.
fn edited(project: &Project, file: &str, edits: &[String]) {
    let mut text = project.read(file);
    for edit in edits {
        let key = edit.split_once('=').unwrap().0;
        let old: Vec<String> = text.lines().filter(|line| line.starts_with(key)).map(str::to_owned).collect();
        assert_eq!(old.len(), 1, "{edit}");
        text = text.replace(&old[0], edit);
    }
    project.write(file, &text);
}

fn run(project: &Project, command: &str) -> String {
    let parts = command.split('"').enumerate();
    let words: Vec<&str> = parts
        .flat_map(|(i, part)| if i % 2 == 1 { vec![part] } else { part.split_whitespace().collect() })
        .skip(1)
        .collect();
    let (code, said, err) = project.run(&words);
    assert_eq!((code, err.as_str()), (0, ""), "{command}\n{said}");
    said
}

/// The fit explains the recording, and every parameter's interval holds the value of the scene.
fn holds_the_truth(project: &Project, result: &str) {
    let result: Value = serde_json::from_str(&project.read(result)).unwrap();
    assert_eq!(result["misfit"]["explained"], true, "{}", result["misfit"]["reasons"]);
    let truth = Scene::parse("another-blade.toml", SCENE).unwrap();
    let parameters = result["parameters"].as_object().unwrap();
    assert_eq!(parameters.len(), 5);
    for (name, found) in parameters {
        let [lower, upper] = ["lower_95", "upper_95"].map(|end| found[end].as_f64().unwrap());
        let truth = truth.value(name).unwrap();
        assert!(lower < truth && truth < upper, "{name}: {truth} is not from {lower} to {upper}");
        assert!(upper < 2.5 * lower, "{name}: {lower} to {upper} says little");
    }
}

#[test]
fn the_commands_of_the_page_lead_to_a_report_with_the_truth_in_its_intervals() {
    let (project, commands) = (project(), page::commands(PAGE));
    let of_the_reader = commands.iter().filter(|line| !line.contains("wiperlab twin")).count();
    assert!(of_the_reader <= 8 && edits().len() == 3);
    for command in commands {
        if command.starts_with("wiperlab fit ") {
            edited(&project, "fits/film/scene.toml", &edits());
        }
        run(&project, &command);
    }
    holds_the_truth(&project, "fits/film/result.json");
    let page = project.read("reports/film/index.html");
    assert!(page.contains("The model explains the recording") && page.contains("Synthetic data"));
}

/// The recording of the page as a trace, each row changed; its folder is that of the trace.
fn changed(project: &Project, twin: &str, change: impl Fn(&mut Vec<String>)) {
    project.write("data/twins/another-blade.toml", twin);
    run(project, "wiperlab twin data/twins/another-blade.toml --out out/film");
    let trace = project.read("out/film/trace.csv");
    let mut lines = trace.lines();
    let mut text = format!("{}\n", lines.next().unwrap());
    for line in lines {
        let mut row: Vec<String> = line.split(',').map(str::to_owned).collect();
        change(&mut row);
        text += &format!("{}\n", row.join(","));
    }
    project.write("data/film/trace.csv", &text);
}

fn moved(value: &mut String, by: f64) {
    if let Ok(number) = value.parse::<f64>() {
        *value = format!("{}", number + by);
    }
}

/// What the page does behind the import.
fn fitted(project: &Project, options: &str) {
    run(project, &format!("wiperlab init data/film --out fits/film {options}"));
    edited(project, "fits/film/scene.toml", &edits());
    run(project, "wiperlab fit fits/film/job.toml");
    holds_the_truth(project, "fits/film/result.json");
}

#[test]
#[ignore = "a fit of a minute"]
fn markers_may_stand_beside_what_they_are_for() {
    let project = project();
    changed(&project, TWIN, |row| {
        for (column, by) in [(1, 3e-4), (2, 2e-4), (3, -1.2e-3), (4, 8e-4)] {
            moved(&mut row[column], by);
        }
    });
    fitted(&project, "");
}

#[test]
#[ignore = "a fit of a minute"]
fn the_tip_alone_is_enough_with_the_stroke_of_the_rig() {
    let project = project();
    changed(&project, TWIN, |row| {
        moved(&mut row[0], -0.4);
        moved(&mut row[1], -0.07);
        row[3..5].iter_mut().for_each(String::clear);
    });
    fitted(&project, "--amplitude-m 0.0453 --frequency-hz 0.749");
}

/// What the tip alone says of the stroke is not enough for a fit, and the fit says so.
#[test]
#[ignore = "a fit of a minute"]
fn a_stroke_that_was_estimated_from_the_tip_explains_no_recording() {
    let project = project();
    changed(&project, TWIN, |row| row[3..5].iter_mut().for_each(String::clear));
    run(&project, "wiperlab init data/film --out fits/film");
    edited(&project, "fits/film/scene.toml", &edits());
    assert_eq!(project.run(&["fit", "fits/film/job.toml"]).0, 3);
    let result: Value = serde_json::from_str(&project.read("fits/film/result.json")).unwrap();
    assert_eq!(result["misfit"]["explained"], false);
}

#[test]
#[ignore = "a fit of two minutes"]
fn a_recording_may_hold_three_reversals() {
    let project = project();
    project.write("data/scenes/another-blade.toml", &SCENE.replace("stop_s = 1.0", "stop_s = 2.6"));
    changed(&project, TWIN, |_| ());
    fitted(&project, "");
}
