//! A table is read as what its program says it is, or refused: never as something else.

use crate::exports::{self, Motion};
use std::path::{Path, PathBuf};
use wiperlab::import::source::{Import, ImportSource};
use wiperlab::import::{ColumnMap, CoordinateScale, ImportOptions, import};
use wiperlab::recording::Recording;
use wiperlab::recording::files::YAxis;
use wiperlab::recording::quality::Severity;

const DICE: &str = "FRAME,COORDINATE_X,COORDINATE_Y,SIGMA,STATUS_FLAG\n0,266,376,0.0015,4\n1,266,376,0.0015,4\n\
    2,266,376,0.0015,4\n";

fn options() -> ImportOptions {
    ImportOptions {
        name: "made".to_owned(),
        frame_rate_hz: Some(1000.0),
        scale: Some(CoordinateScale::Unit(1.0)),
        y_axis: Some(YAxis::Up),
        ..ImportOptions::default()
    }
}

fn columns(text: &str) -> ImportOptions {
    ImportOptions { columns: Some(ColumnMap::parse(text).unwrap()), ..options() }
}

fn tracks(tip: &str, head: &str) -> ImportOptions {
    ImportOptions { tip: Some(tip.to_owned()), head: Some(head.to_owned()), ..options() }
}

fn read(text: &str, options: &ImportOptions) -> Result<Import, String> {
    import(&[ImportSource::without_companions("a.csv", text.as_bytes().to_vec())], options)
        .map_err(|error| error.to_string())
}

fn refused(text: &str, options: &ImportOptions) -> String {
    match read(text, options) {
        Ok(found) => panic!("read as {}:\n{text}", found.report.format),
        Err(error) => error,
    }
}

fn cautions(found: &Import) -> Vec<String> {
    let graver = found.report.findings.iter().filter(|finding| finding.severity > Severity::Note);
    graver.map(|finding| format!("{}: {}", finding.check.name(), finding.to_line())).collect()
}

#[test]
fn a_solution_without_displacements_is_no_motion_for_any_format() {
    let plain = ImportOptions { format: Some("plain".to_owned()), ..options() };
    let dice = ImportOptions { format: Some("dice".to_owned()), ..options() };
    for options in [options(), plain, dice] {
        let says = refused(DICE, &ImportOptions { tip: Some("COORDINATE".to_owned()), ..options });
        assert!(
            says.starts_with(
                "a.csv:1:1: found COORDINATE_X and COORDINATE_Y without DISPLACEMENT_X and DISPLACEMENT_Y"
            ),
            "{says}"
        );
    }
    let named = read(DICE, &columns("frame=FRAME,tip-x=COORDINATE_X,tip-y=COORDINATE_Y")).unwrap();
    assert!(
        cautions(&named)
            .iter()
            .any(|line| line.starts_with("other-table") && line.contains("would be refused without it")),
        "{:?}",
        cautions(&named)
    );
}

/// The positions of a recording that has any, channel by channel.
fn channels(recording: &Recording) -> [&[Option<f64>]; 4] {
    let traces = recording.traces();
    [&traces.tip_x_m, &traces.tip_y_m, &traces.head_x_m, &traces.head_y_m]
}

fn motion() -> Motion {
    let position =
        |frame: u32, channel: u32| Some(f64::from(frame * frame + 7 * channel * frame) / 8.0 + 50.5);
    let frames = (0..12).map(|frame| [0, 1, 2, 3].map(|channel| position(frame, channel))).collect();
    Motion { rate_hz: 1000.0, frames }
}

fn without_column(text: &str, delimiter: char, column: usize) -> String {
    let shorter = |line: &str| {
        let cells = line.split(delimiter).enumerate().filter(|(at, _)| *at != column);
        cells.map(|(_, cell)| cell).collect::<Vec<_>>().join(&delimiter.to_string())
    };
    text.lines().map(|line| shorter(line) + "\n").collect()
}

#[test]
fn a_column_less_gives_no_other_positions_in_any_format() {
    let motion = motion();
    let mut read_otherwise = vec![];
    for exporter in exports::exporters() {
        let (source, options) = (exporter.source(&motion), exporter.options(&motion));
        let Ok(whole) = import(std::slice::from_ref(&source), &options) else {
            panic!("{} {}", exporter.format, exporter.variant)
        };
        let Ok(text) = String::from_utf8(source.bytes.clone()) else { continue };
        let delimiter = ['\t', ';', ',', ' '].into_iter().find(|mark| text.contains(*mark)).unwrap_or(',');
        let most = text.lines().map(|line| line.split(delimiter).count()).max().unwrap_or(0);
        for column in (0..most).filter(|_| !text.starts_with('<')) {
            let bytes = without_column(&text, delimiter, column).into_bytes();
            let found = import(&[ImportSource { bytes, ..source.clone() }], &options);
            let Ok(found) = found else { continue };
            let same = |(less, all): (&[Option<f64>], &[Option<f64>])| {
                less == all || less.iter().all(Option::is_none)
            };
            let pairs = channels(&found.recording).into_iter().zip(channels(&whole.recording));
            if !pairs.into_iter().all(same) && cautions(&found).is_empty() {
                read_otherwise.push(format!("{} {}: {column}", exporter.format, exporter.variant));
            }
        }
    }
    assert_eq!(read_otherwise, [""; 0]);
}

#[test]
fn one_column_is_one_thing() {
    let text = "t,x,y,u,v\n0,1,2,3,4\n0.001,2,3,4,5\n0.002,3,4,5,6\n";
    for (named, keys) in [
        ("time=1,tip-x=2,head-x=2", "tip-x=2 and head-x=2"),
        ("time=1,tip-x=2,tip-y=2", "tip-x=2 and tip-y=2"),
        ("time=1,tip-x=1", "time=1 and tip-x=1"),
        ("time=t,tip-x=x,head-x=x", "tip-x=2 and head-x=2"),
        ("time=1,frame=1,tip-x=2", "time=1 and frame=1"),
    ] {
        let says = refused(text, &columns(named));
        assert!(says.contains(&format!("--columns {keys}: found one column for both")), "{says}");
    }
    assert!(read(text, &columns("time=1,tip-x=2,head-x=4,tip-confidence=5,head-confidence=5")).is_ok());
}

#[test]
fn labels_of_picked_pictures_are_no_time_series() {
    let labels = |frames: &[u32]| {
        let head = "scorer,,,me,me\nbodyparts,,,tip,tip\ncoords,,,x,y\n".to_owned();
        let row = |frame: &u32| format!("labeled-data,run,img{frame:04}.png,{frame}.5,2.5\n");
        head + &frames.iter().map(row).collect::<String>()
    };
    let is_said = |text: &str| {
        cautions(&read(text, &options()).unwrap()).iter().any(|line| line.contains("they are no time series"))
    };
    assert!(is_said(&labels(&[3, 120, 77, 410, 233])));
    assert!(!is_said(&labels(&[3, 4, 5, 6, 8])));
    assert!(!is_said(&labels(&[0, 5, 10, 15])));
    let numbered = |frames: &[u32]| {
        let row = |frame: &u32| format!("{frame},{frame}.5,2.5\n");
        "scorer,me,me\nbodyparts,tip,tip\ncoords,x,y\n".to_owned()
            + &frames.iter().map(row).collect::<String>()
    };
    assert!(is_said(&numbered(&[3, 77, 120, 233, 410])) && !is_said(&numbered(&[3, 4, 5, 6, 8])));
    let sleap = "track,frame_idx,instance.score,tip.x,tip.y,tip.score\nb,3,1,1,2,1\nb,77,1,2,2,1\nb,90,1,2,2,1\n\
        b,410,1,3,3,1\n";
    assert!(is_said(sleap));
}

#[test]
fn what_a_spreadsheet_did_is_named_at_its_place() {
    let table = |cell: &str| format!("frame;tip_x;tip_y\n0;1,5;2,5\n1;{cell};2,6\n2;1,7;2,7\n3;1,8;2,8\n");
    for (cell, words) in [
        ("01.jan", "has made a date of the number"),
        ("Jan 01", "has made a date of the number"),
        ("12.Mai", "has made a date of the number"),
        ("1.5.2024", "has made a date of the number"),
        ("1.234,5", "separators of thousands"),
        ("1.234.567", "separators of thousands"),
        ("#####", "a column that is too narrow"),
        ("#WERT!", "the error of a formula"),
    ] {
        let says = refused(&table(cell), &options());
        assert!(says.starts_with(&format!("a.csv:3:3: column x of tip: found `{cell}`")), "{says}");
        assert!(says.contains(words) && says.contains("import the tracking program's own export"), "{says}");
    }
    let cut = read(&table("1,23E+05"), &options()).unwrap();
    assert!(
        cautions(&cut).iter().any(|line| line.contains("a.csv:3:3: `1,23E+05` has three digits")),
        "{:?}",
        cautions(&cut)
    );
}

#[test]
fn a_row_whose_first_cell_a_spreadsheet_hid_is_no_comment() {
    let rows = |cell: &str| format!("frame,tip_x,tip_y\n0,1.5,2.5\n{cell},1.6,2.6\n2,1.7,2.7\n3,1.8,2.8\n");
    for cell in ["#####", "#REF!", "\"#DIV/0!\""] {
        let says = refused(&rows(cell), &options());
        assert!(says.starts_with("a.csv:3:1: column frame: found `#"), "{says}");
    }
    assert_eq!(read(&rows("# at noon"), &options()).unwrap().recording.grid().frames, 4);
}

#[test]
fn a_clock_for_each_track_is_read() {
    // the head's clock runs 4 frames behind, and ends a row early
    let text = "tip\t\t\thead\t\t\nt\tx\ty\tt\tx\ty\n0\t1\t2\t0.004\t11\t12\n0.001\t2\t3\t0.005\t12\t13\n\
        0.002\t3\t4\t0.006\t13\t14\n0.003\t4\t5\t\t\t\n";
    let found = read(text, &options()).unwrap();
    assert_eq!(found.report.format, "tracker");
    let [tip, _, head, _] = channels(&found.recording);
    let some = |values: &[f64]| values.iter().copied().map(Some).collect::<Vec<_>>();
    assert_eq!(tip, [some(&[1.0, 2.0, 3.0, 4.0]), vec![None; 3]].concat());
    assert_eq!(head, [vec![None; 4], some(&[11.0, 12.0, 13.0])].concat());
    // one clock written twice is one clock, whether its digits are the same or not
    let once = text.replace("\t0.004\t", "\t0\t").replace("\t0.005\t", "\t0.0010\t");
    let once = once.replace("\t0.006\t", "\t0.002\t");
    let found = read(&once, &options()).unwrap();
    assert_eq!((found.recording.grid().frames, channels(&found.recording)[2][2]), (4, Some(13.0)));
    // clocks that share no grid are refused
    let off = text.replace("0.004", "0.0045").replace("0.005", "0.0055").replace("0.006", "0.0065");
    let says = refused(&off, &options());
    assert!(says.contains("a first row 4.500 frames after the other's"), "{says}");
    // a position without its clock is refused at its place
    let lost = text.replace("0.005\t12", "\t12");
    assert!(refused(&lost, &options()).starts_with("a.csv:4:"), "{}", refused(&lost, &options()));
}

#[test]
fn columns_pass_over_no_clock_and_take_none_for_a_position() {
    let columns = |text: &str| ImportOptions { columns: Some(ColumnMap::parse(text).unwrap()), ..options() };
    let named = columns("time=1,tip-x=2,tip-y=3,head-x=5,head-y=6");
    let text = "tip\t\t\thead\t\t\nt\tx\ty\tt\tx\ty\n0\t1\t2\t0.430\t11\t12\n0.001\t2\t3\t0.431\t12\t13\n\
        0.002\t3\t4\t0.432\t13\t14\n";
    let says = refused(text, &named);
    assert!(says.contains("column 4 `t` is a clock of its own: in line 4 it says `0.431`"), "{says}");
    let once = text.replace("0.430", "0").replace("0.431", "0.001").replace("0.432", "0.002");
    assert!(read(&once, &named).is_ok(), "{:?}", read(&once, &named));
    let words = "tip time (s),tip x (mm),tip y (mm),head time (s),head x (mm),head y (mm)\n\
        0,1,2,0.43,1,2\n0.001,1,2,0.431,1,2\n";
    let says = refused(words, &columns("time=1,tip-x=2,tip-y=3,head-x=4,head-y=5"));
    assert!(says.contains("--columns head-x=4: found the clock `head time (s)`"), "{says}");
    assert!(refused(words, &named).contains("column 4 `head time (s)` is a clock of its own"));
}

#[test]
fn clocks_that_contradict_each_other_are_refused() {
    let frames = "\ttip\t\thead\t\t\nframe\tx\ty\tt\tx\ty\n0\t1\t2\t0\t1\t2\n1\t1\t2\t0.001\t1\t2\n";
    assert!(read(frames, &options()).is_ok(), "{:?}", read(frames, &options()));
    let units = "time_s,time_ms,tip_x,tip_y\n0,0,1,2\n0.001,1,3,4\n0.002,432,5,6\n";
    let says = refused(units, &options());
    assert!(says.contains("column 2 `time_ms` is a clock of its own: in line 4 it says `432` where column 1 `time_s` says `0.002`"), "{says}");
    let particles = "frame,particle,x,y,frame\n0,1,5,6,0\n1,1,6,7,1\n2,1,7,8,3\n";
    let says = refused(particles, &tracks("1", "1"));
    assert!(says.contains("a.csv:4:1:") || says.contains("a.csv:1:1:"), "{says}");
}

#[test]
fn more_columns_or_tracks_than_anybody_has_are_refused_at_their_line() {
    let wide = format!("frame,tip_x,tip_y\n{}\n", "1,".repeat(30_000));
    let says = refused(&wide, &options());
    assert!(says.starts_with("a.csv:2:1: found a row of 30001 columns, expected at most 20000"), "{says}");
    let rows: String = (0..30_000).map(|id| format!("{},{id},1.25,2.5\n", id / 3000)).collect();
    let says = refused(&format!("frame,id,x,y\n{rows}"), &options());
    assert!(says.starts_with("a.csv:20002:1: found more than 20000 tracks"), "{says}");
}

fn sources(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.flat_map(|path| if path.is_dir() { sources(&path) } else { vec![path] }).collect()
}

/// Advice is followed: none may cost a measured row, cell or file.
#[test]
fn no_advice_of_an_import_loses_data() {
    const VERBS: [&str; 7] =
        ["remove ", "delete ", "erase ", "empty it", "empty the", "drop the", "overwrite "];
    for path in sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src/import")) {
        let text = std::fs::read_to_string(&path).unwrap();
        let code = text.split("#[cfg(test)]").next().unwrap();
        for (at, line) in code.lines().enumerate().filter(|(_, line)| !line.trim_start().starts_with("//")) {
            let found = VERBS.iter().find(|verb| line.contains(**verb));
            let kinovea = line.contains("sample a millisecond and drop the others"); // (what the program does)
            assert!(found.is_none() || kinovea, "{}:{}: {line}", path.display(), at + 1);
        }
    }
}
