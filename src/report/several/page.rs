//! The page of a comparison of fits.

use super::fitted::{Entry, Several};
use super::intervals::estimate;
use super::shared::SharedParameter;
use crate::compare::{Comparison, ParameterLine};
use crate::report::page::html::{
    Cell, Section, Set, Table, about, document, figures, key, list, name, statements, text,
};
use crate::report::page::{banner, provenance, values};
use crate::text::{DASH, number, or_dash};

/// The page; the same comparison always gives the same bytes.
#[must_use]
pub fn page(several: &Several) -> String {
    let section = |id, heading, html: String| Section { id, heading, html, folded: false };
    let sections = [
        section(
            "verdict",
            "Verdict",
            format!("<div class=\"verdict\">\n{}</div>\n", statements(&several.statements)),
        ),
        section("fits", "Fits", fits(&several.fits)),
        section("parameters", "Parameters", parameters(several)),
        section("figures", "Figures", figures(&several.figures, 0, true)),
        section(
            "components",
            "Components",
            values::of_fits(
                "Components: target against model, by fit",
                &side_by_side(several, |e| &e.report.components),
            ),
        ),
        section(
            "features",
            "Features",
            values::of_fits(
                "Features: target against model, by fit",
                &side_by_side(several, |e| &e.report.features),
            ),
        ),
        section(
            "held-out",
            "Held-out predictions",
            values::of_fits("Held-out values, by fit", &side_by_side(several, |e| &e.report.held_out)),
        ),
        section("reservations", "Reservations", each(several, |e| list(&e.report.notes))),
        section("provenance", "Provenance", each(several, |e| provenance(&e.report.provenance))),
    ];
    document(&several.title, &several.fits.iter().map(lead).collect::<String>(), &sections)
}

/// What the data of a fit are, with its name.
fn lead(entry: &Entry) -> String {
    banner(&entry.report).replacen("role=\"note\">", &format!("role=\"note\">{}: ", name(&entry.name)), 1)
}

/// The fits in a table.
fn fits(entries: &[Entry]) -> String {
    let row = |e: &Entry| -> Vec<Cell> {
        let share =
            |met: usize, of: usize| (format!("{met} of {of}"), if met == of { Set::Good } else { Set::Bad });
        let of = |list: &[Comparison]| share(list.iter().filter(|c| c.pass).count(), list.len());
        let known = e.report.parameters.iter().filter(|p| p.is_identified()).count();
        let data: Vec<String> = e
            .report
            .recordings
            .iter()
            .map(|r| format!("{}{}", name(&r.name), if r.synthetic { " (synthetic)" } else { "" }))
            .collect();
        let data = if data.is_empty() { "published numbers".to_owned() } else { data.join(", ") };
        let status = (
            or_dash(e.report.search.status, |status| text(status.word())),
            if e.verdict.search_converged { Set::Good } else { Set::Bad },
        );
        let title = (name(&e.report.title), Set::Prose);
        vec![
            (name(&e.name), Set::Words),
            title,
            (data, Set::Words),
            of(&e.report.components),
            of(&e.report.features),
            share(known, e.report.parameters.len()),
            status,
        ]
    };
    let head = [
        ("fit", Set::Words),
        ("title", Set::Prose),
        ("data", Set::Words),
        ("components met", Set::Words),
        ("features met", Set::Words),
    ];
    let head = [&head[..], &[("parameters determined", Set::Words), ("search", Set::Words)]].concat();
    Table { caption: "The fits", head: Table::heads(&head), rows: entries.iter().map(row).collect() }.html()
}

/// Estimates side by side.
fn parameters(several: &Several) -> String {
    let cell = |line: &Option<ParameterLine>| -> Cell {
        let Some(line) = line else { return ("not free".to_owned(), Set::Words) };
        let [estimate, interval] = estimate(line);
        let place = |inside: bool| if inside { " inside" } else { " outside" };
        let placed = |inside| if line.is_bounded() { place(inside) } else { "" };
        let truth = line
            .truth
            .map_or_else(String::new, |t| format!("<br>truth {}{}", number(t.value), placed(t.inside_95)));
        let class = if line.is_identified() { "good" } else { "bad" };
        (
            format!(
                "{estimate}<br>{interval}<br><span class=\"{class}\">{}</span>{truth}",
                text(line.verdict.word())
            ),
            Set::Words,
        )
    };
    let pairs = |p: &SharedParameter| -> Cell {
        let said: Vec<String> = p
            .pairs
            .iter()
            .map(|pair| {
                format!("{} and {} {}", name(&pair.fits[0]), name(&pair.fits[1]), pair.relation.words())
            })
            .collect();
        (if said.is_empty() { DASH.to_owned() } else { said.join("<br>") }, Set::Prose)
    };
    let row = |p: &SharedParameter| -> Vec<Cell> {
        let named = [(key(&p.name), Set::Words), (text(&p.symbol), Set::Words), (text(&p.unit), Set::Words)];
        named.into_iter().chain(p.lines.iter().map(cell)).chain([pairs(p)]).collect()
    };
    if several.parameters.is_empty() {
        return String::new();
    }
    let head = [("parameter", Set::Words), ("symbol", Set::Words), ("unit", Set::Words)];
    let fits = several.fits.iter().map(|fit| (name(&fit.name), Set::Words));
    let head = Table::heads(&head)
        .into_iter()
        .chain(fits)
        .chain([("95 % intervals".to_owned(), Set::Prose)])
        .collect();
    let words = "Estimate, 95 % interval and verdict of each fit. Intervals that do not overlap differ by \
                 more than their own uncertainty; that they overlap does not show \
                 that the values are equal. A parameter that is not identified, or lies at a bound, is not \
                 compared.";
    about(words)
        + &Table { caption: "Parameters, by fit", head, rows: several.parameters.iter().map(row).collect() }
            .html()
}

/// Lines of all fits, those of the same name together, each with the name of its fit.
fn side_by_side(several: &Several, of: impl Fn(&Entry) -> &Vec<Comparison>) -> Vec<Comparison> {
    let mut lines: Vec<Comparison> = Vec::new();
    for entry in &several.fits {
        for line in of(entry) {
            let condition = line
                .condition
                .as_ref()
                .map_or_else(|| entry.name.clone(), |condition| format!("{}: {condition}", entry.name));
            let at = lines.iter().rposition(|l| l.name == line.name).map_or(lines.len(), |at| at + 1);
            lines.insert(at, Comparison { condition: Some(condition), ..line.clone() });
        }
    }
    lines
}

/// Something of every fit, under its name.
fn each(several: &Several, of: impl Fn(&Entry) -> String) -> String {
    several.fits.iter().map(|entry| format!("<h3>{}</h3>\n{}", name(&entry.name), of(entry))).collect()
}
