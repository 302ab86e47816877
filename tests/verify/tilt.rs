//! The tilt of the camera against paths whose slope is known: exact without noise, within its standard
//! deviation with it, and not claimed where the path does not show it.

use portable_math::StandardNormal;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;
use wiperlab::recording::channel::ReversalInstants;
use wiperlab::recording::files::{RecordingFile, read_recording};
use wiperlab::recording::quality::*;
use wiperlab::recording::rotate_traces;
use wiperlab::recording::{FrameGrid, Recording, Traces};

const RATE_HZ: f64 = 5_000.0;
const NOISE_M: f64 = 2e-6;
const ORIGIN: [f64; 2] = [0.03, -0.0054];

/// Place of the head of a stroke of 90 mm and back.
fn head_x_m(frame: usize, frames: usize) -> f64 {
    0.045 * (1.0 - (TAU * frame as f64 / frames as f64).cos())
}

/// A stroke and back with the tip 1 mm behind the head and 5.4 mm lower; `tip_y_m` is the height of the tip
/// above the glass at a frame and a place of the tip.
fn stroke(frames: usize, tip_y_m: &mut dyn FnMut(usize, f64) -> f64) -> Traces {
    let tip_x = |i: usize| head_x_m(i, frames) - if 2 * i < frames { 1e-3 } else { -1e-3 };
    Traces {
        tip_x_m: (0..frames).map(|i| Some(tip_x(i))).collect(),
        tip_y_m: (0..frames).map(|i| Some(ORIGIN[1] + tip_y_m(i, tip_x(i)))).collect(),
        head_x_m: (0..frames).map(|i| Some(head_x_m(i, frames))).collect(),
        head_y_m: vec![Some(0.0); frames],
        ..Traces::default()
    }
}

fn recording(traces: Traces) -> Recording {
    let grid = FrameGrid { start_s: 0.0, frame_rate_hz: RATE_HZ, frames: traces.tip_x_m.len() };
    Recording::new("made", grid, traces, true).unwrap()
}

/// The recording of a camera that is tilted by `degrees`: the glass rises by as much.
fn tilted(traces: &Traces, degrees: f64) -> Recording {
    recording(rotate_traces(traces, -degrees.to_radians(), ORIGIN).unwrap())
}

fn measured(recording: &Recording) -> Result<CameraTilt, TiltNotFound> {
    measure_tilt(recording, &ReversalInstants::find_instants(recording), &measure_quality(recording, None))
}

fn found(recording: &Recording) -> Vec<QualityFinding> {
    let optics = Optics { exposure_s: Some(5e-5), metres_per_pixel: Some(20e-6) };
    let all = collect_findings(
        recording,
        &measure_quality(recording, None),
        &optics,
        &ReversalInstants::find_instants(recording),
        &[],
    );
    all.into_iter().filter(|f| matches!(f.check.name(), "tilt" | "curved-glass")).collect()
}

struct Noise(Xoshiro256PlusPlus, f64);

impl Noise {
    fn new(seed: u64) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(seed), 0.0)
    }

    fn white(&mut self) -> f64 {
        self.0.sample(StandardNormal)
    }

    /// Unit variance, each value like the one before by a factor of exp(-1/frames).
    fn slow(&mut self, frames: f64) -> f64 {
        let like = (-1.0 / frames).exp();
        self.1 = like * self.1 + (1.0 - like * like).sqrt() * self.white();
        self.1
    }
}

/// Share of errors within one and two standard deviations, and the mean square of an error in them.
fn coverage(errors: &[f64]) -> (f64, f64, f64) {
    let within = |limit: f64| errors.iter().filter(|e| e.abs() < limit).count() as f64 / errors.len() as f64;
    (within(1.0), within(2.0), errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64)
}

#[test]
fn a_straight_line_gives_its_angle_to_rounding() {
    for degrees in [-20.0, -0.3, 0.0, 1e-3, 0.3, 5.0, 45.0] {
        for frames in [100, 3_000] {
            let found = measured(&tilted(&stroke(frames, &mut |_, _| 0.0), degrees)).unwrap();
            let error = found.angle_rad - f64::to_radians(degrees);
            assert!(error.abs() < 1e-12, "{degrees}: {error:e}");
            assert!(found.sd_rad < 1e-12 && found.curvature.is_none(), "{degrees}: {found:?}");
            assert_eq!((found.frames, found.frames_off_glass), (frames, 0));
        }
    }
}

#[test]
fn errors_are_as_large_as_the_standard_deviation_says() {
    // frames over which the errors of heights are alike
    for (alike, frames) in [(0.0, 300), (0.0, 3_000), (3.0, 3_000), (20.0, 3_000), (60.0, 3_000)] {
        let errors: Vec<f64> = (0..200)
            .map(|seed| {
                let mut noise = Noise::new(seed);
                let mut height = |_, _| NOISE_M * if alike > 0.0 { noise.slow(alike) } else { noise.white() };
                let found = measured(&tilted(&stroke(frames, &mut height), 0.3)).unwrap();
                (found.angle_rad - 0.3_f64.to_radians()) / found.sd_rad
            })
            .collect();
        let (one, two, square) = coverage(&errors);
        println!("alike {alike} frames {frames}: {one:.3} {two:.3} {square:.3}");
        // 68 % and 95 % of 200 scatter by 3.3 % and 1.5 %
        assert!((0.58..0.80).contains(&one) && two > 0.90 && square < 1.5, "{alike}: {one} {two} {square}");
    }
}

#[test]
fn a_level_recording_gives_no_finding() {
    for seed in 0..50 {
        let mut noise = Noise::new(seed);
        let traces = stroke(3_000, &mut |_, _| NOISE_M * noise.slow(10.0));
        assert_eq!(found(&recording(traces)), []);
    }
}

fn twin() -> Recording {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/data/actual-blade-twin/");
    let read = |name: &str| std::fs::read_to_string(format!("{folder}{name}")).unwrap();
    let file = RecordingFile::parse("recording.toml", &read("recording.toml")).unwrap();
    read_recording("twin", "trace.csv", &read("trace.csv"), Some(&file)).unwrap()
}

#[test]
fn the_committed_twin_is_level_and_shows_a_tilt_of_its_camera() {
    let level = measured(&twin()).unwrap();
    assert!(!level.is_clear() && level.angle_rad.abs() < 3.0 * level.sd_rad, "{level:?}");
    assert!(level.sd_rad.to_degrees() < 1e-3 && level.curvature.is_none(), "{level:?}");
    let turned = tilted(twin().traces(), 0.3);
    let tilt = measured(&turned).unwrap();
    assert!((tilt.angle_rad - 0.3_f64.to_radians()).abs() < 2.0 * tilt.sd_rad, "{tilt:?}");
    let found = found(&turned);
    let [finding] = &found[..] else { panic!("{found:?}") };
    assert_eq!(
        (finding.check.name(), finding.severity, finding.unit.as_str()),
        ("tilt", Severity::Caution, "degrees")
    );
    assert!((finding.value - 0.3).abs() < 1e-3, "{finding:?}");
    // 5.3 mm from tip to head turned by 0.3 degrees
    assert!(finding.found.contains("every deflection is shifted by 2"), "{finding:?}");
    println!("{}", finding.to_line());
}

#[test]
fn what_leaves_the_glass_does_not_count() {
    for seed in 0..20 {
        let mut noise = Noise::new(seed);
        // the tip leaves the glass in one frame of five, and flips at the end of the stroke
        let mut height = |i: usize, _| {
            let hop = if i % 500 < 100 { 3e-4 * (TAU * (i % 500) as f64 / 200.0).sin() } else { 0.0 };
            let flip = if (1_450..1_600).contains(&i) { -1e-4 } else { 0.0 };
            hop + flip + NOISE_M * noise.white()
        };
        let tilt = measured(&tilted(&stroke(3_000, &mut height), 0.3)).unwrap();
        assert!((tilt.angle_rad - 0.3_f64.to_radians()).abs() < 4.0 * tilt.sd_rad, "{tilt:?}");
        assert!(tilt.sd_rad.to_degrees() < 1e-3, "{tilt:?}");
        assert!((600..780).contains(&tilt.frames_off_glass), "{tilt:?}");
    }
}

#[test]
fn each_stroke_has_its_own_height() {
    let mut noise = Noise::new(1);
    let mut height = |i: usize, _| if i < 1_500 { 0.0 } else { 4e-5 } + NOISE_M * noise.white();
    // the second stroke is cut short, so that a common height would tilt the line
    let mut traces = stroke(3_000, &mut height);
    for column in [&mut traces.tip_x_m, &mut traces.tip_y_m, &mut traces.head_x_m, &mut traces.head_y_m] {
        column.truncate(2_000);
    }
    let level = measured(&recording(traces)).unwrap();
    assert!(level.angle_rad.abs() < 3.0 * level.sd_rad && !level.is_clear(), "{level:?}");
    assert!(level.frames > 1_900, "{level:?}");
}

#[test]
fn a_curved_glass_is_said_to_be_curved_and_makes_the_angle_uncertain() {
    const RADIUS_M: f64 = 3.0;
    for seed in 0..20 {
        let mut noise = Noise::new(seed);
        let mut height = |_, x: f64| (x - 0.045).powi(2) / (2.0 * RADIUS_M) + NOISE_M * noise.white();
        let traces = stroke(3_000, &mut height);
        let level = measured(&recording(traces.clone())).unwrap();
        let bend = level.curvature.unwrap();
        assert!((bend.per_m - 1.0 / RADIUS_M).abs() < 3.0 * bend.sd_per_m, "{bend:?}");
        // the slope of a cosine's places has the standard deviation of its amplitude over sqrt(2)
        assert!((level.sd_rad / (0.045 / RADIUS_M / 2.0_f64.sqrt()) - 1.0).abs() < 0.1, "{level:?}");
        assert!(!level.is_clear(), "{level:?}");
        let kinds: Vec<&str> = found(&recording(traces.clone())).iter().map(|f| f.check.name()).collect();
        assert_eq!(kinds, ["curved-glass"]);
        let slanted = measured(&tilted(&traces, 3.0)).unwrap();
        assert!((slanted.angle_rad - 3.0_f64.to_radians()).abs() < slanted.sd_rad && slanted.is_clear());
    }
}

#[test]
fn a_drift_of_heights_makes_the_angle_uncertain() {
    // the same drift in both strokes: opposite slopes of 0.1 degrees
    let mut noise = Noise::new(3);
    let mut height = |i: usize, _| 1e-7 * i as f64 + NOISE_M * noise.white();
    let drifting = measured(&recording(stroke(3_000, &mut height))).unwrap();
    assert!(!drifting.is_clear() && drifting.sd_rad.to_degrees() > 0.01, "{drifting:?}");
}

#[test]
fn a_long_recording_is_thinned() {
    let mut noise = Noise::new(5);
    let tilt = measured(&tilted(&stroke(250_000, &mut |_, _| NOISE_M * noise.white()), 0.3)).unwrap();
    assert!((tilt.angle_rad - 0.3_f64.to_radians()).abs() < 3.0 * tilt.sd_rad, "{tilt:?}");
    assert!((83_000..83_335).contains(&tilt.frames), "{tilt:?}");
}

#[test]
fn heights_in_whole_pixels_are_known_to_a_step_over_the_travel() {
    const PIXEL_M: f64 = 20e-6;
    let whole = |column: &[Option<f64>]| -> Vec<Option<f64>> {
        column.iter().map(|place| place.map(|place| (place / PIXEL_M).round() * PIXEL_M)).collect()
    };
    for degrees in [0.0, 0.005, 0.01, 0.02, 0.05, 0.3] {
        let slope = f64::to_radians(degrees).tan();
        let fine = stroke(3_000, &mut |_, x| slope * x);
        let traces = Traces { tip_x_m: whole(&fine.tip_x_m), tip_y_m: whole(&fine.tip_y_m), ..fine };
        let tilt = measured(&recording(traces)).unwrap();
        let error = tilt.angle_rad - slope.atan();
        assert!(error.abs() < 2.0 * tilt.sd_rad, "{degrees}: {:e} {tilt:?}", error.to_degrees());
        // a pixel over sqrt(12) standard deviations of the places, 0.045 m / sqrt(2), is 0.0104 degrees
        assert!((0.0103..0.03).contains(&tilt.sd_rad.to_degrees()), "{degrees}: {tilt:?}");
    }
}

#[test]
fn a_path_that_shows_no_slope_gives_the_reason() {
    let flat = stroke(3_000, &mut |_, _| 0.0);
    let no_height = Traces { tip_y_m: vec![None; 3_000], ..flat.clone() };
    assert_eq!(measured(&recording(no_height)), Err(TiltNotFound::TooFewFrames { frames: 0 }));
    assert_eq!(
        measured(&recording(stroke(40, &mut |_, _| 0.0))),
        Err(TiltNotFound::TooFewFrames { frames: 40 })
    );
    let still =
        Traces { tip_x_m: flat.tip_x_m.iter().map(|x| x.map(|x| 0.03 * x)).collect(), ..flat.clone() };
    assert!(
        matches!(measured(&recording(still)), Err(TiltNotFound::TooLittleTravel { travel_m }) if travel_m < 3e-3)
    );
    // three heights in turn, none of which holds half of the frames
    let mut scattered = |i: usize, _: f64| [0.0, 1e-2, 3e-2][i % 3];
    let result = measured(&recording(stroke(3_000, &mut scattered)));
    assert!(result.is_err() || !result.clone().unwrap().is_clear(), "{result:?}");
    assert!(found(&recording(stroke(3_000, &mut scattered))).is_empty());
}
