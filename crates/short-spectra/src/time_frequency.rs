//! Short-time spectra of a record, and the frequency over time of the strongest component in a band, for a
//! component whose frequency drifts.
//!
//! The frequency of an oscillation may follow a slow change of its source. A spectrum of the whole record
//! then smears the oscillation over all frequencies that it passes. [`Spectrogram`] cuts the record into
//! overlapping Hann-weighted segments, one per column. [`Spectrogram::find_ridge`] follows the strongest
//! component from column to column (`time_frequency/ridge_tracking.rs`) and then fits to each segment a
//! sinusoid whose frequency and amplitude change linearly (`time_frequency/chirp.rs`). The fitted frequency
//! is that at the centre of the segment, unlike the frequency of a maximum between bins. The fitted rate
//! extrapolates the frequency to the ends of the record, which are half a segment beyond the outermost
//! centres.
//!
//! Accuracy: the range of a chirp from 359 to 692 Hz in 0.1 to 0.6 s at 20 dB is estimated within 2 %, also
//! with harmonics, a residue of a ring-down, or a fifth of the frames missing. Limits: if the frequency
//! swings within a segment (because it follows a faster ring-down), the result is its mean, with larger
//! standard deviations. If the frequency turns round at the very end of a record of a tenth of a second, it
//! is extrapolated 2 to 3 % too far.

mod chirp;
pub mod course;
mod ridge;
mod ridge_tracking;
mod slow_motion;

use super::error::{SpectrumError, check_record};
use super::periodogram;
use super::settings::{MIN_SAMPLES, SpectrumSettings};
use super::transform::RealTransform;
pub use course::SpeedPoint;
use portable_math as math;
pub use ridge::{FrequencyRange, Ridge, RidgeEnd, RidgePoint};
pub use slow_motion::subtract_slow_motion;
use std::ops::RangeInclusive;

/// Maximum number of frames of a segment whose length is chosen from the data; it limits the bins of a
/// column.
const LONGEST_SEGMENT_FRAMES: usize = 2048;
/// Minimum number of segments that fit end to end into a record, so that a component that lasts only half the
/// record still has a ridge.
const FEWEST_SEGMENTS: usize = 3;
/// Ratio of successive segment lengths that are tried.
const LENGTH_RATIO: f64 = std::f64::consts::SQRT_2;
/// Fraction of the best concentration, -1.5 dB, that is sufficient for a segment length. The shortest
/// sufficient length is used, because shorter segments follow a drift more closely.
const NEARLY_BEST_CONCENTRATION: f64 = 0.7;
/// Number of columns from which the concentration of a segment length is computed; more would only cost time.
const TRIED_COLUMNS: usize = 48;

/// Layout of segments of the length that shows the strongest component of the band best.
pub(super) fn choose_segment_layout(
    samples: &[Option<f64>],
    frame_rate_hz: f64,
    band_hz: (f64, f64),
) -> SegmentLayout {
    let record = samples.len();
    let most = (record / FEWEST_SEGMENTS).min(LONGEST_SEGMENT_FRAMES).max(FEWEST_FRAMES.min(record));
    let least =
        (SEGMENT_CYCLES * frame_rate_hz / band_hz.0).min(most as f64).max(FEWEST_FRAMES.min(record) as f64);
    // at most seven doublings
    let steps = (math::ln(most as f64 / least) / math::ln(LENGTH_RATIO)).floor().max(0.0) as i32;
    let lengths: Vec<usize> = (0..=steps).map(|k| (least * math::powi(LENGTH_RATIO, k)) as usize).collect();
    let concentration = |frames: &usize| {
        let layout = SegmentLayout::with_overlap(record, *frames, 2, TRIED_COLUMNS);
        peak_concentration(samples, &layout, frame_rate_hz, band_hz)
    };
    let concentrations: Vec<f64> = lengths.iter().map(concentration).collect();
    let best = concentrations.iter().fold(0.0, |m: f64, c| m.max(*c));
    let shortest = concentrations.iter().position(|c| *c >= NEARLY_BEST_CONCENTRATION * best).unwrap_or(0);
    SegmentLayout::with_overlap(record, lengths[shortest], OVERLAP, MOST_COLUMNS)
}

/// Concentration of a segment length: ratio of the geometric mean of the squared maxima of the columns to the
/// noise power in a bin, up to a constant factor. The noise power is inversely proportional to the length of
/// a segment. The geometric mean weighs columns with a large and a small component alike.
fn peak_concentration(
    samples: &[Option<f64>],
    layout: &SegmentLayout,
    frame_rate_hz: f64,
    band_hz: (f64, f64),
) -> f64 {
    let bins = SegmentBins::new(layout, COARSE_PADDING);
    let columns = bins.column_amplitudes(samples, layout, bins.bins_in_band(band_hz, frame_rate_hz));
    let maximum = |column: &Vec<f64>| column.iter().fold(f64::MIN_POSITIVE, |m: f64, a| m.max(*a));
    let logarithms = columns.iter().flatten().map(|column| math::ln(maximum(column)));
    let (sum, count) = logarithms.fold((0.0, 0), |(sum, count), log| (sum + 2.0 * log, count + 1));
    layout.frames as f64 * math::exp(sum / f64::from(count.max(1)))
}

/// Minimum number of bins per resolution of a spectrogram; rounding up to a power of two gives up to twice as
/// many.
pub(super) const FINE_PADDING: usize = 4;
/// Minimum number of bins per resolution if only the maximum of a column is needed: a Hann lobe sampled at
/// every half resolution is at most 0.4 dB too low.
const COARSE_PADDING: usize = 2;
/// Smallest allowed fraction of the window's weight that lies on frames with a value.
const LEAST_PRESENT: f64 = 0.5;

/// The frequency bins of the transform of a segment.
pub(super) struct SegmentBins {
    /// Length of the transform, samples.
    pub padded: usize,
}

impl SegmentBins {
    pub(super) fn new(layout: &SegmentLayout, padding: usize) -> Self {
        Self { padded: (padding * layout.frames).next_power_of_two() }
    }

    /// The bins from zero to half the frame rate.
    pub(super) fn all_bins(&self) -> RangeInclusive<usize> {
        0..=self.padded / 2
    }

    /// Bins in a band, at least one.
    pub(super) fn bins_in_band(&self, (low, high): (f64, f64), frame_rate_hz: f64) -> RangeInclusive<usize> {
        let bin = |hz: f64| hz / frame_rate_hz * self.padded as f64;
        let first = (bin(low).ceil() as usize).min(self.padded / 2);
        first..=(bin(high).floor() as usize).clamp(first, self.padded / 2)
    }

    /// Amplitudes, m, of each segment in the given bins; `None` for a segment with too few frames present.
    pub(super) fn column_amplitudes(
        &self,
        samples: &[Option<f64>],
        layout: &SegmentLayout,
        bins: RangeInclusive<usize>,
    ) -> Vec<Option<Vec<f64>>> {
        let transform = RealTransform::new(self.padded);
        let window = periodogram::hann_weights(&vec![Some(0.0); layout.frames]);
        let whole: f64 = window.iter().sum();
        let column = |c: usize| {
            let segment = samples.get(layout.first_frame(c)..layout.first_frame(c) + layout.frames)?;
            let weighted = || segment.iter().zip(&window);
            let present: f64 = weighted().map(|(x, w)| if x.is_some() { *w } else { 0.0 }).sum();
            if present < LEAST_PRESENT * whole {
                return None;
            }
            let scale = 2.0 / present;
            let values = weighted().map(|(x, w)| x.map_or(0.0, |x| x * w * scale));
            let squares = transform.squared_magnitudes(values);
            Some(squares.get(bins.clone()).unwrap_or_default().iter().map(|square| square.sqrt()).collect())
        };
        (0..layout.columns).map(column).collect()
    }
}

/// Maximum number of columns of a spectrogram: a figure shows no more, and memory must not grow with the
/// record.
pub const MOST_COLUMNS: usize = 400;
/// Minimum number of cycles in a segment for a component at the lower end of the band. The lobe of a Hann
/// window is two resolutions wide on either side, so with four cycles the lobe overlaps neither zero
/// frequency nor the component's own mirror image.
pub(crate) const SEGMENT_CYCLES: f64 = 4.0;
/// Minimum number of frames of a segment: three for each of the five unknowns of the fit, plus one.
pub(super) const FEWEST_FRAMES: usize = 16;
/// Number of columns per segment length: Hann windows a quarter of their length apart share most of their
/// weight.
pub(super) const OVERLAP: usize = 4;

/// Segments of a record; all lengths are in frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct SegmentLayout {
    pub frames: usize,
    /// Frames from one segment to the next.
    pub hop: usize,
    pub columns: usize,
    pub record: usize,
}

impl SegmentLayout {
    /// Segments at a distance of their length divided by `overlap`, or farther apart if there would be more
    /// than `most` columns.
    pub(super) fn with_overlap(record: usize, frames: usize, overlap: usize, most: usize) -> Self {
        let room = record.saturating_sub(frames);
        let hop = (frames / overlap).max(room.div_ceil(most - 1)).max(1);
        Self { frames, hop, columns: room / hop + 1, record }
    }

    /// Segments of a length in seconds, with `overlap` columns per segment length.
    ///
    /// # Errors
    ///
    /// [`SpectrumError::Segment`] for a segment of fewer than [`FEWEST_FRAMES`] frames, or one longer than
    /// the record.
    pub(super) fn from_duration(
        record: usize,
        segment_s: f64,
        frame_rate_hz: f64,
        overlap: usize,
    ) -> Result<Self, SpectrumError> {
        let frames = (segment_s * frame_rate_hz).round();
        if !(frames >= FEWEST_FRAMES as f64 && frames <= record as f64) {
            let (least_s, most_s) = (FEWEST_FRAMES as f64 / frame_rate_hz, record as f64 / frame_rate_hz);
            return Err(SpectrumError::Segment { found_s: segment_s, least_s, most_s });
        }
        Ok(Self::with_overlap(record, frames as usize, overlap, MOST_COLUMNS))
    }

    /// First frame of a segment. The last segment need not end with the record.
    pub(super) fn first_frame(&self, column: usize) -> usize {
        column * self.hop
    }

    /// Middle of a segment, frames from the first frame of the record.
    pub(super) fn centre_frame(&self, column: usize) -> f64 {
        self.first_frame(column) as f64 + (self.frames as f64 - 1.0) / 2.0
    }
}

/// Upper end of the default band, as a fraction of half the frame rate: a component at a higher frequency is
/// as likely to be an alias as not.
const DEFAULT_BAND_TOP: f64 = 0.9;
/// Ratio of the lower end of the default band to the frequency of the largest slow component. At this ratio,
/// the flank of the peak of a ring-down has faded in a Hann spectrum over four cycles of the ring-down.
const SLOW_COMPONENT_MARGIN: f64 = 4.0;
/// Number of segments of `SEGMENT_CYCLES` cycles each that a record should hold at the lower end of the
/// default band.
const SEGMENTS_AT_LOWEST: f64 = 4.0;

/// Settings for cutting a record into the segments of a spectrogram.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SpectrogramSettings {
    /// Length of a segment, s; `None` chooses it from the data. Lengths a factor of the square root of two
    /// apart are tried, from `SEGMENT_CYCLES` cycles of the band's lower end up to a third of the record, at
    /// most 2048 frames. The shortest length is taken whose maxima stand out from the noise within 1.5 dB of
    /// the best. In longer segments a drifting component smears; in shorter segments noise hides it.
    pub segment_s: Option<f64>,
    /// Band for which the length is chosen, Hz; `None` uses [`default_band_hz`] with no slow component.
    pub band_hz: Option<(f64, f64)>,
    /// Number of columns per segment length: with 10, segments overlap by 90 %. `None` is 4; zero is read as
    /// one. It is ignored if `segment_s` is `None`. A spectrogram has at most [`MOST_COLUMNS`] columns, so
    /// the segments of a long record overlap less.
    pub overlap: Option<usize>,
}

/// Amplitude spectra of overlapping segments of a record.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrogram {
    /// Centres of the segments, s from the first frame of the record.
    pub time_s: Vec<f64>,
    /// Frequencies of the bins, Hz, from 0 to half the frame rate; at least four bins per resolution.
    pub frequency_hz: Vec<f64>,
    /// For each segment, the amplitude, m, in each bin; a steady sine of amplitude A has the value A at its
    /// peak. `None` if the frames present have less than half the weight of the window.
    pub amplitude_m: Vec<Option<Vec<f64>>>,
    /// Length of a segment, s.
    pub segment_s: f64,
    /// Distance between neighbouring segments, s.
    pub hop_s: f64,
    /// Reciprocal of the length of a segment, Hz; two components closer than two resolutions form a single
    /// peak in a column.
    pub resolution_hz: f64,
    pub(super) layout: SegmentLayout,
    pub(super) frame_rate_hz: f64,
}

impl Spectrogram {
    /// Short-time spectra of a record of displacement, m, one sample per frame (`None` for a frame without a
    /// value). Steps and ring-downs should be removed beforehand as far as possible.
    ///
    /// # Errors
    /// [`SpectrumError`] if the record, the frame rate, the band or the segment allows no spectra.
    pub fn new(
        samples: &[Option<f64>],
        frame_rate_hz: f64,
        settings: &SpectrogramSettings,
    ) -> Result<Self, SpectrumError> {
        let checked = SpectrumSettings { zero_padding: 1, band_hz: settings.band_hz, ..Default::default() };
        check_record(samples, frame_rate_hz, &checked)?;
        let band_hz = settings.band_hz.unwrap_or_else(|| default_band_hz(samples.len(), frame_rate_hz, None));
        let layout = match settings.segment_s {
            Some(segment_s) => {
                let overlap = settings.overlap.unwrap_or(OVERLAP).max(1);
                SegmentLayout::from_duration(samples.len(), segment_s, frame_rate_hz, overlap)?
            }
            None => choose_segment_layout(samples, frame_rate_hz, band_hz),
        };
        let bins = SegmentBins::new(&layout, FINE_PADDING);
        let amplitude_m = bins.column_amplitudes(samples, &layout, bins.all_bins());
        Ok(Self {
            time_s: (0..layout.columns).map(|c| layout.centre_frame(c) / frame_rate_hz).collect(),
            frequency_hz: bins.all_bins().map(|k| k as f64 * frame_rate_hz / bins.padded as f64).collect(),
            amplitude_m,
            segment_s: layout.frames as f64 / frame_rate_hz,
            hop_s: layout.hop as f64 / frame_rate_hz,
            resolution_hz: frame_rate_hz / layout.frames as f64,
            layout,
            frame_rate_hz,
        })
    }
}

/// Default band of the drifting component, Hz. The lower end is four times the frequency of the largest slow
/// component, if there is one, and at least the frequency at which the record holds four segments of
/// `SEGMENT_CYCLES` cycles. The upper end is nine tenths of half the frame rate.
#[must_use]
pub fn default_band_hz(frames: usize, frame_rate_hz: f64, slow_hz: Option<f64>) -> (f64, f64) {
    let top = DEFAULT_BAND_TOP * frame_rate_hz / 2.0;
    let resolved = SEGMENTS_AT_LOWEST * SEGMENT_CYCLES * frame_rate_hz / frames.max(MIN_SAMPLES) as f64;
    let low = slow_hz.map_or(resolved, |slow| resolved.max(SLOW_COMPONENT_MARGIN * slow));
    (low.min(top / 2.0), top)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_record_has_no_more_columns_than_a_figure() {
        for (record, frames) in
            [(1_000_000, 80), (1_000_000, 2048), (3000, 80), (10_000, 16), (401, 1), (16, 16)]
        {
            let layout = SegmentLayout::with_overlap(record, frames, OVERLAP, MOST_COLUMNS);
            assert!((1..=MOST_COLUMNS).contains(&layout.columns), "{layout:?}");
            assert!(layout.first_frame(layout.columns - 1) + frames <= record, "{layout:?}");
            assert!(layout.first_frame(layout.columns) + frames > record, "{layout:?}");
        }
    }
}
