//! `wiperlab report`.

use crate::args::Global;
use crate::failure::{Failure, Outcome};
use clap::Args;

#[derive(Debug, Args)]
pub struct ReportArgs {}

impl ReportArgs {
    pub fn run(&self, _global: &Global) -> Result<Outcome, Failure> {
        Err(Failure::Internal("report: under construction".to_owned()))
    }
}
