//! The command `spectrum` as a user runs it.

use assert_cmd::Command;
use serde_json::Value;
use std::f64::consts::TAU;
use std::fmt::Write;
use std::path::Path;

/// Every key of a component, in the order of the file.
const KEYS: [&str; 21] = [
    "frequency_hz",
    "frequency_sd_hz",
    "range_hz",
    "begins_s",
    "amplitude_m",
    "amplitude_sd_m",
    "damping_ratio",
    "damping_ratio_sd",
    "snr_db",
    "cramer_rao_hz",
    "line_probability",
    "estimator",
    "leakage_m",
    "exposure_passes",
    "folded_from",
    "harmonic_of",
    "subharmonic_of",
    "sideband_of",
    "mains",
    "verdict",
    "reasons",
];
const SPECTRUM_HEADER: &str = "frequency_hz,amplitude_m,noise_floor_m,leakage_m,density_m2_per_hz,density_lower_95_m2_per_hz,density_upper_95_m2_per_hz,line_probability\n";
const RIDGE_HEADER: &str =
    "time_s,frequency_hz,frequency_sd_hz,amplitude_m,tip_speed_m_per_s,head_speed_m_per_s\n";

/// A trace of 78.4 and 900 Hz in the deflection; the head moves as `head_m` says, with even noise of up to 10
/// nm in the tip.
fn trace(folder: &Path, rate_hz: f64, frames: u32, head_m: fn(f64) -> f64) {
    let mut text = "time_s,tip_x_m,tip_y_m,head_x_m,head_y_m\n".to_owned();
    let mut state = 1_u64;
    for i in 0..frames {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let noise = 1e-8 * ((state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0);
        let t = f64::from(i) / rate_hz;
        let deflection = 2e-5 * (TAU * 78.4 * t).sin() + 8e-6 * (TAU * 900.0 * t).sin();
        writeln!(text, "{t:.6},{:.10},0,{:.10},0", head_m(t) + deflection + noise, head_m(t)).unwrap();
    }
    std::fs::create_dir_all(folder).unwrap();
    std::fs::write(folder.join("trace.csv"), text).unwrap();
}

fn even(t: f64) -> f64 {
    0.01 + 0.1 * t
}

/// 0.3 s at 5,000 frames/s, the head on a straight line.
fn recording() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    trace(folder.path(), 5000.0, 1500, even);
    folder
}

fn wiperlab(folder: &Path, arguments: &[&str]) -> assert_cmd::assert::Assert {
    Command::new(env!("CARGO_BIN_EXE_wiperlab"))
        .current_dir(folder)
        .args(["spectrum", "--out", "out"])
        .args(arguments)
        .assert()
}

fn read(folder: &Path, name: &str) -> String {
    std::fs::read_to_string(folder.join("out").join(name)).unwrap()
}

fn json(folder: &Path, name: &str) -> Value {
    serde_json::from_str(&read(folder, name)).unwrap()
}

fn components(folder: &Path) -> Vec<Value> {
    json(folder, "components.json")["components"].as_array().unwrap().clone()
}

fn written(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder.join("out"))
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort_unstable();
    names
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("a number: {value}"))
}

#[test]
fn the_components_are_a_list_and_the_tables_and_figures_are_there() {
    let folder = recording();
    wiperlab(folder.path(), &["trace.csv", "--window", "0.05..0.20", "--band", "50..2000"]).success();
    let list = components(folder.path());
    assert_eq!(list.len(), 2, "{list:?}");
    for (component, hz) in list.iter().zip([78.4, 900.0]) {
        assert!((number(&component["frequency_hz"]) - hz).abs() < 0.05, "{component}");
        assert_eq!(
            (&component["verdict"], &component["estimator"]),
            (&"clear".into(), &"least-squares".into())
        );
        assert!(
            component["exposure_passes"].is_null() && component["range_hz"].is_null(),
            "neither known nor drifting: {component}"
        );
        let mut keys: Vec<&str> = component.as_object().unwrap().keys().map(String::as_str).collect();
        let mut expected = KEYS.to_vec();
        keys.sort_unstable();
        expected.sort_unstable();
        assert_eq!(keys, expected);
    }
    assert_eq!(
        written(folder.path()),
        [
            ".wiperlab.json",
            "components.json",
            "history.svg",
            "paper",
            "ridge.csv",
            "ring-down.svg",
            "spectrogram.svg",
            "spectrum.csv",
            "spectrum.json",
            "spectrum.svg"
        ]
    );
    let figure = read(folder.path(), "spectrum.svg");
    assert!(figure.starts_with("<svg "));
    let named = figure.lines().filter_map(|line| line.strip_suffix(") Hz")?.split_once('('));
    // (the heading names them too, in a sentence)
    let named_hz: Vec<f64> = named.filter_map(|(hz, _deviation)| hz.parse().ok()).collect();
    assert_eq!(named_hz.len(), 2, "{named_hz:?}");
    assert!((named_hz[0] - 78.4).abs() < 1e-3 && (named_hz[1] - 900.0).abs() < 1e-3, "{named_hz:?}");
}

#[test]
fn the_tables_have_a_header_and_as_many_cells_in_every_row() {
    let folder = recording();
    wiperlab(folder.path(), &["trace.csv", "--window", "0.05..0.20"]).success();
    // 750 frames, padded eight times to 8,192 values
    for (name, header, rows) in
        [("spectrum.csv", SPECTRUM_HEADER, Some(4097)), ("ridge.csv", RIDGE_HEADER, None)]
    {
        let text = read(folder.path(), name);
        let body = text.strip_prefix(header).unwrap_or_else(|| panic!("{name}: {text:.200}"));
        assert!(body.lines().all(|row| row.split(',').count() == header.split(',').count()), "{name}");
        assert!(
            body.lines()
                .flat_map(|row| row.split(','))
                .all(|cell| cell.is_empty() || cell.parse::<f64>().is_ok_and(f64::is_finite)),
            "{name}"
        );
        assert!(
            rows.map_or(body.lines().count() > 1, |rows| body.lines().count() == rows),
            "{name}: {} rows",
            body.lines().count()
        );
    }
    let top = |line: &&str| line.split(',').nth(1).unwrap().parse::<f64>().unwrap();
    let text = read(folder.path(), "spectrum.csv");
    let highest = text.lines().skip(1).max_by(|a, b| top(a).total_cmp(&top(b))).unwrap();
    assert!((highest.split(',').next().unwrap().parse::<f64>().unwrap() - 78.4).abs() < 0.7, "{highest}");
}

#[test]
fn the_trend_that_is_asked_for_is_removed_and_written_down() {
    let folder = recording();
    for (asked, found) in [
        ("auto", "cubic"),
        ("polynomial:5", "polynomial:5"),
        ("high-pass:40", "high-pass:40"),
        ("none", "none"),
    ] {
        wiperlab(folder.path(), &["trace.csv", "--window", "0.05..0.20", "--detrend", asked]).success();
        let description = json(folder.path(), "spectrum.json");
        assert_eq!(description["detrend"], found);
        assert_eq!(description["frames"], 750);
    }
}

#[test]
fn exposure_and_the_fastest_oscillation_decide_on_verdicts() {
    let folder = recording();
    let of_900 = |arguments: &[&str]| {
        wiperlab(folder.path(), &[&["trace.csv", "--window", "0.05..0.20"], arguments].concat()).success();
        components(folder.path()).into_iter().find(|c| number(&c["frequency_hz"]) > 800.0).unwrap()
    };
    let blurred = of_900(&["--exposure-s", "0.0005"]);
    assert_eq!(blurred["verdict"], "attenuated");
    assert!(
        (number(&blurred["exposure_passes"]) - 0.6986).abs() < 1e-3,
        "sin(0.45 pi) / (0.45 pi): {blurred}"
    );
    assert_eq!(json(folder.path(), "spectrum.json")["exposure_s"], 0.0005);
    let suspected = of_900(&["--fastest-hz", "4200"]);
    assert_eq!(suspected["verdict"], "alias-suspected");
    assert_eq!(suspected["folded_from"].as_array().unwrap().len(), 1);
    assert!((number(&suspected["folded_from"][0]["frequency_hz"]) - 4100.0).abs() < 0.1, "{suspected}");
    assert!(
        suspected["reasons"][0]["words"]
            .as_str()
            .unwrap()
            .starts_with("at 5000 frames/s it may as well be 410"),
        "{suspected}"
    );
}

#[test]
fn the_window_after_the_flip_of_the_bundled_twin_has_its_ring_down_and_its_cycle() {
    let folder = tempfile::tempdir().unwrap();
    let twin = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/actual-blade-twin");
    wiperlab(folder.path(), &[twin.to_str().unwrap(), "--window", "after"]).success();
    let description = json(folder.path(), "spectrum.json");
    assert_eq!((&description["window"], &description["synthetic"]), (&"after".into(), &true.into()));
    assert_eq!(description["exposure_s"], 5e-5, "as recording.toml says");
    let windows = description["windows"].as_array().unwrap();
    assert_eq!(
        windows.iter().map(|w| w["name"].as_str().unwrap()).collect::<Vec<_>>(),
        ["before", "stick", "flip", "after"]
    );
    assert_eq!(description["from_s"], windows[3]["from_s"]);
    let list = components(folder.path());
    assert!((70.0..80.0).contains(&number(&list[0]["frequency_hz"])), "the ring-down: {}", list[0]);
    let drifting = list.iter().filter(|c| !c["range_hz"].is_null() && c["verdict"] == "clear");
    let drifting = drifting.collect::<Vec<_>>();
    assert_eq!(drifting.len(), 1, "{list:?}");
    let [low, mean, high] = [
        &drifting[0]["range_hz"]["low_hz"],
        &drifting[0]["frequency_hz"],
        &drifting[0]["range_hz"]["high_hz"],
    ]
    .map(number);
    assert!(600.0 < low && low < mean && mean < high && high < 1000.0, "{}", drifting[0]);
}

#[test]
fn a_simulated_trace_is_seen_as_the_recording_it_is_held_against() {
    let folder = recording();
    trace(&folder.path().join("fine"), 20_000.0, 6000, |t| 0.02 - 0.01 * (TAU * 1.5 * t).cos());
    wiperlab(
        folder.path(),
        &["fine/trace.csv", "--like", "trace.csv", "--exposure-s", "0.0002", "--band", "50..2000"],
    )
    .success();
    let (seen, measured) = (components(folder.path()), json(folder.path(), "components-like.json"));
    let amplitude = |list: &[Value], hz: f64| {
        let near = list
            .iter()
            .find(|c| (number(&c["frequency_hz"]) - hz).abs() < 0.2)
            .unwrap_or_else(|| panic!("{hz} Hz in {list:?}"));
        [number(&near["amplitude_m"]), number(&near["amplitude_sd_m"])]
    };
    let measured = measured["components"].as_array().unwrap();
    for hz in [78.4, 900.0] {
        // the mean over an exposure of 0.2 ms
        let passes = (TAU / 2.0 * hz * 2e-4).sin() / (TAU / 2.0 * hz * 2e-4);
        let ([seen_m, sd_m], [measured_m, _]) = (amplitude(&seen, hz), amplitude(measured, hz));
        assert!((seen_m - passes * measured_m).abs() < 3.0 * sd_m, "{hz} Hz: {seen_m} of {measured_m}");
        assert!(sd_m < 0.02 * seen_m, "{hz} Hz: {sd_m}");
    }
    assert_eq!(json(folder.path(), "spectrum.json")["frame_rate_hz"], 5000.0);
    // the figure names the components of the recording with their deviations, beside those of the trace
    let drawn = read(folder.path(), "comparison.svg");
    assert!(drawn.contains("measured \u{b1} 2 sd") && drawn.contains("model \u{b1} 2 sd"));
    assert!(drawn.matches(") Hz\n").count() >= 2, "a deviation stands behind each frequency");
}

#[test]
fn a_serious_finding_on_the_window_puts_every_component_in_doubt() {
    let folder = recording();
    let text = std::fs::read_to_string(folder.path().join("trace.csv")).unwrap();
    // the tip keeps its position for four frames out of ten in the second half
    let mut held = String::new();
    let mut tip = "";
    for (row, line) in text.lines().enumerate() {
        let cells: Vec<&str> = line.split(',').collect();
        if row < 750 || row % 10 >= 4 {
            tip = cells[1];
        }
        writeln!(held, "{},{tip},{}", cells[0], cells[2..].join(",")).unwrap();
    }
    std::fs::write(folder.path().join("trace.csv"), held).unwrap();
    let verdicts = |window: &str| {
        let said = wiperlab(folder.path(), &[".", "--window", window, "--force"]).success();
        let said = String::from_utf8(said.get_output().stdout.clone()).unwrap();
        let findings = json(folder.path(), "spectrum.json")["findings"].clone();
        let found = components(folder.path());
        let clear = found.iter().filter(|c| c["verdict"] == "clear").count();
        (said, findings, clear, found)
    };
    let (said, findings, clear, _) = verdicts("0..0.14");
    assert!(!said.contains("serious") && findings.as_array().unwrap().is_empty() && clear >= 1, "{said}");
    let (said, findings, clear, found) = verdicts("0.16..0.3");
    assert!(said.contains("serious: tip: ") && said.contains("repeat the last position exactly"), "{said}");
    assert_eq!(findings[0]["check"], "held-points");
    let doubt = "the recording has the serious finding `held-points` in this window";
    let is_doubted =
        |c: &Value| c["reasons"].as_array().unwrap().iter().any(|reason| reason["words"] == doubt);
    assert!(clear == 0 && !found.is_empty() && found.iter().all(is_doubted), "{found:?}");
}

#[test]
fn bad_input_is_refused_with_code_2_and_writes_nothing() {
    let folder = recording();
    trace(&folder.path().join("fast"), 10_000.0, 3000, even);
    let refusals: [(&[&str], &str); 18] = [
        (&["--channel", "head_drop"], "--channel: unknown channel `head_drop`; did you mean `head-drop`?"),
        (&["--window", "0.1"], "--window: window `0.1`: found `0.1`"),
        (&["--window", "release..release+0.1"], "the head does not turn in it"),
        (&["--window", "after"], "the head does not turn in it"),
        (&["--window", "0.2..0.4"], "choose a window inside it"),
        (&["--detrend", "square"], "--detrend: unknown detrending `square`"),
        (&["--detrend", "polynomial:24"], "--detrend: unknown detrending `polynomial:24`"),
        (&["--detrend", "high-pass:-5"], "--detrend: unknown detrending `high-pass:-5`"),
        (&["--detrend", "high-pass:400"], "`high-pass:400` on a record of 0.300 s"),
        (&["--band", "100..60"], "--band: found `100..60`"),
        (&["--band", "3000..4000"], "band 3000..4000 Hz"),
        (&["--exposure-s", "0"], "--exposure-s: found 0"),
        (&["--exposure-s", "NaN"], "--exposure-s: found NaN"),
        (&["--fastest-hz", "0"], "--fastest-hz: found 0"),
        (&["--fastest-hz", "inf"], "--fastest-hz: found inf"),
        (&["--max-components", "0"], "'0' for '--max-components <N>'"),
        (&["--like", "nowhere"], "nowhere"),
        (
            &["--like", "fast/trace.csv"],
            "found 5000 samples/s, expected at least 40000 for a camera of 10000 frames/s",
        ),
    ];
    for (arguments, message) in refusals {
        let output =
            wiperlab(folder.path(), &[&["trace.csv"], arguments].concat()).code(2).get_output().clone();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert!(stderr.contains(message), "{arguments:?}: {stderr}");
        assert!(!folder.path().join("out").exists(), "{arguments:?}");
    }
}
