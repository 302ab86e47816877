//! Bounds of a parameter, and the invertible transforms between its physical value, the unit interval and the
//! real line.
//!
//! Clouds of points search the unit box. A search without bounds uses the real line with `u = (1 + sin z) /
//! 2`, the transform of MINUIT (James and Roos, Comput. Phys. Commun. 10 (1975) 343): it reaches both bounds
//! at finite `z`, and no `z` lies outside the box.

use portable_math as math;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_PI_2;

/// Scale on which the range of a parameter is divided.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum BoundsSpacing {
    /// Equal ratios take equal lengths; both bounds must be above 0.
    Log,
    /// Equal differences take equal lengths.
    Linear,
}

/// Reason why two numbers are not valid bounds.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum BoundsError {
    /// A bound is infinite or not a number.
    #[error("`{key}`: found {found}, expected a finite number")]
    NotFinite {
        /// Key of the bound: `lower` or `upper`.
        key: &'static str,
        /// Value of the bound that was found.
        found: f64,
    },
    /// The lower bound is not below the upper bound, or no floating-point number fits between them.
    #[error(
        "`lower` = {lower} and `upper` = {upper}: expected lower < upper; exchange or widen them, or fix the parameter in the scene"
    )]
    Crossed {
        /// Lower bound as written.
        lower: f64,
        /// Upper bound as written.
        upper: f64,
    },
    /// A logarithmic range has a lower bound that is not above zero.
    #[error(
        "`lower` = {lower}: expected a number above 0 because `scale` is \"log\"; raise the bound or use scale = \"linear\""
    )]
    LogOfNonPositive {
        /// Lower bound as written.
        lower: f64,
    },
}

/// A parameter's range, in the parameter's own SI unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Bounds {
    lower: f64,
    upper: f64,
    spacing: BoundsSpacing,
}

impl Bounds {
    /// Checks the bounds.
    ///
    /// # Errors
    /// [`BoundsError`] if a bound is not finite, if the lower bound is not below the upper bound, or if a
    /// lower bound of a logarithmic range is not above zero.
    pub fn new(lower: f64, upper: f64, spacing: BoundsSpacing) -> Result<Self, BoundsError> {
        for (key, found) in [("lower", lower), ("upper", upper)] {
            if !found.is_finite() {
                return Err(BoundsError::NotFinite { key, found });
            }
        }
        if spacing == BoundsSpacing::Log && lower <= 0.0 {
            return Err(BoundsError::LogOfNonPositive { lower });
        }
        let bounds = Self { lower, upper, spacing };
        let length = bounds.scaled_length();
        if lower >= upper || !length.is_finite() || length <= 0.0 {
            return Err(BoundsError::Crossed { lower, upper });
        }
        Ok(bounds)
    }

    /// Lower bound, in the parameter's unit.
    pub(crate) fn lower(&self) -> f64 {
        self.lower
    }

    /// Upper bound, in the parameter's unit.
    pub(crate) fn upper(&self) -> f64 {
        self.upper
    }

    pub(crate) fn spacing(&self) -> BoundsSpacing {
        self.spacing
    }

    /// Coordinate of `value` in the unit interval; a value outside the bounds is clamped.
    pub(crate) fn unit_coordinate(&self, value: f64) -> f64 {
        let value = value.clamp(self.lower, self.upper);
        let along = match self.spacing {
            BoundsSpacing::Log => math::ln(value / self.lower),
            BoundsSpacing::Linear => value - self.lower,
        };
        clamp_unit(along / self.scaled_length())
    }

    /// Value at the coordinate `unit`, which is clamped to the range from 0 to 1; 0 and 1 give the bounds
    /// exactly.
    pub(crate) fn value_at_unit(&self, unit: f64) -> f64 {
        let unit = clamp_unit(unit);
        if unit == 0.0 {
            return self.lower;
        }
        if unit == 1.0 {
            return self.upper;
        }
        let value = match self.spacing {
            BoundsSpacing::Log => self.lower * math::exp(unit * self.scaled_length()),
            BoundsSpacing::Linear => self.lower + unit * self.scaled_length(),
        };
        value.clamp(self.lower, self.upper)
    }

    /// Derivative of the parameter value with respect to the unit coordinate, at the coordinate `unit`, in
    /// the unit of the parameter.
    pub(crate) fn slope(&self, unit: f64) -> f64 {
        match self.spacing {
            BoundsSpacing::Log => self.scaled_length() * self.value_at_unit(unit),
            BoundsSpacing::Linear => self.scaled_length(),
        }
    }

    /// Derivative of the logarithm of the parameter value with respect to the unit coordinate, at the
    /// coordinate `unit`; `None` where the value is zero.
    pub(crate) fn log_slope(&self, unit: f64) -> Option<f64> {
        match self.spacing {
            BoundsSpacing::Log => Some(self.scaled_length()),
            BoundsSpacing::Linear => {
                let value = self.value_at_unit(unit);
                (value != 0.0).then(|| self.scaled_length() / value)
            }
        }
    }

    fn scaled_length(&self) -> f64 {
        match self.spacing {
            BoundsSpacing::Log => math::ln(self.upper / self.lower),
            BoundsSpacing::Linear => self.upper - self.lower,
        }
    }
}

/// Clamps `unit` to the range from 0 to 1. Minus zero becomes zero, so that equal points have equal bits; NaN
/// becomes one half.
pub(crate) fn clamp_unit(unit: f64) -> f64 {
    if unit.is_nan() { 0.5 } else { unit.clamp(0.0, 1.0) + 0.0 }
}

/// Maps the unit interval to the real line, `z = asin(2 u - 1)`, between -pi/2 and pi/2.
pub(crate) fn unit_to_line(unit: f64) -> f64 {
    math::asin(2.0 * clamp_unit(unit) - 1.0)
}

/// Maps a real number to the unit interval, `u = (1 + sin z) / 2`; exact at `z` = -pi/2 and pi/2.
pub(crate) fn line_to_unit(line: f64) -> f64 {
    if line.abs() == FRAC_PI_2 {
        return if line > 0.0 { 1.0 } else { 0.0 };
    }
    clamp_unit(0.5 * (1.0 + math::sin(line)))
}

/// Prior: a normal distribution of a parameter or of the logarithm of the parameter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum Prior {
    /// Normal distribution of the parameter, in its own SI unit.
    Linear {
        /// Mean of the parameter.
        mean: f64,
        /// Standard deviation of the parameter.
        sd: f64,
    },
    /// Normal distribution of the natural logarithm of the parameter, used if the bounds are logarithmic.
    Log {
        /// Mean of the natural logarithm of the parameter's value in its SI unit.
        mean_ln: f64,
        /// Standard deviation of the natural logarithm of the parameter's value.
        sd_ln: f64,
    },
}

impl Prior {
    /// Distance of `value` from the mean of the prior, in standard deviations of the prior; `value` is in the
    /// SI unit of the parameter.
    pub(crate) fn residual(&self, value: f64) -> f64 {
        match *self {
            Self::Linear { mean, sd } => (value - mean) / sd,
            Self::Log { mean_ln, sd_ln } => (math::ln(value) - mean_ln) / sd_ln,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_survive_the_round_trip() {
        let log = Bounds::new(1e-3, 10.0, BoundsSpacing::Log).unwrap();
        let linear = Bounds::new(-2.0, 5.0, BoundsSpacing::Linear).unwrap();
        for step in 0..=1000 {
            let unit = f64::from(step) / 1000.0;
            for bounds in [log, linear] {
                assert!((bounds.unit_coordinate(bounds.value_at_unit(unit)) - unit).abs() < 1e-14, "{unit}");
            }
            // near both ends of the unit interval, u = (1 + sin z) / 2 is quadratic in the distance of z from
            // the end: z has only half of the digits of u, but u computed from z has all of them
            assert!((line_to_unit(unit_to_line(unit)) - unit).abs() < 1e-15, "{unit}");
        }
    }

    #[test]
    fn the_ends_and_the_middle_are_exact() {
        let log = Bounds::new(0.01, 100.0, BoundsSpacing::Log).unwrap();
        assert_eq!((log.value_at_unit(0.0), log.value_at_unit(1.0)), (0.01, 100.0));
        assert!((log.value_at_unit(0.5) - 1.0).abs() < 1e-15);
        assert_eq!((log.unit_coordinate(0.001), log.unit_coordinate(1e9)), (0.0, 1.0));
        assert_eq!((line_to_unit(unit_to_line(0.0)), line_to_unit(unit_to_line(1.0))), (0.0, 1.0));
        let linear = Bounds::new(-1.0, 3.0, BoundsSpacing::Linear).unwrap();
        assert_eq!(linear.value_at_unit(0.5), 1.0);
    }

    #[test]
    fn no_real_number_leaves_the_box() {
        for line in [-1e300, -7.0, -0.0, 1.5, 40.0, 1e300, f64::NAN, f64::INFINITY] {
            let unit = line_to_unit(line);
            assert!((0.0..=1.0).contains(&unit) && !unit.is_sign_negative(), "{line} -> {unit}");
        }
    }

    #[test]
    fn slopes_are_those_of_the_transform() {
        let log = Bounds::new(1.0, 4.0, BoundsSpacing::Log).unwrap();
        let linear = Bounds::new(-1.0, 1.0, BoundsSpacing::Linear).unwrap();
        assert_eq!(log.log_slope(0.3), Some(4.0_f64.ln()));
        assert_eq!((linear.log_slope(1.0), linear.log_slope(0.5)), (Some(2.0), None));
        assert_eq!((log.slope(0.5), linear.slope(0.5)), (2.0 * 4.0_f64.ln(), 2.0));
    }

    #[test]
    fn bad_bounds_are_refused() {
        let refused = |lower, upper, spacing| Bounds::new(lower, upper, spacing).unwrap_err();
        assert!(matches!(refused(1.0, 1.0, BoundsSpacing::Linear), BoundsError::Crossed { .. }));
        assert!(matches!(refused(2.0, 1.0, BoundsSpacing::Log), BoundsError::Crossed { .. }));
        assert!(matches!(refused(0.0, 1.0, BoundsSpacing::Log), BoundsError::LogOfNonPositive { .. }));
        assert!(matches!(refused(-f64::MAX, f64::MAX, BoundsSpacing::Linear), BoundsError::Crossed { .. }));
        assert!(matches!(
            refused(0.0, f64::INFINITY, BoundsSpacing::Linear),
            BoundsError::NotFinite { key: "upper", .. }
        ));
    }
}
