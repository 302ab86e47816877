//! Several fits side by side: what each meets, where their parameters agree and where they do not.

mod fitted;
mod intervals;
mod page;
mod shared;
mod spectra;
mod verdict;

pub use fitted::{ComparedFit, ComparisonInput, FitComparison};
pub use page::render_page;
pub use shared::{IntervalPair, IntervalRelation, SharedParameter};

use super::Report;
use super::json::{FORMAT, FigureEntry, ReportDocument};
use super::statement::Statement;
use super::verdict::ReportVerdict;
use crate::text;
use serde::Serialize;

/// Compares fits, in the order given.
#[must_use]
pub fn compare_fits(fits: &[ComparisonInput]) -> FitComparison {
    let entry = |fit: &ComparisonInput| ComparedFit {
        name: fit.name.to_owned(),
        report: Report { figures: Vec::new(), ..fit.report.clone() },
        verdict: ReportVerdict::from_report(fit.report),
    };
    let entries: Vec<ComparedFit> = fits.iter().map(entry).collect();
    let parameters = shared::shared_parameters(&entries);
    let names: Vec<String> = fits.iter().map(|fit| fit.name.to_owned()).collect();
    FitComparison {
        title: format!("Comparison of {}", text::join_with_and(&names)),
        figures: intervals::interval_figures(&entries, &parameters)
            .into_iter()
            .chain(spectra::spectra_figures(fits))
            .collect(),
        statements: verdict::comparison_statements(&entries, &parameters),
        fits: entries,
        parameters,
    }
}

/// The comparison as JSON, with the verdict of the page and without the drawings.
///
/// # Errors
/// None in practice: every field can be written (a value that is no number becomes `null`).
pub fn comparison_json(several: &FitComparison) -> Result<String, serde_json::Error> {
    #[derive(Serialize)]
    struct ComparedFitDocument<'a> {
        name: &'a str,
        #[serde(flatten)]
        written: ReportDocument<'a>,
    }
    #[derive(Serialize)]
    struct FitComparisonFile<'a> {
        format: u32,
        title: &'a str,
        every_model_explains_recording: bool,
        all_components_met: bool,
        all_parameters_identified: bool,
        summary: Vec<String>,
        statements: &'a [Statement],
        parameters: &'a [SharedParameter],
        fits: Vec<ComparedFitDocument<'a>>,
        figures: Vec<FigureEntry<'a>>,
    }
    let file = FitComparisonFile {
        format: FORMAT,
        title: &several.title,
        every_model_explains_recording: (several.fits.iter()).all(|fit| fit.verdict.model_explains_recording),
        all_components_met: several.all_components_met(),
        all_parameters_identified: several.fits.iter().all(|fit| fit.verdict.all_parameters_identified),
        summary: several.summary(),
        statements: &several.statements,
        parameters: &several.parameters,
        fits: several
            .fits
            .iter()
            .map(|fit| ComparedFitDocument {
                name: &fit.name,
                written: ReportDocument::new(&fit.report, &fit.verdict),
            })
            .collect(),
        figures: several
            .figures
            .iter()
            .map(|f| FigureEntry { file: &f.file, caption: &f.caption, details: &f.details, subject: None })
            .collect(),
    };
    serde_json::to_string_pretty(&file).map(|text| text + "\n")
}

#[cfg(test)]
mod tests;
