//! Every map of a parameter study on one sheet, as small panels of one design: maps or curves over the same
//! axes, or, of a study with many parameters, the rank correlation of every map with every parameter.

use super::sweep_map::labels::{axis_label, words};
use super::sweep_map::{Claim, Drawn, Patterns, over};
use crate::chart::{Axis, COLUMN_WIDTH_MM, Colour, Colours, FULL_WIDTH_MM, Figure, Heat, Panel, Text};
use crate::simulate::scene::Scene;
use crate::sweep::{Map, Outcome, RankCorrelations, Study};
use crate::text::{capitalised, decimals, listed, printable};

/// Heights of a panel and of a row of the table of correlations, mm.
const PANEL_MM: f64 = 42.0;
const ROW_MM: f64 = 7.0;
/// Letters for which a panel has room over it.
const CLAIM_LETTERS: usize = 34;
/// Most panels; of a study with more maps the first are shown.
const MOST: usize = 12;

/// The sheet of a study whose points are on a grid over one or two parameters. A map without any value has no
/// panel and is named under the heading. One without panels where no map has a value.
#[must_use]
pub fn figure(study: &Study, scene: &Scene, outcomes: &[Outcome]) -> Figure {
    let patterns = Patterns::of(outcomes);
    let drawn = study.maps.iter().enumerate().map(|(at, map)| (map, Drawn::of(study, map, outcomes, at)));
    let (shown, empty): (Vec<_>, Vec<_>) =
        drawn.partition(|(_, drawn)| drawn.values.iter().any(Option::is_some));
    let panel = |(map, drawn): &(&Map, Drawn)| {
        let claim = Claim::of(study, map, &drawn.values);
        let mut panel = drawn.panel(study, scene, &patterns)?;
        // the name of the quantity stands in the title
        let unit = map.reading.unit().shown;
        if let Some(heat) = panel.heat.as_mut().filter(|_| !unit.is_empty()) {
            unit.clone_into(&mut heat.label);
        }
        let title = format!("{}\n{}", printable(&claim.name), claim.shown_in(CLAIM_LETTERS));
        Some(Panel { title, height_mm: PANEL_MM, ..panel })
    };
    let panels: Vec<Panel> = shown.iter().take(MOST).filter_map(panel).collect();
    let left_out = shown.len() - panels.len();
    let mut notes = vec![format!("{}; synthetic: a simulation, no camera took it", study.title)];
    if !empty.is_empty() {
        let names: Vec<String> = empty.iter().map(|(map, _)| map.name.clone()).collect();
        notes.push(format!("without any value: {}", listed(&names)));
    }
    if left_out > 0 {
        notes.push(format!("{left_out} more maps have only their own figures"));
    }
    Figure {
        title: capitalised(&format!("{} over {}", counted(panels.len()), over(study))),
        subtitle: notes.join("; "),
        synthetic: true,
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

fn counted(maps: usize) -> String {
    if maps == 1 { "one map".to_owned() } else { format!("{maps} maps") }
}

/// The sheet of a study that is not drawn as maps: rank correlations as numbers over colours.
#[must_use]
pub fn correlations(study: &Study, found: &RankCorrelations) -> Figure {
    let of = |at: usize| -> Vec<Option<f64>> {
        found.of_map(study, at).into_iter().rev().map(|one| one.rank_correlation).collect()
    };
    // the first parameter on top
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
        Some(format!("{} follows {} most: {}", capitalised(&map.name), words(axis), decimals(r, 2)))
    });
    let text = |(x, y, r)| Text { text: decimals(r, 2), colour: Colour::Black, at: (x as f64, y as f64) };
    let places = |count: usize| (0..count).map(|at| at as f64).collect();
    let panel = Panel {
        x: Axis::named("", study.maps.iter().map(|map| capitalised(&map.name))),
        y: Axis::named("", axes.iter().map(|axis| axis_label(axis))),
        height_mm: ROW_MM * study.axes.len().max(1) as f64,
        texts: cells().map(text).collect(),
        heat: Some(Heat {
            label: "rank correlation".to_owned(),
            x: places(study.maps.len()),
            y: places(study.axes.len()),
            values,
            range: Some((-1.0, 1.0)),
            map: Colours::Diverging,
            ..Heat::default()
        }),
        ..Panel::default()
    };
    Figure {
        title: claim.clone().unwrap_or_else(|| "No rank correlation".to_owned()),
        subtitle: format!("{}; synthetic: {} simulations, no camera took them", study.title, study.points()),
        synthetic: true,
        description: "Rank correlation of every map with every parameter, as numbers over colours."
            .to_owned(),
        width_mm: FULL_WIDTH_MM,
        panels: if claim.is_some() { vec![panel] } else { Vec::new() },
        ..Figure::default()
    }
}
