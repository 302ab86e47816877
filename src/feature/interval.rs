//! Time intervals between two instants of a reversal.

use super::missing::MissingValue;
use super::reader::FeatureReader;
use super::value::FeatureValue;
use crate::recording::channel::InstantKind;
use serde::Serialize;

/// A time interval between two instants of a reversal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum ReversalInterval {
    /// Time from the turn of the head to the release of the tip.
    ReleaseAfterReversal,
    /// Time from the stop of the tip to the release of the tip.
    StickDuration,
    /// Time from the turn of the head to the start of the flip of the blade; may be negative.
    FlipAfterReversal,
    /// Time from the start to the end of the flip of the blade.
    FlipDuration,
}

impl ReversalInterval {
    /// Name of the kind of reading in a job or a study.
    pub(crate) const fn kind(self) -> &'static str {
        match self {
            Self::ReleaseAfterReversal => "release-after-reversal",
            Self::StickDuration => "stick-duration",
            Self::FlipAfterReversal => "flip-after-reversal",
            Self::FlipDuration => "flip-duration",
        }
    }

    /// Length of the interval at the `reversal`-th turn of the head, counted from 1, s.
    pub(super) fn length_s(
        self,
        reversal: usize,
        reader: &FeatureReader,
    ) -> Result<FeatureValue, MissingValue> {
        let at = |anchor| reader.instants.time_s(anchor, reversal).map_err(MissingValue::Instant);
        let length_s = match self {
            Self::ReleaseAfterReversal => at(InstantKind::Release)? - at(InstantKind::Reversal)?,
            Self::StickDuration => at(InstantKind::Release)? - at(InstantKind::Hold)?,
            Self::FlipAfterReversal => at(InstantKind::Flip)? - at(InstantKind::Reversal)?,
            Self::FlipDuration => {
                let start_s = at(InstantKind::Flip)?;
                let flip = reader.instants.find_reversal(reversal).and_then(|found| found.flip);
                flip.map_or(start_s, |flip| flip.end_s) - start_s
            }
        };
        Ok(FeatureValue::new(length_s, None))
    }
}
