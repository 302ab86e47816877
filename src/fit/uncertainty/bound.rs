//! What a parameter at its bound does to the estimates of the others.

use super::{ParameterInterval, ParameterVerdict};
use crate::fit::information::SingularDirections;
use crate::fit::profile::AT_BOUND;
use crate::fit::search::MIN_WORTHWHILE_GAIN;
use nalgebra::DMatrix;

/// Correlation from which on an estimate follows a parameter that its bound holds back. If the optimum of
/// that parameter lies `k` of its deviations beyond the bound, the other estimate is off by `k` times the
/// correlation in deviations of its own; at this one, ten are as much as half a 95 % interval.
const MIN_CORRELATION: f64 = 0.2;

/// Whether a coordinate of the unit box is at one of its ends.
pub(super) fn is_at_bound(unit: f64) -> bool {
    !(AT_BOUND..=1.0 - AT_BOUND).contains(&unit)
}

/// The parameter at its bound that an estimate follows most, and their correlation.
pub(super) fn strongest_bound_correlation(
    axis: usize,
    unit: &[f64],
    correlation: impl Fn(usize, usize) -> Option<f64>,
) -> Option<(usize, f64)> {
    let held = (0..unit.len()).filter(|held| *held != axis && is_at_bound(unit[*held]));
    held.filter_map(|held| Some((held, correlation(axis, held)?)))
        .filter(|(_, r)| r.abs() >= MIN_CORRELATION)
        .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
}

/// The parameter at its bound of which a value beyond would gain most, and that gain in cost by the linear
/// model; `None` where none gains more than is worth a step.
pub(super) fn best_excluded_gain(
    unit: &[f64],
    jacobian: &DMatrix<f64>,
    residuals: &[Option<f64>],
) -> Option<(usize, f64)> {
    let gain = |axis: usize| {
        let column = jacobian.column(axis);
        let slope: f64 = residuals.iter().zip(column.iter()).map(|(r, j)| r.unwrap_or(0.0) * j).sum();
        let outward = if unit[axis] < 0.5 { -slope } else { slope };
        (outward < 0.0).then(|| slope * slope / column.norm_squared())
    };
    let held = (0..unit.len()).filter(|axis| is_at_bound(unit[*axis]));
    let gains = held.filter_map(|axis| Some((axis, gain(axis)?)));
    gains.filter(|(_, gain)| *gain > MIN_WORTHWHILE_GAIN).max_by(|a, b| a.1.total_cmp(&b.1))
}

/// Calls nothing identified where a bound excludes a better value, and says so.
pub(super) fn withdraw_all(
    intervals: &mut [ParameterInterval],
    names: &[String],
    excluding: (usize, f64),
) -> Vec<String> {
    let (held, gain) = excluding;
    let mut barred = Vec::new();
    for (interval, name) in intervals.iter_mut().zip(names) {
        if interval.verdict == ParameterVerdict::Identified {
            interval
                .withdraw_verdict(format!("{} is at its bound, which excludes a better value", names[held]));
            barred.push(name.as_str());
        }
    }
    if barred.is_empty() {
        return Vec::new();
    }
    let (barred, held) = (barred.join(", "), &names[held]);
    vec![format!(
        "nothing is called identified ({barred}): {held} is at its bound, and a value beyond the bound would \
         meet the features better (the cost falls by about {gain:.2}), where the others are different; widen \
         the bounds of {held}"
    )]
}

/// Calls nothing identified that is correlated with a parameter at its bound, and says so.
pub(super) fn withdraw_correlated(
    intervals: &mut [ParameterInterval],
    names: &[String],
    unit: &[f64],
    directions: &SingularDirections,
) -> Vec<String> {
    let strongest =
        |axis: usize| strongest_bound_correlation(axis, unit, |a, b| directions.correlation(a, b));
    let mut notes = Vec::new();
    for (axis, interval) in intervals.iter_mut().enumerate() {
        if let Some((held, r)) = strongest(axis).filter(|_| interval.verdict == ParameterVerdict::Identified)
        {
            interval.verdict = ParameterVerdict::NotIdentified;
            let (name, held) = (&names[axis], &names[held]);
            notes.push(format!(
                "{name} is not called identified: {held} is at its bound, and the two estimates are correlated \
                 ({r:.2}), so a better value of {held} beyond the bound would move {name}; widen the bounds of {held}"
            ));
        }
    }
    notes
}
