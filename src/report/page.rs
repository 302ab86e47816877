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

pub(super) use origin::provenance;

use super::verdict::Verdict;
use super::{FigureBlock, Report, Subject};
use html::{Section, document, figures, list, name, statements};

impl Report {
    /// The page of the report: one HTML file; the same report always gives the same bytes.
    #[must_use]
    pub fn page(&self) -> String {
        page(self)
    }
}

/// Most bytes of a page that has figures drawn for telephones besides.
const MOST_BYTES: usize = 1_000_000;

/// The page; the same report always gives the same bytes. One that would be too large for it does without the
/// figures for telephones, which show the others smaller.
#[must_use]
pub fn page(report: &Report) -> String {
    let whole = set(report, true);
    if whole.len() <= MOST_BYTES { whole } else { set(report, false) }
}

/// The page, with figures for `narrow` screens besides.
fn set(report: &Report, narrow: bool) -> String {
    let verdict = Verdict::of(report);
    let (first, evidence) = evidence(report, narrow);
    let open = |id, heading, html: String| Section { id, heading, html, folded: false };
    let folded = |id, heading, html: String| Section { id, heading, html, folded: true };
    let sections = [
        open(
            "answer",
            "Answer",
            [answer::answer(report), first, values::components(&report.components)].concat(),
        ),
        open("evidence", "Evidence", evidence),
        folded(
            "verdict",
            "Every finding",
            format!("<div class=\"verdict\">\n{}</div>\n", statements(&verdict.statements)),
        ),
        folded("features", "Features", values::features(&report.features)),
        folded("held-out", "Held-out predictions", values::held_out(&report.held_out)),
        folded("misfit", "Residuals", misfit::misfit(report.misfit.as_ref())),
        folded("measured", measured_heading(report), drawn(report, Subject::Measured)),
        folded(
            "blade",
            "The blade of the best model",
            [runs::events(&report.runs), drawn(report, Subject::Blade)].concat(),
        ),
        folded(
            "parameters",
            "Parameters",
            [
                knowledge::parameters(report),
                misfit::nuisances(&report.nuisances),
                drawn(report, Subject::Parameters),
            ]
            .concat(),
        ),
        folded("data", "Data quality", quality::recordings(&report.recordings)),
        folded("search", search_heading(report), knowledge::search(report)),
        folded("reservations", "Reservations", list(&report.notes)),
        folded("provenance", "Provenance", provenance(&report.provenance)),
    ];
    document(&report.title, &banner(report), &sections)
}

/// A gate looks at features, which a fit to traces does not rest on.
fn search_heading(report: &Report) -> &'static str {
    if report.misfit.is_some() { "Search" } else { "Search and gate" }
}

fn measured_heading(report: &Report) -> &'static str {
    if report.recordings.is_empty() { "The model alone" } else { "Measured against model" }
}

/// What the data are, before anything else is said.
pub(super) fn banner(report: &Report) -> String {
    let named: Vec<_> = report.recordings.iter().filter(|r| r.synthetic).map(|r| name(&r.name)).collect();
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
fn of(report: &Report, subject: Subject) -> (Vec<&FigureBlock>, usize) {
    let groups = || report.figures.iter();
    let before = groups().take_while(|group| group.subject != subject).map(|group| group.figures.len()).sum();
    (groups().filter(|group| group.subject == subject).flat_map(|group| &group.figures).collect(), before)
}

/// The first figure of the evidence, which stands in the answer, and the others.
fn evidence(report: &Report, narrow: bool) -> (String, String) {
    let (all, before) = of(report, Subject::Evidence);
    let (first, rest) = all.split_at(all.len().min(1));
    (
        figures(first.iter().copied(), before, narrow),
        figures(rest.iter().copied(), before + first.len(), narrow),
    )
}

/// The figures of a subject.
fn drawn(report: &Report, subject: Subject) -> String {
    let (all, before) = of(report, subject);
    figures(all, before, false)
}

#[cfg(test)]
pub(super) mod tests;
