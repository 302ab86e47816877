//! Positions that a tracking program wrote where it had lost the point: it repeats the last position, or it
//! joins two tracked positions by a straight line. Repeats make first differences zero; lines make second
//! differences zero.
//!
//! A real point also rests or moves along a line. So each run of such frames is compared with the noise
//! around it. For `k` differences in a row the joint density at zero is `(2 pi s^2)^(-k/2) det(G)^(-1/2)`,
//! where `s` is the standard deviation of the noise and `G` is the Gram matrix of the differences. The
//! probability that noise causes the run is this density times the volume in which the differences count as
//! zero.

use super::finding::Check;
use super::measurement::{MOST_POSITIONS, MeasuredColumn};
use super::untracked::{UntrackedFrames, join_runs};
use crate::recording::noise::differences::{difference_at, noise_of_differences};
use portable_math as math;
use std::f64::consts::TAU;
use std::ops::Range;

/// Orders of the differences from which the noise around a run is estimated. The smallest estimate counts,
/// because motion makes some of the estimates too large.
const NOISE_ORDERS: std::ops::RangeInclusive<usize> = 2..=5;
/// Number of frames on either side of a run from which the noise is taken.
const AROUND: usize = 40;
/// Orders of the differences from which the spacing of the values is taken: uniform motion does not
/// contribute to them.
const SPACING_ORDERS: [usize; 2] = [2, 3];
/// Probability of a zero difference above which an axis is not judged: a point at rest then stays within one
/// step for many frames.
const LIKELY_ZERO: f64 = 0.2;
/// Largest second difference that counts as zero, as a fraction of the noise, if the step is smaller than
/// this value.
const ZERO_SHARE: f64 = 1.0 / 300.0;
/// Largest second difference that counts as zero, in steps. Positions on a line that are rounded to steps
/// have second differences of at most one step.
const ROUNDED_STEPS: f64 = 1.01;
/// Number of values that the second difference of rounded positions on a line can have, in steps: -1, 0 and
/// 1.
const ROUNDED_VALUES: f64 = 3.0;
/// Ratio of the tolerated number of runs to `1 + expected`, where `expected` is the number of runs that noise
/// is expected to cause.
const BY_NOISE: f64 = 3.0;
/// No run is tolerated if noise is expected to cause fewer runs than this.
const NO_RUNS: f64 = 1e-3;
/// Smallest noise of an axis that moves, m; below a picometre, the noise is rounding of a point at rest.
const LEAST_NOISE_M: f64 = 1e-12;
/// Smallest jump after a run of repeats that shows a held point, in units of the value spacing or the noise,
/// whichever is larger.
const CERTAIN_STEPS: f64 = 4.0;
/// Smallest jump after a run of repeats that shows a held point, in units of a large change of speed around
/// the run.
const CHANGES_OF_SPEED: f64 = 2.5;
/// Quantile of the changes of speed around a run that counts as a large change: the few changes above it may
/// come from other faults.
const LARGE_CHANGE: f64 = 0.95;
/// Minimum number of changes of speed around a run: with fewer, the point rests in most frames.
const FEWEST_CHANGES: usize = AROUND / 2;
/// Minimum number of runs that are reported for a point with one axis, and of runs that only a jump
/// afterwards shows to be held: one or two may be rests of the blade itself.
const FEWEST_RUNS: usize = 3;

/// A column whose differences of one order are compared with zero.
struct DifferenceAxis<'a> {
    samples: &'a [Option<f64>],
    order: usize,
    noise_m: f64,
    /// Largest difference that counts as zero, m.
    zero_m: f64,
    /// Width of the range of differences that counts as zero, m.
    width_m: f64,
}

/// Distance between neighbouring values of a column, m: the sizes of its differences are sorted, and the
/// largest gap between neighbouring sizes below the median is taken. This is the step of a sensor even if the
/// conversion to metres made the steps unequal.
fn value_spacing(samples: &[Option<f64>]) -> f64 {
    let spacing = |order: usize| {
        let frames = (order..samples.len()).step_by(samples.len() / MOST_POSITIONS + 1);
        let mut sizes: Vec<f64> =
            frames.filter_map(|i| difference_at(samples, i, order)).map(f64::abs).collect();
        sizes.sort_unstable_by(f64::total_cmp);
        let below = sizes.get(..=sizes.len() / 2).unwrap_or_default();
        below.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max)
    };
    SPACING_ORDERS.map(spacing).into_iter().fold(f64::INFINITY, f64::min)
}

impl<'a> DifferenceAxis<'a> {
    /// Measures an axis; `None` if the column has no values, only one value, or too few frames for an
    /// estimate of the noise. `step_m` is the larger step of the two columns of the point, because both
    /// columns have the same number of decimals.
    fn measure_axis((column, spacing_m): &SpacedColumn<'a>, order: usize, step_m: f64) -> Option<Self> {
        let (samples, noise_m) = (column.samples, column.quality.noise_m?);
        let first = samples.iter().flatten().next()?;
        samples.iter().flatten().find(|value| *value != first)?;
        let zero_m = if order == 1 { 0.0 } else { (ROUNDED_STEPS * step_m).max(ZERO_SHARE * noise_m) };
        let width_m = spacing_m.max(step_m).max(ROUNDED_VALUES * zero_m);
        Some(Self { samples, order, noise_m, zero_m, width_m })
    }

    fn is_zero(&self, frame: usize) -> bool {
        // (every frame is looked at several times, and a difference of known order is faster)
        let difference = match self.order {
            1 => difference_at(self.samples, frame, 1),
            order => difference_at(self.samples, frame, order),
        };
        difference.is_some_and(|size| size.abs() <= self.zero_m)
    }

    /// Standard deviation of the noise around a run, m; motion makes it too large rather than too small.
    fn noise_around(&self, run: &Range<usize>) -> f64 {
        let of_order = |order: usize| {
            let before = run.start.saturating_sub(AROUND)..run.start;
            let after = run.end + order..self.samples.len().min(run.end + AROUND);
            let sizes = before.chain(after).filter_map(|i| difference_at(self.samples, i, order));
            noise_of_differences(sizes.map(f64::abs), order)
        };
        NOISE_ORDERS.filter_map(of_order).fold(self.noise_m, f64::min)
    }

    /// Probability that noise makes all differences of a run zero; 1 if it cannot be judged.
    fn chance(&self, run: &Range<usize>, noise_m: f64) -> f64 {
        let ratio = self.width_m / (TAU.sqrt() * noise_m);
        // determinants of the Gram matrices of `n` first or second differences
        let determinant = |n: f64| match self.order {
            1 => n + 1.0,
            _ => (n + 1.0) * (n + 2.0) * (n + 2.0) * (n + 3.0) / 12.0,
        };
        let judged = noise_m > LEAST_NOISE_M && ratio <= LIKELY_ZERO * determinant(1.0).sqrt();
        if judged { math::powi(ratio, run.len() as i32) / determinant(run.len() as f64).sqrt() } else { 1.0 }
    }

    /// Whether the point moves on while the column repeats its value: the position then jumps after the run
    /// by much more than the changes of speed around the run.
    fn moves_on(&self, run: &Range<usize>) -> Option<bool> {
        let at = |frame: usize| *self.samples.get(frame)?;
        let jump_m = (at(run.end)? - at(run.start.checked_sub(1)?)?).abs();
        let certain_m = CERTAIN_STEPS * self.width_m.max(self.noise_m);
        Some(jump_m >= certain_m.max(CHANGES_OF_SPEED * self.speed_change_around(run)?))
    }

    /// A large change of speed around a run, m: a high quantile of the sizes of the second differences of
    /// frames in which the point moves. `None` if the point rests in most frames.
    fn speed_change_around(&self, run: &Range<usize>) -> Option<f64> {
        let frames = run.start.saturating_sub(AROUND)..self.samples.len().min(run.end + AROUND);
        let moves = |frame: &usize| (0..3).all(|back| *frame >= back && !self.is_zero(frame - back));
        let changes = frames.filter(moves).filter_map(|i| difference_at(self.samples, i, 2));
        let mut sizes: Vec<f64> = changes.map(f64::abs).collect();
        sizes.sort_unstable_by(f64::total_cmp);
        let rank = (LARGE_CHANGE * sizes.len() as f64) as usize;
        sizes.get(rank).copied().filter(|_| sizes.len() >= FEWEST_CHANGES)
    }
}

/// Probability that noise causes a run on all axes of a point. Both axes of a point have about the same
/// noise, so the smaller estimate counts: motion affects it less. For a point with one axis, the axes of the
/// other point also enter the estimate.
fn point_chance(axes: &[DifferenceAxis<'_>], other: &[DifferenceAxis<'_>], run: &Range<usize>) -> f64 {
    let others = if axes.len() > 1 { &[] } else { other };
    let noise_m = axes.iter().chain(others).map(|axis| axis.noise_around(run)).fold(f64::INFINITY, f64::min);
    axes.iter().map(|axis| axis.chance(run, noise_m)).product()
}

/// A column with the distance between its values, m.
type SpacedColumn<'a> = (MeasuredColumn<'a>, f64);

fn measure_axes<'a>(point: &[SpacedColumn<'a>], order: usize) -> Vec<DifferenceAxis<'a>> {
    let step_m = point.iter().filter_map(|(column, _)| column.quality.step_m).fold(0.0, f64::max);
    point.iter().filter_map(|column| DifferenceAxis::measure_axis(column, order, step_m)).collect()
}

fn are_zero(axes: &[DifferenceAxis<'_>], frame: usize) -> bool {
    !axes.is_empty() && axes.iter().all(|axis| axis.is_zero(frame))
}

/// Runs of at least `fewest` consecutive frames that `is_event` accepts.
fn event_runs(frames: usize, fewest: usize, is_event: impl Fn(&usize) -> bool) -> Vec<Range<usize>> {
    let mut runs = join_runs((0..frames).filter(is_event).map(|i| i..i + 1));
    runs.retain(|run| run.len() >= fewest);
    runs
}

/// The least probable runs, in order of time: the largest number of them that far exceeds the number of
/// equally improbable runs expected from noise. Empty if there are fewer than `fewest`.
fn improbable_runs(
    runs: Vec<Range<usize>>,
    frames: usize,
    fewest: usize,
    chance: impl Fn(&Range<usize>) -> f64,
) -> Vec<Range<usize>> {
    let mut ranked: Vec<(f64, Range<usize>)> =
        runs.into_iter().map(|run| (frames as f64 * chance(&run), run)).collect();
    math::sort_by_number(&mut ranked, |a| a.0);
    let exceeds = |(rank, (expected, _)): (usize, &(f64, Range<usize>))| {
        let allowed = if *expected < NO_RUNS { 0.0 } else { BY_NOISE * (1.0 + expected) };
        (rank + 1) as f64 > allowed
    };
    let accepted = ranked.iter().enumerate().rposition(exceeds).map_or(0, |last| last + 1);
    ranked.truncate(if accepted < fewest { 0 } else { accepted });
    let mut runs: Vec<_> = ranked.into_iter().map(|(_, run)| run).collect();
    runs.sort_by_key(|run| run.start);
    runs
}

/// Minimum number of consecutive repeats of one point, or of points on a line between two others, that are
/// judged.
const FEWEST_FILLED: usize = 2;

/// Frames in which both points repeat the previous frame, frames in which one point repeats its last
/// position, and frames of one point on a straight line between others.
pub(super) fn find_filled_frames(columns: &[MeasuredColumn<'_>; 4]) -> Vec<UntrackedFrames> {
    let frames = columns[0].samples.len();
    let spaced = columns.map(|column| (column, value_spacing(column.samples)));
    let (tip, head) = spaced.split_at(2);
    let repeats = [measure_axes(tip, 1), measure_axes(head, 1)];
    let both = event_runs(frames, 1, |&i| repeats.iter().all(|axes| are_zero(axes, i)));
    let both = improbable_runs(both, frames, 1, |run| {
        let chances = [0, 1].map(|point| point_chance(&repeats[point], &repeats[1 - point], run));
        if chances.contains(&1.0) { 1.0 } else { chances[0] * chances[1] }
    });
    let mut frozen = vec![false; frames];
    both.iter().for_each(|run| frozen[run.clone()].fill(true));
    let mut found = vec![UntrackedFrames::new(Check::FrozenFrames, "", both)];
    for (point, (name, columns)) in [("tip", tip), ("head", head)].into_iter().enumerate() {
        let (repeats, other) = (&repeats[point], &repeats[1 - point]);
        let fewest = if repeats.len() > 1 { 1 } else { FEWEST_RUNS };
        let runs = event_runs(frames, FEWEST_FILLED, |&i| !frozen[i] && are_zero(repeats, i));
        let mut held: Vec<_> =
            runs.iter().filter(|run| repeats[0].moves_on(run).unwrap_or(false)).cloned().collect();
        held.truncate(if held.len() < FEWEST_RUNS { 0 } else { held.len() });
        held.extend(improbable_runs(runs, frames, fewest, |run| point_chance(repeats, other, run)));
        held.sort_by_key(|run| run.start);
        found.push(UntrackedFrames::new(Check::HeldPoints, name, held));
        let lines = measure_axes(columns, 2);
        let runs = event_runs(frames, FEWEST_FILLED, |&i| are_zero(&lines, i) && !are_zero(repeats, i));
        let straight = improbable_runs(runs, frames, fewest, |run| point_chance(&lines, other, run));
        // (a second difference belongs to its middle frame)
        let middle = straight.into_iter().map(|run| run.start - 1..run.end - 1);
        found.push(UntrackedFrames::new(Check::InterpolatedPoints, name, middle));
    }
    found
}
