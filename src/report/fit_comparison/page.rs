//! The page of a comparison of fits.

use super::intervals::estimate_text;
use super::{ComparedFit, FitComparison, IntervalPair, SharedParameter};
use crate::compare::{ParameterLine, TargetComparison};
use crate::report::page::html::CellStyle::{Bad, Good, Prose, Words};
use crate::report::page::html::*;
use crate::report::page::{agreement, data_banner, provenance_html};
use crate::text::{DASH, format_number, format_or_dash};

/// The page; the same comparison always gives the same bytes.
pub(crate) fn render_page(several: &FitComparison) -> String {
    let section = |id, heading, html: String| PageSection { id, heading, html, folded: false };
    let compared = |caption: &str, of: fn(&ComparedFit) -> &Vec<TargetComparison>| {
        agreement::fits_table(caption, &merge_comparisons(several, of))
    };
    let statements = statements_html(&several.statements);
    let components = compared("Components: target against model, by fit", |e| &e.report.components);
    let features = compared("Features: target against model, by fit", |e| &e.report.features);
    let held_out = compared("Held-out values, by fit", |e| &e.report.held_out);
    let provenance = section_per_fit(several, |e| provenance_html(&e.report.provenance));
    let sections = [
        section("verdict", "Verdict", format!("<div class=\"verdict\">\n{statements}</div>\n")),
        section("fits", "Fits", fits_table(&several.fits)),
        section("parameters", "Parameters", parameters_table(several)),
        section("figures", "Figures", figures_html(&several.figures, 0, true)),
        section("components", "Components", components),
        section("features", "Features", features),
        section("held-out", "Held-out predictions", held_out),
        section("reservations", "Reservations", section_per_fit(several, |e| sentence_list(&e.report.notes))),
        section("provenance", "Provenance", provenance),
    ];
    render_document(&several.title, &several.fits.iter().map(data_lead).collect::<String>(), &sections)
}

/// The banner that states the kind of data of a fit, beginning with the name of the fit.
fn data_lead(entry: &ComparedFit) -> String {
    let named = format!("role=\"note\">{}: ", isolate_name(&entry.name));
    data_banner(&entry.report).replacen("role=\"note\">", &named, 1)
}

/// Table of the fits.
fn fits_table(entries: &[ComparedFit]) -> String {
    let row = |e: &ComparedFit| -> Vec<HtmlCell> {
        let share = |met: usize, of: usize| (format!("{met} of {of}"), if met == of { Good } else { Bad });
        let of = |list: &[TargetComparison]| share(list.iter().filter(|c| c.pass).count(), list.len());
        let known = e.report.parameters.iter().filter(|p| p.is_identified()).count();
        let source = |synthetic| if synthetic { " (synthetic)" } else { "" };
        let recordings = e.report.recordings.iter();
        let data: Vec<String> = recordings.map(|r| isolate_name(&r.name) + source(r.synthetic)).collect();
        let data = if data.is_empty() { "published numbers".to_owned() } else { data.join(", ") };
        let status = format_or_dash(e.report.search.status, |status| escape_text(status.name()));
        vec![
            (isolate_name(&e.name), Words),
            (isolate_name(&e.report.title), Prose),
            (data, Words),
            of(&e.report.components),
            of(&e.report.features),
            share(known, e.report.parameters.len()),
            (status, if e.verdict.search_converged { Good } else { Bad }),
        ]
    };
    let head = [
        (Words, "fit"),
        (Prose, "title"),
        (Words, "data|components met|features met|parameters determined|search"),
    ];
    render_table("The fits", column_heads(&head), entries.iter().map(row).collect())
}

/// Table of the parameters, with one column for each fit.
fn parameters_table(several: &FitComparison) -> String {
    let cell = |line: &Option<ParameterLine>| -> HtmlCell {
        let Some(line) = line else { return ("not free".to_owned(), Words) };
        let [estimate, interval] = estimate_text(line);
        let place = |inside: bool| if inside { " inside" } else { " outside" };
        let placed = |inside| if line.is_bounded() { place(inside) } else { "" };
        let truth = line.truth.map_or_else(String::new, |t| {
            format!("<br>truth {}{}", format_number(t.value), placed(t.inside_95))
        });
        let class = if line.is_identified() { "good" } else { "bad" };
        let verdict = escape_text(line.verdict.name());
        (format!("{estimate}<br>{interval}<br><span class=\"{class}\">{verdict}</span>{truth}"), Words)
    };
    let pairs = |p: &SharedParameter| -> HtmlCell {
        let describe = |IntervalPair { fits, relation }: &IntervalPair| {
            format!("{} and {} {}", isolate_name(&fits[0]), isolate_name(&fits[1]), relation.describe())
        };
        let said: Vec<String> = p.pairs.iter().map(describe).collect();
        (if said.is_empty() { DASH.to_owned() } else { said.join("<br>") }, Prose)
    };
    let row = |p: &SharedParameter| -> Vec<HtmlCell> {
        let named =
            [(breakable_key(&p.name), Words), (escape_text(&p.symbol), Words), (escape_text(&p.unit), Words)];
        named.into_iter().chain(p.lines.iter().map(cell)).chain([pairs(p)]).collect()
    };
    if several.parameters.is_empty() {
        return String::new();
    }
    let head = [(Words, "parameter|symbol|unit")];
    let fits = several.fits.iter().map(|fit| (isolate_name(&fit.name), Words));
    let head =
        column_heads(&head).into_iter().chain(fits).chain([("95 % intervals".to_owned(), Prose)]).collect();
    let words = "Estimate, 95 % interval and verdict of each fit. Intervals that do not overlap differ by \
                 more than their own uncertainty; that they overlap does not show \
                 that the values are equal. A parameter that is not identified, or lies at a bound, is not \
                 compared.";
    reading_hint(words)
        + &render_table("Parameters, by fit", head, several.parameters.iter().map(row).collect())
}

/// Rows of all fits, grouped by target; the condition of a row begins with the name of its fit.
fn merge_comparisons(
    several: &FitComparison,
    of: impl Fn(&ComparedFit) -> &Vec<TargetComparison>,
) -> Vec<TargetComparison> {
    let mut lines: Vec<TargetComparison> = Vec::new();
    for entry in &several.fits {
        for line in of(entry) {
            let name = &entry.name;
            let condition =
                line.condition.as_ref().map_or_else(|| name.clone(), |of| format!("{name}: {of}"));
            let at = lines.iter().rposition(|l| l.name == line.name).map_or(lines.len(), |at| at + 1);
            lines.insert(at, TargetComparison { condition: Some(condition), ..line.clone() });
        }
    }
    lines
}

/// The section of each fit, under its name.
fn section_per_fit(several: &FitComparison, of: impl Fn(&ComparedFit) -> String) -> String {
    let section = |entry: &ComparedFit| format!("<h3>{}</h3>\n{}", isolate_name(&entry.name), of(entry));
    several.fits.iter().map(section).collect()
}
