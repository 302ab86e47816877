//! What ruler, scale and a spectrum show of a scene's blade: numbers to hold against the real one.

use super::equilibrium::steady_slip_pose;
use super::scene::{Drive, Scene};
use crate::model::modes::{
    BodyFrequencies, NaturalMode, TipConstraint, body_frequencies, natural_modes, tip_compliance,
};
use crate::model::{LinkDirections, Linkage};
use serde::Serialize;
use std::f64::consts::TAU;

/// Standard acceleration of free fall, m/s2 (CGPM 1901): what turns a mass into a weight.
pub(crate) const FREE_FALL_M_PER_S2: f64 = 9.806_65;

/// Numbers to check with simple means; lengths in m, forces in N, masses in kg.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BenchChecks {
    /// Mass of neck and lip: the rubber that is cut off below the head.
    pub rubber_mass_kg: f64,
    /// Mass of head, neck and lip.
    pub mass_kg: f64,
    /// Their weight.
    pub weight_n: f64,
    /// Masses and preload over the length of blade, where that is known.
    pub per_metre: Option<ChecksPerMetre>,
    /// Force on the tip for which the displacements are.
    pub tip_force_n: f64,
    /// How far such a force along the glass moves the tip of a blade in free air, its head held: `F ((l1 +
    /// l2)^2/k1 + l2^2/k2)`.
    pub tip_displacement_m: f64,
    /// The same with the neck held: `F l2^2/k2`.
    pub lip_displacement_m: f64,
    /// How far the support gives under the preload: `N0/k0`.
    pub preload_displacement_m: f64,
    /// The preload.
    pub preload_force_n: f64,
    /// Natural frequencies of the single parts.
    pub parts: PartFrequencies,
    /// Coupled modes in free air, the head held, Hz.
    pub free_air_hz: Vec<Option<f64>>,
    /// The same on the glass under the preload, the tip sliding without friction; `None` for a mode that the
    /// preload has made unstable.
    pub sliding_tip_hz: Vec<Option<f64>>,
    /// The same with the tip held by the glass.
    pub held_tip_hz: Vec<Option<f64>>,
    /// The blade in steady slip at the head's top speed; `None` for a recorded drive or a blade without such
    /// an equilibrium.
    pub slide: Option<SteadySlipCheck>,
}

/// What does not depend on the length of blade.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[allow(missing_docs)] // named with their units
pub struct ChecksPerMetre {
    pub rubber_mass_kg_per_m: f64,
    pub mass_kg_per_m: f64,
    pub press_force_n_per_m: f64,
}

/// Natural frequencies of head, neck and lip, Hz.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[allow(missing_docs)] // named with their unit
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
    /// How far the tip trails, m.
    pub deflection_m: f64,
    /// How far the head has dropped, m.
    pub head_drop_m: f64,
    /// How far the neck leans, rad.
    pub neck_angle_rad: f64,
    /// How far the lip leans, rad.
    pub lip_angle_rad: f64,
}

impl BenchChecks {
    /// Of a scene's blade, for a force on its tip, N, and the length of blade that its masses are for, m.
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
            free_air_hz: mode_frequencies(&natural_modes(&in_air, TipConstraint::Free, false)),
            sliding_tip_hz: mode_frequencies(&natural_modes(blade, TipConstraint::Free, false)),
            held_tip_hz: mode_frequencies(&natural_modes(blade, TipConstraint::Held, false)),
            slide: steady_slip_check(scene),
        }
    }
}

fn mode_frequencies(modes: &[NaturalMode]) -> Vec<Option<f64>> {
    modes.iter().map(|mode| mode.frequency_hz).collect()
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
