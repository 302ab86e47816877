//! Residuals of a fitted trace, channel by channel.

use super::TraceModel;
use super::chain::Iterate;
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
        let whitened = points[segment.film].residuals([segment.first, segment.last], &segment.state());
        let Some(whitened) = whitened else { continue };
        let mut rest = whitened.as_slice();
        for (is_drop, column) in [(false, &film.tip_x_m), (true, &film.drop_m)] {
            let frames: Vec<usize> =
                (segment.first..segment.last).filter(|&frame| column[frame].is_some()).collect();
            let (own, others) = rest.split_at(frames.len());
            rest = others;
            let sd = film.settings.noise_m[usize::from(is_drop)];
            if !frames.is_empty() {
                let residual_m = own.iter().map(|r| r * sd).collect();
                let (film, segment) = (segment.film, number);
                let whitened = own.to_vec();
                found.push(SegmentResiduals { film, segment, is_drop, frames, residual_m, whitened });
            }
        }
    }
    found
}
