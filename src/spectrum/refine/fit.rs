//! Trend and sinusoids fitted together by weighted least squares.
//!
//! The amplitudes are linear; the frequencies follow by Gauss-Newton steps of what is left (variable projection), each within [`REACH`]
//! of where the transform saw it. A frequency that wants to go further keeps its start. Standard deviations are those of white noise of
//! the rest's size, through the normal matrix of the frames present.

use super::normal::{Columns, Of};
use super::{Deviations, Outcome, Refined, Start};
use nalgebra::{DMatrix, DVector};

/// Farthest a frequency moves, resolutions: half way down the lobe of a Hann window (-6 dB at one resolution, its end at two).
const REACH: f64 = 1.0;
/// Steps; a steady tone takes four, a drifting one a dozen.
const MOST_STEPS: usize = 30;
/// Halvings of a step that raises the misfit.
const MOST_HALVINGS: i32 = 8;
/// A step below this many resolutions is the last.
const SETTLED: f64 = 1e-6;
/// A step that lowers the misfit by a smaller share is the last: of 450 frames that is a thousandth of a deviation, of a million a hundredth.
const FALLS: f64 = 1e-10;
/// Directions of the normal matrix, scaled to a diagonal of ones, below this share of the largest are not in the data.
const SINGULAR: f64 = 1e-10;

/// A record and how its frames count.
pub(super) struct Problem {
    /// The record less its trend, m.
    pub data: Vec<f64>,
    /// Weight of each frame, zero where there is none.
    pub weights: Vec<f64>,
    /// Coefficients of the trend, which is fitted again: sinusoids and trend are not orthogonal.
    pub trend: usize,
}

/// Frequencies on their way.
pub(super) struct Fit {
    starts: Vec<Start>,
    free: Vec<bool>,
    cycles: Vec<f64>,
    /// Trend, then cosine and sine amplitude of each sinusoid, m.
    amplitudes: DVector<f64>,
}

impl Fit {
    pub(super) fn start(starts: &[Start]) -> Self {
        let (free, cycles) = starts.iter().map(|s| (s.free, s.cycles)).unzip();
        Self { starts: starts.to_vec(), free, cycles, amplitudes: DVector::zeros(0) }
    }
}

/// The linear part solved at given frequencies.
struct Solved {
    cycles: Vec<f64>,
    /// Inner products of the columns and the data.
    gram: DMatrix<f64>,
    /// Trend, then cosine and sine amplitude of each sinusoid, m.
    amplitudes: DVector<f64>,
    /// Weighted sum of squares of what is left, m^2.
    misfit: f64,
}

impl Problem {
    /// Moves the free frequencies to where the misfit is least; `None` where the normal matrix is no finite one.
    pub(super) fn solve(&self, mut fit: Fit) -> Option<Fit> {
        let mut solved = self.at(fit.cycles)?;
        for _ in 0..MOST_STEPS {
            let step = self.step(&solved, &fit.free)?;
            let leaves = |k: &usize| (solved.cycles[*k] + step[*k] - fit.starts[*k].cycles).abs() > REACH;
            if let Some(lost) = (0..step.len()).find(leaves) {
                fit.free[lost] = false;
                solved.cycles[lost] = fit.starts[lost].cycles;
                solved = self.at(solved.cycles)?;
                continue;
            }
            let Some(next) = self.descend(&solved, &step) else { break };
            let settled = next.misfit > (1.0 - FALLS) * solved.misfit || step.iter().all(|s| s.abs() < SETTLED);
            solved = next;
            if settled {
                break;
            }
        }
        Some(Fit { cycles: solved.cycles, amplitudes: solved.amplitudes, ..fit })
    }

    /// Trend and sinusoids in every frame, m.
    pub(super) fn model(&self, fit: &Fit) -> Vec<f64> {
        Columns { trend: self.trend, cycles: &fit.cycles }.model(fit.amplitudes.as_slice(), self.data.len())
    }

    /// The amplitudes that leave least at given frequencies.
    fn at(&self, cycles: Vec<f64>) -> Option<Solved> {
        let gram = Columns { trend: self.trend, cycles: &cycles }.gram(&self.data, |i| self.weights[i]);
        let linear = self.linear_columns(cycles.len());
        let last = gram.ncols() - 1;
        let right = gram.column(last).select_rows(&linear);
        let amplitudes = inverse(&gram.select_rows(&linear).select_columns(&linear))? * &right;
        let misfit = gram[(last, last)] - right.dot(&amplitudes);
        Some(Solved { cycles, gram, amplitudes, misfit })
    }

    /// The step, halved until the misfit falls; `None` where it does not.
    fn descend(&self, from: &Solved, step: &[f64]) -> Option<Solved> {
        (0..MOST_HALVINGS).find_map(|halvings| {
            let share = 0.5_f64.powi(halvings);
            let solved = self.at(from.cycles.iter().zip(step).map(|(c, s)| c + share * s).collect())?;
            (solved.misfit < from.misfit).then_some(solved)
        })
    }

    fn linear_columns(&self, sinusoids: usize) -> Vec<usize> {
        let of = |k| [Of::Cosine.column(self.trend, k), Of::Sine.column(self.trend, k)];
        (0..self.trend).chain((0..sinusoids).flat_map(of)).collect()
    }

    /// The unknowns as combinations of the columns: the linear ones, then the frequency of each free sinusoid.
    fn unknowns(&self, solved: &Solved, free: &[bool]) -> DMatrix<f64> {
        let linear = self.linear_columns(free.len());
        let moving: Vec<usize> = (0..free.len()).filter(|k| free[*k]).collect();
        let mut map = DMatrix::zeros(solved.gram.nrows(), linear.len() + moving.len());
        for (unknown, column) in linear.iter().enumerate() {
            map[(*column, unknown)] = 1.0;
        }
        for (place, &k) in moving.iter().enumerate() {
            let [cosine, sine] = self.pair(solved, k);
            map[(Of::CosineSlope.column(self.trend, k), linear.len() + place)] = cosine;
            map[(Of::SineSlope.column(self.trend, k), linear.len() + place)] = sine;
        }
        map
    }

    /// Cosine and sine amplitude of a sinusoid, m.
    fn pair(&self, solved: &Solved, k: usize) -> [f64; 2] {
        [0, 1].map(|part| solved.amplitudes[self.trend + 2 * k + part])
    }

    /// The Gauss-Newton step of each frequency, cycles; zero for one that is held.
    fn step(&self, solved: &Solved, free: &[bool]) -> Option<Vec<f64>> {
        let map = self.unknowns(solved, free);
        let linear = solved.amplitudes.len();
        let mut left = -(map.columns(0, linear) * &solved.amplitudes);
        left[map.nrows() - 1] = 1.0; // what is left, as a combination of the columns: the data less the model
        let towards = map.tr_mul(&(&solved.gram * left));
        let change = inverse(&map.tr_mul(&(&solved.gram * &map)))? * towards;
        let mut moves = change.iter().skip(linear);
        Some(free.iter().map(|free| if *free { moves.next().copied().unwrap_or(0.0) } else { 0.0 }).collect())
    }

    /// Covariance of the unknowns for weights of one and a rest of white noise.
    fn covariance(&self, solved: &Solved, free: &[bool]) -> Option<DMatrix<f64>> {
        let map = self.unknowns(solved, free);
        let freedom = self.weights.iter().sum::<f64>() - map.ncols() as f64;
        let inverse = inverse(&map.tr_mul(&(&solved.gram * &map)))?;
        (freedom > 0.0).then(|| inverse * (solved.misfit.max(0.0) / freedom))
    }

    /// What became of each start; `white` says that the weights are one and the rest is noise, so that deviations follow from it.
    pub(super) fn outcomes(&self, fit: &Fit, white: bool) -> Option<Vec<Outcome>> {
        let solved = self.at(fit.cycles.clone())?;
        let covariance = if white { Some(self.covariance(&solved, &fit.free)?) } else { None };
        let outcome = |k: usize| {
            let [cosine, sine] = self.pair(&solved, k);
            let amplitude_m = cosine.hypot(sine);
            match (fit.starts[k].free, fit.free[k] && amplitude_m > 0.0) {
                (false, _) => Outcome::Kept,
                (true, false) => Outcome::Held(amplitude_m),
                (true, true) => {
                    let deviations = covariance.as_ref().map(|c| self.deviations(c, fit, k, [cosine / amplitude_m, sine / amplitude_m]));
                    Outcome::Refined(Refined { cycles: solved.cycles[k], amplitude_m, deviations })
                }
            }
        };
        Some((0..fit.free.len()).map(outcome).collect())
    }

    /// Deviations of the `k`-th sinusoid, whose amplitude points `along` its cosine and sine.
    fn deviations(&self, covariance: &DMatrix<f64>, fit: &Fit, k: usize, along: [f64; 2]) -> Deviations {
        let place = self.trend + 2 * k;
        let frequency = self.trend + 2 * fit.free.len() + fit.free[..k].iter().filter(|free| **free).count();
        let variance = |i: usize, j: usize| covariance[(place + i, place + j)];
        let amplitude = along[0].powi(2) * variance(0, 0) + 2.0 * along[0] * along[1] * variance(0, 1) + along[1].powi(2) * variance(1, 1);
        Deviations { cycles: covariance[(frequency, frequency)].max(0.0).sqrt(), amplitude_m: amplitude.max(0.0).sqrt() }
    }
}

/// Inverse of a symmetric matrix over the directions that are in the data.
fn inverse(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let scale = matrix.diagonal().map(|x| if x > 0.0 { x.sqrt().recip() } else { 0.0 });
    let scaled = DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)] * scale[i] * scale[j]);
    if scaled.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let eigen = scaled.symmetric_eigen();
    let least = SINGULAR * eigen.eigenvalues.max();
    let inverted = DMatrix::from_diagonal(&eigen.eigenvalues.map(|x| if x > least { x.recip() } else { 0.0 }));
    let inverse = &eigen.eigenvectors * inverted * eigen.eigenvectors.transpose();
    Some(DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| inverse[(i, j)] * scale[i] * scale[j]))
}
