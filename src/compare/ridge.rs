//! Spectrograms of recording and model, with the ridges that follow the stick-slip cycle.

use super::condition::{ConditionComparison, TimedRecording, spectral_band};
use crate::feature::{FeatureBand, Reading};
use crate::model::modes::body_frequencies;
use crate::recording::channel::{Channel, InstantKind, Window, WindowEnd, mean_speed_m_per_s};
use crate::recording::cycles::median_interval_s;
use short_spectra::exceeds_noise;
use short_spectra::time_frequency::{
    Ridge, RidgePoint, Spectrogram, SpectrogramSettings, SpeedPoint, course, default_band_hz,
    subtract_slow_motion,
};
use std::ops::Range;

/// Segment lengths to try, relative to the default length, in ascending order.
const SEGMENT_LENGTH_FACTORS: [f64; 8] = [0.15, 0.2, 0.3, 0.45, 0.7, 1.0, 1.4, 2.0];
/// Minimum number of adjoining segments in a record, which limits the length of a segment. With fewer
/// segments, the ridge has no part that follows one component.
const MIN_SEGMENTS: f64 = 3.0;
/// For each segment length, the fraction of the segments that follow one component is computed. A length is
/// good enough if its fraction is at least this multiple of the largest fraction found for any length.
const NEARLY_BEST: f64 = 0.95;
/// Number of columns of a drawn spectrogram per segment length: segments overlap by 90 %.
const DRAWN_OVERLAP: usize = 10;
/// Maximum number of points of a ridge that are plotted against speed; more would overlap in a figure.
const MAX_SPEED_POINTS: usize = 40;

/// The ridges of a condition.
#[derive(Debug, Clone, Default)]
pub struct RidgePair {
    /// Ridge of the recording; `None` if no segment has enough frames.
    pub measured: Option<TrackedRidge>,
    /// Ridge of the model, in segments as long as those of the recording; times are on the clock of the
    /// model.
    pub model: Option<TrackedRidge>,
}

/// Spectrogram of a channel, with its strongest component as a function of time.
#[derive(Debug, Clone)]
pub struct TrackedRidge {
    /// Origin of the times of `spectrogram` and `ridge`, s.
    pub start_s: f64,
    /// Amplitudes as a function of time and frequency.
    pub spectrogram: Spectrogram,
    /// The strongest component of each segment.
    pub ridge: Ridge,
    /// Parts of the ridge that follow one component.
    pub courses: Vec<Vec<RidgePoint>>,
    /// Frequency band that was searched for the ridge, Hz.
    pub band_hz: (f64, f64),
    /// A selection of those points in `courses` that follow the stick-slip cycle, each with the speed of the
    /// tip.
    pub over_speed: Vec<SpeedPoint>,
}

impl RidgePair {
    pub(super) fn track(case: &ConditionComparison) -> Self {
        let track = |side: TimedRecording<'_>| {
            track_ridge(case, &side, side.window_frames(&release_window(&side))?, None, true)
        };
        let has_segments = |ridge: &TrackedRidge| ridge.spectrogram.amplitude_m.iter().any(Option::is_some);
        let measured = case.measured_side().and_then(track).filter(has_segments);
        let (segment_s, side) = (measured.as_ref().map(|m| m.spectrogram.segment_s), case.model_side());
        let model =
            model_frames(case, &side).and_then(|frames| track_ridge(case, &side, frames, segment_s, false));
        Self { measured, model }
    }
}

/// Window from the release of the tip at the first reversal to the hold at the second. If one of these
/// instants is not found, the window is open at that end.
pub(crate) fn release_window(side: &TimedRecording) -> Window {
    let end = |anchor, reversal| match side.instants.time_s(anchor, reversal) {
        Ok(_) => WindowEnd::Found { anchor, reversal, offset_s: 0.0 },
        Err(_) => WindowEnd::Open,
    };
    Window { from: end(InstantKind::Release, 1), to: end(InstantKind::Hold, 2) }
}

/// Frames of the model that are analysed: those after the release of the tip in the model. If a recording
/// exists but shows no release, they are instead the frames at the same times as the analysed frames of the
/// recording.
fn model_frames(case: &ConditionComparison, model: &TimedRecording) -> Option<Range<usize>> {
    let Some(side) = case.measured_side().filter(|side| side.instant_s(InstantKind::Release).is_none())
    else {
        return model.window_frames(&release_window(model));
    };
    let frames = side.window_frames(&release_window(&side))?;
    let model_s = |frame: usize| side.recording.grid().time_s(frame) - case.alignment.shift_s;
    Some(model.frames_between((model_s(frames.start), model_s(frames.end))))
}

/// Among the bands in which the job targets a frequency of the deflection, returns the band with the highest
/// lower end.
fn fastest_band<'a>(case: &ConditionComparison<'a>) -> Option<&'a FeatureBand> {
    case.targets()
        .filter(|aim| matches!(aim.feature.reading, Reading::Frequency(_) | Reading::CycleFrequency { .. }))
        .filter_map(spectral_band)
        .filter(|b| b.channel == Channel::Deflection)
        .max_by(|a, b| a.band_hz.0.total_cmp(&b.band_hz.0))
}

/// Length of the segments in which the job measures the frequency of cycles, s.
fn job_segment_s(case: &ConditionComparison) -> Option<f64> {
    case.targets().find_map(|aim| match aim.feature.reading {
        Reading::CycleFrequency { segment_s, .. } => Some(segment_s),
        _ => None,
    })
}

/// Smallest allowed length of a segment, s: two cycles of the slowest target frequency. In a segment as short
/// as one cycle, an oscillation would appear as a slower component.
fn min_segment_s(case: &ConditionComparison) -> f64 {
    const CYCLES: f64 = 2.0;
    case.frequency_comparisons().map(|sought| CYCLES / sought.target.frequency_hz).fold(0.0, f64::max)
}

fn track_ridge(
    case: &ConditionComparison,
    side: &TimedRecording,
    frames: Range<usize>,
    segment_s: Option<f64>,
    is_measured: bool,
) -> Option<TrackedRidge> {
    let rate_hz = side.recording.grid().frame_rate_hz;
    let samples = side.samples(case.cycle_channel());
    let inside = samples.get(frames.clone())?;
    let top_hz = default_band_hz(frames.len(), rate_hz, None);
    let band_hz = match fastest_band(case) {
        Some(band) => (band.band_hz.0, band.band_hz.1.min(top_hz.1)),
        None => (
            top_hz.0.max(LEAST_OF_STICK_RATE * usual_stick_rate_hz(case)).max(least_cycle_hz(case)),
            top_hz.1,
        ),
    };
    let band_hz = if band_hz.0 < band_hz.1 { band_hz } else { top_hz };
    // slower motion would disturb the ridge
    let fast = subtract_slow_motion(inside, rate_hz, band_hz.0);
    let mut ridge =
        choose_ridge(&fast, rate_hz, band_hz, segment_s.or(job_segment_s(case)), min_segment_s(case))?;
    let settings = SpectrogramSettings {
        segment_s: Some(ridge.segment_s),
        band_hz: Some(band_hz),
        overlap: Some(DRAWN_OVERLAP),
    };
    // a segment cannot show a motion whose period is longer than the segment
    let shown = subtract_slow_motion(inside, rate_hz, ridge.segment_s.recip());
    let spectrogram = Spectrogram::new(&shown, rate_hz, &settings).ok()?;
    let mut courses = course::coherent_parts(&ridge, &spectrogram);
    for point in ridge.points.iter_mut().chain(courses.iter_mut().flatten()) {
        point.frequency_sd_hz = side.recording.add_clock_sd(point.frequency_hz, point.frequency_sd_hz);
    }
    if is_measured && !exceeds_noise(&fast, rate_hz, &ridge, &courses) {
        courses.clear();
    }
    let start_s = side.recording.grid().time_s(frames.start);
    let shift_s = if is_measured { case.alignment.shift_s } else { 0.0 };
    // a measured component needs no stick of the model, which may slide where the recorded tip sticks
    let counted = if is_measured { side.recording.count_cycles(frames.clone()).ok() } else { None };
    let slips_s: Vec<f64> = match &counted {
        Some(cycle) => cycle.slips.iter().map(|slip| slip.time_s).collect(),
        None => case.states.stick_s.iter().map(|[start_s, _]| start_s + shift_s).collect(),
    };
    let is_cycle = |p: &&RidgePoint| {
        let within = |time_s: &&f64| (**time_s - start_s - p.time_s).abs() <= 0.5 * ridge.segment_s;
        let slips = slips_s.iter().filter(within).count();
        let least_hz = (LEAST_OF_STICK_RATE * slips as f64 / ridge.segment_s).max(least_cycle_hz(case));
        (is_measured || slips > 0) && p.frequency_hz >= least_hz
    };
    let cycle: Vec<RidgePoint> = courses.iter().flatten().filter(is_cycle).copied().collect();
    let over_speed = ridge_over_speed(side, frames.start, &cycle, ridge.segment_s);
    Some(TrackedRidge { start_s, spectrogram, ridge, courses, band_hz, over_speed })
}

/// The ridge in segments of the given length. Without a given length, chooses the shortest segments in which
/// nearly the largest fraction of the ridge follows one component: short segments resolve changes, but in
/// segments that are too short the ridge breaks up.
fn choose_ridge(
    fast: &[Option<f64>],
    rate_hz: f64,
    band_hz: (f64, f64),
    segment_s: Option<f64>,
    shortest_s: f64,
) -> Option<Ridge> {
    let cut = |segment_s: Option<f64>| {
        let settings = SpectrogramSettings { segment_s, band_hz: Some(band_hz), overlap: None };
        let spectrogram = Spectrogram::new(fast, rate_hz, &settings).ok()?;
        let ridge = spectrogram.find_ridge(fast, band_hz).ok()?;
        let points: usize = course::coherent_parts(&ridge, &spectrogram).iter().map(Vec::len).sum();
        Some((points as f64 / spectrogram.time_s.len().max(1) as f64, ridge))
    };
    let first = cut(segment_s)?;
    if segment_s.is_some() {
        return Some(first.1);
    }
    let most_s = fast.len() as f64 / rate_hz / MIN_SEGMENTS;
    let lengths = SEGMENT_LENGTH_FACTORS.iter().map(|share| share * first.1.segment_s);
    let all: Vec<(f64, Ridge)> =
        lengths.filter(|s| *s >= shortest_s && *s <= most_s).filter_map(|s| cut(Some(s))).collect();
    let most = all.iter().map(|(share, _)| *share).fold(0.0, f64::max);
    all.into_iter().find(|(share, _)| *share >= NEARLY_BEST * most).or(Some(first)).map(|(_, ridge)| ridge)
}

/// A frequency counts as that of the stick-slip cycle if its ratio to the rate of the model's sticks is at
/// least this. The swing of the head is several times slower.
const LEAST_OF_STICK_RATE: f64 = 0.6;

/// Median rate of the model's sticks, Hz: the reciprocal of the median time from the start of a stick to that
/// of the next; 0 for fewer than [`MIN_STICKS`] sticks.
fn usual_stick_rate_hz(case: &ConditionComparison) -> f64 {
    let sticks = &case.states.stick_s;
    let period_s = median_interval_s(sticks.iter().map(|[start_s, _]| *start_s));
    period_s.filter(|_| sticks.len() >= MIN_STICKS).map_or(0.0, f64::recip)
}

/// Minimum number of sticks for a median rate.
const MIN_STICKS: usize = 10;

/// A frequency counts as that of the stick-slip cycle if its ratio to the natural frequency of the neck is at
/// least this. For the swing of the head on the neck, this ratio is a third.
const LEAST_OF_NECK: f64 = 0.5;

/// Frequency, Hz, below which a component is the swing of the head, however often the model sticks.
fn least_cycle_hz(case: &ConditionComparison) -> f64 {
    LEAST_OF_NECK * body_frequencies(&case.model.scene.linkage).neck_hz
}

/// Points of the stick-slip cycle, each with the mean speed of the tip in its segment.
fn ridge_over_speed(
    side: &TimedRecording,
    first: usize,
    cycle: &[RidgePoint],
    segment_s: f64,
) -> Vec<SpeedPoint> {
    let (grid, tip) = (side.recording.grid(), &side.recording.traces().tip_x_m);
    let half = (0.5 * segment_s * grid.frame_rate_hz).ceil() as usize;
    let point = |p: &RidgePoint| {
        let centre = first + (p.time_s * grid.frame_rate_hz).round() as usize;
        let segment = centre.saturating_sub(half)..(centre + half).min(grid.frames);
        Some(SpeedPoint {
            speed_m_per_s: mean_speed_m_per_s(tip, grid.frame_rate_hz, segment)?.abs(),
            frequency_hz: p.frequency_hz,
            frequency_sd_hz: Some(p.frequency_sd_hz),
        })
    };
    let every = cycle.len().div_ceil(MAX_SPEED_POINTS).max(1);
    cycle.iter().step_by(every).filter_map(point).collect()
}

impl TrackedRidge {
    /// Lowest and highest frequency of the points in `courses`, Hz.
    pub(crate) fn frequency_range_hz(&self) -> Option<(f64, f64)> {
        let all = || self.courses.iter().flatten().map(|p| p.frequency_hz);
        all().reduce(f64::min).zip(all().reduce(f64::max))
    }
}
