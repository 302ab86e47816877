//! Provenance of a fit: its files with their hashes, and the commands that reproduce it.

use super::ReportedFit;
use crate::cli::files::RESULT_FILE;
use crate::cli::job::JOB_FILE;
use crate::cli::load::{LoadedRecording, description_path, load_recording};
use crate::cli::prelude::*;
use crate::recording::files::{DESCRIPTION_FILE, TRACE_FILE};
use crate::report::{Provenance, SourceFile};
use crate::text::sha256;
use std::path::Component;

pub(crate) fn collect_provenance(fit: &ReportedFit) -> Outcome<Provenance> {
    let within = format!("fits/{}", fit.name);
    let named = |path: &str| normalise_path(&within, path);
    let job = fit.problem.path.file_name().unwrap_or_default().to_string_lossy();
    let result = fit.problem.folder.join(RESULT_FILE);
    let mut files = vec![
        hash_source_file("job", named(&job), &fit.problem.path, false)?,
        hash_source_file("result", named(RESULT_FILE), &result, fit.result.synthetic)?,
    ];
    for (condition, file) in fit.problem.job().conditions.iter().zip(&fit.problem.scene_files) {
        files.extend(scene_files(named(&condition.scene), file)?);
    }
    for (named, (path, loaded)) in fit.problem.job().recordings().map(named).zip(fit.problem.recordings()) {
        files.extend(recording_files("", &named, path, loaded)?);
    }
    let mut once: Vec<SourceFile> = Vec::new();
    for file in files {
        if !once.contains(&file) {
            once.push(file);
        }
    }
    let file = format!("{within}/{job}");
    let reported = if job == JOB_FILE { &within } else { &file };
    let commands = vec![format!("wiperlab fit {file}"), format!("wiperlab report {reported}")];
    let (version, fingerprint) = (fit.result.version.clone(), fit.result.fingerprint.clone());
    Ok(Provenance { version, seed: Some(fit.result.seed), fingerprint, files: once, commands })
}

fn hash_source_file(kind: &str, name: String, path: &Path, synthetic: bool) -> Outcome<SourceFile> {
    Ok(SourceFile { kind: kind.to_owned(), name, sha256: sha256(&files::read_data(path)?), synthetic })
}

/// A scene and, if a recording drives it, the files of that recording.
fn scene_files(name: String, path: &Path) -> Outcome<Vec<SourceFile>> {
    let text = files::read_toml(path)?;
    let mut found = vec![hash_source_file("scene", name.clone(), path, false)?];
    let written: toml::Table = text.parse().map_err(|error| Failure::at(path.display(), error))?;
    let drive = written.get("drive").and_then(|drive| drive.get("recording")).and_then(toml::Value::as_str);
    if let Some(named) = drive {
        let (at, shown) = (files::resolve_path(path, named), normalise_path(&parent_folder(&name), named));
        found.extend(recording_files("drive ", &shown, &at, &load_recording(&at)?)?);
    }
    Ok(found)
}

/// Trace, description and exports of a recording; the hashes of the exports are those that the import
/// recorded.
fn recording_files(
    role: &str,
    name: &str,
    path: &Path,
    loaded: &LoadedRecording,
) -> Outcome<Vec<SourceFile>> {
    let synthetic = loaded.recording.is_synthetic();
    let (within, trace) = match path.is_dir() {
        true => (name.to_owned(), TRACE_FILE.to_owned()),
        false => (parent_folder(name), files::display_name(path)),
    };
    let placed = |file: &str| normalise_path(&within, file);
    let description = description_path(path);
    let trace_path = files::resolve_path(&description, &trace);
    let mut found = vec![hash_source_file(&format!("{role}trace"), placed(&trace), &trace_path, synthetic)?];
    if loaded.file.is_some() {
        let kind = format!("{role}description");
        found.push(hash_source_file(&kind, placed(DESCRIPTION_FILE), &description, synthetic)?);
    }
    if let Some(source) = loaded.file.as_ref().and_then(|file| file.source.as_ref()) {
        let kind = format!("{role}export");
        let export = |(name, sha256): (&String, &String)| SourceFile {
            kind: kind.clone(),
            name: placed(name),
            sha256: sha256.clone(),
            synthetic,
        };
        found.extend(source.file.as_slice().iter().zip(source.sha256.as_slice()).map(export));
    }
    Ok(found)
}

fn parent_folder(name: &str) -> String {
    name.rsplit_once('/').map_or_else(String::new, |(folder, _)| folder.to_owned())
}

/// The path `path` in the folder `within`, with `.` and `..` resolved. An absolute path, or a path that
/// leaves the project, is returned as written.
fn normalise_path(within: &str, path: &str) -> String {
    let whole = Path::new(within).join(path);
    let mut parts: Vec<String> = Vec::new();
    for part in whole.components() {
        match part {
            Component::Normal(name) => parts.push(name.to_string_lossy().into_owned()),
            Component::CurDir => {}
            Component::ParentDir if parts.pop().is_some() => {}
            _ => return path.to_owned(),
        }
    }
    parts.join("/")
}

#[cfg(test)]
mod tests {
    use super::normalise_path;

    #[test]
    fn paths_are_those_of_the_project() {
        assert_eq!(normalise_path("fits/x", "../../data/scenes/a.toml"), "data/scenes/a.toml");
        assert_eq!(normalise_path("fits/x", "job.toml"), "fits/x/job.toml");
        assert_eq!(normalise_path("fits/x", "../../../elsewhere/a.toml"), "../../../elsewhere/a.toml");
        assert_eq!(normalise_path("fits/x", "/root/a.toml"), "/root/a.toml");
    }
}
