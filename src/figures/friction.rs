//! Stribeck curve: the fitted friction law against tip speed, friction measured from the recording, and the
//! fraction of slip time at each speed.

use super::{FigureBlock, FigureText};
use crate::compare::friction::{
    COEFFICIENTS, LawCoefficient, friction_half_95, is_fitted, measure_steady_friction,
};
use crate::compare::{ConditionComparison, FrictionPoint};
use crate::figures::full_figure;
use crate::fit::law::LawCandidate;
use crate::model::friction::FrictionLaw;
use crate::simulate::ModelSample;
use crate::simulate::mode::TipMode;
use crate::text::{format_digits, format_speed, join_with_and, pluralise};
use plain_charts::{ChartAxis, Colour, Figure, Mark, MarkerShape, Panel, Ribbon, Series, VerticalLine};
use serde::Serialize;

/// Friction coefficient of the fitted law at one speed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FrictionLine {
    /// Speed of the tip, m/s; zero means rest.
    pub speed_m_per_s: f64,
    /// Coefficient of friction.
    pub coefficient: f64,
    /// Half width of the 95 % interval of the coefficient; `None` if the fit does not determine it.
    pub half_95: Option<f64>,
}

/// Data of the figure; speeds in m/s.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FrictionPlot {
    /// Heading.
    pub title: String,
    /// Further text for the line under the heading; empty for none.
    pub note: String,
    /// Whether one of the recordings of the fit is synthetic.
    pub synthetic: bool,
    /// Fitted law: speeds, ascending, and coefficients.
    pub curve: Vec<(f64, f64)>,
    /// Smallest and largest speed of the tip while it slips during the run, m/s.
    pub visited: Option<(f64, f64)>,
    /// Speeds, each with the lower and upper end of the coefficient's 95 % interval; empty if there is no
    /// interval.
    pub interval_95: Vec<(f64, f64, f64)>,
    /// True law of a synthetic blade: speeds and coefficients; empty if unknown.
    pub truth: Vec<(f64, f64)>,
    /// Other laws that the recordings support: label, and speeds and coefficients of each.
    pub others: Vec<(String, Vec<(f64, f64)>)>,
    /// Speeds and coefficients measured while the recorded tip slides steadily.
    pub even: Vec<(f64, f64)>,
    /// Speed bins: lower edge, m/s, upper edge, m/s, and fraction of the slip time that the tip spends in the
    /// bin.
    pub shares: Vec<(f64, f64, f64)>,
    /// Mean speed of the head, m/s.
    pub head: Option<f64>,
}

/// Height, mm, of the panel with the friction law.
const HEIGHT_MM: f64 = 56.0;
/// Height, mm, of the panel with the fractions of slip time.
const SHARES_HEIGHT_MM: f64 = 26.0;
const MILLIMETRES: f64 = 1e3;
const PERCENT: f64 = 100.0;

/// Draws the figure.
#[must_use]
pub fn draw_figure(law: &FrictionPlot) -> Figure {
    let end = |take: fn(f64, f64) -> f64| law.curve.iter().map(|p| p.0 * MILLIMETRES).reduce(take);
    let speed = ChartAxis::linear("tip speed, mm/s").with_ends(end(f64::min).zip(end(f64::max)));
    let rule = |label: &str| {
        let of = |at: f64| VerticalLine::new(label, Colour::Blue, Mark::Dashed, at * MILLIMETRES);
        law.head.map(of).into_iter().collect()
    };
    let band = law.interval_95.iter().map(|(v, low, high)| (v * MILLIMETRES, *low, *high));
    let band = Ribbon::new("95 %, linear", Colour::Vermilion, band);
    let coefficient = Panel {
        ribbons: Some(band).filter(|band| !band.points.is_empty()).into_iter().collect(),
        vertical_lines: rule("mean speed of the head"),
        ..Panel::new(speed.clone(), coefficient_axis(law), HEIGHT_MM, law_series(law))
    };
    let corners = law
        .shares
        .iter()
        .flat_map(|(from, to, share)| [from, to].map(|v| (v * MILLIMETRES, share * PERCENT)));
    let outline = Series::new("", Colour::Blue, Mark::Thin, corners.clone());
    let shares = Panel {
        ribbons: vec![Ribbon::new("", Colour::Blue, corners.map(|(v, share)| (v, 0.0, share)))],
        vertical_lines: rule(""),
        ..Panel::new(speed, ChartAxis::linear("slip time, %"), SHARES_HEIGHT_MM, [outline])
    };
    full_figure(
        &law.title,
        law.synthetic,
        &law.note,
        "Friction coefficient over the speed of the tip, and the share of the time of slip at each speed."
            .to_owned(),
        [coefficient, shares],
    )
}

/// Curves and points: the law at all drawn speeds, the law at the speeds that occur in the run, the true law,
/// and the measured points.
fn law_series(law: &FrictionPlot) -> Vec<Series> {
    let series = |label: &str, colour, mark, points: &[(f64, f64)]| {
        Series::new(
            label,
            colour,
            mark,
            points.iter().map(|(v, coefficient)| (v * MILLIMETRES, *coefficient)),
        )
    };
    let inside = |p: &&(f64, f64)| law.visited.is_some_and(|(low, high)| p.0 >= low && p.0 <= high);
    let visited: Vec<_> = law.curve.iter().filter(inside).copied().collect();
    let even =
        series("measured, tip slides evenly", Colour::Black, Mark::Joined(MarkerShape::Disc), &law.even);
    let apart = even.points.iter().flat_map(|p| [*p, None]).collect();
    let drawn = [
        series("law", Colour::Grey, Mark::ThinDashed, &law.curve),
        series("law at speeds of the run", Colour::Vermilion, Mark::Thick, &visited),
        series("synthetic truth", Colour::Green, Mark::Dashed, &law.truth),
        Series { points: apart, ..even },
    ];
    let others = law.others.iter().zip([Colour::Purple, Colour::SkyBlue, Colour::Orange].into_iter().cycle());
    let others = others.map(|((label, points), colour)| series(label, colour, Mark::Dashed, points));
    drawn.into_iter().chain(others).filter(|s| !s.points.is_empty()).collect()
}

/// The axis of the coefficients; its range does not include points far from the law.
fn coefficient_axis(law: &FrictionPlot) -> ChartAxis {
    const FAR: f64 = 0.5;
    const ROOM: f64 = 0.06;
    let axis = ChartAxis::linear("friction coefficient \u{b5}");
    let others = || law.others.iter().flat_map(|(_, points)| points);
    let own = || law.curve.iter().chain(&law.truth).chain(others()).map(|p| p.1);
    let Some(mean) = own().reduce(f64::max).zip(own().reduce(f64::min)).map(|(a, b)| 0.5 * (a + b)) else {
        return axis;
    };
    let band = law.interval_95.iter().flat_map(|(_, low, high)| [*low, *high]);
    let points = law.even.iter().map(|p| p.1);
    let near = |v: &f64| (v - mean).abs() <= FAR * mean;
    let all = || own().chain(band.clone().chain(points.clone()).filter(near));
    let (Some(low), Some(high)) = (all().reduce(f64::min), all().reduce(f64::max)) else { return axis };
    let room = (ROOM * (high - low)).max(1e-3 * mean.abs()).max(f64::MIN_POSITIVE);
    axis.with_range(low - room, high + room)
}

// The friction law of a condition.

/// Number of intervals into which the drawn curve is divided.
const CURVE_POINTS: usize = 200;
/// Number of speed bins.
const SPEED_BINS: usize = 30;
/// Ratio of the highest drawn speed of the curve to the largest speed of the tip in the run.
const SPEED_MARGIN: f64 = 1.15;

/// The figure of a condition; `None` for a model that never slips.
pub(crate) fn figure_block(case: &ConditionComparison) -> Option<FigureBlock> {
    let law = case.model.scene.linkage.friction;
    let slips = slip_speeds(case);
    let (Some(slowest), Some(fastest)) = (slips.first(), slips.last()) else { return None };
    let (visited, top) = ((slowest.0, fastest.0), SPEED_MARGIN * fastest.0);
    let speeds: Vec<f64> = (0..=CURVE_POINTS).map(|i| top * i as f64 / CURVE_POINTS as f64).collect();
    let half = friction_half_95(case.job, case.result, &law);
    let curve =
        |law: FrictionLaw| speeds.iter().map(|v| (*v, law.dynamic_coefficient(*v, 1.0))).collect::<Vec<_>>();
    let band = |half: &dyn Fn(f64) -> f64| {
        curve(law)
            .into_iter()
            .map(|(v, coefficient)| (v, coefficient - half(v), coefficient + half(v)))
            .collect()
    };
    let measured = measure_steady_friction(case);
    let shown = FrictionPlot {
        title: claim_sentence(&law, fastest.0),
        note: case.heading_note("model at the estimates"),
        synthetic: case.is_synthetic(),
        curve: curve(law),
        visited: Some(visited),
        interval_95: half.as_deref().map_or_else(Vec::new, band),
        truth: true_law(case).map_or_else(Vec::new, curve),
        others: other_laws(case).into_iter().map(|(label, law)| (label, curve(law))).collect(),
        even: measured.iter().map(|p| (p.speed_m_per_s, p.coefficient)).collect(),
        shares: slip_time_shares(&slips, top),
        head: Some(mean_head_speed(case)),
    };
    let words = figure_text(case, &law, fastest.0, half.as_deref(), &measured);
    Some(case.figure_block("friction", words, draw_figure(&shown)))
}

/// The main result in one sentence, with its numbers.
fn claim_sentence(law: &FrictionLaw, fastest: f64) -> String {
    let (rest, moving) = (law.static_coefficient(1.0), law.dynamic_coefficient(fastest, 1.0));
    let [from, to] = [rest, moving].map(|coefficient| format_digits(coefficient, 3));
    if from == to {
        return format!("Friction stays at {from} up to {}", format_speed(fastest));
    }
    let how = if moving < rest { "falls" } else { "rises" };
    format!("Friction {how} from {from} at rest to {to} at {}", format_speed(fastest))
}

/// Other laws that the recordings support as well as that of the fit, or instead of it.
fn other_laws(case: &ConditionComparison) -> Vec<(String, FrictionLaw)> {
    let laws = case.result.law.iter().flat_map(|law| law.candidates.iter().skip(1));
    let drawn = |other: &LawCandidate| {
        Some((other.format_label(), other.friction_law(&case.model.scene, case.condition)?))
    };
    laws.filter(|other| other.possible).filter_map(drawn).collect()
}

/// The true law of a synthetic blade; `None` if the description of the recording contains none.
fn true_law(case: &ConditionComparison) -> Option<FrictionLaw> {
    let twin = case.measured.and_then(|m| m.file).and_then(|file| file.twin.as_ref())?;
    let known = twin.get("truth").and_then(toml::Value::as_table)?;
    let [a, b_s_per_m, c, viscous] = COEFFICIENTS.map(|c| known.get(c.name).and_then(toml::Value::as_float));
    let law = FrictionLaw::exponential(a?, b_s_per_m?, c?);
    Some(FrictionLaw { viscous_s_per_m: viscous.unwrap_or(0.0), ..law })
}

/// Speeds, ascending, and friction coefficients of the model's slip states.
fn slip_speeds(case: &ConditionComparison) -> Vec<(f64, f64)> {
    let slip =
        |s: &&ModelSample| matches!(s.mode, TipMode::SlipForward | TipMode::SlipBackward) && s.normal_n > 0.0;
    let place = |s: &ModelSample| (s.tip_velocity_m_per_s.abs(), s.friction_n.abs() / s.normal_n);
    let mut slips: Vec<(f64, f64)> = case.model.motion.samples.iter().filter(slip).map(place).collect();
    portable_math::sort_by_number(&mut slips, |a| a.0);
    slips
}

/// Friction coefficient at rest and at the largest speed of the tip.
pub(crate) fn friction_lines(case: &ConditionComparison) -> Vec<FrictionLine> {
    let law = case.model.scene.linkage.friction;
    let half = friction_half_95(case.job, case.result, &law);
    let speeds = std::iter::once(0.0).chain(slip_speeds(case).last().map(|(fastest, _)| *fastest));
    let line = |speed_m_per_s: f64| FrictionLine {
        speed_m_per_s,
        coefficient: law.dynamic_coefficient(speed_m_per_s, 1.0),
        half_95: half.as_ref().map(|half| half(speed_m_per_s)),
    };
    speeds.map(line).collect()
}

/// Fraction of the slip time in each speed bin; the states are equally spaced in time.
fn slip_time_shares(slips: &[(f64, f64)], top: f64) -> Vec<(f64, f64, f64)> {
    let below = |v: f64| slips.partition_point(|s| s.0 < v) as f64;
    let edge = |i: usize| top * i as f64 / SPEED_BINS as f64;
    (0..SPEED_BINS)
        .map(|i| (edge(i), edge(i + 1), (below(edge(i + 1)) - below(edge(i))) / slips.len() as f64))
        .collect()
}

/// Mean speed (magnitude) of the head during the run, m/s.
fn mean_head_speed(case: &ConditionComparison) -> f64 {
    let samples = &case.model.motion.samples;
    let speed = |s: &ModelSample| case.model.scene.drive.motion_at(s.time_s).velocity_m_per_s.abs();
    samples.iter().map(speed).sum::<f64>() / samples.len().max(1) as f64
}

/// Caption: the claim, how far measured points lie from the law, and the uncertainty of the law.
fn figure_text(
    case: &ConditionComparison,
    law: &FrictionLaw,
    fastest: f64,
    half: Option<&(dyn Fn(f64) -> f64 + '_)>,
    measured: &[FrictionPoint],
) -> FigureText {
    let even = largest_deviation(law, measured).map_or_else(String::new, |(count, off)| {
        let points = pluralise("point", count);
        format!(
            "; {count} {points} measured where the tip slides evenly lie within {} of it",
            format_digits(off, 2)
        )
    });
    let others: Vec<String> = other_laws(case).into_iter().map(|(label, _)| format!("the {label}")).collect();
    let fits_own = case.result.law.iter().any(|law| law.candidates.first().is_some_and(|own| own.possible));
    let others = match (others.len(), fits_own) {
        (0, _) => String::new(),
        (_, true) => format!(" The recording does not exclude {}.", join_with_and(&others)),
        (_, false) => format!(" It fits clearly worse than {}.", join_with_and(&others)),
    };
    let caption = format!("{} in the law of the fitted model{even}.{others}", claim_sentence(law, fastest));
    FigureText { caption, details: describe_uncertainty(case, half).unwrap_or_default() }
}

/// Number of points and their largest deviation from the law; `None` without points.
fn largest_deviation(law: &FrictionLaw, points: &[FrictionPoint]) -> Option<(usize, f64)> {
    let off = |p: &FrictionPoint| (p.coefficient - law.dynamic_coefficient(p.speed_m_per_s, 1.0)).abs();
    points.iter().map(off).reduce(f64::max).map(|most| (points.len(), most))
}

/// Sentence on the uncertainty of the law at rest; `None` if no coefficient was fitted.
fn describe_uncertainty(
    case: &ConditionComparison,
    half: Option<&(dyn Fn(f64) -> f64 + '_)>,
) -> Option<String> {
    let free: Vec<&LawCoefficient> = COEFFICIENTS.iter().filter(|c| is_fitted(case.job, c)).collect();
    if free.is_empty() {
        return None;
    }
    if let Some(half) = half {
        return Some(format!("At rest the law is known to \u{b1}{} (95 %).", format_digits(half(0.0), 2)));
    }
    let is_open = |c: &LawCoefficient| case.result.parameters.get(c.name).is_none_or(|p| !p.has_interval());
    let open: Vec<&LawCoefficient> = free.iter().copied().filter(|c| is_open(c)).collect();
    // the linear model may determine each of the coefficients but not their correlation
    let which = if open.is_empty() { &free } else { &open };
    let symbols = join_with_and(&which.iter().map(|c| c.symbol.to_owned()).collect::<Vec<_>>());
    Some(format!("The data do not fix {symbols}, so the law has no interval."))
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
    fn other_laws_are_drawn_with_their_names() {
        let other = ("rational law".to_owned(), vec![(0.0, 0.5), (1.0, 0.2)]);
        let drawn = draw_figure(&FrictionPlot { others: vec![other], ..law() });
        let last = drawn.panels[0].series.last().unwrap();
        assert_eq!((last.label.as_str(), last.points[1]), ("rational law", Some((1000.0, 0.2))));
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
