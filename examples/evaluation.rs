//! What an evaluation of the bundled fit takes, and the share of its features:
//! `cargo run --release --example evaluation`.

use std::hint::black_box;
use std::time::Instant;
use wiperlab::feature::read_features;
use wiperlab::fit::job::Job;
use wiperlab::fit::model::{Draw, Model};
use wiperlab::fit::scene_model::{Instrument, ModelCondition, PlausibilityLimits, SceneModel};
use wiperlab::recording::channel::ReversalInstants;
use wiperlab::simulate::SolverOptions;
use wiperlab::simulate::scene::Scene;
use wiperlab::simulate::twin::{Camera, film_scene};

const JOB: &str = include_str!("../fits/actual-blade-twin/job.toml");
const SCENE: &str = include_str!("../data/scenes/actual-blade.toml");
/// The camera of the bundled recording and the noise of its tracking.
const INSTRUMENT: Instrument = Instrument {
    camera: Camera { frame_rate_hz: 5000.0, exposure_s: 5e-5 },
    noise_m: 2e-6,
    dropout_fraction: 0.0,
};
/// Repetitions; the least time of them is shown.
const REPEATED: usize = 200;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let job = Job::parse("job.toml", JOB)?;
    let scene = Scene::parse("actual-blade.toml", SCENE)?;
    let values: Vec<f64> = job.parameter_names().iter().filter_map(|name| scene.value(name)).collect();
    let model = SceneModel::new(
        vec![ModelCondition { scene: scene.clone(), instrument: INSTRUMENT }],
        job.parameter_names(),
        PlausibilityLimits::default(),
    );
    let (features, seen) = (job.features(), [model.record_condition(&values, 0, Draw::default())?]);
    let effort = SolverOptions::new(1e-6); // that of an evaluation
    let simulated_s = least_s(|| {
        drop(black_box(film_scene(&scene, &INSTRUMENT.camera, scene.start_s, scene.run.stop_s, effort)))
    });
    let observed_s = least_s(|| drop(black_box(model.record_condition(&values, 0, Draw::default()))));
    let instants_s = least_s(|| drop(black_box(ReversalInstants::find_instants(&seen[0]))));
    let read_s = least_s(|| drop(black_box(read_features(&features, &seen))));
    println!("simulation, exposures included  {:8.3} ms", 1e3 * simulated_s);
    println!("noise of the tracking           {:8.3} ms", 1e3 * (observed_s - simulated_s));
    println!("instants                        {:8.3} ms", 1e3 * instants_s);
    println!(
        "instants and all features       {:8.3} ms, {:.1} % of the evaluation",
        1e3 * read_s,
        100.0 * read_s / (read_s + observed_s)
    );
    for read in read_features(&features, &seen) {
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
