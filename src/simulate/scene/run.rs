//! What is computed and written.

use super::as_written::RunFile;
use super::error::{SceneError, key_error};
use super::output::OutputTable;
use serde::Serialize;

/// What is to be computed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunSettings {
    /// End of the run, s.
    pub stop_s: f64,
    /// Rate of the sampled outputs, 1/s.
    pub sample_rate_hz: f64,
    /// Tolerated relative error of a step.
    pub relative_tolerance: f64,
    /// Right-hand sides after which the run gives up; `None` for [`MOST_EVALUATIONS`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub most_evaluations: Option<u64>,
    /// What is written.
    #[serde(skip)]
    pub outputs: Vec<OutputTable>,
}

/// Largest number of samples that a run may ask for: a longer trace is not read again
/// ([`crate::recording::clock::MAX_FRAMES`]), and a mistyped rate or stop time is refused instead of filling
/// the disk with more than some gigabytes.
const MOST_SAMPLES: f64 = crate::recording::clock::MAX_FRAMES;
/// Right-hand sides of a run unless the scene says otherwise: no ordinary scene reaches them (minutes of
/// computing).
pub const MOST_EVALUATIONS: u64 = 10_000_000_000;
/// Most that a scene may ask for: a week of computing.
const LARGEST_EVALUATIONS: u64 = 10_000_000_000_000;
/// Tolerances that double precision can meet.
const TOLERANCE_RANGE: (f64, f64) = (1e-13, 1e-2);
const DEFAULT_TOLERANCE: f64 = 1e-8;

pub(super) fn check_run_settings(
    file: &str,
    written: &RunFile,
    start_s: f64,
) -> Result<RunSettings, SceneError> {
    let refuse = |key: &str, value: f64, expected: &str| {
        Err(key_error(file, key, &value.to_string(), expected, "correct the value"))
    };
    if !(written.stop_s.is_finite() && written.stop_s > start_s) {
        return refuse(
            "run.stop_s",
            written.stop_s,
            &format!("a finite time after start.time_s = {start_s}"),
        );
    }
    if !(written.sample_rate_hz.is_finite() && written.sample_rate_hz > 0.0) {
        return refuse("run.sample_rate_hz", written.sample_rate_hz, "a number above 0");
    }
    let samples = written.sample_rate_hz * (written.stop_s - start_s);
    if !(1.0..=MOST_SAMPLES).contains(&samples) {
        return refuse(
            "run.sample_rate_hz",
            written.sample_rate_hz,
            &format!("2 to {MOST_SAMPLES:e} samples in the run, not {samples:e}"),
        );
    }
    let relative_tolerance = written.relative_tolerance.unwrap_or(DEFAULT_TOLERANCE);
    check_tolerance(relative_tolerance).map_err(|expected| {
        key_error(file, "run.relative_tolerance", &relative_tolerance.to_string(), &expected, "correct it")
    })?;
    if let Some(found) = written.most_evaluations.filter(|n| !(1..=LARGEST_EVALUATIONS).contains(n)) {
        let expected = format!("a whole number from 1 to {LARGEST_EVALUATIONS}");
        return Err(key_error(file, "run.most_evaluations", &found.to_string(), &expected, "correct it"));
    }
    let outputs = written
        .outputs
        .clone()
        .unwrap_or_else(|| vec![OutputTable::Trace, OutputTable::State, OutputTable::Events]);
    Ok(RunSettings {
        stop_s: written.stop_s,
        sample_rate_hz: written.sample_rate_hz,
        relative_tolerance,
        most_evaluations: written.most_evaluations,
        outputs,
    })
}

/// Refuses a run that its work limit ends long before the stop time: a radian of the fastest oscillation
/// takes at least one right-hand side.
pub(super) fn check_work_limit(
    file: &str,
    run: &RunSettings,
    start_s: f64,
    fastest_rad_per_s: f64,
) -> Result<(), SceneError> {
    let most = run.most_evaluations.unwrap_or(MOST_EVALUATIONS);
    let least = (run.stop_s - start_s) * fastest_rad_per_s;
    if least <= most as f64 {
        return Ok(());
    }
    Err(key_error(
        file,
        "run.stop_s",
        &format!(
            "{} s of a blade of {fastest_rad_per_s:.3e} rad/s: at least {least:.1e} right-hand sides",
            run.stop_s
        ),
        &format!("at most run.most_evaluations = {most}"),
        "shorten the run, correct masses and stiffnesses, or raise run.most_evaluations",
    ))
}

/// Checks a relative tolerance against what double precision can meet.
///
/// # Errors
/// The expected range in words.
pub fn check_tolerance(relative: f64) -> Result<(), String> {
    let (least, most) = TOLERANCE_RANGE;
    if (least..=most).contains(&relative) {
        Ok(())
    } else {
        Err(format!("a number from {least:e} to {most:e}"))
    }
}
