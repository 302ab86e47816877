//! Checks whether the transient after the start affects the features.
//!
//! A scene starts from a guessed state, such as the equilibrium of steady slip. The error of this state
//! decays with the slowest mode of blade and head. It biases a feature whose time window begins too early.
//! The best model is therefore run again from another start, and its features are compared with those of the
//! fit.

use super::evaluation::{Observed, RunFailure};
use super::job::FitTarget;
use super::model::{Draw, FeaturePredictor, Model, ModelFeatures, Restart};
use super::target_value::TargetValue;
use crate::feature::Feature;
use crate::recording::Recording;

/// Shift of a feature between two starts, in standard deviations of its target, above which a note is
/// written: a quarter of the width of a 95 % interval.
const MIN_VISIBLE_SHIFT_SD: f64 = 1.0;
/// Shift of a feature between two starts, in standard deviations of its target, up to which the error of the
/// start counts as decayed.
const MAX_FORGOTTEN_SHIFT_SD: f64 = 0.3;
/// Largest time by which a start is moved earlier, in decay times of the slowest mode. After five decay times
/// less than 1 % of an error remains.
const MAX_LEAD_DECAYS: usize = 5;
/// Relative change of the starting angles if the start cannot be moved earlier.
const ANGLE_CHANGE: f64 = 0.05;

/// A model whose runs start differently from the scene.
struct RestartedModel<'a> {
    model: &'a dyn Model,
    restart: Restart,
}

impl Model for RestartedModel<'_> {
    fn record_condition(
        &self,
        values: &[f64],
        condition: usize,
        draw: Draw,
    ) -> Result<Recording, RunFailure> {
        self.model.record_restarted(values, condition, draw, self.restart)
    }
}

/// The features and targets of one condition, with the best model and its parameter values.
struct ConditionFeatures<'a> {
    model: &'a dyn Model,
    values: &'a [f64],
    features: Vec<Feature>,
    targets: Vec<&'a TargetValue>,
    members: usize,
}

impl ConditionFeatures<'_> {
    fn read_features(&self, restart: Option<Restart>) -> Option<Vec<Observed>> {
        let targets = self.targets.iter().map(|target| target.value).collect();
        let restarted = restart.map(|restart| RestartedModel { model: self.model, restart });
        let model = restarted.as_ref().map_or(self.model, |restarted| restarted);
        ModelFeatures::new(model, &self.features, targets, self.members).predict_features(self.values).ok()
    }

    /// The feature with the largest difference between two runs, and this difference in standard deviations
    /// of the feature's target. A feature that is missing from either run is skipped.
    fn largest_difference(&self, one: &[Observed], other: &[Observed]) -> Option<(&str, f64)> {
        let pairs = self.targets.iter().zip(one).zip(other);
        let differences = pairs.filter_map(|((target, one), other)| {
            let moved = target.distance_between(other.value()?, one.value()?);
            Some((target.name.as_str(), (moved / target.relative_sd()).abs()))
        });
        differences.max_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// A sentence for each condition whose features depend on the start of its scene. `targets` contain the
/// standard deviations at the end of the fit; `names` are the names of the conditions.
pub(super) fn start_notes(
    model: &dyn Model,
    names: &[String],
    (aims, targets): (&[FitTarget], &[TargetValue]),
    values: &[f64],
    members: usize,
) -> Vec<String> {
    let note = |(condition, name): (usize, &String)| {
        let here = || aims.iter().zip(targets).filter(|(aim, _)| aim.feature.condition == condition);
        let features: Vec<Feature> = here().map(|(aim, _)| aim.feature.clone()).collect();
        let targets = here().map(|(_, target)| target).collect();
        let said =
            start_sentence(&ConditionFeatures { model, values, features, targets, members }, condition)?;
        Some(if names.len() > 1 { format!("`{name}`: {said}") } else { said })
    };
    names.iter().enumerate().filter_map(note).collect()
}

fn start_sentence(shown: &ConditionFeatures, condition: usize) -> Option<String> {
    let decay_s = shown.model.decay_s(shown.values, condition).filter(|_| !shown.features.is_empty())?;
    let as_fitted = shown.read_features(None)?;
    if shown.model.max_lead_s(condition) < decay_s {
        let moved = shown.read_features(Some(Restart::Moved(ANGLE_CHANGE)))?;
        let (name, by) =
            shown.largest_difference(&as_fitted, &moved).filter(|(_, by)| *by > MIN_VISIBLE_SHIFT_SD)?;
        return Some(format!(
            "the start of the scene shows in the features: from a start with angles {:.0} % larger, the best \
             model's `{name}` is {by:.1} standard deviations away; begin the windows about {:.3} s later (three \
             decay times of the slowest mode), or average over starts with [ensemble]",
            100.0 * ANGLE_CHANGE,
            3.0 * decay_s
        ));
    }
    let led = |decays: usize| shown.read_features(Some(Restart::Earlier(decays as f64 * decay_s)));
    let mut earlier = led(1)?;
    let (name, by) =
        shown.largest_difference(&as_fitted, &earlier).filter(|(_, by)| *by > MIN_VISIBLE_SHIFT_SD)?;
    let most = (shown.model.max_lead_s(condition) / decay_s).min(MAX_LEAD_DECAYS as f64) as usize;
    let mut enough = most;
    for decays in 1..most {
        let Some(next) = led(decays + 1) else { break };
        let still = shown.largest_difference(&earlier, &next).map_or(0.0, |(_, by)| by);
        if still <= MAX_FORGOTTEN_SHIFT_SD {
            enough = decays;
            break;
        }
        earlier = next;
    }
    Some(format!(
        "the start of the scene shows in the features: started {decay_s:.3} s earlier (one decay time of the \
         slowest mode), the best model's `{name}` is {by:.1} standard deviations away, so the estimates are \
         biased; set `start.time_s` of the scene at least {:.3} s earlier, or begin the windows as much later",
        enough as f64 * decay_s
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::feature::{Reading, ValueComparison};
    use crate::fit::job::{TargetSource, TargetStage};
    use crate::fit::scene_model::{Instrument, ModelCondition, PlausibilityLimits, SceneModel};
    use crate::recording::channel::Window;
    use crate::simulate::scene::Scene;
    use crate::simulate::twin::Camera;

    const SCENE: &str = include_str!("../../data/scenes/actual-blade.toml");

    /// Notes on a job whose best values are those of the scene. The job's only target is the mean deflection
    /// over `window`, with a standard deviation of 0.5 %.
    fn said(start: &str, window: &str) -> Vec<String> {
        let text = SCENE.replace("time_s = 0.56\nkind = \"steady-slide\"", start);
        assert_ne!(text, SCENE);
        let scene = Scene::parse("scene.toml", &text).unwrap();
        let camera = Camera { frame_rate_hz: 5000.0, exposure_s: 0.0 };
        let instrument = Instrument { camera, noise_m: 0.0, dropout_fraction: 0.0 };
        let model = SceneModel::new(
            vec![ModelCondition { scene, instrument }],
            Vec::new(),
            PlausibilityLimits::default(),
        );
        let reading = Reading::MeanDeflection(Window::parse(window).unwrap());
        let feature = Feature { name: "mean".to_owned(), reading, condition: 0 };
        let shown = ModelFeatures::new(&model, std::slice::from_ref(&feature), vec![1e-3], 1);
        let value = shown.predict_features(&[]).unwrap()[0].value().unwrap();
        let sd = 0.005 * value.abs();
        let (name, measure) = ("mean".to_owned(), ValueComparison::Log);
        let target = TargetValue { name, value, sd, scatter: 0.0, measure, last: false, calibration: None };
        let source = TargetSource::Given { target: value, sd };
        let aim = FitTarget {
            feature,
            source,
            tolerance_relative: None,
            held_out: false,
            stage: TargetStage::Always,
        };
        start_notes(&model, &["film".to_owned()], (&[aim], &[target]), &[], 1)
    }

    #[test]
    fn a_start_shortly_before_the_first_window_is_said_with_what_to_do() {
        let notes = said("time_s = 0.56\nkind = \"upright\"", "0.565..0.6");
        let [note] = notes.as_slice() else { panic!("{notes:?}") };
        assert!(
            note.starts_with("the start of the scene shows in the features: started 0.0")
                && note.contains("`mean` is ")
                && note.contains("set `start.time_s` of the scene at least 0."),
            "{note}"
        );
    }

    #[test]
    fn a_start_that_is_long_forgotten_is_not_mentioned() {
        assert_eq!(said("time_s = 0.2\nkind = \"steady-slide\"", "0.6..0.64"), Vec::<String>::new());
    }
}
