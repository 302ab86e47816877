//! The spectrograms of a condition of a fit: their data and their captions.

use crate::compare::condition::{FrequencyComparison, group_fit_windows};
use crate::compare::{ConditionComparison, TrackedRidge};
use crate::figures::spectrogram::comparison::{SpectrogramComparison, SpectrogramSide, draw_comparison};
use crate::figures::spectrogram::{SpectrogramPlot, SpectrogramRidgePoint, TargetFrequency, fill_map};
use crate::figures::{FigureBlock, FigureText};
use crate::model::modes::named_frequencies;
use crate::text::{format_digits, format_milliseconds};
use std::ops::Range;

/// Ratio of the highest frequency shown to the highest frequency of the ridges. Above 2, it keeps the line at
/// twice the ridge inside the axes.
const RIDGE_MARGIN: f64 = 2.15;
/// Sidebands are drawn if the ratio of their distance from the ridge to its lowest frequency is below this
/// value.
const MAX_SIDEBAND: f64 = 0.3;

/// Recording or model, with its ridge and the shift from its clock to that of the recording, s.
type ShiftedRidge<'a> = (SpectrogramSide, &'a TrackedRidge, f64);

/// The figure of a condition; `None` if neither recording nor model is long enough for a segment.
pub(crate) fn figure_block(case: &ConditionComparison) -> Option<FigureBlock> {
    let (measured, model) = (case.ridges.measured.as_ref(), case.ridges.model.as_ref());
    let of =
        [(SpectrogramSide::Measured, measured, 0.0), (SpectrogramSide::Model, model, case.alignment.shift_s)];
    let sides: Vec<ShiftedRidge> =
        of.into_iter().filter_map(|(of, ridge, shift_s)| Some((of, ridge?, shift_s))).collect();
    let (_, first, _) = sides.first()?;
    let tops = sides.iter().filter_map(|(_, ridge, _)| ridge.frequency_range_hz());
    let top_hz = tops.map(|(_, high)| high).fold(0.0, f64::max);
    let nyquist_hz = case.model.view.recording.grid().frame_rate_hz / 2.0;
    let shown_hz = (0.0, if top_hz > 0.0 { (RIDGE_MARGIN * top_hz).min(nyquist_hz) } else { nyquist_hz });
    let segment = format_milliseconds(first.spectrogram.segment_s);
    let channel = case.cycle_channel();
    let note = format!("spectrogram of the {} in segments of {segment}", channel.label());
    let title = figure_title(&sides);
    let natural_hz = named_frequencies(&case.model.scene.linkage);
    let figure = draw_comparison(&SpectrogramComparison {
        title: title.clone(),
        note: case.heading_note(&note),
        synthetic: case.is_synthetic(),
        sides: sides
            .iter()
            .map(|side| {
                let (of, followed, shift_s) = *side;
                let plot = SpectrogramPlot {
                    quantity: channel.to_string(),
                    shown_hz: Some(shown_hz),
                    targets: target_frequencies(case, side),
                    natural_hz: natural_hz.clone(),
                    ..SpectrogramPlot::default()
                };
                // with a fast camera, most frequency bins lie above the shown frequencies
                let bins = followed.spectrogram.frequency_hz.partition_point(|f| *f <= shown_hz.1);
                let start_s = followed.start_s + shift_s;
                let plot = fill_map(plot, &followed.spectrogram, &followed.courses, start_s, bins);
                (of, SpectrogramPlot { related: related_lines(case, &plot.ridge), ..plot })
            })
            .collect(),
    });
    let caption = format!("{title}.");
    Some(case.figure_block("spectrogram", FigureText { caption, details: String::new() }, figure))
}

/// Lines at twice the frequency of a ridge and at its sidebands, whose distance from it is the lowest target
/// frequency. Each has its name.
fn related_lines(
    case: &ConditionComparison,
    ridge: &[SpectrogramRidgePoint],
) -> Vec<(String, Vec<SpectrogramRidgePoint>)> {
    let moved = |to: &dyn Fn(f64) -> f64| {
        let point =
            |p: &SpectrogramRidgePoint| SpectrogramRidgePoint { frequency_hz: p.frequency_hz.map(to), ..*p };
        ridge.iter().map(point).collect::<Vec<_>>()
    };
    let mut found = vec![("twice the ridge".to_owned(), moved(&|hz| 2.0 * hz))];
    let lowest_hz = ridge.iter().filter_map(|p| p.frequency_hz).reduce(f64::min);
    let slow_hz = case.frequency_comparisons().map(|sought| sought.target.frequency_hz).reduce(f64::min);
    let apart_hz = slow_hz.filter(|slow| lowest_hz.is_some_and(|lowest| *slow < MAX_SIDEBAND * lowest));
    if let Some(apart_hz) = apart_hz {
        let name = format!("sidebands at \u{b1} {} Hz", format_digits(apart_hz, 3));
        let both =
            [moved(&|hz| hz - apart_hz), vec![SpectrogramRidgePoint::default()], moved(&|hz| hz + apart_hz)];
        found.push((name, both.concat()));
    }
    found
}

/// The target frequencies of the followed channel, with their windows in the recording or in the model.
fn target_frequencies(case: &ConditionComparison, (of, _, shift_s): &ShiftedRidge) -> Vec<TargetFrequency> {
    let side = match of {
        SpectrogramSide::Measured => case.measured_side(),
        SpectrogramSide::Model => Some(case.model_side()),
    };
    let Some(side) = side else { return Vec::new() };
    let grid = side.recording.grid();
    let windows = group_fit_windows(case.job, case.condition);
    let own = windows.iter().filter(|window| window.channel == case.cycle_channel());
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
