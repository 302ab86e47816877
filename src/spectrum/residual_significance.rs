//! What the parts of a record leave: noise, or peaks that no term explains.

use super::least_squares::SinusoidTerm;
use super::model_selection::{Decomposition, ModelSelector, SinusoidModel, lobe_half_width};
use super::peaks::Peak;
use super::settings::MIN_CYCLES;

/// Half width of the neighbourhood whose rest is the noise of a component, resolutions: 48 independent values
/// of the spectrum, so that the noise is known to a tenth.
pub(super) const NEIGHBOURHOOD: f64 = 12.0;
/// Least half width of a neighbourhood below that, resolutions, and what the detection must rise by: of noise
/// whose size is known from six values, the chance of one in 100,000 is met at 5.8 times the rms, not at 3.4.
const FEWEST_RESOLUTIONS: f64 = 3.0;
const FEW_VALUES_FACTOR: f64 = 1.7;
/// Mean square of what is left over that of the noise floor, up to which noise is all that is left: the floor
/// is a median, known to a few hundredths, and what drifts or steps leaves many times as much.
const NOISE_RATIO_LIMIT: f64 = 1.5;

impl ModelSelector<'_> {
    /// Whether what is left is no larger than the noise floor says.
    pub(super) fn leaves_only_noise(&self, explained: &Decomposition) -> bool {
        let parts = &explained.model;
        let freedom =
            self.periodogram.sums.present as f64 - parts.problem.unknown_count(&parts.solution.terms) as f64;
        let floor_m = self.periodogram.noise_sd_m(explained.peaks.floor_m);
        parts.solution.misfit < NOISE_RATIO_LIMIT * freedom.max(1.0) * floor_m * floor_m
    }

    /// Amplitude of a term in the spectrum, m.
    pub(super) fn windowed_amplitude_m(&self, parts: &SinusoidModel, k: usize) -> f64 {
        self.periodogram
            .amplitude_at(&parts.problem.term_values(&parts.solution, k), parts.solution.terms[k].cycles)
    }

    /// The largest peak left within the lobe of a term, m; 0 where noise alone may have made it.
    pub(super) fn largest_peak_near(&self, explained: &Decomposition, term: &SinusoidTerm) -> f64 {
        let near = explained
            .peaks
            .accepted
            .iter()
            .filter(|p| (self.cycles_of_peak(p) - term.cycles).abs() < lobe_half_width(term));
        near.fold(0.0, |largest: f64, peak| largest.max(peak.amplitude_m))
    }

    /// The most that is left next to a term, m, at a peak or not; 0 where noise alone may have made it. What
    /// a companion too close to be resolved leaves stands at the end of the lobe, where it is no peak of its
    /// own.
    pub(super) fn significant_residual_near(&self, explained: &Decomposition, term: &SinusoidTerm) -> f64 {
        let most = self.largest_residual_near(explained, term);
        if most > explained.peaks.detection * self.noise_floor_near(explained, term.cycles) {
            most
        } else {
            0.0
        }
    }

    /// The most that is left next to a term, m, noise or not.
    pub(super) fn largest_residual_near(&self, explained: &Decomposition, term: &SinusoidTerm) -> f64 {
        let width = lobe_half_width(term) + 1.0;
        let next_to = self.residual_spectrum_between(explained, term.cycles - width, term.cycles + width);
        next_to.iter().fold(0.0, |most: f64, a| most.max(*a))
    }

    /// Whether a slow term stands out of all that is left next to it as it must of noise: few values say what
    /// noise is there, and what other slow terms leave is among them.
    pub(super) fn exceeds_slow_residuals(&self, explained: &Decomposition, k: usize) -> bool {
        let (parts, term) = (&explained.model, &explained.model.solution.terms[k]);
        let least_m = explained.peaks.detection * self.largest_residual_near(explained, term);
        term.cycles <= NEIGHBOURHOOD && !term.is_transient() && self.windowed_amplitude_m(parts, k) > least_m
    }

    /// The noise floor around a frequency, m, but no less than that of the whole spectrum: noise need not be
    /// white.
    pub(super) fn noise_floor_near(&self, explained: &Decomposition, cycles: f64) -> f64 {
        let near = self.noise_floor_between(explained, cycles - NEIGHBOURHOOD, cycles + NEIGHBOURHOOD);
        explained.peaks.floor_m.max(near)
    }

    /// The noise floor between two frequencies, cycles in the record, m; 0 where nothing lies between them.
    pub(super) fn noise_floor_between(&self, explained: &Decomposition, low: f64, high: f64) -> f64 {
        let mut around = self.residual_spectrum_between(explained, low, high).to_vec();
        let middle = around.len() / 2;
        let median =
            if around.is_empty() { 0.0 } else { *around.select_nth_unstable_by(middle, f64::total_cmp).1 };
        median / std::f64::consts::LN_2.sqrt()
    }

    /// The spectrum of what is left between two frequencies, cycles in the record.
    pub(super) fn residual_spectrum_between<'b>(
        &self,
        explained: &'b Decomposition,
        low: f64,
        high: f64,
    ) -> &'b [f64] {
        let amplitude_m = &explained.amplitude_m[..];
        let bins_a_cycle = 2.0 * (amplitude_m.len() as f64 - 1.0) / self.samples.len() as f64;
        let bin = |cycles: f64| ((cycles.max(0.0) * bins_a_cycle) as usize).min(amplitude_m.len());
        amplitude_m.get(bin(low)..bin(high)).unwrap_or_default()
    }

    /// Peaks left that no term has in its lobe: what stands there is no decaying oscillation.
    pub(super) fn unexplained_peaks(&self, explained: &Decomposition) -> Vec<Peak> {
        let lowest = MIN_CYCLES.max(explained.model.trend().fastest_waves() + 1.0);
        let accepted = explained.peaks.accepted.iter().copied();
        accepted
            .filter(|p| {
                self.cycles_of_peak(p) >= lowest
                    && self.is_new_peak(&explained.model.solution.terms, p)
                    && self.stands_out(explained, p)
            })
            .collect()
    }

    /// Whether a peak stands out of the noise around it.
    pub(super) fn stands_out(&self, explained: &Decomposition, peak: &Peak) -> bool {
        peak.amplitude_m
            > explained.peaks.detection * self.noise_floor_near(explained, self.cycles_of_peak(peak))
    }

    /// Whether a peak stands out of the octaves around it: what begins inside the record raises its own
    /// neighbourhood.
    pub(super) fn stands_out_widely(&self, explained: &Decomposition, peak: &Peak) -> bool {
        let noise_m = self.noise_sd_of_octaves(explained, self.cycles_of_peak(peak));
        self.periodogram.noise_sd_m(peak.amplitude_m) > explained.peaks.detection * noise_m
    }

    /// Deviation of the noise that a term must stand out of, m.
    pub(super) fn noise_sd_for_term(&self, explained: &Decomposition, term: &SinusoidTerm) -> f64 {
        let wide_m = if term.is_transient() {
            self.noise_sd_of_octaves(explained, term.cycles)
        } else {
            self.periodogram.noise_sd_m(self.noise_floor_near(explained, term.cycles))
        };
        if term.cycles > NEIGHBOURHOOD {
            return wide_m;
        }
        // the noise of what shakes falls steeply: where a neighbourhood would reach down to zero, a few
        // values say what it is, less surely
        let near = (term.cycles / 2.0).max(FEWEST_RESOLUTIONS);
        let few = self.noise_floor_between(explained, term.cycles - near, term.cycles + near);
        wide_m.max(FEW_VALUES_FACTOR * self.periodogram.noise_sd_m(few))
    }
}
