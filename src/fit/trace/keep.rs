//! What keeps the iterates of a search.

use super::iterate::Iterate;
use std::ops::ControlFlow;

/// What keeps the iterates of a search, in order: a journal, or nothing.
pub trait Keep {
    /// The iterate that a chain had at a place, where it is known already.
    fn known(&mut self, chain: usize, place: usize) -> Option<Iterate>;
    /// Whether a start is taken before others, whatever they find.
    fn begins(&self, _start: usize) -> bool {
        false
    }
    /// Whether iterates of a chain that are not known are made here, or are left to another machine.
    fn makes(&self, _chain: usize) -> bool {
        true
    }
    /// A new iterate of a chain; `Break` ends the search.
    fn add(&mut self, chain: usize, place: usize, iterate: &Iterate) -> ControlFlow<()>;
}

/// Keeps nothing.
impl Keep for () {
    fn known(&mut self, _: usize, _: usize) -> Option<Iterate> {
        None
    }

    fn add(&mut self, _: usize, _: usize, _: &Iterate) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}
