//! A condition of a job: its recording, and the model at the estimates through the same camera.

use super::model_run;
use super::model_run::{ModelRun, RunSummary};
use super::ridge::RidgePair;
use crate::feature::{FeatureBand, FeatureUnit};
use crate::fit::job::{FitTarget, Job};
use crate::fit::result::FitResult;
use crate::recording::Recording;
use crate::recording::alignment::Alignment;
use crate::recording::channel::{Channel, InstantKind, ReversalInstants, Window};
use crate::recording::files::RecordingFile;
use crate::recording::motion_traces::MotionTraces;
use crate::recording::noise_model::{RecordingNoise, measure_noise};
use crate::recording::quality::noise_floor;
use crate::recording::video::RecordingVideo;
use crate::spectrum::Target;
use rayon::prelude::*;
use std::ops::Range;

/// The channels by which a model is judged, the first that was tracked: stick and slip are seen best in the
/// deflection, which needs the head.
const JUDGED: [Channel; 3] = [Channel::Deflection, Channel::TipX, Channel::HeadX];

/// A recording that was fitted, with its description where it has one.
#[derive(Debug, Clone, Copy)]
pub struct FittedRecording<'a> {
    /// The traces.
    pub recording: &'a Recording,
    /// `recording.toml`.
    pub file: Option<&'a RecordingFile>,
    /// Pictures of its frames.
    pub film: Option<RecordingVideo<'a>>,
}

/// One condition.
pub struct ConditionComparison<'a> {
    /// The job.
    pub job: &'a Job,
    /// Its result.
    pub result: &'a FitResult,
    /// Number of the condition, from 0.
    pub condition: usize,
    /// The recording; `None` where only numbers are published.
    pub measured: Option<FittedRecording<'a>>,
    /// The model.
    pub model: &'a ModelRun,
    /// The model's clock and origin on those of the recording; zero where there is none.
    pub alignment: Alignment,
    /// Later conditions with the same run of the model; `None` where an earlier condition has it.
    pub same_run: Option<Vec<usize>>,
    /// Measured minus model, on the times of the recording.
    pub residual: Option<MotionTraces>,
    /// Frequency over time of both sides.
    pub ridges: RidgePair,
    /// Noise of the recording's channels.
    noise: Option<RecordingNoise>,
    /// Instants of the recording.
    measured_instants: Option<ReversalInstants>,
    /// Instants of the model, on its own clock.
    model_instants: ReversalInstants,
}

/// One side of a pair, with its own clock and its own instants.
#[derive(Debug, Clone, Copy)]
pub struct TimedRecording<'a> {
    /// The traces.
    pub recording: &'a Recording,
    /// Their instants.
    pub instants: &'a ReversalInstants,
}

impl<'a> ConditionComparison<'a> {
    /// The conditions of a job in its order; `measured` are the recordings of the first ones.
    #[must_use]
    pub fn compare_conditions(
        job: &'a Job,
        measured: &[FittedRecording<'a>],
        models: &'a [ModelRun],
        result: &'a FitResult,
    ) -> Vec<Self> {
        let of = |(condition, model): (usize, &'a ModelRun)| {
            let case = Self::align_condition(job, result, condition, measured.get(condition).copied(), model);
            let residual = case
                .recording()
                .map(|measured| MotionTraces::residual(measured, &model.view.recording, &case.alignment));
            let ridges = RidgePair::track(&case);
            Self { same_run: later_same_runs(models, condition), residual, ridges, ..case }
        };
        models.par_iter().enumerate().map(of).collect()
    }

    fn align_condition(
        job: &'a Job,
        result: &'a FitResult,
        condition: usize,
        measured: Option<FittedRecording<'a>>,
        model: &'a ModelRun,
    ) -> Self {
        let view = &model.view.recording;
        Self {
            job,
            result,
            condition,
            measured,
            model,
            alignment: measured.map_or_else(Alignment::default, |m| Alignment::estimate(m.recording, view)),
            same_run: None,
            residual: None,
            ridges: RidgePair::default(),
            noise: measured.map(|m| measure_noise(m.recording)),
            measured_instants: measured.map(|m| ReversalInstants::find_instants(m.recording)),
            model_instants: ReversalInstants::find_instants(view),
        }
    }

    /// The recording, where there is one.
    pub(crate) fn recording(&self) -> Option<&'a Recording> {
        self.measured.map(|m| m.recording)
    }

    /// Whether there is a recording that no camera took.
    pub(crate) fn is_synthetic(&self) -> bool {
        self.recording().is_some_and(Recording::is_synthetic)
    }

    /// The recording with its instants, where there is one.
    pub(crate) fn measured_side(&self) -> Option<TimedRecording<'_>> {
        self.recording()
            .zip(self.measured_instants.as_ref())
            .map(|(recording, instants)| TimedRecording { recording, instants })
    }

    /// The model with its instants, on its own clock.
    pub(crate) fn model_side(&self) -> TimedRecording<'_> {
        TimedRecording { recording: &self.model.view.recording, instants: &self.model_instants }
    }

    /// The recording, otherwise the model.
    pub(crate) fn measured_or_model(&self) -> TimedRecording<'_> {
        self.measured_side().unwrap_or_else(|| self.model_side())
    }

    /// Noise of a recorded channel, m, measured as a fit to traces measures it: against the smooth head and
    /// the glass, as stick and slip move the tip as fast as noise does. By the scatter from frame to frame
    /// where neither was tracked; `None` without a recording or without noise.
    pub(crate) fn noise_m(&self, channel: Channel) -> Option<f64> {
        let noise = self.noise.as_ref()?;
        let along_m = noise.along_sweep.as_ref().map(|found| found.noise.sd());
        let known_m = match channel {
            Channel::TipX | Channel::HeadX => along_m,
            Channel::Deflection => along_m.map(|m| m * std::f64::consts::SQRT_2),
            Channel::HeadDrop => noise.upwards.as_ref().map(|found| found.noise.sd()),
        };
        known_m.or_else(|| noise_floor(&channel.samples(self.recording()?))).filter(|noise_m| *noise_m > 0.0)
    }

    /// The channel by which what is left is judged, and its noise, m; `None` without a recording, where the
    /// two cannot agree, or where nothing is known of the noise.
    pub(crate) fn judged_channel(&self) -> Option<(Channel, f64)> {
        let residual = self.residual.as_ref().filter(|_| !self.alignment.opposite_turn)?;
        let is_known = |channel: &Channel| residual.column(*channel).iter().any(Option::is_some);
        let channel = JUDGED.into_iter().find(is_known)?;
        Some((channel, self.noise_m(channel)?))
    }

    /// Exposure of a frame, s, where known.
    pub(crate) fn exposure_s(&self) -> Option<f64> {
        let of_recording = self.measured.and_then(|m| m.file).and_then(|f| f.camera.exposure_s);
        of_recording.or(self.job.camera.filter(|_| self.measured.is_none()).map(|camera| camera.exposure_s))
    }

    /// The frequencies that the fit seeks in the condition.
    pub(crate) fn frequency_comparisons(&self) -> impl Iterator<Item = FrequencyComparison> + '_ {
        self.targets().filter_map(|aim| compare_frequency(aim, self.result))
    }

    /// What the job reads in the condition.
    pub(crate) fn targets(&self) -> impl Iterator<Item = &'a FitTarget> + '_ {
        self.job.targets.iter().filter(|aim| aim.feature.condition == self.condition)
    }

    /// Name of the condition.
    pub(crate) fn name(&self) -> &'a str {
        self.job.conditions.get(self.condition).map_or("", |condition| condition.name.as_str())
    }

    /// The model's run and its hard events.
    pub(crate) fn run_summary(&self) -> RunSummary {
        let line = model_run::summarize_run(self.name(), self.model.scene.start_s, &self.model.motion);
        RunSummary { opposite_turn: self.alignment.opposite_turn, ..line }
    }
}

/// The later conditions with the run of this one; `None` where an earlier condition has it.
fn later_same_runs(runs: &[ModelRun], condition: usize) -> Option<Vec<usize>> {
    let scene = &runs.get(condition)?.scene;
    let mut same = (0..runs.len()).filter(|i| runs.get(*i).is_some_and(|other| other.scene == *scene));
    (same.next() == Some(condition)).then(|| same.collect())
}

impl TimedRecording<'_> {
    /// Time of an instant of the first turn, s.
    pub(crate) fn instant_s(&self, anchor: InstantKind) -> Option<f64> {
        self.instants.time_s(anchor, 1).ok()
    }

    /// Samples of a channel.
    pub(crate) fn samples(&self, channel: Channel) -> Vec<Option<f64>> {
        channel.samples(self.recording)
    }

    /// Frames of a window; `None` where it does not show it.
    pub(crate) fn window_frames(&self, window: &Window) -> Option<Range<usize>> {
        window.resolve_frames(self.recording, self.instants).ok()
    }

    /// Frames between two of its own times.
    pub(crate) fn frames_between(&self, (from_s, to_s): (f64, f64)) -> Range<usize> {
        let grid = self.recording.grid();
        let frame =
            |t: f64| ((t - grid.start_s) * grid.frame_rate_hz).ceil().clamp(0.0, grid.frames as f64) as usize;
        frame(from_s)..frame(to_s).max(frame(from_s))
    }
}

// The windows that a job reads, and the frequencies that it seeks in them.

/// A window of a channel that aims share.
#[derive(Debug, Clone)]
pub(crate) struct FitWindow<'a> {
    pub channel: Channel,
    pub window: Window,
    /// The first band in it, where there is one: it says what is removed.
    pub band: Option<&'a FeatureBand>,
    /// What is read in it, in the order of the job.
    pub targets: Vec<&'a FitTarget>,
}

/// A frequency that the fit seeks, and the model's.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FrequencyComparison {
    /// The frequency of the recording, or the published one.
    pub target: Target,
    /// That of the model at the estimates, Hz; `None` where it has none.
    pub model_hz: Option<f64>,
    /// Whether that passes, by the tolerance of the job.
    pub met: bool,
}

/// The band of a reading that is one of a spectrum.
pub(crate) fn spectral_band(aim: &FitTarget) -> Option<&FeatureBand> {
    aim.feature.reading.band()
}

fn channel_window(aim: &FitTarget) -> Option<(Channel, Window)> {
    let channel = spectral_band(aim).map_or(Channel::Deflection, |band| band.channel);
    aim.feature.reading.window().map(|window| (channel, *window))
}

/// The windows of a condition, in the order of the job, each with the aims that it serves.
pub(crate) fn group_fit_windows(job: &Job, condition: usize) -> Vec<FitWindow<'_>> {
    let mut found: Vec<FitWindow> = Vec::new();
    for aim in job.targets.iter().filter(|aim| aim.feature.condition == condition) {
        let Some((channel, window)) = channel_window(aim) else { continue };
        let own = spectral_band(aim);
        // what is removed tells two spectra of one window apart
        let same = |l: &&mut FitWindow| {
            (l.channel, l.window) == (channel, window)
                && l.band.zip(own).is_none_or(|(a, b)| a.detrend == b.detrend)
        };
        match found.iter_mut().find(same) {
            Some(shared) => {
                shared.band = shared.band.or(own);
                shared.targets.push(aim);
            }
            None => found.push(FitWindow { channel, window, band: own, targets: vec![aim] }),
        }
    }
    found
}

impl FitWindow<'_> {
    /// Names of what is read in it.
    pub(crate) fn feature_names(&self) -> Vec<String> {
        self.targets.iter().map(|aim| aim.feature.name.clone()).collect()
    }

    /// The frequencies that the fit seeks in it.
    pub(crate) fn frequency_comparisons(&self, result: &FitResult) -> Vec<FrequencyComparison> {
        self.targets.iter().filter_map(|aim| compare_frequency(aim, result)).collect()
    }
}

/// Target and model of an aim that is a frequency.
pub(crate) fn compare_frequency(aim: &FitTarget, result: &FitResult) -> Option<FrequencyComparison> {
    let name = &aim.feature.name;
    let of = |frequency_hz: f64, sd_hz: f64, model_hz, met| FrequencyComparison {
        target: Target {
            name: name.clone(),
            frequency_hz,
            frequency_sd_hz: Some(sd_hz).filter(|sd| *sd > 0.0),
        },
        model_hz,
        met,
    };
    if aim.feature.reading.unit() != FeatureUnit::HERTZ {
        return None;
    }
    let component = result
        .components
        .iter()
        .find(|c| c.name == *name)
        .map(|c| of(c.target_hz, c.target_sd_hz, c.model_hz, c.pass));
    let feature = || {
        result
            .features
            .iter()
            .chain(&result.held_out)
            .find(|f| f.name == *name)
            .map(|f| of(f.target, f.target_sd, f.model, f.pass))
    };
    component.or_else(feature)
}
