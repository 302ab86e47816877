//! What a recording can show: its rates, gaps and noise, measured on the traces themselves, and what looks
//! wrong with it.
//!
//! [`quality`] measures, [`findings`] judges (each finding with a severity, a number and advice), [`verdict`]
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

pub use checks::position_steps;
pub use finding::{Check, Finding, Severity};
pub use measured::{ChannelQuality, Optics, Quality, quality};
pub use noise::{noise_floor, quantisation_step};
pub use outliers::outlier_frames;

pub use summary::{Grade, grade, table, verdict};
pub use tilt::{Curvature, NoTilt, Tilt, tilt};
pub use visibility::{ComponentVisibility, PUBLISHED_COMPONENTS_HZ, PUBLISHED_TITLE, Visibility};

use crate::recording::Recording;
use crate::recording::channel::Instants;

/// Every finding on a recording, the gravest first: what its traces show, and what only its
/// export could show (`import`).
///
/// `measured` is the [`quality`] of the same recording, `instants` what [`Instants::find`] finds in it.
#[must_use]
pub fn findings(
    recording: &Recording,
    measured: &Quality,
    optics: &Optics,
    instants: &Instants,
    import: &[Finding],
) -> Vec<Finding> {
    let columns = measured::columns(recording.traces(), measured);
    let mut found = import.to_vec();
    found.extend(checks::of_the_grid(measured));
    found.extend(checks::of_the_exposure(measured));
    found.extend(motion::of_both_points(recording, measured));
    found.extend(tilt::findings(recording, measured, instants));
    found.extend(motion::of_the_turns(instants));
    for column in &columns {
        found.extend(checks::of_a_column(column, recording.grid(), optics));
        found.extend(outliers::finding(column, recording.grid(), optics));
        found.extend(prefilter::finding(column, measured.frame_rate_hz));
    }
    found.extend(checks::of_the_confidence(recording.traces()));
    // (stable: the order above within a severity)
    found.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
    found
}
