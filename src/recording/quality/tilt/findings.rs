//! What a tilt or a curved glass does to the deflection, in words.

use super::{CLEAR_DEVIATIONS, CameraTilt, Curvature, LEAST_TILT_RAD, measure_tilt};
use crate::math;
use crate::recording::Recording;
use crate::recording::channel::ReversalInstants;
use crate::recording::quality::finding::{Check, QualityFinding, Severity};
use crate::recording::quality::measured::Quality;
use crate::recording::quality::motion::head_height_m;
use crate::text::{format_degrees, format_with_sd, to_ascii};

/// The tilt and the curvature of a recording, where they are clear; nothing where it shows none.
pub(in super::super) fn check_tilt(
    recording: &Recording,
    measured: &Quality,
    instants: &ReversalInstants,
) -> Vec<QualityFinding> {
    let Ok(tilt) = measure_tilt(recording, instants, measured) else { return vec![] };
    let effect =
        TiltEffect { height_m: head_height_m(recording.traces()), noise_m: measured.deflection_floor_m() };
    [effect.tilt_finding(&tilt), effect.curvature_finding(&tilt)].into_iter().flatten().collect()
}

/// What an angle changes: the head stands above the tip, so turning the picture moves it along the sweep.
struct TiltEffect {
    /// Height of the head above the tip, m.
    height_m: Option<f64>,
    /// Noise of a deflection, m.
    noise_m: Option<f64>,
}

impl TiltEffect {
    fn tilt_finding(&self, tilt: &CameraTilt) -> Option<QualityFinding> {
        if !tilt.is_clear() {
            return None;
        }
        let words = format!(
            "the glass rises by {} along x, over {:.1} mm in {} frames{}",
            format_degrees(tilt.angle_rad, tilt.sd_rad),
            1e3 * tilt.travel_m,
            tilt.frames,
            self.describe_shift(tilt.angle_rad, "every deflection is shifted by")
        );
        let rise =
            format!(", and the head drop changes by {:.1} um along the path", 1e6 * tilt.rise_m().abs());
        let advice = "import again with --level, which turns both tracks by this angle, or level the camera";
        let severity = self.severity(tilt.angle_rad);
        Some(
            QualityFinding::new(Check::Tilt, severity, tilt.angle_rad.to_degrees(), "degrees", words + &rise)
                .with_advice(advice),
        )
    }

    fn curvature_finding(&self, tilt: &CameraTilt) -> Option<QualityFinding> {
        let Curvature { per_m, sd_per_m, slope_sd_rad } = tilt.curvature?;
        let change = (per_m * tilt.travel_m).abs();
        if change < LEAST_TILT_RAD.max(CLEAR_DEVIATIONS * sd_per_m * tilt.travel_m) {
            return None;
        }
        let words = format!(
            "the glass is curved in the picture by {} 1/m: its slope changes by {:.3} degrees along the \
             path{}",
            to_ascii(&format_with_sd(per_m, sd_per_m)),
            change.to_degrees(),
            self.describe_shift(slope_sd_rad, "deflections at different places differ by")
        );
        let advice = "no rotation levels a curved path: compare windows at the same place, and check the lens \
            for distortion";
        Some(
            QualityFinding::new(Check::CurvedGlass, self.severity(slope_sd_rad), per_m, "1/m", words)
                .with_advice(advice),
        )
    }

    /// Shift of a deflection, m.
    fn shift_m(&self, angle_rad: f64) -> Option<f64> {
        Some(self.height_m? * math::sin(angle_rad))
    }

    /// A shift that single frames show is more than worth knowing.
    fn severity(&self, angle_rad: f64) -> Severity {
        match (self.shift_m(angle_rad), self.noise_m) {
            (Some(shift), Some(noise)) if shift.abs() > noise => Severity::Caution,
            _ => Severity::Note,
        }
    }

    fn describe_shift(&self, angle_rad: f64, what: &str) -> String {
        let Some(shift_m) = self.shift_m(angle_rad) else { return String::new() };
        let noises = self.noise_m.filter(|noise| *noise > 0.0).map_or_else(String::new, |noise| {
            format!(" ({:.1} standard deviations of its noise)", shift_m.abs() / noise)
        });
        format!(": {what} {:.1} um{noises}", 1e6 * shift_m)
    }
}
