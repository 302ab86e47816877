//! Direct effects of each direction (a quantity with respect to which a run is differentiated) on the
//! constants of the linkage, the motion of the head and the initial state.

use super::source::TangentSource;
use crate::model::parameters::{ModelParameter, ParameterQuantity};
use crate::model::shoulder::ShoulderContact;
use crate::model::tangent::{LANES, LaneVector, LinkageTangent, StateTangent};
use crate::model::{Linkage, Pose};
use crate::simulate::equilibrium::{residual_moments, solve_for_load};
use crate::simulate::phases::DrivenBlade;
use crate::simulate::scene::Scene;
use crate::simulate::scene::error::SceneError;
use nalgebra::{Matrix2, Vector2};

/// Change of the head's motion `x(t)` per unit of the direction:
/// `dx = scale * x + (stretch * t - delay) * x'`.
#[derive(Debug, Clone, Default)]
pub(super) struct DriveTangent {
    pub scale: LaneVector,
    pub delay: LaneVector,
    pub stretch: LaneVector,
}

/// Up to four directions, one per lane of a block.
#[derive(Debug, Clone, Default)]
pub(super) struct BlockSeed {
    /// Sources (elementary changes) of the directions of the block, each with its factor.
    pub changes: Vec<SourceFactor>,
    /// Derivatives of the linkage's constants, if any constant changes.
    pub linkage: Option<Box<LinkageTangent>>,
    /// Derivatives of the head's motion, if the motion changes.
    pub drive: Option<DriveTangent>,
    /// Derivatives of the initial state.
    pub start: StateTangent,
    /// Derivatives of the coefficient of restitution.
    pub restitution: LaneVector,
    /// Relative change of the parameter per unit of the direction; 0 if the direction changes no constant of
    /// the linkage.
    pub relative: LaneVector,
}

/// Factor of a source in a direction.
#[derive(Debug, Clone, Copy)]
pub(super) struct SourceFactor {
    /// Index of the source in [`TangentSeeds::sources`].
    pub source: usize,
    pub lane: usize,
    pub factor: f64,
}

/// Directions of derivatives (the quantities with respect to which a run is differentiated), prepared for a
/// scene.
#[derive(Debug, Clone)]
pub struct TangentSeeds {
    pub(super) blocks: Vec<BlockSeed>,
    /// Block and lane of each direction.
    pub(super) places: Vec<(usize, usize)>,
    /// Sources of all directions.
    pub(super) sources: Vec<TangentSource>,
    /// Whether the directions are the errors of the steps instead of parameters.
    pub(super) are_step_errors: bool,
}

/// Lane of the error by truncation in [`TangentSeeds::of_step_errors`].
pub(super) const TRUNCATION_LANE: usize = 0;
/// Lane of the error by rounding in [`TangentSeeds::of_step_errors`].
pub(super) const ROUNDING_LANE: usize = 1;

impl TangentSeeds {
    /// Prepares directions for a scene. Up to four directions cost as much as one.
    ///
    /// # Errors
    /// [`SceneError::Key`] for an unknown parameter, or for a parameter of an absent part.
    pub fn new(scene: &Scene, directions: &[TangentDirection]) -> Result<Self, SceneError> {
        // a block in which no constant changes costs less, so directions are sorted by kind
        let mut order: Vec<usize> = (0..directions.len()).collect();
        order.sort_by_key(|&i| direction_group(&directions[i]));
        let mut seeds = Self {
            blocks: vec![BlockSeed::default(); directions.len().div_ceil(LANES)],
            places: vec![(0, 0); directions.len()],
            sources: Vec::new(),
            are_step_errors: false,
        };
        for (place, i) in order.into_iter().enumerate() {
            let (block, lane) = (place / LANES, place % LANES);
            seeds.places[i] = (block, lane);
            seeds.blocks[block].set_direction(scene, &directions[i], lane)?;
        }
        let Self { blocks, sources, .. } = &mut seeds;
        blocks.iter_mut().for_each(|block| block.list_changes(sources));
        Ok(seeds)
    }

    /// Two directions that carry the errors of the steps, computed minus exact: by truncation and by
    /// rounding.
    pub(super) fn of_step_errors() -> Self {
        Self {
            blocks: vec![BlockSeed::default()],
            places: vec![(0, TRUNCATION_LANE), (0, ROUNDING_LANE)],
            sources: Vec::new(),
            are_step_errors: true,
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.places.len()
    }

    /// Whether there is no direction.
    pub(crate) fn is_empty(&self) -> bool {
        self.places.is_empty()
    }
}

/// Group of a direction: parameters of the blade, parameters of the drive, or initial state.
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

    fn set_direction(&mut self, scene: &Scene, by: &TangentDirection, lane: usize) -> Result<(), SceneError> {
        let per_length = 1.0 / scene.linkage.l2_m;
        match by {
            TangentDirection::Deflection | TangentDirection::TipVelocity if !scene.linkage.is_slider() => {
                return Err(scene.foreign_key(by.name()));
            }
            TangentDirection::Deflection => self.start.angle[1][lane] = per_length,
            TangentDirection::TipVelocity => self.start.rate[1][lane] = per_length,
            TangentDirection::NeckAngle => self.start.angle[0][lane] = 1.0,
            TangentDirection::LipAngle => self.start.angle[1][lane] = 1.0,
            TangentDirection::NeckRate => self.start.rate[0][lane] = 1.0,
            TangentDirection::LipRate => self.start.rate[1][lane] = 1.0,
            TangentDirection::DriveScale => self.drive_mut().scale[lane] = 1.0,
            TangentDirection::DriveDelay => self.drive_mut().delay[lane] = 1.0,
            TangentDirection::Parameter(name) => {
                self.set_parameter(scene, scene.find_own_parameter(name)?, lane);
            }
        }
        Ok(())
    }

    /// Lists the sources of the directions, and adds new sources to `sources`.
    fn list_changes(&mut self, sources: &mut Vec<TangentSource>) {
        let Self { changes, linkage, drive, .. } = self;
        for lane in 0..LANES {
            let constants = linkage.iter().flat_map(|linkage| linkage.nonzero_changes(lane));
            let head = drive.iter().flat_map(|drive| drive.list_changes(lane));
            let constants = constants.map(|(constant, factor)| (TangentSource::Constant(constant), factor));
            for (source, factor) in constants.chain(head) {
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
            ParameterQuantity::DriveAmplitude | ParameterQuantity::DriveSpeed => {
                self.drive_mut().scale[lane] = 1.0 / value
            }
            ParameterQuantity::DriveFrequency => {
                // a change of frequency stretches the time axis of the cosine about the time at which the
                // cosine starts
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

/// Scale of a parameter whose value is zero, from other constants with the same unit.
fn scale_at_zero(parameter: &ModelParameter, linkage: &Linkage) -> f64 {
    match parameter.unit {
        "m" => linkage.l1_m.min(linkage.l2_m),
        "kg" => linkage.m_phi / (linkage.l2_m * linkage.l2_m),
        "kg m2" => linkage.m_phi.min(linkage.m_theta),
        _ => 1.0, // the equations are linear in the others
    }
}

/// Direction of a derivative, the quantity with respect to which it is taken.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum TangentDirection {
    /// A parameter of the scene, by name. Quantities that the scene derives from this parameter (a stiffness
    /// from a natural frequency) change with it.
    Parameter(String),
    /// Angle of the neck at the start, rad.
    NeckAngle,
    /// Angle of the lip at the start, rad.
    LipAngle,
    /// Angular rate of the neck at the start, rad/s.
    NeckRate,
    /// Angular rate of the lip at the start, rad/s.
    LipRate,
    /// Position of a slider minus that of its head at the start, m.
    Deflection,
    /// Velocity of a slider at the start, m/s.
    TipVelocity,
    /// Factor on the head's motion; 1 in the scene itself.
    DriveScale,
    /// Delay of the head's motion, s; 0 in the scene itself.
    DriveDelay,
}

/// Names and units of the directions other than parameters.
const NAMED_DIRECTIONS: [(TangentDirection, &str, &str); 8] = [
    (TangentDirection::NeckAngle, "start.neck_angle_rad", "rad"),
    (TangentDirection::LipAngle, "start.lip_angle_rad", "rad"),
    (TangentDirection::NeckRate, "start.neck_rate_rad_per_s", "rad/s"),
    (TangentDirection::LipRate, "start.lip_rate_rad_per_s", "rad/s"),
    (TangentDirection::Deflection, "start.deflection_m", "m"),
    (TangentDirection::TipVelocity, "start.tip_velocity_m_per_s", "m/s"),
    (TangentDirection::DriveScale, "drive.scale", "1"),
    (TangentDirection::DriveDelay, "drive.delay_s", "s"),
];

impl TangentDirection {
    /// Direction with this name among [`Self::other_names`], otherwise the parameter with this name.
    pub(crate) fn from_name(name: &str) -> Self {
        let other = NAMED_DIRECTIONS.iter().find(|(_, other, _)| *other == name);
        other.map_or_else(|| Self::Parameter(name.to_owned()), |(direction, ..)| direction.clone())
    }

    /// Name of the direction.
    fn name(&self) -> &str {
        match self {
            Self::Parameter(name) => name,
            _ => NAMED_DIRECTIONS.iter().find(|(other, ..)| other == self).map_or("", |(_, name, _)| name),
        }
    }

    /// Names of the directions other than parameters.
    pub(crate) fn other_names() -> impl Iterator<Item = &'static str> {
        NAMED_DIRECTIONS.iter().map(|(_, name, _)| *name)
    }
}

// Derivatives of steady slip.

/// Derivatives of both angles in steady slip, from `J dq + dR = 0` with the moments `R(q, p)`; `None` at a
/// fold of the equilibrium.
///
/// `d_speed` contains the derivatives of the head's velocity, m/s.
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
        |linkage: &Linkage, v: f64| v.signum() * linkage.friction.dynamic_coefficient(v.abs(), v.signum());
    let column = |direction: Vector2<f64>| {
        let at = |x: f64| {
            Some(residual_moments(linkage, mu(linkage, speed), &(angles + x * direction), lean).into())
        };
        central_difference(DIFFERENCE_STEP, at).map(|column: [f64; 2]| Vector2::from(column))
    };
    // (the equilibrium of a slider is an explicit function of the parameters)
    let jacobian = if linkage.is_slider() {
        -Matrix2::identity()
    } else {
        Matrix2::from_columns(&[column(Vector2::x())?, column(Vector2::y())?])
    };
    let jacobian = jacobian.lu();
    let mut moved = [LaneVector::ZERO; 2];
    for lane in 0..LANES {
        let at = |x: f64| {
            let own = seed.linkage.as_ref();
            let linkage = own.map_or(*linkage, |own| own.displace_linkage(linkage, lane, x));
            let mu = mu(&linkage, speed + x * d_speed[lane]);
            if linkage.is_slider() {
                return solve_for_load(&linkage, mu, angles).map(Into::into);
            }
            Some(residual_moments(&linkage, mu, &angles, lean).into())
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

/// Points and weights of the central difference of order 6, which uses six points (Fornberg, Math. Comp. 51,
/// 1988, table 1).
pub(super) const SIX_POINTS: [(f64, f64); 6] = [
    (-3.0, -1.0 / 60.0),
    (-2.0, 9.0 / 60.0),
    (-1.0, -45.0 / 60.0),
    (1.0, 45.0 / 60.0),
    (2.0, -9.0 / 60.0),
    (3.0, 1.0 / 60.0),
];

/// Step of a central difference, relative to the scale over which the function changes. The truncation error,
/// the sixth power of the step, is below rounding, and the rounding error divided by the step is 1e-13.
pub(super) const DIFFERENCE_STEP: f64 = 1e-3;

/// Derivative of `f` at 0 by a central difference with six points; `None` if `f` has no value at one of the
/// points.
pub(super) fn central_difference<const N: usize>(
    step: f64,
    mut f: impl FnMut(f64) -> Option<[f64; N]>,
) -> Option<[f64; N]> {
    let mut sum = [0.0; N];
    for (point, weight) in SIX_POINTS {
        let value = f(point * step)?;
        sum.iter_mut().zip(value).for_each(|(sum, value)| *sum += weight / step * value);
    }
    Some(sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::tangent::LinkageConstant;

    /// A rounding error of a finite difference must not count as a change of a constant, because each change
    /// costs time.
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
