//! What a feature should be, and how far from it a value is.

use super::calibration::Calibration;
use crate::feature::Measure;
use crate::math;

/// Ratio of model and target beyond which a residual no longer grows: two decades, more than any two bounds
/// of a physical feature, so that every value found beats a missing one.
pub const FAR: f64 = 100.0;

/// Least relative standard deviation in the first stage: far from the targets everything is missed by many
/// deviations, and the most precise features would outvote the others.
pub(crate) const FROM_AFAR: f64 = 0.05;

/// What a feature should be.
#[derive(Debug, Clone, PartialEq)]
pub struct Target {
    /// Name of the component or feature.
    pub name: String,
    /// Target, in the feature's own SI unit; not zero where it is measured by logarithms.
    pub value: f64,
    /// Its standard deviation, in the same unit; above zero.
    pub sd: f64,
    /// Scatter of the model's value between neighbouring parameters, in the same unit; 0 where it is smooth.
    pub scatter: f64,
    /// How a residual is taken.
    pub measure: Measure,
    /// Whether it counts in the last stage alone.
    pub last: bool,
    /// What is not known of the camera that measured it, where the value depends on it.
    pub calibration: Option<Calibration>,
}

impl Target {
    /// Standard deviation of the residual's numerator, the model's scatter included, in units of
    /// [`Self::scale`].
    #[must_use]
    pub(crate) fn relative_sd(&self) -> f64 {
        math::hypot(self.sd, self.scatter) / self.scale()
    }

    /// Distance of a value from the target in units of [`Self::scale`], stopped at the logarithm of [`FAR`].
    #[must_use]
    pub fn distance(&self, value: f64) -> f64 {
        let most = math::ln(FAR);
        match self.measure {
            Measure::Log => {
                let ratio = value / self.value;
                if ratio > 0.0 { math::ln(ratio).clamp(-most, most) } else { -most }
            }
            Measure::Linear { scale } => ((value - self.value) / scale).clamp(-most, most),
        }
    }

    /// Distance of one value from another, as [`Self::distance`] has it; zero where no logarithm can be
    /// taken.
    #[must_use]
    pub(crate) fn distance_between(&self, value: f64, from: f64) -> f64 {
        match self.measure {
            Measure::Log => {
                Some(value / from).filter(|ratio| *ratio > 0.0 && ratio.is_finite()).map_or(0.0, math::ln)
            }
            Measure::Linear { scale } => (value - from) / scale,
        }
    }

    /// The target of the first stage: known to no better than [`FROM_AFAR`], and none where it counts in the
    /// last stage alone.
    pub(super) fn for_first_stage(&self) -> Option<Self> {
        let sd = self.sd.max(FROM_AFAR * self.scale());
        (!self.last).then(|| Self { sd, ..self.clone() })
    }

    /// What a relative change refers to, in the feature's unit: the target's size, or the scale of its
    /// differences.
    #[must_use]
    pub fn scale(&self) -> f64 {
        match self.measure {
            Measure::Log => self.value.abs(),
            Measure::Linear { scale } => scale,
        }
    }
}
