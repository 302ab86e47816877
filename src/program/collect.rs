//! `wiperlab collect`.

use crate::journal::Shard;
use crate::program::failure::{Failure, Outcome};
use crate::program::files::{Maker, Overwrite, Writer};
use crate::program::fit::{Standing, check_folders};
use crate::program::global::Global;
use crate::program::load::is_study;
use crate::program::problem::Problem as Fit;
use crate::program::shards::{SHARDS, shard_files, usual};
use crate::program::submit::Tasks;
use crate::program::sweep::{Problem, study_of};
use crate::sweep::Collection;
use clap::Args;
use std::fs::File;
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub struct CollectArgs {
    /// Folder of the study, the --out of its shards; or the jobs of a list of fits, as they were given to
    /// `wiperlab fit`
    #[arg(required = true, value_name = "DIR|JOB")]
    pub paths: Vec<PathBuf>,
    /// The study (default: the one that the shards were made of, where it lay then)
    #[arg(long, value_name = "STUDY")]
    pub study: Option<PathBuf>,
    /// Number of shards for which missing tasks are named (default: the number that most shards there have)
    #[arg(long, value_name = "N", value_parser = crate::program::count::count)]
    pub shards: Option<usize>,
    #[command(flatten)]
    pub overwrite: Overwrite,
}

impl CollectArgs {
    pub fn run(&self, global: &Global) -> Result<Outcome, Failure> {
        match self.paths.as_slice() {
            [dir] if !dir.is_file() => self.study(dir, global),
            [file] => Err(of_one_file(file)?),
            jobs => self.jobs(jobs, global),
        }
    }

    /// Says which jobs of a list have no result.
    fn jobs(&self, jobs: &[PathBuf], global: &Global) -> Result<Outcome, Failure> {
        check_folders(jobs)?;
        let of = self.shards.unwrap_or(jobs.len());
        Shard::new(0, of).ok_or_else(|| too_many(of))?;
        let standings = jobs.iter().map(|job| Ok(Standing::of(&Fit::load(job)?)));
        let standings = standings.collect::<Result<Vec<_>, Failure>>()?;
        let due: Vec<usize> = (0..jobs.len()).filter(|at| standings[*at] == Standing::Due).collect();
        if !global.quiet {
            for (job, standing) in jobs.iter().zip(&standings) {
                print_line!("{}: {}", job.display(), standing.word());
            }
            if !due.is_empty() {
                let tasks = due.iter().map(|at| at % of).collect();
                let what = format!("{} of {} jobs", due.len(), jobs.len());
                say_missing(&what, &tasks, of, &format!("fit JOBS --shard K/{of}, with the same jobs"));
            }
        }
        let all_explained = standings.iter().all(|standing| *standing == Standing::Done(Outcome::Done));
        Ok(if all_explained { Outcome::Done } else { Outcome::StoppedEarly })
    }

    fn study(&self, dir: &Path, global: &Global) -> Result<Outcome, Failure> {
        let shards = shard_files(dir)?;
        if shards.is_empty() {
            return Err(Failure::Input(format!(
                "{}: found no shard K-of-N.jsonl, expected those that `wiperlab sweep STUDY --out {} --shard \
                 K/N` writes; correct DIR",
                dir.join(SHARDS).display(),
                dir.display()
            )));
        }
        let study = self.study.clone().map_or_else(|| study_of(dir), Ok)?;
        let problem = Problem::load(&study)?;
        let writer = Writer::new(Maker::Sweep, self.overwrite).csv(global.csv_dialect);
        problem.check_place(dir, &writer)?;
        let mut points = problem.collection(dir)?;
        for (_, path) in &shards {
            problem.add(&mut points, path)?;
        }
        let all = problem.study.points();
        if points.known() == all {
            return problem.write(&mut points, dir, &writer, global);
        }
        let of = self.shards.unwrap_or_else(|| usual(&shards));
        if !global.quiet {
            let what = format!("{} of {all} points", all - points.known());
            let command = format!("sweep {} --out {} --shard K/{of}", study.display(), dir.display());
            say_missing(&what, &tasks(&points, of)?, of, &command);
        }
        Ok(Outcome::StoppedEarly)
    }
}

/// Shards of so many that have points to do, rising.
fn tasks(points: &Collection<File>, of: usize) -> Result<Tasks, Failure> {
    Shard::new(0, of).ok_or_else(|| too_many(of))?;
    let mut due = vec![false; of];
    points.missing().for_each(|index| due[index % of] = true);
    Ok((0..of).filter(|at| due[*at]).collect())
}

/// Why a file alone is not collected.
fn of_one_file(file: &Path) -> Result<Failure, Failure> {
    let (found, expected) = if is_study(file)? {
        ("a study", "the folder of its shards: `wiperlab collect DIR` with the --out of `wiperlab sweep`")
    } else {
        (
            "one file",
            "the folder of a study or a list of jobs, as a fit is not divided; run `wiperlab fit` with it",
        )
    };
    Ok(Failure::Input(format!("{}: found {found}, expected {expected}", file.display())))
}

fn too_many(of: usize) -> Failure {
    Failure::Input(format!("--shards: found {of}, expected fewer"))
}

/// Which tasks of so many have to run again, and with which command.
fn say_missing(what: &str, tasks: &Tasks, of: usize, command: &str) {
    print_line!("missing: {what}, in {} of {of} tasks", tasks.len());
    print_line!("tasks: {tasks}");
    print_line!("for each of them as K: wiperlab {command}");
}
