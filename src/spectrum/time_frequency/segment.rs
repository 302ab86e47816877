//! Where the segments lie and how long they are.

use super::columns::Bins;
use super::{MOST_COLUMNS, SpectrumError};

/// Fewest cycles of the band's lower end in a segment: the lobe of a Hann window is two resolutions wide to
/// either side, so that with four cycles the component is clear of zero and of its own mirror image.
pub const SEGMENT_CYCLES: f64 = 4.0;
/// Fewest frames of a segment: three for each of the five unknowns of the fit, and one.
pub(super) const FEWEST_FRAMES: usize = 16;
/// Most frames of a segment that is chosen: bounds the bins of a column.
const MOST_FRAMES: usize = 2048;
/// Segments that a record holds side by side at least, so that there is a course, also of a component that
/// lasts half of it.
const SIDE_BY_SIDE: usize = 3;
/// Columns for each segment length: a Hann window and its neighbour a quarter on share most of their frames,
/// and nothing falls between.
const OVERLAP: usize = 4;
/// Ratio of the lengths tried.
const STEP: f64 = std::f64::consts::SQRT_2;
/// Share of the best concentration, 1.5 dB, that a shorter segment may lose: it follows the drift more
/// closely.
const NEARLY_BEST: f64 = 0.7;
/// Columns that tell how well a length does; more would only cost time.
const TRIED_COLUMNS: usize = 48;

/// Segments of a record, in frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Layout {
    /// Of a segment.
    pub frames: usize,
    /// From one segment to the next.
    pub hop: usize,
    /// Segments.
    pub columns: usize,
    /// Of the record.
    pub record: usize,
}

impl Layout {
    /// Segments a share of their length apart, farther where there would be too many columns.
    fn of(record: usize, frames: usize, overlap: usize, most: usize) -> Self {
        let room = record.saturating_sub(frames);
        let hop = (frames / overlap).max(room.div_ceil(most - 1)).max(1);
        Self { frames, hop, columns: room / hop + 1, record }
    }

    /// Segments of a length in seconds.
    pub(super) fn given(record: usize, segment_s: f64, frame_rate_hz: f64) -> Result<Self, SpectrumError> {
        let frames = (segment_s * frame_rate_hz).round();
        if !(frames >= FEWEST_FRAMES as f64 && frames <= record as f64) {
            let (least_s, most_s) = (FEWEST_FRAMES as f64 / frame_rate_hz, record as f64 / frame_rate_hz);
            return Err(SpectrumError::Segment { found_s: segment_s, least_s, most_s });
        }
        Ok(Self::of(record, frames as usize, OVERLAP, MOST_COLUMNS))
    }

    /// Segments of the length that shows the strongest component of the band best.
    pub(super) fn chosen(samples: &[Option<f64>], frame_rate_hz: f64, band_hz: (f64, f64)) -> Self {
        let record = samples.len();
        let most = (record / SIDE_BY_SIDE).min(MOST_FRAMES).max(FEWEST_FRAMES.min(record));
        let least = (SEGMENT_CYCLES * frame_rate_hz / band_hz.0)
            .min(most as f64)
            .max(FEWEST_FRAMES.min(record) as f64);
        // at most seven doublings
        let steps = ((most as f64 / least).ln() / STEP.ln()).floor().max(0.0) as i32;
        let lengths: Vec<usize> = (0..=steps).map(|k| (least * STEP.powi(k)) as usize).collect();
        let concentrations: Vec<f64> = lengths
            .iter()
            .map(|frames| {
                concentration(samples, &Self::of(record, *frames, 2, TRIED_COLUMNS), frame_rate_hz, band_hz)
            })
            .collect();
        let best = concentrations.iter().fold(0.0, |m: f64, c| m.max(*c));
        let shortest = concentrations.iter().position(|c| *c >= NEARLY_BEST * best).unwrap_or(0);
        Self::of(record, lengths[shortest], OVERLAP, MOST_COLUMNS)
    }

    /// First frame of a segment. The last segment need not end with the record.
    pub(super) fn first(&self, column: usize) -> usize {
        column * self.hop
    }

    /// Middle of a segment, frames from the first frame of the record.
    pub(super) fn centre(&self, column: usize) -> f64 {
        self.first(column) as f64 + (self.frames as f64 - 1.0) / 2.0
    }
}

/// Geometric mean of the squares of the columns' maxima, over that of noise in a bin, which falls as one over
/// the length: where the component is large counts no more than where it is small.
fn concentration(samples: &[Option<f64>], layout: &Layout, frame_rate_hz: f64, band_hz: (f64, f64)) -> f64 {
    let bins = Bins::coarse(layout);
    let columns = bins.columns(samples, layout, bins.within(band_hz, frame_rate_hz));
    let maxima = columns
        .iter()
        .flatten()
        .map(|column| column.iter().fold(f64::MIN_POSITIVE, |m: f64, a| m.max(*a)).ln());
    let (sum, count) = maxima.fold((0.0, 0), |(sum, count), logarithm| (sum + 2.0 * logarithm, count + 1));
    layout.frames as f64 * (sum / f64::from(count.max(1))).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_record_has_no_more_columns_than_a_figure() {
        for (record, frames) in
            [(1_000_000, 80), (1_000_000, 2048), (3000, 80), (10_000, 16), (401, 1), (16, 16)]
        {
            let layout = Layout::of(record, frames, OVERLAP, MOST_COLUMNS);
            assert!((1..=MOST_COLUMNS).contains(&layout.columns), "{layout:?}");
            assert!(layout.first(layout.columns - 1) + frames <= record, "{layout:?}");
            assert!(layout.first(layout.columns) + frames > record, "{layout:?}");
        }
    }
}
