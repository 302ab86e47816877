//! Components and features of a job: how each is computed, and where its target comes from.

use super::as_written::ConditionReference;
use super::checks::{check_non_empty, find_repeated};
use super::conditions::JobCondition;
use super::{KeyRefusal, as_written, check_above_zero};
use crate::feature;
use crate::feature::{FREQUENCY_SD_FLOOR, Feature, Keys, Reading, ReadingKind, ValueComparison};
use crate::toml_file::suggest_key;
use serde::Serialize;

/// Default standard deviation of the logarithm of a spectral level: the scatter of a periodogram that is
/// averaged over a few frequency resolutions.
const LEVEL_SD_RELATIVE: f64 = 0.3;

/// Default relative tolerance of a component's frequency: the accuracy goal of this program, 2 %.
pub(super) const TOLERANCE_RELATIVE: f64 = 0.02;

/// Checks components, then features, each in the order of the file. `nyquist_hz` is half the frame rate of
/// the camera in the job, for conditions without a recording.
pub(super) fn check_targets(
    written: &as_written::JobFile,
    conditions: &[JobCondition],
    nyquist_hz: Option<f64>,
) -> Result<Vec<FitTarget>, KeyRefusal> {
    let component = |c| check_component(c, conditions, nyquist_hz);
    let mut aims = written.component.iter().map(component).collect::<Result<Vec<_>, _>>()?;
    for entry in &written.feature {
        aims.extend(check_feature(entry, conditions, nyquist_hz)?);
    }
    let traced = !written.trace.is_empty();
    if aims.is_empty() && !traced {
        refuse!(
            "component",
            "found none, and no [[feature]] or [[trace]]; expected at least one thing to fit: add a [[trace]]"
        );
    }
    if aims.iter().all(|aim| aim.held_out) && !traced {
        refuse!(
            "component",
            "every [[component]] and [[feature]] belongs to something that is held out; expected at least one thing to fit"
        );
    }
    match find_repeated(aims.iter().map(|aim| aim.feature.name.as_str())) {
        Some(name) => refuse!(
            format!("component or feature `{name}`"),
            "the name is used twice; give each its own `name`"
        ),
        None => Ok(aims),
    }
}

fn check_component(
    written: &as_written::JobComponentTable,
    conditions: &[JobCondition],
    nyquist_hz: Option<f64>,
) -> Result<FitTarget, KeyRefusal> {
    let entry = JobEntry { what: format!("component `{}`", written.name) };
    let name = check_non_empty("component, `name`", &written.name, "a name such as \"low\"")?;
    let (index, condition) = entry.find_condition(written.recording.as_ref(), conditions)?;
    let band = reading_entry(&entry, &written.reading_keys(), condition, nyquist_hz).parse_band()?;
    let positive = |key: &str, found| check_above_zero(entry.key_path(key), found);
    let sd = written.target_sd_hz.map(|sd| positive("target_sd_hz", sd)).transpose()?;
    let source = match (written.target_hz, sd) {
        (Some(target), Some(sd)) => {
            entry.given_source(positive("target_hz", target)?, sd, "target_sd_hz", ValueComparison::Log)?
        }
        (Some(_), None) => {
            let key = entry.key_path("target_sd_hz");
            refuse!(key, "missing; a given `target_hz` needs its standard deviation")
        }
        (None, _) if condition.recording.is_none() => {
            let key = entry.key_path("target_hz");
            refuse!(key, "missing; without a [[recording]] expected `target_hz` and `target_sd_hz`")
        }
        (None, sd) => {
            TargetSource::Measured { least_sd: sd.unwrap_or(0.0), least_sd_relative: FREQUENCY_SD_FLOOR }
        }
    };
    let tolerance = written.tolerance_relative.unwrap_or(TOLERANCE_RELATIVE);
    let tolerance = positive("tolerance_relative", tolerance)?;
    let feature = Feature { name, reading: Reading::Frequency(band), condition: index };
    let (held_out, stage) = (condition.held_out, TargetStage::Always);
    Ok(FitTarget { feature, source, tolerance_relative: Some(tolerance), held_out, stage })
}

fn check_feature(
    written: &as_written::Feature,
    conditions: &[JobCondition],
    nyquist_hz: Option<f64>,
) -> Result<Vec<FitTarget>, KeyRefusal> {
    let kind = find_feature_kind(written)?;
    let name = written.name.clone().unwrap_or_else(|| kind.word.to_owned());
    check_non_empty("feature, `name`", &name, "a name, or no such key")?;
    let entry = JobEntry { what: format!("feature `{name}` ({})", kind.word) };
    let (index, condition) = entry.find_condition(written.recording.as_ref(), conditions)?;
    let keys = written.keys();
    let readings = kind.make_readings(&name, &reading_entry(&entry, &keys, condition, nyquist_hz))?;
    let (held_out, measured) = (condition.held_out, condition.recording.is_some());
    if kind.is_series() {
        check_series(&entry, written, measured)?;
    }
    let aim = |(name, reading): (String, Reading)| {
        let source = target_source(&entry, written, &reading, measured)?;
        let stage =
            if let Reading::BandLevel { .. } = reading { TargetStage::Last } else { TargetStage::Always };
        let feature = Feature { name, reading, condition: index };
        Ok(FitTarget { feature, source, tolerance_relative: None, held_out, stage })
    };
    readings.into_iter().map(aim).collect()
}

/// The kind of a feature; refuses a kind that exists only for a simulated run, and a frequency, which must be
/// written as a component.
fn find_feature_kind(written: &as_written::Feature) -> Result<&'static ReadingKind, KeyRefusal> {
    let name = written.name.as_ref().map_or_else(String::new, |name| format!(" `{name}`"));
    let key = format!("feature{name}, `kind`");
    match ReadingKind::find(&written.kind) {
        Ok(kind) if kind.is_of_run() => {
            let word = kind.word;
            refuse!(
                key,
                "found \"{word}\", which only a simulated run shows; map it in a study, or remove it"
            )
        }
        Ok(ReadingKind { word: "frequency", .. }) => refuse!(
            key,
            "found \"frequency\", which is a [[component]] with a `tolerance_relative`; write it as one"
        ),
        Ok(kind) => Ok(kind),
        Err(problem) => refuse!(key, "{problem}"),
    }
}

/// Checks an entry that defines a series of features. Each feature of the series has a different target, so
/// the targets must be measured on a recording.
fn check_series(entry: &JobEntry, written: &as_written::Feature, measured: bool) -> Result<(), KeyRefusal> {
    if !measured {
        refuse!(
            entry.key_path("kind"),
            "found without a [[recording]], expected one on which its targets are measured; give each as a feature of its own"
        );
    }
    if written.target.is_some() || written.target_sd.is_some() {
        refuse!(
            entry.key_path("target"),
            "one target has no meaning for several features, which are measured on the recording; remove it"
        );
    }
    Ok(())
}

/// The keys of an entry that define how the feature of this entry is computed.
fn reading_entry<'a>(
    entry: &'a JobEntry,
    keys: &'a Keys,
    condition: &JobCondition,
    nyquist_hz: Option<f64>,
) -> feature::ReadingEntry<'a> {
    let nyquist_hz = nyquist_hz.filter(|_| condition.recording.is_none());
    feature::ReadingEntry { name: &entry.what, noun: "feature", keys, nyquist_hz, noisy: true }
}

fn target_source(
    entry: &JobEntry,
    written: &as_written::Feature,
    reading: &Reading,
    measured: bool,
) -> Result<TargetSource, KeyRefusal> {
    let measure = reading.comparison();
    match (written.target, written.target_sd, written.sd_relative) {
        (Some(target), Some(sd), None) => entry.given_source(target, sd, "target_sd", measure),
        (None, None, _) if !measured => refuse!(
            entry.key_path("target"),
            "missing; without a [[recording]] expected `target` and `target_sd`"
        ),
        (None, None, relative) => {
            let relative = relative.map(|relative| entry.check_relative_sd(relative)).transpose()?;
            Ok(measured_source(measure, relative.unwrap_or_else(|| default_min_sd_relative(reading))))
        }
        _ => refuse!(
            entry.key_path("sd_relative"),
            "expected either `sd_relative` or nothing (the target is measured on the recording), or `target` and `target_sd` together"
        ),
    }
}

/// Source of a measured target. `relative` is the lower limit of the standard deviation of the target. It is
/// a fraction of the target if values are compared by logarithms, or else a fraction of the difference that
/// counts as large.
fn measured_source(measure: ValueComparison, relative: f64) -> TargetSource {
    match measure {
        ValueComparison::Log => TargetSource::Measured { least_sd: 0.0, least_sd_relative: relative },
        ValueComparison::Linear { scale } => {
            TargetSource::Measured { least_sd: relative * scale, least_sd_relative: 0.0 }
        }
    }
}

/// Default lower limit of the relative standard deviation of a feature; 0 if only the noise of the recording
/// determines the standard deviation.
fn default_min_sd_relative(reading: &Reading) -> f64 {
    match reading {
        Reading::Frequency(_) | Reading::CycleFrequency { .. } => FREQUENCY_SD_FLOOR,
        Reading::BandLevel { .. } => LEVEL_SD_RELATIVE,
        _ => 0.0,
    }
}

/// A feature and the source of its target.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FitTarget {
    /// The feature. It is computed in the same way on the measured recording and on the recording of the
    /// model.
    pub feature: Feature,
    /// Source of the target and its standard deviation.
    pub source: TargetSource,
    /// Largest allowed relative error of a component; `None` for other features.
    pub tolerance_relative: Option<f64>,
    /// Whether the target is only predicted, never fitted.
    pub held_out: bool,
    /// Stages of the search in which the target counts.
    pub stage: TargetStage,
}

/// Stages of a search in which a target counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum TargetStage {
    /// All stages.
    Always,
    /// The last stage only. The cost of spectral levels has many minima, so these targets help only near the
    /// right minimum.
    Last,
}

/// Where the value of a target comes from.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum TargetSource {
    /// The target is given in the job, in the unit of the feature.
    Given {
        /// Target value.
        target: f64,
        /// Standard deviation of the target.
        sd: f64,
    },
    /// The target is measured on the recording. Its standard deviation is at least `least_sd`, and at least
    /// `least_sd_relative` times the target; if both are 0, the standard deviation follows from the noise of
    /// the recording.
    Measured {
        /// Lower limit of the standard deviation, in the unit of the feature.
        least_sd: f64,
        /// Lower limit of the standard deviation, as a fraction of the target.
        least_sd_relative: f64,
    },
}

/// Smallest allowed standard deviation of a target, as a fraction of the target. It is smaller than the error
/// of any camera, but large enough that squared residuals do not overflow.
const MIN_SD_RELATIVE: f64 = 1e-9;

/// The name of an entry of a job, for error messages.
pub(super) struct JobEntry {
    pub(super) what: String,
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
    ) -> Result<TargetSource, KeyRefusal> {
        let least = match measure {
            ValueComparison::Log if !(target.is_finite() && target != 0.0) => refuse!(
                self.key_path("target"),
                "found {target}, expected a finite number that is not 0 (residuals are logarithms)"
            ),
            ValueComparison::Log => MIN_SD_RELATIVE * target.abs(),
            ValueComparison::Linear { .. } if !target.is_finite() => {
                refuse!(self.key_path("target"), "found {target}, expected a finite number")
            }
            ValueComparison::Linear { scale } => MIN_SD_RELATIVE * scale,
        };
        if !(sd.is_finite() && sd >= least) {
            refuse!(self.key_path(sd_key), "found {sd}, expected a finite number of at least {least:e}");
        }
        Ok(TargetSource::Given { target, sd })
    }

    pub(super) fn check_relative_sd(&self, found: f64) -> Result<f64, KeyRefusal> {
        if found.is_finite() && found >= MIN_SD_RELATIVE {
            return Ok(found);
        }
        refuse!(
            self.key_path("sd_relative"),
            "found {found}, expected a finite number of at least {MIN_SD_RELATIVE:e}; 0.05 means 5 % of the measured value"
        )
    }

    /// Index of a recording or condition, and the recording or condition itself. `which` is a number, counted
    /// from 1, or a name; without `which`, the first recording or condition is used.
    pub(super) fn find_condition<'a>(
        &self,
        which: Option<&ConditionReference>,
        conditions: &'a [JobCondition],
    ) -> Result<(usize, &'a JobCondition), KeyRefusal> {
        let (key, most) = (self.key_path("recording"), conditions.len());
        let index = match which {
            None => 0,
            Some(ConditionReference::Number(number)) if (1..=most).contains(number) => number - 1,
            Some(ConditionReference::Number(number)) => refuse!(
                key,
                "found {number}, expected 1 to {most}: recordings, then conditions, are counted from 1 in the order of the file"
            ),
            Some(ConditionReference::Name(name)) => {
                let names: Vec<&str> = conditions.iter().map(|c| c.name.as_str()).collect();
                match names.iter().position(|known| known == name) {
                    Some(at) => at,
                    None => {
                        let nearest = suggest_key(name, &names);
                        refuse!(key, "no recording or condition is called `{name}`; {nearest}")
                    }
                }
            }
        };
        Ok((index, &conditions[index]))
    }
}
