//! What a long record holds for a short time only, read from pieces of it that are taken apart.

use super::pieces::{self, Piece};
use crate::math;
use crate::spectrum::analysis::{Analysis, Record};
use crate::spectrum::{Component, Settings};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Lengths of the pieces, frames, and how many of each are taken apart besides the first: what is over in a
/// hundred frames drowns in the noise of the longer ones, which take a tenth of a second each.
const SCALES: [(usize, usize); 2] = [(4096, 3), (512, 6)];
/// Resolutions of a piece within which two components are one.
const TOGETHER: f64 = 2.0;
/// Deviations within which they are.
const DEVIATIONS: f64 = 3.0;
/// Nepers after which an oscillation is over: a twentieth is left.
const OVER: f64 = 3.0;

/// A component that was read from a piece.
#[derive(Debug)]
pub(super) struct Brief {
    pub component: Component,
    /// First frame of the stretch that was taken apart.
    first: usize,
    resolution_hz: f64,
    /// Whether it has decayed by the end of the stretch.
    is_over: bool,
}

impl Brief {
    /// Whether a component cannot be told from this one.
    pub(super) fn is(&self, other: &Component) -> bool {
        let c = &self.component;
        let sd_hz = math::hypot(c.frequency_sd_hz, other.frequency_sd_hz);
        let within_hz = (TOGETHER * self.resolution_hz).max(DEVIATIONS * sd_hz);
        let holds = |a: &Component, b: &Component| {
            a.range_hz.is_some_and(|range| (range.low_hz..=range.high_hz).contains(&b.frequency_hz))
        };
        (c.frequency_hz - other.frequency_hz).abs() < within_hz || holds(c, other) || holds(other, c)
    }

    /// Whether the piece says more of it than a window over which it changes.
    pub(super) fn says_more(&self) -> bool {
        self.is_over || self.component.range_hz.is_some()
    }
}

/// Every component that is there for a short time, once.
pub(super) fn components(record: &Record, settings: &Settings) -> Vec<Brief> {
    let band_hz = settings.band_hz.unwrap_or((0.0, record.frame_rate_hz / 2.0));
    let band = (band_hz.0 / record.frame_rate_hz, (band_hz.1 / record.frame_rate_hz).min(0.5));
    let pieces: Vec<Piece> = SCALES
        .iter()
        .flat_map(|(length, most)| pieces::most_unlike(record.samples, *length, *most, band))
        .collect();
    let mut found: Vec<Brief> = pieces
        .par_iter()
        .flat_map_iter(|piece| {
            let samples = &record.samples[piece.frames.clone()];
            read(&Record { samples, ..*record }, settings, piece)
        })
        .collect();
    found.sort_by(|a, b| a.component.frequency_sd_hz.total_cmp(&b.component.frequency_sd_hz));
    let mut once: Vec<Brief> = Vec::new();
    for brief in found {
        // two of one piece are two
        let known = |known: &Brief| {
            (known.first, known.resolution_hz) != (brief.first, brief.resolution_hz)
                && (known.is(&brief.component) || brief.is(&known.component))
        };
        if !once.iter().any(known) {
            once.push(brief);
        }
    }
    once
}

/// The components of a piece that are not there all the time: those at whose frequency it exceeds the normal,
/// and those that are over within it.
fn read(of_piece: &Record, settings: &Settings, piece: &Piece) -> Vec<Brief> {
    let rate_hz = of_piece.frame_rate_hz;
    let passes = |brief: &Brief| {
        let c = &brief.component;
        let (low_hz, high_hz) =
            c.range_hz.map_or((c.frequency_hz, c.frequency_hz), |range| (range.low_hz, range.high_hz));
        brief.is_over || piece.exceeds(low_hz / rate_hz, high_hz / rate_hz)
    };
    let analyses = Analysis::between_flips(of_piece, settings);
    let of_stretch = |analysis: Analysis| of_stretch(analysis, piece.frames.start, rate_hz);
    analyses.into_iter().flat_map(of_stretch).filter(passes).collect()
}

/// The components of a stretch of a piece that begins at a frame.
fn of_stretch(analysis: Analysis, start: usize, rate_hz: f64) -> impl Iterator<Item = Brief> {
    let first = start + analysis.left_out;
    let lasts_s = analysis.left_m.len() as f64 / rate_hz;
    let resolution_hz = analysis.spectrum.resolution_hz;
    analysis.spectrum.components.into_iter().map(move |c| {
        let is_over = is_over(&c, lasts_s);
        let begins_s = first as f64 / rate_hz + c.begins_s.unwrap_or(0.0);
        let component = Component { begins_s: (begins_s > 0.0).then_some(begins_s), ..c };
        Brief { component, first, resolution_hz, is_over }
    })
}

/// Whether a component has decayed by so many nepers within so long, s.
fn is_over(c: &Component, lasts_s: f64) -> bool {
    let Some((ratio, sd)) = c.damping_ratio.zip(c.damping_ratio_sd) else { return false };
    let decay_per_s = TAU * c.frequency_hz * ratio / (1.0 - ratio * ratio).sqrt();
    ratio > DEVIATIONS * sd && decay_per_s * (lasts_s - c.begins_s.unwrap_or(0.0)) > OVER
}
