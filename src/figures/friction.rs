//! The Stribeck curve: the fitted law over the speed of the tip, what the recording itself shows of friction,
//! and how long the tip moved at each speed.

pub(crate) mod caption;

use crate::chart::{
    ChartAxis, Colour, FULL_WIDTH_MM, Figure, Mark, MarkerShape, Panel, Ribbon, Series, VerticalLine,
};
use crate::figures::subtitle;
use serde::Serialize;

/// Friction of the law of the best model.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FrictionLine {
    /// Speed of the tip, m/s; zero is rest.
    pub speed_m_per_s: f64,
    /// Coefficient of friction.
    pub coefficient: f64,
    /// Half of its 95 % interval; `None` where the fit does not know it.
    pub half_95: Option<f64>,
}

/// What the figure shows; speeds in m/s.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FrictionPlot {
    /// Heading.
    pub title: String,
    /// More to say; empty for none.
    pub note: String,
    /// Whether a recording behind the fit is one that no camera took.
    pub synthetic: bool,
    /// Speed and coefficient, rising.
    pub curve: Vec<(f64, f64)>,
    /// Least and greatest speed of the tip in slip.
    pub visited: Option<(f64, f64)>,
    /// Speed with the ends of the 95 % interval of the coefficient; empty for none.
    pub interval_95: Vec<(f64, f64, f64)>,
    /// The law of the synthetic blade, rising; empty where none is known.
    pub truth: Vec<(f64, f64)>,
    /// Speed and coefficient where the recorded tip moves evenly.
    pub even: Vec<(f64, f64)>,
    /// Means over cycles of the recording.
    pub over_cycles: Vec<(f64, f64)>,
    /// The same means of the model.
    pub of_model: Vec<(f64, f64)>,
    /// Bins of speed, from and to, with the share of the time of slip in them.
    pub shares: Vec<(f64, f64, f64)>,
    /// Mean speed of the head.
    pub head: Option<f64>,
}

/// Heights of the panels, mm.
const HEIGHT_MM: f64 = 56.0;
const SHARES_HEIGHT_MM: f64 = 26.0;
const MILLIMETRES: f64 = 1e3;
const PERCENT: f64 = 100.0;

/// The figure.
#[must_use]
pub fn draw_figure(law: &FrictionPlot) -> Figure {
    let end = |take: fn(f64, f64) -> f64| law.curve.iter().map(|p| p.0 * MILLIMETRES).reduce(take);
    let speed = ChartAxis::linear("tip speed, mm/s");
    let speed =
        end(f64::min).zip(end(f64::max)).map_or(speed.clone(), |(low, high)| speed.with_range(low, high));
    let rule = |label: &str| {
        let of = |at: f64| VerticalLine {
            label: label.to_owned(),
            colour: Colour::Blue,
            mark: Mark::Dashed,
            at: at * MILLIMETRES,
            above: None,
        };
        law.head.map(of).into_iter().collect()
    };
    let coefficient = Panel {
        x: speed.clone(),
        y: coefficient_axis(law),
        height_mm: HEIGHT_MM,
        series: law_series(law),
        ribbons: interval_ribbon(law).into_iter().collect(),
        vertical_lines: rule("mean speed of the head"),
        ..Panel::default()
    };
    let shares = Panel {
        x: speed,
        y: ChartAxis::linear("slip time, %"),
        height_mm: SHARES_HEIGHT_MM,
        series: vec![histogram_outline(law)],
        ribbons: vec![histogram_ribbon(law)],
        vertical_lines: rule(""),
        ..Panel::default()
    };
    Figure {
        title: law.title.clone(),
        subtitle: subtitle(law.synthetic, &law.note),
        watermarked: law.synthetic,
        description:
            "Friction coefficient over the speed of the tip, and the share of the time of slip at each speed."
                .to_owned(),
        width_mm: FULL_WIDTH_MM,
        panels: vec![coefficient, shares],
        ..Figure::default()
    }
}

/// The law where the tip did not move at all, where it did, the truth, and what was measured.
fn law_series(law: &FrictionPlot) -> Vec<Series> {
    let place = |(v, coefficient): &(f64, f64)| Some((v * MILLIMETRES, *coefficient));
    let line = |label: &str, colour, mark, points: Vec<Option<(f64, f64)>>| Series {
        label: label.to_owned(),
        colour,
        mark,
        points,
        ..Series::default()
    };
    let inside = |p: &&(f64, f64)| law.visited.is_some_and(|(low, high)| p.0 >= low && p.0 <= high);
    let drawn = [
        line("law", Colour::Grey, Mark::ThinDashed, law.curve.iter().map(place).collect()),
        line(
            "law at speeds of the run",
            Colour::Vermilion,
            Mark::Thick,
            law.curve.iter().filter(inside).map(place).collect(),
        ),
        line("synthetic truth", Colour::Green, Mark::Dashed, law.truth.iter().map(place).collect()),
        line(
            "model, mean over cycles",
            Colour::Vermilion,
            Mark::Crosses,
            law.of_model.iter().map(place).collect(),
        ),
        line(
            "measured, mean over cycles",
            Colour::Black,
            Mark::Circles,
            law.over_cycles.iter().map(place).collect(),
        ),
        line(
            "measured, tip slides evenly",
            Colour::Black,
            Mark::Joined(MarkerShape::Disc),
            law.even.iter().flat_map(|p| [place(p), None]).collect(),
        ),
    ];
    drawn.into_iter().filter(|s| !s.points.is_empty()).collect()
}

/// The axis of the coefficients: what is drawn, without points that lie far off the law.
fn coefficient_axis(law: &FrictionPlot) -> ChartAxis {
    const FAR: f64 = 0.5;
    const ROOM: f64 = 0.06;
    let axis = ChartAxis::linear("friction coefficient \u{b5}");
    let own = || law.curve.iter().chain(&law.truth).map(|p| p.1);
    let Some(mean) = own().reduce(f64::max).zip(own().reduce(f64::min)).map(|(a, b)| 0.5 * (a + b)) else {
        return axis;
    };
    let band = law.interval_95.iter().flat_map(|(_, low, high)| [*low, *high]);
    let points = law.even.iter().chain(&law.over_cycles).chain(&law.of_model).map(|p| p.1);
    let near = |v: &f64| (v - mean).abs() <= FAR * mean;
    let all = || own().chain(band.clone().chain(points.clone()).filter(near));
    let (Some(low), Some(high)) = (all().reduce(f64::min), all().reduce(f64::max)) else { return axis };
    let room = (ROOM * (high - low)).max(1e-3 * mean.abs()).max(f64::MIN_POSITIVE);
    axis.with_range(low - room, high + room)
}

fn interval_ribbon(law: &FrictionPlot) -> Option<Ribbon> {
    let points = law.interval_95.iter().map(|(v, low, high)| Some((v * MILLIMETRES, *low, *high))).collect();
    (!law.interval_95.is_empty()).then(|| Ribbon {
        label: "95 %, linear".to_owned(),
        colour: Colour::Vermilion,
        points,
    })
}

/// Corners of the histogram from the left.
fn histogram_corners(law: &FrictionPlot) -> impl Iterator<Item = (f64, f64)> {
    law.shares.iter().flat_map(|(from, to, share)| {
        [(from * MILLIMETRES, share * PERCENT), (to * MILLIMETRES, share * PERCENT)]
    })
}

fn histogram_ribbon(law: &FrictionPlot) -> Ribbon {
    Ribbon {
        label: String::new(),
        colour: Colour::Blue,
        points: histogram_corners(law).map(|(v, share)| Some((v, 0.0, share))).collect(),
    }
}

fn histogram_outline(law: &FrictionPlot) -> Series {
    Series {
        label: String::new(),
        colour: Colour::Blue,
        mark: Mark::Thin,
        points: histogram_corners(law).map(Some).collect(),
        ..Series::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law() -> FrictionPlot {
        FrictionPlot {
            curve: (0..=10).map(|i| (f64::from(i) * 0.1, 0.5 - 0.01 * f64::from(i))).collect(),
            visited: Some((0.15, 0.65)),
            even: vec![(0.2, 0.48)],
            shares: vec![(0.0, 0.5, 0.25), (0.5, 1.0, 0.75)],
            head: Some(0.3),
            ..FrictionPlot::default()
        }
    }

    #[test]
    fn the_law_is_strong_only_where_the_tip_moved() {
        let drawn = draw_figure(&law());
        let strong = &drawn.panels[0].series[1];
        assert_eq!((strong.points.len(), strong.points[0]), (5, Some((200.0, 0.48))));
        assert_eq!(drawn.panels[0].vertical_lines[0].at, 300.0);
        let never = draw_figure(&FrictionPlot { visited: None, ..law() });
        assert_eq!(
            never.panels[0].series.iter().map(|s| s.label.as_str()).collect::<Vec<_>>(),
            ["law", "measured, tip slides evenly"]
        );
    }

    #[test]
    fn an_interval_is_drawn_only_where_one_is_known() {
        assert!(draw_figure(&law()).panels[0].ribbons.is_empty());
        let known = FrictionPlot { interval_95: vec![(0.0, 0.4, 0.6), (1.0, 0.3, 0.5)], ..law() };
        assert_eq!(draw_figure(&known).panels[0].ribbons[0].points[1], Some((1000.0, 0.3, 0.5)));
    }

    #[test]
    fn the_histogram_is_in_per_cent_of_the_time_of_slip() {
        let bars = &draw_figure(&law()).panels[1].ribbons[0];
        assert_eq!(
            bars.points,
            [
                Some((0.0, 0.0, 25.0)),
                Some((500.0, 0.0, 25.0)),
                Some((500.0, 0.0, 75.0)),
                Some((1000.0, 0.0, 75.0))
            ]
        );
    }
}
