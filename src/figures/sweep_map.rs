//! Maps of a parameter study: a quantity over two parameters as colours, or over one as a curve; hatched
//! where there is no value.

mod claim;
mod hatches;
pub(super) mod labels;
mod limits;

pub(super) use claim::{Claim, shown_values};
pub(super) use hatches::Patterns;

use crate::chart::{
    Axis as ChartAxis, COLUMN_WIDTH_MM, Colour, Figure, Heat, Mark, Panel, Rule, Series, Shape, cell_edges,
};
use crate::simulate::scene::Scene;
use crate::sweep::{Axis, Map, Outcome, Reason, Study};
use labels::{axis_label, label, scale, shown_range, shown_unit};
use limits::limits;

/// Heights of a map and of a curve, mm.
const MAP_MM: f64 = 56.0;
const CURVE_MM: f64 = 46.0;

/// The figure of map number `at` (counted from 0); one without panels where there is no such map.
#[must_use]
pub fn figure(study: &Study, scene: &Scene, outcomes: &[Outcome], at: usize) -> Figure {
    let Some(map) = study.maps.get(at) else { return Figure::default() };
    let drawn = Drawn::of(study, map, outcomes, at);
    let Some(mut panel) = drawn.panel(study, scene, &Patterns::of(outcomes)) else {
        return Figure::default();
    };
    for hatch in &mut panel.hatches {
        hatch.label = format!("{}: {}", hatch.label, hatch.cells.len());
    }
    Figure {
        title: Claim::of(study, map, &drawn.values).title(),
        subtitle: format!("{}; synthetic: a simulation, no camera took it", study.title),
        synthetic: true,
        description: format!(
            "{} over {}, from the scene \"{}\"; grey or hatched where a run has no value.",
            label(map),
            over(study),
            scene.title()
        ),
        width_mm: COLUMN_WIDTH_MM,
        panels: vec![panel],
        ..Figure::default()
    }
}

/// The axes of a study.
pub(super) fn over(study: &Study) -> String {
    study.axes.iter().map(axis_label).collect::<Vec<_>>().join(" and ")
}

/// What is shown of a map at every point of the grid, in the unit of the figure.
pub(super) struct Drawn<'a> {
    map: &'a Map,
    pub values: Vec<Option<f64>>,
    reasons: Vec<Option<Reason>>,
}

impl<'a> Drawn<'a> {
    /// Map number `at` of a study.
    pub fn of(study: &Study, map: &'a Map, outcomes: &[Outcome], at: usize) -> Self {
        let reason = |outcome: &Outcome| outcome.values.get(at)?.err();
        let reasons = outcomes.iter().map(reason).collect();
        Self { map, values: shown_values(study, outcomes, at), reasons }
    }

    /// The panel of the map; `None` of a study without axes.
    pub fn panel(&self, study: &Study, scene: &Scene, patterns: &Patterns) -> Option<Panel> {
        match study.axes.as_slice() {
            [x] => Some(self.curve(x, scene, patterns)),
            [x, y, ..] => Some(self.heat_map([x, y], scene, patterns)),
            [] => None,
        }
    }

    fn heat_map(&self, [x, y]: [&Axis; 2], scene: &Scene, patterns: &Patterns) -> Panel {
        let (across, up) = (Shown::of(x), Shown::of(y));
        let rows = up.middles.len().max(1);
        let heat = Heat {
            label: label(self.map),
            x: across.middles.clone(),
            y: up.middles.clone(),
            values: self.values.chunks(rows).map(<[_]>::to_vec).collect(),
            range: shown_range(self.map).or_else(|| limits(&self.values)),
            contours: true,
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
            hatches: patterns.hatches(&self.reasons, cell),
            ..Panel::default()
        }
    }

    fn curve(&self, x: &Axis, scene: &Scene, patterns: &Patterns) -> Panel {
        let across = Shown::of(x);
        let points: Vec<Option<(f64, f64)>> =
            across.middles.iter().zip(&self.values).map(|(x, value)| value.map(|y| (*x, y))).collect();
        let mark = Mark::Joined(Shape::Disc);
        let line = Series { colour: Colour::Blue, mark, points, ..Series::default() };
        let cell = |index: usize| {
            let (from, to) = (*across.edges.get(index)?, *across.edges.get(index + 1)?);
            Some([from, to, f64::NEG_INFINITY, f64::INFINITY])
        };
        let rule =
            |at| Rule { label: SCENE.to_owned(), colour: Colour::Grey, mark: Mark::Dashed, at, above: None };
        let y = ChartAxis::linear(label(self.map));
        Panel {
            x: across.axis(),
            y: shown_range(self.map).map_or(y.clone(), |(low, high)| y.between(low, high)),
            height_mm: CURVE_MM,
            series: vec![line],
            rules: across.of_scene(scene).map(rule).into_iter().collect(),
            hatches: patterns.hatches(&self.reasons, cell),
            ..Panel::default()
        }
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
