//! An oscillation whose frequency and amplitude follow no polynomial: its course is that of a ridge.

use super::atom::{Atom, FramePlaces, OscillationAtom};
use super::problem::{Explanation, NoisyRecord, Parts, dot};
use super::{scale_record, with_noise_of};
use crate::classification::MOST_STRAY;
use crate::frequency_drift::{
    FULLY_FOLLOWED, RidgeMean, choose_ridge_band, count_cycles, median_stray, select_best_ridge,
};
use crate::record::SampledRecord;
use crate::time_frequency::{FrequencyRange, Ridge, RidgeEnd, RidgePoint};
use crate::trend::Trend;
use portable_math as math;
use std::f64::consts::TAU;
use std::sync::Arc;

/// An oscillation along a ridge. Times are fractions of the record, frequencies are cycles per record.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CourseAtom {
    pub ridge: Arc<Ridge>,
    pub range: FrequencyRange,
    /// Phase, cycles, in each frame of the record.
    phase: Arc<[f64]>,
    /// Amplitude in each frame; 0 where the ridge is interrupted.
    envelope: Arc<[f64]>,
    /// Its harmonics, as multiples of its frequency from 2 on.
    pub multiples: Vec<usize>,
}

impl CourseAtom {
    /// The oscillation along a ridge of a record of this many frames; `None` for a ridge without a confirmed
    /// range of frequencies.
    pub(crate) fn from_ridge(ridge: Ridge, frames: usize) -> Option<Self> {
        let range = ridge.range_hz()?;
        Some(Self::along_ridge(ridge, range, frames))
    }

    fn along_ridge(ridge: Ridge, range: FrequencyRange, frames: usize) -> Self {
        let (mut phase, mut envelope) = (vec![0.0; frames], vec![0.0; frames]);
        for part in ridge.unbroken_parts() {
            let (Some(first), Some(last)) = (part.first(), part.last()) else { continue };
            let start = ridge.start.as_ref().filter(|_| ridge.points.first() == Some(first));
            let end = ridge.end.as_ref().filter(|_| ridge.points.last() == Some(last));
            let mut cycles = first.phase_rad / TAU;
            let mut fill = |from: f64, to: f64, value: &dyn Fn(f64) -> (f64, f64)| {
                let frame = |s: f64| ((s * frames as f64).ceil().max(0.0) as usize).min(frames);
                for i in frame(from)..frame(to) {
                    (phase[i], envelope[i]) = value(i as f64 / frames as f64);
                }
            };
            let reach = ridge.segment_s / 2.0;
            // beyond the outermost point, the phase is a cubic with the phase, frequency and rate of that
            // point, and with the frequency at the end of the record if that is known
            let beyond = |point: &RidgePoint, end: Option<&RidgeEnd>, cycles: f64| {
                let (at, hz, rate, size) =
                    (point.time_s, point.frequency_hz, point.rate_hz_per_s, point.amplitude_m);
                let bend = end.map_or(0.0, |end| {
                    let apart = end.time_s - at;
                    (end.frequency_hz - hz - rate * apart) / (3.0 * apart * apart)
                });
                move |s: f64| {
                    let x = s - at;
                    (cycles + x * (hz + x * (rate / 2.0 + x * bend)), size)
                }
            };
            fill(first.time_s - reach, first.time_s, &beyond(first, start, cycles));
            for pair in part.windows(2) {
                let (a, b) = (&pair[0], &pair[1]);
                let (apart, more) = (b.time_s - a.time_s, count_cycles(a, b));
                // a cubic through both phases with both frequencies
                fill(a.time_s, b.time_s, &|s: f64| {
                    let x = (s - a.time_s) / apart;
                    let (p, q) = (a.frequency_hz * apart, b.frequency_hz * apart);
                    let (square, cube) = (3.0 * more - 2.0 * p - q, p + q - 2.0 * more);
                    let size = a.amplitude_m + x * (b.amplitude_m - a.amplitude_m);
                    (cycles + x * (p + x * (square + x * cube)), size)
                });
                cycles += more;
            }
            // the last segment ends less than a hop before the end of the record
            let until = last.time_s + reach;
            let until = if until + ridge.hop_s >= 1.0 { 1.0 } else { until };
            fill(last.time_s, until, &beyond(last, end, cycles));
        }
        let (phase, envelope) = (phase.into(), envelope.into());
        let ridge = Arc::new(ridge);
        Self { ridge, range, phase, envelope, multiples: Vec::new() }
    }

    /// The column of the oscillation, then cosine and sine of each multiple; one value per frame used.
    pub(crate) fn columns(&self, at: &FramePlaces) -> Vec<Vec<f64>> {
        let mut columns = vec![Vec::with_capacity(at.places.len()); self.column_count()];
        for s in &at.places {
            let i = ((s * at.frames as f64) as usize).min(self.phase.len() - 1);
            let (turn, size) = (self.phase[i], self.envelope[i]);
            let part = |multiple: usize| {
                let turn = multiple as f64 * turn;
                math::sin_cos(TAU * (turn - turn.floor()))
            };
            columns[0].push(size * part(1).1);
            for (k, multiple) in self.multiples.iter().enumerate() {
                let (sine, cosine) = part(*multiple);
                columns[2 * k + 1].push(size * cosine);
                columns[2 * k + 2].push(size * sine);
            }
        }
        columns
    }

    /// Phase, cycles, and amplitude, interpolated linearly between frames; `frame` need not be whole.
    pub(crate) fn phase_and_size(&self, frame: f64) -> (f64, f64) {
        let last = self.phase.len() - 1;
        let before = (frame.max(0.0) as usize).min(last);
        let after = (before + 1).min(last);
        let part = frame - before as f64;
        let between = |values: &[f64]| values[before] + part * (values[after] - values[before]);
        (between(&self.phase), between(&self.envelope))
    }

    pub(crate) fn column_count(&self) -> usize {
        1 + 2 * self.multiples.len()
    }

    /// Price in units of the logarithm of the number of frames. A harmonic costs as much as one of another
    /// oscillation.
    pub(crate) fn price(&self) -> f64 {
        /// Price of a segment: in its Hann window a complex amplitude takes about two independent values, and
        /// each of these four numbers costs 1/2.
        const SEGMENT_PRICE: f64 = 2.0;
        let segments = self.ridge.points.len() as f64 * self.ridge.hop_s / self.ridge.segment_s;
        SEGMENT_PRICE * segments.max(1.0) + 1.5 * self.multiples.len() as f64
    }

    pub(crate) fn mean(&self) -> RidgeMean {
        RidgeMean::from_ridge(&self.ridge)
    }

    /// Whether a frequency, cycles per record, lies in its range or at most a resolution beyond it.
    pub(crate) fn covers(&self, cycles: f64) -> bool {
        cycles > self.range.low_hz - 1.0 && cycles < self.range.high_hz + 1.0
    }
}

/// Whether an oscillation along `courses`, parts of a ridge of the record, describes the record better than
/// noise alone. The strongest peaks of noise can follow each other like a ridge.
#[must_use]
pub fn exceeds_noise(
    samples: &[Option<f64>],
    frame_rate_hz: f64,
    ridge: &Ridge,
    courses: &[Vec<RidgePoint>],
) -> bool {
    let record = SampledRecord { samples, frame_rate_hz, exposure_s: None };
    let Some((problem, ..)) = scale_record(&record, Trend::Polynomial(1)) else { return false };
    let length_s = samples.len() as f64 / frame_rate_hz;
    let point = |p: &RidgePoint| RidgePoint {
        time_s: p.time_s / length_s,
        frequency_hz: p.frequency_hz * length_s,
        rate_hz_per_s: p.rate_hz_per_s * length_s * length_s,
        ..*p
    };
    let points: Vec<RidgePoint> = courses.iter().flatten().map(point).collect();
    let (segment_s, hop_s) = (ridge.segment_s / length_s, ridge.hop_s / length_s);
    let ridge = Ridge { points, start: None, end: None, segment_s, hop_s };
    let all = || ridge.points.iter().map(|p| p.frequency_hz);
    let (low_hz, high_hz) = (all().fold(f64::INFINITY, f64::min), all().fold(0.0, f64::max));
    let range = FrequencyRange { low_hz, low_sd_hz: 0.0, high_hz, high_sd_hz: 0.0 };
    let course = CourseAtom::along_ridge(ridge, range, samples.len());
    let criterion = |atoms: Vec<Atom>| {
        let parts = Parts { trend: Trend::Polynomial(1), atoms };
        with_noise_of(&problem, &parts).fit_parts(&parts, 0).criterion
    };
    criterion(vec![Atom::Course(course)]) < criterion(Vec::new())
}

/// The values of a record minus its trend and minus each part `k` for which `is_subtracted(k)` holds; `None`
/// for a frame that is not used. `courses` are the values of all parts.
fn subtract_parts(
    problem: &NoisyRecord,
    trend: &[f64],
    courses: &[Vec<f64>],
    is_subtracted: impl Fn(usize) -> bool,
) -> Vec<Option<f64>> {
    let mut left = vec![None; problem.at.frames];
    for (i, value) in problem.used.iter().zip(&problem.values) {
        let others = courses.iter().enumerate().filter(|(k, _)| is_subtracted(*k));
        left[*i] = Some(value - trend[*i] - others.map(|(_, course)| course[*i]).sum::<f64>());
    }
    left
}

/// The ridge of the strongest oscillation in a band, cycles per record; `None` if it does not drift, or if
/// the ridge does not follow it through nearly the whole record.
fn follow_ridge(left: &[Option<f64>], band: (f64, f64)) -> Option<Ridge> {
    let (share, ridge) = select_best_ridge(left, left.len() as f64, band)?;
    let is_followed = share >= FULLY_FOLLOWED && median_stray(&ridge) < MOST_STRAY;
    (is_followed && ridge.is_drifting()).then_some(ridge)
}

/// The ridge of the oscillation `k` of an explanation. All slower parts are subtracted first. Other
/// oscillations in its band may be pieces of it, so they stay. `None` unless the ridge extends from the first
/// frame to the last and has points in nearly all segments.
pub(super) fn follow_oscillation(problem: &NoisyRecord, found: &Explanation, k: usize) -> Option<Ridge> {
    let atoms = &found.parts.atoms;
    let (low, high) = atoms[k].oscillation()?.cycles_range();
    let most = problem.at.frames as f64 / 2.0;
    let band = (BAND_MARGIN * low, (high / BAND_MARGIN).min(most));
    let (trend, courses) = problem.values_everywhere(found);
    let left = subtract_parts(problem, &trend, &courses, |other| {
        atoms[other].oscillation().is_none_or(|o| o.mean_cycles() < band.0)
    });
    follow_ridge(&left, band).filter(|ridge| ridge.start.is_some() && ridge.end.is_some())
}

/// The band in which a drifting oscillation is followed begins at this fraction of its lowest frequency and
/// ends at its highest frequency divided by this fraction. Its harmonics lie outside the band if the highest
/// frequency is less than 1.4 times the lowest.
const BAND_MARGIN: f64 = 0.7;

/// The parts of an explanation in which one oscillation along a ridge takes the place of all oscillations in
/// its range of frequencies, or of the course with the index `replaced`. `None` without a ridge that is
/// followed through nearly the whole record and whose frequency changes by at least `LEAST_RANGE`.
pub(super) fn unite_along_ridge(
    problem: &NoisyRecord,
    found: &Explanation,
    replaced: Option<usize>,
) -> Option<Parts> {
    /// Smallest range of a ridge, resolutions; a smaller one is that of a slightly broadened line.
    const LEAST_RANGE: f64 = 2.0;
    let frames = problem.at.frames;
    let (trend, courses) = problem.values_everywhere(found);
    let atoms = &found.parts.atoms;
    let size = |values: &[f64]| (2.0 * dot(values, values) / frames as f64).sqrt();
    let lines = atoms.iter().zip(&courses);
    let lines: Vec<(f64, f64)> =
        lines.filter_map(|(atom, values)| Some((atom.oscillation()?.mean_cycles(), size(values)))).collect();
    let old = replaced.and_then(|k| atoms[k].course());
    let within = old.map(|old| (0.5 * old.range.low_hz, 1.5 * old.range.high_hz));
    let band = choose_ridge_band(frames, frames as f64, &lines, within)?;
    let is_subtracted = |(k, atom): (usize, &Atom)| match atom.oscillation() {
        Some(o) => o.mean_cycles() < band.0 || old.is_some(),
        None => Some(k) != replaced,
    };
    let left = subtract_parts(problem, &trend, &courses, |k| is_subtracted((k, &atoms[k])));
    let ridge = follow_ridge(&left, band)?;
    let mut course = CourseAtom::from_ridge(ridge, frames)?;
    if course.range.high_hz - course.range.low_hz < LEAST_RANGE {
        return None;
    }
    course.multiples = old.map_or_else(Vec::new, |old| old.multiples.clone());
    let covered = |o: &OscillationAtom| old.is_none() && course.covers(o.mean_cycles());
    let kept = atoms
        .iter()
        .enumerate()
        .filter(|(k, atom)| Some(*k) != replaced && !atom.oscillation().is_some_and(covered));
    let mut atoms: Vec<Atom> = kept.map(|(_, atom)| atom.clone()).collect();
    atoms.push(Atom::Course(course));
    Some(Parts { trend: found.parts.trend, atoms })
}
