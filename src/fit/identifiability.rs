//! The gate before the search: what these features can determine at this noise, probed at a few places of
//! the box.
//!
//! At each probe the model is differenced once along every parameter. The gate refuses only what cannot be
//! fitted: a model that shows nothing anywhere, or features that no parameter moves. Everything else it lets
//! pass with a sentence.

use super::evaluation::EvaluationStage;
use super::evaluation::{Evaluation, Observed};
use super::ledger::{Ledger, StopReason};
use super::linear_model::{FeatureSlopes, difference_points, feature_scatter, jacobian};
use super::linear_model::{ParameterCombination, SingularDirections};
use super::targets::TargetValue;
use crate::text::format_short;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Places that are probed: the middle of the box and points of a Halton sequence around it.
pub(crate) const PROBE_COUNT: usize = 5;
/// The share of the box, about its middle, in which the probes lie: corners are rarely blades.
const INNER_BOX: f64 = 0.7;

/// What one probe showed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Probe {
    /// Parameter values, in SI.
    pub values: BTreeMap<String, f64>,
    /// Why the model failed there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
    /// Features that were seen.
    pub features_seen: usize,
    /// Number of informative directions.
    pub rank: usize,
    /// Largest singular value over the smallest; `None` where one is zero.
    pub condition: Option<f64>,
    /// Parameters that the features determine there.
    pub determines: Vec<String>,
}

/// What the gate found.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Identifiability {
    /// The probes.
    pub probes: Vec<Probe>,
    /// What the features determine and leave open at the probe that is nearest to the targets.
    pub combinations: Vec<ParameterCombination>,
    /// Scatter of the model's value of each feature between neighbouring parameters, in its unit: the median
    /// over the probes. It counts with the deviation of the target, because no search can use what it
    /// drowns.
    pub scatter: Vec<f64>,
    /// What a reader has to know, in sentences.
    pub notes: Vec<String>,
    /// What to measure in addition, in sentences.
    pub advice: Vec<String>,
}

/// Why there is no gate to pass.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum IdentifiabilityError {
    /// Nothing can be learned, and why.
    CannotBeFitted(String),
    /// The evaluations are used up or may not go on.
    Stopped(StopReason),
}

/// A place that was probed and where the model ran.
#[derive(Debug, Clone)]
pub(crate) struct ProbeEvaluation {
    pub centre: Evaluation,
    pub directions: SingularDirections,
    /// Scatter of each feature there.
    scatter: Vec<Option<f64>>,
}

/// Probes the box.
///
/// # Errors
/// [`IdentifiabilityError`] when the job cannot be fitted, or the ledger has stopped.
pub(crate) fn assess_identifiability(
    ledger: &mut Ledger,
    names: &[String],
) -> Result<(Identifiability, ProbeEvaluation), IdentifiabilityError> {
    let centres: Vec<Vec<f64>> = (0..PROBE_COUNT).map(|at| probe_point(at, names.len())).collect();
    let all: Vec<Vec<f64>> = centres
        .iter()
        .flat_map(|centre| std::iter::once(centre.clone()).chain(difference_points(centre)))
        .collect();
    ledger.evaluate_points(EvaluationStage::Gate, &all).map_err(IdentifiabilityError::Stopped)?;
    let probed: Vec<ProbeEvaluation> =
        centres.iter().filter_map(|centre| evaluate_probe(ledger, centre)).collect();
    let probes: Vec<Probe> = probed.iter().map(|p| summarize_probe(p, names)).collect();
    let usable = || probed.iter().filter(|p| p.centre.failure.is_none());
    let Some(nearest) = usable().min_by(|a, b| a.centre.global_cost.total_cmp(&b.centre.global_cost)) else {
        return Err(IdentifiabilityError::CannotBeFitted(all_probes_failed(&probes)));
    };
    if probes.iter().all(|p| p.features_seen == 0) {
        return Err(IdentifiabilityError::CannotBeFitted(no_features_seen(ledger, nearest)));
    }
    if usable().all(|p| p.directions.rank == 0) {
        return Err(IdentifiabilityError::CannotBeFitted(NOTHING_MOVES.to_owned()));
    }
    let combinations =
        nearest.directions.combinations(names, ledger.objective().axes(), &nearest.centre.unit);
    let targets = ledger.objective().targets();
    let scatter = (0..targets.len())
        .map(|at| median(probed.iter().filter_map(|p| p.scatter.get(at).copied().flatten()).collect()))
        .collect();
    let notes = [probe_notes(&probes, names), rough_notes(targets, &scatter)].concat();
    Ok((Identifiability { probes, combinations, scatter, notes, advice: Vec::new() }, nearest.clone()))
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
    let determines = names
        .iter()
        .enumerate()
        .filter(|(axis, _)| !failed && directions.determines(*axis))
        .map(|(_, name)| name.clone());
    Probe {
        values: names.iter().cloned().zip(centre.values.iter().copied()).collect(),
        failure: centre.failure.as_ref().map(ToString::to_string),
        features_seen: centre.features.iter().filter(|f| f.observation().is_some()).count(),
        rank: if failed { 0 } else { directions.rank },
        condition,
        determines: determines.collect(),
    }
}

/// The middle of the box, then a Halton sequence (Halton, Numer. Math. 2 (1960) 84).
fn probe_point(at: usize, dimensions: usize) -> Vec<f64> {
    let coordinate = |axis: usize| {
        let share = if at == 0 { 0.5 } else { radical_inverse(at, nth_prime(axis)) };
        0.5 + INNER_BOX * (share - 0.5)
    };
    (0..dimensions).map(coordinate).collect()
}

/// The digits of `number` in a base, mirrored behind the point.
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

/// The median; zero of nothing.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// Features whose own scatter exceeds the deviation of their target.
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
        notes.push(format!(
            "the model fails at {} of {} places that were probed ({reason})",
            probes.len() - usable.len(),
            probes.len()
        ));
    }
    let determined = |name: &String| usable.iter().filter(|p| p.determines.contains(name)).count();
    for name in names {
        let at = determined(name);
        if 2 * at < usable.len() {
            let where_at = if at == 0 {
                "nowhere".to_owned()
            } else {
                format!("at {at} of {} places only", usable.len())
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
