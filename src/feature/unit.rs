//! Units of readings, in files and in figures, and how two values are compared.

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
    /// Frequencies.
    pub const HERTZ: Self = Self { name: "Hz", suffix: "_hz", shown: "Hz", factor: 1.0 };
    /// Amplitudes, m.
    pub const MICROMETRES: Self = Self { name: "m", suffix: "_m", shown: "\u{b5}m", factor: 1e6 };
    /// Deflections, m.
    pub const MILLIMETRES: Self = Self { name: "m", suffix: "_m", shown: "mm", factor: 1e3 };
    /// Durations, s.
    pub const MILLISECONDS: Self = Self { name: "s", suffix: "_s", shown: "ms", factor: 1e3 };
    /// Instants, s.
    pub const SECONDS: Self = Self { name: "s", suffix: "_s", shown: "s", factor: 1.0 };
    /// Forces.
    pub(crate) const NEWTONS: Self = Self { name: "N", suffix: "_n", shown: "N", factor: 1.0 };
    /// Ratios and counts.
    pub const DIMENSIONLESS: Self = Self { name: "1", suffix: "", shown: "", factor: 1.0 };
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
