//! The range over which a stick-slip cycle runs: it drifts with the speed of the tip, so it is followed in
//! short segments.
//!
//! A segment shows the mean frequency of its own time, weighted by its window, so the range reads narrower
//! than the drift by what the cycle drifts in half a segment at either end; model and measurement alike.

use super::{Band, End, Missing, Reader, Value, spectral};
use crate::spectrum::{Settings, SpectrumError, Transformed};

/// Least share of the largest segment's amplitude that a segment has to hold: below, the cycle has not
/// started or has died down.
pub const HOLDS: f64 = 0.2;

/// The component of each segment that shows one and holds.
pub(super) struct Segments {
    /// Frequency and its standard deviation, Hz.
    found: Vec<(f64, f64)>,
}

/// The lowest or the highest frequency.
pub(super) fn frequency(band: &Band, segment_s: f64, end: End, reader: &Reader) -> Result<Value, Missing> {
    let segments = reader.segments(band, segment_s)?;
    let by_frequency = |a: &&(f64, f64), b: &&(f64, f64)| a.0.total_cmp(&b.0);
    let extreme = match end {
        End::Low => segments.found.iter().min_by(by_frequency),
        End::High => segments.found.iter().max_by(by_frequency),
    };
    let (low, high) = band.band_hz;
    extreme
        .map(|(frequency_hz, sd_hz)| Value::of(*frequency_hz, Some(*sd_hz)))
        .ok_or(Missing::NoPeak { low, high })
}

impl Segments {
    /// Of segments that overlap by half or a little more, so that the first and the last reach the ends of
    /// the window.
    pub(super) fn of(band: &Band, segment_s: f64, reader: &Reader) -> Result<Self, Missing> {
        let samples = reader.cut(band.channel, reader.frames(&band.window)?);
        let frames = (segment_s * reader.frame_rate_hz()).round() as usize;
        let starts = starts(samples.len(), frames).ok_or(Missing::Segment {
            segment_s,
            frames,
            window: samples.len(),
        })?;
        let settings = Settings { detrend: Some(band.detrend), ..Settings::default() };
        let mut found = Vec::new();
        for start in starts {
            let segment = samples.get(start..start + frames).unwrap_or_default();
            let components = match Transformed::of(segment, reader.frame_rate_hz(), &settings) {
                Err(SpectrumError::TooFew { .. }) => continue, // a gap in the recording
                transformed => transformed?.components(band.band_hz)?,
            };
            found.extend(
                spectral::resolvable(&components)
                    .next()
                    .map(|c| (c.amplitude_m, (c.frequency_hz, c.frequency_sd_hz))),
            );
        }
        let largest_m = found.iter().fold(0.0, |most: f64, (amplitude_m, _)| most.max(*amplitude_m));
        Ok(Self {
            found: found
                .into_iter()
                .filter(|(amplitude_m, _)| *amplitude_m >= HOLDS * largest_m)
                .map(|(_, frequency)| frequency)
                .collect(),
        })
    }
}

/// First frames of the segments of a window; `None` where a segment has too few frames or more than the
/// window.
fn starts(window: usize, frames: usize) -> Option<impl Iterator<Item = usize>> {
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
        let of = |window, frames| starts(window, frames).map(Iterator::collect::<Vec<_>>);
        assert_eq!(of(100, 40), Some(vec![0, 20, 40, 60]));
        assert_eq!(of(110, 40), Some(vec![0, 17, 35, 52, 70]));
        assert_eq!(of(40, 40), Some(vec![0]));
        assert_eq!((of(39, 40), of(100, 7)), (None, None));
    }
}
