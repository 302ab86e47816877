//! Runs of the model at the estimates, one per condition.

use super::overlay::view_through_camera;
use crate::fit::evaluation::RunFailure;
use crate::fit::job::Job;
use crate::fit::result::FitResult;
use crate::fit::scene_model::SceneModel;
use crate::fit::trace::FittedTraces;
use crate::simulate::mode::TipMode;
use crate::simulate::motion::{MotionRecorder, RunMotion};
use crate::simulate::scene::Scene;
use crate::simulate::twin::TwinView;
use crate::simulate::{RunStatus, Transition, TransitionCause};
use rayon::prelude::*;
use serde::{Serialize, Serializer};

/// A run of the model at the estimates in one condition.
#[derive(Debug, Clone)]
pub struct ModelRun {
    /// The scene with the estimates as its values.
    pub scene: Scene,
    /// The motion of the model as the camera of the condition records it; after a fit to traces, through the
    /// fitted camera and in the frames of the recording.
    pub view: TwinView,
    /// The fitted traces beside the model, if traces were fitted.
    pub(crate) traces: Option<FittedTraces>,
    /// States of the run.
    pub motion: RunMotion,
}

/// Runs the model at the estimates in every condition, with the integration tolerance that the scene of the
/// condition states.
///
/// # Errors
/// [`RunFailure`] if a run ends before its camera has taken two frames.
pub fn run_conditions(
    job: &Job,
    model: &SceneModel,
    result: &FitResult,
) -> Result<Vec<ModelRun>, RunFailure> {
    let values: Vec<f64> =
        job.parameters.iter().filter_map(|p| result.parameters.get(&p.name)).map(|p| p.estimate).collect();
    let at = |condition| {
        let scene = model.scene_at(&values, condition)?;
        let mut recorder = MotionRecorder::new(&scene);
        let mut view = model.record_scene(&scene, condition, &mut recorder)?;
        let mut traces = model.fitted_traces(condition).cloned();
        match traces.as_ref().and_then(|traces| view_through_camera(&view, traces)) {
            Some(shown) => view.recording = shown,
            None => traces = None,
        }
        Ok(ModelRun { motion: recorder.into_motion(&scene, view.run), scene, view, traces })
    };
    (0..job.conditions.len()).into_par_iter().map(at).collect()
}

/// Summary of a run of the model at the estimates: how it ended, its sticks, losses of contact, impacts and
/// jams.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct RunSummary {
    /// Name of the condition.
    pub name: String,
    /// How the run ended; serialized as `status` and, as a sentence, `meaning`.
    #[serde(flatten, serialize_with = "with_meaning")]
    pub status: RunStatus,
    /// Start of the run, s.
    pub started_at_s: f64,
    /// End of the run, s.
    pub stopped_at_s: f64,
    /// Number of changes of contact mode.
    pub transitions: usize,
    /// Number of sticks.
    pub sticks: usize,
    /// Duration of the longest stick, s.
    pub longest_stick_s: Option<f64>,
    /// Fraction of the duration of the run in which the tip sticks, 0 to 1.
    pub stick_share: Option<f64>,
    /// Number of losses of contact.
    pub contact_losses: usize,
    /// Number of impacts of the tip on the glass.
    pub impacts: usize,
    /// Number of jams of the tip (Painlevé paradox).
    pub jams: usize,
    /// Whether the run ended because more than one contact mode was consistent with the forces.
    pub indeterminate: bool,
    /// Whether the run ended because too many transitions followed each other within a very short time.
    pub chattering: bool,
    /// Whether the head in the recording turns in the opposite direction to the head of the model.
    #[serde(rename = "opposed")]
    pub opposite_turn: bool,
    /// Smallest normal force on the tip in the run while the tip is in contact, N.
    pub least_normal_force_n: Option<f64>,
    /// Smallest Painlevé indicator in the run while the tip slips.
    pub least_painleve_indicator: Option<f64>,
}

fn with_meaning<S: Serializer>(status: &RunStatus, to: S) -> Result<S::Ok, S::Error> {
    #[derive(Serialize)]
    struct StatusWithMeaning {
        status: RunStatus,
        meaning: &'static str,
    }
    StatusWithMeaning { status: *status, meaning: status.meaning() }.serialize(to)
}

/// Summary of the run of the condition with the given name.
pub(super) fn summarize_run(name: &str, started_at_s: f64, motion: &RunMotion) -> RunSummary {
    let run = &motion.run;
    let lasted_s = run.stopped_at_s - started_at_s;
    let sticks = motion.stick_s.iter().map(|[from, to]| to - from);
    let stuck_s: f64 = sticks.clone().fold(0.0, |all, one| all + one); // (an empty `sum` is -0)
    let changes = |is: fn(&Transition) -> bool| motion.transitions.iter().filter(|t| is(t)).count();
    // the event that stops a run is not among its transitions
    let stopped = |status: RunStatus| usize::from(run.status == status);
    RunSummary {
        name: name.to_owned(),
        status: run.status,
        started_at_s,
        stopped_at_s: run.stopped_at_s,
        transitions: motion.transitions.len(),
        sticks: motion.stick_s.len(),
        longest_stick_s: sticks.reduce(f64::max),
        stick_share: (lasted_s > 0.0).then(|| stuck_s / lasted_s),
        contact_losses: changes(|t| t.from != TipMode::Flight && t.to == TipMode::Flight)
            + stopped(RunStatus::ContactLost),
        impacts: motion.impacts.len(),
        jams: changes(|t| t.cause == TransitionCause::JamImpact) + stopped(RunStatus::Jammed),
        indeterminate: run.status == RunStatus::Indeterminate,
        chattering: run.status == RunStatus::Chattering,
        opposite_turn: false,
        least_normal_force_n: motion.extremes.min_normal_force_n,
        least_painleve_indicator: motion.extremes.min_painleve_indicator,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::scene::Scene;

    const SCENE: &str = include_str!("../../data/scenes/actual-blade.toml");
    const FLY: &str = "\n[contact]\nloss = \"fly\"\njam = \"impact\"\n";

    /// Runs the actual blade with another preload, and with a drive faster than that of any wiper.
    fn ran(preload_n: f64, frequency_hz: f64, contact: &str) -> RunSummary {
        let text = SCENE.replace("preload_force_n = 0.126", &format!("preload_force_n = {preload_n}"));
        let text = text.replace("frequency_hz = 0.749", &format!("frequency_hz = {frequency_hz:?}"));
        let scene = Scene::parse("s", &format!("{text}{contact}")).unwrap();
        summarize_run("c", scene.start_s, &RunMotion::simulate(&scene))
    }

    #[test]
    fn a_quiet_run_has_no_hard_event_and_its_sticks_are_counted() {
        let line = ran(0.126, 0.749, "");
        assert_eq!(
            (line.status, line.contact_losses, line.impacts, line.jams, line.indeterminate, line.chattering),
            (RunStatus::Completed, 0, 0, 0, false, false)
        );
        assert!(line.least_normal_force_n.unwrap() > 0.0 && line.least_painleve_indicator.unwrap() > 0.0);
        let (share, longest_s) = (line.stick_share.unwrap(), line.longest_stick_s.unwrap());
        assert!(
            line.sticks > 100 && line.transitions >= 2 * line.sticks - 2 && share > 0.05 && share < 0.5,
            "{line:?}"
        );
        assert!(longest_s > 0.03 && longest_s < share * (line.stopped_at_s - line.started_at_s), "{line:?}");
    }

    #[test]
    fn a_tip_that_never_sticks_does_so_for_no_share_of_the_run() {
        let scene = Scene::parse("s", &SCENE.replace("a = 0.108", "a = 0.0").replace("c = 0.296", "c = 0.0"))
            .unwrap();
        let line = summarize_run("c", scene.start_s, &RunMotion::simulate(&scene));
        assert_eq!((line.sticks, line.stick_share.map(f64::to_bits)), (0, Some(0.0_f64.to_bits())));
    }

    #[test]
    fn lost_contact_counts_where_it_ends_the_run_and_where_the_tip_flies() {
        let stopped = ran(0.126, 12.0, "");
        assert_eq!((stopped.status, stopped.contact_losses, stopped.impacts), (RunStatus::ContactLost, 1, 0));
        let flown = ran(0.126, 12.0, FLY);
        assert_eq!(flown.status, RunStatus::Completed);
        assert!(flown.contact_losses > 10 && flown.impacts >= flown.contact_losses - 1, "{flown:?}");
    }

    #[test]
    fn a_jam_that_ends_the_run_counts() {
        let line = ran(0.4, 20.0, "");
        assert_eq!((line.status, line.jams, line.contact_losses), (RunStatus::Jammed, 1, 0));
    }
}
