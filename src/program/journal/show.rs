//! `wiperlab journal show`.

use super::work::{Work, whole};
use crate::journal::{Journal, Tabled};
use crate::program::count::count;
use crate::program::failure::{Failure, Outcome};
use crate::text::printable;
use clap::Args;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Line of the first record, counted from 1.
const FIRST_LINE: usize = 2;

#[derive(Debug, Args)]
pub struct ShowArgs {
    /// Journal of a fit or study
    pub journal: PathBuf,
    /// One record: that of line N, counted from 1 as in messages
    #[arg(long, value_name = "N", value_parser = count, allow_negative_numbers = true)]
    pub line: Option<usize>,
    /// The evaluation of a fit with the lowest cost, counted without the scatter of the features
    #[arg(long, conflicts_with = "line")]
    pub best: bool,
    /// The last N records
    #[arg(long, value_name = "N", conflicts_with_all = ["line", "best"], value_parser = count,
        allow_negative_numbers = true)]
    pub last: Option<usize>,
}

impl ShowArgs {
    pub fn run(&self) -> Result<Outcome, Failure> {
        self.of_file(&self.journal).map(|()| Outcome::Done)
    }

    /// Places of the records that are shown one by one.
    fn places<R: Tabled>(&self, name: &str, journal: &Journal<R>) -> Result<Vec<usize>, Failure> {
        let count = journal.records.len();
        match (self.line, self.last) {
            (Some(line), _) if (FIRST_LINE..FIRST_LINE + count).contains(&line) => {
                Ok(vec![line - FIRST_LINE])
            }
            (Some(line), _) => Err(Failure::Input(format!(
                "{name}: --line: found {line}, expected {FIRST_LINE} to {}: line 1 is the header",
                count + 1
            ))),
            (None, Some(last)) => Ok((count.saturating_sub(last)..count).collect()),
            (None, None) if self.best => best(journal).map(|at| vec![at]).ok_or_else(|| {
                let record = R::KIND.record();
                Failure::Input(format!("{name}: --best: no {record} has a cost here; use --line or --last"))
            }),
            (None, None) => Ok(Vec::new()),
        }
    }
}

impl Work for ShowArgs {
    type Made = ();

    fn with<R: Tabled>(&self, name: &str, bytes: &[u8]) -> Result<(), Failure> {
        let journal = whole::<R>(name, bytes)?;
        let places = self.places(name, &journal)?;
        let one_by_one = self.line.is_some() || self.last.is_some() || self.best;
        if !one_by_one {
            print_whole(name, &journal);
        }
        places.into_iter().for_each(|at| print_record(&journal, at));
        Ok(())
    }
}

/// The earliest record of the lowest cost.
fn best<R: Tabled>(journal: &Journal<R>) -> Option<usize> {
    let costs = journal.records.iter().enumerate();
    let costs = costs.filter_map(|(at, record)| Some((at, record.cost(&journal.header.body)?)));
    costs.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(at, _)| at)
}

fn print_whole<R: Tabled>(name: &str, journal: &Journal<R>) {
    let (header, record) = (&journal.header, R::KIND.record());
    print_pair("journal", &format!("{name}, of a {}, layout {}", R::KIND, header.layout));
    print_pair("version", &header.version);
    print_pair("fingerprint", &header.fingerprint);
    R::about(&header.body).iter().for_each(|[what, value]| print_pair(what, value));
    print_pair(&format!("{record}s"), &journal.records.len().to_string());
    let mut counts: BTreeMap<(&str, &str), usize> = BTreeMap::new();
    journal.records.iter().for_each(|record| *counts.entry(record.group()).or_default() += 1);
    for ((stage, ended), count) in counts {
        print_pair(&format!("  {stage} {ended}"), &count.to_string());
    }
    if let Some(at) = best(journal) {
        let cost = journal.records[at].cost(&header.body).unwrap_or_default();
        print_pair("best", &format!("line {}, cost {cost:.6} without scatter", at + FIRST_LINE));
    }
}

fn print_record<R: Tabled>(journal: &Journal<R>, at: usize) {
    let body = &journal.header.body;
    print_pair("line", &(at + FIRST_LINE).to_string());
    let cells = R::columns(body).into_iter().zip(journal.records[at].cells(at, body));
    for (column, cell) in cells.filter(|(_, cell)| !cell.is_empty()) {
        print_pair(&format!("  {column}"), &cell);
    }
}

/// Names and messages come from files.
fn print_pair(what: &str, value: &str) {
    print_line!("{:<44} {}", printable(what), printable(value));
}
