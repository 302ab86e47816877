//! One fit in shards: as one machine makes it, whatever is killed, done twice, divided anew or torn.

use crate::sealed::resealed;
use crate::small_fit::Project;
use crate::traces::{JOB, project};
use std::fs;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

const NAME: &str = "fits/small/job.toml";
const RESULT: &str = "fits/small/result.json";
const JOURNAL: &str = "fits/small/journal.jsonl";
const SHARDS: &str = "fits/small/shards";

/// What one machine writes: result and journal. The fit has twins.
fn whole(project: &Project) -> [String; 2] {
    project.write(NAME, &format!("{JOB}\n[intervals]\nbootstrap = 12\n"));
    let (code, _, err) = project.run(&["fit", NAME]);
    assert_eq!((code, err.as_str()), (0, ""));
    let written = [RESULT, JOURNAL].map(|name| project.read(name));
    [RESULT, JOURNAL].iter().for_each(|name| fs::remove_file(project.path(name)).unwrap());
    written
}

fn shard(project: &Project, shard: &str) -> (i32, String, String) {
    project.run(&["fit", NAME, "--shard", shard])
}

fn collect(project: &Project, more: &[&str]) -> (i32, String, String) {
    project.run(&[&["collect", NAME], more].concat())
}

fn started(project: &Project, shard: &str) -> Child {
    Command::new(env!("CARGO_BIN_EXE_wiperlab"))
        .args(["fit", NAME, "--shard", shard])
        .current_dir(project.path(""))
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

#[test]
fn shards_of_a_fit_give_what_one_machine_gives_also_when_their_number_changes() {
    let project = project();
    let expected = whole(&project);
    for of in ["0/3", "2/3"] {
        let (code, said, err) = shard(&project, of);
        assert_eq!((code, err.as_str()), (0, ""));
        assert!(
            said.contains("its chains are done") && said.contains("wiperlab collect fits/small/job.toml")
        );
    }
    let (code, said, _) = collect(&project, &[]);
    assert_eq!(code, 3);
    // 5 chains of intervals and 12 twins, the numbers of which have the remainder 1
    assert!(said.starts_with("missing: 6 chains behind the search, in 1 of 3 tasks\ntasks: 1\n"), "{said}");
    assert!(!project.path(RESULT).exists() && !project.path(JOURNAL).exists());
    let (_, said, _) = collect(&project, &["--shards", "12"]);
    assert!(said.contains("in 4 of 12 tasks\ntasks: 1,4,7,10\n"), "{said}");
    for of in ["0/2", "1/2", "0/3"] {
        let before = fs::read_to_string(project.path("fits/small/shards/0-of-3.jsonl")).unwrap();
        assert_eq!(shard(&project, of).0, 0);
        if of == "0/3" {
            assert_eq!(project.read("fits/small/shards/0-of-3.jsonl"), before, "nothing is done twice");
        }
    }
    let (code, said, err) = collect(&project, &[]);
    assert_eq!((code, err.as_str()), (0, ""), "{said}");
    assert_eq!([RESULT, JOURNAL].map(|name| project.read(name)), expected);
    assert_eq!(collect(&project, &[]).0, 0);
    assert_eq!(
        [RESULT, JOURNAL].map(|name| project.read(name)),
        expected,
        "collecting again changes nothing"
    );
    project.write(NAME, &project.read(NAME).replace("bootstrap = 12", "bootstrap = 14"));
    let (code, said, _) = collect(&project, &[]);
    assert!(
        code == 3 && said.contains("missing: 2 chains behind the search"),
        "more twins are missing: {said}"
    );
    assert_eq!((shard(&project, "0/1").0, collect(&project, &[]).0), (0, 0));
    assert!(project.read(RESULT).contains("\"twins\": 14"));
}

#[test]
fn two_shards_at_once_and_a_killed_one_go_on() {
    let project = project();
    let expected = whole(&project);
    let mut both = ["0/2", "1/2"].map(|of| started(&project, of));
    let journal = project.path(SHARDS).join("0-of-2.jsonl");
    while !fs::read_to_string(&journal).is_ok_and(|text| text.lines().count() > 3) {
        assert!(both[0].try_wait().unwrap().is_none(), "too fast to be killed");
        std::thread::sleep(Duration::from_millis(2));
    }
    both[0].kill().unwrap();
    both.iter_mut().for_each(|child| {
        child.wait().unwrap();
    });
    let text = fs::read_to_string(&journal).unwrap();
    fs::write(&journal, &text[..text.len() - 7]).unwrap();
    let (code, _, err) = shard(&project, "0/2");
    assert!(code == 0 && err.contains("the last line is incomplete and was dropped"), "{err}");
    let both = [(); 2].map(|()| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_wiperlab"));
        command.args(["collect", NAME]).current_dir(project.path("")).stdin(Stdio::null());
        command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
    });
    let codes = both.map(|mut child| child.wait().unwrap().code().unwrap());
    assert!(codes.contains(&0), "two may collect at once: {codes:?}");
    assert_eq!(collect(&project, &[]).0, 0);
    assert_eq!([RESULT, JOURNAL].map(|name| project.read(name)), expected);
}

#[test]
fn shards_that_disagree_or_are_of_another_fit_are_refused() {
    let project = project();
    whole(&project);
    assert_eq!(shard(&project, "0/1").0, 0);
    let one = project.read("fits/small/shards/0-of-1.jsonl");
    let line = one.lines().nth(20).unwrap();
    let at = line.find("\"cost\":\"").unwrap() + 8;
    let mut other = line.to_owned();
    other.replace_range(at..=at, if line.as_bytes()[at] == b'9' { "8" } else { "9" });
    let changed = one.replace(line, resealed(&other).trim_end());
    project.write("fits/small/shards/0-of-2.jsonl", &changed);
    let (code, _, err) = collect(&project, &[]);
    assert_eq!(code, 2);
    for part in ["0-of-1.jsonl:21", "0-of-2.jsonl:21", "cost"] {
        assert!(err.contains(part), "{part}: {err}");
    }
    fs::remove_file(project.path("fits/small/shards/0-of-1.jsonl")).unwrap();
    let job = project.read(NAME).replace("upper = 0.33", "upper = 0.34");
    project.write(NAME, &job);
    for (code, _, err) in [collect(&project, &[]), shard(&project, "1/2")] {
        assert!(code == 2 && err.contains("0-of-2.jsonl"), "{err}");
    }
    let (code, _, err) = project.run(&["fit", NAME, "--shard", "0/2", "--max-evaluations", "9"]);
    assert!(code == 2 && err.contains("--max-evaluations") && err.contains("--time-limit"), "{err}");
}
