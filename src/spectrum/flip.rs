//! A step inside the record: where a window that no sum of trend and oscillations describes may be cut.

/// Shares of the whole change between which a record is on neither side.
const SIDES: (f64, f64) = (0.25, 0.75);
/// Places behind the step that are tried, in times from a quarter to three quarters of the change: a step
/// that dies away exponentially has tails there which a relaxation or two describe.
const BEHIND: [f64; 5] = [1.0, 2.0, 3.0, 5.0, 8.0];

/// Times by which a record is at least as long as its way back from a dip: the drop of a head is near its
/// level before and after a flip, and comes back in a jump, which no slow wave does.
const DIP: usize = 20;

/// First frames of the parts behind the step that are worth a try, earliest first; none where the record
/// changes sides to and fro, as an oscillation does, or not within a third of its length, as a trend does.
pub(super) fn starts_behind(samples: &[Option<f64>]) -> Vec<usize> {
    let Some((leaves, arrives)) = step(samples) else { return Vec::new() };
    let width = (arrives - leaves).max(1);
    if 3 * width > samples.len() {
        return Vec::new();
    }
    let starts = BEHIND.iter().map(|times| arrives + (times * width as f64).round() as usize);
    starts.filter(|start| *start < samples.len()).collect()
}

/// The last frame on the old side and the first on the new one, if the record changes sides once, or comes
/// back from a dip.
fn step(samples: &[Option<f64>]) -> Option<(usize, usize)> {
    let (low, high) =
        samples.iter().flatten().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
    let side = |x: f64| match (x - low) / (high - low) {
        share if share < SIDES.0 => Some(false),
        share if share > SIDES.1 => Some(true),
        _ => None,
    };
    let sided: Vec<(usize, bool)> =
        samples.iter().enumerate().filter_map(|(i, x)| Some((i, side((*x)?)?))).collect();
    let changes: Vec<(usize, usize)> =
        sided.windows(2).filter(|w| w[0].1 != w[1].1).map(|w| (w[0].0, w[1].0)).collect();
    match changes[..] {
        [change] => Some(change),
        [_, (leaves, arrives)] if DIP * (arrives - leaves) <= samples.len() => Some((leaves, arrives)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn record(value: impl Fn(f64) -> f64) -> Vec<Option<f64>> {
        (0..300).map(|i| (i % 7 != 3).then(|| value(f64::from(i)))).collect()
    }

    #[test]
    fn a_step_is_found_where_it_is() {
        let starts = starts_behind(&record(|i| ((i - 100.0) / 10.0).tanh() + 0.1 * (0.7 * i).sin()));
        assert_eq!(starts.len(), BEHIND.len());
        assert!((110..125).contains(&starts[0]), "{starts:?}");
        assert!(starts.is_sorted() && *starts.last().unwrap() < 300);
    }

    #[test]
    fn a_dip_ends_where_the_record_comes_back_in_a_jump() {
        let back = |i: f64| if i < 120.0 { 1.0 - (i / 115.0).min(1.0) } else { 1.0 };
        let starts = starts_behind(&record(back));
        assert!((120..130).contains(&starts[0]), "{starts:?}");
        assert!(starts_behind(&record(|i| (TAU * i / 300.0).cos())).is_empty(), "a slow wave");
        assert!(
            starts_behind(&record(|i| if (60.0..120.0).contains(&i) || i > 200.0 { 1.0 } else { 0.0 }))
                .is_empty()
        );
    }

    #[test]
    fn oscillations_and_slow_changes_are_no_step() {
        assert!(starts_behind(&record(|i| (0.1 * i).sin())).is_empty());
        assert!(starts_behind(&record(|i| i)).is_empty());
        assert!(starts_behind(&record(|_| 1.0)).is_empty());
        assert!(starts_behind(&[None; 20]).is_empty());
    }
}
