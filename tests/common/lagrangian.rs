//! The linkage from first principles: positions of the three bodies, energies, forces and the constraint,
//! differentiated exactly by second-order forward arithmetic. Nothing here knows the reduced form that the
//! library solves.

#![allow(dead_code)] // each test program uses a part

use crate::blade::Parts;
use nalgebra::{Matrix3, Matrix4, SVector, Vector3, Vector4};
use std::ops::{Add, Mul, Sub};

/// Coordinates `(v, u, theta, phi)` and their rates: variables of the second-order arithmetic.
const N: usize = 8;

/// A number with its gradient and Hessian with respect to the coordinates and their rates.
#[derive(Clone, Copy)]
pub struct Jet {
    value: f64,
    gradient: [f64; N],
    hessian: [[f64; N]; N],
}

impl Jet {
    fn constant(value: f64) -> Self {
        Self { value, gradient: [0.0; N], hessian: [[0.0; N]; N] }
    }

    fn variable(index: usize, value: f64) -> Self {
        let mut jet = Self::constant(value);
        jet.gradient[index] = 1.0;
        jet
    }

    /// `f(self)` by the chain rule from `f`, `f'` and `f''`.
    fn chain(self, f: f64, first: f64, second: f64) -> Self {
        let g = self.gradient;
        let hessian = std::array::from_fn(|i| {
            std::array::from_fn(|j| first * self.hessian[i][j] + second * g[i] * g[j])
        });
        Self { value: f, gradient: g.map(|x| first * x), hessian }
    }

    fn sin(self) -> Self {
        self.chain(self.value.sin(), self.value.cos(), -self.value.sin())
    }

    fn cos(self) -> Self {
        self.chain(self.value.cos(), -self.value.sin(), -self.value.cos())
    }

    fn squared(self) -> Self {
        self * self
    }
}

impl Add for Jet {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            gradient: std::array::from_fn(|i| self.gradient[i] + other.gradient[i]),
            hessian: std::array::from_fn(|i| {
                std::array::from_fn(|j| self.hessian[i][j] + other.hessian[i][j])
            }),
        }
    }
}

impl Sub for Jet {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + other * Self::constant(-1.0)
    }
}

#[allow(clippy::suspicious_arithmetic_impl)] // the product rule adds
impl Mul for Jet {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let (a, b) = (self.gradient, other.gradient);
        let hessian = |i: usize, j: usize| {
            self.value * other.hessian[i][j] + other.value * self.hessian[i][j] + a[i] * b[j] + a[j] * b[i]
        };
        Self {
            value: self.value * other.value,
            gradient: std::array::from_fn(|i| self.value * b[i] + other.value * a[i]),
            hessian: std::array::from_fn(|i| std::array::from_fn(|j| hessian(i, j))),
        }
    }
}

impl Mul<Jet> for f64 {
    type Output = Jet;
    fn mul(self, other: Jet) -> Jet {
        Jet::constant(self) * other
    }
}

/// One state of the linkage with everything that its motion needs.
pub struct Linkage {
    kinetic: Jet,
    potential: Jet,
    /// Half the power that the dampers take (Rayleigh's function).
    dissipation: Jet,
    /// Position of the tip along the sweep and upwards.
    tip: [Jet; 2],
    rates: [f64; 4],
    parts: Parts,
}

/// The answer to a friction force: accelerations of `(v, u, theta, phi)` and the normal force.
pub struct Answer {
    /// Accelerations; the first is the given one.
    pub accelerations: [f64; 4],
    /// Normal force on the tip, N.
    pub normal_n: f64,
}

fn position(q: &[Jet; 4], along_neck: f64, along_lip: f64) -> [Jet; 2] {
    let [v, u, theta, phi] = *q;
    [
        v + along_neck * theta.sin() + along_lip * phi.sin(),
        Jet::constant(0.0) - u - along_neck * theta.cos() - along_lip * phi.cos(),
    ]
}

/// Velocity of that point: its position differentiated by hand once.
fn velocity(q: &[Jet; 4], rates: &[Jet; 4], along_neck: f64, along_lip: f64) -> [Jet; 2] {
    let [theta, phi] = [q[2], q[3]];
    [
        rates[0] + along_neck * (theta.cos() * rates[2]) + along_lip * (phi.cos() * rates[3]),
        Jet::constant(0.0) - rates[1]
            + along_neck * (theta.sin() * rates[2])
            + along_lip * (phi.sin() * rates[3]),
    ]
}

impl Linkage {
    /// The linkage at coordinates and rates `(v, u, theta, phi)`; `side` is that of the shoulder the neck
    /// leans on, 0 when free.
    pub fn at(parts: &Parts, coordinates: [f64; 4], rates: [f64; 4], side: f64) -> Self {
        let q: [Jet; 4] = std::array::from_fn(|i| Jet::variable(i, coordinates[i]));
        let r: [Jet; 4] = std::array::from_fn(|i| Jet::variable(4 + i, rates[i]));
        let body = |mass: f64, neck: f64, lip: f64| {
            let [x, y] = velocity(&q, &r, neck, lip);
            0.5 * mass * (x.squared() + y.squared())
        };
        let [m0, m1, m2] = parts.m;
        let ([g1, g2], [l1, l2]) = (parts.g, parts.l);
        let turning = 0.5 * parts.j[0] * r[2].squared() + 0.5 * parts.j[1] * r[3].squared();
        let kinetic = body(m0, 0.0, 0.0) + body(m1, g1, 0.0) + body(m2, l1, g2) + turning;
        let support = Jet::constant(parts.hd) - q[1];
        let [angle, stiffness, damping] = parts.shoulder.filter(|_| side != 0.0).unwrap_or_default();
        let lean = q[2] - Jet::constant(side * angle);
        let potential = 0.5 * parts.k[0] * support.squared()
            + 0.5 * parts.k[1] * q[2].squared()
            + 0.5 * parts.k[2] * (q[3] - q[2]).squared()
            + 0.5 * stiffness * lean.squared();
        let dissipation = 0.5 * parts.c[0] * r[1].squared()
            + 0.5 * (parts.c[1] + damping) * r[2].squared()
            + 0.5 * parts.c[2] * (r[3] - r[2]).squared();
        let tip = position(&q, l1, l2);
        Self { kinetic, potential, dissipation, tip, rates, parts: *parts }
    }

    /// Kinetic plus potential energy, J.
    pub fn energy_j(&self) -> f64 {
        self.kinetic.value + self.potential.value
    }

    /// Rate of that energy along these accelerations, W.
    pub fn energy_rate_w(&self, accelerations: &[f64; 4]) -> f64 {
        let gradient = (self.kinetic + self.potential).gradient;
        (0..4).map(|i| gradient[i] * self.rates[i] + gradient[4 + i] * accelerations[i]).sum()
    }

    /// Acceleration of the tip along the sweep, m/s2.
    pub fn tip_acceleration(&self, accelerations: &[f64; 4]) -> f64 {
        second_rate(&self.tip[0], &self.rates, accelerations)
    }

    /// Lagrange's equations with the constraint that the tip stays on the glass: the head's acceleration
    /// along the sweep and the friction force are given; `u`, `theta`, `phi` and the normal force follow.
    pub fn answer(&self, head_acceleration: f64, friction_n: f64) -> Answer {
        let lagrangian = self.kinetic - self.potential;
        // unknowns in comparable units: accelerations of lengths, the normal force per total mass
        let mass: f64 = self.parts.m.iter().sum();
        let length = [1.0, 1.0, self.parts.l[0], self.parts.l[1]];
        let mut matrix = Matrix4::zeros();
        let mut right = Vector4::zeros();
        for row in 0..3 {
            let i = row + 1;
            let unit = length[i] * mass;
            for column in 0..3 {
                matrix[(row, column)] = lagrangian.hessian[4 + i][5 + column] / (length[column + 1] * unit);
            }
            matrix[(row, 3)] = -self.tip[1].gradient[i] * mass / unit;
            let carried: f64 = (0..4).map(|j| lagrangian.hessian[4 + i][j] * self.rates[j]).sum();
            let given = friction_n * self.tip[0].gradient[i] - self.dissipation.gradient[4 + i];
            right[row] =
                (lagrangian.gradient[i] - carried - lagrangian.hessian[4 + i][4] * head_acceleration + given)
                    / unit;
        }
        for column in 0..3 {
            matrix[(3, column)] = self.tip[1].gradient[column + 1] / length[column + 1];
        }
        right[3] = -second_rate(&self.tip[1], &self.rates, &[0.0; 4]);
        let x: SVector<f64, 4> = matrix.full_piv_lu().solve(&right).expect("a regular linkage");
        let accelerations = [head_acceleration, x[0], x[1] / length[2], x[2] / length[3]];
        Answer { accelerations, normal_n: x[3] * mass }
    }
}

impl Linkage {
    /// Lagrange's equations without contact: the head's acceleration along the sweep is given, `u`, `theta`
    /// and `phi` follow.
    pub fn flight(&self, head_acceleration: f64) -> [f64; 4] {
        let lagrangian = self.kinetic - self.potential;
        let forces = std::array::from_fn(|row| {
            let i = row + 1;
            let carried: f64 = (0..4).map(|j| lagrangian.hessian[4 + i][j] * self.rates[j]).sum();
            lagrangian.gradient[i]
                - carried
                - lagrangian.hessian[4 + i][4] * head_acceleration
                - self.dissipation.gradient[4 + i]
        });
        let [u, theta, phi] = self.response(forces);
        [head_acceleration, u, theta, phi]
    }

    /// Changes of the rates of `u`, `theta` and `phi` by an impulse on the tip, upwards and along the sweep.
    pub fn blow(&self, upwards: f64, along: f64) -> [f64; 3] {
        self.response(std::array::from_fn(|row| {
            upwards * self.tip[1].gradient[row + 1] + along * self.tip[0].gradient[row + 1]
        }))
    }

    /// Velocity of the tip, along the sweep and upwards, that rates of `u`, `theta` and `phi` alone give.
    pub fn tip_velocity(&self, rates: [f64; 3]) -> [f64; 2] {
        [0, 1].map(|axis: usize| (0..3).map(|row| self.tip[axis].gradient[row + 1] * rates[row]).sum())
    }

    /// Acceleration of the tip upwards, m/s2.
    pub fn tip_rise_acceleration(&self, accelerations: &[f64; 4]) -> f64 {
        second_rate(&self.tip[1], &self.rates, accelerations)
    }

    /// Inverse of the mass matrix of `(u, theta, phi)` times generalised forces.
    fn response(&self, forces: [f64; 3]) -> [f64; 3] {
        let length = [1.0, self.parts.l[0], self.parts.l[1]];
        let matrix = Matrix3::from_fn(|row, column| {
            self.kinetic.hessian[5 + row][5 + column] / (length[row] * length[column])
        });
        let right = Vector3::from_fn(|row, _| forces[row] / length[row]);
        let x = matrix.full_piv_lu().solve(&right).expect("a regular linkage");
        std::array::from_fn(|row| x[row] / length[row])
    }
}

/// Second time derivative of a function of the coordinates.
fn second_rate(of: &Jet, rates: &[f64; 4], accelerations: &[f64; 4]) -> f64 {
    let curved: f64 = (0..4)
        .flat_map(|i| (0..4).map(move |j| (i, j)))
        .map(|(i, j)| of.hessian[i][j] * rates[i] * rates[j])
        .sum();
    curved + (0..4).map(|i| of.gradient[i] * accelerations[i]).sum::<f64>()
}
