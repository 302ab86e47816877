//! The cycle of simulations, from the spectrum and from counted slips, compared with the sticks of the
//! simulation (`cargo run --release --example cycles` prints all scenes), and counted cycles of paths with
//! known instants.

use crate::cycle_count::Count;
use crate::noise::noise;
use std::f64::consts::TAU;
use wiperlab::recording::cycles::{CountedCycle, NoCycle};
use wiperlab::recording::{FrameGrid, Recording, Traces};
use wiperlab::simulate::scene::Scene;

#[test]
fn the_cycle_is_named_and_its_mean_and_range_are_known_to_their_deviations() {
    let text = include_str!("../../data/scenes/light-blade.toml");
    let scene = Scene::parse("light-blade.toml", text).unwrap();
    let mut count = Count::of(&scene, 10_000.0, 5e-7).unwrap();
    count.add(Count::of(&scene, 5_000.0, 2e-6).unwrap());
    assert!(count.windows > 50 && count.ends.len() > 80, "{} windows", count.windows);
    assert_eq!(count.named, count.windows);
    let [means, ends] = count.within();
    let enough = |within: usize, of: usize| 20 * within >= 19 * of;
    assert!(enough(means, count.means.len()), "means: {means} of {}", count.means.len());
    assert!(enough(ends, count.ends.len()), "ends: {ends} of {}", count.ends.len());
    assert!(enough(count.counted, count.windows), "counted in {} of {}", count.counted, count.windows);
    assert_eq!(count.miscounted, 0, "of {}", count.counted);
}

const RATE_HZ: f64 = 1000.0;
/// Size of a slip, m.
const SIZE_M: f64 = 1e-3;

/// Counts the cycle of a tip while the head rests; `noise_m` is the noise of the head.
fn count(tip_m: Vec<Option<f64>>, noise_m: f64) -> Result<CountedCycle, NoCycle> {
    let (frames, mut draw) = (tip_m.len(), noise(5));
    let head_x_m = (0..frames).map(|_| Some(noise_m * draw())).collect();
    let missing = || vec![None; frames];
    let traces =
        Traces { tip_x_m: tip_m, tip_y_m: missing(), head_x_m, head_y_m: missing(), ..Traces::default() };
    let grid = FrameGrid { start_s: 0.0, frame_rate_hz: RATE_HZ, frames };
    Recording::new("tip", grid, traces, true).unwrap().count_cycles(0..frames)
}

/// Path, m, of a tip with slips of [`SIZE_M`] whose middles are at `instants`, frames; a slip takes `slip`
/// frames.
fn staircase(
    instants: &[f64],
    frames: usize,
    slip: f64,
    mut noise_m: impl FnMut() -> f64,
) -> Vec<Option<f64>> {
    let place = |frame: usize| {
        let done = |instant: &f64| {
            let share = ((frame as f64 - instant) / slip + 0.5).clamp(0.0, 1.0);
            share - (TAU * share).sin() / TAU
        };
        SIZE_M * instants.iter().map(done).sum::<f64>()
    };
    (0..frames).map(|frame| Some(place(frame) + noise_m())).collect()
}

/// `count` instants, frames: the first at `first`, the others `period` apart.
fn regular(first: f64, period: f64, count: usize) -> Vec<f64> {
    (0..count).map(|k| first + period * k as f64).collect()
}

#[test]
fn instants_without_noise_are_found_to_a_fraction_of_a_frame() {
    // (slips between two frames get noise: without it, slips of one size look like steps of the sensor)
    for (period, slip, most_frames, noise_m) in
        [(7.3, 3.0, 0.06, 0.0), (31.7, 8.0, 0.01, 0.0), (1000.3, 300.0, 0.02, 0.0), (31.7, 0.01, 0.51, 1e-7)]
    {
        let (instants, mut draw) = (regular(0.6 * period, period, 12), noise(1));
        let path = staircase(&instants, (12.3 * period) as usize, slip, || noise_m * draw());
        let found = count(path, noise_m).unwrap();
        assert_eq!(found.count, 12, "{found:?}");
        for (slip, instant) in found.slips.iter().zip(&instants) {
            let off = (slip.time_s * RATE_HZ - instant).abs();
            assert!(off <= most_frames, "period {period}: {off} frames");
            assert!((slip.size_m / SIZE_M - 1.0).abs() < 0.01, "{slip:?}");
        }
        assert!((found.period_s * RATE_HZ - period).abs() < 2.0 * most_frames / 11.0);
        assert!(found.period_scatter < 0.01, "{found:?}");
    }
}

#[test]
fn errors_of_instants_sizes_and_periods_are_as_large_as_their_deviations() {
    for (period, slip, noise_m) in
        [(20.3, 5.0, 2e-5), (30.3, 8.0, 2e-5), (100.9, 20.0, 6e-5), (30.3, 0.01, 2e-5)]
    {
        let mut scaled = [const { Vec::new() }; 3];
        for seed in 0..60 {
            let (mut draw, first) = (noise(seed), period * (0.5 + 0.007 * seed as f64));
            let instants = regular(first, period, 15);
            let path = staircase(&instants, (15.4 * period) as usize, slip, || noise_m * draw());
            let found = count(path, noise_m).unwrap();
            assert!(found.count.abs_diff(15) <= 1, "{found:?}");
            for slip in &found.slips {
                let off = |instant: &&f64| (slip.time_s * RATE_HZ - **instant).abs();
                let nearest = instants.iter().min_by(|a, b| off(a).total_cmp(&off(b))).unwrap();
                scaled[0].push((slip.time_s - nearest / RATE_HZ) / slip.time_sd_s);
                scaled[1].push((slip.size_m - SIZE_M) / slip.size_sd_m);
            }
            scaled[2].push((found.period_s - period / RATE_HZ) / found.period_sd_s);
        }
        let rms = scaled.map(|x: Vec<f64>| (x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64).sqrt());
        println!("period {period}, slip {slip}: {rms:.2?}");
        let is_near_one = rms.iter().all(|rms| (0.8..1.25).contains(rms));
        assert!(is_near_one, "period {period}, slip {slip}: {rms:.2?}");
    }
}

#[test]
fn dropped_beats_lost_frames_and_steps_of_the_sensor_are_told() {
    let noise_m = 2e-5;
    let dropped = |instants: Vec<f64>| -> Vec<f64> {
        instants.into_iter().enumerate().filter(|(k, _)| k % 7 != 4).map(|(_, instant)| instant).collect()
    };
    let mut draw = noise(3);
    let found =
        count(staircase(&dropped(regular(20.0, 30.3, 30)), 940, 6.0, || noise_m * draw()), noise_m).unwrap();
    assert_eq!((found.count, found.dropped_beats), (26, 4), "{found:?}");
    assert!(
        (found.period_s * RATE_HZ - 30.3).abs() < 0.05
            && (found.rate_hz * 30.3 / RATE_HZ - 25.0 / 29.0).abs() < 2e-3
    );
    assert!(found.times.is_some_and(|times| (times.stick_s * RATE_HZ - 26.0).abs() < 2.0), "{found:?}");

    let mut gaps = staircase(&regular(20.0, 30.3, 30), 940, 6.0, || noise_m * draw());
    (0..940).filter(|i| i % 11 == 3 || (300..345).contains(i)).for_each(|i| gaps[i] = None);
    let found = count(gaps, noise_m).unwrap();
    assert_eq!((found.count, found.dropped_beats), (29, 0), "one slip is lost: {found:?}");
    assert!((found.period_s * RATE_HZ - 30.3).abs() < 0.05, "{found:?}");

    let step_m = 1e-4;
    let stepped = staircase(&regular(20.0, 30.3, 30), 940, 6.0, || 0.0).into_iter();
    let found = count(stepped.map(|x| x.map(|x| (x / step_m).round() * step_m)).collect(), 0.0).unwrap();
    assert_eq!(found.count, 30, "{found:?}");
    assert!((found.period_s * RATE_HZ - 30.3).abs() < 3.0 * found.period_sd_s * RATE_HZ, "{found:?}");

    let short = count(staircase(&regular(4.0, 6.2, 40), 252, 5.0, || 0.0), 0.0).unwrap();
    assert!(short.times.is_none() && short.remarks[0].contains("shorter than"), "{short:?}");
    let mut draw = noise(8);
    let irregular: Vec<f64> = (0..60)
        .scan(0.0, |at, _| {
            *at += (40.0 * (1.0 + 0.33 * draw())).max(14.0);
            Some(*at)
        })
        .collect();
    let found = count(staircase(&irregular, 2300, 4.0, || 0.0), 0.0).unwrap();
    assert!((0.22..0.38).contains(&found.period_scatter), "{found:?}");
    assert!(found.remarks.iter().any(|remark| remark.contains("no line")), "{:?}", found.remarks);
}

/// A period that grows from 24 to 37 frames is no single period; the scatter about the local one stays small.
#[test]
fn a_period_that_changes_is_said_and_is_no_scatter() {
    let instants: Vec<f64> =
        (0..30).scan(20.0, |t, k| Some(std::mem::replace(t, *t + 24.0 + 0.45 * f64::from(k)))).collect();
    let found = count(staircase(&instants, 940, 6.0, || 0.0), 0.0).unwrap();
    assert!(found.remarks.iter().any(|remark| remark.starts_with("the period changes from")), "{found:?}");
    assert!(found.period_scatter < 0.03, "{found:?}");
    let steady = count(staircase(&regular(20.0, 30.3, 30), 940, 6.0, || 0.0), 0.0).unwrap();
    assert!(steady.remarks.is_empty(), "{steady:?}");
}

/// One frame in a hundred lies up to several slips away from the path, in a stick or in a slip.
#[test]
fn mistracked_frames_are_no_slips() {
    for seed in 0..20 {
        let (mut draw, mut place) = (noise(seed), noise(seed + 100));
        let instants = regular(17.0, 43.7, 60);
        let mut path = staircase(&instants, 2640, 6.0, || 1e-5 * draw());
        for frame in (13..2640).step_by(103) {
            *path[frame + seed as usize].as_mut().unwrap() += SIZE_M * (1.0 + 2.0 * place().abs());
        }
        let found = count(path, 1e-5).unwrap();
        assert_eq!(found.count, 60, "{seed}: {found:?}");
        assert!((found.rate_hz - RATE_HZ / 43.7).abs() < 0.02, "{seed}: {found:?}");
    }
}

#[test]
fn motions_without_stick_and_slip_have_no_cycle() {
    let mut alarms = Vec::new();
    for seed in 0..100_u64 {
        let (mut draw, mut coloured) = (noise(seed), 0.0);
        let mut uniform = noise(seed + 1000);
        let (speed, hz) = (1e-4 * uniform(), 0.01 + 0.02 * uniform().abs());
        let path = (0..2000).map(|frame| {
            let t = f64::from(frame);
            let white = draw();
            coloured = 0.9 * coloured + 0.4 * white;
            let wave = (TAU * hz * t).sin();
            // half of the paths have frames in which the tracker was far off
            let off = if seed % 10 > 4 && frame % 97 == 31 { 3e-4 * (2.0 + uniform().sin()) } else { 0.0 };
            Some(match seed % 5 {
                0 => off + 1e-3 * wave + speed * t + 1e-5 * white,
                1 => off + 1e-3 * wave * (-0.05 * hz * t).exp() + 1e-5 * white,
                2 => off + 1e-5 * coloured,
                3 => off + 1e-5 * white + speed * t,
                _ => off + 1e-2 * (TAU * 1.5e-3 * t).cos() + 1e-5 * coloured,
            })
        });
        if let Ok(found) = count(path.collect(), 1e-5) {
            alarms.push(format!("{seed}: {found:?}"));
        }
    }
    assert!(alarms.is_empty(), "{} false alarms: {}", alarms.len(), alarms[0]);
    for (tip_m, said) in [
        (vec![Some(0.0); 2], "tracked in 2 frames"),
        (vec![None; 100], "tracked in 0 frames"),
        (vec![Some(1.0); 100], "does not slip"),
    ] {
        assert!(count(tip_m, 0.0).unwrap_err().to_string().contains(said));
    }
}
