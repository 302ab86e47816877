//! Functions for other programs that read files with the same checks and messages as the command line.

pub use super::failure::Failure;
use super::load::{load_recording, read_driven_scene};
use super::spectrum::SpectrumArgs;
use crate::fit::Problem;
use crate::recording::Recording;
use crate::recording::files::RecordingFile;
use crate::simulate::scene::Scene;
use std::path::{Path, PathBuf};

/// Reads a scene; also returns the path of the recording that drives it, if there is one.
///
/// # Errors
/// [`Failure::Input`] with file, key, what was found, what was expected and what to do.
pub fn read_scene(path: &Path) -> Result<(Scene, Option<PathBuf>), Failure> {
    read_driven_scene(path)
}

/// Reads a recording, a folder with `trace.csv` or a single trace; also returns its description, if it has
/// one.
///
/// # Errors
/// As [`read_scene`].
pub fn read_recording(path: &Path) -> Result<(Recording, Option<RecordingFile>), Failure> {
    let loaded = load_recording(path)?;
    Ok((loaded.recording, loaded.file))
}

/// Reads a job with its scenes and recordings.
///
/// # Errors
/// As [`read_scene`].
pub fn read_problem(path: &Path) -> Result<Problem, Failure> {
    Ok(super::job::LoadedJob::load(path)?.problem)
}

/// Resolves a path that is written in a file and is relative to the folder of that file.
///
/// # Errors
/// A message if nothing exists there.
pub fn resolve_existing_path(file: &Path, named: &str) -> Result<PathBuf, String> {
    super::files::resolve_existing_path(file, named)
}

/// Reads a TOML file as text.
///
/// # Errors
/// As [`read_scene`].
pub fn read_toml_text(path: &Path) -> Result<String, Failure> {
    super::files::read_toml(path)
}

/// Options of `wiperlab spectrum`.
#[derive(Debug, Clone, PartialEq)]
pub struct SpectrumOptions {
    /// Channel, such as `head-drop`.
    pub channel: String,
    /// Window, such as `after`.
    pub window: String,
    /// Trend to be removed first; `auto` chooses it from the record.
    pub detrend: String,
    /// Frequency band that is searched for components, Hz; `None` for all frequencies.
    pub band_hz: Option<(f64, f64)>,
    /// Maximum number of listed components; `None` for the default.
    pub max_components: Option<usize>,
    /// Exposure of a frame, s.
    pub exposure_s: Option<f64>,
}

/// The files that `wiperlab spectrum` writes, by name. `file` is the description of the recording, if it has
/// one.
///
/// # Errors
/// [`Failure::Input`] with file or option, what was found, what was expected and what to do.
pub fn spectrum_files(
    recording: Recording,
    file: Option<&RecordingFile>,
    of: &SpectrumOptions,
) -> Result<Vec<(String, Vec<u8>)>, Failure> {
    let mut args =
        SpectrumArgs::new(Path::new(""), &of.channel, &of.window, Path::new(""), Default::default());
    args.detrend.clone_from(&of.detrend);
    args.band = of.band_hz.map(|(low, high)| format!("{low}..{high}"));
    args.max_components = of.max_components.unwrap_or(args.max_components);
    args.exposure_s = of.exposure_s;
    args.output_files(recording, file)
}
