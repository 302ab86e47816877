//! Records whose components are known.

use portable_math::StandardNormal;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use short_spectra::sampling::exposure_gain;
use std::f64::consts::TAU;

/// Amplitude of a component, m; noise is given in relation to it.
pub const AMPLITUDE_M: f64 = 1e-5;
/// Height of a flip, in amplitudes.
const FLIP: f64 = 100.0;

/// An oscillation `A exp(-2 pi f zeta t) cos(2 pi f t + phase)`.
#[derive(Clone, Copy)]
pub struct Tone {
    pub hz: f64,
    pub amplitude_m: f64,
    pub damping: f64,
}

impl Tone {
    pub fn steady(hz: f64) -> Self {
        Self { hz, amplitude_m: AMPLITUDE_M, damping: 0.0 }
    }

    pub fn ring_down(hz: f64, damping: f64) -> Self {
        Self { damping, ..Self::steady(hz) }
    }

    fn at(&self, t: f64, phase: f64) -> f64 {
        self.envelope_m(t) * (TAU * self.hz * t + phase).cos()
    }

    /// Amplitude at a time, m.
    pub fn envelope_m(&self, t: f64) -> f64 {
        self.amplitude_m * (-TAU * self.hz * self.damping * t).exp()
    }

    /// Damping ratio as read: real part over the length of the pole.
    pub fn ratio(&self) -> f64 {
        self.damping / self.damping.hypot(1.0)
    }
}

/// What lies below the oscillations: a name, and the shape over the record, of unit height.
#[derive(Clone, Copy)]
pub struct Flip {
    pub name: &'static str,
    shape: fn(f64) -> f64,
}

pub const NO_FLIP: Flip = Flip { name: "none", shape: |_| 0.0 };
pub const FLIPS: [Flip; 4] = [
    Flip { name: "cubic", shape: |s| 4.0 * (s - 0.5).powi(3) + s },
    Flip { name: "exponential", shape: |s| (-12.0 * s).exp() },
    Flip { name: "tanh tail", shape: |s| (20.0 * (s + 0.05)).tanh() },
    Flip { name: "smooth step", shape: |s| 1.0 / (1.0 + (-12.0 * (s - 0.4)).exp()) },
];

/// A record to be made.
#[derive(Clone)]
pub struct Signal {
    pub tones: Vec<Tone>,
    /// A steady amplitude whose frequency rises evenly between these, Hz.
    pub chirp_hz: Option<(f64, f64)>,
    pub flip: Flip,
    /// `A^2 / (2 sigma^2)` of [`AMPLITUDE_M`], dB.
    pub snr_db: f64,
    /// Share of the frames that is lost, each by itself.
    pub missing: f64,
    pub frames: usize,
    pub rate_hz: f64,
    pub exposure_s: Option<f64>,
    /// The noise with the other sign: errors in proportion to it cancel over both, and what is left is bias.
    pub mirrored: bool,
}

impl Default for Signal {
    fn default() -> Self {
        Self {
            tones: Vec::new(),
            chirp_hz: None,
            flip: NO_FLIP,
            snr_db: 20.0,
            missing: 0.0,
            frames: 750,
            rate_hz: 5000.0,
            exposure_s: None,
            mirrored: false,
        }
    }
}

impl Signal {
    pub fn of(tones: &[Tone]) -> Self {
        Self { tones: tones.to_vec(), ..Self::default() }
    }

    /// Deviation of the noise, m.
    pub fn noise_m(&self) -> f64 {
        AMPLITUDE_M / (2.0 * 10.0_f64.powf(self.snr_db / 10.0)).sqrt()
    }

    /// One sample a frame, m; phases, noise and lost frames are the seed's.
    pub fn record(&self, seed: u64) -> Vec<Option<f64>> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let phases: Vec<f64> = self.tones.iter().map(|_| random.random::<f64>() * TAU).collect();
        let passes = |hz: f64| self.exposure_s.map_or(1.0, |exposure_s| exposure_gain(hz, exposure_s));
        let sample = |i: usize| {
            let (t, s) = (i as f64 / self.rate_hz, i as f64 / self.frames as f64);
            let tones: f64 = self
                .tones
                .iter()
                .zip(&phases)
                .map(|(tone, phase)| passes(tone.hz) * tone.at(t, *phase))
                .sum();
            let noise = if self.mirrored { -1.0 } else { 1.0 }
                * self.noise_m()
                * random.sample::<f64, _>(StandardNormal);
            let lost = random.random::<f64>() < self.missing;
            (!lost).then(|| tones + self.chirp(t) + FLIP * AMPLITUDE_M * (self.flip.shape)(s) + noise)
        };
        (0..self.frames).map(sample).collect()
    }

    fn chirp(&self, t: f64) -> f64 {
        let duration_s = self.frames as f64 / self.rate_hz;
        self.chirp_hz.map_or(0.0, |(low, high)| {
            AMPLITUDE_M * (TAU * (low + (high - low) * t / duration_s / 2.0) * t).cos()
        })
    }

    /// Cramér-Rao bound of a tone's frequency with its amplitude, phase and decay unknown and nothing else,
    /// Hz.
    pub fn bound_hz(&self, tone: &Tone) -> f64 {
        let mut sums = [0.0; 3];
        for i in 0..self.frames {
            let t = i as f64 / self.rate_hz;
            let power = (1.0 - self.missing) * (-2.0 * TAU * tone.hz * tone.damping * t).exp();
            (0..3).for_each(|k| sums[k] += power * t.powi(k as i32));
        }
        let spread = sums[2] - sums[1] * sums[1] / sums[0];
        (2.0 / spread).sqrt() * self.noise_m() / (tone.amplitude_m * TAU)
    }
}
