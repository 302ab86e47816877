//! A value that was read.

/// A value read from a recording or a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FeatureValue {
    /// The value, in the reading's unit.
    pub value: f64,
    /// Its standard deviation where the reading itself gives one.
    pub sd: Option<f64>,
    /// How far the component is below the strongest of its band, dB; 0 for the strongest, and where there is
    /// nothing to choose from.
    pub below_db: f64,
    /// The component that would have been next, where there is a choice.
    pub runner_up: Option<RunnerUpComponent>,
}

/// A component that was not chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunnerUpComponent {
    /// Its frequency, Hz.
    pub frequency_hz: f64,
    /// How far it is below the strongest of the band, dB.
    pub below_db: f64,
}

impl FeatureValue {
    /// A value among which there is no choice.
    pub(super) fn new(value: f64, sd: Option<f64>) -> Self {
        Self { value, sd, below_db: 0.0, runner_up: None }
    }
}

// What the calibration of a camera does to a value that is a length.

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

// Units of readings, in files and in figures, and how two values are compared.

/// A unit in files and in figures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FeatureUnit {
    /// In files; `1` for a plain number.
    pub name: &'static str,
    /// What it adds to the name of a column.
    pub suffix: &'static str,
    /// In figures; empty for a plain number.
    pub shown: &'static str,
    /// What a value is multiplied by in figures.
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

/// How two values are compared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ValueComparison {
    /// By the logarithm of their ratio.
    Log,
    /// By their difference, because zero and a change of sign are nothing special.
    Linear {
        /// Size of a large difference, in the reading's unit.
        scale: f64,
    },
}
