//! `wiperlab journal merge`.

use super::work::whole;
use crate::fit::iterates::Step;
use crate::fit::journal::Entry;
use crate::journal::{Journal, Kind, Tabled, kind_of, merge};
use crate::program::failure::{Failure, Outcome};
use crate::program::files;
use crate::program::global::Global;
use crate::sweep::journal::Point;
use clap::Args;
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub struct MergeArgs {
    /// Journals of the same job or study, scenes, recordings and version; seeds and budgets may differ
    #[arg(required = true, num_args = 2..=1000, value_name = "JOURNAL")]
    pub journals: Vec<PathBuf>,
    /// Where the merged journal is written; a new file
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
}

impl MergeArgs {
    pub fn run(&self, global: &Global) -> Result<Outcome, Failure> {
        if self.out.exists() {
            let out = self.out.display();
            return Err(Failure::Input(format!(
                "{out}: exists, and no journal is written over another one; choose a new file for --out, or move {out} away"
            )));
        }
        let bytes = self.journals.iter().map(|path| files::read(path)).collect::<Result<Vec<_>, _>>()?;
        match bytes.first().and_then(|bytes| kind_of(bytes)) {
            Some(Kind::Sweep) => self.merge::<Point>(&bytes, global, |_| None),
            Some(Kind::Trace) => self.merge::<Step>(&bytes, global, |body| Some(body.seed)),
            _ => self.merge::<Entry>(&bytes, global, |body| Some(body.seed)),
        }
    }

    fn merge<R: Tabled>(
        &self,
        bytes: &[Vec<u8>],
        global: &Global,
        seed: fn(&R::Body) -> Option<u64>,
    ) -> Result<Outcome, Failure> {
        let Some(name) = self.out.file_name().and_then(|name| name.to_str()) else {
            return Err(Failure::Input(format!(
                "--out: found {}, expected the name of a new file",
                self.out.display()
            )));
        };
        let names: Vec<String> = self.journals.iter().map(|path| path.display().to_string()).collect();
        let journals = names.iter().zip(bytes).map(|(name, bytes)| whole::<R>(name, bytes));
        let journals = journals.collect::<Result<Vec<_>, _>>()?;
        let named: Vec<(&str, &Journal<R>)> = names.iter().map(String::as_str).zip(&journals).collect();
        let merged = merge(&named).map_err(Failure::input)?;
        files::write_all(self.out.parent().unwrap_or(Path::new("")), &[(name, merged.text.into_bytes())])?;
        if global.quiet {
            return Ok(Outcome::Done);
        }
        let records = R::KIND.record();
        for ((file, journal), new) in named.iter().zip(&merged.new) {
            let seed = seed(&journal.header.body).map_or_else(String::new, |seed| format!("seed {seed}, "));
            print_line!("{file}: {seed}{} {records}s, {new} of them new", journal.records.len());
        }
        let (out, count) = (self.out.display(), merged.new.iter().sum::<usize>());
        let seed = journals.first().and_then(|first| seed(&first.header.body));
        let resumed = seed.map_or_else(String::new, |seed| format!(", resumed by a job with seed = {seed}"));
        print_line!("{out}: {count} {records}s{resumed}");
        Ok(Outcome::Done)
    }
}
