//! Friction between lip tip and glass, equations (4) and (5): `mu(v) = a exp(-b |v|) + c`; the static
//! coefficient is `mu(0)`.

use portable_math as math;
use serde::Serialize;

/// Coefficients of the friction law.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FrictionLaw {
    /// `A`: the part of the friction coefficient that falls with speed, at zero speed.
    pub a: f64,
    /// `B`, s/m: rate at which the part `A` falls with speed. At the speed `1/B`, this part is `A/e`.
    pub b_s_per_m: f64,
    /// `C`: the part of the friction coefficient that does not depend on speed.
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
