//! Sections on the parameters, the search, and the identifiability check before the search (the gate).

use super::html::CellStyle::{Bad, Good, Number, Prose, Words};
use super::html::*;
use crate::compare::ParameterLine;
use crate::report::{CombinationLine, ProbeLine, Report};
use crate::text::{self, DASH, format_interval, format_number, format_or_dash, format_percent};

pub(super) fn parameters_html(report: &Report) -> String {
    if report.parameters.is_empty() {
        return String::new();
    }
    let estimates = estimates_table(&report.parameters);
    if report.misfit.is_some() {
        return reading_hint(OF_TRACES) + &estimates;
    }
    let intervals = intervals_table(&report.parameters, report.search.twins);
    [reading_hint(OF_FEATURES), estimates, intervals, combinations_table(&report.combinations)].concat()
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
    let with_reason = list.iter().any(|p| p.why.is_some());
    let mut head =
        vec![(Words, "parameter|symbol|unit"), (Number, "estimate|95 % interval"), (Words, "verdict")];
    if with_truth {
        head.extend([(Number, "truth (synthetic)"), (Words, "truth inside")]);
    }
    head.extend(with_reason.then_some((Prose, "why not")));
    let row = |p: &ParameterLine| {
        let (unit, factor) = text::choose_prefix(&p.unit, [p.estimate]);
        let number = |value: f64| format_number(value * factor);
        let mut cells = vec![
            (parameter_html(&p.name), Words),
            (escape_text(&p.symbol), Words),
            (escape_text(&unit), Words),
            (number(p.estimate), Number),
            (format_interval(p.lower_95, p.upper_95, number), Number),
            verdict_cell(p.is_identified(), [p.verdict.name(); 2]),
        ];
        if with_truth {
            let truth = p.truth.filter(|_| p.is_bounded());
            let unknown = || (DASH.to_owned(), Words);
            let inside = truth.map_or_else(unknown, |truth| verdict_cell(truth.inside_95, ["yes", "no"]));
            cells.extend([(format_or_dash(p.truth, |truth| number(truth.value)), Number), inside]);
        }
        cells.extend(with_reason.then(|| (format_or_dash(p.why.as_deref(), prose_html), Prose)));
        cells
    };
    render_table("Estimates and verdicts", column_heads(&head), list.iter().map(row).collect())
}

fn intervals_table(list: &[ParameterLine], twins: usize) -> String {
    let head = [
        (Words, "parameter"),
        (Number, "profile likelihood|twins fitted again|linear model|bounds of the search"),
        (Words, "prior"),
    ];
    let row = |p: &ParameterLine| -> Vec<HtmlCell> {
        let [lower, upper] = p.profile_95;
        let prior = if p.prior { "counts" } else { "none" };
        let (_, factor) = text::choose_prefix(&p.unit, [p.estimate]);
        let number = |value: f64| format_number(value * factor);
        let ends = |ends: Option<[f64; 2]>, none: &str| {
            ends.map_or_else(|| none.to_owned(), |[low, high]| format_interval(Some(low), Some(high), number))
        };
        vec![
            (parameter_html(&p.name), Words),
            (format_interval(lower, upper, number), Number),
            (ends(p.bootstrap_95, if twins == 0 { "no twins" } else { "too few twins" }), Number),
            (ends(p.linear_95, "not determined"), Number),
            (ends(Some(p.bounds), ""), Number),
            (prior.to_owned(), Words),
        ]
    };
    let words = "In the units of the table above. Profile: where the lowest cost over all other parameters has risen by the threshold. \
                 Twins: synthetic data from the best model, fitted again. Linear: from the sensitivities at \
                 the estimates alone.";
    render_table("The three 95 % intervals", column_heads(&head), list.iter().map(row).collect())
        + &reading_hint(words)
}

/// A product such as `friction.c friction.a^0.31`, with its exponents as superscripts.
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
            (product_html(&c.words), Prose),
            verdict_cell(c.determined, ["determined", "open"]),
            (sd, Number),
        ]
    };
    let words = "These products of the parameters are what the features respond to. Those determined are \
                 known to the deviation given; along those left open the parameters can move together without \
                 a change of the features.";
    let head = [(Prose, "combination"), (Words, "verdict"), (Number, "standard deviation")];
    let table =
        render_table("Combinations of the parameters", column_heads(&head), list.iter().map(row).collect());
    if table.is_empty() { table } else { format!("<h3>Combinations</h3>\n{}{table}", reading_hint(words)) }
}

pub(super) fn search_html(report: &Report) -> String {
    let s = &report.search;
    let Some(status) = s.status else { return String::new() };
    let determined = format!("{} of {}", s.rank, report.parameters.len());
    // the search of a fit to traces has iterates and starts instead of evaluations and a gate (check before
    // it)
    if report.misfit.is_some() {
        return search_facts(&[
            ("status", status.name().to_owned()),
            ("iterates", s.evaluations.to_string()),
            ("starts", s.local_searches.to_string()),
            ("cost at the estimates", format_number(s.cost)),
            ("combinations determined", determined),
        ]);
    }
    let failed: Vec<String> = s.failed.iter().map(|f| format!("{} {}", f.count, f.reason)).collect();
    let failed = if failed.is_empty() { "none".to_owned() } else { failed.join(", ") };
    let twins = if s.twins == 0 { "none".to_owned() } else { s.twins.to_string() };
    let infinite = || "infinite: no feature responds to one of the combinations".to_owned();
    let facts = search_facts(&[
        ("status", status.name().to_owned()),
        ("evaluations of the model", s.evaluations.to_string()),
        ("failed", failed),
        ("local searches", s.local_searches.to_string()),
        ("cost at the estimates", format_number(s.cost)),
        ("rise in cost that bounds a 95 % interval", format_number(s.threshold)),
        ("twins fitted again", twins),
        ("combinations determined", determined),
        ("condition number", s.condition.map_or_else(infinite, format_number)),
    ]);
    [facts, gate_table(&report.gate), sentence_list(&report.gate_notes)].concat()
}

fn search_facts(facts: &[(&str, String)]) -> String {
    let escaped = facts.iter().map(|(name, value)| (escape_text(name), escape_text(value)));
    facts_list(&escaped.collect::<Vec<_>>())
}

fn gate_table(probes: &[ProbeLine]) -> String {
    let row = |(i, p): (usize, &ProbeLine)| {
        let ran = p.failure.as_deref().map_or_else(|| ("ran".to_owned(), Good), |why| (prose_html(why), Bad));
        let condition = format_or_dash(p.condition, format_number);
        let determines =
            if p.determines.is_empty() { "none alone".to_owned() } else { keys_html(&p.determines) };
        let number = |count: usize| (count.to_string(), Number);
        vec![
            number(i + 1),
            ran,
            number(p.features_seen),
            number(p.rank),
            (condition, Number),
            (determines, Prose),
        ]
    };
    let head = [
        (Number, "place"),
        (Words, "model"),
        (Number, "features found|combinations determined|condition number"),
        (Prose, "parameters determined alone"),
    ];
    let rows = probes.iter().enumerate().map(row).collect();
    let table = render_table(
        "The gate: places of the box that were probed before the search",
        column_heads(&head),
        rows,
    );
    if table.is_empty() { table } else { format!("<h3>Gate</h3>\n{table}") }
}
