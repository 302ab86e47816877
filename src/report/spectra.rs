//! Spectra: measured against model in physical units, with components, published frequencies and the noise floor.

use super::chart::{Axis, Band, Colour, FULL_WIDTH_MM, Figure, Mark, Panel, Rule, Series, svg};
use super::subtitle;

/// An amplitude spectrum.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Curve {
    /// Frequencies, Hz.
    pub frequency_hz: Vec<f64>,
    /// Amplitudes, m.
    pub amplitude_m: Vec<f64>,
    /// Frequencies of its components, Hz, to be marked.
    pub components_hz: Vec<f64>,
}

/// A frequency that the spectrum is held against.
#[derive(Debug, Clone, PartialEq)]
pub struct Target {
    /// What it is.
    pub name: String,
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Its standard deviation, Hz, where known.
    pub frequency_sd_hz: Option<f64>,
}

/// What a figure of spectra shows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Spectra {
    /// Heading.
    pub title: String,
    /// Quantity whose spectrum it is, such as "deflection".
    pub quantity: String,
    /// Where the record comes from, such as its window; empty for none.
    pub note: String,
    /// Whether the measured motion is one that no camera took.
    pub synthetic: bool,
    /// Measured spectrum; `None` where only published numbers are known.
    pub measured: Option<Curve>,
    /// Spectrum of the model, of the same length, window and detrending.
    pub model: Option<Curve>,
    /// Published or measured frequencies.
    pub targets: Vec<Target>,
    /// Noise floor of the measured spectrum, m.
    pub noise_floor_m: Option<f64>,
    /// Lowest frequency that the record resolves, Hz; the axis starts there.
    pub lowest_hz: f64,
}

/// Height of the panel, mm.
const HEIGHT_MM: f64 = 75.0;
const MICROMETRES: f64 = 1e6;

/// The figure as SVG.
#[must_use]
pub fn figure(spectra: &Spectra) -> String {
    let highest = [&spectra.measured, &spectra.model].into_iter().flatten().filter_map(|c| c.frequency_hz.last()).fold(0.0, |m: f64, f| m.max(*f));
    let x = Axis::log("frequency, Hz");
    let x = if spectra.lowest_hz > 0.0 && highest > spectra.lowest_hz { x.between(spectra.lowest_hz, highest) } else { x };
    let y = Axis::log(format!("amplitude of {}, \u{b5}m", spectra.quantity));
    let y = amplitudes(spectra).map_or(y.clone(), |(low, high)| y.between(low * MICROMETRES, high * MICROMETRES));
    let panel = Panel { x, y, height_mm: HEIGHT_MM, series: series(spectra, highest), bands: targets(&spectra.targets), rules: rules(spectra) };
    let mut source = if spectra.measured.is_none() && spectra.model.is_some() {
        "model alone: the traces of the experiment are not published".to_owned()
    } else {
        String::new()
    };
    if !spectra.note.is_empty() {
        source = if source.is_empty() { spectra.note.clone() } else { format!("{source}; {}", spectra.note) };
    }
    svg(&Figure {
        title: spectra.title.clone(),
        subtitle: subtitle(spectra.synthetic, &source),
        description: format!("Amplitude spectrum of {}; a sine of amplitude A reads A at its peak.", spectra.quantity),
        width_mm: FULL_WIDTH_MM,
        panels: vec![panel],
    })
}

/// Ends of the amplitude axis, m: from well under the noise floor, or the foot of the model's range, to over the highest peak.
fn amplitudes(spectra: &Spectra) -> Option<(f64, f64)> {
    const UNDER_FLOOR: f64 = 0.1;
    const MODEL_RANGE: f64 = 1e-4;
    const OVER_PEAK: f64 = 2.0;
    let curves = [&spectra.measured, &spectra.model].into_iter().flatten();
    let shown = curves.flat_map(|c| c.frequency_hz.iter().zip(&c.amplitude_m)).filter(|(f, _)| **f >= spectra.lowest_hz);
    let highest = shown.fold(0.0, |m: f64, (_, a)| m.max(*a));
    let range_foot = highest * MODEL_RANGE;
    let foot = spectra.noise_floor_m.filter(|_| spectra.measured.is_some()).map_or(range_foot, |floor| (floor * UNDER_FLOOR).max(range_foot * MODEL_RANGE));
    (foot > 0.0 && highest.is_finite() && foot < highest).then_some((foot, highest * OVER_PEAK))
}

fn series(spectra: &Spectra, highest: f64) -> Vec<Series> {
    let curve = |label: &str, colour, mark, curve: &Curve| Series {
        label: label.to_owned(),
        colour,
        mark,
        points: curve.frequency_hz.iter().zip(&curve.amplitude_m).map(|(f, a)| Some((*f, a * MICROMETRES))).collect(),
    };
    let mut drawn = Vec::new();
    if let Some(floor_m) = spectra.noise_floor_m.filter(|f| *f > 0.0) {
        let points = [spectra.lowest_hz, highest].map(|f| Some((f, floor_m * MICROMETRES))).to_vec();
        drawn.push(Series { label: "noise floor of the recording".to_owned(), colour: Colour::Grey, mark: Mark::Dotted, points });
    }
    drawn.extend(spectra.measured.as_ref().map(|c| curve("measured", Colour::Black, Mark::Thin, c)));
    drawn.extend(spectra.model.as_ref().map(|c| curve("model", Colour::Vermilion, Mark::Line, c)));
    let marked =
        [("component, measured", Colour::Black, Mark::Circles, &spectra.measured), ("component, model", Colour::Vermilion, Mark::Crosses, &spectra.model)];
    for (label, colour, mark, of) in marked {
        let points: Vec<_> = of.iter().flat_map(|c| c.components_hz.iter().map(|f| peak(c, *f))).filter(Option::is_some).collect();
        if !points.is_empty() {
            drawn.push(Series { label: label.to_owned(), colour, mark, points });
        }
    }
    drawn
}

/// The bin nearest to a frequency, in the units of the axes.
fn peak(curve: &Curve, frequency_hz: f64) -> Option<(f64, f64)> {
    let next = curve.frequency_hz.partition_point(|f| *f < frequency_hz);
    let near = [next.checked_sub(1), Some(next)].into_iter().flatten().filter_map(|i| curve.frequency_hz.get(i).zip(curve.amplitude_m.get(i)));
    near.min_by(|a, b| (a.0 - frequency_hz).abs().total_cmp(&(b.0 - frequency_hz).abs())).map(|(_, a)| (frequency_hz, a * MICROMETRES))
}

/// Two standard deviations either side of a target.
fn targets(targets: &[Target]) -> Vec<Band> {
    let band = |t: &Target| {
        let sd_hz = t.frequency_sd_hz.filter(|sd| *sd > 0.0)?;
        let (from, to) = ((t.frequency_hz - 2.0 * sd_hz).max(f64::MIN_POSITIVE), t.frequency_hz + 2.0 * sd_hz);
        Some(Band { label: "target \u{b1} 2 sd".to_owned(), colour: Colour::Blue, from, to })
    };
    targets.iter().filter_map(band).collect()
}

/// Lines at the targets, and labels over the measured (without a model, all) components.
fn rules(spectra: &Spectra) -> Vec<Rule> {
    let target =
        |t: &Target| Rule { label: format!("{}: {} Hz", t.name, digits(t.frequency_hz)), colour: Colour::Blue, mark: Mark::Dashed, at: t.frequency_hz };
    let component = |f: &f64| Rule { label: format!("{} Hz", digits(*f)), colour: Colour::Grey, mark: Mark::Dotted, at: *f };
    let labelled = if spectra.targets.is_empty() { spectra.measured.as_ref().or(spectra.model.as_ref()) } else { None };
    spectra.targets.iter().map(target).chain(labelled.iter().flat_map(|c| c.components_hz.iter().map(component))).collect()
}

/// Four significant digits without an exponent.
fn digits(frequency_hz: f64) -> String {
    let decimals = if frequency_hz > 0.0 { (3 - frequency_hz.log10().floor() as i32).clamp(0, 3) } else { 1 };
    let text = format!("{frequency_hz:.*}", decimals as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_and_components_are_named_with_their_frequencies() {
        let curve = Curve { frequency_hz: (0..1000).map(f64::from).collect(), amplitude_m: vec![1e-6; 1000], components_hz: vec![79.3, 905.2] };
        let target = Target { name: "low component".to_owned(), frequency_hz: 78.4, frequency_sd_hz: Some(0.5) };
        let spectra = Spectra { measured: Some(curve), lowest_hz: 6.7, ..Spectra::default() };
        let plain = figure(&spectra);
        assert!(plain.contains("79.3 Hz") && plain.contains("905.2 Hz") && plain.contains("component, measured"));
        let held = figure(&Spectra { targets: vec![target], ..spectra });
        assert!(held.contains("low component: 78.4 Hz") && held.contains("target \u{b1} 2 sd"));
    }

    #[test]
    fn four_digits_are_given() {
        assert_eq!([78.4, 900.0, 12.567, 1234.6, 0.51].map(digits), ["78.4", "900", "12.57", "1235", "0.51"]);
    }
}
