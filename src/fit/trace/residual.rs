//! Residuals of a fitted trace, channel by channel.

use super::iterate::Iterate;
use super::model::TraceModel;
use super::outer::recording_models;

/// Residuals of one channel over one segment.
#[derive(Debug, Clone, PartialEq)]
pub struct SegmentResiduals {
    /// Number of the recording.
    pub recording: usize,
    /// Number of the segment in the iterate.
    pub segment: usize,
    /// Whether it is the head's drop, and not the tip's place along the sweep.
    pub is_drop: bool,
    /// Frames with data, rising.
    pub frames: Vec<usize>,
    /// Model minus measured, m.
    pub residual_m: Vec<f64>,
    /// The same in standard deviations of the noise, without the correlation of the noise.
    pub whitened: Vec<f64>,
}

/// Residuals of every segment and channel with data at an iterate; those of a segment whose run fails are
/// left out.
#[must_use]
pub fn segment_residuals(model: &TraceModel, at: &Iterate) -> Vec<SegmentResiduals> {
    let Some(points) = recording_models(model, &at.point) else { return Vec::new() };
    let mut found = Vec::new();
    for (number, segment) in at.segments.iter().enumerate() {
        let film = &model.recordings[segment.recording].observation;
        let (point, range) = (&points[segment.recording], [segment.first, segment.last]);
        let Some(all_m) = point.residuals_m(range, &segment.start_state()) else { continue };
        let mut all = all_m.clone();
        film.segment_whitening(segment.first, segment.last).whiten_column(all.as_mut_slice());
        let [tip, drop] = film.data_frames(segment.first, segment.last);
        let split = tip.len();
        for (is_drop, frames, part) in [(false, tip, 0..split), (true, drop, split..all.len())] {
            if !frames.is_empty() {
                let (residual_m, whitened) =
                    (all_m.as_slice()[part.clone()].to_vec(), all.as_slice()[part].to_vec());
                let (film, segment) = (segment.recording, number);
                found.push(SegmentResiduals {
                    recording: film,
                    segment,
                    is_drop,
                    frames,
                    residual_m,
                    whitened,
                });
            }
        }
    }
    found
}
