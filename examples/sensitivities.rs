//! What exact sensitivities cost: the time of a run with derivatives over that of the run alone.
//!
//! ```sh
//! cargo run --release --example sensitivities
//! ```
//!
//! Every ratio is the smallest of several rounds, in which the two runs take turns.

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;
use wiperlab::simulate::scene::Scene;
use wiperlab::simulate::sensitivity::{
    Channel, TangentDirection, TangentObserver, TangentRunner, TangentSeeds, TangentSegment,
};
use wiperlab::simulate::{Observer, SolutionSegment, SolverOptions, run_scene_with};

/// Half the time that a shutter is open, s.
const HALF_S: f64 = 2e-5;

/// Means over a shutter at even times, or nothing where there is no rate.
struct Camera {
    interval_s: Option<f64>,
    next_s: f64,
    row: Vec<f64>,
    sum: f64,
}

impl Camera {
    fn new(scene: &Scene, rate_hz: Option<f64>, directions: usize) -> Self {
        let interval_s = rate_hz.map(|rate| 1.0 / rate);
        Self { interval_s, next_s: scene.start_s, row: vec![0.0; directions], sum: 0.0 }
    }

    /// The times that a piece shows.
    fn times(&mut self, end_s: f64) -> Option<f64> {
        let interval = self.interval_s?;
        let time = self.next_s;
        (time <= end_s).then(|| {
            self.next_s += interval;
            time
        })
    }
}

impl Observer for Camera {
    fn observe_segment(&mut self, piece: &SolutionSegment<'_>) {
        let path = piece.path();
        while let Some(time) = self.times(piece.end_s) {
            let [from, to] = [(time - HALF_S).max(piece.start_s), (time + HALF_S).min(piece.end_s)];
            let place = path.integrate_points(from, to);
            self.sum += place.tip_x_m + place.head_drop_m;
        }
    }
}

impl TangentObserver for Camera {
    fn observe_segment(&mut self, piece: &TangentSegment<'_>) {
        while let Some(time) = self.times(piece.end_s) {
            let weights =
                piece.weights_over((time - HALF_S).max(piece.start_s), (time + HALF_S).min(piece.end_s));
            for channel in [Channel::TipX, Channel::HeadDrop] {
                self.sum += piece.channel_value(channel, &weights);
                piece.channel_derivatives(channel, &weights, &mut self.row);
                self.sum += self.row.iter().sum::<f64>();
            }
        }
    }
}

/// Seconds that something takes.
fn seconds(what: impl FnOnce() -> f64) -> f64 {
    let start = Instant::now();
    black_box(what());
    start.elapsed().as_secs_f64()
}

/// Smallest times of a run alone and of one with derivatives, s.
fn times(
    runner: &mut TangentRunner,
    scene: &Scene,
    directions: &[TangentDirection],
    rate_hz: Option<f64>,
) -> [f64; 2] {
    const ROUNDS: usize = 40;
    let seeds = TangentSeeds::new(scene, directions).expect("known directions");
    let effort = SolverOptions::from_scene(scene);
    let mut least = [f64::INFINITY; 2];
    for _ in 0..ROUNDS {
        let alone = seconds(|| {
            let mut camera = Camera::new(scene, rate_hz, 0);
            run_scene_with(scene, effort, &mut camera);
            camera.sum
        });
        let derived = seconds(|| {
            let mut camera = Camera::new(scene, rate_hz, directions.len());
            runner.run_scene(scene, effort, &seeds, &mut camera);
            camera.sum
        });
        least = [least[0].min(alone), least[1].min(derived)];
    }
    least
}

fn main() {
    let file = "data/scenes/actual-blade.toml";
    let text = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(file)).expect("a file");
    let scene = Scene::parse(file, &text).expect("a scene");
    let parameters = [
        "friction.a",
        "friction.b_s_per_m",
        "friction.c",
        "blade.neck_natural_frequency_hz",
        "shoulder.stiffness_ratio",
    ]
    .map(|name| TangentDirection::Parameter(name.to_owned()));
    let states = [
        TangentDirection::NeckAngle,
        TangentDirection::LipAngle,
        TangentDirection::NeckRate,
        TangentDirection::LipRate,
    ];
    let ten: Vec<TangentDirection> =
        parameters.iter().chain(&states).cloned().chain([TangentDirection::DriveDelay]).collect();
    println!(
        "directions                                   samples  derivatives    alone     with them  ratio"
    );
    for (name, directions) in [
        ("none", &[][..]),
        ("four states", &states[..]),
        ("five parameters", &parameters[..]),
        ("five parameters, four states and the delay", &ten[..]),
    ] {
        for (samples, rate_hz) in [("none", None), ("4 kHz", Some(4e3))] {
            // as good as the run itself, and as a fit to traces takes them
            let runners =
                [("to 1e-8", TangentRunner::default()), ("to 1e-5", TangentRunner::with_accuracy(1e-5))];
            for (accuracy, mut runner) in runners {
                let [alone, derived] = times(&mut runner, &scene, directions, rate_hz);
                let ratio = derived / alone;
                let [alone, derived] = [alone, derived].map(|seconds| 1e3 * seconds);
                println!("{name:44} {samples:8} {accuracy:11} {alone:6.2} ms {derived:8.2} ms {ratio:6.2}");
            }
        }
    }
}
