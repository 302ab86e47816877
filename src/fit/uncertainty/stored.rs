//! The verdicts that the numbers of a stored result deserve.

use super::bound::followed;
use super::{Verdict, verdict};
use crate::fit::job::Job;
use crate::fit::result::{FitResult, Status};

/// One a parameter, in job order, by the same rules as in a fit; a parameter that the result does not have is
/// not identified.
pub(in crate::fit) fn stored_verdicts(job: &Job, result: &FitResult) -> Vec<Verdict> {
    let names = job.parameter_names();
    let found = |axis: usize| result.parameters.get(&names[axis]);
    // the linear model gives a correlation to every parameter that it determines, with itself too
    let correlation = |a: usize, b: usize| result.correlations.get(&names[a])?.get(&names[b]).copied();
    let unit: Vec<f64> = (job.parameters.iter().enumerate())
        .map(|(axis, free)| found(axis).map_or(0.5, |p| free.bounds.to_unit(p.estimate)))
        .collect();
    let of = |axis: usize| {
        let Some(p) = found(axis) else { return Verdict::NotIdentified };
        match verdict(unit[axis], p.lower_95, p.upper_95, correlation(axis, axis).is_some()) {
            // a search that had not come to its end identifies nothing
            _ if matches!(result.status, Status::BudgetExhausted | Status::Failed) => Verdict::NotIdentified,
            Verdict::Identified if !p.reasons.is_empty() => Verdict::NotIdentified,
            Verdict::Identified if followed(axis, &unit, correlation).is_some() => Verdict::NotIdentified,
            other => other,
        }
    };
    (0..names.len()).map(of).collect()
}
