//! The files of an import as bytes: exports, the companions that belong to them, and the copies that the
//! recording keeps.

use crate::import::error::ImportError;
use crate::recording::files::{DESCRIPTION_FILE, TRACE_FILE};
use crate::text::sha256;

/// A file to import.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ImportSource {
    /// Path or name as given by the user; its last part names the copy in the recording.
    pub name: String,
    /// Its bytes.
    pub bytes: Vec<u8>,
    /// Its companion files: see [`companion_names`](crate::import::companion_names).
    pub companions: Vec<CompanionFile>,
}

/// A file in the folder of an export that belongs to it, such as a camera's record.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CompanionFile {
    /// Its path or name.
    pub name: String,
    /// Its bytes.
    pub bytes: Vec<u8>,
}

impl ImportSource {
    /// A file without companions.
    #[must_use]
    pub fn without_companions(name: impl Into<String>, bytes: Vec<u8>) -> Self {
        Self { name: name.into(), bytes, companions: vec![] }
    }
}

/// Every copy in the recording's folder needs a name of its own.
pub(crate) fn check_file_names(sources: &[ImportSource]) -> Result<(), ImportError> {
    if sources.is_empty() {
        return Err(ImportError::NoSource);
    }
    let mut taken = vec![TRACE_FILE, DESCRIPTION_FILE];
    for source in sources {
        let name = base_name(&source.name);
        if name.is_empty() || taken.iter().any(|other| other.eq_ignore_ascii_case(name)) {
            return Err(ImportError::Name { file: source.name.clone(), name: name.to_owned() });
        }
        taken.push(name);
    }
    Ok(())
}

/// Last part of a path, whichever way its slashes lean.
pub(crate) fn base_name(path: &str) -> &str {
    path.rsplit(['/', '\\']).next().unwrap_or(path)
}

/// Names and bytes of the files that are kept with the recording, in the order of `[source]`; a companion of
/// several is kept once.
#[must_use]
pub fn preserved_files(sources: &[ImportSource]) -> Vec<(&str, &[u8])> {
    let mut kept: Vec<(&str, &[u8])> =
        sources.iter().map(|source| (base_name(&source.name), source.bytes.as_slice())).collect();
    for file in sources.iter().flat_map(|source| &source.companions) {
        let name = base_name(&file.name);
        if !kept.iter().any(|(known, _)| known.eq_ignore_ascii_case(name)) {
            kept.push((name, &file.bytes));
        }
    }
    kept
}

/// SHA-256 of every kept file, in their order.
pub(crate) fn hash_sources(sources: &[ImportSource]) -> Vec<String> {
    preserved_files(sources).into_iter().map(|(_, bytes)| sha256(bytes)).collect()
}
