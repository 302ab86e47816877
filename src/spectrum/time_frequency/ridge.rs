//! The ridge: the course of a component through the columns.

/// A point of a ridge: the middle of a segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RidgePoint {
    /// Time from the first frame of the record, s.
    pub time_s: f64,
    /// Frequency at that time, Hz.
    pub frequency_hz: f64,
    /// Its standard deviation, Hz: from the noise next to the component, or from what the fit leaves of it if
    /// that is more, and a five-hundredth of the resolution for what other components leak into the fit.
    pub frequency_sd_hz: f64,
    /// Change of the frequency, Hz/s.
    pub rate_hz_per_s: f64,
    /// Amplitude at that time, m.
    pub amplitude_m: f64,
    /// Phase of the component as a cosine, rad.
    pub phase_rad: f64,
    /// Amplitude over that of noise in a bin of the column, `20 log10`, dB.
    pub snr_db: f64,
    /// What the fit leaves where the component is, as a share of its amplitude in a bin of the column.
    pub residual_ratio: f64,
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
    /// The points, in order of time. A point is where the fitted amplitude exceeds the noise next to it by
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
    pub fn unbroken_parts(&self) -> impl Iterator<Item = &[RidgePoint]> {
        self.points.chunk_by(|a, b| b.time_s - a.time_s < 1.5 * self.hop_s)
    }
}
