//! `wiperlab help`: the help of the commands, and pages about files, windows and features.

mod markdown;

use super::prelude::*;
use crate::fit::job::Job;
use crate::model::section::BladeSection;
use crate::recording::files::RecordingFile;
use crate::simulate::scene::Scene;
use crate::simulate::twin::spec::TwinSpec;
use crate::sweep::Study;
use crate::text::wrap_words;
use crate::toml_file::{KeyTable, list_key_tables, suggest_key};
use clap::Command;
use clap_complete::{Shell, generate};
use clap_mangen::Man;
use markdown::{find_section, render_for_terminal};
use serde_json::Value;

/// Maximum length of a line of a page, in characters.
const WIDTH: usize = 96;

#[derive(Debug, Args)]
pub(crate) struct HelpArgs {
    /// A command, such as `fit`, or a page; without it, all of them are listed
    #[arg(value_name = "COMMAND|PAGE")]
    pub word: Option<String>,
}

/// Content of a page.
enum HelpContent {
    /// All keys of a kind of file.
    Keys(fn() -> Value),
    /// A section of the documentation: the page, and the text of the heading.
    Section(&'static str, &'static str),
    /// A whole page of the documentation.
    Whole(&'static str),
}

/// Name, subject and content of a page.
type HelpPage = (&'static str, &'static str, HelpContent);

const FITS: &str = include_str!("../../docs/fits.md");
const SPECTRA: &str = include_str!("../../docs/spectra.md");
const RELIABILITY: &str = include_str!("../../docs/reliability.md");
const FIRST_HOUR: &str = include_str!("../../docs/first-hour.md");

const PAGES: [HelpPage; 12] = [
    ("first-hour", "from a tracking export to a report, step by step", HelpContent::Whole(FIRST_HOUR)),
    ("scene", "every key of scene.toml", HelpContent::Keys(Scene::schema)),
    ("job", "every key of job.toml", HelpContent::Keys(Job::schema)),
    ("study", "every key of study.toml", HelpContent::Keys(Study::schema)),
    ("twin.toml", "every key of twin.toml", HelpContent::Keys(TwinSpec::schema)),
    ("recording", "every key of recording.toml", HelpContent::Keys(RecordingFile::schema)),
    ("section", "every key of section.toml", HelpContent::Keys(BladeSection::schema)),
    ("windows", "what --window and `window` take", HelpContent::Section(SPECTRA, "The window")),
    ("components", "what the verdicts on components mean", HelpContent::Section(SPECTRA, "Verdicts")),
    ("features", "what a fit reads from recording and model", HelpContent::Section(FITS, "Features")),
    ("traces", "how a fit compares frame by frame", HelpContent::Section(FITS, "Traces")),
    ("exit-codes", "what the program returns to a shell", HelpContent::Section(RELIABILITY, "Exit codes")),
];

/// The list of the pages, which is printed below the help of the program.
pub(crate) fn list_help_pages() -> String {
    let width = PAGES.iter().map(|(name, ..)| name.len()).max().unwrap_or_default();
    let rows = PAGES.iter().map(|(name, about, _)| format!("\n  {name:<width$}  {about}"));
    format!("Pages of `wiperlab help`:{}", rows.collect::<String>())
}

impl HelpArgs {
    pub(crate) fn run(&self, program: &mut Command) -> Outcome {
        let text = match self.word.as_deref().and_then(find_help_page) {
            Some(content) => content.render(),
            None => self.command_help(program)?,
        };
        output::print_lines(text.trim_end());
        Ok(CommandOutcome::Done)
    }

    /// The help of the given command, or of the program if none is given.
    fn command_help(&self, program: &mut Command) -> Outcome<String> {
        program.build();
        let Some(word) = &self.word else { return Ok(program.render_long_help().to_string()) };
        let refused = unknown_command_failure(word, program);
        let command = program.find_subcommand_mut(word).ok_or(refused)?;
        Ok(command.render_long_help().to_string())
    }
}

fn unknown_command_failure(word: &str, program: &Command) -> Failure {
    let pages = PAGES.iter().map(|(name, ..)| *name);
    let known: Vec<&str> = program.get_subcommands().map(Command::get_name).chain(pages).collect();
    let advice = Some(suggest_key(word, &known)).filter(|advice| advice.starts_with("did you mean"));
    let advice = advice.unwrap_or_else(|| "`wiperlab help` lists them".to_owned());
    Failure::Input(format!("help: found `{word}`, expected a command or a page; {advice}"))
}

/// The page with the given name. Pages of files are found with and without `.toml`, except `twin.toml`, since
/// `twin` is a command.
fn find_help_page(word: &str) -> Option<&'static HelpContent> {
    let stem = word.strip_suffix(".toml").unwrap_or(word);
    PAGES.iter().find(|(name, ..)| *name == word || *name == stem).map(|(.., content)| content)
}

impl HelpContent {
    fn render(&self) -> String {
        match self {
            Self::Keys(schema) => render_keys(&list_key_tables(&schema())),
            Self::Section(page, heading) => render_for_terminal(find_section(page, heading), WIDTH),
            Self::Whole(page) => render_for_terminal(page, WIDTH),
        }
    }
}

/// The keys of a file, as a page for the terminal.
fn render_keys(tables: &[KeyTable]) -> String {
    let mut text = String::new();
    let mut add = |line: &str| {
        text.push_str(line);
        text.push('\n');
    };
    for table in tables {
        if !table.name.is_empty() {
            add("");
            add(&table.name);
        }
        wrap_words(&table.about, WIDTH).iter().for_each(|line| add(line));
        add("");
        for key in &table.keys {
            let needed = if key.required { ", required" } else { "" };
            let value = format!("({}{needed})", key.value);
            let beside = format!("  {}  {value}", key.name);
            if beside.chars().count() <= WIDTH {
                add(&beside);
            } else {
                add(&format!("  {}", key.name));
                wrap_words(&value, WIDTH - 6).iter().for_each(|line| add(&format!("      {line}")));
            }
            wrap_words(&key.meaning, WIDTH - 6).iter().for_each(|line| add(&format!("      {line}")));
        }
    }
    text
}

// `wiperlab completions`.

const COMPLETIONS_HELP: &str = "\
For example:

    wiperlab completions bash > ~/.local/share/bash-completion/completions/wiperlab
    wiperlab completions zsh > ~/.zfunc/_wiperlab
    wiperlab completions fish > ~/.config/fish/completions/wiperlab.fish
    wiperlab completions powershell >> $PROFILE";

#[derive(Debug, Args)]
#[command(after_help = COMPLETIONS_HELP)]
pub(crate) struct CompletionsArgs {
    /// Shell for which the script is printed
    pub shell: Shell,
}

impl CompletionsArgs {
    pub(crate) fn run(&self, program: &mut Command) -> Outcome {
        let mut script = Vec::new();
        generate(self.shell, program, "wiperlab", &mut script);
        output::print_lines(&String::from_utf8_lossy(&script));
        Ok(CommandOutcome::Done)
    }
}

// `wiperlab man`.

#[derive(Debug, Args)]
pub(crate) struct ManArgs {
    /// Folder for wiperlab.1, wiperlab-fit.1 and so on, such as ~/.local/share/man/man1
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    #[command(flatten)]
    pub overwrite: Overwrite,
}

impl ManArgs {
    pub(crate) fn run(&self, program: &mut Command, global: &GlobalArgs) -> Outcome {
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

/// Adds the manual page of a command and those of its subcommands.
fn add_manual_page(pages: &mut Vec<(String, Vec<u8>)>, command: &Command, name: &str) -> Outcome<()> {
    let mut page = Vec::new();
    Man::new(command.clone()).render(&mut page).map_err(Failure::internal)?;
    pages.push((format!("{name}.1"), page));
    command
        .get_subcommands()
        .try_for_each(|inner| add_manual_page(pages, inner, &format!("{name}-{}", inner.get_name())))
}
