//! Time intervals between two instants of a reversal.

use super::missing::MissingValue;
use super::reader::FeatureReader;
use super::value::FeatureValue;
use crate::recording::channel::InstantKind;
use serde::Serialize;

/// A time interval between two instants of a reversal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum ReversalInterval {
    /// From the head's turn to the tip's release.
    ReleaseAfterReversal,
    /// From the tip's stop to its release.
    StickDuration,
    /// From the head's turn to the start of the flip; may be negative.
    FlipAfterReversal,
    /// From the start of the flip to its end.
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
