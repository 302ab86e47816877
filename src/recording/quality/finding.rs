//! A finding on the quality of a recording: its severity, a number and advice.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Severity of a finding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Worth knowing.
    Note,
    /// Something may be wrong, or the recording shows less than it seems to show.
    Caution,
    /// Frequencies, lengths or directions are probably wrong, or the recording can show nothing.
    Serious,
}

impl Severity {
    /// Name of the severity.
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
        /// Subject of a finding.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
        pub enum Check {
            $($(#[$doc])+ #[serde(rename = $name)] $check,)+
        }

        impl Check {
            /// Every check.
            pub const ALL: &[Self] = &[$(Self::$check),+];

            /// Name of the check in files.
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
    /// A recording too short for three cycles of any frequency that its rate can show.
    TooShort = "too-short",
    /// Lowest and highest frequency that the recording shows.
    Bandwidth = "bandwidth",
    /// Frames without a deflection or without a value of a channel.
    Gaps = "gaps",
    /// A channel without any value.
    Absent = "absent",
    /// Range of frames that both tracks cover.
    Overlap = "overlap",
    /// A frame rate at which videos are usually played.
    PlaybackRate = "playback-rate",
    /// Frames that exactly repeat the previous frame.
    FrozenFrames = "frozen-frames",
    /// Frames in which one point exactly repeats its last position.
    HeldPoints = "held-points",
    /// Points on straight lines between others.
    InterpolatedPoints = "interpolated-points",
    /// Positions in steps coarser than their noise.
    PositionStep = "position-step",
    /// Tracking noise of a channel.
    Noise = "noise",
    /// Points that lie far off for a few frames and return.
    Outliers = "outliers",
    /// Positions that the tracker doubts.
    LowConfidence = "low-confidence",
    /// Noise that falls towards the Nyquist frequency.
    PreFiltered = "pre-filtered",
    /// Attenuation of fast motion by the exposure.
    Exposure = "exposure",
    /// Travel along the sweep and height of the blade; an implausible one reveals a wrong scale.
    Scale = "scale",
    /// A frame rate that gives impossible strokes, or shows no vibration.
    FrameRate = "frame-rate",
    /// Tracks of tip and head that belong to different frames.
    Lag = "lag",
    /// A jump of the head, where frames are missing although the frame numbers go on.
    LostFrames = "lost-frames",
    /// Tip and head exchanged.
    SwappedPoints = "swapped-points",
    /// Columns of tip and head, or of x and y, exchanged.
    MixedColumns = "mixed-columns",
    /// A tip above the head, which means that y points down.
    YDirection = "y-direction",
    /// A picture in which the glass is not level.
    Tilt = "tilt",
    /// A path of the tip that is not a straight line.
    CurvedGlass = "curved-glass",
    /// Turns of the head.
    Reversals = "reversals",
    /// An export that has changed since the import.
    SourceChanged = "source-changed",
    /// Frames that lie on no grid.
    UnevenClock = "uneven-clock",
    /// Rate that the times of an export imply.
    ImpliedRate = "implied-rate",
    /// Times rounded to a noticeable part of a frame.
    RoundedTimes = "rounded-times",
    /// Numbers that a spreadsheet has rounded.
    SpreadsheetRounding = "spreadsheet-rounding",
    /// Labels of single pictures that were picked from a video.
    PickedFrames = "picked-frames",
    /// Named columns in a table that is not a table of positions.
    OtherTable = "other-table",
    /// A unit that the file contradicts.
    Unit = "unit",
    /// Coordinates that look like those in another unit.
    UnitSuspicion = "unit-suspicion",
    /// A direction of y that the format contradicts.
    YAxis = "y-axis",
    /// Consecutive frames at exactly (0, 0).
    ZeroRun = "zero-run",
    /// Frames at exactly (-1, -1).
    MinusOneRun = "minus-one-run",
    /// Positions that the format marks as lost.
    LostPoints = "lost-points",
    /// Positions rejected because of their low confidence.
    ConfidenceRejected = "confidence-rejected",
    /// A point that has no track or no positions.
    Points = "points",
    /// Several tracks with the same name.
    TrackNames = "track-names",
    /// Tracks that split or merge.
    BranchingTracks = "branching-tracks",
    /// Positions that the tracking program filtered.
    Filtered = "filtered",
    /// Positions relative to a moving point.
    RelativePositions = "relative-positions",
    /// A camera's record file that does not fit the export.
    CameraRecord = "camera-record",
}

/// A finding on the quality of a recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct QualityFinding {
    /// The check that made the finding.
    pub check: Check,
    /// Severity of the finding.
    pub severity: Severity,
    /// The channel (`tip-x`, ...) that the finding concerns; absent if it concerns the whole recording.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub channel: Option<String>,
    /// The number that was found.
    pub value: f64,
    /// Unit of the number, empty for a count or a ratio.
    pub unit: String,
    /// Description of what was found.
    pub found: String,
    /// Advice on what to do; empty if there is nothing to do.
    pub advice: String,
}

impl QualityFinding {
    /// A finding on the whole recording without advice; [`Self::on_channel`] and [`Self::with_advice`] add a
    /// channel and advice.
    #[must_use]
    pub fn new(check: Check, severity: Severity, value: f64, unit: &str, found: String) -> Self {
        Self::advise((check, severity), (value, unit), found, "")
    }

    /// A finding on the whole recording with advice, which is empty if there is nothing to do.
    pub(crate) fn advise(
        (check, severity): (Check, Severity),
        (value, unit): (f64, &str),
        found: impl Into<String>,
        advice: impl Into<String>,
    ) -> Self {
        let (unit, found, advice) = (unit.to_owned(), found.into(), advice.into());
        Self { check, severity, channel: None, value, unit, found, advice }
    }

    /// Returns this finding with the name of the channel that it concerns.
    #[must_use]
    pub fn on_channel(self, channel: &str) -> Self {
        Self { channel: Some(channel.to_owned()), ..self }
    }

    /// Returns this finding with the given advice.
    #[must_use]
    pub fn with_advice(self, advice: &str) -> Self {
        Self { advice: advice.to_owned(), ..self }
    }

    /// The finding as one line of text.
    #[must_use]
    pub fn to_line(&self) -> String {
        let channel = self.channel.as_ref().map_or_else(String::new, |channel| format!("{channel}: "));
        let advice = if self.advice.is_empty() { String::new() } else { format!("; {}", self.advice) };
        format!("{}: {channel}{}{advice}", self.severity.name(), self.found)
    }
}
