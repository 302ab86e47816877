//! Mean deflections: over a window, and over the frames in which the head has a given speed, which over a
//! stroke is the friction curve.

use super::missing::{FEWEST_AT_SPEED, Missing};
use super::reader::Reader;
use super::value::Value;
use crate::recording::channel::{Channel, Window};

pub(super) fn mean(window: &Window, reader: &Reader) -> Result<Value, Missing> {
    let present = reader.cut(Channel::Deflection, reader.frames(window)?).iter().flatten();
    let (count, sum) = present.fold((0_usize, 0.0), |(count, sum), x| (count + 1, sum + x));
    if count == 0 {
        return Err(Missing::NoFrames);
    }
    Ok(Value::of(sum / count as f64, None))
}

/// Mean over the frames of a window in which the head's speed is within a share of the given one.
pub(super) fn at_speed(
    window: &Window,
    speed_m_per_s: f64,
    width_relative: f64,
    reader: &Reader,
) -> Result<Value, Missing> {
    let frames = reader.frames(window)?;
    let speeds = reader.speeds(&frames).ok_or(Missing::NoSpeed)?;
    let (low, high) = (speed_m_per_s * (1.0 - width_relative), speed_m_per_s * (1.0 + width_relative));
    let (mut count, mut sum) = (0_usize, 0.0);
    let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
    for (deflection, speed) in reader.cut(Channel::Deflection, frames).iter().zip(speeds.iter().copied()) {
        (least, most) = (least.min(speed), most.max(speed));
        if let Some(x) = deflection.filter(|_| (low..=high).contains(&speed)) {
            (count, sum) = (count + 1, sum + x);
        }
    }
    if count < FEWEST_AT_SPEED {
        return Err(Missing::Speed {
            found: count,
            low_m_per_s: low,
            high_m_per_s: high,
            least_m_per_s: least,
            most_m_per_s: most,
        });
    }
    Ok(Value::of(sum / count as f64, None))
}
