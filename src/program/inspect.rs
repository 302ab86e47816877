//! `wiperlab inspect`.

use crate::figures::recorded;
use crate::program::failure::{CommandOutcome, Failure};
use crate::program::figures::FigureArgs;
use crate::program::files::Overwrite;
use crate::program::global::GlobalArgs;
use crate::program::inspection::{GlassSlope, InspectedComponents, InspectedReversal, Inspection};
use crate::program::load::{LoadedRecording, load_recording, read_scene};
use crate::program::output;
use crate::recording::quality;
use crate::text::format_degrees;
use clap::Args;
use std::path::PathBuf;

const AFTER_HELP: &str = "\
The verdict starts with the grade: good, usable with care, or not usable. Every finding follows with a number
and advice, worst first. docs/quality.md describes each finding, its threshold and what to do.

Components: whether the recording can show the modes of a scene's blade or, without a scene, the two
components of the published experiment.";

#[derive(Debug, Args)]
#[command(after_help = AFTER_HELP)]
pub struct InspectArgs {
    /// A recording's folder, or a trace.csv alone
    #[arg(value_name = "RECORDING")]
    pub recording: PathBuf,
    /// Scene whose modes the recording is to show (scene.toml); otherwise the components of the published
    /// experiment
    #[arg(long, value_name = "SCENE.toml")]
    pub scene: Option<PathBuf>,
    /// One JSON object on standard output: measurements, findings, components, reversals
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub figures: FigureArgs,
    #[command(flatten)]
    pub overwrite: Overwrite,
}

impl InspectArgs {
    /// What is asked for is the text itself, so `--quiet` leaves the verdict.
    pub fn run(&self, global: &GlobalArgs) -> Result<CommandOutcome, Failure> {
        let scene = self.scene.as_deref().map(read_scene).transpose()?;
        self.figures.check_folder(&[FIGURE], self.overwrite)?;
        let loaded = load_recording(&self.recording)?;
        let changed = loaded.changed_sources(&self.recording).into_iter().collect();
        let found = Inspection::from_folder(&loaded.recording, loaded.file.as_ref(), changed, scene.as_ref());
        let turns_s = found.reversal_times_s();
        let drawn =
            || vec![(FIGURE, recorded::draw_figure(&loaded.recording, &turns_s, &found.verdict_headline()))];
        if self.json {
            let text = serde_json::to_string_pretty(&found).map_err(Failure::internal)?;
            output::write_stdout(&output::escape_lines(&text));
            let silent = GlobalArgs { quiet: true, ..global.clone() };
            self.figures.write_figures(self.overwrite, &silent, drawn)?;
            return Ok(CommandOutcome::Done);
        }
        if !global.quiet {
            print_line!(
                "{}{}",
                found.recording,
                if found.synthetic { " (synthetic: no camera took it)" } else { "" }
            );
            print_origin(&loaded);
            output::write_stdout(&output::escape_lines(&quality::measurement_table(
                &found.measurements,
                loaded.recording.grid().start_s,
            )));
            print_slope(&found);
            print_reversals(&found.reversals);
            print_components(&found.components);
        }
        for line in found.verdict_lines() {
            print_line!("verdict: {line}");
        }
        self.figures.write_figures(self.overwrite, global, drawn)?;
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
        print_line!(
            "source            {} ({}, {})",
            source.file.as_slice().join(", "),
            source.detected_format,
            source.encoding
        );
    }
    for (key, value) in &file.conditions {
        print_line!("condition         {key} = {value}");
    }
}

fn print_slope(found: &Inspection) {
    match &found.tilt {
        GlassSlope::Tilt(tilt) => {
            print_line!(
                "tilt              {}, the slope of the glass in {} frames (off the glass: {})",
                format_degrees(tilt.angle_rad, tilt.sd_rad),
                tilt.frames,
                tilt.frames_off_glass
            );
        }
        GlassSlope::NoTilt(reason) => print_line!("tilt              not known: {reason}"),
    }
    if let Some(level) = &found.level {
        print_line!("level             {}", level.describe());
    }
}

/// Turns listed in the table; a longer recording has them all in the JSON.
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
    for component in &components.shown {
        print_line!(
            "  {:<36}{:>9.1} Hz  {}",
            component.name,
            component.showing.frequency_hz,
            component.showing.describe()
        );
    }
}
