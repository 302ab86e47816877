//! Natural frequencies and modes of the blade without time integration: linearised about the upright
//! position, without friction.
//!
//! About `theta = phi = 0` equations (1) and (2) become `m qdd + c qd + k q = 0` with
//!
//! ```text
//! m = [[m_theta, m_c], [m_c, m_phi]]     c = [[c1 + c2, -c2], [-c2, c2]]
//! k = [[k1 + k2 - N0 l1, -k2], [-k2, k2 - N0 l2]]     N0 = k0 h_d
//! ```
//!
//! The preload softens both links; beyond the buckling load a mode is unstable. With the tip held on the
//! glass (`l1 theta + l2 phi` constant) one mode remains. A neck that leans on the shoulder has `k1 + ks` in
//! place of `k1`.

use super::Linkage;
use super::parameters::natural_frequency_hz;
use nalgebra::{Complex, Matrix2, Matrix4};
use portable_math as math;
use std::f64::consts::TAU;

/// One mode of the linearised blade.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NaturalMode {
    /// Undamped natural frequency, Hz; `None` for a mode that the preload has made unstable.
    pub frequency_hz: Option<f64>,
    /// Frequency of the damped oscillation, Hz; `None` unless all modes oscillate.
    pub damped_frequency_hz: Option<f64>,
    /// Damping ratio of the damped mode; `None` unless all modes oscillate.
    pub damping_ratio: Option<f64>,
    /// Ratio of the lip's angle to the neck's angle.
    pub lip_over_neck: f64,
}

/// Natural frequencies of head, neck and lip as single bodies, Hz, as in the paper.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct BodyFrequencies {
    pub head_hz: f64,
    pub neck_hz: f64,
    pub lip_hz: f64,
}

/// Constraint on the tip along the glass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TipConstraint {
    /// The tip slides without friction: two modes.
    Free,
    /// The tip is held: one mode.
    Held,
}

pub(crate) fn body_frequencies(blade: &Linkage) -> BodyFrequencies {
    BodyFrequencies {
        head_hz: natural_frequency_hz(blade.head.stiffness, blade.mass_kg),
        neck_hz: natural_frequency_hz(blade.neck.stiffness, blade.m_theta),
        lip_hz: natural_frequency_hz(blade.lip.stiffness, blade.m_phi),
    }
}

/// Natural frequencies that figures show, Hz, each with its name: those of head, neck and lip as single
/// bodies, or that of a slider on its spring.
pub(crate) fn named_frequencies(linkage: &Linkage) -> Vec<(String, f64)> {
    let BodyFrequencies { head_hz, neck_hz, lip_hz } = body_frequencies(linkage);
    let named: &[(&str, f64)] = if linkage.is_slider() {
        &[("slider", lip_hz)]
    } else {
        &[("head", head_hz), ("neck", neck_hz), ("lip", lip_hz)]
    };
    named.iter().map(|(name, hz)| ((*name).to_owned(), *hz)).collect()
}

/// Modes about the upright position, in order of rising frequency. With `on_shoulder`, stiffness and damping
/// of the shoulder are added to those of the neck. A slider has one mode if its tip is free and none
/// if it is held.
#[must_use]
pub fn natural_modes(blade: &Linkage, tip: TipConstraint, on_shoulder: bool) -> Vec<NaturalMode> {
    if let Some(slider) = blade.slider() {
        return Vec::from_iter((tip == TipConstraint::Free).then(|| slider.mode()));
    }
    let (m, c, k) = linearised_matrices(blade, on_shoulder);
    match tip {
        TipConstraint::Free => free_modes(&m, &c, &k),
        TipConstraint::Held => {
            // the angles of neck and lip are (1, -l1/l2) times one amplitude
            let shape = nalgebra::Vector2::new(1.0, -blade.l1_m / blade.l2_m);
            let along = |a: &Matrix2<f64>| shape.dot(&(a * shape));
            vec![single_mode(along(&m), along(&c), along(&k), shape[1])]
        }
    }
}

/// Complex ratio of the tip's displacement along the glass to the force on the tip, m/N, at a frequency in
/// Hz. The tip slides without friction.
///
/// `H = b^T (k + i w c - w^2 m)^-1 b` with `b = (l1, l2)`, the head at rest.
#[must_use]
pub fn tip_compliance(blade: &Linkage, on_shoulder: bool, frequency_hz: f64) -> Complex<f64> {
    let (m, c, k) = linearised_matrices(blade, on_shoulder);
    let w = TAU * frequency_hz;
    let of = |i, j| Complex::new(k[(i, j)] - w * w * m[(i, j)], w * c[(i, j)]);
    let (a, b, d) = (of(0, 0), of(0, 1), of(1, 1));
    let (l1, l2) = (blade.l1_m, blade.l2_m);
    (d * (l1 * l1) - b * (2.0 * l1 * l2) + a * (l2 * l2)) / (a * d - b * b)
}

/// Lower and higher natural angular frequency of the links, without preload and damping, rad/s. For a slider,
/// both are the rate of its fastest motion.
#[must_use]
pub fn time_scales_rad_per_s(blade: &Linkage) -> (f64, f64) {
    if let Some(slider) = blade.slider() {
        return (slider.rate_rad_per_s(), slider.rate_rad_per_s());
    }
    let unloaded = Linkage { preload_displacement_m: 0.0, ..*blade };
    let (m, _, k) = linearised_matrices(&unloaded, false);
    let (low, high) = squared_frequencies(&m, &k);
    (low.max(0.0).sqrt(), high.max(0.0).sqrt())
}

fn linearised_matrices(blade: &Linkage, on_shoulder: bool) -> (Matrix2<f64>, Matrix2<f64>, Matrix2<f64>) {
    let (mut k1, mut c1) = (blade.neck.stiffness, blade.neck.damping);
    if let (true, Some(shoulder)) = (on_shoulder, blade.shoulder) {
        k1 += shoulder.stiffness_n_m_per_rad;
        c1 += shoulder.damping_n_m_s_per_rad;
    }
    let (k2, c2) = (blade.lip.stiffness, blade.lip.damping);
    let preload = blade.head.stiffness * blade.preload_displacement_m;
    let m = Matrix2::new(blade.m_theta, blade.m_c, blade.m_c, blade.m_phi);
    let c = Matrix2::new(c1 + c2, -c2, -c2, c2);
    let k = Matrix2::new(k1 + k2 - preload * blade.l1_m, -k2, -k2, k2 - preload * blade.l2_m);
    (m, c, k)
}

/// Roots of `det(k - lambda m)`, the lower first. Both are real, because `m` is positive definite.
fn squared_frequencies(m: &Matrix2<f64>, k: &Matrix2<f64>) -> (f64, f64) {
    let a = m.determinant();
    let b = -(m[(0, 0)] * k[(1, 1)] + m[(1, 1)] * k[(0, 0)] - 2.0 * m[(0, 1)] * k[(0, 1)]);
    let c = k.determinant();
    // the root whose formula has no cancellation; the other root follows from the product of both roots
    let far = -0.5 * (b + b.signum() * (b * b - 4.0 * a * c).max(0.0).sqrt());
    let (first, second) = (far / a, if far == 0.0 { 0.0 } else { c / far });
    (first.min(second), first.max(second))
}

fn free_modes(m: &Matrix2<f64>, c: &Matrix2<f64>, k: &Matrix2<f64>) -> Vec<NaturalMode> {
    let (low, high) = squared_frequencies(m, k);
    let damped = damped_pairs(m, c, k);
    let mode = |(i, squared): (usize, f64)| {
        let (row_1, row_2) = (k[(0, 0)] - squared * m[(0, 0)], k[(0, 1)] - squared * m[(0, 1)]);
        NaturalMode {
            frequency_hz: (squared > 0.0).then(|| squared.sqrt() / TAU),
            damped_frequency_hz: damped.get(i).map(|d| d.0),
            damping_ratio: damped.get(i).map(|d| d.1),
            lip_over_neck: -row_1 / row_2,
        }
    };
    [low, high].into_iter().enumerate().map(mode).collect()
}

/// Damped frequency, Hz, and damping ratio of each conjugate pair of eigenvalues, in rising frequency. Empty
/// unless both pairs oscillate: a single pair could be assigned to the wrong mode.
fn damped_pairs(m: &Matrix2<f64>, c: &Matrix2<f64>, k: &Matrix2<f64>) -> Vec<(f64, f64)> {
    let Some(inverse) = m.try_inverse() else { return Vec::new() };
    let mut state = Matrix4::zeros();
    state.fixed_view_mut::<2, 2>(0, 2).copy_from(&Matrix2::identity());
    state.fixed_view_mut::<2, 2>(2, 0).copy_from(&(-inverse * k));
    state.fixed_view_mut::<2, 2>(2, 2).copy_from(&(-inverse * c));
    let eigenvalues = state.complex_eigenvalues();
    let upper = eigenvalues.iter().filter(|e| e.im > 0.0);
    let mut pairs: Vec<(f64, f64)> = upper.map(|e| (e.im / TAU, -e.re / math::hypot(e.re, e.im))).collect();
    math::sort_by_number(&mut pairs, |a| a.0);
    if pairs.len() == 2 { pairs } else { Vec::new() }
}

pub(super) fn single_mode(m: f64, c: f64, k: f64, lip_over_neck: f64) -> NaturalMode {
    let stable = k > 0.0;
    let ratio = c / (2.0 * (k.max(0.0) * m).sqrt());
    let oscillates = stable && ratio < 1.0;
    let frequency = (k.max(0.0) / m).sqrt() / TAU;
    NaturalMode {
        frequency_hz: stable.then_some(frequency),
        damped_frequency_hz: oscillates.then(|| frequency * (1.0 - ratio * ratio).sqrt()),
        damping_ratio: oscillates.then_some(ratio),
        lip_over_neck,
    }
}
