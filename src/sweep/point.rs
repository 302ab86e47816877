//! One point of a study: its run, as far as it went, and what every map reads from it.

use super::reading::{Seen, read};
use super::{Quantity, Reason, Study, grid};
use crate::simulate::outputs::{Audit, Transitions};
use crate::simulate::scene::{Scene, StartKind};
use crate::simulate::{Effort, Impact, Observer, Piece, Transition, equilibrium};
use crate::twin::{View, ViewError, observed_view};
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Right-hand sides after which a run is given up as diverged: some hundred times what a reversal costs, a
/// few seconds.
const MOST_EVALUATIONS: u64 = 20_000_000;

/// What a point of the grid gave.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Why the run ended before its stop time, if it did.
    pub ended: Option<Missing>,
    /// When it ended, s; `None` where it never ran.
    pub stopped_at_s: Option<f64>,
    /// One value a map, in its unit.
    pub values: Vec<Result<f64, Missing>>,
}

impl Outcome {
    /// The name of a run that reached its stop time.
    pub const COMPLETED: &'static str = "completed";

    /// Runs point `index` of a checked study; a panic is a reason like any other.
    #[must_use]
    pub fn of(study: &Study, scene: &Scene, index: usize) -> Self {
        let outcome = catch_unwind(AssertUnwindSafe(|| Self::attempt(study, scene, index)));
        outcome.unwrap_or_else(|payload| {
            Self::without_values(study, Missing::because(Reason::Panicked, words_of(payload.as_ref())), None)
        })
    }

    /// How the run ended, in the word of files.
    #[must_use]
    pub fn status(&self) -> &'static str {
        self.ended.as_ref().map_or(Self::COMPLETED, |ended| ended.reason.name())
    }

    fn attempt(study: &Study, scene: &Scene, index: usize) -> Self {
        let scene = match grid::scene_at(&study.axes, scene, index) {
            Ok(scene) => scene,
            Err(error) => return Self::without_values(study, Missing::because(Reason::NoStart, error), None), // (a checked study has none)
        };
        if let Some(missing) = no_start(&scene) {
            return Self::without_values(study, missing, None);
        }
        let effort =
            Effort { most_evaluations: MOST_EVALUATIONS, ..Effort::new(scene.run.relative_tolerance) };
        let mut watch = Watch::of(study);
        match observed_view(&scene, &study.camera, [scene.start_s, scene.run.stop_s], effort, &mut watch) {
            Ok(view) => Self::seen(study, &scene, view, watch),
            Err(ViewError::Early { status, stopped_at_s }) => {
                let reason = Reason::of(status).unwrap_or(Reason::NoWindow);
                Self::without_values(
                    study,
                    Missing::because(reason, "before two frames were taken"),
                    Some(stopped_at_s),
                )
            }
            Err(error @ ViewError::Recording(_)) => {
                Self::without_values(study, Missing::because(Reason::Diverged, error), None)
            }
        }
    }

    fn seen(study: &Study, scene: &Scene, view: View, watch: Watch) -> Self {
        let (run, ended) = (view.run, Reason::of(view.run.status));
        let seen = Seen::new(scene, view, watch.transitions.0, watch.audit);
        let value = |quantity: &Quantity| match ended.filter(|reason| !survives(quantity, *reason)) {
            Some(reason) => Err(Missing::plain(reason)),
            None => read(quantity, &seen).and_then(|value| {
                if value.is_finite() { Ok(value) } else { Err(Missing::plain(Reason::NotFinite)) }
            }),
        };
        let values = study.maps.iter().map(|map| value(&map.quantity)).collect();
        Self { ended: ended.map(Missing::plain), stopped_at_s: Some(run.stopped_at_s), values }
    }

    fn without_values(study: &Study, missing: Missing, stopped_at_s: Option<f64>) -> Self {
        let values = study.maps.iter().map(|_| Err(Missing::plain(missing.reason))).collect();
        Self { ended: Some(missing), stopped_at_s, values }
    }
}

/// Whether a quantity is known from a run that ended for this reason; what lies after the end is not, so a
/// count or a share is none.
fn survives(quantity: &Quantity, ended: Reason) -> bool {
    match quantity {
        Quantity::ContactLoss | Quantity::LeastNormalForce => ended == Reason::ContactLost,
        Quantity::Jam | Quantity::LeastPainleveIndicator => ended == Reason::Jammed,
        _ => false,
    }
}

/// A scene that starts in steady slip needs such an equilibrium, which another preload or friction may not
/// have.
fn no_start(scene: &Scene) -> Option<Missing> {
    let speed = scene.drive.at(scene.start_s).velocity_m_per_s;
    let starts =
        scene.start != StartKind::SteadySlide || equilibrium::steady_slide(&scene.linkage, speed).is_some();
    (!starts).then(|| Missing::plain(Reason::NoStart))
}

/// What is noted of a run beside its traces: the transitions, and its extremes where a map asks for them.
struct Watch {
    transitions: Transitions,
    audit: Option<Audit>,
}

impl Watch {
    fn of(study: &Study) -> Self {
        let extreme = |quantity: &Quantity| {
            matches!(quantity, Quantity::LeastNormalForce | Quantity::LeastPainleveIndicator)
        };
        let audited = study.maps.iter().any(|map| extreme(&map.quantity));
        Self { transitions: Transitions::default(), audit: audited.then(Audit::default) }
    }
}

impl Observer for Watch {
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

fn words_of(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| payload.downcast_ref::<String>().cloned()).unwrap_or_default()
}

/// A value that is not there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Missing {
    /// Why, in a word.
    pub reason: Reason,
    /// The same with what was found; empty where the reason says all.
    pub why: String,
}

impl Missing {
    /// A reason that says all.
    #[must_use]
    pub fn plain(reason: Reason) -> Self {
        Self { reason, why: String::new() }
    }

    /// A reason with what was found.
    #[must_use]
    pub fn because(reason: Reason, why: impl ToString) -> Self {
        Self { reason, why: why.to_string() }
    }
}
