//! A small fit whose names try to be more than text, and its report.

use super::project::Project;
use std::fs;

pub const FIT: &str = "hostile";
pub const TITLE: &str =
    "<script>window.broken = 1; alert(1)</script> \"quoted\" & 'single' \u{5e9}\u{5dc}\u{5d5}\u{5dd} \u{645}\u{631}\u{62d}\u{628}\u{627} \u{1f697}";
/// Of a recording: the name of its folder.
pub const RECORDING: &str = "<b onclick=alert(1)>twin \u{1f9ea}\u{202e}evil";
pub const COMPONENT: &str = "low\"><img src=x onerror=alert(1)> \u{5e0}\u{5de}\u{5d5}\u{5da}";
pub const FEATURE: &str = "</title></svg><script>alert(2)</script> ]]> \u{1f697}";
pub const NAMES: [&str; 4] = [TITLE, RECORDING, COMPONENT, FEATURE];

/// A fit of two parameters near their truth with a budget of a few evaluations, reported in `reports/hostile`.
pub fn project() -> Project {
    let project = Project::copied();
    let twin = project.path("data").join("actual-blade-twin");
    fs::rename(twin, project.path("data").join(RECORDING)).unwrap();
    let quoted = |text: &str| serde_json::to_string(text).unwrap(); // a JSON string is a TOML string
    let job = format!(
        "format = 1\ntitle = {}\nscene = \"../../data/scenes/actual-blade.toml\"\nseed = 3\n\n[[recording]]\npath = {}\n\n{PARAMETERS}\n\
         [[component]]\nname = {}\nchannel = \"head-drop\"\nwindow = \"release+0.01..release+0.2\"\nband_hz = [40.0, 140.0]\n\n\
         [[feature]]\nname = {}\nkind = \"release-after-reversal\"\nsd_relative = 0.01\n\n\
         [search]\nglobal_evaluations = 8\nlocal_evaluations = 6\nparticles = 4\n\n[intervals]\nbootstrap = 2\n",
        quoted(TITLE),
        quoted(&format!("../../data/{RECORDING}")),
        quoted(COMPONENT),
        quoted(FEATURE),
    );
    let folder = project.path("fits").join(FIT);
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("job.toml"), job).unwrap();
    project.run_to(&["fit", &format!("fits/{FIT}/job.toml")], &[0, 3]);
    project.report(FIT);
    project
}

const PARAMETERS: &str = r#"[[parameter]]
name = "friction.c"
lower = 0.27
upper = 0.33
scale = "linear"

[[parameter]]
name = "blade.neck_stiffness_n_m_per_rad"
lower = 0.0017
upper = 0.0021
scale = "log"
"#;
