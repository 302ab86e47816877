//! One component or feature of a job: its keys, checked one by one.

use super::aim::TargetSource;
use super::as_written::ConditionReference;
use super::conditions::JobCondition;
use super::refusal::{JobRefusal, refuse};
use crate::feature::ValueComparison;
use crate::toml_file::suggest_key;

/// Least standard deviation relative to a target: beyond what any camera gives, and far from overflow of a
/// squared residual.
const MIN_SD_RELATIVE: f64 = 1e-9;

/// A component or feature, for messages.
pub(super) struct JobEntry {
    pub(super) what: String,
}

/// The recording or condition that an entry belongs to.
pub(super) struct EntryCondition {
    /// Counted from 0.
    pub index: usize,
    /// Whether there is a recording on which a target can be measured.
    pub measured: bool,
    pub held_out: bool,
    /// Half the rate of the job's own camera, Hz, where the condition is seen through it.
    pub nyquist_hz: Option<f64>,
}

impl JobEntry {
    pub(super) fn key_path(&self, key: &str) -> String {
        format!("{}, `{key}`", self.what)
    }

    pub(super) fn given_source(
        &self,
        target: f64,
        sd: f64,
        sd_key: &str,
        measure: ValueComparison,
    ) -> Result<TargetSource, JobRefusal> {
        let least = match measure {
            ValueComparison::Log if !(target.is_finite() && target != 0.0) => {
                return refuse(
                    self.key_path("target"),
                    format!(
                        "found {target}, expected a finite number that is not 0 (residuals are logarithms)"
                    ),
                );
            }
            ValueComparison::Log => MIN_SD_RELATIVE * target.abs(),
            ValueComparison::Linear { .. } if !target.is_finite() => {
                return refuse(self.key_path("target"), format!("found {target}, expected a finite number"));
            }
            ValueComparison::Linear { scale } => MIN_SD_RELATIVE * scale,
        };
        if !(sd.is_finite() && sd >= least) {
            return refuse(
                self.key_path(sd_key),
                format!("found {sd}, expected a finite number of at least {least:e}"),
            );
        }
        Ok(TargetSource::Given { target, sd })
    }

    pub(super) fn check_relative_sd(&self, found: f64) -> Result<f64, JobRefusal> {
        if found.is_finite() && found >= MIN_SD_RELATIVE {
            return Ok(found);
        }
        refuse(
            self.key_path("sd_relative"),
            format!(
                "found {found}, expected a finite number of at least {MIN_SD_RELATIVE:e}; 0.05 means 5 % of the measured value"
            ),
        )
    }

    /// The recording or condition of that number, counted from 1, or name; the first where there is neither.
    pub(super) fn find_condition(
        &self,
        which: Option<&ConditionReference>,
        conditions: &[JobCondition],
        nyquist_hz: Option<f64>,
    ) -> Result<EntryCondition, JobRefusal> {
        let (key, most) = (self.key_path("recording"), conditions.len());
        let index = match which {
            None => 0,
            Some(ConditionReference::Number(number)) if (1..=most).contains(number) => number - 1,
            Some(ConditionReference::Number(number)) => {
                return refuse(
                    key,
                    format!(
                        "found {number}, expected 1 to {most}: recordings, then conditions, are counted from 1 in the order of the file"
                    ),
                );
            }
            Some(ConditionReference::Name(name)) => {
                let names: Vec<&str> = conditions.iter().map(|c| c.name.as_str()).collect();
                let unknown = || {
                    refuse(
                        key,
                        format!(
                            "no recording or condition is called `{name}`; {}",
                            suggest_key(name, &names)
                        ),
                    )
                };
                conditions.iter().position(|c| c.name == *name).map_or_else(unknown, Ok)?
            }
        };
        let Some(condition) = conditions.get(index) else {
            return refuse(self.key_path("recording"), "there is no recording and no condition");
        };
        let measured = condition.recording.is_some();
        Ok(EntryCondition {
            index,
            measured,
            held_out: condition.held_out,
            nyquist_hz: nyquist_hz.filter(|_| !measured),
        })
    }
}
