//! A job with the scenes and recordings that it names, read from the disk.

use super::load::{LoadedRecording, load_recording, read_driven_scene, read_scene_of_any_start};
use super::prelude::*;
use crate::fit::job::{HeadSource, Job};
use crate::fit::{MeasuredRecording, Problem};
use crate::model::plausibility::PlausibilityFinding;
use std::collections::BTreeMap;

/// Name of the job file in the folder of a fit.
pub(crate) const JOB_FILE: &str = "job.toml";

/// Path of a job file; the user may name the file itself or its folder.
pub(crate) fn job_path(named: &Path) -> PathBuf {
    if named.is_dir() { named.join(JOB_FILE) } else { named.to_owned() }
}

/// A fit problem, with the paths of its files.
pub(crate) struct LoadedJob {
    pub folder: PathBuf,
    /// Path of the job file, and its name in messages.
    pub path: PathBuf,
    pub file: String,
    pub problem: Problem,
    /// The file of the scene of each condition.
    pub scene_files: Vec<PathBuf>,
    /// Implausible values of the scenes, by scene file.
    pub doubts: BTreeMap<PathBuf, Vec<PlausibilityFinding>>,
    /// Paths of the recordings, one for each condition with a recording.
    pub recording_paths: Vec<PathBuf>,
    /// The recordings with their descriptions.
    pub measured: Vec<LoadedRecording>,
    /// For each condition, the recording that drives its scene, if there is one.
    pub drivers: Vec<Option<PathBuf>>,
}

impl LoadedJob {
    /// Reads and checks a job (named by its file or its folder) with its scenes and recordings.
    pub(crate) fn load(named: &Path) -> Outcome<Self> {
        let path = job_path(named);
        if files::is_standard_input(&path) {
            let expected = "a file: journal and result of a fit lie next to its job";
            let problem = format!("found standard input, expected {expected}; save it as job.toml");
            return Err(Failure::at("-", problem));
        }
        let file = path.display().to_string();
        let job = Job::parse(&file, &files::read_toml(&path)?).map_err(Failure::input)?;
        let found = |key: &str, named: &str| {
            files::resolve_existing_path(&path, named)
                .map_err(|problem| Failure::Input(format!("{file}: key `{key}`: {problem}")))
        };
        let scene_files = job.conditions.iter().map(|condition| found("scene", &condition.scene));
        let scene_files = scene_files.collect::<Result<Vec<_>, _>>()?;
        let scenes = scene_files.iter().zip(&job.conditions).map(|(file, condition)| {
            // segments start from recorded states, and a run with a recorded head starts elsewhere
            let own_start = job.traces.is_empty() && condition.head == HeadSource::Scene;
            if own_start { read_driven_scene(file) } else { read_scene_of_any_start(file) }
        });
        let (scenes, drivers): (Vec<_>, Vec<_>) = scenes.collect::<Result<Vec<_>, _>>()?.into_iter().unzip();
        let doubts = scene_files.iter().zip(&scenes);
        let doubts = doubts.map(|(file, scene)| (file.clone(), scene.find_implausible())).collect();
        let measured_at = job.recordings().map(|named| found("recording.path", named));
        let measured_at = measured_at.collect::<Result<Vec<_>, _>>()?;
        let measured = measured_at.iter().map(|path| {
            let loaded = load_recording(path)?;
            Ok(LoadedRecording { recording: loaded.recording.move_to_grid(), ..loaded })
        });
        let measured = measured.collect::<Result<Vec<_>, _>>()?;
        let to_measured = |loaded: &LoadedRecording| MeasuredRecording {
            recording: loaded.recording.clone(),
            exposure_s: loaded.exposure_s(),
        };
        let problem = Problem::new(job, scenes, measured.iter().map(to_measured).collect());
        let problem = problem.map_err(|error| Failure::Input(format!("{file}: {error}")))?;
        let folder = files::containing_folder(&path).to_owned();
        Ok(Self {
            folder,
            path,
            file,
            problem,
            scene_files,
            doubts,
            recording_paths: measured_at,
            measured,
            drivers,
        })
    }

    pub(crate) fn job(&self) -> &Job {
        self.problem.job()
    }

    /// Every recording with its path.
    pub(crate) fn recordings(&self) -> impl Iterator<Item = (&Path, &LoadedRecording)> {
        self.recording_paths.iter().map(PathBuf::as_path).zip(&self.measured)
    }
}
