//! States of the fitted model, closer together than the frames of a recording.

use super::model_run::ModelRun;
use crate::fit::result::FittedSegment;
use crate::fit::trace::FittedTraces;
use crate::simulate::outputs::{SampleObserver, StickIntervals};
use crate::simulate::scene::{Scene, StartKind};
use crate::simulate::{ModelSample, run_scene};
use std::borrow::Cow;

/// Time between states of a restarted model, s: fifty states per cycle of a 1 kHz oscillation.
const STEP_S: f64 = 2e-5;
/// Maximum number of states of all segments together (14 MB); in a longer recording, the time between states
/// is longer.
const MAX_STATES: f64 = 1e5;
/// Two sticks are joined if the gap between them, s, is below this value, because a restart divides a stick
/// that goes on in the next segment.
const SAME_STICK_S: f64 = 1e-9;

/// States of the fitted model on the clock of the model. After a fit to traces the model restarts at every
/// segment of the fit; otherwise it runs once.
#[derive(Debug, Clone, Default)]
pub(crate) struct ModelStates<'a> {
    /// The states of each run at equal time steps.
    runs: Vec<Cow<'a, [ModelSample]>>,
    /// Start and end of each interval of stick, s.
    pub stick_s: Vec<[f64; 2]>,
}

impl<'a> ModelStates<'a> {
    /// The states in one condition. `segments` are the fitted segments of all recordings, of which those of
    /// the recording `name` are simulated.
    pub(super) fn simulate(model: &'a ModelRun, segments: &[FittedSegment], name: &str) -> Self {
        let own = segments.iter().filter(|segment| segment.recording == name);
        let scenes: Vec<Scene> =
            model.traces.iter().flat_map(|t| own.clone().map(|s| segment_scene(t, s))).collect();
        if scenes.is_empty() {
            let stick_s = model.view.stick_s.clone();
            return Self { runs: vec![Cow::Borrowed(&model.motion.fine)], stick_s };
        }
        let whole_s: f64 = scenes.iter().map(|scene| scene.run.stop_s - scene.start_s).sum();
        let step_s = STEP_S.max(whole_s / MAX_STATES);
        let mut found = Self::default();
        for scene in &scenes {
            let (states, stick_s) = simulate_states(scene, step_s);
            found.runs.push(Cow::Owned(states));
            for [from, to] in stick_s {
                match found.stick_s.last_mut().filter(|last| (from - last[1]).abs() < SAME_STICK_S) {
                    Some(last) => last[1] = to,
                    None => found.stick_s.push([from, to]),
                }
            }
        }
        found
    }

    /// The states between two instants, s, one slice for each run.
    pub(crate) fn states_between(&self, [from_s, to_s]: [f64; 2]) -> impl Iterator<Item = &[ModelSample]> {
        let part = move |run: &'_ Cow<'a, [ModelSample]>| {
            let first = run.partition_point(|s| s.time_s < from_s);
            first..run.partition_point(|s| s.time_s <= to_s)
        };
        self.runs.iter().filter_map(move |run| run.get(part(run))).filter(|states| !states.is_empty())
    }
}

/// The scene of a segment: it starts in the fitted state of the segment and stops at its end.
fn segment_scene(traces: &FittedTraces, segment: &FittedSegment) -> Scene {
    let frames = (segment.end_frame - segment.first_frame) as f64;
    let mut scene = traces.scene.clone();
    scene.start_s = segment.time_s;
    scene.run.stop_s = segment.time_s + frames / traces.grid.frame_rate_hz;
    scene.start = StartKind::State(segment.pose());
    scene
}

/// States of a run at equal time steps, and its intervals of stick, s.
fn simulate_states(scene: &Scene, step_s: f64) -> (Vec<ModelSample>, Vec<[f64; 2]>) {
    let (start_s, stop_s) = (scene.start_s, scene.run.stop_s);
    let count = ((stop_s - start_s) / step_s).ceil().max(1.0) as usize;
    let time_s = |i: usize| start_s + (stop_s - start_s) * i as f64 / count as f64;
    let mut states = Vec::with_capacity(count + 1);
    let samples = SampleObserver::new((0..=count).map(time_s), |state| states.push(*state));
    let mut sticks = StickIntervals::default();
    run_scene(scene, &mut (samples, &mut sticks));
    (states, sticks.0)
}
