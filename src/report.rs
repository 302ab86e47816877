//! Results as figures and pages: plain data in, SVG, HTML and JSON as text out.

pub mod chart;
pub mod history;
pub mod spectra;

/// The line under a heading; a figure of synthetic data always says so there.
fn subtitle(synthetic: bool, text: &str) -> String {
    match (synthetic, text.is_empty()) {
        (true, true) => "synthetic recording: no camera took it".to_owned(),
        (true, false) => format!("synthetic recording: no camera took it; {text}"),
        (false, _) => text.to_owned(),
    }
}
