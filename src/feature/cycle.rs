//! The range over which a stick-slip cycle runs: it drifts with the speed of the tip, so it is followed in
//! short segments.
//!
//! A segment shows the mean frequency of its own time, weighted by its window, so the range reads narrower
//! than the drift by what the cycle drifts in half a segment at either end; model and measurement alike.

use super::band::FeatureBand;
use super::missing::MissingValue;
use crate::spectrum::{Component, SpectrumError, SpectrumSettings, WindowedTransform};

/// Least share of the largest segment's amplitude that a segment has to hold: below, the cycle has not
/// started or has died down.
pub(crate) const LEAST_SEGMENT_AMPLITUDE: f64 = 0.2;

/// The component of each segment that shows one and holds.
pub(super) struct CycleSegments {
    /// Frequency and its standard deviation, Hz.
    pub frequencies: Vec<(f64, f64)>,
}

impl CycleSegments {
    /// Of the samples of a band's window, in segments that overlap by half or a little more, so that the
    /// first and the last reach the ends of the window.
    pub(super) fn from_samples(
        band: &FeatureBand,
        segment_s: f64,
        samples: &[Option<f64>],
        frame_rate_hz: f64,
    ) -> Result<Self, MissingValue> {
        let frames = (segment_s * frame_rate_hz).round() as usize;
        let starts = segment_starts(samples.len(), frames).ok_or(MissingValue::Segment {
            segment_s,
            frames,
            window: samples.len(),
        })?;
        let mut found = Vec::new();
        for start in starts {
            let segment = samples.get(start..start + frames).unwrap_or_default();
            found.extend(strongest_in_segment(band, segment, frame_rate_hz)?);
        }
        let largest_m = found.iter().fold(0.0, |most: f64, c| most.max(c.amplitude_m));
        let holds = found.into_iter().filter(|c| c.amplitude_m >= LEAST_SEGMENT_AMPLITUDE * largest_m);
        Ok(Self { frequencies: holds.map(|c| (c.frequency_hz, c.frequency_sd_hz)).collect() })
    }
}

/// The strongest component of a segment; `None` where it shows none, or falls into a gap of the recording.
fn strongest_in_segment(
    band: &FeatureBand,
    segment: &[Option<f64>],
    frame_rate_hz: f64,
) -> Result<Option<Component>, SpectrumError> {
    let settings = SpectrumSettings { detrend: Some(band.detrend), ..SpectrumSettings::default() };
    match WindowedTransform::new(segment, frame_rate_hz, &settings) {
        Err(SpectrumError::TooFew { .. }) => Ok(None),
        transformed => Ok(transformed?.components(band.band_hz)?.into_iter().find(Component::is_resolvable)),
    }
}

/// First frames of the segments of a window; `None` where a segment has too few frames or more than the
/// window.
fn segment_starts(window: usize, frames: usize) -> Option<impl Iterator<Item = usize>> {
    if frames < crate::spectrum::MIN_SAMPLES {
        return None;
    }
    let room = window.checked_sub(frames)?;
    let steps = room.div_ceil(frames / 2);
    Some((0..=steps).map(move |k| (k * room).checked_div(steps).unwrap_or(0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_overlap_by_half_and_reach_both_ends() {
        let of = |window, frames| segment_starts(window, frames).map(Iterator::collect::<Vec<_>>);
        assert_eq!(of(100, 40), Some(vec![0, 20, 40, 60]));
        assert_eq!(of(110, 40), Some(vec![0, 17, 35, 52, 70]));
        assert_eq!(of(40, 40), Some(vec![0]));
        assert_eq!((of(39, 40), of(100, 7)), (None, None));
    }
}
