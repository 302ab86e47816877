//! Frames of a video in a report, and what is refused of them.

use crate::project::Project;
use std::fs;
use std::process::Command;

const RECORDING: &str = "data/actual-blade-twin";

/// A grey PNG of the whole stroke, 560 x 60 pixels of 0.2 mm.
fn png() -> Vec<u8> {
    let picture = wiperlab::recording::video::Picture { width: 560, height: 60, grey: vec![90; 33_600] };
    picture.to_png().unwrap()
}

/// The bundled project with a `[video]` in its recording.
fn project(video: &str) -> Project {
    let project = Project::copied();
    let path = project.path(&format!("{RECORDING}/recording.toml"));
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, format!("{text}\n[video]\n{video}\n")).unwrap();
    project
}

fn frames(project: &Project, picture: &[u8]) {
    let folder = project.path(&format!("{RECORDING}/frames"));
    fs::create_dir_all(&folder).unwrap();
    for frame in
        0..fs::read_to_string(project.path(&format!("{RECORDING}/trace.csv"))).unwrap().lines().count()
    {
        fs::write(folder.join(format!("run_{frame}.png")), picture).unwrap();
    }
}

fn refused(project: &Project, parts: &[&str]) {
    let run = Command::new(env!("CARGO_BIN_EXE_wiperlab"))
        .args(["report", "fits/actual-blade-twin", "--out", "out"])
        .current_dir(project.path(""))
        .output()
        .unwrap();
    let message = String::from_utf8(run.stderr).unwrap();
    assert_eq!(run.status.code(), Some(2), "{message}");
    parts.iter().for_each(|part| assert!(message.contains(part), "{part}: {message}"));
    assert!(!project.path("out").exists());
}

const GOOD: &str = "frames = \"frames\"\norigin_px = [0.0, 20.0]\nmetres_per_pixel = 2e-4";

#[test]
fn a_report_shows_the_frames_behind_the_links_and_stays_one_page() {
    let project = project(GOOD);
    frames(&project, &png());
    project.run_to(&["report", "fits/actual-blade-twin", "--out", "out"], &[0]);
    let figure = fs::read_to_string(project.path("out/video-frames.svg")).unwrap();
    assert!(figure.matches("data:image/png;base64,").count() >= 3);
    // one picture alone
    let one = project.path(&format!("{RECORDING}/recording.toml"));
    let text = fs::read_to_string(&one).unwrap();
    fs::write(&one, text.replace("frames = \"frames\"", "frames = \"frames/run_7.png\"\nfirst_frame = 7"))
        .unwrap();
    project.run_to(&["report", "fits/actual-blade-twin", "--out", "one"], &[0]);
    let alone = fs::read_to_string(project.path("one/index.html")).unwrap();
    assert!(alone.contains("The video has no picture") && alone.contains("first_frame"));
    let page = fs::read(project.path("out/index.html")).unwrap();
    assert!(page.len() < 1_000_000, "{}", page.len());
}

#[test]
fn what_is_wrong_with_a_video_is_named() {
    let missing = project(GOOD);
    let recording = fs::read_to_string(missing.path(&format!("{RECORDING}/recording.toml"))).unwrap();
    let origin = recording.lines().position(|line| line.starts_with("origin_px")).unwrap() + 1;
    let origin = format!("recording.toml:{origin}:");
    refused(&missing, &["recording.toml: key `video.frames`", "\"frames\"", "cannot be read"]);
    fs::create_dir_all(missing.path(&format!("{RECORDING}/frames"))).unwrap();
    refused(&missing, &["key `video.frames`", "holds none"]);
    frames(&missing, b"no picture");
    refused(&missing, &["run_", ".png: found no readable PNG", "save the frames"]);
    frames(&missing, &png()[..60]);
    refused(&missing, &[".png: found no readable PNG"]);
    for (wrong, parts) in [
        (GOOD.replace("2e-4", "-2e-4"), &["`video.metres_per_pixel`", "-2e-4", "from 1e-9 to 1 m"][..]),
        (GOOD.replace("2e-4", "1e-310"), &["`video.metres_per_pixel`", "e-310", "from 1e-9"]),
        (GOOD.replace("2e-4", "1e300"), &["`video.metres_per_pixel`", "1e300"]),
        (GOOD.replace("[0.0, 20.0]", "[1e308, 20.0]"), &["`video.origin_px`", "up to ten million"]),
        (GOOD.replace("[0.0, 20.0]", "[0.0]"), &[&origin, "[0.0]", "expected two numbers"]),
        (GOOD.replace("[0.0, 20.0]", "[0.0, 20.0, 1.0]"), &[&origin, "expected two numbers"]),
        (GOOD.replace("origin_px", "orign_px"), &["orign_px", "did you mean `origin_px`?"]),
        (GOOD.replace("frames = \"frames\"\n", ""), &["frames"]),
        (format!("{GOOD}\nfirst_frame = -1"), &["first_frame"]),
    ] {
        refused(&project(&wrong), parts);
    }
}
