//! The model against the frequencies that the paper publishes (data/published), with blades that are examples and not the paper's.

use std::path::{Path, PathBuf};
use wiperlab::blade::parameters;
use wiperlab::fit::features::read_all;
use wiperlab::fit::job::Job;
use wiperlab::fit::result::FitResult;
use wiperlab::recording::Recording;
use wiperlab::recording::channel::{Channel, Instants, Window};
use wiperlab::simulate::scene::{Scene, StartKind};
use wiperlab::simulate::{Effort, Status};
use wiperlab::spectrum::{Settings, analyse};
use wiperlab::twin::{Camera, view};

const CAMERA: Camera = Camera { frame_rate_hz: 10_000.0, exposure_s: 0.0 };

/// The strongest component of a channel in a band of a window, Hz.
fn component(recording: &Recording, channel: Channel, window: &str, band_hz: (f64, f64)) -> f64 {
    let frames = Window::parse(window).unwrap().resolve(recording, &Instants::find(recording)).unwrap();
    let settings = Settings { band_hz: Some(band_hz), ..Settings::default() };
    let spectrum = analyse(&channel.samples(recording)[frames], recording.grid().frame_rate_hz, &settings).unwrap();
    spectrum.component_in_band(band_hz.0, band_hz.1).unwrap().frequency_hz
}

/// The simulation of the paper: with its natural frequencies (8.88 and 519 Hz) a blade shows a low component near 12.9 Hz and stick-slip
/// cycles within 359 to 692 Hz that slow down with the head.
#[test]
fn a_blade_with_the_natural_frequencies_of_the_simulation_shows_its_components() {
    let mut scene = scene("data/scenes/light-blade.toml");
    (scene.start, scene.start_s, scene.run.stop_s) = (StartKind::Upright, 0.0, 0.55);
    assert!((scene.value("blade.head_natural_frequency_hz").unwrap() - 8.88).abs() < 1e-9);
    assert!((scene.value("blade.neck_natural_frequency_hz").unwrap() - 519.0).abs() < 1e-9);
    let seen = view(&scene, &CAMERA, 0.0, 0.55, Effort::new(1e-8)).unwrap();
    assert_eq!(seen.run.status, Status::Completed);
    let low = component(&seen.recording, Channel::HeadDrop, "0.14..0.5", (5.0, 100.0));
    assert!((low / 12.9 - 1.0).abs() < 0.05, "{low}");
    let high = ["0.2..0.3", "0.3..0.4", "0.4..0.5"].map(|window| component(&seen.recording, Channel::Deflection, window, (250.0, 900.0)));
    assert!(high.iter().all(|f| (359.0..692.0).contains(f)), "{high:?}");
    assert!(high[0] > high[1] && high[1] > high[2], "the head slows down and so does the cycle: {high:?}");
}

/// The experiment of the paper: the committed fit meets 78.4 Hz and 9e2 Hz with 20 Hz and 195 Hz held, when the model is run again.
#[test]
fn the_committed_fit_meets_the_frequencies_of_the_experiment() {
    let folder = root().join("fits/published-experiment");
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    let job = Job::parse("job.toml", &read("job.toml"), &parameters::names()).unwrap();
    let result = FitResult::parse("result.json", &read("result.json")).unwrap();
    let fitted = result.parameters.iter().fold(scene("data/scenes/actual-blade.toml"), |scene, (name, p)| scene.with(name, p.estimate).unwrap());
    assert!((fitted.value("blade.head_natural_frequency_hz").unwrap() - 20.0).abs() < 1e-9);
    assert!((fitted.value("blade.neck_natural_frequency_hz").unwrap() - 195.0).abs() < 1e-9);
    let camera = job.camera.unwrap();
    let camera = Camera { frame_rate_hz: camera.frame_rate_hz, exposure_s: camera.exposure_s };
    let seen = view(&fitted, &camera, fitted.start_s, fitted.run.stop_s, Effort::new(1e-8)).unwrap();
    assert_eq!(seen.run.status, Status::Completed);
    let found: Vec<f64> = read_all(&job.features(), &[seen.recording]).into_iter().map(|f| f.unwrap().value).collect();
    assert!((found[0] / 78.4 - 1.0).abs() < 0.02 && (found[1] / 900.0 - 1.0).abs() < 0.02, "{found:?}");
    assert!(result.notes.iter().any(|note| note.contains("2 informative features for 4 parameters")), "{:?}", result.notes);
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).to_owned()
}

fn scene(path: &str) -> Scene {
    Scene::parse(path, &std::fs::read_to_string(root().join(path)).unwrap()).unwrap()
}
