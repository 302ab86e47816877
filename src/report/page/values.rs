//! Tables of what was measured and what the model shows.

use super::html::{Cell, Set, Table, about, name, prose, text, verdict};
use crate::compare::Comparison;
use crate::text::{self, digits, number, or_dash, percent, signed_percent, with_sd};

pub(super) fn components(list: &[Comparison]) -> String {
    let words = "Frequencies that the model has to meet. A component is met if it lies within the tolerance; \
                 relative error is model / target \u{2212} 1. The standard deviation of a target stands in units \
                 of the last digit: 78.40(3) is 78.40 with 0.03. A target from the job is published or assumed.";
    table("Components: target against model", words, ["component", "condition"], list)
}

pub(super) fn features(list: &[Comparison]) -> String {
    let words = "Everything else that was fitted. A feature is met if the model lies within the 95 % interval \
                 of the target, 1.96 standard deviations either side. A target from the job is published or \
                 assumed.";
    table("Features: target against model", words, ["feature", "condition"], list)
}

pub(super) fn held_out(list: &[Comparison]) -> String {
    let words = "Not fitted, but predicted by the model at the estimates and then compared with the target.";
    table("Held-out values: target against prediction", words, ["value", "condition"], list)
}

/// Values of several fits, whose names stand in place of conditions.
pub(in crate::report) fn of_fits(caption: &str, list: &[Comparison]) -> String {
    table(
        caption,
        "Relative error is model / target \u{2212} 1; what counts as met is as on the page of each fit.",
        ["name", "fit"],
        list,
    )
}

fn table(caption: &str, words: &str, [kind, condition]: [&str; 2], list: &[Comparison]) -> String {
    if list.is_empty() {
        return String::new();
    }
    let several = list.iter().any(|c| c.condition.is_some());
    let mut head = vec![(kind, Set::Words)];
    head.extend(several.then_some((condition, Set::Words)));
    head.extend([
        ("unit", Set::Words),
        ("target", Set::Number),
        ("from", Set::Words),
        ("model", Set::Number),
        ("relative error", Set::Number),
    ]);
    head.extend([("tolerance", Set::Number), ("verdict", Set::Words), ("remarks", Set::Prose)]);
    let rows = list.iter().map(|c| row(c, several)).collect();
    Table { caption, head: Table::heads(&head), rows }.html() + &about(words)
}

fn row(c: &Comparison, several: bool) -> Vec<Cell> {
    let (unit, factor) = text::unit(&c.unit, [c.target]);
    let target = with_sd(c.target * factor, c.target_sd.map(|sd| sd * factor));
    let model = or_dash(c.model, |model| number(model * factor));
    let error = or_dash(c.relative_error, signed_percent);
    let tolerance = c.tolerance_relative.map_or_else(|| "95 % interval".to_owned(), percent);
    let from = match (c.given, c.synthetic) {
        (true, _) => "job",
        (_, true) => "synthetic",
        _ => "recording",
    };
    let mut cells = vec![(name(&c.name), Set::Words)];
    cells.extend(several.then(|| (c.condition.as_deref().map(name).unwrap_or_default(), Set::Name)));
    cells.extend([
        (text(&unit), Set::Words),
        (target, Set::Number),
        (from.to_owned(), Set::Words),
        (model, Set::Number),
        (error, Set::Number),
    ]);
    cells.extend([
        (tolerance, Set::Number),
        verdict(c.pass, ["met", "not met"]),
        (prose(&remarks(c)), Set::Prose),
    ]);
    cells
}

/// What else is known of a value.
fn remarks(c: &Comparison) -> String {
    let size = |value: f64| {
        // nobody reads millihertz
        let (unit, factor) =
            if c.unit == "Hz" { (c.unit.clone(), 1.0) } else { text::unit(&c.unit, [value]) };
        format!("{} {unit}", digits(value * factor, 2)).trim_end().to_owned()
    };
    let parts = [
        c.missing.clone(),
        c.without_camera.map(|model| {
            let (unit, factor) = text::unit(&c.unit, [c.target]);
            format!("{} {unit} without the offset and the scale of its camera", number(model * factor))
        }),
        c.below_db
            .filter(|db| *db > 0.0)
            .map(|db| format!("the model\u{2019}s peak is {db:.1} dB below the strongest of its band")),
        c.next_peak.map(|p| {
            format!(
                "next peak of the model at {} Hz, {:.1} dB below the strongest",
                number(p.frequency_hz),
                p.below_db
            )
        }),
        c.twin_sd.map(|sd| format!("scatters by {} over twins", size(sd))),
        c.model_scatter.filter(|s| c.target_sd.is_some_and(|sd| *s > sd)).map(|s| {
            format!("not smooth: the model scatters by {} between neighbouring parameters", size(s))
        }),
    ];
    parts.into_iter().flatten().collect::<Vec<_>>().join("; ")
}
