//! Comparison of several fits.

use super::{ReportFiles, ReportedFit, default_reports_folder};
use crate::cli::prelude::*;
use crate::cli::report;
use crate::report::assembly;
use crate::report::fit_comparison::{compare_fits, comparison_json, render_page};

/// Maximum length, in bytes, of a folder name that is made from the names of fits; file systems allow longer
/// names.
const LONGEST_NAME: usize = 100;

/// Writes the comparison of fits. Returns true if one of them does not explain its recording or misses a
/// component.
pub(crate) fn write_comparison(
    jobs: &[PathBuf],
    out: Option<&Path>,
    writer: &WritePolicy,
    global: &GlobalArgs,
) -> Outcome<bool> {
    let folders: Vec<&Path> = jobs.iter().map(|job| files::containing_folder(job)).collect();
    check_distinct_fits(&folders)?;
    let out = out.map_or_else(|| default_comparison_folder(&folders), |out| Ok(out.to_owned()))?;
    report::check_report_folder(&out, writer)?;
    let steps = progress::start_steps("report", global.quiet);
    steps.show_step("reading the fits, running and comparing their models");
    let report = |job: &PathBuf| {
        let fit = ReportedFit::load(job)?;
        let best = fit.run_best_models()?;
        Ok((fit.name.clone(), fit.build_report(assembly::build_report_without_figures, &best)?))
    };
    let several = compare_fits(jobs.iter().map(report).collect::<Outcome<_>>()?);
    let output = ReportFiles {
        figures: several.figure.iter().collect(),
        json: comparison_json(&several).map_err(Failure::internal)?,
        tables: &[],
        page: render_page(&several),
        summary: several.summary(),
    };
    drop(steps);
    output.write_to_folder(&out, writer, global)?;
    Ok(!several.passes())
}

/// Refuses a fit that is given twice, and different fits with the same name.
fn check_distinct_fits(fits: &[&Path]) -> Outcome<()> {
    let place = |fit: &Path| fit.canonicalize().unwrap_or_else(|_| fit.to_owned());
    for (i, fit) in fits.iter().enumerate() {
        for other in &fits[..i] {
            if place(fit) == place(other) {
                return Err(Failure::at(
                    fit.display(),
                    "given twice, expected different fits; leave one out",
                ));
            }
            let name = files::display_name(fit);
            if name == files::display_name(other) {
                let (a, b) = (other.display(), fit.display());
                return Err(Failure::Input(format!(
                    "{b}: called `{name}` like {a}, expected fits of different names; rename one of the \
                     folders"
                )));
            }
        }
    }
    Ok(())
}

/// The folder `reports/A-and-B` next to the folder `fits` of the first fit.
fn default_comparison_folder(fits: &[&Path]) -> Outcome<PathBuf> {
    let name = fits.iter().map(|fit| files::display_name(fit)).collect::<Vec<_>>().join("-and-");
    if name.len() > LONGEST_NAME {
        let found = name.len();
        return Err(Failure::Input(format!(
            "FIT: the names of the fits make a folder name of {found} bytes, expected at most \
             {LONGEST_NAME}; name a folder with --out DIR"
        )));
    }
    Ok(fits.first().map(|fit| default_reports_folder(fit)).unwrap_or_default().join(name))
}
