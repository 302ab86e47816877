//! `wiperlab inspect`.

use super::load::{LoadedRecording, load_recording, read_scene};
use super::prelude::*;
use crate::figures::recorded;
use crate::model::modes::{TipConstraint, body_frequencies, natural_modes};
use crate::recording::Recording;
use crate::recording::channel::{Reversal, ReversalInstants};
use crate::recording::files::{LevelEntry, RecordingFile};
use crate::recording::quality::{
    self, CameraTilt, ComponentVisibility, Grade, MeasuredMotion, MotionSummary, Optics, Quality,
    QualityFinding,
};
use crate::simulate::scene::Scene;
use crate::text::format_degrees;
use serde::Serialize;

const AFTER_HELP: &str = "\
The verdict starts with the grade: good, usable with care, or not usable. Every finding follows with a number
and advice, worst first. docs/quality.md describes each finding, its threshold and what to do.

With --scene the height of the blade is compared with that of the scene, and the components say whether the
recording can show the modes of its blade.";

#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub(crate) struct InspectArgs {
    /// Folder of a recording, or a single trace.csv
    #[arg(value_name = "RECORDING")]
    pub recording: PathBuf,
    /// Scene of the blade (scene.toml): compares its height, and lists which of its modes the recording shows
    #[arg(long, value_name = "SCENE.toml")]
    pub scene: Option<PathBuf>,
    /// Print one JSON object to standard output: measurements, motion, findings, reversals, tilt
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub figures: FigureArgs,
    #[command(flatten)]
    pub overwrite: Overwrite,
}

impl InspectArgs {
    /// Prints the verdict even with `--quiet`, since the verdict is the purpose of the command.
    pub(crate) fn run(&self, global: &GlobalArgs) -> Outcome {
        let scene = self.scene.as_deref().map(read_scene).transpose()?;
        self.figures.check_folder(&[FIGURE], self.overwrite)?;
        let loaded = load_recording(&self.recording)?;
        let recording = &*loaded.recording.resample_to_grid();
        let changed = loaded.changed_sources(&self.recording).into_iter().collect();
        let found = Inspection::from_folder(recording, loaded.file.as_ref(), changed, scene.as_ref());
        let turns_s: Vec<f64> = found.reversals.iter().map(|turn| turn.reversal_s).collect();
        let headline = found.verdict_lines().into_iter().next().unwrap_or_default();
        let drawn = || vec![(FIGURE, recorded::draw_figure(recording, &turns_s, &headline))];
        if self.json {
            let text = serde_json::to_string_pretty(&found).map_err(Failure::internal)?;
            output::print_lines(&text);
            self.figures.write_figures(self.overwrite, true, drawn)?;
            return Ok(CommandOutcome::Done);
        }
        if !global.quiet {
            let kind = if found.synthetic { " (synthetic: no camera took it)" } else { "" };
            print_line!("{}{kind}", found.recording);
            print_origin(&loaded);
            let start_s = recording.grid().start_s;
            output::print_lines(&quality::measurement_table(&found.measurements, start_s));
            output::print_lines(&quality::motion_lines(&found.motion).join("\n"));
            print_slope(&found);
            print_reversals(&found.reversals);
            found.components.iter().for_each(print_components);
        }
        for line in found.verdict_lines() {
            print_line!("verdict: {line}");
        }
        self.figures.write_figures(self.overwrite, global.quiet, drawn)?;
        Ok(CommandOutcome::Done)
    }
}

const FIGURE: &str = "recorded";

fn print_origin(loaded: &LoadedRecording) {
    let Some(file) = &loaded.file else {
        print_line!("no recording.toml: the rate is estimated from the times");
        return;
    };
    if file.trace_sha256.is_none() {
        print_line!("trace             not verified: recording.toml has no SHA-256 of it");
    }
    if let Some(source) = &file.source {
        let (names, format) = (source.file.as_slice().join(", "), &source.detected_format);
        print_line!("source            {names} ({format}, {})", source.encoding);
    }
    for (key, value) in &file.conditions {
        print_line!("condition         {key} = {value}");
    }
}

fn print_slope(found: &Inspection) {
    match &found.tilt {
        GlassSlope::Tilt(CameraTilt { angle_rad, sd_rad, frames, frames_off_glass: off, .. }) => {
            let tilt = format_degrees(*angle_rad, *sd_rad);
            print_line!(
                "tilt              {tilt}, the slope of the glass in {frames} frames (off the glass: {off})"
            );
        }
        GlassSlope::NoTilt(reason) => print_line!("tilt              not known: {reason}"),
    }
    if let Some(level) = &found.level {
        print_line!("level             {}", level.describe());
    }
}

/// Maximum number of reversals listed in the table; the JSON lists all reversals.
const MOST_TURNS: usize = 10;

fn print_reversals(turns: &[InspectedReversal]) {
    let time = |instant: Option<f64>| instant.map_or_else(|| "-".to_owned(), |t| format!("{t:.6}"));
    for (i, turn) in turns.iter().take(MOST_TURNS).enumerate() {
        let (hold, release) = (time(turn.hold_s), time(turn.release_s));
        print_line!("reversal {:<9}at {:.6} s (hold {hold} s, release {release} s)", i + 1, turn.reversal_s);
    }
    if turns.len() > MOST_TURNS {
        print_line!("                  and {} more (--json lists all)", turns.len() - MOST_TURNS);
    }
}

fn print_components(components: &InspectedComponents) {
    print_line!("components        of the {}", components.source);
    for InspectedComponent { name, showing } in &components.shown {
        print_line!("  {name:<36}{:>9.1} Hz  {}", showing.frequency_hz, showing.describe());
    }
}

/// All findings on a recording; the JSON object that `--json` prints.
#[derive(Debug, Serialize)]
pub(crate) struct Inspection {
    pub recording: String,
    pub synthetic: bool,
    grade: Grade,
    pub measurements: Quality,
    pub motion: MotionSummary,
    findings: Vec<QualityFinding>,
    #[serde(flatten)]
    pub tilt: GlassSlope,
    /// The rotation applied by the import, if it was requested.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub level: Option<LevelEntry>,
    /// Visibility of the modes of the scene, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub components: Option<InspectedComponents>,
    pub reversals: Vec<InspectedReversal>,
}

/// The slope of the glass in the picture, or the reason why it cannot be determined.
#[derive(Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum GlassSlope {
    Tilt(CameraTilt),
    NoTilt(String),
}

#[derive(Debug, Serialize)]
pub(crate) struct InspectedComponents {
    pub source: String,
    pub shown: Vec<InspectedComponent>,
}

#[derive(Debug, Serialize)]
pub(crate) struct InspectedComponent {
    pub name: String,
    #[serde(flatten)]
    pub showing: ComponentVisibility,
}

/// The instants of a reversal, s; null for an instant that the recording does not contain.
#[derive(Debug, Serialize)]
pub(crate) struct InspectedReversal {
    pub hold_s: Option<f64>,
    pub reversal_s: f64,
    pub release_s: Option<f64>,
}

impl Inspection {
    /// Inspects a recording with its description; `more` are findings on the files in the folder of the
    /// recording.
    pub(crate) fn from_folder(
        recording: &Recording,
        file: Option<&RecordingFile>,
        more: Vec<QualityFinding>,
        scene: Option<&Scene>,
    ) -> Self {
        let optics = file.map_or_else(Optics::default, |file| Optics::from(&file.camera));
        let measurements = quality::measure_quality(recording, optics.exposure_s);
        Self::from_measurements(recording, file, measurements, more, scene)
    }

    /// Inspects a recording that has just been imported, with the quality from its description.
    pub(crate) fn from_import(recording: &Recording, file: &RecordingFile) -> Self {
        let measurements = file
            .quality
            .clone()
            .unwrap_or_else(|| quality::measure_quality(recording, file.camera.exposure_s));
        Self::from_measurements(recording, Some(file), measurements, vec![], None)
    }

    fn from_measurements(
        recording: &Recording,
        file: Option<&RecordingFile>,
        measurements: Quality,
        more: Vec<QualityFinding>,
        scene: Option<&Scene>,
    ) -> Self {
        let optics = file.map_or_else(Optics::default, |file| Optics::from(&file.camera));
        let instants = ReversalInstants::find_instants(recording);
        let kept =
            file.iter().filter_map(|file| file.source.as_ref()).flat_map(|source| source.findings.clone());
        let motion = MeasuredMotion::measure(recording, &measurements, &instants);
        let height =
            |scene: &Scene| quality::check_scene_height(&motion.summary, scene.linkage.upright_height_m());
        let import: Vec<QualityFinding> =
            scene.and_then(height).into_iter().chain(more).chain(kept).collect();
        let findings =
            quality::judge_recording(recording, &measurements, &optics, (&instants, &motion), &import);
        let reversal = |turn: &Reversal| InspectedReversal {
            hold_s: turn.hold_s,
            reversal_s: turn.reversal_s,
            release_s: turn.release_s,
        };
        Self {
            recording: recording.name().to_owned(),
            synthetic: recording.is_synthetic(),
            grade: quality::grade_findings(&findings),
            tilt: motion.tilt.map_or_else(|reason| GlassSlope::NoTilt(reason.to_string()), GlassSlope::Tilt),
            level: file.and_then(|file| file.level.clone()),
            components: scene.map(|scene| inspect_components(scene, &measurements)),
            motion: motion.summary,
            measurements,
            findings,
            reversals: instants.reversals.iter().map(reversal).collect(),
        }
    }

    /// The verdict as lines of text, the most severe finding first.
    pub(crate) fn verdict_lines(&self) -> Vec<String> {
        quality::verdict_lines(&self.measurements, &self.findings)
    }
}

/// Whether the recording can show the modes of the scene.
fn inspect_components(scene: &Scene, measurements: &Quality) -> InspectedComponents {
    let component = |(name, hz)| InspectedComponent { name, showing: measurements.component_visibility(hz) };
    InspectedComponents {
        source: format!("modes of the scene \"{}\"", scene.title()),
        shown: scene_components(scene).into_iter().map(component).collect(),
    }
}

/// Natural frequencies, Hz, of the head on its spring and of the coupled modes of the links; modes that do
/// not oscillate are left out.
fn scene_components(scene: &Scene) -> Vec<(String, f64)> {
    let blade = &scene.linkage;
    let mut found = vec![("head on its spring".to_owned(), body_frequencies(blade).head_hz)];
    let sides: &[bool] = if blade.shoulder.is_some() { &[false, true] } else { &[false] };
    for &on_shoulder in sides {
        let leaning = if on_shoulder { ", on the shoulder" } else { "" };
        for (tip, word) in [(TipConstraint::Held, "tip held"), (TipConstraint::Free, "tip slides")] {
            let modes = natural_modes(blade, tip, on_shoulder).into_iter();
            let oscillating = modes.filter_map(|mode| mode.damped_frequency_hz).enumerate();
            found.extend(oscillating.map(|(i, hz)| (format!("{word}{leaning}, mode {}", i + 1), hz)));
        }
    }
    found.retain(|(_, frequency_hz)| frequency_hz.is_finite() && *frequency_hz > 0.0);
    found
}
