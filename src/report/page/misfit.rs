//! Residuals of the traces, and what was estimated besides the parameters.

use super::html::{CellStyle, HtmlCell, HtmlTable, escape_text, isolate_name, parameter_html, reading_hint};
use crate::fit::misfit::{ChannelMisfit, StageMisfit, TraceMisfit};
use crate::fit::result::NuisanceResult;
use crate::text::{format_decimals, format_interval, format_number, format_or_dash};

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
