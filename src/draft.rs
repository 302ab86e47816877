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

pub use fitted::{Fitted, fitted_scene};
pub use found::{Found, FoundComponent, NotUsable};
pub use job::job;
pub use plan::{PLAN, Role};
pub use scene::{YOURS, scene, scene_alone};
pub use stroke::{KnownStroke, Stroke};
