//! Spectra: measured against model in physical units, with components, published frequencies and the noise
//! floor.

pub(crate) mod caption;
mod levels;
mod named;

pub use crate::spectrum::Target;
pub use levels::{AmplitudeInterval, SpectrumLevel};
pub use named::LabelledComponent;

use crate::chart::{
    ChartAxis, Colour, FULL_WIDTH_MM, Figure, Mark, Panel, Series, ShadedSpan, TopLabel, VerticalLine,
};
use crate::figures::{NO_TRACES, subtitle};
use crate::text::format_trimmed;
use levels::{axis_points, level_series};

/// An amplitude spectrum.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SpectrumCurve {
    /// Frequencies, Hz.
    pub frequency_hz: Vec<f64>,
    /// Amplitudes, m.
    pub amplitude_m: Vec<f64>,
}

/// What a figure of spectra shows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SpectraPlot {
    /// Heading.
    pub title: String,
    /// Quantity whose spectrum it is, such as "deflection".
    pub quantity: String,
    /// Where the record comes from, such as its window; empty for none.
    pub note: String,
    /// Whether the measured motion is one that no camera took.
    pub synthetic: bool,
    /// Measured spectrum; `None` where only published numbers are known.
    pub measured: Option<SpectrumCurve>,
    /// Spectrum of the model, of the same length, window and detrending.
    pub model: Option<SpectrumCurve>,
    /// Published or measured frequencies.
    pub targets: Vec<Target>,
    /// Noise floor of the measured spectrum, m.
    pub noise_floor_m: Option<f64>,
    /// Noise floor over frequency; drawn instead of the constant one.
    pub noise_floor: Option<SpectrumLevel>,
    /// What the noise leaves open of the measured spectrum, 95 %.
    pub interval_95: Option<AmplitudeInterval>,
    /// What the removed flip leaves in the spectrum.
    pub leakage: Option<SpectrumLevel>,
    /// Components of the measured spectrum with their uncertainty.
    pub components: Vec<LabelledComponent>,
    /// Those of the model, likewise.
    pub model_components: Vec<LabelledComponent>,
    /// Lowest frequency that the record resolves, Hz; the axis starts there.
    pub lowest_hz: f64,
}

/// Height of the panel, mm.
const HEIGHT_MM: f64 = 75.0;
const MICROMETRES: f64 = 1e6;

/// The figure.
#[must_use]
pub fn draw_figure(spectra: &SpectraPlot) -> Figure {
    let highest = [&spectra.measured, &spectra.model]
        .into_iter()
        .flatten()
        .filter_map(|c| c.frequency_hz.last())
        .fold(0.0, |m: f64, f| m.max(*f));
    let x = ChartAxis::log("frequency, Hz");
    let x = if spectra.lowest_hz > 0.0 && highest > spectra.lowest_hz {
        x.with_range(spectra.lowest_hz, highest)
    } else {
        x
    };
    let y = ChartAxis::log(format!("amplitude of {}, \u{b5}m", spectra.quantity));
    let y = amplitude_limits(spectra)
        .map_or(y.clone(), |(low, high)| y.with_range(low * MICROMETRES, high * MICROMETRES));
    let panel = Panel {
        x,
        y,
        height_mm: HEIGHT_MM,
        series: spectrum_series(spectra, highest),
        shaded_spans: target_spans(&spectra.targets),
        vertical_lines: target_lines(spectra),
        top_labels: target_labels(spectra),
        ribbons: spectra.interval_95.iter().map(AmplitudeInterval::ribbon).collect(),
        ..Panel::default()
    };
    let mut source = if spectra.measured.is_none() && spectra.model.is_some() {
        NO_TRACES.to_owned()
    } else {
        String::new()
    };
    if !spectra.note.is_empty() {
        source = if source.is_empty() { spectra.note.clone() } else { format!("{source}; {}", spectra.note) };
    }
    Figure {
        title: spectra.title.clone(),
        subtitle: subtitle(spectra.synthetic, &source),
        watermarked: spectra.synthetic,
        description: format!(
            "Amplitude spectrum of {}; a sine of amplitude A reads A at its peak.",
            spectra.quantity
        ),
        width_mm: FULL_WIDTH_MM,
        panels: vec![panel],
        ..Figure::default()
    }
}

/// The claim of a spectrum that nothing is sought in: its largest component.
#[must_use]
pub fn strongest_claim(spectra: &SpectraPlot) -> String {
    let largest = |all: &[LabelledComponent]| {
        all.iter().max_by(|a, b| a.amplitude_m.total_cmp(&b.amplitude_m)).cloned()
    };
    match largest(&spectra.components).or_else(|| largest(&spectra.model_components)) {
        Some(found) => {
            format!("The largest component of the {} has {}", spectra.quantity, found.label_text())
        }
        None => format!("No component stands out in the {}", spectra.quantity),
    }
}

/// Ends of the amplitude axis, m: from well under the noise floor, or the foot of the model's range, to over
/// the highest peak.
fn amplitude_limits(spectra: &SpectraPlot) -> Option<(f64, f64)> {
    const UNDER_FLOOR: f64 = 0.1;
    const MODEL_RANGE: f64 = 1e-4;
    const OVER_PEAK: f64 = 2.0;
    let curves = [&spectra.measured, &spectra.model].into_iter().flatten();
    let shown = curves
        .flat_map(|c| c.frequency_hz.iter().zip(&c.amplitude_m))
        .filter(|(f, _)| **f >= spectra.lowest_hz);
    let peaks = spectra.components.iter().chain(&spectra.model_components).map(LabelledComponent::top_m);
    let highest = shown.map(|(_, a)| *a).chain(peaks).filter(|a| a.is_finite()).fold(0.0, f64::max);
    let range_foot = highest * MODEL_RANGE;
    let lowest_floor = spectra.noise_floor.as_ref().and_then(|l| l.lowest_m(spectra.lowest_hz));
    let foot = lowest_floor
        .or(spectra.noise_floor_m)
        .filter(|_| spectra.measured.is_some())
        .map_or(range_foot, |floor| (floor * UNDER_FLOOR).max(range_foot * MODEL_RANGE));
    (foot > 0.0 && highest.is_finite() && foot < highest).then_some((foot, highest * OVER_PEAK))
}

fn spectrum_series(spectra: &SpectraPlot, highest: f64) -> Vec<Series> {
    let curve = |label: &str, colour, mark, curve: &SpectrumCurve| Series {
        label: label.to_owned(),
        colour,
        mark,
        points: axis_points(&curve.frequency_hz, &curve.amplitude_m),
        error_bars: Vec::new(),
    };
    let mut drawn = level_series(spectra, highest);
    drawn.extend(spectra.measured.as_ref().map(|c| curve("measured", Colour::Black, Mark::Thin, c)));
    drawn.extend(spectra.model.as_ref().map(|c| curve("model", Colour::Vermilion, Mark::Line, c)));
    drawn.extend(named::component_series(&spectra.components, &spectra.model_components));
    drawn
}

/// Two standard deviations either side of a target.
fn target_spans(targets: &[Target]) -> Vec<ShadedSpan> {
    let band = |t: &Target| {
        let sd_hz = t.frequency_sd_hz.filter(|sd| *sd > 0.0)?;
        let (from, to) =
            ((t.frequency_hz - 2.0 * sd_hz).max(f64::MIN_POSITIVE), t.frequency_hz + 2.0 * sd_hz);
        Some(ShadedSpan {
            label: "target \u{b1} 2 sd".to_owned(),
            colour: Colour::Blue,
            from,
            to,
            ..ShadedSpan::default()
        })
    };
    targets.iter().filter_map(band).collect()
}

/// Names of components that stand over a panel next to those of targets: more would stand over each other in
/// one column.
const MOST_NAMES: usize = 4;

/// The components that are named: the measured ones, without a recording the model's.
fn labelled_components(spectra: &SpectraPlot) -> &[LabelledComponent] {
    if spectra.components.is_empty() { &spectra.model_components } else { &spectra.components }
}

/// Lines at the targets, and labels over the components.
fn target_lines(spectra: &SpectraPlot) -> Vec<VerticalLine> {
    let named = labelled_components(spectra);
    // where components are named, the names of the targets are captions
    let label = |t: &Target| {
        if named.is_empty() {
            format!("{}: {} Hz", t.name, format_trimmed(t.frequency_hz, 4))
        } else {
            String::new()
        }
    };
    let target = |t: &Target| VerticalLine {
        label: label(t),
        colour: Colour::Blue,
        mark: Mark::Dashed,
        at: t.frequency_hz,
        above: None,
    };
    let most = if spectra.targets.is_empty() { usize::MAX } else { MOST_NAMES };
    spectra.targets.iter().map(target).chain(named::component_labels(named, most)).collect()
}

/// Names of the targets, where components are named over them.
fn target_labels(spectra: &SpectraPlot) -> Vec<TopLabel> {
    let caption = |t: &Target| TopLabel { label: t.name.clone(), at: t.frequency_hz };
    if labelled_components(spectra).is_empty() {
        Vec::new()
    } else {
        spectra.targets.iter().map(caption).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chart::Medium;

    fn as_svg(shown: &SpectraPlot) -> String {
        draw_figure(shown).to_svg(Medium::Screen)
    }

    fn flat() -> SpectrumCurve {
        SpectrumCurve { frequency_hz: (0..1000).map(f64::from).collect(), amplitude_m: vec![1e-6; 1000] }
    }

    #[test]
    fn targets_are_named_with_their_frequencies() {
        let target =
            Target { name: "low component".to_owned(), frequency_hz: 78.4, frequency_sd_hz: Some(0.5) };
        let held = as_svg(&SpectraPlot {
            measured: Some(flat()),
            targets: vec![target],
            lowest_hz: 6.7,
            ..SpectraPlot::default()
        });
        assert!(held.contains("low component: 78.4 Hz") && held.contains("target \u{b1} 2 sd"));
    }

    #[test]
    fn components_are_named_with_their_uncertainty_and_what_is_wrong_with_them() {
        let clear = LabelledComponent {
            frequency_hz: 78.4,
            frequency_sd_hz: 0.03,
            amplitude_m: 20e-6,
            amplitude_sd_m: 1e-6,
            ..LabelledComponent::default()
        };
        let alias = LabelledComponent {
            frequency_hz: 100.0,
            frequency_sd_hz: 0.1,
            amplitude_m: 2e-6,
            amplitude_sd_m: 3e-6,
            remark: "alias?".to_owned(),
            ..LabelledComponent::default()
        };
        let spectra = SpectraPlot {
            measured: Some(flat()),
            lowest_hz: 6.7,
            components: vec![clear, alias],
            ..SpectraPlot::default()
        };
        let drawn = as_svg(&spectra);
        assert!(drawn.contains("78.40(3) Hz\n") && drawn.contains("100.0(1) Hz, alias?\n"));
        assert!(drawn.contains("component \u{b1} 2 sd") && drawn.contains("component that is not clear"));
    }

    #[test]
    fn a_floor_over_frequency_replaces_the_constant_one() {
        let level = |amplitude_m: f64| {
            Some(SpectrumLevel { frequency_hz: vec![10.0, 900.0], amplitude_m: vec![amplitude_m; 2] })
        };
        let constant = SpectraPlot {
            measured: Some(flat()),
            lowest_hz: 6.7,
            noise_floor_m: Some(1e-7),
            ..SpectraPlot::default()
        };
        let over = SpectraPlot { noise_floor: level(1e-8), leakage: level(2e-8), ..constant.clone() };
        let (constant, over) = (as_svg(&constant), as_svg(&over));
        assert_eq!([&constant, &over].map(|f| f.matches("noise floor of the recording").count()), [1, 1]);
        assert!(over.contains("leakage of the removed flip") && !constant.contains("leakage"));
        assert!(
            !constant.contains("\n0.001\n") && over.contains("\n0.001\n"),
            "the axis reaches under the lower floor"
        );
    }
}
