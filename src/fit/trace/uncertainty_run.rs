//! Fits that start from the best end of a search to determine the uncertainty: a fit with shorter segments,
//! fits with each parameter shifted to either side (profile), and fits to simulated recordings (twins;
//! parametric bootstrap).

use super::initial_states::RescuePolicy;
use super::iterate::{Iterate, TraceDescent, TraceSearchSettings, chi2_per_dof};
use super::levenberg_marquardt::{outer_step, refit, start_stage};
use super::lobes::MAX_LOBES;
use super::model::{TraceModel, TraceRecording};
use super::normal_equations::{TraceCovariance, trace_covariance};
use super::segment_simulation::{SegmentResiduals, segment_residuals};
use crate::fit::journal::Journal;
use crate::recording::noise::AutoregressiveNoise;
use nalgebra::DMatrix;
use portable_math as math;
use portable_math::StandardNormal;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::borrow::Cow;
use std::sync::OnceLock;

/// Half width of a two-sided 95 % interval, in standard deviations of a normal variable.
pub(crate) const Z_95: f64 = 1.959_963_984_540_054;

/// Maximum number of starts. A search ends sooner if two starts end in the same minimum.
pub(crate) const MAX_STARTS: usize = 6;

/// Number of the first chain of an uncertainty run.
const FIRST_RUN_CHAIN: usize = MAX_STARTS + MAX_LOBES;

/// Maximum number of twins of a search.
pub(crate) const MAX_TWINS: usize = 1000;

/// Purpose of a run that starts at the best end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum UncertaintyRun {
    /// A fit to the data of the twin with this number.
    Twin(usize),
    /// A fit with the shorter segments of the previous stage.
    Shorter,
    /// A fit in which one unknown is held at a fixed distance from its estimate.
    Side {
        /// Index of the unknown.
        unknown: usize,
        /// Whether the unknown is held above its estimate.
        above: bool,
    },
}

impl UncertaintyRun {
    /// Number of the chain of this run; the chains of the starts and lobes have lower numbers.
    pub(crate) fn chain_number(self) -> usize {
        FIRST_RUN_CHAIN
            + match self {
                Self::Twin(twin) => twin,
                Self::Shorter => MAX_TWINS,
                Self::Side { unknown, above } => MAX_TWINS + 1 + 2 * unknown + usize::from(above),
            }
    }

    /// The run whose chain has the number `chain`; `None` if it is the chain of a start or of a lobe.
    pub(crate) fn from_chain_number(chain: usize) -> Option<Self> {
        let number = chain.checked_sub(FIRST_RUN_CHAIN)?;
        Some(match number.checked_sub(MAX_TWINS) {
            None => Self::Twin(number),
            Some(0) => Self::Shorter,
            Some(side) => Self::Side { unknown: (side - 1) / 2, above: side % 2 == 0 },
        })
    }

    pub(super) fn is_twin(self) -> bool {
        matches!(self, Self::Twin(_))
    }

    /// Whether the chain of this run ends with the iterate `last`. A few steps suffice, because a run begins
    /// near its minimum, where the linear model is accurate.
    fn is_complete(self, last: &Iterate) -> bool {
        let max_steps = match self {
            Self::Twin(_) => 4,
            Self::Shorter => 6,
            Self::Side { .. } => 1,
        };
        last.settled || last.number >= max_steps
    }
}

/// The best end of a search with its covariance; uncertainty runs start from it.
pub(crate) struct SearchEnd<'a> {
    pub model: &'a TraceModel,
    /// Settings of the search.
    pub settings: &'a TraceSearchSettings,
    /// Seed of the job.
    pub seed: u64,
    pub at: &'a Iterate,
    pub covariance: TraceCovariance,
    /// Factor on the measured variance of the noise, which may be larger than measured: the largest of 1,
    /// chi2 per degree of freedom, and the scatter of the cost gradients of the segments.
    pub widening: f64,
    /// Standard deviation of each coordinate, with `widening`.
    pub sd: Vec<f64>,
}

impl<'a> SearchEnd<'a> {
    /// `None` if the information matrix is singular.
    pub(crate) fn new(
        model: &'a TraceModel,
        settings: &'a TraceSearchSettings,
        seed: u64,
        at: &'a Iterate,
    ) -> Option<Self> {
        let covariance = trace_covariance(model, at)?;
        let widening = chi2_per_dof(model, at).0.max(covariance.gradient_scatter).max(1.0);
        let sd = (0..at.point.len()).map(|i| covariance.variance(i, widening).sqrt()).collect();
        Some(Self { model, settings, seed, at, covariance, widening, sd })
    }

    /// Difference of the cost that is worth 1 in chi2. It exceeds 1 if the noise is larger than measured, or
    /// if the estimates scatter more than the linear model says.
    pub(crate) fn cost_unit(&self) -> f64 {
        self.widening * math::powi(self.covariance.beyond_linear, 2)
    }

    /// Part of the covariance of the estimates by which they scatter more than their information says: the
    /// noise beyond the measured one, and the errors of the recorded heads.
    pub(super) fn excess_covariance(&self) -> DMatrix<f64> {
        let TraceCovariance { curvature, priors, heads, .. } = &self.covariance;
        (curvature - heads - priors) * (self.widening - 1.0) + heads
    }

    /// The end of a descent; `None` if it has no iterate, or if the information matrix is singular.
    pub(super) fn of_descent(
        model: &'a TraceModel,
        settings: &'a TraceSearchSettings,
        seed: u64,
        descent: &'a TraceDescent,
    ) -> Option<Self> {
        Self::new(model, settings, seed, descent.last_iterate()?)
    }

    /// Lists the uncertainty runs that start at the end of this search. The list is empty if the search did
    /// not reach its plain phase, for example because of bad segments.
    pub(super) fn uncertainty_runs(&self) -> Vec<UncertaintyRun> {
        if !self.at.plain {
            return Vec::new();
        }
        let shorter = (self.at.stage > 0).then_some(UncertaintyRun::Shorter);
        // the interval of an unknown with a prior comes from the curvature alone, which includes the prior
        let unknowns = &self.model.unknowns;
        let without_prior = unknowns.parameters().filter(|&i| unknowns.0[i].prior.is_none());
        let sides = |unknown| [false, true].map(|above| UncertaintyRun::Side { unknown, above });
        let sides = without_prior.flat_map(sides);
        shorter.into_iter().chain(sides).chain((0..self.settings.twins).map(UncertaintyRun::Twin)).collect()
    }

    /// Signed distance from the estimate, in the coordinate of the unknown, at which a profile run holds the
    /// unknown.
    fn profile_offset(&self, unknown: usize, above: bool) -> f64 {
        let far = Z_95 * self.sd.get(unknown).copied().unwrap_or_default();
        if above { far } else { -far }
    }

    /// The model of a run, and its first iterate.
    fn start_run(&self, run: UncertaintyRun) -> RunStart<'a> {
        let at = Iterate { plain: true, settled: false, ..self.at.clone() };
        let (model, first) = match run {
            UncertaintyRun::Twin(draw) => {
                let twin = simulate_twin(self, draw);
                let first = refit(&twin, at, TWIN_STATE_STEPS, RescuePolicy::Never);
                (Cow::Owned(twin), first)
            }
            UncertaintyRun::Shorter => {
                let stage = at.stage.saturating_sub(1);
                (
                    Cow::Borrowed(self.model),
                    start_stage(self.model, self.settings, (stage, at.whole), &at.point, &at.segments),
                )
            }
            UncertaintyRun::Side { unknown, above } => {
                let (pinned, point) = pin_unknown(self, unknown, self.profile_offset(unknown, above));
                let first = refit(&pinned, Iterate { point, ..at }, 2, RescuePolicy::Never);
                (Cow::Owned(pinned), first)
            }
        };
        // if the scene refuses the point, the run ends at once, and its cost marks it as failed
        let failed = || Iterate { cost: f64::MAX, settled: true, ..self.at.clone() };
        (model, Iterate { number: 0, ..first.unwrap_or_else(failed) })
    }
}

/// Describes the current iterate of a fit, for the display of its progress.
pub(super) fn describe_iterate(chain: usize, at: &Iterate, segment_s: &[f64]) -> String {
    let length_ms = 1e3 * segment_s.get(at.stage).copied().unwrap_or_default();
    let chain = match UncertaintyRun::from_chain_number(chain) {
        None if chain >= MAX_STARTS => format!("minimum {}", chain - MAX_STARTS + 1),
        None => format!("start {}", chain + 1),
        Some(UncertaintyRun::Twin(twin)) => format!("twin {}", twin + 1),
        Some(UncertaintyRun::Shorter | UncertaintyRun::Side { .. }) => "intervals".to_owned(),
    };
    let (bad, all) = (at.count_bad_segments(), at.segments.len());
    format!("{chain}, segments of {length_ms} ms, {bad} of {all} bad, cost {:.1}", at.cost)
}

/// Number of runs that are computed together. It is fixed, so that the order of the iterates does not depend
/// on the number of threads.
const RUNS_TOGETHER: usize = 8;

/// Model and first iterate of a run.
type RunStart<'a> = (Cow<'a, TraceModel>, Iterate);

/// A run with its iterates so far.
struct RunProgress<'a> {
    run: UncertaintyRun,
    start: OnceLock<RunStart<'a>>,
    place: usize,
    last: Option<Iterate>,
}

impl<'a> RunProgress<'a> {
    fn is_open(&self) -> bool {
        self.last.as_ref().is_none_or(|last| !self.run.is_complete(last))
    }

    /// The next iterate; the model and the first iterate are made when they are first needed.
    fn next_iterate(&self, end: &SearchEnd<'a>) -> Iterate {
        let (model, first) = self.start.get_or_init(|| end.start_run(self.run));
        self.last.as_ref().map_or_else(|| first.clone(), |last| outer_step(model, last, false))
    }
}

/// Computes several runs at once, each to its end. Returns the last iterate of each run, in order; an entry
/// is `None` if the scene refuses the first point of that run. Returns `None` if the journal requests a
/// stop.
pub(super) fn follow_runs(
    end: &SearchEnd<'_>,
    runs: &[UncertaintyRun],
    journal: &mut Journal<'_>,
) -> Option<Vec<Option<Iterate>>> {
    let describe = |chain: usize, at: &Iterate| describe_iterate(chain, at, &end.settings.segment_s);
    let mut ends = Vec::new();
    // twins form their own groups, so that twins that are added later do not change the order of
    // the other iterates
    let kinds = runs.chunk_by(|a, b| a.is_twin() == b.is_twin());
    for runs in kinds.flat_map(|kind| kind.chunks(RUNS_TOGETHER)) {
        let begin =
            |run: &UncertaintyRun| RunProgress { run: *run, start: OnceLock::new(), place: 0, last: None };
        let mut ways: Vec<RunProgress<'_>> = runs.iter().map(begin).collect();
        while ways.iter().any(RunProgress::is_open) {
            let mut open: Vec<&mut RunProgress<'_>> = ways.iter_mut().filter(|way| way.is_open()).collect();
            let keys: Vec<_> = open.iter().map(|way| (way.run.chain_number(), way.place)).collect();
            let made =
                journal.compute_iterates(&keys, &|at| Some(open[at].next_iterate(end)), &describe).ok()?;
            for (way, next) in open.iter_mut().zip(made) {
                (way.last, way.place) = (Some(next), way.place + 1);
            }
        }
        ends.extend(ways.into_iter().map(|way| way.last.filter(|last| last.cost < f64::MAX)));
    }
    Some(ends)
}

// Profile of the cost: one point on either side of every parameter's estimate, with all other unknowns
// refitted.

/// Standard deviation of the narrow prior that fixes an unknown during a profile run, as a fraction of the
/// standard deviation of the unknown's estimate.
const PIN_SD: f64 = 1e-3;
/// Largest allowed factor by which the profile widens an interval.
const MAX_STRETCH: f64 = 3.0;

/// Distances below and above each estimate, in the coordinate of the unknown, at which the cost reaches the
/// 95 % threshold. Each distance is at least 1.96 standard deviations; it is exactly 1.96 standard deviations
/// if no run holds the unknown on that side. The threshold is the cost of the linear model at this distance,
/// so only a deviation from the linear model widens the interval. `sides` returns the last iterate of a run.
pub(super) fn profile_distances<'s>(
    end: &SearchEnd<'_>,
    sides: impl Fn(UncertaintyRun) -> Option<&'s Iterate>,
) -> Vec<[f64; 2]> {
    let TraceCovariance { curvature, heads, .. } = &end.covariance;
    let one = |unknown: usize| {
        // the errors of the recorded head are part of the distance and do not change the cost
        let by_cost = curvature[(unknown, unknown)] - heads[(unknown, unknown)];
        [false, true].map(|above| {
            let moved = end.profile_offset(unknown, above);
            let found = sides(UncertaintyRun::Side { unknown, above });
            let risen = found.map(|at| cost_rise(end, unknown, moved, at)).filter(|risen| risen.is_finite());
            let rise = moved * moved / by_cost;
            let stretch = risen.map_or(1.0, |risen| (rise / risen.max(1e-9)).sqrt());
            moved.abs() * stretch.clamp(1.0, MAX_STRETCH)
        })
    };
    (0..end.at.point.len()).map(one).collect()
}

/// Mean and standard deviation of the narrow prior that fixes unknown `i` at the distance `moved` from its
/// estimate.
fn pin_prior(end: &SearchEnd<'_>, i: usize, moved: f64) -> [f64; 2] {
    [end.at.point[i] + moved, PIN_SD * end.covariance.curvature[(i, i)].sqrt()]
}

/// The model with unknown `i` held at the distance `moved` from its estimate, and the point at which the
/// linear model predicts the minimum.
fn pin_unknown(end: &SearchEnd<'_>, i: usize, moved: f64) -> (TraceModel, Vec<f64>) {
    let covariance = &end.covariance.curvature;
    let mut pinned = end.model.clone();
    if let Some(unknown) = pinned.unknowns.0.get_mut(i) {
        unknown.prior = Some(pin_prior(end, i, moved));
    }
    let along = |k: usize| end.at.point[k] + covariance[(k, i)] / covariance[(i, i)] * moved;
    let point: Vec<f64> = (0..end.at.point.len()).map(along).collect();
    let point = pinned.unknowns.clamp_to_ranges(&point);
    (pinned, point)
}

/// Rise in cost above the best end when a narrow prior fixes unknown `i`; the cost of this prior is not
/// counted.
fn cost_rise(end: &SearchEnd<'_>, i: usize, moved: f64, at: &Iterate) -> f64 {
    let [pinned_at, sd] = pin_prior(end, i, moved);
    let prior = end.model.unknowns.0[i].prior;
    let own = prior.map_or(0.0, |[mean, sd]| math::powi((at.point[i] - mean) / sd, 2));
    at.cost - math::powi((at.point[i] - pinned_at) / sd, 2) + own - end.at.cost
}

// Parametric bootstrap (Efron and Tibshirani, An Introduction to the Bootstrap, 1993, chapter 6): recordings
// are simulated at the best end with new noise and fitted again from this end.

/// Number of steps in the fit of each starting state to a twin before the first outer step.
const TWIN_STATE_STEPS: usize = 3;
/// Number of frames after which simulated correlated noise no longer depends on its first values.
const NOISE_WARM_UP_FRAMES: usize = 400;

/// The model with the data of twin number `draw`: recordings that are simulated with the estimates at the end
/// of a search.
fn simulate_twin(end: &SearchEnd<'_>, draw: usize) -> TraceModel {
    let SearchEnd { model, at, .. } = end;
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(end.seed ^ ((draw as u64 + 1) << 40));
    let mut twin = TraceModel::clone(model);
    let widening = end.widening.sqrt();
    let draw_recording = |shoot: &TraceRecording| {
        let frames = shoot.observation.times_s.len();
        shoot.observation.settings.noise.each_ref().map(|noise| draw_noise(noise, frames, &mut generator))
    };
    let noise: Vec<[Vec<f64>; 2]> = model.recordings.iter().map(draw_recording).collect();
    for found in segment_residuals(model, at) {
        let SegmentResiduals { recording: film, is_drop, frames, residual_m, .. } = found;
        let data = &mut twin.recordings[film].observation;
        let column = if is_drop { &mut data.drop_m } else { &mut data.tip_x_m };
        for (frame, residual_m) in frames.into_iter().zip(residual_m) {
            let drawn = widening * noise[film][usize::from(is_drop)][frame];
            column[frame] = column[frame].map(|measured| measured + residual_m + drawn);
        }
    }
    // the mean of a prior is also a measured value, so a twin draws it at random too
    for [mean, sd] in twin.unknowns.0.iter_mut().filter_map(|unknown| unknown.prior.as_mut()) {
        *mean += *sd * generator.sample::<f64, _>(StandardNormal);
    }
    twin
}

/// Simulated tracking noise in every frame, m.
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
                (FIRST_RUN_CHAIN + place, Some(*branch))
            );
        }
        assert_eq!(UncertaintyRun::from_chain_number(FIRST_RUN_CHAIN - 1), None);
    }
}
