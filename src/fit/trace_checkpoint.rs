//! Iterates of a trace fit in a journal: everything from which the next one follows, to the last bit.

use super::trace::{CameraUnknown, Iterate, SegmentState, TraceUnknown, UnknownKind};
use crate::checkpoint::{CheckpointKind, CheckpointRecord, ExactNumber};
use crate::model::parameters;
use crate::{checkpoint, math};
use serde::{Deserialize, Serialize};

/// The journal of a trace fit.
pub(crate) type TraceCheckpoint = checkpoint::CheckpointFile<IterateRecord>;
pub(crate) type TraceHeader = checkpoint::CheckpointHeader<TraceHeaderBody>;

/// One iterate of one search in a journal.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct IterateRecord {
    /// Number of its chain: that of its start, from 0, or of a [`Branch`](super::trace::Branch).
    pub start: usize,
    /// Which iterate of that search, from 0: each follows from the one before.
    pub step: usize,
    pub iterate: Iterate,
}

impl CheckpointRecord for IterateRecord {
    const KIND: CheckpointKind = CheckpointKind::Trace;
    type Body = TraceHeaderBody;
    type IterateRow = Row;
    type Identity = (usize, usize);

    fn identity(&self) -> (usize, usize) {
        (self.start, self.step)
    }

    fn to_row(&self, at: usize) -> Row {
        let Iterate { stage, number, cuts, rescues: mended, plain, settled, damping, point, segments, cost } =
            &self.iterate;
        Row {
            index: at,
            start: self.start,
            step: self.step,
            stage: *stage,
            number: *number,
            cuts: *cuts,
            mended: *mended,
            plain: *plain,
            settled: *settled,
            damping: ExactNumber(*damping),
            cost: ExactNumber(*cost),
            point: point.iter().copied().map(ExactNumber).collect(),
            segments: segments.iter().map(SegmentRow::from_state).collect(),
        }
    }

    fn line_index(row: &Row) -> Option<usize> {
        Some(row.index)
    }

    fn from_row(row: Row, body: &TraceHeaderBody) -> Result<Self, String> {
        row.check_against(body)?;
        let iterate = Iterate {
            stage: row.stage,
            number: row.number,
            cuts: row.cuts,
            rescues: row.mended,
            plain: row.plain,
            settled: row.settled,
            damping: row.damping.0,
            cost: row.cost.0,
            point: row.point.into_iter().map(|z| z.0).collect(),
            segments: row.segments.into_iter().map(SegmentRow::into_state).collect(),
        };
        Ok(Self { start: row.start, step: row.step, iterate })
    }

    /// The first number that differs.
    fn difference(&self, other: &Self) -> Option<[String; 2]> {
        let [one, two] = [&self.iterate, &other.iterate];
        if one == two {
            return None;
        }
        let points = one.point.iter().zip(&two.point).position(|(a, b)| a.to_bits() != b.to_bits());
        let segments = one.segments.iter().zip(&two.segments).position(|(a, b)| a != b);
        let words = |iterate: &Iterate| match (points, segments) {
            (Some(at), _) => format!("coordinate {at} of {:?}", iterate.point[at]),
            (None, Some(at)) => format!("segment {at} of {:?}", iterate.segments[at]),
            (None, None) => format!(
                "stage {}, number {}, cost {:?}, damping {:?}, {} segments",
                iterate.stage,
                iterate.number,
                iterate.cost,
                iterate.damping,
                iterate.segments.len()
            ),
        };
        Some([words(one), words(two)])
    }

    fn problem_difference(found: &TraceHeaderBody, expected: &TraceHeaderBody) -> Option<String> {
        if found.seed != expected.seed {
            let (found, expected) = (found.seed, expected.seed);
            return Some(format!(
                "`seed`: found {found}, expected {expected}: it decides where searches start"
            ));
        }
        let differ = found != expected;
        differ.then(|| "the header has other unknowns, recordings or segments than the fit".to_owned())
    }
}

/// An iterate as it stands in a line.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Row {
    index: usize,
    start: usize,
    step: usize,
    stage: usize,
    number: usize,
    cuts: usize,
    mended: usize,
    plain: bool,
    settled: bool,
    damping: ExactNumber,
    cost: ExactNumber,
    point: Vec<ExactNumber>,
    segments: Vec<SegmentRow>,
}

impl Row {
    fn check_against(&self, body: &TraceHeaderBody) -> Result<(), String> {
        let counts = [("point", self.point.len(), body.unknowns.len())];
        if let Some((key, found, expected)) =
            counts.into_iter().find(|(_, found, expected)| found != expected)
        {
            return Err(format!("`{key}`: found {found} numbers, expected {expected}"));
        }
        if self.stage >= body.segment_s.len() {
            return Err(format!("`stage`: found {}, expected below {}", self.stage, body.segment_s.len()));
        }
        let wrong = self.segments.iter().find(|s| s.recording >= body.recordings.len() || s.first >= s.last);
        wrong.map_or(Ok(()), |s| {
            Err(format!(
                "`segments`: found frames {} to {} of recording {}, expected rising frames of {} recordings",
                s.first,
                s.last,
                s.recording,
                body.recordings.len()
            ))
        })
    }
}

/// A segment as it stands in a line.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SegmentRow {
    recording: usize,
    first: usize,
    last: usize,
    start: [ExactNumber; 4],
    shown: [ExactNumber; 4],
    data: usize,
    /// Absent where the model's run fails.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    chi2: Option<ExactNumber>,
}

impl SegmentRow {
    fn from_state(state: &SegmentState) -> Self {
        let SegmentState { recording: film, first, last, start, shown, chi2, data } = state;
        Self {
            recording: *film,
            first: *first,
            last: *last,
            start: start.map(ExactNumber),
            shown: shown.map(ExactNumber),
            data: *data,
            chi2: chi2.is_finite().then_some(ExactNumber(*chi2)),
        }
    }

    fn into_state(self) -> SegmentState {
        SegmentState {
            recording: self.recording,
            first: self.first,
            last: self.last,
            start: self.start.map(|x| x.0),
            shown: self.shown.map(|x| x.0),
            data: self.data,
            chi2: self.chi2.map_or(f64::INFINITY, |chi2| chi2.0),
        }
    }
}

// What the header of a trace fit's journal says.

/// What the header of a trace fit says besides.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct TraceHeaderBody {
    /// Seed of the job.
    pub seed: u64,
    /// Names of the recordings, in the order of their numbers.
    pub recordings: Vec<String>,
    /// Length of the segments in each stage, s.
    pub segment_s: Vec<ExactNumber>,
    /// What is estimated, in the order of the coordinates.
    pub unknowns: Vec<HeaderCoordinate>,
}

/// Something that is estimated, and what its coordinate means.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct HeaderCoordinate {
    /// Key of the scene, or the recording and what of its camera.
    pub name: String,
    /// Unit of its value.
    pub unit: String,
    /// Length of a unit of the coordinate; absent where the coordinate is the logarithm of the value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub per_unit: Option<ExactNumber>,
    /// Range of the coordinate.
    pub range: [ExactNumber; 2],
    /// Mean and standard deviation of the prior of the coordinate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prior: Option<[ExactNumber; 2]>,
}

impl HeaderCoordinate {
    /// An unknown of a fit to these recordings.
    pub(crate) fn from_unknown(unknown: &TraceUnknown, recordings: &[String]) -> Self {
        let (name, unit) = match &unknown.kind {
            UnknownKind::Parameter { name, .. } => {
                (name.clone(), parameters::find_parameter(name).map_or("1", |row| row.unit).to_owned())
            }
            UnknownKind::Camera { film, what } => {
                let recording = recordings.get(*film).map_or("", String::as_str);
                (
                    format!("{recording}: {}", camera_unknown_name(*what)),
                    camera_unknown_unit(*what).to_owned(),
                )
            }
        };
        let is_logarithm = matches!(unknown.kind, UnknownKind::Parameter { unit: None, .. });
        Self {
            name,
            unit,
            per_unit: (!is_logarithm).then(|| ExactNumber(unknown.slope(0.0))),
            range: unknown.range.map(ExactNumber),
            prior: unknown.prior.map(|prior| prior.map(ExactNumber)),
        }
    }

    /// The value at a coordinate, in its unit.
    pub(crate) fn value(&self, coordinate: f64) -> f64 {
        self.per_unit.map_or_else(|| math::exp(coordinate), |unit| coordinate * unit.0)
    }
}

/// Key of a number of a camera in files, its unit included.
pub(crate) fn camera_unknown_name(what: CameraUnknown) -> &'static str {
    match what {
        CameraUnknown::OffsetX => "offset_x_m",
        CameraUnknown::OffsetDrop => "offset_drop_m",
        CameraUnknown::DriftX => "drift_x_m_per_s",
        CameraUnknown::DriftDrop => "drift_drop_m_per_s",
        CameraUnknown::Scale => "scale_relative",
        CameraUnknown::Tilt => "tilt_rad",
        CameraUnknown::Clock => "clock_s",
    }
}

fn camera_unknown_unit(what: CameraUnknown) -> &'static str {
    match what {
        CameraUnknown::OffsetX | CameraUnknown::OffsetDrop => "m",
        CameraUnknown::DriftX | CameraUnknown::DriftDrop => "m/s",
        CameraUnknown::Scale => "1",
        CameraUnknown::Tilt => "rad",
        CameraUnknown::Clock => "s",
    }
}

#[cfg(test)]
pub(super) mod tests;
