//! The interface between a fit and a model.

use super::evaluation::{FailureReason, Observation, Observed, RunFailure};
use super::job::FitTarget;
use super::target_value::TargetValue;
use crate::feature::{Feature, FeatureValue, MissingValue, ValueComparison, read_assigned_features};
use crate::recording::Recording;
use portable_math as math;
use rayon::prelude::*;

/// Features of a model as a function of its parameters. The objective uses a model only through this trait.
pub trait FeaturePredictor: Sync {
    /// The features, one per target in the same order; `values` are the free parameters in job order,
    /// in SI units.
    ///
    /// # Errors
    /// [`RunFailure`] when the run ended before anything could be observed.
    fn predict_features(&self, values: &[f64]) -> Result<Vec<Observed>, RunFailure>;

    /// Features of one simulated measurement of this model, with the noise, lost points and starting state of
    /// draw number `draw`.
    ///
    /// # Errors
    /// The errors of [`Self::predict_features`].
    fn simulate_twin(&self, values: &[f64], draw: u64) -> Result<Vec<Observed>, RunFailure>;
}

/// Random choices of one simulated recording: starting state, noise and lost frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Draw {
    /// Number of the starting state; 0 is the starting state of the scene.
    pub member: u64,
    /// Seed of the tracking noise; every evaluation of a search uses 0.
    pub noise: u64,
    /// Whether frames are lost as in the recording.
    pub dropouts: bool,
}

/// A model whose runs are recorded by cameras.
pub trait Model: Sync {
    /// Simulates the recording that the camera of a condition takes. `condition` is the index of the
    /// condition in the job, counted from 0. `values` are the free parameters in job order, in SI units.
    ///
    /// # Errors
    /// [`RunFailure`] when the run ended before anything could be observed.
    fn record_condition(&self, values: &[f64], condition: usize, draw: Draw)
    -> Result<Recording, RunFailure>;

    /// Simulated recording of a run whose start is changed by `restart`.
    ///
    /// # Errors
    /// The errors of [`Self::record_condition`]; in addition, [`RunFailure`] if the model cannot start in
    /// this way.
    fn record_restarted(
        &self,
        values: &[f64],
        condition: usize,
        draw: Draw,
        restart: Restart,
    ) -> Result<Recording, RunFailure> {
        let _ = (values, condition, draw, restart);
        Err(RunFailure::new(FailureReason::Refused, "this model knows no other start", 0.0))
    }

    /// Time constant with which an error of the starting state decays, s; `None` where it is unknown.
    fn decay_s(&self, values: &[f64], condition: usize) -> Option<f64> {
        let _ = (values, condition);
        None
    }

    /// Largest time, s, by which a run can start before the start time of its scene.
    fn max_lead_s(&self, condition: usize) -> f64 {
        let _ = condition;
        f64::INFINITY
    }
}

/// How the start of a run differs from the start in its scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Restart {
    /// The run starts earlier by this time, s; the recording still starts at its original instant.
    Earlier(f64),
    /// The starting angles are larger than in the scene by this fraction.
    Moved(f64),
}

/// The features of a model's recordings, averaged over its starting states.
pub(crate) struct ModelFeatures<'a> {
    model: &'a dyn Model,
    /// Features; the condition of each is an index into `conditions`.
    features: Vec<Feature>,
    targets: Vec<f64>,
    conditions: Vec<usize>,
    members: usize,
}

impl<'a> ModelFeatures<'a> {
    /// Features of `model`, averaged over `members` starting states (at least 1). Peaks are assigned to the
    /// target values `targets`. Conditions without features are not simulated.
    pub(crate) fn new(model: &'a dyn Model, features: &[Feature], targets: Vec<f64>, members: usize) -> Self {
        let mut conditions: Vec<usize> = features.iter().map(|feature| feature.condition).collect();
        conditions.sort_unstable();
        conditions.dedup();
        let placed = |feature: &Feature| Feature {
            condition: conditions.partition_point(|c| *c < feature.condition),
            ..feature.clone()
        };
        Self {
            model,
            features: features.iter().map(placed).collect(),
            targets,
            members: members.max(1),
            conditions,
        }
    }

    /// Like [`Self::new`], for the features of fitted targets.
    pub(crate) fn for_targets(
        model: &'a dyn Model,
        aims: &[FitTarget],
        targets: &[TargetValue],
        members: usize,
    ) -> Self {
        let features: Vec<Feature> = aims.iter().map(|aim| aim.feature.clone()).collect();
        Self::new(model, &features, targets.iter().map(|target| target.value).collect(), members)
    }

    /// All features of one simulated measurement; `draw` selects the starting state, the noise and the lost
    /// frames.
    ///
    /// # Errors
    /// [`RunFailure`] of the first condition that fails.
    pub(crate) fn read_features(
        &self,
        values: &[f64],
        draw: Draw,
    ) -> Result<Vec<Result<FeatureValue, MissingValue>>, RunFailure> {
        let record = |condition: &usize| self.model.record_condition(values, *condition, draw);
        let recordings = self.conditions.iter().map(record).collect::<Result<Vec<Recording>, _>>()?;
        Ok(read_assigned_features(&self.features, &self.targets, &recordings.iter().collect::<Vec<_>>()))
    }
}

impl FeaturePredictor for ModelFeatures<'_> {
    fn predict_features(&self, values: &[f64]) -> Result<Vec<Observed>, RunFailure> {
        let run = |member| self.read_features(values, Draw { member, ..Draw::default() });
        let runs: Vec<_> = (0..self.members as u64).into_par_iter().map(run).collect();
        let failed = runs.iter().filter(|run| run.is_err()).count();
        if 2 * failed >= runs.len()
            && let Some(Err(failure)) = runs.iter().find(|run| run.is_err())
        {
            return Err(failure.clone());
        }
        let read: Vec<_> = runs.into_iter().flatten().collect();
        Ok(self.features.iter().enumerate().map(|(at, feature)| average_runs(&read, at, feature)).collect())
    }

    fn simulate_twin(&self, values: &[f64], draw: u64) -> Result<Vec<Observed>, RunFailure> {
        // the starting state of a twin differs from all states over which the fit averages
        let member = if self.members > 1 { self.members as u64 + draw } else { 0 };
        let read = self.read_features(values, Draw { member, noise: draw, dropouts: true })?;
        Ok(read.into_iter().map(observe_reading).collect())
    }
}

fn observe_reading(read: Result<FeatureValue, MissingValue>) -> Observed {
    match read {
        Ok(FeatureValue { value, below_db, .. }) => {
            Observed::Value(Observation { value, spread: 0.0, below_db })
        }
        Err(missing) => Observed::Missing(missing.to_string()),
    }
}

/// Mean and standard deviation of a feature over the starting states; missing if at most half of the states
/// show the feature.
fn average_runs(runs: &[Vec<Result<FeatureValue, MissingValue>>], at: usize, feature: &Feature) -> Observed {
    let shown: Vec<&FeatureValue> = runs.iter().filter_map(|run| run.get(at)?.as_ref().ok()).collect();
    if 2 * shown.len() <= runs.len() {
        let why = runs.iter().find_map(|run| run.get(at)?.as_ref().err());
        return Observed::Missing(why.map_or_else(|| "no run shows it".to_owned(), ToString::to_string));
    }
    if let [FeatureValue { value, below_db, .. }] = shown[..] {
        return Observed::Value(Observation { value: *value, spread: 0.0, below_db: *below_db });
    }
    let count = shown.len() as f64;
    let below_db = shown.iter().map(|read| read.below_db).sum::<f64>() / count;
    let values = shown.iter().map(|read| read.value);
    // logarithms are averaged if residuals are logarithms and all values have the same sign
    let log = feature.reading.comparison() == ValueComparison::Log
        && (shown.iter().all(|read| read.value > 0.0) || shown.iter().all(|read| read.value < 0.0));
    let taken: Vec<f64> = if log { values.map(|v| math::ln(v.abs())).collect() } else { values.collect() };
    let mean = taken.iter().sum::<f64>() / count;
    let spread = (taken.iter().map(|v| math::powi(v - mean, 2)).sum::<f64>() / (count - 1.0)).sqrt();
    let sign = shown.first().map_or(1.0, |read| read.value.signum());
    let (value, spread) =
        if log { (sign * math::exp(mean), spread * math::exp(mean)) } else { (mean, spread) };
    Observed::Value(Observation { value, spread, below_db })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::feature::Reading;
    use crate::fit::evaluation::FailureReason;
    use crate::recording::channel::Window;
    use crate::recording::{FrameGrid, Traces};

    /// A model whose deflection is the parameter times a factor that depends on the starting state, plus a
    /// term that depends on the condition. The run from starting state number 3 fails.
    struct Still;

    const FACTORS: [f64; 4] = [1.0, 1.2, 0.8, 1.0];

    impl Model for Still {
        fn record_condition(
            &self,
            values: &[f64],
            condition: usize,
            draw: Draw,
        ) -> Result<Recording, RunFailure> {
            if draw.member == 3 {
                return Err(RunFailure::new(
                    FailureReason::Ended(crate::simulate::RunStatus::ContactLost),
                    "",
                    0.5,
                ));
            }
            let grid = FrameGrid { start_s: 0.0, frame_rate_hz: 1000.0, frames: 20 };
            let deflection_m = values[0] * FACTORS.get(draw.member as usize).unwrap_or(&2.0)
                + condition as f64
                + 1e-3 * draw.noise as f64;
            let (still, tip) = (vec![Some(0.0); 20], vec![Some(deflection_m); 20]);
            let traces = Traces {
                tip_x_m: tip,
                tip_y_m: still.clone(),
                head_x_m: still.clone(),
                head_y_m: still,
                ..Traces::default()
            };
            Recording::new("model", grid, traces, true)
                .map_err(|error| RunFailure::new(FailureReason::NotFinite, error.to_string(), 1.0))
        }
    }

    fn mean(condition: usize) -> Feature {
        Feature { name: condition.to_string(), reading: Reading::MeanDeflection(Window::WHOLE), condition }
    }

    fn observe_mean(members: usize, conditions: &[usize]) -> Vec<Observation> {
        let features: Vec<Feature> = conditions.iter().map(|condition| mean(*condition)).collect();
        let seen = ModelFeatures::new(&Still, &features, vec![0.01; conditions.len()], members);
        seen.predict_features(&[0.01])
            .unwrap()
            .iter()
            .map(|feature| *feature.observation().unwrap())
            .collect()
    }

    #[test]
    fn starting_states_are_averaged_and_their_spread_is_kept() {
        let alone = observe_mean(1, &[0])[0];
        assert!((alone.value / 0.01 - 1.0).abs() < 1e-12 && alone.spread == 0.0);
        let found = observe_mean(3, &[0])[0];
        let logs = FACTORS[..3].iter().map(|f: &f64| f.ln());
        let mean = logs.clone().sum::<f64>() / 3.0;
        let sd = (logs.map(|l| (l - mean).powi(2)).sum::<f64>() / 2.0).sqrt();
        assert!(
            (found.value / (0.01 * mean.exp()) - 1.0).abs() < 1e-9
                && (found.spread / (found.value * sd) - 1.0).abs() < 1e-9,
            "{found:?}"
        );
        assert_eq!(observe_mean(4, &[0])[0], found, "a state from which the run fails is left out");
    }

    #[test]
    fn each_feature_is_read_from_its_own_condition() {
        let values: Vec<f64> = observe_mean(1, &[5, 2, 5]).iter().map(|found| found.value).collect();
        assert!(
            values.iter().zip([5.01, 2.01, 5.01]).all(|(found, expected)| (found - expected).abs() < 1e-9),
            "{values:?}"
        );
    }

    #[test]
    fn a_twin_has_its_own_noise_and_a_starting_state_that_is_not_averaged_over() {
        let twin = |members| {
            let features = [mean(0)];
            ModelFeatures::new(&Still, &features, vec![0.01], members).simulate_twin(&[0.01], 7).unwrap()[0]
                .value()
                .unwrap()
        };
        assert!((twin(1) - 0.017).abs() < 1e-12 && (twin(2) - 0.027).abs() < 1e-12);
    }
}
