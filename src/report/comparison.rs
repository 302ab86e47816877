//! A fit as a report: what was measured beside what the fitted model shows through the same camera.

use super::history::{self, History, Motion};
use super::spectra::{self, Curve, Spectra, Target};
use super::{Comparison, Fact, FigureBlock, ParameterLine, RecordingLine, Report};
use crate::blade::parameters;
use crate::fit::features::{Band, Reading};
use crate::fit::job::{Aim, Job};
use crate::fit::objective::RunFailure;
use crate::fit::result::FitResult;
use crate::fit::scene_model::SceneModel;
use crate::recording::Recording;
use crate::recording::channel::{Anchor, Channel, Instants};
use crate::recording::files::RecordingFile;
use crate::recording::quality::quality;
use crate::simulate::Run;
use crate::spectrum::{self, Settings, Spectrum, Verdict};
use crate::twin::View;

/// A recording that was fitted, with its description where it has one.
#[derive(Debug, Clone, Copy)]
pub struct Measured<'a> {
    /// The traces.
    pub recording: &'a Recording,
    /// `recording.toml`.
    pub file: Option<&'a RecordingFile>,
}

/// The model at the estimates, seen through each camera of the job.
///
/// # Errors
/// [`RunFailure`] when nothing could be seen.
pub fn best_views(job: &Job, model: &SceneModel, result: &FitResult) -> Result<Vec<View>, RunFailure> {
    let values: Vec<f64> = job.parameters.iter().filter_map(|p| result.parameters.get(&p.name)).map(|p| p.estimate).collect();
    (0..job.conditions.len()).map(|condition| model.look(&values, condition)).collect()
}

/// The report of a fit, but for its provenance.
#[must_use]
pub fn report(job: &Job, measured: &[Measured], views: &[View], result: &FitResult) -> Report {
    Report {
        title: job.title.clone(),
        status: result.status.word().to_owned(),
        ending: ending(result),
        recordings: measured.iter().map(recording_line).collect(),
        components: components(result),
        features: features(result),
        parameters: parameter_lines(job, measured, result),
        best_run: views.first().map(|seen| best_run(&seen.run)).unwrap_or_default(),
        figures: figures(job, measured, views),
        notes: notes(measured, result),
        ..Report::default()
    }
}

fn ending(result: &FitResult) -> String {
    let failed: Vec<String> = result.evaluations.failed.iter().map(|(reason, count)| format!("{count} {reason}")).collect();
    let failed = if failed.is_empty() { "none failed".to_owned() } else { format!("failed: {}", failed.join(", ")) };
    format!("{} evaluations of the model, {failed}.", result.evaluations.total)
}

fn recording_line(measured: &Measured) -> RecordingLine {
    let recording = measured.recording;
    let quality = quality(recording, measured.file.and_then(|f| f.camera.exposure_s));
    RecordingLine {
        name: recording.name().to_owned(),
        synthetic: recording.is_synthetic(),
        frames: quality.frames,
        frame_rate_hz: quality.frame_rate_hz,
        missing: quality.missing_deflection_frames as f64 / quality.frames.max(1) as f64,
        noise_m: quality.head_x.noise_m,
    }
}

fn components(result: &FitResult) -> Vec<Comparison> {
    let line = |c: &crate::fit::result::ComponentResult| Comparison {
        name: c.name.clone(),
        unit: "Hz".to_owned(),
        target: c.target_hz,
        target_sd: Some(c.target_sd_hz),
        model: c.model_hz,
        relative_error: c.relative_error,
        pass: c.pass,
    };
    result.components.iter().map(line).collect()
}

fn features(result: &FitResult) -> Vec<Comparison> {
    let line = |f: &crate::fit::result::FeatureResult| Comparison {
        name: f.name.clone(),
        unit: f.unit.clone(),
        target: f.target,
        target_sd: Some(f.target_sd),
        model: f.model,
        relative_error: f.relative_error,
        pass: f.pass,
    };
    result.features.iter().map(line).collect()
}

/// The parameters in job order, beside the truth where one twin alone was fitted.
fn parameter_lines(job: &Job, measured: &[Measured], result: &FitResult) -> Vec<ParameterLine> {
    let twin = match measured {
        [one] => one.file.and_then(|f| f.twin.as_ref()),
        _ => None,
    };
    let truth = twin.and_then(|t| t.get("truth")).and_then(toml::Value::as_table);
    let line = |name: &String| {
        let estimate = result.parameters.get(name)?;
        let row = parameters::find(name);
        Some(ParameterLine {
            name: name.clone(),
            symbol: row.map_or_else(String::new, |p| p.symbol.to_owned()),
            unit: row.map(|p| p.unit).filter(|unit| *unit != "1").unwrap_or_default().to_owned(),
            estimate: estimate.estimate,
            lower_95: estimate.lower_95,
            upper_95: estimate.upper_95,
            verdict: estimate.verdict.word().to_owned(),
            truth: truth.and_then(|t| t.get(name)).and_then(toml::Value::as_float),
        })
    };
    job.parameter_names().iter().filter_map(line).collect()
}

fn best_run(run: &Run) -> Vec<Fact> {
    let fact = |name: &str, value: String| Fact { name: name.to_owned(), value };
    vec![
        fact("status", format!("{}: {}", run.status.name(), run.status.meaning())),
        fact("stopped at", format!("{} s", run.stopped_at_s)),
        fact("transitions between stick and slip", run.transitions.to_string()),
    ]
}

fn notes(measured: &[Measured], result: &FitResult) -> Vec<String> {
    let mut notes = result.notes.clone();
    let combination = |c: &crate::fit::information::Combination| match c.determined {
        true => format!("the features determine {} (standard deviation {:.2} %)", c.in_words(), 100.0 * c.sd_relative),
        false => format!("the features leave {} open", c.in_words()),
    };
    notes.extend(result.combinations.iter().map(combination));
    notes.extend(result.gate.advice.iter().cloned());
    notes.push("every other number of the scene is taken as exact: the intervals know nothing of its error".to_owned());
    if measured.is_empty() {
        notes.push("Only published values were fitted: there is no recording, and the traces shown are the model's alone.".to_owned());
    }
    notes
}

fn band_of(aim: &Aim) -> Option<&Band> {
    match &aim.feature.reading {
        Reading::Frequency(band) => Some(band),
        _ => None,
    }
}

fn figures(job: &Job, measured: &[Measured], views: &[View]) -> Vec<FigureBlock> {
    let mut figures = Vec::new();
    for (i, seen) in views.iter().enumerate() {
        let number = if views.len() > 1 { format!("-{}", i + 1) } else { String::new() };
        let recording = measured.get(i).map(|m| m.recording);
        figures.push(history_figure(job, recording, seen, &number));
        for aim in job.aims.iter().filter(|aim| aim.feature.condition == i) {
            figures.extend(band_of(aim).map(|band| spectrum_figure(job, aim, band, recording, seen, &number)));
        }
    }
    figures
}

/// The model's clock on the recording's: both show the same turn of the head.
fn shift_s(recording: Option<&Recording>, model: &Recording) -> f64 {
    let turn = |recording: &Recording| Instants::find(recording).time_s(Anchor::Reversal, 1).ok();
    recording.and_then(turn).zip(turn(model)).map_or(0.0, |(measured, model)| measured - model)
}

/// How long before and after the tip's release the enlarged part lasts, s: a few cycles of the high component.
const ZOOM_S: (f64, f64) = (0.005, 0.03);

fn history_figure(job: &Job, recording: Option<&Recording>, seen: &View, number: &str) -> FigureBlock {
    let shift = shift_s(recording, &seen.recording);
    let instants = Instants::find(recording.unwrap_or(&seen.recording));
    let named: Vec<(String, f64)> = [Anchor::Hold, Anchor::Reversal, Anchor::Release]
        .iter()
        .filter_map(|anchor| instants.time_s(*anchor, 1).ok().map(|t| (anchor.name().to_owned(), t)))
        .collect();
    let zoom_s = instants.time_s(Anchor::Release, 1).ok().map(|t| (t - ZOOM_S.0, t + ZOOM_S.1));
    let svg = history::figure(&History {
        title: job.title.clone(),
        synthetic: recording.is_some_and(Recording::is_synthetic),
        measured: recording.map(|r| motion(r, 0.0)),
        model: Some(motion(&seen.recording, shift)),
        stick_s: seen.stick_s.iter().map(|[from, to]| (from + shift, to + shift)).collect(),
        instants: named,
        zoom_s,
    });
    let caption = match recording {
        Some(r) => format!(
            "Tip, head, deflection (tip minus head) and head drop over time: {} against the fitted model, the clocks aligned at the turn of the head. \
             Shaded: the model's tip sticks. Below: the release of the tip enlarged.",
            if r.is_synthetic() { format!("the synthetic recording {}", r.name()) } else { format!("the recording {}", r.name()) }
        ),
        None => "Tip, head, deflection (tip minus head) and head drop of the fitted model over time. Shaded: its tip sticks. Below: the release enlarged."
            .to_owned(),
    };
    FigureBlock { file: format!("history{number}.svg"), caption, svg }
}

fn motion(recording: &Recording, shift_s: f64) -> Motion {
    let grid = recording.grid();
    Motion {
        time_s: (0..grid.frames).map(|i| grid.time_s(i) + shift_s).collect(),
        tip_x_m: Channel::TipX.samples(recording),
        head_x_m: Channel::HeadX.samples(recording),
        deflection_m: Channel::Deflection.samples(recording),
        head_drop_m: Channel::HeadDrop.samples(recording),
    }
}

fn spectrum_figure(job: &Job, aim: &Aim, band: &Band, recording: Option<&Recording>, seen: &View, number: &str) -> FigureBlock {
    let measured = recording.and_then(|r| analysed(band, r));
    let model = analysed(band, &seen.recording);
    let name = &aim.feature.name;
    let target = match (&aim.source, &measured) {
        (crate::fit::job::Source::Given { target, sd }, _) => Some((*target, Some(*sd))),
        (_, Some(spectrum)) => spectrum.component_in_band(band.band_hz.0, band.band_hz.1).map(|c| (c.frequency_hz, Some(c.frequency_sd_hz))),
        _ => None,
    };
    let lowest_hz = measured.as_ref().or(model.as_ref()).map_or(1.0, |s| s.resolution_hz);
    let svg = spectra::figure(&Spectra {
        title: format!("{}: {name} component", job.title),
        quantity: band.channel.to_string(),
        note: format!("window {}", band.window),
        synthetic: recording.is_some_and(Recording::is_synthetic),
        noise_floor_m: measured.as_ref().map(|s| s.noise_floor_m),
        measured: measured.as_ref().map(curve),
        model: model.as_ref().map(curve),
        targets: target.map(|(frequency_hz, frequency_sd_hz)| Target { name: name.clone(), frequency_hz, frequency_sd_hz }).into_iter().collect(),
        lowest_hz,
        ..Spectra::default()
    });
    let (low, high) = band.band_hz;
    let caption = format!(
        "Amplitude spectrum of the {} in the window {} ({} removed, Hann window), with the {name} component sought between {low} and {high} Hz.",
        band.channel, band.window, band.detrend
    );
    FigureBlock { file: format!("spectrum-{}{number}.svg", file_word(name)), caption, svg }
}

/// A name from a job as part of a file name: letters and digits, everything else a hyphen.
fn file_word(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' }).collect()
}

fn analysed(band: &Band, recording: &Recording) -> Option<Spectrum> {
    let frames = band.window.resolve(recording, &Instants::find(recording)).ok()?;
    let samples = band.channel.samples(recording);
    spectrum::analyse(samples.get(frames)?, recording.grid().frame_rate_hz, &Settings { detrend: Some(band.detrend), ..Settings::default() }).ok()
}

fn curve(spectrum: &Spectrum) -> Curve {
    let marked = spectrum.components.iter().filter(|c| c.verdict != Verdict::NotResolvable);
    Curve { frequency_hz: spectrum.frequency_hz.clone(), amplitude_m: spectrum.amplitude_m.clone(), components_hz: marked.map(|c| c.frequency_hz).collect() }
}
