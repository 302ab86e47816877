//! The page of a report: one HTML file that contains its style, figures and script. It loads nothing else,
//! and is complete even without its script.

pub(super) mod agreement;
pub(super) mod html;
mod parameters;
mod recordings;

use super::rich_text::Statement;
use super::verdict::ReportVerdict;
use super::{
    FigureBlock, FigureSubject, Provenance, Report, ReportSummary, RunSummary, SourceFile, SummaryQuantity,
};
use crate::text::{self, DASH, format_interval, format_number, format_percent};
use html::CellStyle::{Bad, Name, Number, Prose, Words};
use html::*;

impl Report {
    /// The page of the report: one HTML file; the same report always gives the same bytes.
    #[must_use]
    pub fn render_page(&self) -> String {
        render_page(self)
    }
}

/// The page; the same report always gives the same bytes.
pub(crate) fn render_page(report: &Report) -> String {
    let verdict = ReportVerdict::from_report(report);
    let (first, evidence) = evidence_html(report);
    let open = |id, heading, html: String| PageSection { id, heading, html, folded: false };
    let folded = |id, heading, html: String| PageSection { id, heading, html, folded: true };
    let answer = [summary_html(report), first, agreement::components_table(&report.components)].concat();
    let statements = statements_html(&verdict.statements);
    let blade = [events_table(&report.runs), subject_figures_html(report, FigureSubject::Blade)].concat();
    let parameters = [
        parameters::parameters_html(report),
        agreement::nuisances_table(&report.nuisances),
        subject_figures_html(report, FigureSubject::Parameters),
    ]
    .concat();
    let measured = if report.recordings.is_empty() { "The model alone" } else { "Measured against model" };
    // the gate (the check before the search) examines features, which a fit to traces does not use
    let search = if report.misfit.is_some() { "Search" } else { "Search and gate" };
    let sections = [
        open("answer", "Answer", answer),
        open("evidence", "Evidence", evidence),
        folded("verdict", "Every finding", format!("<div class=\"verdict\">\n{statements}</div>\n")),
        folded("features", "Features", agreement::features_table(&report.features)),
        folded("held-out", "Held-out predictions", agreement::held_out_table(&report.held_out)),
        folded("misfit", "Residuals", agreement::misfit_html(report.misfit.as_ref())),
        folded("measured", measured, subject_figures_html(report, FigureSubject::Measured)),
        folded("blade", "The blade of the best model", blade),
        folded("parameters", "Parameters", parameters),
        folded("data", "Data quality", recordings::recordings_html(&report.recordings)),
        folded("search", search, parameters::search_html(report)),
        folded("reservations", "Reservations", sentence_list(&report.notes)),
        folded("provenance", "Provenance", provenance_html(&report.provenance)),
    ];
    render_document(&report.title, &data_banner(report), &sections)
}

/// Banner that states whether the data are synthetic or published.
pub(super) fn data_banner(report: &Report) -> String {
    let named: Vec<_> =
        report.recordings.iter().filter(|r| r.synthetic).map(|r| isolate_name(&r.name)).collect();
    match (named.is_empty(), report.recordings.is_empty()) {
        (false, _) => format!(
            "<p class=\"banner\" role=\"note\">Synthetic data: no camera took {}. The numbers below test \
             the method, not a blade.</p>\n",
            named.join(", ")
        ),
        (true, true) => "<p class=\"banner\" role=\"note\">Published numbers or numbers that the job \
                         assumes, no recording: the traces shown are the model\u{2019}s \
                         alone.</p>\n"
            .to_owned(),
        (true, false) => String::new(),
    }
}

/// Figures of a subject, and the number of figures that come before them on the page.
fn figures_of_subject(report: &Report, subject: FigureSubject) -> (Vec<&FigureBlock>, usize) {
    let groups = || report.figures.iter();
    let before = groups().take_while(|group| group.subject != subject).map(|group| group.figures.len()).sum();
    (groups().filter(|group| group.subject == subject).flat_map(|group| &group.figures).collect(), before)
}

/// HTML of the first figure of the evidence, which is part of the answer, and HTML of the other figures.
fn evidence_html(report: &Report) -> (String, String) {
    let (all, before) = figures_of_subject(report, FigureSubject::Evidence);
    let (first, rest) = all.split_at(all.len().min(1));
    let html = |part: &[&FigureBlock], before| figures_html(part.iter().copied(), before);
    (html(first, before), html(rest, before + first.len()))
}

/// HTML of the figures of a subject.
fn subject_figures_html(report: &Report, subject: FigureSubject) -> String {
    let (all, before) = figures_of_subject(report, subject);
    figures_html(all, before)
}

pub(super) fn summary_html(report: &Report) -> String {
    let answer = ReportSummary::from_report(report);
    let paragraph = |sentence| {
        let html = sentence_html(sentence);
        if html.is_empty() { html } else { format!("<p>{html}</p>\n") }
    };
    let (law, chatter) = (paragraph(&answer.law), paragraph(&answer.chatter));
    format!(
        "{}{}<p>{}</p>\n{law}{chatter}<p><strong>Next:</strong> {}</p>\n",
        headline_html(&answer.headline),
        quantities_html(&answer.quantities),
        sentence_html(&answer.certainty),
        sentence_html(&answer.next)
    )
}

fn headline_html(said: &Statement) -> String {
    let class = said.good.map_or("", |good| if good { " good" } else { " bad" });
    let details = items_html(said.details.iter().map(sentence_html));

    format!("<div class=\"headline{class}\"><p>{}</p>\n{details}</div>\n", sentence_html(&said.statement))
}

fn quantities_html(list: &[SummaryQuantity]) -> String {
    let head = [(Prose, "quantity"), (Number, "value|95 % interval"), (Words, "")];
    render_table("The blade", column_heads(&head), list.iter().map(quantity_row).collect())
}

fn quantity_row(q: &SummaryQuantity) -> Vec<HtmlCell> {
    let (unit, factor) = text::choose_prefix(&q.unit, [q.value]);
    let unit = if unit.is_empty() { unit } else { format!(" {}", escape_text(&unit)) };
    let range = match q.lower_95.or(q.upper_95) {
        Some(_) => format_interval(q.lower_95, q.upper_95, |end| format_number(end * factor)),
        None if q.fitted => "not known".to_owned(),
        None => "held fixed".to_owned(),
    };
    let sure = if q.fitted {
        verdict_cell(q.identified, ["determined", "not determined"])
    } else {
        (escape_text("from the scene"), Words)
    };
    vec![
        (words_with_keys(&q.name, &q.keys), Prose),
        (format!("{}{unit}", format_number(q.value * factor)), Number),
        (escape_text(&range), Number),
        sure,
    ]
}

pub(in crate::report) fn provenance_html(p: &Provenance) -> String {
    let mut list = vec![("wiperlab", p.version.clone())];
    list.extend(p.seed.map(|seed| ("seed", seed.to_string())));
    list.push(("fingerprint of problem, data and program", p.fingerprint.clone()));
    let list: Vec<(String, String)> = list
        .into_iter()
        .filter(|(_, value)| !value.is_empty())
        .map(|(name, value)| (escape_text(name), escape_text(&value)))
        .collect();
    [facts_list(&list), files_table(&p.files), commands_html(p)].concat()
}

fn files_table(list: &[SourceFile]) -> String {
    let row = |f: &SourceFile| {
        let synthetic = if f.synthetic { ("synthetic".to_owned(), Bad) } else { (DASH.to_owned(), Words) };
        vec![
            (isolate_name(&f.name), Words),
            (escape_text(&f.kind), Words),
            synthetic,
            (format!("<code class=\"hash\">{}</code>", escape_text(&f.sha256)), Words),
        ]
    };
    let head = [(Words, "file|what it is|data|SHA-256")];
    render_table("Files behind this report", column_heads(&head), list.iter().map(row).collect())
}

fn commands_html(p: &Provenance) -> String {
    if p.commands.is_empty() {
        return String::new();
    }
    let words = "The command that imported a recording is not kept: its trace.csv and recording.toml were made \
                 by wiperlab import from the exports above, with the rate and scale that recording.toml holds.";
    let has_exports = p.files.iter().any(|f| f.kind == "export");
    let imported = if has_exports { reading_hint(words) } else { String::new() };
    let lines = p.commands.iter().map(|command| escape_text(command)).collect::<Vec<_>>().join("\n");
    format!(
        "<p>To make it again:</p>\n<pre tabindex=\"0\" role=\"region\" \
         aria-label=\"Commands\">{lines}</pre>\n{imported}"
    )
}

/// A row of the table of events: its name, the function that returns its text for a run, and whether every
/// text except `none` means something bad.
type EventRow = (&'static str, fn(&RunSummary) -> String, bool);

const EVENT_ROWS: [EventRow; 12] = [
    ("how it ended", |r| format!("{}: {}", r.status.name(), r.status.meaning()), false),
    (
        "from, to",
        |r| [r.started_at_s, r.stopped_at_s].map(|s| format!("{} s", format_number(s))).join(", "),
        false,
    ),
    ("loss of contact", |r| count_text(r.contact_losses), true),
    ("impact on the glass", |r| count_text(r.impacts), true),
    ("jam (Painlev\u{e9} paradox)", |r| count_text(r.jams), true),
    ("indeterminate contact", |r| occurrence_text(r.indeterminate), true),
    ("chattering", |r| occurrence_text(r.chattering), true),
    ("least normal force in contact", |r| text_or_none(r.least_normal_force_n, force_text), false),
    (
        "least Painlev\u{e9} indicator in slip",
        |r| text_or_none(r.least_painleve_indicator, format_number),
        false,
    ),
    ("changes of mode", |r| r.transitions.to_string(), false),
    (
        "sticks, share of the run",
        |r| [count_text(r.sticks), text_or_none(r.stick_share, share_text)].join(", "),
        false,
    ),
    (
        "longest stick",
        |r| text_or_none(r.longest_stick_s, |s| format!("{} ms", format_number(1e3 * s))),
        false,
    ),
];

const NO_EVENTS: &str = "none";
/// Forces below this value, N, are shown as zero, since they are rounding errors; the preload of the blade is
/// about 0.1 N.
const ROUNDING_N: f64 = 1e-9;

fn force_text(newtons: f64) -> String {
    if newtons.abs() < ROUNDING_N { "0 N".to_owned() } else { format!("{} N", format_number(newtons)) }
}

fn share_text(share: f64) -> String {
    format_percent((share * 1e3).round() / 1e3)
}

fn count_text(n: usize) -> String {
    if n == 0 { NO_EVENTS.to_owned() } else { n.to_string() }
}

fn occurrence_text(happened: bool) -> String {
    if happened { "ended the run" } else { NO_EVENTS }.to_owned()
}

fn text_or_none(value: Option<f64>, text: impl Fn(f64) -> String) -> String {
    value.map_or_else(|| NO_EVENTS.to_owned(), text)
}

/// The table of events, with a column for each condition.
pub(super) fn events_table(runs: &[RunSummary]) -> String {
    let one = |(what, of, hard): &EventRow| -> Vec<HtmlCell> {
        let cell = |run| {
            let value = of(run);
            let set = if *hard && value != NO_EVENTS { Bad } else { Words };
            (escape_text(&value), set)
        };
        std::iter::once((escape_text(what), Words)).chain(runs.iter().map(cell)).collect()
    };
    if runs.is_empty() {
        return String::new();
    }
    let names = runs.iter().map(|run| (isolate_name(&run.name), Name));
    let head = column_heads(&[(Words, "event")]).into_iter().chain(names).collect();
    let words = "The normal force falls to zero where contact is lost; a Painlev\u{e9} indicator of zero or \
                 less is a jam.";
    reading_hint(words)
        + &render_table(
            "Hard events of the best model, by condition",
            head,
            EVENT_ROWS.iter().map(one).collect(),
        )
}

#[cfg(test)]
pub(super) mod tests;
