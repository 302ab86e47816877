//! `wiperlab submit`.

mod local;
mod plan;
mod slurm;
mod tasks;

use super::args::TimeLimit;
use super::files::FileSize;
use super::prelude::*;
use clap::ValueEnum;
use plan::{SubmissionPlan, SubmittedWork, absolute_path};
use std::process::Command;
use std::sync::OnceLock;
pub(crate) use tasks::TaskList;

/// The scheduler that runs the tasks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum Scheduler {
    Slurm,
    Local,
}

#[derive(Debug, Args)]
pub(crate) struct SubmitArgs {
    /// Study to run (sweep.toml), or jobs of fits (fits/NAME/job.toml), each of which is fitted by a single
    /// task
    #[arg(required = true, value_name = "STUDY|JOB")]
    pub files: Vec<PathBuf>,
    /// Folder for the results of a study, which must have the same path on every machine; scripts are written
    /// to DIR/shards/submit, logs to DIR/shards/logs (default for jobs, whose results are written next to
    /// them: the folder that contains all of them)
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Scheduler that runs the tasks; `local` is this machine, without a scheduler
    #[arg(long, value_enum)]
    pub scheduler: Scheduler,
    /// Number of tasks into which the work is divided, at most 1000; --threads is the number of cores of each
    /// task (default: 1)
    #[arg(long, value_name = "N", value_parser = tasks::parse_shard_count, allow_negative_numbers = true)]
    pub shards: usize,
    /// Walltime of a task, such as 01:30:00 or 45min, at least a minute; the task ends itself shortly before
    #[arg(long, value_name = "TIME", value_parser = plan::parse_walltime)]
    pub time: Option<TimeLimit>,
    /// Submit only these tasks, as named by `wiperlab collect`, such as 3,7-12 (default: all)
    #[arg(long, value_name = "LIST")]
    pub tasks: Option<TaskList>,
    /// An additional directive for Slurm, such as --directive=--partition=short; repeatable
    #[arg(long = "directive", value_name = "TEXT", allow_hyphen_values = true)]
    pub directives: Vec<String>,
    /// Print scripts and commands to standard output; write and run nothing
    #[arg(long)]
    pub print: bool,
    #[command(flatten)]
    pub overwrite: Overwrite,
}

impl SubmitArgs {
    pub(crate) fn run(&self, global: &GlobalArgs) -> Outcome {
        let plan = self.make_plan(global)?;
        match self.scheduler {
            Scheduler::Slurm => self.submit_scripts(&plan, global),
            Scheduler::Local => self.run_locally(&plan, global),
        }
    }

    fn make_plan(&self, global: &GlobalArgs) -> Outcome<SubmissionPlan> {
        let tasks = self.tasks.clone().unwrap_or_else(|| TaskList::all(self.shards));
        if let Some(last) = tasks.last().filter(|last| *last >= self.shards) {
            let expected = format!("numbers below the {} of --shards; correct one of them", self.shards);
            return Err(Failure::at("--tasks", format!("found {last}, expected {expected}")));
        }
        if let Some(line) = self.directives.iter().find(|line| line.contains(char::is_control)) {
            return Err(Failure::Input(format!(
                "--directive: found \"{line}\", expected one line; give --directive again for another"
            )));
        }
        let here = |error| Failure::Input(format!("the working directory cannot be found: {error}"));
        Ok(SubmissionPlan {
            work: SubmittedWork::load(&self.files, self.out.as_deref(), self.overwrite)?,
            program: absolute_path(&executable_path()?)?,
            folder: absolute_path(&std::env::current_dir().map_err(here)?)?,
            shards: self.shards,
            tasks,
            threads: global.threads.unwrap_or(1),
            walltime: self.time.map(|TimeLimit(time)| time),
            directives: self.directives.clone(),
            options: task_options(global),
        })
    }

    fn run_locally(&self, plan: &SubmissionPlan, global: &GlobalArgs) -> Outcome {
        if !self.directives.is_empty() {
            return Err(Failure::Input(format!(
                "--directive: found \"{}\" with --scheduler local, expected none, as there is no scheduler; \
                 leave it out",
                self.directives.join("\", \"")
            )));
        }
        if self.print {
            local::print_commands(plan);
            return Ok(CommandOutcome::Done);
        }
        local::run_tasks(plan, global)
    }

    /// Writes the scripts, and submits them.
    fn submit_scripts(&self, plan: &SubmissionPlan, global: &GlobalArgs) -> Outcome {
        let scripts = slurm::slurm_scripts(plan);
        if self.print {
            print_scripts(&scripts);
            return Ok(CommandOutcome::Done);
        }
        if !is_program_on_path(slurm::SBATCH) {
            return Err(Failure::Input(format!(
                "--scheduler: found no program `{}` on PATH, expected that of the scheduler; submit from a \
                 machine that has it, or see the scripts with --print",
                slurm::SBATCH
            )));
        }
        let scripts = scripts.map(|(name, text)| (name, text.into_bytes()));
        let (folder, writer) =
            (plan.scripts_folder(), WritePolicy::new(OutputCommand::Submit, self.overwrite));
        files::write_outputs(&folder, &writer, &scripts)?;
        let script = folder.join(slurm::SUBMIT_SH);
        let ran = Command::new("/bin/sh").arg(&script).output();
        let ran = ran.map_err(|error| Failure::Internal(format!("/bin/sh: cannot be run: {error}")))?;
        let submitted = String::from_utf8_lossy(&ran.stdout);
        output::print_lines(&submitted);
        let complaint = String::from_utf8_lossy(&ran.stderr);
        if !ran.status.success() {
            return Err(submission_failure(&script.display().to_string(), &submitted, &complaint));
        }
        output::write_stderr(&output::escape_lines(&complaint));
        if !global.quiet {
            let (tasks, cores, logs) = (plan.tasks.len(), plan.describe_cores(), plan.logs_folder());
            print_line!("{tasks} tasks with {cores} each; logs: {}", logs.display());
            print_line!("scripts: {}", folder.display());
        }
        Ok(CommandOutcome::Done)
    }
}

/// Options with which the tasks read files in the same way as this command.
fn task_options(global: &GlobalArgs) -> Vec<String> {
    let size = global.max_file_size;
    let words = ["--max-file-size".to_owned(), size.to_string().replace(' ', "")];
    if size == FileSize::DEFAULT { Vec::new() } else { words.to_vec() }
}

/// Prints the scripts to standard output.
fn print_scripts(scripts: &[(&str, String)]) {
    for (place, (name, text)) in scripts.iter().enumerate() {
        if place > 0 {
            print_line!("");
        }
        print_line!("# ---- {name} ----");
        output::print_lines(text);
    }
}

/// The failure of a submission that submitted nothing, or only a part.
fn submission_failure(script: &str, submitted: &str, complaint: &str) -> Failure {
    let state = if submitted.trim().is_empty() {
        "nothing was submitted: correct the cause and submit again"
    } else {
        "what is named above is submitted, the rest is not: run `wiperlab collect` yourself when its tasks \
         have ended"
    };
    let complaint = complaint.split_whitespace().collect::<Vec<_>>().join(" ");
    Failure::Internal(format!("{script}: `{}` failed: {complaint}; {state}", slurm::SBATCH))
}

/// Path of the program that is started for tasks, if this code runs within another process such as Python.
static EXECUTABLE_PATH: OnceLock<PathBuf> = OnceLock::new();

/// Sets the path of the program; only the first call counts.
pub(crate) fn set_executable_path(path: PathBuf) {
    let _ = EXECUTABLE_PATH.set(path);
}

fn executable_path() -> Outcome<PathBuf> {
    let unknown = |error| Failure::Internal(format!("the path of this program is not known: {error}"));
    EXECUTABLE_PATH.get().map_or_else(|| std::env::current_exe().map_err(unknown), |path| Ok(path.clone()))
}

// Quoting for a POSIX shell.

/// A word, quoted for the shell if needed.
pub(crate) fn quote_word(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-+:,=@".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

/// Joins words to a command line for the shell.
pub(crate) fn join_words(words: &[String]) -> String {
    words.iter().map(|word| quote_word(word)).collect::<Vec<_>>().join(" ")
}

/// Whether a program is found on PATH.
pub(crate) fn is_program_on_path(program: &str) -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path).any(|folder| is_program(&folder.join(program)))
}

#[cfg(unix)]
fn is_program(path: &Path) -> bool {
    use std::os::unix::fs::PermissionsExt;
    path.metadata().is_ok_and(|found| found.is_file() && found.permissions().mode() & 0o111 != 0)
}

#[cfg(not(unix))]
fn is_program(path: &Path) -> bool {
    path.is_file() || path.with_extension("exe").is_file()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_reach_the_program_as_they_are() {
        for (word, written) in [
            ("/home/a/study.toml", "/home/a/study.toml"),
            ("a b", "'a b'"),
            ("it's", r"'it'\''s'"),
            ("$HOME `x` \"y\" \\", "'$HOME `x` \"y\" \\'"),
            ("Wischblätter", "'Wischblätter'"),
            ("", "''"),
            ("~a", "'~a'"),
        ] {
            assert_eq!(quote_word(word), written);
        }
        assert_eq!(join_words(&["sweep".into(), "a b".into(), "--out".into()]), "sweep 'a b' --out");
    }

    #[cfg(unix)]
    #[test]
    fn the_shell_reads_them_back() {
        let words =
            ["a b", "it's", "$HOME `x` \"y\" \\", "Wischblätter", "-x", "*", "a;b&c|d>e#f!g%h", "tab\t"];
        for word in words {
            let script = format!("printf %s {}", quote_word(word));
            let ran = std::process::Command::new("/bin/sh").args(["-c", &script]).output().unwrap();
            assert_eq!(String::from_utf8(ran.stdout).unwrap(), word);
        }
    }
}
