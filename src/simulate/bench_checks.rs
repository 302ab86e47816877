//! Properties of a scene's blade that can be checked on the real blade with ruler, scale and spectrum.

use super::equilibrium::steady_slip_pose;
use super::scene::{Drive, Scene};
use crate::model::modes::{BodyFrequencies, TipConstraint, body_frequencies, natural_modes, tip_compliance};
use crate::model::{LinkDirections, Linkage};
use serde::Serialize;
use std::f64::consts::TAU;

/// Standard acceleration of free fall, m/s^2 (CGPM 1901).
pub(crate) const FREE_FALL_M_PER_S2: f64 = 9.806_65;

/// Properties of a blade that can be checked with simple means.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BenchChecks {
    /// Mass of neck and lip, the rubber below the head, kg.
    pub rubber_mass_kg: f64,
    /// Mass of head, neck and lip, kg.
    pub mass_kg: f64,
    /// Weight of head, neck and lip, N.
    pub weight_n: f64,
    /// Masses and preload per metre of blade; `None` if the length is unknown.
    pub per_metre: Option<ChecksPerMetre>,
    /// Force `F` on the tip for which the displacements are computed, N.
    pub tip_force_n: f64,
    /// Displacement of the tip along the glass under the force `F` on the tip, in free air with the head
    /// held, m: `F * ((l1 + l2)^2 / k1 + l2^2 / k2)`.
    pub tip_displacement_m: f64,
    /// Displacement of the tip under the force `F` if head and neck are held, m: `F * l2^2 / k2`.
    pub lip_displacement_m: f64,
    /// Displacement of the support under the preload, m: `N0/k0`.
    pub preload_displacement_m: f64,
    /// Preload `N0`, N.
    pub preload_force_n: f64,
    /// Natural frequencies of head, neck and lip as single bodies.
    pub parts: PartFrequencies,
    /// Natural frequencies of the coupled modes in free air with the head held, Hz.
    pub free_air_hz: Vec<Option<f64>>,
    /// Natural frequencies of the coupled modes on the glass under the preload with a frictionless tip, Hz;
    /// `None` for a mode that the preload makes unstable.
    pub sliding_tip_hz: Vec<Option<f64>>,
    /// Natural frequencies of the coupled modes on the glass with a held tip, Hz; `None` for an unstable
    /// mode.
    pub held_tip_hz: Vec<Option<f64>>,
    /// Steady slip at the head's top speed; `None` for a recorded drive, or if the blade has no such
    /// equilibrium.
    pub slide: Option<SteadySlipCheck>,
}

/// Masses and preload per metre of blade.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[allow(missing_docs)] // the names include the units
pub struct ChecksPerMetre {
    pub rubber_mass_kg_per_m: f64,
    pub mass_kg_per_m: f64,
    pub press_force_n_per_m: f64,
}

/// Natural frequencies of head, neck and lip as single bodies, Hz.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[allow(missing_docs)] // the names include the unit
pub struct PartFrequencies {
    pub head_hz: f64,
    pub neck_hz: f64,
    pub lip_hz: f64,
}

/// A blade in steady slip.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SteadySlipCheck {
    /// Speed of the head, m/s.
    pub speed_m_per_s: f64,
    /// Distance by which the tip trails the head, m.
    pub deflection_m: f64,
    /// Drop of the head, m.
    pub head_drop_m: f64,
    /// Angle of the neck from the vertical, rad.
    pub neck_angle_rad: f64,
    /// Angle of the lip from the vertical, rad.
    pub lip_angle_rad: f64,
}

impl BenchChecks {
    /// Computes the checks for a force on the tip, N, and the length of blade to which the masses apply, m.
    #[must_use]
    pub fn from_scene(scene: &Scene, tip_force_n: f64, length_m: Option<f64>) -> Self {
        let blade = &scene.linkage;
        let in_air = Linkage { preload_displacement_m: 0.0, ..*blade };
        let rubber_mass_kg = blade.mass_kg - scene.value("blade.head_mass_kg").unwrap_or(0.0);
        let preload_force_n = blade.preload_displacement_m * blade.head.stiffness;
        let per_metre = length_m.map(|length_m| ChecksPerMetre {
            rubber_mass_kg_per_m: rubber_mass_kg / length_m,
            mass_kg_per_m: blade.mass_kg / length_m,
            press_force_n_per_m: preload_force_n / length_m,
        });
        let modes = |blade: &Linkage, tip: TipConstraint| {
            natural_modes(blade, tip, false).iter().map(|mode| mode.frequency_hz).collect()
        };
        let BodyFrequencies { head_hz, neck_hz, lip_hz } = body_frequencies(blade);
        Self {
            rubber_mass_kg,
            mass_kg: blade.mass_kg,
            weight_n: FREE_FALL_M_PER_S2 * blade.mass_kg,
            per_metre,
            tip_force_n,
            tip_displacement_m: tip_force_n * tip_compliance(&in_air, false, 0.0).re,
            lip_displacement_m: tip_force_n * blade.l2_m * blade.l2_m / blade.lip.stiffness,
            preload_displacement_m: blade.preload_displacement_m,
            preload_force_n,
            parts: PartFrequencies { head_hz, neck_hz, lip_hz },
            free_air_hz: modes(&in_air, TipConstraint::Free),
            sliding_tip_hz: modes(blade, TipConstraint::Free),
            held_tip_hz: modes(blade, TipConstraint::Held),
            slide: steady_slip_check(scene),
        }
    }
}

fn steady_slip_check(scene: &Scene) -> Option<SteadySlipCheck> {
    let Drive::Cosine { amplitude_m, frequency_hz, .. } = scene.drive else { return None };
    let speed_m_per_s = TAU * frequency_hz * amplitude_m;
    let blade = &scene.linkage;
    let pose = steady_slip_pose(blade, speed_m_per_s)?;
    let LinkDirections { sin_theta, cos_theta, sin_phi, cos_phi } = LinkDirections::from_pose(&pose);
    Some(SteadySlipCheck {
        speed_m_per_s,
        deflection_m: -(blade.l1_m * sin_theta + blade.l2_m * sin_phi),
        head_drop_m: blade.l1_m * (1.0 - cos_theta) + blade.l2_m * (1.0 - cos_phi),
        neck_angle_rad: pose.theta.abs(),
        lip_angle_rad: pose.phi.abs(),
    })
}
