//! Frame numbers from a column of times; the times may be rounded, and rows may be missing.

use portable_math as math;

/// Largest allowed distance of a row's time from the time of its frame, in frames. Rounding to half a frame
/// moves a time by up to a quarter of a frame; at more than a third, the nearest frame is uncertain.
pub(crate) const OFF_GRID_LIMIT_FRAMES: f64 = 0.3;

/// Largest allowed number of frames of a grid: 17 minutes at 10,000 frames/s. Times that span more frames
/// come from a damaged file.
pub(crate) const MAX_FRAMES: f64 = 10_000_000.0;
/// Maximum number of frames without a row: a fixed number plus a number per row. The limit keeps a small file
/// with a jump in its times from filling the memory.
pub(crate) const FRAMES_WITHOUT_ROWS: (usize, usize) = (250_000, 4);

/// Usual frame rates of films, television, telephones and high-speed cameras, 1/s.
pub(crate) const COMMON_RATES_HZ: [f64; 16] = [
    24_000.0 / 1001.0,
    24.0,
    25.0,
    30_000.0 / 1001.0,
    30.0,
    48.0,
    50.0,
    60_000.0 / 1001.0,
    60.0,
    100.0,
    120_000.0 / 1001.0,
    120.0,
    240_000.0 / 1001.0,
    240.0,
    480.0,
    960.0,
];
/// Highest of the common rates at which video is played back, 1/s.
const MOST_PLAYBACK_HZ: f64 = 60.0;
/// Largest relative difference at which a rate counts as a playback rate: it allows for rounded times and
/// still separates 29.97 from 30.
const PLAYBACK_NEARNESS: f64 = 1e-3;

/// Whether `rate_hz` is a playback rate. The time column of a video file often has this rate instead of the
/// recording rate.
pub(crate) fn is_playback_rate(rate_hz: f64) -> bool {
    let playback = COMMON_RATES_HZ.iter().filter(|rate| **rate <= MOST_PLAYBACK_HZ);
    playback.into_iter().any(|playback| (rate_hz / playback - 1.0).abs() <= PLAYBACK_NEARNESS)
}

/// After each row, the phase of the grid is corrected by this fraction of the row's distance from the grid.
/// If the first guess of the time per frame is wrong by 1 %, the phase lags by a tenth of a frame.
const PHASE_GAIN: f64 = 0.1;
/// Maximum number of digits to which a fitted frame rate is rounded.
const RATE_DIGITS: usize = 16;
/// Longest gap, in frames, that the runs of rows contain in each round in which the time per frame is
/// refined. If the runs have ten frames or more, they make it eight times as accurate, so the next round
/// counts longer gaps.
const RUN_GAPS: [usize; 4] = [1, 8, 64, 512];
/// Largest relative difference between the refined time per frame and the first guess, a median of rounded
/// steps: times rounded to half a frame have medians that are off by up to a quarter.
const MOST_REFINED: f64 = 0.3;
/// Maximum number of times that the rows are numbered again after a line was fitted; once suffices unless the
/// slope of the first line is far off.
const ROUNDS: usize = 4;

/// Frame numbers of the rows, and the line that fits their times.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FrameFit {
    /// Frame number of every row, counted from the first row.
    pub frames: Vec<usize>,
    /// Time from frame to frame, from the least-squares line, s.
    pub frame_s: f64,
    /// Time of frame 0 on that line, s.
    pub start_s: f64,
    /// Index of the row that is furthest from its frame.
    pub worst_row: usize,
    /// Distance of the row `worst_row` from its frame, in frames.
    pub worst_frames: f64,
}

impl FrameFit {
    /// Whether every row lies on the grid within [`OFF_GRID_LIMIT_FRAMES`].
    pub(crate) fn is_on_grid(&self) -> bool {
        self.worst_frames <= OFF_GRID_LIMIT_FRAMES
    }

    /// Distance of a row from its frame, frames.
    pub(crate) fn distance(&self, times_s: &[f64], row: usize) -> f64 {
        (times_s[row] - self.start_s - self.frame_s * self.frames[row] as f64).abs() / self.frame_s
    }

    /// Smallest number of frames from one row to the next; above 1 if only every n-th frame has a row.
    pub(crate) fn smallest_step(&self) -> usize {
        self.frames.windows(2).map(|w| w[1].saturating_sub(w[0])).min().unwrap_or(1)
    }
}

/// Assigns frame numbers to strictly increasing finite times on a grid; `seed_s` is a guess of the time per
/// frame, s. The phase of the grid follows the times slowly, so that errors of rounding or of the seed do not
/// accumulate and a damaged row does not shift the rows after it. Then a line is fitted and the rows are
/// numbered again. `None` for fewer than two rows, a seed that is not positive, or a grid longer than
/// [`MAX_FRAMES`].
pub(crate) fn number_frames(times_s: &[f64], seed_s: f64) -> Option<FrameFit> {
    let first = *times_s.first()?;
    let span_s = times_s.last()? - first;
    let is_too_long = |step_s: f64| {
        let frames = span_s / step_s;
        frames.is_nan() || frames + times_s.len() as f64 > MAX_FRAMES
    };
    if times_s.len() < 2 || seed_s <= 0.0 || is_too_long(seed_s) {
        return None;
    }
    let step_s = refine_step(times_s, first, seed_s);
    if is_too_long(step_s) {
        return None;
    }
    let mut frames = follow_grid(times_s, first, step_s);
    let mut line = fit_line(&frames, times_s);
    for _ in 0..ROUNDS {
        if !renumber_frames(&mut frames, times_s, line) {
            break;
        }
        line = fit_line(&frames, times_s);
    }
    Some(assess_fit(frames, times_s, line))
}

/// Time per frame from runs of rows without long gaps. A guess that comes from rounded times is too coarse to
/// count the frames of a long gap. The slope within the runs is more accurate, and each gap that is counted
/// makes it more accurate.
fn refine_step(times_s: &[f64], first: f64, seed_s: f64) -> f64 {
    let mut step_s = seed_s;
    for longest in RUN_GAPS {
        let frames = follow_grid(times_s, first, step_s);
        let slope = slope_within_runs(&frames, times_s, longest);
        step_s = slope.filter(|slope| (slope / seed_s - 1.0).abs() <= MOST_REFINED).unwrap_or(step_s);
        if frames.windows(2).all(|pair| pair[1].abs_diff(pair[0]) <= longest) {
            break;
        }
    }
    step_s
}

/// Adds a run of rows to the sums for the least-squares slope of time against frame number, about the means
/// of the run: products of frame and time, and squares of the frame. Returns the mean frame and the mean
/// time.
fn add_run([cross, square]: &mut [f64; 2], frames: &[usize], times_s: &[f64]) -> [f64; 2] {
    let count = frames.len() as f64;
    let rows = || frames.iter().zip(times_s).map(|(frame, time_s)| (*frame as f64, *time_s));
    let sums = rows().fold([0.0; 2], |sums, (frame, time_s)| [sums[0] + frame, sums[1] + time_s]);
    let [mean_frame, mean_s] = sums.map(|sum| sum / count);
    rows().for_each(|(frame, time_s)| {
        *cross += (frame - mean_frame) * (time_s - mean_s);
        *square += (frame - mean_frame) * (frame - mean_frame);
    });
    [mean_frame, mean_s]
}

/// Slope of time against frame number that all runs of rows share; a run ends where the next row is more than
/// `longest` frames away. `None` if no run has two frames.
fn slope_within_runs(frames: &[usize], times_s: &[f64], longest: usize) -> Option<f64> {
    let (mut sums, mut start) = ([0.0; 2], 0);
    for end in 1..=frames.len() {
        if end == frames.len() || frames[end].abs_diff(frames[end - 1]) > longest {
            add_run(&mut sums, &frames[start..end], &times_s[start..end]);
            start = end;
        }
    }
    (sums[1] > 0.0).then(|| sums[0] / sums[1])
}

/// Distance from a frame, in frames, within which a time certainly belongs to this frame, in spite of the
/// rounding of its computation.
const SURELY_NEAREST: f64 = 0.499;

/// Nearest frame of every row on a grid whose phase follows the rows with [`PHASE_GAIN`].
fn follow_grid(times_s: &[f64], first: f64, seed_s: f64) -> Vec<usize> {
    let (mut phase_s, mut next) = (first, 0.0);
    let mut number = |time: &f64| {
        let since_s = time - phase_s;
        // (nearly every row is the next frame; then no division delays the rows after it)
        let is_next = (since_s - next * seed_s).abs() < SURELY_NEAREST * seed_s;
        let frame = if is_next { next } else { math::round(since_s / seed_s).max(0.0) };
        phase_s += PHASE_GAIN * (since_s - frame * seed_s);
        next = frame + 1.0;
        frame as usize
    };
    times_s.iter().map(&mut number).collect()
}

/// Median time from row to row, s: the time per frame if most rows belong to consecutive frames. The shorter
/// of two middle values is taken, because gaps only lengthen these times.
pub(crate) fn median_step_s(times_s: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = times_s.windows(2).map(|w| w[1] - w[0]).collect();
    let middle = steps.len().checked_sub(1)? / 2;
    Some(math::select_number(&mut steps, middle))
}

/// The rate with the fewest digits near `fitted`, 1/s, for which `explains` is true; if there is none,
/// `fitted`.
pub(crate) fn simplest_rate(fitted: f64, explains: impl Fn(f64) -> bool) -> f64 {
    let mut rounded = (0..RATE_DIGITS).filter_map(|digits| format!("{fitted:.digits$e}").parse::<f64>().ok());
    rounded.find(|&rate| explains(rate)).unwrap_or(fitted)
}

/// Intercept and slope of the least-squares line of time against frame number.
fn fit_line(frames: &[usize], times_s: &[f64]) -> (f64, f64) {
    let mut sums = [0.0; 2];
    let [frame, time_s] = add_run(&mut sums, frames, times_s);
    let slope = if sums[1] > 0.0 { sums[0] / sums[1] } else { f64::NAN };
    (time_s - slope * frame, slope)
}

/// Numbers every row by its nearest frame on the fitted line. Returns whether a number changed; a line that
/// does not rise, or a grid that is too long, changes none.
fn renumber_frames(frames: &mut [usize], times_s: &[f64], (intercept, slope): (f64, f64)) -> bool {
    let nearest = |time: &f64| math::round((time - intercept) / slope);
    let (Some(first), Some(last)) = (times_s.first().map(nearest), times_s.last().map(nearest)) else {
        return false;
    };
    let mut changed = false;
    if slope > 0.0 && last - first < MAX_FRAMES {
        for (frame, time) in frames.iter_mut().zip(times_s) {
            let again = (nearest(time) - first) as usize;
            changed |= std::mem::replace(frame, again) != again;
        }
    }
    changed
}

/// Finds the row that is furthest off the grid. A row with the same frame as the row above it counts as one
/// frame further off.
fn assess_fit(frames: Vec<usize>, times_s: &[f64], (intercept, slope): (f64, f64)) -> FrameFit {
    let off = |row: usize| {
        let distance = (times_s[row] - intercept - slope * frames[row] as f64).abs() / slope;
        if row > 0 && frames[row] <= frames[row - 1] { distance + 1.0 } else { distance }
    };
    let farthest = (0..frames.len()).map(|row| (row, off(row))).max_by(|a, b| a.1.total_cmp(&b.1));
    let (worst_row, worst_frames) = farthest.unwrap_or_default();
    FrameFit { worst_frames, worst_row, frame_s: slope, start_s: intercept, frames }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounded_times_keep_their_frames_and_their_mean_rate() {
        let times: Vec<f64> = (0..600).map(|i| (f64::from(i) / 120.0 * 1000.0).round() / 1000.0).collect();
        let fit = number_frames(&times, median_step_s(&times).unwrap()).unwrap();
        assert_eq!(fit.frames, (0..600).collect::<Vec<_>>());
        assert!((1.0 / fit.frame_s - 120.0).abs() < 0.01, "{}", 1.0 / fit.frame_s);
        assert!(fit.is_on_grid());
    }

    #[test]
    fn the_frames_of_a_long_gap_are_counted_also_with_rounded_times() {
        for (rate_hz, gap) in [(1500.0, 300), (700.0, 300), (7000.0, 3000), (124.37, 900)] {
            let frames: Vec<usize> = (0..40).chain(40 + gap..80 + gap).collect();
            let rounded = |frame: &usize| (*frame as f64 / rate_hz * 1e5).round() / 1e5;
            let times: Vec<f64> = frames.iter().map(rounded).collect();
            let fit = number_frames(&times, median_step_s(&times).unwrap()).unwrap();
            assert_eq!(fit.frames, frames, "{rate_hz}");
        }
    }

    #[test]
    fn an_absent_row_is_a_gap_and_not_a_longer_frame() {
        let fit = number_frames(&[0.0, 0.001, 0.003, 0.004], 0.001).unwrap();
        assert_eq!(fit.frames, [0, 1, 3, 4]);
    }

    #[test]
    fn a_row_between_frames_does_not_hold() {
        let times: Vec<f64> = (0..20).map(|i| if i == 10 { 10.45 } else { f64::from(i) }).collect();
        let fit = number_frames(&times, 1.0).unwrap();
        assert_eq!(fit.worst_row, 10);
        assert!(!fit.is_on_grid());
    }

    #[test]
    fn every_second_frame_is_seen_as_a_step_of_two() {
        assert_eq!(number_frames(&[0.0, 0.002, 0.004, 0.006], 0.001).unwrap().smallest_step(), 2);
    }

    #[test]
    fn a_jump_of_years_is_refused_and_not_allocated() {
        assert_eq!(number_frames(&[0.0, 0.001, 43_513.0], 0.001), None);
    }
}
