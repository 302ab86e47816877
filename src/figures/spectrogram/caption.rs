//! Spectrograms of the deflection after the release, of both sides alike, with the ridges that follow the
//! stick-slip cycle.

use super::{
    SpectrogramComparison, SpectrogramPlot, SpectrogramRidgePoint, SpectrogramSide, TargetFrequency,
    describe_ridge_segments, draw_comparison,
};
use crate::compare::windows::{FrequencyComparison, group_fit_windows};
use crate::compare::{ConditionComparison, TrackedRidge};
use crate::figures::{FigureBlock, Words};
use crate::recording::channel::{Channel, InstantKind};
use crate::spectrum::time_frequency::RidgePoint as Point;
use crate::text::{format_digits, format_milliseconds};
use std::ops::Range;

/// The frequencies shown reach this far beyond the ridges.
const RIDGE_MARGIN: f64 = 1.6;

/// A side, and what is added to its times, s.
type ShiftedRidge<'a> = (SpectrogramSide, &'a TrackedRidge, f64);

/// The figure; none where nothing can be cut into segments.
pub(crate) fn figure_blocks(case: &ConditionComparison) -> Vec<FigureBlock> {
    let (measured, model) = (case.ridges.measured.as_ref(), case.ridges.model.as_ref());
    let of =
        [(SpectrogramSide::Measured, measured, 0.0), (SpectrogramSide::Model, model, case.alignment.shift_s)];
    let sides: Vec<ShiftedRidge> =
        of.into_iter().filter_map(|(of, ridge, shift_s)| Some((of, ridge?, shift_s))).collect();
    let Some((_, first, _)) = sides.first() else { return Vec::new() };
    let tops = sides.iter().filter_map(|(_, ridge, _)| ridge.frequency_range_hz());
    let top_hz = tops.map(|(_, high)| high).fold(0.0, f64::max);
    let nyquist_hz = case.model.view.recording.grid().frame_rate_hz / 2.0;
    let shown_hz = (0.0, if top_hz > 0.0 { (RIDGE_MARGIN * top_hz).min(nyquist_hz) } else { nyquist_hz });
    let note = format!(
        "spectrogram of the deflection in segments of {}",
        format_milliseconds(first.spectrogram.segment_s)
    );
    let figure = draw_comparison(&SpectrogramComparison {
        title: figure_title(&sides),
        note: case.heading_note(&note),
        synthetic: case.is_synthetic(),
        sides: sides
            .iter()
            .map(|side| {
                let targets = target_frequencies(case, side);
                (side.0, SpectrogramPlot { targets, ..spectrogram_plot(side.1, side.2, shown_hz) })
            })
            .collect(),
    });
    vec![case.figure_block("spectrogram", figure_text(case, &sides), figure)]
}

/// The frequencies of the deflection that the job seeks, in their windows on a side's recording.
fn target_frequencies(case: &ConditionComparison, (of, _, shift_s): &ShiftedRidge) -> Vec<TargetFrequency> {
    let side = match of {
        SpectrogramSide::Measured => case.measured_side(),
        SpectrogramSide::Model => Some(case.model_side()),
    };
    let Some(side) = side else { return Vec::new() };
    let grid = side.recording.grid();
    let windows = group_fit_windows(case.job, case.condition);
    let own = windows.iter().filter(|window| window.channel == Channel::Deflection);
    let found = own.flat_map(|window| {
        let frames = side.window_frames(&window.window);
        window
            .frequency_comparisons(case.result)
            .into_iter()
            .filter_map(move |sought| Some((frames.clone()?, sought)))
    });
    let target = |(frames, sought): (Range<usize>, FrequencyComparison)| TargetFrequency {
        name: sought.target.name,
        frequency_hz: sought.target.frequency_hz,
        frequency_sd_hz: sought.target.frequency_sd_hz,
        span_s: (grid.time_s(frames.start) + shift_s, grid.time_s(frames.end) + shift_s),
        met: sought.met,
    };
    found.map(target).collect()
}

fn spectrogram_plot(of: &TrackedRidge, shift_s: f64, shown_hz: (f64, f64)) -> SpectrogramPlot {
    let (start_s, spectrogram) = (of.start_s + shift_s, &of.spectrogram);
    // (of a fast camera most lie beyond what is shown)
    let bins = spectrogram.frequency_hz.partition_point(|f| *f <= shown_hz.1);
    let column = |column: &Option<Vec<f64>>| match column {
        Some(column) => column.iter().take(bins).copied().map(Some).collect(),
        None => vec![None; bins],
    };
    let gap = SpectrogramRidgePoint { time_s: start_s, frequency_hz: None };
    let place =
        |p: &Point| SpectrogramRidgePoint { time_s: start_s + p.time_s, frequency_hz: Some(p.frequency_hz) };
    let part = |part: &Vec<Point>| std::iter::once(gap).chain(part.iter().map(place)).collect::<Vec<_>>();
    SpectrogramPlot {
        quantity: Channel::Deflection.to_string(),
        time_s: spectrogram.time_s.iter().map(|t| start_s + t).collect(),
        frequency_hz: spectrogram.frequency_hz.iter().take(bins).copied().collect(),
        amplitude_m: spectrogram.amplitude_m.iter().map(column).collect(),
        shown_hz: Some(shown_hz),
        ridge: of.courses.iter().flat_map(part).collect(),
        over_speed: of.over_speed.clone(),
        ..SpectrogramPlot::default()
    }
}

fn figure_text(case: &ConditionComparison, sides: &[ShiftedRidge]) -> Words {
    let Some((first_of, first, _)) = sides.first() else {
        return Words { caption: String::new(), details: String::new() };
    };
    let both = match (sides.len() > 1, first_of, case.recording()) {
        (true, ..) => {
            format!("{} and the fitted model, in the same segments and colours", case.source_name())
        }
        (false, SpectrogramSide::Model, Some(_)) => format!(
            "the fitted model alone, as no segment of {} has frames enough with a deflection",
            case.source_name()
        ),
        _ => case.source_name(),
    };
    let released = case
        .measured_or_model()
        .instant_s(InstantKind::Release)
        .map_or("", |_| " from the release of the tip on");
    let mut said = vec![format!(
        "Amplitude of the deflection over time and frequency{released} (segments of {}, trend removed): \
         {both}.",
        format_milliseconds(first.spectrogram.segment_s)
    )];
    for (of, ridge, _) in sides {
        let name = if *of == SpectrogramSide::Measured { "the recording" } else { "the model" };
        said.push(match ridge.frequency_range_hz() {
            Some((low, high)) => format!(
                "The ridge of {name}, the strongest component between {} and {} Hz, is drawn {} and runs \
                 from {} to {} Hz.",
                format_digits(ridge.band_hz.0, 3),
                format_digits(ridge.band_hz.1, 3),
                describe_ridge_segments(&ridge.courses, &ridge.ridge, &ridge.spectrogram),
                format_digits(low, 3),
                format_digits(high, 3)
            ),
            None if !ridge.ridge.points.is_empty() => {
                format!(
                    "The ridge of {name} is drawn \
                {}.",
                    describe_ridge_segments(&ridge.courses, &ridge.ridge, &ridge.spectrogram)
                )
            }
            None => format!("Nothing in {name} stands out long enough to be followed."),
        });
    }
    if sides.iter().any(|(_, ridge, _)| ridge.frequency_range_hz().is_some()) {
        said.push(
            "Below: the ridges over time and over the mean speed of the tip in each segment.".to_owned(),
        );
    }
    Words { caption: claim_sentence(case, sides), details: said.join(" ") }
}

/// The claim with its numbers: where the ridges run.
fn figure_title(sides: &[ShiftedRidge]) -> String {
    let found = |wanted: SpectrogramSide| {
        let range_hz = sides.iter().find(|(of, ..)| *of == wanted)?.1.frequency_range_hz()?;
        Some(format!("from {} to {} Hz", format_digits(range_hz.0, 3), format_digits(range_hz.1, 3)))
    };
    match (found(SpectrogramSide::Measured), found(SpectrogramSide::Model)) {
        (Some(measured), Some(model)) if measured == model => {
            format!("The strongest component runs {measured} in both")
        }
        (Some(measured), Some(model)) => format!("The ridge runs {measured}, in the model {model}"),
        (Some(measured), None) => format!("The ridge of the recording alone runs {measured}"),
        (None, Some(model)) => format!("The ridge of the model runs {model}"),
        (None, None) => "Nothing stands out long enough to be followed".to_owned(),
    }
}

/// Where the ridges run.
fn claim_sentence(case: &ConditionComparison, sides: &[ShiftedRidge]) -> String {
    let name = |of: &SpectrogramSide| {
        if *of == SpectrogramSide::Measured { case.source_kind() } else { "the fitted model" }
    };
    let one = |(of, ridge, _): &ShiftedRidge| match ridge.frequency_range_hz() {
        Some((low, high)) => {
            format!("{} from {} to {} Hz", name(of), format_digits(low, 3), format_digits(high, 3))
        }
        None => format!("{} nowhere", name(of)),
    };
    let ridges: Vec<String> = sides.iter().map(one).collect();
    let targets = sides.first().map_or_else(Vec::new, |side| target_frequencies(case, side));
    let met = targets.iter().filter(|target| target.met).count();
    let met = match targets.len() {
        0 => String::new(),
        all => format!("; {met} of {all} {} met", if all == 1 { "target is" } else { "targets are" }),
    };
    format!(
        "Amplitude of the deflection over time and frequency: the strongest component can be followed in {}{met}.",
        ridges.join(", in ")
    )
}
