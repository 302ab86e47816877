//! The values of the first and the last colour of a map.

/// Shares of the sorted values at the first and the last colour, where values beyond lie far away.
const COLOUR_QUANTILES: [f64; 2] = [0.02, 0.98];
/// How far the extreme value may lie beyond such a share, over what lies between the two, before the colours
/// end at the share: a smooth map keeps its extremes, one outlier does not stretch its colours.
const OUTLIER_DISTANCE: f64 = 0.25;
/// Fewest values of which some can be called outliers.
const MIN_OUTLIER_SAMPLES: usize = 8;

/// The first and last colour of finite values; `None` where they are too few, or nearly all equal: colours
/// then go from the least to the greatest.
pub(super) fn colour_limits(values: &[Option<f64>]) -> Option<(f64, f64)> {
    let mut sorted: Vec<f64> = values.iter().flatten().copied().filter(|v| v.is_finite()).collect();
    if sorted.len() < MIN_OUTLIER_SAMPLES {
        return None;
    }
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len() - 1;
    let [low, high] = COLOUR_QUANTILES.map(|share| share * last as f64);
    // inwards to a value, so that of few values the extreme one can be left out too
    let (low, high) = (sorted[low.ceil() as usize], sorted[high.floor() as usize]);
    let between = high - low;
    let end = |share: f64, extreme: f64| {
        if (extreme - share).abs() > OUTLIER_DISTANCE * between { share } else { extreme }
    };
    (between > 0.0).then(|| (end(low, sorted[0]), end(high, sorted[last])))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(values: &[f64]) -> Option<(f64, f64)> {
        colour_limits(&values.iter().copied().map(Some).collect::<Vec<_>>())
    }

    #[test]
    fn one_outlier_does_not_stretch_the_colours_and_a_smooth_map_keeps_its_ends() {
        let smooth: Vec<f64> = (0..50).map(f64::from).collect();
        assert_eq!(of(&smooth), Some((0.0, 49.0)));
        let outlier: Vec<f64> = smooth.iter().copied().chain([5000.0]).collect();
        assert_eq!(of(&outlier), Some((0.0, 49.0)));
        let below: Vec<f64> = smooth.iter().copied().chain([-5000.0]).collect();
        assert_eq!(of(&below), Some((0.0, 49.0)));
        assert_eq!(of(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 900.0]), Some((1.0, 8.0)));
    }

    #[test]
    fn few_values_and_constants_have_the_colours_of_their_ends() {
        assert_eq!(of(&[1.0, 2.0, 300.0]), None);
        assert_eq!(of(&[3.0; 20]), None);
        assert_eq!(colour_limits(&[None, Some(f64::NAN)]), None);
    }
}
