//! The slow motion of a record, by local regression (Cleveland 1979, *J. Am. Stat. Assoc.* 74).

use nalgebra::{Matrix4, Vector4};
use portable_math as math;
use std::f64::consts::PI;

/// Half width of the frames around a frame to which a cubic is fitted, as a multiple of the period at the
/// lower end of the band. With Hann weights and many frames per period, the cubic removes 6 % of an
/// oscillation with this period, 91 % of one 2.5 times as slow and 98 % of one four times as slow.
const HALF_WIDTH: f64 = 1.25;
/// Minimum number of frames with a value around a frame: two for each coefficient of the cubic. It is also
/// the smallest half width, frames, so that half of the frames may be lost.
const FEWEST_FRAMES: usize = 8;

/// A record without the motion that is slower than `low_hz`. From the value of each frame, a cubic that is
/// fitted to the frames around it is subtracted. `None` for a frame without a value, and for one with too few
/// values around it.
pub fn subtract_slow_motion(samples: &[Option<f64>], frame_rate_hz: f64, low_hz: f64) -> Vec<Option<f64>> {
    let half = ((HALF_WIDTH * frame_rate_hz / low_hz).ceil() as usize).min(samples.len()).max(FEWEST_FRAMES);
    let weight = |apart: usize| 0.5 + 0.5 * math::cos(PI * apart as f64 / (half + 1) as f64);
    let weights: Vec<f64> = (0..=half).map(weight).collect();
    let slow_m = |i: usize| {
        let first = i.saturating_sub(half);
        let around = &samples[first..(i + half + 1).min(samples.len())];
        if around.iter().flatten().count() < FEWEST_FRAMES {
            return None;
        }
        let (mut normal, mut right) = (Matrix4::zeros(), Vector4::zeros());
        for (j, x) in (first..).zip(around) {
            let Some(x) = x else { continue };
            let at = (j as f64 - i as f64) / half as f64;
            let row = Vector4::new(1.0, at, at * at, at * at * at);
            let weighted = weights[j.abs_diff(i)] * row;
            normal += weighted * row.transpose();
            right += weighted * *x;
        }
        normal.cholesky().map(|factor| factor.solve(&right)[0])
    };
    let fast_m = |(i, x): (usize, &Option<f64>)| Some((*x)? - slow_m(i)?);
    samples.iter().enumerate().map(fast_m).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn a_cubic_and_a_slow_oscillation_go_and_a_fast_one_stays() {
        let rate_hz = 5000.0;
        let left = |value: &dyn Fn(f64) -> f64, is_tracked: fn(u32) -> bool| {
            let frame = |i: u32| is_tracked(i).then(|| value(f64::from(i) / rate_hz));
            let record: Vec<Option<f64>> = (0..1000).map(frame).collect();
            let left = subtract_slow_motion(&record, rate_hz, 400.0);
            left[50..950].iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()))
        };
        let has_gaps = |i: u32| i % 7 != 2 && !(300..320).contains(&i);
        assert!(left(&|t| 1.0 + 3.0 * t - 40.0 * t * t + 90.0 * t * t * t, has_gaps) < 1e-9);
        assert!(left(&|t| (TAU * 75.0 * t).sin(), has_gaps) < 0.01);
        let fast = left(&|t| (TAU * 800.0 * t).sin(), |_| true);
        assert!((fast - 1.0).abs() < 0.03, "{fast}");
        assert_eq!(subtract_slow_motion(&[Some(1.0), None, Some(2.0)], rate_hz, 400.0), [None; 3]);
        assert_eq!(subtract_slow_motion(&[], rate_hz, 400.0), []);
    }
}
