//! The trace itself, fitted in segments (multiple shooting, Bock 1981).
//!
//! One long run of a stick-slip model is so sensitive that the misfit of its trace has tens of minima.
//! Restarted every few milliseconds from the state that the recording shows, it has one. Each segment's
//! starting state is eliminated (variable projection, Golub and Pereyra 1973), so that an outer step of
//! Levenberg and Marquardt moves the parameters and what is not known of the camera alone. Segments grow
//! from stage to stage; the states of the next are those of the fitted motion.

mod assess;
mod build;
mod chain;
mod descent;
mod eliminate;
mod film;
mod outer;
mod profile;
mod residual;
mod search;
mod segment;
mod shot;
mod states;
mod unknown;

pub use assess::{Assessment, Estimate, chi2_per_dof};
pub use build::Source;
pub use chain::{Iterate, SegmentState, Settings, advance, begin};
pub use descent::Descent;
pub use film::{Film, FilmSettings};
pub use outer::{Covariance, covariance};
pub use residual::{SegmentResiduals, residuals};
pub use search::{Keep, Searched, search, start_point};
pub use unknown::{CameraUnknown, Kind, Unknown, Unknowns};

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
pub struct TraceModel {
    /// One a recording.
    pub shoots: Vec<Shoot>,
    /// What is estimated besides starting states.
    pub unknowns: Unknowns,
}
