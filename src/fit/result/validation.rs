//! Checks that a result belongs to a job; otherwise an edited or exchanged file could assign numbers to wrong
//! names.

use super::{FitResult, ParameterResult, ResultError};
use crate::fit::job::{FreeParameter, Job};
use std::collections::BTreeSet;

/// Largest allowed relative rounding error of an estimate at a bound. The error arises because the logarithm
/// of the bound is taken and inverted.
const BOUND_ROUNDING: f64 = 1e-12;

impl FitResult {
    /// Checks the result against its job: both must have the same parameters, components and features.
    /// Estimates must be within their bounds, the ends of intervals in ascending order, and standard
    /// deviations not negative. `file` is the name of the result file in error messages.
    ///
    /// # Errors
    /// [`ResultError`] with the first key that does not match.
    pub fn check_against_job(&self, job: &Job, file: &str) -> Result<(), ResultError> {
        let parameter = |free: &FreeParameter| parameter_problem(free, self.parameters.get(&free.name)?);
        let parameters = || job.parameters.iter().find_map(parameter);
        let problem = self.name_mismatch(job).or_else(parameters).or_else(|| self.negative_sd());
        problem.map_or(Ok(()), |problem| Err(ResultError { file: file.to_owned(), problem }))
    }

    /// Describes a name that occurs only in the result or only in the job.
    fn name_mismatch(&self, job: &Job) -> Option<String> {
        let parameters: BTreeSet<&str> = job.parameters.iter().map(|p| p.name.as_str()).collect();
        let features = self.features.iter().chain(&self.held_out).map(|f| f.name.as_str());
        let read = self.components.iter().map(|c| c.name.as_str()).chain(features).collect();
        let asked = job.targets.iter().map(|aim| aim.feature.name.as_str()).collect();
        let found = self.parameters.keys().map(String::as_str).collect();
        set_difference("parameters", &found, &parameters)
            .or_else(|| set_difference("components, features and held_out", &read, &asked))
    }

    /// Describes a negative standard deviation.
    fn negative_sd(&self) -> Option<String> {
        let components = self.components.iter().map(|c| ("components", &c.name, c.target_sd_hz));
        let features = self.features.iter().chain(&self.held_out).map(|f| ("features", &f.name, f.target_sd));
        let (key, name, sd) = components.chain(features).find(|(.., sd)| *sd < 0.0)?;
        Some(format!("{key}, `{name}`: found a standard deviation of {sd}, expected 0 or more"))
    }
}

fn set_difference(key: &str, found: &BTreeSet<&str>, expected: &BTreeSet<&str>) -> Option<String> {
    if let Some(name) = expected.difference(found).next() {
        return Some(format!("{key}: found no `{name}`, which the job has"));
    }
    let name = found.difference(expected).next()?;
    Some(format!("{key}: found `{name}`, which the job does not have"))
}

/// Describes a contradiction between the numbers of a parameter.
fn parameter_problem(free: &FreeParameter, found: &ParameterResult) -> Option<String> {
    let (name, lower, upper) = (&free.name, free.bounds.lower(), free.bounds.upper());
    let reach = (lower - BOUND_ROUNDING * lower.abs())..=(upper + BOUND_ROUNDING * upper.abs());
    if !reach.contains(&found.estimate) {
        return Some(format!(
            "parameters, `{name}`, estimate: found {}, expected a value within the bounds of the job, {lower} to {upper}",
            found.estimate
        ));
    }
    let intervals = [
        ("lower_95 and upper_95", found.lower_95.zip(found.upper_95)),
        ("profile_95", found.profile_95[0].zip(found.profile_95[1])),
        ("linear_95", found.linear_95.map(Into::into)),
        ("bootstrap_95", found.bootstrap_95.map(Into::into)),
    ];
    let mut known = intervals.into_iter().filter_map(|(key, ends)| Some((key, ends?)));
    let (key, (low, high)) = known.find(|(_, (low, high))| low > high)?;
    Some(format!("parameters, `{name}`, {key}: found {low} to {high}, expected the lower end first"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const JOB: &str = include_str!("../../../fits/actual-blade-twin/job.toml");
    const RESULT: &str = include_str!("../../../fits/actual-blade-twin/result.json");

    fn checked(text: &str) -> Result<(), String> {
        let job = Job::parse("job.toml", JOB).unwrap();
        serde_json::from_str::<FitResult>(text)
            .unwrap()
            .check_against_job(&job, "result.json")
            .map_err(|error| error.to_string())
    }

    #[test]
    fn a_result_is_held_against_its_job() {
        assert_eq!(checked(RESULT), Ok(()));
        for (from, to, words) in [
            (
                "\"friction.a\": {\n      \"estimate\"",
                "\"friction.x\": {\n      \"estimate\"",
                "parameters: found no `friction.a`, which the job has",
            ),
            (
                "\"name\": \"low\"",
                "\"name\": \"lower\"",
                "components, features and held_out: found no `low`, which the job has",
            ),
            (
                "\"estimate\": 0.0018",
                "\"estimate\": -0.0018",
                "`blade.neck_stiffness_n_m_per_rad`, estimate: found -0.0018",
            ),
            ("\"lower_95\": 0.0018", "\"lower_95\": 0.018", "lower_95 and upper_95: found 0.018"),
            (
                "\"target_sd_hz\": 0.4",
                "\"target_sd_hz\": -0.4",
                "components, `low`: found a standard deviation of -0.4, expected 0 or more",
            ),
        ] {
            assert!(RESULT.contains(from), "{from}");
            let refused = checked(&RESULT.replacen(from, to, 1)).unwrap_err();
            assert!(
                refused.starts_with("result.json: not the result of ") && refused.contains(words),
                "{refused}"
            );
            assert!(refused.ends_with("run `wiperlab fit` again"), "{refused}");
        }
    }
}
