//! Local searches: where each started and ended, by cost and in the box of the parameters.

use super::symbol::symbol;
use crate::fit::job::{FreeParameter, Job};
use crate::fit::result::{FitResult, Optimum};
use crate::math;
use crate::report::chart::{Axis, Colour, FULL_WIDTH_MM, Figure, Mark, Panel, Series, Shape};
use crate::report::{Drawing, FigureBlock, about, subtitle};
use crate::text::{percent, short};

/// A local search.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Descent {
    /// Cost where it started.
    pub start_cost: f64,
    /// Cost where it ended.
    pub cost: f64,
    /// Where it ended, each parameter's place between its bounds, 0 to 1.
    pub end: Vec<f64>,
    /// Whether the model failed there.
    pub failed: bool,
}

/// What the figure shows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Searches {
    /// Heading.
    pub title: String,
    /// Whether the data are synthetic.
    pub synthetic: bool,
    /// Rise in cost that bounds a 95 % interval.
    pub threshold: f64,
    /// Symbols of the parameters.
    pub symbols: Vec<String>,
    /// The searches, the lowest final cost first.
    pub descents: Vec<Descent>,
}

/// Heights of the panels, mm.
const COST_MM: f64 = 46.0;
const PLACES_MM: f64 = 34.0;
/// Decades of cost shown below the highest: lower costs, and zero, are drawn at the foot.
const DECADES: i32 = 9;
/// Searches up to which each has its number at the axis.
const NUMBERED: usize = 24;
/// Distance of the parameters of a search from each other, in searches: in one place they would hide each
/// other.
const APART: f64 = 0.13;
/// Ends nearer than this in every parameter, as a share of its range, are one place.
const SAME_PLACE: f64 = 0.02;
/// Looks of the parameters, in order.
const LOOKS: [(Colour, Shape); 6] = [
    (Colour::Vermilion, Shape::Square),
    (Colour::Green, Shape::Diamond),
    (Colour::Orange, Shape::Triangle),
    (Colour::Purple, Shape::InvertedTriangle),
    (Colour::Black, Shape::Disc),
    (Colour::SkyBlue, Shape::Square),
];

impl Searches {
    /// The local searches of a fit.
    #[must_use]
    pub fn of(job: &Job, result: &FitResult) -> Self {
        Self {
            title: job.title.clone(),
            synthetic: result.synthetic,
            threshold: result.threshold,
            symbols: job.parameters.iter().map(|p| symbol(&p.name)).collect(),
            descents: result.waterfall.iter().map(|optimum| Descent::of(job, optimum)).collect(),
        }
    }

    /// The figure with its caption; nothing without a search.
    #[must_use]
    pub fn block(&self) -> Option<FigureBlock> {
        (!self.descents.is_empty()).then(|| FigureBlock {
            condition: None,
            file: "searches.svg".to_owned(),
            caption: caption(self),
            details: details(self),
            drawing: Drawing::Chart(figure(self)),
        })
    }
}

impl Descent {
    fn of(job: &Job, optimum: &Optimum) -> Self {
        let place = |p: &FreeParameter| {
            optimum.values.get(&p.name).map_or(f64::NAN, |value| p.bounds.to_unit(*value))
        };
        Self {
            start_cost: optimum.start_cost,
            cost: optimum.cost,
            end: job.parameters.iter().map(place).collect(),
            failed: optimum.failure.is_some(),
        }
    }
}

/// The figure.
#[must_use]
pub fn figure(shown: &Searches) -> Figure {
    let count = shown.descents.len();
    let x = match count {
        0..=NUMBERED => Axis::named("local search", (1..=count).map(|n| n.to_string())),
        _ => Axis::linear("local search").between(-1.0, count as f64),
    };
    let mut panels = vec![costs(shown, &x)];
    panels.extend((!shown.symbols.is_empty()).then(|| places(shown, &x)));
    Figure {
        title: claim(shown),
        subtitle: about(&shown.title, &subtitle(shown.synthetic, "")),
        synthetic: shown.synthetic,
        description: "Cost at which every local search started and ended, and where in the box of the \
                      parameters it ended."
            .to_owned(),
        width_mm: FULL_WIDTH_MM,
        panels,
        ..Figure::default()
    }
}

/// The lowest cost that is drawn at its own height.
fn floor(shown: &Searches) -> f64 {
    let usable =
        shown.descents.iter().flat_map(|d| [d.start_cost, d.cost]).filter(|c| c.is_finite() && *c > 0.0);
    let (low, high) = usable.fold((f64::INFINITY, shown.threshold), |(l, h), c| (l.min(c), h.max(c)));
    low.max(high * math::powi(10.0, -DECADES)).min(shown.threshold)
}

fn costs(shown: &Searches, x: &Axis) -> Panel {
    /// Room on the logarithmic axis, as a factor.
    const ROOM: f64 = 2.0;
    let floor = floor(shown);
    let height = |cost: f64| if cost > floor { cost } else { floor };
    let best = shown.descents.first().map_or(0.0, |d| d.cost);
    let highest = shown
        .descents
        .iter()
        .flat_map(|d| [d.start_cost, d.cost])
        .filter(|c| c.is_finite())
        .fold(best + shown.threshold, f64::max);
    let at = |i: usize, cost: f64| Some((i as f64, height(cost)));
    let numbered = || shown.descents.iter().enumerate();
    let ends = |failed: bool| {
        numbered()
            .filter(move |(_, d)| d.failed == failed)
            .flat_map(|(i, d)| [at(i, d.cost), None])
            .collect::<Vec<_>>()
    };
    let level = [-1.0, shown.descents.len() as f64].map(|x| Some((x, best + shown.threshold))).to_vec();
    let series = |label: &str, colour, mark, points| Series {
        label: label.to_owned(),
        colour,
        mark,
        points,
        bars: Vec::new(),
    };
    let mut all = vec![
        series("95 % threshold", Colour::Grey, Mark::Dashed, level),
        series(
            "",
            Colour::Blue,
            Mark::Thin,
            numbered().flat_map(|(i, d)| [at(i, d.start_cost), at(i, d.cost), None]).collect(),
        ),
        series(
            "start",
            Colour::Blue,
            Mark::Hollow(Shape::Disc),
            numbered().map(|(i, d)| at(i, d.start_cost)).collect(),
        ),
        series("end", Colour::Blue, Mark::Joined(Shape::Disc), ends(false)),
        series("end where the model failed", Colour::Vermilion, Mark::Crosses, ends(true)),
    ];
    all.retain(|s| !s.points.is_empty());
    Panel {
        x: x.clone(),
        y: Axis::log("cost").between(floor / ROOM, highest * ROOM),
        height_mm: COST_MM,
        series: all,
        ..Panel::default()
    }
}

fn places(shown: &Searches, x: &Axis) -> Panel {
    let middle = (shown.symbols.len() as f64 - 1.0) / 2.0;
    let apart = if shown.descents.len() <= NUMBERED { APART } else { 0.0 };
    let of = |index: usize| {
        let at = move |i: usize| i as f64 + apart * (index as f64 - middle);
        shown
            .descents
            .iter()
            .enumerate()
            .map(move |(i, d)| d.end.get(index).map(|place| (at(i), *place)))
            .collect()
    };
    let series = |(index, (symbol, (colour, shape))): (usize, (&String, &(Colour, Shape)))| Series {
        label: symbol.clone(),
        colour: *colour,
        mark: Mark::Hollow(*shape),
        points: of(index),
        bars: Vec::new(),
    };
    Panel {
        x: x.clone(),
        y: Axis::linear("place in range").between(-0.05, 1.05),
        height_mm: PLACES_MM,
        series: shown.symbols.iter().zip(LOOKS.iter().cycle()).enumerate().map(series).collect(),
        ..Panel::default()
    }
}

/// Number of places at which ends lie: one that is near to a place with a lower cost is at that place.
fn distinct<'a>(ends: impl Iterator<Item = &'a Descent>) -> usize {
    let mut found: Vec<&[f64]> = Vec::new();
    for descent in ends {
        let same = |place: &&[f64]| place.iter().zip(&descent.end).all(|(a, b)| (a - b).abs() <= SAME_PLACE);
        if !found.iter().any(same) {
            found.push(&descent.end);
        }
    }
    found.len()
}

fn least_cost(shown: &Searches) -> f64 {
    shown.descents.first().map_or(0.0, |d| d.cost)
}

/// The searches that ended within the threshold of the least cost.
fn met(shown: &Searches) -> Vec<&Descent> {
    let best = least_cost(shown);
    shown.descents.iter().filter(|d| !d.failed && d.cost <= best + shown.threshold).collect()
}

/// The claim with its numbers.
fn claim(shown: &Searches) -> String {
    let (met, all) = (met(shown), shown.descents.len());
    let places = match distinct(met.iter().copied()) {
        0 => return format!("None of {all} local searches ended where the model runs"),
        1 => "at one place".to_owned(),
        apart => format!("at {apart} places"),
    };
    format!("{} of {all} local searches ended within the threshold, {places}", met.len())
}

/// What the figure shows, with its number.
#[must_use]
pub fn caption(shown: &Searches) -> String {
    let best = least_cost(shown);
    let met = met(shown);
    let places = match distinct(met.iter().copied()) {
        0 | 1 => "all at one place".to_owned(),
        apart => format!("at {apart} places"),
    };
    format!(
        "{} of {} local searches ended within the 95 % threshold, {}, of the least cost, {}, {places}.",
        met.len(),
        shown.descents.len(),
        short(shown.threshold),
        short(best)
    )
}

/// How to read the figure.
#[must_use]
pub fn details(shown: &Searches) -> String {
    let failed = shown.descents.iter().filter(|d| d.failed).count();
    let floor = floor(shown);
    let lower = shown.descents.iter().flat_map(|d| [d.start_cost, d.cost]).filter(|c| *c < floor).count();
    let mut sentences = vec![format!(
        "The searches are in order of their final cost. Two ends are at different places where a parameter differs \
         by more than {} of its range.",
        percent(SAME_PLACE)
    )];
    if !shown.symbols.is_empty() {
        sentences.push(
            "Below: the place of each parameter where the search ended, between its lower bound (0) and its \
             upper bound (1)."
                .to_owned(),
        );
    }
    if failed > 0 {
        sentences.push(format!("The model failed at the end of {failed} of them."));
    }
    if lower > 0 {
        sentences.push(format!("Costs below {} are drawn there: {lower}.", short(floor)));
    }
    sentences.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::chart::Medium;

    fn descent(start_cost: f64, cost: f64, end: [f64; 2]) -> Descent {
        Descent { start_cost, cost, end: end.to_vec(), failed: false }
    }

    fn shown() -> Searches {
        let mut descents = vec![
            descent(3.0, 0.0, [0.5, 0.5]),
            descent(90.0, 0.2, [0.51, 0.49]),
            descent(70.0, 3.0, [0.5, 0.9]),
            descent(50.0, 30.0, [0.1, 0.1]),
            descent(200.0, 100.0, [0.0, 0.0]),
        ];
        descents[4].failed = true;
        Searches {
            title: "t".to_owned(),
            threshold: 4.0,
            symbols: vec!["A".to_owned(), "k1".to_owned()],
            descents,
            ..Searches::default()
        }
    }

    #[test]
    fn caption_and_details_count_ends_and_places() {
        let text = caption(&shown());
        assert!(
            text.contains(
                "3 of 5 local searches ended within the 95 % threshold, 4, of the least cost, 0, at 2 places"
            ),
            "{text}"
        );
        assert_eq!(claim(&shown()), "3 of 5 local searches ended within the threshold, at 2 places");
        let text = details(&shown());
        assert!(
            text.contains("at the end of 1 of them") && text.contains("below 0.2 are drawn there: 1"),
            "{text}"
        );
        let one = Searches { descents: shown().descents[..2].to_vec(), ..shown() };
        assert!(
            caption(&one).contains("2 of 2") && caption(&one).contains("all at one place"),
            "{}",
            caption(&one)
        );
    }

    #[test]
    fn a_cost_of_zero_stands_at_the_foot_and_failures_are_crosses() {
        let panel = &figure(&shown()).panels[0];
        let (low, _) = panel.y.range.unwrap();
        let lowest = panel
            .series
            .iter()
            .flat_map(|s| s.points.iter().flatten())
            .map(|(_, cost)| *cost)
            .fold(f64::INFINITY, f64::min);
        assert!(low > 0.0 && lowest == 0.2, "{low} {lowest}");
        let crosses: Vec<_> = panel
            .series
            .iter()
            .filter(|s| s.mark == Mark::Crosses)
            .flat_map(|s| s.points.iter().flatten())
            .collect();
        assert_eq!(crosses, [&(4.0, 100.0)]);
    }

    #[test]
    fn searches_that_all_cost_nothing_can_be_drawn() {
        let none = Searches { descents: vec![descent(0.0, 0.0, [0.5, 0.5])], ..shown() };
        assert!(figure(&none).svg(Medium::Column).contains("95 % threshold"));
        assert!(figure(&Searches::default()).svg(Medium::Page).starts_with("<svg"));
    }
}
