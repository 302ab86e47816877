//! Figures of commands that print or write tables.

use crate::chart::Figure;
use crate::program::failure::Failure;
use crate::program::files::{self, OutputCommand, OutputFolder, Overwrite, WritePolicy};
use crate::program::global::GlobalArgs;
use clap::Args;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub struct FigureArgs {
    /// Draw figures into a folder, each in three files: one for a screen, and below paper/ one for a column
    /// and one for a page
    #[arg(long = "figures", value_name = "DIR")]
    pub folder: Option<PathBuf>,
}

impl FigureArgs {
    /// Refuses a folder that figures of these names cannot go to; asked before the work.
    pub fn check_folder(&self, names: &[&str], overwrite: Overwrite) -> Result<(), Failure> {
        let Some(folder) = &self.folder else { return Ok(()) };
        let files = names.iter().flat_map(|name| files::figure_files(name, &Figure::default()));
        let names: Vec<String> = files.map(|(name, _)| name).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        OutputFolder::check(folder, &figure_policy(overwrite), &names).map(|_| ())
    }

    /// Writes named figures, where they are wanted.
    pub fn write_figures(
        &self,
        overwrite: Overwrite,
        global: &GlobalArgs,
        figures: impl FnOnce() -> Vec<(&'static str, Figure)>,
    ) -> Result<(), Failure> {
        let Some(folder) = &self.folder else { return Ok(()) };
        let figures = figures();
        let files: Vec<_> =
            figures.iter().flat_map(|(name, figure)| files::figure_files(name, figure)).collect();
        files::write_outputs(folder, &figure_policy(overwrite), &files)?;
        for (name, _) in figures.iter().filter(|_| !global.quiet) {
            print_line!("figure: {}", folder.join(format!("{name}.svg")).display());
        }
        Ok(())
    }
}

fn figure_policy(overwrite: Overwrite) -> WritePolicy {
    WritePolicy::new(OutputCommand::Figures, overwrite)
}
