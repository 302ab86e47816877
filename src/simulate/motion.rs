//! The motion of a blade: samples, transitions, impacts and extremes of one run.

use crate::model::Linkage;
use crate::simulate::outputs::{EnergyAudit, Impacts, StickIntervals, Transitions, forward_to_observers};
use crate::simulate::scene::Scene;
use crate::simulate::{Impact, ModelSample, Observer, RunResult, SolutionSegment, Transition, run_scene};
use std::ops::ControlFlow;

/// Number of samples of a run: 24 per cycle of a 1 kHz oscillation in a run of 0.25 s, the duration of a
/// reversal.
pub(crate) const MOTION_SAMPLES: usize = 6000;
/// Time between fine samples, s: fifty samples per cycle of a 1 kHz oscillation.
const FINE_STEP_S: f64 = 2e-5;
/// Maximum number of fine samples of a run (14 MB); in a longer run, the time between them is longer.
const MAX_FINE_SAMPLES: usize = 100_000;

/// Fraction of the head's travel that the head must move towards an extremum and away from it for the
/// extremum to count as a turn; vibration of the drive is smaller.
const RETURN: f64 = 0.005;

/// Samples and events of a run.
#[derive(Debug, Clone)]
pub struct RunMotion {
    /// Links, springs and friction of the blade.
    pub linkage: Linkage,
    /// States at equal time steps until the end of the run.
    pub samples: Vec<ModelSample>,
    /// States at finer time steps, for figures of a part of the run.
    pub fine: Vec<ModelSample>,
    /// Every change of the mode of contact.
    pub transitions: Vec<Transition>,
    /// Start and end of each interval of stick, s.
    pub stick_s: Vec<[f64; 2]>,
    /// Every impact of the tip on the glass.
    pub impacts: Vec<Impact>,
    /// Extremes over the whole run, not only at the samples.
    pub extremes: EnergyAudit,
    /// Status and work of the run.
    pub run: RunResult,
}

impl RunMotion {
    /// Runs a scene and records its motion.
    #[must_use]
    pub fn simulate(scene: &Scene) -> Self {
        let mut recorder = MotionRecorder::new(scene);
        let run = run_scene(scene, &mut recorder);
        recorder.into_motion(scene, run)
    }

    /// The fine samples between two instants, s.
    pub(crate) fn fine_samples_between(&self, [from_s, to_s]: [f64; 2]) -> &[ModelSample] {
        let first = self.fine.partition_point(|s| s.time_s < from_s);
        let end = self.fine.partition_point(|s| s.time_s <= to_s);
        self.fine.get(first..end).unwrap_or_default()
    }

    /// Index of the sample at the first turn of the head, an extremum from which the head is farther away
    /// than [`RETURN`] times its travel both before and after.
    pub(crate) fn turn(&self) -> Option<usize> {
        let x = |at: usize| self.samples[at].head_x_m;
        let (least, most) = self
            .samples
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), s| (l.min(s.head_x_m), h.max(s.head_x_m)));
        let enough = RETURN * (most - least);
        let (mut low, mut high) = (0, 0);
        for at in 0..self.samples.len() {
            (low, high) = (if x(at) < x(low) { at } else { low }, if x(at) > x(high) { at } else { high });
            let came_back = [(high, x(high) - x(at), x(high) - x(0)), (low, x(at) - x(low), x(0) - x(low))];
            let turned = |(_, back, there): &(usize, f64, f64)| *back > enough && *there > enough;
            if let Some((turn, ..)) = came_back.into_iter().find(turned) {
                return Some(turn);
            }
        }
        None
    }

    /// Time of the first turn of the head, s; `None` without a turn.
    pub(crate) fn turn_s(&self) -> Option<f64> {
        self.samples.get(self.turn()?).map(|sample| sample.time_s)
    }

    /// The longest interval of stick, s; if several are equal, the last of them.
    pub(crate) fn longest_stick_s(&self) -> Option<[f64; 2]> {
        self.stick_s.iter().copied().max_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0])))
    }
}

/// Observer that records a [`RunMotion`].
pub(crate) struct MotionRecorder {
    states: (EvenSamples, EvenSamples),
    events: (StickIntervals, (Transitions, (Impacts, EnergyAudit))),
}

impl MotionRecorder {
    pub(crate) fn new(scene: &Scene) -> Self {
        let fine = ((scene.run.stop_s - scene.start_s) / FINE_STEP_S).ceil() as usize + 1;
        let fine = EvenSamples::new(scene, fine.clamp(2, MAX_FINE_SAMPLES));
        Self { states: (EvenSamples::new(scene, MOTION_SAMPLES), fine), events: Default::default() }
    }

    pub(crate) fn into_motion(self, scene: &Scene, run: RunResult) -> RunMotion {
        let (stick, (transitions, (impacts, extremes))) = self.events;
        RunMotion {
            linkage: scene.linkage,
            samples: self.states.0.samples,
            fine: self.states.1.samples,
            transitions: transitions.0,
            stick_s: stick.0,
            impacts: impacts.0,
            extremes,
            run,
        }
    }
}

impl Observer for MotionRecorder {
    forward_to_observers!(self: self.states, self.events);
}

/// States at equal time steps from the start of a scene to its stop.
struct EvenSamples {
    span_s: [f64; 2],
    count: usize,
    samples: Vec<ModelSample>,
}

impl EvenSamples {
    fn new(scene: &Scene, count: usize) -> Self {
        Self { span_s: [scene.start_s, scene.run.stop_s], count, samples: Vec::with_capacity(count) }
    }

    fn next_time_s(&self) -> Option<f64> {
        let ([start_s, stop_s], i) = (self.span_s, self.samples.len());
        (i < self.count).then(|| start_s + (stop_s - start_s) * i as f64 / (self.count - 1) as f64)
    }
}

impl Observer for EvenSamples {
    fn observe_segment(&mut self, piece: &SolutionSegment<'_>) {
        while let Some(t) = self.next_time_s().filter(|t| *t <= piece.end_s) {
            self.samples.push(piece.sample_at(t.max(piece.start_s)));
        }
    }
}
