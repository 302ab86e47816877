//! Work-precision diagram: error against wall time, with one line per method. Runs with missed or invented
//! transitions are also shown in a panel of their own.

use plain_charts::{ChartAxis, Colour, FULL_WIDTH_MM, Figure, Mark, MarkerShape, Panel, Series};

/// A run in the diagram.
#[derive(Debug, Clone, PartialEq)]
pub struct WorkPrecisionRun {
    /// Name of the method; the runs of a method form one line, in the order of the list.
    pub method: String,
    /// Wall time, s.
    pub wall_s: f64,
    /// Error in the unit of the diagram; `None` if it is undefined.
    pub error: Option<f64>,
    /// Number of missed or invented transitions.
    pub wrong_transitions: usize,
}

/// Data of the diagram.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct WorkPrecision {
    /// Heading.
    pub title: String,
    /// Line under the heading; empty for none.
    pub subtitle: String,
    /// Quantity and unit of the error.
    pub error_label: String,
    /// The runs.
    pub points: Vec<WorkPrecisionRun>,
    /// Error of the reference itself; errors smaller than this are drawn at this value.
    pub floor: Option<f64>,
}

/// Total height of the diagram, and height of the panel of wrong transitions, mm.
const HEIGHTS_MM: (f64, f64) = (88.0, 24.0);
/// Colours and symbols of the methods, in order of appearance.
const LOOKS: [(Colour, MarkerShape); 7] = [
    (Colour::Vermilion, MarkerShape::Disc),
    (Colour::Blue, MarkerShape::Square),
    (Colour::Green, MarkerShape::Diamond),
    (Colour::Orange, MarkerShape::Triangle),
    (Colour::Purple, MarkerShape::InvertedTriangle),
    (Colour::SkyBlue, MarkerShape::Square),
    (Colour::Black, MarkerShape::Diamond),
];

/// Draws the figure.
#[must_use]
pub fn draw_figure(shown: &WorkPrecision) -> Figure {
    let mut methods: Vec<&str> = Vec::new();
    for point in &shown.points {
        if !methods.contains(&point.method.as_str()) {
            methods.push(&point.method);
        }
    }
    let looks = || methods.iter().zip(LOOKS.iter().cycle());
    let runs = |method| shown.points.iter().filter(move |p| p.method == method);
    let at_least_floor = |error: f64| shown.floor.map_or(error, |floor| error.max(floor));
    let lines = looks().map(|(method, (colour, shape))| {
        let points = runs(*method).map(|p| Some((p.wall_s, at_least_floor(p.error?))));
        Series::new(*method, *colour, Mark::Joined(*shape), points)
    });
    // number of wrong transitions of the runs that have any
    let strays = looks().map(|(method, (colour, shape))| {
        let wrong = runs(*method).filter(|p| p.wrong_transitions > 0);
        let points = wrong.map(|p| (p.wall_s, p.wrong_transitions as f64));
        Series::new("", *colour, Mark::Hollow(*shape), points)
    });
    let strays: Vec<Series> = strays.filter(|s| !s.points.is_empty()).collect();
    let (low, high) = value_range(shown.points.iter().map(|p| p.wall_s)).unwrap_or((1e-3, 1.0));
    let x = ChartAxis::log("wall time of a run, s").with_range(low, high);
    let floor = shown.floor.map(|floor| {
        Series::new("limit of the reference", Colour::Grey, Mark::Dashed, [(low, floor), (high, floor)])
    });
    // the axis covers all errors, however many decades they span
    let errors = shown.points.iter().filter_map(|p| p.error).map(|e| e.max(shown.floor.unwrap_or(0.0)));
    let error_range = value_range(errors.chain(shown.floor)).unwrap_or((1e-12, 1.0));
    let y = ChartAxis::log(shown.error_label.clone()).with_ends(Some(error_range));
    let mut panels = vec![Panel::new(x.clone(), y, HEIGHTS_MM.0, lines.chain(floor))];
    if !strays.is_empty() {
        panels[0].height_mm -= HEIGHTS_MM.1;
        let wrong = shown.points.iter().map(|p| p.wrong_transitions as f64);
        let (low, high) = value_range(wrong).unwrap_or((1.0, 10.0));
        let y = ChartAxis::log("missed + invented").with_range(low, high.max(10.0 * low));
        panels.push(Panel::new(x, y, HEIGHTS_MM.1, strays));
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

/// A logarithmic axis begins at the smallest value divided by this factor and ends at the largest value
/// multiplied by it.
const ROOM: f64 = 1.5;

fn value_range(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let usable = values.filter(|v| v.is_finite() && *v > 0.0);
    let (low, high) = usable.fold((f64::INFINITY, 0.0f64), |(l, h), v| (l.min(v), h.max(v)));
    (low <= high).then_some((low / ROOM, high * ROOM))
}

#[cfg(test)]
mod tests {
    use super::*;
    use plain_charts::Medium;

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
