//! Reference run, and the errors of other runs relative to it.

use super::sampled_run::{SampledRun, comparison_grid};
use super::transition_lists::TransitionDifference;
use super::{REFERENCE_TOLERANCE, SolverSetting};
use crate::model::modes::body_frequencies;
use crate::recording::Recording;
use crate::recording::channel::{InstantKind, ReversalInstants, Window, WindowEnd};
use crate::simulate::scene::Scene;
use crate::simulate::{IntegrationMethod, RunResult, SolverOptions, run_scene_with};
use short_spectra::{SpectrumSettings, analyse_spectrum};
use std::ops::Range;

/// Reference run of a scene, with which runs of other solver settings are compared.
pub(crate) struct ReferenceRun<'a> {
    scene: &'a Scene,
    motion: SampledRun,
    spectral: ComponentReader,
    pub components: ComponentPair,
    /// Method of a second run at the same tolerance, which checks the reference.
    pub checked_by: IntegrationMethod,
    /// Largest difference between the transition times of both methods, s; `None` if their lists of
    /// transitions differ or are empty.
    pub apart_s: Option<f64>,
    /// Whether both methods find the same transitions.
    pub lists_agree: bool,
    /// Largest difference between the deflections of both methods, relative to the range of the deflection.
    pub state_apart: f64,
}

/// Errors and cost of a run with one solver setting. The errors are relative to the reference run.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct AccuracyRow {
    pub setting: SolverSetting,
    /// Summary of the run.
    pub run: RunResult,
    /// Duration of the run, s; infinite until the caller sets it.
    pub wall_s: f64,
    /// Difference of the run's transitions from those of the reference.
    pub lists: TransitionDifference,
    /// Error of the time at which the run ends, s.
    pub stop_error_s: f64,
    /// Root-mean-square error of the deflection, relative to the range of the deflection in the reference
    /// run.
    pub state_rms: f64,
    /// Largest error of the deflection, relative to the range of the deflection in the reference run.
    pub state_worst: f64,
    /// Errors of the frequencies of the low and the high component, Hz; `None` unless the component is found
    /// in both the run and the reference.
    pub components_hz: [Option<f64>; 2],
    /// Largest predicted error of a transition time, s; `None` for other methods than Taylor series.
    pub predicted_time_error_s: Option<f64>,
    /// Time after which the order of the transitions is predicted to be undetermined, s.
    pub undetermined_after_s: Option<f64>,
}

impl<'a> ReferenceRun<'a> {
    /// Runs a scene with the default method, and checks the result with a Runge-Kutta run.
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

    /// Summary of the reference run.
    pub(crate) fn run_result(&self) -> &RunResult {
        &self.motion.predicted.run
    }

    /// Whether an error of the transition times exceeds the uncertainty of the reference.
    pub(crate) fn resolves_error(&self, error_s: f64) -> bool {
        self.lists_agree && self.apart_s.is_none_or(|apart| error_s > apart)
    }

    /// Runs the scene with a solver setting and without observers, for timing.
    pub(crate) fn run_untracked(&self, setting: &SolverSetting) -> RunResult {
        run_scene_with(self.scene, setting.solver_options(), &mut ())
    }

    /// Runs the scene with a solver setting, and compares the run with the reference run.
    pub(crate) fn measure_setting(&self, setting: SolverSetting) -> AccuracyRow {
        let motion = SampledRun::run_scene(self.scene, setting.solver_options());
        let (state_rms, state_worst) = SampledRun::deflection_differences(&self.motion, &motion);
        let components = self.spectral.read_components(&motion.deflection_m, &motion.head_drop_m);
        let predicted = Some(&motion.predicted).filter(|_| setting.method == IntegrationMethod::Taylor);
        let error = |i: usize| Some((components.hz[i]? - self.components.hz[i]?).abs());
        AccuracyRow {
            setting,
            wall_s: f64::INFINITY,
            lists: TransitionDifference::from_lists(&self.motion.transitions, &motion.transitions),
            stop_error_s: (motion.predicted.run.stopped_at_s - self.run_result().stopped_at_s).abs(),
            state_rms,
            state_worst,
            components_hz: [error(LOW_COMPONENT), error(HIGH_COMPONENT)],
            predicted_time_error_s: predicted.and_then(|run| run.largest_error_s),
            undetermined_after_s: predicted.and_then(|run| run.undetermined_after_s),
            run: motion.predicted.run,
        }
    }
}

// Low and high spectral component of a run, found as in fits.

/// Index of the low spectral component: the vibration of the head on its support, measured in the head's
/// drop.
pub(crate) const LOW_COMPONENT: usize = 0;
/// Index of the high spectral component: the stick-slip cycle, measured in the deflection.
pub(crate) const HIGH_COMPONENT: usize = 1;

/// Search bands of the low and the high component, relative to the head's natural frequency. Published values
/// are 1.5 and 3.9 times that frequency for the low component, and 40 to 80 times for the high one.
const BANDS_OVER_HEAD: [(f64, f64); 2] = [(1.0, 6.0), (6.0, 600.0)];
/// Time from the release of the tip to the start of the analysed frames, s; in this time, the vibration from
/// the flip decays.
const AFTER_RELEASE_S: f64 = 0.01;

/// The spectral components of a run.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct ComponentPair {
    /// Frequencies of the low and the high component, Hz; `None` for a component that was not found.
    pub hz: [Option<f64>; 2],
}

/// Finds the components of every run in the same frames, regardless of the time of the run's own release.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ComponentReader {
    frames: Range<usize>,
    frame_rate_hz: f64,
    bands_hz: [(f64, f64); 2],
}

impl ComponentReader {
    /// Uses the frames from [`AFTER_RELEASE_S`] after the release of the tip in the reference run to the end
    /// of that run, or all frames if there is no release.
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

    /// Components of a run from its deflection and head drop, one sample per frame, m.
    pub(crate) fn read_components(&self, deflection_m: &[f64], head_drop_m: &[f64]) -> ComponentPair {
        let strongest = |column: &[f64], (low, high): (f64, f64)| {
            let inside = column.get(self.frames.clone())?.iter().map(|x| Some(*x));
            let settings = SpectrumSettings { band_hz: Some((low, high)), ..SpectrumSettings::default() };
            let spectrum =
                analyse_spectrum(&inside.collect::<Vec<_>>(), self.frame_rate_hz, &settings).ok()?;
            spectrum.component_in_band(low, high).map(|c| c.frequency_hz)
        };
        let [low, high] = self.bands_hz;
        ComponentPair { hz: [strongest(head_drop_m, low), strongest(deflection_m, high)] }
    }
}
