//! What a trace fit works on.

use super::film::CameraObservation;
use super::unknown::TraceUnknowns;
use crate::simulate::scene::Scene;

/// A recording with the scene that it is fitted with.
#[derive(Clone)]
pub struct TraceRecording {
    /// The scene; its drive is the one that the model runs on.
    pub scene: Scene,
    /// The recording.
    pub observation: CameraObservation,
}

/// Everything that decides a trace fit but the search's settings.
#[derive(Clone)]
pub struct TraceModel {
    /// One a recording.
    pub recordings: Vec<TraceRecording>,
    /// What is estimated besides starting states.
    pub unknowns: TraceUnknowns,
}
