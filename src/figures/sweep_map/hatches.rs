//! Why cells have no value, as patterns.

use crate::chart::{Hatch, HatchPattern};
use crate::sweep::{MissingReason, PointOutcome};
use std::collections::BTreeMap;

/// Patterns in the order in which they are given to reasons whose own is taken.
const FALLBACK_PATTERNS: [HatchPattern; 9] = [
    HatchPattern::Dotted,
    HatchPattern::DashedUpright,
    HatchPattern::Dashed,
    HatchPattern::Upright,
    HatchPattern::Level,
    HatchPattern::Falling,
    HatchPattern::Rising,
    HatchPattern::Checked,
    HatchPattern::Crossed,
];

/// The pattern of every reason of a study: two reasons in one study never share one while there are any left.
#[derive(Debug, Clone, Default, PartialEq)]
pub(in crate::figures) struct ReasonPatterns(BTreeMap<MissingReason, HatchPattern>);

impl ReasonPatterns {
    pub fn from_outcomes(outcomes: &[PointOutcome]) -> Self {
        let mut found: Vec<MissingReason> =
            outcomes.iter().flat_map(|outcome| &outcome.values).filter_map(|value| value.err()).collect();
        found.sort_unstable();
        found.dedup();
        Self::for_reasons(&found)
    }

    fn for_reasons(reasons: &[MissingReason]) -> Self {
        let mut given: BTreeMap<MissingReason, HatchPattern> = BTreeMap::new();
        let mut late = Vec::new();
        for reason in reasons {
            let own = default_pattern(*reason);
            if given.values().any(|taken| *taken == own) {
                late.push(*reason);
            } else {
                given.insert(*reason, own);
            }
        }
        for reason in late {
            let free =
                FALLBACK_PATTERNS.into_iter().find(|pattern| given.values().all(|taken| taken != pattern));
            given.insert(reason, free.unwrap_or(default_pattern(reason)));
        }
        Self(given)
    }

    /// One hatch for each reason of a map that occurs, in the order of the table of reasons; `cell` gives the
    /// place of a point.
    pub fn reason_hatches(
        &self,
        reasons: &[Option<MissingReason>],
        cell: impl Fn(usize) -> Option<[f64; 4]>,
    ) -> Vec<Hatch> {
        let hatch = |reason: MissingReason| {
            let points = reasons.iter().enumerate().filter(|(_, found)| **found == Some(reason));
            let cells: Vec<[f64; 4]> = points.filter_map(|(index, _)| cell(index)).collect();
            let pattern = self.0.get(&reason).copied().unwrap_or(default_pattern(reason));
            Hatch { label: reason.meaning().to_owned(), pattern, cells }
        };
        MissingReason::all().map(hatch).filter(|hatch| !hatch.cells.is_empty()).collect()
    }
}

/// The pattern of a reason where no other of the study has it. None is plain grey: printed without colours it
/// would look like a value.
fn default_pattern(reason: MissingReason) -> HatchPattern {
    match reason {
        MissingReason::ContactLost => HatchPattern::Rising,
        MissingReason::Jammed => HatchPattern::Falling,
        MissingReason::Indeterminate => HatchPattern::Upright,
        MissingReason::NoStart => HatchPattern::Level,
        MissingReason::Chattering | MissingReason::Diverged | MissingReason::WorkLimit => {
            HatchPattern::Crossed
        }
        MissingReason::NoComponent
        | MissingReason::Never
        | MissingReason::NoDecay
        | MissingReason::Faded
        | MissingReason::FewCycles => HatchPattern::Dotted,
        _ => HatchPattern::Checked,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reasons_of_one_study_differ_and_keep_their_usual_pattern_where_it_is_free() {
        let reasons = [
            MissingReason::ContactLost,
            MissingReason::Diverged,
            MissingReason::NoComponent,
            MissingReason::NoDecay,
        ];
        let patterns = ReasonPatterns::for_reasons(&reasons);
        let given: Vec<HatchPattern> = reasons.iter().map(|reason| patterns.0[reason]).collect();
        assert_eq!(given[..3], [HatchPattern::Rising, HatchPattern::Crossed, HatchPattern::Dotted]);
        assert!(!given[..3].contains(&given[3]));
        let nine: Vec<MissingReason> = MissingReason::all().take(9).collect();
        let patterns = ReasonPatterns::for_reasons(&nine);
        let mut given: Vec<String> = patterns.0.values().map(|pattern| format!("{pattern:?}")).collect();
        given.sort_unstable();
        given.dedup();
        assert_eq!(given.len(), 9);
    }
}
