//! The frequency of a component as a fit reads it, and as `wiperlab spectrum` does: how far noise scatters
//! each, how rough each is along a parameter, and what it takes.
//! `cargo run --release --example readings`.

use short_spectra::{Detrend, SampledRecord, SpectralAnalysis, SpectrumSettings, WindowedTransform};
use std::time::Instant;
use wiperlab::fit::job::Job;
use wiperlab::fit::model::{Draw, Model};
use wiperlab::fit::scene_model::{Instrument, ModelCondition, PlausibilityLimits, SceneModel};
use wiperlab::recording::channel::{Channel, ReversalInstants, Window};
use wiperlab::simulate::scene::Scene;
use wiperlab::simulate::twin::Camera;

const JOB: &str = include_str!("../fits/actual-blade-twin/job.toml");
const SCENE: &str = include_str!("../data/scenes/actual-blade.toml");
/// The camera of the bundled recording and the noise of its tracking.
const INSTRUMENT: Instrument = Instrument {
    camera: Camera { frame_rate_hz: 5000.0, exposure_s: 5e-5 },
    noise_m: 2e-6,
    dropout_fraction: 0.0,
};
/// Draws of the noise.
const DRAWS: u64 = 40;
/// Values of a parameter, from 2 % below to 2 % above its own.
const PLACES: i32 = 20;
const REACH: f64 = 0.02;

/// A component: its name, channel, window and band, Hz.
const COMPONENTS: [(&str, Channel, &str, (f64, f64)); 3] = [
    ("ring-down of the head", Channel::HeadDrop, "release+0.01..release+0.2", (40.0, 140.0)),
    ("cycle after the flip", Channel::Deflection, "release+0.01..release+0.1", (500.0, 1500.0)),
    ("cycle at speed", Channel::Deflection, "release+0.2..release+0.3", (500.0, 1500.0)),
];

type Read = fn(&[Option<f64>], (f64, f64)) -> Option<f64>;
const READINGS: [(&str, Read); 2] = [("windowed spectrum", windowed), ("complete analysis", complete)];

fn settings() -> SpectrumSettings {
    SpectrumSettings { detrend: Some(Detrend::Cubic), ..SpectrumSettings::default() }
}

fn windowed(samples: &[Option<f64>], band_hz: (f64, f64)) -> Option<f64> {
    let found = WindowedTransform::new(samples, INSTRUMENT.camera.frame_rate_hz, &settings()).ok()?;
    found.components(band_hz).ok()?.first().map(|c| c.frequency_hz)
}

fn complete(samples: &[Option<f64>], (low, high): (f64, f64)) -> Option<f64> {
    let record = SampledRecord { samples, frame_rate_hz: INSTRUMENT.camera.frame_rate_hz, exposure_s: None };
    let found = SpectralAnalysis::from_record(&record, &settings()).ok()?.spectrum.components;
    found.iter().find(|c| (low..=high).contains(&c.frequency_hz)).map(|c| c.frequency_hz)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let job = Job::parse("job.toml", JOB)?;
    let scene = Scene::parse("actual-blade.toml", SCENE)?;
    let values: Vec<f64> = job.parameter_names().iter().filter_map(|name| scene.value(name)).collect();
    let model = SceneModel::new(
        vec![ModelCondition { scene, instrument: INSTRUMENT }],
        job.parameter_names(),
        PlausibilityLimits::default(),
    );
    println!(
        "| component | read by | mean Hz | noise scatters it by, Hz | rough along A, Hz | along the neck stiffness, Hz | ms |"
    );
    println!("|---|---|---:|---:|---:|---:|---:|");
    for (name, channel, window, band_hz) in COMPONENTS {
        let window = Window::parse(window)?;
        for (reading, read) in READINGS {
            let mut times_ms = Vec::new();
            let mut at = |values: &[f64], noise: u64| {
                let seen = model.record_condition(values, 0, Draw { noise, ..Draw::default() }).ok()?;
                let frames = window.resolve_frames(&seen, &ReversalInstants::find_instants(&seen)).ok()?;
                let samples = channel.samples(&seen);
                let started = Instant::now();
                let found = read(samples.get(frames)?, band_hz);
                times_ms.push(1e3 * started.elapsed().as_secs_f64());
                found
            };
            let drawn: Vec<f64> = (0..DRAWS).filter_map(|noise| at(&values, noise)).collect();
            let mut along = |parameter: usize| {
                let moved = |k: i32| {
                    let mut values = values.clone();
                    values[parameter] *= 1.0 + REACH * f64::from(k) / f64::from(PLACES);
                    at(&values, 0)
                };
                roughness(&(-PLACES..=PLACES).filter_map(moved).collect::<Vec<_>>())
            };
            let (a, neck) = (along(0), along(3));
            let mean = drawn.iter().sum::<f64>() / drawn.len() as f64;
            times_ms.sort_by(f64::total_cmp);
            println!(
                "| {name} | {reading} | {mean:.2} | {:.3} | {a:.3} | {neck:.3} | {:.2} |",
                deviation(&drawn),
                times_ms[times_ms.len() / 2]
            );
        }
    }
    Ok(())
}

fn deviation(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    (values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (values.len() as f64 - 1.0)).sqrt()
}

/// Rms of second differences over the root of six: of independent errors their deviation, of a smooth curve
/// next to nothing.
fn roughness(values: &[f64]) -> f64 {
    let second = values.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).powi(2));
    (second.sum::<f64>() / (values.len() as f64 - 2.0) / 6.0).sqrt()
}
