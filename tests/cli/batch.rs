//! A list of fits, whole or divided.

use crate::small_fit::Project;
use crate::traces::{JOB, project};

const NAMES: [&str; 3] = ["fits/a/job.toml", "fits/b/job.toml", "fits/c/job.toml"];

/// Three jobs that differ in their seed.
fn three() -> Project {
    let project = project();
    for (name, seed) in NAMES.iter().zip(["3", "4", "5"]) {
        project.write(name, &JOB.replace("seed = 3", &format!("seed = {seed}")));
    }
    project
}

fn with<'a>(words: &[&'a str], more: &[&'a str]) -> Vec<&'a str> {
    [words, &NAMES, more].concat()
}

fn result(project: &Project, job: &str) -> String {
    project.read(&job.replace("job.toml", "result.json"))
}

#[test]
fn a_divided_list_of_fits_gives_what_each_gives_alone() {
    let project = three();
    let (code, _, err) = project.run(&with(&["fit"], &["--shard", "0/2"]));
    assert_eq!(code, 0, "{err}");
    let (code, said, _) = project.run(&with(&["collect"], &["--shards", "2"]));
    assert_eq!(code, 3);
    assert!(said.contains("fits/a/job.toml: converged\nfits/b/job.toml: no result"), "{said}");
    assert!(said.contains("missing: 1 of 3 jobs, in 1 of 2 tasks\ntasks: 1\n"), "{said}");
    let (code, _, err) = project.run(&with(&["fit"], &["--shard", "0/1"]));
    assert_eq!(code, 0, "{err}");
    let (code, said, _) = project.run(&with(&["fit"], &["--shard", "0/1"]));
    assert!(code == 0 && said.matches("its result is there already").count() == 3, "{said}");
    assert_eq!(project.run(&with(&["collect"], &[])).0, 0);
    let divided = NAMES.map(|name| result(&project, name));
    assert_eq!(project.run(&["fit", NAMES[1], "--quiet"]).0, 0);
    assert_eq!(result(&project, NAMES[1]), divided[1]);
    assert_ne!(divided[0], divided[1]);
}

#[test]
fn one_job_is_not_divided_and_says_what_is() {
    let project = three();
    let (code, _, err) = project.run(&["fit", NAMES[0], "--shard", "0/2"]);
    assert!(code == 2 && err.contains("expected a list of jobs, as a fit takes seconds"), "{err}");
    assert!(err.contains("`wiperlab sweep STUDY --out DIR --shard K/N`"), "{err}");
    let (code, _, err) = project.run(&["collect", NAMES[0]]);
    assert!(code == 2 && err.contains("expected the folder of a study or a list of jobs"), "{err}");
    assert!(!project.path("fits/a/journal.jsonl").exists());
}

#[test]
fn one_job_that_is_refused_does_not_stop_the_others() {
    let project = three();
    project.write(NAMES[0], &JOB.replace("friction.c", "friction.x"));
    let (code, _, err) = project.run(&with(&["fit"], &["--shard", "0/1"]));
    assert!(code == 2 && err.contains("friction.x") && err.contains("not every job"), "{err}");
    assert!(project.path("fits/b/result.json").exists() && project.path("fits/c/result.json").exists());
    let (code, _, err) = project.run(&["fit", NAMES[1], "fits/b/../b/job.toml"]);
    assert!(code == 2 && err.contains("expected a folder for each job"), "{err}");
}
