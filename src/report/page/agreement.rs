//! Tables that compare targets with the model.

use super::html::CellStyle::{Name, Number, Prose, Words};
use super::html::*;
use crate::compare::TargetComparison;
use crate::fit::misfit::{ChannelMisfit, StageMisfit, TraceMisfit, WorstSegment};
use crate::fit::result::NuisanceResult;
use crate::text::{
    self, format_decimals, format_digits, format_interval, format_number, format_or_dash, format_percent,
    format_signed_percent, format_with_sd,
};

pub(super) fn components_table(list: &[TargetComparison]) -> String {
    let words = "Frequencies that the model has to meet. A component is met if it lies within the tolerance; \
                 relative error is model / target \u{2212} 1. The standard deviation of a target stands in units \
                 of the last digit: 78.40(3) is 78.40 with 0.03. A target from the job is published or assumed.";
    comparison_table("Components: target against model", words, "component", list)
}

pub(super) fn features_table(list: &[TargetComparison]) -> String {
    let words = "Everything else that was fitted. A feature is met if the model lies within the 95 % interval \
                 of the target, 1.96 standard deviations either side. A target from the job is published or \
                 assumed.";
    comparison_table("Features: target against model", words, "feature", list)
}

pub(super) fn held_out_table(list: &[TargetComparison]) -> String {
    let words = "Not fitted, but predicted by the model at the estimates and then compared with the target.";
    comparison_table("Held-out values: target against prediction", words, "value", list)
}

fn comparison_table(caption: &str, words: &str, kind: &str, list: &[TargetComparison]) -> String {
    if list.is_empty() {
        return String::new();
    }
    let several = list.iter().any(|c| c.condition.is_some());
    let mut head = vec![(Words, kind)];
    head.extend(several.then_some((Words, "condition")));
    head.extend([
        (Words, "unit"),
        (Number, "target"),
        (Words, "from"),
        (Number, "model|relative error|tolerance"),
        (Words, "verdict"),
        (Prose, "remarks"),
    ]);
    let rows = list.iter().map(|c| comparison_row(c, several)).collect();
    render_table(caption, column_heads(&head), rows) + &reading_hint(words)
}

fn comparison_row(c: &TargetComparison, several: bool) -> Vec<HtmlCell> {
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
    let mut cells = vec![(isolate_name(&c.name), Words)];
    cells.extend(several.then(|| (c.condition.as_deref().map(isolate_name).unwrap_or_default(), Name)));
    cells.extend([
        (escape_text(&unit), Words),
        (target, Number),
        (from.to_owned(), Words),
        (model, Number),
        (error, Number),
        (tolerance, Number),
        verdict_cell(c.pass, ["met", "not met"]),
        (prose_html(&value_remarks(c)), Prose),
    ]);
    cells
}

/// Remarks on the value of the model.
fn value_remarks(c: &TargetComparison) -> String {
    let size = |value: f64| {
        // Hz gets no prefixes
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
            let (hz, below_db) = (format_number(p.frequency_hz), p.below_db);
            format!("next peak of the model at {hz} Hz, {below_db:.1} dB below the strongest")
        }),
        c.twin_sd.map(|sd| format!("scatters by {} over twins", size(sd))),
        c.model_scatter.filter(|s| c.target_sd.is_some_and(|sd| *s > sd)).map(|s| {
            format!("not smooth: the model scatters by {} between neighbouring parameters", size(s))
        }),
    ];
    parts.into_iter().flatten().collect::<Vec<_>>().join("; ")
}

/// Number of decimals of a correlation.
const DECIMALS: usize = 2;

pub(super) fn misfit_html(misfit: Option<&TraceMisfit>) -> String {
    let Some(misfit) = misfit else { return String::new() };
    let words = "Measured minus model in every frame. Chi2 per degree of freedom is 1 where noise explains \
                 the residuals. A wrong model shows it above 1, growing with the length of the segments, or \
                 single segments that do not fit at all.";
    let channels = channels_table(&misfit.channels);
    let worst = worst_segments_table(&misfit.channels);
    [reading_hint(words), channels, stages_table(&misfit.stages), worst].concat()
}

fn channels_table(list: &[ChannelMisfit]) -> String {
    let head = [
        (Words, "recording|channel"),
        (
            Number,
            "frames|residual, rms, \u{b5}m|noise, \u{b5}m|chi2 per degree of freedom|correlation of neighbours",
        ),
    ];
    let row = |c: &ChannelMisfit| -> Vec<HtmlCell> {
        vec![
            (isolate_name(&c.recording), Name),
            (escape_text(&c.channel), Words),
            (c.frames.to_string(), Number),
            (format_number(1e6 * c.residual_rms_m), Number),
            (format_number(1e6 * c.noise_m), Number),
            (format_number(c.chi2_per_dof), Number),
            (format_or_dash(c.autocorrelation_1, |r| format_decimals(r, DECIMALS)), Number),
        ]
    };
    render_table("Residuals against noise", column_heads(&head), list.iter().map(row).collect())
}

fn stages_table(list: &[StageMisfit]) -> String {
    let head = [(Number, "length of the segments|segments|bad ones|chi2 per degree of freedom")];
    let row = |s: &StageMisfit| -> Vec<HtmlCell> {
        vec![
            (format!("{} ms", format_number(1e3 * s.segment_s)), Number),
            (s.segments.to_string(), Number),
            (s.bad_segments.to_string(), Number),
            (format_number(s.chi2_per_dof), Number),
        ]
    };
    render_table(
        "Misfit over the length of the segments",
        column_heads(&head),
        list.iter().map(row).collect(),
    )
}

fn worst_segments_table(list: &[ChannelMisfit]) -> String {
    let head = [(Words, "recording|channel"), (Number, "from|to|chi2 per degree of freedom")];
    let row = |(c, w): (&ChannelMisfit, &WorstSegment)| {
        vec![
            (isolate_name(&c.recording), Name),
            (escape_text(&c.channel), Words),
            (format!("{} s", format_number(w.start_s)), Number),
            (format!("{} s", format_number(w.end_s)), Number),
            (format_number(w.chi2_per_dof), Number),
        ]
    };
    let worst = list.iter().flat_map(|c| c.worst.iter().map(move |w| (c, w)));
    render_table("Segments that fit worst", column_heads(&head), worst.map(row).collect())
}

pub(super) fn nuisances_table(list: &[NuisanceResult]) -> String {
    let head = [(Words, "estimated besides|recording"), (Number, "known beforehand|estimate|95 % interval")];
    let known = |n: &NuisanceResult| match (n.prior, n.prior_sd) {
        (Some(prior), Some(sd)) => format!("{} \u{b1} {}", format_number(prior), format_number(sd)),
        _ => "nothing".to_owned(),
    };
    let row = |n: &NuisanceResult| -> Vec<HtmlCell> {
        vec![
            (parameter_html(&n.name), Words),
            (n.recording.as_deref().map_or_else(|| escape_text("all"), isolate_name), Name),
            (known(n), Number),
            (format_number(n.estimate), Number),
            (format_interval(n.lower_95, n.upper_95, format_number), Number),
        ]
    };
    let words = "The unit stands in the name, as in a scene. An estimate several standard deviations away from \
                 what was known beforehand is a reason to look at the calibration, or at the constant.";
    let rows: Vec<_> = list.iter().map(row).collect();
    let words = if rows.is_empty() { String::new() } else { reading_hint(words) };
    words + &render_table("Cameras, and constants within priors", column_heads(&head), rows)
}
