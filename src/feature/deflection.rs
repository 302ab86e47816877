//! Mean deflections: over a window, and over the frames in which the head has a given speed, which over a
//! stroke is the friction curve.

use super::missing::{FEWEST_AT_SPEED, MissingValue};
use super::reader::FeatureReader;
use super::value::FeatureValue;
use crate::recording::channel::{Channel, Window};

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

/// Mean over the frames of a window in which the head's speed is within a share of the given one.
pub(super) fn read_deflection_at_speed(
    window: &Window,
    speed_m_per_s: f64,
    width_relative: f64,
    reader: &FeatureReader,
) -> Result<FeatureValue, MissingValue> {
    let frames = reader.window_frames(window)?;
    let speeds = reader.head_speeds_m_per_s(&frames).ok_or(MissingValue::NoSpeed)?;
    let (low, high) = (speed_m_per_s * (1.0 - width_relative), speed_m_per_s * (1.0 + width_relative));
    let (mut count, mut sum) = (0_usize, 0.0);
    let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
    for (deflection, speed) in
        reader.channel_frames(Channel::Deflection, frames).iter().zip(speeds.iter().copied())
    {
        (least, most) = (least.min(speed), most.max(speed));
        if let Some(x) = deflection.filter(|_| (low..=high).contains(&speed)) {
            (count, sum) = (count + 1, sum + x);
        }
    }
    if count < FEWEST_AT_SPEED {
        return Err(MissingValue::Speed {
            found: count,
            low_m_per_s: low,
            high_m_per_s: high,
            least_m_per_s: least,
            most_m_per_s: most,
        });
    }
    Ok(FeatureValue::new(sum / count as f64, None))
}
