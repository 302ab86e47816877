//! Predicted errors of the transition times of a run.
//!
//! The error of each step (the terms of the Taylor series that it leaves out, and rounding) is carried
//! through the run like a derivative of the initial state, also through transitions
//! ([`sensitivity`](super::sensitivity)). So the prediction knows how the motion amplifies or forgets errors.
//! It is linear in the errors: it holds while they are small compared with the time between transitions.

use super::event_loop::{EventLoop, ObserverWatcher, RunWatcher, TipStrike};
use super::phases::TaylorMotion;
use super::scene::Scene;
use super::sensitivity::{TangentObserver, TangentSegment, run_with_step_errors};
use super::solution_segment::SolutionSegment;
use super::{Impact, Observer, RunResult, SolverOptions, Transition, build_system};
use std::ops::ControlFlow;

/// A run with the errors that are predicted for it.
#[derive(Debug, Clone)]
pub struct PredictedRun {
    /// The run.
    pub run: RunResult,
    /// Time, s, after which the order of the transitions is not determined at the tolerance of the run;
    /// `None` if it is determined to the end.
    pub undetermined_after_s: Option<f64>,
    /// Largest predicted error of a transition time until then, s; `None` without a transition.
    pub largest_error_s: Option<f64>,
}

/// Runs a scene like [`run_scene_with`](super::run_scene_with), and predicts the error of every transition
/// time. `receive` is called with each transition and its predicted error, s, after the observer has received
/// the transition. The error is `None` from a transition on whose time has no derivative, and for methods
/// without Taylor series, whose runs count as undetermined.
pub fn run_with_predicted_errors(
    scene: &Scene,
    effort: SolverOptions,
    observer: &mut impl Observer,
    receive: impl FnMut(&Transition, Option<f64>),
) -> PredictedRun {
    let system = build_system(scene);
    let mut times = TimeErrors {
        receive,
        recent_s: [0.0; REMEMBERED],
        count: 0,
        last: (scene.start_s, 0.0),
        undetermined_after_s: None,
        largest_error_s: None,
    };
    let run = run_with_step_errors(scene, &system, effort.relative_tolerance, &mut times, |errors| {
        let mut watch = WatcherPair { observer: ObserverWatcher(observer), errors };
        EventLoop::new(&system, scene, effort, &mut watch).run()
    });
    let TimeErrors { undetermined_after_s, largest_error_s, .. } = times;
    PredictedRun { run, undetermined_after_s, largest_error_s }
}

/// Safety factors on the errors by truncation and by rounding, so that the prediction normally exceeds the
/// error.
const FACTORS: [f64; 2] = [8.0, 40.0];

/// The error that is predicted from the errors by truncation and by rounding.
fn predict_error(d: &[f64]) -> f64 {
    FACTORS.iter().zip(d).map(|(factor, error)| factor * error.abs()).sum()
}

/// Number of recent transitions over which the largest error is taken: that of a single one may be small by
/// chance.
const REMEMBERED: usize = 4;

/// Errors of the transition times.
struct TimeErrors<F> {
    receive: F,
    /// Errors of the last transitions, s.
    recent_s: [f64; REMEMBERED],
    count: usize,
    /// Time and predicted error of the last transition, s; before the first one, the start of the run.
    last: (f64, f64),
    undetermined_after_s: Option<f64>,
    largest_error_s: Option<f64>,
}

impl<F: FnMut(&Transition, Option<f64>)> TangentObserver for TimeErrors<F> {
    fn observe_segment(&mut self, _: &TangentSegment<'_>) {}

    fn observe_minimum(&mut self, time_s: f64, [before, value]: [f64; 2], d_value: &[f64]) {
        // below this minimum, the guard of the exact solution may cross zero; a guard that starts at zero, as
        // at a release, is left out
        let error = predict_error(d_value);
        if value < error && before > error {
            self.undetermined_after_s.get_or_insert(self.last.0.min(time_s));
        }
    }

    fn observe_transition(&mut self, transition: &Transition, d_time_s: Option<&[f64]>) {
        /// Rounding errors of a time, in units of its last place.
        const CLOCK_ERRORS: f64 = 4.0;
        /// Largest predicted error as a fraction of the time since the last transition.
        const MOST_SHARE: f64 = 2.0;
        let time_s = transition.time_s;
        let predicted_s = d_time_s.map(|d| {
            let clock_s = CLOCK_ERRORS * f64::EPSILON * time_s.abs();
            self.recent_s[self.count % REMEMBERED] = predict_error(d) + clock_s;
            self.count += 1;
            self.recent_s.iter().fold(0.0, |most: f64, error| most.max(*error))
        });
        let ((before_s, error_before_s), is_first) = (self.last, self.count <= 1);
        let gap_s = time_s - before_s;
        // transitions at one instant follow from each other
        let is_close =
            |error: f64| !is_first && gap_s > 0.0 && error.max(error_before_s) > MOST_SHARE * gap_s;
        if predicted_s.is_none_or(is_close) {
            self.undetermined_after_s.get_or_insert(before_s);
        }
        if let (None, Some(error)) = (self.undetermined_after_s, predicted_s) {
            self.largest_error_s = Some(self.largest_error_s.map_or(error, |most| most.max(error)));
        }
        self.last = (time_s, predicted_s.unwrap_or(f64::INFINITY));
        (self.receive)(transition, predicted_s);
    }
}

/// An observer and the errors of a run, which watch it together.
struct WatcherPair<'a, O> {
    observer: ObserverWatcher<'a, O>,
    errors: &'a mut dyn RunWatcher,
}

impl<O: Observer> RunWatcher for WatcherPair<'_, O> {
    fn watch_segment(&mut self, piece: &SolutionSegment<'_>) {
        self.observer.watch_segment(piece);
        self.errors.watch_segment(piece);
    }

    fn watch_guard(&mut self, guard: usize, motion: &TaylorMotion) {
        self.errors.watch_guard(guard, motion);
    }

    fn watch_strike(&mut self, strike: &TipStrike) {
        self.errors.watch_strike(strike);
    }

    fn watch_transition(&mut self, transition: &Transition) {
        self.observer.watch_transition(transition);
        self.errors.watch_transition(transition);
    }

    fn watch_impact(&mut self, impact: &Impact) {
        self.observer.watch_impact(impact);
    }

    fn control_flow(&self) -> ControlFlow<()> {
        self.observer.control_flow()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::run_scene_with;

    /// Transitions with their predicted errors, s.
    fn predict(scene: &Scene, tolerance: f64) -> (Vec<(Transition, Option<f64>)>, Option<f64>) {
        let mut found = Vec::new();
        let receive = |transition: &Transition, error| found.push((*transition, error));
        let run = run_with_predicted_errors(scene, SolverOptions::new(tolerance), &mut (), receive);
        (found, run.undetermined_after_s)
    }

    #[test]
    fn nearly_all_errors_lie_below_the_predicted_ones_at_every_tolerance() {
        const FAR: f64 = 30.0;
        for (name, text) in [
            ("actual-blade", include_str!("../../data/scenes/actual-blade.toml")),
            ("light-blade", include_str!("../../data/scenes/light-blade.toml")),
        ] {
            let scene = Scene::parse(name, text).unwrap();
            let (truth, _) = predict(&scene, 1e-13);
            for exponent in 6..=10 {
                let tolerance = 10f64.powi(-exponent);
                let (found, undetermined_after_s) = predict(&scene, tolerance);
                assert_eq!((found.len(), undetermined_after_s), (truth.len(), None), "{name} {tolerance:e}");
                let pairs = truth.iter().zip(&found);
                let mut ratios: Vec<f64> = pairs
                    .map(|((exact, _), (transition, predicted))| {
                        assert_eq!((exact.from, exact.to), (transition.from, transition.to));
                        predicted.unwrap() / (transition.time_s - exact.time_s).abs()
                    })
                    .collect();
                ratios.sort_by(f64::total_cmp);
                let at = |share: f64| ratios[(share * ratios.len() as f64) as usize];
                assert!(at(0.01) > 1.0 && at(0.5) < FAR, "{name} {tolerance:e}: {} {}", at(0.01), at(0.5));
            }
        }
    }

    #[test]
    fn the_run_and_what_its_observer_receives_are_those_without_a_prediction() {
        #[derive(Default)]
        struct Bits(Vec<u64>);
        impl Observer for Bits {
            fn observe_segment(&mut self, piece: &SolutionSegment<'_>) {
                self.0.extend([piece.start_s, piece.end_s, piece.pose_at(piece.end_s).phi].map(f64::to_bits));
            }
            fn observe_transition(&mut self, transition: &Transition) {
                self.0.push(transition.time_s.to_bits());
            }
        }
        let scene = Scene::parse("s", include_str!("../../data/scenes/actual-blade.toml")).unwrap();
        let (mut plain, mut predicted) = (Bits::default(), Bits::default());
        let effort = SolverOptions::new(1e-8);
        let run = run_scene_with(&scene, effort, &mut plain);
        assert_eq!(run, run_with_predicted_errors(&scene, effort, &mut predicted, |_, _| ()).run);
        assert!(plain.0.len() > 1000 && plain.0 == predicted.0);
    }

    /// A head of a million lip masses makes the motion so sensitive that these tolerances do not determine
    /// its transitions.
    #[test]
    fn the_order_of_a_sensitive_motion_is_undetermined_before_it_is_wrong() {
        let text = include_str!("../../data/scenes/light-blade-from-rest.toml");
        let scene = Scene::parse("s", &text.replace("stop_s = 1.09", "stop_s = 0.6")).unwrap();
        let [lip_kg, stiffness] =
            ["blade.lip_mass_kg", "blade.head_stiffness_n_per_m"].map(|name| scene.value(name).unwrap());
        let scene = scene.with_parameter("blade.head_mass_kg", 1e6 * lip_kg).unwrap();
        let scene = scene.with_parameter("blade.head_stiffness_n_per_m", stiffness).unwrap();
        let (truth, _) = predict(&scene, 1e-13);
        for tolerance in [1e-6, 1e-9] {
            let (found, undetermined_after_s) = predict(&scene, tolerance);
            let after_s = undetermined_after_s.unwrap();
            let count = found.iter().take_while(|(transition, _)| transition.time_s < after_s).count();
            let kinds = |list: &[(Transition, Option<f64>)]| -> Vec<_> {
                list[..count].iter().map(|(transition, _)| (transition.from, transition.to)).collect()
            };
            assert_eq!(kinds(&truth), kinds(&found), "{tolerance:e}");
            assert_ne!(truth.len(), found.len(), "{tolerance:e}: the lists differ");
        }
    }
}
