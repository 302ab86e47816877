//! Data and unknowns of a trace fit.

use super::camera_observation::CameraObservation;
use super::unknowns::TraceUnknowns;
use crate::recording::noise::RecordingNoise;
use crate::simulate::scene::Scene;
use std::sync::Arc;

/// A recording and the scene that is fitted to it.
#[derive(Clone)]
pub struct TraceRecording {
    /// Index of the condition of the job to which the recording belongs.
    pub condition: usize,
    /// The scene, whose drive moves the head of the model.
    pub scene: Scene,
    /// What the camera shows in the fitted frames.
    pub observation: CameraObservation,
    /// Noise that was measured on the recording.
    pub(crate) noise: Arc<RecordingNoise>,
}

/// Recordings, scenes and unknowns of a trace fit.
#[derive(Clone)]
pub struct TraceModel {
    /// The recordings, each with its scene.
    pub recordings: Vec<TraceRecording>,
    /// All unknowns except the starting states.
    pub unknowns: TraceUnknowns,
}
