//! Why cells have no value, as patterns.

use crate::chart::{Hatch, Pattern};
use crate::sweep::{Outcome, Reason};
use std::collections::BTreeMap;

/// Patterns in the order in which they are given to reasons whose own is taken.
const PATTERNS: [Pattern; 9] = [
    Pattern::Dotted,
    Pattern::DashedUpright,
    Pattern::Dashed,
    Pattern::Upright,
    Pattern::Level,
    Pattern::Falling,
    Pattern::Rising,
    Pattern::Checked,
    Pattern::Crossed,
];

/// The pattern of every reason of a study: two reasons in one study never share one while there are any left.
#[derive(Debug, Clone, Default, PartialEq)]
pub(in crate::figures) struct Patterns(BTreeMap<Reason, Pattern>);

impl Patterns {
    pub fn of(outcomes: &[Outcome]) -> Self {
        let mut found: Vec<Reason> =
            outcomes.iter().flat_map(|outcome| &outcome.values).filter_map(|value| value.err()).collect();
        found.sort_unstable();
        found.dedup();
        Self::for_reasons(&found)
    }

    fn for_reasons(reasons: &[Reason]) -> Self {
        let mut given: BTreeMap<Reason, Pattern> = BTreeMap::new();
        let mut late = Vec::new();
        for reason in reasons {
            let own = usual(*reason);
            if given.values().any(|taken| *taken == own) {
                late.push(*reason);
            } else {
                given.insert(*reason, own);
            }
        }
        for reason in late {
            let free = PATTERNS.into_iter().find(|pattern| given.values().all(|taken| taken != pattern));
            given.insert(reason, free.unwrap_or(usual(reason)));
        }
        Self(given)
    }

    /// One hatch for each reason of a map that occurs, in the order of the table of reasons; `cell` gives the
    /// place of a point.
    pub fn hatches(
        &self,
        reasons: &[Option<Reason>],
        cell: impl Fn(usize) -> Option<[f64; 4]>,
    ) -> Vec<Hatch> {
        let hatch = |reason: Reason| {
            let points = reasons.iter().enumerate().filter(|(_, found)| **found == Some(reason));
            let cells: Vec<[f64; 4]> = points.filter_map(|(index, _)| cell(index)).collect();
            let pattern = self.0.get(&reason).copied().unwrap_or(usual(reason));
            Hatch { label: reason.meaning().to_owned(), pattern, cells }
        };
        Reason::all().map(hatch).filter(|hatch| !hatch.cells.is_empty()).collect()
    }
}

/// The pattern of a reason where no other of the study has it. None is plain grey: printed without colours it
/// would look like a value.
fn usual(reason: Reason) -> Pattern {
    match reason {
        Reason::ContactLost => Pattern::Rising,
        Reason::Jammed => Pattern::Falling,
        Reason::Indeterminate => Pattern::Upright,
        Reason::NoStart => Pattern::Level,
        Reason::Chattering | Reason::Diverged | Reason::WorkLimit => Pattern::Crossed,
        Reason::NoComponent | Reason::Never | Reason::NoDecay | Reason::Faded | Reason::FewCycles => {
            Pattern::Dotted
        }
        _ => Pattern::Checked,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reasons_of_one_study_differ_and_keep_their_usual_pattern_where_it_is_free() {
        let reasons = [Reason::ContactLost, Reason::Diverged, Reason::NoComponent, Reason::NoDecay];
        let patterns = Patterns::for_reasons(&reasons);
        let given: Vec<Pattern> = reasons.iter().map(|reason| patterns.0[reason]).collect();
        assert_eq!(given[..3], [Pattern::Rising, Pattern::Crossed, Pattern::Dotted]);
        assert!(!given[..3].contains(&given[3]));
        let nine: Vec<Reason> = Reason::all().take(9).collect();
        let patterns = Patterns::for_reasons(&nine);
        let mut given: Vec<String> = patterns.0.values().map(|pattern| format!("{pattern:?}")).collect();
        given.sort_unstable();
        given.dedup();
        assert_eq!(given.len(), 9);
    }
}
