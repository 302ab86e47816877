//! Spectrograms of the deflection after the release, of both sides alike, with the ridges that follow the
//! stick-slip cycle.

use super::aims::{band, met};
use super::pair::{Pair, Side};
use crate::feature::{Band, Reading};
use crate::recording::channel::{Anchor, Channel, Window, WindowEnd, mean_speed_m_per_s};
use crate::report::FigureBlock;
use crate::report::figure::spectrogram::{self, Compared, Of, RidgePoint, SpeedPoint, drawn};
use crate::spectrum::time_frequency::{
    Ridge, RidgePoint as Followed, Spectrogram, SpectrogramSettings, default_band_hz,
};
use crate::spectrum::{Analysis, Record, Settings};
use crate::text::{digits, milliseconds};
use std::ops::Range;

/// The frequencies shown reach this far beyond the ridges.
const ABOVE: f64 = 1.6;
/// Lengths of segments that are tried, over the one that shows the component best, the shortest first.
const TRIED: [f64; 8] = [0.15, 0.2, 0.3, 0.45, 0.7, 1.0, 1.4, 2.0];
/// Segments that a record holds side by side at least, so that there is a course.
const SIDE_BY_SIDE: f64 = 3.0;
/// Share of the best course that is as good as it.
const NEARLY: f64 = 0.95;

/// The figure; none where nothing can be cut into segments.
pub(super) fn blocks(pair: &Pair) -> Vec<FigureBlock> {
    let measured = pair
        .measured_side()
        .and_then(|side| cut(pair, side, side.frames(&window(&side))?, None))
        .filter(Cut::shows_something);
    let segment_s = measured.as_ref().map(|c| c.spectrogram.segment_s);
    let side = pair.model_side();
    let model = model_frames(pair, &side).and_then(|frames| cut(pair, side, frames, segment_s));
    let of = [(Of::Measured, measured.as_ref(), 0.0), (Of::Model, model.as_ref(), pair.aligned.shift_s)];
    let sides: Vec<(Of, &Cut, f64)> =
        of.into_iter().filter_map(|(of, cut, shift_s)| Some((of, cut?, shift_s))).collect();
    let Some((_, first, _)) = sides.first() else { return Vec::new() };
    let top_hz = sides
        .iter()
        .flat_map(|(_, c, _)| c.drawn.iter().flatten().map(|p| p.frequency_hz))
        .fold(0.0, f64::max);
    let nyquist_hz = first.side.recording.grid().frame_rate_hz / 2.0;
    let shown_hz = (0.0, if top_hz > 0.0 { (ABOVE * top_hz).min(nyquist_hz) } else { nyquist_hz });
    let note = format!("deflection in segments of {}", milliseconds(first.spectrogram.segment_s));
    let figure = spectrogram::compared(&Compared {
        title: "Spectrogram".to_owned(),
        note: pair.note(&note),
        synthetic: pair.synthetic(),
        sides: sides.iter().map(|(of, cut, shift_s)| (*of, cut.shown(*shift_s, shown_hz))).collect(),
    });
    vec![pair.block("spectrogram", caption(pair, &sides), figure)]
}

/// A part of one side in segments.
struct Cut<'a> {
    side: Side<'a>,
    frames: Range<usize>,
    spectrogram: Spectrogram,
    ridge: Ridge,
    /// What of the ridge is drawn.
    drawn: Vec<Vec<Followed>>,
    band_hz: (f64, f64),
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

/// The band in which the fit seeks the fastest component of the deflection.
fn sought<'a>(pair: &Pair<'a>) -> Option<&'a Band> {
    let of_frequency = |aim: &&crate::fit::job::Aim| {
        matches!(aim.feature.reading, Reading::Frequency(_) | Reading::CycleFrequency { .. })
    };
    let aims =
        pair.job.aims.iter().filter(|aim| aim.feature.condition == pair.condition).filter(of_frequency);
    aims.filter_map(band)
        .filter(|b| b.channel == Channel::Deflection)
        .max_by(|a, b| a.band_hz.0.total_cmp(&b.band_hz.0))
}

/// The model from its own release on; of a recording in which none is found, while the camera ran.
fn model_frames(pair: &Pair, model: &Side) -> Option<Range<usize>> {
    match pair.measured_side().filter(|side| side.instant_s(Anchor::Release).is_none()) {
        Some(side) => {
            let (grid, shift_s) = (side.recording.grid(), pair.aligned.shift_s);
            let frames = side.frames(&window(&side))?;
            Some(model.between((grid.time_s(frames.start) - shift_s, grid.time_s(frames.end) - shift_s)))
        }
        None => model.frames(&window(model)),
    }
}

fn cut<'a>(pair: &Pair, side: Side<'a>, frames: Range<usize>, segment_s: Option<f64>) -> Option<Cut<'a>> {
    let rate_hz = side.recording.grid().frame_rate_hz;
    let samples = side.samples(Channel::Deflection);
    let record = Record {
        samples: samples.get(frames.clone())?,
        frame_rate_hz: rate_hz,
        exposure_s: pair.exposure_s(),
    };
    let analysis = Analysis::of(&record, &Settings::default()).ok()?;
    let frames = frames.start + analysis.left_out..frames.end;
    let top_hz = default_band_hz(frames.len(), rate_hz, None);
    let band_hz = sought(pair).map_or(top_hz, |band| (band.band_hz.0, band.band_hz.1.min(top_hz.1)));
    let band_hz = if band_hz.0 < band_hz.1 { band_hz } else { top_hz };
    // the ridge is followed without what is slower than its band
    let fast = fast(&analysis, rate_hz, band_hz.0);
    let ridge = followed(&fast, rate_hz, band_hz, segment_s.or(given_s(pair)), shortest_s(pair))?;
    let settings = SpectrogramSettings { segment_s: Some(ridge.segment_s), band_hz: Some(band_hz) };
    let spectrogram = Spectrogram::of(&analysis.detrended_m(), rate_hz, &settings).ok()?;
    let drawn = drawn::parts(&ridge, &spectrogram);
    Some(Cut { side, frames, spectrogram, ridge, drawn, band_hz })
}

/// Length of the segments in which the fit itself looks at cycles, s.
fn given_s(pair: &Pair) -> Option<f64> {
    let of = |aim: &crate::fit::job::Aim| match aim.feature.reading {
        Reading::CycleFrequency { segment_s, .. } => Some(segment_s),
        _ => None,
    };
    pair.job.aims.iter().filter(|aim| aim.feature.condition == pair.condition).find_map(of)
}

/// Length of two cycles of the slowest component, s: a segment about as long as one would show its swings as
/// a slower one.
fn shortest_s(pair: &Pair) -> f64 {
    const CYCLES: f64 = 2.0;
    let aims = pair.job.aims.iter().filter(|aim| aim.feature.condition == pair.condition);
    aims.filter_map(|aim| met(aim, pair.result)).map(|m| CYCLES / m.target.frequency_hz).fold(0.0, f64::max)
}

/// The ridge in segments of a given length; without one, of the shortest of whose ridge nearly as much can be
/// drawn as of any: shorter ones show how it changes, until it swings from segment to segment.
fn followed(
    fast: &[Option<f64>],
    rate_hz: f64,
    band_hz: (f64, f64),
    segment_s: Option<f64>,
    shortest_s: f64,
) -> Option<Ridge> {
    let cut = |segment_s: Option<f64>| {
        let spectrogram =
            Spectrogram::of(fast, rate_hz, &SpectrogramSettings { segment_s, band_hz: Some(band_hz) })
                .ok()?;
        let ridge = spectrogram.ridge(fast, band_hz).ok()?;
        let drawn: usize = drawn::parts(&ridge, &spectrogram).iter().map(Vec::len).sum();
        Some((drawn as f64 / spectrogram.time_s.len().max(1) as f64, ridge))
    };
    let first = cut(segment_s)?;
    if segment_s.is_some() {
        return Some(first.1);
    }
    let most_s = fast.len() as f64 / rate_hz / SIDE_BY_SIDE;
    let lengths =
        TRIED.iter().map(|share| share * first.1.segment_s).filter(|s| *s >= shortest_s && *s <= most_s);
    let all: Vec<(f64, Ridge)> = lengths.filter_map(|s| cut(Some(s))).collect();
    let most = all.iter().map(|(drawn, _)| *drawn).fold(0.0, f64::max);
    all.into_iter().find(|(drawn, _)| *drawn >= NEARLY * most).or(Some(first)).map(|(_, ridge)| ridge)
}

/// The record without trend and without the oscillations below a frequency, m.
fn fast(analysis: &Analysis, rate_hz: f64, low_hz: f64) -> Vec<Option<f64>> {
    let kept: Vec<_> = analysis.oscillations.iter().filter(|o| o.frequency_hz >= low_hz).collect();
    let at = |(i, left): (usize, &Option<f64>)| {
        left.map(|left| left + kept.iter().map(|o| o.at_m(i as f64 / rate_hz)).sum::<f64>())
    };
    analysis.left_m.iter().enumerate().map(at).collect()
}

impl Cut<'_> {
    /// Whether any segment has frames enough.
    fn shows_something(&self) -> bool {
        self.spectrogram.amplitude_m.iter().any(Option::is_some)
    }

    fn shown(&self, shift_s: f64, shown_hz: (f64, f64)) -> spectrogram::Spectrogram {
        let start_s = self.start_s() + shift_s;
        let spectrogram = &self.spectrogram;
        // (of a fast camera most lie beyond what is shown)
        let bins = spectrogram.frequency_hz.partition_point(|f| *f <= shown_hz.1);
        let column = |column: &Option<Vec<f64>>| {
            column
                .as_ref()
                .map_or_else(|| vec![None; bins], |c| c.iter().take(bins).copied().map(Some).collect())
        };
        let gap = RidgePoint { time_s: start_s, frequency_hz: None };
        let part = |part: &Vec<Followed>| {
            let points = part
                .iter()
                .map(|p| RidgePoint { time_s: start_s + p.time_s, frequency_hz: Some(p.frequency_hz) });
            std::iter::once(gap).chain(points).collect::<Vec<_>>()
        };
        spectrogram::Spectrogram {
            quantity: Channel::Deflection.to_string(),
            time_s: spectrogram.time_s.iter().map(|t| start_s + t).collect(),
            frequency_hz: spectrogram.frequency_hz.iter().take(bins).copied().collect(),
            amplitude_m: spectrogram.amplitude_m.iter().map(column).collect(),
            shown_hz: Some(shown_hz),
            ridge: self.drawn.iter().flat_map(part).collect(),
            over_speed: self.over_speed(),
            ..spectrogram::Spectrogram::default()
        }
    }

    fn start_s(&self) -> f64 {
        self.side.recording.grid().time_s(self.frames.start)
    }

    /// The ridge over the mean speed of the tip in each segment, no more points than can be told apart.
    fn over_speed(&self) -> Vec<SpeedPoint> {
        const MOST: usize = 40;
        let (grid, tip) = (self.side.recording.grid(), &self.side.recording.traces().tip_x_m);
        let half = (0.5 * self.ridge.segment_s * grid.frame_rate_hz).ceil() as usize;
        let point = |p: &Followed| {
            let centre = self.frames.start + (p.time_s * grid.frame_rate_hz).round() as usize;
            let speed = mean_speed_m_per_s(
                tip,
                grid.frame_rate_hz,
                centre.saturating_sub(half)..(centre + half).min(grid.frames),
            )?;
            Some(SpeedPoint {
                tip_speed_m_per_s: speed.abs(),
                frequency_hz: p.frequency_hz,
                frequency_sd_hz: Some(p.frequency_sd_hz),
            })
        };
        let every = self.drawn.iter().map(Vec::len).sum::<usize>().div_ceil(MOST).max(1);
        self.drawn.iter().flatten().step_by(every).filter_map(point).collect()
    }

    /// Least and greatest frequency of what is drawn of the ridge, Hz.
    fn range_hz(&self) -> Option<(f64, f64)> {
        let all = || self.drawn.iter().flatten().map(|p| p.frequency_hz);
        all().reduce(f64::min).zip(all().reduce(f64::max))
    }
}

fn caption(pair: &Pair, sides: &[(Of, &Cut, f64)]) -> String {
    let Some((first_of, first, _)) = sides.first() else { return String::new() };
    let both = match (sides.len() > 1, first_of, pair.recording()) {
        (true, ..) => format!("{} and the fitted model, in the same segments and colours", pair.source()),
        (false, Of::Model, Some(_)) => format!(
            "the fitted model alone, as no segment of {} has frames enough with a deflection",
            pair.source()
        ),
        _ => pair.source(),
    };
    let released = pair.shown().instant_s(Anchor::Release).map_or("", |_| " from the release of the tip on");
    let mut said = vec![format!(
        "Amplitude of the deflection over time and frequency{released} (segments of {}, trend removed): {both}.",
        milliseconds(first.spectrogram.segment_s)
    )];
    for (of, cut, _) in sides {
        let name = if *of == Of::Measured { "the recording" } else { "the model" };
        said.push(match cut.range_hz() {
            Some((low, high)) => format!(
                "The ridge of {name}, the strongest component between {} and {} Hz, is drawn {} and runs from {} to {} Hz.",
                digits(cut.band_hz.0, 3),
                digits(cut.band_hz.1, 3),
                drawn::counted(&cut.drawn, &cut.ridge, &cut.spectrogram),
                digits(low, 3),
                digits(high, 3)
            ),
            None if !cut.ridge.points.is_empty() => {
                format!("The ridge of {name} is drawn {}.", drawn::counted(&cut.drawn, &cut.ridge, &cut.spectrogram))
            }
            None => format!("Nothing in {name} stands out long enough to be followed."),
        });
    }
    if sides.iter().any(|(_, cut, _)| cut.range_hz().is_some()) {
        said.push(
            "Below: the ridges over time and over the mean speed of the tip in each segment.".to_owned(),
        );
    }
    said.join(" ")
}
