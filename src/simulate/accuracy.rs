//! Work-precision study: error and cost of every method on a scene, relative to a reference run whose
//! tolerance is a tenth of the tightest tolerance studied.
//!
//! The study compares transition times, the deflection at common times, and two spectral components. The
//! caller measures the run times.

mod reference;
mod sampled_run;
mod transition_lists;

use super::fixed_step_scheme::{DEFAULT_GAIN_PER_S, FixedStepLocator, FixedStepScheme};
use super::scene::Scene;
use super::scene::contact::{ContactLossRule, JamRule};
use super::{IntegrationMethod, SolverOptions};
pub(crate) use reference::{AccuracyRow, HIGH_COMPONENT, LOW_COMPONENT, ReferenceRun};

/// Relative tolerances of the studied runs.
pub(crate) const TOLERANCES: [f64; 9] = [1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12];
/// Fixed steps of the studied runs, s: from a tenth of a stick-slip cycle of 1 kHz down to the limit of
/// rounding.
pub(crate) const FIXED_STEPS_S: [f64; 5] = [1e-4, 3e-5, 1e-5, 3e-6, 1e-6];
/// Relative tolerance of the reference run.
pub(crate) const REFERENCE_TOLERANCE: f64 = 1e-13;

/// A solver setting: a method with its tolerance or step size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SolverSetting {
    pub method: IntegrationMethod,
    /// Relative tolerance; `None` for a method with fixed steps.
    pub relative_tolerance: Option<f64>,
}

impl SolverSetting {
    /// Name of the setting in tables and figures.
    pub(crate) fn name(&self) -> &'static str {
        match self.method {
            IntegrationMethod::FixedStep(scheme) => match scheme.locate {
                FixedStepLocator::StepEnd => "fixed-step-end",
                FixedStepLocator::Slack => "fixed-step-slack",
            },
            adaptive => adaptive.name(),
        }
    }

    pub(super) fn solver_options(&self) -> SolverOptions {
        let relative_tolerance = self.relative_tolerance.unwrap_or(REFERENCE_TOLERANCE);
        SolverOptions { method: self.method, ..SolverOptions::new(relative_tolerance) }
    }
}

/// All solver settings for a scene: each adaptive method with each tolerance, then the schemes with fixed
/// steps. The fixed steps are left out if the scene allows flight or impacts.
pub(crate) fn list_settings(scene: &Scene) -> Vec<SolverSetting> {
    let adaptive = [IntegrationMethod::Taylor, IntegrationMethod::RungeKutta, IntegrationMethod::Slack];
    let tolerances =
        |method| TOLERANCES.map(|relative| SolverSetting { method, relative_tolerance: Some(relative) });
    let fixed = |locate| {
        FIXED_STEPS_S.map(|step_s| {
            let scheme = FixedStepScheme { step_s, locate, gain_per_s: DEFAULT_GAIN_PER_S };
            SolverSetting { method: IntegrationMethod::FixedStep(scheme), relative_tolerance: None }
        })
    };
    let grounded = scene.loss == ContactLossRule::Stop && scene.jam == JamRule::Stop;
    let schemes =
        [FixedStepLocator::StepEnd, FixedStepLocator::Slack].into_iter().filter(|_| grounded).flat_map(fixed);
    adaptive.into_iter().flat_map(tolerances).chain(schemes).collect()
}

// Tables of a study.

fn format_optional(value: Option<f64>) -> String {
    value.map_or_else(String::new, |v| format!("{v:e}"))
}

/// Table cells of a solver setting: tolerance, step, and largest error of a transition time, s.
fn setting_cells(row: &AccuracyRow) -> [String; 3] {
    let AccuracyRow { setting, lists, .. } = row;
    [setting.relative_tolerance, setting.method.step_s(), lists.worst_s].map(format_optional)
}

/// `work-precision.csv`: one row per setting. `error` is the largest error of a transition time, s; it is
/// empty if the transitions differ from those of the reference.
pub(crate) fn write_work_precision_csv(rows: &[AccuracyRow]) -> String {
    let row = |r: &AccuracyRow| {
        let [tolerance, step, error] = setting_cells(r);
        let work = (r.wall_s, r.run.work.rhs_evaluations, r.run.transitions);
        format!("{},{tolerance},{step},{error},{:e},{},{}\n", r.setting.name(), work.0, work.1, work.2)
    };
    let header = "method,relative_tolerance,step_s,error,wall_s,rhs_evaluations,transitions\n";
    std::iter::once(header.to_owned()).chain(rows.iter().map(row)).collect()
}

/// `accuracy.csv`: all errors of every setting. `above_reference_uncertainty` says whether the error of the
/// transition times exceeds the difference between the two reference runs.
pub(crate) fn write_accuracy_csv(reference: &ReferenceRun<'_>, rows: &[AccuracyRow]) -> String {
    let row = |r: &AccuracyRow| {
        let [tolerance, step, error] = setting_cells(r);
        let [low, high] = [LOW_COMPONENT, HIGH_COMPONENT].map(|i| format_optional(r.components_hz[i]));
        let sure = r.lists.worst_s.map(|error| reference.resolves_error(error).to_string());
        let sure = sure.unwrap_or_default();
        let (name, status, lists) = (r.setting.name(), r.run.status.name(), &r.lists);
        let [predicted, undetermined] =
            [r.predicted_time_error_s, r.undetermined_after_s].map(format_optional);
        format!(
            "{name},{tolerance},{step},{status},{error},{sure},{},{},{:e},{:e},{:e},{low},{high},{predicted},{undetermined}\n",
            lists.missed, lists.invented, r.stop_error_s, r.state_rms, r.state_worst
        )
    };
    let header = "method,relative_tolerance,step_s,status,transition_error_s,above_reference_uncertainty,missed_transitions,\
                  invented_transitions,stop_error_s,deflection_rms_relative,deflection_worst_relative,low_component_error_hz,high_component_error_hz,predicted_time_error_s,undetermined_after_s\n";
    std::iter::once(header.to_owned()).chain(rows.iter().map(row)).collect()
}
