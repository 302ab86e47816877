//! What differs between two outcomes at one point, in words.

use crate::fit::evaluation::{EvaluationOutcome, Observed};
use crate::fit::failure::RunFailure;
use std::fmt::Debug;

/// The first difference: what the one has there, and what the other.
pub(super) fn first_difference(one: &EvaluationOutcome, other: &EvaluationOutcome) -> Option<[String; 2]> {
    value_difference(one, other)
        .or_else(|| failure_difference(one, other))
        .or_else(|| feature_difference(one, other))
}

fn value_difference(one: &EvaluationOutcome, other: &EvaluationOutcome) -> Option<[String; 2]> {
    (one.values != other.values).then(|| [one, other].map(|outcome| format!("values {:?}", outcome.values)))
}

fn failure_difference(one: &EvaluationOutcome, other: &EvaluationOutcome) -> Option<[String; 2]> {
    let words = |failure: Option<&RunFailure>| match failure {
        Some(RunFailure { reason, message, progress }) => {
            format!("failure {reason} ({message}) after {progress} of the run")
        }
        None => "no failure".to_owned(),
    };
    (one.failure != other.failure).then(|| [one, other].map(|outcome| words(outcome.failure.as_ref())))
}

fn feature_difference(one: &EvaluationOutcome, other: &EvaluationOutcome) -> Option<[String; 2]> {
    if one.features.len() != other.features.len() {
        return Some([one, other].map(|outcome| format!("{} features", outcome.features.len())));
    }
    let mut pairs = one.features.iter().zip(&other.features).enumerate();
    let (at, (a, b)) = pairs.find(|(_, (a, b))| a != b)?;
    Some([a, b].map(|observed| format!("feature {} {}", at + 1, describe_observed(observed))))
}

fn describe_observed(observed: &Observed) -> String {
    let number = |name: &str, number: &dyn Debug| format!(", {name} {number:?}");
    match observed {
        Observed::Value(found) => {
            let apart = [("spread", found.spread), ("below the strongest by (dB)", found.below_db)];
            let apart = apart.iter().filter(|(_, value)| *value != 0.0);
            let apart: String = apart.map(|(name, value)| number(name, value)).collect();
            format!("{:?}{apart}", found.value)
        }
        Observed::Missing(why) => format!("missing ({why})"),
    }
}
