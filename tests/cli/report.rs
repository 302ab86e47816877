//! `wiperlab report` as a user runs it: the page and JSON of a fit, several fits beside each other, what is
//! refused, what is cleared away.

use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use crate::sealed::resealed_result;
use crate::small_fit::{JOB, Project};

impl Project {
    /// A project with these fits, each made with three evaluations.
    fn with_fits(fits: &[(&str, &str)]) -> Self {
        let project = Self::of("twin");
        for (name, job) in fits {
            project.quick_fit(&format!("fits/{name}"), job);
        }
        project
    }

    fn quick_fit(&self, folder: &str, job: &str) {
        self.write(&format!("{folder}/job.toml"), job);
        let (code, _, stderr) =
            self.run(&["fit", &format!("{folder}/job.toml"), "--max-evaluations", "3", "--quiet"]);
        assert_eq!((code, stderr.as_str()), (3, ""), "{folder}");
    }

    /// The head of the recording `data/twin` drives the scene.
    pub fn drive_by_the_twin(&self) {
        let scene = self.read("data/scenes/actual-blade.toml");
        let (from, to) = (scene.find("[drive]").unwrap(), scene.find("[start]").unwrap());
        let driven = format!("{}[drive]\nrecording = \"../twin\"\n\n{}", &scene[..from], &scene[to..]);
        let driven = driven.replacen("time_s = ", "time_s = 0.0 # ", 1);
        self.write("data/scenes/actual-blade.toml", &driven.replacen("stop_s = ", "stop_s = 0.58 # ", 1));
    }

    fn json(&self, folder: &str) -> Value {
        serde_json::from_str(&self.read(&format!("{folder}/report.json"))).unwrap()
    }

    /// A report that is made; gives what it prints.
    fn reported(&self, arguments: &[&str]) -> String {
        let (code, stdout, stderr) = self.run(&[&["report"], arguments].concat());
        assert_eq!(code, 0, "{stderr}");
        stdout
    }

    /// A refusal ends with code 2, has every part in its message, and writes nothing.
    fn report_refused(&self, arguments: &[&str], parts: &[&str]) {
        let before = tree(self.folder.path());
        let (code, _, stderr) = self.run(&[&["report"], arguments].concat());
        assert_eq!(code, 2, "{stderr}");
        for part in parts {
            assert!(stderr.contains(part), "expected {part:?} in {stderr}");
        }
        assert_eq!(tree(self.folder.path()), before);
    }
}

/// Every file below a folder.
fn tree(folder: &Path) -> BTreeSet<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.flat_map(|path| if path.is_dir() { tree(&path) } else { BTreeSet::from([path]) }).collect()
}

/// Text of an element's first occurrence.
fn between<'a>(html: &'a str, from: &str, to: &str) -> &'a str {
    let start = html.find(from).unwrap_or_else(|| panic!("{from}")) + from.len();
    &html[start..start + html[start..].find(to).unwrap()]
}

#[test]
fn page_and_json_give_the_same_verdict_and_the_origin_of_every_number() {
    let project = Project::with_fits(&[("x", JOB)]);
    let stdout = project.reported(&["fits/x"]);
    let (json, page) = (project.json("reports/x"), project.read("reports/x/index.html"));
    assert_eq!(
        (&json["format"], &json["synthetic"], &json["published_only"]),
        (&1.into(), &true.into(), &false.into())
    );
    assert_eq!(
        (&json["all_components_met"], &json["search_converged"]),
        (&json["components"][0]["pass"], &false.into())
    );
    let verdict = between(&page, "class=\"verdict\"", "</div>");
    for line in json["summary"].as_array().unwrap() {
        assert!(stdout.contains(line.as_str().unwrap()), "{line} is printed");
    }
    for statement in json["statements"].as_array().unwrap() {
        let text = html_escape::encode_safe(statement["statement"].as_str().unwrap()).into_owned();
        assert!(verdict.contains(&text), "{text} stands on the page");
    }
    // all three intervals, the truth, every finding, the hard events
    for part in [
        "profile likelihood",
        "linear model",
        "twins fitted again",
        "truth (synthetic)",
        "implied-rate",
        "loss of contact",
        "least normal force",
    ] {
        assert!(page.contains(part), "{part}");
    }
    assert!(
        json["runs"][0]["least_normal_force_n"].as_f64().unwrap() > 0.0
            && json["runs"][0]["transitions"].as_u64().unwrap() > 100
    );
    let files: Vec<(&str, &str)> = json["provenance"]["files"]
        .as_array()
        .unwrap()
        .iter()
        .map(|f| (f["kind"].as_str().unwrap(), f["name"].as_str().unwrap()))
        .collect();
    let expected = [
        ("job", "fits/x/job.toml"),
        ("result", "fits/x/result.json"),
        ("scene", "data/scenes/actual-blade.toml"),
        ("trace", "data/twin/trace.csv"),
        ("description", "data/twin/recording.toml"),
        ("export", "data/twin/synthetic-tracker-export.txt"),
    ];
    assert_eq!(files, expected);
    for (kind, name) in expected.iter().filter(|(kind, _)| *kind != "export") {
        let bytes = fs::read(project.path(name)).unwrap();
        let hash = wiperlab::text::sha256(&bytes);
        assert!(page.contains(&hash) && project.read("reports/x/report.json").contains(&hash), "{kind}");
    }
}

#[test]
fn a_report_is_made_again_byte_for_byte_and_every_file_says_that_the_recording_is_synthetic() {
    let project = Project::with_fits(&[("x", JOB)]);
    assert!(project.reported(&["fits/x"]).contains("reports/x/index.html"));
    assert_eq!(project.reported(&["fits/x", "--quiet", "--out", "deep/er/page"]), "");
    let files = tree(&project.path("reports/x"));
    for name in [
        "index.html",
        "report.json",
        "history.svg",
        "paper/history-85mm.svg",
        "paper/history-170mm.svg",
        "spectrum.svg",
    ] {
        assert!(files.contains(&project.path("reports/x").join(name)), "no {name} among {files:?}");
    }
    for path in files {
        let name = path.strip_prefix(project.path("reports/x")).unwrap().display().to_string();
        let text = fs::read_to_string(&path).unwrap();
        assert!(
            name == ".wiperlab.json" || text.to_lowercase().contains("synthetic"),
            "{name} does not say that the recording is synthetic"
        );
        assert_eq!(text, project.read(&format!("deep/er/page/{name}")), "{name}");
    }
    assert_eq!(tree(&project.path("deep/er/page")).len(), tree(&project.path("reports/x")).len());
}

#[test]
fn a_recording_that_drives_the_scene_is_among_the_files() {
    let project = Project::with_fits(&[]);
    project.drive_by_the_twin();
    project.quick_fit("fits/x", JOB);
    project.reported(&["fits/x"]);
    let files = project.json("reports/x")["provenance"]["files"].clone();
    let drive = files
        .as_array()
        .unwrap()
        .iter()
        .find(|f| f["kind"] == "drive trace")
        .unwrap_or_else(|| panic!("{files}"));
    assert_eq!(
        (&drive["name"], &drive["synthetic"], &drive["sha256"]),
        (
            &"data/twin/trace.csv".into(),
            &true.into(),
            &wiperlab::text::sha256(project.read("data/twin/trace.csv").as_bytes()).into()
        )
    );
}

#[test]
fn a_component_that_is_missed_is_said_by_check_in_any_of_the_fits() {
    let strict = JOB.replace("tolerance_relative = 0.5", "tolerance_relative = 1e-9");
    let project = Project::with_fits(&[("good", JOB), ("strict", &strict)]);
    let check = |fits: &[&str]| project.run(&[&["report", "--check", "--quiet"], fits].concat()).0;
    assert_eq!(
        [check(&["fits/good"]), check(&["fits/strict"]), check(&["fits/good", "fits/strict"])],
        [0, 3, 3]
    );
    let verdicts = ["good", "strict", "good-and-strict"]
        .map(|name| project.json(&format!("reports/{name}"))["all_components_met"].clone());
    assert_eq!(verdicts, [Value::from(true), false.into(), false.into()]);
}

#[test]
fn several_fits_are_compared_on_one_page_that_is_made_again_byte_for_byte() {
    let narrow = JOB.replace("upper = 0.33", "upper = 0.31").replace("A small fit", "Another fit");
    let project = Project::with_fits(&[("a", JOB), ("b", &narrow)]);
    let stdout = project.reported(&["fits/a", "fits/b"]);
    assert!(
        stdout.contains("reports/a-and-b/index.html")
            && stdout.contains("of 2 fits explain what they were fitted to"),
        "{stdout}"
    );
    let found: Vec<String> = tree(&project.path("reports/a-and-b"))
        .iter()
        .map(|p| p.strip_prefix(project.path("reports/a-and-b")).unwrap().display().to_string())
        .collect();
    let figures = |name: &str| {
        [format!("{name}.svg"), format!("paper/{name}-170mm.svg"), format!("paper/{name}-85mm.svg")]
    };
    let mut expected =
        [&figures("parameters")[..], &[".wiperlab.json", "index.html", "report.json"].map(str::to_owned)]
            .concat();
    expected.sort();
    assert_eq!(found, expected);
    let (page, json) = (project.read("reports/a-and-b/index.html"), project.json("reports/a-and-b"));
    assert!(
        page.contains("<bdi>a</bdi>")
            && page.contains("<bdi>b</bdi>")
            && page.contains("Synthetic data: no camera took")
    );
    assert!(
        !page.contains("http://www.w3.org/1999") && !page.contains("href=\"../") && !page.contains("src=")
    );
    assert_eq!((&json["fits"][0]["name"], &json["fits"][1]["title"]), (&"a".into(), &"Another fit".into()));
    assert_eq!(
        (json["parameters"].as_array().unwrap().len(), &json["parameters"][0]["pairs"][0]["fits"]),
        (2, &serde_json::json!(["a", "b"]))
    );
    project.reported(&["fits/a", "fits/b", "--out", "again", "--quiet"]);
    for name in expected {
        assert_eq!(
            project.read(&format!("again/{name}")),
            project.read(&format!("reports/a-and-b/{name}")),
            "{name}"
        );
    }
}

#[test]
fn fits_that_cannot_be_compared_are_refused_and_nothing_is_written() {
    let project = Project::with_fits(&[("a", JOB)]);
    project.quick_fit("other/a", JOB);
    project.write("fits/new/job.toml", JOB);
    project.quick_fit("fits/stale", JOB);
    project.write("fits/stale/job.toml", &JOB.replace("upper = 0.33", "upper = 0.34"));
    project.report_refused(&["fits/a", "fits/../fits/a"], &["fits/../fits/a: given twice", "leave one out"]);
    project.report_refused(
        &["fits/a", "other/a"],
        &["other/a: called `a` like fits/a", "rename one of the folders"],
    );
    project.report_refused(
        &["fits/new"],
        &["fits/new/result.json: no such file; run `wiperlab fit fits/new/job.toml` first"],
    );
    project.report_refused(
        &["fits/a", "fits/new"],
        &["fits/new/result.json: no such file; run `wiperlab fit fits/new/job.toml` first"],
    );
    project.report_refused(
        &["fits/a", "fits/stale"],
        &["fits/stale/result.json: fingerprint", "run `wiperlab fit` again"],
    );
    project.report_refused(&["fits/a", "fits/none"], &["fits/none: no such file"]);
    project.report_refused(&["fits/a", "fits"], &["fits/job.toml: no such file"]);
    project.report_refused(&["fits/a", "fits/a/job.toml"], &["fits/a: given twice"]);
    let long = "n".repeat(98);
    fs::rename(project.path("other/a"), project.path(&format!("fits/{long}"))).unwrap();
    project.report_refused(
        &["fits/a", &format!("fits/{long}")],
        &["a folder name of 104 bytes, expected at most 100", "--out DIR"],
    );
    project.reported(&["fits/a", &format!("fits/{long}"), "--out", "short"]);
}

#[test]
fn a_result_that_was_edited_and_a_folder_that_is_taken_are_refused_and_nothing_is_written() {
    let project = Project::with_fits(&[("x", JOB)]);
    let result = project.read("fits/x/result.json");
    let edited = result.replacen("\"friction.c\": {", "\"friction.x\": {", 1);
    project.write("fits/x/result.json", &edited);
    project.report_refused(
        &["fits/x"],
        &["fits/x/result.json: ", "the file was changed after the fit wrote it"],
    );
    project.write("fits/x/result.json", &resealed_result(&edited));
    project.report_refused(
        &["fits/x"],
        &["fits/x/result.json: ", "found no `friction.c`, which the job has", "run `wiperlab fit` again"],
    );
    project.write("fits/x/result.json", &result[..result.len() / 2]);
    project.report_refused(
        &["fits/x"],
        &["fits/x/result.json: not the result of a fit: EOF", " at line ", "run `wiperlab fit` again"],
    );
    project.write("fits/x/result.json", &result);
    fs::create_dir_all(project.path("taken/report.json")).unwrap();
    project.report_refused(
        &["fits/x", "--out", "taken"],
        &["taken/report.json: is a folder, expected a file or nothing; remove it or choose another folder"],
    );
    assert!(!project.path("taken/paper").exists());
}

#[test]
fn figures_of_an_earlier_report_go_and_nothing_else_does() {
    // a fit to a published frequency has no recording, and so no evidence
    let recorded = "[[recording]]\npath = \"../../data/twin\"\n";
    let release = JOB.find("[[feature]]").unwrap()..JOB.find("[search]").unwrap();
    let published = JOB
        .replace(&JOB[release], "")
        .replace(recorded, "[camera]\nframe_rate_hz = 5000.0\nexposure_s = 5e-5\n")
        .replace(
            "tolerance_relative = 0.5",
            "target_hz = 74.8\ntarget_sd_hz = 0.4\ntolerance_relative = 0.5",
        );
    let project = Project::with_fits(&[("x", JOB), ("y", &published)]);
    project.reported(&["fits/x", "--out", "page"]);
    let gone = "page/evidence.svg";
    let paper = ["page/paper/evidence-85mm.svg", "page/paper/evidence-170mm.svg"];
    assert!(project.path(gone).is_file() && paper.iter().all(|name| project.path(name).is_file()));
    let kept = ["page/mine.svg", "page/notes.txt", "page/paper/mine-85mm.svg", "page/deep/inner.svg"];
    for name in kept {
        project.write(name, "x");
    }
    project.write(paper[1], "somebody's own");
    project.reported(&["fits/y", "--out", "page"]);
    for name in kept.iter().chain(&paper[1..]) {
        assert!(project.path(name).is_file(), "{name}");
    }
    for name in [gone, paper[0]] {
        assert!(!project.path(name).exists(), "{name}");
    }
}

#[test]
fn where_one_file_has_no_place_none_is_written() {
    let project = Project::with_fits(&[("x", JOB)]);
    fs::create_dir_all(project.path("reports/x/friction.svg")).unwrap();
    project.report_refused(
        &["fits/x"],
        &["friction.svg", "is a folder, expected a file or nothing", "choose another folder"],
    );
    fs::remove_dir(project.path("reports/x/friction.svg")).unwrap();
    project.reported(&["fits/x"]);
}

#[test]
fn a_name_longer_than_a_file_system_takes_makes_shorter_files_and_headings() {
    let long = "a component as long as nobody reads ".repeat(9);
    let job = JOB
        .replace("name = \"low\"", &format!("name = \"{long}\""))
        .replace("path = ", &format!("name = \"{long}\"\npath = "));
    let project = Project::with_fits(&[("x", &job)]);
    project.reported(&["fits/x"]);
    let name = tree(&project.path("reports/x/paper"))
        .iter()
        .filter_map(|path| Some(path.file_name()?.len()))
        .max()
        .unwrap();
    assert!(name < 100, "{name} letters");
    assert!(project.read("reports/x/index.html").contains(long.trim_end()), "the page has the whole name");
}
