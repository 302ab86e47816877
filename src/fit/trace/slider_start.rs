//! Values with which the search of a slider starts, from its equation of motion:
//!
//! ```text
//! m x'' = k (v - x) + d (v' - x') - sign(x') c N + f
//! ```
//!
//! It is linear in friction, stiffness, damping and a constant force, which offsets of the sensors also give.
//! Parabolas through neighbouring frames give the motion while the slider slips.

use super::iterate::is_slider;
use super::model::TraceModel;
use super::segmentation::{half_width_frames, least_sliding_speed};
use crate::model::parameters::name_if_in_recording;
use nalgebra::{DMatrix, DVector};

/// Parameters of the terms of the equation, in the order of the terms.
const TERMS: [&str; 3] = ["friction.c", "slider.stiffness_n_per_m", "slider.damping_n_s_per_m"];
/// Fraction of the range of an unknown, at either end, in which no search starts.
const EDGE: f64 = 0.1;

/// The point with the least-squares values of the unknowns that are terms of the equation, from the first or,
/// if `half` is 1, the second half of all recordings. `None` for a blade, and if too few frames show slip.
pub(super) fn regress_motion(model: &TraceModel, point: &[f64], half: usize) -> Option<Vec<f64>> {
    let unknowns = &model.unknowns;
    let free: Vec<usize> = unknowns.parameters().filter(|&i| unknowns.0[i].prior.is_none()).collect();
    let count = free.len() + model.recordings.len();
    if !is_slider(model) || free.is_empty() {
        return None;
    }
    let (mut matrix, mut right) = (DMatrix::zeros(count, count), DVector::zeros(count));
    for (film, shoot) in model.recordings.iter().enumerate() {
        let scene = unknowns.scene_at(shoot, film, point)?;
        let slider = scene.linkage.slider()?;
        let known = [scene.linkage.friction.c, slider.spring.stiffness, slider.spring.damping];
        let place = |term: &str| {
            let is_own = |i: &usize| {
                unknowns.parameter_name(*i).and_then(|name| name_if_in_recording(name, shoot.condition))
                    == Some(term)
            };
            free.iter().position(is_own)
        };
        let places = TERMS.map(place);
        let seen = &shoot.observation;
        let ([first, last], width) = (seen.settings.frames, half_width_frames(seen).max(2));
        let middle = first.midpoint(last);
        let frames = if half == 0 { first..middle } else { middle..last };
        for frame in frames.start.max(width)..frames.end.min(seen.times_s.len() - width) {
            let window = frame - width..=frame + width;
            let Some(tip) = seen.tip_x_m[window.clone()].iter().copied().collect::<Option<Vec<f64>>>() else {
                continue;
            };
            let [x, speed, acceleration] = fit_even_parabola(&tip, seen.rate_hz);
            if speed.abs() <= least_sliding_speed(seen) {
                continue;
            }
            let [head, head_speed, _] = fit_even_parabola(&seen.head_m[window], seen.rate_hz);
            let terms = [-speed.signum() * slider.normal_force_n, head - x, head_speed - speed];
            let mut row = DVector::zeros(count);
            row[free.len() + film] = 1.0;
            let mut force_n = slider.mass_kg * acceleration;
            for ((term, place), value) in terms.into_iter().zip(places).zip(known) {
                match place {
                    Some(place) => row[place] = term,
                    None => force_n -= value * term,
                }
            }
            matrix += &row * row.transpose();
            right += row * force_n;
        }
    }
    // unknowns that are no terms keep their values
    let used: Vec<usize> = (0..count).filter(|&k| matrix[(k, k)] > 0.0).collect();
    let size = |k: usize| f64::sqrt(matrix[(k, k)]);
    let scaled = DMatrix::from_fn(used.len(), used.len(), |a, b| {
        matrix[(used[a], used[b])] / (size(used[a]) * size(used[b]))
    });
    let scaled_right = DVector::from_fn(used.len(), |a, _| right[used[a]] / size(used[a]));
    let found = scaled.cholesky()?.solve(&scaled_right);
    let mut start = point.to_vec();
    for (k, value) in used.into_iter().zip(found.iter()).filter(|(k, _)| *k < free.len()) {
        let (unknown, [low, high]) = (&unknowns.0[free[k]], unknowns.0[free[k]].range);
        let coordinate = unknown.coordinate((value / size(k)).max(f64::MIN_POSITIVE));
        let edge = EDGE * (high - low);
        start[free[k]] = coordinate.clamp(low + edge, high - edge);
    }
    Some(start)
}

/// Value and first and second derivative in the middle of the parabola through an odd number of values at a
/// constant rate, 1/s.
fn fit_even_parabola(values: &[f64], rate_hz: f64) -> [f64; 3] {
    let middle = (values.len() / 2) as f64;
    let mut sums = [0.0; 6];
    for (k, y) in values.iter().enumerate() {
        let place = k as f64 - middle;
        let square = place * place;
        let terms = [1.0, square, square * square, *y, place * y, square * y];
        sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
    }
    let [count, second, fourth, y, first_y, second_y] = sums;
    let bend = (count * second_y - second * y) / (count * fourth - second * second);
    [(y - bend * second) / count, first_y / second * rate_hz, 2.0 * bend * rate_hz * rate_hz]
}

#[cfg(test)]
mod tests {
    use super::fit_even_parabola;

    #[test]
    fn a_parabola_is_found() {
        let values: Vec<f64> = (-3..=3).map(|k| f64::from(k) * 0.1).map(|t| 2.0 - t + 3.0 * t * t).collect();
        let found = fit_even_parabola(&values, 10.0);
        assert!(found.iter().zip([2.0, -1.0, 6.0]).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
    }
}
