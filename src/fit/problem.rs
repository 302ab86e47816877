//! A job with its scenes and recordings: everything that decides a fit.

use super::job::{FitTarget, FreeParameter, HeadSource, Job};
use super::ledger::{FitProgress, OnProgress};
use super::model::ModelFeatures;
use super::nuisance_parameters::{FreedConstant, NuisanceError, check_scaling, free_constants};
use super::objective::Objective;
use super::result::{
    FeatureResult, FitResult, ModelledTargets, NuisanceResult, StartState, predicted_feature_result,
};
use super::run::{FitContext, fit_features, predict_held_out, read_best_model, search_axis};
use super::scene_model::{Instrument, ModelCondition, PlausibilityLimits, SceneModel};
use super::targets::TargetValue;
use super::trace::{TraceModel, TraceSource};
use super::trace_data::{TraceData, TraceError, prepare_traces};
use super::trace_ledger::TraceProgress;
use super::{FitError, job};
use crate::checkpoint::{CheckpointSink, NullSink, fingerprint};
use crate::model::Pose;
use crate::recording::quality::measure_quality;
use crate::recording::{FrameGrid, Recording, Traces};
use crate::simulate::drive::{Drive, HeadMotionError, smooth_head_motion};
use crate::simulate::scene::{Scene, SceneError, StartKind};
use crate::simulate::twin::Camera;
use serde::Serialize;
use std::ops::ControlFlow;
use std::sync::Arc;

/// Most frames of a run of the model: each thread holds one run, a million frames are a tenth of a gigabyte,
/// and a mistyped rate is refused instead of filling memory.
const MOST_FRAMES: f64 = 1e6;

/// A recording with what its frames do not say.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredRecording {
    /// The recording.
    pub recording: Recording,
    /// Time for which the shutter was open, s; `None` where it is unknown, which counts as an instant.
    pub exposure_s: Option<f64>,
}

impl From<Recording> for MeasuredRecording {
    fn from(recording: Recording) -> Self {
        Self { recording, exposure_s: None }
    }
}

/// Why a job does not go with its scenes and recordings.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ProblemError {
    /// The job has another number of conditions.
    #[error("found {found} scenes, expected {expected}, one for each recording and condition of the job")]
    Scenes {
        /// Scenes given.
        found: usize,
        /// Conditions of the job.
        expected: usize,
    },
    /// The job has another number of recordings.
    #[error("found {found} recordings, expected the {expected} of the job")]
    Recordings {
        /// Recordings given.
        found: usize,
        /// Recordings of the job.
        expected: usize,
    },
    /// A scene cannot be driven by its recording.
    #[error("`{condition}`, `drive`: {problem}")]
    Drive {
        /// Name of the condition.
        condition: String,
        /// The scene's refusal.
        problem: Box<SceneError>,
    },
    /// A scene refuses what a condition sets.
    #[error("`{condition}`, `set`, `{name}`: {problem}")]
    Set {
        /// Name of the condition.
        condition: String,
        /// Name of the parameter.
        name: String,
        /// The scene's refusal.
        problem: Box<SceneError>,
    },
    /// A camera takes too few or too many frames of a run.
    #[error(
        "`{condition}`: found {found:.3e} frames in the {length_s} s of its scene's run at {frame_rate_hz} frames/s, expected 1 to {MOST_FRAMES:e}; correct the rate of the camera, or run.stop_s of the scene"
    )]
    Frames {
        /// Name of the condition.
        condition: String,
        /// Frames of a run.
        found: f64,
        /// Length of the run, s.
        length_s: f64,
        /// Rate of the camera, 1/s.
        frame_rate_hz: f64,
    },
    /// A trace does not go with its recording.
    #[error(transparent)]
    Trace(#[from] TraceError),
    /// Constants or parameters cannot be freed as the job wants it.
    #[error(transparent)]
    Constants(#[from] NuisanceError),
    /// A scene refuses a bound of a free parameter.
    #[error("bounds of `{name}`: {problem}")]
    Bounds {
        /// Name of the parameter.
        name: String,
        /// The scene's refusal.
        problem: Box<SceneError>,
    },
}

/// A checked job with its scenes and recordings, ready to be fitted.
pub struct Problem {
    job: Job,
    model: SceneModel,
    recordings: Vec<Option<Recording>>,
    traces: Vec<TraceData>,
    segment_s: Vec<f64>,
    constants: Vec<FreedConstant>,
    fingerprint: String,
}

impl Problem {
    /// Puts a job together with its scenes, one for each of [`Job::conditions`], and its recordings, one for
    /// each condition that has one, both in the order of the job.
    ///
    /// What a condition sets is set in its scene, and both bounds of every free parameter are tried.
    ///
    /// # Errors
    /// [`ProblemError`] at the first that does not fit.
    pub fn new(job: Job, scenes: Vec<Scene>, measured: Vec<MeasuredRecording>) -> Result<Self, ProblemError> {
        let (found, expected) = (scenes.len(), job.conditions.len());
        if found != expected {
            return Err(ProblemError::Scenes { found, expected });
        }
        let (found, expected) = (measured.len(), job.recordings().count());
        if found != expected {
            return Err(ProblemError::Recordings { found, expected });
        }
        let mut measured = measured.into_iter();
        let measured: Vec<Option<MeasuredRecording>> = job
            .conditions
            .iter()
            .map(|condition| condition.recording.as_ref().and_then(|_| measured.next()))
            .collect();
        let scenes: Vec<Scene> = (0..scenes.len())
            .map(|at| check_scene(&job, at, &scenes[at], measured[at].as_ref()))
            .collect::<Result<_, _>>()?;
        let mut filmed = scenes.iter().zip(&measured).zip(&job.conditions);
        filmed.try_for_each(|((scene, measured), condition)| {
            check_frames(&job, &condition.name, scene, measured.as_ref())
        })?;
        let constants = free_constants(&job, &scenes)?;
        check_scaling(&job, &scenes)?;
        let fingerprint = fingerprint(&ProblemIdentity {
            version: env!("CARGO_PKG_VERSION"),
            job: job.identity(),
            scenes: &scenes,
            recordings: measured.iter().map(|measured| measured.as_ref().map(Into::into)).collect(),
        });
        let recordings: Vec<Option<Recording>> =
            measured.iter().map(|measured| Some(measured.as_ref()?.recording.clone())).collect();
        let (traces, segment_s) = prepare_traces(&job, &scenes, &recordings)?;
        let conditions = scenes.into_iter().zip(&measured).map(|(scene, measured)| ModelCondition {
            scene,
            instrument: recording_instrument(&job, measured.as_ref()),
        });
        let plausible =
            PlausibilityLimits { spread: job.ensemble.spread, largest_tilt_rad: job.largest_tilt_rad };
        let model = SceneModel::new(conditions.collect(), job.parameter_names(), plausible);
        Ok(Self { job, model, recordings, traces, segment_s, constants, fingerprint })
    }

    /// The job.
    #[must_use]
    pub fn job(&self) -> &Job {
        &self.job
    }

    /// Each scene through the camera of its recording, or through the job's own.
    pub(crate) fn model(&self) -> &SceneModel {
        &self.model
    }

    /// One for each condition of the job that has one.
    pub(crate) fn recordings(&self) -> &[Option<Recording>] {
        &self.recordings
    }

    /// The traces that are fitted; none in a job on features alone.
    pub(crate) fn traces(&self) -> &[TraceData] {
        &self.traces
    }

    /// Lengths of the segments in each stage of a trace fit, s, rising.
    #[must_use]
    pub fn segment_s(&self) -> &[f64] {
        &self.segment_s
    }

    /// Constants of the scenes that are freed within priors.
    pub(crate) fn constants(&self) -> &[FreedConstant] {
        &self.constants
    }

    /// The model of the traces that are fitted; `None` in a job on features alone.
    ///
    /// # Errors
    /// [`HeadMotionError`] where the head that drives a model is not tracked.
    pub fn trace_model(&self) -> Option<Result<TraceModel, HeadMotionError>> {
        if self.traces.is_empty() {
            return None;
        }
        let sources: Vec<TraceSource<'_>> = self
            .traces
            .iter()
            .filter_map(|traced| {
                let condition = &self.model.conditions()[traced.condition];
                let recording = self.recordings[traced.condition].as_ref()?;
                let exposure_s = condition.instrument.camera.exposure_s;
                Some(TraceSource { scene: &condition.scene, recording, exposure_s, traced })
            })
            .collect();
        Some(TraceModel::new(&sources, &self.job.parameters, &self.constants))
    }

    /// SHA-256 over everything that decides the cost of a point, from [`fingerprint`]: values of job, scenes
    /// and recordings, and the version of the program. Title, seed, budgets and intervals are left out, so
    /// that a fit can be extended.
    #[must_use]
    pub fn fingerprint(&self) -> &str {
        &self.fingerprint
    }

    /// A run of the whole job from the start.
    #[must_use]
    pub fn new_context(&self) -> FitContext<'_> {
        FitContext {
            fingerprint: &self.fingerprint,
            version: env!("CARGO_PKG_VERSION"),
            ..FitContext::default()
        }
    }

    /// Fits the job within its budgets; keeps no journal.
    ///
    /// # Errors
    /// As [`fit_features`].
    pub fn fit(&self) -> Result<FitResult, FitError> {
        self.fit_with(&self.new_context(), &mut NullSink, &mut |_: &FitProgress| ControlFlow::Continue(()))
    }

    /// Fits with at most `evaluations` of the model; keeps no journal.
    ///
    /// # Errors
    /// As [`fit_features`].
    pub fn fit_within(&self, evaluations: usize) -> Result<FitResult, FitError> {
        let context = FitContext { max_evaluations: Some(evaluations), ..self.new_context() };
        self.fit_with(&context, &mut NullSink, &mut |_: &FitProgress| ControlFlow::Continue(()))
    }

    /// Fits the job as the context says (start from [`Self::new_context`]), with a journal, and tells of every
    /// evaluation.
    ///
    /// # Errors
    /// As [`fit_features`].
    pub fn fit_with(
        &self,
        context: &FitContext,
        journal: &mut dyn CheckpointSink,
        on_progress: &mut OnProgress,
    ) -> Result<FitResult, FitError> {
        if !self.traces.is_empty() {
            if context.resume.is_some() {
                let why = "a job with [[trace]] goes on from a journal of iterates: `Problem::fit_traces`";
                return Err(FitError::CannotBeFitted { why: why.to_owned() });
            }
            let mut flow = |now: &TraceProgress| on_progress(&(*now).into());
            return self.fit_traces(None, context.max_evaluations, journal, &mut flow);
        }
        fit_features(&self.job, &self.recordings, &self.model, context, journal, on_progress)
    }
}

/// The scene of condition `at` with its drive and what it sets; both bounds of every free parameter are tried
/// on it.
fn check_scene(
    job: &Job,
    at: usize,
    scene: &Scene,
    measured: Option<&MeasuredRecording>,
) -> Result<Scene, ProblemError> {
    let condition = &job.conditions[at];
    let scene = match (condition.head, measured) {
        (HeadSource::Recording, Some(measured)) => {
            let refused = |problem| ProblemError::Drive {
                condition: condition.name.clone(),
                problem: Box::new(problem),
            };
            scene.drive_by_recording(&measured.recording).map_err(refused)?
        }
        _ => scene.clone(),
    };
    let set = |scene: Scene, (name, value): &(String, f64)| {
        scene.with_parameter(name, *value).map_err(|problem| ProblemError::Set {
            condition: condition.name.clone(),
            name: name.clone(),
            problem: Box::new(problem),
        })
    };
    let scene = condition.set.iter().try_fold(scene, set)?;
    for FreeParameter { name, bounds, .. } in &job.parameters {
        for end in [bounds.lower(), bounds.upper()] {
            scene
                .with_parameter(name, end)
                .map_err(|problem| ProblemError::Bounds { name: name.clone(), problem: Box::new(problem) })?;
        }
    }
    Ok(scene)
}

fn check_frames(
    job: &Job,
    condition: &str,
    scene: &Scene,
    measured: Option<&MeasuredRecording>,
) -> Result<(), ProblemError> {
    let of_recording = measured.map(|measured| measured.recording.grid().frame_rate_hz);
    let own = || job.camera.map_or(0.0, |camera| camera.frame_rate_hz);
    let (frame_rate_hz, length_s) = (of_recording.unwrap_or_else(own), scene.run.stop_s - scene.start_s);
    let found = length_s * frame_rate_hz;
    if (1.0..=MOST_FRAMES).contains(&found) {
        return Ok(());
    }
    Err(ProblemError::Frames { condition: condition.to_owned(), found, length_s, frame_rate_hz })
}

/// Camera and tracking noise of a recording, or the job's own camera without noise.
fn recording_instrument(job: &Job, measured: Option<&MeasuredRecording>) -> Instrument {
    let Some(MeasuredRecording { recording, exposure_s }) = measured else {
        let camera = job.camera.unwrap_or(Camera { frame_rate_hz: 0.0, exposure_s: 0.0 });
        return Instrument { camera, noise_m: 0.0, dropout_fraction: 0.0 };
    };
    let frame_rate_hz = recording.grid().frame_rate_hz;
    let camera = Camera { frame_rate_hz, exposure_s: exposure_s.unwrap_or(0.0) };
    let quality = measure_quality(recording, *exposure_s);
    // a point is lost independently of the other: the deflection misses either
    let dropout_fraction = 0.5 * quality.missing_deflection_frames as f64 / quality.frames.max(1) as f64;
    // the head moves most smoothly, so its noise is estimated best
    Instrument { camera, noise_m: quality.head_x.noise_m.unwrap_or(0.0), dropout_fraction }
}

/// What decides the cost of a point.
#[derive(Serialize)]
struct ProblemIdentity<'a> {
    version: &'static str,
    job: job::JobIdentity<'a>,
    scenes: &'a [Scene],
    recordings: Vec<Option<RecordingIdentity<'a>>>,
}

#[derive(Serialize)]
struct RecordingIdentity<'a> {
    grid: FrameGrid,
    traces: &'a Traces,
    exposure_s: Option<f64>,
    synthetic: bool,
}

impl<'a> From<&'a MeasuredRecording> for RecordingIdentity<'a> {
    fn from(MeasuredRecording { recording, exposure_s }: &'a MeasuredRecording) -> Self {
        let (grid, traces) = (recording.grid(), recording.traces());
        Self { grid, traces, exposure_s: *exposure_s, synthetic: recording.is_synthetic() }
    }
}

// The model of a fit over whole recordings: with the constants as they were fitted, and for a trace driven
// by its own head from the state in which the first segment starts.

impl Problem {
    /// The model whose runs a result is about: that of the problem itself in a fit of features.
    ///
    /// # Errors
    /// [`FitError::CannotBeFitted`] when a scene refuses what was fitted.
    pub fn fitted_model(&self, result: &FitResult) -> Result<SceneModel, FitError> {
        let conditions = self.model().conditions().iter().enumerate();
        let whole = conditions.map(|(at, condition)| {
            let scene = self.whole_scene(at, &condition.scene, result)?;
            Ok(ModelCondition { scene, instrument: condition.instrument })
        });
        Ok(self.model().with_conditions(whole.collect::<Result<_, FitError>>()?))
    }

    /// The scene of condition `at` with the fitted constants, its drive and its start.
    fn whole_scene(&self, at: usize, scene: &Scene, result: &FitResult) -> Result<Scene, FitError> {
        let refused = |why: String| FitError::CannotBeFitted { why };
        let mut constants = result.nuisances.iter().filter(|nuisance| nuisance.recording.is_none());
        let set = |scene: Scene, constant: &NuisanceResult| {
            scene
                .with_parameter(&constant.name, constant.estimate)
                .map_err(|error| refused(error.to_string()))
        };
        let mut scene = constants.try_fold(scene.clone(), set)?;
        let trace = self.traces().iter().find(|trace| trace.condition == at);
        let name = self.job().conditions.get(at).map(|condition| &condition.name);
        let start = result.starts.iter().find(|start| Some(&start.recording) == name);
        let recording = self.recordings().get(at).and_then(Option::as_ref);
        if let (Some(HeadSource::Recording), Some(start), Some(recording)) =
            (trace.map(|trace| trace.head), start, recording)
        {
            let motion = smooth_head_motion(recording).map_err(|error| refused(error.to_string()))?;
            scene.run.stop_s = motion.span_s()[1];
            scene.drive = Drive::Recorded(Arc::new(motion));
            scene.start_s = start.time_s;
            scene.start = StartKind::State(start_pose(start));
        }
        Ok(scene)
    }

    /// What the whole runs of a result's model show of the job's components and features.
    pub(super) fn compare_with_targets(
        &self,
        result: &FitResult,
        targets: Vec<TargetValue>,
    ) -> Result<(ModelledTargets, Vec<FeatureResult>), FitError> {
        let (job, model) = (self.job(), self.fitted_model(result)?);
        let (fitted, held): (Vec<_>, Vec<_>) =
            job.targets.iter().cloned().zip(targets).partition(|(aim, _)| !aim.held_out);
        let (aims, targets): (Vec<FitTarget>, Vec<TargetValue>) = fitted.into_iter().unzip();
        let wanted: Vec<_> = aims.iter().map(|aim| aim.feature.clone()).collect();
        let goals = targets.iter().map(|target| target.value).collect();
        let values = result.parameter_estimates(job);
        let held_out = predict_held_out(held, &model, &values).iter().map(predicted_feature_result).collect();
        if aims.is_empty() {
            return Ok((ModelledTargets { components: Vec::new(), features: Vec::new() }, held_out));
        }
        let seen = ModelFeatures::new(&model, &wanted, goals, job.ensemble.members);
        let objective = Objective::new(job.parameters.iter().map(search_axis).collect(), targets, &seen);
        let best = objective.evaluate_values(values.clone());
        let shown = ModelledTargets::compare(
            &aims,
            objective.targets(),
            &[],
            &best,
            &read_best_model(&seen, &values),
        );
        Ok((shown, held_out))
    }
}

fn start_pose(start: &StartState) -> Pose {
    Pose {
        theta: start.neck_angle_rad,
        phi: start.lip_angle_rad,
        theta_rate: start.neck_rate_rad_per_s,
        phi_rate: start.lip_rate_rad_per_s,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::files::read_recording;

    const JOB: &str = include_str!("../../fits/actual-blade-twin/job.toml");
    const SCENE: &str = include_str!("../../data/scenes/actual-blade.toml");
    const TRACE: &str = include_str!("../../data/actual-blade-twin/trace.csv");

    fn problem(job: &str, scene: &str, exposure_s: Option<f64>) -> Result<Problem, ProblemError> {
        let job = Job::parse("job.toml", job).unwrap();
        let recording = read_recording("twin", "trace.csv", TRACE, None).unwrap();
        let scene = Scene::parse("scene.toml", scene).unwrap();
        Problem::new(job, vec![scene], vec![MeasuredRecording { recording, exposure_s }])
    }

    #[test]
    fn a_comment_does_not_change_the_fingerprint_and_a_number_does() {
        let of = |scene: &str, exposure_s| problem(JOB, scene, exposure_s).unwrap().fingerprint().to_owned();
        let base = of(SCENE, None);
        let commented = format!("# a comment\n{}", SCENE.replacen("stop_s = 1.15", "stop_s=1.150 # s", 1));
        assert_eq!(of(&commented, None), base);
        assert_ne!(of(&SCENE.replacen("stop_s = 1.15", "stop_s = 1.16", 1), None), base);
        assert_ne!(of(SCENE, Some(5e-5)), base);
        let shorter = JOB.replacen("seed = ", "seed = 1", 1);
        assert_eq!(problem(&shorter, SCENE, None).unwrap().fingerprint(), base, "a seed is no part of it");
    }

    #[test]
    fn scenes_and_recordings_are_those_of_the_job() {
        let job = || Job::parse("job.toml", JOB).unwrap();
        let refused = |scenes, measured| Problem::new(job(), scenes, measured).err().unwrap();
        assert_eq!(refused(vec![], vec![]), ProblemError::Scenes { found: 0, expected: 1 });
        let scene = Scene::parse("scene.toml", SCENE).unwrap();
        assert_eq!(refused(vec![scene], vec![]), ProblemError::Recordings { found: 0, expected: 1 });
    }

    /// The job on the recording's trace, with more keys.
    fn traced_job(top: &str, trace: &str) -> String {
        let parameters =
            JOB.split("[[parameter]]").skip(1).map(|p| p.split("\n[").next().unwrap_or_default());
        let parameters: String = parameters.map(|p| format!("[[parameter]]{p}\n")).collect();
        format!(
            "format = 1\ntitle = \"t\"\nscene = \"s\"\nseed = 1\n{top}\n[[recording]]\npath = \"r\"\n{parameters}[[trace]]\n{trace}\n"
        )
    }

    #[test]
    fn a_trace_is_held_against_its_recording() {
        let made = |top: &str, trace: &str| problem(&traced_job(top, trace), SCENE, None);
        let whole = made("", "").unwrap();
        let [trace] = whole.traces() else { panic!() };
        assert_eq!(trace.channels, [job::TraceChannel::TipX, job::TraceChannel::HeadDrop]);
        assert_eq!((trace.head, trace.frames.start), (job::HeadSource::Recording, 0));
        assert_eq!(
            (whole.segment_s(), whole.constants()),
            (&crate::fit::trace_data::DEFAULT_SEGMENT_S[..], &[][..])
        );
        let refused = |trace: &str| made("", trace).err().unwrap().to_string();
        let short = refused("segment_s = [1e-4]");
        assert!(short.starts_with("trace 1, `segment_s`: found 0.0001 s, which is "), "{short}");
        assert!(refused("window = \"9..10\"").starts_with("trace 1, `window`: `twin`: "));
        let lost = refused("window = \"0..0.002\"\nsegment_s = [0.001]");
        assert!(lost.starts_with("trace 1, "), "{lost}");
    }

    #[test]
    fn constants_are_those_that_the_scene_has_and_the_job_leaves() {
        let with = |nuisance: &str| problem(&traced_job(nuisance, ""), SCENE, None);
        let all = with("nuisance = \"3 %\"").unwrap();
        let names: Vec<&str> = all.constants().iter().map(|freed| freed.name.as_str()).collect();
        assert!(names.contains(&"blade.lip_mass_kg") && !names.contains(&"blade.lip_length_m"), "{names:?}");
        assert!(
            !names.iter().any(|name| name.starts_with("friction") || name.starts_with("blade.neck_stiff"))
        );
        let mass = all.constants().iter().find(|freed| freed.name == "blade.lip_mass_kg").unwrap();
        let [low, high] = mass.range();
        assert!(low < mass.value && mass.value < high && ((high / low).ln() - 0.3).abs() < 1e-12);
        let absent = with("nuisance = [{ name = \"contact.restitution\", sd = \"3 %\" }]").err().unwrap();
        assert!(absent.to_string().starts_with("nuisance `contact.restitution`: found "), "{absent}");
    }

    #[test]
    fn all_masses_and_forces_at_once_are_refused() {
        let scene = Scene::parse("scene.toml", SCENE).unwrap();
        let heavy = |name: &str| {
            crate::model::parameters::find_parameter(name)
                .is_some_and(|p| p.unit.starts_with("kg") || p.unit.starts_with('N'))
        };
        let block = |(name, value): (&str, f64)| {
            format!(
                "[[parameter]]\nname = \"{name}\"\nlower = {}\nupper = {}\nscale = \"log\"\n",
                0.9 * value,
                1.1 * value
            )
        };
        let free: Vec<String> =
            scene.written_values().filter(|(name, value)| *value != 0.0 && heavy(name)).map(block).collect();
        let job = |free: &[String]| {
            let head = "format = 1\ntitle = \"t\"\nscene = \"s\"\nseed = 1\n[[recording]]\npath = \"r\"\n";
            format!("{head}{}[[trace]]\n", free.concat())
        };
        let refused = problem(&job(&free), SCENE, None).err().unwrap().to_string();
        assert!(refused.contains("multiplied by one factor"), "{refused}");
        assert!(problem(&job(&free[1..]), SCENE, None).is_ok(), "one that is held gives the size");
        let value = scene.written_values().find(|(name, value)| *value != 0.0 && heavy(name)).unwrap().1;
        let mut held = free.clone();
        held[0] += &format!("prior = {{ mean = {value}, sd_relative = 0.05 }}\n");
        assert!(problem(&job(&held), SCENE, None).is_ok(), "so does a prior");
    }
}
