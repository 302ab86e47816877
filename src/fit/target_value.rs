//! A measured or published value that a fit must meet.

use crate::feature::{LengthCalibration, ValueComparison};
use portable_math as math;

/// Ratio of model to target, or of target to model, above which the residual no longer grows. No physical
/// feature spans two decades, so any value of a feature costs less than a missing feature.
pub(crate) const MAX_RATIO: f64 = 100.0;

/// Smallest relative standard deviation in the first stage. Far from the targets all features are many
/// deviations off, and the most precise ones would otherwise dominate the cost.
pub(crate) const FIRST_STAGE_SD_RELATIVE: f64 = 0.05;

/// The target value of a feature, with its standard deviation.
#[derive(Debug, Clone, PartialEq)]
pub struct TargetValue {
    /// Name of the component or feature.
    pub name: String,
    /// Target value, in the feature's own SI unit; not zero if values are compared by logarithms.
    pub value: f64,
    /// Standard deviation of the target, in the same unit; above zero.
    pub sd: f64,
    /// Scatter of the model's value between neighbouring parameter values, in the same unit; 0 if the
    /// model is smooth.
    pub scatter: f64,
    /// Whether model and target are compared by the logarithm of their ratio or by their difference.
    pub measure: ValueComparison,
    /// Whether the target counts in the last stage only.
    pub last: bool,
    /// Calibration errors of the camera that measured the target, if the value depends on them.
    pub calibration: Option<TargetCalibration>,
}

impl TargetValue {
    /// Standard deviation of a distance, including the scatter of the model, in units of
    /// [`Self::reference_size`].
    pub(crate) fn relative_sd(&self) -> f64 {
        math::hypot(self.sd, self.scatter) / self.reference_size()
    }

    /// Distance of `value` from the target in units of [`Self::reference_size`], limited to the logarithm of
    /// [`MAX_RATIO`] in size.
    pub(crate) fn distance(&self, value: f64) -> f64 {
        let most = math::ln(MAX_RATIO);
        match self.measure {
            ValueComparison::Log => {
                let ratio = value / self.value;
                if ratio > 0.0 { math::ln(ratio).clamp(-most, most) } else { -most }
            }
            ValueComparison::Linear { scale } => ((value - self.value) / scale).clamp(-most, most),
        }
    }

    /// Distance between two values, in the units of [`Self::distance`]; zero if the logarithm is undefined.
    pub(crate) fn distance_between(&self, value: f64, from: f64) -> f64 {
        match self.measure {
            ValueComparison::Log => {
                Some(value / from).filter(|ratio| *ratio > 0.0 && ratio.is_finite()).map_or(0.0, math::ln)
            }
            ValueComparison::Linear { scale } => (value - from) / scale,
        }
    }

    /// The target in the first stage, with a deviation of at least [`FIRST_STAGE_SD_RELATIVE`]; `None` if it
    /// counts in the last stage only.
    pub(super) fn first_stage_target(&self) -> Option<Self> {
        let sd = self.sd.max(FIRST_STAGE_SD_RELATIVE * self.reference_size());
        (!self.last).then(|| Self { sd, ..self.clone() })
    }

    /// Unit of distances, in the feature's own unit: the size of the target, or the difference that
    /// counts as large.
    pub(crate) fn reference_size(&self) -> f64 {
        match self.measure {
            ValueComparison::Log => self.value.abs(),
            ValueComparison::Linear { scale } => scale,
        }
    }
}

/// Dependence of a value on the calibration errors of its camera; a position becomes `(1 + scale)
/// value + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetCalibration {
    /// Index of the condition to which the camera belongs, from 0.
    pub condition: usize,
    /// Relative standard deviation of the scale; 0 if the scale is fixed.
    pub scale_sd: f64,
    /// Standard deviation of the offset, m; 0 if the offset is fixed.
    pub offset_sd_m: f64,
    /// Kind of length, which decides how scale and offset act on it.
    pub length: LengthCalibration,
}

impl TargetCalibration {
    /// The value, m, as a camera with the errors `[scale, offset]` shows it.
    pub(crate) fn apply(&self, value: f64, [scale, offset_m]: [f64; 2]) -> f64 {
        match self.length {
            LengthCalibration::Position => (1.0 + scale) * value + offset_m,
            LengthCalibration::Size { floor_m } => {
                let of_motion = (value * value - floor_m * floor_m).max(0.0).sqrt();
                math::hypot((1.0 + scale) * of_motion, floor_m)
            }
        }
    }

    /// Derivatives of the shown value by scale and by offset (m).
    pub(crate) fn derivatives(&self, value: f64, [scale, offset_m]: [f64; 2]) -> [f64; 2] {
        match self.length {
            LengthCalibration::Position => [value, 1.0],
            LengthCalibration::Size { floor_m } => {
                let motion2 = (value * value - floor_m * floor_m).max(0.0);
                [(1.0 + scale) * motion2 / self.apply(value, [scale, offset_m]), 0.0]
            }
        }
    }

    /// Standard deviation of a value due to the calibration errors, m.
    pub(crate) fn sd_m(&self, value: f64) -> f64 {
        let [by_scale, by_offset] = self.derivatives(value, [0.0; 2]);
        math::hypot(self.scale_sd * by_scale, self.offset_sd_m * by_offset)
    }

    /// Standard deviations of scale and offset; that of the offset is 0 if the value does not depend on it.
    pub(crate) fn standard_deviations(&self) -> [f64; 2] {
        match self.length {
            LengthCalibration::Position => [self.scale_sd, self.offset_sd_m],
            LengthCalibration::Size { .. } => [self.scale_sd, 0.0],
        }
    }
}
