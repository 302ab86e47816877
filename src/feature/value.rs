//! Values of readings, their units and their comparison.

/// A value computed from a recording or a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FeatureValue {
    /// The value, in the reading's unit.
    pub value: f64,
    /// Standard deviation of the value, if the reading gives one.
    pub sd: Option<f64>,
    /// Level of the chosen component below the strongest component of the band, dB; 0 for the strongest
    /// component, and for readings that do not choose among components.
    pub below_db: f64,
    /// The second-best component, if the reading chooses among components.
    pub runner_up: Option<RunnerUpComponent>,
}

/// The best component that was not chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunnerUpComponent {
    /// Frequency of the component, Hz.
    pub frequency_hz: f64,
    /// Level below the strongest component of the band, dB.
    pub below_db: f64,
}

impl FeatureValue {
    /// Value of a reading that does not choose among components.
    pub(super) fn new(value: f64, sd: Option<f64>) -> Self {
        Self { value, sd, below_db: 0.0, runner_up: None }
    }
}

/// Effect of the camera's calibration on a length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LengthCalibration {
    /// The value is a mean position of the tip relative to the head; it depends on the scale and on the
    /// offset of the markers.
    Position,
    /// The value is the size of a motion; it depends on the scale, except for a floor that was added in
    /// quadrature.
    Size {
        /// Root mean square of the floor, m.
        floor_m: f64,
    },
}

/// Unit of a value in files and in figures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FeatureUnit {
    /// Name in files; `1` for a plain number.
    pub name: &'static str,
    /// Suffix of the name of a column.
    pub suffix: &'static str,
    /// Name in figures; empty for a plain number.
    pub shown: &'static str,
    /// Factor from the unit in files to the unit in figures.
    pub factor: f64,
}

impl FeatureUnit {
    pub(crate) const HERTZ: Self = Self { name: "Hz", suffix: "_hz", shown: "Hz", factor: 1.0 };
    pub(crate) const MICROMETRES: Self = Self { name: "m", suffix: "_m", shown: "\u{b5}m", factor: 1e6 };
    pub(crate) const MILLIMETRES: Self = Self { name: "m", suffix: "_m", shown: "mm", factor: 1e3 };
    pub(crate) const MILLISECONDS: Self = Self { name: "s", suffix: "_s", shown: "ms", factor: 1e3 };
    pub(crate) const SECONDS: Self = Self { name: "s", suffix: "_s", shown: "s", factor: 1.0 };
    pub(crate) const NEWTONS: Self = Self { name: "N", suffix: "_n", shown: "N", factor: 1.0 };
    pub(crate) const DIMENSIONLESS: Self = Self { name: "1", suffix: "", shown: "", factor: 1.0 };
}

/// Way in which two values of a reading are compared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ValueComparison {
    /// The values are compared by the logarithm of their ratio.
    Log,
    /// The values are compared by their difference, because they may be zero or change sign.
    Linear {
        /// Scale of the difference, in the unit of the reading: a difference of this size counts as large.
        scale: f64,
    },
}
