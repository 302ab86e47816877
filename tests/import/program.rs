//! Exports in, recordings out: exact values for what is read, place and remedy for what is refused.

use wiperlab::import::source::{Import, ImportSource};
use wiperlab::import::{ColumnMap, CoordinateScale, ImportError, ImportOptions, TimeColumn, import};
use wiperlab::recording::files::{RecordingFile, YAxis, read_recording, trace_csv};

const MULTI: &[u8] = include_bytes!("../fixtures/tracker/tracker6_export_multi_blank.txt");
const NORWEGIAN: &[u8] = include_bytes!("../fixtures/tracker/tracker6_locale_nb_u2212_comma.txt");
const FRAMES: &[u8] = include_bytes!("../fixtures/generic/frame_and_rounded_time.csv");

fn source(name: &str, bytes: &[u8]) -> ImportSource {
    ImportSource::without_companions(name, bytes.to_vec())
}

fn options(rate_hz: f64) -> ImportOptions {
    ImportOptions {
        name: "made".to_owned(),
        frame_rate_hz: Some(rate_hz),
        scale: Some(CoordinateScale::Unit(1.0)),
        y_axis: Some(YAxis::Up),
        ..ImportOptions::default()
    }
}

fn read(text: &str, options: &ImportOptions) -> Result<Import, ImportError> {
    import(&[source("a.txt", text.as_bytes())], options)
}

fn columns(text: &str, rate_hz: f64) -> ImportOptions {
    ImportOptions { columns: Some(ColumnMap::parse(text).unwrap()), ..options(rate_hz) }
}

/// A plain table of `rows` rows at 1000 rows/s: time, tip x and y, head x and y.
fn plain(rows: usize) -> Vec<String> {
    (0..rows)
        .map(|i| format!("{},{},0.5,{},0.25", i as f64 / 1000.0, i as f64 / 8.0, i as f64 / 16.0))
        .collect()
}

const ALL: &str = "time=1,tip-x=2,tip-y=3,head-x=4,head-y=5";

#[test]
fn an_export_of_two_tracks_keeps_its_blank_row_as_a_gap() {
    let found = import(&[source("run/multi.txt", MULTI)], &options(2000.0)).unwrap();
    let (grid, traces) = (found.recording.grid(), found.recording.traces());
    assert_eq!((grid.start_s, grid.frame_rate_hz, grid.frames), (0.0, 2000.0, 3));
    assert_eq!(traces.tip_x_m, [Some(0.125), None, Some(0.13)]);
    assert_eq!(traces.tip_y_m, [Some(3.0), None, Some(2.95)]);
    assert_eq!(traces.head_x_m, [Some(12.0), Some(12.01), Some(12.02)]);
    assert_eq!(found.file.source.unwrap().file.as_slice(), ["multi.txt"]);
    assert_eq!(found.report.format, "tracker");
    assert!(!found.recording.is_synthetic());
}

#[test]
fn a_locale_with_decimal_commas_and_typographic_minus_is_read() {
    let choice = ImportOptions { tip: Some("mass A".to_owned()), ..options(2000.0) };
    let found = import(&[source("nb.txt", NORWEGIAN)], &choice).unwrap();
    assert_eq!(found.recording.traces().tip_x_m, [Some(-0.125), Some(-0.13)]);
    assert_eq!(found.recording.traces().head_x_m, [None, None]);
    assert!(found.report.warnings().any(|w| w.starts_with("no track for the head")), "{:?}", found.report);
}

#[test]
fn every_delimiter_line_end_and_encoding_gives_the_same_recording() {
    let text = "\ttip\t\thead\t\nt\tx\ty\tx\ty\n0.0\t1.5\t2.5\t3.5\t4.5\n0.1\t\t\t3.6\t4.6\n0.2\t1.7\t2.7\t3.7\t4.7\n";
    let expected = read(text, &options(10.0)).unwrap().recording;
    let utf16: Vec<u8> =
        [0xff, 0xfe].into_iter().chain(text.encode_utf16().flat_map(u16::to_le_bytes)).collect();
    let variants: Vec<Vec<u8>> = vec![
        text.replace('\t', ";").into_bytes(),
        text.replace('\t', ",").into_bytes(),
        text.replace('\t', " ").into_bytes(),
        text.replace('.', ",").into_bytes(),
        text.replace('\t', ";").replace('.', ",").into_bytes(),
        text.replace('\n', "\r\n").into_bytes(),
        text.replace('\n', "\r").into_bytes(),
        format!("\u{feff}{text}").into_bytes(),
        text.trim_end().as_bytes().to_vec(),
        format!("#multi:\n{text}").replace("tx\ty\tx\ty\n", "tx\ty\tx\ty\t\n").into_bytes(),
        utf16,
    ];
    assert_eq!(expected.traces().tip_x_m, [Some(1.5), None, Some(1.7)]);
    for bytes in variants {
        let shown = String::from_utf8_lossy(&bytes).into_owned();
        let found = import(&[source("a.txt", &bytes)], &options(10.0));
        assert_eq!(found.map(|f| f.recording).as_ref(), Ok(&expected), "{shown}");
    }
}

#[test]
fn momentum_is_not_a_position() {
    let with = "t\tpx\tpy\tx\ty\n0\t100\t200\t1\t2\n1\t101\t201\t3\t4\n";
    let choice = ImportOptions { tip: Some("a".to_owned()), ..options(1.0) };
    assert_eq!(read(with, &choice).unwrap().recording.traces().tip_x_m, [Some(1.0), Some(3.0)]);
    let without = "t\tpx\tpy\n0\t1\t2\n1\t1\t2\n";
    let forced = ImportOptions { format: Some("tracker".to_owned()), ..choice };
    assert!(
        read(without, &forced)
            .unwrap_err()
            .to_string()
            .contains("px and py are momentum in Tracker, not pixels")
    );
}

#[test]
fn the_frame_column_is_preferred_and_absent_rows_are_gaps() {
    let text = "\ttip\t\t\t\nt\tx\ty\tframe\n0.0\t1\t1\t10\n0.3\t2\t2\t13\n0.4\t3\t3\t14\n";
    let found = read(text, &options(10.0)).unwrap().recording;
    assert_eq!(found.traces().tip_x_m, [Some(1.0), None, None, Some(2.0), Some(3.0)]);
}

#[test]
fn single_track_files_merge_on_one_grid() {
    let one = "t\tx\ty\n0.0\t1\t1\n0.1\t2\t2\n0.3\t4\t4\n";
    let two = "t\tx\ty\n0.2\t30\t30\n0.3\t40\t40\n0.4\t50\t50\n";
    let sources = [source("left/tip.txt", one.as_bytes()), source("left/holder.txt", two.as_bytes())];
    let choice =
        ImportOptions { tip: Some("tip".to_owned()), head: Some("holder.txt".to_owned()), ..options(10.0) };
    let found = import(&sources, &choice).unwrap().recording;
    assert_eq!(found.grid().frames, 5);
    assert_eq!(found.traces().tip_x_m, [Some(1.0), Some(2.0), None, Some(4.0), None]);
    assert_eq!(found.traces().head_x_m, [None, None, Some(30.0), Some(40.0), Some(50.0)]);
    let same = [source("a/x.txt", b"1"), source("b/x.txt", b"1")];
    let same = import(&same, &choice).unwrap_err().to_string();
    assert!(same.starts_with("b/x.txt: found the file name `x.txt`, expected one that no other"), "{same}");
}

#[test]
fn a_plain_table_is_read_by_number_and_by_name() {
    let by_number =
        import(&[source("f.csv", FRAMES)], &columns("frame=1,tip-x=3,tip-y=4,head-x=5,head-y=6", 2000.0))
            .unwrap();
    let by_name = import(
        &[source("f.csv", FRAMES)],
        &columns("frame=frame_no,tip-x=tip-x,tip-y=tip-y,head-x=head-x,head-y=head-y", 2000.0),
    )
    .unwrap();
    assert_eq!(by_number.recording, by_name.recording);
    assert_eq!(by_number.recording.traces().tip_x_m, [Some(12.0), Some(12.1), Some(12.2)]);
    let says = import(&[source("f.csv", FRAMES)], &columns("frame=frame_no,tip-x=tipx", 2000.0))
        .unwrap_err()
        .to_string();
    assert!(
        says.starts_with("f.csv:1:1: found the columns frame_no, time")
            && says.contains("did you mean `tip-x`?"),
        "{says}"
    );
}

#[test]
fn scale_and_direction_are_applied_to_the_files_own_origin() {
    let pixels = ImportOptions {
        scale: Some(CoordinateScale::parse("0.5m/px").unwrap()),
        y_axis: Some(YAxis::Down),
        ..columns(ALL, 1000.0)
    };
    let found = read(&plain(3).join("\n"), &pixels).unwrap();
    assert_eq!(found.recording.traces().tip_x_m, [Some(0.0), Some(0.0625), Some(0.125)]);
    assert_eq!(found.recording.traces().tip_y_m, [Some(-0.25); 3]);
    assert_eq!(found.file.camera.metres_per_pixel, Some(0.5));
}

#[test]
fn what_no_file_says_must_be_said_all_at_once() {
    let says = read(
        &plain(20).join("\n"),
        &ImportOptions { columns: Some(ColumnMap::parse(ALL).unwrap()), ..ImportOptions::default() },
    )
    .unwrap_err()
    .to_string();
    for part in [
        "--frame-rate-hz N",
        "imply 1000.0",
        "--scale S",
        "21.5um/px",
        "--y-axis up|down",
        "world coordinates point up",
    ] {
        assert!(says.contains(part), "{part}: {says}");
    }
}

#[test]
fn bad_cells_name_their_place() {
    let refused = |row: usize, line: &str| {
        let mut rows = plain(30);
        rows[row] = line.to_owned();
        read(&rows.join("\n"), &columns(ALL, 1000.0)).unwrap_err()
    };
    let says = |row, line: &str| refused(row, line).to_string();
    assert!(
        says(9, "0.009,1,oops,1,1")
            .starts_with("a.txt:10:9: column y of tip: found `oops`, expected a number")
    );
    assert!(says(9, "0.008,1,1,1,1").starts_with(
        "a.txt:10:1: column time: found `0.008`, expected a value after \
            that of the row above; export again from the tracking program"
    ));
    assert!(says(9, "0.004,1,1,1,1").contains("if a spreadsheet has taken numbers for dates"));
    assert!(says(9, "0.0094,1,1,1,1").contains("a time on the frame grid"));
    assert!(says(9, ",1,1,1,1").contains("column time: found ``, expected a number in every row"));
    assert!(says(0, "start,1,1,1,1").starts_with("a.txt:1:1: column time: found `start`"));
    assert!(says(9, "0.009,1,1").starts_with("a.txt:10:1: found 3 cells, expected 5 as in the rest"));
    assert!(says(9, "0.009,1,1,1,1,7").starts_with("a.txt:10:1: found 6 cells, expected 5 as in the rest"));
    assert!(says(9, "0.009,inf,1,1,1").contains("found `inf`, expected a number with a decimal point"));
}

#[test]
fn missing_words_are_missing_and_lost_points_are_suspected() {
    let mut rows = plain(40);
    for (row, word) in ["", "NaN", "NA", "None", "-", "*", "null", "#N/A"].iter().enumerate() {
        rows[row + 2] = format!("{},{word},{word},1,1", (row + 2) as f64 / 1000.0);
    }
    for (row, text) in rows.iter_mut().enumerate().skip(20).take(4) {
        *text = format!("{},0,0,1,1", row as f64 / 1000.0);
    }
    let found = read(&rows.join("\n"), &columns(ALL, 1000.0)).unwrap();
    assert_eq!(found.recording.traces().tip_x_m.iter().filter(|x| x.is_none()).count(), 8);
    assert_eq!(found.recording.traces().tip_x_m[20], Some(0.0));
    assert!(
        found
            .report
            .warnings()
            .any(|w| w.starts_with("tip: 4 frames in a row from frame 20 at exactly (0, 0)")),
        "{:?}",
        found.report
    );
}

#[test]
fn rates_that_disagree_are_refused_unless_the_times_only_count() {
    let text = plain(20).join("\n");
    let differs = read(&text, &columns(ALL, 25_000.0)).unwrap_err().to_string();
    assert!(differs.contains("(a factor of 25.0000)"), "{differs}");
    assert!(!differs.contains("--frame-step"), "{differs}");
    assert!(read(&text, &columns(ALL, 1005.0)).is_ok());
    let counted = ImportOptions { time: Some(TimeColumn::Playback), ..columns(ALL, 25_000.0) };
    let found = read(&text, &counted).unwrap().recording;
    assert_eq!((found.grid().frame_rate_hz, found.grid().frames), (25_000.0, 20));
    let playback =
        read(&text, &ImportOptions { time: Some(TimeColumn::Playback), ..columns(ALL, 30.0) }).unwrap();
    assert!(playback.report.findings.iter().any(|f| f.check.name() == "implied-rate"
        && (f.value - 1000.0).abs() < 1e-6
        && f.found.contains("playback")));
}

#[test]
fn tracks_are_named_in_the_refusal() {
    let choice = ImportOptions { tip: Some("tipp".to_owned()), ..options(2000.0) };
    let says = import(&[source("m.txt", MULTI)], &choice).unwrap_err().to_string();
    assert_eq!(
        says,
        "--point tip: found `tipp`, expected the name of a track; did you mean `tip`? tracks found: tip, head"
    );
}

#[test]
fn a_point_that_is_not_named_is_the_track_of_its_name() {
    let lip = String::from_utf8(MULTI.to_vec()).unwrap().replace("tip", "lip");
    let found = read(&lip, &ImportOptions { tip: Some("lip".to_owned()), ..options(2000.0) }).unwrap();
    assert_eq!(found.recording.traces().head_x_m, [Some(12.0), Some(12.01), Some(12.02)]);
    let taken = read(&lip, &ImportOptions { tip: Some("head".to_owned()), ..options(2000.0) }).unwrap();
    assert_eq!(taken.recording.traces().head_x_m, [None; 3]);
}

#[test]
fn formats_and_tables_that_are_not_read_say_what_to_do() {
    let kinovea = ImportOptions { format: Some("kinovea".to_owned()), ..options(1.0) };
    let says = read("t\tx\n1\t2\n", &kinovea).unwrap_err().to_string();
    assert!(
        says.contains("found `t | x` and no row that names the columns") && says.contains("File > Export"),
        "{says}"
    );
    let tema = read("t\tx\n1\t2\n", &ImportOptions { format: Some("TEMA".to_owned()), ..options(1.0) })
        .unwrap_err()
        .to_string();
    assert!(tema.contains("its layout is not published") && tema.contains("--columns time=1"), "{tema}");
    let says = |text: &str| read(text, &options(1.0)).unwrap_err().to_string();
    assert!(says("a,b,c\n1,2,3\n2,3,4\n").contains("expected --columns to say what its columns are"));
    assert!(says("t\tx\ty\n").contains("no rows of numbers"));
    assert!(
        says("t|x|y\n0|1|1\n1|2|2\n").starts_with("a.txt:2:1: found `0|1|1`, expected columns separated by")
    );
}

#[test]
fn pixels_declared_as_a_length_are_suspected() {
    let text = "t\tx\ty\n0\t100\t200\n1\t101\t201\n2\t103\t202\n3\t104\t203\n";
    let found = read(
        text,
        &ImportOptions {
            tip: Some("a".to_owned()),
            scale: Some(CoordinateScale::Unit(1e-3)),
            ..options(1.0)
        },
    )
    .unwrap();
    assert!(found.report.warnings().any(|w| w.contains("look like pixels")), "{:?}", found.report);
}

#[test]
fn synthetic_data_says_so() {
    let text = "\ttip synthetic\t\nt\tx\ty\n0\t1\t1\n1\t2\t2\n";
    let named = read(text, &ImportOptions { tip: Some("tip synthetic".to_owned()), ..options(1.0) }).unwrap();
    assert!(named.recording.is_synthetic() && named.file.synthetic);
    let twin = ImportOptions {
        twin: Some(("spec.toml".to_owned(), "format = 1\n[camera]\nseed = 7\n".to_owned())),
        ..columns(ALL, 1000.0)
    };
    let found = read(&plain(20).join("\n"), &twin).unwrap();
    assert!(found.recording.is_synthetic());
    assert!(found.file.to_toml().unwrap().contains("[twin.camera]\nseed = 7"));
}

#[test]
fn confidence_below_the_limit_is_missing() {
    let text = "0,1,0.9\n1,2,0.1\n2,3,0.7\n";
    let limited =
        ImportOptions { min_likelihood: Some(0.6), ..columns("frame=1,tip-x=2,tip-confidence=3", 100.0) };
    let found = read(text, &limited).unwrap().recording;
    assert_eq!(found.traces().tip_x_m, [Some(1.0), None, Some(3.0)]);
    assert_eq!(found.traces().tip_confidence.as_deref(), Some(&[Some(0.9), Some(0.1), Some(0.7)][..]));
}

#[test]
fn import_write_read_is_the_identity() {
    let mut set = ImportOptions {
        exposure_s: Some(1e-4),
        scale: Some(CoordinateScale::parse("21.5um/px").unwrap()),
        y_axis: Some(YAxis::Down),
        ..columns(ALL, 1000.0)
    };
    set.add_condition("glass=wet").unwrap();
    let made = read(&plain(200).join("\n"), &set).unwrap();
    let description = RecordingFile::parse("recording.toml", &made.file.to_toml().unwrap()).unwrap();
    assert_eq!(description, made.file);
    let again = read_recording("made", "trace.csv", &trace_csv(&made.recording), Some(&description)).unwrap();
    assert_eq!(again, made.recording);
    let alone = read_recording("made", "trace.csv", &trace_csv(&made.recording), None).unwrap();
    // (the error of the rate is in the description alone)
    assert_eq!(alone.with_frame_rate_sd(made.recording.frame_rate_sd_hz()).unwrap(), made.recording);
}
