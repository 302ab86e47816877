//! Untracked positions are planted in synthetic recordings. The tests count the planted frames that the
//! checks find, and the clean recordings that get a caution.

use portable_math::StandardNormal;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::collections::BTreeSet;
use std::f64::consts::TAU;
use wiperlab::recording::channel::ReversalInstants;
use wiperlab::recording::quality::*;
use wiperlab::recording::{FrameGrid, Recording, Traces};

/// How a point moves along the sweep.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Motion {
    /// A stroke with an oscillation of the tip.
    Stroke,
    /// At rest throughout.
    Still,
    /// The tip rests on the glass while the head moves on, slips, and rests again.
    StickSlip,
}

/// Settings of a synthetic recording.
#[derive(Debug, Clone, Copy)]
struct Made {
    frames: usize,
    rate_hz: f64,
    motion: Motion,
    /// Standard deviation of the noise of a position, m.
    noise_m: f64,
    /// Correlation of the noise of neighbouring frames.
    correlation: f64,
    /// Step of the values, m; 0 for none.
    step_m: f64,
    /// Whether heights are recorded.
    heights: bool,
    /// Whether every seventh frame is missing, except near planted faults.
    gaps: bool,
    seed: u64,
}

const CAMERA: Made = Made {
    frames: 1_000,
    rate_hz: 1_000.0,
    motion: Motion::Stroke,
    noise_m: 2e-6,
    correlation: 0.0,
    step_m: 1e-7,
    heights: true,
    gaps: false,
    seed: 0,
};

/// Position along the sweep of a tip that a spring drags behind a head at 20 mm/s: it rests until the spring
/// is stretched by 0.4 mm, and slips along half a cosine of 12 ms.
fn stick_slip(t: f64) -> f64 {
    let (period_s, slip_s, slip_m) = (0.02, 0.012, 4e-4);
    let t = t + 0.0013; // so that no frame lies at the end of a slip
    let (cycle, within) = ((t / period_s).floor(), t % period_s);
    let part = ((within - (period_s - slip_s)) / slip_s).max(0.0);
    slip_m * (cycle + 0.5 * (1.0 - (TAU / 2.0 * part).cos()))
}

impl Made {
    fn traces(&self) -> Traces {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(self.seed);
        let phase = TAU * random.random::<f64>();
        let sweep = |t: f64| 0.02 * (TAU * 0.8 * t + phase).sin();
        let places: [&dyn Fn(f64) -> f64; 4] = match self.motion {
            Motion::Stroke => [&|t| sweep(t) + 2e-4 * (TAU * 78.4 * t).sin(), &|_| -5.4e-3, &sweep, &|t| {
                1e-4 * (TAU * 20.0 * t).cos()
            }],
            Motion::Still => [&|_| 0.01234, &|_| -5.4321e-3, &|_| 0.01, &|_| 1e-3],
            Motion::StickSlip => [&stick_slip, &|_| -5.4321e-3, &|t| 0.02 * t, &|_| 1e-3],
        };
        let mut column = |place: &dyn Fn(f64) -> f64| {
            let (mut error, innovation) = (0.0, (1.0 - self.correlation * self.correlation).sqrt());
            let position = |i: usize| {
                let normal: f64 = random.sample(StandardNormal);
                error = if i == 0 { normal } else { self.correlation * error + innovation * normal };
                let x = place(i as f64 / self.rate_hz) + self.noise_m * error;
                Some(self.round(x))
            };
            (0..self.frames).map(position).collect::<Vec<_>>()
        };
        let [tip_x_m, tip_y_m, head_x_m, head_y_m] = places.map(&mut column);
        let heights = |y: Vec<Option<f64>>| if self.heights { y } else { vec![None; self.frames] };
        Traces {
            tip_x_m,
            tip_y_m: heights(tip_y_m),
            head_x_m,
            head_y_m: heights(head_y_m),
            ..Traces::default()
        }
    }

    fn round(&self, x: f64) -> f64 {
        if self.step_m > 0.0 { (x / self.step_m).round() * self.step_m } else { x }
    }
}

fn find(traces: Traces, rate_hz: f64) -> Vec<UntrackedFrames> {
    let recording = recording(traces, rate_hz);
    find_untracked_frames(&recording, &measure_quality(&recording, None), &Optics::default())
}

fn recording(traces: Traces, frame_rate_hz: f64) -> Recording {
    let grid = FrameGrid { start_s: 0.0, frame_rate_hz, frames: traces.tip_x_m.len() };
    Recording::new("made", grid, traces, true).unwrap()
}

/// Findings on untracked frames, with their severity.
fn judge(traces: Traces, rate_hz: f64) -> Vec<QualityFinding> {
    let recording = recording(traces, rate_hz);
    let measured = measure_quality(&recording, None);
    let instants = ReversalInstants::find_instants(&recording);
    let mut found = collect_findings(&recording, &measured, &Optics::default(), &instants, &[]);
    found.retain(|finding| CHECKS.contains(&finding.check.name()));
    found
}

const CHECKS: [&str; 5] =
    ["frozen-frames", "held-points", "interpolated-points", "outliers", "low-confidence"];

/// What a tracking program does where it has lost the point.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fault {
    Held,
    Interpolated,
    Reflection,
}

/// Runs of lost frames of 2 to `longest` frames, with at least 6 frames between them.
fn lost_runs(made: &Made, longest: usize, share: f64) -> Vec<std::ops::Range<usize>> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(1_000 + made.seed);
    let (mut runs, mut frame) = (vec![], 10);
    let between = (((2 + longest) as f64 / 2.0 * (1.0 / share - 1.0)) as usize).max(7);
    loop {
        frame += random.random_range(6..2 * between - 5);
        let length = random.random_range(2..=longest);
        if frame + length + 10 > made.frames {
            return runs;
        }
        runs.push(frame..frame + length);
        frame += length;
    }
}

/// Traces in which the tip has the fault in the given runs of frames.
fn with_fault(made: &Made, fault: Fault, runs: &[std::ops::Range<usize>]) -> Traces {
    let mut traces = made.traces();
    for column in [&mut traces.tip_x_m, &mut traces.tip_y_m] {
        for run in runs {
            let (before, after) = (column[run.start - 1], column[run.end]);
            for (k, frame) in run.clone().enumerate() {
                let part = (k + 1) as f64 / (run.len() + 1) as f64;
                column[frame] = match fault {
                    Fault::Held => before,
                    Fault::Interpolated => before.zip(after).map(|(a, b)| made.round(a + part * (b - a))),
                    Fault::Reflection => column[frame].map(|x| made.round(x + 8e-4)),
                };
            }
        }
        let is_near = |frame: usize| runs.iter().any(|run| (run.start - 5..run.end + 5).contains(&frame));
        let missing = (0..made.frames).filter(|&frame| made.gaps && frame % 7 == 0 && !is_near(frame));
        missing.for_each(|frame| column[frame] = None);
    }
    traces
}

/// Results of ten recordings: the fraction of the planted frames that are found, and the number of frames of
/// the tip that are found but were not planted.
fn score(made: Made, fault: Fault, longest: usize, share: f64) -> (f64, usize) {
    let (mut planted_frames, mut hits, mut false_frames) = (0, 0, 0);
    for seed in 0..10 {
        let made = Made { seed, ..made };
        let runs = lost_runs(&made, longest, share);
        let found = find(with_fault(&made, fault, &runs), made.rate_hz);
        let of_tip = found.iter().filter(|found| found.channel.starts_with("tip"));
        let frames: BTreeSet<usize> = of_tip.flat_map(|found| found.runs.iter().cloned().flatten()).collect();
        let planted: BTreeSet<usize> = runs.into_iter().flatten().collect();
        planted_frames += planted.len();
        hits += frames.intersection(&planted).count();
        false_frames += frames.difference(&planted).count();
    }
    (hits as f64 / planted_frames as f64, false_frames)
}

/// Pixels are 20 um. A step as coarse as the noise hides part of the repeats and all lines. The few frames
/// that are found but were not planted are next to planted frames.
#[test]
fn planted_faults_are_found() {
    let decimals = |step_m: f64| Made { step_m, ..CAMERA };
    for (name, made, least) in [
        ("camera", CAMERA, [1.0, 1.0, 1.0]),
        ("gaps", Made { gaps: true, ..CAMERA }, [0.99, 0.99, 1.0]),
        ("three decimals of a pixel", decimals(2e-8), [1.0, 1.0, 1.0]),
        ("six decimals of a pixel", decimals(2e-11), [1.0, 1.0, 1.0]),
        ("no step", decimals(0.0), [1.0, 1.0, 1.0]),
        ("tenths of a pixel", decimals(2e-6), [0.8, 0.0, 1.0]),
        ("whole pixels", decimals(2e-5), [0.76, 0.0, 1.0]),
        ("x alone", Made { heights: false, ..CAMERA }, [0.93, 0.72, 1.0]),
        ("30 frames/s", Made { rate_hz: 30.0, ..CAMERA }, [1.0, 1.0, 1.0]),
        ("10000 frames/s", Made { rate_hz: 10_000.0, ..CAMERA }, [0.99, 0.99, 1.0]),
        ("300 frames", Made { frames: 300, ..CAMERA }, [0.98, 0.96, 1.0]),
        ("still", Made { motion: Motion::Still, ..CAMERA }, [0.99, 0.98, 1.0]),
        ("stick-slip", Made { motion: Motion::StickSlip, ..CAMERA }, [0.99, 0.99, 1.0]),
    ] {
        let most_false = if name == "whole pixels" { 80 } else { 5 };
        for share in [0.05, 0.3] {
            for (fault, longest, least) in [
                (Fault::Held, 6, least[0]),
                (Fault::Held, 20, least[0]),
                (Fault::Interpolated, 8, least[1]),
                (Fault::Reflection, 30, least[2]),
            ] {
                let (found, false_frames) = score(made, fault, longest, share);
                println!(
                    "{name}, {fault:?} up to {longest} frames, {share} lost: {found:.3}, {false_frames}"
                );
                assert!(
                    found >= least && false_frames <= most_false,
                    "{name} {fault:?} {found} {false_frames}"
                );
            }
        }
    }
}

#[test]
fn clean_recordings_are_not_cautioned() {
    let (mut all, mut cautioned) = (0, 0);
    for motion in [Motion::Stroke, Motion::Still, Motion::StickSlip] {
        for rate_hz in [30.0, 1_000.0, 10_000.0] {
            for (noise_m, correlation) in [(0.0, 0.0), (2e-7, 0.0), (2e-6, 0.0), (2e-6, 0.9), (1e-5, 0.7)] {
                for step_m in [0.0, 1e-9, 1e-7, 2e-6, 2e-5] {
                    for heights in [true, false] {
                        let made = Made {
                            frames: 500,
                            motion,
                            rate_hz,
                            noise_m,
                            correlation,
                            step_m,
                            heights,
                            ..CAMERA
                        };
                        let made = Made { seed: all, ..made };
                        let found = judge(made.traces(), rate_hz);
                        all += 1;
                        if found.iter().any(|finding| finding.severity > Severity::Note) {
                            cautioned += 1;
                            println!("{made:?}: {found:?}");
                        }
                    }
                }
            }
        }
    }
    println!("{cautioned} of {all} clean recordings cautioned");
    assert!(100 * cautioned <= all, "{cautioned} of {all}");
}

/// A sensor with steps of 0.78 um, whose conversion to metres made the steps unequal, sees a mass that rests in
/// a third of the samples.
#[test]
fn a_rest_within_one_step_of_its_sensor_is_not_held() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(3);
    let mut sense = |x: f64| {
        let normal: f64 = random.sample(StandardNormal);
        let metres = ((x + 1e-7 * normal) / 7.77e-7).round() * 7.77e-7;
        Some((metres / 5e-9).round() * 5e-9)
    };
    for slip_share in [0.4, 0.6] {
        // the mass moves from one rest to the next along half a cosine, twice in a cycle of the base
        let mass = |t: f64| {
            let part = ((t % 0.5) / (0.5 * slip_share)).min(1.0);
            let way = 0.5 * (1.0 - (TAU / 2.0 * part).cos());
            1.4e-3 * if t % 1.0 < 0.5 { way } else { 1.0 - way }
        };
        let times: Vec<f64> = (0..2_500).map(|i| f64::from(i) / 250.0 + 1e-3).collect();
        let tip_x_m: Vec<Option<f64>> = times.iter().map(|&t| sense(mass(t))).collect();
        let head_x_m: Vec<Option<f64>> = times.iter().map(|&t| sense(1.8e-3 * (TAU * t).cos())).collect();
        let repeats = tip_x_m.windows(2).filter(|pair| pair[0] == pair[1]).count();
        assert!((700..1_500).contains(&repeats), "{repeats}");
        let missing = || vec![None; 2_500];
        let traces =
            Traces { tip_x_m, head_x_m, tip_y_m: missing(), head_y_m: missing(), ..Traces::default() };
        assert_eq!(find(traces, 250.0), []);
    }
}

/// The head is computed as speed times time, and the tip as the position of the head minus a deflection in
/// whole steps.
#[test]
fn a_computed_point_is_not_interpolated() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(4);
    let head = |i: usize| 5.5e-7 * i as f64;
    let mut tip = |i: usize| {
        let normal: f64 = random.sample(StandardNormal);
        let steps = ((head(i) % 4e-5) / 8.4e-7 + 1.2 * normal).round();
        Some(((head(i) - 8.4e-7 * steps) / 1e-9).round() * 1e-9)
    };
    let missing = || vec![None; 5_000];
    let tip_x_m = (0..5_000).map(&mut tip).collect();
    let head_x_m = (0..5_000).map(|i| Some((head(i) / 1e-9).round() * 1e-9)).collect();
    let traces = Traces { tip_x_m, head_x_m, tip_y_m: missing(), head_y_m: missing(), ..Traces::default() };
    let found = find(traces, 2_000.0);
    assert!(found.iter().all(|found| found.check.name() == "outliers"), "{found:?}");
    // a computed head without noise is not reported either if the gaps of the tip are filled by lines
    let runs = lost_runs(&CAMERA, 8, 0.3);
    let mut traces = with_fault(&CAMERA, Fault::Interpolated, &runs);
    traces.head_x_m = (0..1_000).map(|i| Some(2e-5 * f64::from(i))).collect();
    traces.head_y_m = vec![Some(1e-3); 1_000];
    let found = find(traces, CAMERA.rate_hz);
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!((found[0].check.name(), found[0].channel), ("interpolated-points", "tip"));
}

#[test]
fn the_severity_follows_the_share_and_the_finding_names_the_frames() {
    for (runs, severity, words) in [
        (
            std::iter::once(500..503).collect(),
            Severity::Note,
            "3 of 1000 frames (0.3 %) repeat the last position exactly: frames 500 to 502",
        ),
        (
            vec![100..110, 300..310, 500..510, 600..610, 700..710],
            Severity::Caution,
            "50 of 1000 frames (5.0 %) repeat the last position exactly: frames 100 to 109, 300 to 309, 500 to \
             509, 600 to 609 and 1 more run",
        ),
        (
            vec![100..120, 300..331],
            Severity::Serious,
            "51 of 1000 frames (5.1 %) repeat the last position exactly: frames 100 to 119, 300 to 330",
        ),
    ] {
        let found = judge(with_fault(&CAMERA, Fault::Held, &runs), CAMERA.rate_hz);
        assert_eq!(found.len(), 1, "{found:?}");
        assert_eq!(found[0].severity, severity);
        let QualityFinding { channel, found, advice, .. } = &found[0];
        assert_eq!((channel.as_deref(), found.as_str()), (Some("tip"), words));
        assert!(advice.contains("--drop-untracked"), "{advice}");
    }
}

#[test]
fn what_nobody_tracked_is_left_out_on_request() {
    let runs = lost_runs(&CAMERA, 20, 0.2);
    let traces = with_fault(&CAMERA, Fault::Held, &runs);
    let left = drop_untracked(traces.clone(), &find(traces.clone(), CAMERA.rate_hz));
    for frame in 0..CAMERA.frames {
        let lost = runs.iter().any(|run| run.contains(&frame));
        let kept = |x: Option<f64>| if lost { None } else { x };
        assert_eq!(left.tip_x_m[frame], kept(traces.tip_x_m[frame]), "{frame}");
        assert_eq!(left.tip_y_m[frame], kept(traces.tip_y_m[frame]), "{frame}");
    }
    assert_eq!((&left.head_x_m, &left.head_y_m), (&traces.head_x_m, &traces.head_y_m));
    assert_eq!(find(left, CAMERA.rate_hz), []);
}

// (simulated)

/// Simulated films of a blade that sticks and slips, without noise. The positions are rounded to steps from 0
/// to a whole pixel.
#[test]
fn a_simulated_blade_that_sticks_is_tracked() {
    use wiperlab::simulate::SolverOptions;
    use wiperlab::simulate::twin::{Camera, film_scene};
    let scene = crate::scenes::committed("light-blade");
    for frame_rate_hz in [100.0, 250.0, 1_000.0, 10_000.0] {
        let camera = Camera { frame_rate_hz, exposure_s: 0.0 };
        let options = SolverOptions::new(1e-6);
        let film = film_scene(&scene, &camera, scene.start_s, scene.run.stop_s, options).unwrap().recording;
        for step_m in [0.0, 1e-9, 1e-7, 2e-6, 2e-5] {
            let made = Made { step_m, ..CAMERA };
            for heights in [true, false] {
                let mut traces = film.traces().clone();
                let Traces { tip_x_m, tip_y_m, head_x_m, head_y_m, .. } = &mut traces;
                for column in [tip_x_m, tip_y_m, head_x_m, head_y_m] {
                    column.iter_mut().for_each(|x| *x = x.map(|x| made.round(x)));
                }
                if !heights {
                    traces.tip_y_m.fill(None);
                    traces.head_y_m.fill(None);
                }
                let found = judge(traces, frame_rate_hz);
                let doubts = found.iter().filter(|finding| finding.severity > Severity::Note);
                assert_eq!(doubts.count(), 0, "{frame_rate_hz} frames/s, steps of {step_m} m: {found:?}");
            }
        }
    }
}
