//! Lift-off, flight, landing, and the impact without collision that resolves the Painlevé paradox.

use super::{EventLoop, NextPhase, PendingTransition, TipStrike, integrate_phase};
use crate::model::flight::FlightState;
use crate::model::{LinkDirections, Pose};
use crate::simulate::flight::{FlightPhase, LANDING, flight_state_from, flight_state_vector};
use crate::simulate::impact::{ImpactOrigin, ImpactOutcome, TipVelocity};
use crate::simulate::mode::TipMode;
use crate::simulate::phases::{GUARDS, LEVEL_GUARDS};
use crate::simulate::scene::contact::{ContactLossRule, JamRule};
use crate::simulate::solution_segment::{SegmentSolution, SolutionSegment};
use crate::simulate::{Impact, RunStatus, TransitionCause};
use hybrid_ode::{HybridPhase, PhaseEndCause as Ended, PhaseStart};

impl EventLoop<'_> {
    /// Decides what follows when the normal force reaches zero.
    pub(super) fn lose_contact(&mut self, pose: &Pose, before: PendingTransition) -> NextPhase {
        self.lift_off(FlightState { pose: *pose, gap_m: 0.0, gap_rate_m_per_s: 0.0 }, before)
    }

    fn lift_off(&mut self, state: FlightState, before: PendingTransition) -> NextPhase {
        if self.scene.loss == ContactLossRule::Stop {
            return NextPhase::End(RunStatus::ContactLost);
        }
        if let Some((from, cause)) = before {
            if cause.is_none() {
                self.recent.note_event(self.t); // (impacts were noted earlier)
            }
            self.record_transition(from, TipMode::Flight, cause.unwrap_or(TransitionCause::LiftOff));
        }
        let mut zero_order = [0; GUARDS];
        zero_order[LANDING] = self.gap_order(&state);
        NextPhase::Flight(state, zero_order)
    }

    fn gap_acceleration(&self, t: f64, state: &FlightState) -> f64 {
        let (d, head) = (LinkDirections::from_pose(&state.pose), self.system.drive.motion_at(t));
        self.system.linkage.flight_accelerations(state, &d, &head, self.lean).gap_m_per_s2
    }

    /// Order of the zero that the gap has at lift-off: the order of that term of the gap's Taylor series that
    /// is largest over a short time. It is 1 after a rebound, 2 after a jump of the forces, and 3 after the
    /// normal force has passed zero, where the acceleration of the gap is zero except for errors. A rebound
    /// always has order 1 if its gap decelerates. Otherwise, a positive term of lower order may be neglected
    /// if it is smaller, because it only widens the gap.
    pub(super) fn gap_order(&self, state: &FlightState) -> u8 {
        /// Length of the short time over which the terms are compared, as a fraction of the shortest period
        /// of the links.
        const SHARE: f64 = 1e-3;
        let time = SHARE * self.shortest_period_s;
        let phase = FlightPhase { system: self.system, lean: self.lean };
        let mut ahead = flight_state_vector(state);
        let rates = phase.derivative(self.t, &ahead);
        let now = rates[5];
        ahead.iter_mut().zip(rates).for_each(|(y, rate)| *y += time * rate);
        let change = self.gap_acceleration(self.t + time, &flight_state_from(&ahead)) - now;
        let [first, second, third] = [state.gap_rate_m_per_s, 0.5 * now * time, change * time / 6.0];
        match () {
            () if first > 0.0 && (now < 0.0 || first > second.max(third)) => 1,
            // a negative third term does not raise the order to 3, since a rising tip would then look like a
            // landing tip
            () if second.abs() > third => 2,
            () => 3,
        }
    }

    pub(super) fn integrate_flight(&mut self, state: &FlightState, zero_order: [u8; GUARDS]) -> NextPhase {
        let phase = FlightPhase { system: self.system, lean: self.lean };
        /// Factor on the expected duration of a rebound, so that the first step includes its end.
        const MARGIN: f64 = 1.25;
        let (started, rebound) = (self.t, self.rebound_s(state).map(|time| MARGIN * time));
        // the step of a rebound is a poor guess for a flight that begins with zero acceleration of the gap
        let (y, step) = (flight_state_vector(state), rebound.or(self.steps[2]));
        let start = PhaseStart { t: self.t, y, zero_order, step };
        let (watch, drive, stop) = (&mut *self.watch, &self.system.drive, self.scene.run.stop_s);
        let end = integrate_phase(
            &phase,
            start,
            |t| drive.horizon(t, stop),
            &self.effort,
            &mut self.rooms.2,
            &mut self.work,
            |step, motion| {
                let solution = SegmentSolution::Flight(&phase, step);
                watch.watch_segment(&SolutionSegment::from_step(step, TipMode::Flight, motion, solution));
                watch.control_flow()
            },
        );
        self.t = end.t;
        if rebound.is_none() {
            self.steps[2] = Some(end.first_step);
        }
        let state = flight_state_from(&end.y);
        if let Ended::Guard(guard) = end.cause {
            self.watch.watch_guard(guard, &self.rooms.2.tape);
        }
        match end.cause {
            Ended::Stop => NextPhase::End(RunStatus::Completed),
            Ended::Interrupted => NextPhase::End(RunStatus::Interrupted),
            Ended::StepTooSmall => NextPhase::End(self.failure_status()),
            Ended::Guard(guard) if LEVEL_GUARDS.contains(&guard) => NextPhase::End(RunStatus::Diverged),
            Ended::Guard(LANDING) => self.land_tip(&state),
            Ended::Guard(guard) => {
                let corner = self.cross_corner(guard);
                let mut next_order = if end.t == started { zero_order } else { [0; GUARDS] };
                next_order[corner] = 1;
                NextPhase::Flight(state, next_order)
            }
        }
    }

    /// Expected duration of a rebound, `2 v_n / |gap''|`, s, if the acceleration `gap''` of the gap stays
    /// constant; `v_n` is the tip's velocity away from the glass.
    fn rebound_s(&self, state: &FlightState) -> Option<f64> {
        let acceleration = self.gap_acceleration(self.t, state);
        (state.gap_m == 0.0 && state.gap_rate_m_per_s > 0.0 && acceleration < 0.0)
            .then(|| -2.0 * state.gap_rate_m_per_s / acceleration)
    }

    /// Decides what follows when the gap falls to zero.
    fn land_tip(&mut self, state: &FlightState) -> NextPhase {
        self.recent.note_event(self.t);
        // within the tolerance, a tip that grazes the glass may seem to move away from it
        let (normal, cause) = (state.gap_rate_m_per_s.min(0.0), TransitionCause::Landing);
        self.strike_glass(&state.pose, normal, ImpactOrigin::Collision, (TipMode::Flight, cause))
    }

    /// Decides what follows when slip, or a release into slip, has no admissible finite force: lift-off if
    /// the tip rises without contact, otherwise an impact without collision.
    pub(super) fn resolve_jam(&mut self, pose: &Pose, from: TipMode) -> NextPhase {
        if self.scene.jam == JamRule::Stop {
            return NextPhase::End(RunStatus::Jammed);
        }
        let at = self.system.contact_instant(self.t, pose, self.lean);
        if at.contact.n_free < 0.0 {
            return self.lose_contact(pose, Some((from, None)));
        }
        if from == TipMode::Stick {
            return NextPhase::End(RunStatus::Jammed); // an impact cannot brake a tip at rest
        }
        self.recent.note_event(self.t);
        self.strike_glass(pose, 0.0, ImpactOrigin::Jam, (from, TransitionCause::JamImpact))
    }

    /// Computes an impact and decides the next mode.
    fn strike_glass(
        &mut self,
        pose: &Pose,
        normal: f64,
        origin: ImpactOrigin,
        (from, cause): (TipMode, TransitionCause),
    ) -> NextPhase {
        let (d, head) = (LinkDirections::from_pose(pose), self.system.drive.motion_at(self.t));
        let tangential = self.system.linkage.tip_velocity_m_per_s(pose, &d, &head);
        let before = TipVelocity { normal, tangential };
        let strike = TipStrike { pose: *pose, before, origin, restitution: self.scene.restitution() };
        let Some((after, outcome)) = self.rebound_or_close(strike) else {
            return NextPhase::End(RunStatus::Diverged);
        };
        let changes = [after.pose.theta_rate - pose.theta_rate, after.pose.phi_rate - pose.phi_rate];
        let drive_n_s = self.system.linkage.drive_impulse_n_s(&d, changes, outcome.impulse_n_s[1]);
        self.watch.watch_impact(&Impact {
            time_s: self.t,
            before,
            after: outcome.velocity,
            impulse_n_s: outcome.impulse_n_s,
            lost_j: outcome.lost_j,
            driven_j: drive_n_s * head.velocity_m_per_s,
        });
        let before = Some((from, Some(cause)));
        match outcome.velocity {
            TipVelocity { normal, .. } if normal > 0.0 => self.lift_off(after, before),
            TipVelocity { tangential: 0.0, .. } => {
                self.decide_at_rest(&self.remove_tip_velocity(after.pose), before)
            }
            TipVelocity { tangential, .. } => self.decide_in_motion(&after.pose, tangential, before),
        }
    }

    /// Computes the impact with the scene's restitution, or with zero restitution if the train of rebounds
    /// counts as over. With the restitution `e` and the duration `T` of the next rebound, the remaining
    /// rebounds last `T (1 + e + e^2 + ...)` and transmit the same impulse as contact during that time.
    /// Ending the train early therefore moves the tip by at most the height of a rebound.
    fn rebound_or_close(&mut self, strike: TipStrike) -> Option<(FlightState, ImpactOutcome)> {
        /// A rebound shorter than this fraction of the links' shortest period ends its train of rebounds. The
        /// fraction is ten times that of chattering, so that the train ends before it counts as chattering.
        const RESOLUTION: f64 = 1e-5;
        /// A rebound shorter than this fraction of the links' shortest period counts as short. A train has at
        /// most `MOST_SHORT` consecutive short rebounds, because it might never end for a restitution near 1.
        /// With a restitution of 0.99, rebounds shorten from `SHORT` to `RESOLUTION` in 690 rebounds.
        const SHORT: f64 = 1e-2;
        const MOST_SHORT: u32 = 1000;
        let rebound = self.solve_strike(&strike)?;
        let share = self.rebound_s(&rebound.0).map_or(f64::INFINITY, |time| time / self.shortest_period_s);
        self.short_rebounds = if share < SHORT { self.short_rebounds + 1 } else { 0 };
        if share < RESOLUTION || self.short_rebounds > MOST_SHORT {
            self.short_rebounds = 0;
            let closed = TipStrike { restitution: 0.0, ..strike };
            self.watch.watch_strike(&closed);
            return self.solve_strike(&closed);
        }
        self.watch.watch_strike(&strike);
        Some(rebound)
    }

    fn solve_strike(&mut self, strike: &TipStrike) -> Option<(FlightState, ImpactOutcome)> {
        strike.solve_on_blade(&self.system.linkage, self.effort.relative_tolerance, &mut self.work)
    }
}
