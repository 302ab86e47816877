//! Reports as JSON for scripts; `docs/reports.md` lists the keys.

use super::rich_text::Statement;
use super::verdict::ReportVerdict;
use super::{FigureSubject, Report, ReportSummary};
use crate::figures::FigureBlock;
use serde::Serialize;

/// Version of the format.
pub(super) const FORMAT: u32 = 1;

/// Entry of a figure in the list of figures.
#[derive(Debug, Serialize)]
pub(super) struct FigureEntry<'a> {
    pub file: &'a str,
    pub caption: &'a str,
    pub details: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub subject: Option<FigureSubject>,
}

impl<'a> FigureEntry<'a> {
    pub(super) fn new(figure: &'a FigureBlock, subject: Option<FigureSubject>) -> Self {
        Self { file: &figure.file, caption: &figure.caption, details: &figure.details, subject }
    }
}

/// Contents of the JSON document of a fit.
#[derive(Debug, Serialize)]
pub(super) struct ReportDocument<'a> {
    #[serde(flatten)]
    verdict: &'a ReportVerdict,
    answer: ReportSummary,
    summary: Vec<String>,
    statements: &'a [Statement],
    #[serde(flatten)]
    report: &'a Report,
    figures: Vec<FigureEntry<'a>>,
}

impl<'a> ReportDocument<'a> {
    pub(crate) fn new(report: &'a Report, verdict: &'a ReportVerdict) -> Self {
        let listed = report.figures.iter().flat_map(|group| {
            group.figures.iter().map(|figure| FigureEntry::new(figure, Some(group.subject)))
        });
        Self {
            verdict,
            answer: ReportSummary::from_report(report),
            summary: verdict.summary(),
            statements: &verdict.statements,
            report,
            figures: listed.collect(),
        }
    }
}

/// The report as JSON, with the verdict of the page and without the drawings.
///
/// # Errors
/// None in practice: every field can be serialised, and NaN becomes `null`.
pub(crate) fn report_json(report: &Report) -> Result<String, serde_json::Error> {
    #[derive(Serialize)]
    struct ReportFile<'a> {
        format: u32,
        #[serde(flatten)]
        written: ReportDocument<'a>,
    }
    let verdict = ReportVerdict::from_report(report);
    let file = ReportFile { format: FORMAT, written: ReportDocument::new(report, &verdict) };
    serde_json::to_string_pretty(&file).map(|text| text + "\n")
}

#[cfg(test)]
mod tests {
    use super::super::FigureGroup;
    use super::*;
    use crate::compare::TargetComparison;
    use crate::figures::{Drawing, FigureBlock};

    #[test]
    fn the_json_has_the_verdict_and_no_drawings() {
        let block = FigureBlock {
            condition: None,
            file: "history.svg".to_owned(),
            caption: "c".to_owned(),
            details: String::new(),
            drawing: Drawing::Moving("<svg/>".to_owned()),
        };
        let figures = vec![FigureGroup { subject: FigureSubject::Blade, figures: vec![block] }];
        let components = vec![TargetComparison { model: Some(f64::NAN), ..TargetComparison::default() }];
        let text = report_json(&Report { figures, components, ..Report::default() }).unwrap();
        let json: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(
            (&json["format"], &json["all_components_met"], &json["published_only"]),
            (&1.into(), &false.into(), &true.into())
        );
        assert!(json["components"][0]["model"].is_null());
        assert_eq!(
            (&json["figures"][0]["file"], &json["figures"][0]["subject"]),
            (&"history.svg".into(), &"blade".into())
        );
        assert!(
            json["figures"][0].get("drawing").is_none() && json["statements"][0]["statement"].is_string()
        );
    }
}
