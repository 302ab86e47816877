//! Heading, legend, and panels with their axes, on the canvas.

use super::axis::{Mapped, Tick};
use super::canvas::{Anchor, Canvas, Lettering};
use super::colours::{FRAME, GRID, Rgb, readable_on};
use super::elements::{Band, Raster, Rule, Text};
use super::figure::Figure;
use super::layout::{
    Entry, Layout, Placed, SMALL_LINE_MM, label_span, legend_text, over_panel, subtitle_lines, title_lines,
    widest_mm, y_label_lines,
};
use super::letters::BEFORE_TITLE;
use super::path::Area;
use super::series::{marked, ribbon, series};
use super::sizes::{BAND_OPACITY, EDGE_MM, LINE_MM, SMALL_MM, TEXT_MM, TICK_MM, TITLE_MM, UNITS};
use super::style::Mark;
use super::text::text_width;
use super::{contours, hatch, heat, heat_bar, live};

pub(super) fn heading(canvas: &mut Canvas, figure: &Figure, layout: &Layout) {
    let plain = Lettering::plain(TEXT_MM, Anchor::Left);
    let title = title_lines(figure)
        .into_iter()
        .map(|line| (line, Lettering { size_mm: TITLE_MM, bold: true, ..plain }));
    for (row, (line, look)) in
        title.chain(subtitle_lines(figure).into_iter().map(|line| (line, plain))).enumerate()
    {
        canvas.text(&line, (EDGE_MM * UNITS, (EDGE_MM + (row as f64 + 0.5) * LINE_MM) * UNITS), look);
    }
    for (entry, x, y) in &layout.legend {
        let (x, y) = (x * UNITS, y * UNITS);
        sample(canvas, *entry, x, y);
        canvas.text(&legend_text(entry.label(), figure), (x + 7.0 * UNITS, y), plain);
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

/// A panel; a `live` one with groups that a page's script can move.
pub(super) fn panel(canvas: &mut Canvas, placed: &Placed, live: bool) {
    let plot = live::plot(placed).filter(|_| live);
    let is_live = plot.is_some();
    canvas.group(plot.as_deref(), |canvas| {
        canvas.group(is_live.then_some(live::WITHIN), |canvas| under_axes(canvas, placed));
        if !placed.panel.bare {
            axes(canvas, placed, is_live);
        }
        canvas.group(is_live.then_some(live::WITHIN), |canvas| over_axes(canvas, placed, is_live));
        canvas.group(is_live.then_some(live::OVER), |canvas| rules(canvas, placed));
        title(canvas, placed);
    });
}

/// Where an interval lies on the canvas.
fn spans(placed: &Placed, band: &Band) -> Option<Area> {
    let (area, from, to) = (&placed.area, placed.x.place(band.from)?, placed.x.place(band.to)?);
    let (left, right) = (from.min(to).max(area.left), from.max(to).min(area.right));
    (left < right).then_some(Area { left, right, ..*area })
}

fn under_axes(canvas: &mut Canvas, placed: &Placed) {
    if let Some(raster) = &placed.panel.picture {
        picture(canvas, placed, raster);
    }
    for band in placed.panel.bands.iter().filter(|b| !b.outlined) {
        if let Some(span) = spans(placed, band) {
            canvas.rectangle(&span, band.colour.rgb(), BAND_OPACITY);
        }
    }
    for hatch in &placed.panel.hatches {
        hatch::cells(canvas, placed, hatch);
    }
    contours::contours(canvas, placed);
}

/// A picture, as far as it lies within the axes.
fn picture(canvas: &mut Canvas, placed: &Placed, raster: &Raster) {
    let edges = |axis: &Mapped, [from, to]: [f64; 2]| axis.place(from).zip(axis.place(to));
    let (Some((left, right)), Some((bottom, top))) = (edges(&placed.x, raster.x), edges(&placed.y, raster.y))
    else {
        return;
    };
    canvas.picture(&Area { left, right, top, bottom }, &placed.area, &raster.png);
}

fn over_axes(canvas: &mut Canvas, placed: &Placed, live: bool) {
    let panel = placed.panel;
    for shaded in &panel.ribbons {
        ribbon(canvas, placed, shaded);
    }
    rule_lines(canvas, placed);
    for (index, drawn) in panel.series.iter().enumerate() {
        let group = live.then(|| live::series(index, drawn, placed));
        canvas.group(group.as_deref(), |canvas| series(canvas, placed, drawn));
    }
    for band in panel.bands.iter().filter(|b| b.outlined) {
        if let Some(span) = spans(placed, band) {
            outline(canvas, &span, band.colour.rgb());
        }
    }
    panel.texts.iter().for_each(|text| inside(canvas, placed, text));
}

/// Text inside the axes; over a heat map dark or light, whichever is read better there.
fn inside(canvas: &mut Canvas, placed: &Placed, text: &Text) {
    let Some(at) =
        placed.x.place(text.at.0).zip(placed.y.place(text.at.1)).filter(|at| placed.area.holds(*at))
    else {
        return;
    };
    let colour = ground(placed, text, at.0).map_or(text.colour.rgb(), readable_on);
    canvas.coloured(&text.text, at, Lettering::plain(SMALL_MM, Anchor::Centre), colour);
}

/// Mean colour of the heat map under a text whose middle lies there along the x axis; `None` without one.
fn ground(placed: &Placed, text: &Text, middle: f64) -> Option<Rgb> {
    /// Places to either side of the middle, and how much of the half width they cover.
    const PLACES: i32 = 3;
    const COVERED: f64 = 0.8;
    let heat = placed.panel.heat.as_ref()?;
    let step = COVERED * text_width(&text.text, SMALL_MM) / 2.0 * UNITS / f64::from(PLACES);
    let at = |k: i32| (placed.x.value(middle + f64::from(k) * step), text.at.1);
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
fn rule_lines(canvas: &mut Canvas, placed: &Placed) {
    let area = &placed.area;
    for rule in &placed.panel.rules {
        let Some(x) = shown(placed, rule) else { continue };
        let bottom = rule.above.map_or(Some(area.bottom), |y| placed.y.place_or_low(y));
        marked(canvas, &[bottom.map(|y| (x, y)), Some((x, area.top))], rule.colour, rule.mark, area);
    }
}

/// Where a rule stands, if within the axes.
fn shown(placed: &Placed, rule: &Rule) -> Option<f64> {
    placed.x.place(rule.at).filter(|x| *x >= placed.area.left && *x <= placed.area.right)
}

/// Every label that stands over the panel.
fn rules(canvas: &mut Canvas, placed: &Placed) {
    let (of_rules, of_captions) = placed.rows.split_at(placed.panel.rules.len().min(placed.rows.len()));
    let within = |(rule, _): &(&Rule, &Option<usize>)| shown(placed, rule).is_some();
    for (rule, row) in placed.panel.rules.iter().zip(of_rules).filter(within) {
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
    canvas.text(
        &over_panel(text, &placed.x),
        ((left + right) / 2.0, over(placed, row)),
        Lettering { bold, ..Lettering::plain(SMALL_MM, Anchor::Bottom) },
    );
}

/// Height of a row over the panel.
fn over(placed: &Placed, row: usize) -> f64 {
    placed.area.top - (0.6 + row as f64 * (SMALL_MM + 0.6)) * UNITS
}

/// The lines of the panel's title, the last one lowest.
fn title(canvas: &mut Canvas, placed: &Placed) {
    let look = Lettering { bold: true, ..Lettering::plain(SMALL_MM, Anchor::Left) };
    let beside = if placed.panel.bare && placed.letter.is_some() { BEFORE_TITLE } else { 0.0 };
    let beside_letter = Mapped { from: placed.x.from + beside, ..placed.x };
    for (row, line) in placed.panel.title.lines().rev().enumerate() {
        let y = over(placed, row) - SMALL_MM / 2.0 * UNITS;
        canvas.text(&over_panel(line, &beside_letter), (placed.area.left + beside, y), look);
    }
}

/// Grid, frame, ticks, labels; no grid over a heat map, which has its colour bar instead.
fn axes(canvas: &mut Canvas, placed: &Placed, live: bool) {
    let (area, panel) = (&placed.area, placed.panel);
    let grid = panel.heat.is_none();
    canvas.group(live.then_some(live::TICKS), |canvas| {
        for tick in placed.x_ticks() {
            x_tick(canvas, placed, &tick, grid && panel.x.names.is_empty());
        }
    });
    for tick in placed.y_ticks() {
        y_tick(canvas, placed, &tick, grid && panel.y.names.is_empty());
    }
    canvas.line(&area.outline(), FRAME, 3);
    y_label(canvas, placed);
    if placed.last && !panel.x.label.is_empty() {
        let names_mm = placed.x_names_mm().map_or(LINE_MM, |names| names + 1.0);
        let y = area.bottom + (TICK_MM + 0.6 + names_mm) * UNITS;
        canvas.text(
            &panel.x.label,
            ((area.left + area.right) / 2.0, y),
            Lettering::plain(TEXT_MM, Anchor::Top),
        );
    }
    if let Some(heat) = panel.heat.as_ref().filter(|heat| !heat.without_bar) {
        heat_bar::bar(canvas, heat, area);
    }
}

/// The label of a y axis, the first line outermost.
fn y_label(canvas: &mut Canvas, placed: &Placed) {
    let (area, lines) = (&placed.area, y_label_lines(placed.panel));
    let widest = widest_mm(&placed.y_ticks());
    let upwards = Lettering { upwards: true, ..Lettering::plain(TEXT_MM, Anchor::Centre) };
    for (row, line) in lines.iter().rev().enumerate() {
        let x = area.left - (TICK_MM + 1.0 + widest + (row as f64 + 0.5) * LINE_MM) * UNITS;
        canvas.text(line.trim(), (x, (area.top + area.bottom) / 2.0), upwards);
    }
}

fn x_tick(canvas: &mut Canvas, placed: &Placed, tick: &Tick, grid: bool) {
    let area = &placed.area;
    let Some(x) = placed.x.place(tick.value) else { return };
    if grid && tick.label.is_some() {
        canvas.line(&[(x, area.top), (x, area.bottom)], GRID, 2);
    }
    canvas.line(&[(x, area.bottom), (x, area.bottom + tick.length())], FRAME, 3);
    if let Some(label) = tick.label.as_ref().filter(|_| placed.last) {
        let y = area.bottom + (TICK_MM + 0.6) * UNITS;
        match placed.x_names_mm() {
            Some(_) => canvas.text(
                label,
                (x, y + text_width(label, TEXT_MM) / 2.0 * UNITS),
                Lettering { upwards: true, ..Lettering::plain(TEXT_MM, Anchor::Centre) },
            ),
            None => canvas.text(label, (x, y), Lettering::plain(TEXT_MM, Anchor::Top)),
        }
    }
}

fn y_tick(canvas: &mut Canvas, placed: &Placed, tick: &Tick, grid: bool) {
    let area = &placed.area;
    let Some(y) = placed.y.place(tick.value) else { return };
    if grid && tick.label.is_some() {
        canvas.line(&[(area.left, y), (area.right, y)], GRID, 2);
    }
    canvas.line(&[(area.left - tick.length(), y), (area.left, y)], FRAME, 3);
    let x = area.left - (TICK_MM + 0.6) * UNITS;
    match tick.label.as_deref().map(|label| label.split_once('\n').ok_or(label)) {
        Some(Ok((first, second))) => {
            let half = SMALL_LINE_MM / 2.0 * UNITS;
            canvas.text(first, (x, y - half), Lettering::plain(SMALL_MM, Anchor::Right));
            canvas.text(second, (x, y + half), Lettering::plain(SMALL_MM, Anchor::Right));
        }
        Some(Err(label)) => canvas.text(label, (x, y), Lettering::plain(TEXT_MM, Anchor::Right)),
        None => {}
    }
}
