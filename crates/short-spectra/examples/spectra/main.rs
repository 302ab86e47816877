//! How exact the spectra are: records of known components in noise, and the errors of what is read from them.
//!
//! `cargo run --release -p short-spectra --example spectra` prints the tables from 200 seeds a line, `--
//! 1000` from a thousand; `-- 200 hard` prints what is read from hard records, beside other methods, and `--
//! 200 hard noise` the lines of one group. A record is 0.15 s at 5,000 frames/s (750 frames) with 20 dB
//! unless the line says otherwise.
//!
//! `-- mixtures 2000` scores all methods on 2,000 random records. `-- mixtures 2000 1 wiperlab drift` scores
//! wiperlab alone, on those of the 2,000 records from seed 1 on that contain a drift. `list` at the end
//! prints the records on which it fails. `-- mixtures 1 57 dump` prints the samples of record 57.

mod counts;
mod hard;
mod mixture_scores;
mod mixtures;
mod rivals;
mod score;
mod signal;
mod table;

use score::{Errors, deviation, largest, mean, near, read, read_all, rms};
use short_spectra::{Component, ComponentVerdict, SampledRecord, SpectralAnalysis, SpectrumSettings};
use signal::{AMPLITUDE_M, FLIPS, Signal, Tone};
use std::hint::black_box;
use std::time::Instant;

/// Seeds of a line unless asked for otherwise.
const SEEDS: u64 = 200;
/// The range of the published stick-slip cycle, Hz.
const CHIRP_HZ: (f64, f64) = (359.0, 692.0);
/// The two published components, Hz.
const LOW_HZ: f64 = 78.4;
const HIGH_HZ: f64 = 900.0;
/// What a chirp's ends may be off by.
const RANGE_WITHIN: f64 = 0.02;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if arguments.first().is_some_and(|argument| argument == "mixtures") {
        return mixture_scores::print_scores(&arguments[1..]);
    }
    let seeds = std::env::args().nth(1).and_then(|n| n.parse().ok()).unwrap_or(SEEDS);
    println!("{seeds} seeds a line; 750 frames at 5,000 frames/s and 20 dB unless the line says otherwise.");
    if std::env::args().any(|argument| argument == "hard") {
        table::print(seeds, std::env::args().nth(3).as_deref(), &rivals::METHODS);
        return;
    }
    oscillations(seeds);
    cameras(seeds);
    chirps(seeds);
    noise_alone(seeds);
    timings();
}

/// Steady and decaying oscillations: errors next to the bound and to the stated deviations.
fn oscillations(seeds: u64) {
    println!("\n## Oscillations\n");
    println!(
        "Errors of the frequency in Hz, as multiples of the Cramér-Rao bound and in per cent; of the damping ratio in per cent of it; scaled: standard"
    );
    println!(
        "deviation of error over stated deviation. Flips are 100 times as high as the oscillation; ring-downs start at 30 dB.\n"
    );
    println!(
        "| {:<22} | {:<11} | Hz    | zeta | found | others | bias/CRB | rms/CRB | largest Hz | largest % | rms zeta % | frequency | amplitude | damping |",
        "signal", "flip"
    );
    println!(
        "|{}|{}|------:|-----:|------:|-------:|---------:|--------:|-----------:|----------:|-----------:|----------:|----------:|--------:|",
        "-".repeat(24),
        "-".repeat(13)
    );
    let both = [Tone::steady(LOW_HZ), Tone::steady(HIGH_HZ)];
    line("one tone", &Signal::of(&both[1..]), seeds);
    line("one tone", &Signal::of(&both[..1]), seeds);
    line("two tones", &Signal::of(&both), seeds);
    line("two, 40 % missing", &Signal { missing: 0.4, ..Signal::of(&both) }, seeds);
    for flip in FLIPS {
        for damping in [0.02, 0.05, 0.1] {
            line(
                "ring-down",
                &Signal { flip, snr_db: 30.0, ..Signal::of(&[Tone::ring_down(LOW_HZ, damping)]) },
                seeds,
            );
        }
    }
}

/// One row for each tone.
fn line(name: &str, signal: &Signal, seeds: u64) {
    let lists = read_all(signal, seeds);
    let others: usize = lists.iter().map(|list| list.len().saturating_sub(signal.tones.len())).sum();
    for tone in &signal.tones {
        let (e, bound_hz) = (Errors::of(tone, &lists), signal.bound_hz(tone));
        let damping = if tone.damping > 0.0 {
            format!("{:.2}", 100.0 * rms(&e.damping) / tone.ratio())
        } else {
            "-".to_owned()
        };
        println!(
            "| {name:<22} | {:<11} | {:>5.1} | {:>4.2} | {:>5} | {others:>6} | {:>8.3} | {:>7.3} | {:>10.4} | {:>9.3} | {damping:>10} | {:>9.3} | {:>9.3} | {:>7.3} |",
            signal.flip.name,
            tone.hz,
            tone.damping,
            e.hz.len(),
            mean(&e.hz) / bound_hz,
            rms(&e.hz) / bound_hz,
            largest(&e.hz),
            100.0 * largest(&e.hz) / tone.hz,
            deviation(&e.scaled[0]),
            deviation(&e.scaled[1]),
            deviation(&e.scaled[2]),
        );
    }
}

/// Verdicts on 900 Hz seen by cameras that fold or blur it.
fn cameras(seeds: u64) {
    println!("\n## Cameras: 900 Hz\n");
    println!(
        "| {:<8} | {:<8} | appears at | found | folded from 900 Hz | attenuated | passes | {:<40} |",
        "frames/s", "exposure", "verdict"
    );
    println!(
        "|---------:|---------:|-----------:|------:|-------------------:|-----------:|-------:|{}|",
        "-".repeat(42)
    );
    for (rate_hz, frames, exposure_s) in
        [(1000.0, 150, None), (1000.0, 150, Some(5e-4)), (5000.0, 750, Some(1e-3))]
    {
        let signal = Signal { rate_hz, frames, exposure_s, ..Signal::of(&[Tone::steady(HIGH_HZ)]) };
        let seen_hz = short_spectra::sampling::alias_hz(HIGH_HZ, rate_hz);
        let lists = read_all(&signal, seeds);
        let found: Vec<&Component> = lists.iter().filter_map(|list| near(list, seen_hz)).collect();
        let count = |holds: &dyn Fn(&Component) -> bool| found.iter().filter(|c| holds(c)).count();
        let folded = count(&|c| c.folded_from.iter().any(|fold| (fold.frequency_hz - HIGH_HZ).abs() < 1.0));
        let attenuated =
            count(&|c| c.reasons.iter().any(|reason| reason.verdict == ComponentVerdict::Attenuated));
        let of_900 =
            |c: &&Component| c.folded_from.first().map_or(c.exposure_passes, |fold| fold.exposure_passes);
        let passes =
            found.first().and_then(of_900).map_or_else(|| "-".to_owned(), |passes| format!("{passes:.3}"));
        let exposure = exposure_s.map_or_else(|| "-".to_owned(), |s| format!("{:.1} ms", s * 1e3));
        println!(
            "| {rate_hz:>8} | {exposure:>8} | {seen_hz:>7} Hz | {:>5} | {folded:>18} | {attenuated:>10} | {passes:>6} | {:<40} |",
            found.len(),
            verdicts(&found)
        );
    }
}

/// How often each verdict was given.
fn verdicts(found: &[&Component]) -> String {
    let mut counts = std::collections::BTreeMap::new();
    found.iter().for_each(|c| *counts.entry(c.verdict).or_insert(0) += 1);
    counts.iter().map(|(verdict, count)| format!("{} {count}", verdict.name())).collect::<Vec<_>>().join(", ")
}

/// A frequency that rises evenly, alone and on a ring-down twenty times as large.
fn chirps(seeds: u64) {
    println!("\n## A chirp of 359-692 Hz\n");
    println!(
        "Ends of the range against those of the chirp; others: components between 300 and 750 Hz next to it.\n"
    );
    println!(
        "| {:<8} | {:<20} | one component | both ends within 2 % | others | least, rms % | largest % | greatest, rms % | largest % |",
        "record", "next to it"
    );
    println!(
        "|---------:|{}|--------------:|---------------------:|-------:|-------------:|----------:|----------------:|----------:|",
        "-".repeat(22)
    );
    let ring_down = Tone { amplitude_m: 20.0 * AMPLITUDE_M, ..Tone::ring_down(LOW_HZ, 0.03) };
    for frames in [750, 1500] {
        for (companion, tones) in [("nothing", vec![]), ("78.4 Hz, 20 times", vec![ring_down])] {
            chirp(companion, &Signal { frames, chirp_hz: Some(CHIRP_HZ), ..Signal::of(&tones) }, seeds);
        }
    }
}

fn chirp(companion: &str, signal: &Signal, seeds: u64) {
    let lists = read_all(signal, seeds);
    let inside =
        |list: &[Component]| list.iter().filter(|c| (300.0..750.0).contains(&c.frequency_hz)).count();
    let ranges: Vec<_> = lists.iter().filter_map(|list| list.iter().find_map(|c| c.range_hz)).collect();
    let low: Vec<f64> = ranges.iter().map(|range| range.low_hz / CHIRP_HZ.0 - 1.0).collect();
    let high: Vec<f64> = ranges.iter().map(|range| range.high_hz / CHIRP_HZ.1 - 1.0).collect();
    let within = low.iter().zip(&high).filter(|(low, high)| low.abs().max(high.abs()) < RANGE_WITHIN).count();
    let others = lists.iter().map(|list| inside(list)).sum::<usize>() - ranges.len();
    let percent = [rms(&low), largest(&low), rms(&high), largest(&high)].map(|share| 100.0 * share);
    println!(
        "| {:>6.2} s | {companion:<20} | {:>13} | {within:>20} | {others:>6} | {:>12.2} | {:>9.2} | {:>15.2} | {:>9.2} |",
        signal.frames as f64 / signal.rate_hz,
        ranges.len(),
        percent[0],
        percent[1],
        percent[2],
        percent[3]
    );
}

/// Records in which there is nothing.
fn noise_alone(seeds: u64) {
    let empty = read_all(&Signal::default(), seeds).iter().filter(|list| list.is_empty()).count();
    println!("\n## Noise alone\n\nNothing is listed in {empty} of {seeds} records.");
}

/// Wall times on one thread for a reversal; a million samples take what threads there are.
fn timings() {
    /// Records of a line.
    const RECORDS: u64 = 41;
    println!(
        "\n## Time\n\n| {:<46} | median ms |\n|{}|----------:|",
        "complete analysis of 750 frames",
        "-".repeat(48)
    );
    let ring_down =
        Signal { snr_db: 30.0, ..Signal::of(&[Tone::ring_down(LOW_HZ, 0.05), Tone::steady(HIGH_HZ)]) };
    let print = |name: &str, signal: &Signal| {
        println!("| {name:<46} | {:>9.1} |", median_ms(RECORDS, |seed| black_box(read(signal, seed)).len()))
    };
    print("two tones", &Signal::of(&[Tone::steady(LOW_HZ), Tone::steady(HIGH_HZ)]));
    for flip in FLIPS {
        print(
            &format!("ring-down and 900 Hz on a flip, {}", flip.name),
            &Signal { flip, ..ring_down.clone() },
        );
    }
    print("chirp and ring-down", &Signal { chirp_hz: Some(CHIRP_HZ), ..Signal::of(&ring_down.tones[..1]) });
    let long = Signal { frames: 1_000_000, ..Signal::of(&[Tone::steady(LOW_HZ), Tone::steady(HIGH_HZ)]) };
    let samples = long.record(0);
    let analysis = |_| {
        let record =
            SampledRecord { samples: black_box(&samples), frame_rate_hz: long.rate_hz, exposure_s: None };
        SpectralAnalysis::from_record(&record, &SpectrumSettings::default())
            .map_or(0, |analysis| analysis.spectrum.components.len())
    };
    println!("\nA million samples: complete analysis in {:.0} ms (median of 5).", median_ms(5, analysis));
}

fn median_ms(count: u64, run: impl Fn(u64) -> usize) -> f64 {
    let time_ms = |seed| {
        let started = Instant::now();
        black_box(run(seed));
        started.elapsed().as_secs_f64() * 1e3
    };
    let mut times: Vec<f64> = (0..count).map(time_ms).collect();
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}
