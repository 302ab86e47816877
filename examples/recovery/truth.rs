//! Blades whose values are known, and what a camera and a tracking program make of them.

use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use wiperlab::fit::job::Job;
use wiperlab::fit::measure_targets;
use wiperlab::fit::model::{Draw, Model};
use wiperlab::fit::scene_model::{Instrument, ModelCondition, PlausibilityLimits, SceneModel};
use wiperlab::recording::Recording;
use wiperlab::simulate::scene::Scene;
use wiperlab::simulate::twin::Camera;

/// Ranges of the truths, in the order of the job's parameters; drawn evenly in the logarithm.
const RANGES: [(f64, f64); 5] = [(0.07, 0.2), (2.5, 9.0), (0.2, 0.4), (0.0013, 0.0027), (0.018, 0.055)];
/// Length of a pixel, m, and noise of a tracked coordinate, pixels.
pub const PIXEL_M: f64 = 20e-6;
const NOISE_PX: f64 = 0.1;
pub const EXPOSURE_S: f64 = 5e-5;
/// Relative spread of the state in which a blade starts: the fit does not know it.
pub const SPREAD: f64 = 0.1;
/// Blades that are drawn for a twin, at most.
const TRIES: u64 = 200;

/// A blade: its values, and the start that nobody knows.
pub struct Blade {
    pub truth: Vec<f64>,
    start: u64,
    /// Frames a second and share of lost points of its usual film.
    usual: (f64, f64),
}

/// How a blade is filmed, where that is not as usual.
#[derive(Clone, Copy, Default)]
pub struct Filming {
    pub frame_rate_hz: Option<f64>,
    pub dropout_fraction: Option<f64>,
    /// Which noise is drawn.
    pub draw: u64,
}

/// Blade number `number`: the first that stays in contact, flips, and shows every feature of the job to the
/// usual camera.
pub fn blade(scene: &Scene, job: &Job, number: u64) -> Blade {
    const SEED: u64 = 1;
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(SEED ^ (number << 20));
    let frame_rate_hz = if number.is_multiple_of(2) { 5_000.0 } else { 10_000.0 };
    let usual = (frame_rate_hz, 0.05 * generator.random::<f64>());
    for start in 1..=TRIES {
        let mut drawn = |(low, high): (f64, f64)| low * (high / low).powf(generator.random::<f64>());
        let blade = Blade { truth: RANGES.map(&mut drawn).to_vec(), start, usual };
        let shown = blade.film(scene, job, number, Filming::default());
        if shown.is_some_and(|recording| measure_targets(job, &[Some(recording)]).is_ok()) {
            return blade;
        }
    }
    panic!("none of {TRIES} blades does");
}

impl Blade {
    /// A film of it in a scene; `None` where the model cannot run there.
    pub fn film(&self, scene: &Scene, job: &Job, number: u64, filming: Filming) -> Option<Recording> {
        let Filming { frame_rate_hz, dropout_fraction, draw } = filming;
        let camera = Camera { frame_rate_hz: frame_rate_hz.unwrap_or(self.usual.0), exposure_s: EXPOSURE_S };
        let instrument = Instrument {
            camera,
            noise_m: NOISE_PX * PIXEL_M,
            dropout_fraction: dropout_fraction.unwrap_or(self.usual.1),
        };
        let plausible = PlausibilityLimits { spread: SPREAD, largest_tilt_rad: job.largest_tilt_rad };
        let condition = ModelCondition { scene: scene.clone(), instrument };
        let model = SceneModel::new(vec![condition], job.parameter_names(), plausible);
        let draw = Draw { member: 1_000 + self.start, noise: 2 + number + 1_000 * draw, dropouts: true };
        model.record_condition(&self.truth, 0, draw).ok()
    }
}
