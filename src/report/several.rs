//! Several fits side by side: what each meets, where their parameters agree and where they do not.

mod fitted;
mod intervals;
mod page;
mod shared;
mod spectra;
mod verdict;

pub use fitted::{Entry, Fitted, Several};
pub use page::page;
pub use shared::{Pair, Relation, SharedParameter};

use super::Report;
use super::json::{FORMAT, Listed, Written};
use super::statement::Statement;
use super::verdict::Verdict;
use crate::text;
use serde::Serialize;

/// Compares fits, in the order given.
#[must_use]
pub fn compare(fits: &[Fitted]) -> Several {
    let entry = |fit: &Fitted| Entry {
        name: fit.name.to_owned(),
        report: Report { figures: Vec::new(), ..fit.report.clone() },
        verdict: Verdict::of(fit.report),
    };
    let entries: Vec<Entry> = fits.iter().map(entry).collect();
    let parameters = shared::parameters(&entries);
    let names: Vec<String> = fits.iter().map(|fit| fit.name.to_owned()).collect();
    Several {
        title: format!("Comparison of {}", text::listed(&names)),
        figures: intervals::figures(&entries, &parameters)
            .into_iter()
            .chain(spectra::figures(fits))
            .collect(),
        statements: verdict::statements(&entries, &parameters),
        fits: entries,
        parameters,
    }
}

/// The comparison as JSON, with the verdict of the page and without the drawings.
///
/// # Errors
/// None in practice: every field can be written (a value that is no number becomes `null`).
pub fn several_json(several: &Several) -> Result<String, serde_json::Error> {
    #[derive(Serialize)]
    struct Fit<'a> {
        name: &'a str,
        #[serde(flatten)]
        written: Written<'a>,
    }
    #[derive(Serialize)]
    struct File<'a> {
        format: u32,
        title: &'a str,
        every_model_explains_recording: bool,
        all_components_met: bool,
        all_parameters_identified: bool,
        summary: Vec<String>,
        statements: &'a [Statement],
        parameters: &'a [SharedParameter],
        fits: Vec<Fit<'a>>,
        figures: Vec<Listed<'a>>,
    }
    let file = File {
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
            .map(|fit| Fit { name: &fit.name, written: Written::of(&fit.report, &fit.verdict) })
            .collect(),
        figures: several
            .figures
            .iter()
            .map(|f| Listed { file: &f.file, caption: &f.caption, details: &f.details, subject: None })
            .collect(),
    };
    serde_json::to_string_pretty(&file).map(|text| text + "\n")
}

#[cfg(test)]
mod tests;
