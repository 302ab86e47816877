//! What a figure cannot hold, such as something that moves, drawn over it where its panels lie.

use super::axis::CanvasAxis;
use super::figure::{Figure, Medium};
use super::layout::FigureLayout;
use super::path::CanvasArea;

/// Where a panel lies on the canvas of its figure.
#[derive(Debug, Clone, Copy)]
pub struct PanelPlacement {
    x: CanvasAxis,
    y: CanvasAxis,
    area: CanvasArea,
}

impl PanelPlacement {
    /// Canvas coordinates of a point of the panel; `None` outside its axes.
    #[must_use]
    pub fn canvas_point_inside(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        self.canvas_point(x, y).filter(|point| self.area.contains(*point))
    }

    /// The same wherever it lies.
    #[must_use]
    pub fn canvas_point(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        Some((self.x.canvas_position(x)?, self.y.canvas_position(y)?))
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
    pub(crate) fn svg_with_overlay(&self, over: impl FnOnce(&[PanelPlacement]) -> String) -> String {
        let plots: Vec<PanelPlacement> = FigureLayout::new(self)
            .panels
            .iter()
            .map(|p| PanelPlacement { x: p.x, y: p.y, area: p.area })
            .collect();
        let drawn = self.to_svg(Medium::Screen);
        let below = drawn.trim_end().trim_end_matches("</svg>");
        format!("{below}{}</svg>\n", over(&plots))
    }
}
