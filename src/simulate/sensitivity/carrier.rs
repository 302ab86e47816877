//! Carries derivatives along a run, from piece to piece and through its transitions.

use super::TangentObserver;
use super::blocks::{Block, Blocks, rates_after};
use super::jumps::{self, Struck};
use super::piece::TangentPiece;
use super::seeds::Seeds;
use super::slide::steady_slide;
use crate::blade::Directions;
use crate::blade::modes::time_scales_rad_per_s;
use crate::blade::series::Touch;
use crate::blade::shoulder::Lean;
use crate::blade::tangent::Row;
use crate::simulate::flight::airborne_of;
use crate::simulate::machine::{Strike, Watch};
use crate::simulate::mode::Mode;
use crate::simulate::phases::{Motion, System, pose_of};
use crate::simulate::piece::{Piece, Solution};
use crate::simulate::scene::{Scene, StartKind};
use crate::simulate::{Impact, Transition, initial_pose};
use std::ops::ControlFlow;

/// A guard that has fallen, before what follows is known.
#[derive(Debug, Clone, Copy)]
struct Fallen {
    /// Its rate; `None` where derivatives are infinite or unknown.
    rate: Option<f64>,
    /// Rates of the state there: `theta'`, `phi'`, `theta''`, `phi''`, those of the gap and of its rate.
    rates: [f64; 6],
}

/// Where the derivatives stand.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Stand {
    /// At the end of the last piece.
    Going,
    /// Moved with a transition: what follows has not begun.
    Moved,
    /// There are none from here on.
    Lost,
}

/// Where derivatives are computed, kept from run to run.
#[derive(Debug, Default)]
pub(super) struct Room {
    blocks: Vec<Block>,
    motion: Box<Motion>,
}

/// Watches a run and carries derivatives along.
pub(super) struct Carrier<'a, O> {
    observer: &'a mut O,
    blocks: Blocks<'a>,
    stand: Stand,
    fallen: Option<Fallen>,
    last: Option<(Mode, Lean)>,
    /// Time of the last piece of the derivatives, s.
    span_s: [f64; 2],
    /// Motion about the start of that piece, where it is not that of the step.
    motion: &'a mut Motion,
    is_own_motion: bool,
    /// Share of its terms below which a guard's rate counts as that of a touch.
    grazing: f64,
    d_time_s: Vec<f64>,
}

impl<'a, O> Carrier<'a, O> {
    pub(super) fn new(
        observer: &'a mut O,
        system: &'a System,
        seeds: &'a Seeds,
        room: &'a mut Room,
        relative: f64,
    ) -> Self {
        /// A guard's rate carries the error of the solution: above this share of its terms, and this many
        /// tolerances, the time of its fall has derivatives good to about a thousandth.
        const GRAZING: f64 = 1e-6;
        const TOLERANCES: f64 = 1e3;
        let Room { blocks, motion } = room;
        blocks.resize_with(seeds.blocks.len(), Block::default);
        let fastest = time_scales_rad_per_s(&system.linkage).1;
        Self {
            observer,
            blocks: Blocks { system, seeds, all: blocks, relative, fastest },
            stand: Stand::Going,
            fallen: None,
            last: None,
            span_s: [0.0; 2],
            motion,
            is_own_motion: false,
            grazing: GRAZING.max(TOLERANCES * relative),
            d_time_s: vec![0.0; seeds.len()],
        }
    }

    /// Sets the derivatives of the state that a scene starts in.
    pub(super) fn start(&mut self, scene: &Scene) {
        let system = self.blocks.system;
        let head = system.drive.at(scene.start_s);
        let slides = scene.start == StartKind::SteadySlide;
        let pose = initial_pose(scene).filter(|_| slides);
        for (block, seed) in self.blocks.each() {
            block.state = seed.start;
            let Some(pose) = pose else { continue };
            let lean = scene.linkage.shoulder.map_or(Lean::Off, |s| s.lean(pose.theta));
            let d_speed = seed.head_velocity(system, scene.start_s);
            match steady_slide(system, seed, lean, &pose, head.velocity_m_per_s, d_speed) {
                Some(moved) => {
                    block.state.angle[0] += moved[0];
                    block.state.angle[1] += moved[1];
                }
                None => self.stand = Stand::Lost,
            }
        }
    }

    /// Moves the derivatives with the transition at the guard that has fallen.
    fn resolve(&mut self) {
        let Some(fallen) = self.fallen.take() else { return };
        let Some(rate) = fallen.rate else {
            self.stand = Stand::Lost;
            return;
        };
        for block in self.blocks.all.iter_mut() {
            block.time = (-1.0 / rate) * block.guard;
            block.state.shift(&fallen.rates, block.time);
        }
        self.stand = Stand::Moved;
    }

    /// What the derivatives of the next piece start from: the transition before it is over.
    fn begin(&mut self, mode: Mode, motion: &Motion) {
        let moved = self.stand == Stand::Moved;
        let rates = rates_after(motion, mode, 0.0);
        for block in self.blocks.all.iter_mut() {
            if moved {
                block.state.shift(&rates, -block.time);
            }
            if mode != Mode::Flight {
                (block.state.gap_m, block.state.gap_rate) = (Row::ZERO, Row::ZERO);
            }
        }
        if moved {
            self.stand = Stand::Going;
        }
    }
}

/// Touch and lean of a piece.
fn touch_of(piece: &Piece<'_>, motion: &Motion) -> (Touch, Lean) {
    match &piece.solution {
        Solution::Slip(slip, _) => (Touch::Slip(slip.direction), slip.lean),
        Solution::Stick(stick, _) => (Touch::Stick, stick.lean),
        Solution::Flight(flight, _) => (Touch::Flight(motion.drop_m[0], 0.0), flight.lean),
        Solution::Held(held, _) => (Touch::Stick, held.lean),
    }
}

/// The motion about `t` within a piece, from the piece's own states.
fn expand_motion(system: &System, piece: &Piece<'_>, order: usize, t: f64, motion: &mut Motion) {
    let (touch, lean) = touch_of(piece, motion);
    match &piece.solution {
        Solution::Slip(_, step) | Solution::Held(_, step) => {
            system.expand(t, &pose_of(&step.solution.at(t)), touch, lean, order, motion);
        }
        Solution::Stick(stick, step) => {
            let (pose, _) = stick.pose(&system.drive.at(t), &step.solution.at(t));
            system.expand(t, &pose, touch, lean, order, motion);
        }
        Solution::Flight(_, step) => {
            let state = airborne_of(&step.solution.at(t));
            let drop = system.linkage.drop_in_flight(&state, &Directions::of(&state.pose));
            system.expand(t, &state.pose, Touch::Flight(drop.0, drop.1), lean, order, motion);
            motion.gap_rate[0] = state.gap_rate_m_per_s;
        }
    }
}

impl<O: TangentObserver> Watch for Carrier<'_, O> {
    fn piece(&mut self, piece: &Piece<'_>) {
        let Some(motion) = piece.motion else {
            self.stand = Stand::Lost; // only Taylor series carry derivatives
            return;
        };
        let (touch, lean) = touch_of(piece, motion);
        if self.last != Some((piece.mode, lean)) {
            self.resolve();
        }
        // (a guard after which the same goes on was only touched)
        self.fallen = None;
        self.last = Some((piece.mode, lean));
        self.is_own_motion = false;
        if self.stand != Stand::Lost {
            self.begin(piece.mode, motion);
        }
        let mut from = piece.start_s;
        loop {
            let motion = if self.is_own_motion { &*self.motion } else { motion };
            let order = motion.order;
            let mut to = piece.end_s;
            if self.stand != Stand::Lost {
                self.blocks.expand(touch, lean, motion, from);
                to = self.blocks.reach(order, [from, to]);
                if !self.blocks.finish(touch, order, to - from) {
                    self.stand = Stand::Lost;
                }
            }
            self.span_s = [from, to];
            let known = self.stand != Stand::Lost;
            self.observer.piece(&TangentPiece::new(piece, self.span_s, motion, &self.blocks, known));
            if to >= piece.end_s {
                return;
            }
            expand_motion(self.blocks.system, piece, order, to, self.motion);
            self.is_own_motion = true;
            from = to;
        }
    }

    fn fell(&mut self, guard: usize, motion: &Motion) {
        let Some(contact) = self.last else { return };
        let motion = if self.is_own_motion { &*self.motion } else { motion };
        let x = self.span_s[1] - self.span_s[0];
        let system = self.blocks.system;
        let slope = jumps::slope(system, contact, guard, motion, x);
        let rate = slope.filter(|slope| slope.rate.abs() > self.grazing * slope.size).map(|slope| slope.rate);
        for (block, seed) in self.blocks.each() {
            block.guard = jumps::guard(system, contact, guard, motion, x, block, seed.linkage.as_deref());
        }
        self.fallen = Some(Fallen { rate, rates: rates_after(motion, contact.0, x) });
    }

    fn strikes(&mut self, strike: &Strike) {
        let is_fall = self.fallen.is_some();
        self.resolve();
        if !is_fall || self.stand == Stand::Lost {
            self.stand = Stand::Lost;
            return;
        }
        let (t, system) = (self.span_s[1], self.blocks.system);
        let head = system.drive.at(t);
        let struck = Struck { system, head, strike: *strike };
        for (block, seed) in self.blocks.each() {
            let d_velocity = seed.head_velocity(system, t) + head.acceleration_m_per_s2 * block.time;
            match struck.after(seed, &block.state, d_velocity) {
                Some(after) => block.state = after,
                None => self.stand = Stand::Lost,
            }
        }
    }

    fn transition(&mut self, transition: &Transition) {
        if self.fallen.is_none() && self.stand == Stand::Going {
            self.stand = Stand::Lost; // a transition without a guard: the tip jams
        }
        self.resolve();
        for (time, &(block, lane)) in self.d_time_s.iter_mut().zip(&self.blocks.seeds.places) {
            *time = self.blocks.all[block].time[lane];
        }
        let known = self.stand != Stand::Lost && self.d_time_s.iter().all(|time| time.is_finite());
        self.observer.transition(transition, known.then_some(&self.d_time_s));
    }

    fn impact(&mut self, _: &Impact) {}

    fn flow(&self) -> ControlFlow<()> {
        self.observer.flow()
    }
}
