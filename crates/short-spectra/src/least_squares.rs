//! Fit of a trend and (decaying) sinusoids together to the frames present: the most accurate estimate if the
//! record contains nothing else.
//!
//! Model: `x = sum c_p L_p + sum exp(-d_k ((u + 1) / 2 - s_k)) (a_k cos(pi n_k u) + b_k sin(pi n_k u))` with
//! `u` from -1 to 1 over the record, so that `n` is the number of cycles and `d` the decay in nepers over the
//! record; a term is zero before its start `s`. Amplitudes are linear and solved for at every step. Cycles
//! and nepers move by Gauss-Newton steps, halved until the misfit falls. All computations use inner products
//! of columns, which are summed once per step.

mod columns;

use super::trend::Trend;
use columns::{COLUMNS_WITH_SLOPES, FixedColumns, QUADRATURE_COLUMNS, TermColumn};
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use portable_math as math;
use std::f64::consts::{PI, TAU};
use std::rc::Rc;

/// Largest allowed shift, in resolutions, of the frequency of a steady term during a fit: half way down the
/// lobe of a Hann window (-6 dB at one resolution; the lobe ends at two).
const MOST_FREQUENCY_SHIFT: f64 = 1.0;
/// Maximum number of halvings of a step that raises the misfit.
const MOST_HALVINGS: i32 = 8;
/// The fit ends with a step that changes all cycles and nepers by less than this.
const SMALLEST_STEP: f64 = 1e-6;
/// Limit of the ratio of an eigenvalue of the normal matrix, scaled to a unit diagonal, to the largest
/// eigenvalue. If the ratio is at most this limit, the data do not determine the direction of the
/// eigenvector.
const SINGULAR_DIRECTION: f64 = 1e-10;
/// Limit of the squared pivots of the normal matrix, scaled to a unit diagonal. If all of them exceed it, the
/// data determine all directions: each column then keeps at least a thousandth of its length perpendicular to
/// the columns before it.
const WELL_POSED_PIVOT: f64 = 1e-6;
/// Largest allowed growth, in nepers, of an oscillation over the record: a growth by a factor of 400 is a
/// transient at the end of the record.
const MOST_GROWTH: f64 = 6.0;
/// Largest allowed damping ratio of an oscillation: above a half, almost nothing is left of it after one
/// cycle.
const MOST_DAMPING: f64 = 0.5;
/// Largest allowed decay, in nepers, of a relaxation over the record: the relaxation is over within a
/// hundredth of the record.
const MOST_RELAXED: f64 = 500.0;
/// Largest allowed growth, in nepers, of a relaxation over the record; the squares of a larger growth would
/// come near the largest floating-point number.
const MOST_RELAXED_AT_END: f64 = 330.0;

/// Parameters of a term that a fit moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FreeSet {
    Amplitude,
    Cycles,
    Both,
    /// Only the decay, in addition to the amplitude; for example for a relaxation, which has no cycles.
    Nepers,
}

impl FreeSet {
    fn moves_cycles(self) -> bool {
        matches!(self, Self::Cycles | Self::Both)
    }

    fn moves_nepers(self) -> bool {
        matches!(self, Self::Nepers | Self::Both)
    }

    /// Number of parameters that the fit moves, not counting the amplitudes.
    pub(super) fn count(self) -> usize {
        usize::from(self.moves_cycles()) + usize::from(self.moves_nepers())
    }
}

/// A sinusoid, decaying or not; if it has no cycles, a relaxation (a decaying exponential).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SineTerm {
    /// Cycles in the record.
    pub cycles: f64,
    /// Decay over the record, nepers.
    pub nepers: f64,
    /// First frame in which the term is present.
    pub first: usize,
    /// Parameters that a fit moves.
    pub free: FreeSet,
}

impl SineTerm {
    /// A term that is present from the first frame on.
    pub(super) fn from_start(cycles: f64, nepers: f64, free: FreeSet) -> Self {
        Self { cycles, nepers, first: 0, free }
    }

    /// Smallest and largest decay, in nepers, that a fit may reach.
    pub(super) fn nepers_bounds(&self) -> (f64, f64) {
        if self.cycles == 0.0 {
            (-MOST_RELAXED_AT_END, MOST_RELAXED)
        } else {
            (-MOST_GROWTH, nepers_from_damping_ratio(self.cycles, MOST_DAMPING))
        }
    }
}

/// Nepers over a record of `cycles` cycles for a damping ratio: `2 pi n zeta / sqrt(1 - zeta^2)`.
pub(super) fn nepers_from_damping_ratio(cycles: f64, damping_ratio: f64) -> f64 {
    TAU * cycles * damping_ratio / (1.0 - damping_ratio * damping_ratio).sqrt()
}

/// Relative decrease of the misfit below which the iteration ends. If only noise is left, such a step moves
/// a parameter by at most 0.0002 standard deviations for 450 frames, and by at most 0.01 for a million.
const LEAST_DECREASE: f64 = 1e-10;
/// Maximum number of steps: a steady tone takes four, a drifting tone a dozen; for a signal that is not a
/// sinusoid, the steps may never converge.
const MOST_STEPS: usize = 30;

/// A record with the weights of its frames, and its trend. The trend is fitted together with the sinusoids,
/// because it is not orthogonal to them.
#[derive(Debug, Clone)]
pub(super) struct SineProblem {
    pub trend: Trend,
    /// Sum of the weights.
    pub weight: f64,
    frames: usize,
    columns: Rc<FixedColumns>,
}

#[derive(Debug, Clone)]
pub(super) struct SineSolution {
    pub terms: Vec<SineTerm>,
    /// Coefficients of the trend, then cosine and sine amplitude of each term, m. The phase is counted from
    /// the middle of the record; the amplitude is that at the start of the envelope.
    pub amplitudes: DVector<f64>,
    /// Weighted sum of squares of the residual, m^2.
    pub misfit: f64,
}

impl SineProblem {
    /// A record, m, with the weight of each frame, which is zero for a missing frame.
    pub(super) fn new(data: &[f64], weights: &[f64], trend: Trend) -> Self {
        let columns = Rc::new(FixedColumns::new(trend, data, weights));
        Self { trend, weight: weights.iter().sum(), frames: data.len(), columns }
    }

    /// Minimises the misfit over the free parameters; `None` if the normal matrix is not finite. A term whose
    /// step would leave its peak returns to the peak and keeps that frequency. A term that would decay or
    /// grow beyond its bounds becomes steady, or keeps its decay if only the decay was free.
    pub(super) fn gauss_newton(&self, terms: &[SineTerm]) -> Option<SineSolution> {
        let mut solved = self.solve_amplitudes(terms.to_vec())?;
        for _ in 0..MOST_STEPS {
            let step = self.gauss_newton_step(&solved)?;
            let constrain = |k: usize| Some((k, constrain_step(&terms[k], &solved.terms[k], step[k])?));
            if let Some((k, constrained)) = (0..terms.len()).find_map(constrain) {
                let mut held = solved.terms;
                held[k] = constrained;
                solved = self.solve_amplitudes(held)?;
                continue;
            }
            let Some(next) = self.halve_until_descent(&solved, &step) else { break };
            let settled = next.misfit > (1.0 - LEAST_DECREASE) * solved.misfit
                || step.iter().flatten().all(|s| s.abs() < SMALLEST_STEP);
            solved = next;
            if settled {
                break;
            }
        }
        Some(solved)
    }

    /// The trend in every frame, m.
    pub(super) fn trend_values(&self, solved: &SineSolution) -> Vec<f64> {
        self.trend.values(&solved.amplitudes.as_slice()[..self.trend.column_count()], self.frames)
    }

    /// A term in every frame, m.
    pub(super) fn term_values(&self, solved: &SineSolution, k: usize) -> Vec<f64> {
        columns::term_values(&solved.terms[k], self.amplitude_pair(solved, k), self.frames)
    }

    /// Trend and terms in every frame, m.
    pub(super) fn model_values(&self, solved: &SineSolution) -> Vec<f64> {
        let mut model = self.trend_values(solved);
        for k in 0..solved.terms.len() {
            model.iter_mut().zip(self.term_values(solved, k)).for_each(|(sum, value)| *sum += value);
        }
        model
    }

    /// Cosine and sine amplitude of a term, m.
    pub(super) fn amplitude_pair(&self, solved: &SineSolution, k: usize) -> [f64; 2] {
        [0, 1].map(|part| solved.amplitudes[self.trend.column_count() + 2 * k + part])
    }

    /// Number of fitted parameters.
    pub(super) fn unknown_count(&self, terms: &[SineTerm]) -> usize {
        let amplitudes = |t: &SineTerm| if t.cycles == 0.0 { 1 } else { 2 };
        self.trend.column_count() + terms.iter().map(|t| amplitudes(t) + t.free.count()).sum::<usize>()
    }

    /// The amplitudes that minimise the misfit for given terms.
    pub(super) fn solve_amplitudes(&self, terms: Vec<SineTerm>) -> Option<SineSolution> {
        let gram = self.columns.gram_matrix::<QUADRATURE_COLUMNS>(&terms);
        let last = gram.ncols() - 1;
        let right = gram.column(last).rows(0, last).into_owned();
        let amplitudes = pseudo_inverse(&gram.view((0, 0), (last, last)).into_owned())? * &right;
        let misfit = gram[(last, last)] - right.dot(&amplitudes);
        Some(SineSolution { terms, amplitudes, misfit })
    }

    /// The solution after a step that is halved until the misfit falls; `None` if it does not fall.
    fn halve_until_descent(&self, from: &SineSolution, step: &[[f64; 2]]) -> Option<SineSolution> {
        (0..MOST_HALVINGS).find_map(|halvings| {
            let share = math::powi(0.5, halvings);
            let moved = |(t, s): (&SineTerm, &[f64; 2])| SineTerm {
                cycles: t.cycles + share * s[0],
                nepers: t.nepers + share * s[1],
                ..*t
            };
            let solved = self.solve_amplitudes(from.terms.iter().zip(step).map(moved).collect())?;
            (solved.misfit < from.misfit).then_some(solved)
        })
    }

    /// Derivatives of the model with respect to the unknowns, as combinations of the columns: first the
    /// linear unknowns, then cycles and nepers of each term if they are free.
    fn unknowns_matrix(&self, solved: &SineSolution) -> DMatrix<f64> {
        let trend = self.trend.column_count();
        let pair = |k| [TermColumn::Cosine, TermColumn::Sine].map(|column| column.column_index(trend, k));
        let linear: Vec<usize> = (0..trend).chain((0..solved.terms.len()).flat_map(pair)).collect();
        let moving: usize = solved.terms.iter().map(|t| t.free.count()).sum();
        let columns = trend + COLUMNS_WITH_SLOPES * solved.terms.len() + 1;
        let mut map = DMatrix::zeros(columns, linear.len() + moving);
        for (unknown, column) in linear.iter().enumerate() {
            map[(*column, unknown)] = 1.0;
        }
        let mut place = linear.len();
        for (k, term) in solved.terms.iter().enumerate() {
            let [cosine, sine] = self.amplitude_pair(solved, k);
            let mut add =
                |of: TermColumn, place: usize, value: f64| map[(of.column_index(trend, k), place)] = value;
            if term.free.moves_cycles() {
                add(TermColumn::CosineSlope, place, cosine);
                add(TermColumn::SineSlope, place, sine);
                place += 1;
            }
            if term.free.moves_nepers() {
                // derivative of exp(-d ((u + 1) / 2 - s)): s - (u + 1) / 2 times the term; the slopes are
                // -pi u sin and pi u cos
                let since = term.first as f64 / self.frames as f64 - 0.5;
                add(TermColumn::Cosine, place, since * cosine);
                add(TermColumn::Sine, place, since * sine);
                add(TermColumn::SineSlope, place, -cosine / (2.0 * PI));
                add(TermColumn::CosineSlope, place, sine / (2.0 * PI));
                place += 1;
            }
        }
        map
    }

    /// The Gauss-Newton step of cycles and nepers of each term; zero for fixed parameters.
    fn gauss_newton_step(&self, solved: &SineSolution) -> Option<Vec<[f64; 2]>> {
        let map = self.unknowns_matrix(solved);
        let gram = self.columns.gram_matrix::<COLUMNS_WITH_SLOPES>(&solved.terms);
        let linear = solved.amplitudes.len();
        let mut left = -(map.columns(0, linear) * &solved.amplitudes);
        left[map.nrows() - 1] = 1.0; // the residual as a combination of the columns: the data less the model
        let towards = map.tr_mul(&(&gram * left));
        let change = pseudo_inverse(&map.tr_mul(&(&gram * &map)))? * towards;
        let mut moves = change.iter().skip(linear).copied();
        let mut take = |free: bool| if free { moves.next().unwrap_or(0.0) } else { 0.0 };
        let mut step = |t: &SineTerm| [take(t.free.moves_cycles()), take(t.free.moves_nepers())];
        Some(solved.terms.iter().map(&mut step).collect())
    }

    /// Covariance of the unknowns for a residual of unit white noise, and the indices of each term's unknowns
    /// in it.
    pub(super) fn covariance(&self, solved: &SineSolution) -> Option<SineCovariance> {
        let map = self.unknowns_matrix(solved);
        let gram = self.columns.gram_matrix::<COLUMNS_WITH_SLOPES>(&solved.terms);
        let matrix = pseudo_inverse(&map.tr_mul(&(gram * &map)))?;
        let mut next = solved.amplitudes.len();
        let mut take = |free: bool| {
            let place = free.then_some(next);
            next += usize::from(free);
            place
        };
        let place = |(k, t): (usize, &SineTerm)| UnknownIndices {
            amplitudes: self.trend.column_count() + 2 * k,
            cycles: take(t.free.moves_cycles()),
            nepers: take(t.free.moves_nepers()),
        };
        Some(SineCovariance { matrix, places: solved.terms.iter().enumerate().map(place).collect() })
    }
}

/// Covariance of all fitted unknowns.
pub(super) struct SineCovariance {
    matrix: DMatrix<f64>,
    places: Vec<UnknownIndices>,
}

struct UnknownIndices {
    amplitudes: usize,
    cycles: Option<usize>,
    nepers: Option<usize>,
}

/// Standard deviations of one term for white noise of variance one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TermDeviations {
    /// Standard deviation of the cycles in the record; 0 if the fit does not change the cycles.
    pub cycles: f64,
    /// Standard deviation of the nepers over the record; 0 if the fit does not change the nepers.
    pub nepers: f64,
    pub amplitude: f64,
}

impl SineCovariance {
    /// The standard deviations of term `k`, whose cosine and sine amplitudes are `pair`.
    pub(super) fn deviations(&self, k: usize, pair: [f64; 2]) -> TermDeviations {
        let place = &self.places[k];
        let size = math::hypot(pair[0], pair[1]).max(f64::MIN_POSITIVE);
        let along = pair.map(|part| part / size);
        let variance = |i: usize, j: usize| self.matrix[(place.amplitudes + i, place.amplitudes + j)];
        let amplitude = math::powi(along[0], 2) * variance(0, 0)
            + 2.0 * along[0] * along[1] * variance(0, 1)
            + math::powi(along[1], 2) * variance(1, 1);
        let of = |place: Option<usize>| place.map_or(0.0, |i| self.matrix[(i, i)].max(0.0).sqrt());
        let amplitude = amplitude.max(0.0).sqrt();
        TermDeviations { cycles: of(place.cycles), nepers: of(place.nepers), amplitude }
    }
}

/// The term to continue with if a step would move a term out of its peak or its bounds; `None` if the step is
/// permitted.
fn constrain_step(start: &SineTerm, now: &SineTerm, step: [f64; 2]) -> Option<SineTerm> {
    let width = now.nepers.abs() / TAU; // the width of a peak grows with its decay
    if (now.cycles + step[0] - start.cycles).abs() > MOST_FREQUENCY_SHIFT + width {
        let decays = now.free == FreeSet::Both;
        let free = if decays { FreeSet::Nepers } else { FreeSet::Amplitude };
        return Some(SineTerm { cycles: start.cycles, free, ..*now });
    }
    let (low, high) = now.nepers_bounds();
    let beyond = !(low..=high).contains(&(now.nepers + step[1]));
    beyond.then_some(match now.free {
        FreeSet::Both => SineTerm { nepers: 0.0, free: FreeSet::Cycles, ..*now },
        _ => SineTerm { free: FreeSet::Amplitude, ..*now },
    })
}

/// Maximum number of iterations of an eigenvalue decomposition; one that converges takes a few per row.
const MOST_ITERATIONS: usize = 10_000;

/// Inverse of a symmetric matrix over the directions that the data determine.
fn pseudo_inverse(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    if matrix.is_empty() {
        return Some(matrix.clone()); // neither a trend nor a term
    }
    let scale = matrix.diagonal().map(|x| if x > 0.0 { x.sqrt().recip() } else { 0.0 });
    let scaled = DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| {
        // a zero column, such as the sine of a relaxation, is decoupled from the others
        if i == j && scale[i] == 0.0 { 1.0 } else { matrix[(i, j)] * scale[i] * scale[j] }
    });
    if scaled.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let back = |inverse: &DMatrix<f64>| {
        DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| inverse[(i, j)] * scale[i] * scale[j])
    };
    // eigenvalues take ten times as long and are needed only if directions are undetermined
    if let Some(factor) = scaled.clone().cholesky() {
        let pivots = factor.l_dirty().diagonal();
        if pivots.iter().all(|pivot| pivot * pivot > WELL_POSED_PIVOT) {
            return Some(back(&factor.inverse()));
        }
    }
    let eigen = SymmetricEigen::try_new(scaled, f64::EPSILON, MOST_ITERATIONS)?;
    let least = SINGULAR_DIRECTION * eigen.eigenvalues.max();
    let inverted =
        DMatrix::from_diagonal(&eigen.eigenvalues.map(|x| if x > least { x.recip() } else { 0.0 }));
    Some(back(&(&eigen.eigenvectors * inverted * eigen.eigenvectors.transpose())))
}
