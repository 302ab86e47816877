//! A fitted recording together with its model, both as they appear in the picture.

use super::camera_observation::CameraObservation;
use super::model::TraceModel;
use super::normal_equations::recording_models;
use super::segment_simulation::{LinkState, RecordingModel, ShownFrame};
use super::unknowns::CameraParameters;
use crate::fit::result::FittedSegment;
use crate::model::Pose;
use crate::recording::FrameGrid;
use crate::recording::channel::median_in_place;
use crate::simulate::scene::Scene;

/// Position of the tip along the sweep and drop of the head in every frame of a recording, m; `None` where a
/// value is missing.
pub(crate) type PictureColumns = [Vec<Option<f64>>; 2];

/// A fitted recording, and the model at the estimates as the fitted camera shows it in the same frames.
#[derive(Debug, Clone)]
pub(crate) struct FittedTraces {
    /// The recording as the fit compares it.
    pub measured: PictureColumns,
    /// Position of the recorded head along the sweep, m.
    pub measured_head_x_m: Vec<Option<f64>>,
    /// The model, which restarts at every segment in its fitted state.
    pub restarted: PictureColumns,
    /// One run of the model, from the start of the first segment that fits. It ends with the fitted frames,
    /// or earlier if the model cannot run on.
    pub single_run: PictureColumns,
    /// The frames of the recording.
    pub grid: FrameGrid,
    /// Standard deviation of the noise of the two columns, m.
    pub noise_m: [f64; 2],
    /// Position of the model's head along the sweep, m.
    pub head_x_m: Vec<Option<f64>>,
    /// Whether the recorded head drives the model.
    pub own_head: bool,
    /// The scene of the single run; its start is not that of this run.
    pub scene: Scene,
    /// Clock of the camera minus clock of the drive, s.
    pub clock_s: f64,
    /// Offsets of the picture from the true motion of the model, m: of head and tip along the sweep, of the
    /// tip relative to the head, and of the drop. The last two are medians over the single run.
    pub offsets_m: [f64; 3],
}

impl FittedTraces {
    /// One entry for each recording of a trace model; the model is at the point `z`. `names` are the names of
    /// the recordings, and each recording has the `segments` with its name. Segments that lie outside the
    /// recording are left out. `None` if a scene refuses the point.
    pub(crate) fn show_recordings(
        model: &TraceModel,
        z: &[f64],
        names: &[String],
        segments: &[FittedSegment],
    ) -> Option<Vec<Self>> {
        let models = recording_models(model, z)?;
        let show = |(shown, name): (&RecordingModel, &String)| {
            let own = segments.iter().filter(|segment| segment.recording == *name);
            Self::show_recording(shown, &own.collect::<Vec<_>>())
        };
        Some(models.iter().zip(names).map(show).collect())
    }

    fn show_recording(model: &RecordingModel, segments: &[&FittedSegment]) -> Self {
        let film = model.observation;
        let frames = film.times_s.len();
        let has_frames = |s: &&&FittedSegment| s.first_frame < s.end_frame && s.end_frame <= frames;
        let known: Vec<&FittedSegment> = segments.iter().filter(has_frames).copied().collect();
        let empty = || vec![None; frames];
        let (mut restarted, mut single_run) = ([empty(), empty()], [empty(), empty()]);
        let mut head_x_m: Vec<Option<f64>> = empty();
        let mut shifts = [Vec::new(), Vec::new()];
        let show = |columns: &mut PictureColumns, first: usize, shown: &[ShownFrame]| {
            for (at, frame) in shown.iter().enumerate() {
                (0..2).for_each(|k| columns[k][first + at] = Some(frame.picture[k]));
            }
        };
        for segment in &known {
            let shown = model.show_frames([segment.first_frame, segment.end_frame], &link_state(segment));
            show(&mut restarted, segment.first_frame, &shown);
        }
        if let Some(start) = first_fitting(&known) {
            let shown = model.show_frames([start.first_frame, film.settings.frames[1]], &link_state(start));
            show(&mut single_run, start.first_frame, &shown);
            for (at, frame) in shown.iter().enumerate() {
                let [tip, head, drop] = frame.truth;
                head_x_m[start.first_frame + at] = Some(frame.head_x_m);
                shifts[0].push(frame.picture[0] - frame.head_x_m - (tip - head));
                shifts[1].push(frame.picture[1] - drop);
            }
        }
        let CameraParameters { clock_s, offset_x_m, .. } = model.geometry.camera;
        let along_m = if film.own_head { 0.0 } else { offset_x_m };
        let [tip_m, drop_m] = shifts.map(|mut shifts| median_in_place(&mut shifts).unwrap_or(0.0));
        Self {
            measured: compared_columns(film),
            measured_head_x_m: film.seen_head_m.clone(),
            restarted,
            single_run,
            grid: FrameGrid { start_s: film.times_s[0], frame_rate_hz: film.rate_hz, frames },
            noise_m: [0, 1].map(|k| film.settings.noise[k].sd()),
            head_x_m,
            own_head: film.own_head,
            scene: model.scene.clone(),
            clock_s,
            offsets_m: [along_m, tip_m - along_m, drop_m],
        }
    }
}

/// The first segment that fits; if none does, the first segment.
pub(crate) fn first_fitting<'a>(segments: &[&'a FittedSegment]) -> Option<&'a FittedSegment> {
    let fitting = segments.iter().find(|segment| segment.fits);
    fitting.or(segments.first()).copied()
}

fn link_state(segment: &FittedSegment) -> LinkState {
    let Pose { theta, phi, theta_rate, phi_rate } = segment.pose();
    LinkState::new(theta, phi, theta_rate, phi_rate)
}

/// Columns of a recording; only the fitted frames have values.
fn compared_columns(film: &CameraObservation) -> PictureColumns {
    let [first, last] = film.settings.frames;
    let fitted = |column: &[Option<f64>]| {
        let value = |(i, x): (usize, &Option<f64>)| x.filter(|_| (first..last).contains(&i));
        column.iter().enumerate().map(value).collect()
    };
    [fitted(&film.tip_x_m), fitted(&film.drop_m)]
}
