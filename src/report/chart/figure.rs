//! A figure, and what it is drawn for.

use super::elements::Panel;

/// A figure.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Figure {
    /// Heading, and name for screen readers.
    pub title: String,
    /// Line under the heading, such as a statement that the data are synthetic; empty for none.
    pub subtitle: String,
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
    /// A column of a journal, `COLUMN_WIDTH_MM` wide, in fixed colours and without a style sheet.
    Column,
    /// A page of a journal, `FULL_WIDTH_MM` wide, in the same way.
    Page,
}
