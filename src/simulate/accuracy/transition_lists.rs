//! Comparison of two lists of transitions.

use crate::simulate::Transition;

/// Difference of a list of transitions from that of the reference.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct TransitionDifference {
    /// Number of transitions of the reference that the list lacks.
    pub missed: usize,
    /// Number of transitions of the list that the reference lacks.
    pub invented: usize,
    /// Largest difference between transition times, s; `None` if the lists differ or are empty.
    pub worst_s: Option<f64>,
}

impl TransitionDifference {
    /// Compares two lists. The lists agree if they have the same changes of mode in the same order.
    /// Otherwise, two transitions between the same modes form a pair if their times differ by less than half
    /// of the median time between successive transitions of the reference; the other transitions are missed
    /// or invented.
    pub(crate) fn from_lists(reference: &[Transition], found: &[Transition]) -> Self {
        let same =
            reference.len() == found.len() && reference.iter().zip(found).all(|(a, b)| is_of_one_kind(a, b));
        if same {
            let worst_s =
                reference.iter().zip(found).map(|(a, b)| (a.time_s - b.time_s).abs()).max_by(f64::total_cmp);
            return Self { missed: 0, invented: 0, worst_s };
        }
        let pairs = count_pairs(reference, found, 0.5 * median_gap(reference));
        let (missed, invented) = match (reference.len() - pairs, found.len() - pairs) {
            (0, 0) => (1, 1), // the lists differ only in order: one missed, one invented
            unpaired => unpaired,
        };
        Self { missed, invented, worst_s: None }
    }

    /// Whether the lists agree.
    pub(crate) fn is_empty(&self) -> bool {
        self.missed + self.invented == 0
    }
}

fn is_of_one_kind(a: &Transition, b: &Transition) -> bool {
    (a.from, a.to) == (b.from, b.to)
}

/// Number of pairs of transitions with the same modes, whose times differ by less than `apart_s`, s. Both
/// lists are in order of time.
fn count_pairs(reference: &[Transition], found: &[Transition], apart_s: f64) -> usize {
    let (mut i, mut j, mut count) = (0, 0, 0);
    while let (Some(a), Some(b)) = (reference.get(i), found.get(j)) {
        if is_of_one_kind(a, b) && (a.time_s - b.time_s).abs() < apart_s {
            (i, j, count) = (i + 1, j + 1, count + 1);
        } else if a.time_s <= b.time_s {
            i += 1;
        } else {
            j += 1;
        }
    }
    count
}

fn median_gap(list: &[Transition]) -> f64 {
    let mut gaps: Vec<f64> = list.windows(2).map(|pair| pair[1].time_s - pair[0].time_s).collect();
    gaps.sort_by(f64::total_cmp);
    gaps.get(gaps.len() / 2).copied().unwrap_or(f64::INFINITY)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::TransitionCause;
    use crate::simulate::mode::TipMode;

    fn list(times: &[f64]) -> Vec<Transition> {
        let modes = [TipMode::Stick, TipMode::SlipForward];
        let transition = |(i, time_s): (usize, &f64)| Transition {
            time_s: *time_s,
            from: modes[i % 2],
            to: modes[(i + 1) % 2],
            cause: TransitionCause::TipStops,
        };
        times.iter().enumerate().map(transition).collect()
    }

    #[test]
    fn equal_lists_are_as_far_apart_as_their_worst_pair() {
        let lists = TransitionDifference::from_lists(&list(&[1.0, 2.0, 3.0]), &list(&[1.0, 2.25, 3.125]));
        assert_eq!(lists, TransitionDifference { missed: 0, invented: 0, worst_s: Some(0.25) });
        assert_eq!(TransitionDifference::from_lists(&[], &[]), TransitionDifference::default());
    }

    #[test]
    fn what_has_no_partner_is_missed_or_invented() {
        let reference = list(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        let mut short = reference.clone();
        short.drain(2..4);
        assert_eq!(
            TransitionDifference::from_lists(&reference, &short),
            TransitionDifference { missed: 2, invented: 0, worst_s: None }
        );
        assert_eq!(
            TransitionDifference::from_lists(&short, &reference),
            TransitionDifference { missed: 0, invented: 2, worst_s: None }
        );
        let mut late = reference.clone();
        late[5].time_s = 7.0;
        late[5].to = TipMode::SlipBackward;
        assert_eq!(
            TransitionDifference::from_lists(&reference, &late),
            TransitionDifference { missed: 1, invented: 1, worst_s: None }
        );
    }
}
