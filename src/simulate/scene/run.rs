//! Settings of a run: its end, its outputs and its start.

use super::as_written::{RunFile, StartFile, StartWord};
use super::contact::OutputTable;
use super::error::{SceneError, key_error};
use crate::model::flight::FlightState;
use crate::model::{Linkage, Pose};
use crate::simulate::drive::Drive;
use crate::simulate::equilibrium::steady_slip_pose;
use serde::Serialize;

/// Settings of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunSettings {
    /// End of the run, s.
    pub stop_s: f64,
    /// Number of rows per second in the tables, Hz.
    pub sample_rate_hz: f64,
    /// Relative tolerance of a step.
    pub relative_tolerance: f64,
    /// Number of evaluations of the right-hand side after which the run ends; `None` for
    /// [`MOST_EVALUATIONS`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub most_evaluations: Option<u64>,
    /// Output tables that the run writes.
    #[serde(skip)]
    pub outputs: Vec<OutputTable>,
}

/// Maximum number of samples of a run: a longer trace cannot be read
/// ([`crate::recording::clock::MAX_FRAMES`]), and a mistyped rate or stop time must not fill the disk.
const MOST_SAMPLES: f64 = crate::recording::clock::MAX_FRAMES;
/// Default limit on evaluations of the right-hand side: minutes of computing, more than any ordinary scene
/// needs.
pub const MOST_EVALUATIONS: u64 = 10_000_000_000;
/// Largest limit on evaluations that a scene may set: a week of computing.
const LARGEST_EVALUATIONS: u64 = 10_000_000_000_000;
/// Range of tolerances that double precision can meet.
const TOLERANCE_RANGE: (f64, f64) = (1e-13, 1e-2);
const DEFAULT_TOLERANCE: f64 = 1e-8;

pub(super) fn check_run(file: &str, written: &RunFile, start_s: f64) -> Result<RunSettings, SceneError> {
    let &RunFile { stop_s, sample_rate_hz, most_evaluations, .. } = written;
    let refuse = |key: &str, value: f64, expected: &str| {
        Err(key_error(file, key, value, expected, "correct the value"))
    };
    if !(stop_s.is_finite() && stop_s > start_s) {
        return refuse("run.stop_s", stop_s, &format!("a finite time after start.time_s = {start_s}"));
    }
    if !(sample_rate_hz.is_finite() && sample_rate_hz > 0.0) {
        return refuse("run.sample_rate_hz", sample_rate_hz, "a number above 0");
    }
    let samples = sample_rate_hz * (stop_s - start_s);
    if !(1.0..=MOST_SAMPLES).contains(&samples) {
        let expected = format!("2 to {MOST_SAMPLES:e} samples in the run, not {samples:e}");
        return refuse("run.sample_rate_hz", sample_rate_hz, &expected);
    }
    let relative_tolerance = written.relative_tolerance.unwrap_or(DEFAULT_TOLERANCE);
    check_tolerance(relative_tolerance).map_err(|expected| {
        key_error(file, "run.relative_tolerance", relative_tolerance, &expected, "correct it")
    })?;
    if let Some(found) = most_evaluations.filter(|n| !(1..=LARGEST_EVALUATIONS).contains(n)) {
        let expected = format!("a whole number from 1 to {LARGEST_EVALUATIONS}");
        return Err(key_error(file, "run.most_evaluations", found, &expected, "correct it"));
    }
    let all = || vec![OutputTable::Trace, OutputTable::State, OutputTable::Events];
    let outputs = written.outputs.clone().unwrap_or_else(all);
    Ok(RunSettings { stop_s, sample_rate_hz, relative_tolerance, most_evaluations, outputs })
}

/// Refuses a run that its work limit would end long before the stop time. Each radian of the fastest
/// oscillation costs at least one evaluation of the right-hand side.
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
    let stop_s = run.stop_s;
    let found = format!(
        "{stop_s} s of a blade of {fastest_rad_per_s:.3e} rad/s: at least {least:.1e} right-hand sides"
    );
    let expected = format!("at most run.most_evaluations = {most}");
    let advice = "shorten the run, correct masses and stiffnesses, or raise run.most_evaluations";
    Err(key_error(file, "run.stop_s", found, &expected, advice))
}

/// Refuses a relative tolerance that double precision cannot meet.
///
/// # Errors
/// Message with the admissible range.
pub fn check_tolerance(relative: f64) -> Result<(), String> {
    let (least, most) = TOLERANCE_RANGE;
    let holds = (least..=most).contains(&relative);
    holds.then_some(()).ok_or_else(|| format!("a number from {least:e} to {most:e}"))
}

/// State at the start of a run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum StartKind {
    /// A blade, upright and at rest relative to its head.
    Upright,
    /// In the equilibrium of steady slip at the head's speed.
    SteadySlide,
    /// In a given state.
    State(Pose),
    /// A slider in a given state; both numbers are 0 for the kind "relaxed".
    Slider {
        /// Position of the slider minus that of the head, m.
        deflection_m: f64,
        /// Velocity of the slider, m/s.
        tip_velocity_m_per_s: f64,
    },
    /// In a given state off the glass, for tests with exact solutions; a scene file cannot select it.
    Airborne(FlightState),
}

/// Checks the start of a blade or, if `is_slider` is true, of a slider.
pub(super) fn check_start(
    file: &str,
    written: &StartFile,
    is_slider: bool,
) -> Result<(f64, StartKind), SceneError> {
    let of_blade = [
        ("start.neck_angle_rad", written.neck_angle_rad),
        ("start.lip_angle_rad", written.lip_angle_rad),
        ("start.neck_rate_rad_per_s", written.neck_rate_rad_per_s),
        ("start.lip_rate_rad_per_s", written.lip_rate_rad_per_s),
    ];
    let of_slider = [
        ("start.deflection_m", written.deflection_m),
        ("start.tip_velocity_m_per_s", written.tip_velocity_m_per_s),
    ];
    let time = ("start.time_s", Some(written.time_s));
    for (key, value) in of_blade.into_iter().chain(of_slider).chain([time]) {
        if let Some(value) = value.filter(|v| !v.is_finite()) {
            return Err(key_error(file, key, value, "a finite number", "correct the value"));
        }
    }
    let (own, other): (&[_], &[_]) =
        if is_slider { (&of_slider, &of_blade) } else { (&of_blade, &of_slider) };
    if let Some((key, _)) = other.iter().find(|(_, value)| value.is_some()) {
        return Err(foreign_key(file, key, is_slider));
    }
    let number = |key, value: Option<f64>| {
        let advice = "start.kind = \"state\" needs all numbers of the state";
        value.ok_or_else(|| key_error(file, key, "nothing", "a number", advice))
    };
    let kind = match written.kind {
        Some(StartWord::State) if is_slider => {
            let [deflection_m, tip_velocity_m_per_s] = of_slider.map(|(key, value)| number(key, value));
            StartKind::Slider { deflection_m: deflection_m?, tip_velocity_m_per_s: tip_velocity_m_per_s? }
        }
        Some(StartWord::State) => {
            let [theta, phi, theta_rate, phi_rate] = of_blade.map(|(key, value)| number(key, value));
            StartKind::State(Pose { theta: theta?, phi: phi?, theta_rate: theta_rate?, phi_rate: phi_rate? })
        }
        _ if own.iter().any(|(_, v)| v.is_some()) => {
            let advice = "set start.kind = \"state\" or remove them";
            return Err(key_error(file, "start.kind", "numbers of a state without it", "\"state\"", advice));
        }
        Some(StartWord::SteadySlide) => StartKind::SteadySlide,
        Some(StartWord::Upright) if is_slider => {
            let expected = "\"relaxed\", \"steady-slide\" or \"state\": a slider has no angles";
            return Err(key_error(file, "start.kind", "\"upright\"", expected, "correct it"));
        }
        Some(StartWord::Relaxed) if !is_slider => {
            let expected = "\"upright\", \"steady-slide\" or \"state\"; \"relaxed\" is a start of a slider";
            return Err(key_error(file, "start.kind", "\"relaxed\"", expected, "correct it"));
        }
        None | Some(StartWord::Upright | StartWord::Relaxed) if is_slider => {
            StartKind::Slider { deflection_m: 0.0, tip_velocity_m_per_s: 0.0 }
        }
        None | Some(StartWord::Upright | StartWord::Relaxed) => StartKind::Upright,
    };
    Ok((written.time_s, kind))
}

/// Error of a key that belongs to a blade in the scene of a slider, or the reverse.
pub(super) fn foreign_key(file: &str, key: &str, is_slider: bool) -> SceneError {
    let (found, expected) = if is_slider {
        ("a key of a blade", "the keys of a slider, because the scene has [slider]")
    } else {
        ("a key of a slider", "the keys of a blade, because the scene has [blade]")
    };
    key_error(file, key, found, expected, "leave it out")
}

/// Refuses a start in steady slip if the head is at rest or if the blade has no such equilibrium.
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
    let (advice, expected) = if linkage.is_slider() {
        (
            "start at a time when the head moves, or start \"relaxed\"",
            "a slider that slides steadily on its spring",
        )
    } else {
        (
            "start at a time when the head moves, start \"upright\", or lower friction or preload",
            "a blade that slides steadily, pressed onto the glass, its links short of level",
        )
    };
    Err(key_error(file, "start.kind", found, expected, advice))
}
