//! What the calibration of a camera does to a value that is a length.

/// A value that is read from lengths in a picture, by what its camera does to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LengthCalibration {
    /// A mean place of the tip against the head: it has the offset of the markers and the scale.
    Position,
    /// The size of a motion: it has the scale, but for what was added in quadrature.
    Size {
        /// That root mean square, m.
        floor_m: f64,
    },
}
