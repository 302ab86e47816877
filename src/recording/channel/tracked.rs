//! The tracked frames of a channel, their noise and their medians.

/// The tracked frames of a channel and what their noise is.
pub(super) struct TrackPoints {
    /// Frame and position, m.
    pub points: Vec<(usize, f64)>,
    pub noise_m: f64,
    pub step_m: f64,
}

impl TrackPoints {
    pub(super) fn from_samples(samples: &[Option<f64>]) -> Self {
        let points = present_points(samples);
        let noise_m = noise_sd_m(&points);
        let steps = points.windows(2).map(|w| (w[1].1 - w[0].1).abs()).filter(|step| *step > 0.0);
        let step_m = steps.fold(f64::INFINITY, f64::min);
        Self { points, noise_m, step_m: if step_m.is_finite() { step_m } else { 0.0 } }
    }

    /// Index of the first point at or after a frame.
    pub(super) fn index_at_frame(&self, frame: f64) -> usize {
        index_at_frame(&self.points, frame)
    }
}

/// Frame and position, m, of the tracked frames.
pub(super) fn present_points(samples: &[Option<f64>]) -> Vec<(usize, f64)> {
    // (growing it would take a fifth of the search for instants)
    let mut points = Vec::with_capacity(samples.len());
    points.extend(samples.iter().enumerate().filter_map(|(frame, x)| x.map(|x| (frame, x))));
    points
}

/// Standard deviation of white noise on a smooth path, from fourth differences over frames in a row:
/// polynomials up to the third degree drop out.
pub(super) fn noise_sd_m(points: &[(usize, f64)]) -> f64 {
    /// Fourth differences of white noise have 1 + 16 + 36 + 16 + 1 times its variance.
    const GAIN: f64 = 70.0;
    /// Median of |x| of a standard normal variable.
    const NORMAL_MEDIAN: f64 = 0.674_489_75;
    let in_a_row = points.windows(5).filter(|w| w[4].0 - w[0].0 == 4);
    let mut differences = Vec::with_capacity(points.len());
    differences
        .extend(in_a_row.map(|w| (w[0].1 - 4.0 * w[1].1 + 6.0 * w[2].1 - 4.0 * w[3].1 + w[4].1).abs()));
    median_in_place(&mut differences).map_or(0.0, |m| m / (NORMAL_MEDIAN * GAIN.sqrt()))
}

pub(super) fn median_in_place(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Index of the first point at or after a frame.
pub(super) fn index_at_frame(points: &[(usize, f64)], frame: f64) -> usize {
    points.partition_point(|p| (p.0 as f64) < frame)
}

/// Median position, m; `None` of no points.
pub(super) fn median_position(points: &[(usize, f64)]) -> Option<f64> {
    median_in_place(&mut points.iter().map(|p| p.1).collect::<Vec<_>>())
}

/// Median of a point and its neighbours: an outlier of a single frame makes no extremum and reaches no level.
pub(super) fn median_of_three(points: &[(usize, f64)], index: usize) -> f64 {
    let last = points.len().saturating_sub(1);
    let [a, b, c] = [index.saturating_sub(1), index, (index + 1).min(last)].map(|i| points[i].1);
    a.max(b).min(a.min(b).max(c))
}

/// Smallest and largest; the wrong way round when there is none.
pub(super) fn value_range(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(*x), high.max(*x)))
}

/// Medians of three points: an outlier of a single frame cannot make an extremum, and a turn is far longer.
pub(super) fn median_filter(points: &[(usize, f64)]) -> Vec<f64> {
    (0..points.len()).map(|index| median_of_three(points, index)).collect()
}
