//! One component or feature of a job: its keys, checked one by one.

use super::aim::Source;
use super::as_written::Which;
use super::conditions::Condition;
use super::refusal::{Refusal, refuse};
use crate::feature::Measure;
use crate::toml_file::nearest;

/// Least standard deviation relative to a target: beyond what any camera gives, and far from overflow of a
/// squared residual.
const LEAST_SD_RELATIVE: f64 = 1e-9;

/// A component or feature, for messages.
pub(super) struct Entry {
    pub(super) what: String,
}

/// The recording or condition that an entry belongs to.
pub(super) struct Place {
    /// Counted from 0.
    pub index: usize,
    /// Whether there is a recording on which a target can be measured.
    pub measured: bool,
    pub held_out: bool,
    /// Half the rate of the job's own camera, Hz, where the condition is seen through it.
    pub nyquist_hz: Option<f64>,
}

impl Entry {
    pub(super) fn key(&self, key: &str) -> String {
        format!("{}, `{key}`", self.what)
    }

    pub(super) fn given(
        &self,
        target: f64,
        sd: f64,
        sd_key: &str,
        measure: Measure,
    ) -> Result<Source, Refusal> {
        let least = match measure {
            Measure::Log if !(target.is_finite() && target != 0.0) => {
                return refuse(
                    self.key("target"),
                    format!(
                        "found {target}, expected a finite number that is not 0 (residuals are logarithms)"
                    ),
                );
            }
            Measure::Log => LEAST_SD_RELATIVE * target.abs(),
            Measure::Linear { .. } if !target.is_finite() => {
                return refuse(self.key("target"), format!("found {target}, expected a finite number"));
            }
            Measure::Linear { scale } => LEAST_SD_RELATIVE * scale,
        };
        if !(sd.is_finite() && sd >= least) {
            return refuse(
                self.key(sd_key),
                format!("found {sd}, expected a finite number of at least {least:e}"),
            );
        }
        Ok(Source::Given { target, sd })
    }

    pub(super) fn relative_sd(&self, found: f64) -> Result<f64, Refusal> {
        if found.is_finite() && found >= LEAST_SD_RELATIVE {
            return Ok(found);
        }
        refuse(
            self.key("sd_relative"),
            format!(
                "found {found}, expected a finite number of at least {LEAST_SD_RELATIVE:e}; 0.05 means 5 % of the measured value"
            ),
        )
    }

    /// The recording or condition of that number, counted from 1, or name; the first where there is neither.
    pub(super) fn place(
        &self,
        which: Option<&Which>,
        conditions: &[Condition],
        nyquist_hz: Option<f64>,
    ) -> Result<Place, Refusal> {
        let (key, most) = (self.key("recording"), conditions.len());
        let index = match which {
            None => 0,
            Some(Which::Number(number)) if (1..=most).contains(number) => number - 1,
            Some(Which::Number(number)) => {
                return refuse(
                    key,
                    format!(
                        "found {number}, expected 1 to {most}: recordings, then conditions, are counted from 1 in the order of the file"
                    ),
                );
            }
            Some(Which::Name(name)) => {
                let names: Vec<&str> = conditions.iter().map(|c| c.name.as_str()).collect();
                let unknown = || {
                    refuse(
                        key,
                        format!("no recording or condition is called `{name}`; {}", nearest(name, &names)),
                    )
                };
                conditions.iter().position(|c| c.name == *name).map_or_else(unknown, Ok)?
            }
        };
        let Some(condition) = conditions.get(index) else {
            return refuse(self.key("recording"), "there is no recording and no condition");
        };
        let measured = condition.recording.is_some();
        Ok(Place {
            index,
            measured,
            held_out: condition.held_out,
            nyquist_hz: nyquist_hz.filter(|_| !measured),
        })
    }
}
