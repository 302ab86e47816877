//! A run, sampled at the times at which the runs are compared.

use crate::recording::{FrameGrid, Recording, Traces};
use crate::simulate::outputs::SampleObserver;
use crate::simulate::predicted_error::{PredictedRun, run_with_predicted_errors};
use crate::simulate::scene::Scene;
use crate::simulate::{SolverOptions, Transition};

/// Maximum number of samples of a comparison; in a long run, the sampling rate is lowered accordingly.
const MOST_SAMPLES: f64 = 1e5;

/// Transitions and samples of a run.
pub(super) struct SampledRun {
    pub predicted: PredictedRun,
    pub transitions: Vec<Transition>,
    pub deflection_m: Vec<f64>,
    pub head_drop_m: Vec<f64>,
}

/// Times at which the runs are compared.
pub(super) fn comparison_grid(scene: &Scene) -> FrameGrid {
    let length = scene.run.stop_s - scene.start_s;
    let frame_rate_hz = scene.run.sample_rate_hz.min(MOST_SAMPLES / length);
    let frames = (length * frame_rate_hz * (1.0 + 1e-12)).floor() as usize + 1;
    FrameGrid { start_s: scene.start_s, frame_rate_hz, frames }
}

impl SampledRun {
    pub(crate) fn run_scene(scene: &Scene, effort: SolverOptions) -> Self {
        let grid = comparison_grid(scene);
        let (mut deflection_m, mut head_drop_m) = (Vec::new(), Vec::new());
        let mut transitions = Vec::new();
        let times = (0..grid.frames).map(|i| grid.time_s(i).min(scene.run.stop_s));
        let mut sampler = SampleObserver::new(times, |sample| {
            deflection_m.push(sample.tip_x_m - sample.head_x_m);
            head_drop_m.push(sample.head_drop_m);
        });
        let receive = |transition: &Transition, _| transitions.push(*transition);
        let predicted = run_with_predicted_errors(scene, effort, &mut sampler, receive);
        Self { predicted, transitions, deflection_m, head_drop_m }
    }

    /// Root-mean-square and largest difference of the deflection over the common samples of two runs,
    /// relative to the range of the reference.
    pub(crate) fn deflection_differences(reference: &Self, other: &Self) -> (f64, f64) {
        let deflections = reference.deflection_m.iter();
        let low = deflections.clone().copied().fold(f64::INFINITY, f64::min);
        let high = deflections.clone().copied().fold(f64::NEG_INFINITY, f64::max);
        let range = if high > low { high - low } else { 1.0 };
        let errors = deflections.zip(&other.deflection_m).map(|(a, b)| ((a - b) / range).abs());
        let (mut squares, mut worst, mut count) = (0.0, 0.0f64, 0);
        for error in errors {
            (squares, worst, count) = (squares + error * error, worst.max(error), count + 1);
        }
        ((squares / f64::from(count.max(1))).sqrt(), worst)
    }

    /// The run as an ideal camera records it; `None` if the run ends before its second sample.
    pub(crate) fn to_recording(&self, scene: &Scene) -> Option<Recording> {
        let grid = comparison_grid(scene);
        let frames = self.deflection_m.len();
        let head: Vec<f64> = (0..frames).map(|i| scene.drive.motion_at(grid.time_s(i)).position_m).collect();
        let traces = Traces {
            tip_x_m: head.iter().zip(&self.deflection_m).map(|(h, d)| Some(h + d)).collect(),
            tip_y_m: vec![Some(0.0); frames],
            head_x_m: head.iter().map(|h| Some(*h)).collect(),
            head_y_m: self.head_drop_m.iter().map(|u| Some(-u)).collect(),
            ..Traces::default()
        };
        Recording::new(scene.title(), FrameGrid { frames, ..grid }, traces, true).ok()
    }
}
