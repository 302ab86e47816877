//! What a derivative is taken by.

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
    #[must_use]
    pub fn from_name(name: &str) -> Self {
        let other = NAMED_DIRECTIONS.iter().find(|(_, other, _)| *other == name);
        other.map_or_else(|| Self::Parameter(name.to_owned()), |(direction, ..)| direction.clone())
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Parameter(name) => name,
            other => NAMED_DIRECTIONS
                .iter()
                .find(|(direction, ..)| direction == other)
                .map_or("", |(_, name, _)| name),
        }
    }

    /// Names of the directions that are no parameters.
    pub fn other_names() -> impl Iterator<Item = &'static str> {
        NAMED_DIRECTIONS.iter().map(|(_, name, _)| *name)
    }
}
