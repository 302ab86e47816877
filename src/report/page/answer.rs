//! The first screen: whether the model explains the recording, the blade's numbers, and what to do next.

use super::html::{Cell, Set, Table, sentence, text, verdict, worded};
use crate::report::statement::Statement;
use crate::report::{Answer, Quantity, Report};
use crate::text::{self, interval, number};

pub(super) fn answer(report: &Report) -> String {
    let answer = Answer::of(report);
    format!(
        "{}{}<p>{}</p>\n<p><strong>Next:</strong> {}</p>\n",
        headline(&answer.headline),
        quantities(&answer.quantities),
        sentence(&answer.certainty),
        sentence(&answer.next)
    )
}

fn headline(said: &Statement) -> String {
    let class = match said.good {
        Some(true) => " good",
        Some(false) => " bad",
        None => "",
    };
    let details: String = said.details.iter().map(|d| format!("<li>{}</li>\n", sentence(d))).collect();
    let details = if details.is_empty() { details } else { format!("<ul>\n{details}</ul>\n") };
    format!("<div class=\"headline{class}\"><p>{}</p>\n{details}</div>\n", sentence(&said.statement))
}

fn quantities(list: &[Quantity]) -> String {
    let head =
        [("quantity", Set::Prose), ("value", Set::Number), ("95 % interval", Set::Number), ("", Set::Words)];
    Table { caption: "The blade", head: Table::heads(&head), rows: list.iter().map(row).collect() }.html()
}

fn row(q: &Quantity) -> Vec<Cell> {
    let (unit, factor) = text::unit(&q.unit, [q.value]);
    let unit = if unit.is_empty() { unit } else { format!(" {}", text(&unit)) };
    let range = match q.lower_95.or(q.upper_95) {
        Some(_) => interval(q.lower_95, q.upper_95, |end| number(end * factor)),
        None if q.fitted => "not known".to_owned(),
        None => "held fixed".to_owned(),
    };
    let sure = if q.fitted {
        verdict(q.identified, ["determined", "not determined"])
    } else {
        (text("from the scene"), Set::Words)
    };
    vec![
        (worded(&q.name, &q.keys), Set::Prose),
        (format!("{}{unit}", number(q.value * factor)), Set::Number),
        (text(&range), Set::Number),
        sure,
    ]
}
