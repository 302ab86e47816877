//! Amplitude spectra of recording and model, with components, target frequencies and noise floor.

pub mod caption;
mod components;

use crate::figures::{NO_TRACES, about, full_figure};
use crate::text::format_trimmed;
pub use components::LabelledComponent;
use plain_charts::{
    ChartAxis, Colour, Figure, Mark, Panel, Ribbon, Series, ShadedSpan, TopLabel, VerticalLine,
};
pub use short_spectra::Target;

/// An amplitude spectrum.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SpectrumCurve {
    /// Frequencies, Hz.
    pub frequency_hz: Vec<f64>,
    /// Amplitudes, m.
    pub amplitude_m: Vec<f64>,
}

/// Data of a figure of spectra.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SpectraPlot {
    /// Heading.
    pub title: String,
    /// Quantity, such as "deflection".
    pub quantity: String,
    /// Note on the analysed record, such as its window; empty for none.
    pub note: String,
    /// Whether the measured motion is synthetic.
    pub synthetic: bool,
    /// Measured spectrum; `None` if only published numbers are known.
    pub measured: Option<SpectrumCurve>,
    /// Spectrum of the model, with the same length, window and detrending as the measured one.
    pub model: Option<SpectrumCurve>,
    /// Published or measured target frequencies.
    pub targets: Vec<Target>,
    /// Noise floor of the measured spectrum, m.
    pub noise_floor_m: Option<f64>,
    /// Noise floor as a function of frequency; if present, it is drawn instead of the constant noise floor.
    pub noise_floor: Option<SpectrumLevel>,
    /// 95 % interval of the measured spectrum, from its noise floor.
    pub interval_95: Option<AmplitudeInterval>,
    /// Amplitude that the removed trend, which contains the flip of the blade, would have in the spectrum.
    pub leakage: Option<SpectrumLevel>,
    /// Components of the measured spectrum with their uncertainty.
    pub components: Vec<LabelledComponent>,
    /// Components of the model with their uncertainty.
    pub model_components: Vec<LabelledComponent>,
    /// Lowest frequency that the record resolves, Hz; the axis starts there.
    pub lowest_hz: f64,
}

/// Height of the panel, mm.
const HEIGHT_MM: f64 = 75.0;
const MICROMETRES: f64 = 1e6;

/// Draws the figure.
#[must_use]
pub fn draw_figure(spectra: &SpectraPlot) -> Figure {
    let alone = spectra.measured.is_none() && spectra.model.is_some();
    let source = about(if alone { NO_TRACES } else { "" }, &spectra.note);
    full_figure(
        &spectra.title,
        spectra.synthetic,
        &source,
        format!("Amplitude spectrum of {}; a sine of amplitude A reads A at its peak.", spectra.quantity),
        [draw_panel(spectra)],
    )
}

/// Draws the panel of the spectra.
pub(crate) fn draw_panel(spectra: &SpectraPlot) -> Panel {
    let highest = [&spectra.measured, &spectra.model]
        .into_iter()
        .flatten()
        .filter_map(|c| c.frequency_hz.last())
        .fold(0.0, |m: f64, f| m.max(*f));
    let shown_hz = Some((spectra.lowest_hz, highest)).filter(|(low, high)| *low > 0.0 && high > low);
    let x = ChartAxis::log("frequency, Hz").with_ends(shown_hz);
    let shown_um = amplitude_limits(spectra).map(|(low, high)| (low * MICROMETRES, high * MICROMETRES));
    let y = ChartAxis::log(format!("amplitude of {}, \u{b5}m", spectra.quantity)).with_ends(shown_um);
    Panel {
        shaded_spans: target_spans(&spectra.targets),
        vertical_lines: target_lines(spectra),
        top_labels: target_labels(spectra),
        ribbons: spectra.interval_95.iter().map(AmplitudeInterval::ribbon).collect(),
        ..Panel::new(x, y, HEIGHT_MM, spectrum_series(spectra, highest))
    }
}

/// Heading of a spectrum without targets: its largest component.
pub(crate) fn strongest_claim(spectra: &SpectraPlot) -> String {
    let largest = |all: &[LabelledComponent]| {
        all.iter().max_by(|a, b| a.amplitude_m.total_cmp(&b.amplitude_m)).cloned()
    };
    let quantity = &spectra.quantity;
    match largest(&spectra.components).or_else(|| largest(&spectra.model_components)) {
        Some(found) => format!("The largest component of the {quantity} has {}", found.label_text()),
        None => format!("No component stands out in the {quantity}"),
    }
}

/// Ends of the amplitude axis, m. The lower end is below the noise floor or, without a noise floor, 1e-4 of
/// the highest peak; the upper end is above that peak.
fn amplitude_limits(spectra: &SpectraPlot) -> Option<(f64, f64)> {
    const UNDER_FLOOR: f64 = 0.1;
    const MODEL_RANGE: f64 = 1e-4;
    const OVER_PEAK: f64 = 2.0;
    let curves = [&spectra.measured, &spectra.model].into_iter().flatten();
    let all = curves.flat_map(|c| c.frequency_hz.iter().zip(&c.amplitude_m));
    let shown = all.filter(|(f, _)| **f >= spectra.lowest_hz);
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
    let curve = |label: &str, colour, mark, curve: &SpectrumCurve| {
        Series::new(label, colour, mark, axis_points(&curve.frequency_hz, &curve.amplitude_m))
    };
    let mut drawn = level_series(spectra, highest);
    drawn.extend(spectra.measured.as_ref().map(|c| curve("measured", Colour::Black, Mark::Thin, c)));
    drawn.extend(spectra.model.as_ref().map(|c| curve("model", Colour::Vermilion, Mark::Line, c)));
    drawn.extend(components::component_series(&spectra.components, &spectra.model_components));
    drawn
}

/// Shaded spans of two standard deviations on either side of each target.
fn target_spans(targets: &[Target]) -> Vec<ShadedSpan> {
    let band = |t: &Target| {
        let sd_hz = t.frequency_sd_hz.filter(|sd| *sd > 0.0)?;
        let from = (t.frequency_hz - 2.0 * sd_hz).max(f64::MIN_POSITIVE);
        let to = t.frequency_hz + 2.0 * sd_hz;
        Some(ShadedSpan::new("target \u{b1} 2 sd", Colour::Blue, from, to))
    };
    targets.iter().filter_map(band).collect()
}

/// Maximum number of component names above a panel that also names targets.
const MOST_NAMES: usize = 4;

/// The components that get names: the measured ones, or the model's if none were measured.
fn labelled_components(spectra: &SpectraPlot) -> &[LabelledComponent] {
    if spectra.components.is_empty() { &spectra.model_components } else { &spectra.components }
}

/// Lines at the targets, and labels above the components.
fn target_lines(spectra: &SpectraPlot) -> Vec<VerticalLine> {
    let named = labelled_components(spectra);
    // if components have names, the targets are named by top labels instead
    let label = |t: &Target| format!("{}: {} Hz", t.name, format_trimmed(t.frequency_hz, 4));
    let target = |t: &Target| {
        let label = if named.is_empty() { label(t) } else { String::new() };
        VerticalLine::new(label, Colour::Blue, Mark::Dashed, t.frequency_hz)
    };
    let most = if spectra.targets.is_empty() { usize::MAX } else { MOST_NAMES };
    spectra.targets.iter().map(target).chain(components::component_labels(named, most)).collect()
}

/// Names of the targets above the panel, if components have names too.
fn target_labels(spectra: &SpectraPlot) -> Vec<TopLabel> {
    let caption = |t: &Target| TopLabel { label: t.name.clone(), at: t.frequency_hz };
    let named = !labelled_components(spectra).is_empty();
    spectra.targets.iter().filter(|_| named).map(caption).collect()
}

// Noise floor, leakage and interval of a spectrum.

/// A level, such as the noise floor, as a function of frequency.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SpectrumLevel {
    /// Frequencies, Hz.
    pub frequency_hz: Vec<f64>,
    /// Amplitudes, m.
    pub amplitude_m: Vec<f64>,
}

/// An interval of amplitudes as a function of frequency.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct AmplitudeInterval {
    /// Frequencies, Hz.
    pub frequency_hz: Vec<f64>,
    /// Lower ends, m.
    pub lower_m: Vec<f64>,
    /// Upper ends, m.
    pub upper_m: Vec<f64>,
}

impl SpectrumLevel {
    /// The smallest positive amplitude, m, of the level at frequencies of at least `lowest_hz`.
    pub(super) fn lowest_m(&self, lowest_hz: f64) -> Option<f64> {
        let all = self.frequency_hz.iter().zip(&self.amplitude_m);
        let shown = all.filter(|(f, a)| **f >= lowest_hz && **a > 0.0 && a.is_finite());
        shown.map(|(_, a)| *a).reduce(f64::min)
    }
}

/// Ratio of the radius of the circle that contains 95 % of the noise around the complex amplitude of a bin to
/// the root mean square of that noise: `sqrt(-ln 0.05)` (Rayleigh distribution of the magnitude).
const CIRCLE_95: f64 = 1.730_818_382_602_285_7;

impl AmplitudeInterval {
    /// The 95 % interval of each amplitude, for a given noise floor. If the interval reaches zero, the bin
    /// may contain noise only.
    pub(crate) fn from_noise_floor(curve: &SpectrumCurve, floor: &SpectrumLevel) -> Self {
        let ends = |sign: f64| {
            let end = |(a, noise_m): (&f64, &f64)| (a + sign * CIRCLE_95 * noise_m).max(0.0);
            curve.amplitude_m.iter().zip(&floor.amplitude_m).map(end).collect()
        };
        Self { frequency_hz: curve.frequency_hz.clone(), lower_m: ends(-1.0), upper_m: ends(1.0) }
    }

    pub(super) fn ribbon(&self) -> Ribbon {
        let ends = self.frequency_hz.iter().zip(self.lower_m.iter().zip(&self.upper_m));
        let points = ends.map(|(f, (low, high))| (*f, low * MICROMETRES, high * MICROMETRES));
        Ribbon::new("95 % interval by the noise floor", Colour::Black, points)
    }
}

/// Points with the frequency in Hz and the amplitude in micrometres.
pub(super) fn axis_points(frequency_hz: &[f64], amplitude_m: &[f64]) -> Vec<Option<(f64, f64)>> {
    frequency_hz.iter().zip(amplitude_m).map(|(f, a)| Some((*f, a * MICROMETRES))).collect()
}

/// Noise floor and leakage, drawn under the spectra.
pub(super) fn level_series(spectra: &SpectraPlot, highest: f64) -> Vec<Series> {
    let constant =
        |floor_m: f64| [spectra.lowest_hz, highest].map(|f| Some((f, floor_m * MICROMETRES))).to_vec();
    let level = |l: &SpectrumLevel| axis_points(&l.frequency_hz, &l.amplitude_m);
    let floor = spectra.noise_floor.as_ref().map(level);
    let floor = floor.or_else(|| spectra.noise_floor_m.filter(|f| *f > 0.0).map(constant));
    let floor = floor.map(|p| Series::new("noise floor of the recording", Colour::Grey, Mark::Dotted, p));
    let leakage = spectra.leakage.as_ref().map(level);
    let leakage =
        leakage.map(|p| Series::new("leakage of the removed flip", Colour::Orange, Mark::ThinDashed, p));
    floor.into_iter().chain(leakage).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use plain_charts::Medium;

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
        assert_eq!([&constant, &over].map(|f| f.matches("\nnoise floor of the recording\n").count()), [1, 1]);
        assert!(over.contains("leakage of the removed flip") && !constant.contains("leakage"));
        assert!(
            !constant.contains("\n0.001\n") && over.contains("\n0.001\n"),
            "the axis reaches under the lower floor"
        );
    }
}
