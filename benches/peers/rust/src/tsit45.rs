//! diffsol: Tsitouras 5(4) with its own root finder (the algorithm of SUNDIALS).
//!
//! One problem and one solver for the whole run; the mode is a cell that right-hand side and root function read. Its root finder takes any
//! change of sign, so the slip function, which starts at a zero, is raised by `OFFSET` to start positive; guards that rise through zero do
//! not occur. After a root the state is moved back to it, corrected, and the first step of the phase before of the same kind is tried.

use crate::Outcome;
use crate::blade::{Blade, Mode, SCALES};
use diffsol::{NalgebraMat, OdeBuilder, OdeSolverMethod, OdeSolverStopReason};
use std::cell::Cell;

/// First step of the first phase of either kind, a hundredth of a slip phase: the step that suited the phase before does not suit it.
const FIRST_STEP_S: f64 = 1e-5;

fn four(y: &[f64]) -> &[f64; 4] {
    y.try_into().expect("four states")
}

pub fn strokes(blade: &Blade, relative: f64) -> Outcome {
    let mode = Cell::new(Mode::Stick);
    let evaluations = Cell::new(0);
    let problem = OdeBuilder::<NalgebraMat<f64>>::new()
        .rtol(relative)
        .atol(SCALES.map(|s| s * relative))
        .rhs(|y, _p, t, dy| {
            evaluations.set(evaluations.get() + 1);
            dy.copy_from_slice(&blade.derivative(mode.get(), t, four(y)));
        })
        .init(|_p, _t, y| y.fill(0.0), 4)
        .root(|y, _p, t, g| g.copy_from_slice(&blade.guards(mode.get(), t, four(y))), 2)
        .build()
        .expect("a problem");
    let mut solver = problem.tsit45().expect("a solver");
    solver.set_stop_time(blade.stop).expect("a stop time");
    let mut outcome = Outcome { status: "completed", ..Outcome::default() };
    let mut first_steps = [FIRST_STEP_S; 2];
    let (mut begun, mut first) = (0.0, true);
    loop {
        let Ok(reason) = solver.step() else {
            outcome.status = "failed";
            break;
        };
        outcome.steps += 1;
        let kind = usize::from(mode.get() == Mode::Stick);
        if std::mem::take(&mut first) {
            first_steps[kind] = solver.state().t - begun;
        }
        let (t, guard) = match reason {
            OdeSolverStopReason::InternalTimestep => continue,
            OdeSolverStopReason::TstopReached => break,
            OdeSolverStopReason::RootFound(t, guard) => (t, guard),
        };
        if solver.state_mut_back(t).is_err() {
            outcome.status = "failed";
            break;
        }
        let from = mode.get();
        let state = solver.state_mut();
        let mut y = *four(state.y.batch_as_slice(0));
        let to = blade.decide(from, guard, t, &mut y);
        mode.set(to);
        let dy = blade.derivative(to, t, &y);
        evaluations.set(evaluations.get() + 1);
        state.y.batch_as_mut_slice(0).copy_from_slice(&y);
        state.dy.batch_as_mut_slice(0).copy_from_slice(&dy);
        *state.h = first_steps[usize::from(to == Mode::Stick)];
        (begun, first) = (t, true);
        if let Some(status) = outcome.note(t, from, to) {
            outcome.status = status;
            break;
        }
    }
    outcome.evaluations = evaluations.get();
    outcome
}
