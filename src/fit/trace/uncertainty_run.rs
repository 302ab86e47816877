//! What begins at the best end of a search: where shorter segments lead from there, how far the cost itself
//! lets each parameter go, and twins.

use super::checkpoint::{Checkpoint, Iterate, TraceSearchSettings, chi2_per_dof};
use super::initial_states::{RescuePolicy, fit_states};
use super::levenberg_marquardt::{outer_step, restart_stage};
use super::model::TraceModel;
use super::normal_equations::{TraceCovariance, recording_models, segments_cost, trace_covariance};
use super::segment_simulation::{SegmentResiduals, segment_residuals};
use crate::math;
use crate::math::StandardNormal;
use crate::recording::noise_model::AutoregressiveNoise;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;
use std::borrow::Cow;

/// Standard deviations of a two-sided 95 % interval.
pub(super) const Z_95: f64 = 1.959_963_984_540_054;

/// Starts that are tried, at most, until two of them end at the same place.
pub(crate) const MAX_STARTS: usize = 6;

/// Most twins of a search.
pub(crate) const MAX_TWINS: usize = 1000;
/// What a chain is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum UncertaintyRun {
    /// A twin of the data, fitted again.
    Twin(usize),
    /// The segments of the stage before, from the end.
    Shorter,
    /// An unknown away from its estimate, with everything else fitted again.
    Side {
        /// Number of the unknown.
        unknown: usize,
        /// Whether it is above the estimate.
        above: bool,
    },
}

impl UncertaintyRun {
    /// Number of its chain, behind those of the starts.
    pub(crate) fn chain_number(self) -> usize {
        MAX_STARTS
            + match self {
                Self::Twin(twin) => twin,
                Self::Shorter => MAX_TWINS,
                Self::Side { unknown, above } => MAX_TWINS + 1 + 2 * unknown + usize::from(above),
            }
    }

    /// What the chain with a number is for; `None` for a start.
    pub(crate) fn from_chain_number(chain: usize) -> Option<Self> {
        let number = chain.checked_sub(MAX_STARTS)?;
        Some(match number.checked_sub(MAX_TWINS) {
            None => Self::Twin(number),
            Some(0) => Self::Shorter,
            Some(side) => Self::Side { unknown: (side - 1) / 2, above: side % 2 == 0 },
        })
    }

    pub(super) fn is_twin(self) -> bool {
        matches!(self, Self::Twin(_))
    }

    /// Steps of its chain, at most: it begins near its end, where the linear model nearly holds.
    fn max_steps(self) -> usize {
        match self {
            Self::Twin(_) => 4,
            Self::Shorter => 6,
            Self::Side { .. } => 1,
        }
    }

    /// Whether its chain ends with an iterate.
    pub(super) fn is_complete(self, last: &Iterate) -> bool {
        last.settled || last.number >= self.max_steps()
    }
}

/// The end of a search, and what its branches need to know of it.
pub(crate) struct SearchEnd<'a> {
    pub model: &'a TraceModel,
    /// How it was searched.
    pub settings: &'a TraceSearchSettings,
    /// Seed of the job.
    pub seed: u64,
    pub at: &'a Iterate,
    pub covariance: TraceCovariance,
    /// Factor on variances: noise that is larger than measured widens everything.
    pub widening: f64,
    /// Standard deviation of each coordinate by curvature and segments.
    pub sd: Vec<f64>,
}

impl<'a> SearchEnd<'a> {
    /// `None` where the recordings do not determine the unknowns there.
    pub(crate) fn new(
        model: &'a TraceModel,
        settings: &'a TraceSearchSettings,
        seed: u64,
        at: &'a Iterate,
    ) -> Option<Self> {
        let covariance = trace_covariance(model, at)?;
        let widening = chi2_per_dof(at).0.max(1.0);
        let variance = |i: usize| (widening * covariance.curvature[(i, i)]).max(covariance.sandwich[(i, i)]);
        let sd = (0..at.point.len()).map(|i| variance(i).sqrt()).collect();
        Some(Self { model, settings, seed, at, covariance, widening, sd })
    }

    /// The branches that it has: none where some segments do not fit.
    pub(super) fn uncertainty_runs(&self) -> Vec<UncertaintyRun> {
        if !self.at.plain {
            return Vec::new();
        }
        let shorter = (self.at.stage > 0).then_some(UncertaintyRun::Shorter);
        let parameters = (0..self.at.point.len()).filter(|&i| self.model.unknowns.is_parameter(i));
        let sides =
            parameters.flat_map(|unknown| [false, true].map(|above| UncertaintyRun::Side { unknown, above }));
        shorter.into_iter().chain(sides).chain((0..self.settings.twins).map(UncertaintyRun::Twin)).collect()
    }

    /// How far an unknown is moved to look at the cost there.
    pub(super) fn profile_offset(&self, unknown: usize, above: bool) -> f64 {
        let far = Z_95 * self.sd.get(unknown).copied().unwrap_or_default();
        if above { far } else { -far }
    }
}

// The chains of iterates behind the best end of a search, which know nothing of each other.

/// Chains that are made together: the order of the iterates does not depend on the number of threads, and no
/// more of them are lost when the program is killed.
const RUNS_TOGETHER: usize = 8;

impl<'a> SearchEnd<'a> {
    /// The iterate of a branch after one, and the first one; `None` at its end.
    pub(crate) fn next_iterate(&self, branch: UncertaintyRun, before: Option<&Iterate>) -> Option<Iterate> {
        if before.is_some_and(|before| branch.is_complete(before)) {
            return None;
        }
        let root = self.run_start(branch);
        Some(before.map_or(root.first, |before| outer_step(&root.model, before)))
    }

    fn run_start(&self, branch: UncertaintyRun) -> RunStart<'a> {
        let (model, first) = match branch {
            UncertaintyRun::Twin(draw) => {
                let (model, first) = simulate_twin(self, draw);
                (Cow::Owned(model), first)
            }
            UncertaintyRun::Shorter => {
                let first =
                    restart_stage(self.model, self.settings, self.at.stage.saturating_sub(1), self.at);
                (Cow::Borrowed(self.model), first)
            }
            UncertaintyRun::Side { unknown, above } => {
                let (model, first) = pin_unknown(self, unknown, self.profile_offset(unknown, above));
                (Cow::Owned(model), first)
            }
        };
        // (a place that the scene refuses is an end too, which nothing is read from)
        let nowhere = || Iterate { cost: f64::MAX, settled: true, ..self.at.clone() };
        RunStart { model, first: Iterate { number: 0, ..first.unwrap_or_else(nowhere) } }
    }
}

/// Where a branch begins.
struct RunStart<'a> {
    model: Cow<'a, TraceModel>,
    first: Iterate,
}

/// A branch on its way.
struct RunProgress<'a> {
    branch: UncertaintyRun,
    root: Option<RunStart<'a>>,
    place: usize,
    last: Option<Iterate>,
}

impl RunProgress<'_> {
    fn is_open(&self) -> bool {
        !self.last.as_ref().is_some_and(|last| self.branch.is_complete(last))
    }

    fn accept_iterate(&mut self, next: Iterate) {
        (self.last, self.place) = (Some(next), self.place + 1);
    }
}

impl<'a> RunProgress<'a> {
    fn next_iterate(&mut self, end: &SearchEnd<'a>) -> Iterate {
        let root = self.root.get_or_insert_with(|| end.run_start(self.branch));
        self.last.as_ref().map_or_else(|| root.first.clone(), |last| outer_step(&root.model, last))
    }
}

/// Follows branches to their ends, several at once: the last iterate of each, in order, where the scene does
/// not refuse every place of it. `None` where it was asked to stop.
pub(super) fn follow_runs(
    end: &SearchEnd<'_>,
    branches: &[UncertaintyRun],
    keep: &mut dyn Checkpoint,
) -> Option<Vec<Option<Iterate>>> {
    let mut ends = Vec::new();
    // (twins are behind the others also where they are wanted later)
    let kinds = branches.chunk_by(|a, b| a.is_twin() == b.is_twin());
    for branches in kinds.flat_map(|kind| kind.chunks(RUNS_TOGETHER)) {
        let begun =
            |branch: &UncertaintyRun| RunProgress { branch: *branch, root: None, place: 0, last: None };
        let mut ways: Vec<RunProgress<'_>> = branches.iter().map(begun).collect();
        while ways.iter().any(RunProgress::is_open) {
            let mut due: Vec<&mut RunProgress<'_>> = Vec::new();
            for way in ways.iter_mut().filter(|way| way.is_open()) {
                match keep.find_iterate(way.branch.chain_number(), way.place) {
                    Some(known) => way.accept_iterate(known),
                    None => due.push(way),
                }
            }
            let made: Vec<Iterate> = due.par_iter_mut().map(|way| way.next_iterate(end)).collect();
            for (way, made) in due.into_iter().zip(made) {
                if keep.store_iterate(way.branch.chain_number(), way.place, &made).is_break() {
                    return None;
                }
                way.accept_iterate(made);
            }
        }
        ends.extend(ways.into_iter().map(|way| way.last.filter(|last| last.cost < f64::MAX)));
    }
    Some(ends)
}

// How far the cost itself lets a parameter go: the ends of an interval by curvature, looked at with
// everything else fitted again.

/// Deviation of the pin, in those of the parameter.
const PIN_SD: f64 = 1e-3;
/// Furthest that an end is moved outwards, in its distance by curvature.
const MAX_STRETCH: f64 = 3.0;

/// Distances from the estimates at which the cost has risen by what 95 % take, below and above, in the
/// coordinate; at least those of the curvature, and those for an unknown of which no side was looked at.
/// `sides` gives the last iterate of each branch.
pub(super) fn profile_distances<'s>(
    end: &SearchEnd<'_>,
    sides: impl Fn(UncertaintyRun) -> Option<&'s Iterate>,
) -> Vec<[f64; 2]> {
    let rise = Z_95 * Z_95 * end.widening;
    let one = |unknown: usize| {
        [false, true].map(|above| {
            let moved = end.profile_offset(unknown, above);
            let found = sides(UncertaintyRun::Side { unknown, above });
            let risen = found.map(|at| cost_rise(end, unknown, moved, at)).filter(|risen| risen.is_finite());
            // (a run that fails there stands for a rise)
            let stretch = risen.map_or(1.0, |risen| (rise / risen.max(1e-9)).sqrt());
            moved.abs() * stretch.clamp(1.0, MAX_STRETCH)
        })
    };
    (0..end.at.point.len()).map(one).collect()
}

/// Where unknown `i` is pinned.
fn pin_prior(end: &SearchEnd<'_>, i: usize, moved: f64) -> (f64, f64) {
    (end.at.point[i] + moved, PIN_SD * end.covariance.curvature[(i, i)].sqrt())
}

/// The model with unknown `i` pinned away from its estimate, and where the valley is thought to lie then.
pub(super) fn pin_unknown(end: &SearchEnd<'_>, i: usize, moved: f64) -> (TraceModel, Option<Iterate>) {
    let covariance = &end.covariance.curvature;
    let mut pinned = end.model.clone();
    let (at, sd) = pin_prior(end, i, moved);
    if let Some(unknown) = pinned.unknowns.0.get_mut(i) {
        unknown.prior = Some([at, sd]);
    }
    let along = |k: usize| end.at.point[k] + covariance[(k, i)] / covariance[(i, i)] * moved;
    let point: Vec<f64> = (0..end.at.point.len()).map(along).collect();
    let point = pinned.unknowns.clamp_to_ranges(&point);
    let mut segments = end.at.segments.clone();
    let first = recording_models(&pinned, &point).map(|points| {
        fit_states(&points, &mut segments, 2, RescuePolicy::Never);
        let cost = segments_cost(&segments, true) + pinned.unknowns.prior_cost(&point);
        Iterate { point, segments, cost, plain: true, settled: false, ..end.at.clone() }
    });
    (pinned, first)
}

/// By how much the cost rises to an iterate with unknown `i` pinned, without what the pin itself costs.
fn cost_rise(end: &SearchEnd<'_>, i: usize, moved: f64, at: &Iterate) -> f64 {
    let (pinned_at, sd) = pin_prior(end, i, moved);
    let prior = end.model.unknowns.0[i].prior;
    let own = prior.map_or(0.0, |[mean, sd]| math::powi((at.point[i] - mean) / sd, 2));
    at.cost - math::powi((at.point[i] - pinned_at) / sd, 2) + own - end.at.cost
}

// Parametric bootstrap of a trace fit: the data of the best end with other noise, fitted again from there
// (Efron and Tibshirani, An Introduction to the Bootstrap, 1993, chapter 6).

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_chain_has_a_number_of_its_own() {
        let sides =
            (0..20).flat_map(|unknown| [false, true].map(|above| UncertaintyRun::Side { unknown, above }));
        let branches: Vec<UncertaintyRun> =
            (0..MAX_TWINS).map(UncertaintyRun::Twin).chain([UncertaintyRun::Shorter]).chain(sides).collect();
        for (place, branch) in branches.iter().enumerate() {
            assert_eq!(
                (branch.chain_number(), UncertaintyRun::from_chain_number(branch.chain_number())),
                (MAX_STARTS + place, Some(*branch))
            );
        }
        assert_eq!(UncertaintyRun::from_chain_number(MAX_STARTS - 1), None);
    }
}
