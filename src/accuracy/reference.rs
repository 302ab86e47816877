//! The run that the others are held against, and what each of them errs by.

use super::components::{Components, HIGH, LOW, Reader};
use super::lists::Lists;
use super::motion::Motion;
use super::setting::{REFERENCE_TOLERANCE, Setting};
use crate::simulate::scene::Scene;
use crate::simulate::{Effort, Method, Run, run_with};

/// The run that the others are held against.
pub struct Reference<'a> {
    scene: &'a Scene,
    motion: Motion,
    spectral: Reader,
    /// Its components, Hz.
    pub components: Components,
    /// The method that it is checked against, at the same tolerance.
    pub checked_by: Method,
    /// Worst difference of the two methods' transition times, s; `None` when their lists differ or are empty.
    pub apart_s: Option<f64>,
    /// Whether the two lists of transitions agree.
    pub lists_agree: bool,
    /// Worst difference of their deflections relative to its range.
    pub state_apart: f64,
}

/// What a setting errs by and costs.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// The setting.
    pub setting: Setting,
    /// How the run went.
    pub run: Run,
    /// Time that it took, s; infinite until the caller has taken it.
    pub wall_s: f64,
    /// Its list of transitions against the reference's.
    pub lists: Lists,
    /// Time of its end against the reference's, s.
    pub stop_error_s: f64,
    /// Root mean square error of the deflection, relative to its range.
    pub state_rms: f64,
    /// Worst error of the deflection, relative to its range.
    pub state_worst: f64,
    /// Errors of the components, Hz, where both runs show them.
    pub components_hz: [Option<f64>; 2],
}

impl<'a> Reference<'a> {
    /// Runs a scene by the default method and checks it against Runge-Kutta.
    #[must_use]
    pub fn of(scene: &'a Scene) -> Self {
        let reference = |method| Motion::of(scene, Effort { method, ..Effort::new(REFERENCE_TOLERANCE) });
        let checked_by = Method::RungeKutta;
        let [motion, check] = [Method::default(), checked_by].map(reference);
        let lists = Lists::compare(&motion.transitions, &check.transitions);
        let (_, state_apart) = Motion::differences(&motion, &check);
        let spectral = Reader::of(scene, motion.recording(scene).as_ref());
        let components = spectral.read(&motion.deflection_m, &motion.head_drop_m);
        Self {
            scene,
            spectral,
            components,
            checked_by,
            apart_s: lists.worst_s,
            lists_agree: lists.agree(),
            state_apart,
            motion,
        }
    }

    /// How the reference itself went.
    #[must_use]
    pub fn run(&self) -> &Run {
        &self.motion.run
    }

    /// Whether an error of transition times is larger than what the reference is sure of.
    #[must_use]
    pub fn is_sure_of(&self, error_s: f64) -> bool {
        self.lists_agree && self.apart_s.is_none_or(|apart| error_s > apart)
    }

    /// Runs a setting and nothing else, to be timed.
    #[must_use]
    pub fn run_bare(&self, setting: &Setting) -> Run {
        run_with(self.scene, setting.effort(), &mut ())
    }

    /// Runs a setting and holds it against the reference.
    #[must_use]
    pub fn measure(&self, setting: Setting) -> Row {
        let motion = Motion::of(self.scene, setting.effort());
        let (state_rms, state_worst) = Motion::differences(&self.motion, &motion);
        let components = self.spectral.read(&motion.deflection_m, &motion.head_drop_m);
        let error = |i: usize| Some((components.hz[i]? - self.components.hz[i]?).abs());
        Row {
            setting,
            wall_s: f64::INFINITY,
            lists: Lists::compare(&self.motion.transitions, &motion.transitions),
            stop_error_s: (motion.run.stopped_at_s - self.motion.run.stopped_at_s).abs(),
            state_rms,
            state_worst,
            components_hz: [error(LOW), error(HIGH)],
            run: motion.run,
        }
    }
}
