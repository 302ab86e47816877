//! Follows a component through the columns, where there is one.

use super::ridge::{Ridge, RidgePoint};
use super::spectrogram::Spectrogram;
use super::tracker::RidgeTracker;
use crate::spectrum::error::SpectrumError;

/// Points in a row that make a part of a ridge; fewer span less than half a segment more than one of them.
const FEWEST_POINTS: usize = 3;

impl Spectrogram {
    /// Course of the strongest component between two frequencies, Hz; `samples` is the record this
    /// spectrogram is of. Without a component that stands out of the noise, the ridge has no points.
    ///
    /// # Errors
    /// [`SpectrumError::Band`] when the band holds no frequency of the spectrogram.
    pub fn find_ridge(&self, samples: &[Option<f64>], band_hz: (f64, f64)) -> Result<Ridge, SpectrumError> {
        let (low, high) = band_hz;
        let nyquist = self.frame_rate_hz / 2.0;
        if !(low >= 0.0 && low < high && low < nyquist) {
            return Err(SpectrumError::Band { low, high, nyquist });
        }
        Ok(follow_ridge(self, samples, (low, high.min(nyquist))))
    }
}

fn follow_ridge(spectrogram: &Spectrogram, samples: &[Option<f64>], band_hz: (f64, f64)) -> Ridge {
    let tracker = RidgeTracker::new(spectrogram, samples, band_hz);
    let fits = tracker.refit_with_curvature(
        &tracker.refit_from_neighbours(&tracker.fit_segments(&tracker.fit_starts(spectrogram))),
    );
    let points: Vec<Option<RidgePoint>> = fits
        .iter()
        .enumerate()
        .map(|(c, fit)| fit.as_ref().and_then(|fit| tracker.ridge_point(c, fit)))
        .collect();
    let points = remove_short_runs(points);
    let end = |c: usize| points[c].and(fits[c].as_ref()).and_then(|fit| tracker.ridge_end(c, fit));
    Ridge {
        start: end(0),
        end: end(points.len() - 1),
        points: points.into_iter().flatten().collect(),
        segment_s: spectrogram.segment_s,
        hop_s: spectrogram.hop_s,
    }
}

/// Takes out points in runs that are too short for a course.
fn remove_short_runs(mut points: Vec<Option<RidgePoint>>) -> Vec<Option<RidgePoint>> {
    let fewest = FEWEST_POINTS.min(points.len());
    for run in points.chunk_by_mut(|a, b| a.is_some() == b.is_some()).filter(|run| run.len() < fewest) {
        run.fill(None);
    }
    points
}
