//! A figure as SVG text for a medium, with or without an overlay.

use crate::axis::CanvasAxis;
use crate::canvas::Canvas;
use crate::figure::{Figure, Medium};
use crate::layout::{FigureLayout, PanelLayout, limit_height};
use crate::path::CanvasArea;
use crate::printable::make_printable;
use crate::style::{COLUMN_WIDTH_MM, FULL_WIDTH_MM, MAX_HEIGHT_MM, UNITS_PER_MM, WHITE};
use crate::{heat_map, panel, style};

/// Position of a panel on the canvas of its figure.
#[derive(Debug, Clone, Copy)]
pub struct PanelPlacement {
    x: CanvasAxis,
    y: CanvasAxis,
    area: CanvasArea,
}

impl PanelPlacement {
    /// Canvas coordinates of a point of the panel; `None` outside its axes.
    pub fn canvas_point_inside(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        self.canvas_point(x, y).filter(|point| self.area.contains(*point))
    }

    /// Canvas coordinates of a point, inside or outside the axes.
    pub fn canvas_point(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        Some((self.x.canvas_position(x)?, self.y.canvas_position(y)?))
    }

    /// Canvas coordinates of the upper left and the lower right corner of the axes.
    pub fn corners(&self) -> [(f64, f64); 2] {
        [(self.area.left, self.area.top), (self.area.right, self.area.bottom)]
    }
}

impl Figure {
    /// The figure as SVG for a screen. `over` receives the positions of the panels and returns SVG elements,
    /// which are drawn on top.
    pub fn svg_with_overlay(&self, over: impl FnOnce(&[PanelPlacement]) -> String) -> String {
        let layout = FigureLayout::new(self);
        let place = |p: &PanelLayout| PanelPlacement { x: p.x, y: p.y, area: p.area };
        let plots: Vec<PanelPlacement> = layout.panels.iter().map(place).collect();
        let drawn = self.to_svg(Medium::Screen);
        let below = drawn.trim_end().trim_end_matches("</svg>");
        format!("{below}{}</svg>\n", over(&plots))
    }
}

impl Figure {
    /// The figure as SVG; the same figure always gives the same bytes.
    #[must_use]
    pub fn to_svg(&self, medium: Medium) -> String {
        match medium {
            Medium::Screen => self.render_layout(self, &style::dark_theme_style(), false),
            Medium::Column | Medium::Page => {
                self.render_layout(&self.resize_for_medium(medium), "", self.watermarked)
            }
        }
    }

    /// Height of the figure in a medium, mm. In print, panel heights are reduced until the figure is at most
    /// [`MAX_HEIGHT_MM`] high, or until panels cannot be reduced further and stay legible.
    #[must_use]
    pub fn height_mm(&self, medium: Medium) -> f64 {
        FigureLayout::new(&self.resize_for_medium(medium)).height
    }

    fn resize_for_medium(&self, medium: Medium) -> Self {
        let width_mm = match medium {
            Medium::Screen => return self.clone(),
            Medium::Column => COLUMN_WIDTH_MM,
            Medium::Page => FULL_WIDTH_MM,
        };
        let bare = Self { width_mm, title: String::new(), subtitle: String::new(), ..self.clone() };
        limit_height(bare, MAX_HEIGHT_MM)
    }

    /// Renders `laid_out`, a copy of this figure resized for a medium, with the title and the accessible name
    /// of `self`.
    fn render_layout(&self, laid_out: &Self, style: &str, marked: bool) -> String {
        let parts = [self.title.as_str(), &self.subtitle].into_iter();
        let name: Vec<&str> = parts.filter(|s| !s.is_empty()).collect();
        render_svg(laid_out, [&self.title, &name.join(". ")], style, marked)
    }
}

fn render_svg(figure: &Figure, [title, name]: [&str; 2], style: &str, marked: bool) -> String {
    let layout = FigureLayout::new(figure);
    // a figure in print has neither style sheet nor script
    let live = !style.is_empty();
    let size =
        ((figure.width_mm * UNITS_PER_MM).round() as u32, (layout.height * UNITS_PER_MM).round() as u32);
    let whole = CanvasArea { left: 0.0, top: 0.0, right: f64::from(size.0), bottom: f64::from(size.1) };
    let ground = Canvas::render_elements(size, |canvas| canvas.fill_rectangle(&whole, WHITE, 1.0));
    let drawn = Canvas::render_elements(size, |canvas| {
        for placed in &layout.panels {
            let heat = placed.panel.heat_map.as_ref();
            if let Some(png) = heat.and_then(|heat| heat_map::encode_cells(heat, &placed.x, &placed.y)) {
                canvas.draw_group(Some("class=\"cells\""), |canvas| {
                    canvas.draw_png(&placed.area, &placed.area, &png, false);
                });
            }
        }
        panel::draw_heading(canvas, figure, &layout);
        for placed in &layout.panels {
            panel::draw_panel(canvas, placed, live);
        }
        panel::draw_panel_letters(canvas, &layout.panels);
        if let Some(first) = layout.panels.first().filter(|_| marked) {
            panel::draw_watermark(canvas, first);
        }
    });
    let (width, height) = (size.0, size.1);
    let [title, name, description] = [title, name, &figure.description].map(escape_text);
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" aria-label=\"{name}\" width=\"{:.2}mm\" \
         height=\"{:.2}mm\" viewBox=\"0 0 {width} {height}\" \
         stroke-linejoin=\"round\" font-family=\"sans-serif\">\n<title>{title}</title>\n<desc>{}</desc>\n\
         {style}{ground}{drawn}</svg>\n",
        f64::from(width) / UNITS_PER_MM,
        f64::from(height) / UNITS_PER_MM,
        description.trim(),
    )
}

fn escape_text(text: &str) -> String {
    html_escape::encode_safe(&make_printable(text)).into_owned()
}
