//! Spectra of several fits, grouped by channel and by the instants of their windows; the spectra of a group
//! share a panel or have a panel for each fit.

use super::{ComparisonInput, shorten_name};
use crate::compare::TargetComparison;
use crate::feature::{FeatureBand, Reading};
use crate::figures::{Drawing, FigureBlock, NO_TRACES, subtitle};
use crate::fit::job::FitTarget;
use crate::recording::Recording;
use crate::recording::channel::{Channel, InstantKind, ReversalInstants, WindowEnd};
use crate::text::{format_digits, format_trimmed, join_with_and};
use plain_charts::{ChartAxis, Colour, FULL_WIDTH_MM, Figure, Mark, Panel, Series, VerticalLine};
use short_spectra::{self as spectrum, SpectrumSettings};

const MICROMETRES: f64 = 1e6;

/// Note in the subtitle if both synthetic and other recordings are drawn.
const MIXED: &str = "some recordings are synthetic: no camera took those marked so";

/// What the windows of a group have in common: the channel, the instants at which they begin and end, and
/// their number. In each fit, windows with equal channel and instants are numbered from 0.
#[derive(Debug, Clone, Copy, PartialEq)]
struct WindowKind {
    channel: Channel,
    ends: [Option<InstantKind>; 2],
    number: usize,
}

/// A target component of a fit, as a member of a group of components to be drawn together.
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
    let drawn = groups.filter(|group| group.len() > 1).filter_map(|group| draw_figure(&group));
    let block = |(number, (figure, caption, details))| FigureBlock {
        condition: None,
        file: format!("spectra-{number}.svg"),
        caption,
        details,
        drawing: Drawing::Chart(figure),
    };
    (1..).zip(drawn).map(block).collect()
}

/// The target components of a fit. Components of one fit whose windows have the same channel, start and end
/// are numbered from 0.
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

fn window_spectrum(band: &FeatureBand, recording: &Recording) -> Option<SpectrumPoints> {
    let frames = band.window.resolve_frames(recording, &ReversalInstants::find_instants(recording)).ok()?;
    let samples = band.channel.samples(recording);
    let settings = SpectrumSettings { detrend: Some(band.detrend), ..SpectrumSettings::default() };
    let rate_hz = recording.grid().frame_rate_hz;
    let spectrum = spectrum::analyse_spectrum(samples.get(frames)?, rate_hz, &settings).ok()?;
    let bins = spectrum.frequency_hz.iter().zip(&spectrum.amplitude_m);
    Some(bins.map(|(f, a)| Some((*f, a * MICROMETRES))).collect())
}

/// Frequency, Hz, and amplitude, um.
type SpectrumPoints = Vec<Option<(f64, f64)>>;

impl<'a> SpectrumGroupMember<'a> {
    fn measured_recording(&self) -> Option<&'a Recording> {
        self.fitted.measured.get(self.aim.feature.condition).map(|m| m.recording)
    }

    fn measured_spectrum(&self) -> Option<SpectrumPoints> {
        window_spectrum(self.band, self.measured_recording()?)
    }

    fn model_spectrum(&self) -> Option<SpectrumPoints> {
        window_spectrum(self.band, &self.fitted.best.get(self.aim.feature.condition)?.view.recording)
    }

    /// Rows of the report on the component.
    fn comparisons(&self) -> impl Iterator<Item = &'a TargetComparison> {
        let (report, name) = (self.fitted.report, &self.aim.feature.name);
        report.components.iter().chain(&report.held_out).filter(move |c| c.name == *name)
    }

    /// Frequency of the model, Hz.
    fn model_hz(&self) -> Option<f64> {
        self.comparisons().find_map(|c| c.model)
    }

    fn describe(&self) -> String {
        let found = self.comparisons().next();
        let hz = |value| format!("{} Hz", format_trimmed(value, 4));
        let model = found.and_then(|c| c.model).map_or_else(|| "absent".to_owned(), hz);
        let target = found.map_or_else(String::new, |c| format!(" (target {})", hz(c.target)));
        format!(
            "`{}` of `{}`, window {}: {model}{target}",
            self.aim.feature.name, self.fitted.name, self.band.window
        )
    }
}

/// The main result with its numbers: the frequencies of the models.
fn claim_sentence(group: &[&SpectrumGroupMember], channel: &str) -> String {
    let found: Vec<String> = group.iter().filter_map(|m| Some(format_digits(m.model_hz()?, 3))).collect();
    if found.is_empty() {
        return format!("No model has the component that is sought in the {channel}");
    }
    format!("The models have {} Hz in the {channel}", join_with_and(&found))
}

fn draw_figure(group: &[&SpectrumGroupMember]) -> Option<(Figure, String, String)> {
    let channel = group.first()?.band.channel.label();
    let panels = draw_panels(group)?;
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
    let published = group.iter().any(|m| m.measured_recording().is_none());
    let lone = if published { " Fits to published numbers have no measured spectrum." } else { "" };
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

// Panels.

/// Maximum number of fits whose spectra share a panel. With their recordings, three fits give six curves;
/// more curves would hide each other.
const MOST_OVER_EACH_OTHER: usize = 3;
/// Height, mm, of a panel with the spectra of all fits.
const HEIGHT_MM: f64 = 70.0;
/// Height, mm, of a panel with the spectra of one fit.
const EACH_HEIGHT_MM: f64 = 36.0;
/// Factor by which the frequency axis extends beyond the bands of the components, at either end.
const BAND_MARGIN: f64 = 2.0;
/// Upper end of the amplitude axis, as a multiple of the highest peak.
const OVER_PEAK: f64 = 2.0;
/// Lower end of the amplitude axis, as a multiple of the highest peak.
const UNDER_PEAK: f64 = 2e-4;
/// Styles of models that share a panel.
const MODEL_LOOKS: [(Colour, Mark); MOST_OVER_EACH_OTHER] =
    [(Colour::Vermilion, Mark::Line), (Colour::Blue, Mark::Dashed), (Colour::Green, Mark::Dotted)];

/// The panels of a group; `None` if it has no spectrum.
fn draw_panels(group: &[&SpectrumGroupMember]) -> Option<Vec<Panel>> {
    let panels = if group.len() > MOST_OVER_EACH_OTHER {
        group.iter().map(|m| draw_fit_panel(m)).collect()
    } else {
        vec![draw_overlay_panel(group)]
    };
    let panels: Vec<Panel> = panels.into_iter().filter(|panel| !panel.series.is_empty()).collect();
    let (x, y) = common_axes(group, &panels)?;
    Some(panels.into_iter().map(|panel| Panel { x: x.clone(), y: y.clone(), ..panel }).collect())
}

/// The axes that all panels share.
fn common_axes(group: &[&SpectrumGroupMember], panels: &[Panel]) -> Option<(ChartAxis, ChartAxis)> {
    let bands = || group.iter().map(|m| m.band.band_hz);
    let low = bands().fold(f64::INFINITY, |l, b| l.min(b.0)) / BAND_MARGIN;
    let high = bands().fold(0.0, |h: f64, b| h.max(b.1)) * BAND_MARGIN;
    let points = || panels.iter().flat_map(|p| &p.series).flat_map(|s| s.points.iter().flatten());
    let shown = points().filter(|(f, a)| *f >= low && *f <= high && a.is_finite());
    let peak = shown.map(|(_, a)| *a).fold(0.0, f64::max);
    let last_hz = points().map(|(f, _)| *f).fold(low, f64::max);
    let x = ChartAxis::log("frequency, Hz").with_range(low, high.min(last_hz));
    (peak > 0.0)
        .then(|| (x, ChartAxis::log("amplitude, \u{b5}m").with_range(peak * UNDER_PEAK, peak * OVER_PEAK)))
}

fn spectrum_line(label: String, (colour, mark): (Colour, Mark), points: SpectrumPoints) -> Series {
    Series { label, colour, mark, points, error_bars: Vec::new() }
}

fn target_line(member: &SpectrumGroupMember, colour: Colour) -> Option<VerticalLine> {
    let at = member.comparisons().next()?.target;
    Some(VerticalLine {
        label: format!("{} Hz", format_trimmed(at, 4)),
        colour,
        mark: Mark::ThinDashed,
        at,
        above: None,
    })
}

/// The panel of one fit, with the curve of the model drawn under that of the recording.
fn draw_fit_panel(member: &SpectrumGroupMember) -> Panel {
    let synthetic = member.measured_recording().is_some_and(Recording::is_synthetic);
    let what = if synthetic { "synthetic recording" } else { "recording" };
    let line = |label: &str, look, points| spectrum_line(label.to_owned(), look, points);
    let model = member.model_spectrum().map(|points| line("model", (Colour::Vermilion, Mark::Thick), points));
    let measured = member.measured_spectrum().map(|points| line(what, (Colour::Black, Mark::Thin), points));
    Panel {
        title: shorten_name(member.fitted.name),
        height_mm: EACH_HEIGHT_MM,
        series: model.into_iter().chain(measured).collect(),
        vertical_lines: target_line(member, Colour::Blue).into_iter().collect(),
        ..Panel::default()
    }
}

fn draw_overlay_panel(group: &[&SpectrumGroupMember]) -> Panel {
    let looking = || group.iter().zip(MODEL_LOOKS);
    let models = looking().filter_map(|(m, look)| {
        Some(spectrum_line(format!("model, {}", shorten_name(m.fitted.name)), look, m.model_spectrum()?))
    });
    let mut rules: Vec<VerticalLine> = Vec::new();
    for rule in looking().filter_map(|(m, (colour, _))| target_line(m, colour)) {
        // targets with equal labels share one line
        if rules.iter().all(|known| known.label != rule.label) {
            rules.push(rule);
        }
    }
    Panel {
        height_mm: HEIGHT_MM,
        series: measured_series(group).into_iter().chain(models).collect(),
        vertical_lines: rules,
        ..Panel::default()
    }
}

/// The measured spectra; fits with the same recording and window share one curve.
fn measured_series(group: &[&SpectrumGroupMember]) -> Vec<Series> {
    let mut drawn: Vec<(&Recording, &SpectrumGroupMember)> = Vec::new();
    for (recording, member) in group.iter().filter_map(|m| Some((m.measured_recording()?, *m))) {
        let known = |(r, m): &(&Recording, &SpectrumGroupMember)| {
            *r == recording && m.band.window == member.band.window && m.band.detrend == member.band.detrend
        };
        if !drawn.iter().any(known) {
            drawn.push((recording, member));
        }
    }
    let series = |(i, (recording, member)): (usize, &(&Recording, &SpectrumGroupMember))| {
        let look = if i % 2 == 0 { (Colour::Black, Mark::Thin) } else { (Colour::Grey, Mark::ThinDashed) };
        let what = if recording.is_synthetic() { "synthetic" } else { "measured" };
        let label = format!("{what}, {}", shorten_name(recording.name()));
        Some(spectrum_line(label, look, member.measured_spectrum()?))
    };
    drawn.iter().enumerate().filter_map(series).collect()
}
