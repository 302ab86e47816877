//! The deflection in segments of both sides, with the ridges that follow the stick-slip cycle.

use super::case::{Case, Side};
use super::windows::band;
use crate::feature::{Band, Reading};
use crate::recording::channel::{Anchor, Channel, Window, WindowEnd, mean_speed_m_per_s};
use crate::spectrum::time_frequency::{
    Ridge, RidgePoint, Spectrogram, SpectrogramSettings, SpeedPoint, course, default_band_hz,
};
use crate::spectrum::{Analysis, Oscillation, Record, Settings};
use std::ops::Range;

/// Lengths of segments that are tried, over the one that shows the component best, the shortest first.
const TRIED: [f64; 8] = [0.15, 0.2, 0.3, 0.45, 0.7, 1.0, 1.4, 2.0];
/// Segments that a record holds side by side at least, so that there is a course.
const SIDE_BY_SIDE: f64 = 3.0;
/// Share of the best course that is as good as it.
const NEARLY: f64 = 0.95;
/// Most points of a ridge over speed: more would lie over each other.
const MOST_SPEEDS: usize = 40;

/// The ridges of a condition.
#[derive(Debug, Clone, Default)]
pub struct Ridges {
    /// That of the recording; `None` where no segment has frames enough.
    pub measured: Option<FollowedRidge>,
    /// That of the model, in segments as long, on its own clock.
    pub model: Option<FollowedRidge>,
}

/// The deflection of one side in segments, and its strongest component over time.
#[derive(Debug, Clone)]
pub struct FollowedRidge {
    /// Instant from which times count, s, on the side's own clock.
    pub start_s: f64,
    /// Amplitudes over time and frequency.
    pub spectrogram: Spectrogram,
    /// The strongest component of each segment.
    pub ridge: Ridge,
    /// The parts of it that are a course of one component.
    pub courses: Vec<Vec<RidgePoint>>,
    /// Where it was sought, Hz.
    pub band_hz: (f64, f64),
    /// The courses over the speed of the tip, thinned.
    pub over_speed: Vec<SpeedPoint>,
}

impl Ridges {
    pub(super) fn of(case: &Case) -> Self {
        let measured = case
            .measured_side()
            .and_then(|side| followed(case, &side, side.frames(&window(&side))?, None))
            .filter(FollowedRidge::shows_something);
        let (segment_s, side) = (measured.as_ref().map(|m| m.spectrogram.segment_s), case.model_side());
        let model = model_frames(case, &side).and_then(|frames| followed(case, &side, frames, segment_s));
        Self { measured, model }
    }
}

/// From the release of the tip to where it stops again, or all of it.
fn window(side: &Side) -> Window {
    let at = |anchor, reversal| WindowEnd::Found { anchor, reversal, offset_s: 0.0 };
    let known = |anchor, reversal| side.instants.time_s(anchor, reversal).is_ok();
    Window {
        from: if known(Anchor::Release, 1) { at(Anchor::Release, 1) } else { WindowEnd::Open },
        to: if known(Anchor::Hold, 2) { at(Anchor::Hold, 2) } else { WindowEnd::Open },
    }
}

/// The model from its own release on; of a recording in which none is found, while the camera ran.
fn model_frames(case: &Case, model: &Side) -> Option<Range<usize>> {
    match case.measured_side().filter(|side| side.instant_s(Anchor::Release).is_none()) {
        Some(side) => {
            let (grid, shift_s) = (side.recording.grid(), case.alignment.shift_s);
            let frames = side.frames(&window(&side))?;
            Some(model.between((grid.time_s(frames.start) - shift_s, grid.time_s(frames.end) - shift_s)))
        }
        None => model.frames(&window(model)),
    }
}

/// The band in which the fit seeks the fastest component of the deflection.
fn sought<'a>(case: &Case<'a>) -> Option<&'a Band> {
    case.aims()
        .filter(|aim| matches!(aim.feature.reading, Reading::Frequency(_) | Reading::CycleFrequency { .. }))
        .filter_map(band)
        .filter(|b| b.channel == Channel::Deflection)
        .max_by(|a, b| a.band_hz.0.total_cmp(&b.band_hz.0))
}

/// Length of the segments in which the fit itself reads cycles, s.
fn given_s(case: &Case) -> Option<f64> {
    case.aims().find_map(|aim| match aim.feature.reading {
        Reading::CycleFrequency { segment_s, .. } => Some(segment_s),
        _ => None,
    })
}

/// Length of two cycles of the slowest component, s: a segment about as long as one would show its swings as
/// a slower one.
fn shortest_s(case: &Case) -> f64 {
    const CYCLES: f64 = 2.0;
    case.frequencies().map(|sought| CYCLES / sought.target.frequency_hz).fold(0.0, f64::max)
}

fn followed(case: &Case, side: &Side, frames: Range<usize>, segment_s: Option<f64>) -> Option<FollowedRidge> {
    let rate_hz = side.recording.grid().frame_rate_hz;
    let samples = side.samples(Channel::Deflection);
    let record = Record {
        samples: samples.get(frames.clone())?,
        frame_rate_hz: rate_hz,
        exposure_s: case.exposure_s(),
    };
    let analysis = Analysis::of(&record, &Settings::default()).ok()?;
    let frames = frames.start + analysis.left_out..frames.end;
    let top_hz = default_band_hz(frames.len(), rate_hz, None);
    let band_hz = sought(case).map_or(top_hz, |band| (band.band_hz.0, band.band_hz.1.min(top_hz.1)));
    let band_hz = if band_hz.0 < band_hz.1 { band_hz } else { top_hz };
    // the ridge is followed without what is slower than its band
    let fast = fast(&analysis, rate_hz, band_hz.0);
    let ridge = ridge(&fast, rate_hz, band_hz, segment_s.or(given_s(case)), shortest_s(case))?;
    let settings = SpectrogramSettings { segment_s: Some(ridge.segment_s), band_hz: Some(band_hz) };
    let spectrogram = Spectrogram::of(&analysis.detrended_m(), rate_hz, &settings).ok()?;
    let courses = course::parts(&ridge, &spectrogram);
    let over_speed = over_speed(side, frames.start, &courses, ridge.segment_s);
    let start_s = side.recording.grid().time_s(frames.start);
    Some(FollowedRidge { start_s, spectrogram, ridge, courses, band_hz, over_speed })
}

/// The ridge in segments of a given length; without one, of the shortest of whose ridge nearly as much is a
/// course as of any: shorter ones show how it changes, until it swings from segment to segment.
fn ridge(
    fast: &[Option<f64>],
    rate_hz: f64,
    band_hz: (f64, f64),
    segment_s: Option<f64>,
    shortest_s: f64,
) -> Option<Ridge> {
    let cut = |segment_s: Option<f64>| {
        let settings = SpectrogramSettings { segment_s, band_hz: Some(band_hz) };
        let spectrogram = Spectrogram::of(fast, rate_hz, &settings).ok()?;
        let ridge = spectrogram.ridge(fast, band_hz).ok()?;
        let points: usize = course::parts(&ridge, &spectrogram).iter().map(Vec::len).sum();
        Some((points as f64 / spectrogram.time_s.len().max(1) as f64, ridge))
    };
    let first = cut(segment_s)?;
    if segment_s.is_some() {
        return Some(first.1);
    }
    let most_s = fast.len() as f64 / rate_hz / SIDE_BY_SIDE;
    let lengths = TRIED.iter().map(|share| share * first.1.segment_s);
    let all: Vec<(f64, Ridge)> =
        lengths.filter(|s| *s >= shortest_s && *s <= most_s).filter_map(|s| cut(Some(s))).collect();
    let most = all.iter().map(|(share, _)| *share).fold(0.0, f64::max);
    all.into_iter().find(|(share, _)| *share >= NEARLY * most).or(Some(first)).map(|(_, ridge)| ridge)
}

/// Nepers in a cycle of what is over within one: a damping ratio of 0.22.
const MOST_DECAY: f64 = 1.4;

/// The record without trend and without the oscillations below a frequency, m.
fn fast(analysis: &Analysis, rate_hz: f64, low_hz: f64) -> Vec<Option<f64>> {
    // what is over within a cycle is a piece of the flip
    let rings = |o: &&Oscillation| o.frequency_hz >= low_hz && o.decay_per_s < MOST_DECAY * o.frequency_hz;
    let kept: Vec<_> = analysis.oscillations.iter().filter(rings).collect();
    let at = |(i, left): (usize, &Option<f64>)| {
        left.map(|left| left + kept.iter().map(|o| o.at_m(i as f64 / rate_hz)).sum::<f64>())
    };
    analysis.left_m.iter().enumerate().map(at).collect()
}

/// The courses over the mean speed of the tip in each segment.
fn over_speed(side: &Side, first: usize, courses: &[Vec<RidgePoint>], segment_s: f64) -> Vec<SpeedPoint> {
    let (grid, tip) = (side.recording.grid(), &side.recording.traces().tip_x_m);
    let half = (0.5 * segment_s * grid.frame_rate_hz).ceil() as usize;
    let point = |p: &RidgePoint| {
        let centre = first + (p.time_s * grid.frame_rate_hz).round() as usize;
        let segment = centre.saturating_sub(half)..(centre + half).min(grid.frames);
        Some(SpeedPoint {
            tip_speed_m_per_s: mean_speed_m_per_s(tip, grid.frame_rate_hz, segment)?.abs(),
            frequency_hz: p.frequency_hz,
            frequency_sd_hz: Some(p.frequency_sd_hz),
        })
    };
    let every = courses.iter().map(Vec::len).sum::<usize>().div_ceil(MOST_SPEEDS).max(1);
    courses.iter().flatten().step_by(every).filter_map(point).collect()
}

impl FollowedRidge {
    /// Whether any segment has frames enough.
    fn shows_something(&self) -> bool {
        self.spectrogram.amplitude_m.iter().any(Option::is_some)
    }

    /// Least and greatest frequency of the courses, Hz.
    #[must_use]
    pub fn range_hz(&self) -> Option<(f64, f64)> {
        let all = || self.courses.iter().flatten().map(|p| p.frequency_hz);
        all().reduce(f64::min).zip(all().reduce(f64::max))
    }
}
