//! The fits that are compared, and what the comparison holds.

use super::shared::SharedParameter;
use crate::compare::{FittedRecording, ModelRun};
use crate::figures::FigureBlock;
use crate::fit::job::Job;
use crate::report::Report;
use crate::report::statement::Statement;
use crate::report::verdict::ReportVerdict;
use crate::text;

/// A fit with everything that it is compared by.
#[derive(Debug, Clone, Copy)]
pub struct ComparisonInput<'a> {
    /// Name of its folder.
    pub name: &'a str,
    /// What its own report says.
    pub report: &'a Report,
    /// Its job.
    pub job: &'a Job,
    /// Its recordings: those of the first conditions.
    pub measured: &'a [FittedRecording<'a>],
    /// Its best model, condition by condition.
    pub best: &'a [ModelRun],
}

/// A comparison of fits.
#[derive(Debug, Clone, PartialEq)]
pub struct FitComparison {
    /// Heading.
    pub title: String,
    /// The fits, without figures of their own.
    pub fits: Vec<ComparedFit>,
    /// Every parameter of any of them.
    pub parameters: Vec<SharedParameter>,
    /// Figures in the order of the page.
    pub figures: Vec<FigureBlock>,
    /// What the comparison says, in words.
    pub statements: Vec<Statement>,
}

/// A fit of a comparison.
#[derive(Debug, Clone, PartialEq)]
pub struct ComparedFit {
    /// Name of its folder.
    pub name: String,
    /// What its own report says.
    pub report: Report,
    /// The verdict on it.
    pub verdict: ReportVerdict,
}

impl FitComparison {
    /// The statements as lines of text.
    #[must_use]
    pub fn summary(&self) -> Vec<String> {
        self.statements.iter().map(Statement::plain_text).collect()
    }

    /// Whether every component is met in every fit.
    #[must_use]
    pub fn all_components_met(&self) -> bool {
        self.fits.iter().all(|fit| fit.verdict.all_components_met)
    }

    /// Whether every model explains its traces and meets every component.
    #[must_use]
    pub fn passes(&self) -> bool {
        self.fits.iter().all(|fit| fit.verdict.passes())
    }
}

/// A name that fits over a panel or into a legend.
pub(super) fn shorten_name(name: &str) -> String {
    /// Letters that a legend of one column of a journal takes.
    const MOST: usize = 24;
    text::truncate_text(name, MOST)
}
