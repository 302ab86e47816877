//! Comparison of several fits: what each of them explains, and the agreement of their parameters.

mod intervals;
mod page;

use super::json::{FORMAT, FigureEntry, ReportDocument};
use super::rich_text::{Sentence, Statement};
use super::verdict::ReportVerdict;
use super::{Report, summary};
use crate::compare::ParameterLine;
use crate::figures::FigureBlock;
use crate::fit::uncertainty::ParameterVerdict;
use crate::model::parameters::describe_parameters;
use crate::text::{join_with_and, pluralise, truncate_text};
pub(crate) use page::render_page;
use serde::Serialize;

/// Compares fits, each with the name of its folder, in the order given.
#[must_use]
pub fn compare_fits(fits: Vec<(String, Report)>) -> FitComparison {
    let entry = |(name, report)| {
        let verdict = ReportVerdict::from_report(&report);
        ComparedFit { name, verdict, report: Report { figures: Vec::new(), ..report } }
    };
    let fits: Vec<ComparedFit> = fits.into_iter().map(entry).collect();
    let parameters = shared_parameters(&fits);
    let names: Vec<String> = fits.iter().map(|fit| fit.name.clone()).collect();
    FitComparison {
        title: format!("Comparison of {}", join_with_and(&names)),
        figure: intervals::interval_figure(&fits, &parameters),
        statements: comparison_statements(&fits, &parameters),
        fits,
        parameters,
    }
}

fn comparison_statements(fits: &[ComparedFit], parameters: &[SharedParameter]) -> Vec<Statement> {
    let passing = fits.iter().filter(|fit| fit.verdict.passes()).count();
    let words = format!("{passing} of {} fits explain what they were fitted to", fits.len());
    let line = |fit: &ComparedFit| {
        let headline = summary::report_headline(&fit.report).statement;
        Sentence::default().with_name(&fit.name).with_words(": ").with_sentence(headline)
    };
    let all = Statement::with_details(words, fits.iter().map(line).collect(), Some(passing == fits.len()));
    let count =
        |p: &SharedParameter, relation| p.pairs.iter().filter(|pair| pair.relation == relation).count();
    let total = |relation| parameters.iter().map(|p| count(p, relation)).sum::<usize>();
    let apart = total(IntervalRelation::Disjoint);
    let comparable = apart + total(IntervalRelation::Overlap);
    let detail = |p: &SharedParameter| {
        let pairs = count(p, IntervalRelation::Disjoint);
        let words = format!(", in {pairs} {}", pluralise("pair", pairs));
        (pairs > 0)
            .then(|| Sentence::default().with_name(&describe_parameters([p.name.as_str()])).with_words(words))
    };
    let words = match comparable {
        0 => "No two of the fits determine the same parameter".to_owned(),
        _ => format!(
            "95 % intervals do not overlap in {apart} of {comparable} pairs of estimates that can be compared"
        ),
    };
    vec![all, Statement::with_details(words, parameters.iter().filter_map(detail).collect(), None)]
}

/// The comparison as JSON, with the verdict of the page and without the drawings.
///
/// # Errors
/// None in practice: every field can be serialised, and NaN becomes `null`.
pub(crate) fn comparison_json(several: &FitComparison) -> Result<String, serde_json::Error> {
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
    fn document(fit: &ComparedFit) -> ComparedFitDocument<'_> {
        ComparedFitDocument { name: &fit.name, written: ReportDocument::new(&fit.report, &fit.verdict) }
    }
    let every = |is: fn(&ReportVerdict) -> bool| several.fits.iter().all(|fit| is(&fit.verdict));
    let file = FitComparisonFile {
        format: FORMAT,
        title: &several.title,
        every_model_explains_recording: every(|verdict| verdict.model_explains_recording),
        all_components_met: every(|verdict| verdict.all_components_met),
        all_parameters_identified: every(|verdict| verdict.all_parameters_identified),
        summary: several.summary(),
        statements: &several.statements,
        parameters: &several.parameters,
        fits: several.fits.iter().map(document).collect(),
        figures: several.figure.iter().map(|figure| FigureEntry::new(figure, None)).collect(),
    };
    serde_json::to_string_pretty(&file).map(|text| text + "\n")
}

/// A comparison of fits.
#[derive(Debug, Clone, PartialEq)]
pub struct FitComparison {
    /// Heading.
    pub title: String,
    /// The fits, without their figures.
    pub fits: Vec<ComparedFit>,
    /// Every parameter that is free in any of the fits.
    pub parameters: Vec<SharedParameter>,
    /// The estimates with their intervals; `None` if no two fits share a parameter.
    pub figure: Option<FigureBlock>,
    /// Results of the comparison, in words.
    pub statements: Vec<Statement>,
}

/// A fit of a comparison.
#[derive(Debug, Clone, PartialEq)]
pub struct ComparedFit {
    /// Name of the folder of the fit.
    pub name: String,
    /// The report of the fit.
    pub report: Report,
    /// The verdict on the fit.
    pub verdict: ReportVerdict,
}

impl FitComparison {
    /// The statements of the comparison as lines of text.
    pub(crate) fn summary(&self) -> Vec<String> {
        self.statements.iter().map(Statement::plain_text).collect()
    }

    /// Whether every model explains its traces and meets all of its components.
    pub(crate) fn passes(&self) -> bool {
        self.fits.iter().all(|fit| fit.verdict.passes())
    }
}

/// A name cut to the width of a panel title or legend.
pub(super) fn shorten_name(name: &str) -> String {
    /// Maximum number of letters in the legend of a figure that is one column wide.
    const MOST: usize = 24;
    truncate_text(name, MOST)
}

/// A parameter with its estimates in all fits.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SharedParameter {
    /// Name as in a scene.
    pub name: String,
    /// Symbol in the equations.
    pub symbol: String,
    /// Unit; empty for a plain number.
    pub unit: String,
    /// Estimates in the order of the fits; `None` if the parameter is not free in a fit.
    pub lines: Vec<Option<ParameterLine>>,
    /// Pairs of fits in which the parameter is free.
    pub pairs: Vec<IntervalPair>,
}

/// The intervals of one parameter in two fits.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct IntervalPair {
    /// Names of the fits.
    pub fits: [String; 2],
    /// Relation of the 95 % intervals of the two fits.
    pub relation: IntervalRelation,
}

/// Relation of two 95 % intervals.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum IntervalRelation {
    /// The intervals have no value in common.
    Disjoint,
    /// The intervals have values in common; this does not show that the parameters are equal.
    Overlap,
    /// In one of the fits the parameter is not identified or at a bound, so that its interval does not
    /// reflect the data.
    NotComparable,
}

/// Verdicts for which the interval of a parameter reflects the data; an open end then extends to infinity.
const COMPARABLE_VERDICTS: [ParameterVerdict; 3] =
    [ParameterVerdict::Identified, ParameterVerdict::OpenBelow, ParameterVerdict::OpenAbove];

/// Relation of the intervals of two estimates.
pub(super) fn interval_relation(a: &ParameterLine, b: &ParameterLine) -> IntervalRelation {
    let comparable = |p: &ParameterLine| COMPARABLE_VERDICTS.contains(&p.verdict);
    let below = |a: &ParameterLine, b: &ParameterLine| {
        a.upper_95.zip(b.lower_95).is_some_and(|(upper, lower)| upper < lower)
    };
    match comparable(a) && comparable(b) {
        false => IntervalRelation::NotComparable,
        true if below(a, b) || below(b, a) => IntervalRelation::Disjoint,
        true => IntervalRelation::Overlap,
    }
}

/// Every parameter of any fit, in order of first appearance.
pub(super) fn shared_parameters(entries: &[ComparedFit]) -> Vec<SharedParameter> {
    let mut named: Vec<&ParameterLine> = Vec::new();
    for line in entries.iter().flat_map(|entry| &entry.report.parameters) {
        if !named.iter().any(|known| known.name == line.name) {
            named.push(line);
        }
    }
    named.into_iter().map(|of| shared_parameter(of, entries)).collect()
}

fn shared_parameter(of: &ParameterLine, entries: &[ComparedFit]) -> SharedParameter {
    let find = |entry: &ComparedFit| entry.report.parameters.iter().find(|p| p.name == of.name).cloned();
    let lines: Vec<Option<ParameterLine>> = entries.iter().map(find).collect();
    let fits = entries.iter().zip(&lines);
    let having: Vec<(&str, &ParameterLine)> =
        fits.filter_map(|(entry, line)| Some((entry.name.as_str(), line.as_ref()?))).collect();
    let mut pairs = Vec::new();
    for (i, (name, a)) in having.iter().enumerate() {
        let with = |(other, b): &(&str, &ParameterLine)| IntervalPair {
            fits: [*name, *other].map(str::to_owned),
            relation: interval_relation(a, b),
        };
        pairs.extend(having[i + 1..].iter().map(with));
    }
    SharedParameter { name: of.name.clone(), symbol: of.symbol.clone(), unit: of.unit.clone(), lines, pairs }
}

#[cfg(test)]
mod tests;
