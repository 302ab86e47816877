//! The spectrograms of a condition of a fit: their data and their captions.

use crate::compare::condition::{FrequencyComparison, group_fit_windows};
use crate::compare::{ConditionComparison, TrackedRidge};
use crate::figures::spectrogram::comparison::{SpectrogramComparison, SpectrogramSide, draw_comparison};
use crate::figures::spectrogram::{SpectrogramPlot, TargetFrequency, describe_ridge_segments, fill_map};
use crate::figures::{FigureBlock, FigureText};
use crate::recording::channel::{Channel, InstantKind};
use crate::text::{format_digits, format_milliseconds};
use std::ops::Range;

/// Ratio of the highest frequency shown to the highest frequency of the ridges.
const RIDGE_MARGIN: f64 = 1.6;

/// Recording or model, with its ridge and the shift from its clock to that of the recording, s.
type ShiftedRidge<'a> = (SpectrogramSide, &'a TrackedRidge, f64);

/// The figure of a condition; empty if neither recording nor model is long enough for a segment.
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
    let segment = format_milliseconds(first.spectrogram.segment_s);
    let note = format!("spectrogram of the deflection in segments of {segment}");
    let figure = draw_comparison(&SpectrogramComparison {
        title: figure_title(&sides),
        note: case.heading_note(&note),
        synthetic: case.is_synthetic(),
        sides: sides
            .iter()
            .map(|side| {
                let (of, followed, shift_s) = *side;
                let plot = SpectrogramPlot {
                    quantity: Channel::Deflection.to_string(),
                    shown_hz: Some(shown_hz),
                    over_speed: followed.over_speed.clone(),
                    targets: target_frequencies(case, side),
                    ..SpectrogramPlot::default()
                };
                // with a fast camera, most frequency bins lie above the shown frequencies
                let bins = followed.spectrogram.frequency_hz.partition_point(|f| *f <= shown_hz.1);
                let start_s = followed.start_s + shift_s;
                (of, fill_map(plot, &followed.spectrogram, &followed.courses, start_s, bins))
            })
            .collect(),
    });
    vec![case.figure_block("spectrogram", figure_text(case, &sides), figure)]
}

/// The target frequencies of the deflection, with their windows in the recording or in the model.
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
        let sought = window.frequency_comparisons(case.result).into_iter();
        sought.filter_map(move |sought| Some((frames.clone()?, sought)))
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

fn figure_text(case: &ConditionComparison, sides: &[ShiftedRidge]) -> FigureText {
    let Some((first_of, first, _)) = sides.first() else {
        return FigureText::default();
    };
    let source = case.source_name();
    let both = match (sides.len() > 1, first_of, case.recording()) {
        (true, ..) => format!("{source} and the fitted model, in the same segments and colours"),
        (false, SpectrogramSide::Model, Some(_)) => {
            format!("the fitted model alone, as no segment of {source} has frames enough with a deflection")
        }
        _ => source,
    };
    let release_s = case.measured_or_model().instant_s(InstantKind::Release);
    let released = release_s.map_or("", |_| " from the release of the tip on");
    let mut said = vec![format!(
        "Amplitude of the deflection over time and frequency{released} (segments of {}, trend removed): \
         {both}.",
        format_milliseconds(first.spectrogram.segment_s)
    )];
    for (of, ridge, _) in sides {
        let name = if *of == SpectrogramSide::Measured { "the recording" } else { "the model" };
        let drawn = describe_ridge_segments(&ridge.courses, &ridge.ridge, &ridge.spectrogram);
        said.push(match ridge.frequency_range_hz() {
            Some((low, high)) => {
                let [low, high, from, to] =
                    [low, high, ridge.band_hz.0, ridge.band_hz.1].map(|hz| format_digits(hz, 3));
                format!(
                    "The ridge of {name}, the strongest component between {from} and {to} Hz, is drawn {drawn} and \
                     runs from {low} to {high} Hz."
                )
            }
            None if !ridge.ridge.points.is_empty() => format!("The ridge of {name} is drawn {drawn}."),
            None => format!("Nothing in {name} stands out long enough to be followed."),
        });
    }
    if sides.iter().any(|(_, ridge, _)| ridge.frequency_range_hz().is_some()) {
        said.push("Below: the ridges over time and over the mean speed of the tip in each segment.".into());
    }
    FigureText { caption: claim_sentence(case, sides), details: said.join(" ") }
}

/// Heading: the frequency ranges of the ridges.
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

/// Caption, with the frequency ranges of the ridges.
fn claim_sentence(case: &ConditionComparison, sides: &[ShiftedRidge]) -> String {
    let name = |of: &SpectrogramSide| {
        if *of == SpectrogramSide::Measured { case.source_kind() } else { "the fitted model" }
    };
    let one = |(of, ridge, _): &ShiftedRidge| match ridge.frequency_range_hz() {
        Some((l, h)) => format!("{} from {} to {} Hz", name(of), format_digits(l, 3), format_digits(h, 3)),
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
