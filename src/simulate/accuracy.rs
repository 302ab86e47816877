//! Work against precision: what every method errs by on a scene, and what it costs, held against a reference
//! an order tighter than the tightest tolerance.
//!
//! Errors are those of the transition times, of the deflection at common instants, and of two spectral
//! components. Times are the caller's: it keeps the clock.

mod components;
mod lists;
mod tables;

pub use components::{Components, HIGH, LOW};
pub use lists::Lists;
pub use tables::{accuracy_csv, work_precision_csv};

use super::outputs::{Sampler, Transitions};
use super::paper::{DEFAULT_GAIN_PER_S, FixedStep, Locate};
use super::scene::{Jam, Loss, Scene};
use super::{Effort, Method, Run, Transition, run_with};
use crate::recording::{FrameGrid, Recording, Traces};

/// Tolerances of a study.
pub const TOLERANCES: [f64; 9] = [1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12];
/// Fixed steps of a study, s: from a tenth of a stick-slip cycle of 1 kHz to where rounding takes over.
pub const STEPS_S: [f64; 5] = [1e-4, 3e-5, 1e-5, 3e-6, 1e-6];
/// Tolerance of the reference.
pub const REFERENCE_TOLERANCE: f64 = 1e-13;
/// Most samples that the deflection is compared at: longer runs are sampled at a lower rate.
const MOST_SAMPLES: f64 = 1e5;

/// A method with what sets its error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setting {
    /// The method.
    pub method: Method,
    /// Its tolerance; a fixed step has none.
    pub relative_tolerance: Option<f64>,
}

impl Setting {
    /// The method's name in tables and figures.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self.method {
            Method::FixedStep(FixedStep { locate: Locate::StepEnd, .. }) => "fixed-step-end",
            Method::FixedStep(FixedStep { locate: Locate::Slack, .. }) => "fixed-step-slack",
            adaptive => adaptive.name(),
        }
    }

    fn effort(&self) -> Effort {
        Effort { method: self.method, ..Effort::new(self.relative_tolerance.unwrap_or(REFERENCE_TOLERANCE)) }
    }
}

/// Every setting that a scene can be run with: each adaptive method at each tolerance, then the fixed steps,
/// unless the scene flies or has impacts.
#[must_use]
pub fn settings(scene: &Scene) -> Vec<Setting> {
    let adaptive = [Method::Taylor, Method::RungeKutta, Method::Slack];
    let tolerances =
        |method| TOLERANCES.map(|relative| Setting { method, relative_tolerance: Some(relative) });
    let fixed = |locate| {
        let scheme = move |step_s| FixedStep { step_s, locate, gain_per_s: DEFAULT_GAIN_PER_S };
        STEPS_S.map(|step_s| Setting { method: Method::FixedStep(scheme(step_s)), relative_tolerance: None })
    };
    let grounded = scene.loss == Loss::Stop && scene.jam == Jam::Stop;
    let schemes = [Locate::StepEnd, Locate::Slack].into_iter().filter(|_| grounded).flat_map(fixed);
    adaptive.into_iter().flat_map(tolerances).chain(schemes).collect()
}

/// What is kept of a run.
struct Seen {
    run: Run,
    transitions: Vec<Transition>,
    deflection_m: Vec<f64>,
    head_drop_m: Vec<f64>,
}

/// Instants at which runs are compared.
fn grid(scene: &Scene) -> FrameGrid {
    let length = scene.run.stop_s - scene.start_s;
    let frame_rate_hz = scene.run.sample_rate_hz.min(MOST_SAMPLES / length);
    FrameGrid {
        start_s: scene.start_s,
        frame_rate_hz,
        frames: (length * frame_rate_hz * (1.0 + 1e-12)).floor() as usize + 1,
    }
}

fn look(scene: &Scene, effort: Effort) -> Seen {
    let grid = grid(scene);
    let (mut deflection_m, mut head_drop_m, mut transitions) =
        (Vec::new(), Vec::new(), Transitions::default());
    let times = (0..grid.frames).map(|i| grid.time_s(i).min(scene.run.stop_s));
    let sampler = Sampler::new(times, |sample| {
        deflection_m.push(sample.tip_x_m - sample.head_x_m);
        head_drop_m.push(sample.head_drop_m);
    });
    let run = run_with(scene, effort, &mut (sampler, &mut transitions));
    Seen { run, transitions: transitions.0, deflection_m, head_drop_m }
}

/// The run that the others are held against.
pub struct Reference<'a> {
    scene: &'a Scene,
    seen: Seen,
    spectral: components::Reader,
    /// Its components, Hz.
    pub components: Components,
    /// The method that it is checked against, at the same tolerance.
    pub checked_by: Method,
    /// Worst difference of the two methods' transition times, s; `None` when their lists differ or are empty.
    pub apart_s: Option<f64>,
    /// Whether the two lists of transitions agree.
    pub lists_agree: bool,
    /// Worst difference of their deflections relative to its range.
    pub state_apart: f64,
}

/// What a setting errs by and costs.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The setting.
    pub setting: Setting,
    /// How the run went.
    pub run: Run,
    /// Time that it took, s; infinite until the caller has taken it.
    pub wall_s: f64,
    /// Its list of transitions against the reference's.
    pub lists: Lists,
    /// Time of its end against the reference's, s.
    pub stop_error_s: f64,
    /// Root mean square error of the deflection, relative to its range.
    pub state_rms: f64,
    /// Worst error of the deflection, relative to its range.
    pub state_worst: f64,
    /// Errors of the components, Hz, where both runs show them.
    pub components_hz: [Option<f64>; 2],
}

impl<'a> Reference<'a> {
    /// Runs a scene by the default method and checks it against Runge-Kutta.
    #[must_use]
    pub fn of(scene: &'a Scene) -> Self {
        let reference = |method| look(scene, Effort { method, ..Effort::new(REFERENCE_TOLERANCE) });
        let checked_by = Method::RungeKutta;
        let [seen, check] = [Method::default(), checked_by].map(reference);
        let lists = Lists::compare(&seen.transitions, &check.transitions);
        let (_, state_apart) = differences(&seen, &check);
        let spectral = components::Reader::of(scene, recording(scene, &seen).as_ref());
        let components = spectral.read(&seen.deflection_m, &seen.head_drop_m);
        Self {
            scene,
            spectral,
            components,
            checked_by,
            apart_s: lists.worst_s,
            lists_agree: lists.agree(),
            state_apart,
            seen,
        }
    }

    /// How the reference itself went.
    #[must_use]
    pub fn run(&self) -> &Run {
        &self.seen.run
    }

    /// Whether an error of transition times is larger than what the reference is sure of.
    #[must_use]
    pub fn is_sure_of(&self, error_s: f64) -> bool {
        self.lists_agree && self.apart_s.is_none_or(|apart| error_s > apart)
    }

    /// Runs a setting and nothing else, to be timed.
    #[must_use]
    pub fn run_bare(&self, setting: &Setting) -> Run {
        run_with(self.scene, setting.effort(), &mut ())
    }

    /// Runs a setting and holds it against the reference.
    #[must_use]
    pub fn measure(&self, setting: Setting) -> Row {
        let seen = look(self.scene, setting.effort());
        let (state_rms, state_worst) = differences(&self.seen, &seen);
        let components = self.spectral.read(&seen.deflection_m, &seen.head_drop_m);
        let error = |i: usize| Some((components.hz[i]? - self.components.hz[i]?).abs());
        Row {
            setting,
            wall_s: f64::INFINITY,
            lists: Lists::compare(&self.seen.transitions, &seen.transitions),
            stop_error_s: (seen.run.stopped_at_s - self.seen.run.stopped_at_s).abs(),
            state_rms,
            state_worst,
            components_hz: [error(LOW), error(HIGH)],
            run: seen.run,
        }
    }
}

/// Root mean square and worst difference of the deflection over the samples that both runs reached, relative
/// to its range.
fn differences(reference: &Seen, other: &Seen) -> (f64, f64) {
    let (low, high) = reference
        .deflection_m
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
    let range = if high > low { high - low } else { 1.0 };
    let errors = reference.deflection_m.iter().zip(&other.deflection_m).map(|(a, b)| ((a - b) / range).abs());
    let (mut squares, mut worst, mut count) = (0.0, 0.0f64, 0);
    for error in errors {
        (squares, worst, count) = (squares + error * error, worst.max(error), count + 1);
    }
    ((squares / f64::from(count.max(1))).sqrt(), worst)
}

/// The reference as a camera without fault would record it; `None` for a run that ended before its second
/// sample.
fn recording(scene: &Scene, seen: &Seen) -> Option<Recording> {
    let grid = grid(scene);
    let frames = seen.deflection_m.len();
    let head: Vec<f64> = (0..frames).map(|i| scene.drive.at(grid.time_s(i)).position_m).collect();
    let traces = Traces {
        tip_x_m: head.iter().zip(&seen.deflection_m).map(|(h, d)| Some(h + d)).collect(),
        tip_y_m: vec![Some(0.0); frames],
        head_x_m: head.iter().map(|h| Some(*h)).collect(),
        head_y_m: seen.head_drop_m.iter().map(|u| Some(-u)).collect(),
        ..Traces::default()
    };
    Recording::new(scene.title(), FrameGrid { frames, ..grid }, traces, true).ok()
}
