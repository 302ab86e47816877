//! Rank correlation of the maps of a study with its parameters.
//!
//! A large study is reduced to an even selection of its points, so that memory does not grow with their
//! number.

use super::grid::SweepAxis;
use super::point::PointOutcome;
use super::study::Study;
use serde::Serialize;

/// Maximum count of numbers in memory: the values of all maps plus the coordinates of all selected points.
const MOST_NUMBERS: usize = 2_000_000;
/// Maximum number of selected points; with this number, the error of a correlation is below 0.01.
const MOST_POINTS: usize = 200_000;
/// Minimum number of points with a value for which a correlation is computed.
const FEWEST_PAIRS: usize = 20;

/// Values of every map at a selection of the points.
#[derive(Debug, Clone)]
pub struct RankCorrelations {
    /// Fraction of the points that are selected.
    share: f64,
    /// Coordinates of the selected points, one list per axis.
    places: Vec<Vec<f64>>,
    /// Values at the selected points, one list per map.
    values: Vec<Vec<Option<f64>>>,
}

/// Spearman's rank correlation of a map with a parameter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct RankCorrelation {
    /// Name of the parameter.
    pub parameter: &'static str,
    /// Value from -1 to 1; `None` if there are too few values or if all are equal.
    pub rank_correlation: Option<f64>,
}

impl RankCorrelations {
    pub(crate) fn new(study: &Study) -> Self {
        let (axes, maps) = (study.axes.len(), study.maps.len());
        let most = (MOST_NUMBERS / (axes + maps).max(1)).min(MOST_POINTS);
        let share = (most as f64 / study.point_count().max(1) as f64).min(1.0);
        Self { share, places: vec![Vec::new(); axes], values: vec![Vec::new(); maps] }
    }

    /// Adds a point to the selection, or leaves it out.
    pub(crate) fn look(&mut self, study: &Study, index: usize, outcome: &PointOutcome) {
        // the fractional parts of multiples of the golden ratio are spread evenly, also over any regular part
        // of a grid
        if (index as f64 * 0.618_033_988_749_894_9).fract() >= self.share {
            return;
        }
        self.places.iter_mut().zip(study.point_values(index)).for_each(|(places, place)| places.push(place));
        let values = outcome.values.iter().map(|value| value.ok()).chain(std::iter::repeat(None));
        self.values.iter_mut().zip(values).for_each(|(values, value)| values.push(value));
    }

    /// Rank correlations of map number `map` with every parameter.
    pub(crate) fn of_map(&self, study: &Study, map: usize) -> Vec<RankCorrelation> {
        let of = |(at, axis): (usize, &SweepAxis)| {
            let pairs = self.places[at].iter().zip(&self.values[map]);
            let (x, y): (Vec<f64>, Vec<f64>) = pairs.filter_map(|(x, y)| Some((*x, (*y)?))).unzip();
            RankCorrelation { parameter: axis.parameter.name, rank_correlation: spearman_correlation(&x, &y) }
        };
        study.axes.iter().enumerate().map(of).collect()
    }
}

/// Spearman's rank correlation of paired lists; `None` for short or constant lists.
pub(crate) fn spearman_correlation(x: &[f64], y: &[f64]) -> Option<f64> {
    if x.len() < FEWEST_PAIRS {
        return None;
    }
    let (x, y) = (rank_values(x), rank_values(y));
    let mean = 0.5 * (x.len() as f64 - 1.0);
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - mean) * (b - mean)).sum::<f64>();
    let scale = (product(&x, &x) * product(&y, &y)).sqrt();
    (scale > 0.0).then(|| product(&x, &y) / scale)
}

/// Ranks, counted from 0; equal values share their mean rank.
fn rank_values(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    portable_math::sort_by_number(&mut order, |a| values[*a]);
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
        assert_eq!(rank_values(&[3.0, 1.0, 3.0, 2.0]), [2.5, 0.0, 2.5, 1.0]);
    }

    #[test]
    fn a_rank_correlation_knows_only_the_order() {
        let x: Vec<f64> = (0..100).map(f64::from).collect();
        let of = |f: fn(f64) -> f64| spearman_correlation(&x, &x.iter().copied().map(f).collect::<Vec<_>>());
        assert!((of(|x| x.powi(3)).unwrap() - 1.0).abs() < 1e-12);
        assert!((of(|x| -(x + 1.0).ln()).unwrap() + 1.0).abs() < 1e-12);
        assert!(of(|x| (x - 49.5).abs()).unwrap().abs() < 1e-12);
        assert_eq!(of(|_| 1.0), None);
        assert_eq!(spearman_correlation(&x[..5], &x[..5]), None);
        // each rank five times; Spearman's formula for the ranks 1 to 5: 1 - 6 * 4 / (5 * 24)
        let five = |of: [f64; 5]| of.repeat(5);
        let found =
            spearman_correlation(&five([1.0, 2.0, 3.0, 4.0, 5.0]), &five([2.0, 1.0, 3.0, 5.0, 4.0])).unwrap();
        assert!((found - 0.8).abs() < 1e-12, "{found}");
    }
}
