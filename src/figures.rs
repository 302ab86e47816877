//! Figures of the reports. Each file holds the data, drawing and caption of one figure and has the name of
//! its SVG.

pub mod analysis;
pub mod animation;
pub mod corner;
pub mod cycle;
pub mod evidence;
pub(crate) mod figure_text;
pub mod friction;
pub mod history;
pub mod modes;
pub mod motion;
pub mod phase_portrait;
pub mod poses;
pub mod profiles;
pub mod pulls;
pub mod recorded;
pub mod residuals;
pub mod ring_down;
pub mod spectrogram;
pub mod spectrum;
pub mod sweep_map;
pub mod sweep_sheet;
pub mod twin;
pub mod video_frames;
pub mod windows;
pub mod work_precision;

use plain_charts as chart;
use serde::Serialize;

/// A figure of a page with its texts.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct FigureBlock {
    /// File name in the folder of the page.
    pub file: String,
    /// Caption: one sentence with the result.
    pub caption: String,
    /// Further sentences on method and contents; empty for none.
    pub details: String,
    /// Index of the condition in the job; `None` for a figure of the whole job.
    #[serde(skip)]
    pub condition: Option<usize>,
    /// The drawing.
    #[serde(skip)]
    pub drawing: Drawing,
}

/// The text of a figure.
#[derive(Default)]
pub(crate) struct FigureText {
    /// One sentence with the result.
    pub caption: String,
    pub details: String,
}

/// The drawing of a figure.
#[derive(Debug, Clone, PartialEq)]
pub enum Drawing {
    /// A chart, drawn for every [`chart::Medium`].
    Chart(chart::Figure),
    /// An animated SVG, for screens only.
    Moving(String),
}

impl Default for Drawing {
    fn default() -> Self {
        Self::Chart(chart::Figure::default())
    }
}

impl Drawing {
    /// The SVG for a screen.
    #[must_use]
    pub fn on_screen(&self) -> String {
        match self {
            Self::Chart(figure) => figure.to_svg(chart::Medium::Screen),
            Self::Moving(svg) => svg.clone(),
        }
    }
}

/// Two parts of a line joined with a semicolon; empty parts are dropped.
pub(crate) fn about(name: &str, said: &str) -> String {
    [name, said].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join("; ")
}

/// Sentence on a recording whose head turns the other way than the model's.
pub(crate) const OPPOSED: &str = "The recorded head turns the other way than the model's, so that nothing with a sign can \
     agree: start the scene half a period of its drive later";

/// Clause where only numbers are published and no traces.
pub(crate) const NO_TRACES: &str = "model alone: no traces are published";

/// The line under a heading; for synthetic data it starts with a note.
pub(crate) fn subtitle(synthetic: bool, text: &str) -> String {
    about(if synthetic { "synthetic recording: no camera took it" } else { "" }, text)
}

/// A figure over two columns of a journal, one panel below the other.
pub(crate) fn full_figure(
    title: &str,
    synthetic: bool,
    note: &str,
    description: impl Into<String>,
    panels: impl IntoIterator<Item = chart::Panel>,
) -> chart::Figure {
    chart::Figure {
        title: title.to_owned(),
        subtitle: subtitle(synthetic, note),
        watermarked: synthetic,
        description: description.into(),
        width_mm: chart::FULL_WIDTH_MM,
        panels: panels.into_iter().collect(),
        ..chart::Figure::default()
    }
}
