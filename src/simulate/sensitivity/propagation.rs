//! Propagates derivatives along a run, from piece to piece and through transitions.

use super::TangentObserver;
use super::local_error::ErrorStep;
use super::saltation::{GuardInstant, StrikeTangent};
use super::seeds::{TRUNCATION_LANE, TangentSeeds, steady_slip_tangent};
use super::stretch::{SeriesReference, StretchPlace, StretchPlanner, TangentStretch};
use super::tangent_blocks::{StretchWorkspace, TangentBlock, TangentBlocks, rates_after};
use super::tangent_segment::TangentSegment;
use crate::model::modes::time_scales_rad_per_s;
use crate::model::series::ContactMode;
use crate::model::shoulder::ShoulderContact;
use crate::model::tangent::LaneVector;
use crate::simulate::equilibrium::shoulder_contact;
use crate::simulate::event_loop::{RunWatcher, TipStrike};
use crate::simulate::impact::ImpactOrigin;
use crate::simulate::mode::TipMode;
use crate::simulate::phases::{DrivenBlade, GUARDS, TaylorMotion};
use crate::simulate::scene::{Scene, StartKind};
use crate::simulate::solution_segment::{SegmentSolution, SolutionSegment};
use crate::simulate::{Impact, Transition, initial_pose};
use std::ops::ControlFlow;

/// A guard that has fallen to zero, kept until the next piece of the solution is known.
#[derive(Debug, Clone, Copy)]
struct TriggeredGuard {
    /// Rate of the guard, in the unit of the guard per s; `None` if the derivatives are infinite or unknown.
    rate: Option<f64>,
    /// Rates of the state at the zero of the guard: `theta'`, `phi'`, `theta''`, `phi''`, `gap'`, `gap''`.
    rates: [f64; 6],
}

/// Status of the derivatives in the run.
#[derive(Debug, Clone, Copy, PartialEq)]
enum TangentStatus {
    /// The derivatives are valid at the end of the last piece of the solution.
    Current,
    /// The derivatives are those at a transition time, which itself varies; the next piece has not begun.
    AtTransition,
    /// The derivatives are unknown from here to the end of the run.
    Lost,
}

/// Workspace of the derivatives, kept from run to run.
#[derive(Debug, Default)]
pub(super) struct TangentWorkspace {
    blocks: Vec<TangentBlock>,
    works: StretchWorkspace,
    /// Series of a step with more terms, for its error.
    longer: TaylorMotion,
}

/// Watches a run and propagates derivatives.
pub(super) struct TangentPropagator<'a, O> {
    observer: &'a mut O,
    blocks: TangentBlocks<'a>,
    longer: &'a mut TaylorMotion,
    stand: TangentStatus,
    fallen: Option<TriggeredGuard>,
    last: Option<(TipMode, ShoulderContact)>,
    /// The last stretch over which derivatives were propagated.
    place: Option<StretchPlace>,
    /// End of the last piece, s.
    end_s: f64,
    /// A guard counts as grazing zero if its rate, divided by the sum of the absolute values of the terms of
    /// the rate, is below this limit.
    grazing: f64,
    d_time_s: Vec<f64>,
    /// Derivatives of a guard at a minimum.
    d_minimum: Vec<f64>,
}

impl<'a, O: TangentObserver> TangentPropagator<'a, O> {
    pub(super) fn new(
        observer: &'a mut O,
        system: &'a DrivenBlade,
        seeds: &'a TangentSeeds,
        room: &'a mut TangentWorkspace,
        [tolerance, accuracy]: [f64; 2],
    ) -> Self {
        /// A guard grazes zero if its rate, divided by the sum of the absolute values of the terms of the
        /// rate, is below a limit. The limit is the larger of `GRAZING` and of `TOLERANCES` times the
        /// tolerance of the run. The rate has the error of the solution, so that at this limit derivatives of
        /// the transition time have relative errors of about a thousandth.
        const GRAZING: f64 = 1e-6;
        const TOLERANCES: f64 = 1e3;
        /// The same factor for errors of steps, whose order of magnitude is enough.
        const TOLERANCES_OF_ERRORS: f64 = 10.0;
        let tolerances = if seeds.are_step_errors { TOLERANCES_OF_ERRORS } else { TOLERANCES };
        let TangentWorkspace { blocks, works, longer } = room;
        blocks.resize_with(seeds.blocks.len(), TangentBlock::default);
        let pace = StretchPlanner::new(accuracy, time_scales_rad_per_s(&system.linkage).1);
        Self {
            observer,
            blocks: TangentBlocks { system, seeds, all: blocks, works, pace },
            longer,
            stand: TangentStatus::Current,
            fallen: None,
            last: None,
            place: None,
            end_s: f64::NEG_INFINITY,
            grazing: GRAZING.max(tolerances * tolerance),
            d_time_s: vec![0.0; seeds.len()],
            d_minimum: vec![0.0; seeds.len()],
        }
    }

    /// Sets the derivatives of the initial state.
    pub(super) fn set_start(&mut self, scene: &Scene) {
        let system = self.blocks.system;
        let head = system.drive.motion_at(scene.start_s);
        let slides = scene.start == StartKind::SteadySlide;
        let pose = initial_pose(scene).filter(|_| slides);
        for (block, seed) in self.blocks.iter_with_seeds() {
            // reset: a value of an earlier run may be NaN, and the product of zero and NaN is NaN
            *block = TangentBlock { state: seed.start, ..TangentBlock::default() };
            let d_speed = seed.head_velocity(system, scene.start_s);
            if let StartKind::Slider { .. } = scene.start {
                // the start gives the velocity of the tip: the deflection's rate falls by the head's change
                block.state.rate[1] += (-1.0 / scene.linkage.l2_m) * d_speed;
            }
            let Some(pose) = pose else { continue };
            let lean = shoulder_contact(&scene.linkage, pose.theta);
            match steady_slip_tangent(system, seed, lean, &pose, head.velocity_m_per_s, d_speed) {
                Some(moved) => {
                    block.state.angle[0] += moved[0];
                    block.state.angle[1] += moved[1];
                }
                None => self.stand = TangentStatus::Lost,
            }
        }
    }

    /// Reports a minimum of each guard that has one in a stretch.
    fn find_minima(&mut self, piece: &SolutionSegment<'_>, span: &TangentStretch<'_>) {
        let (x, end) = (span.place.from, span.place.from + span.place.length);
        for guard in 0..GUARDS {
            let start = GuardInstant { mode: piece.mode, guard, x, span };
            let Some(minimum) = start.next_minimum(end) else { continue };
            let values = [start, minimum].map(|at| at.value_along(span.course.motion));
            let [Some(before), Some(value)] = values else { continue };
            minimum.set_guard_derivatives(&mut self.blocks);
            for (error, &(block, lane)) in self.d_minimum.iter_mut().zip(&self.blocks.seeds.places) {
                *error = self.blocks.all[block].guard[lane];
            }
            self.observer.observe_minimum(piece.start_s + minimum.x, [before, value], &self.d_minimum);
        }
    }

    /// Adds the errors of a step to the derivatives at its end.
    fn add_step_errors(&mut self, piece: &SolutionSegment<'_>, course: &SeriesReference<'_>) {
        let SeriesReference { lean, motion, .. } = *course;
        let touch = match course.touch {
            // derivatives need no rate of the head's drop, but the series does
            ContactMode::Flight(drop_m, _) => ContactMode::Flight(drop_m, motion.drop_m[1]),
            touch => touch,
        };
        let leader = match &piece.solution {
            SegmentSolution::Stick(stick, _) => Some(stick.leader()),
            _ => None,
        };
        let (start_s, length_s) = (piece.start_s, piece.end_s - piece.start_s);
        let step = ErrorStep { touch, lean, start_s, length_s, motion, leader };
        let errors = step.state_errors(self.blocks.system, self.longer);
        self.blocks.all.iter_mut().for_each(|block| block.state.add(&errors));
    }

    /// Converts derivatives of the state at a fixed time to derivatives at the transition time, which itself
    /// varies; a guard has fallen to zero at this time.
    fn apply_transition(&mut self) {
        let Some(fallen) = self.fallen.take() else { return };
        if self.stand == TangentStatus::Lost {
            return; // lost derivatives stay lost
        }
        let Some(rate) = fallen.rate else {
            self.stand = TangentStatus::Lost;
            return;
        };
        for block in self.blocks.all.iter_mut() {
            block.time = (-1.0 / rate) * block.guard;
            block.state.shift_in_time(&fallen.rates, block.time);
        }
        self.stand = TangentStatus::AtTransition;
    }

    /// Converts derivatives of the state at a transition time, which itself varies, to derivatives at a fixed
    /// time at the start of the next piece.
    fn begin_segment(&mut self, mode: TipMode, motion: &TaylorMotion) {
        let moved = self.stand == TangentStatus::AtTransition;
        let rates = moved.then(|| rates_after(motion, mode, 0.0));
        for block in self.blocks.all.iter_mut() {
            if let Some(rates) = &rates {
                block.state.shift_in_time(rates, -block.time);
            }
            if mode != TipMode::Flight {
                (block.state.gap_m, block.state.gap_rate) = (LaneVector::ZERO, LaneVector::ZERO);
            }
        }
        if moved {
            self.stand = TangentStatus::Current;
        }
    }
}

/// Mode of contact, and side of the shoulder on which the neck leans, in a piece of the solution.
fn contact_of(piece: &SolutionSegment<'_>, motion: &TaylorMotion) -> (ContactMode, ShoulderContact) {
    match &piece.solution {
        SegmentSolution::Slip(slip, _) => (ContactMode::Slip(slip.direction), slip.lean),
        SegmentSolution::Stick(stick, _) => (ContactMode::Stick, stick.lean),
        SegmentSolution::Flight(flight, _) => (ContactMode::Flight(motion.drop_m[0], 0.0), flight.lean),
        SegmentSolution::Held(held, _) => (ContactMode::Stick, held.lean),
    }
}

impl<O: TangentObserver> RunWatcher for TangentPropagator<'_, O> {
    fn watch_segment(&mut self, piece: &SolutionSegment<'_>) {
        let Some(motion) = piece.motion else {
            self.stand = TangentStatus::Lost; // derivatives need Taylor series
            return;
        };
        let (touch, lean) = contact_of(piece, motion);
        let is_fresh = self.last != Some((piece.mode, lean));
        if is_fresh {
            self.apply_transition();
        }
        // a guard only grazed zero if the mode continues
        self.fallen = None;
        self.last = Some((piece.mode, lean));
        if self.stand != TangentStatus::Lost {
            self.begin_segment(piece.mode, motion);
        }
        self.end_s = piece.end_s;
        let course = SeriesReference { linkage: &self.blocks.system.linkage, touch, lean, motion };
        let (mut from, end) = (0.0, piece.end_s - piece.start_s);
        loop {
            let TangentBlocks { system, seeds, .. } = self.blocks;
            let span = if self.stand != TangentStatus::Lost && !self.blocks.all.is_empty() {
                let fresh = is_fresh && from == 0.0;
                let span = self.blocks.propagate_stretch(&course, piece.start_s, [from, end], fresh);
                if !self.blocks.are_finite() {
                    self.stand = TangentStatus::Lost;
                }
                span
            } else {
                let place = StretchPlace::whole_piece(touch, lean, piece.start_s, end);
                TangentStretch::new(system, &seeds.sources, course, place)
            };
            let to = span.place.from + span.place.length;
            if self.blocks.seeds.are_step_errors && self.stand != TangentStatus::Lost {
                self.find_minima(piece, &span);
            }
            let is_last = to >= end;
            self.place = Some(span.place);
            self.observer.observe_segment(&TangentSegment {
                start_s: piece.start_s + from,
                end_s: if is_last { piece.end_s } else { piece.start_s + to },
                mode: piece.mode,
                is_known: self.stand != TangentStatus::Lost,
                piece,
                span,
                blocks: self.blocks.all,
                seeds,
            });
            if is_last {
                break;
            }
            from = to;
        }
        if self.blocks.seeds.are_step_errors && self.stand != TangentStatus::Lost {
            self.add_step_errors(piece, &course);
        }
    }

    fn watch_guard(&mut self, guard: usize, motion: &TaylorMotion) {
        let (Some(contact), Some(place)) = (self.last, self.place) else { return };
        let TangentBlocks { system, seeds, .. } = self.blocks;
        let StretchPlace { touch, lean, .. } = place;
        let course = SeriesReference { linkage: &system.linkage, touch, lean, motion };
        let span = TangentStretch::new(system, &seeds.sources, course, place);
        let x = place.from + place.length;
        let fall = GuardInstant { mode: contact.0, guard, x, span: &span };
        let rate = fall.guard_slope().filter(|slope| slope.rate.abs() > self.grazing * slope.size);
        if self.stand != TangentStatus::Lost {
            fall.set_guard_derivatives(&mut self.blocks);
            if seeds.are_step_errors
                && let Some(exact) = fall.value_along(self.longer)
            {
                // the guard's error by truncation of the last step: it is zero where it has this value
                self.blocks.all[0].guard[TRUNCATION_LANE] -= exact;
            }
        }
        let rates = rates_after(motion, contact.0, x);
        self.fallen = Some(TriggeredGuard { rate: rate.map(|slope| slope.rate), rates });
    }

    fn watch_strike(&mut self, strike: &TipStrike) {
        let is_fall = self.fallen.is_some();
        self.apply_transition();
        // a tip jams at a pole of the contact force or at the start of a run; in neither case does a guard
        // fall to zero
        if !is_fall || strike.origin == ImpactOrigin::Jam || self.stand == TangentStatus::Lost {
            self.stand = TangentStatus::Lost;
            return;
        }
        let (t, system) = (self.end_s, self.blocks.system);
        let head = system.drive.motion_at(t);
        let struck = StrikeTangent { system, head, strike: *strike };
        for (block, seed) in self.blocks.iter_with_seeds() {
            let d_velocity = seed.head_velocity(system, t) + head.acceleration_m_per_s2 * block.time;
            match struck.state_after(seed, &block.state, d_velocity) {
                Some(after) => block.state = after,
                None => self.stand = TangentStatus::Lost,
            }
        }
    }

    fn watch_transition(&mut self, transition: &Transition) {
        if self.fallen.is_none() && self.stand == TangentStatus::Current {
            self.stand = TangentStatus::Lost; // only a jam is a transition without a guard
        }
        self.apply_transition();
        for (time, &(block, lane)) in self.d_time_s.iter_mut().zip(&self.blocks.seeds.places) {
            *time = self.blocks.all[block].time[lane];
        }
        let known = self.stand != TangentStatus::Lost && self.d_time_s.iter().all(|time| time.is_finite());
        self.observer.observe_transition(transition, known.then_some(&self.d_time_s));
    }

    fn watch_impact(&mut self, _: &Impact) {}

    fn control_flow(&self) -> ControlFlow<()> {
        self.observer.control_flow()
    }
}

#[cfg(test)]
impl TangentWorkspace {
    /// A workspace filled with NaN, as after a run with lost derivatives.
    pub(super) fn of_no_numbers(blocks: usize) -> Self {
        let blocks = std::iter::repeat_with(TangentBlock::of_no_numbers).take(blocks).collect();
        Self { blocks, works: StretchWorkspace::of_no_numbers(), longer: TaylorMotion::default() }
    }
}
