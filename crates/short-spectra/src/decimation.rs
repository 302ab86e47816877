//! Records in which only every second, third ... frame was kept, as from a camera of that lower rate.

/// First frame with a value, and distance between the kept frames; `None` if this distance is one frame.
pub(super) fn find_stride(samples: &[Option<f64>]) -> Option<(usize, usize)> {
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

/// The kept frames of a record: the frame `first` and every `stride`-th frame after it.
pub(super) fn decimate(samples: &[Option<f64>], (first, stride): (usize, usize)) -> Vec<Option<f64>> {
    samples.iter().skip(first).step_by(stride).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(keeps: impl Fn(usize) -> bool) -> Vec<Option<f64>> {
        (0..100).map(|i| keeps(i).then_some(i as f64)).collect()
    }

    #[test]
    fn the_distance_of_kept_frames_is_their_greatest_common_divisor() {
        assert_eq!(find_stride(&record(|_| true)), None);
        assert_eq!(find_stride(&record(|i| i % 2 == 1)), Some((1, 2)));
        assert_eq!(find_stride(&record(|i| i % 3 == 2 && i % 5 != 0)), Some((2, 3)));
        assert_eq!(find_stride(&record(|i| i % 3 != 1)), None, "two of three");
        assert_eq!(find_stride(&record(|i| i == 7)), None);
        assert_eq!(find_stride(&record(|_| false)), None);
        assert_eq!(decimate(&record(|i| i % 40 == 5), (5, 40)), [Some(5.0), Some(45.0), Some(85.0)]);
    }
}
