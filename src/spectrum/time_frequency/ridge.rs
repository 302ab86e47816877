//! The ridge: the course of a component through the columns, where there is one.

use super::tracker::Tracker;
use super::{Range, Spectrogram, range};

/// Points in a row that make a part of a ridge; fewer span less than half a segment more than one of them.
const FEWEST_POINTS: usize = 3;
/// A point of a ridge: the middle of a segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RidgePoint {
    /// Time from the first frame of the record, s.
    pub time_s: f64,
    /// Frequency at that time, Hz.
    pub frequency_hz: f64,
    /// Its standard deviation, Hz: from the noise beside the component, or from what the fit leaves of it if
    /// that is more, and a five-hundredth of the resolution for what other components leak into the fit.
    pub frequency_sd_hz: f64,
    /// Change of the frequency, Hz/s.
    pub rate_hz_per_s: f64,
    /// Amplitude at that time, m.
    pub amplitude_m: f64,
    /// Amplitude over that of noise in a bin of the column, `20 log10`, dB.
    pub snr_db: f64,
}

/// A frequency carried to an end of the record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RidgeEnd {
    /// Time from the first frame of the record, s.
    pub time_s: f64,
    /// Frequency at that time, Hz.
    pub frequency_hz: f64,
    /// Its standard deviation, Hz.
    pub frequency_sd_hz: f64,
}

/// Course of a component over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Ridge {
    /// The points, in order of time. A point is where the fitted amplitude exceeds the noise beside it by
    /// more than noise alone reaches once in a hundred records and does not fall to nothing within the
    /// segment, three segments in a row or more; elsewhere the ridge is interrupted.
    pub points: Vec<RidgePoint>,
    /// The frequency at the first frame, if the ridge reaches the first segment and carries that far.
    pub start: Option<RidgeEnd>,
    /// The frequency at the last frame, if the ridge reaches the last segment and carries that far.
    pub end: Option<RidgeEnd>,
    /// Length of a segment, s.
    pub segment_s: f64,
    /// Distance of the points where the ridge is not interrupted, s.
    pub hop_s: f64,
}

impl Ridge {
    /// The parts of the ridge between its interruptions.
    pub fn parts(&self) -> impl Iterator<Item = &[RidgePoint]> {
        self.points.chunk_by(|a, b| b.time_s - a.time_s < 1.5 * self.hop_s)
    }

    /// Least and greatest frequency, the two ends of the record included where they are known to a quarter of
    /// a resolution. A point counts only if a neighbour's frequency, carried over by its rate, agrees with it
    /// within a quarter of a resolution or four deviations, so that a single bad point sets neither; `None`
    /// where no point is so confirmed.
    #[must_use]
    pub fn range_hz(&self) -> Option<Range> {
        range::of(self)
    }

    /// Whether the frequency changes: the scatter of points half a segment apart about their mean is larger
    /// than their deviations explain but once in a thousand records.
    #[must_use]
    pub fn drifts(&self) -> bool {
        range::drifts(self)
    }
}

pub(super) fn follow(spectrogram: &Spectrogram, samples: &[Option<f64>], band_hz: (f64, f64)) -> Ridge {
    let tracker = Tracker::of(spectrogram, samples, band_hz);
    let fits = tracker.bent(&tracker.mended(&tracker.fits(&tracker.starts(spectrogram))));
    let points: Vec<Option<RidgePoint>> =
        fits.iter().enumerate().map(|(c, fit)| fit.as_ref().and_then(|fit| tracker.point(c, fit))).collect();
    let points = without_short_runs(points);
    let end = |c: usize| points[c].and(fits[c].as_ref()).and_then(|fit| tracker.end(c, fit));
    Ridge {
        start: end(0),
        end: end(points.len() - 1),
        points: points.into_iter().flatten().collect(),
        segment_s: spectrogram.segment_s,
        hop_s: spectrogram.hop_s,
    }
}

/// Takes out points in runs that are too short for a course.
fn without_short_runs(mut points: Vec<Option<RidgePoint>>) -> Vec<Option<RidgePoint>> {
    let fewest = FEWEST_POINTS.min(points.len());
    for run in points.chunk_by_mut(|a, b| a.is_some() == b.is_some()).filter(|run| run.len() < fewest) {
        run.fill(None);
    }
    points
}
