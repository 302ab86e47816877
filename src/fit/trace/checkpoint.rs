//! What keeps the iterates of a search.

use super::segment_simulation::LinkState;
use std::ops::ControlFlow;

/// What keeps the iterates of a search, in order: a journal, or nothing.
pub trait Checkpoint {
    /// The iterate that a chain had at a place, where it is known already.
    fn find_iterate(&mut self, chain: usize, place: usize) -> Option<Iterate>;
    /// A new iterate of a chain; `Break` ends the search.
    fn store_iterate(&mut self, chain: usize, place: usize, iterate: &Iterate) -> ControlFlow<()>;
}

impl Checkpoint for () {
    fn find_iterate(&mut self, _: usize, _: usize) -> Option<Iterate> {
        None
    }

    fn store_iterate(&mut self, _: usize, _: usize, _: &Iterate) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

// What a search passes on from step to step.

/// How a trace is searched.
#[derive(Debug, Clone, PartialEq)]
pub struct TraceSearchSettings {
    /// Length of the segments in each stage, s, rising.
    pub segment_s: Vec<f64>,
    /// Number of twins of the end that are fitted again.
    pub twins: usize,
}

/// A segment: its frames, its starting state and how it fits.
#[derive(Debug, Clone, PartialEq)]
pub struct SegmentState {
    /// Number of the recording.
    pub recording: usize,
    /// First frame.
    pub first: usize,
    /// Frame before which it ends.
    pub last: usize,
    /// Angles and rates of neck and lip at its start, rad and rad/s.
    pub start: [f64; 4],
    /// The same as the recording shows them.
    pub shown: [f64; 4],
    /// Sum of squared residuals; infinite where the model's run fails.
    pub chi2: f64,
    /// Number of data.
    pub data: usize,
}

impl SegmentState {
    pub(super) fn start_state(&self) -> LinkState {
        LinkState::from(self.start)
    }

    pub(super) fn recorded_state(&self) -> LinkState {
        LinkState::from(self.shown)
    }

    pub(super) fn set_start_state(&mut self, state: &LinkState) {
        self.start = (*state).into();
    }

    /// Whether its misfit is beyond anything that noise explains.
    pub(crate) fn is_bad(&self) -> bool {
        self.chi2 >= 2.0 * self.data as f64
    }
}

/// One accepted step of the search.
#[derive(Debug, Clone, PartialEq)]
pub struct Iterate {
    /// Number of the stage.
    pub stage: usize,
    /// Number of the step within the stage.
    pub number: usize,
    /// How often the segments of this stage were cut anew.
    pub cuts: usize,
    /// How often segments that did not fit were tried from elsewhere at the end of this stage.
    pub rescues: usize,
    /// Whether segments count plainly, not robustly.
    pub plain: bool,
    /// Whether the stage has converged.
    pub settled: bool,
    /// Damping of the next step.
    pub damping: f64,
    /// Coordinates of the unknowns.
    pub point: Vec<f64>,
    /// The segments.
    pub segments: Vec<SegmentState>,
    /// Cost: that of the segments and the priors.
    pub cost: f64,
}

/// Chi2 over degrees of freedom of an iterate.
#[must_use]
pub fn chi2_per_dof(at: &Iterate) -> (f64, usize) {
    let chi2: f64 = at.segments.iter().map(|segment| segment.chi2).sum();
    let data: usize = at.segments.iter().map(|segment| segment.data).sum();
    let dof = data.saturating_sub(4 * at.segments.len() + at.point.len()).max(1);
    (chi2 / dof as f64, dof)
}
