//! What is submitted, checked.

use super::tasks::TaskList;
use super::work::SubmittedWork;
use crate::program::failure::Failure;
use crate::program::time_limit::TimeLimit;
use std::fs;
use std::path::PathBuf;
use std::time::Duration;

/// Shortest walltime, s: Slurm counts in minutes.
const SHORTEST_S: u64 = 60;

/// Part of the walltime by which a task ends earlier: enough to finish points and to be started late.
const MARGIN: f64 = 0.05;
/// Smallest and largest of these margins, s.
const MARGINS_S: (u64, u64) = (30, 300);

/// An array of tasks and the job after them.
#[derive(Debug)]
pub struct SubmissionPlan {
    /// This program, for other machines.
    pub program: String,
    /// Where the tasks run: names in scenes may start from here.
    pub folder: String,
    pub work: SubmittedWork,
    pub shards: usize,
    pub tasks: TaskList,
    /// Cores of a task.
    pub threads: usize,
    pub walltime: Option<Duration>,
    pub directives: Vec<String>,
    /// Options of every command that the files need.
    pub options: Vec<String>,
}

impl SubmissionPlan {
    /// Command of a task, without its shard.
    pub fn task_command(&self) -> Vec<String> {
        [self.work.task_command(), self.options.clone()].concat()
    }

    /// Command of the job at the end.
    pub fn collect_command(&self) -> Vec<String> {
        [self.work.collect_command(self.shards), self.options.clone()].concat()
    }

    /// After what time a task ends by itself.
    pub fn time_limit(&self) -> Option<Duration> {
        self.walltime.map(|walltime| walltime.saturating_sub(time_margin(walltime)))
    }

    /// Folder of the scripts.
    pub fn scripts_folder(&self) -> PathBuf {
        self.work.folder().join("submit")
    }

    /// Folder of what the tasks print.
    pub fn logs_folder(&self) -> PathBuf {
        self.work.folder().join("logs")
    }

    pub fn create_logs_folder(&self) -> Result<(), Failure> {
        let logs = self.logs_folder();
        fs::create_dir_all(&logs)
            .map_err(|error| Failure::Internal(format!("{}: cannot be made: {error}", logs.display())))
    }

    /// `1 core`, `4 cores`.
    pub fn describe_cores(&self) -> String {
        format!("{} core{}", self.threads, if self.threads == 1 { "" } else { "s" })
    }
}

fn time_margin(walltime: Duration) -> Duration {
    let (least, most) = MARGINS_S;
    let margin_s = (walltime.as_secs() as f64 * MARGIN) as u64;
    Duration::from_secs(margin_s.clamp(least, most))
}

/// Time that Slurm gives a task, for [`clap`].
pub fn parse_walltime(text: &str) -> Result<TimeLimit, String> {
    let limit: TimeLimit = text.parse()?;
    if limit.0.as_secs() < SHORTEST_S {
        return Err("expected at least a minute, as Slurm counts in minutes".to_owned());
    }
    Ok(limit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_task_ends_a_little_before_its_walltime() {
        let of = |time: &str| time_margin(parse_walltime(time).unwrap().0).as_secs();
        assert_eq!([of("1min"), of("10min"), of("20min"), of("1h"), of("24h")], [30, 30, 60, 180, 300]);
        assert!(parse_walltime("59s").unwrap_err().contains("at least a minute"));
        assert!(parse_walltime("x").is_err());
    }
}
