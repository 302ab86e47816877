//! What a scene is run with in a study.

use crate::simulate::paper::{DEFAULT_GAIN_PER_S, FixedStepLocator, FixedStepScheme};
use crate::simulate::scene::{ContactLossRule, JamRule, Scene};
use crate::simulate::{IntegrationMethod, SolverOptions};

/// Tolerances of a study.
pub const TOLERANCES: [f64; 9] = [1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12];
/// Fixed steps of a study, s: from a tenth of a stick-slip cycle of 1 kHz to where rounding takes over.
pub(crate) const FIXED_STEPS_S: [f64; 5] = [1e-4, 3e-5, 1e-5, 3e-6, 1e-6];
/// Tolerance of the reference.
pub const REFERENCE_TOLERANCE: f64 = 1e-13;

/// A method with what sets its error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolverSetting {
    /// The method.
    pub method: IntegrationMethod,
    /// Its tolerance; a fixed step has none.
    pub relative_tolerance: Option<f64>,
}

impl SolverSetting {
    /// The method's name in tables and figures.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self.method {
            IntegrationMethod::FixedStep(FixedStepScheme { locate: FixedStepLocator::StepEnd, .. }) => {
                "fixed-step-end"
            }
            IntegrationMethod::FixedStep(FixedStepScheme { locate: FixedStepLocator::Slack, .. }) => {
                "fixed-step-slack"
            }
            adaptive => adaptive.name(),
        }
    }

    pub(super) fn solver_options(&self) -> SolverOptions {
        SolverOptions {
            method: self.method,
            ..SolverOptions::new(self.relative_tolerance.unwrap_or(REFERENCE_TOLERANCE))
        }
    }
}

/// Every setting that a scene can be run with: each adaptive method at each tolerance, then the fixed steps,
/// unless the scene flies or has impacts.
#[must_use]
pub fn list_settings(scene: &Scene) -> Vec<SolverSetting> {
    let adaptive = [IntegrationMethod::Taylor, IntegrationMethod::RungeKutta, IntegrationMethod::Slack];
    let tolerances =
        |method| TOLERANCES.map(|relative| SolverSetting { method, relative_tolerance: Some(relative) });
    let fixed = |locate| {
        let scheme = move |step_s| FixedStepScheme { step_s, locate, gain_per_s: DEFAULT_GAIN_PER_S };
        FIXED_STEPS_S.map(|step_s| SolverSetting {
            method: IntegrationMethod::FixedStep(scheme(step_s)),
            relative_tolerance: None,
        })
    };
    let grounded = scene.loss == ContactLossRule::Stop && scene.jam == JamRule::Stop;
    let schemes =
        [FixedStepLocator::StepEnd, FixedStepLocator::Slack].into_iter().filter(|_| grounded).flat_map(fixed);
    adaptive.into_iter().flat_map(tolerances).chain(schemes).collect()
}
