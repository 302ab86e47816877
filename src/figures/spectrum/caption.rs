//! The spectra of a condition of a fit: their data and their caption.

use crate::compare::condition::{FitWindow, FrequencyComparison, group_fit_windows};
use crate::compare::{ConditionComparison, TimedRecording, release_window};
use crate::figures::analysis::compare_spectra;
use crate::figures::spectrum::{SpectraPlot, draw_figure, draw_panel, strongest_claim};
use crate::figures::{FigureBlock, FigureText};
use crate::text::{capitalise, format_digits, format_percent, format_with_sd};
use plain_charts::{Figure, Panel};
use short_spectra::{SpectralAnalysis, SpectrumSettings};

/// The highest shown frequency is at least this multiple of the upper end of the band of the fit. It is also
/// at least `MIN_TOP_HZ` and at least the highest frequency of a component. Above it, a fast camera records
/// only noise.
const BAND_MARGIN: f64 = 10.0;
/// The highest shown frequency of the spectra is at least this, Hz.
const MIN_TOP_HZ: f64 = 5e3;
/// Maximum number of windows in the figure; more do not fit on a printed page.
const MOST_WINDOWS: usize = 4;
/// Height, mm, of a panel if the figure has several.
const PANEL_HEIGHT_MM: f64 = 48.0;

/// The spectra of recording and model, with one panel for each window of the job. A job without windows has
/// one panel with the motion after the release of the tip. `None` if no window can be analysed.
pub(crate) fn figure_block(case: &ConditionComparison) -> Option<FigureBlock> {
    let mut windows = group_fit_windows(case.job, case.condition);
    windows.retain(|window| window.band.is_some());
    windows.truncate(MOST_WINDOWS);
    if windows.is_empty() {
        let window = release_window(&case.measured_or_model());
        windows.push(FitWindow { channel: case.cycle_channel(), window, band: None, targets: Vec::new() });
    }
    // long windows need much memory, so they are analysed one after the other
    let found: Vec<_> = windows.iter().filter_map(|window| compare_window(case, window)).collect();
    let met: Vec<FrequencyComparison> = found.iter().flat_map(|(_, met)| met.iter().cloned()).collect();
    let (first, _) = found.first()?;
    let title = figure_title(first, &met);
    let shown = SpectraPlot { title: title.clone(), ..first.clone() };
    let figure = match found.as_slice() {
        [_] => draw_figure(&shown),
        several => {
            let panel = |(spectra, _): &(SpectraPlot, _)| Panel {
                title: spectra.note.clone(),
                height_mm: PANEL_HEIGHT_MM,
                ..draw_panel(spectra)
            };
            let note = case.heading_note("");
            Figure {
                panels: several.iter().map(panel).collect(),
                ..draw_figure(&SpectraPlot { note, ..shown })
            }
        }
    };
    Some(case.figure_block(
        "spectrum",
        FigureText { caption: format!("{title}."), details: String::new() },
        figure,
    ))
}

/// Spectra of recording and model in a window, with the target frequencies; `None` if neither can be
/// analysed.
fn compare_window(
    case: &ConditionComparison,
    window: &FitWindow,
) -> Option<(SpectraPlot, Vec<FrequencyComparison>)> {
    let met = window.frequency_comparisons(case.result);
    let measured = case.measured_side().and_then(|side| analyse_window(case, &side, window));
    let model = analyse_window(case, &case.model_side(), window);
    if measured.is_none() && model.is_none() {
        return None;
    }
    let spectra = SpectraPlot {
        quantity: window.channel.label(),
        note: format!("{}, {}", window.channel.label(), window.window),
        synthetic: case.is_synthetic(),
        targets: met.iter().map(|m| m.target.clone()).collect(),
        ..limit_frequencies(compare_spectra(measured.as_ref(), model.as_ref()), window)
    };
    Some((spectra, met))
}

/// Cuts the spectra at the highest frequency shown.
fn limit_frequencies(mut spectra: SpectraPlot, window: &FitWindow) -> SpectraPlot {
    let components = spectra.components.iter().chain(&spectra.model_components).map(|c| c.frequency_hz);
    let band_hz = window.band.map_or(0.0, |band| BAND_MARGIN * band.band_hz.1);
    let top_hz = components.fold(MIN_TOP_HZ, f64::max).max(band_hz);
    let kept = |frequency_hz: &[f64]| frequency_hz.partition_point(|f| *f <= top_hz);
    for curve in [&mut spectra.measured, &mut spectra.model].into_iter().flatten() {
        let kept = kept(&curve.frequency_hz);
        curve.frequency_hz.truncate(kept);
        curve.amplitude_m.truncate(kept);
    }
    if let Some(level) = &mut spectra.noise_floor {
        let kept = kept(&level.frequency_hz);
        level.frequency_hz.truncate(kept);
        level.amplitude_m.truncate(kept);
    }
    if let Some(interval) = &mut spectra.interval_95 {
        let kept = kept(&interval.frequency_hz);
        interval.frequency_hz.truncate(kept);
        interval.lower_m.truncate(kept);
        interval.upper_m.truncate(kept);
    }
    spectra
}

/// The spectral analysis of a window in the recording or in the model.
fn analyse_window(
    case: &ConditionComparison,
    side: &TimedRecording,
    window: &FitWindow,
) -> Option<SpectralAnalysis> {
    let samples = side.samples(window.channel);
    let inside = samples.get(side.window_frames(&window.window)?)?;
    let settings =
        SpectrumSettings { detrend: window.band.map(|band| band.detrend), ..SpectrumSettings::default() };
    side.recording.analyse_samples(inside, case.exposure_s(), &settings).ok()
}

/// The main result in one sentence, with its number.
fn figure_title(spectra: &SpectraPlot, met: &[FrequencyComparison]) -> String {
    match met {
        [] => strongest_claim(spectra),
        [one] => {
            let target = format_with_sd(one.target.frequency_hz, one.target.frequency_sd_hz);
            let Some(hz) = one.model_hz else {
                return format!("The model has no component at the target of {target} Hz");
            };
            let off = format_percent((hz / one.target.frequency_hz - 1.0).abs());
            format!("The model has {} Hz, {off} from the target of {target} Hz", format_digits(hz, 4))
        }
        _ => capitalise(&claim_sentence(met)),
    }
}

/// Clause on the number of target frequencies that the model meets, and on its largest error.
fn claim_sentence(met: &[FrequencyComparison]) -> String {
    let error = |met: &FrequencyComparison| met.model_hz.map(|hz| (hz / met.target.frequency_hz - 1.0).abs());
    let errors: Vec<f64> = met.iter().filter_map(error).collect();
    let largest = format_percent(errors.iter().copied().fold(0.0, f64::max));
    match (errors.len(), met.len()) {
        (0, all) => format!("the model has none of the {all} target frequencies"),
        (found, all) if found == all => {
            format!("the model has all {all} target frequencies, at most {largest} off")
        }
        (found, all) => format!("the model has {found} of {all} target frequencies, at most {largest} off"),
    }
}
