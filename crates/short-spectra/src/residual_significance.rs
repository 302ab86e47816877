//! Tests of whether the residual of a fit is noise, or has peaks that no term explains.

use super::least_squares::SineTerm;
use super::model_selection::{ModelFit, ModelSelector, SineModel, is_in_lobe, lobe_half_width};
use super::peaks::Peak;
use super::periodogram::upper_median;
use super::settings::MIN_CYCLES;

/// Half width, in resolutions, of the neighbourhood of a component in which the noise is estimated from the
/// residual. The neighbourhood has 48 independent values of the spectrum, which determine the noise to 10 %.
pub(super) const NEIGHBOURHOOD: f64 = 12.0;
/// Smallest allowed half width, in resolutions, of the neighbourhood of a slow component in which the noise
/// is estimated.
const FEWEST_RESOLUTIONS: f64 = 3.0;
/// Factor by which the detection level rises for a slow component: only six values of the spectrum may then
/// determine the noise. With a probability of one in 100,000, noise exceeds 5.8 times the rms of six values,
/// but only 3.4 times the rms of many values.
const FEW_VALUES_FACTOR: f64 = 1.7;
/// Largest allowed ratio of the mean square of the residual to that of the noise floor, if the residual is to
/// count as noise. The floor is a median, accurate to a few hundredths; the residual of a drift or a step is
/// many times as large.
const NOISE_RATIO_LIMIT: f64 = 1.5;

impl ModelSelector<'_> {
    /// Whether the residual is no larger than the noise floor.
    pub(super) fn leaves_only_noise(&self, fit: &ModelFit) -> bool {
        let parts = &fit.model;
        let freedom =
            self.periodogram.sums.present as f64 - parts.problem.unknown_count(parts.terms()) as f64;
        let floor_m = self.periodogram.noise_sd_m(fit.peaks.floor_m);
        parts.solution.misfit < NOISE_RATIO_LIMIT * freedom.max(1.0) * floor_m * floor_m
    }

    /// Amplitude, m, that a term has in the windowed spectrum.
    pub(super) fn windowed_amplitude_m(&self, parts: &SineModel, k: usize) -> f64 {
        self.periodogram.amplitude_at(&parts.term_values(k), parts.terms()[k].cycles)
    }

    /// Amplitude, m, of the largest residual peak within the lobe of a term; 0 if noise alone may have caused
    /// it.
    pub(super) fn largest_peak_near(&self, fit: &ModelFit, term: &SineTerm) -> f64 {
        let near = fit.peaks.accepted.iter().filter(|p| is_in_lobe(self.cycles_of_peak(p), term));
        near.fold(0.0, |largest: f64, peak| largest.max(peak.amplitude_m))
    }

    /// Largest residual amplitude, m, near a component, whether at a peak or not; 0 if noise alone may have
    /// caused it. If a second oscillation is too close to be resolved, the residual is largest at the end of
    /// the lobe, where it has no peak.
    pub(super) fn significant_residual(&self, fit: &ModelFit, term: &SineTerm) -> f64 {
        let most = self.residual_near(fit, term);
        let noise_m = self.noise_floor_near(fit, term.cycles);
        if most > fit.peaks.detection * noise_m { most } else { 0.0 }
    }

    /// Largest residual amplitude near a component, m, noise included.
    pub(super) fn residual_near(&self, fit: &ModelFit, term: &SineTerm) -> f64 {
        let width = lobe_half_width(term) + 1.0;
        let next_to = self.residual_between(fit, term.cycles - width, term.cycles + width);
        next_to.iter().fold(0.0, |most: f64, a| most.max(*a))
    }

    /// Whether the amplitude of a slow term exceeds the residual near it times the detection ratio. The noise
    /// near a slow term is uncertain: few values determine it, and they include the residuals of other slow
    /// terms.
    pub(super) fn exceeds_residual(&self, fit: &ModelFit, k: usize) -> bool {
        let (parts, term) = (&fit.model, &fit.model.terms()[k]);
        let least_m = fit.peaks.detection * self.residual_near(fit, term);
        term.cycles <= NEIGHBOURHOOD && !term.is_transient() && self.windowed_amplitude_m(parts, k) > least_m
    }

    /// The noise floor, m, around a frequency, at least that of the whole spectrum. It is estimated locally,
    /// because the noise need not be white.
    pub(super) fn noise_floor_near(&self, fit: &ModelFit, cycles: f64) -> f64 {
        let near = self.noise_floor_between(fit, cycles - NEIGHBOURHOOD, cycles + NEIGHBOURHOOD);
        fit.peaks.floor_m.max(near)
    }

    /// The noise floor, m, between two frequencies, given in cycles in the record; 0 if no bin lies between
    /// them.
    pub(super) fn noise_floor_between(&self, fit: &ModelFit, low: f64, high: f64) -> f64 {
        let around = self.residual_between(fit, low, high).to_vec();
        upper_median(around).unwrap_or(0.0) / std::f64::consts::LN_2.sqrt()
    }

    /// Spectrum of the residual between two frequencies, given in cycles in the record.
    pub(super) fn residual_between<'b>(&self, fit: &'b ModelFit, low: f64, high: f64) -> &'b [f64] {
        let amplitude_m = &fit.amplitude_m[..];
        let bins_a_cycle = 2.0 * (amplitude_m.len() as f64 - 1.0) / self.samples.len() as f64;
        let bin = |cycles: f64| ((cycles.max(0.0) * bins_a_cycle) as usize).min(amplitude_m.len());
        amplitude_m.get(bin(low)..bin(high)).unwrap_or_default()
    }

    /// Residual peaks that no term explains: they lie outside the lobe of every term and stand out from the
    /// noise.
    pub(super) fn unexplained_peaks(&self, fit: &ModelFit) -> Vec<Peak> {
        let lowest = MIN_CYCLES.max(fit.model.trend().fastest_waves() + 1.0);
        let is_unexplained = |p: &Peak| {
            self.cycles_of_peak(p) >= lowest
                && self.is_new_peak(fit.model.terms(), p)
                && self.stands_out(fit, p)
        };
        fit.peaks.accepted.iter().copied().filter(is_unexplained).collect()
    }

    /// Whether a peak stands out from the noise around it.
    pub(super) fn stands_out(&self, fit: &ModelFit, peak: &Peak) -> bool {
        let noise_m = self.noise_floor_near(fit, self.cycles_of_peak(peak));
        peak.amplitude_m > fit.peaks.detection * noise_m
    }

    /// Whether a peak stands out from the noise in the octaves around it. A narrower neighbourhood would not
    /// do, because an oscillation that begins inside the record raises the residual there.
    pub(super) fn stands_out_widely(&self, fit: &ModelFit, peak: &Peak) -> bool {
        let noise_m = self.octave_noise_sd(fit, self.cycles_of_peak(peak));
        self.periodogram.noise_sd_m(peak.amplitude_m) > fit.peaks.detection * noise_m
    }

    /// Standard deviation, m, of the noise with which the amplitude of a term is compared.
    pub(super) fn noise_sd_for_term(&self, fit: &ModelFit, term: &SineTerm) -> f64 {
        let wide_m = if term.is_transient() {
            self.octave_noise_sd(fit, term.cycles)
        } else {
            self.periodogram.noise_sd_m(self.noise_floor_near(fit, term.cycles))
        };
        if term.cycles > NEIGHBOURHOOD {
            return wide_m;
        }
        // the noise of a shaking camera falls steeply with frequency, so the neighbourhood must not reach
        // down to zero frequency; its few values determine the noise less well, hence the factor
        let near = (term.cycles / 2.0).max(FEWEST_RESOLUTIONS);
        let few = self.noise_floor_between(fit, term.cycles - near, term.cycles + near);
        wide_m.max(FEW_VALUES_FACTOR * self.periodogram.noise_sd_m(few))
    }
}
