//! `wiperlab submit`.

mod local;
mod plan;
mod shell;
mod slurm;
mod tasks;
mod work;

use crate::program::failure::{Failure, Outcome};
use crate::program::files::{self, Maker, Overwrite, Size, Writer};
use crate::program::global::Global;
use crate::program::place;
use crate::program::time_limit::TimeLimit;
use clap::{Args, ValueEnum};
use plan::Plan;
use std::path::PathBuf;
use std::process::Command;
pub use tasks::Tasks;
use work::{Work, absolute};

/// Who runs the tasks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Scheduler {
    Slurm,
    Local,
}

#[derive(Debug, Args)]
pub struct SubmitArgs {
    /// Study to run (sweep.toml), or jobs of fits (fits/NAME/job.toml), each of which one task does whole
    #[arg(required = true, value_name = "STUDY|JOB")]
    pub files: Vec<PathBuf>,
    /// Folder for the results of a study, which every machine sees under the same path; scripts go into
    /// DIR/shards/submit, logs into DIR/shards/logs (default for jobs, whose results lie next to them: the
    /// folder in which all of them are)
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Who runs the tasks; `local` is this machine, without a scheduler
    #[arg(long, value_enum)]
    pub scheduler: Scheduler,
    /// Number of tasks that the work is divided into, at most 1000; --threads is the number of cores of each
    /// (default: 1)
    #[arg(long, value_name = "N", value_parser = tasks::shards, allow_negative_numbers = true)]
    pub shards: usize,
    /// Walltime of a task, such as 01:30:00 or 45min, at least a minute; the task ends by itself shortly
    /// before
    #[arg(long, value_name = "TIME", value_parser = plan::walltime)]
    pub time: Option<TimeLimit>,
    /// Only these tasks, as `wiperlab collect` names them, such as 3,7-12 (default: all)
    #[arg(long, value_name = "LIST")]
    pub tasks: Option<Tasks>,
    /// A further line for Slurm, such as --directive=--partition=short; may be given again
    #[arg(long = "directive", value_name = "TEXT", allow_hyphen_values = true)]
    pub directives: Vec<String>,
    /// Show scripts and commands on standard output; write and run nothing
    #[arg(long)]
    pub print: bool,
    #[command(flatten)]
    pub overwrite: Overwrite,
}

impl SubmitArgs {
    pub fn run(&self, global: &Global) -> Result<Outcome, Failure> {
        let plan = self.plan(global)?;
        match self.scheduler {
            Scheduler::Slurm => self.submit(&plan, global),
            Scheduler::Local => self.run_here(&plan, global),
        }
    }

    fn plan(&self, global: &Global) -> Result<Plan, Failure> {
        let tasks = self.tasks.clone().unwrap_or_else(|| Tasks::all(self.shards));
        if let Some(last) = tasks.last().filter(|last| *last >= self.shards) {
            return Err(Failure::Input(format!(
                "--tasks: found {last}, expected numbers below the {} of --shards; correct one of them",
                self.shards
            )));
        }
        if let Some(line) = self.directives.iter().find(|line| line.contains(char::is_control)) {
            return Err(Failure::Input(format!(
                "--directive: found \"{line}\", expected one line; give --directive again for another"
            )));
        }
        let here = |error| Failure::Input(format!("the working directory cannot be found: {error}"));
        Ok(Plan {
            work: Work::load(&self.files, self.out.as_deref(), self.overwrite)?,
            program: absolute(&place::path()?)?,
            folder: absolute(&std::env::current_dir().map_err(here)?)?,
            shards: self.shards,
            tasks,
            threads: global.threads.unwrap_or(1),
            walltime: self.time.map(|TimeLimit(time)| time),
            directives: self.directives.clone(),
            options: options(global),
        })
    }

    fn run_here(&self, plan: &Plan, global: &Global) -> Result<Outcome, Failure> {
        if !self.directives.is_empty() {
            return Err(Failure::Input(format!(
                "--directive: found \"{}\" with --scheduler local, expected none, as there is no scheduler; \
                 leave it out",
                self.directives.join("\", \"")
            )));
        }
        if self.print {
            local::show(plan);
            return Ok(Outcome::Done);
        }
        local::run(plan, global)
    }

    /// Writes the scripts and hands them over.
    fn submit(&self, plan: &Plan, global: &Global) -> Result<Outcome, Failure> {
        let scripts = slurm::scripts(plan);
        if self.print {
            show(&scripts);
            return Ok(Outcome::Done);
        }
        if !shell::is_on_path(slurm::PROGRAM) {
            return Err(Failure::Input(format!(
                "--scheduler: found no program `{}` on PATH, expected that of the scheduler; submit from a \
                 machine that has it, or see the scripts with --print",
                slurm::PROGRAM
            )));
        }
        let scripts = scripts.map(|(name, text)| (name, text.into_bytes()));
        files::write_outputs(&plan.scripts(), &Writer::new(Maker::Submit, self.overwrite), &scripts)?;
        let script = plan.scripts().join(slurm::SUBMIT_SH);
        let ran = Command::new("/bin/sh").arg(&script).output();
        let ran = ran.map_err(|error| Failure::Internal(format!("/bin/sh: cannot be run: {error}")))?;
        let submitted = String::from_utf8_lossy(&ran.stdout);
        crate::program::output::result(&crate::program::output::lines(&submitted));
        let complaint = String::from_utf8_lossy(&ran.stderr);
        if ran.status.success() {
            crate::program::output::message(&crate::program::output::lines(&complaint));
        } else {
            return Err(refused(&script.display().to_string(), &submitted, &complaint));
        }
        if !global.quiet {
            print_line!(
                "{} tasks with {} each; logs: {}",
                plan.tasks.len(),
                plan.cores(),
                plan.logs().display()
            );
            print_line!("scripts: {}", plan.scripts().display());
        }
        Ok(Outcome::Done)
    }
}

/// What the tasks have to be told to read the files that were read here.
fn options(global: &Global) -> Vec<String> {
    let size = global.max_file_size;
    let words = ["--max-file-size".to_owned(), size.to_string().replace(' ', "")];
    if size == Size::DEFAULT { Vec::new() } else { words.to_vec() }
}

/// Scripts on standard output.
fn show(scripts: &[(&str, String)]) {
    for (place, (name, text)) in scripts.iter().enumerate() {
        if place > 0 {
            print_line!("");
        }
        print_line!("# ---- {name} ----");
        crate::program::output::result(&crate::program::output::lines(text));
    }
}

/// Why nothing, or not everything, was submitted.
fn refused(script: &str, submitted: &str, complaint: &str) -> Failure {
    let state = if submitted.trim().is_empty() {
        "nothing was submitted: correct the cause and submit again"
    } else {
        "what is named above is submitted, the rest is not: run `wiperlab collect` yourself when its tasks \
         have ended"
    };
    let complaint = complaint.split_whitespace().collect::<Vec<_>>().join(" ");
    Failure::Internal(format!("{script}: `{}` failed: {complaint}; {state}", slurm::PROGRAM))
}
