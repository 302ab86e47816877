//! Records of which only every second, third ... frame was kept: they hold what a camera of that rate sees,
//! and nothing above half of it.

use super::analysis::{Analysis, Record};

/// First frame with a value, and the distance of which all later ones are multiples, where that is two
/// frames or more.
pub(super) fn stride(samples: &[Option<f64>]) -> Option<(usize, usize)> {
    let mut present = samples.iter().enumerate().filter(|(_, x)| x.is_some()).map(|(i, _)| i);
    let first = present.next()?;
    let divisor = |mut a: usize, mut b: usize| {
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    let stride =
        present.try_fold(0, |stride, i| Some(divisor(stride, i - first)).filter(|found| *found != 1))?;
    (stride > 1).then_some((first, stride))
}

/// The frames of such a record alone, at their own rate.
pub(super) fn kept(samples: &[Option<f64>], (first, stride): (usize, usize)) -> Vec<Option<f64>> {
    samples.iter().skip(first).step_by(stride).copied().collect()
}

impl Analysis {
    /// The analysis of the kept frames as one of the whole record. Between kept frames what was removed and
    /// the components are drawn straight.
    pub(super) fn spread(self, record: &Record, (first, stride): (usize, usize)) -> Self {
        let left_out = first + stride * self.left_out;
        let frames = record.samples.len() - left_out;
        let between = |values: &[f64]| {
            let at = |frame: usize| {
                let (kept, part) = (frame / stride, (frame % stride) as f64 / stride as f64);
                let value = |kept: usize| values.get(kept).or(values.last()).copied().unwrap_or_default();
                value(kept) + part * (value(kept + 1) - value(kept))
            };
            (0..frames).map(at).collect()
        };
        let left_m = (0..frames)
            .map(|frame| self.left_m.get(frame / stride).copied().flatten().filter(|_| frame % stride == 0))
            .collect();
        let (removed_m, model_m) = (between(&self.removed_m), between(&self.model_m));
        Self { left_out, stride, removed_m, model_m, left_m, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(keeps: impl Fn(usize) -> bool) -> Vec<Option<f64>> {
        (0..100).map(|i| keeps(i).then_some(i as f64)).collect()
    }

    #[test]
    fn the_distance_of_kept_frames_is_their_greatest_common_divisor() {
        assert_eq!(stride(&record(|_| true)), None);
        assert_eq!(stride(&record(|i| i % 2 == 1)), Some((1, 2)));
        assert_eq!(stride(&record(|i| i % 3 == 2 && i % 5 != 0)), Some((2, 3)));
        assert_eq!(stride(&record(|i| i % 3 != 1)), None, "two of three");
        assert_eq!(stride(&record(|i| i == 7)), None);
        assert_eq!(stride(&record(|_| false)), None);
        assert_eq!(kept(&record(|i| i % 40 == 5), (5, 40)), [Some(5.0), Some(45.0), Some(85.0)]);
    }
}
