//! One motion written the way every tracking program writes it: what is read back has to be that motion.
//!
//! The layouts follow the programs' sources and documentation; all numbers are made up.

#![allow(dead_code)] // each test program uses a part

use std::fmt::Write;
use wiperlab::import::source::{CompanionFile, ImportSource};
use wiperlab::import::{ColumnMap, CoordinateScale, ImportOptions, TimeColumn};
use wiperlab::recording::files::YAxis;

/// Frames of two points: tip x and y, head x and y, `None` where a point was lost.
#[derive(Debug, Clone)]
pub struct Motion {
    pub rate_hz: f64,
    pub frames: Vec<[Option<f64>; 4]>,
}

/// How a program writes a motion.
pub struct Exporter {
    /// Format that must be detected.
    pub format: &'static str,
    /// What is special in it.
    pub variant: &'static str,
    pub file: &'static str,
    pub write: fn(&Motion) -> String,
    /// Its companion files.
    pub companions: fn(&Motion) -> Vec<(&'static str, String)>,
    pub options: fn(&mut ImportOptions),
    /// Points that it holds: 2, or 1 for the tip alone.
    pub points: usize,
    /// Whether the rows carry no frame and no time, so that a lost row cannot be noticed.
    pub rows_are_frames: bool,
}

impl Exporter {
    pub fn source(&self, motion: &Motion) -> ImportSource {
        let companions = (self.companions)(motion)
            .into_iter()
            .map(|(name, text)| CompanionFile { name: name.to_owned(), bytes: text.into_bytes() });
        ImportSource {
            name: self.file.to_owned(),
            bytes: (self.write)(motion).into_bytes(),
            companions: companions.collect(),
        }
    }

    /// Everything that the user has to say; coordinates count as metres with y upwards.
    pub fn options(&self, motion: &Motion) -> ImportOptions {
        let mut options = ImportOptions {
            name: "made".to_owned(),
            frame_rate_hz: Some(motion.rate_hz),
            scale: Some(CoordinateScale::Unit(1.0)),
            y_axis: Some(YAxis::Up),
            tip: Some("tip".to_owned()),
            head: (self.points == 2).then(|| "head".to_owned()),
            ..ImportOptions::default()
        };
        (self.options)(&mut options);
        options
    }
}

fn nothing(_: &Motion) -> Vec<(&'static str, String)> {
    vec![]
}

fn as_they_are(_: &mut ImportOptions) {}

fn by_id(options: &mut ImportOptions) {
    (options.tip, options.head) = (Some("0".to_owned()), Some("1".to_owned()));
}

fn frames_in_time(options: &mut ImportOptions) {
    options.time = Some(TimeColumn::Frames);
}

fn plain_columns(options: &mut ImportOptions) {
    (options.tip, options.head) = (None, None);
    options.columns = Some(ColumnMap::parse("time=1,tip-x=2,tip-y=3,head-x=4,head-y=5").unwrap());
}

/// A number, or a word for none.
fn cell(value: Option<f64>, missing: &str) -> String {
    value.map_or_else(|| missing.to_owned(), |v| v.to_string())
}

fn time(motion: &Motion, frame: usize) -> f64 {
    (frame as f64 / motion.rate_hz * 1e6).round() / 1e6
}

/// A row a frame: header, then cells joined.
fn wide(
    motion: &Motion,
    header: &str,
    delimiter: &str,
    missing: &str,
    first: impl Fn(usize) -> String,
) -> String {
    let mut text = header.to_owned();
    for (frame, values) in motion.frames.iter().enumerate() {
        let cells: Vec<String> =
            [first(frame)].into_iter().chain(values.iter().map(|v| cell(*v, missing))).collect();
        let _ = writeln!(text, "{}", cells.join(delimiter));
    }
    text
}

fn tracker(motion: &Motion) -> String {
    wide(motion, "#multi:\n\ttip\t\thead\t\t\nt\tx\ty\tx\ty\t\n", "\t", "", |frame| {
        time(motion, frame).to_string()
    })
}

fn tracker_norwegian(motion: &Motion) -> String {
    tracker(motion).replace('.', ",").replace('-', "\u{2212}")
}

/// Older versions and copied tables leave out rows without a mark; here both points must have one.
fn tracker_copied(motion: &Motion) -> String {
    let mut text =
        "tip\t\t\thead\t\n t\tx\ty\tx\ty\n".replace("tip\t\t\thead\t", "\ttip\t\thead\t").replace(" t", "t");
    for (frame, v) in motion.frames.iter().enumerate().filter(|(_, v)| v.iter().any(Option::is_some)) {
        let _ = writeln!(
            text,
            "{}\t{}\t{}\t{}\t{}",
            time(motion, frame),
            cell(v[0], ""),
            cell(v[1], ""),
            cell(v[2], ""),
            cell(v[3], "")
        );
    }
    text
}

fn kinovea(motion: &Motion) -> String {
    let mut text = "\"Time\",\"tip/0/X\",\"tip/0/Y\",\"head/0/X\",\"head/0/Y\"\n".to_owned();
    for (frame, values) in motion.frames.iter().enumerate() {
        let quoted = |v: &Option<f64>| v.map_or_else(String::new, |v| format!("\"{v}\""));
        let _ = writeln!(text, "\"{frame}\",{}", values.iter().map(quoted).collect::<Vec<_>>().join(","));
    }
    text
}

fn kinovea_text(motion: &Motion) -> String {
    let mut text = "#Kinovea Trajectory data export\n#T X Y\n\n".to_owned();
    for (name, [x, y]) in [("tip", [0, 1]), ("head", [2, 3])] {
        let _ = writeln!(text, "# {name}");
        for (frame, v) in motion.frames.iter().enumerate() {
            if let (Some(x), Some(y)) = (v[x], v[y]) {
                let _ = writeln!(text, "{} {x} {y} ", time(motion, frame));
            }
        }
        text.push('\n');
    }
    text
}

fn deeplabcut(motion: &Motion) -> String {
    let mut text = "scorer,net,net,net,net,net,net\nbodyparts,tip,tip,tip,head,head,head\ncoords,x,y,likelihood,x,y,likelihood\n".to_owned();
    for (frame, v) in motion.frames.iter().enumerate() {
        let _ = writeln!(
            text,
            "{frame},{},{},0.99,{},{},0.98",
            cell(v[0], ""),
            cell(v[1], ""),
            cell(v[2], ""),
            cell(v[3], "")
        );
    }
    text
}

fn deeplabcut_animals(motion: &Motion) -> String {
    deeplabcut(motion).replace("bodyparts,", "individuals,blade,blade,blade,blade,blade,blade\nbodyparts,")
}

fn sleap(motion: &Motion) -> String {
    let mut text =
        "track,frame_idx,instance.score,tip.x,tip.y,tip.score,head.x,head.y,head.score\n".to_owned();
    for (frame, v) in motion.frames.iter().enumerate().filter(|(_, v)| v.iter().any(Option::is_some)) {
        let _ = writeln!(
            text,
            "blade,{frame},0.95,{},{},0.9,{},{},0.8",
            cell(v[0], ""),
            cell(v[1], ""),
            cell(v[2], ""),
            cell(v[3], "")
        );
    }
    text
}

/// Rows of a point in each frame, written by `row(point, frame, x, y)`.
fn long(motion: &Motion, header: &str, row: impl Fn(usize, usize, f64, f64) -> String) -> String {
    let mut text = header.to_owned();
    for (frame, v) in motion.frames.iter().enumerate() {
        for point in [0, 1] {
            if let (Some(x), Some(y)) = (v[2 * point], v[2 * point + 1]) {
                text.push_str(&row(point, frame, x, y));
            }
        }
    }
    text
}

fn trackmate(motion: &Motion) -> String {
    let keys =
        "LABEL,ID,TRACK_ID,QUALITY,POSITION_X,POSITION_Y,POSITION_Z,POSITION_T,FRAME,RADIUS,VISIBILITY\n";
    let header = format!(
        "{keys}Label,Spot ID,Track \
         ID,Quality,X,Y,Z,T,Frame,Radius,Visibility\n,,,(quality),(pixel),(pixel),(pixel),(frame),,(pixel),\n"
    );
    long(motion, &header, |point, frame, x, y| {
        let id = 2 * frame + point;
        format!("ID{id},{id},{point},5.1,{x},{y},0.0,{frame}.0,{frame},2.5,1\n")
    })
}

fn trackmate_simple(motion: &Motion) -> String {
    let mut text = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n".to_owned();
    let _ = writeln!(
        text,
        "<Tracks nTracks=\"2\" spaceUnits=\"pixel\" frameInterval=\"{}\" timeUnits=\"sec\" \
         from=\"TrackMate\">",
        1.0 / motion.rate_hz
    );
    for point in [0, 1] {
        text.push_str("  <particle nSpots=\"0\">\n");
        for (frame, v) in motion.frames.iter().enumerate() {
            if let (Some(x), Some(y)) = (v[2 * point], v[2 * point + 1]) {
                let _ = writeln!(text, "    <detection t=\"{frame}\" x=\"{x}\" y=\"{y}\" z=\"0.0\" />");
            }
        }
        text.push_str("  </particle>\n");
    }
    text + "</Tracks>\n"
}

fn dltdv(motion: &Motion) -> String {
    let mut text = "tip_cam1_U,tip_cam1_V,head_cam1_U,head_cam1_V\n".to_owned();
    for v in &motion.frames {
        let _ = writeln!(text, "{}", v.iter().map(|v| cell(*v, "NaN")).collect::<Vec<_>>().join(","));
    }
    text
}

fn dltdv_sparse(motion: &Motion) -> String {
    let values: usize = motion.frames.iter().flatten().flatten().count();
    let mut text = format!("Sparse format camera coordinates file\n{}\t4\t{values}\n", motion.frames.len());
    for column in 0..4 {
        for (row, v) in motion.frames.iter().enumerate() {
            if let Some(value) = v[column] {
                let _ = writeln!(text, "{}\t{}\t{value}", row + 1, column + 1);
            }
        }
    }
    text
}

fn point_names(_: &Motion) -> Vec<(&'static str, String)> {
    vec![("runpointNames.tsv", "PointNames_to_go_with_DLTdv8a_sparsesave_arrays\ntip\nhead\n".to_owned())]
}

fn dice(motion: &Motion) -> String {
    let header = "*** Digital Image Correlation Engine (DICe)\n*** y positive \
        down\nFRAME,COORDINATE_X,COORDINATE_Y,DISPLACEMENT_X,DISPLACEMENT_Y,ROTATION_Z,SIGMA,GAMMA,BETA\n";
    let mut text = header.to_owned();
    for (frame, v) in motion.frames.iter().enumerate() {
        match (v[0], v[1]) {
            (Some(x), Some(y)) => {
                let _ = writeln!(text, "{frame},0,0,{x},{y},0,0.01,0.001,0.002");
            }
            _ => {
                let _ = writeln!(text, "{frame},0,0,0,0,0,-1,-1,-1");
            }
        }
    }
    text
}

fn imagej(motion: &Motion) -> String {
    let mut text = " ,X,Y,Slice\n".to_owned();
    for (frame, v) in motion.frames.iter().enumerate() {
        if let (Some(x), Some(y)) = (v[0], v[1]) {
            let _ = writeln!(text, "{},{x},{y},{}", frame + 1, frame + 1);
        }
    }
    text
}

fn mtrackj(motion: &Motion) -> String {
    let header = "Nr\tTID\tPID\tx [pixel]\ty [pixel]\tt [sec]\tI [val]\tLen [pixel]\n";
    long(motion, header, |point, frame, x, y| {
        format!("1\t{point}\t{}\t{x}\t{y}\t{}\t34\t0\n", frame + 1, time(motion, frame))
    })
}

fn dippmotion(motion: &Motion) -> String {
    let header = "DIPP-MOTION \
        XYGraphData\nInfo\n\u{6a2a}\u{8ef8}\u{5358}\u{4f4d},m\n\u{7e26}\u{8ef8}\u{5358}\u{4f4d},m\n\u{7cfb}\u{5217}\u{540d},[1]tip,[2]head\n\u{6642}\u{9593},tip(X),tip(Y),head(X),head(Y)\n";
    wide(motion, header, ",", "*", |frame| time(motion, frame).to_string())
}

fn framedias(motion: &Motion) -> String {
    let mut text = format!("{},2,{:.6}\n", motion.frames.len(), 1.0 / motion.rate_hz);
    for v in &motion.frames {
        let _ = writeln!(text, "{}", v.iter().map(|v| cell(*v, "0.000000")).collect::<Vec<_>>().join(","));
    }
    text
}

fn motion_analysis(motion: &Motion) -> String {
    let mut text = "frame_no,time,tip-x,tip-y,head-x,head-y\n".to_owned();
    for (frame, v) in motion.frames.iter().enumerate() {
        let cells: Vec<String> = v.iter().map(|v| cell(*v, "")).collect();
        let _ = writeln!(text, "{frame}.0000,{:.4},{}", frame as f64 / motion.rate_hz, cells.join(","));
    }
    text
}

fn trackpy(motion: &Motion) -> String {
    let header = ",y,x,mass,size,ecc,signal,raw_mass,ep,frame,particle\n";
    long(motion, header, |point, frame, x, y| {
        format!("{},{y},{x},512.3,1.9,0.1,20.1,900,0.03,{frame},{point}\n", 2 * frame + point)
    })
}

fn trc(motion: &Motion) -> String {
    let rate = motion.rate_hz;
    let frames = motion.frames.len();
    let mut text = format!(
        "PathFileType\t4\t(X/Y/Z)\trun.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames\n{rate}\t{rate}\t{frames}\t2\tm\t{rate}\t1\t{frames}\nFrame#\tTime\ttip\t\t\thead\t\t\n\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n\n"
    );
    for (frame, v) in motion.frames.iter().enumerate() {
        let z = |point: usize| if v[2 * point].is_some() { "0.5" } else { "" };
        let c: Vec<String> = v.iter().map(|v| cell(*v, "")).collect();
        let _ = writeln!(
            text,
            "{}\t{}\t{}\t{}\t{}\t{}\t{}\t{}",
            frame + 1,
            time(motion, frame),
            c[0],
            c[1],
            z(0),
            c[2],
            c[3],
            z(1)
        );
    }
    text
}

fn plain(motion: &Motion) -> String {
    wide(motion, "frame,tip_x,tip_y,head_x,head_y\n", ",", "", |frame| frame.to_string())
}

fn plain_semicolon(motion: &Motion) -> String {
    wide(motion, "time_s;tip_x;tip_y;head_x;head_y\n", ";", "NaN", |frame| time(motion, frame).to_string())
        .replace('.', ",")
}

fn generic(motion: &Motion) -> String {
    wide(motion, "", " ", "NaN", |frame| time(motion, frame).to_string())
}

/// Every layout that is read, in no order.
pub fn exporters() -> Vec<Exporter> {
    let two = |format, variant, file, write| Exporter {
        format,
        variant,
        file,
        write,
        companions: nothing,
        options: as_they_are,
        points: 2,
        rows_are_frames: false,
    };
    vec![
        two("tracker", "multi", "run.txt", tracker as fn(&Motion) -> String),
        two("tracker", "decimal comma and typographic minus", "run.txt", tracker_norwegian),
        two("tracker", "rows left out", "run.txt", tracker_copied),
        Exporter { options: frames_in_time, ..two("kinovea", "csv", "run.csv", kinovea) },
        Exporter {
            options: |o| o.time = Some(TimeColumn::Real),
            ..two("kinovea", "text", "run.txt", kinovea_text)
        },
        two("deeplabcut", "single", "run.csv", deeplabcut),
        two("deeplabcut", "animals", "run.csv", deeplabcut_animals),
        two("sleap", "analysis", "run.csv", sleap),
        Exporter { options: by_id, ..two("trackmate", "spots", "run.csv", trackmate) },
        Exporter {
            options: |o| (o.tip, o.head) = (Some("track1".to_owned()), Some("track2".to_owned())),
            ..two("trackmate", "simple xml", "run.xml", trackmate_simple)
        },
        Exporter { rows_are_frames: true, ..two("dltdv", "flat", "runxypts.csv", dltdv) },
        Exporter { companions: point_names, ..two("dltdv", "sparse", "runxypts.tsv", dltdv_sparse) },
        Exporter {
            points: 1,
            options: |o| o.tip = Some("DICe_solution_0".to_owned()),
            ..two("dice", "tracking", "DICe_solution_0.txt", dice)
        },
        Exporter {
            points: 1,
            options: |o| o.tip = Some("run".to_owned()),
            ..two("imagej", "results", "run.csv", imagej)
        },
        Exporter { options: by_id, ..two("imagej", "mtrackj", "run.txt", mtrackj) },
        two("dippmotion", "graph", "run.csv", dippmotion),
        Exporter {
            options: |o| (o.tip, o.head) = (Some("point1".to_owned()), Some("point2".to_owned())),
            rows_are_frames: true,
            ..two("framedias", "rd", "run.rd", framedias)
        },
        two("motion-analysis-2d", "4 decimals", "run.csv", motion_analysis),
        Exporter { options: by_id, ..two("trackpy", "csv", "run.csv", trackpy) },
        two("trc", "tab", "run.trc", trc),
        two("plain", "comma", "run.csv", plain),
        two("plain", "semicolon, decimal comma", "run.csv", plain_semicolon),
        Exporter { options: plain_columns, ..two("generic", "no header", "run.dat", generic) },
    ]
}
