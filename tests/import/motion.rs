//! Exports of Kinovea, DIPP-MOTION, Frame-DIAS and motion-analysis-2d: exact values, gaps and names, and the
//! words of refusals.

use wiperlab::import::source::{Import, ImportSource};
use wiperlab::import::{ColumnMap, CoordinateScale, ImportError, ImportOptions, TimeColumn, import};
use wiperlab::recording::Traces;
use wiperlab::recording::files::YAxis;
use wiperlab::recording::quality::Severity;

macro_rules! fixture {
    ($name:literal) => {
        ($name, include_bytes!(concat!("../fixtures/", $name)).as_slice())
    };
}

type File = (&'static str, &'static [u8]);

const TRAJECTORIES: File = fixture!("kinovea/trajectories_two_tracks_missing.csv");
const COMMA: File = fixture!("kinovea/trajectories_semicolon_decimal_comma.csv");
const BLOCKS: File = fixture!("kinovea/text_blocks_same_name.txt");
const MIXED: File = fixture!("kinovea/text_old_mixed_marks_1ms.txt");
const CODE: File = fixture!("kinovea/text_very_old_time_code.txt");
const WINDOW: File = fixture!("kinovea/window_whole_ms_decimal_comma.csv");
const CHRONOMETERS: File = fixture!("kinovea/chronometers.csv");
const PROJECT: File = fixture!("kinovea/project.kva");
const STARS: File = fixture!("dippmotion/xy_graph_star_missing.csv");
const ORIGIN: File = fixture!("dippmotion/xy_graph_padded_local_origin.csv");
const SPEED: File = fixture!("dippmotion/speed_graph.csv");
const DIAS: File = fixture!("framedias/two_points_lost.rd");
const DECIMALS: File = fixture!("motion_analysis_2d/points_four_decimals.csv");
const ANGLES: File = fixture!("motion_analysis_2d/angle_distance_lost.csv");

fn all() -> ImportOptions {
    ImportOptions {
        name: "made".to_owned(),
        scale: Some(CoordinateScale::Unit(1.0)),
        y_axis: Some(YAxis::Up),
        ..ImportOptions::default()
    }
}

fn rate(rate_hz: f64) -> ImportOptions {
    ImportOptions { frame_rate_hz: Some(rate_hz), ..all() }
}

/// The scale is that of the unit that the file names.
fn own_unit(options: ImportOptions) -> ImportOptions {
    ImportOptions { scale: None, ..options }
}

fn points(tip: &str, head: &str, options: ImportOptions) -> ImportOptions {
    ImportOptions { tip: Some(tip.to_owned()), head: Some(head.to_owned()), ..options }
}

fn time(time: TimeColumn, options: ImportOptions) -> ImportOptions {
    ImportOptions { time: Some(time), ..options }
}

fn read((name, bytes): File, options: &ImportOptions) -> Result<Import, ImportError> {
    import(&[ImportSource::without_companions(name, bytes.to_vec())], options)
}

fn text(content: &str, options: &ImportOptions) -> Result<Import, ImportError> {
    import(&[ImportSource::without_companions("a.txt", content.as_bytes().to_vec())], options)
}

fn refusal(result: Result<Import, ImportError>) -> String {
    result.map_or_else(|error| error.to_string(), |found| panic!("imported {:?}", found.recording.traces()))
}

fn traces(result: Result<Import, ImportError>) -> Traces {
    result.map_or_else(|error| panic!("{error}"), |found| found.recording.traces().clone())
}

fn contains(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "`{part}` is not in: {message}");
    }
}

fn warns(found: &Import, check: &str, severity: Severity) -> bool {
    found.report.findings.iter().any(|finding| finding.check.name() == check && finding.severity == severity)
}

fn some(values: &[f64]) -> Vec<Option<f64>> {
    values.iter().copied().map(Some).collect()
}

fn decoded((_, bytes): File) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

#[test]
fn every_fixture_is_recognised_as_its_own_program() {
    let kinovea = [TRAJECTORIES, COMMA, BLOCKS, MIXED];
    let others = [
        ("dippmotion", STARS),
        ("dippmotion", ORIGIN),
        ("motion-analysis-2d", DECIMALS),
        ("motion-analysis-2d", ANGLES),
        ("framedias", DIAS),
    ];
    for (format, file) in kinovea.map(|file| ("kinovea", file)).into_iter().chain(others) {
        let options = points("nobody", "none", time(TimeColumn::Playback, rate(1000.0)));
        let options = if format == "dippmotion" { own_unit(options) } else { options };
        let message = refusal(read(file, &options));
        contains(&message, &["--point tip: found `nobody`", "tracks found: "]);
        let names = message
            .split("tracks found: ")
            .nth(1)
            .unwrap_or_default()
            .split(", ")
            .take(2)
            .map(str::to_owned)
            .collect::<Vec<_>>();
        let found = read(file, &points(&names[0], &names[1], options))
            .unwrap_or_else(|error| panic!("{}: {error}", file.0));
        assert_eq!(found.report.format, format, "{}", file.0);
        contains(&found.report.reason, &["line 1"]);
    }
}

#[test]
fn kinovea_trajectories_keep_absent_rows_and_empty_cells_as_gaps() {
    let found = read(TRAJECTORIES, &time(TimeColumn::Frames, rate(2000.0))).unwrap();
    assert_eq!((found.recording.grid().frames, found.recording.grid().frame_rate_hz), (5, 2000.0));
    let traces = found.recording.traces();
    assert_eq!(traces.tip_x_m, [Some(12.5), Some(12.75), None, None, Some(13.5)]);
    assert_eq!(traces.tip_y_m, [Some(45.25), Some(45.5), None, None, Some(46.0)]);
    assert_eq!(traces.head_x_m, [None, Some(10.0), Some(10.125), None, Some(10.25)]);
    assert_eq!(traces.head_y_m, [None, Some(20.0), Some(20.25), None, Some(20.5)]);
    assert!(
        found.report.notes.iter().any(|note| note.contains("the file does not say which")),
        "{:?}",
        found.report.notes
    );
}

#[test]
fn kinovea_points_of_an_object_have_both_names_and_decimal_commas_are_read() {
    let options = points("Winkel 1/o", "Winkel 1/a", time(TimeColumn::Real, all()));
    let found = read(COMMA, &options).unwrap();
    assert_eq!((found.recording.grid().frame_rate_hz, found.recording.grid().frames), (2000.0, 4));
    assert_eq!(found.recording.traces().tip_x_m, some(&[1.5, 1.625, 1.75, 1.875]));
    assert_eq!(found.recording.traces().tip_y_m, some(&[-2.25, -2.5, -2.75, -3.0]));
    assert_eq!(found.recording.traces().head_y_m, some(&[4.0, 4.5, 5.0, 5.5]));
}

#[test]
fn kinovea_never_names_the_unit_of_its_times() {
    contains(
        &refusal(read(TRAJECTORIES, &rate(2000.0))),
        &["--time UNIT", "unit of the program's preferences"],
    );
    contains(
        &refusal(read(TRAJECTORIES, &ImportOptions::default())),
        &["--time UNIT", "--frame-rate-hz N", "--scale S", "--y-axis up|down"],
    );
}

#[test]
fn kinovea_tables_with_other_columns_are_refused() {
    let options = time(TimeColumn::Frames, rate(1000.0));
    let single = decoded(TRAJECTORIES)
        .replace(",\"head/0/Y\"", "")
        .replace(",\"20\"", "")
        .replace(",\"20.25\"", "")
        .replace(",\"20.5\"", "");
    contains(
        &refusal(text(&single, &options)),
        &["a.txt:1:28: found the column `head/0/X`", "in pairs called NAME/X and NAME/Y", "File > Export"],
    );
    let broken = decoded(TRAJECTORIES).replace("10.125", "10.1x");
    contains(
        &refusal(text(&broken, &options)),
        &["a.txt:4:7: column x of head: found `10.1x`, expected a number with a decimal point"],
    );
    let short = decoded(TRAJECTORIES).replace("\"2\",,,\"10.125\",\"20.25\"", "\"2\",,,\"10.125\"");
    contains(&refusal(text(&short, &options)), &["a.txt:4:1: found 4 cells, expected 5"]);
    let mixed = decoded(COMMA).replace("1,625", "1.625");
    contains(
        &refusal(text(&mixed, &points("Winkel 1/o", "Winkel 1/a", options))),
        &["a.txt:3:10: column x of Winkel 1/o", "the decimal mark changes within the file"],
    );
    let first = decoded(TRAJECTORIES).replace("\"0\",", "\"zero\",");
    contains(
        &refusal(text(&first, &time(TimeColumn::Frames, rate(1000.0)))),
        &["a.txt:2:1: column time: found `zero`, expected a number"],
    );
    let forced = ImportOptions { format: Some("kinovea".to_owned()), ..rate(1000.0) };
    contains(
        &refusal(text("t,x\n0,1\n1,2\n", &forced)),
        &[
            "a.txt:1:1: found `t | x` and no row that names the columns, expected Time, columns in pairs",
            "File > Export",
        ],
    );
}

#[test]
fn kinovea_blocks_have_their_own_start_and_tracks_of_one_name_are_numbered() {
    let options = points("lame de m\u{e9}tal#1", "lame de m\u{e9}tal#2", time(TimeColumn::Real, all()));
    let found = read(BLOCKS, &options).unwrap();
    assert_eq!((found.recording.grid().frame_rate_hz, found.recording.grid().frames), (1000.0, 4));
    assert_eq!(found.recording.traces().tip_x_m, some(&[1.5, 1.625, 1.75, 1.875]));
    assert_eq!(found.recording.traces().head_x_m, [None, None, Some(3.5), Some(3.625)]);
    assert!(warns(&found, "track-names", Severity::Caution));
    contains(&refusal(read(BLOCKS, &rate(1000.0))), &["--time UNIT"]);
    let none = time(TimeColumn::Real, rate(1000.0));
    contains(&refusal(read(BLOCKS, &none)), &["tracks found: lame de m\u{e9}tal#1, lame de m\u{e9}tal#2"]);
}

#[test]
fn kinovea_text_of_old_versions_mixes_decimal_marks_and_rounds_times() {
    let found = read(MIXED, &time(TimeColumn::Real, rate(120.0))).unwrap();
    assert_eq!(found.recording.traces().tip_x_m, some(&[1.25, 1.375, 1.5, 1.625, 1.75, 1.875]));
    assert_eq!(found.recording.traces().head_x_m, [None, Some(2.5), Some(2.5), Some(2.5), Some(2.5), None]);
    assert!(warns(&found, "rounded-times", Severity::Caution), "{:?}", found.report.findings);
    assert!(
        found
            .report
            .notes
            .iter()
            .any(|note| note.contains("decimal mark of the times is `.`, that of the positions `,`"))
    );
}

#[test]
fn kinovea_tracks_without_a_name_are_numbered_and_time_codes_are_refused() {
    contains(
        &refusal(read(CODE, &points("track1", "track2", time(TimeColumn::Real, all())))),
        &[":3:1: column T: found `0:00:00:00`, expected a number", "or the CSV of the trajectories"],
    );
    let rows = "#Kinovea Trajectory data export\n#T X Y\n\n0 1 2\n1 3 4\n\n1 5 6\n2 7 8\n";
    let found = traces(text(rows, &points("track1", "track2", time(TimeColumn::Real, all()))));
    assert_eq!(found.tip_x_m, [Some(1.0), Some(3.0), None]);
    assert_eq!(found.head_y_m, [None, Some(6.0), Some(8.0)]);
}

#[test]
fn kinovea_points_of_an_object_are_numbered_in_its_text() {
    let rows =
        "#Kinovea Trajectory data export\n#T X Y\n\n# blade\n0 1 2 3 4\n0.5 1.5 NaN 3.5 4.5\n1 2 3 4 5\n";
    let found = traces(text(rows, &points("blade/1", "blade/2", time(TimeColumn::Real, all()))));
    assert_eq!((found.tip_x_m, found.tip_y_m), (some(&[1.0, 1.5, 2.0]), vec![Some(2.0), None, Some(3.0)]));
    assert_eq!((found.head_x_m, found.head_y_m), (some(&[3.0, 3.5, 4.0]), some(&[4.0, 4.5, 5.0])));
}

#[test]
fn kinovea_text_refusals_name_line_and_column() {
    let options = points("tip", "head", time(TimeColumn::Real, rate(120.0)));
    let changed = |from: &str, to: &str| refusal(text(&decoded(MIXED).replacen(from, to, 1), &options));
    contains(
        &changed("1,5 49,5", "1.5 49,5"),
        &["a.txt:7:7: column X: found `1.5`", "the decimal mark of the column's other numbers"],
    );
    contains(&changed("0.017 1,5 49,5", "0.017 1,5"), &["a.txt:7:1: found 2 cells, expected 3"]);
    contains(
        &changed("0.017", "0.001"),
        &["a.txt:7:1: column time: found `0.001`, expected a value after that of the row above"],
    );
    contains(&changed("49,5", "lost"), &["a.txt:7:11: column Y: found `lost`, expected a number"]);
    contains(
        &refusal(text("#Kinovea Trajectory data export\n#T X Y\n\n# tip\n", &options)),
        &["a.txt:4:1: found no rows of numbers"],
    );
}

#[test]
fn kinovea_windows_do_not_say_what_their_series_are() {
    contains(
        &refusal(read(WINDOW, &rate(500.0))),
        &[
            "kinovea/window_whole_ms_decimal_comma.csv:1:1: found a table of Kinovea's kinematics windows",
            "--columns time-ms=1",
        ],
    );
    let columns = Some(ColumnMap::parse("time-ms=1,tip-x=2,head-x=3").unwrap());
    let named = |options: ImportOptions| ImportOptions { columns: columns.clone(), ..options };
    let found = read(WINDOW, &named(rate(1000.0))).unwrap();
    assert_eq!(found.recording.traces().tip_x_m, some(&[1.25, 1.375, 1.5, 1.625]));
    assert_eq!(found.recording.traces().head_x_m, [Some(12.0), Some(12.5), None, Some(13.0)]);
    let caution = found.report.warnings().find(|warning| warning.contains("would be refused without it"));
    contains(&caution.unwrap(), &["which are filtered, keep at most one sample a millisecond"]);
    contains(&refusal(read(WINDOW, &named(rate(5000.0)))), &["the times imply 1000.0"]);
    let format = Some("kinovea".to_owned());
    contains(
        &refusal(read(WINDOW, &named(ImportOptions { format, ..rate(1000.0) }))),
        &["leave --format out"],
    );
}

#[test]
fn other_files_of_kinovea_are_refused_with_the_right_export() {
    contains(
        &refusal(read(PROJECT, &rate(1.0))),
        &["project.kva: found a Kinovea project (.kva)", "File > Export"],
    );
    contains(
        &refusal(read(CHRONOMETERS, &rate(1.0))),
        &["chronometers.csv:1:1: found the durations of Kinovea's chronometers", "File > Export"],
    );
}

#[test]
fn dippmotion_has_its_unit_its_names_and_stars_for_lost_points() {
    let options = points(
        "\u{5148}\u{7aef}",
        "P 2",
        ImportOptions {
            y_axis: Some(YAxis::Up),
            ..ImportOptions { frame_rate_hz: Some(1000.0), ..ImportOptions::default() }
        },
    );
    let found = read(STARS, &options).unwrap();
    assert_eq!(found.file.source.as_ref().unwrap().encoding, "Shift_JIS");
    assert_eq!(found.recording.traces().tip_x_m, [Some(0.0015), None, Some(0.00175), Some(0.001875)]);
    assert_eq!(found.recording.traces().tip_y_m, [Some(-0.00225), None, Some(-0.00275), Some(-0.003)]);
    assert_eq!(found.recording.traces().head_x_m, [Some(0.01), Some(0.010125), Some(0.01025), None]);
    assert!(!warns(&found, "relative-positions", Severity::Caution));
    contains(&refusal(read(STARS, &ImportOptions { y_axis: None, ..options })), &["--y-axis up|down"]);
}

#[test]
fn dippmotion_tells_positions_that_are_relative_to_a_point() {
    let found = read(ORIGIN, &points("P 2", "P 1", own_unit(rate(1000.0)))).unwrap();
    assert_eq!(found.recording.traces().tip_x_m, some(&[-0.265, -0.2625, -0.26]));
    assert!(warns(&found, "relative-positions", Severity::Caution));
    let other = ImportOptions { scale: Some(CoordinateScale::Unit(1e-3)), ..rate(1000.0) };
    contains(
        &refusal(read(ORIGIN, &points("P 2", "P 1", other))),
        &[
            "--scale: found `units of 0.001 m`, expected units of 0.01 m (dippmotion/xy_graph_padded_local_origin.csv:5:6 names the unit cm)",
        ],
    );
}

#[test]
fn dippmotion_tables_of_tabs_are_read() {
    let bytes: Vec<u8> = STARS.1.iter().map(|byte| if *byte == b',' { b'\t' } else { *byte }).collect();
    let options = points("\u{5148}\u{7aef}", "P 2", own_unit(rate(1000.0)));
    let found = import(&[ImportSource::without_companions("a.csv", bytes)], &options);
    assert_eq!(traces(found), traces(read(STARS, &options)));
}

/// The table with stars once more, in UTF-8.
const HEADER: &str = "DIPP-MOTION XYGraphData\nInfo\n[\u{30dd}_X_\u{5ea7}\u{6a19}\u{5024}] - [\u{30dd}_Y_\u{5ea7}\u{6a19}\u{5024}]\n\u{6a2a}\u{8ef8}\u{5358}\u{4f4d},mm\n\
    \u{7e26}\u{8ef8}\u{5358}\u{4f4d},mm\nname,[1]a,[2]b\ncolour,1,2\n\u{6642}\u{9593},\u{5148}\u{7aef}(X),\u{5148}\u{7aef}(Y),P 2(X),P 2(Y)";
const ROWS: &str = "0,1.5,-2.25,10,20\n0.001,*,*,10.125,20.25\n0.002,1.75,-2.75,10.25,20.5\n";

#[test]
fn dippmotion_refusals_name_the_graph_the_unit_and_the_column() {
    contains(
        &refusal(read(SPEED, &rate(1000.0))),
        &["speed_graph.csv:3:1: found the graph [", "X coordinate against Y coordinate"],
    );
    let changed = |from: &str, to: &str| {
        let table = format!("{HEADER}\n{ROWS}").replacen(from, to, 1);
        refusal(text(&table, &points("\u{5148}\u{7aef}", "P 2", own_unit(rate(1000.0)))))
    };
    contains(
        &changed("\u{7e26}\u{8ef8}\u{5358}\u{4f4d},mm", "\u{7e26}\u{8ef8}\u{5358}\u{4f4d},cm"),
        &["a.txt:5:6: found the unit `cm` for y and `mm` for x, expected one unit"],
    );
    contains(
        &changed("P 2(Y)", "P 3(Y)"),
        &["a.txt:8:16: found the column `P 2(X)`, expected \u{6642}\u{9593}, columns in pairs"],
    );
    contains(&changed("1.75,", "1.7a,"), &["a.txt:11:7: column x of \u{5148}\u{7aef}: found `1.7a`"]);
    contains(
        &changed("\u{6642}\u{9593},", "Zeit,"),
        &["a.txt:1:1: found `DIPP-MOTION XYGraphData` and no row that names", "--encoding shift_jis"],
    );
    contains(
        &changed("0.002,", "0.001,"),
        &["a.txt:11:1: column time: found `0.001`, expected a value after that of the row above"],
    );
}

#[test]
fn framedias_asks_for_the_rate_and_numbers_its_points() {
    let chosen = |options| points("point1", "point2", options);
    contains(&refusal(read(DIAS, &chosen(all()))), &["--frame-rate-hz N", "imply 2000.0"]);
    let found = read(DIAS, &chosen(rate(2000.0))).unwrap();
    assert_eq!((found.recording.grid().frame_rate_hz, found.recording.grid().frames), (2000.0, 4));
    assert_eq!(found.recording.traces().tip_x_m, [Some(12.0), None, Some(12.25), Some(12.5)]);
    assert_eq!(found.recording.traces().tip_y_m, [Some(45.0), None, Some(45.125), Some(45.25)]);
    assert_eq!(found.recording.traces().head_x_m, [Some(10.0), Some(10.125), Some(10.25), None]);
    let lost = found.report.findings.iter().find(|finding| finding.check.name() == "lost-points");
    assert_eq!(lost.map(|finding| finding.value), Some(2.0));
    contains(&refusal(read(DIAS, &chosen(rate(10_000.0)))), &["imply 2000.0", "--frame-rate-hz says 10000"]);
    assert_eq!(
        traces(read(DIAS, &chosen(time(TimeColumn::Playback, rate(10_000.0))))).tip_x_m[2],
        Some(12.25)
    );
}

#[test]
fn framedias_refusals_name_what_contradicts_what() {
    let chosen = points("point1", "point2", rate(2000.0));
    let changed = |from: &str, to: &str| {
        refusal(import(
            &[ImportSource::without_companions("a.rd", decoded(DIAS).replacen(from, to, 1).into_bytes())],
            &chosen,
        ))
    };
    contains(
        &changed("4,2,", "5,2,"),
        &["a.rd:1:1: found 4 rows of positions, expected 5 as this line says", "cut short"],
    );
    contains(&changed("4,2,", "4,3,"), &["a.rd:2:1: found 4 coordinates in the row for 3 points"]);
    contains(
        &changed("4,2,", "99999999999999999999,2,"),
        &["expected 100000000000000000000 as this line says"],
    );
    contains(&changed(",20.125000", ""), &["a.rd:4:1: found 3 cells, expected 4"]);
    contains(&changed("12.250000", "12.25x"), &["a.rd:4:1: column x of point1: found `12.25x`"]);
    let forced = ImportOptions { format: Some("framedias".to_owned()), ..chosen.clone() };
    contains(
        &refusal(text("1,2\n3,4\n", &forced)),
        &["a.txt:1:1: found `1,2`, expected the numbers of frames and points"],
    );
}

#[test]
fn motion_analysis_counts_frames_and_its_times_may_be_rounded() {
    let found = read(DECIMALS, &rate(3000.0)).unwrap();
    assert_eq!((found.recording.grid().frames, found.recording.grid().start_s), (24, 0.0));
    let expected: Vec<f64> = (0..24).map(|i| 12.0 + f64::from(i) / 8.0).collect();
    assert_eq!(found.recording.traces().tip_x_m, some(&expected));
    assert_eq!(found.recording.traces().tip_y_m[..3], some(&[45.0, 44.75, 44.5]));
    assert!(warns(&found, "rounded-times", Severity::Caution), "{:?}", found.report.findings);
    contains(
        &refusal(read(DECIMALS, &ImportOptions::default())),
        &["--frame-rate-hz N", "--scale S", "--y-axis up|down"],
    );
}

#[test]
fn motion_analysis_leaves_angles_and_distances_out() {
    let found = read(ANGLES, &rate(2000.0)).unwrap();
    assert_eq!(found.recording.traces().tip_x_m, [Some(12.0), None, Some(12.25)]);
    assert_eq!(found.recording.traces().head_x_m, some(&[10.0, 10.125, 10.25]));
    contains(
        &refusal(read(ANGLES, &points("gap", "head", rate(2000.0)))),
        &["found `gap`", "tracks found: tip, head"],
    );
}

#[test]
fn motion_analysis_refusals_name_line_and_column() {
    let changed =
        |from: &str, to: &str| refusal(text(&decoded(DECIMALS).replacen(from, to, 1), &rate(3000.0)));
    contains(
        &changed("head-y", "head2-y"),
        &[
            "a.txt:1:27: found the column `head-x`, expected frame_no, time, columns in pairs called NAME-x and NAME-y",
        ],
    );
    contains(&changed("12.1250", "12.12.50"), &["a.txt:3:15: column x of tip: found `12.12.50`"]);
    contains(
        &changed("3.0000,", "2.0000,"),
        &["a.txt:4:1: column frame: found `2`, expected a value after that of the row above"],
    );
    contains(
        &changed("3.0000,", "2.5000,"),
        &["a.txt:4:1: column frame: found `2.5`, expected a whole number"],
    );
    contains(
        &refusal(text("frame_no,time,lean-\u{3b8}\n1,0,1\n2,1,1\n", &rate(1.0))),
        &["a.txt:1:1: found no points, expected frame_no, time, columns in pairs"],
    );
    contains(&refusal(read(DECIMALS, &rate(30_000.0))), &["--frame-rate-hz says 30000", "--time playback"]);
}

#[test]
fn motion_analysis_frames_hold_where_rounded_times_repeat() {
    let rows = (0..300).map(|i| format!("{}.0000,{:.4},{i}.0000,1.0000\n", i + 1, f64::from(i) / 30_000.0));
    let table = format!("frame_no,time,tip-x,tip-y\n{}", rows.collect::<String>());
    let found = text(&table, &rate(30_000.0)).unwrap();
    assert_eq!(found.recording.traces().tip_x_m, (0..300).map(|i| Some(f64::from(i))).collect::<Vec<_>>());
}

#[test]
fn line_ends_and_encodings_change_nothing() {
    let options = points("lame de m\u{e9}tal#1", "lame de m\u{e9}tal#2", time(TimeColumn::Real, all()));
    let expected = traces(read(BLOCKS, &options));
    let blocks = decoded(BLOCKS);
    let latin: Vec<u8> = blocks.chars().map(|c| u8::try_from(u32::from(c)).unwrap()).collect();
    let variants = [
        latin,
        blocks.replace('\n', "\r\n").into_bytes(),
        format!("\u{feff}{blocks}").into_bytes(),
        blocks.trim_end().as_bytes().to_vec(),
        blocks.replace("\n# lame", "\n\n\n# lame").into_bytes(),
    ];
    for bytes in variants {
        assert_eq!(traces(import(&[ImportSource::without_companions("a.txt", bytes)], &options)), expected);
    }
    let options = time(TimeColumn::Frames, rate(2000.0));
    let expected = traces(read(TRAJECTORIES, &options));
    let quoted = decoded(TRAJECTORIES);
    let variants = [
        quoted.replace("\r\n", "\n"),
        quoted.replace(',', ";"),
        quoted.replace('"', ""),
        quoted.replace(',', ";").replace('.', ","),
    ];
    for table in variants {
        assert_eq!(traces(text(&table, &options)), expected, "{table}");
    }
}

#[test]
fn files_that_are_cut_short_or_damaged_are_imported_or_refused() {
    let lamella = ["lame de m\u{e9}tal#1", "lame de m\u{e9}tal#2"];
    let files = [
        (TRAJECTORIES, ["tip", "head"]),
        (COMMA, ["Winkel 1/o", "Winkel 1/a"]),
        (BLOCKS, lamella),
        (MIXED, ["tip", "head"]),
        (STARS, ["\u{5148}\u{7aef}", "P 2"]),
        (DIAS, ["point1", "point2"]),
        (ANGLES, ["tip", "head"]),
    ];
    let (mut tried, mut imported) = (0, 0);
    for ((name, bytes), [tip, head]) in files {
        let options = points(tip, head, time(TimeColumn::Playback, rate(1000.0)));
        let options = if name == STARS.0 { own_unit(options) } else { options };
        for at in (0..bytes.len()).step_by(8) {
            let mut changed = bytes.to_vec();
            changed[at] = [b',', b'"', b'9', b'\n', b'#', b':', 0xe3][at % 7];
            for damaged in [bytes[..at].to_vec(), changed] {
                tried += 1;
                match import(&[ImportSource::without_companions(name, damaged)], &options) {
                    Ok(found) => imported += usize::from(found.recording.grid().frames < 100),
                    Err(error) => assert!(
                        error.to_string().contains(name) || error.to_string().starts_with("--point"),
                        "{error}"
                    ),
                }
            }
        }
    }
    assert!(tried > 350 && (10..tried / 2).contains(&imported), "{imported} of {tried}");
}
