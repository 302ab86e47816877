//! Random records that mix oscillations, trends, flips, faults of the camera and kinds of noise.
//!
//! One half of the records has at most two complications (several oscillations, oscillations that are neither
//! steady nor ring-downs from the start, a trend, a flip, a fault, noise that is not white). One quarter has
//! no oscillation.

use crate::hard::Draw;
use crate::rivals::fourier;
use crate::score::mean;
use nalgebra::{DMatrix, DVector};
use short_spectra::sampling::alias_hz;
use std::f64::consts::{PI, TAU};

/// Standard deviation of the noise without the shake of a camera, m.
const NOISE_M: f64 = 1e-6;
/// Largest number of multiples of a comb: a further one would have at most a seventh of the height of the
/// first.
const MULTIPLES: usize = 6;

/// A random record and what it holds.
pub struct Mixture {
    pub samples: Vec<Option<f64>>,
    pub rate_hz: f64,
    pub oscillations: Vec<Oscillation>,
    /// Length, trend, flip, fault and noise of the record, each as `family: kind`.
    pub families: Vec<String>,
}

/// An oscillation of a record.
#[derive(Default)]
pub struct Oscillation {
    pub kind: &'static str,
    /// Mean square in the window over the noise within two resolutions, dB: `ms / (S 2 / T)` with the
    /// one-sided density `S` around the oscillation.
    pub snr_db: f64,
    /// Cramér-Rao bound of the mean frequency, Hz; `None` for a comb with jitter, whose frequency no model of
    /// a few parameters describes.
    pub bound_hz: Option<f64>,
    /// Whether it has fewer than three cycles, or is within one resolution of another oscillation.
    pub apart: bool,
    /// Phase at each frame, cycles. The frequency between two frames is the difference times the frame rate.
    cycles: Vec<f64>,
    /// Amplitude of the first multiple at each frame, m; zero before the onset.
    envelope_m: Vec<f64>,
    /// Amplitudes of the multiples of a comb relative to that of the first; `[1.0]` for other kinds.
    multiples: Vec<f64>,
    /// Standard deviation of a period of a comb, relative to the mean period.
    jitter: f64,
    /// Frequency of an amplitude modulation, Hz.
    modulation_hz: Option<f64>,
    /// First frame after the onset.
    onset: usize,
    rate_hz: f64,
}

impl Oscillation {
    /// Mean frequency from a time or the onset, whichever is later, Hz.
    pub fn mean_hz(&self, from_s: f64) -> f64 {
        let last = self.cycles.len() - 1;
        let first = self.onset.max((from_s * self.rate_hz) as usize).min(last - 1);
        (self.cycles[last] - self.cycles[first]) * self.rate_hz / (last - first) as f64
    }

    /// Lowest and highest frequency, Hz. Jitter does not count as drift.
    pub fn range_hz(&self) -> (f64, f64) {
        if self.kind != "drift" {
            return (self.mean_hz(0.0), self.mean_hz(0.0));
        }
        let hz = |first: usize| (self.cycles[first + 1] - self.cycles[first]) * self.rate_hz;
        let ends = (hz(0), hz(self.cycles.len() - 2));
        (ends.0.min(ends.1), ends.0.max(ends.1))
    }

    /// Full width at half maximum of the line of a multiple of a comb with jitter, Hz. Each period adds an
    /// independent error with the standard deviation `2 pi h j` to the phase of multiple `h`, which gives a
    /// Lorentz line of the width `2 pi h^2 j^2 f`.
    pub fn width_hz(&self, multiple: usize) -> f64 {
        TAU * (multiple as f64 * self.jitter).powi(2) * self.mean_hz(0.0)
    }

    /// Frequencies of the lines that belong to the oscillation, Hz, and their widths, Hz: multiples and
    /// sidebands.
    pub fn parts_hz(&self, from_s: f64) -> Vec<(f64, f64)> {
        let hz = self.mean_hz(from_s);
        let sidebands = self.modulation_hz.map(|modulation| [(hz - modulation, 0.0), (hz + modulation, 0.0)]);
        let multiples = (2..=self.multiples.len()).map(|h| (h as f64 * hz, self.width_hz(h)));
        multiples.chain(sidebands.into_iter().flatten()).collect()
    }

    /// Displacement (`quarter` 0) or its derivative with respect to the phase (`quarter` 0.25), m.
    fn displacement_m(&self, frame: usize, quarter: f64) -> f64 {
        let term = |(k, height): (usize, &f64)| {
            let multiple = (k + 1) as f64;
            let slope = if quarter > 0.0 { multiple } else { 1.0 };
            slope * height * (TAU * (multiple * self.cycles[frame] + quarter)).sin()
        };
        self.envelope_m[frame] * self.multiples.iter().enumerate().map(term).sum::<f64>()
    }
}

impl Draw {
    fn chance(&mut self, probability: f64) -> bool {
        self.within(0.0, 1.0) < probability
    }

    /// A number between `low` and `high` with an evenly distributed logarithm.
    fn ratio(&mut self, low: f64, high: f64) -> f64 {
        self.within(low.ln(), high.ln()).exp()
    }

    fn choose<T: Copy>(&mut self, list: &[T]) -> T {
        list[(self.within(0.0, list.len() as f64) as usize).min(list.len() - 1)]
    }
}

/// Length and rate of a record, and the frames that show the motion.
struct Window {
    frames: usize,
    rate_hz: f64,
    /// Highest frequency of an oscillation, Hz: nine tenths of the fold of the frames that are kept.
    top_hz: f64,
    good: Vec<bool>,
}

impl Window {
    fn duration_s(&self) -> f64 {
        self.frames as f64 / self.rate_hz
    }
}

impl Mixture {
    pub fn from_seed(seed: u64) -> Self {
        let draw = &mut Draw::from_seed(seed);
        let (few, count) = (draw.chance(0.47), draw.choose(&[0, 1, 2]));
        // a simple record gets at most as many complications as drawn, any other each with the same
        // probability
        let mut gates = [false; 6];
        if few {
            (0..count).for_each(|_| gates[draw.choose(&[0, 1, 2, 3, 4, 5])] = true);
        } else {
            gates.iter_mut().for_each(|gate| *gate = draw.chance(0.75));
        }
        let [several, special, bent, flips, faulty, coloured] = gates;

        let (length, least, most) = match draw.within(0.0, 1.0) {
            x if x < 0.08 => ("60 to 200", 60.0, 200.0),
            x if x < 0.88 => ("200 to 1,500", 200.0, 1500.0),
            x if x < 0.98 => ("1,500 to 3,000", 1500.0, 3000.0),
            _ => ("16,384", 16384.0, 16384.5),
        };
        let frames = draw.ratio(least, most) as usize;
        let rate_hz = draw.ratio(500.0, 20_000.0).round();
        let fault = if faulty { draw.choose(&FAULTS[1..]) } else { FAULTS[0] };
        let good = draw_good_frames(fault, frames, draw);
        let top_hz = if fault == "every second frame lost" { 0.225 } else { 0.45 } * rate_hz;
        let window = Window { frames, rate_hz, top_hz, good };

        let (noise_name, mut noise) =
            if coloured { draw_noise(&window, draw) } else { ("white", Noise::white(frames)) };
        if fault == "camera shakes" {
            let shake = Noise::resonance(frames, draw.within(0.5, 5.0), draw.within(1.0, 4.0));
            let times = draw.ratio(1.0, 30.0);
            noise.power.iter_mut().zip(&shake.power).for_each(|(power, shake)| *power += times * shake);
        }
        let values = noise.draw_values(frames, draw);
        let step_m = if noise_name == "quantised" { NOISE_M * draw.within(0.5, 3.0) } else { 0.0 };
        noise.power.iter_mut().for_each(|power| *power += (step_m / NOISE_M).powi(2) / 12.0);

        let rings = !draw.chance(0.25);
        let (trend_name, trend) = if bent { draw_trend(draw) } else { ("none", stand_still()) };
        let (flip_name, at, flip) = if flips { draw_flip(rings, draw) } else { ("none", 0.0, stand_still()) };
        let oscillations = if rings {
            draw_oscillations(&window, &noise, (several, special), (flip_name, at), draw)
        } else {
            Vec::new()
        };

        let place = |i: usize| i as f64 / frames as f64;
        let value = |(i, noise): (usize, &f64)| {
            let moves: f64 = oscillations.iter().map(|o| o.displacement_m(i, 0.0)).sum();
            let value = trend(place(i)) + flip(place(i)) + moves + noise;
            if step_m > 0.0 { (value / step_m).round() * step_m } else { value }
        };
        let mut values: Vec<f64> = values.iter().enumerate().map(value).collect();
        spoil_frames(fault, &mut values, &window.good, draw);
        let kept = |(value, good): (f64, &bool)| (*good || !fault.ends_with("lost")).then_some(value);
        let samples = values.into_iter().zip(&window.good).map(kept).collect();
        let families = vec![
            format!("frames: {length}"),
            format!("trend: {trend_name}"),
            format!("flip: {flip_name}"),
            format!("camera: {fault}"),
            format!("noise: {noise_name}"),
        ];
        Self { samples, rate_hz, oscillations, families }
    }

    pub fn resolution_hz(&self) -> f64 {
        self.rate_hz / self.samples.len() as f64
    }
}

const FAULTS: [&str; 7] = [
    "good",
    "random frames lost",
    "bursts lost",
    "every second frame lost",
    "frames mistracked",
    "frames held",
    "camera shakes",
];

/// Whether each frame shows the motion at its own time and place.
fn draw_good_frames(fault: &str, frames: usize, draw: &mut Draw) -> Vec<bool> {
    let mut good = vec![true; frames];
    match fault {
        "random frames lost" => {
            let share = draw.within(0.02, 0.4);
            good.iter_mut().for_each(|good| *good = !draw.chance(share));
        }
        "frames held" | "frames mistracked" => {
            let share = if fault == "frames held" { draw.within(0.02, 0.1) } else { draw.within(0.01, 0.03) };
            good.iter_mut().skip(1).for_each(|good| *good = !draw.chance(share));
        }
        "every second frame lost" => good.iter_mut().skip(1).step_by(2).for_each(|good| *good = false),
        "bursts lost" => {
            let share = draw.within(0.05, 0.3);
            while good.iter().filter(|good| !**good).count() < (share * frames as f64) as usize {
                let (first, count) =
                    (draw.within(0.0, frames as f64) as usize, draw.within(3.0, 30.0) as usize);
                good.iter_mut().skip(first).take(count.min(frames / 8)).for_each(|good| *good = false);
            }
        }
        _ => {}
    }
    good
}

/// Puts wrong values into the frames that do not show the motion.
fn spoil_frames(fault: &str, values: &mut [f64], good: &[bool], draw: &mut Draw) {
    for i in (1..values.len()).filter(|i| !good[*i]) {
        match fault {
            "frames held" => values[i] = values[i - 1],
            "frames mistracked" => values[i] += NOISE_M * draw.choose(&[-1.0, 1.0]) * draw.ratio(10.0, 500.0),
            _ => {}
        }
    }
}

/// Noise, as its power in the bins of the transform of a periodic record. The unit is the power of white
/// noise of the standard deviation `NOISE_M`.
struct Noise {
    power: Vec<f64>,
}

impl Noise {
    /// Noise of unit variance from the shape of its power over frequency, cycles per frame.
    fn of_shape(frames: usize, shape: impl Fn(f64) -> f64) -> Self {
        let size = (4 * frames).next_power_of_two();
        let power: Vec<f64> = (0..size).map(|bin| shape(bin.min(size - bin) as f64 / size as f64)).collect();
        let scale = 1.0 / mean(&power);
        Self { power: power.iter().map(|power| power * scale).collect() }
    }

    fn white(frames: usize) -> Self {
        Self::of_shape(frames, |_| 1.0)
    }

    /// A band of noise around a frequency, `place` and `width` in resolutions: an autoregression of the
    /// second order.
    fn resonance(frames: usize, place: f64, width: f64) -> Self {
        let (radius, angle) = ((-PI * width / frames as f64).exp(), TAU * place / frames as f64);
        let distance = move |sum: f64| 1.0 + radius * radius - 2.0 * radius * sum.cos();
        Self::of_shape(frames, |cycles| 1.0 / distance(TAU * cycles - angle) / distance(TAU * cycles + angle))
    }

    /// Mean one-sided density within one resolution of a frequency, m²/Hz.
    fn density(&self, hz: f64, window: &Window) -> f64 {
        let bins_a_hz = self.power.len() as f64 / window.rate_hz;
        let reach = (bins_a_hz / window.duration_s()).ceil() as usize;
        let bin = ((hz * bins_a_hz) as usize).min(self.power.len() / 2);
        2.0 * NOISE_M * NOISE_M / window.rate_hz * mean(&self.power[bin.saturating_sub(reach)..=bin + reach])
    }

    /// Values with this power, m. Uses a Hartley transform, which turns white noise into white noise.
    fn draw_values(&self, frames: usize, draw: &mut Draw) -> Vec<f64> {
        let bins: Vec<f64> = self.power.iter().map(|power| power.sqrt() * draw.normal()).collect();
        let scale = NOISE_M / (bins.len() as f64).sqrt();
        fourier(&bins, bins.len()).iter().take(frames).map(|value| scale * (value.re - value.im)).collect()
    }
}

fn draw_noise(window: &Window, draw: &mut Draw) -> (&'static str, Noise) {
    let frames = window.frames;
    let first_order =
        |last: f64| move |cycles: f64| 1.0 / (1.0 + last * last - 2.0 * last * (TAU * cycles).cos());
    let names = ["AR(1) 0.5", "AR(1) 0.9", "1/f", "narrow band", "mean of frames", "quantised"];
    let name = draw.choose(&names);
    let noise = match name {
        "AR(1) 0.5" => Noise::of_shape(frames, first_order(0.5)),
        "AR(1) 0.9" => Noise::of_shape(frames, first_order(0.9)),
        "1/f" => Noise::of_shape(frames, |cycles| 1.0 / cycles.max(0.25 / frames as f64)),
        "narrow band" => {
            let place = draw.ratio(8.0, 0.4 * frames as f64);
            let mut band = Noise::resonance(frames, place, draw.ratio(5.0, 60.0).min(frames as f64 / 8.0));
            band.power.iter_mut().for_each(|power| *power += 0.04);
            band
        }
        "mean of frames" => {
            let count = draw.within(3.0, 10.0).floor();
            Noise::of_shape(frames, |cycles| {
                let x = PI * cycles.max(1e-6);
                ((count * x).sin() / (count * x.sin())).powi(2) + 1e-3
            })
        }
        _ => Noise::white(frames),
    };
    (name, noise)
}

/// A slow motion, m, over the position in the record, 0 to 1.
type Motion = Box<dyn Fn(f64) -> f64>;

fn stand_still() -> Motion {
    Box::new(|_| 0.0)
}

fn draw_trend(draw: &mut Draw) -> (&'static str, Motion) {
    let height_m = NOISE_M * draw.ratio(100.0, 5000.0);
    let [a, b, c] = [(); 3].map(|()| draw.within(-1.0, 1.0));
    if draw.chance(0.5) {
        let (part, phase) = (draw.within(0.2, 0.7), draw.within(0.0, TAU));
        return ("stroke", Box::new(move |s| height_m * (TAU * part * s + phase).sin()));
    }
    let legendre = move |x: f64| a * x + b * (1.5 * x * x - 0.5) + c * (2.5 * x * x - 1.5) * x;
    ("polynomial", Box::new(move |s| height_m * legendre(2.0 * s - 1.0)))
}

/// Name, position in the record (0 to 1) and motion of a flip.
fn draw_flip(rings: bool, draw: &mut Draw) -> (&'static str, f64, Motion) {
    const FLIPS: [&str; 8] = [
        "tanh",
        "step",
        "minimum jerk",
        "half cosine",
        "creep",
        "overshoot",
        "step and drift",
        "step and ring",
    ];
    let name = draw.choose(if rings { &FLIPS } else { &FLIPS[..7] });
    let height_m = NOISE_M * draw.ratio(20.0, 2000.0) * draw.choose(&[-1.0, 1.0]);
    let at = if name == "creep" && draw.chance(0.5) { 0.0 } else { draw.within(0.1, 0.8) };
    let (wide, slope, bend) = (draw.ratio(0.01, 0.3), draw.within(-1.0, 1.0), draw.within(-1.0, 1.0));
    let shape = move |s: f64| {
        let u = (s - at) / wide;
        let (rise, after) = (u.clamp(0.0, 1.0), u.max(0.0));
        match name {
            "tanh" => u.tanh(),
            "minimum jerk" => rise.powi(3) * (10.0 - 15.0 * rise + 6.0 * rise * rise),
            "half cosine" => 0.5 - 0.5 * (PI * rise).cos(),
            "creep" => 1.0 - (-after).exp(),
            "overshoot" => 1.0 - (1.0 - 2.0 * after) * (-after).exp(),
            "step and drift" => f64::from(u8::from(s >= at)) + slope * s + bend * s * s,
            _ => f64::from(u8::from(s >= at)),
        }
    };
    (name, at, Box::new(move |s| height_m * shape(s)))
}

fn draw_oscillations(
    window: &Window,
    noise: &Noise,
    (several, special): (bool, bool),
    (flip, at): (&str, f64),
    draw: &mut Draw,
) -> Vec<Oscillation> {
    const KINDS: [&str; 8] =
        ["steady", "ring-down", "late ring-down", "growing", "drift", "comb", "modulated", "pair"];
    let count = if several { draw.choose(&[2, 3, 4]) } else { 1 };
    let mut list = Vec::new();
    for k in 0..count {
        let kind = if flip == "step and ring" && k == 0 {
            "ring after step"
        } else if draw.chance(0.05) {
            "folded"
        } else {
            draw.choose(if special { &KINDS } else { &KINDS[..2] })
        };
        let mut oscillation = draw_oscillation(kind, window, at, draw);
        let mut snr_db = draw.within(5.0, 45.0);
        oscillation.scale_to(snr_db, noise, window);
        if kind == "pair" {
            let apart = draw.within(0.5, 4.0) / window.duration_s();
            let hz = oscillation.mean_hz(0.0) + apart;
            list.push(oscillation);
            oscillation = make_steady(kind, hz, window, draw);
            snr_db -= draw.within(0.0, 10.0);
            oscillation.scale_to(snr_db, noise, window);
        }
        list.push(oscillation);
    }
    let hz: Vec<f64> = list.iter().map(|o| o.mean_hz(0.0)).collect();
    let bounds = bound_frequencies(&list, noise, window);
    for (k, (oscillation, bound_hz)) in list.iter_mut().zip(bounds).enumerate() {
        let cycles = oscillation.cycles[window.frames - 1] - oscillation.cycles[oscillation.onset];
        let near = |j: usize| j != k && (hz[j] - hz[k]).abs() < 1.0 / window.duration_s();
        oscillation.apart = cycles < 3.0 || (0..hz.len()).any(near);
        oscillation.bound_hz = bound_hz;
    }
    list
}

fn make_steady(kind: &'static str, hz: f64, window: &Window, draw: &mut Draw) -> Oscillation {
    let phase = draw.within(0.0, 1.0);
    Oscillation {
        kind,
        cycles: (0..window.frames).map(|i| hz * i as f64 / window.rate_hz + phase).collect(),
        envelope_m: vec![NOISE_M; window.frames],
        multiples: vec![1.0],
        rate_hz: window.rate_hz,
        ..Oscillation::default()
    }
}

fn draw_oscillation(kind: &'static str, window: &Window, at: f64, draw: &mut Draw) -> Oscillation {
    let (duration_s, phase) = (window.duration_s(), draw.within(0.0, 1.0));
    // room for multiples, sidebands and the second of a pair below the fold
    let room = match kind {
        "comb" => 3.0,
        "modulated" => 1.5,
        "pair" => 1.2,
        _ => 1.0,
    };
    let mut hz = draw.ratio(2.0 / duration_s, window.top_hz / room);
    if kind == "folded" {
        let rate_hz = window.top_hz / 0.45;
        hz = alias_hz(draw.within(0.55, 1.45) * rate_hz, rate_hz);
    }
    let mut made = make_steady(kind, hz, window, draw);
    let times_s: Vec<f64> = (0..window.frames).map(|i| i as f64 / window.rate_hz).collect();
    let set = |values: &mut Vec<f64>, value: &dyn Fn(usize) -> f64| {
        *values = (0..window.frames).map(value).collect()
    };
    match kind {
        "ring-down" | "late ring-down" | "ring after step" => {
            let share = if kind == "late ring-down" { draw.within(0.1, 0.7) } else { at };
            let from = if kind == "ring-down" { 0.0 } else { share * window.frames as f64 };
            made.onset = from.ceil() as usize;
            let ratio = draw.ratio(0.005, 0.1);
            let decay = TAU * hz * ratio / (1.0 - ratio * ratio).sqrt() / window.rate_hz;
            let envelope = |i: usize| if i < made.onset { 0.0 } else { (-decay * (i as f64 - from)).exp() };
            set(&mut made.envelope_m, &envelope);
        }
        "growing" => {
            let nepers = draw.within(0.5, 4.0);
            set(&mut made.envelope_m, &|i| (nepers * times_s[i] / duration_s).exp());
        }
        "drift" => {
            let ratio = draw.within(1.2, 2.0);
            let low_hz = draw.ratio(2.0 / duration_s, window.top_hz / ratio);
            let (first, last) =
                if draw.chance(0.5) { (low_hz, ratio * low_hz) } else { (ratio * low_hz, low_hz) };
            let course = draw.choose(&[1, 2, 3]);
            let integral = |u: f64| match course {
                1 => first * u + (last - first) * u * u / 2.0,
                2 => first * u + (last - first) * u.powi(3) / 3.0,
                _ => first * ((last / first).powf(u) - 1.0) / (last / first).ln(),
            };
            set(&mut made.cycles, &|i| duration_s * integral(times_s[i] / duration_s) + phase);
        }
        "comb" => {
            made.jitter = if draw.chance(0.33) { 0.0 } else { draw.within(0.0, 0.05) };
            let (roundness, drops) =
                (draw.within(0.7, 1.0), if draw.chance(0.33) { draw.within(0.02, 0.1) } else { 0.0 });
            let count = ((window.top_hz / hz) as usize).min(MULTIPLES);
            made.multiples = (0..count).map(|k| roundness.powi(k as i32) / (k + 1) as f64).collect();
            // a beat begins at a whole number of cycles
            let mut begins = vec![-phase / hz];
            while begins[begins.len() - 1] < duration_s {
                let period = (1.0 + made.jitter * draw.normal()).max(0.1) / hz;
                begins.push(begins[begins.len() - 1] + period);
            }
            let dropped: Vec<bool> = begins.iter().map(|_| draw.chance(drops)).collect();
            let beat = |i: usize| begins.partition_point(|begin| *begin <= times_s[i]) - 1;
            let part = |i: usize, k: usize| (times_s[i] - begins[k]) / (begins[k + 1] - begins[k]);
            set(&mut made.cycles, &|i| beat(i) as f64 + part(i, beat(i)));
            set(&mut made.envelope_m, &|i| f64::from(u8::from(!dropped[beat(i)])));
        }
        "modulated" => {
            let (depth, most_hz) = (draw.within(0.2, 0.9), (hz / 2.0).max(2.6 / duration_s));
            let modulation = draw.ratio(2.5 / duration_s, most_hz.min(20.0 / duration_s));
            made.modulation_hz = Some(modulation);
            set(&mut made.envelope_m, &|i| 1.0 + depth * (TAU * (modulation * times_s[i] + phase)).sin());
        }
        _ => {}
    }
    made
}

impl Oscillation {
    /// Scales the amplitude to a signal-to-noise ratio. Frames that do not show the motion count as
    /// additional white noise.
    fn scale_to(&mut self, snr_db: f64, noise: &Noise, window: &Window) {
        let squares: Vec<f64> = (0..window.frames).map(|i| self.displacement_m(i, 0.0).powi(2)).collect();
        let (all, good) = (window.frames as f64, window.good.iter().filter(|good| **good).count() as f64);
        let lost = (all - good) / good * 2.0 * NOISE_M * NOISE_M / window.rate_hz * mean(&noise.power);
        let density = noise.density(self.mean_hz(0.0), window) + lost;
        let wanted = 10.0_f64.powf(snr_db / 10.0) * density * 2.0 / window.duration_s();
        let scale = (wanted / mean(&squares).max(f64::MIN_POSITIVE)).sqrt();
        self.envelope_m.iter_mut().for_each(|envelope_m| *envelope_m *= scale);
        self.snr_db = snr_db;
    }
}

/// Cramér-Rao bounds of the frequencies, Hz; all parameters of all oscillations and of a cubic trend are
/// unknown.
///
/// Every oscillation has an unknown amplitude, phase and frequency; damped and growing ones an unknown decay,
/// drifting ones an unknown rate of drift, combs an unknown amplitude and phase of every multiple. Onset,
/// modulation and dropped beats are known. The noise counts as white with its density around each
/// oscillation.
fn bound_frequencies(list: &[Oscillation], noise: &Noise, window: &Window) -> Vec<Option<f64>> {
    let rows: Vec<usize> = (0..window.frames).filter(|i| window.good[*i]).collect();
    let mut columns: Vec<Vec<f64>> = Vec::new();
    let mut add = |value: &dyn Fn(usize) -> f64| {
        columns.push(rows.iter().map(|i| value(*i)).collect());
        columns.len() - 1
    };
    let place = |i: usize| 2.0 * i as f64 / window.frames as f64 - 1.0;
    (0..4).for_each(|power| _ = add(&|i| place(i).powi(power)));
    let mut slopes = Vec::new();
    for oscillation in list {
        for multiple in 1..=oscillation.multiples.len() {
            let turn = |i: usize| TAU * multiple as f64 * oscillation.cycles[i];
            add(&|i| oscillation.envelope_m[i] * turn(i).cos());
            add(&|i| oscillation.envelope_m[i] * turn(i).sin());
        }
        slopes.push(add(&|i| place(i) * oscillation.displacement_m(i, 0.25)));
        match oscillation.kind {
            "drift" => _ = add(&|i| place(i).powi(2) * oscillation.displacement_m(i, 0.25)),
            kind if kind.contains("ring") || kind == "growing" => {
                add(&|i| place(i) * oscillation.displacement_m(i, 0.0));
            }
            _ => {}
        }
    }
    let mut jacobian = DMatrix::from_fn(rows.len(), columns.len(), |row, column| columns[column][row]);
    let norms = DVector::from_iterator(columns.len(), jacobian.column_iter().map(|column| column.norm()));
    jacobian
        .column_iter_mut()
        .zip(&norms)
        .for_each(|(mut column, norm)| column /= norm.max(f64::MIN_POSITIVE));
    let inverse = jacobian.tr_mul(&jacobian).cholesky().map(|factor| factor.inverse());
    let bound = |(oscillation, slope): (&Oscillation, &usize)| {
        let variance = inverse.as_ref()?[(*slope, *slope)] / norms[*slope].powi(2);
        let density = noise.density(oscillation.mean_hz(0.0), window);
        // the column of a frequency is the derivative with respect to `2 pi f T / 2`
        let bound_hz = (variance * density * window.rate_hz / 2.0).sqrt() / (PI * window.duration_s());
        (oscillation.jitter == 0.0).then_some(bound_hz)
    };
    list.iter().zip(&slopes).map(bound).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn window(frames: usize) -> Window {
        Window { frames, rate_hz: 5000.0, top_hz: 2250.0, good: vec![true; frames] }
    }

    #[test]
    fn the_bound_of_a_fast_steady_oscillation_has_the_closed_form() {
        let (window, noise) = (window(1000), Noise::white(1000));
        let mut tone = make_steady("steady", 987.0, &window, &mut Draw::from_seed(1));
        tone.scale_to(30.0, &noise, &window);
        // `A^2 / 2` is the mean square, so `A^2 / (2 sigma^2) = 4 snr / N`
        let (count, ratio) = (1000.0_f64, 4.0 * 1000.0 / 1000.0);
        let closed = 5000.0 / TAU * (12.0 / (ratio * count * (count * count - 1.0))).sqrt();
        let bound_hz = bound_frequencies(&[tone], &noise, &window)[0].unwrap();
        assert!((bound_hz / closed - 1.0).abs() < 1e-3, "{bound_hz} {closed}");
    }

    #[test]
    fn drawn_noise_has_the_density_of_its_autoregression() {
        const DRAWS: usize = 2000;
        let (window, last, hz) = (window(256), 0.9_f64, 300.0);
        let turn = |i: usize| TAU * hz * i as f64 / window.rate_hz;
        let noise =
            Noise::of_shape(256, |cycles| 1.0 / (1.0 + last * last - 2.0 * last * (TAU * cycles).cos()));
        let draw = &mut Draw::from_seed(1);
        let (mut power, mut products) = (0.0, 0.0);
        for _ in 0..DRAWS {
            let values = noise.draw_values(256, draw);
            let part =
                |shift: f64| values.iter().enumerate().map(|(i, x)| x * (turn(i) + shift).cos()).sum::<f64>();
            power += part(0.0).powi(2) + part(PI / 2.0).powi(2);
            products += values[100] * values[101] / (NOISE_M * NOISE_M);
        }
        let of_draws = 2.0 * power / (DRAWS as f64 * 256.0 * window.rate_hz);
        let closed = 2.0 * NOISE_M.powi(2) / window.rate_hz * (1.0 - last * last)
            / (1.0 + last * last - 2.0 * last * (TAU * hz / window.rate_hz).cos());
        assert!((of_draws / closed - 1.0).abs() < 0.1, "{of_draws} {closed}");
        assert!((noise.density(hz, &window) / closed - 1.0).abs() < 0.05);
        assert!((products / DRAWS as f64 - last).abs() < 0.1, "{products}");
    }
}
