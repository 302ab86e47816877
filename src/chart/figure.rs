//! A figure, and what it is drawn for.

use super::elements::Panel;

/// A figure.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Figure {
    /// Heading on a screen: the claim with its number. With the subtitle, the name for screen readers. In
    /// print both belong in the caption.
    pub title: String,
    /// Line under the heading: what is drawn, and whether it is synthetic; empty for none.
    pub subtitle: String,
    /// Whether it shows data that no camera took: print says so inside the axes, a screen in the subtitle.
    pub watermarked: bool,
    /// What the figure shows, for screen readers.
    pub description: String,
    /// Width on a screen, mm.
    pub width_mm: f64,
    /// Panels side by side where the width allows; 0 and 1 are one below the other.
    pub columns: usize,
    /// Panels in the order of reading.
    pub panels: Vec<Panel>,
}

/// What a figure is drawn for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Medium {
    /// A screen, light or dark as its reader has it, in the figure's own width.
    Screen,
    /// A column of a journal, `COLUMN_WIDTH_MM` wide, in fixed colours and without heading or style sheet.
    Column,
    /// A page of a journal, `FULL_WIDTH_MM` wide, in the same way.
    Page,
}
