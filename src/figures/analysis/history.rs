//! The whole recording with its named windows.

use super::window::{AnalysedWindow, instants};
use crate::figures::windows::{NamedWindow, Windows};
use crate::recording::channel::{self, Channel, Instants, named_windows};
use crate::text::short;

impl AnalysedWindow<'_> {
    pub(super) fn windows(&self) -> Windows {
        let (grid, found) = (self.recording.grid(), Instants::find(self.recording));
        let window = |w: channel::NamedWindow| NamedWindow { name: w.name, from_s: w.from_s, to_s: w.to_s };
        Windows {
            title: format!(
                "Analysed: {} s of {} s, {} frames",
                short(self.frames.len() as f64 / grid.frame_rate_hz),
                short(grid.frames as f64 / grid.frame_rate_hz),
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
            windows: named_windows(self.recording, &found).into_iter().map(window).collect(),
            analysed_s: Some((grid.time_s(self.frames.start), grid.time_s(self.frames.end))),
            instants: instants(self.recording, (grid.start_s, grid.time_s(grid.frames))),
        }
    }
}
