//! The panels: the spectra of a few fits over each other, those of more in a panel each.

use super::{SpectrumGroupMember, SpectrumPoints};
use crate::chart::{ChartAxis, Colour, Mark, Panel, Series, VerticalLine};
use crate::recording::Recording;
use crate::report::several::fitted::shorten_name;
use crate::text::format_trimmed;

/// Most fits whose spectra lie over each other: with as many recordings they make six lines, and of more the
/// last would hide the others.
const MOST_OVER_EACH_OTHER: usize = 3;
/// Heights, mm: of all spectra in one panel, and of those of one fit.
const HEIGHT_MM: f64 = 70.0;
const EACH_HEIGHT_MM: f64 = 36.0;
/// The axes reach this factor beyond the bands in which components are sought, this one over the highest peak
/// and this one below it.
const BAND_MARGIN: f64 = 2.0;
const OVER_PEAK: f64 = 2.0;
const UNDER_PEAK: f64 = 2e-4;
/// Looks of models that lie over each other.
const MODEL_LOOKS: [(Colour, Mark); MOST_OVER_EACH_OTHER] =
    [(Colour::Vermilion, Mark::Line), (Colour::Blue, Mark::Dashed), (Colour::Green, Mark::Dotted)];

/// What the panels of a group show; `None` where none of it has a spectrum.
pub(super) fn draw_panels(group: &[&SpectrumGroupMember]) -> Option<Vec<Panel>> {
    let panels = if group.len() > MOST_OVER_EACH_OTHER {
        group.iter().map(|m| draw_fit_panel(m)).collect()
    } else {
        vec![draw_overlay_panel(group)]
    };
    let panels: Vec<Panel> = panels.into_iter().filter(|panel| !panel.series.is_empty()).collect();
    let (x, y) = common_axes(group, &panels)?;
    Some(panels.into_iter().map(|panel| Panel { x: x.clone(), y: y.clone(), ..panel }).collect())
}

/// The axes that all have in common.
fn common_axes(group: &[&SpectrumGroupMember], panels: &[Panel]) -> Option<(ChartAxis, ChartAxis)> {
    let bands = || group.iter().map(|m| m.band.band_hz);
    let (low, high) = (
        bands().fold(f64::INFINITY, |l, b| l.min(b.0)) / BAND_MARGIN,
        bands().fold(0.0, |h: f64, b| h.max(b.1)) * BAND_MARGIN,
    );
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
    let at = member.target_hz()?;
    Some(VerticalLine {
        label: format!("{} Hz", format_trimmed(at, 4)),
        colour,
        mark: Mark::ThinDashed,
        at,
        above: None,
    })
}

/// One fit: its model under its recording.
fn draw_fit_panel(member: &SpectrumGroupMember) -> Panel {
    let what = if member.measured_recording().is_some_and(Recording::is_synthetic) {
        "synthetic recording"
    } else {
        "recording"
    };
    let model = member
        .model_spectrum()
        .map(|points| spectrum_line("model".to_owned(), (Colour::Vermilion, Mark::Thick), points));
    let measured = member
        .measured_spectrum()
        .map(|points| spectrum_line(what.to_owned(), (Colour::Black, Mark::Thin), points));
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
        // several that are written alike are one line
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

/// The measured spectra, one a recording and window however many fits share it.
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
        Some(spectrum_line(
            format!("{what}, {}", shorten_name(recording.name())),
            look,
            member.measured_spectrum()?,
        ))
    };
    drawn.iter().enumerate().filter_map(series).collect()
}
