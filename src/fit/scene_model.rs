//! The model of a fit: scenes with some parameters replaced, each seen through the camera of its recording.

use super::failure::{FailureReason, RunFailure};
use super::model::{Draw, Model, Restart};
use crate::blade::Pose;
use crate::blade::modes::{Tip, modes, time_scales_rad_per_s};
use crate::math::StandardNormal;
use crate::recording::Recording;
use crate::simulate::drive::Drive;
use crate::simulate::equilibrium::steady_slide;
use crate::simulate::outputs::Tilt;
use crate::simulate::scene::{Scene, StartKind};
use crate::simulate::{Effort, Observer, Run, Status};
use crate::twin::{Camera, Tracking, View, ViewError, observed_view, track, view};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;

/// Right-hand sides after which an evaluation is given up: some hundred times what a reversal costs, a few
/// seconds.
const MOST_EVALUATIONS: u64 = 20_000_000;

/// Tolerance of the model's runs: features are read to about 1e-3, and at 1e-6 the transitions are those of
/// 1e-8 and finer.
const TOLERANCE: f64 = 1e-6;
/// An angle that a spread of starting states refers to where the blade starts upright, rad: blades in use
/// lean by 0.1 to 1.
const LEAN: f64 = 0.1;
/// Far apart, so that the noise of one condition is not that of another with the next seed.
const CONDITION_SEEDS: u64 = 1 << 32;

/// How a recording was seen: its camera and the noise of its tracking.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instrument {
    /// The camera.
    pub camera: Camera,
    /// Standard deviation of a tracked coordinate, m; the model gets as much, because noise shifts what is
    /// read (when a tip is seen to leave its place, the power in a band).
    pub noise_m: f64,
    /// Share of the frames in which a point was lost; only twins lose as many.
    pub dropout_fraction: f64,
}

/// A scene and how it was seen.
#[derive(Debug, Clone, PartialEq)]
pub struct Condition {
    /// The scene, with what this condition sets.
    pub scene: Scene,
    /// How it was seen.
    pub instrument: Instrument,
}

/// Which blades count.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Plausible {
    /// Relative spread of the starting states.
    pub spread: f64,
    /// Largest angle of a link from the vertical, rad; `None` for any.
    pub largest_tilt_rad: Option<f64>,
}

/// Scenes whose named parameters a fit may change.
pub struct SceneModel {
    conditions: Vec<Condition>,
    names: Vec<String>,
    plausible: Plausible,
}

impl SceneModel {
    /// A model of these conditions; `names` are the free parameters in job order.
    #[must_use]
    pub fn new(conditions: Vec<Condition>, names: Vec<String>, plausible: Plausible) -> Self {
        Self { conditions, names, plausible }
    }

    /// The same for other conditions.
    #[must_use]
    pub(super) fn with_conditions(&self, conditions: Vec<Condition>) -> Self {
        Self { conditions, names: self.names.clone(), plausible: self.plausible }
    }

    /// The conditions.
    #[must_use]
    pub fn conditions(&self) -> &[Condition] {
        &self.conditions
    }

    /// The scene of a condition with these values of the free parameters.
    ///
    /// # Errors
    /// The scene's refusal, as a failure of the run.
    pub fn scene_at(&self, values: &[f64], condition: usize) -> Result<Scene, RunFailure> {
        let scene = self.condition(condition)?.scene.clone();
        let set = |scene: Scene, (name, value): (&String, &f64)| scene.with(name, *value);
        self.names
            .iter()
            .zip(values)
            .try_fold(scene, set)
            .map_err(|error| RunFailure::new(FailureReason::Refused, error.to_string(), 0.0))
    }

    /// What a condition's camera records of a scene at the tolerance of the scene itself, without tracking
    /// noise and however the run ends; `observer` follows the same run.
    ///
    /// # Errors
    /// [`RunFailure`] when fewer than two frames were taken.
    pub(crate) fn recorded(
        &self,
        scene: &Scene,
        condition: usize,
        observer: &mut impl Observer,
    ) -> Result<View, RunFailure> {
        let (camera, span) =
            (&self.condition(condition)?.instrument.camera, [scene.start_s, scene.run.stop_s]);
        observed_view(scene, camera, span, Effort::new(scene.run.relative_tolerance), observer)
            .map_err(|error| blind(scene, &error))
    }

    fn condition(&self, condition: usize) -> Result<&Condition, RunFailure> {
        self.conditions.get(condition).ok_or_else(|| {
            RunFailure::new(
                FailureReason::Refused,
                format!("there is no condition number {}", condition + 1),
                0.0,
            )
        })
    }

    /// A run that ended as it should, recorded from `from_s` on without tracking noise.
    fn ran(&self, scene: &Scene, camera: &Camera, from_s: f64) -> Result<Recording, RunFailure> {
        let span = [from_s, scene.run.stop_s];
        let seen = match self.plausible.largest_tilt_rad {
            None => {
                view(scene, camera, span[0], span[1], effort(scene)).map_err(|error| blind(scene, &error))?
            }
            Some(largest_rad) => {
                let mut tilt = Tilt::default();
                let seen = observed_view(scene, camera, span, effort(scene), &mut tilt)
                    .map_err(|error| blind(scene, &error))?;
                upright(scene, &tilt, largest_rad)?;
                seen
            }
        };
        whole(scene, &seen.run)?;
        Ok(seen.recording)
    }

    /// What a camera and its tracking make of a run.
    fn tracked(
        &self,
        scene: &Scene,
        condition: usize,
        draw: Draw,
        from_s: f64,
    ) -> Result<Recording, RunFailure> {
        let instrument = &self.condition(condition)?.instrument;
        let seen = self.ran(scene, &instrument.camera, from_s)?;
        let dropout_fraction = if draw.dropouts { instrument.dropout_fraction } else { 0.0 };
        let seed = draw.noise + condition as u64 * CONDITION_SEEDS;
        let tracking =
            Tracking { metres_per_pixel: instrument.noise_m, noise_px: 1.0, dropout_fraction, seed };
        track(&seen, seen.name(), &tracking)
            .map_err(|error| RunFailure::new(FailureReason::NotFinite, error.to_string(), 1.0))
    }

    /// The scene as it starts in a draw.
    fn started(&self, mut scene: Scene, member: u64) -> Scene {
        if member == 0 || self.plausible.spread == 0.0 {
            return scene;
        }
        let Some(pose) = own_start(&scene) else { return scene };
        let (rate, _) = time_scales_rad_per_s(&scene.linkage);
        let mut generator = Xoshiro256PlusPlus::seed_from_u64(member);
        let mut moved = |lean: f64| {
            let size = self.plausible.spread * if lean == 0.0 { LEAN } else { lean.abs() };
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
    fn observe(&self, values: &[f64], condition: usize, draw: Draw) -> Result<Recording, RunFailure> {
        let scene = self.started(self.scene_at(values, condition)?, draw.member);
        self.tracked(&scene, condition, draw, scene.start_s)
    }

    fn restarted(
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
                if let Some(pose) = own_start(&scene) {
                    let (theta, phi) = ((1.0 + share) * pose.theta, (1.0 + share) * pose.phi);
                    scene.start = StartKind::State(Pose { theta, phi, ..pose });
                }
            }
        }
        let scene = self.started(scene, draw.member);
        self.tracked(&scene, condition, draw, from_s)
    }

    fn decay_s(&self, values: &[f64], condition: usize) -> Option<f64> {
        let scene = self.scene_at(values, condition).ok()?;
        let (blade, length_s) = (&scene.linkage, scene.run.stop_s - scene.start_s);
        let of_links = modes(blade, Tip::Free, false)
            .into_iter()
            .filter_map(|mode| Some(1.0 / (mode.damping_ratio? * TAU * mode.frequency_hz?)));
        let of_head = 2.0 * blade.mass_kg / blade.head.damping;
        let slowest = of_links.chain([of_head]).filter(|decay_s| *decay_s > 0.0).max_by(f64::total_cmp)?;
        Some(slowest.min(length_s))
    }

    fn most_lead_s(&self, condition: usize) -> f64 {
        match self.conditions.get(condition).map(|condition| &condition.scene) {
            Some(Scene { drive: Drive::Recorded(head), start_s, .. }) => start_s - head.span_s()[0],
            // a blade that starts in the air or in a stated pose is there at that time
            Some(Scene { start: StartKind::Airborne(_) | StartKind::State(_), .. }) => 0.0,
            _ => f64::INFINITY,
        }
    }
}

/// The pose in which a scene starts; `None` in the air.
fn own_start(scene: &Scene) -> Option<Pose> {
    match scene.start {
        StartKind::SteadySlide => {
            steady_slide(&scene.linkage, scene.drive.at(scene.start_s).velocity_m_per_s)
        }
        StartKind::State(pose) => Some(pose),
        StartKind::Upright => Some(Pose { theta: 0.0, phi: 0.0, theta_rate: 0.0, phi_rate: 0.0 }),
        StartKind::Airborne(_) => None,
    }
}

fn effort(scene: &Scene) -> Effort {
    Effort { most_evaluations: MOST_EVALUATIONS, ..Effort::new(scene.run.relative_tolerance.max(TOLERANCE)) }
}

fn blind(scene: &Scene, error: &ViewError) -> RunFailure {
    match error {
        ViewError::Early { status, stopped_at_s } => {
            RunFailure::new(FailureReason::Ended(*status), error.to_string(), progress(scene, *stopped_at_s))
        }
        ViewError::Recording(_) => RunFailure::new(FailureReason::NotFinite, error.to_string(), 0.0),
    }
}

/// Share of the run that was reached.
fn progress(scene: &Scene, time_s: f64) -> f64 {
    (time_s - scene.start_s) / (scene.run.stop_s - scene.start_s)
}

fn whole(scene: &Scene, run: &Run) -> Result<(), RunFailure> {
    if run.status == Status::Completed {
        return Ok(());
    }
    let message = format!("{} at {} s: {}", run.status.name(), run.stopped_at_s, run.status.meaning());
    Err(RunFailure::new(FailureReason::Ended(run.status), message, progress(scene, run.stopped_at_s)))
}

fn upright(scene: &Scene, tilt: &Tilt, largest_rad: f64) -> Result<(), RunFailure> {
    if tilt.largest_rad <= largest_rad {
        return Ok(());
    }
    let (found, allowed) = (tilt.largest_rad.to_degrees(), largest_rad.to_degrees());
    let message = format!(
        "a link leans by {found:.1} degrees at {} s, more than the {allowed:.1} that are plausible",
        tilt.at_s
    );
    // the nearer to the limit, the better
    Err(RunFailure::new(
        FailureReason::Tilt,
        message,
        progress(scene, scene.run.stop_s) * largest_rad / tilt.largest_rad,
    ))
}
