//! Short-time spectra of a record.

use super::choice::choose_segment_layout;
use super::columns::SegmentBins;
use super::segment::{SEGMENT_CYCLES, SegmentLayout};
use crate::spectrum::check::check_record;
use crate::spectrum::error::SpectrumError;
use crate::spectrum::limits::MIN_SAMPLES;
use crate::spectrum::settings::SpectrumSettings;

/// Upper end of a band that nobody gave, as a share of half the frame rate: above, a component is as likely
/// to be folded down onto it.
const DEFAULT_BAND_TOP: f64 = 0.9;
/// Lower end of such a band over the largest slow component: a ring-down has died away in a Hann spectrum of
/// four of its cycles there.
const SLOW_COMPONENT_MARGIN: f64 = 4.0;
/// Segments of `SEGMENT_CYCLES` that a record should hold at the lower end of such a band.
const SEGMENTS_AT_LOWEST: f64 = 4.0;

/// How a record is cut into short spectra.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SpectrogramSettings {
    /// Length of a segment, s; `None` chooses it from the data: of lengths a factor of the square root of two
    /// apart, from `SEGMENT_CYCLES` of the band's lower end to a third of the record (and 2048 frames), the
    /// shortest whose maxima stand out of noise within
    /// 1.5 dB of the best. Longer, a drifting component smears; shorter, noise drowns it.
    pub segment_s: Option<f64>,
    /// Band for which the length is chosen, Hz; `None` takes [`default_band_hz`] with no slow component.
    pub band_hz: Option<(f64, f64)>,
}

/// Amplitude spectra of overlapping segments of a record.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrogram {
    /// Centres of the segments, s from the first frame of the record.
    pub time_s: Vec<f64>,
    /// Frequencies of the bins, Hz, from 0 to half the frame rate; four bins a resolution or more.
    pub frequency_hz: Vec<f64>,
    /// For each segment the amplitude in each bin, m: a steady sine of amplitude A reads A. `None` where
    /// missing frames leave less than half the window's weight.
    pub amplitude_m: Vec<Option<Vec<f64>>>,
    /// Length of a segment, s.
    pub segment_s: f64,
    /// Distance of the segments, s.
    pub hop_s: f64,
    /// One over a segment's length, Hz; two components closer than two of these are one in a column.
    pub resolution_hz: f64,
    pub(super) layout: SegmentLayout,
    pub(super) frame_rate_hz: f64,
}

impl Spectrogram {
    /// Short-time spectra of a record of displacement, m, one sample a frame (`None` where there is none),
    /// from which the flip and the ring-down have been taken as far as possible.
    ///
    /// # Errors
    /// [`SpectrumError`] when the record, the rate, the band or the segment cannot give one.
    pub fn new(
        samples: &[Option<f64>],
        frame_rate_hz: f64,
        settings: &SpectrogramSettings,
    ) -> Result<Self, SpectrumError> {
        check_record(
            samples,
            frame_rate_hz,
            &SpectrumSettings { zero_padding: 1, band_hz: settings.band_hz, ..Default::default() },
        )?;
        let band_hz = settings.band_hz.unwrap_or_else(|| default_band_hz(samples.len(), frame_rate_hz, None));
        let layout = match settings.segment_s {
            Some(segment_s) => SegmentLayout::from_duration(samples.len(), segment_s, frame_rate_hz)?,
            None => choose_segment_layout(samples, frame_rate_hz, band_hz),
        };
        let bins = SegmentBins::fine(&layout);
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

/// A band for the drifting component when nobody gives one, Hz: from four times the largest slow component,
/// if there is one, and at least the frequency of which the record holds four segments of `SEGMENT_CYCLES`
/// cycles, up to nine tenths of half the frame rate.
#[must_use]
pub fn default_band_hz(frames: usize, frame_rate_hz: f64, slow_hz: Option<f64>) -> (f64, f64) {
    let top = DEFAULT_BAND_TOP * frame_rate_hz / 2.0;
    let resolved = SEGMENTS_AT_LOWEST * SEGMENT_CYCLES * frame_rate_hz / frames.max(MIN_SAMPLES) as f64;
    let low = slow_hz.map_or(resolved, |slow| resolved.max(SLOW_COMPONENT_MARGIN * slow));
    (low.min(top / 2.0), top)
}
