//! Results as figures and pages: plain data in, SVG, HTML and JSON as text out.

pub mod analysis;
pub mod chart;
pub mod comparison;
pub mod concise;
pub mod history;
pub mod page;
pub mod ring_down;
pub mod spectra;
pub mod spectrogram;
pub mod sweep_map;
pub mod windows;
pub mod work_precision;

use serde::Serialize;

/// What a report of one fit says. Sections without content are left out of the page.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Report {
    /// Heading: what was fitted to what.
    pub title: String,
    /// How the fit ended, in the word of `result.json`, such as `converged`.
    pub status: String,
    /// The same in a sentence, with the count of evaluations and what failed; empty for none.
    pub ending: String,
    /// The recordings; none when only published numbers are known.
    pub recordings: Vec<RecordingLine>,
    /// Frequencies of components, measured against model.
    pub components: Vec<Comparison>,
    /// Other features, measured against model.
    pub features: Vec<Comparison>,
    /// The fitted parameters.
    pub parameters: Vec<ParameterLine>,
    /// How the best run of the model ended: name and value.
    pub best_run: Vec<Fact>,
    /// Figures in order of the page.
    pub figures: Vec<FigureBlock>,
    /// Reservations that a reader must know, one sentence each.
    pub notes: Vec<String>,
    /// Where the numbers come from.
    pub provenance: Provenance,
}

/// A recording and what it can show.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct RecordingLine {
    /// Name.
    pub name: String,
    /// Whether no camera took it.
    pub synthetic: bool,
    /// Number of frames.
    pub frames: usize,
    /// Recording rate, 1/s.
    pub frame_rate_hz: f64,
    /// Share of the frames in which a point is missing, 0 to 1.
    pub missing: f64,
    /// Tracking noise, standard deviation, m.
    pub noise_m: Option<f64>,
}

/// A number of the experiment beside that of the model.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Comparison {
    /// Name.
    pub name: String,
    /// Unit; empty for a plain number.
    pub unit: String,
    /// Value to be met.
    pub target: f64,
    /// Its standard deviation, where known.
    pub target_sd: Option<f64>,
    /// Value of the model; `None` where it shows none.
    pub model: Option<f64>,
    /// `model / target - 1`.
    pub relative_error: Option<f64>,
    /// Whether it counts as met.
    pub pass: bool,
}

/// A fitted parameter.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct ParameterLine {
    /// Name as in a scene, such as `friction.a`.
    pub name: String,
    /// Symbol in the equations.
    pub symbol: String,
    /// Unit; empty for a plain number.
    pub unit: String,
    /// Estimate.
    pub estimate: f64,
    /// Lower end of the 95 % interval; `None` where it is open.
    pub lower_95: Option<f64>,
    /// Upper end of the 95 % interval; `None` where it is open.
    pub upper_95: Option<f64>,
    /// Verdict in the word of `result.json`, such as [`IDENTIFIED`].
    pub verdict: String,
    /// True value, where the data are synthetic.
    pub truth: Option<f64>,
}

/// Verdict of a parameter that the data determine.
pub const IDENTIFIED: &str = "identified";

/// A named value.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Fact {
    /// Name.
    pub name: String,
    /// Value with its unit.
    pub value: String,
}

/// A figure of the page.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct FigureBlock {
    /// Name of its file beside the page.
    pub file: String,
    /// What it shows and how to read it.
    pub caption: String,
    /// The SVG as made by [`chart::svg`]; set into the page as it is.
    #[serde(skip)]
    pub svg: String,
}

/// Where the numbers come from.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Provenance {
    /// Version of the program.
    pub version: String,
    /// Seed of the search.
    pub seed: Option<u64>,
    /// Fingerprint of problem, data and program.
    pub fingerprint: String,
    /// Files with their hashes.
    pub files: Vec<SourceFile>,
    /// Commands that make this report again.
    pub commands: Vec<String>,
}

/// A file that went into a report.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct SourceFile {
    /// Name.
    pub name: String,
    /// SHA-256, hexadecimal.
    pub sha256: String,
}

impl Report {
    /// Whether any recording is one that no camera took.
    #[must_use]
    pub fn is_synthetic(&self) -> bool {
        self.recordings.iter().any(|r| r.synthetic)
    }

    /// The verdict in sentences: which components and features are met and how far off, and which parameters the data determine.
    #[must_use]
    pub fn verdict(&self) -> Vec<String> {
        let compared = [("component", &self.components), ("feature", &self.features)];
        let met = compared.into_iter().filter_map(|(kind, list)| met(kind, list));
        met.chain(known(&self.parameters)).collect()
    }
}

/// "2 of 2 components are met: low component within 0.9 %, ...".
fn met(kind: &str, list: &[Comparison]) -> Option<String> {
    let each = |c: &Comparison| match c.relative_error {
        Some(error) if c.pass && error.abs() < 1e-3 => format!("{} within 0.1 %", c.name),
        Some(error) if c.pass => format!("{} within {:.1} %", c.name, 100.0 * error.abs()),
        Some(error) => format!("{} is off by {:+.1} %", c.name, 100.0 * error).replace('-', "\u{2212}"),
        None => format!("{} does not appear in the model", c.name),
    };
    let count = list.iter().filter(|c| c.pass).count();
    let plural = if list.len() == 1 { "" } else { "s" };
    let verb = if count == 1 { "is" } else { "are" };
    let (total, details) = (list.len(), list.iter().map(each).collect::<Vec<_>>().join(", "));
    (total > 0).then(|| format!("{count} of {total} {kind}{plural} {verb} met: {details}."))
}

/// Which parameters the data determine, and which they leave open.
fn known(parameters: &[ParameterLine]) -> Option<String> {
    let (known, open): (Vec<_>, Vec<_>) = parameters.iter().partition(|p| p.verdict == IDENTIFIED);
    let names = |list: &[&ParameterLine]| list.iter().map(|p| p.name.as_str()).collect::<Vec<_>>().join(", ");
    let of = format!("{} of {} parameters", known.len(), parameters.len());
    match (known.is_empty(), open.is_empty()) {
        (true, true) => None,
        (false, true) => Some(format!("The data determine {of}: {}.", names(&known))),
        (true, false) => Some(format!("The data determine {of}; open: {}.", names(&open))),
        (false, false) => Some(format!("The data determine {of}: {}; open: {}.", names(&known), names(&open))),
    }
}

/// The report as JSON, with the verdict in sentences and without the drawings.
///
/// # Errors
/// None in practice: every field can be written (a value that is no number becomes `null`).
pub fn report_json(report: &Report) -> Result<String, serde_json::Error> {
    #[derive(Serialize)]
    struct Written<'a> {
        synthetic: bool,
        summary: Vec<String>,
        #[serde(flatten)]
        report: &'a Report,
    }
    let written = Written { synthetic: report.is_synthetic(), summary: report.verdict(), report };
    serde_json::to_string_pretty(&written).map(|text| text + "\n")
}

/// The line under a heading; a figure of synthetic data always says so there.
fn subtitle(synthetic: bool, text: &str) -> String {
    match (synthetic, text.is_empty()) {
        (true, true) => "synthetic recording: no camera took it".to_owned(),
        (true, false) => format!("synthetic recording: no camera took it; {text}"),
        (false, _) => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn comparison(name: &str, model: Option<f64>, pass: bool) -> Comparison {
        let relative_error = model.map(|m| m / 100.0 - 1.0);
        Comparison { name: name.to_owned(), unit: "Hz".to_owned(), target: 100.0, model, relative_error, pass, ..Comparison::default() }
    }

    fn parameter(name: &str, verdict: &str) -> ParameterLine {
        ParameterLine { name: name.to_owned(), verdict: verdict.to_owned(), ..ParameterLine::default() }
    }

    #[test]
    fn the_verdict_says_what_is_met_and_what_is_known() {
        let report = Report {
            components: vec![comparison("low", Some(101.0), true), comparison("high", Some(80.0), false), comparison("third", None, false)],
            parameters: vec![parameter("friction.a", IDENTIFIED), parameter("friction.c", "open-above")],
            ..Report::default()
        };
        let expected = [
            "1 of 3 components is met: low within 1.0 %, high is off by \u{2212}20.0 %, third does not appear in the model.",
            "The data determine 1 of 2 parameters: friction.a; open: friction.c.",
        ];
        assert_eq!(report.verdict(), expected);
        assert!(Report::default().verdict().is_empty());
    }

    #[test]
    fn the_json_has_the_verdict_and_no_drawings() {
        let figures = vec![FigureBlock { file: "history.svg".to_owned(), caption: "c".to_owned(), svg: "<svg/>".to_owned() }];
        let recordings = vec![RecordingLine { synthetic: true, ..RecordingLine::default() }];
        let text = report_json(&Report { figures, recordings, components: vec![comparison("low", Some(f64::NAN), true)], ..Report::default() }).unwrap();
        let json: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(json["synthetic"], true);
        assert!(json["components"][0]["model"].is_null());
        assert_eq!(json["figures"][0]["file"], "history.svg");
        assert!(json["figures"][0].get("svg").is_none());
    }
}
