//! The motion of the fitted blade, state by state: what poses, phase portraits and an animation are drawn
//! from.

use crate::blade::Linkage;
use crate::simulate::outputs::{Audit, Impacts, Sampler, StickIntervals, Transitions};
use crate::simulate::scene::Scene;
use crate::simulate::{Impact, Run, Sample, Transition, run};

/// Samples of a run: enough for twenty points in a cycle of 1 kHz over the quarter of a second that a
/// reversal takes.
pub const SAMPLES: usize = 6000;

/// A run of a scene.
#[derive(Debug, Clone)]
pub struct Motion {
    /// Links and springs.
    pub linkage: Linkage,
    /// States at equal steps of time, until the run ended.
    pub samples: Vec<Sample>,
    /// Every change of mode.
    pub transitions: Vec<Transition>,
    /// When the tip stuck, s.
    pub stick_s: Vec<[f64; 2]>,
    /// Every impact of the tip on the glass.
    pub impacts: Vec<Impact>,
    /// Least normal force and Painlevé indicator over the whole run, not over the samples alone.
    pub extremes: Audit,
    /// How it ended.
    pub run: Run,
}

impl Motion {
    /// The scene, run from its start to its stop.
    #[must_use]
    pub fn of(scene: &Scene) -> Self {
        let (start_s, stop_s) = (scene.start_s, scene.run.stop_s);
        let times = (0..SAMPLES).map(|i| start_s + (stop_s - start_s) * i as f64 / (SAMPLES - 1) as f64);
        let mut samples = Vec::with_capacity(SAMPLES);
        let (mut impacts, mut extremes) = (Impacts::default(), Audit::default());
        let mut observer = (
            (Sampler::new(times, |sample: &Sample| samples.push(*sample)), StickIntervals::default()),
            Transitions::default(),
        );
        let run = run(scene, &mut (&mut observer, (&mut impacts, &mut extremes)));
        let ((_, stick), transitions) = observer;
        Self {
            linkage: scene.linkage,
            transitions: transitions.0,
            stick_s: stick.0,
            impacts: impacts.0,
            extremes,
            samples,
            run,
        }
    }
}
