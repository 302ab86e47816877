//! A figure, and what it is drawn for.

use super::axis::CanvasAxis;
use super::canvas::Canvas;
use super::elements::Panel;
use super::layout::{FigureLayout, PanelLayout, limit_height};
use super::path::CanvasArea;
use super::style::{COLUMN_WIDTH_MM, FULL_WIDTH_MM, MAX_HEIGHT_MM, UNITS_PER_MM, WHITE};
use super::{heat_map, panel, style};
use crate::text::make_printable;

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

// What a figure cannot hold, such as something that moves, drawn over it where its panels lie.

/// Where a panel lies on the canvas of its figure.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PanelPlacement {
    x: CanvasAxis,
    y: CanvasAxis,
    area: CanvasArea,
}

impl PanelPlacement {
    /// Canvas coordinates of a point of the panel; `None` outside its axes.
    pub(crate) fn canvas_point_inside(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        self.canvas_point(x, y).filter(|point| self.area.contains(*point))
    }

    /// The same wherever it lies.
    pub(crate) fn canvas_point(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        Some((self.x.canvas_position(x)?, self.y.canvas_position(y)?))
    }

    /// Canvas coordinates of the corners at the upper left and the lower right.
    pub(crate) fn corners(&self) -> [(f64, f64); 2] {
        [(self.area.left, self.area.top), (self.area.right, self.area.bottom)]
    }
}

impl Figure {
    /// The figure for a screen with the SVG elements over it that `over` makes for the places of its panels.
    pub(crate) fn svg_with_overlay(&self, over: impl FnOnce(&[PanelPlacement]) -> String) -> String {
        let layout = FigureLayout::new(self);
        let place = |p: &PanelLayout| PanelPlacement { x: p.x, y: p.y, area: p.area };
        let plots: Vec<PanelPlacement> = layout.panels.iter().map(place).collect();
        let drawn = self.to_svg(Medium::Screen);
        let below = drawn.trim_end().trim_end_matches("</svg>");
        format!("{below}{}</svg>\n", over(&plots))
    }
}

// A figure as SVG.

impl Figure {
    /// The figure as SVG, vectors alone; the same figure always gives the same bytes.
    #[must_use]
    pub fn to_svg(&self, medium: Medium) -> String {
        match medium {
            Medium::Screen => self.render_layout(self, &style::dark_theme_style(), false),
            Medium::Column | Medium::Page => {
                self.render_layout(&self.resize_for_medium(medium), "", self.watermarked)
            }
        }
    }

    /// Its height in a medium, mm. In print, panels are lowered as far as they stay legible until it is at
    /// most [`MAX_HEIGHT_MM`](super::MOST_HEIGHT_MM).
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

    /// The figure as it is laid out for a medium, under its own name.
    fn render_layout(&self, laid_out: &Self, style: &str, marked: bool) -> String {
        let parts = [self.title.as_str(), &self.subtitle].into_iter();
        let name: Vec<&str> = parts.filter(|s| !s.is_empty()).collect();
        render_svg(laid_out, [&self.title, &name.join(". ")], style, marked)
    }
}

fn render_svg(figure: &Figure, [title, name]: [&str; 2], style: &str, marked: bool) -> String {
    let layout = FigureLayout::new(figure);
    // (what is printed has no style and no script)
    let live = !style.is_empty();
    let size =
        ((figure.width_mm * UNITS_PER_MM).round() as u32, (layout.height * UNITS_PER_MM).round() as u32);
    let whole = CanvasArea { left: 0.0, top: 0.0, right: f64::from(size.0), bottom: f64::from(size.1) };
    let ground = Canvas::render_elements(size, |canvas| canvas.fill_rectangle(&whole, WHITE, 1.0));
    let cells = |placed: &PanelLayout| {
        let heat = placed.panel.heat_map.as_ref()?;
        let cells = heat_map::heat_cells_svg(heat, &placed.x, &placed.y, &placed.area)?;
        Some(format!("<g class=\"cells\">\n{cells}</g>\n"))
    };
    let maps: String = layout.panels.iter().filter_map(cells).collect();
    let drawn = Canvas::render_elements(size, |canvas| {
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
         stroke-linejoin=\"round\">\n<title>{title}</title>\n<desc>{}</desc>\n{style}{ground}{maps}{drawn}</svg>\n",
        f64::from(width) / UNITS_PER_MM,
        f64::from(height) / UNITS_PER_MM,
        description.trim(),
    )
}

fn escape_text(text: &str) -> String {
    html_escape::encode_safe(&make_printable(text)).into_owned()
}
