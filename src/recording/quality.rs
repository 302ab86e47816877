//! What a recording can show: its rates, gaps and noise, measured on the traces themselves, and what looks
//! wrong with it.
//!
//! [`measure_quality`] measures, [`collect_findings`] judges (each finding with a severity, a number and advice), [`verdict_lines`]
//! puts both into lines for reading, and [`Quality::shows`] answers for a single frequency.

mod checks;
mod finding;
mod measured;
mod motion;
mod noise;
mod outliers;
mod prefilter;
mod summary;
mod tilt;
mod visibility;

pub use checks::check_position_steps;
pub use finding::{Check, QualityFinding, Severity};
pub use measured::{ChannelQuality, Optics, Quality, measure_quality};
pub use noise::{noise_floor, quantisation_step};
pub use outliers::outlier_frames;

pub use summary::{Grade, grade_findings, measurement_table, verdict_lines};
pub use tilt::{CameraTilt, Curvature, TiltNotFound, measure_tilt};
pub use visibility::{ComponentVisibility, PUBLISHED_COMPONENTS_HZ, PUBLISHED_TITLE, Visibility};

use crate::recording::Recording;
use crate::recording::channel::ReversalInstants;

/// Every finding on a recording, the gravest first: what its traces show, and what only its
/// export could show (`import`).
///
/// `measured` is the [`measure_quality`] of the same recording, `instants` what [`ReversalInstants::find`] finds in it.
#[must_use]
pub fn collect_findings(
    recording: &Recording,
    measured: &Quality,
    optics: &Optics,
    instants: &ReversalInstants,
    import: &[QualityFinding],
) -> Vec<QualityFinding> {
    let columns = measured::measured_columns(recording.traces(), measured);
    let mut found = import.to_vec();
    found.extend(checks::check_grid(measured));
    found.extend(checks::check_exposure(measured));
    found.extend(motion::check_motion(recording, measured));
    found.extend(tilt::check_tilt(recording, measured, instants));
    found.extend(motion::check_turns(instants));
    for column in &columns {
        found.extend(checks::check_track_column(column, recording.grid(), optics));
        found.extend(outliers::check_outliers(column, recording.grid(), optics));
        found.extend(prefilter::check_prefilter(column, measured.frame_rate_hz));
    }
    found.extend(checks::check_confidence(recording.traces()));
    // (stable: the order above within a severity)
    found.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
    found
}
