//! Runs the tasks as processes on this machine, several at once, and then puts the shards together.

use super::plan::SubmissionPlan;
use crate::cli::failure::{BAD_INPUT, STOPPED_EARLY};
use crate::cli::prelude::*;
use crate::cli::submit;
use std::fs::{self, File};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread::sleep;
use std::time::Duration;

/// Interval between checks of the processes.
const PAUSE: Duration = Duration::from_millis(20);

/// The command of a task, as words.
fn shard_command(plan: &SubmissionPlan, task: usize) -> Vec<String> {
    let mut words = plan.task_command();
    words.extend(["--shard".to_owned(), format!("{task}/{}", plan.shards)]);
    words.extend(["--threads".to_owned(), plan.threads.to_string()]);
    if let Some(limit) = plan.time_limit() {
        words.extend(["--time-limit".to_owned(), format!("{}s", limit.as_secs())]);
    }
    words
}

/// Prints all commands to standard output.
pub(crate) fn print_commands(plan: &SubmissionPlan) {
    let commands = plan.tasks.iter().map(|task| shard_command(plan, task));
    for words in commands.chain([plan.collect_command()]) {
        print_line!("{} {}", submit::quote_word(&plan.program), submit::join_words(&words));
    }
}

/// Runs the tasks, then puts the shards together.
pub(crate) fn run_tasks(plan: &SubmissionPlan, global: &GlobalArgs) -> Outcome {
    plan.create_logs_folder()?;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let at_once = (cores / plan.threads).max(1);
    let folder = plan.work.folder();
    let kept = format!("the points that were done are in {}; the same command goes on", folder.display());
    let late = kept.clone();
    let stops = interrupt::register_stoppable(move || late.clone());
    let bar = progress::start_bar(plan.tasks.len() as u64, "submit", "tasks", global.quiet);
    let mut tasks = plan.tasks.iter();
    let (mut running, mut ended): (Vec<LocalTask>, Vec<FinishedTask>) = (Vec::new(), Vec::new());
    loop {
        if interrupt::control_flow().is_break() {
            drop(running); // dropping the tasks kills them
            bar.finish_and_clear();
            stops.announce_stop(&kept);
            return Ok(CommandOutcome::StoppedEarly);
        }
        // if a task refuses its input, no further task is started, since every task would refuse the same
        // input
        let refused = ended.iter().any(FinishedTask::is_refused);
        while !refused && running.len() < at_once {
            let Some(task) = tasks.next() else { break };
            running.push(LocalTask::start(plan, task)?);
        }
        if running.is_empty() {
            break;
        }
        sleep(PAUSE);
        let mut still = Vec::new();
        for task in running {
            match task.try_finish()? {
                Ok(end) => {
                    bar.inc(1);
                    ended.push(end);
                }
                Err(task) => still.push(task),
            }
        }
        running = still;
    }
    bar.finish_and_clear();
    if let Some(end) = ended.iter().find(|end| end.is_refused()) {
        return Err(Failure::Input(end.message(plan)));
    }
    for end in ended.iter().filter(|end| end.has_failed()) {
        warn_line!("warning: {}", end.message(plan));
    }
    drop(stops);
    run_collect(plan, global)
}

/// Runs the final job, which prints what is missing.
fn run_collect(plan: &SubmissionPlan, global: &GlobalArgs) -> Outcome {
    let mut command = Command::new(&plan.program);
    command.args(plan.collect_command()).args(global.quiet.then_some("--quiet"));
    let status = command.status().map_err(|error| start_failure(plan, &error))?;
    match status.code() {
        Some(0) => Ok(CommandOutcome::Done),
        Some(code) if code == i32::from(STOPPED_EARLY) => Ok(CommandOutcome::StoppedEarly),
        Some(code) if code == i32::from(BAD_INPUT) => {
            Err(Failure::input("the shards cannot be put together, see above"))
        }

        _ => Err(Failure::Internal(format!("`wiperlab collect` failed ({status})"))),
    }
}

fn start_failure(plan: &SubmissionPlan, error: &std::io::Error) -> Failure {
    Failure::Internal(format!("{}: cannot be started: {error}", plan.program))
}

/// A running task. If dropped, it is killed, and the points in progress are lost.
struct LocalTask {
    number: usize,
    child: Child,
    log: PathBuf,
}

impl LocalTask {
    fn start(plan: &SubmissionPlan, number: usize) -> Outcome<Self> {
        let log = plan.logs_folder().join(format!("{number}-of-{}.log", plan.shards));
        let unmade = |error| Failure::Internal(format!("{}: cannot be written: {error}", log.display()));
        let to = File::create(&log).map_err(unmade)?;
        let both = to.try_clone().map_err(unmade)?;
        let mut process = Command::new(&plan.program);
        process.args(shard_command(plan, number)).stdin(Stdio::null()).stdout(to).stderr(both);
        let child = process.spawn().map_err(|error| start_failure(plan, &error))?;
        Ok(Self { number, child, log })
    }

    /// The finished task, or the task itself if it is still running.
    fn try_finish(mut self) -> Outcome<Result<FinishedTask, Self>> {
        let status = self.child.try_wait().map_err(Failure::internal)?;
        Ok(match status {
            Some(status) => Ok(FinishedTask { number: self.number, status, log: self.log.clone() }),
            None => Err(self),
        })
    }
}

impl Drop for LocalTask {
    fn drop(&mut self) {
        let _ = self.child.kill(); // (it may already have ended)
        let _ = self.child.wait();
    }
}

/// A task that has ended.
struct FinishedTask {
    number: usize,
    status: ExitStatus,
    log: PathBuf,
}

impl FinishedTask {
    fn is_refused(&self) -> bool {
        self.status.code() == Some(i32::from(BAD_INPUT))
    }

    /// Whether the task neither succeeded nor stopped at its time limit.
    fn has_failed(&self) -> bool {
        !self.status.success() && self.status.code() != Some(i32::from(STOPPED_EARLY))
    }

    /// The last line of the task's output, or its exit status if there is no output.
    fn message(&self, plan: &SubmissionPlan) -> String {
        let text = fs::read(&self.log).unwrap_or_default();
        let text = String::from_utf8_lossy(&text);
        let last = text.lines().rev().find(|line| !line.trim().is_empty());
        let last = last.map(|line| line.trim_start_matches("error: ").to_owned());
        let said = last.unwrap_or_else(|| self.status.to_string());
        format!("shard {}/{}: {said} ({})", self.number, plan.shards, self.log.display())
    }
}
