//! `wiperlab spectrum`.

use crate::args::Global;
use crate::failure::{Failure, Outcome};
use clap::Args;

#[derive(Debug, Args)]
pub struct SpectrumArgs {}

impl SpectrumArgs {
    pub fn run(&self, _global: &Global) -> Result<Outcome, Failure> {
        Err(Failure::Internal("spectrum: under construction".to_owned()))
    }
}
