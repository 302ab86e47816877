//! What the calibration of a camera does to a value: `(1 + scale) value + offset`.

use crate::feature::LengthCalibration;
use crate::math;

/// How a value depends on what is not known of its camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetCalibration {
    /// Number of the condition whose camera it is, from 0.
    pub condition: usize,
    /// Standard deviation of the scale, relative; 0 where it is held.
    pub scale_sd: f64,
    /// Standard deviation of the offset, m; 0 where it is held.
    pub offset_sd_m: f64,
    /// What of the camera the value depends on.
    pub length: LengthCalibration,
}

impl TargetCalibration {
    /// What a camera with this `[scale, offset]` shows of a value, m.
    #[must_use]
    pub fn apply(&self, value: f64, [scale, offset_m]: [f64; 2]) -> f64 {
        match self.length {
            LengthCalibration::Position => (1.0 + scale) * value + offset_m,
            LengthCalibration::Size { floor_m } => {
                let of_motion = (value * value - floor_m * floor_m).max(0.0).sqrt();
                math::hypot((1.0 + scale) * of_motion, floor_m)
            }
        }
    }

    /// Its derivatives by scale and offset, m.
    pub(crate) fn derivatives(&self, value: f64, [scale, offset_m]: [f64; 2]) -> [f64; 2] {
        match self.length {
            LengthCalibration::Position => [value, 1.0],
            LengthCalibration::Size { floor_m } => {
                let motion2 = (value * value - floor_m * floor_m).max(0.0);
                [(1.0 + scale) * motion2 / self.apply(value, [scale, offset_m]), 0.0]
            }
        }
    }

    /// Standard deviation of what is shown of a value, m.
    #[must_use]
    pub fn sd_m(&self, value: f64) -> f64 {
        let [by_scale, by_offset] = self.derivatives(value, [0.0; 2]);
        math::hypot(self.scale_sd * by_scale, self.offset_sd_m * by_offset)
    }

    /// Standard deviations of scale and offset; 0 also of an offset on which the value does not depend.
    pub(crate) fn standard_deviations(&self) -> [f64; 2] {
        match self.length {
            LengthCalibration::Position => [self.scale_sd, self.offset_sd_m],
            LengthCalibration::Size { .. } => [self.scale_sd, 0.0],
        }
    }
}
