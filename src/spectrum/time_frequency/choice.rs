//! How long the segments are.

use super::columns::SegmentBins;
use super::segment::{FEWEST_FRAMES, MOST_COLUMNS, OVERLAP, SEGMENT_CYCLES, SegmentLayout};
use crate::math;

/// Most frames of a segment that is chosen: bounds the bins of a column.
const LONGEST_SEGMENT_FRAMES: usize = 2048;
/// Segments that a record holds side by side at least, so that there is a course, also of a component that
/// lasts half of it.
const FEWEST_SEGMENTS: usize = 3;
/// Ratio of the lengths tried.
const LENGTH_RATIO: f64 = std::f64::consts::SQRT_2;
/// Share of the best concentration, 1.5 dB, that a shorter segment may lose: it follows the drift more
/// closely.
const NEARLY_BEST_CONCENTRATION: f64 = 0.7;
/// Columns that tell how well a length does; more would only cost time.
const TRIED_COLUMNS: usize = 48;

/// Segments of the length that shows the strongest component of the band best.
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
    let concentrations: Vec<f64> = lengths
        .iter()
        .map(|frames| {
            peak_concentration(
                samples,
                &SegmentLayout::with_overlap(record, *frames, 2, TRIED_COLUMNS),
                frame_rate_hz,
                band_hz,
            )
        })
        .collect();
    let best = concentrations.iter().fold(0.0, |m: f64, c| m.max(*c));
    let shortest = concentrations.iter().position(|c| *c >= NEARLY_BEST_CONCENTRATION * best).unwrap_or(0);
    SegmentLayout::with_overlap(record, lengths[shortest], OVERLAP, MOST_COLUMNS)
}

/// Geometric mean of the squares of the columns' maxima, over that of noise in a bin, which falls as one over
/// the length: where the component is large counts no more than where it is small.
fn peak_concentration(
    samples: &[Option<f64>],
    layout: &SegmentLayout,
    frame_rate_hz: f64,
    band_hz: (f64, f64),
) -> f64 {
    let bins = SegmentBins::coarse(layout);
    let columns = bins.column_amplitudes(samples, layout, bins.bins_in_band(band_hz, frame_rate_hz));
    let maxima = columns
        .iter()
        .flatten()
        .map(|column| math::ln(column.iter().fold(f64::MIN_POSITIVE, |m: f64, a| m.max(*a))));
    let (sum, count) = maxima.fold((0.0, 0), |(sum, count), logarithm| (sum + 2.0 * logarithm, count + 1));
    layout.frames as f64 * math::exp(sum / f64::from(count.max(1)))
}
