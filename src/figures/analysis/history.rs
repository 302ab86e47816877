//! The whole recording with its named windows.

use super::window::{AnalysedWindow, named_instants};
use crate::figures::windows::{WindowOverview, WindowSpan};
use crate::recording::channel::{self, Channel, ReversalInstants, phase_windows};
use crate::text::format_short;

impl AnalysedWindow<'_> {
    pub(super) fn window_overview(&self) -> WindowOverview {
        let (grid, found) = (self.recording.grid(), ReversalInstants::find_instants(self.recording));
        let window = |w: channel::PhaseWindow| WindowSpan { name: w.name, from_s: w.from_s, to_s: w.to_s };
        WindowOverview {
            title: format!(
                "Analysed: {} s of {} s, {} frames",
                format_short(self.frames.len() as f64 / grid.frame_rate_hz),
                format_short(grid.frames as f64 / grid.frame_rate_hz),
                self.frames.len()
            ),
            quantity: self.channel.to_string(),
            note: format!("named windows of {}", self.channel),
            synthetic: self.recording.is_synthetic(),
            time_s: (0..grid.frames).map(|i| grid.time_s(i)).collect(),
            channel_m: self.channel.samples(self.recording),
            head_x_m: if self.channel == Channel::HeadX {
                Vec::new()
            } else {
                Channel::HeadX.samples(self.recording)
            },
            windows: phase_windows(self.recording, &found).into_iter().map(window).collect(),
            analysed_s: Some((grid.time_s(self.frames.start), grid.time_s(self.frames.end))),
            instants: named_instants(self.recording, (grid.start_s, grid.time_s(grid.frames))),
        }
    }
}
