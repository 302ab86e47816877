//! From the numbers of a scene to the constants of the linkage.

use super::{SceneError, key_error};
use crate::model::friction::FrictionLaw;
use crate::model::parameters::{PARAMETERS, ParameterQuantity, damping_from_ratio, stiffness_from_frequency};
use crate::model::shoulder::Shoulder;
use crate::model::{Linkage, Spring};
use std::collections::BTreeMap;

type SceneValues = BTreeMap<&'static str, f64>;

/// Builds the linkage from the numbers of a complete scene.
pub(super) fn build_linkage(
    file: &str,
    values: &SceneValues,
    has_shoulder: bool,
) -> Result<Linkage, SceneError> {
    let number = |name: &str| values.get(name).copied().unwrap_or(0.0); // completeness was checked
    for (centre, length) in
        [("blade.neck_centre_m", "blade.neck_length_m"), ("blade.lip_centre_m", "blade.lip_length_m")]
    {
        if number(centre) > number(length) {
            return Err(key_error(
                file,
                centre,
                &number(centre).to_string(),
                &format!("at most the link's length {} m", number(length)),
                "check the units: lengths are in m",
            ));
        }
    }
    let linkage = linkage_constants(values, has_shoulder);
    let (m_theta, m_phi, m_c) = (linkage.m_theta, linkage.m_phi, linkage.m_c);
    if !(m_theta * m_phi - m_c * m_c > 0.0 && (m_theta * m_phi).is_finite()) {
        let found = "links whose inertia matrix is singular";
        return Err(key_error(
            file,
            "blade.lip_inertia_kg_m2",
            found,
            "a link with inertia",
            "give the lip and the neck mass and inertia",
        ));
    }
    Ok(linkage)
}

/// The constants that follow from the numbers of a scene (model notation in [`crate::model`]).
pub(super) fn linkage_constants(values: &SceneValues, has_shoulder: bool) -> Linkage {
    let of = |quantity: ParameterQuantity| {
        PARAMETERS
            .iter()
            .filter(|p| p.quantity == quantity)
            .find_map(|p| values.get(p.name).map(|&v| (p.name, v)))
    };
    let plain = |quantity: ParameterQuantity| of(quantity).map_or(0.0, |(_, v)| v);
    let stiffness = |quantity: ParameterQuantity, inertia: f64| match of(quantity) {
        Some((name, frequency)) if name.ends_with("_hz") => stiffness_from_frequency(frequency, inertia),
        other => other.map_or(0.0, |(_, v)| v),
    };
    let damping = |quantity: ParameterQuantity, stiffness: f64, inertia: f64| match of(quantity) {
        Some((name, ratio)) if name.ends_with("_ratio") => damping_from_ratio(ratio, stiffness, inertia),
        other => other.map_or(0.0, |(_, v)| v),
    };
    let (m1, m2) = (plain(ParameterQuantity::NeckMass), plain(ParameterQuantity::LipMass));
    let (l1, l2) = (plain(ParameterQuantity::NeckLength), plain(ParameterQuantity::LipLength));
    let (g1, g2) = (plain(ParameterQuantity::NeckCentre), plain(ParameterQuantity::LipCentre));
    let mass = plain(ParameterQuantity::HeadMass) + m1 + m2;
    let m_theta = plain(ParameterQuantity::NeckInertia) + m1 * g1 * g1 + m2 * l1 * l1;
    let m_phi = plain(ParameterQuantity::LipInertia) + m2 * g2 * g2;
    let m_c = m2 * l1 * g2;
    let spring = |k: ParameterQuantity, c: ParameterQuantity, inertia: f64| {
        let stiffness = stiffness(k, inertia);
        Spring { stiffness, damping: damping(c, stiffness, inertia) }
    };
    let head = spring(ParameterQuantity::HeadStiffness, ParameterQuantity::HeadDamping, mass);
    let neck = spring(ParameterQuantity::NeckStiffness, ParameterQuantity::NeckDamping, m_theta);
    let lip = spring(ParameterQuantity::LipStiffness, ParameterQuantity::LipDamping, m_phi);
    let preload = match of(ParameterQuantity::Preload) {
        Some(("blade.preload_force_n", force)) => force / head.stiffness,
        other => other.map_or(0.0, |(_, v)| v),
    };
    let shoulder = has_shoulder.then(|| {
        let stiffness = match of(ParameterQuantity::ShoulderStiffness) {
            Some(("shoulder.stiffness_ratio", ratio)) => ratio * neck.stiffness,
            other => other.map_or(0.0, |(_, v)| v),
        };
        let damping = damping(ParameterQuantity::ShoulderDamping, stiffness, m_theta);
        Shoulder {
            contact_angle_rad: plain(ParameterQuantity::ShoulderAngle),
            stiffness_n_m_per_rad: stiffness,
            damping_n_m_s_per_rad: damping,
        }
    });
    let friction = FrictionLaw {
        a: plain(ParameterQuantity::FrictionA),
        b_s_per_m: plain(ParameterQuantity::FrictionB),
        c: plain(ParameterQuantity::FrictionC),
    };
    let (m_a, m_b) = (m1 * g1 + m2 * l1, m2 * g2);
    Linkage {
        mass_kg: mass,
        l1_m: l1,
        l2_m: l2,
        m_a,
        m_b,
        m_c,
        m_theta,
        m_phi,
        head,
        neck,
        lip,
        preload_displacement_m: preload,
        friction,
        shoulder,
    }
}
