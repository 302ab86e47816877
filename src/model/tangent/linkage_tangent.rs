//! Derivatives of a linkage's constants.

use super::lane_vector::LaneVector;
use crate::model::Linkage;
use crate::model::friction::FrictionLaw;

/// Derivatives of every constant of a [`Linkage`], one lane per direction, in the unit of the constant per
/// unit of the direction.
#[derive(Debug, Clone, Default)]
#[allow(missing_docs)] // the fields are those of the linkage
pub struct LinkageTangent {
    pub mass_kg: LaneVector,
    pub lengths_m: [LaneVector; 2],
    pub moments: [LaneVector; 2],
    pub m_c: LaneVector,
    pub inertias: [LaneVector; 2],
    pub head: SpringTangent,
    pub neck: SpringTangent,
    pub lip: SpringTangent,
    pub preload_displacement_m: LaneVector,
    pub friction_a: LaneVector,
    pub friction_b_s_per_m: LaneVector,
    pub friction_c: LaneVector,
    pub friction_exponent: LaneVector,
    pub viscous_s_per_m: LaneVector,
    pub static_ratio: LaneVector,
    pub backward_ratio: LaneVector,
    pub shoulder: SpringTangent,
    pub contact_angle_rad: LaneVector,
}

/// Derivatives of a spring's constants.
#[derive(Debug, Clone, Copy, Default)]
#[allow(missing_docs)] // the fields are those of the spring
pub struct SpringTangent {
    pub stiffness: LaneVector,
    pub damping: LaneVector,
}

/// A constant of a linkage; the index is 0 for the neck and 1 for the lip.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)] // the names are those of the linkage's fields
pub enum LinkageConstant {
    Mass,
    Length(usize),
    Moment(usize),
    Coupling,
    Inertia(usize),
    HeadStiffness,
    HeadDamping,
    NeckStiffness,
    NeckDamping,
    LipStiffness,
    LipDamping,
    Preload,
    FrictionA,
    FrictionB,
    FrictionC,
    FrictionExponent,
    ViscousFriction,
    StaticRatio,
    BackwardRatio,
    ContactAngle,
    ShoulderStiffness,
    ShoulderDamping,
}

/// A constant with two functions: one selects its row in a [`LinkageTangent`], the other its value in a
/// [`Linkage`], which is `None` for a constant of a missing shoulder.
type ConstantRow =
    (LinkageConstant, fn(&mut LinkageTangent) -> &mut LaneVector, fn(&mut Linkage) -> Option<&mut f64>);

macro_rules! constants {
    ($(
        $constant:ident $(($index:literal))? $($row:ident).+ $([$at:literal])?,
        $($field:ident).+ $(?$of:ident)?;
    )*) => {
        &[$((
            LinkageConstant::$constant $(($index))?,
            |tangent| &mut tangent.$($row).+ $([$at])?,
            |linkage| constants!(@field linkage, $($field).+ $(?$of)?),
        )),*]
    };
    (@field $linkage:ident, $($field:ident).+) => { Some(&mut $linkage.$($field).+) };
    (@field $linkage:ident, $part:ident?$field:ident) => { $linkage.$part.as_mut().map(|s| &mut s.$field) };
}

const CONSTANTS: &[ConstantRow] = constants! {
    Mass mass_kg, mass_kg;
    Length(0) lengths_m[0], l1_m;
    Length(1) lengths_m[1], l2_m;
    Moment(0) moments[0], m_a;
    Moment(1) moments[1], m_b;
    Coupling m_c, m_c;
    Inertia(0) inertias[0], m_theta;
    Inertia(1) inertias[1], m_phi;
    HeadStiffness head.stiffness, head.stiffness;
    HeadDamping head.damping, head.damping;
    NeckStiffness neck.stiffness, neck.stiffness;
    NeckDamping neck.damping, neck.damping;
    LipStiffness lip.stiffness, lip.stiffness;
    LipDamping lip.damping, lip.damping;
    Preload preload_displacement_m, preload_displacement_m;
    FrictionA friction_a, friction.a;
    FrictionB friction_b_s_per_m, friction.b_s_per_m;
    FrictionC friction_c, friction.c;
    FrictionExponent friction_exponent, friction.exponent;
    ViscousFriction viscous_s_per_m, friction.viscous_s_per_m;
    StaticRatio static_ratio, friction.static_ratio;
    BackwardRatio backward_ratio, friction.backward_ratio;
    ContactAngle contact_angle_rad, shoulder?contact_angle_rad;
    ShoulderStiffness shoulder.stiffness, shoulder?stiffness_n_m_per_rad;
    ShoulderDamping shoulder.damping, shoulder?damping_n_m_s_per_rad;
};

impl LinkageTangent {
    /// Derivatives of the largest friction coefficient at rest before the tip slips in a direction.
    pub(crate) fn static_coefficient_change(&self, law: &FrictionLaw, direction: f64) -> LaneVector {
        let factor = law.direction_factor(direction);
        let own = law.varying_part_at_zero() * self.friction_a + self.friction_c;
        let mut change = (law.static_ratio * factor) * own + law.limit_at_zero(direction) * self.static_ratio;
        if direction < 0.0 {
            change.add_scaled(law.static_coefficient(direction) / factor, &self.backward_ratio);
        }
        change
    }

    /// Sets the derivatives in the direction `lane` to a finite difference: the sum of weight times constant
    /// over the linkages in `terms`. The weights add up to zero.
    pub(crate) fn set_direction(&mut self, lane: usize, terms: &[(f64, Linkage)]) {
        let mut first = terms.first().map(|(_, linkage)| *linkage);
        for (_, row, place) in CONSTANTS {
            let (row, mut sum) = (row(self), 0.0);
            for (weight, mut linkage) in terms.iter().copied() {
                // (a constant that is the same in all linkages has a derivative of exactly zero and costs
                // nothing)
                if let (Some(constant), Some(first)) = (place(&mut linkage), first.as_mut().and_then(place)) {
                    sum += weight * (*constant - *first);
                }
            }
            row[lane] = sum;
        }
    }

    /// The constants that change in the direction `lane`, each with its derivative.
    pub(crate) fn nonzero_changes(&self, lane: usize) -> impl Iterator<Item = (LinkageConstant, f64)> {
        let mut tangent = self.clone();
        let changes = CONSTANTS.iter().map(move |(constant, row, _)| (*constant, row(&mut tangent)[lane]));
        changes.filter(|(_, change)| *change != 0.0)
    }

    /// The linkage displaced by `step` in the direction `lane`.
    pub(crate) fn displace_linkage(&self, linkage: &Linkage, lane: usize, step: f64) -> Linkage {
        let (mut tangent, mut moved) = (self.clone(), *linkage);
        for (_, row, place) in CONSTANTS {
            if let Some(constant) = place(&mut moved) {
                *constant += step * row(&mut tangent)[lane];
            }
        }
        moved
    }
}
