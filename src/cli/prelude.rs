//! Imports that all commands share.

pub(super) use super::args::GlobalArgs;
pub(super) use super::failure::{CommandOutcome, Failure, Outcome};
pub(super) use super::files::{self, FigureArgs, OutputCommand, OutputFolder, Overwrite, WritePolicy};
pub(super) use super::{interrupt, output, progress};
pub(super) use clap::Args;
pub(super) use std::path::{Path, PathBuf};
