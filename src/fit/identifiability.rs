//! Identifiability before the search: which parameters the features can determine, given their noise. It is
//! assessed at a few points of the search box (probes).
//!
//! At each probe the model is differentiated along every parameter by finite differences. A fit is refused
//! only if the model fails at all probes, if no feature has a value at any probe, or if no parameter changes
//! any feature. All other findings become notes in the result.

use super::FitError;
use super::evaluation::{Evaluation, EvaluationStage, Observed, map_names};
use super::ledger::Ledger;
use super::linear_model::{
    FeatureSlopes, ParameterCombination, SingularDirections, difference_points, feature_scatter, jacobian,
};
use super::target_value::TargetValue;
use crate::text::format_short;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Number of probes: the middle of the box and points of a Halton sequence around it.
pub(crate) const PROBE_COUNT: usize = 5;
/// Fraction of each side of the box, centred on the middle, in which the probes are placed. Near the corners
/// of the box the model rarely runs.
const INNER_BOX: f64 = 0.7;

/// Result at one probe.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Probe {
    /// Parameter values, in SI units.
    pub values: BTreeMap<String, f64>,
    /// Failure of the model, if any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
    /// Number of features that have a value at this probe.
    pub features_seen: usize,
    /// Number of directions in the parameter space that the features determine.
    pub rank: usize,
    /// Condition number of the Jacobian: ratio of the largest to the smallest singular value; `None` if it is
    /// infinite.
    pub condition: Option<f64>,
    /// Names of the parameters that the features determine at this probe.
    pub determines: Vec<String>,
}

/// Identifiability of a job before its search.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Identifiability {
    /// The probes.
    pub probes: Vec<Probe>,
    /// Combinations of parameters that are determined or left undetermined at the probe whose features are
    /// nearest to the targets.
    pub combinations: Vec<ParameterCombination>,
    /// Scatter of each feature of the model between neighbouring points, in the unit of the feature: the
    /// median over the probes. It is added to the standard deviation of the target, because a search cannot
    /// resolve a smaller change.
    pub scatter: Vec<f64>,
    /// Remarks for the reader, one sentence each.
    pub notes: Vec<String>,
    /// Advice on additional measurements, one sentence each.
    pub advice: Vec<String>,
}

/// A probe with the evaluation and the linear model at this point.
#[derive(Debug, Clone)]
pub(crate) struct ProbeEvaluation {
    pub centre: Evaluation,
    pub directions: SingularDirections,
    /// Scatter of each feature of the model between neighbouring points at the probe, in the unit of the
    /// feature.
    scatter: Vec<Option<f64>>,
}

/// Evaluates the probes; `None` if the evaluations are used up or the fit must stop.
///
/// # Errors
/// [`FitError::CannotBeFitted`] if the model fails, shows no feature, or does not react to any parameter.
pub(crate) fn assess_identifiability(
    ledger: &mut Ledger,
    names: &[String],
) -> Result<Option<(Identifiability, ProbeEvaluation)>, FitError> {
    let centres: Vec<Vec<f64>> = (0..PROBE_COUNT).map(|at| probe_point(at, names.len())).collect();
    let around = |centre: &Vec<f64>| [vec![centre.clone()], difference_points(centre)].concat();
    let all: Vec<Vec<f64>> = centres.iter().flat_map(around).collect();
    if ledger.evaluate_points(EvaluationStage::Gate, &all).is_err() {
        return Ok(None);
    }
    let probed: Vec<ProbeEvaluation> =
        centres.iter().filter_map(|centre| evaluate_probe(ledger, centre)).collect();
    let probes: Vec<Probe> = probed.iter().map(|p| summarize_probe(p, names)).collect();
    let usable = || probed.iter().filter(|p| p.centre.failure.is_none());
    let Some(nearest) = usable().min_by(|a, b| a.centre.global_cost.total_cmp(&b.centre.global_cost)) else {
        return Err(FitError::CannotBeFitted { why: all_probes_failed(&probes) });
    };
    if probes.iter().all(|p| p.features_seen == 0) {
        return Err(FitError::CannotBeFitted { why: no_features_seen(ledger, nearest) });
    }
    if usable().all(|p| p.directions.rank == 0) {
        return Err(FitError::CannotBeFitted { why: NOTHING_MOVES.to_owned() });
    }
    let combinations =
        nearest.directions.combinations(names, ledger.objective().axes(), &nearest.centre.unit);
    let targets = ledger.objective().targets();
    let scatter = (0..targets.len())
        .map(|at| median(probed.iter().filter_map(|p| p.scatter.get(at).copied().flatten()).collect()))
        .collect();
    let notes = [probe_notes(&probes, names), rough_notes(targets, &scatter)].concat();
    let found = Identifiability { probes, combinations, scatter, notes, advice: Vec::new() };
    Ok(Some((found, nearest.clone())))
}

fn evaluate_probe(ledger: &Ledger, centre: &[f64]) -> Option<ProbeEvaluation> {
    let objective = ledger.objective();
    let around: Vec<&Evaluation> =
        difference_points(centre).iter().map(|point| ledger.find_evaluation(point)).collect::<Option<_>>()?;
    let centre = ledger.find_evaluation(centre)?.clone();
    let slopes = FeatureSlopes::from_differences(objective.targets(), &centre, &around);
    let directions = SingularDirections::from_jacobian(&jacobian(objective, &centre, &slopes));
    let scatter = feature_scatter(objective.targets(), &centre, &around);
    Some(ProbeEvaluation { centre, directions, scatter })
}

fn summarize_probe(probed: &ProbeEvaluation, names: &[String]) -> Probe {
    let ProbeEvaluation { centre, directions, .. } = probed;
    let failed = centre.failure.is_some();
    let condition = Some(directions.condition_number()).filter(|condition| condition.is_finite() && !failed);
    let determined = (0..names.len()).filter(|axis| !failed && directions.determines(*axis));
    Probe {
        values: map_names(names, centre.values.iter().copied()),
        failure: centre.failure.as_ref().map(ToString::to_string),
        features_seen: centre.features.iter().filter(|f| f.observation().is_some()).count(),
        rank: if failed { 0 } else { directions.rank },
        condition,
        determines: determined.map(|axis| names[axis].clone()).collect(),
    }
}

/// Coordinates of probe `at` in the unit box: probe 0 is the middle of the box, the others follow a Halton
/// sequence (Halton, Numer. Math. 2 (1960) 84).
fn probe_point(at: usize, dimensions: usize) -> Vec<f64> {
    let coordinate = |axis: usize| {
        let share = if at == 0 { 0.5 } else { radical_inverse(at, nth_prime(axis)) };
        0.5 + INNER_BOX * (share - 0.5)
    };
    (0..dimensions).map(coordinate).collect()
}

/// Radical inverse of `number` in `base` (van der Corput).
fn radical_inverse(number: usize, base: usize) -> f64 {
    let (mut rest, mut weight, mut sum) = (number, 1.0, 0.0);
    while rest > 0 {
        weight /= base as f64;
        sum += weight * (rest % base) as f64;
        rest /= base;
    }
    sum
}

fn nth_prime(n: usize) -> usize {
    let prime = |candidate: &usize| {
        (2..*candidate).take_while(|d| d * d <= *candidate).all(|d| !candidate.is_multiple_of(d))
    };
    (2..).filter(prime).nth(n).unwrap_or(2)
}

const NOTHING_MOVES: &str = "no parameter moves any feature by more than its own 95 % interval over the whole box, at any of the places that were probed: the features \
    say nothing about these parameters; choose other features or parameters, widen the bounds, or state smaller standard deviations if they are known";

fn all_probes_failed(probes: &[Probe]) -> String {
    let reasons: Vec<&str> = probes.iter().filter_map(|p| p.failure.as_deref()).collect();
    let first = reasons.first().copied().unwrap_or("no probe was evaluated");
    format!(
        "the model fails at all {} places of the box that were probed (the first: {first}); move the bounds to where the blade runs, correct the scene, or let contact be lost with [contact] loss = \"fly\"",
        reasons.len()
    )
}

fn no_features_seen(ledger: &Ledger, probed: &ProbeEvaluation) -> String {
    let seen = probed.centre.features.iter().zip(ledger.objective().targets());
    let missing = seen.filter_map(|(feature, target)| match feature {
        Observed::Missing(why) => Some(format!("`{}`: {why}", target.name)),
        Observed::Value(_) => None,
    });
    let missing = missing.take(3).collect::<Vec<_>>().join("; ");
    format!(
        "the model shows none of the features at any place of the box that was probed ({missing}); check windows and bands, or the scene's start and stop"
    )
}

/// Median of the values; zero if there are none.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// A note for each feature whose scatter in the model exceeds the standard deviation of its target.
fn rough_notes(targets: &[TargetValue], scatter: &Vec<f64>) -> Vec<String> {
    let rough = targets.iter().zip(scatter).filter(|(target, scatter)| **scatter > target.sd);
    let note = |(target, scatter): (&TargetValue, &f64)| {
        format!(
            "the model's `{}` is not smooth: it scatters by {} between neighbouring parameters, more than the target's deviation of {}, and counts for that much less",
            target.name,
            format_short(*scatter),
            format_short(target.sd)
        )
    };
    rough.map(note).collect()
}

fn probe_notes(probes: &[Probe], names: &[String]) -> Vec<String> {
    let usable: Vec<&Probe> = probes.iter().filter(|p| p.failure.is_none()).collect();
    let mut notes = Vec::new();
    if usable.len() < probes.len() {
        let reason = probes.iter().find_map(|p| p.failure.as_deref()).unwrap_or_default();
        let (failed, all) = (probes.len() - usable.len(), probes.len());
        notes.push(format!("the model fails at {failed} of {all} places that were probed ({reason})"));
    }
    for name in names {
        let at = usable.iter().filter(|p| p.determines.contains(name)).count();
        if 2 * at < usable.len() {
            let where_at = match at {
                0 => "nowhere".to_owned(),
                _ => format!("at {at} of {} places only", usable.len()),
            };
            notes.push(format!("before the search: the features determine {name} {where_at}"));
        }
    }
    notes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_probes_are_those_of_the_sequence() {
        let place: Vec<Vec<f64>> = (0..3).map(|at| probe_point(at, 2)).collect();
        let expected = [
            [0.5, 0.5],
            [0.5, 0.5 + 0.7 * (1.0 / 3.0 - 0.5)],
            [0.5 - 0.7 * 0.25, 0.5 + 0.7 * (2.0 / 3.0 - 0.5)],
        ];
        for (found, expected) in place.iter().flatten().zip(expected.iter().flatten()) {
            assert!((found - expected).abs() < 1e-15, "{place:?}");
        }
        assert_eq!([0, 1, 2, 3, 4].map(nth_prime), [2, 3, 5, 7, 11]);
    }
}
