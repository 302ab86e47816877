//! Parametric bootstrap of a trace fit: the data of the best end with other noise, fitted again from there
//! (Efron and Tibshirani, An Introduction to the Bootstrap, 1993, chapter 6).

use super::branch::SearchEnd;
use super::iterate::Iterate;
use super::model::TraceModel;
use super::outer::{recording_models, segments_cost};
use super::residual::{SegmentResiduals, segment_residuals};
use super::states::{RescuePolicy, fit_states};
use crate::math::StandardNormal;
use crate::recording::noise_model::AutoregressiveNoise;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Steps of a segment's state before the first.
const TWIN_STATE_STEPS: usize = 3;
/// Frames before the first after which correlated noise has forgotten how it began.
const NOISE_WARM_UP_FRAMES: usize = 400;

/// Twin number `draw` of the data at the end of a search, and that end with its states fitted to it.
pub(super) fn simulate_twin(end: &SearchEnd<'_>, draw: usize) -> (TraceModel, Option<Iterate>) {
    let SearchEnd { model, at, .. } = end;
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(end.seed ^ ((draw as u64 + 1) << 40));
    let mut twin = TraceModel::clone(model);
    let widening = end.widening.sqrt();
    let noise: Vec<[Vec<f64>; 2]> = model
        .recordings
        .iter()
        .map(|shoot| {
            let [tip, drop] = &shoot.observation.settings.noise;
            let frames = shoot.observation.times_s.len();
            [draw_noise(tip, frames, &mut generator), draw_noise(drop, frames, &mut generator)]
        })
        .collect();
    for found in segment_residuals(model, at) {
        let SegmentResiduals { recording: film, is_drop, frames, residual_m, .. } = found;
        let data = &mut twin.recordings[film].observation;
        let column = if is_drop { &mut data.drop_m } else { &mut data.tip_x_m };
        for (frame, residual_m) in frames.into_iter().zip(residual_m) {
            let drawn = widening * noise[film][usize::from(is_drop)][frame];
            column[frame] = column[frame].map(|measured| measured + residual_m + drawn);
        }
    }
    // a prior is a measurement too
    for unknown in &mut twin.unknowns.0 {
        unknown.prior =
            unknown.prior.map(|[mean, sd]| [mean + sd * generator.sample::<f64, _>(StandardNormal), sd]);
    }
    let mut segments = at.segments.clone();
    let first = recording_models(&twin, &at.point).map(|points| {
        fit_states(&points, &mut segments, TWIN_STATE_STEPS, RescuePolicy::Never);
        let cost = segments_cost(&segments, true) + twin.unknowns.prior_cost(&at.point);
        Iterate { segments, cost, settled: false, ..Iterate::clone(at) }
    });
    (twin, first)
}

/// Noise in every frame, m.
fn draw_noise(noise: &AutoregressiveNoise, frames: usize, generator: &mut Xoshiro256PlusPlus) -> Vec<f64> {
    let mut values: Vec<f64> = Vec::with_capacity(NOISE_WARM_UP_FRAMES + frames);
    for _ in 0..NOISE_WARM_UP_FRAMES + frames {
        let before = noise.coefficients().iter().zip(values.iter().rev());
        let kept: f64 = before.map(|(coefficient, value)| coefficient * value).sum();
        values.push(kept + noise.innovation_sd() * generator.sample::<f64, _>(StandardNormal));
    }
    values.split_off(NOISE_WARM_UP_FRAMES)
}
