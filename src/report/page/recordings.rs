//! Section on the quality of each recording, with the findings of `wiperlab inspect`.

use super::html::CellStyle::{Bad, Number, Prose, Words};
use super::html::*;
use crate::recording::quality::{QualityFinding, Severity};
use crate::report::RecordingLine;
use crate::text::{format_number, format_or_dash, format_percent, pluralise};

pub(super) fn recordings_html(list: &[RecordingLine]) -> String {
    list.iter().map(recording_html).collect()
}

/// A count with its noun: "1 frame", "22 frames".
fn count_noun(count: usize, noun: &str) -> String {
    format!("{count} {}", pluralise(noun, count))
}

/// Replaces the ASCII `um` of terminal text with the symbol for micrometres.
fn typeset_text(said: &str) -> String {
    said.replace(" um", " \u{b5}m")
}

fn recording_html(r: &RecordingLine) -> String {
    let q = &r.measurements;
    let micrometres = |m: Option<f64>| format_or_dash(m, |m| format!("{} \u{b5}m", format_number(m * 1e6)));
    let missing = q.missing_deflection_frames as f64 / q.frames.max(1) as f64;
    let exports: Vec<String> = r.exports.iter().map(|export| isolate_name(export)).collect();
    let exports = if exports.is_empty() { "not known".to_owned() } else { exports.join(", ") };
    let source = if r.synthetic { "synthetic: no camera took it" } else { "camera" };
    let (rate, duration) = (format_number(q.frame_rate_hz), format_number(q.duration_s));
    let [gaps, longest] =
        [(q.gaps, "gap"), (q.longest_gap_frames, "frame")].map(|(n, noun)| count_noun(n, noun));
    let lost = count_noun(q.missing_deflection_frames, "frame");
    let lost = format!("{lost} ({}) in {gaps}, the longest of {longest}", format_percent(missing));
    let noise = |x: Option<f64>, y: Option<f64>| format!("{}, {}", micrometres(x), micrometres(y));
    let found = [
        ("source", source.to_owned()),
        ("imported from", exports),
        ("frames", format!("{} at {rate} frames/s, {duration} s", q.frames)),
        ("without a deflection", lost),
        ("noise of the tip (x, y)", noise(q.tip_x.noise_m, q.tip_y.noise_m)),
        ("noise of the head (x, y)", noise(q.head_x.noise_m, q.head_y.noise_m)),
    ];
    let found = found.map(|(name, html)| (name.to_owned(), html));
    let head = [(Words, "severity|check|channel"), (Number, "number"), (Prose, "found|what to do")];
    let table = render_table(
        "Findings, the gravest first",
        column_heads(&head),
        r.findings.iter().map(finding_row).collect(),
    );
    let table = if table.is_empty() { reading_hint("No finding.") } else { table };
    let words = "Missing frames stay missing; gaps of up to four frames are bridged for spectra alone. \
                 Noise is a standard deviation.";
    let verdict: Vec<String> = r.verdict.iter().map(|said| typeset_text(said)).collect();
    format!(
        "<h3>{}</h3>\n{}{}{}{table}",
        isolate_name(&r.name),
        sentence_list(&verdict),
        facts_list(&found),
        reading_hint(words)
    )
}

/// A count without decimals; any other number with four digits.
fn format_count_or_number(value: f64) -> String {
    const MOST: f64 = 1e6;
    if value.fract() == 0.0 && value.abs() < MOST { format!("{value:.0}") } else { format_number(value) }
}

fn finding_row(f: &QualityFinding) -> Vec<HtmlCell> {
    let severity = if f.severity == Severity::Note { Words } else { Bad };
    let prose_or_dash = |raw: &str| format_or_dash(Some(raw).filter(|raw| !raw.is_empty()), prose_html);
    vec![
        (escape_text(f.severity.name()), severity),
        (escape_text(f.check.name()), Words),
        (prose_or_dash(f.channel.as_deref().unwrap_or_default()), Words),
        (
            format!("{} {}", format_count_or_number(f.value), escape_text(&f.unit)).trim_end().to_owned(),
            Number,
        ),
        (prose_html(&typeset_text(&f.found)), Prose),
        (prose_or_dash(&f.advice), Prose),
    ]
}
