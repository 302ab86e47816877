//! A run allocates nothing: not in its loop, and not for the outputs that are sampled from it, however long
//! it lasts.

use crate::scenes::upright_light_blade;
use allocation_counter::{AllocationInfo, measure};
use wiperlab::recording::files::push_trace_row;
use wiperlab::recording::{FrameGrid, Recording, Traces};
use wiperlab::simulate::drive::smooth_head_motion;
use wiperlab::simulate::outputs::{
    EnergyAudit, SampleObserver, push_event_row, push_state_row, recorded_points_m,
};
use wiperlab::simulate::scene::{Drive, Scene};
use wiperlab::simulate::{
    IntegrationMethod, Observer, RunStatus, SolutionSegment, SolverOptions, Transition, run_scene_with,
};

const METHODS: [IntegrationMethod; 2] = [IntegrationMethod::Taylor, IntegrationMethod::RungeKutta];

fn lasting(stop_s: f64) -> Scene {
    let mut scene = upright_light_blade();
    scene.run.stop_s = stop_s;
    scene
}

fn effort(method: IntegrationMethod) -> SolverOptions {
    SolverOptions { method, ..SolverOptions::new(1e-8) }
}

/// The same scene, its head as a camera of 1000 frames/s would have seen it.
pub fn recorded(mut scene: Scene) -> Scene {
    let grid = FrameGrid { start_s: scene.start_s, frame_rate_hz: 1000.0, frames: 1001 };
    let head_x_m = (0..grid.frames).map(|i| Some(scene.drive.motion_at(grid.time_s(i)).position_m)).collect();
    let nothing = vec![None; grid.frames];
    let traces = Traces {
        tip_x_m: nothing.clone(),
        tip_y_m: nothing.clone(),
        head_x_m,
        head_y_m: nothing,
        ..Traces::default()
    };
    let recording = Recording::new("head", grid, traces, true).unwrap();
    scene.drive = Drive::Recorded(smooth_head_motion(&recording).unwrap().into());
    scene
}

#[test]
fn the_loop_of_a_run_allocates_nothing() {
    for method in METHODS {
        for scene in [lasting(0.75), recorded(lasting(0.75))] {
            let mut transitions = 0;
            let made = measure(|| transitions = run_scene_with(&scene, effort(method), &mut ()).transitions);
            assert!(transitions > 100, "{method:?}: {transitions} transitions");
            assert_eq!(made.count_total, 0, "{method:?}: {made:?}");
        }
    }
}

/// Rows that are written and forgotten, as the program does.
#[derive(Default)]
struct Rows {
    text: String,
    count: u64,
}

impl Rows {
    fn add(&mut self, push: impl FnOnce(&mut String)) {
        self.text.clear();
        push(&mut self.text);
        self.count += 1;
    }
}

struct Events<'a>(&'a mut Rows);

impl Observer for Events<'_> {
    fn observe_segment(&mut self, _: &SolutionSegment<'_>) {}
    fn observe_transition(&mut self, transition: &Transition) {
        self.0.add(|text| push_event_row(text, transition));
    }
}

/// Rows of samples and transitions, and the memory that it took to make them.
fn streamed(scene: &Scene, method: IntegrationMethod) -> (u64, u64, AllocationInfo) {
    let (mut samples, mut events) = (Rows::default(), Rows::default());
    let made = measure(|| {
        let times = (0_u32..).map(|i| f64::from(i) * 1e-4);
        let sampler = SampleObserver::new(times, |sample| {
            samples.add(|text| {
                push_trace_row(text, sample.time_s, recorded_points_m(&scene.linkage, sample).map(Some));
                push_state_row(text, &scene.linkage, sample);
            });
        });
        let run = run_scene_with(
            scene,
            effort(method),
            &mut ((sampler, Events(&mut events)), EnergyAudit::default()),
        );
        assert_eq!(run.status, RunStatus::Completed);
    });
    (samples.count, events.count, made)
}

#[test]
fn what_is_sampled_from_a_run_is_not_stored() {
    for method in METHODS {
        let (samples, events, short) = streamed(&lasting(0.3), method);
        let (more_samples, more_events, long) = streamed(&lasting(3.0), method);
        assert_eq!((samples, more_samples), (3001, 30_001));
        assert!(more_events > 4 * events, "{method:?}: {events} and {more_events} transitions");
        // (a row buffer that grows once more for a longer number may take another step)
        assert!(
            long.count_total <= short.count_total + 2,
            "{method:?}: {short:?} for 0.3 s, {long:?} for 3 s"
        );
        assert!(long.bytes_max <= 4096, "{method:?}: {long:?}");
    }
}
