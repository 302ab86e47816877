//! Tables and printed summary of `wiperlab spectrum`.

use super::{SpectrumRequest, StudiedWindow};
use crate::cli::failure::{Failure, Outcome};
use crate::figures::analysis::CoursePoint;
use crate::recording::channel::{Channel, ReversalInstants, phase_windows};
use crate::recording::cycles::{CountedCycle, NoCycle};
use crate::recording::quality::QualityFinding;
use crate::text::{format_digits, format_milliseconds, format_percent, format_with_sd, pluralise, to_ascii};
use rayon::prelude::*;
use serde::Serialize;
use short_spectra::time_frequency::FrequencyRange;
use short_spectra::{Component, ComponentVerdict, SpectralAnalysis, Spectrum};
use std::fmt::Write;

/// Number of rows in a block of text; the blocks of a long record are made in parallel.
const BLOCK_ROWS: usize = 4096;

/// Contents of `components.json`; the start of a component is given on the clock of the recording.
pub(crate) fn components_json(studied: &StudiedWindow) -> Outcome<Vec<u8>> {
    let from_s = studied.recording.grid().time_s(studied.frames.start);
    let timed = |c: &Component| Component { begins_s: c.begins_s.map(|s| from_s + s), ..c.clone() };
    let components: Vec<Component> = studied.analysis.spectrum.components.iter().map(timed).collect();
    let cycles = match &studied.cycle {
        Ok(cycle) => serde_json::to_value(cycle).map_err(Failure::internal)?,
        Err(reason) => serde_json::json!({ "count": 0, "reason": reason.to_string() }),
    };
    to_json(&serde_json::json!({ "components": components, "cycles": cycles }))
}

fn to_json(value: &impl Serialize) -> Outcome<Vec<u8>> {
    let mut bytes = serde_json::to_vec_pretty(value).map_err(Failure::internal)?;
    bytes.push(b'\n');
    Ok(bytes)
}

/// Contents of `spectrum.json`: the analysed data, and the settings of the analysis.
#[derive(Serialize)]
struct SpectrumDescription<'a> {
    recording: &'a str,
    synthetic: bool,
    channel: &'static str,
    window: String,
    from_s: f64,
    to_s: f64,
    frames: usize,
    missing_frames: usize,
    frame_rate_hz: f64,
    exposure_s: Option<f64>,
    detrend: String,
    relaxations: usize,
    steps: usize,
    resolution_hz: f64,
    noise_floor_m: f64,
    fastest_hz: f64,
    windows: Vec<NamedWindowSpan>,
    /// Frequency range of the ridge, whether or not the ridge is listed as a drifting component.
    ridge_hz: Option<FrequencyRange>,
    note: &'a str,
    /// Serious findings on the recording, which put every component in doubt.
    findings: &'a [QualityFinding],
    hint: Option<&'a str>,
}

#[derive(Serialize)]
struct NamedWindowSpan {
    name: String,
    from_s: f64,
    to_s: f64,
}

pub(crate) fn description_json(request: &SpectrumRequest, studied: &StudiedWindow) -> Outcome<Vec<u8>> {
    let StudiedWindow { recording, analysis, frames, .. } = studied;
    let grid = recording.grid();
    let windows = phase_windows(recording, &ReversalInstants::find_instants(recording));
    to_json(&SpectrumDescription {
        recording: recording.name(),
        synthetic: recording.is_synthetic(),
        channel: request.channel.name(),
        window: request.window.to_string(),
        from_s: grid.time_s(frames.start),
        to_s: grid.time_s(frames.end),
        frames: frames.len(),
        missing_frames: analysis.residual_m.iter().filter(|x| x.is_none()).count(),
        frame_rate_hz: grid.frame_rate_hz,
        exposure_s: studied.exposure_s,
        detrend: analysis.removed.detrend.to_string(),
        relaxations: analysis.removed.relaxations,
        steps: analysis.removed.steps,
        resolution_hz: analysis.spectrum.resolution_hz,
        noise_floor_m: analysis.spectrum.noise_floor_m,
        fastest_hz: request.settings.fastest_hz,
        windows: windows
            .into_iter()
            .map(|w| NamedWindowSpan { name: w.name, from_s: w.from_s, to_s: w.to_s })
            .collect(),
        ridge_hz: analysis
            .ridge
            .as_ref()
            .and_then(|ridge| ridge.range_hz())
            .map(|range| recording.widen_range(range)),
        note: &studied.note,
        findings: &studied.faults,
        hint: studied.hint.as_deref(),
    })
}

/// Contents of `spectrum.csv`, with one row per frequency bin. A cell is empty if the analysis does not
/// compute the value, for example for a long record or a record with gaps.
pub(crate) fn spectrum_csv(analysis: &SpectralAnalysis) -> Vec<u8> {
    let spectrum = &analysis.spectrum;
    let cell = |text: &mut String, value: Option<f64>| match value {
        Some(value) => write!(text, ",{value:e}"),
        None => write!(text, ","),
    };
    let block = |(block, frequency_hz): (usize, &[f64])| {
        let mut text = String::new();
        for (i, f) in frequency_hz.iter().enumerate() {
            let bin = block * BLOCK_ROWS + i;
            let tapers = analysis.multitaper.as_ref();
            let interval = tapers.and_then(|m| m.interval_95(bin));
            let values = [
                spectrum.amplitude_m.get(bin).copied(),
                analysis.noise_floor_m.get(bin).copied(),
                analysis.leakage_m.get(bin).copied(),
                tapers.and_then(|m| m.density_m2_per_hz.get(bin).copied()),
                interval.map(|ends| ends.0),
                interval.map(|ends| ends.1),
                tapers.and_then(|m| m.line_probability(bin)),
            ];
            let _ = write!(text, "{f}"); // writing to a String cannot fail
            values.into_iter().for_each(|value| cell(&mut text, value).unwrap_or_default());
            text.push('\n');
        }
        text
    };
    let blocks: Vec<String> = spectrum.frequency_hz.par_chunks(BLOCK_ROWS).enumerate().map(block).collect();
    let header = "frequency_hz,amplitude_m,noise_floor_m,leakage_m,density_m2_per_hz,\
                  density_lower_95_m2_per_hz,density_upper_95_m2_per_hz,line_probability\n";
    std::iter::once(header.to_owned()).chain(blocks).collect::<String>().into_bytes()
}

/// Contents of `ridge.csv`: the strongest component at frequencies above those of the slow components, as a
/// function of time.
pub(crate) fn ridge_csv(course: &[CoursePoint]) -> Vec<u8> {
    let speed = |speed: Option<f64>| speed.map_or_else(String::new, |speed| format!("{speed:e}"));
    let row = |p: &CoursePoint| {
        let speeds = [p.tip_speed_m_per_s, p.head_speed_m_per_s].map(speed);
        let CoursePoint { time_s, frequency_hz, frequency_sd_hz, amplitude_m, .. } = p;
        format!("{time_s},{frequency_hz},{frequency_sd_hz},{amplitude_m:e},{}\n", speeds.join(","))
    };
    let header = "time_s,frequency_hz,frequency_sd_hz,amplitude_m,tip_speed_m_per_s,head_speed_m_per_s\n";
    std::iter::once(header.to_owned()).chain(course.iter().map(row)).collect::<String>().into_bytes()
}

/// Prints the components to standard output.
pub(crate) fn print_summary(channel: Channel, studied: &StudiedWindow) {
    let (recording, spectrum) = (&studied.recording, &studied.analysis.spectrum);
    let synthetic = if recording.is_synthetic() { " (synthetic: no camera took it)" } else { "" };
    print_line!("{}{synthetic}: {channel}, {}", recording.name(), studied.note);
    let from_s = recording.grid().time_s(studied.frames.start);
    let missing = 100.0 * (1.0 - spectrum.present);
    let (resolution_hz, floor_um) = (spectrum.resolution_hz, spectrum.noise_floor_m * 1e6);
    print_line!(
        "resolution {resolution_hz:.2} Hz, noise floor {floor_um:.4} um, {missing:.1} % of the frames missing"
    );
    let analysis = &studied.analysis;
    let used = analysis.residual_m.iter().flatten().count();
    let analysed = analysis.residual_m.len().div_ceil(analysis.stride);
    let tracked = (spectrum.present * analysed as f64).round() as usize;
    if let left_out @ 1.. = tracked.saturating_sub(used) {
        let frames = pluralise("frame", left_out);
        print_line!("{left_out} {frames} left out: mis-tracked, or within a jump");
    }
    studied.faults.iter().for_each(|fault| print_line!("{}", fault.to_line()));
    studied.hint.iter().for_each(|hint| print_line!("{hint}"));
    print_components(from_s, spectrum);
    if spectrum.components.len() >= studied.most_components {
        print_line!("the list is full; a larger --max-components may show more lines");
    }
    print_cycle(&studied.cycle);
}

/// Prints the cycle that is counted in the path of the tip.
fn print_cycle(cycle: &Result<CountedCycle, NoCycle>) {
    let cycle = match cycle {
        Ok(cycle) => cycle,
        Err(reason) => return print_line!("no stick-slip cycle is counted: {reason}"),
    };
    let rate = ascii_with_sd(cycle.rate_hz, cycle.rate_sd_hz);
    let period = ascii_with_sd(cycle.period_s * 1e3, cycle.period_sd_s * 1e3);
    let [scatter, sizes] = [cycle.period_scatter, cycle.size_scatter].map(format_percent);
    print_line!("stick-slip cycle, counted: {} slips of the tip, {rate} 1/s", cycle.count);
    print_line!("{:>18} period {period} ms, scatter of a period {scatter}", "");
    print_line!("{:>18} slips of {} um, scatter {sizes}", "", format_digits(cycle.size_m * 1e6, 3));
    if cycle.dropped_beats > 0 {
        print_line!("{:>18} {} dropped {}", "", cycle.dropped_beats, pluralise("beat", cycle.dropped_beats));
    }
    if let Some(times) = &cycle.times {
        let [stick, slip] = [times.stick_s, times.slip_s].map(format_milliseconds);
        print_line!("{:>18} a stick takes {stick}, a slip {slip} (medians)", "");
    }
    cycle.remarks.iter().for_each(|remark| print_line!("{:>18} {remark}", ""));
}

fn print_components(from_s: f64, spectrum: &Spectrum) {
    if spectrum.components.is_empty() {
        print_line!("no component stands out of the noise");
        return;
    }
    print_line!("     frequency, Hz    amplitude, um    damping ratio  SNR, dB  verdict");
    for c in &spectrum.components {
        let damping = c.damping_ratio.zip(c.damping_ratio_sd);
        let damping = damping.map_or_else(|| "-".to_owned(), |(ratio, sd)| ascii_with_sd(ratio, sd));
        let frequency = ascii_with_sd(c.frequency_hz, c.frequency_sd_hz);
        let amplitude = ascii_with_sd(c.amplitude_m * 1e6, c.amplitude_sd_m * 1e6);
        print_line!("{frequency:>18} {amplitude:>16} {damping:>16} {:>8.1}  {}", c.snr_db, c.verdict.name());
        if let Some(begins_s) = c.begins_s {
            print_line!("{:>18} begins at {:.4} s", "", from_s + begins_s);
        }
        if let Some(range) = &c.range_hz {
            let low = ascii_with_sd(range.low_hz, range.low_sd_hz);
            let high = ascii_with_sd(range.high_hz, range.high_sd_hz);
            print_line!("{:>18} drifts from {low} to {high} Hz", "");
        }
        for reason in &c.reasons {
            print_line!("{:>18} {}: {}", "", reason.verdict.name(), reason.words);
        }
        let is_resolvable = c.verdict != ComponentVerdict::NotResolvable;
        if let Some(leakage_m) = c.leakage_m.filter(|leakage_m| is_resolvable && *leakage_m > c.amplitude_m) {
            print_line!("{:>18} the flip, not removed, would show {:.3} um here", "", leakage_m * 1e6);
        }
    }
}

fn ascii_with_sd(value: f64, sd: f64) -> String {
    to_ascii(&format_with_sd(value, sd))
}
