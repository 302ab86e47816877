//! What a scene is run with in a study.

use crate::simulate::paper::{DEFAULT_GAIN_PER_S, FixedStep, Locate};
use crate::simulate::scene::{Jam, Loss, Scene};
use crate::simulate::{Effort, Method};

/// Tolerances of a study.
pub const TOLERANCES: [f64; 9] = [1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12];
/// Fixed steps of a study, s: from a tenth of a stick-slip cycle of 1 kHz to where rounding takes over.
pub(crate) const STEPS_S: [f64; 5] = [1e-4, 3e-5, 1e-5, 3e-6, 1e-6];
/// Tolerance of the reference.
pub const REFERENCE_TOLERANCE: f64 = 1e-13;

/// A method with what sets its error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setting {
    /// The method.
    pub method: Method,
    /// Its tolerance; a fixed step has none.
    pub relative_tolerance: Option<f64>,
}

impl Setting {
    /// The method's name in tables and figures.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self.method {
            Method::FixedStep(FixedStep { locate: Locate::StepEnd, .. }) => "fixed-step-end",
            Method::FixedStep(FixedStep { locate: Locate::Slack, .. }) => "fixed-step-slack",
            adaptive => adaptive.name(),
        }
    }

    pub(super) fn effort(&self) -> Effort {
        Effort { method: self.method, ..Effort::new(self.relative_tolerance.unwrap_or(REFERENCE_TOLERANCE)) }
    }
}

/// Every setting that a scene can be run with: each adaptive method at each tolerance, then the fixed steps,
/// unless the scene flies or has impacts.
#[must_use]
pub fn settings(scene: &Scene) -> Vec<Setting> {
    let adaptive = [Method::Taylor, Method::RungeKutta, Method::Slack];
    let tolerances =
        |method| TOLERANCES.map(|relative| Setting { method, relative_tolerance: Some(relative) });
    let fixed = |locate| {
        let scheme = move |step_s| FixedStep { step_s, locate, gain_per_s: DEFAULT_GAIN_PER_S };
        STEPS_S.map(|step_s| Setting { method: Method::FixedStep(scheme(step_s)), relative_tolerance: None })
    };
    let grounded = scene.loss == Loss::Stop && scene.jam == Jam::Stop;
    let schemes = [Locate::StepEnd, Locate::Slack].into_iter().filter(|_| grounded).flat_map(fixed);
    adaptive.into_iter().flat_map(tolerances).chain(schemes).collect()
}
