//! A measured or published value of a feature, which a fit must reproduce.

use crate::feature::{LengthCalibration, ValueComparison};
use portable_math as math;

/// Ratio of model to target, or of target to model, above which the residual no longer grows. No physical
/// feature varies by more than two decades, so a feature with a value always costs less than a missing
/// feature.
pub(crate) const MAX_RATIO: f64 = 100.0;

/// Lower limit of the relative standard deviation of a target in the first stage of the search. Far from the
/// targets all residuals are many standard deviations, and the most precise features would otherwise dominate
/// the cost.
pub(crate) const FIRST_STAGE_SD_RELATIVE: f64 = 0.05;

/// The target value of a feature, with its standard deviation.
#[derive(Debug, Clone, PartialEq)]
pub struct TargetValue {
    /// Name of the component or feature.
    pub name: String,
    /// Target value, in the feature's own SI unit; not zero if values are compared by logarithms.
    pub value: f64,
    /// Standard deviation of the target, in the unit of `value`; above zero.
    pub sd: f64,
    /// Scatter of the model's value between neighbouring parameter values, in the unit of `value`; 0 if the
    /// model is smooth.
    pub scatter: f64,
    /// Whether model and target are compared by the logarithm of their ratio or by their difference.
    pub measure: ValueComparison,
    /// Whether the target counts only in the last stage of the search.
    pub last: bool,
    /// Calibration errors of the camera that measured the target, if the value depends on them.
    pub calibration: Option<TargetCalibration>,
}

impl TargetValue {
    /// Standard deviation of [`Self::distance`] (dimensionless). It combines the standard deviation of the
    /// target and the scatter of the model.
    pub(crate) fn relative_sd(&self) -> f64 {
        math::hypot(self.sd, self.scatter) / self.reference_size()
    }

    /// Dimensionless distance of `value` from the target: the logarithm of their ratio or, if values are
    /// compared by differences, the difference divided by [`Self::reference_size`]. Its absolute value is
    /// limited to the logarithm of [`MAX_RATIO`].
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

    /// Distance of `value` from the value `from`, defined like [`Self::distance`] but without a limit; zero
    /// if the logarithm is undefined.
    pub(crate) fn distance_between(&self, value: f64, from: f64) -> f64 {
        match self.measure {
            ValueComparison::Log => {
                Some(value / from).filter(|ratio| *ratio > 0.0 && ratio.is_finite()).map_or(0.0, math::ln)
            }
            ValueComparison::Linear { scale } => (value - from) / scale,
        }
    }

    /// The target as it counts in the first stage of the search, with a relative standard deviation of at
    /// least [`FIRST_STAGE_SD_RELATIVE`]; `None` if the target counts in the last stage only.
    pub(super) fn first_stage_target(&self) -> Option<Self> {
        let sd = self.sd.max(FIRST_STAGE_SD_RELATIVE * self.reference_size());
        (!self.last).then(|| Self { sd, ..self.clone() })
    }

    /// Difference, in the unit of the feature, that corresponds to a distance of 1 (for logarithms: near the
    /// target). It is the absolute value of the target or, if values are compared by differences, the
    /// difference that counts as large.
    pub(crate) fn reference_size(&self) -> f64 {
        match self.measure {
            ValueComparison::Log => self.value.abs(),
            ValueComparison::Linear { scale } => scale,
        }
    }
}

/// How a feature depends on the calibration errors of its camera. For example, the camera shows a position as
/// `(1 + scale) * value + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetCalibration {
    /// Index of the condition to which the camera belongs, from 0.
    pub condition: usize,
    /// Relative standard deviation of the scale; 0 if the scale is fixed.
    pub scale_sd: f64,
    /// Standard deviation of the offset, m; 0 if the offset is fixed.
    pub offset_sd_m: f64,
    /// Kind of the value (such as position or size), which determines how scale and offset change it.
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

    /// Derivatives of the value that the camera shows, m, with respect to the scale and with respect to the
    /// offset, m.
    pub(crate) fn derivatives(&self, value: f64, [scale, offset_m]: [f64; 2]) -> [f64; 2] {
        match self.length {
            LengthCalibration::Position => [value, 1.0],
            LengthCalibration::Size { floor_m } => {
                let motion2 = (value * value - floor_m * floor_m).max(0.0);
                [(1.0 + scale) * motion2 / self.apply(value, [scale, offset_m]), 0.0]
            }
        }
    }

    /// Standard deviation, m, that the calibration errors cause in the value shown by the camera.
    pub(crate) fn sd_m(&self, value: f64) -> f64 {
        let [by_scale, by_offset] = self.derivatives(value, [0.0; 2]);
        math::hypot(self.scale_sd * by_scale, self.offset_sd_m * by_offset)
    }

    /// Standard deviations of scale and offset; the second is 0 if the value does not depend on the offset.
    pub(crate) fn standard_deviations(&self) -> [f64; 2] {
        match self.length {
            LengthCalibration::Position => [self.scale_sd, self.offset_sd_m],
            LengthCalibration::Size { .. } => [self.scale_sd, 0.0],
        }
    }
}
