//! Twins: synthetic recordings of a scene by a camera with frame rate, exposure, pixel size, tracking noise
//! and dropouts. Every twin is marked as synthetic.

pub mod film;
pub mod spec;

use super::outputs::{ShutterObserver, StickIntervals};
use super::scene::Scene;
use super::{Observer, RunResult, SolverOptions, run_scene_with};
pub use crate::camera::Camera;
use crate::model::parameters::PARAMETERS;
use crate::recording::{FrameGrid, Recording, RecordingError, Traces};
use portable_math::StandardNormal;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::fmt::Write;

/// Errors of a tracking program.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackingModel {
    /// Scale of the image, m per pixel.
    pub metres_per_pixel: f64,
    /// Standard deviation of a tracked coordinate, in pixels.
    pub noise_px: f64,
    /// Probability that a point is lost in a frame, 0 to 1.
    pub dropout_fraction: f64,
    /// Seed of the random numbers for noise and dropouts.
    pub seed: u64,
}

/// Recording of a scene before tracking errors are added.
#[derive(Debug, Clone)]
pub struct TwinView {
    /// Traces without noise.
    pub recording: Recording,
    /// Status, end and work of the simulation.
    pub run: RunResult,
    /// Intervals of stick, s, in the scene's time.
    pub stick_s: Vec<[f64; 2]>,
}

/// Why a scene cannot be filmed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TwinViewError {
    /// The simulation stopped before two frames were taken.
    #[error("the simulation ended as {} at {stopped_at_s} s, before two frames were taken: {}", .status.name(), .status.meaning())]
    Early {
        /// Status with which the simulation ended.
        status: super::RunStatus,
        /// Time at which the simulation ended, s.
        stopped_at_s: f64,
    },
    /// The traces are not a valid recording.
    #[error(transparent)]
    Recording(#[from] RecordingError),
}

/// Runs a scene and records it without noise from `start_s` to `stop_s`, in the scene's time.
///
/// The origin is the position of the head of the upright blade; the glass is at `y = -(l1 + l2)`. A frame
/// averages over the part of its exposure between `start_s` and `stop_s`. The recording of a
/// slider has no heights.
///
/// # Errors
/// [`TwinViewError`]. A run that stops early but after at least two frames produces a shorter recording.
pub fn film_scene(
    scene: &Scene,
    camera: &Camera,
    start_s: f64,
    stop_s: f64,
    effort: SolverOptions,
) -> Result<TwinView, TwinViewError> {
    film_scene_with_observer(scene, camera, [start_s, stop_s], effort, &mut ())
}

/// Does the same as [`film_scene`], and passes the run to a further observer.
///
/// # Errors
/// The errors of [`film_scene`].
pub fn film_scene_with_observer(
    scene: &Scene,
    camera: &Camera,
    [start_s, stop_s]: [f64; 2],
    effort: SolverOptions,
    observer: &mut impl Observer,
) -> Result<TwinView, TwinViewError> {
    let frames = ((stop_s - start_s) * camera.frame_rate_hz * (1.0 + 1e-12)).floor() as usize + 1;
    let grid = FrameGrid { start_s, frame_rate_hz: camera.frame_rate_hz, frames };
    let half_s = 0.5 * camera.exposure_s;
    let open = (0..frames)
        .map(|i| [grid.time_s(i) - half_s, grid.time_s(i) + half_s].map(|t| t.clamp(start_s, stop_s)));
    let glass_y_m = -scene.linkage.upright_height_m();
    let height = |y_m: f64| (!scene.linkage.is_slider()).then_some(y_m);
    let mut traces = Traces::default();
    let shutters = ShutterObserver::new(open, |place| {
        traces.tip_x_m.push(Some(place.tip_x_m));
        traces.tip_y_m.push(height(glass_y_m + place.tip_height_m));
        traces.head_x_m.push(Some(place.head_x_m));
        traces.head_y_m.push(height(-place.head_drop_m));
    });
    let mut observers = ((shutters, StickIntervals::default()), observer);
    let run = run_scene_with(scene, effort, &mut observers);
    let stick_s = observers.0.1.0;
    let frames = traces.tip_x_m.len();
    if frames < 2 {
        return Err(TwinViewError::Early { status: run.status, stopped_at_s: run.stopped_at_s });
    }
    let recording = Recording::new(scene.title(), FrameGrid { frames, ..grid }, traces, true)?;
    Ok(TwinView { recording, run, stick_s })
}

/// Adds white noise to every coordinate and drops points, as a tracking program does.
///
/// # Errors
/// [`RecordingError`] if noise makes a coordinate infinite.
pub fn add_tracking_noise(
    view: &Recording,
    name: &str,
    tracking: &TrackingModel,
) -> Result<Recording, RecordingError> {
    let mut generator = Xoshiro256PlusPlus::seed_from_u64(tracking.seed);
    let noise_m = tracking.noise_px * tracking.metres_per_pixel;
    let mut traces = Traces::default();
    let seen = view.traces();
    for i in 0..view.grid().frames {
        let mut point = |x: Option<f64>, y: Option<f64>| {
            // three random numbers per point, whether it is lost or not, so that dropouts do not change the
            // noise of other points
            let lost = generator.random::<f64>() < tracking.dropout_fraction;
            let (dx, dy): (f64, f64) = (generator.sample(StandardNormal), generator.sample(StandardNormal));
            let place = |value: Option<f64>, noise: f64| value.filter(|_| !lost).map(|v| v + noise_m * noise);
            (place(x, dx), place(y, dy))
        };
        let (tip_x, tip_y) = point(seen.tip_x_m[i], seen.tip_y_m[i]);
        let (head_x, head_y) = point(seen.head_x_m[i], seen.head_y_m[i]);
        traces.tip_x_m.push(tip_x);
        traces.tip_y_m.push(tip_y);
        traces.head_x_m.push(head_x);
        traces.head_y_m.push(head_y);
    }
    Recording::new(name, view.grid(), traces, true)
}

/// All parameters of a twin's scene by name, in SI units: the true values for a fit.
pub(crate) fn true_parameters(scene: &Scene) -> toml::Table {
    let row = |name: &str| Some((name.to_owned(), toml::Value::Float(scene.value(name)?)));
    PARAMETERS.iter().filter_map(|p| row(p.name)).collect()
}

// Export in the file layout of Tracker, to test the importer.

/// Track names that mark the data as synthetic inside the file.
pub(crate) const SYNTHETIC_TRACK_NAMES: [&str; 2] = ["synthetic tip", "synthetic head"];

/// The recording as Tracker exports it: two tracks in pixels with y up, time from the first frame, empty
/// cells for lost points, seven digits in Java's notation (`1.234567E-1`).
pub(crate) fn write_tracker_table(recording: &Recording, metres_per_pixel: f64) -> String {
    let [tip, head] = SYNTHETIC_TRACK_NAMES;
    let mut text = format!("#multi:\n\t{tip}\t\t{head}\t\t\nt\tx\ty\tx\ty\t\n");
    let traces = recording.traces();
    let columns = [&traces.tip_x_m, &traces.tip_y_m, &traces.head_x_m, &traces.head_y_m];
    for i in 0..recording.grid().frames {
        let _ = write!(text, "{:.6E}", i as f64 / recording.grid().frame_rate_hz); // a String never fails
        for column in columns {
            let cell = column[i].map(|value| format!("{:.6E}", value / metres_per_pixel));
            text.push('\t');
            text.push_str(&cell.unwrap_or_default());
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{FrameGrid, Traces};

    #[test]
    fn noise_and_dropouts_have_the_stated_size() {
        let frames = 20_000;
        let column = vec![Some(1.0); frames];
        let traces = Traces {
            tip_x_m: column.clone(),
            tip_y_m: column.clone(),
            head_x_m: column.clone(),
            head_y_m: column,
            ..Traces::default()
        };
        let view =
            Recording::new("still", FrameGrid { start_s: 0.0, frame_rate_hz: 1e4, frames }, traces, true)
                .unwrap();
        let tracking =
            TrackingModel { metres_per_pixel: 2e-5, noise_px: 0.1, dropout_fraction: 0.05, seed: 3 };
        let seen = add_tracking_noise(&view, "noisy", &tracking).unwrap();
        let present: Vec<f64> = seen.traces().tip_x_m.iter().flatten().copied().collect();
        let sd = (present.iter().map(|x| (x - 1.0).powi(2)).sum::<f64>() / present.len() as f64).sqrt();
        assert!((sd / 2e-6 - 1.0).abs() < 0.03, "{sd}"); // the limit is 6 standard errors of `sd`
        let lost = 1.0 - present.len() as f64 / frames as f64;
        assert!((lost - 0.05).abs() < 6.0 * (0.05 * 0.95 / frames as f64).sqrt(), "{lost}");
        assert_eq!(
            seen,
            add_tracking_noise(&view, "noisy", &tracking).unwrap(),
            "a seed gives one recording"
        );
        let again =
            add_tracking_noise(&view, "noisy", &TrackingModel { dropout_fraction: 0.0, ..tracking }).unwrap();
        let kept = seen
            .traces()
            .tip_x_m
            .iter()
            .zip(&again.traces().tip_x_m)
            .filter(|(a, _)| a.is_some())
            .all(|(a, b)| a == b);
        assert!(kept, "dropouts do not reshuffle the noise");
    }

    #[test]
    fn the_table_has_trackers_layout() {
        let column = |a: Option<f64>, b: f64| vec![a, Some(b)];
        let traces = Traces {
            tip_x_m: column(Some(2e-3), 4e-3),
            tip_y_m: column(Some(-6e-3), -6e-3),
            head_x_m: column(None, 0.0),
            head_y_m: column(None, 1e-6),
            ..Traces::default()
        };
        let recording =
            Recording::new("r", FrameGrid { start_s: 0.3, frame_rate_hz: 1e4, frames: 2 }, traces, true)
                .unwrap();
        let lines = "#multi:\n\tsynthetic tip\t\tsynthetic head\t\t\nt\tx\ty\tx\ty\t\n0.000000E0\t1.000000E2\t-3.000000E2\t\t\n\
                     1.000000E-4\t2.000000E2\t-3.000000E2\t0.000000E0\t5.000000E-2\n";
        assert_eq!(write_tracker_table(&recording, 2e-5), lines);
    }
}
