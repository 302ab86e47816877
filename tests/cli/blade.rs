//! `wiperlab blade` as a user runs it: the table, the checks, refusals and doubts.

use crate::project::Project;
use assert_cmd::Command;
use std::fs;

const SECTION: &str = "data/sections/example.toml";
const SCENE: &str = "data/scenes/actual-blade.toml";

/// Exit code, standard output and standard error.
fn run(project: &Project, arguments: &[&str]) -> (i32, String, String) {
    let mut command = Command::cargo_bin("wiperlab").unwrap();
    let output = command.args(arguments).current_dir(project.path("")).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

/// Runs `wiperlab blade` on the example with one text in place of another.
fn changed(right: &str, wrong: &str) -> (i32, String, String) {
    let project = Project::copied();
    let text = fs::read_to_string(project.path(SECTION)).unwrap();
    assert!(text.contains(right), "{right}");
    fs::write(project.path("section.toml"), text.replacen(right, wrong, 1)).unwrap();
    let ran = run(&project, &["blade", "section.toml", "--out", "out"]);
    assert_eq!(project.path("out").exists(), ran.0 == 0, "{}", ran.2);
    ran
}

fn json(project: &Project, file: &str) -> serde_json::Value {
    serde_json::from_str(&fs::read_to_string(project.path(file)).unwrap()).unwrap()
}

/// The printed table stands in for that of a scene, which then runs.
#[test]
fn the_table_is_that_of_a_scene() {
    let project = Project::copied();
    let (code, table, stderr) = run(&project, &["blade", SECTION, "--out", "out"]);
    assert_eq!((code, stderr.as_str()), (0, ""));
    assert_eq!(fs::read_to_string(project.path("out/blade.toml")).unwrap(), table);
    assert!(table.contains("40 mm of blade") && table.contains("no measurement"), "{table}");
    let scene = fs::read_to_string(project.path(SCENE)).unwrap();
    let (before, rest) = scene.split_once("[blade]").unwrap();
    let (_, after) = rest.split_once("[shoulder]").unwrap();
    fs::write(project.path("scene.toml"), format!("{before}{table}[shoulder]{after}")).unwrap();
    let (code, _, stderr) = run(&project, &["modes", "scene.toml"]);
    assert_eq!((code, stderr.as_str()), (0, ""));
    let answer = json(&project, "out/blade.json");
    assert_eq!(answer["length_m"], 0.04);
    assert_eq!(answer["blade"].as_array().unwrap().len(), 15);
    assert_eq!(answer["findings"].as_array().unwrap().len(), 0);
    for quantity in answer["blade"].as_array().unwrap() {
        assert!(quantity["relative_uncertainty"].as_f64().unwrap() > 0.0, "{quantity}");
        assert!(!quantity["equation"].as_str().unwrap().is_empty(), "{quantity}");
    }
}

#[test]
fn a_scene_is_checked_with_ruler_and_scale() {
    let project = Project::copied();
    let arguments = ["blade", "--check", SCENE, "--length-m", "0.04", "--force-n", "0.02", "--out", "out"];
    let (code, stdout, stderr) = run(&project, &arguments);
    assert_eq!((code, stderr.as_str()), (0, ""));
    for part in ["on a scale", "with a ruler", "per metre", "20 mN", "195 Hz"] {
        assert!(stdout.contains(part), "expected {part:?} in {stdout}");
    }
    let answer = json(&project, "out/checks.json");
    let near = |found: &serde_json::Value, expected: f64| {
        assert!((found.as_f64().unwrap() / expected - 1.0).abs() < 1e-12, "{found} {expected}");
    };
    near(&answer["mass_kg"], 0.001409 + 0.0001 + 5.253e-5);
    near(&answer["per_metre"]["rubber_mass_kg_per_m"], (0.0001 + 5.253e-5) / 0.04);
    near(&answer["parts"]["neck_hz"], 195.0);
    near(&answer["preload_force_n"], 0.126);
    assert_eq!(answer["free_air_hz"].as_array().unwrap().len(), 2);
    assert_eq!(answer["held_tip_hz"].as_array().unwrap().len(), 1);
}

#[test]
fn bad_sections_are_refused_with_key_and_advice() {
    let refused = [
        ("density_kg_per_m3 = 1200.0", "density = 1200.0", "did you mean `density_kg_per_m3`?"),
        (
            "height_m = 0.004\n",
            "height_m = \"4 mm\"\n",
            "key `neck.height_m`: found the text \"4 mm\", expected",
        ),
        ("height_m = 0.004\n", "height_m = -0.004\n", "key `neck.height_m`: found -0.004, expected"),
        ("height_m = 0.004\n", "height_m = 0\n", "key `neck.height_m`: found 0, expected"),
        ("height_m = 0.004\n", "height_m = nan\n", "key `neck.height_m`: found nan, expected"),
        ("height_m = 0.004\n", "height_m = 1e300\n", "key `neck.height_m`: found 1e300, expected"),
        ("height_m = 0.004\n", "", "key `neck.height_m`: found nothing, expected"),
        ("hinge_height_m = 0.001\n", "", "key `neck.hinge_height_m`: found nothing"),
        ("length_m = 0.04\n", "", "key `length_m`: found nothing"),
        ("length_m = 0.04\n", "lenght_m = 0.04\n", "did you mean `length_m`?"),
        ("[lip]", "[lips]", "did you mean `lip`?"),
        ("format = 1", "format = 2", "key `format`: found 2, expected 1"),
    ];
    for (right, wrong, message) in refused {
        let (code, stdout, stderr) = changed(right, wrong);
        assert_eq!((code, stdout.as_str()), (2, ""), "{wrong}: {stderr}");
        assert!(stderr.starts_with("error: section.toml") && stderr.contains(message), "{wrong}: {stderr}");
        assert_eq!(stderr.lines().count(), 1, "{stderr}");
    }
}

#[test]
fn doubts_are_warnings_and_no_refusals() {
    let (code, stdout, stderr) = changed("height_m = 0.0035", "height_m = 3.5");
    assert_eq!(code, 0, "{stderr}");
    assert!(stdout.contains("lip_length_m = 3.5 "), "{stdout}");
    let words = "warning: section.toml: key `lip.height_m`: found 3.5 m, expected";
    assert!(stderr.starts_with(words) && stderr.contains("write 0.0035"), "{stderr}");
    assert_eq!(stderr.lines().count(), 1, "{stderr}");
}

/// `modes`, `simulate` and `fit` say the same of the same scene; `--quiet` does not.
#[test]
fn every_command_that_runs_a_scene_says_what_is_hard_to_believe() {
    let project = Project::copied();
    let scene = fs::read_to_string(project.path(SCENE)).unwrap();
    let right = "lip_damping_ratio = 0.0486";
    assert!(scene.contains(right));
    fs::write(project.path(SCENE), scene.replace(right, "lip_damping_ratio = 0.86")).unwrap();
    let expected = "key `blade.lip_damping_ratio`: found 0.86, expected 0 to 0.5";
    let job = "fits/actual-blade-twin/job.toml";
    let commands: [(&[&str], i32); 4] = [
        (&["modes", SCENE], 0),
        (&["simulate", SCENE, "--out", "out"], 0),
        (&["blade", "--check", SCENE], 0),
        (&["fit", job, "--max-evaluations", "2"], 3),
    ];
    for (arguments, expected_code) in commands {
        let (code, _, stderr) = run(&project, arguments);
        assert_eq!(code, expected_code, "{arguments:?}: {stderr}");
        let said = stderr.lines().filter(|line| line.starts_with("warning: ") && line.contains(expected));
        assert_eq!(said.count(), 1, "{arguments:?}: {stderr}");
    }
    let (_, _, stderr) = run(&project, &["--quiet", "modes", SCENE]);
    assert_eq!(stderr, "");
    let findings = &json(&project, "out/summary.json")["findings"];
    assert_eq!(findings[0]["key"], "blade.lip_damping_ratio");
    assert_eq!(findings.as_array().unwrap().len(), 1);
}

#[test]
fn wrong_options_are_refused() {
    let project = Project::copied();
    let refused: [(&[&str], &str); 5] = [
        (&["blade"], "SECTION"),
        (&["blade", SECTION, "--check", SCENE], "cannot be used with"),
        (&["blade", "--check", SCENE, "--length-m", "40mm"], "expected a number above 0"),
        (&["blade", "--check", SCENE, "--force-n", "-1"], "expected a number above 0"),
        (&["blade", "none.toml"], "none.toml"),
    ];
    for (arguments, words) in refused {
        let (code, stdout, stderr) = run(&project, arguments);
        assert_eq!((code, stdout.as_str()), (2, ""), "{arguments:?}: {stderr}");
        assert!(stderr.contains(words), "{arguments:?}: {stderr}");
    }
}

/// Every command of the page, in a copy of the committed data.
#[test]
fn the_commands_of_the_page_run() {
    const PAGE: &str = include_str!("../../docs/blade.md");
    let blocks = PAGE.split("```sh\n").skip(1).filter_map(|rest| rest.split("```").next());
    let commands: Vec<&str> =
        blocks.flat_map(str::lines).filter_map(|l| l.strip_prefix("wiperlab ")).collect();
    assert_eq!(commands.len(), 2);
    let project = Project::copied();
    for command in commands {
        let words: Vec<&str> = command.split_whitespace().collect();
        project.run_to(&words, &[0]);
    }
}
