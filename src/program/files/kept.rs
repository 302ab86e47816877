//! Which recording a folder holds, and what of it no command overwrites.

use super::maker::Maker;
use super::marker::{Marker, hash_of, small};
use crate::program::failure::Failure;
use crate::recording::files::{DESCRIPTION_FILE, RecordingFile, TRACE_FILE};
use std::path::Path;

/// What `simulate` writes next to its trace and no import does.
pub const SIMULATION_SUMMARY: &str = "summary.json";
/// Keys that the summary of a simulation has and that of a study has not.
const KEYS_OF_A_SIMULATION: [&str; 2] = ["stopped_at_s", "rhs_evaluations"];

/// Whether there is the summary of a simulation.
pub fn is_simulation_summary(path: &Path) -> bool {
    let summary: Option<serde_json::Value> =
        path.is_file().then(|| serde_json::from_slice(&small(path).ok()?).ok()).flatten();
    summary.is_some_and(|summary| KEYS_OF_A_SIMULATION.iter().all(|key| summary.get(key).is_some()))
}

/// The recording that a folder holds.
#[derive(Debug, PartialEq, Eq)]
pub enum Kept {
    /// None.
    Nothing,
    /// One that is proven to be synthetic.
    Synthetic,
    /// One that a camera took, or of which nothing proves that none did.
    Measured {
        /// Why it counts as measured.
        why: String,
        /// SHA-256 of its exports, as far as known.
        exports: Vec<String>,
        /// Names of its files.
        files: Vec<String>,
    },
}

impl Kept {
    pub fn of(folder: &Path, marker: &Marker) -> Result<Self, Failure> {
        let trace = hash_of(&folder.join(TRACE_FILE))?;
        if folder.join(DESCRIPTION_FILE).exists() {
            return Ok(described(folder, marker, trace.as_deref()));
        }
        let Some(trace) = trace else { return Ok(Self::Nothing) };
        let listed = marker.files.get(TRACE_FILE);
        Ok(match listed {
            Some(made) if made.is(&trace) && made.by != Maker::Import => Self::Synthetic,
            None if is_simulation_summary(&folder.join(SIMULATION_SUMMARY)) => Self::Synthetic,
            Some(made) if made.by != Maker::Import => Self::measured(
                marker,
                format!("was changed since `wiperlab {}` wrote it", made.by.word()),
                None,
            ),
            _ => Self::measured(
                marker,
                "has nothing next to it that says where it comes from".to_owned(),
                None,
            ),
        })
    }

    fn measured(marker: &Marker, why: String, file: Option<&RecordingFile>) -> Self {
        let source = file.and_then(|file| file.source.as_ref());
        let imported = marker.files.iter().filter(|(_, made)| made.by == Maker::Import);
        let named = source.iter().flat_map(|source| source.file.all());
        let files = imported.map(|(name, _)| name.clone()).chain(named.cloned());
        let own = [TRACE_FILE, DESCRIPTION_FILE].map(str::to_owned);
        Self::Measured {
            why,
            exports: source.map_or_else(Vec::new, |source| source.sha256.all().to_vec()),
            files: files.chain(own).collect(),
        }
    }
}

/// Of a folder with a description.
fn described(folder: &Path, marker: &Marker, trace: Option<&str>) -> Kept {
    let path = folder.join(DESCRIPTION_FILE);
    let text = small(&path).and_then(|bytes| String::from_utf8(bytes).map_err(|error| error.to_string()));
    let parsed = text.and_then(|text| {
        RecordingFile::parse(DESCRIPTION_FILE, text.trim_start_matches('\u{feff}'))
            .map_err(|error| error.to_string())
    });
    match parsed {
        Err(why) => {
            Kept::measured(marker, format!("has a {DESCRIPTION_FILE} that cannot be read ({why})"), None)
        }
        Ok(file) if !file.synthetic => {
            Kept::measured(marker, format!("is measured, as its {DESCRIPTION_FILE} says"), Some(&file))
        }
        Ok(file) if trace.zip(file.trace_sha256.as_deref()).is_some_and(|(found, said)| found != said) => {
            Kept::measured(
                marker,
                format!("is not the one that its {DESCRIPTION_FILE} describes"),
                Some(&file),
            )
        }
        Ok(_) => Kept::Synthetic,
    }
}
