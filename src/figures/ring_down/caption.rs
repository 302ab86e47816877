//! The window of the low component taken apart: what is fitted to it, what is left, and the component alone.

use crate::compare::Case;
use crate::compare::windows::{FitWindow, sought};
use crate::feature::Reading;
use crate::figures::analysis::AnalysedWindow;
use crate::figures::{FigureBlock, Words, subtitle};
use crate::spectrum::{Analysis, Component, LONGEST_FITTED};
use crate::text::{digits, length, with_sd};

/// The window that is taken apart, by its place among all, and the lowest frequency in it, Hz; none where the
/// job seeks no frequency.
pub(crate) fn lowest(case: &Case, all: &[FitWindow]) -> Option<(usize, f64)> {
    let frequency = |l: &FitWindow| {
        let aims = l
            .aims
            .iter()
            .filter(|aim| matches!(aim.feature.reading, Reading::Frequency(_) | Reading::DampingRatio(_)));
        let lowest = |hz: Vec<f64>| hz.into_iter().reduce(f64::min);
        lowest(aims.filter_map(|aim| sought(aim, case.result)).map(|m| m.target.frequency_hz).collect())
    };
    all.iter()
        .enumerate()
        .filter_map(|(i, window)| Some((i, frequency(window)?)))
        .min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Noise that the component nearest to the target exceeds where it is drawn, standard deviations.
const LEAST_OVER_NOISE: f64 = 2.0;

/// The figure of the window's analysis; none for a record too long to be taken apart, or where the component
/// nearest to the target does not exceed twice the noise.
pub(crate) fn block(
    case: &Case,
    window: &FitWindow,
    analysis: &Analysis,
    target_hz: f64,
) -> Option<FigureBlock> {
    let side = case.shown();
    let least_m = case.noise_m(window.channel).map_or(0.0, |noise_m| LEAST_OVER_NOISE * noise_m);
    let component = nearest(analysis, target_hz).filter(|found| found.amplitude_m > least_m)?;
    let frames = side.frames(&window.window).filter(|frames| frames.len() <= LONGEST_FITTED)?;
    let frames = frames.start + analysis.left_out..frames.end;
    let shown = AnalysedWindow {
        recording: side.recording,
        channel: window.channel,
        frames,
        analysis,
        note: format!("window {}", window.window),
    };
    let mut figure = super::figure(&shown.ring_down());
    figure.title = super::title(&window.channel.label(), component);
    let note = format!("{} taken apart; {}", window.channel.label(), shown.note);
    figure.subtitle = subtitle(figure.synthetic, &note);
    if case.recording().is_none() {
        figure.subtitle = case.note(&note);
        // what is taken apart is no recording and has no noise
        figure.panels.iter_mut().for_each(|panel| panel.ribbons.clear());
        figure
            .panels
            .iter_mut()
            .flat_map(|panel| &mut panel.series)
            .filter(|s| s.label == "data")
            .for_each(|s| s.label = "model".to_owned());
    }
    Some(case.block("ring-down", words(case, window, analysis, component), figure))
}

fn words(case: &Case, window: &FitWindow, analysis: &Analysis, component: &Component) -> Words {
    let mut said = vec![format!(
        "The {} in the window {} of {}: trend ({}) and {} fitted by least squares, and what they leave.",
        window.channel.label(),
        window.window,
        case.source(),
        analysis.removed,
        counted(analysis.oscillations.len()),
    )];
    said.push(of_component(component));
    let fitted = counted(analysis.oscillations.len());
    let mut caption = format!("The {} taken apart into a trend and {fitted}", window.channel.label());
    let left: Vec<f64> = analysis.left_m.iter().flatten().map(|x| x * x).collect();
    if !left.is_empty() {
        let rms_m = (left.iter().sum::<f64>() / left.len() as f64).sqrt();
        let noise = case.noise_m(window.channel);
        let over_noise = noise.map_or_else(String::new, |m| {
            format!(", {} times the tracking noise of {}", digits(rms_m / m, 2), length(m))
        });
        caption += &format!(", which leave {} (root mean square){over_noise}", length(rms_m));
        said.push(format!("What is left has a root mean square of {}{over_noise}.", length(rms_m)));
    }
    Words { caption: caption + ".", details: said.join(" ") }
}

/// The component nearest to a frequency, Hz.
fn nearest(analysis: &Analysis, target_hz: f64) -> Option<&Component> {
    let off = |c: &&Component| (c.frequency_hz - target_hz).abs();
    analysis.spectrum.components.iter().min_by(|a, b| off(a).total_cmp(&off(b)))
}

fn counted(oscillations: usize) -> String {
    match oscillations {
        0 => "no oscillation".to_owned(),
        1 => "one oscillation".to_owned(),
        n => format!("{n} oscillations"),
    }
}

/// Frequency, damping and what is said against them.
fn of_component(component: &Component) -> String {
    let frequency = with_sd(component.frequency_hz, component.frequency_sd_hz);
    const KNOWN: f64 = 2.0;
    let damping = match component.damping_ratio.zip(component.damping_ratio_sd) {
        Some((ratio, sd)) if ratio.abs() < KNOWN * sd => {
            format!(", whose damping ratio, {}, may be zero", with_sd(ratio, sd))
        }
        Some((ratio, sd)) if ratio > 0.0 => {
            format!(", which decays with a damping ratio of {}", with_sd(ratio, sd))
        }
        Some((ratio, sd)) => format!(", which grows with a damping ratio of {}", with_sd(ratio, sd)),
        None => String::new(),
    };
    let against: Vec<&str> = component.reasons.iter().map(|r| r.words.as_str()).collect();
    let against =
        if against.is_empty() { String::new() } else { format!("; against it: {}", against.join("; ")) };
    format!("The component nearest to the target has {frequency} Hz{damping}{against}.")
}
