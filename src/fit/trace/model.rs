//! What a trace fit works on.

use super::film::Film;
use super::unknown::Unknowns;
use crate::simulate::scene::Scene;

/// A recording with the scene that it is fitted with.
#[derive(Clone)]
pub struct Shoot {
    /// The scene; its drive is the one that the model runs on.
    pub scene: Scene,
    /// The recording.
    pub film: Film,
}

/// Everything that decides a trace fit but the search's settings.
#[derive(Clone)]
pub struct TraceModel {
    /// One a recording.
    pub shoots: Vec<Shoot>,
    /// What is estimated besides starting states.
    pub unknowns: Unknowns,
}
