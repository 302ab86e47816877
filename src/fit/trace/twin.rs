//! Parametric bootstrap of a trace fit: the data of the best end with other noise, fitted again from there
//! (Efron and Tibshirani, An Introduction to the Bootstrap, 1993, chapter 6).

use super::assess::chi2_per_dof;
use super::chain::stepped;
use super::iterate::Iterate;
use super::keep::Keep;
use super::model::TraceModel;
use super::outer::{cost, points};
use super::residual::{SegmentResiduals, residuals};
use super::search::MOST_STARTS;
use super::states::{Rescue, settle};
use crate::math::StandardNormal;
use crate::recording::noise_model::Ar;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Steps of a refit: twins differ by a few deviations, where the linear model nearly holds.
const STEPS: usize = 4;
/// Steps of a segment's state before the first.
const INNER: usize = 3;
/// Frames before the first after which correlated noise has forgotten how it began.
const FORGOTTEN: usize = 400;

/// A twin of the recordings at an end of a search.
pub struct Twin {
    model: TraceModel,
    first: Option<Iterate>,
}

impl Twin {
    /// Twin number `draw` of the data at `end`.
    #[must_use]
    pub fn new(model: &TraceModel, end: &Iterate, seed: u64, draw: usize) -> Self {
        let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed ^ ((draw as u64 + 1) << 40));
        let mut twin = TraceModel { shoots: model.shoots.clone(), unknowns: model.unknowns.clone() };
        let widening = chi2_per_dof(end).0.max(1.0).sqrt();
        let noise: Vec<[Vec<f64>; 2]> = model
            .shoots
            .iter()
            .map(|shoot| {
                let [tip, drop] = &shoot.film.settings.noise;
                let frames = shoot.film.times_s.len();
                [drawn(tip, frames, &mut generator), drawn(drop, frames, &mut generator)]
            })
            .collect();
        for found in residuals(model, end) {
            let SegmentResiduals { film, is_drop, frames, residual_m, .. } = found;
            let data = &mut twin.shoots[film].film;
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
        let first = begun(&twin, end);
        Self { model: twin, first }
    }

    /// The iterate after one, and the first one; `None` at the end.
    #[must_use]
    pub fn next(&self, before: Option<&Iterate>) -> Option<Iterate> {
        match before {
            None => self.first.clone(),
            Some(before) if before.settled || before.number >= STEPS => None,
            Some(before) => Some(stepped(&self.model, before)),
        }
    }
}

/// The end of a search, its states fitted to a twin.
fn begun(twin: &TraceModel, end: &Iterate) -> Option<Iterate> {
    let points = points(twin, &end.point)?;
    let mut segments = end.segments.clone();
    settle(&points, &mut segments, INNER, Rescue::Never);
    let cost = cost(&segments, true) + twin.unknowns.prior_cost(&end.point);
    cost.is_finite().then(|| Iterate { segments, cost, settled: false, number: 0, ..end.clone() })
}

/// Noise in every frame, m.
fn drawn(noise: &Ar, frames: usize, generator: &mut Xoshiro256PlusPlus) -> Vec<f64> {
    let mut values: Vec<f64> = Vec::with_capacity(FORGOTTEN + frames);
    for _ in 0..FORGOTTEN + frames {
        let before = noise.coefficients().iter().zip(values.iter().rev());
        let kept: f64 = before.map(|(coefficient, value)| coefficient * value).sum();
        values.push(kept + noise.innovation_sd() * generator.sample::<f64, _>(StandardNormal));
    }
    values.split_off(FORGOTTEN)
}

/// Places at which `twins` twins were fitted again, one each; `None` where the search was asked to stop. The
/// chain of twin `k` has the number `MOST_STARTS + k`.
pub(super) fn refits(
    model: &TraceModel,
    end: &Iterate,
    seed: u64,
    twins: usize,
    keep: &mut dyn Keep,
) -> Option<Vec<Vec<f64>>> {
    let mut found = Vec::new();
    for draw in 0..twins {
        let twin = std::cell::LazyCell::new(|| Twin::new(model, end, seed, draw));
        let (mut current, mut place): (Option<Iterate>, usize) = (None, 0);
        loop {
            let chain = MOST_STARTS + draw;
            let known = keep.known(chain, place);
            let is_new = known.is_none();
            let Some(next) = known.or_else(|| twin.next(current.as_ref())) else { break };
            if is_new && keep.add(chain, place, &next).is_break() {
                return None;
            }
            (current, place) = (Some(next), place + 1);
        }
        found.extend(current.map(|at| at.point));
    }
    Some(found)
}
