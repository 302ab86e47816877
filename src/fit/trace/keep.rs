//! What keeps the iterates of a search.

use super::iterate::Iterate;
use std::ops::ControlFlow;

/// What keeps the iterates of a search, in order: a journal, or nothing.
pub trait Keep {
    /// The iterate that a chain had at a place, where it is known already.
    fn known(&mut self, chain: usize, place: usize) -> Option<Iterate>;
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
