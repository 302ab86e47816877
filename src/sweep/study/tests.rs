use super::*;
use crate::feature::{Reading, ReversalInterval};
use crate::sweep::AxisSpacing;

const STUDY: &str = r#"format = 1
title = "A study"
scene = "x.toml"

[camera]
frame_rate_hz = 5000.0
exposure_s = 5e-5

[[axis]]
name = "friction.a"
from = 0.1
to = 0.3
points = 3

[[axis]]
name = "blade.neck_natural_frequency_hz"
values = [200.0, 519.0]
scale = "log"

[[map]]
name = "High component!"
kind = "frequency"
channel = "deflection"
window = "release+0.02..release+0.2"
band_hz = [200.0, 1500.0]
detrend = "line"
least_amplitude_m = 5e-7

[[map]]
name = "stick fraction"
kind = "stick-fraction"

[[map]]
name = "release"
kind = "release-after-reversal"
reversal = 2

[[map]]
name = "least force"
kind = "least-normal-force"
range = [0.0, 0.2]
"#;

fn scene() -> Scene {
    Scene::parse("light-blade.toml", include_str!("../../../data/scenes/light-blade.toml")).unwrap()
}

#[test]
fn a_study_is_read() {
    let study = Study::parse("s.toml", STUDY).unwrap();
    study.check_scene("s.toml", &scene()).unwrap();
    assert_eq!((study.point_count(), study.camera.exposure_s), (6, 5e-5));
    assert_eq!(
        (study.axes[0].values.as_slice(), study.axes[1].values.as_slice()),
        ([0.1, 0.2, 0.3].as_slice(), [200.0, 519.0].as_slice())
    );
    assert_eq!(
        study.axes.iter().map(|axis| axis.spacing).collect::<Vec<_>>(),
        [AxisSpacing::Linear, AxisSpacing::Log]
    );
    let columns: Vec<String> = study.maps.iter().map(SweepMap::column).collect();
    assert_eq!(columns, ["high_component_hz", "stick_fraction", "release_s", "least_force_n"]);
    assert_eq!(study.maps[0].slug, "high-component");
    assert_eq!(
        (study.maps[3].range, study.maps[2].reading.clone()),
        (
            Some((0.0, 0.2)),
            Reading::Interval { interval: ReversalInterval::ReleaseAfterReversal, reversal: 2 }
        )
    );
}

/// Text that is replaced, its replacement, and parts of the error message.
const REFUSED: [(&str, &str, &[&str]); 30] = [
    ("format = 1", "format = 2", &["s.toml: key `format`: found 2, expected 1"]),
    ("scene = \"x.toml\"", "scene = \" \"", &["s.toml: scene: found \" \"", "relative to this file"]),
    ("from = 0.1", "form = 0.1", &["s.toml:11:1: unknown key `axis[1].form`; did you mean `from`?"]),
    ("frame_rate_hz = 5000.0", "frame_rate_hz = 0.0", &["camera.frame_rate_hz: found 0", "above 0"]),
    ("exposure_s = 5e-5", "exposure_s = 5e-3", &["camera.exposure_s: found 0.005, expected 0 to 0.0002"]),
    (
        "name = \"friction.a\"",
        "name = \"friction.d\"",
        &["axis `friction.d`, `name`: not a parameter of a scene; did you mean `friction."],
    ),
    ("from = 0.1", "from = 0.3", &["axis `friction.a`, `to`: found 0.3 to 0.3", "exchange or correct"]),
    ("from = 0.1\n", "", &["axis `friction.a`, `from`: expected `from`, `to` and `points`"]),
    ("from = 0.1", "from = -0.1", &["axis `friction.a`: found -0.1, expected a number of 0 or more"]),
    ("from = 0.1", "from = nan", &["axis `friction.a`, `to`: found NaN to 0.3"]),
    (
        "from = 0.1",
        "scale = \"log\"\nfrom = 0.0",
        &["axis `friction.a`, `scale`: found \"log\" with the value 0"],
    ),
    ("points = 3", "points = 1", &["axis `friction.a`, `points`: found 1, expected 2 to 100000"]),
    (
        "points = 3",
        "points = 50000001",
        &["axis: found 100000002 points in all, expected at most 100000000", "[sample]"],
    ),
    ("points = 3", "points = 100001", &["`points`: found 100001, expected 2 to 100000"]),
    (
        "points = 3",
        "points = 3\nvalues = [0.1, 0.2]",
        &["axis `friction.a`, `values`: found together with `from`"],
    ),
    ("values = [200.0, 519.0]", "values = [519.0, 200.0]", &["found 519 before 200, expected rising values"]),
    ("values = [200.0, 519.0]", "values = [519.0]", &["found 1, expected two values or more"]),
    (
        "name = \"friction.a\"\nfrom = 0.1\nto = 0.3",
        "name = \"blade.neck_stiffness_n_m_per_rad\"\nfrom = 0.001\nto = 0.01",
        &["sets the same quantity"],
    ),
    (
        "kind = \"stick-fraction\"",
        "kind = \"stick-fractoin\"",
        &["map `stick fraction`, `kind`: unknown kind `stick-fractoin`; did you mean `stick-fraction`?"],
    ),
    (
        "name = \"stick fraction\"",
        "name = \"--\"",
        &["map `--`, `name`: expected a name with letters a to z"],
    ),
    (
        "name = \"stick fraction\"",
        "name = \"high component\"",
        &["map `high component`, `name`: its file `high-component.svg` is that of the map `High component!`"],
    ),
    (
        "name = \"stick fraction\"",
        "name = \"Status\"",
        &["map `Status`, `name`: `status` is a column of every table"],
    ),
    (
        "channel = \"deflection\"",
        "channel = \"deflexion\"",
        &["map `High component!`, `channel`", "did you mean `deflection`?"],
    ),
    (
        "band_hz = [200.0, 1500.0]",
        "band_hz = [200.0, 2600.0]",
        &["`band_hz`: found [200, 2600], expected at most half the camera's frame rate, 2500 Hz"],
    ),
    ("release+0.2\"", "relase+0.2\"", &["map `High component!`, `window`", "`relase+0.2`"]),
    (
        "detrend = \"line\"",
        "detrend = \"lime\"",
        &["map `High component!`, `detrend`: unknown detrending `lime`"],
    ),
    (
        "reversal = 2",
        "window = \"..\"",
        &["map `release`, `window`: has no meaning for this kind of map, which takes reversal; remove it"],
    ),
    (
        "least_amplitude_m = 5e-7",
        "least_amplitude_m = -5e-7",
        &["map `High component!`, `least_amplitude_m`: found -0.0000005"],
    ),
    (
        "kind = \"stick-fraction\"",
        "kind = \"stick-fraction\"\nleast_amplitude_m = 1.0",
        &["`least_amplitude_m`: has no meaning for this kind"],
    ),
    ("range = [0.0, 0.2]", "range = [0.2, 0.2]", &["map `least force`, `range`: found [0.2, 0.2]"]),
];

#[test]
fn what_cannot_be_used_is_refused_with_its_key_and_the_remedy() {
    for (from, to, parts) in REFUSED {
        assert!(STUDY.contains(from), "{from}");
        let refusal = Study::parse("s.toml", &STUDY.replacen(from, to, 1)).unwrap_err().to_string();
        assert!(parts.iter().all(|part| refusal.contains(part)), "{to}: {refusal}");
    }
    let twice = format!("{STUDY}\n[[axis]]\nname = \"friction.a\"\nvalues = [0.1, 0.2]\n");
    let refusal = Study::parse("s.toml", &twice).unwrap_err().to_string();
    assert!(refusal.contains("sets the same quantity as the axis `friction.a`"), "{refusal}");
    let no_map = STUDY.split("[[map]]").next().unwrap();
    assert!(Study::parse("s.toml", no_map).unwrap_err().to_string().contains("map: found none"));
}

#[test]
fn a_study_that_does_not_fit_its_scene_is_refused_before_anything_runs() {
    let refusal = |from: &str, to: &str| {
        let study = Study::parse("s.toml", &STUDY.replacen(from, to, 1)).unwrap();
        study.check_scene("s.toml", &scene()).unwrap_err().to_string()
    };
    let outside = refusal("release+0.02..release+0.2", "0.5..1.5");
    let expected = "map `High component!`, `window`: found `0.5..1.5`, expected one within the scene's run, \
                    0.42 s to 1.02 s";
    assert!(outside.contains(expected), "{outside}");
    let fast = refusal("frame_rate_hz = 5000.0\nexposure_s = 5e-5", "frame_rate_hz = 1e9\nexposure_s = 0.0");
    assert!(fast.contains("camera.frame_rate_hz: found 6.000e8 frames"), "{fast}");
    let shoulder = refusal("friction.a", "shoulder.stiffness_ratio");
    assert!(
        shoulder.contains("the point with shoulder.stiffness_ratio = 0.1")
            && shoulder.contains("no [shoulder]"),
        "{shoulder}"
    );
}

#[test]
fn the_fingerprint_sees_every_part_and_their_borders() {
    let base = fingerprint(&["ab", "c"]);
    assert_eq!(base.len(), 64);
    assert!([["a", "bc"], ["ab", "d"], ["abc", ""]].iter().all(|parts| fingerprint(parts) != base));
}

const AXES: [&str; 3] = ["friction.a", "friction.c", "drive.amplitude_m"];

/// A study of three parameters; `keys` are added to every axis.
fn of_three(sample: &str, keys: &str) -> Result<Study, StudyError> {
    let axes = AXES.map(|name| format!("[[axis]]\nname = \"{name}\"\nfrom = 0.01\nto = 0.1\n{keys}\n"));
    let (head, maps) = (STUDY.split("[[axis]]").next().unwrap(), STUDY.split_once("[[map]]").unwrap().1);
    Study::parse("s.toml", &format!("{head}{sample}{}[[map]]{maps}", axes.concat()))
}

#[test]
fn a_grid_has_any_number_of_axes() {
    let study = of_three("", "points = 4").unwrap();
    assert_eq!((study.point_count(), study.is_mapped()), (64, false));
    assert_eq!(study.point_values(0), [0.01; 3]);
    assert_eq!(study.point_values(63), [0.1; 3]);
    assert_eq!(study.point_values(7), [0.01, 0.04, 0.1]);
    assert!(of_three("", "points = 1000").is_err());
}

#[test]
fn a_sample_fills_the_ranges_and_its_seed_matters() {
    let sampled = |sample: &str, keys| of_three(&format!("[sample]\n{sample}\n"), keys);
    let study = sampled("points = 1000", "").unwrap();
    study.check_scene("s.toml", &scene()).unwrap();
    let places: Vec<Vec<f64>> = (0..1000).map(|index| study.point_values(index)).collect();
    assert!(places.iter().flatten().all(|value| (0.01..=0.1).contains(value)));
    let mean = |axis: usize| places.iter().map(|place| place[axis]).sum::<f64>() / 1000.0;
    assert!((0..3).all(|axis| (mean(axis) - 0.055).abs() < 3e-4));
    let other = sampled("points = 1000\nseed = 1\nmethod = \"sobol\"", "").unwrap();
    assert_ne!(other.point_values(0), study.point_values(0));
    assert_ne!(other.fingerprint(&scene()), study.fingerprint(&scene()));
    let log = sampled("points = 1000", "scale = \"log\"").unwrap();
    assert_ne!(log.fingerprint(&scene()), study.fingerprint(&scene()));
    let below = (0..1000).filter(|index| log.point_values(*index)[1] < 0.001_f64.sqrt()).count();
    assert!((495..=505).contains(&below), "{below}");
    for (sample, keys, part) in [
        ("points = 1", "", "sample.points: found 1, expected 2 to 100000000"),
        ("seed = 3", "", "key `sample.points`: found nothing, expected a whole number"),
        ("points = 10\nmethod = \"halton\"", "", "sobol"),
        ("points = 10", "points = 3", "axis `friction.a`, `points`: found next to a [sample]"),
        ("points = 10\nstep = 2", "", "step"),
    ] {
        let refusal = sampled(sample, keys).unwrap_err().to_string();
        assert!(refusal.contains(part), "{refusal}");
    }
}
