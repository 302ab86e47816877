//! Mean speed over a few frames.

use crate::math;
use std::ops::Range;

/// Slope of a channel over the frames present in `frames`, m/s, by least squares; `None` for fewer than two,
/// or outside the recording.
#[must_use]
pub fn mean_speed_m_per_s(samples: &[Option<f64>], frame_rate_hz: f64, frames: Range<usize>) -> Option<f64> {
    let first = frames.start;
    let points: Vec<(f64, f64)> = samples
        .get(frames)?
        .iter()
        .enumerate()
        .filter_map(|(i, x)| Some(((first + i) as f64 / frame_rate_hz, (*x)?)))
        .collect();
    let count = points.len() as f64;
    let mean = points.iter().fold((0.0, 0.0), |sum, p| (sum.0 + p.0 / count, sum.1 + p.1 / count));
    let (spread, both) = points.iter().fold((0.0, 0.0), |sum, p| {
        (sum.0 + math::powi(p.0 - mean.0, 2), sum.1 + (p.0 - mean.0) * (p.1 - mean.1))
    });
    (spread > 0.0).then(|| both / spread)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_speed_of_a_line_is_its_slope_also_with_gaps() {
        let line: Vec<Option<f64>> =
            (0..100).map(|i| (i % 3 != 0).then(|| 0.5 - 0.2 * f64::from(i) / 1000.0)).collect();
        assert!((mean_speed_m_per_s(&line, 1000.0, 20..60).unwrap() + 0.2).abs() < 1e-12);
        assert_eq!(mean_speed_m_per_s(&line, 1000.0, 60..62), None, "one point alone");
        assert_eq!(mean_speed_m_per_s(&line, 1000.0, 90..101), None);
    }
}
