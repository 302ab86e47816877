//! What a feature should be, and how far from it a value is.

use super::calibration::TargetCalibration;
use crate::feature::ValueComparison;
use crate::math;

/// Ratio of model and target beyond which a residual no longer grows: two decades, more than any two bounds
/// of a physical feature, so that every value found beats a missing one.
pub const MAX_RATIO: f64 = 100.0;

/// Least relative standard deviation in the first stage: far from the targets everything is missed by many
/// deviations, and the most precise features would outvote the others.
pub(crate) const FIRST_STAGE_SD_RELATIVE: f64 = 0.05;

/// What a feature should be.
#[derive(Debug, Clone, PartialEq)]
pub struct TargetValue {
    /// Name of the component or feature.
    pub name: String,
    /// Target, in the feature's own SI unit; not zero where it is measured by logarithms.
    pub value: f64,
    /// Its standard deviation, in the same unit; above zero.
    pub sd: f64,
    /// Scatter of the model's value between neighbouring parameters, in the same unit; 0 where it is smooth.
    pub scatter: f64,
    /// How a residual is taken.
    pub measure: ValueComparison,
    /// Whether it counts in the last stage alone.
    pub last: bool,
    /// What is not known of the camera that measured it, where the value depends on it.
    pub calibration: Option<TargetCalibration>,
}

impl TargetValue {
    /// Standard deviation of the residual's numerator, the model's scatter included, in units of
    /// [`Self::reference_size`].
    #[must_use]
    pub(crate) fn relative_sd(&self) -> f64 {
        math::hypot(self.sd, self.scatter) / self.reference_size()
    }

    /// Distance of a value from the target in units of [`Self::reference_size`], stopped at the logarithm of [`MAX_RATIO`].
    #[must_use]
    pub fn distance(&self, value: f64) -> f64 {
        let most = math::ln(MAX_RATIO);
        match self.measure {
            ValueComparison::Log => {
                let ratio = value / self.value;
                if ratio > 0.0 { math::ln(ratio).clamp(-most, most) } else { -most }
            }
            ValueComparison::Linear { scale } => ((value - self.value) / scale).clamp(-most, most),
        }
    }

    /// Distance of one value from another, as [`Self::distance`] has it; zero where no logarithm can be
    /// taken.
    #[must_use]
    pub(crate) fn distance_between(&self, value: f64, from: f64) -> f64 {
        match self.measure {
            ValueComparison::Log => {
                Some(value / from).filter(|ratio| *ratio > 0.0 && ratio.is_finite()).map_or(0.0, math::ln)
            }
            ValueComparison::Linear { scale } => (value - from) / scale,
        }
    }

    /// The target of the first stage: known to no better than [`FIRST_STAGE_SD_RELATIVE`], and none where it counts in the
    /// last stage alone.
    pub(super) fn first_stage_target(&self) -> Option<Self> {
        let sd = self.sd.max(FIRST_STAGE_SD_RELATIVE * self.reference_size());
        (!self.last).then(|| Self { sd, ..self.clone() })
    }

    /// What a relative change refers to, in the feature's unit: the target's size, or the scale of its
    /// differences.
    #[must_use]
    pub fn reference_size(&self) -> f64 {
        match self.measure {
            ValueComparison::Log => self.value.abs(),
            ValueComparison::Linear { scale } => scale,
        }
    }
}
