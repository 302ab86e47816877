//! The trace itself, fitted in segments (multiple shooting, Bock 1981).
//!
//! One long run of a stick-slip model is so sensitive that the misfit of its trace has tens of minima.
//! Restarted every few milliseconds from the state that the recording shows, it has one. Each segment's
//! starting state is eliminated (variable projection, Golub and Pereyra 1973), so that an outer step of
//! Levenberg and Marquardt moves the parameters and what is not known of the camera alone. Segments grow
//! from stage to stage; the states of the next are those of the fitted motion.

mod assessment;
mod camera_observation;
mod checkpoint;
mod initial_states;
mod levenberg_marquardt;
mod model;
mod normal_equations;
mod search;
mod segment_simulation;
mod segmentation;
mod uncertainty_run;
mod unknowns;
mod variable_projection;

pub use assessment::{TraceAssessment, UnknownEstimate};
pub(crate) use checkpoint::Checkpoint;
pub use checkpoint::{Iterate, SegmentState, TraceSearchSettings, chi2_per_dof};
pub use levenberg_marquardt::{first_iterate, next_iterate};
pub(crate) use model::TraceSource;
pub(crate) use model::{TraceModel, TraceRecording};
pub(crate) use search::TraceDescent;
pub use search::{TraceSearchOutcome, search_trace, start_point, undersampled_mode};
pub use segment_simulation::{SegmentResiduals, segment_residuals};
pub(crate) use segment_simulation::{fit_states_at, frame_residuals};
pub(crate) use uncertainty_run::{MAX_TWINS, SearchEnd, UncertaintyRun};
pub(crate) use unknowns::{CameraUnknown, TraceUnknown, UnknownKind};
