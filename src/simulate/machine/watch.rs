//! Who looks on while a run goes on: an observer alone, or one with derivatives.

use super::strike::TipStrike;
use crate::simulate::phases::TaylorMotion;
use crate::simulate::{Impact, Observer, SolutionSegment, Transition};
use std::ops::ControlFlow;

/// What the machine says of a run as it goes on.
pub(in crate::simulate) trait RunWatcher {
    /// A piece of the solution, in order of time.
    fn watch_segment(&mut self, piece: &SolutionSegment<'_>);
    /// A guard has fallen at the end of the last piece, whose series this is.
    fn watch_guard(&mut self, _guard: usize, _motion: &TaylorMotion) {}
    /// The tip strikes the glass there.
    fn watch_strike(&mut self, _strike: &TipStrike) {}
    /// A change of mode, between the pieces it separates.
    fn watch_transition(&mut self, transition: &Transition);
    /// An impact, before the transition that it causes.
    fn watch_impact(&mut self, impact: &Impact);
    /// `Break` ends the run.
    fn control_flow(&self) -> ControlFlow<()>;
}

/// An observer and nothing else.
pub(in crate::simulate) struct ObserverWatcher<'a, O>(pub &'a mut O);

impl<O: Observer> RunWatcher for ObserverWatcher<'_, O> {
    fn watch_segment(&mut self, piece: &SolutionSegment<'_>) {
        self.0.observe_segment(piece);
    }
    fn watch_transition(&mut self, transition: &Transition) {
        self.0.observe_transition(transition);
    }
    fn watch_impact(&mut self, impact: &Impact) {
        self.0.observe_impact(impact);
    }
    fn control_flow(&self) -> ControlFlow<()> {
        self.0.control_flow()
    }
}
