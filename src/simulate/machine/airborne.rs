//! Off the glass and back: lift-off, flight, landing, and the impact without collision that resolves the
//! Painlevé paradox.

use super::{Before, Machine, Next, Strike, Watch, integrate};
use crate::blade::flight::Airborne;
use crate::blade::shoulder::Lean;
use crate::blade::{Directions, Pose};
use crate::ode::{self, Cause as Ended, Start};
use crate::simulate::flight::{Flight, LANDS, airborne_of, states_of};
use crate::simulate::impact::{Origin, Outcome, TipVelocity};
use crate::simulate::mode::Mode;
use crate::simulate::phases::{GUARDS, LEVEL_GUARDS};
use crate::simulate::piece::{Piece, Solution};
use crate::simulate::scene::{Jam, Loss};
use crate::simulate::{Cause, Impact, Run, Status};

impl<W: Watch> Machine<'_, W> {
    /// A run that starts off the glass.
    pub(in crate::simulate) fn run_airborne(&mut self, state: &Airborne, stop: f64) -> Run {
        self.lean = self.system.linkage.shoulder.map_or(Lean::Off, |s| s.lean(state.pose.theta));
        let mut zero_order = [0; GUARDS];
        zero_order[LANDS] = if state.gap_m > 0.0 { 0 } else { self.order_of_gap(state) };
        self.follow(Next::Flight(*state, zero_order), stop)
    }

    /// The normal force has reached zero.
    pub(super) fn lose_contact(&mut self, pose: &Pose, before: Before) -> Next {
        self.leave(Airborne { pose: *pose, gap_m: 0.0, gap_rate_m_per_s: 0.0 }, before)
    }

    fn leave(&mut self, state: Airborne, before: Before) -> Next {
        if self.rules.loss == Loss::Stop {
            return Next::End(Status::ContactLost);
        }
        if let Some((from, cause)) = before {
            if cause.is_none() {
                self.recent.note(self.t); // impacts have noted themselves
            }
            self.change(from, Mode::Flight, cause.unwrap_or(Cause::LiftOff));
        }
        let mut zero_order = [0; GUARDS];
        zero_order[LANDS] = self.order_of_gap(&state);
        Next::Flight(state, zero_order)
    }

    fn gap_acceleration(&self, t: f64, state: &Airborne) -> f64 {
        let d = Directions::of(&state.pose);
        self.system.linkage.flight(state, &d, &self.system.drive.at(t), self.lean).gap_m_per_s2
    }

    /// Order of the gap's zero at lift-off: 1 after a rebound, 2 where forces have jumped, 3 where the normal
    /// force has fallen through zero, so that the gap's acceleration starts there but for the error of the
    /// solution: the order of the term that counts most over a short time. Only a rebound that falls back
    /// needs its order independent of the others; a term of lower order that is left over and positive makes
    /// the gap clearer, not less clear.
    fn order_of_gap(&self, state: &Airborne) -> u8 {
        /// The short time, as a share of the shortest period.
        const SHARE: f64 = 1e-3;
        let time = SHARE * self.shortest_period_s;
        let rates = ode::Phase::derivative(
            &Flight { system: self.system, lean: self.lean },
            self.t,
            &states_of(state),
        );
        let (mut ahead, now) = (states_of(state), rates[5]);
        ahead.iter_mut().zip(rates).for_each(|(y, rate)| *y += time * rate);
        let change = self.gap_acceleration(self.t + time, &airborne_of(&ahead)) - now;
        let [first, second, third] = [state.gap_rate_m_per_s, 0.5 * now * time, change * time / 6.0];
        match () {
            () if first > 0.0 && (now < 0.0 || first > second.max(third)) => 1,
            // with a third that falls too: to divide by it would take a tip that rises for one that lands
            () if second.abs() > third => 2,
            () => 3,
        }
    }

    pub(super) fn flight(&mut self, state: &Airborne, zero_order: [u8; GUARDS], stop: f64) -> Next {
        let phase = Flight { system: self.system, lean: self.lean };
        /// A little more than a rebound lasts, so that one step holds its end.
        const MARGIN: f64 = 1.25;
        let (started, rebound) = (self.t, self.rebound_s(state).map(|time| MARGIN * time));
        // (the steps of rebounds are no measure for a flight that begins with the gap's acceleration at zero)
        let start = Start { t: self.t, y: states_of(state), zero_order, step: rebound.or(self.steps[2]) };
        let (watch, drive) = (&mut *self.watch, &self.system.drive);
        let end = integrate(
            &phase,
            start,
            |t| drive.horizon(t, stop),
            &self.effort,
            &mut self.rooms.2,
            &mut self.work,
            |step, motion| {
                watch.piece(&Piece {
                    start_s: step.start,
                    end_s: step.end,
                    mode: Mode::Flight,
                    motion,
                    solution: Solution::Flight(&phase, step),
                });
                watch.flow()
            },
        );
        self.t = end.t;
        if rebound.is_none() {
            self.steps[2] = Some(end.first_step);
        }
        let state = airborne_of(&end.y);
        if let Ended::Guard(guard) = end.cause {
            self.watch.fell(guard, &self.rooms.2.tape);
        }
        match end.cause {
            Ended::Stop => Next::End(Status::Completed),
            Ended::Asked => Next::End(Status::Interrupted),
            Ended::StepTooSmall => Next::End(self.gave_up()),
            Ended::Guard(guard) if LEVEL_GUARDS.contains(&guard) => Next::End(Status::Diverged),
            Ended::Guard(LANDS) => self.land(&state),
            Ended::Guard(guard) => {
                let corner = self.cross_corner(guard);
                let mut next_order = if end.t == started { zero_order } else { [0; GUARDS] };
                next_order[corner] = 1;
                Next::Flight(state, next_order)
            }
        }
    }

    /// How long a tip that leaves the glass at a velocity stays off it if the gap's acceleration stays, `2
    /// v_n / |gap''|`, s.
    fn rebound_s(&self, state: &Airborne) -> Option<f64> {
        let acceleration = self.gap_acceleration(self.t, state);
        (state.gap_m == 0.0 && state.gap_rate_m_per_s > 0.0 && acceleration < 0.0)
            .then(|| -2.0 * state.gap_rate_m_per_s / acceleration)
    }

    /// The gap has fallen to zero.
    fn land(&mut self, state: &Airborne) -> Next {
        self.recent.note(self.t);
        // a tip that only grazes the glass may be found to leave it, within the tolerance
        self.strike(
            &state.pose,
            state.gap_rate_m_per_s.min(0.0),
            Origin::Collision,
            (Mode::Flight, Cause::Landing),
        )
    }

    /// No finite force is admissible in slip, or leaving stick into it. Where the tip would rise without
    /// contact it does; otherwise the paradox is an impact without collision.
    pub(super) fn jam(&mut self, pose: &Pose, from: Mode) -> Next {
        if self.rules.jam == Jam::Stop {
            return Next::End(Status::Jammed);
        }
        let at = self.system.instant(self.t, pose, self.lean);
        if at.contact.n_free < 0.0 {
            return self.lose_contact(pose, Some((from, None)));
        }
        if from == Mode::Stick {
            return Next::End(Status::Jammed); // at rest there is nothing that an impact could brake
        }
        self.recent.note(self.t);
        self.strike(pose, 0.0, Origin::Jam, (from, Cause::JamImpact))
    }

    /// An impact and what follows it.
    fn strike(&mut self, pose: &Pose, normal: f64, origin: Origin, (from, cause): (Mode, Cause)) -> Next {
        let d = Directions::of(pose);
        let tangential = self.system.linkage.tip_velocity_m_per_s(pose, &d, &self.system.drive.at(self.t));
        let before = TipVelocity { normal, tangential };
        let strike = Strike { pose: *pose, before, origin, restitution: self.rules.restitution };
        let Some((after, outcome)) = self.rebound_or_close(strike) else {
            return Next::End(Status::Diverged);
        };
        self.tell(&d, pose, &after.pose, before, &outcome);
        let before = Some((from, Some(cause)));
        match outcome.velocity {
            TipVelocity { normal, .. } if normal > 0.0 => self.leave(after, before),
            TipVelocity { tangential: 0.0, .. } => {
                self.decide_at_rest(&self.at_standstill(after.pose), before)
            }
            TipVelocity { tangential, .. } => self.decide_in_motion(&after.pose, tangential, before),
        }
    }

    /// The impact with the scene's restitution, or without any where the train of rebounds that it belongs to
    /// counts as over: the rest of a train, `T (1 + e + e^2 + ...)`, passes on the same impulse as contact
    /// does in the same time, so that closing it early moves the tip by no more than the height of a rebound.
    fn rebound_or_close(&mut self, strike: Strike) -> Option<(Airborne, Outcome)> {
        /// Share of the shortest period that a rebound must last to be followed: ten times the share within
        /// which a whole window of events counts as chattering, so that a train closes before it does.
        const RESOLUTION: f64 = 1e-5;
        /// Share below which a rebound counts as short, and short rebounds in a row after which a train is
        /// closed for any restitution: with one near 1 it might last for ever. A restitution of 0.99
        /// comes from one share to the other in 690.
        const SHORT: f64 = 1e-2;
        const MOST_SHORT: u32 = 1000;
        let rebound = self.struck(&strike)?;
        let share = self.rebound_s(&rebound.0).map_or(f64::INFINITY, |time| time / self.shortest_period_s);
        self.short_rebounds = if share < SHORT { self.short_rebounds + 1 } else { 0 };
        if share < RESOLUTION || self.short_rebounds > MOST_SHORT {
            self.short_rebounds = 0;
            let closed = Strike { restitution: 0.0, ..strike };
            self.watch.strikes(&closed);
            return self.struck(&closed);
        }
        self.watch.strikes(&strike);
        Some(rebound)
    }

    fn struck(&mut self, strike: &Strike) -> Option<(Airborne, Outcome)> {
        strike.outcome(&self.system.linkage, self.effort.relative_tolerance, &mut self.work)
    }

    fn tell(
        &mut self,
        d: &Directions,
        before: &Pose,
        after: &Pose,
        velocity: TipVelocity,
        outcome: &Outcome,
    ) {
        let changes = [after.theta_rate - before.theta_rate, after.phi_rate - before.phi_rate];
        let drive = self.system.linkage.drive_impulse_n_s(d, changes, outcome.impulse_n_s[1]);
        self.watch.impact(&Impact {
            time_s: self.t,
            before: velocity,
            after: outcome.velocity,
            impulse_n_s: outcome.impulse_n_s,
            lost_j: outcome.lost_j,
            driven_j: drive * self.system.drive.at(self.t).velocity_m_per_s,
        });
    }
}
