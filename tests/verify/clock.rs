//! Recordings whose frames lie on no grid, and frame rates that are not exact.

use portable_math::StandardNormal;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde_json::Value;
use std::f64::consts::TAU;
use wiperlab::cli::read::{SpectrumOptions, spectrum_files};
use wiperlab::feature::{FeatureBand, FeatureReader, Reading};
use wiperlab::recording::channel::{Channel, ReversalInstants, Window};
use wiperlab::recording::files::{CameraEntry, FrameClock, HEADER, RecordingFile, read_recording, trace_csv};
use wiperlab::recording::quality::*;
use wiperlab::recording::{FrameGrid, Recording, Traces};

const RATE_HZ: f64 = 48.4;
const TONE_HZ: f64 = 7.3;
const NOISE_M: f64 = 5e-6;
const FRAMES: usize = 500;

/// Frame times, s, of a camera at about 48.4 frames/s that lie on no uniform grid: four kinds, each with its
/// name.
fn uneven_clocks(seed: u64, frames: usize) -> [(&'static str, Vec<f64>); 4] {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut normal = || random.sample::<f64, _>(StandardNormal);
    let jitter: Vec<f64> = (0..frames).map(|i| (i as f64 + 0.1 * normal()) / RATE_HZ).collect();
    let steps = |step_s: &mut dyn FnMut(usize) -> f64| -> Vec<f64> {
        let mut time_s = 0.25;
        let mut next = |i| {
            time_s += step_s(i);
            time_s
        };
        (0..frames).map(&mut next).collect()
    };
    let mut walk = Xoshiro256PlusPlus::seed_from_u64(seed + 1000);
    let mut lost = Xoshiro256PlusPlus::seed_from_u64(seed + 2000);
    let kept = (0..frames).map(|i| i == 0 || i + 1 == frames || lost.random::<f64>() > 0.06);
    [
        ("random walk", steps(&mut |_| (walk.random_range(199..=213) as f64) * 1e-4)),
        ("two rates", steps(&mut |i| if i < frames / 2 { 1.0 / 57.0 } else { 1.0 / 41.0 })),
        ("dropped frames", jitter.iter().zip(kept).filter(|(_, kept)| *kept).map(|(t, _)| *t).collect()),
        ("white jitter", jitter),
    ]
}

/// Traces whose deflection is `at_m` at the given times, with white noise of standard deviation `noise_m`.
fn deflected(times_s: &[f64], at_m: impl Fn(f64) -> f64, noise_m: f64, seed: u64) -> Traces {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let tip = times_s.iter().map(|t| Some(at_m(*t) + noise_m * random.sample::<f64, _>(StandardNormal)));
    let still = |y: f64| vec![Some(y); times_s.len()];
    let tip_x_m = tip.collect();
    Traces { tip_x_m, tip_y_m: still(-5e-3), head_x_m: still(0.0), head_y_m: still(0.0), ..Traces::default() }
}

fn tone(times_s: &[f64], seed: u64) -> Recording {
    let traces = deflected(times_s, |t| 5e-4 * (TAU * TONE_HZ * t + 0.4).cos(), NOISE_M, seed);
    Recording::from_times("tone", times_s.to_vec(), traces, true).unwrap()
}

fn spectrum(recording: Recording, window: &str) -> [Value; 2] {
    let options = SpectrumOptions {
        channel: "deflection".to_owned(),
        window: window.to_owned(),
        detrend: "auto".to_owned(),
        band_hz: None,
        max_components: None,
        exposure_s: None,
    };
    let files = spectrum_files(recording, None, &options).unwrap();
    let [mut components, description] = ["components.json", "spectrum.json"].map(|name| {
        let (_, bytes) = files.iter().find(|(found, _)| found == name).unwrap();
        serde_json::from_slice::<Value>(bytes).unwrap()
    });
    [components["components"].take(), description]
}

fn number(of: &Value, key: &str) -> f64 {
    of[key].as_f64().unwrap()
}

#[test]
fn a_steady_tone_is_steady_at_its_frequency_on_every_clock() {
    let (mut within, mut records, mut false_components) = ([0; 2], 0, 0);
    for seed in 0..10 {
        for (clock, times_s) in uneven_clocks(seed, FRAMES) {
            let [components, description] = spectrum(tone(&times_s, seed), "..");
            let all = components.as_array().unwrap();
            let first = &all[0];
            let (hz, sd_hz) = (number(first, "frequency_hz"), number(first, "frequency_sd_hz"));
            let off = (hz - TONE_HZ).abs() / sd_hz;
            let height_m = number(first, "amplitude_m");
            let row = format!("{clock} {seed}: {hz} +- {sd_hz} Hz, {height_m} m, {} components", all.len());
            println!("{row}");
            assert!(first["range_hz"].is_null() && sd_hz < 2e-4, "{row}");
            assert!((height_m / 5e-4 - 1.0).abs() < 0.01, "{row}");
            for other in &all[1..] {
                println!("false: {other}");
                false_components += 1;
            }
            records += 1;
            within = [within[0] + usize::from(off < 1.0), within[1] + usize::from(off < 2.0)];
            assert!(description["note"].as_str().unwrap().contains("interpolated"), "{description}");
        }
    }
    println!("{within:?} of {records}, {false_components} false");
    assert!(records == 40 && within[0] >= 20 && within[1] >= 34, "{within:?} of {records}");
    assert!(false_components <= 2, "{false_components} false components in {records} records");
}

/// Interpolation through six frames reproduces a polynomial of degree five in time exactly, however the
/// frames are spaced.
#[test]
fn a_polynomial_comes_onto_the_grid_exactly_and_gaps_stay_missing() {
    let quintic = |t: f64| 1e-3 * (1.0 + 0.3 * t - 0.02 * t * t + 1e-5 * t.powi(5));
    for (clock, times_s) in uneven_clocks(3, FRAMES) {
        let traces = deflected(&times_s, quintic, 0.0, 1);
        let recording = Recording::from_times("quintic", times_s.clone(), traces, true).unwrap();
        let resampled = recording.resample_to_grid();
        let grid = resampled.grid();
        assert_eq!((grid.start_s, resampled.frame_times_s()), (times_s[0], None));
        let is_long = |i: usize| times_s[i] - times_s[i - 1] > 1.4 / RATE_HZ;
        let (mut missing, mut exact) = (0, 0);
        for (frame, x) in resampled.traces().tip_x_m.iter().enumerate() {
            let t = grid.time_s(frame);
            let after = times_s.partition_point(|s| *s < t).clamp(1, times_s.len() - 1);
            let Some(x) = x else {
                missing += 1;
                assert!(is_long(after), "{clock}: {t} lies in no gap");
                continue;
            };
            // the value is exact if six consecutive frames around the time have no gap
            let stencils = after.saturating_sub(5)..=(after - 1).min(times_s.len() - 6);
            if stencils.into_iter().any(|first| !(first + 1..first + 6).any(is_long)) {
                exact += 1;
                assert!((x / quintic(t) - 1.0).abs() < 1e-11, "{clock}, {t}: {x}");
            }
        }
        let lost = FRAMES - times_s.len();
        println!("{clock}: {lost} lost, {missing} missing, {exact} exact");
        assert!(missing >= lost && missing <= 2 * lost + lost / 2, "{clock}: {missing} missing, {lost} lost");
        assert!(exact + 4 * lost >= FRAMES - 10, "{clock}: {exact}");
    }
}

#[test]
fn windows_in_seconds_select_by_true_times() {
    for (clock, times_s) in uneven_clocks(5, FRAMES) {
        let recording = tone(&times_s, 5);
        let instants = ReversalInstants::find_instants(&recording);
        for (from_s, to_s) in [(2.0, 3.5), (4.21, 9.07), (times_s[40], times_s[77])] {
            let window = Window::parse(&format!("{from_s}..{to_s}")).unwrap();
            let frames = window.resolve_frames(&recording, &instants).unwrap();
            let inside: Vec<usize> =
                (0..times_s.len()).filter(|i| times_s[*i] >= from_s && times_s[*i] < to_s).collect();
            assert_eq!(frames.collect::<Vec<_>>(), inside, "{clock}, {from_s}..{to_s}");
        }
        assert_eq!(Window::WHOLE.resolve_frames(&recording, &instants).unwrap(), 0..times_s.len(), "{clock}");
        let last_s = times_s[times_s.len() - 1];
        for outside in [format!("{}..", times_s[0] - 0.1), format!("..{}", last_s + 0.1)] {
            let refused = Window::parse(&outside).unwrap().resolve_frames(&recording, &instants);
            let message = refused.unwrap_err().to_string();
            assert!(message.contains(&format!("to {last_s:.6} s; choose a window inside it")), "{message}");
        }
    }
}

fn camera(recording: &Recording, clock: Option<FrameClock>) -> CameraEntry {
    CameraEntry {
        frame_rate_hz: recording.grid().frame_rate_hz,
        frame_rate_sd_hz: recording.frame_rate_sd_hz(),
        clock,
        exposure_s: None,
        metres_per_pixel: None,
        y_axis: None,
    }
}

fn described(camera: CameraEntry) -> RecordingFile {
    let camera = toml::to_string(&camera).unwrap();
    RecordingFile::parse("recording.toml", &format!("format = 1\nsynthetic = true\n[camera]\n{camera}"))
        .unwrap()
}

#[test]
fn files_keep_every_time_and_the_rate_with_its_deviation() {
    for (clock, times_s) in uneven_clocks(8, FRAMES) {
        let recording = tone(&times_s, 8).with_frame_rate_sd(Some(0.031)).unwrap();
        let text = trace_csv(&recording);
        let file = described(camera(&recording, Some(FrameClock::Times)));
        assert!(file.to_toml().unwrap().contains("frame_rate_sd_hz = 0.031\nclock = \"times\""), "{clock}");
        let again = read_recording("tone", "trace.csv", &text, Some(&file)).unwrap();
        assert_eq!(again, recording, "{clock}");
        assert_eq!(again.frame_times_s(), Some(&times_s[..]), "{clock}");
        if ["random walk", "two rates"].contains(&clock) {
            // no uniform grid is within 0.3 frames of all these times: without a description they are kept,
            // with a stated frame rate they are refused
            let alone = read_recording("tone", "trace.csv", &text, None).unwrap();
            assert_eq!(alone.frame_times_s(), Some(&times_s[..]), "{clock}");
            let file = described(camera(&recording, None));
            let refused = read_recording("tone", "trace.csv", &text, Some(&file)).unwrap_err().to_string();
            assert!(refused.contains("off the grid"), "{clock}: {refused}");
        }
    }
}

#[test]
fn a_recording_on_a_grid_is_written_and_read_as_before() {
    let grid = FrameGrid { start_s: 0.25, frame_rate_hz: RATE_HZ, frames: 40 };
    let times_s: Vec<f64> = (0..40).map(|i| grid.time_s(i)).collect();
    let traces = deflected(&times_s, |t| 1e-3 * t, 0.0, 1);
    let recording = Recording::new("even", grid, traces, true).unwrap();
    let file = described(camera(&recording, None));
    let toml = file.to_toml().unwrap();
    assert!(!toml.contains("clock") && !toml.contains("sd_hz"), "{toml}");
    for file in [None, Some(&file)] {
        let again = read_recording("even", "trace.csv", &trace_csv(&recording), file).unwrap();
        assert_eq!((again.grid(), again.frame_times_s()), (grid, None));
    }
    assert!(matches!(recording.resample_to_grid(), std::borrow::Cow::Borrowed(_)));
}

#[test]
fn times_that_do_not_advance_and_rates_that_are_not_theirs_are_refused() {
    let rows = |times: &[f64]| {
        let rows: String = times.iter().map(|t| format!("{t},1,1,1,1\n")).collect();
        format!("{HEADER}\n{rows}")
    };
    let mut times_s = uneven_clocks(2, FRAMES)[0].1.clone();
    let recording = tone(&times_s, 2);
    let file = |frame_rate_hz| {
        let camera = CameraEntry { frame_rate_hz, ..camera(&recording, Some(FrameClock::Times)) };
        read_recording("r", "trace.csv", &rows(&times_s), Some(&described(camera)))
    };
    let mean_hz = recording.grid().frame_rate_hz;
    assert!(file(mean_hz).is_ok() && file((mean_hz * 1e5).round() / 1e5).is_ok());
    let message = file(50.0).unwrap_err().to_string();
    assert!(message.contains(&format!("found a mean rate of {mean_hz} frames/s")), "{message}");
    times_s[70] = times_s[69];
    let message = read_recording("r", "trace.csv", &rows(&times_s), None).unwrap_err().to_string();
    assert!(message.starts_with("trace.csv:72: column time_s: found"), "{message}");
    let message =
        Recording::from_times("r", times_s.clone(), Traces::default(), true).unwrap_err().to_string();
    assert!(message.starts_with("time_s, frame 70: found"), "{message}");
    // a jump of years in the times is refused before memory is allocated for it
    times_s.truncate(70);
    times_s.push(1e9);
    assert!(
        Recording::from_times("r", times_s, Traces::default(), true)
            .unwrap_err()
            .to_string()
            .contains("mean steps, expected one continuous")
    );
    assert!(tone(&uneven_clocks(2, FRAMES)[0].1, 2).with_frame_rate_sd(Some(-1.0)).is_err());
}

#[test]
fn the_deviation_of_the_rate_is_part_of_that_of_every_frequency() {
    let grid = FrameGrid { start_s: 0.0, frame_rate_hz: RATE_HZ, frames: FRAMES };
    let times_s: Vec<f64> = (0..FRAMES).map(|i| grid.time_s(i)).collect();
    let traces = deflected(&times_s, |t| 5e-4 * (TAU * TONE_HZ * t).cos(), NOISE_M, 4);
    let exact = Recording::new("tone", grid, traces, true).unwrap();
    let relative = 2e-3;
    let inexact = exact.clone().with_frame_rate_sd(Some(relative * RATE_HZ)).unwrap();
    let wider = |sd_hz: f64, hz: f64| (sd_hz * sd_hz + hz * hz * relative * relative).sqrt();
    let [[with, _], [without, _]] = [&inexact, &exact].map(|r| spectrum(r.clone(), ".."));
    assert!(!without.as_array().unwrap().is_empty());
    for (with, without) in with.as_array().unwrap().iter().zip(without.as_array().unwrap()) {
        let expected = wider(number(without, "frequency_sd_hz"), number(without, "frequency_hz"));
        assert!((number(with, "frequency_sd_hz") / expected - 1.0).abs() < 1e-12, "{with}");
        assert_eq!(with["frequency_hz"], without["frequency_hz"]);
    }
    let band = FeatureBand {
        channel: Channel::Deflection,
        window: Window::WHOLE,
        band_hz: (3.0, 15.0),
        detrend: short_spectra::Detrend::Mean,
        least_amplitude_m: 0.0,
    };
    let read = |recording: &Recording| {
        let instants = ReversalInstants::find_instants(recording);
        Reading::Frequency(band.clone()).read(None, &FeatureReader::new(recording, &instants)).unwrap()
    };
    let (with, without) = (read(&inexact), read(&exact));
    assert_eq!(with.value, without.value);
    assert!((with.sd.unwrap() / wider(without.sd.unwrap(), with.value) - 1.0).abs() < 1e-12);
}

#[test]
fn an_uneven_clock_is_a_finding_and_raises_no_other() {
    let clocks = (0..10).flat_map(|seed| uneven_clocks(seed, FRAMES).map(|clock| (seed, clock)));
    let long = (10..13).flat_map(|seed| uneven_clocks(seed, 3000).map(|clock| (seed, clock)));
    let mut recordings = 0;
    for (seed, (clock, times_s)) in clocks.chain(long) {
        let recording = tone(&times_s, seed);
        let measured = measure_quality(&recording, None);
        let instants = ReversalInstants::find_instants(&recording);
        let found = collect_findings(&recording, &measured, &Optics::default(), &instants, &[]);
        let lines: Vec<String> =
            // (48 frames/s are few for a blade)
            found
                .iter()
                .filter(|f| f.severity > Severity::Note && f.check.name() != "frame-rate")
                .map(QualityFinding::to_line)
                .collect();
        println!("{clock} {seed}: {lines:?} noise {:?}", measured.tip_x.noise_m);
        recordings += 1;
        let [line] = &lines[..] else { panic!("{clock} {seed}: {lines:?}") };
        assert!(line.starts_with("caution: the times of the frames lie up to"), "{line}");
    }
    assert_eq!(recordings, 52);
}
