//! Help pages, manual pages and completions: all from the definition of the commands.

use crate::small_fit::Project;
use std::process::{Command, Stdio};

/// Every command.
const COMMANDS: [&str; 19] = [
    "accuracy",
    "blade",
    "collect",
    "completions",
    "demo",
    "fit",
    "help",
    "import",
    "init",
    "inspect",
    "man",
    "modes",
    "report",
    "simulate",
    "spectrum",
    "stability",
    "submit",
    "sweep",
    "twin",
];
const PAGES: [&str; 12] = [
    "first-hour",
    "scene",
    "job",
    "study",
    "twin.toml",
    "recording",
    "section",
    "windows",
    "components",
    "features",
    "traces",
    "exit-codes",
];

fn said(arguments: &[&str]) -> String {
    let (code, out, err) = Project::of("twin").run(arguments);
    assert_eq!((code, err.as_str()), (0, ""), "{arguments:?}");
    out
}

#[test]
fn help_of_a_command_is_that_of_its_option() {
    for command in COMMANDS {
        assert_eq!(said(&["help", command]).trim_end(), said(&[command, "--help"]).trim_end());
    }
    assert_eq!(said(&["help"]).trim_end(), said(&["--help"]).trim_end());
}

#[test]
fn every_page_is_listed_and_fits_a_terminal() {
    let list = said(&["--help"]);
    for page in PAGES {
        assert!(list.lines().any(|line| line.starts_with(&format!("  {page} "))), "{page}");
        let text = said(&["help", page]);
        assert!(text.lines().count() > 4, "{page}: {text}");
        // (commands may be longer)
        let long = text.lines().find(|line| line.chars().count() > 100 && !line.starts_with("    "));
        assert_eq!(long, None, "{page}");
        assert!(!text.contains("](") && !text.contains("|---"), "{page}: {text}");
    }
    assert_eq!(said(&["help", "scene.toml"]), said(&["help", "scene"]));
}

#[test]
fn the_page_of_a_file_has_every_key_of_the_reference() {
    let reference = include_str!("../../docs/keys.md");
    let pages: Vec<String> = ["scene", "job", "study", "twin.toml", "recording", "section"]
        .map(|page| said(&["help", page]))
        .into();
    let mut keys = 0;
    for section in reference.split("\n## ").skip(1).zip(&pages) {
        let named = section.0.lines().filter_map(|line| line.strip_prefix("| `")?.split_once('`'));
        for (key, _) in named {
            assert!(
                section
                    .1
                    .lines()
                    .any(|line| line == format!("  {key}") || line.starts_with(&format!("  {key}  ("))),
                "{key}"
            );
            keys += 1;
        }
    }
    assert!(keys > 150, "{keys}");
}

#[test]
fn an_unknown_page_is_refused_with_the_nearest() {
    let project = Project::of("twin");
    let (code, out, err) = project.run(&["help", "windos"]);
    assert_eq!((code, out.as_str()), (2, ""));
    assert!(err.contains("`windos`") && err.contains("did you mean `windows`?"), "{err}");
    let (code, _, err) = project.run(&["help", "qqqq"]);
    assert!(code == 2 && err.contains("`wiperlab help` lists"), "{err}");
}

#[test]
fn every_command_has_a_manual_page() {
    let project = Project::of("twin");
    assert_eq!(project.run(&["man", "--out", "man1"]).0, 0);
    assert!(project.read("man1/wiperlab.1").contains("wiperlab help"));
    for command in COMMANDS {
        let page = project.read(&format!("man1/wiperlab-{command}.1"));
        assert!(page.contains(".SH NAME") && page.contains(".SH OPTIONS"), "{command}");
    }
    assert_eq!(project.run(&["man", "--out", "man1"]).0, 0, "its own pages are written anew");
}

#[test]
fn every_shell_completes_every_command() {
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = said(&["completions", shell]);
        for command in COMMANDS.iter().filter(|command| !command.contains(' ')) {
            assert!(script.contains(command), "{shell}: {command}");
        }
        let interpreter = Command::new(shell).arg("-n").stdin(Stdio::piped()).stderr(Stdio::piped()).spawn();
        if let (true, Ok(mut checked)) = (["bash", "zsh", "fish"].contains(&shell), interpreter) {
            use std::io::Write;
            checked.stdin.take().unwrap().write_all(script.as_bytes()).unwrap();
            let ended = checked.wait_with_output().unwrap();
            assert!(ended.status.success(), "{shell}: {}", String::from_utf8_lossy(&ended.stderr));
        }
    }
}

#[test]
fn the_version_says_how_it_was_built() {
    let long = said(&["--version"]);
    for part in [
        concat!("wiperlab ", env!("CARGO_PKG_VERSION")),
        "built for ",
        "optimisation level",
        "rustc ",
        "commit ",
    ] {
        assert!(long.contains(part), "{part}: {long}");
    }
    assert_eq!(said(&["-V"]), concat!("wiperlab ", env!("CARGO_PKG_VERSION"), "\n"));
}
