//! Blades whose values are known, and what a camera and a tracking program make of them.

use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use wiperlab::fit::job::Job;
use wiperlab::fit::model::{Draw, Model};
use wiperlab::fit::scene_model::{Condition, Instrument, Plausible, SceneModel};
use wiperlab::fit::targets;
use wiperlab::recording::Recording;
use wiperlab::simulate::scene::Scene;
use wiperlab::twin::Camera;

/// Ranges of the truths, in the order of the job's parameters; drawn evenly in the logarithm.
const RANGES: [(f64, f64); 5] = [(0.07, 0.2), (2.5, 9.0), (0.2, 0.4), (0.0013, 0.0027), (0.018, 0.055)];
/// Length of a pixel, m, and noise of a tracked coordinate, pixels.
const PIXEL_M: f64 = 20e-6;
const NOISE_PX: f64 = 0.1;
pub const EXPOSURE_S: f64 = 5e-5;
/// Relative spread of the state in which a blade starts: the fit does not know it.
pub const SPREAD: f64 = 0.1;
/// Blades that are drawn for a twin, at most.
const TRIES: u64 = 200;

/// A twin, and the values behind it.
pub struct Twin {
    pub truth: Vec<f64>,
    pub frame_rate_hz: f64,
    pub dropout_fraction: f64,
    pub recording: Recording,
    /// Blades that were drawn before and did not do, by reason.
    pub refused: Vec<String>,
}

/// Twin number `number` of a seed: the first blade that stays in contact, flips, and shows every feature of
/// the job.
pub fn twin(scene: &Scene, job: &Job, number: u64, seed: u64) -> Twin {
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed ^ (number << 20));
    let frame_rate_hz = if number.is_multiple_of(2) { 5_000.0 } else { 10_000.0 };
    let dropout_fraction = 0.05 * generator.random::<f64>();
    let instrument = Instrument {
        camera: Camera { frame_rate_hz, exposure_s: EXPOSURE_S },
        noise_m: NOISE_PX * PIXEL_M,
        dropout_fraction,
    };
    let plausible = Plausible { spread: SPREAD, largest_tilt_rad: job.largest_tilt_rad };
    let model = SceneModel::new(
        vec![Condition { scene: scene.clone(), instrument }],
        job.parameter_names(),
        plausible,
    );
    let mut refused = Vec::new();
    for draw in 1..=TRIES {
        let truth: Vec<f64> =
            RANGES.iter().map(|(low, high)| low * (high / low).powf(generator.random::<f64>())).collect();
        let recording = match model.observe(
            &truth,
            0,
            Draw { member: 1_000 + draw, noise: seed + 1 + number, dropouts: true },
        ) {
            Ok(recording) => recording,
            Err(failure) => {
                refused.push(failure.reason.to_string());
                continue;
            }
        };
        match targets(job, &[Some(recording.clone())]) {
            Ok(_) => return Twin { truth, frame_rate_hz, dropout_fraction, recording, refused },
            Err(error) => refused.push(error.to_string()),
        }
    }
    panic!("none of {TRIES} blades does: {:?}", &refused[..refused.len().min(8)]);
}
