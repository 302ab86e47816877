//! Everything that is said of a recording.

use crate::blade::modes::{TipConstraint, body_frequencies, natural_modes};
use crate::recording::Recording;
use crate::recording::channel::{Reversal, ReversalInstants};
use crate::recording::files::{LevelEntry, RecordingFile};
use crate::recording::quality::{
    self, CameraTilt, ComponentVisibility, Grade, Optics, PUBLISHED_COMPONENTS_HZ, PUBLISHED_TITLE, Quality,
    QualityFinding,
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
    findings: Vec<QualityFinding>,
    #[serde(flatten)]
    pub tilt: GlassSlope,
    /// The rotation of the import, where it was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub level: Option<LevelEntry>,
    pub components: InspectedComponents,
    pub reversals: Vec<InspectedReversal>,
}

/// The slope of the glass in the picture, or why the recording shows none.
#[derive(Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum GlassSlope {
    Tilt(CameraTilt),
    NoTilt(String),
}

#[derive(Debug, Serialize)]
pub struct InspectedComponents {
    pub source: String,
    pub shown: Vec<InspectedComponent>,
}

#[derive(Debug, Serialize)]
pub struct InspectedComponent {
    pub name: String,
    #[serde(flatten)]
    pub showing: ComponentVisibility,
}

/// The instants of a turn, s; null where one is not in the recording.
#[derive(Debug, Serialize)]
pub struct InspectedReversal {
    pub hold_s: Option<f64>,
    pub reversal_s: f64,
    pub release_s: Option<f64>,
}

impl From<&Reversal> for InspectedReversal {
    fn from(turn: &Reversal) -> Self {
        Self { hold_s: turn.hold_s, reversal_s: turn.reversal_s, release_s: turn.release_s }
    }
}

impl Inspection {
    /// Everything that is said of a recording with its description; `more` findings are of its folder.
    pub fn from_folder(
        recording: &Recording,
        file: Option<&RecordingFile>,
        more: Vec<QualityFinding>,
        scene: Option<&Scene>,
    ) -> Self {
        let optics = file.map_or_else(Optics::default, |file| Optics::from(&file.camera));
        let measurements = quality::measure_quality(recording, optics.exposure_s);
        Self::from_measurements(recording, file, measurements, more, scene)
    }

    /// The same of a recording that was just imported, and measured for its description.
    pub fn from_import(recording: &Recording, file: &RecordingFile) -> Self {
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
        let import: Vec<QualityFinding> = more.into_iter().chain(kept).collect();
        let findings = quality::collect_findings(recording, &measurements, &optics, &instants, &import);
        let slope = quality::measure_tilt(recording, &instants, &measurements);
        Self {
            recording: recording.name().to_owned(),
            synthetic: recording.is_synthetic(),
            grade: quality::grade_findings(&findings),
            tilt: slope.map_or_else(|reason| GlassSlope::NoTilt(reason.to_string()), GlassSlope::Tilt),
            level: file.and_then(|file| file.level.clone()),
            components: scene
                .map_or_else(published_components, scene_components)
                .check_visibility(&measurements),
            measurements,
            findings,
            reversals: instants.reversals.iter().map(InspectedReversal::from).collect(),
        }
    }

    /// Instants of the reversals, s.
    pub fn reversal_times_s(&self) -> Vec<f64> {
        self.reversals.iter().map(|turn| turn.reversal_s).collect()
    }

    /// The first line of the verdict.
    pub fn verdict_headline(&self) -> String {
        self.verdict_lines().into_iter().next().unwrap_or_default()
    }

    /// The verdict as lines for reading, worst first.
    pub fn verdict_lines(&self) -> Vec<String> {
        quality::verdict_lines(&self.measurements, &self.findings)
    }
}

/// Components to look for, before it is known what the recording makes of them.
struct SoughtComponents {
    source: String,
    named: Vec<(String, f64)>,
}

impl SoughtComponents {
    fn check_visibility(self, measurements: &Quality) -> InspectedComponents {
        let shown = self.named.into_iter().map(|(name, frequency_hz)| InspectedComponent {
            name,
            showing: measurements.component_visibility(frequency_hz),
        });
        InspectedComponents { source: self.source, shown: shown.collect() }
    }
}

fn published_components() -> SoughtComponents {
    let named = PUBLISHED_COMPONENTS_HZ.map(|(name, frequency_hz)| (name.to_owned(), frequency_hz)).to_vec();
    SoughtComponents { source: format!("published experiment, \"{PUBLISHED_TITLE}\""), named }
}

/// The head on its spring and the coupled modes of the links; a mode that does not oscillate has nothing to
/// show.
fn scene_components(scene: &Scene) -> SoughtComponents {
    let blade = &scene.linkage;
    let mut found = vec![("head on its spring".to_owned(), body_frequencies(blade).head_hz)];
    let sides: &[bool] = if blade.shoulder.is_some() { &[false, true] } else { &[false] };
    for &on_shoulder in sides {
        for (tip, word) in [(TipConstraint::Held, "tip held"), (TipConstraint::Free, "tip slides")] {
            let leaning = if on_shoulder { ", on the shoulder" } else { "" };
            let oscillating = natural_modes(blade, tip, on_shoulder)
                .into_iter()
                .filter_map(|mode| mode.damped_frequency_hz);
            found.extend(
                oscillating
                    .enumerate()
                    .map(|(i, frequency_hz)| (format!("{word}{leaning}, mode {}", i + 1), frequency_hz)),
            );
        }
    }
    found.retain(|(_, frequency_hz)| frequency_hz.is_finite() && *frequency_hz > 0.0);
    SoughtComponents { source: format!("modes of the scene \"{}\"", scene.title()), named: found }
}
