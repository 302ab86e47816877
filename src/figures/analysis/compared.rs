//! What a recording and a model show in the same window, side by side.

use super::components::{label_component, spectrum_curve, spectrum_level};
use crate::figures::spectrum::{LabelledComponent, SpectraPlot};
use crate::spectrum::SpectralAnalysis;

/// Components of a model under this share of its largest are of no account.
const LEAST_OF_MODEL: f64 = 1e-3;

/// The spectra of a recording and of a model that were read alike, with their components; of the model's,
/// without those that no recording could show: under the noise floor of this one, or of no account. Heading,
/// note and targets are left to the caller.
#[must_use]
pub fn compare_spectra(measured: Option<&SpectralAnalysis>, model: Option<&SpectralAnalysis>) -> SpectraPlot {
    let components = |analysis: &SpectralAnalysis| -> Vec<LabelledComponent> {
        analysis
            .spectrum
            .components
            .iter()
            .filter(|c| c.is_resolvable())
            .map(|c| label_component(c, &analysis.spectrum))
            .collect()
    };
    let noise_floor_m = measured.map(|m| m.spectrum.noise_floor_m);
    let mut model_components = model.map_or_else(Vec::new, components);
    let largest_m = model_components.iter().map(|c| c.amplitude_m).fold(0.0, f64::max);
    let least_m = noise_floor_m.unwrap_or(0.0).max(LEAST_OF_MODEL * largest_m);
    model_components.retain(|c| c.amplitude_m >= least_m);
    SpectraPlot {
        measured: measured.map(spectrum_curve),
        model: model.map(spectrum_curve),
        noise_floor_m,
        noise_floor: measured.and_then(|m| spectrum_level(m, &m.noise_floor_m)),
        components: measured.map_or_else(Vec::new, components),
        model_components,
        lowest_hz: measured.or(model).map_or(1.0, |a| a.spectrum.resolution_hz),
        ..SpectraPlot::default()
    }
}
