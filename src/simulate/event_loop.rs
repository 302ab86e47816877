//! The event loop of a run: integrate a phase, locate its end, decide the next phase.

mod flight_events;

use super::equilibrium::shoulder_contact;
use super::fixed_step_scheme::{FixedStepScheme, StabilisedStickPhase};
use super::flight::LANDING;
pub(super) use super::impact::TipStrike;
use super::mode::{RestDecision, TipMode, decide_mode_at_rest, holding_force};
use super::phases::{
    DrivenBlade, GUARDS, JAMS, LAW_PIECE_ENDS, LEVEL_GUARDS, SHOULDER_GUARDS, SLIP_CONTACT_LOST,
    STICK_CONTACT_LOST, SlipPhase, StickPhase, TIP_STOPS, TaylorMotion, mode_after_release, pose_from_states,
};
use super::scene::{Drive, Scene, StartKind};
use super::solution_segment::{SegmentSolution, SolutionSegment};
use super::{Impact, IntegrationMethod, Observer, RunResult, RunStatus, SolverOptions, Transition};
use super::{TransitionCause, initial_pose};
use crate::model::flight::FlightState;
use crate::model::modes::time_scales_rad_per_s;
use crate::model::shoulder::ShoulderContact;
use crate::model::{FrictionResponse, Pose};
use hybrid_ode::taylor::{TaylorPhase, TaylorWorkspace};
use hybrid_ode::{
    self, AcceptedStep, EventLocator, PhaseEnd, PhaseEndCause as Ended, PhaseStart, WorkCounters,
};
use hybrid_ode::{fixed_step, taylor};
use std::ops::ControlFlow;

/// A run, with its settings and its state between phases.
pub(super) struct EventLoop<'a> {
    system: &'a DrivenBlade,
    scene: &'a Scene,
    effort: SolverOptions,
    /// A trait object, because a type parameter would compile the loop and the integrator again for every
    /// observer and make no run faster.
    watch: &'a mut dyn RunWatcher,
    t: f64,
    work: WorkCounters,
    transitions: u64,
    lean: ShoulderContact,
    /// Piece of the friction law in the present or next phase of slip.
    law_piece: usize,
    /// First trial step, s, of the next phase of stick, of slip and of flight.
    steps: [Option<f64>; 3],
    recent: ChatterDetector,
    /// Shortest natural period of the links, without preload and damping, s.
    shortest_period_s: f64,
    /// Number of consecutive short rebounds up to now.
    short_rebounds: u32,
    /// Workspaces for the series of stick, slip and flight.
    rooms: (
        TaylorWorkspace<TaylorMotion, 2, GUARDS>,
        TaylorWorkspace<TaylorMotion, 4, GUARDS>,
        TaylorWorkspace<TaylorMotion, 6, GUARDS>,
    ),
}

/// The next phase, or the end of the run.
enum NextPhase {
    /// A phase of contact: its mode, its first pose, and the order of the zero that each guard has at the
    /// start of the phase (0 for a guard that is not zero).
    Phase(TipMode, Pose, [u8; GUARDS]),
    /// Flight: its first state, and the order of the zero that each guard has at the start of flight (0 for a
    /// guard that is not zero).
    Flight(FlightState, [u8; GUARDS]),
    /// The end of the run.
    End(RunStatus),
}

/// A transition that is recorded once the next mode is known: the mode before, and the cause if the forces do
/// not decide it.
type PendingTransition = Option<(TipMode, Option<TransitionCause>)>;

impl<'a> EventLoop<'a> {
    pub(super) fn new(
        system: &'a DrivenBlade,
        scene: &'a Scene,
        effort: SolverOptions,
        watch: &'a mut dyn RunWatcher,
    ) -> Self {
        let (_, fastest) = time_scales_rad_per_s(&system.linkage);
        let shortest_period_s = std::f64::consts::TAU / fastest;
        let most_rhs_evaluations = Some(effort.most_evaluations);
        Self {
            system,
            scene,
            effort,
            watch,
            t: scene.start_s,
            work: WorkCounters { most_rhs_evaluations, ..WorkCounters::default() },
            transitions: 0,
            lean: ShoulderContact::Off,
            law_piece: 0,
            steps: [None; 3],
            recent: ChatterDetector::new(shortest_period_s),
            shortest_period_s,
            short_rebounds: 0,
            rooms: Default::default(),
        }
    }

    /// Runs the scene from its start to its end.
    pub(super) fn run(&mut self) -> RunResult {
        let Some(pose) = initial_pose(self.scene) else { return self.finish_run(RunStatus::Diverged) };
        self.lean = shoulder_contact(&self.system.linkage, pose.theta);
        let mut next = self.first_phase(&pose);
        loop {
            next = match next {
                NextPhase::End(status) => return self.finish_run(status),
                _ if self.work.is_spent() => NextPhase::End(RunStatus::WorkLimit),
                _ if self.recent.is_chattering(self.t) => NextPhase::End(RunStatus::Chattering),
                NextPhase::Flight(state, zero_order) => self.integrate_flight(&state, zero_order),
                NextPhase::Phase(TipMode::Stick, pose, zero_order) => self.integrate_stick(&pose, zero_order),
                NextPhase::Phase(mode, pose, zero_order) => self.integrate_slip(mode, &pose, zero_order),
            };
        }
    }

    /// Status of a run whose step became too small.
    fn failure_status(&self) -> RunStatus {
        if self.work.is_spent() { RunStatus::WorkLimit } else { RunStatus::Diverged }
    }

    fn finish_run(&self, status: RunStatus) -> RunResult {
        RunResult { status, stopped_at_s: self.t, transitions: self.transitions, work: self.work }
    }

    /// The first phase: its mode follows from the tip's velocity, or from the forces if the tip is at rest.
    fn first_phase(&mut self, pose: &Pose) -> NextPhase {
        if let StartKind::Airborne(state) = self.scene.start {
            let mut zero_order = [0; GUARDS];
            zero_order[LANDING] = if state.gap_m > 0.0 { 0 } else { self.gap_order(&state) };
            return NextPhase::Flight(state, zero_order);
        }
        let at = self.system.contact_instant(self.t, pose, self.lean);
        if at.directions.cos_theta <= 0.0 || at.directions.cos_phi <= 0.0 {
            return NextPhase::End(RunStatus::Diverged);
        }
        let velocity = self.system.linkage.tip_velocity_m_per_s(pose, &at.directions, &at.head);
        if velocity == 0.0 {
            return self.decide_at_rest(pose, None);
        }
        self.decide_in_motion(pose, velocity, None)
    }

    /// Decides the next mode of a tip that moves along the glass.
    fn decide_in_motion(&mut self, pose: &Pose, velocity: f64, before: PendingTransition) -> NextPhase {
        let at = self.system.contact_instant(self.t, pose, self.lean);
        let mode = TipMode::slip_towards(velocity);
        self.law_piece = self.system.linkage.friction.piece_at(velocity.abs());
        let (_, forces) = self.slip_phase(mode).slip_forces(pose, &at);
        if forces.indicator > 0.0 && forces.normal_n <= 0.0 {
            return self.lose_contact(pose, before);
        }
        if let Some((from, Some(cause))) = before {
            self.record_transition(from, mode, cause);
        }
        if forces.indicator <= 0.0 {
            self.resolve_jam(pose, mode)
        } else {
            NextPhase::Phase(mode, *pose, [0; GUARDS])
        }
    }

    /// Decides the next mode of a tip at rest.
    fn decide_at_rest(&mut self, pose: &Pose, before: PendingTransition) -> NextPhase {
        let at = self.system.contact_instant(self.t, pose, self.lean);
        let law = &self.system.linkage.friction;
        match decide_mode_at_rest(&at.contact, law) {
            RestDecision::Becomes(TipMode::Flight) => self.lose_contact(pose, before),
            RestDecision::Indeterminate => NextPhase::End(RunStatus::Indeterminate),
            RestDecision::Jammed => NextPhase::End(RunStatus::Jammed),
            RestDecision::Becomes(mode) => {
                if let Some((from, given)) = before.filter(|&(from, given)| from != mode || given.is_some()) {
                    self.record_transition(from, mode, given.unwrap_or_else(|| cause_of_change(from, mode)));
                }
                let mut zero_order = [0; GUARDS];
                if mode != TipMode::Stick {
                    self.law_piece = law.piece_at(0.0);
                    zero_order[TIP_STOPS] = release_order(&at.contact, law.limit_at_zero(mode.direction()));
                }
                NextPhase::Phase(mode, *pose, zero_order)
            }
        }
    }

    /// Applies an impulse to the tip that makes its velocity zero, so that the next mode is decided for a tip
    /// exactly at rest. After event location, the velocity is a rounding error, or is within the tolerance if
    /// the tip nearly stops.
    fn remove_tip_velocity(&self, mut pose: Pose) -> Pose {
        if matches!(self.effort.method, IntegrationMethod::FixedStep(scheme) if scheme.gain_per_s > 0.0) {
            return pose; // the stabilisation removes the velocity
        }
        let at = self.system.contact_instant(self.t, &pose, self.lean);
        let impulse =
            -self.system.linkage.tip_velocity_m_per_s(&pose, &at.directions, &at.head) / at.contact.kappa;
        pose.theta_rate += impulse * at.contact.per_force[0];
        pose.phi_rate += impulse * at.contact.per_force[1];
        pose
    }

    fn record_transition(&mut self, from: TipMode, to: TipMode, cause: TransitionCause) {
        self.transitions += 1;
        self.watch.watch_transition(&Transition { time_s: self.t, from, to, cause });
    }

    fn integrate_stick(&mut self, pose: &Pose, zero_order: [u8; GUARDS]) -> NextPhase {
        if let IntegrationMethod::FixedStep(scheme) = self.effort.method {
            return self.hold_tip(&scheme, pose, zero_order);
        }
        let phase = StickPhase::from_pose(self.system, self.t, pose, self.lean);
        let start = PhaseStart { t: self.t, y: phase.free_states(pose), zero_order, step: self.steps[0] };
        let most_s = self.longest_stick_step_s();
        let (watch, drive, stop) = (&mut *self.watch, &self.system.drive, self.scene.run.stop_s);
        let end = integrate_phase(
            &phase,
            start,
            |t| drive.horizon(t, stop).min(t + most_s),
            &self.effort,
            &mut self.rooms.0,
            &mut self.work,
            |step, motion| {
                let solution = SegmentSolution::Stick(&phase, step);
                watch.watch_segment(&SolutionSegment::from_step(step, TipMode::Stick, motion, solution));
                watch.control_flow()
            },
        );
        (self.t, self.steps[0]) = (end.t, Some(end.first_step));
        let (pose, _) = phase.full_pose(&self.system.drive.motion_at(end.t), &end.y);
        if let Ended::Guard(guard) = end.cause {
            self.watch.watch_guard(guard, &self.rooms.0.tape);
        }
        self.decide_after_stick(end.cause, pose)
    }

    /// Longest step of stick, s. While a slider sticks, the integrated states stay zero, so error control
    /// does not limit the step. Without this limit, a method without series would check the guards too
    /// rarely.
    fn longest_stick_step_s(&self) -> f64 {
        /// Fraction of the shorter of the periods of slider and drive.
        const SHARE: f64 = 0.02;
        if self.effort.method == IntegrationMethod::Taylor || !self.system.linkage.is_slider() {
            return f64::INFINITY;
        }
        let drive_s = match self.system.drive {
            Drive::Cosine { frequency_hz, .. } => 1.0 / frequency_hz,
            _ => f64::INFINITY,
        };
        SHARE * drive_s.min(self.shortest_period_s)
    }

    /// Integrates stick by the fixed-step scheme.
    fn hold_tip(&mut self, scheme: &FixedStepScheme, pose: &Pose, zero_order: [u8; GUARDS]) -> NextPhase {
        let phase = StabilisedStickPhase::from_pose(self.system, self.t, pose, self.lean, scheme.gain_per_s);
        let y = [pose.theta, pose.phi, pose.theta_rate, pose.phi_rate];
        let start = PhaseStart { t: self.t, y, zero_order, step: None };
        let (watch, stop) = (&mut *self.watch, self.scene.run.stop_s);
        let end = fixed_step::integrate_fixed(
            &phase,
            start,
            stop,
            &scheme.integrator_options(),
            &mut self.work,
            |step| {
                let solution = SegmentSolution::Held(&phase, step);
                watch.watch_segment(&SolutionSegment::from_step(step, TipMode::Stick, None, solution));
                watch.control_flow()
            },
        );
        self.t = end.t;
        self.decide_after_stick(end.cause, pose_from_states(&end.y))
    }

    fn decide_after_stick(&mut self, ended: Ended, pose: Pose) -> NextPhase {
        match ended {
            Ended::Stop => NextPhase::End(RunStatus::Completed),
            Ended::Interrupted => NextPhase::End(RunStatus::Interrupted),
            Ended::StepTooSmall => NextPhase::End(self.failure_status()),
            Ended::Guard(STICK_CONTACT_LOST) => self.lose_contact(&pose, Some((TipMode::Stick, None))),
            Ended::Guard(guard) if LEVEL_GUARDS.contains(&guard) => NextPhase::End(RunStatus::Diverged),
            Ended::Guard(guard) => match mode_after_release(guard) {
                Some(mode) => self.release_tip(mode, pose),
                None => self.decide_at_corner(guard, &pose),
            },
        }
    }

    /// Decides the next phase when the holding force reaches the static friction limit in stick. If slip
    /// follows, the tip's velocity has a double zero at the start of slip. If friction falls because the
    /// static limit is above that of slip, the zero is simple, and the normal force jumps. If it vanishes,
    /// the tip loses contact.
    fn release_tip(&mut self, mode: TipMode, pose: Pose) -> NextPhase {
        let at = self.system.contact_instant(self.t, &pose, self.lean);
        let law = &self.system.linkage.friction;
        self.law_piece = law.piece_at(0.0);
        let (_, forces) = self.slip_phase(mode).slip_forces(&pose, &at);
        let falls = law.static_ratio > 1.0;
        if forces.indicator <= 0.0 {
            return self.resolve_jam(&pose, TipMode::Stick);
        }
        if falls && forces.normal_n <= 0.0 {
            return self.lose_contact(&pose, Some((TipMode::Stick, None)));
        }
        self.recent.note_event(self.t);
        self.record_transition(TipMode::Stick, mode, TransitionCause::FrictionLimit);
        let mut zero_order = [0; GUARDS];
        zero_order[TIP_STOPS] = if falls { 1 } else { 2 };
        NextPhase::Phase(mode, pose, zero_order)
    }

    /// Decides the next mode when the neck meets or leaves the shoulder: the damping of the shoulder makes
    /// the holding force jump.
    fn decide_at_corner(&mut self, guard: usize, pose: &Pose) -> NextPhase {
        let corner = self.cross_corner(guard);
        let mut next = self.decide_at_rest(pose, Some((TipMode::Stick, None)));
        if let NextPhase::Phase(_, _, zero_order) | NextPhase::Flight(_, zero_order) = &mut next {
            zero_order[corner] = 1;
        }
        next
    }

    fn integrate_slip(&mut self, mode: TipMode, pose: &Pose, zero_order: [u8; GUARDS]) -> NextPhase {
        let phase = self.slip_phase(mode);
        let y = [pose.theta, pose.phi, pose.theta_rate, pose.phi_rate];
        let started = self.t;
        let start = PhaseStart { t: started, y, zero_order, step: self.steps[1] };
        let (watch, drive, stop) = (&mut *self.watch, &self.system.drive, self.scene.run.stop_s);
        let end = integrate_phase(
            &phase,
            start,
            |t| drive.horizon(t, stop),
            &self.effort,
            &mut self.rooms.1,
            &mut self.work,
            |step, motion| {
                let solution = SegmentSolution::Slip(&phase, step);
                watch.watch_segment(&SolutionSegment::from_step(step, mode, motion, solution));
                watch.control_flow()
            },
        );
        (self.t, self.steps[1]) = (end.t, Some(end.first_step));
        let pose = pose_from_states(&end.y);
        if let Ended::Guard(guard) = end.cause {
            self.watch.watch_guard(guard, &self.rooms.1.tape);
        }
        match end.cause {
            Ended::Stop => NextPhase::End(RunStatus::Completed),
            Ended::Interrupted => NextPhase::End(RunStatus::Interrupted),
            Ended::StepTooSmall if self.work.is_spent() => NextPhase::End(RunStatus::WorkLimit),
            Ended::StepTooSmall | Ended::Guard(SLIP_CONTACT_LOST) if self.is_at_pole(&phase, &pose) => {
                self.resolve_jam(&pose, mode)
            }
            Ended::StepTooSmall => NextPhase::End(RunStatus::Diverged),
            Ended::Guard(JAMS) if self.is_at_pole(&phase, &pose) => self.resolve_jam(&pose, mode),
            // the Painlevé indicator is not near zero in this pose, so slip continues from this pose; the
            // indicator seemed negative because the step went past the instant at which the tip stops: there,
            // friction is evaluated at negative speed, at which a steeply falling law grows without bound
            Ended::Guard(JAMS) => {
                self.recent.note_event(self.t);
                self.shorten_slip_step();
                NextPhase::Phase(mode, pose, [0; GUARDS])
            }
            Ended::Guard(SLIP_CONTACT_LOST) => self.lose_contact(&pose, Some((mode, None))),
            Ended::Guard(guard) if LEVEL_GUARDS.contains(&guard) => NextPhase::End(RunStatus::Diverged),
            Ended::Guard(guard) if self.enter_law_piece(guard) => {
                let mut next_order = [0; GUARDS];
                next_order[LAW_PIECE_ENDS + TIP_STOPS - guard] = 1;
                NextPhase::Phase(mode, pose, next_order)
            }
            Ended::Guard(TIP_STOPS) => {
                self.recent.note_event(self.t);
                let next = self.decide_at_rest(&self.remove_tip_velocity(pose), Some((mode, None)));
                if matches!(next, NextPhase::Phase(same, ..) if same == mode) {
                    // the tip has not stopped: the first step was too long to resolve the start of slip
                    self.shorten_slip_step();
                }
                next
            }
            Ended::Guard(guard) => {
                let corner = self.cross_corner(guard);
                // at the instant of a release, the tip's velocity is still zero
                let mut next_order = if end.t == started { zero_order } else { [0; GUARDS] };
                next_order[corner] = 1;
                NextPhase::Phase(mode, pose, next_order)
            }
        }
    }

    fn slip_phase(&self, mode: TipMode) -> SlipPhase<'a> {
        SlipPhase { system: self.system, direction: mode.direction(), lean: self.lean, piece: self.law_piece }
    }

    /// Enters the piece of the friction law above or below the present one, if the guard is that of an end of
    /// the piece and the tip does not stop there. Returns whether it is.
    fn enter_law_piece(&mut self, guard: usize) -> bool {
        let [from, _] = self.system.linkage.friction.piece_ends_m_per_s(self.law_piece);
        match guard {
            LAW_PIECE_ENDS => self.law_piece += 1,
            TIP_STOPS if from > 0.0 => self.law_piece -= 1,
            _ => return false,
        }
        true
    }

    fn shorten_slip_step(&mut self) {
        /// Factor by which the first step of the next slip phase is multiplied to shorten it.
        const SHORTER: f64 = 0.1;
        self.steps[1] = self.steps[1].map(|step| SHORTER * step);
    }

    /// Whether the tip is about to jam. Near the Painlevé paradox, the indicator vanishes as the square root
    /// of the remaining time, and the normal force grows without bound. No step resolves the last instant; a
    /// step that passes this instant because of rounding yields a negative normal force.
    fn is_at_pole(&self, phase: &SlipPhase<'_>, pose: &Pose) -> bool {
        /// Empirical limit of the Painlevé indicator, below which the tip is about to jam. In runs of 300
        /// random blades with heavy heads, the indicator was at most 5e-6 in size in the runs that ended at
        /// the paradox, and at least 0.5 in all others.
        const VANISHED: f64 = 1e-4;
        let (_, forces) = phase.slip_forces(pose, &self.system.contact_instant(self.t, pose, self.lean));
        forces.indicator < VANISHED
    }

    /// Records that the neck has met or left the shoulder; returns the index of the guard of the corner that
    /// the neck passed.
    fn cross_corner(&mut self, guard: usize) -> usize {
        self.recent.note_event(self.t);
        let [forward, backward] = SHOULDER_GUARDS;
        self.lean = match (self.lean, guard) {
            (ShoulderContact::Off, g) if g == forward => ShoulderContact::Forward,
            (ShoulderContact::Off, _) => ShoulderContact::Backward,
            (ShoulderContact::Forward | ShoulderContact::Backward, _) => ShoulderContact::Off,
        };
        if guard == backward { backward } else { forward }
    }
}

/// Order of the zero of the tip's velocity when slip starts from rest: 1 if the holding force exceeds the
/// limit of slip, 2 if both are equal up to rounding, as at the end of stick without a larger static limit.
fn release_order(contact: &FrictionResponse, mu: f64) -> u8 {
    /// The holding force counts as equal to the limit if its relative excess over the limit is below
    /// this value, which is far above rounding errors and far below the resolution of a step.
    const EQUAL: f64 = 1e-11;
    let force = holding_force(contact);
    let limit = mu * (contact.n_free + contact.nu * force);
    if force.abs() > limit * (1.0 + EQUAL) { 1 } else { 2 }
}

/// Cause of the transition of a tip at rest. This function sees a transition out of stick only if the neck
/// meets or leaves the shoulder.
fn cause_of_change(from: TipMode, to: TipMode) -> TransitionCause {
    match (from, to) {
        (_, TipMode::Stick) => TransitionCause::TipStops,
        (TipMode::Stick, _) => TransitionCause::ShoulderCorner,
        _ => TransitionCause::DirectReversal,
    }
}

/// Observer of the steps of a reference method. It is a trait object, because a type parameter would compile
/// these methods again for every observer.
type StepObserver<'a, const N: usize> = &'a mut dyn FnMut(&AcceptedStep<'_, N>) -> ControlFlow<()>;

/// Integrates a phase by the method of the run, with a restart at every horizon.
///
/// `horizon(t)` is the latest time up to which the integration from `t` may run; the phase stops where
/// `horizon(t)` is not later than `t`.
pub(super) fn integrate_phase<const N: usize, P: TaylorPhase<N, GUARDS>>(
    phase: &P,
    mut start: PhaseStart<N, GUARDS>,
    horizon: impl Fn(f64) -> f64,
    effort: &SolverOptions,
    room: &mut TaylorWorkspace<P::Tape, N, GUARDS>,
    work: &mut WorkCounters,
    mut observe: impl FnMut(&AcceptedStep<'_, N>, Option<&P::Tape>) -> ControlFlow<()>,
) -> PhaseEnd<N> {
    let relative = effort.relative_tolerance;
    let mut first_step = None;
    loop {
        let until = horizon(start.t);
        let end = match effort.method {
            IntegrationMethod::Taylor => {
                let observe = |step: &AcceptedStep<'_, N>, tape: &P::Tape| observe(step, Some(tape));
                taylor::integrate_taylor(phase, start, until, relative, room, work, observe)
            }
            IntegrationMethod::RungeKutta | IntegrationMethod::Slack => {
                let locator = match effort.method {
                    IntegrationMethod::Slack => EventLocator::Slack,
                    _ => EventLocator::Bracket,
                };
                let observe: StepObserver<'_, N> = &mut |step| observe(step, None);
                hybrid_ode::integrate_with_locator(locator, phase, start, until, relative, work, observe)
            }
            IntegrationMethod::FixedStep(scheme) => {
                let observe: StepObserver<'_, N> = &mut |step| observe(step, None);
                fixed_step::integrate_fixed(phase, start, until, &scheme.integrator_options(), work, observe)
            }
        };
        let first_step = *first_step.get_or_insert(end.first_step);
        if end.cause != Ended::Stop || horizon(end.t) <= end.t {
            return PhaseEnd { first_step, ..end };
        }
        start = PhaseStart { t: end.t, y: end.y, zero_order: [0; GUARDS], step: Some(end.first_step) };
    }
}

/// Detects events that accumulate at one instant.
pub(super) struct ChatterDetector {
    times: [f64; Self::WINDOW],
    next: usize,
    shortest_s: f64,
}

impl ChatterDetector {
    /// Number of the latest events that are considered.
    const WINDOW: usize = 64;
    /// The latest [`Self::WINDOW`] events count as chattering if all of them occur within this fraction of
    /// the blade's shortest period. One real stick-slip cycle lasts about a period.
    const SHARE: f64 = 1e-6;

    pub(super) fn new(period_s: f64) -> Self {
        Self { times: [f64::NEG_INFINITY; Self::WINDOW], next: 0, shortest_s: Self::SHARE * period_s }
    }

    pub(super) fn note_event(&mut self, t: f64) {
        self.times[self.next] = t;
        self.next = (self.next + 1) % Self::WINDOW;
    }

    pub(super) fn is_chattering(&self, t: f64) -> bool {
        t - self.times[self.next] < self.shortest_s
    }
}

/// Receives the events of a run, for an observer or for the propagation of derivatives.
pub(in crate::simulate) trait RunWatcher {
    /// Receives a piece of the solution, in order of time.
    fn watch_segment(&mut self, piece: &SolutionSegment<'_>);
    /// Receives the guard that has fallen to zero at the end of the last piece, and the series of that piece.
    fn watch_guard(&mut self, _guard: usize, _motion: &TaylorMotion) {}
    /// Receives a strike of the tip on the glass at the end of the last piece.
    fn watch_strike(&mut self, _strike: &TipStrike) {}
    /// Receives a change of the mode of contact, between the two pieces that it separates.
    fn watch_transition(&mut self, transition: &Transition);
    /// Receives an impact, before the transition that it causes.
    fn watch_impact(&mut self, impact: &Impact);
    /// `Break` ends the run.
    fn control_flow(&self) -> ControlFlow<()>;
}

/// Passes the events of a run on to an observer.
pub(in crate::simulate) struct ObserverWatcher<'a, O>(pub &'a mut O);

impl<O: Observer> RunWatcher for ObserverWatcher<'_, O> {
    fn watch_segment(&mut self, piece: &SolutionSegment<'_>) {
        self.0.observe_segment(piece);
    }
    fn watch_transition(&mut self, transition: &Transition) {
        self.0.observe_transition(transition);
    }
    fn watch_impact(&mut self, impact: &Impact) {
        self.0.observe_impact(impact);
    }
    fn control_flow(&self) -> ControlFlow<()> {
        self.0.control_flow()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A full window of events within a millionth of the shortest period is chattering; one event per period
    /// is not.
    #[test]
    fn events_that_accumulate_differ_from_cycles() {
        let period_s = 2e-3;
        let mut recent = ChatterDetector::new(period_s);
        for cycle in 0..1000 {
            let t = f64::from(cycle) * period_s;
            assert!(!recent.is_chattering(t), "cycle {cycle}");
            recent.note_event(t);
        }
        let t = 1000.0 * period_s;
        for event in 0..ChatterDetector::WINDOW {
            assert!(!recent.is_chattering(t), "event {event}");
            recent.note_event(t + event as f64 * 1e-12);
        }
        assert!(recent.is_chattering(t + 1e-10));
    }
}
