//! The tilt of the camera, measured on the imported path and taken out of both tracks on request.

use crate::import::error::ImportError;
use crate::import::options::ImportOptions;
use crate::import::outcome::ImportReport;
use crate::recording::Recording;
use crate::recording::channel::ReversalInstants;
use crate::recording::files::LevelEntry;
use crate::recording::level::{RotationError, rotate_traces};
use crate::recording::quality::{
    CameraTilt, Optics, TiltNotFound, check_position_steps, measure_quality, measure_tilt,
};

/// Why a recording cannot be levelled.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LevelError {
    /// It shows no tilt.
    #[error(transparent)]
    NoTilt(#[from] TiltNotFound),
    /// A point has one coordinate alone.
    #[error(transparent)]
    NotTurnable(#[from] RotationError),
}

/// The recording as a level camera would have seen it, and what was done; `file` is the name used in
/// refusals. A tilt that is not clear is left alone.
///
/// # Errors
/// [`ImportError::Level`] where the path shows no tilt, or a point has one coordinate alone.
pub(crate) fn level_recording(
    recording: Recording,
    file: &str,
    (options, optics): (&ImportOptions, &Optics),
    report: &mut ImportReport,
) -> Result<(Recording, Option<LevelEntry>), ImportError> {
    if !options.level {
        return Ok((recording, None));
    }
    let refuse = |problem| ImportError::Level { file: file.to_owned(), problem };
    let measured = measure_quality(&recording, optics.exposure_s);
    let tilt = measure_tilt(&recording, &ReversalInstants::find_instants(&recording), &measured)
        .map_err(|e| refuse(e.into()))?;
    let entry = level_entry(&tilt);
    report.notes.push(format!("level: {}", entry.describe()));
    if !entry.applied {
        return Ok((recording, Some(entry)));
    }
    let traces =
        rotate_traces(recording.traces(), tilt.angle_rad, tilt.centre_m).map_err(|e| refuse(e.into()))?;
    // turned coordinates no longer show the step of the export
    report.findings.extend(check_position_steps(&measured, optics));
    let (name, grid) = (recording.name().to_owned(), recording.grid());
    let level = Recording::new(name, grid, traces, recording.is_synthetic())
        .map_err(|problem| ImportError::Recording { file: file.to_owned(), problem })?;
    Ok((level, Some(entry)))
}

fn level_entry(tilt: &CameraTilt) -> LevelEntry {
    LevelEntry {
        applied: tilt.is_clear(),
        angle_rad: tilt.angle_rad,
        sd_rad: tilt.sd_rad,
        centre_x_m: tilt.centre_m[0],
        centre_y_m: tilt.centre_m[1],
        frames: tilt.frames,
        curvature_per_m: tilt.curvature.map(|curvature| curvature.per_m),
    }
}
