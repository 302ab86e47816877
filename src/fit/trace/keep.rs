//! What keeps the iterates of a search.

use super::iterate::Iterate;
use std::ops::ControlFlow;

/// What keeps the iterates of a search, in order: a journal, or nothing.
pub trait Checkpoint {
    /// The iterate that a chain had at a place, where it is known already.
    fn find_iterate(&mut self, chain: usize, place: usize) -> Option<Iterate>;
    /// A new iterate of a chain; `Break` ends the search.
    fn store_iterate(&mut self, chain: usize, place: usize, iterate: &Iterate) -> ControlFlow<()>;
}

/// Keeps nothing.
impl Checkpoint for () {
    fn find_iterate(&mut self, _: usize, _: usize) -> Option<Iterate> {
        None
    }

    fn store_iterate(&mut self, _: usize, _: usize, _: &Iterate) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}
