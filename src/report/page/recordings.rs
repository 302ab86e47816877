//! What each recording can show and what is wrong with it, as `wiperlab inspect` finds it.

use super::html::{
    CellStyle, HtmlCell, HtmlTable, escape_text, facts_list, isolate_name, prose_html, reading_hint,
    sentence_list,
};
use crate::recording::quality::{QualityFinding, Severity};
use crate::report::RecordingLine;
use crate::text::{format_number, format_or_dash, format_percent, pluralise};

pub(super) fn recordings_html(list: &[RecordingLine]) -> String {
    list.iter().map(recording_html).collect()
}

/// "1 frame", "22 frames".
fn count_noun(count: usize, noun: &str) -> String {
    format!("{count} {}", pluralise(noun, count))
}

/// What a terminal says in its letters, in those of the page.
fn typeset_text(said: &str) -> String {
    said.replace(" um", " \u{b5}m")
}

fn recording_html(r: &RecordingLine) -> String {
    let (q, micro) = (&r.measurements, |m: Option<f64>| {
        format_or_dash(m, |m| format!("{} \u{b5}m", format_number(m * 1e6)))
    });
    let missing = q.missing_deflection_frames as f64 / q.frames.max(1) as f64;
    let exports: Vec<String> = r.exports.iter().map(|export| isolate_name(export)).collect();
    let found = vec![
        (
            "source".to_owned(),
            if r.synthetic { "synthetic: no camera took it".to_owned() } else { "camera".to_owned() },
        ),
        (
            "imported from".to_owned(),
            if exports.is_empty() { "not known".to_owned() } else { exports.join(", ") },
        ),
        (
            "frames".to_owned(),
            format!(
                "{} at {} frames/s, {} s",
                q.frames,
                format_number(q.frame_rate_hz),
                format_number(q.duration_s)
            ),
        ),
        (
            "without a deflection".to_owned(),
            format!(
                "{} ({}) in {}, the longest of {}",
                count_noun(q.missing_deflection_frames, "frame"),
                format_percent(missing),
                count_noun(q.gaps, "gap"),
                count_noun(q.longest_gap_frames, "frame")
            ),
        ),
        (
            "noise of the tip (x, y)".to_owned(),
            format!("{}, {}", micro(q.tip_x.noise_m), micro(q.tip_y.noise_m)),
        ),
        (
            "noise of the head (x, y)".to_owned(),
            format!("{}, {}", micro(q.head_x.noise_m), micro(q.head_y.noise_m)),
        ),
    ];
    let caption = "Findings, the gravest first";
    let head = [
        ("severity", CellStyle::Words),
        ("check", CellStyle::Words),
        ("channel", CellStyle::Words),
        ("number", CellStyle::Number),
        ("found", CellStyle::Prose),
        ("what to do", CellStyle::Prose),
    ];
    let table = HtmlTable {
        caption,
        head: HtmlTable::column_heads(&head),
        rows: r.findings.iter().map(finding_row).collect(),
    }
    .render();
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

/// A count without decimals, any other number with four digits.
fn format_count_or_number(value: f64) -> String {
    const MOST: f64 = 1e6;
    if value.fract() == 0.0 && value.abs() < MOST { format!("{value:.0}") } else { format_number(value) }
}

fn finding_row(f: &QualityFinding) -> Vec<HtmlCell> {
    let severity = if f.severity == Severity::Note { CellStyle::Words } else { CellStyle::Bad };
    let prose_or_dash = |raw: &str| format_or_dash(Some(raw).filter(|raw| !raw.is_empty()), prose_html);
    vec![
        (escape_text(f.severity.name()), severity),
        (escape_text(f.check.name()), CellStyle::Words),
        (prose_or_dash(f.channel.as_deref().unwrap_or_default()), CellStyle::Words),
        (
            format!("{} {}", format_count_or_number(f.value), escape_text(&f.unit)).trim_end().to_owned(),
            CellStyle::Number,
        ),
        (prose_html(&typeset_text(&f.found)), CellStyle::Prose),
        (prose_or_dash(&f.advice), CellStyle::Prose),
    ]
}
