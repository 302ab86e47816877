//! The stick-slip model run event by event: step, locate, decide, accept.
//!
//! Each mode of contact is a smooth phase ([`phases`]) integrated until one of its guards falls to zero; the decision what follows is a
//! pure function of the forces ([`mode`]). Observers see every accepted piece of the solution, so nothing is stored and what is not asked
//! for is not computed.

pub mod equilibrium;
pub mod mode;
pub mod outputs;
pub mod phases;
pub mod scene;

use crate::blade::modes::time_scales_rad_per_s;
use crate::blade::shoulder::Lean;
use crate::blade::{Directions, Pose};
use crate::ode::{self, Cause, Start, Work};
use mode::{AtRest, Mode, at_rest};
use phases::{GUARDS, JAMS, LEVEL_GUARDS, SHOULDER_GUARDS, SLIP_CONTACT_LOST, STICK_CONTACT_LOST, Slip, Stick, System, TIP_STOPS, pose_of, released};
use scene::{Scene, StartKind};
use serde::Serialize;

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// The stop time was reached.
    Completed,
    /// The normal force reached zero.
    ContactLost,
    /// The Painlevé condition failed: no admissible normal force exists.
    Jammed,
    /// More than one mode was consistent with the forces.
    Indeterminate,
    /// Transitions accumulated in no time.
    Chattering,
    /// The state left what the model describes, or no step met the tolerance.
    Diverged,
}

impl Status {
    /// The name used in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Completed => "completed",
            Self::ContactLost => "contact-lost",
            Self::Jammed => "jammed",
            Self::Indeterminate => "indeterminate",
            Self::Chattering => "chattering",
            Self::Diverged => "diverged",
        }
    }

    /// What it means, in a sentence.
    #[must_use]
    pub fn meaning(self) -> &'static str {
        match self {
            Self::Completed => "the stop time was reached",
            Self::ContactLost => "the normal force reached zero: the tip lifts off the glass",
            Self::Jammed => "the Painlevé condition failed: no normal force is admissible and the tip jams",
            Self::Indeterminate => "more than one mode of contact is consistent with the forces",
            Self::Chattering => "transitions accumulate in no time",
            Self::Diverged => "a link swung past level, a number left the finite range, or no step met the tolerance",
        }
    }
}

/// One change of mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transition {
    /// When, s.
    pub time_s: f64,
    /// Mode before.
    pub from: Mode,
    /// Mode after.
    pub to: Mode,
    /// Why: `tip-stops`, `friction-limit`, `direct-reversal` or `shoulder-corner`.
    pub cause: &'static str,
}

/// A piece of the solution in one mode, as observers see it.
pub struct Piece<'a> {
    /// Start of the piece, s.
    pub start_s: f64,
    /// End of the piece, s.
    pub end_s: f64,
    /// Mode of contact.
    pub mode: Mode,
    source: Source<'a>,
}

enum Source<'a> {
    Slip(&'a Slip<'a>, &'a ode::Step<'a, 4>),
    Stick(&'a Stick<'a>, &'a ode::Step<'a, 2>),
}

/// The model at one instant.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    /// Time, s.
    pub time_s: f64,
    /// Mode of contact.
    pub mode: Mode,
    /// Angles and rates.
    pub pose: Pose,
    /// Position of the head along the sweep, `v`, m.
    pub head_x_m: f64,
    /// Drop of the head, `u`, m.
    pub head_drop_m: f64,
    /// Position of the tip along the sweep, `v3`, m.
    pub tip_x_m: f64,
    /// Velocity of the tip, m/s; exactly zero in stick.
    pub tip_velocity_m_per_s: f64,
    /// Normal force, N.
    pub normal_n: f64,
    /// Friction force, N.
    pub friction_n: f64,
    /// Painlevé indicator of slip, 1 in stick.
    pub indicator: f64,
    /// How far the tip is from where stick holds it, m; zero in slip.
    pub constraint_drift_m: f64,
    /// Energy of the blade, J.
    pub energy_j: f64,
    /// Power that flows into it, W.
    pub power_w: f64,
}

impl Piece<'_> {
    /// The model at a time within the piece.
    #[must_use]
    pub fn sample(&self, t: f64) -> Sample {
        match &self.source {
            Source::Slip(slip, step) => {
                let y = if t == step.end { *step.y_end } else { step.dense.at(t) };
                let pose = pose_of(&y);
                let at = slip.system.instant(t, &pose, slip.lean);
                let (speed, forces) = slip.forces(&pose, &at);
                self.assemble(t, slip.system, slip.lean, pose, &at, &forces, slip.direction * speed, 0.0)
            }
            Source::Stick(stick, step) => {
                let y = if t == step.end { *step.y_end } else { step.dense.at(t) };
                let (pose, at) = stick.instant(t, &y);
                let forces = stick.forces(&at);
                let drift = stick.system.linkage.tip_position_m(&Directions::of(&pose), &at.head) - stick.place_m;
                self.assemble(t, stick.system, stick.lean, pose, &at, &forces, 0.0, drift)
            }
        }
    }

    #[allow(clippy::too_many_arguments)] // one private place gathers what both modes computed
    fn assemble(
        &self,
        t: f64,
        system: &System,
        lean: Lean,
        pose: Pose,
        at: &phases::Instant,
        forces: &phases::Forces,
        tip_velocity_m_per_s: f64,
        drift: f64,
    ) -> Sample {
        let (linkage, d) = (&system.linkage, &at.directions);
        Sample {
            time_s: t,
            mode: self.mode,
            pose,
            head_x_m: at.head.position_m,
            head_drop_m: linkage.head_drop_m(d),
            tip_x_m: linkage.tip_position_m(d, &at.head),
            tip_velocity_m_per_s,
            normal_n: forces.normal_n,
            friction_n: forces.friction_n,
            indicator: forces.indicator,
            constraint_drift_m: drift,
            energy_j: linkage.energy_j(&pose, d, &at.head),
            power_w: linkage.power_w(&pose, d, &at.head, lean, forces.friction_n, forces.accelerations),
        }
    }
}

/// Sees the solution as it is accepted.
pub trait Observer {
    /// A piece of the solution, in order of time.
    fn piece(&mut self, piece: &Piece<'_>);
    /// A change of mode, between the pieces it separates.
    fn transition(&mut self, _transition: &Transition) {}
}

/// Observes nothing.
impl Observer for () {
    fn piece(&mut self, _: &Piece<'_>) {}
}

/// How exact a run is and how much work it may cost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// Tolerated relative error of a step.
    pub relative_tolerance: f64,
    /// Right-hand sides after which the run gives up as diverged.
    pub most_evaluations: u64,
}

impl Effort {
    /// A tolerance with a bound on work that no ordinary scene reaches (minutes of computing).
    #[must_use]
    pub fn new(relative_tolerance: f64) -> Self {
        Self { relative_tolerance, most_evaluations: 10_000_000_000 }
    }
}

/// How a run went.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Run {
    /// How it ended.
    pub status: Status,
    /// When, s.
    pub stopped_at_s: f64,
    /// Number of changes of mode.
    pub transitions: u64,
    /// What it cost.
    pub work: Work,
}

/// Runs a scene from its start to its stop time at the scene's own tolerance.
pub fn run(scene: &Scene, observer: &mut impl Observer) -> Run {
    run_with(scene, Effort::new(scene.run.relative_tolerance), observer)
}

/// Runs a scene with another effort than its own.
pub fn run_with(scene: &Scene, effort: Effort, observer: &mut impl Observer) -> Run {
    let system = system(scene);
    let mut machine = Machine::new(&system, scene.start_s, effort, observer);
    match initial_pose(scene) {
        Some(pose) => machine.run(&pose, scene.run.stop_s),
        None => machine.ended(Status::Diverged),
    }
}

/// The system of a scene, with the magnitudes below which errors count as absolute.
#[must_use]
pub fn system(scene: &Scene) -> System {
    /// A tenth of a radian: angles of a wiper blade in use are 0.1 to 1 rad.
    const ANGLE_SCALE: f64 = 0.1;
    let (slowest, _) = time_scales_rad_per_s(&scene.linkage);
    System { linkage: scene.linkage, drive: scene.drive, angle_scale: ANGLE_SCALE, rate_scale: ANGLE_SCALE * slowest }
}

fn initial_pose(scene: &Scene) -> Option<Pose> {
    match scene.start {
        StartKind::Upright => Some(Pose { theta: 0.0, phi: 0.0, theta_rate: 0.0, phi_rate: 0.0 }),
        StartKind::State(pose) => Some(pose),
        StartKind::SteadySlide => equilibrium::steady_slide(&scene.linkage, scene.drive.at(scene.start_s).velocity_m_per_s),
    }
}

/// The state between phases.
struct Machine<'a, O> {
    system: &'a System,
    effort: Effort,
    observer: &'a mut O,
    t: f64,
    work: Work,
    transitions: u64,
    lean: Lean,
    /// First steps that suited the last stick and the last slip phase.
    steps: [Option<f64>; 2],
    recent: Recent,
}

/// What follows a phase.
enum Next {
    /// Another phase in this mode, with the guards that start at zero.
    Phase(Mode, Pose, [u8; GUARDS]),
    /// The end of the run.
    End(Status),
}

impl<'a, O: Observer> Machine<'a, O> {
    fn new(system: &'a System, t: f64, effort: Effort, observer: &'a mut O) -> Self {
        let (_, fastest) = time_scales_rad_per_s(&system.linkage);
        let recent = Recent::new(std::f64::consts::TAU / fastest);
        Self { system, effort, observer, t, work: Work::default(), transitions: 0, lean: Lean::Off, steps: [None; 2], recent }
    }

    fn run(&mut self, pose: &Pose, stop: f64) -> Run {
        self.lean = self.system.linkage.shoulder.map_or(Lean::Off, |s| s.lean(pose.theta));
        let mut next = self.begin(pose);
        loop {
            next = match next {
                Next::End(status) => return self.ended(status),
                Next::Phase(..) if self.work.rhs_evaluations > self.effort.most_evaluations => Next::End(Status::Diverged),
                Next::Phase(..) if self.recent.is_chattering(self.t) => Next::End(Status::Chattering),
                Next::Phase(Mode::Stick, pose, zero_order) => self.stick(&pose, zero_order, stop),
                Next::Phase(mode, pose, zero_order) => self.slip(mode, &pose, zero_order, stop),
            };
        }
    }

    fn ended(&self, status: Status) -> Run {
        Run { status, stopped_at_s: self.t, transitions: self.transitions, work: self.work }
    }

    /// The first mode: by the tip's velocity, or by the forces when it is at rest.
    fn begin(&mut self, pose: &Pose) -> Next {
        let at = self.system.instant(self.t, pose, self.lean);
        if at.directions.cos_theta <= 0.0 || at.directions.cos_phi <= 0.0 {
            return Next::End(Status::Diverged);
        }
        let velocity = self.system.linkage.tip_velocity_m_per_s(pose, &at.directions, &at.head);
        if velocity == 0.0 {
            return self.decide_at_rest(pose, None);
        }
        let mode = Mode::slip(velocity);
        let (_, forces) = Slip { system: self.system, direction: mode.direction(), lean: self.lean }.forces(pose, &at);
        match () {
            () if forces.indicator <= 0.0 => Next::End(Status::Jammed),
            () if forces.normal_n <= 0.0 => Next::End(Status::ContactLost),
            () => Next::Phase(mode, *pose, [0; GUARDS]),
        }
    }

    /// Decides what follows with the tip at rest; `from` is the mode that just ended.
    fn decide_at_rest(&mut self, pose: &Pose, from: Option<Mode>) -> Next {
        let at = self.system.instant(self.t, pose, self.lean);
        match at_rest(&at.contact, self.system.linkage.friction.at_rest()) {
            AtRest::Becomes(Mode::Flight) => Next::End(Status::ContactLost),
            AtRest::Indeterminate => Next::End(Status::Indeterminate),
            AtRest::Jammed => Next::End(Status::Jammed),
            AtRest::Becomes(mode) => {
                if let Some(from) = from.filter(|&from| from != mode) {
                    self.change(from, mode, cause(from, mode));
                }
                let mut zero_order = [0; GUARDS];
                zero_order[TIP_STOPS] = u8::from(mode != Mode::Stick);
                Next::Phase(mode, *pose, zero_order)
            }
        }
    }

    /// Takes what event location leaves of the tip's velocity (rounding, or the tolerance where the tip only grazes rest) out of the
    /// rates, by the impulse on the tip that does so: the state that is decided on is exactly at rest.
    fn at_standstill(&self, mut pose: Pose) -> Pose {
        let at = self.system.instant(self.t, &pose, self.lean);
        let impulse = -self.system.linkage.tip_velocity_m_per_s(&pose, &at.directions, &at.head) / at.contact.kappa;
        pose.theta_rate += impulse * at.contact.per_force[0];
        pose.phi_rate += impulse * at.contact.per_force[1];
        pose
    }

    fn change(&mut self, from: Mode, to: Mode, cause: &'static str) {
        self.transitions += 1;
        self.observer.transition(&Transition { time_s: self.t, from, to, cause });
    }

    fn stick(&mut self, pose: &Pose, zero_order: [u8; GUARDS], stop: f64) -> Next {
        let phase = Stick::hold(self.system, self.t, pose, self.lean);
        let start = Start { t: self.t, y: phase.states(pose), zero_order, step: self.steps[0] };
        let observer = &mut *self.observer;
        let end = ode::integrate(&phase, start, stop, self.effort.relative_tolerance, &mut self.work, |step| {
            observer.piece(&Piece { start_s: step.start, end_s: step.end, mode: Mode::Stick, source: Source::Stick(&phase, step) });
        });
        (self.t, self.steps[0]) = (end.t, Some(end.first_step));
        let (pose, _) = phase.pose(&self.system.drive.at(end.t), &end.y);
        match end.cause {
            Cause::Stop => Next::End(Status::Completed),
            Cause::StepTooSmall => Next::End(Status::Diverged),
            Cause::Guard(STICK_CONTACT_LOST) => Next::End(Status::ContactLost),
            Cause::Guard(guard) if LEVEL_GUARDS.contains(&guard) => Next::End(Status::Diverged),
            Cause::Guard(guard) => match released(guard) {
                Some(mode) => self.release(mode, pose),
                None => self.corner_in_stick(guard, &pose),
            },
        }
    }

    /// Leaves stick at the static limit: the tip's velocity starts at a double zero.
    fn release(&mut self, mode: Mode, pose: Pose) -> Next {
        let at = self.system.instant(self.t, &pose, self.lean);
        let (_, forces) = Slip { system: self.system, direction: mode.direction(), lean: self.lean }.forces(&pose, &at);
        if forces.indicator <= 0.0 {
            return Next::End(Status::Jammed);
        }
        self.recent.note(self.t);
        self.change(Mode::Stick, mode, "friction-limit");
        let mut zero_order = [0; GUARDS];
        zero_order[TIP_STOPS] = 2;
        Next::Phase(mode, pose, zero_order)
    }

    /// The shoulder's damping makes the holding force jump at its corner, so stick is decided anew there.
    fn corner_in_stick(&mut self, guard: usize, pose: &Pose) -> Next {
        let corner = self.cross_corner(guard);
        match self.decide_at_rest(pose, Some(Mode::Stick)) {
            Next::Phase(mode, pose, mut zero_order) => {
                zero_order[corner] = 1;
                Next::Phase(mode, pose, zero_order)
            }
            end => end,
        }
    }

    fn slip(&mut self, mode: Mode, pose: &Pose, zero_order: [u8; GUARDS], stop: f64) -> Next {
        let phase = Slip { system: self.system, direction: mode.direction(), lean: self.lean };
        let y = [pose.theta, pose.phi, pose.theta_rate, pose.phi_rate];
        let start = Start { t: self.t, y, zero_order, step: self.steps[1] };
        let observer = &mut *self.observer;
        let end = ode::integrate(&phase, start, stop, self.effort.relative_tolerance, &mut self.work, |step| {
            observer.piece(&Piece { start_s: step.start, end_s: step.end, mode, source: Source::Slip(&phase, step) });
        });
        (self.t, self.steps[1]) = (end.t, Some(end.first_step));
        let pose = pose_of(&end.y);
        match end.cause {
            Cause::Stop => Next::End(Status::Completed),
            Cause::StepTooSmall => Next::End(self.unresolved(&phase, &pose)),
            Cause::Guard(JAMS) => Next::End(Status::Jammed),
            Cause::Guard(SLIP_CONTACT_LOST) => Next::End(Status::ContactLost),
            Cause::Guard(guard) if LEVEL_GUARDS.contains(&guard) => Next::End(Status::Diverged),
            Cause::Guard(TIP_STOPS) => {
                self.recent.note(self.t);
                self.decide_at_rest(&self.at_standstill(pose), Some(mode))
            }
            Cause::Guard(guard) => {
                let corner = self.cross_corner(guard);
                let mut zero_order = [0; GUARDS];
                zero_order[corner] = 1;
                Next::Phase(mode, pose, zero_order)
            }
        }
    }

    /// Why slip ended without a step short enough. Towards the paradox the indicator vanishes as the square root of the time that is left
    /// and the normal force grows without bound, so that no step resolves the last instant.
    fn unresolved(&self, phase: &Slip<'_>, pose: &Pose) -> Status {
        /// Chosen by looking, not derived: over 300 random heavy-headed blades the runs that ended at the paradox were left with an
        /// indicator of at most 5e-6 in size, those that ended otherwise with 0.5 or more. Anything between tells the two apart.
        const VANISHED: f64 = 1e-4;
        let (_, forces) = phase.forces(pose, &self.system.instant(self.t, pose, self.lean));
        if forces.indicator < VANISHED { Status::Jammed } else { Status::Diverged }
    }

    /// Moves the neck onto or off the shoulder; returns the guard of the corner it has just passed.
    fn cross_corner(&mut self, guard: usize) -> usize {
        self.recent.note(self.t);
        let [forward, backward] = SHOULDER_GUARDS;
        self.lean = match (self.lean, guard) {
            (Lean::Off, g) if g == forward => Lean::Forward,
            (Lean::Off, _) => Lean::Backward,
            (Lean::Forward | Lean::Backward, _) => Lean::Off,
        };
        if guard == backward { backward } else { forward }
    }
}

/// Why the tip at rest leaves one mode for another; stick that is decided anew ends at the shoulder's corner.
fn cause(from: Mode, to: Mode) -> &'static str {
    match (from, to) {
        (_, Mode::Stick) => "tip-stops",
        (Mode::Stick, _) => "shoulder-corner",
        _ => "direct-reversal",
    }
}

/// The last events, to tell chattering from motion.
struct Recent {
    times: [f64; Self::WINDOW],
    next: usize,
    shortest_s: f64,
}

impl Recent {
    /// Events looked at together.
    const WINDOW: usize = 64;
    /// Share of the blade's shortest period that as many events must take together: real cycles take about a period each.
    const SHARE: f64 = 1e-6;

    fn new(period_s: f64) -> Self {
        Self { times: [f64::NEG_INFINITY; Self::WINDOW], next: 0, shortest_s: Self::SHARE * period_s }
    }

    fn note(&mut self, t: f64) {
        self.times[self.next] = t;
        self.next = (self.next + 1) % Self::WINDOW;
    }

    fn is_chattering(&self, t: f64) -> bool {
        t - self.times[self.next] < self.shortest_s
    }
}
