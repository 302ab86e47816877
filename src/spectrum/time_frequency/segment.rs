//! Where the segments lie.

use crate::spectrum::error::SpectrumError;

/// Most columns of a spectrogram: a figure shows no more, and memory must not follow the length of the
/// record.
pub const MOST_COLUMNS: usize = 400;
/// Fewest cycles of the band's lower end in a segment: the lobe of a Hann window is two resolutions wide to
/// either side, so that with four cycles the component is clear of zero and of its own mirror image.
pub(crate) const SEGMENT_CYCLES: f64 = 4.0;
/// Fewest frames of a segment: three for each of the five unknowns of the fit, and one.
pub(super) const FEWEST_FRAMES: usize = 16;
/// Columns for each segment length: a Hann window and its neighbour a quarter on share most of their frames,
/// and nothing falls between.
pub(super) const OVERLAP: usize = 4;

/// Segments of a record, in frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct SegmentLayout {
    /// Of a segment.
    pub frames: usize,
    /// From one segment to the next.
    pub hop: usize,
    /// Segments.
    pub columns: usize,
    /// Of the record.
    pub record: usize,
}

impl SegmentLayout {
    /// Segments a share of their length apart, farther where there would be too many columns.
    pub(super) fn with_overlap(record: usize, frames: usize, overlap: usize, most: usize) -> Self {
        let room = record.saturating_sub(frames);
        let hop = (frames / overlap).max(room.div_ceil(most - 1)).max(1);
        Self { frames, hop, columns: room / hop + 1, record }
    }

    /// Segments of a length in seconds.
    pub(super) fn from_duration(
        record: usize,
        segment_s: f64,
        frame_rate_hz: f64,
    ) -> Result<Self, SpectrumError> {
        let frames = (segment_s * frame_rate_hz).round();
        if !(frames >= FEWEST_FRAMES as f64 && frames <= record as f64) {
            let (least_s, most_s) = (FEWEST_FRAMES as f64 / frame_rate_hz, record as f64 / frame_rate_hz);
            return Err(SpectrumError::Segment { found_s: segment_s, least_s, most_s });
        }
        Ok(Self::with_overlap(record, frames as usize, OVERLAP, MOST_COLUMNS))
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
