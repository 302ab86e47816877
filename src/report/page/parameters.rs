//! Sections on what is known of the parameters, and on how the search and the gate before it went.

use super::html::{
    CellStyle, HtmlCell, HtmlTable, breakable_key, escape_text, facts_list, parameter_html, prose_html,
    reading_hint, sentence_list, verdict_cell,
};
use crate::compare::ParameterLine;
use crate::fit::result::FitStatus;
use crate::report::{CombinationLine, ProbeLine, Report};
use crate::text::{self, DASH, format_interval, format_number, format_or_dash, format_percent};

pub(super) fn parameters_html(report: &Report) -> String {
    if report.parameters.is_empty() {
        return String::new();
    }
    if report.misfit.is_some() {
        return [reading_hint(OF_TRACES), estimates_table(&report.parameters)].concat();
    }
    [
        reading_hint(OF_FEATURES),
        estimates_table(&report.parameters),
        intervals_table(&report.parameters, report.search.twins),
        combinations_table(&report.combinations),
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

fn estimates_table(list: &[ParameterLine]) -> String {
    let with_truth = list.iter().any(|p| p.truth.is_some());
    let mut head = vec![
        ("parameter", CellStyle::Words),
        ("symbol", CellStyle::Words),
        ("unit", CellStyle::Words),
        ("estimate", CellStyle::Number),
        ("95 % interval", CellStyle::Number),
    ];
    head.push(("verdict", CellStyle::Words));
    if with_truth {
        head.extend([("truth (synthetic)", CellStyle::Number), ("truth inside", CellStyle::Words)]);
    }
    let with_reason = list.iter().any(|p| p.why.is_some());
    head.extend(with_reason.then_some(("why not", CellStyle::Prose)));
    let row = |p: &ParameterLine| {
        let (unit, factor) = text::choose_prefix(&p.unit, [p.estimate]);
        let number = |value: f64| format_number(value * factor);
        let mut cells = vec![
            (parameter_html(&p.name), CellStyle::Words),
            (escape_text(&p.symbol), CellStyle::Words),
            (escape_text(&unit), CellStyle::Words),
        ];
        cells.extend([
            (number(p.estimate), CellStyle::Number),
            (format_interval(p.lower_95, p.upper_95, number), CellStyle::Number),
            verdict_cell(p.is_identified(), [p.verdict.name(); 2]),
        ]);
        if with_truth {
            let inside = p.truth.filter(|_| p.is_bounded()).map_or_else(
                || (DASH.to_owned(), CellStyle::Words),
                |truth| verdict_cell(truth.inside_95, ["yes", "no"]),
            );
            cells.extend([(format_or_dash(p.truth, |truth| number(truth.value)), CellStyle::Number), inside]);
        }
        cells.extend(with_reason.then(|| (format_or_dash(p.why.as_deref(), prose_html), CellStyle::Prose)));
        cells
    };
    HtmlTable {
        caption: "Estimates and verdicts",
        head: HtmlTable::column_heads(&head),
        rows: list.iter().map(row).collect(),
    }
    .render()
}

fn intervals_table(list: &[ParameterLine], twins: usize) -> String {
    let head = [
        ("parameter", CellStyle::Words),
        ("profile likelihood", CellStyle::Number),
        ("twins fitted again", CellStyle::Number),
        ("linear model", CellStyle::Number),
    ];
    let head =
        [&head[..], &[("bounds of the search", CellStyle::Number), ("prior", CellStyle::Words)]].concat();
    let row = |p: &ParameterLine| -> Vec<HtmlCell> {
        let [lower, upper] = p.profile_95;
        let prior = if p.prior { "counts" } else { "none" };
        let (_, factor) = text::choose_prefix(&p.unit, [p.estimate]);
        let number = |value: f64| format_number(value * factor);
        let ends = |ends: Option<[f64; 2]>, none: &str| {
            ends.map_or_else(
                || none.to_owned(),
                |[lower, upper]| format_interval(Some(lower), Some(upper), number),
            )
        };
        vec![
            (parameter_html(&p.name), CellStyle::Words),
            (format_interval(lower, upper, number), CellStyle::Number),
            (ends(p.bootstrap_95, if twins == 0 { "no twins" } else { "too few twins" }), CellStyle::Number),
            (ends(p.linear_95, "not determined"), CellStyle::Number),
            (ends(Some(p.bounds), ""), CellStyle::Number),
            (prior.to_owned(), CellStyle::Words),
        ]
    };
    let words = "In the units of the table above. Profile: where the lowest cost over all other parameters has risen by the threshold. \
                 Twins: synthetic data from the best model, fitted again. Linear: from the sensitivities at \
                 the estimates alone.";
    HtmlTable {
        caption: "The three 95 % intervals",
        head: HtmlTable::column_heads(&head),
        rows: list.iter().map(row).collect(),
    }
    .render()
        + &reading_hint(words)
}

/// `friction.c friction.a^0.31` with its exponents raised.
fn product_html(words: &str) -> String {
    let factor = |factor: &str| match factor.split_once('^') {
        Some((of, exponent)) => {
            format!("{}<sup>{}</sup>", breakable_key(of), escape_text(exponent).replace('-', "\u{2212}"))
        }
        None => breakable_key(factor),
    };
    words.split(' ').map(factor).collect::<Vec<_>>().join(" \u{b7} ")
}

fn combinations_table(list: &[CombinationLine]) -> String {
    let row = |c: &CombinationLine| {
        let sd = if c.determined { format_percent(c.sd_relative) } else { DASH.to_owned() };
        vec![
            (product_html(&c.words), CellStyle::Prose),
            verdict_cell(c.determined, ["determined", "open"]),
            (sd, CellStyle::Number),
        ]
    };
    let words = "These products of the parameters are what the features respond to. Those determined are \
                 known to the deviation given; along those left open the parameters can move together without \
                 a change of the features.";
    let head = [
        ("combination", CellStyle::Prose),
        ("verdict", CellStyle::Words),
        ("standard deviation", CellStyle::Number),
    ];
    let table = HtmlTable {
        caption: "Combinations of the parameters",
        head: HtmlTable::column_heads(&head),
        rows: list.iter().map(row).collect(),
    }
    .render();
    if table.is_empty() { table } else { format!("<h3>Combinations</h3>\n{}{table}", reading_hint(words)) }
}

pub(super) fn search_html(report: &Report) -> String {
    let s = &report.search;
    let Some(status) = s.status else { return String::new() };
    if report.misfit.is_some() {
        return facts_list(&trace_search_facts(report, status));
    }
    let failed: Vec<String> = s.failed.iter().map(|f| format!("{} {}", f.count, f.reason)).collect();
    let failed = if failed.is_empty() { "none".to_owned() } else { failed.join(", ") };
    let mut found =
        vec![("status", status.name().to_owned()), ("evaluations of the model", s.evaluations.to_string())];
    found.extend([
        ("failed", failed),
        ("local searches", s.local_searches.to_string()),
        ("cost at the estimates", format_number(s.cost)),
    ]);
    found.push(("rise in cost that bounds a 95 % interval", format_number(s.threshold)));
    found.push(("twins fitted again", if s.twins == 0 { "none".to_owned() } else { s.twins.to_string() }));
    found.push(("combinations determined", format!("{} of {}", s.rank, report.parameters.len())));
    found.push((
        "condition number",
        s.condition.map_or_else(
            || "infinite: no feature responds to one of the combinations".to_owned(),
            format_number,
        ),
    ));
    let found: Vec<(String, String)> =
        found.into_iter().map(|(name, value)| (escape_text(name), escape_text(&value))).collect();
    [facts_list(&found), gate_table(&report.gate), sentence_list(&report.gate_notes)].concat()
}

/// A fit to traces has iterates and starts in place of evaluations and a gate.
fn trace_search_facts(report: &Report, status: FitStatus) -> Vec<(String, String)> {
    let s = &report.search;
    let found = [
        ("status", status.name().to_owned()),
        ("iterates", s.evaluations.to_string()),
        ("starts", s.local_searches.to_string()),
        ("cost at the estimates", format_number(s.cost)),
        ("combinations determined", format!("{} of {}", s.rank, report.parameters.len())),
    ];
    found.into_iter().map(|(name, value)| (escape_text(name), escape_text(&value))).collect()
}

fn gate_table(probes: &[ProbeLine]) -> String {
    let row = |(i, p): (usize, &ProbeLine)| {
        let ran = p
            .failure
            .as_deref()
            .map_or_else(|| ("ran".to_owned(), CellStyle::Good), |why| (prose_html(why), CellStyle::Bad));
        let condition = format_or_dash(p.condition, format_number);
        let determines = if p.determines.is_empty() {
            "none alone".to_owned()
        } else {
            p.determines.iter().map(|name| breakable_key(name)).collect::<Vec<_>>().join(", ")
        };
        let number = |count: usize| (count.to_string(), CellStyle::Number);
        vec![
            number(i + 1),
            ran,
            number(p.features_seen),
            number(p.rank),
            (condition, CellStyle::Number),
            (determines, CellStyle::Prose),
        ]
    };
    let head = [
        ("place", CellStyle::Number),
        ("model", CellStyle::Words),
        ("features found", CellStyle::Number),
        ("combinations determined", CellStyle::Number),
    ];
    let head = [
        &head[..],
        &[("condition number", CellStyle::Number), ("parameters determined alone", CellStyle::Prose)],
    ]
    .concat();
    let rows = probes.iter().enumerate().map(row).collect();
    let table = HtmlTable {
        caption: "The gate: places of the box that were probed before the search",
        head: HtmlTable::column_heads(&head),
        rows,
    }
    .render();
    if table.is_empty() { table } else { format!("<h3>Gate</h3>\n{table}") }
}
