//! `wiperlab twin`.

use super::failure::describe_early_end;
use super::load::read_named_scene;
use super::prelude::*;
use super::run_observer::ProgressObserver;
use crate::figures::twin as figure;
use crate::recording::Recording;
use crate::recording::files::{CameraEntry, DESCRIPTION_FILE, RecordingFile, TRACE_FILE, YAxis, trace_csv};
use crate::recording::quality::measure_quality;
use crate::simulate::SolverOptions;
use crate::simulate::scene::Scene;
use crate::simulate::twin::spec::TwinSpec;
use crate::simulate::twin::{
    self, Camera, TwinView, add_tracking_noise, film_scene, film_scene_with_observer, true_parameters,
};
use crate::text::text_sha256;

#[derive(Debug, Args)]
pub(crate) struct TwinArgs {
    /// Specification of the twin: a scene and a camera (twin.toml)
    pub spec: PathBuf,
    /// Folder of the synthetic recording (data/NAME)
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    #[command(flatten)]
    pub figures: FigureArgs,
    #[command(flatten)]
    pub overwrite: Overwrite,
}

impl TwinArgs {
    pub(crate) fn run(&self, global: &GlobalArgs) -> Outcome {
        let file = self.spec.display().to_string();
        let text = files::read_toml(&self.spec)?;
        let spec = TwinSpec::parse(&file, &text).map_err(Failure::input)?;
        let scene = read_named_scene(&self.spec, &spec.scene)?;
        let writer = WritePolicy::new(OutputCommand::Twin, self.overwrite);
        OutputFolder::check(&self.out, &writer, &output_names(&spec))?;
        self.figures.check_folder(&[FIGURE], self.overwrite)?;
        let [start_s, stop_s] = spec.window_within(&file, &scene).map_err(Failure::input)?;

        let mut watch = ProgressObserver::new([scene.start_s, scene.run.stop_s], "twin", global.quiet);
        let effort = SolverOptions::from_scene(&scene);
        let seen = film_scene_with_observer(&scene, &spec.camera, [start_s, stop_s], effort, &mut watch)
            .map_err(Failure::input)?;
        drop(watch);
        let recording = add_tracking_noise(&seen.recording, &files::display_name(&self.out), &spec.tracking)
            .map_err(Failure::internal)?;
        let mut description = describe_recording(&spec, &scene, &text, &recording)?;
        let trace = trace_csv(&recording);
        description.trace_sha256 = Some(text_sha256(&trace));
        let mut outputs = vec![
            (TRACE_FILE, trace.into_bytes()),
            (DESCRIPTION_FILE, description.to_toml().map_err(Failure::internal)?.into_bytes()),
        ];
        if spec.tracker_export {
            let table = toml::to_string(&description.twin).map_err(Failure::internal)?;
            let export = twin::write_tracker_table(&recording, spec.tracking.metres_per_pixel);
            outputs.extend([(EXPORT_FILE, export.into_bytes()), (SPEC_FILE, table.into_bytes())]);
        }
        files::write_outputs(&self.out, &writer, &outputs)?;
        let early = describe_early_end(&seen.run);
        if !global.quiet {
            let (title, frames, rate) =
                (scene.title(), recording.grid().frames, recording.grid().frame_rate_hz);
            print_line!("synthetic recording of \"{title}\": {frames} frames at {rate} 1/s");
            print_line!("written to {}", self.out.display());
        }
        self.draw_figure(&spec, &scene, &seen, &recording, global)?;
        Ok(early.map_or(CommandOutcome::Done, |how| {
            warn_line!("warning: the simulation ended early and so does the recording: {how}");
            CommandOutcome::StoppedEarly
        }))
    }
    /// Draws the figure, if requested. This needs another run, for the motion between the frames.
    fn draw_figure(
        &self,
        spec: &TwinSpec,
        scene: &Scene,
        seen: &TwinView,
        tracked: &Recording,
        global: &GlobalArgs,
    ) -> Outcome<()> {
        if self.figures.folder.is_none() {
            return Ok(());
        }
        let grid = tracked.grid();
        let ends_s = [grid.start_s, grid.time_s(grid.frames.saturating_sub(1))];
        let camera = Camera { frame_rate_hz: figure::MOTION_SAMPLES * grid.frame_rate_hz, exposure_s: 0.0 };
        let motion = film_scene(scene, &camera, ends_s[0], ends_s[1], SolverOptions::from_scene(scene))
            .map_err(Failure::input)?;
        let shown = figure::TwinPlot {
            title: &spec.title,
            motion: &motion.recording,
            seen: &seen.recording,
            tracked,
            exposure_s: spec.camera.exposure_s,
            noise_m: spec.tracking.noise_px * spec.tracking.metres_per_pixel,
            stick_s: &seen.stick_s,
        };
        self.figures
            .write_figures(self.overwrite, global.quiet, || vec![(FIGURE, figure::draw_figure(&shown))])
    }
}

/// File name of the figure.
const FIGURE: &str = "twin";
/// File name of the twin in the format of an export of Tracker.
const EXPORT_FILE: &str = "synthetic-tracker-export.txt";
/// File name of the specification of the twin, with the true values.
const SPEC_FILE: &str = "twin.toml";

/// Names of the files that the specification requests.
fn output_names(spec: &TwinSpec) -> Vec<&'static str> {
    let export = if spec.tracker_export { &[EXPORT_FILE, SPEC_FILE][..] } else { &[] };
    [&[TRACE_FILE, DESCRIPTION_FILE], export].concat()
}

/// Contents of `recording.toml`, with the whole specification and the true values.
fn describe_recording(
    spec: &TwinSpec,
    scene: &Scene,
    text: &str,
    recording: &Recording,
) -> Outcome<RecordingFile> {
    let exposure_s = (spec.camera.exposure_s > 0.0).then_some(spec.camera.exposure_s);
    let camera = CameraEntry {
        frame_rate_hz: spec.camera.frame_rate_hz,
        frame_rate_sd_hz: None,
        clock: None,
        exposure_s,
        metres_per_pixel: Some(spec.tracking.metres_per_pixel),
        y_axis: Some(YAxis::Up),
    };
    let mut twin: toml::Table = text.parse().map_err(Failure::internal)?;
    twin.insert("truth".to_owned(), toml::Value::Table(true_parameters(scene)));
    let mut file = RecordingFile::new(camera, true);
    file.quality = Some(measure_quality(recording, exposure_s));
    file.twin = Some(twin);
    Ok(file)
}
