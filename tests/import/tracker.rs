//! Tracker's tables: versions 4 to 6, exported and copied, in every spelling that its dialogue and the locale
//! of its user give.

use wiperlab::import::source::{Import, ImportSource};
use wiperlab::import::{ColumnMap, CoordinateScale, ImportOptions, TimeColumn, import};
use wiperlab::recording::files::YAxis;

macro_rules! fixture {
    ($name:literal) => {
        (concat!("tracker/", $name), include_bytes!(concat!("../fixtures/tracker/", $name)) as &[u8])
    };
}

type Fixture = (&'static str, &'static [u8]);

const COPIED: Fixture = fixture!("tracker4_copy_rows_left_out_crlf.txt");
const SEMICOLON: Fixture = fixture!("tracker5_semicolon_decimal_comma.csv");
const PIXELS: Fixture = fixture!("tracker5_pixels_frame.txt");
const STEP_2: Fixture = fixture!("tracker6_multi_step2_momentum_crlf.txt");
const SPACES: Fixture = fixture!("tracker6_space_single_bom.txt");
const BLANK: Fixture = fixture!("tracker6_export_multi_blank.txt");
const NORWEGIAN: Fixture = fixture!("tracker6_locale_nb_u2212_comma.txt");
const MOMENTUM: Fixture = fixture!("tracker5_momentum_only.txt");
const POLAR: Fixture = fixture!("tracker5_polar_only.txt");
const DATES: Fixture = fixture!("tracker_excel_dates.csv");
const MONTHS: Fixture = fixture!("tracker_excel_month_names.csv");
const COMMAS: Fixture = fixture!("tracker6_comma_decimal_comma.csv");

/// World coordinates in metres, y upwards.
fn world(rate_hz: f64, tip: &str) -> ImportOptions {
    let tip = (!tip.is_empty()).then(|| tip.to_owned());
    ImportOptions {
        name: "made".to_owned(),
        frame_rate_hz: Some(rate_hz),
        scale: Some(CoordinateScale::Unit(1.0)),
        y_axis: Some(YAxis::Up),
        tip,
        ..ImportOptions::default()
    }
}

fn imported((name, bytes): Fixture, options: &ImportOptions) -> Result<Import, String> {
    import(&[ImportSource::without_companions(name, bytes.to_vec())], options)
        .map_err(|error| error.to_string())
}

fn read(fixture: Fixture, options: &ImportOptions) -> Import {
    imported(fixture, options).unwrap_or_else(|error| panic!("{}: {error}", fixture.0))
}

/// The refusal of a text.
fn says(text: &str, options: &ImportOptions) -> String {
    import(&[ImportSource::without_companions("a.txt", text.as_bytes().to_vec())], options)
        .unwrap_err()
        .to_string()
}

fn tip_x(found: &Import) -> Vec<Option<f64>> {
    found.recording.traces().tip_x_m.clone()
}

#[test]
fn every_fixture_is_recognised() {
    let cases = [
        (COPIED, 1000.0, "mass_A"),
        (SEMICOLON, 2000.0, ""),
        (PIXELS, 2000.0, "mass A"),
        (STEP_2, 2000.0, ""),
        (SPACES, 2.0, ""),
    ];
    for (fixture, rate_hz, tip) in
        cases.into_iter().chain([(BLANK, 2000.0, ""), (NORWEGIAN, 2000.0, "mass A")])
    {
        let found = read(fixture, &world(rate_hz, tip));
        assert_eq!(found.report.format, "tracker", "{}", fixture.0);
    }
    for refused in [MOMENTUM, POLAR, DATES, MONTHS] {
        let forced = ImportOptions { format: Some("tracker".to_owned()), ..world(2000.0, "") };
        assert_eq!(imported(refused, &world(2000.0, "")), imported(refused, &forced), "{}", refused.0);
    }
}

#[test]
fn rows_that_were_left_out_are_gaps_and_speeds_are_not_read() {
    let found = read(COPIED, &world(1000.0, "mass_A"));
    assert_eq!((found.recording.grid().start_s, found.recording.grid().frames), (0.0, 7));
    assert_eq!(tip_x(&found), [Some(1.5), Some(1.75), Some(2.0), None, None, Some(2.75), Some(3.0)]);
    assert_eq!(found.recording.traces().tip_y_m[5], Some(3.125));
    assert_eq!(found.recording.traces().head_x_m, [None; 7]);
}

#[test]
fn a_locale_with_decimal_commas_is_read_with_greek_columns_left_out() {
    let found = read(SEMICOLON, &world(2000.0, ""));
    assert_eq!(tip_x(&found), [Some(1.5), Some(1.75), Some(2.0)]);
    assert_eq!(found.recording.traces().tip_y_m, [Some(-0.25), Some(-0.28125), Some(-0.3125)]);
}

#[test]
fn image_pixels_point_down_and_frame_numbers_count() {
    let options = ImportOptions {
        scale: Some(CoordinateScale::MetresPerPixel(0.5)),
        y_axis: None,
        ..world(2000.0, "mass A")
    };
    let found = read(PIXELS, &options);
    assert_eq!((found.recording.grid().start_s, found.recording.grid().frames), (0.05, 4));
    assert_eq!(tip_x(&found), [Some(256.25), Some(256.75), None, Some(257.75)]);
    assert_eq!(found.recording.traces().tip_y_m, [Some(-150.125), Some(-150.375), None, Some(-150.875)]);
    let unset =
        imported(PIXELS, &ImportOptions { name: "made".to_owned(), ..ImportOptions::default() }).unwrap_err();
    assert!(
        unset.contains("--scale S           the length that a pixel shows") && !unset.contains("--y-axis"),
        "{unset}"
    );
}

#[test]
fn a_step_of_two_leaves_every_second_frame_missing_and_tracks_may_start_late() {
    let found = read(STEP_2, &world(2000.0, ""));
    let traces = found.recording.traces();
    assert_eq!((found.recording.grid().frame_rate_hz, found.recording.grid().frames), (2000.0, 7));
    assert_eq!(traces.tip_x_m, [Some(1.0), None, Some(1.25), None, Some(1.5), None, Some(1.75)]);
    assert_eq!(traces.tip_y_m, [Some(2.0), None, Some(2.125), None, Some(2.25), None, Some(2.375)]);
    assert_eq!(traces.head_x_m, [None, None, None, None, Some(12.0), None, Some(12.25)]);
    assert!(found.report.notes.iter().any(|note| note
        == "the tip is tracked in frames 0 to 6, the head in 4 to 6: only what they share has a deflection"));
}

#[test]
fn two_spaces_enclose_an_empty_cell() {
    let found = read(SPACES, &world(2.0, ""));
    assert_eq!(tip_x(&found), [Some(1.5), None, Some(2.5)]);
}

#[test]
fn every_delimiter_and_line_end_gives_the_same_recording() {
    let text = std::str::from_utf8(STEP_2.1).unwrap();
    let expected = read(STEP_2, &world(2000.0, "")).recording;
    let minus = text.replace('-', "\u{2212}");
    let variants = [
        text.replace('\t', ","),
        text.replace('\t', ";"),
        text.replace('\t', " "),
        text.replace("\r\n", "\n"),
        text.replace('.', ","),
        minus.replace('\t', ";").replace('.', ","),
        text.replacen("py\t\r\n", "py\r\n", 1),
        format!("\u{feff}{text}"),
        text.replace("#multi:\r\n", ""),
    ];
    for variant in variants {
        let found = import(
            &[ImportSource::without_companions("a.txt", variant.clone().into_bytes())],
            &world(2000.0, ""),
        );
        assert_eq!(found.map(|found| found.recording).as_ref(), Ok(&expected), "{variant}");
    }
}

#[test]
fn without_titles_tracks_are_numbered_and_have_to_be_chosen() {
    let text = std::str::from_utf8(STEP_2.1).unwrap();
    let untitled = text.replace("\ttip\t\t\t\thead\t\t\t\t\r\n", "");
    assert!(says(&untitled, &world(2000.0, "")).ends_with("tracks found: track1, track2"));
    let chosen = ImportOptions { head: Some("track2".to_owned()), ..world(2000.0, "track1") };
    let found = import(&[ImportSource::without_companions("a.txt", untitled.into_bytes())], &chosen).unwrap();
    assert_eq!(found.recording, read(STEP_2, &world(2000.0, "")).recording);
}

#[test]
fn tables_without_positions_say_which_columns_to_export() {
    let momentum = imported(MOMENTUM, &world(10.0, "")).unwrap_err();
    assert!(
        momentum.starts_with(
            "tracker/tracker5_momentum_only.txt:2:1: found the columns t, px, py, \
        expected x and y (or pixelx and pixely)"
        ),
        "{momentum}"
    );
    assert!(
        momentum.contains(
            "px and py are momentum in Tracker, not pixels: export again with the columns t, x and y selected"
        ),
        "{momentum}"
    );
    let polar = imported(POLAR, &world(10.0, "")).unwrap_err();
    assert!(polar.contains(":2:1: found the columns t, r, \u{3b8}_{r}, expected x and y"), "{polar}");
}

#[test]
fn damage_by_a_spreadsheet_is_refused_with_its_place() {
    let dates = imported(DATES, &world(1000.0, "")).unwrap_err();
    assert!(
        dates.starts_with(
            "tracker/tracker_excel_dates.csv:5:1: column time: found `0.002`, expected a \
        value after that of the row above"
        ),
        "{dates}"
    );
    assert!(
        dates.contains(
            "if a spreadsheet has taken numbers for dates or sorted the rows, go back to the tracking program's \
             own export"
        ),
        "{dates}"
    );
    let months = imported(MONTHS, &world(2000.0, "")).unwrap_err();
    assert!(
        months.starts_with(
            "tracker/tracker_excel_month_names.csv:3:3: column x of tip: found `12.Mai`, \
            expected a number with a decimal comma"
        ),
        "{months}"
    );
    let commas = imported(COMMAS, &world(2000.0, "")).unwrap_err();
    assert!(
        commas.starts_with(
            "tracker/tracker6_comma_decimal_comma.csv:3:1: found 6 cells under a header \
        of 3: the comma is both delimiter"
        ),
        "{commas}"
    );
}

#[test]
fn times_of_playback_are_refused_until_they_are_said_to_count() {
    let rows: String = (0..60).map(|i| format!("{:.9}\t{i}\t0\n", f64::from(i) / 30.0)).collect();
    let text = format!("\ttip\t\t\nt\tx\ty\t\n{rows}");
    let refused = says(&text, &world(2000.0, ""));
    assert!(
        refused.starts_with(
            "a.txt: the times imply 30.000000 frames/s, but --frame-rate-hz says 2000 (a factor of 66.6667)"
        ),
        "{refused}"
    );
    let counted = ImportOptions { time: Some(TimeColumn::Playback), ..world(2000.0, "") };
    let found = import(&[ImportSource::without_companions("a.txt", text.into_bytes())], &counted).unwrap();
    assert_eq!((found.recording.grid().frame_rate_hz, found.recording.grid().frames), (2000.0, 60));
}

#[test]
fn times_with_too_few_digits_say_how_to_count_the_rows() {
    let rows: String = (0..60).map(|i| format!("{:.3}\t{i}\t0\n", f64::from(i) / 2000.0)).collect();
    let text = format!("\ttip\t\t\nt\tx\ty\t\n{rows}");
    let refused = says(&text, &world(2000.0, ""));
    let unset = says(&text, &ImportOptions { name: "made".to_owned(), ..ImportOptions::default() });
    assert!(unset.contains("the file's times repeat, go back or follow no rate"), "{unset}");
    assert!(
        refused.contains("column time: found `")
            && refused.contains(
                "the file has as many rows as frames, so each row is probably one frame (--columns frame=row,...)"
            ),
        "{refused}"
    );
    let counted = ImportOptions {
        columns: Some(ColumnMap::parse("frame=row,tip-x=2,tip-y=3").unwrap()),
        ..world(2000.0, "")
    };
    let found = import(&[ImportSource::without_companions("a.txt", text.into_bytes())], &counted).unwrap();
    assert_eq!((found.recording.grid().frames, tip_x(&found)[59]), (60, Some(59.0)));
}

macro_rules! undocumented {
    ($name:literal) => {
        (
            concat!("undocumented/", $name),
            include_bytes!(concat!("../fixtures/undocumented/", $name)) as &[u8],
        )
    };
}

/// A file with its columns, points and unit; y points up.
type Made = (Fixture, &'static str, [&'static str; 2], Option<CoordinateScale>);

/// Made-up files of programs whose layout is published nowhere, with the options of the documentation:
/// columns, points and unit.
const UNDOCUMENTED: [Made; 6] = [
    (undocumented!("movias_neo.csv"), "", ["P1", "P2"], None),
    (undocumented!("tema_row_of_units.txt"), "", ["Point#1", "Point#2"], None),
    (
        undocumented!("proanalyst.csv"),
        "",
        ["Feature 1", "Feature 2"],
        Some(CoordinateScale::MetresPerPixel(0.001)),
    ),
    (
        undocumented!("phantom_pcc.txt"),
        "frame=Image,tip-x=3,tip-y=4,head-x=5,head-y=6",
        ["", ""],
        Some(CoordinateScale::MetresPerPixel(0.001)),
    ),
    (
        undocumented!("gom_repeated_names.csv"),
        "time=1,tip-x=2,tip-y=3,head-x=6,head-y=7",
        ["", ""],
        Some(CoordinateScale::Unit(0.001)),
    ),
    (
        undocumented!("optitrack_motive.csv"),
        "frame=1,time=2,tip-x=3,tip-y=4,head-x=6,head-y=7",
        ["", ""],
        Some(CoordinateScale::Unit(1.0)),
    ),
];

#[test]
fn tables_of_programs_without_a_published_layout_are_read_as_documented() {
    for (fixture, columns, [tip, head], scale) in UNDOCUMENTED {
        let named = |name: &str| (!name.is_empty()).then(|| name.to_owned());
        let columns = (!columns.is_empty()).then(|| ColumnMap::parse(columns).unwrap());
        let found = read(
            fixture,
            &ImportOptions { columns, scale, tip: named(tip), head: named(head), ..world(2000.0, "") },
        );
        let (grid, traces) = (found.recording.grid(), found.recording.traces());
        assert_eq!(grid.frames, 3, "{}", fixture.0);
        for (frame, shift_m) in [0.0, 0.00025, 0.0005].into_iter().enumerate() {
            let near = |found: &[Option<f64>], expected: f64| {
                found[frame].is_some_and(|value| (value - expected).abs() < 1e-15)
            };
            assert!(
                near(&traces.tip_x_m, 0.0125 + shift_m) && near(&traces.head_y_m, 0.06 + shift_m),
                "{}: {traces:?}",
                fixture.0
            );
        }
    }
    let columns =
        ColumnMap::parse("frame=Index,tip-x=u0 [pixel],tip-y=v0 [pixel],head-x=u1 [pixel],head-y=v1 [pixel]")
            .unwrap();
    let options = ImportOptions {
        columns: Some(columns),
        scale: Some(CoordinateScale::MetresPerPixel(0.5)),
        y_axis: Some(YAxis::Down),
        ..world(2000.0, "")
    };
    let found = read(undocumented!("vic_2d.csv"), &options);
    assert_eq!(found.recording.traces().head_x_m, [Some(0.0), Some(0.25), Some(0.5)]);
    assert_eq!(found.recording.traces().tip_y_m, [Some(0.0), Some(-0.125), Some(-0.25)]);
}

#[test]
fn a_row_of_units_counts_as_much_as_units_in_the_names() {
    let text = "time,tip_x,tip_y\nms,px,px\n0.0,1,2\n0.5,3,4\n1.0,5,6\n";
    let real = ImportOptions {
        frame_rate_hz: None,
        time: Some(TimeColumn::Real),
        scale: Some(CoordinateScale::MetresPerPixel(0.5)),
        ..world(1.0, "")
    };
    let found =
        import(&[ImportSource::without_companions("a.csv", text.as_bytes().to_vec())], &real).unwrap();
    assert_eq!((found.recording.grid().frame_rate_hz, found.recording.grid().frames), (2000.0, 3));
    let odd = says(
        &text.replace("ms,", "fortnights,"),
        &ImportOptions { name: "made".to_owned(), ..ImportOptions::default() },
    );
    assert!(odd.starts_with("a.txt:1:1: ") && odd.contains("(column 1: `time`, `fortnights`)"), "{odd}");
}

#[test]
fn names_behind_a_comment_mark_above_the_numbers_are_names() {
    let options = ImportOptions { scale: Some(CoordinateScale::Unit(1.0)), ..world(10.0, "a") };
    for text in [
        "# t x y\n0.0 1.5 2.5\n0.1 1.75 2.75\n",
        "# saved by a script\n# frame,x,y\n0,1.5,2.5\n1,1.75,2.75\n",
        "#frame;x;y\r\n0;1,5;2,5\r\n1;1,75;2,75\r\n",
        "% t x y\n0.0 1.5 2.5\n0.1 1.75 2.75\n",
        "# time,x,y\n# ms,m,m\n0,1.5,2.5\n100,1.75,2.75\n",
    ] {
        let found =
            import(&[ImportSource::without_companions("a.csv", text.as_bytes().to_vec())], &options).unwrap();
        assert_eq!(tip_x(&found), [Some(1.5), Some(1.75)], "{text}");
    }
    let remark = says("# just two words\n0,1.5,2.5\n1,1.75,2.75\n", &options);
    assert!(remark.contains("starts with `1: 0 | 2: 1.5 | 3: 2.5`"), "{remark}");
}

#[test]
fn frame_numbers_said_to_be_seconds_are_a_serious_finding() {
    let rows: String = (0..20).map(|i| format!("\"{i}\",\"{i}.5\",\"2\"\n")).collect();
    let text = format!("\"Time\",\"tip/0/X\",\"tip/0/Y\"\n{rows}");
    let source = [ImportSource::without_companions("a.csv", text.into_bytes())];
    let unset = import(&source, &ImportOptions { name: "made".to_owned(), ..ImportOptions::default() })
        .unwrap_err()
        .to_string();
    assert!(
        unset.contains("the file's times count like frame numbers: if they are, add --time frames"),
        "{unset}"
    );
    let real = ImportOptions { frame_rate_hz: None, time: Some(TimeColumn::Real), ..world(1.0, "") };
    let found = import(&source, &real).unwrap();
    assert!(
        found
            .report
            .warnings()
            .any(|warning| warning.contains("1 frames/s: they look like frame numbers, not seconds")),
        "{:?}",
        found.report
    );
    let frames = ImportOptions { time: Some(TimeColumn::Frames), ..world(2000.0, "") };
    assert_eq!(import(&source, &frames).unwrap().recording.grid().frame_rate_hz, 2000.0);
}

#[test]
fn plain_tables_say_what_is_wrong_with_their_clock() {
    let rows = |unit: &str, step: f64| {
        let rows: String = (0..20).map(|i| format!("{},{i}.5,2\n", f64::from(i) * step)).collect();
        format!("{unit},tip_x,tip_y\n{rows}")
    };
    let milliseconds = says(&rows("time", 0.5), &world(2000.0, ""));
    assert!(
        milliseconds.ends_with("add --time playback; if the times are milliseconds, add --time ms"),
        "{milliseconds}"
    );
    let far = says(&rows("frame", 1.0).replace("\n19,", "\n2000000000,"), &world(2000.0, ""));
    assert!(
        far.starts_with(
            "a.txt:21:1: column frame: found `2000000000`, expected a whole number, at most \
        10 million after the first"
        ),
        "{far}"
    );
    let clock = says("time,tip_x,tip_y\n00:00:00.00,1,2\n00:00:00.01,1,2\n", &world(100.0, ""));
    assert!(
        clock.starts_with("a.txt:2:1: column time: found `00:00:00.00`")
            && clock.contains("export times as seconds"),
        "{clock}"
    );
    let thousands = says("frame;tip_x;tip_y\n0;1.000,5;2,5\n1;1.001,5;2,5\n", &world(100.0, ""));
    assert!(
        thousands.starts_with("a.txt:2:3: column x of tip: found `1.000,5`")
            && thousands.contains("separators of thousands into the number"),
        "{thousands}"
    );
    let minus = says("frame,tip_x,tip_y\n0,\u{e2}\u{2c6}\u{2019}1.5,2\n1,1,2\n", &world(100.0, ""));
    assert!(
        minus.starts_with("a.txt:2:3: ")
            && minus.contains("the minus sign was read in a wrong encoding before"),
        "{minus}"
    );
    let minutes = import(
        &[ImportSource::without_companions("a.csv", rows("time [min]", 0.125).into_bytes())],
        &world(2.0 / 15.0, ""),
    )
    .unwrap();
    assert_eq!(minutes.recording.grid().frames, 20);
}

#[test]
fn settings_above_a_table_are_no_damaged_rows() {
    let numbered = ImportOptions {
        columns: Some(ColumnMap::parse("frame=1,tip-x=2,tip-y=3").unwrap()),
        ..world(10.0, "")
    };
    let text = "Version,1.23,Take\n\nframe,a,b\n0,1.5,2\n1,1.75,2\n";
    let found =
        import(&[ImportSource::without_companions("a.csv", text.as_bytes().to_vec())], &numbered).unwrap();
    assert_eq!(tip_x(&found), [Some(1.5), Some(1.75)]);
    let damaged = says("frame,a,b\nfirst,1.5,2\n1,1.75,2\n2,1.75,2\n", &numbered);
    assert!(damaged.starts_with("a.txt:2:1: column frame: found `first`"), "{damaged}");
}

#[test]
fn a_table_of_a_kinematics_window_is_doubted_when_its_columns_are_named() {
    let rows: String = (0..20).map(|i| format!("{i};{i},5\n")).collect();
    let source = [ImportSource::without_companions("a.csv", format!("Zeit (ms);tip\n{rows}").into_bytes())];
    let named =
        ImportOptions { columns: Some(ColumnMap::parse("time-ms=1,tip-x=2").unwrap()), ..world(1000.0, "") };
    let found = import(&source, &named).unwrap();
    assert!(
        found.report.warnings().any(|warning| warning.contains("kinematics windows, which are filtered")),
        "{:?}",
        found.report
    );
    let fast =
        import(&source, &ImportOptions { frame_rate_hz: Some(2000.0), ..named }).unwrap_err().to_string();
    assert!(fast.contains("the times imply 1000.0"), "{fast}");
}

#[test]
fn headers_in_other_languages_and_scripts_are_read() {
    let texts = [
        "Zeit [s];Tip X [m];Tip Y [m]\n0,0;1,5;2\n0,5;1,75;2\n",
        "Temps (s);tip x (m);tip y (m)\n0,0;1,5;2\n0,5;1,75;2\n",
        "\u{6642}\u{9593}(s),\u{5148}\u{7aef}X(m),\u{5148}\u{7aef}Y(m)\n0.0,1.5,2\n0.5,1.75,2\n",
        "Bild;TipX;TipY\n0;1,5;2\n1;1,75;2\n",
        "\u{30d5}\u{30ec}\u{30fc}\u{30e0},x1,y1\n0,1.5,2\n1,1.75,2\n",
    ];
    for (text, tip) in texts.into_iter().zip(["Tip", "tip", "\u{5148}\u{7aef}", "Tip", "1"]) {
        let metres = world(2.0, tip);
        let found = import(&[ImportSource::without_companions("a.csv", text.as_bytes().to_vec())], &metres)
            .unwrap_or_else(|error| panic!("{text}: {error}"));
        assert_eq!(
            (found.report.format.as_str(), tip_x(&found)),
            ("plain", vec![Some(1.5), Some(1.75)]),
            "{text}"
        );
    }
    let found =
        import(&[ImportSource::without_companions("a.csv", texts[0].as_bytes().to_vec())], &world(2.0, ""))
            .unwrap();
    assert_eq!(tip_x(&found), [Some(1.5), Some(1.75)]);
}
