//! Noise of a segment once its component is taken out.

use super::chirp::ChirpParameters;
use crate::spectrum::transform::RealTransform;
use crate::spectrum::window;

/// Half width of the lobe of a Hann window, resolutions.
const LOBE: f64 = 2.0;
/// Multiples of the component that are left out: the cycle of stick and slip is no sine.
const HARMONICS: usize = 3;
/// The noise is a median over at least this many resolutions.
const FEWEST_RESOLUTIONS: f64 = 20.0;
/// Fewest bins of a median; with fewer left, harmonics are not left out.
const FEWEST_BINS: usize = 8;
/// Neighbours to either side of which a column takes the median: one segment's length, so that a column's own
/// few bins do not decide.
const NEIGHBOURS: usize = 4;

/// Measures the noise of segments of one length.
pub(super) struct SegmentNoise {
    transform: RealTransform,
    window: Vec<f64>,
    padded: usize,
    /// Band of the component, cycles in the segment.
    band: (f64, f64),
}

impl SegmentNoise {
    pub(super) fn new(frames: usize, band: (f64, f64)) -> Self {
        let padded = (frames + 1).next_power_of_two();
        Self {
            transform: RealTransform::new(padded),
            window: window::hann_weights(&vec![Some(0.0); frames]),
            padded,
            band,
        }
    }

    /// What is left of a segment less a shape.
    pub(super) fn measure_residual(&self, segment: &[Option<f64>], shape: &ChirpParameters) -> ResidualNoise {
        let weighted = segment.iter().zip(shape.values(segment.len())).zip(&self.window);
        let powers = self.transform.squared_magnitudes(
            weighted.map(|((sample, value), w)| sample.map_or(0.0, |sample| w * (sample - value))),
        );
        let squares: f64 = segment
            .iter()
            .zip(&self.window)
            .map(|(sample, w)| if sample.is_some() { w * w } else { 0.0 })
            .sum();
        let cycles = |bin: usize| bin as f64 * self.window.len() as f64 / self.padded as f64;
        let top = self.band.1.max(self.band.0 + FEWEST_RESOLUTIONS);
        let band: Vec<usize> =
            (1..powers.len()).filter(|bin| cycles(*bin) >= self.band.0 && cycles(*bin) <= top).collect();
        let of = |chosen: &dyn Fn(f64) -> bool| {
            band.iter().filter(|bin| chosen(cycles(**bin))).map(|bin| powers[*bin]).collect::<Vec<f64>>()
        };
        let apart = Some(of(&|cycles| is_outside_harmonics(cycles, shape)))
            .filter(|apart| apart.len() >= FEWEST_BINS)
            .unwrap_or_else(|| of(&|_| true));
        let under = of(&|cycles| is_in_harmonic_lobe(cycles, shape, 1));
        let mean = under.iter().sum::<f64>() / under.len().max(1) as f64;
        let deviation = |power: f64| if squares > 0.0 { (power / squares).sqrt() } else { 0.0 };
        // powers of noise are distributed exponentially: their median is the mean times ln 2
        ResidualNoise {
            around_m: deviation(upper_median(apart).unwrap_or(0.0) / std::f64::consts::LN_2),
            under_m: deviation(mean),
        }
    }
}

/// Standard deviations in a frame of the white noise that would leave as much, m.
#[derive(Debug, Clone, Copy)]
pub(super) struct ResidualNoise {
    /// In the band, at least 20 resolutions of it, next to the component and its multiples: the noise.
    pub around_m: f64,
    /// Where the component was: more than the noise where it is no such sinusoid.
    pub under_m: f64,
}

fn is_in_harmonic_lobe(cycles: f64, shape: &ChirpParameters, multiple: usize) -> bool {
    let k = multiple as f64;
    (cycles - k * shape.cycles_at(0.0)).abs() <= LOBE + k * shape.change().abs() / 2.0
}

fn is_outside_harmonics(cycles: f64, shape: &ChirpParameters) -> bool {
    !(1..=HARMONICS).any(|k| is_in_harmonic_lobe(cycles, shape, k))
}

/// The median of each column and its neighbours.
pub(super) fn median_filter(deviations: &[Option<f64>]) -> Vec<f64> {
    let around =
        |c: usize| &deviations[c.saturating_sub(NEIGHBOURS)..(c + NEIGHBOURS + 1).min(deviations.len())];
    (0..deviations.len())
        .map(|c| upper_median(around(c).iter().flatten().copied().collect()).unwrap_or(0.0))
        .collect()
}

/// The upper median; `None` of nothing.
pub(super) fn upper_median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}
