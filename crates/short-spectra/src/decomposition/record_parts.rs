//! The parts of a record as values over time, m.

use super::Decomposition;
use super::atom::Atom;
use crate::trend::Trend;
use portable_math as math;
use std::f64::consts::TAU;

/// The parts of a record in every frame.
pub(crate) struct RecordParts {
    pub trend: Trend,
    /// Number of exponential relaxations.
    pub relaxations: usize,
    /// Number of steps, including jumps and swings that end within a cycle.
    pub steps: usize,
    /// Sum of trend, relaxations and steps in every frame, m.
    pub slow_m: Vec<f64>,
    /// Sum of the oscillations in every frame, m.
    pub fast_m: Vec<f64>,
    pub oscillations: Vec<Oscillation>,
    /// For each frame, whether the parts were fitted to its value.
    pub is_used: Vec<bool>,
}

/// An oscillation of a record: a steady, decaying or drifting one, with its harmonics.
#[derive(Debug, Clone, PartialEq)]
pub struct Oscillation {
    atom: Atom,
    /// Amplitudes of the columns of the atom, m.
    amplitudes_m: Vec<f64>,
    /// Number of frames of the record.
    frames: usize,
    frame_rate_hz: f64,
}

impl RecordParts {
    /// The trend of a record without other parts.
    pub(crate) fn from_trend(samples: &[Option<f64>], trend: Trend) -> Self {
        Self {
            trend,
            relaxations: 0,
            steps: 0,
            slow_m: trend.fit_values(samples),
            fast_m: vec![0.0; samples.len()],
            oscillations: Vec::new(),
            is_used: vec![true; samples.len()],
        }
    }
}

impl Decomposition {
    /// The parts of the most probable explanation.
    pub(crate) fn record_parts(&self) -> RecordParts {
        let frames = self.problem.at.frames;
        let (trend, atoms) = self.problem.values_everywhere(&self.explanation);
        let mut slow_m: Vec<f64> = trend.iter().map(|x| self.mean_m + self.scale_m * x).collect();
        let mut fast_m = vec![0.0; frames];
        let (mut relaxations, mut steps, mut oscillations) = (0, 0, Vec::new());
        for ((atom, amplitudes), values) in self.explanation.atoms_with_amplitudes().zip(atoms) {
            let add_to = |sum_m: &mut [f64]| {
                sum_m.iter_mut().zip(values).for_each(|(sum, x)| *sum += self.scale_m * x);
            };
            match atom {
                Atom::Oscillation(o) if o.is_single_swing() => steps += 1,
                Atom::Oscillation(_) | Atom::Course(_) => {
                    let amplitudes_m = amplitudes.iter().map(|a| a * self.scale_m).collect();
                    let frame_rate_hz = self.frame_rate_hz;
                    oscillations.push(Oscillation {
                        atom: atom.clone(),
                        amplitudes_m,
                        frames,
                        frame_rate_hz,
                    });
                    add_to(&mut fast_m);
                    continue;
                }
                Atom::Relaxation { .. } => relaxations += 1,
                Atom::Step { .. } | Atom::Break { .. } => steps += 1,
            }
            add_to(&mut slow_m);
        }
        let mut is_used = vec![false; frames];
        self.problem.used.iter().for_each(|i| is_used[*i] = true);
        let trend = self.explanation.parts.trend;
        RecordParts { trend, relaxations, steps, slow_m, fast_m, oscillations, is_used }
    }
}

impl Oscillation {
    /// Mean frequency while it is present, Hz.
    #[must_use]
    pub fn frequency_hz(&self) -> f64 {
        let cycles = match &self.atom {
            Atom::Oscillation(o) => o.mean_cycles(),
            Atom::Course(course) => course.mean().frequency_hz,
            _ => 0.0,
        };
        cycles * self.frame_rate_hz / self.frames as f64
    }

    /// Decay of the amplitude, 1/s, negative for growth; 0 for an oscillation without a constant decay.
    #[must_use]
    pub fn decay_per_s(&self) -> f64 {
        let nepers = self.atom.oscillation().and_then(|o| o.nepers).unwrap_or(0.0);
        nepers * self.frame_rate_hz / self.frames as f64
    }

    /// Start, s from the first frame; 0 if it is present from the first frame on.
    #[must_use]
    pub fn begins_s(&self) -> f64 {
        let onset = self.atom.oscillation().map_or(0.0, |o| o.onset);
        onset * self.frames as f64 / self.frame_rate_hz
    }

    /// Displacement, m, at the time `time_s` after the first frame of the record.
    #[must_use]
    pub fn displacement_m(&self, time_s: f64) -> f64 {
        let (turn, size) = self.phase_and_size(time_s);
        let multiples = self.atom.multiples();
        // the fundamental of an oscillation along a ridge has a cosine column and no sine column
        let (fundamental_m, harmonics_m) = match &self.atom {
            Atom::Course(_) => ([self.amplitudes_m[0], 0.0], &self.amplitudes_m[1..]),
            _ => ([self.amplitudes_m[0], self.amplitudes_m[1]], &self.amplitudes_m[2..]),
        };
        let pairs = harmonics_m.chunks(2).map(|pair| [pair[0], pair[1]]);
        let all = std::iter::once((1, fundamental_m)).chain(multiples.iter().copied().zip(pairs));
        let value = |(multiple, [a, b]): (usize, [f64; 2])| {
            let turn = multiple as f64 * turn;
            let (sine, cosine) = math::sin_cos(TAU * (turn - turn.floor()));
            a * cosine + b * sine
        };
        size * all.map(value).sum::<f64>()
    }

    /// Amplitude, m, at the time `time_s` after the first frame of the record, without harmonics.
    #[must_use]
    pub fn envelope_m(&self, time_s: f64) -> f64 {
        let (_, size) = self.phase_and_size(time_s);
        let own = if self.atom.course().is_some() { 1 } else { 2 };
        size.abs() * self.amplitudes_m[..own].iter().fold(0.0, |m: f64, a| math::hypot(m, *a))
    }

    /// Phase, cycles, and factor of the amplitudes at the time `time_s` after the first frame.
    fn phase_and_size(&self, time_s: f64) -> (f64, f64) {
        let frame = time_s * self.frame_rate_hz;
        match &self.atom {
            Atom::Oscillation(o) => {
                let s = (frame + 0.5) / self.frames as f64;
                (o.phase_at(s), o.size_at(s))
            }
            Atom::Course(course) => course.phase_and_size(frame),
            _ => (0.0, 0.0),
        }
    }
}
