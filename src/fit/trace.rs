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

pub use assess::{TraceAssessment, UnknownEstimate};
pub use at_point::{fit_states_at, frame_residuals};
pub use branch::{MAX_STARTS, MAX_TWINS, SearchEnd, UncertaintyRun};
pub use build::TraceSource;
pub use chain::{first_iterate, next_iterate};
pub use descent::TraceDescent;
pub use film::{CameraObservation, ObservationSettings};
pub use iterate::{Iterate, SegmentState, TraceSearchSettings, chi2_per_dof};
pub use keep::Checkpoint;
pub use model::{TraceModel, TraceRecording};
pub use outer::{TraceCovariance, trace_covariance};
pub use residual::{SegmentResiduals, segment_residuals};
pub use search::{TraceSearchOutcome, search_trace, start_point, undersampled_mode};
pub use unknown::{CameraUnknown, TraceUnknown, TraceUnknowns, UnknownKind};
