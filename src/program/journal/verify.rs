//! `wiperlab journal verify`.

use super::work::{Work, whole};
use crate::journal::{Kind, Tabled};
use crate::program::failure::{Failure, Outcome};
use crate::program::global::Global;
use clap::Args;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub struct VerifyArgs {
    /// Journals of fits or studies
    #[arg(required = true, value_name = "JOURNAL")]
    pub journals: Vec<PathBuf>,
}

/// Counts of a journal whose lines all hold.
struct Verified {
    kind: Kind,
    records: usize,
    checked: bool,
}

struct Verify;

impl Work for Verify {
    type Made = Verified;

    fn with<R: Tabled>(&self, name: &str, bytes: &[u8]) -> Result<Verified, Failure> {
        let journal = whole::<R>(name, bytes)?;
        let checked = !journal.is_unchecked();
        Ok(Verified { kind: R::KIND, records: journal.records.len(), checked })
    }
}

impl VerifyArgs {
    pub fn run(&self, global: &Global) -> Result<Outcome, Failure> {
        for path in &self.journals {
            let Verified { kind, records, checked } = Verify.of_file(path)?;
            if !global.quiet {
                let holds = if checked { "every checksum holds" } else { "read, without checksums" };
                print_line!("{}: {kind}, {records} {}s: {holds}", path.display(), kind.record());
            }
        }
        Ok(Outcome::Done)
    }
}
