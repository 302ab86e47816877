//! Determines which recording a folder contains, and which of its files no command may overwrite.

use super::marker::{FolderMarker, OutputCommand, hash_file, read_small_file};
use crate::cli::failure::Outcome;
use crate::recording::files::{DESCRIPTION_FILE, RecordingFile, TRACE_FILE};
use std::path::Path;

/// Name of the summary that `simulate` writes next to its trace; `import` writes no file of this name.
pub(crate) const SIMULATION_SUMMARY: &str = "summary.json";
/// Keys that occur in the summary of a simulation, but not in that of a study.
const KEYS_OF_A_SIMULATION: [&str; 2] = ["stopped_at_s", "rhs_evaluations"];

/// Whether a file is the summary of a simulation.
pub(crate) fn is_simulation_summary(path: &Path) -> bool {
    let summary: Option<serde_json::Value> =
        path.is_file().then(|| serde_json::from_slice(&read_small_file(path).ok()?).ok()).flatten();
    summary.is_some_and(|summary| KEYS_OF_A_SIMULATION.iter().all(|key| summary.get(key).is_some()))
}

/// The recording in a folder.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum FolderRecording {
    Nothing,
    /// Proven to be synthetic.
    Synthetic,
    /// Taken by a camera, or not proven to be synthetic.
    Measured {
        /// Reason why the recording counts as measured.
        why: String,
        /// SHA-256 of the exports of the recording, as far as known.
        exports: Vec<String>,
        /// Names of the files of the recording.
        files: Vec<String>,
    },
}

impl FolderRecording {
    pub(crate) fn detect(folder: &Path, marker: &FolderMarker) -> Outcome<Self> {
        let trace = hash_file(&folder.join(TRACE_FILE))?;
        if folder.join(DESCRIPTION_FILE).exists() {
            return Ok(from_description(folder, marker, trace.as_deref()));
        }
        let Some(trace) = trace else { return Ok(Self::Nothing) };
        let listed = marker.files.get(TRACE_FILE);
        Ok(match listed {
            Some(made) if made.matches_hash(&trace) && made.by != OutputCommand::Import => Self::Synthetic,
            None if is_simulation_summary(&folder.join(SIMULATION_SUMMARY)) => Self::Synthetic,
            Some(made) if made.by != OutputCommand::Import => {
                let why = format!("was changed since `wiperlab {}` wrote it", made.by.command_name());
                Self::new_measured(marker, why, None)
            }
            _ => {
                let why = "has nothing next to it that says where it comes from";
                Self::new_measured(marker, why.to_owned(), None)
            }
        })
    }

    fn new_measured(marker: &FolderMarker, why: String, file: Option<&RecordingFile>) -> Self {
        let source = file.and_then(|file| file.source.as_ref());
        let imported = marker.files.iter().filter(|(_, made)| made.by == OutputCommand::Import);
        let named = source.iter().flat_map(|source| source.file.as_slice());
        let files = imported.map(|(name, _)| name.clone()).chain(named.cloned());
        let own = [TRACE_FILE, DESCRIPTION_FILE].map(str::to_owned);
        Self::Measured {
            why,
            exports: source.map_or_else(Vec::new, |source| source.sha256.as_slice().to_vec()),
            files: files.chain(own).collect(),
        }
    }
}

/// Determines the recording in a folder that has a description; `trace` is the hash of its trace, if it has
/// one.
fn from_description(folder: &Path, marker: &FolderMarker, trace: Option<&str>) -> FolderRecording {
    let bytes = read_small_file(&folder.join(DESCRIPTION_FILE));
    let text = bytes.and_then(|bytes| String::from_utf8(bytes).map_err(|error| error.to_string()));
    let parsed = text.and_then(|text| {
        let text = text.trim_start_matches('\u{feff}');
        RecordingFile::parse(DESCRIPTION_FILE, text).map_err(|error| error.to_string())
    });
    let is_other = |file: &RecordingFile| {
        trace.zip(file.trace_sha256.as_deref()).is_some_and(|(found, said)| found != said)
    };
    let why = match &parsed {
        Err(why) => format!("has a {DESCRIPTION_FILE} that cannot be read ({why})"),
        Ok(file) if !file.synthetic => format!("is measured, as its {DESCRIPTION_FILE} says"),
        Ok(file) if is_other(file) => format!("is not the one that its {DESCRIPTION_FILE} describes"),
        Ok(_) => return FolderRecording::Synthetic,
    };
    FolderRecording::new_measured(marker, why, parsed.ok().as_ref())
}
