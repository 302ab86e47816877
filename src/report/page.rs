//! The page of a report: one HTML file with its style, figures and script inside, which asks for nothing from
//! elsewhere and is complete without its script.

mod answer;
pub(super) mod html;
mod knowledge;
mod misfit;
mod origin;
mod quality;
mod runs;
pub(super) mod values;

pub(super) use origin::provenance_html;

use super::verdict::ReportVerdict;
use super::{FigureBlock, FigureSubject, Report};
use html::{PageSection, figures_html, isolate_name, render_document, sentence_list, statements_html};

impl Report {
    /// The page of the report: one HTML file; the same report always gives the same bytes.
    #[must_use]
    pub fn render_page(&self) -> String {
        render_page(self)
    }
}

/// Most bytes of a page that has figures drawn for telephones besides.
const MOST_BYTES: usize = 1_000_000;

/// The page; the same report always gives the same bytes. One that would be too large for it does without the
/// figures for telephones, which show the others smaller.
#[must_use]
pub fn render_page(report: &Report) -> String {
    let whole = assemble_page(report, true);
    if whole.len() <= MOST_BYTES { whole } else { assemble_page(report, false) }
}

/// The page, with figures for `narrow` screens besides.
fn assemble_page(report: &Report, narrow: bool) -> String {
    let verdict = ReportVerdict::from_report(report);
    let (first, evidence) = evidence_html(report, narrow);
    let open = |id, heading, html: String| PageSection { id, heading, html, folded: false };
    let folded = |id, heading, html: String| PageSection { id, heading, html, folded: true };
    let sections = [
        open(
            "answer",
            "Answer",
            [answer::summary_html(report), first, values::components_table(&report.components)].concat(),
        ),
        open("evidence", "Evidence", evidence),
        folded(
            "verdict",
            "Every finding",
            format!("<div class=\"verdict\">\n{}</div>\n", statements_html(&verdict.statements)),
        ),
        folded("features", "Features", values::features_table(&report.features)),
        folded("held-out", "Held-out predictions", values::held_out_table(&report.held_out)),
        folded("misfit", "Residuals", misfit::misfit_html(report.misfit.as_ref())),
        folded("measured", measured_heading(report), subject_figures_html(report, FigureSubject::Measured)),
        folded(
            "blade",
            "The blade of the best model",
            [runs::events_table(&report.runs), subject_figures_html(report, FigureSubject::Blade)].concat(),
        ),
        folded(
            "parameters",
            "Parameters",
            [
                knowledge::parameters_html(report),
                misfit::nuisances_table(&report.nuisances),
                subject_figures_html(report, FigureSubject::Parameters),
            ]
            .concat(),
        ),
        folded("data", "Data quality", quality::recordings_html(&report.recordings)),
        folded("search", search_heading(report), knowledge::search_html(report)),
        folded("reservations", "Reservations", sentence_list(&report.notes)),
        folded("provenance", "Provenance", provenance_html(&report.provenance)),
    ];
    render_document(&report.title, &data_banner(report), &sections)
}

/// A gate looks at features, which a fit to traces does not rest on.
fn search_heading(report: &Report) -> &'static str {
    if report.misfit.is_some() { "Search" } else { "Search and gate" }
}

fn measured_heading(report: &Report) -> &'static str {
    if report.recordings.is_empty() { "The model alone" } else { "Measured against model" }
}

/// What the data are, before anything else is said.
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

/// Figures of a subject, with the number of those before them: numbers run through the whole page.
fn figures_of_subject(report: &Report, subject: FigureSubject) -> (Vec<&FigureBlock>, usize) {
    let groups = || report.figures.iter();
    let before = groups().take_while(|group| group.subject != subject).map(|group| group.figures.len()).sum();
    (groups().filter(|group| group.subject == subject).flat_map(|group| &group.figures).collect(), before)
}

/// The first figure of the evidence, which stands in the answer, and the others.
fn evidence_html(report: &Report, narrow: bool) -> (String, String) {
    let (all, before) = figures_of_subject(report, FigureSubject::Evidence);
    let (first, rest) = all.split_at(all.len().min(1));
    (
        figures_html(first.iter().copied(), before, narrow),
        figures_html(rest.iter().copied(), before + first.len(), narrow),
    )
}

/// The figures of a subject.
fn subject_figures_html(report: &Report, subject: FigureSubject) -> String {
    let (all, before) = figures_of_subject(report, subject);
    figures_html(all, before, false)
}

#[cfg(test)]
pub(super) mod tests;
