//! The study as CSV.

use super::components::{HIGH_COMPONENT, LOW_COMPONENT};
use super::reference::{AccuracyRow, ReferenceRun};

fn format_optional(value: Option<f64>) -> String {
    value.map_or_else(String::new, |v| format!("{v:e}"))
}

/// `work-precision.csv`: one row a setting; `error` is the worst error of a transition time, s, empty where
/// the list of transitions is not the reference's.
#[must_use]
pub fn write_work_precision_csv(rows: &[AccuracyRow]) -> String {
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
#[must_use]
pub fn write_accuracy_csv(reference: &ReferenceRun<'_>, rows: &[AccuracyRow]) -> String {
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
