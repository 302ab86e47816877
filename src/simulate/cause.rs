//! Why a mode of contact gives way to another.

/// Why contact changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TransitionCause {
    /// The tip comes to rest and sticks.
    TipStops,
    /// The holding force reaches the static limit.
    FrictionLimit,
    /// The tip's velocity changes sign and nothing holds it at rest.
    DirectReversal,
    /// The shoulder's damping makes the holding force jump as the neck meets it.
    ShoulderCorner,
    /// The normal force reaches zero.
    LiftOff,
    /// An impact from flight; a rebound is one from flight to flight.
    Landing,
    /// The impact without collision that resolves the Painlevé paradox.
    JamImpact,
}

impl TransitionCause {
    /// The name used in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::TipStops => "tip-stops",
            Self::FrictionLimit => "friction-limit",
            Self::DirectReversal => "direct-reversal",
            Self::ShoulderCorner => "shoulder-corner",
            Self::LiftOff => "lift-off",
            Self::Landing => "landing",
            Self::JamImpact => "jam-impact",
        }
    }
}
