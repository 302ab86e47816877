//! Search for components in a spectrum: local maxima that are neither sidelobes nor ripples of a larger peak
//! nor noise.

use super::component::{Component, ComponentVerdict, Estimator};
use super::gap_refinement::{MOST_REFINED, Refinement, RefinementStart};
use super::peak_zoom::{WeightedRecord, log_parabola_vertex};
use super::periodogram::{WindowSums, WindowedSpectrum, upper_median};
use super::settings::{CLEAR_DB, MIN_CYCLES};
use portable_math as math;
use rayon::prelude::*;
use std::f64::consts::{FRAC_1_SQRT_2, LN_2, SQRT_2, TAU};

/// Allowed probability that noise alone causes a component to be found in a spectrum.
const FALSE_ALARM: f64 = 0.01;
/// Number of independent trials per resolution: a Hann spectrum has more maxima than independent values.
const TRIALS_PER_RESOLUTION: f64 = 3.0;
/// Half width of the main lobe of a Hann window, resolutions.
const LOBE: f64 = 2.0;
/// Factor by which the sidelobes of a component are assumed to exceed those of the window, because a real
/// component is neither steady nor alone.
const SIDELOBE_MARGIN: f64 = 1.5;
/// The same factor as [`SIDELOBE_MARGIN`], for a peak with fewer than [`MIN_CYCLES`] cycles in the record:
/// such a peak is a residue of the trend, not a sine, and its sidelobes fall more slowly.
const TREND_MARGIN: f64 = 4.0;
/// Smallest allowed ratio of the amplitude of a listed component to that of the largest resolvable component:
/// -50 dB. The part of a tone of twelve cycles that a cubic absorbs appears 56 dB below the tone.
const DYNAMIC_RANGE: f64 = 3.2e-3;
/// A maximum counts if, on the way to every larger maximum, the spectrum falls below this fraction of the
/// height of the smaller maximum: 3 dB, half the power.
const VALLEY_RATIO: f64 = FRAC_1_SQRT_2;
/// Smallest allowed width, in resolutions, of the band whose median gives the noise floor, so that a
/// component does not raise the floor under itself.
const FLOOR_RESOLUTIONS: f64 = 40.0;
/// Ratio of the standard deviation of the frequency of a spectral maximum to the Cramér-Rao bound; 1.5 to 1.8
/// was measured at 20 dB.
const OVER_BOUND: f64 = 1.6;
/// Error of a frequency that the removal of a cubic causes, in resolutions: 0.03 Hz at 78 Hz in 0.15 s.
const TREND_SHARE: f64 = 0.005;

impl WindowedSpectrum<'_> {
    fn resolves(&self, peak: &Peak) -> bool {
        peak.frequency_hz >= MIN_CYCLES * self.resolution_hz
    }
}

/// The noise floor of a spectrum, and its peaks that are components of their own.
pub(super) struct PeakList {
    pub floor_m: f64,
    /// Smallest ratio of a peak to the noise floor at which the peak is a component.
    pub detection: f64,
    /// Every peak accepted, largest first; peaks outside the band leak into it too.
    pub accepted: Vec<Peak>,
    /// Indices of the accepted peaks that are listed.
    listed: Vec<usize>,
}

impl PeakList {
    /// The peaks as starts of a refinement.
    pub(super) fn refinement_starts(&self, spectrum: &WindowedSpectrum) -> Vec<RefinementStart> {
        let start = |peak: &Peak| RefinementStart {
            cycles: peak.frequency_hz / spectrum.resolution_hz,
            moves: spectrum.resolves(peak),
        };
        self.accepted.iter().map(start).collect()
    }

    /// Moves the peaks to the maxima of the samples' transform, for bins too far apart for a parabola.
    pub(super) fn zoom_peaks(&mut self, spectrum: &WindowedSpectrum, record: &WeightedRecord) {
        self.accepted.par_iter_mut().for_each(|peak| {
            let (cycles, amplitude_m) = record.zoom_peak(peak.frequency_hz / spectrum.resolution_hz);
            (peak.frequency_hz, peak.amplitude_m) = (cycles * spectrum.resolution_hz, amplitude_m);
        });
    }

    /// The listed components, largest first; `outcomes` are the results of the refinement starts.
    pub(super) fn list_components(
        &self,
        spectrum: &WindowedSpectrum,
        outcomes: &[Refinement],
    ) -> Vec<Component> {
        let refined = |o: &Refinement| {
            if let Refinement::Refined(r) = o { Some(r.amplitude_m) } else { None }
        };
        let least_m = DYNAMIC_RANGE * outcomes.iter().filter_map(refined).fold(0.0, f64::max);
        let absent = |index: usize| match outcomes[index] {
            Refinement::Unchanged => false,
            Refinement::FixedFrequency(amplitude_m) => amplitude_m < least_m,
            // the noise in a bin has a cosine and a sine part, so its root mean square is sqrt(2) times the
            // standard deviation of an amplitude
            Refinement::Refined(r) => {
                let noise_m = r.deviations.map_or(0.0, |sd| self.detection * SQRT_2 * sd.amplitude_m);
                r.amplitude_m < least_m.max(noise_m)
            }
        };
        let component = |k: &usize| peak_component(spectrum, self.floor_m, &self.accepted[*k], outcomes[*k]);
        let listed = self.listed.iter().filter(|index| !absent(**index));
        let mut components: Vec<Component> = listed.map(component).collect();
        math::sort_by_number(&mut components, |a| -a.amplitude_m);
        components
    }
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Peak {
    bin: usize,
    /// Frequency of the parabola's top, Hz.
    pub frequency_hz: f64,
    pub amplitude_m: f64,
}

/// The noise floor and the peaks; at most `most` of those in the band are listed.
pub(super) fn find_peaks(spectrum: &WindowedSpectrum, band_hz: (f64, f64), most: usize) -> PeakList {
    let floor_m = noise_floor(spectrum, band_hz).max(spectrum.least_m);
    let detection = detection_threshold(spectrum, band_hz);
    let detected_m = floor_m * detection;
    let mut candidates = local_maxima(spectrum, detected_m);
    candidates.retain(|p| p.amplitude_m >= detected_m);
    candidates.sort_by(|a, b| b.amplitude_m.total_cmp(&a.amplitude_m).then(a.bin.cmp(&b.bin)));
    let mut accepted: Vec<Peak> = Vec::new();
    let mut listed = Vec::new();
    let mut least_m = 0.0_f64;
    for peak in candidates {
        let enough = listed.len() >= most && accepted.len() >= MOST_REFINED;
        if enough || peak.amplitude_m < least_m {
            break;
        }
        if accepted.iter().all(|larger| is_separate_peak(spectrum, larger, &peak)) {
            if spectrum.resolves(&peak) {
                least_m = least_m.max(DYNAMIC_RANGE * peak.amplitude_m);
            }
            if listed.len() < most && peak.frequency_hz >= band_hz.0 && peak.frequency_hz <= band_hz.1 {
                listed.push(accepted.len());
            }
            accepted.push(peak); // a peak outside the band still casts its sidelobes into it
        }
    }
    PeakList { floor_m, detection, accepted, listed }
}

/// Root mean square of the noise in a bin. Amplitudes of noise are Rayleigh distributed; their median is
/// `sqrt(ln 2)` times their root mean square.
fn noise_floor(spectrum: &WindowedSpectrum, (low, high): (f64, f64)) -> f64 {
    let widen = (FLOOR_RESOLUTIONS * spectrum.resolution_hz - (high - low)).max(0.0) / 2.0;
    let bins = spectrum.amplitude_m.len();
    let bin = |f: f64| ((f / spectrum.bin_hz).max(0.0) as usize).min(bins);
    let lowest = bin(LOBE * spectrum.resolution_hz).min(bins / 2); // the trend has absorbed the motion below
    let from = bin(low - widen).clamp(lowest, bins.saturating_sub(1));
    let to = (bin(high + widen) + 1).clamp(from + 1, bins.max(from + 1));
    let inside = spectrum.amplitude_m.get(from..to).unwrap_or(spectrum.amplitude_m).to_vec();
    upper_median(inside).map_or(0.0, |median| median / LN_2.sqrt())
}

/// Ratio to the noise floor that noise reaches anywhere in the band with the probability [`FALSE_ALARM`]: a
/// bin exceeds `r` times its root mean square with the probability `exp(-r^2)`.
fn detection_threshold(spectrum: &WindowedSpectrum, (low, high): (f64, f64)) -> f64 {
    let trials = (TRIALS_PER_RESOLUTION * (high - low) / spectrum.resolution_hz).max(1.0);
    math::ln(trials / FALSE_ALARM).sqrt()
}

/// Local maxima, except those that cannot reach `least_m`.
fn local_maxima(spectrum: &WindowedSpectrum, least_m: f64) -> Vec<Peak> {
    /// Upper limit of the ratio of the vertex of a parabola, through the logarithms of three amplitudes, to
    /// the middle amplitude. The ratio is at most the eighth root of the ratio of the middle amplitude to the
    /// lower of the other two: 1.09 if the lower one is half as high.
    const RISE: f64 = 1.1;
    let a = spectrum.amplitude_m;
    let is_top = |k: &usize| {
        a[*k] > a[k - 1]
            && a[*k] >= a[k + 1]
            && (a[*k] * RISE >= least_m || a[k - 1].min(a[k + 1]) < a[*k] / 2.0)
    };
    let peak = |k: usize| {
        let (shift, amplitude_m) = log_parabola_vertex([a[k - 1], a[k], a[k + 1]]);
        Peak { bin: k, frequency_hz: (k as f64 + shift) * spectrum.bin_hz, amplitude_m }
    };
    (1..a.len().saturating_sub(1)).filter(is_top).map(peak).collect()
}

fn is_separate_peak(spectrum: &WindowedSpectrum, larger: &Peak, peak: &Peak) -> bool {
    let (low, high) = (larger.bin.min(peak.bin), larger.bin.max(peak.bin));
    let distance = high - low;
    if (distance as f64) * spectrum.bin_hz < LOBE * spectrum.resolution_hz {
        return false;
    }
    let margin = if spectrum.resolves(larger) { SIDELOBE_MARGIN } else { TREND_MARGIN };
    let sidelobe = spectrum.envelope.get(distance).copied().unwrap_or(0.0) * larger.amplitude_m * margin;
    let valley = spectrum.amplitude_m[low..=high].iter().fold(f64::INFINITY, |m, a| m.min(*a));
    peak.amplitude_m > sidelobe && valley < VALLEY_RATIO * peak.amplitude_m
}

/// The component of a peak, from its refinement if it has one.
fn peak_component(spectrum: &WindowedSpectrum, floor_m: f64, peak: &Peak, outcome: Refinement) -> Component {
    let trend_hz = TREND_SHARE * spectrum.resolution_hz;
    let bound_sd_hz = OVER_BOUND * cramer_rao_bound_hz(spectrum, floor_m, peak);
    let (mut estimator, mut sds) = (Estimator::Periodogram, (bound_sd_hz, floor_m * FRAC_1_SQRT_2));
    let (mut frequency_hz, mut amplitude_m) = (peak.frequency_hz, peak.amplitude_m);
    if let Refinement::Refined(r) = outcome {
        estimator = Estimator::LeastSquares;
        (frequency_hz, amplitude_m) = (r.cycles * spectrum.resolution_hz, r.amplitude_m);
        sds = r.deviations.map_or(sds, |sd| (sd.cycles * spectrum.resolution_hz, sd.amplitude_m));
    }
    let snr_db = 20.0 * math::log10(amplitude_m / floor_m);
    let verdict = match () {
        () if !spectrum.resolves(peak) => ComponentVerdict::NotResolvable,
        () if snr_db < CLEAR_DB => ComponentVerdict::Weak,
        () => ComponentVerdict::Clear,
    };
    Component {
        frequency_hz,
        frequency_sd_hz: math::hypot(sds.0, trend_hz),
        amplitude_m,
        amplitude_sd_m: sds.1,
        snr_db,
        cramer_rao_hz: bound_sd_hz / OVER_BOUND,
        verdict,
        estimator,
        ..Component::default()
    }
}

/// Cramér-Rao bound of one real tone in the noise of the floor, `eta = A^2 / (2 sigma^2)`, Hz.
fn cramer_rao_bound_hz(spectrum: &WindowedSpectrum, floor_m: f64, peak: &Peak) -> f64 {
    let WindowSums { first, second, .. } = spectrum.sums;
    let sigma_m = floor_m * first / (2.0 * second.sqrt());
    let eta = math::powi(peak.amplitude_m, 2) / (2.0 * sigma_m * sigma_m);
    let span = math::powi(spectrum.frames as f64, 2) - 1.0;
    let frame_rate_hz = spectrum.resolution_hz * spectrum.frames as f64;
    frame_rate_hz / TAU * (12.0 / (eta * spectrum.present as f64 * span)).sqrt()
}
