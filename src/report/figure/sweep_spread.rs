//! What a quantity does over each parameter of a study with many: quantiles of all runs whose parameter lies
//! in a bin, and the rank correlation of the two.

use super::sweep_map::labels::{axis_label, label, scale, shown_range, shown_unit};
use crate::report::chart::{Axis, Colour, FULL_WIDTH_MM, Figure, Mark, Panel, Ribbon, Series};
use crate::sweep::spread::Bin;
use crate::sweep::{Axis as Values, Map, Spread, Study};
use crate::text::{capitalised, decimals, or_dash};

/// Height of a panel, mm.
const PANEL_MM: f64 = 34.0;
/// Share of the height that stays free above and below.
const MARGIN: f64 = 0.04;

/// The figure of map number `at` (counted from 0); one without panels where there is no such map. `missing`
/// is the number of points without a value.
#[must_use]
pub fn figure(study: &Study, spread: &Spread, missing: usize, at: usize) -> Figure {
    let Some(map) = study.maps.get(at) else { return Figure::default() };
    let correlations = spread.correlations(study, at).into_iter().map(|found| found.rank_correlation);
    let bins: Vec<Vec<Bin>> = (0..study.axes.len()).map(|axis| spread.bins(study, at, axis)).collect();
    let range = shown_range(map).or_else(|| reach(&bins, map.reading.unit().factor));
    let panels = study.axes.iter().zip(&bins).zip(correlations);
    let panels = panels.map(|((axis, bins), r)| panel(map, axis, bins, range, r));
    let points = study.points();
    let looked_at = match spread.looked_at() {
        all if all == points => String::new(),
        some => format!("; from {some} of them"),
    };
    Figure {
        title: capitalised(&map.name),
        synthetic: true,
        subtitle: format!(
            "{}; synthetic: {points} simulations, {missing} of them without a value{looked_at}",
            study.title
        ),
        description: format!(
            "{} over each parameter: median, middle half and middle nine tenths of the runs in a bin, and the rank \
             correlation.",
            label(map)
        ),
        width_mm: FULL_WIDTH_MM,
        columns: 2,
        panels: panels.collect(),
    }
}

/// From the least to the greatest quantile of all panels, and a little more, so that they can be compared.
fn reach(bins: &[Vec<Bin>], factor: f64) -> Option<(f64, f64)> {
    let quantiles = || bins.iter().flatten().filter_map(|bin| bin.quantiles).flatten();
    let (low, high) = (quantiles().reduce(f64::min)?, quantiles().reduce(f64::max)?);
    let margin = MARGIN * (high - low);
    (high > low).then_some((factor * (low - margin), factor * (high + margin)))
}

fn panel(map: &Map, of: &Values, bins: &[Bin], range: Option<(f64, f64)>, correlation: Option<f64>) -> Panel {
    let (across, up) = (shown_unit(of.parameter).1, map.reading.unit().factor);
    let middle = |[from, to]: [f64; 2]| across * of.spacing.between(from, to, 0.5);
    let quantile = |bin: &Bin, q: usize| bin.quantiles.map(|of| (middle(bin.from_to), up * of[q]));
    let ribbon = |label: &str, low: usize, high: usize, colour: Colour| Ribbon {
        label: label.to_owned(),
        colour,
        points: bins
            .iter()
            .map(|bin| Some((quantile(bin, low)?.0, quantile(bin, low)?.1, quantile(bin, high)?.1)))
            .collect(),
    };
    let x = Axis { label: axis_label(of), scale: scale(of), ..Axis::default() };
    let ends = of.values.first().zip(of.values.last());
    let y = Axis::linear(label(map));
    Panel {
        title: format!("rank correlation {}", or_dash(correlation, |r| decimals(r, 2))),
        x: ends.map_or(x.clone(), |(from, to)| x.between(across * from, across * to)),
        y: range.map_or(y.clone(), |(low, high)| y.between(low, high)),
        height_mm: PANEL_MM,
        ribbons: vec![ribbon("5 to 95 %", 0, 4, Colour::Grey), ribbon("25 to 75 %", 1, 3, Colour::Blue)],
        series: vec![Series {
            label: "median".to_owned(),
            colour: Colour::Blue,
            mark: Mark::Line,
            points: bins.iter().map(|bin| quantile(bin, 2)).collect(),
            ..Series::default()
        }],
        ..Panel::default()
    }
}
