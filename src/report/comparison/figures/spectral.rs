//! Amplitude spectra, one for each window of a channel that the fit looks at, and the one of the low
//! component taken apart.

use super::aims::{Looked, Met, looked};
use super::file_word;
use super::pair::{Pair, Side};
use super::ring_downs;
use crate::feature::{Band, Reading};
use crate::report::FigureBlock;
use crate::report::analysis::compared;
use crate::report::figure::spectrum::{self, Named, Spectra};
use crate::spectrum::{Analysis, Record, Settings};
use crate::text::{digits, length, signed_percent, with_sd};

/// Frequencies are shown up to this many times the band that the fit looks at, and to this one, Hz, at least:
/// what a fast camera has beyond is noise.
const BEYOND_BAND: f64 = 10.0;
const LEAST_TOP_HZ: f64 = 5e3;

/// The spectra in the order of the job, then the ring-down. Every window is analysed once; one after the
/// other, because long ones are large.
pub(super) fn blocks(pair: &Pair) -> Vec<FigureBlock> {
    let all = looked(pair.job, pair.condition);
    let lowest = ring_downs::lowest(pair, &all);
    let (mut spectra, mut ring_down) = (Vec::new(), None);
    for (i, looked) in all.iter().enumerate() {
        let Some(band) = looked.band else { continue };
        let measured = pair.measured_side().and_then(|side| taken(pair, &side, band));
        let model = taken(pair, &pair.model_side(), band);
        if let Some((_, target_hz)) = lowest.filter(|(of, _)| *of == i) {
            let shown = if pair.recording().is_some() { &measured } else { &model };
            ring_down =
                shown.as_ref().and_then(|analysis| ring_downs::block(pair, looked, analysis, target_hz));
        }
        spectra.extend(block(pair, looked, band, measured.as_ref(), model.as_ref()));
    }
    spectra.into_iter().chain(ring_down).collect()
}

fn block(
    pair: &Pair,
    looked: &Looked,
    band: &Band,
    measured: Option<&Analysis>,
    model: Option<&Analysis>,
) -> Option<FigureBlock> {
    let met = looked.frequencies(pair.result);
    let spectra = Spectra {
        title: format!("Spectrum of the {}", looked.channel.label()),
        quantity: looked.channel.label(),
        note: format!("window {}", looked.window),
        synthetic: pair.synthetic(),
        targets: met.iter().map(|m| m.target.clone()).collect(),
        ..shown(compared(measured, model), band)
    };
    let name = |aim: &&&crate::fit::job::Aim| matches!(aim.feature.reading, Reading::Frequency(_));
    let first = looked.aims.iter().find(name).or(looked.aims.first())?;
    let caption = caption(pair, looked, band, &spectra, &met);
    Some(pair.block(
        &format!("spectrum-{}", file_word(&first.feature.name)),
        caption,
        spectrum::figure(&spectra),
    ))
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
fn taken(pair: &Pair, side: &Side, band: &Band) -> Option<Analysis> {
    let samples = side.samples(band.channel);
    let record = Record {
        samples: samples.get(side.frames(&band.window)?)?,
        frame_rate_hz: side.recording.grid().frame_rate_hz,
        exposure_s: pair.exposure_s(),
    };
    Analysis::of(&record, &Settings { detrend: Some(band.detrend), ..Settings::default() }).ok()
}

fn caption(pair: &Pair, looked: &Looked, band: &Band, spectra: &Spectra, met: &[Met]) -> String {
    let both = if spectra.measured.is_some() {
        format!("{} and the fitted model, read alike", pair.source())
    } else {
        pair.source()
    };
    let mut said = vec![format!(
        "Amplitude spectrum of the {} in the window {} ({} removed, Hann window): {both}.",
        looked.channel.label(),
        looked.window,
        band.detrend
    )];
    let kind = if pair.recording().is_some() { "target" } else { "published" };
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
            "The noise floor of the recording is {floor} in a bin of the window; the model is drawn without noise, its components above that floor."
        ));
    }
    said.join(" ")
}

/// "high: target 908(4) Hz, model 908.0 Hz (+0.04 %)."
fn of_target(met: &Met, kind: &str) -> String {
    let target = &met.target;
    let model = met.model_hz.map_or_else(
        || "the model shows none".to_owned(),
        |hz| format!("model {} Hz ({})", digits(hz, 4), signed_percent(hz / target.frequency_hz - 1.0)),
    );
    format!("{}: {kind} {} Hz, {model}.", target.name, with_sd(target.frequency_hz, target.frequency_sd_hz))
}
