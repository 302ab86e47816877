//! The inputs, written to a folder piece by piece.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::os::unix::fs::symlink;
use std::os::unix::net::UnixListener;
use std::path::Path;
use std::process::Command;

/// A file, and the command that reads it.
pub struct Input {
    pub name: String,
    pub arguments: Vec<String>,
    /// The file that memory is measured by.
    pub file: Option<String>,
    /// Codes that it may end with.
    pub codes: &'static [i32],
}

/// What is wrong with a file ends with 2.
const REFUSED: &[i32] = &[2];
const ANY: &[i32] = &[0, 2, 3];
const HEADER: &str = "time_s,tip_x_m,tip_y_m,head_x_m,head_y_m\n";
const SCENE: &str = include_str!("../../data/scenes/light-blade-strokes.toml");
const JOB: &str = include_str!("../../fits/published-experiment/job.toml");
const STUDY: &str = include_str!("../../data/sweeps/flip.toml");
const TWIN: &str = include_str!("../../data/twins/actual-blade.toml");
const RESULT: &str = include_str!("../../fits/published-experiment/result.json");

/// Writes all inputs into a folder.
pub fn inputs(folder: &Path) -> Vec<Input> {
    fs::create_dir_all(folder.join("data/scenes")).unwrap();
    for scene in ["actual-blade", "published-experiment", "published-simulation"] {
        let from = format!("{}/data/scenes/{scene}.toml", env!("CARGO_MANIFEST_DIR"));
        fs::copy(from, folder.join(format!("data/scenes/{scene}.toml"))).unwrap();
    }
    let mut all = Vec::new();
    all.extend(traces(folder));
    all.extend(not_files(folder));
    all.extend(scenes(folder));
    all.extend(jobs(folder));
    all.extend(studies_and_twins(folder));
    all.extend(results_and_journals(folder));
    all.extend(options());
    all
}

fn input(name: &str, command: &str, file: &str, codes: &'static [i32]) -> Input {
    let arguments = command.split(' ').map(|word| word.replace("FILE", file)).collect();
    Input { name: name.to_owned(), arguments, file: Some(file.to_owned()), codes }
}

/// A piece of a file, so many times.
fn repeated(folder: &Path, file: &str, start: &str, piece: impl Fn(usize) -> String, times: usize) {
    let path = folder.join(file);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    let mut to = BufWriter::new(File::create(path).unwrap());
    to.write_all(start.as_bytes()).unwrap();
    (0..times).for_each(|i| to.write_all(piece(i).as_bytes()).unwrap());
    to.into_inner().unwrap();
}

fn traces(folder: &Path) -> Vec<Input> {
    let row = |i: usize| format!("{},{}e-4,0.001,0.002,-0.003\n", i as f64 / 1000.0, i % 97);
    repeated(folder, "rows.csv", HEADER, row, 1_000_000);
    repeated(folder, "empty-rows.csv", HEADER, |i| format!("{i},,,,\n"), 300_000);
    repeated(folder, "one-line.csv", HEADER, |_| "1,".to_owned(), 10_000_000);
    repeated(folder, "no-header.csv", "", |_| "1,".to_owned(), 10_000_000);
    repeated(folder, "blank.csv", HEADER, |_| "\n".to_owned(), 20_000_000);
    repeated(folder, "zeros.csv", "", |_| "\0".to_owned(), 20_000_000);
    repeated(folder, "long-cell.csv", &format!("{HEADER}0,"), |_| "9".to_owned(), 20_000_000);
    repeated(folder, "backwards.csv", HEADER, |i| format!("{},1,1,1,1\n", 1_000_000 - i), 1_000_000);
    repeated(folder, "gap.csv", HEADER, |i| format!("{},1,1,1,1\n", [0.0, 1e-4, 2e-4, 900.0][i]), 4);
    repeated(folder, "century.csv", HEADER, |i| format!("{},1,1,1,1\n", [0.0, 1e-4, 2e-4, 3e9][i]), 4);
    repeated(folder, "huge-numbers.csv", HEADER, |i| format!("{i},1e308,-1e308,1e308,-1e308\n"), 2000);
    repeated(folder, "invalid.csv", HEADER, |_| "\u{feff}".to_owned(), 1_000_000);
    let files =
        ["one-line", "no-header", "blank", "zeros", "long-cell", "backwards", "gap", "century", "invalid"];
    let mut all: Vec<Input> = files
        .iter()
        .map(|file| input(&format!("trace: {file}"), "inspect FILE", &format!("{file}.csv"), REFUSED))
        .collect();
    for file in ["one-line", "no-header", "zeros", "long-cell"] {
        all.push(input(&format!("import: {file}"), "import FILE --out new", &format!("{file}.csv"), REFUSED));
    }
    all.push(input("trace: empty rows", "inspect FILE", "empty-rows.csv", ANY));
    all.push(input("trace: numbers near the largest", "inspect FILE", "huge-numbers.csv", ANY));
    all.push(input(
        "trace: a million rows, refused at once by its size",
        "inspect FILE --max-file-size 1MB",
        "rows.csv",
        REFUSED,
    ));
    all
}

fn not_files(folder: &Path) -> Vec<Input> {
    assert!(Command::new("mkfifo").arg(folder.join("pipe")).status().unwrap().success());
    symlink("/dev/zero", folder.join("zero")).unwrap();
    symlink("/dev/urandom", folder.join("random")).unwrap();
    symlink("loop", folder.join("loop")).unwrap();
    drop(UnixListener::bind(folder.join("socket")).unwrap()); // the name stays
    File::create(folder.join("sparse")).unwrap().set_len(5_000_000_000).unwrap();
    let mut all = Vec::new();
    for file in ["pipe", "zero", "random", "socket", "sparse", "loop", "data"] {
        for command in ["inspect FILE", "import FILE --out new", "modes FILE"] {
            let name = format!("{}: {file}", command.split(' ').next().unwrap());
            all.push(Input { file: None, ..input(&name, command, file, REFUSED) });
        }
    }
    all
}

fn edited(folder: &Path, file: &str, text: &str, old: &str, new: &str) {
    assert!(text.contains(old), "{old}");
    let path = folder.join(file);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, text.replacen(old, new, 1)).unwrap();
}

fn scenes(folder: &Path) -> Vec<Input> {
    let cases: [(&str, &str, &str, &'static [i32]); 9] = [
        (
            "a run of 1e9 s",
            "stop_s = 3.4\nsample_rate_hz = 10000.0",
            "stop_s = 1e9\nsample_rate_hz = 0.01",
            REFUSED,
        ),
        ("1e9 samples a second", "sample_rate_hz = 10000.0", "sample_rate_hz = 1e9", REFUSED),
        ("1e300 s", "stop_s = 3.4", "stop_s = 1e300", REFUSED),
        ("damping ratio of 1e6", "neck_damping_ratio = 0.045", "neck_damping_ratio = 1e6", ANY),
        ("lip of 1e-30 kg", "lip_mass_kg = 3.297e-05", "lip_mass_kg = 1e-30", ANY),
        ("stiffness of 1e300", "neck_natural_frequency_hz = 519.0", "neck_natural_frequency_hz = 1e150", ANY),
        ("head at 1e6 Hz", "frequency_hz = 0.915", "frequency_hz = 1e6", ANY),
        ("preload of 1e9 N", "preload_force_n = 0.2813", "preload_force_n = 1e9", ANY),
        ("friction of 1e9", "a = 0.229", "a = 1e9", ANY),
    ];
    let mut all = Vec::new();
    for (i, (name, old, new, codes)) in cases.into_iter().enumerate() {
        let file = format!("scene{i}.toml");
        let limited = SCENE.replace("[run]", "[run]\nmost_evaluations = 3000000");
        edited(folder, &file, &limited, old, new);
        all.push(input(&format!("scene: {name}"), "simulate FILE --out new --quiet", &file, codes));
    }
    repeated(folder, "brackets.toml", "a = ", |_| "[".to_owned(), 450_000);
    repeated(folder, "dots.toml", "a", |_| ".a".to_owned(), 200_000);
    repeated(folder, "keys.toml", "", |i| format!("k{i} = 1\n"), 40_000);
    repeated(folder, "tables.toml", "", |_| "[[a]]\n".to_owned(), 60_000);
    repeated(folder, "long.toml", "title = \"", |_| "x".to_owned(), 2_000_000);
    for file in ["brackets", "dots", "keys", "tables", "long"] {
        all.push(input(&format!("toml: {file}"), "modes FILE", &format!("{file}.toml"), REFUSED));
    }
    all
}

fn jobs(folder: &Path) -> Vec<Input> {
    let component = |i: usize| {
        format!(
            "[[component]]\nname = \"n{i}\"\nchannel = \"deflection\"\nwindow = \"..\"\nband_hz = [1.0, 2.0]\n"
        )
    };
    repeated(folder, "fits/a/components.toml", JOB, component, 4000);
    repeated(folder, "fits/a/recordings.toml", JOB, |i| format!("[[recording]]\npath = \"r{i}\"\n"), 14_000);
    edited(folder, "fits/a/particles.toml", JOB, "[search]", "[search]\nparticles = 9000000");
    edited(folder, "fits/a/camera.toml", JOB, "frame_rate_hz = ", "frame_rate_hz = 1e9 # ");
    ["components", "recordings", "particles", "camera"]
        .map(|name| input(&format!("job: {name}"), "fit FILE", &format!("fits/a/{name}.toml"), REFUSED))
        .into()
}

fn studies_and_twins(folder: &Path) -> Vec<Input> {
    edited(folder, "data/sweeps/points.toml", STUDY, "points = 17", "points = 4000000000");
    edited(folder, "data/sweeps/camera.toml", STUDY, "frame_rate_hz = ", "frame_rate_hz = 1e9 # ");
    let map = |i: usize| format!("[[map]]\nname = \"m{i}\"\nkind = \"flip-duration\"\n");
    repeated(folder, "data/sweeps/maps.toml", STUDY, map, 9_000);
    edited(folder, "data/twins/rate.toml", TWIN, "frame_rate_hz = ", "frame_rate_hz = 1e9 # ");
    edited(folder, "data/twins/frames.toml", TWIN, "frame_rate_hz = ", "frame_rate_hz = 1e7 # ");
    let study = |name: &str| {
        input(&format!("study: {name}"), "sweep FILE --out new", &format!("data/sweeps/{name}.toml"), REFUSED)
    };
    let twin = |name: &str| {
        input(&format!("twin: {name}"), "twin FILE --out new", &format!("data/twins/{name}.toml"), REFUSED)
    };
    vec![study("points"), study("camera"), study("maps"), twin("rate"), twin("frames")]
}

fn results_and_journals(folder: &Path) -> Vec<Input> {
    for (name, start) in [("nested", "["), ("values", "{\"status\":[0")] {
        let fit = format!("fits/{name}");
        let piece = if name == "nested" { "[" } else { ",0" };
        repeated(folder, &format!("{fit}/result.json"), start, |_| piece.to_owned(), 5_000_000);
        fs::write(folder.join(fit).join("job.toml"), JOB).unwrap();
    }
    edited(folder, "fits/more/result.json", RESULT, "{", "{\"more\": 1,");
    fs::write(folder.join("fits/more/job.toml"), JOB).unwrap();
    repeated(folder, "braces/shards/0-of-1.jsonl", "", |_| "{".to_owned(), 20_000_000);
    repeated(folder, "lines/shards/0-of-1.jsonl", "", |_| "\n".to_owned(), 20_000_000);
    fs::write(folder.join("data/sweeps/flip.toml"), STUDY).unwrap();
    let report = |name: &str| Input {
        file: Some(format!("fits/{name}/result.json")),
        ..input(&format!("result: {name}"), "report FILE --out new", &format!("fits/{name}"), REFUSED)
    };
    let collect = |name: &str, codes: &'static [i32]| Input {
        file: Some(format!("{name}/shards/0-of-1.jsonl")),
        ..input(&format!("journal: {name}"), "collect FILE --study data/sweeps/flip.toml", name, codes)
    };
    let more = Input { codes: ANY, ..report("more") };
    vec![report("nested"), report("values"), more, collect("braces", &[3]), collect("lines", REFUSED)]
}

fn options() -> Vec<Input> {
    let commands = [
        "modes data/scenes/actual-blade.toml --threads 100000",
        "modes data/scenes/actual-blade.toml --max-file-size 999999999999999TB",
        "import gap.csv --out new --frame-rate-hz 1e300 --scale m --y-axis up",
        "import gap.csv --out new --frame-step 18446744073709551615",
        "spectrum gap.csv --out new --max-components 18446744073709551615",
        "simulate data/scenes/actual-blade.toml --out new --method fixed-step --step 1e-300",
    ];
    commands.map(|command| Input { file: None, ..input(command, command, "", REFUSED) }).into()
}
