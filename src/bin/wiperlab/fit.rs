//! `wiperlab fit`.

use crate::args::Global;
use crate::failure::{Failure, Outcome};
use crate::problem::Problem;
use crate::{files, progress};
use clap::Args;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;
use wiperlab::fit::journal::{self, Journal, Sink};
use wiperlab::fit::result::{FitResult, Status};
use wiperlab::fit::{Context, FitError, fit};

const JOURNAL: &str = "journal.jsonl";
/// What `fit` writes beside its job.
pub const RESULT: &str = "result.json";

#[derive(Debug, Args)]
pub struct FitArgs {
    /// Job of the fit (fits/NAME/job.toml)
    pub job: PathBuf,
    /// Go on from the journal beside the job
    #[arg(long)]
    pub resume: bool,
    /// Most evaluations of the model, those of the journal included (default: what the job allows)
    #[arg(long, value_name = "N")]
    pub max_evaluations: Option<usize>,
}

impl FitArgs {
    pub fn run(&self, global: &Global) -> Result<Outcome, Failure> {
        let problem = Problem::load(&self.job)?;
        let result = problem.solve(global, self.resume, self.max_evaluations)?;
        if !global.quiet {
            print_summary(&result);
            print_line!("written to {}", problem.folder.join(RESULT).display());
        }
        Ok(if result.status == Status::Converged { Outcome::Done } else { Outcome::StoppedEarly })
    }
}

impl Problem {
    /// Fits, and writes the journal as it goes and the result at the end.
    pub fn solve(&self, global: &Global, resume: bool, max_evaluations: Option<usize>) -> Result<FitResult, Failure> {
        if max_evaluations == Some(0) {
            return Err(Failure::Input("--max-evaluations: found 0, expected 1 or more".to_owned()));
        }
        let journal_path = self.folder.join(JOURNAL);
        let resumed = if resume { self.resumed(&journal_path)? } else { None };
        let measured = self.recordings();
        let bar = progress::bar(self.expected(max_evaluations) as u64, "fit", global.quiet);
        let mut watch = |now: &wiperlab::fit::ledger::Progress| {
            bar.set_length(bar.length().unwrap_or(0).max(now.evaluations as u64));
            bar.set_position(now.evaluations as u64);
            bar.set_message(format!("{}, cost {:.4}", now.stage.word(), now.best_cost));
            ControlFlow::Continue(())
        };
        let name = journal_path.display().to_string();
        let context = Context {
            fingerprint: &self.fingerprint,
            version: env!("CARGO_PKG_VERSION"),
            max_evaluations,
            resume: resumed.as_ref().map(|journal| (name.as_str(), journal)),
        };
        let mut sink = JournalFile::new(&journal_path, resumed.as_ref());
        let clock = Instant::now();
        let fitted = fit(&self.job, &measured, &self.model(), &context, &mut sink, &mut watch);
        let mut result = fitted.map_err(|error| match error {
            FitError::JournalWrite { .. } => Failure::Internal(error.to_string()),
            _ => Failure::Input(format!("{}: {error}", self.file)),
        })?;
        result.wall_s = Some(clock.elapsed().as_secs_f64());
        bar.finish_and_clear();
        files::write_all(&self.folder, &[(RESULT, result.to_json().into_bytes())])?;
        Ok(result)
    }

    /// Evaluations to be expected, for the progress: the budget, and about what gate, profiles and twins take.
    fn expected(&self, max_evaluations: Option<usize>) -> usize {
        let (job, parameters) = (&self.job, self.job.parameters.len());
        let gate = wiperlab::fit::gate::PROBES * (2 * parameters + 1);
        let profiles = if job.intervals.profile { 60 * parameters } else { 0 };
        let all = gate + job.search.global_evaluations + job.search.local_evaluations + profiles + 3 * job.intervals.bootstrap;
        all.min(max_evaluations.unwrap_or(usize::MAX))
    }

    /// The journal to be continued; a missing one means starting anew.
    fn resumed(&self, path: &Path) -> Result<Option<Journal>, Failure> {
        if !path.exists() {
            warn_line!("warning: {}: nothing to resume; starting anew", path.display());
            return Ok(None);
        }
        let name = path.display().to_string();
        let journal = journal::read(&name, &files::read_text(path)?).map_err(Failure::input)?;
        if let Some(journal) = &journal {
            journal::check_fingerprint(&name, journal, &self.fingerprint).map_err(Failure::input)?;
            if journal.torn {
                warn_line!("warning: {name}: the last line is incomplete and was dropped; its evaluation is made again");
            }
        }
        Ok(journal)
    }
}

/// The journal on disk, opened with the first line; each line is handed to the system before the next evaluation.
struct JournalFile {
    path: PathBuf,
    intact_bytes: u64,
    file: Option<File>,
}

impl JournalFile {
    fn new(path: &Path, resumed: Option<&Journal>) -> Self {
        Self { path: path.to_owned(), intact_bytes: resumed.map_or(0, |journal| journal.intact_bytes as u64), file: None }
    }

    /// The file, cut to what is intact of it.
    fn open(&mut self) -> std::io::Result<&mut File> {
        if self.file.is_none() {
            let file = OpenOptions::new().create(true).append(true).open(&self.path)?;
            file.set_len(self.intact_bytes)?;
            self.file = Some(file);
        }
        self.file.as_mut().ok_or_else(|| std::io::ErrorKind::NotFound.into())
    }
}

impl Sink for JournalFile {
    fn append(&mut self, line: &str) -> Result<(), String> {
        let written = self.open().and_then(|file| file.write_all(line.as_bytes()).and_then(|()| file.flush()));
        written.map_err(|error| format!("{}: {error}", self.path.display()))
    }
}

/// Components, parameters and reservations on standard output.
pub fn print_summary(result: &FitResult) {
    let failed: usize = result.evaluations.failed.values().sum();
    print_line!("{}: {} evaluations, {failed} failed, cost {:.4}", result.status.word(), result.evaluations.total, result.cost);
    print_line!("{:<26} {:>12} {:>12} {:>9}  met", "component", "target, Hz", "model, Hz", "error, %");
    for c in &result.components {
        let model = c.model_hz.map_or("none".to_owned(), |v| format!("{v:.3}"));
        let error = c.relative_error.map_or("-".to_owned(), |v| format!("{:+.2}", 100.0 * v));
        print_line!("{:<26} {:>12.3} {model:>12} {error:>9}  {}", c.name, c.target_hz, if c.pass { "yes" } else { "no" });
    }
    print_line!("{:<36} {:>12} {:>27}  verdict", "parameter", "estimate", "95 % interval");
    for (name, p) in &result.parameters {
        let end = |value: Option<f64>| value.map_or("open".to_owned(), |v| format!("{v:.5}"));
        print_line!("{name:<36} {:>12.6} {:>13} {:>13}  {}", p.estimate, end(p.lower_95), end(p.upper_95), p.verdict.word());
    }
    for note in &result.notes {
        print_line!("note: {note}");
    }
}
