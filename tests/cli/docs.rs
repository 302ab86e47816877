//! What the pages say can be run, in the order of each page, in a copy of the committed data.
//!
//! A command that is not run as it stands is listed with its reason.
#![cfg(unix)]

use crate::page::{blocks, code, commands};
use crate::project::Project;
use crate::small_fit;
use crate::submit;
use crate::thorough::is_thorough;
use crate::traces;
use crate::tracked::{root, tracked};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use wiperlab::fit::job::Job;
use wiperlab::recording::files::RecordingFile;
use wiperlab::simulate::scene::Scene;
use wiperlab::sweep::Study;

/// What stands in the pages for a name that the reader chooses.
const NAMES: [(&str, &str); 8] = [
    ("STUDY", "data/sweeps/short.toml"),
    ("DIR", "out/dir"),
    ("NAME", "short"),
    ("RECORDING", "data/actual-blade-twin"),
    ("SCENE", "data/scenes/actual-blade.toml"),
    ("TWIN", "data/twins/actual-blade.toml"),
    ("DATA", "out/data"),
    ("RUN", "out/run"),
];

enum How {
    /// As it stands with these words behind it; the exit code.
    With(&'static str, i32),
    /// What is run in its place; the exit code.
    As(&'static str, i32),
    /// Not here.
    Elsewhere,
}
use How::{As, Elsewhere, With};

/// Commands that are not run as they stand: page, command, how, why.
const OTHERWISE: &[(&str, &str, How, &str)] = &[
    (".ci/advisories/README.md", CLONE, Elsewhere, "needs a network"),
    (".ci/advisories/README.md", ".ci/deny renew target/advisory-db", Elsewhere, "needs a network"),
    (".ci/advisories/README.md", ".ci/deny", Elsewhere, ".ci/run runs it"),
    (
        "CONTRIBUTING.md",
        "cargo test --test figures browser:: -- --ignored",
        Elsewhere,
        "needs Chromium; .ci/run runs it",
    ),
    ("README.md", "cargo run --release -- demo", Elsewhere, ".ci/run runs it"),
    ("README.md", "cargo test", Elsewhere, ".ci/run runs it"),
    (
        "README.md",
        "wiperlab fit fits/actual-blade-twin/job.toml",
        With("--max-evaluations 12", 3),
        MANY_SECONDS,
    ),
    ("docs/clusters.md", "wiperlab collect DIR", As(ALL_DONE, 0), "when all are done"),
    ("docs/clusters.md", SUBMIT_STUDY, With("--print", 0), NO_SCHEDULER),
    ("docs/clusters.md", SUBMIT_MISSING, With("--print", 0), NO_SCHEDULER),
    (
        "docs/clusters.md",
        "wiperlab submit fits/*/job.toml --scheduler slurm --shards 20",
        With("--print", 0),
        NO_SCHEDULER,
    ),
    ("docs/clusters.md", PARALLEL, As(ONE_OF_MANY, 0), "GNU parallel is another program; what it runs"),
    ("docs/clusters.md", OVER_SSH, As(ONE_OF_MANY, 0), "needs other machines; what they run"),
    ("docs/clusters.md", HYPERQUEUE, As(ONE_OF_MANY, 0), "HyperQueue is another program; what it runs"),
    ("docs/clusters.md", "hq job wait last", Elsewhere, "HyperQueue is another program"),
    ("docs/figures.md", RSVG, Elsewhere, "another program"),
    ("docs/figures.md", INKSCAPE, Elsewhere, "another program"),
    ("docs/fits.md", "wiperlab fit fits/NAME/job.toml", With("", 3), FEW_EVALUATIONS),
    ("docs/fits.md", "wiperlab fit fits/NAME/job.toml --resume", With("", 3), FEW_EVALUATIONS),
    (
        "docs/fits.md",
        "wiperlab fit fits/*/job.toml --shard 3/20",
        As("wiperlab fit fits/*/job.toml --shard 1/20", 0),
        "two jobs",
    ),
    ("docs/fits.md", "wiperlab collect fits/*/job.toml --shards 20", With("", 3), FEW_EVALUATIONS),
    ("docs/gallery.md", "wiperlab report fits/actual-blade-twin", Elsewhere, "README.md has it"),
    ("docs/gallery.md", SWEEP_FRICTION, With("--shard 0/20", 0), MANY_SECONDS),
    (
        "docs/gallery.md",
        "wiperlab sweep data/sweeps/speed-preload.toml --out data/sweeps/speed-preload",
        With("--shard 0/20", 0),
        MANY_SECONDS,
    ),
    ("docs/gallery.md", REPORT_SEVERAL, Elsewhere, "README.md has it"),
    ("docs/hard-cases.md", "cargo test --test verify hard_cases", Elsewhere, "a test"),
    ("docs/install.md", "wiperlab demo", Elsewhere, "many seconds; .ci/run and tests/cli/demo.rs run it"),
    ("docs/install.md", ".ci/release", Elsewhere, "a build of minutes"),
    (
        "docs/install.md",
        "python -m pip install ./python",
        Elsewhere,
        "a build of minutes; .ci/python installs the same",
    ),
    ("docs/install.md", "cargo install --path . --locked", Elsewhere, "a build of minutes"),
    ("docs/measured.md", "cargo run --release --example measured -- FOLDER", Elsewhere, MEASURED),
    ("docs/measured.md", IMPORT_MEASURED, Elsewhere, MEASURED),
    ("docs/measured.md", INIT_MEASURED, Elsewhere, MEASURED),
    ("docs/measured.md", "wiperlab fit fit", Elsewhere, MEASURED),
    ("docs/measured.md", "wiperlab report fit", Elsewhere, MEASURED),
    (
        "docs/reports.md",
        "wiperlab report fits/A fits/B [fits/C ...]",
        Elsewhere,
        "README.md has it with names",
    ),
    ("docs/stability.md", STABILITY_MAP, As(SMALL_MAP, 0), MANY_SECONDS),
    ("docs/stability.md", STABILITY_RESUMED, As(SMALL_MAP_RESUMED, 0), MANY_SECONDS),
    ("docs/sweeps.md", SWEEP_FRICTION, With("--shard 0/20", 0), MANY_SECONDS),
    ("docs/sweeps.md", "wiperlab collect DIR", As(ALL_DONE, 0), "when all are done"),
    ("fuzz/README.md", "fuzz/run 60", Elsewhere, "needs a nightly toolchain"),
    ("fuzz/README.md", "fuzz/run 600 tracker scene", Elsewhere, "needs a nightly toolchain"),
];
/// Reason for commands that `.ci/thorough` runs as they stand.
const MANY_SECONDS: &str = "many seconds";
const SWEEP_FRICTION: &str = "wiperlab sweep data/sweeps/friction.toml --out data/sweeps/friction";
const STABILITY_MAP: &str = "wiperlab stability data/scenes/published-simulation.toml --out out/stability-map \
                             --speed-m-per-s 0..1 --preload-n 0.1..1 --points 60";
const STABILITY_RESUMED: &str = "wiperlab stability data/scenes/published-simulation.toml --out out/stability-map \
                                 --speed-m-per-s 0..1 --preload-n 0.1..1 --points 60 --resume";
const SMALL_MAP: &str = "wiperlab stability data/scenes/light-blade.toml --out out/stability-map --speed-m-per-s 0..1 \
                         --preload-n 0.1..1 --points 6";
const SMALL_MAP_RESUMED: &str = "wiperlab stability data/scenes/light-blade.toml --out out/stability-map \
                                 --speed-m-per-s 0..1 --preload-n 0.1..1 --points 6 --resume";
const MEASURED: &str = "the records of others are not in this repository";
const IMPORT_MEASURED: &str = "wiperlab import load-250g.csv --out rec --frame-rate-hz 250 --scale m --time real \
                               --columns time=time_s,tip-x=mass_x_m,head-x=base_x_m";
const INIT_MEASURED: &str = "wiperlab init rec --slider --mass-kg 3.0799 --normal-force-n 2.4525 --out fit";
const CLONE: &str = "git clone --depth 1 https://github.com/rustsec/advisory-db target/advisory-db";
const SUBMIT_STUDY: &str =
    "wiperlab submit STUDY --out DIR --scheduler slurm --shards 64 --threads 4 --time 1h30min";
const SUBMIT_MISSING: &str = "wiperlab submit STUDY --out DIR --scheduler slurm --shards 64 --tasks 3,17";
const RSVG: &str = "rsvg-convert -f pdf -o friction.pdf reports/actual-blade-twin/paper/friction-85mm.svg";
const INKSCAPE: &str =
    "inkscape --export-filename=friction.pdf reports/actual-blade-twin/paper/friction-85mm.svg";
const REPORT_SEVERAL: &str = "wiperlab report fits/published-simulation fits/published-experiment";
const FEW_EVALUATIONS: &str = "the short fit uses up its evaluations";
const ALL_DONE: &str = "wiperlab sweep STUDY --out DIR --shard 0/1 && wiperlab collect DIR";
const NO_SCHEDULER: &str = "there is no scheduler here; tests/cli/submit.rs has one that stands for it";
const ONE_OF_MANY: &str = "wiperlab sweep STUDY --out DIR --shard 7/10000 --threads 1 --quiet";
const PARALLEL: &str =
    "seq 0 9999 | parallel -j 8 wiperlab sweep STUDY --out DIR --shard {}/10000 --threads 1 --quiet";
const OVER_SSH: &str = "seq 0 9999 | parallel -j 8 --sshloginfile nodes --workdir . \
     wiperlab sweep STUDY --out DIR --shard {}/10000 --threads 1 --quiet";
const HYPERQUEUE: &str = "hq submit --array 0-9999 --cpus 1 -- \
     sh -c 'exec wiperlab sweep STUDY --out DIR --shard \"$HQ_TASK_ID/10000\" --threads 1 --quiet'";

/// The committed data, a short study and a short fit, which has a result where the page names one. Where it
/// takes all fits there are two, of features and of traces.
fn project(page: &str) -> Project {
    let project = Project::copied();
    let names = |part: &str| commands(&read_page(page)).iter().any(|command| command.contains(part));
    if names("fits/*/") {
        fs::remove_dir_all(project.path("fits")).unwrap();
    }
    fs::create_dir_all(project.path("fits/short")).unwrap();
    let job = small_fit::JOB.replace("data/twin", "data/actual-blade-twin");
    fs::write(project.path("fits/short/job.toml"), job).unwrap();
    fs::write(project.path("data/sweeps/short.toml"), submit::STUDY).unwrap();
    if names("fits/NAME") {
        run(&project, "wiperlab fit fits/short/job.toml", 3, page);
    }
    if names("fits/*/") {
        fs::create_dir_all(project.path("fits/traced")).unwrap();
        fs::write(project.path("fits/traced/job.toml"), traces::JOB).unwrap();
        fs::write(project.path("data/short.toml"), traces::TWIN).unwrap();
        run(&project, "wiperlab twin data/short.toml --out data/short", 0, page);
    }
    project
}

fn read_page(page: &str) -> String {
    fs::read_to_string(root().join(page)).unwrap()
}

/// The command with names in place of the words that stand for them.
fn named(command: &str) -> String {
    let is_part = |c: char| c.is_alphanumeric() || c == '_';
    let words = command.split_inclusive(|c| !is_part(c)).map(|word| {
        let (name, rest) = word.split_at(word.find(|c| !is_part(c)).unwrap_or(word.len()));
        let found = NAMES.iter().find(|(stands, _)| *stands == name);
        format!("{}{rest}", found.map_or(name, |(_, name)| name))
    });
    words.collect()
}

/// Runs a command as a shell does, with the program on its path.
fn run(project: &Project, command: &str, code: i32, of: &str) {
    let program = Path::new(env!("CARGO_BIN_EXE_wiperlab")).parent().unwrap();
    let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap());
    let ran = Command::new("sh")
        .args(["-c", command])
        .env("PATH", path)
        .current_dir(project.path(""))
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let said = format!("{}{}", text(&ran.stdout), text(&ran.stderr));
    assert_eq!(ran.status.code(), Some(code), "{of}: {command}\n{said}");
}

fn runs(page: &str) {
    let project = project(page);
    for command in commands(&read_page(page)) {
        let is_listed = |(of, listed, _, why): &&(&str, &str, How, &str)| {
            *of == page && *listed == command && !(is_thorough() && *why == MANY_SECONDS)
        };
        let otherwise = OTHERWISE.iter().find(is_listed);
        let started = std::time::Instant::now();
        match otherwise.map(|(_, _, how, _)| how) {
            None => run(&project, &named(&command), 0, page),
            Some(With(more, code)) => run(&project, &named(&format!("{command} {more}")), *code, page),
            Some(As(other, code)) => run(&project, &named(other), *code, page),
            Some(Elsewhere) => {}
        }
        println!("{:6.1} s  {page}: {command}", started.elapsed().as_secs_f64());
    }
}

macro_rules! pages {
    ($($name:ident: $page:literal,)+) => {
        /// Pages whose commands are run here.
        const PAGES: &[&str] = &[$($page),+];
        $(#[test]
        fn $name() {
            runs($page);
        })+
    };
}

pages! {
    advisories: ".ci/advisories/README.md",
    contributing: "CONTRIBUTING.md",
    readme: "README.md",
    data: "data/README.md",
    blade: "docs/blade.md",
    clusters: "docs/clusters.md",
    figures: "docs/figures.md",
    fits: "docs/fits.md",
    gallery: "docs/gallery.md",
    hard_cases: "docs/hard-cases.md",
    install: "docs/install.md",
    measured: "docs/measured.md",
    reports: "docs/reports.md",
    stability: "docs/stability.md",
    sweeps: "docs/sweeps.md",
    fuzz: "fuzz/README.md",
}

/// Its commands are run by `first_hour.rs`, with the numbers that the reader replaces.
const FIRST_HOUR: &str = "docs/first-hour.md";

#[test]
fn every_page_with_commands_is_run_here_or_says_why_not() {
    let Some(files) = tracked() else { return };
    let pages = files.iter().filter(|path| path.ends_with(".md"));
    let with: Vec<&str> =
        pages.map(String::as_str).filter(|page| !commands(&read_page(page)).is_empty()).collect();
    let mut listed: Vec<&str> = PAGES.iter().copied().chain([FIRST_HOUR]).collect();
    listed.sort_unstable();
    assert_eq!(listed, with);
    for (page, command, _, why) in OTHERWISE {
        assert!(PAGES.contains(page) && !why.is_empty(), "{page}: {command}");
        assert!(commands(&read_page(page)).iter().any(|found| found == command), "{page} has no `{command}`");
    }
}

/// Commands and options of the program that a text in code names: the words of the command, and each option.
fn asked(code: &str) -> Option<(Vec<String>, Vec<String>)> {
    let after = code
        .split_once("wiperlab ")
        .filter(|(before, _)| !before.ends_with(['/', '-', '_']) && *before != "import ")?
        .1;
    let words: Vec<&str> = after.split(['|', ';', '\'', '`', ')']).next()?.split_whitespace().collect();
    let is_word =
        |word: &&&str| word.chars().all(|c| c.is_ascii_lowercase() || c == '-') && !word.starts_with('-');
    let names = words.first().filter(|word| is_word(word))?;
    let command = vec![(*names).to_owned()];
    let options = words.iter().filter(|word| word.starts_with("--") && word.len() > 2);
    let options = options.map(|word| word.split(['=', ',', '.', ':']).next().unwrap().to_owned());
    Some((command, options.collect()))
}

#[test]
fn commands_and_options_that_a_page_names_exist() {
    let Some(files) = tracked() else { return };
    let project = Project::copied();
    let mut helps: BTreeMap<Vec<String>, String> = BTreeMap::new();
    let mut wrong = Vec::new();
    let mut named = 0;
    // (the changes name what there was)
    for page in files.iter().filter(|path| path.ends_with(".md") && *path != "CHANGELOG.md") {
        for code in code(&read_page(page)) {
            let Some((command, options)) = asked(&code) else { continue };
            if command[0] == "help" {
                continue;
            }
            named += 1;
            let help = helps.entry(command.clone()).or_insert_with(|| {
                let ran = Command::new(env!("CARGO_BIN_EXE_wiperlab"))
                    .args(&command)
                    .arg("--help")
                    .current_dir(project.path(""))
                    .output()
                    .unwrap();
                if ran.status.success() { String::from_utf8(ran.stdout).unwrap() } else { String::new() }
            });
            let has = |option: &String| help.split([' ', '\n', ',', '=', '[']).any(|word| word == option);
            if help.is_empty() || !options.iter().all(has) {
                wrong.push(format!("{page}: {code}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert!(named > 100 && helps.len() > 15, "{named} times {:?}", helps.keys());
}

#[test]
fn examples_benches_and_tests_that_a_page_names_exist() {
    let Some(files) = tracked() else { return };
    let mut named = 0;
    for page in files.iter().filter(|path| path.ends_with(".md")) {
        for code in code(&read_page(page)) {
            let words: Vec<&str> = code.split_whitespace().collect();
            if words.first() != Some(&"cargo") {
                continue;
            }
            let package = words.iter().position(|word| *word == "-p");
            let home = package.map_or_else(String::new, |at| format!("crates/{}/", words[at + 1]));
            for (folder, option) in [("examples", "--example"), ("benches", "--bench"), ("tests", "--test")] {
                let Some(at) = words.iter().position(|word| *word == option) else { continue };
                let name = words[at + 1];
                let found = [format!("{home}{folder}/{name}.rs"), format!("{home}{folder}/{name}/main.rs")];
                assert!(found.iter().any(|file| files.contains(file)), "{page}: {code}: no {}", found[0]);
                named += 1;
                let filter = words
                    .get(at + 2)
                    .filter(|word| option == "--test" && **word != "NAME" && !word.starts_with('-'));
                let Some(filter) = filter else { continue };
                let last = filter.rsplit("::").next().unwrap();
                let sources = files.iter().filter(|file| file.starts_with(&format!("tests/{name}/")));
                let mut texts = sources.map(|file| (file, read_page(file)));
                let names = |line: &str| line.trim_start().starts_with("fn ") && line.contains(last);
                let has = texts.any(|(file, text)| file.contains(last) || text.lines().any(names));
                assert!(has, "{page}: {code}: no test of this name");
            }
        }
    }
    assert!(named > 20, "{named}");
}

/// Languages of the blocks, and what reads them.
const LANGUAGES: [(&str, &str); 5] = [
    ("sh", "this file"),
    ("toml", "this file"),
    ("python", "python/tests/test_docs.py"),
    ("text", "nothing: what a program prints, or types on another system"),
    ("", "nothing: the same"),
];

/// What stands around a part of a file in a block: page, first line of the block, what comes before it, and
/// what reads the file.
type Reader = fn(&str) -> Result<(), String>;
const PARTS: &[(&str, &str, &str, Reader)] = &[
    ("docs/fits.md", "nuisance = ", "format = 1\ntitle = \"a\"\nscene = \"scene.toml\"\nseed = 1\n", job),
    ("docs/formats.md", "[camera]", "format = 1\n", recording),
    ("docs/formats.md", "[video]", include_str!("../../data/actual-blade-twin/recording.toml"), recording),
    ("docs/keys.md", "#:schema ", include_str!("../../data/scenes/actual-blade.toml"), scene),
    ("docs/sweeps.md", "format = 1", "", study),
    ("docs/sweeps.md", "[sample]", SAMPLED, study),
];

/// A study without axes.
const SAMPLED: &str = "format = 1\ntitle = \"a\"\nscene = \"scene.toml\"\n
[camera]\nframe_rate_hz = 1000.0\nexposure_s = 0.0\n
[[map]]\nname = \"a\"\nkind = \"stick-fraction\"\n\n";

fn job(text: &str) -> Result<(), String> {
    Job::parse("job.toml", text).map(drop).map_err(|error| error.to_string())
}

fn recording(text: &str) -> Result<(), String> {
    RecordingFile::parse("recording.toml", text).map(drop).map_err(|error| error.to_string())
}

fn scene(text: &str) -> Result<(), String> {
    Scene::parse("scene.toml", text).map(drop).map_err(|error| error.to_string())
}

fn study(text: &str) -> Result<(), String> {
    Study::parse("study.toml", text).map(drop).map_err(|error| error.to_string())
}

#[test]
fn blocks_of_files_are_read_as_the_files_that_they_show() {
    let Some(files) = tracked() else { return };
    let mut read = 0;
    for page in files.iter().filter(|path| path.ends_with(".md") && !path.starts_with(".ci/")) {
        for block in blocks(&read_page(page)) {
            let known = LANGUAGES.iter().any(|(language, _)| *language == block.language);
            assert!(known, "{page}: nothing is known of a block of `{}`", block.language);
            let has_code = ["docs/python.md", "python/README.md"].contains(&page.as_str());
            assert!(block.language != "python" || has_code, "{page}: not run by python/tests/test_docs.py");
            if block.language != "toml" || page == FIRST_HOUR {
                continue;
            }
            let part = PARTS.iter().find(|(of, start, ..)| of == page && block.text.starts_with(start));
            let (_, _, before, reader) = part.unwrap_or_else(|| panic!("{page}: not listed: {}", block.text));
            reader(&format!("{before}{}", block.text)).unwrap_or_else(|error| panic!("{page}: {error}"));
            read += 1;
        }
    }
    assert_eq!(read, PARTS.len(), "a part that is listed is on no page");
}
