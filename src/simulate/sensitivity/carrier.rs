//! Carries derivatives along a run, from piece to piece and through its transitions.

use super::TangentObserver;
use super::blocks::{Block, Blocks, Works, rates_after};
use super::jumps::{self, Struck};
use super::piece::TangentPiece;
use super::seeds::Seeds;
use super::slide::steady_slide;
use super::span::{Course, Pace, Place, Span};
use crate::blade::modes::time_scales_rad_per_s;
use crate::blade::series::Touch;
use crate::blade::shoulder::Lean;
use crate::blade::tangent::Row;
use crate::simulate::impact::Origin;
use crate::simulate::machine::{Strike, Watch};
use crate::simulate::mode::Mode;
use crate::simulate::phases::{Motion, System};
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
    works: Works,
}

/// Watches a run and carries derivatives along.
pub(super) struct Carrier<'a, O> {
    observer: &'a mut O,
    blocks: Blocks<'a>,
    stand: Stand,
    fallen: Option<Fallen>,
    last: Option<(Mode, Lean)>,
    /// The last stretch of the derivatives.
    place: Option<Place>,
    /// End of the last piece, s.
    end_s: f64,
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
        [tolerance, accuracy]: [f64; 2],
    ) -> Self {
        /// A guard's rate carries the error of the solution: above this share of its terms, and this many
        /// tolerances, the time of its fall has derivatives good to about a thousandth.
        const GRAZING: f64 = 1e-6;
        const TOLERANCES: f64 = 1e3;
        let Room { blocks, works } = room;
        blocks.resize_with(seeds.blocks.len(), Block::default);
        let fastest = time_scales_rad_per_s(&system.linkage).1;
        Self {
            observer,
            blocks: Blocks { system, seeds, all: blocks, works, pace: Pace::new(accuracy, fastest) },
            stand: Stand::Going,
            fallen: None,
            last: None,
            place: None,
            end_s: f64::NEG_INFINITY,
            grazing: GRAZING.max(TOLERANCES * tolerance),
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
            // (what a run before left there may be no number, and nought times that is none either)
            *block = Block { state: seed.start, ..Block::default() };
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
        if self.stand == Stand::Lost {
            return; // what is lost does not come back
        }
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
        let rates = moved.then(|| rates_after(motion, mode, 0.0));
        for block in self.blocks.all.iter_mut() {
            if let Some(rates) = &rates {
                block.state.shift(rates, -block.time);
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

impl<O: TangentObserver> Watch for Carrier<'_, O> {
    fn piece(&mut self, piece: &Piece<'_>) {
        let Some(motion) = piece.motion else {
            self.stand = Stand::Lost; // only Taylor series carry derivatives
            return;
        };
        let (touch, lean) = touch_of(piece, motion);
        let is_fresh = self.last != Some((piece.mode, lean));
        if is_fresh {
            self.resolve();
        }
        // (a guard after which the same goes on was only touched)
        self.fallen = None;
        self.last = Some((piece.mode, lean));
        if self.stand != Stand::Lost {
            self.begin(piece.mode, motion);
        }
        self.end_s = piece.end_s;
        let course = Course { linkage: &self.blocks.system.linkage, touch, lean, motion };
        let (mut from, end) = (0.0, piece.end_s - piece.start_s);
        loop {
            let Blocks { system, seeds, .. } = self.blocks;
            let span = if self.stand != Stand::Lost && !self.blocks.all.is_empty() {
                let span = self.blocks.cover(&course, piece.start_s, [from, end], is_fresh && from == 0.0);
                if !self.blocks.are_finite() {
                    self.stand = Stand::Lost;
                }
                span
            } else {
                let place = Place::whole(touch, lean, piece.start_s, end);
                Span::new(system, &seeds.sources, course, place)
            };
            let to = span.place.from + span.place.length;
            let is_last = to >= end;
            self.place = Some(span.place);
            self.observer.piece(&TangentPiece {
                start_s: piece.start_s + from,
                end_s: if is_last { piece.end_s } else { piece.start_s + to },
                mode: piece.mode,
                is_known: self.stand != Stand::Lost,
                piece,
                span,
                blocks: self.blocks.all,
                seeds,
            });
            if is_last {
                return;
            }
            from = to;
        }
    }

    fn fell(&mut self, guard: usize, motion: &Motion) {
        let (Some(contact), Some(place)) = (self.last, self.place) else { return };
        let Blocks { system, seeds, .. } = self.blocks;
        let Place { touch, lean, .. } = place;
        let course = Course { linkage: &system.linkage, touch, lean, motion };
        let span = Span::new(system, &seeds.sources, course, place);
        let x = place.from + place.length;
        let fall = jumps::Fall { mode: contact.0, guard, x, span: &span };
        let rate = fall.slope().filter(|slope| slope.rate.abs() > self.grazing * slope.size);
        if self.stand != Stand::Lost {
            fall.derive(&mut self.blocks);
        }
        self.fallen =
            Some(Fallen { rate: rate.map(|slope| slope.rate), rates: rates_after(motion, contact.0, x) });
    }

    fn strikes(&mut self, strike: &Strike) {
        let is_fall = self.fallen.is_some();
        self.resolve();
        // (a tip jams where its force has a pole, or where a run begins: neither has a guard)
        if !is_fall || strike.origin == Origin::Jam || self.stand == Stand::Lost {
            self.stand = Stand::Lost;
            return;
        }
        let (t, system) = (self.end_s, self.blocks.system);
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

#[cfg(test)]
impl Room {
    /// A room as a run whose derivatives are lost may leave it.
    pub(super) fn of_no_numbers(blocks: usize) -> Self {
        let blocks = std::iter::repeat_with(Block::of_no_numbers).take(blocks).collect();
        Self { blocks, works: Works::of_no_numbers() }
    }
}
