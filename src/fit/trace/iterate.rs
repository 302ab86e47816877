//! Iterates of a trace search.

use super::model::TraceModel;
use super::segment_simulation::LinkState;
use crate::checkpoint::or_infinite;
use serde::{Deserialize, Serialize};

/// Settings of a trace search.
#[derive(Debug, Clone, PartialEq)]
pub struct TraceSearchSettings {
    /// Length of the segments in each stage, s, in ascending order.
    pub segment_s: Vec<f64>,
    /// Number of simulated recordings of the best model (twins) that are fitted.
    pub twins: usize,
    /// Maximum number of segments, which are spread evenly over the recordings; `None` for all.
    pub max_segments: Option<usize>,
}

impl TraceSearchSettings {
    /// Settings of a search over all segments, without twins. `segment_s` are the lengths of the segments in
    /// each stage, s, in ascending order.
    #[must_use]
    pub fn without_twins(segment_s: Vec<f64>) -> Self {
        Self { segment_s, twins: 0, max_segments: None }
    }
}

/// A segment with its starting state and its misfit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SegmentState {
    /// Index of the recording.
    pub recording: usize,
    /// First frame of the segment.
    pub first: usize,
    /// Frame after the last frame of the segment.
    pub last: usize,
    /// Fitted angles of neck and lip, rad, and their rates, rad/s, at the start of the segment.
    pub start: [f64; 4],
    /// Angles of neck and lip, rad, and their rates, rad/s, at the start of the segment, as estimated
    /// directly from the tracked positions.
    pub shown: [f64; 4],
    /// Number of measured values in the segment.
    pub data: usize,
    /// Chi2: sum of the squared residuals, each in standard deviations of the noise; infinite if the run of
    /// the model fails.
    #[serde(deserialize_with = "or_infinite")]
    pub chi2: f64,
}

impl SegmentState {
    pub(super) fn start_state(&self) -> LinkState {
        LinkState::from(self.start)
    }

    /// Index of the first frame, and of the frame after the last frame of the segment.
    pub(super) fn frames(&self) -> [usize; 2] {
        [self.first, self.last]
    }

    /// Whether chi2 of the segment is larger than noise explains.
    pub(crate) fn is_bad(&self) -> bool {
        self.chi2 >= 2.0 * self.data as f64
    }
}

/// One accepted step of the search.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Iterate {
    /// Index of the stage.
    pub stage: usize,
    /// Number of the step within the stage, counted from 0.
    pub number: usize,
    /// Number of times that this stage was repeated: the first one with free constants, the last one with new
    /// segment boundaries.
    pub repeats: usize,
    /// Number of times that bad segments of this stage were restarted from other states.
    pub rescues: usize,
    /// Whether segments count to their end. If false, a segment that is much longer than the length of the
    /// stage counts for this length only.
    pub whole: bool,
    /// Whether the cost is plain chi2 rather than the robust cost.
    pub plain: bool,
    /// Whether the stage has converged.
    pub settled: bool,
    /// Damping of the next step, as a fraction of the diagonal of the normal matrix.
    pub damping: f64,
    /// Coordinate of each unknown.
    pub point: Vec<f64>,
    /// Segments of all recordings.
    pub segments: Vec<SegmentState>,
    /// Cost: the sum over the segments plus the cost of the priors.
    pub cost: f64,
}

impl Iterate {
    /// Number of measured values in all segments.
    pub(crate) fn count_data(&self) -> usize {
        self.segments.iter().map(|segment| segment.data).sum()
    }

    /// Whether the iterate explains nothing: most segments are bad, and on average the residuals are far
    /// above the noise. Its parameter values mean nothing.
    pub(crate) fn is_junk(&self, model: &TraceModel) -> bool {
        /// Chi2 per degree of freedom above which the residuals are far above the noise.
        const JUNK_CHI2: f64 = 10.0;
        let chi2 = chi2_per_dof(model, self).0;
        2 * self.count_bad_segments() > self.segments.len() && (chi2 > JUNK_CHI2 || chi2.is_nan())
    }

    /// Number of segments that fit worse than noise explains.
    pub(crate) fn count_bad_segments(&self) -> usize {
        self.segments.iter().filter(|segment| segment.is_bad()).count()
    }
}

/// Number of fitted numbers of the starting state of a blade: the angles of neck and lip, and their rates.
const BLADE_STATES: usize = 4;
/// Number of fitted numbers of the starting state of a slider: its deflection and the rate of the deflection.
const SLIDER_STATES: usize = 2;

/// Chi2 per degree of freedom, and number of degrees of freedom.
#[must_use]
pub fn chi2_per_dof(model: &TraceModel, at: &Iterate) -> (f64, usize) {
    let states = if is_slider(model) { SLIDER_STATES } else { BLADE_STATES };
    let chi2: f64 = at.segments.iter().map(|segment| segment.chi2).sum();
    let dof = at.count_data().saturating_sub(states * at.segments.len() + at.point.len()).max(1);
    (chi2 / dof as f64, dof)
}

/// Whether the recordings show sliders.
pub(super) fn is_slider(model: &TraceModel) -> bool {
    model.recordings.iter().any(|shoot| shoot.scene.linkage.is_slider())
}

/// Two end points count as the same point if every unknown differs between them by at most this number of
/// standard deviations of that unknown.
const SAME_END_SD: f64 = 1.0;

/// Whether two ends belong to the same stage and differ in every coordinate by at most [`SAME_END_SD`]
/// standard deviations; `sd` are the standard deviations of the coordinates. Ends that explain nothing are
/// never the same, unless they are least-squares fits.
pub(super) fn is_same_end(model: &TraceModel, end: &Iterate, other: &Iterate, sd: &[f64]) -> bool {
    let mut pairs = end.point.iter().zip(&other.point).zip(sd);
    let is_fit = |at: &Iterate| at.plain || !at.is_junk(model);
    let comparable = other.stage == end.stage && is_fit(end) && is_fit(other);
    comparable && pairs.all(|((a, b), sd)| (a - b).abs() <= SAME_END_SD * sd)
}

/// Result of the search from one start.
#[derive(Debug, Clone, PartialEq)]
pub struct TraceDescent {
    /// Number of the chain of the descent: the number of its start, counted from 0, or the maximum number of
    /// starts plus the number of its lobe.
    pub start: usize,
    /// Last iterate of each stage that was reached, in the order of the stages.
    pub stages: Vec<Iterate>,
    /// Number of iterates of the chain.
    pub iterates: usize,
}

impl TraceDescent {
    pub(crate) fn last_iterate(&self) -> Option<&Iterate> {
        self.stages.last()
    }
}
