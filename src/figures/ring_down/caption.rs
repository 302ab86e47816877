//! The ring-down figure of a condition of a fit: its data and its caption.

use crate::compare::ConditionComparison;
use crate::compare::condition::{FitWindow, compare_frequency};
use crate::feature::Reading;
use crate::figures::analysis::AnalysedWindow;
use crate::figures::ring_down::{draw_figure, figure_title};
use crate::figures::{FigureBlock, FigureText, subtitle};
use crate::text::{format_digits, format_length, format_with_sd};
use short_spectra::{Component, LONGEST_DECOMPOSED, SpectralAnalysis};

/// Index of the window with the lowest target frequency, and that frequency, Hz; `None` if the job has no
/// target frequency.
pub(crate) fn lowest_window(case: &ConditionComparison, all: &[FitWindow]) -> Option<(usize, f64)> {
    let frequency = |l: &FitWindow| {
        let aims = l.targets.iter();
        let aims = aims
            .filter(|aim| matches!(aim.feature.reading, Reading::Frequency(_) | Reading::DampingRatio(_)));
        let sought = aims.filter_map(|aim| compare_frequency(aim, case.result));
        sought.map(|m| m.target.frequency_hz).reduce(f64::min)
    };
    let lowest = all.iter().enumerate().filter_map(|(i, window)| Some((i, frequency(window)?)));
    lowest.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Smallest amplitude of the component nearest to the target for which the figure is drawn, in standard
/// deviations of the noise.
const LEAST_OVER_NOISE: f64 = 2.0;

/// The figure of the window's analysis; `None` if the record is too long to be decomposed, or if the
/// component nearest to the target has an amplitude below twice the noise.
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
    let mut figure = draw_figure(&shown.ring_down());
    figure.title = figure_title(&window.channel.label(), component);
    let note = format!("{} taken apart; {}", window.channel.label(), shown.note);
    figure.subtitle = subtitle(figure.watermarked, &note);
    if case.recording().is_none() {
        figure.subtitle = case.heading_note(&note);
        // the model's motion has no noise
        for panel in &mut figure.panels {
            panel.ribbons.clear();
            let data = panel.series.iter_mut().filter(|s| s.label == "data");
            data.for_each(|s| s.label = "model".to_owned());
        }
    }
    Some(case.figure_block("ring-down", figure_text(case, window, analysis, component), figure))
}

fn figure_text(
    case: &ConditionComparison,
    window: &FitWindow,
    analysis: &SpectralAnalysis,
    component: &Component,
) -> FigureText {
    let (label, source) = (window.channel.label(), case.source_name());
    let fitted = match analysis.oscillations.len() {
        0 => "no oscillation".to_owned(),
        1 => "one oscillation".to_owned(),
        n => format!("{n} oscillations"),
    };
    let mut said = vec![format!(
        "The {label} in the window {} of {source}: trend ({}) and {fitted} fitted by least squares, and what they leave.",
        window.window, analysis.removed
    )];
    said.push(describe_component(component));
    let mut caption = format!("The {label} taken apart into a trend and {fitted}");
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
    FigureText { caption: caption + ".", details: said.join(" ") }
}

/// The component nearest to a frequency, Hz.
fn nearest_component(analysis: &SpectralAnalysis, target_hz: f64) -> Option<&Component> {
    let off = |c: &&Component| (c.frequency_hz - target_hz).abs();
    analysis.spectrum.components.iter().min_by(|a, b| off(a).total_cmp(&off(b)))
}

/// Sentence on frequency, damping and doubts about a component.
fn describe_component(component: &Component) -> String {
    let frequency = format_with_sd(component.frequency_hz, component.frequency_sd_hz);
    const KNOWN: f64 = 2.0;
    let damping = component.damping_ratio.zip(component.damping_ratio_sd).map(|(ratio, sd)| {
        let words = format_with_sd(ratio, sd);
        match ratio {
            ratio if ratio.abs() < KNOWN * sd => format!(", whose damping ratio, {words}, may be zero"),
            ratio if ratio > 0.0 => format!(", which decays with a damping ratio of {words}"),
            _ => format!(", which grows with a damping ratio of {words}"),
        }
    });
    let damping = damping.unwrap_or_default();
    let mut against = component.reasons.iter().map(|r| r.words.as_str()).collect::<Vec<_>>().join("; ");
    if !component.reasons.is_empty() {
        against = format!("; against it: {against}");
    }
    format!("The component nearest to the target has {frequency} Hz{damping}{against}.")
}
