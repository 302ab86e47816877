//! Reads scenes and recordings from the disk. A recording is a folder with `trace.csv` and `recording.toml`,
//! or a single `trace.csv`.

use super::files::{FolderMarker, SIMULATION_SUMMARY, is_simulation_summary};
use super::prelude::*;
use crate::model::plausibility::PlausibilityFinding;
use crate::recording::Recording;
use crate::recording::files::{DESCRIPTION_FILE, RecordingFile, TRACE_FILE, read_recording};
use crate::recording::quality::{Check, QualityFinding, Severity};
use crate::simulate::scene::Scene;
use crate::simulate::scene::error::SceneError;
use crate::text::{sha256, text_sha256};

/// Reads a scene that the user named, with the recording that drives it, if there is one.
pub(crate) fn read_scene(path: &Path) -> Outcome<Scene> {
    Ok(read_driven_scene(path)?.0)
}

/// Like [`read_scene`], but also returns the path of the recording that drives the scene, if there is one.
pub(crate) fn read_driven_scene(path: &Path) -> Outcome<(Scene, Option<PathBuf>)> {
    read_scene_with(path, |file, text, recording| Scene::parse_with_recording(file, text, recording))
}

/// Like [`read_driven_scene`], for a scene whose own start is not used.
pub(crate) fn read_scene_of_any_start(path: &Path) -> Outcome<(Scene, Option<PathBuf>)> {
    read_scene_with(path, |file, text, recording| Scene::parse_any_start(file, text, recording))
}

/// Loads the recording with a given path, or says why it cannot be loaded.
type LoadNamed<'a> = &'a mut dyn FnMut(&str) -> Result<Recording, String>;

fn read_scene_with(
    path: &Path,
    parse: impl FnOnce(&str, &str, LoadNamed<'_>) -> Result<Scene, SceneError>,
) -> Outcome<(Scene, Option<PathBuf>)> {
    let mut driver = None;
    let mut recording = |named: &str| {
        let place = files::resolve_existing_path(path, named)?;
        let loaded = load_recording(&place).map_err(|failure| failure.to_string())?;
        if let Some(said) = loaded.recording.describe_resampling() {
            warn_line!("warning: {}: {said}", place.display());
        }
        driver = Some(place);
        Ok(loaded.recording)
    };
    let scene = parse(&path.display().to_string(), &files::read_toml(path)?, &mut recording);
    scene.map(|scene| (scene, driver)).map_err(Failure::input)
}

/// Prints implausible values of a file as warnings.
pub(crate) fn print_warnings(file: &Path, findings: &[PlausibilityFinding], global: &GlobalArgs) {
    for finding in findings.iter().filter(|_| !global.quiet) {
        warn_line!("warning: {}: {finding}", file.display());
    }
}

/// Reads the scene that another file names with its key `scene`.
pub(crate) fn read_named_scene(file: &Path, named: &str) -> Outcome<Scene> {
    let refused = |problem| Failure::at(file.display(), format!("key `scene`: {problem}"));
    read_scene(&files::resolve_existing_path(file, named).map_err(refused)?)
}

/// A recording with its description, if it has one.
#[derive(Debug)]
pub(crate) struct LoadedRecording {
    pub recording: Recording,
    pub file: Option<RecordingFile>,
}

impl LoadedRecording {
    /// Exposure of a frame according to the description, s.
    pub(crate) fn exposure_s(&self) -> Option<f64> {
        self.file.as_ref().and_then(|file| file.camera.exposure_s)
    }
    /// A finding if source files of the recording at `path` have changed since the import.
    pub(crate) fn changed_sources(&self, path: &Path) -> Option<QualityFinding> {
        let source = self.file.as_ref()?.source.as_ref()?;
        let description = description_path(path);
        let changed = source.file.as_slice().iter().zip(source.sha256.as_slice()).filter(|(name, hash)| {
            let copy = files::resolve_path(&description, name);
            copy.is_file() && files::read_data(&copy).is_ok_and(|bytes| sha256(&bytes) != **hash)
        });
        let names: Vec<&str> = changed.map(|(name, _)| name.as_str()).collect();
        let words = match names.len() {
            0 => return None,
            1 => format!("{} is not the file that was imported (its SHA-256 differs)", names[0]),
            _ => format!("{} are not the files that were imported (their SHA-256 differ)", names.join(", ")),
        };
        let (check, severity, count) = (Check::SourceChanged, Severity::Caution, names.len() as f64);
        let finding = QualityFinding::new(check, severity, count, "files", words);
        Some(finding.with_advice("import it into a new folder"))
    }
}

/// Reads the recording at `path`, which is a folder or a single trace. In either case, the description next
/// to the trace is read too.
pub(crate) fn load_recording(path: &Path) -> Outcome<LoadedRecording> {
    let trace = trace_path(path)?;
    let text = files::read_text(&trace)?;
    let description = description_path(path);
    let mut file = None;
    if description.is_file() && !files::is_standard_input(path) {
        let (shown, text) = (description.display().to_string(), files::read_toml(&description)?);
        file = Some(RecordingFile::parse(&shown, &text).map_err(Failure::input)?);
    }
    let (name, shown) = (if path.is_dir() { path } else { &trace }, trace.display().to_string());
    let recording = read_recording(&files::display_name(name), &shown, &text, file.as_ref());
    let mut recording = recording.map_err(Failure::input)?;
    if file.is_none() && is_simulated(&trace, &text)? {
        recording = recording.mark_synthetic();
    }
    Ok(LoadedRecording { recording, file })
}

/// Whether a command other than `import` made the trace. The marker of the folder tells; if the marker does
/// not list the trace, the summary of a simulation next to it tells.
fn is_simulated(trace: &Path, text: &str) -> Outcome<bool> {
    let folder = files::containing_folder(trace);
    let (marker, _) = FolderMarker::load(folder)?;
    let name = trace.file_name().unwrap_or_default().to_string_lossy();
    let Some(made) = marker.files.get(name.as_ref()) else {
        return Ok(name == TRACE_FILE && is_simulation_summary(&folder.join(SIMULATION_SUMMARY)));
    };
    if made.by == OutputCommand::Import || made.matches_hash(&text_sha256(text)) {
        return Ok(made.by != OutputCommand::Import);
    }
    Err(Failure::at(
        trace.display(),
        format!(
            "found a trace that was changed or replaced since `wiperlab {by}` wrote it, so that nothing says whether a camera took it; expected what {by} wrote: run it again into another folder or, where the change is intended, copy the trace alone into a folder of its own",
            by = made.by.command_name()
        ),
    ))
}

/// Path of the description of the recording at `path`, whether or not it exists.
pub(crate) fn description_path(path: &Path) -> PathBuf {
    let folder = if path.is_dir() { path } else { files::containing_folder(path) };
    folder.join(DESCRIPTION_FILE)
}

/// Path of the trace of the recording at `path`.
fn trace_path(path: &Path) -> Outcome<PathBuf> {
    if !path.is_dir() {
        return Ok(path.to_owned());
    }
    let trace = path.join(TRACE_FILE);
    if !trace.is_file() {
        let advice = "expected the folder of a recording, with `trace.csv` in it; make one with `wiperlab import`, or name a trace.csv";
        return Err(Failure::at(path.display(), format!("found no {TRACE_FILE}, {advice}")));
    }
    Ok(trace)
}

/// Whether a TOML file is a study: it has the key `axis` or `map`, which no job has.
pub(crate) fn is_study(file: &Path) -> Outcome<bool> {
    let table: Option<toml::Table> = files::read_toml(file)?.parse().ok();
    Ok(table.is_some_and(|table| ["axis", "map"].iter().any(|key| table.contains_key(*key))))
}
