//! A job with the scenes and recordings that it names, read from disk.

use crate::fit::job::Job;
use crate::fit::{self, Measured};
use crate::plausibility::Finding;
use crate::program::failure::Failure;
use crate::program::files;
use crate::program::load::{Loaded, load_recording, read_driven_scene};
use crate::toml_file;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A problem with where it lies on disk.
pub struct Problem {
    pub folder: PathBuf,
    pub file: String,
    pub problem: fit::Problem,
    /// The scenes and what is hard to believe in them, each file once.
    pub doubts: BTreeMap<PathBuf, Vec<Finding>>,
    /// The recordings with their descriptions, one for each condition of the job that has one.
    pub measured: Vec<Loaded>,
    /// The recording that drives the scene of a condition, where the scene names one.
    pub drivers: Vec<Option<PathBuf>>,
}

impl Problem {
    /// Reads and checks a job, its scenes and its recordings.
    pub fn load(path: &Path) -> Result<Self, Failure> {
        if files::is_standard_input(path) {
            let expected = "a file: journal and result of a fit lie next to its job";
            return Err(Failure::Input(format!(
                "-: found standard input, expected {expected}; save it as job.toml"
            )));
        }
        let file = path.display().to_string();
        let job = Job::parse(&file, &files::read_toml(path)?).map_err(Failure::input)?;
        let folder = path.parent().map_or_else(PathBuf::new, Path::to_owned);
        let found = |key: &str, named: &str| {
            let path = folder.join(named);
            if path.exists() || files::is_standard_input(&path) {
                return Ok(path);
            }
            Err(Failure::Input(format!(
                "{file}: key `{key}`: found \"{named}\", expected a path from the folder of the job; there is no {}{}",
                path.display(),
                toml_file::path_hint(named)
            )))
        };
        let scenes =
            job.conditions.iter().map(|condition| read_driven_scene(&found("scene", &condition.scene)?));
        let (scenes, drivers): (Vec<_>, Vec<_>) = scenes.collect::<Result<Vec<_>, _>>()?.into_iter().unzip();
        let files = job.conditions.iter().map(|condition| folder.join(&condition.scene));
        let doubts = files.zip(&scenes).map(|(file, scene)| (file, scene.findings())).collect();
        let measured = job.recordings().map(|path| load_recording(&found("recording.path", path)?));
        let measured = measured.collect::<Result<Vec<_>, _>>()?;
        let problem = fit::Problem::new(job, scenes, measured.iter().map(with_exposure).collect());
        let problem = problem.map_err(|error| Failure::Input(format!("{file}: {error}")))?;
        Ok(Self { folder, file, problem, doubts, measured, drivers })
    }

    pub fn job(&self) -> &Job {
        self.problem.job()
    }

    /// Every recording with where it lies.
    pub fn recordings(&self) -> impl Iterator<Item = (PathBuf, &Loaded)> {
        self.job().recordings().map(|path| self.folder.join(path)).zip(&self.measured)
    }
}

fn with_exposure(loaded: &Loaded) -> Measured {
    let exposure_s = loaded.file.as_ref().and_then(|file| file.camera.exposure_s);
    Measured { recording: loaded.recording.clone(), exposure_s }
}
