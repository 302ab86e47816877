//! Builds the model of a trace fit from a job and its recordings, and fits the starting states of its
//! segments at given parameter values.

use crate::fit::bounds::{BoundsSpacing, Prior};
use crate::fit::job::{FreeParameter, HeadSource, TraceChannel};
use crate::fit::nuisance_parameters::FreedConstant;
use crate::fit::trace::camera_observation::{CameraObservation, ObservationSettings};
use crate::fit::trace::checkpoint::{Iterate, TraceSearchSettings};
use crate::fit::trace::levenberg_marquardt::{first_iterate, refit_plain};
use crate::fit::trace::model::{TraceModel, TraceRecording};
use crate::fit::trace::segment_simulation::segment_residuals;
use crate::fit::trace::unknowns::{CameraUnknown, TraceUnknown, TraceUnknowns, UnknownKind};
use crate::fit::trace_data::TraceData;
use crate::recording::Recording;
use crate::recording::channel::ReversalInstants;
use crate::recording::noise_model::{
    AutoregressiveNoise, ChannelNoise, SharedNoise, measure_common_noise, measure_noise,
};
use crate::recording::quality::{CameraTilt, measure_quality, measure_tilt};
use crate::simulate::drive::{Drive, HeadMotionError, smooth_head_motion};
use crate::simulate::scene::Scene;
use portable_math as math;
use std::collections::BTreeMap;
use std::sync::Arc;

/// The segments of the last stage at the coordinates `point`, with starting states that minimise chi2; `None`
/// if a scene refuses the parameter values. The result does not depend on earlier calls.
pub(crate) fn fit_states_at(model: &TraceModel, segment_s: &[f64], point: &[f64]) -> Option<Iterate> {
    let last = TraceSearchSettings { segment_s: segment_s.last().copied().into_iter().collect(), twins: 0 };
    refit_plain(model, first_iterate(model, &last, point)?)
}

/// Whitened residuals of every fitted frame, recording by recording, tip before head. An entry is `None`
/// where the model has no value.
pub(crate) fn frame_residuals(model: &TraceModel, at: Option<&Iterate>) -> Vec<Option<f64>> {
    let mut known = BTreeMap::new();
    for segment in at.map(|at| segment_residuals(model, at)).unwrap_or_default() {
        let place = |frame: &usize| (segment.recording, segment.is_drop, *frame);
        known.extend(segment.frames.iter().map(place).zip(segment.whitened.iter().copied()));
    }
    let films = model.recordings.iter().enumerate().flat_map(|(film, shoot)| {
        let [tip, drop] = shoot.observation.data_frames(shoot.observation.settings.frames);
        let of = move |is_drop: bool| move |frame: usize| (film, is_drop, frame);
        tip.into_iter().map(of(false)).chain(drop.into_iter().map(of(true)))
    });
    films.map(|place| known.get(&place).copied()).collect()
}

/// Half width of the search range of a camera error, in standard deviations of the prior of this error.
const CAMERA_RANGE_SD: f64 = 20.0;

/// A recording with its scene and the settings of its fit.
pub(crate) struct TraceSource<'a> {
    /// Scene of the condition.
    pub scene: &'a Scene,
    pub recording: &'a Recording,
    /// Exposure time of a frame, s.
    pub exposure_s: f64,
    /// Channels, frames and priors of the fit.
    pub traced: &'a TraceData,
}

impl TraceModel {
    /// The model of a job's traces with its free parameters and its nuisance parameters.
    ///
    /// # Errors
    /// [`HeadMotionError`] if the head that drives a model is not tracked.
    pub(crate) fn new(
        sources: &[TraceSource<'_>],
        parameters: &[FreeParameter],
        constants: &[FreedConstant],
    ) -> Result<Self, HeadMotionError> {
        let shoots = sources.iter().map(build_recording).collect::<Result<Vec<_>, _>>()?;
        let mut unknowns: Vec<TraceUnknown> = parameters.iter().map(parameter_unknown).collect();
        unknowns.extend(constants.iter().map(constant_unknown));
        for (number, (source, shoot)) in sources.iter().zip(&shoots).enumerate() {
            unknowns.extend(camera_unknowns(number, source, &shoot.observation));
        }
        Ok(Self { recordings: shoots, unknowns: TraceUnknowns(unknowns) })
    }
}

fn build_recording(source: &TraceSource<'_>) -> Result<TraceRecording, HeadMotionError> {
    let TraceSource { recording, traced, exposure_s, .. } = *source;
    let mut scene = source.scene.clone();
    let own_head = traced.head == HeadSource::Recording;
    if own_head {
        scene.drive = Drive::Recorded(Arc::new(smooth_head_motion(recording)?));
    }
    let (shared, found) = (measure_common_noise(recording), measure_noise(recording));
    let noise = [
        channel_noise(traced, recording, found.along_sweep, shared.tip_x.as_ref()),
        channel_noise(traced, recording, found.upwards, shared.head_y.as_ref()),
    ];
    let has = |channel| traced.channels.contains(&channel);
    let settings = ObservationSettings {
        tip_x: has(TraceChannel::TipX) || has(TraceChannel::Deflection),
        head_drop: has(TraceChannel::HeadDrop),
        exposure_s,
        noise,
        frames: [traced.frames.start, traced.frames.end],
    };
    let shared = [shared.tip_x, shared.head_y].map(|shared| shared.map(|shared| shared.noise_m));
    let film = CameraObservation::new(recording, &scene.drive, own_head, settings, &shared);
    Ok(TraceRecording { scene, observation: film })
}

/// Noise of a channel: the value in the job, if it gives one. Otherwise it is the measured noise without the
/// part that tip and head have in common. If the measurement fails, it is white noise with the scatter from
/// frame to frame.
fn channel_noise(
    traced: &TraceData,
    recording: &Recording,
    found: Option<ChannelNoise>,
    shared: Option<&SharedNoise>,
) -> AutoregressiveNoise {
    let white = |sd_m: f64| {
        let noise = AutoregressiveNoise::white(sd_m.max(MIN_NOISE_M));
        noise.unwrap_or_else(|_| unreachable!("a positive number"))
    };
    if let Some(noise_m) = traced.noise_m {
        return white(noise_m);
    }
    let Some(ChannelNoise { noise, .. }) = found else {
        let measured = measure_quality(recording, None);
        return white(measured.head_x.noise_m.or(measured.tip_x.noise_m).unwrap_or(MIN_NOISE_M));
    };
    // The factor for the remaining noise assumes that, apart from the common noise, tip and head have equal
    // noise. If the common share is large, this assumption is wrong, and nothing is subtracted.
    let left = shared
        .filter(|shared| shared.share + 2.0 * shared.sd < MAX_SHARED_NOISE)
        .map_or(1.0, |shared| (1.0 - shared.share * shared.share).sqrt());
    let sd_m = (noise.sd() * left).max(MIN_NOISE_M);
    AutoregressiveNoise::new(sd_m, noise.coefficients().to_vec()).unwrap_or_else(|_| white(sd_m))
}

/// Largest share of common noise that is subtracted from the noise of tip and head. With a larger share, the
/// remaining noise of the two points cannot be equal.
const MAX_SHARED_NOISE: f64 = 0.9;

/// Lower limit, m, of the standard deviation of the noise: the rounding error of simulated traces without
/// noise.
const MIN_NOISE_M: f64 = 1e-9;

fn parameter_unknown(free: &FreeParameter) -> TraceUnknown {
    let bounds = &free.bounds;
    let unit = match bounds.spacing() {
        BoundsSpacing::Log => None,
        BoundsSpacing::Linear => Some(bounds.upper() - bounds.lower()),
    };
    let along = |value: f64| unit.map_or_else(|| math::ln(value), |unit| value / unit);
    let prior = free.prior.map(|prior| match prior {
        Prior::Linear { mean, sd } => [along(mean), sd / unit.unwrap_or(mean)],
        Prior::Log { mean_ln, sd_ln } => [mean_ln, sd_ln],
    });
    let range = [along(bounds.lower()), along(bounds.upper())];
    let kind = UnknownKind::Parameter { name: free.name.clone(), unit };
    TraceUnknown { kind, range, prior, start: 0.5 * (range[0] + range[1]) }
}

fn constant_unknown(freed: &FreedConstant) -> TraceUnknown {
    let start = math::ln(freed.value);
    TraceUnknown {
        kind: UnknownKind::Parameter { name: freed.name.clone(), unit: None },
        range: freed.range().map(math::ln),
        prior: Some([start, freed.sd_relative]),
        start,
    }
}

/// Unknowns of the camera of a recording. A quantity whose prior has zero width is not estimated.
fn camera_unknowns(film: usize, source: &TraceSource<'_>, data: &CameraObservation) -> Vec<TraceUnknown> {
    let (doubt, head) = (&source.traced.camera, source.traced.head);
    let has_drop = data.settings.head_drop;
    let tilt_rad = recorded_tilt_rad(source.recording);
    let [offset_x_m, offset_drop_m] = data.guess_offsets_m(tilt_rad);
    let with_drop = |sd: f64| if has_drop { sd } else { 0.0 };
    let rows = [
        (CameraUnknown::OffsetX, doubt.offset_sd_m, offset_x_m),
        (CameraUnknown::OffsetDrop, with_drop(doubt.offset_sd_m), offset_drop_m),
        (CameraUnknown::DriftX, doubt.drift_sd_m_per_s, 0.0),
        (CameraUnknown::DriftDrop, with_drop(doubt.drift_sd_m_per_s), 0.0),
        (CameraUnknown::Scale, doubt.scale_sd, 0.0),
        (CameraUnknown::Tilt, with_drop(doubt.tilt_sd_rad), tilt_rad),
        (CameraUnknown::Clock, doubt.clock_sd_s(head), 0.0),
    ];
    let unknown = |(what, sd, start): (CameraUnknown, f64, f64)| {
        let (kind, unit) = (UnknownKind::Camera { film, what }, what.coordinate_unit());
        let reach = CAMERA_RANGE_SD * sd / unit;
        let (prior, start) = (Some([0.0, sd / unit]), (start / unit).clamp(-reach, reach));
        TraceUnknown { kind, range: [-reach, reach], prior, start }
    };
    rows.into_iter().filter(|(_, sd, _)| *sd > 0.0).map(unknown).collect()
}

/// Tilt of the camera from the path of the tip on the glass, rad; 0 if the path does not show it clearly.
fn recorded_tilt_rad(recording: &Recording) -> f64 {
    let instants = ReversalInstants::find_instants(recording);
    let found = measure_tilt(recording, &instants, &measure_quality(recording, None));
    found.ok().filter(CameraTilt::is_clear).map_or(0.0, |tilt| tilt.angle_rad)
}
