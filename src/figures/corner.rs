//! Corner plot: joint regions of every pair of parameters, and for each parameter its likelihood and profile,
//! its bounds and prior, its true value and its stated interval.

use super::figure_text::parameter_symbol;
use crate::compare::ParameterLine;
use crate::figures::{Drawing, FigureBlock, about, full_figure, subtitle};
use crate::fit::bounds::Bounds;
use crate::fit::bounds::Prior;
use crate::fit::job::{FreeParameter, Job};
use crate::fit::result::{FitResult, LocalOptimum};
use crate::text::{choose_prefix, format_digits, format_interval, join_with_and};
use plain_charts::{ChartAxis, Colour, Figure, Mark, Panel, Ribbon, Series};
use portable_math as math;

/// A parameter; values are in the unit scale of the search, with 0 and 1 at the bounds.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CornerParameter {
    /// Symbol in the equations.
    pub symbol: String,
    /// The estimate with its unit, and in brackets the 95 % interval that the page states.
    pub words: String,
    /// Estimate.
    pub estimate: f64,
    /// The 95 % interval that the page states; `None` for an open end.
    pub stated: [Option<f64>; 2],
    /// Standard deviation of the estimate from the linear model.
    pub sd: Option<f64>,
    /// Mean and standard deviation of the prior.
    pub prior: Option<(f64, f64)>,
    /// True value, if the data are synthetic.
    pub truth: Option<f64>,
    /// Values of the parameter, each with the ratio of its profile likelihood to the largest likelihood.
    pub profile: Vec<(f64, f64)>,
    /// Values at which local searches ended. `true` marks an end whose cost exceeds the least cost by at most
    /// the threshold of the 95 % interval.
    pub optima: Vec<(f64, bool)>,
}

/// Data of the figure.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CornerPlot {
    /// Title of the fit.
    pub title: String,
    /// Whether the data are synthetic.
    pub synthetic: bool,
    /// The parameters.
    pub parameters: Vec<CornerParameter>,
    /// Correlation matrix of the estimates; `None` for an unknown correlation.
    pub correlations: Vec<Vec<Option<f64>>>,
}

/// Height of a row, mm.
const ROW_MM: f64 = 24.0;
/// Maximum number of parameters drawn; of a longer list only the first ones are drawn.
const MOST: usize = 8;
/// Label, colour, mark and half width of the joint regions. The half widths are in standard deviations: the
/// square roots of the 95.4 and 68.3 % quantiles of chi-square with two degrees of freedom.
const REGIONS: [(&str, Colour, Mark, f64); 2] = [
    ("95 % of a pair", Colour::Blue, Mark::Thin, 2.486),
    ("68 % of a pair", Colour::Blue, Mark::Line, 1.515),
];
/// Number of intervals in the outline of a region and in a curve.
const POINTS: u32 = 48;
/// Half width of a cell; the distance between the centres of neighbouring cells is 1.
const HALF: f64 = 0.5;
/// Half width of the contents of a cell; the distance between cell centres is 1.
const INSIDE: f64 = 0.44;
/// Height of the likelihood curve in a diagonal cell; the distance between cell centres is 1.
const CURVE: f64 = 0.72;
/// Length of a tick; the distance between cell centres is 1.
const TICK: f64 = 0.12;
/// Each cell shows at least this number of standard deviations on either side of the estimate.
const SHOWN_SD: f64 = 2.8;
/// Margin on either side of the range that a cell shows, as a fraction of that range.
const ROOM: f64 = 0.06;
/// Smallest margin of a cell, in the unit scale of the search (0 and 1 at the bounds); a smaller value would
/// be rounding error.
const LEAST: f64 = 1e-9;
/// Half width of a two-sided 95 % interval, in standard deviations.
const Z_95: f64 = 1.96;

impl CornerPlot {
    /// The parameters of a fit; `lines` contain units and true values.
    pub(crate) fn from_fit(job: &Job, result: &FitResult, lines: &[ParameterLine]) -> Self {
        let free: Vec<&FreeParameter> =
            job.parameters.iter().filter(|p| result.parameters.contains_key(&p.name)).take(MOST).collect();
        let correlation = |a: &FreeParameter, b: &FreeParameter| {
            result.correlations.get(&a.name).and_then(|row| row.get(&b.name)).copied()
        };
        Self {
            title: job.title.clone(),
            synthetic: result.synthetic,
            parameters: free.iter().filter_map(|free| corner_parameter(free, result, lines)).collect(),
            correlations: free.iter().map(|a| free.iter().map(|b| correlation(a, b)).collect()).collect(),
        }
    }

    /// The figure with its caption; `None` without a parameter.
    pub(crate) fn figure_block(&self) -> Option<FigureBlock> {
        (!self.parameters.is_empty()).then(|| FigureBlock {
            condition: None,
            file: "corner.svg".to_owned(),
            caption: figure_caption(self),
            details: String::new(),
            drawing: Drawing::Chart(draw_figure(self)),
        })
    }

    /// The pair with the largest absolute correlation: row, column, correlation.
    fn strongest_correlation(&self) -> Option<(usize, usize, f64)> {
        let rows = self.correlations.iter().enumerate();
        let pairs = rows.flat_map(|(i, row)| row.iter().take(i).enumerate().map(move |(j, r)| (i, j, *r)));
        pairs.filter_map(|(i, j, r)| Some((i, j, r?))).max_by(|a, b| a.2.abs().total_cmp(&b.2.abs()))
    }
}

fn corner_parameter(
    free: &FreeParameter,
    result: &FitResult,
    lines: &[ParameterLine],
) -> Option<CornerParameter> {
    let (found, bounds) = (result.parameters.get(&free.name)?, &free.bounds);
    let line = lines.iter().find(|line| line.name == free.name);
    let estimate = bounds.unit_coordinate(found.estimate);
    // the interval may have been cut at a bound on one side, so the longer half determines the standard
    // deviation
    let half = found.linear_95.map(|ends| {
        ends.iter().map(|end| (bounds.unit_coordinate(*end) - estimate).abs()).fold(0.0, f64::max)
    });
    let (name, factor) = choose_prefix(line.map_or("", |line| line.unit.as_str()), [found.estimate]);
    let number = |v: f64| format_digits(v * factor, 3);
    let ends = format_interval(found.lower_95, found.upper_95, number);
    let likelihood = |cost: f64| math::exp(-0.5 * (cost - result.cost).max(0.0));
    let optimum = |end: &LocalOptimum| {
        let value = bounds.unit_coordinate(*end.values.get(&free.name)?);
        Some((value, end.cost - result.cost <= result.threshold))
    };
    Some(CornerParameter {
        symbol: parameter_symbol(&free.name),
        words: format!("{} {name} ({ends})", number(found.estimate)).replace("  ", " "),
        estimate,
        stated: [found.lower_95, found.upper_95].map(|end| end.map(|v| bounds.unit_coordinate(v))),
        sd: half.map(|half| half / Z_95).filter(|sd| *sd > 0.0),
        prior: free.prior.as_ref().and_then(|prior| prior_in_search_scale(prior, bounds)),
        truth: line.and_then(|line| line.truth).map(|truth| bounds.unit_coordinate(truth.value)),
        profile: found
            .profile
            .iter()
            .map(|(v, cost)| (bounds.unit_coordinate(*v), likelihood(*cost)))
            .collect(),
        optima: result.waterfall.iter().filter_map(optimum).collect(),
    })
}

/// Mean and standard deviation of a prior in the unit scale of the search, linearised at the mean.
fn prior_in_search_scale(prior: &Prior, bounds: &Bounds) -> Option<(f64, f64)> {
    let (mean, sd) = match *prior {
        Prior::Linear { mean, sd } => (mean, sd),
        Prior::Log { mean_ln, sd_ln } => (math::exp(mean_ln), sd_ln * math::exp(mean_ln)),
    };
    let at = bounds.unit_coordinate(mean);
    Some((at, sd / bounds.slope(at))).filter(|(at, sd)| at.is_finite() && sd.is_finite() && *sd > 0.0)
}

/// The range of a parameter that its cells show, including margins.
fn shown_range(known: &CornerParameter) -> (f64, f64) {
    let by_sd = known.sd.map(|sd| [known.estimate - SHOWN_SD * sd, known.estimate + SHOWN_SD * sd]);
    let open =
        |end: Option<f64>, bound: f64| end.unwrap_or(if known.sd.is_some() { known.estimate } else { bound });
    let ends = [open(known.stated[0], 0.0), open(known.stated[1], 1.0), known.estimate];
    let all = ends.into_iter().chain(by_sd.into_iter().flatten()).chain(known.truth);
    let (low, high) = all
        .filter(|v| v.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    let room = (ROOM * (high - low)).max(LEAST);
    (low - room, high + room)
}

/// Position of a value relative to the middle of a cell; the distance between cell centres is 1.
fn cell_position(value: f64, (low, high): (f64, f64)) -> f64 {
    INSIDE * (2.0 * (value - low) / (high - low) - 1.0)
}

/// Draws the figure.
#[must_use]
pub fn draw_figure(shown: &CornerPlot) -> Figure {
    let count = shown.parameters.len();
    let title = match shown.strongest_correlation() {
        Some((i, j, r)) => {
            let [i, j] = [i, j].map(|at| shown.parameters.get(at).map_or("", |p| p.symbol.as_str()));
            format!("{j} and {i} move together most: correlation {}", crate::text::format_decimals(r, 2))
        }
        None => {
            let bounded = shown.parameters.iter().filter(|p| p.stated.iter().all(Option::is_some)).count();
            format!("{bounded} of {count} parameters have an interval with two ends")
        }
    };
    let names = shown.parameters.iter().map(|p| format!("{} = {}", p.symbol, p.words));
    let x = ChartAxis::categorical("", shown.parameters.iter().map(|p| p.symbol.clone()));
    let y = ChartAxis::categorical("", names.rev().collect::<Vec<_>>());
    let panel = Panel {
        ribbons: out_of_bounds_ribbons(shown),
        ..Panel::new(x, y, ROW_MM * count as f64, draw_cells(shown))
    };
    Figure {
        subtitle: about(&shown.title, &subtitle(shown.synthetic, "")),
        ..full_figure(
            &title,
            shown.synthetic,
            "",
            "Regions of every pair of parameters, and the likelihood along each with its 95 % interval."
                .to_owned(),
            [panel],
        )
    }
}

/// Centre of a cell; rows count from the top.
fn cell_centre(shown: &CornerPlot, row: usize, column: usize) -> (f64, f64) {
    (column as f64, (shown.parameters.len() - 1 - row) as f64)
}

fn draw_cells(shown: &CornerPlot) -> Vec<Series> {
    let spans: Vec<(f64, f64)> = shown.parameters.iter().map(shown_range).collect();
    let count = shown.parameters.len();
    let pairs = || (0..count).flat_map(|i| (0..i).map(move |j| (i, j)));
    let pair = |(i, j): (usize, usize)| (&shown.parameters[i], &shown.parameters[j]);
    let diagonal = || shown.parameters.iter().enumerate();
    // `point` converts the values of two parameters to a point in their common cell; `upright` converts a
    // value and a height to a point in a diagonal cell
    let point = |(i, j): (usize, usize), x: f64, y: f64| {
        clip_to_cell((cell_position(x, spans[j]), cell_position(y, spans[i])), cell_centre(shown, i, j))
    };
    let upright = |i: usize, value: f64, y: f64| {
        clip_to_cell((cell_position(value, spans[i]), y), cell_centre(shown, i, i))
    };
    let frame = |(x, y): (f64, f64)| {
        let corners = [(-HALF, -HALF), (HALF, -HALF), (HALF, HALF), (-HALF, HALF), (-HALF, -HALF)];
        corners.map(|(a, b)| Some((x + a, y + b))).into_iter().chain([None])
    };
    let lower = (0..count).flat_map(|i| (0..=i).map(move |j| cell_centre(shown, i, j)));
    let mut all = vec![Series::new("", Colour::Grey, Mark::Thin, lower.flat_map(frame))];
    for (label, colour, mark, radius) in REGIONS {
        let region = |at: (usize, usize)| {
            let (a, b) = pair(at);
            let r = shown.correlations.get(at.0).and_then(|row| row.get(at.1).copied().flatten())?;
            let (sd_a, sd_b) = (a.sd?, b.sd?);
            let rest = (1.0 - r * r).max(0.0).sqrt();
            let edge = |k: u32| {
                let (sin, cos) = math::sin_cos(std::f64::consts::TAU * f64::from(k) / f64::from(POINTS));
                let up = a.estimate + radius * sd_a * (r * cos + rest * sin);
                point(at, b.estimate + radius * sd_b * cos, up)
            };
            Some((0..=POINTS).map(edge).chain([None]).collect::<Vec<_>>())
        };
        all.push(Series::new(label, colour, mark, pairs().filter_map(region).flatten()));
    }
    for (label, mark, wanted) in [
        ("other end of a search", Mark::Crosses, false),
        ("end of a search within the threshold", Mark::Dots, true),
    ] {
        let optima = pairs().flat_map(|at| {
            let (a, b) = pair(at);
            let ends = b.optima.iter().zip(&a.optima).filter(move |((_, within), _)| *within == wanted);
            ends.filter_map(move |((x, _), (y, _))| point(at, *x, *y))
        });
        all.push(Series::new(label, Colour::Grey, mark, optima));
    }
    let estimates = pairs().map(|at| point(at, pair(at).1.estimate, pair(at).0.estimate));
    all.push(Series::new("estimate", Colour::Black, Mark::Circles, estimates));
    let truths = pairs().map(|at| point(at, pair(at).1.truth?, pair(at).0.truth?));
    all.push(Series::new("synthetic truth", Colour::Vermilion, Mark::Crosses, truths));
    let curve = |of: fn(&CornerParameter) -> Option<(f64, f64)>| {
        let curves = diagonal().filter_map(|(i, known)| {
            let ((mean, sd), span) = (of(known)?, spans[i]);
            let bell = |k: u32| {
                let value = span.0 + (span.1 - span.0) * f64::from(k) / f64::from(POINTS);
                let off = (value - mean) / sd;
                upright(i, value, likelihood_height(math::exp(-0.5 * off * off)))
            };
            Some((0..=POINTS).map(bell).chain([None]).collect::<Vec<_>>())
        });
        curves.flatten().collect::<Vec<_>>()
    };
    all.push(Series::new("prior", Colour::Green, Mark::ThinDashed, curve(|known| known.prior)));
    let linear = curve(|known| Some((known.estimate, known.sd?)));
    all.push(Series::new("likelihood, linear", Colour::Orange, Mark::ThinDashed, linear));
    let profiles = diagonal().flat_map(|(i, known)| {
        let points = known.profile.iter().map(move |(v, rise)| upright(i, *v, likelihood_height(*rise)));
        points.chain([None])
    });
    all.push(Series::new("likelihood, profile", Colour::Blue, Mark::Thin, profiles));
    let truths = diagonal().flat_map(|(i, known)| {
        let end = |y: f64| upright(i, known.truth?, y);
        [end(-INSIDE), end(likelihood_height(1.0)), None]
    });
    all.push(Series::new("", Colour::Vermilion, Mark::Line, truths));
    let stated = diagonal().flat_map(|(i, known)| {
        let (at, [low, high]) = (cell_centre(shown, i, i), known.stated);
        let end = |value: Option<f64>, open: f64| {
            let x = value.map_or(open, |v| cell_position(v, spans[i])).clamp(-HALF, HALF);
            low.or(high).map(|_| (at.0 + x, at.1 - INSIDE))
        };
        [end(low, -HALF), end(high, HALF), None]
    });
    // ticks at the estimate and at the ends of its interval, whose values are in the label of the row
    let ticks = diagonal().flat_map(|(i, known)| {
        let tick = |value: Option<f64>| {
            let foot = |y: f64| upright(i, value?, y);
            [foot(-HALF), foot(-HALF + TICK), None]
        };
        [known.stated[0], Some(known.estimate), known.stated[1]]
            .into_iter()
            .flat_map(tick)
            .collect::<Vec<_>>()
    });
    all.push(Series::new("", Colour::Black, Mark::Thin, ticks));
    all.push(Series::new("95 % interval, as stated", Colour::Black, Mark::Thick, stated));
    all.retain(|series| series.points.iter().any(Option::is_some));
    all
}

/// Height, relative to the centre of a cell, at which a relative likelihood is drawn.
fn likelihood_height(share: f64) -> f64 {
    -INSIDE + CURVE * share
}

/// Converts a point given relative to the centre of its cell to axis coordinates; `None` if it lies outside
/// the cell.
fn clip_to_cell((x, y): (f64, f64), at: (f64, f64)) -> Option<(f64, f64)> {
    (x.abs() <= HALF && y.abs() <= HALF).then_some((at.0 + x, at.1 + y))
}

/// Shaded bands in the diagonal cells over those parts of the shown ranges that lie outside the bounds.
fn out_of_bounds_ribbons(shown: &CornerPlot) -> Vec<Ribbon> {
    let strip = |(i, known): (usize, &CornerParameter)| {
        let (span, at) = (shown_range(known), cell_centre(shown, i, i));
        let [low, high] = [0.0, 1.0].map(|bound| cell_position(bound, span));
        let ends = [(-HALF, low.min(HALF)), (high.max(-HALF), HALF)];
        ends.into_iter().filter(|(from, to)| from < to).map(move |(from, to)| {
            Ribbon::new(
                "out of bounds",
                Colour::Grey,
                [from, to].map(|x| Some((at.0 + x, at.1 - HALF, at.1 + HALF))),
            )
        })
    };
    shown.parameters.iter().enumerate().flat_map(strip).collect()
}

/// Caption: contents of the figure, and its main number.
pub(crate) fn figure_caption(shown: &CornerPlot) -> String {
    let all = shown.parameters.len();
    let bounded = shown.parameters.iter().filter(|p| p.stated.iter().all(Option::is_some)).count();
    let truths: Vec<bool> = shown.parameters.iter().filter_map(interval_holds_truth).collect();
    let held = if truths.is_empty() {
        String::new()
    } else {
        let count = truths.iter().filter(|is| **is).count();
        format!("; the true value lies within {count} of {}", truths.len())
    };
    let open: Vec<String> = shown
        .parameters
        .iter()
        .filter(|p| p.stated.iter().any(Option::is_none))
        .map(|p| p.symbol.clone())
        .collect();
    let open = if open.is_empty() { String::new() } else { format!(" ({} open)", join_with_and(&open)) };
    format!("Pairs of parameters and their likelihoods: {bounded} of {all} intervals are closed{open}{held}.")
}

fn interval_holds_truth(known: &CornerParameter) -> Option<bool> {
    let (truth, [low, high]) = (known.truth?, known.stated);
    Some(low.is_none_or(|low| low <= truth) && high.is_none_or(|high| truth <= high))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(fit: &str) -> (Job, FitResult, CornerPlot) {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("fits").join(fit);
        let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
        let job = Job::parse("job.toml", &read("job.toml")).unwrap();
        let result = FitResult::parse("result.json", &read("result.json")).unwrap();
        let corner = CornerPlot::from_fit(&job, &result, &[]);
        (job, result, corner)
    }

    #[test]
    fn intervals_and_deviations_are_those_of_the_result() {
        let (job, result, corner) = of("actual-blade-twin");
        assert_eq!(corner.parameters.len(), 5);
        for (free, known) in job.parameters.iter().zip(&corner.parameters) {
            let found = &result.parameters[&free.name];
            let back = known.stated.map(|end| end.map(|u| free.bounds.value_at_unit(u)));
            for (drawn, stated) in back.iter().zip([found.lower_95, found.upper_95]) {
                assert!((drawn.unwrap() / stated.unwrap() - 1.0).abs() < 1e-12, "{}", free.name);
            }
            let upper = free.bounds.value_at_unit(known.estimate + Z_95 * known.sd.unwrap());
            assert!((upper / found.linear_95.unwrap()[1] - 1.0).abs() < 1e-3, "{}", free.name);
        }
    }

    #[test]
    fn a_region_reaches_as_far_as_its_deviations() {
        let known = |estimate| CornerParameter {
            symbol: "A".to_owned(),
            estimate,
            sd: Some(0.01),
            stated: [Some(estimate - 0.02), Some(estimate + 0.02)],
            ..CornerParameter::default()
        };
        let shown = CornerPlot {
            parameters: vec![known(0.4), known(0.6)],
            correlations: vec![vec![Some(1.0), Some(0.8)], vec![Some(0.8), Some(1.0)]],
            ..CornerPlot::default()
        };
        let series = draw_cells(&shown);
        let region = series.iter().find(|s| s.label == REGIONS[0].0).unwrap();
        let widest = region.points.iter().flatten().map(|p| p.0).fold(0.0, f64::max);
        let of = shown_range(&shown.parameters[0]);
        assert!((widest - cell_position(0.4 + 2.486 * 0.01, of)).abs() < 1e-9, "{widest}");
        assert!(draw_figure(&shown).title.contains("correlation 0.80"), "{}", draw_figure(&shown).title);
    }

    #[test]
    fn what_is_open_leaves_its_cell_and_says_so() {
        let (_, _, corner) = of("published-simulation");
        assert!(figure_caption(&corner).contains("open)"), "{}", figure_caption(&corner));
        let stated = draw_cells(&corner).into_iter().find(|s| s.label == "95 % interval, as stated").unwrap();
        assert!(stated.points.iter().flatten().any(|p| (p.0 - p.0.round()).abs() == HALF));
    }
}
