//! The axes of a study: each is a parameter of a scene with rising values.

use super::as_written;
use crate::blade::parameters::{Parameter, find, names};
use crate::sweep::grid::{Axis, Spacing};
use crate::toml_file::{Refusal, nearest, refuse};

/// Most points of a study: 200 by 200 cells are as many as a figure in one column can show, and take minutes.
const MOST_POINTS: usize = 40_000;
/// Most axes: a map has two.
const MOST_AXES: usize = 2;
pub(super) fn axes(written: &[as_written::Axis]) -> Result<Vec<Axis>, Refusal> {
    if !(1..=MOST_AXES).contains(&written.len()) {
        return refuse(
            "axis",
            format!("found {}, expected one or two: add or remove an [[axis]]", written.len()),
        );
    }
    let counts = written.iter().map(|axis| axis.values.as_ref().map_or(axis.points.unwrap_or(0), Vec::len));
    let points = counts.fold(1, usize::saturating_mul);
    if points > MOST_POINTS {
        return refuse(
            "axis",
            format!(
                "found {points} points in all, expected at most {MOST_POINTS}; lower `points` of an axis"
            ),
        );
    }
    let axes = written.iter().map(axis).collect::<Result<Vec<_>, _>>()?;
    if let [first, second] = axes.as_slice()
        && first.parameter.quantity == second.parameter.quantity
    {
        let (first, second) = (first.parameter.name, second.parameter.name);
        return refuse(
            format!("axis `{second}`"),
            format!(
                "sets the same quantity as the axis `{first}`; vary another parameter or remove one axis"
            ),
        );
    }
    Ok(axes)
}

fn axis(written: &as_written::Axis) -> Result<Axis, Refusal> {
    let key = |key: &str| format!("axis `{}`, `{key}`", written.name);
    let Some(parameter) = find(&written.name) else {
        return refuse(
            key("name"),
            format!("not a parameter of a scene; {}", nearest(&written.name, &names())),
        );
    };
    let spacing = written.scale.unwrap_or_default();
    let values = match (&written.values, written.from, written.to, written.points) {
        (Some(values), None, None, None) => values.clone(),
        (Some(_), ..) => {
            return refuse(
                key("values"),
                "found together with `from`, `to` or `points`, expected one of the two ways; \
                 remove the other",
            );
        }
        (None, Some(from), Some(to), Some(points)) => between(&key, parameter, spacing, (from, to), points)?,
        _ => {
            return refuse(
                key("from"),
                "expected `from`, `to` and `points`, or `values` alone; add what is missing",
            );
        }
    };
    rising(&key("values"), &values)?;
    above_zero(&key("scale"), spacing, &values)?;
    if let Some(value) = values.iter().find(|value| !parameter.range.admits(**value)) {
        let expected = parameter.range.in_words();
        return refuse(
            format!("axis `{}`", parameter.name),
            format!("found {value}, expected {expected} ({}, {})", parameter.meaning, parameter.unit),
        );
    }
    Ok(Axis { parameter, values, spacing })
}

fn between(
    key: &impl Fn(&str) -> String,
    parameter: &Parameter,
    spacing: Spacing,
    (from, to): (f64, f64),
    points: usize,
) -> Result<Vec<f64>, Refusal> {
    if !(from.is_finite() && to.is_finite() && from < to) {
        return refuse(
            key("to"),
            format!(
                "found {from} to {to}, expected `from` below `to`, in {}; exchange or correct them",
                parameter.unit
            ),
        );
    }
    if points < 2 {
        return refuse(key("points"), format!("found {points}, expected 2 or more: both ends are points"));
    }
    above_zero(&key("scale"), spacing, &[from, to])?;
    Ok(spacing.spread(from, to, points))
}

fn rising(key: &str, values: &[f64]) -> Result<(), Refusal> {
    if values.len() < 2 {
        return refuse(
            key,
            format!(
                "found {}, expected two values or more; a single one belongs into the scene",
                values.len()
            ),
        );
    }
    match values.windows(2).find(|pair| pair[0].is_nan() || pair[0] >= pair[1]) {
        Some(pair) => refuse(
            key,
            format!(
                "found {} before {}, expected rising values; sort them, or take fewer points",
                pair[0], pair[1]
            ),
        ),
        None => Ok(()),
    }
}

fn above_zero(key: &str, spacing: Spacing, values: &[f64]) -> Result<(), Refusal> {
    match values.iter().find(|value| spacing == Spacing::Log && **value <= 0.0) {
        Some(value) => refuse(
            key,
            format!(
                "found \"log\" with the value {value}, expected values above 0; \
                 take \"linear\" or correct the value"
            ),
        ),
        None => Ok(()),
    }
}
