//! Noise floor, leakage and interval of a spectrum.

use super::{MICROMETRES, SpectraPlot, SpectrumCurve};
use crate::chart::{Colour, Mark, Ribbon, Series};

/// A level over frequency.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SpectrumLevel {
    /// Frequencies, Hz.
    pub frequency_hz: Vec<f64>,
    /// Amplitudes, m.
    pub amplitude_m: Vec<f64>,
}

/// An interval of amplitudes over frequency.
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
    /// The lowest positive level from a frequency on, m.
    pub(super) fn lowest_m(&self, lowest_hz: f64) -> Option<f64> {
        let shown = self
            .frequency_hz
            .iter()
            .zip(&self.amplitude_m)
            .filter(|(f, a)| **f >= lowest_hz && **a > 0.0 && a.is_finite());
        shown.map(|(_, a)| *a).reduce(f64::min)
    }
}

/// Radius of the circle about a bin's complex amplitude that holds 95 % of the noise there, over the root
/// mean square of the noise: `sqrt(-ln 0.05)`, as its magnitude follows Rayleigh's law.
const CIRCLE_95: f64 = 1.730_818_382_602_285_7;

impl AmplitudeInterval {
    /// What noise of a level leaves open of every amplitude of a curve: the true one lies in it in 95 % of
    /// the bins at least, and where it reaches down to zero the bin may hold noise alone.
    #[must_use]
    pub fn from_noise_floor(curve: &SpectrumCurve, floor: &SpectrumLevel) -> Self {
        let ends = |sign: f64| {
            let end = |(a, noise_m): (&f64, &f64)| (a + sign * CIRCLE_95 * noise_m).max(0.0);
            curve.amplitude_m.iter().zip(&floor.amplitude_m).map(end).collect()
        };
        Self { frequency_hz: curve.frequency_hz.clone(), lower_m: ends(-1.0), upper_m: ends(1.0) }
    }

    pub(super) fn ribbon(&self) -> Ribbon {
        let ends = self.lower_m.iter().zip(&self.upper_m);
        let points = self
            .frequency_hz
            .iter()
            .zip(ends)
            .map(|(f, (low, high))| Some((*f, low * MICROMETRES, high * MICROMETRES)));
        Ribbon {
            label: "95 % interval by the noise floor".to_owned(),
            colour: Colour::Black,
            points: points.collect(),
        }
    }
}

/// Points in the units of the axes.
pub(super) fn axis_points(frequency_hz: &[f64], amplitude_m: &[f64]) -> Vec<Option<(f64, f64)>> {
    frequency_hz.iter().zip(amplitude_m).map(|(f, a)| Some((*f, a * MICROMETRES))).collect()
}

/// Noise floor and leakage, which lie under the spectra.
pub(super) fn level_series(spectra: &SpectraPlot, highest: f64) -> Vec<Series> {
    let constant = spectra
        .noise_floor_m
        .filter(|f| *f > 0.0)
        .map(|floor_m| [spectra.lowest_hz, highest].map(|f| Some((f, floor_m * MICROMETRES))).to_vec());
    let floor =
        spectra.noise_floor.as_ref().map(|l| axis_points(&l.frequency_hz, &l.amplitude_m)).or(constant);
    let floor = floor.map(|points| ("noise floor of the recording", Colour::Grey, Mark::Dotted, points));
    let leakage = spectra.leakage.as_ref().map(|l| axis_points(&l.frequency_hz, &l.amplitude_m));
    let leakage =
        leakage.map(|points| ("leakage of the removed flip", Colour::Orange, Mark::ThinDashed, points));
    let drawn = floor.into_iter().chain(leakage);
    drawn
        .map(|(label, colour, mark, points)| Series {
            label: label.to_owned(),
            colour,
            mark,
            points,
            error_bars: Vec::new(),
        })
        .collect()
}
