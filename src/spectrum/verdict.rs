//! What a component's frequency is worth.

use serde::Serialize;

/// What a component's frequency is worth, gravest reason first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ComponentVerdict {
    /// Fewer than `MIN_CYCLES` in the record: the frequency depends on the trend and the window.
    NotResolvable,
    /// A faster oscillation that the motion may hold would appear at the same frequency.
    AliasSuspected,
    /// No trend describes what it rides on, or a richer one moves it by more than three deviations, its
    /// amplitude is within three of zero, a quarter of it is left around it, or no oscillation that keeps its
    /// frequency and decays steadily explains it.
    Ambiguous,
    /// A multiple of a stronger component, to within four deviations.
    Harmonic,
    /// A half or a third of a stronger component, or a multiple of these: not every beat is like the one
    /// before.
    Subharmonic,
    /// A stronger component, modulated by another.
    Sideband,
    /// Within its deviation of a multiple of the mains frequency: a lamp may have made it.
    Mains,
    /// The exposure has passed less than nine tenths of the amplitude.
    Attenuated,
    /// Above what noise alone reaches once in a hundred spectra, but less than `CLEAR_DB` above the
    /// noise floor.
    Weak,
    /// Nothing of the above.
    Clear,
}

impl ComponentVerdict {
    /// The word in files and tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::NotResolvable => "not-resolvable",
            Self::AliasSuspected => "alias-suspected",
            Self::Ambiguous => "ambiguous",
            Self::Harmonic => "harmonic",
            Self::Subharmonic => "subharmonic",
            Self::Sideband => "sideband",
            Self::Mains => "mains",
            Self::Attenuated => "attenuated",
            Self::Weak => "weak",
            Self::Clear => "clear",
        }
    }
}

/// A verdict with what it rests on.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ComponentReason {
    /// The verdict.
    pub verdict: ComponentVerdict,
    /// The numbers behind it, in words.
    pub words: String,
}

/// A frequency that would appear at a component's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AliasSource {
    /// The faster frequency, Hz.
    pub frequency_hz: f64,
    /// Part of its amplitude that the exposure would have passed, where that is known.
    pub exposure_passes: Option<f64>,
}

/// A component of which another is a fraction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Subharmonic {
    /// Frequency of the component, Hz.
    pub frequency_hz: f64,
    /// The fraction's numerator.
    pub numerator: usize,
    /// Its denominator: so many beats pass until one is like the first.
    pub denominator: usize,
}

/// A component that another is modulated from.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Sideband {
    /// Frequency of the component, Hz.
    pub frequency_hz: f64,
    /// Frequency that it is modulated with, Hz.
    pub modulation_hz: f64,
}

/// A multiple of the mains frequency.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct MainsMultiple {
    /// Frequency of the mains, Hz.
    pub frequency_hz: usize,
    /// The multiple.
    pub multiple: usize,
}

/// A component of which another is a multiple.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Harmonic {
    /// Frequency of the component, Hz.
    pub frequency_hz: f64,
    /// The multiple.
    pub multiple: usize,
}
