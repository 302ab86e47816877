//! `wiperlab simulate`.

use crate::args::Global;
use crate::failure::{Failure, Outcome};
use clap::Args;

#[derive(Debug, Args)]
pub struct SimulateArgs {}

impl SimulateArgs {
    pub fn run(&self, _global: &Global) -> Result<Outcome, Failure> {
        Err(Failure::Internal("simulate: under construction".to_owned()))
    }
}
