//! One point of a study: its run, and the readings for every map.

use super::study::{Study, SweepMap};
use crate::feature::{FeatureReader, MissingReason, RunRecord};
use crate::recording::channel::ReversalInstants;
use crate::simulate::equilibrium::steady_slip_pose;
use crate::simulate::outputs::{EnergyAudit, Transitions};
use crate::simulate::scene::error::SceneError;
use crate::simulate::scene::{Scene, StartKind};
use crate::simulate::twin::{TwinView, TwinViewError, film_scene_with_observer};
use crate::simulate::{Impact, Observer, SolutionSegment, SolverOptions, Transition};
use crate::text::panic_message;
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Maximum number of evaluations of the right-hand side of the equations of motion in a run: several hundred
/// times the number for one reversal, or a few seconds of computing.
const MOST_EVALUATIONS: u64 = 20_000_000;

/// Outcome of a point.
#[derive(Debug, Clone, PartialEq)]
pub struct PointOutcome {
    /// Reason why the run ended before its stop time, if it did.
    pub ended: Option<EarlyEnd>,
    /// Time at which the run ended, s; `None` if the run did not start or its end is unknown.
    pub stopped_at_s: Option<f64>,
    /// One value per map, in the unit of the reading, or the reason why it is missing.
    pub values: Vec<Result<f64, MissingReason>>,
}

/// Reason why a run ended before its stop time.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EarlyEnd {
    /// The reason in one word.
    pub reason: MissingReason,
    /// Details that add to the reason; often empty.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub why: String,
}

impl EarlyEnd {
    fn new(reason: MissingReason, why: impl ToString) -> Self {
        Self { reason, why: why.to_string() }
    }
}

impl PointOutcome {
    /// Runs point `index` of a checked study; a panic is recorded as the reason of an early end.
    pub(crate) fn run_point(study: &Study, scene: &Scene, index: usize) -> Self {
        Self::run_point_scene(study, || study.scene_of_point(scene, index), || ControlFlow::Continue(()))
    }

    /// Runs any scene as a point; `flow` is called during the run and may end it.
    #[must_use]
    pub fn run_point_scene(
        study: &Study,
        scene: impl FnOnce() -> Result<Scene, SceneError>,
        flow: impl Fn() -> ControlFlow<()>,
    ) -> Self {
        let run = catch_unwind(AssertUnwindSafe(|| Self::try_run(study, scene, flow)));
        let panicked = run.unwrap_or_else(|payload| {
            let why = panic_message(payload.as_ref()).unwrap_or_default();
            Err((EarlyEnd::new(MissingReason::Panicked, why), None))
        });
        panicked.unwrap_or_else(|(ended, stopped_at_s)| {
            let values = vec![Err(ended.reason); study.maps.len()];
            Self { ended: Some(ended), stopped_at_s, values }
        })
    }

    /// How the run ended, as written in files: `completed`, or the reason of an early end.
    #[must_use]
    pub fn status(&self) -> &'static str {
        self.ended.as_ref().map_or("completed", |ended| ended.reason.name())
    }

    /// Runs a point and takes its readings. If nothing can be read, returns the reason and the time at which
    /// the run ended, s.
    fn try_run(
        study: &Study,
        scene: impl FnOnce() -> Result<Scene, SceneError>,
        flow: impl Fn() -> ControlFlow<()>,
    ) -> Result<Self, (EarlyEnd, Option<f64>)> {
        let scene = scene().map_err(|error| (EarlyEnd::new(MissingReason::NoStart, error), None))?;
        // a study may set a preload or a friction with which the scene has no steady slip from which the run
        // could start
        let speed = scene.drive.motion_at(scene.start_s).velocity_m_per_s;
        if scene.start == StartKind::SteadySlide && steady_slip_pose(&scene.linkage, speed).is_none() {
            return Err((EarlyEnd::new(MissingReason::NoStart, ""), None));
        }
        let most_evaluations = scene.run.most_evaluations.unwrap_or(MOST_EVALUATIONS);
        let effort = SolverOptions { most_evaluations, ..SolverOptions::from_scene(&scene) };
        let audited = study.maps.iter().any(|map| map.reading.needs_audit());
        let audit = audited.then(EnergyAudit::default);
        let mut watch = PointObserver { transitions: Transitions::default(), audit, flow };
        let span_s = [scene.start_s, scene.run.stop_s];
        let view = film_scene_with_observer(&scene, &study.camera, span_s, effort, &mut watch);
        let TwinView { recording, run, stick_s } = view.map_err(|error| match error {
            TwinViewError::Early { status, stopped_at_s } => {
                let reason = MissingReason::from_status(status).unwrap_or(MissingReason::NoWindow);
                (EarlyEnd::new(reason, "before two frames were taken"), Some(stopped_at_s))
            }
            TwinViewError::Recording(error) => (EarlyEnd::new(MissingReason::Diverged, error), None),
        })?;
        let PointObserver { transitions: Transitions(transitions), audit, .. } = watch;
        let record = RunRecord { span_s, run, stick_s, transitions, audit };
        let instants = ReversalInstants::find_instants(&recording);
        let reader = FeatureReader::with_run(&recording, &instants, &record);
        let read = |map: &SweepMap| {
            let found = map.reading.read(None, &reader).map_err(|missing| missing.reason())?;
            if found.value.is_finite() { Ok(found.value) } else { Err(MissingReason::NotFinite) }
        };
        Ok(Self {
            ended: MissingReason::from_status(run.status).map(|reason| EarlyEnd::new(reason, "")),
            stopped_at_s: Some(run.stopped_at_s),
            values: study.maps.iter().map(read).collect(),
        })
    }
}

/// Records the transitions of a run, and its extremes if a map reads them.
struct PointObserver<F> {
    transitions: Transitions,
    audit: Option<EnergyAudit>,
    flow: F,
}

impl<F: Fn() -> ControlFlow<()>> Observer for PointObserver<F> {
    fn control_flow(&self) -> ControlFlow<()> {
        (self.flow)()
    }
    fn observe_segment(&mut self, piece: &SolutionSegment<'_>) {
        self.audit.iter_mut().for_each(|audit| audit.observe_segment(piece));
    }
    fn observe_transition(&mut self, transition: &Transition) {
        self.transitions.observe_transition(transition);
    }
    fn observe_impact(&mut self, impact: &Impact) {
        self.audit.iter_mut().for_each(|audit| audit.observe_impact(impact));
    }
}
