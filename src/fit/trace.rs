//! The trace itself, fitted in segments (multiple shooting, Bock 1981).
//!
//! One long run of a stick-slip model is so sensitive that the misfit of its trace has tens of minima.
//! Restarted every few milliseconds from the state that the recording shows, it has one. Each segment's
//! starting state is eliminated (variable projection, Golub and Pereyra 1973), so that an outer step of
//! Levenberg and Marquardt moves the parameters and what is not known of the camera alone. Segments grow
//! from stage to stage; the states of the next are those of the fitted motion.

mod agreement;
mod assess;
mod at_point;
mod branch;
mod branches;
mod build;
mod chain;
mod descent;
mod eliminate;
mod film;
mod iterate;
mod keep;
mod model;
mod outer;
mod profile;
mod residual;
mod search;
mod segment;
mod shot;
mod states;
mod twin;
mod unknown;

pub use assess::{Assessment, Estimate};
pub use at_point::{at_point, frame_residuals};
pub use branch::{Branch, End, MOST_STARTS, MOST_TWINS};
pub use build::Source;
pub use chain::{advance, begin};
pub use descent::Descent;
pub use film::{Film, FilmSettings};
pub use iterate::{Iterate, SegmentState, Settings, chi2_per_dof};
pub use keep::Keep;
pub use model::{Shoot, TraceModel};
pub use outer::{Covariance, covariance};
pub use residual::{SegmentResiduals, residuals};
pub use search::{Searched, search, start_point, too_slow};
pub use unknown::{CameraUnknown, Kind, Unknown, Unknowns};
