//! Everything that is said of a recording.

use crate::blade::modes::{Tip, modes, named};
use crate::recording::Recording;
use crate::recording::channel::{Instants, Reversal};
use crate::recording::files::{LevelEntry, RecordingFile};
use crate::recording::quality::{
    self, ComponentVisibility, Finding, Grade, Optics, PUBLISHED_COMPONENTS_HZ, PUBLISHED_TITLE, Quality,
    Tilt,
};
use crate::simulate::scene::Scene;
use serde::Serialize;

/// Everything that is said of a recording; the JSON object.
#[derive(Debug, Serialize)]
pub struct Inspection {
    pub recording: String,
    pub synthetic: bool,
    grade: Grade,
    pub measurements: Quality,
    findings: Vec<Finding>,
    #[serde(flatten)]
    pub tilt: Slope,
    /// The rotation of the import, where it was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub level: Option<LevelEntry>,
    pub components: Components,
    pub reversals: Vec<Turn>,
}

/// The slope of the glass in the picture, or why the recording shows none.
#[derive(Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Slope {
    Tilt(Tilt),
    NoTilt(String),
}

#[derive(Debug, Serialize)]
pub struct Components {
    pub source: String,
    pub shown: Vec<Component>,
}

#[derive(Debug, Serialize)]
pub struct Component {
    pub name: String,
    #[serde(flatten)]
    pub showing: ComponentVisibility,
}

/// The instants of a turn, s; null where one is not in the recording.
#[derive(Debug, Serialize)]
pub struct Turn {
    pub hold_s: Option<f64>,
    pub reversal_s: f64,
    pub release_s: Option<f64>,
}

impl From<&Reversal> for Turn {
    fn from(turn: &Reversal) -> Self {
        Self { hold_s: turn.hold_s, reversal_s: turn.reversal_s, release_s: turn.release_s }
    }
}

impl Inspection {
    /// Everything that is said of a recording with its description; `more` findings are of its folder.
    pub fn of_folder(
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
        let slope = quality::tilt(recording, &instants, &measurements);
        Self {
            recording: recording.name().to_owned(),
            synthetic: recording.is_synthetic(),
            grade: quality::grade(&findings),
            tilt: slope.map_or_else(|reason| Slope::NoTilt(reason.to_string()), Slope::Tilt),
            level: file.and_then(|file| file.level.clone()),
            components: scene.map_or_else(published, of_scene).shown_by(&measurements),
            measurements,
            findings,
            reversals: instants.reversals.iter().map(Turn::from).collect(),
        }
    }

    /// Instants of the reversals, s.
    pub fn turns_s(&self) -> Vec<f64> {
        self.reversals.iter().map(|turn| turn.reversal_s).collect()
    }

    /// The first line of the verdict.
    pub fn verdict_in_short(&self) -> String {
        self.verdict().into_iter().next().unwrap_or_default()
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
