//! Maps of a parameter study: a quantity over two parameters as colours, or over one as a curve; hatched
//! where there is no value.

mod claim;
mod hatches;
pub(super) mod labels;
mod limits;

pub(super) use claim::{MapClaim, map_values};
pub(super) use hatches::ReasonPatterns;

use crate::chart::{
    COLUMN_WIDTH_MM, ChartAxis, Colour, Figure, HeatMap, Mark, MarkerShape, Panel, Series, VerticalLine,
    cell_edges,
};
use crate::simulate::scene::Scene;
use crate::sweep::{MissingReason, PointOutcome, Study, SweepAxis, SweepMap};
use labels::{axis_label, axis_scale, display_unit, map_label, map_range};
use limits::colour_limits;

/// Heights of a map and of a curve, mm.
const MAP_MM: f64 = 56.0;
const CURVE_MM: f64 = 46.0;

/// The figure of map number `at` (counted from 0); one without panels where there is no such map.
#[must_use]
pub fn draw_figure(study: &Study, scene: &Scene, outcomes: &[PointOutcome], at: usize) -> Figure {
    let Some(map) = study.maps.get(at) else { return Figure::default() };
    let drawn = SweepMapValues::new(study, map, outcomes, at);
    let Some(mut panel) = drawn.draw_panel(study, scene, &ReasonPatterns::from_outcomes(outcomes)) else {
        return Figure::default();
    };
    for hatch in &mut panel.hatches {
        hatch.label = format!("{}: {}", hatch.label, hatch.cells.len());
    }
    Figure {
        title: MapClaim::new(study, map, &drawn.values).title(),
        subtitle: format!("{}; synthetic: a simulation, no camera took it", study.title),
        watermarked: true,
        description: format!(
            "{} over {}, from the scene \"{}\"; grey or hatched where a run has no value.",
            map_label(map),
            describe_axes(study),
            scene.title()
        ),
        width_mm: COLUMN_WIDTH_MM,
        panels: vec![panel],
        ..Figure::default()
    }
}

/// The axes of a study.
pub(super) fn describe_axes(study: &Study) -> String {
    study.axes.iter().map(axis_label).collect::<Vec<_>>().join(" and ")
}

/// What is shown of a map at every point of the grid, in the unit of the figure.
pub(super) struct SweepMapValues<'a> {
    map: &'a SweepMap,
    pub values: Vec<Option<f64>>,
    reasons: Vec<Option<MissingReason>>,
}

impl<'a> SweepMapValues<'a> {
    /// Map number `at` of a study.
    pub fn new(study: &Study, map: &'a SweepMap, outcomes: &[PointOutcome], at: usize) -> Self {
        let reason = |outcome: &PointOutcome| outcome.values.get(at)?.err();
        let reasons = outcomes.iter().map(reason).collect();
        Self { map, values: map_values(study, outcomes, at), reasons }
    }

    /// The panel of the map; `None` of a study without axes.
    pub fn draw_panel(&self, study: &Study, scene: &Scene, patterns: &ReasonPatterns) -> Option<Panel> {
        match study.axes.as_slice() {
            [x] => Some(self.draw_curve(x, scene, patterns)),
            [x, y, ..] => Some(self.draw_heat_map([x, y], scene, patterns)),
            [] => None,
        }
    }

    fn draw_heat_map(&self, [x, y]: [&SweepAxis; 2], scene: &Scene, patterns: &ReasonPatterns) -> Panel {
        let (across, up) = (DisplayAxis::new(x), DisplayAxis::new(y));
        let rows = up.middles.len().max(1);
        let heat = HeatMap {
            label: map_label(self.map),
            x: across.middles.clone(),
            y: up.middles.clone(),
            values: self.values.chunks(rows).map(<[_]>::to_vec).collect(),
            range: map_range(self.map).or_else(|| colour_limits(&self.values)),
            contours: true,
            ..HeatMap::default()
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
            x: across.chart_axis(),
            y: up.chart_axis(),
            height_mm: MAP_MM,
            series: scene_marker(across.scene_value(scene).zip(up.scene_value(scene))).into_iter().collect(),
            heat_map: Some(heat),
            hatches: patterns.reason_hatches(&self.reasons, cell),
            ..Panel::default()
        }
    }

    fn draw_curve(&self, x: &SweepAxis, scene: &Scene, patterns: &ReasonPatterns) -> Panel {
        let across = DisplayAxis::new(x);
        let points: Vec<Option<(f64, f64)>> =
            across.middles.iter().zip(&self.values).map(|(x, value)| value.map(|y| (*x, y))).collect();
        let mark = Mark::Joined(MarkerShape::Disc);
        let line = Series { colour: Colour::Blue, mark, points, ..Series::default() };
        let cell = |index: usize| {
            let (from, to) = (*across.edges.get(index)?, *across.edges.get(index + 1)?);
            Some([from, to, f64::NEG_INFINITY, f64::INFINITY])
        };
        let rule = |at| VerticalLine {
            label: SCENE_LABEL.to_owned(),
            colour: Colour::Grey,
            mark: Mark::Dashed,
            at,
            above: None,
        };
        let y = ChartAxis::linear(map_label(self.map));
        Panel {
            x: across.chart_axis(),
            y: map_range(self.map).map_or(y.clone(), |(low, high)| y.with_range(low, high)),
            height_mm: CURVE_MM,
            series: vec![line],
            vertical_lines: across.scene_value(scene).map(rule).into_iter().collect(),
            hatches: patterns.reason_hatches(&self.reasons, cell),
            ..Panel::default()
        }
    }
}

/// What marks the scene from which the study starts.
const SCENE_LABEL: &str = "the scene as written";

fn scene_marker(at: Option<(f64, f64)>) -> Option<Series> {
    at.map(|at| Series {
        label: SCENE_LABEL.to_owned(),
        colour: Colour::Vermilion,
        mark: Mark::Hollow(MarkerShape::Diamond),
        points: vec![Some(at)],
        ..Series::default()
    })
}

/// An axis in the unit of figures.
struct DisplayAxis<'a> {
    axis: &'a SweepAxis,
    middles: Vec<f64>,
    edges: Vec<f64>,
}

impl<'a> DisplayAxis<'a> {
    fn new(axis: &'a SweepAxis) -> Self {
        let factor = display_unit(axis.parameter).1;
        let middles: Vec<f64> = axis.values.iter().map(|value| value * factor).collect();
        let edges = cell_edges(&middles, axis_scale(axis));
        Self { axis, middles, edges }
    }

    /// From the start of the first cell to the end of the last.
    fn chart_axis(&self) -> ChartAxis {
        let axis =
            ChartAxis { label: axis_label(self.axis), scale: axis_scale(self.axis), ..ChartAxis::default() };
        match (self.edges.first(), self.edges.last()) {
            (Some(low), Some(high)) => axis.with_range(*low, *high),
            _ => axis,
        }
    }

    /// Where the scene itself lies, if it does.
    fn scene_value(&self, scene: &Scene) -> Option<f64> {
        let value = scene.value(self.axis.parameter.name)? * display_unit(self.axis.parameter).1;
        let within = value >= *self.edges.first()? && value <= *self.edges.last()?;
        within.then_some(value)
    }
}
