//! Journals of any kind, for the commands on them.

use super::file::unchecked;
use crate::fit::iterates::Step;
use crate::fit::journal::Entry;
use crate::journal::{Journal, Kind, Tabled, kind_of, read};
use crate::program::failure::Failure;
use crate::program::files;
use crate::sweep::journal::Point;
use std::path::Path;

/// What is done with a journal of any kind.
pub trait Work {
    type Made;

    fn with<R: Tabled>(&self, name: &str, bytes: &[u8]) -> Result<Self::Made, Failure>;

    /// The same for the file, whatever it is a journal of.
    fn of_file(&self, path: &Path) -> Result<Self::Made, Failure> {
        let bytes = files::read(path)?;
        self.of_bytes(path, &bytes)
    }

    fn of_bytes(&self, path: &Path, bytes: &[u8]) -> Result<Self::Made, Failure> {
        let name = path.display().to_string();
        match kind_of(bytes) {
            Some(Kind::Sweep) => self.with::<Point>(&name, bytes),
            Some(Kind::Trace) => self.with::<Step>(&name, bytes),
            // (what is no journal is refused as none of a fit)
            Some(Kind::Fit) | None => self.with::<Entry>(&name, bytes),
        }
    }
}

/// A journal that has a header; what is torn or not checked is said.
pub fn whole<R: Tabled>(name: &str, bytes: &[u8]) -> Result<Journal<R>, Failure> {
    let journal: Option<Journal<R>> = read(name, bytes).map_err(Failure::input)?;
    let journal = journal.ok_or_else(|| no_header(name))?;
    if journal.torn {
        warn_line!("warning: {name}: the last line is incomplete and left out");
    }
    if journal.is_unchecked() {
        warn_line!("warning: {name}: {}", unchecked(R::KIND));
    }
    Ok(journal)
}

pub fn no_header(name: &str) -> Failure {
    Failure::Input(format!("{name}: found no complete line, expected a journal; choose another file"))
}
