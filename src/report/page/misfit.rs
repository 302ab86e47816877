//! Residuals of the traces, and what was estimated besides the parameters.

use super::html::{Cell, Set, Table, about, name, parameter, text};
use crate::fit::misfit::{ChannelMisfit, Misfit, StageMisfit};
use crate::fit::result::NuisanceResult;
use crate::text::{decimals, interval, number, or_dash};

/// Decimals of a correlation.
const DECIMALS: usize = 2;

pub(super) fn misfit(misfit: Option<&Misfit>) -> String {
    let Some(misfit) = misfit else { return String::new() };
    let words = "Measured minus model in every frame. Chi2 per degree of freedom is 1 where noise explains \
                 the residuals. A wrong model shows it above 1, growing with the length of the segments, or \
                 single segments that do not fit at all.";
    [about(words), channels(&misfit.channels), stages(&misfit.stages), worst(&misfit.channels)].concat()
}

fn channels(list: &[ChannelMisfit]) -> String {
    let head = [
        ("recording", Set::Words),
        ("channel", Set::Words),
        ("frames", Set::Number),
        ("residual, rms, \u{b5}m", Set::Number),
        ("noise, \u{b5}m", Set::Number),
        ("chi2 per degree of freedom", Set::Number),
        ("correlation of neighbours", Set::Number),
    ];
    let row = |c: &ChannelMisfit| -> Vec<Cell> {
        vec![
            (name(&c.recording), Set::Name),
            (text(&c.channel), Set::Words),
            (c.frames.to_string(), Set::Number),
            (number(1e6 * c.residual_rms_m), Set::Number),
            (number(1e6 * c.noise_m), Set::Number),
            (number(c.chi2_per_dof), Set::Number),
            (or_dash(c.autocorrelation_1, |r| decimals(r, DECIMALS)), Set::Number),
        ]
    };
    Table {
        caption: "Residuals against noise",
        head: Table::heads(&head),
        rows: list.iter().map(row).collect(),
    }
    .html()
}

fn stages(list: &[StageMisfit]) -> String {
    let head = [
        ("length of the segments", Set::Number),
        ("segments", Set::Number),
        ("bad ones", Set::Number),
        ("chi2 per degree of freedom", Set::Number),
    ];
    let row = |s: &StageMisfit| -> Vec<Cell> {
        vec![
            (format!("{} ms", number(1e3 * s.segment_s)), Set::Number),
            (s.segments.to_string(), Set::Number),
            (s.bad_segments.to_string(), Set::Number),
            (number(s.chi2_per_dof), Set::Number),
        ]
    };
    Table {
        caption: "Misfit over the length of the segments",
        head: Table::heads(&head),
        rows: list.iter().map(row).collect(),
    }
    .html()
}

fn worst(list: &[ChannelMisfit]) -> String {
    let head = [
        ("recording", Set::Words),
        ("channel", Set::Words),
        ("from", Set::Number),
        ("to", Set::Number),
        ("chi2 per degree of freedom", Set::Number),
    ];
    let rows = |c: &ChannelMisfit| -> Vec<Vec<Cell>> {
        let row = |w: &crate::fit::misfit::WorstSegment| -> Vec<Cell> {
            vec![
                (name(&c.recording), Set::Name),
                (text(&c.channel), Set::Words),
                (format!("{} s", number(w.start_s)), Set::Number),
                (format!("{} s", number(w.end_s)), Set::Number),
                (number(w.chi2_per_dof), Set::Number),
            ]
        };
        c.worst.iter().map(row).collect()
    };
    let rows = list.iter().flat_map(rows).collect();
    Table { caption: "Segments that fit worst", head: Table::heads(&head), rows }.html()
}

pub(super) fn nuisances(list: &[NuisanceResult]) -> String {
    let head = [
        ("estimated besides", Set::Words),
        ("recording", Set::Words),
        ("known beforehand", Set::Number),
        ("estimate", Set::Number),
        ("95 % interval", Set::Number),
    ];
    let row = |n: &NuisanceResult| -> Vec<Cell> {
        vec![
            (parameter(&n.name), Set::Words),
            (n.recording.as_deref().map_or_else(|| text("all"), name), Set::Name),
            (format!("{} \u{b1} {}", number(n.prior), number(n.prior_sd)), Set::Number),
            (number(n.estimate), Set::Number),
            (interval(n.lower_95, n.upper_95, number), Set::Number),
        ]
    };
    let html = Table {
        caption: "Cameras, and constants within priors",
        head: Table::heads(&head),
        rows: list.iter().map(row).collect(),
    }
    .html();
    let words = "The unit stands in the name, as in a scene. An estimate several standard deviations away from \
                 what was known beforehand is a reason to look at the calibration, or at the constant.";
    if html.is_empty() { html } else { about(words) + &html }
}
