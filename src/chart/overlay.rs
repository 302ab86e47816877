//! What a figure cannot hold, such as something that moves, drawn over it where its panels lie.

use super::axis::Mapped;
use super::figure::{Figure, Medium};
use super::layout::Layout;
use super::path::Area;

/// Where a panel lies on the canvas of its figure.
#[derive(Debug, Clone, Copy)]
pub struct Plot {
    x: Mapped,
    y: Mapped,
    area: Area,
}

impl Plot {
    /// Canvas coordinates of a point of the panel; `None` outside its axes.
    #[must_use]
    pub fn inside(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        self.place(x, y).filter(|point| self.area.holds(*point))
    }

    /// The same wherever it lies.
    #[must_use]
    pub fn place(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        Some((self.x.place(x)?, self.y.place(y)?))
    }

    /// Canvas coordinates of the corners at the upper left and the lower right.
    #[must_use]
    pub fn corners(&self) -> [(f64, f64); 2] {
        [(self.area.left, self.area.top), (self.area.right, self.area.bottom)]
    }
}

impl Figure {
    /// The figure for a screen with the SVG elements over it that `over` makes for the places of its panels.
    #[must_use]
    pub(crate) fn overlaid(&self, over: impl FnOnce(&[Plot]) -> String) -> String {
        let plots: Vec<Plot> =
            Layout::of(self).panels.iter().map(|p| Plot { x: p.x, y: p.y, area: p.area }).collect();
        let drawn = self.svg(Medium::Screen);
        let below = drawn.trim_end().trim_end_matches("</svg>");
        format!("{below}{}</svg>\n", over(&plots))
    }
}
