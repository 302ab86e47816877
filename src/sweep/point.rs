//! One point of a study: its run, as far as it went, and what every map reads from it.

use super::study::Study;
use crate::feature::{FeatureReader, MissingReason, Reading, RunRecord};
use crate::recording::channel::ReversalInstants;
use crate::simulate::outputs::{EnergyAudit, Transitions};
use crate::simulate::scene::{Scene, SceneError, StartKind};
use crate::simulate::twin::{TwinView, TwinViewError, film_scene_with_observer};
use crate::simulate::{Impact, Observer, SolutionSegment, SolverOptions, Transition, equilibrium};
use crate::text::panic_message;
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Right-hand sides after which a run is given up: some hundred times what a reversal costs, a
/// few seconds.
const MOST_EVALUATIONS: u64 = 20_000_000;

/// What a point gave.
#[derive(Debug, Clone, PartialEq)]
pub struct PointOutcome {
    /// Why the run ended before its stop time, if it did.
    pub ended: Option<EarlyEnd>,
    /// When it ended, s; `None` where it never ran.
    pub stopped_at_s: Option<f64>,
    /// One value a map, in its unit, or why there is none.
    pub values: Vec<Result<f64, MissingReason>>,
}

/// Why a run ended before its stop time.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EarlyEnd {
    /// In one word.
    pub reason: MissingReason,
    /// What happened, where the reason does not say all.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub why: String,
}

impl EarlyEnd {
    fn new(reason: MissingReason, why: impl ToString) -> Self {
        Self { reason, why: why.to_string() }
    }
}

impl PointOutcome {
    /// The name of a run that reached its stop time.
    pub(crate) const COMPLETED: &'static str = "completed";

    /// Runs point `index` of a checked study; a panic is a reason like any other.
    pub(crate) fn run_point(study: &Study, scene: &Scene, index: usize) -> Self {
        Self::run_point_scene(study, || study.scene_of_point(scene, index), || ControlFlow::Continue(()))
    }

    /// Runs a scene that a study did not choose; `flow` is asked during the run and may end it.
    #[must_use]
    pub fn run_point_scene(
        study: &Study,
        scene: impl FnOnce() -> Result<Scene, SceneError>,
        flow: impl Fn() -> ControlFlow<()>,
    ) -> Self {
        let attempt = || {
            Self::try_run(study, scene, flow)
                .unwrap_or_else(|(ended, stopped_at_s)| Self::without_values(study, ended, stopped_at_s))
        };
        catch_unwind(AssertUnwindSafe(attempt)).unwrap_or_else(|payload| {
            Self::without_values(
                study,
                EarlyEnd::new(MissingReason::Panicked, panic_message(payload.as_ref()).unwrap_or_default()),
                None,
            )
        })
    }

    /// How the run ended, in the word of files.
    #[must_use]
    pub fn status(&self) -> &'static str {
        self.ended.as_ref().map_or(Self::COMPLETED, |ended| ended.reason.name())
    }

    /// What the point gives; or why nothing can be read, and when the run ended, s.
    fn try_run(
        study: &Study,
        scene: impl FnOnce() -> Result<Scene, SceneError>,
        flow: impl Fn() -> ControlFlow<()>,
    ) -> Result<Self, (EarlyEnd, Option<f64>)> {
        let scene = scene().map_err(|error| (EarlyEnd::new(MissingReason::NoStart, error), None))?;
        if !can_start(&scene) {
            return Err((EarlyEnd::new(MissingReason::NoStart, ""), None));
        }
        let most_evaluations = scene.run.most_evaluations.unwrap_or(MOST_EVALUATIONS);
        let effort = SolverOptions { most_evaluations, ..SolverOptions::from_scene(&scene) };
        let mut watch = PointObserver::from_study(study, flow);
        let span_s = [scene.start_s, scene.run.stop_s];
        let view = film_scene_with_observer(&scene, &study.camera, span_s, effort, &mut watch)
            .map_err(end_without_view)?;
        let TwinView { recording, run, stick_s } = view;
        let PointObserver { transitions: Transitions(transitions), audit, .. } = watch;
        let record = RunRecord { span_s, run, stick_s, transitions, audit };
        let instants = ReversalInstants::find_instants(&recording);
        let reader = FeatureReader::with_run(&recording, &instants, &record);
        Ok(Self {
            ended: MissingReason::from_status(run.status).map(|reason| EarlyEnd::new(reason, "")),
            stopped_at_s: Some(run.stopped_at_s),
            values: study.maps.iter().map(|map| read_value(&map.reading, &reader)).collect(),
        })
    }

    fn without_values(study: &Study, ended: EarlyEnd, stopped_at_s: Option<f64>) -> Self {
        let values = study.maps.iter().map(|_| Err(ended.reason)).collect();
        Self { ended: Some(ended), stopped_at_s, values }
    }
}

fn read_value(reading: &Reading, reader: &FeatureReader) -> Result<f64, MissingReason> {
    let found = reading.read(None, reader).map_err(|missing| missing.reason())?;
    if found.value.is_finite() { Ok(found.value) } else { Err(MissingReason::NotFinite) }
}

fn end_without_view(error: TwinViewError) -> (EarlyEnd, Option<f64>) {
    match error {
        TwinViewError::Early { status, stopped_at_s } => {
            let reason = MissingReason::from_status(status).unwrap_or(MissingReason::NoWindow);
            (EarlyEnd::new(reason, "before two frames were taken"), Some(stopped_at_s))
        }
        TwinViewError::Recording(error) => (EarlyEnd::new(MissingReason::Diverged, error), None),
    }
}

/// A scene that starts in steady slip needs such an equilibrium, which another preload or friction may not
/// have.
fn can_start(scene: &Scene) -> bool {
    let speed = scene.drive.motion_at(scene.start_s).velocity_m_per_s;
    scene.start != StartKind::SteadySlide || equilibrium::steady_slip_pose(&scene.linkage, speed).is_some()
}

/// What is noted of a run besides its traces: the transitions, and its extremes where a map needs them.
struct PointObserver<F> {
    transitions: Transitions,
    audit: Option<EnergyAudit>,
    flow: F,
}

impl<F> PointObserver<F> {
    fn from_study(study: &Study, flow: F) -> Self {
        let audited = study.maps.iter().any(|map| map.reading.needs_audit());
        Self { transitions: Transitions::default(), audit: audited.then(EnergyAudit::default), flow }
    }
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
