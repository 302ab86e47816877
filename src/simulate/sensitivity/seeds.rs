//! What each direction changes directly: constants, the head's motion, the state at the start.

use super::source::TangentSource;
use super::{DIFFERENCE_STEP, SIX_POINTS, central_difference};
use crate::model::parameters::{ModelParameter, ParameterQuantity};
use crate::model::shoulder::ShoulderContact;
use crate::model::tangent::{LANES, LaneVector, LinkageTangent, StateTangent};
use crate::model::{Linkage, Pose};
use crate::simulate::equilibrium::residual_moments;
use crate::simulate::phases::DrivenBlade;
use crate::simulate::scene::{Scene, SceneError};
use nalgebra::{Matrix2, Vector2};

/// How the head's motion `x(t)` changes, `dx = scale x + (stretch t - delay) x'`, and its velocity
/// accordingly.
#[derive(Debug, Clone, Default)]
pub(super) struct DriveTangent {
    pub scale: LaneVector,
    pub delay: LaneVector,
    pub stretch: LaneVector,
}

/// A few directions that are carried side by side.
#[derive(Debug, Clone, Default)]
pub(super) struct BlockSeed {
    /// What the directions change, one by one.
    pub changes: Vec<SourceFactor>,
    /// Of the linkage's constants, where any changes.
    pub linkage: Option<Box<LinkageTangent>>,
    /// Of the head's motion, where it changes.
    pub drive: Option<DriveTangent>,
    /// Of the state at the start.
    pub start: StateTangent,
    /// Of the coefficient of restitution.
    pub restitution: LaneVector,
    /// Relative change of what changes, over the unit of the direction: 0 where no constant does.
    pub relative: LaneVector,
}

/// How much of a source a direction is made of.
#[derive(Debug, Clone, Copy)]
pub(super) struct SourceFactor {
    /// Place in the list of the seeds' sources.
    pub source: usize,
    pub lane: usize,
    pub factor: f64,
}

/// A list of directions, resolved for a scene.
#[derive(Debug, Clone)]
pub struct TangentSeeds {
    pub(super) blocks: Vec<BlockSeed>,
    /// Block and lane of each direction.
    pub(super) places: Vec<(usize, usize)>,
    /// All that any direction changes.
    pub(super) sources: Vec<TangentSource>,
}

impl TangentSeeds {
    /// Resolves directions for a scene; any number of them, four cost as much as one.
    ///
    /// # Errors
    /// [`SceneError::Key`] for a parameter that is unknown or that the scene does not have.
    pub fn new(scene: &Scene, directions: &[TangentDirection]) -> Result<Self, SceneError> {
        // directions of the same kind lie side by side: a block in which no constant changes costs less
        let mut order: Vec<usize> = (0..directions.len()).collect();
        order.sort_by_key(|&i| direction_group(&directions[i]));
        let mut seeds = Self {
            blocks: vec![BlockSeed::default(); directions.len().div_ceil(LANES)],
            places: vec![(0, 0); directions.len()],
            sources: Vec::new(),
        };
        for (place, i) in order.into_iter().enumerate() {
            seeds.places[i] = (place / LANES, place % LANES);
            seeds.set_direction(scene, &directions[i], seeds.places[i])?;
        }
        let Self { blocks, sources, .. } = &mut seeds;
        blocks.iter_mut().for_each(|block| block.list_changes(sources));
        Ok(seeds)
    }

    pub(crate) fn len(&self) -> usize {
        self.places.len()
    }

    /// Whether there is no direction.
    pub(crate) fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    fn set_direction(
        &mut self,
        scene: &Scene,
        direction: &TangentDirection,
        (block, lane): (usize, usize),
    ) -> Result<(), SceneError> {
        let block = &mut self.blocks[block];
        match direction {
            TangentDirection::NeckAngle => block.start.angle[0][lane] = 1.0,
            TangentDirection::LipAngle => block.start.angle[1][lane] = 1.0,
            TangentDirection::NeckRate => block.start.rate[0][lane] = 1.0,
            TangentDirection::LipRate => block.start.rate[1][lane] = 1.0,
            TangentDirection::DriveScale => block.drive_mut().scale[lane] = 1.0,
            TangentDirection::DriveDelay => block.drive_mut().delay[lane] = 1.0,
            TangentDirection::Parameter(name) => {
                let parameter = scene.find_own_parameter(name)?;
                block.set_parameter(scene, parameter, lane);
            }
        }
        Ok(())
    }
}

/// What stands side by side: parameters of the blade, those of the drive, states.
fn direction_group(direction: &TangentDirection) -> u8 {
    match direction {
        TangentDirection::Parameter(name) if !name.starts_with("drive.") => 0,
        TangentDirection::Parameter(_) | TangentDirection::DriveScale | TangentDirection::DriveDelay => 1,
        _ => 2,
    }
}

impl DriveTangent {
    fn list_changes(&self, lane: usize) -> impl Iterator<Item = (TangentSource, f64)> {
        let changes = [
            (TangentSource::HeadScale, self.scale[lane]),
            (TangentSource::HeadDelay, self.delay[lane]),
            (TangentSource::HeadStretch, self.stretch[lane]),
        ];
        changes.into_iter().filter(|(_, factor)| *factor != 0.0)
    }
}

impl BlockSeed {
    fn drive_mut(&mut self) -> &mut DriveTangent {
        self.drive.get_or_insert_default()
    }

    /// Lists what the directions are made of; `sources` are those known so far.
    fn list_changes(&mut self, sources: &mut Vec<TangentSource>) {
        let Self { changes, linkage, drive, .. } = self;
        for lane in 0..LANES {
            let constants = linkage.iter().flat_map(|linkage| linkage.nonzero_changes(lane));
            let head = drive.iter().flat_map(|drive| drive.list_changes(lane));
            let all =
                constants.map(|(constant, factor)| (TangentSource::Constant(constant), factor)).chain(head);
            for (source, factor) in all {
                let place = sources.iter().position(|known| *known == source).unwrap_or_else(|| {
                    sources.push(source);
                    sources.len() - 1
                });
                changes.push(SourceFactor { source: place, lane, factor });
            }
        }
    }

    fn set_parameter(&mut self, scene: &Scene, parameter: &ModelParameter, lane: usize) {
        let value = scene.value(parameter.name).or(parameter.default).unwrap_or(0.0);
        match parameter.quantity {
            ParameterQuantity::DriveAmplitude => self.drive_mut().scale[lane] = 1.0 / value,
            ParameterQuantity::DriveFrequency => {
                // (the cosine is stretched about its own start)
                self.drive_mut().stretch[lane] = 1.0 / value;
                self.drive_mut().delay[lane] = scene.drive.delay_s() / value;
            }
            ParameterQuantity::Restitution => self.restitution[lane] = 1.0,
            _ => {
                let scale = if value == 0.0 { scale_at_zero(parameter, &scene.linkage) } else { value.abs() };
                let step = DIFFERENCE_STEP * scale;
                self.relative[lane] = 1.0 / scale;
                let terms = SIX_POINTS.map(|(point, weight)| {
                    (weight / step, scene.linkage_with(parameter, value + point * step))
                });
                self.linkage.get_or_insert_default().set_direction(lane, &terms);
            }
        }
    }
}

/// The scale of a parameter that is zero: what others of its kind are.
fn scale_at_zero(parameter: &ModelParameter, linkage: &Linkage) -> f64 {
    match parameter.unit {
        "m" => linkage.l1_m.min(linkage.l2_m),
        "kg" => linkage.m_phi / (linkage.l2_m * linkage.l2_m),
        "kg m2" => linkage.m_phi.min(linkage.m_theta),
        _ => 1.0, // the others enter linearly
    }
}

// What a derivative is taken by.

/// What a derivative is taken by.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum TangentDirection {
    /// A parameter of the scene by its name; quantities that the scene writes by others (a stiffness by a
    /// natural frequency) follow them.
    Parameter(String),
    /// Angle of the neck at the start, rad.
    NeckAngle,
    /// Angle of the lip at the start, rad.
    LipAngle,
    /// Angular rate of the neck at the start, rad/s.
    NeckRate,
    /// Angular rate of the lip at the start, rad/s.
    LipRate,
    /// A factor on the head's motion, 1 at the scene's own.
    DriveScale,
    /// A delay of the head's motion, s, 0 at the scene's own.
    DriveDelay,
}

/// Names of the directions that are no parameters, with their units.
const NAMED_DIRECTIONS: [(TangentDirection, &str, &str); 6] = [
    (TangentDirection::NeckAngle, "start.neck_angle_rad", "rad"),
    (TangentDirection::LipAngle, "start.lip_angle_rad", "rad"),
    (TangentDirection::NeckRate, "start.neck_rate_rad_per_s", "rad/s"),
    (TangentDirection::LipRate, "start.lip_rate_rad_per_s", "rad/s"),
    (TangentDirection::DriveScale, "drive.scale", "1"),
    (TangentDirection::DriveDelay, "drive.delay_s", "s"),
];

impl TangentDirection {
    /// The direction of a name: one of [`Self::other_names`], otherwise a parameter.
    pub(crate) fn from_name(name: &str) -> Self {
        let other = NAMED_DIRECTIONS.iter().find(|(_, other, _)| *other == name);
        other.map_or_else(|| Self::Parameter(name.to_owned()), |(direction, ..)| direction.clone())
    }

    /// Names of the directions that are no parameters.
    pub(crate) fn other_names() -> impl Iterator<Item = &'static str> {
        NAMED_DIRECTIONS.iter().map(|(_, name, _)| *name)
    }
}

// How the equilibrium of steady slip moves with the parameters.

/// Derivatives of both angles of steady slip: `J d q + dR = 0` for the moments `R(q, p)`; `None` where the
/// equilibrium turns back.
///
/// `d_speed` are the derivatives of the head's velocity, m/s.
pub(super) fn steady_slip_tangent(
    system: &DrivenBlade,
    seed: &BlockSeed,
    lean: ShoulderContact,
    pose: &Pose,
    speed: f64,
    d_speed: LaneVector,
) -> Option<[LaneVector; 2]> {
    let linkage = &system.linkage;
    let angles = Vector2::new(pose.theta, pose.phi);
    let mu =
        |linkage: &Linkage, speed: f64| speed.signum() * linkage.friction.dynamic_coefficient(speed.abs());
    let column = |direction: Vector2<f64>| {
        let at = |x: f64| {
            Some(residual_moments(linkage, mu(linkage, speed), &(angles + x * direction), lean).into())
        };
        central_difference(DIFFERENCE_STEP, at).map(|column: [f64; 2]| Vector2::from(column))
    };
    let jacobian = Matrix2::from_columns(&[column(Vector2::x())?, column(Vector2::y())?]).lu();
    let mut moved = [LaneVector::ZERO; 2];
    for lane in 0..LANES {
        let at = |x: f64| {
            let linkage =
                seed.linkage.as_ref().map_or(*linkage, |own| own.displace_linkage(linkage, lane, x));
            Some(residual_moments(&linkage, mu(&linkage, speed + x * d_speed[lane]), &angles, lean).into())
        };
        let step = DIFFERENCE_STEP / seed.relative[lane].max((d_speed[lane] / speed).abs());
        if step.is_finite() {
            let by_direction: [f64; 2] = central_difference(step, at)?;
            let solution = jacobian.solve(&-Vector2::from(by_direction))?;
            (moved[0][lane], moved[1][lane]) = (solution[0], solution[1]);
        }
    }
    Some(moved)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::tangent::LinkageConstant;

    /// A difference quotient leaves rounding in constants that stay, and each would cost as much as one that
    /// moves.
    #[test]
    fn a_parameter_changes_only_the_constants_that_it_enters() {
        let text = include_str!("../../../data/scenes/actual-blade.toml");
        let scene = Scene::parse("actual-blade.toml", text).unwrap();
        let sources = |name: &str| {
            let seeds = TangentSeeds::new(&scene, &[TangentDirection::Parameter(name.to_owned())]).unwrap();
            seeds.sources.clone()
        };
        let constants =
            |constants: &[LinkageConstant]| constants.iter().copied().map(TangentSource::Constant).collect();
        let expected: Vec<TangentSource> = constants(&[LinkageConstant::FrictionA]);
        assert_eq!(sources("friction.a"), expected);
        let expected: Vec<TangentSource> = constants(&[LinkageConstant::ShoulderStiffness]);
        assert_eq!(sources("shoulder.stiffness_ratio"), expected);
        let expected: Vec<TangentSource> = constants(&[
            LinkageConstant::NeckStiffness,
            LinkageConstant::NeckDamping,
            LinkageConstant::ShoulderStiffness,
        ]);
        assert_eq!(sources("blade.neck_natural_frequency_hz"), expected);
    }
}
