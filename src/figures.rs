//! Figures of the reports. Each file contains the data, the drawing and the caption of one figure, and is
//! named after its SVG file.

pub mod analysis;
pub mod animation;
pub(crate) mod central_difference;
pub mod corner;
pub mod cycle;
pub mod evidence;
pub(crate) mod figure_text;
pub mod friction;
pub mod history;
pub mod modes;
pub mod motion;
pub mod poses;
pub mod profiles;
pub mod pulls;
pub mod recorded;
pub mod residuals;
pub mod ring_down;
pub mod spectrogram;
pub mod spectrum;
pub mod stability;
pub mod stick_slip;
pub mod sweep_map;
pub mod sweep_sheet;
pub mod twin;
pub mod video_frames;
pub mod windows;
pub mod work_precision;

use plain_charts as chart;
use serde::Serialize;

/// A figure of a report page, with its texts.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct FigureBlock {
    /// File name in the folder of the page.
    pub file: String,
    /// Caption: one sentence with the result.
    pub caption: String,
    /// Further sentences on method and contents of the figure; empty for none.
    pub details: String,
    /// Index of the condition in the job; `None` for a figure of the whole job.
    #[serde(skip)]
    pub condition: Option<usize>,
    /// The drawing.
    #[serde(skip)]
    pub drawing: Drawing,
}

impl FigureBlock {
    /// This figure, with the first `panels` panels of another figure below its own. Animations stay as they
    /// are.
    pub(crate) fn with_panels(mut self, other: Self, panels: usize) -> Self {
        if let (Drawing::Chart(whole), Drawing::Chart(next)) = (&mut self.drawing, other.drawing) {
            let mut further: Vec<chart::Panel> = next.panels.into_iter().take(panels).collect();
            // an outline marks the part that a later panel enlarges, and this panel is left out
            further.iter_mut().for_each(|panel| panel.shaded_spans.retain(|span| !span.outlined));
            whole.panels.extend(further);
        }
        self
    }
}

/// The text of a figure.
#[derive(Default)]
pub(crate) struct FigureText {
    /// Caption: one sentence with the result.
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

/// Joins two parts of a line with a semicolon; an empty part is left out.
pub(crate) fn about(name: &str, said: &str) -> String {
    [name, said].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join("; ")
}

/// Sentence for a report in which the recorded head turns in the opposite direction to the model's head.
pub(crate) const OPPOSED: &str = "The recorded head turns the other way than the model's, so that nothing with a sign can \
     agree: start the scene half a period of its drive later";

/// Clause for a condition of which only numbers are published, not traces.
pub(crate) const NO_TRACES: &str = "model alone: no traces are published";

/// The line under a heading; for synthetic data it begins with a note that says so.
pub(crate) fn subtitle(synthetic: bool, text: &str) -> String {
    about(if synthetic { "synthetic recording: no camera took it" } else { "" }, text)
}

/// A figure as wide as two journal columns, with its panels one below another.
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
