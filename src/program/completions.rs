//! `wiperlab completions`: what a shell completes.

use crate::program::failure::{CommandOutcome, Failure};
use crate::program::output::{escape_lines, write_stdout};
use clap::{Args, Command};
use clap_complete::{Shell, generate};

const COMPLETIONS_HELP: &str = "\
For example:

    wiperlab completions bash > ~/.local/share/bash-completion/completions/wiperlab
    wiperlab completions zsh > ~/.zfunc/_wiperlab
    wiperlab completions fish > ~/.config/fish/completions/wiperlab.fish
    wiperlab completions powershell >> $PROFILE";

#[derive(Debug, Args)]
#[command(after_help = COMPLETIONS_HELP)]
pub struct CompletionsArgs {
    /// The shell
    pub shell: Shell,
}

impl CompletionsArgs {
    pub fn run(&self, program: &mut Command) -> Result<CommandOutcome, Failure> {
        let mut script = Vec::new();
        generate(self.shell, program, "wiperlab", &mut script);
        write_stdout(&escape_lines(&String::from_utf8_lossy(&script)));
        Ok(CommandOutcome::Done)
    }
}
