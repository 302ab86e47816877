//! Figures of commands that print or write tables.

use crate::chart::Figure;
use crate::program::failure::Failure;
use crate::program::files::{self, Maker, Overwrite, Place, Writer};
use crate::program::global::Global;
use clap::Args;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub struct Figures {
    /// Draw figures into a folder, each in three files: one for a screen, and below paper/ one for a column
    /// and one for a page
    #[arg(long = "figures", value_name = "DIR")]
    pub folder: Option<PathBuf>,
}

impl Figures {
    /// Refuses a folder that figures of these names cannot go to; asked before the work.
    pub fn check(&self, names: &[&str], overwrite: Overwrite) -> Result<(), Failure> {
        let Some(folder) = &self.folder else { return Ok(()) };
        let files = names.iter().flat_map(|name| files::drawn(name, &Figure::default()));
        let names: Vec<String> = files.map(|(name, _)| name).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        Place::check(folder, &writer(overwrite), &names).map(|_| ())
    }

    /// Writes named figures, where they are wanted.
    pub fn write(
        &self,
        overwrite: Overwrite,
        global: &Global,
        figures: impl FnOnce() -> Vec<(&'static str, Figure)>,
    ) -> Result<(), Failure> {
        let Some(folder) = &self.folder else { return Ok(()) };
        let figures = figures();
        let files: Vec<_> = figures.iter().flat_map(|(name, figure)| files::drawn(name, figure)).collect();
        files::write_outputs(folder, &writer(overwrite), &files)?;
        for (name, _) in figures.iter().filter(|_| !global.quiet) {
            print_line!("figure: {}", folder.join(format!("{name}.svg")).display());
        }
        Ok(())
    }
}

fn writer(overwrite: Overwrite) -> Writer {
    Writer::new(Maker::Figures, overwrite)
}
