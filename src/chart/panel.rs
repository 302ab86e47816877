//! Heading, legend, and panels with their axes, on the canvas.

use super::axis::{CanvasAxis, Tick};
use super::canvas::{Canvas, Lettering, TextAnchor};
use super::colours::{FRAME, GRID, Rgb, readable_on};
use super::elements::{Raster, ShadedSpan, TextAnnotation, VerticalLine};
use super::figure::Figure;
use super::layout::{
    FigureLayout, LegendEntry, PanelLayout, SMALL_LINE_MM, label_span, legend_text, shorten_to_panel,
    subtitle_lines, title_lines, widest_label_mm, y_label_lines,
};
use super::letters::LETTER_WIDTH;
use super::path::CanvasArea;
use super::series::{draw_marks, draw_ribbon, draw_series};
use super::sizes::{EDGE_MM, LINE_MM, SHADING_OPACITY, SMALL_MM, TEXT_MM, TICK_MM, TITLE_MM, UNITS_PER_MM};
use super::style::Mark;
use super::text::text_width;
use super::{contours, hatch, heat, heat_bar, live};

pub(super) fn draw_heading(canvas: &mut Canvas, figure: &Figure, layout: &FigureLayout) {
    let plain = Lettering::plain(TEXT_MM, TextAnchor::Left);
    let title = title_lines(figure)
        .into_iter()
        .map(|line| (line, Lettering { size_mm: TITLE_MM, bold: true, ..plain }));
    for (row, (line, look)) in
        title.chain(subtitle_lines(figure).into_iter().map(|line| (line, plain))).enumerate()
    {
        canvas.draw_text(
            &line,
            (EDGE_MM * UNITS_PER_MM, (EDGE_MM + (row as f64 + 0.5) * LINE_MM) * UNITS_PER_MM),
            look,
        );
    }
    for (entry, x, y) in &layout.legend {
        let (x, y) = (x * UNITS_PER_MM, y * UNITS_PER_MM);
        draw_legend_sample(canvas, *entry, x, y);
        canvas.draw_text(&legend_text(entry.label(), figure), (x + 7.0 * UNITS_PER_MM, y), plain);
    }
}

/// What stands before the name of an entry of the legend.
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

/// Width of the line round an outlined interval, canvas units.
const OUTLINE: u32 = 5;

fn draw_outline(canvas: &mut Canvas, area: &CanvasArea, colour: Rgb) {
    canvas.draw_line(&area.outline(), colour, OUTLINE);
}

/// A panel; a `live` one with groups that a page's script can move.
pub(super) fn draw_panel(canvas: &mut Canvas, placed: &PanelLayout, live: bool) {
    let plot = live::panel_attributes(placed).filter(|_| live);
    let is_live = plot.is_some();
    canvas.draw_group(plot.as_deref(), |canvas| {
        canvas
            .draw_group(is_live.then_some(live::WITHIN_AXES_CLASS), |canvas| draw_under_axes(canvas, placed));
        if !placed.panel.bare {
            draw_axes(canvas, placed, is_live);
        }
        canvas.draw_group(is_live.then_some(live::WITHIN_AXES_CLASS), |canvas| {
            draw_over_axes(canvas, placed, is_live)
        });
        canvas.draw_group(is_live.then_some(live::OVER_AXES_CLASS), |canvas| draw_top_labels(canvas, placed));
        draw_title(canvas, placed);
    });
}

/// Where an interval lies on the canvas.
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

/// A picture, as far as it lies within the axes.
fn draw_raster(canvas: &mut Canvas, placed: &PanelLayout, raster: &Raster) {
    let edges =
        |axis: &CanvasAxis, [from, to]: [f64; 2]| axis.canvas_position(from).zip(axis.canvas_position(to));
    let (Some((left, right)), Some((bottom, top))) = (edges(&placed.x, raster.x), edges(&placed.y, raster.y))
    else {
        return;
    };
    canvas.draw_png(&CanvasArea { left, right, top, bottom }, &placed.area, &raster.png);
}

fn draw_over_axes(canvas: &mut Canvas, placed: &PanelLayout, live: bool) {
    let panel = placed.panel;
    for shaded in &panel.ribbons {
        draw_ribbon(canvas, placed, shaded);
    }
    draw_vertical_lines(canvas, placed);
    for (index, drawn) in panel.series.iter().enumerate() {
        let group = live.then(|| live::series_attributes(index, drawn, placed));
        canvas.draw_group(group.as_deref(), |canvas| draw_series(canvas, placed, drawn));
    }
    for band in panel.shaded_spans.iter().filter(|b| b.outlined) {
        if let Some(span) = shaded_span_area(placed, band) {
            draw_outline(canvas, &span, band.colour.rgb());
        }
    }
    panel.annotations.iter().for_each(|text| draw_annotation(canvas, placed, text));
}

/// Text inside the axes; over a heat map dark or light, whichever is read better there.
fn draw_annotation(canvas: &mut Canvas, placed: &PanelLayout, text: &TextAnnotation) {
    let Some(at) = placed
        .x
        .canvas_position(text.at.0)
        .zip(placed.y.canvas_position(text.at.1))
        .filter(|at| placed.area.contains(*at))
    else {
        return;
    };
    let colour = mean_heat_colour(placed, text, at.0).map_or(text.colour.rgb(), readable_on);
    canvas.draw_coloured_text(&text.text, at, Lettering::plain(SMALL_MM, TextAnchor::Centre), colour);
}

/// Mean colour of the heat map under a text whose middle lies there along the x axis; `None` without one.
fn mean_heat_colour(placed: &PanelLayout, text: &TextAnnotation, middle: f64) -> Option<Rgb> {
    /// Places to either side of the middle, and how much of the half width they cover.
    const PLACES: i32 = 3;
    const COVERED: f64 = 0.8;
    let heat = placed.panel.heat_map.as_ref()?;
    let step = COVERED * text_width(&text.text, SMALL_MM) / 2.0 * UNITS_PER_MM / f64::from(PLACES);
    let at = |k: i32| (placed.x.value_at(middle + f64::from(k) * step), text.at.1);
    let found: Vec<Rgb> = (-PLACES..=PLACES)
        .filter_map(|k| heat::colour_at(heat, (placed.x.scale, placed.y.scale), at(k)))
        .collect();
    let mean = |part: fn(&Rgb) -> u8| {
        let sum: u32 = found.iter().map(|colour| u32::from(part(colour))).sum();
        u8::try_from(sum / u32::try_from(found.len()).ok()?).ok()
    };
    if found.is_empty() { None } else { Some((mean(|c| c.0)?, mean(|c| c.1)?, mean(|c| c.2)?)) }
}

/// Vertical lines.
fn draw_vertical_lines(canvas: &mut Canvas, placed: &PanelLayout) {
    let area = &placed.area;
    for rule in &placed.panel.vertical_lines {
        let Some(x) = visible_position(placed, rule) else { continue };
        let bottom = rule.above.map_or(Some(area.bottom), |y| placed.y.canvas_position_or_low(y));
        draw_marks(canvas, &[bottom.map(|y| (x, y)), Some((x, area.top))], rule.colour, rule.mark, area);
    }
}

/// Where a rule stands, if within the axes.
fn visible_position(placed: &PanelLayout, rule: &VerticalLine) -> Option<f64> {
    placed.x.canvas_position(rule.at).filter(|x| *x >= placed.area.left && *x <= placed.area.right)
}

/// Every label that stands over the panel.
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

/// A label over the panel, where it has a row.
fn draw_top_label(
    canvas: &mut Canvas,
    placed: &PanelLayout,
    (text, at): (&str, f64),
    row: Option<usize>,
    bold: bool,
) {
    let Some(row) = row else { return };
    let (left, right) = label_span(text, at, &placed.x);
    canvas.draw_text(
        &shorten_to_panel(text, &placed.x),
        ((left + right) / 2.0, label_row_y(placed, row)),
        Lettering { bold, ..Lettering::plain(SMALL_MM, TextAnchor::Bottom) },
    );
}

/// Height of a row over the panel.
fn label_row_y(placed: &PanelLayout, row: usize) -> f64 {
    placed.area.top - (0.6 + row as f64 * (SMALL_MM + 0.6)) * UNITS_PER_MM
}

/// The lines of the panel's title, the last one lowest.
fn draw_title(canvas: &mut Canvas, placed: &PanelLayout) {
    let look = Lettering { bold: true, ..Lettering::plain(SMALL_MM, TextAnchor::Left) };
    let beside = if placed.panel.bare && placed.letter.is_some() { LETTER_WIDTH } else { 0.0 };
    let beside_letter = CanvasAxis { from: placed.x.from + beside, ..placed.x };
    for (row, line) in placed.panel.title.lines().rev().enumerate() {
        let y = label_row_y(placed, row) - SMALL_MM / 2.0 * UNITS_PER_MM;
        canvas.draw_text(&shorten_to_panel(line, &beside_letter), (placed.area.left + beside, y), look);
    }
}

/// Grid, frame, ticks, labels; no grid over a heat map, which has its colour bar instead.
fn draw_axes(canvas: &mut Canvas, placed: &PanelLayout, live: bool) {
    let (area, panel) = (&placed.area, placed.panel);
    let grid = panel.heat_map.is_none();
    canvas.draw_group(live.then_some(live::TICKS_CLASS), |canvas| {
        for tick in placed.x_ticks() {
            draw_x_tick(canvas, placed, &tick, grid && panel.x.categories.is_empty());
        }
    });
    for tick in placed.y_ticks() {
        draw_y_tick(canvas, placed, &tick, grid && panel.y.categories.is_empty());
    }
    canvas.draw_line(&area.outline(), FRAME, 3);
    draw_y_label(canvas, placed);
    if placed.has_x_labels && !panel.x.label.is_empty() {
        let names_mm = placed.x_names_mm().map_or(LINE_MM, |names| names + 1.0);
        let y = area.bottom + (TICK_MM + 0.6 + names_mm) * UNITS_PER_MM;
        canvas.draw_text(
            &panel.x.label,
            ((area.left + area.right) / 2.0, y),
            Lettering::plain(TEXT_MM, TextAnchor::Top),
        );
    }
    if let Some(heat) = panel.heat_map.as_ref().filter(|heat| !heat.without_bar) {
        heat_bar::draw_colour_bar(canvas, heat, area);
    }
}

/// The label of a y axis, the first line outermost.
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
