//! How and when a run starts.

use super::as_written::{StartFile, StartWord};
use super::error::{SceneError, key_error};
use crate::blade::flight::FlightState;
use crate::blade::{Linkage, Pose};
use crate::simulate::drive::Drive;
use crate::simulate::equilibrium::steady_slip_pose;
use serde::Serialize;

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
