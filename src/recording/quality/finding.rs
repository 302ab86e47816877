//! A finding on the quality of a recording: its severity, a number and advice.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How much a finding matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Worth knowing.
    Note,
    /// Something may be wrong, or shows less than it seems.
    Caution,
    /// Frequencies, lengths or directions are probably wrong, or nothing can be shown.
    Serious,
}

impl Severity {
    /// The word for it.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Note => "note",
            Self::Caution => "caution",
            Self::Serious => "serious",
        }
    }
}

macro_rules! checks {
    ($($(#[$doc:meta])+ $check:ident = $name:literal,)+) => {
        /// What a finding is about.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
        pub enum Check {
            $($(#[$doc])+ #[serde(rename = $name)] $check,)+
        }

        impl Check {
            /// Every check.
            pub const ALL: &[Self] = &[$(Self::$check),+];

            /// Its name in files.
            #[must_use]
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$check => $name,)+
                }
            }
        }
    };
}

checks! {
    /// Frames, rate and length.
    FrameGrid = "frame-grid",
    /// Too few cycles of anything that the recording can show.
    TooShort = "too-short",
    /// Lowest and highest frequency that the recording shows.
    Bandwidth = "bandwidth",
    /// Frames without a deflection or without a channel.
    Gaps = "gaps",
    /// A channel without any value.
    Absent = "absent",
    /// Frames that both tracks reach over.
    Overlap = "overlap",
    /// A rate at which videos are played.
    PlaybackRate = "playback-rate",
    /// Frames that repeat the one before exactly.
    FrozenFrames = "frozen-frames",
    /// Positions in steps coarser than their noise.
    PositionStep = "position-step",
    /// Tracking noise of a channel.
    Noise = "noise",
    /// Isolated points far from their neighbours.
    Outliers = "outliers",
    /// Positions that the tracker doubts.
    LowConfidence = "low-confidence",
    /// Noise that falls towards the Nyquist frequency.
    PreFiltered = "pre-filtered",
    /// What the exposure leaves of fast motion.
    Exposure = "exposure",
    /// A travel that is no wiper's.
    Scale = "scale",
    /// A tip above the head.
    YDirection = "y-direction",
    /// A picture in which the glass is not level.
    Tilt = "tilt",
    /// A path of the tip that is no straight line.
    CurvedGlass = "curved-glass",
    /// Turns of the head.
    Reversals = "reversals",
    /// An export that is no longer the one imported.
    SourceChanged = "source-changed",
    /// Rate that the times of an export imply.
    ImpliedRate = "implied-rate",
    /// Times rounded to a noticeable part of a frame.
    RoundedTimes = "rounded-times",
    /// Times that count frames because the interval was never set.
    FrameInterval = "frame-interval",
    /// Positions resampled to another rate.
    Resampled = "resampled",
    /// A table that drops samples of fast cameras.
    SamplesLost = "samples-lost",
    /// Numbers that a spreadsheet has rounded.
    SpreadsheetRounding = "spreadsheet-rounding",
    /// Labels of pictures picked from a video.
    PickedFrames = "picked-frames",
    /// Named columns of a table that is no table of positions.
    OtherTable = "other-table",
    /// A unit that the file contradicts.
    Unit = "unit",
    /// Coordinates that look like another unit.
    UnitSuspicion = "unit-suspicion",
    /// A direction of y that the format contradicts.
    YAxis = "y-axis",
    /// Frames in a row at exactly (0, 0).
    ZeroRun = "zero-run",
    /// Frames at exactly (-1, -1).
    MinusOneRun = "minus-one-run",
    /// Positions that the format marks as lost.
    LostPoints = "lost-points",
    /// Positions rejected for their confidence.
    ConfidenceRejected = "confidence-rejected",
    /// A point without a track or positions.
    Points = "points",
    /// Tracks of one name.
    TrackNames = "track-names",
    /// Tracks that split or merge.
    BranchingTracks = "branching-tracks",
    /// Positions that their program filtered.
    Filtered = "filtered",
    /// Positions relative to a moving point.
    RelativePositions = "relative-positions",
    /// A camera's record that does not fit the export.
    CameraRecord = "camera-record",
}

/// One finding.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct QualityFinding {
    /// The check that made it.
    pub check: Check,
    /// How much it matters.
    pub severity: Severity,
    /// The channel (`tip-x`, ...) that it concerns; absent where it is the whole recording.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub channel: Option<String>,
    /// Its number.
    pub value: f64,
    /// Unit of the number, empty for a count or a ratio.
    pub unit: String,
    /// What was found, in words.
    pub found: String,
    /// What to do, in words; empty where there is nothing to do.
    pub advice: String,
}

impl QualityFinding {
    /// A finding on the whole recording without advice; the other parts are added by [`Self::on_channel`] and
    /// [`Self::with_advice`].
    #[must_use]
    pub fn new(check: Check, severity: Severity, value: f64, unit: &str, found: String) -> Self {
        Self::advise((check, severity), (value, unit), found, "")
    }

    /// A finding on the whole recording with advice, which is empty where there is nothing to do.
    pub(super) fn advise(
        (check, severity): (Check, Severity),
        (value, unit): (f64, &str),
        found: impl Into<String>,
        advice: impl Into<String>,
    ) -> Self {
        let (unit, found, advice) = (unit.to_owned(), found.into(), advice.into());
        Self { check, severity, channel: None, value, unit, found, advice }
    }

    /// The same on one channel.
    #[must_use]
    pub fn on_channel(self, channel: &str) -> Self {
        Self { channel: Some(channel.to_owned()), ..self }
    }

    /// The same with what to do.
    #[must_use]
    pub fn with_advice(self, advice: &str) -> Self {
        Self { advice: advice.to_owned(), ..self }
    }

    /// The finding as one line for reading.
    #[must_use]
    pub fn to_line(&self) -> String {
        let channel = self.channel.as_ref().map_or_else(String::new, |channel| format!("{channel}: "));
        let advice = if self.advice.is_empty() { String::new() } else { format!("; {}", self.advice) };
        format!("{}: {channel}{}{advice}", self.severity.name(), self.found)
    }
}
