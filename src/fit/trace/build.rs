//! A trace model from a job's scenes and recordings.

use super::film::{Film, FilmSettings};
use super::model::{Shoot, TraceModel};
use super::unknown::{CameraUnknown, Kind, Unknown, Unknowns};
use crate::fit::axis::{Axis, Prior};
use crate::fit::constants::Freed;
use crate::fit::job::{FreeParameter, Head, TraceChannel};
use crate::fit::scale::Spacing;
use crate::fit::traced::Traced;
use crate::math;
use crate::recording::Recording;
use crate::recording::channel::Instants;
use crate::recording::noise_model::{Ar, ChannelNoise, Shared, common, noise_of};
use crate::recording::quality::{Tilt, quality, tilt};
use crate::simulate::drive::{Drive, HeadError, head_motion};
use crate::simulate::scene::Scene;
use std::sync::Arc;

/// Standard deviations of a camera's prior within which it is searched.
const REACH_SD: f64 = 20.0;

/// What a recording is fitted with.
pub struct Source<'a> {
    /// The scene of its condition.
    pub scene: &'a Scene,
    /// The recording.
    pub recording: &'a Recording,
    /// Time for which the shutter is open, s.
    pub exposure_s: f64,
    /// What of it is fitted.
    pub traced: &'a Traced,
}

impl TraceModel {
    /// The model of a job's traces with its free parameters and the constants that are freed.
    ///
    /// # Errors
    /// [`HeadError`] where the head that drives a model is not tracked.
    pub fn new(
        sources: &[Source<'_>],
        parameters: &[FreeParameter],
        constants: &[Freed],
    ) -> Result<Self, HeadError> {
        let shoots = sources.iter().map(shoot).collect::<Result<Vec<_>, _>>()?;
        let mut unknowns: Vec<Unknown> = parameters.iter().map(parameter).collect();
        unknowns.extend(constants.iter().map(constant));
        for (number, (source, shoot)) in sources.iter().zip(&shoots).enumerate() {
            unknowns.extend(camera(number, source, &shoot.film));
        }
        Ok(Self { shoots, unknowns: Unknowns(unknowns) })
    }
}

fn shoot(source: &Source<'_>) -> Result<Shoot, HeadError> {
    let Source { recording, traced, exposure_s, .. } = *source;
    let mut scene = source.scene.clone();
    if traced.head == Head::Recording {
        scene.drive = Drive::Recorded(Arc::new(head_motion(recording)?));
    }
    let (shared, found) = (common(recording), noise_of(recording));
    let noise = [
        noise(traced, recording, found.along, shared.tip_x.as_ref()),
        noise(traced, recording, found.upwards, shared.head_y.as_ref()),
    ];
    let has = |channel| traced.channels.contains(&channel);
    let settings = FilmSettings {
        tip_x: has(TraceChannel::TipX) || has(TraceChannel::Deflection),
        head_drop: has(TraceChannel::HeadDrop),
        exposure_s,
        noise,
        frames: [traced.frames.start, traced.frames.end],
    };
    let own_head = traced.head == Head::Recording;
    let shared = [shared.tip_x, shared.head_y].map(|shared| shared.map(|shared| shared.noise_m));
    let film = Film::new(recording, &scene.drive, own_head, settings, &shared);
    Ok(Shoot { scene, film })
}

/// Noise of a channel: the job's, or the measured one less what the other point shows of it; white noise of
/// the size that frames differ by where it cannot be measured.
fn noise(traced: &Traced, recording: &Recording, found: Option<ChannelNoise>, shared: Option<&Shared>) -> Ar {
    let white = |sd_m: f64| {
        // (a positive number is a standard deviation)
        Ar::white(sd_m.max(LEAST_NOISE_M)).unwrap_or_else(|_| unreachable!("a positive number"))
    };
    if let Some(noise_m) = traced.noise_m {
        return white(noise_m);
    }
    let Some(ChannelNoise { noise, .. }) = found else {
        let measured = quality(recording, None);
        return white(measured.head_x.noise_m.or(measured.tip_x.noise_m).unwrap_or(LEAST_NOISE_M));
    };
    // what is left of it where both points have as much noise of their own; a large share says that they
    // have not, and then nothing is known of what is left
    let left = shared
        .filter(|shared| shared.share + 2.0 * shared.sd < LARGEST_SHARE)
        .map_or(1.0, |shared| (1.0 - shared.share * shared.share).sqrt());
    let sd_m = (noise.sd() * left).max(LEAST_NOISE_M);
    Ar::new(sd_m, noise.coefficients().to_vec()).unwrap_or_else(|_| white(sd_m))
}

/// Share of the noise from which on the points do not have as much of their own.
const LARGEST_SHARE: f64 = 0.9;
/// Least noise, m: simulated traces without any are written with as many digits.
const LEAST_NOISE_M: f64 = 1e-9;

fn parameter(free: &FreeParameter) -> Unknown {
    let Axis { bounds, prior } = Axis { bounds: free.bounds, prior: free.prior };
    let unit = match bounds.spacing() {
        Spacing::Log => None,
        Spacing::Linear => Some(bounds.upper() - bounds.lower()),
    };
    let along = |value: f64| unit.map_or_else(|| math::ln(value), |unit| value / unit);
    let prior = prior.map(|prior| match prior {
        Prior::Linear { mean, sd } => [along(mean), sd / unit.unwrap_or(mean)],
        Prior::Log { mean_ln, sd_ln } => [mean_ln, sd_ln],
    });
    let range = [along(bounds.lower()), along(bounds.upper())];
    let kind = Kind::Parameter { name: free.name.clone(), unit };
    Unknown { kind, range, prior, start: 0.5 * (range[0] + range[1]) }
}

fn constant(freed: &Freed) -> Unknown {
    let start = math::ln(freed.value);
    Unknown {
        kind: Kind::Parameter { name: freed.name.clone(), unit: None },
        range: freed.range().map(math::ln),
        prior: Some([start, freed.sd_relative]),
        start,
    }
}

/// What is not known of a recording's camera, those of no width left out.
fn camera(film: usize, source: &Source<'_>, data: &Film) -> Vec<Unknown> {
    let (doubt, head) = (&source.traced.camera, source.traced.head);
    let has_drop = data.settings.head_drop;
    let tilt_rad = seen_tilt(source.recording);
    let [offset_x_m, offset_drop_m] = data.offsets(tilt_rad);
    let with_drop = |sd: f64| if has_drop { sd } else { 0.0 };
    [
        (CameraUnknown::OffsetX, doubt.offset_sd_m, offset_x_m),
        (CameraUnknown::OffsetDrop, with_drop(doubt.offset_sd_m), offset_drop_m),
        (CameraUnknown::DriftX, doubt.drift_sd_m_per_s, 0.0),
        (CameraUnknown::DriftDrop, with_drop(doubt.drift_sd_m_per_s), 0.0),
        (CameraUnknown::Scale, doubt.scale_sd, 0.0),
        (CameraUnknown::Tilt, with_drop(doubt.tilt_sd_rad), tilt_rad),
        (CameraUnknown::Clock, doubt.clock_sd_s(head), 0.0),
    ]
    .into_iter()
    .filter(|(_, sd, _)| *sd > 0.0)
    .map(|(what, sd, start)| {
        let unit = what.unit();
        let reach = REACH_SD * sd / unit;
        let start = (start / unit).clamp(-reach, reach);
        Unknown {
            kind: Kind::Camera { film, what },
            range: [-reach, reach],
            prior: Some([0.0, sd / unit]),
            start,
        }
    })
    .collect()
}

/// The tilt that the path of the tip on the glass shows, rad; 0 where it shows none.
fn seen_tilt(recording: &Recording) -> f64 {
    let found = tilt(recording, &Instants::find(recording), &quality(recording, None));
    found.ok().filter(Tilt::is_clear).map_or(0.0, |tilt| tilt.angle_rad)
}
