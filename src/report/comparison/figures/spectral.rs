//! Amplitude spectra, one for each window of a channel that the fit looks at.

use super::aims::{Looked, Met, looked};
use super::file_word;
use super::pair::{Pair, Side};
use super::words::{channel, digits, length, signed};
use crate::fit::features::{Band, Reading};
use crate::report::FigureBlock;
use crate::report::analysis::named;
use crate::report::spectra::{self, Curve, Level, Named, Spectra};
use crate::spectrum::{Analysis, Record, Settings};

/// Components of a model under this share of its largest are of no account.
const LEAST_OF_MODEL: f64 = 1e-3;

/// Frequencies are shown up to this many times the band that the fit looks at, and to this one, Hz, at least: what a fast camera has beyond is noise.
const BEYOND_BAND: f64 = 10.0;
const LEAST_TOP_HZ: f64 = 5e3;

/// The figures, in the order of the job.
pub(super) fn blocks(pair: &Pair) -> Vec<FigureBlock> {
    looked(pair.job, pair.condition).iter().filter_map(|looked| block(pair, looked)).collect()
}

/// A window of one side, taken apart.
struct Taken {
    analysis: Analysis,
    components: Vec<Named>,
}

fn block(pair: &Pair, looked: &Looked) -> Option<FigureBlock> {
    let band = looked.band?;
    let measured = pair.measured_side().and_then(|side| taken(pair, &side, band));
    let model = taken(pair, &pair.model_side(), band).map(|model| audible(model, measured.as_ref()));
    let met = looked.frequencies(pair.result);
    let top_hz = top_hz(band, [measured.as_ref(), model.as_ref()]);
    let figure = spectra::figure(&spectra(pair, looked, [measured.as_ref(), model.as_ref()], &met, top_hz));
    let name = |aim: &&&crate::fit::job::Aim| matches!(aim.feature.reading, Reading::Frequency(_));
    let first = looked.aims.iter().find(name).or(looked.aims.first())?;
    let caption = caption(pair, looked, band, [measured.as_ref(), model.as_ref()], &met);
    Some(pair.block(&format!("spectrum-{}", file_word(&first.feature.name)), caption, figure))
}

fn taken(pair: &Pair, side: &Side, band: &Band) -> Option<Taken> {
    let samples = side.samples(band.channel);
    let record =
        Record { samples: samples.get(side.frames(&band.window)?)?, frame_rate_hz: side.recording.grid().frame_rate_hz, exposure_s: pair.exposure_s() };
    let analysis = Analysis::of(&record, &Settings { detrend: Some(band.detrend), ..Settings::default() }).ok()?;
    let components = analysis.spectrum.components.iter().filter(|c| c.is_resolvable()).map(|c| named(c, &analysis.spectrum)).collect();
    Some(Taken { analysis, components })
}

/// The model without the components that no recording could show: those under the noise floor of this one, and those of no account.
fn audible(mut model: Taken, measured: Option<&Taken>) -> Taken {
    let largest_m = model.components.iter().map(|c| c.amplitude_m).fold(0.0, f64::max);
    let least_m = measured.map_or(0.0, |m| m.analysis.spectrum.noise_floor_m).max(LEAST_OF_MODEL * largest_m);
    model.components.retain(|c| c.amplitude_m >= least_m);
    model
}

/// Highest frequency that is shown, Hz.
fn top_hz(band: &Band, sides: [Option<&Taken>; 2]) -> f64 {
    let components = sides.into_iter().flatten().flat_map(|taken| &taken.analysis.spectrum.components).map(|c| c.frequency_hz);
    components.fold(LEAST_TOP_HZ, f64::max).max(BEYOND_BAND * band.band_hz.1)
}

fn spectra(pair: &Pair, looked: &Looked, [measured, model]: [Option<&Taken>; 2], met: &[Met], top_hz: f64) -> Spectra {
    let shown = |taken: &Taken, of: &[f64]| {
        let bins = taken.analysis.spectrum.frequency_hz.partition_point(|f| *f <= top_hz);
        of.iter().take(bins).copied().collect::<Vec<f64>>()
    };
    let curve = |taken: &Taken| {
        let spectrum = &taken.analysis.spectrum;
        Curve { frequency_hz: shown(taken, &spectrum.frequency_hz), amplitude_m: shown(taken, &spectrum.amplitude_m), components_hz: Vec::new() }
    };
    let floor = measured.filter(|m| m.analysis.noise_floor_m.len() == m.analysis.spectrum.frequency_hz.len());
    let level = |m: &Taken| Level { frequency_hz: shown(m, &m.analysis.spectrum.frequency_hz), amplitude_m: shown(m, &m.analysis.noise_floor_m) };
    Spectra {
        title: format!("Spectrum of the {}", channel(looked.channel)),
        quantity: channel(looked.channel),
        note: format!("window {}", looked.window),
        synthetic: pair.synthetic(),
        measured: measured.map(curve),
        model: model.map(curve),
        targets: met.iter().map(|m| m.target.clone()).collect(),
        noise_floor_m: measured.map(|m| m.analysis.spectrum.noise_floor_m),
        noise_floor: floor.map(level),
        components: measured.map_or_else(Vec::new, |m| m.components.clone()),
        model_components: model.map_or_else(Vec::new, |m| m.components.clone()),
        lowest_hz: measured.or(model).map_or(1.0, |t| t.analysis.spectrum.resolution_hz),
        ..Spectra::default()
    }
}

fn caption(pair: &Pair, looked: &Looked, band: &Band, [measured, model]: [Option<&Taken>; 2], met: &[Met]) -> String {
    let both = if measured.is_some() { format!("{} and the fitted model, read alike", pair.source()) } else { pair.source() };
    let mut said =
        vec![format!("Amplitude spectrum of the {} in the window {} ({} removed, Hann window): {both}.", channel(looked.channel), looked.window, band.detrend)];
    let kind = if pair.recording().is_some() { "target" } else { "published" };
    said.extend(met.iter().map(|met| of_target(met, kind)));
    for (of, taken) in [("recording", measured), ("model", model)] {
        let Some(taken) = taken.filter(|t| !t.components.is_empty()) else { continue };
        let names: Vec<String> = taken.components.iter().map(Named::name).collect();
        said.push(format!("Components of the {of} (standard deviation in units of the last digit), the largest first: {}.", names.join("; ")));
    }
    if let Some(m) = measured {
        let floor = length(m.analysis.spectrum.noise_floor_m);
        said.push(format!(
            "The noise floor of the recording is {floor} in a bin of the window; the model is drawn without noise, its components above that floor."
        ));
    }
    said.join(" ")
}

/// "high: target 907.7 ± 4.0 Hz, model 908.0 Hz (+0.04 %)."
fn of_target(met: &Met, kind: &str) -> String {
    let target = &met.target;
    let sd = target.frequency_sd_hz.map_or_else(String::new, |sd| format!(" \u{b1} {}", digits(sd, 2)));
    let model = met
        .model_hz
        .map_or_else(|| "the model shows none".to_owned(), |hz| format!("model {} Hz ({} %)", digits(hz, 4), signed(100.0 * (hz / target.frequency_hz - 1.0))));
    format!("{}: {kind} {}{sd} Hz, {model}.", target.name, digits(target.frequency_hz, 4))
}
