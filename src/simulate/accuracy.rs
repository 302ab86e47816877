//! Work against precision: what every method errs by on a scene, and what it costs, held against a reference
//! an order tighter than the tightest tolerance.
//!
//! Errors are those of the transition times, of the deflection at common instants, and of two spectral
//! components. Times are the caller's: it keeps the clock.

mod reference;
mod sampled_run;
mod transition_lists;

use super::fixed_step_scheme::{DEFAULT_GAIN_PER_S, FixedStepLocator, FixedStepScheme};
use super::scene::{ContactLossRule, JamRule, Scene};
use super::{IntegrationMethod, SolverOptions};
pub(crate) use reference::{AccuracyRow, HIGH_COMPONENT, LOW_COMPONENT, ReferenceRun};

// What a scene is run with in a study.

/// Tolerances of a study.
pub(crate) const TOLERANCES: [f64; 9] = [1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12];
/// Fixed steps of a study, s: from a tenth of a stick-slip cycle of 1 kHz to where rounding takes over.
pub(crate) const FIXED_STEPS_S: [f64; 5] = [1e-4, 3e-5, 1e-5, 3e-6, 1e-6];
/// Tolerance of the reference.
pub(crate) const REFERENCE_TOLERANCE: f64 = 1e-13;

/// A method with what sets its error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SolverSetting {
    pub method: IntegrationMethod,
    /// Its tolerance; a fixed step has none.
    pub relative_tolerance: Option<f64>,
}

impl SolverSetting {
    /// The method's name in tables and figures.
    pub(crate) fn name(&self) -> &'static str {
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
pub(crate) fn list_settings(scene: &Scene) -> Vec<SolverSetting> {
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

// The study as CSV.

fn format_optional(value: Option<f64>) -> String {
    value.map_or_else(String::new, |v| format!("{v:e}"))
}

/// `work-precision.csv`: one row a setting; `error` is the worst error of a transition time, s, empty where
/// the list of transitions is not the reference's.
pub(crate) fn write_work_precision_csv(rows: &[AccuracyRow]) -> String {
    let row = |r: &AccuracyRow| {
        let [tolerance, step, error] =
            [r.setting.relative_tolerance, r.setting.method.step_s(), r.lists.worst_s].map(format_optional);
        let work = (r.wall_s, r.run.work.rhs_evaluations, r.run.transitions);
        format!("{},{tolerance},{step},{error},{:e},{},{}\n", r.setting.name(), work.0, work.1, work.2)
    };
    let header = "method,relative_tolerance,step_s,error,wall_s,rhs_evaluations,transitions\n";
    std::iter::once(header.to_owned()).chain(rows.iter().map(row)).collect()
}

/// `accuracy.csv`: every error of every setting. `above_reference_uncertainty` says whether the error of the
/// transition times is larger than the distance of the two references.
pub(crate) fn write_accuracy_csv(reference: &ReferenceRun<'_>, rows: &[AccuracyRow]) -> String {
    let row = |r: &AccuracyRow| {
        let [tolerance, step, error] =
            [r.setting.relative_tolerance, r.setting.method.step_s(), r.lists.worst_s].map(format_optional);
        let [low, high] = [LOW_COMPONENT, HIGH_COMPONENT].map(|i| format_optional(r.components_hz[i]));
        let sure =
            r.lists.worst_s.map_or_else(String::new, |error| reference.resolves_error(error).to_string());
        let (name, status, lists) = (r.setting.name(), r.run.status.name(), &r.lists);
        format!(
            "{name},{tolerance},{step},{status},{error},{sure},{},{},{:e},{:e},{:e},{low},{high}\n",
            lists.missed, lists.invented, r.stop_error_s, r.state_rms, r.state_worst
        )
    };
    let header = "method,relative_tolerance,step_s,status,transition_error_s,above_reference_uncertainty,missed_transitions,\
                  invented_transitions,stop_error_s,deflection_rms_relative,deflection_worst_relative,low_component_error_hz,high_component_error_hz\n";
    std::iter::once(header.to_owned()).chain(rows.iter().map(row)).collect()
}
