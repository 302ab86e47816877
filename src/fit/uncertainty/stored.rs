//! The verdicts that the numbers of a stored result deserve.

use super::bound::strongest_bound_correlation;
use super::{ParameterVerdict, interval_verdict};
use crate::fit::job::Job;
use crate::fit::result::{FitResult, FitStatus};

/// One a parameter, in job order, by the same rules as in a fit; a parameter that the result does not have is
/// not identified.
pub(in crate::fit) fn stored_verdicts(job: &Job, result: &FitResult) -> Vec<ParameterVerdict> {
    let names = job.parameter_names();
    let found = |axis: usize| result.parameters.get(&names[axis]);
    // the linear model gives a correlation to every parameter that it determines, with itself too
    let correlation = |a: usize, b: usize| result.correlations.get(&names[a])?.get(&names[b]).copied();
    let unit: Vec<f64> = (job.parameters.iter().enumerate())
        .map(|(axis, free)| found(axis).map_or(0.5, |p| free.bounds.to_unit(p.estimate)))
        .collect();
    let of = |axis: usize| {
        let Some(p) = found(axis) else { return ParameterVerdict::NotIdentified };
        match interval_verdict(unit[axis], p.lower_95, p.upper_95, correlation(axis, axis).is_some()) {
            // a search that had not come to its end identifies nothing
            _ if matches!(result.status, FitStatus::BudgetExhausted | FitStatus::Failed) => {
                ParameterVerdict::NotIdentified
            }
            ParameterVerdict::Identified if !p.reasons.is_empty() => ParameterVerdict::NotIdentified,
            ParameterVerdict::Identified
                if strongest_bound_correlation(axis, &unit, correlation).is_some() =>
            {
                ParameterVerdict::NotIdentified
            }
            other => other,
        }
    };
    (0..names.len()).map(of).collect()
}
