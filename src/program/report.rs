//! `wiperlab report`: the page of a fit, or of several side by side.

mod folder;
mod origin;
mod several;
mod video;

use crate::compare::{Measured, ModelRun, model_runs};
use crate::fit::job::Job;
use crate::fit::result::FitResult;
use crate::program::early_end::early_end;
use crate::program::failure::{Failure, Outcome};
use crate::program::files;
use crate::program::files::{Maker, Overwrite, RESULT, Writer};
use crate::program::global::Global;
use crate::program::problem::{Problem, job_file};
use crate::program::progress;
use crate::report::Report;
use crate::report::comparison;
use crate::report::json::report_json;
use crate::report::page::page;
use crate::report::verdict::Verdict;
use clap::Args;
use folder::Output;
use std::path::{Path, PathBuf};
use video::Video;

#[derive(Debug, Args)]
pub struct ReportArgs {
    /// Folder of a fit (fits/NAME), with its job.toml and result.json, or its job; several are compared
    #[arg(required = true, value_name = "FIT")]
    pub fits: Vec<PathBuf>,
    /// Folder of the report (default: reports/NAME next to the fits, of several reports/A-and-B)
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Exit with 3 when the model does not explain the recording or misses a component, in any of the fits
    #[arg(long)]
    pub check: bool,
    #[command(flatten)]
    pub overwrite: Overwrite,
}

impl ReportArgs {
    pub fn run(&self, global: &Global) -> Result<Outcome, Failure> {
        let writer = Writer::new(Maker::Report, self.overwrite).csv(global.csv_dialect);
        let jobs: Vec<PathBuf> = self.fits.iter().map(|fit| job_file(fit)).collect();
        let missed = match jobs.as_slice() {
            [job] => {
                let fit = files::folder_of(job);
                let out = || reports_folder(fit).join(files::display_name(fit));
                write(job, &self.out.clone().unwrap_or_else(out), &writer, global)?
            }
            jobs => several::write(jobs, self.out.as_deref(), &writer, global)?,
        };
        Ok(if self.check && missed { Outcome::StoppedEarly } else { Outcome::Done })
    }
}

/// The folder `reports` next to the folder `fits` that holds `fits/NAME`.
fn reports_folder(fit: &Path) -> PathBuf {
    let full = fit.canonicalize().unwrap_or_else(|_| fit.to_owned());
    full.parent().and_then(Path::parent).unwrap_or(Path::new("")).join("reports")
}

/// A fit with its result, which belongs to the job as it is now.
struct Fit {
    name: String,
    problem: Problem,
    result: FitResult,
    /// Pictures of the frames of every recording that has some.
    videos: Vec<Option<Video>>,
}

/// What makes a report of the model at the estimates.
type MadeBy = fn(&Job, &[Measured], &[ModelRun], &FitResult) -> Report;

impl Fit {
    fn load(job: &Path) -> Result<Self, Failure> {
        let problem = Problem::load(job)?;
        let path = problem.folder.join(RESULT);
        if !path.exists() {
            return Err(Failure::Input(format!(
                "{}: no such file; run `wiperlab fit {}` first",
                path.display(),
                problem.file
            )));
        }
        let file = path.display().to_string();
        let text = files::read_json(&path)?;
        let result = FitResult::parse(&file, &text).map_err(Failure::input)?;
        if result.fingerprint != problem.problem.fingerprint() {
            return Err(Failure::Input(format!(
                "{file}: fingerprint {}, expected {}: job, scene, data or program have changed since the fit; run `wiperlab fit` again",
                result.fingerprint,
                problem.problem.fingerprint()
            )));
        }
        result.check_of(problem.job(), &file).map_err(Failure::input)?;
        problem.problem.check_result(&result, &file).map_err(Failure::input)?;
        let videos = problem.recordings().map(|(path, loaded)| Video::of(path, loaded));
        let videos = videos.collect::<Result<_, _>>()?;
        Ok(Self { name: files::display_name(&problem.folder), problem, result, videos })
    }

    fn measured(&self) -> Vec<Measured<'_>> {
        let measured = self.problem.measured.iter().zip(&self.videos);
        let measured = measured.map(|(loaded, video)| Measured {
            recording: &loaded.recording,
            file: loaded.file.as_ref(),
            film: video.as_ref().map(Video::film),
        });
        measured.collect()
    }

    fn best(&self) -> Result<Vec<ModelRun>, Failure> {
        let model = self.problem.problem.model_of(&self.result).map_err(Failure::input)?;
        let best = model_runs(self.problem.job(), &model, &self.result);
        let best = best
            .map_err(|why| Failure::Internal(format!("{}: the best model does not run: {why}", self.name)))?;
        for how in best.iter().filter_map(|best| early_end(&best.view.run)) {
            warn_line!("warning: {}: the best model's run ended early: {how}", self.name);
        }
        Ok(best)
    }

    /// The report, made by [`comparison::report`] or, where its figures are not asked for, by
    /// [`comparison::in_words`].
    fn report(&self, made: MadeBy, best: &[ModelRun]) -> Result<Report, Failure> {
        let mut report = made(self.problem.job(), &self.measured(), best, &self.result);
        self.videos.iter().flatten().try_for_each(Video::check)?;
        for (line, (path, loaded)) in report.recordings.iter_mut().zip(self.problem.recordings()) {
            line.also(loaded.changed_sources(path));
        }
        report.provenance = origin::provenance(self)?;
        Ok(report)
    }
}

/// Writes the report of a fit; says whether the model does not explain the recording, or misses a component.
pub fn write(fit: &Path, out: &Path, writer: &Writer, global: &Global) -> Result<bool, Failure> {
    folder::check(out, writer)?;
    let steps = progress::steps("report", global.quiet);
    let report = {
        steps.on("reading the fit");
        let fit = Fit::load(fit)?;
        steps.on("running the model");
        let best = fit.best()?;
        steps.on("comparing and drawing");
        fit.report(comparison::report, &best)?
    };
    let verdict = Verdict::of(&report);
    let json = report_json(&report).map_err(Failure::internal)?;
    let output = Output {
        figures: report.all_figures().collect(),
        json,
        tables: &report.tables,
        page: page(&report),
        summary: verdict.summary(),
    };
    drop(steps);
    output.write(out, writer, global)?;
    Ok(!verdict.passes())
}
