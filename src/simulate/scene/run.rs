//! What is computed and written.

use super::as_written::{RunFile, StartFile, StartWord};
use super::{OutputTable, SceneError, key_error};
use crate::model::flight::FlightState;
use crate::model::{Linkage, Pose};
use crate::simulate::drive::Drive;
use crate::simulate::equilibrium::steady_slip_pose;
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

// How and when a run starts.

/// How the blade starts.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum StartKind {
    /// Upright and at rest.
    Upright,
    /// In the equilibrium of steady slip at the head's speed.
    SteadySlide,
    /// In a given state.
    State(Pose),
    /// In a given state off the glass; not reachable from a scene file, it serves the exact cases.
    Airborne(FlightState),
}

pub(super) fn check_start(file: &str, written: &StartFile) -> Result<(f64, StartKind), SceneError> {
    let numbers = [
        ("start.neck_angle_rad", written.neck_angle_rad),
        ("start.lip_angle_rad", written.lip_angle_rad),
        ("start.neck_rate_rad_per_s", written.neck_rate_rad_per_s),
        ("start.lip_rate_rad_per_s", written.lip_rate_rad_per_s),
    ];
    for (key, value) in numbers.into_iter().chain([("start.time_s", Some(written.time_s))]) {
        if let Some(value) = value.filter(|v| !v.is_finite()) {
            return Err(key_error(file, key, &value.to_string(), "a finite number", "correct the value"));
        }
    }
    let kind = match written.kind {
        StartWord::State => {
            let [theta, phi, theta_rate, phi_rate] = numbers.map(|(key, value)| value.ok_or(key));
            let missing = |key: &str| {
                key_error(file, key, "nothing", "a number", "start.kind = \"state\" needs all four")
            };
            StartKind::State(Pose {
                theta: theta.map_err(missing)?,
                phi: phi.map_err(missing)?,
                theta_rate: theta_rate.map_err(missing)?,
                phi_rate: phi_rate.map_err(missing)?,
            })
        }
        _ if numbers.iter().any(|(_, v)| v.is_some()) => {
            return Err(key_error(
                file,
                "start.kind",
                "angles or rates without it",
                "\"state\"",
                "set start.kind = \"state\" or remove them",
            ));
        }
        StartWord::Upright => StartKind::Upright,
        StartWord::SteadySlide => StartKind::SteadySlide,
    };
    Ok((written.time_s, kind))
}

/// A run that starts in steady slip needs a head that moves and a blade that has such an equilibrium.
pub(super) fn check_steady_start(
    file: &str,
    start_s: f64,
    kind: StartKind,
    linkage: &Linkage,
    drive: &Drive,
) -> Result<(), SceneError> {
    let speed = drive.motion_at(start_s).velocity_m_per_s;
    if kind != StartKind::SteadySlide || steady_slip_pose(linkage, speed).is_some() {
        return Ok(());
    }
    let found = format!(
        "\"steady-slide\" at start.time_s = {start_s}, where the head moves at {speed} m/s and no equilibrium of steady slip is found"
    );
    let advice = "start at a time when the head moves, start \"upright\", or lower friction or preload";
    Err(key_error(
        file,
        "start.kind",
        &found,
        "a blade that slides steadily, pressed onto the glass, its links short of level",
        advice,
    ))
}
