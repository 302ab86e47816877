//! Central differences of functions that are cheap and smooth.

/// Steps of the six-point central difference with their weights (Fornberg, Math. Comp. 51, 1988, table 1):
/// order 6.
pub(super) const SIX_POINTS: [(f64, f64); 6] = [
    (-3.0, -1.0 / 60.0),
    (-2.0, 9.0 / 60.0),
    (-1.0, -45.0 / 60.0),
    (1.0, 45.0 / 60.0),
    (2.0, -9.0 / 60.0),
    (3.0, 1.0 / 60.0),
];

/// Step relative to the scale on which a function changes: its sixth power, the truncation, is below
/// rounding, and rounding over it leaves 1e-13.
pub(super) const DIFFERENCE_STEP: f64 = 1e-3;

/// Derivative of `f` at 0 along its argument; `None` where `f` has no value.
pub(super) fn central_difference<const N: usize>(
    step: f64,
    mut f: impl FnMut(f64) -> Option<[f64; N]>,
) -> Option<[f64; N]> {
    let mut sum = [0.0; N];
    for (point, weight) in SIX_POINTS {
        let value = f(point * step)?;
        sum.iter_mut().zip(value).for_each(|(sum, value)| *sum += weight / step * value);
    }
    Some(sum)
}
