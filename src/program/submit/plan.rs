//! What is submitted, checked.

use super::tasks::Tasks;
use super::work::Work;
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
pub struct Plan {
    /// This program, for other machines.
    pub program: String,
    /// Where the tasks run: names in scenes may start from here.
    pub folder: String,
    pub work: Work,
    pub shards: usize,
    pub tasks: Tasks,
    /// Cores of a task.
    pub threads: usize,
    pub walltime: Option<Duration>,
    pub directives: Vec<String>,
    /// Options of every command that the files need.
    pub options: Vec<String>,
}

impl Plan {
    /// Command of a task, without its shard.
    pub fn task(&self) -> Vec<String> {
        [self.work.task(), self.options.clone()].concat()
    }

    /// Command of the job at the end.
    pub fn collect(&self) -> Vec<String> {
        [self.work.collect(self.shards), self.options.clone()].concat()
    }

    /// After what time a task ends by itself.
    pub fn time_limit(&self) -> Option<Duration> {
        self.walltime.map(|walltime| walltime.saturating_sub(margin(walltime)))
    }

    /// Folder of the scripts.
    pub fn scripts(&self) -> PathBuf {
        self.work.folder().join("submit")
    }

    /// Folder of what the tasks print.
    pub fn logs(&self) -> PathBuf {
        self.work.folder().join("logs")
    }

    pub fn make_logs(&self) -> Result<(), Failure> {
        let logs = self.logs();
        fs::create_dir_all(&logs)
            .map_err(|error| Failure::Internal(format!("{}: cannot be made: {error}", logs.display())))
    }

    /// `1 core`, `4 cores`.
    pub fn cores(&self) -> String {
        format!("{} core{}", self.threads, if self.threads == 1 { "" } else { "s" })
    }
}

fn margin(walltime: Duration) -> Duration {
    let (least, most) = MARGINS_S;
    let margin_s = (walltime.as_secs() as f64 * MARGIN) as u64;
    Duration::from_secs(margin_s.clamp(least, most))
}

/// Time that Slurm gives a task, for [`clap`].
pub fn walltime(text: &str) -> Result<TimeLimit, String> {
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
        let of = |time: &str| margin(walltime(time).unwrap().0).as_secs();
        assert_eq!([of("1min"), of("10min"), of("20min"), of("1h"), of("24h")], [30, 30, 60, 180, 300]);
        assert!(walltime("59s").unwrap_err().contains("at least a minute"));
        assert!(walltime("x").is_err());
    }
}
