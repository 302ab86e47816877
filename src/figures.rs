//! One file a figure: its data, its drawing and its caption; named as the SVG that it makes.

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

use crate::chart;
use serde::Serialize;

/// A figure of the page.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct FigureBlock {
    /// Name of its file, in the folder of the page.
    pub file: String,
    /// What it shows and what follows from it: one sentence.
    pub caption: String,
    /// How it was made and what else it holds, sentence by sentence; empty for none.
    pub details: String,
    /// The condition whose clock its times are on, by its place in the job; `None` where it has none.
    #[serde(skip)]
    pub condition: Option<usize>,
    /// The figure itself.
    #[serde(skip)]
    pub drawing: Drawing,
}

/// The text of a figure.
#[derive(Default)]
pub(crate) struct Words {
    /// One sentence: what the reader sees and what follows from it.
    pub caption: String,
    pub details: String,
}

/// What is drawn.
#[derive(Debug, Clone, PartialEq)]
pub enum Drawing {
    /// A figure for every [`chart::Medium`].
    Chart(chart::Figure),
    /// An SVG for the screen alone: what moves has no place in print.
    Moving(String),
}

impl Default for Drawing {
    fn default() -> Self {
        Self::Chart(chart::Figure::default())
    }
}

impl Drawing {
    /// As SVG for a screen.
    #[must_use]
    pub fn on_screen(&self) -> String {
        match self {
            Self::Chart(figure) => figure.to_svg(chart::Medium::Screen),
            Self::Moving(svg) => svg.clone(),
        }
    }
}

/// The line under a heading that says what kind of figure it is: what it is about, then what is said of it.
pub(crate) fn about(name: &str, said: &str) -> String {
    [name, said].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join("; ")
}

/// What is said of a recording whose head turns the other way than the model's.
pub(crate) const OPPOSED: &str = "The recorded head turns the other way than the model's, so that nothing with a sign can \
     agree: start the scene half a period of its drive later";

/// What is said of the model where only numbers are published.
pub(crate) const NO_TRACES: &str = "model alone: no traces are published";

/// The line under a heading; a figure of synthetic data always says so there.
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
