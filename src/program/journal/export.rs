//! `wiperlab journal export-csv`.

use super::work::{Work, whole};
use crate::journal::{JournalError, Tabled};
use crate::program::failure::{Failure, Outcome};
use crate::program::files::{self, CsvDialect};
use crate::program::global::Global;
use clap::Args;
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub struct ExportArgs {
    /// Journal of a fit or study
    pub journal: PathBuf,
    /// Where the table is written; a new file
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
}

struct Export;

impl Work for Export {
    /// The table, and how many rows it has.
    type Made = (Vec<u8>, usize);

    fn with<R: Tabled>(&self, name: &str, bytes: &[u8]) -> Result<(Vec<u8>, usize), Failure> {
        let journal = whole::<R>(name, bytes)?;
        if journal.is_unchecked() {
            return Err(Failure::input(JournalError::Unchecked { file: name.to_owned(), kind: R::KIND }));
        }
        let body = &journal.header.body;
        let mut table = csv::Writer::from_writer(Vec::new());
        table.write_record(R::columns(body)).map_err(Failure::internal)?;
        for (at, record) in journal.records.iter().enumerate() {
            table.write_record(record.cells(at, body)).map_err(Failure::internal)?;
        }
        Ok((table.into_inner().map_err(Failure::internal)?, journal.records.len()))
    }
}

impl ExportArgs {
    pub fn run(&self, global: &Global) -> Result<Outcome, Failure> {
        let out = self.out.display();
        if self.out.exists() {
            return Err(Failure::Input(format!(
                "{out}: exists, and nothing is written over; choose a new file for --out, or move it away"
            )));
        }
        let Some(name) = self.out.file_name().and_then(|name| name.to_str()) else {
            return Err(Failure::Input(format!("--out: found {out}, expected the name of a new file")));
        };
        let (plain, rows) = Export.of_file(&self.journal)?;
        let mut table = Vec::new();
        match global.csv_dialect {
            CsvDialect::Plain => table = plain,
            other => other.convert(plain.as_slice(), &mut table).map_err(Failure::internal)?,
        }
        files::write_all(self.out.parent().unwrap_or(Path::new("")), &[(name, table)])?;
        if !global.quiet {
            print_line!("written to {out} ({rows} rows)");
        }
        Ok(Outcome::Done)
    }
}
