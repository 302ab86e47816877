//! Amplitude spectra, one for each window of a channel that the fit reads, and the one of the low
//! component taken apart.

use super::{Named, Spectra, figure, strongest};
use crate::compare::windows::{FitWindow, Sought, fit_windows};
use crate::compare::{Case, Side};
use crate::feature::{Band, Reading};
use crate::figures::analysis::compared;
use crate::figures::naming::file_word;
use crate::figures::{FigureBlock, Words, ring_down};
use crate::spectrum::{Analysis, Record, Settings};
use crate::text::{capitalised, digits, length, percent, signed_percent, with_sd};

/// Frequencies are shown up to this many times the band that the fit reads, and to this one, Hz, at least:
/// what a fast camera has beyond is noise.
const BEYOND_BAND: f64 = 10.0;
const LEAST_TOP_HZ: f64 = 5e3;

/// The spectra in the order of the job, then the ring-down. Every window is analysed once; one after the
/// other, because long ones are large.
pub(crate) fn blocks(case: &Case) -> Vec<FigureBlock> {
    let all = fit_windows(case.job, case.condition);
    let lowest = ring_down::caption::lowest(case, &all);
    let (mut spectra, mut ring_down) = (Vec::new(), None);
    for (i, window) in all.iter().enumerate() {
        let Some(band) = window.band else { continue };
        let measured = case.measured_side().and_then(|side| taken(case, &side, band));
        let model = taken(case, &case.model_side(), band);
        if let Some((_, target_hz)) = lowest.filter(|(of, _)| *of == i) {
            let shown = if case.recording().is_some() { &measured } else { &model };
            ring_down = shown
                .as_ref()
                .and_then(|analysis| ring_down::caption::block(case, window, analysis, target_hz));
        }
        spectra.extend(block(case, window, band, measured.as_ref(), model.as_ref()));
    }
    spectra.into_iter().chain(ring_down).collect()
}

fn block(
    case: &Case,
    window: &FitWindow,
    band: &Band,
    measured: Option<&Analysis>,
    model: Option<&Analysis>,
) -> Option<FigureBlock> {
    let met = window.frequencies(case.result);
    let spectra = Spectra {
        quantity: window.channel.label(),
        note: format!("spectrum of the {} in the window {}", window.channel.label(), window.window),
        synthetic: case.synthetic(),
        targets: met.iter().map(|m| m.target.clone()).collect(),
        ..shown(compared(measured, model), band)
    };
    let spectra = Spectra { title: title(&spectra, &met), ..spectra };
    let name = |aim: &&&crate::fit::job::Aim| matches!(aim.feature.reading, Reading::Frequency(_));
    let first = window.aims.iter().find(name).or(window.aims.first())?;
    let words = words(case, window, band, &spectra, &met);
    Some(case.block(&format!("spectrum-{}", file_word(&first.feature.name)), words, figure(&spectra)))
}

/// Spectra up to the highest frequency that is shown.
fn shown(mut spectra: Spectra, band: &Band) -> Spectra {
    let components = spectra.components.iter().chain(&spectra.model_components).map(|c| c.frequency_hz);
    let top_hz = components.fold(LEAST_TOP_HZ, f64::max).max(BEYOND_BAND * band.band_hz.1);
    let cut = |frequency_hz: &mut Vec<f64>, amplitude_m: &mut Vec<f64>| {
        frequency_hz.truncate(frequency_hz.partition_point(|f| *f <= top_hz));
        amplitude_m.truncate(frequency_hz.len());
    };
    [&mut spectra.measured, &mut spectra.model]
        .into_iter()
        .flatten()
        .for_each(|curve| cut(&mut curve.frequency_hz, &mut curve.amplitude_m));
    spectra.noise_floor.iter_mut().for_each(|level| cut(&mut level.frequency_hz, &mut level.amplitude_m));
    spectra
}

/// A window of one side, taken apart.
fn taken(case: &Case, side: &Side, band: &Band) -> Option<Analysis> {
    let samples = side.samples(band.channel);
    let record = Record {
        samples: samples.get(side.frames(&band.window)?)?,
        frame_rate_hz: side.recording.grid().frame_rate_hz,
        exposure_s: case.exposure_s(),
    };
    Analysis::of(&record, &Settings { detrend: Some(band.detrend), ..Settings::default() }).ok()
}

fn words(case: &Case, window: &FitWindow, band: &Band, spectra: &Spectra, met: &[Sought]) -> Words {
    let both = if spectra.measured.is_some() {
        format!("{} and the fitted model, read alike", case.source())
    } else {
        case.source()
    };
    let mut said = vec![format!(
        "Amplitude spectrum of the {} in the window {} ({} removed, Hann window): {both}.",
        window.channel.label(),
        window.window,
        band.detrend
    )];
    let kind = if case.recording().is_some() { "target" } else { "published" };
    said.extend(met.iter().map(|met| of_target(met, kind)));
    for (of, components) in [("recording", &spectra.components), ("model", &spectra.model_components)]
        .into_iter()
        .filter(|(_, c)| !c.is_empty())
    {
        let names: Vec<String> = components.iter().map(Named::name).collect();
        said.push(format!("Components of the {of}, the largest first: {}.", names.join("; ")));
    }
    if let Some(floor_m) = spectra.noise_floor_m {
        let floor = length(floor_m);
        said.push(format!(
            "The noise floor of the recording is {floor} in a bin of the window; the model is drawn without \
             noise, its components above that floor."
        ));
    }
    let channel = window.channel.label();
    let caption = format!("Amplitude spectrum of the {channel}, {}: {}.", whose(case, spectra), claim(met));
    Words { caption, details: said.join(" ") }
}

/// Whose spectra are drawn.
fn whose(case: &Case, spectra: &Spectra) -> String {
    match (&spectra.measured, &spectra.model) {
        (Some(_), Some(_)) => format!("{} over the fitted model", case.source_kind()),
        (None, Some(_)) => "the fitted model alone".to_owned(),
        _ => format!("{} alone", case.source_kind()),
    }
}

/// The claim with its number.
fn title(spectra: &Spectra, met: &[Sought]) -> String {
    match met {
        [] => strongest(spectra),
        [one] => match one.model_hz {
            Some(hz) => format!(
                "The model has {} Hz, {} from the target of {} Hz",
                digits(hz, 4),
                percent((hz / one.target.frequency_hz - 1.0).abs()),
                with_sd(one.target.frequency_hz, one.target.frequency_sd_hz)
            ),
            None => format!(
                "The model has no component at the target of {} Hz",
                with_sd(one.target.frequency_hz, one.target.frequency_sd_hz)
            ),
        },
        _ => capitalised(&claim(met).replace(" that are sought", "")),
    }
}

/// How many of the frequencies that are sought the model has, and how near they are.
fn claim(met: &[Sought]) -> String {
    let error = |met: &Sought| met.model_hz.map(|hz| (hz / met.target.frequency_hz - 1.0).abs());
    let errors: Vec<f64> = met.iter().filter_map(error).collect();
    let largest = errors.iter().copied().fold(0.0, f64::max);
    let (found, all) = (errors.len(), met.len());
    match (found, all) {
        (_, 0) => "no frequency is sought in it".to_owned(),
        (0, _) => format!("the model has none of the {all} frequencies that are sought"),
        (1, 1) => format!("the model meets the frequency that is sought within {}", percent(largest)),
        _ if found == all => {
            format!("the model meets all {all} frequencies that are sought within {}", percent(largest))
        }
        _ => format!(
            "the model has {found} of the {all} frequencies that are sought, within {}",
            percent(largest)
        ),
    }
}

/// "high: target 908(4) Hz, model 908.0 Hz (+0.04 %)."
fn of_target(met: &Sought, kind: &str) -> String {
    let target = &met.target;
    let model = met.model_hz.map_or_else(
        || "the model shows none".to_owned(),
        |hz| format!("model {} Hz ({})", digits(hz, 4), signed_percent(hz / target.frequency_hz - 1.0)),
    );
    format!("{}: {kind} {} Hz, {model}.", target.name, with_sd(target.frequency_hz, target.frequency_sd_hz))
}
