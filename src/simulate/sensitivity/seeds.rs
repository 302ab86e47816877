//! What each direction changes directly: constants, the head's motion, the state at the start.

use super::Direction;
use super::difference::{SHARE, SIX_POINTS};
use crate::blade::Linkage;
use crate::blade::parameters::{Parameter, Quantity};
use crate::blade::tangent::{LANES, LinkageTangent, Row, StateTangent};
use crate::simulate::scene::{Scene, SceneError};

/// How the head's motion `x(t)` changes, `dx = scale x + (stretch t - delay) x'`, and its velocity
/// accordingly.
#[derive(Debug, Clone, Default)]
pub(super) struct DriveSeed {
    pub scale: Row,
    pub delay: Row,
    pub stretch: Row,
}

/// A few directions that are carried side by side.
#[derive(Debug, Clone, Default)]
pub(super) struct BlockSeed {
    /// Of the linkage's constants, where any changes.
    pub linkage: Option<Box<LinkageTangent>>,
    /// Of the head's motion, where it changes.
    pub drive: Option<DriveSeed>,
    /// Of the state at the start.
    pub start: StateTangent,
    /// Of the coefficient of restitution.
    pub restitution: Row,
    /// Relative change of what changes, over the unit of the direction: 0 where no constant does.
    pub relative: Row,
}

/// A list of directions, resolved for a scene.
#[derive(Debug, Clone)]
pub struct Seeds {
    pub(super) blocks: Vec<BlockSeed>,
    /// Block and lane of each direction.
    pub(super) places: Vec<(usize, usize)>,
    /// Whether the law of friction changes in any direction.
    pub(super) friction: bool,
}

impl Seeds {
    /// Resolves directions for a scene; any number of them, four cost as much as one.
    ///
    /// # Errors
    /// [`SceneError::Key`] for a parameter that is unknown or that the scene does not have.
    pub fn new(scene: &Scene, directions: &[Direction]) -> Result<Self, SceneError> {
        // directions of the same kind lie side by side: a block in which no constant changes costs less
        let mut order: Vec<usize> = (0..directions.len()).collect();
        order.sort_by_key(|&i| kind(&directions[i]));
        let mut seeds = Self {
            blocks: vec![BlockSeed::default(); directions.len().div_ceil(LANES)],
            places: vec![(0, 0); directions.len()],
            friction: false,
        };
        for (place, i) in order.into_iter().enumerate() {
            seeds.places[i] = (place / LANES, place % LANES);
            seeds.resolve(scene, &directions[i], seeds.places[i])?;
        }
        Ok(seeds)
    }

    /// Number of directions.
    #[must_use]
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// Whether there is no direction.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    fn resolve(
        &mut self,
        scene: &Scene,
        direction: &Direction,
        (block, lane): (usize, usize),
    ) -> Result<(), SceneError> {
        let block = &mut self.blocks[block];
        match direction {
            Direction::NeckAngle => block.start.angle[0][lane] = 1.0,
            Direction::LipAngle => block.start.angle[1][lane] = 1.0,
            Direction::NeckRate => block.start.rate[0][lane] = 1.0,
            Direction::LipRate => block.start.rate[1][lane] = 1.0,
            Direction::DriveScale => block.drive().scale[lane] = 1.0,
            Direction::DriveDelay => block.drive().delay[lane] = 1.0,
            Direction::Parameter(name) => {
                let parameter = scene.parameter(name)?;
                self.friction |= matches!(
                    parameter.quantity,
                    Quantity::FrictionA | Quantity::FrictionB | Quantity::FrictionC
                );
                block.parameter(scene, parameter, lane);
            }
        }
        Ok(())
    }
}

/// What stands side by side: parameters of the blade, those of the drive, states.
fn kind(direction: &Direction) -> u8 {
    match direction {
        Direction::Parameter(name) if !name.starts_with("drive.") => 0,
        Direction::Parameter(_) | Direction::DriveScale | Direction::DriveDelay => 1,
        _ => 2,
    }
}

impl BlockSeed {
    fn drive(&mut self) -> &mut DriveSeed {
        self.drive.get_or_insert_default()
    }

    fn parameter(&mut self, scene: &Scene, parameter: &Parameter, lane: usize) {
        let value = scene.value(parameter.name).or(parameter.default).unwrap_or(0.0);
        match parameter.quantity {
            Quantity::DriveAmplitude => self.drive().scale[lane] = 1.0 / value,
            Quantity::DriveFrequency => self.drive().stretch[lane] = 1.0 / value,
            Quantity::Restitution => self.restitution[lane] = 1.0,
            _ => {
                let scale = if value == 0.0 { scale(parameter, &scene.linkage) } else { value.abs() };
                let step = SHARE * scale;
                self.relative[lane] = 1.0 / scale;
                let terms = SIX_POINTS.map(|(point, weight)| {
                    (weight / step, scene.linkage_with(parameter, value + point * step))
                });
                self.linkage.get_or_insert_default().set(lane, &terms);
            }
        }
    }
}

/// The scale of a parameter that is zero: what others of its kind are.
fn scale(parameter: &Parameter, linkage: &Linkage) -> f64 {
    match parameter.unit {
        "m" => linkage.l1_m.min(linkage.l2_m),
        "kg" => linkage.m_phi / (linkage.l2_m * linkage.l2_m),
        "kg m2" => linkage.m_phi.min(linkage.m_theta),
        _ => 1.0, // the others enter linearly
    }
}
