//! The features of a model's recordings, averaged over its starting states.

use super::features::{Feature, Measure, Missing, Reckoned, read_all_near};
use super::objective::{Draw, Model, Observed, Predict, RunFailure, Sight};
use crate::recording::Recording;
use rayon::prelude::*;

/// The features of a model's recordings.
pub struct Seen<'a> {
    model: &'a dyn Model,
    /// With conditions counted among those that are looked at.
    features: Vec<Feature>,
    targets: Vec<f64>,
    conditions: Vec<usize>,
    members: usize,
}

impl<'a> Seen<'a> {
    /// Features with the targets to which peaks are assigned, averaged over so many starting states (at least 1). Conditions of which
    /// nothing is read are not simulated.
    #[must_use]
    pub fn new(model: &'a dyn Model, features: &[Feature], targets: Vec<f64>, members: usize) -> Self {
        let mut conditions: Vec<usize> = features.iter().map(|feature| feature.condition).collect();
        conditions.sort_unstable();
        conditions.dedup();
        let placed = |feature: &Feature| Feature { condition: conditions.partition_point(|c| *c < feature.condition), ..feature.clone() };
        Self { model, features: features.iter().map(placed).collect(), targets, members: members.max(1), conditions }
    }

    /// Every feature of one draw.
    ///
    /// # Errors
    /// [`RunFailure`] of the first condition that fails.
    pub fn read(&self, values: &[f64], draw: Draw) -> Result<Vec<Result<Reckoned, Missing>>, RunFailure> {
        let recordings = self.conditions.iter().map(|condition| self.model.observe(values, *condition, draw)).collect::<Result<Vec<Recording>, _>>()?;
        Ok(read_all_near(&self.features, &self.targets, &recordings.iter().collect::<Vec<_>>()))
    }
}

impl Predict for Seen<'_> {
    fn predict(&self, values: &[f64]) -> Result<Vec<Observed>, RunFailure> {
        let members = 0..self.members as u64;
        let runs: Vec<_> = members.into_par_iter().map(|member| self.read(values, Draw { member, ..Draw::default() })).collect();
        let failed = runs.iter().filter(|run| run.is_err()).count();
        if 2 * failed >= runs.len()
            && let Some(Err(failure)) = runs.iter().find(|run| run.is_err())
        {
            return Err(failure.clone());
        }
        let read: Vec<_> = runs.into_iter().flatten().collect();
        Ok(self.features.iter().enumerate().map(|(at, feature)| averaged(&read, at, feature)).collect())
    }

    fn twin(&self, values: &[f64], draw: u64) -> Result<Vec<Observed>, RunFailure> {
        // starting states of twins are none of those that are averaged over
        let member = if self.members > 1 { self.members as u64 + draw } else { 0 };
        let read = self.read(values, Draw { member, noise: draw, dropouts: true })?;
        Ok(read.into_iter().map(observed).collect())
    }
}

fn observed(read: Result<Reckoned, Missing>) -> Observed {
    read.map_or_else(|missing| Observed::Missing(missing.to_string()), |read| Observed::Seen(sight(read.value, 0.0, read.below_db)))
}

fn sight(value: f64, spread: f64, below_db: f64) -> Sight {
    Sight { value, spread, below_db }
}

/// Mean and spread of a feature over the starting states; missing where at most half of them show it.
fn averaged(runs: &[Vec<Result<Reckoned, Missing>>], at: usize, feature: &Feature) -> Observed {
    let shown: Vec<&Reckoned> = runs.iter().filter_map(|run| run.get(at)?.as_ref().ok()).collect();
    if 2 * shown.len() <= runs.len() {
        let why = runs.iter().find_map(|run| run.get(at)?.as_ref().err());
        return Observed::Missing(why.map_or_else(|| "no run shows it".to_owned(), ToString::to_string));
    }
    if let [only] = shown.as_slice() {
        return Observed::Seen(sight(only.value, 0.0, only.below_db));
    }
    let count = shown.len() as f64;
    let below_db = shown.iter().map(|read| read.below_db).sum::<f64>() / count;
    let values = shown.iter().map(|read| read.value);
    // a mean of logarithms where residuals are logarithms and nothing changes its sign
    let log = feature.reading.measure() == Measure::Log && (shown.iter().all(|read| read.value > 0.0) || shown.iter().all(|read| read.value < 0.0));
    let taken: Vec<f64> = if log { values.map(|v| v.abs().ln()).collect() } else { values.collect() };
    let mean = taken.iter().sum::<f64>() / count;
    let spread = (taken.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt();
    let sign = shown.first().map_or(1.0, |read| read.value.signum());
    let (value, spread) = if log { (sign * mean.exp(), spread * mean.exp()) } else { (mean, spread) };
    Observed::Seen(sight(value, spread, below_db))
}
