//! The course of the strongest component: over time, and over the speed of the tip.

use super::window::{AnalysedWindow, named_instants};
use crate::figures::spectrogram::{self, SpectrogramRidgePoint, SpeedPoint};
use crate::recording::channel::mean_speed_m_per_s;
use crate::spectrum::time_frequency::course;
use crate::spectrum::time_frequency::{RidgePoint as Followed, Spectrogram, SpectrogramSettings};
use crate::text::format_digits;

/// The frequency of a ridge at one time, with how fast the tip and the head moved then.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoursePoint {
    /// Time of the recording, s.
    pub time_s: f64,
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Its standard deviation, Hz.
    pub frequency_sd_hz: f64,
    /// Amplitude, m.
    pub amplitude_m: f64,
    /// Mean speed of the tip over the segment, m/s.
    pub tip_speed_m_per_s: Option<f64>,
    /// Mean speed of the head over the segment, m/s.
    pub head_speed_m_per_s: Option<f64>,
}

impl AnalysedWindow<'_> {
    /// The course of the frequency, point by point.
    #[must_use]
    pub fn frequency_course(&self) -> Vec<CoursePoint> {
        self.analysis.ridge.as_ref().map_or_else(Vec::new, |ridge| {
            ridge.points.iter().map(|p| self.course_point(p, ridge.segment_s)).collect()
        })
    }

    fn course_point(&self, p: &Followed, segment_s: f64) -> CoursePoint {
        let (grid, traces) = (self.recording.grid(), self.recording.traces());
        let half = (0.5 * segment_s * grid.frame_rate_hz).ceil() as usize;
        let centre = self.frames.start + (p.time_s * grid.frame_rate_hz).round() as usize;
        let segment = centre.saturating_sub(half)..(centre + half).min(grid.frames);
        let speed =
            |samples: &[Option<f64>]| mean_speed_m_per_s(samples, grid.frame_rate_hz, segment.clone());
        CoursePoint {
            time_s: grid.time_s(self.frames.start) + p.time_s,
            frequency_hz: p.frequency_hz,
            frequency_sd_hz: p.frequency_sd_hz,
            amplitude_m: p.amplitude_m,
            tip_speed_m_per_s: speed(&traces.tip_x_m),
            head_speed_m_per_s: speed(&traces.head_x_m),
        }
    }

    pub(super) fn spectrogram(&self) -> spectrogram::SpectrogramPlot {
        let grid = self.recording.grid();
        let start_s = grid.time_s(self.frames.start);
        let settings = SpectrogramSettings {
            segment_s: self.analysis.ridge.as_ref().map(|r| r.segment_s),
            band_hz: None,
        };
        let cut = Spectrogram::new(&self.analysis.detrended_m(), grid.frame_rate_hz, &settings).ok();
        let column = |bins: usize, column: &Option<Vec<f64>>| {
            column.as_ref().map_or_else(|| vec![None; bins], |c| c.iter().copied().map(Some).collect())
        };
        let instants = named_instants(self.recording, (start_s, grid.time_s(self.frames.end)));
        let (ridge, over_speed, drawn) = cut.as_ref().map(|cut| self.drawn_ridge(cut)).unwrap_or_default();
        let ends_hz = ridge.iter().filter_map(|p| p.frequency_hz);
        let range_hz = ends_hz.clone().reduce(f64::min).zip(ends_hz.reduce(f64::max));
        spectrogram::SpectrogramPlot {
            title: range_hz.map_or_else(
                || "Nothing stands out long enough to be followed".to_owned(),
                |(low, high)| {
                    format!("The ridge runs from {} to {} Hz", format_digits(low, 3), format_digits(high, 3))
                },
            ),
            quantity: self.channel.to_string(),
            note: cut.as_ref().map_or_else(
                || format!("{}; too short to be cut into segments", self.figure_note("spectrogram")),
                |c| {
                    format!(
                        "{}; segments of {:.1} ms{drawn}",
                        self.figure_note("spectrogram"),
                        c.segment_s * 1e3
                    )
                },
            ),
            synthetic: self.recording.is_synthetic(),
            time_s: cut.as_ref().map_or_else(Vec::new, |c| c.time_s.iter().map(|t| start_s + t).collect()),
            frequency_hz: cut.as_ref().map_or_else(Vec::new, |c| c.frequency_hz.clone()),
            amplitude_m: cut.as_ref().map_or_else(Vec::new, |c| {
                c.amplitude_m.iter().map(|a| column(c.frequency_hz.len(), a)).collect()
            }),
            log_frequency: false,
            shown_hz: None,
            ridge,
            instants,
            targets: Vec::new(),
            over_speed,
        }
    }

    /// The ridge over time and over the speed of the tip, as far as it is drawn, and in how many segments
    /// that is.
    fn drawn_ridge(&self, of: &Spectrogram) -> (Vec<SpectrogramRidgePoint>, Vec<SpeedPoint>, String) {
        let Some(ridge) = &self.analysis.ridge else { return Default::default() };
        let drawn = course::coherent_parts(ridge, of);
        let start_s = self.recording.grid().time_s(self.frames.start);
        let gap = SpectrogramRidgePoint { time_s: start_s, frequency_hz: None };
        let over_time = |part: &Vec<Followed>| {
            let points = part.iter().map(|p| SpectrogramRidgePoint {
                time_s: start_s + p.time_s,
                frequency_hz: Some(p.frequency_hz),
            });
            std::iter::once(gap).chain(points).collect::<Vec<_>>()
        };
        let over_speed = |p: CoursePoint| {
            Some(SpeedPoint {
                tip_speed_m_per_s: p.tip_speed_m_per_s?.abs(),
                frequency_hz: p.frequency_hz,
                frequency_sd_hz: Some(p.frequency_sd_hz),
            })
        };
        let speeds = drawn
            .iter()
            .flatten()
            .filter_map(|p| over_speed(self.course_point(p, ridge.segment_s)))
            .collect();
        let said = format!("; ridge {}", spectrogram::describe_ridge_segments(&drawn, ridge, of));
        (drawn.iter().flat_map(over_time).collect(), speeds, said)
    }
}
