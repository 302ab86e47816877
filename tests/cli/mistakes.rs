//! Mistakes of a newcomer in the files that `wiperlab init` writes: each message names the key, the value,
//! what was expected and what to do, and several mistakes of a file are all named at once.

use crate::small_fit::Project;

const SCENE: &str = "fits/film/scene.toml";
const JOB: &str = "fits/film/job.toml";
const TWIN: &str = "data/twins/mine.toml";

/// File, what is changed in it, what it is changed to, and what the message says.
const MISTAKES: [(&str, &str, &str, &[&str]); 48] = [
    // numbers
    (
        SCENE,
        "head_mass_kg = 0.001409",
        "head_mass_kg = 0,0014",
        &["`head_mass_kg`", "found 0,0014", "write 0.0014", "point"],
    ),
    (
        SCENE,
        "head_mass_kg = 0.001409",
        "head_mass_kg = \"0,0014\"",
        &["`blade.head_mass_kg`", "\"0,0014\"", "a number", "write 0.0014"],
    ),
    (
        SCENE,
        "head_mass_kg = 0.001409",
        "head_mass_kg = \"0.0014\"",
        &["`blade.head_mass_kg`", "write 0.0014 without quotes"],
    ),
    (
        SCENE,
        "head_mass_kg = 0.001409",
        "head_mass_kg = .0014",
        &["`head_mass_kg`", "found .0014", "write 0.0014"],
    ),
    (
        SCENE,
        "head_mass_kg = 0.001409",
        "head_mass_kg = 1.4 g",
        &["`head_mass_kg`", "found 1.4 g", "write 0.0014 without a unit"],
    ),
    (
        SCENE,
        "head_mass_kg = 0.001409",
        "head_mass_kg = \"1.4g\"",
        &["`blade.head_mass_kg`", "\"1.4g\"", "write 0.0014 without a unit"],
    ),
    (
        SCENE,
        "head_mass_kg = 0.001409",
        "head_mass_kg = 0.0014 kg",
        &["`head_mass_kg`", "found 0.0014 kg", "write 0.0014 without a unit"],
    ),
    (
        SCENE,
        "head_mass_kg = 0.001409",
        "head_mass_kg = -0.0014",
        &["`blade.head_mass_kg`", "found -0.0014", "a number of 0 or more", "correct the value"],
    ),
    (
        SCENE,
        "head_mass_kg = 0.001409",
        "head_mass_kg = nan",
        &["`blade.head_mass_kg`", "found nan", "a number of 0 or more"],
    ),
    (SCENE, "head_mass_kg = 0.001409", "head_mass_kg =", &["`head_mass_kg`", "found nothing after `=`"]),
    (
        SCENE,
        "head_mass_kg = 0.001409",
        "head_mass_kg 0.0014",
        &["found `head_mass_kg 0.0014`", "expected `key = value`"],
    ),
    (
        SCENE,
        "head_mass_kg = 0.001409",
        "head_mass_kg: 0.0014",
        &["found `head_mass_kg: 0.0014`", "expected `key = value`"],
    ),
    (
        SCENE,
        "lip_length_m = 0.001623",
        "lip_length_m = 1.6mm",
        &["`lip_length_m`", "found 1.6mm", "write 0.0016 without a unit"],
    ),
    (
        SCENE,
        "lip_length_m = 0.001623",
        "lip_length_m = 0",
        &["`blade.lip_length_m`", "found 0", "a number above 0"],
    ),
    (
        SCENE,
        "sample_rate_hz = 10000.0",
        "sample_rate_hz = 10kHz",
        &["`sample_rate_hz`", "found 10kHz", "write 10000.0 without a unit"],
    ),
    (
        SCENE,
        "sample_rate_hz = 10000.0",
        "sample_rate_hz = \"10 kHz\"",
        &["`run.sample_rate_hz`", "\"10 kHz\"", "write 10000.0 without a unit"],
    ),
    (
        SCENE,
        "contact_angle_rad = 0.0981",
        "contact_angle_rad = \"5.6 deg\"",
        &["`shoulder.contact_angle_rad`", "write 0.0977384 without a unit"],
    ),
    (
        SCENE,
        "contact_angle_rad = 0.0981",
        "contact_angle_rad = 5.6",
        &["`shoulder.contact_angle_rad`", "found 5.6", "from 0 to 1.57"],
    ),
    (
        SCENE,
        "head_damping_ratio = 0.176",
        "head_damping_ratio = [0, 176]",
        &["`blade.head_damping_ratio`", "a list of 2", "a number", "point, no comma"],
    ),
    // keys and tables
    (
        SCENE,
        "lip_length_m = 0.001623",
        "lip_length_mm = 1.623",
        &["unknown key `blade.lip_length_mm`", "did you mean `lip_length_m`?"],
    ),
    (
        SCENE,
        "lip_length_m = 0.001623",
        "",
        &["`blade.lip_length_m`", "found nothing", "expected a number", "length of the lip, m"],
    ),
    (SCENE, "\na = 0.108", "\nA = 0.108", &["unknown key `friction.A`", "did you mean `a`?"]),
    (SCENE, "[friction]", "[Friction]", &["unknown key `Friction`", "did you mean `friction`?"]),
    (
        SCENE,
        "head_mass_kg = 0.001409",
        "head_mass_kg = 1.0\nhead_mass_kg = 2.0",
        &["`head_mass_kg`", "a second time", "remove one"],
    ),
    (SCENE, "[run]", "", &["`run`: found nothing", "unknown key `start.stop_s`"]),
    (SCENE, "format = 1", "", &["`format`: found nothing", "Version of the format: 1"]),
    (SCENE, "format = 1", "format = 2", &["`format`", "found 2", "expected 1"]),
    (SCENE, "format = 1", "format = \"1\"", &["`format`", "the text \"1\"", "write 1 without quotes"]),
    // words and texts
    (SCENE, "title = \"My blade\"", "title = My blade", &["`title`", "found My blade", "write \"My blade\""]),
    (SCENE, "title = \"My blade\"", "title = 5", &["`title`", "found 5", "a text in quotes"]),
    (SCENE, "kind = \"upright\"", "kind = upright", &["`kind`", "write \"upright\""]),
    (
        SCENE,
        "kind = \"upright\"",
        "kind = \"steady slide\"",
        &["`start.kind`", "\"steady slide\"", "\"relaxed\", \"steady-slide\", \"state\""],
    ),
    (
        SCENE,
        "outputs = [\"trace\", \"events\"]",
        "outputs = \"trace\"",
        &["`run.outputs`", "the text \"trace\"", "a list", "write [\"trace\"]"],
    ),
    (
        SCENE,
        "outputs = [\"trace\", \"events\"]",
        "outputs = [\"trace\", \"event\"]",
        &["`run.outputs[2]`", "\"event\"", "\"trace\", \"state\", \"events\""],
    ),
    (
        SCENE,
        "recording = \"../../data/twin\"",
        "recording = \"C:\\data\\film\"",
        &["`recording`", "a backslash between double quotes", "with `/`"],
    ),
    (
        SCENE,
        "recording = \"../../data/twin\"",
        "recording = \"C:\\temp\\film\"",
        &["`drive.recording`", "there is no", "a backslash between double quotes"],
    ),
    (
        SCENE,
        "recording = \"../../data/twin\"",
        "recording = \"../../data/twni\"",
        &["`drive.recording`", "../../data/twni", "relative to that file"],
    ),
    // jobs
    (
        JOB,
        "path = \"../../data/twin\"",
        "path = \"nowhere\"",
        &["job.toml", "`recording.path`", "found \"nowhere\"", "relative to that file"],
    ),
    (
        JOB,
        "scene = \"scene.toml\"",
        "scene = \"scene\"",
        &["job.toml", "`scene`", "found \"scene\"", "relative to that file"],
    ),
    (JOB, "seed = 1", "seed = -1", &["`seed`", "found -1", "a whole number of 0 or more"]),
    (
        JOB,
        "lower = 60.0",
        "lower = 60.0\nuper = 6.0",
        &["unknown key `parameter[1].uper`", "did you mean `upper`?"],
    ),
    (JOB, "name = \"friction.a\"", "name = \"friction.A\"", &["`friction.A`", "did you mean `friction.a`?"]),
    (
        JOB,
        "scale = \"log\"",
        "scale = \"logarithmic\"",
        &["`parameter[1].scale`", "\"logarithmic\"", "\"log\", \"linear\""],
    ),
    (
        JOB,
        "channels = [\"tip-x\", \"head-drop\"]",
        "channels = [\"tip_x\"]",
        &["`channels`", "\"tip_x\"", "did you mean `tip-x`?"],
    ),
    (JOB, "[[trace]]", "[trace]", &["`trace`", "found a table", "write `[[trace]]`"]),
    (JOB, "[[parameter]]", "[parameter]", &["table `parameter`", "a second time", "`[[parameter]]`"]),
    (
        JOB,
        "{ name = \"blade.head_mass_kg\", sd = \"5 %\" }",
        "{ name = \"blade.head_mass_kg\", sd = 5 }",
        &["`nuisance[1].sd`", "found 5", "double quotes"],
    ),
    // twins
    (
        TWIN,
        "frame_rate_hz = 5000.0",
        "frame_rate_hz = 5000 fps",
        &["`frame_rate_hz`", "found 5000 fps", "write 5000.0 without a unit"],
    ),
];

fn project() -> Project {
    let project = Project::of("twin");
    let (code, _, err) = project.run(&["init", "data/twin", "--out", "fits/film"]);
    assert_eq!((code, err.as_str()), (0, ""));
    project.write(TWIN, include_str!("../../data/twins/actual-blade.toml"));
    project
}

/// What the program says of a file.
fn said(project: &Project, file: &str) -> String {
    let arguments: &[&str] = match file {
        SCENE => &["modes", SCENE],
        JOB => &["fit", JOB],
        _ => &["twin", TWIN, "--out", "out"],
    };
    let (code, _, err) = project.run(arguments);
    assert_eq!(code, 2, "{file}: {err}");
    err
}

#[test]
fn every_mistake_is_named_with_what_to_do() {
    let project = project();
    for (file, old, new, expected) in MISTAKES {
        let text = project.read(file);
        assert!(text.contains(old), "{file} has no {old}");
        project.write(file, &text.replacen(old, new, 1));
        let said = said(&project, file);
        project.write(file, &text);
        assert!(expected.iter().all(|words| said.contains(words)), "{new}\n{said}{expected:?}");
        let jargon = ["f64", "u64", "variant", "missing field", "invalid type", "sequence", "Option"];
        assert!(!jargon.iter().any(|word| said.contains(word)), "{new}\n{said}");
        assert!(said.starts_with("error: ") && said.contains(".toml"), "{said}");
    }
    assert!(!project.path("fits/film/journal.jsonl").exists() && !project.path("out").exists());
}

#[test]
fn several_mistakes_of_a_file_are_named_at_once() {
    let project = project();
    let text = project.read(SCENE);
    let text = text.replace("head_mass_kg = 0.001409", "head_mas_kg = 0.001409");
    let text = text.replace("lip_length_m = 0.001623", "lip_length_m = \"1,6\"");
    let text = text.replace("preload_force_n = 0.126", "preload_force_n = -0.126");
    let text = text.replace("kind = \"upright\"", "kind = \"slide\"");
    project.write(SCENE, &text.replace("stop_s", "stop"));
    let said = said(&project, SCENE);
    let expected = [
        "unknown key `blade.head_mas_kg`; did you mean `head_mass_kg`?",
        "`blade.lip_length_m`: found the text \"1,6\"",
        "`blade.preload_force_n`: found -0.126",
        "`start.kind`: found the text \"slide\"",
        "unknown key `run.stop`; did you mean `stop_s`?",
    ];
    assert_eq!(said.lines().count(), expected.len(), "{said}");
    assert!(expected.iter().all(|words| said.contains(words)), "{said}");
}

/// What is quoted of a file breaks no line and steers no terminal.
#[test]
fn what_a_file_says_stays_on_its_line() {
    let project = project();
    let text =
        project.read(SCENE).replace("title = \"My blade\"", "title = \"t\"\n\"a\\nerror: b\\u001b[31m\" = 1");
    let text = text.replace("kind = \"upright\"", "kind = \"x\\ny\\u0007\"");
    project.write(SCENE, &text);
    let said = said(&project, SCENE);
    assert_eq!(said.lines().count(), 2, "{said}");
    assert!(!said.contains('\u{1b}') && !said.contains('\u{7}'), "{said}");
}
