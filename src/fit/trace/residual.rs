//! Residuals of a fitted trace, channel by channel.

use super::iterate::Iterate;
use super::model::TraceModel;
use super::outer::points;

/// Residuals of one channel over one segment.
#[derive(Debug, Clone, PartialEq)]
pub struct SegmentResiduals {
    /// Number of the recording.
    pub film: usize,
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
pub fn residuals(model: &TraceModel, at: &Iterate) -> Vec<SegmentResiduals> {
    let Some(points) = points(model, &at.point) else { return Vec::new() };
    let mut found = Vec::new();
    for (number, segment) in at.segments.iter().enumerate() {
        let film = &model.shoots[segment.film].film;
        let (point, range) = (&points[segment.film], [segment.first, segment.last]);
        let Some(all_m) = point.residuals_m(range, &segment.state()) else { continue };
        let mut all = all_m.clone();
        film.whitening(segment.first, segment.last).apply(all.as_mut_slice());
        let [tip, drop] = film.frames(segment.first, segment.last);
        let split = tip.len();
        for (is_drop, frames, part) in [(false, tip, 0..split), (true, drop, split..all.len())] {
            if !frames.is_empty() {
                let (residual_m, whitened) =
                    (all_m.as_slice()[part.clone()].to_vec(), all.as_slice()[part].to_vec());
                let (film, segment) = (segment.film, number);
                found.push(SegmentResiduals { film, segment, is_drop, frames, residual_m, whitened });
            }
        }
    }
    found
}
