//! Derivatives of a linkage's constants.

use super::lane_vector::LaneVector;
use crate::model::Linkage;

/// Derivatives of every constant of a [`Linkage`], one a direction: names and units are those of the
/// constants, over the unit of the direction.
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

/// A constant of a linkage; of two the neck's or `theta`'s is the first.
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
    ContactAngle,
    ShoulderStiffness,
    ShoulderDamping,
}

/// All of them, in the order of [`constants_mut`].
const CONSTANTS: [LinkageConstant; 21] = [
    LinkageConstant::Mass,
    LinkageConstant::Length(0),
    LinkageConstant::Length(1),
    LinkageConstant::Moment(0),
    LinkageConstant::Moment(1),
    LinkageConstant::Coupling,
    LinkageConstant::Inertia(0),
    LinkageConstant::Inertia(1),
    LinkageConstant::HeadStiffness,
    LinkageConstant::HeadDamping,
    LinkageConstant::NeckStiffness,
    LinkageConstant::NeckDamping,
    LinkageConstant::LipStiffness,
    LinkageConstant::LipDamping,
    LinkageConstant::Preload,
    LinkageConstant::FrictionA,
    LinkageConstant::FrictionB,
    LinkageConstant::FrictionC,
    LinkageConstant::ContactAngle,
    LinkageConstant::ShoulderStiffness,
    LinkageConstant::ShoulderDamping,
];

impl LinkageTangent {
    /// Sets a direction to `sum weight * linkage` over these linkages: a difference quotient, whose weights
    /// add up to zero.
    pub(crate) fn set_direction(&mut self, lane: usize, terms: &[(f64, Linkage)]) {
        self.rows_mut().into_iter().for_each(|row| row[lane] = 0.0);
        let Some((_, mut first)) = terms.first().copied() else { return };
        for (weight, linkage) in terms {
            let mut linkage = *linkage;
            let pairs = constants_mut(&mut linkage).into_iter().zip(constants_mut(&mut first));
            for (row, pair) in self.rows_mut().into_iter().zip(pairs) {
                // (what is the same in all of them is then exactly without a derivative, and costs nothing)
                if let (Some(constant), Some(first)) = pair {
                    row[lane] += weight * (*constant - *first);
                }
            }
        }
    }

    /// The constants that change in a direction, each with its derivative.
    pub(crate) fn nonzero_changes(&self, lane: usize) -> impl Iterator<Item = (LinkageConstant, f64)> {
        let changes = self.clone().rows_mut().map(|row| row[lane]);
        CONSTANTS.into_iter().zip(changes).filter(|(_, change)| *change != 0.0)
    }

    /// The linkage `step` along a direction.
    pub(crate) fn displace_linkage(&self, linkage: &Linkage, lane: usize, step: f64) -> Linkage {
        let (mut tangent, mut moved) = (self.clone(), *linkage);
        for (row, constant) in tangent.rows_mut().into_iter().zip(constants_mut(&mut moved)) {
            if let Some(constant) = constant {
                *constant += step * row[lane];
            }
        }
        moved
    }

    /// The rows, in the order of [`constants_mut`].
    fn rows_mut(&mut self) -> [&mut LaneVector; CONSTANTS.len()] {
        let [l1, l2] = &mut self.lengths_m;
        let [m_a, m_b] = &mut self.moments;
        let [m_theta, m_phi] = &mut self.inertias;
        [
            &mut self.mass_kg,
            l1,
            l2,
            m_a,
            m_b,
            &mut self.m_c,
            m_theta,
            m_phi,
            &mut self.head.stiffness,
            &mut self.head.damping,
            &mut self.neck.stiffness,
            &mut self.neck.damping,
            &mut self.lip.stiffness,
            &mut self.lip.damping,
            &mut self.preload_displacement_m,
            &mut self.friction_a,
            &mut self.friction_b_s_per_m,
            &mut self.friction_c,
            &mut self.contact_angle_rad,
            &mut self.shoulder.stiffness,
            &mut self.shoulder.damping,
        ]
    }
}

/// The constants of a linkage; those of a shoulder that it does not have are `None`.
fn constants_mut(linkage: &mut Linkage) -> [Option<&mut f64>; CONSTANTS.len()] {
    let Linkage { head, neck, lip, friction, shoulder, .. } = linkage;
    let [angle, stiffness, damping] = match shoulder {
        None => [None, None, None],
        Some(s) => {
            [&mut s.contact_angle_rad, &mut s.stiffness_n_m_per_rad, &mut s.damping_n_m_s_per_rad].map(Some)
        }
    };
    [
        Some(&mut linkage.mass_kg),
        Some(&mut linkage.l1_m),
        Some(&mut linkage.l2_m),
        Some(&mut linkage.m_a),
        Some(&mut linkage.m_b),
        Some(&mut linkage.m_c),
        Some(&mut linkage.m_theta),
        Some(&mut linkage.m_phi),
        Some(&mut head.stiffness),
        Some(&mut head.damping),
        Some(&mut neck.stiffness),
        Some(&mut neck.damping),
        Some(&mut lip.stiffness),
        Some(&mut lip.damping),
        Some(&mut linkage.preload_displacement_m),
        Some(&mut friction.a),
        Some(&mut friction.b_s_per_m),
        Some(&mut friction.c),
        angle,
        stiffness,
        damping,
    ]
}
