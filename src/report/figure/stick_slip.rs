//! Stick-slip raster: one row a cycle, from the start of a stick to the start of the next, and how cycle and
//! stick change over time.

use crate::compare::Case;
use crate::report::chart::{Axis, Colour, FULL_WIDTH_MM, Figure, Mark, Panel, Series};
use crate::report::figure::naming::Words;
use crate::report::{Drawing, FigureBlock, about, subtitle};
use crate::text::{plural, short};

/// What the figure shows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StickRaster {
    /// Heading.
    pub title: String,
    /// Line under it.
    pub subtitle: String,
    /// When the tip stuck, ascending, s.
    pub stick_s: Vec<[f64; 2]>,
}

/// From the start of a stick to that of the next.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cycle {
    start_s: f64,
    stick_s: f64,
    /// `None` after the last stick.
    length_s: Option<f64>,
}

/// Heights of the panels, mm.
const RASTER_MM: f64 = 58.0;
const OVER_TIME_MM: f64 = 26.0;
/// Rows that a panel has room for; of more cycles every second, third, ... is drawn.
const MOST_ROWS: usize = 400;
/// The axis of times ends at this many of the cycle that nine of ten are shorter than.
const SHOWN: f64 = 1.15;
const MOST: f64 = 0.9;
/// Of fewer cycles the range is given: there is no tenth of them.
const FEW: usize = 10;

/// The figure; `None` with fewer than two sticks, which make no cycle.
#[must_use]
pub fn figure(shown: &StickRaster) -> Option<Figure> {
    let cycles = cycles(&shown.stick_s);
    let longest_ms = 1e3 * shown_s(&cycles)?;
    Some(Figure {
        title: claim(&cycles)?,
        subtitle: about(&shown.title, &shown.subtitle),
        synthetic: false,
        description: "Every cycle of stick and slip as a row from the start of its stick, with length and \
        share of stick over time."
            .to_owned(),
        width_mm: FULL_WIDTH_MM,
        panels: vec![raster(&cycles, longest_ms), lengths(&cycles), shares(&cycles)],
        ..Figure::default()
    })
}

fn cycles(stick_s: &[[f64; 2]]) -> Vec<Cycle> {
    let next = |i: usize| stick_s.get(i + 1).map(|[start, _]| *start);
    let cycle = |(i, [start, end]): (usize, &[f64; 2])| Cycle {
        start_s: *start,
        stick_s: end - start,
        length_s: next(i).map(|next| next - start),
    };
    stick_s.iter().enumerate().map(cycle).collect()
}

/// Length up to which cycles are shown in full, s.
fn shown_s(cycles: &[Cycle]) -> Option<f64> {
    let length = quantile(cycles.iter().filter_map(|c| c.length_s), MOST)?;
    (length > 0.0).then_some(SHOWN * length)
}

/// The value that this share of the others is not above.
fn quantile(values: impl Iterator<Item = f64>, share: f64) -> Option<f64> {
    let mut sorted: Vec<f64> = values.filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(((sorted.len().checked_sub(1)? as f64) * share).round() as usize).copied()
}

/// Every how manieth cycle has a row.
fn step(cycles: &[Cycle]) -> usize {
    cycles.len().div_ceil(MOST_ROWS).max(1)
}

fn raster(cycles: &[Cycle], longest_ms: f64) -> Panel {
    let rows = || cycles.iter().enumerate().step_by(step(cycles)).map(|(i, cycle)| ((i + 1) as f64, cycle));
    let sticks = rows().flat_map(|(row, c)| [Some((0.0, row)), Some((1e3 * c.stick_s, row)), None]).collect();
    let slips = rows().flat_map(|(row, c)| [c.length_s.map(|length| (1e3 * length, row)), None]).collect();
    let series = |label: &str, colour, mark, points| Series {
        label: label.to_owned(),
        colour,
        mark,
        points,
        bars: Vec::new(),
    };
    Panel {
        x: Axis::linear("time since the tip stuck, ms").between(0.0, longest_ms),
        y: Axis::linear("cycle").between(0.0, cycles.len() as f64 + 1.0),
        height_mm: RASTER_MM,
        series: vec![
            series("stick", Colour::Blue, Mark::Thin, sticks),
            series("start of the next stick", Colour::Vermilion, Mark::Dots, slips),
        ],
        ..Panel::default()
    }
}

/// The axis of the panels below: from the first stick to the last.
fn time(cycles: &[Cycle]) -> Axis {
    let ends = cycles.first().zip(cycles.last());
    let axis = Axis::linear("time at which the tip stuck, s");
    ends.map_or(axis.clone(), |(first, last)| {
        axis.between(first.start_s, last.start_s + last.stick_s.max(1e-9))
    })
}

fn over_time(cycles: &[Cycle], y: Axis, colour: Colour, value: impl Fn(&Cycle) -> Option<f64>) -> Panel {
    let points = cycles.iter().map(|c| value(c).map(|y| (c.start_s, y))).collect();
    let series = vec![Series { colour, mark: Mark::Dots, points, ..Series::default() }];
    Panel { x: time(cycles), y, height_mm: OVER_TIME_MM, series, ..Panel::default() }
}

/// By decades: a cycle in which the tip rests while the head turns is many times as long as the others.
fn lengths(cycles: &[Cycle]) -> Panel {
    over_time(cycles, Axis::log("cycle, ms"), Colour::Vermilion, |c| c.length_s.map(|length| 1e3 * length))
}

fn shares(cycles: &[Cycle]) -> Panel {
    over_time(cycles, Axis::linear("share of stick").between(0.0, 1.0), Colour::Blue, share)
}

fn share(cycle: &Cycle) -> Option<f64> {
    cycle.length_s.filter(|length| *length > 0.0).map(|length| cycle.stick_s / length)
}

/// The claim with its numbers.
fn claim(cycles: &[Cycle]) -> Option<String> {
    let length_s = quantile(cycles.iter().filter_map(|c| c.length_s), 0.5)?;
    let share = quantile(cycles.iter().filter_map(share), 0.5)?;
    let count = cycles.iter().filter(|c| c.length_s.is_some()).count();
    Some(format!(
        "{count} {} of {} ms at the median, of which the tip sticks {} %",
        plural("cycle", count),
        short(1e3 * length_s),
        short(100.0 * share)
    ))
}

/// The figure of a condition, on the clock of its recording as every other figure over time.
pub(in crate::report) fn block(case: &Case) -> Option<FigureBlock> {
    let (title, shift_s) = (case.title(), case.alignment.shift_s);
    let stick_s = case.model.motion.stick_s.iter().map(|[from, to]| [from + shift_s, to + shift_s]).collect();
    let subtitle = subtitle(case.synthetic(), "drawn from the fitted model");
    let shown = StickRaster { title, subtitle, stick_s };
    let words = Words { caption: caption(&shown), details: details(&shown) };
    Some(case.model_block("stick-slip", words, Drawing::Chart(figure(&shown)?)))
}

/// One sentence on the figure; empty where there is none.
#[must_use]
pub fn caption(shown: &StickRaster) -> String {
    let cycles = cycles(&shown.stick_s);
    let lengths = || cycles.iter().filter_map(|c| c.length_s);
    let median = quantile(lengths(), 0.5).zip(quantile(cycles.iter().filter_map(share), 0.5));
    let Some((length_s, share)) = median else { return String::new() };
    let count = lengths().count();
    format!(
        "Cycles of stick and slip of the fitted model, one row each: {count} {} with a median length of {} \
         ms, of which the tip sticks for {} %.",
        plural("cycle", count),
        short(1e3 * length_s),
        short(100.0 * share)
    )
}

/// The rest of what is said of the figure.
#[must_use]
pub fn details(shown: &StickRaster) -> String {
    let cycles = cycles(&shown.stick_s);
    let Some(longest_s) = shown_s(&cycles) else { return String::new() };
    let lengths = || cycles.iter().filter_map(|c| c.length_s);
    let middle =
        |values: &dyn Fn() -> Vec<f64>, share: f64| quantile(values().into_iter(), share).unwrap_or(f64::NAN);
    let (of_lengths, of_shares) =
        (|| lengths().collect::<Vec<f64>>(), || cycles.iter().filter_map(share).collect::<Vec<f64>>());
    let beyond = lengths().filter(|length| *length > longest_s).count();
    let longest = cycles.iter().map(|c| c.stick_s).fold(0.0, f64::max);
    let mut sentences =
        vec![
        "Cycles of stick and slip of the fitted model, one row each in their order: bar, the tip sticks; \
         dot, it sticks again. \
         Below: length of the cycle, and share of it in which the tip sticks, over time."
            .to_owned(),
        match lengths().count() {
            1 => format!("1 cycle of {} ms, {} % of it \
            stick.", short(1e3 * middle(&of_lengths, 0.5)), short(100.0 * middle(&of_shares, 0.5))),
            few @ ..FEW => format!(
                "{few} cycles of {} to {} ms, {} to {} % of them stick.",
                short(1e3 * middle(&of_lengths, 0.0)),
                short(1e3 * middle(&of_lengths, 1.0)),
                short(100.0 * middle(&of_shares, 0.0)),
                short(100.0 * middle(&of_shares, 1.0))
            ),
            many => format!(
                "{many} cycles; median length {} ms (a tenth are below {}, a tenth above {}), median share \
                 of stick {} %.",
                short(1e3 * middle(&of_lengths, 0.5)),
                short(1e3 * middle(&of_lengths, 1.0 - MOST)),
                short(1e3 * middle(&of_lengths, MOST)),
                short(100.0 * middle(&of_shares, 0.5))
            ),
        },
    ];
    if beyond > 0 {
        sentences.push(format!(
            "Beyond the axis of the rows: {beyond}; the longest stick lasts {} ms.",
            short(1e3 * longest)
        ));
    }
    if step(&cycles) > 1 {
        sentences.push(format!("Of the rows, one in {} is drawn.", step(&cycles)));
    }
    sentences.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::chart::Medium;

    /// Cycles of 2 ms with 0.5 ms of stick, the first of 100 ms.
    fn shown(count: usize) -> StickRaster {
        let start = |i: usize| if i == 0 { 0.0 } else { 0.1 + 2e-3 * (i - 1) as f64 };
        let stick_s = (0..count).map(|i| [start(i), start(i) + if i == 0 { 0.09 } else { 5e-4 }]).collect();
        StickRaster { title: "t".to_owned(), subtitle: String::new(), stick_s }
    }

    #[test]
    fn without_a_second_stick_there_is_no_cycle() {
        assert!(figure(&shown(0)).is_none() && figure(&shown(1)).is_none());
        assert!(figure(&shown(2)).is_some());
    }

    #[test]
    fn a_row_runs_from_stick_to_stick_and_the_long_hold_leaves_the_axes() {
        let panel = &figure(&shown(50)).unwrap().panels[0];
        let (_, end) = panel.x.range.unwrap();
        assert!((end - SHOWN * 2.0).abs() < 1e-9, "{end}");
        let near = |found: Option<(f64, f64)>, expected: (f64, f64)| {
            found.is_some_and(|f| (f.0 - expected.0).abs() < 1e-9 && f.1 == expected.1)
        };
        assert!(near(panel.series[0].points[1], (90.0, 1.0)) && near(panel.series[0].points[4], (0.5, 2.0)));
        assert!(near(panel.series[1].points[2], (2.0, 2.0)));
        assert_eq!(panel.series[1].points.iter().flatten().count(), 49);
    }

    #[test]
    fn the_caption_counts_cycles_and_what_is_beyond() {
        assert_eq!(
            figure(&shown(50)).unwrap().title,
            "49 cycles of 2 ms at the median, of which the tip sticks 25 %"
        );
        let text = details(&shown(50));
        assert!(
            text.contains("49 cycles; median length 2 ms") && text.contains("median share of stick 25 %"),
            "{text}"
        );
        assert!(text.contains("Beyond the axis of the rows: 1; the longest stick lasts 90 ms"), "{text}");
        assert!(
            details(&shown(3)).contains("2 cycles of 2 to 100 ms, 25 to 90 % of them stick."),
            "{}",
            details(&shown(3))
        );
        assert!(
            details(&shown(2)).contains("1 cycle of 100 ms, 90 % of it stick."),
            "{}",
            details(&shown(2))
        );
        assert!(!text.contains("one in") && details(&shown(3000)).contains("one in 8"));
    }

    #[test]
    fn thousands_of_cycles_stay_small() {
        let figure = figure(&shown(5000)).unwrap();
        for medium in [Medium::Screen, Medium::Column, Medium::Page] {
            let bytes = figure.svg(medium).len();
            assert!(bytes < 200_000, "{bytes}");
        }
    }
}
