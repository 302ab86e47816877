//! Records on which a reading of spectra fails: what rings down, starts late, runs long, lies close, drifts,
//! or is not there at all.

use crate::signal::AMPLITUDE_M;
use portable_math::StandardNormal;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use std::f64::consts::{PI, TAU};

/// An oscillation that a record holds.
#[derive(Clone, Copy, Debug)]
pub struct Truth {
    pub hz: f64,
    /// Decay of its amplitude, 1/s.
    pub decay_per_s: f64,
    /// Where it begins, s.
    pub from_s: f64,
    pub amplitude_m: f64,
    pub phase: f64,
    /// Whether a reading must find it; sidebands and harmonics are there, but need not be listed.
    pub sought: bool,
    /// Whether it may be called clear: what is a part of another component may not.
    pub own: bool,
}

impl Truth {
    pub fn steady(hz: f64, phase: f64) -> Self {
        Self { hz, decay_per_s: 0.0, from_s: 0.0, amplitude_m: AMPLITUDE_M, phase, sought: true, own: true }
    }

    pub fn damped(hz: f64, ratio: f64, phase: f64) -> Self {
        Self { decay_per_s: TAU * hz * ratio / (1.0 - ratio * ratio).sqrt(), ..Self::steady(hz, phase) }
    }

    pub fn at(&self, t: f64) -> f64 {
        if t < self.from_s {
            return 0.0;
        }
        let since = t - self.from_s;
        self.amplitude_m * (-self.decay_per_s * since).exp() * (TAU * self.hz * since + self.phase).cos()
    }

    /// Cramér-Rao bound of the frequency, of this oscillation alone in white noise, Hz.
    pub fn bound_hz(&self, frames: usize, rate_hz: f64, noise_m: f64) -> f64 {
        let first = (self.from_s * rate_hz).ceil() as usize;
        let mut sums = [0.0; 3];
        for i in first..frames {
            let t = i as f64 / rate_hz - self.from_s;
            let power = (-2.0 * self.decay_per_s * t).exp();
            (0..3).for_each(|k| sums[k] += power * t.powi(k as i32));
        }
        let spread = sums[2] - sums[1] * sums[1] / sums[0];
        (2.0 / spread).sqrt() * noise_m / (self.amplitude_m * TAU)
    }
}

/// A record with what it is made of.
pub struct Made {
    pub samples: Vec<Option<f64>>,
    pub rate_hz: f64,
    pub truths: Vec<Truth>,
    pub noise_m: f64,
}

/// A kind of record.
pub struct Kind {
    pub name: &'static str,
    pub group: &'static str,
    make: fn(&mut Draw) -> Made,
}

/// Draws of a record.
pub struct Draw(Xoshiro256PlusPlus);

impl Draw {
    pub fn from_seed(seed: u64) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(seed))
    }

    fn phase(&mut self) -> f64 {
        self.within(0.0, TAU)
    }

    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.random::<f64>()
    }

    pub fn normal(&mut self) -> f64 {
        self.0.sample::<f64, _>(StandardNormal)
    }
}

impl Kind {
    pub fn made(&self, seed: u64) -> Made {
        (self.make)(&mut Draw::from_seed(seed))
    }
}

const RATE_HZ: f64 = 5000.0;
const FRAMES: usize = 750;
const DURATION_S: f64 = FRAMES as f64 / RATE_HZ;
/// Height of a flip, m.
const FLIP_M: f64 = 100.0 * AMPLITUDE_M;

/// Noise of an oscillation of the usual amplitude, m.
fn noise_m(snr_db: f64) -> f64 {
    AMPLITUDE_M / (2.0 * 10.0_f64.powf(snr_db / 10.0)).sqrt()
}

fn record(
    frames: usize,
    truths: Vec<Truth>,
    noise_m: f64,
    draw: &mut Draw,
    under: impl Fn(f64) -> f64,
) -> Made {
    let sample = |i: usize| {
        let t = i as f64 / RATE_HZ;
        under(t) + truths.iter().map(|truth| truth.at(t)).sum::<f64>()
    };
    let samples = (0..frames).map(|i| Some(sample(i) + noise_m * draw.normal())).collect();
    Made { samples, rate_hz: RATE_HZ, truths, noise_m }
}

fn plain(truths: Vec<Truth>, snr_db: f64, draw: &mut Draw) -> Made {
    record(FRAMES, truths, noise_m(snr_db), draw, |_| 0.0)
}

fn ringing(hz: f64, ratio: f64, draw: &mut Draw) -> Made {
    let truth = Truth::damped(hz, ratio, draw.phase());
    plain(vec![truth], 20.0, draw)
}

/// An oscillation that swells and fades within a fraction of the record, somewhere in it, at 40 dB.
fn burst(share: f64, draw: &mut Draw) -> Made {
    let (hz, phase) = (draw.within(300.0, 1500.0), draw.phase());
    let first_s = draw.within(0.0, (1.0 - share) * DURATION_S);
    let mut made = record(FRAMES, Vec::new(), noise_m(40.0), draw, |t| {
        let within = ((t - first_s) / (share * DURATION_S)).clamp(0.0, 1.0);
        AMPLITUDE_M * (TAU / 2.0 * within).sin().powi(2) * (TAU * hz * t + phase).cos()
    });
    made.truths.push(Truth::steady(hz, phase));
    made
}

/// A ring-down of so many nepers over the record, anywhere in frequency.
fn fast(nepers: f64, draw: &mut Draw) -> Made {
    let truth =
        Truth { decay_per_s: nepers / DURATION_S, ..Truth::steady(draw.within(200.0, 1500.0), draw.phase()) };
    plain(vec![truth], 20.0, draw)
}

fn late(ratio: f64, share: f64, snr_db: f64, draw: &mut Draw) -> Made {
    let truth = Truth { from_s: share * DURATION_S, ..Truth::damped(400.0, ratio, draw.phase()) };
    plain(vec![truth], snr_db, draw)
}

fn exponential(t: f64) -> f64 {
    FLIP_M * (-12.0 * t / DURATION_S).exp()
}

fn tanh_tail(t: f64) -> f64 {
    FLIP_M * (20.0 * (t / DURATION_S + 0.05)).tanh()
}

fn smooth_step(t: f64) -> f64 {
    FLIP_M / (1.0 + (-12.0 * (t / DURATION_S - 0.4)).exp())
}

/// Two reversals without any oscillation.
fn stroke(t: f64, duration_s: f64) -> f64 {
    let s = t / duration_s;
    FLIP_M * (((s - 0.3) * 60.0).tanh() - ((s - 0.75) * 60.0).tanh()) + 20.0 * FLIP_M * (PI * s).sin()
}

/// Noise that is filtered: each value is made of the last two and a draw.
fn coloured(frames: usize, first: f64, second: f64, draw: &mut Draw) -> Vec<f64> {
    const SETTLES: usize = 2000;
    let (mut last, mut before) = (0.0, 0.0);
    let values: Vec<f64> = (0..frames + SETTLES)
        .map(|_| {
            let value = first * last + second * before + draw.normal();
            (before, last) = (last, value);
            value
        })
        .skip(SETTLES)
        .collect();
    let rms = (values.iter().map(|x| x * x).sum::<f64>() / frames as f64).sqrt();
    values.into_iter().map(|x| 1e-6 * x / rms).collect()
}

/// A ring-down that is over in a tenth of a long record, and a steady tone.
fn ring_down_and_tone(frames: usize, draw: &mut Draw) -> Made {
    let ring_down = Truth { amplitude_m: 1e-4, ..Truth::damped(78.4, 0.03, draw.phase()) };
    let cycle = Truth::steady(900.5, draw.phase());
    record(frames, vec![ring_down, cycle], 1e-6, draw, |_| 0.0)
}

/// A ring-down anywhere in a record that is a hundred times as long, and a steady tone.
fn ring_down_anywhere(draw: &mut Draw) -> Made {
    const LONG: usize = 100_000;
    let from_s = draw.within(0.0, 0.95) * LONG as f64 / RATE_HZ;
    let damped = Truth::damped(draw.within(200.0, 800.0), 0.01, draw.phase());
    let ring_down = Truth { amplitude_m: 2e-5, from_s, ..damped };
    let cycle = Truth::steady(900.5, draw.phase());
    record(LONG, vec![ring_down, cycle], 1e-6, draw, |_| 0.0)
}

/// Two flips of a few milliseconds, each with a ring-down of the same frequency.
fn two_flips(frames: usize, draw: &mut Draw) -> Made {
    const RISE_S: f64 = 0.005;
    let flips_s = [0.2, 0.6].map(|share| share * frames as f64 / RATE_HZ);
    let ring_down = |from_s: f64, draw: &mut Draw| Truth {
        amplitude_m: 1e-4,
        from_s,
        ..Truth::damped(78.4, 0.03, draw.phase())
    };
    let first = ring_down(flips_s[0], draw);
    // of two of one frequency one is listed
    let second = Truth { sought: false, ..ring_down(flips_s[1], draw) };
    record(frames, vec![first, second], 1e-6, draw, |t| {
        FLIP_M * (((t - flips_s[0]) / RISE_S).tanh() - ((t - flips_s[1]) / RISE_S).tanh())
    })
}

fn of_noise(values: Vec<f64>) -> Made {
    let samples = values.into_iter().map(Some).collect();
    Made { samples, rate_hz: RATE_HZ, truths: Vec::new(), noise_m: 1e-6 }
}

fn narrow(cycles_wide: f64, draw: &mut Draw) -> Made {
    let radius = 1.0 - PI * cycles_wide / FRAMES as f64;
    let angle = TAU * draw.within(200.0, 1500.0) / RATE_HZ;
    of_noise(coloured(FRAMES, 2.0 * radius * angle.cos(), -radius * radius, draw))
}

fn pair(resolutions: f64, snr_db: f64, draw: &mut Draw) -> Made {
    let hz = draw.within(300.0, 1500.0);
    let truths =
        vec![Truth::steady(hz, draw.phase()), Truth::steady(hz + resolutions / DURATION_S, draw.phase())];
    plain(truths, snr_db, draw)
}

/// A frequency that rises evenly by a few resolutions.
fn drift(resolutions: f64, draw: &mut Draw) -> Made {
    let (hz, phase) = (draw.within(300.0, 1500.0), draw.phase());
    let rate = resolutions / DURATION_S / DURATION_S;
    let mut made = record(FRAMES, Vec::new(), noise_m(30.0), draw, |t| {
        AMPLITUDE_M * (TAU * (hz + rate * (t - DURATION_S) / 2.0) * t + phase).cos()
    });
    made.truths.push(Truth::steady(hz, phase));
    made
}

fn part(hz: f64, amplitude_m: f64, phase: f64) -> Truth {
    Truth { amplitude_m, sought: false, own: false, ..Truth::steady(hz, phase) }
}

/// A cycle whose amplitude is modulated.
fn modulated(depth: f64, draw: &mut Draw) -> Made {
    let (carrier, low) = (Truth::steady(902.0, draw.phase()), Truth::steady(78.0, draw.phase()));
    let side =
        |sign: f64| part(902.0 + sign * 78.0, 0.5 * depth * AMPLITUDE_M, carrier.phase + sign * low.phase);
    plain(vec![carrier, low, side(-1.0), side(1.0)], 30.0, draw)
}

fn multiple(times: f64, hz: f64, draw: &mut Draw) -> Made {
    let base = Truth::steady(hz, draw.phase());
    plain(
        vec![
            base,
            part(short_spectra::sampling::alias_hz(times * hz, RATE_HZ), 0.3 * AMPLITUDE_M, draw.phase()),
        ],
        30.0,
        draw,
    )
}

/// Every second beat differs.
fn doubled(draw: &mut Draw) -> Made {
    let base = Truth::steady(302.0, draw.phase());
    let parts = [0.5, 1.5, 3.5].map(|times| part(times * 302.0, 0.3 * AMPLITUDE_M, draw.phase()));
    plain([vec![base], parts.to_vec()].concat(), 30.0, draw)
}

/// Oscillations of any kind, on any flip or none, with a share of the frames lost.
fn mixture(most: u32, missing: f64, draw: &mut Draw) -> Made {
    /// Least distance of two, Hz: six resolutions.
    const APART_HZ: f64 = 40.0;
    const FLIPS: [fn(f64) -> f64; 4] = [|_| 0.0, exponential, tanh_tail, smooth_step];
    let mut truths: Vec<Truth> = Vec::new();
    let count = 1 + (draw.within(0.0, f64::from(most)) as usize);
    while truths.len() < count {
        let (hz, phase) = (draw.within(100.0, 2200.0), draw.phase());
        let kind = match draw.within(0.0, 3.0) as u32 {
            0 => Truth::steady(hz, phase),
            1 => Truth::damped(hz, draw.within(0.005, 0.06), phase),
            _ => Truth {
                from_s: draw.within(0.1, 0.6) * DURATION_S,
                ..Truth::damped(hz, draw.within(0.01, 0.06), phase)
            },
        };
        if truths.iter().all(|truth| (truth.hz - hz).abs() > APART_HZ) {
            truths.push(Truth { amplitude_m: AMPLITUDE_M * 10.0_f64.powf(draw.within(-0.5, 0.5)), ..kind });
        }
    }
    let flip = FLIPS[draw.within(0.0, FLIPS.len() as f64) as usize];
    let mut made = record(FRAMES, truths, noise_m(30.0), draw, flip);
    for sample in &mut made.samples {
        *sample = sample.filter(|_| draw.within(0.0, 1.0) >= missing);
    }
    made
}

macro_rules! kinds {
    ($($group:literal, $name:literal => $make:expr;)*) => {
        pub const KINDS: &[Kind] = &[$(Kind { group: $group, name: $name, make: $make },)*];
    };
}

kinds! {
    "ring-downs", "900 Hz, damping 2 %" => |d| ringing(900.0, 0.02, d);
    "ring-downs", "900 Hz, damping 5 %" => |d| ringing(900.0, 0.05, d);
    "ring-downs", "900 Hz, damping 10 %" => |d| ringing(900.0, 0.10, d);
    "ring-downs", "519 Hz, damping 4.5 %, 20 um in 1 um" => |d| {
        let truth = Truth { amplitude_m: 2e-5, ..Truth::damped(519.0, 0.045, d.phase()) };
        record(FRAMES, vec![truth], 1e-6, d, |_| 0.0)
    };
    "ring-downs", "15 nepers" => |d| fast(15.0, d);
    "ring-downs", "30 nepers" => |d| fast(30.0, d);
    "ring-downs", "45 nepers" => |d| fast(45.0, d);
    "ring-downs", "400 Hz, 3.4 %, 40 dB, from mid-window" => |d| late(0.034, 0.5, 40.0, d);
    "ring-downs", "400 Hz, 3.4 %, 20 dB, from mid-window" => |d| late(0.034, 0.5, 20.0, d);
    "ring-downs", "400 Hz, 1 %, 20 dB, from anywhere" => |d| { let s = d.within(0.1, 0.7); late(0.01, s, 20.0, d) };
    "ring-downs", "78.4 Hz, 5 %, on an exponential flip" => |d| {
        let truth = Truth::damped(78.4, 0.05, d.phase());
        record(FRAMES, vec![truth], noise_m(20.0), d, exponential)
    };
    "ring-downs", "78.4 Hz, 5 %, and 900 Hz, 5 %, on one" => |d| {
        let truths = vec![Truth::damped(78.4, 0.05, d.phase()), Truth::damped(900.0, 0.05, d.phase())];
        record(FRAMES, truths, noise_m(20.0), d, exponential)
    };
    "ring-downs", "900 Hz, 2 %, under a steady 300 Hz" => |d| {
        let truths = vec![Truth::damped(900.0, 0.02, d.phase()), Truth::steady(300.0, d.phase())];
        plain(truths, 20.0, d)
    };
    "low tones", "78.4 Hz behind a tanh flip" => |d| {
        let truth = Truth::steady(78.4, d.phase());
        record(FRAMES, vec![truth], noise_m(20.0), d, tanh_tail)
    };
    "low tones", "60 to 100 Hz behind a tanh flip" => |d| {
        let truth = Truth::steady(d.within(60.0, 100.0), d.phase());
        record(FRAMES, vec![truth], noise_m(20.0), d, tanh_tail)
    };
    "pairs", "0.7 resolutions apart" => |d| pair(0.7, 20.0, d);
    "pairs", "1 resolution apart" => |d| pair(1.0, 20.0, d);
    "pairs", "1.5 resolutions apart" => |d| pair(1.5, 20.0, d);
    "pairs", "1.6 resolutions apart, 60 dB" => |d| pair(1.6, 60.0, d);
    "pairs", "2 resolutions apart" => |d| pair(2.0, 20.0, d);
    "pairs", "2.5 resolutions apart" => |d| pair(2.5, 20.0, d);
    "relations", "902 Hz modulated by 20 %, and 78 Hz" => |d| modulated(0.2, d);
    "relations", "902 Hz modulated by 50 %, and 78 Hz" => |d| modulated(0.5, d);
    "relations", "7 times 131.3 Hz" => |d| multiple(7.0, 131.3, d);
    "relations", "7 times 431.3 Hz, folded" => |d| multiple(7.0, 431.3, d);
    "relations", "every second beat of 302 Hz differs" => doubled;
    "drifts", "a chirp over 1 resolution, 30 dB" => |d| drift(1.0, d);
    "drifts", "a chirp over 2 resolutions, 30 dB" => |d| drift(2.0, d);
    "drifts", "a chirp over 4 resolutions, 30 dB" => |d| drift(4.0, d);
    "drifts", "a burst in two thirds of the window, 40 dB" => |d| burst(2.0 / 3.0, d);
    "drifts", "a burst in a third of the window, 40 dB" => |d| burst(1.0 / 3.0, d);
    "drifts", "a burst in a sixth of the window, 40 dB" => |d| burst(1.0 / 6.0, d);
    "drifts", "an amplitude that falls in a line, 30 dB" => |d| {
        let (hz, phase) = (d.within(300.0, 1500.0), d.phase());
        let mut made = record(FRAMES, Vec::new(), noise_m(30.0), d, |t| {
            AMPLITUDE_M * (1.0 - t / 0.1).max(0.0) * (TAU * hz * t + phase).cos()
        });
        made.truths.push(Truth { sought: false, ..Truth::steady(hz, phase) });
        made
    };
    "mixtures", "one of any kind, on any flip, 30 dB" => |d| mixture(1, 0.0, d);
    "mixtures", "up to three of any kind, on any flip, 30 dB" => |d| mixture(3, 0.0, d);
    "mixtures", "the same, 10 % of the frames missing" => |d| mixture(3, 0.1, d);
    "noise", "white" => |d| plain(Vec::new(), 20.0, d);
    "noise", "AR(1), 0.9" => |d| of_noise(coloured(FRAMES, 0.9, 0.0, d));
    "noise", "AR(1), 0.5" => |d| of_noise(coloured(FRAMES, 0.5, 0.0, d));
    "noise", "a band of 5 resolutions" => |d| narrow(5.0, d);
    "noise", "a band of 15 resolutions" => |d| narrow(15.0, d);
    "noise", "a band of 40 resolutions" => |d| narrow(40.0, d);
    "noise", "mean of ten frames" => |d| {
        let white = coloured(FRAMES + 9, 0.0, 0.0, d);
        of_noise(white.windows(10).map(|w| w.iter().sum::<f64>() / 10.0).collect())
    };
    "noise", "a camera that shakes" => |d| {
        let shake = coloured(FRAMES, 1.99, -0.99 - 1e-4, d);
        of_noise(shake.into_iter().map(|x| 2.0 * x + 2e-7 * d.normal()).collect())
    };
    "noise", "the tracker jumps once by 20 deviations" => |d| {
        let at = d.within(0.2, 0.8) * DURATION_S;
        record(FRAMES, Vec::new(), 1e-6, d, move |t| if t > at { 2e-5 } else { 0.0 })
    };
    "long", "900.5 Hz at 0 dB, 10,000 frames" => |d| {
        let truth = Truth::steady(900.5, d.phase());
        record(10_000, vec![truth], noise_m(0.0), d, |_| 0.0)
    };
    "long", "white, 10,000 frames" => |d| record(10_000, Vec::new(), 1e-6, d, |_| 0.0);
    "long", "bare stroke, 8,000 frames" => |d| record(8_000, Vec::new(), 1e-6, d, |t| stroke(t, 1.6));
    "long", "bare stroke, 10,000 frames" => |d| record(10_000, Vec::new(), 1e-6, d, |t| stroke(t, 2.0));
    "long", "AR(1), 0.9, 10,000 frames" => |d| of_noise(coloured(10_000, 0.9, 0.0, d));
    "long", "78.4 Hz, 3 %, 100 um, 8,192 frames" => |d| {
        let truth = Truth { amplitude_m: 1e-4, ..Truth::damped(78.4, 0.03, d.phase()) };
        record(8192, vec![truth], 1e-6, d, |_| 0.0)
    };
    "long", "white, 20,000 frames" => |d| record(20_000, Vec::new(), 1e-6, d, |_| 0.0);
    "long", "bare stroke, 20,000 frames" => |d| record(20_000, Vec::new(), 1e-6, d, |t| stroke(t, 4.0));
    "long", "AR(1), 0.9, 20,000 frames" => |d| of_noise(coloured(20_000, 0.9, 0.0, d));
    "long", "78.4 Hz, 3 %, and 900 Hz, 10,000 frames" => |d| ring_down_and_tone(10_000, d);
    "long", "78.4 Hz, 3 %, and 900 Hz, 20,000 frames" => |d| ring_down_and_tone(20_000, d);
    "long", "900 Hz, 10 %, 20 um, at the start of 20,000 frames" => |d| {
        let truth = Truth { amplitude_m: 2e-5, ..Truth::damped(900.0, 0.1, d.phase()) };
        record(20_000, vec![truth], 1e-6, d, |_| 0.0)
    };
    "long", "78.4 Hz, 3 %, after each of two flips, 20,000 frames" => |d| two_flips(20_000, d);
    "long", "200 to 800 Hz, 1 %, 20 um, anywhere, 100,000 frames" => ring_down_anywhere;
}
