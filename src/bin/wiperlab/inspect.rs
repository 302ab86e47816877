//! `wiperlab inspect`.

use crate::args::Global;
use crate::failure::{Failure, Outcome};
use clap::Args;

#[derive(Debug, Args)]
pub struct InspectArgs {}

impl InspectArgs {
    pub fn run(&self, _global: &Global) -> Result<Outcome, Failure> {
        Err(Failure::Internal("inspect: under construction".to_owned()))
    }
}
