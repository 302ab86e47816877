//! A recording as it was tracked: its motion, its gaps and its reversals.

use super::history::{self, History};
use crate::compare::MotionTraces;
use crate::recording::Recording;
use crate::report::chart::{Band, Colour, Figure};

/// Reversals that are named; a longer recording has more than a figure has room for.
const MOST_NAMED: usize = 6;
/// Gaps that are marked: the longest.
const MOST_GAPS: usize = 20;
/// A gap as short as this many frames is not seen.
const LEAST_GAP: usize = 3;

/// The figure; `reversals` are instants, s, and `said` is what a reader has to know.
#[must_use]
pub fn figure(recording: &Recording, reversals: &[f64], said: &str) -> Figure {
    let name = |(number, at): (usize, &f64)| (format!("reversal {}", number + 1), *at);
    let named = reversals.iter().enumerate().take(MOST_NAMED).map(name);
    let history = History {
        title: recording.name().to_owned(),
        synthetic: recording.is_synthetic(),
        measured: Some(MotionTraces::of(recording)),
        instants: named.collect(),
        ..History::default()
    };
    let mut figure = history::figure(&history);
    let origin = crate::report::subtitle(recording.is_synthetic(), "");
    let parts = [origin.as_str(), said].into_iter().filter(|part| !part.is_empty());
    figure.subtitle = parts.collect::<Vec<_>>().join("; ");
    figure.description = format!("The recording as it was tracked: {}.", figure.subtitle);
    let gaps = gaps(recording);
    figure.panels.iter_mut().for_each(|panel| panel.bands.extend(gaps.iter().cloned()));
    figure
}

/// Runs of frames without head or without tip, s.
fn gaps(recording: &Recording) -> Vec<Band> {
    let (grid, traces) = (recording.grid(), recording.traces());
    let lost: Vec<bool> = traces
        .tip_x_m
        .iter()
        .zip(&traces.head_x_m)
        .map(|(tip, head)| tip.is_none() || head.is_none())
        .collect();
    let mut runs: Vec<(usize, usize)> = Vec::new();
    let mut at = 0;
    for run in lost.chunk_by(|a, b| a == b) {
        if run.first() == Some(&true) && run.len() >= LEAST_GAP {
            runs.push((at, at + run.len() - 1));
        }
        at += run.len();
    }
    runs.sort_by_key(|(first, last)| std::cmp::Reverse(last - first));
    runs.truncate(MOST_GAPS);
    let band = |(first, last): &(usize, usize)| Band {
        label: "head or tip not tracked".to_owned(),
        colour: Colour::Grey,
        from: grid.time_s(*first),
        to: grid.time_s(*last),
        outlined: false,
    };
    runs.iter().map(band).collect()
}
