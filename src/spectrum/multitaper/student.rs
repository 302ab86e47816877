//! Quantiles of Student's t for whole degrees of freedom.

use crate::math;
use std::f64::consts::{FRAC_2_PI, FRAC_PI_2};

/// The `t` with the chance `inside` that a value of `degrees` degrees of freedom, one or more, lies between
/// `-t` and `t`.
pub(super) fn student_t_quantile(inside: f64, degrees: usize) -> f64 {
    /// Halvings that leave the last bit of an angle.
    const HALVINGS: usize = 60;
    let (mut low, mut high) = (0.0, FRAC_PI_2);
    for _ in 0..HALVINGS {
        let angle = (low + high) / 2.0;
        *(if student_t_probability(angle, degrees) < inside { &mut low } else { &mut high }) = angle;
    }
    (degrees as f64).sqrt() * math::tan(low)
}

/// The chance to lie within `sqrt(degrees) tan(angle)` (Abramowitz and Stegun 26.7.3, 26.7.4).
fn student_t_probability(angle: f64, degrees: usize) -> f64 {
    let (sine, cosine) = math::sin_cos(angle);
    let odd = degrees % 2;
    let mut term = if odd == 1 { cosine } else { 1.0 };
    let mut sum = 0.0;
    for power in (odd..=degrees.saturating_sub(2)).step_by(2) {
        sum += term;
        term *= cosine * cosine * (power + 1) as f64 / (power + 2) as f64;
    }
    match (odd, degrees) {
        (_, 1) => FRAC_2_PI * angle,
        (1, _) => FRAC_2_PI * (angle + sine * sum),
        _ => sine * sum,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_quantiles_are_those_of_the_tables() {
        // (Abramowitz and Stegun, table 26.10)
        for (degrees, tabled) in [
            (1, 12.706),
            (2, 4.303),
            (3, 3.182),
            (4, 2.776),
            (5, 2.571),
            (6, 2.447),
            (7, 2.365),
            (13, 2.160),
            (30, 2.042),
        ] {
            let found = student_t_quantile(0.95, degrees);
            assert!((found - tabled).abs() < 6e-4, "{degrees}: {found}");
        }
    }
}
