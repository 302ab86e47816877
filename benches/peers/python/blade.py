"""The blade of the scene as the Python programs see it: the same equations as c/blade.h, which see for the notation."""
import math
import tomllib
from collections import namedtuple
from types import SimpleNamespace

ANGLE_SCALE, RATE_SCALE = 0.1, 200.0  # rad and rad/s below which errors are absolute
OFFSET = 1e-14  # m/s by which the slip event is raised: it starts at a zero, and only its way down counts
LARGEST = 50.0  # of the exponent of friction, far from any motion: a rejected trial step must not overflow, which Python raises as an error
STICK, FORWARD, BACKWARD, LIFTED = 0, 1, -1, 2
NAMES = {STICK: "stick", FORWARD: "slip+", BACKWARD: "slip-", LIFTED: "flight"}


def constants(scene):
    """Constants of the blade, with the letters of the paper."""
    b, f, d = scene["blade"], scene["friction"], scene["drive"]
    m1, m2 = b["neck_mass_kg"], b["lip_mass_kg"]
    mass = b["head_mass_kg"] + m1 + m2
    l1, l2, g1, g2 = b["neck_length_m"], b["lip_length_m"], b["neck_centre_m"], b["lip_centre_m"]
    ma, mb, mc = m1 * g1 + m2 * l1, m2 * g2, m2 * l1 * g2
    mth, mph = b["neck_inertia_kg_m2"] + m1 * g1**2 + m2 * l1**2, b["lip_inertia_kg_m2"] + m2 * g2**2
    k0, k1, k2 = (i * (2 * math.pi * b[f"{n}_natural_frequency_hz"]) ** 2 for i, n in ((mass, "head"), (mth, "neck"), (mph, "lip")))
    c0, c1, c2 = (2 * b[f"{n}_damping_ratio"] * math.sqrt(k * i) for n, k, i in (("head", k0, mass), ("neck", k1, mth), ("lip", k2, mph)))
    values = dict(
        l1=l1, l2=l2, ma=ma, mb=mb, mc=mc, mth=mth, mph=mph, arm1=ma - mass * l1, arm2=mb - mass * l2,
        s11=l1 * (mass * l1 - 2 * ma), s22=l2 * (mass * l2 - 2 * mb), s12=mass * l1 * l2 - ma * l2 - mb * l1,
        k0=k0, c0=c0, hd=b["preload_force_n"] / k0, k1=k1, c1=c1, k2=k2, c2=c2,
        a=f["a"], b=f["b_s_per_m"], c=f["c"], amplitude=d["amplitude_m"], omega=2 * math.pi * d["frequency_hz"], stop=scene["run"]["stop_s"],
    )  # fmt: skip
    return namedtuple("Constants", values)(**values)  # a form that numba compiles into numbers


def read(path):
    with open(path, "rb") as file:
        return constants(tomllib.load(file))


def contact_of(k, m):
    """The function that answers (t, y) with q'' = free + f per, v3'' = a_free + kappa f, N = n_free + nu f, and v3'.

    `m` supplies sin and cos: of numbers (math) or of expressions (heyoka).
    """

    def contact(t, y):
        st, ct, sp, cp = m.sin(y[0]), m.cos(y[0]), m.sin(y[1]), m.cos(y[1])
        sw, cw = m.sin(k.omega * t), m.cos(k.omega * t)
        dt, dp = y[2], y[3]
        dt2, dp2 = dt * dt, dp * dp
        speed, acceleration = k.amplitude * k.omega * sw, k.amplitude * k.omega**2 * cw
        drop, drop_rate = k.l1 * (1 - ct) + k.l2 * (1 - cp), k.l1 * st * dt + k.l2 * sp * dp
        n0 = k.arm1 * ct * dt2 + k.arm2 * cp * dp2 - k.k0 * (drop - k.hd) - k.c0 * drop_rate
        a11, a22 = k.mth + k.s11 * st * st, k.mph + k.s22 * sp * sp
        a12 = k.mc * (ct * cp + st * sp) + k.s12 * st * sp
        lip, neck = k.k2 * (y[1] - y[0]) + k.c2 * (dp - dt), k.k1 * y[0] + k.c1 * dt
        sd = k.mc * (st * cp - ct * sp)
        b1 = -k.ma * k.l1 * ct * st * dt2 + (sd - k.ma * k.l2 * cp * st) * dp2 + k.ma * acceleration * ct - lip + neck - n0 * k.l1 * st
        b2 = -(sd + k.mb * k.l1 * ct * sp) * dt2 - k.mb * k.l2 * cp * sp * dp2 + k.mb * acceleration * cp + lip - n0 * k.l2 * sp
        inverse, w1, w2, n1, n2 = 1.0 / (a11 * a22 - a12 * a12), k.l1 * ct, k.l2 * cp, k.arm1 * st, k.arm2 * sp
        free1, free2 = inverse * (a12 * b2 - a22 * b1), inverse * (a12 * b1 - a11 * b2)
        per1, per2 = inverse * (a22 * w1 - a12 * w2), inverse * (a11 * w2 - a12 * w1)
        a_free = acceleration - k.l1 * st * dt2 - k.l2 * sp * dp2 + w1 * free1 + w2 * free2
        return free1, free2, per1, per2, a_free, w1 * per1 + w2 * per2, n0 + n1 * free1 + n2 * free2, n1 * per1 + n2 * per2, speed + w1 * dt + w2 * dp

    return contact


def functions(k, compile_):
    """The functions of c/blade.h for a blade; `compile_` is numba's njit, or leaves them to the interpreter."""
    contact = compile_(contact_of(k, math))
    a, b, c, rest = k.a, k.b, k.c, k.a + k.c
    amplitude_omega, omega, l1, l2 = k.amplitude * k.omega, k.omega, k.l1, k.l2

    @compile_
    def stick(t, y, dy):
        f1, f2, p1, p2, a_free, kappa, _, _, _ = contact(t, y)
        f = -a_free / kappa
        dy[0], dy[1], dy[2], dy[3] = y[2], y[3], f1 + f * p1, f2 + f * p2

    @compile_
    def slip(t, y, dy, sigma):
        f1, f2, p1, p2, _, _, n_free, nu, speed = contact(t, y)
        mu = sigma * (a * math.exp(min(-b * sigma * speed, LARGEST)) + c)
        f = -mu * n_free / (1 + mu * nu)
        dy[0], dy[1], dy[2], dy[3] = y[2], y[3], f1 + f * p1, f2 + f * p2

    @compile_
    def forward_limit(t, y):
        _, _, _, _, a_free, kappa, n_free, nu, _ = contact(t, y)
        f = -a_free / kappa
        return rest * (n_free + nu * f) + f

    @compile_
    def backward_limit(t, y):
        _, _, _, _, a_free, kappa, n_free, nu, _ = contact(t, y)
        f = -a_free / kappa
        return rest * (n_free + nu * f) - f

    @compile_
    def tip_velocity(t, y):
        return amplitude_omega * math.sin(omega * t) + l1 * math.cos(y[0]) * y[2] + l2 * math.cos(y[1]) * y[3]

    @compile_
    def bring_to_rest(t, y):
        _, _, p1, p2, _, kappa, _, _, speed = contact(t, y)
        impulse = -speed / kappa
        y[2] += impulse * p1
        y[3] += impulse * p2

    @compile_
    def mode_at_rest(t, y):
        _, _, _, _, a_free, kappa, n_free, nu, _ = contact(t, y)
        f = -a_free / kappa
        n = n_free + nu * f
        if n > 0 and abs(f) <= rest * n:
            return STICK
        if n_free <= 0:
            return LIFTED
        return FORWARD if f < 0 else BACKWARD

    return SimpleNamespace(
        stick=stick, slip=slip, forward_limit=forward_limit, backward_limit=backward_limit,
        tip_velocity=tip_velocity, bring_to_rest=bring_to_rest, mode_at_rest=mode_at_rest,
    )  # fmt: skip

