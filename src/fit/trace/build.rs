//! Builds the model of a trace fit from a job and its recordings, and fits the starting states of its
//! segments at given parameter values.

use crate::fit::bounds::{BoundsSpacing, Prior};
use crate::fit::job::{FreeParameter, HeadSource, TraceChannel};
use crate::fit::nuisance_parameters::FreedConstant;
use crate::fit::trace::camera_observation::{CameraObservation, ObservationSettings};
use crate::fit::trace::iterate::{Iterate, TraceSearchSettings};
use crate::fit::trace::levenberg_marquardt::{refit_plain, start_stage};
use crate::fit::trace::model::{TraceModel, TraceRecording};
use crate::fit::trace::segment_simulation::segment_residuals;
use crate::fit::trace::segmentation::first_segment_s;
use crate::fit::trace::unknowns::{CameraUnknown, TraceUnknown, TraceUnknowns, UnknownKind};
use crate::fit::trace_data::TraceData;
use crate::recording::Recording;
use crate::recording::channel::ReversalInstants;
use crate::recording::cycles::MOST_UNLIKE;
use crate::recording::noise::{AutoregressiveNoise, mean_square_noise, measure_noise};
use crate::recording::quality::{CameraTilt, measure_quality, measure_tilt};
use crate::simulate::drive::{Drive, HeadMotionError, smooth_head_motion};
use crate::simulate::scene::{Scene, StartKind};
use portable_math as math;
use std::collections::BTreeMap;
use std::sync::Arc;

/// The segments of the last stage at the coordinates `point`, with starting states that minimise chi2; `None`
/// if a scene refuses the parameter values. The result does not depend on earlier calls.
pub(crate) fn fit_states_at(model: &TraceModel, segment_s: &[f64], point: &[f64]) -> Option<Iterate> {
    let segment_s = segment_s.last().copied().into_iter().collect();
    let last = TraceSearchSettings::without_twins(segment_s);
    refit_plain(model, start_stage(model, &last, (0, true), point, &[])?)
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
    let glass = measure_glass(recording);
    let flat = glass.as_ref().and_then(|glass| glass.flatten_recording(recording));
    // a flattened recording has no tilt
    let glass = glass.filter(|_| flat.is_none());
    let recording = flat.as_ref().unwrap_or(recording);
    let mut scene = source.scene.clone();
    // every segment has its own starting state, so the start of the scene is not used
    scene.start = StartKind::Upright;
    let own_head = traced.head == HeadSource::Recording;
    if own_head {
        scene.drive = Drive::Recorded(Arc::new(smooth_head_motion(recording)?));
    }
    let found = traced.noise.clone().unwrap_or_else(|| Arc::new(measure_noise(recording)));
    let head_m = match &scene.drive {
        // (motion makes both estimates too large)
        Drive::Recorded(curve) if scene.linkage.is_slider() => {
            let by_frame = mean_square_noise(&recording.traces().head_x_m);
            curve.noise_m().into_iter().chain(by_frame).reduce(f64::min)
        }
        _ => None,
    };
    let noise = [found.own_tip_x(), found.own_head_y()]
        .map(|own| channel_noise(traced, recording, own, head_m.filter(|head_m| *head_m > MIN_NOISE_M)));
    let has = |channel| traced.channels.contains(&channel);
    let settings = ObservationSettings {
        tip_x: has(TraceChannel::TipX) || has(TraceChannel::Deflection),
        head_drop: has(TraceChannel::HeadDrop),
        exposure_s,
        noise,
        frames: [traced.frames.start, traced.frames.end],
    };
    let shared = [&found.common.tip_x, &found.common.head_y]
        .map(|shared| shared.as_ref().map(|shared| shared.noise_m.clone()));
    let first_segment_s = first_segment_s(&scene.linkage);
    let film = CameraObservation::new(
        recording,
        &scene.drive,
        own_head,
        settings,
        &shared,
        glass.as_ref(),
        first_segment_s,
    );
    Ok(TraceRecording { condition: traced.condition, scene, observation: film, noise: found })
}

/// Noise of a channel: the value in the job, if it gives one. Otherwise it is the measured noise without the
/// part that tip and head have in common. For a slider, this noise must be at most twice `head_m`, the noise
/// of its recorded head, m. If it is not, or if the measurement fails, the noise is white, with the size
/// `head_m` or, without it, with the scatter from frame to frame.
fn channel_noise(
    traced: &TraceData,
    recording: &Recording,
    own: Option<AutoregressiveNoise>,
    head_m: Option<f64>,
) -> AutoregressiveNoise {
    let white = |sd_m: f64| {
        let noise = AutoregressiveNoise::white(sd_m.max(MIN_NOISE_M));
        noise.unwrap_or_else(|_| unreachable!("a positive number"))
    };
    if let Some(noise_m) = traced.noise_m {
        return white(noise_m);
    }
    // the sensors of slider and head are alike, and a stick-slip cycle of few frames may pass for noise
    let is_motion =
        |noise: &AutoregressiveNoise| head_m.is_some_and(|head_m| noise.sd() > MOST_UNLIKE * head_m);
    let Some(noise) = own.filter(|noise| !is_motion(noise)) else {
        let scatter_m = || {
            let measured = measure_quality(recording, None);
            measured.head_x.noise_m.or(measured.tip_x.noise_m)
        };
        return white(head_m.or_else(scatter_m).unwrap_or(MIN_NOISE_M));
    };
    let sd_m = noise.sd().max(MIN_NOISE_M);
    AutoregressiveNoise::new(sd_m, noise.coefficients().to_vec()).unwrap_or_else(|_| white(sd_m))
}

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

/// What is known of a camera error before the fit.
struct CameraPrior {
    what: CameraUnknown,
    /// Mean of the prior.
    mean: f64,
    /// Standard deviation of the prior; without a prior, half of the width of the range. An error of size 0
    /// is not estimated.
    size: f64,
    /// Whether the error has no prior, so that only its range is limited.
    is_flat: bool,
    /// Value at which the search starts.
    start: f64,
}

impl CameraPrior {
    /// A normal prior around `mean`.
    fn normal(what: CameraUnknown, mean: f64, size: f64) -> Self {
        Self { what, mean, size, is_flat: false, start: mean }
    }

    fn build_unknown(&self, film: usize) -> TraceUnknown {
        let unit = self.what.coordinate_unit();
        let (mean, size, start) = (self.mean / unit, self.size / unit, self.start / unit);
        let reach = if self.is_flat { size } else { CAMERA_RANGE_SD * size };
        let centre = if self.is_flat { start } else { mean };
        let range = [centre - reach, centre + reach];
        TraceUnknown {
            kind: UnknownKind::Camera { film, what: self.what },
            range,
            prior: (!self.is_flat).then_some([mean, size]),
            start: start.clamp(range[0], range[1]),
        }
    }
}

/// Unknowns of the camera of a recording. A quantity whose prior has zero width is not estimated.
///
/// The zero of the picture is arbitrary. Drops are counted from an arbitrary height and, if the head is not
/// tracked, positions along the sweep from an arbitrary place, so these offsets have no prior. If the path of
/// the tip on the glass shows the tilt, this tilt is the mean of the prior.
fn camera_unknowns(film: usize, source: &TraceSource<'_>, data: &CameraObservation) -> Vec<TraceUnknown> {
    /// Standard deviation of the curvature that was not measured, times the travel of the head: a change of
    /// the slope of the glass, rad. It is that of a windshield with a radius of one metre over a stroke of
    /// 0.1 m. The path of the tip shows the curvature only roughly, since the marker of the tip moves up and
    /// down as the lip turns.
    const CHANGE_OF_SLOPE_RAD: f64 = 0.1;
    let TraceData { camera: doubt, head, .. } = source.traced;
    let linkage = &source.scene.linkage;
    let [angle_rad, angle_sd_rad] = data.tilt_rad;
    let [along_m, drop_m] = data.guess_offsets_m(angle_rad, linkage);
    let zero = |what, start| CameraPrior {
        what,
        mean: 0.0,
        size: if doubt.offset_sd_m > 0.0 { linkage.upright_height_m() } else { 0.0 },
        is_flat: true,
        start,
    };
    let normal = CameraPrior::normal;
    let with_drop = |sd: f64| if data.settings.head_drop { sd } else { 0.0 };
    // one channel alone cannot distinguish the place of the marker on the lip from the length of the lip
    let with_tip = |sd: f64| if data.settings.tip_x { with_drop(sd) } else { 0.0 };
    let along = match head {
        HeadSource::Scene => zero(CameraUnknown::OffsetX, along_m),
        HeadSource::Recording => {
            CameraPrior { start: along_m, ..normal(CameraUnknown::OffsetX, 0.0, doubt.offset_sd_m) }
        }
    };
    let drop = zero(CameraUnknown::OffsetDrop, drop_m);
    let tilt_sd_rad =
        if doubt.tilt_sd_rad > 0.0 { math::hypot(doubt.tilt_sd_rad, angle_sd_rad) } else { 0.0 };
    let bends = doubt.tilt_sd_rad > 0.0 && data.head_travel_m > 0.0;
    let curvature_sd_per_m = if bends { CHANGE_OF_SLOPE_RAD / data.head_travel_m } else { 0.0 };
    let rows = [
        along,
        CameraPrior { size: with_drop(drop.size), ..drop },
        normal(CameraUnknown::TipAlong, 0.0, with_tip(doubt.offset_sd_m)),
        normal(CameraUnknown::TipAcross, 0.0, with_tip(doubt.offset_sd_m)),
        normal(
            CameraUnknown::HeadAbove,
            0.0,
            if data.own_head && bends { with_drop(doubt.offset_sd_m) } else { 0.0 },
        ),
        normal(CameraUnknown::DriftX, 0.0, doubt.drift_sd_m_per_s),
        normal(CameraUnknown::DriftDrop, 0.0, with_drop(doubt.drift_sd_m_per_s)),
        normal(CameraUnknown::Scale, 0.0, doubt.scale_sd),
        normal(CameraUnknown::Tilt, angle_rad, with_drop(tilt_sd_rad)),
        normal(CameraUnknown::Curvature, 0.0, with_drop(curvature_sd_per_m)),
        normal(CameraUnknown::Clock, 0.0, doubt.clock_sd_s(*head)),
    ];
    rows.iter().filter(|row| row.size > 0.0).map(|row| row.build_unknown(film)).collect()
}

/// Angle and curvature of the glass in the picture, from the path of the tip; `None` if they cannot be
/// measured.
fn measure_glass(recording: &Recording) -> Option<CameraTilt> {
    recording.traces().tip_y_m.iter().flatten().next()?;
    let instants = ReversalInstants::find_instants(recording);
    measure_tilt(recording, &instants, &measure_quality(recording, None)).ok()
}
