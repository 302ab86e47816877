//! A condition of a job: what was measured in it beside what the fitted model shows through the same camera.

use super::aligned::Aligned;
use super::{Best, Measured};
use crate::fit::job::Job;
use crate::fit::result::FitResult;
use crate::recording::Recording;
use crate::recording::channel::{Anchor, Channel, Instants, Window};
use crate::report::chart::Figure;
use crate::report::{Drawing, FigureBlock, NO_TRACES, about};
use crate::simulate::scene::Scene;
use crate::text::{listed, shortened};
use crate::twin::View;
use std::ops::Range;

/// Letters of a title and of a name in a heading, which has to leave room for the figure: the longest titles
/// in use fit.
const TITLE_LETTERS: usize = 120;
const NAME_LETTERS: usize = 50;

/// One condition.
pub(super) struct Pair<'a> {
    pub job: &'a Job,
    pub result: &'a FitResult,
    /// Number of the condition, from 0.
    pub condition: usize,
    /// The recording; `None` where only numbers are published.
    pub measured: Option<Measured<'a>>,
    /// The model.
    pub best: &'a Best,
    pub aligned: Aligned,
    /// What a caption of the model alone says of the later conditions with the same run; `None` in those,
    /// whose run is drawn already.
    pub shared: Option<String>,
    /// Instants of the recording.
    measured_instants: Option<Instants>,
    /// Instants of the model, on its own clock.
    model_instants: Instants,
}

/// One side of a pair, with its own clock and its own instants.
#[derive(Clone, Copy)]
pub(super) struct Side<'a> {
    pub recording: &'a Recording,
    pub instants: &'a Instants,
}

impl<'a> Pair<'a> {
    /// The conditions of a job in its order.
    pub fn all(
        job: &'a Job,
        measured: &[Measured<'a>],
        best: &'a [Best],
        result: &'a FitResult,
    ) -> Vec<Self> {
        let of = |(i, one)| Self {
            shared: shared(job, best, i),
            ..Self::of(job, result, i, measured.get(i).copied(), one)
        };
        best.iter().enumerate().map(of).collect()
    }

    fn of(
        job: &'a Job,
        result: &'a FitResult,
        condition: usize,
        measured: Option<Measured<'a>>,
        best: &'a Best,
    ) -> Self {
        let model = &best.view.recording;
        let aligned = measured.map_or_else(Aligned::default, |m| Aligned::of(m.recording, model));
        let measured_instants = measured.map(|m| Instants::find(m.recording));
        Self {
            job,
            result,
            condition,
            measured,
            best,
            aligned,
            measured_instants,
            shared: Some(String::new()),
            model_instants: Instants::find(model),
        }
    }

    pub fn recording(&self) -> Option<&'a Recording> {
        self.measured.map(|m| m.recording)
    }

    pub fn view(&self) -> &'a View {
        &self.best.view
    }

    pub fn scene(&self) -> &'a Scene {
        &self.best.scene
    }

    pub fn synthetic(&self) -> bool {
        self.recording().is_some_and(Recording::is_synthetic)
    }

    /// The recording, where there is one.
    pub fn measured_side(&self) -> Option<Side<'_>> {
        self.recording()
            .zip(self.measured_instants.as_ref())
            .map(|(recording, instants)| Side { recording, instants })
    }

    pub fn model_side(&self) -> Side<'_> {
        Side { recording: &self.view().recording, instants: &self.model_instants }
    }

    /// The recording, otherwise the model.
    pub fn shown(&self) -> Side<'_> {
        self.measured_side().unwrap_or_else(|| self.model_side())
    }

    /// Exposure of a frame, s, where known.
    pub fn exposure_s(&self) -> Option<f64> {
        let of_recording = self.measured.and_then(|m| m.file).and_then(|f| f.camera.exposure_s);
        of_recording.or(self.job.camera.filter(|_| self.measured.is_none()).map(|camera| camera.exposure_s))
    }

    /// Name of the condition where there are several.
    fn told_apart(&self) -> Option<&'a str> {
        self.job
            .conditions
            .get(self.condition)
            .filter(|_| self.job.conditions.len() > 1)
            .map(|condition| condition.name.as_str())
    }

    /// What a figure is about: the job, and the condition where there are several.
    pub fn name(&self) -> String {
        let of =
            self.told_apart().map_or_else(String::new, |name| format!(", {}", shortened(name, NAME_LETTERS)));
        format!("{}{of}", shortened(&self.job.title, TITLE_LETTERS))
    }

    /// A caption that does not say by itself of which condition it is.
    pub fn captioned(&self, caption: String) -> String {
        match self.told_apart() {
            Some(name) => format!("{name}: {caption}"),
            None => caption,
        }
    }

    /// File of a figure: with the number of the condition where there are several.
    pub fn file(&self, name: &str) -> String {
        let number = self.told_apart().map_or_else(String::new, |_| format!("-{}", self.condition + 1));
        format!("{name}{number}.svg")
    }

    /// What is said of a figure under its heading.
    pub fn note(&self, text: &str) -> String {
        match (self.recording(), text.is_empty()) {
            (None, true) => NO_TRACES.to_owned(),
            (None, false) => format!("{NO_TRACES}; {text}"),
            (Some(_), _) => text.to_owned(),
        }
    }

    /// "the synthetic recording `twin`", or "the model alone".
    pub fn source(&self) -> String {
        match self.recording() {
            Some(r) if r.is_synthetic() => format!("the synthetic recording {}", r.name()),
            Some(r) => format!("the recording {}", r.name()),
            None => "the fitted model alone, as no traces are published".to_owned(),
        }
    }

    /// A figure with its file and what it is about.
    pub fn block(&self, name: &str, caption: String, figure: Figure) -> FigureBlock {
        let figure = Figure { subtitle: about(&self.name(), &figure.subtitle), ..figure };
        FigureBlock {
            file: self.file(name),
            caption,
            details: String::new(),
            drawing: Drawing::Chart(figure),
        }
    }
}

/// What a caption of the first condition with a run says of those that share it; `None` for those.
fn shared(job: &Job, best: &[Best], condition: usize) -> Option<String> {
    let scene = &best.get(condition)?.scene;
    let mut sharing = (0..best.len()).filter(|i| best.get(*i).is_some_and(|other| other.scene == *scene));
    if sharing.next() != Some(condition) {
        return None;
    }
    let others: Vec<String> =
        sharing.filter_map(|i| job.conditions.get(i)).map(|c| shortened(&c.name, NAME_LETTERS)).collect();
    let said = || {
        format!(" The model's run is the same in {}, but for the clock of the recording.", listed(&others))
    };
    Some(if others.is_empty() { String::new() } else { said() })
}

impl Side<'_> {
    /// Time of an instant of the first turn, s.
    pub fn instant_s(&self, anchor: Anchor) -> Option<f64> {
        self.instants.time_s(anchor, 1).ok()
    }

    /// Samples of a channel.
    pub fn samples(&self, channel: Channel) -> Vec<Option<f64>> {
        channel.samples(self.recording)
    }

    /// Frames of a window; `None` where it does not show it.
    pub fn frames(&self, window: &Window) -> Option<Range<usize>> {
        window.resolve(self.recording, self.instants).ok()
    }

    /// Frames between two of its own times.
    pub fn between(&self, (from_s, to_s): (f64, f64)) -> Range<usize> {
        let grid = self.recording.grid();
        let frame =
            |t: f64| ((t - grid.start_s) * grid.frame_rate_hz).ceil().clamp(0.0, grid.frames as f64) as usize;
        frame(from_s)..frame(to_s).max(frame(from_s))
    }
}
