//! The run that the others are held against, and what each of them errs by.

use super::sampled_run::{SampledRun, comparison_grid};
use super::transition_lists::TransitionDifference;
use super::{REFERENCE_TOLERANCE, SolverSetting};
use crate::model::modes::body_frequencies;
use crate::recording::Recording;
use crate::recording::channel::{InstantKind, ReversalInstants, Window, WindowEnd};
use crate::simulate::scene::Scene;
use crate::simulate::{IntegrationMethod, RunResult, SolverOptions, run_scene_with};
use crate::spectrum::{SpectrumSettings, analyse_spectrum};
use std::ops::Range;

/// The run that the others are held against.
pub(crate) struct ReferenceRun<'a> {
    scene: &'a Scene,
    motion: SampledRun,
    spectral: ComponentReader,
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
pub(crate) struct AccuracyRow {
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
    pub(crate) fn from_scene(scene: &'a Scene) -> Self {
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
    pub(crate) fn run_result(&self) -> &RunResult {
        &self.motion.run
    }

    /// Whether an error of transition times is larger than what the reference is sure of.
    pub(crate) fn resolves_error(&self, error_s: f64) -> bool {
        self.lists_agree && self.apart_s.is_none_or(|apart| error_s > apart)
    }

    /// Runs a setting and nothing else, to be timed.
    pub(crate) fn run_untracked(&self, setting: &SolverSetting) -> RunResult {
        run_scene_with(self.scene, setting.solver_options(), &mut ())
    }

    /// Runs a setting and holds it against the reference.
    pub(crate) fn measure_setting(&self, setting: SolverSetting) -> AccuracyRow {
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

// The two spectral components that fits are held against, read by the same code.

/// Place of the low component: the head on its spring, read from the head's drop.
pub(crate) const LOW_COMPONENT: usize = 0;
/// Place of the high component: the stick-slip cycle, read from the deflection.
pub(crate) const HIGH_COMPONENT: usize = 1;

/// Frequencies between which each component is sought, in units of the head's natural frequency: the low one
/// was published at 1.5 and 3.9 times that frequency, the high one at 40 to 80 times it.
const BANDS_OVER_HEAD: [(f64, f64); 2] = [(1.0, 6.0), (6.0, 600.0)];
/// Time after the release before a window starts, s: what the flip leaves dies out.
const AFTER_RELEASE_S: f64 = 0.01;

/// The components of a run.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct ComponentPair {
    /// Frequency of the low and the high component, Hz; `None` where there is none.
    pub hz: [Option<f64>; 2],
}

/// What is read from every run: the same frames, whenever its own tip was released.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ComponentReader {
    frames: Range<usize>,
    frame_rate_hz: f64,
    bands_hz: [(f64, f64); 2],
}

impl ComponentReader {
    /// From the release that the reference shows to its end; all of it where it shows none.
    pub(crate) fn from_reference(scene: &Scene, reference: Option<&Recording>) -> Self {
        let from = WindowEnd::Found { anchor: InstantKind::Release, reversal: 1, offset_s: AFTER_RELEASE_S };
        let window = Window { from, to: WindowEnd::Open };
        let released = reference.and_then(|recording| {
            window.resolve_frames(recording, &ReversalInstants::find_instants(recording)).ok()
        });
        let frames = released.unwrap_or(0..reference.map_or(0, |recording| recording.grid().frames));
        let head_hz = body_frequencies(&scene.linkage).head_hz;
        let frame_rate_hz = comparison_grid(scene).frame_rate_hz;
        let bands_hz =
            BANDS_OVER_HEAD.map(|(low, high)| (low * head_hz, (high * head_hz).min(frame_rate_hz / 2.0)));
        Self { frames, frame_rate_hz, bands_hz }
    }

    /// The components of a run, of which each column has one sample a frame, m.
    pub(crate) fn read_components(&self, deflection_m: &[f64], head_drop_m: &[f64]) -> ComponentPair {
        let strongest = |column: &[f64], (low, high): (f64, f64)| {
            let inside: Vec<Option<f64>> =
                column.get(self.frames.clone())?.iter().map(|x| Some(*x)).collect();
            let settings = SpectrumSettings { band_hz: Some((low, high)), ..SpectrumSettings::default() };
            let spectrum = analyse_spectrum(&inside, self.frame_rate_hz, &settings).ok()?;
            spectrum.component_in_band(low, high).map(|c| c.frequency_hz)
        };
        ComponentPair {
            hz: [
                strongest(head_drop_m, self.bands_hz[LOW_COMPONENT]),
                strongest(deflection_m, self.bands_hz[HIGH_COMPONENT]),
            ],
        }
    }
}
