/* The wiper blade of the light-blade scene as every C program of this comparison sees it: equations (1) to (3) with friction (4), (5).
 *
 * Letters are the paper's: theta, phi the angles of neck and lip, y = (theta, phi, theta', phi'), v(t) the head, v3 the lip tip. With the
 * normal force eliminated, A q'' + b = f w and N = n.q'' + N0; `contact_at` solves that for the motion without friction and per newton of it.
 *
 * `real` is double, or __float128 for the reference. The numbers come from scene.h, which `run` writes from the scene file. */
#ifndef BLADE_H
#define BLADE_H


#ifdef QUAD
#define NUMBER(x) x##Q
#include <quadmath.h>
typedef __float128 real;
#define sin_ sinq
#define cos_ cosq
#define exp_ expq
#define sqrt_ sqrtq
#define fabs_ fabsq
#define sincos_ sincosq
#define PI_ M_PIq
#else
#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include <math.h>
#define NUMBER(x) x
typedef double real;
#define sin_ sin
#define cos_ cos
#define exp_ exp
#define sqrt_ sqrt
#define fabs_ fabs
#define sincos_ sincos
#define PI_ M_PI
#endif

#include "scene.h"

enum mode { BACKWARD = -1, STICK = 0, FORWARD = 1, LIFTED = 2 };

/* Constants of the blade and the combinations that the equations use. */
static struct {
    real l1, l2, ma, mb, mc, mth, mph;
    real arm1, arm2;      /* m_a - M l1, m_b - M l2 */
    real s11, s22, s12;   /* coefficients of sin^2 and sin sin in A */
    real mal1, mal2, mbl1, mbl2;
    real k0, c0, hd, k1, c1, k2, c2;
    real a, b, c, rest;   /* friction; rest = a + c */
    real amplitude, omega;
} B;

static void blade_init(void)
{
    const real M = HEAD_MASS_KG + NECK_MASS_KG + LIP_MASS_KG;
    const real turn = 2 * PI_;
    const real l1 = NECK_LENGTH_M, l2 = LIP_LENGTH_M, g1 = NECK_CENTRE_M, g2 = LIP_CENTRE_M, m1 = NECK_MASS_KG, m2 = LIP_MASS_KG;
    B.l1 = l1, B.l2 = l2;
    B.ma = m1 * g1 + m2 * l1, B.mb = m2 * g2, B.mc = m2 * l1 * g2;
    B.mth = NECK_INERTIA_KG_M2 + m1 * g1 * g1 + m2 * l1 * l1, B.mph = LIP_INERTIA_KG_M2 + m2 * g2 * g2;
    B.arm1 = B.ma - M * l1, B.arm2 = B.mb - M * l2;
    B.s11 = l1 * (M * l1 - 2 * B.ma), B.s22 = l2 * (M * l2 - 2 * B.mb), B.s12 = M * l1 * l2 - B.ma * l2 - B.mb * l1;
    B.mal1 = B.ma * l1, B.mal2 = B.ma * l2, B.mbl1 = B.mb * l1, B.mbl2 = B.mb * l2;
    const real w0 = turn * HEAD_NATURAL_FREQUENCY_HZ, w1 = turn * NECK_NATURAL_FREQUENCY_HZ, w2 = turn * LIP_NATURAL_FREQUENCY_HZ;
    B.k0 = M * w0 * w0, B.k1 = B.mth * w1 * w1, B.k2 = B.mph * w2 * w2;
    B.c0 = 2 * HEAD_DAMPING_RATIO * sqrt_(B.k0 * M), B.c1 = 2 * NECK_DAMPING_RATIO * sqrt_(B.k1 * B.mth);
    B.c2 = 2 * LIP_DAMPING_RATIO * sqrt_(B.k2 * B.mph);
    B.hd = PRELOAD_FORCE_N / B.k0;
    B.a = FRICTION_A, B.b = FRICTION_B_S_PER_M, B.c = FRICTION_C, B.rest = B.a + B.c;
    B.amplitude = AMPLITUDE_M, B.omega = turn * FREQUENCY_HZ;
}

/* q'' = free + f per, v3'' = a_free + kappa f, N = n_free + nu f; `speed` is v3'. */
struct contact {
    real free1, free2, per1, per2, a_free, kappa, n_free, nu, speed;
};

static inline struct contact contact_at(real t, const real *y)
{
    real st, ct, sp, cp, sw, cw;
    sincos_(y[0], &st, &ct);
    sincos_(y[1], &sp, &cp);
    sincos_(B.omega * t, &sw, &cw);
    const real dt = y[2], dp = y[3], dt2 = dt * dt, dp2 = dp * dp;
    const real head_speed = B.amplitude * B.omega * sw, head_acceleration = B.amplitude * B.omega * B.omega * cw;

    const real drop = B.l1 * (1 - ct) + B.l2 * (1 - cp), drop_rate = B.l1 * st * dt + B.l2 * sp * dp;
    const real n0 = B.arm1 * ct * dt2 + B.arm2 * cp * dp2 - B.k0 * (drop - B.hd) - B.c0 * drop_rate;
    const real a11 = B.mth + B.s11 * st * st, a22 = B.mph + B.s22 * sp * sp;
    const real a12 = B.mc * (ct * cp + st * sp) + B.s12 * st * sp;
    const real lip = B.k2 * (y[1] - y[0]) + B.c2 * (dp - dt), neck = B.k1 * y[0] + B.c1 * dt;
    const real sd = B.mc * (st * cp - ct * sp);
    const real b1 = -B.mal1 * ct * st * dt2 + (sd - B.mal2 * cp * st) * dp2 + B.ma * head_acceleration * ct - lip + neck - n0 * B.l1 * st;
    const real b2 = -(sd + B.mbl1 * ct * sp) * dt2 - B.mbl2 * cp * sp * dp2 + B.mb * head_acceleration * cp + lip - n0 * B.l2 * sp;

    const real inverse = 1 / (a11 * a22 - a12 * a12), w1 = B.l1 * ct, w2 = B.l2 * cp, n1 = B.arm1 * st, n2 = B.arm2 * sp;
    struct contact c;
    c.free1 = inverse * (a12 * b2 - a22 * b1), c.free2 = inverse * (a12 * b1 - a11 * b2);
    c.per1 = inverse * (a22 * w1 - a12 * w2), c.per2 = inverse * (a11 * w2 - a12 * w1);
    c.a_free = head_acceleration - B.l1 * st * dt2 - B.l2 * sp * dp2 + w1 * c.free1 + w2 * c.free2;
    c.kappa = w1 * c.per1 + w2 * c.per2;
    c.n_free = n0 + n1 * c.free1 + n2 * c.free2;
    c.nu = n1 * c.per1 + n2 * c.per2;
    c.speed = head_speed + w1 * dt + w2 * dp;
    return c;
}

/* v3', m/s */
static inline real tip_velocity(real t, const real *y)
{
    return B.amplitude * B.omega * sin_(B.omega * t) + B.l1 * cos_(y[0]) * y[2] + B.l2 * cos_(y[1]) * y[3];
}

static inline real holding_force(const struct contact *c) { return -c->a_free / c->kappa; }

/* Friction of slip in the direction sigma: f = -sigma mu N, N = n_free / (1 + sigma mu nu). */
static inline real sliding_force(const struct contact *c, real sigma)
{
    const real mu = sigma * (B.a * exp_(-B.b * sigma * c->speed) + B.c);
    return -mu * c->n_free / (1 + mu * c->nu);
}

static inline void accelerate(const struct contact *c, real f, const real *y, real *dy)
{
    dy[0] = y[2], dy[1] = y[3];
    dy[2] = c->free1 + f * c->per1, dy[3] = c->free2 + f * c->per2;
}

/* Stick is held by the exact constraint force, so the tip's acceleration is zero and its velocity keeps what it starts with. */
static inline void right_hand_side(int mode, real t, const real *y, real *dy)
{
    const struct contact c = contact_at(t, y);
    accelerate(&c, mode == STICK ? holding_force(&c) : sliding_force(&c, mode), y, dy);
}

/* Distances of the holding force from the limits (A + C) N of slip forward and backward. */
static inline void stick_limits(real t, const real *y, real *g)
{
    const struct contact c = contact_at(t, y);
    const real f = holding_force(&c), limit = B.rest * (c.n_free + c.nu * f);
    g[0] = limit + f, g[1] = limit - f;
}

/* Takes what is left of the tip's velocity out of the rates by an impulse on the tip. */
static inline void bring_to_rest(real t, real *y)
{
    const struct contact c = contact_at(t, y);
    const real impulse = -c.speed / c.kappa;
    y[2] += impulse * c.per1, y[3] += impulse * c.per2;
}

/* What follows with the tip at rest (outside the Painlevé region, which this scene never enters). */
static inline int mode_at_rest(real t, const real *y)
{
    const struct contact c = contact_at(t, y);
    const real f = holding_force(&c), n = c.n_free + c.nu * f;
    if (n > 0 && fabs_(f) <= B.rest * n) return STICK;
    if (c.n_free <= 0) return LIFTED;
    return f < 0 ? FORWARD : BACKWARD;
}

static inline const char *mode_name(int mode) { return mode == STICK ? "stick" : mode == FORWARD ? "slip+" : mode == BACKWARD ? "slip-" : "flight"; }

#endif
