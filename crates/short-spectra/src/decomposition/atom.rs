//! The parts of a record other than its trend and noise. A part is a sum of columns, each times an amplitude.
//! The columns depend on a few shape parameters.

use super::course::CourseAtom;
use crate::trend::LEGENDRE;
use portable_math as math;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Positions of the frames in a record, from 0 to 1: frame `i` of `n` lies at `(i + 1/2) / n`.
#[derive(Debug, Clone)]
pub(crate) struct FramePlaces {
    /// Positions of the frames used.
    pub places: Vec<f64>,
    /// Number of frames of the record, used or not.
    pub frames: usize,
}

/// Highest degree of the phase of an oscillation; it bounds the number of parameters.
pub(crate) const MOST_PHASE_DEGREE: usize = 9;
/// Highest degree of the amplitude of an oscillation: amplitudes that change faster are sums of oscillations.
pub(crate) const MOST_ENVELOPE_DEGREE: usize = 6;
/// Fastest decay that is fitted, nepers per record: about twice that of the fastest filter of
/// `candidates.rs`.
pub(crate) const MOST_NEPERS: f64 = 400.0;
/// Largest growth, nepers per record: with more, only the last sixth of a record would show the oscillation.
const MOST_GROWTH: f64 = 6.0;
/// Largest distance of the centre of a step from the record, as a fraction of its length: the record then
/// shows the tail of the step.
pub(crate) const OUTSIDE: f64 = 0.25;
/// Number of intervals from the onset to the end. A polynomial amplitude is compared with its maximum at the
/// ends of each.
pub(crate) const INTERVALS: usize = 64;
/// Smallest number of cycles of an oscillation in a record; the trend describes slower motion.
pub(crate) const FEWEST_CYCLES: f64 = 1.5;
/// Largest damping, nepers per radian: with more, an oscillation ends within half a cycle and cannot be
/// distinguished from a relaxation.
const MOST_DAMPING: f64 = 0.6;

/// An oscillation `exp(-d (s - s0)) e(s) (a cos 2 pi p(s) + b sin 2 pi p(s))` for `s >= s0`, and zero before.
/// `s` is the position in the record, 0 to 1, and `u = 2 s - 1`. The phase is `p(s) = n u/2 + sum q_k P_k(u)`
/// from degree 2 on, and `e(s) = 1 + sum e_k P_k(u)` from degree 1 on, with Legendre polynomials `P_k`. A
/// harmonic `h` has the phase `h p(s)`.
#[derive(Debug, Clone, PartialEq)]
pub struct OscillationAtom {
    /// Cycles in the record, `n`, without the terms of higher degree of the phase.
    pub cycles: f64,
    /// Decay `d`, nepers per record, negative for growth; `None` without decay.
    pub nepers: Option<f64>,
    /// Position at which it begins, `s0`, 0 to 1; 0 if it is present from the first frame on.
    pub onset: f64,
    /// Coefficients `q_k`, cycles, of degree 2, 3, ... of its phase.
    pub phase: Vec<f64>,
    /// Coefficients `e_k` of degree 1, 2, ... of its amplitude, in units of its mean.
    pub envelope: Vec<f64>,
    /// Its harmonics, as multiples of its frequency from 2 on.
    pub multiples: Vec<usize>,
}

/// Shape of a smooth step as a function of `x`, from -1 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StepShape {
    /// `tanh x`.
    Tanh,
    /// `sin (pi x / 2)`, constant beyond -1 and 1.
    HalfCosine,
    /// `(15 x - 10 x^3 + 3 x^5) / 8`, the path of least jerk (Flash and Hogan 1985), constant beyond -1 and
    /// 1.
    MinimumJerk,
    /// `x`, constant beyond -1 and 1.
    Straight,
}

impl StepShape {
    pub(crate) const ALL: [Self; 4] = [Self::Tanh, Self::HalfCosine, Self::MinimumJerk, Self::Straight];

    /// Value and derivative at `x`.
    fn value_and_slope(self, x: f64) -> (f64, f64) {
        if self == Self::Tanh {
            let value = math::tanh(x);
            return (value, 1.0 - value * value);
        }
        if x.abs() >= 1.0 {
            return (x.signum(), 0.0);
        }
        match self {
            Self::HalfCosine => {
                let (sine, cosine) = math::sin_cos(FRAC_PI_2 * x);
                (sine, FRAC_PI_2 * cosine)
            }
            Self::MinimumJerk => {
                let (square, left) = (x * x, 1.0 - x * x);
                (x * (15.0 - 10.0 * square + 3.0 * square * square) / 8.0, 15.0 / 8.0 * left * left)
            }
            Self::Tanh | Self::Straight => (x, 1.0),
        }
    }

    /// Slope at 0. A step of this width is as steep as a hyperbolic tangent of unit width.
    pub(crate) fn steepness(self) -> f64 {
        self.value_and_slope(0.0).1
    }
}

/// A part of a record. Positions and widths are fractions of the record.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Atom {
    Oscillation(OscillationAtom),
    /// A smooth step from -1 to 1, with its shape at `(s - centre) / width`.
    Step {
        shape: StepShape,
        centre: f64,
        width: f64,
    },
    /// A step at `onset` and an exponential decay that begins there, `nepers` per record. Without the step if
    /// `onset` is 0: the trend contains it.
    Relaxation {
        onset: f64,
        nepers: f64,
    },
    /// An oscillation along a ridge.
    Course(CourseAtom),
    /// From this position on, a cubic is added to the trend.
    Break {
        at: f64,
    },
}

impl OscillationAtom {
    pub(crate) fn steady(cycles: f64) -> Self {
        Self {
            cycles,
            nepers: None,
            onset: 0.0,
            phase: Vec::new(),
            envelope: Vec::new(),
            multiples: Vec::new(),
        }
    }

    /// Phase, cycles, at position `s`.
    pub(crate) fn phase_at(&self, s: f64) -> f64 {
        let u = 2.0 * s - 1.0;
        let (mut before, mut last, mut sum) = (1.0, u, self.cycles * u / 2.0);
        for (q, [a, b]) in self.phase.iter().zip(&LEGENDRE[2..]) {
            (before, last) = (last, a * u * last - b * before);
            sum += q * last;
        }
        sum
    }

    /// Frequency, cycles per record, at position `s`.
    pub(crate) fn cycles_at(&self, s: f64) -> f64 {
        /// Half of the interval of the difference, as a fraction of the record: short for a phase of degree
        /// nine, and long enough that rounding errors do not matter.
        const STEP: f64 = 1e-4;
        (self.phase_at(s + STEP) - self.phase_at(s - STEP)) / (2.0 * STEP)
    }

    /// First and last position at which it is present. It begins at its onset and ends when a twentieth of
    /// its amplitude is left, or with the record. Within this time, one with a polynomial amplitude is
    /// present from the first to the last position at which the amplitude is a tenth of its maximum: the
    /// frequency of a smaller oscillation is not known.
    fn present_places(&self) -> (f64, f64) {
        /// Decay, nepers, that leaves a twentieth of the amplitude.
        const OVER_NEPERS: f64 = 3.0;
        /// Smallest amplitude, as a fraction of the largest, at which it is present. A polynomial stays below
        /// this where the true amplitude is zero.
        const LEAST_ENVELOPE: f64 = 0.1;
        let over = |nepers: &f64| *nepers > 0.0;
        let end = self.nepers.filter(over).map_or(1.0, |nepers| (self.onset + OVER_NEPERS / nepers).min(1.0));
        if self.envelope.is_empty() {
            return (self.onset, end);
        }
        let place = |k: usize| self.onset + (end - self.onset) * k as f64 / INTERVALS as f64;
        let sizes: Vec<f64> = (0..=INTERVALS).map(|k| self.size_at(place(k)).abs()).collect();
        let least = LEAST_ENVELOPE * sizes.iter().fold(0.0, |most: f64, size| most.max(*size));
        let first = sizes.iter().position(|size| *size >= least).unwrap_or(0);
        let last = sizes.iter().rposition(|size| *size >= least).unwrap_or(INTERVALS);
        (place(first.min(INTERVALS - 1)), place(last.max(first + 1).min(INTERVALS)))
    }

    /// Time in which it is present, as a fraction of the record.
    pub(crate) fn duration(&self) -> f64 {
        let (first, last) = self.present_places();
        last - first
    }

    /// Whether it ends within a cycle. It then counts as slow motion, because a step looks the same.
    pub(crate) fn is_single_swing(&self) -> bool {
        /// Damping ratio above which an oscillation is over within a cycle: its amplitude falls to a quarter
        /// in one cycle.
        const DAMPING: f64 = 0.22;
        self.nepers.is_some_and(|d| d > DAMPING * math::hypot(d, TAU * self.cycles))
    }

    /// Mean frequency while it is present, cycles per record.
    pub(crate) fn mean_cycles(&self) -> f64 {
        if self.phase.is_empty() {
            return self.cycles;
        }
        let (first, last) = self.present_places();
        (self.phase_at(last) - self.phase_at(first)) / (last - first)
    }

    /// Positions, while it is present, at which its frequency is lowest and highest.
    pub(crate) fn extreme_places(&self) -> (f64, f64) {
        /// Number of positions compared: several between two extremes of a phase of degree nine.
        const POINTS: usize = 33;
        let (first, last) = self.present_places();
        let places = || (0..POINTS).map(|k| first + (last - first) * k as f64 / (POINTS - 1) as f64);
        let by_frequency = |a: &f64, b: &f64| self.cycles_at(*a).total_cmp(&self.cycles_at(*b));
        (places().min_by(by_frequency).unwrap_or(0.0), places().max_by(by_frequency).unwrap_or(0.0))
    }

    /// Lowest and highest frequency while it is present, cycles per record.
    pub fn cycles_range(&self) -> (f64, f64) {
        let (low, high) = self.extreme_places();
        (self.cycles_at(low), self.cycles_at(high))
    }

    /// Frequencies of its peak in a spectrum, cycles per record, with a margin in resolutions on each side. A
    /// decay widens the peak.
    pub(crate) fn peak_band(&self, margin: f64) -> (f64, f64) {
        let (low, high) = self.cycles_range();
        let wide = margin + self.nepers.map_or(0.0, |d| d.abs() / TAU);
        (low - wide, high + wide)
    }

    /// Whether its peak and that of another oscillation overlap, each widened by the margin.
    pub(crate) fn overlaps(&self, other: &Self, margin: f64) -> bool {
        let ((low, high), (other_low, other_high)) = (self.peak_band(margin), other.peak_band(margin));
        other_low < high && low < other_high
    }

    /// Factor of the amplitude by decay since the onset; 0 before it.
    fn decay_at(&self, s: f64) -> f64 {
        if s < self.onset - 1e-12 {
            return 0.0;
        }
        self.nepers.map_or(1.0, |nepers| math::exp((-nepers * (s - self.onset)).min(MOST_GROWTH)))
    }

    /// Factor of the amplitude by the polynomial `e(s)`.
    fn modulation_at(&self, s: f64) -> f64 {
        let u = 2.0 * s - 1.0;
        let (mut before, mut last, mut sum) = (0.0, 1.0, 1.0);
        for (e, [a, b]) in self.envelope.iter().zip(&LEGENDRE[1..]) {
            (before, last) = (last, a * u * last - b * before);
            sum += e * last;
        }
        sum
    }

    /// Factor of the amplitude by decay and polynomial at position `s`; 0 before the onset.
    pub(crate) fn size_at(&self, s: f64) -> f64 {
        self.decay_at(s) * self.modulation_at(s)
    }

    /// Cosine and sine columns of the oscillation, then those of each multiple; one value per frame used.
    fn columns(&self, at: &FramePlaces) -> Vec<Vec<f64>> {
        let mut columns = vec![vec![0.0; at.places.len()]; 2 * (1 + self.multiples.len())];
        let first = at.places.partition_point(|s| *s < self.onset - 1e-12);
        let mut phasors = Phasors::new(self, at);
        for (i, s) in at.places.iter().enumerate().skip(first) {
            let (cosine, sine, decay) = phasors.at_frame(i);
            let envelope = if self.envelope.is_empty() { decay } else { decay * self.modulation_at(*s) };
            columns[0][i] = envelope * cosine;
            columns[1][i] = envelope * sine;
            // the phase of each multiple is that of the one before it, turned by the phase of the oscillation
            let (mut turned, mut re, mut im) = (1, cosine, sine);
            for (k, multiple) in self.multiples.iter().enumerate() {
                while turned < *multiple {
                    (im, re) = add_angles((im, re), (sine, cosine));
                    turned += 1;
                }
                columns[2 * k + 2][i] = envelope * re;
                columns[2 * k + 3][i] = envelope * im;
            }
        }
        columns
    }

    /// Derivatives of the oscillation by each of its parameters, one column each: cycles, decay if there is
    /// one, coefficients of the phase, coefficients of the amplitude. `coefficients` are the amplitudes of
    /// `columns`.
    fn derivatives(&self, at: &FramePlaces, columns: &[Vec<f64>], coefficients: &[f64]) -> Vec<Vec<f64>> {
        let count = 1 + usize::from(self.nepers.is_some()) + self.phase.len() + self.envelope.len();
        let mut derivatives = vec![Vec::with_capacity(at.places.len()); count];
        for (i, s) in at.places.iter().enumerate() {
            let (mut by_phase, mut value) = (0.0, 0.0);
            for (k, multiple) in std::iter::once(&1).chain(&self.multiples).enumerate() {
                let (cosine, sine) = (columns[2 * k][i], columns[2 * k + 1][i]);
                let (a, b) = (coefficients[2 * k], coefficients[2 * k + 1]);
                by_phase += TAU * *multiple as f64 * (b * cosine - a * sine);
                value += a * cosine + b * sine;
            }
            let u = 2.0 * s - 1.0;
            let mut parameters = derivatives.iter_mut();
            let mut push = |x: f64| parameters.next().into_iter().for_each(|column| column.push(x));
            push(by_phase * u / 2.0);
            if self.nepers.is_some() {
                push(-(s - self.onset) * value);
            }
            let (mut before, mut last) = (1.0, u);
            for [a, b] in &LEGENDRE[2..2 + self.phase.len()] {
                (before, last) = (last, a * u * last - b * before);
                push(by_phase * last);
            }
            if !self.envelope.is_empty() {
                let modulation = self.modulation_at(*s);
                let plain = if modulation.abs() > 1e-9 { value / modulation } else { 0.0 };
                let (mut before, mut last) = (0.0, 1.0);
                for [a, b] in &LEGENDRE[1..1 + self.envelope.len()] {
                    (before, last) = (last, a * u * last - b * before);
                    push(plain * last);
                }
            }
        }
        derivatives
    }
}

/// Sine and cosine of the sum of two angles, from the sine and cosine of each.
pub(super) fn add_angles((sine, cosine): (f64, f64), (by_sine, by_cosine): (f64, f64)) -> (f64, f64) {
    (sine * by_cosine + cosine * by_sine, cosine * by_cosine - sine * by_sine)
}

/// Cosine and sine of the phase of an oscillation, and its decay, frame by frame. From one frame to the next,
/// a phase without drift turns by a constant angle, and a decay shrinks by a constant factor. After a gap and
/// after `MOST_STEPS` frames both are computed anew, so that rounding errors do not grow.
struct Phasors<'a> {
    atom: &'a OscillationAtom,
    at: &'a FramePlaces,
    /// Cosine and sine of the turn over one frame, and the factor of the decay over it.
    step: (f64, f64, f64),
    latest: (f64, f64, f64),
    /// Number of frames since both were computed anew.
    since: usize,
}

impl<'a> Phasors<'a> {
    /// Number of frames over which rounding errors of the recurrence grow to a few 1e-15.
    const MOST_STEPS: usize = 32;

    fn new(atom: &'a OscillationAtom, at: &'a FramePlaces) -> Self {
        let frames = at.frames as f64;
        let (sine, cosine) = math::sin_cos(TAU * atom.cycles / frames);
        let shrink = atom.nepers.map_or(1.0, |nepers| math::exp(-nepers / frames));
        Self { atom, at, step: (cosine, sine, shrink), latest: (1.0, 0.0, 1.0), since: Self::MOST_STEPS }
    }

    /// Cosine, sine and decay in frame `i` of those used; the frame before it must come first.
    fn at_frame(&mut self, i: usize) -> (f64, f64, f64) {
        let s = self.at.places[i];
        let follows = i > 0 && (s - self.at.places[i - 1]) * (self.at.frames as f64) < 1.5;
        let (cosine, sine, decay) = self.latest;
        let (by_cosine, by_sine, shrink) = self.step;
        self.since += 1;
        let anew = !follows || self.since > Self::MOST_STEPS;
        if anew {
            self.since = 0;
        }
        let (sine, cosine) = if anew || !self.atom.phase.is_empty() {
            let turn = self.atom.phase_at(s);
            math::sin_cos(TAU * (turn - turn.floor()))
        } else {
            add_angles((sine, cosine), (by_sine, by_cosine))
        };
        let decay = if anew { self.atom.decay_at(s) } else { decay * shrink };
        self.latest = (cosine, sine, decay);
        self.latest
    }
}

impl Atom {
    pub(crate) fn oscillation(&self) -> Option<&OscillationAtom> {
        match self {
            Self::Oscillation(oscillation) => Some(oscillation),
            _ => None,
        }
    }

    pub(crate) fn course(&self) -> Option<&CourseAtom> {
        match self {
            Self::Course(course) => Some(course),
            _ => None,
        }
    }

    /// Harmonics of an oscillation, as multiples of its frequency from 2 on.
    pub(crate) fn multiples(&self) -> &[usize] {
        match self {
            Self::Oscillation(o) => &o.multiples,
            Self::Course(course) => &course.multiples,
            _ => &[],
        }
    }

    pub(crate) fn column_count(&self) -> usize {
        match self {
            Self::Oscillation(o) => 2 * (1 + o.multiples.len()),
            Self::Step { .. } => 1,
            Self::Relaxation { onset, .. } => 1 + usize::from(*onset > 0.0),
            Self::Course(course) => course.column_count(),
            Self::Break { .. } => 4,
        }
    }

    /// The columns of the part, with one value per frame used.
    pub(crate) fn columns(&self, at: &FramePlaces) -> Vec<Vec<f64>> {
        let each = |value: &dyn Fn(f64) -> f64| at.places.iter().map(|s| value(*s)).collect();
        match self {
            Self::Oscillation(oscillation) => oscillation.columns(at),
            Self::Step { shape, centre, width } => {
                vec![each(&|s| shape.value_and_slope((s - centre) / width).0)]
            }
            Self::Relaxation { onset, nepers } => {
                let after = |s: f64| f64::from(u8::from(s >= *onset));
                let decay = |s: f64| if s >= *onset { math::exp(-nepers * (s - onset)) } else { 0.0 };
                if *onset > 0.0 { vec![each(&after), each(&decay)] } else { vec![each(&decay)] }
            }
            Self::Course(course) => course.columns(at),
            Self::Break { at } => {
                let power = |k: i32| move |s: f64| if s > *at { math::powi(s - at, k) } else { 0.0 };
                (0..4).map(|k| each(&power(k))).collect()
            }
        }
    }

    /// Derivatives of the part by each parameter, one column each. `coefficients` are the amplitudes of
    /// `columns`.
    pub(crate) fn derivatives(
        &self,
        at: &FramePlaces,
        columns: &[Vec<f64>],
        coefficients: &[f64],
    ) -> Vec<Vec<f64>> {
        let each = |value: &dyn Fn(usize, f64) -> f64| {
            at.places.iter().enumerate().map(|(i, s)| value(i, *s)).collect()
        };
        match self {
            Self::Oscillation(oscillation) => oscillation.derivatives(at, columns, coefficients),
            Self::Step { shape, centre, width } => {
                let slope = |s: f64| coefficients[0] * shape.value_and_slope((s - centre) / width).1 / width;
                vec![each(&|_, s| -slope(s)), each(&|_, s| -slope(s) * (s - centre) / width)]
            }
            Self::Relaxation { onset, .. } => {
                let k = columns.len() - 1;
                vec![each(&|i, s| -(s - onset) * coefficients[k] * columns[k][i])]
            }
            Self::Course(_) | Self::Break { .. } => Vec::new(),
        }
    }

    /// The shape parameters that a fit varies, in the order of the derivatives. Onsets and breaks are not
    /// among them.
    pub(crate) fn parameters(&self) -> Vec<f64> {
        match self {
            Self::Oscillation(o) => std::iter::once(o.cycles)
                .chain(o.nepers)
                .chain(o.phase.iter().copied())
                .chain(o.envelope.iter().copied())
                .collect(),
            Self::Step { centre, width, .. } => vec![*centre, *width],
            Self::Relaxation { nepers, .. } => vec![*nepers],
            Self::Course(_) | Self::Break { .. } => Vec::new(),
        }
    }

    /// The part with other values of [`Self::parameters`].
    pub(crate) fn with_parameters(&self, values: &[f64]) -> Self {
        let mut atom = self.clone();
        match &mut atom {
            Self::Oscillation(o) => {
                let mut values = values.iter().copied();
                o.cycles = values.next().unwrap_or(o.cycles);
                o.nepers = o.nepers.map(|nepers| values.next().unwrap_or(nepers));
                o.phase.iter_mut().chain(&mut o.envelope).zip(values).for_each(|(q, value)| *q = value);
            }
            Self::Step { centre, width, .. } => {
                values.first().into_iter().for_each(|value| *centre = *value);
                values.get(1).into_iter().for_each(|value| *width = *value);
            }
            Self::Relaxation { nepers, .. } => values.first().into_iter().for_each(|value| *nepers = *value),
            Self::Course(_) | Self::Break { .. } => {}
        }
        atom
    }

    /// Longest step of each parameter in one iteration: about the range over which the part is linear in the
    /// parameter.
    pub(crate) fn step_limits(&self) -> Vec<f64> {
        match self {
            Self::Oscillation(o) => {
                let nepers = o.nepers.map_or(0.0, f64::abs);
                std::iter::once(0.8 + 0.25 * nepers)
                    .chain(o.nepers.map(|_| (0.9 * nepers).max(1.5)))
                    .chain(o.phase.iter().map(|_| 0.8))
                    .chain(o.envelope.iter().map(|_| 0.7))
                    .collect()
            }
            Self::Step { width, .. } => vec![*width, 0.9 * width],
            Self::Relaxation { nepers, .. } => vec![0.9 * nepers],
            Self::Course(_) | Self::Break { .. } => Vec::new(),
        }
    }

    /// Whether the parameters lie in the range in which the part differs from the trend and from other parts.
    pub(crate) fn is_usable(&self, frames: usize) -> bool {
        match self {
            Self::Oscillation(o) => {
                let most = frames as f64 / 2.0 - 1.0;
                (FEWEST_CYCLES..most).contains(&o.cycles)
                    && o.nepers.is_none_or(|d| {
                        d > -MOST_GROWTH && d < MOST_NEPERS.min(TAU * o.cycles * MOST_DAMPING)
                    })
                    && o.phase.iter().all(|q| q.abs() < frames as f64 / 8.0)
                    && o.envelope.iter().all(|e| e.abs() < 3.0)
                    && (o.phase.is_empty() || o.cycles_range().0 > 0.0)
            }
            Self::Step { centre, width, .. } => {
                *width > 1.0 / frames as f64 && *width < 0.3 && (-OUTSIDE..1.0 + OUTSIDE).contains(centre)
            }
            Self::Relaxation { nepers, .. } => (0.5..2.0 * MOST_NEPERS).contains(nepers),
            Self::Course(_) | Self::Break { .. } => true,
        }
    }

    /// Price of the part in units of the logarithm of the number of frames. Djurić (1996) derives 1/2 for an
    /// amplitude and 3/2 for a frequency. A position in the record costs 1, and every other shape parameter 1
    /// to 3/2. A harmonic costs two amplitudes and 1/2 for the choice of its multiple.
    pub(crate) fn price(&self) -> f64 {
        match self {
            Self::Oscillation(o) => {
                let onset = if o.onset > 0.0 { 1.0 } else { 0.0 };
                let decay = if o.nepers.is_some() { 1.5 } else { 0.0 };
                2.5 + decay
                    + onset
                    + 1.5 * o.phase.len() as f64
                    + 1.2 * o.envelope.len() as f64
                    + 1.5 * o.multiples.len() as f64
            }
            Self::Step { .. } => 2.5,
            Self::Relaxation { onset, .. } => {
                if *onset > 0.0 {
                    3.0
                } else {
                    1.5
                }
            }
            Self::Course(course) => course.price(),
            Self::Break { .. } => 2.0,
        }
    }
}
