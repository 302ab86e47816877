//! Detection of steps inside a record. The record may be cut at a step if no sum of trend and oscillations
//! describes the whole record.

use super::periodogram::upper_median;
use std::ops::Range;

/// Fractions of the range of a record between which a value belongs to the transition of a step.
const TRANSITION_BOUNDS: (f64, f64) = (0.25, 0.75);
/// Distances after a step, in widths of its transition, at which a fit is started. If the step is
/// exponential, relaxations can describe the tail that remains.
const STEP_WIDTHS_AFTER: [f64; 5] = [1.0, 2.0, 3.0, 5.0, 8.0];
/// Smallest allowed ratio of the length of a record to the duration of the return from a dip. Before and
/// after a dip the record is at about the same level, and it returns to this level in a jump, faster than any
/// slow wave.
const DIP_FRACTION: usize = 20;

/// First frames to try after a step, earliest first. Empty if the record changes sides repeatedly, as an
/// oscillation does, or if the step takes more than a third of the record, as a trend does.
pub(super) fn starts_after_step(samples: &[Option<f64>]) -> Vec<usize> {
    let Some((leaves, arrives)) = find_single_step(samples) else { return Vec::new() };
    let width = (arrives - leaves).max(1);
    if 3 * width > samples.len() {
        return Vec::new();
    }
    let starts = STEP_WIDTHS_AFTER.iter().map(|times| arrives + (times * width as f64).round() as usize);
    starts.filter(|start| *start < samples.len()).collect()
}

/// Distances from a step, in widths of its transition, at which a stretch next to it starts or ends. Only two
/// are tried, because a long record has many steps.
const STEP_WIDTHS_BESIDE: [f64; 2] = [1.0, 5.0];
/// Maximum number of steps of a piece of a record; a piece with more changes of side is an oscillation.
const MAX_STEPS: usize = 4;
/// Ratio of the length of a record to the distance between the two frames from which a slope is measured. It
/// is also the smallest allowed ratio of the length of a record to the duration of a step; a trend describes
/// slower changes.
const SLOPE_FRACTION: usize = 16;
/// Largest allowed ratio of the length of a record to the length of a stretch that is tried.
const LEAST_STRETCH_FRACTION: usize = 8;

/// The stretches between the steps of a record, in order, each with the ranges of frames to try: first the
/// range that reaches close to the steps, then one that keeps farther away. Without a step, the whole record.
pub(super) fn stretches_between_steps(samples: &[Option<f64>]) -> Vec<Vec<Range<usize>>> {
    let frames = samples.len();
    let sided = classify_sides(&remove_median_slope(samples));
    let changes = find_side_changes(&sided);
    let widest = changes.iter().map(|(leaves, arrives)| arrives - leaves).max().unwrap_or(0);
    let on_a_side = 2 * sided.len() >= samples.iter().flatten().count();
    if changes.is_empty() || changes.len() > MAX_STEPS || SLOPE_FRACTION * widest > frames || !on_a_side {
        return vec![vec![0..frames]];
    }
    let starts = std::iter::once((0, 0)).chain(changes.iter().copied());
    let ends = changes.iter().copied().chain([(frames, frames)]);
    let shrunk = |(start, end): ((usize, usize), (usize, usize)), times: f64| {
        let by = |(leaves, arrives): (usize, usize)| (times * (arrives - leaves) as f64).round() as usize;
        start.1 + by(start)..end.0.saturating_sub(by(end))
    };
    let tried = |ends| {
        let stretches = STEP_WIDTHS_BESIDE.iter().map(|times| shrunk(ends, *times));
        stretches.filter(|stretch| LEAST_STRETCH_FRACTION * stretch.len() >= frames).collect()
    };
    starts.zip(ends).map(tried).collect()
}

/// The record without its median slope, so that a steady movement does not count as a change of side.
fn remove_median_slope(samples: &[Option<f64>]) -> Vec<Option<f64>> {
    let apart = (samples.len() / SLOPE_FRACTION).max(1);
    let rise = |(a, b): (&Option<f64>, &Option<f64>)| a.zip(*b).map(|(a, b)| (b - a) / apart as f64);
    let slopes = samples.iter().zip(samples.iter().skip(apart)).filter_map(rise).collect();
    let slope = upper_median(slopes).unwrap_or(0.0);
    samples.iter().enumerate().map(|(i, x)| x.map(|x| x - slope * i as f64)).collect()
}

/// Last frame on the old side and first frame on the new side, if the record changes sides once or returns
/// from a dip.
fn find_single_step(samples: &[Option<f64>]) -> Option<(usize, usize)> {
    match find_side_changes(&classify_sides(samples))[..] {
        [change] => Some(change),
        [_, change] if DIP_FRACTION * (change.1 - change.0) <= samples.len() => Some(change),
        _ => None,
    }
}

/// The frames outside the transition of a step, each with whether it is on the upper side.
fn classify_sides(samples: &[Option<f64>]) -> Vec<(usize, bool)> {
    let (low, high) =
        samples.iter().flatten().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
    let side = |x: f64| match (x - low) / (high - low) {
        share if share < TRANSITION_BOUNDS.0 => Some(false),
        share if share > TRANSITION_BOUNDS.1 => Some(true),
        _ => None,
    };
    samples.iter().enumerate().filter_map(|(i, x)| Some((i, side((*x)?)?))).collect()
}

/// For each change of side, the last frame on the old side and the first frame on the new side.
fn find_side_changes(sided: &[(usize, bool)]) -> Vec<(usize, usize)> {
    sided.windows(2).filter(|w| w[0].1 != w[1].1).map(|w| (w[0].0, w[1].0)).collect()
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
        let starts = starts_after_step(&record(|i| ((i - 100.0) / 10.0).tanh() + 0.1 * (0.7 * i).sin()));
        assert_eq!(starts.len(), STEP_WIDTHS_AFTER.len());
        assert!((110..125).contains(&starts[0]), "{starts:?}");
        assert!(starts.is_sorted() && *starts.last().unwrap() < 300);
    }

    #[test]
    fn a_dip_ends_where_the_record_comes_back_in_a_jump() {
        let back = |i: f64| if i < 120.0 { 1.0 - (i / 115.0).min(1.0) } else { 1.0 };
        let starts = starts_after_step(&record(back));
        assert!((120..130).contains(&starts[0]), "{starts:?}");
        assert!(starts_after_step(&record(|i| (TAU * i / 300.0).cos())).is_empty(), "a slow wave");
        assert!(
            starts_after_step(&record(|i| if (60.0..120.0).contains(&i) || i > 200.0 { 1.0 } else { 0.0 }))
                .is_empty()
        );
    }

    #[test]
    fn stretches_lie_between_steps_and_farther_from_them_at_the_second_try() {
        let steps = |i: f64| {
            ((i - 80.0) / 3.0).tanh() - ((i - 200.0) / 3.0).tanh() + 0.1 * (0.7 * i).sin() + 0.02 * i
        };
        let stretches = stretches_between_steps(&record(steps));
        let tries: Vec<usize> = stretches.iter().map(Vec::len).collect();
        assert_eq!(tries, [2, 2, 2], "{stretches:?}");
        for (stretch, (from, to)) in stretches.iter().zip([(0, 80), (80, 200), (200, 300)]) {
            let (near, far) = (&stretch[0], &stretch[1]);
            assert!(from <= near.start && near.end <= to && near.len() > 60, "{stretches:?}");
            assert!(near.start <= far.start && far.end <= near.end && far.len() < near.len());
        }
    }

    #[test]
    fn a_record_without_steps_is_one_stretch() {
        let rings = |i: f64| (-i / 6.0).exp() * (1.1 * i).cos();
        let whole = 0..300;
        for samples in [record(rings), record(|i| (0.1 * i).sin()), record(|i| i * i), record(|_| 1.0)] {
            assert_eq!(stretches_between_steps(&samples), [vec![whole.clone()]]);
        }
    }

    #[test]
    fn oscillations_and_slow_changes_are_no_step() {
        assert!(starts_after_step(&record(|i| (0.1 * i).sin())).is_empty());
        assert!(starts_after_step(&record(|i| i)).is_empty());
        assert!(starts_after_step(&record(|_| 1.0)).is_empty());
        assert!(starts_after_step(&[None; 20]).is_empty());
    }
}
