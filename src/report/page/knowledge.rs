//! Sections on what is known of the parameters, and on how the search and the gate before it went.

use super::html::{Cell, Set, Table, about, facts, key, list, parameter, prose, text, verdict};
use crate::compare::ParameterLine;
use crate::fit::result::Status;
use crate::report::{CombinationLine, ProbeLine, Report};
use crate::text::{self, DASH, interval, number, or_dash, percent};

pub(super) fn parameters(report: &Report) -> String {
    if report.parameters.is_empty() {
        return String::new();
    }
    if report.misfit.is_some() {
        return [about(OF_TRACES), estimates(&report.parameters)].concat();
    }
    [
        about(OF_FEATURES),
        estimates(&report.parameters),
        intervals(&report.parameters, report.search.twins),
        combinations(&report.combinations),
    ]
    .concat()
}

const OF_FEATURES: &str = "The 95 % interval reaches as far as the profile, the twins and every equally good point of \
                           the fit; without a profile the linear model counts. An open end means that the search found \
                           no limit within its bounds. For a parameter that is not identified the interval only says \
                           where equally good fits lie; both ends are open if the best point is not reliable.";
const OF_TRACES: &str = "The 95 % interval is the widest of those from the curvature of the cost, from the scatter \
                         between segments, from the rise of the cost itself at the ends, and from refitted twins where \
                         there are any. A parameter is identified \
                         if nothing speaks against its interval; what does stands next to it.";

fn estimates(list: &[ParameterLine]) -> String {
    let with_truth = list.iter().any(|p| p.truth.is_some());
    let mut head = vec![
        ("parameter", Set::Words),
        ("symbol", Set::Words),
        ("unit", Set::Words),
        ("estimate", Set::Number),
        ("95 % interval", Set::Number),
    ];
    head.push(("verdict", Set::Words));
    if with_truth {
        head.extend([("truth (synthetic)", Set::Number), ("truth inside", Set::Words)]);
    }
    let with_reason = list.iter().any(|p| p.why.is_some());
    head.extend(with_reason.then_some(("why not", Set::Prose)));
    let row = |p: &ParameterLine| {
        let (unit, factor) = text::unit(&p.unit, [p.estimate]);
        let number = |value: f64| number(value * factor);
        let mut cells =
            vec![(parameter(&p.name), Set::Words), (text(&p.symbol), Set::Words), (text(&unit), Set::Words)];
        cells.extend([
            (number(p.estimate), Set::Number),
            (interval(p.lower_95, p.upper_95, number), Set::Number),
            verdict(p.is_identified(), [p.verdict.word(); 2]),
        ]);
        if with_truth {
            let inside = p.truth.filter(|_| p.is_bounded()).map_or_else(
                || (DASH.to_owned(), Set::Words),
                |truth| verdict(truth.inside_95, ["yes", "no"]),
            );
            cells.extend([(or_dash(p.truth, |truth| number(truth.value)), Set::Number), inside]);
        }
        cells.extend(with_reason.then(|| (or_dash(p.why.as_deref(), prose), Set::Prose)));
        cells
    };
    Table {
        caption: "Estimates and verdicts",
        head: Table::heads(&head),
        rows: list.iter().map(row).collect(),
    }
    .html()
}

fn intervals(list: &[ParameterLine], twins: usize) -> String {
    let head = [
        ("parameter", Set::Words),
        ("profile likelihood", Set::Number),
        ("twins fitted again", Set::Number),
        ("linear model", Set::Number),
    ];
    let head = [&head[..], &[("bounds of the search", Set::Number), ("prior", Set::Words)]].concat();
    let row = |p: &ParameterLine| -> Vec<Cell> {
        let [lower, upper] = p.profile_95;
        let prior = if p.prior { "counts" } else { "none" };
        let (_, factor) = text::unit(&p.unit, [p.estimate]);
        let number = |value: f64| number(value * factor);
        let ends = |ends: Option<[f64; 2]>, none: &str| {
            ends.map_or_else(|| none.to_owned(), |[lower, upper]| interval(Some(lower), Some(upper), number))
        };
        vec![
            (parameter(&p.name), Set::Words),
            (interval(lower, upper, number), Set::Number),
            (ends(p.bootstrap_95, if twins == 0 { "no twins" } else { "too few twins" }), Set::Number),
            (ends(p.linear_95, "not determined"), Set::Number),
            (ends(Some(p.bounds), ""), Set::Number),
            (prior.to_owned(), Set::Words),
        ]
    };
    let words = "In the units of the table above. Profile: where the lowest cost over all other parameters has risen by the threshold. \
                 Twins: synthetic data from the best model, fitted again. Linear: from the sensitivities at \
                 the estimates alone.";
    Table {
        caption: "The three 95 % intervals",
        head: Table::heads(&head),
        rows: list.iter().map(row).collect(),
    }
    .html()
        + &about(words)
}

/// `friction.c friction.a^0.31` with its exponents raised.
fn product(words: &str) -> String {
    let factor = |factor: &str| match factor.split_once('^') {
        Some((of, exponent)) => format!("{}<sup>{}</sup>", key(of), text(exponent).replace('-', "\u{2212}")),
        None => key(factor),
    };
    words.split(' ').map(factor).collect::<Vec<_>>().join(" \u{b7} ")
}

fn combinations(list: &[CombinationLine]) -> String {
    let row = |c: &CombinationLine| {
        let sd = if c.determined { percent(c.sd_relative) } else { DASH.to_owned() };
        vec![
            (product(&c.words), Set::Prose),
            verdict(c.determined, ["determined", "open"]),
            (sd, Set::Number),
        ]
    };
    let words = "These products of the parameters are what the features respond to. Those determined are \
                 known to the deviation given; along those left open the parameters can move together without \
                 a change of the features.";
    let head = [("combination", Set::Prose), ("verdict", Set::Words), ("standard deviation", Set::Number)];
    let table = Table {
        caption: "Combinations of the parameters",
        head: Table::heads(&head),
        rows: list.iter().map(row).collect(),
    }
    .html();
    if table.is_empty() { table } else { format!("<h3>Combinations</h3>\n{}{table}", about(words)) }
}

pub(super) fn search(report: &Report) -> String {
    let s = &report.search;
    let Some(status) = s.status else { return String::new() };
    if report.misfit.is_some() {
        return facts(&of_traces(report, status));
    }
    let failed: Vec<String> = s.failed.iter().map(|f| format!("{} {}", f.count, f.reason)).collect();
    let failed = if failed.is_empty() { "none".to_owned() } else { failed.join(", ") };
    let mut found =
        vec![("status", status.word().to_owned()), ("evaluations of the model", s.evaluations.to_string())];
    found.extend([
        ("failed", failed),
        ("local searches", s.local_searches.to_string()),
        ("cost at the estimates", number(s.cost)),
    ]);
    found.push(("rise in cost that bounds a 95 % interval", number(s.threshold)));
    found.push(("twins fitted again", if s.twins == 0 { "none".to_owned() } else { s.twins.to_string() }));
    found.push(("combinations determined", format!("{} of {}", s.rank, report.parameters.len())));
    found.push((
        "condition number",
        s.condition
            .map_or_else(|| "infinite: no feature responds to one of the combinations".to_owned(), number),
    ));
    let found: Vec<(String, String)> =
        found.into_iter().map(|(name, value)| (text(name), text(&value))).collect();
    [facts(&found), gate(&report.gate), list(&report.gate_notes)].concat()
}

/// A fit to traces has iterates and starts in place of evaluations and a gate.
fn of_traces(report: &Report, status: Status) -> Vec<(String, String)> {
    let s = &report.search;
    let found = [
        ("status", status.word().to_owned()),
        ("iterates", s.evaluations.to_string()),
        ("starts", s.local_searches.to_string()),
        ("cost at the estimates", number(s.cost)),
        ("combinations determined", format!("{} of {}", s.rank, report.parameters.len())),
    ];
    found.into_iter().map(|(name, value)| (text(name), text(&value))).collect()
}

fn gate(probes: &[ProbeLine]) -> String {
    let row = |(i, p): (usize, &ProbeLine)| {
        let ran =
            p.failure.as_deref().map_or_else(|| ("ran".to_owned(), Set::Good), |why| (prose(why), Set::Bad));
        let condition = or_dash(p.condition, number);
        let determines = if p.determines.is_empty() {
            "none alone".to_owned()
        } else {
            p.determines.iter().map(|name| key(name)).collect::<Vec<_>>().join(", ")
        };
        let number = |count: usize| (count.to_string(), Set::Number);
        vec![
            number(i + 1),
            ran,
            number(p.features_seen),
            number(p.rank),
            (condition, Set::Number),
            (determines, Set::Prose),
        ]
    };
    let head = [
        ("place", Set::Number),
        ("model", Set::Words),
        ("features found", Set::Number),
        ("combinations determined", Set::Number),
    ];
    let head = [&head[..], &[("condition number", Set::Number), ("parameters determined alone", Set::Prose)]]
        .concat();
    let rows = probes.iter().enumerate().map(row).collect();
    let table = Table {
        caption: "The gate: places of the box that were probed before the search",
        head: Table::heads(&head),
        rows,
    }
    .html();
    if table.is_empty() { table } else { format!("<h3>Gate</h3>\n{table}") }
}
