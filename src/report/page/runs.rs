//! How the best model ran, and its hard events: a zero is said as plainly as a number.

use super::html::{Cell, Set, Table, about, name, text};
use crate::report::RunLine;
use crate::text::{number, percent};

/// A row: what is counted, what of a run, and whether it is a hard event that is better absent.
type Row = (&'static str, fn(&RunLine) -> String, bool);

const ROWS: [Row; 12] = [
    ("how it ended", |r| format!("{}: {}", r.status.name(), r.status.meaning()), false),
    ("from, to", |r| format!("{} s, {} s", number(r.started_at_s), number(r.stopped_at_s)), false),
    ("loss of contact", |r| count(r.contact_losses), true),
    ("impact on the glass", |r| count(r.impacts), true),
    ("jam (Painlev\u{e9} paradox)", |r| count(r.jams), true),
    ("indeterminate contact", |r| once(r.indeterminate), true),
    ("chattering", |r| once(r.chattering), true),
    ("least normal force in contact", |r| r.least_normal_force_n.map_or_else(absent, force), false),
    (
        "least Painlev\u{e9} indicator in slip",
        |r| r.least_painleve_indicator.map_or_else(absent, number),
        false,
    ),
    ("changes of mode", |r| r.transitions.to_string(), false),
    (
        "sticks, share of the run",
        |r| {
            format!(
                "{}, {}",
                count(r.sticks),
                r.stick_share.map_or_else(absent, |s| percent((s * 1e3).round() / 1e3))
            )
        },
        false,
    ),
    (
        "longest stick",
        |r| r.longest_stick_s.map_or_else(absent, |s| format!("{} ms", number(1e3 * s))),
        false,
    ),
];

const NONE: &str = "none";
/// Less is the rounding of a force that vanishes, N: the blade presses with some 0.1 N.
const ROUNDING_N: f64 = 1e-9;

fn force(newtons: f64) -> String {
    if newtons.abs() < ROUNDING_N { "0 N".to_owned() } else { format!("{} N", number(newtons)) }
}

fn count(n: usize) -> String {
    if n == 0 { NONE.to_owned() } else { n.to_string() }
}

fn once(happened: bool) -> String {
    if happened { "ended the run".to_owned() } else { NONE.to_owned() }
}

fn absent() -> String {
    NONE.to_owned()
}

/// The table, a column a condition.
pub(super) fn events(runs: &[RunLine]) -> String {
    let one = |(what, of, hard): &Row| -> Vec<Cell> {
        let cell = |run| {
            let value = of(run);
            let set = if *hard && value != NONE { Set::Bad } else { Set::Words };
            (text(&value), set)
        };
        std::iter::once((text(what), Set::Words)).chain(runs.iter().map(cell)).collect()
    };
    if runs.is_empty() {
        return String::new();
    }
    let heads = std::iter::once((text("event"), Set::Words))
        .chain(runs.iter().map(|run| (name(&run.name), Set::Name)));
    let table = Table {
        caption: "Hard events of the best model, by condition",
        head: heads.collect(),
        rows: ROWS.iter().map(one).collect(),
    };
    let words = "The normal force falls to zero where contact is lost; a Painlev\u{e9} indicator of zero or \
                 less is a jam.";
    about(words) + &table.html()
}
