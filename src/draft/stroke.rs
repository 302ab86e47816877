//! Estimates the stroke of a head that was not tracked from the motion of the tip.
//!
//! A sliding tip trails the head by a nearly constant length `d`. So the position of the tip is
//! `x = c + d s + P cos(w t) + Q sin(w t)`, where `s` is the sign of the velocity of the tip. The model is
//! linear in all parameters except the angular frequency `w`.

use crate::recording::Recording;
use crate::recording::channel::mean_speed_m_per_s;
use nalgebra::{DMatrix, DVector};
use portable_math as math;
use std::f64::consts::TAU;

/// Motion of the head, `a (1 - cos(2 pi f (t - t0)))`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stroke {
    pub amplitude_m: f64,
    pub frequency_hz: f64,
    pub delay_s: f64,
}

/// The part of the stroke that the user knows.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct KnownStroke {
    pub amplitude_m: Option<f64>,
    pub frequency_hz: Option<f64>,
}

/// A stroke, and the position in the recording at which it starts, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct EstimatedStroke {
    pub stroke: Stroke,
    pub origin_m: f64,
}

/// Range of stroke frequencies of wipers and rigs, Hz.
const FREQUENCIES_HZ: [f64; 2] = [0.05, 5.0];
/// Number of intervals of the coarse grid of frequencies.
const COARSE: usize = 200;
/// Number of steps of the ternary search around the best frequency of the coarse grid.
const REFINED: usize = 60;
/// Time, s, over which the speed of the tip is averaged.
const SPEED_S: f64 = 0.01;
/// The tip counts as sliding if its speed is above this fraction of its maximum speed.
const SLIDING: f64 = 0.3;

/// Estimates the stroke that the tip follows; `None` if the tip does not slide enough.
pub(super) fn estimate_stroke(recording: &Recording, known: KnownStroke) -> Option<EstimatedStroke> {
    let sliding = select_sliding(recording);
    let fit =
        |frequency_hz: f64| fit_terms(&sliding, frequency_hz).map(|found| (found.0, frequency_hz, found.1));
    let frequency_hz = known.frequency_hz.or_else(|| {
        let [low, high] = FREQUENCIES_HZ;
        let place = |i: usize| low * math::powf(high / low, i as f64 / COARSE as f64);
        let best = (0..=COARSE).filter_map(|i| fit(place(i))).min_by(|a, b| a.0.total_cmp(&b.0))?;
        let step = math::powf(high / low, 1.0 / COARSE as f64);
        let mut range = [best.1 / step, best.1 * step];
        for _ in 0..REFINED {
            let third = (range[1] - range[0]) / 3.0;
            let [a, b] = [range[0] + third, range[1] - third];
            if fit(a)?.0 < fit(b)?.0 { range[1] = b } else { range[0] = a }
        }
        Some(0.5 * (range[0] + range[1]))
    })?;
    let (_, _, [middle_m, _, cosine, sine]) = fit(frequency_hz)?;
    let amplitude_m = known.amplitude_m.unwrap_or_else(|| math::hypot(cosine, sine));
    let delay_s = math::atan2(-sine, -cosine) / (TAU * frequency_hz);
    let stroke = Stroke { amplitude_m, frequency_hz, delay_s };
    Some(EstimatedStroke { stroke, origin_m: middle_m - amplitude_m })
}

/// Mean time, s, mean position, m, and sign of the velocity of the sliding tip, once per [`SPEED_S`].
fn select_sliding(recording: &Recording) -> Vec<[f64; 3]> {
    let (grid, tip) = (recording.grid(), &recording.traces().tip_x_m);
    let step = ((SPEED_S * grid.frame_rate_hz) as usize).max(2);
    let at = |first: usize| {
        let frames = first..(first + step).min(grid.frames);
        let speed = mean_speed_m_per_s(tip, grid.frame_rate_hz, frames.clone())?;
        let present: Vec<(f64, f64)> = frames.filter_map(|i| Some((grid.time_s(i), tip[i]?))).collect();
        let count = present.len() as f64;
        let mean = present.iter().fold([0.0; 2], |sum, (t, x)| [sum[0] + t / count, sum[1] + x / count]);
        Some([mean[0], mean[1], speed])
    };
    let all: Vec<[f64; 3]> = (0..grid.frames).step_by(step).filter_map(at).collect();
    let greatest = all.iter().map(|[.., speed]| speed.abs()).fold(0.0, f64::max);
    let slides = all.into_iter().filter(|[.., speed]| speed.abs() > SLIDING * greatest);
    slides.map(|[t, x, speed]| [t, x, speed.signum()]).collect()
}

/// Fits the stroke for a given frequency. Returns the mean squared residual, m2, and the terms `c`, `d`, `P`
/// and `Q`, m. While the blade flips, the tip does not trail the head; so points far from a first fit are
/// left out of a second fit.
fn fit_terms(sliding: &[[f64; 3]], frequency_hz: f64) -> Option<(f64, [f64; 4])> {
    /// Residuals above this multiple of their median are left out.
    const FAR: f64 = 4.0;
    let all: Vec<usize> = (0..sliding.len()).collect();
    let (left, _) = solve_terms(sliding, &all, frequency_hz)?;
    let mut sorted = left.clone();
    sorted.sort_by(f64::total_cmp);
    let most = FAR * sorted.get(sorted.len() / 2)?;
    let near: Vec<usize> = all.into_iter().filter(|i| left[*i] <= most).collect();
    let (left, found) = solve_terms(sliding, &near, frequency_hz)?;
    Some((left.iter().map(|r| r * r).sum::<f64>() / left.len() as f64, found))
}

/// Absolute residuals, m, and the least-squares solution for the terms, from the points `used` only.
fn solve_terms(sliding: &[[f64; 3]], used: &[usize], frequency_hz: f64) -> Option<(Vec<f64>, [f64; 4])> {
    /// Minimum number of points: twice the number of terms.
    const FEWEST: usize = 8;
    let both_sides = [1.0, -1.0].iter().all(|side| used.iter().any(|i| sliding[*i][2] == *side));
    if !both_sides || used.len() < FEWEST {
        return None;
    }
    let terms = DMatrix::from_fn(used.len(), 4, |row, column| {
        let [t, _, side] = sliding[used[row]];
        let (sine, cosine) = math::sin_cos(TAU * frequency_hz * t);
        [1.0, side, cosine, sine][column]
    });
    let places = DVector::from_fn(used.len(), |row, _| sliding[used[row]][1]);
    let found = terms.clone().svd(true, true).solve(&places, 1e-12).ok()?;
    let left = (terms * &found - places).iter().map(|r| r.abs()).collect();
    Some((left, [found[0], found[1], found[2], found[3]]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{FrameGrid, Traces};

    /// A tip that trails a head by 1.2 mm, in a picture where the stroke starts 30 mm from the origin.
    fn recording(stroke: Stroke, start_s: f64, length_s: f64) -> Recording {
        let grid = FrameGrid { start_s, frame_rate_hz: 2000.0, frames: (length_s * 2000.0) as usize };
        let tip = |i: usize| {
            let angle = TAU * stroke.frequency_hz * (grid.time_s(i) - stroke.delay_s);
            0.03 + stroke.amplitude_m * (1.0 - angle.cos()) - 1.2e-3 * angle.sin().signum()
        };
        let nothing = vec![None; grid.frames];
        let traces = Traces {
            tip_x_m: (0..grid.frames).map(|i| Some(tip(i))).collect(),
            tip_y_m: nothing.clone(),
            head_x_m: nothing.clone(),
            head_y_m: nothing,
            ..Traces::default()
        };
        Recording::new("tip", grid, traces, true).unwrap()
    }

    #[test]
    fn the_stroke_of_a_tip_that_trails_evenly_is_found() {
        let stroke = Stroke { amplitude_m: 0.045, frequency_hz: 0.75, delay_s: 0.21 };
        for (start_s, length_s) in [(0.0, 3.0), (17.3, 1.5)] {
            let found = super::estimate_stroke(&recording(stroke, start_s, length_s), KnownStroke::default())
                .unwrap();
            let turns = (found.stroke.delay_s - stroke.delay_s) * stroke.frequency_hz;
            assert!((found.stroke.frequency_hz / 0.75 - 1.0).abs() < 1e-3, "{found:?}");
            assert!((found.stroke.amplitude_m / 0.045 - 1.0).abs() < 1e-2, "{found:?}");
            assert!(
                (turns - turns.round()).abs() < 2e-2 && (found.origin_m - 0.03).abs() < 1e-3,
                "{found:?}"
            );
        }
        let known = KnownStroke { amplitude_m: Some(0.0453), frequency_hz: Some(0.75) };
        let found = super::estimate_stroke(&recording(stroke, 0.0, 3.0), known).unwrap();
        assert_eq!((found.stroke.amplitude_m, found.stroke.frequency_hz), (0.0453, 0.75));
        assert!((found.stroke.delay_s - 0.21).abs() < 1e-3, "{found:?}");
    }

    #[test]
    fn a_tip_that_goes_one_way_shows_no_stroke() {
        let stroke = Stroke { amplitude_m: 0.045, frequency_hz: 0.75, delay_s: 0.0 };
        assert_eq!(super::estimate_stroke(&recording(stroke, 0.1, 0.4), KnownStroke::default()), None);
    }
}
