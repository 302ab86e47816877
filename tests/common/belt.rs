//! A unit mass on a unit spring on a belt: stick-slip cycles of known length.

#![allow(dead_code)] // each test program uses a part

use hybrid_ode::{HybridPhase, PhaseEnd, PhaseStart};

/// The static limit is `at_rest`, the kinetic force a function of the sliding speed.
pub struct Belt {
    pub speed: f64,
    pub at_rest: f64,
    pub kinetic: fn(f64) -> f64,
    /// Order of the zero with which the sliding speed opens at release: 1 where the force drops, 2 where it
    /// is continuous.
    pub release_order: u8,
    /// Length of a cycle.
    pub period: f64,
}

/// The mass lags behind the belt; states are position and velocity. The sliding speed stays positive.
pub struct Sliding<'a>(pub &'a Belt);

impl HybridPhase<2, 1> for Sliding<'_> {
    fn derivative(&self, _: f64, y: &[f64; 2]) -> [f64; 2] {
        [y[1], (self.0.kinetic)(self.0.speed - y[1]) - y[0]]
    }
    fn guards(&self, _: f64, y: &[f64; 2]) -> [f64; 1] {
        [self.0.speed - y[1]]
    }
    fn scale(&self) -> [f64; 2] {
        [1.0, self.0.speed]
    }
}

/// The mass rides on the belt; the spring stays within the static limit.
pub struct Riding<'a>(pub &'a Belt);

impl HybridPhase<1, 1> for Riding<'_> {
    fn derivative(&self, _: f64, _: &[f64; 1]) -> [f64; 1] {
        [self.0.speed]
    }
    fn guards(&self, _: f64, y: &[f64; 1]) -> [f64; 1] {
        [self.0.at_rest - y[0]]
    }
    fn scale(&self) -> [f64; 1] {
        [1.0]
    }
}

impl Belt {
    /// Slip from a release at `t`.
    pub fn release(&self, t: f64, x: f64) -> PhaseStart<2, 1> {
        PhaseStart { t, y: [x, self.speed], zero_order: [self.release_order], step: None }
    }

    /// Stick from where slip ended.
    pub fn catch(&self, slip: &PhaseEnd<2>) -> PhaseStart<1, 1> {
        PhaseStart { t: slip.t, y: [slip.y[0]], zero_order: [0], step: None }
    }
}

/// Coulomb friction with a higher static limit, Stribeck friction, and the wiper's law twice: periods by
/// formula or recomputed to the digits shown.
pub const BELTS: [Belt; 4] = [
    Belt { speed: 0.2, at_rest: 1.0, kinetic: |_| 0.5, release_order: 1, period: 8.902_605_407_814_52 },
    Belt {
        speed: 0.2,
        at_rest: 1.0,
        kinetic: |v| 1.0 / (1.0 + 3.0 * v),
        release_order: 2,
        period: 12.001_031_294_830_58,
    },
    Belt {
        speed: 0.1,
        at_rest: 0.5,
        kinetic: |v| 0.3 * (-5.0 * v).exp() + 0.2,
        release_order: 2,
        period: 10.107_771_995_362_024,
    },
    Belt {
        speed: 0.1,
        at_rest: 0.8,
        kinetic: |v| 0.5 * (-5.0 * v).exp() + 0.3,
        release_order: 2,
        period: 13.948_428_077_770_275,
    },
];
