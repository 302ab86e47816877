//! A figure as SVG.

use super::canvas::Canvas;
use super::colours::WHITE;
use super::figure::{Figure, Medium};
use super::height::limit_height;
use super::layout::FigureLayout;
use super::path::CanvasArea;
use super::sizes::{COLUMN_WIDTH_MM, FULL_WIDTH_MM, MAX_HEIGHT_MM, UNITS_PER_MM};
use super::{cells, letters, panel, theme};
use crate::text::make_printable;

impl Figure {
    /// The figure as SVG, vectors alone; the same figure always gives the same bytes.
    #[must_use]
    pub fn to_svg(&self, medium: Medium) -> String {
        match medium {
            Medium::Screen => self.render_layout(self, &theme::dark_theme_style(), false),
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
        let name: Vec<&str> =
            [&self.title, &self.subtitle].into_iter().map(String::as_str).filter(|s| !s.is_empty()).collect();
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
    let maps: String = layout
        .panels
        .iter()
        .filter_map(|placed| {
            let cells =
                cells::heat_cells_svg(placed.panel.heat_map.as_ref()?, &placed.x, &placed.y, &placed.area)?;
            Some(format!("<g class=\"cells\">\n{cells}</g>\n"))
        })
        .collect();
    let drawn = Canvas::render_elements(size, |canvas| {
        panel::draw_heading(canvas, figure, &layout);
        for placed in &layout.panels {
            panel::draw_panel(canvas, placed, live);
        }
        letters::draw_panel_letters(canvas, &layout.panels);
        if let Some(first) = layout.panels.first().filter(|_| marked) {
            letters::draw_watermark(canvas, first);
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
