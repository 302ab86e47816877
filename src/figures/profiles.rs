//! Profile likelihoods: rise of the cost along each parameter while the other parameters are refitted, and
//! the confidence intervals from it.

use super::figure_text::parameter_symbol;
use crate::compare::ParameterLine;
use crate::figures::{Drawing, FigureBlock, about, full_figure, subtitle};
use crate::fit::job::{FreeParameter, Job};
use crate::fit::profile::AT_BOUND;
use crate::fit::result::{FitResult, ParameterResult};
use crate::fit::uncertainty::ParameterVerdict;
use crate::text::{choose_prefix, label_with_unit};
use plain_charts::{
    ChartAxis, Colour, ErrorBar, Figure, Mark, MarkerShape, Panel, Series, ShadedSpan, VerticalLine,
    value_span,
};

/// Profile and intervals of one parameter, in its SI unit.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterProfile {
    /// Symbol in the equations, or the parameter's name if it has no symbol.
    pub symbol: String,
    /// Unit; empty or `1` for a plain number.
    pub unit: String,
    /// Verdict on the parameter.
    pub verdict: ParameterVerdict,
    /// Bounds of the search.
    pub bounds: (f64, f64),
    /// Estimate.
    pub estimate: f64,
    /// True value, if the data are synthetic.
    pub truth: Option<f64>,
    /// Values of the parameter, ascending, each with the rise of the least cost at that value above the least
    /// cost of all.
    pub points: Vec<(f64, f64)>,
    /// Values of the parameter, each with the rise of the cost that the linear model at the estimate
    /// predicts; empty if that model does not determine the parameter.
    pub linear: Vec<(f64, f64)>,
    /// The 95 % interval that the page states; `None` for an open end.
    pub stated: [Option<f64>; 2],
    /// 95 % intervals from the profile, the linear model and the bootstrap; `None` for an open end.
    pub intervals: [Option<[Option<f64>; 2]>; 3],
}

/// Data of the figure.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ProfilePlot {
    /// Heading.
    pub title: String,
    /// Whether the data are synthetic.
    pub synthetic: bool,
    /// Least cost.
    pub least_cost: f64,
    /// Rise of the cost at the ends of a 95 % interval.
    pub threshold: f64,
    /// The parameters, in the order of the job.
    pub parameters: Vec<ParameterProfile>,
}

/// Height of a panel, mm.
const HEIGHT_MM: f64 = 29.0;
/// Upper end of the axis of the cost rise, in units of the threshold of the 95 % interval; values with a
/// higher cost are excluded anyway.
const SHOWN: f64 = 3.0;
/// Name of the stated interval, and the height at which it is drawn, in units of the threshold.
const STATED: (&str, f64) = ("95 % interval, as stated", 1.2);
/// Name, colour, symbol and height, in units of the threshold, of the other intervals. They are drawn between
/// the two branches of the profile.
const INTERVALS: [(&str, Colour, MarkerShape, f64); 3] = [
    ("profile", Colour::Blue, MarkerShape::Disc, 1.6),
    ("linear model", Colour::Orange, MarkerShape::Square, 2.05),
    ("bootstrap", Colour::Green, MarkerShape::Diamond, 2.5),
];
/// Margin on either side of the x axis, as a fraction of its width.
const ROOM: f64 = 0.06;

impl ProfilePlot {
    /// The profiles of a fit; `lines` contain units and true values.
    pub(crate) fn from_fit(job: &Job, result: &FitResult, lines: &[ParameterLine]) -> Self {
        let parameters = job.parameters.iter().filter_map(|free| parameter_profile(free, result, lines));
        Self {
            title: job.title.clone(),
            synthetic: result.synthetic,
            least_cost: result.cost,
            threshold: result.threshold,
            parameters: parameters.collect(),
        }
    }

    /// The figure with its caption; `None` if no parameter has a profile.
    pub(crate) fn figure_block(&self) -> Option<FigureBlock> {
        let figure = draw_figure(self);
        (!figure.panels.is_empty()).then(|| FigureBlock {
            condition: None,
            file: "profiles.svg".to_owned(),
            caption: figure_caption(self),
            details: figure_details(self),
            drawing: Drawing::Chart(figure),
        })
    }
}

fn parameter_profile(
    parameter: &FreeParameter,
    result: &FitResult,
    lines: &[ParameterLine],
) -> Option<ParameterProfile> {
    let found = result.parameters.get(&parameter.name)?;
    let line = lines.iter().find(|line| line.name == parameter.name);
    Some(ParameterProfile {
        symbol: parameter_symbol(&parameter.name),
        unit: line.map(|line| line.unit.clone()).unwrap_or_default(),
        verdict: found.verdict,
        bounds: (parameter.bounds.lower(), parameter.bounds.upper()),
        estimate: found.estimate,
        truth: line.and_then(|line| line.truth).map(|truth| truth.value),
        points: found.profile.iter().map(|(value, cost)| (*value, cost - result.cost)).collect(),
        linear: linear_model_parabola(parameter, found, result.threshold),
        stated: [found.lower_95, found.upper_95],
        intervals: [
            Some(closed_interval(parameter, found)),
            found.linear_95.map(|ends| ends.map(Some)),
            found.bootstrap_95.map(|ends| ends.map(Some)),
        ],
    })
}

/// Number of intervals of a parabola; enough for a smooth line in a panel of 70 mm.
const PARABOLA: u32 = 60;

/// Ends of the profile's interval. An end at a bound counts as open, since values beyond the bound were not
/// tried.
fn closed_interval(parameter: &FreeParameter, found: &ParameterResult) -> [Option<f64>; 2] {
    let inside = |end: &f64| (AT_BOUND..=1.0 - AT_BOUND).contains(&parameter.bounds.unit_coordinate(*end));
    found.profile_95.map(|end| end.filter(inside))
}

/// Ratio of the half width of the drawn parabola to that of the 95 % interval of the linear model; large
/// enough that the parabola reaches the top of the axes.
const REACH: f64 = 2.0;

/// Rise of the cost according to the linear model: a parabola in the search scale that crosses the threshold
/// at the ends of the linear interval. One end may have been cut at a bound, so the parabola uses the longer
/// half of the interval; empty if both ends are at bounds.
fn linear_model_parabola(
    parameter: &FreeParameter,
    found: &ParameterResult,
    threshold: f64,
) -> Vec<(f64, f64)> {
    let bounds = &parameter.bounds;
    let within = |ends: &[f64; 2]| ends[0] > bounds.lower() || ends[1] < bounds.upper();
    let Some(ends) = found.linear_95.filter(within) else { return Vec::new() };
    let centre = bounds.unit_coordinate(found.estimate);
    let half = ends.map(|end| (bounds.unit_coordinate(end) - centre).abs()).into_iter().fold(0.0, f64::max);
    if half <= 0.0 {
        return Vec::new();
    }
    let offsets = (0..=PARABOLA).map(|i| REACH * (2.0 * f64::from(i) / f64::from(PARABOLA) - 1.0));
    let inside = offsets.filter(|offset| (0.0..=1.0).contains(&(centre + offset * half)));
    inside.map(|offset| (bounds.value_at_unit(centre + offset * half), threshold * offset * offset)).collect()
}

/// Draws the figure; it has no panels if no parameter has a profile.
#[must_use]
pub fn draw_figure(shown: &ProfilePlot) -> Figure {
    Figure {
        columns: 2,
        subtitle: about(&shown.title, &subtitle(shown.synthetic, "")),
        ..full_figure(
            &claim_sentence(shown),
            shown.synthetic,
            "",
            "Rise of the cost along each parameter with the others refitted, against the 95 % threshold."
                .to_owned(),
            drawn_profiles(shown).into_iter().map(|p| draw_panel(shown, p)),
        )
    }
}

fn draw_panel(shown: &ProfilePlot, profile: &ParameterProfile) -> Panel {
    let top = SHOWN * shown.threshold;
    let (low, high) = x_limits(profile, top);
    let (unit, factor) = choose_prefix(&profile.unit, [low, high]);
    let (low, high) = (low * factor, high * factor);
    let line = |label: &str, colour, mark, points: &[(f64, f64)]| {
        Series::new(label, colour, mark, points.iter().map(|(x, y)| Some((x * factor, *y))))
    };
    let level = [(low / factor, shown.threshold), (high / factor, shown.threshold)];
    let mut series = vec![
        line("95 % threshold", Colour::Grey, Mark::Dashed, &level),
        line("cost by the linear model", Colour::Orange, Mark::ThinDashed, &profile.linear),
        line("cost, others refitted", Colour::Blue, Mark::Joined(MarkerShape::Disc), &profile.points),
    ];
    series.retain(|s| !s.points.is_empty());
    let bars = INTERVALS.iter().zip(profile.intervals);
    let bar = |(look, ends): (_, Option<_>)| {
        interval_bar(shown, look, ends?, profile.estimate, factor, (low, high))
    };
    series.extend(bars.filter_map(bar));
    series.extend(stated_interval_line(shown, profile, factor, (low, high)));
    let truth = |at| VerticalLine::new("synthetic truth", Colour::Vermilion, Mark::Line, at * factor);
    let x = ChartAxis::linear(label_with_unit(&profile.symbol, &unit)).with_range(low, high);
    let y = ChartAxis::linear("rise of the cost").with_range(-0.04 * top, top);
    Panel {
        title: title_word(profile.verdict),
        shaded_spans: out_of_bounds_spans(profile, factor, (low, high)),
        vertical_lines: profile.truth.map(truth).into_iter().collect(),
        ..Panel::new(x, y, HEIGHT_MM, series)
    }
}

/// The stated interval as a thick line; an open end extends beyond the axes. `None` if both ends are open.
fn stated_interval_line(
    shown: &ProfilePlot,
    profile: &ParameterProfile,
    factor: f64,
    (low, high): (f64, f64),
) -> Option<Series> {
    let (label, height) = STATED;
    let ([lower, upper], beyond) = (profile.stated, high - low);
    let end = |end: Option<f64>, open: f64| end.map_or(open, |value| value * factor);
    lower.or(upper)?;
    let ends = [end(lower, low - beyond), end(upper, high + beyond)];
    Some(Series::new(label, Colour::Black, Mark::Thick, ends.map(|end| (end, height * shown.threshold))))
}

/// An interval as a bar with a symbol at the estimate; an open end extends beyond the axes. `None` if both
/// ends are open.
fn interval_bar(
    shown: &ProfilePlot,
    (name, colour, shape, height): &(&str, Colour, MarkerShape, f64),
    [lower, upper]: [Option<f64>; 2],
    estimate: f64,
    factor: f64,
    (low, high): (f64, f64),
) -> Option<Series> {
    lower.or(upper)?;
    let (y, beyond) = (height * shown.threshold, high - low);
    let end = |end: Option<f64>, open: f64| end.map_or(open, |value| value * factor);
    Some(Series {
        error_bars: vec![ErrorBar::Horizontal {
            y,
            from: end(lower, low - beyond),
            to: end(upper, high + beyond),
        }],
        ..Series::new(
            format!("95 % by {name}"),
            *colour,
            Mark::Hollow(*shape),
            [Some((estimate * factor, y))],
        )
    })
}

/// Shaded spans over those parts of the x axis that are outside the bounds of the search.
fn out_of_bounds_spans(profile: &ParameterProfile, factor: f64, (low, high): (f64, f64)) -> Vec<ShadedSpan> {
    let (lower, upper) = (profile.bounds.0 * factor, profile.bounds.1 * factor);
    let band = |from, to| ShadedSpan::new("out of bounds", Colour::Grey, from, to);
    let outside = [(low, lower), (upper, high)].into_iter().filter(|(from, to)| from < to);
    outside.map(|(from, to)| band(from, to)).collect()
}

/// Ends of the x axis: they enclose the shown profile, the intervals and the true value, with a margin.
fn x_limits(profile: &ParameterProfile, top: f64) -> (f64, f64) {
    let rises = |at: usize| profile.points.get(at).is_some_and(|(_, rise)| *rise <= top);
    // a point above the top counts if one of its neighbours lies below the top
    let reached = |at: usize| rises(at) || at.checked_sub(1).is_some_and(rises) || rises(at + 1);
    let inside = profile.points.iter().enumerate().filter(|(at, _)| reached(*at));
    let inside =
        inside.map(|(at, point)| if rises(at) { point.0 } else { crossing_at_top(profile, at, *point, top) });
    let intervals = profile.intervals.iter().flatten().flatten().chain(&profile.stated).flatten().copied();
    let all =
        inside.chain(intervals).chain(profile.truth).chain([profile.estimate]).filter(|v| v.is_finite());
    let (low, high) = value_span(all);
    let room = if high > low { ROOM * (high - low) } else { (ROOM * high.abs()).max(f64::MIN_POSITIVE) };
    (low - room, high + room)
}

/// Value of the parameter at which the profile crosses the top of the axes, interpolated between a point
/// above the top and its neighbour below it.
fn crossing_at_top(profile: &ParameterProfile, at: usize, (value, rise): (f64, f64), top: f64) -> f64 {
    let neighbours =
        [at.checked_sub(1), at.checked_add(1)].into_iter().flatten().filter_map(|i| profile.points.get(i));
    let crossing = |(x, y): &(f64, f64)| x + (top - y) / (rise - y) * (value - x);
    let inside = neighbours.filter(|(_, y)| *y <= top).map(crossing);
    inside
        .reduce(|a, b| if (a - profile.estimate).abs() > (b - profile.estimate).abs() { a } else { b })
        .unwrap_or(value)
}

/// Caption: contents of the figure, and its main number.
pub(crate) fn figure_caption(shown: &ProfilePlot) -> String {
    format!("Rise of the cost along each parameter while the others are refitted: {}.", claim_sentence(shown))
}

/// The main result in one sentence, with its numbers.
fn claim_sentence(shown: &ProfilePlot) -> String {
    let drawn = drawn_profiles(shown);
    let (count, all) = (drawn.iter().filter(|p| is_closed(p)).count(), drawn.len());
    format!("{count} of {all} profiles cross the 95 % threshold on both sides")
}

/// Sentence on lines that rise over the threshold on an open side; empty if there is none.
pub(crate) fn figure_details(shown: &ProfilePlot) -> String {
    let open = drawn_profiles(shown).iter().any(|p| is_open_but_rising(p, shown.threshold));
    let said = "Where a line rises over the threshold on an open side, a parameter has reached a bound of the \
                search.";
    if open { said.to_owned() } else { String::new() }
}

fn drawn_profiles(shown: &ProfilePlot) -> Vec<&ParameterProfile> {
    shown.parameters.iter().filter(|p| !p.points.is_empty()).collect()
}

fn title_word(verdict: ParameterVerdict) -> String {
    verdict.name().replace('-', " ")
}

/// Whether both ends of the interval from the profile are known.
fn is_closed(profile: &ParameterProfile) -> bool {
    profile.intervals[0].is_some_and(|ends| ends.iter().all(Option::is_some))
}

/// Whether the interval is open on a side on which the cost nevertheless exceeds the threshold.
fn is_open_but_rising(profile: &ParameterProfile, threshold: f64) -> bool {
    let [lower, upper] = profile.intervals[0].unwrap_or_default();
    let rises = |below: bool| {
        profile.points.iter().any(|(value, rise)| (*value < profile.estimate) == below && *rise > threshold)
    };
    (lower.is_none() && rises(true)) || (upper.is_none() && rises(false))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::bounds::{Bounds, BoundsSpacing};
    use plain_charts::Medium;

    fn profile() -> ParameterProfile {
        ParameterProfile {
            symbol: "k1".to_owned(),
            unit: "N m/rad".to_owned(),
            bounds: (1e-3, 2.2e-3),
            estimate: 2e-3,
            truth: Some(1.9e-3),
            points: vec![(1.0e-3, 20.0), (1.8e-3, 4.0), (2e-3, 0.0), (2.2e-3, 1.0)],
            stated: [Some(1.81e-3), None],
            intervals: [Some([Some(1.81e-3), None]), None, None],
            verdict: ParameterVerdict::OpenAbove,
            linear: Vec::new(),
        }
    }

    fn example_profiles() -> ProfilePlot {
        ProfilePlot {
            title: "t".to_owned(),
            least_cost: 0.5,
            threshold: 4.0,
            parameters: vec![profile()],
            ..ProfilePlot::default()
        }
    }

    #[test]
    fn the_axis_ends_where_the_line_leaves_the_panel() {
        // the line from (1.8e-3, 4) to (1e-3, 20) reaches 12 halfway, at 1.4e-3
        let (low, high) = x_limits(&profile(), 12.0);
        let room = ROOM * (2.2e-3 - 1.4e-3);
        assert!(
            (low - (1.4e-3 - room)).abs() < 1e-12 && (high - (2.2e-3 + room)).abs() < 1e-12,
            "{low} {high}"
        );
    }

    #[test]
    fn an_open_interval_runs_out_and_the_bound_is_shaded() {
        let panel = draw_panel(&example_profiles(), &profile());
        assert_eq!(panel.x.label, "k1, mN m/rad");
        let (_, high) = panel.x.range.unwrap();
        let bar = panel.series.iter().flat_map(|s| &s.error_bars).next().unwrap();
        assert!(
            matches!(bar, ErrorBar::Horizontal { from, to, .. } if (from - 1.81).abs() < 1e-12 && *to > high)
        );
        assert_eq!(panel.shaded_spans.iter().map(|b| b.from).collect::<Vec<_>>(), [2.2]);
        assert!((panel.vertical_lines[0].at - 1.9).abs() < 1e-12);
    }

    #[test]
    fn the_caption_counts_the_closed_intervals() {
        let caption = figure_caption(&example_profiles());
        assert!(caption.contains("0 of 1 profiles cross"), "{caption}");
    }

    #[test]
    fn the_details_explain_a_rise_on_an_open_side() {
        assert_eq!(figure_details(&example_profiles()), "");
        let mut rising = example_profiles();
        rising.parameters[0].points.push((2.21e-3, 9.0));
        assert!(figure_details(&rising).contains("on an open side"));
    }

    #[test]
    fn the_thick_line_is_the_interval_of_the_result() {
        let job = include_str!("../../fits/published-simulation/job.toml");
        let result = include_str!("../../fits/published-simulation/result.json");
        let (job, result) =
            (Job::parse("job.toml", job).unwrap(), FitResult::parse("result.json", result).unwrap());
        let shown = ProfilePlot::from_fit(&job, &result, &[]);
        let (mut closed, mut open) = (0, 0);
        for (free, profile) in job.parameters.iter().zip(&shown.parameters) {
            let found = &result.parameters[&free.name];
            assert_eq!(profile.stated, [found.lower_95, found.upper_95], "{}", free.name);
            let line = draw_panel(&shown, profile).series.into_iter().find(|s| s.label == STATED.0);
            let (low, high) = draw_panel(&shown, profile).x.range.unwrap();
            for (point, end) in line.unwrap().points.iter().zip([found.lower_95, found.upper_95]) {
                let at = point.unwrap().0;
                if let Some(end) = end {
                    assert!((at / end - 1.0).abs() < 1e-12, "{}: {at} {end}", free.name);
                    closed += 1;
                } else {
                    assert!(at < low || at > high, "{}: {at}", free.name);
                    open += 1;
                }
            }
        }
        assert!(closed > 2 && open > 0, "{closed} {open}");
    }

    #[test]
    fn parameters_without_a_profile_have_no_panel() {
        let none = ProfilePlot {
            parameters: vec![ParameterProfile { points: Vec::new(), ..profile() }],
            ..example_profiles()
        };
        assert!(draw_figure(&none).panels.is_empty());
        assert!(draw_figure(&example_profiles()).to_svg(Medium::Column).contains("95 % threshold"));
    }

    fn free(spacing: BoundsSpacing) -> FreeParameter {
        FreeParameter {
            name: "friction.a".to_owned(),
            bounds: Bounds::new(0.1, 1.0, spacing).unwrap(),
            prior: None,
        }
    }

    fn found(estimate: f64, linear_95: Option<[f64; 2]>) -> ParameterResult {
        ParameterResult {
            estimate,
            lower_95: None,
            upper_95: Some(0.9),
            verdict: ParameterVerdict::OpenBelow,
            linear_95,
            profile_95: [Some(0.1), Some(0.8)],
            bootstrap_95: None,
            profile: Vec::new(),
            reasons: Vec::new(),
        }
    }

    /// Rise of the cost at the point of a parabola that is nearest to a value of the parameter.
    fn at(parabola: &[(f64, f64)], value: f64) -> f64 {
        parabola.iter().min_by(|a, b| (a.0 - value).abs().total_cmp(&(b.0 - value).abs())).unwrap().1
    }

    #[test]
    fn the_parabola_meets_the_threshold_at_the_ends_of_the_linear_interval() {
        let linear = linear_model_parabola(&free(BoundsSpacing::Linear), &found(0.5, Some([0.4, 0.6])), 4.0);
        let log = linear_model_parabola(&free(BoundsSpacing::Log), &found(0.4, Some([0.32, 0.5])), 4.0);
        for (parabola, ends) in [(linear, [0.4, 0.5, 0.6]), (log, [0.32, 0.4, 0.5])] {
            let rises = ends.map(|end| at(&parabola, end));
            assert!(
                rises.iter().zip([4.0, 0.0, 4.0]).all(|(found, expected)| (found - expected).abs() < 1e-9),
                "{rises:?}"
            );
        }
    }

    #[test]
    fn an_end_that_a_bound_cut_does_not_narrow_the_parabola() {
        let cut = linear_model_parabola(&free(BoundsSpacing::Linear), &found(0.2, Some([0.1, 0.4])), 4.0);
        assert!((at(&cut, 0.4) - 4.0).abs() < 1e-9 && at(&cut, 0.1) < 1.1, "{cut:?}");
        assert!(
            linear_model_parabola(&free(BoundsSpacing::Linear), &found(0.2, Some([0.1, 1.0])), 4.0)
                .is_empty()
        );
        assert!(linear_model_parabola(&free(BoundsSpacing::Linear), &found(0.2, None), 4.0).is_empty());
    }

    #[test]
    fn an_end_at_a_bound_is_open_in_the_figure() {
        assert_eq!(closed_interval(&free(BoundsSpacing::Linear), &found(0.5, None)), [None, Some(0.8)]);
    }
}
