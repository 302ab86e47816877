//! ImageJ's tables, DICe, TRC, plain tables with a telling header, and the camera's record of an export.

use proptest::prelude::*;
use wiperlab::import::source::{CompanionFile, Import, ImportSource};
use wiperlab::import::{ColumnMap, CoordinateScale, ImportOptions, import};
use wiperlab::recording::files::YAxis;

macro_rules! fixture {
    ($name:literal) => {
        ($name, include_bytes!(concat!("../fixtures/", $name)) as &[u8])
    };
}

type Fixture = (&'static str, &'static [u8]);

const RESULTS_TAB: Fixture = fixture!("imagej/results_tab_in_csv_crlf.csv");
const RESULTS_COMMA: Fixture = fixture!("imagej/results_comma_no_row_numbers.csv");
const COUNTERS: Fixture = fixture!("imagej/results_hyperstack_counters.csv");
const TWO_POINTS: Fixture = fixture!("imagej/results_two_points_a_slice.xls");
const MANUAL: [Fixture; 3] = [
    fixture!("imagej/manual_tracking_cp1252.csv"),
    fixture!("imagej/manual_tracking_tab_utf8.xls"),
    fixture!("imagej/manual_tracking_mac_roman.csv"),
];
const MTRACKJ: Fixture = fixture!("imagej/mtrackj_points.txt");
const MTRACKJ_MM: Fixture = fixture!("imagej/mtrackj_clusters_mm_frames.txt");
const DICE_0: Fixture = fixture!("dice/DICe_solution_0.txt");
const DICE_1: Fixture = fixture!("dice/DICe_solution_1.txt");
const TRC_TAB: Fixture = fixture!("trc/two_markers_tab.trc");
const TRC_COMMA: Fixture = fixture!("trc/two_markers_comma.trc");
const PLAIN_MM: Fixture = fixture!("plain/units_in_names_decimal_comma.csv");
const OPENCV: Fixture = fixture!("plain/opencv_frame_x_y.csv");
const OBJECTS: Fixture = fixture!("plain/opencv_objects.csv");
const UNITS_ROW: Fixture = fixture!("plain/units_in_a_row.txt");
const PHOTRON: Fixture = fixture!("photron/run7.csv");
const CIH: Fixture = fixture!("photron/run7.cih");
const CIHX: Fixture = fixture!("photron/run7.cihx");

fn source((name, bytes): Fixture) -> ImportSource {
    ImportSource::without_companions(name, bytes.to_vec())
}

/// Nothing said but which track is which.
fn points(tip: &str, head: &str) -> ImportOptions {
    let named = |name: &str| (!name.is_empty()).then(|| name.to_owned());
    ImportOptions { name: "made".to_owned(), tip: named(tip), head: named(head), ..ImportOptions::default() }
}

/// Pixels of half a metre, so that no product rounds.
fn pixels(rate_hz: f64, options: ImportOptions) -> ImportOptions {
    ImportOptions {
        frame_rate_hz: Some(rate_hz),
        scale: Some(CoordinateScale::MetresPerPixel(0.5)),
        ..options
    }
}

fn down(options: ImportOptions) -> ImportOptions {
    ImportOptions { y_axis: Some(YAxis::Down), ..options }
}

fn read(fixture: Fixture, options: &ImportOptions) -> Import {
    import(&[source(fixture)], options).unwrap_or_else(|error| panic!("{}: {error}", fixture.0))
}

fn refused(fixture: Fixture, options: &ImportOptions) -> String {
    match import(&[source(fixture)], options) {
        Ok(found) => panic!("{} was read as {}", fixture.0, found.report.format),
        Err(error) => error.to_string(),
    }
}

/// The refusal of a text of the given name.
fn says(name: &'static str, text: &str) -> String {
    import(
        &[ImportSource::without_companions(name, text.as_bytes().to_vec())],
        &down(pixels(500.0, points("tip", "head"))),
    )
    .unwrap_err()
    .to_string()
}

#[test]
fn tables_of_animal_trackers_are_read_by_their_columns() {
    let fasttrack = "xHead\tyHead\ttHead\txBody\tyBody\timageNumber\tid\n1\t2\t0\t5\t6\t0\t1\n\
        3\t4\t0\t7\t8\t0\t0\n11\t2\t0\t5\t6\t1\t1\n13\t4\t0\t7\t8\t1\t0\n";
    let idtracker = "time,x1,y1,x2,y2\n0.0,1,2,3,4\n0.002,11,2,nan,nan\n";
    let animalta = "Frame;Time;X_Arena0_Ind0;Y_Arena0_Ind0\n7;0.23;1;2\n8;0.27;11;2\n";
    let trex = "frame,X (px),Y (px),X#wcentroid (px),Y#wcentroid (px),frame,time\n0,5,6,1,2,0,0.000\n\
        1,7,8,11,2,1,0.002\n";
    for (text, columns, tip) in [
        (fasttrack, "frame=imageNumber,track=id,x=xHead,y=yHead", "1"),
        (idtracker, "time=time,tip-x=x1,tip-y=y1", ""),
        (animalta, "frame=Frame,tip-x=3,tip-y=4", ""),
        (trex, "frame=1,tip-x=4,tip-y=5", ""),
    ] {
        let columns = Some(ColumnMap::parse(columns).unwrap());
        let options = ImportOptions { columns, ..down(pixels(500.0, points(tip, ""))) };
        let found = read(("a.csv", text.as_bytes()), &options);
        assert_eq!(found.recording.traces().tip_x_m, [Some(0.5), Some(5.5)], "{text}");
    }
}

/// A record with bytes of other kinds as text.
fn lossy((_, bytes): Fixture) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn replaced((_, bytes): Fixture, from: &str, to: &str) -> String {
    let text = String::from_utf8(bytes.to_vec()).unwrap();
    assert!(text.contains(from), "{from}");
    text.replace(from, to)
}

#[test]
fn every_fixture_is_read_as_what_it_is() {
    let cases: [(Fixture, &str, &str, &str); 16] = [
        (RESULTS_TAB, "imagej", "results_tab_in_csv_crlf", "Results table"),
        (RESULTS_COMMA, "imagej", "results_comma_no_row_numbers", "Results table"),
        (COUNTERS, "imagej", "0", "Results table"),
        (MANUAL[0], "imagej", "1", "names Slice n, Track n"),
        (MANUAL[1], "imagej", "1", "names Slice n, Track n"),
        (MANUAL[2], "imagej", "1", "names Slice n, Track n"),
        (MTRACKJ, "imagej", "1", "names t, CID, TID"),
        (MTRACKJ_MM, "imagej", "1:1", "names t, CID, TID"),
        (DICE_0, "dice", "DICe_solution_0", "line 8 names COORDINATE_X"),
        (DICE_1, "dice", "DICe_solution_1", "line 8 names COORDINATE_X"),
        (TRC_TAB, "trc", "tip", "line 1 starts with PathFileType"),
        (TRC_COMMA, "trc", "tip", "line 1 starts with PathFileType"),
        (PLAIN_MM, "plain", "tip", "line 1 names a clock"),
        (OPENCV, "plain", "opencv_frame_x_y", "line 1 names a clock"),
        (OBJECTS, "plain", "1", "line 1 names a clock"),
        (UNITS_ROW, "plain", "tip", "line 1 names a clock"),
    ];
    for (fixture, format, tip, reason) in cases {
        let rate_hz = if format == "trc" {
            500.0
        } else if fixture == UNITS_ROW {
            1000.0
        } else {
            2000.0
        };
        let options = down(pixels(rate_hz, points(tip, "")));
        // (files that name their unit of length need no scale, and refuse another one)
        let own = [MTRACKJ_MM, TRC_TAB, TRC_COMMA, PLAIN_MM].contains(&fixture);
        let found = read(fixture, &ImportOptions { scale: options.scale.filter(|_| !own), ..options });
        assert_eq!(found.report.format, format, "{}", fixture.0);
        assert!(found.report.reason.contains(reason), "{}: {}", fixture.0, found.report.reason);
    }
}

#[test]
fn a_results_table_counts_its_frames_by_slices_and_y_points_down() {
    let found = read(RESULTS_TAB, &pixels(2000.0, points("results_tab_in_csv_crlf", "")));
    let (grid, traces) = (found.recording.grid(), found.recording.traces());
    assert_eq!((grid.start_s, grid.frames), (0.0005, 5));
    assert_eq!(traces.tip_x_m, [Some(50.75), Some(51.75), None, None, Some(53.75)]);
    assert_eq!(traces.tip_y_m, [Some(-100.125), Some(-100.625), None, None, Some(-101.625)]);
    let sorted = read(RESULTS_COMMA, &pixels(2000.0, points("results_comma_no_row_numbers", "")));
    assert_eq!(sorted.recording.traces().tip_x_m, [Some(0.00515), Some(0.00505), Some(0.0051)]);
    let unset = refused(RESULTS_TAB, &points("results_tab_in_csv_crlf", ""));
    assert!(
        unset.contains("--frame-rate-hz N") && unset.contains("--scale S") && !unset.contains("--y-axis"),
        "{unset}"
    );
}

#[test]
fn counters_of_the_multi_point_tool_are_tracks() {
    let found = read(COUNTERS, &pixels(1000.0, points("0", "1")));
    assert_eq!(found.recording.traces().tip_x_m, [Some(50.5), Some(51.5), Some(52.5)]);
    assert_eq!(found.recording.traces().head_x_m, [Some(45.0), Some(45.5), Some(46.0)]);
    assert!(found.report.notes.iter().any(|note| note.contains("counters of the multi-point tool")));
}

#[test]
fn results_that_do_not_say_which_point_is_which_are_refused() {
    let choice = pixels(1000.0, points("a", ""));
    let two = refused(TWO_POINTS, &choice);
    assert!(
        two.starts_with(
            "imagej/results_two_points_a_slice.xls:3:1: found frame 1 a second time (first in line 2), \
        expected one row a slice"
        ),
        "{two}"
    );
    assert!(two.contains("Manual Tracking or MTrackJ"), "{two}");
    let label = says("tip.csv", "Label,X,Y,Slice\na.tif,1.5,2.5,1\n#7.tif,1.5,2.5,2\na.tif,1.5,2.5,3\n");
    assert!(label.starts_with("tip.csv:3:1: found a label that starts like a comment"), "{label}");
    let slice = refused(fixture!("imagej/results_without_slice.csv"), &choice);
    assert!(
        slice.contains(":1:1: found a Results table without Slice")
            && slice.contains("tick `Stack position`"),
        "{slice}"
    );
    let positions = refused(fixture!("imagej/results_without_positions.csv"), &choice);
    assert!(positions.contains("without X and Y") && positions.contains("tick `Centroid`"), "{positions}");
    let both = refused(fixture!("imagej/results_depths_and_times.csv"), &choice);
    assert!(both.contains("both Slice and Frame change") && both.contains("--columns frame=Frame"), "{both}");
    let header = says("a.txt", "X\tY\tSlice\n1\t101\t200\t1\n2\t103\t201\t2\n");
    assert!(header.starts_with("a.txt:2:1: found 4 cells, expected 3"), "{header}");
    let half = import(
        &[ImportSource::without_companions("a.txt", b"X,Y,Slice\n101,200,1\n103,201,2.5\n".to_vec())],
        &choice,
    )
    .unwrap_err()
    .to_string();
    assert!(half.starts_with("a.txt:3:9: column frame: found `2.5`, expected a whole number"), "{half}");
}

#[test]
fn manual_tracking_is_read_whatever_became_of_its_degree_sign() {
    for fixture in MANUAL {
        let found = read(fixture, &pixels(1000.0, points("1", "2")));
        assert_eq!(
            found.recording.traces().tip_x_m,
            [Some(50.5), Some(51.5), None, Some(53.5)],
            "{}",
            fixture.0
        );
        assert_eq!(
            found.recording.traces().head_y_m,
            [Some(-25.0), Some(-25.0), None, None],
            "{}",
            fixture.0
        );
    }
    let lost = replaced(MANUAL[1], "\u{b0}", "?");
    let found = import(
        &[ImportSource::without_companions("a.xls", lost.into_bytes())],
        &pixels(1000.0, points("1", "2")),
    )
    .unwrap();
    assert_eq!(found.recording.grid().frames, 4);
    let unit = refused(MANUAL[0], &points("1", "2"));
    assert!(unit.contains("Manual Tracking writes X and Y in whole pixels"), "{unit}");
}

#[test]
fn manual_tracking_is_refused_where_it_contradicts_itself() {
    let twice = says("a.xls", &replaced(MANUAL[1], "2\t1\t2\t103", "2\t1\t1\t103"));
    assert!(
        twice.starts_with("a.xls:3:1: found frame 1 of track `1` a second time (first in line 2)"),
        "{twice}"
    );
    let cut = says("a.xls", &replaced(MANUAL[1], "\tX\tY\t", "\tX\tZ\t"));
    assert!(cut.contains(":1:1: found a plain table that starts with"), "{cut}");
    let word = says("a.xls", &replaced(MANUAL[1], "\t103\t", "\tlost\t"));
    assert!(word.starts_with("a.xls:3:7: column x: found `lost`"), "{word}");
}

#[test]
fn mtrackj_times_its_points_and_names_its_units() {
    let found = read(MTRACKJ, &pixels(2000.0, points("1", "2")));
    assert_eq!(found.recording.traces().tip_x_m, [Some(50.75), Some(51.75), None, Some(53.75)]);
    assert_eq!(found.recording.traces().head_x_m, [Some(45.0), Some(45.5), Some(46.0), None]);
    let found = read(MTRACKJ_MM, &ImportOptions { frame_rate_hz: Some(2000.0), ..points("1:1", "2:1") });
    assert_eq!(found.recording.traces().tip_x_m, [Some(0.0105), Some(0.01075)]);
    assert_eq!(found.recording.traces().head_y_m, [Some(-0.00525), Some(-0.00525)]);
    let unset = refused(MTRACKJ, &points("1", "2"));
    assert!(
        unset.contains("imply 2000.000000, which may be the playback rate")
            && unset.contains("the header says [pixel]"),
        "{unset}"
    );
}

#[test]
fn tables_of_mtrackj_without_times_are_refused() {
    let choice = pixels(2000.0, points("1", ""));
    let tracks = refused(fixture!("imagej/mtrackj_tracks_statistics.txt"), &choice);
    assert!(
        tracks.contains(":1:1: found `Nr")
            && tracks.contains("expected t, CID, TID, x and y; in MTrackJ press"),
        "{tracks}"
    );
    let interval = refused(fixture!("imagej/mtrackj_no_interval.txt"), &choice);
    assert!(
        interval.contains(":3:1: found time 0 of track `1` a second time")
            && interval.contains("set the frame interval in Image > Properties"),
        "{interval}"
    );
    let units = says("a.txt", &replaced(MTRACKJ, "y [pixel]", "y [mm]"));
    assert!(units.starts_with("a.txt:1:1: found x in `pixel` and y in `mm`"), "{units}");
    let project =
        says("a.mdf", "MTrackJ 1.5.1 Data File\nAssembly 1 FF0000\nPoint 1 101.5 200.25 1.0 1.0 1.0\n");
    assert!(project.contains("a project of MTrackJ (.mdf)"), "{project}");
    let unknown = says("a.txt", &replaced(MTRACKJ, "t [sec]", "t [fortnight]"));
    assert!(unknown.contains("--time UNIT"), "{unknown}");
}

#[test]
fn subsets_of_dice_are_one_recording() {
    let choice = pixels(1000.0, points("DICe_solution_0", "DICe_solution_1"));
    let found = import(&[source(DICE_0), source(DICE_1)], &choice).unwrap();
    let (grid, traces) = (found.recording.grid(), found.recording.traces());
    assert_eq!((grid.start_s, grid.frames), (4.837, 5));
    assert_eq!(traces.tip_x_m, [Some(133.0), Some(133.25), None, None, Some(133.625)]);
    assert_eq!(traces.tip_y_m, [Some(-188.0), Some(-187.875), None, None, Some(-187.5)]);
    assert_eq!(traces.head_x_m, [None, Some(100.5), Some(100.75), Some(101.0), Some(101.25)]);
    let lost: Vec<(f64, &str)> = found
        .report
        .findings
        .iter()
        .filter(|f| f.check.name() == "lost-points")
        .map(|f| (f.value, f.found.as_str()))
        .collect();
    assert_eq!(lost.len(), 2, "{lost:?}");
    assert!(
        lost[0].0 == 1.0
            && lost[0].1.contains("SIGMA below 0")
            && lost[1].0 == 1.0
            && lost[1].1.contains("STATUS_FLAG"),
        "{lost:?}"
    );
}

#[test]
fn fields_of_dice_are_refused() {
    let choice = pixels(1000.0, points("a", ""));
    let field = refused(fixture!("dice/DICe_solution_full_field.txt"), &choice);
    assert!(
        field.contains(":10:1: found FRAME 0 after 0, expected one subset that is followed over the frames"),
        "{field}"
    );
    assert!(field.contains("tracking mode"), "{field}");
    let ids = refused(fixture!("dice/DICe_solution_subset_ids.txt"), &choice);
    assert!(ids.contains(":8:1: found the columns SUBSET_ID, COORDINATE_X"), "{ids}");
    let moved = says("a.txt", &replaced(DICE_1, "4839,2.0000E+02", "4839,2.0100E+02"));
    assert!(moved.starts_with("a.txt:10:6: found COORDINATE_X 2.0100E+02 after 2.0000E+02"), "{moved}");
    let anew = says("a.txt", &replaced(DICE_1, "correlation: false", "correlation: true"));
    assert!(
        anew.starts_with("a.txt:5:1: found `Incremental correlation: true`")
            && anew.contains("without the incremental formulation"),
        "{anew}"
    );
    let mixed = import(&[source(DICE_0), source(OPENCV)], &choice).unwrap_err().to_string();
    assert!(mixed.contains("found the format plain, expected dice as in the first file"), "{mixed}");
}

#[test]
fn trc_says_its_unit_and_rate() {
    for fixture in [TRC_TAB, TRC_COMMA] {
        let found = read(fixture, &ImportOptions { y_axis: Some(YAxis::Up), ..points("", "") });
        let (grid, traces) = (found.recording.grid(), found.recording.traces());
        assert_eq!((grid.frame_rate_hz, grid.frames), (500.0, 3));
        assert_eq!(traces.tip_x_m, [Some(0.1015), None, Some(0.1035)]);
        assert_eq!(traces.head_y_m, [Some(0.05), Some(0.0505), Some(0.051)]);
        assert!(found.report.notes.iter().any(|note| note.contains("z is left out")));
    }
    let axis = refused(TRC_TAB, &points("", ""));
    assert!(
        axis.contains("--y-axis up|down") && !axis.contains("--scale") && !axis.contains("--frame-rate-hz"),
        "{axis}"
    );
}

#[test]
fn settings_of_trc_that_contradict_the_rows_are_refused() {
    let changed = |from: &str, to: &str| says("a.trc", &replaced(TRC_TAB, from, to));
    let frames = changed("\t3\t2\tmm", "\t30\t2\tmm");
    assert!(
        frames.starts_with("a.trc:3:15: found 3 rows of positions, expected 30 as this line says"),
        "{frames}"
    );
    let resampled = changed("500.00\t500.00\t3", "500.00\t1000.00\t3");
    assert!(
        resampled.starts_with("a.trc:3:8: found 1000 frames/s of the camera and 500 rows a second"),
        "{resampled}"
    );
    let unit = changed("\t3\t2\tmm", "\t3\t2\tV");
    assert!(unit.starts_with("a.trc:3:19: found the unit `V`, expected a unit of length"), "{unit}");
    let slower = replaced(TRC_TAB, "500.00\t500.00\t3", "250.00\t250.00\t3");
    let slower = ImportSource::without_companions("a.trc", slower.into_bytes());
    let rate = import(&[slower], &down(points("tip", "head"))).unwrap_err().to_string();
    assert!(
        rate.starts_with("a.trc: the times imply 500.000000 frames/s, but --frame-rate-hz says 250"),
        "{rate}"
    );
    let cells = changed("91\t50.5\t7", "91\t50.5");
    assert!(cells.starts_with("a.trc:8:1: found 7 cells, expected 8"), "{cells}");
    let name = changed("tip\t\t\thead", "tip\t\thead\t");
    assert!(name.starts_with("a.trc:4:18: found the name `head` above column 5"), "{name}");
    let none = changed("DataRate\t", "Rate\t");
    assert!(none.contains("found DataRate ``, expected a number above 0"), "{none}");
    let zero = changed("500.00\t500.00\t3\t", "0\t0\t3\t");
    assert!(zero.contains("found DataRate `0`, expected a number above 0"), "{zero}");
}

#[test]
fn a_telling_header_needs_no_columns_option() {
    let found = read(
        PLAIN_MM,
        &ImportOptions { frame_rate_hz: Some(2000.0), y_axis: Some(YAxis::Up), ..points("", "") },
    );
    assert_eq!(found.recording.traces().tip_x_m, [Some(0.0105), Some(0.01075), None, Some(0.01125)]);
    assert_eq!(found.recording.traces().head_x_m, [Some(0.009), Some(0.00925), None, Some(0.00975)]);
    let wrong = refused(
        PLAIN_MM,
        &ImportOptions { frame_rate_hz: Some(25.0), y_axis: Some(YAxis::Up), ..points("", "") },
    );
    assert!(wrong.contains("imply 2000.000000 frames/s, but --frame-rate-hz says 25"), "{wrong}");
    let unset = refused(PLAIN_MM, &points("", ""));
    assert!(
        unset.contains("imply 2000.000000") && unset.contains("--y-axis") && !unset.contains("--scale"),
        "{unset}"
    );
    let found = read(OBJECTS, &down(pixels(2000.0, points("1", "2"))));
    assert_eq!(found.recording.traces().head_x_m, [Some(45.0), Some(45.5)]);
    let named = "id,frame,x,y\ntip,0,1.5,2.5\n#2,0,3.5,4.5\ntip,1,1.5,2.5\n#2,1,3.5,4.5\n";
    let comment = says("a.csv", named);
    assert!(
        comment.starts_with("a.csv:3:1: found the name of an object that starts like a comment"),
        "{comment}"
    );
    let found = read(
        UNITS_ROW,
        &ImportOptions { min_likelihood: Some(0.6), ..down(pixels(1000.0, points("tip", ""))) },
    );
    assert_eq!(found.recording.traces().tip_x_m, [Some(50.5), None, Some(52.5)]);
    assert!(
        found.report.notes.iter().any(|note| note.contains("line 2 names the units")),
        "{:?}",
        found.report.notes
    );
}

#[test]
fn a_single_minus_one_in_pixels_is_a_lost_point_in_all_likelihood() {
    let found = read(OPENCV, &down(pixels(2000.0, points("opencv_frame_x_y", ""))));
    let runs: Vec<f64> =
        found.report.findings.iter().filter(|f| f.check.name() == "minus-one-run").map(|f| f.value).collect();
    assert_eq!(runs, [1.0]);
    assert!(
        found.report.warnings().any(|w| w.contains("1 frames in a row from frame 2 at exactly (-1, -1)"))
    );
}

#[test]
fn doubtful_headers_are_refused_with_their_columns() {
    let cases = [
        (
            "frame,x,y,x,y\n0,1,2,3,4\n1,1,2,3,4\n",
            "a.csv:1:1: found columns 2 (`x`), 4 (`x`) that could all be the x, expected one; say which \
             columns",
        ),
        (
            "frame,tip_x,x_tip,tip_y\n0,1,2,3\n1,1,2,3\n",
            "columns 2 (`tip_x`), 3 (`x_tip`) that could all be the x of `tip`",
        ),
        (
            "frame,frame_no,x,y\n0,1,2,3\n1,2,2,3\n",
            "columns 1 (`frame`), 2 (`frame_no`) that could all be numbers of the frames",
        ),
        (
            "time,seconds,tip_y,tip_x\n0,0,2,3\n1,1,2,3\n",
            "columns 1 (`time`), 2 (`seconds`) that could all be times",
        ),
        ("frame,tip_y\n0,2\n1,3\n", "found a y of `tip` and no x, expected both"),
        (
            "frame,id,track,x,y\n0,1,1,2,3\n1,1,1,2,3\n",
            "columns 2 (`id`), 3 (`track`) that could all be names of the object",
        ),
        (
            "0.5,101,200\n1.0,103,201\n",
            "starts with `1: 0.5 | 2: 101 | 3: 200`, expected --columns to say what its columns are; name or \
             number them (from 1)",
        ),
        ("alpha,beta\n0.5,101\n1.0,103\n", "starts with `1: alpha | 2: beta`"),
    ];
    for (text, part) in cases {
        let message = says("a.csv", text);
        assert!(message.contains(part), "{part}: {message}");
    }
    let both = import(
        &[ImportSource::without_companions(
            "a.csv",
            b"time_s,time_ms,tip_x,tip_y\n0,0,1,2\n0.5,500,3,4\n".to_vec(),
        )],
        &down(pixels(2.0, points("tip", ""))),
    );
    assert_eq!(both.unwrap().recording.traces().tip_x_m, [Some(0.5), Some(1.5)]);
    let repeated = says("a.csv", "frame,tip_x,head_x\n0,1,2\n0,3,4\n1,3,4\n");
    assert!(repeated.starts_with("a.csv:3:1: column frame: found `0`"), "{repeated}");
}

#[test]
fn the_cameras_record_gives_the_rate() {
    let beside = |files: &[(&str, Vec<u8>)]| ImportSource {
        companions: files
            .iter()
            .map(|(name, bytes)| CompanionFile { name: (*name).to_owned(), bytes: bytes.clone() })
            .collect(),
        ..source(PHOTRON)
    };
    let options = down(ImportOptions { scale: Some(CoordinateScale::MetresPerPixel(0.5)), ..points("", "") });
    let rate = |source: ImportSource| {
        import(&[source], &options)
            .map(|found| (found.recording.grid().frame_rate_hz, found.report.findings.len()))
    };
    assert_eq!(rate(beside(&[("run7.cih", CIH.1.to_vec())])).unwrap().0, 5000.0);
    let both =
        import(&[beside(&[("run7.cih", CIH.1.to_vec()), ("run7.cihx", CIHX.1.to_vec())])], &options).unwrap();
    assert_eq!((both.file.camera.frame_rate_hz, both.file.camera.exposure_s), (5000.0, Some(1e-4)));
    let few = lossy(CIHX).replace("<totalFrame>300", "<totalFrame>2").into_bytes();
    let says = rate(beside(&[("run7.cihx", few.clone())])).unwrap_err().to_string();
    assert!(
        says.starts_with(
            "run7.cihx:1:1: found a record of 2 frames, but a track of photron/run7.csv with 3 rows"
        ),
        "{says}"
    );
    let declared = import(&[beside(&[("run7.cihx", few)])], &pixels(250.0, options.clone())).unwrap();
    assert!(declared.report.warnings().any(|w| w.contains("record is not used")), "{:?}", declared.report);
    let other = replaced(CIH, "5000", "250").into_bytes();
    let contradicts =
        rate(beside(&[("run7.cih", other.clone()), ("run7.cihx", CIHX.1.to_vec())])).unwrap_err().to_string();
    assert!(
        contradicts.starts_with(
            "run7.cihx:5:1: found a recording rate of 5000 frames/s, expected 250 as \
            in the camera's record run7.cih"
        ),
        "{contradicts}"
    );
    let stepped = replaced(CIH, "Save Step : 1", "Save Step : 36").into_bytes();
    let says = rate(beside(&[("run7.cih", stepped.clone())])).unwrap_err().to_string();
    assert!(
        says.starts_with("run7.cih:10:1: found `Save Step : 36`") && says.contains("--frame-rate-hz N"),
        "{says}"
    );
    let declared = import(&[beside(&[("run7.cih", stepped)])], &pixels(139.0, options.clone())).unwrap();
    assert!(
        declared
            .report
            .findings
            .iter()
            .any(|f| f.check.name() == "camera-record" && f.found.contains("Save Step : 36"))
    );
    let differs = import(&[beside(&[("run7.cih", other)])], &pixels(5000.0, options.clone()));
    let differs = differs.unwrap_err().to_string();
    assert!(differs.starts_with("--frame-rate-hz: found 5000, but the camera's record"), "{differs}");
    assert!(differs.contains("has 250 frames/s"), "{differs}");
    let alone = import(&[source(CIH)], &options).unwrap_err().to_string();
    assert!(
        alone.contains("a Photron camera's record, not a table")
            && alone.contains("keep this file in their folder"),
        "{alone}"
    );
}

#[test]
fn a_record_of_saved_steps_gives_no_rate_by_itself() {
    let beside = |name: &str, text: String| ImportSource {
        companions: vec![CompanionFile { name: name.to_owned(), bytes: text.into_bytes() }],
        ..source(PHOTRON)
    };
    let options = down(ImportOptions { scale: Some(CoordinateScale::MetresPerPixel(0.5)), ..points("", "") });
    let of_step = |n: u32| lossy(CIHX).replace("<skipFrame>1<", &format!("<skipFrame>{n}<"));
    let stepped = || beside("run7.cihx", of_step(2500));
    let says = import(&[stepped()], &options).unwrap_err().to_string();
    assert!(
        says.contains("found `skipFrame : 2500`: not every frame of the 5000 a second was saved")
            && says.contains("--frame-rate-hz 2 where the table counts the saved pictures, or 5000 where"),
        "{says}"
    );
    // the declared rate has to be one of the two, and the camera's own needs the step
    let at = |rate_hz: f64, step: Option<usize>| {
        import(&[stepped()], &ImportOptions { frame_step: step, ..pixels(rate_hz, options.clone()) })
    };
    assert_eq!(at(2.0, None).unwrap().recording.grid().frame_rate_hz, 2.0);
    for (rate_hz, step) in [(5000.0, None), (250.0, None), (5000.0, Some(7))] {
        let says = at(rate_hz, step).unwrap_err().to_string();
        assert!(
            says.contains(&format!("and --frame-rate-hz {rate_hz}, expected --frame-rate-hz 2")),
            "{says}"
        );
    }
    let by_40 = import(
        &[beside("run7.cihx", of_step(40))],
        &ImportOptions { frame_step: Some(40), ..pixels(5000.0, options.clone()) },
    );
    assert_eq!(by_40.unwrap().recording.grid().frames, 81);
}

#[test]
fn the_cameras_record_gives_the_exposure() {
    let beside = |name: &str, text: String| ImportSource {
        companions: vec![CompanionFile { name: name.to_owned(), bytes: text.into_bytes() }],
        ..source(PHOTRON)
    };
    let options = down(ImportOptions { scale: Some(CoordinateScale::MetresPerPixel(0.5)), ..points("", "") });
    let exposure = |source: ImportSource| import(&[source], &options).unwrap().file.camera.exposure_s;
    assert_eq!(exposure(beside("run7.cih", lossy(CIH))), Some(1e-4));
    assert_eq!(exposure(beside("run7.cih", replaced(CIH, "1/10000", "0.0002"))), Some(2e-4));
    assert_eq!(exposure(beside("run7.cihx", lossy(CIHX))), Some(1e-4));
    let says = |exposure_s: f64| {
        let options = ImportOptions { exposure_s: Some(exposure_s), ..options.clone() };
        import(&[beside("run7.cih", lossy(CIH))], &options).map_err(|error| error.to_string())
    };
    assert!(says(1.0001e-4).is_ok());
    let differs = says(5e-5).unwrap_err();
    assert!(
        differs
            .starts_with("--exposure-s: found `0.00005`, expected 0.0001 as in the camera's record run7.cih"),
        "{differs}"
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    #[test]
    fn damaged_files_are_read_or_refused(which in 0_usize..10, damage in proptest::collection::vec((0.0..1.0_f64, any::<u8>(), 0_usize..3), 1..4)) {
        let all = [RESULTS_TAB, COUNTERS, MANUAL[0], MTRACKJ, DICE_0, TRC_TAB, TRC_COMMA, PLAIN_MM, UNITS_ROW, CIH];
        let mut bytes = all[which].1.to_vec();
        for (share, byte, kind) in damage {
            let at = (share * bytes.len() as f64) as usize;
            match kind {
                0 => bytes[at] = byte,
                1 => bytes.insert(at, byte),
                _ => bytes.truncate(at.max(1)),
            }
        }
        if let Ok(found) = import(&[ImportSource::without_companions("a.txt", bytes)], &down(pixels(1000.0, points("1", "")))) {
            prop_assert!(found.recording.grid().frames >= 2);
        }
    }
}
