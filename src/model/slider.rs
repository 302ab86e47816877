//! A slider, a mass on a spring that rubs on a surface, as the limit of a blade:
//!
//! ```text
//! m x'' = k (v - x) + d (v' - x') + f,   |f| <= mu N,   N constant
//! ```
//!
//! The end of a very long arm moves on a nearly straight line. So a slider is a blade whose neck has no
//! length and does not turn. Its lip is an arm of length `l2`, [`ARM_M`], with all the mass at the tip, and
//! with the stiffness `k l2^2` and the damping `d l2^2` at its hinge. Equations, series, events, derivatives
//! and fits are those of the blade. With `y = x - v`, the sine of the angle differs by the fraction
//! `(y / l2)^2`, and the stiffness by `N / l2`. Both are below the last bit of a number if `y` and `N / k`
//! are below 100 m. The arm is a power of two, so the conversion from length to angle has no rounding error.
//!
//! `m_b = M l2` and the length zero of the neck make the vector `n` of [`super`] zero, and with it the `nu`
//! of [`super::FrictionResponse`]. So a slider has no Painlevé paradox and cannot lose contact. Its normal
//! force changes only by the force of the support over the drop `y^2 / (2 l2)`: 5e-14 N at `y` = 10 mm.

use super::friction::FrictionLaw;
use super::modes::{NaturalMode, single_mode};
use super::{Linkage, Pose, Spring};

/// Length of the arm, m.
const ARM_M: f64 = (1u64 << 60) as f64;
/// Moment of inertia of the neck, kg m2, and its stiffness, N m/rad: 2^240. The moment of a spring of up to
/// 2^40 N/m turns the neck by at most 2^-80 of the angle of the arm.
const NECK: f64 = ARM_M * ARM_M * ARM_M * ARM_M;
/// Stiffness `k0` of the support, N/m: 2^30. The energy of the preload, `N^2 / (2 k0)`, is then small.
const SUPPORT_N_PER_M: f64 = (1u64 << 30) as f64;

/// Constants of a slider.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Slider {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Spring and damper between head and mass, N/m and N s/m.
    pub spring: Spring,
    /// Force that presses the mass onto the surface, N.
    pub normal_force_n: f64,
}

impl Linkage {
    /// The linkage of a slider.
    pub(crate) fn from_slider(slider: Slider, friction: FrictionLaw) -> Self {
        let Slider { mass_kg, spring: Spring { stiffness, damping }, normal_force_n } = slider;
        Self {
            mass_kg,
            l1_m: 0.0,
            l2_m: ARM_M,
            m_a: 0.0,
            m_b: mass_kg * ARM_M,
            m_c: 0.0,
            m_theta: NECK,
            m_phi: mass_kg * ARM_M * ARM_M,
            head: Spring { stiffness: SUPPORT_N_PER_M, damping: 0.0 },
            neck: Spring { stiffness: NECK, damping: 0.0 },
            lip: Spring { stiffness: stiffness * ARM_M * ARM_M, damping: damping * ARM_M * ARM_M },
            preload_displacement_m: normal_force_n / SUPPORT_N_PER_M,
            friction,
            shoulder: None,
        }
    }

    /// The slider with this linkage; `None` for a blade.
    pub(crate) fn slider(&self) -> Option<Slider> {
        let Spring { stiffness, damping } = self.lip;
        let per_square = 1.0 / (ARM_M * ARM_M);
        self.is_slider().then_some(Slider {
            mass_kg: self.mass_kg,
            spring: Spring { stiffness: stiffness * per_square, damping: damping * per_square },
            normal_force_n: self.preload_displacement_m * self.head.stiffness,
        })
    }

    /// Whether this is the linkage of a slider: its neck has no length.
    #[must_use]
    pub fn is_slider(&self) -> bool {
        self.l1_m == 0.0
    }

    /// Factors that convert usual angles of neck and lip of a blade to those of this linkage. They are 1 for
    /// a blade. For a slider they are 0 for the neck, which does not turn, and the angle of
    /// [`Slider::deflection_scale_m`] for the lip.
    pub(crate) fn angle_units(&self) -> [f64; 2] {
        let lip = |slider: Slider| Pose::of_slider(slider.deflection_scale_m(), 0.0).phi;
        self.slider().map_or([1.0; 2], |slider| [0.0, lip(slider)])
    }

    /// Height of the head of the upright blade above the glass, m; zero for a slider.
    #[must_use]
    pub fn upright_height_m(&self) -> f64 {
        if self.is_slider() { 0.0 } else { self.l1_m + self.l2_m }
    }
}

impl Pose {
    /// Pose of a slider with this deflection, m, and this rate of the deflection, m/s.
    pub(crate) fn of_slider(deflection_m: f64, rate_m_per_s: f64) -> Self {
        let (phi, phi_rate) = (deflection_m / ARM_M, rate_m_per_s / ARM_M);
        Self { theta: 0.0, phi, theta_rate: 0.0, phi_rate }
    }

    /// Deflection, m, of a slider with this pose, and its rate, m/s.
    pub(crate) fn slider_deflection(&self) -> [f64; 2] {
        [self.phi * ARM_M, self.phi_rate * ARM_M]
    }
}

impl Slider {
    /// Rate of the fastest motion, rad/s: the larger of the natural angular frequency and the rate at which
    /// the damper alone makes the velocity decay. It is 1 without spring and damper, where time has no scale.
    pub(crate) fn rate_rad_per_s(&self) -> f64 {
        let Spring { stiffness, damping } = self.spring;
        let rate = (stiffness / self.mass_kg).sqrt().max(damping / self.mass_kg);
        if rate > 0.0 { rate } else { 1.0 }
    }

    /// Deflection, m, below which the tolerance of a run is absolute: the deflection under the normal force
    /// of a spring that gives the mass the natural angular frequency [`Self::rate_rad_per_s`].
    pub(crate) fn deflection_scale_m(&self) -> f64 {
        let rate = self.rate_rad_per_s();
        self.normal_force_n / (self.mass_kg * rate * rate)
    }

    /// Mode of the mass on its spring, without friction.
    pub(crate) fn mode(&self) -> NaturalMode {
        single_mode(self.mass_kg, self.spring.damping, self.spring.stiffness, 0.0)
    }
}
