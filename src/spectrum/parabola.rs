//! The top of a peak between three amplitudes.

use crate::math;

/// Vertex of the parabola through the logarithms of three amplitudes at equal distances: where, in distances
/// from the middle one, and how high.
pub(super) fn log_parabola_vertex(around: [f64; 3]) -> (f64, f64) {
    let [left, top, right] = around.map(|a| math::ln(a.max(f64::MIN_POSITIVE)));
    let curvature = left - 2.0 * top + right;
    let shift = if curvature < 0.0 { ((left - right) / (2.0 * curvature)).clamp(-0.5, 0.5) } else { 0.0 };
    (shift, math::exp(top - (left - right) * shift / 4.0))
}
