//! The phases of a reversal: before, stick, flip, after.

use super::instants::{InstantKind, InstantNotFound, ReversalInstants};
use serde::Serialize;

/// A part of the motion around a reversal. The four follow one another without a gap: each ends where the
/// next starts.
///
/// | name | from | to |
/// |---|---|---|
/// | `before` | the start of the recording, or where the reversal before it has settled | the tip stops (`hold`) |
/// | `stick` | the tip stops (`hold`) | the deflection leaves its level (`flip`) |
/// | `flip` | the deflection leaves its level (`flip`) | it has reached its level on the other side and the tip has slipped again (settled) |
/// | `after` | settled | the tip stops at the next reversal (`hold`), or the end of the recording |
///
/// The tip still sticks during most of `flip`: the head passes over it. `stick` is the part in which the
/// blade rests, so that what rings there rides on no flip. `before` of a later reversal is `after` of the one
/// before it. How the flip is found says [`super::Flip`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum ReversalPhase {
    /// The blade trails on its old side.
    Before,
    /// The tip sticks and the blade rests.
    Stick,
    /// The deflection changes sides.
    Flip,
    /// The blade trails on its new side.
    After,
}

impl ReversalPhase {
    /// Every phase, in order of time.
    pub const ALL: [Self; 4] = [Self::Before, Self::Stick, Self::Flip, Self::After];

    /// Name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Before => "before",
            Self::Stick => "stick",
            Self::Flip => "flip",
            Self::After => "after",
        }
    }

    /// Start at the `reversal`-th turn (counted from 1): a time, s, or the start of the recording (`None`).
    ///
    /// # Errors
    /// The instant that was not found, as it is written in a window, and what was found instead.
    pub(super) fn start_s(
        self,
        reversal: usize,
        instants: &ReversalInstants,
    ) -> Result<Option<f64>, (String, InstantNotFound)> {
        match self {
            Self::Before if reversal == 1 => Ok(None),
            Self::Before => settling_time_s(reversal.saturating_sub(1), instants).map(Some),
            Self::Stick => instant_time_s(InstantKind::Hold, reversal, instants).map(Some),
            Self::Flip => instant_time_s(InstantKind::Flip, reversal, instants).map(Some),
            Self::After => settling_time_s(reversal, instants).map(Some),
        }
    }

    /// End at the `reversal`-th turn (counted from 1): a time, s, or the end of the recording (`None`).
    ///
    /// # Errors
    /// As [`Self::start_s`].
    pub(super) fn end_s(
        self,
        reversal: usize,
        instants: &ReversalInstants,
    ) -> Result<Option<f64>, (String, InstantNotFound)> {
        match self {
            Self::Before => instant_time_s(InstantKind::Hold, reversal, instants).map(Some),
            Self::Stick => instant_time_s(InstantKind::Flip, reversal, instants).map(Some),
            Self::Flip => settling_time_s(reversal, instants).map(Some),
            Self::After if reversal >= instants.reversals.len() => Ok(None),
            Self::After => instant_time_s(InstantKind::Hold, reversal + 1, instants).map(Some),
        }
    }
}

fn instant_time_s(
    anchor: InstantKind,
    reversal: usize,
    instants: &ReversalInstants,
) -> Result<f64, (String, InstantNotFound)> {
    instants.time_s(anchor, reversal).map_err(|reason| (format!("{}[{reversal}]", anchor.name()), reason))
}

fn settling_time_s(reversal: usize, instants: &ReversalInstants) -> Result<f64, (String, InstantNotFound)> {
    instants
        .settling_time_s(reversal)
        .map_err(|reason| (format!("{}[{reversal}]", InstantKind::Flip.name()), reason))
}
