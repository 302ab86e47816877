//! The command `spectrum` as a user runs it.

use assert_cmd::Command;
use std::f64::consts::TAU;
use std::fmt::Write;
use std::path::Path;

/// 0.3 s at 5,000 frames/s: 78.4 and 900 Hz in the deflection, the head on a straight line.
fn trace(folder: &Path) {
    let mut text = "time_s,tip_x_m,tip_y_m,head_x_m,head_y_m\n".to_owned();
    for i in 0..1500 {
        let t = f64::from(i) / 5000.0;
        let deflection = 2e-5 * (TAU * 78.4 * t).sin() + 8e-6 * (TAU * 900.0 * t).sin();
        writeln!(text, "{t:.6},{:.9},0,{:.9},0", 0.01 + 0.1 * t + deflection, 0.01 + 0.1 * t).unwrap();
    }
    std::fs::write(folder.join("trace.csv"), text).unwrap();
}

fn wiperlab(folder: &Path, more: &[&str]) -> assert_cmd::assert::Assert {
    Command::new(env!("CARGO_BIN_EXE_wiperlab")).current_dir(folder).args(["spectrum", "trace.csv", "--out", "out"]).args(more).assert()
}

#[test]
fn the_components_are_a_list_and_the_figure_and_table_are_there() {
    let folder = tempfile::tempdir().unwrap();
    trace(folder.path());
    wiperlab(folder.path(), &["--window", "0.05..0.20", "--band", "50..2000"]).success();
    let read = |name: &str| std::fs::read_to_string(folder.path().join("out").join(name)).unwrap();
    let list: serde_json::Value = serde_json::from_str(&read("components.json")).unwrap();
    let list = list.as_array().unwrap();
    assert_eq!(list.len(), 2, "{list:?}");
    for (component, hz) in list.iter().zip([78.4, 900.0]) {
        assert!((component["frequency_hz"].as_f64().unwrap() - hz).abs() < 0.05, "{component}");
        assert_eq!(component["verdict"], "clear");
        assert!(component["damping_ratio"].is_null());
    }
    let mut keys: Vec<_> = list[0].as_object().unwrap().keys().map(String::as_str).collect();
    keys.sort_unstable();
    assert_eq!(keys, ["amplitude_m", "amplitude_sd_m", "damping_ratio", "frequency_hz", "frequency_sd_hz", "snr_db", "verdict"]);
    assert!(read("spectrum.csv").starts_with("frequency_hz,amplitude_m\n0,"));
    assert!(read("spectrum.svg").starts_with("<svg ") && read("spectrum.svg").contains("900 Hz"));
}

#[test]
fn bad_input_is_refused_with_code_2_and_writes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    trace(folder.path());
    let refusals: [(&[&str], &str); 7] = [
        (&["--channel", "head_drop"], "--channel: unknown channel `head_drop`; did you mean `head-drop`?"),
        (&["--window", "0.1"], "--window: window `0.1`: found `0.1`"),
        (&["--window", "release..release+0.1"], "the head does not turn in it"),
        (&["--window", "0.2..0.4"], "choose a window inside it"),
        (&["--detrend", "square"], "--detrend: unknown detrending `square`"),
        (&["--band", "100..60"], "--band: found `100..60`"),
        (&["--band", "3000..4000"], "band 3000..4000 Hz"),
    ];
    for (arguments, message) in refusals {
        let output = wiperlab(folder.path(), arguments).code(2).get_output().clone();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert!(stderr.contains(message), "{stderr}");
        assert!(!folder.path().join("out").exists());
    }
}
