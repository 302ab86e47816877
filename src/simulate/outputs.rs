//! Observers of a run: samples, transitions, impacts, extremes and the energy balance.

use super::mode::TipMode;
use super::scene::contact::{ContactLossRule, JamRule};
use super::scene::{Drive, Scene, StartKind};
use super::{
    BladePoints, Impact, ModelSample, Observer, RunResult, SegmentPath, SolutionSegment, SolverOptions,
    Transition,
};
use crate::model::Linkage;
use crate::model::plausibility::PlausibilityFinding;
use crate::recording::FrameGrid;
use portable_math::gauss_legendre;
use serde::Serialize;
use std::fmt::Write;
use std::iter::Peekable;
use std::ops::ControlFlow;

/// Observer that passes the state of the model at given times to `sink`.
pub struct SampleObserver<I: Iterator<Item = f64>, F: FnMut(&ModelSample)> {
    times: Peekable<I>,
    sink: F,
}

impl<I: Iterator<Item = f64>, F: FnMut(&ModelSample)> SampleObserver<I, F> {
    /// Observer for `times`, s, in rising order.
    pub fn new(times: I, sink: F) -> Self {
        Self { times: times.peekable(), sink }
    }
}

impl<I: Iterator<Item = f64>, F: FnMut(&ModelSample)> Observer for SampleObserver<I, F> {
    fn observe_segment(&mut self, piece: &SolutionSegment<'_>) {
        while let Some(t) = self.times.next_if(|&t| t <= piece.end_s) {
            (self.sink)(&piece.sample_at(t.max(piece.start_s)));
        }
    }
}

/// Collects the transitions of a run.
#[derive(Debug, Clone, Default)]
pub struct Transitions(pub Vec<Transition>);

impl Observer for Transitions {
    fn observe_segment(&mut self, _: &SolutionSegment<'_>) {}
    fn observe_transition(&mut self, transition: &Transition) {
        self.0.push(*transition);
    }
}

/// Collects the impacts of a run.
#[derive(Debug, Clone, Default)]
pub(crate) struct Impacts(pub Vec<Impact>);

impl Observer for Impacts {
    fn observe_segment(&mut self, _: &SolutionSegment<'_>) {}
    fn observe_impact(&mut self, impact: &Impact) {
        self.0.push(*impact);
    }
}

/// Collects start and end of each interval of stick of a run, s.
#[derive(Debug, Clone, Default)]
pub struct StickIntervals(pub Vec<[f64; 2]>);

impl Observer for StickIntervals {
    fn observe_segment(&mut self, piece: &SolutionSegment<'_>) {
        if piece.mode != TipMode::Stick {
            return;
        }
        match self.0.last_mut() {
            Some(last) if last[1] == piece.start_s => last[1] = piece.end_s,
            _ => self.0.push([piece.start_s, piece.end_s]),
        }
    }
}

/// Largest angle of neck or lip from the vertical in a run.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LargestTilt {
    /// The largest angle at the ends of the pieces of the solution, rad. Between these ends, the angle is not
    /// sampled; a swing of a link has many pieces.
    pub largest_rad: f64,
    /// Time of the largest angle, s.
    pub at_s: f64,
}

impl Observer for LargestTilt {
    fn observe_segment(&mut self, piece: &SolutionSegment<'_>) {
        let pose = piece.pose_at(piece.end_s);
        let tilt = pose.theta.abs().max(pose.phi.abs());
        if tilt > self.largest_rad {
            *self = Self { largest_rad: tilt, at_s: piece.end_s };
        }
    }
}

/// Methods of an [`Observer`] that pass all events on to one or two observers.
macro_rules! forward_to_observers {
    ($self:ident: $first:expr $(, $other:expr)?) => {
        fn observe_segment(&mut $self, piece: &SolutionSegment<'_>) {
            $first.observe_segment(piece);
            $($other.observe_segment(piece);)?
        }
        fn observe_transition(&mut $self, transition: &Transition) {
            $first.observe_transition(transition);
            $($other.observe_transition(transition);)?
        }
        fn observe_impact(&mut $self, impact: &Impact) {
            $first.observe_impact(impact);
            $($other.observe_impact(impact);)?
        }
        fn control_flow(&$self) -> ControlFlow<()> {
            $first.control_flow()?;
            $($other.control_flow()?;)?
            ControlFlow::Continue(())
        }
    };
}
pub(super) use forward_to_observers;

/// A pair of observers; both receive the events of a run.
impl<A: Observer, B: Observer> Observer for (A, B) {
    forward_to_observers!(self: self.0, self.1);
}

/// A borrowed observer.
impl<A: Observer> Observer for &mut A {
    forward_to_observers!(self: (**self));
}

/// Extremes and energy balance of a run. The energy supplied by the drive should equal the change of the
/// stored energy plus the losses in damping, friction and impacts.
#[derive(Debug, Clone, Default)]
pub struct EnergyAudit {
    start_energy_j: Option<f64>,
    supplied_j: f64,
    exchanged_j: f64,
    largest_energy_j: f64,
    largest_residual_j: f64,
    /// Largest distance of the tip, during stick, from the position at which it is held, m.
    pub max_constraint_drift_m: f64,
    /// Smallest normal force on the tip while it is in contact, N.
    pub min_normal_force_n: Option<f64>,
    /// Smallest Painlevé indicator while the tip slips.
    pub min_painleve_indicator: Option<f64>,
}

impl EnergyAudit {
    /// Largest error of the energy balance, relative to the larger of the stored and the exchanged energy; 0
    /// if there is no energy.
    #[must_use]
    pub fn energy_residual_relative(&self) -> f64 {
        let scale = self.largest_energy_j.max(self.exchanged_j);
        if scale > 0.0 { self.largest_residual_j / scale } else { 0.0 }
    }

    fn update_extremes(&mut self, sample: &ModelSample) {
        let least = |old: Option<f64>, new: f64| Some(old.map_or(new, |o| o.min(new)));
        self.max_constraint_drift_m = self.max_constraint_drift_m.max(sample.constraint_drift_m.abs());
        if sample.mode == TipMode::Flight {
            return;
        }
        self.min_normal_force_n = least(self.min_normal_force_n, sample.normal_n);
        if sample.mode != TipMode::Stick {
            self.min_painleve_indicator = least(self.min_painleve_indicator, sample.indicator);
        }
    }
}

impl Observer for EnergyAudit {
    fn observe_segment(&mut self, piece: &SolutionSegment<'_>) {
        if self.start_energy_j.is_none() {
            let start = piece.sample_at(piece.start_s);
            self.update_extremes(&start);
            self.start_energy_j = Some(start.energy_j);
        }
        for (t, weight_s) in gauss_legendre::nodes_and_weights(piece.start_s, piece.end_s) {
            let sample = piece.sample_at(t);
            self.update_extremes(&sample);
            self.supplied_j += weight_s * sample.power_w;
            self.exchanged_j += weight_s * sample.power_w.abs();
        }
        let end = piece.sample_at(piece.end_s);
        self.update_extremes(&end);
        self.largest_energy_j = self.largest_energy_j.max(end.energy_j.abs());
        let residual = end.energy_j - self.start_energy_j.unwrap_or(end.energy_j) - self.supplied_j;
        self.largest_residual_j = self.largest_residual_j.max(residual.abs());
    }

    fn observe_impact(&mut self, impact: &Impact) {
        if self.start_energy_j.is_none() {
            return; // the balance begins with the first piece, after any impact at the start
        }
        self.supplied_j += impact.driven_j - impact.lost_j;
        self.exchanged_j += impact.driven_j.abs() + impact.lost_j.abs();
    }
}

#[derive(Debug, Clone, Serialize)]
#[allow(missing_docs)] // the fields are those of the file, named with their units
pub struct SimulationSummary {
    pub status: super::RunStatus,
    pub status_meaning: &'static str,
    pub stopped_at_s: f64,
    pub transitions: u64,
    pub rhs_evaluations: u64,
    pub guard_evaluations: u64,
    pub steps: u64,
    pub rejected_steps: u64,
    pub wall_s: f64,
    pub method: &'static str,
    /// Relative tolerance; `None` for fixed steps.
    pub relative_tolerance: Option<f64>,
    /// Length of a step, s; `None` for adaptive steps.
    pub step_s: Option<f64>,
    pub max_constraint_drift_m: f64,
    pub energy_residual_relative: f64,
    /// Largest predicted error of a transition time up to `undetermined_after_s`, s; left out if there is
    /// none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub predicted_time_error_s: Option<f64>,
    /// Time, s, after which the order of the transitions is not determined at this tolerance, or `null` if it
    /// is determined to the end; left out if no errors are predicted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub undetermined_after_s: Option<Option<f64>>,
    pub min_normal_force_n: Option<f64>,
    pub min_painleve_indicator: Option<f64>,
    pub model_parts: Vec<&'static str>,
    /// Findings on implausible numbers of the scene.
    pub findings: Vec<PlausibilityFinding>,
    /// Always true, because the numbers are simulated and not measured.
    pub synthetic: bool,
}

impl SimulationSummary {
    /// Summary of a run with its audit; `wall_s` is the duration of the run, s, with the prediction of its
    /// errors if there is one.
    #[must_use]
    pub fn new(
        scene: &Scene,
        run: &RunResult,
        audit: &EnergyAudit,
        wall_s: f64,
        effort: &SolverOptions,
    ) -> Self {
        Self {
            status: run.status,
            status_meaning: run.status.meaning(),
            stopped_at_s: run.stopped_at_s,
            transitions: run.transitions,
            rhs_evaluations: run.work.rhs_evaluations,
            guard_evaluations: run.work.guard_evaluations,
            steps: run.work.steps,
            rejected_steps: run.work.rejected_steps,
            wall_s,
            method: effort.method.name(),
            relative_tolerance: effort.method.step_s().is_none().then_some(effort.relative_tolerance),
            step_s: effort.method.step_s(),
            max_constraint_drift_m: audit.max_constraint_drift_m,
            energy_residual_relative: audit.energy_residual_relative(),
            predicted_time_error_s: None,
            undetermined_after_s: None,
            min_normal_force_n: audit.min_normal_force_n,
            min_painleve_indicator: audit.min_painleve_indicator,
            model_parts: model_parts(scene),
            findings: scene.find_implausible(),
            synthetic: true,
        }
    }
}

/// Names of the parts of the model that the scene uses.
pub(crate) fn model_parts(scene: &Scene) -> Vec<&'static str> {
    let Linkage { head, neck, lip, friction, shoulder, .. } = &scene.linkage;
    let is_slider = scene.linkage.is_slider();
    let parts = [
        (is_slider, "slider"),
        (true, "stick"),
        (true, "slip"),
        (scene.loss == ContactLossRule::Fly, "flight"),
        (scene.loss == ContactLossRule::Fly || scene.jam == JamRule::Impact, "impacts"),
        (friction.a > 0.0 && friction.b_s_per_m > 0.0, "velocity-dependent friction"),
        (shoulder.is_some(), "shoulder"),
        (shoulder.is_some_and(|s| s.damping_n_m_s_per_rad > 0.0), "shoulder damping"),
        (head.damping > 0.0, "head damping"),
        (neck.damping > 0.0, "neck damping"),
        (lip.damping > 0.0 && !is_slider, "lip damping"),
        (lip.damping > 0.0 && is_slider, "slider damping"),
        (matches!(scene.drive, Drive::Cosine { .. }), "cosine drive"),
        (matches!(scene.drive, Drive::Uniform { .. }), "constant speed"),
        (matches!(scene.drive, Drive::Recorded(_)), "recorded drive"),
        (scene.start == StartKind::SteadySlide, "steady-slide start"),
    ];
    parts.into_iter().filter(|(active, _)| *active).map(|(_, name)| name).collect()
}

/// Header of `state.csv` of a slider.
const SLIDER_HEADER: &str = "time_s,deflection_m,tip_velocity_m_per_s,normal_force_n,friction_force_n,mode";
const BLADE_HEADER: &str = "time_s,neck_angle_rad,lip_angle_rad,neck_rate_rad_per_s,lip_rate_rad_per_s,head_drop_m,tip_velocity_m_per_s,normal_force_n,friction_force_n,mode";
pub(crate) const EVENTS_HEADER: &str = "time_s,from,to,cause";

/// Header of `state.csv` of a scene.
pub(crate) fn state_header(scene: &Scene) -> &'static str {
    if scene.linkage.is_slider() { SLIDER_HEADER } else { BLADE_HEADER }
}

/// Times of the sampled outputs of a scene, s.
pub fn sample_times(scene: &Scene) -> impl Iterator<Item = f64> + use<> {
    let (start_s, stop_s, rate) = (scene.start_s, scene.run.stop_s, scene.run.sample_rate_hz);
    let frames = ((stop_s - start_s) * rate * (1.0 + 1e-12)).floor() as usize + 1;
    let grid = FrameGrid { start_s, frame_rate_hz: rate, frames };
    (0..frames).map(move |i| grid.time_s(i).min(stop_s))
}

/// Coordinates of a sample as in a recording, m: tip x, tip y, head x, head y.
///
/// The origin is the position of the head of the upright blade; the glass is at `y = -(l1 + l2)`. Both `y`
/// of a slider are zero.
#[must_use]
pub fn recorded_points_m(linkage: &Linkage, sample: &ModelSample) -> [f64; 4] {
    if linkage.is_slider() {
        return [sample.tip_x_m, 0.0, sample.head_x_m, 0.0];
    }
    let glass_y_m = -linkage.upright_height_m();
    [sample.tip_x_m, glass_y_m + sample.tip_height_m, sample.head_x_m, -sample.head_drop_m]
}

/// Appends a sample as a row of `state.csv`.
pub fn push_state_row(text: &mut String, linkage: &Linkage, sample: &ModelSample) {
    let ModelSample { time_s, pose, head_drop_m, tip_velocity_m_per_s, normal_n, friction_n, mode, .. } =
        sample;
    let _ = if linkage.is_slider() {
        write!(text, "{time_s},{:e}", sample.tip_x_m - sample.head_x_m)
    } else {
        let [theta, phi, dt, dp] = [pose.theta, pose.phi, pose.theta_rate, pose.phi_rate];
        write!(text, "{time_s},{theta:e},{phi:e},{dt:e},{dp:e},{head_drop_m:e}")
    };
    let mode = mode.name();
    let _ = writeln!(text, ",{tip_velocity_m_per_s:e},{normal_n:e},{friction_n:e},{mode}");
}

/// Appends a transition as a row of `events.csv`; the time has 17 significant digits.
pub fn push_event_row(text: &mut String, Transition { time_s, from, to, cause }: &Transition) {
    let [from, to] = [from, to].map(|mode| mode.name());
    let _ = write!(text, "{time_s:.16e},{from},{to},{}", cause.name()); // writing to a String cannot fail
}

/// Averages the positions of head and tip over the intervals in which a shutter is open, and passes the means
/// to `sink`. For an interval of zero length, the mean is the position at that time.
pub(crate) struct ShutterObserver<I: Iterator<Item = [f64; 2]>, F: FnMut(&BladePoints)> {
    intervals: Peekable<I>,
    sink: F,
    sum: [f64; 4],
    open_s: f64,
}

impl<I: Iterator<Item = [f64; 2]>, F: FnMut(&BladePoints)> ShutterObserver<I, F> {
    /// `intervals` are the times at which the shutter opens and closes, s, in rising order and without
    /// overlap. An interval that is still open at the end of the run produces no mean.
    pub(crate) fn new(intervals: I, sink: F) -> Self {
        Self { intervals: intervals.peekable(), sink, sum: [0.0; 4], open_s: 0.0 }
    }

    /// Adds the integral of the positions between two times within a piece of the solution.
    fn add_exposure(&mut self, path: &SegmentPath<'_>, from_s: f64, to_s: f64) {
        if to_s > from_s {
            let integral = path.integrate_points(from_s, to_s).to_array();
            self.sum.iter_mut().zip(integral).for_each(|(sum, part)| *sum += part);
            self.open_s += to_s - from_s;
        }
    }

    /// Mean over the interval that closes at `close_s`; resets the sums for the next interval.
    fn take_mean(&mut self, path: &SegmentPath<'_>, close_s: f64) -> BladePoints {
        let (sum, open_s) = (std::mem::take(&mut self.sum), std::mem::take(&mut self.open_s));
        if open_s > 0.0 {
            BladePoints::from_array(sum.map(|sum| sum / open_s))
        } else {
            path.points_at(close_s)
        }
    }
}

impl<I: Iterator<Item = [f64; 2]>, F: FnMut(&BladePoints)> Observer for ShutterObserver<I, F> {
    fn observe_segment(&mut self, piece: &SolutionSegment<'_>) {
        let mut path = None;
        while let Some(&[opens_s, closes_s]) = self.intervals.peek() {
            if opens_s > piece.end_s {
                return;
            }
            let path = path.get_or_insert_with(|| piece.path());
            self.add_exposure(path, opens_s.max(piece.start_s), closes_s.min(piece.end_s));
            if closes_s > piece.end_s {
                return;
            }
            let mean = self.take_mean(path, closes_s.max(piece.start_s));
            (self.sink)(&mean);
            self.intervals.next();
        }
    }
}
