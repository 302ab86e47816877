//! A window of a recording's channel with its analysis.

use crate::figures::about;
use crate::recording::Recording;
use crate::recording::channel::{Channel, InstantKind, ReversalInstants};
use crate::spectrum::SpectralAnalysis;
use std::ops::Range;

/// A window of a channel, taken apart.
pub struct AnalysedWindow<'a> {
    /// The recording.
    pub recording: &'a Recording,
    /// The channel.
    pub channel: Channel,
    /// The frames analysed.
    pub frames: Range<usize>,
    /// What they hold.
    pub analysis: &'a SpectralAnalysis,
    /// What was done to them, in words.
    pub note: String,
}

impl AnalysedWindow<'_> {
    /// What a figure shows, for the line under its heading.
    pub(super) fn figure_note(&self, what: &str) -> String {
        about(&format!("{what} of {}", self.channel), &self.note)
    }
}

/// Instants between two times, by name.
pub(super) fn named_instants(recording: &Recording, (from_s, to_s): (f64, f64)) -> Vec<(String, f64)> {
    let found = ReversalInstants::find_instants(recording);
    let all = (1..=found.reversals.len()).flat_map(|k| InstantKind::ALL.map(|anchor| (anchor, k)));
    let named = all.filter_map(|(anchor, k)| {
        let suffix = if found.reversals.len() > 1 { format!("[{k}]") } else { String::new() };
        Some((format!("{}{suffix}", anchor.name()), found.time_s(anchor, k).ok()?))
    });
    named.filter(|(_, t)| *t >= from_s && *t <= to_s).collect()
}
