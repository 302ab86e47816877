//! The schedulers that take an array of tasks.

use super::plan::Plan;
use super::script::Scripts;
use super::{htcondor, lsf, pbs, slurm};
use clap::ValueEnum;

/// Who runs the tasks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Scheduler {
    Slurm,
    Lsf,
    Pbs,
    Htcondor,
    Local,
}

impl Scheduler {
    /// What the scheduler is given; `None` without one.
    pub fn scripts(self, plan: &Plan) -> Option<Scripts> {
        match self {
            Self::Slurm => Some(slurm::scripts(plan)),
            Self::Lsf => Some(lsf::scripts(plan)),
            Self::Pbs => Some(pbs::scripts(plan)),
            Self::Htcondor => Some(htcondor::scripts(plan)),
            Self::Local => None,
        }
    }
}
