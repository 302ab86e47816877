//! Letters of panels, and what print says inside the axes.

use super::canvas::{Canvas, Lettering, TextAnchor};
use super::colours::{Rgb, WHITE, readable_on};
use super::elements::TextAnnotation;
use super::heat;
use super::layout::PanelLayout;
use super::path::{CanvasArea, CanvasPoint};
use super::sizes::{EDGE_MM, SMALL_MM, UNITS_PER_MM};
use super::text::{WIDE_LETTER, text_width};

/// What print says of data that no camera took; the rest belongs in the caption.
const WATERMARK: &str = "synthetic";
/// Its grey, with a contrast of 5.7 to 1 on white.
const WATERMARK_GREY: Rgb = (0x66, 0x66, 0x66);
/// Distance of a letter from the axes under it, and of the word from the frame, mm.
const LETTER_GAP_MM: f64 = 0.6;
const WATERMARK_INSET_MM: f64 = 0.8;

/// Width that the letter of a drawing without axes takes before its title, canvas units.
pub(super) const LETTER_WIDTH: f64 = 4.4 * UNITS_PER_MM;

/// The letters of all panels, each over the upper left corner of its panel with its labels.
pub(super) fn draw_panel_letters(canvas: &mut Canvas, panels: &[PanelLayout]) {
    let look = Lettering { bold: true, ..Lettering::plain(SMALL_MM, TextAnchor::Left) };
    for placed in panels {
        let Some(letter) = placed.letter else { continue };
        let edge_mm = if placed.panel.bare { EDGE_MM / 2.0 } else { EDGE_MM };
        let at = (
            ((placed.column_mm + edge_mm) * UNITS_PER_MM).round(),
            placed.area.top - (LETTER_GAP_MM + SMALL_MM / 2.0) * UNITS_PER_MM,
        );
        canvas.draw_text(&format!("({letter})"), at, look);
    }
}

/// The word in the corner of a panel over which the fewest lines run.
pub(super) fn draw_watermark(canvas: &mut Canvas, placed: &PanelLayout) {
    let width = text_width(WATERMARK, SMALL_MM) * WIDE_LETTER / super::text::LETTER * UNITS_PER_MM;
    let (height, inside) = (SMALL_MM * 1.2 * UNITS_PER_MM, WATERMARK_INSET_MM * UNITS_PER_MM);
    let area = &placed.area;
    let corner = |right: bool, bottom: bool| {
        let left = if right { area.right - inside - width } else { area.left + inside };
        let top = if bottom { area.bottom - inside - height } else { area.top + inside };
        CanvasArea { left, top, right: left + width, bottom: top + height }
    };
    let corners = [(true, false), (false, false), (true, true), (false, true)].map(|(r, b)| corner(r, b));
    // over the axes where every corner is a cell with its number
    let over = CanvasArea { top: area.top - inside - height, bottom: area.top - inside, ..corners[0] };
    let full = |corner: &CanvasArea| count_texts_in(placed, corner) > 0;
    let free =
        corners.iter().filter(|corner| !full(corner)).min_by_key(|corner| count_lines_in(placed, corner));
    let free = free.unwrap_or(&over);
    let at = ((free.left + free.right) / 2.0, (free.top + free.bottom) / 2.0);
    let value = (placed.x.value_at(at.0), placed.y.value_at(at.1));
    let scales = (placed.x.scale, placed.y.scale);
    let heat = placed.panel.heat_map.as_ref().filter(|_| area.contains(at));
    let map = heat.and_then(|heat| heat::colour_at(heat, scales, value));
    if map.is_none() {
        canvas.fill_rectangle(free, WHITE, 0.8);
    }
    let ink = map.map_or(WATERMARK_GREY, readable_on);
    canvas.draw_coloured_text(WATERMARK, at, Lettering::plain(SMALL_MM, TextAnchor::Centre), ink);
}

/// Canvas coordinates of a point of a panel.
fn canvas_point(placed: &PanelLayout, (x, y): (f64, f64)) -> Option<CanvasPoint> {
    Some((placed.x.canvas_position(x)?, placed.y.canvas_position(y)?))
}

/// How many texts of a panel reach into an area.
fn count_texts_in(placed: &PanelLayout, area: &CanvasArea) -> usize {
    let reaches = |text: &TextAnnotation| {
        let Some((x, y)) = canvas_point(placed, text.at) else { return false };
        let (wide, high) =
            (text_width(&text.text, SMALL_MM) / 2.0 * UNITS_PER_MM, SMALL_MM / 2.0 * UNITS_PER_MM);
        x + wide > area.left && x - wide < area.right && y + high > area.top && y - high < area.bottom
    };
    placed.panel.annotations.iter().filter(|text| reaches(text)).count()
}

/// How many pieces of lines and symbols of a panel lie in an area.
fn count_lines_in(placed: &PanelLayout, area: &CanvasArea) -> usize {
    let of_series = placed.panel.series.iter().map(|series| {
        let points: Vec<Option<CanvasPoint>> =
            series.points.iter().map(|p| p.and_then(|p| canvas_point(placed, p))).collect();
        let inside = points.iter().flatten().filter(|p| area.contains(**p)).count();
        let between = points.windows(2).filter(|pair| {
            let [Some(a), Some(b)] = pair else { return false };
            !series.mark.is_symbol() && area.clip(*a, *b).is_some()
        });
        inside + between.count()
    });
    of_series.sum()
}

#[cfg(test)]
mod tests {
    use crate::chart::{ChartAxis, Figure, Medium, Panel, Series, TextAnnotation};

    /// Place of a text in a figure, canvas units.
    fn found(svg: &str, text: &str) -> Option<(f64, f64)> {
        let before =
            svg.split(&format!(">\n{text}\n</text>")).next().filter(|part| part.len() < svg.len())?;
        let element = before.rsplit_once("<text ")?.1;
        let number = |key: &str| element.split_once(key)?.1.split('"').next()?.parse().ok();
        Some((number("x=\"")?, number(" y=\"")?))
    }

    fn panel() -> Panel {
        let axis = || ChartAxis::linear("q").with_range(0.0, 1.0);
        Panel { x: axis(), y: axis(), height_mm: 30.0, ..Panel::default() }
    }

    fn figure(panels: Vec<Panel>, synthetic: bool) -> Figure {
        Figure {
            width_mm: 170.0,
            panels,
            watermarked: synthetic,
            title: "claim".to_owned(),
            ..Figure::default()
        }
    }

    #[test]
    fn one_panel_has_no_letter_and_several_have_theirs_from_above() {
        let alone = figure(vec![panel()], false).to_svg(Medium::Screen);
        assert_eq!(found(&alone, "(a)"), None);
        let both = figure(vec![panel(), panel()], false).to_svg(Medium::Column);
        let [a, b] = ["(a)", "(b)"].map(|letter| found(&both, letter).unwrap());
        assert!(a.0 == b.0 && a.1 < b.1, "{a:?} {b:?}");
        let many = figure(vec![panel(); 27], false).to_svg(Medium::Screen);
        assert_eq!(found(&many, "(a)"), None);
    }

    #[test]
    fn print_marks_synthetic_data_where_no_line_runs() {
        let mut falling = panel();
        falling.series =
            vec![Series { points: vec![Some((0.5, 1.0)), Some((1.0, 0.9))], ..Series::default() }];
        let drawn = figure(vec![falling], true);
        assert_eq!(found(&drawn.to_svg(Medium::Screen), "synthetic"), None);
        let (x, _) = found(&drawn.to_svg(Medium::Column), "synthetic").unwrap();
        assert!(x < 85.0 * 15.0 / 2.0, "on the left: {x}");
        assert_eq!(found(&figure(vec![panel()], false).to_svg(Medium::Column), "synthetic"), None);
    }

    #[test]
    fn the_mark_leaves_the_axes_where_all_corners_have_numbers() {
        let mut table = panel();
        let corners = [(0.05, 0.05), (0.95, 0.05), (0.05, 0.95), (0.95, 0.95)];
        table.annotations = corners
            .map(|at| TextAnnotation { text: "-0.27".to_owned(), at, ..TextAnnotation::default() })
            .to_vec();
        table.title = "t".to_owned();
        let svg = figure(vec![table], true).to_svg(Medium::Column);
        let [mark, number] = ["synthetic", "-0.27"].map(|text| found(&svg, text).unwrap());
        assert!(mark.1 < number.1 - 30.0, "{mark:?} {number:?}");
    }
}
