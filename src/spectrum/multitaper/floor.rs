//! The noise under the lines of a density: a running median, freed from the lines.

use super::map_parallel_above;
use crate::math;

/// Knots of the curve in the width of its window; between them it is a line through the logarithms.
const KNOTS_PER_WINDOW: usize = 4;
/// A bin this many times above the curve is taken for a line and not for noise: of 14 degrees of freedom one
/// bin in seventy is.
const LINE_RATIO: f64 = 2.0;

/// Times the curve is drawn again without the lines found; the skirts of a line 60 dB above the noise are
/// gone after three.
const FLOOR_PASSES: usize = 3;

/// Mean of the noise in every bin; `window` is the width of the median, bins, and `degrees` are those of
/// chi-square in a bin.
pub(super) fn noise_floor_curve(density: &[f64], window: usize, degrees: f64) -> Vec<f64> {
    let all = running_median(density, window, |_| true);
    let without_lines =
        |curve: Vec<f64>, _| running_median(density, window, |bin| density[bin] <= LINE_RATIO * curve[bin]);
    let mean_over_median = math::powi(1.0 - 2.0 / (9.0 * degrees), -3); // Wilson and Hilferty 1931
    (0..FLOOR_PASSES).fold(all, without_lines).into_iter().map(|m| m * mean_over_median).collect()
}

/// Running median over the bins that count; a window that holds fewer of them than half its width grows until
/// it does not, and at the ends it is cut.
fn running_median(density: &[f64], window: usize, counts: impl Fn(usize) -> bool + Sync) -> Vec<f64> {
    let Some(last) = density.len().checked_sub(1) else { return Vec::new() };
    let (half, step) = ((window / 2).max(1), (window / KNOTS_PER_WINDOW).max(1));
    let knots = last.div_ceil(step) + 1;
    let within = |centre: usize, half: usize| -> Vec<f64> {
        let bins = centre.saturating_sub(half)..centre.saturating_add(half + 1).min(density.len());
        bins.filter(|bin| counts(*bin)).map(|bin| density[bin]).collect()
    };
    let of_knot = |knot: usize| {
        let centre = (knot * step).min(last);
        let (mut reach, mut values) = (half, within(centre, half));
        while values.len() < half && reach < last {
            reach *= 2;
            values = within(centre, reach);
        }
        let middle = values.len() / 2;
        let median = if values.is_empty() {
            density[centre]
        } else {
            *values.select_nth_unstable_by(middle, f64::total_cmp).1
        };
        math::ln(median.max(f64::MIN_POSITIVE))
    };
    let logs = map_parallel_above(knots, density.len(), of_knot);
    let between = |bin: usize| {
        let knot = bin / step;
        let (from, to) = (knot * step, ((knot + 1) * step).min(last));
        let share = (bin - from) as f64 / (to.max(from + 1) - from) as f64;
        let next = logs.get(knot + 1).unwrap_or(&logs[knot]);
        math::exp(logs[knot] + share * (next - logs[knot]))
    };
    map_parallel_above(density.len(), density.len(), between)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_monotonous_density_is_followed_and_a_line_is_not() {
        let slope = |bin: usize| (-(bin as f64) / 300.0).exp();
        let mut density: Vec<f64> = (0..1000).map(slope).collect();
        density[480..520].iter_mut().for_each(|d| *d *= 1e6);
        let curve = noise_floor_curve(&density, 200, 1e9); // of endless degrees of freedom mean and median are one
        assert_eq!(curve.len(), 1000);
        // next to the line the median is that of the bins that are left, at most 20 bins aside: 7 %
        assert!((100..900).all(|bin| (curve[bin] / slope(bin) - 1.0).abs() < 0.07), "{:?}", &curve[380..620]);
        assert!([150, 300, 700, 850].iter().all(|bin| (curve[*bin] / slope(*bin) - 1.0).abs() < 1e-3));
    }

    #[test]
    fn few_bins_have_a_curve_too() {
        assert!(noise_floor_curve(&[], 10, 14.0).is_empty());
        assert!(noise_floor_curve(&[2.0], 10, 1e15).iter().all(|d| (d - 2.0).abs() < 1e-12));
        assert!(noise_floor_curve(&[2.0; 7], 3, 1e15).iter().all(|d| (d - 2.0).abs() < 1e-12));
    }
}
