//! The panels: the spectra of a few fits over each other, those of more in a panel each.

use super::{Member, Points};
use crate::chart::{Axis, Colour, Mark, Panel, Rule, Series};
use crate::recording::Recording;
use crate::report::several::fitted::short;
use crate::text::trimmed;

/// Most fits whose spectra lie over each other: with as many recordings they make six lines, and of more the
/// last would hide the others.
const MOST_OVER_EACH_OTHER: usize = 3;
/// Heights, mm: of all spectra in one panel, and of those of one fit.
const HEIGHT_MM: f64 = 70.0;
const EACH_HEIGHT_MM: f64 = 36.0;
/// The axes reach this factor beyond the bands in which components are sought, this one over the highest peak
/// and this one below it.
const BEYOND: f64 = 2.0;
const OVER_PEAK: f64 = 2.0;
const UNDER_PEAK: f64 = 2e-4;
/// Looks of models that lie over each other.
const LOOKS: [(Colour, Mark); MOST_OVER_EACH_OTHER] =
    [(Colour::Vermilion, Mark::Line), (Colour::Blue, Mark::Dashed), (Colour::Green, Mark::Dotted)];

/// What the panels of a group show; `None` where none of it has a spectrum.
pub(super) fn of(group: &[&Member]) -> Option<Vec<Panel>> {
    let panels = if group.len() > MOST_OVER_EACH_OTHER {
        group.iter().map(|m| of_one(m)).collect()
    } else {
        vec![over_each_other(group)]
    };
    let panels: Vec<Panel> = panels.into_iter().filter(|panel| !panel.series.is_empty()).collect();
    let (x, y) = axes(group, &panels)?;
    Some(panels.into_iter().map(|panel| Panel { x: x.clone(), y: y.clone(), ..panel }).collect())
}

/// The axes that all have in common.
fn axes(group: &[&Member], panels: &[Panel]) -> Option<(Axis, Axis)> {
    let bands = || group.iter().map(|m| m.band.band_hz);
    let (low, high) = (
        bands().fold(f64::INFINITY, |l, b| l.min(b.0)) / BEYOND,
        bands().fold(0.0, |h: f64, b| h.max(b.1)) * BEYOND,
    );
    let points = || panels.iter().flat_map(|p| &p.series).flat_map(|s| s.points.iter().flatten());
    let shown = points().filter(|(f, a)| *f >= low && *f <= high && a.is_finite());
    let peak = shown.map(|(_, a)| *a).fold(0.0, f64::max);
    let last_hz = points().map(|(f, _)| *f).fold(low, f64::max);
    let x = Axis::log("frequency, Hz").between(low, high.min(last_hz));
    (peak > 0.0).then(|| (x, Axis::log("amplitude, \u{b5}m").between(peak * UNDER_PEAK, peak * OVER_PEAK)))
}

fn line(label: String, (colour, mark): (Colour, Mark), points: Points) -> Series {
    Series { label, colour, mark, points, bars: Vec::new() }
}

fn target(member: &Member, colour: Colour) -> Option<Rule> {
    let at = member.target_hz()?;
    Some(Rule { label: format!("{} Hz", trimmed(at, 4)), colour, mark: Mark::ThinDashed, at, above: None })
}

/// One fit: its model under its recording.
fn of_one(member: &Member) -> Panel {
    let what = if member.measured().is_some_and(Recording::is_synthetic) {
        "synthetic recording"
    } else {
        "recording"
    };
    let model = member
        .model_spectrum()
        .map(|points| line("model".to_owned(), (Colour::Vermilion, Mark::Thick), points));
    let measured =
        member.measured_spectrum().map(|points| line(what.to_owned(), (Colour::Black, Mark::Thin), points));
    Panel {
        title: short(member.fitted.name),
        height_mm: EACH_HEIGHT_MM,
        series: model.into_iter().chain(measured).collect(),
        rules: target(member, Colour::Blue).into_iter().collect(),
        ..Panel::default()
    }
}

fn over_each_other(group: &[&Member]) -> Panel {
    let looking = || group.iter().zip(LOOKS);
    let models = looking().filter_map(|(m, look)| {
        Some(line(format!("model, {}", short(m.fitted.name)), look, m.model_spectrum()?))
    });
    let mut rules: Vec<Rule> = Vec::new();
    for rule in looking().filter_map(|(m, (colour, _))| target(m, colour)) {
        // several that are written alike are one line
        if rules.iter().all(|known| known.label != rule.label) {
            rules.push(rule);
        }
    }
    Panel {
        height_mm: HEIGHT_MM,
        series: measured(group).into_iter().chain(models).collect(),
        rules,
        ..Panel::default()
    }
}

/// The measured spectra, one a recording and window however many fits share it.
fn measured(group: &[&Member]) -> Vec<Series> {
    let mut drawn: Vec<(&Recording, &Member)> = Vec::new();
    for (recording, member) in group.iter().filter_map(|m| Some((m.measured()?, *m))) {
        let known = |(r, m): &(&Recording, &Member)| {
            *r == recording && m.band.window == member.band.window && m.band.detrend == member.band.detrend
        };
        if !drawn.iter().any(known) {
            drawn.push((recording, member));
        }
    }
    let series = |(i, (recording, member)): (usize, &(&Recording, &Member))| {
        let look = if i % 2 == 0 { (Colour::Black, Mark::Thin) } else { (Colour::Grey, Mark::ThinDashed) };
        let what = if recording.is_synthetic() { "synthetic" } else { "measured" };
        Some(line(format!("{what}, {}", short(recording.name())), look, member.measured_spectrum()?))
    };
    drawn.iter().enumerate().filter_map(series).collect()
}
