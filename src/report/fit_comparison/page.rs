//! The page of a comparison of fits: one table with a column for each fit, and one figure.

use super::{ComparedFit, FitComparison};
use crate::compare::{ParameterLine, TargetComparison};
use crate::report::page::html::CellStyle::{Bad, Good, Name, Words};
use crate::report::page::html::*;
use crate::report::page::{data_banner, provenance_html};
use crate::report::summary::report_headline;
use crate::text::{self, DASH, format_interval, format_number, format_or_dash, format_with_sd};

/// The page; the same comparison always gives the same bytes.
pub(crate) fn render_page(several: &FitComparison) -> String {
    let section = |id, heading, html: String, folded| PageSection { id, heading, html, folded };
    let statements = statements_html(&several.statements);
    let reservations = section_per_fit(several, |e| sentence_list(&e.report.notes));
    let provenance = section_per_fit(several, |e| provenance_html(&e.report.provenance));
    let figure = figures_html(&several.figure, 0);
    let sections = [
        section("verdict", "Verdict", format!("<div class=\"verdict\">\n{statements}</div>\n"), false),
        section("fits", "Fits", comparison_table(several), false),
        section("figure", "Parameters", figure, false),
        section("reservations", "Reservations", reservations, true),
        section("provenance", "Provenance", provenance, true),
    ];
    render_document(&several.title, &several.fits.iter().map(data_lead).collect::<String>(), &sections)
}

/// The banner that states the kind of data of a fit, beginning with the name of the fit.
fn data_lead(entry: &ComparedFit) -> String {
    let named = format!("role=\"note\">{}: ", isolate_name(&entry.name));
    data_banner(&entry.report).replacen("role=\"note\">", &named, 1)
}

/// The table: verdict, data and search, then every target and every parameter.
fn comparison_table(several: &FitComparison) -> String {
    let fits = &several.fits;
    let names = fits.iter().map(|fit| (isolate_name(&fit.name), Name));
    let head = column_heads(&[(Words, "")]).into_iter().chain(names).collect();
    let row = |first: String, cells: Vec<HtmlCell>| std::iter::once((first, Words)).chain(cells).collect();
    let mut rows: Vec<Vec<HtmlCell>> = vec![
        row("title".to_owned(), fits.iter().map(|fit| (isolate_name(&fit.report.title), Name)).collect()),
        row("verdict".to_owned(), fits.iter().map(verdict_cell).collect()),
        row("data".to_owned(), fits.iter().map(data_cell).collect()),
        row("search".to_owned(), fits.iter().map(search_cell).collect()),
    ];
    let mut targets: Vec<(&str, Option<&str>)> = Vec::new();
    for key in fits.iter().flat_map(fit_targets).map(target_key) {
        if !targets.contains(&key) {
            targets.push(key);
        }
    }
    for key in targets {
        let condition = key.1.map_or_else(String::new, |of| format!(" ({})", isolate_name(of)));
        let found = |fit| fit_targets(fit).find(|c| target_key(c) == key);
        let cells = fits.iter().map(|fit| found(fit).map_or_else(empty_cell, target_cell)).collect();
        rows.push(row(isolate_name(key.0) + &condition, cells));
    }
    for p in &several.parameters {
        let cells =
            p.lines.iter().map(|line| line.as_ref().map_or_else(empty_cell, parameter_cell)).collect();
        rows.push(row(parameter_html(&p.name), cells));
    }
    let words = "An interval does not include errors in the numbers of a scene that were not fitted: where \
                 scenes differ, so may the estimates. That intervals overlap does not show that the values \
                 are equal.";
    render_table("The fits side by side", head, rows) + &reading_hint(words)
}

/// All targets of a fit, fitted or held out.
fn fit_targets(fit: &ComparedFit) -> impl Iterator<Item = &TargetComparison> {
    fit.report.components.iter().chain(&fit.report.features).chain(&fit.report.held_out)
}

/// Name and condition of a target. Targets of several fits with the same key share a row.
fn target_key(target: &TargetComparison) -> (&str, Option<&str>) {
    (&target.name, target.condition.as_deref())
}

fn empty_cell() -> HtmlCell {
    (DASH.to_owned(), Words)
}

fn verdict_cell(fit: &ComparedFit) -> HtmlCell {
    let style = if fit.verdict.passes() { Good } else { Bad };
    (sentence_html(&report_headline(&fit.report).statement), style)
}

fn data_cell(fit: &ComparedFit) -> HtmlCell {
    let source = |synthetic| if synthetic { " (synthetic)" } else { "" };
    let recordings = fit.report.recordings.iter();
    let data: Vec<String> = recordings.map(|r| isolate_name(&r.name) + source(r.synthetic)).collect();
    (if data.is_empty() { "published numbers".to_owned() } else { data.join(", ") }, Words)
}

fn search_cell(fit: &ComparedFit) -> HtmlCell {
    let status = format_or_dash(fit.report.search.status, |status| escape_text(status.name()));
    (status, if fit.verdict.search_converged { Good } else { Bad })
}

fn target_cell(c: &TargetComparison) -> HtmlCell {
    let (unit, factor) = text::choose_prefix(&c.unit, [c.target]);
    let target = format_with_sd(c.target * factor, c.target_sd.map(|sd| sd * factor));
    let model = format_or_dash(c.model, |model| format_number(model * factor));
    let html = format!("model {model} {}<br>target {target}", escape_text(&unit));
    (html, if c.pass { Good } else { Bad })
}

fn parameter_cell(p: &ParameterLine) -> HtmlCell {
    let (unit, factor) = text::choose_prefix(&p.unit, [p.estimate]);
    let number = |value: f64| format_number(value * factor);
    let truth = p.truth.map_or_else(String::new, |truth| format!("<br>truth {}", number(truth.value)));
    let html = format!(
        "{} {}<br>{}<br>{}{truth}",
        number(p.estimate),
        escape_text(&unit),
        format_interval(p.lower_95, p.upper_95, number),
        escape_text(p.verdict.name())
    );
    (html, if p.is_identified() { Good } else { Bad })
}

/// The section of each fit, under its name.
fn section_per_fit(several: &FitComparison, of: impl Fn(&ComparedFit) -> String) -> String {
    let section = |entry: &ComparedFit| format!("<h3>{}</h3>\n{}", isolate_name(&entry.name), of(entry));
    several.fits.iter().map(section).collect()
}
