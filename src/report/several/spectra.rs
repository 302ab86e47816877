//! Spectra of several fits: those of a channel in windows that begin and end at the same instants, over each
//! other or in a panel each.

mod panels;

use super::fitted::ComparisonInput;
use crate::chart::{FULL_WIDTH_MM, Figure};
use crate::feature::{FeatureBand, Reading};
use crate::figures::{Drawing, FigureBlock, NO_TRACES, subtitle};
use crate::fit::job::FitTarget;
use crate::recording::Recording;
use crate::recording::channel::{Channel, InstantKind, ReversalInstants, WindowEnd};
use crate::spectrum::{self, Spectrum, SpectrumSettings};
use crate::text::{format_digits, format_trimmed, join_with_and};

const MICROMETRES: f64 = 1e6;

/// What stands under the heading where recordings of both kinds are drawn.
const MIXED: &str = "some recordings are synthetic: no camera took those marked so";

/// What the windows of a group have in common: the channel, at which instants they begin and end, and which
/// one of its fit each is.
#[derive(Debug, Clone, Copy, PartialEq)]
struct WindowKind {
    channel: Channel,
    ends: [Option<InstantKind>; 2],
    number: usize,
}

/// The component of a fit in a group.
struct SpectrumGroupMember<'a> {
    fitted: &'a ComparisonInput<'a>,
    aim: &'a FitTarget,
    band: &'a FeatureBand,
    kind: WindowKind,
}

/// A figure for every kind of window that at least two fits have.
pub(super) fn spectra_figures(fits: &[ComparisonInput]) -> Vec<FigureBlock> {
    let members: Vec<SpectrumGroupMember> = fits.iter().flat_map(group_members).collect();
    let mut kinds: Vec<WindowKind> = Vec::new();
    for member in &members {
        if !kinds.contains(&member.kind) {
            kinds.push(member.kind);
        }
    }
    let groups = kinds.into_iter().map(|kind| members.iter().filter(|m| m.kind == kind).collect::<Vec<_>>());
    groups
        .filter(|group| group.len() > 1)
        .filter_map(|group| draw_figure(&group))
        .enumerate()
        .map(|(i, f)| figure_block(i, f))
        .collect()
}

fn figure_block(index: usize, (figure, caption, details): (Figure, String, String)) -> FigureBlock {
    FigureBlock {
        condition: None,
        file: format!("spectra-{}.svg", index + 1),
        caption,
        details,
        drawing: Drawing::Chart(figure),
    }
}

/// The components of a fit; several windows of a kind are distinguished by their order.
fn group_members<'a>(fitted: &'a ComparisonInput<'a>) -> Vec<SpectrumGroupMember<'a>> {
    let anchor = |end: WindowEnd| if let WindowEnd::Found { anchor, .. } = end { Some(anchor) } else { None };
    let mut found: Vec<SpectrumGroupMember> = Vec::new();
    for aim in &fitted.job.targets {
        let Reading::Frequency(band) = &aim.feature.reading else { continue };
        let kind = WindowKind {
            channel: band.channel,
            ends: [anchor(band.window.from), anchor(band.window.to)],
            number: 0,
        };
        let number = found.iter().filter(|m| m.kind == WindowKind { number: m.kind.number, ..kind }).count();
        found.push(SpectrumGroupMember { fitted, aim, band, kind: WindowKind { number, ..kind } });
    }
    found
}

fn window_spectrum(band: &FeatureBand, recording: &Recording) -> Option<Spectrum> {
    let frames = band.window.resolve_frames(recording, &ReversalInstants::find_instants(recording)).ok()?;
    let samples = band.channel.samples(recording);
    spectrum::analyse_spectrum(
        samples.get(frames)?,
        recording.grid().frame_rate_hz,
        &SpectrumSettings { detrend: Some(band.detrend), ..SpectrumSettings::default() },
    )
    .ok()
}

/// Amplitude, um, over frequency, Hz.
type SpectrumPoints = Vec<Option<(f64, f64)>>;

fn spectrum_points(spectrum: &Spectrum) -> SpectrumPoints {
    spectrum
        .frequency_hz
        .iter()
        .zip(&spectrum.amplitude_m)
        .map(|(f, a)| Some((*f, a * MICROMETRES)))
        .collect()
}

impl<'a> SpectrumGroupMember<'a> {
    fn measured_recording(&self) -> Option<&'a Recording> {
        self.fitted.measured.get(self.aim.feature.condition).map(|m| m.recording)
    }

    fn measured_spectrum(&self) -> Option<SpectrumPoints> {
        Some(spectrum_points(&window_spectrum(self.band, self.measured_recording()?)?))
    }

    fn model_spectrum(&self) -> Option<SpectrumPoints> {
        Some(spectrum_points(&window_spectrum(
            self.band,
            &self.fitted.best.get(self.aim.feature.condition)?.view.recording,
        )?))
    }

    /// Target, or what was measured in its place.
    fn target_hz(&self) -> Option<f64> {
        self.fitted
            .report
            .components
            .iter()
            .chain(&self.fitted.report.held_out)
            .find(|c| c.name == self.aim.feature.name)
            .map(|c| c.target)
    }

    /// Frequency of the model, Hz.
    fn model_hz(&self) -> Option<f64> {
        let report = &self.fitted.report;
        let all = report.components.iter().chain(&report.held_out);
        all.filter(|c| c.name == self.aim.feature.name).find_map(|c| c.model)
    }

    fn describe(&self) -> String {
        let found = self
            .fitted
            .report
            .components
            .iter()
            .chain(&self.fitted.report.held_out)
            .find(|c| c.name == self.aim.feature.name);
        let model = found
            .and_then(|c| c.model)
            .map_or_else(|| "absent".to_owned(), |hz| format!("{} Hz", format_trimmed(hz, 4)));
        let target =
            found.map_or_else(String::new, |c| format!(" (target {} Hz)", format_trimmed(c.target, 4)));
        format!(
            "`{}` of `{}`, window {}: {model}{target}",
            self.aim.feature.name, self.fitted.name, self.band.window
        )
    }
}

/// The claim with its numbers: the frequencies of the models.
fn claim_sentence(group: &[&SpectrumGroupMember], channel: &str) -> String {
    let found: Vec<String> = group.iter().filter_map(|m| Some(format_digits(m.model_hz()?, 3))).collect();
    if found.is_empty() {
        return format!("No model has the component that is sought in the {channel}");
    }
    format!("The models have {} Hz in the {channel}", join_with_and(&found))
}

fn draw_figure(group: &[&SpectrumGroupMember]) -> Option<(Figure, String, String)> {
    let channel = group.first()?.band.channel.label();
    let panels = panels::draw_panels(group)?;
    let a_panel_each = if panels.len() > 1 { " A panel a fit, in the same axes." } else { "" };
    let recordings = || group.iter().filter_map(|m| m.measured_recording());
    let (synthetic, films) =
        (recordings().any(Recording::is_synthetic), recordings().any(|r| !r.is_synthetic()));
    let figure = Figure {
        title: claim_sentence(group, &channel),
        subtitle: match (synthetic, films) {
            (true, true) => MIXED.to_owned(),
            (false, false) => NO_TRACES.to_owned(),
            _ => subtitle(synthetic, ""),
        },
        watermarked: synthetic,
        description: format!("Amplitude spectra of the {channel} of several fits."),
        width_mm: FULL_WIDTH_MM,
        columns: 2,
        panels,
    };
    let says: Vec<String> = group.iter().map(|m| m.describe()).collect();
    let lone = if group.iter().any(|m| m.measured_recording().is_none()) {
        " Fits to published numbers have no measured spectrum."
    } else {
        ""
    };
    let caption = format!(
        "Amplitude spectra of the {channel} in {} fits; vertical lines mark the targets.{a_panel_each}",
        group.len()
    );
    let details = format!(
        "Components of the models: {}. Windows of different lengths resolve differently: peaks of the same \
         oscillation agree in place and height, not in width.{lone}",
        says.join("; ")
    );
    Some((figure, caption, details))
}
