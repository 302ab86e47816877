//! Profile likelihoods: how far the cost rises along each parameter while the others follow, with the
//! intervals that are read from it.

use super::chart::{Axis, Band, Bar, Colour, FULL_WIDTH_MM, Figure, Mark, Panel, Rule, Series, Shape};
use super::{about, subtitle};
use crate::text::{listed, short, unit, with_unit};

/// Verdict on a parameter of which the features say nothing alone.
pub const NOT_IDENTIFIED: &str = "not identified";

/// What is known of one parameter, in its own SI unit.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Profile {
    /// Symbol in the equations, or its name where it has none.
    pub symbol: String,
    /// Unit; empty or `1` for a plain number.
    pub unit: String,
    /// What is known, in a word.
    pub verdict: String,
    /// Bounds of the search.
    pub bounds: (f64, f64),
    /// Estimate.
    pub estimate: f64,
    /// True value, where the data are synthetic.
    pub truth: Option<f64>,
    /// Values along the parameter, ascending, and the lowest cost that the others reach there, over the
    /// least.
    pub points: Vec<(f64, f64)>,
    /// The same by the linear model at the estimate; empty where it does not determine the parameter.
    pub linear: Vec<(f64, f64)>,
    /// 95 % intervals by the profile, the linear model and refitted twins; `None` for an open end.
    pub intervals: [Option<[Option<f64>; 2]>; 3],
}

/// What the figure shows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Profiles {
    /// Heading.
    pub title: String,
    /// Whether the data are synthetic.
    pub synthetic: bool,
    /// Least cost.
    pub least_cost: f64,
    /// Rise in cost that bounds a 95 % interval.
    pub threshold: f64,
    /// One a parameter.
    pub parameters: Vec<Profile>,
}

/// Height of a panel, mm.
const HEIGHT_MM: f64 = 29.0;
/// Thresholds over which the cost is shown: what rises higher is excluded anyway.
const SHOWN: f64 = 3.0;
/// Names and looks of the intervals, and their heights in thresholds: in the cup of the profile, where no
/// line is.
const INTERVALS: [(&str, Colour, Shape, f64); 3] = [
    ("profile", Colour::Blue, Shape::Disc, 1.6),
    ("linear model", Colour::Orange, Shape::Square, 2.05),
    ("bootstrap", Colour::Green, Shape::Diamond, 2.5),
];
/// Room beside what is shown, as a share of its width.
const ROOM: f64 = 0.06;

/// The figure; one without panels where no parameter has a profile.
#[must_use]
pub fn figure(shown: &Profiles) -> Figure {
    Figure {
        title: "Profile likelihoods".to_owned(),
        subtitle: about(&shown.title, &subtitle(shown.synthetic, "")),
        description:
            "Rise of the cost along each parameter with the others refitted, against the 95 % threshold."
                .to_owned(),
        width_mm: FULL_WIDTH_MM,
        columns: 2,
        panels: shown.parameters.iter().filter(|p| !p.points.is_empty()).map(|p| panel(shown, p)).collect(),
    }
}

fn panel(shown: &Profiles, profile: &Profile) -> Panel {
    let top = SHOWN * shown.threshold;
    let (low, high) = ends(profile, top);
    let (unit, factor) = unit(&profile.unit, [low, high]);
    let (low, high) = (low * factor, high * factor);
    let line = |label: &str, colour, mark, points: &[(f64, f64)]| Series {
        label: label.to_owned(),
        colour,
        mark,
        points: points.iter().map(|(x, y)| Some((x * factor, *y))).collect(),
        ..Series::default()
    };
    let level = [(low / factor, shown.threshold), (high / factor, shown.threshold)];
    let mut series = vec![
        line("95 % threshold", Colour::Grey, Mark::Dashed, &level),
        line("cost by the linear model", Colour::Orange, Mark::ThinDashed, &profile.linear),
        line("cost, others refitted", Colour::Blue, Mark::Joined(Shape::Disc), &profile.points),
    ];
    series.retain(|s| !s.points.is_empty());
    let bars = INTERVALS.iter().zip(profile.intervals);
    series.extend(
        bars.filter_map(|(look, ends)| interval(shown, look, ends?, profile.estimate, factor, (low, high))),
    );
    let truth = profile.truth.map(|at| Rule {
        label: "synthetic truth".to_owned(),
        colour: Colour::Vermilion,
        mark: Mark::Line,
        at: at * factor,
        above: None,
    });
    Panel {
        title: profile.verdict.clone(),
        x: Axis::linear(with_unit(&profile.symbol, &unit)).between(low, high),
        y: Axis::linear("rise of the cost").between(-0.04 * top, top),
        height_mm: HEIGHT_MM,
        series,
        bands: outside(profile, factor, (low, high)),
        rules: truth.into_iter().collect(),
        ..Panel::default()
    }
}

/// An interval as a bar with a symbol at the estimate; an open end runs out of the axes.
fn interval(
    shown: &Profiles,
    (name, colour, shape, height): &(&str, Colour, Shape, f64),
    [lower, upper]: [Option<f64>; 2],
    estimate: f64,
    factor: f64,
    (low, high): (f64, f64),
) -> Option<Series> {
    if lower.is_none() && upper.is_none() {
        return None;
    }
    let (y, beyond) = (height * shown.threshold, high - low);
    let end = |end: Option<f64>, open: f64| end.map_or(open, |value| value * factor);
    Some(Series {
        label: format!("95 % by {name}"),
        colour: *colour,
        mark: Mark::Hollow(*shape),
        points: vec![Some((estimate * factor, y))],
        bars: vec![Bar::Horizontal { y, from: end(lower, low - beyond), to: end(upper, high + beyond) }],
    })
}

/// Where the search could not go, as far as that is shown.
fn outside(profile: &Profile, factor: f64, (low, high): (f64, f64)) -> Vec<Band> {
    let (lower, upper) = (profile.bounds.0 * factor, profile.bounds.1 * factor);
    let band = |from, to| Band {
        label: "out of bounds".to_owned(),
        colour: Colour::Grey,
        from,
        to,
        outlined: false,
    };
    [(low, lower), (upper, high)]
        .into_iter()
        .filter(|(from, to)| from < to)
        .map(|(from, to)| band(from, to))
        .collect()
}

/// Ends of the x axis: of the profile as far as it is shown, of the intervals and the truth, with some room.
fn ends(profile: &Profile, top: f64) -> (f64, f64) {
    let rises = |at: usize| profile.points.get(at).is_some_and(|(_, rise)| *rise <= top);
    // a place beyond the top belongs to the figure where the line to it starts inside
    let reached = |at: usize| rises(at) || at.checked_sub(1).is_some_and(rises) || rises(at + 1);
    let inside = profile.points.iter().enumerate().filter(|(at, _)| reached(*at)).map(
        |(at, (value, rise))| match rises(at) {
            true => *value,
            false => cut(profile, at, (*value, *rise), top),
        },
    );
    let intervals = profile.intervals.iter().flatten().flatten().flatten().copied();
    let all =
        inside.chain(intervals).chain(profile.truth).chain([profile.estimate]).filter(|v| v.is_finite());
    let (low, high) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    let room = if high > low { ROOM * (high - low) } else { (ROOM * high.abs()).max(f64::MIN_POSITIVE) };
    (low - room, high + room)
}

/// Where the line from the neighbour inside to a point beyond the top leaves it.
fn cut(profile: &Profile, at: usize, (value, rise): (f64, f64), top: f64) -> f64 {
    let neighbours =
        [at.checked_sub(1), at.checked_add(1)].into_iter().flatten().filter_map(|i| profile.points.get(i));
    let crossing = |(x, y): &(f64, f64)| x + (top - y) / (rise - y) * (value - x);
    let inside = neighbours.filter(|(_, y)| *y <= top).map(crossing);
    inside
        .reduce(|a, b| if (a - profile.estimate).abs() > (b - profile.estimate).abs() { a } else { b })
        .unwrap_or(value)
}

/// What the figure shows, in words and numbers.
#[must_use]
pub fn caption(shown: &Profiles) -> String {
    let drawn: Vec<&Profile> = shown.parameters.iter().filter(|p| !p.points.is_empty()).collect();
    let mut sentences = vec![format!(
        "Rise of the cost over its least value, {}, along each parameter while the others are refitted; the axes end at {SHOWN} times the 95 % threshold of {}. \
         Bars: 95 % intervals with their symbol at the estimate; a bar that leaves the axes is open on that side.",
        short(shown.least_cost),
        short(shown.threshold)
    )];
    sentences.push(format!(
        "By the profiles: {}.",
        drawn.iter().map(|p| in_words(p)).collect::<Vec<_>>().join("; ")
    ));
    sentences.extend(drawn.iter().any(|p| open_but_rising(p, shown.threshold)).then(|| {
        "Where a line rises over the threshold on a side that counts as open, a bound of the search, of that parameter or another, is met there.".to_owned()
    }));
    sentences.extend(drawn.iter().any(|p| p.verdict == NOT_IDENTIFIED && p.intervals[0].is_some_and(|ends| ends.iter().all(Option::is_some))).then(|| {
        format!("A parameter is \u{201c}{NOT_IDENTIFIED}\u{201d} also where its line crosses the threshold on both sides, if the features determine no value near the estimate or the search is in doubt.")
    }));
    sentences.extend(undetermined(&drawn));
    sentences.extend(truths(&drawn));
    sentences.push("Where the best point can be relied on, the intervals of the table reach as far as profile, bootstrap and every point of the fit within the threshold do.".to_owned());
    sentences.join(" ")
}

/// "A from 0.1 to 0.2", or which end is open.
fn in_words(profile: &Profile) -> String {
    let [lower, upper] = profile.intervals[0].unwrap_or_default();
    let (unit, factor) = unit(&profile.unit, [profile.estimate]);
    let value = |v: f64| short(v * factor);
    let ends = match (lower, upper) {
        (Some(lower), Some(upper)) => format!("from {} to {}", value(lower), value(upper)),
        (Some(lower), None) => format!("above {}, open upwards", value(lower)),
        (None, Some(upper)) => format!("below {}, open downwards", value(upper)),
        (None, None) => return format!("{} open on both sides", profile.symbol),
    };
    format!("{} {ends} {unit}", profile.symbol).trim_end().to_owned()
}

/// Whether the cost crosses the threshold on a side on which the interval is open.
fn open_but_rising(profile: &Profile, threshold: f64) -> bool {
    let [lower, upper] = profile.intervals[0].unwrap_or_default();
    let rises = |below: bool| {
        profile.points.iter().any(|(value, rise)| (*value < profile.estimate) == below && *rise > threshold)
    };
    (lower.is_none() && rises(true)) || (upper.is_none() && rises(false))
}

fn undetermined(drawn: &[&Profile]) -> Option<String> {
    let without: Vec<String> =
        drawn.iter().filter(|p| p.intervals[1].is_none()).map(|p| p.symbol.clone()).collect();
    (!without.is_empty())
        .then(|| format!("The linear model at the estimates gives no interval for {}.", listed(&without)))
}

/// How many truths the profile's intervals hold.
fn truths(drawn: &[&Profile]) -> Option<String> {
    let known: Vec<(&&Profile, f64)> = drawn.iter().filter_map(|p| Some((p, p.truth?))).collect();
    let holds = |(p, truth): &&(&&Profile, f64)| {
        let [lower, upper] = p.intervals[0].unwrap_or_default();
        lower.is_none_or(|l| l <= *truth) && upper.is_none_or(|u| *truth <= u)
    };
    let held = known.iter().filter(holds).count();
    (!known.is_empty()).then(|| {
        format!(
            "The true values of the synthetic blade (vertical lines) lie within {held} of {} of these.",
            known.len()
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::chart::Medium;

    fn profile() -> Profile {
        Profile {
            symbol: "k1".to_owned(),
            unit: "N m/rad".to_owned(),
            bounds: (1e-3, 2.2e-3),
            estimate: 2e-3,
            truth: Some(1.9e-3),
            points: vec![(1.0e-3, 20.0), (1.8e-3, 4.0), (2e-3, 0.0), (2.2e-3, 1.0)],
            intervals: [Some([Some(1.81e-3), None]), None, None],
            ..Profile::default()
        }
    }

    fn shown() -> Profiles {
        Profiles {
            title: "t".to_owned(),
            least_cost: 0.5,
            threshold: 4.0,
            parameters: vec![profile()],
            ..Profiles::default()
        }
    }

    #[test]
    fn the_axis_ends_where_the_line_leaves_the_panel() {
        // the line from (1.8e-3, 4) to (1e-3, 20) reaches 12 half way, at 1.4e-3
        let (low, high) = ends(&profile(), 12.0);
        let room = ROOM * (2.2e-3 - 1.4e-3);
        assert!(
            (low - (1.4e-3 - room)).abs() < 1e-12 && (high - (2.2e-3 + room)).abs() < 1e-12,
            "{low} {high}"
        );
    }

    #[test]
    fn an_open_interval_runs_out_and_the_bound_is_shaded() {
        let panel = panel(&shown(), &profile());
        assert_eq!(panel.x.label, "k1, mN m/rad");
        let (_, high) = panel.x.range.unwrap();
        let bar = panel.series.iter().flat_map(|s| &s.bars).next().unwrap();
        assert!(matches!(bar, Bar::Horizontal { from, to, .. } if (from - 1.81).abs() < 1e-12 && *to > high));
        assert_eq!(panel.bands.iter().map(|b| b.from).collect::<Vec<_>>(), [2.2]);
        assert!((panel.rules[0].at - 1.9).abs() < 1e-12);
    }

    #[test]
    fn the_caption_says_what_is_open_and_how_many_truths_are_held() {
        let text = caption(&shown());
        assert!(
            text.contains("k1 above 1.81, open upwards mN m/rad") && text.contains("no interval for k1"),
            "{text}"
        );
        assert!(text.contains("within 1 of 1 of these"), "{text}");
    }

    #[test]
    fn the_caption_explains_a_rise_on_an_open_side() {
        let open = "on a side that counts as open";
        assert!(!caption(&shown()).contains(open));
        let mut rising = shown();
        rising.parameters[0].points.push((2.21e-3, 9.0));
        assert!(caption(&rising).contains(open));
    }

    #[test]
    fn parameters_without_a_profile_have_no_panel() {
        let none = Profiles { parameters: vec![Profile { points: Vec::new(), ..profile() }], ..shown() };
        assert!(figure(&none).panels.is_empty());
        assert!(figure(&shown()).svg(Medium::Column).contains("95 % threshold"));
    }
}
