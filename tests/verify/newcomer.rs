//! Typical mistakes of a newcomer. The tests plant each mistake in films of different blades, and also check
//! films without a fault.

use crate::blade::Parts;
use crate::thorough;
use portable_math::StandardNormal;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;
use wiperlab::recording::channel::ReversalInstants;
use wiperlab::recording::quality::*;
use wiperlab::recording::{FrameGrid, Recording, Traces};
use wiperlab::simulate::twin::{Camera, TrackingModel, add_tracking_noise, film_scene};
use wiperlab::simulate::{RunStatus, SolverOptions};

/// A film, and the height of the blade that it shows.
struct Film {
    recording: Recording,
    height_m: f64,
}

impl Parts {
    /// The parts of a blade of the same rubber that is `size` times as large: lengths are proportional to the
    /// size, masses to its cube, and frequencies to its inverse.
    fn scaled(self, size: f64) -> Self {
        let power = |value: f64, exponent: i32| value * size.powi(exponent);
        let Self { m, l, g, j, k, c, hd, .. } = self;
        Self {
            m: m.map(|m| power(m, 3)),
            l: l.map(|l| power(l, 1)),
            g: g.map(|g| power(g, 1)),
            j: j.map(|j| power(j, 5)),
            k: [power(k[0], 1), power(k[1], 3), power(k[2], 3)],
            c: [power(c[0], 2), power(c[1], 4), power(c[2], 4)],
            hd: power(hd, 1),
            shoulder: self.shoulder.map(|[angle, k, c]| [angle, power(k, 3), power(c, 4)]),
            ..self
        }
    }
}

/// A random number between `low` and `high`, uniformly distributed on a logarithmic axis.
fn between(rng: &mut impl Rng, low: f64, high: f64) -> f64 {
    low * (high / low).powf(rng.random::<f64>())
}

/// A film of a random blade around a reversal; its size is between `sizes[0]` and `sizes[1]` times the usual
/// size. The frame rate resolves the vibration of the neck or, if `any_rate`, is random; `None` if the blade
/// leaves the glass.
fn film_blade(seed: u64, sizes: [f64; 2], any_rate: bool) -> Option<Film> {
    let rng = &mut Xoshiro256PlusPlus::seed_from_u64(seed);
    let size = between(rng, sizes[0], sizes[1]);
    let friction = [between(rng, 0.05, 0.3), between(rng, 1.0, 10.0), between(rng, 0.1, 0.4)];
    let parts = Parts { friction, ..Parts::random(rng).scaled(size) };
    let height_m: f64 = parts.l.iter().sum();
    let amplitude_m = (height_m * between(rng, 3.0, 15.0)).min(0.4);
    let frequency_hz = between(rng, 0.3, 1.2).min(1.5 / (TAU * amplitude_m));
    // the time in which the head passes over the height of the blade after its turn
    let pass_s = (2.0 * height_m / amplitude_m).sqrt() / (TAU * frequency_hz);
    let turn_s = 0.5 / frequency_hz;
    let start_s = (turn_s - pass_s * between(rng, 0.6, 1.2)).max(0.1 * turn_s);
    let stop_s = (turn_s + pass_s * between(rng, 2.0, 3.0)).min(1.9 * turn_s);
    let inertia = parts.j[0] + parts.m[1] * parts.g[0].powi(2) + parts.m[2] * parts.l[0].powi(2);
    let neck_hz = (parts.k[1] / inertia).sqrt() / TAU;
    let any_hz = between(rng, 500.0, 20_000.0);
    let frames_hz = [1_500.0, 12_000.0].map(|frames| frames / (stop_s - start_s));
    let resolving_hz = (neck_hz * between(rng, 8.0, 40.0)).clamp(frames_hz[0], frames_hz[1]);
    let frame_rate_hz = if any_rate { any_hz } else { resolving_hz }.clamp(500.0, 20_000.0).round();
    let scene = parts.scene(&format!(
        "[drive]\namplitude_m = {amplitude_m}\nfrequency_hz = {frequency_hz}\n[run]\nstop_s = {stop_s}\n\
         sample_rate_hz = 1000.0"
    ));
    let camera = Camera { frame_rate_hz, exposure_s: 0.1 / frame_rate_hz };
    let film = film_scene(&scene, &camera, start_s, stop_s, SolverOptions::new(1e-6)).ok()?;
    if film.run.status != RunStatus::Completed {
        return None;
    }
    let tracking = TrackingModel {
        metres_per_pixel: height_m / between(rng, 100.0, 300.0),
        noise_px: between(rng, 0.02, 1.0),
        dropout_fraction: 0.01 * rng.random::<f64>(),
        seed,
    };
    let recording = add_tracking_noise(&film.recording, "film", &tracking).ok()?;
    Some(Film { recording, height_m })
}

/// A film of a slow stick-slip rig, without heights: the head moves at constant speed, and the tip rests,
/// slips after it and rings down.
fn film_rig(seed: u64) -> Film {
    let rng = &mut Xoshiro256PlusPlus::seed_from_u64(seed);
    let frame_rate_hz = between(rng, 500.0, 2_000.0).round();
    let frames = between(rng, 3_000.0, 20_000.0) as usize;
    let (speed, slip_m) = (between(rng, 1e-4, 5e-3), between(rng, 5e-4, 5e-3));
    let (natural_hz, noise_m) = (between(rng, 2.0, 20.0), slip_m / between(rng, 100.0, 1_000.0));
    let rest_s = slip_m / speed;
    let tip = |t: f64| {
        let (cycle, since) = ((t / rest_s).floor(), t % rest_s);
        let ring = (-3.0 * since * natural_hz).exp() * (TAU * natural_hz * since).cos();
        slip_m * (cycle - 0.5 * ring)
    };
    let mut column = |place: &dyn Fn(f64) -> f64| {
        let mut sample =
            |i: usize| place(i as f64 / frame_rate_hz) + noise_m * rng.sample::<f64, _>(StandardNormal);
        (0..frames).map(|i| Some(sample(i))).collect::<Vec<_>>()
    };
    let traces = Traces {
        tip_x_m: column(&tip),
        head_x_m: column(&|t| speed * t),
        tip_y_m: vec![None; frames],
        head_y_m: vec![None; frames],
        ..Traces::default()
    };
    let grid = FrameGrid { start_s: 0.0, frame_rate_hz, frames };
    Film { recording: Recording::new("rig", grid, traces, true).unwrap(), height_m: f64::NAN }
}

/// The findings that are more than notes, in the reported order. If `scene_height_m` is given, the height of
/// the blade is compared with it.
fn doubts(recording: &Recording, scene_height_m: Option<f64>) -> Vec<QualityFinding> {
    let optics = Optics { exposure_s: Some(0.1 / recording.grid().frame_rate_hz), metres_per_pixel: None };
    let measured = measure_quality(recording, optics.exposure_s);
    let instants = ReversalInstants::find_instants(recording);
    let motion = measure_motion(recording, &measured, &instants);
    let scene: Vec<_> =
        scene_height_m.and_then(|height| check_scene_height(&motion, height)).into_iter().collect();
    let mut found = collect_findings(recording, &measured, &optics, &instants, &scene);
    found.retain(|finding| finding.severity > Severity::Note);
    found
}

type Columns = [Vec<Option<f64>>; 4];

/// The recording of a film with changed columns (tip x, tip y, head x, head y) and the frame rate `rate`,
/// 1/s.
fn alter_film(film: &Film, rate: f64, change: impl Fn(Columns) -> Columns) -> Recording {
    let traces = film.recording.traces().clone();
    let [tip_x_m, tip_y_m, head_x_m, head_y_m] =
        change([traces.tip_x_m, traces.tip_y_m, traces.head_x_m, traces.head_y_m]);
    let grid = FrameGrid { frame_rate_hz: rate, frames: tip_x_m.len(), ..film.recording.grid() };
    let traces = Traces { tip_x_m, tip_y_m, head_x_m, head_y_m, ..Traces::default() };
    Recording::new("altered", grid, traces, true).unwrap()
}

fn map_columns(columns: Columns, change: impl Fn(usize, f64) -> f64) -> Columns {
    let mut index = 0..;
    columns.map(|column| {
        let index = index.next().unwrap();
        column.into_iter().map(|x| x.map(|x| change(index, x))).collect()
    })
}

fn average_frames(column: &[Option<f64>], width: usize) -> Vec<Option<f64>> {
    let mean = |i: usize| {
        let near = &column[i.saturating_sub(width / 2)..(i + width / 2 + 1).min(column.len())];
        let present: Vec<f64> = near.iter().flatten().copied().collect();
        column[i].map(|_| present.iter().sum::<f64>() / present.len() as f64)
    };
    (0..column.len()).map(mean).collect()
}

/// Leaves out `lost` evenly spread frames of the tip and renumbers the rest of its track without gaps.
fn close_up_track([mut tip_x, mut tip_y, mut head_x, mut head_y]: Columns, lost: usize) -> Columns {
    let every = tip_x.len() / (lost + 1);
    for column in [&mut tip_x, &mut tip_y] {
        let mut frame = 0;
        column.retain(|_| (frame += 1, frame % every != 0 || frame / every > lost).1);
    }
    head_x.truncate(tip_x.len());
    head_y.truncate(tip_x.len());
    [tip_x, tip_y, head_x, head_y]
}

/// Name of a fault, name of the check that reports it, and a function that makes a recording with the fault
/// from a film.
type Fault = (&'static str, &'static str, fn(&Film) -> Recording);

fn own_rate(film: &Film) -> f64 {
    film.recording.grid().frame_rate_hz
}

const FAULTS: [Fault; 14] = [
    ("tenfold frame rate", "frame-rate", |film| alter_film(film, 10.0 * own_rate(film), |columns| columns)),
    ("5 frames/s", "frame-rate", |film| alter_film(film, 5.0, |columns| columns)),
    ("mean of 11 frames", "pre-filtered", |film| {
        alter_film(film, own_rate(film), |columns| columns.map(|column| average_frames(&column, 11)))
    }),
    ("tracks ten frames apart", "lag", |film| {
        alter_film(film, own_rate(film), |[tip_x, tip_y, head_x, head_y]| {
            let last = tip_x.len() - 10;
            [tip_x[10..].to_vec(), tip_y[10..].to_vec(), head_x[..last].to_vec(), head_y[..last].to_vec()]
        })
    }),
    ("29 frames lost and renumbered", "lag", |film| {
        alter_film(film, own_rate(film), |columns| close_up_track(columns, 29))
    }),
    ("y flipped", "y-direction", |film| {
        alter_film(film, own_rate(film), |columns| {
            map_columns(columns, |i, x| if i % 2 == 1 { -x } else { x })
        })
    }),
    ("points exchanged", "swapped-points", |film| {
        alter_film(film, own_rate(film), |[tip_x, tip_y, head_x, head_y]| [head_x, head_y, tip_x, tip_y])
    }),
    ("y of tip and head exchanged", "mixed-columns", |film| {
        alter_film(film, own_rate(film), |[tip_x, tip_y, head_x, head_y]| [tip_x, head_y, head_x, tip_y])
    }),
    ("x of tip and head exchanged", "mixed-columns", |film| {
        alter_film(film, own_rate(film), |[tip_x, tip_y, head_x, head_y]| [head_x, tip_y, tip_x, head_y])
    }),
    ("x and y exchanged", "mixed-columns", |film| {
        alter_film(film, own_rate(film), |[tip_x, tip_y, head_x, head_y]| [tip_y, tip_x, head_y, head_x])
    }),
    ("points exchanged in the middle fifth", "swapped-points", |film| {
        alter_film(film, own_rate(film), |columns| exchange_fifths(columns, [2, 3]))
    }),
    ("points exchanged in the last two fifths", "swapped-points", |film| {
        alter_film(film, own_rate(film), |columns| exchange_fifths(columns, [3, 5]))
    }),
    ("a stretch of both tracks lost and closed up", "lost-frames", |film| {
        alter_film(film, own_rate(film), |columns| {
            let lost = columns[0].len() / 40;
            lose_stretch(columns, lost)
        })
    }),
    ("a stretch of the head lost and closed up", "lost-frames", |film| {
        alter_film(film, own_rate(film), |[mut tip_x, mut tip_y, head_x, head_y]| {
            let lost = tip_x.len() / 40;
            let [head_x, head_y] = lose_stretch([head_x, head_y], lost);
            tip_x.truncate(head_x.len());
            tip_y.truncate(head_x.len());
            [tip_x, tip_y, head_x, head_y]
        })
    }),
];

/// The columns without some frames from three quarters of the recording on, where the head moves.
fn lose_stretch<const N: usize>(columns: [Vec<Option<f64>>; N], lost: usize) -> [Vec<Option<f64>>; N] {
    columns.map(|mut column| {
        let from = 3 * column.len() / 4;
        column.drain(from..from + lost);
        column
    })
}

/// The columns with tip and head exchanged in a part of the frames, given in fifths of the recording.
fn exchange_fifths(
    [mut tip_x, mut tip_y, mut head_x, mut head_y]: Columns,
    [from, to]: [usize; 2],
) -> Columns {
    let part = from * tip_x.len() / 5..to * tip_x.len() / 5;
    tip_x[part.clone()].swap_with_slice(&mut head_x[part.clone()]);
    tip_y[part.clone()].swap_with_slice(&mut head_y[part]);
    [tip_x, tip_y, head_x, head_y]
}

/// The first `count` films of usual blades, each at a frame rate that resolves the vibration of the neck.
fn usual_films(count: usize) -> Vec<Film> {
    (1_000..).filter_map(|seed| film_blade(seed, [0.5, 2.0], false)).take(count).collect()
}

fn count_named_first(faults: &[Fault]) {
    let films = usual_films(thorough::pick(5, 20));
    for &(name, check, plant) in faults {
        let firsts: Vec<String> = films
            .iter()
            .map(|film| {
                let found = doubts(&plant(film), None);
                found.first().map_or("nothing", |finding| finding.check.name()).to_owned()
            })
            .collect();
        let named = firsts.iter().filter(|first| *first == check).count();
        println!("{name}: named first in {named} of {}", films.len());
        let missed = films.len() - named;
        assert!(missed <= (films.len() / 10).max(1), "{name}: {firsts:?}");
    }
}

#[test]
fn a_wrong_rate_is_named_first() {
    count_named_first(&FAULTS[..2]);
}

#[test]
fn a_mean_and_tracks_that_are_apart_are_named_first() {
    count_named_first(&FAULTS[2..5]);
}

#[test]
fn exchanged_columns_are_named_first() {
    count_named_first(&FAULTS[5..10]);
}

#[test]
fn points_exchanged_in_a_part_are_named_first() {
    count_named_first(&FAULTS[10..12]);
}

#[test]
fn a_stretch_that_was_closed_up_is_named_first() {
    count_named_first(&FAULTS[12..]);
}

/// A rig whose head makes strokes with rests between them; the tip follows as far as the blade leans.
/// Positions are rounded to `step_m`, if it is not zero.
fn film_resting_rig(
    seed: u64,
    [stroke_s, travel_m, rest_s]: [f64; 3],
    frame_rate_hz: f64,
    step_m: f64,
) -> Recording {
    let rng = &mut Xoshiro256PlusPlus::seed_from_u64(seed);
    let (height_m, lean_m, noise_m): (f64, f64, f64) = (6e-3, 1.5e-3, 2e-6);
    let frames = (3.0 * stroke_s.max(rest_s) * frame_rate_hz) as usize;
    let head = |i: usize| {
        let phase = (i as f64 / frame_rate_hz) % (2.0 * (stroke_s + rest_s)) / (stroke_s + rest_s);
        let part = (phase % 1.0 * (stroke_s + rest_s) / stroke_s).min(1.0);
        let place = travel_m * 0.5 * (1.0 - (0.5 * TAU * part).cos());
        if phase < 1.0 { place } else { travel_m - place }
    };
    let lean = |lean_so_far: &mut f64, i: usize| {
        *lean_so_far = (*lean_so_far + head(i) - head(i.saturating_sub(1))).clamp(-lean_m, lean_m);
        Some(*lean_so_far)
    };
    let leans: Vec<f64> = (0..frames).scan(0.0, lean).collect();
    let mut column = |place: &dyn Fn(usize) -> f64| {
        let mut sample = |i: usize| {
            let x = place(i) + noise_m * rng.sample::<f64, _>(StandardNormal);
            if step_m > 0.0 { (x / step_m).round() * step_m } else { x }
        };
        (0..frames).map(|i| Some(sample(i))).collect::<Vec<_>>()
    };
    let traces = Traces {
        tip_x_m: column(&|i| head(i) - leans[i]),
        tip_y_m: column(&|_| 0.0),
        head_x_m: column(&head),
        head_y_m: column(&|i| (height_m * height_m - leans[i] * leans[i]).sqrt()),
        ..Traces::default()
    };
    let grid = FrameGrid { start_s: 0.0, frame_rate_hz, frames };
    Recording::new("rig", grid, traces, true).unwrap()
}

#[test]
fn a_rig_at_rest_shows_neither_a_lag_nor_turns() {
    for seed in 0..thorough::pick(3, 20) as u64 {
        let rested = film_resting_rig(seed, [1.0, 0.06, [8.0, 5.0, 3.0][seed as usize % 3]], 1_000.0, 0.0);
        assert!(doubts(&rested, None).is_empty(), "{seed}: {:?}", doubts(&rested, None));
        let coarse = film_resting_rig(seed, [20.0, 0.015, 10.0], 250.0, 1e-4);
        let found = doubts(&coarse, None);
        assert!(found.iter().all(|f| f.check == Check::PositionStep), "{seed}: {found:?}");
    }
}

#[test]
fn a_scale_of_a_tenth_is_named_with_a_scene_alone() {
    let films = usual_films(thorough::pick(5, 20));
    let tenth =
        |film: &Film| alter_film(film, own_rate(film), |columns| map_columns(columns, |_, x| 0.1 * x));
    let named = |scene: &dyn Fn(&Film) -> Option<f64>| {
        films
            .iter()
            .filter(|film| {
                doubts(&tenth(film), scene(film)).first().is_some_and(|f| f.check.name() == "scale")
            })
            .count()
    };
    let (with, without) = (named(&|film| Some(film.height_m)), named(&|_| None));
    println!("a scale of a tenth: named first in {with} with a scene, {without} without, of {}", films.len());
    assert_eq!(with, films.len());
    let own: Vec<_> = films.iter().flat_map(|film| doubts(&film.recording, Some(film.height_m))).collect();
    assert!(own.iter().all(|finding| finding.check != Check::Scale), "{own:?}");
}

#[test]
fn films_without_a_fault_are_not_cautioned() {
    let count = thorough::pick(10, 100);
    let blades = (0..).filter_map(|seed| film_blade(seed, [0.1, 10.0], seed % 4 == 0)).take(count * 4 / 5);
    let films: Vec<Film> = blades.chain((0..count as u64 / 5).map(film_rig)).collect();
    let cautioned: Vec<Vec<String>> = films
        .iter()
        .map(|film| doubts(&film.recording, None).iter().map(QualityFinding::to_line).collect::<Vec<_>>())
        .filter(|lines| !lines.is_empty())
        .collect();
    println!("cautioned: {} of {count}", cautioned.len());
    assert!(cautioned.len() <= count / 100, "{cautioned:#?}");
}

/// A short recording of a blade that oscillates by a fifth of a millimetre, so that its head sinks by no more
/// than the noise. Every 21 frames, the tip is held for `held` frames.
fn film_short_oscillation(seed: u64, held: usize) -> Recording {
    let rng = &mut Xoshiro256PlusPlus::seed_from_u64(seed);
    let (frames, frame_rate_hz) = (300, 1_000.0);
    let lean = |i: usize| 2e-4 * (TAU * 78.4 * i as f64 / frame_rate_hz).sin() + 1e-4;
    let head = |i: usize| 1e-3 + 2e-2 * i as f64 / frames as f64;
    let mut column = |place: &dyn Fn(usize) -> f64| {
        let mut sample = |i: usize| place(i) + 2e-6 * rng.sample::<f64, _>(StandardNormal);
        (0..frames).map(|i| Some(sample(i))).collect::<Vec<_>>()
    };
    let hold = |column: Vec<Option<f64>>| -> Vec<Option<f64>> {
        (0..frames).map(|i| column[if i % 21 <= held { i - i % 21 } else { i }]).collect()
    };
    let traces = Traces {
        tip_x_m: hold(column(&|i| head(i) + lean(i))),
        tip_y_m: hold(column(&|_| 0.0)),
        head_x_m: column(&head),
        head_y_m: column(&|i| (144e-6 - lean(i) * lean(i)).sqrt()),
        ..Traces::default()
    };
    let grid = FrameGrid { start_s: 0.0, frame_rate_hz, frames };
    Recording::new("short", grid, traces, true).unwrap()
}

#[test]
fn a_short_recording_and_a_tip_that_was_not_tracked_show_no_lag() {
    for seed in 0..thorough::pick(25, 200) as u64 {
        for held in [0, 6] {
            let found = doubts(&film_short_oscillation(seed, held), None);
            assert!(found.iter().all(|f| f.check != Check::Lag), "{seed}, {held}: {found:?}");
        }
    }
}
