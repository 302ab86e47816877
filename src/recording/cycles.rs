//! Stick-slip cycles, counted in the path of the tip: instants and sizes of the slips, their rate, and the
//! period of the cycle with its scatter.
//!
//! The strokes of the tip are laid end to end, so that every slip leads forward. A line fitted to the frames
//! around each frame is subtracted. What is left rises in every slip and falls while the tip rests or lags.
//! Its extremes, found with hysteresis, give the rises. They are slips in one of two cases: they are clearly
//! shorter than the falls, or the tip comes to rest once a period and moves unlike a sinusoid. Noise and an
//! oscillation rise as slowly as they fall. Lines of growing length are tried until one is two to eight
//! periods long, and the rises are found again with a line of two periods. Instants and sizes of the slips
//! are then measured on the path itself, between the levels at which the tip rests.

use super::Recording;
use super::channel::{NORMAL_MEDIAN, central_moments, find_median, median_or_zero, value_range};
use super::noise::{noise_floor, quantisation_step};
use super::quality::{ChannelQuality, outlier_frames};
use crate::text::pluralise;
use portable_math as math;
use serde::Serialize;
use std::f64::consts::{FRAC_PI_2, TAU};
use std::ops::Range;

/// Minimum number of slips: with fewer, rises that are shorter than falls are no evidence.
const FEWEST_SLIPS: usize = 6;
/// Minimum number of tracked frames: six slips take at least two frames each, and a line needs frames on both
/// sides.
const FEWEST_FRAMES: usize = 16;
/// Hysteresis of the extremes, in standard deviations of the noise: noise alone makes fewer than one of ten
/// thousand pairs of frames differ by as much.
const HYSTERESIS: f64 = 6.0;
/// The usual rise must be this many times the hysteresis. Otherwise many of the slips would be missed, and
/// rises of noise would be counted.
const CLEAR_RISE: f64 = 1.75;
/// A slip is at least this fraction of the usual one. Smaller motions are part of a cycle.
const LEAST_SLIP: f64 = 0.3;
/// Largest mean fraction of a period that a rise may take; it is a half for a sinusoid.
const MOST_RISING: f64 = 0.45;
/// The fraction must be below a half by this number of its standard deviations, so that chance does not make
/// an oscillation a cycle.
const CLEAR_DEVIATIONS: f64 = 4.0;
/// Shortest line that is subtracted, frames, and ratio of each length that is tried to the one before. The
/// ratio is so small that a length falls into [`LINE_PERIODS`] for every period.
const LINES: (f64, f64) = (8.0, 1.3);
/// Smallest and largest ratio of the length of the line to the period. A shorter line follows the slips; a
/// longer one does not follow the stroke.
const LINE_PERIODS: (f64, f64) = (2.0, 8.0);
/// Length of the slowest part of a period, as a fraction of the period.
const SLOWEST_PART: f64 = 0.15;
/// The tip rests if its velocity in this part is at most this fraction of its mean. A velocity that falls to
/// zero and rises again along straight lines has 0.15; the fraction is larger if the part is not a whole
/// number of frames.
const SLOW_STEP: f64 = 0.25;
/// Largest motion against the stroke in a period with rest, as a fraction of the travel in the period: a tip
/// that swings moves back further.
const MOST_BACK: f64 = 0.02;
/// Largest mean fraction of a period that a rise may take if the tip comes to rest: a cycle whose rises are
/// as long as its falls has a half, and noise changes it a little.
const MOST_RISING_AT_REST: f64 = 0.53;
/// Smallest ratio of the second harmonic to the first with which a motion differs from a sinusoid. The first
/// number is the ratio that interpolated instants give a sinusoid; the second is in standard deviations of
/// the noise.
const DISTORTED: (f64, f64) = (0.006, 5.0);
/// Largest number of turns of the stroke per slip: an oscillation about a place turns twice a period and
/// rests at each turn.
const MOST_TURNS: f64 = 0.5;
/// The tip turns if it moves back by this fraction of its whole range; smaller motions back are part of a
/// cycle.
const TURN_SHARE: f64 = 0.2;
/// Fractions of a slip between which a line is fitted to the path if enough frames are there; the path is
/// curved near the rests.
const SLOPE_SHARES: (f64, f64) = (0.2, 0.8);
/// Minimum number of frames for that line. With fewer, the path is interpolated between the two frames around
/// the instant.
const FEWEST_ON_SLOPE: usize = 4;
/// Standard deviation, frames, of an instant that is interpolated between frames: its smallest value, and its
/// value per fraction of the slip that lies between the two frames. They bound the error that the curvature
/// of slips of 2 to 300 frames causes.
const INTERPOLATION: (f64, f64) = (0.01, 0.04);
/// Number of intervals on either side of an interval that, together with it, have the local period as their
/// median: the median of seven follows a drift and ignores three odd intervals.
const LOCAL_INTERVALS: usize = 3;
/// An interval of about two or three local periods has dropped beats if it differs from the whole number by
/// less than this fraction of the period.
const WHOLE_BEAT: f64 = 0.2;
/// A period is odd, and left out of the scatter, if it is off by more than this number of standard
/// deviations. They follow from the median, which odd periods do not change.
const ODD_DEVIATIONS: f64 = 4.0;
/// An interval of at least this number of local periods is a pause of the cycle: it is longer than two
/// dropped beats.
const PAUSE: f64 = 3.5;
/// Lost frames may hide a slip if they span at least this fraction of a period.
const MOST_LOST: f64 = 0.5;
/// The tip leaves its rest if it moves by this number of standard deviations of the noise, or by this
/// fraction of the slip.
const LEAVES_REST: (f64, f64) = (3.0, 0.02);
/// Sticks and slips have durations if the median stick spans at least this number of frames: the ends of a
/// shorter one are not known well enough.
const LEAST_STICK_FRAMES: f64 = 5.0;
/// Scatter of the period from which on the spectrum has no line: if independent periods scatter by a quarter,
/// the power density at their rate is less than twice that around it. `period_scatter` of such periods is
/// 0.22, because each period is one of the seven of its local period.
const NO_LINE_SCATTER: f64 = 0.22;
/// Ratio of the longest local period to the shortest from which the mean is not the period of any part: a
/// fifth is more than the noise of a median of seven.
const CHANGING: f64 = 1.2;
/// Smallest noise of a camera, m; a smaller noise of the head comes from rounding.
const ROUNDING_M: f64 = 1e-9;
/// Largest ratio of the noise of the tip to that of the head: a larger difference between neighbouring frames
/// of the tip is a fast cycle, not noise.
pub(crate) const MOST_UNLIKE: f64 = 2.0;

/// One slip of the tip.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TipSlip {
    /// Time at which the tip is half way, s.
    pub time_s: f64,
    /// Standard deviation of the time, s.
    pub time_sd_s: f64,
    /// Distance from the rest before to the rest after the slip, m.
    pub size_m: f64,
    /// Standard deviation of the distance, m.
    pub size_sd_m: f64,
}

/// Durations of sticks and slips.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StickTimes {
    /// Median duration of a stick, s.
    pub stick_s: f64,
    /// Median duration of a slip, s.
    pub slip_s: f64,
}

/// The stick-slip cycle of a recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CountedCycle {
    /// Number of slips whose rest before and after is recorded.
    pub count: usize,
    /// Slips per second, 1/s.
    pub rate_hz: f64,
    /// Standard deviation of the rate, 1/s, from the noise, the scatter of the period and the clock.
    pub rate_sd_hz: f64,
    /// Mean period of the cycle, s; a dropped beat counts as a period.
    pub period_s: f64,
    /// Standard deviation of the mean period, s, from the noise and the clock, without the scatter.
    pub period_sd_s: f64,
    /// Standard deviation of a single period, relative to the local period, which is the median of seven. A
    /// few odd periods are left out, and the errors of the instants are subtracted.
    pub period_scatter: f64,
    /// Number of beats of the cycle without a slip.
    pub dropped_beats: usize,
    /// Median size of a slip, m.
    pub size_m: f64,
    /// Standard deviation of the sizes of the slips, relative to their mean.
    pub size_scatter: f64,
    /// Mean fraction of a period in which the tip is faster than the line that is subtracted from its path.
    pub rising_fraction: f64,
    /// Durations of sticks and slips; `None` if the sticks span too few frames.
    pub times: Option<StickTimes>,
    /// Limits of these numbers, in words.
    pub remarks: Vec<String>,
    /// The slips, in order of time.
    pub slips: Vec<TipSlip>,
}

/// Why no cycle is counted, in words.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct NoCycle(String);

impl Recording {
    /// Counts the stick-slip cycles of the tip in a range of frames of the grid.
    ///
    /// # Errors
    /// [`NoCycle`] with the reason: too few tracked frames, too few slips that are clear of the
    /// noise, too many frames lost between slips, or a motion that may be an oscillation without sticks.
    pub fn count_cycles(&self, frames: Range<usize>) -> Result<CountedCycle, NoCycle> {
        let (tip, head) = (&self.traces.tip_x_m, &self.traces.head_x_m);
        let inside = tip.get(frames.clone()).unwrap_or_default();
        let tracked = inside.iter().flatten().count();
        if tracked < FEWEST_FRAMES {
            let found = format!("the tip is tracked in {tracked} frames, expected at least {FEWEST_FRAMES}");
            return Err(NoCycle(found));
        }
        let tip_m = noise_floor(tip).unwrap_or(0.0);
        let noise_m = match noise_floor(head) {
            Some(head_m) if head_m >= ROUNDING_M => tip_m.min(MOST_UNLIKE * head_m),
            Some(_) if self.synthetic => 0.0,
            _ => tip_m,
        };
        let step_m = quantisation_step(tip);
        // a jump of the tracker and its return look like a slip
        let quality = ChannelQuality { missing_frames: 0, noise_m: Some(noise_m), step_m };
        let mut inside = inside.to_vec();
        outlier_frames(&inside, &quality, None).into_iter().for_each(|frame| inside[frame] = None);
        let travel = TipTravel::from_samples(
            &inside,
            noise_m.max(step_m.unwrap_or(0.0) / 12_f64.sqrt()).max(ROUNDING_M),
        );
        let (rises, slips) = travel.find_slips()?;
        let rate_hz = self.grid.frame_rate_hz;
        let intervals = travel.tracked_intervals(&rises, &slips);
        if intervals.len() < FEWEST_SLIPS - 1 {
            let found = "too many frames are lost between the slips of the tip for the period of a cycle";
            return Err(NoCycle(found.to_owned()));
        }
        let cycle = summarise_slips(&rises, &slips, &intervals, rate_hz);
        let start_s = self.grid.time_s(frames.start);
        let slips = slips.iter().map(|slip| slip.on_clock(start_s, rate_hz)).collect();
        let rate_sd_hz = self.add_clock_sd(cycle.rate_hz, cycle.rate_sd_hz);
        let clock_sd_hz = self.add_clock_sd(1.0 / cycle.period_s, 0.0);
        let period_sd_s = math::hypot(cycle.period_sd_s, clock_sd_hz * cycle.period_s * cycle.period_s);
        Ok(CountedCycle { rate_sd_hz, period_sd_s, slips, ..cycle })
    }
}

/// Median time between neighbouring instants, s; `None` for fewer than two.
#[must_use]
pub fn median_interval_s(times_s: impl IntoIterator<Item = f64>) -> Option<f64> {
    let times_s: Vec<f64> = times_s.into_iter().collect();
    find_median(times_s.windows(2).map(|pair| pair[1] - pair[0]))
}

/// Path of the tip with its strokes laid end to end.
struct TipTravel {
    /// Numbers of the tracked frames.
    frames: Vec<usize>,
    /// Distance travelled until each of them, m.
    path_m: Vec<f64>,
    /// Number of turns of the strokes.
    turns: usize,
    noise_m: f64,
}

/// Rises of the path above the line: first and last point of each, the usual height, m, the median period,
/// frames, and the mean fraction of the period that a rise takes. Points count tracked frames.
struct PathRises {
    ends: Vec<[usize; 2]>,
    usual_m: f64,
    period: f64,
    fraction: f64,
    /// Whether rises are clearly shorter than falls.
    is_rising_fast: bool,
}

/// A slip: instant with its standard deviation, frames, size with its standard deviation, m, and start and
/// end of the motion, frames.
struct MeasuredSlip {
    frame: f64,
    frame_sd: f64,
    size_m: f64,
    size_sd_m: f64,
    motion: [f64; 2],
}

impl TipTravel {
    fn from_samples(samples: &[Option<f64>], noise_m: f64) -> Self {
        let points = samples.iter().enumerate().filter_map(|(frame, x)| Some((frame, (*x)?)));
        let (frames, places): (Vec<usize>, Vec<f64>) = points.unzip();
        let (low, high) = value_range(&places);
        let least = (TURN_SHARE * (high - low)).max(2.0 * HYSTERESIS * noise_m);
        let found = turning_points(&places, least);
        let (count, mut turns) = (found.len().saturating_sub(1), found.into_iter().peekable());
        // (the first turning point is at the start of the path)
        let mut sign = if turns.next().is_some_and(|(_, is_crest)| is_crest) { -1.0 } else { 1.0 };
        let mut path_m = vec![0.0];
        for (i, pair) in places.windows(2).enumerate() {
            if let Some((_, is_crest)) = turns.next_if(|(turn, _)| *turn == i) {
                sign = if is_crest { -1.0 } else { 1.0 };
            }
            path_m.push(path_m[i] + sign * (pair[1] - pair[0]));
        }
        Self { frames, path_m, turns: count, noise_m }
    }

    /// The slips, with the rises from which they follow. Tries lines of growing length.
    fn find_slips(&self) -> Result<(PathRises, Vec<MeasuredSlip>), NoCycle> {
        let all = self.frames.last().map_or(0, |last| last + 1) as f64;
        let lengths = std::iter::successors(Some(LINES.0), |length| Some(length * LINES.1));
        let mut reason = None;
        for length in lengths.take_while(|length| *length < LINE_PERIODS.0 * all) {
            let Some(period) = self.find_rises(length as usize).map(|rises| rises.period) else { continue };
            if !(LINE_PERIODS.0 * period..LINE_PERIODS.1 * period).contains(&(length as usize as f64)) {
                continue;
            }
            let Some(rises) = self.find_rises((LINE_PERIODS.0 * period) as usize) else { continue };
            if !rises.is_rising_fast && !self.rests_every_period(&rises) {
                let (period, percent) = (rises.period, 100.0 * rises.fraction);
                reason = Some(format!(
                    "the tip oscillates with a period of {period:.1} frames and takes {percent:.0} % of it to \
                     move forward; sticks and slips cannot be told from an oscillation without them"
                ));
                continue;
            }
            let found: Vec<MeasuredSlip> =
                (0..rises.ends.len()).filter_map(|at| self.measure_slip(&rises, at)).collect();
            if found.len() >= FEWEST_SLIPS.max(rises.ends.len() / 2) {
                return Ok((rises, found));
            }
        }
        Err(NoCycle(reason.unwrap_or_else(|| {
            format!("the tip does not slip at least {FEWEST_SLIPS} times by clearly more than its noise")
        })))
    }

    /// Rises above lines of `length` frames; `None` if there are too few, or if they are hardly larger than
    /// the noise.
    fn find_rises(&self, length: usize) -> Option<PathRises> {
        let above_m = self.subtract_lines(length / 2);
        let height = |[trough, crest]: &[usize; 2]| above_m[*crest] - above_m[*trough];
        let rises = |least: f64| -> Vec<[usize; 2]> {
            let turns = turning_points(&above_m, least);
            let pairs = turns.windows(2).map(|pair| ([pair[0].0, pair[1].0], pair[1].1));
            let whole = |ends: &[usize; 2]| ends[0] > 0 && ends[1] + 1 < above_m.len();
            pairs.filter(|(ends, rises)| *rises && whole(ends)).map(|(ends, _)| ends).collect()
        };
        let least_m = HYSTERESIS * self.noise_m;
        let usual_m = usual_size(rises(least_m).iter().map(height).collect());
        let ends = rises(least_m.max(LEAST_SLIP * usual_m));
        if usual_m < CLEAR_RISE * least_m || ends.len() < FEWEST_SLIPS {
            return None;
        }
        let frame = |point: usize| self.frames[point] as f64;
        let periods = || ends.windows(2).map(|pair| frame(pair[1][0]) - frame(pair[0][0]));
        let durations = ends.iter().map(|[trough, crest]| frame(*crest) - frame(*trough));
        let fractions: Vec<f64> = durations.zip(periods()).map(|(rise, period)| rise / period).collect();
        let (period, (fraction, sd)) = (median_or_zero(periods()), mean_and_sd(&fractions));
        let most = 0.5 - CLEAR_DEVIATIONS * sd / (fractions.len() as f64).sqrt();
        let is_rising_fast = fraction <= MOST_RISING.min(most);
        Some(PathRises { ends, usual_m, period, fraction, is_rising_fast })
    }

    /// Whether the tip comes to rest once a period and moves unlike a sinusoid. It rests if its slowest step
    /// is short and it does not move against the stroke. A sinusoid on a stroke also comes to rest if its
    /// velocity just reaches zero.
    fn rests_every_period(&self, rises: &PathRises) -> bool {
        if self.turns as f64 > MOST_TURNS * rises.ends.len() as f64 {
            return false;
        }
        let reach = ((SLOWEST_PART * rises.period) as usize).max(1);
        let mut slowest = Vec::new();
        for pair in rises.ends.windows(2) {
            let place_m = &self.path_m[pair[0][0]..=pair[1][0]];
            let (steps, travel_m) = (place_m.len() - 1, place_m[place_m.len() - 1] - place_m[0]);
            if travel_m <= 0.0 {
                return false;
            }
            let most_back_m = (HYSTERESIS * self.noise_m).max(MOST_BACK * travel_m);
            if turning_points(place_m, most_back_m).iter().any(|(_, is_crest)| *is_crest) {
                return false;
            }
            let near_m = &self.path_m[pair[0][1]..=pair[1][1]];
            let step_m =
                near_m.windows(reach + 1).map(|part| part[reach] - part[0]).fold(f64::INFINITY, f64::min);
            slowest.push(step_m / reach as f64 * steps as f64 / travel_m);
        }
        let is_slow = median_or_zero(slowest) <= SLOW_STEP;
        is_slow && rises.fraction <= MOST_RISING_AT_REST && self.is_distorted(rises)
    }

    /// Whether the second harmonic of the path above its line is larger than noise and lost frames can make
    /// it.
    fn is_distorted(&self, rises: &PathRises) -> bool {
        let above_m = self.subtract_lines(rises.period as usize);
        let (first, last) = (self.frames[0] as f64, self.frames[self.frames.len() - 1] as f64);
        let slips =
            (0..rises.ends.len()).filter_map(|at| self.measure_slip(rises, at).map(|slip| slip.frame));
        // (near the ends of the record the lines lie on one side only)
        let is_inside = |frame: &f64| frame - first >= rises.period && last - frame >= rises.period;
        let instants: Vec<f64> = slips.filter(is_inside).collect();
        let (mut sums, mut points) = ([[0.0; 2]; 2], 0.0_f64);
        for (frame, y) in self.frames.iter().zip(&above_m) {
            let next = instants.partition_point(|instant| *instant < *frame as f64);
            let before = next.checked_sub(1).and_then(|before| instants.get(before));
            let Some((from, to)) = before.zip(instants.get(next)) else { continue };
            let phase = TAU * (*frame as f64 - from) / (to - from);
            for (harmonic, [real, imaginary]) in sums.iter_mut().enumerate() {
                let (sin, cos) = math::sin_cos((harmonic + 1) as f64 * phase);
                *real += y * cos;
                *imaginary += y * sin;
            }
            points += 1.0;
        }
        let lost = 1.0 - self.frames.len() as f64 / (last - first + 1.0);
        let [first, second] = sums.map(|[real, imaginary]| math::hypot(real, imaginary));
        let noise = self.noise_m * (0.5 * points).sqrt() / first;
        let sd = math::hypot(noise, (2.0 * lost / points).sqrt());
        second > first * DISTORTED.0.max(DISTORTED.1 * sd)
    }

    /// The path above the line fitted to the points within `half` frames of each point, m.
    fn subtract_lines(&self, half: usize) -> Vec<f64> {
        // sums over the points of the line, with times relative to the current frame
        let [mut n, mut t, mut tt, mut x, mut tx] = [0.0; 5];
        let (mut first, mut next, mut centre) = (0, 0, self.frames[0]);
        let above = self.frames.iter().zip(&self.path_m).map(|(&frame, value)| {
            let by = (frame - centre) as f64;
            tt += by * (by * n - 2.0 * t);
            tx -= by * x;
            t -= by * n;
            centre = frame;
            let mut add = |point: usize, sign: f64| {
                let u = self.frames[point] as f64 - frame as f64;
                n += sign;
                t += sign * u;
                tt += sign * u * u;
                x += sign * self.path_m[point];
                tx += sign * u * self.path_m[point];
            };
            while self.frames.get(next).is_some_and(|found| *found <= frame + half) {
                add(next, 1.0);
                next += 1;
            }
            while self.frames[first] + half < frame {
                add(first, -1.0);
                first += 1;
            }
            let spread = n * tt - t * t;
            // (two neighbouring frames have a spread of 1)
            let slope = if spread > 0.5 { (n * tx - t * x) / spread } else { 0.0 };
            value - (x - slope * t) / n
        });
        above.collect()
    }

    /// Measures the slip of a rise between the levels before and after it; `None` if the path has no such
    /// step there, as at an outlier.
    fn measure_slip(&self, rises: &PathRises, at: usize) -> Option<MeasuredSlip> {
        let (frames, path) = (&self.frames, &self.path_m);
        let [trough, crest] = rises.ends[at];
        let from = at.checked_sub(1).map_or(0, |before| rises.ends[before][1]);
        let to = rises.ends.get(at + 1).map_or(path.len() - 1, |next| next[0]);
        let near = |i: &usize, end: usize| frames[*i].abs_diff(frames[end]) as f64 <= rises.period;
        let before: Vec<f64> = (from..=trough).filter(|i| near(i, trough)).map(|i| path[i]).collect();
        let after: Vec<f64> = (crest..=to).filter(|i| near(i, crest)).map(|i| path[i]).collect();
        // (the median of normal noise has pi / 2 times the variance of the mean)
        let size_variance =
            FRAC_PI_2 * self.noise_m * self.noise_m * (1.0 / before.len() as f64 + 1.0 / after.len() as f64);
        let (low, high) = (median_or_zero(before), median_or_zero(after));
        let size_m = high - low;
        if size_m < LEAST_SLIP * rises.usual_m {
            return None;
        }
        let (frame, frame_sd, motion) =
            self.time_slip([from, trough, crest, to], [low, high], size_variance / 4.0)?;
        Some(MeasuredSlip { frame, frame_sd, size_m, size_sd_m: size_variance.sqrt(), motion })
    }

    /// Instant of a slip with its standard deviation, and start and end of the motion, all in frames.
    /// `levels_m` are the levels of rest; their mean has the variance `variance_m2`, m². `None` if the path
    /// does not rise through the middle between them.
    fn time_slip(
        &self,
        [from, trough, crest, to]: [usize; 4],
        levels_m: [f64; 2],
        variance_m2: f64,
    ) -> Option<(f64, f64, [f64; 2])> {
        let (frames, path, size_m) = (&self.frames, &self.path_m, levels_m[1] - levels_m[0]);
        let level = |share: f64| levels_m[0] + share * size_m;
        let crosses = |k: &usize| path[*k] < level(0.5) && path[k + 1] >= level(0.5);
        let crossings: Vec<usize> = (trough..crest).filter(crosses).collect();
        let middle = *crossings.get(crossings.len() / 2)?;
        let last_below = |most: f64| (from..=middle).rev().find(|i| path[*i] <= most).unwrap_or(from);
        let first_above = |least: f64| (middle + 1..=to).find(|i| path[*i] >= least).unwrap_or(to);
        let slope = last_below(level(SLOPE_SHARES.0)) + 1..first_above(level(SLOPE_SHARES.1));
        let on_slope = if slope.len() < FEWEST_ON_SLOPE { middle..middle + 2 } else { slope };
        let points: Vec<(f64, f64)> = on_slope.map(|i| (frames[i] as f64, path[i])).collect();
        let ([frame, place], [spread, both]) = central_moments(&points);
        let (speed, off) = (both / spread, (level(0.5) - place) * spread / both);
        let instant = frame + off;
        if !(speed > 0.0 && (frames[trough] as f64..=frames[crest] as f64).contains(&instant)) {
            return None;
        }
        let of_line_m2 = self.noise_m * self.noise_m * (1.0 / points.len() as f64 + off * off / spread);
        let noise = (of_line_m2 + variance_m2).sqrt() / speed;
        // a slip between two frames may be anywhere between them
        let gap = (frames[middle + 1] - frames[middle]) as f64;
        let share = ((path[middle + 1] - path[middle]) / size_m).min(1.0);
        let hidden = (2.0 * share - 1.0).max(0.0) / 12_f64.sqrt();
        let unresolved = gap * math::hypot(hidden, INTERPOLATION.0.max(INTERPOLATION.1 * share));
        let rest = (LEAVES_REST.0 * self.noise_m / size_m).max(LEAVES_REST.1);
        let crossing = |i: usize, j: usize, level: f64| {
            let way_m = path[j] - path[i];
            let share = if way_m == 0.0 { 0.0 } else { ((level - path[i]) / way_m).clamp(0.0, 1.0) };
            frames[i] as f64 + share * (frames[j] as f64 - frames[i] as f64)
        };
        let (start, end) = (last_below(level(rest)), first_above(level(1.0 - rest)));
        let motion = [crossing(start, start + 1, level(rest)), crossing(end, end - 1, level(1.0 - rest))];
        Some((instant, math::hypot(noise, unresolved), motion))
    }

    /// Intervals between slips, frames, without those in which lost frames may hide a slip.
    fn tracked_intervals(&self, rises: &PathRises, slips: &[MeasuredSlip]) -> Vec<f64> {
        let index = |slip: &MeasuredSlip| self.frames.partition_point(|frame| (*frame as f64) < slip.frame);
        let is_tracked = |pair: &&[MeasuredSlip]| {
            let inside = &self.frames[index(&pair[0]).saturating_sub(1)..=index(&pair[1])];
            inside.windows(2).all(|w| ((w[1] - w[0]) as f64) < MOST_LOST * rises.period)
        };
        slips.windows(2).filter(is_tracked).map(|pair| pair[1].frame - pair[0].frame).collect()
    }
}

/// Alternating extremes of a path, each at least `least` from the next: index, and whether it is a crest.
fn turning_points(path: &[f64], least: f64) -> Vec<(usize, bool)> {
    let mut found: Vec<(usize, bool)> = Vec::new();
    let (mut low, mut high) = (0, 0);
    for (i, x) in path.iter().enumerate() {
        let after_crest = found.last().map(|(_, is_crest)| *is_crest);
        (low, high) = (if *x < path[low] { i } else { low }, if *x > path[high] { i } else { high });
        if after_crest != Some(false) && x - path[low] > least {
            found.push((low, false));
            (low, high) = (i, i);
        } else if after_crest != Some(true) && path[high] - x > least {
            found.push((high, true));
            (low, high) = (i, i);
        }
    }
    found
}

/// The size at which the sizes up to it make up half of the sum of all sizes: many small ones hardly change
/// it. 0 without sizes.
fn usual_size(mut sizes: Vec<f64>) -> f64 {
    sizes.sort_by(f64::total_cmp);
    let mut left = 0.5 * sizes.iter().sum::<f64>();
    let is_half = |size: &&f64| {
        left -= **size;
        left <= 0.0
    };
    sizes.iter().find(is_half).copied().unwrap_or(0.0)
}

fn mean_and_sd(values: &[f64]) -> (f64, f64) {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let squares = values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>();
    (mean, (squares / (values.len() - 1) as f64).sqrt())
}

/// Each interval as its ratio to the local period, and in frames; pauses of the cycle are left out.
fn compare_intervals(intervals: &[f64]) -> Vec<(f64, f64)> {
    let ratio = |(at, interval): (usize, &f64)| {
        let near = at.saturating_sub(LOCAL_INTERVALS)..(at + LOCAL_INTERVALS + 1).min(intervals.len());
        (interval / median_or_zero(intervals[near].iter().copied()), *interval)
    };
    intervals.iter().enumerate().map(ratio).filter(|(ratio, _)| *ratio < PAUSE).collect()
}

/// Number of beats in an interval with this ratio to the local period: more than one if beats are dropped.
fn count_beats(ratio: f64) -> f64 {
    if (ratio - ratio.round()).abs() < WHOLE_BEAT { ratio.round().max(1.0) } else { 1.0 }
}

/// The cycle without the times of its slips; `intervals` are those between slips, in frames.
fn summarise_slips(
    rises: &PathRises,
    found: &[MeasuredSlip],
    intervals: &[f64],
    rate_hz: f64,
) -> CountedCycle {
    let compared = compare_intervals(intervals);
    let (count, pauses) = (compared.len() as f64, intervals.len() - compared.len());
    let total = compared.iter().map(|(_, interval)| interval).sum::<f64>();
    let beats = compared.iter().map(|(ratio, _)| count_beats(*ratio)).sum::<f64>();
    let (period, mean) = (total / beats, total / count);
    let total_sd = math::hypot(found[0].frame_sd, found[found.len() - 1].frame_sd);
    let errors = 2.0 * median_or_zero(found.iter().map(|slip| slip.frame_sd * slip.frame_sd));
    let without_errors = |sd: f64| (sd * sd - errors / (period * period)).max(0.0).sqrt();
    // (relative to the local period, so that a drift is no scatter)
    let off = || compared.iter().map(|(ratio, _)| ratio / count_beats(*ratio) - 1.0);
    let most = ODD_DEVIATIONS / NORMAL_MEDIAN * median_or_zero(off().map(f64::abs));
    let period_scatter =
        without_errors(mean_and_sd(&off().filter(|off| off.abs() <= most).collect::<Vec<_>>()).1);
    let of_ratios =
        without_errors(mean_and_sd(&compared.iter().map(|(ratio, _)| *ratio).collect::<Vec<_>>()).1);
    let mean_sd = math::hypot(total_sd / count, mean * of_ratios / count.sqrt());
    let sticks = found.windows(2).map(|pair| pair[1].motion[0] - pair[0].motion[1]);
    let stick = median_or_zero(sticks);
    let slip = median_or_zero(found.iter().map(|slip| slip.motion[1] - slip.motion[0]));
    let (size_mean_m, size_sd_m) = mean_and_sd(&found.iter().map(|slip| slip.size_m).collect::<Vec<_>>());
    let is_timed = stick >= LEAST_STICK_FRAMES;
    let frames = if stick < 1.0 { "a frame" } else { "five frames" };
    let untimed = format!("sticks are shorter than {frames}, so that sticks and slips have no durations");
    let percent = 100.0 * period_scatter;
    let no_line = format!(
        "the period scatters by {percent:.0} %, so the spectrum has no line at the rate of the slips"
    );
    let paused = format!("{pauses} {} between slips left out", pluralise("pause", pauses));
    // (the local period of an interval is the interval over its ratio)
    let (shortest, longest) = value_range(&compared.iter().map(|(ratio, x)| x / ratio).collect::<Vec<_>>());
    let ms = 1e3 / rate_hz;
    let changing = format!(
        "the period changes from {:.3} to {:.3} ms: its mean and the rate are those of the whole window",
        shortest * ms,
        longest * ms
    );
    let remarks = [
        (longest > CHANGING * shortest).then_some(changing),
        (!is_timed).then_some(untimed),
        (period_scatter >= NO_LINE_SCATTER).then_some(no_line),
        (pauses > 0).then_some(paused),
    ];
    CountedCycle {
        count: found.len(),
        rate_hz: rate_hz / mean,
        rate_sd_hz: rate_hz / mean * mean_sd / mean,
        period_s: period / rate_hz,
        period_sd_s: total_sd / beats / rate_hz,
        period_scatter,
        dropped_beats: (beats - count) as usize,
        size_m: median_or_zero(found.iter().map(|slip| slip.size_m)),
        size_scatter: size_sd_m / size_mean_m,
        rising_fraction: rises.fraction,
        times: is_timed.then(|| StickTimes { stick_s: stick / rate_hz, slip_s: slip / rate_hz }),
        remarks: remarks.into_iter().flatten().collect(),
        slips: Vec::new(),
    }
}

impl MeasuredSlip {
    fn on_clock(&self, start_s: f64, rate_hz: f64) -> TipSlip {
        let (time_s, time_sd_s) = (start_s + self.frame / rate_hz, self.frame_sd / rate_hz);
        TipSlip { time_s, time_sd_s, size_m: self.size_m, size_sd_m: self.size_sd_m }
    }
}
