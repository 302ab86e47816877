//! Compares, for one condition of a job, the recording with the model. The model runs with the estimated
//! parameters and is recorded by a simulated camera like that of the recording.

use super::drift::drift_cycles;
use super::model_run::{ModelRun, RunSummary, summarize_run};
use super::model_states::ModelStates;
use super::ridge::RidgePair;
use crate::feature::{FeatureBand, FeatureUnit};
use crate::fit::job::{FitTarget, Job};
use crate::fit::result::FitResult;
use crate::recording::Recording;
use crate::recording::alignment::Alignment;
use crate::recording::channel::{Channel, InstantKind, ReversalInstants, Window};
use crate::recording::files::RecordingFile;
use crate::recording::motion_traces::MotionTraces;
use crate::recording::noise::{ChannelNoise, RecordingNoise, measure_noise, noise_floor};
use crate::recording::video::RecordingVideo;
use rayon::prelude::*;
use short_spectra::Target;
use std::ops::Range;

/// Channels on which the model is judged, in order of preference; the first one that is tracked in enough
/// frames is used. The deflection shows stick and slip best, but it can be computed only if the head is
/// tracked.
const JUDGED: [Channel; 4] = [Channel::Deflection, Channel::TipX, Channel::HeadX, Channel::HeadDrop];

/// Smallest allowed ratio of the number of frames with a residual in the judged channel to the largest such
/// number of any channel.
const LEAST_KNOWN: f64 = 0.5;

/// A fitted recording with its description and its video.
#[derive(Debug, Clone, Copy)]
pub struct FittedRecording<'a> {
    /// The traces.
    pub recording: &'a Recording,
    /// Contents of `recording.toml`; `None` without that file.
    pub file: Option<&'a RecordingFile>,
    /// The video of the recording, if there is one.
    pub film: Option<RecordingVideo<'a>>,
}

/// The recording and the model of one condition.
pub struct ConditionComparison<'a> {
    /// The job.
    pub job: &'a Job,
    /// The result of the job.
    pub result: &'a FitResult,
    /// Index of the condition.
    pub condition: usize,
    /// The recording; `None` if only published numbers are known.
    pub measured: Option<FittedRecording<'a>>,
    /// The run of the model with the estimates of the parameters.
    pub model: &'a ModelRun,
    /// Shifts of time and position that align the model with the recording; zero without a recording.
    pub alignment: Alignment,
    /// Indices of the later conditions in which the model runs the same scene; `None` if an earlier condition
    /// already has this scene.
    pub same_run: Option<Vec<usize>>,
    /// Motion of the recording as it is compared with the model; `None` without a recording.
    pub(crate) measured_motion: Option<MotionTraces>,
    /// Measured minus one run of the aligned model, in every frame of the recording.
    pub residual: Option<MotionTraces>,
    /// The model that restarts at every segment of the fit; `None` without fitted traces.
    pub(crate) restarted_motion: Option<MotionTraces>,
    /// Measured minus `restarted_motion`.
    pub(crate) restarted: Option<MotionTraces>,
    /// States of the model, restarted at every segment of the fit if traces were fitted.
    pub(crate) states: ModelStates<'a>,
    /// Ridges of recording and model: the frequency of the strongest component against time.
    pub ridges: RidgePair,
    noise: Option<RecordingNoise>,
    measured_instants: Option<ReversalInstants>,
    /// Instants of the reversals in the model, on the clock of the model.
    model_instants: ReversalInstants,
}

/// A recording, or the model as a camera would record it, with the instants of its reversals. The instants
/// are on the clock of this recording or model.
#[derive(Debug, Clone, Copy)]
pub struct TimedRecording<'a> {
    /// The traces.
    pub recording: &'a Recording,
    /// Instants of the reversals in the recording.
    pub instants: &'a ReversalInstants,
}

impl<'a> ConditionComparison<'a> {
    /// Start and end of each interval in which the tip of the model sticks, s, on the clock of the recording.
    pub(crate) fn sticks_on_clock(&self) -> Vec<(f64, f64)> {
        let shift_s = self.alignment.shift_s;
        self.states.stick_s.iter().map(|[from, to]| (from + shift_s, to + shift_s)).collect()
    }

    /// Compares recording and model in every condition of a job, in the order of the job. The recordings
    /// `measured` belong to the first conditions; the other conditions have no recording.
    #[must_use]
    pub fn compare_conditions(
        job: &'a Job,
        measured: &[FittedRecording<'a>],
        models: &'a [ModelRun],
        result: &'a FitResult,
    ) -> Vec<Self> {
        let compare = |(condition, model): (usize, &'a ModelRun)| {
            let view = &model.view.recording;
            let measured = measured.get(condition).copied();
            let recording = measured.map(|m| m.recording);
            let alignment = recording.map_or_else(Alignment::default, |seen| model.alignment(seen));
            let measured_motion = recording.map(|seen| model.measured_motion(seen));
            let residual = recording.zip(measured_motion.as_ref()).map(|(seen, motion)| {
                motion.subtract(&MotionTraces::from_model_at_frames(seen, view, &alignment))
            });
            let restarted_motion = recording.and_then(|seen| model.restarted_motion(seen));
            let mut case = Self {
                job,
                result,
                condition,
                measured,
                model,
                alignment,
                same_run: later_same_runs(models, condition),
                residual,
                restarted: restarted_motion
                    .as_ref()
                    .zip(measured_motion.as_ref())
                    .map(|(restarted, motion)| motion.subtract(restarted)),
                restarted_motion,
                measured_motion,
                states: ModelStates::simulate(model, &result.segments, &job.conditions[condition].name),
                ridges: RidgePair::default(),
                noise: recording.map(measure_noise),
                measured_instants: recording.map(ReversalInstants::find_instants),
                model_instants: ReversalInstants::find_instants(view),
            };
            case.ridges = RidgePair::track(&case);
            case
        };
        models.par_iter().enumerate().map(compare).collect()
    }

    /// The recording; `None` if there is none.
    pub(crate) fn recording(&self) -> Option<&'a Recording> {
        self.measured.map(|m| m.recording)
    }

    /// Whether the condition has a recording that is synthetic.
    pub(crate) fn is_synthetic(&self) -> bool {
        self.recording().is_some_and(Recording::is_synthetic)
    }

    /// The recording with the instants of its reversals; `None` without a recording.
    pub(crate) fn measured_side(&self) -> Option<TimedRecording<'_>> {
        let instants = self.measured_instants.as_ref()?;
        self.recording().map(|recording| TimedRecording { recording, instants })
    }

    /// The model with the instants of its reversals, on the clock of the model.
    pub(crate) fn model_side(&self) -> TimedRecording<'_> {
        TimedRecording { recording: &self.model.view.recording, instants: &self.model_instants }
    }

    /// The recording with the instants of its reversals; without a recording, the model with its instants.
    pub(crate) fn measured_or_model(&self) -> TimedRecording<'_> {
        self.measured_side().unwrap_or_else(|| self.model_side())
    }

    /// Standard deviation of the noise of a recorded channel, m, as in a fit to traces. If its measurement
    /// fails, the scatter from frame to frame is used. `None` without a recording or without noise.
    pub(crate) fn noise_m(&self, channel: Channel) -> Option<f64> {
        if let Some(noise_m) = self.fitted_noise_m(channel) {
            return Some(noise_m);
        }
        let noise = self.noise.as_ref()?;
        let sd_m = |found: &Option<ChannelNoise>| found.as_ref().map(|found| found.noise.sd());
        let known_m = match channel {
            Channel::TipX => sd_m(&noise.tip_x),
            Channel::HeadX => sd_m(&noise.head_x),
            Channel::Deflection => noise.deflection_m(),
            Channel::HeadDrop => sd_m(&noise.head_y),
        };
        known_m.or_else(|| noise_floor(&channel.samples(self.recording()?))).filter(|noise_m| *noise_m > 0.0)
    }

    /// Standard deviation of the noise with which the fit compares a channel, m; `None` for a channel that
    /// the fit does not compare.
    fn fitted_noise_m(&self, channel: Channel) -> Option<f64> {
        let traces = self.model.traces.as_ref()?;
        let column = match channel {
            Channel::TipX => 0,
            Channel::Deflection if traces.own_head => 0,
            Channel::HeadDrop => 1,
            Channel::Deflection | Channel::HeadX => return None,
        };
        traces.measured[column].iter().any(Option::is_some).then_some(traces.noise_m[column])
    }

    /// Measured minus model, as the fit judges them: the model restarts at every segment if traces were
    /// fitted, and runs once otherwise.
    pub(crate) fn judged_residual(&self) -> Option<&MotionTraces> {
        self.restarted.as_ref().or(self.residual.as_ref())
    }

    /// The channel on which the model is judged, and the standard deviation of its noise, m. `None` without a
    /// recording, if the heads of recording and model turn in opposite directions, or if the noise is
    /// unknown.
    pub(crate) fn judged_channel(&self) -> Option<(Channel, f64)> {
        let residual = self.judged_residual().filter(|_| !self.alignment.opposite_turn)?;
        let known = |channel: Channel| residual.column(channel).iter().flatten().count();
        let most = JUDGED.into_iter().map(known).max().filter(|most| *most > 0)?;
        let is_often_known = |channel: &Channel| known(*channel) as f64 >= LEAST_KNOWN * most as f64;
        let channel = JUDGED.into_iter().find(is_often_known)?;
        Some((channel, self.noise_m(channel)?))
    }

    /// The channel in which stick and slip are followed: the deflection, or the position of the tip in a
    /// recording without a head.
    pub(crate) fn cycle_channel(&self) -> Channel {
        let is_tracked = |motion: &MotionTraces| motion.deflection_m.iter().any(Option::is_some);
        if self.measured_motion.as_ref().is_none_or(is_tracked) { Channel::Deflection } else { Channel::TipX }
    }

    /// Cycles of stick and slip by which one run of the model gets ahead of the recording; `None` if they
    /// show no common cycle.
    pub(crate) fn drift_cycles(&self) -> Option<f64> {
        let measured = self.measured_motion.as_ref().filter(|_| !self.alignment.opposite_turn)?;
        let (low_hz, high_hz) = self.ridges.measured.as_ref()?.frequency_range_hz()?;
        let recording = self.recording()?;
        let view = &self.model.view.recording;
        let model = MotionTraces::from_model_at_frames(recording, view, &self.alignment);
        let columns = [measured, &model].map(|motion| motion.column(self.cycle_channel()));
        drift_cycles(columns, recording.grid().frame_rate_hz, 0.5 * (low_hz + high_hz))
    }

    /// Exposure time of a frame, s; `None` if unknown.
    pub(crate) fn exposure_s(&self) -> Option<f64> {
        match self.measured {
            Some(measured) => measured.file?.camera.exposure_s,
            None => self.job.camera.map(|camera| camera.exposure_s),
        }
    }

    /// Every target frequency of the condition with the corresponding frequency of the model.
    pub(crate) fn frequency_comparisons(&self) -> impl Iterator<Item = FrequencyComparison> + '_ {
        self.targets().filter_map(|aim| compare_frequency(aim, self.result))
    }

    /// The targets of the condition.
    pub(crate) fn targets(&self) -> impl Iterator<Item = &'a FitTarget> + '_ {
        self.job.targets.iter().filter(|aim| aim.feature.condition == self.condition)
    }

    /// Name of the condition.
    pub(crate) fn name(&self) -> &'a str {
        self.job.conditions.get(self.condition).map_or("", |condition| condition.name.as_str())
    }

    /// Summary of the run of the model: how it ended, its sticks, losses of contact, impacts and jams.
    pub(crate) fn run_summary(&self) -> RunSummary {
        let line = summarize_run(self.name(), self.model.scene.start_s, &self.model.motion);
        RunSummary { opposite_turn: self.alignment.opposite_turn, ..line }
    }
}

/// Indices of the later conditions whose scene equals that of `condition`; `None` if an earlier condition has
/// the same scene.
fn later_same_runs(runs: &[ModelRun], condition: usize) -> Option<Vec<usize>> {
    let scene = &runs.get(condition)?.scene;
    let mut same = (0..runs.len()).filter(|i| runs.get(*i).is_some_and(|other| other.scene == *scene));
    (same.next() == Some(condition)).then(|| same.collect())
}

impl TimedRecording<'_> {
    /// Time, s, at which an instant of the given kind occurs at the first reversal.
    pub(crate) fn instant_s(&self, anchor: InstantKind) -> Option<f64> {
        self.instants.time_s(anchor, 1).ok()
    }

    /// Samples of a channel.
    pub(crate) fn samples(&self, channel: Channel) -> Vec<Option<f64>> {
        channel.samples(self.recording)
    }

    /// Frame indices of a window; `None` if the recording does not contain the window.
    pub(crate) fn window_frames(&self, window: &Window) -> Option<Range<usize>> {
        window.resolve_frames(self.recording, self.instants).ok()
    }

    /// Frames between two times on the clock of the recording.
    pub(crate) fn frames_between(&self, (from_s, to_s): (f64, f64)) -> Range<usize> {
        let grid = self.recording.grid();
        let frame =
            |t: f64| ((t - grid.start_s) * grid.frame_rate_hz).ceil().clamp(0.0, grid.frames as f64) as usize;
        frame(from_s)..frame(to_s).max(frame(from_s))
    }
}

// The windows of a job's targets, and the target frequencies in each window.

/// A window of a channel, with the targets that are read from this window.
#[derive(Debug, Clone)]
pub(crate) struct FitWindow<'a> {
    pub channel: Channel,
    pub window: Window,
    /// The first frequency band that a target in the window has. It also determines which trend is removed
    /// from the samples of the window.
    pub band: Option<&'a FeatureBand>,
    /// The targets in the window, in the order of the job.
    pub targets: Vec<&'a FitTarget>,
}

/// A target frequency compared with the frequency of the model.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FrequencyComparison {
    /// Measured or published frequency.
    pub target: Target,
    /// Frequency of the model at the estimates, Hz; `None` if the model has no such component.
    pub model_hz: Option<f64>,
    /// Whether the frequency of the model is within the tolerance of the job.
    pub met: bool,
}

/// The frequency band of a target that is read from a spectrum; `None` for any other target.
pub(crate) fn spectral_band(aim: &FitTarget) -> Option<&FeatureBand> {
    aim.feature.reading.band()
}

/// The windows of a condition, in the order of the job, each with its targets.
pub(crate) fn group_fit_windows(job: &Job, condition: usize) -> Vec<FitWindow<'_>> {
    let mut found: Vec<FitWindow> = Vec::new();
    for aim in job.targets.iter().filter(|aim| aim.feature.condition == condition) {
        let Some(&window) = aim.feature.reading.window() else { continue };
        let own = spectral_band(aim);
        let channel = own.map_or(Channel::Deflection, |band| band.channel);
        // windows with different detrending are kept apart, since their spectra differ
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
    /// Names of the targets in the window.
    pub(crate) fn feature_names(&self) -> Vec<String> {
        self.targets.iter().map(|aim| aim.feature.name.clone()).collect()
    }

    /// Every target frequency in the window with the corresponding frequency of the model.
    pub(crate) fn frequency_comparisons(&self, result: &FitResult) -> Vec<FrequencyComparison> {
        self.targets.iter().filter_map(|aim| compare_frequency(aim, result)).collect()
    }
}

/// Target frequency and frequency of the model; `None` for a target that is not a frequency.
pub(crate) fn compare_frequency(aim: &FitTarget, result: &FitResult) -> Option<FrequencyComparison> {
    let name = &aim.feature.name;
    if aim.feature.reading.unit() != FeatureUnit::HERTZ {
        return None;
    }
    let (frequency_hz, sd_hz, model_hz, met) = match result.components.iter().find(|c| c.name == *name) {
        Some(c) => (c.target_hz, c.target_sd_hz, c.model_hz, c.pass),
        None => {
            let f = result.features.iter().chain(&result.held_out).find(|f| f.name == *name)?;
            (f.target, f.target_sd, f.model, f.pass)
        }
    };
    let frequency_sd_hz = Some(sd_hz).filter(|sd| *sd > 0.0);
    let target = Target { name: name.clone(), frequency_hz, frequency_sd_hz };
    Some(FrequencyComparison { target, model_hz, met })
}
