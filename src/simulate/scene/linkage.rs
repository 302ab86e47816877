//! Constants of the linkage from the numbers of a scene.

use super::error::{SceneError, key_error};
use crate::model::friction::{FrictionLaw, FrictionShape};
use crate::model::parameters::{
    PARAMETERS, ParameterQuantity as Quantity, damping_from_ratio, stiffness_from_frequency,
};
use crate::model::shoulder::Shoulder;
use crate::model::{Linkage, Slider, Spring};
use std::collections::BTreeMap;

type SceneValues = BTreeMap<&'static str, f64>;

/// Builds the linkage from the numbers of a complete scene.
pub(super) fn build_linkage(
    file: &str,
    values: &SceneValues,
    shoulder: bool,
    law: FrictionShape,
) -> Result<Linkage, SceneError> {
    let number = |name: &str| values.get(name).copied().unwrap_or(0.0); // completeness was checked
    for (centre, length) in
        [("blade.neck_centre_m", "blade.neck_length_m"), ("blade.lip_centre_m", "blade.lip_length_m")]
    {
        if number(centre) > number(length) {
            let expected = format!("at most the link's length {} m", number(length));
            let advice = "check the units: lengths are in m";
            return Err(key_error(file, centre, number(centre), &expected, advice));
        }
    }
    let linkage = linkage_constants(values, shoulder, law);
    let Linkage { m_theta, m_phi, m_c, .. } = linkage;
    if !(m_theta * m_phi - m_c * m_c > 0.0 && (m_theta * m_phi).is_finite()) {
        let found = "links whose inertia matrix is singular";
        let advice = "give the lip and the neck mass and inertia";
        return Err(key_error(file, "blade.lip_inertia_kg_m2", found, "a link with inertia", advice));
    }
    Ok(linkage)
}

/// Constants of the linkage, in the notation of [`crate::model`].
pub(super) fn linkage_constants(values: &SceneValues, has_shoulder: bool, law: FrictionShape) -> Linkage {
    let of = |quantity: Quantity| {
        let mut ways = PARAMETERS.iter().filter(|p| p.quantity == quantity);
        ways.find_map(|p| values.get(p.name).map(|&v| (p.name, v)))
    };
    let plain = |quantity: Quantity| of(quantity).map_or(0.0, |(_, v)| v);
    let ratio = |quantity: Quantity| of(quantity).map_or(1.0, |(_, v)| v);
    // a value whose key has this ending is converted with `convert`
    let converted = |quantity: Quantity, ending: &str, convert: &dyn Fn(f64) -> f64| match of(quantity) {
        Some((name, value)) if name.ends_with(ending) => convert(value),
        other => other.map_or(0.0, |(_, v)| v),
    };
    let damping = |quantity: Quantity, stiffness: f64, inertia: f64| {
        converted(quantity, "_ratio", &|ratio| damping_from_ratio(ratio, stiffness, inertia))
    };
    let friction = friction_law(&plain, &ratio, law);
    if values.contains_key("slider.mass_kg") {
        let spring =
            Spring { stiffness: plain(Quantity::SliderStiffness), damping: plain(Quantity::SliderDamping) };
        let (mass_kg, normal_force_n) = (plain(Quantity::SliderMass), plain(Quantity::NormalForce));
        return Linkage::from_slider(Slider { mass_kg, spring, normal_force_n }, friction);
    }
    let (m1, m2) = (plain(Quantity::NeckMass), plain(Quantity::LipMass));
    let (l1, l2) = (plain(Quantity::NeckLength), plain(Quantity::LipLength));
    let (g1, g2) = (plain(Quantity::NeckCentre), plain(Quantity::LipCentre));
    let mass = plain(Quantity::HeadMass) + m1 + m2;
    let m_theta = plain(Quantity::NeckInertia) + m1 * g1 * g1 + m2 * l1 * l1;
    let m_phi = plain(Quantity::LipInertia) + m2 * g2 * g2;
    let m_c = m2 * l1 * g2;
    let spring = |k: Quantity, c: Quantity, inertia: f64| {
        let stiffness = converted(k, "_hz", &|frequency| stiffness_from_frequency(frequency, inertia));
        Spring { stiffness, damping: damping(c, stiffness, inertia) }
    };
    let head = spring(Quantity::HeadStiffness, Quantity::HeadDamping, mass);
    let neck = spring(Quantity::NeckStiffness, Quantity::NeckDamping, m_theta);
    let lip = spring(Quantity::LipStiffness, Quantity::LipDamping, m_phi);
    let preload = converted(Quantity::Preload, "_force_n", &|force| force / head.stiffness);
    let shoulder = has_shoulder.then(|| {
        let stiffness = converted(Quantity::ShoulderStiffness, "_ratio", &|ratio| ratio * neck.stiffness);
        Shoulder {
            contact_angle_rad: plain(Quantity::ShoulderAngle),
            stiffness_n_m_per_rad: stiffness,
            damping_n_m_s_per_rad: damping(Quantity::ShoulderDamping, stiffness, m_theta),
        }
    });
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

/// The friction law; `plain` and `ratio` give the value of a quantity, 0 or 1 if it is absent.
fn friction_law(
    plain: &dyn Fn(Quantity) -> f64,
    ratio: &dyn Fn(Quantity) -> f64,
    law: FrictionShape,
) -> FrictionLaw {
    let [limit, level] = [Quantity::FrictionLimit, Quantity::CoulombLevel].map(plain);
    let (a, b_s_per_m, c) = match law {
        FrictionShape::Exponential => {
            (plain(Quantity::FrictionA), plain(Quantity::FrictionB), plain(Quantity::FrictionC))
        }
        FrictionShape::Stribeck => (limit - level, 1.0 / plain(Quantity::StribeckSpeed), level),
        FrictionShape::Rational => (limit, plain(Quantity::RationalDecay), 0.0),
        FrictionShape::Table(_) => (1.0, 1.0, 0.0),
    };
    FrictionLaw {
        a,
        b_s_per_m,
        c,
        shape: law,
        exponent: ratio(Quantity::StribeckExponent),
        viscous_s_per_m: plain(Quantity::ViscousFriction),
        static_ratio: ratio(Quantity::StaticRatio),
        backward_ratio: ratio(Quantity::BackwardRatio),
    }
}
