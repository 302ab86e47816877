//! A first scene and a first job for a recording, with comments: what was found in the recording, why each
//! number was chosen, and which numbers only the user can give.
//!
//! The blade is that of the bundled example. What a job can find in any recording (friction, stiffness,
//! damping) starts there and is free within wide bounds; what has to be measured on the blade (lengths,
//! masses, preload) is marked.

mod commented;
mod fitted;
mod found;
mod job;
mod plan;
mod scene;
mod stroke;

pub use fitted::{FittedScene, write_fitted_scene};
pub use found::{DraftComponent, DraftError, DraftFindings};
pub use job::write_job;
pub use plan::{PARAMETER_PLAN, ParameterRole};
pub use scene::{YOURS_MARK, write_scene, write_scene_alone};
pub use stroke::{KnownStroke, Stroke};
