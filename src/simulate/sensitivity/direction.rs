//! What a derivative is taken by.

/// What a derivative is taken by.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Direction {
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
const OTHERS: [(Direction, &str, &str); 6] = [
    (Direction::NeckAngle, "start.neck_angle_rad", "rad"),
    (Direction::LipAngle, "start.lip_angle_rad", "rad"),
    (Direction::NeckRate, "start.neck_rate_rad_per_s", "rad/s"),
    (Direction::LipRate, "start.lip_rate_rad_per_s", "rad/s"),
    (Direction::DriveScale, "drive.scale", "1"),
    (Direction::DriveDelay, "drive.delay_s", "s"),
];

impl Direction {
    /// The direction of a name: one of [`Self::other_names`], otherwise a parameter.
    #[must_use]
    pub fn of(name: &str) -> Self {
        let other = OTHERS.iter().find(|(_, other, _)| *other == name);
        other.map_or_else(|| Self::Parameter(name.to_owned()), |(direction, ..)| direction.clone())
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Parameter(name) => name,
            other => OTHERS.iter().find(|(direction, ..)| direction == other).map_or("", |(_, name, _)| name),
        }
    }

    /// Names of the directions that are no parameters.
    pub fn other_names() -> impl Iterator<Item = &'static str> {
        OTHERS.iter().map(|(_, name, _)| *name)
    }
}
