//! DeepLabCut, Lightning Pose, SLEAP, DLTdv and Argus: exact values, gaps and names, and what is refused.

use wiperlab::import::source::{CompanionFile, Import, ImportSource};
use wiperlab::import::{CoordinateScale, ImportError, ImportOptions, import};
use wiperlab::recording::channel::ReversalInstants;
use wiperlab::recording::files::YAxis;
use wiperlab::recording::quality::Severity;
use wiperlab::recording::quality::{self, Optics};

macro_rules! fixtures {
    ($($name:ident = $path:literal),+ $(,)?) => {
        $(const $name: (&str, &str) = ($path, include_str!(concat!("../fixtures/", $path)));)+
    };
}

fixtures! {
    DLC = "deeplabcut/single_3_header.csv",
    DLC_MULTI = "deeplabcut/multi_4_header_blanks.csv",
    DLC_FILTERED = "deeplabcut/single_resnet50_filtered.csv",
    DLC_LABELS = "deeplabcut/labelled_3_index_cells.csv",
    DLC_PATHS = "deeplabcut/labelled_path_one_point.csv",
    DLC_SKELETON = "deeplabcut/skeleton.csv",
    LIGHTNING = "deeplabcut/lightning_pose.csv",
    SMOOTHER = "deeplabcut/lightning_pose_ensemble.csv",
    SLEAP = "sleap/analysis_missing_frame1.csv",
    SLEAP_TWO = "sleap/analysis_two_tracks.csv",
    SLEAP_POINTS = "sleap/points.csv",
    SLEAP_INSTANCES = "sleap/instances_padded.csv",
    SLEAP_FRAMES = "sleap/frames_swapped_slots.csv",
    DLTDV_7 = "dltdv/dltdv7_xypts.csv",
    DLTDV_8 = "dltdv/dltdv8_4_xypts_UV_names.csv",
    DLTDV_SPARSE = "dltdv/dltdv8_sparse_xypts.tsv",
    DLTDV_NAMES = "dltdv/dltdv8_sparse_pointNames.tsv",
    DLTDV_SPACE = "dltdv/dltdv7_xyzpts.csv",
    DLTDV_OFFSETS = "dltdv/dltdv7_offsets.csv",
    DLTDV_RESIDUALS = "dltdv/dltdv7_xyzres.csv",
    ARGUS = "dltdv/argus_lower_case_two_cameras.csv",
}

/// What none of these formats says: rate and scale; 1 m/px keeps the numbers of the file.
fn options() -> ImportOptions {
    ImportOptions {
        name: "made".to_owned(),
        frame_rate_hz: Some(1000.0),
        scale: Some(CoordinateScale::MetresPerPixel(1.0)),
        ..ImportOptions::default()
    }
}

fn points(tip: &str, head: &str) -> ImportOptions {
    let name = |name: &str| (!name.is_empty()).then(|| name.to_owned());
    ImportOptions { tip: name(tip), head: name(head), ..options() }
}

fn text(name: &str, text: &str, options: &ImportOptions) -> Result<Import, ImportError> {
    import(&[ImportSource::without_companions(name, text.as_bytes().to_vec())], options)
}

fn read((name, content): (&str, &str), options: &ImportOptions) -> Import {
    text(name, content, options).unwrap()
}

fn says(content: &str, options: &ImportOptions) -> String {
    text("a.csv", content, options).unwrap_err().to_string()
}

fn findings(found: &Import, check: &str) -> Vec<(Severity, String)> {
    found
        .report
        .findings
        .iter()
        .filter(|finding| finding.check.name() == check)
        .map(|finding| (finding.severity, finding.found.clone()))
        .collect()
}

#[test]
fn every_fixture_is_recognised_as_its_own_format() {
    let of_format = [
        ("deeplabcut", vec![DLC, DLC_MULTI, DLC_FILTERED, DLC_LABELS, DLC_PATHS, LIGHTNING, SMOOTHER]),
        ("sleap", vec![SLEAP, SLEAP_TWO, SLEAP_POINTS, SLEAP_INSTANCES, SLEAP_FRAMES]),
        ("dltdv", vec![DLTDV_7, DLTDV_8, DLTDV_SPARSE, ARGUS]),
    ];
    for (format, fixtures) in of_format {
        for (name, content) in fixtures {
            let choice = ImportOptions { y_axis: (format == "dltdv").then_some(YAxis::Down), ..options() };
            let found = text(name, content, &choice).or_else(|error| {
                let shown = error.to_string();
                let first = shown.split("tracks found: ").nth(1).and_then(|list| list.split(", ").next());
                text(
                    name,
                    content,
                    &ImportOptions {
                        tip: Some(first.unwrap_or_else(|| panic!("{name}: {shown}")).to_owned()),
                        ..choice
                    },
                )
            });
            assert_eq!(found.unwrap().report.format, format, "{name}");
        }
    }
}

#[test]
fn deeplabcut_has_its_frames_pixels_and_likelihoods() {
    for fixture in [DLC, LIGHTNING] {
        let found = read(fixture, &options());
        let traces = found.recording.traces();
        assert_eq!(found.recording.grid().start_s, 0.0);
        assert_eq!(traces.tip_x_m[..2], [Some(100.5), Some(101.5)]);
        assert_eq!(traces.tip_y_m[..2], [Some(-200.25), Some(-200.5)]);
        assert_eq!(traces.head_y_m[..2], [Some(-250.5), Some(-250.5)]);
        assert_eq!(traces.head_confidence.as_ref().unwrap()[..2], [Some(0.98), Some(0.97)]);
        assert_eq!(found.file.camera.y_axis, Some(YAxis::Down));
        assert!(
            findings(&found, "filtered").is_empty() && findings(&found, "rounded-times").is_empty(),
            "{:?}",
            found.report
        );
    }
    let found = read(DLC, &ImportOptions { min_likelihood: Some(0.6), ..options() });
    assert_eq!(found.recording.traces().tip_x_m, [Some(100.5), None, Some(102.5)]);
    assert_eq!(findings(&found, "confidence-rejected").len(), 2);
    // what nobody rejected is told once: by the verdict, for the point that has such positions
    let kept = read(DLC, &options());
    let measured = kept.file.quality.as_ref().unwrap();
    let all = quality::collect_findings(
        &kept.recording,
        measured,
        &Optics::default(),
        &ReversalInstants::find_instants(&kept.recording),
        &kept.report.findings,
    );
    let doubtful: Vec<_> = all
        .iter()
        .filter(|finding| finding.found.contains("confidence"))
        .map(|finding| finding.channel.as_deref())
        .collect();
    assert_eq!(doubtful, [Some("tip")]);
}

#[test]
fn deeplabcut_names_individuals_and_keeps_blanks() {
    let found = read(DLC_MULTI, &points("right:tip", "head"));
    assert_eq!(found.recording.traces().tip_x_m, [None, Some(31.5), Some(32.5)]);
    assert_eq!(found.recording.traces().head_x_m, [Some(50.0), Some(50.5), Some(51.0)]);
    let one = DLC_MULTI
        .1
        .replace("right", "left")
        .replace("bodyparts,tip,tip,tip,tip,tip,tip", "bodyparts,tip,tip,tip,end,end,end");
    assert_eq!(
        text("a.csv", &one, &points("end", "tip")).unwrap().recording.traces().tip_x_m,
        [None, Some(31.5), Some(32.5)]
    );
}

#[test]
fn smoothed_positions_are_a_caution() {
    let filtered = read(DLC_FILTERED, &options());
    assert_eq!(filtered.recording.traces().tip_x_m, [Some(100.5), None, Some(102.5)]);
    let caution = findings(&filtered, "filtered");
    assert_eq!((caution.len(), caution[0].0), (1, Severity::Caution));
    assert!(
        caution[0].1.contains("the name of the file says that the positions were filtered"),
        "{caution:?}"
    );
    let smoothed = read(SMOOTHER, &options());
    assert!(findings(&smoothed, "filtered")[0].1.contains("its scorer says"), "{:?}", smoothed.report);
}

#[test]
fn labels_are_placed_by_the_names_of_their_pictures() {
    let found = read(DLC_LABELS, &options());
    let traces = found.recording.traces();
    assert_eq!((found.recording.grid().frames, found.recording.grid().start_s), (10, 0.001));
    assert_eq!(traces.tip_x_m.iter().flatten().copied().collect::<Vec<_>>(), [101.5, 104.5]);
    assert_eq!(
        (traces.tip_x_m[0], traces.tip_x_m[3], traces.head_x_m[3], traces.head_x_m[9]),
        (Some(101.5), Some(104.5), Some(150.5), Some(160.5))
    );
    assert_eq!(traces.tip_confidence, None);
    let paths = read(DLC_PATHS, &options());
    assert_eq!(paths.recording.traces().tip_x_m, [Some(103.5), None, Some(105.5)]);
    let of_one_point = "scorer,,,me,me\nbodyparts,,,tip,tip\ncoords,,,x,y\nlabeled-data,run,img1.png,1.5,2.5\nlabeled-data,run,img2.png,,\nlabeled-data,run,img3.png,3.5,4.5\n";
    assert_eq!(
        text("a.csv", of_one_point, &options()).unwrap().recording.traces().tip_x_m,
        [Some(1.5), None, Some(3.5)]
    );
}

#[test]
fn spreadsheets_and_line_ends_change_nothing() {
    let expected = read(DLC, &options()).recording;
    for changed in [
        DLC.1.replace('\n', "\r\n"),
        DLC.1.replace(',', ";").replace('.', ","),
        format!("\u{feff}{}", DLC.1),
        DLC.1.trim_end().to_owned(),
    ] {
        assert_eq!(
            text("a.csv", &changed, &options()).map(|found| found.recording).as_ref(),
            Ok(&expected),
            "{changed}"
        );
    }
    let expected = read(SLEAP, &options()).recording;
    assert_eq!(text("a.csv", &SLEAP.1.replace('\n', "\r\n"), &options()).unwrap().recording, expected);
    let upwards = ImportOptions { y_axis: Some(YAxis::Up), ..points("pt1", "pt2") };
    let expected = read(DLTDV_7, &upwards).recording;
    assert_eq!(
        text("a.csv", &DLTDV_7.1.replace('\n', "\r\n").replace("NaN", ""), &upwards).unwrap().recording,
        expected
    );
}

#[test]
fn deeplabcut_refusals_name_the_row_that_is_expected() {
    let without = |row: usize| {
        DLC.1
            .lines()
            .enumerate()
            .filter(|(index, _)| *index != row)
            .map(|(_, line)| format!("{line}\n"))
            .collect::<String>()
    };
    assert!(says(&without(0), &options()).starts_with(
        "a.csv:1:1: found a row that starts with `bodyparts`, expected the row `scorer`; the rows above"
    ));
    assert!(
        says(&without(1), &options())
            .starts_with("a.csv:2:1: found a row that starts with `coords`, expected the row `bodyparts`")
    );
    assert!(
        says(&without(2), &options())
            .starts_with("a.csv:3:1: found a row that starts with `0`, expected the row `coords`")
    );
    let twice = says(
        &DLC_MULTI
            .1
            .lines()
            .filter(|line| !line.starts_with("indiv"))
            .map(|line| format!("{line}\n"))
            .collect::<String>(),
        &options(),
    );
    assert!(
        twice.starts_with("a.csv:3:1: found a second x of `tip` in cell 5")
            && twice.contains("a row `individuals`"),
        "{twice}"
    );
    let unnamed = says(&DLC.1.replace("bodyparts,tip,tip,tip", "bodyparts,,,"), &options());
    assert!(unnamed.starts_with("a.csv:2:1: found no name in cell 2"), "{unnamed}");
    let lone = says(&DLC.1.replace("coords,x,y,", "coords,x,Y,"), &options());
    assert!(lone.starts_with("a.csv:3:1: found `tip` with x alone, expected x and y"), "{lone}");
    let space = says(&DLC.1.replace("coords,x,y,likelihood", "coords,x,y,z"), &options());
    assert!(space.starts_with("a.csv:3:12: found a z: positions in space"), "{space}");
    assert!(
        says(DLC_SKELETON.1, &options())
            .starts_with("a.csv:2:2: found lengths and orientations of a skeleton")
    );
    let cell = says(&DLC.1.replace("101.5", "1.Jan"), &options());
    assert!(cell.starts_with("a.csv:5:3: column x of tip: found `1.Jan`, expected a number"), "{cell}");
    assert!(says(&DLC.1.replace("\n2,", "\n1,"), &options()).starts_with("a.csv:6:1: "));
}

#[test]
fn labels_without_frames_or_of_two_videos_are_refused() {
    let unnumbered = says(&DLC_LABELS.1.replace("img0001.png", "start.png"), &options());
    assert!(
        unnumbered.starts_with(
            "a.csv:5:19: column picture: found `start.png`, expected a picture whose \
        name ends in its frame number"
        ),
        "{unnumbered}"
    );
    let two = says(&DLC_LABELS.1.replace("run7,img0001", "run8,img0001"), &options());
    assert!(
        two.starts_with("a.csv:5:1: found a picture of the video `run8` after those of `run7`")
            && two.contains("CollectedData"),
        "{two}"
    );
    let twice = says(&DLC_LABELS.1.replace("img0010", "img0001"), &options());
    assert!(
        twice.starts_with("a.csv:6:1: found frame 1 of track `run7` a second time (first in line 5)"),
        "{twice}"
    );
    let short = says(&DLC_LABELS.1.replace(",,160.5,260.5", ""), &options());
    assert!(short.starts_with("a.csv:6:1: found 4 cells, expected 7"), "{short}");
}

#[test]
fn sleap_keeps_absent_frames_as_gaps_in_every_layout() {
    for fixture in [SLEAP, SLEAP_POINTS, SLEAP_INSTANCES] {
        let found = read(fixture, &options());
        let traces = found.recording.traces();
        assert_eq!(
            traces.tip_x_m.iter().map(Option::is_some).collect::<Vec<_>>(),
            [true, false, true],
            "{}",
            fixture.0
        );
        assert_eq!(traces.tip_x_m[0], Some(100.5));
        assert_eq!(traces.tip_y_m[2], Some(-198.5));
        assert_eq!(traces.tip_confidence.as_ref().unwrap()[..], [Some(0.98), None, Some(0.97)]);
        assert_eq!(found.file.camera.y_axis, Some(YAxis::Down));
    }
    assert_eq!(read(SLEAP, &options()).recording.traces().head_x_m, [Some(150.2), None, None]);
    assert_eq!(read(SLEAP_POINTS, &options()).recording.traces().head_x_m, [Some(150.5), None, None]);
}

#[test]
fn sleap_tracks_are_kept_apart() {
    let found = read(SLEAP_TWO, &points("right:tip", "left:head"));
    assert_eq!(found.recording.grid().start_s, 0.005);
    assert_eq!(found.recording.traces().tip_x_m, [Some(111.25), Some(111.5)]);
    assert_eq!(found.recording.traces().head_x_m, [Some(10.5), Some(10.75)]);
    let found = read(SLEAP_FRAMES, &points("left", "right"));
    assert_eq!(found.recording.traces().tip_x_m, [Some(10.5), Some(11.5), None, Some(13.5)]);
    assert_eq!(found.recording.traces().head_x_m, [Some(110.5), Some(111.5), None, None]);
    let two =
        SLEAP_POINTS.1.replace("0,head,150.5,250.25,run7.mp4,blade", "0,head,150.5,250.25,run7.mp4,other");
    let found = text("a.csv", &two, &points("blade:tip", "other:head")).unwrap();
    assert_eq!(found.recording.traces().head_x_m, [Some(150.5), None, None]);
    let by_track =
        "frame_idx,left.tip.x,left.tip.y,right.tip.x,right.tip.y\n0,1.5,2.5,3.5,4.5\n1,1.6,2.6,,\n";
    assert_eq!(
        text("a.csv", by_track, &points("left", "right")).unwrap().recording.traces().head_x_m,
        [Some(3.5), None]
    );
}

#[test]
fn sleap_instances_that_nobody_can_tell_apart_are_refused() {
    let untracked = "track,frame_idx,instance.score,tip.x,tip.y,tip.score\n,0,0.9,1.5,2.5,0.9\n,1,0.9,1.6,2.6,0.9\n,1,0.8,7.5,8.5,0.9\n";
    let refused = says(untracked, &options());
    assert!(
        refused.starts_with(
            "a.csv:4:1: found frame 1 of an instance without a track a second time \
        (first in line 3), expected one instance"
        ),
        "{refused}"
    );
    assert!(refused.contains("give every instance a track of its own in SLEAP"), "{refused}");
    let tracked = says(&untracked.replace("\n,", "\nblade,"), &options());
    assert!(tracked.starts_with("a.csv:4:1: found frame 1 of `blade` a second time"), "{tracked}");
    let point = says(&SLEAP_POINTS.1.replace("blade", "").replace("\n2,tip", "\n0,tip"), &options());
    assert!(
        point.starts_with(
            "a.csv:4:1: found frame 0 of an instance without a track a second time (first in line 2)"
        ),
        "{point}"
    );
    let slots = says(&SLEAP_FRAMES.1.replace("right", ""), &options());
    assert!(
        slots.starts_with("a.csv:2:1: found an instance without a track in a frame with others"),
        "{slots}"
    );
    let anew =
        says("frame_idx,inst0.tip.x,inst0.tip.y,inst1.tip.x,inst1.tip.y\n0,1,2,3,4\n1,3,4,1,2\n", &options());
    assert!(
        anew.starts_with(
            "a.csv:1:1: found instances that are numbered again in every frame, expected the track of each"
        ),
        "{anew}"
    );
}

#[test]
fn sleap_tables_that_lack_something_are_refused() {
    let no_y = says(&SLEAP.1.replace("tip.y", "tip_y"), &options());
    assert!(
        no_y.starts_with(
            "a.csv:1:1: found the column tip.x, expected also tip.y; export again with File \
        > Export Analysis CSV"
        ),
        "{no_y}"
    );
    for name in ["#2", "// left", "***"] {
        let comment = says(&SLEAP.1.replace("\nblade,2", &format!("\n{name},2")), &options());
        assert!(
            comment.starts_with("a.csv:3:1: found a track or video that starts like a comment"),
            "{comment}"
        );
    }
    let videos = says(&SLEAP_INSTANCES.1.replace("2,run7", "2,run8"), &options());
    assert!(
        videos.starts_with("a.csv:4:3: found a row of the video `run8.mp4` after those of `run7.mp4`"),
        "{videos}"
    );
    let other = says("a,b\n1,2\n3,4\n", &ImportOptions { format: Some("sleap".to_owned()), ..options() });
    assert!(other.starts_with("a.csv:1:1: found the columns a, b, expected frame_idx"), "{other}");
    let cell = says(&SLEAP.1.replace("100.5", "lost"), &options());
    assert!(cell.starts_with("a.csv:2:14: column tip.x: found `lost`, expected a number"), "{cell}");
    assert!(
        says(&SLEAP.1.replace("blade,2", "blade,2.5"), &options())
            .starts_with("a.csv:3:7: column frame: found `2.5`")
    );
}

#[test]
fn dltdv_rows_are_frames_and_its_version_decides_about_y() {
    let found = read(DLTDV_8, &options());
    assert_eq!(found.recording.traces().tip_x_m, [Some(101.25), None]);
    assert_eq!(found.recording.traces().tip_y_m, [Some(-200.5), None]);
    assert_eq!(found.recording.traces().head_y_m, [Some(-50.125), Some(-50.25)]);
    assert!(
        found
            .report
            .notes
            .iter()
            .any(|note| note.contains("the first pixel of a picture is number 1 as in MATLAB")),
        "{:?}",
        found.report
    );
    let open = text("a.csv", DLTDV_7.1, &points("pt1", "pt2")).unwrap_err();
    assert_eq!(open.to_string().matches("\n  --").count(), 1, "{open}");
    assert!(
        open.to_string().contains(
            "DLTdv 8 counts pixels from the top of the picture (down), DLTdv 5 to \
        7 and Argus from its bottom (up)"
        ),
        "{open}"
    );
    let found = read(DLTDV_7, &ImportOptions { y_axis: Some(YAxis::Up), ..points("pt1", "pt2") });
    assert_eq!(found.recording.traces().tip_x_m, [Some(101.25), None, Some(103.75)]);
    assert_eq!(found.recording.traces().tip_y_m, [Some(200.5), None, Some(201.0)]);
    assert_eq!(found.recording.traces().head_x_m, [Some(90.0), Some(90.1), Some(90.2)]);
}

#[test]
fn rows_of_empty_cells_are_frames_of_dltdv() {
    let rows = "pt1_cam1_U,pt1_cam1_V,pt2_cam1_U,pt2_cam1_V\n,,,\n1.5,2.5,3.5,4.5\n,,,\n1.6,2.6,3.6,4.6\n";
    let found = text("a.csv", rows, &points("pt1", "pt2")).unwrap();
    assert_eq!(found.recording.traces().tip_x_m, [Some(1.5), None, Some(1.6)]);
    assert_eq!(found.recording.grid().start_s, 0.001);
    let blank = says(&rows.replace("4.5\n,,,\n", "4.5\n\n"), &points("pt1", "pt2"));
    assert!(blank.starts_with("a.csv:4:1: found an empty line, expected one row a frame"), "{blank}");
}

#[test]
fn cameras_are_kept_apart() {
    let found = read(ARGUS, &points("tip_cam2", ""));
    assert_eq!(found.recording.traces().tip_x_m, [Some(310.5), Some(311.5)]);
    assert_eq!(found.recording.traces().tip_y_m, [Some(320.5), Some(321.5)]);
    assert!(
        found
            .report
            .notes
            .iter()
            .any(|note| note.contains("several cameras: tip and head have to come from one of them")),
        "{:?}",
        found.report
    );
    let refused = text("a.csv", ARGUS.1, &options()).unwrap_err().to_string();
    assert!(refused.contains("tracks found: tip_cam1, tip_cam2"), "{refused}");
}

fn sparse(table: &str, names: Option<&str>, options: &ImportOptions) -> Result<Import, ImportError> {
    let companions = names
        .iter()
        .map(|names| CompanionFile {
            name: "run_pointNames.tsv".to_owned(),
            bytes: names.as_bytes().to_vec(),
        })
        .collect();
    import(
        &[ImportSource { name: "run_xypts.tsv".to_owned(), bytes: table.as_bytes().to_vec(), companions }],
        options,
    )
}

#[test]
fn triplets_of_dltdv_are_placed_by_row_and_column() {
    let found = sparse(DLTDV_SPARSE.1, Some(DLTDV_NAMES.1), &options()).unwrap();
    let traces = found.recording.traces();
    assert_eq!(traces.tip_x_m, [Some(101.25), None, Some(103.75)]);
    assert_eq!(traces.tip_y_m, [Some(-200.5), None, Some(-201.0)]);
    assert_eq!(traces.head_x_m, [Some(90.0), Some(90.1), Some(90.2)]);
    assert_eq!(found.file.camera.y_axis, Some(YAxis::Down));
    assert_eq!(found.file.source.unwrap().file.as_slice(), ["run_xypts.tsv", "run_pointNames.tsv"]);
    let up = ImportOptions { y_axis: Some(YAxis::Up), ..points("columns1-2", "columns3-4") };
    let alone = sparse(DLTDV_SPARSE.1, None, &up).unwrap();
    assert_eq!(alone.recording.traces().tip_y_m, [Some(200.5), None, Some(201.0)]);
    assert!(
        alone.report.notes.iter().any(|note| note.contains("tracks are called by their columns")),
        "{:?}",
        alone.report
    );
    let cameras =
        sparse(DLTDV_SPARSE.1, Some("PointNames_to_go_with_DLTdv8a\ntip\n"), &points("tip_cam2", "tip_cam1"))
            .unwrap();
    assert_eq!(cameras.recording.traces().tip_x_m, traces.head_x_m);
    let zero =
        sparse(&DLTDV_SPARSE.1.replace("103.750000", "0.000000"), Some(DLTDV_NAMES.1), &options()).unwrap();
    assert_eq!(zero.recording.traces().tip_x_m, [Some(101.25), None, None]);
}

#[test]
fn triplets_that_do_not_fit_are_refused() {
    let says = |from: &str, to: &str| {
        sparse(&DLTDV_SPARSE.1.replace(from, to), Some(DLTDV_NAMES.1), &options()).unwrap_err().to_string()
    };
    assert!(says("3\t4\t50.375000\n", "").starts_with(
        "run_xypts.tsv:2:1: found 10 values announced and 9 below, expected the numbers of rows"
    ));
    assert!(
        says("3\t4\t10\n", "3\t5\t10\n")
            .starts_with("run_xypts.tsv:2:1: found 5 columns, expected the numbers of rows")
    );
    assert!(says("3\t4\t10\n", "3\tfour\t10\n").contains("found `3 four 10`"));
    assert!(says("3\t4\t50", "4\t4\t50").starts_with(
        "run_xypts.tsv:12:1: column row: found `4`, expected a whole number from 1 to that which"
    ));
    assert!(says("3\t4\t50", "3\t9\t50").starts_with("run_xypts.tsv:12:3: column column: found `9`"));
    assert!(
        says("3\t4\t50.", "2\t4\t50.").starts_with(
            "run_xypts.tsv:12:1: found row 2 of track `column 4` a second time (first in line 11)"
        )
    );
    assert!(says("3\t4\t50.375000", "3\t4").starts_with("run_xypts.tsv:12:1: found 2 cells, expected 3"));
    let names = sparse(DLTDV_SPARSE.1, Some("PointNames\na\nb\nc\n"), &options()).unwrap_err().to_string();
    assert!(
        names.starts_with("run_pointNames.tsv:4:1: found 3 names of points for 2 pairs of columns"),
        "{names}"
    );
    let huge = says("3\t4\t10\n", "18446744073709551615\t18446744073709551614\t10\n");
    assert!(
        huge.contains("names of points for 9223372036854775807 pairs") || huge.contains("no track"),
        "{huge}"
    );
}

#[test]
fn siblings_of_dltdv_are_refused_with_the_file_to_import() {
    let sparse_space = DLTDV_SPARSE.1.replace("camera coordinates", "xyz coordinates");
    for (name, content, found) in [
        ("a.csv", DLTDV_SPACE.1, "positions in space"),
        ("a.csv", DLTDV_OFFSETS.1, "offsets between cameras"),
        ("a.csv", DLTDV_RESIDUALS.1, "residuals of a reconstruction"),
        ("run_xyzpts.tsv", &sparse_space, "sparse table of other values"),
        ("a.tsv", DLTDV_NAMES.1, "list of point names"),
    ] {
        let refused = text(name, content, &options()).unwrap_err().to_string();
        assert!(refused.starts_with(&format!("{name}:1:1: found DLTdv's {found}")), "{refused}");
        assert!(refused.contains("import the file of the same export that ends in xypts.csv"), "{refused}");
    }
}

#[test]
fn flat_tables_of_dltdv_that_do_not_fit_are_refused() {
    let lone = says(&DLTDV_8.1.replace("tip_cam1_V", "tip_cam2_V"), &options());
    assert!(
        lone.starts_with(
            "a.csv:1:1: found `tip_cam1_U` in cell 1 without its partner, expected pairs of columns"
        ),
        "{lone}"
    );
    let headless = says("1,2\n3,4\n", &ImportOptions { format: Some("dltdv".to_owned()), ..options() });
    assert!(
        headless.starts_with("a.csv:1:1: found `1, 2`, expected pairs of columns such as tip_cam1_X"),
        "{headless}"
    );
    let cell = says(&DLTDV_8.1.replace("90.100000", "oops"), &options());
    assert!(cell.starts_with("a.csv:3:9: column x of head: found `oops`, expected a number"), "{cell}");
    assert!(
        says(&DLTDV_8.1.replace(",50.250000", ""), &options())
            .starts_with("a.csv:3:1: found 3 cells, expected 4")
    );
}

#[test]
fn damaged_tables_are_read_or_refused_but_never_break_the_program() {
    for (name, content) in
        [DLC_MULTI, DLC_LABELS, DLC_PATHS, SLEAP, SLEAP_POINTS, SLEAP_FRAMES, DLTDV_8, DLTDV_SPARSE, ARGUS]
    {
        let choice = ImportOptions { y_axis: Some(YAxis::Down), ..options() };
        let lines: Vec<&str> = content.lines().collect();
        for cut in (0..content.len()).step_by(31).filter(|cut| content.is_char_boundary(*cut)) {
            let (before, after) = content.split_at(cut);
            let rest = after.get(1..).unwrap_or("");
            for damaged in [
                before.to_owned(),
                format!("{before},{after}"),
                format!("{before}\u{e9}{rest}"),
                format!("{before}\n{rest}"),
                format!("{before}9{after}"),
            ] {
                let found = text(name, &damaged, &choice);
                assert!(
                    found.as_ref().map_or_else(
                        |error| !error.to_string().is_empty(),
                        |found| found.recording.grid().frames > 0
                    ),
                    "{damaged}"
                );
            }
        }
        for left_out in 0..lines.len() {
            let fewer: String = lines
                .iter()
                .enumerate()
                .filter(|(line, _)| *line != left_out)
                .map(|(_, line)| format!("{line}\n"))
                .collect();
            if let Err(error) = text(name, &fewer, &choice) {
                assert!(error.to_string().len() > 20, "{error}");
            }
        }
    }
}
