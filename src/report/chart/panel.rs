//! Heading, legend, and panels with their axes, on the canvas.

use super::axis::Tick;
use super::canvas::{Anchor, Canvas, Lettering, Rgb};
use super::layout::{Entry, Layout, Placed, label_span, subtitle_lines, title_lines};
use super::path::Area;
use super::series::{marked, ribbon, series};
use super::{BAND_OPACITY, Band, Figure, LINE_MM, Mark};
use super::{EDGE_MM, SMALL_MM, TEXT_MM, TICK_MM, TITLE_MM, UNITS, X_TICKS_MM, Y_TICKS_MM};
use super::{hatch, heat};

const GRID: Rgb = (0xDD, 0xDD, 0xDD);
pub(super) const FRAME: Rgb = (0x33, 0x33, 0x33);

pub(super) fn heading(canvas: &mut Canvas, figure: &Figure, layout: &Layout) {
    let plain = Lettering::plain(TEXT_MM, Anchor::Left);
    let title = title_lines(figure).into_iter().map(|line| (line, Lettering { size_mm: TITLE_MM, bold: true, ..plain }));
    for (row, (line, look)) in title.chain(subtitle_lines(figure).into_iter().map(|line| (line, plain))).enumerate() {
        canvas.text(&line, (EDGE_MM * UNITS, (EDGE_MM + (row as f64 + 0.5) * LINE_MM) * UNITS), look);
    }
    for (entry, x, y) in &layout.legend {
        let (x, y) = (x * UNITS, y * UNITS);
        sample(canvas, *entry, x, y);
        canvas.text(entry.label(), (x + 7.0 * UNITS, y), plain);
    }
}

/// What stands before the name of an entry of the legend.
fn sample(canvas: &mut Canvas, entry: Entry, x: f64, y: f64) {
    let right = x + 6.0 * UNITS;
    let patch = Area { left: x, right, top: y - UNITS, bottom: y + UNITS };
    match entry {
        Entry::Series(_, colour, mark) => {
            let (middle, ends) = ([Some((x + 3.0 * UNITS, y))], [Some((x, y)), Some((right, y))]);
            let sample = Area { left: x, right, top: y, bottom: y };
            if !mark.is_symbol() {
                let line = if let Mark::Joined(_) = mark { Mark::Line } else { mark };
                marked(canvas, &ends, colour, line, &sample);
            }
            if mark.is_symbol() || matches!(mark, Mark::Joined(_)) {
                marked(canvas, &middle, colour, mark, &sample);
            }
        }
        Entry::Area(_, colour, false) => canvas.rectangle(&patch, colour.rgb(), BAND_OPACITY),
        Entry::Area(_, colour, true) => outline(canvas, &patch, colour.rgb()),
        Entry::Hatch(_, pattern) => hatch::patch(canvas, &patch, pattern),
    }
}

/// Width of the line round an outlined interval, canvas units.
const OUTLINE: u32 = 5;

fn outline(canvas: &mut Canvas, area: &Area, colour: Rgb) {
    canvas.line(&area.outline(), colour, OUTLINE);
}

pub(super) fn panel(canvas: &mut Canvas, placed: &Placed) {
    let (panel, area) = (placed.panel, &placed.area);
    let spans = |b: &Band| {
        let (from, to) = (placed.x.place(b.from)?, placed.x.place(b.to)?);
        let (left, right) = (from.min(to).max(area.left), from.max(to).min(area.right));
        (left < right).then_some(Area { left, right, ..*area })
    };
    for band in panel.bands.iter().filter(|b| !b.outlined) {
        if let Some(span) = spans(band) {
            canvas.rectangle(&span, band.colour.rgb(), BAND_OPACITY);
        }
    }
    for hatch in &panel.hatches {
        hatch::cells(canvas, placed, hatch);
    }
    axes(canvas, placed);
    for shaded in &panel.ribbons {
        ribbon(canvas, placed, shaded);
    }
    rules(canvas, placed);
    for drawn in &panel.series {
        series(canvas, placed, drawn);
    }
    for band in panel.bands.iter().filter(|b| b.outlined) {
        if let Some(span) = spans(band) {
            outline(canvas, &span, band.colour.rgb());
        }
    }
}

/// Vertical lines, and every label that stands over the panel.
fn rules(canvas: &mut Canvas, placed: &Placed) {
    let area = &placed.area;
    let (of_rules, of_captions) = placed.rows.split_at(placed.panel.rules.len().min(placed.rows.len()));
    for (rule, row) in placed.panel.rules.iter().zip(of_rules) {
        let Some(x) = placed.x.place(rule.at).filter(|x| *x >= area.left && *x <= area.right) else { continue };
        let bottom = rule.above.map_or(Some(area.bottom), |y| placed.y.place_or_low(y));
        marked(canvas, &[bottom.map(|y| (x, y)), Some((x, area.top))], rule.colour, rule.mark, area);
        label(canvas, placed, (&rule.label, rule.at), *row, false);
    }
    for (caption, row) in placed.panel.captions.iter().zip(of_captions) {
        label(canvas, placed, (&caption.label, caption.at), *row, true);
    }
}

/// A label over the panel, where it has a row.
fn label(canvas: &mut Canvas, placed: &Placed, (text, at): (&str, f64), row: Option<usize>, bold: bool) {
    let Some(row) = row else { return };
    let (left, right) = label_span(text, at, &placed.x);
    let y = placed.area.top - (0.6 + row as f64 * (SMALL_MM + 0.6)) * UNITS;
    canvas.text(text, ((left + right) / 2.0, y), Lettering { bold, ..Lettering::plain(SMALL_MM, Anchor::Bottom) });
}

/// Ticks for which a narrow x axis has room, however close they come.
const LEAST_X_TICKS: f64 = 4.0;

/// Grid, frame, ticks, labels; no grid over a heat map, which has its colour bar instead.
fn axes(canvas: &mut Canvas, placed: &Placed) {
    let (area, panel) = (&placed.area, placed.panel);
    let grid = panel.heat.is_none();
    for tick in placed.x.ticks((X_TICKS_MM * UNITS).min((area.right - area.left) / LEAST_X_TICKS)) {
        x_tick(canvas, placed, &tick, grid);
    }
    for tick in placed.y.ticks(Y_TICKS_MM * UNITS) {
        y_tick(canvas, placed, &tick, grid);
    }
    canvas.line(&area.outline(), FRAME, 3);
    let middle = (area.top + area.bottom) / 2.0;
    let upwards = Lettering { upwards: true, ..Lettering::plain(TEXT_MM, Anchor::Centre) };
    canvas.text(&panel.y.label, ((EDGE_MM + TEXT_MM / 2.0) * UNITS, middle), upwards);
    if placed.last {
        let y = area.bottom + (TICK_MM + 0.6 + LINE_MM) * UNITS;
        canvas.text(&panel.x.label, ((area.left + area.right) / 2.0, y), Lettering::plain(TEXT_MM, Anchor::Top));
    }
    if let Some(heat) = &panel.heat {
        heat::bar(canvas, heat, area);
    }
}

/// Length of a tick, canvas units: minor ones are half as long.
pub(super) fn tick_length(tick: &Tick) -> f64 {
    if tick.label.is_some() { TICK_MM * UNITS } else { TICK_MM / 2.0 * UNITS }
}

fn x_tick(canvas: &mut Canvas, placed: &Placed, tick: &Tick, grid: bool) {
    let area = &placed.area;
    let Some(x) = placed.x.place(tick.value) else { return };
    if grid && tick.label.is_some() {
        canvas.line(&[(x, area.top), (x, area.bottom)], GRID, 2);
    }
    canvas.line(&[(x, area.bottom), (x, area.bottom + tick_length(tick))], FRAME, 3);
    if let Some(label) = tick.label.as_ref().filter(|_| placed.last) {
        canvas.text(label, (x, area.bottom + (TICK_MM + 0.6) * UNITS), Lettering::plain(TEXT_MM, Anchor::Top));
    }
}

fn y_tick(canvas: &mut Canvas, placed: &Placed, tick: &Tick, grid: bool) {
    let area = &placed.area;
    let Some(y) = placed.y.place(tick.value) else { return };
    if grid && tick.label.is_some() {
        canvas.line(&[(area.left, y), (area.right, y)], GRID, 2);
    }
    canvas.line(&[(area.left - tick_length(tick), y), (area.left, y)], FRAME, 3);
    if let Some(label) = &tick.label {
        canvas.text(label, (area.left - (TICK_MM + 0.6) * UNITS, y), Lettering::plain(TEXT_MM, Anchor::Right));
    }
}
