//! What each recording can show and what is wrong with it, as `wiperlab inspect` finds it.

use super::html::{Cell, Set, Table, about, facts, list, name, prose, text};
use crate::recording::quality::{Finding, Severity};
use crate::report::RecordingLine;
use crate::text::{number, or_dash, percent, plural};

pub(super) fn recordings(list: &[RecordingLine]) -> String {
    list.iter().map(recording).collect()
}

/// "1 frame", "22 frames".
fn counted(count: usize, noun: &str) -> String {
    format!("{count} {}", plural(noun, count))
}

/// What a terminal says in its letters, in those of the page.
fn typeset(said: &str) -> String {
    said.replace(" um", " \u{b5}m")
}

fn recording(r: &RecordingLine) -> String {
    let (q, micro) =
        (&r.measurements, |m: Option<f64>| or_dash(m, |m| format!("{} \u{b5}m", number(m * 1e6))));
    let missing = q.missing_deflection_frames as f64 / q.frames.max(1) as f64;
    let exports: Vec<String> = r.exports.iter().map(|export| name(export)).collect();
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
            format!("{} at {} frames/s, {} s", q.frames, number(q.frame_rate_hz), number(q.duration_s)),
        ),
        (
            "without a deflection".to_owned(),
            format!(
                "{} ({}) in {}, the longest of {}",
                counted(q.missing_deflection_frames, "frame"),
                percent(missing),
                counted(q.gaps, "gap"),
                counted(q.longest_gap_frames, "frame")
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
        ("severity", Set::Words),
        ("check", Set::Words),
        ("channel", Set::Words),
        ("number", Set::Number),
        ("found", Set::Prose),
        ("what to do", Set::Prose),
    ];
    let table =
        Table { caption, head: Table::heads(&head), rows: r.findings.iter().map(row).collect() }.html();
    let table = if table.is_empty() { about("No finding.") } else { table };
    let words = "Missing frames stay missing; gaps of up to four frames are bridged for spectra alone. \
                 Noise is a standard deviation.";
    let verdict: Vec<String> = r.verdict.iter().map(|said| typeset(said)).collect();
    format!("<h3>{}</h3>\n{}{}{}{table}", name(&r.name), list(&verdict), facts(&found), about(words))
}

/// A count without decimals, any other number with four digits.
fn count_or_number(value: f64) -> String {
    const MOST: f64 = 1e6;
    if value.fract() == 0.0 && value.abs() < MOST { format!("{value:.0}") } else { number(value) }
}

fn row(f: &Finding) -> Vec<Cell> {
    let severity = if f.severity == Severity::Note { Set::Words } else { Set::Bad };
    let prose_or_dash = |raw: &str| or_dash(Some(raw).filter(|raw| !raw.is_empty()), prose);
    vec![
        (text(f.severity.word()), severity),
        (text(f.check.name()), Set::Words),
        (prose_or_dash(f.channel.as_deref().unwrap_or_default()), Set::Words),
        (format!("{} {}", count_or_number(f.value), text(&f.unit)).trim_end().to_owned(), Set::Number),
        (prose(&typeset(&f.found)), Set::Prose),
        (prose_or_dash(&f.advice), Set::Prose),
    ]
}
