//! Parts that a residual may contain, found by matched filters. Oscillations (steady, decaying, late,
//! drifting) are found by transforms, steps and relaxations in sums over blocks of frames.

use super::atom::{Atom, FEWEST_CYCLES, OUTSIDE, OscillationAtom, StepShape, add_angles};
use super::problem::{Basis, Fixed, NoisyRecord, dot};
use crate::transform::RealTransform;
use portable_math as math;
use std::f64::consts::{PI, TAU};

/// Decays, nepers per record, of the filters for oscillations that are present from the first frame on. The
/// fit that follows refines them.
const DECAYS: [f64; 4] = [0.0, 3.0, 7.0, 20.0];
/// Decays, nepers per record, of the filters for oscillations that begin inside the record. Neighbours differ
/// by a factor of two: a filter with the decay of its neighbour keeps 94 % of the amplitude.
const LATE_DECAYS: [f64; 6] = [6.0, 12.0, 24.0, 48.0, 96.0, 192.0];
/// Drifts of the filters: half the change of frequency over the record, cycles per record. Neighbours are
/// further apart at large drifts, so that few filters are enough.
const DRIFTS: [f64; 16] =
    [1.0, 2.0, 3.5, 5.5, 8.5, 12.5, 17.5, 24.0, 32.5, 45.0, 60.0, 80.0, 110.0, 150.0, 200.0, 270.0];
/// Length of a filter for a late oscillation, as its decay in nepers: it contains 99.8 % of the energy.
const FILTER_NEPERS: f64 = 3.0;
/// Number of onsets tried in the time in which an oscillation decays by a neper: a filter that begins half an
/// interval too early or too late keeps 61 % of the energy, and the fit that follows moves the onset.
const ONSETS_PER_DECAY: f64 = 2.0;
/// Widths of steps, as fractions of the record. Neighbours differ by a factor of about two, and the fit that
/// follows refines them.
const STEP_WIDTHS: [f64; 6] = [0.004, 0.01, 0.022, 0.045, 0.09, 0.16];
/// Decays of relaxations, nepers per record. Neighbours differ by a factor of about 2.5, and the fit that
/// follows refines them.
const RELAXATIONS: [f64; 6] = [3.0, 8.0, 20.0, 50.0, 120.0, 300.0];
/// Largest number of blocks of frames: steps and relaxations are slow, so sums over blocks show them, and a
/// record of any length takes the same time.
const BLOCKS: usize = 128;

/// A part that may be added, with the estimated fall of the criterion, nats.
#[derive(Debug, Clone)]
pub(crate) struct Candidate {
    pub atom: Atom,
    pub gain: f64,
}

struct Search<'a> {
    problem: &'a NoisyRecord,
    /// Whitened residual in every frame of the record; zero in frames that are not used.
    residual: Vec<f64>,
    /// One in every frame that is used, zero in the others.
    present: Vec<f64>,
    /// Sum of the squares of the residual.
    squares: f64,
    band: (f64, f64),
    best: Vec<Candidate>,
}

/// The best candidate of each kind for the residual of fixed parts, the largest gain first. The kinds are
/// steady, decaying, drifting and late oscillations with frequencies in `band`, cycles per record, and with
/// `steps` also steps and relaxations.
pub(crate) fn find_candidates(
    problem: &NoisyRecord,
    fixed: &Fixed,
    band: (f64, f64),
    steps: bool,
) -> Vec<Candidate> {
    let frames = problem.at.frames;
    let (mut residual, mut present) = (vec![0.0; frames], vec![0.0; frames]);
    for (i, r) in problem.used.iter().zip(problem.residual_of(fixed)) {
        residual[*i] = *r;
        present[*i] = 1.0;
    }
    let squares = dot(&residual, &residual);
    let band = (band.0.max(FEWEST_CYCLES + 0.2), band.1.min(frames as f64 / 2.0 - 2.0));
    let mut search = Search { problem, residual, present, squares, band, best: Vec::new() };
    search.add_from_start();
    search.add_drifting();
    search.add_late();
    if steps {
        search.add_steps(fixed);
    }
    math::sort_by_number(&mut search.best, |a| -a.gain);
    search.best
}

impl Search<'_> {
    /// Fall of the criterion, nats, if an atom explains this much of the sum of squares.
    fn net_gain(&self, explained: f64, atom: &Atom) -> f64 {
        let share = (explained / self.squares.max(1e-300)).clamp(0.0, 1.0 - 1e-9);
        -0.5 * self.problem.len() as f64 * math::ln_1p(-share) - atom.price() * self.problem.log_frames()
    }

    /// Keeps the best candidate of those offered, each with the sum of squares that it explains.
    fn keep_best(&mut self, offered: impl Iterator<Item = (f64, Atom)>) {
        let rated =
            offered.map(|(explained, atom)| Candidate { gain: self.net_gain(explained, &atom), atom });
        let best = rated.max_by(|a, b| a.gain.total_cmp(&b.gain));
        self.best.extend(best);
    }

    /// Frequency, cycles per record, and value of the highest peak of a spectrum inside the band and above
    /// `least` cycles. The spectrum is that of the whole record, padded to `padded` values.
    fn highest_peak(
        &self,
        spectrum: impl Iterator<Item = f64>,
        padded: usize,
        least: f64,
    ) -> Option<(f64, f64)> {
        let cycles = |k: usize| k as f64 * self.residual.len() as f64 / padded as f64;
        let inside = |k: usize| cycles(k) >= self.band.0.max(least) && cycles(k) <= self.band.1;
        let peak = spectrum.enumerate().filter(|(k, _)| inside(*k)).max_by(|a, b| a.1.total_cmp(&b.1));
        peak.map(|(k, square)| (cycles(k), square))
    }

    fn padded_length(length: usize) -> usize {
        (2 * length).next_power_of_two()
    }

    /// Steady oscillations, and those that decay from the first frame on.
    fn add_from_start(&mut self) {
        let frames = self.residual.len();
        let padded = Self::padded_length(frames);
        let transform = RealTransform::new(padded);
        let mut offered = Vec::new();
        for nepers in DECAYS {
            let shrink = math::exp(-nepers / frames as f64);
            let mut envelope = Vec::with_capacity(frames);
            let mut level = shrink.sqrt();
            for present in &self.present {
                envelope.push(level * present);
                level *= shrink;
            }
            let energy = dot(&envelope, &envelope) / 2.0;
            let values = self.residual.iter().zip(&envelope).map(|(r, e)| r * e);
            let squares = transform.squared_magnitudes(values);
            let least = nepers / TAU * 2.0;
            if let Some((cycles, square)) = self.highest_peak(squares.into_iter(), padded, least) {
                let nepers = (nepers > 0.0).then_some(nepers);
                let atom = OscillationAtom { nepers, ..OscillationAtom::steady(cycles) };
                offered.push((square / energy, Atom::Oscillation(atom)));
            }
        }
        let decaying = offered.split_off(1.min(offered.len()));
        self.keep_best(offered.into_iter());
        self.keep_best(decaying.into_iter());
    }

    /// Oscillations whose frequency changes at a constant rate.
    fn add_drifting(&mut self) {
        let frames = self.residual.len();
        let padded = Self::padded_length(frames);
        let transform = RealTransform::new(padded);
        let energy = self.present.iter().sum::<f64>() / 2.0;
        let mut offered = Vec::new();
        for drift in DRIFTS.into_iter().filter(|drift| *drift < frames as f64 / 8.0) {
            // phase `drift u^2`, u from -1/2 to 1/2
            let (mut cosines, mut sines) = (Vec::with_capacity(frames), Vec::with_capacity(frames));
            // from one frame to the next, the phase grows by an angle that itself grows by a constant angle
            let phasor = |turn: f64| math::sin_cos(TAU * (turn - turn.floor()));
            let width = 1.0 / frames as f64;
            let bend = phasor(2.0 * drift * width * width);
            let (mut turned, mut by) = ((0.0, 1.0), (0.0, 1.0));
            for (i, r) in self.residual.iter().enumerate() {
                if i % ANEW == 0 {
                    let u = (i as f64 + 0.5) * width - 0.5;
                    (turned, by) = (phasor(drift * u * u), phasor(drift * width * (2.0 * u + width)));
                }
                cosines.push(r * turned.1);
                sines.push(r * turned.0);
                turned = add_angles(turned, by);
                by = add_angles(by, bend);
            }
            let a = transform.spectrum_values(cosines.into_iter());
            let b = transform.spectrum_values(sines.into_iter());
            // `sum r exp(-i (w t + phase)) = A - i B`, where `A` and `B` are the transforms of residual times
            // cosine and sine; `A + i B` belongs to the opposite drift
            for sign in [1.0, -1.0] {
                let squares = a.iter().zip(&b).map(|(a, b)| {
                    let (re, im) = (a.re + sign * b.im, a.im - sign * b.re);
                    re * re + im * im
                });
                if let Some((cycles, square)) = self.highest_peak(squares, padded, drift) {
                    // u^2 = (P2(2 u) + 1/2) / 6
                    let phase = vec![sign * drift / 6.0];
                    let atom = OscillationAtom { phase, ..OscillationAtom::steady(cycles) };
                    offered.push((square / energy, Atom::Oscillation(atom)));
                }
            }
        }
        self.keep_best(offered.into_iter());
    }

    /// Decaying oscillations that begin inside the record.
    fn add_late(&mut self) {
        let frames = self.residual.len();
        let mut offered = Vec::new();
        for nepers in LATE_DECAYS {
            let length = ((FILTER_NEPERS * frames as f64 / nepers).ceil() as usize).min(frames);
            if length < 10 {
                continue;
            }
            let padded = Self::padded_length(length);
            let transform = RealTransform::new(padded);
            let envelope: Vec<f64> =
                (0..length).map(|i| math::exp(-nepers * (i as f64 + 0.5) / frames as f64)).collect();
            let step = ((frames as f64 / nepers / ONSETS_PER_DECAY) as usize).max(1);
            let full = dot(&envelope, &envelope);
            let mut best: Option<(f64, Atom)> = None;
            for first in (step..frames.saturating_sub(length / 3)).step_by(step) {
                let part = first..(first + length).min(frames);
                let weights = self.present[part.clone()].iter().zip(&envelope);
                let energy: f64 = weights.map(|(p, e)| p * e * e).sum();
                if energy < 0.3 * full {
                    continue;
                }
                let values = self.residual[part].iter().zip(&envelope).map(|(r, e)| r * e);
                let squares = transform.squared_magnitudes(values);
                // the transform covers a part of the record, but its frequencies count cycles per record
                let cycles = |k: usize| k as f64 * frames as f64 / padded as f64;
                let least = self.band.0.max(nepers / PI);
                let inside = |k: usize| cycles(k) >= least && cycles(k) <= self.band.1;
                let peak =
                    squares.iter().enumerate().filter(|(k, _)| inside(*k)).max_by(|a, b| a.1.total_cmp(b.1));
                let Some((k, square)) = peak else { continue };
                let explained = 2.0 * square / energy;
                if best.as_ref().is_none_or(|(most, _)| explained > *most) {
                    let onset = first as f64 / frames as f64;
                    let atom =
                        OscillationAtom { nepers: Some(nepers), onset, ..OscillationAtom::steady(cycles(k)) };
                    best = Some((explained, Atom::Oscillation(atom)));
                }
            }
            offered.extend(best);
        }
        self.keep_best(offered.into_iter());
    }

    /// Steps and relaxations, from sums over blocks of frames.
    fn add_steps(&mut self, fixed: &Fixed) {
        let frames = self.residual.len();
        let length = frames.div_ceil(BLOCKS);
        let count = frames.div_ceil(length);
        let pool = |values: &[f64]| {
            let mut sums = vec![0.0; count];
            for (i, x) in self.problem.used.iter().zip(values) {
                sums[i / length] += x;
            }
            sums
        };
        let used = pool(&vec![1.0; self.problem.len()]);
        // the variance of a sum over a block is proportional to the number of its frames
        let scale = |sums: Vec<f64>| -> Vec<f64> {
            sums.iter().zip(&used).map(|(sum, n)| if *n > 0.0 { sum / n.sqrt() } else { 0.0 }).collect()
        };
        let mut basis = Basis::default();
        for column in fixed.basis_columns() {
            basis.push_column(scale(pool(column)));
        }
        let residual = scale(pool(self.problem.residual_of(fixed)));
        let root: Vec<f64> = used.iter().map(|n| n.sqrt()).collect();
        // a template is twice as long as the record with its margins, and has the centre or the onset in its
        // middle; the cut of it that has its centre at `block` is a column
        let outside = (OUTSIDE * count as f64) as usize;
        let template = |value: &dyn Fn(f64) -> f64| -> Vec<f64> {
            (0..2 * (count + outside))
                .map(|j| value((j as f64 - (count + outside) as f64 + 0.5) / count as f64))
                .collect()
        };
        let place = |block: usize| (block as f64 - outside as f64) * length as f64 / frames as f64;
        let cut = |template: &[f64], block: usize| -> Vec<f64> {
            template[count + 2 * outside - block..].iter().zip(&root).map(|(x, n)| x * n).collect()
        };
        let of_residual: Vec<f64> = basis.columns.iter().map(|q| dot(q, &residual)).collect();
        let project = |column: Vec<f64>| {
            let along: Vec<f64> = basis.columns.iter().map(|q| dot(q, &column)).collect();
            let length = dot(&column, &column);
            let left = length - dot(&along, &along);
            PooledColumn {
                left: if left > LEAST_LEFT * length { left } else { 0.0 },
                product: dot(&column, &residual) - dot(&along, &of_residual),
                along,
                column,
            }
        };
        let mut steps = Vec::new();
        for width in STEP_WIDTHS.into_iter().filter(|width| *width > 2.0 / frames as f64) {
            let step = template(&|s| math::tanh(s / width));
            let spacing = ((0.5 * width * count as f64) as usize).max(1);
            for block in (1..count + 2 * outside).step_by(spacing) {
                // a step that is further outside than its width is nearly constant in the record
                if !(-width..1.0 + width).contains(&place(block)) {
                    continue;
                }
                let atom = Atom::Step { shape: StepShape::Tanh, centre: place(block), width };
                steps.push((project(cut(&step, block)).own_squares(), atom));
            }
        }
        let mut relaxations = Vec::new();
        let after = template(&|s| f64::from(u8::from(s >= 0.0)));
        let after: Vec<PooledColumn> =
            (outside..outside + count).map(|block| project(cut(&after, block))).collect();
        for nepers in RELAXATIONS {
            let decay = template(&|s| if s >= 0.0 { math::exp(-nepers * s) } else { 0.0 });
            let spacing = ((0.5 / nepers * count as f64) as usize).max(1);
            let last = if nepers < 8.0 { 1 } else { count - count / 16 };
            for block in (0..last).step_by(spacing) {
                let column = project(cut(&decay, outside + block));
                let explained =
                    if block > 0 { column.squares_with(&after[block]) } else { column.own_squares() };
                let onset = place(outside + block);
                relaxations.push((explained, Atom::Relaxation { onset, nepers }));
            }
        }
        self.keep_best(steps.into_iter());
        self.keep_best(relaxations.into_iter());
    }
}

/// Number of frames after which a recurrence of phases begins anew: rounding errors stay below 1e-13.
const ANEW: usize = 64;

/// A column of sums over blocks, with its products with the fixed parts and with the residual.
struct PooledColumn {
    column: Vec<f64>,
    /// Products with the orthonormal columns of the fixed parts.
    along: Vec<f64>,
    /// Squared length of what the fixed parts leave of it; 0 for a column that depends on them.
    left: f64,
    /// Scalar product of the residual with what the fixed parts leave of the column.
    product: f64,
}

/// A column depends on the fixed parts if they leave at most this fraction of its squared length.
const LEAST_LEFT: f64 = 1e-6;

impl PooledColumn {
    /// Sum of squares that the column explains.
    fn own_squares(&self) -> f64 {
        if self.left > 0.0 { self.product * self.product / self.left } else { 0.0 }
    }

    /// Sum of squares that the column and another one explain together.
    fn squares_with(&self, other: &Self) -> f64 {
        if self.left == 0.0 || other.left == 0.0 {
            return self.own_squares() + other.own_squares();
        }
        let common = (dot(&self.column, &other.column) - dot(&self.along, &other.along)) / other.left;
        let left = self.left - common * common * other.left;
        let product = self.product - common * other.product;
        let own = if left > LEAST_LEFT * self.left { product * product / left } else { 0.0 };
        own + other.own_squares()
    }
}
