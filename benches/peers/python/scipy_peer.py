"""The scene in SciPy: solve_ivp phase by phase, right-hand sides and events compiled by numba, terminal events with a direction.

Stick keeps all four states under the exact constraint force; what tip velocity is left at a transition is taken out. The slip event
starts at a zero (a double one after a release) and is raised by blade.OFFSET, so that it starts positive.

usage: scipy_peer.py SCENE.toml REPETITIONS FOLDER METHOD TOLERANCE...   with METHOD RK45 | DOP853 | LSODA, or DOP853-python (nothing compiled)
"""
import sys
import time
from pathlib import Path

import numpy as np
from numba import njit
from scipy.integrate import solve_ivp

import blade
import transitions
from blade import ANGLE_SCALE, BACKWARD, FORWARD, LIFTED, NAMES, OFFSET, RATE_SCALE, STICK


def phases(f, compile_):
    """Right-hand side and events of each mode, in the form that solve_ivp takes."""
    stick, slip, tip_velocity, limits = f.stick, f.slip, f.tip_velocity, (f.forward_limit, f.backward_limit)

    @compile_
    def stick_rhs(t, y):
        dy = np.empty(4)
        stick(t, y, dy)
        return dy

    def slip_phase(sigma):
        @compile_
        def rhs(t, y):
            dy = np.empty(4)
            slip(t, y, dy, sigma)
            return dy

        @compile_
        def stops(t, y):
            return sigma * tip_velocity(t, y) + OFFSET

        return rhs, [event(stops)]

    return {STICK: (stick_rhs, [event(g) for g in limits]), FORWARD: slip_phase(1.0), BACKWARD: slip_phase(-1.0)}


def event(g):
    def terminal(t, y):  # a function of Python, because compiled ones take no attributes
        return g(t, y)

    terminal.terminal, terminal.direction = True, -1.0
    return terminal


def strokes(f, table, method, tolerance, stop):
    t, y, mode, found = 0.0, np.zeros(4), STICK, []
    absolute = tolerance * np.array([ANGLE_SCALE, ANGLE_SCALE, RATE_SCALE, RATE_SCALE])
    evaluations = steps = 0
    while True:
        rhs, events = table[mode]
        phase = solve_ivp(rhs, (t, stop), y, method=method, rtol=tolerance, atol=absolute, events=events)
        evaluations, steps = evaluations + phase.nfev, steps + len(phase.t) - 1
        if phase.status < 1:
            return found, evaluations, steps, "completed" if phase.status == 0 else "failed"
        which = next(i for i, times in enumerate(phase.t_events) if len(times))
        t, y = phase.t_events[which][0], phase.y_events[which][0].copy()
        f.bring_to_rest(t, y)
        after = (FORWARD if which == 0 else BACKWARD) if mode == STICK else f.mode_at_rest(t, y)
        found.append((t, NAMES[mode], NAMES[after]))
        if after == LIFTED or len(found) > 100_000:
            return found, evaluations, steps, "lifted" if after == LIFTED else "endless"
        mode = after


def main():
    scene, repetitions, folder, method, tolerances = sys.argv[1], int(sys.argv[2]), Path(sys.argv[3]), sys.argv[4], sys.argv[5:]
    k = blade.read(scene)
    np.seterr(all="ignore")  # rejected trial steps may overflow
    interpreted, solver = method.endswith("-python"), method.removesuffix("-python")
    compile_ = (lambda g: g) if interpreted else njit
    f = blade.functions(k, compile_)
    table = phases(f, compile_)
    strokes(f, table, solver, 1e-6, 0.25)  # compiles everything
    for tolerance in tolerances:
        best = float("inf")
        for _ in range(repetitions):
            start = time.perf_counter()
            found, evaluations, steps, status = strokes(f, table, solver, float(tolerance), k.stop)
            best = min(best, time.perf_counter() - start)
        transitions.write(folder / f"scipy-{method}_{tolerance}.csv", found)
        print(f"scipy-{method},{tolerance},{best:.6e},{evaluations},{steps},{status}", flush=True)


main()
