//! Estimates with their 95 % intervals: one panel for each parameter that at least two fits share, with one
//! row for each fit.

use super::{ComparedFit, IntervalRelation, SharedParameter, shorten_name};
use crate::compare::ParameterLine;
use crate::figures::{Drawing, FigureBlock};
use crate::model::parameters::describe_parameters;
use crate::text::capitalise;
use plain_charts::{
    ChartAxis, Colour, ErrorBar, FULL_WIDTH_MM, Figure, MAX_HEIGHT_MM, Mark, MarkerShape, Medium, Panel,
    Series,
};
use portable_math as math;

/// Heights of a row that are tried, mm. The first one with which the figure fits a journal page is taken, or
/// the last one if none does.
const ROW_MM: [f64; 4] = [5.5, 4.5, 3.7, 3.0];
/// Least height of a panel, in rows.
const LEAST_ROWS: usize = 3;
/// Margin of the axis beyond the lowest and the highest finite end of the intervals, as a fraction of the
/// distance between these two ends.
const ROOM: f64 = 0.12;
/// Margin of the axis if the intervals have only one finite end, as a fraction of the value of that end.
const ALONE: f64 = 0.1;
/// The axis is logarithmic if the ratio of the largest to the smallest finite end of the intervals exceeds
/// this.
const WIDE: f64 = 30.0;

/// The figure; `None` if no parameter is shared.
pub(super) fn interval_figure(
    entries: &[ComparedFit],
    parameters: &[SharedParameter],
) -> Option<FigureBlock> {
    let shared: Vec<&SharedParameter> = parameters.iter().filter(|p| !p.pairs.is_empty()).collect();
    let mut drawn = ROW_MM.iter().map(|row_mm| draw_figure(entries, &shared, *row_mm));
    let fits = |figure: &Figure| figure.height_mm(Medium::Column) <= MAX_HEIGHT_MM;
    let figure = drawn.clone().find(fits).or(drawn.next_back())?;
    let what = "Estimates and 95 % intervals of the parameters that at least two of the fits share";
    (!shared.is_empty()).then(|| FigureBlock {
        condition: None,
        file: "parameters.svg".to_owned(),
        caption: format!("{what}: {}.", claim_sentence(&shared)),
        details: figure_details(&shared),
        drawing: Drawing::Chart(figure),
    })
}

fn draw_figure(entries: &[ComparedFit], parameters: &[&SharedParameter], row_mm: f64) -> Figure {
    let description =
        "A panel a parameter, a row a fit: estimate and 95 % interval; an open end reaches the frame.";
    Figure {
        title: capitalise(&claim_sentence(parameters)),
        subtitle: describe_sources(entries),
        watermarked: entries.iter().any(|e| e.verdict.synthetic),
        description: description.to_owned(),
        width_mm: FULL_WIDTH_MM,
        columns: 2,
        panels: parameters.iter().map(|p| draw_panel(entries, p, row_mm)).collect(),
    }
}

/// Clause on the fits whose data are not from a film, for the subtitle.
fn describe_sources(entries: &[ComparedFit]) -> String {
    let names = |is: fn(&&ComparedFit) -> bool| {
        entries.iter().filter(is).map(|e| shorten_name(&e.name)).collect::<Vec<_>>().join(", ")
    };
    let named = |(what, names): (&str, String)| (!names.is_empty()).then(|| format!("{what}: {names}"));
    let kinds = [
        ("synthetic recording", names(|e| e.verdict.synthetic)),
        ("published numbers alone", names(|e| e.verdict.published_only)),
    ];
    kinds.into_iter().filter_map(named).collect::<Vec<_>>().join("; ")
}

/// Number of pairs of intervals that can be compared, and number of those that do not overlap.
fn count_pairs(parameters: &[&SharedParameter]) -> (usize, usize) {
    let pairs = || parameters.iter().flat_map(|p| p.pairs.iter().map(|pair| pair.relation));
    let comparable = pairs().filter(|r| *r != IntervalRelation::NotComparable).count();
    (comparable, pairs().filter(|r| *r == IntervalRelation::Disjoint).count())
}

/// The main result with its number.
fn claim_sentence(parameters: &[&SharedParameter]) -> String {
    match count_pairs(parameters) {
        (0, _) => "no two of the 95 % intervals can be compared".to_owned(),
        (all, apart) => format!("{} of {all} comparable pairs of 95 % intervals overlap", all - apart),
    }
}

fn figure_details(parameters: &[&SharedParameter]) -> String {
    let lines = || parameters.iter().flat_map(|p| p.lines.iter().flatten());
    let (known, all) = (lines().filter(|p| p.is_identified()).count(), lines().count());
    let truth =
        if lines().any(|p| p.truth.is_some()) { " Crosses: the values behind synthetic data." } else { "" };
    format!(
        "Filled: identified ({known} of {all}); hollow: not identified, or only a limit is known. A bar that \
         reaches the frame is open there. For a parameter that is not identified the bar shows where equally \
         good fits lie.{truth}"
    )
}

/// Styles of estimates: label, colour, mark, and whether the parameter is identified.
const LOOKS: [(&str, Colour, Mark, bool); 2] = [
    ("identified", Colour::Blue, Mark::Joined(MarkerShape::Disc), true),
    ("not identified, or a limit", Colour::Vermilion, Mark::Hollow(MarkerShape::Diamond), false),
];

fn draw_panel(entries: &[ComparedFit], parameter: &SharedParameter, row_mm: f64) -> Panel {
    // the first fit is at the top, and an axis counts from the bottom
    let lines = entries.iter().zip(&parameter.lines).rev();
    let having: Vec<(&ComparedFit, &ParameterLine)> =
        lines.filter_map(|(entry, line)| Some((entry, line.as_ref()?))).collect();
    let (log, low, high) = axis_range(&having);
    let label =
        if parameter.symbol.is_empty() { shorten_name(&parameter.name) } else { parameter.symbol.clone() };
    let label = if parameter.unit.is_empty() { label } else { format!("{label}, {}", parameter.unit) };
    let x = if log { ChartAxis::log(label) } else { ChartAxis::linear(label) };
    let series = |(label, colour, mark, identified): &(&str, Colour, Mark, bool)| -> Vec<Series> {
        let of = having.iter().enumerate().filter(|(_, (_, line))| line.is_identified() == *identified);
        // one series per row, since the symbols of a series are joined
        of.map(|(row, (_, line))| Series {
            label: (*label).to_owned(),
            colour: *colour,
            mark: *mark,
            points: vec![Some((line.estimate, row as f64))],
            error_bars: vec![interval_bar(line, row as f64, (log, low, high))],
        })
        .collect()
    };
    let rows = having.iter().enumerate();
    let truth = Series {
        label: "truth (synthetic)".to_owned(),
        colour: Colour::Black,
        mark: Mark::Crosses,
        points: rows.filter_map(|(row, (_, p))| Some(Some((p.truth?.value, row as f64)))).collect(),
        ..Series::default()
    };
    Panel {
        title: shorten_name(&capitalise(&describe_parameters([parameter.name.as_str()]))),
        x: x.with_range(low, high),
        y: ChartAxis::categorical("", having.iter().map(|(entry, _)| entry.name.clone())),
        height_mm: having.len().max(LEAST_ROWS) as f64 * row_mm,
        series: LOOKS.iter().flat_map(series).chain(Some(truth).filter(|t| !t.points.is_empty())).collect(),
        ..Panel::default()
    }
}

/// The 95 % interval as an error bar. The bar of an open end extends beyond the axes, so that no cap is
/// visible there.
fn interval_bar(line: &ParameterLine, y: f64, (log, low, high): (bool, f64, f64)) -> ErrorBar {
    let beyond = if log { (low / 10.0, high * 10.0) } else { (2.0 * low - high, 2.0 * high - low) };
    ErrorBar::Horizontal { y, from: line.lower_95.unwrap_or(beyond.0), to: line.upper_95.unwrap_or(beyond.1) }
}

/// Whether the axis is logarithmic, and the two ends of the axis. These are slightly beyond every estimate,
/// every true value and every finite end of an interval.
fn axis_range(having: &[(&ComparedFit, &ParameterLine)]) -> (bool, f64, f64) {
    let ends =
        having.iter().flat_map(|(_, p)| [Some(p.estimate), p.lower_95, p.upper_95, p.truth.map(|t| t.value)]);
    let wider = |(l, h): (f64, f64), x| (l.min(x), h.max(x));
    let finite = ends.flatten().filter(|x| x.is_finite());
    let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), wider);
    if low > high {
        return (false, 0.0, 1.0);
    }
    if low > 0.0 && high / low > WIDE {
        let room = math::powf(high / low, ROOM);
        return (true, low / room, high * room);
    }
    let room = if high > low { ROOM * (high - low) } else { (ALONE * high.abs()).max(f64::MIN_POSITIVE) };
    (false, low - room, high + room)
}
