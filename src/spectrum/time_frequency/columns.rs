//! Transforms of the segments.

use super::segment::SegmentLayout;
use crate::spectrum::transform::RealTransform;
use crate::spectrum::window;
use std::ops::RangeInclusive;

/// Bins for each resolution at least; the power of two above a segment makes up to twice as many.
const FINE_PADDING: usize = 4;
/// The same where only a maximum is sought: a Hann lobe seen at half its resolution is at most 0.4 dB low.
const COARSE_PADDING: usize = 2;
/// Share of the window's weight that must be present.
const LEAST_PRESENT: f64 = 0.5;

/// The bins of a transform.
pub(super) struct SegmentBins {
    /// Length of the transform, samples.
    pub padded: usize,
}

impl SegmentBins {
    /// Those of a spectrogram.
    pub(super) fn fine(layout: &SegmentLayout) -> Self {
        Self { padded: (FINE_PADDING * layout.frames).next_power_of_two() }
    }

    /// Those that are enough for a maximum.
    pub(super) fn coarse(layout: &SegmentLayout) -> Self {
        Self { padded: (COARSE_PADDING * layout.frames).next_power_of_two() }
    }

    /// From zero to half the frame rate.
    pub(super) fn all_bins(&self) -> RangeInclusive<usize> {
        0..=self.padded / 2
    }

    /// Those in a band, at least one.
    pub(super) fn bins_in_band(&self, (low, high): (f64, f64), frame_rate_hz: f64) -> RangeInclusive<usize> {
        let bin = |hz: f64| hz / frame_rate_hz * self.padded as f64;
        let first = (bin(low).ceil() as usize).min(self.padded / 2);
        first..=(bin(high).floor() as usize).clamp(first, self.padded / 2)
    }

    /// Amplitudes of each segment in some of the bins, m; `None` where too much is missing.
    pub(super) fn column_amplitudes(
        &self,
        samples: &[Option<f64>],
        layout: &SegmentLayout,
        bins: RangeInclusive<usize>,
    ) -> Vec<Option<Vec<f64>>> {
        let transform = RealTransform::new(self.padded);
        let window = window::hann_weights(&vec![Some(0.0); layout.frames]);
        let whole: f64 = window.iter().sum();
        let column = |c: usize| {
            let segment = samples.get(layout.first_frame(c)..layout.first_frame(c) + layout.frames)?;
            let present: f64 =
                segment.iter().zip(&window).map(|(x, w)| if x.is_some() { *w } else { 0.0 }).sum();
            let scale = 2.0 / present;
            let weighted = || segment.iter().zip(&window).map(|(x, w)| x.map_or(0.0, |x| x * w * scale));
            let amplitudes = || {
                transform
                    .squared_magnitudes(weighted())
                    .get(bins.clone())
                    .unwrap_or_default()
                    .iter()
                    .map(|square| square.sqrt())
                    .collect()
            };
            (present >= LEAST_PRESENT * whole).then(amplitudes)
        };
        (0..layout.columns).map(column).collect()
    }
}
