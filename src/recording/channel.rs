//! Channels derived from a recording, and the windows and instants that delimit parts of them.

mod flip;
mod instants;
mod phase;
mod turns;
mod window;

use super::Recording;
pub use instants::{InstantKind, InstantNotFound, Reversal, ReversalInstants};
pub use phase::{PhaseWindow, ReversalPhase, phase_windows};
use portable_math as math;
use serde::Serialize;
use std::ops::Range;
pub use window::{Window, WindowEnd, WindowError};

/// A quantity with one value per frame, m.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub enum Channel {
    /// Deflection of the blade, `tip_x - head_x` = `v3 - v`.
    Deflection,
    /// Drop of the head towards the glass, `u` = `-head_y`.
    HeadDrop,
    /// Position of the lip tip along the sweep, `v3`.
    TipX,
    /// Position of the head along the sweep, `v`.
    HeadX,
}

/// A channel name that does not exist.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unknown channel `{found}`; {advice}")]
pub struct UnknownChannel {
    /// The name as written.
    pub found: String,
    /// The nearest known name, or the list of all names.
    pub advice: String,
}

impl Channel {
    /// Every channel, in the order of the documentation.
    pub(crate) const ALL: [Self; 4] = [Self::Deflection, Self::HeadDrop, Self::TipX, Self::HeadX];

    /// Name on the command line and in files.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Deflection => "deflection",
            Self::HeadDrop => "head-drop",
            Self::TipX => "tip-x",
            Self::HeadX => "head-x",
        }
    }

    /// Name in a sentence: `head drop`.
    pub(crate) fn label(self) -> String {
        self.name().replace('-', " ")
    }

    /// Parses a name that [`Self::name`] gives.
    ///
    /// # Errors
    /// [`UnknownChannel`] with the nearest known name.
    pub(crate) fn parse(text: &str) -> Result<Self, UnknownChannel> {
        let names = Self::ALL.map(Self::name);
        let channel = Self::ALL.into_iter().find(|c| c.name() == text);
        channel.ok_or_else(|| UnknownChannel {
            found: text.to_owned(),
            advice: crate::toml_file::suggest_key(text, &names),
        })
    }

    /// Names of the columns of a recording from which the channel is computed.
    pub(crate) fn columns(self) -> &'static [&'static str] {
        match self {
            Self::Deflection => &["tip-x", "head-x"],
            Self::HeadDrop => &["head-y"],
            Self::TipX => &["tip-x"],
            Self::HeadX => &["head-x"],
        }
    }

    /// Value of the channel in every frame, m; `None` if a point that the channel needs was not tracked.
    #[must_use]
    pub fn samples(self, recording: &Recording) -> Vec<Option<f64>> {
        let traces = recording.traces();
        match self {
            Self::Deflection => {
                let both = traces.tip_x_m.iter().zip(&traces.head_x_m);
                both.map(|(tip, head)| Some((*tip)? - (*head)?)).collect()
            }
            Self::HeadDrop => traces.head_y_m.iter().map(|y| y.map(|y| -y)).collect(),
            Self::TipX => traces.tip_x_m.clone(),
            Self::HeadX => traces.head_x_m.clone(),
        }
    }
}

impl std::str::FromStr for Channel {
    type Err = UnknownChannel;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Self::parse(text)
    }
}

impl std::fmt::Display for Channel {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

/// Least-squares slope of a channel over the tracked frames of `frames`, m/s; `None` for fewer than two
/// tracked frames or a range outside the recording.
pub(crate) fn mean_speed_m_per_s(
    samples: &[Option<f64>],
    frame_rate_hz: f64,
    frames: Range<usize>,
) -> Option<f64> {
    let present = frames.clone().zip(samples.get(frames)?);
    let points: Vec<(f64, f64)> =
        present.filter_map(|(frame, x)| Some((frame as f64 / frame_rate_hz, (*x)?))).collect();
    let (_, [spread, both]) = central_moments(&points);
    (spread > 0.0).then(|| both / spread)
}

/// Means of x and y, then the sum of `(x - mean x)^2` and the sum of `(x - mean x) (y - mean y)`.
pub(crate) fn central_moments(points: &[(f64, f64)]) -> ([f64; 2], [f64; 2]) {
    let count = points.len() as f64;
    let [x, y] = points.iter().fold([0.0; 2], |sum, p| [sum[0] + p.0 / count, sum[1] + p.1 / count]);
    let sums = points
        .iter()
        .fold([0.0; 2], |sum, p| [sum[0] + math::powi(p.0 - x, 2), sum[1] + (p.0 - x) * (p.1 - y)]);
    ([x, y], sums)
}

/// The tracked frames of a channel, the standard deviation of their noise, m, and the smallest change of
/// position between two tracked frames that is not zero, m (0 if the position never changes).
pub(super) struct TrackPoints {
    /// Frame number and position, m, of every tracked frame.
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

    /// Points from the frame `first` to the frame `last`.
    fn points_between(&self, first: f64, last: f64) -> &[(usize, f64)] {
        let first = self.index_at_frame(first);
        // (the times of two close turns may be in the wrong order)
        &self.points[first..self.index_at_frame(last + 1.0).max(first)]
    }
}

/// First and last tracked frame of a column.
pub(crate) fn tracked_span(samples: &[Option<f64>]) -> Option<(usize, usize)> {
    Some((samples.iter().position(Option::is_some)?, samples.iter().rposition(Option::is_some)?))
}

/// Frame number and position, m, of every tracked frame.
pub(super) fn present_points(samples: &[Option<f64>]) -> Vec<(usize, f64)> {
    // (the reallocations of a growing vector would make the search for instants a fifth slower)
    let mut points = Vec::with_capacity(samples.len());
    points.extend(samples.iter().enumerate().filter_map(|(frame, x)| x.map(|x| (frame, x))));
    points
}

/// Median of |x| of a standard normal variable.
pub(crate) const NORMAL_MEDIAN: f64 = 0.674_489_75;

/// Standard deviation of white noise on a smooth path, m, from the fourth differences of consecutive frames,
/// which are zero for a path that is a polynomial of degree 3 in time.
pub(super) fn noise_sd_m(points: &[(usize, f64)]) -> f64 {
    /// Fourth differences of white noise have 1 + 16 + 36 + 16 + 1 times the variance of the noise.
    const GAIN: f64 = 70.0;
    let in_a_row = points.windows(5).filter(|w| w[4].0 - w[0].0 == 4);
    let fourth = |w: &[(usize, f64)]| w[0].1 - 4.0 * w[1].1 + 6.0 * w[2].1 - 4.0 * w[3].1 + w[4].1;
    find_median(in_a_row.map(|w| fourth(w).abs())).map_or(0.0, |m| m / (NORMAL_MEDIAN * GAIN.sqrt()))
}

pub(crate) fn median_in_place(values: &mut [f64]) -> Option<f64> {
    (!values.is_empty()).then(|| math::select_number(values, values.len() / 2))
}

/// Median of the values of an iterator; the upper of two middle values.
pub(crate) fn find_median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    median_in_place(&mut collect_numbers(values.into_iter()))
}

/// Median of the values of an iterator; 0 without values.
pub(crate) fn median_or_zero(values: impl IntoIterator<Item = f64>) -> f64 {
    find_median(values).unwrap_or(0.0)
}

/// The values of an iterator that skips few. (A vector that grows would be copied several times.)
pub(crate) fn collect_numbers(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut all = Vec::with_capacity(values.size_hint().1.unwrap_or(0));
    all.extend(values);
    all
}

/// Index of the first point at or after a frame.
pub(super) fn index_at_frame(points: &[(usize, f64)], frame: f64) -> usize {
    points.partition_point(|p| (p.0 as f64) < frame)
}

/// Median position, m; `None` without points.
pub(super) fn median_position(points: &[(usize, f64)]) -> Option<f64> {
    find_median(points.iter().map(|p| p.1))
}

/// Median of a point and its two neighbours; the median removes an outlier of a single frame.
pub(super) fn median_of_three(points: &[(usize, f64)], index: usize) -> f64 {
    let last = points.len().saturating_sub(1);
    let [a, b, c] = [index.saturating_sub(1), index, (index + 1).min(last)].map(|i| points[i].1);
    a.max(b).min(a.min(b).max(c))
}

/// Smallest and largest value; infinity and minus infinity without values.
pub(crate) fn value_range(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(*x), high.max(*x)))
}

/// Median of every point and its two neighbours. The filter removes outliers of a single frame and hardly
/// changes a turn of the head, which takes many frames.
pub(super) fn median_filter(points: &[(usize, f64)]) -> Vec<f64> {
    (0..points.len()).map(|index| median_of_three(points, index)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{FrameGrid, Traces};

    #[test]
    fn a_channel_is_missing_where_any_of_its_points_is() {
        let traces = Traces {
            tip_x_m: vec![Some(3.0), None, Some(5.0)],
            tip_y_m: vec![None; 3],
            head_x_m: vec![Some(1.0), Some(1.0), None],
            head_y_m: vec![Some(-0.5), Some(0.25), None],
            ..Traces::default()
        };
        let recording =
            Recording::new("r", FrameGrid { start_s: 0.0, frame_rate_hz: 1000.0, frames: 3 }, traces, false)
                .unwrap();
        assert_eq!(Channel::Deflection.samples(&recording), [Some(2.0), None, None]);
        assert_eq!(Channel::HeadDrop.samples(&recording), [Some(0.5), Some(-0.25), None]);
    }

    #[test]
    fn names_round_trip_and_a_mistyped_one_names_the_nearest() {
        for channel in Channel::ALL {
            assert_eq!(Channel::parse(channel.name()), Ok(channel));
        }
        assert_eq!(
            Channel::parse("head_drop").unwrap_err().to_string(),
            "unknown channel `head_drop`; did you mean `head-drop`?"
        );
    }

    #[test]
    fn the_speed_of_a_line_is_its_slope_also_with_gaps() {
        let line: Vec<Option<f64>> =
            (0..100).map(|i| (i % 3 != 0).then(|| 0.5 - 0.2 * f64::from(i) / 1000.0)).collect();
        assert!((mean_speed_m_per_s(&line, 1000.0, 20..60).unwrap() + 0.2).abs() < 1e-12);
        assert_eq!(mean_speed_m_per_s(&line, 1000.0, 60..62), None, "one point alone");
        assert_eq!(mean_speed_m_per_s(&line, 1000.0, 90..101), None);
    }
}
