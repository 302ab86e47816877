//! The complete analysis of a window of a recording: its parts as data, a file each, and their figures.

mod compared;
mod components;
mod course;
mod history;
mod parts;
mod window;

pub use compared::compare_spectra;
pub use course::CoursePoint;
pub use window::AnalysedWindow;

use super::{about, ring_down, spectrogram, spectrum, windows};
use crate::chart::Figure;

impl AnalysedWindow<'_> {
    /// Every figure, with its name.
    #[must_use]
    pub fn figures(&self) -> [(&'static str, Figure); 4] {
        let figures = [
            ("spectrum", spectrum::draw_figure(&self.spectra())),
            ("spectrogram", spectrogram::draw_figure(&self.spectrogram())),
            ("ring-down", ring_down::draw_figure(&self.ring_down())),
            ("history", windows::draw_figure(&self.window_overview())),
        ];
        figures.map(|(name, figure)| {
            (name, Figure { subtitle: about(self.recording.name(), &figure.subtitle), ..figure })
        })
    }
}
