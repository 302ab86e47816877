//! What a camera and a tracking program do besides white noise.

use crate::truth::PIXEL_M;
use portable_math::StandardNormal;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::TAU;
use wiperlab::recording::Recording;

/// Correlation of the noise of frames 0.2 ms apart, and its standard deviation, m; half its variance is
/// common to both points.
const CORRELATION: f64 = 0.6;
const NOISE_M: f64 = 2e-6;
const TILT_DEG: f64 = 0.3;
const SCALE: f64 = 1.005;
/// The head's marker against the hinge, m.
const MARKER_M: [f64; 2] = [1.5e-4, 2e-4];
/// Share of the frames in which a point is lost.
const LOST: f64 = 0.03;
/// Bias of a place within its pixel, pixels.
const LOCKING: f64 = 0.05;

/// A film without noise as such a camera shows it.
pub fn spoilt(clean: &Recording, seed: u64) -> Recording {
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed);
    let rho = CORRELATION.powf(5_000.0 / clean.grid().frame_rate_hz);
    let mut noise = [0.0_f64; 6];
    let mut traces = clean.traces().clone();
    for i in 0..clean.grid().frames {
        for value in &mut noise {
            let fresh: f64 = generator.sample(StandardNormal);
            *value = rho * *value + (1.0 - rho * rho).sqrt() * fresh;
        }
        let [common_x, common_y, tip_x, tip_y, head_x, head_y] = noise;
        let mut see = |x: &mut Option<f64>, y: &mut Option<f64>, marker: [f64; 2], own: [f64; 2]| {
            let is_lost = generator.random::<f64>() < LOST;
            let place = x.zip(*y).filter(|_| !is_lost).map(|(x, y)| {
                let (sine, cosine) = TILT_DEG.to_radians().sin_cos();
                let (x, y) = (x + marker[0], y + marker[1]);
                let share = NOISE_M / 2.0_f64.sqrt();
                [
                    locked(SCALE * (x * cosine - y * sine) + share * (common_x + own[0])),
                    locked(SCALE * (x * sine + y * cosine) + share * (common_y + own[1])),
                ]
            });
            (*x, *y) = (place.map(|place| place[0]), place.map(|place| place[1]));
        };
        see(&mut traces.tip_x_m[i], &mut traces.tip_y_m[i], [0.0; 2], [tip_x, tip_y]);
        see(&mut traces.head_x_m[i], &mut traces.head_y_m[i], MARKER_M, [head_x, head_y]);
    }
    Recording::new("synthetic", clean.grid(), traces, true).expect("the frames of a recording")
}

/// A place as a tracker reads it that is drawn to the middle of pixels.
fn locked(place_m: f64) -> f64 {
    place_m + LOCKING * PIXEL_M * (TAU * place_m / PIXEL_M).sin()
}
