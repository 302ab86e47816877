//! The model of a fit: scenes with some parameters replaced, each recorded by the camera of its recording.

use super::evaluation::{FailureReason, RunFailure};
use super::model::{Draw, Model, Restart};
use super::trace::FittedTraces;
use crate::model::Pose;
use crate::model::modes::{TipConstraint, natural_modes, time_scales_rad_per_s};
use crate::model::parameters::name_if_in_recording;
use crate::recording::Recording;
use crate::simulate::drive::Drive;
use crate::simulate::outputs::LargestTilt;
use crate::simulate::scene::{Scene, StartKind};
use crate::simulate::twin::{
    Camera, TrackingModel, TwinView, TwinViewError, add_tracking_noise, film_scene, film_scene_with_observer,
};
use crate::simulate::{Observer, RunResult, RunStatus, SolverOptions, initial_pose};
use portable_math::StandardNormal;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;

/// Maximum number of evaluations of the right-hand side in a run: a hundred times the number that a run over
/// one reversal needs. A run that reaches this maximum takes a few seconds.
const MAX_EVALUATIONS: u64 = 20_000_000;

/// Relative tolerance of the model's runs. Features are measured to 1e-3, and a run with 1e-6 has the same
/// transitions between stick and slip as a run with 1e-8.
const TOLERANCE: f64 = 1e-6;
/// Reference angle, rad, for a blade that starts upright: the standard deviation of its starting angles is
/// `spread` times this angle. A blade in use leans by 0.1 to 1 rad.
const REFERENCE_LEAN_RAD: f64 = 0.1;
/// Difference between the random seeds of successive conditions, so that no two conditions have the same
/// noise.
const CONDITION_SEEDS: u64 = 1 << 32;

/// The camera of a recording and the noise of its tracking.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instrument {
    /// The camera.
    pub camera: Camera,
    /// Standard deviation of a tracked coordinate, m. The noise is added to simulated recordings too, because
    /// it biases features such as the time of release or the power in a band.
    pub noise_m: f64,
    /// Fraction of the frames in which the tracking loses a point. It applies only to twins; in other
    /// simulated recordings no points are lost.
    pub dropout_fraction: f64,
}

/// A scene and the camera that records it.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelCondition {
    /// The scene, with the values that the condition sets.
    pub scene: Scene,
    /// The camera and its tracking noise.
    pub instrument: Instrument,
}

/// Spread of the starting states, and largest plausible tilt of the links.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PlausibilityLimits {
    /// Standard deviation of the starting angles, relative to the angles themselves.
    pub spread: f64,
    /// Largest allowed angle of neck or lip from the vertical, rad; `None` for no limit.
    pub largest_tilt_rad: Option<f64>,
}

/// A model of scenes in which a fit changes named parameters.
#[derive(Clone)]
pub struct SceneModel {
    conditions: Vec<ModelCondition>,
    names: Vec<String>,
    plausible: PlausibilityLimits,
    /// Recordings whose traces were fitted, by condition; empty before a fit to traces.
    traces: Vec<Option<FittedTraces>>,
}

impl SceneModel {
    /// A model of `conditions`; `names` are the free parameters in job order.
    #[must_use]
    pub fn new(conditions: Vec<ModelCondition>, names: Vec<String>, plausible: PlausibilityLimits) -> Self {
        Self { conditions, names, plausible, traces: Vec::new() }
    }

    /// The same model with other conditions and with fitted traces.
    pub(super) fn with_conditions(
        &self,
        conditions: Vec<ModelCondition>,
        traces: Vec<Option<FittedTraces>>,
    ) -> Self {
        Self { conditions, names: self.names.clone(), plausible: self.plausible, traces }
    }

    /// The recording of a condition beside the fitted model, if its traces were fitted.
    pub(crate) fn fitted_traces(&self, condition: usize) -> Option<&FittedTraces> {
        self.traces.get(condition)?.as_ref()
    }

    pub(crate) fn conditions(&self) -> &[ModelCondition] {
        &self.conditions
    }

    pub(super) fn conditions_mut(&mut self) -> &mut [ModelCondition] {
        &mut self.conditions
    }

    /// The scene of a condition with the given values of the free parameters.
    ///
    /// # Errors
    /// [`RunFailure`] if the scene refuses a value.
    pub(crate) fn scene_at(&self, values: &[f64], condition: usize) -> Result<Scene, RunFailure> {
        let scene = self.condition(condition)?.scene.clone();
        let set = |scene: Scene, (name, value): (&String, &f64)| match name_if_in_recording(name, condition) {
            Some(name) => scene.with_parameter(name, *value),
            None => Ok(scene),
        };
        let scene = self.names.iter().zip(values).try_fold(scene, set);
        scene.map_err(|error| RunFailure::new(FailureReason::Refused, error.to_string(), 0.0))
    }

    /// Recording of a scene by the camera of a condition, with the solver tolerance of the scene and without
    /// tracking noise. A run that ends early is recorded up to its end; `observer` follows the run.
    ///
    /// # Errors
    /// [`RunFailure`] if fewer than two frames were recorded.
    pub(crate) fn record_scene(
        &self,
        scene: &Scene,
        condition: usize,
        observer: &mut impl Observer,
    ) -> Result<TwinView, RunFailure> {
        let (camera, span) =
            (&self.condition(condition)?.instrument.camera, [scene.start_s, scene.run.stop_s]);
        let options = SolverOptions::new(scene.run.relative_tolerance);
        let seen = film_scene_with_observer(scene, camera, span, options, observer);
        seen.map_err(|error| view_failure(scene, &error))
    }

    fn condition(&self, condition: usize) -> Result<&ModelCondition, RunFailure> {
        self.conditions.get(condition).ok_or_else(|| {
            let message = format!("there is no condition number {}", condition + 1);
            RunFailure::new(FailureReason::Refused, message, 0.0)
        })
    }

    /// Recording of a run from the time `from_s` on, without tracking noise; it fails if the run ends before
    /// its stop time.
    fn record_completed_run(
        &self,
        scene: &Scene,
        camera: &Camera,
        from_s: f64,
    ) -> Result<Recording, RunFailure> {
        let options = SolverOptions {
            most_evaluations: MAX_EVALUATIONS,
            ..SolverOptions::new(scene.run.relative_tolerance.max(TOLERANCE))
        };
        let failure = |error: TwinViewError| view_failure(scene, &error);
        let seen = match self.plausible.largest_tilt_rad {
            None => film_scene(scene, camera, from_s, scene.run.stop_s, options).map_err(failure)?,
            Some(largest_rad) => {
                let (mut tilt, span) = (LargestTilt::default(), [from_s, scene.run.stop_s]);
                let seen = film_scene_with_observer(scene, camera, span, options, &mut tilt);
                let seen = seen.map_err(failure)?;
                check_tilt(scene, &tilt, largest_rad)?;
                seen
            }
        };
        check_completed(scene, &seen.run)?;
        Ok(seen.recording)
    }

    /// Recording of a run from the time `from_s` on, with tracking noise; it fails if the run ends before its
    /// stop time.
    fn record_with_noise(
        &self,
        scene: &Scene,
        condition: usize,
        draw: Draw,
        from_s: f64,
    ) -> Result<Recording, RunFailure> {
        let instrument = &self.condition(condition)?.instrument;
        let seen = self.record_completed_run(scene, &instrument.camera, from_s)?;
        let dropout_fraction = if draw.dropouts { instrument.dropout_fraction } else { 0.0 };
        let seed = draw.noise + condition as u64 * CONDITION_SEEDS;
        let tracking =
            TrackingModel { metres_per_pixel: instrument.noise_m, noise_px: 1.0, dropout_fraction, seed };
        add_tracking_noise(&seen, seen.name(), &tracking)
            .map_err(|error| RunFailure::new(FailureReason::NotFinite, error.to_string(), 1.0))
    }

    /// The scene with the starting state of number `member` of the ensemble; 0 is the starting state of the
    /// scene itself.
    fn draw_start(&self, mut scene: Scene, member: u64) -> Scene {
        if member == 0 || self.plausible.spread == 0.0 {
            return scene;
        }
        let Some(pose) = start_pose(&scene) else { return scene };
        let (rate, _) = time_scales_rad_per_s(&scene.linkage);
        let mut generator = Xoshiro256PlusPlus::seed_from_u64(member);
        let mut moved = |lean: f64| {
            let size = self.plausible.spread * if lean == 0.0 { REFERENCE_LEAN_RAD } else { lean.abs() };
            let (angle, velocity): (f64, f64) =
                (generator.sample(StandardNormal), generator.sample(StandardNormal));
            (size * angle, size * rate * velocity)
        };
        let ((theta, theta_rate), (phi, phi_rate)) = (moved(pose.theta), moved(pose.phi));
        scene.start = StartKind::State(Pose {
            theta: pose.theta + theta,
            phi: pose.phi + phi,
            theta_rate: pose.theta_rate + theta_rate,
            phi_rate: pose.phi_rate + phi_rate,
        });
        scene
    }
}

impl Model for SceneModel {
    fn record_condition(
        &self,
        values: &[f64],
        condition: usize,
        draw: Draw,
    ) -> Result<Recording, RunFailure> {
        let scene = self.draw_start(self.scene_at(values, condition)?, draw.member);
        self.record_with_noise(&scene, condition, draw, scene.start_s)
    }

    fn record_restarted(
        &self,
        values: &[f64],
        condition: usize,
        draw: Draw,
        restart: Restart,
    ) -> Result<Recording, RunFailure> {
        let mut scene = self.scene_at(values, condition)?;
        let from_s = scene.start_s;
        match restart {
            Restart::Earlier(lead_s) => scene.start_s -= lead_s,
            Restart::Moved(share) => {
                if let Some(pose) = start_pose(&scene) {
                    let (theta, phi) = ((1.0 + share) * pose.theta, (1.0 + share) * pose.phi);
                    scene.start = StartKind::State(Pose { theta, phi, ..pose });
                }
            }
        }
        let scene = self.draw_start(scene, draw.member);
        self.record_with_noise(&scene, condition, draw, from_s)
    }

    fn decay_s(&self, values: &[f64], condition: usize) -> Option<f64> {
        let scene = self.scene_at(values, condition).ok()?;
        let (blade, length_s) = (&scene.linkage, scene.run.stop_s - scene.start_s);
        let of_links = natural_modes(blade, TipConstraint::Free, false)
            .into_iter()
            .filter_map(|mode| Some(1.0 / (mode.damping_ratio? * TAU * mode.frequency_hz?)));
        let of_head = 2.0 * blade.mass_kg / blade.head.damping;
        let slowest = of_links.chain([of_head]).filter(|decay_s| *decay_s > 0.0).max_by(f64::total_cmp)?;
        Some(slowest.min(length_s))
    }

    fn max_lead_s(&self, condition: usize) -> f64 {
        match self.conditions.get(condition).map(|condition| &condition.scene) {
            Some(Scene { drive: Drive::Recorded(head), start_s, .. }) => start_s - head.span_s()[0],
            // a run that starts in the air or in a given pose cannot start earlier
            Some(Scene {
                start: StartKind::Airborne(_) | StartKind::State(_) | StartKind::Slider { .. },
                ..
            }) => 0.0,
            _ => f64::INFINITY,
        }
    }
}

/// The pose in which a scene starts; `None` for a start in the air.
fn start_pose(scene: &Scene) -> Option<Pose> {
    initial_pose(scene).filter(|_| !matches!(scene.start, StartKind::Airborne(_)))
}

fn view_failure(scene: &Scene, error: &TwinViewError) -> RunFailure {
    match error {
        TwinViewError::Early { status, stopped_at_s } => {
            let progress = run_progress(scene, *stopped_at_s);
            RunFailure::new(FailureReason::Ended(*status), error.to_string(), progress)
        }
        TwinViewError::Recording(_) => RunFailure::new(FailureReason::NotFinite, error.to_string(), 0.0),
    }
}

/// Fraction of the run that is completed at the time `time_s`.
fn run_progress(scene: &Scene, time_s: f64) -> f64 {
    (time_s - scene.start_s) / (scene.run.stop_s - scene.start_s)
}

fn check_completed(scene: &Scene, run: &RunResult) -> Result<(), RunFailure> {
    if run.status == RunStatus::Completed {
        return Ok(());
    }
    let message = format!("{} at {} s: {}", run.status.name(), run.stopped_at_s, run.status.meaning());
    Err(RunFailure::new(FailureReason::Ended(run.status), message, run_progress(scene, run.stopped_at_s)))
}

fn check_tilt(scene: &Scene, tilt: &LargestTilt, largest_rad: f64) -> Result<(), RunFailure> {
    if tilt.largest_rad <= largest_rad {
        return Ok(());
    }
    let (found, allowed) = (tilt.largest_rad.to_degrees(), largest_rad.to_degrees());
    let at_s = tilt.at_s;
    let message = format!(
        "a link leans by {found:.1} degrees at {at_s} s, more than the {allowed:.1} that are plausible"
    );
    // the less the tilt exceeds its limit, the larger is the progress and the lower the cost
    let progress = run_progress(scene, scene.run.stop_s) * largest_rad / tilt.largest_rad;
    Err(RunFailure::new(FailureReason::Tilt, message, progress))
}
