//! Phase portraits: deflection against the velocity of the tip, measured against model.

use super::chart::{Axis, Colour, FULL_WIDTH_MM, Figure, Mark, Panel, Series};
use super::subtitle;

/// A point of the motion: deflection, m, and velocity of the tip, m/s; `None` interrupts it.
pub type State = Option<(f64, f64)>;

/// A part of the motion.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Part {
    /// What tells it from the others.
    pub name: String,
    /// Measured states in order of time; empty for none.
    pub measured: Vec<State>,
    /// States of the model in order of time.
    pub model: Vec<State>,
    /// Whether the states are too far apart for a line from one to the next to say anything.
    pub apart: bool,
}

/// What a portrait shows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Portrait {
    /// Heading.
    pub title: String,
    /// More to say; empty for none.
    pub note: String,
    /// Whether the measured motion is one that no camera took.
    pub synthetic: bool,
    /// The parts, side by side.
    pub parts: Vec<Part>,
}

/// Height of a panel, mm: as high as it is wide where two stand side by side.
const HEIGHT_MM: f64 = 62.0;
const MILLIMETRES: f64 = 1e3;

/// The figure.
#[must_use]
pub fn figure(shown: &Portrait) -> Figure {
    Figure {
        title: shown.title.clone(),
        subtitle: subtitle(shown.synthetic, &shown.note),
        description: "Phase portrait: velocity of the tip over deflection.".to_owned(),
        width_mm: FULL_WIDTH_MM,
        columns: 2,
        panels: shown.parts.iter().map(panel).collect(),
    }
}

fn panel(part: &Part) -> Panel {
    let [of_model, of_recording] = if part.apart { [Mark::Crosses, Mark::Circles] } else { [Mark::Line, Mark::Thin] };
    let looks = [("model", Colour::Vermilion, of_model, &part.model), ("measured", Colour::Black, of_recording, &part.measured)];
    let single = if part.apart { ", single frames" } else { "" };
    let scaled = |points: &[State]| points.iter().map(|p| p.map(|(x, v)| (x * MILLIMETRES, v * MILLIMETRES))).collect();
    let series = looks.into_iter().filter(|(.., points)| !points.is_empty()).map(|(label, colour, mark, points)| Series {
        label: format!("{label}{single}"),
        colour,
        mark,
        points: scaled(points),
        ..Series::default()
    });
    let (low, high) = ends(part);
    Panel {
        title: part.name.clone(),
        x: Axis::linear("deflection, mm").between(low, high),
        y: Axis::linear("tip velocity, mm/s"),
        height_mm: HEIGHT_MM,
        series: series.collect(),
        ..Panel::default()
    }
}

/// Ends of the axis of the deflection, mm: every part has its own, also where the parts stand one below the other.
fn ends(part: &Part) -> (f64, f64) {
    const ROOM: f64 = 0.05;
    const LEAST_SPAN: f64 = 1e-4; // of the values: less is rounding, and labels would have no digits for it
    let all = part.measured.iter().chain(&part.model).flatten().map(|(x, _)| x * MILLIMETRES).filter(|x| x.is_finite());
    let (low, high) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
    let room = (ROOM * (high - low)).max(LEAST_SPAN * low.abs().max(high.abs()));
    (low - room, high + room)
}

/// Deflection and velocity of the tip in every frame but the first and the last, the velocity by the difference of the two frames beside it;
/// `None` where one of the three is missing. White noise of the tip of standard deviation s becomes one of `s rate / sqrt(2)`.
#[must_use]
pub fn states(deflection_m: &[Option<f64>], tip_x_m: &[Option<f64>], frame_rate_hz: f64) -> Vec<State> {
    let middle = |(deflection, tip): (&Option<f64>, &[Option<f64>])| match *tip {
        [Some(before), _, Some(after)] => deflection.map(|x| (x, (after - before) * frame_rate_hz / 2.0)),
        _ => None,
    };
    deflection_m.iter().skip(1).zip(tip_x_m.windows(3)).map(middle).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::chart::Medium;

    #[test]
    fn the_velocity_is_the_central_difference_and_gaps_stay_gaps() {
        let tip: Vec<Option<f64>> = (0..8).map(|i| (i != 4).then(|| f64::from(i * i))).collect();
        let deflection: Vec<Option<f64>> = (0..8).map(|i| (i != 2).then(|| f64::from(i))).collect();
        let expected = [Some((1.0, 20.0)), None, None, Some((4.0, 80.0)), None, Some((6.0, 120.0))];
        assert_eq!(states(&deflection, &tip, 10.0), expected);
        assert_eq!(states(&[Some(0.0); 2], &[Some(0.0); 2], 10.0), []);
    }

    #[test]
    fn noise_of_the_velocity_is_that_of_the_position_times_the_rate_over_the_root_of_two() {
        let mut state = 7_u64;
        let tip: Vec<Option<f64>> = (0..20_000)
            .map(|_| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                Some(((state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5) * 12.0_f64.sqrt())
            })
            .collect();
        let squares: Vec<f64> = states(&tip, &tip, 5000.0).into_iter().flatten().map(|(_, v)| v * v).collect();
        let sd = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        assert!((sd / (5000.0 / 2.0_f64.sqrt()) - 1.0).abs() < 0.03, "{sd}");
    }

    #[test]
    fn parts_stand_side_by_side_and_what_was_not_measured_has_no_entry() {
        let part = Part { name: "late".to_owned(), model: vec![Some((1e-3, 0.1)), Some((2e-3, 0.2))], ..Part::default() };
        let drawn = figure(&Portrait { parts: vec![part.clone(), part], synthetic: true, ..Portrait::default() });
        assert_eq!((drawn.panels.len(), drawn.columns), (2, 2));
        assert_eq!(drawn.panels[0].series[0].mark, Mark::Line);
        assert_eq!(
            figure(&Portrait { parts: vec![Part { apart: true, model: vec![Some((1e-3, 0.1))], ..Part::default() }], ..Portrait::default() }).panels[0].series
                [0]
            .mark,
            Mark::Crosses
        );
        let svg = drawn.svg(Medium::Screen);
        assert!(svg.contains("synthetic recording") && svg.contains("\nmodel\n") && !svg.contains("\nmeasured\n"));
    }
}
