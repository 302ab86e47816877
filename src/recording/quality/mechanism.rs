//! What a recording would mean physically: blade height, travel, speeds, strokes, the fastest oscillation and
//! the lag between the tracks; and the findings on numbers that no wiper has.

use super::finding::{Check, QualityFinding, Severity};
use super::lag::measure_lag_frames;
use super::measurement::Quality;
use super::motion::{LARGEST_VIEW_M, head_height_m, largest_travel_m};
use super::regression::fit_rows;
use super::tilt::{CameraTilt, measure_tilt};
use crate::recording::Recording;
use crate::recording::channel::{Channel, ReversalInstants, find_median};
use crate::recording::clock::is_playback_rate;
use crate::text::format_rate;
use portable_math as math;
use serde::Serialize;
use std::f64::consts::TAU;

/// Smallest frame rate that shows the slowest vibration of a blade, 1/s: the head on its spring vibrates at
/// 8.88 and 20 Hz in the paper, and ten frames a cycle show its shape.
const LEAST_RATE_HZ: f64 = 100.0;
/// Highest plausible frequency of wiping cycles (two strokes each), 1/s: FMVSS 104 demands at least 45 cycles
/// a minute at the high speed, and wipers make up to 75.
const MOST_STROKES_HZ: f64 = 2.0;
/// Smallest travel for which the frequency of the wiping cycles is judged, m: a short stroke of a rig may be
/// faster.
const STROKE_TRAVEL_M: f64 = 0.01;
/// Highest plausible acceleration of a head, m/s2: five times that of gravity. In a stroke of 2 m at 65
/// cycles a minute, the end of the arm turns with 46 m/s2; the head of the paper's rig turns with 1 m/s2.
const MOST_ACCELERATION_M_PER_S2: f64 = 50.0;
/// Highest plausible speed of a head, m/s: the end of the longest arm reaches 3 m/s.
const MOST_SPEED_M_PER_S: f64 = 5.0;
/// Smallest and largest plausible height of a blade, m: a tenth of the lowest rubber (5 mm) and ten times the
/// highest (20 mm).
const BLADE_M: [f64; 2] = [2.5e-4, 0.2];
/// Largest allowed ratio between the blade heights of the recording and of the scene, in either direction:
/// the tracked point of the head may lie above its hinge.
const SCENE_RATIO: f64 = 2.0;
/// Number of equal intervals of a stroke over which the speed of the head is averaged.
const SPEEDS: usize = 64;
/// Maximum number of frames of the fit of a stroke.
const MOST_ROWS: usize = 500;
/// Smallest phase of the fitted cosine, rad, that a recording must cover to show the duration of a stroke. A
/// whole stroke is pi rad.
const LEAST_PHASE: f64 = 1.25;
/// Largest phase that is fitted, rad; a longer recording shows two turns.
const MOST_PHASE: f64 = 12.0;
/// Ratio of neighbouring trial phases.
const PHASE_STEP: f64 = 1.02;
/// Largest allowed root mean square of the residuals of the fitted cosine, as a fraction of the travel.
const STROKE_MISFIT: f64 = 0.02;
/// Ratio of successive time intervals at which the structure function is evaluated.
const INTERVAL_STEP: f64 = 1.06;
/// A maximum of the structure function counts if the function falls below this fraction of it at longer
/// intervals, as it does for an oscillation when the interval is a whole period.
const FALLS: f64 = 0.7;
/// Smallest maximum of the structure function that counts, in units of the contribution of noise.
const ABOVE_NOISE: f64 = 5.0;

/// Motion of a recording as physical quantities.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MotionSummary {
    /// Median height of the head above the tip, m.
    pub blade_height_m: Option<f64>,
    /// Travel of the point that travels farther, m.
    pub travel_m: Option<f64>,
    /// Highest of the mean speeds of the head over 1/64 of a stroke, m/s.
    pub peak_speed_m_per_s: Option<f64>,
    /// Median of the mean speeds of the head over 1/64 of a stroke, m/s.
    pub median_speed_m_per_s: Option<f64>,
    /// Duration of a stroke, s: the median time between turns of the head or, with fewer than two turns, half
    /// the period of the cosine that fits the path of the head.
    pub stroke_s: Option<f64>,
    /// Frequency of the fastest oscillation of the deflection that stands out from the noise, Hz.
    pub fastest_oscillation_hz: Option<f64>,
    /// Lag of the tip's track behind the head's track, in frames, at the start and the end of the recording;
    /// absent if no lag is visible.
    pub lag_frames: Option<[f64; 2]>,
}

/// Measures the motion of a recording; `measured` and `instants` are its quality and its instants.
#[must_use]
pub fn measure_motion(
    recording: &Recording,
    measured: &Quality,
    instants: &ReversalInstants,
) -> MotionSummary {
    let tilt = measure_tilt(recording, instants, measured).ok();
    summarise_motion(recording, measured, instants, tilt.as_ref())
}

/// Like [`measure_motion`], with the tilt of the recording, if it shows one.
pub(super) fn summarise_motion(
    recording: &Recording,
    measured: &Quality,
    instants: &ReversalInstants,
    tilt: Option<&CameraTilt>,
) -> MotionSummary {
    let recording = &*recording.resample_to_grid();
    let (traces, rate_hz) = (recording.traces(), measured.frame_rate_hz);
    // (one slope cannot correct the deflection over curved glass, whose slope changes along the sweep)
    let flat = tilt.and_then(|tilt| tilt.flatten_recording(recording));
    let slope = tilt.filter(|_| flat.is_none()).map_or(0.0, |tilt| math::tan(tilt.angle_rad));
    let strokes = instants.reversals.len() + 1;
    let speeds = head_speeds_m_per_s(&traces.head_x_m, rate_hz, strokes);
    let turns: Vec<f64> = instants.reversals.iter().map(|turn| turn.reversal_s).collect();
    let between = find_median(turns.windows(2).map(|turns| turns[1] - turns[0]));
    let between = between.filter(|stroke_s| *stroke_s > 0.0);
    MotionSummary {
        blade_height_m: head_height_m(traces),
        travel_m: largest_travel_m(traces),
        peak_speed_m_per_s: speeds.iter().copied().reduce(f64::max),
        median_speed_m_per_s: find_median(speeds.iter().copied()),
        stroke_s: between.or_else(|| stroke_of_cosine_s(&traces.head_x_m, rate_hz)),
        fastest_oscillation_hz: fastest_oscillation_hz(&Channel::Deflection.samples(recording), measured),
        lag_frames: measure_lag_frames(flat.as_ref().map_or(traces, Recording::traces), measured, slope),
    }
}

fn head_speeds_m_per_s(head_x: &[Option<f64>], rate_hz: f64, strokes: usize) -> Vec<f64> {
    let length = head_x.len() / (SPEEDS * strokes) + 1;
    let median = |block: &[Option<f64>]| find_median(block.iter().filter_map(|x| *x));
    let medians: Vec<Option<f64>> = head_x.chunks(length).map(median).collect();
    let speed = |pair: &[Option<f64>]| Some((pair[1]? - pair[0]?).abs() * rate_hz / length as f64);
    // (the last block may be shorter and is left out)
    medians[..medians.len().saturating_sub(1)].windows(2).filter_map(speed).collect()
}

/// Half the period of the cosine that fits the path of the head, s; `None` if it does not fit well or covers
/// too little of the period.
fn stroke_of_cosine_s(head_x: &[Option<f64>], rate_hz: f64) -> Option<f64> {
    let (frames, start) = (head_x.len(), head_x.iter().flatten().next()?);
    let some = head_x.iter().enumerate().step_by(frames / MOST_ROWS + 1);
    let points: Vec<(f64, f64)> =
        some.filter_map(|(i, x)| Some((i as f64 / frames as f64 - 0.5, (*x)? - start))).collect();
    let fit = |phase: f64| {
        let row = |&(place, x): &(f64, f64)| ([1.0, math::cos(phase * place), math::sin(phase * place)], x);
        let fit = fit_rows(&points.iter().map(row).collect::<Vec<_>>())?;
        Some((phase, fit.mean_square))
    };
    let trials = std::iter::successors(Some(LEAST_PHASE / 2.0), |phase| Some(phase * PHASE_STEP));
    let best =
        trials.take_while(|phase| *phase < MOST_PHASE).filter_map(fit).min_by(|a, b| a.1.total_cmp(&b.1))?;
    let travel_m = super::motion::trimmed_range_m(head_x)?;
    let fits = best.0 >= LEAST_PHASE && best.1.sqrt() < STROKE_MISFIT * travel_m;
    fits.then(|| TAU / 2.0 * frames as f64 / rate_hz / best.0)
}

/// Frequency of the fastest oscillation of the deflection, Hz, from its structure function. This function is
/// the mean square of the second difference over an interval; it has its first maximum where the interval is
/// half a period.
fn fastest_oscillation_hz(deflection: &[Option<f64>], measured: &Quality) -> Option<f64> {
    let floor_m2 = 6.0 * ABOVE_NOISE * math::powi(measured.deflection_floor_m()?, 2);
    let every = deflection.len() / 20_000 + 1;
    let structure = |interval: usize| {
        let second =
            |i: usize| Some(deflection[i - interval]? - 2.0 * deflection[i]? + deflection[i + interval]?);
        let squares =
            (interval..deflection.len() - interval).step_by(every).filter_map(second).map(|d| d * d);
        let (sum, count) = squares.fold((0.0, 0), |(sum, count), square| (sum + square, count + 1));
        sum / f64::from(count.max(1))
    };
    let (mut interval, mut top) = (1, (1, 0.0));
    while 8 * interval < deflection.len() {
        let value = structure(interval);
        if value > top.1 {
            top = (interval, value);
        } else if value < FALLS * top.1 && top.1 > floor_m2 {
            return Some(measured.frame_rate_hz / (2 * top.0) as f64);
        }
        interval = (interval + 1).max((interval as f64 * INTERVAL_STEP) as usize);
    }
    None
}

/// Findings on a frame rate or a scale with which the motion would be impossible for a wiper.
pub(super) fn check_mechanism(motion: &MotionSummary, measured: &Quality) -> Vec<QualityFinding> {
    let height = || check_height(motion, BLADE_M, "blades of a tenth to ten times the usual size");
    // (a longer travel has its own finding)
    let visible = motion.travel_m.is_some_and(|travel| travel <= LARGEST_VIEW_M);
    [check_rate(motion, measured), visible.then(height).flatten()].into_iter().flatten().collect()
}

/// Finding on a blade whose height differs by more than a factor of two from `scene_height_m`, the height of
/// the blade of the scene.
#[must_use]
pub fn check_scene_height(motion: &MotionSummary, scene_height_m: f64) -> Option<QualityFinding> {
    check_height(
        motion,
        [scene_height_m / SCENE_RATIO, scene_height_m * SCENE_RATIO],
        "the blade of the scene",
    )
}

fn check_rate(motion: &MotionSummary, measured: &Quality) -> Option<QualityFinding> {
    let rate_hz = measured.frame_rate_hz;
    let kind = (Check::FrameRate, Severity::Caution);
    if rate_hz < LEAST_RATE_HZ && !is_playback_rate(rate_hz) {
        let found = format!(
            "{} frames/s over {:.1} s show no vibration of a blade, which has 9 Hz or more",
            format_rate(rate_hz),
            measured.duration_s
        );
        let advice = "check --frame-rate-hz: it is the rate of recording, usually 1000 frames/s or more";
        return Some(QualityFinding::advise(kind, (rate_hz, "Hz"), found, advice));
    }
    let (peak, travel_m) = (motion.peak_speed_m_per_s?, motion.travel_m?);
    let strokes_hz = motion.stroke_s.map_or(0.0, |stroke| 0.5 / stroke);
    let acceleration = TAU * strokes_hz * peak;
    let fast_strokes = strokes_hz > MOST_STROKES_HZ && travel_m > STROKE_TRAVEL_M;
    if !fast_strokes && acceleration < MOST_ACCELERATION_M_PER_S2 && peak < MOST_SPEED_M_PER_S {
        return None;
    }
    let strokes = if strokes_hz > 0.0 {
        format!(
            ", makes {:.0} double strokes a minute and turns with {acceleration:.1} m/s2",
            60.0 * strokes_hz
        )
    } else {
        String::new()
    };
    let found = format!(
        "at {rate_hz} frames/s the head reaches {peak:.2} m/s{strokes}; wipers make at most 75 a minute and \
         stay below 3 m/s"
    );
    let advice = "check --frame-rate-hz, perhaps ten times too high, and --scale";
    Some(QualityFinding::advise(kind, (rate_hz, "Hz"), found, advice))
}

fn check_height(motion: &MotionSummary, range: [f64; 2], whose: &str) -> Option<QualityFinding> {
    let height_m = motion.blade_height_m?.abs();
    // (if each track has its own origin, the difference of the heights may be near zero)
    if height_m < BLADE_M[0] / 10.0 || (range[0]..=range[1]).contains(&height_m) {
        return None;
    }
    let [low, high] = range.map(|m| 1e3 * m);
    let found =
        format!("the head lies {:.3} mm from the tip; {whose}: {low:.2} to {high:.1} mm", 1e3 * height_m);
    let advice = "check --scale, the length of a pixel or of the unit of the file";
    Some(QualityFinding::advise((Check::Scale, Severity::Caution), (height_m, "m"), found, advice))
}

/// The summary as lines of the table of measurements.
pub(crate) fn motion_lines(motion: &MotionSummary) -> Vec<String> {
    let rows = [
        ("blade height", motion.blade_height_m, 1e3, "mm, median of head above tip"),
        ("travel", motion.travel_m, 1e3, "mm"),
        ("peak speed", motion.peak_speed_m_per_s, 1e3, "mm/s of the head"),
        ("median speed", motion.median_speed_m_per_s, 1e3, "mm/s of the head"),
        ("stroke", motion.stroke_s, 1.0, "s from turn to turn"),
        ("fastest seen", motion.fastest_oscillation_hz, 1.0, "Hz in the deflection, above the noise"),
    ];
    let line = |(name, value, factor, unit): (&str, Option<f64>, f64, &str)| {
        Some(format!("{name:<18}{:.4} {unit}", value? * factor))
    };
    rows.into_iter().filter_map(line).collect()
}
