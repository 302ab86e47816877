//! The `differential-equations` crate: DOP853, once with its event location and once with a root finder of our own on its dense output.
//!
//! The slip function is raised by `OFFSET` above the zero it starts at; only its way down counts.

use crate::Outcome;
use crate::blade::{Blade, Mode, SCALES};
use differential_equations::control::ControlFlag;
use differential_equations::interpolate::Interpolation;
use differential_equations::ivp::IVP;
use differential_equations::methods::{DormandPrince, ExplicitRungeKutta, Ordinary};
use differential_equations::ode::ODE;
use differential_equations::solout::{CrossingDirection, Event, EventConfig, Solout};
use differential_equations::solution::Solution;
use differential_equations::status::Status;
use std::cell::Cell;

/// The blade in one mode.
struct Phase<'a> {
    blade: &'a Blade,
    mode: Cell<Mode>,
}

impl ODE<f64, [f64; 4]> for Phase<'_> {
    fn diff(&self, t: f64, y: &[f64; 4], dy: &mut [f64; 4]) {
        *dy = self.blade.derivative(self.mode.get(), t, y);
    }
}

/// The nearer limit of stick, or the tip velocity: the crate takes one event with a direction.
impl Event<f64, [f64; 4]> for Phase<'_> {
    fn config(&self) -> EventConfig {
        EventConfig::new(CrossingDirection::Negative, Some(1))
    }

    fn event(&self, t: f64, y: &[f64; 4]) -> f64 {
        let [first, second] = self.blade.guards(self.mode.get(), t, y);
        first.min(second)
    }
}

type Dop853 = ExplicitRungeKutta<Ordinary, DormandPrince, f64, [f64; 4], 8, 12, 16>;

fn method(relative: f64) -> Dop853 {
    ExplicitRungeKutta::dop853().rtol(relative).atol(SCALES.map(|s| s * relative)).max_steps(usize::MAX)
}

/// Phase by phase, each a problem with one terminal event; the event's state is the last of the solution.
pub fn strokes(blade: &Blade, relative: f64) -> Outcome {
    let phase = Phase { blade, mode: Cell::new(Mode::Stick) };
    let mut outcome = Outcome { status: "completed", ..Outcome::default() };
    let (mut t, mut y) = (0.0, [0.0; 4]);
    loop {
        let Ok(solution) = IVP::ode(&phase, t, blade.stop, y).event(&phase).method(method(relative)).solve() else {
            outcome.status = "failed";
            return outcome;
        };
        outcome.evaluations += solution.evals.function;
        outcome.steps += solution.steps.total();
        if !matches!(solution.status, Status::Interrupted) {
            return outcome;
        }
        let (Some(&event), Some(&state)) = (solution.t.last(), solution.y.last()) else { return outcome };
        (t, y) = (event, state);
        let from = phase.mode.get();
        let [forward, backward] = blade.guards(from, t, &y);
        let to = blade.decide(from, usize::from(backward < forward), t, &mut y);
        phase.mode.set(to);
        if let Some(status) = outcome.note(t, from, to) {
            outcome.status = status;
            return outcome;
        }
    }
}

/// Looks at the guards at the end of every step and restarts the solver from the root.
struct Switch<'a> {
    phase: &'a Phase<'a>,
    outcome: Outcome,
    relative: f64,
}

impl Solout<f64, [f64; 4]> for Switch<'_> {
    fn solout<I>(
        &mut self,
        t: f64,
        t_before: f64,
        y: &[f64; 4],
        y_before: &[f64; 4],
        interpolator: &mut I,
        _: &mut Solution<f64, [f64; 4]>,
    ) -> ControlFlag<f64, [f64; 4]>
    where
        I: Interpolation<f64, [f64; 4]> + ?Sized,
    {
        let (blade, from) = (self.phase.blade, self.phase.mode.get());
        if t == t_before || self.phase.event(t, y) > 0.0 {
            return ControlFlag::Continue;
        }
        let (mut low, mut high, mut state) = (t_before, t, *y);
        // bisection to the last bit of the time: 50 interpolations, which cost little beside the step
        loop {
            let middle = 0.5 * (low + high);
            if middle == low || middle == high {
                break;
            }
            let Ok(there) = interpolator.interpolate(middle) else { return ControlFlag::Terminate };
            if self.phase.event(middle, &there) > 0.0 { low = middle } else { (high, state) = (middle, there) }
        }
        // the dense output is less exact than the step: the step is taken again up to the root
        let again = IVP::ode(self.phase, t_before, high, *y_before).method(method(self.relative).h0(high - t_before)).solve();
        if let Some(&there) = again.ok().as_ref().and_then(|solution| solution.y.last()) {
            state = there;
        }
        let [forward, backward] = blade.guards(from, high, &state);
        let to = blade.decide(from, usize::from(backward < forward), high, &mut state);
        self.phase.mode.set(to);
        match self.outcome.note(high, from, to) {
            Some(status) => {
                self.outcome.status = status;
                ControlFlag::Terminate
            }
            None => ControlFlag::ModifyState(high, state),
        }
    }
}

/// One problem for the whole run: an output function of ours locates the transition and hands the solver its new state. (The evaluations
/// of the steps that are taken again are not counted; their time is.)
pub fn strokes_with_own_roots(blade: &Blade, relative: f64) -> Outcome {
    let phase = Phase { blade, mode: Cell::new(Mode::Stick) };
    let mut switch = Switch { phase: &phase, outcome: Outcome { status: "completed", ..Outcome::default() }, relative };
    let mut solver = method(relative);
    match differential_equations::ode::solve_ode(&mut solver, &phase, 0.0, blade.stop, &[0.0; 4], &mut switch) {
        Ok(solution) => {
            switch.outcome.evaluations = solution.evals.function;
            switch.outcome.steps = solution.steps.total();
        }
        Err(_) => switch.outcome.status = "failed",
    }
    switch.outcome
}
