/* The transitions of the scene to about 20 digits: the list against which every error is measured.
 *
 * Arithmetic of 113 bits, Gragg-Bulirsch-Stoer extrapolation of the modified midpoint rule (Hairer, Norsett, Wanner, section II.9: it
 * needs no table of coefficients) with fixed steps, each phase begun afresh. Stick in minimal coordinates (neck angle and rate; the lip
 * follows from the tip's place), slip with all four states. A transition is looked for at the end of every step and, where a guard's
 * slope turns upwards inside a step, at the guard's minimum; it is then located by taking the step again up to the trial time.
 *
 * Usage: reference STEP_S STAGES > transitions.csv. The step and the number of extrapolation stages bound the error: the list is
 * compared with that of another step and another number of stages: see the README. */
#define QUAD
#include "../c/blade.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MOST_STAGES 16

static int stages;
static int mode;
static real place; /* where stick holds the tip */
static long evaluations;

static real head_position(real t) { return B.amplitude * (1 - cos_(B.omega * t)); }

/* All four states from those that are integrated: in stick (theta, theta'). */
static void full_state(real t, const real *x, real *y)
{
    if (mode != STICK) {
        memcpy(y, x, 4 * sizeof *y);
        return;
    }
    const real sp = (place - head_position(t) - B.l1 * sin_(x[0])) / B.l2;
    y[0] = x[0], y[2] = x[1], y[1] = asinq(sp);
    y[3] = -(B.amplitude * B.omega * sin_(B.omega * t) + B.l1 * cos_(x[0]) * x[1]) / (B.l2 * sqrt_(1 - sp * sp));
}

static int count(void) { return mode == STICK ? 2 : 4; }

static void derivative(real t, const real *x, real *dx)
{
    real y[4], dy[4];
    full_state(t, x, y);
    right_hand_side(mode, t, y, dy);
    evaluations++;
    if (mode == STICK) dx[0] = dy[0], dx[1] = dy[2];
    else memcpy(dx, dy, sizeof dy);
}

static void midpoint(real t, const real *x, const real *dx, real h, int n, real *out)
{
    real before[4], here[4], slope[4], d = h / n;
    for (int i = 0; i < count(); i++) before[i] = x[i], here[i] = x[i] + d * dx[i];
    for (int k = 1; k < n; k++) {
        derivative(t + k * d, here, slope);
        for (int i = 0; i < count(); i++) {
            const real next = before[i] + 2 * d * slope[i];
            before[i] = here[i], here[i] = next;
        }
    }
    derivative(t + h, here, slope); /* Gragg's smoothing */
    for (int i = 0; i < count(); i++) out[i] = (before[i] + here[i] + d * slope[i]) / 2;
}

/* One extrapolated step; `change` receives the size of the last correction. */
static void step(real t, const real *x, real h, real *out, real *change)
{
    real table[MOST_STAGES][4], dx[4];
    derivative(t, x, dx);
    *change = 0;
    for (int j = 0; j < stages; j++) {
        real row[4];
        midpoint(t, x, dx, h, 2 * (j + 1), row);
        for (int k = 0; k < j; k++) {
            const real ratio = (real)(j + 1) / (j - k), factor = 1 / (ratio * ratio - 1);
            for (int i = 0; i < count(); i++) {
                const real better = row[i] + (row[i] - table[k][i]) * factor;
                table[k][i] = row[i], row[i] = better;
            }
        }
        if (j == stages - 1)
            for (int i = 0; i < count(); i++) *change = fmaxq(*change, fabs_(row[i] - table[j - 1][i]));
        for (int i = 0; i < 4; i++) table[j][i] = i < count() ? row[i] : 0;
        memcpy(out, table[j], 4 * sizeof *out);
    }
}

/* Guards of the mode: tip velocity in the direction of slip, or both limits of stick. */
static int guards(real t, const real *x, real *g)
{
    real y[4];
    full_state(t, x, y);
    if (mode == STICK) {
        stick_limits(t, y, g);
        return 2;
    }
    g[0] = mode * tip_velocity(t, y);
    return 1;
}

static void slopes(real t, const real *x, real *g)
{
    const real d = 1e-12Q;
    real dx[4], ahead[4], there[2];
    derivative(t, x, dx);
    for (int i = 0; i < count(); i++) ahead[i] = x[i] + d * dx[i];
    const int n = guards(t, x, g);
    guards(t + d, ahead, there);
    for (int i = 0; i < n; i++) g[i] = (there[i] - g[i]) / d;
}

/* Newton's iteration with bisection as a guard on the length of the step; a root below 1e-26 s is as good as exact. */
static real locate(real t, const real *x, int guard, real low, real high, real *end)
{
    real h = (low + high) / 2, change;
    for (int round = 0; round < 200 && high - low > 1e-27Q; round++) {
        real g[2], dg[2];
        step(t, x, h, end, &change);
        guards(t + h, end, g);
        if (g[guard] > 0) low = h;
        else high = h;
        slopes(t + h, end, dg);
        real next = h - g[guard] / dg[guard];
        if (fabs_(next - h) < 1e-26Q) break;
        h = next > low && next < high ? next : (low + high) / 2;
    }
    step(t, x, h, end, &change);
    return h;
}

/* Where a guard that turns upwards inside a step is least. */
static real least(real t, const real *x, int guard, real high)
{
    real low = 0, end[4], change, dg[2];
    for (int round = 0; round < 60; round++) {
        const real middle = (low + high) / 2;
        step(t, x, middle, end, &change);
        slopes(t + middle, end, dg);
        if (dg[guard] < 0) low = middle;
        else high = middle;
    }
    return high;
}

int main(int argc, char **argv)
{
    if (argc != 3) return fprintf(stderr, "usage: reference STEP_S STAGES\n"), 2;
    const real h_full = strtoflt128(argv[1], 0), stop = STOP_S;
    stages = atoi(argv[2]);
    blade_init();
    real t = 0, x[4] = {0}, worst_change = 0, closest = 1; /* m/s, more than any tip velocity near rest */
    int begun = 1; /* the guard of a slip phase starts at zero, so its first step is only judged by its end */
    mode = STICK, place = 0;
    printf("time_s,from,to\n");
    while (t < stop) {
        const real h = stop - t < h_full ? stop - t : h_full;
        real end[4], change, g[2], g_start[2], d_start[2], d_end[2];
        step(t, x, h, end, &change);
        worst_change = fmaxq(worst_change, change);
        const int n = guards(t + h, end, g);
        guards(t, x, g_start), slopes(t, x, d_start), slopes(t + h, end, d_end);
        int hit = -1;
        real when = 0;
        for (int i = 0; i < n; i++) {
            real high = h;
            int falls = g[i] <= 0;
            if (!falls && !begun && d_start[i] < 0 && d_end[i] > 0) { /* turns upwards inside */
                real at[4], value[2], ignored;
                high = least(t, x, i, h);
                step(t, x, high, at, &ignored);
                guards(t + high, at, value);
                falls = value[i] <= 0;
                if (mode != STICK) closest = fminq(closest, fabs_(value[i]));
            }
            if (!falls) continue;
            real at[4];
            const real found = locate(t, x, i, 0, high, at);
            if (hit < 0 || found < when) hit = i, when = found, memcpy(end, at, sizeof at);
        }
        if (hit < 0) {
            t += h, begun = 0, memcpy(x, end, sizeof x);
            continue;
        }
        t += when;
        const int from = mode;
        real y[4];
        full_state(t, end, y);
        if (from == STICK) mode = hit == 0 ? FORWARD : BACKWARD;
        else bring_to_rest(t, y), mode = mode_at_rest(t, y);
        if (mode == STICK) place = head_position(t) + B.l1 * sin_(y[0]) + B.l2 * sin_(y[1]), x[0] = y[0], x[1] = y[2];
        else memcpy(x, y, sizeof x);
        begun = 1;
        char text[64];
        quadmath_snprintf(text, sizeof text, "%.25Qf", t);
        printf("%s,%s,%s\n", text, mode_name(from), mode_name(mode));
        if (mode == LIFTED) return 3;
    }
    fprintf(stderr, "%ld evaluations, largest last correction of an extrapolation %.1e", evaluations, (double)worst_change);
    if (closest < 1) fprintf(stderr, ", a slip turned back %.1e m/s short of rest or past it", (double)closest);
    fprintf(stderr, "\n");
    return 0;
}
