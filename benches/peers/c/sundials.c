/* The scene in SUNDIALS: CVODE (Adams with fixed-point iteration, BDF with Newton's and a dense difference-quotient Jacobian) and ARKODE's
 * explicit Runge-Kutta steppers, with their own rootfinding.
 *
 * One integrator is kept for the whole run and reinitialised after every transition; the mode is user data. Stick keeps all four states
 * under the exact constraint force and what velocity is left at the release is taken out, so nothing drifts. Root functions have a
 * direction. The slip function, the tip velocity, starts at a zero (a double one after a release): it is raised by OFFSET_M_PER_S, so that
 * it starts positive and only its way down counts.
 *
 * Usage: sundials REPETITIONS FOLDER METHOD TOLERANCE... with METHOD adams | bdf | dormand-prince | verner | fehlberg */
#define _GNU_SOURCE
#include "blade.h"
#include <arkode/arkode_erkstep.h>
#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>
#include <time.h>

/* Far above the rounding of a tip velocity (1e-17 m/s) and far below what moves a transition: at 100 m/s2 it is 1e-16 s. */
#define OFFSET_M_PER_S 1e-14
#define ANGLE_SCALE 0.1   /* rad: below it errors are absolute */
#define RATE_SCALE 200.0  /* rad/s: 0.1 rad times the slowest link frequency */
#define MOST_TRANSITIONS 100000
#define MOST_STEPS 100000000L

struct transition {
    double t;
    int from, to;
};

struct run {
    int mode;
    long evaluations;
    int count;
    struct transition list[MOST_TRANSITIONS];
};

static int rhs(double t, N_Vector y, N_Vector dy, void *data)
{
    struct run *run = data;
    right_hand_side(run->mode, t, N_VGetArrayPointer(y), N_VGetArrayPointer(dy));
    run->evaluations++;
    return 0;
}

static int roots(double t, N_Vector y, double *g, void *data)
{
    const struct run *run = data;
    if (run->mode == STICK) stick_limits(t, N_VGetArrayPointer(y), g);
    else g[0] = run->mode * tip_velocity(t, N_VGetArrayPointer(y)) + OFFSET_M_PER_S, g[1] = 1;
    return 0;
}

enum method { ADAMS, BDF, DORMAND_PRINCE, VERNER, FEHLBERG, UNKNOWN };
static const char *const NAMES[] = {"adams", "bdf", "dormand-prince", "verner", "fehlberg"};

struct solver {
    enum method method;
    void *memory;
    N_Vector y, absolute;
};

static int is_cvode(const struct solver *s) { return s->method == ADAMS || s->method == BDF; }

static void check(int flag, const char *what)
{
    if (flag < 0) fprintf(stderr, "%s failed with %d\n", what, flag), exit(1);
}

static struct solver create(enum method method, double tolerance, struct run *run, SUNContext context)
{
    struct solver s = {.method = method, .y = N_VNew_Serial(4, context), .absolute = N_VNew_Serial(4, context)};
    N_VConst(0, s.y);
    const double scales[4] = {ANGLE_SCALE, ANGLE_SCALE, RATE_SCALE, RATE_SCALE};
    for (int i = 0; i < 4; i++) NV_Ith_S(s.absolute, i) = tolerance * scales[i];
    int directions[2] = {-1, -1};
    const SUNMatrix matrix = SUNDenseMatrix(4, 4, context);
    if (is_cvode(&s)) {
        s.memory = CVodeCreate(method == ADAMS ? CV_ADAMS : CV_BDF, context);
        check(CVodeInit(s.memory, rhs, 0, s.y), "CVodeInit");
        check(CVodeSVtolerances(s.memory, tolerance, s.absolute), "tolerances");
        check(CVodeSetUserData(s.memory, run), "user data");
        if (method == ADAMS) check(CVodeSetNonlinearSolver(s.memory, SUNNonlinSol_FixedPoint(s.y, 0, context)), "fixed point");
        else check(CVodeSetLinearSolver(s.memory, SUNLinSol_Dense(s.y, matrix, context), matrix), "Newton");
        check(CVodeRootInit(s.memory, 2, roots), "roots");
        check(CVodeSetRootDirection(s.memory, directions), "directions");
        check(CVodeSetNoInactiveRootWarn(s.memory), "warnings");
        check(CVodeSetMaxNumSteps(s.memory, MOST_STEPS), "steps");
        check(CVodeSetStopTime(s.memory, STOP_S), "stop");
        return s;
    }
    s.memory = ERKStepCreate(rhs, 0, s.y, context);
    check(ERKStepSVtolerances(s.memory, tolerance, s.absolute), "tolerances");
    check(ERKStepSetUserData(s.memory, run), "user data");
    const ARKODE_ERKTableID table =
        method == DORMAND_PRINCE ? ARKODE_DORMAND_PRINCE_7_4_5 : method == VERNER ? ARKODE_VERNER_8_5_6 : ARKODE_FEHLBERG_13_7_8;
    check(ERKStepSetTableNum(s.memory, table), "table");
    check(ERKStepRootInit(s.memory, 2, roots), "roots");
    check(ERKStepSetRootDirection(s.memory, directions), "directions");
    check(ERKStepSetNoInactiveRootWarn(s.memory), "warnings");
    check(ERKStepSetMaxNumSteps(s.memory, MOST_STEPS), "steps");
    check(ERKStepSetStopTime(s.memory, STOP_S), "stop");
    return s;
}

/* Integrates to the next root or the stop time; tells whether it was a root, and which. */
static int advance(struct solver *s, double *t, int *root)
{
    int found[2] = {0, 0}, flag;
    if (is_cvode(s)) {
        flag = CVode(s->memory, STOP_S, s->y, t, CV_NORMAL);
        if (flag == CV_ROOT_RETURN) CVodeGetRootInfo(s->memory, found);
        else check(flag, "CVode");
        *root = found[0] ? 0 : 1;
        return flag == CV_ROOT_RETURN;
    }
    flag = ERKStepEvolve(s->memory, STOP_S, s->y, t, ARK_NORMAL);
    if (flag == ARK_ROOT_RETURN) ERKStepGetRootInfo(s->memory, found);
    else check(flag, "ERKStepEvolve");
    *root = found[0] ? 0 : 1;
    return flag == ARK_ROOT_RETURN;
}

static void restart(struct solver *s, double t)
{
    if (is_cvode(s)) {
        check(CVodeReInit(s->memory, t, s->y), "CVodeReInit");
        check(CVodeSetStopTime(s->memory, STOP_S), "stop");
    } else {
        check(ERKStepReInit(s->memory, rhs, t, s->y), "ERKStepReInit");
        check(ERKStepSetStopTime(s->memory, STOP_S), "stop");
    }
}

static long steps_of(struct solver *s)
{
    long steps = 0;
    if (is_cvode(s)) CVodeGetNumSteps(s->memory, &steps);
    else ERKStepGetNumSteps(s->memory, &steps);
    return steps;
}

static const char *strokes(struct solver *s, struct run *run, long *steps)
{
    double t = 0, *y = N_VGetArrayPointer(s->y);
    int root;
    run->mode = STICK, run->count = 0, run->evaluations = 0, *steps = 0;
    memset(y, 0, 4 * sizeof *y);
    restart(s, 0);
    while (advance(s, &t, &root)) {
        const int from = run->mode;
        *steps += steps_of(s);
        bring_to_rest(t, y);
        run->mode = from == STICK ? (root == 0 ? FORWARD : BACKWARD) : mode_at_rest(t, y);
        if (run->count == MOST_TRANSITIONS) return "endless";
        run->list[run->count++] = (struct transition){t, from, run->mode};
        if (run->mode == LIFTED) return "lifted";
        restart(s, t);
    }
    *steps += steps_of(s);
    return "completed";
}

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

static void measure(enum method method, const char *tolerance, int repetitions, const char *folder, SUNContext context)
{
    static struct run run;
    double best = 1e300;
    long steps = 0;
    const char *status = "";
    struct solver s = create(method, atof(tolerance), &run, context);
    for (int i = 0; i < repetitions; i++) {
        const double start = now();
        status = strokes(&s, &run, &steps);
        const double wall = now() - start;
        best = wall < best ? wall : best;
    }
    char path[4096];
    snprintf(path, sizeof path, "%s/sundials-%s_%s.csv", folder, NAMES[method], tolerance);
    FILE *file = fopen(path, "w");
    if (!file) perror(path), exit(1);
    fprintf(file, "time_s,from,to\n");
    for (int i = 0; i < run.count; i++) fprintf(file, "%.17g,%s,%s\n", run.list[i].t, mode_name(run.list[i].from), mode_name(run.list[i].to));
    fclose(file);
    printf("sundials-%s,%s,%.6e,%ld,%ld,%s\n", NAMES[method], tolerance, best, run.evaluations, steps, status);
    fflush(stdout);
}

int main(int argc, char **argv)
{
    if (argc < 5) return fprintf(stderr, "usage: sundials REPETITIONS FOLDER METHOD TOLERANCE...\n"), 2;
    enum method method = ADAMS;
    while (method < UNKNOWN && strcmp(NAMES[method], argv[3])) method++;
    if (method == UNKNOWN) return fprintf(stderr, "unknown method %s\n", argv[3]), 2;
    blade_init();
    SUNContext context;
    check(SUNContext_Create(NULL, &context), "context");
    for (int i = 4; i < argc; i++) measure(method, argv[i], atoi(argv[1]), argv[2], context);
    return 0;
}
