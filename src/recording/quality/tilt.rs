//! Tilt of the camera, from the path of the tip. The tip stays on the glass, so its height is constant along
//! the sweep in a level picture; the slope of its height against its position along the sweep is the tilt.
//!
//! Each stroke has its own height, because the tracked point of the lip has a different height when the blade
//! leans to the other side. Frames in which the tip is off the glass do not count. A curved glass has no
//! single slope; the variation of its slope along the path is part of the uncertainty.

mod glass_line;

use super::finding::{Check, QualityFinding, Severity};
use super::measurement::Quality;
use super::motion::head_height_m;
use crate::recording::Recording;
use crate::recording::channel::{ReversalInstants, median_or_zero};
use crate::text::{format_degrees, format_with_sd, to_ascii};
use glass_line::{GlassLine, TipPath};
use portable_math as math;
use serde::Serialize;

/// Minimum number of frames in which the tip has a height: fewer frames do not determine the correlation of
/// the errors.
const FEWEST_FRAMES: usize = 50;
/// Smallest travel of the tip within a stroke, m: about the height of a blade. As the lip bends, its tracked
/// point moves up and down by some 10 um, which is 0.1 degrees over this travel.
const LEAST_TRAVEL_M: f64 = 5e-3;
/// Smallest fraction of the frames in which the tip lies on the fitted line; with fewer frames, the line is
/// not the glass.
const LEAST_ON_GLASS: f64 = 0.5;
/// A slope or curvature is significant if it exceeds this number of its standard deviations; by chance, it
/// does so in one level recording of 370.
const CLEAR_DEVIATIONS: f64 = 3.0;
/// Smallest sag of a path that counts as curved, m; a smaller sag is rounding error of a path without noise.
const LEAST_SAG_M: f64 = 1e-9;
/// Smallest tilt that matters, rad: 0.01 degrees shift the deflection of a blade 6 mm high by 1 um, a
/// twentieth of the usual pixel.
const LEAST_TILT_RAD: f64 = 0.01 * std::f64::consts::PI / 180.0;

/// Slope of the glass in the picture.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CameraTilt {
    /// Angle from the x axis to the glass, rad; positive where the glass rises towards positive x.
    pub angle_rad: f64,
    /// Standard deviation of the angle, rad. It includes correlated errors, rounding, and the change of slope
    /// along a curved glass.
    pub sd_rad: f64,
    /// Curvature of the glass in the picture; absent if the path shows none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub curvature: Option<Curvature>,
    /// Mean position of the tip on the glass, x and y, m.
    pub centre_m: [f64; 2],
    /// Longest travel of the tip within a stroke, m.
    pub travel_m: f64,
    /// Number of frames in which the tip lies on the glass; at most 100,000 frames are used.
    pub frames: usize,
    /// Number of frames in which the tip is off the glass.
    pub frames_off_glass: usize,
}

/// Curvature of the glass in the picture.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Curvature {
    /// Change of slope with position along the sweep, 1/m; positive if the middle lies lower than the ends.
    pub per_m: f64,
    /// Standard deviation of the curvature, 1/m.
    pub sd_per_m: f64,
    /// Standard deviation, over the frames, of the slope of the curved path, rad.
    pub slope_sd_rad: f64,
    /// Angle of the path at its mean position, rad. It differs from the mean angle where the tip spends more
    /// time at one end of the path.
    #[serde(skip)]
    middle_angle_rad: f64,
}

/// Why a recording shows no tilt.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TiltNotFound {
    /// The tip has a height in no or too few frames.
    #[error("the tip has x and y in {frames} frames, expected at least {FEWEST_FRAMES}")]
    TooFewFrames {
        /// Number of frames with both coordinates.
        frames: usize,
    },
    /// The tip hardly moves.
    #[error(
        "the tip travels {:.3} mm in its longest stroke, expected at least {:.0} mm", 1e3 * travel_m,
        1e3 * LEAST_TRAVEL_M
    )]
    TooLittleTravel {
        /// Longest travel of the tip in a stroke, m.
        travel_m: f64,
    },
    /// The positions of the tip do not lie on a line.
    #[error("the tip lies on one line in {on_line} of {frames} frames, expected at least half of them")]
    NoLine {
        /// Number of frames on the line.
        on_line: usize,
        /// Number of frames with both coordinates.
        frames: usize,
    },
}

/// Measures the tilt of the camera; `instants` and `measured` are the instants and the quality of the
/// recording.
///
/// # Errors
/// [`TiltNotFound`] with the reason if the recording shows no tilt.
pub fn measure_tilt(
    recording: &Recording,
    instants: &ReversalInstants,
    measured: &Quality,
) -> Result<CameraTilt, TiltNotFound> {
    let path = TipPath::from_recording(&recording.resample_to_grid(), instants);
    let frames = path.points.len();
    if frames < FEWEST_FRAMES {
        return Err(TiltNotFound::TooFewFrames { frames });
    }
    let step_m = height_step_m(measured);
    let sufficient_travel_m = |path: &TipPath| {
        let travel_m = path.travel_m();
        if travel_m < LEAST_TRAVEL_M { Err(TiltNotFound::TooLittleTravel { travel_m }) } else { Ok(travel_m) }
    };
    let line = glass_line::fit_glass_line(&path, sufficient_travel_m(&path)?, step_m);
    let on_glass = path.select_points(&line.on_glass);
    let on_line = on_glass.points.len();
    if (on_line as f64) < LEAST_ON_GLASS * frames as f64 {
        return Err(TiltNotFound::NoLine { on_line, frames });
    }
    let travel_m = sufficient_travel_m(&on_glass)?;
    let hidden_step_m = if measured.tip_y.noise_m.is_some_and(|noise| noise < step_m) { step_m } else { 0.0 };
    let (angle_rad, sd_rad, curvature) = angle_with_sd(&path, &line, hidden_step_m);
    let (centre_m, frames_off_glass) = (line.centre_m, frames - on_line);
    Ok(CameraTilt { angle_rad, sd_rad, curvature, centre_m, travel_m, frames: on_line, frames_off_glass })
}

/// Step in which the heights of the tip are written, m. If the heights never change, their step is unknown,
/// and the coarsest step of the other columns is used.
fn height_step_m(measured: &Quality) -> f64 {
    let tip_y = &measured.tip_y;
    let coarsest = || measured.channels().into_iter().filter_map(|(_, q)| q.step_m).fold(0.0, f64::max);
    tip_y.step_m.unwrap_or_else(|| if tip_y.noise_m == Some(0.0) { coarsest() } else { 0.0 })
}

/// Angle of a line and its standard deviation, both rad, and the curvature of the path; `hidden_step_m` is
/// the step of the heights if it exceeds their noise, otherwise 0.
fn angle_with_sd(path: &TipPath, line: &GlassLine, hidden_step_m: f64) -> (f64, f64, Option<Curvature>) {
    // in the worst case, the rounding error is the same in all frames, because a whole stroke may lie within
    // one step
    let rounding_m2 = path.points.len() as f64 * math::powi(hidden_step_m, 2) / 12.0;
    let variance_m2 = glass_line::long_run_variance(path, line) + rounding_m2;
    let curvature = significant_curvature(line, variance_m2);
    let bending = curvature.map_or(0.0, |curvature| curvature.slope_sd_rad);
    let slope_sd = math::hypot((variance_m2 / line.slope_information_m2).sqrt(), bending);
    (math::atan(line.slope), slope_sd / (1.0 + line.slope * line.slope), curvature)
}

fn significant_curvature(line: &GlassLine, variance_m2: f64) -> Option<Curvature> {
    let sd_per_m = 2.0 * (variance_m2 / line.bend_information_m4).sqrt();
    let per_m = 2.0 * line.bend_per_m;
    let slope_sd_rad = per_m.abs() * line.x_sd_m;
    let clear = per_m.abs() > CLEAR_DEVIATIONS * sd_per_m && slope_sd_rad * line.x_sd_m > LEAST_SAG_M;
    let middle_angle_rad = math::atan(line.middle_slope);
    clear.then_some(Curvature { per_m, sd_per_m, slope_sd_rad, middle_angle_rad })
}

impl CameraTilt {
    /// The recording with positions along the glass and heights above it, if the glass is curved. The glass
    /// is taken as an arc; a point above it appears nearer to the centre of the arc or farther from it. The
    /// result has no tilt.
    pub(crate) fn flatten_recording(&self, recording: &Recording) -> Option<Recording> {
        let curvature = self.curvature?;
        let traces = recording.traces();
        let mut flat = traces.clone();
        let angle_rad = curvature.middle_angle_rad;
        let (sin, cos) = (math::sin(angle_rad), math::cos(angle_rad));
        let [centre_x, centre_y] = self.centre_m;
        let along_glass = |x: f64, y: f64| {
            let (dx, dy) = (x - centre_x, y - centre_y);
            let [along, height] = unbend(curvature.per_m, [cos * dx + sin * dy, cos * dy - sin * dx]);
            [centre_x + along, centre_y + height]
        };
        let glass_y = |x: f64| {
            let dx = x - centre_x;
            centre_y + math::tan(angle_rad) * dx + 0.5 * curvature.per_m * dx * dx
        };
        let columns = [
            (&mut flat.tip_x_m, &mut flat.tip_y_m, &traces.tip_x_m, &traces.tip_y_m),
            (&mut flat.head_x_m, &mut flat.head_y_m, &traces.head_x_m, &traces.head_y_m),
        ];
        for (flat_x, flat_y, x_m, y_m) in columns {
            let heights = x_m.iter().zip(y_m).filter_map(|(x, y)| Some((*y)? - glass_y((*x)?)));
            // a position without a height is taken at the median height
            let usual_m = median_or_zero(heights);
            for (i, (x, y)) in x_m.iter().zip(y_m).enumerate() {
                let Some(x) = x else { continue };
                let [along, height] = along_glass(*x, y.unwrap_or_else(|| glass_y(*x) + usual_m));
                (flat_x[i], flat_y[i]) = (Some(along), y.map(|_| height));
            }
        }
        recording.clone().with_traces(flat).ok()
    }

    /// Whether the tilt is significant and large enough to matter.
    pub fn is_clear(&self) -> bool {
        self.angle_rad.abs() > (CLEAR_DEVIATIONS * self.sd_rad).max(LEAST_TILT_RAD)
    }
}

/// Position along an arc and height above it, towards its centre, m. The arc touches the x axis at the
/// origin.
fn unbend(per_m: f64, [x, y]: [f64; 2]) -> [f64; 2] {
    let radius = 1.0 / per_m;
    let (to_centre_x, to_centre_y) = (x * per_m, 1.0 - y * per_m);
    [radius * math::atan2(to_centre_x, to_centre_y), radius * (1.0 - math::hypot(to_centre_x, to_centre_y))]
}

/// Findings on the tilt and the curvature of a recording, if they are significant.
pub(in crate::recording::quality) fn check_tilt(
    recording: &Recording,
    measured: &Quality,
    tilt: Option<&CameraTilt>,
) -> Vec<QualityFinding> {
    let Some(tilt) = tilt else { return vec![] };
    let effect =
        TiltEffect { height_m: head_height_m(recording.traces()), noise_m: measured.deflection_floor_m() };
    [effect.tilt_finding(tilt), effect.curvature_finding(tilt)].into_iter().flatten().collect()
}

/// Effect of a tilt on the deflection: a rotation of the picture moves the head, which is above the tip,
/// along the sweep.
struct TiltEffect {
    /// Height of the head above the tip, m.
    height_m: Option<f64>,
    /// Standard deviation of the noise of the deflection, m.
    noise_m: Option<f64>,
}

impl TiltEffect {
    fn tilt_finding(&self, tilt: &CameraTilt) -> Option<QualityFinding> {
        if !tilt.is_clear() {
            return None;
        }
        let CameraTilt { angle_rad, sd_rad, travel_m, frames, .. } = *tilt;
        let words = format!(
            "the glass rises by {} along x, over {:.1} mm in {frames} frames{}, and the head drop changes by \
             {:.1} um along the path",
            format_degrees(angle_rad, sd_rad),
            1e3 * travel_m,
            self.describe_shift(angle_rad, "every deflection is shifted by"),
            1e6 * (travel_m * math::tan(angle_rad)).abs()
        );
        let advice = "import again with --level, which turns both tracks by this angle, or level the camera";
        let kind = (Check::Tilt, self.severity(angle_rad));
        Some(QualityFinding::advise(kind, (angle_rad.to_degrees(), "degrees"), words, advice))
    }

    fn curvature_finding(&self, tilt: &CameraTilt) -> Option<QualityFinding> {
        let Curvature { per_m, sd_per_m, slope_sd_rad, .. } = tilt.curvature?;
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
        let kind = (Check::CurvedGlass, self.severity(slope_sd_rad));
        Some(QualityFinding::advise(kind, (per_m, "1/m"), words, advice))
    }

    /// Shift of the deflection by a tilt of `angle_rad`, m.
    fn shift_m(&self, angle_rad: f64) -> Option<f64> {
        Some(self.height_m? * math::sin(angle_rad))
    }

    /// Severity of a tilt: a caution if it shifts the deflection by more than the noise of a single frame,
    /// otherwise a note.
    fn severity(&self, angle_rad: f64) -> Severity {
        match (self.shift_m(angle_rad), self.noise_m) {
            (Some(shift), Some(noise)) if shift.abs() > noise => Severity::Caution,
            _ => Severity::Note,
        }
    }

    fn describe_shift(&self, angle_rad: f64, what: &str) -> String {
        let Some(shift_m) = self.shift_m(angle_rad) else { return String::new() };
        let noises = match self.noise_m {
            Some(noise) if noise > 0.0 => {
                format!(" ({:.1} standard deviations of its noise)", shift_m.abs() / noise)
            }
            _ => String::new(),
        };
        format!(": {what} {:.1} um{noises}", 1e6 * shift_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::quality::{measure_motion, measure_quality};
    use crate::recording::{FrameGrid, Traces};

    const FRAMES: usize = 1000;

    /// A tip on a tilted arc, with a head above it. `lean_and_height` are the distances from tip to head, m,
    /// and `along` is the position of the tip along the glass, m, in each frame.
    fn film_on_arc(
        per_m: f64,
        along: impl Fn(usize) -> f64,
        lean_and_height: impl Fn(usize) -> [f64; 2],
    ) -> Recording {
        let (radius, tilt_rad) = (1.0 / per_m, 0.006);
        let at = |along: f64, height: f64| {
            let angle = along / radius + tilt_rad;
            let start = [radius * math::sin(tilt_rad), -radius * math::cos(tilt_rad)];
            let from_centre = radius - height;
            [from_centre * math::sin(angle) - start[0], -from_centre * math::cos(angle) - start[1]]
        };
        let tip = |axis: usize| (0..FRAMES).map(|i| Some(at(along(i), 0.0)[axis])).collect();
        let head = |axis: usize| {
            let place = |i: usize| {
                let [lean, height] = lean_and_height(i);
                at(along(i) + lean, height)[axis]
            };
            (0..FRAMES).map(|i| Some(place(i))).collect()
        };
        let traces = Traces {
            tip_x_m: tip(0),
            tip_y_m: tip(1),
            head_x_m: head(0),
            head_y_m: head(1),
            ..Traces::default()
        };
        let grid = FrameGrid { start_s: 0.0, frame_rate_hz: 1e3, frames: FRAMES };
        Recording::new("arc", grid, traces, true).unwrap()
    }

    /// The tip spends more time at the end of its path.
    fn slow_down(i: usize) -> f64 {
        0.04 * (1.0 - 2.0 * math::powi(1.0 - i as f64 / FRAMES as f64, 2))
    }

    /// The head sinks as the blade leans, in the same frame.
    #[test]
    fn tracks_over_curved_glass_have_no_lag() {
        for per_m in [0.9, -1.5, 3.0] {
            let lean = |i: usize| 1e-3 + 4e-4 * math::sin(0.3 * i as f64);
            let recording =
                film_on_arc(per_m, slow_down, |i| [lean(i), 5e-3 - 100.0 * math::powi(lean(i), 2)]);
            let measured = measure_quality(&recording, None);
            let motion = measure_motion(&recording, &measured, &ReversalInstants::find_instants(&recording));
            assert_eq!(motion.lag_frames, None, "{per_m}");
        }
    }

    /// A head 5 mm above the glass and 1 mm ahead of the tip. After flattening, both distances are right to
    /// 0.5 um.
    #[test]
    fn a_recording_on_an_arc_is_flattened() {
        let evenly = |i: usize| 0.04 * (2.0 * i as f64 / FRAMES as f64 - 1.0);
        for (per_m, along) in
            [(0.9, evenly as fn(usize) -> f64), (-0.3, evenly), (0.9, slow_down), (-0.3, slow_down)]
        {
            let recording = film_on_arc(per_m, along, |_| [1e-3, 5e-3]);
            let instants = ReversalInstants::find_instants(&recording);
            let tilt = measure_tilt(&recording, &instants, &measure_quality(&recording, None)).unwrap();
            let flat = tilt.flatten_recording(&recording).unwrap();
            let of = |column: &[Option<f64>], i: usize| column[i].unwrap();
            for i in 0..FRAMES {
                let t = flat.traces();
                let [lean, height] =
                    [of(&t.head_x_m, i) - of(&t.tip_x_m, i), of(&t.head_y_m, i) - of(&t.tip_y_m, i)];
                assert!((lean - 1e-3).abs() < 5e-7 && (height - 5e-3).abs() < 5e-7, "{i}: {lean} {height}");
            }
        }
    }
}
