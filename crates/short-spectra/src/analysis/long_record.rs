//! Records too long for a fit: components from the windowed periodogram, judged by the same criteria.
//!
//! Decay and drift are not fitted. Instead, each component is measured in pieces of the record. A component
//! that keeps its amplitude and phase is a steady line; the frequency of any other component is known only to
//! the width of its peak. A component that lasts only for a short time is estimated from the pieces that
//! contain it.

mod transients;

use super::{RemovedTrend, SpectralAnalysis};
use crate::classification::{Evidence, RecordContext, classify_components};
use crate::record::SampledRecord;
use crate::trend::Trend;
use crate::{Component, Detrend, Spectrum, SpectrumError, SpectrumSettings, analyse_spectrum, periodogram};
use portable_math as math;
use rayon::prelude::*;
use std::f64::consts::{LN_2, TAU};
use transients::Transient;

/// Number of pieces, overlapping by half, in which the amplitude and phase of a component are measured.
const PHASE_SEGMENTS: usize = 31;
/// Number of independent values among those measured in the overlapping pieces.
const INDEPENDENT_SEGMENTS: f64 = 16.0;
/// Largest allowed scatter of a steady line over the pieces, as a fraction of its amplitude. If
/// `STEADY_SCATTER_IN_NOISE` allows more, that limit applies.
const STEADY_SCATTER: f64 = 0.25;
/// Largest allowed scatter of a steady line over the pieces, as a multiple of the noise in a piece. If
/// `STEADY_SCATTER` allows more, that limit applies.
const STEADY_SCATTER_IN_NOISE: f64 = 1.7;
/// Ratio of the width of a uniform distribution to its standard deviation, the square root of 12.
const UNIFORM_WIDTH_IN_SD: f64 = 3.464_101_615_137_754_6;
/// Half width, in resolutions, of the band around a frequency in which the noise is measured: the noise
/// follows from the median of the spectrum in this band.
const NEIGHBOURHOOD: f64 = 40.0;
/// Ratio of a peak to the noise of its neighbourhood above which it is a component; noise alone reaches this
/// ratio in one of a hundred spectra of a million frames.
const DETECTION: f64 = 4.5;

pub(super) fn analyse_long_record(
    record: &SampledRecord,
    settings: &SpectrumSettings,
    trend: Trend,
) -> Result<SpectralAnalysis, SpectrumError> {
    let mut spectrum = analyse_spectrum(record.samples, record.frame_rate_hz, settings)?;
    let context = RecordContext::new(record, spectrum.resolution_hz, settings);
    let removed_m = trend.fit_values(record.samples);
    let left_m: Vec<Option<f64>> =
        record.samples.iter().zip(&removed_m).map(|(x, removed)| x.map(|x| x - removed)).collect();
    let assess = |c: &Component| assess_component(&spectrum, &left_m, record.frame_rate_hz, c);
    let lines: Vec<(Component, Evidence)> = spectrum.components.par_iter().filter_map(assess).collect();
    let brief = transients::find_transients(record, settings);
    spectrum.components = merge_components(lines, brief, &context, settings.max_components);
    Ok(SpectralAnalysis {
        spectrum,
        skipped_frames: 0,
        stride: 1,
        removed: RemovedTrend {
            detrend: settings.detrend.unwrap_or(Detrend::Cubic),
            relaxations: 0,
            steps: 0,
        },
        leakage_m: Vec::new(),
        model_m: vec![0.0; record.samples.len()],
        residual_m: left_m,
        removed_m,
        oscillations: Vec::new(),
        ridge: None,
        multitaper: None,
        noise_floor_m: Vec::new(),
    })
}

/// Lines and short-lived components in one list without duplicates, largest first.
fn merge_components(
    mut lines: Vec<(Component, Evidence)>,
    mut brief: Vec<Transient>,
    context: &RecordContext,
    most: usize,
) -> Vec<Component> {
    let known = |b: &Transient| {
        lines.iter().any(|(c, line)| b.matches_component(c) && !(line.changes && b.is_more_specific()))
    };
    brief.retain(|b| !known(b));
    lines.retain(|(c, line)| !(line.changes && brief.iter().any(|b| b.explains_component(c))));
    // the peaks of a step could fill the list: more accurate components come first
    let better = brief.len() + lines.iter().filter(|(_, line)| !line.changes).count();
    let mut room = 0..most.saturating_sub(better);
    lines.retain(|(_, line)| !line.changes || room.next().is_some());
    let (mut components, evidence): (Vec<Component>, Vec<Evidence>) = lines.into_iter().unzip();
    classify_components(&mut components, &evidence, context);
    components.extend(brief.into_iter().map(|b| b.component));
    math::sort_by_number(&mut components, |a| -a.amplitude_m);
    components.truncate(most);
    components
}

/// A component with the evidence of the whole record; `None` if it does not stand out from the noise around
/// it.
fn assess_component(
    spectrum: &Spectrum,
    left_m: &[Option<f64>],
    frame_rate_hz: f64,
    c: &Component,
) -> Option<(Component, Evidence)> {
    let floor_m = local_noise_floor_m(spectrum, c.frequency_hz);
    if c.amplitude_m <= DETECTION * floor_m {
        return None;
    }
    let changes = !is_steady(left_m, frame_rate_hz, c, floor_m);
    let width_hz = if changes { half_maximum_width_hz(spectrum, c) } else { 0.0 };
    let frequency_sd_hz = math::hypot(c.frequency_sd_hz, width_hz / UNIFORM_WIDTH_IN_SD);
    let evidence = Evidence { changes, ..Evidence::default() };
    Some((Component { frequency_sd_hz, ..c.clone() }, evidence))
}

/// Full width, Hz, of a peak at half its amplitude; the frequency of a changing oscillation lies within it.
fn half_maximum_width_hz(spectrum: &Spectrum, c: &Component) -> f64 {
    let top = spectrum.frequency_hz.partition_point(|hz| *hz < c.frequency_hz);
    let (before, behind) = spectrum.amplitude_m.split_at(top.min(spectrum.amplitude_m.len()));
    let stays = |a: &&f64| **a > c.amplitude_m / 2.0;
    let bins = before.iter().rev().take_while(stays).count() + behind.iter().take_while(stays).count();
    bins as f64 * spectrum.frequency_hz.get(1).copied().unwrap_or_default()
}

/// The noise floor around a frequency, m; the noise need not be white.
fn local_noise_floor_m(spectrum: &Spectrum, frequency_hz: f64) -> f64 {
    let bin_hz = spectrum.frequency_hz.get(1).copied().unwrap_or(f64::INFINITY);
    let bin = |hz: f64| ((hz / bin_hz).max(0.0) as usize).min(spectrum.amplitude_m.len());
    let reach_hz = NEIGHBOURHOOD * spectrum.resolution_hz;
    let inside = bin(frequency_hz - reach_hz)..bin(frequency_hz + reach_hz);
    let around = spectrum.amplitude_m.get(inside).unwrap_or_default().to_vec();
    periodogram::upper_median(around)
        .map_or(spectrum.noise_floor_m, |m| spectrum.noise_floor_m.max(m / LN_2.sqrt()))
}

/// Whether a component keeps its amplitude and phase over the pieces of the record, each weighted with a Hann
/// window.
fn is_steady(left_m: &[Option<f64>], frame_rate_hz: f64, c: &Component, floor_m: f64) -> bool {
    let length = 2 * left_m.len() / (PHASE_SEGMENTS + 1);
    let hann = periodogram::hann_weights(&vec![Some(0.0); length]);
    let turn = -TAU * c.frequency_hz / frame_rate_hz;
    let piece = |k: usize| {
        let first = k * length / 2;
        let samples = left_m.get(first..first + length).unwrap_or_default();
        let add = |[re, im, sum]: [f64; 3], (i, (x, w)): (usize, (&Option<f64>, &f64))| match x {
            Some(x) => {
                let (sine, cosine) = math::sin_cos(turn * (first + i) as f64);
                [re + w * x * cosine, im + w * x * sine, sum + w]
            }
            None => [re, im, sum],
        };
        let [re, im, sum] = samples.iter().zip(&hann).enumerate().fold([0.0; 3], add);
        (sum > 0.0).then(|| [2.0 * re / sum, 2.0 * im / sum])
    };
    let pieces: Vec<[f64; 2]> = (0..PHASE_SEGMENTS).filter_map(piece).collect();
    let count = pieces.len().max(1) as f64;
    let mean = [0, 1].map(|part| pieces.iter().map(|piece| piece[part]).sum::<f64>() / count);
    let off = |piece: &[f64; 2]| math::powi(piece[0] - mean[0], 2) + math::powi(piece[1] - mean[1], 2);
    let scatter_m = (pieces.iter().map(off).sum::<f64>() / count).sqrt();
    let noise_m = floor_m * INDEPENDENT_SEGMENTS.sqrt();
    scatter_m < (STEADY_SCATTER * c.amplitude_m).max(STEADY_SCATTER_IN_NOISE * noise_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ComponentVerdict, Estimator};

    const RATE_HZ: f64 = 5000.0;
    const FRAMES: usize = 40_000;

    /// A ring-down: frequency, Hz, damping ratio, amplitude, m, first frame.
    struct Rings(f64, f64, f64, usize);

    impl Rings {
        fn at_m(&self, frame: usize) -> f64 {
            let Self(hz, ratio, amplitude_m, first) = *self;
            let Some(since) = frame.checked_sub(first) else { return 0.0 };
            let turn = TAU * hz * since as f64 / RATE_HZ;
            amplitude_m * (-ratio * turn).exp() * (turn + 0.4).cos()
        }
    }

    /// The components of a record with noise of standard deviation 1 um.
    fn components(value: impl Fn(usize) -> f64) -> Vec<Component> {
        let mut seed = 5_u64;
        let mut draw = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let noise_m = 1e-6 * 12.0_f64.sqrt();
        let samples: Vec<Option<f64>> = (0..FRAMES).map(|i| Some(value(i) + noise_m * draw())).collect();
        let record = SampledRecord { samples: &samples, frame_rate_hz: RATE_HZ, exposure_s: None };
        SpectralAnalysis::from_record(&record, &SpectrumSettings::default()).unwrap().spectrum.components
    }

    /// The components of a record with ring-downs and a steady oscillation of 10 um at 900.5 Hz.
    fn listed(rings: &[Rings]) -> Vec<Component> {
        let steady = |i: usize| 1e-5 * (TAU * 900.5 * i as f64 / RATE_HZ).cos();
        components(|i| steady(i) + rings.iter().map(|r| r.at_m(i)).sum::<f64>())
    }

    fn near(list: &[Component], hz: f64) -> &Component {
        let mut near = list.iter().filter(|c| (c.frequency_hz - hz).abs() < 0.05 * hz);
        let found = near.next().unwrap_or_else(|| panic!("{hz} Hz: {list:?}"));
        assert!(near.next().is_none(), "{hz} Hz twice: {list:?}");
        found
    }

    fn assert_read(c: &Component, Rings(hz, ratio, _, first): &Rings) {
        assert_eq!((c.estimator, c.verdict), (Estimator::LeastSquares, ComponentVerdict::Clear), "{c:?}");
        assert!((c.frequency_hz - hz).abs() < 4.0 * c.frequency_sd_hz, "{hz} Hz: {c:?}");
        let off = (c.damping_ratio.unwrap() - ratio).abs() / c.damping_ratio_sd.unwrap();
        assert!(off < 4.0, "{ratio}: {c:?}");
        let begins = c.begins_s.map_or(0.0, |begins_s| begins_s * RATE_HZ);
        assert!((begins - *first as f64).abs() < 5.0, "frame {first}: {c:?}");
    }

    #[test]
    fn a_ring_down_inside_is_read_with_its_beginning_and_the_steady_line_once() {
        let rings = Rings(413.0, 0.02, 3e-5, 23_456);
        let list = listed(&[Rings(413.0, 0.02, 3e-5, 23_456)]);
        assert_eq!(list.len(), 2, "{list:?}");
        assert_read(near(&list, 413.0), &rings);
        let steady = near(&list, 900.5);
        assert_eq!((steady.estimator, steady.verdict), (Estimator::Periodogram, ComponentVerdict::Clear));
        assert_eq!(steady.begins_s, None);
    }

    #[test]
    fn a_ring_down_that_is_over_soon_after_the_first_frame_is_read() {
        let list = listed(&[Rings(600.0, 0.05, 3e-5, 0)]);
        assert_eq!(list.len(), 2, "{list:?}");
        assert_read(near(&list, 600.0), &Rings(600.0, 0.05, 3e-5, 0));
        assert_eq!(near(&list, 600.0).begins_s, None);
        // the ring-down ends after twenty frames, which a window that is zero at its ends hides
        let list = listed(&[Rings(1200.0, 0.08, 3e-5, 0)]);
        assert!((near(&list, 1200.0).frequency_hz - 1200.0).abs() < 30.0, "{list:?}");
    }

    #[test]
    fn a_jump_at_the_start_of_a_ring_down_is_no_other_one() {
        let jumps =
            |t: f64| if t < 5.0 { 0.0 } else { 1e-4 * (-28.3 * (t - 5.0)).exp() * (942.5 * (t - 5.0)).cos() };
        let list = components(|i| jumps(i as f64 / RATE_HZ));
        assert!(list.iter().all(|c| (c.frequency_hz - 150.0).abs() < 1.0), "{list:?}");
    }

    #[test]
    fn of_two_ring_downs_of_one_frequency_one_is_listed_and_a_weaker_one_of_another_too() {
        let list = listed(&[
            Rings(150.0, 0.03, 1e-4, 9_000),
            Rings(150.0, 0.03, 1e-4, 30_000),
            Rings(520.0, 0.02, 2e-5, 20_000),
        ]);
        assert_eq!(list.len(), 3, "{list:?}");
        let first = if near(&list, 150.0).begins_s < Some(3.0) { 9_000 } else { 30_000 };
        assert_read(near(&list, 150.0), &Rings(150.0, 0.03, 1e-4, first));
        assert_read(near(&list, 520.0), &Rings(520.0, 0.02, 2e-5, 20_000));
    }

    #[test]
    fn steady_lines_and_noise_are_listed_as_they_were() {
        let list = listed(&[]);
        assert_eq!(list.len(), 1, "{list:?}");
        assert_eq!(near(&list, 900.5).estimator, Estimator::Periodogram);
    }

    #[test]
    fn what_goes_on_outside_the_piece_that_shows_it_is_not_clear() {
        let drifts = |i: usize| 2e-5 * (TAU * (400.0 + 4.0 * i as f64 / RATE_HZ) * i as f64 / RATE_HZ).cos();
        let list = components(drifts);
        assert!(
            !list.is_empty() && list.iter().all(|c| c.verdict == ComponentVerdict::Ambiguous),
            "{list:?}"
        );
    }
}
