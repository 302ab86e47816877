//! `wiperlab spectrum`.

mod tables;

use super::args::parse_count;
use super::files::{figure_files, write_outputs};
use super::load::{LoadedRecording, load_recording};
use super::prelude::*;
use crate::figures::analysis::{AnalysedWindow, compare_spectra};
use crate::figures::spectrum::{self, SpectraPlot};
use crate::recording::Recording;
use crate::recording::channel::{Channel, ReversalInstants, Window};
use crate::recording::cycles::{CountedCycle, NoCycle};
use crate::recording::files::RecordingFile;
use crate::recording::quality::{Optics, QualityFinding, find_frequency_faults};
use crate::simulate::twin::film::{DropoutPattern, film_like_recording};
use plain_charts::Figure;
use short_spectra::{Detrend, FASTEST_HZ, MAX_COMPONENTS, SpectralAnalysis, SpectrumSettings};
use std::collections::BTreeSet;
use std::ops::Range;

/// File names of the tables.
const TABLES: [&str; 4] = ["components.json", "spectrum.json", "spectrum.csv", "ridge.csv"];
/// Value of the option `--detrend` with which the trend is chosen from the record.
const AUTO: &str = "auto";
/// Seed of the tracking noise that is added when a simulated trace is filmed.
const FILM_SEED: u64 = 0;

#[derive(Debug, Args)]
pub(crate) struct SpectrumArgs {
    /// Folder of a recording, or a single trace.csv
    #[arg(value_name = "RECORDING")]
    pub recording: PathBuf,
    /// Quantity: deflection, head-drop, tip-x or head-x
    #[arg(long, default_value = "deflection", value_name = "CHANNEL")]
    pub channel: String,
    /// Window: before, stick, flip or after (`after[2]`), seconds (`0.10..0.25`), or relative to found
    /// instants (`release+0.02..release[2]-0.1`); default: all
    #[arg(long, default_value = "..", value_name = "A..B", allow_hyphen_values = true)]
    pub window: String,
    /// Trend to be removed first: auto, none, mean, line, cubic, polynomial:N or high-pass:HZ
    #[arg(long, default_value = AUTO, value_name = "TREND")]
    pub detrend: String,
    /// Band in which components are sought, Hz; default: all
    #[arg(long, value_name = "LO..HI", allow_hyphen_values = true)]
    pub band: Option<String>,
    /// Maximum number of components listed
    #[arg(long, default_value_t = MAX_COMPONENTS, value_name = "N", value_parser = parse_count,
        allow_negative_numbers = true)]
    pub max_components: usize,
    /// Exposure of a frame, s (default: that in recording.toml)
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub exposure_s: Option<f64>,
    /// Fastest oscillation that the blade may show, Hz; faster oscillations that fold onto a component are
    /// sought up to this frequency
    #[arg(long, default_value_t = FASTEST_HZ, value_name = "HZ", allow_negative_numbers = true)]
    pub fastest_hz: f64,
    /// A recording: the trace is first filmed with its rate, exposure, noise and lost frames, and both are
    /// then analysed in the same way
    #[arg(long, value_name = "RECORDING")]
    pub like: Option<PathBuf>,
    /// Folder for components.json, spectrum.json, the tables and the figures
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    #[command(flatten)]
    pub overwrite: Overwrite,
}

/// The command line after its checks.
struct SpectrumRequest {
    channel: Channel,
    window: Window,
    settings: SpectrumSettings,
}

/// An analysed window of a recording.
struct StudiedWindow {
    recording: Recording,
    exposure_s: Option<f64>,
    frames: Range<usize>,
    analysis: SpectralAnalysis,
    cycle: Result<CountedCycle, NoCycle>,
    /// The analysed frames and what was removed from them, as text.
    note: String,
    /// Serious findings on the clock or the positions, which put every component in doubt.
    faults: Vec<QualityFinding>,
    /// Advice on a better window, if the analysed window contains a whole flip of the blade.
    hint: Option<String>,
    /// Largest number of components in the list.
    most_components: usize,
}

impl SpectrumArgs {
    /// The arguments of the command, with default options.
    pub(crate) fn new(
        recording: &Path,
        channel: &str,
        window: &str,
        out: &Path,
        overwrite: Overwrite,
    ) -> Self {
        Self {
            recording: recording.to_owned(),
            channel: channel.to_owned(),
            window: window.to_owned(),
            detrend: AUTO.to_owned(),
            band: None,
            max_components: MAX_COMPONENTS,
            exposure_s: None,
            fastest_hz: FASTEST_HZ,
            like: None,
            out: out.to_owned(),
            overwrite,
        }
    }

    /// The files that the command would write, for a recording in memory and its description.
    pub(crate) fn output_files(
        &self,
        recording: Recording,
        file: Option<&RecordingFile>,
    ) -> Outcome<Vec<(String, Vec<u8>)>> {
        let request = self.parse_request()?;
        let exposure_s = self.given_exposure_s()?;
        request.output_files(&request.study_recording(exposure_s, recording, file)?)
    }

    pub(crate) fn run(&self, global: &GlobalArgs) -> Outcome {
        let request = self.parse_request()?;
        OutputFolder::check(&self.out, &self.write_policy(global), &TABLES)?;
        let steps = progress::start_steps("spectrum", global.quiet);
        steps.show_step("reading the recording");
        let loaded = load_recording(&self.recording)?;
        steps.show_step("analysing the window");
        let Some(like) = &self.like else {
            let studied = {
                let exposure_s = self.exposure_for(&loaded)?;
                request.study_recording(exposure_s, loaded.recording, loaded.file.as_ref())?
            };
            let outputs = request.output_files(&studied)?;
            drop(steps);
            return self.write_and_print(global, &request, &outputs, &[&studied]);
        };
        let model = load_recording(like)?;
        let exposure_s = self.exposure_for(&model)?;
        let blur_s = exposure_s.unwrap_or(0.0);
        let place = format!("{} like {}", self.recording.display(), like.display());
        let filmed = film_like_recording(&loaded.recording, &model.recording, blur_s, FILM_SEED)
            .map_err(|error| Failure::at(place, error))?;
        let mut simulated = request.study_recording(exposure_s, filmed.recording, None)?;
        let same = filmed.dropouts == DropoutPattern::SameFrames;
        let (frames, name) = (if same { "the same" } else { "as many" }, model.recording.name());
        let seen = format!("; seen as in {name}: its rate, exposure and noise, {frames} frames lost");
        simulated.note.push_str(&seen);
        let measured = request.study_recording(exposure_s, model.recording, model.file.as_ref())?;
        let mut outputs = request.output_files(&simulated)?;
        outputs.push(("components-like.json".to_owned(), tables::components_json(&measured)?));
        outputs.extend(figure_files("comparison", &request.comparison_figure(&simulated, &measured)));
        drop(steps);
        self.write_and_print(global, &request, &outputs, &[&simulated, &measured])
    }

    fn write_and_print(
        &self,
        global: &GlobalArgs,
        request: &SpectrumRequest,
        outputs: &[(String, Vec<u8>)],
        studied: &[&StudiedWindow],
    ) -> Outcome {
        write_outputs(&self.out, &self.write_policy(global), outputs)?;
        if !global.quiet {
            studied.iter().for_each(|studied| tables::print_summary(request.channel, studied));
        }
        Ok(CommandOutcome::Done)
    }

    fn write_policy(&self, global: &GlobalArgs) -> WritePolicy {
        global.write_policy(OutputCommand::Spectrum, self.overwrite)
    }

    /// The exposure given on the command line, otherwise that of the recording.
    fn exposure_for(&self, loaded: &LoadedRecording) -> Outcome<Option<f64>> {
        Ok(self.given_exposure_s()?.or_else(|| loaded.exposure_s()))
    }

    fn given_exposure_s(&self) -> Outcome<Option<f64>> {
        match self.exposure_s {
            Some(found) if !(found.is_finite() && found > 0.0) => {
                let problem = format!("found {found}, expected a time in seconds above 0, like 0.0002");
                Err(Failure::at("--exposure-s", problem))
            }
            given => Ok(given),
        }
    }

    fn parse_request(&self) -> Outcome<SpectrumRequest> {
        let channel = Channel::parse(&self.channel).map_err(|e| Failure::at("--channel", e))?;
        let window = Window::parse(&self.window).map_err(|e| Failure::at("--window", e))?;
        let detrend = (self.detrend != AUTO).then(|| Detrend::parse(&self.detrend)).transpose();
        let detrend = detrend.map_err(|e| Failure::at("--detrend", format!("{e}, or `{AUTO}`")))?;
        let band_hz = self.band.as_deref().map(parse_band).transpose()?;
        let (max_components, fastest_hz) = (self.max_components, self.fastest_hz);
        if !(fastest_hz.is_finite() && fastest_hz > 0.0) {
            let problem = format!("found {fastest_hz}, expected a frequency in Hz above 0");
            return Err(Failure::at("--fastest-hz", problem));
        }
        let settings =
            SpectrumSettings { detrend, band_hz, max_components, fastest_hz, ..SpectrumSettings::default() };
        Ok(SpectrumRequest { channel, window, settings })
    }
}

impl SpectrumRequest {
    /// Analyses the window of a recording. `file` is the description of the recording, if it has one.
    fn study_recording(
        &self,
        exposure_s: Option<f64>,
        original: Recording,
        file: Option<&RecordingFile>,
    ) -> Outcome<StudiedWindow> {
        let recording = original.clone().move_to_grid();
        let instants = ReversalInstants::find_instants(&recording);
        let frames = self.window.resolve_frames(&recording, &instants).map_err(Failure::input)?;
        let grid = recording.grid();
        let samples = self.channel.samples(&recording);
        // (a window whose frames were found is inside the recording)
        let inside = samples.get(frames.clone()).unwrap_or_default();
        let refuse = |error| {
            Failure::Input(format!("{}, {} in `{}`: {error}", recording.name(), self.channel, self.window))
        };
        let mut analysis = recording.analyse_samples(inside, exposure_s, &self.settings).map_err(refuse)?;
        let hint = flip_hint(&instants, (grid.time_s(frames.start), grid.time_s(frames.end)));
        let frames = frames.start + analysis.skipped_frames..frames.end;
        let (from_s, to_s) = (grid.time_s(frames.start), grid.time_s(frames.end));
        let (stride, removed, count) = (analysis.stride, &analysis.removed, frames.len());
        let rate = grid.frame_rate_hz / stride as f64;
        let every = || format!(" (one of {stride} is tracked: {rate:.6} frames/s)");
        let kept = if stride == 1 { String::new() } else { every() };
        let faults = self.find_faults(&original, file, (from_s, to_s));
        let checks: BTreeSet<&str> = faults.iter().map(|fault| fault.check.name()).collect();
        for check in checks {
            let doubt = format!("the recording has the serious finding `{check}` in this window");
            analysis.spectrum.components.iter_mut().for_each(|c| c.add_doubt(doubt.clone()));
        }
        let uneven = recording.describe_resampling().map_or_else(String::new, |said| format!("; {said}"));
        let note = format!("{from_s:.4} s to {to_s:.4} s, {count} frames{kept}, {removed} removed{uneven}");
        let cycle = recording.count_cycles(frames.clone());
        let most_components = self.settings.max_components;
        Ok(StudiedWindow {
            recording,
            exposure_s,
            frames,
            analysis,
            cycle,
            note,
            faults,
            hint,
            most_components,
        })
    }

    /// Serious findings on the clock of a recording, or on positions of the channel between two times, s.
    fn find_faults(
        &self,
        recording: &Recording,
        file: Option<&RecordingFile>,
        (from_s, to_s): (f64, f64),
    ) -> Vec<QualityFinding> {
        let optics = file.map_or_else(Optics::default, |file| Optics::from(&file.camera));
        let import = file.and_then(|file| file.source.as_ref()).map_or(&[][..], |source| &source.findings);
        let frame = |time_s: f64| recording.frame_at_or_after(time_s).max(0.0) as usize;
        find_frequency_faults(recording, &optics, import, self.channel, &(frame(from_s)..frame(to_s)))
    }

    fn output_files(&self, studied: &StudiedWindow) -> Outcome<Vec<(String, Vec<u8>)>> {
        let shown = AnalysedWindow {
            recording: &studied.recording,
            channel: self.channel,
            frames: studied.frames.clone(),
            analysis: &studied.analysis,
            note: studied.note.clone(),
        };
        let mut outputs = vec![
            (TABLES[0].to_owned(), tables::components_json(studied)?),
            (TABLES[1].to_owned(), tables::description_json(self, studied)?),
            (TABLES[2].to_owned(), tables::spectrum_csv(&studied.analysis)),
            (TABLES[3].to_owned(), tables::ridge_csv(&shown.frequency_course())),
        ];
        outputs.extend(shown.figures().iter().flat_map(|(name, figure)| figure_files(name, figure)));
        Ok(outputs)
    }

    /// One figure with the spectra of the simulated and of the measured window.
    fn comparison_figure(&self, simulated: &StudiedWindow, measured: &StudiedWindow) -> Figure {
        let [model, recording] =
            [simulated, measured].map(|studied| (studied.recording.name(), &studied.note));
        let ((simulated_name, model), (name, recording)) = (model, recording);
        let shown = SpectraPlot {
            quantity: self.channel.to_string(),
            note: format!("spectra of {name} and {simulated_name}; model: {model}; recording: {recording}"),
            synthetic: measured.recording.is_synthetic(),
            ..compare_spectra(Some(&measured.analysis), Some(&simulated.analysis))
        };
        spectrum::draw_figure(&SpectraPlot { title: spectrum::strongest_claim(&shown), ..shown })
    }
}

/// Advice for a window that contains a whole flip of the blade: the flip hides oscillations that occur during
/// it.
fn flip_hint(instants: &ReversalInstants, (from_s, to_s): (f64, f64)) -> Option<String> {
    let mut flips = (1..).zip(&instants.reversals).filter_map(|(k, reversal)| Some((k, reversal.flip?)));
    let (k, flip) = flips.find(|(_, flip)| from_s < flip.start_s && flip.end_s < to_s)?;
    let after = if instants.reversals.len() > 1 { format!("after[{k}]") } else { "after".to_owned() };
    let (start_s, end_s) = (flip.start_s, flip.end_s);
    Some(format!(
        "the window contains the flip from {start_s:.4} s to {end_s:.4} s, which hides small oscillations; `--window {after}` begins after it"
    ))
}

fn parse_band(text: &str) -> Outcome<(f64, f64)> {
    let number = |text: &str| text.trim().parse().ok();
    let ends = text.split_once("..").and_then(|(low, high)| number(low).zip(number(high)));
    let ordered = ends.filter(|(low, high): &(f64, f64)| *low >= 0.0 && low < high && high.is_finite());
    ordered.ok_or_else(|| {
        Failure::Input(format!("--band: found `{text}`, expected two frequencies in Hz with `..` between them, the lower first, like `60..100`"))
    })
}
