//! A run of the model over one segment, as the camera records it, with its derivatives.

use super::camera_observation::CameraObservation;
use super::iterate::Iterate;
use super::model::{TraceModel, TraceRecording};
use super::normal_equations::recording_models;
use super::projection::{FrameProjection, PictureGeometry};
use super::unknowns::{CameraUnknown, TraceUnknowns, UnknownKind};
use crate::model::Pose;
use crate::model::parameters::name_if_in_recording;
use crate::model::shoulder::Shoulder;
use crate::simulate::mode::TipMode;
use crate::simulate::scene::{Scene, StartKind};
use crate::simulate::sensitivity::{
    Channel, TangentDirection, TangentObserver, TangentRunner, TangentSeeds, TangentSegment,
};
use crate::simulate::{RunStatus, SolverOptions};
use nalgebra::{DMatrix, DVector, Vector4};
use std::cell::RefCell;

/// Angles, rad, and rates, rad/s, of neck and lip.
pub(super) type LinkState = Vector4<f64>;

/// Scales of the four numbers of a starting state: two angles, rad, and two angular velocities, rad per first
/// segment length.
const STATE_STEPS: [f64; 4] = [3e-5, 3e-5, 4e-4, 4e-4];
/// Number of values in a starting state.
const STATES: usize = 4;
/// Integration tolerance of the run of a segment. The resulting error is a thousandth of the tracking noise.
const TOLERANCE: f64 = 1e-8;
/// Relative accuracy of the derivatives of a run; it is sufficient for a step of the search.
const ACCURACY: f64 = 1e-5;
/// Maximum number of evaluations of the right-hand side in the run of a segment.
const MOST_EVALUATIONS: u64 = 400_000;
/// Channels that are averaged over the exposure of every frame. The last one is computed only if the place of
/// the tip's marker on the lip is estimated.
const CHANNELS: [Channel; 4] = [Channel::TipX, Channel::HeadX, Channel::HeadDrop, Channel::LipAngle];

thread_local! {
    /// Workspace for the runs of the current thread.
    static RUNNER: RefCell<TangentRunner> = RefCell::new(TangentRunner::with_accuracy(ACCURACY));
}

/// The run of the model over one segment, as the camera would record it.
struct SegmentObservation {
    /// Index of the first frame of the segment.
    first: usize,
    /// Number of directions along which the run is differentiated.
    directions: usize,
    /// Number of channels that are computed.
    channels: usize,
    /// Means over the exposure, one row per frame: positions of tip and head along the sweep and drop of the
    /// head, m, and angle of the lip, rad.
    means: Vec<[f64; 4]>,
    /// Derivatives of the means, ordered by frame, then channel, then direction.
    slopes: Vec<f64>,
    /// State at the end of the run.
    end: Option<LinkState>,
    /// Whether the derivatives are known up to the end of the run.
    is_known: bool,
    /// Times during which the tip sticks, s: with the neck off the shoulder, and with the neck on it.
    held_s: [f64; 2],
}

/// Averages a run over the exposure of every frame.
struct ShutterAverage<'a> {
    times_s: &'a [f64],
    clock_s: f64,
    half_s: f64,
    stop_s: f64,
    shoulder: Option<Shoulder>,
    frame: usize,
    row: Vec<f64>,
    shot: SegmentObservation,
}

impl TangentObserver for ShutterAverage<'_> {
    fn observe_segment(&mut self, piece: &TangentSegment<'_>) {
        let shot = &mut self.shot;
        shot.is_known &= piece.is_known;
        if piece.mode == TipMode::Stick {
            let theta = piece.sample_at(0.5 * (piece.start_s + piece.end_s)).pose.theta;
            let leans = self.shoulder.is_some_and(|shoulder| shoulder.contact_at(theta).angle_sign() != 0.0);
            shot.held_s[usize::from(leans)] += piece.end_s - piece.start_s;
        }
        while let Some(time) = self.times_s.get(self.frame).map(|t| t - self.clock_s) {
            let (opens, closes) = (time - self.half_s, time + self.half_s);
            if opens > piece.end_s || (self.half_s == 0.0 && time > piece.end_s) {
                break;
            }
            let (weights, share) = if self.half_s > 0.0 {
                let weights = piece.weights_over(opens.max(piece.start_s), closes.min(piece.end_s));
                (weights, 0.5 / self.half_s)
            } else {
                (piece.weights_at(time.max(piece.start_s)), 1.0)
            };
            for (k, channel) in CHANNELS.into_iter().take(shot.channels).enumerate() {
                shot.means[self.frame][k] += share * piece.channel_value(channel, &weights);
                if shot.directions > 0 {
                    piece.channel_derivatives(channel, &weights, &mut self.row);
                    let at = (self.frame * shot.channels + k) * shot.directions;
                    for (sum, slope) in shot.slopes[at..].iter_mut().zip(&self.row) {
                        *sum += share * slope;
                    }
                }
            }
            if closes > piece.end_s {
                break;
            }
            self.frame += 1;
        }
        if piece.end_s >= self.stop_s {
            let pose = piece.sample_at(piece.end_s).pose;
            shot.end = Some(LinkState::new(pose.theta, pose.phi, pose.theta_rate, pose.phi_rate));
        }
    }
}

/// A frame of a run of the model.
pub(super) struct ShownFrame {
    /// Position of the tip along the sweep and drop of the head in the picture, m.
    pub picture: [f64; 2],
    /// Position of the head along the sweep in the picture, m.
    pub head_x_m: f64,
    /// True positions of tip and head along the sweep, and true drop, m.
    pub truth: [f64; 3],
}

/// Derivative of the height of the head of the upright blade with respect to a parameter of the scene, m per
/// unit of the parameter; `None` if the height does not depend on it.
fn upright_slope(scene: &Scene, name: &str) -> Option<f64> {
    /// Relative change of the parameter; the height is linear in the lengths.
    const CHANGE: f64 = 1e-3;
    let value = scene.value(name)?;
    // (one of the two may be outside of the range that a scene accepts)
    let changed =
        [CHANGE, -CHANGE].map(|change| (change, scene.with_parameter(name, value * (1.0 + change))));
    let (change, changed) = changed.into_iter().find_map(|(change, scene)| Some((change, scene.ok()?)))?;
    let rise_m = changed.linkage.upright_height_m() - scene.linkage.upright_height_m();
    (rise_m != 0.0).then(|| rise_m / (change * value))
}

/// Residuals of a segment, and the derivatives of the residuals with respect to the starting state and with
/// respect to the unknowns.
pub(super) struct LinearizedSegment {
    pub residuals: DVector<f64>,
    pub by_state: DMatrix<f64>,
    pub by_unknown: DMatrix<f64>,
}

/// The model of a recording at one point of the search.
pub(super) struct RecordingModel<'a> {
    pub observation: &'a CameraObservation,
    pub geometry: PictureGeometry,
    pub scene: Scene,
    /// Whether the place of the tip's marker on the lip is estimated.
    has_tip_marker: bool,
    none: TangentSeeds,
    states: TangentSeeds,
    all: TangentSeeds,
    /// Effect of each unknown on the residuals, in the order of the unknowns.
    effects: Vec<UnknownEffect>,
}

/// Effect of an unknown on the residuals of a recording. It is empty if the unknown belongs to other
/// recordings.
#[derive(Default)]
struct UnknownEffect {
    /// Changes of the run. Fields: index of the direction along which the run is differentiated, and
    /// derivative of the quantity that varies along this direction with respect to the coordinate of the
    /// unknown.
    runs: Vec<(usize, f64)>,
    /// Change of the picture of the same run: kind of camera error, and derivative of the value of this error
    /// with respect to the coordinate of the unknown.
    picture: Option<(CameraUnknown, f64)>,
    /// Shift of head and tip along the sweep, m per coordinate. [`TangentDirection::DriveScale`] stretches
    /// the motion about zero; the shift moves the fixed point to the mean position.
    shift_m: f64,
}

impl<'a> RecordingModel<'a> {
    /// The model of a recording at the point `z` of the search; `None` if the scene refuses `z`.
    pub(super) fn new(
        shoot: &'a TraceRecording,
        number: usize,
        unknowns: &TraceUnknowns,
        z: &[f64],
    ) -> Option<Self> {
        let film = &shoot.observation;
        let scene = unknowns.scene_at(shoot, number, z)?;
        let [neck, lip] = scene.linkage.angle_units();
        // (the neck of a slider does not turn)
        let mut directions: Vec<TangentDirection> = [
            (neck, TangentDirection::NeckAngle),
            (lip, TangentDirection::LipAngle),
            (neck, TangentDirection::NeckRate),
            (lip, TangentDirection::LipRate),
        ]
        .into_iter()
        .filter_map(|(unit, direction)| (unit > 0.0).then_some(direction))
        .collect();
        let states = TangentSeeds::new(&scene, &directions).ok()?;
        let geometry = unknowns.geometry_at(shoot, number, z, &scene);
        let mut stretched = None;
        let mut effects = Vec::new();
        for (unknown, z) in unknowns.0.iter().zip(z) {
            let mut direction = |direction: TangentDirection| {
                directions.push(direction);
                directions.len() - 1
            };
            let slope = unknown.slope(*z);
            let mut effect = UnknownEffect::default();
            match &unknown.kind {
                UnknownKind::Parameter { name, .. } => {
                    if let Some(name) = name_if_in_recording(name, shoot.condition) {
                        let along = direction(TangentDirection::Parameter(name.to_owned()));
                        effect.runs.push((along, slope));
                        let by_length = upright_slope(&scene, name).filter(|_| geometry.slopes());
                        // a longer blade lifts the marker of the head
                        effect.picture = by_length.map(|by| (CameraUnknown::HeadAbove, slope * by));
                    }
                }
                UnknownKind::Camera { film, .. } if *film != number => {}
                UnknownKind::Camera { what: CameraUnknown::Clock, .. } => {
                    effect.runs.push((direction(TangentDirection::DriveDelay), slope));
                }
                UnknownKind::Camera { what, .. } => effect.picture = Some((*what, slope)),
            }
            if let Some((what, slope)) = effect.picture.filter(|_| film.own_head)
                && let Some(by) = geometry.stretch_by(what)
            {
                let along = *stretched.get_or_insert_with(|| direction(TangentDirection::DriveScale));
                effect.runs.push((along, slope * by));
                effect.shift_m = -slope * by * film.centre_m;
            }
            effects.push(effect);
        }
        let none = TangentSeeds::new(&scene, &[]).ok()?;
        let all = TangentSeeds::new(&scene, &directions).ok()?;
        let has_tip_marker = effects.iter().any(|effect| {
            matches!(effect.picture, Some((CameraUnknown::TipAlong | CameraUnknown::TipAcross, _)))
        });
        Some(Self { observation: film, geometry, scene, has_tip_marker, none, states, all, effects })
    }

    /// Scales of the four numbers of a starting state, rad and rad/s.
    pub(super) fn state_steps(&self) -> [f64; 4] {
        let per_s = 1.0 / self.observation.first_segment_s;
        let [neck, lip] = self.scene.linkage.angle_units();
        let units = [neck, lip, neck * per_s, lip * per_s];
        std::array::from_fn(|i| STATE_STEPS[i] * units[i])
    }

    /// The state of the blade at the start of the next segment, right after the frames `frames`; `None` if
    /// the run ends early.
    pub(super) fn end_state(&self, frames: [usize; 2], state: &LinkState) -> Option<LinkState> {
        self.simulate_segment(frames, state, &self.none)?.end
    }

    /// Times during which the tip sticks in a segment, s: with the neck off the shoulder, and with the neck
    /// on it. `None` if the run ends early.
    pub(super) fn held_times_s(&self, frames: [usize; 2], state: &LinkState) -> Option<[f64; 2]> {
        Some(self.simulate_segment(frames, state, &self.none)?.held_s)
    }

    /// The model in the frames from `frames[0]` to before `frames[1]`, in a run that starts in `state`; fewer
    /// frames if the run ends early.
    pub(super) fn show_frames(&self, frames: [usize; 2], state: &LinkState) -> Vec<ShownFrame> {
        let (shot, complete) = self.run_segment(frames, state, &self.none);
        let show = |(at, means): (usize, &[f64; 4])| {
            let shown = self.project_frame(frames[0] + at, *means);
            let truth = [means[0], means[1], means[2]];
            ShownFrame { picture: shown.picture(), head_x_m: shown.head_in_picture(), truth }
        };
        shot.means[..complete].iter().enumerate().map(show).collect()
    }

    fn simulate_segment(
        &self,
        frames: [usize; 2],
        state: &LinkState,
        seeds: &TangentSeeds,
    ) -> Option<SegmentObservation> {
        let (shot, complete) = self.run_segment(frames, state, seeds);
        let is_whole = complete == frames[1] - frames[0] && shot.end.is_some();
        (is_whole && (shot.is_known || seeds.is_empty())).then_some(shot)
    }

    /// Runs the model over a segment. Also returns the number of frames that the run completes.
    fn run_segment(
        &self,
        [first, last]: [usize; 2],
        state: &LinkState,
        seeds: &TangentSeeds,
    ) -> (SegmentObservation, usize) {
        let (film, clock_s) = (self.observation, self.geometry.camera.clock_s);
        let (lead, count, directions) = (film.lead_s(), last - first, seeds.len());
        let mut scene = self.scene.clone();
        scene.start_s = film.times_s[first] - clock_s - lead;
        let [theta, phi, theta_rate, phi_rate] = (*state).into();
        scene.start = StartKind::State(Pose { theta, phi, theta_rate, phi_rate });
        scene.run.stop_s = match film.times_s.get(last) {
            Some(next) => next - clock_s - lead,
            // the run ends slightly after the end of the last exposure
            None => film.times_s[last - 1] - clock_s + lead + 1e-9,
        };
        let channels = CHANNELS.len() - usize::from(!self.has_tip_marker);
        let (means, slopes) = (vec![[0.0; 4]; count], vec![0.0; count * channels * directions]);
        let mut average = ShutterAverage {
            times_s: &film.times_s[first..last],
            clock_s,
            half_s: lead,
            stop_s: scene.run.stop_s,
            shoulder: scene.linkage.shoulder,
            frame: 0,
            row: vec![0.0; directions],
            shot: SegmentObservation {
                first,
                directions,
                channels,
                means,
                slopes,
                end: None,
                is_known: true,
                held_s: [0.0; 2],
            },
        };
        let effort = SolverOptions { most_evaluations: MOST_EVALUATIONS, ..SolverOptions::new(TOLERANCE) };
        let run = RUNNER.with_borrow_mut(|runner| runner.run_scene(&scene, effort, seeds, &mut average));
        let mut shot = average.shot;
        shot.end = shot.end.filter(|_| run.status == RunStatus::Completed);
        (shot, average.frame.min(count))
    }

    /// Residuals whitened to unit variance: first those of the tip, frame by frame, then those of the drop.
    pub(super) fn whitened_residuals(&self, frames: [usize; 2], state: &LinkState) -> Option<DVector<f64>> {
        self.whiten_residuals(frames, &self.simulate_segment(frames, state, &self.none)?)
    }

    /// Residuals whitened to unit variance; `None` if the run has no derivatives up to its end, so that
    /// [`Self::linearize_state`] would fail.
    pub(super) fn differentiable_residuals(
        &self,
        frames: [usize; 2],
        state: &LinkState,
    ) -> Option<DVector<f64>> {
        let shot = self.simulate_segment(frames, state, &self.none).filter(|shot| shot.is_known)?;
        self.whiten_residuals(frames, &shot)
    }

    fn whiten_residuals(&self, frames: [usize; 2], shot: &SegmentObservation) -> Option<DVector<f64>> {
        let mut residuals = self.model_minus_measured(shot);
        self.observation.segment_whitening(frames).whiten_column(residuals.as_mut_slice());
        Some(residuals).filter(|r| r.iter().all(|x| x.is_finite()))
    }

    /// Whitened residuals, and their derivatives with respect to the starting state only; `by_unknown` is
    /// empty.
    pub(super) fn linearize_state(&self, frames: [usize; 2], state: &LinkState) -> Option<LinearizedSegment> {
        self.linearize_by(frames, state, &self.states, &[])
    }

    /// Whitened residuals, and their derivatives with respect to the starting state and to all unknowns.
    pub(super) fn linearize(&self, frames: [usize; 2], state: &LinkState) -> Option<LinearizedSegment> {
        self.linearize_by(frames, state, &self.all, &self.effects)
    }

    fn linearize_by(
        &self,
        frames: [usize; 2],
        state: &LinkState,
        seeds: &TangentSeeds,
        effects: &[UnknownEffect],
    ) -> Option<LinearizedSegment> {
        let shot = self.simulate_segment(frames, state, seeds)?;
        let show = |(i, means): (usize, &[f64; 4])| self.project_frame(shot.first + i, *means);
        let shown: Vec<FrameProjection<'_>> = shot.means.iter().enumerate().map(show).collect();
        let by_means: Vec<[[f64; 2]; 4]> = shown.iter().map(FrameProjection::by_means).collect();
        let mut residuals = self.subtract_measured(&shot, |i| shown[i].picture());
        let rows = residuals.len();
        let mut by_state = DMatrix::zeros(rows, STATES);
        // (derivatives by the state of a neck that does not turn are zero)
        let units = self.scene.linkage.angle_units();
        let columns = by_state.as_mut_slice().chunks_mut(rows.max(1)).enumerate();
        for (direction, (_, column)) in columns.filter(|(i, _)| units[i % 2] > 0.0).enumerate() {
            self.add_run_derivative(&shot, &by_means, direction, 1.0, column);
        }
        let mut by_unknown = DMatrix::zeros(rows, effects.len());
        for (effect, column) in effects.iter().zip(by_unknown.as_mut_slice().chunks_mut(rows.max(1))) {
            for (i, slope) in &effect.runs {
                self.add_run_derivative(&shot, &by_means, *i, *slope, column);
            }
            if let Some((what, slope)) = effect.picture {
                self.add_to_column(&shot, column, |i, _| {
                    let (by, [tip, head, ..]) = (shown[i].by_camera(what), by_means[i]);
                    std::array::from_fn(|k| slope * by[k] + effect.shift_m * (tip[k] + head[k]))
                });
            }
        }
        let whitening = self.observation.segment_whitening(frames);
        whitening.whiten_column(residuals.as_mut_slice());
        whitening.whiten_columns(&mut by_state);
        whitening.whiten_columns(&mut by_unknown);
        let finite = residuals.iter().chain(&by_state).chain(&by_unknown).all(|x| x.is_finite());
        finite.then_some(LinearizedSegment { residuals, by_state, by_unknown })
    }

    fn project_frame(&self, frame: usize, means: [f64; 4]) -> FrameProjection<'_> {
        let film = self.observation;
        let seen_head_m = film.own_head.then(|| film.head_m[frame]);
        self.geometry.project_frame(seen_head_m, film.after_middle_s(frame), means)
    }

    /// Model minus measurement, m: first for the tip, frame by frame, then for the drop.
    fn model_minus_measured(&self, shot: &SegmentObservation) -> DVector<f64> {
        self.subtract_measured(shot, |i| self.project_frame(shot.first + i, shot.means[i]).picture())
    }

    /// Like [`Self::model_minus_measured`], with the picture of the model in each frame of the segment.
    fn subtract_measured(
        &self,
        shot: &SegmentObservation,
        picture: impl Fn(usize) -> [f64; 2],
    ) -> DVector<f64> {
        let mut found =
            DVector::zeros(self.observation.count_data(shot.first, shot.first + shot.means.len()));
        self.add_to_column(shot, found.as_mut_slice(), |i, seen| {
            let shown = picture(i);
            [shown[0] - seen[0].unwrap_or(0.0), shown[1] - seen[1].unwrap_or(0.0)]
        });
        found
    }

    /// Adds values of tip and drop, given for every frame, to a column with one entry per measured value.
    fn add_to_column(
        &self,
        shot: &SegmentObservation,
        column: &mut [f64],
        of: impl Fn(usize, [Option<f64>; 2]) -> [f64; 2],
    ) {
        let (film, first) = (self.observation, shot.first);
        let tips = film.tip_x_m[first..first + shot.means.len()].iter().flatten().count();
        let (tip, drop) = column.split_at_mut(tips);
        let (mut tip, mut drop) = (tip.iter_mut(), drop.iter_mut());
        for i in 0..shot.means.len() {
            let seen = [film.tip_x_m[first + i], film.drop_m[first + i]];
            let values = of(i, seen);
            for (k, column) in [&mut tip, &mut drop].into_iter().enumerate() {
                if seen[k].is_some()
                    && let Some(entry) = column.next()
                {
                    *entry += values[k];
                }
            }
        }
    }

    /// Adds the derivative of the residuals along a direction of the run, multiplied by `slope`, to a column.
    /// `by_means` are the derivatives of the picture with respect to the means, frame by frame.
    fn add_run_derivative(
        &self,
        shot: &SegmentObservation,
        by_means: &[[[f64; 2]; 4]],
        direction: usize,
        slope: f64,
        column: &mut [f64],
    ) {
        self.add_to_column(shot, column, |i, _| {
            let of = |k: usize| slope * shot.slopes[(i * shot.channels + k) * shot.directions + direction];
            (0..shot.channels).fold([0.0; 2], |sum, k| {
                let [tip, drop] = by_means[i][k];
                [sum[0] + of(k) * tip, sum[1] + of(k) * drop]
            })
        });
    }
}

// Residuals of a fitted trace by channel.

/// Residuals of one channel in one segment.
#[derive(Debug, Clone, PartialEq)]
pub struct SegmentResiduals {
    /// Index of the recording.
    pub recording: usize,
    /// Index of the segment in the iterate.
    pub segment: usize,
    /// Whether the channel is the head's drop; otherwise it is the tip's position along the sweep.
    pub is_drop: bool,
    /// Frames with data, in rising order.
    pub frames: Vec<usize>,
    /// Model minus measurement in each of these frames, m.
    pub residual_m: Vec<f64>,
    /// Whitened residuals: in standard deviations of the noise, with the correlation of the noise between
    /// frames removed.
    pub whitened: Vec<f64>,
}

/// Residuals of every segment and channel with data. A segment whose run fails is omitted.
#[must_use]
pub fn segment_residuals(model: &TraceModel, at: &Iterate) -> Vec<SegmentResiduals> {
    let Some(points) = recording_models(model, &at.point) else { return Vec::new() };
    let mut found = Vec::new();
    for (number, segment) in at.segments.iter().enumerate() {
        let (point, range) = (&points[segment.recording], segment.frames());
        let Some(shot) = point.simulate_segment(range, &segment.start_state(), &point.none) else { continue };
        let all_m = point.model_minus_measured(&shot);
        let mut all = all_m.clone();
        point.observation.segment_whitening(range).whiten_column(all.as_mut_slice());
        let [tip, drop] = point.observation.data_frames(range);
        let split = tip.len();
        for (is_drop, frames, part) in [(false, tip, 0..split), (true, drop, split..all.len())] {
            if !frames.is_empty() {
                found.push(SegmentResiduals {
                    recording: segment.recording,
                    segment: number,
                    is_drop,
                    frames,
                    residual_m: all_m.as_slice()[part.clone()].to_vec(),
                    whitened: all.as_slice()[part].to_vec(),
                });
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::job::Job;
    use crate::fit::trace::{fit_states_at, start_point};
    use crate::fit::{MeasuredRecording, Problem};
    use crate::simulate::twin::{Camera, TrackingModel, add_tracking_noise, film_scene};

    const JOB: &str = "format = 1\ntitle = \"t\"\nscene = \"s.toml\"\nseed = 1\n[[recording]]\npath = \"r\"\n\
        [[parameter]]\nname = \"friction.a\"\nlower = 0.02\nupper = 0.5\nscale = \"log\"\n[[trace]]\n";

    /// Derivatives of the residuals against central differences, where the glass slopes and is curved and the
    /// zero of the picture is a metre away.
    #[test]
    fn residuals_are_differentiated_on_sloping_glass() {
        const CHANGE: f64 = 1e-4;
        let text = include_str!("../../../data/scenes/actual-blade.toml");
        let scene = Scene::parse("s.toml", text).unwrap();
        let camera = Camera { frame_rate_hz: 5_000.0, exposure_s: 5e-5 };
        let tracking =
            TrackingModel { metres_per_pixel: 2e-5, noise_px: 0.1, dropout_fraction: 0.0, seed: 7 };
        let effort = SolverOptions::from_scene(&scene);
        let seen = film_scene(&scene, &camera, 0.7, 0.8, effort).unwrap().recording;
        let mut traces = seen.traces().clone();
        for x in traces.tip_x_m.iter_mut().chain(&mut traces.head_x_m).flatten() {
            *x += 1.0;
        }
        let recording = add_tracking_noise(&seen.with_traces(traces).unwrap(), "r", &tracking).unwrap();
        let measured = MeasuredRecording { recording, exposure_s: Some(camera.exposure_s) };
        let problem =
            Problem::new(Job::parse("job.toml", JOB).unwrap(), vec![scene], vec![measured]).unwrap();
        let model = problem.trace_model().unwrap().unwrap();
        let mut point = start_point(&model, 1, 0);
        for (z, unknown) in point.iter_mut().zip(&model.unknowns.0) {
            if let UnknownKind::Camera { what, .. } = &unknown.kind {
                *z = match what {
                    CameraUnknown::Tilt => 5.0,
                    CameraUnknown::Curvature | CameraUnknown::HeadAbove => 3.0,
                    _ => *z,
                };
            }
        }
        let at = fit_states_at(&model, problem.segment_s(), &point).unwrap();
        let model_at = |z: &[f64]| RecordingModel::new(&model.recordings[0], 0, &model.unknowns, z).unwrap();
        let mut compared = 0;
        for segment in &at.segments {
            let (frames, state) = (segment.frames(), segment.start_state());
            let Some(linear) = model_at(&point).linearize(frames, &state) else { continue };
            for (i, unknown) in model.unknowns.0.iter().enumerate() {
                let [above, below] = [CHANGE, -CHANGE].map(|change| {
                    let mut moved = point.clone();
                    moved[i] += change;
                    model_at(&moved).whitened_residuals(frames, &state)
                });
                let (Some(above), Some(below)) = (above, below) else { continue };
                let found = (above - below) / (2.0 * CHANGE);
                let exact = linear.by_unknown.column(i);
                let off = (&found - exact).norm() / found.norm().max(1.0);
                // (a higher marker stretches the motion differently along the sweep; the derivative uses the
                // stretch at the mean position)
                let is_height =
                    matches!(unknown.kind, UnknownKind::Camera { what: CameraUnknown::HeadAbove, .. });
                let tolerance = if is_height { 0.1 } else { 0.005 };
                assert!(off < tolerance, "{:?}: {off:.5}", unknown.kind);
                compared += 1;
            }
        }
        assert!(compared > 20, "{compared}");
    }
}
