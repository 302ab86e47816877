"""Fits a slider to a record of head and slider with SciPy: least squares over runs in which tanh smooths friction.

python slider_fit.py RECORD.csv MASS_KG prints friction, stiffness, damping, residual and time. The columns of the
record are time, position of the slider and position of the head, in SI units.
"""

import sys
import time

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import make_smoothing_spline
from scipy.optimize import least_squares

SMOOTH_M_PER_S = 1e-3  # speed at which the smoothed friction is 76 % of its level
START = [0.7, 600.0, 5.0]  # N, N/m, N s/m: the stiffness is off by a factor of two
SEGMENT_S = 0.512  # as long as the longest segments of wiperlab, each with its own start


def main():
    table = np.loadtxt(sys.argv[1], delimiter=",", skiprows=1)
    mass = float(sys.argv[2])
    times, tip, head = table[:, 0], table[:, 1], table[:, 2]
    curves = [make_smoothing_spline(times, x, lam=1e-9) for x in (tip, head)]
    speeds = [curve.derivative() for curve in curves]
    step = round(SEGMENT_S / (times[1] - times[0]))
    starts = range(0, len(times) - step + 1, step)

    def residuals(z):
        friction, stiffness, damping = np.exp(z[:3])
        offset = 1e-4 * (z[3] - 1)

        def rate(t, s):
            pull = stiffness * (curves[1](t) - s[0]) + damping * (speeds[1](t) - s[1])
            return [s[1], (pull - friction * np.tanh(s[1] / SMOOTH_M_PER_S)) / mass]

        parts = []
        for k, first in enumerate(starts):
            seen = slice(first, first + step)
            begin = [tip[first] - offset + 1e-5 * (z[4 + 2 * k] - 1), speeds[0](times[first]) + 1e-3 * (z[5 + 2 * k] - 1)]
            run = solve_ivp(rate, (times[first], times[first + step - 1]), begin, "LSODA", times[seen], rtol=1e-8, atol=1e-11)
            parts.append(1e6 * (run.y[0] + offset - tip[seen]))
        return np.concatenate(parts)

    # the states at the start of a segment change the residuals of this segment alone
    count = 4 + 2 * len(starts)
    pattern = np.zeros((step * len(starts), count))
    pattern[:, :4] = 1
    for k in range(len(starts)):
        pattern[k * step : (k + 1) * step, 4 + 2 * k : 6 + 2 * k] = 1
    begun = time.perf_counter()
    first = np.concatenate([np.log(START), np.ones(count - 3)])  # differences are relative steps
    found = least_squares(residuals, first, jac_sparsity=pattern, diff_step=1e-3, max_nfev=60)
    friction, stiffness, damping = np.exp(found.x[:3])
    rms = np.sqrt(np.mean(found.fun**2))
    print(
        f"friction {friction:.4f} N, stiffness {stiffness:.1f} N/m, damping {damping:.2f} N s/m, residual {rms:.1f} um, "
        f"{found.nfev} steps, {time.perf_counter() - begun:.0f} s"
    )


if __name__ == "__main__":
    main()
