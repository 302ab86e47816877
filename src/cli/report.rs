//! `wiperlab report`: the page of a fit, or the comparison of several fits.

mod fit_comparison;
mod provenance;
mod video;

use super::failure::describe_early_end;
use super::files::{RESULT_FILE, figure_files};
use super::job::{LoadedJob, job_path};
use super::prelude::*;
use crate::compare::{ComparisonTable, FittedRecording, ModelRun, run_conditions};
use crate::figures::{Drawing, FigureBlock};
use crate::fit::job::Job;
use crate::fit::result::FitResult;
use crate::report::json::report_json;
use crate::report::page::render_page;
use crate::report::verdict::ReportVerdict;
use crate::report::{Report, assembly};
use video::FramePictures;

#[derive(Debug, Args)]
pub(crate) struct ReportArgs {
    /// Folder of a fit (fits/NAME) with its job.toml and result.json, or its job; several fits are compared
    #[arg(required = true, value_name = "FIT")]
    pub fits: Vec<PathBuf>,
    /// Folder of the report (default: reports/NAME next to the fits; for several fits reports/A-and-B)
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Exit with code 3 if the model does not explain the recording or misses a component, in any of the fits
    #[arg(long)]
    pub check: bool,
    #[command(flatten)]
    pub overwrite: Overwrite,
}

impl ReportArgs {
    pub(crate) fn run(&self, global: &GlobalArgs) -> Outcome {
        let writer = global.write_policy(OutputCommand::Report, self.overwrite);
        let jobs: Vec<PathBuf> = self.fits.iter().map(|fit| job_path(fit)).collect();
        let missed = match jobs.as_slice() {
            [job] => {
                let fit = files::containing_folder(job);
                let out = || default_reports_folder(fit).join(files::display_name(fit));
                write_report(job, &self.out.clone().unwrap_or_else(out), &writer, global)?
            }
            jobs => fit_comparison::write_comparison(jobs, self.out.as_deref(), &writer, global)?,
        };
        Ok(if self.check && missed { CommandOutcome::StoppedEarly } else { CommandOutcome::Done })
    }
}

/// The folder `reports` next to the folder `fits` in which `fits/NAME` is.
fn default_reports_folder(fit: &Path) -> PathBuf {
    let full = fit.canonicalize().unwrap_or_else(|_| fit.to_owned());
    full.parent().and_then(Path::parent).unwrap_or(Path::new("")).join("reports")
}

/// A fit with its result, which has been checked to belong to the present job.
struct ReportedFit {
    name: String,
    problem: LoadedJob,
    result: FitResult,
    /// For every recording, pictures of its video frames; `None` if it has no pictures.
    videos: Vec<Option<FramePictures>>,
}

/// A function that builds a report.
type ReportBuilder = fn(&Job, &[FittedRecording], &[ModelRun], &FitResult) -> Report;

impl ReportedFit {
    fn load(job: &Path) -> Outcome<Self> {
        let problem = LoadedJob::load(job)?;
        let path = problem.folder.join(RESULT_FILE);
        if !path.exists() {
            return Err(Failure::at(
                path.display(),
                format!("no such file; run `wiperlab fit {}` first", problem.file),
            ));
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
        result.check_against_job(problem.job(), &file).map_err(Failure::input)?;
        problem.problem.check_result(&result, &file).map_err(Failure::input)?;
        let videos = problem.recordings().map(|(path, loaded)| FramePictures::load(path, loaded));
        let videos = videos.collect::<Result<_, _>>()?;
        Ok(Self { name: files::display_name(&problem.folder), problem, result, videos })
    }

    fn measured_recordings(&self) -> Vec<FittedRecording<'_>> {
        let measured = self.problem.measured.iter().zip(&self.videos);
        let measured = measured.map(|(loaded, video)| FittedRecording {
            recording: &loaded.recording,
            file: loaded.file.as_ref(),
            film: video.as_ref().map(FramePictures::as_film),
        });
        measured.collect()
    }

    fn run_best_models(&self) -> Outcome<Vec<ModelRun>> {
        let model = self.problem.problem.fitted_model(&self.result).map_err(Failure::input)?;
        let failure = |why| Failure::Internal(format!("{}: the best model does not run: {why}", self.name));
        let best = run_conditions(self.problem.job(), &model, &self.result).map_err(failure)?;
        for how in best.iter().filter_map(|best| describe_early_end(&best.view.run)) {
            warn_line!("warning: {}: the best model's run ended early: {how}", self.name);
        }
        Ok(best)
    }

    /// The report with its provenance, made by [`assembly::build_report`] or
    /// [`assembly::build_report_without_figures`].
    fn build_report(&self, made: ReportBuilder, best: &[ModelRun]) -> Outcome<Report> {
        let mut report = made(self.problem.job(), &self.measured_recordings(), best, &self.result);
        self.videos.iter().flatten().try_for_each(FramePictures::check_pictures)?;
        for (line, (path, loaded)) in report.recordings.iter_mut().zip(self.problem.recordings()) {
            line.add_findings(loaded.changed_sources(path));
        }
        report.provenance = provenance::collect_provenance(self)?;
        Ok(report)
    }
}

/// Writes the report of a fit. Returns true if the model does not explain the recording or misses a
/// component.
pub(crate) fn write_report(
    fit: &Path,
    out: &Path,
    writer: &WritePolicy,
    global: &GlobalArgs,
) -> Outcome<bool> {
    check_report_folder(out, writer)?;
    let steps = progress::start_steps("report", global.quiet);
    steps.show_step("reading the fit");
    let fit = ReportedFit::load(fit)?;
    steps.show_step("running the model");
    let best = fit.run_best_models()?;
    steps.show_step("comparing and drawing");
    let report = fit.build_report(assembly::build_report, &best)?;
    let verdict = ReportVerdict::from_report(&report);
    let output = ReportFiles {
        figures: report.all_figures().collect(),
        json: report_json(&report).map_err(Failure::internal)?,
        tables: &report.tables,
        page: render_page(&report),
        summary: verdict.summary(),
    };
    drop(steps);
    output.write_to_folder(out, writer, global)?;
    Ok(!verdict.passes())
}

const JSON_FILE: &str = "report.json";
const PAGE_FILE: &str = "index.html";

/// Contents of a report folder.
pub(crate) struct ReportFiles<'a> {
    pub figures: Vec<&'a FigureBlock>,
    pub json: String,
    pub tables: &'a [ComparisonTable],
    pub page: String,
    pub summary: Vec<String>,
}

impl ReportFiles<'_> {
    /// Writes all files or none.
    pub(crate) fn write_to_folder(
        &self,
        folder: &Path,
        writer: &WritePolicy,
        global: &GlobalArgs,
    ) -> Outcome<()> {
        files::write_outputs(folder, writer, &self.to_files())?;
        if !global.quiet {
            self.summary.iter().for_each(|line| print_line!("{line}"));
            print_line!("written to {}", folder.join(PAGE_FILE).display());
        }
        Ok(())
    }

    fn to_files(&self) -> Vec<(String, Vec<u8>)> {
        let figure = |block: &&FigureBlock| match &block.drawing {
            Drawing::Chart(figure) => figure_files(block.file.trim_end_matches(".svg"), figure).to_vec(),

            Drawing::Moving(svg) => vec![(block.file.clone(), svg.clone().into_bytes())],
        };
        let page = [(JSON_FILE, &self.json), (PAGE_FILE, &self.page)]
            .map(|(name, text)| (name.to_owned(), text.clone().into_bytes()));
        let tables = self.tables.iter().map(|t| (t.file.to_owned(), t.text.clone().into_bytes()));
        self.figures.iter().flat_map(figure).chain(tables).chain(page).collect()
    }
}

/// Checks the folder of a report before the model is run.
pub(crate) fn check_report_folder(folder: &Path, writer: &WritePolicy) -> Outcome<()> {
    OutputFolder::check(folder, writer, &[JSON_FILE, PAGE_FILE]).map(|_| ())
}
