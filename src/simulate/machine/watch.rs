//! Who looks on while a run goes on: an observer alone, or one with derivatives.

use super::strike::Strike;
use crate::simulate::phases::Motion;
use crate::simulate::{Impact, Observer, Piece, Transition};
use std::ops::ControlFlow;

/// What the machine says of a run as it goes on.
pub(in crate::simulate) trait Watch {
    /// A piece of the solution, in order of time.
    fn piece(&mut self, piece: &Piece<'_>);
    /// A guard has fallen at the end of the last piece, whose series this is.
    fn fell(&mut self, _guard: usize, _motion: &Motion) {}
    /// The tip strikes the glass there.
    fn strikes(&mut self, _strike: &Strike) {}
    /// A change of mode, between the pieces it separates.
    fn transition(&mut self, transition: &Transition);
    /// An impact, before the transition that it causes.
    fn impact(&mut self, impact: &Impact);
    /// `Break` ends the run.
    fn flow(&self) -> ControlFlow<()>;
}

/// An observer and nothing else.
pub(in crate::simulate) struct Plain<'a, O>(pub &'a mut O);

impl<O: Observer> Watch for Plain<'_, O> {
    fn piece(&mut self, piece: &Piece<'_>) {
        self.0.piece(piece);
    }
    fn transition(&mut self, transition: &Transition) {
        self.0.transition(transition);
    }
    fn impact(&mut self, impact: &Impact) {
        self.0.impact(impact);
    }
    fn flow(&self) -> ControlFlow<()> {
        self.0.flow()
    }
}
