//! The checked plan of a submission.

use super::tasks::TaskList;
use crate::cli::args::TimeLimit;
use crate::cli::job::LoadedJob;
use crate::cli::load::is_study;
use crate::cli::prelude::*;
use crate::cli::{fit, sweep};
use std::fs;
use std::time::Duration;

/// Shortest walltime that is accepted, s; Slurm counts walltimes in minutes.
const SHORTEST_S: u64 = 60;

/// A task ends before its walltime by this fraction of the walltime. This leaves time for points in progress
/// and for a late start.
const MARGIN: f64 = 0.05;
/// Shortest and longest time, s, by which a task ends before its walltime.
const MARGINS_S: (u64, u64) = (30, 300);

/// An array of tasks, and the final job that runs after them.
#[derive(Debug)]
pub(crate) struct SubmissionPlan {
    /// Path of this program, for use on other machines.
    pub program: String,
    /// Working folder of the tasks.
    pub folder: String,
    pub work: SubmittedWork,
    pub shards: usize,
    pub tasks: TaskList,
    /// Number of cores of a task.
    pub threads: usize,
    pub walltime: Option<Duration>,
    pub directives: Vec<String>,
    /// Options that every command needs to read the files.
    pub options: Vec<String>,
}

impl SubmissionPlan {
    /// Command line of a task, as words, without the option that names its shard.
    pub(crate) fn task_command(&self) -> Vec<String> {
        [self.work.task_command(), self.options.clone()].concat()
    }

    /// Command line of the final job, which puts the shards together, as words.
    pub(crate) fn collect_command(&self) -> Vec<String> {
        [self.work.collect_command(self.shards), self.options.clone()].concat()
    }

    /// Time after its start at which a task ends itself, shortly before its walltime.
    pub(crate) fn time_limit(&self) -> Option<Duration> {
        self.walltime.map(|walltime| walltime.saturating_sub(time_margin(walltime)))
    }

    /// Folder of the scripts.
    pub(crate) fn scripts_folder(&self) -> PathBuf {
        self.work.folder().join("submit")
    }

    /// Folder for the output of the tasks.
    pub(crate) fn logs_folder(&self) -> PathBuf {
        self.work.folder().join("logs")
    }

    pub(crate) fn create_logs_folder(&self) -> Outcome<()> {
        let logs = self.logs_folder();
        fs::create_dir_all(&logs)
            .map_err(|error| Failure::Internal(format!("{}: cannot be made: {error}", logs.display())))
    }

    /// Number of cores in words, such as `1 core` or `4 cores`.
    pub(crate) fn describe_cores(&self) -> String {
        format!("{} core{}", self.threads, if self.threads == 1 { "" } else { "s" })
    }
}

fn time_margin(walltime: Duration) -> Duration {
    let margin_s = (walltime.as_secs() as f64 * MARGIN) as u64;
    Duration::from_secs(margin_s.clamp(MARGINS_S.0, MARGINS_S.1))
}

/// Parses the walltime that Slurm grants a task, for [`clap`].
pub(crate) fn parse_walltime(text: &str) -> Result<TimeLimit, String> {
    let limit: TimeLimit = text.parse()?;
    if limit.0.as_secs() < SHORTEST_S {
        return Err("expected at least a minute, as Slurm counts in minutes".to_owned());
    }
    Ok(limit)
}

/// The work that is divided among the tasks, with absolute paths.
#[derive(Debug, Clone)]
pub(crate) enum SubmittedWork {
    /// A parameter study, and the folder of its shards and results.
    Study { study: String, out: String },
    /// Jobs of fits, each of which is fitted as a whole and writes its result next to its job file; and a
    /// folder for scripts and logs.
    Jobs { jobs: Vec<String>, out: String },
}

impl SubmittedWork {
    /// Reads and checks a study or jobs, as `wiperlab sweep` and `wiperlab fit` do.
    pub(crate) fn load(files: &[PathBuf], out: Option<&Path>, overwrite: Overwrite) -> Outcome<Self> {
        if let Some(name) = files.iter().find(|file| files::is_standard_input(file)) {
            return Err(Failure::at(
                name.display(),
                "found standard input, expected a file, as every task reads it; save it",
            ));
        }
        let mut studies = Vec::new();
        for file in files {
            studies.extend(is_study(file)?.then_some(file));
        }
        match (files, studies.as_slice(), out) {
            ([study], [_], Some(out)) => Self::load_study(study, out, overwrite),
            ([study], [_], None) => Err(Failure::at(
                study.display(),
                "found a study without --out, expected the folder for its results; add --out DIR",
            )),
            ([job], [], _) => Err(Failure::at(
                job.display(),
                "found one job, expected a study or a list of jobs, as a fit takes seconds and is not divided; \
                 run `wiperlab fit` with it",
            )),
            (_, [], out) => Self::load_jobs(files, out),
            (_, [study, ..], _) => Err(Failure::at(
                study.display(),
                format!(
                    "found a study among {} files, expected one study alone or jobs of fits; submit it by itself",
                    files.len()
                ),
            )),
        }
    }

    fn load_study(study: &Path, out: &Path, overwrite: Overwrite) -> Outcome<Self> {
        let writer = WritePolicy::new(OutputCommand::Sweep, overwrite);
        sweep::LoadedStudy::load(study)?.check_outputs(out, &writer)?;
        Ok(Self::Study { study: absolute_path(study)?, out: absolute_path(out)? })
    }

    fn load_jobs(jobs: &[PathBuf], out: Option<&Path>) -> Outcome<Self> {
        fit::check_distinct_folders(jobs)?;
        jobs.iter().try_for_each(|job| LoadedJob::load(job).map(|_| ()))?;
        let jobs = jobs.iter().map(|job| absolute_path(job)).collect::<Result<Vec<_>, _>>()?;
        let out = out.map_or_else(|| Ok(common_folder(&jobs)), absolute_path)?;
        Ok(Self::Jobs { jobs, out })
    }

    /// Command line of a task, as words, without the option that names its shard.
    pub(crate) fn task_command(&self) -> Vec<String> {
        match self {
            Self::Study { study, out } => to_strings(&["sweep", study, "--out", out]),
            Self::Jobs { jobs, .. } => [to_strings(&["fit"]), jobs.clone()].concat(),
        }
    }

    /// Command line of the final job, which puts the shards together, as words.
    pub(crate) fn collect_command(&self, shards: usize) -> Vec<String> {
        let shards = shards.to_string();
        match self {
            Self::Study { out, .. } => to_strings(&["collect", out, "--shards", &shards]),
            Self::Jobs { jobs, .. } => {
                [to_strings(&["collect"]), jobs.clone(), to_strings(&["--shards", &shards])].concat()
            }
        }
    }

    /// Folder that contains the folders of scripts and of logs.
    pub(crate) fn folder(&self) -> PathBuf {
        let (Self::Study { out, .. } | Self::Jobs { out, .. }) = self;
        Path::new(out).join(crate::cli::shards::SHARDS_FOLDER)
    }

    /// Name of the tasks in the scheduler, and prefix of their logs: at most 15 letters, digits and hyphens.
    pub(crate) fn job_name(&self) -> String {
        const LONGEST: usize = 15;
        let stem = match self {
            Self::Study { study, .. } => Path::new(study).file_stem().unwrap_or_default().to_string_lossy(),
            Self::Jobs { .. } => "fits".into(),
        };
        let plain = stem.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' });
        "wl-".chars().chain(plain).take(LONGEST).collect::<String>().trim_end_matches('-').to_owned()
    }
}

/// The innermost folder that contains all files, as an absolute path.
fn common_folder(files: &[String]) -> String {
    let mut folders = files.iter().filter_map(|file| Path::new(file).parent());
    let first = folders.next().unwrap_or(Path::new("/"));
    let shared = |some: &Path, other: &Path| -> PathBuf {
        let both = some.components().zip(other.components());
        both.take_while(|(a, b)| a == b).map(|(part, _)| part).collect()
    };
    folders.fold(first.to_owned(), |all, folder| shared(&all, folder)).to_string_lossy().into_owned()
}

fn to_strings(words: &[&str]) -> Vec<String> {
    words.iter().map(|word| (*word).to_owned()).collect()
}

/// An absolute path as text for a script.
pub(crate) fn absolute_path(path: &Path) -> Outcome<String> {
    let refused = |problem: &str| Failure::at(path.display(), problem);
    let whole = std::path::absolute(path).map_err(|error| refused(&error.to_string()))?;
    let text = whole.to_str().ok_or_else(|| {
        refused("found a name that is not UTF-8, expected one that a script can hold; rename it")
    })?;
    if text.contains(char::is_control) {
        let expected = "expected none, as scripts are read line by line; rename it";
        return Err(refused(&format!(
            "found a line break or another control character in the name, {expected}"
        )));
    }
    Ok(text.to_owned())
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

    #[test]
    fn scripts_of_jobs_lie_where_all_jobs_do() {
        let of = |files: &[&str]| common_folder(&to_strings(files));
        assert_eq!(of(&["/a/fits/one/job.toml", "/a/fits/two/job.toml"]), "/a/fits");
        assert_eq!(of(&["/a/x/job.toml", "/b/x/job.toml"]), "/");
    }
}
