//! The posterior density of a job's unknowns, for external samplers and optimisers.
//!
//! `ln p(x | data) = ln p(data | x) + ln p(x)`, up to a constant that depends only on the data. Every unknown
//! has a range and a coordinate: its value or the logarithm of its value. The prior density of the coordinate
//! is flat, or normal and truncated to the range. The likelihood of a job on features is `-cost / 2` without
//! the terms of the priors ([`super::objective`]). The likelihood of a job on traces is `-chi^2 / 2`,
//! minimised over the starting states of the segments (`fit_states_at`).

use super::FitError;
use super::bounds::{BoundsSpacing, Prior};
use super::job::FreeParameter;
use super::model::ModelFeatures;
use super::objective::{Objective, residual};
use super::problem::Problem;
use super::target_value::TargetValue;
use super::targets::{measure_targets, split_held_out};
use super::trace::{TraceModel, TraceUnknown, fit_states_at, frame_residuals};
use crate::feature::Feature;
use portable_math as math;
use std::f64::consts::{LN_2, SQRT_2, TAU};

/// An unknown with its range and its prior. The coordinate of the unknown is its value or the logarithm of
/// its value.
#[derive(Debug, Clone, PartialEq)]
pub struct PosteriorParameter {
    /// For a parameter: its key in the scene file, preceded by its table. For a camera error: the name of the
    /// recording and the key of the error.
    pub name: String,
    /// Smallest and largest value, in the SI unit of the unknown.
    pub bounds: [f64; 2],
    /// Whether the coordinate is the logarithm of the value.
    pub is_log: bool,
    /// Mean and standard deviation of a normal prior of the coordinate; `None` if the prior is flat in the
    /// coordinate.
    pub prior: Option<[f64; 2]>,
}

/// The posterior density of a problem's unknowns.
pub struct Posterior {
    problem: Problem,
    unknowns: Vec<PosteriorParameter>,
    data: PosteriorData,
}

enum PosteriorData {
    Features { features: Vec<Feature>, targets: Vec<TargetValue> },
    Traces(Box<TraceModel>),
}

impl Posterior {
    /// The posterior of a problem on features or on traces. Held-out targets are ignored.
    ///
    /// # Errors
    /// [`FitError`] if a target cannot be measured, or if the head that drives a model is not tracked.
    pub fn new(problem: Problem) -> Result<Self, FitError> {
        if let Some(model) = problem.trace_model() {
            let model = model.map_err(|error| FitError::CannotBeFitted { why: error.to_string() })?;
            let recordings = problem.trace_recording_names();
            let unknowns =
                model.unknowns.0.iter().map(|of| PosteriorParameter::from_unknown(of, of.name(&recordings)));
            let (unknowns, data) = (unknowns.collect(), PosteriorData::Traces(Box::new(model)));
            return Ok(Self { problem, unknowns, data });
        }
        let job = problem.job();
        let all = measure_targets(job, problem.recordings())?;
        let (aims, targets, _) = split_held_out(job, all);
        let features = aims.into_iter().map(|aim| aim.feature).collect();
        let unknowns = job.parameters.iter().map(PosteriorParameter::from_free).collect();
        Ok(Self { problem, unknowns, data: PosteriorData::Features { features, targets } })
    }

    /// The problem whose unknowns the posterior describes.
    #[must_use]
    pub fn problem(&self) -> &Problem {
        &self.problem
    }

    /// The unknowns, in the order of the values of a point.
    #[must_use]
    pub fn unknowns(&self) -> &[PosteriorParameter] {
        &self.unknowns
    }

    /// Values of the unknowns at a point of the unit box. Uniformly distributed points become samples
    /// of the prior.
    #[must_use]
    pub fn prior_transform(&self, unit: &[f64]) -> Vec<f64> {
        self.unknowns.iter().zip(unit).map(|(unknown, u)| unknown.quantile(*u)).collect()
    }

    /// Logarithm of the prior density of the values (not of their coordinates); minus infinity outside the
    /// bounds.
    #[must_use]
    pub fn log_prior(&self, values: &[f64]) -> f64 {
        self.unknowns.iter().zip(values).map(|(unknown, value)| unknown.log_density(*value)).sum()
    }

    /// Logarithm of the likelihood, up to a constant; minus infinity where the model does not run.
    #[must_use]
    pub fn log_likelihood(&self, values: &[f64]) -> f64 {
        match &self.data {
            PosteriorData::Features { features, targets } => {
                let seen = self.feature_model(features, targets);
                let flat = self.problem.job().parameters.iter();
                let flat = flat.map(|free| FreeParameter::from(free.bounds)).collect();
                let found = Objective::new(flat, targets.clone(), &seen).evaluate_values(values.to_vec());
                if found.failure.is_some() { f64::NEG_INFINITY } else { -found.cost / 2.0 }
            }
            PosteriorData::Traces(model) => {
                let at = fit_states_at(model, self.problem.segment_s(), &unknown_coordinates(model, values));
                let chi2 = at.map(|at| at.segments.iter().map(|segment| segment.chi2).sum::<f64>());
                chi2.map_or(f64::NEG_INFINITY, |chi2| -chi2 / 2.0)
            }
        }
    }

    /// Logarithm of the posterior density, up to a constant; minus infinity outside the bounds, where the
    /// model is not run.
    #[must_use]
    pub fn log_density(&self, values: &[f64]) -> f64 {
        let prior = self.log_prior(values);
        if prior == f64::NEG_INFINITY { prior } else { prior + self.log_likelihood(values) }
    }

    /// Residuals (model minus data) in standard deviations: one per feature in the order of the job, or
    /// one per fitted frame of the traces, recording by recording, tip before head. `None` where the model
    /// has no value.
    #[must_use]
    pub fn residuals(&self, values: &[f64]) -> Vec<Option<f64>> {
        match &self.data {
            PosteriorData::Features { features, targets } => {
                let seen = self.feature_model(features, targets);
                let found =
                    Objective::new(Vec::new(), targets.clone(), &seen).evaluate_values(values.to_vec());
                let one = |(at, target): (usize, &TargetValue)| {
                    found.features.get(at)?.observation().map(|shown| residual(shown, target))
                };
                targets.iter().enumerate().map(one).collect()
            }
            PosteriorData::Traces(model) => {
                let at = fit_states_at(model, self.problem.segment_s(), &unknown_coordinates(model, values));
                frame_residuals(model, at.as_ref())
            }
        }
    }

    fn feature_model(&self, features: &[Feature], targets: &[TargetValue]) -> ModelFeatures<'_> {
        let values = targets.iter().map(|target| target.value).collect();
        ModelFeatures::new(self.problem.model(), features, values, self.problem.job().ensemble.members)
    }
}

fn unknown_coordinates(model: &TraceModel, values: &[f64]) -> Vec<f64> {
    model.unknowns.0.iter().zip(values).map(|(unknown, value)| unknown.coordinate(*value)).collect()
}

impl PosteriorParameter {
    fn from_free(free: &FreeParameter) -> Self {
        let bounds = [free.bounds.lower(), free.bounds.upper()];
        let is_log = free.bounds.spacing() == BoundsSpacing::Log;
        let prior = free.prior.map(|prior| match prior {
            Prior::Linear { mean, sd } => [mean, sd],
            Prior::Log { mean_ln, sd_ln } => [mean_ln, sd_ln],
        });
        Self { name: free.name.clone(), bounds, is_log, prior }
    }

    fn from_unknown(of: &TraceUnknown, name: String) -> Self {
        let unit = of.unit().unwrap_or(1.0);
        let prior = of.prior.map(|prior| prior.map(|along| along * unit));
        Self { name, bounds: of.range.map(|end| of.value(end)), is_log: of.unit().is_none(), prior }
    }

    fn coordinate(&self, value: f64) -> f64 {
        if self.is_log { math::ln(value) } else { value }
    }

    /// Distances of the two ends of the coordinate's range from the mean of the prior, in standard deviations
    /// of the prior.
    fn standardized_bounds(&self, [mean, sd]: [f64; 2]) -> [f64; 2] {
        self.bounds.map(|end| (self.coordinate(end) - mean) / sd)
    }

    fn quantile(&self, unit: f64) -> f64 {
        let [low, high] = self.bounds.map(|end| self.coordinate(end));
        let at = match self.prior {
            None => low + unit * (high - low),
            Some(prior) => {
                let ends = self.standardized_bounds(prior);
                let all = normal_probability(ends[0], ends[1]);
                // the probability is integrated from the nearer end of the range, so that rounding errors
                // stay small in both tails
                let below = |x: f64| match unit < 0.5 {
                    true => normal_probability(ends[0], x) - unit * all,
                    false => (1.0 - unit) * all - normal_probability(x, ends[1]),
                };
                (prior[0] + prior[1] * bisect_root(below, ends)).clamp(low, high)
            }
        };
        let value = if self.is_log { math::exp(at) } else { at };
        value.clamp(self.bounds[0], self.bounds[1])
    }

    /// Logarithm of the prior density of the value (not of its coordinate).
    fn log_density(&self, value: f64) -> f64 {
        let [low, high] = self.bounds;
        if !(low..=high).contains(&value) {
            return f64::NEG_INFINITY;
        }
        // logarithm of the derivative of the coordinate with respect to the value
        let slope = if self.is_log { -math::ln(value) } else { 0.0 };
        let along = match self.prior {
            None => -math::ln(self.coordinate(high) - self.coordinate(low)),
            Some(prior @ [mean, sd]) => {
                let [low, high] = self.standardized_bounds(prior);
                let off = (self.coordinate(value) - mean) / sd;
                let all = math::ln(normal_probability(low, high));
                -off * off / 2.0 - math::ln(sd) - math::ln(TAU) / 2.0 - all
            }
        };
        along + slope
    }
}

/// Probability that a standard normal variable lies between two limits; accurate in both tails.
fn normal_probability(from: f64, to: f64) -> f64 {
    let above = |x: f64| math::erfc(x / SQRT_2) / 2.0;
    if from > 0.0 { above(from) - above(to) } else { above(-to) - above(-from) }
}

/// Root of the increasing function `of` in the interval from `low` to `high`, by bisection to rounding
/// accuracy.
fn bisect_root(of: impl Fn(f64) -> f64, [mut low, mut high]: [f64; 2]) -> f64 {
    // more than 38 standard deviations from the mean the normal density underflows to zero
    (low, high) = (low.max(-38.0), high.min(38.0));
    let halvings = (f64::MANTISSA_DIGITS as f64 + math::ln((high - low).max(2.0)) / LN_2) as usize;
    for _ in 0..halvings {
        let middle = low + (high - low) / 2.0;
        if of(middle) < 0.0 { low = middle } else { high = middle }
    }
    low + (high - low) / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unknown(bounds: [f64; 2], is_log: bool, prior: Option<[f64; 2]>) -> PosteriorParameter {
        PosteriorParameter { name: String::new(), bounds, is_log, prior }
    }

    /// The transform from the unit interval to the value inverts the cumulative prior distribution, so its
    /// slope is the reciprocal of the prior density.
    #[test]
    fn uniform_places_have_the_prior_for_density() {
        let kinds = [
            unknown([0.2, 0.8], false, None),
            unknown([0.1, 10.0], true, None),
            unknown([-1.0, 2.0], false, Some([0.5, 0.7])),
            unknown([0.1, 10.0], true, Some([0.3, 0.5])),
            unknown([5.0, 9.0], false, Some([0.0, 1.0])), // only the tail of the normal distribution
            unknown([-20.0, 20.0], false, Some([0.0, 1.0])),
        ];
        for of in kinds {
            assert!((of.quantile(0.0) - of.bounds[0]).abs() < 1e-9, "{of:?}");
            assert!((of.quantile(1.0) - of.bounds[1]).abs() < 1e-9, "{of:?}");
            for unit in [0.01, 0.3, 0.5, 0.9, 0.99] {
                let h = 1e-6;
                let slope = (of.quantile(unit + h) - of.quantile(unit - h)) / (2.0 * h);
                let density = math::exp(of.log_density(of.quantile(unit)));
                assert!((slope * density - 1.0).abs() < 1e-4, "{of:?} at {unit}: {}", slope * density);
            }
            assert_eq!(of.log_density(of.bounds[1] * 1.001), f64::NEG_INFINITY);
        }
    }

    #[test]
    fn shares_of_the_normal_distribution_are_those_of_tables() {
        for (z, within) in [(1.0, 0.682_689_492_137_085_9), (2.0, 0.954_499_736_103_641_6)] {
            assert!((normal_probability(-z, z) - within).abs() < 1e-15);
        }
        // Abramowitz and Stegun, table 26.1, for the normal distribution function P: 1 - P(5) = 2.86651572e-7
        assert!((normal_probability(5.0, 38.0) / 2.866_515_718_791_94e-7 - 1.0).abs() < 1e-12);
    }
}
