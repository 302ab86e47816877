//! `wiperlab demo`: the whole pipeline on the bundled synthetic recording.

use super::args::parse_count;
use super::fit::print_summary;
use super::import::import_into;
use super::job::LoadedJob;
use super::prelude::*;
use super::progress::print_progress;
use super::report;
use super::spectrum::SpectrumArgs;
use crate::fit::result::{FitResult, FitStatus};
use crate::import::source::ImportSource;
use crate::import::{CoordinateScale, ImportOptions};
use crate::recording::files::{DESCRIPTION_FILE, TRACE_FILE, YAxis};
use crate::simulate::twin::SYNTHETIC_TRACK_NAMES;

const NAME: &str = "actual-blade-twin";
const EXPORT: &str = "synthetic-tracker-export.txt";
const EXPORT_TEXT: &str = include_str!("../../data/actual-blade-twin/synthetic-tracker-export.txt");
const TWIN: &str = include_str!("../../data/actual-blade-twin/twin.toml");
const SCENE: &str = include_str!("../../data/scenes/actual-blade.toml");
const JOB: &str = include_str!("../../fits/actual-blade-twin/job.toml");

/// Folder, channel and window of each of the two spectra of the demo.
const SPECTRA: [(&str, &str, &str); 2] =
    [("low", "head-drop", "release+0.01..release+0.2"), ("high", "deflection", "release+0.01..release+0.1")];

#[derive(Debug, Args)]
pub(crate) struct DemoArgs {
    /// Folder for everything that the demo makes
    #[arg(long, default_value = "demo", value_name = "DIR")]
    pub out: PathBuf,
    /// Maximum number of iterates of the fit; fewer are faster but less accurate (default: until it has
    /// converged)
    #[arg(long, value_name = "N", value_parser = parse_count, allow_negative_numbers = true)]
    pub max_evaluations: Option<usize>,
    #[command(flatten)]
    pub overwrite: Overwrite,
}

impl DemoArgs {
    pub(crate) fn run(&self, global: &GlobalArgs) -> Outcome {
        self.check_outputs()?;
        let quiet = GlobalArgs { quiet: true, ..global.clone() };
        let data = self.out.join("data").join(NAME);
        print_progress(global.quiet, &format!("1/4 import    {EXPORT} -> {}", data.display()));
        self.write_bundled_files()?;
        import_export(&data, self.overwrite)?;

        print_progress(global.quiet, "2/4 spectrum  of the head's drop (low) and of the deflection (high)");
        for (name, channel, window) in SPECTRA {
            SpectrumArgs::new(&data, channel, window, &self.out.join("spectra").join(name), self.overwrite)
                .run(&quiet)?;
        }

        let fit = self.out.join("fits").join(NAME);
        let job = fit.join("job.toml");
        print_progress(global.quiet, &format!("3/4 fit       {} (some ten seconds)", job.display()));
        let problem = LoadedJob::load(&job)?;

        let solved = problem.solve(global, false, self.max_evaluations, self.overwrite)?;
        if solved.result.status == FitStatus::Interrupted {
            return Ok(CommandOutcome::StoppedEarly);
        }

        let page = self.out.join("reports").join(NAME);
        print_progress(global.quiet, &format!("4/4 report    {}", page.join("index.html").display()));
        let writer = global.write_policy(OutputCommand::Report, self.overwrite);
        let missed = report::write_report(&fit, &page, &writer, &quiet)?;

        if !global.quiet {
            print_summary(&solved);
            print_truth(&solved.result)?;
            print_line!("open {}", page.join("index.html").display());
        }
        Ok(CommandOutcome::done_if(!missed && solved.result.status == FitStatus::Converged))
    }

    /// Checks, before any file is written, that all four steps of the demo may write their outputs.
    fn check_outputs(&self) -> Outcome<()> {
        let steps: [(OutputCommand, &str, &[&str]); 4] = [
            (OutputCommand::Import, "data", &[TRACE_FILE, DESCRIPTION_FILE, EXPORT]),
            (OutputCommand::Fit, "fits", &[files::RESULT_FILE]),
            (OutputCommand::Report, "reports", &["index.html", "report.json"]),
            (OutputCommand::Demo, "fits", &["job.toml"]),
        ];
        steps.iter().try_for_each(|(maker, folder, names)| {
            let writer = WritePolicy::new(*maker, self.overwrite);
            OutputFolder::check(&self.out.join(folder).join(NAME), &writer, names).map(|_| ())
        })
    }

    /// Writes the bundled export, scene and job, in the layout of a project.
    fn write_bundled_files(&self) -> Outcome<()> {
        let writer = WritePolicy::new(OutputCommand::Demo, self.overwrite);
        let write = |folder: PathBuf, name: &str, text: &str| {
            files::write_outputs(&folder, &writer, &[(name, text.as_bytes().to_vec())])
        };

        write(self.out.join("data").join("scenes"), "actual-blade.toml", SCENE)?;
        write(self.out.join("fits").join(NAME), "job.toml", JOB)
    }
}

/// Imports the bundled export like `wiperlab import`, with its scale and frame rate.
fn import_export(folder: &Path, overwrite: Overwrite) -> Outcome<()> {
    let [tip, head] = SYNTHETIC_TRACK_NAMES;
    let options = ImportOptions {
        name: NAME.to_owned(),
        frame_rate_hz: Some(5000.0),
        scale: Some(CoordinateScale::parse("20um/px").map_err(Failure::internal)?),
        y_axis: Some(YAxis::Up),
        exposure_s: Some(5e-5),
        tip: Some(tip.to_owned()),
        head: Some(head.to_owned()),
        twin: Some(("twin.toml".to_owned(), TWIN.to_owned())),
        ..ImportOptions::default()
    };
    let export = ImportSource::without_companions(EXPORT, EXPORT_TEXT.as_bytes().to_vec());
    import_into(folder, &[export], &options, overwrite)
}

/// Prints the true parameters of the synthetic recording next to the estimates.
fn print_truth(result: &FitResult) -> Outcome<()> {
    let twin: toml::Table = TWIN.parse().map_err(Failure::internal)?;
    let truth = twin.get("truth").and_then(toml::Value::as_table);
    print_line!("parameter                                estimate        truth  in the interval");
    for (name, p) in &result.parameters {
        let Some(truth) = truth.and_then(|t| t.get(name)).and_then(toml::Value::as_float) else { continue };
        let inside = p.lower_95.is_some_and(|l| l <= truth) && p.upper_95.is_some_and(|u| truth <= u);
        print_line!("{name:<36} {:>12.6} {truth:>12.6}  {}", p.estimate, if inside { "yes" } else { "no" });
    }
    Ok(())
}
