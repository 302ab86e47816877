//! Drawing of heading, legend, and panels with axes.

use super::axis::{AxisScale, CanvasAxis, Tick};
use super::canvas::{Canvas, Lettering, TextAnchor};
use super::elements::{Raster, SampledSeries, Series, ShadedSpan, TextAnnotation, VerticalLine};
use super::figure::Figure;
use super::layout::{
    FigureLayout, LegendEntry, PanelLayout, SMALL_LINE_MM, label_span, legend_text, shorten_to_panel,
    subtitle_lines, title_lines, widest_label_mm, y_label_lines,
};
use super::path::{CanvasArea, CanvasPoint};
use super::series::{draw_marks, draw_ribbon, draw_series};
use super::style::{
    EDGE_MM, FRAME, GRID, LINE_MM, Mark, Rgb, SHADING_OPACITY, SMALL_MM, TEXT_MM, TICK_MM, TITLE_MM,
    UNITS_PER_MM, WHITE, readable_on,
};
use super::text::{WIDE_LETTER, text_width};
use super::{contours, hatch, heat_map};
use crate::printable::make_printable;
use html_escape::encode_safe;
use portable_math as math;
use std::fmt::Write;

pub(super) fn draw_heading(canvas: &mut Canvas, figure: &Figure, layout: &FigureLayout) {
    let plain = Lettering::plain(TEXT_MM, TextAnchor::Left);
    let heading = Lettering { size_mm: TITLE_MM, bold: true, ..plain };
    let title = title_lines(figure).into_iter().map(|line| (line, heading));
    let subtitle = subtitle_lines(figure).into_iter().map(|line| (line, plain));
    for (row, (line, look)) in title.chain(subtitle).enumerate() {
        let y = (EDGE_MM + (row as f64 + 0.5) * LINE_MM) * UNITS_PER_MM;
        canvas.draw_text(&line, (EDGE_MM * UNITS_PER_MM, y), look);
    }
    for (entry, x, y) in &layout.legend {
        let (x, y) = (x * UNITS_PER_MM, y * UNITS_PER_MM);
        draw_legend_sample(canvas, *entry, x, y);
        canvas.draw_text(&legend_text(entry.label(), figure), (x + 7.0 * UNITS_PER_MM, y), plain);
    }
}

/// Draws the sample of a legend entry.
fn draw_legend_sample(canvas: &mut Canvas, entry: LegendEntry, x: f64, y: f64) {
    let right = x + 6.0 * UNITS_PER_MM;
    let patch = CanvasArea { left: x, right, top: y - UNITS_PER_MM, bottom: y + UNITS_PER_MM };
    match entry {
        LegendEntry::Series(_, colour, mark) => {
            let (middle, ends) = ([Some((x + 3.0 * UNITS_PER_MM, y))], [Some((x, y)), Some((right, y))]);
            let sample = CanvasArea { left: x, right, top: y, bottom: y };
            if !mark.is_symbol() {
                let line = if let Mark::Joined(_) = mark { Mark::Line } else { mark };
                draw_marks(canvas, &ends, colour, line, &sample);
            }
            if mark.is_symbol() || matches!(mark, Mark::Joined(_)) {
                draw_marks(canvas, &middle, colour, mark, &sample);
            }
        }
        LegendEntry::Area(_, colour, false) => canvas.fill_rectangle(&patch, colour.rgb(), SHADING_OPACITY),
        LegendEntry::Area(_, colour, true) => draw_outline(canvas, &patch, colour.rgb()),
        LegendEntry::Hatch(_, pattern) => hatch::draw_hatch_sample(canvas, &patch, pattern),
    }
}

/// Line width of an outlined span, canvas units.
const OUTLINE: u32 = 5;

fn draw_outline(canvas: &mut Canvas, area: &CanvasArea, colour: Rgb) {
    canvas.draw_line(&area.outline(), colour, OUTLINE);
}

/// Draws a panel. The parts of a `live` panel are in SVG groups that the script of a web page can move.
pub(super) fn draw_panel(canvas: &mut Canvas, placed: &PanelLayout, live: bool) {
    let plot = panel_attributes(placed).filter(|_| live);
    let is_live = plot.is_some();
    canvas.draw_group(plot.as_deref(), |canvas| {
        canvas.draw_group(is_live.then_some(WITHIN_AXES_CLASS), |canvas| draw_under_axes(canvas, placed));
        if !placed.panel.bare {
            draw_axes(canvas, placed, is_live);
        }
        canvas.draw_group(is_live.then_some(WITHIN_AXES_CLASS), |canvas| {
            draw_over_axes(canvas, placed, is_live)
        });
        canvas.draw_group(is_live.then_some(OVER_AXES_CLASS), |canvas| draw_top_labels(canvas, placed));
        draw_title(canvas, placed);
    });
}

/// Canvas area of a span; `None` for a span outside the axes.
fn shaded_span_area(placed: &PanelLayout, band: &ShadedSpan) -> Option<CanvasArea> {
    let (area, from, to) =
        (&placed.area, placed.x.canvas_position(band.from)?, placed.x.canvas_position(band.to)?);
    let (left, right) = (from.min(to).max(area.left), from.max(to).min(area.right));
    (left < right).then_some(CanvasArea { left, right, ..*area })
}

fn draw_under_axes(canvas: &mut Canvas, placed: &PanelLayout) {
    if let Some(raster) = &placed.panel.raster {
        draw_raster(canvas, placed, raster);
    }
    for band in placed.panel.shaded_spans.iter().filter(|b| !b.outlined) {
        if let Some(span) = shaded_span_area(placed, band) {
            canvas.fill_rectangle(&span, band.colour.rgb(), SHADING_OPACITY);
        }
    }
    for hatch in &placed.panel.hatches {
        hatch::draw_hatch(canvas, placed, hatch);
    }
    contours::draw_contours(canvas, placed);
}

/// Draws a picture, clipped to the axes.
fn draw_raster(canvas: &mut Canvas, placed: &PanelLayout, raster: &Raster) {
    let edges =
        |axis: &CanvasAxis, [from, to]: [f64; 2]| axis.canvas_position(from).zip(axis.canvas_position(to));
    let (Some((left, right)), Some((bottom, top))) = (edges(&placed.x, raster.x), edges(&placed.y, raster.y))
    else {
        return;
    };
    canvas.draw_png(&CanvasArea { left, right, top, bottom }, &placed.area, &raster.png, true);
}

fn draw_over_axes(canvas: &mut Canvas, placed: &PanelLayout, live: bool) {
    let panel = placed.panel;
    for shaded in &panel.ribbons {
        draw_ribbon(canvas, placed, shaded);
    }
    draw_vertical_lines(canvas, placed);
    for (index, drawn) in panel.series.iter().enumerate() {
        let group = live.then(|| series_attributes(index, drawn, placed));
        canvas.draw_group(group.as_deref(), |canvas| draw_series(canvas, placed, drawn));
    }
    for band in panel.shaded_spans.iter().filter(|b| b.outlined) {
        if let Some(span) = shaded_span_area(placed, band) {
            draw_outline(canvas, &span, band.colour.rgb());
        }
    }
    panel.annotations.iter().for_each(|text| draw_annotation(canvas, placed, text));
}

/// Draws text inside the axes. Over a heat map, the text is near black or near white, whichever has more
/// contrast.
fn draw_annotation(canvas: &mut Canvas, placed: &PanelLayout, text: &TextAnnotation) {
    let Some(at) = placed.canvas_point(text.at).filter(|at| placed.area.contains(*at)) else { return };
    let colour = mean_heat_colour(placed, text, at.0).map_or(text.colour.rgb(), readable_on);
    canvas.draw_coloured_text(&text.text, at, Lettering::plain(SMALL_MM, TextAnchor::Centre), colour);
}

/// Mean colour of the heat map under a text with its centre at `middle`; `None` without a heat map.
fn mean_heat_colour(placed: &PanelLayout, text: &TextAnnotation, middle: f64) -> Option<Rgb> {
    /// Number of sampled points on either side of the centre of the text.
    const PLACES: i32 = 3;
    /// Fraction of the half width of the text that the sampled points cover.
    const COVERED: f64 = 0.8;
    let heat = placed.panel.heat_map.as_ref()?;
    let step = COVERED * text_width(&text.text, SMALL_MM) / 2.0 * UNITS_PER_MM / f64::from(PLACES);
    let at = |k: i32| (placed.x.value_at(middle + f64::from(k) * step), text.at.1);
    let found: Vec<Rgb> = (-PLACES..=PLACES)
        .filter_map(|k| heat_map::colour_at(heat, (placed.x.scale, placed.y.scale), at(k)))
        .collect();
    let mean = |part: fn(&Rgb) -> u8| {
        let sum: u32 = found.iter().map(|colour| u32::from(part(colour))).sum();
        u8::try_from(sum / u32::try_from(found.len()).ok()?).ok()
    };
    if found.is_empty() { None } else { Some((mean(|c| c.0)?, mean(|c| c.1)?, mean(|c| c.2)?)) }
}

fn draw_vertical_lines(canvas: &mut Canvas, placed: &PanelLayout) {
    let area = &placed.area;
    for rule in &placed.panel.vertical_lines {
        let Some(x) = visible_position(placed, rule) else { continue };
        let bottom = rule.above.map_or(Some(area.bottom), |y| placed.y.canvas_position_or_low(y));
        draw_marks(canvas, &[bottom.map(|y| (x, y)), Some((x, area.top))], rule.colour, rule.mark, area);
    }
}

/// Canvas coordinate x of a vertical line; `None` for a line outside the axes.
fn visible_position(placed: &PanelLayout, rule: &VerticalLine) -> Option<f64> {
    placed.x.canvas_position(rule.at).filter(|x| *x >= placed.area.left && *x <= placed.area.right)
}

/// Draws all labels above the panel.
fn draw_top_labels(canvas: &mut Canvas, placed: &PanelLayout) {
    let (of_rules, of_captions) =
        placed.label_rows.split_at(placed.panel.vertical_lines.len().min(placed.label_rows.len()));
    let within = |(rule, _): &(&VerticalLine, &Option<usize>)| visible_position(placed, rule).is_some();
    for (rule, row) in placed.panel.vertical_lines.iter().zip(of_rules).filter(within) {
        draw_top_label(canvas, placed, (&rule.label, rule.at), *row, false);
    }
    for (caption, row) in placed.panel.top_labels.iter().zip(of_captions) {
        draw_top_label(canvas, placed, (&caption.label, caption.at), *row, true);
    }
}

/// Draws a label above the panel, if a row was found for it.
fn draw_top_label(
    canvas: &mut Canvas,
    placed: &PanelLayout,
    (text, at): (&str, f64),
    row: Option<usize>,
    bold: bool,
) {
    let Some(row) = row else { return };
    let (left, right) = label_span(text, at, &placed.x);
    let look = Lettering { bold, ..Lettering::plain(SMALL_MM, TextAnchor::Bottom) };
    let at = ((left + right) / 2.0, label_row_y(placed, row));
    canvas.draw_text(&shorten_to_panel(text, &placed.x), at, look);
}

/// Canvas coordinate y of the bottom of a row of labels above the panel.
fn label_row_y(placed: &PanelLayout, row: usize) -> f64 {
    placed.area.top - (0.6 + row as f64 * (SMALL_MM + 0.6)) * UNITS_PER_MM
}

/// Draws the lines of the panel's title, the last line next to the panel.
fn draw_title(canvas: &mut Canvas, placed: &PanelLayout) {
    let look = Lettering { bold: true, ..Lettering::plain(SMALL_MM, TextAnchor::Left) };
    let beside = if placed.panel.bare && placed.letter.is_some() { LETTER_WIDTH } else { 0.0 };
    let beside_letter = CanvasAxis { from: placed.x.from + beside, ..placed.x };
    for (row, line) in placed.panel.title.lines().rev().enumerate() {
        let y = label_row_y(placed, row) - SMALL_MM / 2.0 * UNITS_PER_MM;
        canvas.draw_text(&shorten_to_panel(line, &beside_letter), (placed.area.left + beside, y), look);
    }
}

/// Draws grid, frame, ticks and labels; a heat map has a colour bar instead of the grid.
fn draw_axes(canvas: &mut Canvas, placed: &PanelLayout, live: bool) {
    let (area, panel) = (&placed.area, placed.panel);
    let grid = panel.heat_map.is_none();
    canvas.draw_group(live.then_some(TICKS_CLASS), |canvas| {
        for tick in placed.x_ticks() {
            draw_x_tick(canvas, placed, &tick, grid && panel.x.categories.is_empty());
        }
    });
    canvas.draw_group(live.then_some(Y_TICKS_CLASS), |canvas| {
        for tick in placed.y_ticks() {
            draw_y_tick(canvas, placed, &tick, grid && panel.y.categories.is_empty());
        }
    });
    canvas.draw_line(&area.outline(), FRAME, 3);
    draw_y_label(canvas, placed);
    if placed.has_x_labels && !panel.x.label.is_empty() {
        let names_mm = placed.x_names_mm().map_or(LINE_MM, |names| names + 1.0);
        let y = area.bottom + (TICK_MM + 0.6 + names_mm) * UNITS_PER_MM;
        let at = ((area.left + area.right) / 2.0, y);
        canvas.draw_text(&panel.x.label, at, Lettering::plain(TEXT_MM, TextAnchor::Top));
    }
    if let Some(heat) = panel.heat_map.as_ref().filter(|heat| !heat.without_bar) {
        heat_map::draw_colour_bar(canvas, heat, area);
    }
}

/// Draws the label of a y axis; its first line is farthest from the axis.
fn draw_y_label(canvas: &mut Canvas, placed: &PanelLayout) {
    let (area, lines) = (&placed.area, y_label_lines(placed.panel));
    let widest = widest_label_mm(&placed.y_ticks());
    let upwards = Lettering { upwards: true, ..Lettering::plain(TEXT_MM, TextAnchor::Centre) };
    for (row, line) in lines.iter().rev().enumerate() {
        let x = area.left - (TICK_MM + 1.0 + widest + (row as f64 + 0.5) * LINE_MM) * UNITS_PER_MM;
        canvas.draw_text(line.trim(), (x, (area.top + area.bottom) / 2.0), upwards);
    }
}

fn draw_x_tick(canvas: &mut Canvas, placed: &PanelLayout, tick: &Tick, grid: bool) {
    let area = &placed.area;
    let Some(x) = placed.x.canvas_position(tick.value) else { return };
    if grid && tick.label.is_some() {
        canvas.draw_line(&[(x, area.top), (x, area.bottom)], GRID, 2);
    }
    canvas.draw_line(&[(x, area.bottom), (x, area.bottom + tick.length())], FRAME, 3);
    if let Some(label) = tick.label.as_ref().filter(|_| placed.has_x_labels) {
        let y = area.bottom + (TICK_MM + 0.6) * UNITS_PER_MM;
        match placed.x_names_mm() {
            Some(_) => canvas.draw_text(
                label,
                (x, y + text_width(label, TEXT_MM) / 2.0 * UNITS_PER_MM),
                Lettering { upwards: true, ..Lettering::plain(TEXT_MM, TextAnchor::Centre) },
            ),
            None => canvas.draw_text(label, (x, y), Lettering::plain(TEXT_MM, TextAnchor::Top)),
        }
    }
}

fn draw_y_tick(canvas: &mut Canvas, placed: &PanelLayout, tick: &Tick, grid: bool) {
    let area = &placed.area;
    let Some(y) = placed.y.canvas_position(tick.value) else { return };
    if grid && tick.label.is_some() {
        canvas.draw_line(&[(area.left, y), (area.right, y)], GRID, 2);
    }
    canvas.draw_line(&[(area.left - tick.length(), y), (area.left, y)], FRAME, 3);
    let x = area.left - (TICK_MM + 0.6) * UNITS_PER_MM;
    match tick.label.as_deref().map(|label| label.split_once('\n').ok_or(label)) {
        Some(Ok((first, second))) => {
            let half = SMALL_LINE_MM / 2.0 * UNITS_PER_MM;
            canvas.draw_text(first, (x, y - half), Lettering::plain(SMALL_MM, TextAnchor::Right));
            canvas.draw_text(second, (x, y + half), Lettering::plain(SMALL_MM, TextAnchor::Right));
        }
        Some(Err(label)) => canvas.draw_text(label, (x, y), Lettering::plain(TEXT_MM, TextAnchor::Right)),
        None => {}
    }
}

// Panel letters and watermark.

/// Watermark of synthetic data in print.
const WATERMARK: &str = "synthetic";
/// Grey of the watermark, with a contrast of 5.7 to 1 on white.
const WATERMARK_GREY: Rgb = (0x66, 0x66, 0x66);
/// Distance, mm, of a panel letter from the axes below it.
const LETTER_GAP_MM: f64 = 0.6;
/// Distance, mm, of the watermark from the frame.
const WATERMARK_INSET_MM: f64 = 0.8;

/// Width, in canvas units, that the panel letter takes before the title of a panel without axes.
pub(super) const LETTER_WIDTH: f64 = 4.4 * UNITS_PER_MM;

/// Draws the letter of each panel above its upper left corner.
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

/// Draws the watermark in the corner of the axes that has no text and the fewest lines. If every corner has
/// text, it is drawn above the axes.
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
    // place above the axes, for the case that every corner has text
    let over = CanvasArea { top: area.top - inside - height, bottom: area.top - inside, ..corners[0] };
    let full = |corner: &CanvasArea| count_texts_in(placed, corner) > 0;
    let free =
        corners.iter().filter(|corner| !full(corner)).min_by_key(|corner| count_lines_in(placed, corner));
    let free = free.unwrap_or(&over);
    let at = ((free.left + free.right) / 2.0, (free.top + free.bottom) / 2.0);
    let value = (placed.x.value_at(at.0), placed.y.value_at(at.1));
    let scales = (placed.x.scale, placed.y.scale);
    let heat = placed.panel.heat_map.as_ref().filter(|_| area.contains(at));
    let map = heat.and_then(|heat| heat_map::colour_at(heat, scales, value));
    if map.is_none() {
        canvas.fill_rectangle(free, WHITE, 0.8);
    }
    let ink = map.map_or(WATERMARK_GREY, readable_on);
    canvas.draw_coloured_text(WATERMARK, at, Lettering::plain(SMALL_MM, TextAnchor::Centre), ink);
}

/// Number of texts of a panel that overlap an area.
fn count_texts_in(placed: &PanelLayout, area: &CanvasArea) -> usize {
    let reaches = |text: &TextAnnotation| {
        let Some((x, y)) = placed.canvas_point(text.at) else { return false };
        let (wide, high) =
            (text_width(&text.text, SMALL_MM) / 2.0 * UNITS_PER_MM, SMALL_MM / 2.0 * UNITS_PER_MM);
        x + wide > area.left && x - wide < area.right && y + high > area.top && y - high < area.bottom
    };
    placed.panel.annotations.iter().filter(|text| reaches(text)).count()
}

/// Number of line segments and symbols of a panel in an area.
fn count_lines_in(placed: &PanelLayout, area: &CanvasArea) -> usize {
    let of_series = placed.panel.series.iter().map(|series| {
        let points: Vec<Option<CanvasPoint>> =
            series.points.iter().map(|p| p.and_then(|p| placed.canvas_point(p))).collect();
        let inside = points.iter().flatten().filter(|p| area.contains(**p)).count();
        let between = points.windows(2).filter(|pair| {
            let [Some(a), Some(b)] = pair else { return false };
            !series.mark.is_symbol() && area.clip(*a, *b).is_some()
        });
        inside + between.count()
    });
    of_series.sum()
}

// SVG attributes that the script of a web page reads: axes and series of panels over time or frequency.

/// Class of the SVG group that contains everything inside the axes. The script moves the group when the ends
/// of the axes change.
pub(super) const WITHIN_AXES_CLASS: &str = "class=\"within\"";
/// Class of the SVG group that contains the ticks of the x axis.
pub(super) const TICKS_CLASS: &str = "class=\"ticks\"";
/// Class of the SVG group that contains the ticks of the y axis.
pub(super) const Y_TICKS_CLASS: &str = "class=\"y-ticks\"";
/// Class of the SVG group that contains the labels above the axes. The script hides these labels in an
/// enlarged part, because their positions apply only to the whole axis.
pub(super) const OVER_AXES_CLASS: &str = "class=\"over\"";

/// Attributes of the SVG group of a panel over time or frequency: canvas coordinates of the edges of its
/// axes, values at the ends of both axes, the scale of each axis, and the label of the y axis. `None` for
/// other panels.
pub(super) fn panel_attributes(placed: &PanelLayout) -> Option<String> {
    let (panel, area, x, y) = (placed.panel, &placed.area, &placed.x, &placed.y);
    let is_read = !panel.bare && [x.low, x.high, y.low, y.high].iter().all(|end| end.is_finite());
    let scale = if y.scale == AxisScale::Log { "log" } else { "linear" };
    panel.x.cursor_scale().filter(|_| is_read).map(|x_scale| {
        format!(
            "class=\"plot\" data-area=\"{} {} {} {}\" data-x=\"{} {} {x_scale}\" data-y=\"{} {} {scale}\" \
             data-label=\"{}\"{}",
            area.left,
            area.top,
            area.right,
            area.bottom,
            x.low,
            x.high,
            y.low,
            y.high,
            encode_safe(&make_printable(&panel.y.label)),
            if panel.heat_map.is_some() { " data-heat=\"1\"" } else { "" },
        )
    })
}

/// Attributes of the group of a series, with its full data if the drawn points are thinned.
pub(super) fn series_attributes(index: usize, series: &Series, placed: &PanelLayout) -> String {
    let label = encode_safe(&make_printable(&series.label)).into_owned();
    let detail = placed.panel.sampled_series.get(index).and_then(Option::as_ref);
    let detail = detail.map_or_else(String::new, |detail| sample_attributes(detail, placed));
    format!("class=\"series\" data-label=\"{label}\"{detail}")
}

/// Values are rounded to a step that is a power of ten, so that the cursor shows the same digits as a table.
/// The step is the largest with at least this number of steps in the range of the y axis, which is fine
/// enough for an enlarged curve on a screen.
const VALUE_STEPS: f64 = 1e4;

/// SVG attributes with the full data. `data-grid` has the start and the step of the sampling on the x axis,
/// and the number of decimals of the values. `data-values` has each value minus the previous one, in units of
/// the last decimal, and a dash for a missing value.
fn sample_attributes(detail: &SampledSeries, placed: &PanelLayout) -> String {
    let decimals = math::log10(VALUE_STEPS / (placed.y.high - placed.y.low)).ceil();
    let steps_per_one = math::powi(10.0, decimals as i32);
    let mut before = 0_i64;
    let mut values = String::new();
    for value in &detail.values {
        match value {
            Some(value) => {
                let now = (value * steps_per_one).round() as i64;
                let _ = write!(values, "{} ", now - before); // (writing into a string cannot fail)
                before = now;
            }
            None => values.push_str("- "),
        }
    }
    format!(
        " data-grid=\"{} {} {decimals}\" data-values=\"{}\"",
        detail.start,
        detail.step,
        values.trim_end()
    )
}

#[cfg(test)]
mod tests {
    use crate::{ChartAxis, Figure, Medium, Panel, Series, TextAnnotation};

    /// Position of a text in a figure, canvas units.
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
