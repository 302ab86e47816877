//! Data and unknowns of a trace fit.

use super::camera_observation::CameraObservation;
use super::unknowns::TraceUnknowns;
use crate::simulate::scene::Scene;

/// A recording with the scene that it is fitted with.
#[derive(Clone)]
pub struct TraceRecording {
    /// The scene; its drive is the one that the model runs on.
    pub scene: Scene,
    pub observation: CameraObservation,
}

/// Recordings, scenes and unknowns of a trace fit.
#[derive(Clone)]
pub struct TraceModel {
    pub recordings: Vec<TraceRecording>,
    /// Unknowns besides starting states.
    pub unknowns: TraceUnknowns,
}
