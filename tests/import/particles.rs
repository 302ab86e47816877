//! Tables of programs that track particles and cells: exact values, gaps, names, and refusals with place and
//! remedy.

use wiperlab::import::source::{Import, ImportSource};
use wiperlab::import::{CoordinateScale, ImportError, ImportOptions, import};

macro_rules! fixture {
    ($path:literal) => {
        ($path, include_bytes!(concat!("../fixtures/", $path)) as &[u8])
    };
}

type Fixture = (&'static str, &'static [u8]);

const SPOTS_4: Fixture = fixture!("trackmate/trackmate7_spots_4_header_rows_micron.csv");
const SPOTS_2: Fixture = fixture!("trackmate/trackmate7_spots_2_header_rows_track_names.csv");
const SPOTS_1: Fixture = fixture!("trackmate/trackmate6_spots_1_header_row_quoted.csv");
const EDGES: Fixture = fixture!("trackmate/trackmate7_edges.csv");
const TRACKS: Fixture = fixture!("trackmate/trackmate7_tracks.csv");
const SIMPLE: Fixture = fixture!("trackmate/trackmate_simple_tracks.xml");
const PROJECT: Fixture = fixture!("trackmate/trackmate7_project.xml");
const TRACKPY: Fixture = fixture!("trackpy/trackpy_index_y_before_x.csv");
const TRACKPY_FLOAT: Fixture = fixture!("trackpy/trackpy_frame_index_and_column_float.csv");
const UNLINKED: Fixture = fixture!("trackpy/trackpy_features_not_linked.csv");

/// Nothing but the rate and the tracks: scale and direction have to come from the file.
fn options(rate_hz: f64, tip: &str, head: &str) -> ImportOptions {
    let name = |name: &str| Some(name.to_owned()).filter(|name| !name.is_empty());
    ImportOptions {
        name: "made".to_owned(),
        frame_rate_hz: Some(rate_hz),
        tip: name(tip),
        head: name(head),
        ..ImportOptions::default()
    }
}

/// The same with a scale, for files in pixels.
fn scaled(rate_hz: f64, tip: &str, head: &str) -> ImportOptions {
    ImportOptions { scale: Some(CoordinateScale::MetresPerPixel(1.0)), ..options(rate_hz, tip, head) }
}

fn read(fixture: Fixture, options: &ImportOptions) -> Result<Import, ImportError> {
    read_as(fixture.0, &String::from_utf8_lossy(fixture.1), options)
}

fn read_as(name: &str, text: &str, options: &ImportOptions) -> Result<Import, ImportError> {
    import(&[ImportSource::without_companions(name, text.as_bytes().to_vec())], options)
}

/// What is said of the fixture with `from` replaced by `to`.
fn refusal(fixture: Fixture, from: &str, to: &str) -> String {
    let text = String::from_utf8_lossy(fixture.1).into_owned();
    assert!(text.contains(from), "{from} is not in {}", fixture.0);
    let name = if fixture.0.ends_with("xml") { "a.xml" } else { "a.csv" };
    read_as(name, &text.replacen(from, to, 1), &scaled(1000.0, "tip", ""))
        .map(|found| found.report.lines().join("\n"))
        .unwrap_err()
        .to_string()
}

/// Every part is in the message.
fn assert_says(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "expected `{part}` in: {message}");
    }
}

fn tip_x(found: &Import) -> Vec<Option<f64>> {
    found.recording.traces().tip_x_m.clone()
}

fn finding<'f>(found: &'f Import, check: &str) -> Option<&'f wiperlab::recording::quality::QualityFinding> {
    found.report.findings.iter().find(|finding| finding.check.name() == check)
}

fn has_note(found: &Import, part: &str) -> bool {
    found.report.notes.iter().any(|note| note.contains(part))
}

#[test]
fn each_fixture_is_claimed_by_its_own_format() {
    let all = [
        (SPOTS_4, "trackmate", "0"),
        (SPOTS_2, "trackmate", "tip"),
        (SPOTS_1, "trackmate", "0"),
        (SIMPLE, "trackmate", "track1"),
        (PROJECT, "trackmate", "holder"),
        (TRACKPY, "trackpy", "0"),
        (TRACKPY_FLOAT, "trackpy", "0"),
    ];
    for (fixture, format, tip) in all {
        let playback =
            ImportOptions { time: Some(wiperlab::import::TimeColumn::Playback), ..scaled(1000.0, tip, "") };
        // (files that name their unit of length need no scale, and refuse another one)
        let own = ImportOptions { scale: None, ..playback.clone() };
        let found = read(fixture, &playback).or_else(|_| read(fixture, &own));
        let found = found.unwrap_or_else(|error| panic!("{}: {error}", fixture.0));
        assert_eq!(found.report.format, format, "{}", fixture.0);
    }
    for (fixture, what) in
        [(EDGES, "SPOT_SOURCE_ID"), (TRACKS, "NUMBER_SPOTS"), (UNLINKED, "without particle")]
    {
        let error = read(fixture, &options(1000.0, "", "")).unwrap_err();
        assert!(
            matches!(&error, ImportError::WrongTable(problem) if problem.found.contains(what)),
            "{error}"
        );
    }
}

#[test]
fn trackmate_spots_come_in_order_with_their_own_unit_and_gap() {
    let found = read(SPOTS_4, &options(2000.0, "0", "1")).unwrap();
    let traces = found.recording.traces();
    assert_eq!(traces.tip_x_m, [Some(100.5e-6), Some(101.5e-6), None, Some(103.5e-6), Some(104.5e-6)]);
    assert_eq!(traces.tip_y_m, [Some(-200.25e-6), Some(-200.5e-6), None, Some(-201.0e-6), Some(-201.25e-6)]);
    assert_eq!(
        traces.head_x_m,
        [Some(300.0e-6), Some(300.25e-6), Some(300.5e-6), Some(300.75e-6), Some(301.0e-6)]
    );
    assert_eq!(traces.tip_confidence, None);
    assert!(has_note(&found, "1 spots belong to no track"), "{:?}", found.report);
    let message = read(SPOTS_4, &options(25.0, "0", "1")).unwrap_err().to_string();
    assert_says(&message, &["the times imply 2000.000000 frames/s, but --frame-rate-hz says 25"]);
}

#[test]
fn trackmate_header_rows_and_line_ends_vary() {
    let found = read(SPOTS_2, &scaled(1000.0, "", "")).unwrap();
    assert_eq!(tip_x(&found), [Some(1.5), Some(2.5)]);
    assert_eq!(found.recording.traces().head_x_m, [Some(11.5), Some(12.5)]);
    assert!(has_note(&found, "the times are numbers of frames"), "{:?}", found.report);
    let message = read(SPOTS_2, &options(1000.0, "", "")).unwrap_err().to_string();
    assert_says(&message, &["--scale", "the row of units, line 2 says `pixel`"]);
    // one header row names no unit: neither scale nor times are known
    let found = read(SPOTS_1, &scaled(1000.0, "0", "1")).unwrap();
    assert_eq!(tip_x(&found), [Some(1.5), Some(2.5)]);
    let text = String::from_utf8_lossy(SPOTS_4.1).into_owned();
    let lines: Vec<&str> = text.lines().collect();
    let three = [&lines[..1], &lines[2..]].concat().join("\r\n");
    assert_eq!(
        read_as("a.csv", &three, &options(2000.0, "0", "1")).unwrap().recording,
        read(SPOTS_4, &options(2000.0, "0", "1")).unwrap().recording
    );
}

#[test]
fn a_lost_sign_of_the_micrometre_and_an_unset_interval_are_understood() {
    let text = String::from_utf8_lossy(SPOTS_4.1).replace("(micron)", "(?m)");
    let expected = read(SPOTS_4, &options(2000.0, "0", "1")).unwrap().recording;
    assert_eq!(read_as("a.csv", &text, &options(2000.0, "0", "1")).unwrap().recording, expected);
    let latin = [
        &text.as_bytes()[..text.find('?').unwrap()],
        b"\xb5",
        &text.as_bytes()[text.find('?').unwrap() + 1..],
    ]
    .concat();
    assert_eq!(
        import(&[ImportSource::without_companions("a.csv", latin)], &options(2000.0, "0", "1"))
            .unwrap()
            .recording,
        expected
    );
    let unset = text
        .replace(",0.0005,1,", ",1.0,1,")
        .replace(",0.0015,3,", ",3.0,3,")
        .replace(",0.001,2,", ",2.0,2,")
        .replace(",0.002,4,", ",4.0,4,");
    let found = read_as("a.csv", &unset, &options(2000.0, "0", "1")).unwrap();
    assert_eq!(found.recording.traces(), expected.traces());
    assert!(has_note(&found, "the times are numbers of frames"), "{:?}", found.report);
}

#[test]
fn rows_of_nothing_below_the_spots_are_no_spots() {
    let expected = read(SPOTS_4, &options(2000.0, "0", "1")).unwrap().recording;
    let text = String::from_utf8_lossy(SPOTS_4.1);
    for end in ["\n", "   \r\n", ",,,,,,,,,,,\r\n,,,,,,,,,,,\r\n"] {
        let padded = format!("{}\n{end}", text.trim_end());
        assert_eq!(
            read_as("a.csv", &padded, &options(2000.0, "0", "1")).unwrap().recording,
            expected,
            "{end:?}"
        );
    }
}

#[test]
fn trackmate_tables_are_refused_with_their_place() {
    let edges = read(EDGES, &options(1000.0, "", "")).unwrap_err().to_string();
    assert_says(
        &edges,
        &[
            "trackmate7_edges.csv:1:1: found TrackMate's columns LABEL, TRACK_ID, SPOT_SOURCE_ID",
            "tab Spots",
            "Export to CSV",
        ],
    );
    let tracks = read(TRACKS, &options(1000.0, "", "")).unwrap_err().to_string();
    assert_says(
        &tracks,
        &["trackmate7_tracks.csv:1:1: found TrackMate's columns LABEL", "NUMBER_SPOTS", "POSITION_X"],
    );
    let comma = refusal(SPOTS_4, "ID11,11,", "lip, left,11,");
    assert_says(&comma, &["a.csv:7:1: found 13 cells", "expected 12", "a comma in a name"]);
    let short = refusal(SPOTS_4, "ID11,11,", "11,");
    assert_says(&short, &["a.csv:7:1: found 11 cells", "expected 12"]);
    let hash = refusal(SPOTS_4, "ID11,11,", "#11,11,");
    assert_says(&hash, &["a.csv:7:1: found a label that starts like a comment", "rename"]);
    let no_frame = refusal(SPOTS_4, ",FRAME,", ",F,");
    assert_says(
        &no_frame,
        &[
            "a.csv:1:1: found TrackMate's columns LABEL,",
            "expected its table of linked spots",
            "Export to CSV",
        ],
    );
    let text = refusal(SPOTS_4, "101.5", "1O1.5");
    assert_says(&text, &["a.csv:7:16: column POSITION_X: found `1O1.5`"]);
    let none = String::from_utf8_lossy(SPOTS_2.1).replace(",0,tip,", ",,,").replace(",1,head,", ",,,");
    assert_says(
        &read_as("a.csv", &none, &scaled(1000.0, "tip", "")).unwrap_err().to_string(),
        &["found spots that belong to no track", "run the tracking"],
    );
}

#[test]
fn a_branching_track_is_left_out_unless_it_is_meant() {
    let text = String::from_utf8_lossy(SPOTS_4.1).replace("ID99,99,,", "ID99,99,1,");
    let found = read_as("a.csv", &text, &options(2000.0, "0", "")).unwrap();
    assert_eq!(tip_x(&found)[0], Some(100.5e-6));
    assert_says(
        &finding(&found, "branching-tracks").unwrap().found,
        &["1 of 2 tracks split or merge and are left out: 1"],
    );
    for tip in ["1", "a.csv:1"] {
        let message = read_as("a.csv", &text, &options(2000.0, "0", tip)).unwrap_err().to_string();
        assert_says(&message, &["a.csv:9:1: found frame 0 of track `1` a second time (first in line 8)"]);
    }
}

#[test]
fn simple_tracks_of_trackmate_have_frames_a_unit_and_an_interval() {
    let found = read(SIMPLE, &options(2000.0, "track1", "track2")).unwrap();
    assert_eq!(tip_x(&found), [Some(0.1015), Some(0.1025), Some(0.1035)]);
    assert_eq!(found.recording.traces().head_y_m, [Some(-0.05025), None, Some(-0.05125)]);
    assert_says(
        &read(SIMPLE, &options(30.0, "track1", "track2")).unwrap_err().to_string(),
        &["the times imply 2000.000000 frames/s"],
    );
    let twice = refusal(SIMPLE, "t=\"1\"", "t=\"2\"");
    assert_says(&twice, &["found `tip`", "track2"]); // (the branching track is left out, and none is called tip)
    let both = read_as(
        "a.xml",
        &String::from_utf8_lossy(SIMPLE.1).replace("t=\"1\"", "t=\"2\""),
        &options(2000.0, "track1", ""),
    )
    .unwrap_err()
    .to_string();
    assert_says(&both, &["a.xml:6:1: found frame 2 of track `track1` a second time (first in line 5)"]);
}

#[test]
fn a_trackmate_project_gives_its_filtered_tracks_by_their_edges() {
    let found = read(PROJECT, &options(1000.0, "lip & tip", "holder")).unwrap();
    assert_eq!(tip_x(&found), [Some(100.5e-6), Some(101.5e-6), Some(102.5e-6)]);
    assert_eq!(found.recording.traces().head_y_m, [Some(-50.25e-6), Some(-50.75e-6), None]);
    assert!(has_note(&found, "1 of 4 tracks do not pass"), "{:?}", found.report);
    assert_says(
        &finding(&found, "branching-tracks").unwrap().found,
        &["1 of 3 tracks split or merge", "dividing"],
    );
    assert_says(
        &read(PROJECT, &options(1000.0, "dust", "holder")).unwrap_err().to_string(),
        &["found `dust`", "lip & tip, holder"],
    );
    let dividing = read(PROJECT, &options(1000.0, "dividing", "holder")).unwrap_err().to_string();
    assert_says(&dividing, &[":16:1: found frame 1 of track `dividing` a second time (first in line 15)"]);
}

#[test]
fn damaged_xml_is_refused_with_its_line() {
    let cut = |fixture: Fixture, at: &str| {
        let text = String::from_utf8_lossy(fixture.1).into_owned();
        read_as("a.xml", &text[..text.find(at).unwrap()], &options(1000.0, "", "")).unwrap_err().to_string()
    };
    assert_says(
        &cut(SIMPLE, "  <particle nSpots=\"2\""),
        &["a.xml:7:14: found the end of the file within 1 open elements"],
    );
    assert_says(
        &cut(SIMPLE, "x=\"303.5\""),
        &["a.xml:10:5: found XML that is damaged or broken off", "export it again"],
    );
    assert_says(&cut(PROJECT, "<AllTracks>"), &["within 2 open elements"]);
    assert_says(&refusal(SIMPLE, "</particle>", "</particles>"), &["a.xml:7:3: found XML that is damaged"]);
    assert_says(
        &refusal(SIMPLE, "x=\"103.5\" ", ""),
        &["a.xml:5:5: found <detection> without x, expected the attribute x"],
    );
    assert_says(
        &refusal(SIMPLE, "\"103.5\"", "\"1,5\""),
        &["a.xml:5:5: column x: found `1,5`, expected a number with a decimal point"],
    );
    assert_says(
        &refusal(SIMPLE, "\"103.5\"", "\"&big;\""),
        &["a.xml:5:5: found an attribute that cannot be read"],
    );
    let outside = "<!DOCTYPE Tracks [<!ENTITY big SYSTEM \"file:///etc/hostname\">]>\n<Tracks";
    assert_says(&refusal(SIMPLE, "<Tracks", outside), &["a.xml:1:1: found XML"]); // (no root element was read: plain XML)
    assert_says(
        &refusal(SIMPLE, "<detection", "<!DOCTYPE a><detection"),
        &["a.xml:4:5: found a document type definition"],
    );
    assert_says(
        &refusal(PROJECT, "SPOT_TARGET_ID=\"12\"", "SPOT_TARGET_ID=\"77\""),
        &["a.xml:25:9: found an edge to the spot 77, which the file does not have"],
    );
    assert_says(
        &refusal(PROJECT, "Spot ID=\"20\"", "Spot ID=\"10\""),
        &["a.xml:9:9: found the spot 10 a second time (first in line 8)"],
    );
    let none = String::from_utf8_lossy(PROJECT.1).replace("<TrackID", "<Other");
    let message = read_as("a.xml", &none, &options(1000.0, "", "")).unwrap_err().to_string();
    assert_says(
        &message,
        &[
            "a.xml: found spots that belong to no track, or none, expected at least one track",
            "loosen the filters",
        ],
    );
}

#[test]
fn deep_or_empty_xml_is_refused_without_a_panic() {
    let deep = format!("<Tracks>{}", "<a>".repeat(200_000));
    assert_says(
        &read_as("a.xml", &deep, &options(1000.0, "", "")).unwrap_err().to_string(),
        &["within 200001 open elements"],
    );
    for text in [
        "<Tracks/>",
        "<TrackMate/>",
        "<Tracks><particle/></Tracks>",
        "<Tracks><particle><detection t='0' x='1' y='1'/></particle></Tracks>",
        "<",
        "<>",
    ] {
        let message = read_as("a.xml", text, &scaled(1000.0, "track1", "")).unwrap_err().to_string();
        assert!(message.starts_with("a.xml"), "{text}: {message}");
    }
}

#[test]
fn trackpy_is_read_by_name_with_y_before_x() {
    let found = read(TRACKPY, &scaled(1000.0, "0", "")).unwrap();
    assert_eq!(tip_x(&found), [Some(101.5), Some(103.5)]);
    assert_eq!(found.recording.traces().tip_y_m, [Some(-200.25), Some(-201.25)]);
    let found = read(TRACKPY_FLOAT, &scaled(1000.0, "0", "1")).unwrap();
    assert_eq!(tip_x(&found), [Some(101.5), Some(102.5), None, Some(104.5)]);
    assert_eq!(found.recording.traces().head_x_m, [Some(90.5), Some(91.5), None, None]);
    assert!(has_note(&found, "1 rows belong to no track"), "{:?}", found.report);
}

#[test]
fn trackpy_refusals_name_the_place() {
    let unlinked = read(UNLINKED, &scaled(1000.0, "", "")).unwrap_err().to_string();
    assert_says(
        &unlinked,
        &["trackpy_features_not_linked.csv:1:1: found a table without particle", "trackpy.link"],
    );
    let twice = refusal(TRACKPY, "0.03,1,0", "0.03,0,0");
    assert_says(&twice, &["a.csv:4:1: found frame 0 of track `0` a second time (first in line 2)"]);
    let differ = refusal(TRACKPY_FLOAT, "\n3,202", "\n2,202");
    assert_says(&differ, &["a.csv:5:1: found two columns `frame` (numbers 1 and 10) that differ"]);
    let text = refusal(TRACKPY, "103.5", "1o3.5");
    assert_says(&text, &["a.csv:4:10: column x: found `1o3.5`"]);
    let scale = read(TRACKPY, &options(1000.0, "0", "")).unwrap_err().to_string();
    assert_says(&scale, &["--scale", "trackpy writes image coordinates"]);
    // a table of one's own with these two names is not taken for trackpy's: y is asked for
    let own = read_as("a.csv", "frame,particle,x,y\n0,0,1.5,2.5\n1,0,2.5,3.5\n", &scaled(1000.0, "0", ""))
        .unwrap_err()
        .to_string();
    assert_says(&own, &["--y-axis up|down"]);
}
