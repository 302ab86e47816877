//! Four classical estimators of the frequencies in a short real record, to stand beside ours in a table.
//!
//! Each takes samples (a missing one is `None`) and the sampling rate in Hz, and returns the frequencies
//! in Hz that it lists, strongest first. None is told the noise or the number of tones.

use nalgebra::{Complex, DMatrix, DVector, Schur, SymmetricEigen};
use std::f64::consts::{PI, TAU};

/// The form that every estimator has: samples and rate in Hz to frequencies in Hz.
pub type Method = fn(&[Option<f64>], f64) -> Vec<f64>;

/// The estimators with the names that the table gives them.
pub const METHODS: [(&str, Method); 4] =
    [("ESPRIT", esprit), ("MUSIC", music), ("multitaper F", multitaper), ("Lomb-Scargle", lomb_scargle)];

/// Rows of the Hankel matrix of `esprit` and `music`.
const WINDOW: usize = 150;
/// Most poles that the description length may choose (a real tone has two).
const MOST_POLES: usize = 24;
/// Fewest cycles in the record that a listed frequency may have.
const FEWEST_CYCLES: f64 = 3.0;
/// Fewest samples that any of the methods works on.
const FEWEST_SAMPLES: usize = 64;
/// Tapers of `multitaper`.
const TAPERS: usize = 7;
/// Most tones that `lomb_scargle` takes.
const MOST_TONES: usize = 8;
/// Chance that noise alone gives a record with a line.
const FALSE_ALARM: f64 = 0.01;

/// TLS-ESPRIT (Roy and Kailath, 1989) on the forward Hankel matrix of the record less a cubic.
///
/// The order is that of `signal_space`. The rows are taken forward only, since a decaying tone
/// reversed is a growing one and would need poles of its own.
pub fn esprit(samples: &[Option<f64>], rate_hz: f64) -> Vec<f64> {
    let Some(record) = flattened(samples) else { return Vec::new() };
    let Some(space) = signal_space(&record) else { return Vec::new() };
    let length = record.len() as f64;
    let mut poles = Vec::new();
    for pole in rotation_poles(&space).unwrap_or_default() {
        let (decay, omega) = (-pole.norm().ln(), pole.arg());
        let steady = decay <= 0.5 * decay.hypot(omega) && -decay * length <= 6.0;
        if steady && omega < PI * (1.0 - 1e-9) && omega * length >= TAU * FEWEST_CYCLES {
            poles.push((decay, omega));
        }
    }
    by_amplitude(&record, &poles).iter().map(|omega| omega * rate_hz / TAU).collect()
}

/// Spectral MUSIC (Schmidt, 1986) with the covariance and the order of `esprit`.
///
/// As many of the highest peaks are kept as the order has pairs; each is refined by a parabola through
/// the logarithm of the pseudospectrum, and amplitudes by least squares give the order of the list.
pub fn music(samples: &[Option<f64>], rate_hz: f64) -> Vec<f64> {
    let Some(record) = flattened(samples) else { return Vec::new() };
    let Some(space) = signal_space(&record) else { return Vec::new() };
    let size = (32 * space.nrows()).next_power_of_two();
    let mut left = vec![space.nrows() as f64; size / 2];
    for vector in space.column_iter() {
        let vector: Vec<f64> = vector.iter().copied().collect();
        left.iter_mut().zip(fourier(&vector, size)).for_each(|(left, value)| *left -= value.norm_sqr());
    }
    let height: Vec<f64> = left.iter().map(|left| -left.max(1e-12).ln()).collect();
    let first = (FEWEST_CYCLES * size as f64 / record.len() as f64).ceil() as usize;
    let mut peaks = peaks(&height, first);
    peaks.truncate(space.ncols().div_ceil(2));
    let poles: Vec<(f64, f64)> = peaks.iter().map(|&(at, _)| (0.0, TAU * at / size as f64)).collect();
    by_amplitude(&record, &poles).iter().map(|omega| omega * rate_hz / TAU).collect()
}

/// Thomson's (1982) harmonic F-test with the sine tapers of Riedel and Sidorenko (1995).
///
/// The ratio has 2 and 2K - 2 = 12 degrees of freedom, for which noise exceeds F with the chance
/// (1 + F / 6)^-6. A line is a peak of F whose chance is below 0.01 over the number of trials: the
/// frequencies of the record's own resolution, times four since F is searched between them too.
pub fn multitaper(samples: &[Option<f64>], rate_hz: f64) -> Vec<f64> {
    let Some(record) = flattened(samples) else { return Vec::new() };
    let size = (8 * record.len()).next_power_of_two();
    let span = (record.len() + 1) as f64;
    let mut sums = Vec::with_capacity(TAPERS);
    let mut spectra = Vec::with_capacity(TAPERS);
    for order in 1..=TAPERS {
        let taper = |at: usize| (2.0 / span).sqrt() * (PI * (order * (at + 1)) as f64 / span).sin();
        sums.push((0..record.len()).map(taper).sum::<f64>());
        let tapered: Vec<f64> = record.iter().enumerate().map(|(at, value)| value * taper(at)).collect();
        spectra.push(fourier(&tapered, size));
    }
    let gain: f64 = sums.iter().map(|sum| sum * sum).sum();
    let half = (TAPERS - 1) as f64;
    let mut ratio = vec![0.0; size / 2];
    let mut line = vec![0.0; size / 2];
    for at in 0..size / 2 {
        let pairs = || spectra.iter().map(|spectrum| spectrum[at]).zip(&sums);
        let amplitude = pairs().map(|(value, &sum)| value * sum).sum::<Complex<f64>>() / gain;
        let rest: f64 = pairs().map(|(value, &sum)| (value - amplitude * sum).norm_sqr()).sum();
        line[at] = amplitude.norm();
        ratio[at] = (half * line[at] * line[at] * gain / rest.max(f64::MIN_POSITIVE)).max(1e-12).ln();
    }
    let trials = 4.0 * record.len() as f64 / 2.0;
    let level = (half * ((FALSE_ALARM / trials).powf(-1.0 / half) - 1.0)).ln();
    let first = (FEWEST_CYCLES * size as f64 / record.len() as f64).ceil() as usize;
    let mut lines = peaks(&ratio, first);
    lines.retain(|&(_, value)| value > level);
    lines.sort_by(|a, b| {
        line[b.0.round() as usize % line.len()].total_cmp(&line[a.0.round() as usize % line.len()])
    });
    lines.iter().map(|&(at, _)| at * rate_hz / size as f64).collect()
}

/// Least-squares periodogram (Lomb, 1976; Scargle, 1982), one tone after another.
///
/// A cubic and the tones found before are fitted jointly with each trial frequency. The highest peak is
/// refined by Gauss-Newton together with the others, until none passes the false-alarm level of
/// Baluev (2008). Slow tones are taken too, but not listed; missing samples are left out.
pub fn lomb_scargle(samples: &[Option<f64>], rate_hz: f64) -> Vec<f64> {
    let Some(filled) = filled(samples) else { return Vec::new() };
    let length = filled.len();
    let mask: Vec<f64> = samples.iter().map(|sample| f64::from(u8::from(sample.is_some()))).collect();
    let record: Vec<f64> = filled.iter().zip(&mask).map(|(value, mask)| value * mask).collect();
    let count: f64 = mask.iter().sum();
    let mut tones: Vec<f64> = Vec::new();
    while tones.len() < MOST_TONES {
        let free = count - 4.0 - 3.0 * tones.len() as f64;
        let Some((omega, share)) = highest(&record, &mask, &tones) else { break };
        let chance = 0.5 * length as f64 * (PI / 3.0).sqrt();
        let chance = chance * (1.0 - share).powf((free - 3.0) / 2.0) * (free * share / 2.0).sqrt();
        if chance.is_nan() || chance > FALSE_ALARM {
            break;
        }
        tones.push(omega);
        refine(&record, &mask, &mut tones);
    }
    let Some((weights, _)) = fit(&tone_columns(&mask, &tones), &record) else { return Vec::new() };
    let mut list: Vec<(f64, f64)> = Vec::new();
    for (at, &omega) in tones.iter().enumerate() {
        if omega * length as f64 >= TAU * FEWEST_CYCLES && omega < PI {
            list.push((omega, weights[4 + 2 * at].hypot(weights[5 + 2 * at])));
        }
    }
    portable_math::sort_by_number(&mut list, |a| -a.1);
    list.iter().map(|tone| tone.0 * rate_hz / TAU).collect()
}

/// The record with the mean in place of missing samples, less that mean; nothing if it is too short.
fn filled(samples: &[Option<f64>]) -> Option<Vec<f64>> {
    let known: Vec<f64> = samples.iter().flatten().copied().collect();
    if known.len() < FEWEST_SAMPLES || known.iter().any(|value| !value.is_finite()) {
        return None;
    }
    let mean = known.iter().sum::<f64>() / known.len() as f64;
    Some(samples.iter().map(|sample| sample.map_or(0.0, |value| value - mean)).collect())
}

/// The filled record less the cubic that fits it best.
fn flattened(samples: &[Option<f64>]) -> Option<Vec<f64>> {
    let record = filled(samples)?;
    let (_, rest) = fit(&tone_columns(&vec![1.0; record.len()], &[]), &record)?;
    Some(rest)
}

/// Weights of the columns that fit the record best by least squares, and what they leave of it.
fn fit(columns: &[Vec<f64>], record: &[f64]) -> Option<(Vec<f64>, Vec<f64>)> {
    let mut design = DMatrix::from_fn(record.len(), columns.len(), |row, column| columns[column][row]);
    let norms: Vec<f64> = design.column_iter().map(|column| column.norm().max(1e-300)).collect();
    design.column_iter_mut().zip(&norms).for_each(|(mut column, norm)| column /= *norm);
    let record = DVector::from_column_slice(record);
    let ridge = DMatrix::identity(columns.len(), columns.len()) * 1e-12;
    let solution = (design.tr_mul(&design) + ridge).cholesky()?.solve(&design.tr_mul(&record));
    let rest = record - &design * &solution;
    let weights = solution.iter().zip(&norms).map(|(weight, norm)| weight / norm).collect();
    Some((weights, rest.iter().copied().collect()))
}

/// Columns of a cubic (in Legendre's form), then the cosine and sine of each tone, where samples are known.
fn tone_columns(mask: &[f64], tones: &[f64]) -> Vec<Vec<f64>> {
    let last = (mask.len() - 1) as f64;
    let column = |value: &dyn Fn(f64) -> f64| -> Vec<f64> {
        mask.iter().enumerate().map(|(at, mask)| mask * value(at as f64)).collect()
    };
    let place = |at: f64| 2.0 * at / last - 1.0;
    let mut columns = vec![mask.to_vec(), column(&place)];
    columns.push(column(&|at| 1.5 * place(at).powi(2) - 0.5));
    columns.push(column(&|at| 2.5 * place(at).powi(3) - 1.5 * place(at)));
    for &omega in tones {
        columns.push(column(&|at| (omega * at).cos()));
        columns.push(column(&|at| (omega * at).sin()));
    }
    columns
}

/// Eigenvectors of the forward Hankel covariance that span the signal; nothing if there is none.
///
/// Their number minimises the description length of Wax and Kailath (1985).
fn signal_space(record: &[f64]) -> Option<DMatrix<f64>> {
    let rows = WINDOW.min(record.len() / 3);
    let shots = record.len() - rows + 1;
    let mut covariance = DMatrix::zeros(rows, rows);
    for lag in 0..rows {
        let mut sum: f64 = (0..shots).map(|at| record[at] * record[at + lag]).sum();
        for row in 0..rows - lag {
            covariance[(row, row + lag)] = sum / shots as f64;
            covariance[(row + lag, row)] = sum / shots as f64;
            if row + lag + 1 < rows {
                sum += record[row + shots] * record[row + lag + shots] - record[row] * record[row + lag];
            }
        }
    }
    let eigen = SymmetricEigen::try_new(covariance, f64::EPSILON, 100 * rows)?;
    let mut order: Vec<usize> = (0..rows).collect();
    portable_math::sort_by_number(&mut order, |&a| -eigen.eigenvalues[a]);
    let floor = eigen.eigenvalues[order[0]] * 1e-14;
    let values: Vec<f64> = order.iter().map(|&at| eigen.eigenvalues[at].max(floor)).collect();
    if values[0].is_nan() || values[0] <= 0.0 {
        return None;
    }
    let length = |poles: usize| {
        let rest = (rows - poles) as f64;
        let mean = values[poles..].iter().sum::<f64>() / rest;
        let spread = rest * mean.ln() - values[poles..].iter().map(|value| value.ln()).sum::<f64>();
        shots as f64 * spread + 0.5 * (poles * (2 * rows - poles)) as f64 * (shots as f64).ln()
    };
    let poles = (0..=MOST_POLES.min(rows / 2)).min_by(|&a, &b| length(a).total_cmp(&length(b)))?;
    (poles > 0).then(|| eigen.eigenvectors.select_columns(&order[..poles]))
}

/// Poles of the rotation between the space without its last row and without its first, by total least
/// squares.
fn rotation_poles(space: &DMatrix<f64>) -> Option<Vec<Complex<f64>>> {
    let (rows, poles) = space.shape();
    let mut both = DMatrix::zeros(rows - 1, 2 * poles);
    both.columns_mut(0, poles).copy_from(&space.rows(0, rows - 1));
    both.columns_mut(poles, poles).copy_from(&space.rows(1, rows - 1));
    let eigen = SymmetricEigen::try_new(both.tr_mul(&both), f64::EPSILON, 200 * poles)?;
    let mut order: Vec<usize> = (0..2 * poles).collect();
    portable_math::sort_by_number(&mut order, |&a| eigen.eigenvalues[a]);
    let least = eigen.eigenvectors.select_columns(&order[..poles]);
    let upper = least.rows(0, poles).into_owned();
    let lower = least.rows(poles, poles).into_owned();
    let rotation = -upper * lower.try_inverse()?;
    if rotation.iter().any(|value| !value.is_finite()) {
        return None;
    }
    let values = Schur::try_new(rotation, f64::EPSILON, 1000 * poles)?.complex_eigenvalues();
    Some(values.iter().copied().collect())
}

/// Angular frequencies of poles (decay and angle a sample), by their greatest amplitude in the record.
fn by_amplitude(record: &[f64], poles: &[(f64, f64)]) -> Vec<f64> {
    let mut columns = Vec::new();
    for &(decay, omega) in poles {
        // A growing tone is measured from the last sample, so that its column stays within 1.
        let origin = if decay < 0.0 { (record.len() - 1) as f64 } else { 0.0 };
        for quarter in [0.0, 0.25] {
            let value = |at: f64| (-decay * (at - origin)).exp() * (omega * at - TAU * quarter).cos();
            columns.push((0..record.len()).map(|at| value(at as f64)).collect());
        }
    }
    let Some((weights, _)) = fit(&columns, record) else { return Vec::new() };
    let pairs = poles.iter().zip(weights.chunks_exact(2));
    let mut list: Vec<(f64, f64)> = pairs.map(|(pole, pair)| (pole.1, pair[0].hypot(pair[1]))).collect();
    portable_math::sort_by_number(&mut list, |a| -a.1);
    list.iter().map(|tone| tone.0).collect()
}

/// Peaks of a curve from an index on, highest first: place (refined by a parabola) and height.
fn peaks(curve: &[f64], first: usize) -> Vec<(f64, f64)> {
    let mut list = Vec::new();
    for at in first.max(1)..curve.len().saturating_sub(1) {
        let (left, here, right) = (curve[at - 1], curve[at], curve[at + 1]);
        if here > left && here >= right {
            list.push((at as f64 + 0.5 * (left - right) / (left - 2.0 * here + right), here));
        }
    }
    portable_math::sort_by_number(&mut list, |a| -a.1);
    list
}

/// The highest peak of the periodogram beside the tones: angle a sample, and the share of the rest it takes.
fn highest(record: &[f64], mask: &[f64], tones: &[f64]) -> Option<(f64, f64)> {
    let columns = tone_columns(mask, tones);
    let (_, rest) = fit(&columns, record)?;
    let energy: f64 = rest.iter().map(|value| value * value).sum();
    let size = (4 * record.len()).next_power_of_two();
    let design = DMatrix::from_fn(record.len(), columns.len(), |row, column| columns[column][row]);
    let basis = design.qr().q();
    let mut known = Vec::new();
    for column in basis.column_iter() {
        let column: Vec<f64> = column.iter().copied().collect();
        known.push(fourier(&column, size));
    }
    let (rest, twice) = (fourier(&rest, size), fourier(mask, size));
    let count = twice[0].re;
    let mut curve = vec![0.0; size / 2];
    for at in size / record.len()..size / 2 - size / (2 * record.len()) {
        // Products of the cosine and the sine with themselves, less what the columns explain of them.
        let double = twice[2 * at];
        let (mut cc, mut ss, mut cs) = (count + double.re, count - double.re, -double.im);
        for value in known.iter().map(|spectrum| spectrum[at]) {
            cc -= 2.0 * value.re * value.re;
            ss -= 2.0 * value.im * value.im;
            cs += 2.0 * value.re * value.im;
        }
        let (c, s) = (rest[at].re, -rest[at].im);
        let area = cc * ss - cs * cs;
        if area > 1e-4 * count * count {
            curve[at] = 2.0 * (c * c * ss - 2.0 * c * s * cs + s * s * cc) / (area * energy);
        }
    }
    let &(at, share) = peaks(&curve, 1).first()?;
    Some((TAU * at / size as f64, share.min(1.0)))
}

/// Moves all tones by Gauss-Newton, jointly with the cubic, while the rest shrinks.
fn refine(record: &[f64], mask: &[f64], tones: &mut Vec<f64>) {
    let bound = 0.5 * TAU / record.len() as f64;
    let mut best = f64::INFINITY;
    let mut trial = tones.clone();
    for _ in 0..12 {
        let mut columns = tone_columns(mask, &trial);
        let Some((weights, rest)) = fit(&columns, record) else { return };
        let energy: f64 = rest.iter().map(|value| value * value).sum();
        if energy.is_nan() || energy >= best {
            return;
        }
        let settled = energy > best * (1.0 - 1e-9);
        (best, *tones) = (energy, trial.clone());
        if settled {
            return;
        }
        let linear = columns.len();
        for tone in 0..trial.len() {
            let (cosine, sine) = (4 + 2 * tone, 5 + 2 * tone);
            let slope = |at: usize| weights[sine] * columns[cosine][at] - weights[cosine] * columns[sine][at];
            let column = (0..record.len()).map(|at| at as f64 * slope(at)).collect();
            columns.push(column);
        }
        let Some((steps, _)) = fit(&columns, record) else { return };
        trial.iter_mut().zip(&steps[linear..]).for_each(|(omega, step)| *omega += step.clamp(-bound, bound));
    }
}

/// Discrete Fourier transform of a real series padded with zeros to a power of two.
pub fn fourier(series: &[f64], size: usize) -> Vec<Complex<f64>> {
    let mut values = vec![Complex::new(0.0, 0.0); size];
    let shift = usize::BITS - size.trailing_zeros();
    series.iter().enumerate().for_each(|(at, &value)| values[at.reverse_bits() >> shift].re = value);
    let turn = |at: usize| Complex::from_polar(1.0, -TAU * at as f64 / size as f64);
    let turns: Vec<Complex<f64>> = (0..size / 2).map(turn).collect();
    let mut half = 1;
    while half < size {
        for block in values.chunks_exact_mut(2 * half) {
            let (lower, upper) = block.split_at_mut(half);
            for (at, (low, high)) in lower.iter_mut().zip(upper).enumerate() {
                let turned = *high * turns[at * (size / (2 * half))];
                (*low, *high) = (*low + turned, *low - turned);
            }
        }
        half *= 2;
    }
    values
}
