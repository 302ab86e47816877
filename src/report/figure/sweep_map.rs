//! Maps of a parameter study: a quantity over two parameters as colours, or over one as a curve; hatched
//! where there is no value.

use crate::blade::parameters::Parameter;
use crate::feature::Unit;
use crate::report::chart::{
    Axis as ChartAxis, COLUMN_WIDTH_MM, Colour, Figure, Hatch, Heat, Mark, Panel, Pattern, Rule, Scale,
    Series, Shape, cell_edges,
};
use crate::simulate::scene::Scene;
use crate::sweep::{Axis, Map, Outcome, Reason, Spacing, Study};
use crate::text::capitalised;

/// Heights of a map and of a curve, mm.
const MAP_MM: f64 = 56.0;
const CURVE_MM: f64 = 46.0;

/// The figure of map number `at` (counted from 0) ; one without panels where there is no such map.
#[must_use]
pub fn figure(study: &Study, scene: &Scene, outcomes: &[Outcome], at: usize) -> Figure {
    let Some(map) = study.maps.get(at) else { return Figure::default() };
    let cells = Cells::of(study, outcomes, at);
    let panel = match study.axes.as_slice() {
        [x] => curve(map, x, &cells, scene),
        [x, y, ..] => heat_map(map, [x, y], &cells, scene),
        [] => return Figure::default(),
    };
    let over = study.axes.iter().map(axis_label).collect::<Vec<_>>().join(" and ");
    Figure {
        title: capitalised(&map.name),
        subtitle: format!("{}; synthetic: a simulation, no camera took it", study.title),
        description: format!(
            "{} over {over}, from the scene \"{}\"; grey or hatched where a run has no value.",
            label(map),
            scene.title()
        ),
        width_mm: COLUMN_WIDTH_MM,
        panels: vec![panel],
        ..Figure::default()
    }
}

/// What is shown at every point of the grid, in the unit of the figure.
struct Cells {
    values: Vec<Option<f64>>,
    reasons: Vec<Option<Reason>>,
}

impl Cells {
    fn of(study: &Study, outcomes: &[Outcome], at: usize) -> Self {
        let factor = study.maps.get(at).map_or(1.0, |map| map.reading.unit().factor);
        let cell = |outcome: &Outcome| match outcome.values.get(at) {
            Some(Ok(value)) => (Some(value * factor), None),
            Some(Err(reason)) => (None, Some(*reason)),
            None => (None, None),
        };
        let (values, reasons) = outcomes.iter().map(cell).unzip();
        Self { values, reasons }
    }

    /// One hatch a reason, in the order of the table of reasons; `cell` gives the place of a point.
    fn hatches(&self, cell: impl Fn(usize) -> Option<[f64; 4]>) -> Vec<Hatch> {
        let hatch = |reason: Reason| {
            let points = self
                .reasons
                .iter()
                .enumerate()
                .filter(|(_, found)| **found == Some(reason))
                .map(|(index, _)| index);
            let cells: Vec<[f64; 4]> = points.filter_map(&cell).collect();
            Hatch { label: format!("{}: {}", reason.meaning(), cells.len()), pattern: pattern(reason), cells }
        };
        Reason::all().map(hatch).filter(|hatch| !hatch.cells.is_empty()).collect()
    }
}

/// The same reason looks the same in every figure.
fn pattern(reason: Reason) -> Pattern {
    match reason {
        Reason::ContactLost => Pattern::Rising,
        Reason::Jammed => Pattern::Falling,
        Reason::Indeterminate => Pattern::Upright,
        Reason::NoStart => Pattern::Level,
        Reason::Chattering | Reason::Diverged | Reason::WorkLimit => Pattern::Crossed,
        Reason::NoComponent | Reason::Never | Reason::NoDecay | Reason::Faded | Reason::FewCycles => {
            Pattern::Plain
        }
        _ => Pattern::Checked,
    }
}

fn heat_map(map: &Map, [x, y]: [&Axis; 2], cells: &Cells, scene: &Scene) -> Panel {
    let (across, up) = (Shown::of(x), Shown::of(y));
    let rows = up.middles.len().max(1);
    let heat = Heat {
        label: label(map),
        x: across.middles.clone(),
        y: up.middles.clone(),
        values: cells.values.chunks(rows).map(<[_]>::to_vec).collect(),
        range: shown_range(map),
        ..Heat::default()
    };
    let cell = |index: usize| {
        let (column, row) = (index / rows, index % rows);
        Some([
            *across.edges.get(column)?,
            *across.edges.get(column + 1)?,
            *up.edges.get(row)?,
            *up.edges.get(row + 1)?,
        ])
    };
    Panel {
        x: across.axis(),
        y: up.axis(),
        height_mm: MAP_MM,
        series: as_written(across.of_scene(scene).zip(up.of_scene(scene))).into_iter().collect(),
        heat: Some(heat),
        hatches: cells.hatches(cell),
        ..Panel::default()
    }
}

fn curve(map: &Map, x: &Axis, cells: &Cells, scene: &Scene) -> Panel {
    let across = Shown::of(x);
    let points: Vec<Option<(f64, f64)>> =
        across.middles.iter().zip(&cells.values).map(|(x, value)| value.map(|y| (*x, y))).collect();
    let line = Series { colour: Colour::Blue, mark: Mark::Joined(Shape::Disc), points, ..Series::default() };
    let cell = |index: usize| {
        Some([*across.edges.get(index)?, *across.edges.get(index + 1)?, f64::NEG_INFINITY, f64::INFINITY])
    };
    let of_scene = across.of_scene(scene).into_iter();
    let y = ChartAxis::linear(label(map));
    Panel {
        x: across.axis(),
        y: shown_range(map).map_or(y.clone(), |(low, high)| y.between(low, high)),
        height_mm: CURVE_MM,
        series: vec![line],
        rules: of_scene
            .map(|at| Rule {
                label: SCENE.to_owned(),
                colour: Colour::Grey,
                mark: Mark::Dashed,
                at,
                above: None,
            })
            .collect(),
        hatches: cells.hatches(cell),
        ..Panel::default()
    }
}

/// What marks the scene from which the study starts.
const SCENE: &str = "the scene as written";

fn as_written(at: Option<(f64, f64)>) -> Option<Series> {
    at.map(|at| Series {
        label: SCENE.to_owned(),
        colour: Colour::Vermilion,
        mark: Mark::Hollow(Shape::Diamond),
        points: vec![Some(at)],
        ..Series::default()
    })
}

/// An axis in the unit of figures.
struct Shown<'a> {
    axis: &'a Axis,
    middles: Vec<f64>,
    edges: Vec<f64>,
}

impl<'a> Shown<'a> {
    fn of(axis: &'a Axis) -> Self {
        let factor = shown_unit(axis.parameter).1;
        let middles: Vec<f64> = axis.values.iter().map(|value| value * factor).collect();
        let edges = cell_edges(&middles, scale(axis));
        Self { axis, middles, edges }
    }

    /// From the start of the first cell to the end of the last.
    fn axis(&self) -> ChartAxis {
        let axis =
            ChartAxis { label: axis_label(self.axis), scale: scale(self.axis), ..ChartAxis::default() };
        match (self.edges.first(), self.edges.last()) {
            (Some(low), Some(high)) => axis.between(*low, *high),
            _ => axis,
        }
    }

    /// Where the scene itself lies, if it does.
    fn of_scene(&self, scene: &Scene) -> Option<f64> {
        let value = scene.value(self.axis.parameter.name)? * shown_unit(self.axis.parameter).1;
        let within = value >= *self.edges.first()? && value <= *self.edges.last()?;
        within.then_some(value)
    }
}

pub(super) fn scale(axis: &Axis) -> Scale {
    match axis.spacing {
        Spacing::Linear => Scale::Linear,
        Spacing::Log => Scale::Log,
    }
}

pub(super) fn shown_range(map: &Map) -> Option<(f64, f64)> {
    let factor = map.reading.unit().factor;
    map.range.map(|(low, high)| (low * factor, high * factor))
}

/// Name and unit of a map.
pub(super) fn label(map: &Map) -> String {
    let Unit { shown, .. } = map.reading.unit();
    if shown.is_empty() { map.name.clone() } else { format!("{}, {shown}", map.name) }
}

/// Unit of a parameter in figures, and what its SI value is multiplied by.
pub(super) fn shown_unit(parameter: &Parameter) -> (&'static str, f64) {
    match parameter.unit {
        "m" => ("mm", 1e3),
        "kg" => ("g", 1e3),
        "N m/rad" => ("mN m/rad", 1e3),
        unit => (unit, 1.0),
    }
}

/// What an axis shows, from the name of its parameter: `drive.amplitude_m` is the "drive amplitude a, mm".
pub(super) fn axis_label(axis: &Axis) -> String {
    let Parameter { name, symbol, unit, .. } = axis.parameter;
    let (table, key) = name.split_once('.').unwrap_or(("", name));
    let suffix = format!("_{}", unit.to_lowercase().replace('/', " per ").replace(' ', "_"));
    let words = key.strip_suffix(&suffix).unwrap_or(key).replace('_', " ");
    let own = [table, words.as_str(), symbol]
        .into_iter()
        .filter(|word| *word != "blade" && (*word == *symbol || !word.eq_ignore_ascii_case(symbol)));
    let named = own.collect::<Vec<_>>().join(" ");
    match shown_unit(axis.parameter).0 {
        "1" => named,
        unit => format!("{named}, {unit}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blade::parameters::{PARAMETERS, find};

    fn axis(name: &str) -> Axis {
        Axis { parameter: find(name).unwrap(), values: vec![1.0, 2.0], spacing: Spacing::Linear }
    }

    #[test]
    fn axes_are_named_in_words_with_symbol_and_unit() {
        let label = |name: &str| axis_label(&axis(name));
        assert_eq!(label("friction.a"), "friction A");
        assert_eq!(label("friction.b_s_per_m"), "friction B, s/m");
        assert_eq!(label("drive.amplitude_m"), "drive amplitude a, mm");
        assert_eq!(label("blade.neck_stiffness_n_m_per_rad"), "neck stiffness k1, mN m/rad");
        assert_eq!(label("blade.preload_force_n"), "preload force k0 hd, N");
        let longest = PARAMETERS.iter().map(|p| label(p.name).chars().count()).max().unwrap();
        assert!(longest <= 45, "{longest} letters do not fit next to an axis of a narrow figure");
    }
}
