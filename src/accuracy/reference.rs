//! The run that the others are held against, and what each of them errs by.

use super::components::{ComponentPair, ComponentReader, HIGH_COMPONENT, LOW_COMPONENT};
use super::lists::TransitionDifference;
use super::motion::SampledRun;
use super::setting::{REFERENCE_TOLERANCE, SolverSetting};
use crate::simulate::scene::Scene;
use crate::simulate::{IntegrationMethod, RunResult, SolverOptions, run_scene_with};

/// The run that the others are held against.
pub struct ReferenceRun<'a> {
    scene: &'a Scene,
    motion: SampledRun,
    spectral: ComponentReader,
    /// Its components, Hz.
    pub components: ComponentPair,
    /// The method that it is checked against, at the same tolerance.
    pub checked_by: IntegrationMethod,
    /// Worst difference of the two methods' transition times, s; `None` when their lists differ or are empty.
    pub apart_s: Option<f64>,
    /// Whether the two lists of transitions agree.
    pub lists_agree: bool,
    /// Worst difference of their deflections relative to its range.
    pub state_apart: f64,
}

/// What a setting errs by and costs.
#[derive(Debug, Clone, PartialEq)]
pub struct AccuracyRow {
    /// The setting.
    pub setting: SolverSetting,
    /// How the run went.
    pub run: RunResult,
    /// Time that it took, s; infinite until the caller has taken it.
    pub wall_s: f64,
    /// Its list of transitions against the reference's.
    pub lists: TransitionDifference,
    /// Time of its end against the reference's, s.
    pub stop_error_s: f64,
    /// Root mean square error of the deflection, relative to its range.
    pub state_rms: f64,
    /// Worst error of the deflection, relative to its range.
    pub state_worst: f64,
    /// Errors of the components, Hz, where both runs show them.
    pub components_hz: [Option<f64>; 2],
}

impl<'a> ReferenceRun<'a> {
    /// Runs a scene by the default method and checks it against Runge-Kutta.
    #[must_use]
    pub fn from_scene(scene: &'a Scene) -> Self {
        let reference = |method| {
            SampledRun::run_scene(scene, SolverOptions { method, ..SolverOptions::new(REFERENCE_TOLERANCE) })
        };
        let checked_by = IntegrationMethod::RungeKutta;
        let [motion, check] = [IntegrationMethod::default(), checked_by].map(reference);
        let lists = TransitionDifference::from_lists(&motion.transitions, &check.transitions);
        let (_, state_apart) = SampledRun::deflection_differences(&motion, &check);
        let spectral = ComponentReader::from_reference(scene, motion.to_recording(scene).as_ref());
        let components = spectral.read_components(&motion.deflection_m, &motion.head_drop_m);
        Self {
            scene,
            spectral,
            components,
            checked_by,
            apart_s: lists.worst_s,
            lists_agree: lists.is_empty(),
            state_apart,
            motion,
        }
    }

    /// How the reference itself went.
    #[must_use]
    pub fn run_result(&self) -> &RunResult {
        &self.motion.run
    }

    /// Whether an error of transition times is larger than what the reference is sure of.
    #[must_use]
    pub fn resolves_error(&self, error_s: f64) -> bool {
        self.lists_agree && self.apart_s.is_none_or(|apart| error_s > apart)
    }

    /// Runs a setting and nothing else, to be timed.
    #[must_use]
    pub fn run_untracked(&self, setting: &SolverSetting) -> RunResult {
        run_scene_with(self.scene, setting.solver_options(), &mut ())
    }

    /// Runs a setting and holds it against the reference.
    #[must_use]
    pub fn measure_setting(&self, setting: SolverSetting) -> AccuracyRow {
        let motion = SampledRun::run_scene(self.scene, setting.solver_options());
        let (state_rms, state_worst) = SampledRun::deflection_differences(&self.motion, &motion);
        let components = self.spectral.read_components(&motion.deflection_m, &motion.head_drop_m);
        let error = |i: usize| Some((components.hz[i]? - self.components.hz[i]?).abs());
        AccuracyRow {
            setting,
            wall_s: f64::INFINITY,
            lists: TransitionDifference::from_lists(&self.motion.transitions, &motion.transitions),
            stop_error_s: (motion.run.stopped_at_s - self.motion.run.stopped_at_s).abs(),
            state_rms,
            state_worst,
            components_hz: [error(LOW_COMPONENT), error(HIGH_COMPONENT)],
            run: motion.run,
        }
    }
}
