//! The blade of the scene: the same equations as `c/blade.h`, which see for the notation.

use std::f64::consts::TAU;

/// Far above the rounding of a tip velocity and far below what moves a transition, m/s.
pub const OFFSET: f64 = 1e-14;
/// Below these, errors are absolute: rad, rad, rad/s, rad/s.
pub const SCALES: [f64; 4] = [0.1, 0.1, 200.0, 200.0];

#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Mode {
    Stick,
    Forward,
    Backward,
    Lifted,
}

impl Mode {
    pub fn name(self) -> &'static str {
        match self {
            Self::Stick => "stick",
            Self::Forward => "slip+",
            Self::Backward => "slip-",
            Self::Lifted => "flight",
        }
    }

    fn direction(self) -> f64 {
        if self == Self::Backward { -1.0 } else { 1.0 }
    }
}

pub struct Blade {
    l1: f64,
    l2: f64,
    ma: f64,
    mb: f64,
    mc: f64,
    mth: f64,
    mph: f64,
    arm1: f64,
    arm2: f64,
    s11: f64,
    s22: f64,
    s12: f64,
    head: (f64, f64),
    neck: (f64, f64),
    lip: (f64, f64),
    hd: f64,
    a: f64,
    b: f64,
    c: f64,
    amplitude: f64,
    omega: f64,
    pub stop: f64,
}

struct Contact {
    free: [f64; 2],
    per: [f64; 2],
    a_free: f64,
    kappa: f64,
    n_free: f64,
    nu: f64,
    speed: f64,
}

impl Blade {
    pub fn read(scene: &toml::Table) -> Self {
        let n = |table: &str, key: &str| scene[table][key].as_float().unwrap_or_else(|| panic!("{table}.{key} is no number"));
        let b = |key: &str| n("blade", key);
        let (m1, m2, l1, l2) = (b("neck_mass_kg"), b("lip_mass_kg"), b("neck_length_m"), b("lip_length_m"));
        let (g1, g2, mass) = (b("neck_centre_m"), b("lip_centre_m"), b("head_mass_kg") + m1 + m2);
        let (ma, mb, mc) = (m1 * g1 + m2 * l1, m2 * g2, m2 * l1 * g2);
        let mth = b("neck_inertia_kg_m2") + m1 * g1 * g1 + m2 * l1 * l1;
        let mph = b("lip_inertia_kg_m2") + m2 * g2 * g2;
        let spring = |link: &str, inertia: f64| {
            let k = inertia * (TAU * b(&format!("{link}_natural_frequency_hz"))).powi(2);
            (k, 2.0 * b(&format!("{link}_damping_ratio")) * (k * inertia).sqrt())
        };
        let head = spring("head", mass);
        Self {
            l1,
            l2,
            ma,
            mb,
            mc,
            mth,
            mph,
            arm1: ma - mass * l1,
            arm2: mb - mass * l2,
            s11: l1 * (mass * l1 - 2.0 * ma),
            s22: l2 * (mass * l2 - 2.0 * mb),
            s12: mass * l1 * l2 - ma * l2 - mb * l1,
            head,
            neck: spring("neck", mth),
            lip: spring("lip", mph),
            hd: b("preload_force_n") / head.0,
            a: n("friction", "a"),
            b: n("friction", "b_s_per_m"),
            c: n("friction", "c"),
            amplitude: n("drive", "amplitude_m"),
            omega: TAU * n("drive", "frequency_hz"),
            stop: n("run", "stop_s"),
        }
    }

    #[inline]
    fn contact(&self, t: f64, y: &[f64; 4]) -> Contact {
        let Self { l1, l2, ma, mb, mc, .. } = *self;
        let ((st, ct), (sp, cp), (sw, cw)) = (y[0].sin_cos(), y[1].sin_cos(), (self.omega * t).sin_cos());
        let (dt, dp) = (y[2], y[3]);
        let (dt2, dp2) = (dt * dt, dp * dp);
        let (head_speed, head_acceleration) = (self.amplitude * self.omega * sw, self.amplitude * self.omega * self.omega * cw);
        let (drop, drop_rate) = (l1 * (1.0 - ct) + l2 * (1.0 - cp), l1 * st * dt + l2 * sp * dp);
        let n0 = self.arm1 * ct * dt2 + self.arm2 * cp * dp2 - self.head.0 * (drop - self.hd) - self.head.1 * drop_rate;
        let (a11, a22) = (self.mth + self.s11 * st * st, self.mph + self.s22 * sp * sp);
        let a12 = mc * (ct * cp + st * sp) + self.s12 * st * sp;
        let lip = self.lip.0 * (y[1] - y[0]) + self.lip.1 * (dp - dt);
        let neck = self.neck.0 * y[0] + self.neck.1 * dt;
        let sd = mc * (st * cp - ct * sp);
        let b1 = -ma * l1 * ct * st * dt2 + (sd - ma * l2 * cp * st) * dp2 + ma * head_acceleration * ct - lip + neck - n0 * l1 * st;
        let b2 = -(sd + mb * l1 * ct * sp) * dt2 - mb * l2 * cp * sp * dp2 + mb * head_acceleration * cp + lip - n0 * l2 * sp;
        let inverse = 1.0 / (a11 * a22 - a12 * a12);
        let (w1, w2, n1, n2) = (l1 * ct, l2 * cp, self.arm1 * st, self.arm2 * sp);
        let free = [inverse * (a12 * b2 - a22 * b1), inverse * (a12 * b1 - a11 * b2)];
        let per = [inverse * (a22 * w1 - a12 * w2), inverse * (a11 * w2 - a12 * w1)];
        Contact {
            free,
            per,
            a_free: head_acceleration - l1 * st * dt2 - l2 * sp * dp2 + w1 * free[0] + w2 * free[1],
            kappa: w1 * per[0] + w2 * per[1],
            n_free: n0 + n1 * free[0] + n2 * free[1],
            nu: n1 * per[0] + n2 * per[1],
            speed: head_speed + w1 * dt + w2 * dp,
        }
    }

    /// `dy/dt`; stick is held by the exact constraint force.
    #[inline]
    pub fn derivative(&self, mode: Mode, t: f64, y: &[f64; 4]) -> [f64; 4] {
        let c = self.contact(t, y);
        let f = if mode == Mode::Stick { -c.a_free / c.kappa } else { self.sliding_force(&c, mode.direction()) };
        [y[2], y[3], c.free[0] + f * c.per[0], c.free[1] + f * c.per[1]]
    }

    #[inline]
    fn sliding_force(&self, c: &Contact, sigma: f64) -> f64 {
        let mu = sigma * (self.a * (-self.b * sigma * c.speed).exp() + self.c);
        -mu * c.n_free / (1.0 + mu * c.nu)
    }

    /// What falls to zero where the mode ends: both limits of stick, or the tip velocity (and nothing else) in slip.
    #[inline]
    pub fn guards(&self, mode: Mode, t: f64, y: &[f64; 4]) -> [f64; 2] {
        if mode == Mode::Stick {
            let c = self.contact(t, y);
            let f = -c.a_free / c.kappa;
            let limit = (self.a + self.c) * (c.n_free + c.nu * f);
            return [limit + f, limit - f];
        }
        let speed = self.amplitude * self.omega * (self.omega * t).sin() + self.l1 * y[0].cos() * y[2] + self.l2 * y[1].cos() * y[3];
        [mode.direction() * speed + OFFSET, 1.0]
    }

    /// Brings the tip to rest by an impulse on it and tells the mode that follows; `guard` is the one that fell.
    pub fn decide(&self, from: Mode, guard: usize, t: f64, y: &mut [f64; 4]) -> Mode {
        let c = self.contact(t, y);
        let impulse = -c.speed / c.kappa;
        y[2] += impulse * c.per[0];
        y[3] += impulse * c.per[1];
        if from == Mode::Stick {
            return if guard == 0 { Mode::Forward } else { Mode::Backward };
        }
        let c = self.contact(t, y);
        let f = -c.a_free / c.kappa;
        let n = c.n_free + c.nu * f;
        match () {
            () if n > 0.0 && f.abs() <= (self.a + self.c) * n => Mode::Stick,
            () if c.n_free <= 0.0 => Mode::Lifted,
            () if f < 0.0 => Mode::Forward,
            () => Mode::Backward,
        }
    }
}
