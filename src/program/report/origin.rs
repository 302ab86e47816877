//! Where the numbers of a fit come from: its files with their hashes, and the commands that make it again.

use super::Fit;
use crate::program::failure::Failure;
use crate::program::files;
use crate::program::files::RESULT;
use crate::program::load::{Loaded, description_of, load_recording};
use crate::program::problem::JOB;
use crate::recording::files::{DESCRIPTION_FILE, TRACE_FILE};
use crate::report::{Provenance, SourceFile};
use crate::text::sha256;
use std::path::{Component, Path};

pub fn provenance(fit: &Fit) -> Result<Provenance, Failure> {
    let within = format!("fits/{}", fit.name);
    let named = |path: &str| tidy(&within, path);
    let job = fit.problem.path.file_name().unwrap_or_default().to_string_lossy();
    let mut files = vec![
        hashed("job", named(&job), &fit.problem.path, false)?,
        hashed("result", named(RESULT), &fit.problem.folder.join(RESULT), fit.result.synthetic)?,
    ];
    for (condition, file) in fit.problem.job().conditions.iter().zip(&fit.problem.scene_files) {
        files.extend(scene(named(&condition.scene), file)?);
    }
    for (named, (path, loaded)) in fit.problem.job().recordings().map(named).zip(fit.problem.recordings()) {
        files.extend(recording("", &named, path, loaded)?);
    }
    let mut once: Vec<SourceFile> = Vec::new();
    for file in files {
        if !once.contains(&file) {
            once.push(file);
        }
    }
    let file = format!("{within}/{job}");
    let reported = if job == JOB { &within } else { &file };
    let commands = vec![format!("wiperlab fit {file}"), format!("wiperlab report {reported}")];
    let (version, seed, fingerprint) =
        (fit.result.version.clone(), Some(fit.result.seed), fit.result.fingerprint.clone());
    Ok(Provenance { version, seed, fingerprint, files: once, commands })
}

fn hashed(kind: &str, name: String, path: &Path, synthetic: bool) -> Result<SourceFile, Failure> {
    Ok(SourceFile { kind: kind.to_owned(), name, sha256: sha256(&files::read(path)?), synthetic })
}

/// A scene, and the recording that drives it where one does.
fn scene(name: String, path: &Path) -> Result<Vec<SourceFile>, Failure> {
    let text = files::read_toml(path)?;
    let mut found = vec![hashed("scene", name.clone(), path, false)?];
    let written: toml::Table =
        text.parse().map_err(|error| Failure::Input(format!("{}: {error}", path.display())))?;
    let drive = written.get("drive").and_then(|drive| drive.get("recording")).and_then(toml::Value::as_str);
    if let Some(named) = drive {
        let (at, shown) = (files::path_in(path, named), tidy(&parent(&name), named));
        found.extend(recording("drive ", &shown, &at, &load_recording(&at)?)?);
    }
    Ok(found)
}

/// Trace, description and exports of a recording; the hashes of exports are those of its import.
fn recording(role: &str, name: &str, path: &Path, loaded: &Loaded) -> Result<Vec<SourceFile>, Failure> {
    let synthetic = loaded.recording.is_synthetic();
    let (within, trace) = match path.is_dir() {
        true => (name.to_owned(), TRACE_FILE.to_owned()),
        false => (parent(name), files::display_name(path)),
    };
    let placed = |file: &str| tidy(&within, file);
    let description = description_of(path);
    let trace_path = files::path_in(&description, &trace);
    let mut found = vec![hashed(&format!("{role}trace"), placed(&trace), &trace_path, synthetic)?];
    if loaded.file.is_some() {
        let kind = format!("{role}description");
        found.push(hashed(&kind, placed(DESCRIPTION_FILE), &description, synthetic)?);
    }
    let exports = loaded.file.iter().filter_map(|file| file.source.as_ref());
    let export = |(name, sha256): (&String, &String)| SourceFile {
        kind: format!("{role}export"),
        name: placed(name),
        sha256: sha256.clone(),
        synthetic,
    };
    found.extend(exports.flat_map(|source| {
        source.file.all().iter().zip(source.sha256.all()).map(export).collect::<Vec<_>>()
    }));
    Ok(found)
}

fn parent(name: &str) -> String {
    name.rsplit_once('/').map_or_else(String::new, |(folder, _)| folder.to_owned())
}

/// A path relative to where the folder `within` lies, without its detours; one that leads further up, or
/// starts at the root, as written.
fn tidy(within: &str, path: &str) -> String {
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
    use super::tidy;

    #[test]
    fn paths_are_those_of_the_project() {
        assert_eq!(tidy("fits/x", "../../data/scenes/a.toml"), "data/scenes/a.toml");
        assert_eq!(tidy("fits/x", "job.toml"), "fits/x/job.toml");
        assert_eq!(tidy("fits/x", "../../../elsewhere/a.toml"), "../../../elsewhere/a.toml");
        assert_eq!(tidy("fits/x", "/root/a.toml"), "/root/a.toml");
    }
}
