//! Figure of a tracked recording: its motion, gaps and reversals.

use super::history::{self, TimeHistory};
use super::subtitle;
use crate::recording::Recording;
use crate::recording::motion_traces::MotionTraces;
use crate::text::{format_percent, format_short, pluralise};
use plain_charts::{Colour, Figure, ShadedSpan};

/// Maximum number of reversals that are named in a figure.
const MOST_NAMED: usize = 6;
/// Maximum number of gaps that are marked. If there are more, the longest ones are marked.
const MOST_GAPS: usize = 20;
/// A gap is marked if it has at least this number of frames; a shorter gap would not be visible.
const LEAST_GAP: usize = 3;

/// Draws the figure; `reversals` are instants, s, and `said` is the end of the line under the heading.
pub(crate) fn draw_figure(recording: &Recording, reversals: &[f64], said: &str) -> Figure {
    let name = |(number, at): (usize, &f64)| (format!("reversal {}", number + 1), *at);
    let named = reversals.iter().enumerate().take(MOST_NAMED).map(name);
    let history = TimeHistory {
        title: claim_sentence(recording, reversals.len()),
        synthetic: recording.is_synthetic(),
        measured: Some(MotionTraces::from_recording(recording)),
        instants: named.collect(),
        ..TimeHistory::default()
    };
    let mut figure = history::draw_figure(&history);
    let origin = subtitle(recording.is_synthetic(), "");
    let parts = [recording.name(), origin.as_str(), said].into_iter().filter(|part| !part.is_empty());
    figure.subtitle = parts.collect::<Vec<_>>().join("; ");
    figure.watermarked = recording.is_synthetic();
    figure.description = format!("The recording as it was tracked: {}.", figure.subtitle);
    let gaps = gap_spans(recording);
    figure.panels.iter_mut().for_each(|panel| panel.shaded_spans.extend(gaps.iter().cloned()));
    figure
}

/// The main result in one sentence, with its numbers.
fn claim_sentence(recording: &Recording, reversals: usize) -> String {
    let (lost, grid) = (lost_frames(recording), recording.grid());
    let share = lost.iter().filter(|lost| **lost).count() as f64 / lost.len().max(1) as f64;
    let part = || format!("{} of the frames", format_percent(1.0 - share));
    let tracked = if share > 0.0 { part() } else { "every frame".to_owned() };
    let turns = match reversals {
        0 => "no reversal".to_owned(),
        n => format!("{n} {}", pluralise("reversal", n)),
    };
    let span_s = grid.time_s(grid.frames.saturating_sub(1)) - grid.start_s;
    format!("{} s with {turns}, head and tip tracked in {tracked}", format_short(span_s))
}

/// For each frame, whether head or tip is missing.
fn lost_frames(recording: &Recording) -> Vec<bool> {
    let traces = recording.traces();
    traces.tip_x_m.iter().zip(&traces.head_x_m).map(|(tip, head)| tip.is_none() || head.is_none()).collect()
}

/// Shaded spans of the longest gaps.
fn gap_spans(recording: &Recording) -> Vec<ShadedSpan> {
    let (grid, lost) = (recording.grid(), lost_frames(recording));
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
    let band = |(first, last): &(usize, usize)| {
        ShadedSpan::new("head or tip not tracked", Colour::Grey, grid.time_s(*first), grid.time_s(*last))
    };
    runs.iter().map(band).collect()
}
