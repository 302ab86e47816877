//! What the fit knows of its parameters: profiles, ends of the searches, sensitivities, correlations.

use crate::blade::parameters;
use crate::fit::job::{FreeParameter, Job};
use crate::fit::profile::AT_BOUND;
use crate::fit::result::{FitResult, ParameterResult};
use crate::report::profiles::{self, Profile, Profiles};
use crate::report::sensitivity::{self, Sensitivity};
use crate::report::waterfall::{self, Descent, Waterfall};
use crate::report::{Drawing, FigureBlock, ParameterLine};
use crate::text::shortened;

/// Points of a parabola: enough for a smooth line in a panel of 70 mm.
const PARABOLA: u32 = 60;
/// Letters of a name that stand in for a symbol.
const SYMBOL_LETTERS: usize = 10;

/// The figures that there is something to show in; `lines` bring the true values.
pub(super) fn blocks(job: &Job, result: &FitResult, lines: &[ParameterLine]) -> Vec<FigureBlock> {
    [profiles(job, result, lines), waterfall(job, result), sensitivity(job, result)]
        .into_iter()
        .flatten()
        .collect()
}

fn block(file: &str, caption: String, figure: crate::report::chart::Figure) -> FigureBlock {
    FigureBlock {
        file: format!("{file}.svg"),
        caption,
        details: String::new(),
        drawing: Drawing::Chart(figure),
    }
}

/// Symbol of a parameter in the equations; a short form of its name where it has none.
fn symbol(name: &str) -> String {
    parameters::find(name).map_or_else(|| shortened(name, SYMBOL_LETTERS), |row| row.symbol.to_owned())
}

fn profiles(job: &Job, result: &FitResult, lines: &[ParameterLine]) -> Option<FigureBlock> {
    let profile = |parameter: &FreeParameter| {
        let found = result.parameters.get(&parameter.name)?;
        let line = lines.iter().find(|line| line.name == parameter.name);
        Some(Profile {
            symbol: symbol(&parameter.name),
            unit: line.map(|line| line.unit.clone()).unwrap_or_default(),
            verdict: found.verdict.word().replace('-', " "), // as NOT_IDENTIFIED is written
            bounds: (parameter.bounds.lower(), parameter.bounds.upper()),
            estimate: found.estimate,
            truth: line.and_then(|line| line.truth).map(|truth| truth.value),
            points: found.profile.iter().map(|(value, cost)| (*value, cost - result.cost)).collect(),
            linear: parabola(parameter, found, result.threshold),
            intervals: [
                Some(closed(parameter, found)),
                found.linear_95.map(|ends| ends.map(Some)),
                found.bootstrap_95.map(|ends| ends.map(Some)),
            ],
        })
    };
    let shown = Profiles {
        title: job.title.clone(),
        synthetic: result.synthetic,
        least_cost: result.cost,
        threshold: result.threshold,
        parameters: job.parameters.iter().filter_map(profile).collect(),
    };
    let figure = profiles::figure(&shown);
    (!figure.panels.is_empty()).then(|| block("profiles", profiles::caption(&shown), figure))
}

/// Ends of the profile's interval; one at a bound is open, as what lies beyond was not tried.
fn closed(parameter: &FreeParameter, found: &ParameterResult) -> [Option<f64>; 2] {
    let inside = |end: &f64| (AT_BOUND..=1.0 - AT_BOUND).contains(&parameter.bounds.to_unit(*end));
    found.profile_95.map(|end| end.filter(inside))
}

/// The cost by the linear model: a parabola in the scale of the search, through the threshold at the ends of
/// the linear interval. An end at a bound may have been cut there, so the longer half counts; none where both
/// are.
fn parabola(parameter: &FreeParameter, found: &ParameterResult, threshold: f64) -> Vec<(f64, f64)> {
    let bounds = &parameter.bounds;
    let Some(ends) =
        found.linear_95.filter(|[lower, upper]| *lower > bounds.lower() || *upper < bounds.upper())
    else {
        return Vec::new();
    };
    let centre = bounds.to_unit(found.estimate);
    let half = ends.map(|end| (bounds.to_unit(end) - centre).abs()).into_iter().fold(0.0, f64::max);
    if half <= 0.0 {
        return Vec::new();
    }
    /// Half-widths over which it is drawn: beyond the top of the axes.
    const REACH: f64 = 2.0;
    let offsets = (0..=PARABOLA).map(|i| REACH * (2.0 * f64::from(i) / f64::from(PARABOLA) - 1.0));
    let inside = offsets.filter(|offset| (0.0..=1.0).contains(&(centre + offset * half)));
    inside.map(|offset| (bounds.from_unit(centre + offset * half), threshold * offset * offset)).collect()
}

fn waterfall(job: &Job, result: &FitResult) -> Option<FigureBlock> {
    let place = |optimum: &crate::fit::result::Optimum| {
        let of = |p: &FreeParameter| {
            optimum.values.get(&p.name).map_or(f64::NAN, |value| p.bounds.to_unit(*value))
        };
        job.parameters.iter().map(of).collect()
    };
    let descent = |o: &crate::fit::result::Optimum| Descent {
        start_cost: o.start_cost,
        cost: o.cost,
        end: place(o),
        failed: o.failure.is_some(),
    };
    let shown = Waterfall {
        title: job.title.clone(),
        synthetic: result.synthetic,
        threshold: result.threshold,
        symbols: job.parameters.iter().map(|p| symbol(&p.name)).collect(),
        descents: result.waterfall.iter().map(descent).collect(),
    };
    (!shown.descents.is_empty())
        .then(|| block("searches", waterfall::caption(&shown), waterfall::figure(&shown)))
}

fn sensitivity(job: &Job, result: &FitResult) -> Option<FigureBlock> {
    let names: Vec<&String> = job.parameters.iter().map(|p| &p.name).collect();
    let aims = job
        .aims
        .iter()
        .filter_map(|aim| Some((&aim.feature.name, result.sensitivities.get(&aim.feature.name)?)));
    let (features, rows): (Vec<&String>, Vec<_>) = aims.unzip();
    let cells = |row: &std::collections::BTreeMap<String, Option<f64>>| {
        names.iter().map(|name| row.get(*name).copied().flatten()).collect()
    };
    let correlation = |a: &String, b: &String| result.correlations.get(a).and_then(|row| row.get(b)).copied();
    let shown = Sensitivity {
        title: job.title.clone(),
        synthetic: result.synthetic,
        symbols: names.iter().map(|name| symbol(name)).collect(),
        features: features.into_iter().cloned().collect(),
        sensitivities: rows.into_iter().map(cells).collect(),
        correlations: names.iter().map(|a| names.iter().map(|b| correlation(a, b)).collect()).collect(),
    };
    let figure = sensitivity::figure(&shown);
    (!figure.panels.is_empty()).then(|| block("sensitivities", sensitivity::caption(&shown), figure))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::scale::{Bounds, Spacing};
    use crate::fit::uncertainty::Verdict;

    fn parameter(spacing: Spacing) -> FreeParameter {
        FreeParameter {
            name: "friction.a".to_owned(),
            bounds: Bounds::new(0.1, 1.0, spacing).unwrap(),
            prior: None,
        }
    }

    fn found(estimate: f64, linear_95: Option<[f64; 2]>) -> ParameterResult {
        ParameterResult {
            estimate,
            lower_95: None,
            upper_95: Some(0.9),
            verdict: Verdict::OpenBelow,
            linear_95,
            profile_95: [Some(0.1), Some(0.8)],
            bootstrap_95: None,
            profile: Vec::new(),
        }
    }

    /// Rise of a parabola where it comes nearest to a value.
    fn at(parabola: &[(f64, f64)], value: f64) -> f64 {
        parabola.iter().min_by(|a, b| (a.0 - value).abs().total_cmp(&(b.0 - value).abs())).unwrap().1
    }

    #[test]
    fn the_parabola_meets_the_threshold_at_the_ends_of_the_linear_interval() {
        let linear = parabola(&parameter(Spacing::Linear), &found(0.5, Some([0.4, 0.6])), 4.0);
        let log = parabola(&parameter(Spacing::Log), &found(0.4, Some([0.32, 0.5])), 4.0);
        for (parabola, ends) in [(linear, [0.4, 0.5, 0.6]), (log, [0.32, 0.4, 0.5])] {
            let rises = ends.map(|end| at(&parabola, end));
            assert!(
                rises.iter().zip([4.0, 0.0, 4.0]).all(|(found, expected)| (found - expected).abs() < 1e-9),
                "{rises:?}"
            );
        }
    }

    #[test]
    fn an_end_that_a_bound_cut_does_not_narrow_the_parabola() {
        let cut = parabola(&parameter(Spacing::Linear), &found(0.2, Some([0.1, 0.4])), 4.0);
        assert!((at(&cut, 0.4) - 4.0).abs() < 1e-9 && at(&cut, 0.1) < 1.1, "{cut:?}");
        assert!(parabola(&parameter(Spacing::Linear), &found(0.2, Some([0.1, 1.0])), 4.0).is_empty());
        assert!(parabola(&parameter(Spacing::Linear), &found(0.2, None), 4.0).is_empty());
    }

    #[test]
    fn an_end_at_a_bound_is_open_in_the_figure() {
        assert_eq!(closed(&parameter(Spacing::Linear), &found(0.5, None)), [None, Some(0.8)]);
    }

    #[test]
    fn a_symbol_stands_for_a_known_name_and_a_short_form_for_any_other() {
        assert_eq!(
            [symbol("friction.a"), symbol("something.unheard_of")],
            ["A".to_owned(), "something\u{2026}".to_owned()]
        );
    }
}
