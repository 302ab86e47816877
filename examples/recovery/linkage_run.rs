//! Runs of the linkage by Lagrange's equations. They use neither equations nor integrator nor events of the
//! library.

use crate::blade::Parts;
use crate::lagrangian::Linkage;
use std::f64::consts::TAU;
use wiperlab::simulate::scene::{Scene, StartKind};

/// Angles of neck and lip, rad, and their rates, rad/s.
type State = [f64; 4];

/// Positions of a blade at one instant: head along the sweep, its drop, tip along the sweep, its height, m,
/// and the angle of the lip, rad.
#[derive(Clone, Copy)]
pub struct Place {
    pub head_x_m: f64,
    pub drop_m: f64,
    pub tip_x_m: f64,
    pub tip_height_m: f64,
    pub lip_rad: f64,
}

/// A blade on a drive with a cosine motion. `direction` is the sign of the tip's speed, 0 while it sticks.
/// `side` is the sign of the neck's angle while the neck leans on the shoulder, otherwise 0.
struct Sweep {
    parts: Parts,
    amplitude_m: f64,
    omega: f64,
    direction: f64,
    side: f64,
}

/// A run that did not reach its end: the tip lost contact or jammed, there were more than [`MOST_EVENTS`]
/// events, or the scene starts in no given state.
pub struct Stopped;

/// Largest number of events of a run.
const MOST_EVENTS: usize = 20_000;

/// Places of the blade of a scene at `count` times, `step_s` apart from the start of the scene on. The
/// classical Runge-Kutta scheme makes one step from each time to the next; a step ends early where stick,
/// slip or contact with the shoulder begins or ends.
pub fn run_linkage(scene: &Scene, step_s: f64, count: usize) -> Result<Vec<Place>, Stopped> {
    let StartKind::State(pose) = scene.start else { return Err(Stopped) };
    let number = |name: &str| scene.value(name).unwrap_or(0.0);
    let parts = read_parts(scene);
    let mut sweep = Sweep {
        parts,
        amplitude_m: number("drive.amplitude_m"),
        omega: TAU * number("drive.frequency_hz"),
        direction: 0.0,
        side: 0.0,
    };
    let mut y = [pose.theta, pose.phi, pose.theta_rate, pose.phi_rate];
    let mut t = scene.start_s;
    sweep.side = if y[0].abs() > sweep.shoulder_rad() { y[0].signum() } else { 0.0 };
    sweep.direction = sweep.tip_speed(t, &y).signum();
    let mut places = vec![sweep.place(t, &y)];
    let mut events = 0;
    let mut start = sweep.guards(t, &y);
    while places.len() < count {
        let h = scene.start_s + places.len() as f64 * step_s - t;
        let next = sweep.step(t, &y, h);
        let end = sweep.guards(t + h, &next);
        if end[2] <= 0.0 || end[2].is_nan() {
            return Err(Stopped);
        }
        // the guard that first falls below zero ends the step
        let crossed = (0..2).filter(|&g| end[g] < 0.0);
        let first = crossed.map(|g| (sweep.crossing(t, &y, h, g, [start[g], end[g]]), g));
        let Some((within, guard)) = first.min_by(|a, b| a.0.total_cmp(&b.0)) else {
            (t, y, start) = (t + h, sweep.without_drift(t + h, next), end);
            places.push(sweep.place(t, &y));
            continue;
        };
        y = sweep.step(t, &y, within);
        t += within;
        events += 1;
        if guard == 1 {
            sweep.side = if sweep.side == 0.0 { y[0].signum() } else { 0.0 };
        } else {
            sweep.direction = sweep.decide_direction(t, &y);
            y = sweep.without_drift(t, y);
        }
        if events > MOST_EVENTS {
            return Err(Stopped);
        }
        start = sweep.guards(t, &y);
    }
    Ok(places)
}

impl Sweep {
    fn shoulder_rad(&self) -> f64 {
        self.parts.shoulder.map_or(f64::INFINITY, |[angle, ..]| angle)
    }

    /// Position, m, velocity, m/s, and acceleration, m/s^2, of the head.
    fn head(&self, t: f64) -> [f64; 3] {
        let (a, (sin, cos)) = (self.amplitude_m, (self.omega * t).sin_cos());
        [a * (1.0 - cos), a * self.omega * sin, a * self.omega * self.omega * cos]
    }

    fn tip_speed(&self, t: f64, y: &State) -> f64 {
        let [l1, l2] = self.parts.l;
        self.head(t)[1] + l1 * y[0].cos() * y[2] + l2 * y[1].cos() * y[3]
    }

    fn place(&self, t: f64, y: &State) -> Place {
        let ([l1, l2], head_x_m) = (self.parts.l, self.head(t)[0]);
        Place {
            head_x_m,
            drop_m: l1 * (1.0 - y[0].cos()) + l2 * (1.0 - y[1].cos()),
            tip_x_m: head_x_m + l1 * y[0].sin() + l2 * y[1].sin(),
            tip_height_m: 0.0,
            lip_rad: y[1],
        }
    }

    /// The state; if the tip sticks, with a rate of the lip for which the tip is exactly at rest.
    fn without_drift(&self, t: f64, mut y: State) -> State {
        if self.direction == 0.0 {
            y[3] -= self.tip_speed(t, &y) / (self.parts.l[1] * y[1].cos());
        }
        y
    }

    /// Accelerations of neck and lip, normal force, and acceleration of the tip: without friction, and the
    /// changes for each newton of friction.
    fn responses(&self, t: f64, y: &State) -> [[f64; 4]; 2] {
        let ([x, v, a], [l1, l2]) = (self.head(t), self.parts.l);
        let drop = l1 * (1.0 - y[0].cos()) + l2 * (1.0 - y[1].cos());
        let drop_rate = l1 * y[0].sin() * y[2] + l2 * y[1].sin() * y[3];
        let linkage = Linkage::at(&self.parts, [x, drop, y[0], y[1]], [v, drop_rate, y[2], y[3]], self.side);
        let [free, pulled] = [0.0, 1.0].map(|force| {
            let answer = linkage.answer(a, force);
            let [_, _, theta, phi] = answer.accelerations;
            [theta, phi, answer.normal_n, linkage.tip_acceleration(&answer.accelerations)]
        });
        [free, std::array::from_fn(|i| pulled[i] - free[i])]
    }

    /// Friction and normal force on the tip, N, and accelerations of the angles.
    fn forces(&self, t: f64, y: &State) -> [f64; 4] {
        let [free, by_force] = self.responses(t, y);
        let friction = if self.direction == 0.0 {
            -free[3] / by_force[3]
        } else {
            let [a, b, c] = self.parts.friction;
            let mu = self.direction * (a * (-b * self.tip_speed(t, y).abs()).exp() + c);
            -mu * free[2] / (1.0 + mu * by_force[2])
        };
        let along = |i: usize| free[i] + friction * by_force[i];
        [friction, along(2), along(0), along(1)]
    }

    /// Quantities that are positive while the mode lasts: the speed of the slip or the friction that the
    /// stick has left, the angle between the neck and the contact with the shoulder, and the normal force.
    fn guards(&self, t: f64, y: &State) -> [f64; 3] {
        let [friction, normal, ..] = self.forces(t, y);
        let [a, _, c] = self.parts.friction;
        let of_mode = match self.direction {
            0.0 => (a + c) * normal - friction.abs(),
            direction => direction * self.tip_speed(t, y),
        };
        let lean = match self.side {
            0.0 => self.shoulder_rad() - y[0].abs(),
            side => side * y[0] - self.shoulder_rad(),
        };
        [of_mode, lean, normal]
    }

    /// Sign of the speed with which a tip at rest starts to slide; 0 if friction holds it.
    fn decide_direction(&mut self, t: f64, y: &State) -> f64 {
        self.direction = 0.0;
        let [friction, normal, ..] = self.forces(t, y);
        let [a, _, c] = self.parts.friction;
        if friction.abs() < (a + c) * normal { 0.0 } else { -friction.signum() }
    }

    fn step(&self, t: f64, y: &State, h: f64) -> State {
        let rates = |t: f64, y: &State| {
            let [_, _, theta, phi] = self.forces(t, y);
            [y[2], y[3], theta, phi]
        };
        let along = |k: &State, share: f64| -> State { std::array::from_fn(|i| y[i] + share * h * k[i]) };
        let k1 = rates(t, y);
        let k2 = rates(t + 0.5 * h, &along(&k1, 0.5));
        let k3 = rates(t + 0.5 * h, &along(&k2, 0.5));
        let k4 = rates(t + h, &along(&k3, 1.0));
        std::array::from_fn(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]))
    }

    /// Time from the start of a step of length `h` to the zero of a guard, by the Illinois method. It is `h`
    /// for a guard that is not above zero at the start.
    fn crossing(&self, t: f64, y: &State, h: f64, guard: usize, [start, end]: [f64; 2]) -> f64 {
        if start <= 0.0 {
            return h;
        }
        let (mut low, mut high, small) = ((0.0, start), (h, end), 1e-12 * (start - end));
        for _ in 0..40 {
            let middle = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
            let found = self.guards(t + middle, &self.step(t, y, middle))[guard];
            if found.abs() <= small {
                return middle;
            }
            if found > 0.0 {
                low = (middle, found);
                high.1 *= 0.5;
            } else {
                high = (middle, found);
                low.1 *= 0.5;
            }
        }
        high.0
    }
}

/// Reads the parts of the blade of a scene.
fn read_parts(scene: &Scene) -> Parts {
    let v = |name: &str| scene.value(name).unwrap_or(0.0);
    let of = |part: &str, what: &str| v(&format!("blade.{part}_{what}"));
    Parts {
        m: ["head", "neck", "lip"].map(|part| of(part, "mass_kg")),
        l: ["neck", "lip"].map(|part| of(part, "length_m")),
        g: ["neck", "lip"].map(|part| of(part, "centre_m")),
        j: ["neck", "lip"].map(|part| of(part, "inertia_kg_m2")),
        k: [
            of("head", "stiffness_n_per_m"),
            of("neck", "stiffness_n_m_per_rad"),
            of("lip", "stiffness_n_m_per_rad"),
        ],
        c: [
            of("head", "damping_n_s_per_m"),
            of("neck", "damping_n_m_s_per_rad"),
            of("lip", "damping_n_m_s_per_rad"),
        ],
        hd: v("blade.preload_displacement_m"),
        friction: ["friction.a", "friction.b_s_per_m", "friction.c"].map(v),
        shoulder: Some(
            ["contact_angle_rad", "stiffness_n_m_per_rad", "damping_n_m_s_per_rad"]
                .map(|what| v(&format!("shoulder.{what}"))),
        ),
    }
}
