//! The names that a first program needs: `use wiperlab::prelude::*`. The front page of the crate shows them
//! in use, from a tracking export to a report.

pub use crate::fit::job::Job;
pub use crate::fit::result::FitResult;
pub use crate::fit::{FitContext, FitError, MeasuredRecording, Problem, ProblemError};
pub use crate::import::source::ImportSource;
pub use crate::import::{CoordinateScale, ImportError, ImportOptions, import};
pub use crate::recording::Recording;
pub use crate::recording::channel::{Channel, ReversalInstants, Window};
pub use crate::recording::files::YAxis;
pub use crate::report::Report;
pub use crate::simulate::outputs::Transitions;
pub use crate::simulate::scene::Scene;
pub use crate::simulate::{RunResult, RunStatus, Transition, TransitionCause, run_scene};
pub use short_spectra::{Component, SampledRecord, SpectralAnalysis, SpectrumSettings};
