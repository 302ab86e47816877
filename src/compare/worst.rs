//! Where a model is farthest from its recording.

use super::traces::MotionTraces;
use crate::recording::channel::Channel;

/// The channels by which a model is judged, the first that was tracked: stick and slip are seen best in the
/// deflection, which needs the head.
const JUDGED: [Channel; 3] = [Channel::Deflection, Channel::TipX, Channel::HeadX];
/// Least share of the frames of a part that hold a value: fewer frames scatter more, and would be the worst
/// by chance.
const LEAST_PRESENT: f64 = 0.5;

impl MotionTraces {
    /// The channel by which a residual is judged; `None` where none holds a value.
    #[must_use]
    pub fn judged(&self) -> Option<Channel> {
        JUDGED.into_iter().find(|channel| self.column(*channel).iter().any(Option::is_some))
    }

    /// The part of a length, s, with the greatest mean square of a channel between two instants, s: from when
    /// to when. All between the two where that is shorter; `None` without a value.
    #[must_use]
    pub fn worst_s(&self, channel: Channel, length_s: f64, (from_s, to_s): (f64, f64)) -> Option<(f64, f64)> {
        let first = self.time_s.partition_point(|t| *t < from_s);
        let end = self.time_s.partition_point(|t| *t <= to_s);
        let times = self.time_s.get(first..end)?;
        let column = self.column(channel).get(first..end)?;
        let (start_s, last_s) = (*times.first()?, *times.last()?);
        column.iter().flatten().next()?;
        let frames = (length_s / (last_s - start_s) * (times.len() - 1) as f64).round() as usize + 1;
        if frames >= times.len() || frames < 2 {
            return Some((start_s, last_s));
        }
        // squares and numbers of values before each frame
        let mut sums = vec![(0.0, 0usize)];
        for value in column {
            let (square, count) = sums.last().copied().unwrap_or_default();
            sums.push(value.map_or((square, count), |x| (square + x * x, count + 1)));
        }
        let mean = |at: usize| {
            let ((before, counted), (after, all)) = (sums[at], sums[at + frames]);
            let count = all - counted;
            let enough = count as f64 >= LEAST_PRESENT * frames as f64;
            enough.then(|| (at, (after - before) / count as f64))
        };
        let worst = (0..=times.len() - frames).filter_map(mean).reduce(|a, b| if b.1 > a.1 { b } else { a });
        worst.map_or(Some((start_s, last_s)), |(at, _)| Some((times[at], times[at + frames - 1])))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn residual(of: impl Fn(usize) -> Option<f64>) -> MotionTraces {
        MotionTraces {
            time_s: (0..1000).map(|i| i as f64 * 1e-3).collect(),
            tip_x_m: (0..1000).map(of).collect(),
            head_x_m: vec![None; 1000],
            deflection_m: vec![None; 1000],
            head_drop_m: vec![None; 1000],
        }
    }

    #[test]
    fn the_worst_part_is_where_the_residual_is_largest() {
        let found = residual(|i| Some(if (400..450).contains(&i) { 5.0 } else { 1.0 }));
        assert_eq!(found.judged(), Some(Channel::TipX));
        assert_eq!(found.worst_s(Channel::TipX, 0.049, (0.0, 1.0)), Some((0.4, 0.449)));
        assert_eq!(found.worst_s(Channel::TipX, 0.049, (0.5, 0.6)), Some((0.5, 0.549)));
        assert_eq!(found.worst_s(Channel::TipX, 3.0, (0.5, 0.6)), Some((0.5, 0.6)));
        assert_eq!(found.worst_s(Channel::HeadX, 0.01, (0.0, 1.0)), None);
    }

    #[test]
    fn a_single_frame_among_lost_ones_is_not_the_worst_part() {
        let gap = |i: usize| (100..200).contains(&i);
        let found = residual(|i| match i {
            150 => Some(9.0),
            600..620 => Some(2.0),
            _ => Some(1.0).filter(|_| !gap(i)),
        });
        assert_eq!(found.worst_s(Channel::TipX, 0.019, (0.0, 1.0)), Some((0.6, 0.619)));
    }
}
