//! A job with everything that it names: its scenes, its recordings, its fingerprint.

use crate::failure::Failure;
use crate::files;
use crate::load::{Loaded, load_recording, read_scene};
use std::path::{Path, PathBuf};
use wiperlab::blade::parameters;
use wiperlab::fit::job::{self, Job};
use wiperlab::fit::journal::{self, Ingredients};
use wiperlab::fit::scene_model::{Condition, Instrument, Plausible, SceneModel};
use wiperlab::recording::Recording;
use wiperlab::recording::files::trace_csv;
use wiperlab::recording::quality::quality;
use wiperlab::simulate::scene::{Drive, Scene};
use wiperlab::twin::Camera;

/// A job with everything that it names; scenes and recordings in the order of its conditions.
pub struct Problem {
    pub folder: PathBuf,
    pub job: Job,
    pub scenes: Vec<Scene>,
    pub measured: Vec<Option<Loaded>>,
    pub fingerprint: String,
    pub file: String,
}

impl Problem {
    /// Reads and checks a job, its scenes and its recordings.
    pub fn load(path: &Path) -> Result<Self, Failure> {
        let file = path.display().to_string();
        let text = files::read_text(path)?;
        let job = Job::parse(&file, &text, &parameters::names()).map_err(Failure::input)?;
        let folder = path.parent().map_or_else(PathBuf::new, Path::to_owned);
        let scenes = job
            .conditions
            .iter()
            .map(|condition| scene_of(&file, &folder, condition, &job))
            .collect::<Result<Vec<_>, _>>()?;
        let recording = |condition: &job::Condition| {
            condition.recording.as_ref().map(|path| load_recording(&folder.join(path))).transpose()
        };
        let measured = job.conditions.iter().map(recording).collect::<Result<Vec<_>, _>>()?;
        let fingerprint = fingerprint(&job, &folder, &scenes, &measured)?;
        Ok(Self { folder, job, scenes, measured, fingerprint, file })
    }

    /// The model of the job: each scene through the camera of its recording, or through the job's own.
    pub fn model(&self) -> SceneModel {
        let own = self.job.camera.map_or(Camera { frame_rate_hz: 0.0, exposure_s: 0.0 }, |c| Camera {
            frame_rate_hz: c.frame_rate_hz,
            exposure_s: c.exposure_s,
        });
        let instrument = |loaded: &Option<Loaded>| {
            loaded
                .as_ref()
                .map_or(Instrument { camera: own, noise_m: 0.0, dropout_fraction: 0.0 }, instrument_of)
        };
        let conditions = self
            .scenes
            .iter()
            .zip(&self.measured)
            .map(|(scene, loaded)| Condition { scene: scene.clone(), instrument: instrument(loaded) });
        let plausible =
            Plausible { spread: self.job.ensemble.spread, largest_tilt_rad: self.job.largest_tilt_rad };
        SceneModel::new(conditions.collect(), self.job.parameter_names(), plausible)
    }

    /// The recordings, one for each condition that has one.
    pub fn recordings(&self) -> Vec<Option<Recording>> {
        self.measured.iter().map(|loaded| loaded.as_ref().map(|loaded| loaded.recording.clone())).collect()
    }
}

/// The scene of a condition with what it sets; the bounds of every parameter are tried on it.
fn scene_of(file: &str, folder: &Path, condition: &job::Condition, job: &Job) -> Result<Scene, Failure> {
    let scene = read_scene(&folder.join(&condition.scene))?;
    let refused =
        |what: String, error: &dyn std::fmt::Display| Failure::Input(format!("{file}: {what}: {error}"));
    let set = |scene: Scene, (name, value): &(String, f64)| {
        scene
            .with(name, *value)
            .map_err(|error| refused(format!("`{}`, `set`, `{name}`", condition.name), &error))
    };
    let scene = condition.set.iter().try_fold(scene, set)?;
    for parameter in &job.parameters {
        for end in [parameter.bounds.lower(), parameter.bounds.upper()] {
            scene
                .with(&parameter.name, end)
                .map_err(|error| refused(format!("bounds of `{}`", parameter.name), &error))?;
        }
    }
    Ok(scene)
}

/// How a recording was seen.
fn instrument_of(loaded: &Loaded) -> Instrument {
    let exposure_s = loaded.file.as_ref().and_then(|f| f.camera.exposure_s);
    let camera = Camera {
        frame_rate_hz: loaded.recording.grid().frame_rate_hz,
        exposure_s: exposure_s.unwrap_or(0.0),
    };
    let quality = quality(&loaded.recording, exposure_s);
    // a point is lost independently of the other: the deflection misses either
    let dropout_fraction = 0.5 * quality.missing_deflection_frames as f64 / quality.frames.max(1) as f64;
    // the head moves most smoothly, so its noise is estimated best
    Instrument { camera, noise_m: quality.head_x.noise_m.unwrap_or(0.0), dropout_fraction }
}

/// What decides the outcome, but for seed and budgets: with the same fingerprint a search can be extended.
fn fingerprint(
    job: &Job,
    folder: &Path,
    scenes: &[Scene],
    measured: &[Option<Loaded>],
) -> Result<String, Failure> {
    let texts = job
        .conditions
        .iter()
        .map(|condition| files::read_text(&folder.join(&condition.scene)))
        .collect::<Result<Vec<_>, _>>()?;
    let drives = scenes.iter().filter_map(recorded_drive);
    let data: Vec<String> = measured.iter().flatten().map(fingerprinted).chain(drives).collect();
    let bytes: Vec<&[u8]> = data.iter().map(String::as_bytes).collect();
    Ok(journal::fingerprint(&Ingredients {
        job: &job.problem_text(),
        scene: &texts.concat(),
        data: &bytes,
        version: env!("CARGO_PKG_VERSION"),
    }))
}

/// What of a recording decides a fit: its traces and its camera.
fn fingerprinted(loaded: &Loaded) -> String {
    let camera = loaded.file.as_ref().map(|f| format!("{:?}", f.camera)).unwrap_or_default();
    format!("{camera}\n{}", trace_csv(&loaded.recording))
}

/// The measured motion of the head that drives the scene, where there is one: it decides a fit as the scene's
/// numbers do.
fn recorded_drive(scene: &Scene) -> Option<String> {
    matches!(scene.drive, Drive::Recorded(_)).then(|| format!("{:?}", scene.drive))
}
