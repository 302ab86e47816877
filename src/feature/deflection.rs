//! Mean deflection in a window, or in those frames of a window in which the head has a given speed. The means
//! at several speeds of a stroke form the friction curve.

use super::missing::{FEWEST_AT_SPEED, MissingValue};
use super::reader::FeatureReader;
use super::value::FeatureValue;
use crate::recording::channel::{Channel, Window};
use portable_math as math;

pub(super) fn read_mean_deflection(
    window: &Window,
    reader: &FeatureReader,
) -> Result<FeatureValue, MissingValue> {
    let present = reader.channel_frames(Channel::Deflection, reader.window_frames(window)?).iter().flatten();
    let (count, sum) = present.fold((0_usize, 0.0), |(count, sum), x| (count + 1, sum + x));
    if count == 0 {
        return Err(MissingValue::NoFrames);
    }
    Ok(FeatureValue::new(sum / count as f64, None))
}

/// Mean deflection over the frames of a window in which the speed of the head differs from `speed_m_per_s` by
/// at most `width_relative * speed_m_per_s`.
pub(super) fn read_deflection_at_speed(
    window: &Window,
    speed_m_per_s: f64,
    width_relative: f64,
    reader: &FeatureReader,
) -> Result<FeatureValue, MissingValue> {
    let frames = reader.window_frames(window)?;
    let speeds = reader.head_speeds_m_per_s(&frames)?;
    let (low, high) = (speed_m_per_s * (1.0 - width_relative), speed_m_per_s * (1.0 + width_relative));
    let (mut count, mut sum) = (0_usize, 0.0);
    let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
    let deflections = reader.channel_frames(Channel::Deflection, frames).iter();
    for (deflection, speed) in deflections.zip(speeds.iter().copied()) {
        (least, most) = (least.min(speed), most.max(speed));
        if let Some(x) = deflection.filter(|_| (low..=high).contains(&speed)) {
            (count, sum) = (count + 1, sum + x);
        }
    }
    if count >= FEWEST_AT_SPEED {
        return Ok(FeatureValue::new(sum / count as f64, None));
    }
    let ([low_m_per_s, high_m_per_s], [least_m_per_s, most_m_per_s]) = ([low, high], [least, most]);
    Err(MissingValue::Speed { found: count, low_m_per_s, high_m_per_s, least_m_per_s, most_m_per_s })
}

/// Length of the blocks in which the speed of the head is measured, s. At 5,000 frames/s, position errors of
/// 2 um (a tenth of a pixel) cause a speed error of 4e-5 m/s. Between two blocks, the speed during a stroke
/// at 1 Hz deviates from a straight line by less than a thousandth of its maximum.
pub(crate) const SPEED_BLOCK_S: f64 = 0.02;
/// Minimum number of tracked frames in a block.
const FEWEST_IN_BLOCK: usize = 5;

/// The speed of the head in every frame, m/s; `None` with fewer than two blocks. The frames are divided into
/// blocks that overlap by half, and the slope of the path is measured in each block. These slopes are
/// interpolated linearly between the blocks, and extrapolated before the first and after the last block. The
/// result is exact if the path of the head is a parabola.
pub(super) fn head_speeds_m_per_s(head: &[Option<f64>], frame_rate_hz: f64) -> Option<Vec<f64>> {
    let half = ((SPEED_BLOCK_S * frame_rate_hz / 2.0).round() as usize).max(FEWEST_IN_BLOCK.div_ceil(2));
    let block = |k: usize| block_slope(head, k * half..((k + 2) * half).min(head.len()), frame_rate_hz);
    let mut blocks: Vec<(f64, f64)> = (0..(head.len() / half).saturating_sub(1)).filter_map(block).collect();
    // if two blocks have the same mean index, they contain the same tracked frames, and one of them is
    // removed
    blocks.dedup_by(|later, earlier| later.0 <= earlier.0);
    let mut pairs = blocks.windows(2).peekable();
    let mut pair = pairs.next()?;
    let speed = |frame: usize| {
        let frame = frame as f64;
        while let Some(next) = pairs.next_if(|_| pair[1].0 < frame) {
            pair = next;
        }
        let [(from, v_from), (to, v_to)] = [pair[0], pair[1]];
        (v_from + (frame - from) / (to - from) * (v_to - v_from)).abs()
    };
    Some((0..head.len()).map(speed).collect())
}

/// Mean index of the tracked frames of a block, and slope, m/s, of the least-squares line through the
/// positions of the head in these frames.
fn block_slope(
    head: &[Option<f64>],
    frames: std::ops::Range<usize>,
    frame_rate_hz: f64,
) -> Option<(f64, f64)> {
    let points = || frames.clone().zip(&head[frames.clone()]).filter_map(|(i, x)| Some((i as f64, (*x)?)));
    let (count, sum_frame, sum_x) =
        points().fold((0_usize, 0.0, 0.0), |(n, f, s), (frame, x)| (n + 1, f + frame, s + x));
    let (middle, mean) = (sum_frame / count as f64, sum_x / count as f64);
    let (spread, both) = points().fold((0.0, 0.0), |(spread, both), (frame, x)| {
        (spread + math::powi(frame - middle, 2), both + (frame - middle) * (x - mean))
    });
    (count >= FEWEST_IN_BLOCK && spread > 0.0).then(|| (middle, frame_rate_hz * both / spread))
}
