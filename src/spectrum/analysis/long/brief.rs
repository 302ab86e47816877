//! What a long record holds for a short time only, read from pieces of it that are taken apart.

use super::pieces::{self, UnusualSegment};
use crate::math;
use crate::spectrum::analysis::{SampledRecord, SpectralAnalysis};
use crate::spectrum::judge::SINGLE_CYCLE_DAMPING;
use crate::spectrum::{Component, ComponentReason, ComponentVerdict, SpectrumSettings};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Pieces of a length, frames.
struct SegmentScale {
    length: usize,
    /// How many are taken apart.
    most: usize,
    /// Whether the first one always is: what is over soon after a record starts is hidden by a window that
    /// starts at zero.
    first: bool,
}

/// An oscillation shows best in pieces as long as it lasts. The longest take most of the time.
const SCALES: [SegmentScale; 3] = [
    SegmentScale { length: 4096, most: 2, first: false },
    SegmentScale { length: 1024, most: 4, first: true },
    SegmentScale { length: 256, most: 4, first: true },
];
/// Resolutions of a piece within which two components are one.
const SAME_WITHIN_RESOLUTIONS: f64 = 2.0;
/// Deviations within which they are.
const SAME_WITHIN_DEVIATIONS: f64 = 3.0;
/// Nepers after which an oscillation is over: a twentieth is left.
const NEPERS_UNTIL_OVER: f64 = 3.0;
/// Nepers by which one falls that is no steady line whose amplitude wavers, and that soon ends.
const NEPERS_OF_DECAY: f64 = 1.0;

/// A component that was read from a piece.
#[derive(Debug)]
pub(super) struct TransientComponent {
    pub component: Component,
    /// First frame of the stretch that was taken apart.
    first: usize,
    resolution_hz: f64,
    /// Nepers by which it has decayed at the end of the stretch.
    nepers: f64,
}

impl TransientComponent {
    /// Whether a component cannot be told from this one.
    pub(super) fn matches_component(&self, other: &Component) -> bool {
        let c = &self.component;
        let sd_hz = math::hypot(c.frequency_sd_hz, other.frequency_sd_hz);
        let within_hz = (SAME_WITHIN_RESOLUTIONS * self.resolution_hz).max(SAME_WITHIN_DEVIATIONS * sd_hz);
        let holds = |a: &Component, b: &Component| {
            a.range_hz.is_some_and(|range| (range.low_hz..=range.high_hz).contains(&b.frequency_hz))
        };
        (c.frequency_hz - other.frequency_hz).abs() < within_hz || holds(c, other) || holds(other, c)
    }

    /// Whether a component that changes over the window is what this one shows there: a line as wide as it
    /// decays.
    pub(super) fn explains_component(&self, other: &Component) -> bool {
        let c = &self.component;
        let width_hz = c.damping_ratio.map_or(0.0, |ratio| 2.0 * ratio * c.frequency_hz);
        self.matches_component(other) || (c.frequency_hz - other.frequency_hz).abs() < width_hz
    }

    /// With a doubt where it does not fall: what goes on outside the stretch may be another frequency.
    fn with_persistence_doubt(mut self) -> Self {
        if self.nepers < NEPERS_OF_DECAY {
            let words = "it goes on outside the part of the window in which it was read, and may drift or \
                         change there"
                .to_owned();
            let reasons = &mut self.component.reasons;
            reasons.push(ComponentReason { verdict: ComponentVerdict::Ambiguous, words });
            reasons.sort_by_key(|reason| reason.verdict);
            self.component.verdict = reasons[0].verdict;
        }
        self
    }

    /// Whether the piece says more of it than a window over which it changes.
    pub(super) fn is_more_specific(&self) -> bool {
        self.nepers > NEPERS_OF_DECAY || self.component.range_hz.is_some()
    }
}

/// Every component that is there for a short time, once.
pub(super) fn find_transients(
    record: &SampledRecord,
    settings: &SpectrumSettings,
) -> Vec<TransientComponent> {
    let band_hz = settings.band_hz.unwrap_or((0.0, record.frame_rate_hz / 2.0));
    let band = (band_hz.0 / record.frame_rate_hz, (band_hz.1 / record.frame_rate_hz).min(0.5));
    let of_scale = |scale: &SegmentScale| {
        let pieces = pieces::cut_segments(record.samples, scale.length, band);
        let chosen = pieces::select_most_unusual(&pieces, scale.most);
        let is_read = |k: usize| chosen.contains(&k) || (scale.first && k == 0);
        let numbered = pieces.into_iter().enumerate();
        numbered.filter(|(k, _)| is_read(*k)).map(|(_, piece)| piece).collect::<Vec<_>>()
    };
    let pieces: Vec<UnusualSegment> = SCALES.iter().flat_map(of_scale).collect();
    let mut found: Vec<TransientComponent> = pieces
        .par_iter()
        .flat_map_iter(|piece| {
            let samples = &record.samples[piece.frames.clone()];
            read_segment_transients(&SampledRecord { samples, ..*record }, settings, piece)
        })
        .collect();
    found.sort_by(|a, b| a.component.frequency_sd_hz.total_cmp(&b.component.frequency_sd_hz));
    let mut once: Vec<TransientComponent> = Vec::new();
    for brief in found {
        // two of one piece are two
        let known = |known: &TransientComponent| {
            (known.first, known.resolution_hz) != (brief.first, brief.resolution_hz)
                && (known.matches_component(&brief.component) || brief.matches_component(&known.component))
        };
        if !once.iter().any(known) {
            once.push(brief);
        }
    }
    once
}

/// The components of a piece that are not there all the time: those at whose frequency it exceeds the normal,
/// and those that are over within it; but none that is over within a cycle, as every step would give one.
fn read_segment_transients(
    of_piece: &SampledRecord,
    settings: &SpectrumSettings,
    piece: &UnusualSegment,
) -> Vec<TransientComponent> {
    let rate_hz = of_piece.frame_rate_hz;
    let passes = |brief: &TransientComponent| {
        let c = &brief.component;
        let (low_hz, high_hz) =
            c.range_hz.map_or((c.frequency_hz, c.frequency_hz), |range| (range.low_hz, range.high_hz));
        let step = c.damping_ratio.is_some_and(|ratio| ratio > SINGLE_CYCLE_DAMPING);
        !step
            && (brief.nepers > NEPERS_UNTIL_OVER
                || piece.exceeds_normal_power(low_hz / rate_hz, high_hz / rate_hz))
    };
    let analyses = SpectralAnalysis::analyse_between_steps(of_piece, settings);
    let of_stretch =
        |analysis: SpectralAnalysis| transients_between_steps(analysis, piece.frames.start, rate_hz);
    analyses
        .into_iter()
        .flat_map(of_stretch)
        .filter(passes)
        .map(TransientComponent::with_persistence_doubt)
        .collect()
}

/// The components of a stretch of a piece that begins at a frame.
fn transients_between_steps(
    analysis: SpectralAnalysis,
    start: usize,
    rate_hz: f64,
) -> impl Iterator<Item = TransientComponent> {
    let first = start + analysis.skipped_frames;
    let lasts_s = analysis.residual_m.len() as f64 / rate_hz;
    let resolution_hz = analysis.spectrum.resolution_hz;
    analysis.spectrum.components.into_iter().map(move |c| {
        let nepers = decay_nepers(&c, lasts_s);
        let begins_s = first as f64 / rate_hz + c.begins_s.unwrap_or(0.0);
        let component = Component { begins_s: (begins_s > 0.0).then_some(begins_s), ..c };
        TransientComponent { component, first, resolution_hz, nepers }
    })
}

/// Nepers by which a component decays before the end of a record; 0 where they may be none.
fn decay_nepers(c: &Component, lasts_s: f64) -> f64 {
    let decays =
        c.damping_ratio.zip(c.damping_ratio_sd).filter(|(ratio, sd)| *ratio > SAME_WITHIN_DEVIATIONS * sd);
    decays.map_or(0.0, |(ratio, _)| {
        TAU * c.frequency_hz * ratio / (1.0 - ratio * ratio).sqrt() * (lasts_s - c.begins_s.unwrap_or(0.0))
    })
}
