//! The noise of a recording. It is white or correlated between neighbouring frames; it may differ between tip
//! and head, and a part of it may be common to both.
//!
//! There are two estimators of the size of the noise. `measure_noise` maximises the likelihood of a smooth
//! motion with autoregressive noise; it includes noise that changes slowly from frame to frame, and needs
//! some hundred frames. Fits and comparisons use it. [`noise_floor`] is the median third difference of a
//! single column; it needs a dozen frames and no model of the motion, but it sees only the part of the noise
//! that changes from one frame to the next. The checks of single columns, frames and twins use it, because
//! they compare neighbouring frames, and so do fits and comparisons of recordings that are too short.

mod blocks;
mod common_noise;
pub(crate) mod differences;
mod likelihood;

use super::Recording;
use blocks::{BlockCut, NoiseBlock, cut_blocks, keep_quiet_blocks};
use common_noise::{CommonNoise, SharedNoise, measure_common_noise};
pub(crate) use differences::mean_square_noise;
pub use differences::{noise_floor, quantisation_step};
use portable_math as math;
pub(crate) use short_spectra::noise::{AutoregressiveNoise, Whitener};

// The position of the head along the sweep is compared with its smooth motion. The height of the tip is
// compared with the glass, which is a straight line in the picture. In the other two channels the blade
// itself moves from frame to frame, so the correlations of their noise cannot be separated from motion. They
// are assumed to be those of the other point in the same direction. The size of the noise is assumed to be
// that of the other point too, unless the fastest part of the channel's own scatter clearly differs.

/// Blocks in which a polynomial is fitted to the motion of the head: length, s, and degree. For a motion at
/// 50 Hz, the residual is at most a hundredth of the amplitude. The shorter blocks leave less of a faster
/// motion.
const HEAD_BLOCKS: [(f64, usize); 4] = [(8e-3, 3), (16e-3, 5), (32e-3, 9), (64e-3, 16)];
/// Index of the shortest of [`HEAD_BLOCKS`].
const SHORTEST: usize = 0;
/// Minimum length of a block, in units of the time in which the correlation of the noise falls to `1/e`. In a
/// shorter block, the polynomial takes up so much of the noise that its standard deviation is uncertain by
/// more than a third.
const CORRELATION_TIMES: usize = 16;
/// Minimum number of frames of a block: in a shorter block, a cubic removes most of the correlation between
/// neighbouring frames.
const LEAST_BLOCK: usize = 24;
/// Degrees of the polynomials in blocks of [`LEAST_BLOCK`] frames that separate noise from the motion of the
/// blade itself. The highest follows motions up to a fifth of the frame rate.
const BLADE_DEGREES: [usize; 6] = [3, 5, 8, 11, 14, 16];
/// A lower degree describes the motion if its scatter exceeds that of the highest degree by at most this
/// number of standard deviations of the difference. If the second highest degree does not, the motion is too
/// fast.
const ALIKE_DEVIATIONS: f64 = 2.0;
/// The noise of tip and head differs in size if the difference exceeds this number of standard deviations. By
/// chance, this happens in one recording of 370.
const CLEAR_DEVIATIONS: f64 = 3.0;
/// Largest ratio of the noise of the two points. A larger ratio comes from motion of the blade.
const MOST_UNLIKE: f64 = 2.0;
/// Maximum number of frames that are used for an estimate of the noise, spread over the recording: they
/// determine a correlation with an error of 0.01.
const MOST_FRAMES: usize = 6_000;
/// Minimum number of degrees of freedom of an estimate of the noise.
const FEWEST_FRAMES: usize = 100;
/// Smallest standard deviation that counts as noise, m; a smaller one is rounding.
const LEAST_SD_M: f64 = 1e-9;
/// Largest ratio of the common noise of a channel to its whole noise for which the common noise is
/// subtracted. With a larger ratio, the rest would be a small difference of two uncertain numbers.
const MOST_COMMON: f64 = 0.9;

/// Estimated noise of a channel, with its uncertainty.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ChannelNoise {
    pub noise: AutoregressiveNoise,
    /// Standard deviation of the estimated standard deviation of the noise, m.
    pub sd_of_sd_m: f64,
    /// Standard deviations of the estimated coefficients of the noise.
    pub sd_of_coefficients: Vec<f64>,
    /// Degrees of freedom: frames minus the coefficients of the motion.
    pub frames: usize,
}

/// Estimated noise of a recording.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RecordingNoise {
    pub tip_x: Option<ChannelNoise>,
    pub tip_y: Option<ChannelNoise>,
    pub head_x: Option<ChannelNoise>,
    pub head_y: Option<ChannelNoise>,
    /// The part of the noise that both points share.
    pub common: CommonNoise,
}

/// How a recording is cut into blocks.
struct RecordingCuts<'a> {
    recording: &'a Recording,
    /// Time of every frame, in units of the mean frame interval.
    places: Vec<f64>,
}

impl RecordingCuts<'_> {
    fn new(recording: &Recording) -> RecordingCuts<'_> {
        let (grid, frames) = (recording.grid(), 0..recording.grid().frames);
        let places = match recording.frame_times_s() {
            Some(times_s) => times_s.iter().map(|t| (t - grid.start_s) * grid.frame_rate_hz).collect(),
            None => frames.map(|frame| frame as f64).collect(),
        };
        RecordingCuts { recording, places }
    }

    /// Blocks for the head along the sweep; `size` is an index of [`HEAD_BLOCKS`].
    fn cut_head(&self, size: usize) -> BlockCut<'_> {
        let (length_s, degree) = HEAD_BLOCKS[size];
        let length = ((length_s * self.recording.grid().frame_rate_hz).round() as usize).max(LEAST_BLOCK);
        BlockCut { length, degree, covariate: None, places: &self.places }
    }

    /// Blocks for the height of the tip on the glass.
    fn cut_glass(&self) -> BlockCut<'_> {
        BlockCut { degree: 1, covariate: Some(&self.recording.traces().tip_x_m), ..self.cut_head(SHORTEST) }
    }
}

/// Measures the noise of a recording. The position of the head along the sweep and the height of the tip are
/// measured first; if one measurement fails, or if the height of the tip scatters by its motion, the result
/// of the other is used for both. The other two channels take their correlations from these.
pub(crate) fn measure_noise(recording: &Recording) -> RecordingNoise {
    let (cuts, traces) = (RecordingCuts::new(recording), recording.traces());
    let head = measure_head_noise(&traces.head_x_m, &cuts);
    let glass = measure_channel_noise(&traces.tip_y_m, &cuts.cut_glass());
    let own = |other: &Option<ChannelNoise>, values: &[Option<f64>]| {
        other.clone().map(|other| measure_own_size(values, &cuts, &other).unwrap_or(other))
    };
    // (a marker beside the edge of the lip moves up and down as the lip turns, unlike the head)
    let is_motion = |glass: &ChannelNoise| {
        head.as_ref().is_some_and(|head| {
            let least_m = glass.noise.sd() / MOST_UNLIKE;
            let of_head = measure_scatter(&traces.head_y_m, &cuts, head);
            head.noise.sd() < least_m && of_head.is_none_or(|[sd_m, _]| sd_m < least_m)
        })
    };
    let glass = match glass {
        Some(glass) if is_motion(&glass) => own(&head, &traces.tip_y_m),
        glass => glass,
    };
    let (head_x, tip_y) = (head.clone().or_else(|| glass.clone()), glass.or(head));
    RecordingNoise {
        tip_x: own(&head_x, &traces.tip_x_m),
        head_y: own(&tip_y, &traces.head_y_m),
        tip_y,
        head_x,
        common: measure_common_noise(recording, &cuts),
    }
}

impl RecordingNoise {
    /// Noise of the tip along the sweep that is left after the common noise is subtracted.
    pub(crate) fn own_tip_x(&self) -> Option<AutoregressiveNoise> {
        subtract_common(self.tip_x.as_ref()?, self.head_x.as_ref()?, self.common.tip_x.as_ref())
    }

    /// Noise of the head's height that is left after the common noise is subtracted.
    pub(crate) fn own_head_y(&self) -> Option<AutoregressiveNoise> {
        subtract_common(self.head_y.as_ref()?, self.tip_y.as_ref()?, self.common.head_y.as_ref())
    }

    /// Standard deviation of the noise of the deflection, m.
    pub(crate) fn deflection_m(&self) -> Option<f64> {
        let [tip_m, head_m] = [self.tip_x.as_ref()?, self.head_x.as_ref()?].map(|found| found.noise.sd());
        let share = self.common.tip_x.as_ref().map_or(0.0, |common| common.share);
        Some((tip_m * tip_m + (1.0 - 2.0 * share) * head_m * head_m).max(0.0).sqrt())
    }
}

/// Noise of a channel without `common`, the part that it shares with the other point.
fn subtract_common(
    whole: &ChannelNoise,
    other: &ChannelNoise,
    common: Option<&SharedNoise>,
) -> Option<AutoregressiveNoise> {
    let (whole, other_m) = (&whole.noise, other.noise.sd());
    let most = MOST_COMMON * whole.sd();
    let common = common.filter(|common| (common.share.abs() + 2.0 * common.sd) * other_m < most);
    let common_m = common.map_or(0.0, |common| common.share * other_m);
    let left_m = (whole.sd() * whole.sd() - common_m * common_m).sqrt();
    AutoregressiveNoise::new(left_m, whole.coefficients().to_vec()).ok()
}

/// Measures the noise of the head along the sweep, in the shortest blocks that are much longer than the
/// correlation of the noise.
fn measure_head_noise(values: &[Option<f64>], cuts: &RecordingCuts<'_>) -> Option<ChannelNoise> {
    let mut found = None;
    for size in SHORTEST..HEAD_BLOCKS.len() {
        let cut = cuts.cut_head(size);
        let longer = measure_channel_noise(values, &cut);
        found = longer.or(found);
        let correlations = found.as_ref()?.noise.correlations(cut.length);
        let time = correlations.iter().rposition(|r| *r > math::exp(-1.0)).unwrap_or(0) + 1;
        if cut.length >= CORRELATION_TIMES * time {
            break;
        }
    }
    found
}

fn measure_channel_noise(values: &[Option<f64>], cut: &BlockCut<'_>) -> Option<ChannelNoise> {
    let blocks = keep_quiet_blocks(cut_blocks(values, cut));
    let frames: usize = blocks.iter().map(|block| block.values.len()).sum();
    let thinned: Vec<NoiseBlock> = blocks.into_iter().step_by(frames.div_ceil(MOST_FRAMES).max(1)).collect();
    let found = likelihood::estimate_noise(&thinned)?;
    (found.frames >= FEWEST_FRAMES && found.noise.sd() >= LEAST_SD_M).then_some(found)
}

/// Standard deviation, with its own standard deviation, of the scatter of a channel in which the blade moves,
/// m, with the correlations of another point. `None` if its motion is too fast.
fn measure_scatter(
    values: &[Option<f64>],
    cuts: &RecordingCuts<'_>,
    other: &ChannelNoise,
) -> Option<[f64; 2]> {
    let with_degree = |degree: usize| {
        let cut = BlockCut { length: LEAST_BLOCK, degree, ..cuts.cut_head(SHORTEST) };
        likelihood::estimate_sd_like(&cut_blocks(values, &cut), &other.noise)
    };
    let found: Vec<[f64; 2]> = BLADE_DEGREES.into_iter().map_while(with_degree).collect();
    let [.., second, highest] = found[..] else { return None };
    // (the variance of the difference between an estimate and a less efficient one is the difference of their
    // variances)
    let is_alike = |[sd_m, sd_of_sd_m]: &[f64; 2]| {
        let apart_sd_m = (highest[1] * highest[1] - sd_of_sd_m * sd_of_sd_m).max(0.0).sqrt();
        sd_m - highest[0] <= ALIKE_DEVIATIONS * apart_sd_m
    };
    found.iter().find(|found| is_alike(found)).copied().filter(|_| is_alike(&second))
}

/// Noise of a channel in which the blade moves, with the correlations of the other point. `None` if its size
/// does not clearly differ from that of the other point, or if its motion is too fast.
fn measure_own_size(
    values: &[Option<f64>],
    cuts: &RecordingCuts<'_>,
    other: &ChannelNoise,
) -> Option<ChannelNoise> {
    let [sd_m, sd_of_sd_m] = measure_scatter(values, cuts, other)?;
    let other_m = other.noise.sd();
    let is_noise = (other_m / MOST_UNLIKE..=other_m * MOST_UNLIKE).contains(&sd_m);
    let is_clear = (sd_m - other_m).abs() > CLEAR_DEVIATIONS * math::hypot(sd_of_sd_m, other.sd_of_sd_m);
    let noise = AutoregressiveNoise::new(sd_m, other.noise.coefficients().to_vec()).ok()?;
    (is_noise && is_clear).then(|| ChannelNoise { noise, sd_of_sd_m, ..other.clone() })
}

#[cfg(test)]
mod tests;
