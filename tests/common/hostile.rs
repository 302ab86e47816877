//! Small fits whose names try to be more than text, and the report of one of them.

use super::small_fit::{JOB, Project};

pub const FIT: &str = "hostile";
pub const TITLE: &str = "<script>window.broken = 1; alert(1)</script> \"quoted\" & 'single' \u{5e9}\u{5dc}\u{5d5}\u{5dd} \u{645}\u{631}\u{62d}\u{628}\u{627} \u{1f697}";
/// Of a recording: the name of its folder.
pub const RECORDING: &str = "<b onclick=alert(1)>twin \u{1f9ea}\u{202e}evil";
pub const COMPONENT: &str = "low\"><img src=x onerror=alert(1)> \u{5e0}\u{5de}\u{5d5}\u{5da}";
pub const FEATURE: &str = "</title></svg><script>alert(2)</script> ]]> \u{1f697}";
pub const NAMES: [&str; 4] = [TITLE, RECORDING, COMPONENT, FEATURE];

/// A project with such a fit, reported in `reports/hostile`.
pub fn project() -> Project {
    let project = Project::of(RECORDING);
    fit(&project, FIT);
    let (code, _, stderr) = project.run(&["report", &format!("fits/{FIT}")]);
    assert_eq!(code, 0, "{stderr}");
    project
}

/// Makes such a fit as `fits/NAME`.
pub fn fit(project: &Project, name: &str) {
    let quoted = |text: &str| serde_json::to_string(text).unwrap(); // a JSON string is a TOML string
    let job = JOB
        .replace("\"A small fit\"", &quoted(TITLE))
        .replace("\"../../data/twin\"", &quoted(&format!("../../data/{RECORDING}")))
        .replace("\"low\"", &quoted(COMPONENT))
        .replace("name = \"release\"", &format!("name = {}", quoted(FEATURE)));
    project.write(&format!("fits/{name}/job.toml"), &job);
    let (code, _, stderr) = project.run(&["fit", &format!("fits/{name}/job.toml")]);
    assert!([0, 3].contains(&code), "{stderr}");
}
