//! Tables of what was measured and what the model shows.

use super::html::{
    CellStyle, HtmlCell, HtmlTable, escape_text, isolate_name, parameter_html, prose_html, reading_hint,
    verdict_cell,
};
use crate::compare::Comparison;
use crate::fit::misfit::{ChannelMisfit, StageMisfit, TraceMisfit};
use crate::fit::result::NuisanceResult;
use crate::text;
use crate::text::{
    format_decimals, format_digits, format_interval, format_number, format_or_dash, format_percent,
    format_signed_percent, format_with_sd,
};

pub(super) fn components_table(list: &[Comparison]) -> String {
    let words = "Frequencies that the model has to meet. A component is met if it lies within the tolerance; \
                 relative error is model / target \u{2212} 1. The standard deviation of a target stands in units \
                 of the last digit: 78.40(3) is 78.40 with 0.03. A target from the job is published or assumed.";
    comparison_table("Components: target against model", words, ["component", "condition"], list)
}

pub(super) fn features_table(list: &[Comparison]) -> String {
    let words = "Everything else that was fitted. A feature is met if the model lies within the 95 % interval \
                 of the target, 1.96 standard deviations either side. A target from the job is published or \
                 assumed.";
    comparison_table("Features: target against model", words, ["feature", "condition"], list)
}

pub(super) fn held_out_table(list: &[Comparison]) -> String {
    let words = "Not fitted, but predicted by the model at the estimates and then compared with the target.";
    comparison_table("Held-out values: target against prediction", words, ["value", "condition"], list)
}

/// Values of several fits, whose names stand in place of conditions.
pub(in crate::report) fn fits_table(caption: &str, list: &[Comparison]) -> String {
    comparison_table(
        caption,
        "Relative error is model / target \u{2212} 1; what counts as met is as on the page of each fit.",
        ["name", "fit"],
        list,
    )
}

fn comparison_table(caption: &str, words: &str, [kind, condition]: [&str; 2], list: &[Comparison]) -> String {
    if list.is_empty() {
        return String::new();
    }
    let several = list.iter().any(|c| c.condition.is_some());
    let mut head = vec![(kind, CellStyle::Words)];
    head.extend(several.then_some((condition, CellStyle::Words)));
    head.extend([
        ("unit", CellStyle::Words),
        ("target", CellStyle::Number),
        ("from", CellStyle::Words),
        ("model", CellStyle::Number),
        ("relative error", CellStyle::Number),
    ]);
    head.extend([
        ("tolerance", CellStyle::Number),
        ("verdict", CellStyle::Words),
        ("remarks", CellStyle::Prose),
    ]);
    let rows = list.iter().map(|c| comparison_row(c, several)).collect();
    HtmlTable { caption, head: HtmlTable::column_heads(&head), rows }.render() + &reading_hint(words)
}

fn comparison_row(c: &Comparison, several: bool) -> Vec<HtmlCell> {
    let (unit, factor) = text::choose_prefix(&c.unit, [c.target]);
    let target = format_with_sd(c.target * factor, c.target_sd.map(|sd| sd * factor));
    let model = format_or_dash(c.model, |model| format_number(model * factor));
    let error = format_or_dash(c.relative_error, format_signed_percent);
    let tolerance = c.tolerance_relative.map_or_else(|| "95 % interval".to_owned(), format_percent);
    let from = match (c.given, c.synthetic) {
        (true, _) => "job",
        (_, true) => "synthetic",
        _ => "recording",
    };
    let mut cells = vec![(isolate_name(&c.name), CellStyle::Words)];
    cells.extend(
        several.then(|| (c.condition.as_deref().map(isolate_name).unwrap_or_default(), CellStyle::Name)),
    );
    cells.extend([
        (escape_text(&unit), CellStyle::Words),
        (target, CellStyle::Number),
        (from.to_owned(), CellStyle::Words),
        (model, CellStyle::Number),
        (error, CellStyle::Number),
    ]);
    cells.extend([
        (tolerance, CellStyle::Number),
        verdict_cell(c.pass, ["met", "not met"]),
        (prose_html(&value_remarks(c)), CellStyle::Prose),
    ]);
    cells
}

/// What else is known of a value.
fn value_remarks(c: &Comparison) -> String {
    let size = |value: f64| {
        // nobody reads millihertz
        let (unit, factor) =
            if c.unit == "Hz" { (c.unit.clone(), 1.0) } else { text::choose_prefix(&c.unit, [value]) };
        format!("{} {unit}", format_digits(value * factor, 2)).trim_end().to_owned()
    };
    let parts = [
        c.missing.clone(),
        c.without_camera.map(|model| {
            let (unit, factor) = text::choose_prefix(&c.unit, [c.target]);
            format!("{} {unit} without the offset and the scale of its camera", format_number(model * factor))
        }),
        c.below_db
            .filter(|db| *db > 0.0)
            .map(|db| format!("the model\u{2019}s peak is {db:.1} dB below the strongest of its band")),
        c.next_peak.map(|p| {
            format!(
                "next peak of the model at {} Hz, {:.1} dB below the strongest",
                format_number(p.frequency_hz),
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

// Residuals of the traces, and what was estimated besides the parameters.

/// Decimals of a correlation.
const DECIMALS: usize = 2;

pub(super) fn misfit_html(misfit: Option<&TraceMisfit>) -> String {
    let Some(misfit) = misfit else { return String::new() };
    let words = "Measured minus model in every frame. Chi2 per degree of freedom is 1 where noise explains \
                 the residuals. A wrong model shows it above 1, growing with the length of the segments, or \
                 single segments that do not fit at all.";
    [
        reading_hint(words),
        channels_table(&misfit.channels),
        stages_table(&misfit.stages),
        worst_segments_table(&misfit.channels),
    ]
    .concat()
}

fn channels_table(list: &[ChannelMisfit]) -> String {
    let head = [
        ("recording", CellStyle::Words),
        ("channel", CellStyle::Words),
        ("frames", CellStyle::Number),
        ("residual, rms, \u{b5}m", CellStyle::Number),
        ("noise, \u{b5}m", CellStyle::Number),
        ("chi2 per degree of freedom", CellStyle::Number),
        ("correlation of neighbours", CellStyle::Number),
    ];
    let row = |c: &ChannelMisfit| -> Vec<HtmlCell> {
        vec![
            (isolate_name(&c.recording), CellStyle::Name),
            (escape_text(&c.channel), CellStyle::Words),
            (c.frames.to_string(), CellStyle::Number),
            (format_number(1e6 * c.residual_rms_m), CellStyle::Number),
            (format_number(1e6 * c.noise_m), CellStyle::Number),
            (format_number(c.chi2_per_dof), CellStyle::Number),
            (format_or_dash(c.autocorrelation_1, |r| format_decimals(r, DECIMALS)), CellStyle::Number),
        ]
    };
    HtmlTable {
        caption: "Residuals against noise",
        head: HtmlTable::column_heads(&head),
        rows: list.iter().map(row).collect(),
    }
    .render()
}

fn stages_table(list: &[StageMisfit]) -> String {
    let head = [
        ("length of the segments", CellStyle::Number),
        ("segments", CellStyle::Number),
        ("bad ones", CellStyle::Number),
        ("chi2 per degree of freedom", CellStyle::Number),
    ];
    let row = |s: &StageMisfit| -> Vec<HtmlCell> {
        vec![
            (format!("{} ms", format_number(1e3 * s.segment_s)), CellStyle::Number),
            (s.segments.to_string(), CellStyle::Number),
            (s.bad_segments.to_string(), CellStyle::Number),
            (format_number(s.chi2_per_dof), CellStyle::Number),
        ]
    };
    HtmlTable {
        caption: "Misfit over the length of the segments",
        head: HtmlTable::column_heads(&head),
        rows: list.iter().map(row).collect(),
    }
    .render()
}

fn worst_segments_table(list: &[ChannelMisfit]) -> String {
    let head = [
        ("recording", CellStyle::Words),
        ("channel", CellStyle::Words),
        ("from", CellStyle::Number),
        ("to", CellStyle::Number),
        ("chi2 per degree of freedom", CellStyle::Number),
    ];
    let rows = |c: &ChannelMisfit| -> Vec<Vec<HtmlCell>> {
        let row = |w: &crate::fit::misfit::WorstSegment| -> Vec<HtmlCell> {
            vec![
                (isolate_name(&c.recording), CellStyle::Name),
                (escape_text(&c.channel), CellStyle::Words),
                (format!("{} s", format_number(w.start_s)), CellStyle::Number),
                (format!("{} s", format_number(w.end_s)), CellStyle::Number),
                (format_number(w.chi2_per_dof), CellStyle::Number),
            ]
        };
        c.worst.iter().map(row).collect()
    };
    let rows = list.iter().flat_map(rows).collect();
    HtmlTable { caption: "Segments that fit worst", head: HtmlTable::column_heads(&head), rows }.render()
}

pub(super) fn nuisances_table(list: &[NuisanceResult]) -> String {
    let head = [
        ("estimated besides", CellStyle::Words),
        ("recording", CellStyle::Words),
        ("known beforehand", CellStyle::Number),
        ("estimate", CellStyle::Number),
        ("95 % interval", CellStyle::Number),
    ];
    let row = |n: &NuisanceResult| -> Vec<HtmlCell> {
        vec![
            (parameter_html(&n.name), CellStyle::Words),
            (n.recording.as_deref().map_or_else(|| escape_text("all"), isolate_name), CellStyle::Name),
            (format!("{} \u{b1} {}", format_number(n.prior), format_number(n.prior_sd)), CellStyle::Number),
            (format_number(n.estimate), CellStyle::Number),
            (format_interval(n.lower_95, n.upper_95, format_number), CellStyle::Number),
        ]
    };
    let html = HtmlTable {
        caption: "Cameras, and constants within priors",
        head: HtmlTable::column_heads(&head),
        rows: list.iter().map(row).collect(),
    }
    .render();
    let words = "The unit stands in the name, as in a scene. An estimate several standard deviations away from \
                 what was known beforehand is a reason to look at the calibration, or at the constant.";
    if html.is_empty() { html } else { reading_hint(words) + &html }
}
