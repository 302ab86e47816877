//! Figures of commands that print or write tables.

use crate::small_fit::Project;
use std::fs;

#[test]
fn commands_draw_what_they_say() {
    let project = Project::of("twin");
    let made = |arguments: &[&str], folder: &str, names: &[&str]| {
        let (code, said, err) = project.run(&[arguments, &["--figures", folder]].concat());
        assert_eq!((code, err.as_str()), (0, ""), "{said}");
        for name in names {
            assert!(said.contains(&format!("{name}.svg")), "{said}");
            for file in
                [format!("{name}.svg"), format!("paper/{name}-85mm.svg"), format!("paper/{name}-170mm.svg")]
            {
                let svg = fs::read_to_string(project.path(folder).join(file)).unwrap();
                assert!(svg.starts_with("<svg") && !svg.contains("NaN"));
            }
        }
    };
    let scene = "data/scenes/actual-blade.toml";
    made(&["modes", scene], "drawn", &["tip-compliance", "mode-shapes"]);
    made(&["simulate", scene, "--out", "run"], "run", &["motion"]);
    assert!(project.path("run/trace.csv").exists() && project.path("run/summary.json").exists());
    made(&["inspect", "run"], "drawn", &["recorded"]);
    let drawn = project.read("drawn/recorded.svg");
    assert!(drawn.contains("synthetic recording") && drawn.contains("reversal 1"));
    let twin = "data/twins/actual-blade.toml";
    project.write(twin, include_str!("../../data/twins/actual-blade.toml"));
    made(&["twin", twin, "--out", "film"], "film-drawn", &["twin"]);
    let drawn = project.read("film-drawn/twin.svg");
    assert!(
        ["synthetic", "lost frame", "longest stick ends", "frame as tracked"]
            .iter()
            .all(|word| drawn.contains(word))
    );
    // drawn again into the same folder, next to the others; a figure that was changed is not replaced
    made(&["inspect", "run"], "drawn", &["recorded"]);
    assert!(project.path("drawn/tip-compliance.svg").exists());
    project.write("drawn/recorded.svg", "mine");
    let (code, _, err) = project.run(&["inspect", "run", "--figures", "drawn"]);
    assert!(code == 2 && err.contains("recorded.svg") && err.contains("--force"), "{err}");
    assert_eq!(project.read("drawn/recorded.svg"), "mine");
    assert_eq!(project.run(&["inspect", "run", "--figures", "drawn", "--force"]).0, 0);
}
