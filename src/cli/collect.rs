//! `wiperlab collect`.

use super::fit::{BatchJobState, check_distinct_folders};
use super::job::LoadedJob as Fit;
use super::load::is_study;
use super::prelude::*;
use super::shards::{SHARDS_FOLDER, shard_files, usual_shard_count};
use super::submit::TaskList;
use super::sweep::{LoadedStudy, find_study};
use crate::checkpoint::Shard;
use crate::sweep::PointCollection;
use std::fs::File;

#[derive(Debug, Args)]
pub(crate) struct CollectArgs {
    /// Folder of a study, the --out of its shards; or the jobs of a list of fits, as given to `wiperlab fit`
    #[arg(required = true, value_name = "DIR|JOB")]
    pub paths: Vec<PathBuf>,
    /// The study (default: the one of which the shards are, at the path that it had then)
    #[arg(long, value_name = "STUDY")]
    pub study: Option<PathBuf>,
    /// Number of shards for which missing tasks are named (default: the most frequent one in the folder)
    #[arg(long, value_name = "N", value_parser = super::args::parse_count)]
    pub shards: Option<usize>,
    #[command(flatten)]
    pub overwrite: Overwrite,
}

impl CollectArgs {
    pub(crate) fn run(&self, global: &GlobalArgs) -> Outcome {
        match self.paths.as_slice() {
            [dir] if !dir.is_file() => self.collect_study(dir, global),
            [file] => Err(one_file_failure(file)?),
            jobs => self.report_jobs(jobs, global),
        }
    }

    /// Prints the jobs of a list that have no result.
    fn report_jobs(&self, jobs: &[PathBuf], global: &GlobalArgs) -> Outcome {
        check_distinct_folders(jobs)?;
        let of = self.shards.unwrap_or(jobs.len());
        Shard::new(0, of).ok_or_else(|| too_many_shards(of))?;
        let standings = jobs.iter().map(|job| Ok(BatchJobState::read(&Fit::load(job)?)));
        let standings = standings.collect::<Outcome<Vec<_>>>()?;
        let due: Vec<usize> = (0..jobs.len()).filter(|at| standings[*at] == BatchJobState::Due).collect();
        if !global.quiet {
            for (job, standing) in jobs.iter().zip(&standings) {
                print_line!("{}: {}", job.display(), standing.describe());
            }
            if !due.is_empty() {
                let tasks = due.iter().map(|at| at % of).collect();
                let what = format!("{} of {} jobs", due.len(), jobs.len());
                print_missing(&what, &tasks, of, &format!("fit JOBS --shard K/{of}, with the same jobs"));
            }
        }
        let is_done = |standing: &BatchJobState| *standing == BatchJobState::Done(CommandOutcome::Done);
        Ok(CommandOutcome::done_if(standings.iter().all(is_done)))
    }

    fn collect_study(&self, dir: &Path, global: &GlobalArgs) -> Outcome {
        let shards = shard_files(dir)?;
        if shards.is_empty() {
            return Err(Failure::Input(format!(
                "{}: found no shard K-of-N.jsonl, expected those that `wiperlab sweep STUDY --out {} --shard \
                 K/N` writes; correct DIR",
                dir.join(SHARDS_FOLDER).display(),
                dir.display()
            )));
        }
        let study = self.study.clone().map_or_else(|| find_study(dir), Ok)?;
        let problem = LoadedStudy::load(&study)?;
        let writer = global.write_policy(OutputCommand::Sweep, self.overwrite);
        problem.check_outputs(dir, &writer)?;
        let mut points = problem.new_collection(dir)?;
        for (_, path) in &shards {
            problem.add_checkpoint(&mut points, path)?;
        }
        let all = problem.study.point_count();
        if points.known_count() == all {
            return problem.write_outputs(&mut points, dir, &writer, global);
        }
        let of = self.shards.unwrap_or_else(|| usual_shard_count(&shards));
        if !global.quiet {
            let what = format!("{} of {all} points", all - points.known_count());
            let command = format!("sweep {} --out {} --shard K/{of}", study.display(), dir.display());
            print_missing(&what, &incomplete_tasks(&points, of)?, of, &command);
        }
        Ok(CommandOutcome::StoppedEarly)
    }
}

/// Divides the study into `of` shards, and returns the numbers of the shards that lack a point, in ascending
/// order.
fn incomplete_tasks(points: &PointCollection<File>, of: usize) -> Outcome<TaskList> {
    Shard::new(0, of).ok_or_else(|| too_many_shards(of))?;
    let mut due = vec![false; of];
    points.missing_indices().for_each(|index| due[index % of] = true);
    Ok((0..of).filter(|at| due[*at]).collect())
}

/// The failure to report if the user names a single file instead of a folder or several jobs.
fn one_file_failure(file: &Path) -> Outcome<Failure> {
    let problem = if is_study(file)? {
        "found a study, expected the folder of its shards: `wiperlab collect DIR` with the --out of `wiperlab sweep`"
    } else {
        "found one file, expected the folder of a study or a list of jobs, as a fit is not divided; run `wiperlab fit` with it"
    };
    Ok(Failure::at(file.display(), problem))
}

fn too_many_shards(of: usize) -> Failure {
    Failure::Input(format!("--shards: found {of}, expected fewer"))
}

/// Prints which of the `of` tasks must run again, and with which command.
fn print_missing(what: &str, tasks: &TaskList, of: usize, command: &str) {
    print_line!("missing: {what}, in {} of {of} tasks", tasks.len());
    print_line!("tasks: {tasks}");
    print_line!("for each of them as K: wiperlab {command}");
}
