//! All maps of a parameter study on one sheet: small maps or curves with the same axes or, for a study with
//! many parameters, the rank correlations between maps and parameters.

use super::sweep_map::{MapClaim, ReasonPatterns, SweepMapValues, describe_axes};
use super::sweep_map::{axis_label, parameter_words};
use crate::simulate::scene::Scene;
use crate::sweep::{PointOutcome, RankCorrelations, Study, SweepMap};
use crate::text::{capitalise, format_decimals, join_with_and, make_printable};
use plain_charts::{
    COLUMN_WIDTH_MM, ChartAxis, Colour, ColourMap, FULL_WIDTH_MM, Figure, HeatMap, Panel, TextAnnotation,
};

/// Height of a panel, mm.
const PANEL_MM: f64 = 42.0;
/// Height, mm, of a row of the table of correlations.
const ROW_MM: f64 = 7.0;
/// Minimum height of the table of correlations, in rows; the label of the colour bar needs this height.
const FEWEST_ROWS: usize = 5;
/// Number of letters that fit above a panel.
const CLAIM_LETTERS: usize = 34;
/// Maximum number of panels; further maps are left out.
const MOST: usize = 12;

/// Draws the sheet of a study with a grid of one or two parameters. Maps without any value have no panel;
/// they are named under the heading. If there is no panel at all, the figure is empty.
#[must_use]
pub fn draw_figure(study: &Study, scene: &Scene, outcomes: &[PointOutcome]) -> Figure {
    let patterns = ReasonPatterns::from_outcomes(outcomes);
    let maps = study.maps.iter().enumerate();
    let drawn = maps.map(|(at, map)| (map, SweepMapValues::new(study, map, outcomes, at)));
    let (shown, empty): (Vec<_>, Vec<_>) =
        drawn.partition(|(_, drawn)| drawn.values.iter().any(Option::is_some));
    let panel = |(map, drawn): &(&SweepMap, SweepMapValues)| {
        let claim = MapClaim::new(study, map, &drawn.values);
        let mut panel = drawn.draw_panel(study, scene, &patterns)?;
        // the title of the panel names the quantity
        let unit = map.reading.unit().shown;
        if let Some(heat) = panel.heat_map.as_mut().filter(|_| !unit.is_empty()) {
            unit.clone_into(&mut heat.label);
        }
        let title = format!("{}\n{}", make_printable(&claim.name), claim.fit_in_letters(CLAIM_LETTERS));
        Some(Panel { title, height_mm: PANEL_MM, ..panel })
    };
    let panels: Vec<Panel> = shown.iter().take(MOST).filter_map(panel).collect();
    let left_out = shown.len() - panels.len();
    let mut notes = vec![format!("{}; synthetic: a simulation, no camera took it", study.title)];
    if !empty.is_empty() {
        let names: Vec<String> = empty.iter().map(|(map, _)| map.name.clone()).collect();
        notes.push(format!("without any value: {}", join_with_and(&names)));
    }
    if left_out > 0 {
        notes.push(format!("{left_out} more maps have only their own figures"));
    }
    let count = if panels.len() == 1 { "One map".to_owned() } else { format!("{} maps", panels.len()) };
    Figure {
        title: format!("{count} over {}", describe_axes(study)),
        subtitle: notes.join("; "),
        watermarked: true,
        description: format!(
            "Every map of the study from the scene \"{}\"; colours end where few values lie beyond (pointed ends of \
             the bar), hatched where a run has no value.",
            scene.title()
        ),
        width_mm: if panels.len() > 1 { FULL_WIDTH_MM } else { COLUMN_WIDTH_MM },
        columns: 2,
        panels,
    }
}

/// The sheet of a study without map figures: a table of rank correlations, as numbers on colours.
pub(crate) fn draw_correlations(study: &Study, found: &RankCorrelations) -> Figure {
    let of = |at: usize| -> Vec<Option<f64>> {
        found.of_map(study, at).into_iter().rev().map(|one| one.rank_correlation).collect()
    };
    // the first parameter is at the top
    let axes: Vec<_> = study.axes.iter().rev().collect();
    let values: Vec<Vec<Option<f64>>> = (0..study.maps.len()).map(of).collect();
    let cells = || {
        let column = |(x, column): (usize, &Vec<Option<f64>>)| -> Vec<(usize, usize, f64)> {
            column.iter().enumerate().filter_map(|(y, r)| Some((x, y, (*r)?))).collect()
        };
        values.iter().enumerate().flat_map(column)
    };
    let strongest = cells().reduce(|best, next| if next.2.abs() > best.2.abs() { next } else { best });
    let claim = strongest.and_then(|(map, axis, r)| {
        let (map, axis) = (study.maps.get(map)?, axes.get(axis)?);
        let (name, parameter) = (capitalise(&map.name), parameter_words(axis));
        Some(format!("{name} follows {parameter} most: {}", format_decimals(r, 2)))
    });
    let text = |(x, y, r)| TextAnnotation::new(format_decimals(r, 2), Colour::Black, (x as f64, y as f64));
    let count = study.point_count();
    let places = |count: usize| (0..count).map(|at| at as f64).collect();
    let panel = Panel {
        x: ChartAxis::categorical("", study.maps.iter().map(|map| capitalise(&map.name))),
        y: ChartAxis::categorical("", axes.iter().map(|axis| axis_label(axis))),
        height_mm: ROW_MM * study.axes.len().max(FEWEST_ROWS) as f64,
        annotations: cells().map(text).collect(),
        heat_map: Some(HeatMap {
            label: "rank correlation".to_owned(),
            x: places(study.maps.len()),
            y: places(study.axes.len()),
            values,
            range: Some((-1.0, 1.0)),
            colour_map: ColourMap::Diverging,
            ..HeatMap::default()
        }),
        ..Panel::default()
    };
    Figure {
        panels: claim.iter().map(|_| panel.clone()).collect(),
        title: claim.unwrap_or_else(|| "No rank correlation".to_owned()),
        subtitle: format!("{}; synthetic: {count} simulations, no camera took them", study.title),
        watermarked: true,
        description: "Rank correlation of every map with every parameter, as numbers over colours."
            .to_owned(),
        width_mm: FULL_WIDTH_MM,
        ..Figure::default()
    }
}
