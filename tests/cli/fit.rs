//! `wiperlab fit` and `wiperlab report` as a user runs them, with budgets of a few evaluations.

use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use crate::sealed::resealed;
use crate::small_fit::{JOB, Project};

impl Project {
    fn with(job: &str) -> Self {
        let project = Self::of("twin");
        project.write("fits/x/job.toml", job);
        project
    }

    fn fit(&self, more: &[&str]) -> (i32, String, String) {
        self.run(&[&["fit", "fits/x/job.toml"], more].concat())
    }

    fn result(&self) -> Value {
        serde_json::from_str(&self.read("fits/x/result.json")).unwrap()
    }

    fn journal(&self) -> String {
        self.read("fits/x/journal.jsonl")
    }

    /// A refusal ends with code 2, has every part in its message, and leaves the fit's folder as it was.
    fn refused(&self, arguments: &[&str], parts: &[&str]) {
        let before = files(&self.path("fits/x"));
        let (code, _, stderr) = self.run(arguments);
        assert_eq!(code, 2, "{stderr}");
        for part in parts {
            assert!(stderr.contains(part), "expected {part:?} in {stderr}");
        }
        assert_eq!(files(&self.path("fits/x")), before, "{stderr}");
        assert!(!self.path("reports").exists());
    }
}

/// Contents of a folder by file name; not of folders in it.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).filter(|path| path.is_file());
    entries
        .map(|path| (path.file_name().unwrap().to_str().unwrap().to_owned(), fs::read(&path).unwrap()))
        .collect()
}

fn keys(value: &Value) -> Vec<&str> {
    let mut keys: Vec<&str> = value.as_object().unwrap().keys().map(String::as_str).collect();
    keys.sort_unstable();
    keys
}

#[test]
fn a_fit_writes_its_result_with_every_key_and_a_journal_line_an_evaluation() {
    let project = Project::with(JOB);
    let (code, stdout, stderr) = project.fit(&[]);
    assert!(code == 0 || code == 3, "{stderr}");
    for part in [
        " evaluations of the model in ",
        "/s)",
        "low ",
        "friction.c",
        "verdict",
        "determined: ",
        "note: the recording is synthetic",
    ] {
        assert!(stdout.contains(part), "{part}: {stdout}");
    }
    assert!(stdout.ends_with("written to fits/x/result.json\n") && stdout.lines().count() <= 25, "{stdout}");
    let result = project.result();
    assert_eq!(result["status"], if code == 0 { "converged" } else { "budget-exhausted" });
    for key in ["parameters", "components", "features", "evaluations", "seed", "fingerprint", "version"] {
        assert!(!result[key].is_null(), "{key}");
    }
    assert_eq!(keys(&result["parameters"]), ["blade.neck_stiffness_n_m_per_rad", "friction.c"]);
    assert_eq!(
        keys(&result["parameters"]["friction.c"]),
        ["bootstrap_95", "estimate", "linear_95", "lower_95", "profile", "profile_95", "upper_95", "verdict"]
    );
    for key in ["name", "target_hz", "target_sd_hz", "model_hz", "relative_error", "pass"] {
        assert!(!result["components"][0][key].is_null(), "{key}");
    }
    assert_eq!(
        (&result["seed"], &result["version"], &result["synthetic"]),
        (&3.into(), &env!("CARGO_PKG_VERSION").into(), &true.into())
    );
    assert!(result["notes"].to_string().contains("the recording is synthetic"));
    // a header, then one line an evaluation
    let total = result["evaluations"]["total"].as_u64().unwrap() as usize;
    assert_eq!(project.journal().lines().count(), 1 + total);
    for stage in ["gate", "global", "local", "sensitivity"] {
        assert!(project.journal().contains(&format!("\"stage\":\"{stage}\"")), "{stage}");
    }
    let names = files(&project.path("fits/x")).into_keys().collect::<Vec<_>>().join(" ");
    let expected =
        ".wiperlab.json comparison.csv fitted-scene.toml job.toml journal.jsonl parameters.csv result.json";
    assert_eq!(names, expected);
}

#[test]
fn a_job_is_named_by_its_file_or_its_folder_from_any_folder() {
    let project = Project::with(JOB);
    project.drive_by_the_twin();
    let fitted = |folder: &str, job: &str| {
        let (code, _, said) = project.run_in(folder, &["fit", job, "--max-evaluations", "12", "--quiet"]);
        assert_eq!(code, 3, "{folder} {job}: {said}");
        let result = files(&project.path("fits/x"));
        fs::remove_dir_all(project.path("fits/x")).unwrap();
        project.write("fits/x/job.toml", JOB);
        result
    };
    let usual = fitted("", "fits/x/job.toml");
    let scene = String::from_utf8(usual["fitted-scene.toml"].clone()).unwrap();
    assert!(scene.contains("recording = \"../../data/twin\""), "{scene}");
    for (folder, job) in [("", "fits/x"), ("fits/x", "job.toml"), ("fits/x", "."), ("data", "../fits/x")] {
        assert!(fitted(folder, job) == usual, "{folder} {job}");
    }
    assert_eq!(project.run(&["fit", "fits/x", "--max-evaluations", "12"]).0, 3);
    for (at, (folder, fit)) in [("", "fits/x"), ("fits/x", "."), ("fits/x", "job.toml")].iter().enumerate() {
        let (code, _, said) = project.run_in(folder, &["report", fit, "--quiet"]);
        assert_eq!(code, 0, "{folder} {fit}: {said}");
        fs::rename(project.path("reports/x"), project.path(&format!("page{at}"))).unwrap();
    }
    let page = |at: usize| {
        project.read(&format!("page{at}/index.html")) + &project.read(&format!("page{at}/report.json"))
    };
    assert!(page(0) == page(1) && page(0) == page(2));
}

#[test]
fn what_cannot_be_written_is_refused_before_the_search() {
    let project = Project::with(JOB);
    for name in ["result.json", "comparison.csv", "fitted-scene.toml", "parameters.csv", ".wiperlab.json"] {
        fs::create_dir(project.path(&format!("fits/x/{name}"))).unwrap();
        project.refused(&["fit", "fits/x"], &[&format!("fits/x/{name}: is a folder, expected a file")]);
        fs::remove_dir(project.path(&format!("fits/x/{name}"))).unwrap();
    }
}

#[test]
fn a_resumed_fit_ends_like_one_that_was_never_stopped_on_any_number_of_threads() {
    let project = Project::with(JOB);
    project.fit(&["--threads", "1"]);
    let (result, journal) = (project.result(), project.journal());
    let end_of = |line: usize| journal.match_indices('\n').nth(line).unwrap().0 + 1;
    // cut after the header and four evaluations; within the sixth; within the header
    for (kept, torn) in [(end_of(4), false), (end_of(5) + 40, true), (20, false)] {
        fs::remove_file(project.path("fits/x/result.json")).unwrap();
        project.write("fits/x/journal.jsonl", &journal[..kept]);
        let (_, _, stderr) = project.fit(&["--resume", "--threads", "2"]);
        assert_eq!(stderr.contains("the last line is incomplete and was dropped"), torn, "{stderr}");
        assert_eq!(project.result(), result, "cut at byte {kept}");
        assert_eq!(project.journal(), journal, "cut at byte {kept}");
    }
}

#[test]
fn the_number_of_evaluations_is_limited_and_a_stopped_fit_goes_on_from_there() {
    let project = Project::with(JOB);
    let (code, _, stderr) = project.fit(&["--max-evaluations", "3", "--quiet"]);
    assert_eq!((code, stderr.as_str()), (3, ""));
    assert_eq!(project.journal().lines().count(), 4);
    assert_eq!(
        (&project.result()["status"], &project.result()["evaluations"]["total"]),
        (&"budget-exhausted".into(), &3.into())
    );
    let first = project.journal();
    project.fit(&["--max-evaluations", "5", "--resume"]);
    assert!(project.journal().starts_with(&first));
    assert_eq!(project.journal().lines().count(), 6);
    project.refused(
        &["fit", "fits/x/job.toml", "--max-evaluations", "0"],
        &["'0' for '--max-evaluations <N>'", "expected a whole number, 1 or more"],
    );
}

#[test]
fn fewer_features_than_parameters_are_said_on_standard_error_and_in_the_result() {
    let job = JOB.replace(
        "[[feature]]\nname = \"release\"\nkind = \"release-after-reversal\"\nsd_relative = 0.01\n",
        "",
    );
    let project = Project::with(&job);
    let (_, _, stderr) = project.fit(&[]);
    assert!(
        stderr
            .contains("warning: 1 informative feature for 2 parameters: they can fix at most 1 combination"),
        "{stderr}"
    );
    assert!(
        project.result()["notes"].to_string().contains("for 2 parameters: they fix"),
        "{}",
        project.result()["notes"]
    );
    assert_eq!(project.result()["rank"], 1);
}

#[test]
fn bad_jobs_are_refused_with_place_and_remedy_and_leave_journal_and_result() {
    let project = Project::with(JOB);
    project.fit(&["--max-evaluations", "2"]);
    let negative = "name = \"blade.head_mass_kg\"\nlower = -0.001";
    let cases: [(&str, &str, &[&str]); 13] = [
        ("lower = 0.27", "lower = 0.37", &["job.toml: parameter `friction.c`", "0.37", "0.33"]),
        (
            "friction.c",
            "friction.d",
            &["job.toml: parameter `friction.d`", "not a parameter of a scene; did you mean `friction."],
        ),
        ("seed = 3", "seeds = 3", &["job.toml:4:1: unknown key `seeds`; did you mean `seed`?"]),
        (
            "particles = 4",
            "particle = 4",
            &["job.toml:36:1: unknown key `search.particle`; did you mean `particles`?"],
        ),
        (
            "lower = 0.27",
            "lower = \"small\"",
            &["job.toml:11:9: key `parameter[1].lower`: found the text \"small\", expected a number"],
        ),
        (
            "name = \"friction.c\"\nlower = 0.27",
            negative,
            &["job.toml: bounds of `blade.head_mass_kg`", "-0.001", "expected"],
        ),
        (
            "scenes/actual-blade",
            "scenes/no-blade",
            &["job.toml: key `scene`: found \"../../data/scenes/no-blade.toml\""],
        ),
        (
            "path = \"../../data/twin\"",
            "path = \"../../data/none\"",
            &["key `recording.path`: found \"../../data/none\""],
        ),
        (
            "band_hz = [40.0, 140.0]",
            "band_hz = [140.0, 40.0]",
            &["component `low`, `band_hz`", "exchange or correct them"],
        ),
        ("release+0.2\"", "relase+0.2\"", &["component `low`, `window`", "expected"]),
        (
            "release+0.01..release+0.2\"",
            "release[2]..\"",
            &["job.toml: twin: `low` cannot be measured", "1 reversal", "choose another window"],
        ),
        ("head-drop", "head_drop", &["component `low`, `channel`", "did you mean `head-drop`?"]),
        ("format = 1", "format = 2", &["key `format`: found 2, expected 1"]),
    ];
    for (from, to, parts) in cases {
        assert!(JOB.contains(from), "{from}");
        project.write("fits/x/job.toml", &JOB.replacen(from, to, 1));
        project.refused(&["fit", "fits/x/job.toml"], parts);
    }
    project.refused(&["fit", "fits/y/job.toml"], &["fits/y/job.toml: no such file"]);
    // a recording given a target of its own needs none, a component without either does
    let targetless = JOB.replace(
        "[[recording]]\npath = \"../../data/twin\"\n",
        "[camera]\nframe_rate_hz = 5000.0\nexposure_s = 0.0\n",
    );
    project.write("fits/x/job.toml", &targetless);
    project.refused(
        &["fit", "fits/x/job.toml"],
        &["component `low`, `target_hz`: missing", "expected `target_hz` and `target_sd_hz`"],
    );
}

#[test]
fn a_journal_of_another_job_is_not_resumed_nor_touched() {
    let project = Project::with(JOB);
    project.fit(&["--max-evaluations", "2"]);
    project.write("fits/x/job.toml", &JOB.replace("upper = 0.33", "upper = 0.34"));
    project.refused(
        &["fit", "fits/x/job.toml", "--resume"],
        &["fits/x/journal.jsonl: fingerprint", "has changed since it was written", "move it away"],
    );
    project.refused(
        &["report", "fits/x"],
        &["fits/x/result.json: fingerprint", "have changed since the fit", "run `wiperlab fit` again"],
    );
    project.write("fits/x/job.toml", JOB);
    let damaged = project.journal().replacen("\"stage\":\"gate\"", "\"stage\":\"gat\"", 1);
    project.write("fits/x/journal.jsonl", &damaged);
    project.refused(
        &["fit", "fits/x/job.toml", "--resume"],
        &["journal.jsonl:2: the line has the checksum", "remove this line and all lines after it"],
    );
}

/// The job with another seed.
fn seeded(seed: u32) -> String {
    JOB.replace("seed = 3", &format!("seed = {seed}"))
}

#[test]
fn a_job_that_cannot_be_fitted_is_refused_and_leaves_the_journal_and_the_result_of_the_last_one() {
    let project = Project::with(JOB);
    project.fit(&["--max-evaluations", "30"]);
    // features that are known to a factor only, and parameters that may hardly move
    let (head, search) = (JOB.find("[[component]]").unwrap(), JOB.find("[search]").unwrap());
    let vague = "[[feature]]\nkind = \"release-after-reversal\"\nsd_relative = 0.9\n\n";
    let blind = JOB[..head]
        .replace("lower = 0.27", "lower = 0.299")
        .replace("upper = 0.33", "upper = 0.301")
        .replace("0.0021", "0.00171");
    project.write("fits/x/job.toml", &format!("{blind}{vague}{}", &JOB[search..]));
    project.refused(
        &["fit", "fits/x/job.toml"],
        &[
            "fits/x/job.toml: this job cannot be fitted: no parameter moves any feature",
            "choose other features",
        ],
    );
    // a head that shakes too fast for the tip to stay on the glass
    let lost = JOB.replace(
        "name = \"friction.c\"\nlower = 0.27\nupper = 0.33",
        "name = \"drive.frequency_hz\"\nlower = 30\nupper = 60",
    );
    project.write("fits/x/job.toml", &lost);
    project.refused(
        &["fit", "fits/x/job.toml"],
        &["the model fails at all 5 places", "contact-lost", "move the bounds to where the blade runs"],
    );
    // nor does one leave a journal where there was none
    let fresh = Project::with(&lost);
    fresh.refused(&["fit", "fits/x/job.toml"], &["cannot be fitted"]);
    assert_eq!(files(&fresh.path("fits/x")).len(), 1);
}

#[test]
fn a_journal_of_another_seed_is_refused_with_the_seed_and_resumed_with_it() {
    let project = Project::with(JOB);
    project.fit(&["--max-evaluations", "30"]);
    project.write("fits/x/job.toml", &seeded(4));
    project.refused(
        &["fit", "fits/x/job.toml", "--resume"],
        &["fits/x/journal.jsonl: written by a search with seed 3", "write `seed = 3` into the job"],
    );
    project.write("fits/x/job.toml", JOB);
    let other = project.journal().replacen(env!("CARGO_PKG_VERSION"), "0.0.0", 1);
    project.write("fits/x/journal.jsonl", &resealed(&other));
    project.refused(
        &["fit", "fits/x/job.toml", "--resume"],
        &["journal.jsonl: written by version 0.0.0", "resume with version 0.0.0"],
    );
}

#[test]
fn what_is_left_of_a_journal_is_resumed_and_what_is_no_journal_refused() {
    let project = Project::with(JOB);
    project.fit(&["--max-evaluations", "30"]);
    let (result, journal) = (project.result(), project.journal());
    let again = || project.fit(&["--max-evaluations", "30", "--resume"]).2;
    // zeros where the power failed; nothing; a torn header; line ends of another system
    for (left, said) in [
        (journal.clone() + "{\"index\":30,\0\0\0\0", "the last line is incomplete and was dropped"),
        (String::new(), "nothing to resume; starting over"),
        (journal[..40].to_owned(), "the old journal is kept as fits/x/journal.previous-1.jsonl"),
    ] {
        project.write("fits/x/journal.jsonl", &left);
        assert!(again().contains(said), "{said}");
        assert_eq!((project.result(), project.journal()), (result.clone(), journal.clone()), "{said}");
    }
    assert_eq!(project.read("fits/x/journal.previous-1.jsonl"), journal[..40], "nothing is erased");
    // line ends of other systems, a byte-order mark, and a last line without an end
    for (left, end) in [
        (journal.replace('\n', "\r\n"), "\r\n"),
        (journal.replace('\n', "\r"), "\r"),
        (format!("\u{feff}{journal}"), "\n"),
        (journal.trim_end().to_owned(), ""),
    ] {
        project.write("fits/x/journal.jsonl", &left);
        assert!(!again().contains("dropped"), "{end:?}");
        assert_eq!(project.result(), result, "{end:?}");
        let kept = if end.is_empty() { journal.clone() } else { left };
        assert_eq!(project.journal(), kept, "{end:?}");
    }
    fs::write(project.path("fits/x/journal.jsonl"), b"\xff\xfe{\0\n\0").unwrap();
    project.refused(
        &["fit", "fits/x/job.toml", "--resume"],
        &["journal.jsonl:1: no journal header", "move it away to start over"],
    );
    fs::remove_file(project.path("fits/x/journal.jsonl")).unwrap();
    fs::create_dir(project.path("fits/x/journal.jsonl")).unwrap();
    let (code, _, stderr) = project.fit(&[]);
    assert!(code == 2 && stderr.contains("journal.jsonl: cannot be read and written"), "{stderr}");
    #[cfg(unix)]
    {
        fs::remove_dir(project.path("fits/x/journal.jsonl")).unwrap();
        std::os::unix::fs::symlink("/dev/zero", project.path("fits/x/journal.jsonl")).unwrap();
        let (code, _, stderr) = project.fit(&["--resume"]);
        assert!(code == 2 && stderr.contains("journal.jsonl: found no regular file"), "{stderr}");
    }
}

#[test]
fn a_new_fit_keeps_the_journals_of_all_before_it() {
    let project = Project::with(JOB);
    project.fit(&["--max-evaluations", "30"]);
    let first = project.journal();
    for (evaluations, kept) in [("3", "journal.previous-1.jsonl"), ("4", "journal.previous-2.jsonl")] {
        let (_, _, stderr) = project.fit(&["--max-evaluations", evaluations, "--quiet"]);
        let said = format!("fits/x/journal.jsonl: the old journal is kept as fits/x/{kept}");
        assert!(stderr.contains(&said), "{stderr}");
    }
    assert_eq!(project.read("fits/x/journal.previous-1.jsonl"), first);
    assert_eq!(project.read("fits/x/journal.previous-2.jsonl").lines().count(), 4);
    // resumed fits set nothing aside
    project.fit(&["--max-evaluations", "5", "--resume"]);
    assert!(!project.path("fits/x/journal.previous-3.jsonl").exists());
    fs::rename(project.path("fits/x/journal.previous-1.jsonl"), project.path("fits/x/journal.jsonl"))
        .unwrap();
    project.fit(&["--max-evaluations", "30", "--resume"]);
    assert_eq!(project.journal(), first);
}

#[test]
fn two_fits_do_not_write_one_journal() {
    let project = Project::with(JOB);
    project.fit(&["--max-evaluations", "30"]);
    let held = fs::File::open(project.path("fits/x/journal.jsonl")).unwrap();
    held.lock().unwrap();
    project.refused(
        &["fit", "fits/x/job.toml", "--resume"],
        &["fits/x/journal.jsonl: another fit is writing this journal", "wait until it has ended"],
    );
    project.refused(&["fit", "fits/x/job.toml"], &["another fit is writing this journal"]);
    held.unlock().unwrap();
    assert_ne!(project.fit(&["--max-evaluations", "30", "--resume"]).0, 2);
}

#[test]
fn published_components_are_fitted_without_a_recording_and_the_page_says_so() {
    let job = JOB
        .replace(
            "[[recording]]\npath = \"../../data/twin\"\n",
            "[camera]\nframe_rate_hz = 5000.0\nexposure_s = 5e-5\n",
        )
        .replace(
            "band_hz = [40.0, 140.0]\n",
            "band_hz = [40.0, 140.0]\ntarget_hz = 74.8\ntarget_sd_hz = 0.5\n",
        )
        .replace("sd_relative = 0.01", "target = 0.0666\ntarget_sd = 0.001");
    let project = Project::with(&job);
    let (code, _, stderr) = project.fit(&["--max-evaluations", "12"]);
    assert_eq!(code, 3, "{stderr}");
    assert_eq!(project.result()["synthetic"], false);
    assert_eq!(project.result()["components"][0]["target_hz"], 74.8);
    let (code, _, stderr) = project.run(&["report", "fits/x"]);
    assert_eq!(code, 0, "{stderr}");
    let page = project.read("reports/x/index.html");
    assert!(page.contains("Only published values were fitted: there is no recording"), "{page}");
}
