"""The scene in heyoka: Taylor series of the order that the tolerance asks for, terminal events with a direction.

One integrator for stick and one for slip (the direction of slip is a parameter), both compiled before the clock starts. Stick keeps all
four states under the exact constraint force; what tip velocity is left at a transition is taken out. The slip event starts at a zero (a
double one after a release) and is raised by blade.OFFSET, so that it starts positive and only its way down counts.
Between transitions everything runs in heyoka's compiled code. What Python costs at a transition is measured apart, by as many calls that
integrate over no time, and `heyoka-without-python` is the time less that: what a program in C++ could reach.

usage: heyoka_peer.py SCENE.toml REPETITIONS FOLDER TOLERANCE...
"""
import sys
import time
from pathlib import Path

import heyoka as hy
import numpy as np
from numba import njit

import blade
import transitions
from blade import BACKWARD, FORWARD, LIFTED, NAMES, OFFSET, STICK


def systems(k):
    """Equations and event functions of stick and of slip, as expressions."""
    y = hy.make_vars("theta", "phi", "theta_rate", "phi_rate")
    f1, f2, p1, p2, a_free, kappa, n_free, nu, speed = blade.contact_of(k, hy)(hy.time, y)
    hold = -a_free / kappa
    limit = (k.a + k.c) * (n_free + nu * hold)
    sigma = hy.par[0]
    mu = sigma * (k.a * hy.exp(-k.b * (sigma * speed)) + k.c)
    slide = -mu * n_free / (1.0 + mu * nu)

    def equations(f):
        return list(zip(y, [y[2], y[3], f1 + f * p1, f2 + f * p2]))

    return (equations(hold), [limit + hold, limit - hold]), (equations(slide), [sigma * speed + OFFSET])


def integrator(system, tolerance):
    equations, guards = system
    events = [hy.t_event(g, direction=hy.event_direction.negative) for g in guards]
    return hy.taylor_adaptive(equations, [0.0] * 4, tol=tolerance, t_events=events, compact_mode=False)


class Run:
    def __init__(self, stick, slip, f, stop):
        self.stick, self.slip, self.f, self.stop = stick, slip, f, stop

    def strokes(self):
        stick, slip, stop, bring_to_rest, mode_at_rest = self.stick, self.slip, self.stop, self.f.bring_to_rest, self.f.mode_at_rest
        views = {STICK: (stick, stick.state), FORWARD: (slip, slip.state), BACKWARD: (slip, slip.state)}
        sign = slip.pars
        mode, found, steps = STICK, [], 0
        stick.time, views[STICK][1][:] = 0.0, 0.0
        while True:
            ta, y = views[mode]
            outcome = ta.propagate_until(stop)
            steps += outcome[3]
            event = -int(outcome[0]) - 1
            t = ta.time
            if not 0 <= event < 2:
                return found, steps, "completed" if outcome[0] == hy.taylor_outcome.time_limit else "failed"
            bring_to_rest(t, y)
            after = (FORWARD if event == 0 else BACKWARD) if mode == STICK else mode_at_rest(t, y)
            found.append((t, mode, after))
            if after == LIFTED or len(found) > 100_000:
                return found, steps, "lifted" if after == LIFTED else "endless"
            mode, (ta, there) = after, views[after]
            there[:], ta.time = y, t
            if after != STICK:
                sign[0] = after
            ta.reset_cooldowns()


def python_cost(run, transitions):
    """Seconds that as many transitions cost without integration: the call, the copy of the state, the decision."""
    ta, y, found = run.slip, run.slip.state, []
    there = run.stick.state
    start = time.perf_counter()
    for _ in range(transitions):
        outcome = ta.propagate_until(ta.time)
        event = -int(outcome[0]) - 1
        t = ta.time
        run.f.bring_to_rest(t, y)
        run.f.mode_at_rest(t, y)
        found.append((t, event, event))
        there[:], ta.time = y, t
        run.slip.pars[0] = 1.0
        ta.reset_cooldowns()
    return time.perf_counter() - start


def main():
    scene, repetitions, folder, tolerances = sys.argv[1], int(sys.argv[2]), Path(sys.argv[3]), sys.argv[4:]
    k = blade.read(scene)
    f = blade.functions(k, njit)
    f.bring_to_rest(0.0, np.zeros(4)), f.mode_at_rest(0.0, np.zeros(4))
    stick_system, slip_system = systems(k)
    for tolerance in tolerances:
        run = Run(integrator(stick_system, float(tolerance)), integrator(slip_system, float(tolerance)), f, k.stop)
        best = float("inf")
        for _ in range(repetitions):
            start = time.perf_counter()
            found, steps, status = run.strokes()
            best = min(best, time.perf_counter() - start)
        python = min(python_cost(run, len(found)) for _ in range(repetitions))
        for name, wall in (("heyoka", best), ("heyoka-without-python", best - python)):
            transitions.write(folder / f"{name}_{tolerance}.csv", [(t, NAMES[a], NAMES[b]) for t, a, b in found])
            print(f"{name},{tolerance},{wall:.6e},,{steps},{status}", flush=True)


main()
