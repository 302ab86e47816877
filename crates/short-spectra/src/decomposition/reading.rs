//! Components from the parts of a record: each oscillation with standard deviations that include those of the
//! rivals, and the doubts that follow from the odds.

mod pieces;

use super::atom::{Atom, INTERVALS, OscillationAtom};
use super::cluster::{CLUSTER_REACH, group_linked};
use super::course::{self, CourseAtom};
use super::problem::{self, Parts};
use super::search::Rival;
use super::{Decomposition, NarrowBand, with_noise_of};
use crate::classification::{Evidence, LEAST_CLEAR_DRIFT, RecordContext, classify_components};
use crate::component::{Component, DecayingTone, Estimator, Harmonic};
use crate::frequency_drift::{CYCLE_INSTANT_SD, RidgeMean};
use crate::periodogram::upper_median;
use crate::record::SampledRecord;
use crate::sampling::alias_hz;
use crate::settings::SpectrumSettings;
use crate::time_frequency::{FrequencyRange, Ridge};
use nalgebra::{DMatrix, DVector};
use portable_math as math;
use std::f64::consts::{SQRT_2, TAU};

/// Rivals whose criterion is higher by more than this, nats, do not count in an average: their odds are below
/// one in 2,900.
const FURTHEST: f64 = 8.0;
/// An oscillation is in doubt if its explanation leads by less than this, nats, over a rival without an
/// oscillation near its frequency: at this lead the odds are 1 to 148.
const CLEAR_LEAD: f64 = 5.0;
/// An oscillation of fewer cycles than this may be a piece of the slow motion, if that needs more than a
/// cubic: columns beyond four or a step describe waves that are almost as short.
const SLOW_CYCLES: f64 = 6.5;
/// Number of cycles, per column of the trend, below which an oscillation may be a piece of the slow motion: a
/// column describes half a wave, and the margin is half as much again.
const SLOW_CYCLES_PER_COLUMN: f64 = 0.75;
/// Distance, in resolutions, below which two oscillations may be pieces of one: closer lines are not
/// separated reliably.
const LEAST_APART: f64 = 0.5;
/// An oscillation that drifts across one more than this many times as large may be a piece of it: a model
/// leaves up to a fifth of an oscillation.
const MUCH_LARGER: f64 = 5.0;
/// Standard deviation, resolutions, above which the frequency of several united oscillations is in doubt: up
/// to this value the frequency lies within the peak of a Hann spectrum.
const MOST_SPREAD: f64 = 0.5;
/// Each oscillation of a cluster of at least this many is in doubt.
const CLUSTER: usize = 3;
/// An oscillation that begins or is over within the record is in doubt with this number of other such ones:
/// together they describe noise or jumps as well.
const CROWD: usize = 3;
/// Smallest decay, nepers, between its onset and the end of the record of a late oscillation that is not in
/// doubt: with less, two lines that beat explain it.
const LEAST_DECAY: f64 = 2.0;
/// Decay, nepers per record, above which an oscillation is over within the record: a four-hundredth of its
/// amplitude is left at the end.
const TRANSIENT_NEPERS: f64 = 6.0;
/// Largest scatter of the frequencies of parts of the record, as chi squared per degree of freedom, of a
/// single oscillation: chance exceeds it in about one of a thousand.
const MOST_SCATTER: f64 = 5.5;
/// Scatter of the frequencies of parts of the record above which the standard deviation of the frequency
/// includes the scatter: chance exceeds this value in one of twenty.
const CHANCE_SCATTER: f64 = 2.6;
/// Number of frames per parameter below which every part is in doubt, or a late oscillation with few frames
/// of its own: the odds hold only for many frames per parameter.
const PARAMETERS_WITHIN: usize = 6;
/// Standard deviation, cycles, of the number of cycles between two instants: if the shape of the cycles
/// changes, so does the phase of the fundamental at which a cycle begins, at either instant.
const INSTANTS_SD: f64 = CYCLE_INSTANT_SD * SQRT_2;
/// Number of columns of a cubic trend.
const CUBIC_COLUMNS: usize = 4;

/// An oscillation of a record with its standard deviations; frequencies in cycles and decays in nepers per
/// record.
#[derive(Debug, Clone)]
struct OscillationReading {
    atom: OscillationAtom,
    /// Mean frequency.
    cycles: f64,
    /// Standard deviation of the mean frequency that follows from the noise and from the scatter within the
    /// record.
    own_cycles_sd: f64,
    /// The same with the spread of the frequency among the rivals.
    cycles_sd: f64,
    /// Lowest and highest frequency, if it drifts.
    range: Option<FrequencyRange>,
    /// Whether its range comes from its ridge.
    has_ridge: bool,
    /// Standard deviation of the decay, or of the decay that an oscillation of constant amplitude may have.
    nepers_sd: f64,
    /// Amplitudes of cosine and sine at the onset, for it and each multiple, m.
    amplitudes_m: Vec<[f64; 2]>,
    /// Standard deviation of its amplitude, m.
    amplitude_sd_m: f64,
    /// Sum of the squares of its whitened values without harmonics, divided by the variance of the whitened
    /// residual.
    energy: f64,
    /// Number of oscillations that are united in it.
    pieces: usize,
    /// Mean square over the noise within two resolutions, dB.
    snr_db: f64,
    /// Standard deviation, m, of white noise that disturbs the oscillation as much as the noise of the record
    /// does.
    noise_m: f64,
    /// Lead over the best rival that has no oscillation near its frequency, nats; infinite without such a
    /// rival.
    lead: f64,
    /// Chi squared, per degree of freedom, of the frequencies that fit parts of the record best.
    scatter: f64,
}

/// Lowest and highest frequency of a drifting oscillation, cycles per record, with standard deviations, which
/// include that of the instants at which cycles begin. `covariance` is that of its shape parameters.
fn read_range(o: &OscillationAtom, covariance: &DMatrix<f64>) -> FrequencyRange {
    /// Number of cycles over which the lowest or the highest frequency is measured.
    const CYCLES: f64 = 4.0;
    let (low_at, high_at) = o.extreme_places();
    let shapes = Atom::Oscillation(o.clone()).parameters();
    let deviation = |s: f64| {
        // the frequency is linear in the parameters on which it depends
        let gradient: Vec<f64> = (0..shapes.len())
            .map(|k| {
                let mut moved = shapes.clone();
                moved[k] += 1.0;
                let moved = Atom::Oscillation(o.clone()).with_parameters(&moved);
                moved.oscillation().map_or(0.0, |moved| moved.cycles_at(s)) - o.cycles_at(s)
            })
            .collect();
        let gradient = DVector::from_vec(gradient);
        let variance = (gradient.transpose() * covariance * &gradient)[(0, 0)];
        math::hypot(variance.max(0.0).sqrt(), INSTANTS_SD / CYCLES * o.cycles_at(s))
    };
    FrequencyRange {
        low_hz: o.cycles_at(low_at),
        low_sd_hz: deviation(low_at),
        high_hz: o.cycles_at(high_at),
        high_sd_hz: deviation(high_at),
    }
}

/// Whether an oscillation begins or is over within the record.
fn is_transient(o: &OscillationAtom) -> bool {
    o.onset > 0.0 || o.nepers.is_some_and(|d| d > TRANSIENT_NEPERS)
}

/// Half width of the peak of an oscillation in a spectrum, resolutions: a decay widens it.
fn lobe_half_width(o: &OscillationAtom) -> f64 {
    (o.nepers.map_or(0.0, f64::abs) / TAU).max(1.0)
}

/// Standard deviation of an amplitude, in its unit, from those of cosine and sine, which come first in
/// `amplitudes` and in `covariance`.
fn amplitude_sd(amplitudes: &[f64], covariance: &DMatrix<f64>) -> f64 {
    let size = math::hypot(amplitudes[0], amplitudes[1]).max(1e-300);
    let [a, b] = [amplitudes[0] / size, amplitudes[1] / size];
    let [aa, ab, bb] = [covariance[(0, 0)], covariance[(0, 1)], covariance[(1, 1)]];
    (a * a * aa + 2.0 * a * b * ab + b * b * bb).max(0.0).sqrt()
}

/// Whether two oscillations may be pieces of one: they are closer than `LEAST_APART`, or their peaks overlap
/// and one of the two begins or ends within the record.
fn may_be_one(a: &OscillationAtom, b: &OscillationAtom) -> bool {
    let apart = greatest_distance(a, b);
    apart < LEAST_APART
        || (is_transient(a) || is_transient(b)) && apart < lobe_half_width(a).max(lobe_half_width(b))
}

/// Greatest distance, resolutions, of two frequencies at the start, in the middle and at the end of the
/// record: cycles that cross are close only where they cross.
fn greatest_distance(a: &OscillationAtom, b: &OscillationAtom) -> f64 {
    let apart = |s: f64| (a.cycles_at(s) - b.cycles_at(s)).abs();
    [0.0, 0.5, 1.0].map(apart).into_iter().fold(0.0, f64::max)
}

/// A harmonic of a component. It has no range if its frequency would exceed half the frame rate, where
/// frequencies fold.
fn to_harmonic(of: &Component, multiple: usize, amplitude_m: f64, frame_rate_hz: f64) -> Component {
    let times = multiple as f64;
    let folds = times * of.range_hz.map_or(of.frequency_hz, |range| range.high_hz) > frame_rate_hz / 2.0;
    Component {
        frequency_hz: alias_hz(times * of.frequency_hz, frame_rate_hz),
        frequency_sd_hz: times * of.frequency_sd_hz,
        cramer_rao_hz: times * of.cramer_rao_hz,
        amplitude_m,
        amplitude_sd_m: of.amplitude_sd_m * amplitude_m / of.amplitude_m,
        snr_db: of.snr_db + 20.0 * math::log10(amplitude_m / of.amplitude_m),
        damping_ratio: of.damping_ratio.map(|ratio| ratio / times),
        damping_ratio_sd: of.damping_ratio_sd.map(|sd| sd / times),
        range_hz: of.range_hz.filter(|_| !folds).map(|range| range.times(times)),
        harmonic_of: Some(Harmonic { frequency_hz: of.frequency_hz, multiple }),
        ..of.clone()
    }
}

/// Reasons for which an oscillation along a ridge is in doubt.
fn list_course_doubts(course: &CourseAtom) -> Vec<String> {
    let mut doubts = Vec::new();
    let drift = course.range.high_hz - course.range.low_hz;
    if drift < LEAST_CLEAR_DRIFT {
        doubts.push(format!("it drifts by {drift:.1} resolutions: two that beat may look the same"));
    }
    doubts
}

/// Median distance, resolutions, of two frequencies over the record.
fn median_distance(a: &OscillationAtom, b: &OscillationAtom) -> f64 {
    let apart = |s: f64| (a.cycles_at(s) - b.cycles_at(s)).abs();
    upper_median([0.0, 0.25, 0.5, 0.75, 1.0].map(apart).to_vec()).unwrap_or(0.0)
}

impl Decomposition {
    /// Adds a rival for each oscillation, which the search need not have tried: the other parts in the noise
    /// that is left without that oscillation.
    pub(super) fn add_rivals(&mut self) {
        /// Signal-to-noise ratio, dB, above which no rival is added: coloured noise does not explain such a
        /// line.
        const STRONG_DB: f64 = 40.0;
        let atoms = &self.explanation.parts.atoms;
        let oscillations = self.read_oscillations();
        let mut found = Vec::new();
        for (k, atom) in atoms.iter().enumerate() {
            let Some(o) = atom.oscillation() else { continue };
            let strong = oscillations.iter().any(|r| r.atom == *o && r.snr_db > STRONG_DB);
            if strong {
                continue;
            }
            let mut rest = atoms.clone();
            rest.remove(k);
            let parts = Parts { trend: self.explanation.parts.trend, atoms: rest };
            let problem = with_noise_of(&self.problem, &parts);
            let rival = problem.fit_parts(&parts, 2);
            found.push(Rival { atoms: rival.parts.atoms, criterion: rival.criterion });
        }
        self.rivals.extend(found);
    }

    /// The components of the record with their verdicts, the largest first.
    pub(crate) fn components(&self, record: &SampledRecord, settings: &SpectrumSettings) -> Vec<Component> {
        let frames = record.samples.len();
        let resolution_hz = record.frame_rate_hz / frames as f64;
        let mut read: Vec<(Component, Vec<String>)> = Vec::new();
        let mut readings = self.read_oscillations();
        readings.retain(|reading| !reading.atom.is_single_swing());
        let mut readings = self.unite_pieces(readings);
        readings.iter_mut().for_each(|reading| self.follow_drift(reading));
        let with_ridge = readings.iter().filter(|reading| reading.has_ridge);
        let followed: Vec<FrequencyRange> = with_ridge
            .filter_map(|reading| reading.range)
            .chain(self.list_courses().map(|(course, _)| course.range))
            .collect();
        let left = self.find_narrow_rest();
        for reading in &readings {
            let component = self.to_component(reading, record, resolution_hz);
            let mut doubts = self.list_doubts(reading, resolution_hz);
            if left.as_ref().is_some_and(|band| self.is_incomplete(reading, band)) {
                doubts.push(
                    "most of what no component describes lies around it: its description is incomplete"
                        .to_owned(),
                );
            }
            doubts.extend(reading.describe_larger(&readings, &followed));
            let multiples = reading.atom.multiples.iter().zip(&reading.amplitudes_m[1..]);
            read.extend(multiples.map(|(multiple, [a, b])| {
                (to_harmonic(&component, *multiple, math::hypot(*a, *b), record.frame_rate_hz), Vec::new())
            }));
            read.push((component, doubts));
        }
        for (course, amplitudes) in self.list_courses() {
            let component = self.to_course_component(course, amplitudes[0]);
            let doubts = list_course_doubts(course);
            let multiples = course.multiples.iter().zip(amplitudes[1..].chunks(2));
            read.extend(multiples.map(|(multiple, pair)| {
                let ratio = math::hypot(pair[0], pair[1]) / amplitudes[0].abs();
                let amplitude_m = ratio * component.amplitude_m;
                (to_harmonic(&component, *multiple, amplitude_m, record.frame_rate_hz), Vec::new())
            }));
            read.push((component, doubts));
        }
        math::sort_by_number(&mut read, |a| -a.0.amplitude_m);
        let (mut components, doubts): (Vec<_>, Vec<_>) = read.into_iter().unzip();
        let evidence = |doubts| Evidence { doubts, ..Evidence::default() };
        let evidence: Vec<Evidence> = doubts.into_iter().map(evidence).collect();
        classify_components(&mut components, &evidence, &RecordContext::new(record, resolution_hz, settings));
        components
    }

    /// The band around a component that holds most of what the explanation leaves as coloured noise; `None`
    /// in white noise.
    fn find_narrow_rest(&self) -> Option<NarrowBand> {
        let white = (self.problem.order > 0).then(|| self.problem.clone().with_noise(&[]))?;
        NarrowBand::find_band(&white, &self.explanation.parts)
    }

    /// Whether a component lies in a band of which the explanation leaves more than a small part of the
    /// energy of this component.
    fn is_incomplete(&self, reading: &OscillationReading, band: &NarrowBand) -> bool {
        /// Fraction of the energy of a component that nothing needs to describe.
        const LEAST_LEFT: f64 = 1e-3;
        let energy_m2 = reading.energy * reading.noise_m * reading.noise_m;
        band.contains(&reading.atom) && band.energy * self.scale_m * self.scale_m > LEAST_LEFT * energy_m2
    }

    /// Unites oscillations that may be pieces of one: those for which `may_be_one` holds and those of a
    /// cluster, if they are closer than `CLUSTER_REACH`. If one of such a group has most of the energy, a
    /// single oscillation takes the place of the group. Its frequency is the mean of theirs, weighted by
    /// their energies.
    fn unite_pieces(&self, mut readings: Vec<OscillationReading>) -> Vec<OscillationReading> {
        /// A group is united if its strongest oscillation has more than this fraction of its energy.
        const MOST_ENERGY: f64 = 0.6;
        math::sort_by_number(&mut readings, |reading| -reading.energy);
        let clustered: Vec<bool> = readings.iter().map(|r| self.count_cluster(&r.atom) >= CLUSTER).collect();
        let is_piece = |a: usize, b: usize| {
            let (one, other) = (&readings[a].atom, &readings[b].atom);
            let together = clustered[a] && clustered[b];
            (together || may_be_one(one, other)) && median_distance(one, other) < CLUSTER_REACH
        };
        let mut united = Vec::new();
        for group in group_linked(readings.len(), is_piece) {
            let group: Vec<OscillationReading> = group.iter().map(|k| readings[*k].clone()).collect();
            let total: f64 = group.iter().map(|reading| reading.energy).sum();
            if group.len() > 1 && group[0].energy > MOST_ENERGY * total {
                united.push(OscillationReading::unite(&group));
            } else {
                united.extend(group);
            }
        }
        united
    }

    /// Takes the range of a drifting oscillation from its ridge, if the ridge extends from the first frame to
    /// the last: a polynomial swings at the ends of a record.
    fn follow_drift(&self, reading: &mut OscillationReading) {
        if reading.range.is_none() {
            return;
        }
        let atoms = &self.explanation.parts.atoms;
        let k = atoms.iter().position(|atom| atom.oscillation() == Some(&reading.atom));
        let ridge = k.and_then(|k| course::follow_oscillation(&self.problem, &self.explanation, k));
        let same = |ridge: &Ridge| (RidgeMean::from_ridge(ridge).frequency_hz - reading.cycles).abs() < 1.0;
        if let Some(range) = ridge.filter(same).and_then(|ridge| ridge.range_hz()) {
            reading.range = Some(range);
            reading.has_ridge = true;
        }
    }

    /// The oscillations along ridges with the amplitudes of their columns.
    fn list_courses(&self) -> impl Iterator<Item = (&CourseAtom, &[f64])> {
        let atoms = self.explanation.atoms_with_amplitudes();
        atoms.filter_map(|(atom, amplitudes)| Some((atom.course()?, amplitudes)))
    }

    /// The component of an oscillation along a ridge, without a verdict.
    fn to_course_component(&self, course: &CourseAtom, amplitude: f64) -> Component {
        let (hz, _, metres) = self.units();
        let metres = metres * amplitude.abs();
        let mean = course.mean();
        Component {
            frequency_hz: mean.frequency_hz * hz,
            frequency_sd_hz: mean.frequency_sd_hz * hz,
            range_hz: Some(course.range.times(hz)),
            amplitude_m: mean.amplitude_m * metres,
            amplitude_sd_m: mean.amplitude_sd_m * metres,
            snr_db: mean.snr_db,
            cramer_rao_hz: mean.frequency_sd_hz * hz,
            estimator: Estimator::Ridge,
            ..Component::default()
        }
    }

    /// The component of an oscillation, without a verdict.
    fn to_component(
        &self,
        reading: &OscillationReading,
        record: &SampledRecord,
        resolution_hz: f64,
    ) -> Component {
        let o = &reading.atom;
        let frames = record.samples.len();
        let duration_s = frames as f64 / record.frame_rate_hz;
        let ratio = |nepers: f64| nepers / math::hypot(nepers, TAU * o.cycles);
        let amplitude_m = reading.amplitude_m();
        let has_decay = o.phase.is_empty() && o.envelope.is_empty();
        let first = (o.onset * frames as f64).round() as usize;
        let nepers = o.nepers.unwrap_or(0.0) * (1.0 - o.onset);
        let alone = DecayingTone { amplitude_m, nepers, noise_m: reading.noise_m };
        let instants_sd = if reading.range.is_some() { INSTANTS_SD } else { 0.0 };
        Component {
            frequency_hz: reading.cycles * resolution_hz,
            frequency_sd_hz: math::hypot(reading.cycles_sd, instants_sd) * resolution_hz,
            range_hz: reading.range.map(|range| range.times(resolution_hz)),
            begins_s: (o.onset > 0.0).then_some(o.onset * duration_s),
            amplitude_m,
            amplitude_sd_m: reading.amplitude_sd_m,
            damping_ratio: has_decay.then(|| o.nepers.map_or(0.0, ratio)),
            damping_ratio_sd: has_decay.then(|| reading.nepers_sd / (TAU * o.cycles)),
            snr_db: reading.snr_db,
            cramer_rao_hz: alone.cramer_rao_bound_hz(frames - first, record.frame_rate_hz),
            estimator: Estimator::LeastSquares,
            ..Component::default()
        }
    }

    /// Reasons for which the frequency of an oscillation is in doubt.
    fn list_doubts(&self, reading: &OscillationReading, resolution_hz: f64) -> Vec<String> {
        let o = &reading.atom;
        let mut doubts = Vec::new();
        if reading.lead < 0.0 {
            doubts.push("the description of the window is more probable without it".to_owned());
        } else if reading.lead < CLEAR_LEAD {
            doubts.push(format!(
                "the description of the window is only {:.0} times as probable with it as without it",
                math::exp(reading.lead)
            ));
        }
        let parts = &self.explanation.parts;
        let is_slow = |a: &Atom| match a {
            Atom::Oscillation(o) => o.is_single_swing(),
            Atom::Course(_) => false,
            _ => true,
        };
        let steps = parts.atoms.iter().any(is_slow);
        let columns = parts.trend.column_count();
        let grown = columns > CUBIC_COLUMNS || steps;
        if grown && o.cycles < SLOW_CYCLES.max(SLOW_CYCLES_PER_COLUMN * columns as f64) {
            doubts.push(
                "it is slow and the slow motion is more than a cubic, so it may be a piece of that motion"
                    .to_owned(),
            );
        }
        let others = || parts.atoms.iter().filter_map(Atom::oscillation).filter(|other| *other != o);
        if reading.pieces > 1 {
            if reading.cycles_sd > MOST_SPREAD {
                doubts.push(format!(
                    "it combines several oscillations whose frequencies spread by {:.2e} Hz: one that changes, or several",
                    reading.cycles_sd * resolution_hz
                ));
            }
        } else if let Some(other) = others().find(|other| may_be_one(o, other)) {
            let apart = greatest_distance(o, other);
            doubts.push(format!(
                "another component is within {apart:.2} resolutions of it: both may be pieces of one"
            ));
        } else if self.count_cluster(o) >= CLUSTER {
            doubts.push(
                "it is one of several that lie close together: they may be pieces of one that changes"
                    .to_owned(),
            );
        }
        if self.crosses_larger(reading) {
            doubts.push(
                "its frequency crosses that of a much larger component: it may be a piece of that one"
                    .to_owned(),
            );
        }
        if is_transient(o) && others().filter(|other| is_transient(other)).count() >= CROWD {
            doubts.push(
                "four or more components begin or end within the window: they may be noise or a jump"
                    .to_owned(),
            );
        }
        // two amplitudes of each multiple, the shape and the onset
        let own = reading.amplitudes_m.len() * 2 + Atom::Oscillation(o.clone()).parameters().len() + 1;
        if o.onset > 0.0 && (PARAMETERS_WITHIN * own) as f64 > o.duration() * self.problem.len() as f64 {
            doubts.push(
                "it begins within the window and lasts for few frames, like a burst of noise".to_owned(),
            );
        }
        let lasts = o.nepers.map_or(0.0, |d| d * (1.0 - o.onset));
        if o.onset > 0.0 && lasts < LEAST_DECAY {
            doubts.push(
                "it begins within the window and hardly decays: it may be a beat of two lines".to_owned(),
            );
        }
        if reading.scatter > MOST_SCATTER {
            doubts.push(
                "its frequency differs between parts of the window: it is not one oscillation".to_owned(),
            );
        }
        if PARAMETERS_WITHIN * (parts.parameter_count() + self.problem.order) > self.problem.len() {
            doubts.push(
                "the window has too few frames for the number of parameters that describe it".to_owned(),
            );
        }
        if reading.cycles_sd > (2.0 * reading.own_cycles_sd).max(0.05) {
            doubts.push(format!(
                "descriptions that are nearly as probable widen its standard deviation to {:.2e} Hz",
                reading.cycles_sd * resolution_hz
            ));
        }
        doubts
    }

    /// Whether an oscillation drifts across the frequency of one that is more than `MUCH_LARGER` times as
    /// large.
    fn crosses_larger(&self, reading: &OscillationReading) -> bool {
        let o = &reading.atom;
        if o.phase.is_empty() {
            return false;
        }
        let (low, high) = o.cycles_range();
        let own_m = math::hypot(reading.amplitudes_m[0][0], reading.amplitudes_m[0][1]);
        self.explanation.atoms_with_amplitudes().any(|(atom, amplitudes)| {
            atom.oscillation().is_some_and(|other| {
                let size_m = math::hypot(amplitudes[0], amplitudes[1]) * self.scale_m;
                size_m > MUCH_LARGER * own_m && (low - 1.0..high + 1.0).contains(&other.mean_cycles())
            })
        })
    }

    /// Number of oscillations in the cluster of `o`, in which each is close to another one.
    fn count_cluster(&self, o: &OscillationAtom) -> usize {
        let all: Vec<&OscillationAtom> =
            self.explanation.parts.atoms.iter().filter_map(Atom::oscillation).collect();
        let is_close = |a: usize, b: usize| median_distance(all[a], all[b]) < CLUSTER_REACH;
        let groups = group_linked(all.len(), is_close);
        groups.iter().find(|group| group.iter().any(|k| all[*k] == o)).map_or(1, Vec::len)
    }

    /// The oscillations of the explanation.
    fn read_oscillations(&self) -> Vec<OscillationReading> {
        let parts = &self.explanation.parts;
        let linear = self.explanation.amplitudes.len() + parts.trend.column_count();
        let shapes: usize = parts.atoms.iter().map(|a| a.parameters().len()).sum();
        let freedoms = (self.problem.len() as f64 - (linear + shapes) as f64).max(1.0);
        let variance = self.explanation.squares / freedoms;
        let covariance = self.problem.products_around(&self.explanation).covariance() * variance;
        let mut row = 0;
        let mut found = Vec::new();
        for (atom, amplitudes) in self.explanation.atoms_with_amplitudes() {
            let size = amplitudes.len() + atom.parameters().len();
            if let Some(o) = atom.oscillation() {
                let own = covariance.view((row, row), (size, size)).into_owned();
                found.push(self.read_oscillation(o, amplitudes, &own, variance));
            }
            row += size;
        }
        found
    }

    /// Reads an oscillation. `all` is the covariance of its amplitudes and shape parameters, and `variance`
    /// that of the whitened residual.
    fn read_oscillation(
        &self,
        o: &OscillationAtom,
        amplitudes: &[f64],
        all: &DMatrix<f64>,
        variance: f64,
    ) -> OscillationReading {
        let (linear, shapes) = (amplitudes.len(), all.nrows() - amplitudes.len());
        let covariance = all.view((linear, linear), (shapes, shapes));
        let columns = Atom::Oscillation(o.clone()).columns(&self.problem.at);
        let mut value = vec![0.0; self.problem.len()];
        for (column, a) in columns.iter().zip(amplitudes).take(2) {
            value.iter_mut().zip(column).for_each(|(x, c)| *x += a * c);
        }
        let plain = problem::dot(&value, &value);
        let white = self.problem.whiten_values(value);
        let energy = problem::dot(&white, &white) / variance;
        let cycles = o.mean_cycles();
        // gradient of the mean frequency with respect to the shape parameters
        let first_phase = 1 + usize::from(o.nepers.is_some());
        let gradient = |i: usize| match i {
            0 => 1.0,
            i if (first_phase..first_phase + o.phase.len()).contains(&i) => {
                let mut moved = o.clone();
                moved.phase[i - first_phase] += 1.0;
                moved.mean_cycles() - cycles
            }
            _ => 0.0,
        };
        let n = covariance.nrows();
        let gradient: Vec<f64> = (0..n).map(gradient).collect();
        let pairs = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
        let own: f64 = pairs.map(|(i, j)| gradient[i] * gradient[j] * covariance[(i, j)]).sum();
        // where the oscillation begins and ends is known to half a frame, or to half an interval of a
        // polynomial amplitude, which changes the mean of a drifting frequency
        let (low, high) = if o.phase.is_empty() { (0.0, 0.0) } else { o.cycles_range() };
        let step = if o.envelope.is_empty() {
            1.0 / self.problem.at.frames as f64
        } else {
            1.0 / (INTERVALS as f64 * o.duration())
        };
        let own_cycles_sd = math::hypot(own.max(0.0).sqrt(), 0.5 * (high - low) * step);
        let range = (!o.phase.is_empty()).then(|| read_range(o, &covariance.into_owned()));
        let (spread, lead) = self.average_rivals(o, cycles);
        let scatter = self.frequency_scatter(o, amplitudes, &columns, variance);
        let own_cycles_sd =
            if scatter > CHANCE_SCATTER { own_cycles_sd * scatter.sqrt() } else { own_cycles_sd };
        OscillationReading {
            cycles,
            cycles_sd: math::hypot(own_cycles_sd, spread),
            own_cycles_sd,
            range,
            has_ridge: false,
            nepers_sd: o.nepers.map_or((12.0 / energy).sqrt(), |_| covariance[(1, 1)].max(0.0).sqrt()),
            amplitude_sd_m: amplitude_sd(amplitudes, all) * self.scale_m,
            // (the energy is that of the oscillation over the variance of the noise; two resolutions hold
            // four of its degrees of freedom)
            energy,
            pieces: 1,
            snr_db: 10.0 * math::log10((energy / 4.0).max(1e-9)),
            noise_m: (plain / energy.max(1e-300)).sqrt() * self.scale_m,
            amplitudes_m: amplitudes.chunks(2).map(|c| [c[0] * self.scale_m, c[1] * self.scale_m]).collect(),
            lead,
            scatter,
            atom: o.clone(),
        }
    }

    /// Chi squared, per degree of freedom, of the frequencies that fit parts of the record best, each part
    /// with a quarter of the energy of the oscillation. About 1 for an oscillation that is as described, more
    /// for a piece of noise or of another motion.
    fn frequency_scatter(
        &self,
        o: &OscillationAtom,
        amplitudes: &[f64],
        columns: &[Vec<f64>],
        variance: f64,
    ) -> f64 {
        /// Number of parts: with more, each has too little energy for a frequency of its own.
        const SEGMENTS: usize = 4;
        let atom = Atom::Oscillation(o.clone());
        let by_cycles = atom.derivatives(&self.problem.at, columns, amplitudes).swap_remove(0);
        let value = |i: usize| columns.iter().zip(amplitudes).map(|(c, a)| c[i] * a).sum::<f64>();
        let energies: Vec<f64> = (0..by_cycles.len()).map(|i| math::powi(value(i), 2)).collect();
        let total: f64 = energies.iter().sum();
        let by_cycles = self.problem.whiten_values(by_cycles);
        let fixed: Vec<Vec<f64>> =
            columns.iter().take(2).map(|column| self.problem.whiten_values(column.clone())).collect();
        let residual = &self.explanation.residual;
        let mut shifts = Vec::new();
        let (mut first, mut sum) = (0, 0.0);
        for (i, energy) in energies.iter().enumerate() {
            sum += energy;
            if sum < total * (shifts.len() + 1) as f64 / SEGMENTS as f64 && i + 1 < energies.len() {
                continue;
            }
            let part = first..i + 1;
            first = i + 1;
            let mut basis = problem::Basis::default();
            fixed.iter().for_each(|column| basis.push_column(column[part.clone()].to_vec()));
            let mut slope = by_cycles[part.clone()].to_vec();
            basis.project_out(&mut slope);
            let mut left = residual[part].to_vec();
            basis.project_out(&mut left);
            let information = problem::dot(&slope, &slope) / variance;
            shifts.push((problem::dot(&slope, &left) / variance / information.max(1e-300), information));
        }
        let weight: f64 = shifts.iter().map(|(_, w)| w).sum();
        let mean = shifts.iter().map(|(x, w)| x * w).sum::<f64>() / weight.max(1e-300);
        let chi2: f64 = shifts.iter().map(|(x, w)| w * (x - mean) * (x - mean)).sum();
        chi2 / (shifts.len().max(2) - 1) as f64
    }

    /// Spread of the frequency among the rivals, cycles per record: rms distance from `cycles`, weighted by
    /// their odds. And the lead over the best rival that has no oscillation near it, nats.
    fn average_rivals(&self, o: &OscillationAtom, cycles: f64) -> (f64, f64) {
        let (mut weights, mut sum, mut lead) = (1.0, 0.0, f64::INFINITY);
        let reach = 1.5 + o.nepers.map_or(0.0, |d| d.abs() / TAU);
        for rival in &self.rivals {
            let behind = rival.criterion - self.explanation.criterion;
            let means = rival.atoms.iter().filter_map(Atom::oscillation).map(OscillationAtom::mean_cycles);
            let nearest = means.min_by(|a, b| (a - cycles).abs().total_cmp(&(b - cycles).abs()));
            match nearest.filter(|near| (near - cycles).abs() < reach) {
                None => lead = lead.min(behind),
                Some(near) if behind > 1e-9 && behind < FURTHEST => {
                    let weight = math::exp(-behind);
                    weights += weight;
                    sum += weight * (near - cycles) * (near - cycles);
                }
                Some(_) => {}
            }
        }
        ((sum / weights).sqrt(), lead)
    }
}
