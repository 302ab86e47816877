//! A recording or a scene with a usual error is not explained, and the fit names the error. A right recording
//! has no such explanation.

use crate::thorough::{is_thorough, pick};
use wiperlab::fit::job::Job;
use wiperlab::fit::result::FitResult;
use wiperlab::fit::{MeasuredRecording, Problem};
use wiperlab::recording::{FrameGrid, Recording, Traces};
use wiperlab::simulate::SolverOptions;
use wiperlab::simulate::scene::Scene;
use wiperlab::simulate::twin::{Camera, TrackingModel, add_tracking_noise, film_scene};

const SCENE: &str = include_str!("../../data/scenes/actual-blade.toml");
const CAMERA: Camera = Camera { frame_rate_hz: 5_000.0, exposure_s: 5e-5 };

/// Changes of the scene that make three blades: a key, and the factor on its value.
const BLADES: [&[(&str, f64)]; 3] = [
    &[],
    &[("friction.a", 0.8), ("friction.c", 0.9), ("blade.lip_mass_kg", 1.2), ("drive.frequency_hz", 0.8)],
    &[
        ("friction.c", 1.1),
        ("blade.neck_length_m", 1.1),
        ("blade.head_mass_kg", 1.3),
        ("blade.preload_force_n", 1.2),
    ],
];

const JOB: &str = r#"format = 1
title = "Diagnosis"
scene = "scene.toml"
seed = 1
nuisance = "exact"

[[recording]]
path = "twin"

[[parameter]]
name = "friction.a"
lower = 0.03
upper = 0.3
scale = "log"

[[parameter]]
name = "friction.c"
lower = 0.1
upper = 0.6
scale = "log"

[[parameter]]
name = "blade.neck_natural_frequency_hz"
lower = 140.0
upper = 280.0
scale = "log"

[[trace]]
"#;

/// A scene with a film of it, or with the film and scene of a usual error.
#[derive(Clone)]
struct Filmed {
    scene: Scene,
    recording: Recording,
}

impl Filmed {
    /// Film of a blade around its reversal, by a camera with noise of a tenth of a pixel of 20 um.
    fn record(blade: usize, seed: u64) -> Self {
        let scene = Scene::parse("actual-blade.toml", SCENE).unwrap();
        let scale = |scene: Scene, (name, factor): &(&str, f64)| {
            let value = factor * scene.value(name).unwrap();
            scene.with_parameter(name, value).unwrap()
        };
        let scene = BLADES[blade].iter().fold(scene, scale);
        let recording = film(&scene, seed);
        Self { scene, recording }
    }

    fn with_traces(self, traces: Traces) -> Self {
        let grid = FrameGrid { frames: traces.tip_x_m.len(), ..self.recording.grid() };
        Self { recording: Recording::new("twin", grid, traces, true).unwrap(), ..self }
    }

    fn map_columns(self, change: impl Fn(&[Option<f64>]) -> Vec<Option<f64>>) -> Self {
        let traces = self.recording.traces();
        let [tip_x_m, tip_y_m, head_x_m, head_y_m] =
            [&traces.tip_x_m, &traces.tip_y_m, &traces.head_x_m, &traces.head_y_m]
                .map(|column| change(column));
        self.with_traces(Traces { tip_x_m, tip_y_m, head_x_m, head_y_m, ..Traces::default() })
    }

    fn with_rate(self, factor: f64) -> Self {
        let grid = self.recording.grid();
        let grid = FrameGrid { frame_rate_hz: factor * grid.frame_rate_hz, ..grid };
        let traces = self.recording.traces().clone();
        Self { recording: Recording::new("twin", grid, traces, true).unwrap(), ..self }
    }

    fn with_scale(self, factor: f64) -> Self {
        self.map_columns(|column| column.iter().map(|value| value.map(|value| factor * value)).collect())
    }

    fn with_constant(self, name: &str, factor: f64) -> Self {
        let value = factor * self.scene.value(name).unwrap();
        Self { scene: self.scene.with_parameter(name, value).unwrap(), ..self }
    }

    /// Fits the film; `keys` are further keys of the trace.
    fn fit(&self, keys: &str) -> FitResult {
        let job = Job::parse("job.toml", &format!("{JOB}{keys}")).unwrap();
        let measured =
            MeasuredRecording { recording: self.recording.clone(), exposure_s: Some(CAMERA.exposure_s) };
        Problem::new(job, vec![self.scene.clone()], vec![measured]).unwrap().fit().unwrap()
    }
}

fn film(scene: &Scene, seed: u64) -> Recording {
    let turn_s = 0.5 / scene.value("drive.frequency_hz").unwrap();
    let mut scene = scene.clone();
    (scene.start_s, scene.run.stop_s) = (turn_s - 0.108, turn_s + 0.2);
    let effort = SolverOptions::new(scene.run.relative_tolerance);
    let seen = film_scene(&scene, &CAMERA, turn_s - 0.088, turn_s + 0.14, effort).unwrap();
    let tracking = TrackingModel { metres_per_pixel: 2e-5, noise_px: 0.1, dropout_fraction: 0.02, seed };
    add_tracking_noise(&seen.recording, "twin", &tracking).unwrap()
}

/// One in this number of errors may not be named first.
const MOST_MISNAMED: usize = 10;

/// The errors: the name of the hypothesis, words of its sentence, and what the error makes of a right film.
type Error = (&'static str, &'static str, fn(Filmed) -> Filmed);
const ERRORS: [Error; 15] = [
    ("swapped-points", "tip and head are swapped", |filmed| {
        let Traces { tip_x_m, tip_y_m, head_x_m, head_y_m, .. } = filmed.recording.traces().clone();
        let swapped = Traces {
            tip_x_m: head_x_m,
            tip_y_m: head_y_m,
            head_x_m: tip_x_m,
            head_y_m: tip_y_m,
            ..Traces::default()
        };
        filmed.with_traces(swapped)
    }),
    ("mirrored-heights", "heights have the other sign", |filmed| {
        let mut traces = filmed.recording.traces().clone();
        traces.tip_y_m.iter_mut().chain(&mut traces.head_y_m).flatten().for_each(|y| *y = -*y);
        filmed.with_traces(traces)
    }),
    ("frame-rate", "the frame rate is 5,000 instead of 50,000 frames/s", |filmed| filmed.with_rate(10.0)),
    ("frame-rate", "the frame rate is 5,000 instead of 4,167 frames/s", |filmed| filmed.with_rate(1.0 / 1.2)),
    ("scale", "all lengths are 0.1 times those of the recording", |filmed| filmed.with_scale(10.0)),
    ("scale", "all lengths are 1.2 times those of the recording", |filmed| filmed.with_scale(1.0 / 1.2)),
    ("head-late", "the head's clock is 1 +- ", |filmed| {
        let mut traces = filmed.recording.traces().clone();
        for column in [&mut traces.head_x_m, &mut traces.head_y_m] {
            column.rotate_right(5);
            column[..5].fill(None);
        }
        filmed.with_traces(traces)
    }),
    ("lost-frames", "frames were lost and the others closed up: ", |filmed| {
        let kept = |column: &[Option<f64>]| {
            let is_kept = |frame: usize| !(200..207).contains(&frame) && !(800..820).contains(&frame);
            column.iter().enumerate().filter(|(frame, _)| is_kept(*frame)).map(|(_, value)| *value).collect()
        };
        filmed.map_columns(kept)
    }),
    ("recording", "a moving average over 9 frames", |filmed| {
        filmed.map_columns(|column| {
            let mean = |frame: usize| {
                let near = &column[frame.saturating_sub(4)..(frame + 5).min(column.len())];
                let known: Vec<f64> = near.iter().flatten().copied().collect();
                column[frame].map(|_| known.iter().sum::<f64>() / known.len() as f64)
            };
            (0..column.len()).map(mean).collect()
        })
    }),
    ("constant", "the length of the neck is ", |filmed| filmed.with_constant("blade.neck_length_m", 1.3)),
    ("constant", "the mass of the head is ", |filmed| filmed.with_constant("blade.head_mass_kg", 1.6)),
    ("constant", "the mass of the lip is ", |filmed| filmed.with_constant("blade.lip_mass_kg", 0.6)),
    ("constant", "the force of the tip on the glass when upright is ", |filmed| {
        filmed.with_constant("blade.preload_force_n", 1.6)
    }),
    ("shoulder", "the neck meets a shoulder", |filmed| {
        let (before, rest) = SCENE.split_once("[shoulder]").unwrap();
        let (_, after) = rest.split_once("[friction]").unwrap();
        let text = format!("{before}[friction]{after}");
        let mut scene = Scene::parse("no-shoulder.toml", &text).unwrap();
        for (name, value) in filmed.scene.written_values().filter(|(name, _)| !name.starts_with("shoulder."))
        {
            scene = scene.with_parameter(name, value).unwrap();
        }
        Filmed { scene, ..filmed }
    }),
    ("changed-friction", "friction changed during the recording", |filmed| {
        let other = film(&filmed.clone().with_constant("friction.c", 1.4).scene, 77);
        let half = filmed.recording.grid().frames / 2;
        let mut traces = filmed.recording.traces().clone();
        let changed = other.traces();
        for (column, other) in [
            (&mut traces.tip_x_m, &changed.tip_x_m),
            (&mut traces.tip_y_m, &changed.tip_y_m),
            (&mut traces.head_x_m, &changed.head_x_m),
            (&mut traces.head_y_m, &changed.head_y_m),
        ] {
            column[half..].copy_from_slice(&other[half..]);
        }
        filmed.with_traces(traces)
    }),
];

/// Prints the hypotheses of a fit; returns whether the right one is first.
fn names_first(result: &FitResult, name: &str, words: &str) -> bool {
    let seen = result.findings.iter().find(|finding| finding.sentence.contains(words));
    if let Some(seen) = seen.filter(|seen| name == "recording" && seen.hypothesis.is_none()) {
        println!("{name:<18} right {}", seen.sentence);
        return true;
    }
    let mut found = result.findings.iter().filter(|finding| finding.hypothesis.is_some());
    let first = found.next();
    let right = first
        .is_some_and(|first| first.hypothesis.as_deref() == Some(name) && first.sentence.contains(words));
    let others: Vec<_> = found.filter_map(|finding| finding.hypothesis.as_deref()).collect();
    let sentence = first.map_or("nothing", |first| &first.sentence);
    println!("{name:<18} {} {sentence} [then {}]", if right { "right" } else { "wrong" }, others.join(", "));
    right
}

/// Number of errors of all blades that are not named first; prints each.
fn count_misnamed(errors: &[Error], blades: &[usize]) -> usize {
    let one = |(name, words, err): &Error, blade: usize| {
        let result = err(Filmed::record(blade, 3)).fit("");
        assert!(!result.misfit.as_ref().unwrap().explained, "{name} of blade {blade}");
        !names_first(&result, name, words)
    };
    errors.iter().map(|error| blades.iter().filter(|blade| one(error, **blade)).count()).sum()
}

#[test]
fn the_error_of_a_recording_is_named_first() {
    // lost frames
    assert_eq!(count_misnamed(&[ERRORS[7]], &[0]), 0);
    if is_thorough() {
        let all = ERRORS.len() * BLADES.len();
        let misnamed = count_misnamed(&ERRORS, &[0, 1, 2]);
        println!("{} of {all} errors are named first", all - misnamed);
        assert!(misnamed * MOST_MISNAMED <= all, "{misnamed} of {all}");
    }
}

/// Where the noise is stated too low, nothing is wrong with the frames and the scene, but the fit does not
/// explain them.
#[test]
fn a_right_recording_has_no_error() {
    let mut named = 0;
    for seed in 1..=pick(1, 10) {
        for blade in 0..pick(1, BLADES.len()) {
            let filmed = Filmed::record(blade, 10 + seed);
            let result = filmed.fit("");
            let explained = result.misfit.as_ref().unwrap().explained;
            assert_eq!(explained, result.findings.is_empty(), "blade {blade}, seed {seed}");
            named += usize::from(!explained);
            let stricter = filmed.fit("noise_m = 1.2e-6\n");
            assert!(!stricter.misfit.as_ref().unwrap().explained);
            let hypotheses = stricter.findings.iter().filter(|finding| finding.hypothesis.is_some());
            let sentences: Vec<&str> = hypotheses.map(|finding| finding.sentence.as_str()).collect();
            println!("blade {blade}, seed {seed}: explained {explained}; with less noise {sentences:?}");
            named += usize::from(!sentences.is_empty());
        }
    }
    assert!(named <= pick(0, 1), "{named}");
}
