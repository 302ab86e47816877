//! `wiperlab completions`: what a shell completes.

use crate::program::failure::{Failure, Outcome};
use crate::program::output::{lines, result};
use clap::{Args, Command};
use clap_complete::{Shell, generate};

const AFTER_HELP: &str = "\
For example:

    wiperlab completions bash > ~/.local/share/bash-completion/completions/wiperlab
    wiperlab completions zsh > ~/.zfunc/_wiperlab
    wiperlab completions fish > ~/.config/fish/completions/wiperlab.fish
    wiperlab completions powershell >> $PROFILE";

#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct CompletionsArgs {
    /// The shell
    pub shell: Shell,
}

impl CompletionsArgs {
    pub fn run(&self, program: &mut Command) -> Result<Outcome, Failure> {
        let mut script = Vec::new();
        generate(self.shell, program, "wiperlab", &mut script);
        result(&lines(&String::from_utf8_lossy(&script)));
        Ok(Outcome::Done)
    }
}
