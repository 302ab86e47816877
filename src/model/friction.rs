//! Friction between lip tip and glass, equations (4) and (5): `mu(v) = a exp(-b |v|) + c`; the static
//! coefficient is `mu(0)`.

use portable_math as math;
use serde::Serialize;

/// Coefficients of the friction law.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FrictionLaw {
    /// Part of the coefficient that falls with speed, `A`.
    pub a: f64,
    /// Decay of the part `A` with speed, `B`, s/m: this part falls to `1/e` at the speed `1/B`.
    pub b_s_per_m: f64,
    /// Part of the coefficient that does not depend on speed, `C`.
    pub c: f64,
}

impl FrictionLaw {
    /// Coefficient of dynamic friction at the tip speed `|v3dot|`, m/s (equation (4) without the sign).
    #[inline]
    #[must_use]
    pub fn dynamic_coefficient(&self, speed_m_per_s: f64) -> f64 {
        self.a * math::exp(-self.b_s_per_m * speed_m_per_s) + self.c
    }

    /// Coefficient of static friction, `A + C`: the limit of the dynamic coefficient at zero speed (equation
    /// (5)).
    #[inline]
    #[must_use]
    pub fn static_coefficient(&self) -> f64 {
        self.a + self.c
    }
}
