//! The frames of a record with their noise, and the least squares of its parts. Amplitudes are eliminated
//! (variable projection, Golub and Pereyra 1973), and shape parameters are found by the Levenberg-Marquardt
//! method.

use super::atom::{Atom, FramePlaces};
use super::column_products::ColumnProducts;
use crate::noise::{AutoregressiveNoise, Whitener};
use crate::trend::Trend;
use nalgebra::{DMatrix, DVector};
use portable_math as math;

/// A trend and the other parts of a record.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Parts {
    pub trend: Trend,
    pub atoms: Vec<Atom>,
}

impl Parts {
    /// Number of amplitudes and shape parameters.
    pub(crate) fn parameter_count(&self) -> usize {
        let of_atom = |atom: &Atom| atom.column_count() + atom.parameters().len();
        self.trend.column_count() + self.atoms.iter().map(of_atom).sum::<usize>()
    }
}

/// Fitted parts of a record.
#[derive(Debug, Clone)]
pub(crate) struct Explanation {
    pub parts: Parts,
    /// Negative logarithm of the posterior probability, up to a constant, nats.
    pub criterion: f64,
    /// Sum of the squares of the whitened residuals.
    pub squares: f64,
    /// Whitened residual of each frame used.
    pub residual: Vec<f64>,
    /// Amplitudes of the columns of all atoms, in their order, in units of the scaled record.
    pub amplitudes: Vec<f64>,
}

impl Explanation {
    /// The atoms, each with the amplitudes of its columns.
    pub(crate) fn atoms_with_amplitudes(&self) -> impl Iterator<Item = (&Atom, &[f64])> {
        pair_with_amplitudes(&self.parts.atoms, &self.amplitudes)
    }
}

/// Atoms, each with the amplitudes of its columns, from the amplitudes of the columns of all of them.
fn pair_with_amplitudes<'a>(
    atoms: &'a [Atom],
    amplitudes: &'a [f64],
) -> impl Iterator<Item = (&'a Atom, &'a [f64])> {
    atoms.iter().scan(amplitudes, |left, atom| {
        let (own, others) = left.split_at(atom.column_count());
        *left = others;
        Some((atom, own))
    })
}

/// The frames used of a record, scaled to unit standard deviation, with the colour of their noise.
#[derive(Debug, Clone)]
pub(crate) struct NoisyRecord {
    pub at: FramePlaces,
    /// Indices of the frames used.
    pub used: Vec<usize>,
    /// Their values.
    pub values: Vec<f64>,
    whitener: Option<Whitener>,
    /// Number of coefficients of the noise; 0 for white noise.
    pub order: usize,
    /// Whitened values.
    target: Vec<f64>,
    /// Variance of rounding errors in scaled units: a smaller residual does not lower the criterion further.
    pub(crate) least_variance: f64,
    /// Price of the frames that are left out, nats.
    pub price_left_out: f64,
}

/// A column is dependent if the squared sine of its angle to the columns before it is below this number: what
/// is left of it is rounding error.
const LEAST_INDEPENDENT: f64 = 1e-18;

/// `sum a b` in eight partial sums, of which the processor computes several at a time.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (left, right) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = left.remainder().iter().zip(right.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in left.zip(right) {
        for k in 0..8 {
            sums[k] += a[k] * b[k];
        }
    }
    sums.iter().sum::<f64>() + rest
}

/// Subtracts `factor` times `other` from a column.
fn subtract(column: &mut [f64], factor: f64, other: &[f64]) {
    column.iter_mut().zip(other).for_each(|(x, q)| *x -= factor * q);
}

/// Orthonormal columns.
#[derive(Debug, Clone, Default)]
pub(crate) struct Basis {
    pub columns: Vec<Vec<f64>>,
}

impl Basis {
    /// Subtracts from a column its projection onto the basis.
    pub(crate) fn project_out(&self, column: &mut [f64]) {
        for q in &self.columns {
            subtract(column, dot(q, column), q);
        }
    }

    /// Adds a column without its projection onto the basis, scaled to unit length; a dependent column is not
    /// added.
    pub(crate) fn push_column(&mut self, mut column: Vec<f64>) {
        /// If less than this fraction of the squared length is left, rounding errors of the projection
        /// matter, and it is repeated.
        const LITTLE: f64 = 0.01;
        let before = dot(&column, &column);
        self.project_out(&mut column);
        let mut left = dot(&column, &column);
        if left < LITTLE * before {
            self.project_out(&mut column);
            left = dot(&column, &column);
        }
        if left > LEAST_INDEPENDENT * before && left > 0.0 {
            let norm = left.sqrt();
            column.iter_mut().for_each(|x| *x /= norm);
            self.columns.push(column);
        }
    }
}

/// The trend and the atoms whose shapes stay as they are while others are fitted. Their amplitudes follow the
/// fit.
pub(crate) struct Fixed {
    basis: Basis,
    /// What these parts leave of the whitened values.
    residual: Vec<f64>,
}

impl Fixed {
    pub(crate) fn basis_columns(&self) -> &[Vec<f64>] {
        &self.basis.columns
    }
}

/// Least squares of the amplitudes of some atoms together with fixed parts.
struct Projection {
    /// Columns of each atom, not whitened.
    columns: Vec<Vec<Vec<f64>>>,
    amplitudes: Vec<f64>,
    basis: Basis,
    residual: Vec<f64>,
    squares: f64,
}

impl NoisyRecord {
    /// The frames `used` of a record with `values`, in white noise.
    pub(crate) fn new(frames: usize, used: Vec<usize>, values: Vec<f64>) -> Self {
        let place = |i: &usize| (*i as f64 + 0.5) / frames as f64;
        let at = FramePlaces { places: used.iter().map(place).collect(), frames };
        Self {
            at,
            used,
            target: values.clone(),
            values,
            whitener: None,
            order: 0,
            least_variance: 1e-300,
            price_left_out: 0.0,
        }
    }

    /// The same frames in noise with these autoregressive coefficients.
    pub(crate) fn with_noise(mut self, coefficients: &[f64]) -> Self {
        let noise = AutoregressiveNoise::new(1.0, coefficients.to_vec()).ok();
        let unit = noise.and_then(|noise| {
            AutoregressiveNoise::new(1.0 / noise.innovation_sd(), coefficients.to_vec()).ok()
        });
        self.order = unit.as_ref().map_or(0, |noise| noise.coefficients().len());
        self.whitener = unit
            .filter(|noise| !noise.coefficients().is_empty())
            .map(|noise| Whitener::new(&noise, &self.used));
        self.target = self.whiten_values(self.values.clone());
        self
    }

    /// The problem without the frames for which `leave_out` holds, in white noise; each frame costs `price`
    /// nats.
    pub(crate) fn without_frames(&self, leave_out: impl Fn(usize) -> bool, price: f64) -> Self {
        let kept: Vec<usize> = (0..self.used.len()).filter(|k| !leave_out(self.used[*k])).collect();
        let used = kept.iter().map(|k| self.used[*k]).collect();
        let values = kept.iter().map(|k| self.values[*k]).collect();
        Self {
            price_left_out: self.price_left_out + price * (self.used.len() - kept.len()) as f64,
            least_variance: self.least_variance,
            ..Self::new(self.at.frames, used, values)
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.used.len()
    }

    /// Logarithm of the number of frames used: the unit of prices, nats.
    pub(crate) fn log_frames(&self) -> f64 {
        math::ln(self.used.len().max(2) as f64)
    }

    pub(crate) fn whiten_values(&self, mut column: Vec<f64>) -> Vec<f64> {
        self.whitener.iter().for_each(|whitener| whitener.whiten_column(&mut column));
        column
    }

    /// Columns of the trend.
    pub(crate) fn raw_trend_columns(&self, trend: Trend) -> Vec<Vec<f64>> {
        let mut columns = vec![Vec::with_capacity(self.len()); trend.column_count()];
        let mut row = [0.0; crate::trend::MOST_COLUMNS];
        for s in &self.at.places {
            trend.fill_row(2.0 * s - 1.0, &mut row);
            columns.iter_mut().zip(row).for_each(|(column, x)| column.push(x));
        }
        columns
    }

    /// Whitened columns of the trend.
    fn trend_columns(&self, trend: Trend) -> Vec<Vec<f64>> {
        self.raw_trend_columns(trend).into_iter().map(|column| self.whiten_values(column)).collect()
    }

    /// Fixes the trend and atoms, and computes what they leave of the record.
    pub(crate) fn fix_parts(&self, trend: Trend, atoms: &[Atom]) -> Fixed {
        let mut basis = Basis::default();
        self.trend_columns(trend).into_iter().for_each(|column| basis.push_column(column));
        for atom in atoms {
            atom.columns(&self.at)
                .into_iter()
                .for_each(|column| basis.push_column(self.whiten_values(column)));
        }
        let mut residual = self.target.clone();
        basis.project_out(&mut residual);
        Fixed { basis, residual }
    }

    /// Least squares of the amplitudes of `atoms` together with fixed parts.
    fn project_onto(&self, fixed: &Fixed, atoms: &[Atom]) -> Projection {
        let columns: Vec<Vec<Vec<f64>>> = atoms.iter().map(|atom| atom.columns(&self.at)).collect();
        let flat: Vec<&Vec<f64>> = columns.iter().flatten().collect();
        let mut basis = Basis::default();
        let mut upper = DMatrix::identity(flat.len(), flat.len());
        let mut residual = fixed.residual.clone();
        let mut projections = DVector::zeros(flat.len());
        for (k, column) in flat.iter().enumerate() {
            let mut column = self.whiten_values((*column).clone());
            let before = dot(&column, &column);
            fixed.basis.project_out(&mut column);
            let projected = dot(&column, &column);
            for (j, q) in basis.columns.iter().enumerate() {
                let along = dot(q, &column);
                upper[(j, k)] = along;
                subtract(&mut column, along, q);
            }
            let mut left = dot(&column, &column);
            if left < 1e-4 * before {
                // little of the column is left, so rounding errors are large in it: project a second time
                fixed.basis.project_out(&mut column);
                for (j, q) in basis.columns.iter().enumerate() {
                    let along = dot(q, &column);
                    upper[(j, k)] += along;
                    subtract(&mut column, along, q);
                }
                left = dot(&column, &column);
            }
            if left > LEAST_INDEPENDENT * before && left > 0.0 && projected > 0.0 {
                let norm = left.sqrt();
                column.iter_mut().for_each(|x| *x /= norm);
                upper[(k, k)] = norm;
                projections[k] = dot(&column, &residual);
                subtract(&mut residual, projections[k], &column);
            } else {
                // a dependent column gets no amplitude
                column.iter_mut().for_each(|x| *x = 0.0);
                upper.column_mut(k).fill(0.0);
                upper[(k, k)] = 1.0;
            }
            basis.columns.push(column);
        }
        let amplitudes = upper.solve_upper_triangular(&projections).unwrap_or(projections);
        let squares = dot(&residual, &residual);
        Projection { amplitudes: amplitudes.as_slice().to_vec(), basis, residual, squares, columns }
    }

    /// Whitened derivatives of the atoms by every shape parameter, one column each, without their projections
    /// onto the columns of all parts (Kaufman 1975): amplitudes follow every step.
    fn jacobian(&self, fixed: &Fixed, atoms: &[Atom], at: &Projection) -> Vec<Vec<f64>> {
        let mut jacobian = Vec::new();
        let mut first = 0;
        for (atom, columns) in atoms.iter().zip(&at.columns) {
            let amplitudes = &at.amplitudes[first..first + columns.len()];
            first += columns.len();
            for derivative in atom.derivatives(&self.at, columns, amplitudes) {
                let mut column = self.whiten_values(derivative);
                fixed.basis.project_out(&mut column);
                at.basis.project_out(&mut column);
                jacobian.push(column);
            }
        }
        jacobian
    }

    /// Fits `atoms` together with fixed parts in at most `iterations` steps. Returns the atoms with their sum
    /// of squares, which is infinite if oscillations cancel.
    pub(crate) fn fit_atoms(&self, fixed: &Fixed, atoms: Vec<Atom>, iterations: usize) -> (Vec<Atom>, f64) {
        let (atoms, at) = self.minimise_squares(fixed, atoms, iterations);
        let squares = if self.is_cancelling(&atoms, &at.amplitudes) { f64::INFINITY } else { at.squares };
        (atoms, squares)
    }

    /// Whether an oscillation is far larger than the record, as it is if two oscillations nearly cancel.
    fn is_cancelling(&self, atoms: &[Atom], amplitudes: &[f64]) -> bool {
        /// Largest amplitude relative to the largest value of the record: only oscillations that cancel
        /// exceed it.
        const MOST: f64 = 2.0;
        let largest = self.values.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        pair_with_amplitudes(atoms, amplitudes)
            .any(|(atom, own)| atom.oscillation().is_some() && own.iter().any(|a| a.abs() > MOST * largest))
    }

    /// Levenberg-Marquardt iterations for the shape parameters, with the least squares of the amplitudes in
    /// each.
    fn minimise_squares(
        &self,
        fixed: &Fixed,
        mut atoms: Vec<Atom>,
        iterations: usize,
    ) -> (Vec<Atom>, Projection) {
        /// Factor of the damping after a step that does not lower the sum of squares.
        const RAISE: f64 = 6.0;
        /// Factor of the damping after a step that lowers it.
        const LOWER: f64 = 0.3;
        /// Steps tried with growing damping; if none of them lowers the sum of squares, the fit has ended.
        const TRIES: usize = 5;
        /// Fall of the criterion, nats, below which the fit has ended.
        const SMALL_FALL: f64 = 0.01;
        let small = 2.0 * SMALL_FALL / self.len() as f64;
        let mut at = self.project_onto(fixed, &atoms);
        let mut damping = 1e-3;
        for _ in 0..iterations {
            let jacobian = self.jacobian(fixed, &atoms, &at);
            if jacobian.is_empty() {
                break;
            }
            let n = jacobian.len();
            let gradient = DVector::from_fn(n, |i, _| dot(&jacobian[i], &at.residual));
            let mut normal = DMatrix::zeros(n, n);
            for i in 0..n {
                for j in 0..=i {
                    normal[(i, j)] = dot(&jacobian[i], &jacobian[j]);
                    normal[(j, i)] = normal[(i, j)];
                }
            }
            let mut ended = true;
            for _ in 0..TRIES {
                let mut damped = normal.clone();
                (0..n).for_each(|i| damped[(i, i)] += damping * normal[(i, i)] + f64::MIN_POSITIVE);
                let Some(step) = damped.cholesky().map(|c| c.solve(&gradient)) else {
                    damping *= RAISE;
                    continue;
                };
                let moved = move_atoms(&atoms, step.as_slice());
                if moved.iter().all(|atom| atom.is_usable(self.at.frames)) {
                    let next = self.project_onto(fixed, &moved);
                    if next.squares < at.squares {
                        ended = at.squares - next.squares < small * at.squares;
                        (atoms, at) = (moved, next);
                        damping *= LOWER;
                        break;
                    }
                }
                damping = damping.max(1e-6) * RAISE;
            }
            if ended {
                break;
            }
        }
        (atoms, at)
    }

    /// Fits all parts together in at most `iterations` steps. The criterion is infinite if oscillations
    /// cancel.
    pub(crate) fn fit_parts(&self, parts: &Parts, iterations: usize) -> Explanation {
        let fixed = self.fix_parts(parts.trend, &[]);
        let (atoms, at) = self.minimise_squares(&fixed, parts.atoms.clone(), iterations);
        let parts = Parts { trend: parts.trend, atoms };
        let cancels = self.is_cancelling(&parts.atoms, &at.amplitudes);
        Explanation {
            criterion: if cancels { f64::INFINITY } else { self.criterion(&parts, at.squares) },
            parts,
            squares: at.squares,
            residual: at.residual,
            amplitudes: at.amplitudes,
        }
    }

    /// Negative logarithm of the posterior probability of parts that leave this sum of whitened squares,
    /// nats: the likelihood with the estimated level of the noise, Djurić's penalty and the price of the
    /// frames left out. Infinite for too many parts.
    pub(crate) fn criterion(&self, parts: &Parts, squares: f64) -> f64 {
        /// Smallest number of frames per parameter: with fewer, a fit follows the noise, and the sum of
        /// squares says little about it.
        const FRAMES_PER_PARAMETER: usize = 2;
        if FRAMES_PER_PARAMETER * (parts.parameter_count() + self.order) > self.len() {
            return f64::INFINITY;
        }
        let n = self.len() as f64;
        let linear = (parts.trend.column_count() + self.order) as f64;
        let price = 0.5 * linear + parts.atoms.iter().map(Atom::price).sum::<f64>();
        let determinant = self.whitener.as_ref().map_or(0.0, Whitener::log_determinant);
        self.price_left_out
            + 0.5 * n * math::ln((squares / n).max(self.least_variance))
            + 0.5 * determinant
            + self.log_frames() * price
    }

    /// Values in every frame of the record, used or not, in scaled units: those of the trend, and those of
    /// each atom.
    pub(crate) fn values_everywhere(&self, explanation: &Explanation) -> (Vec<f64>, Vec<Vec<f64>>) {
        let all = FramePlaces {
            places: (0..self.at.frames).map(|i| (i as f64 + 0.5) / self.at.frames as f64).collect(),
            frames: self.at.frames,
        };
        let mut atoms = Vec::new();
        let mut rest = self.values.clone();
        for (atom, amplitudes) in explanation.atoms_with_amplitudes() {
            let sum = |at: &FramePlaces| -> Vec<f64> {
                let columns = atom.columns(at);
                let value = |i: usize| columns.iter().zip(amplitudes).map(|(c, a)| c[i] * a).sum();
                (0..at.places.len()).map(value).collect()
            };
            rest.iter_mut().zip(sum(&self.at)).for_each(|(x, y)| *x -= y);
            atoms.push(sum(&all));
        }
        // the trend is fitted to what the atoms leave
        let columns = self.trend_columns(explanation.parts.trend);
        let whitened = self.whiten_values(rest);
        let n = columns.len();
        let normal = DMatrix::from_fn(n, n, |i, j| dot(&columns[i], &columns[j]));
        let right = DVector::from_fn(n, |i, _| dot(&columns[i], &whitened));
        let trend = normal.cholesky().map_or_else(|| right.clone() * 0.0, |c| c.solve(&right));
        let mut row = [0.0; crate::trend::MOST_COLUMNS];
        let trend_values = all.places.iter().map(|s| {
            explanation.parts.trend.fill_row(2.0 * s - 1.0, &mut row);
            row.iter().zip(trend.iter()).map(|(b, c)| b * c).sum()
        });
        (trend_values.collect(), atoms)
    }

    /// Residual, not whitened, of every frame used here, with parts that were fitted to `fitted`, which uses
    /// only some of these frames.
    pub(crate) fn residual_everywhere(&self, fitted: &NoisyRecord, explanation: &Explanation) -> Vec<f64> {
        let (trend, atoms) = fitted.values_everywhere(explanation);
        let model = |i: usize| trend[i] + atoms.iter().map(|atom| atom[i]).sum::<f64>();
        self.used.iter().zip(&self.values).map(|(i, x)| x - model(*i)).collect()
    }

    /// Products of these columns, after the fixed parts are projected out, with each other and with the
    /// residual of the fixed parts.
    pub(crate) fn multiply_columns(&self, fixed: &Fixed, columns: Vec<Vec<f64>>) -> ColumnProducts {
        /// A column depends on the fixed parts if they leave at most this fraction of its squared length,
        /// which is rounding error.
        const LEAST_NEW: f64 = 1e-12;
        let mut lengths = Vec::with_capacity(columns.len());
        let projected: Vec<Vec<f64>> = columns
            .into_iter()
            .map(|column| {
                let mut column = self.whiten_values(column);
                let before = dot(&column, &column);
                fixed.basis.project_out(&mut column);
                let left = dot(&column, &column);
                lengths.push(if left > LEAST_NEW * before { left.sqrt() } else { 0.0 });
                column
            })
            .collect();
        ColumnProducts::new(&projected, lengths, &fixed.residual)
    }

    /// Fall of the criterion, nats, without the price of columns that explain this much of the sum of squares
    /// that fixed parts leave.
    pub(crate) fn likelihood_gain(&self, fixed: &Fixed, explained: f64) -> f64 {
        let share = explained / dot(&fixed.residual, &fixed.residual).max(1e-300);
        -0.5 * self.len() as f64 * math::ln_1p(-share.clamp(0.0, 1.0 - 1e-9))
    }

    /// Products of the columns of all atoms of an explanation and of their derivatives by the shape
    /// parameters: for each atom its columns, then its derivatives.
    pub(crate) fn products_around(&self, explanation: &Explanation) -> ColumnProducts {
        let fixed = self.fix_parts(explanation.parts.trend, &[]);
        let mut columns = Vec::new();
        for (atom, amplitudes) in explanation.atoms_with_amplitudes() {
            let own = atom.columns(&self.at);
            let slopes = atom.derivatives(&self.at, &own, amplitudes);
            columns.extend(own.into_iter().chain(slopes));
        }
        self.multiply_columns(&fixed, columns)
    }

    /// Whitened residual of fixed parts, one value per frame used.
    pub(crate) fn residual_of<'a>(&self, fixed: &'a Fixed) -> &'a [f64] {
        &fixed.residual
    }
}

/// The atoms after a step; each parameter moves by at most its limit.
fn move_atoms(atoms: &[Atom], step: &[f64]) -> Vec<Atom> {
    let mut steps = step.iter();
    let moved = |atom: &Atom| {
        let limits = atom.step_limits();
        let values = atom.parameters().into_iter().zip(limits).zip(&mut steps);
        let values: Vec<f64> = values.map(|((value, limit), by)| value + by.clamp(-limit, limit)).collect();
        atom.with_parameters(&values)
    };
    atoms.iter().map(moved).collect()
}
