//! Options for the integration of a scene.

use super::prelude::*;
use crate::simulate::fixed_step_scheme::{
    DEFAULT_GAIN_PER_S, FixedStepLocator, FixedStepScheme, LARGEST_GAIN_TIMES_STEP,
};
use crate::simulate::scene::contact::{ContactLossRule, JamRule};
use crate::simulate::scene::{Scene, check_tolerance};
use crate::simulate::{IntegrationMethod, SolverOptions};
use clap::ValueEnum;

#[derive(Debug, Args)]
pub(crate) struct MethodArgs {
    /// Tolerated relative error of a step, instead of that of the scene
    #[arg(long, value_name = "NUMBER", allow_negative_numbers = true)]
    pub relative_tolerance: Option<f64>,
    /// Method of integration
    #[arg(long, value_enum, default_value = "adaptive")]
    pub method: MethodName,
    /// Length of a step, s (required for fixed-step)
    #[arg(long, value_name = "SECONDS", allow_hyphen_values = true)]
    pub step: Option<f64>,
    /// Point at which fixed-step makes transitions (default: slack)
    #[arg(long, value_enum, value_name = "WHERE")]
    pub transitions: Option<TransitionsAt>,
    /// Gain with which fixed-step stabilises stick, 1/s (default: 1e4; with 0 the velocity of the tip is
    /// removed at the transition instead)
    #[arg(long, value_name = "NUMBER", allow_hyphen_values = true)]
    pub gain: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum MethodName {
    /// Taylor series with error control, the default; transitions are roots of the series of the guards
    Adaptive,
    /// Order 8 with error control; transitions bracketed on the dense output
    RungeKutta,
    /// Order 8 with error control; transitions located by the slack variable method
    Slack,
    /// The paper's scheme: order 4 in fixed steps, stick as a stabilised constraint
    FixedStep,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum TransitionsAt {
    /// At the end of the step: order 1
    StepEnd,
    /// Where the slack variable is zero: order 4
    Slack,
}

/// Maximum number of steps of a run; this many steps take about an hour of computing.
const MOST_STEPS: f64 = 1e10;

impl MethodArgs {
    /// The solver options for the scene.
    pub(crate) fn integration_effort(&self, scene: &Scene) -> Outcome<SolverOptions> {
        let tolerance = self.relative_tolerance.unwrap_or(scene.run.relative_tolerance);
        check_tolerance(tolerance).map_err(|expected| {
            Failure::Input(format!("--relative-tolerance: found {tolerance}, expected {expected}"))
        })?;
        let method = match self.method {
            MethodName::FixedStep => IntegrationMethod::FixedStep(self.fixed_step_method(scene)?),
            MethodName::Adaptive => IntegrationMethod::default(),
            MethodName::RungeKutta => IntegrationMethod::RungeKutta,
            MethodName::Slack => IntegrationMethod::Slack,
        };
        if self.method != MethodName::FixedStep {
            let typed = [
                ("--step", self.step.map(|x| x.to_string())),
                ("--transitions", self.transitions.map(|w| value_name(&w))),
                ("--gain", self.gain.map(|x| x.to_string())),
            ];
            if let Some((option, found)) = typed.into_iter().find_map(|(option, x)| Some((option, x?))) {
                let with = value_name(&self.method);
                return Err(Failure::Input(format!(
                    "{option}: found {found} with --method {with}, expected it with --method fixed-step alone; remove it or choose that method"
                )));
            }
        }
        Ok(SolverOptions { method, relative_tolerance: tolerance, ..SolverOptions::from_scene(scene) })
    }

    fn fixed_step_method(&self, scene: &Scene) -> Outcome<FixedStepScheme> {
        let refuse = |option: &str, found: &str, expected: &str| {
            Err(Failure::Input(format!("{option}: found {found}, expected {expected}")))
        };
        if let Some(tolerance) = self.relative_tolerance {
            let found = format!("{tolerance} with --method fixed-step");
            return refuse("--relative-tolerance", &found, "none, as the step sets the error; remove it");
        }
        refuse_flight(scene)?;
        let Some(step_s) = self.step else {
            let expected = "a length in seconds, as --method fixed-step needs one; add --step 1e-5";
            return refuse("--step", "nothing", expected);
        };
        let length = scene.run.stop_s - scene.start_s;
        if !(step_s > 0.0 && step_s <= length && length / step_s <= MOST_STEPS) {
            let most = format!("at most the run's {length}, in at most {MOST_STEPS:e} steps");
            let expected = format!("a number of seconds above 0, {most}");
            return refuse("--step", &step_s.to_string(), &expected);
        }
        let gain_per_s = self.gain.unwrap_or(DEFAULT_GAIN_PER_S);
        let most = LARGEST_GAIN_TIMES_STEP / step_s;
        if !(0.0..=most).contains(&gain_per_s) {
            let expected = format!(
                "a number from 0 to {most:.4e} 1/s, beyond which steps of {step_s} s are unstable; choose a shorter step or a smaller gain"
            );
            return refuse("--gain", &gain_per_s.to_string(), &expected);
        }
        let locate = match self.transitions {
            Some(TransitionsAt::StepEnd) => FixedStepLocator::StepEnd,
            Some(TransitionsAt::Slack) | None => FixedStepLocator::Slack,
        };
        Ok(FixedStepScheme { step_s, locate, gain_per_s })
    }
}

/// Refuses scenes with flight or impacts, which the fixed-step scheme does not support.
fn refuse_flight(scene: &Scene) -> Outcome<()> {
    let (key, found) = if scene.loss == ContactLossRule::Fly {
        ("contact.loss", "fly")
    } else if scene.jam == JamRule::Impact {
        ("contact.jam", "impact")
    } else {
        return Ok(());
    };
    Err(Failure::Input(format!(
        "--method fixed-step: found {key} = \"{found}\", expected \"stop\"; the fixed-step scheme has no flight: change the key or the method"
    )))
}

fn value_name(value: &impl ValueEnum) -> String {
    value.to_possible_value().map_or_else(String::new, |v| v.get_name().to_owned())
}
