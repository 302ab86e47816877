//! Lag between the tracks of tip and head, in frames.
//!
//! While the tip is on the glass, the head sinks as the blade leans, so the height of the head is a function
//! of the deflection in the same frame. If one track is shifted, the height follows the shifted deflection
//! less closely. A lag that grows, because one track lost frames and was renumbered, adds speed times lag to
//! the deflection; this is visible without heights.

use super::finding::{Check, QualityFinding, Severity};
use super::measurement::Quality;
use super::regression::{fit_rows, polynomial_row};
use crate::recording::Traces;
use crate::recording::channel::find_median;
use std::ops::Range;

/// Largest accepted growth of a lag over the recording, as a fraction of the number of frames: a loss of more
/// than a tenth of a track would be noticed.
const MOST_GROWTH: f64 = 0.1;
/// Largest lag that is tried, frames.
const MOST_LAG: isize = 40;
/// Smallest lag that is reported, frames: neck and lip bend with a phase lag of one or two frames.
const LEAST_LAG: isize = 3;
/// A lag counts as growing if the lags in the two halves of a recording, or at its start and its end, differ
/// by at least this number of frames.
const LEAST_GROWTH: f64 = 5.0;
/// A lag is clear if the mean square of its residuals is below this fraction of the mean square without a
/// lag. In 97 clean films with a best lag of three frames or more, the fraction is at least 0.919.
const CLEARLY_BETTER: f64 = 0.9;
/// Replaces [`CLEARLY_BETTER`] if the residuals at the best lag are only noise: then nothing but a lag can
/// change the fraction.
const BETTER_IN_NOISE: f64 = 0.96;
/// Smallest decrease of the sum of squares at the best lag, in units of the mean square: the largest of the
/// decreases at 80 wrong lags, each of a fit with five coefficients to white noise, is about half as large.
const BEYOND_CHANCE: f64 = 40.0;
/// Residuals count as only noise if their mean square is below this multiple of the squared noise.
const NOISE_ALONE: f64 = 1.25;
/// A growing lag is accepted if the mean square of its residuals is below this fraction of the mean square
/// with a constant lag and a drift.
const GROWTH_EXPLAINS: f64 = 0.5;
/// Smallest speed of the head in the fit of a growing lag, as a fraction of the highest: a head at rest has
/// the same place in every frame, whatever the lag.
const MOVES: f64 = 0.05;
/// Maximum number of frames of a fit.
const MOST_ROWS: usize = 4_000;

/// The lag at which the height of the head follows the deflection best.
#[derive(Debug, Clone, Copy, PartialEq)]
struct BestLag {
    frames: isize,
    /// Whether the lag is large enough to be reported and the fit without it is clearly worse.
    clear: bool,
}

/// Lag of the tip's track behind the head's track, in frames, at the start and the end of the recording. Both
/// are equal unless the lag grows. `None` if no lag is visible. `slope` is that of the glass in the picture.
pub(super) fn measure_lag_frames(traces: &Traces, measured: &Quality, slope: f64) -> Option<[f64; 2]> {
    let frames = traces.tip_x_m.len();
    let best = |range: Range<usize>| best_lag(traces, range, measured.head_y.noise_m?, slope);
    let halves = [0..frames / 2, frames / 2..frames].map(best);
    if let [Some(first), Some(last)] = halves
        && first.clear
        && last.clear
        && first.frames.abs_diff(last.frames) as f64 >= LEAST_GROWTH
        && first.frames * last.frames >= 0
    {
        // (the lag of a half is its mean over this half)
        let half_growth = (last.frames - first.frames) as f64 / 2.0;
        return Some([first.frames as f64 - half_growth, last.frames as f64 + half_growth]);
    }
    let whole = best(0..frames).filter(|lag| lag.clear).map(|lag| [lag.frames as f64; 2]);
    whole.or_else(|| growing_lag_frames(traces))
}

fn best_lag(traces: &Traces, range: Range<usize>, noise_m: f64, slope: f64) -> Option<BestLag> {
    let (first, last) = (range.start + MOST_LAG as usize, range.end.checked_sub(MOST_LAG as usize)?);
    let middle = |samples: &[Option<f64>]| find_median(samples.iter().filter_map(|sample| *sample));
    let (tip_x, head_x, head_y) = (&traces.tip_x_m, &traces.head_x_m, &traces.head_y_m);
    let level_m = middle(&head_y[range.clone()])? - slope * middle(&head_x[range.clone()])?;
    let apart = || range.clone().filter_map(|i| Some(tip_x[i]? - head_x[i]?));
    let centre_m = find_median(apart())?;
    let reach_m = apart().map(|d| (d - centre_m).abs()).fold(0.0, f64::max);
    if last < first + 2 * MOST_LAG as usize || reach_m <= 0.0 {
        return None;
    }
    let mean_square = |lag: isize| {
        let row = |i: usize| {
            let deflection_m = tip_x[i.checked_add_signed(lag)?]? - head_x[i]?;
            let height_m = head_y[i]? - slope * head_x[i]? - level_m;
            Some((polynomial_row::<5>((deflection_m - centre_m) / reach_m), height_m))
        };
        let rows: Vec<_> = (first..last).step_by((last - first) / MOST_ROWS + 1).filter_map(row).collect();
        Some((lag, fit_rows(&rows)?.mean_square, rows.len() as f64))
    };
    let (_, unshifted, rows) = mean_square(0)?;
    let least_of = |lags: &mut dyn Iterator<Item = isize>| {
        lags.filter_map(mean_square).min_by(|a, b| a.1.total_cmp(&b.1))
    };
    let (near, ..) = least_of(&mut (-MOST_LAG..=MOST_LAG).step_by(2))?;
    let (frames, least, _) = least_of(&mut ((near - 1).max(-MOST_LAG)..=(near + 1).min(MOST_LAG)))?;
    let limit = if least < NOISE_ALONE * noise_m * noise_m { BETTER_IN_NOISE } else { CLEARLY_BETTER };
    let better = least < limit * unshifted && rows * (unshifted - least) > BEYOND_CHANCE * least;
    Some(BestLag { frames, clear: frames.abs() >= LEAST_LAG && better })
}

/// Lag at the start and the end of the recording, in frames, if it grows evenly, from a fit of the deflection
/// to the speed of the head. If the head moves at constant speed, a drift of one track looks like a growing
/// lag; only a lag that explains the deflection much better than a drift counts.
fn growing_lag_frames(traces: &Traces) -> Option<[f64; 2]> {
    let frames = traces.tip_x_m.len();
    let (half, head_x) = (frames / 100 + 2, &traces.head_x_m);
    let row = |i: usize| {
        let speed = (head_x[i + half]? - head_x[i - half]?) / (2 * half) as f64;
        let place = i as f64 / frames as f64 - 0.5;
        Some(([1.0, speed * 1e3, place, speed * 1e3 * place], traces.tip_x_m[i]? - head_x[i]?))
    };
    let every = frames / MOST_ROWS + 1;
    let mut growing: Vec<_> = (half..frames.saturating_sub(half)).step_by(every).filter_map(row).collect();
    let highest = growing.iter().map(|([_, speed, ..], _)| speed.abs()).fold(0.0, f64::max);
    growing.retain(|([_, speed, ..], _)| speed.abs() >= MOVES * highest);
    let constant: Vec<_> =
        growing.iter().map(|([one, speed, place, _], d)| ([*one, *speed, *place], *d)).collect();
    let (growing, constant) = (fit_rows(&growing)?, fit_rows(&constant)?);
    let [_, mean, _, growth] = growing.coefficients.map(|c| 1e3 * c);
    let explains = growing.mean_square < GROWTH_EXPLAINS * constant.mean_square;
    let possible = LEAST_GROWTH..=(MOST_GROWTH * frames as f64).min(MOST_LAG as f64);
    (explains && possible.contains(&growth.abs())).then_some([mean - growth / 2.0, mean + growth / 2.0])
}

/// Whether a lag, given at the start and at the end of a recording, grows.
pub(super) fn is_growing([start, end]: [f64; 2]) -> bool {
    (end - start).abs() >= 1.0
}

/// Finding on a lag between the tracks of tip and head.
pub(super) fn check_lag(lag_frames: Option<[f64; 2]>) -> Option<QualityFinding> {
    let [start, end] = lag_frames?;
    let behind = |lag: f64| {
        format!("{:.0} frames {} the head", lag.abs(), if lag < 0.0 { "ahead of" } else { "behind" })
    };
    let (value, found, advice) = if !is_growing([start, end]) {
        let found = format!(
            "the track of the tip is {}: the height of the head follows the deflection of other frames",
            behind(start)
        );
        let advice =
            "give both tracks the same frame numbers: check the first frame of each in the tracking program";
        (start.abs(), found, advice)
    } else {
        let found = format!(
            "the lag between tip and head grows: the track of the tip is {} at the start and {} at the end",
            behind(start),
            behind(end)
        );
        let advice =
            "one track lost frames and was renumbered without gaps: export both with their frame numbers";
        ((end - start).abs(), found, advice)
    };
    Some(QualityFinding::advise((Check::Lag, Severity::Caution), (value, "frames"), found, advice))
}
