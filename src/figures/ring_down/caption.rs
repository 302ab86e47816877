//! The window of the low component taken apart: what is fitted to it, what is left, and the component alone.

use crate::compare::ConditionComparison;
use crate::compare::windows::{FitWindow, compare_frequency};
use crate::feature::Reading;
use crate::figures::analysis::AnalysedWindow;
use crate::figures::{FigureBlock, Words, subtitle};
use crate::spectrum::{Component, LONGEST_DECOMPOSED, SpectralAnalysis};
use crate::text::{format_digits, format_length, format_with_sd};

/// The window that is taken apart, by its place among all, and the lowest frequency in it, Hz; none where the
/// job seeks no frequency.
pub(crate) fn lowest_window(case: &ConditionComparison, all: &[FitWindow]) -> Option<(usize, f64)> {
    let frequency = |l: &FitWindow| {
        let aims = l
            .targets
            .iter()
            .filter(|aim| matches!(aim.feature.reading, Reading::Frequency(_) | Reading::DampingRatio(_)));
        let lowest = |hz: Vec<f64>| hz.into_iter().reduce(f64::min);
        lowest(
            aims.filter_map(|aim| compare_frequency(aim, case.result))
                .map(|m| m.target.frequency_hz)
                .collect(),
        )
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
pub(crate) fn figure_block(
    case: &ConditionComparison,
    window: &FitWindow,
    analysis: &SpectralAnalysis,
    target_hz: f64,
) -> Option<FigureBlock> {
    let side = case.measured_or_model();
    let least_m = case.noise_m(window.channel).map_or(0.0, |noise_m| LEAST_OVER_NOISE * noise_m);
    let component = nearest_component(analysis, target_hz).filter(|found| found.amplitude_m > least_m)?;
    let frames = side.window_frames(&window.window).filter(|frames| frames.len() <= LONGEST_DECOMPOSED)?;
    let frames = frames.start + analysis.skipped_frames..frames.end;
    let shown = AnalysedWindow {
        recording: side.recording,
        channel: window.channel,
        frames,
        analysis,
        note: format!("window {}", window.window),
    };
    let mut figure = super::draw_figure(&shown.ring_down());
    figure.title = super::figure_title(&window.channel.label(), component);
    let note = format!("{} taken apart; {}", window.channel.label(), shown.note);
    figure.subtitle = subtitle(figure.watermarked, &note);
    if case.recording().is_none() {
        figure.subtitle = case.heading_note(&note);
        // what is taken apart is no recording and has no noise
        figure.panels.iter_mut().for_each(|panel| panel.ribbons.clear());
        figure
            .panels
            .iter_mut()
            .flat_map(|panel| &mut panel.series)
            .filter(|s| s.label == "data")
            .for_each(|s| s.label = "model".to_owned());
    }
    Some(case.figure_block("ring-down", figure_text(case, window, analysis, component), figure))
}

fn figure_text(
    case: &ConditionComparison,
    window: &FitWindow,
    analysis: &SpectralAnalysis,
    component: &Component,
) -> Words {
    let mut said = vec![format!(
        "The {} in the window {} of {}: trend ({}) and {} fitted by least squares, and what they leave.",
        window.channel.label(),
        window.window,
        case.source_name(),
        analysis.removed,
        count_oscillations(analysis.oscillations.len()),
    )];
    said.push(describe_component(component));
    let fitted = count_oscillations(analysis.oscillations.len());
    let mut caption = format!("The {} taken apart into a trend and {fitted}", window.channel.label());
    let left: Vec<f64> = analysis.residual_m.iter().flatten().map(|x| x * x).collect();
    if !left.is_empty() {
        let rms_m = (left.iter().sum::<f64>() / left.len() as f64).sqrt();
        let noise = case.noise_m(window.channel);
        let over_noise = noise.map_or_else(String::new, |m| {
            format!(", {} times the tracking noise of {}", format_digits(rms_m / m, 2), format_length(m))
        });
        caption += &format!(", which leave {} (root mean square){over_noise}", format_length(rms_m));
        said.push(format!("What is left has a root mean square of {}{over_noise}.", format_length(rms_m)));
    }
    Words { caption: caption + ".", details: said.join(" ") }
}

/// The component nearest to a frequency, Hz.
fn nearest_component(analysis: &SpectralAnalysis, target_hz: f64) -> Option<&Component> {
    let off = |c: &&Component| (c.frequency_hz - target_hz).abs();
    analysis.spectrum.components.iter().min_by(|a, b| off(a).total_cmp(&off(b)))
}

fn count_oscillations(oscillations: usize) -> String {
    match oscillations {
        0 => "no oscillation".to_owned(),
        1 => "one oscillation".to_owned(),
        n => format!("{n} oscillations"),
    }
}

/// Frequency, damping and what is said against them.
fn describe_component(component: &Component) -> String {
    let frequency = format_with_sd(component.frequency_hz, component.frequency_sd_hz);
    const KNOWN: f64 = 2.0;
    let damping = match component.damping_ratio.zip(component.damping_ratio_sd) {
        Some((ratio, sd)) if ratio.abs() < KNOWN * sd => {
            format!(", whose damping ratio, {}, may be zero", format_with_sd(ratio, sd))
        }
        Some((ratio, sd)) if ratio > 0.0 => {
            format!(", which decays with a damping ratio of {}", format_with_sd(ratio, sd))
        }
        Some((ratio, sd)) => format!(", which grows with a damping ratio of {}", format_with_sd(ratio, sd)),
        None => String::new(),
    };
    let against: Vec<&str> = component.reasons.iter().map(|r| r.words.as_str()).collect();
    let against =
        if against.is_empty() { String::new() } else { format!("; against it: {}", against.join("; ")) };
    format!("The component nearest to the target has {frequency} Hz{damping}{against}.")
}
