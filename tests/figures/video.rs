//! Frames of a video behind the links: a picture whose answer is known has its points where the figure draws
//! those that were tracked.

use plain_charts::{Medium, Raster};
use std::sync::Mutex;
use wiperlab::compare::{ConditionComparison, FittedRecording, run_conditions};
use wiperlab::figures::video_frames::{VideoFrames, details, figure};
use wiperlab::fit::job::Job;
use wiperlab::fit::result::FitResult;
use wiperlab::fit::{MeasuredRecording as Fitted, Problem};
use wiperlab::recording::Recording;
use wiperlab::recording::files::{LevelEntry, PixelMapping, RecordingFile, parse_trace_csv};
use wiperlab::recording::video::{Picture, PictureSource, RecordingVideo};
use wiperlab::simulate::scene::Scene;

/// Pictures of two dark spots of Gaussian shape, at the pixels of the tracked head and tip.
struct Spots<'a> {
    recording: &'a Recording,
    place: PixelMapping,
    size: (usize, usize),
    /// Standard deviation of a spot, pixels.
    wide: f64,
    frames: std::ops::Range<usize>,
    asked: Mutex<Vec<usize>>,
}

impl PictureSource for Spots<'_> {
    fn frame_picture(&self, frame: usize) -> Option<Picture> {
        self.asked.lock().unwrap().push(frame);
        let traces = self.recording.traces();
        let at = |x: &[Option<f64>], y: &[Option<f64>]| Some(self.place.to_pixel([x[frame]?, y[frame]?]));
        let spots = [at(&traces.head_x_m, &traces.head_y_m)?, at(&traces.tip_x_m, &traces.tip_y_m)?];
        let (width, height) = self.size;
        let grey = (0..width * height).map(|at| {
            let (x, y) = ((at % width) as f64 + 0.5, (at / width) as f64 + 0.5);
            let dark = spots.iter().map(|s| {
                let away = ((x - s[0]).powi(2) + (y - s[1]).powi(2)) / (2.0 * self.wide.powi(2));
                250.0 * (-away).exp()
            });
            (255.0 - dark.sum::<f64>().min(255.0)).round() as u8
        });
        self.frames.contains(&frame).then(|| Picture { width, height, grey: grey.collect() })
    }
}

/// The middle of what is dark near a place of a raster, in the figure's mm.
fn middle(raster: &Raster, near_mm: (f64, f64), within_mm: f64) -> (f64, f64) {
    let picture = Picture::from_png(&raster.png).unwrap();
    let step = (raster.x[1] - raster.x[0]) / picture.width as f64;
    let (mut sum, mut x_sum, mut y_sum) = (0.0, 0.0, 0.0);
    for (at, grey) in picture.grey.iter().enumerate() {
        let x = raster.x[0] + ((at % picture.width) as f64 + 0.5) * step;
        let y = raster.y[1] - ((at / picture.width) as f64 + 0.5) * step;
        if (x - near_mm.0).hypot(y - near_mm.1) <= within_mm {
            let dark = 255.0 - f64::from(*grey);
            (sum, x_sum, y_sum) = (sum + dark, x_sum + dark * x, y_sum + dark * y);
        }
    }
    assert!(sum > 500.0, "nothing dark near {near_mm:?}");
    (x_sum / sum, y_sum / sum)
}

impl<'a> Spots<'a> {
    /// Pictures 560 pixels wide of the whole stroke, of some frames.
    fn of(recording: &'a Recording, place: PixelMapping, frames: std::ops::Range<usize>) -> Self {
        Self { recording, place, size: (560, 60), wide: 1.0, frames, asked: Mutex::default() }
    }
}

struct Fit {
    job: Job,
    result: FitResult,
    recording: Recording,
    file: RecordingFile,
    problem: Problem,
}

fn fit() -> Fit {
    let job = Job::parse("job.toml", include_str!("../../fits/actual-blade-twin/job.toml")).unwrap();
    let result =
        FitResult::parse("result.json", include_str!("../../fits/actual-blade-twin/result.json")).unwrap();
    let (grid, traces) =
        parse_trace_csv("trace.csv", include_str!("../../data/actual-blade-twin/trace.csv")).unwrap();
    let file =
        RecordingFile::parse("r.toml", include_str!("../../data/actual-blade-twin/recording.toml")).unwrap();
    let recording = Recording::new("twin", grid, traces, true).unwrap();
    let scene = Scene::parse("scene.toml", include_str!("../../data/scenes/actual-blade.toml")).unwrap();
    let measured = Fitted { recording: recording.clone(), exposure_s: file.camera.exposure_s };
    let problem = Problem::new(job.clone(), vec![scene], vec![measured]).unwrap();
    Fit { job, result, recording, file, problem }
}

/// The links over spots.
fn over_spots(fit: &Fit, spots: &Spots<'_>) -> VideoFrames {
    let model = fit.problem.fitted_model(&fit.result).unwrap();
    let models = run_conditions(&fit.job, &model, &fit.result).unwrap();
    let film = RecordingVideo { mapping: spots.place, pictures: spots };
    let measured = [FittedRecording { recording: &fit.recording, file: Some(&fit.file), film: Some(film) }];
    let cases = ConditionComparison::compare_conditions(&fit.job, &measured, &models, &fit.result);
    VideoFrames::of(&cases[0]).unwrap()
}

fn level(angle_rad: f64) -> LevelEntry {
    LevelEntry {
        applied: true,
        angle_rad,
        sd_rad: 1e-3,
        centre_x_m: 0.05,
        centre_y_m: -0.003,
        frames: 1000,
        curvature_per_m: None,
    }
}

#[test]
fn spots_in_the_pictures_lie_where_the_tracked_points_are_drawn() {
    let fit = fit();
    let frames = fit.recording.grid().frames;
    // fine pixels and coarse ones, a moved origin, a camera that was inclined
    for (metres_per_pixel, origin_px, size, turned) in [
        (4e-5, [0.0, 60.0], (2600, 260), None),
        (2e-4, [7.25, 12.5], (560, 60), None),
        (1e-4, [40.0, 80.0], (1100, 200), Some(level(0.03))),
    ] {
        let place = PixelMapping::new(origin_px, metres_per_pixel, turned.as_ref());
        let wide = 2e-4 / metres_per_pixel;
        let spots = Spots {
            recording: &fit.recording,
            place,
            size,
            wide,
            frames: 0..frames,
            asked: Mutex::default(),
        };
        let shown = over_spots(&fit, &spots);
        assert_eq!(spots.asked.lock().unwrap().len(), shown.instants.len(), "no other frame is read");
        assert!(shown.instants.len() >= 3);
        for instant in &shown.instants {
            let raster = instant.frame.raster().unwrap();
            let step = (raster.x[1] - raster.x[0]) / 256.0;
            for (x, y) in instant.tracked_m.map(|(x, y)| (1e3 * x, 1e3 * y)) {
                let found = middle(raster, (x, y), 0.7);
                let off = (found.0 - x).hypot(found.1 - y);
                assert!(off < step, "{}: {off} mm off, a point is {step} mm", instant.name);
            }
        }
        assert!(details(&shown).ends_with("the frames of the video."));
        let svg = figure(&shown).to_svg(Medium::Screen);
        assert_eq!(svg.matches("href=\"data:image/png;base64,").count(), shown.instants.len());
        // four of them leave room on a page of a megabyte
        assert!(svg.len() < 120_000, "{}", svg.len());
    }
}

#[test]
fn an_instant_without_a_frame_is_drawn_without_one_and_said() {
    let fit = fit();
    let place = PixelMapping::new([0.0, 12.0], 2e-4, None);
    let spots = |frames| Spots::of(&fit.recording, place, frames);
    let none = over_spots(&fit, &spots(0..0));
    assert!(none.instants.iter().all(|instant| instant.frame.raster().is_none()));
    assert!(
        details(&none).contains("no picture before the reversal")
            && details(&none).contains("first_frame")
            && !figure(&none).to_svg(Medium::Screen).contains("<image")
    );
    let last = over_spots(&fit, &spots(0..fit.recording.grid().frames)).instants.pop().unwrap();
    let from = ((last.time_s - fit.recording.grid().start_s) * 5000.0).round() as usize;
    let one = over_spots(&fit, &spots(from..from + 1));
    assert_eq!(one.instants.iter().filter(|instant| instant.frame.raster().is_some()).count(), 1);
    assert!(details(&one).contains("of which there is none before the reversal"), "{}", details(&one));
}

#[test]
fn a_picture_of_another_place_is_not_drawn_and_the_keys_are_named() {
    let fit = fit();
    let frames = 0..fit.recording.grid().frames;
    let place = PixelMapping::new([1e6, -1e6], 2e-4, None);
    let spots = Spots::of(&fit.recording, place, frames);
    let away = over_spots(&fit, &spots);
    assert!(!figure(&away).to_svg(Medium::Screen).contains("<image"));
    assert!(details(&away).contains("shows neither tracked point: check `origin_px`"), "{}", details(&away));
}
