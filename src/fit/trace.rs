//! Fit of whole traces in segments (multiple shooting, Bock 1981).
//!
//! A long run of a stick-slip model is so sensitive that the misfit of its trace has tens of minima. If the
//! model restarts from the recorded state every few milliseconds, the misfit has one minimum. The starting
//! state of each segment is eliminated from the least-squares problem (variable projection, Golub and Pereyra
//! 1973), so an outer Levenberg-Marquardt step moves only the parameters and the unknowns of the cameras.
//! Segments grow longer from stage to stage; each new stage starts from the motion that the previous stage
//! has fitted.

mod assessment;
pub(crate) mod build;
mod camera_observation;
mod fitted_traces;
mod head_errors;
mod initial_states;
mod iterate;
mod levenberg_marquardt;
mod lobes;
mod model;
mod normal_equations;
mod prior_conflict;
mod projection;
mod rivals;
mod search;
mod segment_simulation;
mod segmentation;
mod slider_start;
mod uncertainty_run;
mod unknowns;
mod variable_projection;

pub use assessment::{TraceAssessment, UnknownEstimate};
pub(crate) use build::{TraceSource, fit_states_at, frame_residuals};
pub(crate) use fitted_traces::{FittedTraces, first_fitting};
pub(crate) use head_errors::chi2_by_head_errors;
pub(crate) use iterate::TraceDescent;
pub use iterate::{Iterate, SegmentState, TraceSearchSettings, chi2_per_dof};
pub use levenberg_marquardt::{first_iterate, next_iterate};
pub(crate) use levenberg_marquardt::{follow_stages, outer_step, restart_search, start_stage};
pub use model::{TraceModel, TraceRecording};
pub(crate) use normal_equations::trace_covariance;
pub use search::{TraceSearchOutcome, search_trace, start_point, undersampled_mode};
pub use segment_simulation::{SegmentResiduals, segment_residuals};
pub(crate) use segmentation::{describe_start_limits, first_segment_s};
pub(crate) use uncertainty_run::{MAX_TWINS, SearchEnd, Z_95};
pub(crate) use unknowns::CameraUnknown;
pub use unknowns::{TraceUnknown, UnknownKind};
