//! `wiperlab man`: the help of every command as manual pages.

use crate::program::failure::{CommandOutcome, Failure};
use crate::program::files::{self, OutputCommand, Overwrite, WritePolicy};
use crate::program::global::GlobalArgs;
use clap::{Args, Command};
use clap_mangen::Man;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub struct ManArgs {
    /// Folder for wiperlab.1, wiperlab-fit.1 and so on, such as ~/.local/share/man/man1
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    #[command(flatten)]
    pub overwrite: Overwrite,
}

impl ManArgs {
    pub fn run(&self, program: &mut Command, global: &GlobalArgs) -> Result<CommandOutcome, Failure> {
        program.build();
        let mut pages = Vec::new();
        add_manual_page(&mut pages, program, "wiperlab")?;
        files::write_outputs(&self.out, &WritePolicy::new(OutputCommand::Man, self.overwrite), &pages)?;
        if !global.quiet {
            print_line!("{} pages written to {}", pages.len(), self.out.display());
        }
        Ok(CommandOutcome::Done)
    }
}

/// The page of a command and those of the commands in it.
fn add_manual_page(pages: &mut Vec<(String, Vec<u8>)>, command: &Command, name: &str) -> Result<(), Failure> {
    let mut page = Vec::new();
    Man::new(command.clone()).render(&mut page).map_err(Failure::internal)?;
    pages.push((format!("{name}.1"), page));
    command
        .get_subcommands()
        .try_for_each(|inner| add_manual_page(pages, inner, &format!("{name}-{}", inner.get_name())))
}
