//! A parameter study against exact answers: eigenfrequencies, runs that stick or slip throughout, mirror
//! images, and the run itself.

use plain_charts::Medium;
use resvg::{tiny_skia, usvg};
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};
use wiperlab::checkpoint::{Shard, format_header_line};
use wiperlab::feature::{self, FeatureReader};
use wiperlab::figures::sweep_map;
use wiperlab::model::modes::{TipConstraint, natural_modes};
use wiperlab::recording::channel::ReversalInstants;
use wiperlab::simulate::mode::TipMode;
use wiperlab::simulate::outputs::Transitions;
use wiperlab::simulate::scene::Scene;
use wiperlab::simulate::scene::contact::ContactLossRule;
use wiperlab::simulate::twin::film_scene;
use wiperlab::simulate::{RunStatus, SolverOptions, run_scene};
use wiperlab::sweep::{
    self, MissingReason, PointCollection, PointOutcome, Study, SweepMap, journal as points,
};

const LIGHT_BLADE: &str = include_str!("../../data/scenes/light-blade.toml");
const ACTUAL_BLADE: &str = include_str!("../../data/scenes/actual-blade.toml");

/// The light blade with some of its lines replaced.
fn scene(changes: &[(&str, &str)]) -> Scene {
    let text = changes.iter().fold(LIGHT_BLADE.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replacen(from, to, 1)
    });
    Scene::parse("scene", &text).unwrap()
}

fn go_on() -> ControlFlow<()> {
    ControlFlow::Continue(())
}

fn outcomes(scene: &Scene, body: &str) -> (Study, Vec<PointOutcome>) {
    let text = format!(
        "format = 1\ntitle = \"t\"\nscene = \"s\"\n[camera]\nframe_rate_hz = 1e4\nexposure_s = 0.0\n{body}"
    );
    let study = Study::parse("study", &text).unwrap();
    study.check_scene("study", scene).unwrap();
    let done = AtomicUsize::new(0);
    let count = || {
        done.fetch_add(1, Ordering::Relaxed);
    };
    let mut journal = format_header_line(&points::study_header(&study, "f"));
    sweep::run_sweep(&study, scene, Shard::WHOLE, &|_| true, &mut journal, &count, &go_on).unwrap();
    let mut collected =
        PointCollection::new(points::study_header(&study, "f"), tempfile::tempfile().unwrap());
    let added = collected.add_journal("journal", journal.as_bytes()).unwrap().unwrap();
    assert_eq!([added.points, added.new, done.into_inner()], [study.point_count(); 3]);
    let mut outcomes = Vec::new();
    collected.for_each_point(|_, outcome| outcomes.push(outcome)).unwrap();
    (study, outcomes)
}

fn values(outcome: &PointOutcome) -> Vec<f64> {
    outcome.values.iter().map(|value| *value.as_ref().unwrap()).collect()
}

const REST: [(&str, &str); 3] = [
    ("time_s = 0.42", "time_s = 0.0"),
    (
        "kind = \"steady-slide\"",
        "kind = \"state\"\nneck_angle_rad = 1e-5\nlip_angle_rad = -1e-5\n\
         neck_rate_rad_per_s = 0.0\nlip_rate_rad_per_s = 0.0",
    ),
    ("amplitude_m = 0.0138", "amplitude_m = 1e-12"),
];

#[test]
fn a_free_ring_down_has_the_eigenfrequencies_everywhere() {
    let undamped = [
        ("head_damping_ratio = 0.182", ""),
        ("neck_damping_ratio = 0.045", ""),
        ("lip_damping_ratio = 0.143", ""),
        ("a = 0.229", "a = 0.0"),
        ("c = 0.331", "c = 0.0"),
        ("stop_s = 1.02", "stop_s = 0.5"),
        ("frequency_hz = 0.915", "frequency_hz = 1e-3"),
    ];
    let scene = scene(&[&REST[..], &undamped].concat());
    let maps = "[[axis]]\nname = \"blade.neck_natural_frequency_hz\"\nvalues = [400.0, 519.0, 700.0]\n\
                [[axis]]\nname = \"blade.preload_force_n\"\nvalues = [0.05, 0.1, 0.15]\n\
                [[map]]\nname = \"low\"\nkind = \"frequency\"\nchannel = \"deflection\"\n\
                window = \"..\"\nband_hz = [100.0, 600.0]\n\
                [[map]]\nname = \"high\"\nkind = \"frequency\"\nchannel = \"deflection\"\n\
                window = \"..\"\nband_hz = [600.0, 4000.0]\n\
                [[map]]\nname = \"large\"\nkind = \"frequency\"\nchannel = \"deflection\"\n\
                window = \"..\"\nband_hz = [100.0, 4000.0]\n\
                least_amplitude_m = 1e-6\n"; // the angles are 1e-5 rad, the links 4 mm long
    let (study, outcomes) = outcomes(&scene, maps);
    for (index, outcome) in outcomes.iter().enumerate() {
        let at = study.scene_of_point(&scene, index).unwrap();
        let expected: Vec<f64> = natural_modes(&at.linkage, TipConstraint::Free, false)
            .iter()
            .map(|mode| mode.frequency_hz.unwrap())
            .collect();
        assert_eq!(outcome.values[2], Err(MissingReason::NoComponent));
        for (found, expected) in
            outcome.values.iter().take(2).map(|value| value.as_ref().unwrap()).zip(expected)
        {
            // a steady sine of half a second, 5000 frames: the periodogram's parabola leaves some mHz
            assert!(
                (found / expected - 1.0).abs() < 1e-4,
                "{:?}: {found} Hz, expected {expected} Hz",
                study.point_values(index)
            );
        }
    }
}

const CONTACT: &str = "[[map]]\nname = \"fraction\"\nkind = \"stick-fraction\"\n\
                       [[map]]\nname = \"part\"\nkind = \"stick-fraction\"\nwindow = \"0.45..0.5\"\n\
                       [[map]]\nname = \"longest\"\nkind = \"longest-stick\"\n\
                       [[map]]\nname = \"transitions\"\nkind = \"transitions\"\n";

#[test]
fn a_tip_that_always_sticks_has_the_fraction_one_and_one_that_always_slips_zero() {
    // a head that moves by a picometre under full friction
    let sticks = scene(&REST);
    let axis = "[[axis]]\nname = \"friction.c\"\nvalues = [0.3, 0.6]\n";
    for outcome in outcomes(&sticks, &format!("{axis}{CONTACT}")).1 {
        assert_eq!(
            (values(&outcome), outcome.ended, outcome.stopped_at_s),
            (vec![1.0, 1.0, 1.02, 0.0], None, Some(1.02))
        );
    }
    // steady slip under friction that does not fall with speed, until well before the head turns
    let slips = scene(&[("a = 0.229", "a = 0.0"), ("stop_s = 1.02", "stop_s = 0.5")]);
    let axis = "[[axis]]\nname = \"friction.c\"\nvalues = [0.2, 0.3]\n";
    for outcome in outcomes(&slips, &format!("{axis}{CONTACT}")).1 {
        assert_eq!(values(&outcome), [0.0, 0.0, 0.0, 0.0]);
        assert!(values(&outcome).iter().all(|value| value.is_sign_positive()), "no minus before a zero");
    }
}

/// The head's motion half a period later is the mirror image of what it is now, so a blade that starts then
/// in its steady slide does the same as its mirror image.
#[test]
fn a_mirror_image_shows_the_same() {
    let at = |start_s: f64| {
        let scene = scene(&[
            ("time_s = 0.42", &format!("time_s = {start_s:?}")),
            ("stop_s = 1.02", &format!("stop_s = {:?}", start_s + 0.5)),
            ("frequency_hz = 0.915", "frequency_hz = 1.0"),
        ]);
        let window = format!("{:?}..{:?}", start_s + 0.25, start_s + 0.375);
        let maps = format!(
            "[[axis]]\nname = \"blade.preload_force_n\"\nvalues = [0.2, 0.2813]\n\
             [[map]]\nname = \"fraction\"\nkind = \"stick-fraction\"\n\
             [[map]]\nname = \"release\"\nkind = \"release-after-reversal\"\n\
             [[map]]\nname = \"force\"\nkind = \"least-normal-force\"\n\
             [[map]]\nname = \"transitions\"\nkind = \"transitions\"\n\
             [[map]]\nname = \"mean\"\nkind = \"mean-deflection\"\nwindow = \"{window}\"\n"
        );
        outcomes(&scene, &maps).1.iter().map(values).collect::<Vec<_>>()
    };
    for (one, other) in at(0.375).iter().zip(at(0.875)) {
        let [fraction, release, force, transitions, mean] = one[..] else { panic!("five maps") };
        assert!(
            transitions > 20.0 && fraction > 0.05 && fraction < 0.95,
            "a run with stick and slip: {one:?}"
        );
        let mirrored = [fraction, release, force, transitions, -mean];
        // rounding of the head's phase, magnified by some hundred transitions
        assert!(
            mirrored.iter().zip(&other).all(|(a, b)| (a - b).abs() <= 1e-5 * a.abs()),
            "{one:?} {other:?}"
        );
    }
}

/// The time in stick, counted from the list of transitions.
fn stick_s(scene: &Scene, transitions: &Transitions) -> f64 {
    let times: Vec<(f64, TipMode)> = transitions.0.iter().map(|t| (t.time_s, t.to)).collect();
    let ends = times.iter().skip(1).map(|t| t.0).chain([scene.run.stop_s]);
    times
        .iter()
        .zip(ends)
        .filter(|((_, mode), _)| *mode == TipMode::Stick)
        .map(|((from, _), to)| to - from)
        .sum()
}

#[test]
fn every_point_is_the_run_of_its_scene_and_lost_contact_has_a_reason_and_no_number() {
    let scene = scene(&[]);
    let maps = "[[axis]]\nname = \"drive.amplitude_m\"\nvalues = [0.0138, 0.03]\n\
                [[axis]]\nname = \"blade.preload_force_n\"\nvalues = [0.05, 0.1, 0.2, 0.2813]\n\
                [[map]]\nname = \"fraction\"\nkind = \"stick-fraction\"\n\
                [[map]]\nname = \"loss\"\nkind = \"contact-loss\"\n\
                [[map]]\nname = \"force\"\nkind = \"least-normal-force\"\n\
                [[map]]\nname = \"jam\"\nkind = \"jam\"\n";
    let mut flies = scene.clone();
    flies.loss = ContactLossRule::Fly;
    let flying = outcomes(&flies, maps).1;
    let (study, outcomes) = outcomes(&scene, maps);
    let (mut kept, mut lost) = (0, 0);
    for (index, (outcome, flying)) in outcomes.iter().zip(&flying).enumerate() {
        assert_eq!(flying.values[1], outcome.values[1], "the first flight starts where contact is lost");
        let at = study.scene_of_point(&scene, index).unwrap();
        let mut transitions = Transitions::default();
        let ended = run_scene(&at, &mut transitions);
        assert_eq!((outcome.status(), outcome.stopped_at_s), (ended.status.name(), Some(ended.stopped_at_s)));
        let [fraction, loss, force, jam] = &outcome.values[..] else { panic!("four maps") };
        let missing = Err::<f64, MissingReason>;
        if ended.status == RunStatus::ContactLost {
            lost += 1;
            assert_eq!(
                (fraction, loss, jam),
                (
                    &missing(MissingReason::ContactLost),
                    &Ok(ended.stopped_at_s),
                    &missing(MissingReason::ContactLost)
                )
            );
            assert!(*force.as_ref().unwrap() < 1e-9, "{force:?}");
        } else {
            kept += 1;
            let length_s = at.run.stop_s - at.start_s;
            let expected = stick_s(&at, &transitions) / length_s;
            assert!(
                (fraction.as_ref().unwrap() - expected).abs() < 1e-12 && expected > 0.05,
                "{fraction:?}, expected {expected}"
            );
            assert_eq!((loss, jam), (&missing(MissingReason::Never), &missing(MissingReason::Never)));
            assert!(*force.as_ref().unwrap() > 1e-6);
        }
    }
    assert!(kept >= 2 && lost >= 2, "the grid has both: {kept} kept, {lost} lost");
}

#[test]
fn a_blade_without_a_steady_slide_and_a_window_that_is_not_there_are_said() {
    // a tip that nothing presses onto the glass does not slide on it
    let maps = "[[axis]]\nname = \"blade.preload_force_n\"\nvalues = [0.0, 0.2813]\n\
                [[map]]\nname = \"third\"\nkind = \"release-after-reversal\"\nreversal = 3\n";
    let (_, outcomes) = outcomes(&scene(&[]), maps);
    let reasons: Vec<_> =
        outcomes.iter().map(|outcome| (outcome.status(), outcome.values[0].unwrap_err())).collect();
    assert_eq!(reasons, [("no-start", MissingReason::NoStart), ("completed", MissingReason::NoWindow)]);
}

/// Colour at a share of the width and of the height (from the bottom) of the map in a figure.
fn colour(svg: &str, across: f64, up: f64) -> [u8; 3] {
    let tree = usvg::Tree::from_str(svg, &usvg::Options::default()).unwrap();
    let size = tree.size().to_int_size();
    let mut map = tiny_skia::Pixmap::new(size.width(), size.height()).unwrap();
    resvg::render(&tree, tiny_skia::Transform::default(), &mut map.as_mut());
    // the picture of the map: its left upper corner, width and height
    let picture = svg.split("<g class=\"cells\">").nth(1).unwrap().split('>').next().unwrap();
    let number = |key: &str| -> f64 {
        picture.split(&format!(" {key}=\"")).nth(1).unwrap().split('"').next().unwrap().parse().unwrap()
    };
    let [left, top, width, height] = ["x", "y", "width", "height"].map(number);
    let (right, bottom) = (left + width, top + height);
    let units = f64::from(size.width())
        / svg.split("viewBox=\"0 0 ").nth(1).unwrap().split(' ').next().unwrap().parse::<f64>().unwrap();
    let (x, y) = (left + across * (right - left), top + (1.0 - up) * (bottom - top));
    let pixel = map.pixel((x * units) as u32, (y * units) as u32).unwrap();
    [pixel.red(), pixel.green(), pixel.blue()]
}

#[test]
fn every_cell_of_a_map_stands_in_its_place() {
    let maps = "[[axis]]\nname = \"friction.a\"\nvalues = [0.1, 0.2, 0.3]\n\
                [[axis]]\nname = \"friction.c\"\nvalues = [0.1, 1.0]\nscale = \"log\"\n\
                [[map]]\nname = \"fraction\"\nkind = \"stick-fraction\"\n";
    let text = format!(
        "format = 1\ntitle = \"t\"\nscene = \"s\"\n[camera]\nframe_rate_hz = 1e4\nexposure_s = 0.0\n{maps}"
    );
    let study = Study::parse("study", &text).unwrap();
    let found = |value: Result<f64, MissingReason>| PointOutcome {
        ended: None,
        stopped_at_s: Some(1.0),
        values: vec![value],
    };
    // the first axis goes to the right, the second one upwards
    let mut outcomes = vec![found(Ok(0.0)); 6];
    outcomes[4] = found(Ok(1.0)); // a = 0.3, c = 0.1
    outcomes[1] = found(Err(MissingReason::NoComponent)); // a = 0.1, c = 1
    let svg = sweep_map::draw_figure(&study, &scene(&[]), &outcomes, 0).to_svg(Medium::Screen);
    let (purple, yellow, grey) = ([0x44, 0x01, 0x54], [0xFD, 0xE7, 0x25], [0xE4, 0xE4, 0xE4]);
    for (across, up, expected) in [
        (0.1, 0.2, purple),
        (0.1, 0.8, grey),
        (0.5, 0.2, purple),
        (0.5, 0.8, purple),
        (0.9, 0.2, yellow),
        (0.9, 0.8, purple),
    ] {
        assert_eq!(colour(&svg, across, up), expected, "at {across} of the width and {up} of the height");
    }
    // half way between the rows on a logarithmic axis is the middle of the map
    assert_eq!([colour(&svg, 0.1, 0.47), colour(&svg, 0.1, 0.53)], [purple, grey]);
    assert!(svg.contains("no component in the band: 1") && svg.contains("the scene as written"));
    // a map without any value is a figure too, and says why
    let nothing = vec![found(Err(MissingReason::Jammed)); 6];
    let svg = sweep_map::draw_figure(&study, &scene(&[]), &nothing, 0).to_svg(Medium::Screen);
    assert!(svg.contains("jammed (Painlev\u{e9}): 6") && !svg.contains("NaN") && !svg.contains("#440154"));
}

#[test]
fn of_a_jammed_run_only_the_instant_is_known() {
    // a neck as soft as this gives way at once and the tip digs in
    let maps = "[[axis]]\nname = \"blade.neck_natural_frequency_hz\"\nvalues = [5.0, 519.0]\n\
                [[map]]\nname = \"jam\"\nkind = \"jam\"\n\
                [[map]]\nname = \"indicator\"\nkind = \"least-painleve-indicator\"\n\
                [[map]]\nname = \"loss\"\nkind = \"contact-loss\"\n\
                [[map]]\nname = \"force\"\nkind = \"least-normal-force\"\n\
                [[map]]\nname = \"transitions\"\nkind = \"transitions\"\n";
    let (_, outcomes) = outcomes(&scene(&[]), maps);
    let jammed = &outcomes[0];
    assert_eq!(jammed.status(), "jammed");
    assert_eq!(jammed.values[0].ok(), jammed.stopped_at_s);
    assert!(
        jammed.values[1].as_ref().unwrap().abs() < 1e-6,
        "{:?}: it ends where the indicator is zero",
        jammed.values[1]
    );
    assert!(jammed.values[2..].iter().all(|value| *value == Err(MissingReason::Jammed)), "{jammed:?}");
    assert!(
        outcomes[1].values[0] == Err(MissingReason::Never) && *outcomes[1].values[1].as_ref().unwrap() > 0.5
    );
}

/// A study of the actual blade with these maps, at two speeds of the head.
fn of_the_actual_blade(maps: &str) -> (Scene, Study, Vec<PointOutcome>) {
    let scene = Scene::parse("scene", ACTUAL_BLADE).unwrap();
    let axis = "[[axis]]\nname = \"drive.amplitude_m\"\nvalues = [0.04, 0.0453]\n";
    let (study, outcomes) = outcomes(&scene, &format!("{axis}{maps}"));
    (scene, study, outcomes)
}

/// Everything that a fit reads, a study maps: by the same code, so to the same bits.
#[test]
fn a_study_maps_what_a_fit_reads() {
    let band = |channel: &str, window: &str, band: &str| {
        format!("channel = \"{channel}\"\nwindow = \"{window}\"\nband_hz = {band}\n")
    };
    let ring = band("head-drop", "release+0.01..release+0.2", "[40, 140]");
    let cycle = band("deflection", "release+0.01..release+0.3", "[500, 1500]");
    let kinds = [
        ("frequency", ring.clone()),
        ("amplitude", ring.clone()),
        ("rms", ring.clone()),
        ("damping-ratio", ring),
        ("cycle-frequency-low", format!("{cycle}segment_s = 0.02\n")),
        ("cycle-frequency-high", format!("{cycle}segment_s = 0.02\n")),
        ("slip-rate", "window = \"after\"\n".to_owned()),
        ("mean-deflection", "window = \"after\"\n".to_owned()),
        ("deflection-at-speed", "part = \"after\"\nspeed_m_per_s = 0.1\n".to_owned()),
        ("friction-curve", "part = \"after\"\nspeeds_m_per_s = [0.05, 0.15]\n".to_owned()),
        ("release-after-reversal", String::new()),
        ("stick-duration", String::new()),
        ("flip-after-reversal", String::new()),
        ("flip-duration", String::new()),
        ("log-spectrum", format!("{cycle}lines = 3\nfloor_m = 1e-7\n")),
    ];
    let entry =
        |(kind, keys): (&str, String)| format!("[[map]]\nname = \"{kind}\"\nkind = \"{kind}\"\n{keys}");
    let (scene, study, outcomes) = of_the_actual_blade(&kinds.map(entry).concat());
    let columns: Vec<String> = study.maps.iter().map(SweepMap::column).collect();
    assert_eq!(columns.len(), 18, "{columns:?}");
    assert!(columns.contains(&"friction_curve_at_0_05_m_s_m".to_owned()), "{columns:?}");
    for (index, outcome) in outcomes.iter().enumerate() {
        let at = study.scene_of_point(&scene, index).unwrap();
        let effort = SolverOptions::new(at.run.relative_tolerance);
        let seen = film_scene(&at, &study.camera, at.start_s, at.run.stop_s, effort).unwrap().recording;
        let instants = ReversalInstants::find_instants(&seen);
        for (map, found) in study.maps.iter().zip(&outcome.values) {
            let expected = map.reading.read(None, &FeatureReader::new(&seen, &instants));
            match (found, &expected) {
                (Ok(found), Ok(expected)) => assert_eq!(*found, expected.value, "{}", map.name),
                (Err(reason), Err(missing)) => assert_eq!(*reason, missing.reason(), "{}", map.name),
                _ => panic!("{}: found {found:?}, expected {expected:?}", map.name),
            }
        }
        assert!(outcome.values.iter().filter(|value| value.is_ok()).count() >= 16, "{outcome:?}");
    }
}

/// What only a run knows is missing from a recording, for that reason.
#[test]
fn a_recording_does_not_show_what_only_a_run_knows() {
    let maps =
        "[[map]]\nname = \"longest\"\nkind = \"longest-stick\"\n[[map]]\nname = \"jam\"\nkind = \"jam\"\n";
    let (scene, study, outcomes) = of_the_actual_blade(maps);
    let effort = SolverOptions::new(scene.run.relative_tolerance);
    let seen = film_scene(&scene, &study.camera, scene.start_s, scene.run.stop_s, effort).unwrap().recording;
    let instants = ReversalInstants::find_instants(&seen);
    for map in &study.maps {
        assert_eq!(
            map.reading.read(None, &FeatureReader::new(&seen, &instants)),
            Err(feature::MissingValue::NoRun)
        );
    }
    assert!(outcomes[0].values[0].is_ok_and(|longest_s| longest_s > 0.05));
    assert_eq!(outcomes[0].values[1], Err(MissingReason::Never));
}

/// Four points of the committed study of the flip, against its table.
#[test]
fn the_committed_study_of_the_flip_is_what_the_program_makes() {
    let text = include_str!("../../data/sweeps/flip.toml")
        .replacen("from = 0.02\nto = 0.06\npoints = 17", "values = [0.04, 0.05]", 1)
        .replacen("from = 0.1\nto = 0.5\npoints = 17", "values = [0.15, 0.4]", 1);
    let study = Study::parse("flip", &text).unwrap();
    let scene = Scene::parse("scene", ACTUAL_BLADE).unwrap();
    let outcomes = sweep::run_all_points(&study, &scene);
    let table = include_str!("../../data/sweeps/flip/sweep.csv");
    assert!(
        table.starts_with("drive.amplitude_m,friction.c,status,stopped_at_s,flip_duration_s,damping_ratio,")
    );
    let mut decays = 0;
    for (index, outcome) in outcomes.iter().enumerate() {
        let [amplitude_m, c] = study.point_values(index)[..] else { panic!("two axes") };
        let row = table.lines().find(|row| row.starts_with(&format!("{amplitude_m},{c},"))).unwrap();
        let cells: Vec<&str> = row.split(',').skip(4).collect();
        for (cell, value) in cells.iter().zip(&outcome.values) {
            match value {
                Ok(value) => assert!((cell.parse::<f64>().unwrap() / value - 1.0).abs() < 1e-6, "{row}"),
                Err(reason) => assert!(cell.is_empty() && row.contains(reason.name()), "{row}"),
            }
        }
        decays += usize::from(outcome.values[1].is_ok());
    }
    assert_eq!(decays, 2, "the vibration dies down where friction is high, and is kept up where it is low");
}
