//! Results as figures and pages: data structures in; SVG, HTML and JSON text out.

pub mod assembly;
pub mod fit_comparison;
pub mod json;
pub mod page;
pub mod rich_text;
pub mod summary;
pub mod verdict;
mod view_model;

use crate::compare::{ComparisonSummary, ComparisonTable, ParameterLine, RunSummary, TargetComparison};
use crate::figures::FigureBlock;
use crate::figures::friction::FrictionLine;
use crate::fit::findings::FitFinding;
use crate::fit::law::LawComparison;
use crate::fit::misfit::TraceMisfit;
use crate::fit::result::NuisanceResult;
use crate::stability::chatter::ChatterSummary;
use serde::Serialize;
pub(crate) use summary::{ReportSummary, SummaryQuantity};
pub(crate) use view_model::{
    CombinationLine, FailureCount, ProbeLine, Provenance, RecordingLine, SearchLine, SourceFile,
};

/// The report of a fit. Sections without content are left out of the page.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Report {
    /// Heading: the title of the job.
    pub title: String,
    /// Outcome of the search.
    pub search: SearchLine,
    /// Misfit of the model to the traces; `None` in a fit to features only.
    pub misfit: Option<TraceMisfit>,
    /// Why the model does not explain the traces, and what would explain them.
    pub findings: Vec<FitFinding>,
    /// Estimated errors of the cameras, and estimates of constants of the scene that the job also fits.
    pub nuisances: Vec<NuisanceResult>,
    /// The recordings; empty if only published numbers were fitted.
    pub recordings: Vec<RecordingLine>,
    /// Frequencies of components: target and model.
    pub components: Vec<TargetComparison>,
    /// Other features: target and model.
    pub features: Vec<TargetComparison>,
    /// Components and features that were held out of the fit, and so are predicted.
    pub held_out: Vec<TargetComparison>,
    /// The fitted parameters.
    pub parameters: Vec<ParameterLine>,
    /// Friction of the best model at rest and at the largest speed of the tip.
    pub friction: Vec<FrictionLine>,
    /// Which law of friction the traces support.
    pub law: Option<LawComparison>,
    /// Where and why the fitted blade or slider chatters.
    pub chatter: Option<ChatterSummary>,
    /// Products of powers of the parameters. Each line says whether the features determine the product.
    pub combinations: Vec<CombinationLine>,
    /// Advice on additional measurements, one sentence each.
    pub advice: Vec<String>,
    /// Summary of the run of the best model in each condition.
    pub runs: Vec<RunSummary>,
    /// Each recording compared with the model.
    pub comparison: Vec<ComparisonSummary>,
    /// Results of the identifiability check before the search (the gate), one per tested point of the search
    /// box.
    pub gate: Vec<ProbeLine>,
    /// Notes of the identifiability check before the search (the gate), one sentence each.
    pub gate_notes: Vec<String>,
    /// Figures in the order of the page.
    #[serde(skip)]
    pub figures: Vec<FigureGroup>,
    /// Tables of the comparison, as files.
    #[serde(skip)]
    pub tables: Vec<ComparisonTable>,
    /// Reservations about the results, one sentence each.
    pub notes: Vec<String>,
    /// Files, version and commands from which the numbers were obtained.
    pub provenance: Provenance,
}

/// Figures under one heading.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FigureGroup {
    /// Subject of the group.
    pub subject: FigureSubject,
    /// The figures in order.
    pub figures: Vec<FigureBlock>,
}

/// Subject of a group of figures; it determines the place of the group on the page.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum FigureSubject {
    /// Evidence for the answer at the top: recording and model, friction, residuals, parameters.
    Evidence,
    /// All measurements compared with the model.
    #[default]
    Measured,
    /// Motion of the blade of the best model.
    Blade,
    /// Parameters of the fit.
    Parameters,
}

impl Report {
    /// Whether any recording is synthetic.
    pub(crate) fn is_synthetic(&self) -> bool {
        self.recordings.iter().any(|r| r.synthetic)
    }

    /// Every figure, in the order of the page.
    pub fn all_figures(&self) -> impl Iterator<Item = &FigureBlock> {
        self.figures.iter().flat_map(|group| &group.figures)
    }
}
