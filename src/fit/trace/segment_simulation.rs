//! One run of the model over a segment as the camera sees it, with its derivatives.

use super::camera_observation::CameraObservation;
use super::checkpoint::{Iterate, TraceSearchSettings};
use super::initial_states::{RescuePolicy, fit_states, join_states};
use super::levenberg_marquardt::{MAX_STATE_STEPS, first_iterate};
use super::model::TraceModel;
use super::normal_equations::{recording_models, segments_cost};
use super::unknowns::{CameraParameters, CameraUnknown, TraceUnknowns, UnknownKind};
use crate::model::Pose;
use crate::simulate::scene::{Scene, StartKind};
use crate::simulate::sensitivity::{
    Channel, TangentDirection, TangentObserver, TangentRunner, TangentSeeds, TangentSegment,
};
use crate::simulate::{RunStatus, SolverOptions};
use nalgebra::{DMatrix, DVector, Vector4};
use std::cell::RefCell;
use std::collections::BTreeMap;

/// Angles and rates of neck and lip.
pub(super) type LinkState = Vector4<f64>;

/// Changes of angles, rad, and rates, rad/s, that are small against what a segment may do.
pub(super) const STATE_STEPS: [f64; 4] = [3e-5, 3e-5, 0.1, 0.1];
/// Numbers of a starting state.
const STATES: usize = 4;
/// Tolerance of a segment's runs: their errors stay a thousandth of a pixel's noise.
const TOLERANCE: f64 = 1e-8;
/// Accuracy of their derivatives: a step of the search needs no more.
const ACCURACY: f64 = 1e-5;
/// Right-hand sides after which a segment's run is given up.
const MOST_EVALUATIONS: u64 = 400_000;
/// What is added up of every frame: tip, head and drop.
const CHANNELS: [Channel; 3] = [Channel::TipX, Channel::HeadX, Channel::HeadDrop];

thread_local! {
    /// The room in which this thread's runs are expanded.
    static RUNNER: RefCell<TangentRunner> = RefCell::new(TangentRunner::with_accuracy(ACCURACY));
}

pub(super) fn state_to_pose(s: &LinkState) -> Pose {
    Pose { theta: s[0], phi: s[1], theta_rate: s[2], phi_rate: s[3] }
}

pub(super) fn pose_to_state(pose: &Pose) -> LinkState {
    LinkState::new(pose.theta, pose.phi, pose.theta_rate, pose.phi_rate)
}

/// What the camera sees of a run: means of tip, head and drop over the shutter, m, a row a frame, and their
/// derivatives by every direction.
struct SegmentObservation {
    means: Vec<[f64; 3]>,
    /// One row a frame of [tip, head, drop] by direction.
    slopes: Vec<f64>,
    end: LinkState,
    /// Whether there are derivatives to its end.
    is_known: bool,
}

/// Adds up what the shutter sees.
struct ShutterAverage<'a> {
    times_s: &'a [f64],
    clock_s: f64,
    half_s: f64,
    stop_s: f64,
    directions: usize,
    frame: usize,
    means: Vec<[f64; 3]>,
    slopes: Vec<f64>,
    row: Vec<f64>,
    end: Option<Pose>,
    is_known: bool,
}

impl TangentObserver for ShutterAverage<'_> {
    fn observe_segment(&mut self, piece: &TangentSegment<'_>) {
        self.is_known &= piece.is_known;
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
            for (k, channel) in CHANNELS.into_iter().enumerate() {
                self.means[self.frame][k] += share * piece.channel_value(channel, &weights);
                if self.directions > 0 {
                    piece.channel_derivatives(channel, &weights, &mut self.row);
                    let at = (self.frame * CHANNELS.len() + k) * self.directions;
                    for (sum, slope) in self.slopes[at..].iter_mut().zip(&self.row) {
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
            self.end = Some(piece.sample_at(piece.end_s).pose);
        }
    }
}

/// Residuals with their derivatives by the starting state and by the unknowns.
pub(super) struct LinearizedSegment {
    pub residuals: DVector<f64>,
    pub by_state: DMatrix<f64>,
    pub by_unknown: DMatrix<f64>,
}

/// The model of a recording at one point of the search.
pub(super) struct RecordingModel<'a> {
    pub observation: &'a CameraObservation,
    pub camera: CameraParameters,
    pub scene: Scene,
    none: TangentSeeds,
    states: TangentSeeds,
    all: TangentSeeds,
    /// How each unknown enters.
    effects: Vec<UnknownEffect>,
}

/// How an unknown enters the residuals of a recording.
enum UnknownEffect {
    /// Not at all: it is another recording's.
    Nowhere,
    /// By the run: number of its direction, and derivative of that by the coordinate.
    Run(usize, f64),
    /// By the picture, and for the scale by the run too: direction and its derivative by the value.
    Picture(CameraUnknown, f64, Option<(usize, f64)>),
}

impl<'a> RecordingModel<'a> {
    pub(crate) fn new(
        base: &Scene,
        film: &'a CameraObservation,
        number: usize,
        unknowns: &TraceUnknowns,
        z: &[f64],
    ) -> Option<Self> {
        let scene = unknowns.scene_at(base, film.own_head, number, z)?;
        let view = unknowns.camera_at(number, z);
        let mut directions = vec![
            TangentDirection::NeckAngle,
            TangentDirection::LipAngle,
            TangentDirection::NeckRate,
            TangentDirection::LipRate,
        ];
        let states = TangentSeeds::new(&scene, &directions).ok()?;
        let mut enters = Vec::new();
        for (unknown, z) in unknowns.0.iter().zip(z) {
            let mut direction = |direction: TangentDirection| {
                directions.push(direction);
                directions.len() - 1
            };
            let slope = unknown.slope(*z);
            enters.push(match &unknown.kind {
                UnknownKind::Parameter { name, .. } => {
                    UnknownEffect::Run(direction(TangentDirection::Parameter(name.clone())), slope)
                }
                UnknownKind::Camera { film, .. } if *film != number => UnknownEffect::Nowhere,
                UnknownKind::Camera { what: CameraUnknown::Clock, .. } => {
                    UnknownEffect::Run(direction(TangentDirection::DriveDelay), slope)
                }
                // the picture's lengths drive the model: its own are smaller by the scale
                UnknownKind::Camera { what: CameraUnknown::Scale, .. } if film.own_head => {
                    let by_scale = -1.0 / (1.0 + view.scale);
                    let own = Some((direction(TangentDirection::DriveScale), by_scale));
                    UnknownEffect::Picture(CameraUnknown::Scale, slope, own)
                }
                UnknownKind::Camera { what, .. } => UnknownEffect::Picture(*what, slope, None),
            });
        }
        let (none, all) =
            (TangentSeeds::new(&scene, &[]).ok()?, TangentSeeds::new(&scene, &directions).ok()?);
        Some(Self { observation: film, camera: view, scene, none, states, all, effects: enters })
    }

    /// The state at the end of frames `first` to before `last`: where the next segment starts. `None` where
    /// the run ends early.
    pub(crate) fn end_state(&self, frames: [usize; 2], state: &LinkState) -> Option<LinkState> {
        Some(self.simulate_segment(frames, state, &self.none)?.end)
    }

    fn simulate_segment(
        &self,
        [first, last]: [usize; 2],
        state: &LinkState,
        seeds: &TangentSeeds,
    ) -> Option<SegmentObservation> {
        let (film, clock_s) = (self.observation, self.camera.clock_s);
        let (lead, count) = (film.lead_s(), last - first);
        let mut scene = self.scene.clone();
        scene.start_s = film.times_s[first] - clock_s - lead;
        scene.start = StartKind::State(state_to_pose(state));
        scene.run.stop_s = match film.times_s.get(last) {
            Some(next) => next - clock_s - lead,
            // (a little longer than the last shutter)
            None => film.times_s[last - 1] - clock_s + lead + 1e-9,
        };
        let mut eye = ShutterAverage {
            times_s: &film.times_s[first..last],
            clock_s,
            half_s: lead,
            stop_s: scene.run.stop_s,
            directions: seeds.len(),
            frame: 0,
            means: vec![[0.0; 3]; count],
            slopes: vec![0.0; count * CHANNELS.len() * seeds.len()],
            row: vec![0.0; seeds.len()],
            end: None,
            is_known: true,
        };
        let effort = SolverOptions { most_evaluations: MOST_EVALUATIONS, ..SolverOptions::new(TOLERANCE) };
        let run = RUNNER.with_borrow_mut(|runner| runner.run_scene(&scene, effort, seeds, &mut eye));
        let whole = run.status == RunStatus::Completed && eye.frame == count;
        (whole && (eye.is_known || seeds.is_empty())).then_some(())?;
        let is_known = eye.is_known;
        Some(SegmentObservation {
            means: eye.means,
            slopes: eye.slopes,
            end: pose_to_state(&eye.end?),
            is_known,
        })
    }

    /// Residuals of unit variance: the tip's frames, then the drop's.
    pub(crate) fn whitened_residuals(&self, frames: [usize; 2], state: &LinkState) -> Option<DVector<f64>> {
        let mut residuals = self.residuals_m(frames, state)?;
        self.observation.segment_whitening(frames[0], frames[1]).whiten_column(residuals.as_mut_slice());
        Some(residuals).filter(|r| r.iter().all(|x| x.is_finite()))
    }

    /// The same where the run has derivatives; `None` where [`Self::residuals_by_state`] has none.
    pub(crate) fn differentiable_residuals(
        &self,
        frames: [usize; 2],
        state: &LinkState,
    ) -> Option<DVector<f64>> {
        let shot = self.simulate_segment(frames, state, &self.none).filter(|shot| shot.is_known)?;
        let mut residuals = self.model_minus_measured(frames[0], &shot);
        self.observation.segment_whitening(frames[0], frames[1]).whiten_column(residuals.as_mut_slice());
        Some(residuals).filter(|r| r.iter().all(|x| x.is_finite()))
    }

    /// Model minus measured, m: the tip's frames, then the drop's.
    pub(crate) fn residuals_m(&self, frames: [usize; 2], state: &LinkState) -> Option<DVector<f64>> {
        Some(self.model_minus_measured(frames[0], &self.simulate_segment(frames, state, &self.none)?))
    }

    /// Residuals with their derivatives by the starting state.
    pub(crate) fn residuals_by_state(
        &self,
        frames: [usize; 2],
        state: &LinkState,
    ) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let shot = self.simulate_segment(frames, state, &self.states)?;
        let mut columns = DMatrix::zeros(self.observation.count_data(frames[0], frames[1]), STATES);
        (0..STATES).for_each(|i| self.add_run_derivative(frames[0], &shot, STATES, i, 1.0, &mut columns, i));
        let mut residuals = self.model_minus_measured(frames[0], &shot);
        self.whiten_columns(frames, &mut residuals, [&mut columns]);
        let finite = residuals.iter().chain(&columns).all(|x| x.is_finite());
        finite.then_some((residuals, columns))
    }

    /// Residuals with all derivatives.
    pub(crate) fn linearize(&self, frames: [usize; 2], state: &LinkState) -> Option<LinearizedSegment> {
        let shot = self.simulate_segment(frames, state, &self.all)?;
        let (rows, directions) = (self.observation.count_data(frames[0], frames[1]), self.all.len());
        let mut by_state = DMatrix::zeros(rows, STATES);
        (0..STATES)
            .for_each(|i| self.add_run_derivative(frames[0], &shot, directions, i, 1.0, &mut by_state, i));
        let mut by_unknown = DMatrix::zeros(rows, self.effects.len());
        for (column, enters) in self.effects.iter().enumerate() {
            match enters {
                UnknownEffect::Nowhere => {}
                UnknownEffect::Run(i, slope) => {
                    self.add_run_derivative(
                        frames[0],
                        &shot,
                        directions,
                        *i,
                        *slope,
                        &mut by_unknown,
                        column,
                    );
                }
                UnknownEffect::Picture(what, slope, run) => {
                    if let Some((i, by_value)) = run {
                        let slope = slope * by_value;
                        self.add_run_derivative(
                            frames[0],
                            &shot,
                            directions,
                            *i,
                            slope,
                            &mut by_unknown,
                            column,
                        );
                    }
                    self.add_picture_derivative(frames[0], &shot, *what, *slope, &mut by_unknown, column);
                }
            }
        }
        let mut residuals = self.model_minus_measured(frames[0], &shot);
        self.whiten_columns(frames, &mut residuals, [&mut by_state, &mut by_unknown]);
        let finite = residuals.iter().chain(&by_state).chain(&by_unknown).all(|x| x.is_finite());
        finite.then_some(LinearizedSegment { residuals, by_state, by_unknown })
    }

    fn whiten_columns<const N: usize>(
        &self,
        [first, last]: [usize; 2],
        residuals: &mut DVector<f64>,
        jacobians: [&mut DMatrix<f64>; N],
    ) {
        let whitening = self.observation.segment_whitening(first, last);
        whitening.whiten_column(residuals.as_mut_slice());
        for jacobian in jacobians {
            let rows = jacobian.nrows().max(1);
            jacobian.as_mut_slice().chunks_mut(rows).for_each(|column| whitening.whiten_column(column));
        }
    }

    /// What the picture shows of a frame, tip and drop, from means of tip, head and drop.
    fn project_to_picture(&self, frame: usize, [tip, head, drop]: [f64; 3]) -> [f64; 2] {
        let (film, view) = (self.observation, &self.camera);
        let scale = 1.0 + view.scale;
        let shown = if film.own_head { film.head_m[frame] } else { scale * head };
        let along = film.head_m[frame] - film.centre_m;
        let [offset_x_m, offset_drop_m] = view.offsets_m(film.after_middle_s(frame));
        [
            shown + scale * (tip - head - view.tilt_rad * drop) + offset_x_m,
            scale * drop - view.tilt_rad * along + offset_drop_m,
        ]
    }

    fn model_minus_measured(&self, first: usize, shot: &SegmentObservation) -> DVector<f64> {
        let mut found = DVector::zeros(self.observation.count_data(first, first + shot.means.len()));
        self.fill_column(first, shot.means.len(), found.as_mut_slice(), |i, seen| {
            let shown = self.project_to_picture(first + i, shot.means[i]);
            [shown[0] - seen[0].unwrap_or(0.0), shown[1] - seen[1].unwrap_or(0.0)]
        });
        found
    }

    /// Fills a column, an entry a datum, from values in metres.
    fn fill_column(
        &self,
        first: usize,
        count: usize,
        column: &mut [f64],
        of: impl Fn(usize, [Option<f64>; 2]) -> [f64; 2],
    ) {
        let film = self.observation;
        let tips = film.tip_x_m[first..first + count].iter().flatten().count();
        let (tip, drop) = column.split_at_mut(tips);
        let (mut tip, mut drop) = (tip.iter_mut(), drop.iter_mut());
        for i in 0..count {
            let seen = [film.tip_x_m[first + i], film.drop_m[first + i]];
            let values = of(i, seen);
            for (k, column) in [&mut tip, &mut drop].into_iter().enumerate() {
                if seen[k].is_some()
                    && let Some(entry) = column.next()
                {
                    *entry = values[k];
                }
            }
        }
    }

    /// Adds the derivative by a direction of the run, times `slope`, to a column.
    #[allow(clippy::too_many_arguments)] // one private place
    fn add_run_derivative(
        &self,
        first: usize,
        shot: &SegmentObservation,
        directions: usize,
        direction: usize,
        slope: f64,
        columns: &mut DMatrix<f64>,
        column: usize,
    ) {
        let (film, view) = (self.observation, &self.camera);
        let scale = 1.0 + view.scale;
        let mut own = vec![0.0; columns.nrows()];
        self.fill_column(first, shot.means.len(), &mut own, |i, _| {
            let of = |k: usize| shot.slopes[(i * CHANNELS.len() + k) * directions + direction];
            let [tip, head, drop] = [of(0), of(1), of(2)];
            let shown = if film.own_head { 0.0 } else { scale * head };
            [slope * (shown + scale * (tip - head - view.tilt_rad * drop)), slope * scale * drop]
        });
        columns.column_mut(column).iter_mut().zip(&own).for_each(|(sum, own)| *sum += own);
    }

    /// Adds the derivative by something of the picture, times `slope`, to a column.
    fn add_picture_derivative(
        &self,
        first: usize,
        shot: &SegmentObservation,
        what: CameraUnknown,
        slope: f64,
        columns: &mut DMatrix<f64>,
        column: usize,
    ) {
        let (film, view) = (self.observation, &self.camera);
        let scale = 1.0 + view.scale;
        let mut own = vec![0.0; columns.nrows()];
        self.fill_column(first, shot.means.len(), &mut own, |i, _| {
            let [tip, head, drop] = shot.means[i];
            let shown = if film.own_head { 0.0 } else { head };
            let by_value = match what {
                CameraUnknown::OffsetX => [1.0, 0.0],
                CameraUnknown::OffsetDrop => [0.0, 1.0],
                CameraUnknown::DriftX => [film.after_middle_s(first + i), 0.0],
                CameraUnknown::DriftDrop => [0.0, film.after_middle_s(first + i)],
                CameraUnknown::Scale => [shown + tip - head - view.tilt_rad * drop, drop],
                CameraUnknown::Tilt => [-scale * drop, film.centre_m - film.head_m[first + i]],
                CameraUnknown::Clock => [0.0; 2],
            };
            by_value.map(|by_value| slope * by_value)
        });
        columns.column_mut(column).iter_mut().zip(&own).for_each(|(sum, own)| *sum += own);
    }
}

// How well traces fit at one point, with the starting states of the segments fitted and nothing else.

/// The segments of the last stage at a point, their states where they fit best; `None` where a scene refuses
/// the point. A function of the point alone.
pub(crate) fn fit_states_at(model: &TraceModel, segment_s: &[f64], point: &[f64]) -> Option<Iterate> {
    let last = TraceSearchSettings { segment_s: segment_s.last().copied().into_iter().collect(), twins: 0 };
    let mut at = first_iterate(model, &last, point)?;
    let points = recording_models(model, point)?;
    fit_states(&points, &mut at.segments, MAX_STATE_STEPS, RescuePolicy::Thorough);
    join_states(&points, &mut at.segments, MAX_STATE_STEPS);
    at.plain = true;
    at.cost = segments_cost(&at.segments, true) + model.unknowns.prior_cost(point);
    Some(at)
}

/// Whitened residuals of every frame that is fitted, recording by recording, tip before head; `None` where
/// the model has none.
pub(crate) fn frame_residuals(model: &TraceModel, at: Option<&Iterate>) -> Vec<Option<f64>> {
    let mut known = BTreeMap::new();
    for segment in at.map(|at| segment_residuals(model, at)).unwrap_or_default() {
        let place = |frame: &usize| (segment.recording, segment.is_drop, *frame);
        known.extend(segment.frames.iter().map(place).zip(segment.whitened.iter().copied()));
    }
    let films = model.recordings.iter().enumerate().flat_map(|(film, shoot)| {
        let [first, last] = shoot.observation.settings.frames;
        let [tip, drop] = shoot.observation.data_frames(first, last);
        let of = move |is_drop: bool| move |frame: usize| (film, is_drop, frame);
        tip.into_iter().map(of(false)).chain(drop.into_iter().map(of(true)))
    });
    films.map(|place| known.get(&place).copied()).collect()
}

// Residuals of a fitted trace, channel by channel.

/// Residuals of one channel over one segment.
#[derive(Debug, Clone, PartialEq)]
pub struct SegmentResiduals {
    /// Number of the recording.
    pub recording: usize,
    /// Number of the segment in the iterate.
    pub segment: usize,
    /// Whether it is the head's drop, and not the tip's place along the sweep.
    pub is_drop: bool,
    /// Frames with data, rising.
    pub frames: Vec<usize>,
    /// Model minus measured, m.
    pub residual_m: Vec<f64>,
    /// The same in standard deviations of the noise, without the correlation of the noise.
    pub whitened: Vec<f64>,
}

/// Residuals of every segment and channel with data at an iterate; those of a segment whose run fails are
/// left out.
#[must_use]
pub fn segment_residuals(model: &TraceModel, at: &Iterate) -> Vec<SegmentResiduals> {
    let Some(points) = recording_models(model, &at.point) else { return Vec::new() };
    let mut found = Vec::new();
    for (number, segment) in at.segments.iter().enumerate() {
        let film = &model.recordings[segment.recording].observation;
        let (point, range) = (&points[segment.recording], [segment.first, segment.last]);
        let Some(all_m) = point.residuals_m(range, &segment.start_state()) else { continue };
        let mut all = all_m.clone();
        film.segment_whitening(segment.first, segment.last).whiten_column(all.as_mut_slice());
        let [tip, drop] = film.data_frames(segment.first, segment.last);
        let split = tip.len();
        for (is_drop, frames, part) in [(false, tip, 0..split), (true, drop, split..all.len())] {
            if !frames.is_empty() {
                let (residual_m, whitened) =
                    (all_m.as_slice()[part.clone()].to_vec(), all.as_slice()[part].to_vec());
                let (film, segment) = (segment.recording, number);
                found.push(SegmentResiduals {
                    recording: film,
                    segment,
                    is_drop,
                    frames,
                    residual_m,
                    whitened,
                });
            }
        }
    }
    found
}
