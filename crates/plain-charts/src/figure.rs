//! A figure, its media, and its rendering as SVG.

use super::elements::Panel;

/// A figure of one or more panels.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Figure {
    /// Heading, shown on a screen: the main result with its number. Title and subtitle together name the
    /// figure for screen readers; in print both belong in the caption.
    pub title: String,
    /// Line under the heading: contents, and whether the data are synthetic; empty for none.
    pub subtitle: String,
    /// Whether the data are synthetic. If so, a watermark inside the axes says it in print, and the subtitle
    /// says it on a screen.
    pub watermarked: bool,
    /// Description for screen readers.
    pub description: String,
    /// Width on a screen, mm.
    pub width_mm: f64,
    /// Number of panels side by side if the width allows; 0 and 1 stack them.
    pub columns: usize,
    /// Panels in reading order.
    pub panels: Vec<Panel>,
}

/// Medium of a figure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Medium {
    /// A screen with a light or dark theme; the width is that of [`Figure::width_mm`].
    Screen,
    /// A column of a journal, `COLUMN_WIDTH_MM` wide, in fixed colours and without heading or style sheet.
    Column,
    /// A page of a journal, `FULL_WIDTH_MM` wide, styled as [`Self::Column`].
    Page,
}
