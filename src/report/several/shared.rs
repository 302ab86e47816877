//! Parameters of several fits side by side, and whether their intervals overlap.

use super::fitted::ComparedFit;
use crate::compare::ParameterLine;
use crate::fit::uncertainty::ParameterVerdict;
use serde::Serialize;

/// A parameter and what each fit knows of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SharedParameter {
    /// Name as in a scene.
    pub name: String,
    /// Symbol in the equations.
    pub symbol: String,
    /// Unit; empty for a plain number.
    pub unit: String,
    /// What each fit knows, in the order of the fits; `None` where it is not free there.
    pub lines: Vec<Option<ParameterLine>>,
    /// Every pair of fits that have it.
    pub pairs: Vec<IntervalPair>,
}

/// Two fits and one parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct IntervalPair {
    /// Names of the fits.
    pub fits: [String; 2],
    /// How their 95 % intervals lie.
    pub relation: IntervalRelation,
}

/// How two 95 % intervals lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum IntervalRelation {
    /// They have no value in common.
    Disjoint,
    /// They have values in common, which does not show that the parameters are equal.
    Overlap,
    /// The interval of one of them does not say what the data know: it is not identified, or at a bound.
    NotComparable,
}

impl IntervalRelation {
    /// In words.
    pub(super) fn describe(self) -> &'static str {
        match self {
            Self::Disjoint => "do not overlap",
            Self::Overlap => "overlap",
            Self::NotComparable => "cannot be compared",
        }
    }
}

/// Verdicts whose interval is one of the data: an open end reaches beyond every value.
const COMPARABLE_VERDICTS: [ParameterVerdict; 3] =
    [ParameterVerdict::Identified, ParameterVerdict::OpenBelow, ParameterVerdict::OpenAbove];

/// How the intervals of two estimates lie.
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

/// Every parameter of any fit, in the order in which they appear.
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
    let lines: Vec<Option<ParameterLine>> = entries
        .iter()
        .map(|entry| entry.report.parameters.iter().find(|p| p.name == of.name).cloned())
        .collect();
    let having: Vec<(&str, &ParameterLine)> = entries
        .iter()
        .zip(&lines)
        .filter_map(|(entry, line)| Some((entry.name.as_str(), line.as_ref()?)))
        .collect();
    let pair = |(i, (name, a)): (usize, &(&str, &ParameterLine))| {
        let (name, a) = ((*name).to_owned(), (*a).clone());
        let with = |(other, b): &(&str, &ParameterLine)| IntervalPair {
            fits: [name.clone(), (*other).to_owned()],
            relation: interval_relation(&a, b),
        };
        having.iter().skip(i + 1).map(with).collect::<Vec<_>>()
    };
    let pairs = having.iter().enumerate().flat_map(pair).collect();
    SharedParameter { name: of.name.clone(), symbol: of.symbol.clone(), unit: of.unit.clone(), lines, pairs }
}
