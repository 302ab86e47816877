//! The friction law of a fit with what is known of it at every speed.

use crate::blade::friction::FrictionLaw;
use crate::fit::job::Job;
use crate::fit::result::FitResult;
use crate::math;
use std::array;

/// A coefficient of the law: its name in a scene, its symbol, and how the law changes with it at a speed.
#[derive(Debug, Clone, Copy)]
pub struct LawCoefficient {
    /// Name in a scene.
    pub name: &'static str,
    /// Symbol in the law.
    pub symbol: &'static str,
    slope: fn(&FrictionLaw, f64) -> f64,
}

/// The coefficients of `A exp(-B |v|) + C`.
pub const COEFFICIENTS: [LawCoefficient; 3] = [
    LawCoefficient { name: "friction.a", symbol: "A", slope: |law, v| math::exp(-law.b_s_per_m * v) },
    LawCoefficient {
        name: "friction.b_s_per_m",
        symbol: "B",
        slope: |law, v| -law.a * v * math::exp(-law.b_s_per_m * v),
    },
    LawCoefficient { name: "friction.c", symbol: "C", slope: |_, _| 1.0 },
];

/// Half of an interval at a tip speed, m/s.
pub type HalfInterval = Box<dyn Fn(f64) -> f64>;

/// Half of the 95 % interval of the coefficient of friction at a speed, propagated linearly from the stated
/// intervals of the fitted coefficients with their correlations; `None` where nothing of the law was fitted,
/// an interval is open, or the linear model does not determine a coefficient that was fitted.
#[must_use]
pub fn friction_half_95(job: &Job, result: &FitResult, law: &FrictionLaw) -> Option<HalfInterval> {
    let half = |coefficient: &LawCoefficient| {
        if !is_fitted(job, coefficient) {
            return Some(0.0);
        }
        let found = result.parameters.get(coefficient.name).filter(|found| found.has_interval())?;
        Some((found.estimate - found.lower_95?).max(found.upper_95? - found.estimate))
    };
    let [a, b, c] = COEFFICIENTS.each_ref().map(half);
    let halves = [a?, b?, c?];
    let correlation = |i: usize, j: usize| {
        if i == j || halves[i] == 0.0 || halves[j] == 0.0 {
            return Some(f64::from(u8::from(i == j)));
        }
        result.correlations.get(COEFFICIENTS[i].name)?.get(COEFFICIENTS[j].name).copied()
    };
    let row = |i: usize| Some([correlation(i, 0)?, correlation(i, 1)?, correlation(i, 2)?]);
    let correlations = [row(0)?, row(1)?, row(2)?];
    let law = *law;
    let half = move |v: f64| {
        let moved: [f64; 3] = array::from_fn(|i| (COEFFICIENTS[i].slope)(&law, v) * halves[i]);
        let row = |i: usize| (0..3).map(|j| moved[i] * moved[j] * correlations[i][j]).sum::<f64>();
        (0..3).map(row).sum::<f64>().max(0.0).sqrt()
    };
    COEFFICIENTS.iter().any(|c| is_fitted(job, c)).then(|| Box::new(half) as HalfInterval)
}

/// Whether a job fits a coefficient.
#[must_use]
pub fn is_fitted(job: &Job, coefficient: &LawCoefficient) -> bool {
    job.parameters.iter().any(|p| p.name == coefficient.name)
}
