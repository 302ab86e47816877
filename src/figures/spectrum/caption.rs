//! The spectra of a condition of a fit: their data and their captions.

use crate::compare::condition::{FitWindow, FrequencyComparison, group_fit_windows};
use crate::compare::{ConditionComparison, TimedRecording};
use crate::feature::{FeatureBand, Reading};
use crate::figures::analysis::compare_spectra;
use crate::figures::figure_text::file_name_part;
use crate::figures::spectrum::components::LabelledComponent;
use crate::figures::spectrum::{SpectraPlot, draw_figure, strongest_claim};
use crate::figures::{FigureBlock, FigureText, ring_down};
use crate::text::{
    capitalise, format_digits, format_length, format_percent, format_signed_percent, format_with_sd,
};
use short_spectra::{SpectralAnalysis, SpectrumSettings};

/// The highest shown frequency is at least this multiple of the upper end of the band of the fit. It is also
/// at least `MIN_TOP_HZ` and at least the highest frequency of a component. Above it, a fast camera records
/// only noise.
const BAND_MARGIN: f64 = 10.0;

/// The highest shown frequency of the spectra is at least this, Hz.
const MIN_TOP_HZ: f64 = 5e3;

/// The spectra in the order of the job, then the ring-down. Long windows need much memory, so they are
/// analysed one after the other, each only once.
pub(crate) fn figure_blocks(case: &ConditionComparison) -> Vec<FigureBlock> {
    let all = group_fit_windows(case.job, case.condition);
    let lowest = ring_down::caption::lowest_window(case, &all);
    let (mut spectra, mut ring_down) = (Vec::new(), None);
    for (i, window) in all.iter().enumerate() {
        let Some(band) = window.band else { continue };
        let measured = case.measured_side().and_then(|side| analyse_window(case, &side, band));
        let model = analyse_window(case, &case.model_side(), band);
        if let Some((_, target_hz)) = lowest.filter(|(of, _)| *of == i) {
            let shown = if case.recording().is_some() { &measured } else { &model };
            ring_down =
                shown.as_ref().and_then(|a| ring_down::caption::figure_block(case, window, a, target_hz));
        }
        spectra.extend(window_block(case, window, band, measured.as_ref(), model.as_ref()));
    }
    spectra.into_iter().chain(ring_down).collect()
}

fn window_block(
    case: &ConditionComparison,
    window: &FitWindow,
    band: &FeatureBand,
    measured: Option<&SpectralAnalysis>,
    model: Option<&SpectralAnalysis>,
) -> Option<FigureBlock> {
    let met = window.frequency_comparisons(case.result);
    let spectra = SpectraPlot {
        quantity: window.channel.label(),
        note: format!("spectrum of the {} in the window {}", window.channel.label(), window.window),
        synthetic: case.is_synthetic(),
        targets: met.iter().map(|m| m.target.clone()).collect(),
        ..limit_frequencies(compare_spectra(measured, model), band)
    };
    let spectra = SpectraPlot { title: figure_title(&spectra, &met), ..spectra };
    let name = |aim: &&&crate::fit::job::FitTarget| matches!(aim.feature.reading, Reading::Frequency(_));
    let first = window.targets.iter().find(name).or(window.targets.first())?;
    let words = figure_text(case, window, band, &spectra, &met);
    let file = format!("spectrum-{}", file_name_part(&first.feature.name));
    Some(case.figure_block(&file, words, draw_figure(&spectra)))
}

/// Cuts the spectra at the highest frequency shown.
fn limit_frequencies(mut spectra: SpectraPlot, band: &FeatureBand) -> SpectraPlot {
    let components = spectra.components.iter().chain(&spectra.model_components).map(|c| c.frequency_hz);
    let top_hz = components.fold(MIN_TOP_HZ, f64::max).max(BAND_MARGIN * band.band_hz.1);
    let cut = |frequency_hz: &mut Vec<f64>, amplitude_m: &mut Vec<f64>| {
        frequency_hz.truncate(frequency_hz.partition_point(|f| *f <= top_hz));
        amplitude_m.truncate(frequency_hz.len());
    };
    let curves = [&mut spectra.measured, &mut spectra.model].into_iter().flatten();
    curves.for_each(|curve| cut(&mut curve.frequency_hz, &mut curve.amplitude_m));
    spectra.noise_floor.iter_mut().for_each(|level| cut(&mut level.frequency_hz, &mut level.amplitude_m));
    spectra
}

/// The spectral analysis of a window in the recording or in the model.
fn analyse_window(
    case: &ConditionComparison,
    side: &TimedRecording,
    band: &FeatureBand,
) -> Option<SpectralAnalysis> {
    let samples = side.samples(band.channel);
    let inside = samples.get(side.window_frames(&band.window)?)?;
    let settings = SpectrumSettings { detrend: Some(band.detrend), ..SpectrumSettings::default() };
    side.recording.analyse_samples(inside, case.exposure_s(), &settings).ok()
}

fn figure_text(
    case: &ConditionComparison,
    window: &FitWindow,
    band: &FeatureBand,
    spectra: &SpectraPlot,
    met: &[FrequencyComparison],
) -> FigureText {
    let alike = if spectra.measured.is_some() { " and the fitted model, read alike" } else { "" };
    let (channel, source) = (window.channel.label(), case.source_name());
    let mut said = vec![format!(
        "Amplitude spectrum of the {channel} in the window {} ({} removed, Hann window): {source}{alike}.",
        window.window, band.detrend
    )];
    let kind = if case.recording().is_some() { "target" } else { "published" };
    said.extend(met.iter().map(|met| describe_target(met, kind)));
    let sides = [("recording", &spectra.components), ("model", &spectra.model_components)];
    for (of, components) in sides.into_iter().filter(|(_, c)| !c.is_empty()) {
        let names: Vec<String> = components.iter().map(LabelledComponent::label_text).collect();
        said.push(format!("Components of the {of}, the largest first: {}.", names.join("; ")));
    }
    if let Some(floor_m) = spectra.noise_floor_m {
        let floor = format_length(floor_m);
        said.push(format!(
            "The noise floor of the recording is {floor} in a bin of the window; the model is drawn without \
             noise, its components above that floor."
        ));
    }
    let whose = match (&spectra.measured, &spectra.model) {
        (Some(_), Some(_)) => format!("{} over the fitted model", case.source_kind()),
        (None, Some(_)) => "the fitted model alone".to_owned(),
        _ => format!("{} alone", case.source_kind()),
    };
    let caption = format!("Amplitude spectrum of the {channel}, {whose}: {}.", claim_sentence(met));
    FigureText { caption, details: said.join(" ") }
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
        _ => capitalise(&claim_sentence(met).replace(" that are sought", "")),
    }
}

/// Clause on the number of target frequencies that the model meets, and on its largest error.
fn claim_sentence(met: &[FrequencyComparison]) -> String {
    let error = |met: &FrequencyComparison| met.model_hz.map(|hz| (hz / met.target.frequency_hz - 1.0).abs());
    let errors: Vec<f64> = met.iter().filter_map(error).collect();
    let largest = format_percent(errors.iter().copied().fold(0.0, f64::max));
    match (errors.len(), met.len()) {
        (_, 0) => "no frequency is sought in it".to_owned(),
        (0, all) => format!("the model has none of the {all} frequencies that are sought"),
        (1, 1) => format!("the model meets the frequency that is sought within {largest}"),
        (found, all) if found == all => {
            format!("the model meets all {all} frequencies that are sought within {largest}")
        }
        (found, all) => {
            format!("the model has {found} of the {all} frequencies that are sought, within {largest}")
        }
    }
}

/// Sentence such as "high: target 908(4) Hz, model 908.0 Hz (+0.04 %)."
fn describe_target(met: &FrequencyComparison, kind: &str) -> String {
    let target = &met.target;
    let off = |hz: f64| format_signed_percent(hz / target.frequency_hz - 1.0);
    let model = met.model_hz.map(|hz| format!("model {} Hz ({})", format_digits(hz, 4), off(hz)));
    let model = model.unwrap_or_else(|| "the model shows none".to_owned());
    let sought = format_with_sd(target.frequency_hz, target.frequency_sd_hz);
    format!("{}: {kind} {sought} Hz, {model}.", target.name)
}
