//! Work-precision diagram: error against time, one line a method; runs whose list of transitions is not the
//! reference's stand apart.

use crate::chart::{ChartAxis, Colour, FULL_WIDTH_MM, Figure, Mark, MarkerShape, Panel, Series};

/// A run in the diagram.
#[derive(Debug, Clone, PartialEq)]
pub struct WorkPrecisionRun {
    /// Name of the method; runs of one name make one line, in their order.
    pub method: String,
    /// Time that it took, s.
    pub wall_s: f64,
    /// Its error, in the unit of the diagram; `None` where it has none to show.
    pub error: Option<f64>,
    /// Number of transitions that it missed or invented.
    pub wrong_transitions: usize,
}

/// What the diagram shows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct WorkPrecision {
    /// Heading.
    pub title: String,
    /// Line under it; empty for none.
    pub subtitle: String,
    /// Quantity and unit of the error.
    pub error_label: String,
    /// The runs.
    pub points: Vec<WorkPrecisionRun>,
    /// Error below which the reference is not sure: smaller ones are drawn at it.
    pub floor: Option<f64>,
}

/// Height of the panel of errors and of that of wrong lists, mm.
const HEIGHTS_MM: (f64, f64) = (88.0, 24.0);
/// Looks of the methods, in order of appearance.
const LOOKS: [(Colour, MarkerShape); 7] = [
    (Colour::Vermilion, MarkerShape::Disc),
    (Colour::Blue, MarkerShape::Square),
    (Colour::Green, MarkerShape::Diamond),
    (Colour::Orange, MarkerShape::Triangle),
    (Colour::Purple, MarkerShape::InvertedTriangle),
    (Colour::SkyBlue, MarkerShape::Square),
    (Colour::Black, MarkerShape::Diamond),
];

/// The figure.
#[must_use]
pub fn draw_figure(shown: &WorkPrecision) -> Figure {
    let mut methods: Vec<&str> = Vec::new();
    for point in &shown.points {
        if !methods.contains(&point.method.as_str()) {
            methods.push(&point.method);
        }
    }
    let of = |method: &str| shown.points.iter().filter(move |p| p.method == method).collect::<Vec<_>>();
    let looks = methods.iter().zip(LOOKS.iter().cycle());
    let lines = looks
        .clone()
        .map(|(method, (colour, shape))| method_line(method, &of(method), shown.floor, *colour, *shape));
    let strays: Vec<Series> = looks
        .map(|(method, (colour, shape))| stray_runs(&of(method), *colour, *shape))
        .filter(|s| !s.points.is_empty())
        .collect();
    let x = ChartAxis::log("wall time of a run, s").with_range(x_limits(shown).0, x_limits(shown).1);
    let panel = |y: ChartAxis, height_mm: f64, series: Vec<Series>| Panel {
        x: x.clone(),
        y,
        height_mm,
        series,
        ..Panel::default()
    };
    let mut errors = panel(error_axis(shown), HEIGHTS_MM.0, lines.chain(floor_line(shown)).collect());
    let mut panels = Vec::new();
    if strays.is_empty() {
        panels.push(errors);
    } else {
        errors.height_mm -= HEIGHTS_MM.1;
        panels.push(errors);
        panels.push(panel(stray_axis(shown), HEIGHTS_MM.1, strays));
    }
    Figure {
        title: shown.title.clone(),
        subtitle: shown.subtitle.clone(),
        description: "Error of each method against the time that it takes. Hollow symbols: runs that miss \
                      or invent transitions."
            .to_owned(),
        width_mm: FULL_WIDTH_MM,
        panels,
        ..Figure::default()
    }
}

fn method_line(
    method: &str,
    points: &[&WorkPrecisionRun],
    floor: Option<f64>,
    colour: Colour,
    shape: MarkerShape,
) -> Series {
    let at = |p: &&WorkPrecisionRun| {
        p.error.map(|error| (p.wall_s, floor.map_or(error, |floor| error.max(floor))))
    };
    Series {
        label: method.to_owned(),
        colour,
        mark: Mark::Joined(shape),
        points: points.iter().map(at).collect(),
        ..Series::default()
    }
}

/// Runs with a wrong list, over the number of wrong transitions.
fn stray_runs(points: &[&WorkPrecisionRun], colour: Colour, shape: MarkerShape) -> Series {
    let wrong = points.iter().filter(|p| p.wrong_transitions > 0);
    let points = wrong.map(|p| Some((p.wall_s, p.wrong_transitions as f64))).collect();
    Series { label: String::new(), colour, mark: Mark::Hollow(shape), points, ..Series::default() }
}

fn floor_line(shown: &WorkPrecision) -> Option<Series> {
    let (low, high) = x_limits(shown);
    let points = vec![Some((low, shown.floor?)), Some((high, shown.floor?))];
    Some(Series {
        label: "limit of the reference".to_owned(),
        colour: Colour::Grey,
        mark: Mark::Dashed,
        points,
        ..Series::default()
    })
}

/// Room beyond the data on a logarithmic axis, as a factor.
const ROOM: f64 = 1.5;

fn x_limits(shown: &WorkPrecision) -> (f64, f64) {
    value_range(shown.points.iter().map(|p| p.wall_s)).unwrap_or((1e-3, 1.0))
}

/// The axis reaches over all errors, however many decades these are.
fn error_axis(shown: &WorkPrecision) -> ChartAxis {
    let errors =
        shown.points.iter().filter_map(|p| p.error.map(|error| error.max(shown.floor.unwrap_or(0.0))));
    let (low, high) = value_range(errors.chain(shown.floor)).unwrap_or((1e-12, 1.0));
    ChartAxis::log(shown.error_label.clone()).with_range(low, high)
}

fn stray_axis(shown: &WorkPrecision) -> ChartAxis {
    let (low, high) =
        value_range(shown.points.iter().map(|p| p.wrong_transitions as f64)).unwrap_or((1.0, 10.0));
    ChartAxis::log("missed + invented").with_range(low, high.max(10.0 * low))
}

fn value_range(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let usable = values.filter(|v| v.is_finite() && *v > 0.0);
    let (low, high) = usable.fold((f64::INFINITY, 0.0f64), |(l, h), v| (l.min(v), h.max(v)));
    (low <= high).then_some((low / ROOM, high * ROOM))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chart::Medium;

    fn as_svg(shown: &WorkPrecision) -> String {
        draw_figure(shown).to_svg(Medium::Screen)
    }

    fn point(method: &str, wall_s: f64, error: Option<f64>, wrong_transitions: usize) -> WorkPrecisionRun {
        WorkPrecisionRun { method: method.to_owned(), wall_s, error, wrong_transitions }
    }

    #[test]
    fn wrong_lists_have_their_own_panel_only_where_there_are_some() {
        let mut shown = WorkPrecision {
            error_label: "error, s".to_owned(),
            points: vec![point("a", 1e-2, Some(1e-6), 0)],
            ..WorkPrecision::default()
        };
        assert!(!as_svg(&shown).contains("missed +"));
        shown.points.push(point("a", 1e-3, None, 4));
        assert!(as_svg(&shown).contains("missed +"));
    }

    #[test]
    fn a_diagram_of_nothing_can_be_drawn_and_the_same_numbers_give_the_same_bytes() {
        let empty = WorkPrecision::default();
        assert_eq!(as_svg(&empty), as_svg(&empty));
    }
}
