//! `wiperlab spectrum`.

use crate::args::Global;
use crate::failure::{Failure, Outcome};
use crate::files::write_all;
use crate::load::load_recording;
use clap::Args;
use rayon::prelude::*;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use wiperlab::recording::Recording;
use wiperlab::recording::channel::{Channel, Instants, Window};
use wiperlab::report::spectra::{Curve, Spectra, figure};
use wiperlab::spectrum::{Component, Detrend, MAX_COMPONENTS, Settings, Spectrum, Verdict, analyse};

#[derive(Debug, Args)]
pub struct SpectrumArgs {
    /// A recording's folder, or a trace.csv alone
    #[arg(value_name = "RECORDING")]
    pub recording: PathBuf,
    /// Quantity: deflection, head-drop, tip-x or head-x
    #[arg(long, default_value = "deflection", value_name = "CHANNEL")]
    pub channel: String,
    /// Window in seconds (`0.10..0.25`) or from found instants (`release+0.02..release[2]-0.1`); default: all
    #[arg(long, default_value = "..", value_name = "A..B", allow_hyphen_values = true)]
    pub window: String,
    /// What is removed first: none, mean, line or cubic
    #[arg(long, default_value = "cubic", value_name = "TREND")]
    pub detrend: String,
    /// Band in which components are sought, Hz; default: all
    #[arg(long, value_name = "LO..HI", allow_hyphen_values = true)]
    pub band: Option<String>,
    /// Most components listed
    #[arg(long, default_value_t = MAX_COMPONENTS, value_name = "N")]
    pub max_components: usize,
    /// Folder for components.json, spectrum.csv and spectrum.svg
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
}

/// The command line once checked.
struct Request {
    channel: Channel,
    window: Window,
    settings: Settings,
}

impl SpectrumArgs {
    /// The command with its defaults.
    pub fn new(recording: &Path, channel: &str, window: &str, out: &Path) -> Self {
        Self {
            recording: recording.to_owned(),
            channel: channel.to_owned(),
            window: window.to_owned(),
            detrend: Detrend::default().to_string(),
            band: None,
            max_components: MAX_COMPONENTS,
            out: out.to_owned(),
        }
    }

    pub fn run(&self, global: &Global) -> Result<Outcome, Failure> {
        let request = self.request()?;
        let recording = load_recording(&self.recording)?.recording;
        let frames = request.window.resolve(&recording, &Instants::find(&recording)).map_err(Failure::input)?;
        let grid = recording.grid();
        let samples = request.channel.samples(&recording);
        let refuse = |error| Failure::Input(format!("{}, {} in `{}`: {error}", recording.name(), request.channel, request.window));
        let inside = samples.get(frames.clone()).unwrap_or_default(); // a resolved window lies inside
        let spectrum = analyse(inside, grid.frame_rate_hz, &request.settings).map_err(refuse)?;
        let note = format!(
            "{:.4} s to {:.4} s, {} frames, {} removed",
            grid.time_s(frames.start),
            grid.time_s(frames.end),
            frames.len(),
            trend(request.settings.detrend.unwrap_or_default())
        );
        let outputs = [
            ("components.json", components_json(&spectrum.components)?),
            ("spectrum.csv", spectrum_csv(&spectrum).into_bytes()),
            ("spectrum.svg", figure(&drawing(&recording, request.channel, &note, &spectrum)).into_bytes()),
        ];
        write_all(&self.out, &outputs)?;
        if !global.quiet {
            summary(&recording, request.channel, &note, &spectrum);
        }
        Ok(Outcome::Done)
    }

    fn request(&self) -> Result<Request, Failure> {
        let named = |option: &str, error: &dyn std::fmt::Display| Failure::Input(format!("{option}: {error}"));
        let channel = Channel::parse(&self.channel).map_err(|e| named("--channel", &e))?;
        let window = Window::parse(&self.window).map_err(|e| named("--window", &e))?;
        let detrend = Detrend::parse(&self.detrend).map_err(|e| named("--detrend", &e))?;
        let band_hz = self.band.as_deref().map(band).transpose()?;
        if self.max_components == 0 {
            return Err(Failure::Input("--max-components: found 0, expected 1 or more".to_owned()));
        }
        Ok(Request { channel, window, settings: Settings { detrend: Some(detrend), band_hz, max_components: self.max_components, ..Settings::default() } })
    }
}

fn band(text: &str) -> Result<(f64, f64), Failure> {
    let ends = text.split_once("..").and_then(|(low, high)| Some((low.trim().parse().ok()?, high.trim().parse().ok()?)));
    let ordered = ends.filter(|(low, high): &(f64, f64)| *low >= 0.0 && low < high && high.is_finite());
    ordered.ok_or_else(|| {
        Failure::Input(format!("--band: found `{text}`, expected two frequencies in Hz with `..` between them, the lower first, like `60..100`"))
    })
}

fn trend(detrend: Detrend) -> String {
    if detrend == Detrend::None { "nothing".to_owned() } else { detrend.to_string() }
}

fn components_json(components: &[Component]) -> Result<Vec<u8>, Failure> {
    let mut bytes = serde_json::to_vec_pretty(components).map_err(Failure::internal)?;
    bytes.push(b'\n');
    Ok(bytes)
}

/// Rows of text that are made at a time; of a long record many such blocks are made in parallel.
const BLOCK_ROWS: usize = 4096;

fn spectrum_csv(spectrum: &Spectrum) -> String {
    let block = |(frequency_hz, amplitude_m): (&[f64], &[f64])| {
        let mut text = String::new();
        for (f, a) in frequency_hz.iter().zip(amplitude_m) {
            let _ = writeln!(text, "{f},{a:e}"); // writing to a String cannot fail
        }
        text
    };
    let blocks = spectrum.frequency_hz.par_chunks(BLOCK_ROWS).zip(spectrum.amplitude_m.par_chunks(BLOCK_ROWS));
    let blocks: Vec<String> = blocks.map(block).collect();
    std::iter::once("frequency_hz,amplitude_m\n".to_owned()).chain(blocks).collect()
}

fn drawing(recording: &Recording, channel: Channel, note: &str, spectrum: &Spectrum) -> Spectra {
    let resolved = spectrum.components.iter().filter(|c| c.verdict != Verdict::NotResolvable);
    Spectra {
        title: format!("{}: spectrum of {channel}", recording.name()),
        quantity: channel.to_string(),
        note: note.to_owned(),
        synthetic: recording.is_synthetic(),
        measured: Some(Curve {
            components_hz: resolved.map(|c| c.frequency_hz).collect(),
            frequency_hz: spectrum.frequency_hz.clone(),
            amplitude_m: spectrum.amplitude_m.clone(),
        }),
        noise_floor_m: Some(spectrum.noise_floor_m),
        lowest_hz: spectrum.resolution_hz,
        ..Spectra::default()
    }
}

fn summary(recording: &Recording, channel: Channel, note: &str, spectrum: &Spectrum) {
    let synthetic = if recording.is_synthetic() { " (synthetic: no camera took it)" } else { "" };
    print_line!("{}{synthetic}: {channel}, {note}", recording.name());
    let missing = 100.0 * (1.0 - spectrum.present);
    print_line!("resolution {:.2} Hz, noise floor {:.4} um, {missing:.1} % of the frames missing", spectrum.resolution_hz, spectrum.noise_floor_m * 1e6);
    if spectrum.components.is_empty() {
        print_line!("no component stands out of the noise");
        return;
    }
    print_line!("{:>14} {:>10} {:>14} {:>10} {:>8}  verdict", "frequency, Hz", "sd, Hz", "amplitude, um", "sd, um", "SNR, dB");
    for c in &spectrum.components {
        let (amplitude, sd) = (c.amplitude_m * 1e6, c.amplitude_sd_m * 1e6);
        print_line!("{:>14.3} {:>10.3} {amplitude:>14.4} {sd:>10.4} {:>8.1}  {}", c.frequency_hz, c.frequency_sd_hz, c.snr_db, c.verdict.word());
    }
}
