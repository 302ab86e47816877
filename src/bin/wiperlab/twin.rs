//! `wiperlab twin`.

use crate::args::Global;
use crate::failure::{Failure, Outcome};
use clap::Args;

#[derive(Debug, Args)]
pub struct TwinArgs {}

impl TwinArgs {
    pub fn run(&self, _global: &Global) -> Result<Outcome, Failure> {
        Err(Failure::Internal("twin: under construction".to_owned()))
    }
}
