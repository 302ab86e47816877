//! How the values of a map spread over each parameter of a study that is too large or has too many parameters
//! for a map: quantiles in bins, and rank correlations.
//!
//! Of a large study a subset of the points is looked at, spread evenly over all, so that the memory does not
//! grow with their number.

use super::grid::{Axis, Spacing};
use super::point::Outcome;
use super::study::Study;
use serde::Serialize;

/// Most numbers that are kept, values and their places together.
const MOST_NUMBERS: usize = 2_000_000;
/// Most points that are looked at: quantiles and correlations are known to less than a hundredth then.
const MOST_POINTS: usize = 200_000;
/// Bins of an axis whose values are sampled.
const BINS: usize = 24;
/// Fewest values from which a bin has quantiles.
const FEWEST: usize = 8;
/// Fewest values from which a correlation is computed.
const FEWEST_PAIRS: usize = 20;
/// The quantiles of a bin.
pub const QUANTILES: [f64; 5] = [0.05, 0.25, 0.5, 0.75, 0.95];

/// Values of every map at a subset of the points.
#[derive(Debug, Clone)]
pub struct Spread {
    /// Share of the points that are looked at.
    share: f64,
    looked_at: usize,
    /// Where they lie, a list an axis.
    places: Vec<Vec<f64>>,
    /// Their values, a list a map.
    values: Vec<Vec<Option<f64>>>,
}

/// A bin of an axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Bin {
    /// Where it starts and ends on the axis.
    pub from_to: [f64; 2],
    /// The [`QUANTILES`] of the values in it; `None` where there are too few.
    pub quantiles: Option<[f64; 5]>,
    /// Number of values in it.
    pub values: usize,
}

/// Rank correlation (Spearman's) of a map with a parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RankCorrelation {
    /// Name of the parameter.
    pub parameter: &'static str,
    /// From -1 to 1; `None` where too few points have a value, or all have the same.
    pub rank_correlation: Option<f64>,
}

impl Spread {
    /// No point yet.
    #[must_use]
    pub fn new(study: &Study) -> Self {
        let (axes, maps) = (study.axes.len(), study.maps.len());
        let most = (MOST_NUMBERS / (axes + maps).max(1)).min(MOST_POINTS);
        let share = (most as f64 / study.points().max(1) as f64).min(1.0);
        Self { share, looked_at: 0, places: vec![Vec::new(); axes], values: vec![Vec::new(); maps] }
    }

    /// Looks at a point, or leaves it out.
    pub fn look(&mut self, study: &Study, index: usize, outcome: &Outcome) {
        // multiples of the golden ratio are spread evenly over every regular part of a grid
        if (index as f64 * 0.618_033_988_749_894_9).fract() >= self.share {
            return;
        }
        self.looked_at += 1;
        self.places.iter_mut().zip(study.place(index)).for_each(|(places, place)| places.push(place));
        let values = outcome.values.iter().map(|value| value.ok()).chain(std::iter::repeat(None));
        self.values.iter_mut().zip(values).for_each(|(values, value)| values.push(value));
    }

    /// Number of points that were looked at.
    #[must_use]
    pub fn looked_at(&self) -> usize {
        self.looked_at
    }

    /// Quantiles of map `map` over axis `axis`.
    #[must_use]
    pub fn bins(&self, study: &Study, map: usize, axis: usize) -> Vec<Bin> {
        let Some(of) = study.axes.get(axis) else { return Vec::new() };
        let edges = edges(of, study.sample.is_some());
        let mut held = vec![Vec::new(); edges.len().saturating_sub(1)];
        for (x, value) in self.pairs(map, axis) {
            let bin = edges.partition_point(|edge| *edge <= x).saturating_sub(1);
            let last = held.len().saturating_sub(1);
            held.iter_mut().skip(bin.min(last)).take(1).for_each(|held| held.push(value));
        }
        let bin = |(mut values, from_to): (Vec<f64>, [f64; 2])| {
            values.sort_by(f64::total_cmp);
            let enough = values.len() >= FEWEST;
            let quantiles = enough.then(|| QUANTILES.map(|share| quantile(&values, share)));
            Bin { from_to, quantiles, values: values.len() }
        };
        let ends = edges.windows(2).map(|pair| [pair[0], pair[1]]);
        held.into_iter().zip(ends).map(bin).collect()
    }

    /// Rank correlation of map `map` with every parameter.
    #[must_use]
    pub fn correlations(&self, study: &Study, map: usize) -> Vec<RankCorrelation> {
        let of = |(at, axis): (usize, &Axis)| {
            let (x, y): (Vec<f64>, Vec<f64>) = self.pairs(map, at).unzip();
            RankCorrelation { parameter: axis.parameter.name, rank_correlation: spearman(&x, &y) }
        };
        study.axes.iter().enumerate().map(of).collect()
    }

    /// Value of an axis and of a map at every point that has one.
    fn pairs(&self, map: usize, axis: usize) -> impl Iterator<Item = (f64, f64)> + '_ {
        let (places, values) = (self.places.get(axis), self.values.get(map));
        let pairs = places.into_iter().flatten().zip(values.into_iter().flatten());
        pairs.filter_map(|(place, value)| Some((*place, (*value)?)))
    }
}

/// Ends of the bins: between the values of a grid where they are few, and else evenly over the axis.
fn edges(axis: &Axis, sampled: bool) -> Vec<f64> {
    let (Some(from), Some(to)) = (axis.values.first(), axis.values.last()) else { return Vec::new() };
    if sampled || axis.values.len() > BINS {
        return axis.spacing.spread(*from, *to, BINS + 1);
    }
    let middle = |pair: &[f64]| match axis.spacing {
        Spacing::Linear => 0.5 * (pair[0] + pair[1]),
        Spacing::Log => (pair[0] * pair[1]).sqrt(),
    };
    let inner = axis.values.windows(2).map(middle);
    std::iter::once(*from).chain(inner).chain([*to]).collect()
}

/// Quantile of sorted values, linear between them.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let place = share * sorted.len().saturating_sub(1) as f64;
    let (low, high) = (sorted.get(place.floor() as usize), sorted.get(place.ceil() as usize));
    low.zip(high).map_or(f64::NAN, |(low, high)| low + (place - place.floor()) * (high - low))
}

/// Rank correlation (Spearman's) of two lists, pair by pair; `None` where they are too short, or one is
/// constant.
#[must_use]
pub fn spearman(x: &[f64], y: &[f64]) -> Option<f64> {
    if x.len() < FEWEST_PAIRS {
        return None;
    }
    let (x, y) = (ranks(x), ranks(y));
    let mean = 0.5 * (x.len() as f64 - 1.0);
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - mean) * (b - mean)).sum::<f64>();
    let scale = (product(&x, &x) * product(&y, &y)).sqrt();
    (scale > 0.0).then(|| product(&x, &y) / scale)
}

/// Ranks from 0; equal values share the mean of theirs.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let mut ranks = vec![0.0; values.len()];
    let mut start = 0;
    for equal in order.chunk_by(|a, b| values[*a] == values[*b]) {
        let rank = start as f64 + 0.5 * (equal.len() as f64 - 1.0);
        equal.iter().for_each(|at| ranks[*at] = rank);
        start += equal.len();
    }
    ranks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_of_equal_values_are_their_mean() {
        assert_eq!(ranks(&[3.0, 1.0, 3.0, 2.0]), [2.5, 0.0, 2.5, 1.0]);
    }

    #[test]
    fn a_rank_correlation_knows_only_the_order() {
        let x: Vec<f64> = (0..100).map(f64::from).collect();
        let of = |f: fn(f64) -> f64| spearman(&x, &x.iter().copied().map(f).collect::<Vec<_>>());
        assert!((of(|x| x.powi(3)).unwrap() - 1.0).abs() < 1e-12);
        assert!((of(|x| -(x + 1.0).ln()).unwrap() + 1.0).abs() < 1e-12);
        assert!(of(|x| (x - 49.5).abs()).unwrap().abs() < 1e-12);
        assert_eq!(of(|_| 1.0), None);
        assert_eq!(spearman(&x[..5], &x[..5]), None);
        // ranks 0..4 against 1, 0, 2, 4, 3, five times each: 1 - 6 * 4 / (5 * 24)
        let five = |of: [f64; 5]| of.repeat(5);
        let found = spearman(&five([1.0, 2.0, 3.0, 4.0, 5.0]), &five([2.0, 1.0, 3.0, 5.0, 4.0])).unwrap();
        assert!((found - 0.8).abs() < 1e-12, "{found}");
    }

    #[test]
    fn quantiles_lie_between_the_values() {
        let sorted: Vec<f64> = (0..=100).map(f64::from).collect();
        assert_eq!(QUANTILES.map(|share| quantile(&sorted, share)), [5.0, 25.0, 50.0, 75.0, 95.0]);
        assert_eq!(quantile(&[1.0, 2.0], 0.5), 1.5);
    }
}
