//! How the best model ran, and its hard events: a zero is said as plainly as a number.

use super::html::{CellStyle, HtmlCell, HtmlTable, escape_text, isolate_name, reading_hint};
use crate::report::RunSummary;
use crate::text::{format_number, format_percent};

/// A row: what is counted, what of a run, and whether it is a hard event that is better absent.
type EventRow = (&'static str, fn(&RunSummary) -> String, bool);

const EVENT_ROWS: [EventRow; 12] = [
    ("how it ended", |r| format!("{}: {}", r.status.name(), r.status.meaning()), false),
    (
        "from, to",
        |r| format!("{} s, {} s", format_number(r.started_at_s), format_number(r.stopped_at_s)),
        false,
    ),
    ("loss of contact", |r| count_text(r.contact_losses), true),
    ("impact on the glass", |r| count_text(r.impacts), true),
    ("jam (Painlev\u{e9} paradox)", |r| count_text(r.jams), true),
    ("indeterminate contact", |r| occurrence_text(r.indeterminate), true),
    ("chattering", |r| occurrence_text(r.chattering), true),
    ("least normal force in contact", |r| r.least_normal_force_n.map_or_else(absent_text, force_text), false),
    (
        "least Painlev\u{e9} indicator in slip",
        |r| r.least_painleve_indicator.map_or_else(absent_text, format_number),
        false,
    ),
    ("changes of mode", |r| r.transitions.to_string(), false),
    (
        "sticks, share of the run",
        |r| {
            format!(
                "{}, {}",
                count_text(r.sticks),
                r.stick_share.map_or_else(absent_text, |s| format_percent((s * 1e3).round() / 1e3))
            )
        },
        false,
    ),
    (
        "longest stick",
        |r| r.longest_stick_s.map_or_else(absent_text, |s| format!("{} ms", format_number(1e3 * s))),
        false,
    ),
];

const NO_EVENTS: &str = "none";
/// Less is the rounding of a force that vanishes, N: the blade presses with some 0.1 N.
const ROUNDING_N: f64 = 1e-9;

fn force_text(newtons: f64) -> String {
    if newtons.abs() < ROUNDING_N { "0 N".to_owned() } else { format!("{} N", format_number(newtons)) }
}

fn count_text(n: usize) -> String {
    if n == 0 { NO_EVENTS.to_owned() } else { n.to_string() }
}

fn occurrence_text(happened: bool) -> String {
    if happened { "ended the run".to_owned() } else { NO_EVENTS.to_owned() }
}

fn absent_text() -> String {
    NO_EVENTS.to_owned()
}

/// The table, a column a condition.
pub(super) fn events_table(runs: &[RunSummary]) -> String {
    let one = |(what, of, hard): &EventRow| -> Vec<HtmlCell> {
        let cell = |run| {
            let value = of(run);
            let set = if *hard && value != NO_EVENTS { CellStyle::Bad } else { CellStyle::Words };
            (escape_text(&value), set)
        };
        std::iter::once((escape_text(what), CellStyle::Words)).chain(runs.iter().map(cell)).collect()
    };
    if runs.is_empty() {
        return String::new();
    }
    let heads = std::iter::once((escape_text("event"), CellStyle::Words))
        .chain(runs.iter().map(|run| (isolate_name(&run.name), CellStyle::Name)));
    let table = HtmlTable {
        caption: "Hard events of the best model, by condition",
        head: heads.collect(),
        rows: EVENT_ROWS.iter().map(one).collect(),
    };
    let words = "The normal force falls to zero where contact is lost; a Painlev\u{e9} indicator of zero or \
                 less is a jam.";
    reading_hint(words) + &table.render()
}
