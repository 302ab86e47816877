//! A run allocates nothing: not in its loop, and not for the outputs that are sampled from it, however long
//! it lasts.

use crate::scenes::upright_light_blade;
use allocation_counter::{AllocationInfo, measure};
use wiperlab::recording::files::push_trace_row;
use wiperlab::recording::{FrameGrid, Recording, Traces};
use wiperlab::simulate::drive::head_motion;
use wiperlab::simulate::outputs::{Audit, Sampler, points_m, push_event, push_state};
use wiperlab::simulate::scene::{Drive, Scene};
use wiperlab::simulate::{Effort, Method, Observer, Piece, Status, Transition, run_with};

const METHODS: [Method; 2] = [Method::Taylor, Method::RungeKutta];

fn lasting(stop_s: f64) -> Scene {
    let mut scene = upright_light_blade();
    scene.run.stop_s = stop_s;
    scene
}

fn effort(method: Method) -> Effort {
    Effort { method, ..Effort::new(1e-8) }
}

/// The same scene, its head as a camera of 1000 frames/s would have seen it.
pub fn recorded(mut scene: Scene) -> Scene {
    let grid = FrameGrid { start_s: scene.start_s, frame_rate_hz: 1000.0, frames: 1001 };
    let head_x_m = (0..grid.frames).map(|i| Some(scene.drive.at(grid.time_s(i)).position_m)).collect();
    let nothing = vec![None; grid.frames];
    let traces = Traces {
        tip_x_m: nothing.clone(),
        tip_y_m: nothing.clone(),
        head_x_m,
        head_y_m: nothing,
        ..Traces::default()
    };
    let recording = Recording::new("head", grid, traces, true).unwrap();
    scene.drive = Drive::Recorded(head_motion(&recording).unwrap().into());
    scene
}

#[test]
fn the_loop_of_a_run_allocates_nothing() {
    for method in METHODS {
        for scene in [lasting(0.75), recorded(lasting(0.75))] {
            let mut transitions = 0;
            let made = measure(|| transitions = run_with(&scene, effort(method), &mut ()).transitions);
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
    fn piece(&mut self, _: &Piece<'_>) {}
    fn transition(&mut self, transition: &Transition) {
        self.0.add(|text| push_event(text, transition));
    }
}

/// Rows of samples and transitions, and the memory that it took to make them.
fn streamed(scene: &Scene, method: Method) -> (u64, u64, AllocationInfo) {
    let (mut samples, mut events) = (Rows::default(), Rows::default());
    let made = measure(|| {
        let times = (0_u32..).map(|i| f64::from(i) * 1e-4);
        let sampler = Sampler::new(times, |sample| {
            samples.add(|text| {
                push_trace_row(text, sample.time_s, points_m(&scene.linkage, sample).map(Some));
                push_state(text, sample);
            });
        });
        let run = run_with(scene, effort(method), &mut ((sampler, Events(&mut events)), Audit::default()));
        assert_eq!(run.status, Status::Completed);
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
