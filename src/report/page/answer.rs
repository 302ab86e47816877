//! The first screen: whether the model explains the recording, the blade's numbers, and what to do next.

use super::html::{
    CellStyle, HtmlCell, HtmlTable, escape_text, sentence_html, verdict_cell, words_with_keys,
};
use crate::report::statement::Statement;
use crate::report::{Report, ReportSummary, SummaryQuantity};
use crate::text::{self, format_interval, format_number};

pub(super) fn summary_html(report: &Report) -> String {
    let answer = ReportSummary::from_report(report);
    format!(
        "{}{}<p>{}</p>\n<p><strong>Next:</strong> {}</p>\n",
        headline_html(&answer.headline),
        quantities_html(&answer.quantities),
        sentence_html(&answer.certainty),
        sentence_html(&answer.next)
    )
}

fn headline_html(said: &Statement) -> String {
    let class = match said.good {
        Some(true) => " good",
        Some(false) => " bad",
        None => "",
    };
    let details: String = said.details.iter().map(|d| format!("<li>{}</li>\n", sentence_html(d))).collect();
    let details = if details.is_empty() { details } else { format!("<ul>\n{details}</ul>\n") };
    format!("<div class=\"headline{class}\"><p>{}</p>\n{details}</div>\n", sentence_html(&said.statement))
}

fn quantities_html(list: &[SummaryQuantity]) -> String {
    let head = [
        ("quantity", CellStyle::Prose),
        ("value", CellStyle::Number),
        ("95 % interval", CellStyle::Number),
        ("", CellStyle::Words),
    ];
    HtmlTable {
        caption: "The blade",
        head: HtmlTable::column_heads(&head),
        rows: list.iter().map(quantity_row).collect(),
    }
    .render()
}

fn quantity_row(q: &SummaryQuantity) -> Vec<HtmlCell> {
    let (unit, factor) = text::choose_prefix(&q.unit, [q.value]);
    let unit = if unit.is_empty() { unit } else { format!(" {}", escape_text(&unit)) };
    let range = match q.lower_95.or(q.upper_95) {
        Some(_) => format_interval(q.lower_95, q.upper_95, |end| format_number(end * factor)),
        None if q.fitted => "not known".to_owned(),
        None => "held fixed".to_owned(),
    };
    let sure = if q.fitted {
        verdict_cell(q.identified, ["determined", "not determined"])
    } else {
        (escape_text("from the scene"), CellStyle::Words)
    };
    vec![
        (words_with_keys(&q.name, &q.keys), CellStyle::Prose),
        (format!("{}{unit}", format_number(q.value * factor)), CellStyle::Number),
        (escape_text(&range), CellStyle::Number),
        sure,
    ]
}
