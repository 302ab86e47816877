//! Journal of a trace fit: one iterate per line, stored bit by bit with everything on which the next iterate
//! depends.

use super::trace::{CameraUnknown, Iterate, SegmentState, TraceUnknown, UnknownKind};
use crate::checkpoint;
use crate::checkpoint::{CheckpointKind, CheckpointRecord, ExactNumber};
use crate::model::parameters;
use portable_math as math;
use serde::{Deserialize, Serialize};

/// The journal of a trace fit.
pub(crate) type TraceCheckpoint = checkpoint::CheckpointFile<IterateRecord>;
pub(crate) type TraceHeader = checkpoint::CheckpointHeader<TraceHeaderBody>;

/// One iterate of one chain.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct IterateRecord {
    /// Number of the chain of this iterate: the number of a start, counted from 0, or of an
    /// [`UncertaintyRun`](super::trace::UncertaintyRun).
    pub start: usize,
    /// Number of the iterate in its chain, counted from 0. Each iterate is computed from the previous one.
    pub step: usize,
    pub iterate: Iterate,
}

impl CheckpointRecord for IterateRecord {
    const KIND: CheckpointKind = CheckpointKind::Trace;
    type Body = TraceHeaderBody;
    type Row = IterateRow;
    type Identity = (usize, usize);

    fn identity(&self) -> (usize, usize) {
        (self.start, self.step)
    }

    fn to_row(&self, at: usize) -> IterateRow {
        let Self { start, step, ref iterate } = *self;
        let Iterate { stage, number, cuts, rescues: mended, whole, plain, settled, .. } = *iterate;
        let [damping, cost] = [iterate.damping, iterate.cost].map(ExactNumber);
        let point = iterate.point.iter().copied().map(ExactNumber).collect();
        let segments = iterate.segments.iter().map(SegmentRow::from_state).collect();
        let index = at;
        IterateRow {
            index,
            start,
            step,
            stage,
            number,
            cuts,
            mended,
            whole,
            plain,
            settled,
            damping,
            cost,
            point,
            segments,
        }
    }

    fn line_index(row: &IterateRow) -> Option<usize> {
        Some(row.index)
    }

    fn from_row(row: IterateRow, body: &TraceHeaderBody) -> Result<Self, String> {
        row.check_against(body)?;
        let IterateRow { start, step, stage, number, cuts, mended: rescues, whole, plain, settled, .. } = row;
        let (damping, cost) = (row.damping.0, row.cost.0);
        let point = row.point.into_iter().map(|z| z.0).collect();
        let segments = row.segments.into_iter().map(SegmentRow::into_state).collect();
        let iterate =
            Iterate { stage, number, cuts, rescues, whole, plain, settled, damping, point, segments, cost };
        Ok(Self { start, step, iterate })
    }

    /// Describes the first number that differs between two records; `None` if they are equal.
    fn difference(&self, other: &Self) -> Option<[String; 2]> {
        let [one, two] = [&self.iterate, &other.iterate];
        if one == two {
            return None;
        }
        let points = one.point.iter().zip(&two.point).position(|(a, b)| a.to_bits() != b.to_bits());
        let segments = one.segments.iter().zip(&two.segments).position(|(a, b)| a != b);
        let describe = |iterate: &Iterate| match (points, segments) {
            (Some(at), _) => format!("coordinate {at} of {:?}", iterate.point[at]),
            (None, Some(at)) => format!("segment {at} of {:?}", iterate.segments[at]),
            (None, None) => {
                let (Iterate { stage, number, cost, damping, .. }, count) = (iterate, iterate.segments.len());
                format!(
                    "stage {stage}, number {number}, cost {cost:?}, damping {damping:?}, {count} segments"
                )
            }
        };
        Some([one, two].map(describe))
    }

    fn problem_difference(found: &TraceHeaderBody, expected: &TraceHeaderBody) -> Option<String> {
        let (seed, own) = (found.seed, expected.seed);
        if seed != own {
            return Some(format!("`seed`: found {seed}, expected {own}: it decides where searches start"));
        }
        let differ = found != expected;
        differ.then(|| "the header has other unknowns, recordings or segments than the fit".to_owned())
    }
}

/// An iterate as a line of the journal.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct IterateRow {
    index: usize,
    start: usize,
    step: usize,
    stage: usize,
    number: usize,
    cuts: usize,
    mended: usize,
    whole: bool,
    plain: bool,
    settled: bool,
    damping: ExactNumber,
    cost: ExactNumber,
    point: Vec<ExactNumber>,
    segments: Vec<SegmentRow>,
}

impl IterateRow {
    fn check_against(&self, body: &TraceHeaderBody) -> Result<(), String> {
        let (found, expected) = (self.point.len(), body.unknowns.len());
        if found != expected {
            return Err(format!("`point`: found {found} numbers, expected {expected}"));
        }
        let (stage, stages, recordings) = (self.stage, body.segment_s.len(), body.recordings.len());
        if stage >= stages {
            return Err(format!("`stage`: found {stage}, expected below {stages}"));
        }
        let wrong = self.segments.iter().find(|s| s.recording >= recordings || s.first >= s.last);
        wrong.map_or(Ok(()), |SegmentRow { recording, first, last, .. }| {
            Err(format!(
                "`segments`: found frames {first} to {last} of recording {recording}, expected rising frames of {recordings} recordings"
            ))
        })
    }
}

/// A segment in a line of the journal.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SegmentRow {
    recording: usize,
    first: usize,
    last: usize,
    start: [ExactNumber; 4],
    shown: [ExactNumber; 4],
    data: usize,
    /// Sum of the squared residuals of the segment; absent if the run of the model fails.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    chi2: Option<ExactNumber>,
}

impl SegmentRow {
    fn from_state(state: &SegmentState) -> Self {
        let SegmentState { recording, first, last, start, shown, chi2, data } = *state;
        let [start, shown] = [start, shown].map(|state| state.map(ExactNumber));
        let chi2 = chi2.is_finite().then_some(ExactNumber(chi2));
        Self { recording, first, last, start, shown, data, chi2 }
    }

    fn into_state(self) -> SegmentState {
        let Self { recording, first, last, start, shown, data, chi2 } = self;
        let [start, shown] = [start, shown].map(|state| state.map(|x| x.0));
        let chi2 = chi2.map_or(f64::INFINITY, |chi2| chi2.0);
        SegmentState { recording, first, last, start, shown, chi2, data }
    }
}

/// The part of the header that is specific to a trace fit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct TraceHeaderBody {
    /// Seed of the job.
    pub seed: u64,
    /// Names of the recordings, in the order of their indices.
    pub recordings: Vec<String>,
    /// Length of the segments in each stage, s.
    pub segment_s: Vec<ExactNumber>,
    /// The unknowns, in the order of the coordinates.
    pub unknowns: Vec<HeaderCoordinate>,
}

/// An unknown, and how its coordinate maps to its value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct HeaderCoordinate {
    /// For a parameter: its key in the scene file. For a camera error: the name of the recording and the key
    /// of the error.
    pub name: String,
    /// Unit of the value of the unknown.
    pub unit: String,
    /// Value that corresponds to a coordinate of 1; absent if the coordinate is the logarithm of the value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub per_unit: Option<ExactNumber>,
    /// Lower and upper end of the range of the coordinate.
    pub range: [ExactNumber; 2],
    /// Mean and standard deviation of the prior of the coordinate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prior: Option<[ExactNumber; 2]>,
}

impl HeaderCoordinate {
    /// The header entry of an unknown; `recordings` are the names of the recordings.
    pub(crate) fn from_unknown(unknown: &TraceUnknown, recordings: &[String]) -> Self {
        let (name, unit) = match &unknown.kind {
            UnknownKind::Parameter { name, .. } => {
                (name.clone(), parameters::find_parameter(name).map_or("1", |row| row.unit))
            }
            UnknownKind::Camera { film, what } => {
                let [name, unit] = camera_unknown_key(*what);
                (format!("{}: {name}", recordings.get(*film).map_or("", String::as_str)), unit)
            }
        };
        let is_logarithm = matches!(unknown.kind, UnknownKind::Parameter { unit: None, .. });
        Self {
            name,
            unit: unit.to_owned(),
            per_unit: (!is_logarithm).then(|| ExactNumber(unknown.slope(0.0))),
            range: unknown.range.map(ExactNumber),
            prior: unknown.prior.map(|prior| prior.map(ExactNumber)),
        }
    }

    /// The value at `coordinate`, in the unit of the unknown.
    pub(crate) fn value(&self, coordinate: f64) -> f64 {
        self.per_unit.map_or_else(|| math::exp(coordinate), |unit| coordinate * unit.0)
    }
}

/// Key and unit of a camera error in files.
pub(super) fn camera_unknown_key(what: CameraUnknown) -> [&'static str; 2] {
    match what {
        CameraUnknown::OffsetX => ["offset_x_m", "m"],
        CameraUnknown::OffsetDrop => ["offset_drop_m", "m"],
        CameraUnknown::TipAlong => ["tip_along_lip_m", "m"],
        CameraUnknown::TipAcross => ["tip_across_lip_m", "m"],
        CameraUnknown::Curvature => ["curvature_per_m", "1/m"],
        CameraUnknown::DriftX => ["drift_x_m_per_s", "m/s"],
        CameraUnknown::DriftDrop => ["drift_drop_m_per_s", "m/s"],
        CameraUnknown::Scale => ["scale_relative", "1"],
        CameraUnknown::Tilt => ["tilt_rad", "rad"],
        CameraUnknown::Clock => ["clock_s", "s"],
    }
}

#[cfg(test)]
pub(super) mod tests;
