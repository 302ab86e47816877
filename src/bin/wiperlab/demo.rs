//! `wiperlab demo`.

use crate::args::Global;
use crate::failure::{Failure, Outcome};
use clap::Args;

#[derive(Debug, Args)]
pub struct DemoArgs {}

impl DemoArgs {
    pub fn run(&self, _global: &Global) -> Result<Outcome, Failure> {
        Err(Failure::Internal("demo: under construction".to_owned()))
    }
}
