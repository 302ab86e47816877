//! `wiperlab inspect`.

use crate::args::Global;
use crate::failure::{Failure, Outcome};
use crate::files;
use crate::load::{Loaded, load_recording, read_scene};
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use wiperlab::blade::modes::{Tip, modes, named};
use wiperlab::import::sha256;
use wiperlab::recording::Recording;
use wiperlab::recording::channel::{Instants, Reversal};
use wiperlab::recording::files::RecordingFile;
use wiperlab::recording::quality::{
    self, Check, ComponentVisibility, Finding, Grade, Optics, PUBLISHED_COMPONENTS_HZ, PUBLISHED_TITLE,
    Quality, Severity,
};
use wiperlab::simulate::scene::Scene;

const AFTER_HELP: &str = "\
The verdict starts with the grade: good, usable with care, or not usable; every finding follows with a number and advice, worst first.
What each finding looks at, its threshold and what to do: docs/quality.md.

Components: whether the recording can show the modes of a scene's blade, or else the two components of the published experiment.";

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
}

/// Everything that is said of a recording; the JSON object.
#[derive(Debug, Serialize)]
pub struct Inspection {
    recording: String,
    synthetic: bool,
    grade: Grade,
    measurements: Quality,
    findings: Vec<Finding>,
    components: Components,
    reversals: Vec<Turn>,
}

#[derive(Debug, Serialize)]
struct Components {
    source: String,
    shown: Vec<Component>,
}

#[derive(Debug, Serialize)]
struct Component {
    name: String,
    #[serde(flatten)]
    showing: ComponentVisibility,
}

/// The instants of a turn, s; null where one is not in the recording.
#[derive(Debug, Serialize)]
struct Turn {
    hold_s: Option<f64>,
    reversal_s: f64,
    release_s: Option<f64>,
}

impl From<&Reversal> for Turn {
    fn from(turn: &Reversal) -> Self {
        Self { hold_s: turn.hold_s, reversal_s: turn.reversal_s, release_s: turn.release_s }
    }
}

impl InspectArgs {
    /// What is asked for is the text itself, so `--quiet` leaves the verdict.
    pub fn run(&self, global: &Global) -> Result<Outcome, Failure> {
        let scene = self.scene.as_deref().map(read_scene).transpose()?;
        let loaded = load_recording(&self.recording)?;
        let changed = changed_sources(&self.recording, &loaded).into_iter().collect();
        let found = Inspection::of_folder(&loaded.recording, loaded.file.as_ref(), changed, scene.as_ref());
        if self.json {
            let text = serde_json::to_string_pretty(&found).map_err(Failure::internal)?;
            print_line!("{text}");
            return Ok(Outcome::Done);
        }
        if !global.quiet {
            print_line!(
                "{}{}",
                found.recording,
                if found.synthetic { " (synthetic: no camera took it)" } else { "" }
            );
            print_origin(&loaded);
            print_line!("{}", quality::table(&found.measurements, loaded.recording.grid().start_s));
            print_reversals(&found.reversals);
            print_components(&found.components);
        }
        for line in found.verdict() {
            print_line!("verdict: {line}");
        }
        Ok(Outcome::Done)
    }
}

impl Inspection {
    /// Everything that is said of a recording with its description; `more` findings are of its folder.
    fn of_folder(
        recording: &Recording,
        file: Option<&RecordingFile>,
        more: Vec<Finding>,
        scene: Option<&Scene>,
    ) -> Self {
        let optics = file.map_or_else(Optics::default, |file| Optics::from(&file.camera));
        let measurements = quality::quality(recording, optics.exposure_s);
        Self::of_measured(recording, file, measurements, more, scene)
    }

    /// The same of a recording that was just imported, and measured for its description.
    pub fn of_import(recording: &Recording, file: &RecordingFile) -> Self {
        let measurements =
            file.quality.clone().unwrap_or_else(|| quality::quality(recording, file.camera.exposure_s));
        Self::of_measured(recording, Some(file), measurements, vec![], None)
    }

    fn of_measured(
        recording: &Recording,
        file: Option<&RecordingFile>,
        measurements: Quality,
        more: Vec<Finding>,
        scene: Option<&Scene>,
    ) -> Self {
        let optics = file.map_or_else(Optics::default, |file| Optics::from(&file.camera));
        let instants = Instants::find(recording);
        let kept =
            file.iter().filter_map(|file| file.source.as_ref()).flat_map(|source| source.findings.clone());
        let import: Vec<Finding> = more.into_iter().chain(kept).collect();
        let findings = quality::findings(recording, &measurements, &optics, &instants, &import);
        Self {
            recording: recording.name().to_owned(),
            synthetic: recording.is_synthetic(),
            grade: quality::grade(&findings),
            components: scene.map_or_else(published, of_scene).shown_by(&measurements),
            measurements,
            findings,
            reversals: instants.reversals.iter().map(Turn::from).collect(),
        }
    }

    /// The verdict as lines for reading, worst first.
    pub fn verdict(&self) -> Vec<String> {
        quality::verdict(&self.measurements, &self.findings)
    }
}

/// Components to look for, before it is known what the recording makes of them.
struct Wanted {
    source: String,
    named: Vec<(String, f64)>,
}

impl Wanted {
    fn shown_by(self, measurements: &Quality) -> Components {
        let shown = self
            .named
            .into_iter()
            .map(|(name, frequency_hz)| Component { name, showing: measurements.shows(frequency_hz) });
        Components { source: self.source, shown: shown.collect() }
    }
}

fn published() -> Wanted {
    let named = PUBLISHED_COMPONENTS_HZ.map(|(name, frequency_hz)| (name.to_owned(), frequency_hz)).to_vec();
    Wanted { source: format!("published experiment, \"{PUBLISHED_TITLE}\""), named }
}

/// The head on its spring and the coupled modes of the links; a mode that does not oscillate has nothing to
/// show.
fn of_scene(scene: &Scene) -> Wanted {
    let blade = &scene.linkage;
    let mut found = vec![("head on its spring".to_owned(), named(blade).head_hz)];
    let sides: &[bool] = if blade.shoulder.is_some() { &[false, true] } else { &[false] };
    for &on_shoulder in sides {
        for (tip, word) in [(Tip::Held, "tip held"), (Tip::Free, "tip slides")] {
            let leaning = if on_shoulder { ", on the shoulder" } else { "" };
            let oscillating =
                modes(blade, tip, on_shoulder).into_iter().filter_map(|mode| mode.damped_frequency_hz);
            found.extend(
                oscillating
                    .enumerate()
                    .map(|(i, frequency_hz)| (format!("{word}{leaning}, mode {}", i + 1), frequency_hz)),
            );
        }
    }
    found.retain(|(_, frequency_hz)| frequency_hz.is_finite() && *frequency_hz > 0.0);
    Wanted { source: format!("modes of the scene \"{}\"", scene.title()), named: found }
}

fn print_origin(loaded: &Loaded) {
    let Some(file) = &loaded.file else {
        print_line!("no recording.toml: the rate is estimated from the times");
        return;
    };
    if let Some(source) = &file.source {
        print_line!(
            "source            {} ({}, {})",
            source.file.all().join(", "),
            source.detected_format,
            source.encoding
        );
    }
    for (key, value) in &file.conditions {
        print_line!("condition         {key} = {value}");
    }
}

/// Turns listed in the table; a longer recording has them all in the JSON.
const MOST_TURNS: usize = 10;

fn print_reversals(turns: &[Turn]) {
    let time = |instant: Option<f64>| instant.map_or_else(|| "-".to_owned(), |t| format!("{t:.6}"));
    for (i, turn) in turns.iter().take(MOST_TURNS).enumerate() {
        let (hold, release) = (time(turn.hold_s), time(turn.release_s));
        print_line!("reversal {:<9}at {:.6} s (hold {hold} s, release {release} s)", i + 1, turn.reversal_s);
    }
    if turns.len() > MOST_TURNS {
        print_line!("                  and {} more (--json lists all)", turns.len() - MOST_TURNS);
    }
}

fn print_components(components: &Components) {
    print_line!("components        of the {}", components.source);
    for component in &components.shown {
        print_line!(
            "  {:<36}{:>9.1} Hz  {}",
            component.name,
            component.showing.frequency_hz,
            component.showing.words()
        );
    }
}

/// Sources that lie in the folder but are no longer what was imported.
pub fn changed_sources(path: &Path, loaded: &Loaded) -> Option<Finding> {
    let source = loaded.file.as_ref()?.source.as_ref()?;
    let folder = if path.is_dir() { path } else { path.parent().unwrap_or(Path::new("")) };
    let changed = source.file.all().iter().zip(source.sha256.all()).filter(|(name, hash)| {
        let copy = folder.join(name);
        copy.is_file() && files::read(&copy).is_ok_and(|bytes| sha256(&bytes) != **hash)
    });
    let names: Vec<&str> = changed.map(|(name, _)| name.as_str()).collect();
    let words = match names.len() {
        0 => return None,
        1 => format!("{} is not the file that was imported (its SHA-256 differs)", names[0]),
        _ => format!("{} are not the files that were imported (their SHA-256 differ)", names.join(", ")),
    };
    Some(
        Finding::new(Check::SourceChanged, Severity::Caution, names.len() as f64, "files", words)
            .advise("import again"),
    )
}
