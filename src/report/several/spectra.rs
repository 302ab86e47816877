//! Spectra of several fits over each other: those of a channel in windows that begin and end at the same instants.

use super::{Fitted, short};
use crate::fit::features::{Band, Reading};
use crate::fit::job::Aim;
use crate::recording::Recording;
use crate::recording::channel::{Anchor, Channel, Instants, WindowEnd};
use crate::report::chart::{Axis, Colour, FULL_WIDTH_MM, Figure, Mark, Panel, Rule, Series};
use crate::report::concise::four_digits;
use crate::report::{Drawing, FigureBlock, NO_TRACES, subtitle};
use crate::spectrum::{self, Settings, Spectrum};

const HEIGHT_MM: f64 = 70.0;
const MICROMETRES: f64 = 1e6;
/// The axes reach this factor beyond the bands in which components are sought, this one over the highest peak and this one below it.
const BEYOND: f64 = 2.0;
const OVER_PEAK: f64 = 2.0;
const UNDER_PEAK: f64 = 2e-4;
/// Looks of the models: no two of so many fits alike in both.
const COLOURS: [Colour; 6] = [Colour::Vermilion, Colour::Blue, Colour::Green, Colour::Purple, Colour::Orange, Colour::SkyBlue];
const MARKS: [Mark; 3] = [Mark::Line, Mark::Dashed, Mark::Dotted];

/// What stands under the heading where recordings of both kinds are drawn.
const MIXED: &str = "some recordings are synthetic: no camera took those called so";

/// What the windows of a group have in common: the channel, at which instants they begin and end, and which one of its fit each is.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Kind {
    channel: Channel,
    ends: [Option<Anchor>; 2],
    number: usize,
}

/// The component of a fit in a group.
struct Member<'a> {
    fit: usize,
    fitted: &'a Fitted<'a>,
    aim: &'a Aim,
    band: &'a Band,
    kind: Kind,
}

/// A figure for every kind of window that at least two fits have.
pub(super) fn figures(fits: &[Fitted]) -> Vec<FigureBlock> {
    let members: Vec<Member> = fits.iter().enumerate().flat_map(|(fit, fitted)| members(fit, fitted)).collect();
    let mut kinds: Vec<Kind> = Vec::new();
    for member in &members {
        if !kinds.contains(&member.kind) {
            kinds.push(member.kind);
        }
    }
    let groups = kinds.into_iter().map(|kind| members.iter().filter(|m| m.kind == kind).collect::<Vec<_>>());
    groups.filter(|group| group.len() > 1).filter_map(|group| figure(&group)).enumerate().map(|(i, f)| block(i, f)).collect()
}

fn block(index: usize, (figure, caption): (Figure, String)) -> FigureBlock {
    FigureBlock { file: format!("spectra-{}.svg", index + 1), caption, drawing: Drawing::Chart(figure) }
}

/// The components of a fit; several windows of a kind are told apart by their order.
fn members<'a>(fit: usize, fitted: &'a Fitted<'a>) -> Vec<Member<'a>> {
    let anchor = |end: WindowEnd| if let WindowEnd::Found { anchor, .. } = end { Some(anchor) } else { None };
    let mut found: Vec<Member> = Vec::new();
    for aim in &fitted.job.aims {
        let Reading::Frequency(band) = &aim.feature.reading else { continue };
        let kind = Kind { channel: band.channel, ends: [anchor(band.window.from), anchor(band.window.to)], number: 0 };
        let number = found.iter().filter(|m| m.kind == Kind { number: m.kind.number, ..kind }).count();
        found.push(Member { fit, fitted, aim, band, kind: Kind { number, ..kind } });
    }
    found
}

fn analysed(band: &Band, recording: &Recording) -> Option<Spectrum> {
    let frames = band.window.resolve(recording, &Instants::find(recording)).ok()?;
    let samples = band.channel.samples(recording);
    spectrum::analyse(samples.get(frames)?, recording.grid().frame_rate_hz, &Settings { detrend: Some(band.detrend), ..Settings::default() }).ok()
}

fn points(spectrum: &Spectrum) -> Vec<Option<(f64, f64)>> {
    spectrum.frequency_hz.iter().zip(&spectrum.amplitude_m).map(|(f, a)| Some((*f, a * MICROMETRES))).collect()
}

impl<'a> Member<'a> {
    fn measured(&self) -> Option<&'a Recording> {
        self.fitted.measured.get(self.aim.feature.condition).map(|m| m.recording)
    }

    fn model(&self) -> Option<Series> {
        let spectrum = analysed(self.band, &self.fitted.best.get(self.aim.feature.condition)?.view.recording)?;
        let (colour, mark) = (self.colour(), MARKS.get(self.fit % MARKS.len()).copied().unwrap_or_default());
        Some(Series { label: format!("model, {}", short(self.fitted.name)), colour, mark, points: points(&spectrum), bars: Vec::new() })
    }

    fn colour(&self) -> Colour {
        // six colours and three dashes: the dash moves on by one with every round of colours
        COLOURS.get((self.fit + self.fit / COLOURS.len()) % COLOURS.len()).copied().unwrap_or_default()
    }

    /// Target, or what was measured in its place.
    fn target_hz(&self) -> Option<f64> {
        self.fitted.report.components.iter().chain(&self.fitted.report.held_out).find(|c| c.name == self.aim.feature.name).map(|c| c.target)
    }

    fn says(&self) -> String {
        let found = self.fitted.report.components.iter().chain(&self.fitted.report.held_out).find(|c| c.name == self.aim.feature.name);
        let model = found.and_then(|c| c.model).map_or_else(|| "not seen".to_owned(), |hz| format!("{} Hz", four_digits(hz)));
        let target = found.map_or_else(String::new, |c| format!(" (target {} Hz)", four_digits(c.target)));
        format!("`{}` of `{}`, window {}: {model}{target}", self.aim.feature.name, self.fitted.name, self.band.window)
    }
}

/// The measured spectra, one a recording and window however many fits share it.
fn measured(group: &[&Member]) -> Vec<Series> {
    let mut drawn: Vec<(&Recording, &Band)> = Vec::new();
    for (recording, band) in group.iter().filter_map(|m| Some((m.measured()?, m.band))) {
        if !drawn.iter().any(|(r, b)| *r == recording && b.window == band.window && b.detrend == band.detrend) {
            drawn.push((recording, band));
        }
    }
    let series = |(i, (recording, band)): (usize, &(&Recording, &Band))| {
        let (colour, mark) = if i % 2 == 0 { (Colour::Black, Mark::Thin) } else { (Colour::Grey, Mark::ThinDashed) };
        let what = if recording.is_synthetic() { "synthetic" } else { "measured" };
        Some(Series { label: format!("{what}, {}", short(recording.name())), colour, mark, points: points(&analysed(band, recording)?), bars: Vec::new() })
    };
    drawn.iter().enumerate().filter_map(series).collect()
}

/// The targets; several that are written alike are one line.
fn targets(group: &[&Member]) -> Vec<Rule> {
    let mut rules: Vec<Rule> = Vec::new();
    for (member, at) in group.iter().filter_map(|m| Some((m, m.target_hz()?))) {
        let label = format!("{} Hz", four_digits(at));
        if rules.iter().all(|rule| rule.label != label) {
            rules.push(Rule { label, colour: member.colour(), mark: Mark::ThinDashed, at, above: None });
        }
    }
    rules
}

fn figure(group: &[&Member]) -> Option<(Figure, String)> {
    let channel = group.first()?.band.channel.name().replace('-', " ");
    let bands = || group.iter().map(|m| m.band.band_hz);
    let (low, high) = (bands().fold(f64::INFINITY, |l, b| l.min(b.0)) / BEYOND, bands().fold(0.0, |h: f64, b| h.max(b.1)) * BEYOND);
    let series: Vec<Series> = measured(group).into_iter().chain(group.iter().filter_map(|m| m.model())).collect();
    let shown = series.iter().flat_map(|s| s.points.iter().flatten()).filter(|(f, _)| *f >= low && *f <= high);
    let peak = shown.map(|(_, a)| *a).filter(|a| a.is_finite()).fold(0.0, f64::max);
    let last_hz = series.iter().flat_map(|s| s.points.iter().flatten()).map(|(f, _)| *f).fold(low, f64::max);
    if series.is_empty() || peak <= 0.0 {
        return None;
    }
    let panel = Panel {
        x: Axis::log("frequency, Hz").between(low, high.min(last_hz)),
        y: Axis::log("amplitude, \u{b5}m").between(peak * UNDER_PEAK, peak * OVER_PEAK),
        height_mm: HEIGHT_MM,
        series,
        rules: targets(group),
        ..Panel::default()
    };
    let recordings = || group.iter().filter_map(|m| m.measured());
    let (synthetic, films) = (recordings().any(Recording::is_synthetic), recordings().any(|r| !r.is_synthetic()));
    let figure = Figure {
        title: format!("Spectra of the {channel}"),
        subtitle: match (synthetic, films) {
            (true, true) => MIXED.to_owned(),
            (false, false) => NO_TRACES.to_owned(),
            _ => subtitle(synthetic, ""),
        },
        description: format!("Amplitude spectra of the {channel} of several fits."),
        width_mm: FULL_WIDTH_MM,
        panels: vec![panel],
        ..Figure::default()
    };
    let says: Vec<String> = group.iter().map(|m| m.says()).collect();
    let lone = if group.iter().any(|m| m.measured().is_none()) { " Fits to published numbers have no measured spectrum." } else { "" };
    let caption = format!(
        "Amplitude spectra of the {channel}; targets are marked by lines. The models\u{2019} components: {}. Windows of different lengths resolve differently: peaks of the \
         same oscillation agree in place and height, not in width.{lone}",
        says.join("; ")
    );
    Some((figure, caption))
}
