//! The quality verdict against recordings whose faults are known: each is found with its number, and nothing
//! else is.

use portable_math::StandardNormal;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::{PI, TAU};
use wiperlab::recording::channel::ReversalInstants;
use wiperlab::recording::noise::{noise_floor, quantisation_step};
use wiperlab::recording::quality::*;
use wiperlab::recording::{FrameGrid, Recording, Traces};

const RATE_HZ: f64 = 5_000.0;
const NOISE_M: f64 = 2e-6;
const OPTICS: Optics = Optics { exposure_s: Some(5e-5), metres_per_pixel: Some(20e-6) };

struct Noise(Xoshiro256PlusPlus);

impl Noise {
    fn new(seed: u64) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(seed))
    }

    fn next(&mut self) -> f64 {
        self.0.sample(StandardNormal)
    }

    fn column(&mut self, frames: usize, sd: f64) -> Vec<f64> {
        (0..frames).map(|_| sd * self.next()).collect()
    }
}

/// Tip and head of a stroke: a cosine of 0.75 Hz and 45 mm, as the published blade is driven, the tip 1 mm
/// behind and 5 mm lower.
fn stroke(frames: usize, seed: u64, noise_m: f64) -> Traces {
    let head = |i: usize| 0.045 * (1.0 - (TAU * 0.75 * (i as f64 / RATE_HZ + 0.5)).cos());
    let mut noise = Noise::new(seed);
    let mut column = |place: &dyn Fn(usize) -> f64| {
        (0..frames).map(|i| Some(place(i) + noise_m * noise.next())).collect::<Vec<_>>()
    };
    Traces {
        tip_x_m: column(&|i| head(i) - 1e-3),
        tip_y_m: column(&|_| -5.4e-3),
        head_x_m: column(&head),
        head_y_m: column(&|i| 1e-4 * (TAU * 20.0 * i as f64 / RATE_HZ).cos()),
        ..Traces::default()
    }
}

fn recording_at(traces: Traces, frame_rate_hz: f64) -> Recording {
    let grid = FrameGrid { start_s: 0.0, frame_rate_hz, frames: traces.tip_x_m.len() };
    Recording::new("made", grid, traces, true).unwrap()
}

fn recording(traces: Traces) -> Recording {
    recording_at(traces, RATE_HZ)
}

fn judged(recording: &Recording, optics: &Optics) -> (Quality, Vec<QualityFinding>) {
    let measured = measure_quality(recording, optics.exposure_s);
    let found =
        collect_findings(recording, &measured, optics, &ReversalInstants::find_instants(recording), &[]);
    (measured, found)
}

fn of(traces: Traces) -> Vec<QualityFinding> {
    judged(&recording(traces), &OPTICS).1
}

/// Channel and severity of every finding of a check.
fn told<'a>(found: &'a [QualityFinding], check: &str) -> Vec<(&'a str, Severity)> {
    found
        .iter()
        .filter(|f| f.check.name() == check)
        .map(|f| (f.channel.as_deref().unwrap_or(""), f.severity))
        .collect()
}

fn value(found: &[QualityFinding], check: &str) -> f64 {
    found.iter().find(|f| f.check.name() == check).unwrap_or_else(|| panic!("no {check} in {found:?}")).value
}

fn doubts(found: &[QualityFinding]) -> Vec<&QualityFinding> {
    found.iter().filter(|f| f.severity > Severity::Note).collect()
}

/// Several frames in a row of a column replaced.
fn with_tip(mut traces: Traces, change: impl Fn(usize, f64) -> f64) -> Traces {
    traces.tip_x_m = traces.tip_x_m.iter().enumerate().map(|(i, x)| x.map(|x| change(i, x))).collect();
    traces
}

#[test]
fn a_sound_stroke_is_good_and_its_noise_is_read() {
    for seed in 0..20 {
        let (measured, found) = judged(&recording(stroke(4_000, seed, NOISE_M)), &OPTICS);
        assert_eq!(doubts(&found), Vec::<&QualityFinding>::new());
        assert_eq!(told(&found, "outliers"), []);
        let noise: Vec<&QualityFinding> = found.iter().filter(|f| f.check.name() == "noise").collect();
        assert_eq!(noise.len(), 4);
        for finding in noise {
            // the median of 4,000 third differences, correlated over three, is known to 3 %
            assert!((finding.value / NOISE_M - 1.0).abs() < 0.12 && finding.unit == "m", "{finding:?}");
        }
        assert!(
            verdict_lines(&measured, &found)[0].starts_with("good: shows oscillations from about 3.751 Hz"),
            "{:?}",
            verdict_lines(&measured, &found)
        );
    }
}

#[test]
fn motion_without_noise_gives_no_alarm() {
    assert_eq!(doubts(&of(stroke(20_000, 1, 0.0))), Vec::<&QualityFinding>::new());
}

#[test]
fn the_committed_twin_is_good() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/data/actual-blade-twin/");
    let read = |name: &str| std::fs::read_to_string(format!("{folder}{name}")).unwrap();
    let file =
        wiperlab::recording::files::RecordingFile::parse("recording.toml", &read("recording.toml")).unwrap();
    let recording =
        wiperlab::recording::files::read_recording("twin", "trace.csv", &read("trace.csv"), Some(&file))
            .unwrap();
    let (measured, found) = judged(&recording, &Optics::from(&file.camera));
    assert_eq!(Some(&measured), file.quality.as_ref());
    assert_eq!(doubts(&found), Vec::<&QualityFinding>::new());
    assert_eq!((told(&found, "outliers"), value(&found, "reversals")), (vec![], 1.0));
}

#[test]
fn a_twin_without_noise_gives_no_alarm() {
    use wiperlab::simulate::{SolverOptions, scene::Scene};
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/data/scenes/actual-blade.toml");
    let scene = Scene::parse("scene", &std::fs::read_to_string(path).unwrap()).unwrap();
    for (frame_rate_hz, exposure_s) in [(5_000.0, 5e-5), (20_000.0, 0.0)] {
        let camera = wiperlab::simulate::twin::Camera { frame_rate_hz, exposure_s };
        let seen = wiperlab::simulate::twin::film_scene(
            &scene,
            &camera,
            scene.start_s,
            scene.run.stop_s,
            SolverOptions::new(1e-8),
        )
        .unwrap()
        .recording;
        let (_, found) =
            judged(&seen, &Optics { exposure_s: Some(exposure_s).filter(|&t| t > 0.0), ..OPTICS });
        assert_eq!(doubts(&found), Vec::<&QualityFinding>::new());
        assert_eq!(told(&found, "outliers"), [], "{found:?}");
    }
}

fn tip_outliers(traces: &Traces) -> Vec<usize> {
    let (noise_m, step_m) = (noise_floor(&traces.tip_x_m), quantisation_step(&traces.tip_x_m));
    outlier_frames(
        &traces.tip_x_m,
        &ChannelQuality { missing_frames: 0, noise_m, step_m },
        OPTICS.metres_per_pixel,
    )
}

#[test]
fn outliers_are_counted_exactly() {
    let places: Vec<usize> = (0..60).map(|k| 40 + 65 * k).collect();
    for seed in 0..20 {
        let size = |i: usize| if i.is_multiple_of(2) { 25.0 * NOISE_M } else { -40.0 * NOISE_M };
        let traces =
            with_tip(stroke(4_000, seed, NOISE_M), |i, x| if places.contains(&i) { x + size(i) } else { x });
        assert_eq!(tip_outliers(&traces), places);
        let found = of(traces);
        assert_eq!(
            (told(&found, "outliers"), value(&found, "outliers")),
            (vec![("tip-x", Severity::Caution)], 60.0)
        );
    }
    let one = of(with_tip(stroke(4_000, 3, NOISE_M), |i, x| if i == 2_000 { x + 1e-3 } else { x }));
    assert_eq!((told(&one, "outliers"), value(&one, "outliers")), (vec![("tip-x", Severity::Note)], 1.0));
}

/// Jumps in frames whose neighbours are partly lost are found wherever the neighbours lie within nine frames.
#[test]
fn outliers_are_found_between_lost_frames() {
    for (seed, lost, least) in [(1, 0.05, 59), (2, 0.15, 57), (3, 0.3, 50)] {
        let places: Vec<usize> = (0..60).map(|k| 40 + 65 * k).collect();
        let mut traces =
            with_tip(
                stroke(4_000, seed, NOISE_M),
                |i, x| {
                    if places.contains(&i) { x + 100.0 * NOISE_M } else { x }
                },
            );
        let mut drop = Noise::new(seed);
        for (i, x) in traces.tip_x_m.iter_mut().enumerate() {
            *x = x.filter(|_| drop.0.random::<f64>() >= lost || places.contains(&i));
        }
        let found = tip_outliers(&traces);
        assert!(found.iter().all(|frame| places.contains(frame)), "{lost}: {found:?}");
        assert!(found.len() >= least, "{lost}: {} of 60", found.len());
    }
}

#[test]
fn a_million_frames_of_noise_hold_no_outlier() {
    let noise: Vec<Option<f64>> = Noise::new(5).column(1_000_000, NOISE_M).into_iter().map(Some).collect();
    let measured = ChannelQuality { missing_frames: 0, noise_m: noise_floor(&noise), step_m: None };
    assert_eq!(outlier_frames(&noise, &measured, None), Vec::<usize>::new());
}

/// Bursts of chatter that set in at once and ring down, at every phase, with and without noise and with lost
/// frames.
#[test]
fn chatter_is_no_outlier() {
    for (seed, noise_m) in [(1, 0.0), (2, NOISE_M), (3, 0.2 * NOISE_M)] {
        for frequency_hz in [78.4, 359.0, 692.0, 900.0, 1_064.0, 1_247.0, 1_666.0, 1_900.0] {
            for phase in 0..8 {
                let chatter = |i: usize| {
                    let t = (i % 400) as f64 / RATE_HZ - 0.02;
                    let cycles = TAU * frequency_hz * t + f64::from(phase) * PI / 4.0;
                    if t < 0.0 {
                        0.0
                    } else {
                        3e-4 * (cycles.sin() - (f64::from(phase) * PI / 4.0).sin()) * (-60.0 * t).exp()
                    }
                };
                let traces = with_tip(stroke(4_000, seed, noise_m), |i, x| x + chatter(i));
                assert_eq!(
                    tip_outliers(&traces),
                    Vec::<usize>::new(),
                    "{frequency_hz} Hz, phase {phase}, noise {noise_m}"
                );
            }
        }
    }
}

#[test]
fn chatter_with_lost_frames_is_no_outlier() {
    for (seed, lost) in [(1, 0.05), (2, 0.2), (3, 0.4)] {
        let mut traces = with_tip(stroke(20_000, seed, NOISE_M), |i, x| {
            x + 3e-4 * (TAU * 900.0 * i as f64 / RATE_HZ).sin()
        });
        let mut drop = Noise::new(seed);
        traces.tip_x_m.iter_mut().for_each(|x| *x = x.filter(|_| drop.0.random::<f64>() >= lost));
        assert_eq!(told(&of(traces), "outliers"), [], "{lost}");
    }
}

/// The lip tips over within one frame or several, smoothly or along a straight line, with an overshoot or
/// not.
#[test]
fn a_flip_of_the_blade_is_no_outlier() {
    for (seed, noise_m) in [(1, 0.0), (2, NOISE_M)] {
        for frames in [0.5, 1.0, 1.5, 2.0, 3.0, 5.0, 10.0] {
            for overshoot in [0.0, 0.3] {
                let flip = |i: usize| {
                    let after = (i as f64 - 2_000.3) / frames;
                    let ring = overshoot * (-after / 2.0).exp() * (TAU * after / 5.0).sin();
                    2e-3 * if after < 0.0 { 0.0 } else { after.min(1.0) + ring }
                };
                let traces = with_tip(stroke(4_000, seed, noise_m), |i, x| x - flip(i));
                assert_eq!(
                    told(&of(traces), "outliers"),
                    [],
                    "{frames} frames, overshoot {overshoot}, noise {noise_m}"
                );
            }
        }
    }
}

#[test]
fn gaps_are_counted_on_the_deflection_and_on_each_channel() {
    let mut traces = stroke(100, 1, NOISE_M);
    for frame in [2, 3] {
        traces.tip_x_m[frame] = None;
    }
    for frame in [4, 9] {
        (traces.head_x_m[frame], traces.head_y_m[frame]) = (None, None);
    }
    traces.tip_y_m = vec![None; 100];
    let (measured, found) =
        judged(&recording_at(traces, 100.0), &Optics { exposure_s: Some(0.005), ..OPTICS });
    assert_eq!((measured.missing_deflection_frames, measured.gaps, measured.longest_gap_frames), (4, 2, 3));
    assert_eq!((measured.longest_gap_at_s, measured.tip_y.missing_frames), (Some(0.02), 100));
    assert!((measured.exposure_passes_at_nyquist.unwrap() - 0.900_316).abs() < 1e-6);
    let gaps = [
        ("", Severity::Note),
        ("tip-x", Severity::Note),
        ("head-x", Severity::Note),
        ("head-y", Severity::Note),
    ];
    assert_eq!(told(&found, "gaps"), gaps);
    let counts: Vec<f64> = found.iter().filter(|f| f.check.name() == "gaps").map(|f| f.value).collect();
    assert_eq!((counts, told(&found, "absent")), (vec![4.0, 2.0, 2.0, 2.0], vec![("tip-y", Severity::Note)]));
    assert!(
        found.iter().any(|f| f.found
            == "no deflection in 4 frames (4.0 %) in 2 gaps, the longest 3 frames from 0.020000 s"),
        "{found:?}"
    );
}

#[test]
fn many_lost_frames_and_a_long_gap_are_cautions_and_no_deflection_is_serious() {
    let without = |lost: &dyn Fn(usize) -> bool| {
        let mut traces = stroke(4_000, 1, NOISE_M);
        traces.head_x_m.iter_mut().enumerate().for_each(|(i, x)| *x = x.filter(|_| !lost(i)));
        judged(&recording(traces), &OPTICS)
    };
    assert_eq!(told(&without(&|i| i % 4 == 1).1, "gaps")[0], ("", Severity::Caution));
    assert_eq!(told(&without(&|i| (1_000..1_201).contains(&i)).1, "gaps")[0], ("", Severity::Caution));
    assert_eq!(told(&without(&|i| (1_000..1_200).contains(&i)).1, "gaps")[0], ("", Severity::Note));
    let (measured, found) = without(&|_| true);
    assert_eq!(
        (told(&found, "gaps"), grade_findings(&found)),
        (vec![("", Severity::Serious)], Grade::NotUsable)
    );
    assert!(verdict_lines(&measured, &found)[0].starts_with("not usable for deflection"));
}

#[test]
fn a_step_coarser_than_the_noise_is_a_caution() {
    let rounded = |step: f64, noise_m: f64| {
        let mut traces = stroke(4_000, 1, noise_m);
        for column in [&mut traces.tip_x_m, &mut traces.tip_y_m, &mut traces.head_x_m, &mut traces.head_y_m] {
            column.iter_mut().for_each(|x| *x = x.map(|x| (x / step).round() * step));
        }
        of(traces)
    };
    let found = rounded(20e-6, NOISE_M);
    let all = [
        ("tip-x", Severity::Caution),
        ("tip-y", Severity::Caution),
        ("head-x", Severity::Caution),
        ("head-y", Severity::Caution),
    ];
    assert!(
        told(&found, "position-step").iter().all(|told| all.contains(told))
            && told(&found, "position-step").len() >= 3,
        "{found:?}"
    );
    assert!(
        (value(&found, "position-step") / 20e-6 - 1.0).abs() < 1e-6
            && found.iter().any(|f| f.found.contains("(whole pixels)"))
    );
    for check in ["pre-filtered", "outliers", "frozen-frames"] {
        assert_eq!(told(&found, check), [], "{check}");
    }
    assert_eq!(told(&rounded(1e-6, NOISE_M), "position-step"), []);
    // at the turn of the head nothing moves for frames on end where noise is below the step
    assert_eq!(
        (told(&rounded(20e-6, 0.0), "frozen-frames"), told(&rounded(20e-6, 0.2 * NOISE_M), "frozen-frames")),
        (vec![], vec![])
    );
}

/// A second-order Butterworth low-pass, forwards, by the bilinear transform; `cut` in units of the Nyquist
/// frequency.
fn butterworth(samples: &[f64], cut: f64) -> Vec<f64> {
    let k = (PI * cut / 2.0).tan();
    let norm = 1.0 + 2.0_f64.sqrt() * k + k * k;
    let (b, a1, a2) = (k * k / norm, 2.0 * (k * k - 1.0) / norm, (1.0 - 2.0_f64.sqrt() * k + k * k) / norm);
    let mut last = ([samples[0]; 2], [samples[0]; 2]);
    let step = |&x: &f64| {
        let y = b * (x + 2.0 * last.0[0] + last.0[1]) - a1 * last.1[0] - a2 * last.1[1];
        last = ([x, last.0[0]], [y, last.1[0]]);
        y
    };
    samples.iter().map(step).collect()
}

/// Forwards and backwards: without delay, as tracking programs filter.
fn filtered(samples: &[f64], cut: f64) -> Vec<f64> {
    let mut back = butterworth(samples, cut);
    back.reverse();
    let mut both = butterworth(&back, cut);
    both.reverse();
    both
}

fn moving_average(samples: &[f64], width: usize) -> Vec<f64> {
    let mean = |i: usize| &samples[i.saturating_sub(width / 2)..(i + width / 2 + 1).min(samples.len())];
    (0..samples.len()).map(|i| mean(i).iter().sum::<f64>() / mean(i).len() as f64).collect()
}

fn tip_filtered(frames: usize, seed: u64, filter: impl Fn(&[f64]) -> Vec<f64>) -> Vec<QualityFinding> {
    let mut traces = stroke(frames, seed, NOISE_M);
    let tip: Vec<f64> = traces.tip_x_m.iter().flatten().copied().collect();
    traces.tip_x_m = filter(&tip).into_iter().map(Some).collect();
    of(traces)
}

#[test]
fn a_low_passed_trace_is_noticed_with_its_cut() {
    for seed in 0..20 {
        for cut in [0.2, 0.3, 0.5, 0.7] {
            let found = tip_filtered(6_000, seed, |tip| filtered(tip, cut));
            assert_eq!(
                told(&found, "pre-filtered"),
                [("tip-x", Severity::Caution)],
                "cut {cut}, seed {seed}"
            );
            let ratio = value(&found, "pre-filtered") / (cut * RATE_HZ / 2.0);
            assert!((0.6..1.5).contains(&ratio), "cut {cut}, seed {seed}: {ratio}");
        }
    }
}

/// A mean of five frames falls slowly at first, so that the plateau of a short record may be too uneven to be
/// one.
#[test]
fn a_mean_of_a_few_frames_is_nearly_always_noticed() {
    for (width, least) in [(3, 20), (5, 18)] {
        let noticed = (0..20).filter(|&seed| {
            told(&tip_filtered(6_000, seed, |tip| moving_average(tip, width)), "pre-filtered")
                == [("tip-x", Severity::Caution)]
        });
        assert!(noticed.count() >= least, "{width}");
    }
}

#[test]
fn chatter_on_white_noise_is_no_filter() {
    for seed in 0..10 {
        let traces = with_tip(stroke(6_000, seed, NOISE_M), |i, x| {
            x + 1e-4 * (TAU * (300.0 + 0.05 * i as f64) * i as f64 / RATE_HZ).sin()
        });
        assert_eq!(told(&of(traces), "pre-filtered"), []);
        let traces = with_tip(stroke(6_000, seed, 0.0), |i, x| {
            x + 1e-4 * (TAU * (300.0 + 0.05 * i as f64) * i as f64 / RATE_HZ).sin()
        });
        assert_eq!(told(&of(traces), "pre-filtered"), []);
    }
}

/// A tracker that follows its own last match drifts: its error is a random walk, whose power falls as 1/f^2
/// without a filter.
#[test]
fn a_drifting_tracker_is_no_filter() {
    for (seed, frames) in (0..25).flat_map(|seed| [(seed, 2_200), (seed, 6_000)]) {
        let mut walk = 0.0;
        let drift: Vec<f64> = Noise::new(100 + seed)
            .column(frames, 0.3 * NOISE_M)
            .into_iter()
            .map(|step| (walk += step, walk).1)
            .collect();
        for noise_m in [0.0, NOISE_M] {
            assert_eq!(
                told(&of(with_tip(stroke(frames, seed, noise_m), |i, x| x + drift[i])), "pre-filtered"),
                [],
                "seed {seed}, {frames} frames, noise {noise_m}"
            );
        }
    }
}

#[test]
fn white_noise_is_no_filter() {
    for (seed, frames) in (0..30).flat_map(|seed| [(seed, 2_112), (seed, 6_000)]) {
        assert_eq!(told(&of(stroke(frames, seed, NOISE_M)), "pre-filtered"), [], "seed {seed}");
    }
}

#[test]
fn repeated_frames_are_counted_exactly() {
    let repeated = |every: usize| {
        let mut traces = stroke(4_000, 1, NOISE_M);
        for column in [&mut traces.tip_x_m, &mut traces.tip_y_m, &mut traces.head_x_m, &mut traces.head_y_m] {
            (1..column.len()).filter(|i| i % every == every - 1).for_each(|i| column[i] = column[i - 1]);
        }
        of(traces)
    };
    assert_eq!(
        (told(&repeated(5), "frozen-frames"), value(&repeated(5), "frozen-frames")),
        (vec![("", Severity::Serious)], 800.0)
    );
    assert_eq!(
        (told(&repeated(1_000), "frozen-frames"), value(&repeated(1_000), "frozen-frames")),
        (vec![("", Severity::Caution)], 4.0)
    );
}

#[test]
fn a_wrong_scale_is_noticed_both_ways() {
    let scaled = |by: f64| {
        let mut traces = stroke(4_000, 1, NOISE_M);
        for column in [&mut traces.tip_x_m, &mut traces.tip_y_m, &mut traces.head_x_m, &mut traces.head_y_m] {
            column.iter_mut().for_each(|x| *x = x.map(|x| by * x));
        }
        of(traces)
    };
    assert_eq!(told(&scaled(1.0), "scale"), [("", Severity::Note)]);
    assert_eq!(told(&scaled(1.0 / 20e-6 * 1e-3), "scale"), [("", Severity::Serious)]); // pixels of 20 um taken for millimetres
    assert_eq!(told(&scaled(10.0), "scale"), [("", Severity::Caution)]);
    // a travel of 1.5 mm is possible, a blade 0.1 mm high is not
    assert_eq!(told(&scaled(20e-6 / 1e-3), "scale"), [("", Severity::Caution), ("", Severity::Note)]);
    assert_eq!(told(&scaled(1e-3), "scale"), [("", Severity::Caution)]);
}

#[test]
fn a_tip_above_the_head_is_a_caution() {
    let mut traces = stroke(4_000, 1, NOISE_M);
    assert_eq!(told(&of(traces.clone()), "y-direction"), []);
    for column in [&mut traces.tip_y_m, &mut traces.head_y_m] {
        column.iter_mut().for_each(|y| *y = y.map(|y| -y));
    }
    let found = of(traces.clone());
    assert_eq!(told(&found, "y-direction"), [("", Severity::Caution)]);
    assert!((value(&found, "y-direction") / 5.4e-3 - 1.0).abs() < 0.02, "{found:?}");
    traces.tip_y_m.iter_mut().for_each(|y| *y = y.map(|y| y - 5.4e-3)); // each with its own origin
    assert_eq!(told(&of(traces.clone()), "y-direction"), []);
    traces.head_y_m = vec![None; 4_000];
    assert_eq!(told(&of(traces), "y-direction"), []);
}

#[test]
fn tracks_that_start_or_end_apart_are_told() {
    let spans = |tip: std::ops::Range<usize>, head: std::ops::Range<usize>| {
        let mut traces = stroke(4_000, 1, NOISE_M);
        traces.tip_x_m.iter_mut().enumerate().for_each(|(i, x)| *x = x.filter(|_| tip.contains(&i)));
        traces.head_x_m.iter_mut().enumerate().for_each(|(i, x)| *x = x.filter(|_| head.contains(&i)));
        of(traces)
    };
    let cases = [
        (0..4_000, 0..4_000, Severity::Note, 4_000.0),
        (100..4_000, 0..3_900, Severity::Note, 3_800.0),
        (0..2_500, 100..4_000, Severity::Caution, 2_400.0),
    ];
    for (tip, head, severity, both) in cases {
        let found = spans(tip, head);
        assert_eq!((told(&found, "overlap"), value(&found, "overlap")), (vec![("", severity)], both));
    }
    let found = spans(0..2_000, 2_000..4_000);
    assert_eq!((told(&found, "overlap"), value(&found, "overlap")), (vec![("", Severity::Serious)], 0.0));
}

#[test]
fn a_rate_of_playback_is_serious_and_comes_first() {
    let (measured, found) = judged(&recording_at(stroke(4_000, 1, NOISE_M), 29.97), &OPTICS);
    assert_eq!(
        (told(&found, "playback-rate"), value(&found, "playback-rate")),
        (vec![("", Severity::Serious)], 29.97)
    );
    let lines = verdict_lines(&measured, &found);
    assert!(
        lines[0].starts_with("not usable until")
            && lines[1].starts_with("serious: 29.97 frames/s is a rate of playback"),
        "{lines:?}"
    );
}

#[test]
fn low_confidence_counts_only_where_there_is_a_position() {
    let doubted = |every: usize| {
        let mut traces = stroke(4_000, 1, NOISE_M);
        traces.tip_confidence =
            Some((0..4_000).map(|i| Some(if i % every == 0 { 0.59 } else { 0.6 })).collect());
        (0..10).for_each(|i| traces.tip_x_m[i * every] = None);
        of(traces)
    };
    for (every, severity, count) in
        [(2, Severity::Serious, 1_990.0), (50, Severity::Caution, 70.0), (200, Severity::Note, 10.0)]
    {
        let found = doubted(every);
        assert_eq!(
            (told(&found, "low-confidence"), value(&found, "low-confidence")),
            (vec![("tip", severity)], count)
        );
    }
    assert_eq!(told(&doubted(1), "low-confidence"), [("tip", Severity::Serious)]);
}

#[test]
fn an_exposure_that_swallows_amplitudes_is_a_caution() {
    let exposed =
        |exposure_s| judged(&recording(stroke(4_000, 1, NOISE_M)), &Optics { exposure_s, ..OPTICS }).1;
    assert_eq!(told(&exposed(Some(2e-4)), "exposure"), [("", Severity::Caution)]);
    let passes = (0.4 * PI).sin() / (0.4 * PI); // 2000 Hz for 0.2 ms
    assert!((value(&exposed(Some(2e-4)), "exposure") - passes).abs() < 1e-6);
    assert_eq!(told(&exposed(Some(5e-5)), "exposure"), [("", Severity::Note)]);
    assert_eq!(
        (told(&exposed(None), "exposure"), value(&exposed(None), "exposure")),
        (vec![("", Severity::Note)], 0.0)
    );
}

#[test]
fn a_head_that_does_not_turn_is_told() {
    let mut traces = stroke(1_000, 1, NOISE_M);
    assert_eq!(value(&of(stroke(4_000, 1, NOISE_M)), "reversals"), 1.0);
    traces.head_x_m = (0..1_000).map(|i| Some(1e-5 * f64::from(i))).collect();
    let found = of(traces);
    assert_eq!((told(&found, "reversals"), value(&found, "reversals")), (vec![("", Severity::Note)], 0.0));
    assert!(found.iter().any(|f| f.advice.contains("give them in seconds")));
}

#[test]
fn too_few_frames_are_serious() {
    let (measured, found) = judged(&recording(stroke(7, 1, NOISE_M)), &OPTICS);
    assert_eq!((told(&found, "too-short"), value(&found, "too-short")), (vec![("", Severity::Serious)], 7.0));
    assert!(
        verdict_lines(&measured, &found)[0]
            .starts_with("too short for a spectrum: 7 frames at 5000 frames/s")
    );
}

#[test]
fn a_component_is_shown_attenuated_aliased_or_too_slow() {
    let seen = |frame_rate_hz, exposure_s, frequency_hz| {
        let frames = frame_rate_hz as usize / 10 + 1; // 0.1 s
        measure_quality(&recording_at(stroke(frames, 1, NOISE_M), frame_rate_hz), exposure_s)
            .component_visibility(frequency_hz)
    };
    let shown = seen(10_000.0, Some(5e-5), 900.0);
    assert_eq!((shown.verdict, shown.appears_at_hz), (Visibility::Shown, 900.0));
    assert!(
        (shown.cycles - 90.0).abs() < 1e-9 && (shown.exposure_passes.unwrap() - 0.996_672).abs() < 1e-6,
        "{shown:?}"
    );
    // 900 Hz at 1,000 or 500 frames/s lands at 100 Hz; 1 ms passes 11 % of it
    let aliased = seen(1_000.0, Some(1e-3), 900.0);
    assert_eq!((aliased.verdict, aliased.appears_at_hz), (Visibility::Aliased, 100.0));
    assert!((aliased.exposure_passes.unwrap() - 0.109_292).abs() < 1e-6, "{aliased:?}");
    assert_eq!(seen(500.0, None, 900.0).appears_at_hz, 100.0);
    assert_eq!(
        (seen(2_500.0, Some(4e-4), 900.0).verdict, seen(2_500.0, None, 900.0).verdict),
        (Visibility::Attenuated, Visibility::Shown)
    );
    assert_eq!(
        (seen(2_000.0, None, 900.0).verdict, seen(10_000.0, None, 29.0).verdict),
        (Visibility::NearNyquist, Visibility::TooFewCycles)
    );
}

#[test]
fn findings_of_the_export_are_kept_and_sorted_in() {
    let kept = QualityFinding::new(
        Check::ImpliedRate,
        Severity::Serious,
        30.0,
        "Hz",
        "the times imply 30 frames/s".to_owned(),
    )
    .with_advice("check the rate");
    let sound = recording(stroke(4_000, 1, NOISE_M));
    let measured = measure_quality(&sound, OPTICS.exposure_s);
    let found = collect_findings(
        &sound,
        &measured,
        &OPTICS,
        &ReversalInstants::find_instants(&sound),
        std::slice::from_ref(&kept),
    );
    assert_eq!((&found[0], grade_findings(&found)), (&kept, Grade::NotUsable));
    assert_eq!(verdict_lines(&measured, &found)[1], "serious: the times imply 30 frames/s; check the rate");
}

#[test]
fn one_check_on_several_channels_is_one_line() {
    let measured = measure_quality(&recording(stroke(4_000, 1, NOISE_M)), None);
    let step = |channel: &str, value: f64| {
        QualityFinding::new(Check::PositionStep, Severity::Caution, value, "m", format!("steps of {value}"))
            .on_channel(channel)
    };
    let found = [step("tip-x", 1.0), step("head-x", 3.0), step("head-y", 2.0)];
    let lines = verdict_lines(&measured, &found);
    assert_eq!(lines.len(), 3, "{lines:?}");
    assert_eq!(lines[1], "caution: tip-x, head-x, head-y (most in head-x): steps of 3");
}

#[test]
fn every_check_has_a_row_in_the_document() {
    let page = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/quality.md")).unwrap();
    let rows: Vec<&str> =
        page.lines().filter_map(|line| line.strip_prefix("| `")?.split('`').next()).collect();
    assert!(Check::ALL.iter().all(|check| rows.contains(&check.name())), "{rows:?}");
}
