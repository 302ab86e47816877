//! What an evaluation of the bundled fit takes, and the share of its features:
//! `cargo run --release --example evaluation`.

use std::hint::black_box;
use std::time::Instant;
use wiperlab::blade::parameters;
use wiperlab::fit::features::read_all;
use wiperlab::fit::job::Job;
use wiperlab::recording::Recording;
use wiperlab::recording::channel::Instants;
use wiperlab::simulate::Effort;
use wiperlab::simulate::scene::Scene;
use wiperlab::twin::{Camera, Tracking, track, view};

const JOB: &str = include_str!("../fits/actual-blade-twin/job.toml");
const SCENE: &str = include_str!("../data/scenes/actual-blade.toml");
/// The camera of the bundled recording.
const CAMERA: Camera = Camera { frame_rate_hz: 5000.0, exposure_s: 5e-5 };
/// The noise of its tracking.
const TRACKING: Tracking = Tracking { metres_per_pixel: 2e-5, noise_px: 0.1, dropout_fraction: 0.0, seed: 0 };
/// Tolerance at which a fit runs its model.
const TOLERANCE: f64 = 1e-6;
/// Repetitions; the least time of them is shown.
const REPEATED: usize = 200;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let job = Job::parse("job.toml", JOB, &parameters::names())?;
    let scene = Scene::parse("actual-blade.toml", SCENE)?;
    let look = || view(&scene, &CAMERA, scene.start_s, scene.run.stop_s, Effort::new(TOLERANCE));
    let seen: Recording = look()?.recording;
    let recordings = [track(&seen, "model", &TRACKING)?];
    let features = job.features();
    let simulated_s = least_s(|| drop(black_box(look())));
    let tracked_s = least_s(|| drop(black_box(track(&seen, "model", &TRACKING))));
    let instants_s = least_s(|| drop(black_box(Instants::find(&recordings[0]))));
    let read_s = least_s(|| drop(black_box(read_all(&features, &recordings))));
    let instants = Instants::find(&recordings[0]);
    let alone_s = least_s(|| features.iter().for_each(|feature| drop(black_box(feature.read(&recordings[0], &instants)))));
    println!("simulation, exposures included  {:8.3} ms", 1e3 * simulated_s);
    println!("noise of the tracking           {:8.3} ms", 1e3 * tracked_s);
    println!("instants                        {:8.3} ms", 1e3 * instants_s);
    println!("features, each by itself        {:8.3} ms", 1e3 * alone_s);
    println!("instants and all features       {:8.3} ms, {:.1} % of the evaluation", 1e3 * read_s, 100.0 * read_s / (read_s + simulated_s + tracked_s));
    for read in read_all(&features, &recordings) {
        println!("{:?}", read?);
    }
    Ok(())
}

fn least_s(mut work: impl FnMut()) -> f64 {
    let mut once = |_| {
        let clock = Instant::now();
        work();
        clock.elapsed().as_secs_f64()
    };
    (0..REPEATED).map(&mut once).fold(f64::INFINITY, f64::min)
}
