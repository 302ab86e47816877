//! The axes of a study: each is a parameter of a scene with rising values.

use super::as_written;
use crate::blade::parameters::{ModelParameter, find_parameter, parameter_names};
use crate::sweep::grid::{AxisSpacing, SweepAxis};
use crate::sweep::sample::SamplePlan;
use crate::toml_file::{KeyRefusal, refuse_key, suggest_key};

/// Most points of a study: a mistyped number is refused; so many take a cluster a day.
const MOST_POINTS: usize = 100_000_000;
/// Most values of an axis.
const MOST_VALUES: usize = 100_000;

pub(super) fn check_axes(
    written: &[as_written::StudyAxisFile],
    sample: Option<&SamplePlan>,
) -> Result<Vec<SweepAxis>, KeyRefusal> {
    if written.is_empty() {
        return refuse_key("axis", "found none, expected at least one [[axis]]: a parameter that is varied");
    }
    if let Some(SamplePlan { points, .. }) = sample
        && !(2..=MOST_POINTS).contains(points)
    {
        return refuse_key("sample.points", format!("found {points}, expected 2 to {MOST_POINTS}"));
    }
    let counts = written.iter().map(|axis| axis.values.as_ref().map_or(axis.points.unwrap_or(0), Vec::len));
    let points = counts.fold(1, usize::saturating_mul);
    if sample.is_none() && points > MOST_POINTS {
        return refuse_key(
            "axis",
            format!(
                "found {points} points in all, expected at most {MOST_POINTS}; lower `points` of an axis, \
                 or take a [sample]"
            ),
        );
    }
    let axes = written.iter().map(|written| check_axis(written, sample.is_some()));
    let axes = axes.collect::<Result<Vec<_>, _>>()?;
    let pairs = axes.iter().enumerate().flat_map(|(at, axis)| axes.iter().take(at).map(move |b| (b, axis)));
    let same = |(a, b): &(&SweepAxis, &SweepAxis)| a.parameter.quantity == b.parameter.quantity;
    if let Some((first, second)) = pairs.into_iter().find(same) {
        let (first, second) = (first.parameter.name, second.parameter.name);
        return refuse_key(
            format!("axis `{second}`"),
            format!(
                "sets the same quantity as the axis `{first}`; vary another parameter or remove one axis"
            ),
        );
    }
    Ok(axes)
}

fn check_axis(written: &as_written::StudyAxisFile, sampled: bool) -> Result<SweepAxis, KeyRefusal> {
    let key = |key: &str| format!("axis `{}`, `{key}`", written.name);
    let Some(parameter) = find_parameter(&written.name) else {
        return refuse_key(
            key("name"),
            format!("not a parameter of a scene; {}", suggest_key(&written.name, &parameter_names())),
        );
    };
    let spacing = written.scale.unwrap_or_default();
    let points = if sampled { check_sampled_ends(&key, written)? } else { written.points };
    let values = match (&written.values, written.from, written.to, points) {
        (Some(values), None, None, None) => values.clone(),
        (Some(_), ..) => {
            return refuse_key(
                key("values"),
                "found together with `from`, `to` or `points`, expected one of the two ways; \
                 remove the other",
            );
        }
        (None, Some(from), Some(to), Some(points)) => {
            spread_between(&key, parameter, spacing, (from, to), points)?
        }
        _ => {
            return refuse_key(
                key("from"),
                "expected `from`, `to` and `points`, or `values` alone; add what is missing",
            );
        }
    };
    check_rising(&key("values"), &values)?;
    check_log_values(&key("scale"), spacing, &values)?;
    if let Some(value) = values.iter().find(|value| !parameter.range.admits(**value)) {
        let expected = parameter.range.describe();
        return refuse_key(
            format!("axis `{}`", parameter.name),
            format!("found {value}, expected {expected} ({}, {})", parameter.meaning, parameter.unit),
        );
    }
    Ok(SweepAxis { parameter, values, spacing })
}

/// An axis of a sample has a range; its ends are what is kept of it.
fn check_sampled_ends(
    key: &impl Fn(&str) -> String,
    written: &as_written::StudyAxisFile,
) -> Result<Option<usize>, KeyRefusal> {
    let extra = match (&written.values, written.points) {
        (Some(_), _) => "values",
        (_, Some(_)) => "points",
        _ if written.from.is_none() || written.to.is_none() => {
            return refuse_key(
                key("from"),
                "expected `from` and `to`, the range that is sampled; add what is missing",
            );
        }
        _ => return Ok(Some(2)),
    };
    refuse_key(
        key(extra),
        format!(
            "found next to a [sample], which has points of its own between `from` and `to`; remove `{extra}`, or \
             the table [sample] for a grid"
        ),
    )
}

fn spread_between(
    key: &impl Fn(&str) -> String,
    parameter: &ModelParameter,
    spacing: AxisSpacing,
    (from, to): (f64, f64),
    points: usize,
) -> Result<Vec<f64>, KeyRefusal> {
    if !(from.is_finite() && to.is_finite() && from < to) {
        return refuse_key(
            key("to"),
            format!(
                "found {from} to {to}, expected `from` below `to`, in {}; exchange or correct them",
                parameter.unit
            ),
        );
    }
    if !(2..=MOST_VALUES).contains(&points) {
        let expected = format!("expected 2 to {MOST_VALUES}: both ends are points");
        return refuse_key(key("points"), format!("found {points}, {expected}"));
    }
    check_log_values(&key("scale"), spacing, &[from, to])?;
    Ok(spacing.spread_values(from, to, points))
}

fn check_rising(key: &str, values: &[f64]) -> Result<(), KeyRefusal> {
    if values.len() < 2 {
        return refuse_key(
            key,
            format!(
                "found {}, expected two values or more; a single one belongs into the scene",
                values.len()
            ),
        );
    }
    match values.windows(2).find(|pair| pair[0].is_nan() || pair[0] >= pair[1]) {
        Some(pair) => refuse_key(
            key,
            format!(
                "found {} before {}, expected rising values; sort them, or take fewer points",
                pair[0], pair[1]
            ),
        ),
        None => Ok(()),
    }
}

fn check_log_values(key: &str, spacing: AxisSpacing, values: &[f64]) -> Result<(), KeyRefusal> {
    match values.iter().find(|value| spacing == AxisSpacing::Log && **value <= 0.0) {
        Some(value) => refuse_key(
            key,
            format!(
                "found \"log\" with the value {value}, expected values above 0; \
                 take \"linear\" or correct the value"
            ),
        ),
        None => Ok(()),
    }
}
