//! One point of a study: its run, as far as it went, and what every map reads from it.

use super::study::Study;
use crate::feature::{Reader, Reading, Reason, RunRecord};
use crate::recording::channel::Instants;
use crate::simulate::outputs::{Audit, Transitions};
use crate::simulate::scene::{Scene, SceneError, StartKind};
use crate::simulate::{Effort, Impact, Observer, Piece, Transition, equilibrium};
use crate::text::panic_message;
use crate::twin::{View, ViewError, observed_view};
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Right-hand sides after which a run is given up: some hundred times what a reversal costs, a
/// few seconds.
const MOST_EVALUATIONS: u64 = 20_000_000;

/// What a point gave.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Why the run ended before its stop time, if it did.
    pub ended: Option<Ended>,
    /// When it ended, s; `None` where it never ran.
    pub stopped_at_s: Option<f64>,
    /// One value a map, in its unit, or why there is none.
    pub values: Vec<Result<f64, Reason>>,
}

/// Why a run ended before its stop time.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ended {
    /// In one word.
    pub reason: Reason,
    /// What happened, where the reason does not say all.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub why: String,
}

impl Ended {
    fn new(reason: Reason, why: impl ToString) -> Self {
        Self { reason, why: why.to_string() }
    }
}

impl Outcome {
    /// The name of a run that reached its stop time.
    pub(crate) const COMPLETED: &'static str = "completed";

    /// Runs point `index` of a checked study; a panic is a reason like any other.
    #[must_use]
    pub fn of(study: &Study, scene: &Scene, index: usize) -> Self {
        Self::of_scene(study, || study.scene_at(scene, index), || ControlFlow::Continue(()))
    }

    /// Runs a scene that a study did not choose; `flow` is asked during the run and may end it.
    #[must_use]
    pub fn of_scene(
        study: &Study,
        scene: impl FnOnce() -> Result<Scene, SceneError>,
        flow: impl Fn() -> ControlFlow<()>,
    ) -> Self {
        let attempt = || {
            Self::attempt(study, scene, flow)
                .unwrap_or_else(|(ended, stopped_at_s)| Self::without_values(study, ended, stopped_at_s))
        };
        catch_unwind(AssertUnwindSafe(attempt)).unwrap_or_else(|payload| {
            Self::without_values(
                study,
                Ended::new(Reason::Panicked, panic_message(payload.as_ref()).unwrap_or_default()),
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
    fn attempt(
        study: &Study,
        scene: impl FnOnce() -> Result<Scene, SceneError>,
        flow: impl Fn() -> ControlFlow<()>,
    ) -> Result<Self, (Ended, Option<f64>)> {
        let scene = scene().map_err(|error| (Ended::new(Reason::NoStart, error), None))?;
        if !starts(&scene) {
            return Err((Ended::new(Reason::NoStart, ""), None));
        }
        let most_evaluations = scene.run.most_evaluations.unwrap_or(MOST_EVALUATIONS);
        let effort = Effort { most_evaluations, ..Effort::of(&scene) };
        let mut watch = Watch::of(study, flow);
        let span_s = [scene.start_s, scene.run.stop_s];
        let view = observed_view(&scene, &study.camera, span_s, effort, &mut watch).map_err(unseen)?;
        let View { recording, run, stick_s } = view;
        let Watch { transitions: Transitions(transitions), audit, .. } = watch;
        let record = RunRecord { span_s, run, stick_s, transitions, audit };
        let instants = Instants::find(&recording);
        let reader = Reader::of_run(&recording, &instants, &record);
        Ok(Self {
            ended: Reason::of(run.status).map(|reason| Ended::new(reason, "")),
            stopped_at_s: Some(run.stopped_at_s),
            values: study.maps.iter().map(|map| value(&map.reading, &reader)).collect(),
        })
    }

    fn without_values(study: &Study, ended: Ended, stopped_at_s: Option<f64>) -> Self {
        let values = study.maps.iter().map(|_| Err(ended.reason)).collect();
        Self { ended: Some(ended), stopped_at_s, values }
    }
}

fn value(reading: &Reading, reader: &Reader) -> Result<f64, Reason> {
    let found = reading.read(None, reader).map_err(|missing| missing.reason())?;
    if found.value.is_finite() { Ok(found.value) } else { Err(Reason::NotFinite) }
}

fn unseen(error: ViewError) -> (Ended, Option<f64>) {
    match error {
        ViewError::Early { status, stopped_at_s } => {
            let reason = Reason::of(status).unwrap_or(Reason::NoWindow);
            (Ended::new(reason, "before two frames were taken"), Some(stopped_at_s))
        }
        ViewError::Recording(error) => (Ended::new(Reason::Diverged, error), None),
    }
}

/// A scene that starts in steady slip needs such an equilibrium, which another preload or friction may not
/// have.
fn starts(scene: &Scene) -> bool {
    let speed = scene.drive.at(scene.start_s).velocity_m_per_s;
    scene.start != StartKind::SteadySlide || equilibrium::steady_slide(&scene.linkage, speed).is_some()
}

/// What is noted of a run besides its traces: the transitions, and its extremes where a map needs them.
struct Watch<F> {
    transitions: Transitions,
    audit: Option<Audit>,
    flow: F,
}

impl<F> Watch<F> {
    fn of(study: &Study, flow: F) -> Self {
        let audited = study.maps.iter().any(|map| map.reading.needs_audit());
        Self { transitions: Transitions::default(), audit: audited.then(Audit::default), flow }
    }
}

impl<F: Fn() -> ControlFlow<()>> Observer for Watch<F> {
    fn flow(&self) -> ControlFlow<()> {
        (self.flow)()
    }
    fn piece(&mut self, piece: &Piece<'_>) {
        self.audit.iter_mut().for_each(|audit| audit.piece(piece));
    }
    fn transition(&mut self, transition: &Transition) {
        self.transitions.transition(transition);
    }
    fn impact(&mut self, impact: &Impact) {
        self.audit.iter_mut().for_each(|audit| audit.impact(impact));
    }
}
