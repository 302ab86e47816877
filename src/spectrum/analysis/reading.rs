//! What a record's parts say once they are fitted: components with their deviations, and the evidence for and
//! against each.

use super::{Analysis, Oscillation, Record, Removed};
use crate::math;
use crate::spectrum::cramer_rao::Tone;
use crate::spectrum::drifting::{Course, Mean};
use crate::spectrum::judge::{Circumstances, Evidence, judge};
use crate::spectrum::least_squares::{Care, Covariance, Deviations, Free, Term};
use crate::spectrum::left_over::NEIGHBOURHOOD;
use crate::spectrum::oscillations::{Explained, Parts, Search};
use crate::spectrum::peaks::Peak;
use crate::spectrum::periodogram::Periodogram;
use crate::spectrum::trend::Trend;
use crate::spectrum::{Component, Detrend, Estimator, Settings, Spectrum};
use std::f64::consts::TAU;

/// Deviations from zero from which a decay is one; below, the amplitude is that of a steady oscillation.
const DECAYS: f64 = 3.0;

/// Waves of a trend that could grow no further, within which a component may be a piece of the flip.
const EXHAUSTED: f64 = 2.0;
/// Cycles below which an oscillation may be a piece of what a trend of more columns than a cubic's describes:
/// a camera that shakes gives such pieces.
const SLOW: f64 = 6.5;
const FEWEST_COLUMNS: usize = 4;
/// Others near an oscillation that make a crowd.
const CROWD: usize = 2;
/// Resolutions within which two oscillations that are not both steady may be pieces of one: the window hardly
/// tells them apart, and each makes up for what the other is not.
const TOGETHER: f64 = 2.0;
/// Resolutions by which a companion that cannot be resolved moves a frequency, for each part of the
/// amplitude that is left: of pairs half a resolution to one apart with equal amplitudes, the worst of fifty
/// was off by 4.6.
const COMPANION: f64 = 2.0;
/// Deviation of a frequency that no oscillation explains, resolutions: anywhere within one of its peak.
const UNEXPLAINED: f64 = 0.577;

/// A record explained, with what its least squares say of the parts.
pub(super) struct Reading<'a> {
    search: &'a Search<'a>,
    /// With every decay free: damping is read from it.
    free: Parts,
    covariance_free: Covariance,
    /// The same with a trend of two columns more, to see what depends on it.
    richer: Option<Parts>,
    /// With decays that are none held at none: frequency and amplitude are read from it.
    explained: Explained,
    covariance: Covariance,
    /// Terms that drift or fade evenly.
    unsteady: Vec<usize>,
}

impl<'a> Reading<'a> {
    pub(super) fn of(search: &'a Search<'a>, explained: Explained) -> Option<Self> {
        let free = explained.parts.clone();
        let problem = &free.problem;
        let covariance_free = problem.covariance(&free.solved)?;
        let noise_m = search.periodogram.deviation(explained.found.floor_m);
        let steady = |(k, term): (usize, &Term)| {
            let sd = covariance_free.deviations(k, problem.pair(&free.solved, k)).nepers * noise_m;
            let is_steady = term.free == Free::Both && term.nepers.abs() < DECAYS * sd;
            if is_steady { Term { nepers: 0.0, free: Free::Cycles, ..*term } } else { *term }
        };
        let terms: Vec<Term> = free.solved.terms.iter().enumerate().map(steady).collect();
        let explained = if terms == free.solved.terms {
            explained
        } else {
            search.explain(Parts { problem: problem.clone(), solved: problem.solve(&terms, Care::Final)? })
        };
        let covariance = problem.covariance(&explained.parts.solved)?;
        let richer = search.with_richer_trend(&free);
        let unsteady = search.unsteady(&explained);
        Some(Self { search, free, covariance_free, richer, explained, covariance, unsteady })
    }

    pub(super) fn analysis(&self, record: &Record, settings: &Settings, course: Option<Course>) -> Analysis {
        let parts = &self.explained.parts;
        let problem = &parts.problem;
        let oscillations: Vec<usize> =
            (0..parts.solved.terms.len()).filter(|k| parts.solved.terms[*k].cycles > 0.0).collect();
        let courses: Vec<Vec<f64>> =
            oscillations.iter().map(|k| problem.of_term(&parts.solved, *k)).collect();
        let mut model_m = vec![0.0; record.samples.len()];
        courses.iter().for_each(|course| model_m.iter_mut().zip(course).for_each(|(sum, x)| *sum += x));
        let removed_m = self.search.removed(parts);
        let whole = Periodogram::of(
            &vec![Some(0.0); record.samples.len()],
            2 * (self.explained.amplitude_m.len() - 1),
        );
        let (amplitude_m, leakage_m) =
            (whole.amplitudes(&self.curve(&model_m)), whole.amplitudes(&removed_m));
        let bin_hz = record.frame_rate_hz / (2 * (amplitude_m.len() - 1)) as f64;
        let (low, high) = settings.band_hz.unwrap_or((0.0, record.frame_rate_hz / 2.0));
        let mut read: Vec<(Component, Evidence)> = oscillations
            .iter()
            .zip(&courses)
            .map(|(k, course)| self.component(*k, course, &leakage_m))
            .collect();
        read.extend(course.as_ref().and_then(|course| self.drifting(course)));
        read.extend(self.search.unexplained(&self.explained).iter().map(|peak| self.unexplained(peak)));
        read.sort_by(|a, b| b.0.amplitude_m.total_cmp(&a.0.amplitude_m));
        let (mut components, evidence): (Vec<_>, Vec<_>) = read.into_iter().unzip();
        let circumstances = Circumstances {
            frame_rate_hz: record.frame_rate_hz,
            exposure_s: record.exposure_s,
            resolution_hz: self.search.resolution_hz(),
            fastest_hz: settings.fastest_hz,
        };
        judge(&mut components, &evidence, &circumstances);
        components.retain(|c| (low..=high).contains(&c.frequency_hz));
        components.truncate(settings.max_components);
        let spectrum = Spectrum {
            frequency_hz: (0..amplitude_m.len()).map(|k| k as f64 * bin_hz).collect(),
            noise_floor_m: self.explained.found.floor_m,
            resolution_hz: self.search.resolution_hz(),
            noise_bandwidth_hz: self.search.periodogram.noise_bandwidth_hz(record.frame_rate_hz),
            present: self.search.periodogram.sums.present as f64 / record.samples.len() as f64,
            components,
            amplitude_m,
        };
        let relaxations = parts.solved.terms.len() - oscillations.len();
        let removed = Removed { detrend: settings.detrend.unwrap_or(chosen(parts.trend())), relaxations };
        Analysis {
            spectrum,
            left_out: 0,
            stride: 1,
            removed,
            removed_m,
            leakage_m,
            model_m,
            left_m: self.explained.left.clone(),
            oscillations: oscillations.iter().map(|k| self.oscillation(*k)).collect(),
            ridge: course.map(|course| course.ridge),
            multitaper: None,
            noise_floor_m: Vec::new(),
        }
    }

    /// What the spectrum is of, m: the components in every frame, so that gaps do not spread them, the rest
    /// where it is known.
    fn curve(&self, model_m: &[f64]) -> Vec<f64> {
        // the weights of a Hann window add up to half its frames
        let share = self.search.periodogram.sums.first / (model_m.len() as f64 / 2.0);
        self.explained.left.iter().zip(model_m).map(|(left, m)| m + left.unwrap_or(0.0) / share).collect()
    }

    fn component(&self, k: usize, course: &[f64], leakage_m: &[f64]) -> (Component, Evidence) {
        let parts = &self.explained.parts;
        let problem = &parts.problem;
        let (term, free) = (&parts.solved.terms[k], &self.free.solved.terms[k]);
        let pair = problem.pair(&parts.solved, k);
        let (noise_m, resolution_hz) = (self.noise_near(term.cycles), self.search.resolution_hz());
        let sd = self.covariance.deviations(k, pair);
        let sd_free = self.covariance_free.deviations(k, problem.pair(&self.free.solved, k));
        let shift = self.shift(k);
        let stays = term.free == Free::Both || term.free == Free::Cycles;
        let cycles_sd = if stays { sd.cycles * noise_m } else { UNEXPLAINED };
        let amplitude_m = math::hypot(pair[0], pair[1]);
        let (left, level) = if term.is_brief() {
            let left_m = self.search.left_in_envelope(&self.explained, term);
            (left_m / amplitude_m, self.search.level_in_envelope(&self.explained, term, amplitude_m))
        } else {
            let shown_m = self.search.shown(parts, k);
            let left_m = self.search.left_next_to(&self.explained, term);
            (left_m / shown_m, shown_m / self.search.floor_near(&self.explained, term.cycles))
        };
        let piece = self.piece(k);
        // resolutions, so cycles
        let companion =
            math::hypot(COMPANION * left, piece.as_ref().map_or(0.0, |piece| piece.apart * piece.share));
        let damping = matches!(free.free, Free::Both | Free::Nepers).then(|| {
            damping_ratio(
                free,
                math::hypot(math::hypot(sd_free.nepers * noise_m, shift.nepers), TAU * companion),
            )
        });
        let exhausted =
            self.search.grows && self.richer.is_none() && term.cycles < EXHAUSTED * parts.trend().waves();
        let evidence = Evidence {
            exhausted,
            shift: shift.cycles / cycles_sd,
            left,
            unsteady: self.unsteady.contains(&k),
            slow: self.is_slow(k),
            crowded: self.is_crowded(k),
            nearest: self.nearest(k),
            piece: piece.map(|piece| piece.apart),
            stays,
            ..Evidence::default()
        };
        let bins_a_cycle = 2.0 * (leakage_m.len() - 1) as f64 / course.len() as f64;
        let frames = course.len() - term.first;
        let nepers = term.nepers * frames as f64 / course.len() as f64;
        let alone = Tone { amplitude_m, nepers, noise_m };
        let component = Component {
            frequency_hz: term.cycles * resolution_hz,
            frequency_sd_hz: math::hypot(math::hypot(cycles_sd, shift.cycles), companion) * resolution_hz,
            begins_s: (term.first > 0).then(|| term.first as f64 / self.search.frame_rate_hz),
            amplitude_m,
            amplitude_sd_m: math::hypot(
                math::hypot(sd.amplitude * noise_m, shift.amplitude * amplitude_m),
                left * amplitude_m,
            ),
            damping_ratio: damping.map(|d| d.0),
            damping_ratio_sd: damping.map(|d| d.1),
            snr_db: 20.0 * math::log10(level),
            cramer_rao_hz: alone.frequency_hz(frames, self.search.frame_rate_hz),
            trend_shift_hz: self.richer.is_some().then_some(shift.cycles * resolution_hz),
            leakage_m: leakage_m.get((term.cycles * bins_a_cycle).round() as usize).copied(),
            ..Component::of(Estimator::LeastSquares)
        };
        (component, evidence)
    }

    /// Whether it is as slow as the waves of a trend that had to grow.
    fn is_slow(&self, k: usize) -> bool {
        let parts = &self.explained.parts;
        let grown = parts.trend().columns() > FEWEST_COLUMNS;
        self.search.grows && grown && parts.solved.terms[k].cycles < SLOW
    }

    /// Whether it and two more near it begin inside the record or are over soon.
    fn is_crowded(&self, k: usize) -> bool {
        let terms = &self.explained.parts.solved.terms;
        let near = |t: &&Term| t.is_brief() && (t.cycles - terms[k].cycles).abs() < NEIGHBOURHOOD;
        terms[k].is_brief() && terms.iter().filter(near).count() > CROWD
    }

    /// The nearest other oscillation within two resolutions or the width of the broader peak, where one of
    /// the two decays or begins inside the record: two that are steady are a pair.
    fn piece(&self, k: usize) -> Option<Piece> {
        let (parts, terms) = (&self.explained.parts, &self.explained.parts.solved.terms);
        let size_m = |k: usize| {
            let [cosine, sine] = parts.problem.pair(&parts.solved, k);
            math::hypot(cosine, sine)
        };
        let steady = |term: &Term| term.nepers == 0.0 && term.first == 0;
        // a decaying peak is as wide as it decays
        let width = |j: usize| (terms[j].nepers.max(terms[k].nepers) / TAU).max(TOGETHER);
        let piece = |j: usize| Piece {
            apart: (terms[j].cycles - terms[k].cycles).abs(),
            share: (size_m(j) / size_m(k)).min(1.0),
        };
        (0..terms.len())
            .filter(|j| *j != k && terms[*j].cycles > 0.0 && !(steady(&terms[*j]) && steady(&terms[k])))
            .filter_map(|j| Some(piece(j)).filter(|piece| piece.apart < width(j)))
            .min_by(|a, b| a.apart.total_cmp(&b.apart))
    }

    /// Distance to the nearest other oscillation, resolutions.
    fn nearest(&self, k: usize) -> Option<f64> {
        let terms = &self.explained.parts.solved.terms;
        let others = terms.iter().enumerate().filter(|(j, t)| *j != k && t.cycles > 0.0);
        others.map(|(_, t)| (t.cycles - terms[k].cycles).abs()).min_by(f64::total_cmp)
    }

    fn oscillation(&self, k: usize) -> Oscillation {
        let parts = &self.explained.parts;
        let (term, [cosine_m, sine_m]) = (&parts.solved.terms[k], parts.problem.pair(&parts.solved, k));
        let (frames, resolution_hz) = (self.search.samples.len() as f64, self.search.resolution_hz());
        // the phase is counted from the middle of the record, the envelope from half a frame before it
        let from_middle = (0.5 - frames / 2.0) / frames;
        Oscillation {
            frequency_hz: term.cycles * resolution_hz,
            decay_per_s: term.nepers * resolution_hz,
            amplitude_m: math::hypot(cosine_m, sine_m) * math::exp(-0.5 * term.nepers / frames),
            phase_rad: math::atan2(-sine_m, cosine_m) + TAU * term.cycles * from_middle,
            begins_s: term.first as f64 / self.search.frame_rate_hz,
        }
    }

    /// The component that a drifting course is.
    fn drifting(&self, course: &Course) -> Option<(Component, Evidence)> {
        let range = course.range?;
        let mean = Mean::of(&course.ridge);
        let alone = Tone {
            amplitude_m: mean.amplitude_m,
            nepers: 0.0,
            noise_m: self.noise_near(mean.frequency_hz / self.search.resolution_hz()),
        };
        let component = Component {
            frequency_hz: mean.frequency_hz,
            frequency_sd_hz: mean.frequency_sd_hz,
            range_hz: Some(range),
            amplitude_m: mean.amplitude_m,
            amplitude_sd_m: mean.amplitude_sd_m,
            snr_db: mean.snr_db,
            cramer_rao_hz: alone.frequency_hz(self.search.samples.len(), self.search.frame_rate_hz),
            ..Component::of(Estimator::Ridge)
        };
        let evidence = Evidence {
            stays: true,
            followed: Some(course.followed),
            strays: Some(course.strays()),
            drift: Some((range.high_hz - range.low_hz) / self.search.resolution_hz()),
            ..Evidence::default()
        };
        Some((component, evidence))
    }

    /// A peak that no decaying oscillation explains, as the windowed spectrum has it.
    fn unexplained(&self, peak: &Peak) -> (Component, Evidence) {
        let resolution_hz = self.search.resolution_hz();
        let noise_m = self.noise_near(self.search.cycles(peak));
        let alone = Tone { amplitude_m: peak.amplitude_m, nepers: 0.0, noise_m };
        let floor_m = self.search.floor_near(&self.explained, self.search.cycles(peak));
        let component = Component {
            frequency_hz: peak.frequency_hz,
            frequency_sd_hz: UNEXPLAINED * resolution_hz,
            amplitude_m: peak.amplitude_m,
            amplitude_sd_m: noise_m / self.search.periodogram.deviation(1.0)
                * std::f64::consts::FRAC_1_SQRT_2,
            snr_db: 20.0 * math::log10(peak.amplitude_m / floor_m),
            cramer_rao_hz: alone.frequency_hz(self.search.samples.len(), self.search.frame_rate_hz),
            ..Component::of(Estimator::Periodogram)
        };
        (component, Evidence::default())
    }

    /// What a term moves by with a richer trend: cycles, nepers, and the share of its amplitude half way
    /// through the record.
    fn shift(&self, k: usize) -> Deviations {
        let Some(richer) = &self.richer else {
            return Deviations { cycles: 0.0, nepers: 0.0, amplitude: 0.0 };
        };
        let half_way = |parts: &Parts| {
            let [cosine, sine] = parts.problem.pair(&parts.solved, k);
            math::hypot(cosine, sine) * math::exp(-parts.solved.terms[k].nepers / 2.0)
        };
        let (now, then) = (&self.free.solved.terms[k], &richer.solved.terms[k]);
        Deviations {
            cycles: (then.cycles - now.cycles).abs(),
            nepers: (then.nepers - now.nepers).abs(),
            amplitude: (half_way(richer) / half_way(&self.free) - 1.0).abs(),
        }
    }

    /// Standard deviation of white noise that leaves as much as is left around a frequency, m.
    fn noise_near(&self, cycles: f64) -> f64 {
        let Explained { parts, amplitude_m, .. } = &self.explained;
        let bins_a_cycle = 2.0 * (amplitude_m.len() - 1) as f64 / self.search.samples.len() as f64;
        let most = self.search.samples.len() as f64 / 2.0;
        let lowest = parts.trend().waves().min(most / 2.0);
        let low = (cycles - NEIGHBOURHOOD).min(most - 2.0 * NEIGHBOURHOOD).max(lowest);
        let high = (low + 2.0 * NEIGHBOURHOOD).min(most);
        let bin = |cycles: f64| ((cycles * bins_a_cycle) as usize).min(amplitude_m.len() - 1);
        let around = &amplitude_m[bin(low)..=bin(high)];
        let mean_square = around.iter().map(|a| a * a).sum::<f64>() / around.len() as f64;
        // every oscillation inside has taken up to four of the values with it
        let values = 2.0 * (high - low);
        let taken: f64 = parts
            .solved
            .terms
            .iter()
            .filter(|t| t.cycles > low && t.cycles < high)
            .map(|t| 2.0 + t.free.count() as f64)
            .sum();
        let share = (1.0 - taken / values).max(0.25);
        self.search.periodogram.deviation((mean_square / share).sqrt())
    }
}

/// Another oscillation that may be a piece of the same.
struct Piece {
    /// Distance, resolutions.
    apart: f64,
    /// Its amplitude over that of this one, at most 1.
    share: f64,
}

/// Damping ratio `d / sqrt(d^2 + (2 pi n)^2)` of `d` nepers in `n` cycles, and its deviation.
fn damping_ratio(term: &Term, nepers_sd: f64) -> (f64, f64) {
    let angle = TAU * term.cycles;
    let size = math::hypot(term.nepers, angle);
    (term.nepers / size, nepers_sd * math::powi(angle / size, 2) / size)
}

/// The detrending that a trend is.
fn chosen(trend: Trend) -> Detrend {
    match trend.columns() {
        0 => Detrend::None,
        1 => Detrend::Mean,
        2 => Detrend::Line,
        4 => Detrend::Cubic,
        columns => Detrend::Polynomial(columns - 1),
    }
}
