//! Chi2 that the errors of the recorded head add to the fit of a slider.
//!
//! The spring of a slider passes on the errors of its head. They accumulate during a run, most of all those
//! near the natural frequency, so chi2 grows with the length of the segments although the model is right.
//! (The natural frequency of a blade is far above the frequencies at which its head moves. Its tip follows
//! the errors of the head, and the starting states absorb them.)

use super::initial_states::RescuePolicy;
use super::iterate::{Iterate, chi2_per_dof, is_slider};
use super::levenberg_marquardt::refit;
use super::model::TraceModel;
use crate::simulate::scene::Drive;
use portable_math::StandardNormal;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::sync::Arc;

/// Number of pairs of heads that are drawn.
const PAIRS: usize = 3;
/// Number of steps in the fit of each starting state to a drawn head.
const STATE_STEPS: usize = 2;

/// Mean rise of chi2 per degree of freedom by errors of the recorded heads; 0 for a blade. The errors are
/// drawn in pairs that differ in the sign, so that the terms of first order cancel.
pub(crate) fn chi2_by_head_errors(model: &TraceModel, at: &Iterate, seed: u64) -> f64 {
    if !is_slider(model) || at.is_junk(model) {
        return 0.0;
    }
    let own = chi2_per_dof(model, at).0;
    let rise = |draw: usize| {
        let sign = if draw.is_multiple_of(2) { 1.0 } else { -1.0 };
        let drawn = draw_heads(model, seed ^ ((draw as u64 / 2 + 1) << 48), sign);
        let refitted = refit(&drawn, at.clone(), STATE_STEPS, RescuePolicy::Never)?;
        Some(chi2_per_dof(&drawn, &refitted).0 - own).filter(|rise| rise.is_finite())
    };
    let rises: Vec<f64> = (0..2 * PAIRS).filter_map(rise).collect();
    (rises.iter().sum::<f64>() / rises.len().max(1) as f64).max(0.0)
}

/// The model with other heads, whose errors are drawn as they are expected and multiplied by `sign`.
fn draw_heads(model: &TraceModel, seed: u64, sign: f64) -> TraceModel {
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut drawn = model.clone();
    for shoot in &mut drawn.recordings {
        let Some(curve) = &shoot.observation.own_curve else { continue };
        let curve = Arc::new(curve.draw_like(|| sign * generator.sample::<f64, _>(StandardNormal)));
        let seen = &mut shoot.observation;
        seen.head_m = seen.times_s.iter().map(|t| curve.motion_at(*t).position_m).collect();
        seen.own_curve = Some(Arc::clone(&curve));
        shoot.scene.drive = Drive::Recorded(curve);
    }
    drawn
}
