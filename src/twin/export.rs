//! A twin in the layout that Tracker's export dialog writes, so that the real importer can be tried on it.

use crate::recording::Recording;
use std::fmt::Write;

/// Names of the tracks: the mark that the data are synthetic travels in the file itself.
pub const SYNTHETIC_TRACK_NAMES: [&str; 2] = ["synthetic tip", "synthetic head"];

/// The recording as a tab-separated table of two tracks in pixels, y upwards, time from the first frame; an
/// empty cell where a point was lost. Numbers carry seven digits, as Tracker's do.
#[must_use]
pub fn write_tracker_table(recording: &Recording, metres_per_pixel: f64) -> String {
    let [tip, head] = SYNTHETIC_TRACK_NAMES;
    let mut text = format!("#multi:\n\t{tip}\t\t{head}\t\t\nt\tx\ty\tx\ty\t\n");
    let traces = recording.traces();
    let columns = [&traces.tip_x_m, &traces.tip_y_m, &traces.head_x_m, &traces.head_y_m];
    for i in 0..recording.grid().frames {
        // writing to a String cannot fail
        let _ = write!(text, "{}", format_java_number(i as f64 / recording.grid().frame_rate_hz));
        for column in columns {
            text.push('\t');
            if let Some(value) = column[i] {
                text.push_str(&format_java_number(value / metres_per_pixel));
            }
        }
        text.push('\n');
    }
    text
}

/// `1.234567E-1`: Java's scientific notation without a sign in front of a positive exponent.
fn format_java_number(value: f64) -> String {
    format!("{value:.6E}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{FrameGrid, Traces};

    #[test]
    fn the_table_has_trackers_layout() {
        let column = |a: Option<f64>, b: f64| vec![a, Some(b)];
        let traces = Traces {
            tip_x_m: column(Some(2e-3), 4e-3),
            tip_y_m: column(Some(-6e-3), -6e-3),
            head_x_m: column(None, 0.0),
            head_y_m: column(None, 1e-6),
            ..Traces::default()
        };
        let recording =
            Recording::new("r", FrameGrid { start_s: 0.3, frame_rate_hz: 1e4, frames: 2 }, traces, true)
                .unwrap();
        let lines = "#multi:\n\tsynthetic tip\t\tsynthetic head\t\t\nt\tx\ty\tx\ty\t\n0.000000E0\t1.000000E2\t-3.000000E2\t\t\n\
                     1.000000E-4\t2.000000E2\t-3.000000E2\t0.000000E0\t5.000000E-2\n";
        assert_eq!(write_tracker_table(&recording, 2e-5), lines);
    }
}
