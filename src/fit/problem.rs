//! A job with its scenes and recordings: the complete input of a fit.

use super::context::FitContext;
use super::job::{FreeParameter, HeadSource, Job};
use super::journal::{FitProgress, OnProgress};
use super::nuisance_parameters::{FreedConstant, NuisanceError, check_scaling, free_constants};
use super::result::FitResult;
use super::run::fit_features;
use super::scene_model::{Instrument, ModelCondition, PlausibilityLimits, SceneModel};
use super::trace::{TraceModel, TraceSource};
use super::trace_data::{TraceData, TraceError, prepare_traces};
use super::{FitError, job};
use crate::checkpoint::{CheckpointSink, NullSink, fingerprint};
use crate::model::parameters::name_in_scene;
use crate::recording::quality::{
    Check, Optics, UntrackedFrames, drop_untracked, find_untracked_frames, measure_quality,
};
use crate::recording::{FrameGrid, Recording, Traces};
use crate::simulate::drive::HeadMotionError;
use crate::simulate::scene::error::SceneError;
use crate::simulate::scene::{Scene, StartKind};
use crate::simulate::twin::Camera;
use serde::Serialize;
use std::ops::ControlFlow;

/// Maximum number of frames of a model run. The limit keeps a mistyped frame rate from filling the memory:
/// each thread stores one run, and a million frames take 0.1 GB.
const MOST_FRAMES: f64 = 1e6;

/// A recording with its exposure time, which the recording itself does not contain.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredRecording {
    /// The recording.
    pub recording: Recording,
    /// Exposure time, s; `None` if unknown, which is treated as zero.
    pub exposure_s: Option<f64>,
}

impl From<Recording> for MeasuredRecording {
    fn from(recording: Recording) -> Self {
        Self { recording, exposure_s: None }
    }
}

/// A job that does not match its scenes and recordings.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ProblemError {
    /// The number of scenes differs from the number of conditions of the job.
    #[error("found {found} scenes, expected {expected}, one for each recording and condition of the job")]
    Scenes {
        /// Number of scenes given.
        found: usize,
        /// Number of conditions of the job.
        expected: usize,
    },
    /// The number of recordings differs from the number that the job names.
    #[error("found {found} recordings, expected the {expected} of the job")]
    Recordings {
        /// Number of recordings given.
        found: usize,
        /// Number of recordings of the job.
        expected: usize,
    },
    /// A scene refuses its drive, a value or a bound, or its run has too few or too many frames.
    #[error("{place}: {problem}")]
    Scene {
        /// Name of the condition, or of the parameter and bound.
        place: String,
        /// Value found, value expected, and advice.
        problem: String,
    },
    /// A trace cannot be fitted to its recording.
    #[error(transparent)]
    Trace(#[from] TraceError),
    /// Constants or parameters cannot be freed as the job requires.
    #[error(transparent)]
    Constants(#[from] NuisanceError),
}

/// A checked job with its scenes and recordings, ready to be fitted.
#[derive(Clone)]
pub struct Problem {
    pub(super) job: Job,
    pub(super) model: SceneModel,
    pub(super) recordings: Vec<Option<Recording>>,
    pub(super) traces: Vec<TraceData>,
    pub(super) segment_s: Vec<f64>,
    pub(super) constants: Vec<FreedConstant>,
    fingerprint: String,
    /// Positions that are left out of recordings because the tracker jumped away: condition, and description.
    left_out: Vec<(usize, String)>,
}

/// A recording without the positions to which the tracker jumped for a few frames. A single one of them makes
/// its segment fit worse than noise ever does.
fn leave_out_outliers(recording: Recording, exposure_s: Option<f64>) -> (Recording, Vec<UntrackedFrames>) {
    let measured = measure_quality(&recording, exposure_s);
    let mut found = find_untracked_frames(&recording, &measured, &Optics::default());
    found.retain(|found| found.check == Check::Outliers);
    let traces = drop_untracked(recording.traces().clone(), &found);
    match recording.clone().with_traces(traces) {
        Ok(rest) if !found.is_empty() => (rest, found),
        _ => (recording, vec![]),
    }
}

impl Problem {
    /// Combines a job with its scenes and its recordings: one scene per condition ([`Job::conditions`]), and
    /// one recording per condition that has one, both in the order of the job.
    ///
    /// The values that a condition sets replace those of its scene. Every scene must accept both bounds of
    /// every free parameter.
    ///
    /// # Errors
    /// [`ProblemError`] for the first mismatch.
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
        let paths = job.conditions.iter().map(|condition| condition.recording.as_ref());
        let mut measured: Vec<Option<MeasuredRecording>> =
            paths.map(|path| path.and_then(|_| measured.next())).collect();
        let mut left_out = Vec::new();
        for (number, one) in measured.iter_mut().enumerate() {
            let Some(MeasuredRecording { recording, exposure_s }) = one.take() else { continue };
            let is_traced = job.traces.iter().any(|trace| trace.condition == number);
            let (recording, outliers) =
                if is_traced { leave_out_outliers(recording, exposure_s) } else { (recording, vec![]) };
            left_out.extend(outliers.iter().map(|found| (number, found.describe())));
            *one = Some(MeasuredRecording { recording: recording.move_to_grid(), exposure_s });
        }
        let check = |at: usize| check_scene(&job, at, &scenes[at], measured[at].as_ref());
        let scenes: Vec<Scene> = (0..scenes.len()).map(check).collect::<Result<_, _>>()?;
        for ((scene, measured), condition) in scenes.iter().zip(&measured).zip(&job.conditions) {
            check_frames(&job, &condition.name, scene, measured.as_ref())?;
        }
        let constants = free_constants(&job, &scenes)?;
        check_scaling(&job, &scenes)?;
        let identities = measured.iter().map(|measured| {
            let MeasuredRecording { recording, exposure_s } = measured.as_ref()?;
            let (grid, traces) = (recording.grid(), recording.traces());
            let (synthetic, frame_rate_sd_hz) = (recording.is_synthetic(), recording.frame_rate_sd_hz());
            Some(RecordingIdentity { grid, traces, exposure_s: *exposure_s, synthetic, frame_rate_sd_hz })
        });
        let fingerprint = fingerprint(&ProblemIdentity {
            version: env!("CARGO_PKG_VERSION"),
            job: job.identity(),
            scenes: &scenes,
            recordings: identities.collect(),
        });
        let recordings: Vec<Option<Recording>> =
            measured.iter().map(|measured| Some(measured.as_ref()?.recording.clone())).collect();
        let (traces, segment_s) = prepare_traces(&job, &scenes, &recordings)?;
        let conditions = scenes.into_iter().zip(&measured).map(|(scene, measured)| ModelCondition {
            scene,
            instrument: recording_instrument(&job, measured.as_ref()),
        });
        let (spread, largest_tilt_rad) = (job.ensemble.spread, job.largest_tilt_rad);
        let plausible = PlausibilityLimits { spread, largest_tilt_rad };
        let model = SceneModel::new(conditions.collect(), job.parameter_names(), plausible);
        Ok(Self { job, model, recordings, traces, segment_s, constants, fingerprint, left_out })
    }

    /// The job.
    #[must_use]
    pub fn job(&self) -> &Job {
        &self.job
    }

    /// The model: each scene with the camera of its recording, or with the camera of the job.
    pub(crate) fn model(&self) -> &SceneModel {
        &self.model
    }

    /// The recording of each condition; `None` for a condition without a recording.
    pub(crate) fn recordings(&self) -> &[Option<Recording>] {
        &self.recordings
    }

    /// The fitted traces; empty in a job on features.
    pub(crate) fn traces(&self) -> &[TraceData] {
        &self.traces
    }

    /// Segment length of each stage of a trace fit, s, in ascending order.
    #[must_use]
    pub fn segment_s(&self) -> &[f64] {
        &self.segment_s
    }

    /// Constants of the scenes that are freed within priors.
    pub(crate) fn constants(&self) -> &[FreedConstant] {
        &self.constants
    }

    /// One sentence for each column whose positions are left out in some frames.
    pub(crate) fn describe_left_out(&self) -> impl Iterator<Item = String> {
        self.left_out.iter().map(|(condition, frames)| {
            let name = &self.job.conditions[*condition].name;
            format!("{name}: {frames} are left out, because the tracker jumped away and came back")
        })
    }

    /// The model of the fitted traces; `None` in a job on features.
    ///
    /// # Errors
    /// [`HeadMotionError`] if the head that drives a model is not tracked.
    pub fn trace_model(&self) -> Option<Result<TraceModel, HeadMotionError>> {
        if self.traces.is_empty() {
            return None;
        }
        let sources = self.traces.iter().filter_map(|traced| {
            let ModelCondition { scene, instrument } = &self.model.conditions()[traced.condition];
            let recording = self.recordings[traced.condition].as_ref()?;
            Some(TraceSource { scene, recording, exposure_s: instrument.camera.exposure_s, traced })
        });
        let sources: Vec<TraceSource<'_>> = sources.collect();
        Some(TraceModel::new(&sources, &self.job.parameters, &self.constants))
    }

    /// SHA-256 of everything on which the cost of a point depends, from `fingerprint`: the values of job,
    /// scenes and recordings, and the version of the program. Title, seed, budgets and intervals are
    /// excluded, so that a fit can continue with a larger budget.
    #[must_use]
    pub fn fingerprint(&self) -> &str {
        &self.fingerprint
    }

    /// The context of a new fit within the budgets of the job.
    #[must_use]
    pub fn new_context(&self) -> FitContext<'_> {
        let version = env!("CARGO_PKG_VERSION");
        FitContext { fingerprint: &self.fingerprint, version, ..FitContext::default() }
    }

    /// Fits the job within its budgets, without a journal.
    ///
    /// # Errors
    /// The errors of [`fit_features`].
    pub fn fit(&self) -> Result<FitResult, FitError> {
        self.fit_with(&self.new_context(), &mut NullSink, &mut |_: &FitProgress| ControlFlow::Continue(()))
    }

    /// Fits the job with at most `evaluations` evaluations of the model, without a journal.
    ///
    /// # Errors
    /// The errors of [`fit_features`].
    pub fn fit_within(&self, evaluations: usize) -> Result<FitResult, FitError> {
        let context = FitContext { max_evaluations: Some(evaluations), ..self.new_context() };
        self.fit_with(&context, &mut NullSink, &mut |_: &FitProgress| ControlFlow::Continue(()))
    }

    /// Fits the job in a context (see [`Self::new_context`]), with a journal and a progress callback.
    ///
    /// # Errors
    /// The errors of [`fit_features`].
    pub fn fit_with(
        &self,
        context: &FitContext,
        sink: &mut dyn CheckpointSink,
        on_progress: &mut OnProgress,
    ) -> Result<FitResult, FitError> {
        if !self.traces.is_empty() {
            return self.fit_traces(context, sink, on_progress);
        }
        fit_features(&self.job, &self.recordings, &self.model, context, sink, on_progress)
    }
}

/// The scene of condition `at`, with the drive and the parameter values of this condition. Refuses a scene
/// that does not accept both bounds of every free parameter.
fn check_scene(
    job: &Job,
    at: usize,
    scene: &Scene,
    measured: Option<&MeasuredRecording>,
) -> Result<Scene, ProblemError> {
    let condition = &job.conditions[at];
    let refused =
        |place: String| |problem: SceneError| ProblemError::Scene { place, problem: problem.to_string() };
    // a fit to traces needs no steady start: segments start from recorded states
    let any_start = !job.traces.is_empty();
    let mut scene = scene.clone();
    if let (HeadSource::Recording, Some(measured)) = (condition.head, measured) {
        let driven = scene.drive_by_recording(&measured.recording).or_else(|error| {
            let mut upright = scene.clone();
            upright.start = StartKind::Upright;
            if any_start { upright.drive_by_recording(&measured.recording) } else { Err(error) }
        });
        scene = driven.map_err(refused(format!("`{}`, `drive`", condition.name)))?;
    } else if any_start {
        scene = scene.with_possible_start();
    }
    for (name, value) in &condition.set {
        let set = scene.with_parameter(name, *value);
        scene = set.map_err(refused(format!("`{}`, `set`, `{name}`", condition.name)))?;
    }
    for FreeParameter { name, bounds, .. } in &job.parameters {
        for end in [bounds.lower(), bounds.upper()] {
            scene.with_parameter(name_in_scene(name), end).map_err(refused(format!("bounds of `{name}`")))?;
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
    let problem = format!(
        "found {found:.3e} frames in the {length_s} s of its scene's run at {frame_rate_hz} frames/s, expected 1 to {MOST_FRAMES:e}; correct the rate of the camera, or run.stop_s of the scene"
    );
    Err(ProblemError::Scene { place: format!("`{condition}`"), problem })
}

/// Camera and tracking noise of a recording; without a recording, the camera of the job without noise.
fn recording_instrument(job: &Job, measured: Option<&MeasuredRecording>) -> Instrument {
    let Some(MeasuredRecording { recording, exposure_s }) = measured else {
        let camera = job.camera.unwrap_or(Camera { frame_rate_hz: 0.0, exposure_s: 0.0 });
        return Instrument { camera, noise_m: 0.0, dropout_fraction: 0.0 };
    };
    let frame_rate_hz = recording.grid().frame_rate_hz;
    let camera = Camera { frame_rate_hz, exposure_s: exposure_s.unwrap_or(0.0) };
    let quality = measure_quality(recording, *exposure_s);
    // the deflection is missing if tip or head is lost, and the two points are lost independently
    let dropout_fraction = 0.5 * quality.missing_deflection_frames as f64 / quality.frames.max(1) as f64;
    // the noise of the head is used for both points: the head moves most smoothly, so its noise is measured
    // best
    Instrument { camera, noise_m: quality.head_x.noise_m.unwrap_or(0.0), dropout_fraction }
}

/// Everything on which the cost of a point depends.
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
    #[serde(skip_serializing_if = "Option::is_none")]
    frame_rate_sd_hz: Option<f64>,
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

    /// A job that fits the trace of its recording. The text `top` is added before the first table, and the
    /// text `trace` is added to the table `[[trace]]`.
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
        assert_eq!(whole.segment_s(), [0.004, 0.008, 0.016]);
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
        assert!(with("nuisance = \"exact\"").unwrap().constants().is_empty());
        let usual = with("").unwrap();
        let prior =
            |name: &str| usual.constants().iter().find(|freed| freed.name == name).unwrap().sd_relative;
        assert_eq!(
            ["blade.lip_mass_kg", "blade.lip_length_m", "blade.lip_centre_m"].map(prior),
            [0.05, 0.02, 0.1]
        );
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
