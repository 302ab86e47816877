//! The page of a report: one HTML file with its style and figures inside, without script or network.

pub(super) mod html;
mod knowledge;
mod misfit;
mod origin;
mod quality;
mod runs;
pub(super) mod values;

pub(super) use origin::provenance;

use super::verdict::Verdict;
use super::{FigureGroup, Report, Subject};
use html::{Section, about, document, figures, list, name, statements};

impl Report {
    /// The page of the report: one HTML file; the same report always gives the same bytes.
    #[must_use]
    pub fn page(&self) -> String {
        page(self)
    }
}

/// The page; the same report always gives the same bytes.
#[must_use]
pub fn page(report: &Report) -> String {
    let verdict = Verdict::of(report);
    let section = |id, heading, html: String| Section { id, heading, html };
    let sections = [
        section(
            "verdict",
            "Verdict",
            format!("<div class=\"verdict\">\n{}</div>\n", statements(&verdict.statements)),
        ),
        section("evidence", "Evidence", drawn(report, Subject::Evidence)),
        section("components", "Components", values::components(&report.components)),
        section("misfit", "Residuals", misfit::misfit(report.misfit.as_ref())),
        section("measured", measured_heading(report), drawn(report, Subject::Measured)),
        section(
            "blade",
            "The blade of the best model",
            [runs::events(&report.runs), drawn(report, Subject::Blade)].concat(),
        ),
        section("features", "Features", values::features(&report.features)),
        section("held-out", "Held-out predictions", values::held_out(&report.held_out)),
        section(
            "parameters",
            "Parameters",
            [
                knowledge::parameters(report),
                misfit::nuisances(&report.nuisances),
                drawn(report, Subject::Parameters),
            ]
            .concat(),
        ),
        section("data", "Data quality", quality::recordings(&report.recordings)),
        section("search", search_heading(report), knowledge::search(report)),
        section("reservations", "Reservations", list(&report.notes)),
        section("provenance", "Provenance", provenance(&report.provenance)),
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

/// The figures of a subject; their numbers run through the whole page.
fn drawn(report: &Report, subject: Subject) -> String {
    let of = |group: &&FigureGroup| group.subject == subject;
    let before = report
        .figures
        .iter()
        .take_while(|group| group.subject != subject)
        .map(|group| group.figures.len())
        .sum();
    let shown = figures(report.figures.iter().filter(of).flat_map(|group| &group.figures), before);
    if shown.is_empty() { shown } else { format!("{}{shown}", about(reading(subject))) }
}

/// Where a figure is found for a paper.
fn reading(subject: Subject) -> &'static str {
    match subject {
        Subject::Evidence => "Measured and model on one axis, enlarged where they fit worst.",
        Subject::Measured => {
            "Every figure is also a file in the folder of this page; for a paper, 85 and 170 mm wide, in paper/."
        }
        Subject::Blade => "Motion of the model with the estimates in it.",
        Subject::Parameters => "What the intervals and verdicts above rest on.",
    }
}

#[cfg(test)]
mod tests;
